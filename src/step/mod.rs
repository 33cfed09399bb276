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

mod course;
mod summary;
pub mod thesis;
mod times;

pub use summary::{Seam, Summary};
pub use times::{BlockTime, Phases, Times};

use std::iter::Fuse;

use crate::base::axis::AXES;
use crate::base::{Axis, AxisMap, Command, Machine, Point, Tick};
use crate::plan::{Moment, Planned};
use course::Course;

/// How many axes X, Y and Z are: the first three.
const XYZ: usize = Axis::LINEAR.len();

/// Interpolates a plan into ticks and events; errors of the source pass through.
pub fn interpolate<E, I>(plan: I, machine: &Machine, start_mm: Point) -> Interpolator<Fuse<I>>
where
    I: Iterator<Item = Result<Planned, E>>,
{
    Interpolator {
        plan: plan.fuse(),
        tick_s: machine.bus.tick_s(),
        steps_per_mm: AxisMap::from_fn(|axis| {
            machine.axis(axis).map_or(0.0, |profile| profile.steps_per_mm)
        }),
        has_xyz_only: machine.axes.iter().all(|profile| (profile.axis as usize) < XYZ),
        steps: machine.nearest_steps(&start_mm),
        done: 0,
        course: None,
        waiting: None,
    }
}

/// See [`interpolate`].
#[derive(Debug)]
pub struct Interpolator<I> {
    plan: I,
    tick_s: f64,
    /// Steps a mm; 0 on axes that the machine lacks.
    steps_per_mm: AxisMap<f64>,
    /// The machine has no axes but X, Y and Z. Else all nine are computed in every tick: a number that is
    /// known beforehand takes no branch, and with three a tick takes two thirds of the instructions.
    has_xyz_only: bool,
    /// Rounded position at the last boundary.
    steps: AxisMap<i64>,
    /// Ticks given out.
    done: u64,
    /// The profile under way; it may have ended within the tick that comes next.
    course: Option<Course>,
    /// What the plan brought before the tick under way was over.
    waiting: Option<Planned>,
}

impl<E, I: Iterator<Item = Result<Planned, E>>> Iterator for Interpolator<I> {
    type Item = Result<Command, E>;

    #[inline]
    fn next(&mut self) -> Option<Self::Item> {
        let boundary = self.done + 1;
        if let Some(course) = &self.course
            && course.holds(boundary)
        {
            let (tick_s, steps_per_mm) = (self.tick_s, &self.steps_per_mm);
            let tick = if self.has_xyz_only {
                let steps = course.steps_at::<XYZ>(boundary, tick_s, steps_per_mm);
                self.tick_to(steps)
            } else {
                let steps = course.steps_at::<AXES>(boundary, tick_s, steps_per_mm);
                self.tick_to(steps)
            };
            return Some(Ok(Command::Tick(tick)));
        }
        self.next_leg()
    }
}

impl<E, I: Iterator<Item = Result<Planned, E>>> Interpolator<I> {
    /// The first boundary of the next leg, or what lies between it and the last one.
    #[inline(never)]
    fn next_leg(&mut self) -> Option<Result<Command, E>> {
        loop {
            let boundary = self.done + 1;
            if let Some(course) = &mut self.course {
                if course.go_on(boundary, self.tick_s) {
                    return self.next();
                }
                if boundary == course.profile().end.tick {
                    let steps = course.end_steps(&self.steps_per_mm);
                    return Some(Ok(Command::Tick(self.tick_to(steps))));
                }
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
                Planned::Seam(_) => {}
                Planned::Profile(profile) => {
                    self.course = Some(Course::new(profile, &self.steps_per_mm))
                }
            }
        }
    }
}

impl<I> Interpolator<I> {
    /// Whether the tick in which the last profile ended is over before what comes next begins.
    fn rests_before(&self, next: Option<&Planned>) -> bool {
        let unfinished =
            self.course.as_ref().is_some_and(|course| course.profile().end.share > 0.0);
        unfinished
            && match next {
                Some(Planned::Profile(next)) => next.start >= Moment::at(self.done + 1),
                Some(Planned::Event(_) | Planned::Seam(_)) | None => true,
            }
    }

    /// The tick in which the last profile ended, at rest there until its boundary.
    fn last_tick(&mut self) -> Option<Tick> {
        let steps = self.course.as_ref()?.end_steps(&self.steps_per_mm);
        let tick = self.tick_to(steps);
        self.course = None;
        Some(tick)
    }

    /// The steps from the last boundary to a position, given in steps not yet rounded.
    #[inline]
    fn tick_to<const N: usize>(&mut self, exact_steps: [f64; N]) -> Tick {
        let mut counts = AxisMap::default();
        for (i, exact) in exact_steps.into_iter().enumerate() {
            let steps = round(exact);
            counts.0[i] = (steps - self.steps.0[i]) as i32;
            self.steps.0[i] = steps;
        }
        self.done += 1;
        let (buffer, line) = self.course.as_ref().map_or((0, 0), |course| {
            let profile = course.profile();
            (profile.buffer, profile.segment.line)
        });
        Tick { buffer, line, counts }
    }
}

/// Nearest whole number, halves to even, of a magnitude below 2^51. As `round_ties_even`, which
/// is a call on processors without SSE 4.1: a sum with 1.5 · 2^52 has no room for a fraction.
fn round(value: f64) -> i64 {
    const NO_FRACTION: f64 = 6_755_399_441_055_744.0;
    (value + NO_FRACTION).to_bits().wrapping_sub(NO_FRACTION.to_bits()) as i64
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn rounding_is_that_of_the_library(value in -1e12..1e12_f64, half in -1_000_000..1_000_000) {
            let half = f64::from(half) * 0.5;
            prop_assert_eq!(round(value), value.round_ties_even() as i64);
            prop_assert_eq!(round(half), half.round_ties_even() as i64);
        }
    }
}
