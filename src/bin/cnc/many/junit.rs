//! JUnit's XML, as CI systems read it: a test case a program. It has no times: the same programs give the
//! same bytes.

use std::fmt::Write as _;
use std::io::{self, Write};

use cnc::base::Severity;
use cnc::base::source::shown;

use super::judged::{Finding, Judged, severity_name};
use super::sum::Sum;
use super::{Form, Judge, plain};
use crate::plural::count;

/// One suite. Its head has the counts, so the cases are kept until all are there.
pub struct Suite {
    judge: Judge,
    cases: String,
}

impl Suite {
    pub fn new(judge: Judge) -> Suite {
        Suite { judge, cases: String::new() }
    }

    fn case(&mut self, judged: &Judged) -> Result<(), std::fmt::Error> {
        let file = shown(&plain(&judged.path));
        let (class, name) = (self.judge.name().replace(' ', "."), escaped(&judged.name));
        let findings = judged.findings();
        let is_error = |finding: &&Finding| finding.severity == Severity::Error;
        let lines = |of: Vec<&Finding>| -> String {
            of.into_iter().map(|finding| line(judged, finding)).collect()
        };
        let cases = &mut self.cases;
        write!(cases, "    <testcase classname=\"{class}\" name=\"{name}\"")?;
        writeln!(cases, " file=\"{}\">", escaped(&file))?;
        if let Some(reason) = judged.unread() {
            let reason = escaped(&reason);
            writeln!(cases, "      <error type=\"unread\" message=\"{reason}\">{reason}</error>")?;
        } else if judged.code() > 0 {
            // With --max-errors 0 none is there to be shown.
            let first = findings.iter().find(is_error);
            let rule = escaped(first.map_or("errors", |first| &first.rule));
            let more = judged.faults().saturating_sub(u64::from(first.is_some()));
            let head = match first.map(|first| line(judged, first)) {
                None => count(more, "error"),
                Some(first) if more == 0 => first.trim_end().to_owned(),
                Some(first) => {
                    format!("{} (and {})", first.trim_end(), count(more, "more error"))
                }
            };
            let head = escaped(&head);
            let body = escaped(&lines(findings.iter().filter(is_error).collect()));
            writeln!(cases, "      <failure type=\"{rule}\" message=\"{head}\">{body}</failure>")?;
        }
        let warnings = lines(findings.iter().filter(|finding| !is_error(finding)).collect());
        let warnings = escaped(&warnings);
        if !warnings.is_empty() {
            writeln!(cases, "      <system-out>{warnings}</system-out>")?;
        }
        writeln!(cases, "    </testcase>")
    }
}

/// `part.nc:4:1: error[arc-radius]: …`
fn line(judged: &Judged, finding: &Finding) -> String {
    let file = finding.file.unwrap_or(&judged.name);
    let place = match finding.place.map(|place| (place.line, place.columns)) {
        None => String::new(),
        Some((line, None)) => format!(":{line}"),
        Some((line, Some([first, _]))) => format!(":{line}:{first}"),
    };
    let (severity, rule) = (severity_name(finding.severity), &finding.rule);
    let help = finding.help.map(|help| format!("; help: {help}")).unwrap_or_default();
    format!("{file}{place}: {severity}[{rule}]: {}{help}\n", finding.message)
}

impl Form for Suite {
    fn program(&mut self, _out: &mut dyn Write, judged: &Judged) -> io::Result<()> {
        self.case(judged).map_err(io::Error::other)
    }

    fn end(&mut self, out: &mut dyn Write, sum: &Sum) -> io::Result<()> {
        let counts = format!(
            "tests=\"{}\" failures=\"{}\" errors=\"{}\"",
            sum.programs, sum.failed, sum.unread
        );
        let name = self.judge.name();
        writeln!(out, "<?xml version=\"1.0\" encoding=\"UTF-8\"?>")?;
        writeln!(out, "<testsuites name=\"{name}\" {counts}>")?;
        writeln!(out, "  <testsuite name=\"{name}\" {counts} skipped=\"0\">")?;
        out.write_all(self.cases.as_bytes())?;
        writeln!(out, "  </testsuite>\n</testsuites>")
    }
}

/// As text and as the value of an attribute; characters that XML does not have are replaced.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\n' => escaped.push_str("&#10;"),
            '\t' => escaped.push_str("&#9;"),
            '\r' => escaped.push_str("&#13;"),
            '\0'..='\u{1f}' | '\u{fffe}' | '\u{ffff}' => escaped.push('\u{fffd}'),
            other => escaped.push(other),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_xml_does_not_have_is_replaced() {
        assert_eq!(
            escaped("a<b>&\"\u{1}\n\u{ffff}é"),
            "a&lt;b&gt;&amp;&quot;\u{fffd}&#10;\u{fffd}é"
        );
    }
}
