//! What comes out of a program, as `cnc report --json` writes it and `--merge` reads it. Nothing in it
//! hangs on when or where it was made: the same program on the same machine gives the same bytes.

use cnc::base::rounding::six_digits;
use cnc::base::{Diagnostic, Severity};
use cnc::verify::Verdict as Verified;
use cnc::wire_io::journal::hex;
use serde::{Deserialize, Serialize};

use super::Ran;
use crate::plural::count;
use crate::program::Program;

/// Version of the document.
const SCHEMA: u32 = 1;
/// Figures that no job has: whole numbers that JSON's readers do not keep, 31 years, the way to the moon and
/// back.
const COUNT_MAX: u64 = 1 << 53;
const SECONDS_MAX: f64 = 1e9;
const LENGTH_MAX_MM: f64 = 1e12;

/// All of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Document {
    schema: u32,
    /// The program, as it was named.
    pub file: String,
    /// SHA-256 of its text.
    pub sha256: String,
    /// The machine, and the SHA-256 of its profile.
    pub machine: String,
    pub machine_sha256: String,
    /// What made it, and its version.
    pub tool: String,
    pub verdict: Verdict,
    /// Why the verdict is fail, a sentence each.
    pub failures: Vec<String>,
    /// All errors and warnings of the program are counted, some are listed.
    pub errors: u64,
    pub warnings: u64,
    pub findings: Vec<Finding>,
    /// What its job comes to; none of a program that is refused.
    pub job: Option<Job>,
}

/// What is said of a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// Within tolerance and all limits, and safe for the bus.
    Pass,
    /// Not so.
    Fail,
    /// It has errors, and was not planned.
    Refused,
}

/// An error or a warning of the program.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Finding {
    pub severity: String,
    pub rule: String,
    pub line: u32,
    pub column: u32,
    pub message: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub help: Option<String>,
    /// The file of a subprogram, where it is not the program's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
}

/// The figures of a job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Job {
    /// Ticks of motion.
    pub ticks: u64,
    /// What they take.
    pub motion_seconds: f64,
    /// With pauses and refills of the node buffers.
    pub total_seconds: f64,
    /// M, S and T functions, which take what they take.
    pub events: u64,
    pub cut_mm: f64,
    pub rapid_mm: f64,
    /// Fréchet distance between what is executed and the path, and whether it is more than that.
    pub max_contour_error_mm: f64,
    pub max_contour_error_is_lower_bound: bool,
    /// What it may be.
    pub tolerance_mm: f64,
    /// Where it is greatest.
    pub worst: Option<Place>,
}

/// A tick, and the NC line it belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Place {
    pub tick: u64,
    pub line: u32,
}

impl Document {
    /// Of a program before it is planned.
    pub fn of(program: &Program) -> Document {
        let checked = &program.checked;
        Document {
            schema: SCHEMA,
            file: program.source.name().to_owned(),
            sha256: hex(&program.sha256),
            machine: program.machine.id.clone(),
            machine_sha256: hex(&program.machine.sha256()),
            tool: format!("cnc {}", env!("CARGO_PKG_VERSION")),
            verdict: Verdict::Refused,
            failures: Vec::new(),
            errors: checked.errors,
            warnings: checked.warnings,
            findings: checked.diagnostics.iter().map(Finding::of).collect(),
            job: None,
        }
    }

    /// Takes what came out of its job.
    pub fn take(&mut self, ran: &Ran<'_>, program: &Program) {
        let Ran { summary, report, bus, .. } = ran;
        let unsafe_for_bus = bus.as_ref().and_then(|bus| bus.as_ref().err()).cloned();
        let holds = report.verdict == Verified::Pass && unsafe_for_bus.is_none();
        self.verdict = if holds { Verdict::Pass } else { Verdict::Fail };
        self.failures = report.failures.iter().cloned().chain(unsafe_for_bus).collect();
        let machine = &program.machine;
        self.job = Some(Job {
            ticks: summary.ticks,
            motion_seconds: six_digits(summary.motion_s(machine)),
            total_seconds: six_digits(summary.total_s(machine)),
            events: summary.events,
            cut_mm: six_digits(summary.cut_mm),
            rapid_mm: six_digits(summary.rapid_mm),
            max_contour_error_mm: six_digits(report.max_contour_error_mm),
            max_contour_error_is_lower_bound: report.max_contour_error_is_lower_bound,
            tolerance_mm: six_digits(report.tolerance_mm),
            worst: report.worst.map(|at| Place { tick: at.tick, line: at.line }),
        });
    }

