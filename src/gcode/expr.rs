//! Expressions: read once into postfix code, so that whoever runs a line again reads nothing again.
//!
//! ```text
//! [#1 + 2 * COS[30]]   →   #1  2  30 COS  *  +
//! ```
//!
//! Operators bind as in RS274/NGC, each from left to right: `**`, then `* / MOD`, then `+ -`, then
//! `EQ NE GT GE LT LE`, then `AND OR XOR`. A sign belongs to the value behind it, so `[-2**2]` is 4.
//! What the code amounts to is not known here: that takes parameters.

use std::fmt;
use std::rc::Rc;

use super::name::Name;
use super::number::{NUMBER_MAX, SyntaxError, is_blank, number};
use super::stray::is_control;

/// Brackets, signs and `#` within each other, at most: far beyond what anybody writes, far below
/// what a stack holds.
const DEPTH_MAX: usize = 64;

/// Bytes of a name at most: a line of RS274/NGC has no more.
const NAME_BYTES_MAX: usize = 255;

/// Greatest number of a parameter that can be written.
const PARAMETER_MAX: f64 = 99_999.0;

/// One step of an expression: takes values from a stack and puts one there.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// A number.
    Number(f64),
    /// The value of `#1`; that of `#0` is no value.
    Parameter(u32),
    /// The value of the parameter whose number lies on the stack: `##1`, `#[…]`.
    Indirect,
    /// The value of `#<name>`, in lower case without blanks.
    Named(Rc<Name>),
    /// 1 if `#<name>` is set, 0 if not.
    Exists(Rc<Name>),
    /// 1 if there is a parameter of the number on the stack, 0 if not.
    ExistsNumbered,
    /// The value with its sign changed.
    Negate,
    /// A function of one value.
    Function(Function),
    /// Two values become one.
    Binary(Binary),
    /// The value and a number become one: most operators have a number or a parameter behind them,
    /// which then need not be put on the stack first.
    WithNumber(Binary, f64),
    /// The value and that of `#1` become one.
    WithParameter(Binary, u32),
}

macro_rules! words {
    ($(#[$doc:meta])* $name:ident { $($id:ident $text:literal)* }) => {
        $(#[$doc])*
        #[allow(missing_docs)]
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum $name { $($id),* }

        impl $name {
            const ALL: &[$name] = &[$($name::$id),*];

            /// As it is written.
            pub fn name(self) -> &'static str {
                match self { $($name::$id => $text),* }
            }
        }
    };
}

words! {
    /// Functions of one value; angles are in degrees.
    Function {
        Abs "ABS" Acos "ACOS" Asin "ASIN" Cos "COS" Exp "EXP" Fix "FIX" Fup "FUP" Ln "LN"
        Round "ROUND" Sin "SIN" Sqrt "SQRT" Tan "TAN"
    }
}

words! {
    /// What stands between two values. ATAN is here, for its form is `ATAN[y]/[x]`.
    Binary {
        Power "**" Times "*" Divide "/" Modulo "MOD" Plus "+" Minus "-" Equal "EQ" NotEqual "NE"
        Greater "GT" GreaterOrEqual "GE" Less "LT" LessOrEqual "LE" And "AND" Or "OR" Xor "XOR"
        Atan "ATAN"
    }
}

impl Binary {
    /// How tightly it binds; ATAN stands between no two values.
    fn precedence(self) -> u8 {
        match self {
            Binary::Power => 5,
            Binary::Times | Binary::Divide | Binary::Modulo => 4,
            Binary::Plus | Binary::Minus => 3,
            Binary::And | Binary::Or | Binary::Xor => 1,
            Binary::Atan => 0,
            _ => 2,
        }
    }
}

/// An expression of a block: a stretch of its code.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Formula {
    pub(super) start: u32,
    pub(super) end: u32,
}

/// Why a stretch of a line is no expression.
#[derive(Debug, PartialEq)]
pub(super) struct NoExpression {
    /// Bytes of the line that were left where reading stopped.
    pub left: usize,
    pub message: String,
    /// What to write instead, where the byte that stopped the reading does not tell.
    pub help: Option<&'static str>,
}

type Read<T> = Result<T, NoExpression>;

/// Reads expressions from a line into code.
pub(super) struct Reader<'a, 'c> {
    pub rest: &'a [u8],
    pub code: &'c mut Vec<Step>,
    depth: usize,
}

