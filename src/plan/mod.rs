//! 4 Segment → Profile: when the machine is where on the path.
//!
//! Every piece of the path gets its speed over time, on one continuous time axis; a tick does not
//! begin anew at each block. The passes, each in its file:
//!
//! 1. `blend`: corners under G64 rounded within their tolerance;
//! 2. `limits`, `cuts`, `piece`, `grip`: segments cut so short that one acceleration does for a piece, how fast
//!    axes, bus and tick let it go, and which changes of speed the axes can follow;
//! 3. `junction`: how fast the path may be where segments meet;
//! 4. `lookahead`: the greatest speeds within all that, over the whole program;
//! 5. `jerk`: where axes have a limit on jerk, accelerations that change evenly;
//! 6. `seams`: where node buffers end, at rest; decided before, in a run of its own;
//! 7. `schedule`: pieces with speeds put on the time axis, buffers and ticks.
//!
//! [`explain`] tells why each block is as fast as it is, [`survey`] what each seam costs.
//!
//! This stage knows no steps: it never rounds a position.

mod blend;
mod bound;
mod clock;
mod corner;
mod cost;
mod cuts;
mod decisions;
mod explain;
mod extreme;
mod grip;
mod groups;
mod hairpin;
mod jerk;
mod junction;
mod limits;
mod lookahead;
mod piece;
mod places;
mod ramp;
mod schedule;
mod seams;
mod source;
mod stop;
mod survey;

pub use bound::Bound;
pub use clock::Moment;
pub use explain::{BlockSpeed, Explainer, explain};
pub use ramp::{Leg, Ramp};
pub use schedule::Planner;
pub use seams::{Seam, SeamKind, Seams, place};
pub use survey::{NextBest, SeamCost, SeamReport, survey};

use std::sync::Arc;

use crate::base::{Event, Machine, Point};
use crate::path::{Curve, PathItem, Segment};

/// How far a curve turns along a chord of a drawing at most: 2 degrees.
const CHORD_TURN_RAD: f64 = std::f64::consts::TAU / 180.0;

/// Chords of a drawing from rest to the greatest speed.
const SPEED_PARTS: f64 = 8.0;

/// How speed is planned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Feed {
    /// As fast as the machine can follow, with look-ahead.
    #[default]
    LookAhead,
    /// The same, at rest at the end of every block.
    ExactStop,
    /// The feed throughout, without ramps (seed 004, section 6.5.2): for comparison, and for
    /// drivers that ramp by themselves.
    Constant,
}

/// An item of the plan.
#[derive(Clone, Debug, PartialEq)]
pub enum Planned {
    /// Motion along a piece of the path.
    Profile(Box<Profile>),
    /// Something that happens at rest, on a tick boundary.
    Event(Event),
    /// A node buffer ends and the next begins, at rest, on a tick boundary.
    Seam(SeamKind),
}

/// Motion along a piece of a segment.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// The segment.
    pub segment: Arc<Segment>,
    /// Where on the segment the piece starts and ends, as shares of its way.
    pub shares: [f64; 2],
    /// Distance along the piece over time.
    pub ramp: Ramp,
    /// When the piece starts.
    pub start: Moment,
    /// When the piece ends.
    pub end: Moment,
    /// Node buffer that its ticks lie in.
    pub buffer: u32,
    /// What set the speed.
    pub bound: Bound,
}

impl Profile {
    /// Share of the segment's way done at a tick boundary between the piece's start and end; exactly that of
    /// its end there.
    fn segment_share_at(&self, boundary: u64, tick_s: f64) -> f64 {
        let [from, to] = self.shares;
        if boundary == self.end.tick && self.end.share == 0.0 {
            return to;
        }
        let time_s = self.start.ticks_until(boundary) * tick_s;
        let share = self.ramp.distance_mm(time_s) / self.ramp.length_mm();
        if share >= 1.0 { to } else { from + (to - from) * share }
    }

    /// Position at a tick boundary between the piece's start and end.
    pub fn position_at(&self, boundary: u64, tick_s: f64) -> Point {
        self.segment.point_at(self.segment_share_at(boundary, tick_s))
    }

    /// The same in X, Y and Z.
    fn xyz_at(&self, boundary: u64, tick_s: f64) -> [f64; 3] {
        self.segment.xyz_at(self.segment_share_at(boundary, tick_s))
    }

    /// The piece as chords, each with its mean speed: where it begins, where it ends, mm/s. So short that
    /// the speed hardly changes along one, and a curve's direction by less than 2 degrees.
    pub fn chords(&self) -> impl Iterator<Item = (Point, Point, f64)> {
        let turn_rad = match &self.segment.curve {
            Curve::Line => 0.0,
            Curve::Arc(arc) => arc.sweep_rad.abs() * (self.shares[1] - self.shares[0]),
            Curve::Spline(_) => CHORD_TURN_RAD,
        };
        let [entry, exit] = [self.ramp.entry_mm_s(), self.ramp.exit_mm_s()];
        let changes = f64::max(self.ramp.peak_mm_s() - entry.min(exit), 0.0);
        let by_speed = (SPEED_PARTS * changes / self.ramp.peak_mm_s()).ceil();
        let count = by_speed.max((turn_rad / CHORD_TURN_RAD).ceil()).max(1.0);
        let (duration_s, length_mm) = (self.ramp.duration_s(), self.ramp.length_mm());
        let place = move |k: f64| {
            let share = self.ramp.distance_mm(duration_s * k / count) / length_mm;
            let [from, to] = self.shares;
            (share, self.segment.point_at(from + (to - from) * share))
        };
        let mut last = place(0.0);
        (1..=count as u64).map(move |k| {
            let next = place(k as f64);
            let (before, at) = std::mem::replace(&mut last, next);
            (at, next.1, (next.0 - before) * length_mm * count / duration_s)
        })
    }

    /// Position at the piece's start.
    pub fn start_mm(&self) -> Point {
        self.segment.point_at(self.shares[0])
    }

    /// Position at the piece's end.
    pub fn end_mm(&self) -> Point {
        self.segment.point_at(self.shares[1])
    }
}

/// Plans a path, item by item, with node buffers that end at the seams; errors of the source pass
/// through.
pub fn plan<'a, E, I>(
    path: I,
    machine: &'a Machine,
    feed: Feed,
    seams: &'a Seams,
    start_mm: Point,
) -> Planner<'a, I>
where
    I: Iterator<Item = Result<PathItem, E>>,
{
    Planner::new(path, machine, feed, seams, start_mm)
}
