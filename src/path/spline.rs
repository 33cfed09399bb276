//! A spline by its length: where it is after so many mm, and how sharply it turns.
//!
//! ```text
//! parameter u ┤        ___·      Spans are so short that quadrature finds their length, and that
//!             │    _·'           the direction hardly turns in one. Within a span Newton's method
//!             │  ·'              finds the parameter of a length, held between the span's ends.
//!           0 ┼·────────────── s
//! ```
//!
//! Lengths are within [`SPAN_ERROR_MM`] a span, places within [`PLACE_ERROR_MM`] of the length.
//! Where a curve stands still by its parameter (points that coincide, cusps) its direction is that
//! of the span.
//!
//! [`SPAN_ERROR_MM`]: crate::base::spline::SPAN_ERROR_MM

use crate::base::Spline;
use crate::base::spline::Bezier;

/// The place at a length is found within this along the curve.
pub const PLACE_ERROR_MM: f64 = 1e-9;

/// The direction turns by less in a span; as a difference of unit vectors.
const SPAN_TURN: f64 = 0.02;

/// A span may be this short whatever the turn: at a cusp no span is short enough.
const SPAN_LEAST_MM: f64 = 1e-6;

/// What the sine of a direction may exceed those at both ends of its span by: d²/8.
const BETWEEN_ENDS: f64 = SPAN_TURN * SPAN_TURN / 8.0;

/// A direction, or a rate of X, Y and Z.
type Vector = [f64; 3];

/// A spline measured along its length.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredSpline {
    pieces: Vec<Bezier>,
    spans: Vec<Span>,
    length_mm: f64,
}

/// A stretch of a spline that hardly turns. Where the direction at its start is not that at the end
/// of the one before, there is a corner or a cusp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    piece: usize,
    /// Parameters of its ends.
    from: f64,
    to: f64,
    /// Length of the curve up to its start.
    pub start_mm: f64,
    /// Its own length.
    pub length_mm: f64,
    /// Directions at both ends: dx/ds of X, Y and Z.
    pub tangents: [Vector; 2],
    /// By how much the size of dx/ds exceeds the even change from one end to the other, at most, as
    /// far as three places between them tell.
    pub bulges: Vector,
    /// How the direction changes along it, a mm, at the sharpest of three places: d²x/ds².
    pub bends_per_mm: Vector,
}

impl MeasuredSpline {
    /// Measures a spline; none if it goes nowhere.
    pub fn new(spline: &Spline) -> Option<MeasuredSpline> {
        let pieces = spline.pieces();
        let (mut spans, mut start_mm): (Vec<Span>, f64) = (Vec::new(), 0.0);
        for (piece, curve) in pieces.iter().enumerate() {
            let is_fine = |from, to| is_fine(curve, from, to);
            curve.spans(&is_fine, &mut |[from, to, length_mm]| {
                if length_mm > 0.0 {
                    let tangent = tangents(curve, from, to);
                    let tangents = [tangent(from), tangent(to)];
                    let bends_per_mm = bends_per_mm(curve, [from, to], length_mm, &tangents);
                    let bulges = bulges(curve, [from, to], &tangents, tangent);
                    let ends = Span {
                        piece,
                        from,
                        to,
                        start_mm,
                        length_mm,
                        tangents,
                        bulges,
                        bends_per_mm,
                    };
                    spans.push(ends);
                    start_mm += length_mm;
                }
            });
        }
        (start_mm > 0.0).then_some(MeasuredSpline { pieces, spans, length_mm: start_mm })
    }

    /// Length of the curve.
    pub fn length_mm(&self) -> f64 {
        self.length_mm
    }

    /// The curve's pieces, in order.
    pub fn pieces(&self) -> &[Bezier] {
        &self.pieces
    }

    /// X, Y and Z after a length from the start.
    pub fn point_at(&self, along_mm: f64) -> [f64; 3] {
        let next = self.spans.partition_point(|span| span.start_mm <= along_mm);
        let span = &self.spans[next.saturating_sub(1)];
        let curve = &self.pieces[span.piece];
        let rest_mm = (along_mm - span.start_mm).clamp(0.0, span.length_mm);
        let (mut low, mut high) = (span.from, span.to);
        let mut u = low + (high - low) * rest_mm / span.length_mm;
        // Halving alone would be done in 50 rounds.
        for _ in 0..50 {
            let off_mm = curve.way_mm(span.from, u) - rest_mm;
            if off_mm.abs() <= PLACE_ERROR_MM {
                break;
            }
            *if off_mm > 0.0 { &mut high } else { &mut low } = u;
            let first = curve.jet(u).first;
            let next = u - off_mm / length(first);
            u = if next > low && next < high { next } else { 0.5 * (low + high) };
        }
        curve.at(u)
    }

