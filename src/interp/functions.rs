//! M functions that only say something to the machine: outputs, tools, the spindle's orientation,
//! the user's own. They become events; the axes rest while one happens.
//!
//! M62, M63 and M67 switch in time with the next motion at LinuxCNC; here every motion has come to
//! rest at that time anyway, so they are as M64, M65 and M68.

use crate::base::{EventKind, EventWords};
use crate::gcode::codes::{Function, Op};
use crate::gcode::{Block, Fault, Word, rules};

use super::execute::{Asked, Executor, Output};
use super::feed::Turning;
use super::words::whole;

/// Greatest number of an output.
const OUTPUT_MAX: u32 = 9999;

impl Executor<'_> {
    /// Functions that tell the machine something or ask it, and modes that are saved and restored.
    pub(super) fn tell(&mut self, op: Op, block: &Block, asked: Asked, out: &mut Output<'_>) {
        match op {
            Op::Function(function) => self.function(function, block, out),
            Op::Modes(change) => self.change_modes(change, block, asked, out),
            _ => self.wait_for_input(block, out),
        }
    }

    fn function(&mut self, function: Function, block: &Block, out: &mut Output<'_>) {
        match function {
            Function::SetTool => self.set_loaded(block, out),
            Function::DigitalOutput(code) => switch_output(code, block, out),
            Function::AnalogOutput(code) => set_output(code, block, out),
            Function::SpindleOrient => self.orient(block, out),
            Function::RigidTap => {
                self.cycle.is_rigid = true;
                self.follows_spindle("M29", block, out.faults);
            }
            Function::User => user_function(block, out),
        }
    }

    /// M61: a tool is in the spindle already.
    fn set_loaded(&mut self, block: &Block, out: &mut Output<'_>) {
        let Some(word) = needed(b'Q', "M61", "the tool in the spindle", block, out) else { return };
        if let Some(number) = whole(&word, 99_999, out.faults) {
            self.loaded = Some(number);
            tell(61, &[(b'Q', number.into())], out);
        }
    }

    /// M19: R is the angle, P the way to turn, Q the longest time.
    fn orient(&mut self, block: &Block, out: &mut Output<'_>) {
        if let Some(word) = block.word(b'P').filter(|word| ![0.0, 1.0, 2.0].contains(&word.value)) {
            let message = "P of M19 is 0 (the short way), 1 (clockwise) or 2 (counter-clockwise)";
            out.faults.push(Fault::word(&rules::BAD_VALUE, word, message));
        }
        if let Some(word) = block.word(b'R').filter(|word| !(0.0..=360.0).contains(&word.value)) {
            let message = "R of M19, the angle, is from 0 to 360 degrees";
            out.faults.push(Fault::word(&rules::BAD_VALUE, word, message));
        }
        if let Some(word) = block.word(b'Q').filter(|word| word.value <= 0.0) {
            let message = "Q of M19, the longest time in seconds, is above 0";
            out.faults.push(Fault::word(&rules::BAD_VALUE, word, message));
        }
        self.turning = Turning::Stopped;
        tell_words(19, b"RPQ", block, out);
    }
}

/// M62 to M65.
fn switch_output(code: u8, block: &Block, out: &mut Output<'_>) {
    let name = format!("M{code}");
    let Some(word) = needed(b'P', &name, "the output", block, out) else { return };
    if let Some(number) = whole(&word, OUTPUT_MAX, out.faults) {
        tell(code.into(), &[(b'P', number.into())], out);
    }
}

/// M67 and M68.
fn set_output(code: u8, block: &Block, out: &mut Output<'_>) {
    let name = format!("M{code}");
    let number = needed(b'E', &name, "the output", block, out);
    let value = needed(b'Q', &name, "its value", block, out);
    let (Some(number), Some(value)) = (number, value) else { return };
    if let Some(number) = whole(&number, OUTPUT_MAX, out.faults) {
        tell(code.into(), &[(b'E', number.into()), (b'Q', value.value)], out);
    }
}

/// M100 to M199.
fn user_function(block: &Block, out: &mut Output<'_>) {
    let codes = block.words().iter().filter(|word| word.letter == b'M');
    for word in codes.filter(|word| (100.0..200.0).contains(&word.value)) {
        tell_words(word.value.round() as u16, b"PQ", block, out);
    }
}

/// A word that a function cannot do without.
fn needed(
    letter: u8,
    name: &str,
    meaning: &str,
    block: &Block,
    out: &mut Output<'_>,
) -> Option<Word> {
    let word = block.word(letter).copied();
    if word.is_none() {
        let message = format!("{name} has no {}, {meaning}", char::from(letter));
        out.faults.push(Fault::block(&rules::MISSING_WORD, block, message));
    }
    word
}

fn tell_words(code: u16, letters: &[u8], block: &Block, out: &mut Output<'_>) {
    let found = letters.iter().filter_map(|letter| block.word(*letter));
    let words: Vec<(u8, f64)> = found.map(|word| (word.letter, word.value)).collect();
    tell(code, &words, out);
}

fn tell(code: u16, list: &[(u8, f64)], out: &mut Output<'_>) {
    if list.is_empty() {
        out.function(code);
        return;
    }
    let mut words = EventWords::default();
    for (letter, value) in list {
        words.push(*letter, *value);
    }
    out.event(EventKind::Function { code, words });
}
