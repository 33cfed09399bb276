//! The page of merged results (`page.html` beside this file). Text is escaped there.

use askama::Template;

use super::super::document::{Job, Verdict};
use super::super::duration;
use super::super::page::{Banner, Cell, Figure, Table, number, text};
use super::read::Entry;
use super::{Kind, Merged};

/// How many of the greatest are listed for themselves.
const GREATEST: usize = 20;

/// The page.
#[derive(Template)]
#[template(path = "cmd/report/merge/page.html")]
pub struct Page {
    title: String,
    verdict: Banner,
    figures: Vec<Figure>,
    wrong: Vec<Wrong>,
    tables: Vec<Table>,
}

/// A program that does not pass, or a result that is no good.
struct Wrong {
    name: String,
    /// What it is: refused on a machine, or broken.
    kind: String,
    /// The first of what is wrong, and how much more is.
    messages: Vec<String>,
    more: u64,
}

/// Makes it.
pub fn of(merged: &Merged) -> Page {
    let entries = &merged.entries;
    let class = if merged.is_good() { "good" } else { "bad" };
    Page {
        title: match entries.len() {
            1 => "1 program".to_owned(),
            programs => format!("{programs} programs"),
        },
        verdict: Banner { class, text: capital(&merged.sentence()) },
        figures: figures(merged),
        wrong: wrong(merged),
        tables: tables(merged),
    }
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

fn figures(merged: &Merged) -> Vec<Figure> {
    let warnings: u64 = merged.entries.iter().map(|entry| entry.warnings).sum();
    let mut figures = vec![
        Figure::new("pass", merged.count(Verdict::Pass).to_string()),
        Figure::new("fail", merged.count(Verdict::Fail).to_string()),
        Figure::new("refused", merged.count(Verdict::Refused).to_string()),
        Figure::new("broken", merged.troubled(Kind::Broken).to_string()),
        Figure::new("missing", merged.troubled(Kind::Missing).to_string()),
        Figure::new("time", duration(merged.sum(|job| job.total_seconds))),
        Figure::new("of it motion", duration(merged.sum(|job| job.motion_seconds))),
        Figure::new("cut", format!("{:.1} mm", merged.sum(|job| job.cut_mm))),
        Figure::new("rapid", format!("{:.1} mm", merged.sum(|job| job.rapid_mm))),
        Figure::new("warnings", warnings.to_string()),
    ];
    if let Some(job) = merged.by_error().first().and_then(|entry| entry.job.as_ref()) {
        let worst = format!("{:.4} of {:.4} mm", job.max_contour_error_mm, job.tolerance_mm);
        figures.push(Figure::new("greatest error", worst));
    }
    figures
}

fn wrong(merged: &Merged) -> Vec<Wrong> {
    let failed = merged.entries.iter().filter(|entry| entry.verdict != Verdict::Pass);
    let failed = failed.map(|entry| Wrong {
        name: entry.file.clone(),
        kind: format!("{} on {}", name(entry.verdict), entry.machine),
        messages: entry.wrong.clone(),
        more: entry.wrong_count.saturating_sub(entry.wrong.len() as u64),
    });
    let troubles = merged.troubles.iter().map(|trouble| Wrong {
        name: trouble.name.clone(),
        kind: trouble.kind.name().to_owned(),
        messages: vec![trouble.what.clone()],
        more: 0,
    });
    failed.chain(troubles).collect()
}

fn name(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Pass => "pass",
        Verdict::Fail => "FAIL",
        Verdict::Refused => "refused",
    }
}

fn verdict(verdict: Verdict) -> Cell {
    Cell { class: if verdict == Verdict::Pass { "good" } else { "bad" }, ..text(name(verdict)) }
}

fn tables(merged: &Merged) -> Vec<Table> {
    let greatest = |title, entries: Vec<&Entry>| {
        let shown = entries.into_iter().take(GREATEST);
        Table { rows: shown.map(row).collect(), ..Table::new(title, &COLUMNS) }
    };
    let mut tables = Vec::new();
    if merged.entries.len() > GREATEST {
        tables.push(greatest("Longest", merged.greatest_first(|job| job.total_seconds)));
        tables.push(greatest("Nearest to the tolerance", merged.by_error()));
    }
    let (passed, others): (Vec<_>, Vec<_>) =
        merged.entries.iter().partition(|entry| entry.verdict == Verdict::Pass);
    let mut all = Table::new("All programs, those that do not pass first", &COLUMNS);
    all.has_filter = !passed.is_empty() && !others.is_empty();
    all.rows = others.into_iter().chain(passed).map(row).collect();
    let mut made = Table::new("Made from", &["machine", "#programs", "profile"]);
    made.rows = merged
        .machines()
        .into_iter()
        .map(|((machine, sha256), programs)| {
            vec![text(machine), number(programs.to_string()), text(format!("sha256:{sha256}"))]
        })
        .collect();
    let mut by = Table::new("Made by", &["program"]);
    by.rows = merged.tools().into_iter().map(|tool| vec![text(tool)]).collect();
    tables.extend([all, made, by]);
    tables
}

const COLUMNS: [&str; 8] =
    ["verdict", "program", "machine", "#time", "#error, mm", "#of, mm", "#line", "#warnings"];

fn row(entry: &Entry) -> Vec<Cell> {
    let job = entry.job.as_ref();
    let of_job = |shown: &dyn Fn(&Job) -> String| number(job.map_or_else(|| "-".to_owned(), shown));
    vec![
        verdict(entry.verdict),
        text(&entry.file),
        text(&entry.machine),
        of_job(&|job| duration(job.total_seconds)),
        of_job(&|job| format!("{:.4}", job.max_contour_error_mm)),
        of_job(&|job| format!("{:.4}", job.tolerance_mm)),
        of_job(&|job| job.worst.map_or_else(|| "-".to_owned(), |worst| worst.line.to_string())),
        number(entry.warnings.to_string()),
    ]
}
