//! The planes of arcs.

use crate::base::Axis;

/// The plane in which an arc lies. Counter-clockwise is as seen from the positive end of the
/// third axis, so the order of the axes matters: XY, ZX, YZ (RS-274; seed 004's table 6.1 prints
/// G18 and G19 the wrong way round).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Plane {
    /// G17
    Xy,
    /// G18
    Zx,
    /// G19
    Yz,
}

impl Plane {
    /// The plane's first and second axis; from the first to the second is counter-clockwise.
    pub fn axes(self) -> [Axis; 2] {
        match self {
            Plane::Xy => [Axis::X, Axis::Y],
            Plane::Zx => [Axis::Z, Axis::X],
            Plane::Yz => [Axis::Y, Axis::Z],
        }
    }

    /// The axis across the plane.
    pub fn normal(self) -> Axis {
        match self {
            Plane::Xy => Axis::Z,
            Plane::Zx => Axis::Y,
            Plane::Yz => Axis::X,
        }
    }

    /// `XY`, `ZX` or `YZ`.
    pub fn name(self) -> &'static str {
        match self {
            Plane::Xy => "XY",
            Plane::Zx => "ZX",
            Plane::Yz => "YZ",
        }
    }
}
