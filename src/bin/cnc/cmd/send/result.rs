//! What `send` says of a job before and after it.

use std::io::{self, Write};

use cnc::base::machine::{FRAME_BYTES, Protocol, Unit};
use cnc::base::rounding::six_digits;
use cnc::base::{Axis, Event, EventKind, Machine};
use cnc::verify::{self, Verdict};
use cnc::wire::{End, Ending, FaultSpec, Job, Position, Proof, Struck};
use cnc::wire_io::{Call, Priority, find_programs, shown};
use serde_json::{Map, Value, json};

use super::{direct, pacing};
use crate::args::Global;
use crate::exit::{Exit, Outcome, unless_unread};
use crate::plural::count;

/// Events that are told of before a job.
const EVENTS_MAX: usize = 10;

/// Tells of jobs.
pub struct Report<'a> {
    pub machine: &'a Machine,
    pub global: &'a Global,
    /// Nodes do by themselves what they are told; no tick is counted.
    pub is_direct: bool,
}

/// What came of a job on nodes within this program.
pub struct Simulated {
    /// The first tick that was not executed as planned, and its NC line.
    pub difference: Option<(u64, u32)>,
    /// Hazards of the bus that the nodes saw.
    pub hazards: u64,
    /// What was executed held against the program's path, if the program is at hand.
    pub contour: Option<verify::Report>,
    /// Faults that have struck.
    pub struck: Vec<Struck>,
}

impl Simulated {
    fn is_right(&self) -> bool {
        let on_path = self.contour.as_ref().is_none_or(|found| found.verdict == Verdict::Pass);
        self.difference.is_none() && self.hazards == 0 && on_path
    }
}

