//! Statements: what a line does besides words. O words and their keywords (RS274/NGC), `IF`,
//! `WHILE`, `GOTO` (FANUC macro B), and what is set by `=`.

use std::fmt;
use std::rc::Rc;

use super::block::{Block, letter_bit};
use super::expr::{Formula, NoExpression, Reader, Step, number_written, value_written, written};
use super::fault::Fault;
use super::rules;

/// Arguments of a call, at most: `#1` to `#30`.
const ARGUMENTS_MAX: usize = 30;

/// What names a subprogram or a loop.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Label {
    /// `O100`
    Number(u32),
    /// `O<name>`, in lower case without blanks.
    Name(Rc<str>),
}

impl fmt::Display for Label {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Label::Number(number) => write!(f, "O{number}"),
            Label::Name(name) => write!(f, "O<{name}>"),
        }
    }
}

/// Where a program goes on.
#[allow(missing_docs)]
#[derive(Clone, Debug, PartialEq)]
pub enum Control {
    /// `O<name>` alone: the title of a program.
    Title,
    Sub,
    EndSub(Option<Formula>),
    Return(Option<Formula>),
    Call(Vec<Formula>),
    /// `O#1 call`: a call of the subprogram whose number that is.
    CallNumber(Formula, Vec<Formula>),
    If(Formula),
    ElseIf(Formula),
    Else,
    EndIf,
    /// Begins a loop, or ends that of a `do` with the same label.
    While(Formula),
    EndWhile,
    Do,
    Repeat(Formula),
    EndRepeat,
    Break,
    Continue,
    /// `GOTO 10`, `IF [..] GOTO 10`
    Goto {
        condition: Option<Formula>,
        target: Formula,
    },
    /// `IF [..] THEN #1=2`: what the line sets is set only then.
    Then(Formula),
    /// `WHILE [..] DO1`; without a condition it goes on until something leads out.
    WhileDo(Option<Formula>),
    /// `END1`
    EndDo,
}

/// A line that decides where the program goes on.
#[derive(Clone, Debug, PartialEq)]
pub struct Statement {
    /// Its O word; the number of `DO1` and `END1`; 0 where a statement has none.
    pub label: Label,
    /// What it decides.
    pub control: Control,
    /// Byte of the line at which it begins.
    pub start: u32,
    /// Byte of the line just after it.
    pub end: u32,
}

/// `#1=2`: a parameter is set.
#[derive(Clone, Debug, PartialEq)]
pub struct Assignment {
    /// The number of the parameter, where `target` is [`Step::Indirect`]; else empty.
    pub number: Formula,
    /// [`Step::Parameter`], [`Step::Named`] or [`Step::Indirect`].
    pub target: Step,
    /// What it is set to.
    pub value: Formula,
    /// Byte of the line at which it begins.
    pub start: u32,
    /// Byte of the line just after it.
    pub end: u32,
}

/// What an O word says, once its label has been read; none if no keyword follows.
pub(super) fn after_label(reader: &mut Reader<'_, '_>) -> Option<Result<Control, NoExpression>> {
    // A word that begins with another one stands before it.
    let keywords = [
        "SUB",
        "ENDSUB",
        "RETURN",
        "CALL",
        "IF",
        "ELSEIF",
        "ELSE",
        "ENDIF",
        "WHILE",
        "ENDWHILE",
        "DO",
        "REPEAT",
        "ENDREPEAT",
        "BREAK",
        "CONTINUE",
    ];
    let keyword = keywords.into_iter().find(|keyword| reader.takes_word(keyword))?;
    Some(match keyword {
        "SUB" => Ok(Control::Sub),
        "ENDSUB" => result(reader).map(Control::EndSub),
        "RETURN" => result(reader).map(Control::Return),
        "CALL" => arguments(reader).map(Control::Call),
        "IF" => reader.bracketed().map(Control::If),
        "ELSEIF" => reader.bracketed().map(Control::ElseIf),
        "ELSE" => Ok(Control::Else),
        "ENDIF" => Ok(Control::EndIf),
        "WHILE" => reader.bracketed().map(Control::While),
        "ENDWHILE" => Ok(Control::EndWhile),
        "DO" => Ok(Control::Do),
        "REPEAT" => reader.bracketed().map(Control::Repeat),
        "ENDREPEAT" => Ok(Control::EndRepeat),
        "BREAK" => Ok(Control::Break),
        _ => Ok(Control::Continue),
    })
}

/// The rest of a call whose label is computed; none if no CALL follows.
pub(super) fn computed_call(
    number: Formula,
    reader: &mut Reader<'_, '_>,
) -> Option<Result<Control, NoExpression>> {
    let is_call = reader.takes_word("CALL");
    is_call.then(|| Ok(Control::CallNumber(number, arguments(reader)?)))
}

fn result(reader: &mut Reader<'_, '_>) -> Result<Option<Formula>, NoExpression> {
    if reader.peek() == Some(b'[') { reader.bracketed().map(Some) } else { Ok(None) }
}

fn arguments(reader: &mut Reader<'_, '_>) -> Result<Vec<Formula>, NoExpression> {
    let mut arguments = Vec::new();
    while reader.peek() == Some(b'[') || reader.passes_comment() {
        if arguments.len() == ARGUMENTS_MAX {
            return reader.fail(format!("a call has at most {ARGUMENTS_MAX} arguments"));
        }
        arguments.push(reader.bracketed()?);
    }
    Ok(arguments)
}

