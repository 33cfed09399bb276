//! One line → one block.
//!
//! The first byte of each item decides what it is; an item that is wrong is reported and, where
//! the next one can be found, read over, so that one pass finds every fault of the line.

use std::io::{self, Read};

use nom::Parser;
use nom::bytes::complete::{tag, take_till};
use nom::combinator::opt;
use nom::sequence::delimited;

use super::block::{
    Block, COMMA_A, COMMA_C, COMMA_R, Call, Message, MessageKind, Word, letter_name,
};
use super::codes::nearest;
use super::control::{
    Assignment, Control, Label, Statement, after_label, computed_call, macro_b, stands_alone,
};
use super::expr::{Formula, NoExpression, Reader, after_word};
use super::fault::Fault;
use super::lines::{LINE_BYTES_MAX, Line, Lines};
use super::number::{NUMBER_MAX, Parsed, SyntaxError, blanks, is_blank, number};
use super::plain::plain_words;
use super::stray::{self, is_control, not_text};
use super::{foreign, rules};

/// Reads a line into a block, and what is wrong with it into `faults`.
///
/// Whoever goes on with a block that has faults has all words that could be read.
pub fn parse(line: &[u8], block: &mut Block, faults: &mut Vec<Fault>) {
    block.clear();
    let words = plain_words(line, block);
    parse_behind(words.end, line, block, faults);
}

/// Reads the next line of a text as [`parse`] does; none at the end of the text. A line that is too
/// long holds nothing but a fault.
///
/// # Errors
/// When the text cannot be read.
pub fn parse_next<'l>(
    lines: &'l mut Lines<impl Read>,
    block: &mut Block,
    faults: &mut Vec<Fault>,
) -> io::Result<Option<Line<'l>>> {
    block.clear();
    // Most lines are plain words up to their end, which then need not be looked for: that would be a
    // tenth of a check.
    let ahead = lines.ahead()?;
    let words = plain_words(ahead, block);
    let is_cut = words.next == ahead.len();
    let Some(line) = lines.next_line_behind(if is_cut { 0 } else { words.end })? else {
        block.clear();
        return Ok(None);
    };
    if line.too_long {
        block.clear();
        let message = format!("line {} is longer than {LINE_BYTES_MAX} bytes", line.number);
        let fault = Fault::new(&rules::LINE_TOO_LONG, 0, 1, message);
        faults.push(fault.help("NC programs have short lines: is this the right file?"));
    } else if is_cut {
        parse(line.bytes, block, faults);
    } else if words.end < line.bytes.len() {
        parse_behind(words.end, line.bytes, block, faults);
    }
    Ok(Some(line))
}

/// Reads what follows the words of a line up to a place.
fn parse_behind(end: usize, line: &[u8], block: &mut Block, faults: &mut Vec<Fault>) {
    let faults_before = faults.len();
    let rest = line.get(end..).unwrap_or_default();
    let mut parser = Parsing { line, rest, block, faults, words_end: None };
    while let Some(&byte) = parser.rest.first() {
        if parser.item(byte).is_none() {
            break;
        }
    }
    if !block.is_plain() {
        stands_alone(block, faults);
    }
    if faults.len() > faults_before {
        // Of a line that is no text nothing else is worth saying.
        if let Some(at) = line.iter().position(|byte| is_control(*byte)) {
            block.clear();
            faults.truncate(faults_before);
            faults.push(not_text(line, at));
        } else if let Some(fault) = foreign::language(line) {
            faults.truncate(faults_before);
            faults.push(fault);
        } else if faults.len() > faults_before + 1 {
            stray::join_texts(line, faults, faults_before);
        }
    }
}

/// How far into a line its parser is. `None` from a method: the rest of the line is given up.
struct Parsing<'a> {
    line: &'a [u8],
    rest: &'a [u8],
    block: &'a mut Block,
    faults: &'a mut Vec<Fault>,
    /// What has ended the words of the line (`*` or `%`), after which only comments may stand.
    words_end: Option<u8>,
}

