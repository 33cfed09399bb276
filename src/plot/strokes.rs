//! Where a tool goes and how fast → at most so many straight pieces, however long the way.
//!
//! Places are kept as they are until there are too many. Then pieces that follow each other become one as
//! far as it stays within a distance of the places between, and those that lie on others of the same
//! speed, or are shorter than that distance, fall away; it grows by a fifth until what is left are few enough.
//! What is left still ends on the way itself, and the extents stay exact.

use std::collections::{BTreeSet, HashSet};

/// Pieces kept at most.
const PIECES_MAX: usize = 7_000;
/// Places for new pieces once there were too many.
const ROOM: usize = PIECES_MAX / 4;
/// The first grid, as a share of the greatest extent: less than half a dot of a drawing.
const FIRST_GRID: f64 = 1.0 / 2048.0;
/// By how much the grid grows: more at once would leave out what there is room for.
const GROWTH: f64 = 1.2;
/// Lines that keep pieces of their own, unless these are too short to be seen.
const LINES_MAX: usize = 1_000;
/// Places that a piece may pass: each is looked at when it grows.
const PASSED_MAX: usize = 64;
/// Bands of speed in each doubling.
const BANDS_A_DOUBLING: f64 = 3.0;
/// Two pieces whose directions differ by a sine below this are one.
const STRAIGHT: f64 = 1e-6;
/// A place this far beyond the travel is still in it.
const TRAVEL_MM: f64 = 1e-6;

/// A place in X, Y and Z, in mm.
pub type Place = [f64; 3];

/// A straight part of a tool's way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// NC line that it belongs to, from 1.
    pub line: u32,
    /// Where it begins.
    pub from_mm: Place,
    /// Where it ends.
    pub to_mm: Place,
    /// Speed of a cut; none: a rapid.
    pub speed_mm_s: Option<f64>,
}

/// Something at one place.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// Where it is.
    pub at_mm: Place,
    /// What is told of it.
    pub text: String,
}

/// A tool's way.
#[derive(Debug)]
pub struct Strokes {
    pieces: Vec<Piece>,
    /// Zero: places are as they came.
    grid_mm: f64,
    seen: HashSet<Key>,
    /// Whether pieces have so many lines that nobody could point at each.
    has_many_lines: bool,
    /// Places that the last piece passes within the grid, and does not end at.
    passed_mm: Vec<Place>,
    extents_mm: [[f64; 2]; 3],
    travel_mm: [Option<[f64; 2]>; 3],
    /// Where the way leaves the travel first, and in which NC line.
    outside: Option<(Place, u32)>,
}

/// A straight piece, whose speed is known by its band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// NC lines that it belongs to: the first and the last.
    pub lines: [u32; 2],
    /// Where it begins.
    pub from_mm: Place,
    /// Where it ends.
    pub to_mm: Place,
    /// Band of the speed of a cut; none: a rapid.
    pub band: Option<i16>,
}

/// A piece on the grid.
type Key = ([i64; 3], [i64; 3], Option<i16>);

/// The speed in the middle of a band.
pub fn speed_of_mm_s(band: f64) -> f64 {
    libm::exp2((band + 0.5) / BANDS_A_DOUBLING)
}

fn band_of(speed_mm_s: f64) -> i16 {
    (libm::log2(speed_mm_s.max(1e-3)) * BANDS_A_DOUBLING).floor() as i16
}

impl Strokes {
    /// On a machine with this travel in X, Y and Z.
    pub fn new(travel_mm: [Option<[f64; 2]>; 3]) -> Strokes {
        Strokes {
            pieces: Vec::new(),
            grid_mm: 0.0,
            seen: HashSet::new(),
            has_many_lines: false,
            passed_mm: Vec::new(),
            extents_mm: [[f64::INFINITY, f64::NEG_INFINITY]; 3],
            travel_mm,
            outside: None,
        }
    }

