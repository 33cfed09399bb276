//! `--seams report`: what each seam costs, and what the next best choice would.

use std::cell::RefCell;
use std::io::{self, Write};

use anyhow::anyhow;
use cnc::base::rounding::six_digits;
use cnc::interp::RunError;
use cnc::plan::{NextBest, SeamCost, SeamReport};
use cnc::step::{Seam, Summary};
use serde_json::{Value, json};

use crate::exit::Failure;
use crate::program::Program;

/// Writes a table, or one document.
pub fn report(program: &Program, as_json: bool) -> Result<(), Failure> {
    let summary = RefCell::new(Summary::default());
    let changed = |error: RunError| anyhow!(error).context("the program changed while it was read");
    let mut commands = program.commands(&summary).map_err(changed)?;
    commands.try_for_each(|command| command.map(drop)).map_err(changed)?;
    drop(commands);
    let seams = summary.into_inner().seams(&program.machine);
    let costs = program.seam_costs().map_err(changed)?;
    if seams.len() != costs.seams.len() {
        return Err(anyhow!("the program changed while it was read").into());
    }
    let mut out = io::stdout().lock();
    if as_json {
        document(&mut out, &seams, &costs)?;
    } else {
        table(&mut out, &seams, &costs)?;
    }
    Ok(())
}

fn table(out: &mut impl Write, seams: &[Seam], costs: &SeamReport) -> io::Result<()> {
    if seams.is_empty() {
        return writeln!(out, "there are no seams");
    }
    writeln!(out, "seconds that each seam costs; what the job costs more with none at its place")?;
    writeln!(out)?;
    writeln!(
        out,
        "{:>9} {:>7}  {:<5} {:>8} {:>8} {:>8} {:>8} {:>8}  next best",
        "tick", "line", "kind", "fill", "pads", "ramps", "penalty", "total"
    )?;
    for (seam, cost) in seams.iter().zip(&costs.seams) {
        let (tick, line, kind) = (seam.tick, cost.line, cost.kind.name());
        write!(out, "{tick:>9} {line:>7}  {kind:<5}")?;
        for part_s in [cost.fill_s, cost.pads_s, cost.ramps_s, cost.penalty_s, cost.total_s()] {
            write!(out, " {part_s:>8.3}")?;
        }
        writeln!(out, "  {}", next_best(cost.next_best))?;
    }
    writeln!(out)?;
    writeln!(out, "{} in all: {:.3}", seams.len(), total_s(costs))?;
    let (less_s, fewer) = (costs.above_least_s, costs.above_least_inside);
    if fewer > 0 {
        let what = "inside a block of a cut";
        writeln!(
            out,
            "the best choice over all of the program: {fewer} fewer {what}, {:+.3}",
            -less_s
        )?;
    } else if above_least_s(costs) > 0.0 {
        writeln!(out, "the best choice over all of the program: {less_s:.3} less")?;
    }
    Ok(())
}

fn total_s(costs: &SeamReport) -> f64 {
    costs.seams.iter().map(SeamCost::total_s).sum()
}

/// To the microsecond: sums that differ in their order differ by less. Fewer stops inside of blocks may take longer.
fn above_least_s(costs: &SeamReport) -> f64 {
    let least_s = if costs.above_least_inside > 0 { f64::NEG_INFINITY } else { 0.0 };
    six_digits(costs.above_least_s.max(least_s))
}

fn next_best(next_best: Option<NextBest>) -> String {
    let Some(NextBest { more_s, more_inside }) = next_best else { return "none".to_owned() };
    // No minus before a zero.
    let more_s = (more_s * 1e3).round() / 1e3 + 0.0;
    match more_inside {
        0 => format!("{more_s:+.3}"),
        1.. => format!("{more_s:+.3}, and {more_inside} more inside a block of a cut"),
        _ => format!("{more_s:+.3}, and {} fewer inside a block of a cut", -more_inside),
    }
}

fn document(out: &mut impl Write, seams: &[Seam], costs: &SeamReport) -> io::Result<()> {
    let seam = |(seam, cost): (&Seam, &SeamCost)| {
        json!({
            "tick": seam.tick,
            "line": cost.line,
            "kind": cost.kind.name(),
            "inside": cost.is_inside,
            "fill_seconds": six_digits(cost.fill_s),
            "pads_seconds": six_digits(cost.pads_s),
            "ramps_seconds": six_digits(cost.ramps_s),
            "penalty_seconds": six_digits(cost.penalty_s),
            "total_seconds": six_digits(cost.total_s()),
            "next_best_more_seconds": cost.next_best.map(|best| six_digits(best.more_s)),
            "next_best_more_inside": cost.next_best.map(|best| best.more_inside),
        })
    };
    let list: Vec<Value> = seams.iter().zip(&costs.seams).map(seam).collect();
    let document = json!({
        "schema": 1,
        "seams": list,
        "total_seconds": six_digits(total_s(costs)),
        "above_least_seconds": above_least_s(costs),
        "above_least_inside": costs.above_least_inside,
    });
    writeln!(out, "{document}")
}
