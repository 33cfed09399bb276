//! Speed along the path against F, over windows of 20 ticks: cuts in one need no more time at their
//! feeds than it has. With one feed that is the mean speed against it. Slower is not judged; rapids need no
//! time. Before the first tick the machine has rested.
//!
//! What a window needs is found twice, and the lesser counts:
//!
//! - on the path that tick points were matched with. Where the path turns back on itself within
//!   the tolerance it runs on at once, though nothing has moved;
//! - on what was executed, by chords of five ticks.
//!
//! Rounding makes ways longer. On the path it is allowed two steps, at the least feed. With chords cᵢ in directions
//! uᵢ, Fᵢ the greatest feed within each, and h the half steps by which the axes of each point may be off, the time is
//! Σ|dᵢ|/Fᵢ ≥ Σ wᵢ·dᵢ, wᵢ = uᵢ/Fᵢ, for whatever dᵢ the chords are the rounding of, so
//!
//! ```text
//! Σ|dᵢ|/Fᵢ ≥ Σ|cᵢ|/Fᵢ - h·(|w₀| + |w₁ - w₀| + ... + |wₙ|)       |w|: axis by axis
//! ```
//!
//! That holds for chords of any ticks: of five, which follow the path where it turns, and of ten and twenty, which
//! turn less on a line of few steps. So what is executed needs at least the greatest of the three, where each is
//! allowed two steps in any case.
//!
//! Near the border of two feeds the nearest point of the path need not be the one meant: a fast motion may
//! be taken for the slow line beside it that follows. So the feed of a tick is the greatest of all edges
//! that it can be walked on within the tolerance (`sweep`), one of which the machine was on.
//!
//! ```text
//!   ────F120────┬────╮     within the tolerance of the turn the walk may be on either way, and F120
//!   ─────F9─────┴────╯     counts; further off it can be on one of them only
//!               ├────┤ tolerance
//! ```
//!
//! Where corners may be cut by G64 P a match may run on by as much, and errors of chords around the
//! corner do not cancel. There the one chord of the window counts, at the greatest feed in it.

use std::collections::VecDeque;

use super::Setup;
use super::edges::{Vector, difference, dot};
use super::report::Place;
use crate::base::{Axis, Machine};

/// Ticks of a window.
const WINDOW_TICKS: usize = 20;
/// Ticks of chords of what was executed.
const CHORDS_TICKS: [usize; 3] = [5, 10, WINDOW_TICKS];
/// What the mean speed may exceed the feed by, in parts of it.
const EXCESS_SHARE: f64 = 0.01;
/// What rounding may add to the way of a window, at least.
const ROUNDING_STEPS: f64 = 2.0;

/// By how much the feed is exceeded, and how much of it is reached.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct FeedError {
    /// Greatest excess of the mean speed over the feed, rounding included; 0 if it never is.
    pub max_percent: f64,
    /// The window with the greatest share of the speed allowed in it; none if there is no window.
    pub worst: Option<FeedWindow>,
    /// Time that all cuts would take at their feeds throughout, of the time that they take; none without cuts.
    pub reached_percent: Option<f64>,
}

/// A window with cuts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeedWindow {
    /// Mean speed in it; of several feeds the share of its time that its cuts take at them, times the least.
    pub speed_mm_s: f64,
    /// The path's least feed in it and what is allowed above that.
    pub allowed_mm_s: f64,
    /// Its last tick.
    pub at: Place,
}

/// Where the machine stands after a tick.
#[derive(Clone, Copy, Debug)]
pub struct Standing {
    /// Executed position.
    pub at: Vector,
    /// Where on the path that is.
    pub along_mm: f64,
    /// Greatest feed of the path that the way there may have been on; 0 if there was no way, infinite
    /// for a rapid.
    pub feed_mm_s: f64,
    /// Whether corners may be cut there.
    pub may_be_cut: bool,
}

/// A standing in a window.
#[derive(Clone, Copy, Debug)]
struct Moment {
    standing: Standing,
    /// Time that the path up to there takes at its feeds, rapids left out.
    needed_s: f64,
    /// Time that a millimetre of the way there takes at its feed; 0 where that does not count.
    slowness_s_mm: f64,
}

/// Time that a way takes at its feeds, and by how much rounding may have made it longer.
#[derive(Clone, Copy, Debug)]
struct Need {
    time_s: f64,
    rounding_s: f64,
}

/// Takes ticks one by one.
#[derive(Debug)]
pub struct Feed {
    tick_s: f64,
    /// Time of a window.
    time_s: f64,
    rounding_mm: f64,
    /// How far a step is on each axis.
    steps_mm: Vector,
    /// After each tick of the window and before its first.
    window: VecDeque<Moment>,
    /// The greatest slowness in it.
    slowness_s_mm: f64,
    /// Whether the last motion was a cut, and how long cuts have taken.
    is_cutting: bool,
    cuts_s: f64,
    found: FeedError,
}

