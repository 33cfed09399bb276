//! How much jerk the axes stand along a piece.
//!
//! An axis at x(s) on a path run with speed v, acceleration a and jerk j has the jerk
//!
//! ```text
//! x'·j + 3·x''·v·a + x'''·v³          (d³/dt³ of x(s(t)))
//! ```
//!
//! where x', x'' and x''' are derivatives by the way s. For x''' that of the circle of the same bend
//! κ counts, -κ²·x': where the bend itself changes, at the ends of arcs and chords, the path asks for
//! a step of acceleration that no speed but zero takes away. What turning takes, κ²·v³, and what a bend
//! under acceleration takes, 3·x''·v·a, are held so that a share of the jerk is always left.

use crate::base::{Axis, Point};
use crate::path::RatesRef;
use crate::plan::limits::Limits;

use super::stretch::State;

/// Share of an axis's jerk that turning alone may take: it holds the speed.
const TURN_SHARE: f64 = 0.5;

/// Share that is always left for changes of acceleration along the path.
const ALONG_SHARE: f64 = 0.25;

/// Where axes have no limit on jerk, so much: 1000 mm/s² are up in 0.1 ms, within a tick, and on a way (2 nm)
/// that does not vanish beside positions of metres.
const UNLIMITED_MM_S3: f64 = 1e7;

/// What a piece leaves of the axes' jerk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JerkLimit {
    /// Greatest jerk along the path where it is straight.
    along_mm_s3: f64,
    /// Share of an axis's jerk that each mm²/s³ of speed times acceleration takes, at most.
    bend: f64,
    /// Share of it that each (mm/s)³ takes, at most.
    turn: f64,
    /// The axis of which that is.
    turn_axis: Axis,
}

impl JerkLimit {
    /// No axis has a limit.
    pub const NONE: JerkLimit =
        JerkLimit { along_mm_s3: UNLIMITED_MM_S3, bend: 0.0, turn: 0.0, turn_axis: Axis::X };

    /// Along a line on which the axes move at these rates.
    #[inline(never)]
    pub fn straight(rates: &Point, limits: &Limits) -> JerkLimit {
        let mut limit = JerkLimit::NONE;
        for profile in &limits.axes {
            let rate = rates[profile.axis].abs();
            if let Some(jerk_mm_s3) = profile.jerk_max_mm_s3.filter(|_| rate > 0.0) {
                limit.along_mm_s3 = limit.along_mm_s3.min(jerk_mm_s3 / rate);
            }
        }
        limit
    }

    /// Along a bent piece with these derivatives at its ends.
    pub fn bent(ends: [RatesRef<'_>; 2], limits: &Limits) -> JerkLimit {
        let mut limit = JerkLimit::NONE;
        let bend_sq = |rates: &RatesRef<'_>| {
            Axis::LINEAR.iter().map(|axis| rates.bend_per_mm[*axis].powi(2)).sum::<f64>()
        };
        let turn_sq = bend_sq(&ends[0]).max(bend_sq(&ends[1]));
        for profile in &limits.axes {
            let Some(jerk_mm_s3) = profile.jerk_max_mm_s3 else { continue };
            let axis = profile.axis;
            let [rate, bend] = [
                |rates: &RatesRef<'_>, axis| rates.tangent[axis],
                |rates: &RatesRef<'_>, axis| rates.bend_per_mm[axis],
            ]
            .map(|of: fn(&RatesRef<'_>, Axis) -> f64| {
                f64::max(of(&ends[0], axis).abs(), of(&ends[1], axis).abs())
            });
            limit.along_mm_s3 = limit.along_mm_s3.min(jerk_mm_s3 / rate);
            limit.bend = limit.bend.max(3.0 * bend / jerk_mm_s3);
            let turn = turn_sq * rate / jerk_mm_s3;
            if turn > limit.turn {
                (limit.turn, limit.turn_axis) = (turn, axis);
            }
        }
        limit
    }

    /// The greatest jerk along the path where it is straight.
    pub fn along_mm_s3(&self) -> f64 {
        self.along_mm_s3
    }

    /// Whether an axis that moves has a limit.
    pub fn is_limited(&self) -> bool {
        self.along_mm_s3 < UNLIMITED_MM_S3
    }

    /// Square of the speed at which turning takes its share of an axis's jerk, and the axis.
    pub fn speed_sq_max(&self) -> Option<(f64, Axis)> {
        (self.turn > 0.0).then(|| {
            let speed_mm_s = libm::cbrt(TURN_SHARE / self.turn);
            (speed_mm_s * speed_mm_s, self.turn_axis)
        })
    }

    /// The greatest acceleration at a speed that leaves the share for changes of it.
    pub fn accel_max_mm_s2(&self, speed_mm_s: f64) -> f64 {
        let taken = self.turn * speed_mm_s.powi(3);
        if self.bend > 0.0 {
            (1.0 - ALONG_SHARE - taken) / (self.bend * speed_mm_s)
        } else {
            f64::INFINITY
        }
    }

    /// The greatest jerk along the path at a speed and an acceleration.
    pub fn jerk_mm_s3(&self, speed_mm_s: f64, accel_mm_s2: f64) -> f64 {
        let taken = self.turn * speed_mm_s.powi(3) + self.bend * speed_mm_s * accel_mm_s2.abs();
        self.along_mm_s3 * (1.0 - taken).max(ALONG_SHARE)
    }

    /// The greatest jerk along the path with which the acceleration may grow from a state over a way, up to
    /// a greatest one: what is left at the end of it.
    pub fn climbing_mm_s3(&self, from: &State, length_mm: f64, accel_max_mm_s2: f64) -> f64 {
        if self.bend == 0.0 {
            return self.jerk_mm_s3(from.speed_mm_s, accel_max_mm_s2);
        }
        let most_mm_s3 = self.jerk_mm_s3(from.speed_mm_s, from.accel_mm_s2);
        let grown_mm_s2 = most_mm_s3 * from.rising_s(length_mm, most_mm_s3);
        let end_mm_s2 = (from.accel_mm_s2 + grown_mm_s2).min(accel_max_mm_s2);
        self.jerk_mm_s3(from.speed_mm_s, end_mm_s2)
    }
}
