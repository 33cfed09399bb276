//! Lathe cycles: roughing (G71, G72) and finishing (G70) along the contour of a subprogram, as
//! LinuxCNC has them, and the cycles of FANUC-style lathes.
//!
//! Cycles along a contour are worked out in program units, in the ZX plane, and come out as rapids,
//! lines and arcs of the block that asks for them.

mod contour;
mod drill;
mod groove;
mod lathe;
mod profile;
mod rough;
mod stock;
mod thread;

use crate::base::{Axis, Plane, Point};
use crate::gcode::codes::{Pockets, Stock, Turn};
use crate::gcode::{Block, Fault, Word, letter_set, rules};

pub(super) use contour::Contour;
use contour::Modes;
pub(super) use lathe::Lathe;

use super::cycles::PASSES_MAX;
use super::execute::{Executor, Output};
use super::flow::Flow;
use super::motion::MoveKind;
use super::words::whole;
use profile::{Round, Vector};
use rough::{Roughing, Way, finish, rough};
use stock::{Allowance, cut};

/// Most repetitions of G73.
const REPEATS_MAX: u32 = 1000;

const LATHE_HELP: &str =
    "take --dialect fanuc-lathe for a program of a FANUC-style lathe; else write G18 before it";

/// How far a cut of G71 and G72 escapes where no block says it.
const ESCAPE_MM: f64 = 0.5;

