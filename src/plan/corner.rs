//! Corners inside a tick.
//!
//! Within a tick a node steps evenly, so what is executed between two tick boundaries is the
//! chord. A corner of the path that falls inside a tick is cut:
//!
//! ```text
//!               corner
//!                 /\
//!                /  \            boundary_mm: position at the last tick boundary
//!               /····\           passed: corners since then
//!    boundary_mm ----- next      the chord must pass all of them within the tolerance
//! ```

use crate::base::{Axis, Machine, Point};

/// Share of `path_tolerance_mm` for corners; the rest is for the chords of arcs.
const CORNER_SHARE: f64 = 0.5;

/// Watches that no chord cuts a corner by more than its share of the path tolerance.
#[derive(Clone, Debug)]
pub struct CornerGuard {
    tolerance_mm: f64,
    boundary_mm: Point,
    passed: Vec<Point>,
}

impl CornerGuard {
    /// For a job that starts at a position, on a tick boundary.
    pub fn new(machine: &Machine, start_mm: Point) -> CornerGuard {
        CornerGuard {
            tolerance_mm: CORNER_SHARE * machine.path_tolerance_mm,
            boundary_mm: start_mm,
            passed: Vec::new(),
        }
    }

    /// The path is at this position on a tick boundary.
    pub fn at_boundary(&mut self, position_mm: Point) {
        self.boundary_mm = position_mm;
        self.passed.clear();
    }

    /// The path turns at this position within a tick.
    pub fn pass(&mut self, corner_mm: Point) {
        self.passed.push(corner_mm);
    }

    /// The last corner of this tick: where the path is, if it has turned since the boundary.
    pub fn last_corner(&self) -> Option<Point> {
        self.passed.last().copied()
    }

    /// Whether a chord that ends within a distance of the last corner passes all corners of this tick
    /// within the tolerance, wherever it ends: no corner is further from a chord than from its
    /// nearer end.
    pub fn allows_within(&self, way_mm: f64) -> bool {
        let from = xyz(&self.boundary_mm);
        let is_near = |corner: &Point| {
            let offset: [f64; 3] = std::array::from_fn(|i| xyz(corner)[i] - from[i]);
            dot(&offset, &offset) <= self.tolerance_mm * self.tolerance_mm
        };
        way_mm <= self.tolerance_mm || self.passed.iter().all(is_near)
    }

    /// Whether the chord to a position passes all corners of this tick within the tolerance, in
    /// their order.
    pub fn allows(&self, to_mm: &Point) -> bool {
        let from = xyz(&self.boundary_mm);
        let chord: [f64; 3] = std::array::from_fn(|i| xyz(to_mm)[i] - from[i]);
        let length_squared = dot(&chord, &chord);
        let mut share = 0.0_f64;
        self.passed.iter().all(|corner| {
            let offset: [f64; 3] = std::array::from_fn(|i| xyz(corner)[i] - from[i]);
            if length_squared > 0.0 {
                share = share.max((dot(&offset, &chord) / length_squared).clamp(0.0, 1.0));
            }
            let apart: [f64; 3] = std::array::from_fn(|i| offset[i] - chord[i] * share);
            dot(&apart, &apart) <= self.tolerance_mm * self.tolerance_mm
        })
    }
}

fn xyz(point: &Point) -> [f64; 3] {
    Axis::LINEAR.map(|axis| point[axis])
}

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(x: f64, y: f64) -> Point {
        let mut point = Point::ZERO;
        (point[Axis::X], point[Axis::Y]) = (x, y);
        point
    }

    #[test]
    fn corners_are_held_in_order() {
        let machine = Machine::load("starmill").unwrap();
        let mut guard = CornerGuard::new(&machine, Point::ZERO);
        guard.pass(point(0.1, 0.0));
        assert!(guard.allows(&point(0.2, 0.0)), "straight on");
        assert!(guard.allows(&point(0.2, 0.004)), "hardly a corner");
        assert!(!guard.allows(&point(0.1, 0.1)), "a right angle");
        assert!(!guard.allows(&point(0.0, 0.0)), "there and back");
        guard.pass(point(0.05, 0.0));
        assert!(!guard.allows(&point(0.2, 0.0)), "back on the way");
    }
}