impl<'a> Parsing<'a> {
    fn item(&mut self, byte: u8) -> Option<()> {
        match byte {
            b'A'..=b'Z' | b'a'..=b'z' | b':' | b'@' | b'^' if self.words_end.is_none() => {
                self.word(byte)
            }
            b'$' if self.words_end.is_none() && !self.block.words().is_empty() => self.word(byte),
            b',' if self.words_end.is_none() => match self.comma_letter() {
                Some((letter, length)) => self.comma_word(letter, length),
                None => self.stray(byte),
            },
            b' ' | b'\t' => {
                self.rest = blanks(self.rest).ok()?.0;
                Some(())
            }
            b'(' => self.comment(),
            b'#' if self.words_end.is_none() => self.assignment(),
            b';' => self.line_comment(),
            b'*' if self.words_end.is_none() => self.end_words(byte),
            b'%' if self.block.is_empty() && self.words_end.is_none() => {
                self.block.percent = true;
                self.end_words(byte)
            }
            b'<' if self.block.is_empty() && self.words_end.is_none() => self.title(byte),
            b'/' if self.is_at_beginning() && !self.block.delete => {
                self.block.delete = true;
                // FANUC has nine such switches: here they are one.
                let is_switch =
                    matches!(self.rest, [_, b'1'..=b'9', next, ..] if !next.is_ascii_digit());
                self.step(if is_switch { 2 } else { 1 });
                Some(())
            }
            _ => self.stray(byte),
        }
    }

    /// `<PART>` and `<O1001>`, as newer FANUC controls begin a program, are O<PART> and O1001.
    fn title(&mut self, byte: u8) -> Option<()> {
        let start = self.at();
        let end = self.rest.iter().position(|byte| *byte == b'>');
        let after = end.and_then(|end| self.rest.get(end + 1..));
        let next = after.map(|after| after.iter().find(|byte| !is_blank(**byte)));
        if !matches!(next, Some(None | Some(b'(' | b';'))) {
            return self.stray(byte);
        }
        let name = self.read(start, |reader| reader.name())?;
        let digits = name.strip_prefix('o').filter(|digits| digits.len() <= 8);
        if let Some(value) = digits.and_then(|digits| digits.parse::<u32>().ok()) {
            self.push(Word { letter: b'O', value: value.into(), start, end: self.at() });
            return Some(());
        }
        self.statement(Label::Name(name.into()), Control::Title, start)
    }

    /// Whether nothing but an N word has been read.
    fn is_at_beginning(&self) -> bool {
        let is_numbered = matches!(self.block.words(), [word] if word.letter == b'N');
        self.block.is_empty() || is_numbered
    }

    fn at(&self) -> u32 {
        (self.line.len() - self.rest.len()) as u32
    }

    fn step(&mut self, count: usize) {
        self.rest = self.rest.get(count..).unwrap_or_default();
    }

    fn end_words(&mut self, by: u8) -> Option<()> {
        self.words_end = Some(by);
        self.step(1);
        Some(())
    }

    fn word(&mut self, byte: u8) -> Option<()> {
        let start = self.at();
        let letter = if byte == b':' { b'O' } else { byte.to_ascii_uppercase() };
        if byte.eq_ignore_ascii_case(&b'O') && self.goes_on_with_letter(start) {
            return Some(());
        }
        self.step(1);
        if letter == b'G' && !matches!(self.rest.first(), Some(b'0'..=b'9')) {
            let (rest, r) = opt((blanks, tag_r)).parse(self.rest).ok()?;
            if r.is_some() {
                self.rest = rest;
                return self.call(start);
            }
        }
        match self.number() {
            Ok(_) if matches!(self.rest.first(), Some(b'O' | b'o')) && self.has_letter(start) => {
                Some(())
            }
            Ok(value) => {
                let value = if matches!(letter, b'G' | b'M') { nearest(value) } else { value };
                let word = Word { letter, value, start, end: self.at() };
                if letter == b'O' && self.keyword_follows() {
                    self.is_label(&word);
                    return self.o_word(Label::Number(label_number(value)), start);
                }
                self.push(word);
                Some(())
            }
            Err(SyntaxError::TooLarge) => self.no_number(letter, start, SyntaxError::TooLarge),
            Err(error) => self.no_plain_number(letter, start, error),
        }
    }

    /// The letter of a word that a comma begins, and the bytes up to its value.
    fn comma_letter(&self) -> Option<(u8, usize)> {
        let after = self.rest.get(1..)?;
        let blanks = after.iter().take_while(|byte| is_blank(**byte)).count();
        let letter = match after.get(blanks)?.to_ascii_uppercase() {
            b'A' => COMMA_A,
            b'C' => COMMA_C,
            b'R' => COMMA_R,
            _ => return None,
        };
        Some((letter, blanks + 2))
    }

