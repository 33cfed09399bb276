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
//! 6. `seams`: where node buffers end, at rest; decided before, in a plan of its own;
//! 7. `schedule`: pieces with speeds put on the time axis, buffers and ticks.
//!
//! From 2 to 7 a piece stays in one box, a `run`, and comes out as a `profile`. Those of whole segments, and
//! profiles that nobody holds, are used again.
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
mod hop;
mod jerk;
mod junction;
mod limits;
mod lookahead;
mod piece;
mod places;
mod profile;
mod ramp;
mod run;
mod schedule;
mod seams;
mod source;
mod stop;
mod survey;

pub use bound::Bound;
pub use clock::Moment;
pub use explain::{BlockSpeed, Explainer, explain};
pub use profile::Profile;
pub use ramp::{Leg, Ramp};
pub use schedule::Planner;
pub use seams::{Seam, SeamKind, Seams, place};
pub use survey::{NextBest, SeamCost, SeamReport, survey};

use std::rc::Rc;

use crate::base::{Event, Machine, Point};
use crate::path::PathItem;

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
    /// Motion along a piece of the path. It is used again once nobody holds it any more.
    Profile(Rc<Profile>),
    /// Something that happens at rest, on a tick boundary.
    Event(Event),
    /// A node buffer ends and the next begins, at rest, on a tick boundary.
    Seam(SeamKind),
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