impl<'a, 'c> Reader<'a, 'c> {
    pub fn new(rest: &'a [u8], code: &'c mut Vec<Step>) -> Reader<'a, 'c> {
        Reader { rest, code, depth: 0 }
    }

    /// One value: a number, a parameter, `[…]`, a function, with a sign or without.
    pub fn value(&mut self) -> Read<Formula> {
        self.formula(Reader::operand)
    }

    /// An expression in brackets.
    pub fn bracketed(&mut self) -> Read<Formula> {
        self.formula(Reader::bracket)
    }

    /// An expression without brackets around it, as it stands after `=`.
    pub fn bare(&mut self) -> Read<Formula> {
        self.formula(|reader| reader.expression(0))
    }

    /// What a line sets: the code of a parameter without its last step, which would read it.
    pub fn parameter(&mut self) -> Read<(Formula, Step)> {
        let start = self.code.len();
        self.hash()?;
        let last = self.code.pop().unwrap_or(Step::Indirect);
        Ok((Formula { start: start as u32, end: self.code.len() as u32 }, last))
    }

    /// The next byte that is no blank.
    pub fn peek(&mut self) -> Option<u8> {
        let blanks = self.rest.iter().take_while(|byte| is_blank(**byte)).count();
        self.rest = &self.rest[blanks..];
        self.rest.first().copied()
    }

    /// Takes a byte, if it is the next one.
    pub fn takes(&mut self, byte: u8) -> bool {
        let is_next = self.peek() == Some(byte);
        if is_next {
            self.rest = &self.rest[1..];
        }
        is_next
    }

    /// Takes a comment that stands before a `[`, unless it says something to the operator.
    pub fn passes_comment(&mut self) -> bool {
        let Some((b'(', text)) = self.rest.split_first() else { return false };
        let Some(end) = text.iter().position(|byte| *byte == b')') else { return false };
        let (text, rest) = (&text[..end], &text[end + 1..]);
        let says = ["MSG,", "DEBUG,", "PRINT,"].iter().any(|to| after_word(text, to).is_some());
        let is_remark = !says && text.iter().all(|byte| *byte != b'(' && !is_control(*byte));
        let goes_on = rest.iter().find(|byte| !is_blank(**byte)) == Some(&b'[');
        if is_remark && goes_on {
            self.rest = rest;
            self.peek();
        }
        is_remark && goes_on
    }

    /// Takes a word, in either case, if it comes next; blanks may stand inside.
    pub fn takes_word(&mut self, word: &str) -> bool {
        match after_word(self.rest, word) {
            Some(rest) => {
                self.rest = rest;
                true
            }
            None => false,
        }
    }

    /// Whether a function comes next: its name and `[`.
    pub fn is_at_function(&self) -> bool {
        let names = Function::ALL.iter().map(|function| function.name());
        names.chain(["ATAN", "EXISTS"]).any(|name| {
            after_word(self.rest, name).is_some_and(|rest| after_word(rest, "[").is_some())
        })
    }

    /// A name in `< >`, in lower case and without blanks.
    pub fn name(&mut self) -> Read<String> {
        self.takes(b'<');
        let Some(length) = self.rest.iter().position(|byte| *byte == b'>') else {
            return self.no_parameter("this name has no end: > is missing");
        };
        let text: Vec<u8> =
            self.rest[..length].iter().copied().filter(|byte| !is_blank(*byte)).collect();
        // As RS274/NGC: all but what would end the name or begin a comment.
        if text.len() > NAME_BYTES_MAX {
            return self.no_parameter(format!("a name has at most {NAME_BYTES_MAX} bytes"));
        }
        if text.is_empty() || text.iter().any(|byte| b"<(;".contains(byte)) {
            return self.no_parameter("this is no name: it is empty, or holds one of < ( ;");
        }
        self.rest = &self.rest[length + 1..];
        Ok(String::from_utf8_lossy(&text).to_lowercase())
    }

    pub fn fail<T>(&self, message: impl fmt::Display) -> Read<T> {
        Err(NoExpression { left: self.rest.len(), message: message.to_string(), help: None })
    }

    /// Fails where the byte that stands here tells nothing of what was meant.
    fn no_parameter<T>(&self, message: impl fmt::Display) -> Read<T> {
        let help = Some(
            "#1 is a parameter, #<name> a named one, #[#1 + 2] that of a number, o<name> a label",
        );
        Err(NoExpression { left: self.rest.len(), message: message.to_string(), help })
    }

