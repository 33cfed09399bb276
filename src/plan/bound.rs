//! What sets a speed.

use std::fmt;

use crate::base::Axis;

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
    /// The end of a node buffer.
    Seam,
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
            Bound::Seam => write!(f, "seam"),
        }
    }
}