    /// Takes the next stroke.
    pub fn add(&mut self, stroke: &Stroke) {
        for place in [&stroke.from_mm, &stroke.to_mm] {
            for (extent, at) in self.extents_mm.iter_mut().zip(place) {
                *extent = [extent[0].min(*at), extent[1].max(*at)];
            }
        }
        if self.outside.is_none() && self.leaves_travel(&stroke.to_mm) {
            self.outside = Some((stroke.to_mm, stroke.line));
        }
        self.push(Piece {
            lines: [stroke.line; 2],
            from_mm: stroke.from_mm,
            to_mm: stroke.to_mm,
            band: stroke.speed_mm_s.map(band_of),
        });
        if self.pieces.len() > PIECES_MAX {
            self.thin();
        }
    }

    /// The pieces, in the order in which they were drawn first.
    pub fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// Least and greatest X, Y and Z; none where nothing was drawn.
    pub fn extents_mm(&self) -> Option<[[f64; 2]; 3]> {
        (self.extents_mm[0][0] <= self.extents_mm[0][1]).then_some(self.extents_mm)
    }

    /// Where the way leaves the travel first, and in which NC line.
    pub fn outside(&self) -> Option<(Place, u32)> {
        self.outside
    }

    /// NC lines that pieces belong to, if they are no more than so many.
    pub fn lines(&self, most: usize) -> Option<BTreeSet<u32>> {
        let mut lines = BTreeSet::new();
        let fits = self.pieces.iter().all(|piece| {
            lines.extend(piece.lines);
            lines.len() <= most
        });
        fits.then_some(lines)
    }

    fn leaves_travel(&self, place: &Place) -> bool {
        let beyond = |(at, travel): (&f64, &Option<[f64; 2]>)| {
            travel.is_some_and(|[low, high]| *at < low - TRAVEL_MM || *at > high + TRAVEL_MM)
        };
        place.iter().zip(&self.travel_mm).any(beyond)
    }

    fn push(&mut self, piece: Piece) {
        if piece.from_mm == piece.to_mm {
            return;
        }
        if let Some(last) = self.pieces.last_mut() {
            if last.goes_on_with(&piece) {
                last.to_mm = piece.to_mm;
                return;
            }
            let is_short = |piece: &Piece| apart_mm(piece.from_mm, piece.to_mm) <= self.grid_mm;
            let is_next = last.to_mm == piece.from_mm && self.passed_mm.len() < PASSED_MAX;
            let are_short = [is_short(last), is_short(&piece)];
            let is_same = last.band == piece.band && last.lines == piece.lines;
            let is_one = match self.has_many_lines {
                true => last.band == piece.band || are_short.contains(&true),
                false => is_same || are_short == [true; 2],
            };
            let is_rapid = [last.band, piece.band].map(|band| band.is_none());
            if is_next && is_one && is_rapid[0] == is_rapid[1] {
                self.passed_mm.push(piece.from_mm);
                let chord = (last.from_mm, piece.to_mm);
                if self.passed_mm.iter().all(|at| off_mm(*at, chord) <= self.grid_mm) {
                    let spans_mm = [&*last, &piece].map(|part| apart_mm(part.from_mm, part.to_mm));
                    last.lines =
                        [last.lines[0].min(piece.lines[0]), last.lines[1].max(piece.lines[1])];
                    last.band = if spans_mm[1] > spans_mm[0] { piece.band } else { last.band };
                    last.to_mm = piece.to_mm;
                    return;
                }
            }
            self.settle();
        }
        self.passed_mm.clear();
        self.pieces.push(piece);
    }

    /// Takes the last piece out, if it is too short to be seen or lies on another.
    fn settle(&mut self) {
        let Some(last) = self.pieces.last().filter(|_| self.grid_mm > 0.0) else { return };
        let key = self.key(last);
        let is_dot = key.0 == key.1 && apart_mm(last.from_mm, last.to_mm) <= self.grid_mm;
        if is_dot || !self.seen.insert(key) {
            self.pieces.pop();
        }
    }

    /// Widens the grid until there is room again.
    fn thin(&mut self) {
        let widest = self.extents_mm.iter().map(|[low, high]| high - low).fold(0.0, f64::max);
        while self.pieces.len() > PIECES_MAX - ROOM {
            self.grid_mm = (GROWTH * self.grid_mm).max(FIRST_GRID * widest);
            self.seen.clear();
            self.passed_mm.clear();
            let lines = self.pieces.chunk_by(|a, b| a.lines == b.lines);
            self.has_many_lines |= lines.count() > LINES_MAX;
            for piece in std::mem::take(&mut self.pieces) {
                self.push(piece);
            }
        }
    }

