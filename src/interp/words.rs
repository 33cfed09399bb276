//! Words by themselves: which can stand together, which are refused, what values they may have.

use crate::gcode::codes::{self, Code, Macro, Op};
use crate::gcode::{Block, Call, Fault, Word, foreign, letter_bit, letter_name, rules};

use super::execute::{MotionMode, is_error};
use super::flow::Flow;

/// Whether two codes of one group may stand in one block: mist and flood; and G80 with the motion
/// code that follows on what it ends.
pub(super) fn go_together(a: &Code, b: &Code) -> bool {
    let is_on = |code: &Code| matches!(code.op, Some(Op::MistOn | Op::FloodOn));
    let ends = |code: &Code| code.op == Some(Op::MotionOff);
    a != b && (is_on(a) && is_on(b) || ends(a) || ends(b))
}

/// Two codes of one group, which cannot stand in one block.
pub(super) fn conflict(rival: &Code, code: &Code, word: &Word) -> Fault {
    let group = code.group.name();
    let message = if rival == code {
        format!("{} stands twice in this block", code.name())
    } else {
        format!("{} and {} are both of the {group} group", rival.name(), code.name())
    };
    Fault::word(&rules::MODAL_CONFLICT, word, message)
        .help("leave one of them out, or put it into a block of its own")
}

/// A code that is known and not supported.
pub(super) fn unsupported(code: &Code, word: &Word) -> Fault {
    let message = format!("{} is not supported: {}", code.name(), code.meaning);
    let fault = Fault::word(&rules::UNSUPPORTED_WORD, word, message);
    fault.help("leave it out, or let the CAM program write for a control without it")
}

/// A G or M word that no code is; what it is on other controls, where that is known.
pub(super) fn unknown(word: &Word) -> Fault {
    let fault = |message: String| Fault::word(&rules::UNKNOWN_WORD, word, message);
    if let Some(row) = foreign::find(word.letter, word.value) {
        let (control, meaning) = (row.control, row.meaning);
        return fault(format!("{word} means nothing here; on {control}: {meaning}"))
            .help(row.instead);
    }
    let message = format!("there is no {word} in any dialect known here");
    let alike = codes::CODES.iter().filter(|code| {
        code.letter == word.letter && f64::from(code.tenths / 10) == word.value.trunc()
    });
    let names: Vec<String> = alike.map(Code::name).collect();
    if names.is_empty() {
        return fault(message);
    }
    fault(message).help(format!("there is {}", listed(&names, "and")))
}

/// Whether a fault of the line's text takes in a word.
pub(super) fn is_told(word: &Word, faults: &[Fault]) -> bool {
    faults.iter().any(|fault| fault.start <= word.start && word.end <= fault.end)
}

/// An E word: an exponent, or the extruder of a printer.
pub(super) fn exponent(word: &Word, block: &Block) -> Fault {
    if let Some(before) = block.words().iter().find(|other| other.end == word.start) {
        let message = format!("{before}{word}: numbers have no exponents");
        let fault = Fault::new(&rules::UNSUPPORTED_WORD, before.start, word.end, message);
        return fault.help("write all digits");
    }
    let message = format!("{word} means nothing here; on 3D printers: how far the extruder moves");
    Fault::word(&rules::UNSUPPORTED_WORD, word, message)
        .help("let the CAM program write for a machine tool")
}

/// A word that no code of its block and no mode in force makes use of.
pub(super) fn unused(word: &Word, mode: MotionMode) -> Fault {
    let in_force = mode.code().map_or_else(|| "no motion code".to_owned(), Code::name);
    let message = format!("nothing in this block makes use of {word}: {in_force} is in force");
    let fault = Fault::word(&rules::UNUSED_WORD, word, message);
    let users = codes::CODES.iter().filter(|code| code.words & letter_bit(word.letter) != 0);
    let names: Vec<String> = users.map(Code::name).collect();
    if names.is_empty() {
        return fault.help("leave it out");
    }
    let letter = letter_name(word.letter);
    fault.help(format!("{letter} goes with {}", listed(&names, "or")))
}

/// `G2, G3 or G81`.
fn listed(names: &[String], last: &str) -> String {
    match names.split_last() {
        Some((end, [])) => end.clone(),
        Some((end, others)) => format!("{} {last} {end}", others.join(", ")),
        None => String::new(),
    }
}

