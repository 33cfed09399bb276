//! JSON Lines: errors as `interpret --json` has them, each with its file; a line a program; the sum.

use std::io::{self, Write};

use cnc::base::{Diagnostic, Severity};
use cnc::verify;
use serde::Serialize;

use super::Form;
use super::judged::{Judged, WRONG_FILE};
use super::sum::Sum;
use crate::args::Global;
use crate::exit::told;
use crate::refusal::write_error;
use crate::report;

/// A line an error, a program and the sum; warnings are drawn on standard error.
pub struct Lines<'a> {
    global: &'a Global,
}

#[derive(Serialize)]
struct Program<'a> {
    r#type: &'static str,
    file: &'a str,
    /// pass, fail, or unread.
    verdict: &'static str,
    errors: u64,
    warnings: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    lines: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    moves: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    events: Option<u64>,
    /// The dump that was held against it.
    #[serde(skip_serializing_if = "Option::is_none")]
    dump: Option<&'a str>,
    /// As `cnc verify --json` has it.
    #[serde(skip_serializing_if = "Option::is_none")]
    report: Option<&'a verify::Report>,
    /// Why there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<String>,
    /// The rule that its reason is of, if it is of one.
    #[serde(skip_serializing_if = "Option::is_none")]
    rule: Option<&'static str>,
}

#[derive(Serialize)]
struct Total<'a> {
    r#type: &'static str,
    #[serde(flatten)]
    sum: &'a Sum,
}

impl<'a> Lines<'a> {
    pub fn new(global: &'a Global) -> Lines<'a> {
        Lines { global }
    }
}

impl Form for Lines<'_> {
    fn program(&mut self, mut out: &mut dyn Write, judged: &Judged) -> io::Result<()> {
        let name = &judged.name;
        let is_error = |found: &&Diagnostic| found.severity == Severity::Error;
        if let Some(checked) = &judged.checked {
            for error in checked.diagnostics.iter().filter(is_error) {
                write_error(&mut out, error, checked, Some(name))?;
            }
            let warnings = checked.diagnostics.iter().filter(|found| !is_error(found));
            report::diagnostics(name, warnings, self.global);
            report::said(name, checked, self.global);
        }
        let summary = judged.checked.as_ref().map(|checked| &checked.summary);
        let reason = judged.trouble.as_ref().map(|failure| told(&failure.error));
        let line = Program {
            r#type: "program",
            file: name,
            verdict: match judged.code() {
                0 => "pass",
                1 => "fail",
                _ => "unread",
            },
            errors: judged.errors(),
            warnings: judged.warnings(),
            lines: summary.map(|summary| summary.lines),
            moves: summary.map(|summary| summary.moves),
            events: summary.map(|summary| summary.events),
            dump: judged.dump.as_deref(),
            report: judged.report.as_ref(),
            rule: reason.as_ref().filter(|_| judged.code() == 1).map(|_| WRONG_FILE),
            reason,
        };
        writeln!(out, "{}", serde_json::to_string(&line)?)
    }

    fn end(&mut self, out: &mut dyn Write, sum: &Sum) -> io::Result<()> {
        writeln!(out, "{}", serde_json::to_string(&Total { r#type: "sum", sum })?)
    }
}
