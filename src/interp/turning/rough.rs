//! Roughing a contour out, cut by cut, and finishing it: the paths of RS274/NGC's G70 to G72.2.
//!
//! The contour is turned so that it goes down on both axes; a cut then goes back along the first
//! axis at one level of the second until it meets the contour:
//!
//! ```text
//!   across ▲            ┌────── start
//!          │  ◀─────────┘ cut, escape, back, next level
//!          │ ──╮ ◀──────┐
//!          │   ╰────────┘ contour
//!          └────────────────▶ along
//! ```

use crate::gcode::codes::Pockets;

use super::profile::{
    Budget, Piece, QUARTER, Round, Turning, Vector, after, finish_corners, length, minus, mirrors,
    offset, plus, turned, undone,
};

/// Ends of arcs nearer than this are one point.
const SHORT: f64 = 1e-3;

/// Levels nearer than this are one.
const SAME: f64 = 1e-6;

/// What a pass costs of the budget: one that finds no end makes no moves to be counted.
const LOOKS_OF_PASS: usize = 100;

/// Most moves of one cycle.
const MOVES_MAX: usize = 200_000;

/// A move of a cycle, in the plane of the contour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::interp) enum Way {
    Rapid(Vector),
    Line(Vector),
    Arc(Round, Vector),
}

/// What roughing takes beside the contour.
#[derive(Clone, Copy, Debug)]
pub(super) struct Roughing {
    /// G72
    pub faces: bool,
    pub pockets: Pockets,
    /// What is left on the contour, aside of it and as a shift.
    pub distance: f64,
    pub shift: Vector,
    /// From level to level.
    pub depth: f64,
    /// How far the tool escapes after a cut.
    pub escape: f64,
}

/// A contour, turned, and the way back.
pub(super) struct Turned {
    pub pieces: Vec<Piece>,
    back: Turning,
    pub ways: Vec<Way>,
    pub budget: Budget,
}

type Done = Result<(), &'static str>;

impl Turned {
    /// A contour that is led in to from a point.
    pub fn new(pieces: &[Piece], start: Vector) -> Turned {
        let mut contour = Turned::of(pieces);
        if let Some(lead) = contour.pieces.first_mut() {
            lead.start = start;
        }
        contour
    }

    fn of(pieces: &[Piece]) -> Turned {
        let (back, ways) = ([[1.0, 0.0], [0.0, 1.0]], Vec::new());
        Turned { pieces: pieces.to_vec(), back, ways, budget: Budget::new() }
    }

    pub fn turn(&mut self, turning: &Turning) {
        self.pieces.iter_mut().for_each(|piece| piece.turn(turning));
        self.back = after(&self.back, &undone(turning));
    }

    /// Makes the contour, from its first point to its last, go back along and up across.
    fn swap(&mut self) {
        let (Some(first), Some(last)) = (self.pieces.first(), self.pieces.last()) else { return };
        let way = minus(first.end, last.end);
        let along = if way[0] < 0.0 { -1.0 } else { 1.0 };
        let across = if way[1] > 0.0 { -1.0 } else { 1.0 };
        self.turn(&[[along, 0.0], [0.0, across]]);
    }

    fn add(&mut self, way: Way) -> Done {
        if self.ways.len() >= MOVES_MAX {
            return Err("the cycle makes more moves than anybody wants: is the depth right?");
        }
        let back = &self.back;
        self.ways.push(match way {
            Way::Rapid(to) => Way::Rapid(turned(back, to)),
            Way::Line(to) => Way::Line(turned(back, to)),
            Way::Arc(Round { center, ccw }, to) => {
                let round = Round { center: turned(back, center), ccw: ccw != mirrors(back) };
                Way::Arc(round, turned(back, to))
            }
        });
        Ok(())
    }

    /// Goes straight to a point, unless the tool is there already but for rounding.
    pub fn straight(&mut self, to: Vector, fast: bool) -> Done {
        let at = match self.ways.last() {
            Some(Way::Rapid(at) | Way::Line(at) | Way::Arc(_, at)) => Some(*at),
            None => None,
        };
        if at.is_some_and(|at| length(minus(turned(&self.back, to), at)) < SAME) {
            return Ok(());
        }
        self.add(if fast { Way::Rapid(to) } else { Way::Line(to) })
    }

    /// Goes along a piece to a point of it.
    pub fn along(&mut self, piece: &Piece, to: Vector) -> Done {
        self.add(piece.round.map_or(Way::Line(to), |round| Way::Arc(round, to)))
    }
}

const NO_CORNER: &str = "a corner leaves no room for its fillet or chamfer (A, C)";
const GOES_BACK: &str = "it goes back on its way, so that no cut from one side reaches it";

