//! The block that most programs consist of: a straight move and nothing else.

use crate::gcode::codes::{AXIS_LETTERS, Op};
use crate::gcode::{Block, letter_bit};

use super::execute::{Asked, Executor, MotionMode, Output};

/// Words of which no other can make anything else.
const STRAIGHT_LETTERS: u32 = AXIS_LETTERS | letter_bit(b'G') | letter_bit(b'N') | letter_bit(b'F');

impl Executor<'_> {
    /// Executes a block of axis words, N and F, with no code but G0 or G1, named or in force; tells
    /// whether it is such a block. There is nothing to sort, nothing that could stand in its way,
    /// and no word without a use, so only what is left of [`Executor::run`] is done.
    #[inline]
    pub(super) fn run_straight(&mut self, block: &Block, out: &mut Output<'_>) -> bool {
        let letters = block.letters();
        let has_others = letters & !STRAIGHT_LETTERS != 0;
        // All letters but G stand once, so there is a second G if there are more words.
        let has_more = block.words().len() != letters.count_ones() as usize;
        if has_others || has_more || !out.faults.is_empty() || self.compensation.is_some() {
            return false;
        }
        let mut asked = Asked { motion_before: self.motion, ..Asked::default() };
        let op = match block.word(b'G').map(|word| word.value) {
            Some(0.0) => Some(Op::Rapid),
            Some(1.0) => Some(Op::Line),
            None if matches!(self.motion, MotionMode::Rapid | MotionMode::Line) => None,
            _ => return false,
        };
        self.codes.clear();
        if letters & !AXIS_LETTERS & !letter_bit(b'G') != 0 {
            self.set_free_words(block, asked, out);
        }
        if let Some(op) = op {
            self.set_motion(op, &mut asked);
        }
        self.run_motion(block, asked, out);
        true
    }
}
