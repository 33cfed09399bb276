//! Axes other than X, Y and Z against the path: they are no part of the contour, and are held to
//! half a step each, tick by tick.
//!
//! Where on the path the machine is after a tick is known by X, Y and Z as far as the bound of the
//! contour error leaves it open. An axis has to be where the path has it somewhere in that part,
//! which is long where X, Y and Z rest: there the axis may be anywhere between its ends.

use super::edges::{Vector, difference, dot};
use super::feed::{Feed, Standing, steps_mm};
use super::report::{Check, Place};
use super::{OTHER_AXES, Others, Setup, feed_check};
use crate::base::{Axis, Machine};

/// What an axis may be off its path by: what rounding makes.
const HALF_STEP: f64 = 0.5;
/// What rounding of the last digits may add, in steps.
const ROUNDING_STEPS: f64 = 1e-6;

/// The axes of a machine other than X, Y and Z.
#[derive(Debug)]
pub struct OtherAxes(Vec<OtherAxis>);

#[derive(Debug)]
struct OtherAxis {
    axis: Axis,
    /// Its index among all that there may be.
    index: usize,
    steps_per_mm: f64,
    /// Where it may be now, in steps.
    range: [f64; 2],
    off_steps: f64,
    at: Option<Place>,
    has_moved: bool,
}

impl OtherAxes {
    /// Those that the machine has.
    pub fn new(machine: &Machine) -> OtherAxes {
        let axes = OTHER_AXES.into_iter().enumerate();
        let known = |(index, axis): (usize, Axis)| {
            let steps_per_mm = machine.axis(axis)?.steps_per_mm;
            let (range, off_steps, at, has_moved) = ([0.0; 2], 0.0, None, false);
            Some(OtherAxis { axis, index, steps_per_mm, range, off_steps, at, has_moved })
        };
        OtherAxes(axes.filter_map(known).collect())
    }

    /// Whether the machine has any.
    pub fn any(&self) -> bool {
        !self.0.is_empty()
    }

    /// From here on they may be between these positions.
    pub fn reach(&mut self, [low, high]: [Others; 2]) {
        for axis in &mut self.0 {
            axis.range = [low[axis.index], high[axis.index]].map(|at| at * axis.steps_per_mm);
        }
    }

    /// Whether these positions, in steps, are where they may be.
    pub fn allow(&self, steps: &Others) -> bool {
        self.0.iter().all(|axis| axis.off(steps) <= HALF_STEP)
    }

    /// They are at these positions after a tick.
    pub fn take(&mut self, steps: &Others, place: Place) {
        for axis in &mut self.0 {
            let off_steps = axis.off(steps);
            axis.has_moved |= axis.range[0] != axis.range[1] || off_steps > HALF_STEP;
            if off_steps > axis.off_steps {
                (axis.off_steps, axis.at) = (off_steps, Some(place));
            }
        }
    }

    /// A check for each that is to move, or does.
    pub fn checks(&self) -> Vec<Check> {
        let moved = self.0.iter().filter(|axis| axis.has_moved);
        let check = |axis: &OtherAxis| {
            let check = Check::new("off the path", Some(axis.axis), axis.off_steps, HALF_STEP);
            Check { unit: "steps", at: axis.at, ..check }
        };
        moved.map(check).collect()
    }
}

/// The speed of A B C, or of U V W, against the feed of motions that move none before them.
#[derive(Debug)]
pub struct OthersFeed {
    feed: Feed,
    /// The first of the axes among all others.
    first: usize,
    /// How far a step is on each.
    step_sizes: Vector,
    at: Vector,
    /// The way so far, which is what was executed: the path has no other.
    along: f64,
}

impl OthersFeed {
    /// Of A B C and of U V W, at rest at these positions, in steps.
    pub fn both(setup: &Setup, steps: &Others) -> [OthersFeed; 2] {
        [0, 3].map(|first| {
            let axes = [0, 1, 2].map(|i| OTHER_AXES[first + i]);
            let step_sizes = steps_mm(setup.machine, axes);
            let at = [0, 1, 2].map(|i| steps[first + i] * step_sizes[i]);
            let feed = Feed::new(setup, step_sizes, at);
            OthersFeed { feed, first, step_sizes, at, along: 0.0 }
        })
    }

    /// They are at these positions after a tick, on motions with this feed at most.
    pub fn tick(&mut self, steps: &Others, feed: f64, place: Place) {
        let at = [0, 1, 2].map(|i| steps[self.first + i] * self.step_sizes[i]);
        let way = difference(at, std::mem::replace(&mut self.at, at));
        let length = dot(way, way).sqrt();
        self.along += length;
        let feed_mm_s = if length > 0.0 { feed } else { 0.0 };
        let standing = Standing { at, along_mm: self.along, feed_mm_s, may_be_cut: false };
        self.feed.tick(standing, place);
    }

    /// What was found, if there was anything to hold.
    pub fn check(self) -> Option<Check> {
        let unit = if OTHER_AXES[self.first].is_rotary() { "degrees/s" } else { "mm/s" };
        Some(feed_check(&self.feed.end().worst?, unit))
    }
}

impl OtherAxis {
    /// How far a position is from where the axis may be, in steps.
    fn off(&self, steps: &Others) -> f64 {
        let at = steps[self.index];
        let [low, high] = self.range;
        (low - at).max(at - high).max(ROUNDING_STEPS) - ROUNDING_STEPS
    }
}