impl Feed {
    /// Of the way of axes with these steps. Begins at rest, where the machine has been for the time of a window.
    pub fn new(setup: &Setup, steps_mm: Vector, at: Vector) -> Feed {
        let step_mm = steps_mm.into_iter().fold(0.0, f64::max);
        let standing = Standing { at, along_mm: 0.0, feed_mm_s: 0.0, may_be_cut: false };
        let start = Moment { standing, needed_s: 0.0, slowness_s_mm: 0.0 };
        Feed {
            tick_s: setup.tick_s(),
            time_s: WINDOW_TICKS as f64 * setup.tick_s(),
            rounding_mm: ROUNDING_STEPS * step_mm,
            steps_mm,
            window: VecDeque::from([start; WINDOW_TICKS]),
            slowness_s_mm: 0.0,
            is_cutting: false,
            cuts_s: 0.0,
            found: FeedError::default(),
        }
    }

    /// A tick is over.
    pub fn tick(&mut self, standing: Standing, at: Place) {
        let (Some(first), Some(last)) = (self.window.front(), self.window.back()) else { return };
        let slowness_s_mm = slowness_s_mm(standing.feed_mm_s);
        let way_mm = standing.along_mm - last.standing.along_mm;
        let needed_s = last.needed_s + way_mm * slowness_s_mm;
        let (along_s, leaving_s_mm) = (needed_s - first.needed_s, first.slowness_s_mm);
        self.window.push_back(Moment { standing, needed_s, slowness_s_mm });
        if standing.feed_mm_s > 0.0 {
            self.is_cutting = slowness_s_mm > 0.0;
        }
        self.cuts_s += if self.is_cutting { self.tick_s } else { 0.0 };
        // A tick matched with the end of one piece may run on the next already: its feed counts.
        self.slowness_s_mm = self.slowness_s_mm.max(slowness_s_mm);
        if self.slowness_s_mm > 0.0 && self.is_news(along_s) {
            self.judge(self.need(along_s), at);
        }
        self.window.pop_front();
        if leaving_s_mm >= self.slowness_s_mm && slowness_s_mm < self.slowness_s_mm {
            let all = self.window.iter().map(|moment| moment.slowness_s_mm);
            self.slowness_s_mm = all.fold(0.0, f64::max);
        }
    }

    /// Whether a window whose way needs this time, at most, may be worse than those before.
    fn is_news(&self, along_s: f64) -> bool {
        let (share, percent) = self.shares(Need { time_s: along_s, rounding_s: self.rounding_s() });
        let is_worse = |worst: FeedWindow| share > worst.speed_mm_s / worst.allowed_mm_s;
        percent > self.found.max_percent || self.found.worst.is_none_or(is_worse)
    }

    /// A full window with this need is over.
    fn judge(&mut self, need: Need, at: Place) {
        let (share, percent) = self.shares(need);
        self.found.max_percent = self.found.max_percent.max(percent);
        let is_worse = |worst: FeedWindow| share > worst.speed_mm_s / worst.allowed_mm_s;
        if self.found.worst.is_none_or(is_worse) {
            let feed_mm_s = 1.0 / self.slowness_s_mm;
            let speed_mm_s = feed_mm_s * need.time_s / self.time_s;
            let allowed_mm_s = feed_mm_s * self.allowed_s(need.rounding_s) / self.time_s;
            self.found.worst = Some(FeedWindow { speed_mm_s, allowed_mm_s, at });
        }
    }

    /// What a need is of what is allowed, and by how many percent it exceeds the time.
    fn shares(&self, need: Need) -> (f64, f64) {
        let percent = 100.0 * (need.time_s / self.time_s - 1.0);
        (need.time_s / self.allowed_s(need.rounding_s), percent)
    }

    fn allowed_s(&self, rounding_s: f64) -> f64 {
        self.time_s * (1.0 + EXCESS_SHARE) + rounding_s
    }

    /// What rounding is allowed in any case.
    fn rounding_s(&self) -> f64 {
        self.rounding_mm * self.slowness_s_mm
    }

    /// What the way of the window needs, of which what is on the path needs so much.
    fn need(&self, along_s: f64) -> Need {
        let may_be_cut = self.window.iter().any(|moment| moment.standing.may_be_cut);
        let chords_ticks = if may_be_cut { &[WINDOW_TICKS][..] } else { &CHORDS_TICKS };
        let least_s = |need: Need| need.time_s - need.rounding_s.max(self.rounding_s());
        let chords_s = chords_ticks.iter().map(|ticks| least_s(self.chords(*ticks)));
        let least_s = chords_s.fold(0.0, f64::max).min(along_s - self.rounding_s());
        let time_s = along_s.min(self.chords(chords_ticks[0]).time_s);
        Need { time_s, rounding_s: time_s - least_s }
    }