impl Executor<'_> {
    /// Reports what leaves no room for a lathe cycle.
    pub(super) fn judge_turn(
        &mut self,
        turn: Turn,
        block: &Block,
        faults: &mut Vec<Fault>,
    ) -> bool {
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
            // FANUC's form of these cycles, read as RS274/NGC's.
            let is_fanuc = !self.is_lathe() && (block.word(b'Q').is_none() || block.has(b'P'));
            let help = if is_fanuc && turn != Turn::Finish { LATHE_HELP } else { help };
            let message = format!("a lathe cycle cannot run while {mode}");
            faults.push(Fault::block(&rules::CYCLE_MODE, block, message).help(help));
            return false;
        }
        self.has_feed(block, faults)
    }

    /// An empty contour that begins where the cycle does.
    pub(super) fn begin_contour(&self, block: &Block) -> Contour {
        let modes = Modes {
            lathe: self.is_lathe().then(|| self.axes.contains(Axis::C)),
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
        let value =
            |letter: u8, otherwise: f64| block.word(letter).map_or(otherwise, |word| word.value);
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
        self.go_ways(block, ways, out);
    }

    /// G70 to G73 of a FANUC-style lathe: the first of two blocks is kept, the second asks for the
    /// contour; so does one block with D.
    pub(super) fn stock_flow(
        &mut self,
        stock: Stock,
        block: &Block,
        text: &[u8],
        faults: &mut Vec<Fault>,
    ) -> Flow {
        let (Some(first), Some(last)) = (block.word(b'P'), block.word(b'Q')) else {
            self.take_cut(stock, block, faults);
            return Flow::Next;
        };
        self.take_cut_of_one_block(stock, block, text, faults);
        let numbers = [first, last].map(|word| whole(word, 999_999_999, faults));
        let [Some(first), Some(last)] = numbers else { return Flow::Next };
        if stock != Stock::Finish {
            let cut = self.lathe.cut;
            let is_set = match stock {
                Stock::Repeat => cut.passes > 0,
                _ => cut.depth_mm > 0.0,
            };
            if !is_set {
                let message = "no block before says how deep the cuts are";
                let fault = Fault::block(&rules::MISSING_WORD, block, message);
                let help = "write a block before, as G71 U2 R0.5, G72 W2 R0.5 or G73 U5 W2 R4";
                faults.push(fault.help(help));
                return Flow::Next;
            }
            if !self.judge_turn(Turn::Rough { faces: false, pockets: Pockets::Cut }, block, faults)
            {
                return Flow::Next;
            }
        }
        Flow::Stock { stock, first, last }
    }

    /// D of G71 and G72 is the depth of a cut, R the escape; of G73 D is how often it is repeated, I
    /// and K are the relief.
    fn take_cut_of_one_block(
        &mut self,
        stock: Stock,
        block: &Block,
        text: &[u8],
        faults: &mut Vec<Fault>,
    ) {
        let Some(word) = block.word(b'D') else {
            if let Some(word) = block.first_of(letter_set("IKR")) {
                let message = format!("{word} stands beside P and Q, and no D");
                let fault = Fault::word(&rules::UNUSED_WORD, word, message);
                faults.push(fault.help("write it into a block before, or D beside it"));
            }
            return;
        };
        let value = |letter: u8| block.word(letter).map(|word| word.value * self.mm_per_unit);
        let mut cut = self.lathe.cut;
        if stock == Stock::Repeat {
            cut.relief_mm = [value(b'K').unwrap_or_default(), value(b'I').unwrap_or_default()];
            cut.passes = whole(word, REPEATS_MAX, faults).unwrap_or(0);
        } else {
            cut.depth_mm = self.small_length_mm(word, text).abs();
            let held = if cut.escape_mm > 0.0 { cut.escape_mm } else { ESCAPE_MM };
            cut.escape_mm = value(b'R').map_or(held, f64::abs);
        }
        self.lathe.cut = cut;
    }

    fn take_cut(&mut self, stock: Stock, block: &Block, faults: &mut Vec<Fault>) {
        let mm = self.mm_per_unit;
        let value = |letter: u8| block.word(letter).map_or(0.0, |word| word.value * mm);
        let cut = &mut self.lathe.cut;
        let (needed, names) = match stock {
            Stock::Finish => (&b"PQ"[..], "P and Q, the first and last block of its contour"),
            Stock::Turn => (&b"U"[..], "P and Q, or U, the depth of a cut"),
            Stock::Face => (&b"W"[..], "P and Q, or W, the depth of a cut"),
            Stock::Repeat => (&b"R"[..], "P and Q, or R, how often it is repeated"),
        };
        if let Some(letter) = needed.iter().find(|letter| !block.has(**letter)) {
            let message = format!("there is no {}: this cycle needs {names}", char::from(*letter));
            faults.push(Fault::block(&rules::MISSING_WORD, block, message));
            return;
        }
        if let Some(word) = block.first_of(letter_set("DIK")) {
            let message = format!("{word} is of a cycle of one block, with P and Q");
            faults.push(Fault::word(&rules::UNUSED_WORD, word, message));
        }
        match stock {
            Stock::Finish => {}
            Stock::Turn | Stock::Face => {
                let depth = if stock == Stock::Turn { b'U' } else { b'W' };
                (cut.depth_mm, cut.escape_mm) = (value(depth).abs(), value(b'R').abs());
            }
            Stock::Repeat => {
                cut.relief_mm = [value(b'W'), value(b'U')];
                let passes = block.word(b'R').and_then(|word| whole(word, REPEATS_MAX, faults));
                cut.passes = passes.unwrap_or(0);
            }
        }
    }

    /// G71 to G73 of a FANUC-style lathe along a contour.
    pub(super) fn cut_stock(
        &mut self,
        stock: Stock,
        block: &Block,
        contour: &Contour,
        out: &mut Output<'_>,
    ) {
        [Axis::X, Axis::Z].into_iter().for_each(|axis| self.axes_used.insert(axis));
        let position = self.frames.program(&self.position_mm);
        let start = [Axis::Z, Axis::X].map(|axis| position[axis] / self.mm_per_unit);
        let value = |letter: u8| block.word(letter).map_or(0.0, |word| word.value);
        let share = if self.diameters { 0.5 } else { 1.0 };
        let lathe = self.lathe.cut;
        let words = Allowance {
            left: [value(b'W'), value(b'U') * share],
            depth: lathe.depth_mm / self.mm_per_unit,
            escape: lathe.escape_mm / self.mm_per_unit,
            relief: lathe.relief_mm.map(|relief| relief / self.mm_per_unit),
            passes: lathe.passes,
        };
        let ways = if contour.pieces.len() < 2 {
            Err("it has less than two pieces: the first leads in to it")
        } else {
            cut(stock, &contour.pieces, start, &words)
        };
        self.go_ways(block, ways, out);
    }

    /// Goes all ways of a cycle, or reports why its contour cannot be cut.
    fn go_ways(
        &mut self,
        block: &Block,
        ways: Result<Vec<Way>, &'static str>,
        out: &mut Output<'_>,
    ) {
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
