//! How fast the path may be where two segments meet.
//!
//! ```text
//!            t₁  __,-  after          On each axis the speed steps by v·|t₂ - t₁|. Allowed is
//!           __,-'                      - what a tick-sampled machine sees of its acceleration,
//!  --------* junction                    or the motor's start-stop speed, whichever is more;
//!  before  t₂                          - v²·|t₂ - t₁| / L ≤ a, with L the mean of both lengths:
//!                                        so a finely chopped arc is no faster than the arc.
//! ```
//!
//! Accelerations are judged in windows of up to 20 ticks to either side, which may see one whole step
//! of speed beyond a. Where ways are shorter than that, steps add up: between two such ways it is a
//! point of a chopped curve, whose step counts as acceleration over half of both ways. A window that
//! begins or ends within a way sees up to the longer way's share of a step uncounted, so steps are held
//! to half of one there. Beside one short way a step is half as well: two of them make one.

use crate::base::{Axis, AxisMap, Point};
use crate::path::{Corner, Segment};

use super::Bound;
use super::extreme::{greater, lesser};
use super::limits::{AxisLimits, Limits};

/// Changes of direction below this are rounding of positions, not corners.
const STRAIGHT: f64 = 1e-9;

/// The tangent of an angle that a series gives as well as the arctangent.
const SMALL: f64 = 0.03;

/// A junction, as the segment before and the one after make it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Junction {
    /// Square of the greatest speed.
    pub speed_sq_max: f64,
    /// What sets it.
    pub bound: Bound,
    /// How the path turns there, for the chords that ticks make of it.
    pub turn: Turn,
}

/// An angle between two directions in X, Y and Z; none where one of them does not move these. Few are ever
/// asked for: the products that they follow from are kept.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    cross_sq: f64,
    dot: f64,
}

impl Turn {
    /// Straight on.
    pub const NONE: Turn = Turn { cross_sq: 0.0, dot: 1.0 };

    fn between(a: &Point, b: &Point) -> Turn {
        let ([ax, ay, az], [bx, by, bz]) = (a.xyz(), b.xyz());
        let [x, y, z] = [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx];
        Turn { cross_sq: x * x + y * y + z * z, dot: ax * bx + ay * by + az * bz }
    }

    /// Whether it is no more than rounding makes of none.
    #[inline]
    pub fn is_none(&self) -> bool {
        self.dot >= 0.0 && self.cross_sq <= STRAIGHT * STRAIGHT * self.dot * self.dot
    }

    /// Whether it is more than a right angle.
    #[inline]
    pub fn is_back(&self) -> bool {
        self.dot < 0.0
    }

    /// Square of its tangent, which is more than the angle; infinite from a right angle on.
    #[inline]
    pub fn tan_sq(&self) -> f64 {
        if self.dot > 0.0 { self.cross_sq / (self.dot * self.dot) } else { f64::INFINITY }
    }

    /// The angle. A small one, x by its tangent, is x - x³/3 + x⁵/5 - x⁷/7: what is left out is below 1e-13 of it.
    pub fn rad(&self) -> f64 {
        let (sin, cos) = (self.cross_sq.sqrt(), self.dot);
        if sin >= SMALL * cos {
            return libm::atan2(sin, cos);
        }
        let tan = sin / cos;
        let sq = tan * tan;
        tan * (1.0 - sq * (1.0 / 3.0 - sq * (1.0 / 5.0 - sq / 7.0)))
    }
}

/// How the path bends in a junction that is less a corner than a point of a chopped curve. It takes its
/// share of the axes' acceleration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bend {
    /// The change of direction over the mean length.
    pub per_mm: Point,
    /// Square of the greatest speed there, that of the slower feed at most.
    pub speed_sq_max: f64,
    /// It turns by more than a right angle: as no curve does whose chords are of any use.
    pub is_back: bool,
}

/// The end of a segment in a junction.
#[derive(Clone, Copy, Debug)]
pub struct End {
    /// Derivatives of the position by the way there.
    pub tangent: Point,
    /// Length of the segment.
    pub length_mm: f64,
    /// Its feed; infinite of a rapid.
    pub feed_mm_s: f64,
    /// The machine stops there.
    pub stops: bool,
}

impl End {
    /// Of no segment.
    pub const NONE: End =
        End { tangent: Point::ZERO, length_mm: 0.0, feed_mm_s: f64::INFINITY, stops: false };

    /// The last end of a segment of this length.
    pub fn last(segment: &Segment, length_mm: f64) -> End {
        let mut end = End::NONE;
        end.become_last(segment, length_mm);
        end
    }

    /// Becomes the last end of a segment of this length.
    #[inline]
    pub fn become_last(&mut self, segment: &Segment, length_mm: f64) {
        segment.tangent_at_end(length_mm, &mut self.tangent);
        self.length_mm = length_mm;
        self.feed_mm_s = segment.feed_mm_s.unwrap_or(f64::INFINITY);
        self.stops = segment.corner == Corner::Stop;
    }
}

impl Junction {
    /// Where the machine is at rest anyway.
    pub const REST: Junction = Junction { speed_sq_max: 0.0, bound: Bound::Stop, turn: Turn::NONE };

    /// Where nothing changes.
    pub const STRAIGHT: Junction =
        Junction { speed_sq_max: f64::INFINITY, bound: Bound::Feed, turn: Turn::NONE };

