//! Something wrong with a line, before it is known which line that is.

use std::fmt;

use super::rules::Rule;
use super::{Block, Call, Word};

/// Something wrong with a line: a diagnostic that does not yet know its line.
#[derive(Clone, Debug)]
pub struct Fault {
    /// The rule that is broken.
    pub rule: &'static Rule,
    /// Byte of the line at which the fault begins.
    pub start: u32,
    /// Byte of the line just after it.
    pub end: u32,
    /// What was found.
    pub message: String,
    /// What to write instead, where that can be known.
    pub help: Option<String>,
}

impl Fault {
    /// A fault in a stretch of the line.
    pub fn new(rule: &'static Rule, start: u32, end: u32, message: impl fmt::Display) -> Fault {
        Fault { rule, start, end, message: message.to_string(), help: None }
    }

    /// A fault of one word.
    pub fn word(rule: &'static Rule, word: &Word, message: impl fmt::Display) -> Fault {
        Fault::new(rule, word.start, word.end, message)
    }

    /// A fault of a subroutine call.
    pub fn call(rule: &'static Rule, call: &Call, message: impl fmt::Display) -> Fault {
        Fault::new(rule, call.start, call.end, message)
    }

    /// A fault of all that stands on the line.
    pub fn block(rule: &'static Rule, block: &Block, message: impl fmt::Display) -> Fault {
        let (start, end) = block.extent();
        Fault::new(rule, start, end, message)
    }

    /// Adds what to write instead.
    pub fn help(mut self, help: impl fmt::Display) -> Fault {
        self.help = Some(help.to_string());
        self
    }
}
