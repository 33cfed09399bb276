//! `cnc report`: all about a program's job on one page that needs nothing else.

mod document;
mod merge;
mod page;

use std::cell::RefCell;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use askama::Template;
use cnc::base::Command;
use cnc::base::machine::Protocol;
use cnc::plot::{Chart, Quantity, Size, Traces, style_element};
use cnc::step::{Phases, Summary};
use cnc::verify::{self, Verdict};
use cnc::wire::{Job, Proof, lint};

use self::document::Document;
use self::page::{Banner, Figure, Finding, Page, Table, number, text};
use super::plot::{self, curves};
use crate::args::Global;
use crate::exit::{Exit, ExitWith, Failure, Outcome, unless_unread};
use crate::program::{MotionArgs, Program};
use crate::{input, output};
use cnc::wire_io::journal::hex;

/// Seams that are listed at most.
const SEAMS_MAX: usize = 200;

/// What says how one program is read and planned.
const OF_ONE: [&str; 10] = [
    "file",
    "feed",
    "feed_override",
    "start",
    "dialect",
    "block_delete",
    "lenient",
    "include",
    "max_passes",
    "tools",
];

/// Put all about a program on one HTML page: verdict, drawings, times, seams, limits, warnings
///
/// With --json: what comes out of it as one document; the page only where -o says so.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// NC program; - is standard input
    #[arg(required_unless_present = "merge")]
    file: Option<PathBuf>,
    /// Where the page goes [default: standard output]
    #[arg(short, long, value_name = "OUT")]
    output: Option<PathBuf>,
    /// Instead: one page of many results, which `report --json` has written: folders with *.json and
    /// *.jsonl, or files
    #[arg(long, value_name = "RESULTS", num_args = 1.., conflicts_with_all = OF_ONE)]
    merge: Vec<PathBuf>,
    /// The programs that results are expected of, a name a line: those without one are told
    #[arg(long, value_name = "LIST", requires = "merge", conflicts_with = "file")]
    expected: Option<PathBuf>,
    #[command(flatten)]
    motion: MotionArgs,
}

pub fn run(args: &Args, global: &Global) -> Outcome {
    if global.json && args.output.as_deref() == Some(Path::new("-")) {
        let reason = "with --json standard output takes the document: name a file for the page";
        return Err(anyhow!(reason).into());
    }
    output::check_writable(&[args.output.as_deref()])?;
    match &args.file {
        Some(file) => of_program(file, args, global),
        None => {
            global.refuse(&["machine"], "results of `report --json` name their machines")?;
            merge::run(args, global)
        }
    }
}

fn of_program(file: &Path, args: &Args, global: &Global) -> Outcome {
    let machine = input::machine(global)?;
    let source = input::program(file)?;
    let judge = |machine| Program::judge(file, source.clone(), machine, &args.motion, global);
    let program = judge(machine.clone())?;
    let mut document = Document::of(&program);
    let is_drawn = args.output.is_some() || !global.json;
    let ran = match program.checked.errors {
        0 => Some(ran(&program, is_drawn)?),
        _ => None,
    };
    if let Some(ran) = &ran {
        document.take(ran, &program);
    }
    if is_drawn {
        let mut page = head(&program, &document);
        let travel_mm = plot::travel_mm(&machine);
        let views = plot::all_views(&program);
        let path = |program| plot::draw(program, travel_mm, views, |sheet| sheet.parts());
        if let Some(ran) = &ran {
            page.path = page.drawings(&path(&program)?);
            job(&mut page, &program, ran);
        } else {
            let endless = judge(plot::without_travel(machine))?;
            if endless.checked.errors == 0 {
                page.path = page.drawings(&path(&endless)?);
            }
        }
        put(&page, args)?;
    }
    if global.json {
        unless_unread(writeln!(io::stdout(), "{}", serde_json::to_string(&document)?))?;
    }
    if document.passes() {
        return Ok(Exit::Ok);
    }
    if !global.quiet {
        say!("{}: {}", program.source.name(), document.sentence());
    }
    Ok(Exit::BadInput)
}

