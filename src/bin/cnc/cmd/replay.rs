//! `cnc replay`: the bytes of a trace against virtual nodes.

use std::cell::RefCell;
use std::io::{self, Write};
use std::path::PathBuf;

use anyhow::anyhow;
use cnc::base::machine::Unit;
use cnc::base::{AxisMap, Machine};
use cnc::step::Summary;
use cnc::wire::{ANSWER_PAUSE_US, Activity, Answer, Job, Nodes, Reached, Replay, in_step, reached};
use cnc::wire_io::{TraceHeader, TraceLine, TraceReader, hex};
use serde_json::{Map, Value, json};

use super::send::{self, resume};
use crate::args::Global;
use crate::exit::{Exit, ExitWith, Failure, Outcome, unless_unread};
use crate::input::{self, Start};
use crate::meter::Pass;
use crate::plural::count;
use crate::program::{FeedMode, MotionArgs, Program};
use crate::protocol::ProtocolArgs;

/// Hazards that are told one by one.
const HAZARDS_MAX: usize = 10;

/// Replay the bytes of a trace (`send --trace`) against virtual nodes
///
/// The result is how far each node has got, on which NC line, and where the first answer differs from what
/// was received: there a byte or an answer was lost or changed, or a node failed. Exit code 0: all
/// answers are the same and there was no hazard; 1: not so.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Trace written by send --trace; - is standard input
    #[arg(value_name = "TRACE")]
    trace: PathBuf,
    /// The NC program or dump that was sent, with the options that it was sent with: tells lines
    #[arg(value_name = "FILE")]
    file: Option<PathBuf>,
    /// Instead of a file: the blocks of send -e
    #[arg(short, long, value_name = "BLOCK", conflicts_with = "file")]
    execute: Vec<String>,
    /// The job was sent with --single-block
    #[arg(long, conflicts_with = "feed")]
    single_block: bool,
    #[command(flatten)]
    protocol: ProtocolArgs,
    #[command(flatten)]
    motion: MotionArgs,
}

pub fn run(args: &Args, global: &Global) -> Outcome {
    let input = input::source(&args.trace)?.reader(0);
    let mut trace = TraceReader::open(input).or_bad_input()?;
    let machine = args.protocol.machine(global)?;
    let header = trace.header();
    let bad = |what: String| Err(anyhow!("{}: {what}", args.trace.display())).or_bad_input();
    if header.machine_sha256 != hex(&machine.sha256()) {
        let made_on = &header.machine;
        return bad(format!(
            "the job ran on machine {made_on} or another version of it, not on {}; name it with --machine",
            machine.id
        ));
    }
    let job = job(args, header, &machine, global)?;
    if job.as_ref().is_some_and(|job| hex(&job.sha256()) != header.job_sha256) {
        let program = &header.program;
        return bad(format!(
            "this is the trace of another job, made from {program}; the same file and the same options are \
             expected"
        ));
    }
    let nodes = Nodes::new(&machine, machine.bus.units(), &header.start(), ANSWER_PAUSE_US);
    let replay = Replay::new(nodes, header.speed == "max");
    let mut told = Told { replay, sent: 0, unsent: 0, lost: 0, end: None, us: 0 };
    let pass = Pass::of_text("replaying");
    for line in &mut trace {
        told.line(line.or_bad_input()?);
    }
    drop(pass);
    told.replay.end(told.end.is_some());
    let reached = reached(told.replay.nodes(), job.as_ref());
    let report =
        Report { told: &told, reached: &reached, machine: &machine, is_cut: trace.is_cut() };
    unless_unread(if global.json { report.json() } else { report.text(global) })?;
    Ok(if report.is_same() { Exit::Ok } else { Exit::BadInput })
}

/// The job of a program or a dump, as `send` made it, if there is one: planned from where the machine stood,
/// and what was left of it where a job was gone on with.
fn job(
    args: &Args,
    header: &TraceHeader,
    machine: &Machine,
    global: &Global,
) -> Result<Option<Job>, Failure> {
    let whole = whole(args, header, machine, global)?;
    Ok(match (whole, &header.resumed) {
        (Some(whole), Some(resumed)) => {
            Some(resume::rest(&whole, resumed.done, header.start(), machine)?.job)
        }
        (whole, _) => whole,
    })
}