    fn formula(&mut self, read: impl FnOnce(&mut Self) -> Read<()>) -> Read<Formula> {
        let start = self.code.len();
        if let Err(error) = read(self) {
            self.code.truncate(start);
            return Err(error);
        }
        Ok(Formula { start: start as u32, end: self.code.len() as u32 })
    }

    /// Values with operators that bind at least so tightly between them.
    fn expression(&mut self, least: u8) -> Read<()> {
        self.operand()?;
        while let Some((operator, rest)) = self.operator() {
            if operator.precedence() < least {
                break;
            }
            self.rest = rest;
            let second = self.code.len();
            self.expression(operator.precedence() + 1)?;
            let step = match self.code.get(second..) {
                Some([Step::Number(value)]) => Step::WithNumber(operator, *value),
                Some([Step::Parameter(number)]) => Step::WithParameter(operator, *number),
                _ => {
                    self.code.push(Step::Binary(operator));
                    continue;
                }
            };
            self.code.truncate(second);
            self.code.push(step);
        }
        Ok(())
    }

    /// The operator that comes next, and the rest behind it.
    fn operator(&mut self) -> Option<(Binary, &'a [u8])> {
        let between = Binary::ALL.iter().filter(|operator| operator.precedence() > 0);
        let (operator, rest) = between
            .filter_map(|operator| Some((*operator, after_word(self.rest, operator.name())?)))
            .next()?;
        // A * behind which nothing comes ends the block.
        let next = rest.iter().find(|byte| !is_blank(**byte));
        let ends = matches!(operator, Binary::Times) && matches!(next, None | Some(b';' | b'('));
        (!ends).then_some((operator, rest))
    }

    fn operand(&mut self) -> Read<()> {
        if self.depth >= DEPTH_MAX {
            return self.fail(format!("more than {DEPTH_MAX} brackets or signs within each other"));
        }
        self.depth += 1;
        let start = self.code.len();
        match self.peek() {
            Some(b'[') => self.bracket()?,
            Some(b'#') => self.hash()?,
            Some(b'0'..=b'9' | b'.') => self.number()?,
            Some(sign @ (b'+' | b'-')) => {
                self.takes(sign);
                self.operand()?;
                match self.code.get_mut(start..) {
                    _ if sign == b'+' => {}
                    Some([Step::Number(value)]) => *value = -*value,
                    _ => self.code.push(Step::Negate),
                }
            }
            Some(b'A'..=b'Z' | b'a'..=b'z') => self.function()?,
            _ => return self.fail("a value is missing here"),
        }
        self.depth -= 1;
        Ok(())
    }

    fn bracket(&mut self) -> Read<()> {
        if !self.takes(b'[') {
            return self.fail("a [ is missing here");
        }
        self.expression(0)?;
        if !self.takes(b']') {
            return self.fail("an operator or a ] is missing here");
        }
        Ok(())
    }

    fn number(&mut self) -> Read<()> {
        match number(self.rest) {
            Ok((rest, value)) => {
                self.rest = rest;
                self.code.push(Step::Number(value));
                Ok(())
            }
            Err(nom::Err::Failure(SyntaxError::TooLarge)) => {
                self.fail(format!("this number is beyond {NUMBER_MAX}"))
            }
            Err(_) => self.fail("this is no number"),
        }
    }

    /// `#1`, `##1`, `#[…]`, `#<name>`.
    fn hash(&mut self) -> Read<()> {
        self.takes(b'#');
        let start = self.code.len();
        match self.peek() {
            Some(b'<') => {
                let name = self.name()?;
                self.code.push(Step::Named(Rc::new(Name::new(&name))));
                return Ok(());
            }
            Some(b'0'..=b'9' | b'[' | b'#') => self.operand()?,
            Some(_) if self.is_at_function() => self.operand()?,
            _ => {
                return self
                    .no_parameter("# is not followed by the number or <name> of a parameter");
            }
        }
        match self.code.get(start) {
            Some(Step::Number(value)) if self.code.len() == start + 1 => {
                if value.fract() != 0.0 || !(0.0..=PARAMETER_MAX).contains(value) {
                    return self.no_parameter(format!("there is no parameter #{value}"));
                }
                self.code[start] = Step::Parameter(*value as u32);
            }
            _ => self.code.push(Step::Indirect),
        }
        Ok(())
    }

