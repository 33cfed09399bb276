//! Draws diagnostics for people (annotate-snippets): rustc's look, on standard error.

use std::io::{self, IsTerminal, Write};
use std::ops::Range;

use annotate_snippets::{AnnotationKind, Group, Level, Origin, Renderer, Snippet};
use clap::ColorChoice;
use cnc::base::{Diagnostic, Severity};
use cnc::gcode::MessageKind;
use cnc::interp::Checked;

use crate::args::Global;
use crate::plural::count;

/// Draws diagnostics on standard error: errors always, warnings unless `--quiet`.
pub fn diagnostics<'a>(
    source_name: &str,
    diagnostics: impl IntoIterator<Item = &'a Diagnostic>,
    global: &Global,
) {
    let renderer = if use_color(global) { Renderer::styled() } else { Renderer::plain() };
    let mut out = io::stderr().lock();
    for diagnostic in diagnostics {
        if diagnostic.severity == Severity::Error || !global.quiet {
            // Nothing can be said to a standard error that is gone.
            let _ = writeln!(out, "{}\n", draw(source_name, diagnostic, &renderer));
        }
    }
}

/// Faults of a profile or a configuration that are drawn: what else is wrong mostly follows from them.
const FAULTS_MAX: usize = 20;

/// Draws what is wrong with a profile or a configuration, and says how much more there is.
pub fn faults(file: &str, faults: &[Diagnostic], global: &Global) {
    diagnostics(file, faults.iter().take(FAULTS_MAX), global);
    let more = faults.len().saturating_sub(FAULTS_MAX);
    if more > 0 {
        say!("{file}: and {}", count(more as u64, "more fault"));
    }
}

/// Says what a check of a program found, and how much of it.
pub fn checked(source_name: &str, checked: &Checked, global: &Global) {
    diagnostics(source_name, &checked.diagnostics, global);
    said(source_name, checked, global);
    totals(source_name, checked, global);
}

/// What the program says to the operator, unless `--quiet`.
pub fn said(source_name: &str, checked: &Checked, global: &Global) {
    if global.quiet {
        return;
    }
    for said in &checked.said {
        let file = said.file.as_deref().unwrap_or(source_name);
        let kind = match said.kind {
            MessageKind::Message => "message",
            MessageKind::Debug => "debug",
            MessageKind::Print => "print",
        };
        say!("{file}:{}: {kind}: {}", said.line, said.text);
    }
    let more = checked.messages.saturating_sub(checked.said.len() as u64);
    if more > 0 {
        say!("{source_name}: {}", count(more, "more message"));
    }
}

/// The last line of a check: `3 errors, 1 warning`, with what was not drawn; none if nothing was
/// found.
pub fn totals(source_name: &str, checked: &Checked, global: &Global) {
    let (errors, warnings) = (checked.errors, checked.warnings);
    if errors == 0 && (warnings == 0 || global.quiet) {
        return;
    }
    let max = global.max_errors;
    let cut = if errors.max(warnings) > max as u64 {
        format!(" (at most {max} of each are shown: --max-errors)")
    } else {
        String::new()
    };
    say!("{source_name}: {}{cut}", counts(errors, warnings));
}

/// `3 errors, 1 warning`; nothing of neither.
pub fn counts(errors: u64, warnings: u64) -> String {
    let counts = [(errors, "error"), (warnings, "warning")].into_iter();
    let counts = counts.filter(|(number, _)| *number > 0);
    counts.map(|(number, one)| count(number, one)).collect::<Vec<_>>().join(", ")
}

fn use_color(global: &Global) -> bool {
    match global.color {
        ColorChoice::Always => true,
        ColorChoice::Never => false,
        ColorChoice::Auto => {
            let is_unwanted = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
            let is_dumb = std::env::var_os("TERM").is_some_and(|term| term == "dumb");
            io::stderr().is_terminal() && !is_unwanted && !is_dumb
        }
    }
}

fn draw(program_name: &str, diagnostic: &Diagnostic, renderer: &Renderer) -> String {
    let level = match diagnostic.severity {
        Severity::Error => Level::ERROR,
        Severity::Warning => Level::WARNING,
    };
    let title = level.primary_title(&diagnostic.message).id(diagnostic.rule);
    let source_name = diagnostic.file.as_deref().unwrap_or(program_name);
    let mut group = if diagnostic.text.trim().is_empty() {
        let line = diagnostic.span.line as usize;
        let column = diagnostic.column() as usize;
        title.element(Origin::path(source_name).line(line).char_column(column))
    } else {
        snippet(title, source_name, diagnostic)
    };
    if !diagnostic.calls.is_empty() {
        group = group.element(Level::NOTE.message(called(program_name, diagnostic)));
    }
    if let Some(help) = &diagnostic.help {
        group = group.element(Level::HELP.message(help));
    }
    renderer.render(&[group])
}

/// Where the calls that led to a fault were made: lines, with their files where these differ.
fn called(program_name: &str, diagnostic: &Diagnostic) -> String {
    let calls = &diagnostic.calls;
    let is_within = |file: &Option<String>| *file == diagnostic.file;
    if calls.iter().all(|call| is_within(&call.file)) {
        let lines: Vec<String> = calls.iter().map(|call| call.line.to_string()).collect();
        return format!("called on line {}", lines.join(", "));
    }
    let places = calls.iter().map(|call| {
        let file = call.file.as_deref().unwrap_or(program_name);
        format!("{file}:{}", call.line)
    });
    format!("called at {}", places.collect::<Vec<String>>().join(", "))
}

/// The line with the words at fault marked. Of a long line only the surroundings are there: its
/// true column stands in the place above it.
fn snippet<'a>(
    title: annotate_snippets::Title<'a>,
    source_name: &'a str,
    diagnostic: &'a Diagnostic,
) -> Group<'a> {
    let line = diagnostic.span.line as usize;
    let annotation = AnnotationKind::Primary.span(marked(diagnostic));
    let snippet = Snippet::source(&diagnostic.text).line_start(line).annotation(annotation);
    if diagnostic.text_offset == 0 {
        return title.element(snippet.path(source_name));
    }
    let column = diagnostic.column() as usize;
    title.element(Origin::path(source_name).line(line).char_column(column)).element(snippet)
}

/// The bytes of the text to mark, between characters.
fn marked(diagnostic: &Diagnostic) -> Range<usize> {
    let text = &diagnostic.text;
    let within = |at: u32| {
        let mut at = (at.saturating_sub(diagnostic.text_offset) as usize).min(text.len());
        while !text.is_char_boundary(at) {
            at -= 1;
        }
        at
    };
    within(diagnostic.span.start)..within(diagnostic.span.end)
}