/// G70: passes along the contour, the first so far aside of it, the last so far.
pub(super) fn finish(
    pieces: &[Piece],
    start: Vector,
    distances: [f64; 2],
    passes: u32,
) -> Result<Vec<Way>, &'static str> {
    let mut contour = Turned::new(pieces, start);
    let mut behind_lead = Turned::of(pieces.get(1..).unwrap_or_default());
    behind_lead.swap();
    if !behind_lead.pieces.iter().all(Piece::is_monotonic) {
        contour.turn(&QUARTER);
    }
    contour.prepare()?;
    for pass in (0..passes).rev() {
        let [first, last] = distances;
        let distance = f64::from(pass) * (first - last) / f64::from(passes) + last;
        let mut pieces = contour.pieces.clone();
        offset(&mut pieces, distance, &mut contour.budget)?;
        let Some((lead, rest)) = pieces.split_first() else { continue };
        contour.straight(lead.start, true)?;
        contour.straight(lead.end, true)?;
        for piece in rest {
            contour.along(piece, piece.end)?;
        }
    }
    Ok(contour.ways)
}

/// G71 to G72.2
pub(super) fn rough(
    pieces: &[Piece],
    start: Vector,
    words: &Roughing,
) -> Result<Vec<Way>, &'static str> {
    let mut contour = Turned::new(pieces, start);
    if words.faces {
        contour.turn(&QUARTER);
    }
    contour.prepare()?;
    offset(&mut contour.pieces, words.distance, &mut contour.budget)?;
    contour.pieces.iter_mut().for_each(|piece| piece.shift(words.shift));
    let start = contour.pieces.first().map_or(start, |lead| lead.start);
    contour.straight(start, true)?;
    if let Some(last) = contour.pieces.last().filter(|last| last.end[1] < start[1]) {
        let end = last.end;
        contour.pieces.push(Piece::line(end, [end[0], start[1]]));
    }
    let mut pockets = vec![start[1]];
    let at = if words.pockets == Pockets::Only { contour.pass_first(start)? } else { (0, start) };
    contour.clear(at, words, &mut pockets)?;
    Ok(contour.ways)
}

impl Turned {
    /// Brings the contour into the position in which it is cut, its corners done.
    pub fn prepare(&mut self) -> Done {
        self.swap();
        finish_corners(&mut self.pieces).ok_or(NO_CORNER)?;
        if let Some(lead) = self.pieces.first_mut() {
            lead.start[0] = lead.start[0].max(lead.end[0]);
        }
        if self.pieces.iter().all(Piece::is_monotonic) { Ok(()) } else { Err(GOES_BACK) }
    }

