//! The block that most programs consist of: a straight move or an arc, and nothing else.

use crate::base::Axis;
use crate::gcode::codes::{ARC_LETTERS, AXIS_LETTERS, Op};
use crate::gcode::{Block, letter_bit};

use super::execute::{Asked, Executor, MotionMode, Output, motion_of};
use super::feed::{FeedMode, judge_line_number};
use super::motion::{Bound, Motion, Move, MoveKind};
use super::moves::line_number;

/// What may stand in such a block, of whatever motion.
const MOVE_LETTERS: u32 = AXIS_LETTERS | letter_bit(b'G') | letter_bit(b'N') | letter_bit(b'F');

impl Executor<'_> {
    /// Executes a block of axis words, N and F, with no code but one of G0 to G3, named or in force,
    /// and I J K R for G2 and G3; tells whether it is such a block. There is nothing to sort, nothing
    /// that could stand in its way, and no word without a use, so only what is left of
    /// [`Executor::run`] is done.
    #[inline]
    pub(super) fn run_plain_move(&mut self, block: &Block, out: &mut Output<'_>) -> bool {
        let letters = block.letters();
        let is_within = self.compensation.is_some()
            || self.spline.nurbs.is_some()
            || self.held_move.is_some()
            || self.is_lathe();
        if block.repeats_letter() || is_within || !out.faults.is_empty() {
            return false;
        }
        let mut asked = Asked {
            motion_before: self.motion,
            mm_per_unit_before: self.mm_per_unit,
            ..Asked::default()
        };
        let op = match block.word(b'G').map(|word| motion_code(word.value)) {
            Some(None) => return false,
            op => op.flatten(),
        };
        let used = match op.and_then(motion_of).unwrap_or(self.motion) {
            MotionMode::Rapid | MotionMode::Line => MOVE_LETTERS,
            MotionMode::Arc { .. } => MOVE_LETTERS | ARC_LETTERS,
            _ => return false,
        };
        if letters & !used != 0 {
            return false;
        }
        self.codes.clear();
        if let Some(word) = block.word(b'F') {
            self.set_feed(word, out.faults);
        }
        if let Some(word) = block.word(b'N') {
            judge_line_number(word, out.faults);
        }
        if let Some(op) = op {
            self.set_motion(op, &mut asked);
        }
        match self.plain_kind(letters) {
            Some(kind) if out.faults.is_empty() => self.go_plainly(block, kind, out),
            _ => self.run_motion(block, &mut asked, out),
        }
        true
    }

    /// The kind of a straight move of these letters, if nothing is to be asked on its way: every
    /// axis is there and linear, words are shifted and no more, and the feed is one a minute.
    fn plain_kind(&self, letters: u32) -> Option<MoveKind> {
        let moved = letters & AXIS_LETTERS;
        let is_plain = moved != 0 && moved & !self.linear_letters == 0 && self.open.is_empty();
        if !is_plain || !self.frames.is_plain() || self.polar || self.diameters {
            return None;
        }
        match (self.motion, self.feed) {
            (MotionMode::Rapid, _) => Some(MoveKind::Rapid),
            (MotionMode::Line, Some(feed)) if self.feed_mode == FeedMode::PerMinute => {
                Some(MoveKind::Line { feed_mm_min: feed.mm * self.feed_scale() })
            }
            _ => None,
        }
    }

    /// Makes such a move. It is written where it stays: to copy a position takes longer than to
    /// compute it.
    fn go_plainly(&mut self, block: &Block, kind: MoveKind, out: &mut Output<'_>) {
        out.motions.push(Motion::Move(Move {
            line: out.line,
            n: line_number(block),
            from: self.position_mm,
            to: self.position_mm,
            kind,
            corner: self.corner,
            bound: Bound::Free,
        }));
        let Some(Motion::Move(step)) = out.motions.last_mut() else { return };
        for word in block.words().iter().filter(|word| AXIS_LETTERS & letter_bit(word.letter) != 0)
        {
            let Some(axis) = Axis::from_letter(word.letter) else { continue };
            let zero_mm = if self.absolute { self.frames.offset_mm() } else { &self.position_mm };
            let at_mm = zero_mm[axis] + word.value * self.mm_per_unit;
            (step.to[axis], self.position_mm[axis]) = (at_mm, at_mm);
            self.axes_used.insert(axis);
        }
    }
}

/// G0 to G3.
fn motion_code(value: f64) -> Option<Op> {
    let codes = [Op::Rapid, Op::Line, Op::ArcClockwise, Op::ArcCounterClockwise];
    let number = value as u8;
    codes.get(usize::from(number)).copied().filter(|_| f64::from(number) == value)
}