    /// What was executed in the window, by chords of so many ticks.
    fn chords(&self, ticks: usize) -> Need {
        let (mut time_s, mut rounding_s, mut weight_s_mm) = (0.0, 0.0, [0.0; 3]);
        let mut turn = |to: Vector| {
            let turned = difference(to, std::mem::replace(&mut weight_s_mm, to));
            // Each position may be off by half a step.
            let off_s = turned.iter().zip(self.steps_mm);
            rounding_s += off_s.map(|(turned, step_mm)| turned.abs() * 0.5 * step_mm).sum::<f64>();
        };
        for start in (0..WINDOW_TICKS).step_by(ticks) {
            let way = self.window.range(start + 1..=start + ticks).map(|moment| moment.standing);
            let feed_mm_s = way.map(|standing| standing.feed_mm_s).fold(0.0, f64::max);
            let slowness_s_mm = slowness_s_mm(feed_mm_s);
            let ends = [start, start + ticks].map(|end| self.window[end].standing.at);
            let chord = difference(ends[1], ends[0]);
            let chord_mm = dot(chord, chord).sqrt();
            time_s += chord_mm * slowness_s_mm;
            let scale = if chord_mm > 0.0 { slowness_s_mm / chord_mm } else { 0.0 };
            turn(chord.map(|way_mm| way_mm * scale));
        }
        turn([0.0; 3]);
        Need { time_s, rounding_s }
    }

    /// What was found.
    pub fn end(self) -> FeedError {
        let needed_s = self.window.back().map_or(0.0, |last| last.needed_s);
        let reached_percent = (self.cuts_s > 0.0).then(|| 100.0 * needed_s / self.cuts_s);
        FeedError { reached_percent, ..self.found }
    }
}

/// How far a step is on each of these axes; zero where the machine lacks one.
pub fn steps_mm(machine: &Machine, axes: [Axis; 3]) -> Vector {
    axes.map(|axis| machine.axis(axis).map_or(0.0, |axis| 1.0 / axis.steps_per_mm))
}

/// Time of a millimetre at a feed; 0 of a rapid, and where nothing moves.
fn slowness_s_mm(feed_mm_s: f64) -> f64 {
    if feed_mm_s > 0.0 { 1.0 / feed_mm_s } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::AxisMap;

    /// The worst window of 60 ticks of a millisecond against a feed of 5 mm/s: where the machine stands after each,
    /// and where on the path that is.
    fn worst(standing: impl Fn(u32) -> (Vector, f64)) -> FeedWindow {
        let machine = Machine::load("ideal").unwrap();
        let start_steps = AxisMap::default();
        let setup = Setup {
            machine: &machine,
            tick_us: 1000,
            start_steps,
            constant_feed: false,
            with_events: true,
            with_buffers: false,
        };
        let standing = |tick: u32| {
            let (at, along_mm) = standing(tick);
            Standing { at, along_mm, feed_mm_s: 5.0, may_be_cut: false }
        };
        let mut feed = Feed::new(&setup, steps_mm(&machine, Axis::LINEAR), standing(0).at);
        (1..60).for_each(|tick| feed.tick(standing(tick), Place::default()));
        feed.end().worst.unwrap()
    }

    #[test]
    fn a_path_that_turns_back_within_the_tolerance_is_not_taken_for_speed() {
        let straight = |speed_mm_s: f64, jump_mm: f64| {
            worst(|tick| {
                let way_mm = f64::from(tick) * speed_mm_s * 1e-3;
                ([way_mm, 0.0, 0.0], way_mm + if tick < 30 { 0.0 } else { jump_mm })
            })
        };
        // As a real program did: 2.4 µm back and 2.4 µm on, between two ticks.
        let window = straight(5.0, 0.0048);
        assert!(window.speed_mm_s <= window.allowed_mm_s, "{window:?}");
        let window = straight(5.3, 0.0);
        assert!(window.speed_mm_s > window.allowed_mm_s, "{window:?}");
    }

    #[test]
    fn rounding_of_a_path_that_turns_back_is_not_taken_for_speed() {
        // There and back in X and Y, turning every five ticks; steps of a micrometre.
        let there_and_back = |speed_mm_s: f64, off_mm: f64| {
            worst(|tick| {
                let share = f64::from(if tick / 5 % 2 == 0 { tick % 5 } else { 5 - tick % 5 });
                let way_mm =
                    speed_mm_s * 1e-3 * share * 0.5_f64.sqrt() + off_mm * (share - 2.5) / 2.5;
                ([way_mm, way_mm, 0.0], f64::from(tick) * speed_mm_s * 1.1e-3)
            })
        };
        let window = there_and_back(5.0, 0.000_45);
        assert!(window.speed_mm_s <= window.allowed_mm_s, "{window:?}");
        let window = there_and_back(5.4, 0.0);
        assert!(window.speed_mm_s > window.allowed_mm_s, "{window:?}");
    }
}
