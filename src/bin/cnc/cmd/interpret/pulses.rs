//! `--fp`: the interpolation pulses of each block, with the command of the board that makes them.

use std::io::{self, BufWriter, Write};

use anyhow::anyhow;
use cnc::base::{Machine, Source};
use cnc::interp::{self, Motion, Move, MoveKind, Options};
use cnc::path;
use cnc::systems::pulse::{self, Count, NoPulses};
use serde_json::json;

use crate::exit::{Exit, ExitWith, Failure, Outcome};
use crate::plural::count;

/// Writes a table, or JSON Lines, if they are wanted. A program with a block that the board cannot take
/// gives none.
pub fn report(
    source: &Source,
    machine: &Machine,
    options: &Options,
    as_json: Option<bool>,
) -> Outcome {
    let mut refused = None;
    each_block(source, machine, options, |_, count| {
        if let (Err(reason), None) = (count, &refused) {
            refused = Some(reason);
        }
        Ok(())
    })?;
    if let Some(reason) = refused {
        return Err(anyhow!("{}: {reason}", source.name())).or_bad_input();
    }
    let Some(as_json) = as_json else { return Ok(Exit::Ok) };
    let mut out = BufWriter::new(io::stdout().lock());
    let (mut blocks, mut pulses) = (0_u64, 0_u64);
    if !as_json {
        head(&mut out, source, machine)?;
    }
    each_block(source, machine, options, |step, count| {
        let Ok(count) = count else { return Ok(()) };
        blocks += 1;
        pulses += u64::from(count.pulses);
        if as_json { json_line(&mut out, step, &count) } else { row(&mut out, step, &count) }
    })?;
    if !as_json {
        writeln!(out)?;
        writeln!(out, "{} in {}", count(pulses, "pulse"), count(blocks, "block"))?;
    }
    out.flush()?;
    Ok(Exit::Ok)
}

/// Takes every move that goes anywhere, and its count.
fn each_block(
    source: &Source,
    machine: &Machine,
    options: &Options,
    mut take: impl FnMut(&Move, Result<Count, NoPulses>) -> io::Result<()>,
) -> Result<(), Failure> {
    for motion in interp::motions(source, machine, options) {
        let motion = motion
            .map_err(|error| anyhow!(error).context("the program changed while it was read"))?;
        if let Motion::Move(step) = &motion
            && let Some(segment) = path::segment(step)
        {
            take(step, pulse::count(&segment, machine))?;
        }
    }
    Ok(())
}

fn name(step: &Move) -> &'static str {
    match step.kind {
        MoveKind::Rapid => "rapid",
        MoveKind::Line { .. } => "line",
        MoveKind::Arc { .. } => "arc",
        MoveKind::Spline { .. } => "spline",
    }
}

/// The command's bytes as two digits each.
fn bytes(count: &Count, between: &str) -> String {
    count.command().map(|byte| format!("{byte:02X}")).join(between)
}

fn head(out: &mut impl Write, source: &Source, machine: &Machine) -> io::Result<()> {
    writeln!(out, "program  {}", source.name())?;
    writeln!(out, "machine  {machine}")?;
    writeln!(out)?;
    writeln!(out, "{:>7} {:>6}  {:<6} {:>12} {:>10}  command", "line", "N", "motion", "way", "FP")
}

fn row(out: &mut impl Write, step: &Move, count: &Count) -> io::Result<()> {
    let n = step.n.map_or(String::new(), |n| n.to_string());
    writeln!(
        out,
        "{:>7} {n:>6}  {:<6} {:>12.3} {:>10}  {}",
        step.line,
        name(step),
        count.exact,
        count.pulses,
        bytes(count, " ")
    )
}

fn json_line(out: &mut impl Write, step: &Move, count: &Count) -> io::Result<()> {
    let mut object = json!({
        "type": name(step),
        "line": step.line,
        "fp": count.pulses,
        "way_pulses": cnc::base::rounding::six_digits(count.exact),
        "command": bytes(count, ""),
    });
    if let Some(n) = step.n {
        object["n"] = json!(n);
    }
    writeln!(out, "{object}")
}
