//! Workflow commands of GitHub Actions: each marks a line of a file in a pull request.
//!
//! Its runner reads them from any output of a step. `endColumn` is the last column that is marked, for
//! it is taken as `col` where it is left out. Warnings and errors that are not shown are told by the
//! runner's own limits (10 of each a step) and by the sum on standard error.

use std::io::{self, Write};
use std::path::Path;

use cnc::base::source::shown;

use super::judged::{Finding, Judged, severity_name};
use super::sum::Sum;
use super::{Form, plain};
use crate::report::counts;

/// A command a finding.
pub struct Annotations;

impl Form for Annotations {
    fn program(&mut self, out: &mut dyn Write, judged: &Judged) -> io::Result<()> {
        for finding in judged.findings() {
            annotation(out, judged, &finding)?;
        }
        if let Some(reason) = judged.unread() {
            writeln!(out, "::error {}title=cnc::{}", file(&judged.path), message(&reason))?;
        }
        if let Some(cut) = judged.not_shown() {
            let counts = counts(judged.errors(), judged.warnings());
            let text = message(&format!("{}: {counts}, {cut}", judged.name));
            writeln!(out, "::notice {}title=cnc::{text}", file(&judged.path))?;
        }
        Ok(())
    }

    fn end(&mut self, _out: &mut dyn Write, _sum: &Sum) -> io::Result<()> {
        Ok(())
    }
}

fn annotation(out: &mut dyn Write, judged: &Judged, finding: &Finding) -> io::Result<()> {
    let path = finding.file.map_or(judged.path.as_path(), Path::new);
    write!(out, "::{} {}", severity_name(finding.severity), file(path))?;
    let mut text = finding.file.unwrap_or(&judged.name).to_owned();
    if let Some(place) = finding.place {
        write!(out, "line={},", place.line)?;
        text += &format!(":{}", place.line);
        if let Some([first, after]) = place.columns {
            write!(out, "col={first},endColumn={},", (after - 1).max(first))?;
            text += &format!(":{first}");
        }
    }
    text += &format!(": {}", finding.message);
    if let Some(help) = finding.help {
        text += &format!("\nhelp: {help}");
    }
    for call in finding.calls {
        let file = call.file.as_deref().unwrap_or(&judged.name);
        text += &format!("\ncalled at {file}:{}", call.line);
    }
    writeln!(out, "title=cnc {}::{}", property(&finding.rule), message(&text))
}

/// `file=…,`; nothing of standard input, which is no file.
fn file(path: &Path) -> String {
    match path.to_str() {
        Some("-") => String::new(),
        _ => format!("file={},", property(&shown(&plain(path)))),
    }
}

/// As the runner reads text.
fn message(text: &str) -> String {
    text.replace('%', "%25").replace('\r', "%0D").replace('\n', "%0A")
}

/// As it reads the value of a property.
fn property(text: &str) -> String {
    message(text).replace(':', "%3A").replace(',', "%2C")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_means_something_to_the_runner_is_written_so_that_it_does_not() {
        assert_eq!(message("50 %\r\na::b, c"), "50 %25%0D%0Aa::b, c");
        assert_eq!(property("a,b:c%\n"), "a%2Cb%3Ac%25%0A");
        assert_eq!(file(Path::new("./parts//x, y.nc")), "file=parts/x%2C y.nc,");
        assert_eq!(file(Path::new("a\x1b[31m\n::b.nc")), "file=a\u{FFFD}[31m\u{FFFD}%3A%3Ab.nc,");
        assert_eq!(file(Path::new("-")), "");
    }
}
