//! What a limited jerk adds to the ramps of a stop that are found with constant accelerations.
//!
//! ```text
//!  v ┤ plan ___ _                 Both ends of the ramp are rounded: at rest, where its
//!    │ ---''   ''-\               acceleration A begins and ends at nothing, and where it meets
//!    │   a        _`\   A        the plan, whose acceleration a away from the stop has to fall
//!    │               `\          to -A.
//!  0 ┼─────────────────`'--___ t
//! ```
//!
//! It is a bound: exact where the plan is steady. Speeds are not planned here.

use super::Ramp;
use super::piece::Piece;

/// Along a bent piece the acceleration is constant, and grows from piece to piece: as with this share
/// of the jerk, at least.
const BENT_SHARE: f64 = 0.5;

/// Where the plan is not steady its acceleration may change under an arc: what that takes, as a share
/// of the time in which jerk lets an acceleration grow to its greatest.
const UNSTEADY_RISES: f64 = 0.1;

/// The greatest acceleration and the least jerk on the way of a ramp, and how steep the plan is.
#[derive(Clone, Copy, Debug)]
pub struct Rounding {
    accel_mm_s2: f64,
    jerk_mm_s3: f64,
    steepest_mm_s2: f64,
}

impl Rounding {
    /// Of a way without limits.
    pub const NONE: Rounding =
        Rounding { accel_mm_s2: 0.0, jerk_mm_s3: f64::INFINITY, steepest_mm_s2: 0.0 };

    /// Of braking from a piece that is planned like this, and of speeding up to it.
    pub fn of(piece: &Piece, ramp: &Ramp) -> [Rounding; 2] {
        let speed_mm_s = ramp.peak_mm_s();
        let jerk_leaves_mm_s2 = piece.jerk.accel_max_mm_s2(speed_mm_s);
        let accel_mm_s2 = piece.accel_max_mm_s2().min(jerk_leaves_mm_s2);
        let share = if piece.is_straight() { 1.0 } else { BENT_SHARE };
        let jerk_mm_s3 = share * piece.jerk.jerk_mm_s3(speed_mm_s, accel_mm_s2);
        [1.0, -1.0].map(|sign| {
            let ends = ramp.stretches(0.0).flat_map(|stretch| [stretch.from, stretch.end()]);
            let steepest_mm_s2 = ends.map(|state| sign * state.accel_mm_s2).fold(0.0, f64::max);
            Rounding { accel_mm_s2, jerk_mm_s3, steepest_mm_s2 }
        })
    }

    /// Of a way over both.
    pub fn and(self, other: Rounding) -> Rounding {
        Rounding {
            accel_mm_s2: self.accel_mm_s2.max(other.accel_mm_s2),
            jerk_mm_s3: self.jerk_mm_s3.min(other.jerk_mm_s3),
            steepest_mm_s2: self.steepest_mm_s2.max(other.steepest_mm_s2),
        }
    }

    /// What is added to a ramp from or to a speed v. With B the acceleration that it reaches, the lesser
    /// of A and √(J·v),
    ///
    /// ```text
    /// (v/B + B/J - v/A)/2      a double S instead of a ramp of A, against going on at v
    /// ((B + a)³ - B³)/(24·J²·v)      more for an arc between slopes of a and -B than of 0 and -B
    /// ```
    ///
    /// An arc of jerk J between slopes that differ by c lies below their corner by c³/(24·J²) of way. Where
    /// the ramp begins at rest, or reaches A late, it is (A/4J)·((1 + a/A)² + 1) at most.
    pub fn more_s(&self, speed_mm_s: f64) -> f64 {
        let Rounding { accel_mm_s2, jerk_mm_s3, steepest_mm_s2 } = *self;
        if accel_mm_s2 <= 0.0 {
            return 0.0;
        }
        let share = 1.0 + (steepest_mm_s2 / accel_mm_s2).min(1.0);
        let rise_s = accel_mm_s2 / jerk_mm_s3;
        let most_s = 0.25 * rise_s * (share * share + 1.0);
        if speed_mm_s <= 0.0 {
            return most_s;
        }
        let reached_mm_s2 = accel_mm_s2.min((jerk_mm_s3 * speed_mm_s).sqrt());
        let double_s = 0.5
            * (speed_mm_s / reached_mm_s2 + reached_mm_s2 / jerk_mm_s3 - speed_mm_s / accel_mm_s2);
        let cubes = (reached_mm_s2 + steepest_mm_s2).powi(3) - reached_mm_s2.powi(3);
        let arc_s = cubes / (24.0 * jerk_mm_s3 * jerk_mm_s3 * speed_mm_s);
        let unsteady_s = if steepest_mm_s2 > 0.0 { UNSTEADY_RISES * rise_s } else { 0.0 };
        (double_s + arc_s + unsteady_s).min(most_s)
    }
}
