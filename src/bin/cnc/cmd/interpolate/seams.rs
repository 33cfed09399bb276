//! `--seams report`: what each seam costs, and what the next best choice would.

use std::cell::RefCell;
use std::io::{self, Write};

use anyhow::anyhow;
use cnc::base::rounding::six_digits;
use cnc::plan::{NextBest, SeamCost};
use cnc::step::{Seam, Summary};
use serde_json::{Value, json};

use crate::exit::Failure;
use crate::program::Program;

/// Writes a table, or one document.
pub fn report(program: &Program, as_json: bool) -> Result<(), Failure> {
    let summary = RefCell::new(Summary::default());
    let changed = |error| anyhow!("{error}").context("the program changed while it was read");
    program.commands(&summary).try_for_each(|command| command.map(drop)).map_err(changed)?;
    let seams = summary.into_inner().seams(&program.machine);
    let costs = program.seam_costs().map_err(changed)?;
    if seams.len() != costs.len() {
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

fn table(out: &mut impl Write, seams: &[Seam], costs: &[SeamCost]) -> io::Result<()> {
    if costs.is_empty() {
        return writeln!(out, "there are no seams");
    }
    writeln!(
        out,
        "{:>9} {:>7}  {:<6} {:>8} {:>8} {:>8} {:>8} {:>8}  next best",
        "tick", "line", "kind", "fill s", "pads s", "ramps s", "mark s", "total s"
    )?;
    for (seam, cost) in seams.iter().zip(costs) {
        let (tick, line, kind) = (seam.tick, cost.line, cost.kind.name());
        write!(out, "{tick:>9} {line:>7}  {kind:<6}")?;
        for part_s in [cost.fill_s, cost.pads_s, cost.ramps_s, cost.penalty_s, cost.total_s()] {
            write!(out, " {part_s:>8.3}")?;
        }
        writeln!(out, "  {}", next_best(cost.next_best))?;
    }
    let total_s: f64 = costs.iter().map(SeamCost::total_s).sum();
    let plural = if costs.len() == 1 { "" } else { "s" };
    writeln!(out, "{} seam{plural}, {total_s:.3} s", costs.len())
}

fn next_best(next_best: Option<NextBest>) -> String {
    match next_best {
        None => "none".to_owned(),
        Some(NextBest { more_s, more_inside: 0 }) => format!("{more_s:+.3} s"),
        Some(NextBest { more_s, more_inside }) => {
            format!("{more_s:+.3} s, {more_inside} more inside a block of a cut")
        }
    }
}

fn document(out: &mut impl Write, seams: &[Seam], costs: &[SeamCost]) -> io::Result<()> {
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
    let list: Vec<Value> = seams.iter().zip(costs).map(seam).collect();
    let total_s: f64 = costs.iter().map(SeamCost::total_s).sum();
    writeln!(out, "{}", json!({"schema": 1, "seams": list, "total_seconds": six_digits(total_s)}))
}
