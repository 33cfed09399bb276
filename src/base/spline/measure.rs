//! How long a curve is: Gauss's quadrature of its speed, over spans halved until it is exact.

use super::Bezier;

/// The length of a span is found within this, and what rounding makes of its positions.
pub const SPAN_ERROR_MM: f64 = 1e-9;

/// What rounding makes of a length, as a share of the greatest position: without it spans far from
/// zero would be halved for ever.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// Halvings of a piece at most: what is left is shorter than rounding.
const HALVINGS_MAX: u32 = 40;

/// Nodes on one side of the middle and weights of Gauss's quadrature with six nodes, from -1 to 1:
/// exact for polynomials up to degree 11 (Abramowitz and Stegun, table 25.4).
const NODES: [(f64, f64); 3] = [
    (0.238_619_186_083_196_9, 0.467_913_934_572_691),
    (0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
    (0.932_469_514_203_152, 0.171_324_492_379_170_3),
];

impl Bezier {
    /// Length, each span within [`SPAN_ERROR_MM`].
    pub fn length_mm(&self) -> f64 {
        let mut length_mm = 0.0;
        self.spans(&|_, _| true, &mut |span| length_mm += span[2]);
        length_mm
    }

    /// Cuts the curve into spans that [`Bezier::way_mm`] measures exactly and that are fine enough
    /// for the caller, and gives these in order: parameters of both ends, and the length.
    pub fn spans(&self, is_fine: &dyn Fn(f64, f64) -> bool, give: &mut dyn FnMut([f64; 3])) {
        let greatest = self.hull().flatten().fold(0.0, |greatest: f64, at| greatest.max(at.abs()));
        let error_mm = SPAN_ERROR_MM + ROUNDING * greatest;
        let is_fine = |from: f64, to: f64, off_mm: f64| off_mm <= error_mm && is_fine(from, to);
        self.cut([0.0, 1.0, self.way_mm(0.0, 1.0)], HALVINGS_MAX, &is_fine, give);
    }

    fn cut(
        &self,
        [from, to, way_mm]: [f64; 3],
        left: u32,
        is_fine: &dyn Fn(f64, f64, f64) -> bool,
        give: &mut dyn FnMut([f64; 3]),
    ) {
        let middle = 0.5 * (from + to);
        let ways = [self.way_mm(from, middle), self.way_mm(middle, to)];
        let halves = [[from, middle, ways[0]], [middle, to, ways[1]]];
        let is_done = left == 0 || is_fine(from, to, (ways[0] + ways[1] - way_mm).abs());
        for half in halves {
            if is_done {
                give(half);
            } else {
                self.cut(half, left - 1, is_fine, give);
            }
        }
    }

    /// Way along the curve between two parameters that lie within one span.
    pub fn way_mm(&self, from: f64, to: f64) -> f64 {
        let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
        let speed = |u: f64| self.jet(u).first.iter().map(|d| d * d).sum::<f64>().sqrt();
        let sum = NODES
            .map(|(at, weight)| weight * (speed(middle - half * at) + speed(middle + half * at)));
        half * sum.into_iter().sum::<f64>()
    }
}
