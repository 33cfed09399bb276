//! `--times`: what each block takes, and each tool.

use std::io::{self, Write};

use cnc::base::rounding::six_digits;
use cnc::step::{BlockTime, Phases, Times};
use serde_json::{Map, Value, json};

/// The table's head.
pub fn head(out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "seconds; events take what they take")?;
    writeln!(out)?;
    write!(out, "{:>9} {:>5}", "line", "tool")?;
    columns(out)
}

/// What a block takes, as a row or as an object.
pub fn block(out: &mut impl Write, block: &BlockTime, as_json: bool) -> io::Result<()> {
    if as_json {
        let mut object = object(&block.phases);
        object.insert("type".to_owned(), json!("block"));
        object.insert("line".to_owned(), json!(block.line));
        object.insert("tool".to_owned(), json!(block.tool));
        return writeln!(out, "{}", Value::Object(object));
    }
    write!(out, "{:>9} {:>5}", block.line, name(block.tool))?;
    row(out, &block.phases)
}

/// The table of the tools, and of all of them together.
pub fn tools(out: &mut impl Write, times: &Times) -> io::Result<()> {
    writeln!(out)?;
    write!(out, "{:>9} {:>5}", "", "tool")?;
    columns(out)?;
    for (tool, phases) in times.tools() {
        write!(out, "{:>9} {:>5}", "", name(tool))?;
        row(out, phases)?;
    }
    write!(out, "{:>9} {:>5}", "", "all")?;
    row(out, &times.total())
}

/// What stands in the summary under `times`.
pub fn summary(times: &Times) -> Value {
    let tool = |(tool, phases): (Option<u32>, &Phases)| {
        let mut object = object(phases);
        object.insert("tool".to_owned(), json!(tool));
        Value::Object(object)
    };
    let mut all = object(&times.total());
    all.insert("by_tool".to_owned(), times.tools().map(tool).collect());
    Value::Object(all)
}

fn name(tool: Option<u32>) -> String {
    tool.map_or("-".to_owned(), |tool| format!("T{tool}"))
}

fn columns(out: &mut impl Write) -> io::Result<()> {
    let names = ["cut", "rapid", "dwell", "refill", "total", "events"];
    names.iter().try_for_each(|name| write!(out, " {name:>10}"))?;
    writeln!(out)
}

fn row(out: &mut impl Write, phases: &Phases) -> io::Result<()> {
    let Phases { cut_s, rapid_s, dwell_s, refill_s, events } = *phases;
    for time_s in [cut_s, rapid_s, dwell_s, refill_s, phases.total_s()] {
        write!(out, " {time_s:>10.3}")?;
    }
    writeln!(out, " {events:>10}")
}

fn object(phases: &Phases) -> Map<String, Value> {
    let parts = [
        ("cut_seconds", phases.cut_s),
        ("rapid_seconds", phases.rapid_s),
        ("dwell_seconds", phases.dwell_s),
        ("refill_seconds", phases.refill_s),
        ("total_seconds", phases.total_s()),
    ];
    let times = parts.map(|(name, time_s)| (name.to_owned(), json!(six_digits(time_s))));
    times.into_iter().chain([("events".to_owned(), json!(phases.events))]).collect()
}
