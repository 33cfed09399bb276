//! G70 to G73 of FANUC-style lathes: a contour of the same program, cut level by level or nearer
//! each time.
//!
//! Where the contour goes in one direction on both axes (type I), each cut of roughing goes along its
//! level up to the contour, escapes at 45 degrees and comes back; the last pass follows the contour
//! with what is left for finishing. One that goes in again, in one direction along the cuts (type II),
//! is cleared pocket by pocket, as G71 and G72 of RS274/NGC do. All cycles end where they began.

use crate::gcode::codes::{Pockets, Stock};

use super::profile::{Piece, QUARTER, Vector, plus};
use super::rough::{Roughing, Turned, Way, rough};

/// What the blocks of a cycle say, in program units: along Z, along X as a radius.
#[derive(Clone, Copy, Debug)]
pub(super) struct Allowance {
    /// What is left for finishing.
    pub left: Vector,
    /// From level to level, and the escape.
    pub depth: f64,
    pub escape: f64,
    /// How far off the first repetition of G73 lies, and how many there are.
    pub relief: Vector,
    pub passes: u32,
}

/// Most levels of one cycle.
const LEVELS_MAX: f64 = 10_000.0;

/// The moves of G71 to G73 from a start along a contour, whose first piece leads in to it.
pub(super) fn cut(
    stock: Stock,
    pieces: &[Piece],
    start: Vector,
    words: &Allowance,
) -> Result<Vec<Way>, &'static str> {
    let mut contour = Turned::new(pieces, start);
    if stock == Stock::Repeat {
        for pass in (0..words.passes).rev() {
            let share = f64::from(pass) / f64::from(words.passes.saturating_sub(1).max(1));
            let shift = plus(words.left, [words.relief[0] * share, words.relief[1] * share]);
            contour.straight(plus(start, shift), true)?;
            contour.follow(pieces, shift)?;
            contour.straight(plus(start, shift), true)?;
        }
        contour.straight(start, true)?;
        return Ok(contour.ways);
    }
    contour.pieces.iter_mut().skip(1).for_each(|piece| piece.shift(words.left));
    if let Some(lead) = contour.pieces.first_mut() {
        lead.end = plus(lead.end, words.left);
    }
    if stock == Stock::Face {
        contour.turn(&QUARTER);
    }
    contour.prepare()?;
    if contour.has_pockets() {
        let (faces, pockets, distance) = (stock == Stock::Face, Pockets::Cut, 0.0);
        let Allowance { left: shift, depth, escape, .. } = *words;
        let words = Roughing { faces, pockets, distance, shift, depth, escape };
        // The first level is one cut away from where the cycle begins.
        let across = usize::from(!faces);
        let mut first = start;
        if let Some(lead) = pieces.first() {
            let deep = lead.end[across] - start[across];
            first[across] += depth.min(deep.abs()).copysign(deep);
        }
        let mut ways = rough(pieces, first, &words)?;
        ways.push(Way::Rapid(start));
        return Ok(ways);
    }
    contour.levels(words)?;
    contour.finish_at(start)
}

impl Turned {
    /// Whether the contour goes in again.
    fn has_pockets(&self) -> bool {
        self.pieces.iter().skip(1).any(|piece| piece.end[1] < piece.start[1] - 1e-6)
    }

    /// Cuts level by level.
    fn levels(&mut self, words: &Allowance) -> Result<(), &'static str> {
        let (start, Some(lead)) = (self.start(), self.pieces.first().copied()) else {
            return Err("it is empty");
        };
        let deep = start[1] - lead.end[1];
        if deep / words.depth > LEVELS_MAX {
            return Err("the cuts are too many: is the depth right?");
        }
        let mut level = start[1] - words.depth;
        while level > lead.end[1] + 1e-9 {
            self.budget.spend(self.pieces.len())?;
            let met = self
                .pieces
                .iter()
                .skip(1)
                .find_map(|piece| piece.meets_level(level).into_iter().reduce(f64::max));
            let end = met.or(self.pieces.last().map(|last| last.end[0])).unwrap_or(start[0]);
            let escape = words.escape.min(start[1] - level).max(0.0);
            self.straight([start[0], level], true)?;
            self.straight([end, level], false)?;
            self.straight([end + escape, level + escape], false)?;
            self.straight([start[0], level + escape], true)?;
            level -= words.depth;
        }
        Ok(())
    }

    /// Follows the contour, and comes back to where the cycle began.
    fn finish_at(mut self, start: Vector) -> Result<Vec<Way>, &'static str> {
        let Some(lead) = self.pieces.first().copied() else { return Ok(self.ways) };
        self.straight([self.start()[0], lead.end[1]], true)?;
        self.straight(lead.end, false)?;
        for piece in self.pieces.clone().into_iter().skip(1) {
            self.along(&piece, piece.end)?;
        }
        let mut ways = self.ways;
        ways.push(Way::Rapid(start));
        Ok(ways)
    }

    fn start(&self) -> Vector {
        self.pieces.first().map_or([0.0; 2], |lead| lead.start)
    }

    /// Goes along pieces, shifted: to the first by a rapid.
    fn follow(&mut self, pieces: &[Piece], shift: Vector) -> Result<(), &'static str> {
        for (at, piece) in pieces.iter().enumerate() {
            let mut piece = *piece;
            piece.shift(shift);
            if at == 0 {
                self.straight(piece.end, true)?;
            } else {
                self.along(&piece, piece.end)?;
            }
        }
        Ok(())
    }
}
