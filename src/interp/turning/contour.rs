//! The contour of a lathe cycle: blocks of G0 to G3 that stand elsewhere, read as lines and arcs
//! along Z and X.
//!
//! X Z U W are its points (U and W from the one before), I K R its arcs, A and C the radius of a
//! fillet and the size of a chamfer at the end of a piece; on FANUC-style lathes corners and angles
//! are those of [`crate::interp::corner`]. F S T and N mean nothing to a contour.
//! What else stands there is said. Lengths stay in program units, X as a radius.

use crate::base::Axis;
use crate::gcode::codes::{self, CORNER_LETTERS, Op};
use crate::gcode::{Block, COMMA_A, Fault, Word, letter_set, rules};

use crate::interp::corner::{Toward, corner_of, holds_sign, renamed};
use crate::interp::fillet::{self, Leg};
use crate::interp::frames::sin_cos_deg;

use super::profile::{Finish, Piece, Round, Vector, length, minus, plus};

/// Most pieces of a contour.
const PIECES_MAX: usize = 10_000;

/// Letters that count in a contour.
const LETTERS: u32 = letter_set("XZUWIKRACG");

/// Letters that a contour may hold and that mean nothing to it.
const FREE_LETTERS: u32 = letter_set("FNOST");

/// How a contour goes on.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Way {
    Straight,
    Arc { ccw: bool },
}

/// A contour while it is read.
#[derive(Debug)]
pub(in crate::interp) struct Contour {
    pub(super) pieces: Vec<Piece>,
    at: Vector,
    way: Way,
    modes: Modes,
    /// What becomes of the corner at the end of the last piece, once the next one is known.
    corner: Option<(fillet::Finish, Option<Toward>, Word)>,
    /// Whether a block of it has an error.
    pub(in crate::interp) is_faulty: bool,
}

/// What words of a contour mean.
#[derive(Clone, Copy, Debug)]
pub(super) struct Modes {
    /// Whether corners are as FANUC-style lathes have them, and whether C is an axis there.
    pub lathe: Option<HasC>,
    /// G7
    pub diameters: bool,
    /// G90
    pub absolute: bool,
    /// G90.1
    pub centers_absolute: bool,
    /// How far the radii of an arc's ends may differ, in program units.
    pub tolerance: f64,
}

/// Whether a lathe has the axis C.
pub(super) type HasC = bool;

impl Contour {
    /// Begins at a point, Z and X.
    pub(super) fn new(at: Vector, modes: Modes) -> Contour {
        let (pieces, way) = (Vec::new(), Way::Straight);
        Contour { pieces, at, way, modes, corner: None, is_faulty: false }
    }

    /// Where it has come to: Z and X, in program units.
    pub(in crate::interp) fn at(&self) -> Vector {
        self.at
    }

    /// Adds a block of the contour.
    pub(in crate::interp) fn add(&mut self, block: &Block, faults: &mut Vec<Fault>) {
        if !self.take_codes(block, faults) {
            return;
        }
        let with_commas = self.modes.lathe.filter(|_| self.way == Way::Straight);
        let with_commas = with_commas.and_then(|has_c| renamed(block, has_c));
        let block = with_commas.as_ref().unwrap_or(block);
        if let Some(word) = block.first_of(!(LETTERS | FREE_LETTERS | CORNER_LETTERS)) {
            let message = format!("{word} stands in the contour of a lathe cycle: it is left out");
            let fault = Fault::word(&rules::CONTOUR_WORD, word, message);
            faults.push(fault.help("a contour is made of X Z U W, I K R, A and C"));
        }
        let value = |letter| block.word(letter).map(|word| word.value);
        let share = if self.modes.diameters { 0.5 } else { 1.0 };
        let words = [(b'Z', b'W', 1.0), (b'X', b'U', share)];
        let start = self.at;
        for (at, (to, by, share)) in self.at.iter_mut().zip(words) {
            match (value(to), value(by)) {
                (Some(_), Some(_)) => {
                    let (to, by) = (char::from(to), char::from(by));
                    let message = format!("{to} and {by} both say where this piece ends");
                    faults.push(Fault::block(&rules::CONTOUR, block, message));
                    return;
                }
                (Some(value), None) if self.modes.absolute => *at = value * share,
                (Some(value), None) | (None, Some(value)) => *at += value * share,
                (None, None) => {}
            }
        }
        if let Some(angle) = block.word(COMMA_A).copied() {
            self.end_by_angle(&angle, start, block, faults);
        }
        let end = self.at;
        if start == end {
            return;
        }
        if self.pieces.len() >= PIECES_MAX {
            let message = format!("a contour has at most {PIECES_MAX} pieces");
            faults.push(Fault::block(&rules::CONTOUR, block, message));
            return;
        }
        let round = match self.way {
            Way::Straight => None,
            Way::Arc { ccw } => match self.center(block, start, end, ccw, faults) {
                Some(center) => Some(Round { center, ccw }),
                None => return,
            },
        };
        let mut piece = Piece { round, ..Piece::line(start, end) };
        self.take_corner(&mut piece, faults);
        self.pieces.push(piece);
        let takes_signs = self.modes.lathe.is_some() && self.way == Way::Straight;
        self.corner = corner_of(block, takes_signs, faults);
        if self.modes.lathe.is_some() {
            return;
        }
        let corner = match (value(b'A'), value(b'C')) {
            (Some(size), None) => Finish::Fillet(size),
            (None, Some(size)) => Finish::Chamfer(size),
            (None, None) => return,
            (Some(_), Some(_)) => {
                let message = "a corner has either a fillet (A) or a chamfer (C)";
                faults.push(Fault::block(&rules::CONTOUR, block, message));
                return;
            }
        };
        self.pieces.push(Piece::corner(end, corner));
    }

