//! `cnc node`: virtual nodes on a pseudo-terminal that behave as the node firmware does.

mod plc;

use std::io::Write;
use std::path::PathBuf;

use anyhow::{Context, anyhow};
use cnc::base::machine::{Protocol, Unit};
use cnc::base::source::shown;
use cnc::base::{Axis, AxisSet, Machine};
use cnc::wire::{
    ANSWER_PAUSE_US, Entry, ExecutedTick, FaultSpec, Faults, Happening, Nodes, Struck,
};
use cnc::wire_io::{Pty, Serving, Speed, serve};
use serde_json::json;

use self::plc::PlcArgs;
use super::send::sim;
use crate::args::Global;
use crate::exit::{Exit, Outcome};
use crate::interrupt::Interrupts;
use crate::output::WholeFile;
use crate::plural::count;
use crate::protocol::{NO_MAX, ProtocolArgs};

/// How far this system may be late in reading bytes before the nodes' log calls it a hazard.
const READ_LATE_US: f64 = 5000.0;

/// Run virtual nodes on a pseudo-terminal, which behave as the node firmware does
///
/// The name of the pseudo-terminal, which a host opens like a serial port, is printed; the nodes run until
/// they are interrupted. What happens on them goes to standard error.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Make a symbolic link to the pseudo-terminal
    #[arg(long, value_name = "PATH")]
    link: Option<PathBuf>,
    /// Nodes by axis and ID, as X=122,Y=123, or by ID alone where there is no axis; the machine's by
    /// default
    #[arg(long, value_name = "[AXIS=]ID,…", value_delimiter = ',', value_parser = unit)]
    units: Vec<Unit>,
    #[command(flatten)]
    protocol: ProtocolArgs,
    /// Bits a second on the wire; the machine's by default
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(50..=10_000_000))]
    baud: Option<u32>,
    /// Run so many times faster than real nodes, or as fast as bytes come
    #[arg(long, value_name = "K|max", default_value = "1")]
    speed: Speed,
    /// Write the counts that were executed, tick by tick, as CSV
    #[arg(long, value_name = "FILE")]
    executed: Option<PathBuf>,
    /// End when the host has closed the port
    #[arg(long)]
    once: bool,
    /// Something to go wrong, as drop:Y@data.17 (docs/bus.md); may be given again
    #[arg(long, value_name = "SPEC")]
    fault: Vec<FaultSpec>,
    /// Draw a fault from this seed
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    #[command(flatten)]
    plc: PlcArgs,
}

fn unit(text: &str) -> Result<Unit, String> {
    let expected = || format!("'{text}' is no node; expected one like X=122, IDs from 120 to 135");
    let axis = |text: &str| match text.as_bytes() {
        [letter] => Axis::from_letter(letter.to_ascii_uppercase()).ok_or_else(expected),
        _ => Err(expected()),
    };
    let (axis, id) = match text.trim().split_once('=') {
        Some((letter, id)) => (Some(axis(letter)?), id),
        None => (None, text.trim()),
    };
    let id = id.parse().ok().filter(|id| (120..=135).contains(id)).ok_or_else(expected)?;
    Ok(Unit { axis, id })
}

pub fn run(args: &Args, global: &Global) -> Outcome {
    if args.plc.plc {
        global.refuse(&["machine"], "a PLC has no axes")?;
        return plc::run(&args.plc, &mut pty(args)?, args.once, global);
    }
    let mut machine = args.protocol.machine(global)?;
    let executed_file = args.executed.as_deref().map(WholeFile::create).transpose()?;
    machine.bus.baud = args.baud.unwrap_or(machine.bus.baud);
    let units = units(args, &machine)?;
    let faults = sim::faults(&units, &machine, &args.fault, args.seed, None)?;
    let interrupts = Interrupts::watch()?;
    let late_us = match args.speed {
        Speed::Times(factor) => (READ_LATE_US * factor) as u64,
        Speed::Max => 0,
    };
    let start = machine.nearest_steps(&machine.work_zero_mm);
    if !faults.is_empty() && !global.quiet {
        let list: Vec<_> = faults.iter().map(ToString::to_string).collect();
        say!("faults to come: {}", list.join(" "));
    }
    let faults = Faults::of_bus(faults, &machine.bus);
    let nodes = Nodes::new(&machine, units, &start, ANSWER_PAUSE_US + late_us);
    let mut nodes = nodes.with_faults(faults);
    let mut pty = pty(args)?;
    announce(&pty, global)?;
    let mut hazards = 0_u64;
    let mut entry = |entry: &Entry| {
        hazards += u64::from(entry.hazard.is_some());
        log(entry, global);
    };
    let mut struck = |Struck { at_us, fault, phase }: &Struck| {
        let (at_s, phase) = (*at_us as f64 * 1e-6, phase.name());
        say!("fault {fault} struck at {at_s:.6} s, in the phase {phase}");
    };
    let stopped = || interrupts.count() > 0;
    let serving = Serving {
        speed: args.speed,
        once: args.once,
        entry: &mut entry,
        struck: &mut struck,
        stopped: &stopped,
    };
    serve(&mut pty, &mut nodes, serving).context("pseudo-terminal")?;
    let executed = nodes.executed();
    if let Some(file) = executed_file {
        file.write(|out| Ok(write_executed(out, &machine, &nodes, &executed)?))?;
    }
    summary(&nodes, &executed, hazards, global)?;
    Ok(Exit::Ok)
}