    /// `,A30`, `,C2`, `,R5`
    fn comma_word(&mut self, letter: u8, length: usize) -> Option<()> {
        let start = self.at();
        self.step(length);
        match self.number() {
            Ok(value) => {
                self.push(Word { letter, value, start, end: self.at() });
                Some(())
            }
            Err(SyntaxError::NoNumber | SyntaxError::Other) if self.expression_follows() => {
                let formula = self.read(start, |reader| reader.value())?;
                self.expression_word(letter, start, formula)
            }
            Err(error) => self.no_number(letter, start, error),
        }
    }

    fn push(&mut self, word: Word) -> bool {
        let Err(word) = self.block.push(word) else { return true };
        if matches!(word.letter, b'I'..=b'K') && self.block.is_macro_call() {
            self.block.push_again(word);
            return true;
        }
        let message = format!("{} stands twice in this block", letter_name(word.letter));
        let help = "leave one of them out, or put it into a block of its own";
        self.faults.push(Fault::word(&rules::REPEATED_WORD, &word, message).help(help));
        false
    }

    /// Lets a reader of expressions go on from here; what it cannot read is reported.
    fn read<T>(
        &mut self,
        start: u32,
        read: impl FnOnce(&mut Reader<'a, '_>) -> Result<T, NoExpression>,
    ) -> Option<T> {
        let rest = self.rest;
        let mut reader = Reader::new(rest, &mut self.block.extras().code);
        let result = read(&mut reader);
        self.rest = reader.rest;
        match result {
            Ok(value) => Some(value),
            Err(error) => {
                let at = (self.line.len() - error.left) as u32;
                if self.line.get(at as usize) == Some(&b',') {
                    self.faults.push(stray::comma(self.line, at as usize).0);
                    return None;
                }
                let rest = self.line.get(at as usize..).unwrap_or_default();
                let byte = rest.first().copied().unwrap_or_default();
                let length = match byte {
                    b'A'..=b'Z' | b'a'..=b'z' => {
                        rest.iter().take_while(|byte| byte.is_ascii_alphabetic()).count()
                    }
                    _ => stray::number_length(rest).max(1),
                };
                let end = at + length as u32;
                let fault = Fault::new(&rules::EXPRESSION, start.min(at), end, error.message);
                self.faults.push(match error.help.or_else(|| stray::operator_help(byte)) {
                    Some(help) => fault.help(help),
                    None => fault,
                });
                None
            }
        }
    }

    /// A letter that no number follows: its value is an expression, or it begins a statement.
    fn no_plain_number(&mut self, letter: u8, start: u32, error: SyntaxError) -> Option<()> {
        if self.expression_follows() {
            let formula = self.read(start, |reader| reader.value())?;
            return self.expression_word(letter, start, formula);
        }
        if letter == b'O' && after_word(self.rest, "<").is_some() {
            let label = self.read(start, |reader| {
                reader.peek();
                reader.name()
            })?;
            return self.o_word(Label::Name(label.into()), start);
        }
        let line = self.line;
        let from = line.get(start as usize..).unwrap_or_default();
        let mut code = Vec::new();
        if matches!(letter, b'I' | b'W' | b'G' | b'D' | b'E')
            && macro_b(&mut Reader::new(from, &mut code)).is_some()
        {
            self.rest = from;
            let read = self.read(start, |reader| match macro_b(reader) {
                Some(result) => result,
                None => reader.fail("a statement is missing here"),
            });
            let (number, control) = read.or_else(|| self.broken_statement())?;
            return self.statement(Label::Number(number), control, start);
        }
        self.no_number(letter, start, error)
    }

    /// Whether a value that is no plain number comes next: `#`, `[` or a function, with one sign
    /// at most.
    fn expression_follows(&mut self) -> bool {
        let mut code = Vec::new();
        let mut reader = Reader::new(self.rest, &mut code);
        let _ = reader.takes(b'-') || reader.takes(b'+');
        matches!(reader.peek(), Some(b'#' | b'[')) || reader.is_at_function()
    }

    fn expression_word(&mut self, letter: u8, start: u32, formula: Formula) -> Option<()> {
        if letter == b'O' {
            let read = self.read(start, |reader| match computed_call(formula, reader) {
                Some(result) => result,
                None => reader.fail("only a call can compute the number of its subprogram"),
            });
            let control = read.or_else(|| self.broken_statement())?;
            return self.statement(Label::Number(0), control, start);
        }
        // A number that is written in brackets is as good as one without.
        let word = Word { letter, value: 0.0, start, end: self.at() };
        if self.push(word) {
            self.block.last_is(formula);
        }
        Some(())
    }

