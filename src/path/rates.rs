//! How position changes along a segment: the derivatives by the length that feed applies to.

use crate::base::axis::AXES;
use crate::base::{Axis, AxisMap, Point};

use super::spline::Span;
use super::{Arc, Curve, Segment};

/// Derivatives of the position by the length along the path, in machine coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Rates {
    /// dx/ds: speed of each axis for each mm/s along the path.
    pub tangent: Point,
    /// d²x/ds²: acceleration of each axis for each (mm/s)² along the path, in 1/mm.
    pub bend_per_mm: Point,
}

/// [`Rates`] that lie elsewhere.
#[derive(Clone, Copy, Debug)]
pub struct RatesRef<'a> {
    /// See [`Rates`].
    pub tangent: &'a Point,
    /// See [`Rates`].
    pub bend_per_mm: &'a Point,
}

impl Segment {
    /// The derivatives after a share of the way, from 0 to 1; zero on a segment without length. On a
    /// spline those at the end of the span that the place lies in.
    pub fn rates_at(&self, share: f64) -> Rates {
        let mut rates = Rates::default();
        let length_mm = self.length_mm();
        if length_mm <= 0.0 {
            return rates;
        }
        for i in 0..AXES {
            rates.tangent.0[i] = (self.to_mm.0[i] - self.from_mm.0[i]) / length_mm;
        }
        match &self.curve {
            Curve::Line => {}
            Curve::Arc(arc) => {
                let [speed, bend] = arc.derivatives(share);
                for (i, axis) in arc.plane.axes().into_iter().enumerate() {
                    rates.tangent[axis] = speed[i] / length_mm;
                    rates.bend_per_mm[axis] = bend[i] / (length_mm * length_mm);
                }
            }
            Curve::Spline(spline) => {
                let spans = spline.spans();
                let after = spans.partition_point(|span| span.start_mm < share * length_mm);
                if let Some(span) = spans.get(after.saturating_sub(1)) {
                    rates.follow(span, if share > 0.0 { 1 } else { 0 });
                }
            }
        }
        rates
    }
}

impl Segment {
    /// Tells the first derivatives at the end of a segment of this length, which is not zero.
    #[inline]
    pub fn tangent_at_end(&self, length_mm: f64, tangent: &mut Point) {
        match &self.curve {
            Curve::Line => {
                let per_mm = 1.0 / length_mm;
                for i in 0..AXES {
                    tangent.0[i] = (self.to_mm.0[i] - self.from_mm.0[i]) * per_mm;
                }
            }
            Curve::Arc(_) | Curve::Spline(_) => *tangent = self.rates_at(1.0).tangent,
        }
    }
}

impl Rates {
    /// The same, where they lie.
    pub fn by_ref(&self) -> RatesRef<'_> {
        RatesRef { tangent: &self.tangent, bend_per_mm: &self.bend_per_mm }
    }

    /// Part of the way to others.
    pub fn toward(&self, end: &Rates, share: f64) -> Rates {
        let between = |from: &Point, to: &Point| {
            AxisMap::from_fn(|axis| from[axis] + (to[axis] - from[axis]) * share)
        };
        Rates {
            tangent: between(&self.tangent, &end.tangent),
            bend_per_mm: between(&self.bend_per_mm, &end.bend_per_mm),
        }
    }

    /// X, Y and Z go as a span of a spline does at its start (0) or end (1).
    pub(crate) fn follow(&mut self, span: &Span, end: usize) {
        for (i, axis) in Axis::LINEAR.into_iter().enumerate() {
            self.tangent[axis] = span.tangents[end][i];
            self.bend_per_mm[axis] = span.bends_per_mm[i];
        }
    }
}

impl Arc {
    /// First and second derivative of the position in the plane by the share of the sweep u, of
    /// r(u)·(cos θ(u), sin θ(u)) with r and θ linear in u:
    ///
    /// ```text
    /// x'  = r'·cos θ - r·θ'·sin θ        x'' = -2·r'·θ'·sin θ - r·θ'²·cos θ
    /// y'  = r'·sin θ + r·θ'·cos θ        y'' =  2·r'·θ'·cos θ - r·θ'²·sin θ
    /// ```
    fn derivatives(&self, share: f64) -> [[f64; 2]; 2] {
        let (inward, turn) = (self.radius_to_mm - self.radius_from_mm, self.sweep_rad);
        let radius = self.radius_from_mm + inward * share;
        let (sin, cos) = libm::sincos(self.angle_from_rad + turn * share);
        let speed = [inward * cos - radius * turn * sin, inward * sin + radius * turn * cos];
        let (coriolis, toward) = (2.0 * inward * turn, radius * turn * turn);
        [speed, [-coriolis * sin - toward * cos, coriolis * cos - toward * sin]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Plane;
    use crate::interp::Corner;
    use proptest::prelude::*;

    proptest! {
        /// The derivatives are what differences of positions come to.
        #[test]
        fn derivatives_are_limits_of_differences(
            radius_from_mm in 1.0..50.0_f64, by_mm in -0.5..0.5_f64, sweep_rad in -9.0..9.0_f64,
            angle_from_rad in -4.0..4.0_f64, rise_mm in -5.0..5.0_f64, share in 0.1..0.9_f64,
        ) {
            prop_assume!(sweep_rad.abs() > 0.1);
            let arc = Arc {
                plane: Plane::Zx,
                center_mm: [3.0, -2.0],
                radius_from_mm,
                radius_to_mm: radius_from_mm + by_mm,
                angle_from_rad,
                sweep_rad,
            };
            let ends = [0.0, 1.0].map(|share| {
                let mut point = Point::ZERO;
                [point[Axis::Z], point[Axis::X]] = arc.point_at(share);
                point[Axis::Y] = rise_mm * share;
                point
            });
            let segment = Segment {
                line: 1,
                feed_mm_s: None,
                from_mm: ends[0],
                to_mm: ends[1],
                curve: Curve::Arc(arc),
                corner: Corner::Exact,
            };
            let (rates, length_mm, step) = (segment.rates_at(share), segment.length_mm(), 1e-4);
            let at = |k: f64| segment.point_at(share + k * step);
            for axis in Axis::LINEAR {
                let way_mm = step * length_mm;
                let tangent = (at(1.0)[axis] - at(-1.0)[axis]) / (2.0 * way_mm);
                prop_assert!((rates.tangent[axis] - tangent).abs() < 1e-6);
                let bend = (at(1.0)[axis] - 2.0 * at(0.0)[axis] + at(-1.0)[axis]) / way_mm.powi(2);
                prop_assert!((rates.bend_per_mm[axis] - bend).abs() < 1e-4, "{bend}");
            }
        }
    }
}
