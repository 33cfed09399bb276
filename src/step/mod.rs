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
use crate::base::{AxisMap, Command, Event, Machine, Point, Tick};
use crate::plan::{Moment, Planned};
use course::{Course, FIRST};

/// Interpolates a plan into ticks and events; errors of the source pass through.
pub fn interpolate<E, I>(plan: I, machine: &Machine, start_mm: Point) -> Interpolator<Fuse<I>>
where
    I: Iterator<Item = Result<Planned, E>>,
{
    Interpolator {
        plan: plan.fuse(),
        steps: AxisMap(machine.nearest_steps(&start_mm).0.map(|steps| steps as i32)),
        done: 0,
        course: Course::new(machine),
        waiting: None,
    }
}

/// See [`interpolate`].
#[derive(Debug)]
pub struct Interpolator<I> {
    plan: I,
    /// Rounded position at the last boundary, modulo 2^32: a count is a difference.
    steps: AxisMap<i32>,
    /// Ticks given out.
    done: u64,
    /// The profile under way; it may have ended within the tick that comes next.
    course: Course,
    /// What the plan brought before the tick under way was over.
    waiting: Option<Planned>,
}

impl<E, I: Iterator<Item = Result<Planned, E>>> Iterator for Interpolator<I> {
    type Item = Result<Command, E>;

    #[inline]
    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(tick) = self.tick() {
                return Some(Ok(Command::Tick(tick)));
            }
            return match self.next_leg() {
                Behind::Leg => continue,
                Behind::Tick(tick) => Some(Ok(Command::Tick(tick))),
                Behind::Event(event) => Some(Ok(Command::Event(event))),
                Behind::Error(error) => Some(Err(error)),
                Behind::End => None,
            };
        }
    }
}

/// What comes behind the last tick of a leg. A type of its own, so that the caller of [`Iterator::next`]
/// has the usual tick in registers: were a place in memory shared with this, each tick would take half as
/// long again.
enum Behind<E> {
    /// The next boundary lies in a leg.
    Leg,
    /// A tick in which the machine comes to rest.
    Tick(Tick),
    Event(Event),
    Error(E),
    /// Nothing.
    End,
}

impl<E, I: Iterator<Item = Result<Planned, E>>> Interpolator<I> {
    /// Goes on to the leg that the next boundary lies in, or to what lies before it.
    #[inline(never)]
    fn next_leg(&mut self) -> Behind<E> {
        loop {
            let boundary = self.done + 1;
            if self.course.go_on(boundary) {
                return Behind::Leg;
            }
            if self.course.profile().is_some_and(|profile| profile.end.tick == boundary) {
                return self.end_tick().map_or(Behind::End, Behind::Tick);
            }
            let next = match self.waiting.take() {
                Some(next) => Some(next),
                None => match self.plan.next() {
                    Some(Ok(next)) => Some(next),
                    Some(Err(error)) => return Behind::Error(error),
                    None => None,
                },
            };
            if self.rests_before(next.as_ref()) {
                self.waiting = next;
                let tick = self.end_tick();
                self.course.leave();
                return tick.map_or(Behind::End, Behind::Tick);
            }
            match next {
                None => return Behind::End,
                Some(Planned::Event(event)) => return Behind::Event(event),
                Some(Planned::Seam(_)) => {}
                Some(Planned::Profile(profile)) => self.course.begin(profile),
            }
        }
    }
}

impl<I> Interpolator<I> {
    /// The tick to the next boundary, if that lies in the leg under way.
    #[inline]
    fn tick(&mut self) -> Option<Tick> {
        let boundary = self.done + 1;
        if !self.course.holds(boundary) {
            return None;
        }
        let mut counts = AxisMap::default();
        if self.course.has_first_only() {
            count::<FIRST>(self.course.steps_at(boundary), &mut self.steps, &mut counts);
        } else {
            count::<AXES>(self.course.steps_at(boundary), &mut self.steps, &mut counts);
        }
        Some(self.give(counts))
    }

    /// The tick in which the last profile ends, or ended: at rest there until its boundary.
    fn end_tick(&mut self) -> Option<Tick> {
        let mut counts = AxisMap::default();
        count(self.course.end_steps()?, &mut self.steps, &mut counts);
        Some(self.give(counts))
    }

    /// The next tick, of the profile under way.
    #[inline]
    fn give(&mut self, counts: AxisMap<i32>) -> Tick {
        self.done += 1;
        let (buffer, line) = self.course.place();
        Tick { buffer, line, counts }
    }

    /// Whether the tick in which the last profile ended is over before what comes next begins.
    fn rests_before(&self, next: Option<&Planned>) -> bool {
        let unfinished = self.course.profile().is_some_and(|profile| profile.end.share > 0.0);
        unfinished
            && match next {
                Some(Planned::Profile(next)) => next.start >= Moment::at(self.done + 1),
                Some(Planned::Event(_) | Planned::Seam(_)) | None => true,
            }
    }
}

/// The steps from the last boundary to a position, given in steps not yet rounded.
#[inline]
fn count<const N: usize>(
    exact_steps: [f64; N],
    steps: &mut AxisMap<i32>,
    counts: &mut AxisMap<i32>,
) {
    for (i, rounded) in exact_steps.map(round).iter().enumerate() {
        counts.0[i] = rounded.wrapping_sub(steps.0[i]);
        steps.0[i] = *rounded;
    }
}

/// Nearest whole number modulo 2^32, halves to even, of a magnitude below 2^51. As `round_ties_even`, which
/// is a call on processors without SSE 4.1: a sum with 1.5 · 2^52 has no room for a fraction.
#[inline]
fn round(value: f64) -> i32 {
    const NO_FRACTION: f64 = 6_755_399_441_055_744.0;
    (value + NO_FRACTION).to_bits() as i32
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn rounding_is_that_of_the_library(value in -1e12..1e12_f64, half in -1_000_000..1_000_000) {
            let half = f64::from(half) * 0.5;
            prop_assert_eq!(round(value), value.round_ties_even() as i64 as i32);
            prop_assert_eq!(round(half), half.round_ties_even() as i64 as i32);
        }
    }
}