/// A statement of macro B, with its number; none if no keyword of it comes next.
pub(super) fn macro_b(reader: &mut Reader<'_, '_>) -> Option<Result<(u32, Control), NoExpression>> {
    let keywords = ["IF", "WHILE", "GOTO", "DO", "END"];
    let keyword = keywords.into_iter().find(|keyword| reader.takes_word(keyword))?;
    Some(match keyword {
        "IF" => branch(reader).map(|control| (0, control)),
        "WHILE" => while_do(reader),
        "GOTO" => reader.value().map(|target| (0, Control::Goto { condition: None, target })),
        "DO" => loop_number(reader).map(|number| (number, Control::WhileDo(None))),
        _ => loop_number(reader).map(|number| (number, Control::EndDo)),
    })
}

fn branch(reader: &mut Reader<'_, '_>) -> Result<Control, NoExpression> {
    let condition = reader.bracketed()?;
    if reader.takes_word("GOTO") {
        let target = reader.value()?;
        return Ok(Control::Goto { condition: Some(condition), target });
    }
    if reader.takes_word("THEN") {
        return Ok(Control::Then(condition));
    }
    reader.fail("GOTO or THEN is missing here")
}

fn while_do(reader: &mut Reader<'_, '_>) -> Result<(u32, Control), NoExpression> {
    let condition = reader.bracketed()?;
    if !reader.takes_word("DO") {
        return reader.fail("DO and its number are missing here");
    }
    Ok((loop_number(reader)?, Control::WhileDo(Some(condition))))
}

/// The number behind DO and END.
fn loop_number(reader: &mut Reader<'_, '_>) -> Result<u32, NoExpression> {
    let formula = reader.value()?;
    let code = reader.code.split_off(formula.start as usize);
    match code.as_slice() {
        [Step::Number(value)] if value.fract() == 0.0 && (1.0..=999.0).contains(value) => {
            Ok(*value as u32)
        }
        _ => reader.fail("the number of a loop is 1, 2 or 3"),
    }
}

/// Reports what stands beside a statement: nothing may, but a line number, and behind THEN what
/// is set.
pub(super) fn stands_alone(block: &Block, faults: &mut Vec<Fault>) {
    let Some(statement) = block.statement() else { return };
    let word = block.first_of(!letter_bit(b'N')).map(|word| (word.start, word.end));
    let set = block.assignments().first().map(|set| (set.start, set.end));
    let is_then = matches!(statement.control, Control::Then(_));
    let call = block.call.map(|call| (call.start, call.end));
    if let Some((start, end)) = word.or(call).or(set.filter(|_| !is_then)) {
        let message = "this stands beside a statement of control flow";
        let fault = Fault::new(&rules::CALL_ALONE, start, end, message);
        faults.push(fault.help(if is_then {
            "THEN only sets a parameter: jump by GOTO, or write o1 if, the block, o1 endif"
        } else {
            "put it into a block of its own"
        }));
    } else if is_then && set.is_none() {
        let message = "THEN is not followed by a parameter that it sets";
        let fault = Fault::new(&rules::EXPRESSION, statement.start, statement.end, message);
        faults.push(fault.help("write IF [#1 EQ 2] THEN #3 = 4"));
    }
}

impl Assignment {
    /// As it is written in a block of this code.
    pub(super) fn written<'a>(&self, code: impl Fn(Formula) -> &'a [Step]) -> String {
        let target = match &self.target {
            Step::Indirect => format!("#{}", number_written(code(self.number))),
            step => written(std::slice::from_ref(step)),
        };
        format!("{target}={}", written(code(self.value)))
    }
}

impl Statement {
    /// As it is written in a block of this code.
    pub(super) fn written<'a>(&self, code: impl Fn(Formula) -> &'a [Step]) -> String {
        let label = &self.label;
        let text = |formula: &Formula| written(code(*formula));
        let number = match label {
            Label::Number(number) => *number,
            Label::Name(_) => 0,
        };
        let result = |formula: &Option<Formula>| {
            formula.map_or(String::new(), |formula| format!(" [{}]", text(&formula)))
        };
        let listed = |formulas: &[Formula]| -> String {
            formulas.iter().map(|formula| format!(" [{}]", text(formula))).collect()
        };
        match &self.control {
            Control::Title => label.to_string(),
            Control::Sub => format!("{label} SUB"),
            Control::EndSub(formula) => format!("{label} ENDSUB{}", result(formula)),
            Control::Return(formula) => format!("{label} RETURN{}", result(formula)),
            Control::Call(arguments) => format!("{label} CALL{}", listed(arguments)),
            Control::CallNumber(number, arguments) => {
                format!("O{} CALL{}", value_written(code(*number)), listed(arguments))
            }
            Control::If(formula) => format!("{label} IF [{}]", text(formula)),
            Control::ElseIf(formula) => format!("{label} ELSEIF [{}]", text(formula)),
            Control::Else => format!("{label} ELSE"),
            Control::EndIf => format!("{label} ENDIF"),
            Control::While(formula) => format!("{label} WHILE [{}]", text(formula)),
            Control::EndWhile => format!("{label} ENDWHILE"),
            Control::Do => format!("{label} DO"),
            Control::Repeat(formula) => format!("{label} REPEAT [{}]", text(formula)),
            Control::EndRepeat => format!("{label} ENDREPEAT"),
            Control::Break => format!("{label} BREAK"),
            Control::Continue => format!("{label} CONTINUE"),
            Control::Goto { condition: None, target } => {
                format!("GOTO {}", value_written(code(*target)))
            }
            Control::Goto { condition: Some(condition), target } => {
                format!("IF [{}] GOTO {}", text(condition), value_written(code(*target)))
            }
            Control::Then(condition) => format!("IF [{}] THEN", text(condition)),
            Control::WhileDo(None) => format!("DO{number}"),
            Control::WhileDo(Some(condition)) => {
                format!("WHILE [{}] DO{number}", text(condition))
            }
            Control::EndDo => format!("END{number}"),
        }
    }
}
