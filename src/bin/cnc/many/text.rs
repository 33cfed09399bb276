//! For people: a line a program on standard output, errors drawn on standard error.

use std::io::{self, Write};

use super::judged::Judged;
use super::sum::Sum;
use super::{Form, Judge};
use crate::args::Global;
use crate::plural::count;
use crate::report::{self, counts};

/// Names up to this long are aligned.
const NAME_MOST: usize = 48;

/// A line a program.
pub struct Lines<'a> {
    judge: Judge,
    global: &'a Global,
    width: usize,
}

impl<'a> Lines<'a> {
    pub fn new(judge: Judge, global: &'a Global) -> Lines<'a> {
        Lines { judge, global, width: 0 }
    }

    /// What stands behind the name.
    fn detail(&self, judged: &Judged) -> String {
        let mut parts = Vec::new();
        if let Some(report) = &judged.report {
            let [error, tolerance] = [report.max_contour_error_mm, report.tolerance_mm];
            parts.push(format!("contour {error:.4} of {tolerance:.4} mm"));
            parts.push(format!("{}, {:.2} s", count(report.ticks, "tick"), report.seconds));
        } else if let (Judge::Interpret, 0, Some(checked)) =
            (self.judge, judged.errors(), &judged.checked)
        {
            let summary = &checked.summary;
            parts.push(format!(
                "{}, {}",
                count(summary.lines, "line"),
                count(summary.moves, "move")
            ));
        }
        let found = counts(judged.errors(), judged.warnings());
        parts.extend(Some(found).filter(|found| !found.is_empty()));
        parts.extend(judged.not_shown());
        parts.extend(judged.dump.as_ref().map(|dump| format!("dump {dump}")));
        if judged.trouble.is_some() {
            let why = if judged.code() == 1 { "wrong file" } else { "not judged" };
            parts.push(why.to_owned());
        }
        parts.join(", ")
    }
}

impl Form for Lines<'_> {
    fn begin(&mut self, _out: &mut dyn Write, names: &[&str]) -> io::Result<()> {
        let widths = names.iter().map(|name| name.chars().count());
        self.width = widths.filter(|width| *width <= NAME_MOST).max().unwrap_or(0);
        Ok(())
    }

    fn program(&mut self, out: &mut dyn Write, judged: &Judged) -> io::Result<()> {
        let (name, quiet) = (&judged.name, self.global.quiet);
        if let Some(checked) = &judged.checked {
            report::diagnostics(name, &checked.diagnostics, self.global);
            report::said(name, checked, self.global);
        }
        let failures = judged.report.iter().flat_map(|report| &report.failures);
        if quiet {
            failures.for_each(|failure| say!("error: {name}: {failure}"));
            return Ok(());
        }
        let verdict = if judged.code() == 0 { "ok" } else { "FAIL" };
        let (width, detail) = (self.width, self.detail(judged));
        writeln!(out, "{}", format!("{verdict:<4}  {name:<width$}  {detail}").trim_end())?;
        failures.into_iter().try_for_each(|failure| writeln!(out, "        {failure}"))
    }

    fn end(&mut self, out: &mut dyn Write, sum: &Sum) -> io::Result<()> {
        if self.global.quiet {
            return Ok(());
        }
        writeln!(out, "{sum}")
    }
}
