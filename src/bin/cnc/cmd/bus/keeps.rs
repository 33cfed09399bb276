//! Whether interfaces keep up with a program, block by block.

use std::io::{self, BufWriter, Write};
use std::path::Path;

use anyhow::anyhow;
use cnc::base::Machine;
use cnc::base::rounding::six_digits;
use cnc::path::PathItem;
use cnc::systems::carry::Setting;
use cnc::systems::carry::blocks::{Block, Found, Judge, Lack};
use serde_json::{Value, json};

use super::Args;
use crate::args::Global;
use crate::exit::{Exit, Failure, Outcome};
use crate::plural::count;
use crate::program::Program;
use crate::table::{Cell, Column, Table};

const SUMMARY: [Column; 9] = [
    ("interface", "interface"),
    ("nodes", "nodes"),
    ("baud", "baud"),
    ("period_ms", "period ms"),
    ("keeps_up", "keeps up"),
    ("short", "short"),
    ("many_steps", "many steps"),
    ("interrupted", "interrupted"),
    ("first_line", "first line"),
];

/// What has passed by.
struct Read {
    judges: Vec<Judge>,
    blocks: u64,
    shortest: Option<Block>,
}

pub fn run(file: &Path, args: &Args, global: &Global) -> Outcome {
    let program = Program::open(file, &args.motion, global)?;
    let settings = args.settings(&program.machine)?;
    let read = if args.csv {
        let mut out = BufWriter::new(io::stdout().lock());
        let read = each_block(&program, &settings, args, &mut out)?;
        out.flush()?;
        read
    } else {
        each_block(&program, &settings, args, &mut io::sink())?
    };
    let table = summary(&read.judges);
    if global.json {
        let mut document = json!({
            "schema": 1,
            "machine": program.machine.id,
            "blocks": read.blocks,
            "shortest": read.shortest.map(|block| json!({
                "line": block.line, "ms": six_digits(block.time_s * 1e3),
            })),
            "rows": table.json(),
        });
        for (row, judge) in document["rows"].as_array_mut().into_iter().flatten().zip(&read.judges)
        {
            row["refused"] = json!(judge.refusal.map(|refusal| refusal.to_string()));
            row["first"] = found_json(judge.first.as_ref());
            row["worst"] = found_json(judge.worst.as_ref());
        }
        writeln!(io::stdout().lock(), "{document}")?;
    } else if !args.csv {
        print(&mut io::stdout().lock(), &program, &read, &table)?;
    }
    let all = read.judges.iter().all(Judge::keeps_up);
    Ok(if all || args.protocol.is_empty() { Exit::Ok } else { Exit::BadInput })
}

/// Lets the path pass by, and writes a row a block.
fn each_block(
    program: &Program,
    settings: &[Setting],
    args: &Args,
    out: &mut impl Write,
) -> Result<Read, Failure> {
    let machine: &Machine = &program.machine;
    let judges = settings.iter();
    let judges = judges.map(|setting| Judge::new(*setting, machine, args.frequency.is_some()));
    let mut read = Read { judges: judges.collect(), blocks: 0, shortest: None };
    writeln!(out, "block,line,length_mm,feed_mm_min,ms,{}", heads(&read.judges).join(","))?;
    for item in program.path() {
        let item =
            item.map_err(|error| anyhow!(error).context("the program changed while it was read"))?;
        let block = match &item {
            PathItem::Segment(segment) => Block::of(segment, machine),
            PathItem::Event(_) => None,
        };
        let index = read.blocks;
        let judges = read.judges.iter_mut();
        let lacks: Vec<Option<Lack>> =
            judges.map(|judge| judge.item(&item, block.as_ref(), index)).collect();
        let Some(block) = block else { continue };
        if read.shortest.is_none_or(|shortest| block.time_s < shortest.time_s) {
            read.shortest = Some(block);
        }
        read.blocks += 1;
        if args.csv {
            row(out, index, &block, &lacks)?;
        }
    }
    Ok(read)
}

/// A name for each setting: that of its interface where it stands alone.
fn heads(judges: &[Judge]) -> Vec<String> {
    let name = |judge: &Judge| {
        let Setting { interface, nodes, baud, .. } = judge.setting;
        let alone = judges.iter().filter(|other| other.setting.interface == interface).count() == 1;
        if alone { interface.to_string() } else { format!("{interface}_{nodes}_{baud}") }
    };
    judges.iter().map(name).collect()
}

fn row(out: &mut impl Write, index: u64, block: &Block, lacks: &[Option<Lack>]) -> io::Result<()> {
    let feed = block.feed_mm_s.map_or(String::new(), |feed| six_digits(feed * 60.0).to_string());
    let (length_mm, ms) = (six_digits(block.length_mm), six_digits(block.time_s * 1e3));
    write!(out, "{index},{},{length_mm},{feed},{ms}", block.line)?;
    for lack in lacks {
        let word = match lack {
            None => "yes",
            Some(Lack::TooShort { .. }) => "short",
            Some(Lack::TooManySteps { .. }) => "many-steps",
            Some(Lack::Interrupted { .. }) => "interrupted",
        };
        write!(out, ",{word}")?;
    }
    writeln!(out)
}

fn summary(judges: &[Judge]) -> Table {
    let row = |judge: &Judge| {
        let [short, many_steps, interrupted] = judge.lacking;
        let first = judge.first.map_or(Cell::Empty, |found| Cell::Whole(found.line.into()));
        vec![
            Cell::text(judge.setting.interface),
            Cell::Whole(judge.setting.nodes.into()),
            Cell::Whole(judge.setting.baud.into()),
            Cell::Number(judge.setting.period_s * 1e3, 4),
            Cell::Flag(judge.keeps_up()),
            Cell::Whole(short),
            Cell::Whole(many_steps),
            Cell::Whole(interrupted),
            first,
        ]
    };
    Table { columns: SUMMARY.to_vec(), rows: judges.iter().map(row).collect() }
}

fn print(out: &mut impl Write, program: &Program, read: &Read, table: &Table) -> io::Result<()> {
    writeln!(out, "program   {}: {}", program.source.name(), count(read.blocks, "block"))?;
    writeln!(out, "machine   {}", program.machine)?;
    if let Some(block) = &read.shortest {
        let (line, ms, length_mm) = (block.line, block.time_s * 1e3, block.length_mm);
        writeln!(out, "shortest  line {line}: {length_mm:.3} mm in {ms:.3} ms")?;
    }
    writeln!(out)?;
    table.print(out)?;
    for judge in &read.judges {
        let interface = judge.setting.interface;
        if let Some(refusal) = &judge.refusal {
            writeln!(out, "{interface}: cannot work: {refusal}")?;
        }
        let (Some(first), Some(worst)) = (&judge.first, &judge.worst) else { continue };
        writeln!(out, "{interface}: first at line {}: {}", first.line, first.lack)?;
        if worst.index != first.index || worst.lack != first.lack {
            writeln!(out, "{interface}: worst at line {}: {}", worst.line, worst.lack)?;
        }
    }
    Ok(())
}

fn found_json(found: Option<&Found>) -> Value {
    let Some(Found { index, line, lack }) = found else { return Value::Null };
    let kind = match lack {
        Lack::TooShort { .. } => "short",
        Lack::TooManySteps { .. } => "many-steps",
        Lack::Interrupted { .. } => "interrupted",
    };
    json!({"block": index, "line": line, "lack": kind, "message": lack.to_string()})
}