    fn o_word(&mut self, label: Label, start: u32) -> Option<()> {
        let next = self.rest.iter().find(|byte| !is_blank(**byte));
        if matches!((&label, next), (Label::Name(_), None | Some(b'(' | b';'))) {
            return self.statement(label, Control::Title, start);
        }
        let read = self.read(start, |reader| match after_label(reader) {
            Some(result) => result,
            None => reader.fail("a keyword is missing here: sub, call, if, while, repeat …"),
        });
        let control = read.or_else(|| self.broken_statement())?;
        self.statement(label, control, start)
    }

    /// Reports a label that is no whole number.
    fn is_label(&mut self, word: &Word) {
        if word.value.fract() != 0.0 || word.value < 0.0 {
            let message = format!("{word}: a label is a whole number, or a name in < >");
            self.faults.push(Fault::word(&rules::BAD_VALUE, word, message));
        }
    }

    fn broken_statement<T>(&mut self) -> Option<T> {
        self.block.extras().is_broken = true;
        None
    }

    fn statement(&mut self, label: Label, control: Control, start: u32) -> Option<()> {
        let end = self.at();
        if self.block.statement().is_some() {
            let message = "a second statement in one block";
            self.faults.push(Fault::new(&rules::CALL_ALONE, start, end, message));
            return None;
        }
        self.block.extras().statement = Some(Statement { label, control, start, end });
        Some(())
    }

    /// `#1=…`
    fn assignment(&mut self) -> Option<()> {
        let start = self.at();
        let assignment = self.read(start, |reader| {
            let (number, target) = reader.parameter()?;
            if !reader.takes(b'=') {
                return reader.fail("= and the parameter's value are missing here");
            }
            let value = reader.bare()?;
            Ok(Assignment { number, target, value, start, end: 0 })
        })?;
        let end = self.at();
        self.block.extras().assignments.push(Assignment { end, ..assignment });
        Some(())
    }

    fn number(&mut self) -> Result<f64, SyntaxError> {
        match number(self.rest) {
            Ok((rest, value)) => {
                self.rest = rest;
                Ok(value)
            }
            Err(nom::Err::Error(error) | nom::Err::Failure(error)) => Err(error),
            Err(nom::Err::Incomplete(_)) => Err(SyntaxError::Other),
        }
    }

    fn call(&mut self, start: u32) -> Option<()> {
        let number = match self.number() {
            Ok(value) => Some(value),
            Err(SyntaxError::TooLarge) => {
                return self.no_number(b'R', start, SyntaxError::TooLarge);
            }
            Err(SyntaxError::NoNumber | SyntaxError::Other) => None,
        };
        let call = Call { number, start, end: self.at() };
        if self.block.call.is_some() {
            let message = "a second subroutine call in one block";
            self.faults.push(Fault::call(&rules::CALL_ALONE, &call, message));
        }
        self.block.call = Some(call);
        Some(())
    }

    /// Reports a letter that no number follows.
    fn no_number(&mut self, letter: u8, start: u32, error: SyntaxError) -> Option<()> {
        if self.looks_alike(start) || self.has_letter(start) {
            return Some(());
        }
        if let [b',', b'0'..=b'9', ..] = self.rest {
            return self.stray(b',');
        }
        let letter = letter_name(letter);
        let after_blanks = self.rest.iter().position(|byte| !is_blank(*byte));
        let next = after_blanks.and_then(|at| self.rest.get(at).copied());
        if error != SyntaxError::TooLarge && !matches!(next, Some(b'-' | b'+' | b'.' | b'0'..=b'9'))
        {
            let message = format!("{letter} is not followed by a number");
            let fault = Fault::new(&rules::MISSING_NUMBER, start, self.at(), message);
            self.faults.push(fault.help("write it, as X10; a remark stands in ( ) or after ;"));
            return Some(());
        }
        self.step(after_blanks.unwrap_or_default());
        self.step(stray::number_length(self.rest));
        let (message, help) = if error == SyntaxError::TooLarge {
            let message = format!("the number of this {letter} word is beyond {NUMBER_MAX}");
            (message, "no machine goes that far: is a point missing?")
        } else {
            let message = format!("{letter} is followed by something that is no number");
            (message, "one sign at most, digits, one point at most")
        };
        let fault = Fault::new(&rules::BAD_NUMBER, start, self.at(), message);
        self.faults.push(fault.help(help));
        Some(())
    }

    /// Whether two letters follow, as in `O100 sub`: words have one.
    fn keyword_follows(&self) -> bool {
        let mut bytes = self.rest.iter().copied().skip_while(|byte| is_blank(*byte));
        let letters = (bytes.next(), bytes.next());
        matches!(letters, (Some(a), Some(b)) if a.is_ascii_alphabetic() && b.is_ascii_alphabetic())
            && !matches!(letters, (Some(b'g' | b'G'), Some(b'r' | b'R')))
    }