    /// Goes down into the contour as far as it goes down: what is above has been cut before.
    fn pass_first(&mut self, start: Vector) -> Result<(usize, Vector), &'static str> {
        let mut location = start;
        let mut at = 0;
        while at < self.pieces.len() && !self.dive(at, &mut location, -1e9)? {
            at += 1;
        }
        Ok((at, location))
    }

    /// Cuts level by level from a place on, and so each pocket that the contour then leads to.
    /// `tops` are the levels at which pockets begin, outermost first.
    fn clear(
        &mut self,
        (mut at, mut location): (usize, Vector),
        words: &Roughing,
        tops: &mut Vec<f64>,
    ) -> Done {
        let top = |tops: &[f64]| tops.last().copied().unwrap_or_default();
        let depth = words.depth.max(2.0 * SAME);
        let mut level = top(tops);
        while at < self.pieces.len() {
            self.budget.spend(LOOKS_OF_PASS)?;
            level -= ((level - SAME - location[1]) / depth).ceil().max(0.0) * depth;
            if self.dive(at, &mut location, level)? {
                if words.pockets == Pockets::Leave {
                    for piece in at..self.pieces.len() {
                        self.climb_only(piece, &mut location)?;
                    }
                    return Ok(());
                }
                while at < self.pieces.len() && !self.climb(at, &mut location)? {
                    at += 1;
                }
                if words.pockets == Pockets::Only {
                    if location[1] > top(tops) && tops.len() > 1 {
                        tops.pop();
                    }
                    if tops.len() == 1 {
                        tops.push(location[1]);
                    }
                }
                level = top(tops);
            } else if at + 1 == self.pieces.len() {
                return Ok(());
            } else if (location[1] - level).abs() > SAME {
                at += 1;
            } else if self.cut(&mut at, location, words)? {
                level -= depth;
            }
        }
        Ok(())
    }

    /// One cut at the level of a location, up to what is in its way; false where another piece
    /// begins right there.
    fn cut(
        &mut self,
        at: &mut usize,
        location: Vector,
        words: &Roughing,
    ) -> Result<bool, &'static str> {
        for piece in *at..self.pieces.len() {
            self.budget.spend(0)?;
            let found = self.pieces[piece].meets_level(location[1]);
            let end = if piece == *at { found.last() } else { found.first() };
            let Some(end) = end.copied() else { continue };
            let distance = (end - location[0]).abs();
            if end - SAME > location[0] || (distance < SAME && piece == *at) {
                continue;
            }
            if distance < SAME {
                let is_begin = length(minus(location, self.pieces[piece].start)) < SAME;
                if is_begin {
                    *at = piece;
                }
                return Ok(!is_begin);
            }
            let escape = words.escape * (distance / 2.0 / words.escape).min(1.0);
            let end = [end, location[1]];
            self.straight(end, false)?;
            self.straight(plus(end, [escape, escape]), true)?;
            self.straight(plus(location, [-escape, escape]), true)?;
            self.straight(location, *at == 0)?;
            return Ok(true);
        }
        Ok(false)
    }

    /// Goes down a piece, to a level at most; true where the piece does not go down.
    fn dive(&mut self, at: usize, location: &mut Vector, level: f64) -> Result<bool, &'static str> {
        let piece = self.pieces[at];
        let Some(Round { center, ccw }) = piece.round else {
            if piece.start[1] <= piece.end[1] + SAME {
                return Ok(true);
            }
            if level >= piece.end[1] {
                let Some(along) = piece.meets_level(level).first().copied() else {
                    return Err("a level lies above the piece of the contour to be cut");
                };
                *location = [along, level];
            } else {
                *location = piece.end;
            }
            self.straight(*location, at == 0)?;
            return Ok(false);
        };
        if location[0] - piece.end[0] <= SAME {
            *location = piece.end;
            return Ok(false);
        }
        let mut found = piece.meets_level(level);
        if found.is_empty() {
            found = piece.meets_level(level - SAME);
        }
        let is_past =
            if ccw { location[0] - SAME > center[0] } else { location[0] <= center[0] + SAME };
        if is_past {
            return Ok(true);
        }
        let end = if ccw { found.last() } else { found.first() };
        let end = match end.copied() {
            Some(along) if ccw == (along <= center[0]) || along == center[0] => [along, level],
            // Only the far side of a valley lies at this level: it is not met from here.
            Some(_) if !ccw => return Ok(false),
            _ => piece.end,
        };
        *location = end;
        self.along(&piece, end)?;
        Ok(false)
    }

    /// Goes along a piece that goes up; true where it goes down from here.
    fn climb(&mut self, at: usize, location: &mut Vector) -> Result<bool, &'static str> {
        let piece = self.pieces[at];
        let Some(Round { center, ccw }) = piece.round else {
            if piece.end[1] + SAME < piece.start[1] {
                return Ok(true);
            }
            if length(minus(*location, piece.start)) > SAME {
                return Err("the contour has a gap");
            }
            *location = piece.end;
            self.straight(piece.end, false)?;
            return Ok(false);
        };
        if if ccw { location[0] < center[0] - SAME } else { location[0] > center[0] + SAME } {
            return Ok(true);
        }
        let end = if ccw { top_of(&piece, center) } else { piece.end };
        if length(minus(*location, end)) > SHORT {
            self.along(&piece, end)?;
        }
        *location = end;
        Ok(ccw)
    }

    /// Goes along a piece that goes up, from the level where the last one has ended.
    fn climb_only(&mut self, at: usize, location: &mut Vector) -> Done {
        let piece = self.pieces[at];
        if piece.round.is_none() && piece.end[1] < piece.start[1] {
            return Ok(());
        }
        let found = piece.meets_level(location[1]);
        let (Some(first), Some(last)) = (found.first().copied(), found.last().copied()) else {
            return Ok(());
        };
        let (begin, end) = match piece.round {
            None => (first, piece.end),
            Some(Round { center, ccw: false }) if last <= center[0] + SAME => (last, piece.end),
            Some(Round { center, ccw: true }) if first >= center[0] - SAME => {
                (first, top_of(&piece, center))
            }
            Some(_) => return Ok(()),
        };
        location[0] = begin;
        self.straight(*location, false)?;
        if piece.round.is_none() || length(minus(*location, end)) > SHORT {
            self.along(&piece, end)?;
        }
        *location = end;
        Ok(())
    }
}

/// Where an arc goes up no more.
fn top_of(piece: &Piece, center: Vector) -> Vector {
    if piece.end[0] < center[0] {
        [center[0], center[1] + length(minus(piece.start, center))]
    } else {
        piece.end
    }
}
