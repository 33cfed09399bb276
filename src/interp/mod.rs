//! 2 Block → Motion: what a program means, once modes, units, offsets and calls are resolved.
//!
//! A program is run twice: [`check`] runs it whole and keeps every finding, [`motions`] runs it
//! again and hands out motion as it goes, so that memory does not grow with the program. Both are
//! the same run, and of few motions the first leaves a [`Record`] instead of a second. The order of execution in a block is that of the modal groups in
//! [`crate::gcode::codes`]. Nothing is known here of speeds in time, of steps or of ticks.

mod arc;
mod body;
mod captive;
mod check;
mod classify;
mod compensate;
mod compensation;
mod corner;
mod cycles;
mod duration;
mod engine;
mod evaluate;
mod execute;
mod feed;
mod fillet;
mod findings;
mod flow;
mod frames;
mod functions;
mod hashed;
mod inputs;
mod lenient;
mod macro_variables;
mod macros;
mod modes;
mod motion;
mod motions;
mod moves;
mod names;
mod nurbs;
mod offsets;
mod parameters;
mod plain_move;
mod plunge;
mod polar;
mod probe;
mod program;
mod pulses;
mod record;
mod run;
mod spline;
mod system;
mod systems;
mod threading;
mod tools;
mod travel;
mod turning;
mod turns;
mod words;

pub use arc::FULL_CIRCLE_MM;
pub use captive::is_captive;
pub use check::{Checked, Said, Summary, check, check_and_hash, check_and_record};
pub use motion::{Bound, Corner, Motion, Move, MoveKind};
pub use motions::{Motions, RunError, motions};
pub use record::{Record, Replay};
pub use tools::{Tool, Tools, ToolsError};

use std::path::PathBuf;

use crate::base::Point;
use crate::gcode::LatheSystem;

/// Whose meaning is taken where the same text means one thing here and another there; nothing else
/// hangs on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Dialect {
    /// As LinuxCNC, but `#3000` raises an alarm.
    #[default]
    Iso,
    /// `#3000` is a parameter like others; programs begin with G99.
    LinuxCnc,
    /// Parameters that are not set have no value, those from 1000 on are system variables; P of G4
    /// is in milliseconds; G10 L10 to L13 set tools; FIX and FUP go towards and away from zero; AND
    /// OR XOR work on bits; `M98 P51000` is `M98 P1000 L5`.
    Fanuc,
    /// As `Fanuc`, on a lathe: X words are diameters, U and W distances, and what differs from
    /// mills besides (G code system A).
    FanucLathe,
    /// As `FanucLathe`, by G code system B: G90 and G91 as on mills.
    FanucLatheB,
    /// As LinuxCNC, but programs begin with G98.
    Grbl,
}

impl Dialect {
    /// All of them.
    pub const ALL: [Dialect; 6] = [
        Dialect::Iso,
        Dialect::LinuxCnc,
        Dialect::Fanuc,
        Dialect::FanucLathe,
        Dialect::FanucLatheB,
        Dialect::Grbl,
    ];

    /// Whether it is that of a FANUC-style control.
    pub fn is_fanuc(self) -> bool {
        self == Dialect::Fanuc || self.lathe().is_some()
    }

    /// The system of G codes, if it is that of a lathe.
    pub fn lathe(self) -> Option<LatheSystem> {
        match self {
            Dialect::FanucLathe => Some(LatheSystem::A),
            Dialect::FanucLatheB => Some(LatheSystem::B),
            Dialect::Iso | Dialect::LinuxCnc | Dialect::Fanuc | Dialect::Grbl => None,
        }
    }

    /// Its name on the command line and in dumps.
    pub fn name(self) -> &'static str {
        match self {
            Dialect::Iso => "iso",
            Dialect::LinuxCnc => "linuxcnc",
            Dialect::Fanuc => "fanuc",
            Dialect::FanucLathe => "fanuc-lathe",
            Dialect::FanucLatheB => "fanuc-lathe-b",
            Dialect::Grbl => "grbl",
        }
    }
}

/// What changes the meaning of a program from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// Where the job starts, in machine coordinates; none: at the machine's work zero.
    pub start_mm: Option<Point>,
    /// What the operator makes of the feeds, in percent, where the program lets him (M48, M50);
    /// none: 100.
    pub feed_override_percent: Option<f64>,
    /// Whether to pass over the machine's travel limits.
    pub ignore_travel: bool,
    /// Whose meaning is taken where meanings clash.
    pub dialect: Dialect,
    /// Whether lines that begin with `/` are left out.
    pub block_delete: bool,
    /// Whether words of other controls that mean nothing here are left out, with a warning.
    pub lenient: bool,
    /// Whether the text is no program but typed blocks, which need no end.
    pub typed: bool,
    /// Folders below which subprograms may lie in files of their own, in order of search.
    pub folders: Vec<PathBuf>,
    /// Most passes that all loops, repeats and backward GOTOs of a run may make together; none:
    /// [`MAX_PASSES`].
    pub max_passes: Option<u64>,
    /// The tools, for their lengths and diameters.
    pub tools: Tools,
}

/// Passes of loops that a run may make, unless said otherwise.
pub const MAX_PASSES: u64 = 10_000_000;
