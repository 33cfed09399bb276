//! 8 Bytes ⇄ the outside: serial ports, pseudo-terminals, simulated buses, and the clock.
//!
//! [`drive()`] runs a [`crate::wire::Master`] over a [`Link`]; [`serve()`] runs
//! [`crate::wire::Nodes`] on a [`Pty`], [`HookRunner`] or
//! [`PlcRunner`] do what a job asks for besides motion. Knows no byte of the protocol.

mod clock;
mod drive;
mod hands;
mod hooks;
pub mod journal;
mod link;
mod plc;
pub mod ports;
mod priority;
mod pty;
mod serial;
mod serve;
mod serve_plc;
mod sim;
mod trace;

pub use clock::{Clock, Speed};
pub use drive::{Operator, drive};
pub use hands::Hands;
pub use hooks::{Call, HookError, HookRunner, calls, find_programs, shown};
pub use journal::Journal;
pub use link::{Link, LinkError, Paced, Port};
pub use plc::PlcRunner;
pub use priority::Priority;
pub use pty::Pty;
pub use serial::{OpenError, Serial, is_pseudo_terminal, latency_timer_ms, set_latency_timer};
pub use serve::{Serving, serve};
pub use serve_plc::serve_plc;
pub use sim::Sim;
pub use trace::{Trace, TraceError, TraceHeader, TraceLine, TraceReader, TraceSink, Traced, hex};
