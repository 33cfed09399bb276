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
use course::Course;

/// X, Y, Z and A: as many axes as are computed together where the machine has no others.
const FIRST: usize = 4;

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
        has_first_only: machine.axes.iter().all(|profile| (profile.axis as usize) < FIRST),
        steps: AxisMap(machine.nearest_steps(&start_mm).0.map(|steps| steps as i32)),
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
    /// The machine has none but the [`FIRST`] axes. Else all nine are computed in every tick: a number
    /// that is known beforehand takes no branch, and four fill the processor's registers.
    has_first_only: bool,
    /// Rounded position at the last boundary, modulo 2^32: a count is a difference.
    steps: AxisMap<i32>,
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
            if let Some(course) = &mut self.course {
                if course.go_on(boundary, self.tick_s) {
                    return Behind::Leg;
                }
                if boundary == course.profile().end.tick {
                    return self.end_tick().map_or(Behind::End, Behind::Tick);
                }
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
                self.course = None;
                return tick.map_or(Behind::End, Behind::Tick);
            }
            match next {
                None => return Behind::End,
                Some(Planned::Event(event)) => return Behind::Event(event),
                Some(Planned::Seam(_)) => {}
                Some(Planned::Profile(profile)) => {
                    self.course = Some(Course::new(profile, &self.steps_per_mm))
                }
            }
        }
    }
}

impl<I> Interpolator<I> {
    /// The tick to the next boundary, if that lies in the leg under way.
    #[inline]
    fn tick(&mut self) -> Option<Tick> {
        let course = self.course.as_ref()?;
        let boundary = self.done + 1;
        if !course.holds(boundary) {
            return None;
        }
        let mut counts = AxisMap::default();
        if self.has_first_only {
            let exact: [f64; FIRST] = course.steps_at(boundary, self.tick_s, &self.steps_per_mm);
            count(exact, &mut self.steps, &mut counts);
        } else {
            let exact: [f64; AXES] = course.steps_at(boundary, self.tick_s, &self.steps_per_mm);
            count(exact, &mut self.steps, &mut counts);
        }
        self.done = boundary;
        let (buffer, line) = course.place();
        Some(Tick { buffer, line, counts })
    }

    /// The tick in which the last profile ends, or ended: at rest there until its boundary.
    fn end_tick(&mut self) -> Option<Tick> {
        let course = self.course.as_ref()?;
        let mut counts = AxisMap::default();
        count(course.end_steps(&self.steps_per_mm), &mut self.steps, &mut counts);
        self.done += 1;
        let (buffer, line) = course.place();
        Some(Tick { buffer, line, counts })
    }

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
}

/// The steps from the last boundary to a position, given in steps not yet rounded.
#[inline]
fn count<const N: usize>(
    exact_steps: [f64; N],
    steps: &mut AxisMap<i32>,
    counts: &mut AxisMap<i32>,
) {
    let rounded = exact_steps.map(round);
    for i in 0..N {
        counts.0[i] = rounded[i].wrapping_sub(steps.0[i]);
        steps.0[i] = rounded[i];
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