impl Report<'_> {
    fn is_frames(&self) -> bool {
        self.machine.bus.protocol == Protocol::Frame
    }

    /// What is about to happen, and what is taken for granted; all of it before a dry run.
    pub fn job(&self, job: &Job, calls: &[Call], all: bool) {
        if self.global.quiet {
            return;
        }
        let nodes: Vec<String> = job.nodes.iter().map(short_name).collect();
        say!("machine   {}", self.machine);
        direct::of_job(job).for_each(|direct| say!("{}", direct::announced(direct)));
        if self.is_direct {
            return;
        }
        say!(
            "moves     {}",
            if nodes.is_empty() { "nothing".to_owned() } else { nodes.join(", ") }
        );
        for (axis, [low, high]) in extents(job) {
            say!("          {axis} {low:.3} to {high:.3} {}", unit(axis));
        }
        let starts: Vec<String> = self
            .machine
            .axes
            .iter()
            .map(|profile| profile.axis)
            .filter(|axis| job.axes.contains(*axis))
            .map(|axis| format!("{axis} {:.3}", job.start_mm[axis]))
            .collect();
        say!("start     the machine has to stand at {}", starts.join(", "));
        let (ticks, buffers) = (count(job.ticks, "tick"), job.buffers().count() as u64);
        let time = clock(job.duration_s(&self.machine.bus));
        let parts = match self.is_frames() {
            true => format!("{}, a frame a tick", count(buffers, "stretch")),
            false => count(buffers, "buffer"),
        };
        say!("time      {time}, {ticks} in {parts}");
        let told: Vec<String> =
            calls.iter().filter(|call| is_told(&call.event)).map(told).collect();
        let shown = if all { told.len() } else { told.len().min(EVENTS_MAX) };
        let more = told.len() - shown;
        for (at, event) in told.iter().take(shown).enumerate() {
            say!("{:10}{event}", if at == 0 { "events" } else { "" });
        }
        if more > 0 {
            say!("          and {more} more");
        }
    }

    /// Looks for the programs of hooks, if they will be run; before a dry run it tells of those that are
    /// not there in any case.
    pub fn hooks(&self, calls: &[Call], run: bool, dry_run: bool) -> anyhow::Result<()> {
        match find_programs(calls) {
            Err(missing) if run => return Err(missing.into()),
            Err(missing) if dry_run && !self.global.quiet => say!("warning: {missing}"),
            _ => {}
        }
        if !run && !self.global.quiet && calls.iter().any(|call| call.command.is_some()) {
            say!("hooks     are not run on simulated nodes; --hooks runs them");
        }
        Ok(())
    }

    /// What the nodes within this program will have to put up with.
    pub fn faults(&self, faults: &[FaultSpec]) {
        if !self.global.quiet && !faults.is_empty() {
            say!("faults    {}", joined(faults, "+"));
        }
    }

    /// What has become of that.
    pub fn struck(&self, struck: &[Struck], asked: usize) {
        if struck.len() < asked && !self.global.quiet {
            say!(
                "{} of {} struck before the job was over",
                struck.len(),
                count(asked as u64, "fault")
            );
        }
        for Struck { at_us, fault, phase } in struck.iter().filter(|_| !self.global.quiet) {
            let (at_s, phase) = (*at_us as f64 * 1e-6, phase.name());
            say!("fault {fault} struck at {at_s:.6} s, in the phase {phase}");
        }
    }

    /// The proof that the job is safe for the bus, and nothing more.
    pub fn dry_run(&self, job: &Job, calls: &[Call], proof: &Proof) -> io::Result<()> {
        let Proof { buffers, bytes, pairs, avoided, nodes } = *proof;
        if self.global.json {
            let mut result = self.base("dry-run", job.ticks, job.buffers().count() as u64);
            let seconds = six_digits(job.duration_s(&self.machine.bus));
            result.insert("seconds".to_owned(), json!(seconds));
            let extents = extents(job).map(|(axis, range)| (axis.to_string(), json!(range)));
            result.insert("extents_mm".to_owned(), Value::Object(extents.collect()));
            let proof = json!({
                "buffers": buffers, "bytes": bytes, "pairs": pairs, "pairs_avoided": avoided,
                "nodes": nodes,
            });
            result.insert("proof".to_owned(), proof);
            let events = calls.iter().map(|Call { event, command }| {
                json!({"line": event.line, "event": event.kind.to_string(), "hook": command})
            });
            result.insert("events".to_owned(), events.collect());
            writeln!(io::stdout(), "{}", Value::Object(result))
        } else if self.is_frames() {
            self.proof_of_frames(proof)
        } else {
            let mut out = io::stdout().lock();
            writeln!(
                out,
                "proof     {}, {bytes} bytes in the order of filling, {} on the bus",
                count(buffers, "buffer"),
                count(nodes as u64, "node"),
            )?;
            writeln!(
                out,
                "          {pairs} pairs looked at, none is a command to a node that it is not meant for"
            )?;
            if avoided > 0 {
                writeln!(
                    out,
                    "          {avoided} pairs avoided: each begins with the ID of a node that is full by then"
                )?;
            }
            writeln!(out, "safe for the bus; nothing was sent")
        }
    }

    fn proof_of_frames(&self, proof: &Proof) -> io::Result<()> {
        let Proof { buffers, bytes, pairs, nodes, .. } = *proof;
        let bus = &self.machine.bus;
        let frames = bytes / u64::from(FRAME_BYTES);
        let (frame_ms, tick_ms) = (bus.frame_s() * 1e3, bus.tick_s() * 1e3);
        let mut out = io::stdout().lock();
        writeln!(
            out,
            "proof     {}, {}, {bytes} bytes, {}",
            count(buffers, "stretch"),
            count(frames, "frame"),
            count(nodes as u64, "node"),
        )?;
        writeln!(
            out,
            "          a frame takes {frame_ms:.3} ms of the tick's {tick_ms} at {} baud",
            bus.baud
        )?;
        writeln!(
            out,
            "          {pairs} pairs looked at: each node finds its own count, no data begins a frame"
        )?;
        writeln!(out, "no node can say whether it heard; nothing was sent")
    }

    /// The end of a job on nodes outside.
    pub fn ending(&self, ending: &Ending, priority: Priority) -> Outcome {
        if !self.global.quiet {
            pacing::say_priority(&ending.pacing.figures(), priority, self.global.verbose);
        }
        self.finish(ending, None)
    }

    /// The end of a job on nodes within this program, which tell what they executed.
    pub fn simulated(&self, job: &Job, ending: &Ending, found: Simulated) -> Outcome {
        let done = ending.end == End::Done;
        if let Some((tick, line)) = found.difference.filter(|_| done) {
            say!("error: line {line}, tick {tick}: the nodes did not execute what was planned");
        } else if done && !self.is_direct && !self.global.quiet {
            say!(
                "the nodes executed what was planned, tick by tick ({})",
                count(job.ticks, "tick")
            );
        }
        if done && found.difference.is_none() && found.hazards > 0 {
            let hazards = count(found.hazards, "hazard");
            say!("error: {hazards}: a machine may not do what these nodes did");
        }
        if let Some(contour) = &found.contour {
            self.contour(contour);
        }
        let exit = self.finish(ending, Some(&found))?;
        Ok(if exit == Exit::Ok && !found.is_right() { Exit::Bus } else { exit })
    }

    fn contour(&self, contour: &verify::Report) {
        let (error, tolerance) = (contour.max_contour_error_mm, contour.tolerance_mm);
        for failure in &contour.failures {
            say!("error: {failure}");
        }
        if contour.verdict == Verdict::Pass && !self.global.quiet {
            say!(
                "and that is the program's path: {error:.4} mm off at most, {tolerance:.4} allowed"
            );
        }
    }

    fn finish(&self, ending: &Ending, simulated: Option<&Simulated>) -> Outcome {
        let found = simulated.filter(|_| ending.end == End::Done);
        let (name, exit) = match &ending.end {
            End::Done => ("done", Exit::Ok),
            End::Interrupted => ("interrupted", Exit::Interrupted),
            End::Failed(_) => ("failed", Exit::Bus),
        };
        let fault = match &ending.end {
            End::Failed(fault) => Some(fault.to_string()),
            End::Done | End::Interrupted => None,
        };
        if let Some(fault) = &fault {
            say!("error: {fault}");
        }
        if ending.end != End::Done && ending.line > 0 {
            say!("the last line reached is {}", ending.line);
        }
        self.positions(ending);
        let pacing = ending.pacing.figures();
        // Simulated nodes and their host are never late.
        if !self.global.quiet && (simulated.is_none() || self.global.verbose) {
            pacing::say(&pacing, self.global.verbose);
        }
        if self.global.json {
            let mut result = self.base(name, ending.ticks, ending.buffers);
            let axes = ending.axes.iter().map(|end| {
                let mut state = json!({
                    "steps": end.counted.then_some(end.steps),
                    "position_mm": end.counted.then_some(end.position_mm),
                    "state": end.position.name(),
                    "why": end.why.map(|why| why.to_string()),
                });
                if let Some(run) = ending.homed.iter().find(|run| run.axis == end.axis) {
                    state["homed"] = direct::as_json(run);
                }
                (end.axis.to_string(), state)
            });
            result.insert("axes".to_owned(), Value::Object(axes.collect()));
            result.insert("line".to_owned(), json!(ending.line));
            result.insert("power_cycle".to_owned(), json!(ending.power_cycle));
            result.insert("pacing".to_owned(), json!(pacing));
            if let Some(found) = found {
                let as_planned = found.difference.is_none() && found.hazards == 0;
                result.insert("executed_as_planned".to_owned(), json!(as_planned));
                result.insert("hazards".to_owned(), json!(found.hazards));
                result.insert("verify".to_owned(), json!(found.contour));
            }
            if let Some(found) = simulated.filter(|found| !found.struck.is_empty()) {
                let faults: Vec<_> = found.struck.iter().map(|at| at.fault.to_string()).collect();
                result.insert("faults".to_owned(), json!(faults));
            }
            result.insert("error".to_owned(), json!(fault));
            unless_unread(writeln!(io::stdout(), "{}", Value::Object(result)))?;
        } else if self.is_direct {
            unless_unread(writeln!(io::stdout(), "{name}"))?;
        } else {
            unless_unread(writeln!(io::stdout(), "{name}: {}", self.summary(ending)))?;
        }
        Ok(exit)
    }

    /// What was sent and acknowledged, in a line.
    fn summary(&self, ending: &Ending) -> String {
        let (ticks, buffers, pacing) = (ending.ticks, ending.buffers, ending.pacing.figures());
        let told = match self.is_frames() {
            true => {
                format!("sent in {}, which nobody acknowledges", count(buffers, "whole stretch"))
            }
            false => format!("acknowledged in {}", count(buffers, "whole buffer")),
        };
        let (late, late_max) = (pacing.late_us as f64 * 1e-3, pacing.late_us_max as f64 * 1e-3);
        let ticks = count(ticks, "tick");
        format!("{ticks} {told}; late by {late:.1} ms in all, {late_max:.2} ms at most")
    }

    fn positions(&self, ending: &Ending) {
        if self.global.quiet && ending.end == End::Done {
            return;
        }
        for end in &ending.axes {
            let state = match end.position {
                Position::Known => "known",
                Position::KnownUntilPowerOff => "known until its node is switched off",
                Position::KnownAsSent => "known as far as was sent: its node cannot answer",
                Position::Unconfirmed => "not confirmed",
                Position::Unknown if self.is_frames() => {
                    "unknown from here on: measure it, and say so with --at"
                }
                Position::Unknown => "unknown from here on: home it",
            };
            let unit = unit(end.axis);
            if !end.counted {
                say!("{} is at no known position: home it", end.axis);
                continue;
            }
            let why = end.why.map_or(String::new(), |why| format!("; {why}"));
            say!(
                "{} at {:.3} {unit} (step {}), {state}{why}",
                end.axis,
                end.position_mm,
                end.steps
            );
        }
        if ending.power_cycle && self.is_direct {
            say!("what the nodes do now cannot be known: switch all of them off and on, then home");
        } else if ending.power_cycle && self.is_frames() {
            say!(
                "nodes that heard half a frame stand still when the next one comes: switch all nodes off and on"
            );
        } else if ending.power_cycle {
            say!(
                "some nodes still hold a buffer and would take every byte as a tick of it: switch all nodes off and on, then home"
            );
        }
    }

    fn base(&self, result: &str, ticks: u64, buffers: u64) -> Map<String, Value> {
        let fields = [
            ("schema", json!(1)),
            ("result", json!(result)),
            ("machine", json!(self.machine.id)),
            ("ticks", json!(ticks)),
            ("buffers", json!(buffers)),
        ];
        fields.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
    }
}

