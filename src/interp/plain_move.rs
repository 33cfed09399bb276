//! The block that most programs consist of: a straight move or an arc, and nothing else.

use crate::gcode::codes::{ARC_LETTERS, AXIS_LETTERS, Op};
use crate::gcode::{Block, letter_bit};

use super::execute::{Asked, Executor, MotionMode, Output, motion_of};
use super::feed::LABEL_MAX;
use super::words::whole;

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
        // All letters but G stand once, so there is a second G if there are more words.
        let has_more = block.words().len() != letters.count_ones() as usize;
        let is_within = self.compensation.is_some()
            || self.spline.nurbs.is_some()
            || self.held_move.is_some()
            || self.is_lathe();
        if has_more || is_within || !out.faults.is_empty() {
            return false;
        }
        let mut asked = Asked {
            motion_before: self.motion,
            mm_per_unit_before: self.mm_per_unit,
            ..Asked::default()
        };
        let op = match block.word(b'G').map(|word| word.value) {
            Some(0.0) => Some(Op::Rapid),
            Some(1.0) => Some(Op::Line),
            Some(2.0) => Some(Op::ArcClockwise),
            Some(3.0) => Some(Op::ArcCounterClockwise),
            Some(_) => return false,
            None => None,
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
            whole(word, LABEL_MAX, out.faults);
        }
        if let Some(op) = op {
            self.set_motion(op, &mut asked);
        }
        self.run_motion(block, &mut asked, out);
        true
    }
}