    fn function(&mut self) -> Read<()> {
        if self.takes_word("ATAN") {
            self.bracket()?;
            if !self.takes(b'/') || self.peek() != Some(b'[') {
                return self.fail("ATAN is written as ATAN[y]/[x]");
            }
            self.bracket()?;
            self.code.push(Step::Binary(Binary::Atan));
            return Ok(());
        }
        if self.takes_word("EXISTS") {
            return self.exists();
        }
        let mut functions = Function::ALL.iter();
        let Some(function) = functions.find(|function| self.takes_word(function.name())) else {
            return self.fail("no function of this name is known");
        };
        self.bracket()?;
        self.code.push(Step::Function(*function));
        Ok(())
    }

    /// What stands behind EXISTS: `[#<name>]`, `[#1]`.
    fn exists(&mut self) -> Read<()> {
        if !self.takes(b'[') || self.peek() != Some(b'#') {
            return self.fail("EXISTS is written as EXISTS[#<name>]");
        }
        self.hash()?;
        if !self.takes(b']') {
            return self.fail("a ] is missing here: EXISTS is written as EXISTS[#<name>]");
        }
        // What would read the parameter asks for it instead.
        match self.code.pop() {
            Some(Step::Named(name)) => self.code.push(Step::Exists(name)),
            Some(Step::Parameter(number)) => {
                self.code.extend([Step::Number(f64::from(number)), Step::ExistsNumbered]);
            }
            _ => self.code.push(Step::ExistsNumbered),
        }
        Ok(())
    }
}

/// The rest of a line behind a word in either case, with blanks before it and inside.
pub(super) fn after_word<'a>(mut line: &'a [u8], word: &str) -> Option<&'a [u8]> {
    for expected in word.bytes() {
        let blanks = line.iter().take_while(|byte| is_blank(**byte)).count();
        let (first, rest) = line.get(blanks..)?.split_first()?;
        if first.to_ascii_uppercase() != expected {
            return None;
        }
        line = rest;
    }
    Some(line)
}

/// A piece of code as it is written, and how tightly it binds: [`OPERAND`] where it is one value.
struct Written {
    text: String,
    precedence: u8,
}

/// What binds more tightly than any operator.
const OPERAND: u8 = 6;

impl Written {
    fn operand(text: String) -> Written {
        Written { text, precedence: OPERAND }
    }

    /// With brackets, if it binds less tightly than that.
    fn at_least(self, precedence: u8) -> String {
        if self.precedence < precedence { format!("[{}]", self.text) } else { self.text }
    }

    /// Before an operator and what stands behind that.
    fn with(self, operator: Binary, second: Written) -> Written {
        if operator == Binary::Atan {
            return Written::operand(format!("ATAN[{}]/[{}]", self.text, second.text));
        }
        let precedence = operator.precedence();
        let (first, second) = (self.at_least(precedence), second.at_least(precedence + 1));
        Written { text: format!("{first} {} {second}", operator.name()), precedence }
    }

    /// As the number of a parameter, behind the # of EXISTS, where it may be a number.
    fn behind_exists(self) -> String {
        let is_number = self.text.bytes().all(|byte| byte.is_ascii_digit());
        if is_number { self.text } else { self.behind_hash() }
    }

    /// As the number of a parameter, behind its #.
    fn behind_hash(self) -> String {
        let text = self.at_least(OPERAND);
        if text.starts_with(['#', '[']) { text } else { format!("[{text}]") }
    }
}

fn steps_written(code: &[Step]) -> Written {
    let mut parts: Vec<Written> = Vec::new();
    for step in code {
        // The reader of expressions puts no step where its values are missing.
        let mut take = || parts.pop().unwrap_or_else(|| Written::operand(String::new()));
        let part = match step {
            Step::Number(value) => Written::operand(value.to_string()),
            Step::Parameter(number) => Written::operand(format!("#{number}")),
            Step::Named(name) => Written::operand(format!("#<{name}>")),
            Step::Exists(name) => Written::operand(format!("EXISTS[#<{name}>]")),
            Step::Indirect => Written::operand(format!("#{}", take().behind_hash())),
            Step::ExistsNumbered => {
                Written::operand(format!("EXISTS[#{}]", take().behind_exists()))
            }
            Step::Negate => Written::operand(format!("-{}", take().at_least(OPERAND))),
            Step::Function(function) => {
                Written::operand(format!("{}[{}]", function.name(), take().text))
            }
            Step::Binary(operator) => {
                let second = take();
                take().with(*operator, second)
            }
            Step::WithNumber(operator, value) => {
                take().with(*operator, Written::operand(value.to_string()))
            }
            Step::WithParameter(operator, number) => {
                take().with(*operator, Written::operand(format!("#{number}")))
            }
        };
        parts.push(part);
    }
    parts.pop().unwrap_or_else(|| Written::operand(String::new()))
}