/// The job before it was cut short.
fn whole(
    args: &Args,
    header: &TraceHeader,
    machine: &Machine,
    global: &Global,
) -> Result<Option<Job>, Failure> {
    let source = args.file.as_deref().map(input::source).transpose()?;
    let mut motion = args.motion.clone();
    if args.single_block {
        motion.feed = FeedMode::ExactStop;
    }
    let start_steps = header.whole_start();
    // The work zero may lie between two steps, and a job starts there exactly.
    if motion.start.is_none() && start_steps != machine.nearest_steps(&machine.work_zero_mm) {
        motion.start = Some(Start::at(&machine.position_mm(&start_steps)));
    }
    let program = match (&args.file, source) {
        (Some(_), Some(source)) if input::is_dump(&source)? => {
            MotionArgs::refuse_for_dump(global)?;
            return Ok(Some(send::dump(&source, machine, args.single_block)?.0));
        }
        (Some(file), Some(source)) => {
            Program::check(file, source, machine.clone(), &motion, global)?
        }
        _ if args.execute.is_empty() => {
            MotionArgs::refuse(global, "no program is named")?;
            return Ok(None);
        }
        _ => Program::check_typed(&args.execute, machine.clone(), &motion, global)?,
    };
    let summary = RefCell::new(Summary::default());
    let start_steps = machine.nearest_steps(&program.start_mm());
    let commands = program.commands(&summary)?;
    let job = send::gather_blocks(commands, start_steps, machine, args.single_block)?;
    Ok(Some(job.or_bad_input()?))
}

/// A trace as far as it has been told.
struct Told {
    replay: Replay,
    sent: u64,
    /// Bytes that the port may not have taken.
    unsent: u64,
    /// Lines that are missing.
    lost: u64,
    end: Option<String>,
    us: u64,
}

impl Told {
    fn line(&mut self, line: TraceLine) {
        match line {
            TraceLine::Sent { bytes, failed: true, .. } => self.unsent += bytes.len() as u64,
            TraceLine::Sent { t_us, bytes, .. } => {
                self.replay.sent(t_us, &bytes);
                self.sent += bytes.len() as u64;
                self.us = t_us;
            }
            TraceLine::Received { t_us, bytes } => {
                self.replay.received(t_us, &bytes);
                self.us = t_us;
            }
            TraceLine::Lost { lines } => self.lost += lines,
            TraceLine::End { end, .. } => self.end = Some(end),
        }
    }
}

struct Report<'a> {
    told: &'a Told,
    reached: &'a [Reached],
    machine: &'a Machine,
    is_cut: bool,
}

