//! NC programs in, synchronised steps out: the stages behind the `cnc` command.
//!
//! An NC program is compiled. Each module is one stage, a function from a stream of one kind of
//! value to a stream of the next; every value can be printed. Only the last stage touches a
//! device or a clock; only the binary talks to a person. An independent reader, [`verify`], holds
//! the result against the drawing and not against the code that made it.
//!
//! ```text
//! text ─gcode▶ Block ─interp▶ Motion ─path▶ Segment ─plan▶ Profile ─step▶ Tick ─wire▶ bytes ─wire_io▶ bus
//!                                              │                           │
//!                                              ╰────────▶ verify ◀─────────┤
//!                                                                          ╰─tape▶ dump
//! ```
//!
//! - [`base`]: what all stages share: axes, machine profiles, ticks and events, diagnostics
//! - [`gcode`]: text → blocks; the table of codes
//! - [`interp`]: blocks → motion: units, offsets and modes resolved, every error of the program told
//! - [`path`]: motion → curves in closed form
//! - [`plan`]: curves → when the machine is where, within the limits of axes and bus
//! - [`step`]: the only place where mm become steps
//! - [`tape`]: the command dump, a CSV file with a seal
//! - [`verify`]: steps against curves; shares nothing with `plan` and `step`
//! - [`plot`]: numbers as drawings
//! - [`wire`]: steps ⇄ bytes: lint, master and node, without a clock or a device
//! - [`wire_io`]: serial ports, pseudo-terminals and simulated nodes
//! - [`systems`]: the papers' other systems, as pure computation
//!
//! A stage may use those before it as ARCHITECTURE.md draws them; a test holds the arrows.
//!
//! # For those who know the host library of the thesis
//!
//! Appendix D of seed 004 lists `SPARCMILL_DCS`, a class with six calls that a program on the PC used
//! to move the machine. What each did is here a stage of its own, and a stage can be tested, replaced and printed.
//!
//! | `SPARCMILL_DCS` | here | what is different |
//! |---|---|---|
//! | the constructor: port name, baud rate | a machine profile ([`Machine::load`](crate::base::Machine::load)) and a link ([`Serial`](crate::wire_io::Serial), [`Sim`](crate::wire_io::Sim)) | nothing about the machine stands in the code: steps a mm, limits, node numbers, period |
//! | `PrepareData(mm, m/min)`: the bytes of one axis | [`plan`](crate::plan::plan()), then [`interpolate`](crate::step::interpolate) and [`codec::encode`](crate::wire::codec::encode) | positions are rounded, not speeds, so the end point is exact; speed is planned within what the axes can follow. The listing's own arithmetic is [`thesis::encode`](crate::step::thesis::encode), for comparison |
//! | `AddtoQueue(dx, dy, dz, m/min)` | [`motions`](crate::interp::motions) and [`segments`](crate::path::segments): the queue is an iterator | lines, arcs, splines, in absolute coordinates; nothing is kept but what look-ahead needs |
//! | `SendData(id, master, bytes)`: fills one node | [`Job::new`](crate::wire::Job::new) and [`lint`](crate::wire::lint()), then the [`Master`](crate::wire::Master) | only nodes that move are filled; every buffer ends with zeros and at rest; it is proved that no node can take data for a command; every answer is checked and has a time-out |
//! | `eXecute()`: fills all nodes, starts them, sends a sync byte a tick | [`drive`](crate::wire_io::drive()) runs the [`Master`](crate::wire::Master) over the link | paced by the clock and not by a reply alone; events between buffers; a stop is a stop at rest; what was acknowledged is known |
//! | `Jog`, `JogStop` | [`raw_jog`](crate::wire::raw_jog), or a short planned job: [`path::jog`] | the firmware's jog has no end but the next byte, and no ramp, so `cnc jog` plans a move instead; `--raw` is the firmware's |
//! | (`h` + ID, not in the class) | [`homing`](crate::wire::homing) | watched by time: a node that homes cannot be stopped |
//!
//! A job from text to executed steps, on virtual nodes in virtual time:
//!
//! ```
//! use cnc::base::{Event, Machine, Source};
//! use cnc::interp::Options;
//! use cnc::wire::{Job, Master, MasterEvent, Nodes, Timing, lint};
//! use cnc::wire_io::{Operator, Sim, drive};
//! use cnc::{interp, path, plan, step};
//!
//! struct Nobody;
//! impl Operator for Nobody {
//!     fn event(&mut self, _: &MasterEvent) {}
//!     fn pause(&mut self, _: &Event) -> bool { false }
//!     fn progress(&mut self, _: &Master) {}
//!     fn interrupts(&mut self) -> usize { 0 }
//! }
//!
//! let machine = Machine::load("starmill")?;
//! let (options, start) = (Options::default(), machine.work_zero_mm);
//! let program = Source::memory("o001.nc", b"G21 G91\nG0 X70 Y20\nX-70 Y-20\nM30\n".to_vec());
//! assert_eq!(interp::check(&program, &machine, &options, 10)?.errors, 0);
//!
//! let path = || path::segments(interp::motions(&program, &machine, &options), &machine);
//! let seams = plan::place(path, &machine, plan::Feed::LookAhead)?;
//! let plan = plan::plan(path(), &machine, plan::Feed::LookAhead, &seams, start);
//! let commands: Result<Vec<_>, _> = step::interpolate(plan, &machine, start).collect();
//!
//! let start_steps = machine.nearest_steps(&start);
//! let job = Job::new(commands?, start_steps, &machine)?;
//! lint(&job, &machine)?;
//! let nodes = Nodes::new(&machine, machine.bus.units(), &start_steps, 1_000_000);
//! let mut master = Master::new(job.clone(), &machine, Timing::new(&machine.bus, 1.0));
//! let ending = drive(&mut Sim::new(nodes), &mut master, &mut Nobody);
//! assert_eq!(ending.end, cnc::wire::End::Done);
//! assert_eq!(job.end_steps, start_steps, "experiment I: back where it started");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! On a machine the link is a [`Serial`](crate::wire_io::Serial) in place of the [`Sim`](crate::wire_io::Sim); the rest stays.

pub mod base;
pub mod gcode;
pub mod interp;
pub mod path;
pub mod plan;
pub mod plot;
pub mod step;
pub mod systems;
pub mod tape;
pub mod verify;
pub mod wire;
pub mod wire_io;
