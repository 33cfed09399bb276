//! Why there is no result: errors of programs, profiles and configurations as `--json` prints them, and
//! the document that a command prints instead of its result.
//!
//! Rule: with `--json` a command that ends without a result prints one document more, so that who reads
//! standard output never finds nothing. `interpret` tells the errors of a program in lines of its own.

use std::io::{self, Write};

use cnc::base::{Axis, CallSite, Diagnostic, Severity};
use cnc::gcode::rules;
use cnc::interp::Checked;
use serde_json::{Value, json};

use crate::report;

/// What was refused, with all that is wrong with it.
#[derive(Debug, thiserror::Error)]
#[error("{message}")]
pub struct Refusal {
    message: String,
    /// Nothing of it is left to say on standard error.
    is_told: bool,
    /// As [`write_error`] writes them, each with its file.
    errors: Vec<Value>,
}

impl Refusal {
    /// Of a program that was told of already.
    pub fn of_program(name: &str, checked: &Checked) -> Refusal {
        let is_error = |found: &&Diagnostic| found.severity == Severity::Error;
        let errors = checked.diagnostics.iter().filter(is_error);
        let errors = errors.map(|error| json!(ErrorLine::of(error, Some(checked), Some(name))));
        let message = format!("{name}: {}", report::counts(checked.errors, 0));
        Refusal { message, is_told: true, errors: errors.collect() }
    }

    /// Of a file whose faults were drawn; what it is unfit for is left to say.
    pub fn of_file(name: &str, faults: &[Diagnostic], message: String) -> Refusal {
        let errors = faults.iter().map(|fault| json!(ErrorLine::of(fault, None, Some(name))));
        Refusal { message, is_told: false, errors: errors.collect() }
    }

    /// Of what was told in full.
    pub fn told(message: &str) -> Refusal {
        Refusal { message: message.to_owned(), is_told: true, errors: Vec::new() }
    }
}

/// Whether an error has been told in full.
pub fn is_told(error: &anyhow::Error) -> bool {
    within(error).is_some_and(|refusal| refusal.is_told)
}

fn within(error: &anyhow::Error) -> Option<&Refusal> {
    error.chain().find_map(|cause| cause.downcast_ref())
}

/// What stands for a result.
#[derive(serde::Serialize)]
struct Document<'a> {
    schema: u8,
    result: &'static str,
    exit_code: u8,
    error: &'a str,
    errors: &'a [Value],
}

/// Errors of the text that was refused, if an error is that of one.
pub fn errors(error: &anyhow::Error) -> &[Value] {
    within(error).map_or(&[], |refusal| &refusal.errors)
}

/// Prints the document that stands for a result: the exit code, and why.
pub fn print(exit_code: u8, message: &str, errors: &[Value]) {
    let document = Document { schema: 1, result: "error", exit_code, error: message, errors };
    let Ok(text) = serde_json::to_string(&document) else { return };
    // The exit code stands whether this is read or not.
    let _ = writeln!(io::stdout(), "{text}");
}

/// An error as `--json` prints it.
#[derive(serde::Serialize)]
struct ErrorLine<'a> {
    r#type: &'static str,
    rule: &'static str,
    line: u32,
    column: u32,
    message: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    help: Option<&'a str>,
    /// The calls that led there, outermost first.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    calls: Vec<CallLine<'a>>,
    /// The file: of `interpret` with one program that of a subprogram, where it is not the program's own.
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<&'a str>,
    /// Of an axis that leaves its travel: the least and the greatest shift of the part that makes it
    /// fit, in mm or degrees; the first is greater than the last where the part is too large.
    #[serde(skip_serializing_if = "Option::is_none")]
    shift_mm: Option<[f64; 2]>,
}

/// Where a call was made.
#[derive(serde::Serialize)]
struct CallLine<'a> {
    line: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<&'a str>,
}

impl CallLine<'_> {
    fn of(call: &CallSite) -> CallLine<'_> {
        CallLine { line: call.line, file: call.file.as_deref() }
    }
}

impl<'a> ErrorLine<'a> {
    fn of(
        diagnostic: &'a Diagnostic,
        checked: Option<&Checked>,
        file: Option<&'a str>,
    ) -> ErrorLine<'a> {
        let of_rule =
            |axis: &Axis| rules::limits(*axis).iter().any(|rule| rule.name == diagnostic.rule);
        let axis = Axis::ALL.into_iter().find(of_rule);
        ErrorLine {
            r#type: "error",
            rule: diagnostic.rule,
            line: diagnostic.span.line,
            column: diagnostic.column(),
            message: &diagnostic.message,
            help: diagnostic.help.as_deref(),
            calls: diagnostic.calls.iter().map(CallLine::of).collect(),
            file: diagnostic.file.as_deref().or(file),
            shift_mm: checked.and_then(|checked| checked.summary.shifts_mm[axis?]),
        }
    }
}

/// Writes an error as `--json` prints it, with the name of its program where there are several.
pub fn write_error(
    out: &mut impl Write,
    diagnostic: &Diagnostic,
    checked: &Checked,
    program: Option<&str>,
) -> io::Result<()> {
    let line = ErrorLine::of(diagnostic, Some(checked), program);
    writeln!(out, "{}", serde_json::to_string(&line)?)
}
