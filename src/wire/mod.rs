//! 7 Command ⇄ bytes on the bus: the protocol of the nodes, without a clock and without IO.
//!
//! [`Job`] cuts commands in node buffers, [`lint()`] proves that no node can take data for a
//! command, [`Master`] sends a job, [`Firmware`] is the other end: [`Node`] with a buffer, or one that
//! takes a frame a tick ([`frames`]); [`Faults`] what may go wrong between. Time is an argument, in microseconds. What drives them stands in `wire_io`.

mod blocks;
pub mod codec;
mod direct;
mod error;
mod firmware;
mod frame;
pub mod frames;
mod in_force;
mod inject;
mod job;
mod lint;
mod live;
mod master;
mod node;
mod nodes;
mod order;
mod pacing;
mod places;
mod replay;
mod report;
mod seal;
mod splice;

pub use blocks::single_blocks;
pub use direct::{Audit, Direct, DirectError, Home, HomeRun, RawJog, homing, raw_jog};
pub use error::JobError;
pub use firmware::Firmware;
pub use in_force::InForce;
pub use inject::{FaultKind, FaultSpec, FaultSpecError, Faults, Phase, Random, Struck, Who};
pub use job::{Buffer, Fill, Job, Step};
pub use lint::{Proof, lint};
pub use live::{AxisReading, Live, Reading, SpindleReading};
pub use master::{Master, MasterEvent, Progress, Timing};
pub use node::{ANSWER_PAUSE_US, Activity, HOME_STEPS, Happening, Node, Run};
pub use nodes::{Entry, ExecutedTick, Nodes};
pub use pacing::{Pacing, PacingFigures, SLIDE_US};
pub use places::EventBlock;
pub use replay::{Answer, Difference, Planned, Reached, Replay, in_step, reached};
pub use report::{AxisEnd, Doubt, During, End, Ending, Fault, Position};