fn extents(job: &Job) -> impl Iterator<Item = (Axis, [f64; 2])> {
    Axis::ALL.into_iter().filter_map(|axis| Some((axis, job.extents_mm[axis]?)))
}

fn short_name(unit: &Unit) -> String {
    match unit.axis {
        Some(axis) => format!("{axis} (node {})", unit.id),
        None => format!("node {} (no axis)", unit.id),
    }
}

fn joined(items: &[impl ToString], separator: &str) -> String {
    items.iter().map(ToString::to_string).collect::<Vec<_>>().join(separator)
}

fn unit(axis: Axis) -> &'static str {
    if axis.is_rotary() { "°" } else { "mm" }
}

fn is_told(event: &Event) -> bool {
    !matches!(event.kind, EventKind::Dwell(_) | EventKind::NextBlock)
}

fn told(call: &Call) -> String {
    let Event { line, kind } = &call.event;
    let by = call.command.as_ref().map(|command| format!(", by {}", shown(command)));
    format!("line {line}: {kind}{}", by.unwrap_or_default())
}

/// A time in hours, minutes and seconds.
pub fn clock(seconds: f64) -> String {
    let s = seconds.ceil() as u64;
    format!("{}:{:02}:{:02} h", s / 3600, s / 60 % 60, s % 60)
}
