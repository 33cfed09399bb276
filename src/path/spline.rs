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

use std::collections::VecDeque;

use super::AxisRate;
use crate::base::spline::Bezier;
use crate::base::{Axis, AxisMap, Spline};

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
    /// Greatest |d²x/ds²| of X, Y and Z.
    bends_per_mm: Vector,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Span {
    piece: usize,
    /// Parameters of its ends.
    from: f64,
    to: f64,
    /// Length of the curve up to its start, and of itself.
    start_mm: f64,
    length_mm: f64,
    /// Directions at both ends.
    tangents: [Vector; 2],
    /// How much the curve has turned at once, at corners and cusps, up to its start and its end.
    corners: [f64; 2],
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
                    let corners = corners(spans.last(), &tangents);
                    spans.push(Span { piece, from, to, start_mm, length_mm, tangents, corners });
                    start_mm += length_mm;
                }
            });
        }
        let bends_per_mm = bends_per_mm(&pieces, &spans);
        (start_mm > 0.0).then_some(MeasuredSpline {
            pieces,
            spans,
            length_mm: start_mm,
            bends_per_mm,
        })
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

    /// How X, Y and Z move at most while the path advances at one mm/s.
    pub fn axis_rates(&self) -> AxisMap<AxisRate> {
        let mut rates = AxisMap::default();
        for (i, axis) in Axis::LINEAR.into_iter().enumerate() {
            let tangents = self.spans.iter().flat_map(|span| span.tangents);
            let greatest = tangents.map(|tangent| tangent[i].abs()).fold(0.0, f64::max);
            if greatest > 0.0 {
                let speed = (greatest + BETWEEN_ENDS).min(1.0);
                rates[axis] = AxisRate { speed, speed_amplitude: speed, bend_per_mm: 0.0 };
            }
        }
        rates
    }

    /// By how much the rates of X, Y and Z change at most within a way along the curve: what
    /// directions at the ends of spans tell, or less where the greatest bend, of three places a
    /// span, and all corners on the way come to less.
    pub fn turn_within(&self, way_mm: f64) -> [f64; 3] {
        let mut greatest = [0.0_f64; 3];
        let mut ranges: [Range; 3] = Default::default();
        let mut end = 0;
        for (start, span) in self.spans.iter().enumerate() {
            // A way that begins in this span ends before this.
            let end_mm = span.start_mm + span.length_mm + way_mm;
            while self.spans.get(end).is_some_and(|last| end == start || last.start_mm < end_mm) {
                for tangent in self.spans[end].tangents {
                    (0..3).for_each(|i| ranges[i].add(end, tangent[i]));
                }
                end += 1;
            }
            let corners = self.spans[end - 1].corners[1] - span.corners[0];
            for i in 0..3 {
                let bent = self.bends_per_mm[i] * way_mm + corners;
                greatest[i] = greatest[i].max(ranges[i].width(start).min(bent));
            }
        }
        greatest
    }
}

/// Greatest and least of the values of a moving window.
#[derive(Debug, Default)]
struct Range {
    /// Places and values, each greater (less) than all that follow.
    greatest: VecDeque<(usize, f64)>,
    least: VecDeque<(usize, f64)>,
}

impl Range {
    fn add(&mut self, place: usize, value: f64) {
        while self.greatest.back().is_some_and(|last| last.1 <= value) {
            self.greatest.pop_back();
        }
        while self.least.back().is_some_and(|last| last.1 >= value) {
            self.least.pop_back();
        }
        self.greatest.push_back((place, value));
        self.least.push_back((place, value));
    }

    /// Greatest less least, of the values from a place on.
    fn width(&mut self, first: usize) -> f64 {
        for values in [&mut self.greatest, &mut self.least] {
            while values.front().is_some_and(|value| value.0 < first) {
                values.pop_front();
            }
        }
        let front = |values: &VecDeque<(usize, f64)>| values.front().map_or(0.0, |value| value.1);
        front(&self.greatest) - front(&self.least)
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

/// How much the curve has turned at once up to both ends of a span that follows another. A span
/// that turns by more than a span should holds a cusp.
fn corners(before: Option<&Span>, tangents: &[Vector; 2]) -> [f64; 2] {
    let start = before.map_or(0.0, |before| {
        before.corners[1] + length(difference(tangents[0], before.tangents[1]))
    });
    let within = length(difference(tangents[1], tangents[0]));
    [start, start + if within > SPAN_TURN { within } else { 0.0 }]
}

/// The greatest bend of each axis.
fn bends_per_mm(pieces: &[Bezier], spans: &[Span]) -> Vector {
    let mut greatest = [0.0_f64; 3];
    for span in spans {
        for share in [0.0, 0.5, 1.0] {
            let bend = bend(&pieces[span.piece], span.from + (span.to - span.from) * share);
            greatest = std::array::from_fn(|i| greatest[i].max(bend[i].abs()));
        }
    }
    greatest
}

/// How the direction changes along the curve, a mm: the part of the second derivative across it,
/// by the square of the first.
fn bend(curve: &Bezier, u: f64) -> Vector {
    let jet = curve.jet(u);
    let speed_sq: f64 = jet.first.iter().map(|d| d * d).sum();
    let along: f64 = (0..3).map(|i| jet.first[i] * jet.second[i]).sum::<f64>() / speed_sq;
    let bend: Vector = std::array::from_fn(|i| (jet.second[i] - along * jet.first[i]) / speed_sq);
    // Of a curve that stands still it is no number: without bounds, then.
    bend.map(|part| if part.is_finite() { part } else { f64::INFINITY })
}
