//! 8 Bytes ⇄ the outside: serial ports, pseudo-terminals, simulated buses, and the clock.
//!
//! [`drive()`] runs a [`crate::wire::Master`] over a [`Link`]; [`serve()`] runs
//! [`crate::wire::Nodes`] on a [`Pty`]. Knows no byte of the protocol.

mod clock;
mod drive;
pub mod journal;
mod link;
pub mod ports;
mod priority;
mod pty;
mod serial;
mod serve;
mod sim;

pub use clock::{Clock, Speed};
pub use drive::{Operator, drive};
pub use journal::Journal;
pub use link::{Link, LinkError, Paced, Port};
pub use priority::Priority;
pub use pty::Pty;
pub use serial::{OpenError, Serial, is_pseudo_terminal, latency_timer_ms, set_latency_timer};
pub use serve::{Serving, serve};
pub use sim::Sim;
