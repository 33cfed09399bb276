//! `cnc diff`: two dumps, or a program and a dump, compared in machine terms.

use std::cell::RefCell;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use cnc::base::{AxisMap, Command, Machine, Source};
use cnc::step::Summary;
use cnc::tape::Reader;
use cnc::verify::{Comparison, Setup, compare};

use crate::args::Global;
use crate::exit::{Exit, ExitWith, Failure, Outcome, unless_unread};
use crate::input;
use crate::meter::Pass;
use crate::program::{MotionArgs, Program};

/// Compare two dumps, or a program and a dump, in machine terms
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Command dump or NC program; - is standard input
    #[arg(value_name = "A")]
    first: PathBuf,
    /// Command dump or NC program
    #[arg(value_name = "B")]
    second: PathBuf,
    /// How far apart what both execute may lie, in mm, with the same end point and events [default: not at
    /// all, tick by tick]
    #[arg(long, value_name = "MM", value_parser = tolerance)]
    tolerance: Option<f64>,
    #[command(flatten)]
    motion: MotionArgs,
}

fn tolerance(text: &str) -> Result<f64, String> {
    let value = text.parse().ok().filter(|value: &f64| (0.0..=1000.0).contains(value));
    value.ok_or_else(|| "a distance from 0 to 1000 mm is expected".to_owned())
}

/// One of the two.
enum Job {
    Dump(Source),
    Program(Box<Program>),
}

type Commands<'a> = Box<dyn Iterator<Item = anyhow::Result<Command>> + 'a>;

impl Job {
    fn open(file: &Path, args: &Args, global: &Global) -> Result<Job, Failure> {
        let source = input::source(file)?;
        if input::is_dump(&source)? {
            return Ok(Job::Dump(source));
        }
        let machine = input::machine(global)?;
        let program = Program::check(file, source, machine, &args.motion, global)?;
        Ok(Job::Program(Box::new(program)))
    }

    fn name(&self) -> &str {
        match self {
            Job::Dump(source) => source.name(),
            Job::Program(program) => program.source.name(),
        }
    }

    /// Its tick, and where it starts.
    fn start(&self, machine: &Machine) -> Result<(u32, AxisMap<i64>), Failure> {
        match self {
            Job::Program(program) => {
                Ok((machine.bus.tick_us, machine.nearest_steps(&program.start_mm())))
            }
            Job::Dump(source) => {
                let name = || source.name().to_owned();
                let reader = Reader::open(source.clone()).with_context(name).or_bad_input()?;
                let header = reader.header();
                if header.machine.name != machine.id {
                    let reason = anyhow!(
                        "{}: the dump was made for machine '{}', not for '{}'; use --machine",
                        source.name(),
                        header.machine.name,
                        machine.id
                    );
                    return Err(reason).or_bad_input();
                }
                Ok((header.tick_us, input::start_steps(header, machine)))
            }
        }
    }

    fn commands<'a>(&'a self, summary: &'a RefCell<Summary>) -> anyhow::Result<Commands<'a>> {
        let name = || self.name().to_owned();
        Ok(match self {
            Job::Dump(source) => {
                let reader = Reader::open(source.clone()).with_context(name)?;
                Box::new(reader.map(move |command| command.with_context(name)))
            }
            Job::Program(program) => {
                Box::new(program.commands(summary)?.map(move |command| command.with_context(name)))
            }
        })
    }
}

pub fn run(args: &Args, global: &Global) -> Outcome {
    if args.first == Path::new("-") && args.second == Path::new("-") {
        return Err(anyhow!("standard input cannot be both").into());
    }
    let mut jobs = Vec::new();
    for file in [&args.first, &args.second] {
        jobs.push(Job::open(file, args, global)?);
    }
    let has_program = jobs.iter().any(|job| matches!(job, Job::Program(_)));
    if !has_program {
        MotionArgs::refuse_for_dump(global)?;
    }
    let machine = input::machine(&Global { quiet: true, ..global.clone() })?;
    let mut setups = Vec::new();
    for job in &jobs {
        let (tick_us, start_steps) = job.start(&machine)?;
        setups.push(Setup {
            machine: &machine,
            tick_us,
            start_steps,
            constant_feed: true,
            with_events: false,
            with_buffers: false,
        });
    }
    let has_dump = jobs.iter().any(|job| matches!(job, Job::Dump(_)));
    let _pass = if has_dump { Pass::of_text("comparing") } else { Pass::begin("comparing") };
    let summary = RefCell::new(Summary::default());
    let open = |i: usize| jobs[i].commands(&summary);
    let found = compare([&setups[0], &setups[1]], || open(0), || open(1)).or_bad_input()?;
    let is_same = match args.tolerance {
        None => found.same,
        Some(tolerance_mm) => {
            !found.max_distance_is_lower_bound
                && found.max_distance_mm <= tolerance_mm
                && found.same_events
                && found.end_difference_steps.values().all(|steps| *steps == 0)
        }
    };
    let mut out = io::stdout().lock();
    let written = if global.json {
        writeln!(out, "{}", serde_json::to_string(&found)?)
    } else if !global.quiet {
        print(&mut out, &found, args.tolerance)
    } else {
        Ok(())
    };
    unless_unread(written.and_then(|()| out.flush()))?;
    Ok(if is_same { Exit::Ok } else { Exit::BadInput })
}

fn print(out: &mut impl Write, found: &Comparison, tolerance_mm: Option<f64>) -> io::Result<()> {
    if let Some(first) = &found.first_difference {
        let line = |line: Option<u32>| line.map_or_else(|| "-".to_owned(), |l| l.to_string());
        writeln!(
            out,
            "first     tick {}: A {} (line {}), B {} (line {})",
            first.tick,
            first.what[0],
            line(first.lines[0]),
            first.what[1],
            line(first.lines[1]),
        )?;
        let at_least = if found.max_distance_is_lower_bound { "more than " } else { "" };
        write!(out, "apart     {at_least}{:.4} mm", found.max_distance_mm)?;
        // A thousandth goes without saying.
        if found.max_distance_resolution_mm > 2e-3 * found.max_distance_mm.max(0.01) {
            write!(out, " at most, {:.4} less", found.max_distance_resolution_mm)?;
        }
        if let Some(worst) = &found.worst {
            write!(out, " at tick {} of A", worst.tick)?;
            if worst.line > 0 {
                write!(out, ", line {}", worst.line)?;
            }
        }
        match tolerance_mm {
            Some(tolerance_mm) => writeln!(out, " (tolerance {tolerance_mm} mm)")?,
            None => writeln!(out)?,
        }
    } else {
        writeln!(out, "ticks     the same {}", found.ticks[0])?;
    }
    for (axis, steps) in found.end_difference_steps.iter().filter(|(_, steps)| **steps != 0) {
        writeln!(out, "end       B ends {steps:+} steps of {axis} from A")?;
    }
    let [a, b] = found.seconds;
    writeln!(out, "time      A {a:.2} s, B {b:.2} s of motion ({:+.2} s)", b - a)?;
    let events = if found.same_events { "the same" } else { "not the same" };
    writeln!(out, "events    {events}")
}