/// A G53 that has no straight movement to go with.
pub(super) fn machine_coordinates_alone(block: &Block, faults: &mut Vec<Fault>) {
    let word = block.words().iter().find(|word| word.letter == b'G' && word.value == 53.0);
    if let Some(word) = word {
        let message = "G53 needs a straight movement in its block";
        let fault = Fault::word(&rules::MACHINE_COORDINATES, word, message);
        faults.push(fault.help("write it as G53 G0 and axis words"));
    }
}

/// Whether a word is written with a decimal point, which decides its unit on FANUC.
pub(super) fn has_point(word: &Word, text: &[u8]) -> bool {
    let span = text.get(word.start as usize..word.end as usize);
    span.is_some_and(|text| text.contains(&b'.'))
}

/// What is nearly whole is taken for it (RS274/NGC): expressions are rounded.
pub(super) const WHOLE_WITHIN: f64 = 1e-4;

/// The value of a word that has to be a whole number from 0 to `greatest`.
#[inline]
pub(super) fn whole(word: &Word, greatest: u32, faults: &mut Vec<Fault>) -> Option<u32> {
    let exact = word.value as u32;
    if f64::from(exact) == word.value && exact <= greatest {
        return Some(exact);
    }
    nearly_whole(word, greatest, faults)
}

fn nearly_whole(word: &Word, greatest: u32, faults: &mut Vec<Fault>) -> Option<u32> {
    let nearest = word.value.round();
    if (word.value - nearest).abs() <= WHOLE_WITHIN
        && (0.0..=f64::from(greatest)).contains(&nearest)
    {
        return Some(nearest as u32);
    }
    let letter = letter_name(word.letter);
    let message = format!("{word}: {letter} is a whole number from 0 to {greatest}");
    faults.push(Fault::word(&rules::BAD_VALUE, word, message));
    None
}

/// What a block with GR asks for.
pub(super) fn call_flow(block: &Block, call: &Call, faults: &mut Vec<Fault>) -> Flow {
    let own = call_letters(call.number.is_none());
    if let Some(word) = block.first_of(!own) {
        let message = format!("{word} stands beside a subroutine call");
        let fault = Fault::word(&rules::CALL_ALONE, word, message);
        faults.push(fault.help("put it into a block of its own"));
        return Flow::Next;
    }
    let number = match (call.number, block.word(b'P')) {
        (Some(value), _) => Word { letter: b'P', value, start: call.start, end: call.end },
        (None, Some(word)) => *word,
        (None, None) => {
            let message = "GR does not say which subprogram to run";
            let fault = Fault::call(&rules::MISSING_WORD, call, message);
            faults.push(fault.help("write GR100 or GR P100 for the subprogram O100"));
            return Flow::Next;
        }
    };
    repeated_call(&number, block, faults)
}

/// Where M97 to M99, G65 or G66 leads.
pub(super) fn leads_to(op: Op, block: &Block, faults: &mut Vec<Fault>) -> Flow {
    match op {
        Op::Return => {
            Flow::Return(block.word(b'P').and_then(|word| whole(word, 999_999_999, faults)))
        }
        Op::Macro(Macro::ModalOff) => Flow::ModalMacroEnd,
        Op::Call { by_block: true } => match subprogram_flow(block, faults) {
            Flow::Call { number, repeats } => Flow::CallBlocks { number, repeats },
            flow => flow,
        },
        _ => subprogram_flow(block, faults),
    }
}

/// What M98 asks for, or G65.
pub(super) fn subprogram_flow(block: &Block, faults: &mut Vec<Fault>) -> Flow {
    match block.word(b'P') {
        Some(number) => repeated_call(number, block, faults),
        // What its P is has been said.
        None if faults.iter().any(is_error) => Flow::Next,
        None => {
            let message = "there is no P that says which subprogram to run";
            let fault = Fault::block(&rules::MISSING_WORD, block, message);
            faults.push(fault.help("write P100 for the subprogram O100"));
            Flow::Next
        }
    }
}

fn repeated_call(number: &Word, block: &Block, faults: &mut Vec<Fault>) -> Flow {
    let Some(number) = whole(number, 999_999_999, faults) else { return Flow::Next };
    let repeats = match block.word(b'L') {
        Some(word) => match whole(word, 1_000_000, faults) {
            Some(repeats) => repeats,
            None => return Flow::Next,
        },
        None => 1,
    };
    Flow::Call { number, repeats }
}

/// Letters that may stand beside GR: P only if the number does not follow GR itself.
fn call_letters(takes_p: bool) -> u32 {
    let letters = letter_bit(b'L') | letter_bit(b'N') | letter_bit(b'O');
    if takes_p { letters | letter_bit(b'P') } else { letters }
}
