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

use crate::base::Machine;

/// Share of `path_tolerance_mm` for corners; the rest is for the chords of arcs.
pub const CORNER_SHARE: f64 = 0.5;

/// X, Y and Z of a position.
pub type Place = [f64; 3];

/// Watches that no chord cuts a corner by more than its share of the path tolerance, where motion has no ramps
/// and turns at any speed. With ramps such corners are where it rests, and distances along the path do.
#[derive(Clone, Debug)]
pub struct CornerGuard {
    tolerance_mm: f64,
    boundary_mm: Place,
    passed: Vec<Place>,
}

impl CornerGuard {
    /// For a job that starts at a position, on a tick boundary.
    pub fn new(machine: &Machine, start_mm: Place) -> CornerGuard {
        CornerGuard {
            tolerance_mm: CORNER_SHARE * machine.path_tolerance_mm,
            boundary_mm: start_mm,
            passed: Vec::new(),
        }
    }

    /// The path is at this position on a tick boundary.
    #[inline]
    pub fn at_boundary(&mut self, position_mm: Place) {
        self.boundary_mm = position_mm;
        self.passed.clear();
    }

    /// The path turns at this position within a tick.
    #[inline]
    pub fn pass(&mut self, corner_mm: Place) {
        self.passed.push(corner_mm);
    }

    /// The last corner of this tick: where the path is, if it has turned since the boundary.
    pub fn last_corner(&self) -> Option<Place> {
        self.passed.last().copied()
    }

    /// Whether the chord to a position passes all corners of this tick within the tolerance, in
    /// their order.
    pub fn allows(&self, to_mm: &Place) -> bool {
        let from = &self.boundary_mm;
        let chord: Place = std::array::from_fn(|i| to_mm[i] - from[i]);
        let length_squared = dot(&chord, &chord);
        let mut share = 0.0_f64;
        self.passed.iter().all(|corner| {
            let offset: Place = std::array::from_fn(|i| corner[i] - from[i]);
            if length_squared > 0.0 {
                share = share.max((dot(&offset, &chord) / length_squared).clamp(0.0, 1.0));
            }
            let apart: Place = std::array::from_fn(|i| offset[i] - chord[i] * share);
            dot(&apart, &apart) <= self.tolerance_mm * self.tolerance_mm
        })
    }
}

fn dot(a: &Place, b: &Place) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(x: f64, y: f64) -> Place {
        [x, y, 0.0]
    }

    #[test]
    fn corners_are_held_in_order() {
        let machine = Machine::load("starmill").unwrap();
        let mut guard = CornerGuard::new(&machine, [0.0; 3]);
        guard.pass(point(0.1, 0.0));
        assert!(guard.allows(&point(0.2, 0.0)), "straight on");
        assert!(guard.allows(&point(0.2, 0.004)), "hardly a corner");
        assert!(!guard.allows(&point(0.1, 0.1)), "a right angle");
        assert!(!guard.allows(&point(0.0, 0.0)), "there and back");
        guard.pass(point(0.05, 0.0));
        assert!(!guard.allows(&point(0.2, 0.0)), "back on the way");
    }
}