    /// What is wrong with it as a document.
    pub fn fault(&self) -> Option<String> {
        if self.schema != SCHEMA {
            return Some("it is of another version: `\"schema\"` is not 1".to_owned());
        }
        let is_whole = match self.verdict {
            Verdict::Pass => self.job.is_some() && self.failures.is_empty() && self.errors == 0,
            Verdict::Fail => self.job.is_some() && !self.failures.is_empty() && self.errors == 0,
            Verdict::Refused => self.job.is_none() && self.errors > 0,
        };
        if !is_whole {
            return Some("its verdict does not fit what it says".to_owned());
        }
        let counts = [("errors", self.errors), ("warnings", self.warnings)];
        let of_job = self.job.iter().flat_map(|job| [("ticks", job.ticks), ("events", job.events)]);
        let mut counts = counts.into_iter().chain(of_job);
        let too_many = counts.find(|(_, count)| *count > COUNT_MAX);
        let too_many = too_many.map(|(name, count)| format!("`\"{name}\"` is {count}"));
        too_many.or_else(|| self.job.as_ref().and_then(|job| job.fault(self.verdict)))
    }

    /// What is wrong: failures, or errors of the program as far as they are listed.
    pub fn wrong(&self) -> impl Iterator<Item = String> {
        let is_error = |finding: &&Finding| finding.severity == severity(Severity::Error);
        let errors = self.findings.iter().filter(is_error).map(Finding::sentence);
        self.failures.iter().cloned().chain(errors)
    }

    /// How much is wrong, listed or not.
    pub fn wrong_count(&self) -> u64 {
        self.failures.len() as u64 + self.errors
    }

    pub fn passes(&self) -> bool {
        self.verdict == Verdict::Pass
    }

    /// The verdict as people read it.
    pub fn sentence(&self) -> String {
        match (self.verdict, &self.job, self.errors) {
            (Verdict::Pass, Some(job), _) => format!(
                "Pass: at most {:.4} mm off the path (bound {:.4} mm), end point exact",
                job.max_contour_error_mm, job.tolerance_mm
            ),
            (Verdict::Pass, None, _) => "Pass".to_owned(),
            (Verdict::Fail, ..) => format!("Fail: {}", self.failures.join("; ")),
            (Verdict::Refused, _, errors) => {
                let there = if errors == 1 { "there is" } else { "there are" };
                format!("Refused: {there} {}", count(errors, "error"))
            }
        }
    }
}

impl Job {
    /// What cannot be of its figures.
    fn fault(&self, verdict: Verdict) -> Option<String> {
        let figures = [
            ("motion_seconds", self.motion_seconds, SECONDS_MAX),
            ("total_seconds", self.total_seconds, SECONDS_MAX),
            ("cut_mm", self.cut_mm, LENGTH_MAX_MM),
            ("rapid_mm", self.rapid_mm, LENGTH_MAX_MM),
            ("max_contour_error_mm", self.max_contour_error_mm, LENGTH_MAX_MM),
            ("tolerance_mm", self.tolerance_mm, LENGTH_MAX_MM),
        ];
        let strange = figures.iter().find(|(_, value, most)| !(0.0..=*most).contains(value));
        if let Some((name, value, _)) = strange {
            return Some(format!("`\"{name}\"` is {value}"));
        }
        if self.motion_seconds > self.total_seconds {
            return Some("its motion takes longer than all of it".to_owned());
        }
        let is_off = self.max_contour_error_mm > self.tolerance_mm;
        (verdict == Verdict::Pass && is_off)
            .then(|| "it passes, and its error is beyond its tolerance".to_owned())
    }
}

impl Finding {
    fn of(diagnostic: &Diagnostic) -> Finding {
        Finding {
            severity: severity(diagnostic.severity).to_owned(),
            rule: diagnostic.rule.to_owned(),
            line: diagnostic.span.line,
            column: diagnostic.column(),
            message: diagnostic.message.clone(),
            help: diagnostic.help.clone(),
            file: diagnostic.file.clone(),
        }
    }

    fn sentence(&self) -> String {
        let Finding { rule, line, message, .. } = self;
        match &self.file {
            Some(file) => format!("{file}, line {line}: {message} ({rule})"),
            None => format!("line {line}: {message} ({rule})"),
        }
    }
}

fn severity(severity: Severity) -> &'static str {
    match severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
    }
}
