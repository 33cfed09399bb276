//! One axis's way by hand → Segment: planned like any line, and held to the axis's travel.
//!
//! Knows nothing of where the axis stands but what it is told.

use crate::base::{Axis, AxisMap, Machine, Point};
use crate::path::{Corner, Curve, Segment};

/// Why an axis cannot be jogged.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum JogError {
    /// The machine has no such axis.
    #[error("this machine has no axis {0}")]
    NoAxis(Axis),
    /// The way is shorter than half a motor step.
    #[error("{by_mm} is less than half a step of {axis} (1 step is {step_mm})")]
    NoStep {
        /// The axis.
        axis: Axis,
        /// The way asked for.
        by_mm: f64,
        /// One motor step.
        step_mm: f64,
    },
    /// The way ends outside of the travel, and not nearer to it than it begins.
    #[error(
        "{axis} would go from {from_mm} to {to_mm}, its travel is {low_mm} to {high_mm} (machine coordinates)"
    )]
    Travel {
        /// The axis.
        axis: Axis,
        /// Where it stands.
        from_mm: f64,
        /// Where it would go.
        to_mm: f64,
        /// Least position.
        low_mm: f64,
        /// Greatest position.
        high_mm: f64,
    },
}

/// The share of its greatest speed that an axis is jogged at unless told otherwise.
const SPEED_SHARE: f64 = 0.25;

/// The way of an axis from the position `from_mm` by `by_mm`, at a feed or at a quarter of the axis's
/// greatest speed; all in machine coordinates, degrees on rotary axes. All other axes rest where
/// `from_mm` has them.
///
/// # Errors
/// See [`JogError`].
pub fn jog(
    machine: &Machine,
    axis: Axis,
    from_mm: Point,
    by_mm: f64,
    feed_mm_min: Option<f64>,
) -> Result<Segment, JogError> {
    let profile = machine.axis(axis).ok_or(JogError::NoAxis(axis))?;
    if (by_mm * profile.steps_per_mm).abs() < 0.5 {
        return Err(JogError::NoStep { axis, by_mm, step_mm: 1.0 / profile.steps_per_mm });
    }
    let to_mm = AxisMap::from_fn(|at| from_mm[at] + if at == axis { by_mm } else { 0.0 });
    let (from, to) = (from_mm[axis], to_mm[axis]);
    if let Some([low_mm, high_mm]) = profile.travel_mm {
        // What stands outside, at its home switch, may come back.
        if (to < low_mm && by_mm < 0.0) || (to > high_mm && by_mm > 0.0) {
            return Err(JogError::Travel { axis, from_mm: from, to_mm: to, low_mm, high_mm });
        }
    }
    let feed_mm_s = feed_mm_min.map_or(profile.speed_max_mm_s * SPEED_SHARE, |feed| feed / 60.0);
    Ok(Segment {
        line: 1,
        feed_mm_s: Some(feed_mm_s),
        from_mm,
        to_mm,
        curve: Curve::Line,
        corner: Corner::Stop,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(from_x_mm: f64, by_mm: f64) -> Result<f64, JogError> {
        let machine = Machine::load("starmill").unwrap();
        let mut from_mm = machine.work_zero_mm;
        from_mm[Axis::X] = from_x_mm;
        let segment = jog(&machine, Axis::X, from_mm, by_mm, None)?;
        assert_eq!(segment.to_mm[Axis::Y], machine.work_zero_mm[Axis::Y]);
        Ok(segment.to_mm[Axis::X])
    }

    #[test]
    fn a_jog_stays_within_the_travel_or_comes_back_to_it() {
        assert_eq!(check(75.0, 75.0), Ok(150.0));
        assert_eq!(check(75.0, -75.0), Ok(0.0));
        assert_eq!(check(-2.0, 1.0), Ok(-1.0));
        assert_eq!(check(151.0, -0.5), Ok(150.5));
        for (from, by) in [(75.0, 75.01), (75.0, -75.01), (-2.0, -0.5), (151.0, 0.01)] {
            assert!(matches!(check(from, by), Err(JogError::Travel { .. })), "{from} {by}");
        }
        assert!(matches!(check(75.0, 0.004), Err(JogError::NoStep { .. })));
        let ideal = Machine::load("router").unwrap();
        let none = jog(&ideal, Axis::A, Point::ZERO, 1.0, None);
        assert_eq!(none, Err(JogError::NoAxis(Axis::A)));
    }
}
