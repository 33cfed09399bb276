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
mod times;

pub use summary::{Seam, Summary};
pub use times::{BlockTime, Phases, Times};

use std::iter::Fuse;

use crate::base::axis::AXES;
use crate::base::{Axis, AxisMap, Command, Machine, Point, Tick};
use crate::path::Curve;
use crate::plan::{Moment, Planned, Profile};

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
        track: None,
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
    track: Option<Track>,
    /// What the plan brought before the tick under way was over.
    waiting: Option<Planned>,
}

impl<E, I: Iterator<Item = Result<Planned, E>>> Iterator for Interpolator<I> {
    type Item = Result<Command, E>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(track) = &self.track
                && self.done < track.profile.end.tick
            {
                let tick = if self.has_xyz_only {
                    let steps =
                        track.steps_at::<XYZ>(self.done + 1, self.tick_s, &self.steps_per_mm);
                    self.tick_to(steps)
                } else {
                    let steps =
                        track.steps_at::<AXES>(self.done + 1, self.tick_s, &self.steps_per_mm);
                    self.tick_to(steps)
                };
                return Some(Ok(Command::Tick(tick)));
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
                    self.track = Some(Track::new(profile, &self.steps_per_mm))
                }
            }
        }
    }
}

impl<I> Interpolator<I> {
    /// Whether the tick in which the last profile ended is over before what comes next begins.
    fn rests_before(&self, next: Option<&Planned>) -> bool {
        let unfinished = self.track.as_ref().is_some_and(|track| track.profile.end.share > 0.0);
        unfinished
            && match next {
                Some(Planned::Profile(next)) => next.start >= Moment::at(self.done + 1),
                Some(Planned::Event(_) | Planned::Seam(_)) | None => true,
            }
    }

    /// The tick in which the last profile ended, at rest there until its boundary.
    fn last_tick(&mut self) -> Option<Tick> {
        let steps = self.track.as_ref()?.to_steps;
        let tick = self.tick_to(steps.0);
        self.track = None;
        Some(tick)
    }

    /// The steps from the last boundary to a position, given in steps not yet rounded.
    fn tick_to<const N: usize>(&mut self, exact_steps: [f64; N]) -> Tick {
        let mut counts = AxisMap::default();
        for (i, exact) in exact_steps.into_iter().enumerate() {
            let steps = round(exact);
            counts.0[i] = (steps - self.steps.0[i]) as i32;
            self.steps.0[i] = steps;
        }
        self.done += 1;
        let (buffer, line) = match &self.track {
            Some(Track { profile, .. }) => (profile.buffer, profile.segment.line),
            None => (0, 0),
        };
        Tick { buffer, line, counts }
    }
}

/// A profile under way, with what is the same in all its ticks.
#[derive(Debug)]
struct Track {
    profile: Box<Profile>,
    /// Ends of the piece, in steps.
    from_steps: AxisMap<f64>,
    to_steps: AxisMap<f64>,
}

impl Track {
    fn new(profile: Box<Profile>, steps_per_mm: &AxisMap<f64>) -> Track {
        let from_steps = in_steps(&profile.start_mm(), steps_per_mm);
        let to_steps = in_steps(&profile.end_mm(), steps_per_mm);
        Track { profile, from_steps, to_steps }
    }

    /// Position at a boundary before the piece's end, or at it. On a line the way between the
    /// ends is shared out, which is three times as fast as to ask the segment.
    fn steps_at<const N: usize>(
        &self,
        boundary: u64,
        tick_s: f64,
        steps_per_mm: &AxisMap<f64>,
    ) -> [f64; N] {
        let Curve::Line = self.profile.segment.curve else {
            let position_mm = self.profile.position_at(boundary, tick_s);
            return std::array::from_fn(|i| position_mm.0[i] * steps_per_mm.0[i]);
        };
        let share = self.profile.share_at(boundary, tick_s);
        if share >= 1.0 {
            return std::array::from_fn(|i| self.to_steps.0[i]);
        }
        std::array::from_fn(|i| {
            let from = self.from_steps.0[i];
            from + (self.to_steps.0[i] - from) * share
        })
    }
}

fn in_steps(position_mm: &Point, steps_per_mm: &AxisMap<f64>) -> AxisMap<f64> {
    let mut steps = AxisMap::default();
    for i in 0..AXES {
        steps.0[i] = position_mm.0[i] * steps_per_mm.0[i];
    }
    steps
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
