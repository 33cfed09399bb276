//! Speeds with constant accelerations → motion with limited jerk.
//!
//! The plan of [`super::lookahead`] is the ceiling: with limits on jerk no place can be passed
//! faster. Below it two passes, each in its file, find a motion whose acceleration changes evenly:
//!
//! 1. [`fall`]: backwards, so that braking ends softly;
//! 2. [`round`]: forwards, so that speeding up begins softly, and peaks are round.
//!
//! From rest to rest a stretch of the path is done at once. Of a longer one that part is given out
//! that braking at the end of what is known leaves alone, with as much again for safety: memory is
//! that of twice the way that braking takes.
//!
//! [`limit`] says how much jerk a piece allows, [`stretch`] and [`lane`] are the motion's parts,
//! [`bracket`] finds where they meet. No tick and no axis is known here.

mod bracket;
mod fall;
mod lane;
mod limit;
mod round;
mod stretch;

pub use lane::Lane;
pub use limit::JerkLimit;
pub use stretch::{SAME, State, Stretch};

use std::collections::VecDeque;

use super::Ramp;
use super::run::{Item, Run};
use round::{Part, Rounding};

/// Pieces that are smoothed together at least: so many that the passes' overhead is spread.
const RUNS_MIN: usize = 256;

impl Run {
    /// The greatest acceleration at a speed.
    fn speeding_up_mm_s2(&self, speed_mm_s: f64) -> f64 {
        let jerk_leaves_mm_s2 = self.piece.jerk.accel_max_mm_s2(speed_mm_s);
        self.piece.speeding_up_mm_s2(speed_mm_s * speed_mm_s).min(jerk_leaves_mm_s2)
    }

    /// The greatest braking at a speed.
    fn braking_mm_s2(&self, speed_mm_s: f64) -> f64 {
        let jerk_leaves_mm_s2 = self.piece.jerk.accel_max_mm_s2(speed_mm_s);
        self.piece.braking_mm_s2(speed_mm_s * speed_mm_s).min(jerk_leaves_mm_s2)
    }
}

/// Gives decided pieces ramps with limited jerk.
#[derive(Debug)]
pub struct Smoother {
    /// Pieces with the speeds that constant accelerations give them.
    #[expect(clippy::vec_box, reason = "they come and go in their boxes")]
    runs: Vec<Box<Run>>,
    /// How the first of them begins.
    state: State,
    /// The motion from there to rest at the end of what was known: it has been found, but is not
    /// given out, since more is known now.
    held: Vec<Part>,
    /// Runs that are smoothed together at least.
    enough_min: usize,
    /// Runs that are collected before the passes run again.
    enough: usize,
    ready: VecDeque<Item>,
}

impl Smoother {
    /// From rest.
    pub fn new() -> Smoother {
        Smoother::with_at_least(RUNS_MIN)
    }

    fn with_at_least(enough_min: usize) -> Smoother {
        let (runs, held, ready) = (Vec::new(), Vec::new(), VecDeque::new());
        Smoother { runs, state: State::default(), held, enough_min, enough: enough_min, ready }
    }

    /// Takes the next item. The path ends at rest.
    pub fn push(&mut self, item: Item) {
        let Item::Run(run) = item else { return self.ready.push_back(item) };
        let rests = run.ends_mm_s[1] == 0.0;
        self.runs.push(run);
        if rests {
            self.smooth(true);
            self.state = State::default();
            self.enough = self.enough_min;
        } else if self.runs.len() >= self.enough {
            self.smooth(false);
            self.enough = self.enough_min.max(2 * self.runs.len());
        }
    }

    /// Gives the next item, if there is one.
    pub fn pop(&mut self) -> Option<Item> {
        self.ready.pop_front()
    }

    /// Smooths all that is there, and gives out what is certain of it; at rest at its end, that is all.
    fn smooth(&mut self, rests: bool) {
        let mut plan = Vec::with_capacity(self.runs.len());
        let mut ends_mm = Vec::with_capacity(self.runs.len());
        let mut start_mm = 0.0;
        for (i, run) in self.runs.iter().enumerate() {
            let end_mm = start_mm + run.piece.length_mm;
            let mut stretches = run.ramp.stretches(start_mm).peekable();
            while let Some(stretch) = stretches.next() {
                let end_mm = stretches.peek().map_or(end_mm, |next| next.from.at_mm);
                plan.push(Lane { stretch, end_mm, run: i });
            }
            ends_mm.push(end_mm);
            start_mm = end_mm;
        }
        let ceiling = fall::ceiling(&plan, &self.runs);
        let held = std::mem::take(&mut self.held);
        let parts = Rounding::new(&ceiling.lanes, &self.runs, self.state, held).run();
        let count = match rests {
            true => self.runs.len(),
            false => certain(&parts, &ends_mm, ceiling.open_mm),
        };
        self.give_out(&parts, count, rests);
        let given_mm = count.checked_sub(1).map_or(0.0, |last| ends_mm[last]);
        let left = parts.iter().filter(|part| part.run >= count);
        self.held.extend(left.map(|part| part.counted_from(given_mm, count)));
    }