    fn comment(&mut self) -> Option<()> {
        let start = self.at();
        let closed =
            delimited(tag("("), take_till(|byte| byte == b')'), tag::<_, _, SyntaxError>(")"))
                .parse(self.rest);
        match closed {
            Ok((rest, text)) => {
                self.rest = rest;
                if text.contains(&b'(') {
                    let (fault, length) = stray::nested_comment(self.line, start as usize);
                    self.rest = self.line.get(start as usize + length..).unwrap_or_default();
                    self.faults.push(fault);
                } else if matches!(
                    text.first(),
                    Some(b'M' | b'm' | b'D' | b'd' | b'P' | b'p' | b' ')
                ) {
                    self.message(text, start + 1);
                }
                self.text_only(text, start + 1)
            }
            Err(_) => {
                let text = self.rest;
                self.text_only(text, start)?;
                let end = self.line.len() as u32;
                let fault = Fault::new(&rules::OPEN_COMMENT, start, end, "this comment has no end");
                self.faults.push(fault.help("close it by ) on the same line"));
                None
            }
        }
    }

    /// Takes a comment that says something to the operator.
    fn message(&mut self, comment: &[u8], start: u32) {
        let kinds = [
            ("MSG,", MessageKind::Message),
            ("DEBUG,", MessageKind::Debug),
            ("PRINT,", MessageKind::Print),
        ];
        for (word, kind) in kinds {
            if let Some(text) = after_word(comment, word) {
                let end = start + comment.len() as u32;
                let message = Message { kind, start: end - text.len() as u32, end };
                self.block.extras().messages.push(message);
            }
        }
    }

    fn line_comment(&mut self) -> Option<()> {
        let (text, start) = (self.rest, self.at());
        self.rest = &[];
        self.text_only(text, start)
    }

    /// Reports a control character in a comment that begins at byte `start`.
    fn text_only(&mut self, text: &'a [u8], start: u32) -> Option<()> {
        match text.iter().position(|byte| is_control(*byte)) {
            None => Some(()),
            Some(at) => {
                self.faults.push(not_text(self.line, start as usize + at));
                None
            }
        }
    }

    /// Reports an O that follows the number of another word at once.
    fn goes_on_with_letter(&mut self, start: u32) -> bool {
        let is_before = |word: &&Word| word.end == start && word.letter != b'O';
        let before = self.block.words().last().filter(is_before);
        before.map(|word| word.start).is_some_and(|start| self.has_letter(start))
    }

    /// Reports a letter that stands for a digit, in a word that begins at byte `start`.
    fn has_letter(&mut self, start: u32) -> bool {
        let found = stray::letter_for_digit(self.line, start as usize, self.at() as usize);
        let Some((fault, length)) = found else { return false };
        self.faults.push(fault);
        self.step(length);
        true
    }

    /// Reports a character that stands for another, in a word that begins at byte `start`.
    fn looks_alike(&mut self, start: u32) -> bool {
        let found = stray::look_alike_fault(self.line, start as usize, self.at() as usize);
        let Some((fault, length)) = found else { return false };
        self.faults.push(fault);
        self.step(length);
        true
    }

    /// Reports a byte at which no item can begin.
    fn stray(&mut self, byte: u8) -> Option<()> {
        let at = self.at();
        if is_control(byte) {
            self.faults.push(not_text(self.line, at as usize));
            return None;
        }
        if byte == b',' {
            let (fault, length) = stray::comma(self.line, at as usize);
            self.faults.push(fault);
            self.step(length);
            return Some(());
        }
        if self.looks_alike(at) {
            return Some(());
        }
        let fault = stray::fault(self.line, at as usize, self.words_end);
        let length = (fault.end - at) as usize;
        let goes_on = fault.rule == &rules::BAD_NUMBER;
        self.faults.push(fault);
        self.step(length);
        goes_on.then_some(())
    }
}

/// The number of an O word; beyond all others if it is none.
fn label_number(value: f64) -> u32 {
    if value.fract() == 0.0 && value >= 0.0 { value as u32 } else { u32::MAX }
}

/// The R of `GR`, in either case.
fn tag_r(input: &[u8]) -> Parsed<'_, &[u8]> {
    nom::bytes::complete::tag_no_case("R").parse(input)
}

#[cfg(test)]
mod tests;
