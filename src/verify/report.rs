//! What verification found, for people and for scripts.

use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;

use super::checks::CHECKS;
use super::sweep::Death;
use crate::base::Axis;
use crate::base::rounding::six_digits;

/// Everything that was found. Serialises to the document of `cnc verify --json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Version of the document.
    pub schema: u32,
    /// Fail if any check failed.
    pub verdict: Verdict,
    /// The bound of the contour error.
    pub tolerance_mm: f64,
    /// The contour error: Fréchet distance between what is executed and the path.
    pub max_contour_error_mm: f64,
    /// Whether the contour error is greater than that, by how much is unknown.
    pub max_contour_error_is_lower_bound: bool,
    /// Root mean square of the distances of tick points from where they belong on the path; none
    /// if the two have too little in common to be matched.
    pub rms_contour_error_mm: Option<f64>,
    /// Where the contour error is greatest: tick, and NC line of the path.
    pub worst: Option<Place>,
    /// The blocks furthest off, furthest first.
    pub worst_blocks: Vec<WorstBlock>,
    /// Executed end point less the path's, both in whole steps.
    pub end_error_steps: BTreeMap<Axis, i64>,
    /// Ticks of motion.
    pub ticks: u64,
    /// Time of those ticks at the host's period.
    pub seconds: f64,
    /// Greatest count of each axis.
    pub max_steps_per_tick: BTreeMap<Axis, u32>,
    /// Greatest excess of the mean speed over 20 ticks above the feed, rounding included.
    pub max_feed_error_percent: Option<f64>,
    /// Time that all cuts would take at their feeds throughout, of the time that they take; none without
    /// cuts.
    pub feed_reached_percent: Option<f64>,
    /// Every check with its value and limit.
    pub limits: Vec<Check>,
    /// Why the verdict is fail, a sentence each.
    pub failures: Vec<String>,
}

/// Whether something holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// It holds.
    Pass,
    /// It does not.
    Fail,
    /// It does not, and need not.
    Reported,
}

/// A tick, and the NC line it belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Default)]
pub struct Place {
    /// The tick, from 0.
    pub tick: u64,
    /// Line of the NC program, from 1; 0 if unknown, which is null in JSON.
    #[serde(serialize_with = "known")]
    pub line: u32,
}

impl Place {
    /// None of a job of so many ticks: it has no motion, and the place is no line's.
    pub(super) fn is_nowhere(&self, ticks: u64) -> bool {
        ticks == 0 && self.line == 0
    }
}

impl From<Death> for Place {
    fn from(death: Death) -> Place {
        Place { tick: death.tick, line: death.line }
    }
}

/// How far a block is off, each time that it comes to be executed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BlockError {
    /// Line of the NC program.
    pub line: u32,
    /// Ticks that end on it, those that move X, Y or Z.
    pub ticks: u64,
    /// The tick where it is furthest off.
    pub tick: u64,
    /// Fréchet distance between the block and what is executed of it: of its tick points, of its corners, and
    /// where one of both turns back what that takes beyond, to a 32nd of the distance of the job. Around corners
    /// that G64 P lets be cut by more than the path tolerance, of points alone.
    #[serde(serialize_with = "rounded")]
    pub max_mm: f64,
    /// The bound of the contour error, and what G64 P lets its corners be cut by beyond the path tolerance.
    #[serde(serialize_with = "rounded")]
    pub allowed_mm: f64,
    /// Root mean square of the distances of its tick points; none without any.
    #[serde(serialize_with = "rounded_if_any")]
    pub rms_mm: Option<f64>,
}

/// The greatest distance of a line's tick points from the path.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct WorstBlock {
    /// Line of the NC program.
    pub line: u32,
    /// The tick furthest off.
    pub tick: u64,
    /// Its distance.
    #[serde(serialize_with = "rounded")]
    pub max_mm: f64,
}

/// One thing that was held against a limit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Check {
    /// What was measured.
    pub check: &'static str,
    /// On which axis, if on one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axis: Option<Axis>,
    /// The greatest value found, by its limit.
    #[serde(serialize_with = "rounded")]
    pub value: f64,
    /// What it may be.
    #[serde(serialize_with = "rounded")]
    pub limit: f64,
    /// Unit of both.
    pub unit: &'static str,
    /// Where it was found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at: Option<Place>,
    /// Whether it holds.
    pub verdict: Verdict,
    /// More about it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

impl Check {
    /// Holds a value against its limit. Rounding of the last digits is forgiven.
    pub fn new(check: &'static str, axis: Option<Axis>, value: f64, limit: f64) -> Check {
        debug_assert!(CHECKS.iter().any(|(name, _)| *name == check), "{check} is not listed");
        let holds = value <= limit * (1.0 + 1e-9);
        let verdict = if holds { Verdict::Pass } else { Verdict::Fail };
        Check { check, axis, value, limit, unit: "", at: None, verdict, note: None }
    }
}

/// As in a list of reasons: `acceleration X: 5.2 steps/tick² at tick 812 (line 14), 4.4 allowed`.
impl fmt::Display for Check {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.check)?;
        self.axis.map_or(Ok(()), |axis| write!(f, " {axis}"))?;
        write!(f, ": {} {}", six_digits(self.value), self.unit)?;
        match self.at {
            None => {}
            Some(Place { tick, line: 0 }) => write!(f, " at tick {tick}")?,
            Some(Place { tick, line }) => write!(f, " at tick {tick} (line {line})")?,
        }
        write!(f, ", allowed {}", six_digits(self.limit))?;
        self.note.as_ref().map_or(Ok(()), |note| write!(f, "; {note}"))
    }
}

fn known<S: serde::Serializer>(line: &u32, to: S) -> Result<S::Ok, S::Error> {
    Some(*line).filter(|line| *line > 0).serialize(to)
}

fn rounded<S: serde::Serializer>(value: &f64, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_f64(six_digits(*value))
}

fn rounded_if_any<S: serde::Serializer>(value: &Option<f64>, to: S) -> Result<S::Ok, S::Error> {
    value.map(six_digits).serialize(to)
}
