//! G74 and G75 of FANUC-style lathes: grooves and holes, cut by pecks, column beside column.
//!
//! ```text
//!   G74:  ──▶ Z by Q, back by R, again ──▶ end      G75: the same along X by P,
//!         the next column lies P aside on X         the columns Q aside on Z
//! ```
//!
//! The first block says how far a peck comes back (R); without one it is 0.254 mm. In the second P is a
//! length along X and Q one along Z, both without a sign; R is how far the tool moves off the wall, back
//! towards the column before, at the bottom of all columns but the first, which has no room beside
//! it. Of a single column R may have a sign. In one block I, K and D stand for P, Q and that R.

use crate::base::{Axis, Point};
use crate::gcode::codes::{AXIS_LETTERS, Groove};
use crate::gcode::{Block, Fault, Word, letter_set, rules};

use crate::interp::cycles::{BACK_OFF_MM, PASSES_MAX};
use crate::interp::execute::{Executor, Output};
use crate::interp::motion::MoveKind;

/// What rounding leaves of a last peck or column is none.
const ROUNDING_MM: f64 = 1e-9;

/// A groove, in program coordinates.
struct Pecked {
    start: Point,
    end: Point,
    /// The axis of the pecks, and the one from column to column.
    deep: Axis,
    aside: Axis,
    peck_mm: f64,
    step_mm: f64,
    relief_mm: f64,
    back_mm: f64,
}

