//! Work coordinate systems: G54 to G59.3, the further ones of G54.1 (G154 on Haas), and G10 L2 and L20,
//! which place them.
//!
//! | | RS274/NGC | dialects `fanuc` |
//! |---|---|---|
//! | `G10 L2 P1` | G54 lies there | the same, under G91 by so much further on |
//! | `G10 L2 P0` | the system in force lies there | all systems are shifted by so much |
//! | `G10 L20 P1` | G54 calls the present position so | G54.1 P1 lies there |

use crate::base::Axis;
use crate::gcode::codes::{AXIS_LETTERS, Code, Op};
use crate::gcode::{Block, Fault, Word, letter_bit, rules};

use super::execute::{Executor, MotionMode};
use super::frames::{FURTHER_SYSTEMS, SYSTEMS};
use super::words::whole;

/// The code of a work coordinate system, counted from 0, as it is written.
fn name(index: usize) -> String {
    match index {
        0..6 => format!("G{}", 54 + index),
        6..SYSTEMS => format!("G59.{}", index - 5),
        _ => format!("G54.1 P{}", index - SYSTEMS + 1),
    }
}

impl Executor<'_> {
    /// Ten times the code of the work coordinate system in force; 541 for all of G54.1.
    pub(super) fn system_code(&self) -> f64 {
        match self.frames.active() as u32 {
            index @ 0..6 => f64::from(540 + 10 * index),
            index if index < SYSTEMS as u32 => f64::from(585 + index),
            _ => 541.0,
        }
    }

    /// P of G54.1 in force, else 0.
    pub(super) fn further_system(&self) -> f64 {
        (self.frames.active() + 1).saturating_sub(SYSTEMS) as f64
    }

    /// Takes P of `G54 P3` for the number of a further system, where nothing else in the block makes
    /// use of it; reports a G54.1 whose P something else makes use of.
    pub(super) fn resolve_system(&mut self, block: &Block, faults: &mut Vec<Fault>) -> bool {
        let Some(word) = block.word(b'P') else { return false };
        let p = letter_bit(b'P');
        let is_system = |op: Op| matches!(op, Op::WorkSystem(_) | Op::FurtherSystem);
        let mut others =
            self.codes.iter().filter(|(code, op)| !is_system(*op) && code.words & p != 0);
        let holds = matches!(self.motion, MotionMode::Cycle(cycle) if cycle.words() & p != 0);
        let cycle = self.motion.code().filter(|_| holds && block.letters() & AXIS_LETTERS != 0);
        let user = others.next().map(|(code, _)| *code).or(cycle).map(Code::name);
        let Some((_, op)) = self.codes.iter_mut().find(|(_, op)| is_system(*op)) else {
            return false;
        };
        if user.is_none() && *op == Op::WorkSystem(0) {
            *op = Op::FurtherSystem;
        }
        let Some(user) = user.filter(|_| *op == Op::FurtherSystem) else { return false };
        let message = format!("{word} is of the work coordinate system and of {user} at once");
        let fault = Fault::word(&rules::REPEATED_WORD, word, message);
        faults.push(fault.help("put one of them into a block of its own"));
        true
    }

    /// G54.1 and G154: P says which.
    pub(super) fn choose_further(&mut self, block: &Block, faults: &mut Vec<Fault>) {
        let Some(word) = block.word(b'P') else {
            let message = "there is no P that says which further work coordinate system is meant";
            let fault = Fault::block(&rules::MISSING_WORD, block, message);
            faults.push(fault.help("write it as G54.1 P1"));
            return;
        };
        if let Some(index) = further(word, faults) {
            self.choose_system(index, block, faults);
        }
    }

    /// Puts a system, counted from 0, in force.
    pub(super) fn choose_system(&mut self, index: usize, block: &Block, faults: &mut Vec<Fault>) {
        if index != self.frames.active() {
            self.frames.choose(index);
        }
        let is_set = self.frames.system(index).is_none_or(|system| system.is_set);
        if is_set || !self.systems_missed.insert(index) {
            return;
        }
        let name = name(index);
        let message = format!("nothing has placed {name}: it is taken at the machine's work zero");
        let fault = Fault::block(&rules::SYSTEM_UNSET, block, message);
        let (kind, number, dialect) = match index.checked_sub(SYSTEMS) {
            None => (2, index, ""),
            Some(further) if self.dialect.is_fanuc() => (20, further, ""),
            Some(further) => (20, further, " and --dialect fanuc"),
        };
        let number = number + 1;
        faults.push(fault.help(format!(
            "place it in the program, as G10 L{kind} P{number} X0 Y0 Z0 in machine coordinates{dialect}"
        )));
    }

    /// G10 L2: where a system lies.
    pub(super) fn place_system(&mut self, number: &Word, block: &Block, faults: &mut Vec<Fault>) {
        let Some(index) = whole(number, SYSTEMS as u32, faults) else { return };
        match (index as usize).checked_sub(1) {
            None if self.dialect.is_fanuc() => self.shift_all(block, faults),
            index => self.put(index.unwrap_or(self.frames.active()), false, block, faults),
        }
    }

    /// G10 L20: what a system calls the present position.
    pub(super) fn name_position(&mut self, number: &Word, block: &Block, faults: &mut Vec<Fault>) {
        if number.value > SYSTEMS as f64 {
            let message =
                format!("{number}: G10 L20 names the position in G54 to G59.3 (P1 to P9)");
            let fault = Fault::word(&rules::BAD_VALUE, number, message);
            faults.push(fault.help("--dialect fanuc places G54.1 by it, as FANUC and Haas do"));
            return;
        }
        let Some(index) = whole(number, SYSTEMS as u32, faults) else { return };
        let index = (index as usize).checked_sub(1).unwrap_or(self.frames.active());
        self.put(index, true, block, faults);
    }

    /// G10 L20 of the dialects fanuc: where a further system lies.
    pub(super) fn place_further(&mut self, number: &Word, block: &Block, faults: &mut Vec<Fault>) {
        if let Some(index) = further(number, faults) {
            self.put(index, false, block, faults);
        }
    }

    /// G10 L2 P0 of the dialects fanuc: a shift of all systems.
    fn shift_all(&mut self, block: &Block, faults: &mut Vec<Fault>) {
        if !self.is_untransformed("G10", block, faults) {
            return;
        }
        for (axis, value) in self.axis_values_of(block, faults) {
            let before = if self.absolute { 0.0 } else { self.frames.external_mm()[axis] };
            self.frames.set_external(axis, before + value);
        }
    }

    /// Sets a system, where it lies or by what it calls the present position.
    fn put(&mut self, index: usize, by_position: bool, block: &Block, faults: &mut Vec<Fault>) {
        if !self.is_untransformed("G10", block, faults) {
            return;
        }
        let Some(mut system) = self.frames.system(index).copied() else { return };
        let values = self.axis_values_of(block, faults);
        system.turn_deg = block.word(b'R').map_or(system.turn_deg, |word| word.value);
        system.is_set = true;
        self.frames.set_system(index, system);
        if by_position {
            let called = self.frames.unshifted(index, &self.position_mm);
            let shift_mm = self.frames.shift_mm();
            let mut wanted = called;
            for (axis, value) in values {
                wanted[axis] = value + shift_mm[axis];
            }
            system.origin_mm = self.frames.origin_moved(index, &called, &wanted);
        } else {
            let adds = self.dialect.is_fanuc() && !self.absolute;
            for (axis, value) in values {
                let before = if adds { system.origin_mm[axis] } else { 0.0 };
                system.origin_mm[axis] = before + value;
            }
        }
        self.frames.set_system(index, system);
    }

    /// The axis words of a block in mm and degrees.
    pub(super) fn axis_values_of(
        &mut self,
        block: &Block,
        faults: &mut Vec<Fault>,
    ) -> Vec<(Axis, f64)> {
        block.words().iter().filter_map(|word| self.axis_word(word, faults)).collect()
    }
}

/// The system, counted from 0, that P of G54.1 names.
fn further(word: &Word, faults: &mut Vec<Fault>) -> Option<usize> {
    let before = faults.len();
    match whole(word, FURTHER_SYSTEMS as u32, faults) {
        Some(number @ 1..) => Some(SYSTEMS + number as usize - 1),
        _ => {
            faults.truncate(before);
            let message = format!("{word}: further systems are P1 to P{FURTHER_SYSTEMS}");
            faults.push(Fault::word(&rules::BAD_VALUE, word, message));
            None
        }
    }
}
