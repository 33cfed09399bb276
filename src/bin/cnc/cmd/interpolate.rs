//! `cnc interpolate`: plans a program and interpolates it to steps; the command dump, or a summary.

mod difference;
mod pulses;
mod seams;
mod speeds;
mod times;

use std::cell::RefCell;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::anyhow;
use clap::ValueEnum;
use cnc::base::rounding::six_digits;
use cnc::base::{Axis, Machine};
use cnc::interp::RunError;
use cnc::plan::Feed;
use cnc::step::Summary;
use cnc::tape::{self, Writer};
use serde_json::{Map, Value, json};

use crate::args::Global;
use crate::exit::{Exit, Failure, Outcome};
use crate::plural::count;
use crate::program::{Encoder, MotionArgs, Program};
use crate::{meter, output};

/// Plan a program and interpolate it to steps per axis per tick
#[derive(Debug, clap::Args)]
pub struct Args {
    /// NC program; - is standard input
    file: PathBuf,
    /// Write the command dump instead of a summary
    #[arg(long, conflicts_with = "report")]
    csv: bool,
    /// Where the dump goes [default: standard output]
    #[arg(short, long, value_name = "OUT", requires = "csv")]
    output: Option<PathBuf>,
    /// What stands in the dump's axis columns
    #[arg(long, value_enum, default_value_t, requires = "csv")]
    encoding: Encoding,
    /// What turns the path into counts
    #[arg(long, value_enum, default_value_t)]
    encoder: Encoder,
    /// Who interpolates, and how
    #[arg(long, value_enum, default_value_t, value_name = "METHOD")]
    method: Method,
    #[command(flatten)]
    word: difference::WordArgs,
    /// Draw what the method comes to (methods b and pulse)
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    #[command(flatten)]
    report: ReportArgs,
    #[command(flatten)]
    motion: MotionArgs,
}

/// What is told instead of a summary.
#[derive(Debug, clap::Args)]
#[group(id = "report", multiple = false)]
struct ReportArgs {
    /// Tell what sets the speed of each block: as JSON, one object a line
    #[arg(long)]
    explain_feed: bool,
    /// Tell what each end of a node buffer costs, and what the next best choice would
    #[arg(long, value_enum, value_name = "report")]
    seams: Option<SeamsArg>,
    /// Tell what each block takes and each tool: as JSON, one object a line, the summary last
    #[arg(long)]
    times: bool,
}

/// Who interpolates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Method {
    /// The host: nodes are told steps a tick
    #[default]
    C,
    /// The nodes, by difference equations: a report of these and of their drift
    B,
    /// A board, pulse by pulse: a report of its pulses and of their error, beside the host's
    Pulse,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum SeamsArg {
    Report,
}

#[derive(Clone, Copy, Debug, Default, ValueEnum)]
enum Encoding {
    /// Signed steps
    #[default]
    Counts,
    /// The byte that goes on the bus
    Bytes,
}

pub fn run(args: &Args, global: &Global) -> Outcome {
    args.check(global)?;
    let program = Program::open(&args.file, &args.motion, global)?;
    if args.method != Method::C {
        return by_nodes(args, &program, global);
    }
    if args.encoder == Encoder::Thesis && args.report.is_any() {
        return Err(anyhow!("--encoder thesis plans nothing that could be told of").into());
    }
    if program.feed() == Feed::Constant && args.report.explain_feed {
        return Err(anyhow!("--feed constant has no accelerations to explain").into());
    }
    if args.report.explain_feed {
        speeds::report(&program, global.json)?;
        return Ok(Exit::Ok);
    }
    if args.report.seams.is_some() {
        seams::report(&program, global.json)?;
        return Ok(Exit::Ok);
    }
    if args.report.times {
        report_times(args, &program, global.json)?;
        return Ok(Exit::Ok);
    }
    let summary = RefCell::new(Summary::default());
    match (&args.output, args.csv) {
        (Some(path), _) if path != Path::new("-") => {
            output::whole_file(path, |out| dump(out, &program, args, &summary))?;
            if global.json {
                writeln!(io::stdout().lock(), "{}", to_json(&summary.borrow(), &program))?;
            }
        }
        (_, true) => {
            meter::leave_terminal_to_results();
            dump(io::stdout().lock(), &program, args, &summary)?;
        }
        (_, false) => {
            each_command(&program, args, &summary, |_| Ok(()))?;
            let mut out = io::stdout().lock();
            if global.json {
                writeln!(out, "{}", to_json(&summary.borrow(), &program))?;
            } else {
                print(&mut out, &summary.borrow(), &program)?;
            }
        }
    }
    if !global.quiet {
        warn_of_long_buffer(&summary.borrow(), &program);
    }
    Ok(Exit::Ok)
}

