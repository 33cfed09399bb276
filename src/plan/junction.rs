//! How fast the path may be where two segments meet.
//!
//! ```text
//!            t₁  __,-  after          On each axis the speed steps by v·|t₂ - t₁|. Allowed is
//!           __,-'                      - what a tick-sampled machine sees of its acceleration,
//!  --------* junction                    or the motor's start-stop speed, whichever is more;
//!  before  t₂                          - v²·|t₂ - t₁| / L ≤ a, with L the mean of both lengths:
//!                                        so a finely chopped arc is no faster than the arc.
//! ```

use crate::base::machine::AxisProfile;
use crate::base::{Axis, AxisMap, Machine, Point};
use crate::path::{Corner, Rates, Segment};

use super::Bound;

/// Changes of direction below this are rounding of positions, not corners.
const STRAIGHT: f64 = 1e-9;

/// A junction, as the segment before and the one after make it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Junction {
    /// Square of the greatest speed.
    pub speed_sq_max: f64,
    /// What sets it.
    pub bound: Bound,
    /// Angle between the directions in X, Y and Z, for the chords that ticks make of it.
    pub turn_rad: f64,
    /// How the path bends there, where it is less a corner than a point of a chopped curve: the change
    /// of direction over the mean length. It takes its share of the axes' acceleration.
    pub bend_per_mm: Option<Point>,
}

impl Junction {
    /// Where the machine is at rest anyway.
    pub const REST: Junction =
        Junction { speed_sq_max: 0.0, bound: Bound::Stop, turn_rad: 0.0, bend_per_mm: None };

    /// Where nothing changes.
    pub const STRAIGHT: Junction = Junction {
        speed_sq_max: f64::INFINITY,
        bound: Bound::Feed,
        turn_rad: 0.0,
        bend_per_mm: None,
    };

    /// The same, at rest.
    pub fn stopped(self) -> Junction {
        Junction { turn_rad: self.turn_rad, ..Junction::REST }
    }

    /// Between two segments.
    pub fn between(before: &Segment, after: &Segment, machine: &Machine) -> Junction {
        let length_mm = 0.5 * (before.length_mm() + after.length_mm());
        let [a, b] = [before.rates_at(1.0), after.rates_at(0.0)];
        let junction = Junction::at(&a, &b, length_mm, machine);
        if before.corner == Corner::Stop { junction.stopped() } else { junction }
    }

    /// Where the derivatives change; between ways of this length, in the mean.
    pub fn at(a: &Rates, b: &Rates, length_mm: f64, machine: &Machine) -> Junction {
        let change = AxisMap::from_fn(|axis| b.tangent[axis] - a.tangent[axis]);
        let mut junction = Junction { turn_rad: angle(a, b), ..Junction::STRAIGHT };
        let mut is_curve = false;
        for profile in &machine.axes {
            let change = change[profile.axis].abs();
            if change > STRAIGHT {
                let jump_mm_s = jump_mm_s(profile, machine) / change;
                let spread_sq = profile.accel_max_mm_s2 * length_mm / change;
                let speed_sq = (jump_mm_s * jump_mm_s).min(spread_sq);
                if speed_sq < junction.speed_sq_max {
                    junction.speed_sq_max = speed_sq;
                    junction.bound = Bound::Corner(profile.axis);
                    is_curve = spread_sq == speed_sq;
                }
            }
        }
        if is_curve {
            junction.bend_per_mm = Some(AxisMap::from_fn(|axis| change[axis] / length_mm));
        }
        junction
    }
}

/// The speed step that an axis may make at once.
fn jump_mm_s(profile: &AxisProfile, machine: &Machine) -> f64 {
    (profile.accel_max_mm_s2 * machine.bus.tick_s()).max(profile.start_speed_mm_s)
}

/// The angle between two directions in X, Y and Z; 0 where one of them does not move these.
fn angle(a: &Rates, b: &Rates) -> f64 {
    let [a, b] = [a, b].map(|rates| Axis::LINEAR.map(|axis| rates.tangent[axis]));
    let dot = |p: &[f64; 3], q: &[f64; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
    let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let turn_rad = dot(&cross, &cross).sqrt().atan2(dot(&a, &b));
    if turn_rad > STRAIGHT { turn_rad } else { 0.0 }
}
