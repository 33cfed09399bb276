//! Speed along the path against F: mean speed over windows of 20 ticks. Slower is not judged;
//! rapids have no feed.
//!
//! The way of a window is measured twice, and the lesser counts:
//!
//! - on the path that tick points were matched with. Where the path turns back on itself within
//!   the tolerance it runs on at once, though nothing has moved;
//! - on what was executed, by chords of five ticks.
//!
//! Rounding makes ways longer. On the path it is allowed two steps. With chords cᵢ in directions uᵢ, and h the half
//! steps by which the axes of each point may be off, the way is Σ|dᵢ| ≥ Σ uᵢ·dᵢ for whatever dᵢ the chords are the
//! rounding of, so
//!
//! ```text
//! Σ|dᵢ| ≥ Σ|cᵢ| - h·(|u₀| + |u₁ - u₀| + ... + |uₙ|)       |u|: axis by axis
//! ```
//!
//! That holds for chords of any ticks: of five, which follow the path where it turns, and of ten and twenty, which
//! turn less on a line of few steps. So what is executed is at least the greatest of the three, where each is
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
//! corner do not cancel. There the one chord of the window counts.

use std::collections::VecDeque;

use super::Setup;
use super::edges::{Vector, difference, dot};
use super::report::Place;
use crate::base::Axis;

/// Ticks of a window.
const WINDOW_TICKS: usize = 20;
/// Ticks of chords of what was executed.
const CHORDS_TICKS: [usize; 3] = [5, 10, WINDOW_TICKS];
/// What the mean speed may exceed the feed by, in parts of it.
const EXCESS_SHARE: f64 = 0.01;
/// What rounding may add to the way of a window, at least.
const ROUNDING_STEPS: f64 = 2.0;

/// By how much the feed is exceeded.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct FeedError {
    /// Greatest excess of the mean speed over the feed, rounding included; 0 if it never is.
    pub max_percent: f64,
    /// The window with the greatest share of the speed allowed in it; none if there is no window.
    pub worst: Option<FeedWindow>,
}

/// A window without rapids.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeedWindow {
    /// Mean speed in it.
    pub speed_mm_s: f64,
    /// The path's greatest feed in it and what is allowed above that.
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

/// The way of a window, and by how much rounding may have made it longer.
#[derive(Clone, Copy, Debug)]
struct Way {
    length_mm: f64,
    rounding_mm: f64,
}

/// Takes ticks one by one.
#[derive(Debug)]
pub struct Feed {
    /// Time of a window.
    time_s: f64,
    rounding_mm: f64,
    /// By how much a position may be off.
    half_steps_mm: Vector,
    /// After each tick of the window and before its first.
    window: VecDeque<Standing>,
    /// The greatest feed in it.
    feed_mm_s: f64,
    found: FeedError,
}

impl Feed {
    /// Begins at rest.
    pub fn new(setup: &Setup, start: Standing) -> Feed {
        let step_mm = |axis| setup.machine.axis(axis).map_or(0.0, |axis| 1.0 / axis.steps_per_mm);
        let steps_mm = Axis::LINEAR.map(step_mm);
        let step_mm = steps_mm.into_iter().fold(0.0, f64::max);
        Feed {
            time_s: WINDOW_TICKS as f64 * setup.tick_s(),
            rounding_mm: ROUNDING_STEPS * step_mm,
            half_steps_mm: steps_mm.map(|step_mm| 0.5 * step_mm),
            window: VecDeque::from([start]),
            feed_mm_s: start.feed_mm_s,
            found: FeedError::default(),
        }
    }