/// Code as it is written in brackets or behind `=`, with no more brackets than it needs.
pub(super) fn written(code: &[Step]) -> String {
    steps_written(code).text
}

/// Code as it is written behind a letter. In brackets stand a number, which would be taken for that
/// of a plain word, two signs, and functions: letter and name might be read as a keyword, as GR.
pub(super) fn value_written(code: &[Step]) -> String {
    let written = steps_written(code).at_least(OPERAND);
    let needs_brackets = matches!(code, [Step::Number(_)])
        || written.starts_with("--")
        || written.starts_with(|first: char| first.is_ascii_alphabetic());
    if needs_brackets { format!("[{written}]") } else { written }
}

/// Code as it is written behind # for the number of a parameter.
pub(super) fn number_written(code: &[Step]) -> String {
    steps_written(code).behind_hash()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn check(text: &str, expected: &str) {
        let mut code = Vec::new();
        let mut reader = Reader::new(text.as_bytes(), &mut code);
        let found = match reader.bare() {
            Ok(_) => {
                let left = String::from_utf8_lossy(reader.rest).into_owned();
                written(&code) + &left
            }
            Err(error) => format!("{}: {}", text.len() - error.left, error.message),
        };
        assert_eq!(found, expected, "{text}");
    }

    #[test]
    fn operators_bind_as_in_rs274() {
        check("1+2*3", "1 + 2 * 3");
        check("-2**2", "-2 ** 2");
        check("2**3**2", "2 ** 3 ** 2");
        check("1 - 2 - 3", "1 - 2 - 3");
        check("#1 EQ 2 AND #2 LT 3+1", "#1 EQ 2 AND #2 LT 3 + 1");
        check("7 m o d 4/2", "7 MOD 4 / 2");
        check("-[#1]", "-#1");
        check("-[#1+2]", "-[#1 + 2]");
        check("--[-#1]", "---#1");
        check("2**[3**2]*[4-[5-6]]", "2 ** [3 ** 2] * [4 - [5 - 6]]");
        check("- #<A b>", "-#<ab>");
        check("##1+#[2+#3]", "##1 + #[2 + #3]");
        check("sin[3 0]*ATAN[1]/[2]", "SIN[30] * ATAN[1]/[2]");
        check("EXISTS[#<_g>]", "EXISTS[#<_g>]");
        check("EXISTS[#1]+EXISTS[##2]", "EXISTS[#1] + EXISTS[##2]");
        check("EXISTS[#[#2+1]]", "EXISTS[#[#2 + 1]]");
        check("#abs[-3]", "#[ABS[-3]]");
        check("1 2 .5X3", "12.5X3");
        check("#1 *", "#1 *");
        check("#1*;", "#1*;");
    }

    #[test]
    fn what_is_no_expression_is_told_where() {
        check("1+", "2: a value is missing here");
        check("[1+2", "4: an operator or a ] is missing here");
        check("[1 2 X]", "5: an operator or a ] is missing here");
        check("FOO[1]", "0: no function of this name is known");
        check("SIN 30", "4: a [ is missing here");
        check("ATAN[1]", "7: ATAN is written as ATAN[y]/[x]");
        check("EXISTS[1]", "7: EXISTS is written as EXISTS[#<name>]");
        check("EXISTS[#1+1]", "9: a ] is missing here: EXISTS is written as EXISTS[#<name>]");
        check("#1.5", "4: there is no parameter #1.5");
        check("#<a", "2: this name has no end: > is missing");
        check("#", "1: # is not followed by the number or <name> of a parameter");
        check("9999999999", "0: this number is beyond 1000000000");
        let deep = "[".repeat(100);
        check(&deep, "64: more than 64 brackets or signs within each other");
    }

    proptest! {
        #[test]
        fn a_printed_expression_reads_back(text in "[-+*/#<a>0-9. \\[\\]SINMODEQATANEXISTS]{0,40}") {
            let (mut code, mut again) = (Vec::new(), Vec::new());
            if Reader::new(text.as_bytes(), &mut code).bare().is_ok() {
                let text = written(&code);
                let read = Reader::new(text.as_bytes(), &mut again).bare();
                prop_assert!(read.is_ok(), "{} {:?}", text, read);
                prop_assert_eq!(code, again);
            }
        }
    }
}
