//! What sets a speed.

use std::fmt;

use crate::base::Axis;

use super::run::Run;

/// Accelerations that differ by less than this share are the same.
const ACCELS_EQUAL: f64 = 1e-3;

/// What sets the speed of a piece of the path, or of a junction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Bound {
    /// The feed of the program.
    Feed,
    /// The greatest speed of an axis.
    AxisSpeed(Axis),
    /// The most steps that an axis's node makes in a tick.
    Count(Axis),
    /// The acceleration across the path of a curve.
    Curvature(Axis),
    /// The chord that a tick makes of a curve.
    Chord,
    /// The step of an axis's speed where two segments meet.
    Corner(Axis),
    /// The chord that a tick makes of corners.
    Tick,
    /// A stop that the program asks for, or that a turn back takes.
    Stop,
    /// The acceleration along the path: from the speed before, or to the speed after.
    Acceleration,
    /// How fast that acceleration may change: it is never at its greatest.
    Jerk,
    /// The end of a node buffer.
    Seam,
}

impl Bound {
    /// What sets the greatest speed of a run.
    #[inline]
    pub(super) fn of(run: &Run) -> Bound {
        match run.piece.bound(run.ends_mm_s, run.ramp.peak_mm_s()) {
            Bound::Acceleration if run.at_seam => Bound::Seam,
            Bound::Acceleration => Bound::of_ramp(run),
            bound => bound,
        }
    }

    /// What sets how steep its ramp is: acceleration where it is at its greatest somewhere.
    #[inline]
    pub(super) fn of_ramp(run: &Run) -> Bound {
        if !run.piece.jerk.is_limited() {
            return Bound::Acceleration;
        }
        Bound::of_legs(run)
    }

    #[inline(never)]
    fn of_legs(Run { piece, ramp, .. }: &Run) -> Bound {
        let is_all =
            |accel_mm_s2: f64, most_mm_s2: f64| accel_mm_s2 >= most_mm_s2 * (1.0 - ACCELS_EQUAL);
        let reaches = ramp.stretches(0.0).any(|stretch| {
            let (from, end) = (stretch.from, stretch.end());
            is_all(from.accel_mm_s2, piece.speeding_up_mm_s2(from.speed_sq()))
                || is_all(-end.accel_mm_s2, piece.braking_mm_s2(end.speed_sq()))
        });
        if reaches { Bound::Acceleration } else { Bound::Jerk }
    }
}

impl fmt::Display for Bound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Bound::Feed => write!(f, "feed"),
            Bound::AxisSpeed(axis) => write!(f, "speed of {axis}"),
            Bound::Count(axis) => write!(f, "steps a tick of {axis}"),
            Bound::Curvature(axis) => write!(f, "acceleration of {axis} in curves"),
            Bound::Chord => write!(f, "chord of a tick in curves"),
            Bound::Corner(axis) => write!(f, "speed step of {axis} in corners"),
            Bound::Tick => write!(f, "chord of a tick in corners"),
            Bound::Stop => write!(f, "stop"),
            Bound::Acceleration => write!(f, "acceleration"),
            Bound::Jerk => write!(f, "jerk"),
            Bound::Seam => write!(f, "seam"),
        }
    }
}
