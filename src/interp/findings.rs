//! What has been found wrong so far: counted all, kept up to a bound.

use std::collections::HashSet;

use crate::base::{Axis, CallSite, Diagnostic, Severity, Span};
use crate::gcode::{Block, Fault, rules};

/// Longest text that goes with a diagnostic; of longer lines the surroundings of the fault.
const TEXT_BYTES_MAX: usize = 240;

/// Bytes kept before the fault where a line is cut.
const TEXT_BYTES_BEFORE: usize = 60;

/// The line that a fault lies in, and how the program got there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place<'a> {
    pub line: u32,
    pub text: &'a [u8],
    /// The calls that led here, outermost first.
    pub calls: &'a [CallSite],
    /// The file, where it is not the program's own.
    pub file: Option<&'a str>,
}

/// A place that is kept until the program has been run whole, and the words to mark there.
#[derive(Debug, Default)]
pub(super) struct Kept {
    line: u32,
    text: Vec<u8>,
    calls: Vec<CallSite>,
    file: Option<String>,
    pub span: (u32, u32),
}

impl Kept {
    /// The word of an axis in a block, or all of the block.
    pub fn at_axis(axis: Axis, block: &Block, place: Place<'_>) -> Kept {
        let mut kept = Kept::default();
        kept.keep(axis, block, place);
        kept
    }

    /// A place of which faults are known.
    pub fn of(place: Place<'_>) -> Kept {
        let Place { line, text, calls, file } = place;
        let (text, calls) = (text.to_vec(), calls.to_vec());
        Kept { line, text, calls, file: file.map(str::to_owned), span: (0, 0) }
    }

    /// Takes another place instead.
    pub fn keep(&mut self, axis: Axis, block: &Block, place: Place<'_>) {
        self.line = place.line;
        self.text.clear();
        self.text.extend_from_slice(place.text);
        self.calls.clear();
        self.calls.extend_from_slice(place.calls);
        self.file = place.file.map(str::to_owned);
        self.span = match block.word(axis.letter() as u8) {
            Some(word) => (word.start, word.end),
            None => block.extent(),
        };
    }

    /// As a fault is reported at.
    pub fn place(&self) -> Place<'_> {
        let Kept { line, text, calls, file, .. } = self;
        Place { line: *line, text, calls, file: file.as_deref() }
    }
}

/// Diagnostics of a run.
#[derive(Debug)]
pub(super) struct Findings {
    pub list: Vec<Diagnostic>,
    pub errors: u64,
    pub warnings: u64,
    /// What the program has said to the operator.
    pub messages: u64,
    errors_kept: usize,
    warnings_kept: usize,
    max: usize,
    /// Faults of subprograms and loops that have been said: they would come again with every run.
    said: HashSet<(Option<String>, u32, &'static str, u32)>,
    /// Words of other controls that have been said.
    kinds_said: HashSet<String>,
}

impl Findings {
    /// Keeps at most `max` errors and as many warnings.
    pub fn new(max: usize) -> Findings {
        Findings {
            list: Vec::new(),
            errors: 0,
            warnings: 0,
            messages: 0,
            errors_kept: 0,
            warnings_kept: 0,
            max,
            said: HashSet::new(),
            kinds_said: HashSet::new(),
        }
    }

    /// How many are kept of each kind.
    pub fn max(&self) -> usize {
        self.max
    }

    /// Takes the faults of a line.
    pub fn take(&mut self, faults: &mut Vec<Fault>, place: Place<'_>) {
        for fault in faults.drain(..) {
            self.add(fault, place);
        }
    }

    /// Takes the faults of a line that may be read or run again: each is said once.
    pub fn take_once(&mut self, faults: &mut Vec<Fault>, place: Place<'_>) {
        for fault in faults.drain(..) {
            let file = place.file.map(str::to_owned);
            if self.said.insert((file, place.line, fault.rule.name, fault.start)) {
                self.add(fault, place);
            }
        }
    }

    /// Adds one fault.
    pub fn add(&mut self, fault: Fault, place: Place<'_>) {
        // One of a kind is enough: a printer's program has them on every line.
        if fault.rule == &rules::FOREIGN_WORD && !self.kinds_said.insert(fault.message.clone()) {
            return;
        }
        let (count, kept) = match fault.rule.severity {
            Severity::Error => (&mut self.errors, &mut self.errors_kept),
            Severity::Warning => (&mut self.warnings, &mut self.warnings_kept),
        };
        *count += 1;
        if *kept < self.max {
            *kept += 1;
            self.list.push(diagnostic(fault, place));
        }
    }
}

/// A fault together with its line.
pub(super) fn diagnostic(fault: Fault, place: Place<'_>) -> Diagnostic {
    let (text, text_offset) = surroundings(place.text, fault.start as usize);
    Diagnostic {
        severity: fault.rule.severity,
        rule: fault.rule.name,
        span: Span { line: place.line, start: fault.start, end: fault.end.max(fault.start + 1) },
        text,
        text_offset: text_offset as u32,
        message: fault.message,
        help: fault.help,
        calls: place.calls.to_vec(),
        file: place.file.map(str::to_owned),
    }
}

/// The line as text, byte for byte as long, cut if it is too long.
fn surroundings(line: &[u8], start: usize) -> (String, usize) {
    if line.len() <= TEXT_BYTES_MAX {
        return (as_text(line), 0);
    }
    // Cut between characters: a byte 10xxxxxx goes on with one.
    let is_inside = |at: usize| line.get(at).is_some_and(|byte| byte & 0xc0 == 0x80);
    let mut from = start.saturating_sub(TEXT_BYTES_BEFORE).min(line.len());
    let mut to = (from + TEXT_BYTES_MAX).min(line.len());
    while from > 0 && is_inside(from) {
        from -= 1;
    }
    while is_inside(to) {
        to += 1;
    }
    (as_text(&line[from..to]), from)
}

/// Text in which every byte that is no UTF-8 is one `?`, so that places stay what they are.
fn as_text(bytes: &[u8]) -> String {
    let mut text = String::with_capacity(bytes.len());
    for chunk in bytes.utf8_chunks() {
        text.push_str(chunk.valid());
        text.extend(chunk.invalid().iter().map(|_| '?'));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_keeps_the_places_of_its_bytes() {
        assert_eq!(as_text(b"G1 \xe9X1"), "G1 ?X1");
        let line = "\u{e9}".repeat(1000);
        for start in 0..line.len() {
            let (text, from) = surroundings(line.as_bytes(), start);
            assert!(!text.contains('?') && text.len() <= TEXT_BYTES_MAX + 4);
            assert!(from <= start && start < from + text.len());
        }
    }
}