    /// The same for both directions.
    fn key(&self, piece: &Piece) -> Key {
        let cell = |place: Place| place.map(|at| (at / self.grid_mm).round() as i64);
        let (from, to) = (cell(piece.from_mm), cell(piece.to_mm));
        (from.min(to), from.max(to), piece.band)
    }
}

/// How far a place is from a straight piece.
fn off_mm(at: Place, (from, to): (Place, Place)) -> f64 {
    let way: Place = std::array::from_fn(|i| to[i] - from[i]);
    let dot = |a: Place, b: Place| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let square = dot(way, way);
    let offset: Place = std::array::from_fn(|i| at[i] - from[i]);
    let share = if square > 0.0 { (dot(offset, way) / square).clamp(0.0, 1.0) } else { 0.0 };
    apart_mm(at, std::array::from_fn(|i| from[i] + share * way[i]))
}

/// How far one place is from another.
fn apart_mm(a: Place, b: Place) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

impl Piece {
    /// Whether another piece goes on in the same direction as part of the same block.
    fn goes_on_with(&self, next: &Piece) -> bool {
        if self.to_mm != next.from_mm || self.band != next.band || self.lines != next.lines {
            return false;
        }
        let way =
            |piece: &Piece| -> Place { std::array::from_fn(|i| piece.to_mm[i] - piece.from_mm[i]) };
        let (a, b) = (way(self), way(next));
        let dot = |p: &Place, q: &Place| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
        let cross =
            [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
        let limit = STRAIGHT * STRAIGHT * dot(&a, &a) * dot(&b, &b);
        dot(&a, &b) > 0.0 && dot(&cross, &cross) <= limit
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stroke(line: u32, from_mm: Place, to_mm: Place, speed_mm_s: Option<f64>) -> Stroke {
        Stroke { line, from_mm, to_mm, speed_mm_s }
    }

    #[test]
    fn parts_of_a_line_are_one_piece() {
        let mut strokes = Strokes::new([None; 3]);
        for k in 0..100 {
            let [from, to] = [k, k + 1].map(|k| [f64::from(k) * 0.1, f64::from(k) * 0.2, 3.0]);
            strokes.add(&stroke(1, from, to, Some(5.0)));
        }
        strokes.add(&stroke(1, [10.0, 20.0, 3.0], [9.0, 18.0, 3.0], Some(5.0)));
        strokes.add(&stroke(2, [9.0, 18.0, 3.0], [8.0, 16.0, 3.0], None));
        assert_eq!(strokes.pieces().len(), 3);
        assert_eq!(strokes.extents_mm(), Some([[0.0, 10.0], [0.0, 20.0], [3.0, 3.0]]));
    }

    #[test]
    fn a_long_way_stays_in_bounds_and_keeps_its_extents() {
        let mut strokes = Strokes::new([None; 3]);
        let at = |k: u32| {
            let row = f64::from(k / 2);
            [
                if k.is_multiple_of(2) { 0.0 } else { 100.0 },
                row * 0.001,
                libm::sin(f64::from(k) * 0.01),
            ]
        };
        for k in 0..100_000 {
            strokes.add(&stroke(k + 1, at(k), at(k + 1), Some(5.0)));
        }
        assert!(strokes.pieces().len() <= PIECES_MAX);
        assert!(strokes.pieces().len() > 1000);
        let [x, y, _] = strokes.extents_mm().unwrap();
        assert_eq!((x, y), ([0.0, 100.0], [0.0, 50.0]));
    }

    #[test]
    fn bands_hold_their_speeds() {
        for speed_mm_s in [0.5, 1.0, 7.3, 20.0, 500.0] {
            let middle = speed_of_mm_s(f64::from(band_of(speed_mm_s)));
            assert!(libm::log2(middle / speed_mm_s).abs() <= 0.5 / BANDS_A_DOUBLING + 1e-9);
        }
    }
}
