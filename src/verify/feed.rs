//! Speed along the path against F: mean speed over windows of 20 ticks. Slower is not judged;
//! rapids have no feed.
//!
//! The way of a window is measured twice: on the path that its tick points were matched with, and
//! on their chords. Where the path curls within the tolerance the match leaps; rounding makes the
//! chords zigzag. A machine that is too fast is so on both: the lesser counts.

use std::collections::VecDeque;

use super::Setup;
use super::report::Place;
use crate::base::Axis;

/// Ticks of a window.
const WINDOW_TICKS: usize = 20;
/// What the mean speed may exceed the feed by, in parts of it.
const EXCESS_SHARE: f64 = 0.01;
/// What rounding may add to the way of a window.
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

/// Where the machine is after a tick.
#[derive(Clone, Copy, Debug)]
pub struct Boundary {
    /// How far along the path.
    pub along_mm: f64,
    /// How long the chords are up to here.
    pub chords_mm: f64,
    /// The path's greatest feed on the way of the tick, 0 if there was none.
    pub feed_mm_s: f64,
}

/// Takes ticks one by one.
#[derive(Debug)]
pub struct Feed {
    tick_s: f64,
    rounding_mm: f64,
    /// The boundaries of the ticks in the window.
    window: VecDeque<Boundary>,
    found: FeedError,
}

impl Feed {
    /// Begins at rest; the path begins with this feed.
    pub fn new(setup: &Setup, feed_mm_s: f64) -> Feed {
        let axes = Axis::LINEAR.into_iter().filter_map(|axis| setup.machine.axis(axis));
        let step_mm = axes.map(|axis| 1.0 / axis.steps_per_mm).fold(0.0, f64::max);
        Feed {
            tick_s: setup.tick_s(),
            rounding_mm: ROUNDING_STEPS * step_mm,
            window: VecDeque::from([Boundary { along_mm: 0.0, chords_mm: 0.0, feed_mm_s }]),
            found: FeedError::default(),
        }
    }

    /// Takes the end of a tick.
    pub fn tick(&mut self, boundary: Boundary, at: Place) {
        self.window.push_back(boundary);
        if self.window.len() <= WINDOW_TICKS {
            return;
        }
        // A tick matched with the end of one piece may run on the next already: its feed counts.
        let feed_mm_s = self.window.iter().map(|tick| tick.feed_mm_s).fold(0.0, f64::max);
        let Some(from) = self.window.pop_front() else { return };
        if feed_mm_s <= 0.0 || feed_mm_s.is_infinite() {
            return;
        }
        let time_s = WINDOW_TICKS as f64 * self.tick_s;
        let way_mm = (boundary.along_mm - from.along_mm).min(boundary.chords_mm - from.chords_mm);
        let speed_mm_s = way_mm / time_s;
        let percent = 100.0 * (speed_mm_s / feed_mm_s - 1.0);
        self.found.max_percent = self.found.max_percent.max(percent);
        let allowed_mm_s = feed_mm_s * (1.0 + EXCESS_SHARE) + self.rounding_mm / time_s;
        let share = |window: FeedWindow| window.speed_mm_s / window.allowed_mm_s;
        if self.found.worst.is_none_or(|worst| speed_mm_s / allowed_mm_s > share(worst)) {
            self.found.worst = Some(FeedWindow { speed_mm_s, allowed_mm_s, at });
        }
    }

    /// What was found.
    pub fn end(self) -> FeedError {
        self.found
    }
}
