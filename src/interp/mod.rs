//! 2 Block → Motion: what a program means, once modes, units, offsets and calls are resolved.
//!
//! A program is run twice: [`check`] runs it whole and keeps every finding, [`motions`] runs it
//! again and hands out motion as it goes, so that memory does not grow with the program. Both are
//! the same run. The order of execution in a block is that of the modal groups in
//! [`crate::gcode::codes`]. Nothing is known here of speeds in time, of steps or of ticks.

mod arc;
mod check;
mod compensate;
mod compensation;
mod cycles;
mod duration;
mod execute;
mod feed;
mod findings;
mod frames;
mod motion;
mod motions;
mod moves;
mod offsets;
mod program;
mod run;
mod tools;
mod travel;
mod words;

pub use check::{Checked, Summary, check};
pub use motion::{Corner, Motion, Move, MoveKind};
pub use motions::{Motions, RunError, motions};
pub use tools::{Tool, Tools, ToolsError};

use crate::base::Point;

/// What changes the meaning of a program from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// Where the job starts, in machine coordinates; none: at the machine's work zero.
    pub start_mm: Option<Point>,
    /// Whether to pass over the machine's travel limits.
    pub ignore_travel: bool,
    /// The tools, for their lengths and diameters.
    pub tools: Tools,
}
