//! Splines: B-splines with weights (NURBS), of which a Bézier curve is the simplest.
//!
//! ```text
//!  points    P0 ──── P1 ─ ─ ─ ─ P2 ──── P3 …         the curve is drawn to its points,
//!  weights   w0      w1         w2      w3           the more so the heavier they are
//!  knots     0 0 0 0        0.5         1 1 1 1      where one piece ends and the next begins
//! ```
//!
//! A spline begins at its first point and ends at its last, for its first and last knots stand
//! there as often as its order, which is the degree and one. Between two knots it is a rational
//! polynomial: see [`Bezier`], into which it is cut exactly. Source: Piegl and Tiller, The NURBS
//! Book, chapters 2 to 5.

mod bezier;
mod measure;

pub use bezier::{Bezier, Jet};
pub use measure::SPAN_ERROR_MM;

use crate::base::{Axis, Point};

/// Greatest degree of a spline.
pub const DEGREE_MAX: usize = 9;

/// Greatest number of points of a spline.
pub const POINTS_MAX: usize = 10_000;

/// A spline in X, Y and Z; all other axes rest. What it is made of is right once it is made.
#[derive(Clone, Debug, PartialEq)]
pub struct Spline {
    degree: usize,
    points: Vec<Point>,
    weights: Vec<f64>,
    knots: Vec<f64>,
}

/// What numbers have to be for a spline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SplineError {
    /// The degree is 0, or greater than [`DEGREE_MAX`].
    #[error("the degree is from 1 to {DEGREE_MAX}")]
    Degree,
    /// There are fewer points than the degree and one, or more than [`POINTS_MAX`].
    #[error("the number of points is from the degree and one to {POINTS_MAX}")]
    Points,
    /// There is not one weight above zero for each point.
    #[error("each point has a weight above zero")]
    Weights,
    /// There are not as many knots as points, the degree and one together.
    #[error("there are as many knots as points, the degree and one together")]
    KnotCount,
    /// A knot is less than the one before.
    #[error("no knot is less than the one before")]
    KnotOrder,
    /// The first or the last knots are not equal, so that the curve begins or ends elsewhere.
    #[error("the first knots are equal, and so are the last, one more than the degree each")]
    KnotEnds,
    /// A knot between stands more often than the degree: the curve would be torn there.
    #[error("a knot between the ends stands at most as often as the degree")]
    KnotRepeated,
}

impl Spline {
    /// A Bézier curve.
    ///
    /// # Errors
    /// When the points are too few or too many for one.
    pub fn bezier(points: Vec<Point>) -> Result<Spline, SplineError> {
        let order = points.len();
        let knots = [0.0, 1.0].into_iter().flat_map(|end| std::iter::repeat_n(end, order));
        let knots = knots.collect();
        let weights = vec![1.0; order];
        Spline::new(order.saturating_sub(1), points, weights, knots)
    }

    /// A spline of some degree.
    ///
    /// # Errors
    /// When the numbers make none.
    pub fn new(
        degree: usize,
        points: Vec<Point>,
        weights: Vec<f64>,
        knots: Vec<f64>,
    ) -> Result<Spline, SplineError> {
        let order = degree + 1;
        let ends = |ends: &[f64]| ends.iter().all(|knot| *knot == ends[0]);
        let is_light = |weight: &f64| !(*weight > 0.0 && weight.is_finite());
        let falls = |pair: &[f64]| !(pair[0] <= pair[1] && pair[1].is_finite());
        let error = if !(1..=DEGREE_MAX).contains(&degree) {
            SplineError::Degree
        } else if !(order..=POINTS_MAX).contains(&points.len()) {
            SplineError::Points
        } else if weights.len() != points.len() || weights.iter().any(is_light) {
            SplineError::Weights
        } else if knots.len() != points.len() + order {
            SplineError::KnotCount
        } else if knots.windows(2).any(falls) {
            SplineError::KnotOrder
        } else if !ends(&knots[..order]) || !ends(&knots[knots.len() - order..]) {
            SplineError::KnotEnds
        } else if knots[1..knots.len() - 1].windows(order).any(ends) {
            SplineError::KnotRepeated
        } else {
            return Ok(Spline { degree, points, weights, knots });
        };
        Err(error)
    }

    /// The degree: 3 of a cubic.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// The control points, mm; the first and the last are the ends.
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// A weight for each point.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// The knots: as many as points, the degree and one together.
    pub fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// Whether its points say it all: it is one piece, and all weights are 1.
    pub fn is_bezier(&self) -> bool {
        self.points.len() == self.degree + 1 && self.weights.iter().all(|weight| *weight == 1.0)
    }

    /// The pieces between the knots, exactly.
    pub fn pieces(&self) -> Vec<Bezier> {
        let spans = self.degree..self.points.len();
        spans.filter(|at| self.knots[*at] < self.knots[at + 1]).map(|at| self.piece(at)).collect()
    }

    /// The piece from one knot to the next. Its points are the values of the polar form of the
    /// curve at both knots (The NURBS Book, section 5.3; Ramshaw's blossoms).
    fn piece(&self, at: usize) -> Bezier {
        let (degree, knots) = (self.degree, &self.knots);
        let (from, to) = (knots[at], knots[at + 1]);
        let first = at - degree;
        let mut points = [[0.0; 4]; DEGREE_MAX + 1];
        for (j, point) in points.iter_mut().enumerate().take(degree + 1) {
            let mut row = [[0.0; 4]; DEGREE_MAX + 1];
            for (i, place) in row.iter_mut().enumerate().take(degree + 1) {
                *place = self.weighted(first + i);
            }
            for level in 1..=degree {
                let value = if level > degree - j { to } else { from };
                for i in (level..=degree).rev() {
                    let (low, high) = (knots[first + i], knots[first + i + degree + 1 - level]);
                    let share = (value - low) / (high - low);
                    row[i] = bezier::between(&row[i - 1], &row[i], share);
                }
            }
            *point = row[degree];
        }
        Bezier::new(degree, points)
    }

    /// A point times its weight, and the weight.
    fn weighted(&self, index: usize) -> [f64; 4] {
        let (point, weight) = (&self.points[index], self.weights[index]);
        let [x, y, z] = Axis::LINEAR.map(|axis| point[axis] * weight);
        [x, y, z, weight]
    }

    /// Length of the curve, each span of it within [`SPAN_ERROR_MM`].
    pub fn length_mm(&self) -> f64 {
        self.pieces().iter().map(Bezier::length_mm).sum()
    }

    /// Least and greatest position of X, Y and Z on the curve itself, within 1e-9 mm.
    pub fn bounds_mm(&self) -> [[f64; 2]; 3] {
        let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
        for piece in self.pieces() {
            piece.widen(&mut bounds);
        }
        bounds
    }
}
