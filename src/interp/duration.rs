//! How long a move takes at its feed: a feed mistyped by a few places must not make a plan of
//! years. How fast the machine can go is not asked here.

use std::f64::consts::TAU;

use crate::base::{Axis, Point};
use crate::gcode::{Block, Fault, rules};

use super::arc::sweep_rad;
use super::motion::{Move, MoveKind};

/// A day, in minutes.
const DAY_MIN: f64 = 24.0 * 60.0;

/// Longest that one move may take at its feed, in minutes: ten days. A large arc at a feed of 1,
/// which somebody may mean, takes two.
const MOVE_MIN_MAX: f64 = 10.0 * DAY_MIN;

/// The least feed, in mm or degrees a minute: a millimetre takes 19 years at it. Slower ones are typing
/// errors, and ways of a tick at them are lost beside a position's own rounding.
const FEED_MIN: f64 = 1e-7;

/// What is wrong with a move that takes longer than ten days, or has next to no feed.
pub(super) fn too_slow(step: &Move, block: &Block) -> Option<Fault> {
    let feed_min = step.kind.feed_mm_min()?;
    if is_quick(step) {
        return None;
    }
    let (length, unit) = length_and_unit(step);
    let minutes = length / feed_min;
    // Of a move that goes nowhere it is no number.
    if length == 0.0 {
        return None;
    }
    let (message, help) = if minutes > MOVE_MIN_MAX {
        let days = minutes / DAY_MIN;
        let least = round_up(length / MOVE_MIN_MAX);
        (
            format!("at {feed_min} {unit} a minute this movement takes {days:.1} days"),
            format!("at {least} {unit} a minute it takes ten days"),
        )
    } else if feed_min < FEED_MIN {
        (
            format!("at {feed_min} {unit} a minute this movement is as good as none"),
            format!("the least feed is {FEED_MIN:.7} {unit} a minute"),
        )
    } else {
        return None;
    };
    let fault = match block.word(b'F') {
        Some(word) => Fault::word(&rules::FEED_TOO_LOW, word, message),
        None => Fault::block(&rules::FEED_TOO_LOW, block, message),
    };
    Some(fault.help(help))
}

/// Whether a move is sure to have a feed that is none too slow.
#[inline]
pub(super) fn is_quick(step: &Move) -> bool {
    match (step.kind.feed_mm_min(), length_most(step)) {
        (Some(feed_min), Some(most)) => feed_min >= FEED_MIN && most <= feed_min * MOVE_MIN_MAX,
        (feed_min, _) => feed_min.is_none(),
    }
}

/// What the length of a line or an arc cannot exceed: the sum of its ways along the axes, and for an
/// arc so many turns at such a sum for its radius. This needs no roots and angles, and runs for every
/// move.
#[inline]
fn length_most(step: &Move) -> Option<f64> {
    let ways = step.to.0.iter().zip(&step.from.0).map(|(to, from)| (to - from).abs());
    let straight: f64 = ways.sum();
    let (plane, center_mm, turns) = match step.kind {
        MoveKind::Rapid | MoveKind::Line { .. } => return Some(straight),
        MoveKind::Arc { plane, center_mm, turns, .. } => (plane, center_mm, turns),
        MoveKind::Spline { .. } => return None,
    };
    let radius_most = |point: &Point| {
        let [first, second] = plane.axes();
        (point[first] - center_mm[0]).abs() + (point[second] - center_mm[1]).abs()
    };
    let radius = radius_most(&step.from).max(radius_most(&step.to));
    Some(straight + (1.0 + f64::from(turns)) * TAU * radius)
}

/// The length of a move that its feed applies to, as the path has it.
pub(super) fn length(step: &Move) -> f64 {
    length_and_unit(step).0
}

fn length_and_unit(step: &Move) -> (f64, &'static str) {
    match &step.kind {
        MoveKind::Rapid | MoveKind::Line { .. } => line_length(step),
        MoveKind::Arc { .. } => (arc_length_mm(step), "mm"),
        MoveKind::Spline { curve, .. } => (curve.length_mm(), "mm"),
    }
}

/// The way of a line that its feed applies to, and its unit.
fn line_length(step: &Move) -> (f64, &'static str) {
    let (length, axes) = step.from.feed_way(&step.to);
    (length, if axes.contains(&Axis::A) { "degrees" } else { "mm" })
}

fn arc_length_mm(step: &Move) -> f64 {
    let MoveKind::Arc { plane, center_mm, ccw, turns, .. } = step.kind else { return 0.0 };
    let [start, end] = [step.from, step.to].map(|point| plane.axes().map(|axis| point[axis]));
    let [radius_from_mm, radius_to_mm] =
        [start, end].map(|at| libm::hypot(at[0] - center_mm[0], at[1] - center_mm[1]));
    let turn_mm = radius_from_mm.max(radius_to_mm) * sweep_rad(start, end, center_mm, ccw, turns);
    let along_mm = step.to[plane.normal()] - step.from[plane.normal()];
    libm::hypot(libm::hypot(turn_mm, radius_to_mm - radius_from_mm), along_mm)
}

/// Four decimals at most, never less than the value.
fn round_up(value: f64) -> f64 {
    (value * 1e4).ceil() / 1e4
}
