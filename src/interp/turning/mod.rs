//! Lathe cycles along a contour: roughing (G71, G72) and finishing (G70), as LinuxCNC has them.
//!
//! The contour is a subprogram that is read, not run. Everything is worked out in program units, in
//! the ZX plane, and comes out as rapids, lines and arcs of the block that asks for it.

mod contour;
mod profile;
mod rough;

use crate::base::{Axis, Plane, Point};
use crate::gcode::codes::Turn;
use crate::gcode::{Block, Fault, Word, rules};

pub(super) use contour::Contour;
use contour::Modes;

use super::cycles::PASSES_MAX;
use super::execute::{Executor, Output};
use super::motion::MoveKind;
use super::words::whole;
use profile::{Round, Vector};
use rough::{Roughing, Way, finish, rough};

impl Executor<'_> {
    /// Reports what leaves no room for a lathe cycle.
    pub(super) fn judge_turn(&mut self, turn: Turn, block: &Block, faults: &mut Vec<Fault>) -> bool {
        let mode = if self.plane != Plane::Zx {
            Some(("another plane than ZX is in force", "write G18 before it"))
        } else if self.compensation.is_some() && turn != Turn::Finish {
            Some(("cutter compensation is in force", "write G40 and a straight move before it"))
        } else if self.polar {
            Some(("polar coordinates are in force", "write G15 before it"))
        } else {
            None
        };
        if let Some((mode, help)) = mode {
            let message = format!("a lathe cycle cannot run while {mode}");
            faults.push(Fault::block(&rules::CYCLE_MODE, block, message).help(help));
            return false;
        }
        self.has_feed(block, faults)
    }

    /// An empty contour that begins where the cycle does.
    pub(super) fn begin_contour(&self, block: &Block) -> Contour {
        let modes = Modes {
            diameters: self.diameters,
            absolute: self.absolute,
            centers_absolute: self.centers_absolute,
            tolerance: 100.0 * self.machine.arc_radius_tolerance_mm / self.mm_per_unit,
        };
        Contour::new(self.turn_start(block), modes)
    }

    /// Where a lathe cycle begins, Z and X in program units: where the block says, or else where
    /// the machine stands.
    fn turn_start(&self, block: &Block) -> Vector {
        let position = self.frames.program(&self.position_mm);
        let share = if self.diameters { 0.5 } else { 1.0 };
        [(Axis::Z, 1.0), (Axis::X, share)].map(|(axis, share)| {
            let at = position[axis] / self.mm_per_unit;
            match block.word(axis.letter() as u8) {
                Some(word) if self.absolute => word.value * share,
                Some(word) => at + word.value * share,
                None => at,
            }
        })
    }

    /// Takes the machine to be where a contour has come to: `#<_x>` and `#<_z>` then say so.
    pub(super) fn follow_contour(&mut self, [z, x]: [f64; 2]) {
        let mut at = self.frames.program(&self.position_mm);
        (at[Axis::Z], at[Axis::X]) = (z * self.mm_per_unit, x * self.mm_per_unit);
        self.position_mm = self.frames.machine(&at);
    }

    /// G70 to G72.2 along a contour.
    pub(super) fn turn(
        &mut self,
        turn: Turn,
        block: &Block,
        contour: &Contour,
        out: &mut Output<'_>,
    ) {
        let pieces = &contour.pieces;
        if pieces.len() < 2 {
            let message = "the contour has less than two pieces: the first leads in to it";
            out.faults.push(Fault::block(&rules::CONTOUR, block, message));
            return;
        }
        [Axis::X, Axis::Z].into_iter().for_each(|axis| self.axes_used.insert(axis));
        let start = self.turn_start(block);
        self.go_way(block, Way::Rapid(start), out);
        let value = |letter: u8, otherwise: f64| {
            block.word(letter).map_or(otherwise, |word| word.value)
        };
        let ways = match turn {
            Turn::Finish => {
                let passes = match block.word(b'P') {
                    Some(word) => whole(word, PASSES_MAX as u32, out.faults),
                    None => Some(1),
                };
                let Some(passes) = passes else { return };
                finish(pieces, start, [value(b'D', 0.0), value(b'E', 0.0)], passes)
            }
            Turn::Rough { faces, pockets } => {
                let is_wrong =
                    |word: &&Word| word.value < 0.0 || (word.letter == b'I' && word.value == 0.0);
                let words = [b'I', b'R'].into_iter().filter_map(|letter| block.word(letter));
                if let Some(word) = words.into_iter().find(is_wrong) {
                    let message = "I, from cut to cut, is above 0; R, the escape, not below it";
                    out.faults.push(Fault::word(&rules::BAD_VALUE, word, message));
                    return;
                }
                let shift = [value(b'W', 0.0), value(b'U', 0.0)];
                let (distance, depth) = (value(b'D', 0.0), value(b'I', 1.0));
                let escape = value(b'R', 0.5);
                let words = Roughing { faces, pockets, distance, shift, depth, escape };
                rough(pieces, start, &words)
            }
        };
        match ways {
            Ok(ways) => ways.into_iter().for_each(|way| self.go_way(block, way, out)),
            Err(message) => {
                let message = format!("this contour cannot be cut so: {message}");
                out.faults.push(Fault::block(&rules::CONTOUR, block, message));
                self.forget_position();
            }
        }
    }

    fn go_way(&mut self, block: &Block, way: Way, out: &mut Output<'_>) {
        let at = self.frames.program(&self.position_mm);
        let place = |[z, x]: Vector| -> Point {
            let mut point = at;
            point[Axis::Z] = z * self.mm_per_unit;
            point[Axis::X] = x * self.mm_per_unit;
            self.place(&point)
        };
        let (to, kind) = match way {
            Way::Rapid(to) => (place(to), MoveKind::Rapid),
            Way::Line(to) => (place(to), MoveKind::Line { feed_mm_min: 0.0 }),
            Way::Arc(Round { center, ccw }, to) => {
                let Some(is_mirrored) = self.frames.arcs_mirrored(Plane::Zx) else {
                    let message = "an arc of this contour would be none after the rotation or \
                                   scaling in force";
                    out.faults.push(Fault::block(&rules::ARC_DISTORTED, block, message));
                    return;
                };
                let center = place(center);
                let center_mm = Plane::Zx.axes().map(|axis| center[axis]);
                let (feed_mm_min, ccw) = (0.0, ccw != is_mirrored);
                let (plane, turns) = (Plane::Zx, 0);
                (place(to), MoveKind::Arc { feed_mm_min, plane, center_mm, ccw, turns })
            }
        };
        if to != self.position_mm {
            self.go(block, &to, kind, None, out);
        }
    }
}
