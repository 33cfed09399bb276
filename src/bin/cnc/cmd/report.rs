//! `cnc report`: all about a program's job on one page that needs nothing else.

mod page;

use std::cell::RefCell;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use askama::Template;
use cnc::base::Command;
use cnc::base::machine::Protocol;
use cnc::plot::{Quantity, Traces, View, style_element};
use cnc::step::{Phases, Summary};
use cnc::verify::{self, Verdict};
use cnc::wire::{Job, lint};

use self::page::{Banner, Figure, Finding, Page, Table, number, text};
use super::plot::{self, curves};
use crate::args::Global;
use crate::exit::{Exit, ExitWith, Failure, Outcome, unless_unread};
use crate::program::{MotionArgs, Program};
use crate::{input, output};
use cnc::wire_io::journal::hex;

/// Seams that are listed at most.
const SEAMS_MAX: usize = 200;

/// Put all about a program on one HTML page: verdict, drawings, times, seams, limits, warnings
#[derive(Debug, clap::Args)]
pub struct Args {
    /// NC program; - is standard input
    file: PathBuf,
    /// Where the page goes [default: standard output]
    #[arg(short, long, value_name = "OUT")]
    output: Option<PathBuf>,
    #[command(flatten)]
    motion: MotionArgs,
}

pub fn run(args: &Args, global: &Global) -> Outcome {
    if global.json {
        let reason = "a report is a page; interpolate --json and verify --json have its figures";
        return Err(anyhow!(reason).into());
    }
    let machine = input::machine(global)?;
    let source = input::program(&args.file)?;
    let travel_mm = plot::travel_mm(&machine);
    let judge = |machine| Program::judge(&args.file, source.clone(), machine, &args.motion, global);
    let program = judge(machine.clone())?;
    let mut page = head(&program);
    let mut exit = Exit::Ok;
    if program.checked.errors > 0 {
        exit = Exit::BadInput;
        let endless = judge(plot::without_travel(machine))?;
        if endless.checked.errors == 0 {
            page.path = Some(page.drawing(&plot::sheet_of(&endless, travel_mm, &View::ALL)?));
        }
    } else {
        page.path = Some(page.drawing(&plot::sheet_of(&program, travel_mm, &View::ALL)?));
        if !job(&mut page, &program)? {
            exit = Exit::BadInput;
        }
    }
    let html = page.render().context("the page cannot be written")?;
    match args.output.as_deref().filter(|path| *path != Path::new("-")) {
        Some(path) => output::whole_file(path, |out| Ok(out.write_all(html.as_bytes())?))?,
        None => {
            let mut out = io::stdout().lock();
            unless_unread(out.write_all(html.as_bytes()).and_then(|()| out.flush()))?;
        }
    }
    if exit == Exit::BadInput && !global.quiet {
        say!("{}: {}", program.source.name(), page.verdict.text);
    }
    Ok(exit)
}

/// What is known of a program before it is planned.
fn head(program: &Program) -> Page {
    let checked = &program.checked;
    let findings: Vec<Finding> = checked.diagnostics.iter().map(Finding::of).collect();
    let more_findings = (checked.errors + checked.warnings).saturating_sub(findings.len() as u64);
    let errors = checked.errors;
    let wrong = match errors {
        1 => "there is 1 error".to_owned(),
        errors => format!("there are {errors} errors"),
    };
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
        verdict: Banner { class: "bad", text: format!("Cannot be run: {wrong}") },
        figures: Vec::new(),
        findings,
        more_findings,
        drawings_style: style_element(),
        path: None,
        curves: Vec::new(),
        tables: Vec::new(),
        profile: machine.to_toml().to_owned(),
        origins,
    }
}

/// Plans the job, holds it against its path and proves it for the bus. Gives whether all holds.
fn job(page: &mut Page, program: &Program) -> Result<bool, Failure> {
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
        .verified(at_hand)
        .with_context(|| program.source.name().to_owned())
        .or_bad_input()?;
    let error = curves::errors(program, at_hand, false)?.to_string();
    let bus = has_nodes.then(|| {
        let job = Job::new(kept, start_steps, machine)?;
        lint(&job, machine)
    });
    let bus_holds = bus.as_ref().is_none_or(Result::is_ok);
    let holds = report.verdict == Verdict::Pass && bus_holds;
    page.verdict = match holds {
        true => Banner {
            class: "good",
            text: format!(
                "Pass: at most {:.4} mm off the path (bound {:.4} mm), end point exact",
                report.max_contour_error_mm, report.tolerance_mm
            ),
        },
        false => Banner { class: "bad", text: format!("Fail: {}", reason(&report, &bus)) },
    };
    figures(page, program, &summary, &report);
    let name = program.source.file_name();
    let quantities = [Quantity::Speed, Quantity::Acceleration, Quantity::StepRate];
    let traced = quantities.map(|quantity| traces.chart(quantity, name).to_string());
    page.curves = [error].iter().chain(&traced).map(|svg| page.drawing(svg)).collect();
    page.tables =
        vec![times(&summary), seams(program, &summary), limits(&summary), checks(&report)];
    if let Some(Ok(proof)) = &bus {
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
    Ok(holds)
}

fn reason<T, E: std::fmt::Display>(report: &verify::Report, bus: &Option<Result<T, E>>) -> String {
    let bus = bus.as_ref().and_then(|bus| bus.as_ref().err()).map(ToString::to_string);
    report.failures.iter().cloned().chain(bus).collect::<Vec<_>>().join("; ")
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