    /// How the contour goes on; reports codes that it cannot hold.
    fn take_codes(&mut self, block: &Block, faults: &mut Vec<Fault>) -> bool {
        for word in block.words().iter().filter(|word| matches!(word.letter, b'G' | b'M')) {
            match codes::find(word.letter, word.value).and_then(|code| code.op) {
                Some(Op::Rapid | Op::Line) => self.way = Way::Straight,
                Some(Op::ArcClockwise) => self.way = Way::Arc { ccw: false },
                Some(Op::ArcCounterClockwise) => self.way = Way::Arc { ccw: true },
                // The nose of the tool is compensated when the contour is finished.
                Some(Op::CompensationOff | Op::Compensate { .. }) => {}
                _ => {
                    let message = format!("{word} stands in the contour of a lathe cycle");
                    let fault = Fault::word(&rules::CONTOUR, word, message);
                    faults.push(fault.help("a contour is made of G0, G1, G2 and G3"));
                    return false;
                }
            }
        }
        true
    }

    /// Where a line ends of which a coordinate and the angle are given.
    fn end_by_angle(
        &mut self,
        angle: &Word,
        start: Vector,
        block: &Block,
        faults: &mut Vec<Fault>,
    ) {
        let named = [[b'Z', b'W'], [b'X', b'U']];
        let named = named.map(|letters| letters.iter().any(|letter| block.has(*letter)));
        let (sin, cos) = sin_cos_deg(angle.value);
        let along = [cos, sin];
        let known = usize::from(named[1]);
        if named[0] == named[1] || along[known].abs() < 1e-9 || self.way != Way::Straight {
            let message = format!("{angle} does not tell where this piece ends");
            let fault = Fault::word(&rules::CORNER, angle, message);
            faults.push(fault.help("in a contour write one coordinate of a line beside its angle"));
            return;
        }
        let by = self.at[known] - start[known];
        self.at[1 - known] = start[1 - known] + by * along[1 - known] / along[known];
    }

    /// Takes the corner between the last piece and the next one away.
    fn take_corner(&mut self, next: &mut Piece, faults: &mut Vec<Fault>) {
        let Some((finish, toward, word)) = self.corner.take() else { return };
        let Some(last) = self.pieces.last_mut() else { return };
        let leg = |piece: &Piece| Leg {
            start: piece.start,
            end: piece.end,
            round: piece.round.map(|round| (round.center, round.ccw)),
        };
        let (mut first, mut second) = (leg(last), leg(next));
        let way = |axis| {
            second.end[usize::from(axis == Axis::X)] - second.start[usize::from(axis == Axis::X)]
        };
        let done = holds_sign(toward, way);
        match done.and_then(|()| fillet::finish(&mut first, &mut second, finish)) {
            Ok(Some(Leg { start, end, round })) => {
                let round = round.map(|(center, ccw)| Round { center, ccw });
                (last.end, next.start) = (start, end);
                self.pieces.push(Piece { round, ..Piece::line(start, end) });
            }
            Ok(None) => {}
            Err(message) => {
                let message = format!("{word}: {message}");
                let fault = Fault::word(&rules::CORNER, &word, message);
                faults.push(fault.help("it is in the block before this one of the contour"));
            }
        }
    }

    /// Ends the contour of a cycle; reports a corner that no piece follows.
    pub(in crate::interp) fn end(&mut self, cycle: &Block, faults: &mut Vec<Fault>) {
        if let Some((.., word)) = self.corner.take() {
            self.is_faulty = true;
            let message = format!("the contour of this cycle ends in a corner, {word}");
            faults.push(Fault::block(&rules::CORNER, cycle, message));
        }
    }

    fn center(
        &self,
        block: &Block,
        start: Vector,
        end: Vector,
        ccw: bool,
        faults: &mut Vec<Fault>,
    ) -> Option<Vector> {
        let (i, k) = (block.word(b'I'), block.word(b'K'));
        if let Some(word) = block.word(b'R') {
            let way = minus(end, start);
            let half = length(way) / 2.0;
            let square = (word.value.abs() - half) * (word.value.abs() + half);
            if square < 0.0 {
                let message = format!("{word}: the ends of this arc lie {:.4} apart", 2.0 * half);
                faults.push(Fault::word(&rules::ARC_TOO_SMALL, word, message));
                return None;
            }
            let share = if ccw { square.sqrt() } else { -square.sqrt() } / (2.0 * half);
            let middle = [(start[0] + end[0]) / 2.0, (start[1] + end[1]) / 2.0];
            return Some([middle[0] - way[1] * share, middle[1] + way[0] * share]);
        }
        if i.is_none() && k.is_none() {
            let message = "this arc has neither a centre (I, K) nor a radius (R)";
            faults.push(Fault::block(&rules::ARC_CENTER, block, message));
            return None;
        }
        let given = [k, i].map(|word| word.map_or(0.0, |word| word.value));
        let center = if self.modes.centers_absolute { given } else { plus(start, given) };
        let radii = [start, end].map(|point| length(minus(point, center)));
        let apart = (radii[0] - radii[1]).abs();
        if apart > self.modes.tolerance {
            let message = format!(
                "the ends of this arc lie {:.4} and {:.4} from its centre",
                radii[0], radii[1]
            );
            faults.push(Fault::block(&rules::ARC_RADIUS, block, message));
            return None;
        }
        Some(center)
    }
}
