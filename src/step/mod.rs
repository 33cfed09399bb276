//! 5 Profile → Tick: the only place where mm become steps.
//!
//! Positions are sampled at the boundaries of ticks and rounded; counts are differences of
//! rounded absolute positions. So no axis is ever more than half a step off at a boundary, no
//! error adds up, and the end point is exact:
//!
//! ```text
//! q(k) = round(x(k) · steps_per_mm)      n(k) = q(k) - q(k-1)
//! ```
//!
//! This stage plans nothing: where the machine is at a boundary is the profile's answer.

mod summary;
pub mod thesis;

pub use summary::{Seam, SeamKind, Summary};

use std::iter::Fuse;

use crate::base::{Axis, AxisMap, Command, Machine, Point, Tick};
use crate::plan::{Moment, Planned, Profile};

/// Interpolates a plan into ticks and events; errors of the source pass through.
pub fn interpolate<E, I>(plan: I, machine: &Machine, start_mm: Point) -> Interpolator<Fuse<I>>
where
    I: Iterator<Item = Result<Planned, E>>,
{
    Interpolator {
        plan: plan.fuse(),
        tick_s: machine.bus.tick_s(),
        axes: machine.axes.iter().map(|axis| (axis.axis, axis.steps_per_mm)).collect(),
        steps: machine.nearest_steps(&start_mm),
        done: 0,
        profile: None,
        waiting: None,
    }
}

/// See [`interpolate`].
#[derive(Debug)]
pub struct Interpolator<I> {
    plan: I,
    tick_s: f64,
    /// The machine's axes and their steps a mm.
    axes: Vec<(Axis, f64)>,
    /// Rounded position at the last boundary.
    steps: AxisMap<i64>,
    /// Ticks given out.
    done: u64,
    /// The profile under way; it may have ended within the tick that comes next.
    profile: Option<Box<Profile>>,
    /// What the plan brought before the tick under way was over.
    waiting: Option<Planned>,
}

impl<E, I: Iterator<Item = Result<Planned, E>>> Iterator for Interpolator<I> {
    type Item = Result<Command, E>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(profile) = &self.profile
                && self.done < profile.end.tick
            {
                let position = profile.position_at(self.done + 1, self.tick_s);
                return Some(Ok(Command::Tick(self.tick_to(&position))));
            }
            let next = match self.waiting.take() {
                Some(next) => Some(next),
                None => match self.plan.next() {
                    Some(Ok(next)) => Some(next),
                    Some(Err(error)) => return Some(Err(error)),
                    None => None,
                },
            };
            if self.rests_before(next.as_ref()) {
                self.waiting = next;
                return self.last_tick().map(|tick| Ok(Command::Tick(tick)));
            }
            match next? {
                Planned::Event(event) => return Some(Ok(Command::Event(event))),
                Planned::Profile(profile) => self.profile = Some(profile),
            }
        }
    }
}

impl<I> Interpolator<I> {
    /// Whether the tick in which the last profile ended is over before what comes next begins.
    fn rests_before(&self, next: Option<&Planned>) -> bool {
        let unfinished = self.profile.as_ref().is_some_and(|profile| profile.end.share > 0.0);
        unfinished
            && match next {
                Some(Planned::Profile(next)) => next.start >= Moment::at(self.done + 1),
                Some(Planned::Event(_)) | None => true,
            }
    }

    /// The tick in which the last profile ended, at rest there until its boundary.
    fn last_tick(&mut self) -> Option<Tick> {
        let end_mm = self.profile.as_ref()?.end_mm();
        let tick = self.tick_to(&end_mm);
        self.profile = None;
        Some(tick)
    }

    /// The steps from the last boundary to a position.
    fn tick_to(&mut self, position_mm: &Point) -> Tick {
        let mut counts = AxisMap::default();
        for &(axis, steps_per_mm) in &self.axes {
            let steps = (position_mm[axis] * steps_per_mm).round_ties_even() as i64;
            counts[axis] = (steps - self.steps[axis]) as i32;
            self.steps[axis] = steps;
        }
        self.done += 1;
        let (buffer, line) =
            self.profile.as_ref().map_or((0, 0), |profile| (profile.buffer, profile.segment.line));
        Tick { buffer, line, counts }
    }
}
