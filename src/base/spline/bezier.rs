//! Rational Bézier pieces: points, derivatives, halves, extremes.

use super::DEGREE_MAX;

/// Extremes are found within this.
const EXTREME_MM: f64 = 1e-9;

/// A rational Bézier curve from 0 to 1: control points times their weights, and the weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bezier {
    degree: usize,
    points: [[f64; 4]; DEGREE_MAX + 1],
}

/// A curve's place and how it goes on from there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jet {
    /// The place.
    pub at: [f64; 3],
    /// First derivative by the parameter.
    pub first: [f64; 3],
    /// Second derivative by the parameter.
    pub second: [f64; 3],
}

/// From one point to another by a share of the way.
pub(super) fn between(from: &[f64; 4], to: &[f64; 4], share: f64) -> [f64; 4] {
    std::array::from_fn(|i| from[i] + (to[i] - from[i]) * share)
}

/// The place of a point that is given times its weight.
fn place(point: &[f64; 4]) -> [f64; 3] {
    [point[0] / point[3], point[1] / point[3], point[2] / point[3]]
}

impl Bezier {
    pub(super) fn new(degree: usize, points: [[f64; 4]; DEGREE_MAX + 1]) -> Bezier {
        Bezier { degree, points }
    }

    /// The control points, in X, Y and Z: the curve lies within their convex hull.
    pub fn hull(&self) -> impl DoubleEndedIterator<Item = [f64; 3]> + '_ {
        self.points[..=self.degree].iter().map(place)
    }

    /// Where it begins.
    pub fn start(&self) -> [f64; 3] {
        place(&self.points[0])
    }

    /// Where it ends.
    pub fn end(&self) -> [f64; 3] {
        place(&self.points[self.degree])
    }

    /// The place at a parameter from 0 to 1, by de Casteljau's construction.
    pub fn at(&self, u: f64) -> [f64; 3] {
        let mut row = self.points;
        for level in (1..=self.degree).rev() {
            for i in 0..level {
                row[i] = between(&row[i], &row[i + 1], u);
            }
        }
        place(&row[0])
    }

    /// Place and derivatives at a parameter from 0 to 1. The last levels of the construction are
    /// differences of the numerator; what its weight does is taken off (The NURBS Book, eq. 4.8).
    pub fn jet(&self, u: f64) -> Jet {
        let degree = self.degree;
        let mut row = self.points;
        let mut level = degree;
        while level > 2 {
            for i in 0..level {
                row[i] = between(&row[i], &row[i + 1], u);
            }
            level -= 1;
        }
        let n = degree as f64;
        let mut second = [0.0; 4];
        if level == 2 {
            second =
                std::array::from_fn(|i| n * (n - 1.0) * (row[0][i] - 2.0 * row[1][i] + row[2][i]));
            row[0] = between(&row[0], &row[1], u);
            row[1] = between(&row[1], &row[2], u);
        }
        let first: [f64; 4] = std::array::from_fn(|i| n * (row[1][i] - row[0][i]));
        let last = between(&row[0], &row[1], u);
        let (weight, at) = (last[3], place(&last));
        let first_at: [f64; 3] = std::array::from_fn(|i| (first[i] - first[3] * at[i]) / weight);
        let second_at = std::array::from_fn(|i| {
            (second[i] - 2.0 * first[3] * first_at[i] - second[3] * at[i]) / weight
        });
        Jet { at, first: first_at, second: second_at }
    }

    /// Both halves, by de Casteljau's construction.
    pub fn halves(&self) -> [Bezier; 2] {
        let (mut low, mut high) = (*self, *self);
        for level in 1..=self.degree {
            for i in 0..=self.degree - level {
                high.points[i] = between(&high.points[i], &high.points[i + 1], 0.5);
            }
            low.points[level] = high.points[0];
        }
        [low, high]
    }

    /// Widens bounds by what the curve reaches. Halves whose hull reaches no further are left out.
    pub(super) fn widen(&self, bounds: &mut [[f64; 2]; 3]) {
        let mut open = vec![*self];
        while let Some(piece) = open.pop() {
            for end in [piece.start(), piece.end()] {
                for (bound, at) in bounds.iter_mut().zip(end) {
                    *bound = [bound[0].min(at), bound[1].max(at)];
                }
            }
            let is_beyond = |point: [f64; 3]| {
                bounds.iter().zip(point).any(|([least, greatest], at)| {
                    let rounding = EXTREME_MM + at.abs() * 4.0 * f64::EPSILON;
                    at < least - rounding || at > greatest + rounding
                })
            };
            if piece.hull().any(is_beyond) {
                open.extend(piece.halves());
            }
        }
    }
}