/// Writes a page to where it is wanted.
fn put(page: &impl Template, args: &Args) -> Result<(), Failure> {
    let html = page.render().context("the page cannot be written")?;
    match args.output.as_deref().filter(|path| *path != Path::new("-")) {
        Some(path) => output::whole_file(path, |out| Ok(out.write_all(html.as_bytes())?)),
        None => {
            let mut out = io::stdout().lock();
            Ok(unless_unread(out.write_all(html.as_bytes()).and_then(|()| out.flush()))?)
        }
    }
}

/// What is known of a program before it is planned.
fn head(program: &Program, document: &Document) -> Page {
    let checked = &program.checked;
    let findings: Vec<Finding> = checked.diagnostics.iter().map(Finding::of).collect();
    let more_findings = (checked.errors + checked.warnings).saturating_sub(findings.len() as u64);
    let class = if document.passes() { "good" } else { "bad" };
    let origin =
        |name: &str, sha256: &[u8; 32]| Figure::new(name, format!("sha256:{}", hex(sha256)));
    let machine = &program.machine;
    let mut origins = vec![
        origin(program.source.file_name(), &program.sha256),
        origin(&format!("machine {}", machine.id), &machine.sha256()),
        Figure::new("made by", format!("cnc {}", env!("CARGO_PKG_VERSION"))),
    ];
    origins.extend(program.inputs.iter().map(|input| origin(&input.name, &input.sha256)));
    Page {
        title: program.source.file_name().to_owned(),
        machine: machine.to_string(),
        verdict: Banner { class, text: document.sentence() },
        figures: Vec::new(),
        findings,
        more_findings,
        drawings_style: style_element(),
        path: Vec::new(),
        curves: Vec::new(),
        tables: Vec::new(),
        profile: machine.to_toml().to_owned(),
        origins,
    }
}

/// A job that was planned, held against its path and proved for the bus.
struct Ran<'p> {
    summary: Summary,
    traces: Traces<'p>,
    report: verify::Report,
    /// How far it is off over time, where a page is wanted.
    error: Option<Chart>,
    /// None where the machine has no bus.
    bus: Option<Result<Proof, String>>,
}

fn ran(program: &Program, is_drawn: bool) -> Result<Ran<'_>, Failure> {
    let machine = &program.machine;
    let summary = RefCell::new(Summary::with_times(machine));
    let start_steps = machine.nearest_steps(&program.start_mm());
    let mut traces = Traces::new(machine, machine.bus.tick_us, start_steps);
    let has_nodes = machine.bus.protocol != Protocol::None;
    let mut kept = Vec::new();
    for command in program.commands(&summary)? {
        let command = command?;
        if let Command::Tick(tick) = &command {
            traces.tick(tick);
        }
        if has_nodes {
            kept.push(command);
        }
        if let Some(times) = &mut summary.borrow_mut().times {
            while times.pop().is_some() {}
        }
    }
    let mut summary = summary.into_inner();
    if let Some(times) = &mut summary.times {
        times.finish();
    }
    let at_hand = has_nodes.then_some(kept.as_slice());
    let report = program
        .verified(at_hand, None)
        .with_context(|| program.source.name().to_owned())
        .or_bad_input()?;
    let error = match is_drawn {
        true => Some(curves::errors(program, at_hand, false)?),
        false => None,
    };
    let proof = || lint(&Job::new(kept, start_steps, machine)?, machine);
    let bus = has_nodes.then(|| proof().map_err(|error| error.to_string()));
    Ok(Ran { summary, traces, report, error, bus })
}

/// Puts the job on the page.
fn job(page: &mut Page, program: &Program, ran: &Ran<'_>) {
    let Ran { summary, traces, report, error, bus } = ran;
    figures(page, program, summary, report);
    let quantities = [Quantity::Speed, Quantity::Acceleration, Quantity::StepRate];
    let charts = error.iter().cloned().chain(quantities.map(|quantity| traces.chart(quantity)));
    let svgs: Vec<String> =
        charts.map(|chart| Chart { size: Size::Column, ..chart }.to_string()).collect();
    page.curves = page.drawings(&svgs);
    page.tables = vec![times(summary), seams(program, summary), limits(summary), checks(report)];
    if let Some(Ok(proof)) = bus {
        let mut table = Table::new("Bus", &["what", "#value"]);
        for (what, value) in [
            ("node buffers", proof.buffers),
            ("bytes that the host sends", proof.bytes),
            ("pairs of bytes held against every node", proof.pairs),
            ("harmless pairs that look like commands", proof.avoided),
            ("nodes on the bus", proof.nodes as u64),
        ] {
            table.rows.push(vec![text(what), number(value.to_string())]);
        }
        page.tables.push(table);
    }
}