/// Says where no choice of seams was found that keeps every buffer within what a node holds.
fn warn_of_long_buffer(summary: &Summary, program: &Program) {
    let Some(ticks_max) = program.machine.bus.motion_ticks_max() else { return };
    let Some((number, ticks, line)) = summary.longest_buffer() else { return };
    if ticks > u64::from(ticks_max) {
        say!(
            "warning: buffer {number} (up to line {line}) has {ticks} ticks of motion, a node holds {ticks_max}, and \
             `cnc send` will refuse it: no stops were found that end it sooner. Lower feeds make stops \
             shorter, and so do greater accelerations and jerks in the profile, if the machine stands them"
        );
    }
}

impl Args {
    /// Refuses options that would have no effect, and two outputs of one name.
    fn check(&self, global: &Global) -> anyhow::Result<()> {
        let of_word = ["word-bits", "fraction-bits", "rounding", "constants"];
        match self.method {
            Method::C => {
                global.refuse(&["svg"], "it draws what --method b or --method pulse comes to")?;
            }
            Method::B | Method::Pulse => {
                let why = "only --method c makes ticks";
                global.refuse(&["explain-feed", "seams", "times", "encoder", "encoding"], why)?;
            }
        }
        if self.method != Method::B {
            global.refuse(&of_word, "only with --method b nodes calculate: give that, too")?;
        }
        if self.method == Method::Pulse {
            global.refuse(&["csv"], "--method pulse makes a report; --method b and c make CSV")?;
        }
        let file = self.output.as_deref().filter(|path| *path != Path::new("-"));
        if self.csv && file.is_none() {
            let why = "standard output takes the CSV; with -o FILE it takes the JSON";
            global.refuse(&["json"], why)?;
        }
        let outputs = [file, self.svg.as_deref()];
        output::check_distinct(&outputs)?;
        output::check_writable(&outputs)
    }
}

/// `--method b` and `--method pulse`.
fn by_nodes(args: &Args, program: &Program, global: &Global) -> Outcome {
    if args.method == Method::B && program.feed() == Feed::ExactStop {
        let reason = "method b has no ramps: --feed exact-stop means nothing to it";
        return Err(anyhow!(reason).into());
    }
    if args.method == Method::Pulse {
        return pulses::report(program, global.json, args.svg.as_ref());
    }
    let wanted = difference::Wanted {
        word: &args.word,
        csv: args.csv,
        json: global.json,
        output: args.output.as_deref(),
        svg: args.svg.as_ref(),
    };
    difference::report(program, &wanted)
}

impl ReportArgs {
    fn is_any(&self) -> bool {
        self.explain_feed || self.seams.is_some() || self.times
    }
}

/// `--times`: a row or an object a block as it comes, then the tools.
fn report_times(args: &Args, program: &Program, as_json: bool) -> Result<(), Failure> {
    meter::leave_terminal_to_results();
    let mut out = BufWriter::new(io::stdout().lock());
    let summary = RefCell::new(Summary::with_times(&program.machine));
    if !as_json {
        times::head(&mut out)?;
    }
    each_command(program, args, &summary, |_| give_out(&mut out, &summary, as_json))?;
    if let Some(times) = &mut summary.borrow_mut().times {
        times.finish();
    }
    give_out(&mut out, &summary, as_json)?;
    let summary = summary.into_inner();
    let Some(times) = &summary.times else { return Ok(()) };
    if as_json {
        let mut document = to_json(&summary, program);
        document["type"] = json!("summary");
        document["times"] = times::summary(times);
        writeln!(out, "{document}")?;
    } else {
        times::tools(&mut out, times)?;
    }
    Ok(out.flush()?)
}

/// Writes the blocks whose times are known.
fn give_out(out: &mut impl Write, summary: &RefCell<Summary>, as_json: bool) -> io::Result<()> {
    let mut summary = summary.borrow_mut();
    let Some(times) = &mut summary.times else { return Ok(()) };
    std::iter::from_fn(|| times.pop()).try_for_each(|block| times::block(out, &block, as_json))
}

