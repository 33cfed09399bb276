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
use super::limits::Limits;

/// Changes of direction below this are rounding of positions, not corners.
const STRAIGHT: f64 = 1e-9;

/// The widest window in which accelerations are taken, to either side.
const WINDOW_TICKS: f64 = 20.0;

/// A junction, as the segment before and the one after make it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Junction {
    /// Square of the greatest speed.
    pub speed_sq_max: f64,
    /// What sets it.
    pub bound: Bound,
    /// Angle between the directions in X, Y and Z, for the chords that ticks make of it.
    pub turn_rad: f64,
}

/// How the path bends in a junction that is less a corner than a point of a chopped curve. It takes its
/// share of the axes' acceleration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bend {
    /// The change of direction over the mean length.
    pub per_mm: Point,
    /// Square of the greatest speed there.
    pub speed_sq_max: f64,
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
    /// Both ends of a segment of this length.
    pub fn both(segment: &Segment, length_mm: f64) -> [End; 2] {
        let feed_mm_s = segment.feed_mm_s.unwrap_or(f64::INFINITY);
        let stops = segment.corner == Corner::Stop;
        let end = |tangent| End { tangent, length_mm, feed_mm_s, stops: false };
        let [from, to] = segment.tangents(length_mm).map(end);
        [from, End { stops, ..to }]
    }
}

impl Junction {
    /// Where the machine is at rest anyway.
    pub const REST: Junction = Junction { speed_sq_max: 0.0, bound: Bound::Stop, turn_rad: 0.0 };

    /// Where nothing changes.
    pub const STRAIGHT: Junction =
        Junction { speed_sq_max: f64::INFINITY, bound: Bound::Feed, turn_rad: 0.0 };

    /// The same, at rest.
    pub fn stopped(self) -> Junction {
        Junction { turn_rad: self.turn_rad, ..Junction::REST }
    }

    /// Between two segments, and how the path bends there.
    pub fn between(before: &End, after: &End, limits: &Limits) -> (Junction, Option<Bend>) {
        let lengths_mm = [before.length_mm, after.length_mm];
        let feed_mm_s = before.feed_mm_s.min(after.feed_mm_s);
        let tangents = [&before.tangent, &after.tangent];
        let (junction, bend) = Junction::at(tangents, lengths_mm, feed_mm_s, limits);
        if before.stops { (junction.stopped(), None) } else { (junction, bend) }
    }

    /// Where the derivatives change; between ways of these lengths, at this speed at most.
    pub fn at(
        [a, b]: [&Point; 2],
        lengths_mm: [f64; 2],
        feed_mm_s: f64,
        limits: &Limits,
    ) -> (Junction, Option<Bend>) {
        let mut junction = Junction { turn_rad: angle(a, b), ..Junction::STRAIGHT };
        let mean_mm = 0.5 * (lengths_mm[0] + lengths_mm[1]);
        let mut fastest_mm_s = feed_mm_s;
        for limit in &limits.axes {
            let axis = limit.axis;
            let change = (b[axis] - a[axis]).abs();
            if change > STRAIGHT {
                let jump_mm_s = limit.jump_mm_s / change;
                let spread_sq = limit.accel_max_mm_s2 * mean_mm / change;
                let speed_sq = (jump_mm_s * jump_mm_s).min(spread_sq);
                if speed_sq < junction.speed_sq_max {
                    junction.speed_sq_max = speed_sq;
                    junction.bound = Bound::Corner(axis);
                }
                let rate = a[axis].abs().max(b[axis].abs());
                fastest_mm_s = fastest_mm_s.min(limit.speed_max_mm_s / rate);
            }
        }
        if junction.speed_sq_max == f64::INFINITY
            || !junction.share(lengths_mm, fastest_mm_s, limits.tick_s)
        {
            return (junction, None);
        }
        let per_mm = AxisMap::from_fn(|axis| (b[axis] - a[axis]) / mean_mm);
        (junction, Some(Bend { per_mm, speed_sq_max: junction.speed_sq_max }))
    }

    /// Leaves room for the neighbours' steps of speed, where verify's widest window sees both, and
    /// tells whether it is a point of a chopped curve.
    fn share(&mut self, lengths_mm: [f64; 2], fastest_mm_s: f64, tick_s: f64) -> bool {
        let window_s = WINDOW_TICKS * tick_s;
        let jump_mm_s = self.speed_sq_max.sqrt();
        let window_mm = jump_mm_s.min(fastest_mm_s) * window_s;
        let [shorter_mm, longer_mm] =
            [lengths_mm[0].min(lengths_mm[1]), lengths_mm[0].max(lengths_mm[1])];
        if shorter_mm >= window_mm {
            return false;
        }
        let is_curve = longer_mm < window_mm;
        let share = if is_curve { 0.5 * (shorter_mm + longer_mm) / longer_mm } else { 0.5 };
        let speed_mm_s = (share * jump_mm_s).max(jump_mm_s.min(shorter_mm / window_s));
        self.speed_sq_max = speed_mm_s * speed_mm_s;
        is_curve
    }
}

/// The angle between two directions in X, Y and Z; 0 where one of them does not move these.
fn angle(a: &Point, b: &Point) -> f64 {
    let [a, b] = [a, b].map(|tangent| Axis::LINEAR.map(|axis| tangent[axis]));
    let dot = |p: &[f64; 3], q: &[f64; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
    let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let turn_rad = libm::atan2(dot(&cross, &cross).sqrt(), dot(&a, &b));
    if turn_rad > STRAIGHT { turn_rad } else { 0.0 }
}