fn figures(page: &mut Page, program: &Program, summary: &Summary, report: &verify::Report) {
    let machine = &program.machine;
    let checked = &program.checked.summary;
    let mut add = |name: &str, value: String| page.figures.push(Figure::new(name, value));
    add("time", duration(summary.total_s(machine)));
    add("of it motion", duration(summary.motion_s(machine)));
    add("events", summary.events.to_string());
    add("cut", format!("{:.1} mm", summary.cut_mm));
    add("rapid", format!("{:.1} mm", summary.rapid_mm));
    add("ticks", summary.ticks.to_string());
    add("lines", checked.lines.to_string());
    add("moves", checked.moves.to_string());
    if let Some(rms_mm) = report.rms_contour_error_mm {
        add("error, root mean square", format!("{rms_mm:.4} mm"));
    }
    for profile in &machine.axes {
        let axis = profile.axis;
        if let Some([low, high]) = checked.extents_mm[axis] {
            add(&format!("extent of {axis}"), format!("{low:.3} to {high:.3}"));
        }
    }
}

/// Hours, minutes and seconds as people say them.
fn duration(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match (whole / 3600, whole / 60 % 60) {
        (0, 0) => format!("{seconds:.1} s"),
        (0, minutes) => format!("{minutes} min {} s", whole % 60),
        (hours, minutes) => format!("{hours} h {minutes} min"),
    }
}

fn times(summary: &Summary) -> Table {
    let names = ["tool", "#cut, s", "#rapid, s", "#dwell, s", "#refill, s", "#total, s", "#events"];
    let mut table = Table::new("Time by phase and tool", &names);
    let Some(times) = &summary.times else { return table };
    let row = |tool: String, phases: &Phases| {
        let Phases { cut_s, rapid_s, dwell_s, refill_s, events } = *phases;
        let seconds = [cut_s, rapid_s, dwell_s, refill_s, phases.total_s()];
        let seconds = seconds.map(|seconds| number(format!("{seconds:.2}")));
        [text(tool)].into_iter().chain(seconds).chain([number(events.to_string())]).collect()
    };
    for (tool, phases) in times.tools() {
        let name = tool.map_or("none".to_owned(), |tool| format!("T{tool}"));
        table.rows.push(row(name, phases));
    }
    table.rows.push(row("all".to_owned(), &times.total()));
    table
}

fn seams(program: &Program, summary: &Summary) -> Table {
    let mut table = Table::new("Ends of node buffers", &["#tick", "#line", "where", "#costs, s"]);
    let seams = summary.seams(&program.machine);
    for seam in seams.iter().take(SEAMS_MAX) {
        table.rows.push(vec![
            number(seam.tick.to_string()),
            number(seam.line.to_string()),
            text(seam.kind.name()),
            number(format!("{:.2}", seam.lost_s)),
        ]);
    }
    if seams.len() > SEAMS_MAX {
        let left = format!("{} more", seams.len() - SEAMS_MAX);
        table.rows.push(vec![text(left), text(""), text(""), text("")]);
    }
    table
}

fn limits(summary: &Summary) -> Table {
    let mut table = Table::new("What limits the speed", &["limit"]);
    table.rows = summary.bounds.iter().map(|bound| vec![text(bound.to_string())]).collect();
    table
}

fn checks(report: &verify::Report) -> Table {
    let names = ["check", "axis", "#value", "#limit", "unit", "verdict", "#tick", "#line"];
    let mut table = Table::new("Verification", &names);
    for check in &report.limits {
        let place =
            |of: fn(&verify::Place) -> String| check.at.as_ref().map(of).unwrap_or_default();
        table.rows.push(vec![
            text(check.check),
            text(check.axis.map_or_else(String::new, |axis| axis.to_string())),
            number(format!("{:.4}", check.value)),
            number(format!("{:.4}", check.limit)),
            text(check.unit),
            text(if check.verdict == Verdict::Fail { "FAIL" } else { "pass" }),
            number(place(|at| at.tick.to_string())),
            number(place(|at| at.line.to_string())),
        ]);
    }
    table
}
