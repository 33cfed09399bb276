//! One line → one block.
//!
//! The first byte of each item decides what it is; an item that is wrong is reported and, where
//! the next one can be found, read over, so that one pass finds every fault of the line.

use nom::Parser;
use nom::bytes::complete::{tag, take_till};
use nom::combinator::opt;
use nom::sequence::delimited;

use super::block::{Block, Call, Message, MessageKind, Word};
use super::control::{Assignment, Control, Label, Statement, after_label, macro_b, stands_alone};
use super::expr::{Formula, NoExpression, Reader, after_word};
use super::fault::Fault;
use super::number::{NUMBER_MAX, Parsed, SyntaxError, blanks, is_blank, number};
use super::stray::{self, is_control, not_text};
use super::{foreign, rules};

/// Reads a line into a block, and what is wrong with it into `faults`.
///
/// Whoever goes on with a block that has faults has all words that could be read.
pub fn parse(line: &[u8], block: &mut Block, faults: &mut Vec<Fault>) {
    block.clear();
    let faults_before = faults.len();
    let mut parser = Parsing { line, rest: line, block, faults, words_end: None };
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
            b'A'..=b'Z' | b'a'..=b'z' | b':' if self.words_end.is_none() => self.word(byte),
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
            b'/' if self.block.is_empty() && !self.block.delete => {
                self.block.delete = true;
                self.step(1);
                Some(())
            }
            _ => self.stray(byte),
        }
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

    fn push(&mut self, word: Word) -> bool {
        let Err(word) = self.block.push(word) else { return true };
        let message = format!("{} stands twice in this block", char::from(word.letter));
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
                let fault = Fault::new(&rules::EXPRESSION, start.min(at), at + 1, error.message);
                let byte = self.line.get(at as usize).copied().unwrap_or_default();
                self.faults.push(match stray::operator_help(byte) {
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
            return self.o_word(Label::Name(label), start);
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
        if matches!(letter, b'O' | b'N') {
            let message =
                format!("the number of an {} word cannot be an expression", char::from(letter));
            self.faults.push(Fault::new(&rules::UNSUPPORTED_WORD, start, self.at(), message));
            return None;
        }
        // A number that is written in brackets is as good as one without.
        let word = Word { letter, value: 0.0, start, end: self.at() };
        if self.push(word) {
            self.block.last_is(formula);
        }
        Some(())
    }

    fn o_word(&mut self, label: Label, start: u32) -> Option<()> {
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
        let letter = char::from(letter);
        let after_blanks = self.rest.iter().position(|byte| !is_blank(*byte));
        let next = after_blanks.and_then(|at| self.rest.get(at).copied());
        let end = self.at();
        let fault = match (error, next) {
            (SyntaxError::TooLarge, _) => {
                let message = format!("the number of this {letter} word is beyond {NUMBER_MAX}");
                self.faults.push(Fault::new(&rules::BAD_NUMBER, start, end, message));
                return None;
            }
            (_, Some(b'-' | b'+' | b'.' | b'0'..=b'9')) => {
                let message = format!("{letter} is followed by something that is no number");
                Fault::new(&rules::BAD_NUMBER, start, end + 1, message)
                    .help("one sign at most, digits, one point at most")
            }
            _ => {
                let message = format!("{letter} is not followed by a number");
                let fault = Fault::new(&rules::MISSING_NUMBER, start, end, message);
                self.faults.push(fault.help("write it, as X10; a remark stands in ( ) or after ;"));
                return Some(());
            }
        };
        self.faults.push(fault);
        None
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
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn read(line: &[u8]) -> (Block, Vec<&'static str>) {
        let (mut block, mut faults) = (Block::default(), Vec::new());
        parse(line, &mut block, &mut faults);
        (block, faults.iter().map(|fault| fault.rule.name).collect())
    }

    fn check(line: &str, canonical: &str, faults: &[&str]) {
        let (block, found) = read(line.as_bytes());
        assert_eq!((block.to_string().as_str(), found.as_slice()), (canonical, faults), "{line}");
    }

    #[test]
    fn lines_become_words() {
        check("", "", &[]);
        check("N001 G00 X2.0 Y0.0 F1000 *", "N1 G0 X2 Y0 F1000", &[]);
        check("n10g1x1y-.5;end", "N10 G1 X1 Y-0.5", &[]);
        check("g 0 x +0. 12 34 y 7", "G0 X0.1234 Y7", &[]);
        check("(a) G1 (b;c) X1 (d)", "G1 X1", &[]);
        check("/ N5 G4 P.5", "/N5 G4 P0.5", &[]);
        check(":1000", "O1000", &[]);
        check("O0008 (Test program)", "O8", &[]);
        check("% ; tape", "%", &[]);
        check("GR100", "GR100", &[]);
        check("N7 g r P100 L2", "GR N7 P100 L2", &[]);
        check("O5 GR100", "GR100 O5", &[]);
        check("G1 (\u{e4}\u{f6}) X1", "G1 X1", &[]);
        check("x#1 y-#<A b>z[1+2]", "X[#1] Y[-[#<ab>]] Z[[1 + 2]]", &[]);
        check("#1=2+3 ##2=#1 *", "#1=[2 + 3] #[#2]=#1", &[]);
        check("N5 o<Name> call [1] [#2]", "N5 O<name> CALL [1] [#2]", &[]);
        check("o 10 while[#1 lt 5](c)", "O10 WHILE [[#1 LT 5]]", &[]);
        check("IF[#1EQ2]GOTO10", "IF [[#1 EQ 2]] GOTO [10]", &[]);
        check("IF [#1] THEN #2=3", "IF [#1] THEN #2=3", &[]);
        check("N7 WHILE [1] DO2", "N7 WHILE [1] DO2", &[]);
        check("END2", "END2", &[]);
        check("G X COS[0]", "X[COS[0]]", &["missing-number"]);
    }

    #[test]
    fn faults_are_named_and_the_rest_of_the_words_is_read() {
        check("G1 X Y2 Z", "G1 Y2", &["missing-number", "missing-number"]);
        check("X1 X2 Y3", "X1 Y3", &["repeated-word"]);
        check("X1.2.3", "X1.2", &["bad-number"]);
        check("X--1", "", &["bad-number"]);
        check("X9999999999", "", &["bad-number"]);
        check("G1 (open", "G1", &["open-comment"]);
        check("G1 (a(b)c) X1", "G1 X1", &["nested-comment"]);
        check("G1 (a(b) X1", "G1 X1", &["nested-comment"]);
        check(
            "G1 X1,5 Y-2,25Z",
            "G1 X1 Y-2",
            &["decimal-comma", "decimal-comma", "missing-number"],
        );
        check("X[1,5] Y2", "", &["decimal-comma"]);
        check("G1 X1, Y2,C3", "G1 X1 Y2", &["bad-character", "unsupported-word"]);
        check("G1 X\u{2212}5\u{a0}Y\u{2212}1", "G1", &["look-alike", "look-alike", "look-alike"]);
        check("G\u{ff11} \u{425}10 Y5", "Y5", &["look-alike", "look-alike"]);
        check("G1 *X1", "G1", &["bad-character"]);
        check("% G1", "%", &["bad-character"]);
        check("G1 X#", "G1", &["expression"]);
        check("#1 5", "", &["expression"]);
        check("#1=", "", &["expression"]);
        check("X1 ] Y2", "X1", &["expression"]);
        check("IF [#1] X5", "", &["expression"]);
        check("IF [#1] THEN", "IF [#1] THEN", &["expression"]);
        check("X5 o1 endif", "X5 O1 ENDIF", &["call-alone"]);
        check("o<a", "", &["expression"]);
        check("o<a>", "", &["expression"]);
        check("o1 sb", "", &["expression"]);
        check("$H", "", &["unsupported-word"]);
        check("G1 \u{e9}", "G1", &["bad-character"]);
        check("G1 \u{0}", "", &["not-text"]);
        check("!? X Y \u{7f}", "", &["not-text"]);
        check("(\u{1})", "", &["not-text"]);
        check("1 2", "", &["bad-number", "bad-number"]);
        check("G1 / X1", "G1", &["bad-character"]);
    }

    #[test]
    fn words_know_their_place() {
        let (block, _) = read(b"  G1 x 1 5 Y2");
        let places: Vec<_> = block.words().iter().map(|word| (word.start, word.end)).collect();
        assert_eq!(places, [(2, 4), (5, 10), (11, 13)]);
    }

    fn any_number() -> impl Strategy<Value = f64> {
        prop_oneof![
            (-1_000_000_i32..1_000_000, 0_u8..7)
                .prop_map(|(mantissa, decimals)| f64::from(mantissa) / 10_f64.powi(decimals.into())),
            -1e9..1e9_f64,
        ]
    }

    proptest! {
        #[test]
        fn a_printed_block_reads_back(
            words in proptest::collection::vec(("[A-Z]", any_number()), 0..12),
            delete: bool,
        ) {
            let mut line = String::from(if delete { "/" } else { "" });
            for (letter, value) in words {
                line += &format!("{letter}{value} ");
            }
            let (block, _) = read(line.as_bytes());
            let (again, faults) = read(block.to_string().as_bytes());
            prop_assert_eq!(faults.len(), 0);
            prop_assert_eq!(block, again);
        }

        #[test]
        fn a_printed_statement_reads_back(
            words in proptest::collection::vec(
                "[XYZ](#[1-9]|\\[#<a>[-+*/][0-9]\\]|[0-9])|#[1-9]=[-0-9#]{1,2}|o<a> (sub|call \\[1\\]|endsub \\[#1\\]|repeat\\[2\\])|IF\\[#1\\]GOTO5|DO1|N5",
                0..3,
            ),
        ) {
            let (block, faults) = read(words.join(" ").as_bytes());
            prop_assume!(faults.is_empty());
            let (again, faults) = read(block.to_string().as_bytes());
            prop_assert_eq!(faults.len(), 0, "{}", block);
            prop_assert_eq!(block, again);
        }

        #[test]
        fn no_bytes_panic(line in proptest::collection::vec(any::<u8>(), 0..200)) {
            read(&line);
        }

        #[test]
        fn no_text_panics(line in "[GXYMORgrifendo<>=0-9.#%*/(); \\[\\]é-]{0,60}") {
            read(line.as_bytes());
        }
    }
}
