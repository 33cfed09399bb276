//! `--explain-feed`: what sets the speed of every block.

use std::io::{self, BufWriter, Write};

use anyhow::anyhow;
use cnc::base::rounding::six_digits;
use cnc::interp::RunError;
use cnc::plan::BlockSpeed;
use serde_json::json;

use crate::exit::Failure;
use crate::program::Program;

/// Writes a table, or JSON Lines.
pub fn report(program: &Program, as_json: bool) -> Result<(), Failure> {
    let mut out = BufWriter::new(io::stdout().lock());
    if !as_json {
        head(&mut out)?;
    }
    let changed = |error: RunError| anyhow!(error).context("the program changed while it was read");
    for block in program.block_speeds().map_err(changed)? {
        let block = block.map_err(changed)?;
        if as_json {
            json_line(&mut out, &block)?;
        } else {
            row(&mut out, &block)?;
        }
    }
    Ok(out.flush()?)
}

fn head(out: &mut impl Write) -> io::Result<()> {
    writeln!(
        out,
        "speeds in mm/min (degrees/min where rotary axes move alone); end: the least of"
    )?;
    writeln!(
        out,
        "F1, what acceleration from the block's start reaches; F2, what braking over the"
    )?;
    writeln!(out, "next block leaves; F3, what their directions let pass")?;
    writeln!(out)?;
    writeln!(
        out,
        "{:>7} {:>10} {:>8} {:>8} {:>8} {:>8} {:>8}  {:<28} {:>8}  bound by",
        "line", "mm", "feed", "F1", "F2", "F3", "end", "bound by", "top"
    )
}

fn row(out: &mut impl Write, block: &BlockSpeed) -> io::Result<()> {
    let BlockSpeed { line, length_mm, end_bound, top_bound, .. } = block;
    write!(out, "{line:>7} {length_mm:>10.3}")?;
    speed(out, block.feed_mm_s)?;
    for candidate_mm_s in block.candidates_mm_s {
        speed(out, Some(candidate_mm_s))?;
    }
    speed(out, Some(block.end_mm_s))?;
    write!(out, "  {:<28}", end_bound.to_string())?;
    speed(out, Some(block.top_mm_s))?;
    writeln!(out, "  {top_bound}")
}

/// A column; a dash where nothing bounds.
fn speed(out: &mut impl Write, speed_mm_s: Option<f64>) -> io::Result<()> {
    match mm_min(speed_mm_s) {
        Some(mm_min) => write!(out, " {mm_min:>8.1}"),
        None => write!(out, " {:>8}", "-"),
    }
}

fn mm_min(speed_mm_s: Option<f64>) -> Option<f64> {
    speed_mm_s.filter(|speed| speed.is_finite()).map(|speed| 60.0 * speed)
}

fn json_line(out: &mut impl Write, block: &BlockSpeed) -> io::Result<()> {
    let [f1, f2, f3] =
        block.candidates_mm_s.map(|speed_mm_s| mm_min(Some(speed_mm_s)).map(six_digits));
    let object = json!({
        "type": "block",
        "line": block.line,
        "length_mm": six_digits(block.length_mm),
        "feed_mm_min": mm_min(block.feed_mm_s).map(six_digits),
        "f1_mm_min": f1,
        "f2_mm_min": f2,
        "f3_mm_min": f3,
        "end_mm_min": six_digits(60.0 * block.end_mm_s),
        "end_bound": block.end_bound.to_string(),
        "top_mm_min": six_digits(60.0 * block.top_mm_s),
        "top_bound": block.top_bound.to_string(),
    });
    writeln!(out, "{object}")
}