    /// A tick is over.
    pub fn tick(&mut self, standing: Standing, at: Place) {
        self.window.push_back(standing);
        // A tick matched with the end of one piece may run on the next already: its feed counts.
        self.feed_mm_s = self.feed_mm_s.max(standing.feed_mm_s);
        if self.window.len() <= WINDOW_TICKS {
            return;
        }
        let feed_mm_s = self.feed_mm_s;
        let Some(first) = self.window.front().copied() else { return };
        let along_mm = standing.along_mm - first.along_mm;
        if feed_mm_s > 0.0 && feed_mm_s < f64::INFINITY && self.is_news(along_mm) {
            self.judge(self.way(along_mm), at);
        }
        self.window.pop_front();
        if first.feed_mm_s >= feed_mm_s && standing.feed_mm_s < feed_mm_s {
            let feeds = self.window.iter().map(|standing| standing.feed_mm_s);
            self.feed_mm_s = feeds.fold(0.0, f64::max);
        }
    }

    /// Whether a window with this way, at most, may be worse than those before.
    fn is_news(&self, way_mm: f64) -> bool {
        let speed_mm_s = way_mm / self.time_s;
        let share = |window: FeedWindow| window.speed_mm_s / window.allowed_mm_s;
        100.0 * (speed_mm_s / self.feed_mm_s - 1.0) > self.found.max_percent
            || self
                .found
                .worst
                .is_none_or(|worst| speed_mm_s / self.allowed_mm_s(self.rounding_mm) > share(worst))
    }

    /// A full window with this way is over.
    fn judge(&mut self, way: Way, at: Place) {
        let speed_mm_s = way.length_mm / self.time_s;
        let percent = 100.0 * (speed_mm_s / self.feed_mm_s - 1.0);
        self.found.max_percent = self.found.max_percent.max(percent);
        let allowed_mm_s = self.allowed_mm_s(way.rounding_mm);
        let share = |window: FeedWindow| window.speed_mm_s / window.allowed_mm_s;
        if self.found.worst.is_none_or(|worst| speed_mm_s / allowed_mm_s > share(worst)) {
            self.found.worst = Some(FeedWindow { speed_mm_s, allowed_mm_s, at });
        }
    }

    fn allowed_mm_s(&self, rounding_mm: f64) -> f64 {
        self.feed_mm_s * (1.0 + EXCESS_SHARE) + rounding_mm / self.time_s
    }

    /// The way of the window, of which so much is on the path.
    fn way(&self, along_mm: f64) -> Way {
        let may_be_cut = self.window.iter().any(|standing| standing.may_be_cut);
        let chords_ticks = if may_be_cut { &[WINDOW_TICKS][..] } else { &CHORDS_TICKS };
        let least_mm = |way: Way| way.length_mm - way.rounding_mm.max(self.rounding_mm);
        let chords_mm = chords_ticks.iter().map(|ticks| least_mm(self.chords(*ticks)));
        let least_mm = chords_mm.fold(0.0, f64::max).min(along_mm - self.rounding_mm);
        let length_mm = along_mm.min(self.chords(chords_ticks[0]).length_mm);
        Way { length_mm, rounding_mm: length_mm - least_mm }
    }

    /// The way that was executed in the window, by chords of so many ticks.
    fn chords(&self, ticks: usize) -> Way {
        let (mut length_mm, mut rounding_mm, mut direction) = (0.0, 0.0, [0.0; 3]);
        let mut turn = |to: Vector| {
            let turned = difference(to, std::mem::replace(&mut direction, to));
            let off_mm = turned.iter().zip(self.half_steps_mm);
            rounding_mm += off_mm.map(|(turned, half_mm)| turned.abs() * half_mm).sum::<f64>();
        };
        let corners = self.window.iter().step_by(ticks);
        for (from, to) in corners.clone().zip(corners.skip(1)) {
            let chord = difference(to.at, from.at);
            let chord_mm = dot(chord, chord).sqrt();
            length_mm += chord_mm;
            turn(if chord_mm > 0.0 { chord.map(|way_mm| way_mm / chord_mm) } else { [0.0; 3] });
        }
        turn([0.0; 3]);
        Way { length_mm, rounding_mm }
    }

    /// What was found.
    pub fn end(self) -> FeedError {
        self.found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::{AxisMap, Machine};

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
        let mut feed = Feed::new(&setup, standing(0));
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