impl Executor<'_> {
    /// G74 and G75
    pub(super) fn groove(&mut self, way: Groove, block: &Block, out: &mut Output<'_>) {
        if block.letters() & (AXIS_LETTERS | letter_set("PQIKD")) == 0 {
            match block.word(b'R') {
                Some(word) => self.lathe.groove_mm = Some(word.value.abs() * self.mm_per_unit),
                None => {
                    let message = "there is no R, how far a peck comes back, and no X or Z";
                    out.faults.push(Fault::block(&rules::MISSING_WORD, block, message));
                }
            }
            return;
        }
        let faults_before = out.faults.len();
        let pecked = self.pecked(way, block, out);
        let Some(pecked) = pecked.filter(|_| self.has_feed(block, out.faults)) else { return };
        if out.faults.len() > faults_before {
            return;
        }
        let columns = pecked.places(pecked.aside, pecked.step_mm);
        let pecks = pecked.places(pecked.deep, pecked.peck_mm);
        for (at, column_mm) in columns.iter().enumerate() {
            let mut place = pecked.start;
            place[pecked.aside] = *column_mm;
            self.go_lathe(block, &place, MoveKind::Rapid, out);
            self.peck(&pecked, &pecks[1..], place, block, out);
            place[pecked.deep] = pecked.end[pecked.deep];
            let side = if columns.len() == 1 { 1.0 } else { pecked.way(pecked.aside) };
            if at > 0 || columns.len() == 1 {
                place[pecked.aside] -= side * pecked.relief_mm;
                self.go_lathe(block, &place, MoveKind::Rapid, out);
            }
            place[pecked.deep] = pecked.start[pecked.deep];
            self.go_lathe(block, &place, MoveKind::Rapid, out);
        }
        self.go_lathe(block, &pecked.start, MoveKind::Rapid, out);
    }

    /// One column, from above it to its bottom.
    fn peck(
        &mut self,
        pecked: &Pecked,
        depths_mm: &[f64],
        mut place: Point,
        block: &Block,
        out: &mut Output<'_>,
    ) {
        for (at, depth_mm) in depths_mm.iter().enumerate() {
            place[pecked.deep] = *depth_mm;
            self.go_lathe(block, &place, MoveKind::Line { feed_mm_min: 0.0 }, out);
            if at + 1 < depths_mm.len() {
                let top_mm = pecked.start[pecked.deep];
                let back_mm = pecked.back_mm.min((depth_mm - top_mm).abs());
                place[pecked.deep] -= pecked.way(pecked.deep) * back_mm;
                self.go_lathe(block, &place, MoveKind::Rapid, out);
            }
        }
    }

    /// Reads the words of a groove; reports those that are missing or wrong.
    fn pecked(&mut self, way: Groove, block: &Block, out: &mut Output<'_>) -> Option<Pecked> {
        let start = self.frames.program(&self.position_mm);
        let end = self.program_target(block, out.faults);
        let [by_x, by_z] = [(b'P', b'I'), (b'Q', b'K')].map(|(small, plain)| {
            let small = block.word(small).map(|word| (*word, self.small_length_mm(word, out.text)));
            small.or(block.word(plain).map(|word| (*word, word.value * self.mm_per_unit)))
        });
        let (deep, aside) = match way {
            Groove::Face => ((Axis::Z, by_z, "Q"), (Axis::X, by_x, "P")),
            Groove::Side => ((Axis::X, by_x, "P"), (Axis::Z, by_z, "Q")),
        };
        if end[deep.0] == start[deep.0] {
            let message = format!("this groove has no depth: {} is where it ends", deep.0);
            out.faults.push(Fault::block(&rules::MISSING_WORD, block, message));
            return None;
        }
        let mut length = |(axis, word, letter): (Axis, Option<(Word, f64)>, &str)| match word {
            _ if end[axis] == start[axis] => Some(f64::INFINITY),
            Some((_, mm)) if mm > 0.0 => Some(mm),
            Some((word, _)) => {
                let message = format!("{word}: this length is above 0");
                out.faults.push(Fault::word(&rules::BAD_VALUE, &word, message));
                None
            }
            None => {
                let message = format!("there is no {letter}, the length of a step along {axis}");
                out.faults.push(Fault::block(&rules::MISSING_WORD, block, message));
                None
            }
        };
        let (peck_mm, step_mm) = (length(deep)?, length(aside)?);
        let relief = block.word(b'R').or(block.word(b'D'));
        let relief_mm = relief.map_or(0.0, |word| word.value * self.mm_per_unit);
        let back_mm = self.lathe.groove_mm.unwrap_or(BACK_OFF_MM);
        let (deep, aside) = (deep.0, aside.0);
        let pecked = Pecked { start, end, deep, aside, peck_mm, step_mm, relief_mm, back_mm };
        let count = |axis: Axis, by_mm: f64| ((end[axis] - start[axis]).abs() / by_mm).ceil() + 1.0;
        let pecks = count(deep, peck_mm) * count(aside, step_mm);
        if pecks > PASSES_MAX {
            let message = format!("{pecks:.0} pecks in one block are more than {PASSES_MAX}");
            let fault = Fault::block(&rules::BAD_VALUE, block, message);
            out.faults.push(fault.help("P and Q without a point are in thousandths of a mm"));
            return None;
        }
        if let Some(word) = relief.filter(|word| word.value < 0.0 && end[aside] != start[aside]) {
            let message = format!("{word}: with several columns this length has no sign");
            out.faults.push(Fault::word(&rules::BAD_VALUE, word, message));
            return None;
        }
        Some(pecked)
    }
}

impl Pecked {
    /// Which way the cycle goes along an axis.
    fn way(&self, axis: Axis) -> f64 {
        (self.end[axis] - self.start[axis]).signum()
    }

    /// From its start to its end along an axis, by steps.
    fn places(&self, axis: Axis, by_mm: f64) -> Vec<f64> {
        let (from, to) = (self.start[axis], self.end[axis]);
        let all = (to - from).abs();
        let mut places = vec![from];
        for step in 1.. {
            let way = f64::from(step) * by_mm;
            if all - way <= ROUNDING_MM || places.len() as f64 > PASSES_MAX {
                break;
            }
            places.push(from + way * self.way(axis));
        }
        if all > 0.0 {
            places.push(to);
        }
        places
    }
}
