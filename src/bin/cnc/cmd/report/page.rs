//! What a report holds, as its page (`page.html`) shows it. Text is escaped there; drawings are not.

use askama::Template;
use cnc::base::{Diagnostic, Severity};

/// The page.
#[derive(Template)]
#[template(path = "cmd/report/page.html")]
pub struct Page {
    pub title: String,
    pub machine: String,
    pub verdict: Banner,
    pub figures: Vec<Figure>,
    pub findings: Vec<Finding>,
    pub more_findings: u64,
    /// The style sheet of all drawings, as an element: they have none of their own here.
    pub drawings_style: String,
    /// The path as SVG: what lines and colours mean, then a view each.
    pub path: Vec<String>,
    /// Curves over time as SVG.
    pub curves: Vec<String>,
    pub tables: Vec<Table>,
    /// The profile as TOML.
    pub profile: String,
    pub origins: Vec<Figure>,
}

/// The verdict in a sentence.
pub struct Banner {
    /// `good` or `bad`.
    pub class: &'static str,
    pub text: String,
}

/// A value with its name.
pub struct Figure {
    pub name: String,
    pub value: String,
}

/// An error or a warning.
pub struct Finding {
    /// `bad` or `warn`.
    pub class: &'static str,
    pub rule: &'static str,
    pub line: u32,
    pub message: String,
    /// The line at fault.
    pub text: String,
    pub help: Option<String>,
}

/// A table.
pub struct Table {
    pub title: &'static str,
    pub names: Vec<Cell>,
    /// Whether rows with a good cell can be left out.
    pub has_filter: bool,
    pub rows: Vec<Vec<Cell>>,
}

/// A cell of a table.
pub struct Cell {
    pub text: String,
    /// `number`, which stands at its right, `good`, `bad`, or none.
    pub class: &'static str,
}

impl Page {
    /// Drawings for this page.
    pub fn drawings(&self, svgs: &[String]) -> Vec<String> {
        svgs.iter().map(|svg| svg.replacen(&self.drawings_style, "", 1)).collect()
    }
}

impl Figure {
    pub fn new(name: impl Into<String>, value: impl Into<String>) -> Figure {
        Figure { name: name.into(), value: value.into() }
    }
}

impl Finding {
    pub fn of(diagnostic: &Diagnostic) -> Finding {
        Finding {
            class: if diagnostic.severity == Severity::Error { "bad" } else { "warn" },
            rule: diagnostic.rule,
            line: diagnostic.span.line,
            message: diagnostic.message.clone(),
            text: diagnostic.text.clone(),
            help: diagnostic.help.clone(),
        }
    }
}

impl Table {
    /// A table whose columns are numbers where the name begins with `#`.
    pub fn new(title: &'static str, names: &[&str]) -> Table {
        let names = names.iter().map(|name| match name.strip_prefix('#') {
            Some(name) => number(name),
            None => text(*name),
        });
        Table { title, names: names.collect(), has_filter: false, rows: Vec::new() }
    }
}

pub fn text(text: impl Into<String>) -> Cell {
    Cell { text: text.into(), class: "" }
}

pub fn number(text: impl Into<String>) -> Cell {
    Cell { text: text.into(), class: "number" }
}