fn units(args: &Args, machine: &Machine) -> anyhow::Result<Vec<Unit>> {
    if machine.bus.protocol == Protocol::Frame && !args.units.is_empty() {
        return Err(anyhow!(
            "--units names nodes by ID; nodes that take frames have places, in the profile's order"
        ));
    }
    if machine.bus.protocol == Protocol::Frame && args.speed == Speed::Max {
        return Err(anyhow!("{}", NO_MAX));
    }
    let units: Vec<Unit> =
        if args.units.is_empty() { machine.bus.units().collect() } else { args.units.clone() };
    if units.is_empty() {
        return Err(anyhow!("machine {machine} has no nodes; name some with --units X=122,Y=123"));
    }
    for (at, unit) in units.iter().enumerate() {
        let twin =
            |other: &Unit| other.id == unit.id || (other.axis.is_some() && other.axis == unit.axis);
        if units.iter().take(at).any(twin) {
            return Err(anyhow!("--units: {unit}: this ID or axis is there twice"));
        }
    }
    Ok(units)
}

fn pty(args: &Args) -> anyhow::Result<Pty> {
    Pty::open(args.link.as_deref()).with_context(|| match &args.link {
        Some(link) => format!("no pseudo-terminal with the link {}", shown(link)),
        None => "no pseudo-terminal".to_owned(),
    })
}

fn announce(pty: &Pty, global: &Global) -> std::io::Result<()> {
    let name = pty.name().display();
    let mut out = std::io::stdout().lock();
    if global.json {
        writeln!(out, "{}", json!({ "schema": 1, "pty": name.to_string() }))?;
    } else {
        writeln!(out, "{name}")?;
    }
    out.flush()
}

/// Hazards always; the rest if the user wants more. Pings come before every fill.
fn log(entry: &Entry, global: &Global) {
    let what = match entry.happening {
        Happening::FillBegins { master: true } => "is filled, as master".to_owned(),
        Happening::FillBegins { master: false } => "is filled".to_owned(),
        Happening::Filled => "is full".to_owned(),
        Happening::Starts => "starts".to_owned(),
        Happening::Finished => "has executed its buffer".to_owned(),
        Happening::Homes { ticks } => format!("runs to its limit switch, {ticks} ticks away"),
        Happening::Jogs { feed: 0 } => "is pinged".to_owned(),
        Happening::Jogs { feed } => format!("jogs with feed byte {feed}"),
        Happening::SyncWaited { entry, waited_us } => {
            format!("began tick {entry} {waited_us} µs late")
        }
        Happening::FrameMissed { tick } => format!("missed frame {tick} of the stretch"),
        Happening::RanDry { count, gap_us } => {
            format!("had no frame for {gap_us} µs while it ran at {count} steps a tick")
        }
        Happening::Overrun => "was sent more bytes than its receiver keeps".to_owned(),
    };
    let (at_s, unit) = (entry.at_us as f64 * 1e-6, entry.unit);
    match entry.hazard {
        Some(hazard) => say!("hazard at {at_s:.6} s: {unit} {what}: it {hazard}"),
        None if global.verbose => say!("{at_s:.6} s: {unit} {what}"),
        None => {}
    }
}

/// The counts that each axis executed, a row a tick.
fn write_executed(
    out: &mut impl Write,
    machine: &Machine,
    nodes: &Nodes,
    executed: &[ExecutedTick],
) -> std::io::Result<()> {
    let machine_axes = machine.axes.iter().map(|profile| profile.axis);
    let axes: AxisSet =
        nodes.iter().filter_map(|(unit, _)| unit.axis).chain(machine_axes).collect();
    let names: Vec<String> = axes.iter().map(|axis| axis.to_string()).collect();
    writeln!(out, "tick,buffer,{}", names.join(","))?;
    for (tick, row) in executed.iter().enumerate() {
        write!(out, "{tick},{}", row.buffer)?;
        axes.iter().try_for_each(|axis| write!(out, ",{}", row.counts[axis]))?;
        writeln!(out)?;
    }
    Ok(())
}

fn summary(
    nodes: &Nodes,
    executed: &[ExecutedTick],
    hazards: u64,
    global: &Global,
) -> std::io::Result<()> {
    let buffers = executed.last().map_or(0, |tick| tick.buffer + 1);
    if global.json {
        let axes: serde_json::Map<_, _> = nodes
            .iter()
            .map(|(unit, node)| {
                let state = json!({
                    "id": node.id(),
                    "steps": node.position_steps(),
                    "full": node.is_full(),
                });
                let name = unit.axis.map_or(unit.id.to_string(), |axis| axis.to_string());
                (name, state)
            })
            .collect();
        let ticks = executed.len();
        let result = json!({
            "schema": 1, "ticks": ticks, "buffers": buffers, "hazards": hazards, "axes": axes,
        });
        writeln!(std::io::stdout(), "{result}")?;
    }
    if !global.quiet {
        let ticks = count(executed.len() as u64, "tick");
        let (buffers, hazards) = (count(buffers.into(), "buffer"), count(hazards, "hazard"));
        say!("{ticks} executed in {buffers}, {hazards}");
        for (unit, node) in nodes.iter() {
            let full = if node.is_full() { ", holds a buffer" } else { "" };
            say!("{unit} at step {}{full}", node.position_steps());
        }
    }
    Ok(())
}