fn dump(
    out: impl Write,
    program: &Program,
    args: &Args,
    summary: &RefCell<Summary>,
) -> Result<(), Failure> {
    let encoding = match args.encoding {
        Encoding::Counts => tape::Encoding::Counts,
        Encoding::Bytes => tape::Encoding::Bytes,
    };
    let mut writer = Writer::new(out, &program.header(args.encoder, encoding))?;
    each_command(program, args, summary, |command| writer.command(command))?;
    writer.finish()?;
    Ok(())
}

/// Takes every command of the program, as the chosen encoder makes it.
fn each_command(
    program: &Program,
    args: &Args,
    summary: &RefCell<Summary>,
    mut take: impl FnMut(&cnc::base::Command) -> io::Result<()>,
) -> Result<(), Failure> {
    let changed = |error: RunError| anyhow!(error).context("the program changed while it was read");
    match args.encoder {
        Encoder::Exact => {
            for command in program.commands(summary).map_err(changed)? {
                take(&command.map_err(changed)?)?;
            }
        }
        Encoder::Thesis => {
            for command in program.thesis_commands(summary) {
                take(&command.map_err(changed)?)?;
            }
        }
    }
    Ok(())
}

/// The axes that a report lists: X Y Z, and others once the program uses them.
fn axes(program: &Program) -> impl Iterator<Item = Axis> {
    let used = program.checked.summary.axes_used;
    let axes = program.machine.axes.iter().map(|profile| profile.axis);
    axes.filter(move |axis| Axis::LINEAR.contains(axis) || used.contains(*axis))
}

fn to_json(summary: &Summary, program: &Program) -> Value {
    let machine = &program.machine;
    let extents: Map<String, Value> = axes(program)
        .filter_map(|axis| {
            Some((axis.to_string(), json!(program.checked.summary.extents_mm[axis]?)))
        })
        .collect();
    let seams: Vec<Value> = summary
        .seams(machine)
        .iter()
        .map(|seam| {
            json!({"tick": seam.tick, "line": seam.line, "kind": seam.kind.name(),
                   "lost_seconds": six_digits(seam.lost_s)})
        })
        .collect();
    let limits: Vec<String> = summary.bounds.iter().map(ToString::to_string).collect();
    let warnings: Vec<Value> = program.checked.diagnostics.iter().map(warning).collect();
    json!({
        "schema": 1,
        "ticks": summary.ticks,
        "motion_seconds": six_digits(summary.motion_s(machine)),
        "total_seconds": six_digits(summary.total_s(machine)),
        "extents_mm": extents,
        "distance_mm": {"cut": six_digits(summary.cut_mm), "rapid": six_digits(summary.rapid_mm)},
        "seams": seams,
        "limits_met": limits,
        "warnings": warnings,
    })
}

fn warning(diagnostic: &cnc::base::Diagnostic) -> Value {
    json!({"rule": diagnostic.rule, "line": diagnostic.span.line, "column": diagnostic.column(),
           "message": diagnostic.message})
}

fn print(out: &mut impl Write, summary: &Summary, program: &Program) -> io::Result<()> {
    let machine: &Machine = &program.machine;
    let checked = &program.checked.summary;
    writeln!(
        out,
        "program   {}: {}, {}, {}",
        program.source.name(),
        count(checked.lines, "line"),
        count(checked.blocks, "block"),
        count(checked.moves, "move")
    )?;
    writeln!(out, "machine   {machine}")?;
    writeln!(
        out,
        "motion    {} of {} µs: {:.2} s; with pauses and refills {:.2} s",
        count(summary.ticks, "tick"),
        machine.bus.tick_us,
        summary.motion_s(machine),
        summary.total_s(machine)
    )?;
    if summary.events > 0 {
        let they =
            if summary.events == 1 { "it takes what it takes" } else { "they take what they take" };
        writeln!(out, "events    {}: {they}", summary.events)?;
    }
    writeln!(out, "way       cut {:.3} mm, rapid {:.3} mm", summary.cut_mm, summary.rapid_mm)?;
    for axis in axes(program) {
        if let Some([low, high]) = checked.extents_mm[axis] {
            writeln!(out, "extent    {axis} {low:.3} to {high:.3} mm")?;
        }
    }
    if machine.bus.motion_ticks_max().is_some() {
        writeln!(out, "buffers   {}", summary.buffers())?;
    }
    for seam in summary.seams(machine) {
        let (tick, line, kind) = (seam.tick, seam.line, seam.kind.name());
        writeln!(out, "seam      tick {tick}, line {line}: {kind}, {:.2} s", seam.lost_s)?;
    }
    for bound in &summary.bounds {
        writeln!(out, "limited   by {bound}")?;
    }
    Ok(())
}
