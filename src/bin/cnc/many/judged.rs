//! What is known of one program in the end, and what of it is wrong, in one form for every format.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use cnc::base::source::shown;
use cnc::base::{CallSite, Diagnostic, Severity};
use cnc::interp::Checked;
use cnc::verify::{Check, Report, Verdict};

use crate::exit::{Failure, told};
use crate::meter::Interrupted;

/// Rule of files that are not what they have to be.
pub const WRONG_FILE: &str = "wrong-file";
/// What that means.
pub const WRONG_FILE_MEANING: &str = "The dump is not of this program and machine, or was changed; or a \
    dump stands where a program belongs.";

/// A program, judged as far as it could be.
pub struct Judged {
    pub path: PathBuf,
    /// The name to show.
    pub name: String,
    /// The dump that was held against it; none where its steps were made here.
    pub dump: Option<String>,
    /// What there is to say about the files.
    pub notes: Vec<String>,
    pub checked: Option<Checked>,
    pub report: Option<Report>,
    /// Why it was not judged to the end.
    pub trouble: Option<Failure>,
}

/// One thing that is wrong.
pub struct Finding<'a> {
    pub severity: Severity,
    pub rule: Cow<'a, str>,
    /// The file, where it is not the program's own.
    pub file: Option<&'a str>,
    pub place: Option<Place>,
    pub message: Cow<'a, str>,
    pub help: Option<&'a str>,
    /// The calls that led there, outermost first.
    pub calls: &'a [CallSite],
}

/// Where in a file: a line from 1 and, if known, the first character from 1 and that after the last.
#[derive(Clone, Copy)]
pub struct Place {
    pub line: u32,
    pub columns: Option<[u32; 2]>,
}

impl Judged {
    pub fn new(path: PathBuf) -> Judged {
        let name = name(&path);
        let (dump, notes, checked, report, trouble) = (None, Vec::new(), None, None, None);
        Judged { path, name, dump, notes, checked, report, trouble }
    }

    /// Itself, unless the operator has stopped the work.
    pub fn unless_interrupted(mut self) -> Result<Judged, Failure> {
        let is_stop = |failure: &mut Failure| failure.error.chain().any(Interrupted::is_in);
        match self.trouble.take_if(is_stop) {
            Some(stop) => Err(stop),
            None => Ok(self),
        }
    }

    /// The exit code that this program alone has.
    pub fn code(&self) -> u8 {
        match &self.trouble {
            Some(failure) => failure.code,
            None => u8::from(self.faults() > 0),
        }
    }

    /// Errors of the program.
    pub fn errors(&self) -> u64 {
        self.checked.as_ref().map_or(0, |checked| checked.errors)
    }

    /// Warnings about the program.
    pub fn warnings(&self) -> u64 {
        self.checked.as_ref().map_or(0, |checked| checked.warnings)
    }

    /// All that fails it: errors of the program, checks of its steps, a file that is not what it has to be.
    pub fn faults(&self) -> u64 {
        let failures = self.report.as_ref().map_or(0, |report| report.failures.len());
        let is_wrong_file = self.trouble.as_ref().is_some_and(|failure| failure.code == 1);
        self.errors() + failures as u64 + u64::from(is_wrong_file)
    }

    /// Why it was not judged at all: files that cannot be read, and the like.
    pub fn unread(&self) -> Option<String> {
        let failure = self.trouble.as_ref().filter(|failure| failure.code > 1)?;
        Some(told(&failure.error))
    }

    /// Everything that is wrong, but for errors beyond `--max-errors`.
    pub fn findings(&self) -> Vec<Finding<'_>> {
        let mut findings = Vec::new();
        if let Some(checked) = &self.checked {
            findings.extend(checked.diagnostics.iter().map(Finding::of_diagnostic));
        }
        if let Some(report) = &self.report {
            let failed = report.limits.iter().filter(|check| check.verdict == Verdict::Fail);
            findings.extend(failed.map(Finding::of_check));
        }
        if let Some(failure) = self.trouble.as_ref().filter(|failure| failure.code == 1) {
            findings.push(Finding::wrong_file(told(&failure.error)));
        }
        findings
    }

    /// That errors and warnings are counted and not among the findings, if there are such.
    pub fn not_shown(&self) -> Option<String> {
        let shown = self.checked.as_ref().map_or(0, |checked| checked.diagnostics.len());
        let more = (self.errors() + self.warnings()).saturating_sub(shown as u64);
        (more > 0).then(|| format!("{more} of them not shown (--max-errors)"))
    }
}

impl<'a> Finding<'a> {
    fn of_diagnostic(found: &'a Diagnostic) -> Finding<'a> {
        let first = found.column();
        let place = Place { line: found.span.line, columns: Some([first, found.end_column()]) };
        Finding {
            severity: found.severity,
            rule: found.rule.into(),
            file: found.file.as_deref(),
            place: Some(place),
            message: found.message.as_str().into(),
            help: found.help.as_deref(),
            calls: &found.calls,
        }
    }

    /// A check that does not hold, at the NC line where it is worst.
    fn of_check(check: &'a Check) -> Finding<'a> {
        let line = check.at.map(|at| at.line).filter(|line| *line > 0);
        Finding {
            severity: Severity::Error,
            rule: check_rule(check.check).into(),
            file: None,
            place: line.map(|line| Place { line, columns: None }),
            message: check.to_string().into(),
            help: None,
            calls: &[],
        }
    }

    fn wrong_file(message: String) -> Finding<'a> {
        Finding {
            severity: Severity::Error,
            rule: WRONG_FILE.into(),
            file: None,
            place: None,
            message: message.into(),
            help: None,
            calls: &[],
        }
    }
}

/// A program's name, as it is shown.
pub fn name(path: &Path) -> String {
    if path == Path::new("-") { "<stdin>".to_owned() } else { shown(path) }
}

/// `verify-end-point`: the name of a check as that of a rule.
pub fn check_rule(check: &str) -> String {
    format!("verify-{}", check.to_ascii_lowercase().replace(' ', "-"))
}

/// `error` or `warning`.
pub fn severity_name(severity: Severity) -> &'static str {
    match severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
    }
}