    /// Gives out so many pieces with their parts of the motion.
    fn give_out(&mut self, parts: &[Part], count: usize, rests: bool) {
        let mut parts = parts.iter().peekable();
        let mut entry_mm_s = self.state.speed_mm_s;
        let mut stretches = Vec::new();
        for (i, mut run) in self.runs.drain(..count).enumerate() {
            stretches.clear();
            while let Some(part) = parts.next_if(|part| part.run == i) {
                stretches.push(part.stretch);
            }
            let end = stretches.last().map_or(self.state, Stretch::end);
            let exit_mm_s = if rests && i + 1 == count { 0.0 } else { end.speed_mm_s };
            self.state = State { at_mm: 0.0, speed_mm_s: exit_mm_s, ..end };
            run.ramp = Ramp::along(run.piece.length_mm, &stretches);
            run.ends_mm_s = [entry_mm_s, exit_mm_s];
            entry_mm_s = exit_mm_s;
            self.ready.push_back(Item::Run(run));
        }
    }
}

/// How many pieces nothing that follows can change: those that end as far before what hangs on the
/// end of what is known as that is long, and not within an arc.
fn certain(parts: &[Part], ends_mm: &[f64], open_mm: f64) -> usize {
    let end_mm = ends_mm.last().copied().unwrap_or(0.0);
    let limit_mm = open_mm - (end_mm - open_mm);
    let mut count = 0;
    for pair in parts.windows(2) {
        let (part, next) = (&pair[0], &pair[1]);
        if next.run > part.run {
            let piece_end_mm = ends_mm[part.run];
            if piece_end_mm > limit_mm {
                break;
            }
            if part.lands_mm <= piece_end_mm {
                count = part.run + 1;
            }
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::{Axis, Machine, Plane, Point};
    use std::rc::Rc;

    use crate::path::{Arc, Curve, Segment};
    use crate::plan::cuts::Cuts;
    use crate::plan::junction::Junction;
    use crate::plan::limits::Limits;

    /// Pieces of circles of changing radius that join, and the greatest speeds on them.
    fn decided(limits: &Limits) -> Vec<Item> {
        let mut runs = Vec::new();
        for k in 0..60 {
            let radius_mm = 0.5 + 8.0 * f64::from(k * 37 % 17) / 17.0;
            let mut from_mm = Point::ZERO;
            from_mm[Axis::X] = radius_mm;
            let mut to_mm = from_mm;
            to_mm[Axis::X] = -radius_mm;
            let arc = Arc {
                plane: Plane::Xy,
                center_mm: [0.0; 2],
                radius_from_mm: radius_mm,
                radius_to_mm: radius_mm,
                angle_from_rad: 0.0,
                sweep_rad: std::f64::consts::PI,
            };
            let (line, corner) = (k + 1, Default::default());
            let curve = Curve::Arc(arc);
            let segment = Segment { line, feed_mm_s: None, from_mm, to_mm, curve, corner };
            let segment = Rc::new(segment);
            let length_mm = segment.length_mm();
            let rates = segment.axis_speeds();
            let mut whole = Run::boxed(segment);
            let start = &Junction::STRAIGHT;
            whole.piece.become_whole(f64::INFINITY, length_mm, &rates, start, limits);
            let cuts = Cuts::of(whole, limits, true, false);
            let Cuts::Many(mut parts) = cuts else { unreachable!("an arc") };
            let next = || parts.next(limits, None);
            runs.extend(std::iter::from_fn(next));
        }
        let mut speeds_sq = vec![0.0; runs.len() + 1];
        for i in (1..runs.len()).rev() {
            let before = runs[i - 1].piece.ends_sq_max[1];
            speeds_sq[i] = runs[i].piece.entry_sq_max(speeds_sq[i + 1], before);
        }
        for i in 1..runs.len() {
            speeds_sq[i] = runs[i - 1].piece.exit_sq_max(speeds_sq[i - 1], speeds_sq[i]);
        }
        let decide = |(i, mut run): (usize, Box<Run>)| {
            run.decide(speeds_sq[i].sqrt(), speeds_sq[i + 1].sqrt(), false);
            Item::Run(run)
        };
        runs.into_iter().enumerate().map(decide).collect()
    }

    /// What is given out early takes the time that it takes in the whole, and is never faster than with
    /// constant accelerations.
    #[test]
    fn parts_are_smoothed_as_the_whole() {
        for machine in ["starmill", "router"] {
            let machine = Machine::load(machine).unwrap();
            let limits = Limits::new(&machine);
            let time_s = |enough_min: usize| -> f64 {
                let mut smoother = Smoother::with_at_least(enough_min);
                let (mut time_s, mut reached) = (0.0, VecDeque::new());
                for item in decided(&limits) {
                    if let Item::Run(run) = &item {
                        reached.push_back(run.ends_mm_s[1]);
                    }
                    smoother.push(item);
                    while let Some(Item::Run(run)) = smoother.pop() {
                        let limit_mm_s = reached.pop_front().unwrap_or(0.0);
                        let exit_mm_s = run.ends_mm_s[1];
                        assert!(exit_mm_s <= limit_mm_s * (1.0 + 1e-6), "{exit_mm_s}");
                        time_s += run.ramp.duration_s();
                    }
                }
                time_s
            };
            let whole_s = time_s(usize::MAX);
            for enough_min in [1, 7, 64, 500] {
                let ratio = time_s(enough_min) / whole_s;
                assert!((ratio - 1.0).abs() < 1e-3, "{} {enough_min}: {ratio}", machine.id);
            }
        }
    }
}