impl Report<'_> {
    fn is_same(&self) -> bool {
        let replay = &self.told.replay;
        replay.difference().is_none() && replay.hazards().is_empty() && self.told.lost == 0
    }

    fn text(&self, global: &Global) -> io::Result<()> {
        let mut out = io::stdout().lock();
        let Told { replay, sent, unsent, lost, end, us } = self.told;
        let (same, seconds) = (replay.same(), *us as f64 * 1e-6);
        let (bytes, same) = (count(*sent, "byte"), count(same, "answer"));
        writeln!(out, "{bytes} sent in {seconds:.6} s, {same} the same")?;
        if *lost > 0 {
            writeln!(
                out,
                "{lost} lines are missing: the disk was too slow, and nothing below is certain"
            )?;
        }
        if *unsent > 0 {
            writeln!(out, "{unsent} bytes were not sent, or not all of them: the port failed")?;
        }
        match end {
            Some(end) => writeln!(out, "the job ended: {end}")?,
            None if self.is_cut => {
                writeln!(out, "the trace ends in the middle of a line: the host was cut off")?
            }
            None => writeln!(out, "the trace has no end: the host was cut off")?,
        }
        match replay.difference() {
            Some(difference) => {
                writeln!(out, "answer {} differs:", difference.number)?;
                writeln!(out, "  received  {}", answer(difference.recorded, "nothing more"))?;
                writeln!(out, "  replayed  {}", answer(difference.replayed, "nothing more"))?;
            }
            None => writeln!(out, "no answer differs")?,
        }
        for entry in replay.hazards().iter().take(HAZARDS_MAX) {
            let at_s = entry.at_us as f64 * 1e-6;
            writeln!(out, "hazard at {at_s:.6} s: {} {}", entry.unit, entry.hazard.unwrap_or(""))?;
        }
        let more = replay.hazards().len().saturating_sub(HAZARDS_MAX);
        if more > 0 {
            writeln!(out, "and {more} more hazards")?;
        }
        if !global.quiet {
            self.table(&mut out)?;
        }
        writeln!(out, "{}", if self.is_same() { "same" } else { "different" })
    }

    /// How far each node has got.
    fn table(&self, out: &mut impl Write) -> io::Result<()> {
        writeln!(
            out,
            "{:<9} {:>12} {:>7} {:>10} {:>7}  state",
            "node", "position", "buffer", "tick", "line"
        )?;
        for reached in self.reached {
            let planned = reached.planned.as_ref();
            let buffer = planned.map(|planned| planned.buffer.to_string());
            let buffer = buffer.or(reached.buffers.checked_sub(1).map(|number| number.to_string()));
            let tick = match planned {
                _ if reached.buffers == 0 => "-".to_owned(),
                Some(planned) if reached.ticks >= planned.motion_ticks => "all".to_owned(),
                Some(planned) => format!("{}/{}", reached.ticks, planned.motion_ticks),
                None => reached.ticks.to_string(),
            };
            let line = planned.map_or("-".to_owned(), |planned| planned.line.to_string());
            writeln!(
                out,
                "{:<9} {:>12} {:>7} {:>10} {:>7}  {}",
                name(reached.unit),
                self.position(reached).map_or("-".to_owned(), |mm| format!("{mm:.3}")),
                buffer.unwrap_or_else(|| "-".to_owned()),
                tick,
                line,
                state(reached),
            )?;
        }
        if !in_step(self.told.replay.nodes()) {
            writeln!(
                out,
                "the axes are not in step: not all have executed the same ticks of their last buffer"
            )?;
        }
        Ok(())
    }

    fn json(&self) -> io::Result<()> {
        let Told { replay, sent, unsent, lost, end, us } = self.told;
        let timed = |answer: Answer| json!({"t_us": answer.at_us, "after_bytes": answer.after, "byte": answer.byte});
        let difference = replay.difference().map(|difference| {
            json!({
                "answer": difference.number, "received": difference.recorded.map(timed),
                "replayed": difference.replayed.map(timed),
            })
        });
        let hazards = replay.hazards().iter();
        let hazards = hazards
            .map(|entry| json!({"t_us": entry.at_us, "node": entry.unit.id, "what": entry.hazard}));
        let nodes: Map<String, Value> = self
            .reached
            .iter()
            .map(|reached| {
                let planned = reached.planned.as_ref();
                let node = json!({
                    "id": reached.unit.id, "steps": reached.steps, "position_mm": self.position(reached),
                    "buffers": reached.buffers, "tick": reached.ticks, "full": reached.full,
                    "activity": activity(reached.activity),
                    "buffer": planned.map(|planned| planned.buffer),
                    "line": planned.map(|planned| planned.line),
                    "as_planned": planned.map(|planned| planned.as_planned),
                });
                let name = reached.unit.axis.map_or(reached.unit.id.to_string(), |a| a.to_string());
                (name, node)
            })
            .collect();
        let result = json!({
            "schema": 1, "verdict": if self.is_same() { "same" } else { "different" },
            "bytes": sent, "bytes_unsent": unsent, "answers": replay.same(), "t_us": us,
            "lost_lines": lost, "end": end, "difference": difference,
            "hazards": hazards.collect::<Value>(), "in_step": in_step(replay.nodes()),
            "nodes": nodes,
        });
        writeln!(io::stdout(), "{result}")
    }

    fn position(&self, reached: &Reached) -> Option<f64> {
        let axis = reached.unit.axis?;
        let mut steps = AxisMap::default();
        steps[axis] = reached.steps;
        self.machine.axis(axis).map(|_| self.machine.position_mm(&steps)[axis])
    }
}

fn answer(answer: Option<Answer>, none: &str) -> String {
    answer.map_or(none.to_owned(), |answer| {
        let Answer { at_us, after, byte } = answer;
        format!("{byte} after {after} bytes of the host, at {:.6} s", at_us as f64 * 1e-6)
    })
}

fn name(unit: Unit) -> String {
    unit.axis.map_or(unit.id.to_string(), |axis| format!("{axis} ({})", unit.id))
}

fn activity(activity: Activity) -> &'static str {
    match activity {
        Activity::Idle => "idle",
        Activity::Filling => "filling",
        Activity::Jogging => "jogging",
        Activity::Executing => "executing",
    }
}

fn state(reached: &Reached) -> String {
    let mut state = activity(reached.activity).to_owned();
    if reached.full && reached.activity != Activity::Executing {
        state.push_str(", holds a buffer");
    }
    if reached.planned.as_ref().is_some_and(|planned| !planned.as_planned) {
        state.push_str(", has executed what was not planned");
    }
    state
}