    /// Its spans, in order.
    pub fn spans(&self) -> &[Span] {
        &self.spans
    }

    /// How fast X, Y and Z move at most while the path advances at one mm/s.
    pub fn axis_speeds(&self) -> Vector {
        std::array::from_fn(|i| {
            let tangents = self.spans.iter().flat_map(|span| span.tangents);
            let greatest = tangents.map(|tangent| tangent[i].abs()).fold(0.0, f64::max);
            if greatest > 0.0 { (greatest + BETWEEN_ENDS).min(1.0) } else { 0.0 }
        })
    }
}

fn length(v: Vector) -> f64 {
    v.iter().map(|part| part * part).sum::<f64>().sqrt()
}

fn difference(to: Vector, from: Vector) -> Vector {
    std::array::from_fn(|i| to[i] - from[i])
}

/// Whether the direction turns so little between two parameters that the ends tell it.
fn is_fine(curve: &Bezier, from: f64, to: f64) -> bool {
    let middle = 0.5 * (from + to);
    if curve.way_mm(from, to) <= SPAN_LEAST_MM {
        return true;
    }
    let tangent = tangents(curve, from, to);
    let places = [from, 0.75 * from + 0.25 * to, middle, 0.25 * from + 0.75 * to, to];
    places
        .map(tangent)
        .windows(2)
        .all(|pair| length(difference(pair[1], pair[0])) <= SPAN_TURN / 2.0)
}

/// The direction at parameters within a span.
fn tangents(curve: &Bezier, from: f64, to: f64) -> impl Fn(f64) -> Vector {
    let chord = difference(curve.at(to), curve.at(from));
    let chord_mm = length(chord);
    move |u| {
        let first = curve.jet(u).first;
        let (way, norm) = match length(first) {
            // Where the curve stands still, its first derivative is what rounding leaves.
            speed if speed * (to - from) < 1e-3 * chord_mm => (chord, chord_mm),
            speed => (first, speed),
        };
        if norm > 0.0 { way.map(|part| part / norm) } else { [0.0; 3] }
    }
}

/// See [`Span::bulges`].
fn bulges(
    curve: &Bezier,
    [from, to]: [f64; 2],
    ends: &[Vector; 2],
    tangent: impl Fn(f64) -> Vector,
) -> Vector {
    let length_mm = curve.way_mm(from, to);
    let mut bulges = [0.0_f64; 3];
    for share in [0.25, 0.5, 0.75] {
        let u = from + (to - from) * share;
        let (along, here) = (curve.way_mm(from, u) / length_mm, tangent(u));
        for i in 0..3 {
            let even = ends[0][i].abs() + (ends[1][i].abs() - ends[0][i].abs()) * along;
            // No number where the span has no length.
            bulges[i] = bulges[i].max(here[i].abs() - even);
        }
    }
    bulges
}

/// The greatest bend of each axis at three places of a span; what its ends tell, where the curve
/// stands still by its parameter.
fn bends_per_mm(
    curve: &Bezier,
    [from, to]: [f64; 2],
    length_mm: f64,
    tangents: &[Vector; 2],
) -> Vector {
    let mean = difference(tangents[1], tangents[0]).map(|part| part / length_mm);
    let mut bends = mean;
    for share in [0.0, 0.5, 1.0] {
        let here = bend(curve, from + (to - from) * share);
        for i in 0..3 {
            if here[i].is_finite() && here[i].abs() > bends[i].abs() {
                bends[i] = here[i];
            }
        }
    }
    bends
}

/// How the direction changes along the curve, a mm: the part of the second derivative across it,
/// by the square of the first. No number where the curve stands still.
fn bend(curve: &Bezier, u: f64) -> Vector {
    let jet = curve.jet(u);
    let speed_sq: f64 = jet.first.iter().map(|d| d * d).sum();
    let along: f64 = (0..3).map(|i| jet.first[i] * jet.second[i]).sum::<f64>() / speed_sq;
    std::array::from_fn(|i| (jet.second[i] - along * jet.first[i]) / speed_sq)
}
