//! `--lenient`: words that other controls need and that mean nothing here are left out, each kind
//! with one warning. Nothing that moves, offsets or turns something is among them: a line that
//! does more than these words say stays as it is, with its errors.

use crate::gcode::{Block, Fault, Word, letter_bit, letter_set, rules};

/// Letters of axes that printers' limits (M201 to M205) take.
const LIMIT_LETTERS: u32 = letter_set("XYZ");

/// Codes of printers and senders: first and last number, and what they do there.
const FOREIGN: &[(u8, u16, u16, &str)] = &[
    (b'G', 29, 29, "measures a printer's bed"),
    (b'M', 10, 11, "clamps an axis"),
    (b'M', 40, 45, "chooses a gear of the spindle"),
    (b'M', 73, 73, "tells a printer's progress"),
    (b'M', 82, 83, "says how E words count"),
    (b'M', 84, 84, "lets the motors go"),
    (b'M', 104, 109, "sets a printer's temperature or fan"),
    (b'M', 110, 111, "is of the link to a printer"),
    (b'M', 113, 113, "is of the link to a printer"),
    (b'M', 114, 115, "asks a printer for its position or version"),
    (b'M', 117, 118, "shows a text"),
    (b'M', 140, 141, "sets a printer's temperature"),
    (b'M', 149, 149, "chooses the unit of temperatures"),
    (b'M', 155, 155, "reports temperatures"),
    (b'M', 190, 191, "waits for a printer's temperature"),
    (b'M', 201, 205, "sets limits of a printer"),
    (b'M', 220, 220, "puts speeds back to 100 percent"),
    (b'M', 221, 221, "sets a printer's flow"),
    (b'M', 301, 304, "sets a printer's temperature control"),
    (b'M', 300, 300, "sounds a tone"),
    (b'M', 400, 400, "waits until motion has ended"),
    (b'M', 486, 486, "names a printed object"),
    (b'M', 500, 503, "stores a printer's settings"),
    (b'M', 572, 572, "sets pressure advance"),
    (b'M', 900, 900, "sets pressure advance"),
];

/// What is said of a line that words cannot be read from: `$…`, or the text of M117. It is left out.
pub(super) fn foreign_line(line: &[u8]) -> Option<Fault> {
    let start = line.iter().take_while(|byte| byte.is_ascii_whitespace()).count();
    let text = line.get(start..).unwrap_or_default();
    let message = match text {
        [b'$', b'J' | b'j', ..] => return None,
        [b'$', ..] => "lines that begin with $ are for the sender of another control: left out",
        _ => {
            let head: Vec<u8> = text.iter().take(5).map(u8::to_ascii_uppercase).collect();
            let digit_follows = head.get(4).is_some_and(u8::is_ascii_digit);
            if !matches!(head.get(..4), Some(b"M117" | b"M118")) || digit_follows {
                return None;
            }
            "M117 and M118 show a text on other controls: left out"
        }
    };
    Some(Fault::new(&rules::FOREIGN_WORD, start as u32, line.len() as u32, message))
}

/// Leaves out what is foreign on a line.
pub(super) fn leave_out(block: &mut Block, faults: &mut Vec<Fault>) {
    let foreign = block.words().iter().find_map(|word| Some((*word, meaning(word, block)?)));
    if let Some((word, meaning)) = foreign {
        let codes = block.words().iter().filter(|word| matches!(word.letter, b'G' | b'M')).count();
        let is_limit = word.letter == b'M' && (201.0..=205.0).contains(&word.value);
        let axes = crate::gcode::codes::AXIS_LETTERS & if is_limit { !LIMIT_LETTERS } else { !0 };
        if codes == 1 && block.letters() & axes == 0 {
            let message = format!("{word} {meaning} on other controls: left out");
            faults.push(Fault::word(&rules::FOREIGN_WORD, &word, message));
            block.clear();
        }
        return;
    }
    let takes_e = block.words().iter().any(|word| {
        word.letter == b'M' && matches!(word.value, 67.0 | 68.0)
            || word.letter == b'G' && matches!(word.value, 65.0 | 76.0)
    });
    let Some(word) = block.word(b'E').copied().filter(|_| !takes_e) else { return };
    let message = "E words are of printers, and move nothing here: left out";
    faults.push(Fault::word(&rules::FOREIGN_WORD, &word, message));
    block.replace(letter_bit(b'E'), []);
    // G92 E0 has set nothing else.
    let is_set = block.words().iter().any(|word| word.letter == b'G' && word.value == 92.0);
    if is_set && block.letters() & !letter_set("GN") == 0 && block.words().len() <= 2 {
        block.clear();
    }
}

/// What a word does on other controls, if it is one of theirs.
fn meaning(word: &Word, block: &Block) -> Option<&'static str> {
    let (.., meaning) = FOREIGN.iter().find(|(letter, first, last, _)| {
        *letter == word.letter && (f64::from(*first)..=f64::from(*last)).contains(&word.value)
    })?;
    // Without words M73 saves modes.
    let is_other = word.value == 73.0 && block.letters() & letter_set("PRQS") == 0;
    // Any other share would change every feed.
    let is_slower = word.value == 220.0 && block.word(b'S').is_none_or(|word| word.value != 100.0);
    (word.value.fract() == 0.0 && !is_other && !is_slower).then_some(meaning)
}