    /// Leaves room for the neighbours' steps of speed, where verify's widest window sees both, and
    /// tells whether it is a point of a chopped curve.
    fn share(&mut self, lengths_mm: [f64; 2], fastest_mm_s: f64, window_s: f64) -> bool {
        let jump_mm_s = self.speed_sq_max.sqrt();
        let window_mm = lesser(jump_mm_s, fastest_mm_s) * window_s;
        let [shorter_mm, longer_mm] =
            [lesser(lengths_mm[0], lengths_mm[1]), greater(lengths_mm[0], lengths_mm[1])];
        if shorter_mm >= window_mm {
            return false;
        }
        let is_curve = longer_mm < window_mm;
        let share = if is_curve { 0.5 * (shorter_mm + longer_mm) / longer_mm } else { 0.5 };
        let speed_mm_s = greater(share * jump_mm_s, lesser(jump_mm_s, shorter_mm / window_s));
        self.speed_sq_max = speed_mm_s * speed_mm_s;
        is_curve
    }
}

/// How two ways join. It is found where it stays: copied right behind its making it would be read back before
/// it is written.
#[derive(Clone, Copy, Debug)]
pub struct Joint {
    /// How fast the path may be there.
    pub junction: Junction,
    /// How it bends, where that is less a corner than a point of a chopped curve.
    pub bend: Option<Bend>,
}

impl Joint {
    /// Where the machine is at rest anyway.
    pub const REST: Joint = Joint { junction: Junction::REST, bend: None };

    /// Becomes that between two segments, of which the second starts with these derivatives.
    #[inline]
    pub fn join(&mut self, before: &End, after: &End, start: &Point, limits: &Limits) {
        let lengths_mm = [before.length_mm, after.length_mm];
        let feed_mm_s = lesser(before.feed_mm_s, after.feed_mm_s);
        self.join_at([&before.tangent, start], lengths_mm, feed_mm_s, limits);
        if before.stops {
            self.stop();
        }
    }

    /// The machine stops there, however the path turns.
    #[inline(never)]
    pub fn stop(&mut self) {
        let turn = self.junction.turn;
        *self = Joint::REST;
        self.junction.turn = turn;
    }

    /// Becomes that where the derivatives change, between ways of these lengths, at this speed at most.
    pub fn join_at(
        &mut self,
        [a, b]: [&Point; 2],
        lengths_mm: [f64; 2],
        feed_mm_s: f64,
        limits: &Limits,
    ) {
        let Joint { junction, bend } = self;
        *bend = None;
        let mean_mm = 0.5 * (lengths_mm[0] + lengths_mm[1]);
        // The inverse of the speed that jumps allow, and that of the square of the one that accelerations
        // over the mean length do, each of the axis that allows least.
        let (mut jump_s_mm, mut jump_axis, mut spread_s2_mm) = (0.0, Axis::X, 0.0);
        let change = |axis: Axis| (b[axis] - a[axis]).abs();
        for limit in &limits.axes {
            let change = change(limit.axis);
            if change > STRAIGHT {
                let jump = change * limit.per_jump_s_mm;
                if jump > jump_s_mm {
                    (jump_s_mm, jump_axis) = (jump, limit.axis);
                }
                spread_s2_mm = greater(spread_s2_mm, change * limit.per_accel_s2_mm);
            }
        }
        *junction = Junction { turn: Turn::between(a, b), ..Junction::STRAIGHT };
        if jump_s_mm == 0.0 {
            return;
        }
        let is_jump = spread_s2_mm <= jump_s_mm * jump_s_mm * mean_mm;
        (junction.speed_sq_max, junction.bound) = if is_jump {
            (1.0 / (jump_s_mm * jump_s_mm), Bound::Corner(jump_axis))
        } else {
            let is_it =
                |limit: &&AxisLimits| change(limit.axis) * limit.per_accel_s2_mm == spread_s2_mm;
            let axis = limits.axes.iter().find(is_it).map_or(jump_axis, |limit| limit.axis);
            (mean_mm / spread_s2_mm, Bound::Corner(axis))
        };
        // Ways that the window holds at no speed that the jump allows have no steps to share.
        let is_long = lesser(lengths_mm[0], lengths_mm[1]) * jump_s_mm >= limits.window_s;
        let fastest_mm_s = || lesser(feed_mm_s, limits.fastest_mm_s(a, b));
        if is_long || !junction.share(lengths_mm, fastest_mm_s(), limits.window_s) {
            return;
        }
        let per_mean_mm = 1.0 / mean_mm;
        let per_mm = AxisMap::from_fn(|axis| (b[axis] - a[axis]) * per_mean_mm);
        let speed_sq_max = lesser(junction.speed_sq_max, feed_mm_s * feed_mm_s);
        *bend = Some(Bend { per_mm, speed_sq_max, is_back: junction.turn.is_back() });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn turns_are_angles(angle_rad in 0.0..std::f64::consts::PI, scale in 0_i32..8) {
            let angle_rad = angle_rad * 0.1_f64.powi(scale);
            let toward = |angle_rad: f64| {
                let mut tangent = Point::ZERO;
                (tangent[Axis::Y], tangent[Axis::Z]) = (libm::cos(angle_rad), libm::sin(angle_rad));
                tangent
            };
            let turn = Turn::between(&toward(0.0), &toward(angle_rad));
            prop_assert!((turn.rad() - angle_rad).abs() <= 1e-12 * angle_rad.max(1e-3));
            prop_assert_eq!(turn.is_none(), angle_rad <= STRAIGHT);
            prop_assert!(turn.tan_sq() >= angle_rad * angle_rad * (1.0 - 1e-12));
        }
    }
}
