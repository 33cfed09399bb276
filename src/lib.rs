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
//! - [`systems`]: the papers' other systems, computed
//! - [`tape`]: the command dump, a CSV file with a seal
//! - [`verify`]: steps against curves; shares nothing with `plan` and `step`
//! - [`plot`]: numbers as drawings
//! - [`wire`]: steps ⇄ bytes: lint, master and node, without a clock or a device
//! - [`wire_io`]: serial ports, pseudo-terminals and simulated nodes
//!
//! A stage may use those before it as ARCHITECTURE.md draws them; a test holds the arrows.

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
