//! Which codes a block holds, and whether they can stand together.

use crate::gcode::codes::{
    self, ARC_LETTERS, AXIS_LETTERS, CODES, CORNER_LETTERS, Code, FREE_LETTERS, Group, Length, Op,
    POLAR_LETTERS,
};
use crate::gcode::{Block, COMMA_A, Fault, LATHE_CODES, Word, find_lathe, letter_bit, rules};

use super::execute::{Asked, Executor, MotionMode, motion_of};
use super::offsets::claims_axes;
use super::spline::{LOOK_AHEAD_LETTERS, is_look_ahead};
use super::threading::THREAD_LETTERS;
use super::words::{conflict, exponent, go_together, is_told, unknown, unsupported, unused};

impl MotionMode {
    /// The code that puts it in force, if one does.
    pub(super) fn code(self) -> Option<&'static Code> {
        let puts = |code: &&Code| code.op.and_then(motion_of) == Some(self);
        match self {
            MotionMode::None | MotionMode::Foreign => None,
            _ => CODES.iter().chain(LATHE_CODES).find(puts),
        }
    }
}

impl Executor<'_> {
    /// Finds the codes of a block and what is wrong with them by themselves.
    pub(super) fn check_codes(&mut self, block: &Block, faults: &mut Vec<Fault>) {
        self.classify(block, faults);
    }

    /// What a G or M word means in the dialect.
    pub(super) fn code_of(&self, word: &Word) -> Option<&'static Code> {
        let system = self.dialect.lathe();
        let own = system.and_then(|system| find_lathe(word.letter, word.value, system));
        own.or_else(|| codes::find(word.letter, word.value))
    }

    /// Sorts the codes of a block into the order in which they are executed.
    pub(super) fn classify(&mut self, block: &Block, faults: &mut Vec<Fault>) -> Asked {
        self.codes.clear();
        let mut asked = Asked::default();
        let mut groups = 0_u32;
        for word in block.words() {
            if !matches!(word.letter, b'G' | b'M') {
                continue;
            }
            let Some(code) = self.code_of(word) else {
                if !is_told(word, faults) {
                    faults.push(unknown(word));
                }
                asked.is_foreign = true;
                continue;
            };
            let bit = 1 << code.group as u32;
            if groups & bit != 0 {
                let is_rival =
                    |rival: &Code| rival.group == code.group && !go_together(rival, code);
                if let Some((rival, _)) = self.codes.iter().find(|(code, _)| is_rival(code)) {
                    let is_same = *rival == code;
                    faults.push(conflict(rival, code, word));
                    asked.is_faulty = true;
                    if is_same {
                        continue;
                    }
                }
            }
            groups |= bit;
            match code.op {
                Some(op) if is_look_ahead(op, block) => self.codes.push((code, Op::LookAhead)),
                Some(op) => self.codes.push((code, op)),
                None => {
                    faults.push(unsupported(code, word));
                    asked.is_foreign = true;
                    self.is_shifted |= code.group.moves_coordinates();
                    if code.group == Group::Motion {
                        self.motion = MotionMode::Foreign;
                    }
                }
            }
        }
        asked.is_faulty |= asked.is_foreign || self.resolve_system(block, faults);
        if self.codes.len() > 1 {
            // G80 first: a motion code beside it begins after what it ends.
            self.codes.sort_by_key(|(code, op)| (code.group, *op != Op::MotionOff));
            asked.is_faulty |= self.claims_twice(block, faults);
        }
        asked
    }

    /// Whether the block at hand has led to positions of the machine, which do not shift with the
    /// work: G53, G28, G30.
    pub(super) fn names_machine_positions(&self) -> bool {
        let names = |op: &Op| matches!(op, Op::MachineCoordinates | Op::GoToReference(_));
        self.codes.iter().any(|(_, op)| names(op))
    }

    /// Reports two codes of a block that both make use of its axis words. A motion code beside G28
    /// and G30 only sets its mode.
    fn claims_twice(&self, block: &Block, faults: &mut Vec<Fault>) -> bool {
        let claims = |op: Op| {
            claims_axes(op) || matches!(motion_of(op), Some(mode) if mode != MotionMode::None)
        };
        let mut claiming = self.codes.iter().filter(|(_, op)| claims(*op));
        let (Some((first, op)), Some((second, _))) = (claiming.next(), claiming.next()) else {
            return false;
        };
        // Two of one group have been reported as such.
        let is_known = first.group == second.group;
        let is_mode = matches!(op, Op::GoToReference(_));
        if is_known || is_mode || block.letters() & AXIS_LETTERS == 0 {
            return false;
        }
        let (first, second) = (first.name(), second.name());
        let message = format!("{first} and {second} both make use of the axis words");
        let fault = Fault::block(&rules::AXIS_WORDS_TWICE, block, message);
        faults.push(fault.help("put one of them into a block of its own"));
        true
    }

    /// H0 beside G49, and D0 beside G40: they say the same.
    fn said_twice(&self, block: &Block) -> u32 {
        let letter = |(op, letter): (Op, u8)| {
            let is_zero = block.word(letter).is_some_and(|word| word.value == 0.0);
            let has_code = is_zero && self.codes.iter().any(|(_, other)| *other == op);
            if has_code { letter_bit(letter) } else { 0 }
        };
        letter((Op::LengthOffset(Length::Off), b'H')) | letter((Op::CompensationOff, b'D'))
    }

    /// Reports words of the block that nothing makes use of.
    pub(super) fn has_unused_words(
        &self,
        block: &Block,
        asked: Asked,
        faults: &mut Vec<Fault>,
    ) -> bool {
        let mode = self.codes.iter().rev().find_map(|(_, op)| motion_of(*op));
        let mode = mode.unwrap_or(self.motion);
        if asked.is_foreign || mode == MotionMode::Foreign {
            return false;
        }
        if self.is_lathe() && self.names_twice(block, faults) {
            return true;
        }
        let mut used = FREE_LETTERS | AXIS_LETTERS | POLAR_LETTERS;
        for (code, op) in &self.codes {
            used |= match op {
                Op::LookAhead => code.words | LOOK_AHEAD_LETTERS,
                Op::FurtherSystem => letter_bit(b'P'),
                _ => code.words,
            };
        }
        used |= self.said_twice(block) | self.held_numbers(block);
        match mode {
            MotionMode::Line => used |= self.corner_letters(),
            MotionMode::Arc { .. } => {
                used |= ARC_LETTERS | letter_bit(b'P') | CORNER_LETTERS & !letter_bit(COMMA_A);
            }
            MotionMode::Cycle(cycle) if self.is_thread(cycle, block) => used |= THREAD_LETTERS,
            MotionMode::Cycle(cycle) => used |= cycle.words(),
            MotionMode::Spline(code) => used |= code.words(),
            MotionMode::Follow(follow) => used |= follow.words(),
            MotionMode::Single(single) => used |= single.words(),
            MotionMode::Turn(_) | MotionMode::None | MotionMode::Rapid | MotionMode::Foreign => {}
        }
        if block.letters() & !used == 0 {
            return false;
        }
        for word in block.words().iter().filter(|word| letter_bit(word.letter) & !used != 0) {
            if word.letter != b'E' {
                faults.push(unused(word, mode));
            } else if !is_told(word, faults) {
                faults.push(exponent(word, block));
            }
        }
        true
    }
}
