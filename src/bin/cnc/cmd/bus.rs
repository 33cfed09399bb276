//! `cnc bus`: what an interface to the axes carries, and whether it keeps up with a program.

mod curves;
mod keeps;
mod numbers;
mod ring;
mod rows;

use std::io::{self, BufWriter, Write};
use std::path::PathBuf;

use anyhow::anyhow;
use clap::ValueEnum;
use cnc::base::{Axis, Machine};
use cnc::plot::Chart;
use cnc::systems::carry::{Interface, Setting};
use cnc::systems::sercos::Strike;
use serde_json::{Value, json};

use self::curves::Curves;
use self::numbers::{Decimals, Wholes};
use crate::args::Global;
use crate::exit::{Exit, Outcome};
use crate::program::MotionArgs;
use crate::table::Table;
use crate::{input, output};

/// Most rows of a table: what a command answers at once.
const ROWS_MOST: usize = 100_000;

/// Tell what a bus carries, and whether it keeps up with a program
///
/// Without a program: cycle, fill and sync times, time left for computing and nodes possible, for
/// each interface. With one: whether each interface can tell the axes of every block in time.
/// Numbers given as lists (1,2,4-8) make a row each.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// NC program; - is standard input
    program: Option<PathBuf>,
    /// Only these; exit 1 where one of them cannot work or does not keep up
    #[arg(long, value_enum, value_delimiter = ',', value_name = "P,…")]
    protocol: Vec<ProtocolArg>,
    /// How many axes are told [default: those of the profile]
    #[arg(long, value_name = "LIST")]
    nodes: Option<Wholes>,
    /// Bits a second [default: the profile's; 2000000 for sercos, 80000000 for parallel]
    #[arg(long, value_name = "LIST")]
    baud: Option<Wholes>,
    /// How often a second axes are told [default: the profile's ticks; with a program, as often as
    /// the interface can]
    #[arg(long, value_name = "HZ,…")]
    frequency: Option<Decimals>,
    /// Bits of a constant of method B
    #[arg(long, value_name = "N", default_value_t = 32, value_parser = clap::value_parser!(u32).range(8..=64))]
    word_bits: u32,
    /// Instead: whether blocks of this length are short for the interface …
    #[arg(long, value_name = "MM", requires = "block_feed", conflicts_with = "program", value_parser = numbers::positive)]
    block_mm: Option<f64>,
    /// … at these feeds, in mm/min
    #[arg(long, value_name = "LIST", requires = "block_mm")]
    block_feed: Option<Decimals>,
    /// Instead: curves
    #[arg(long, value_enum, value_name = "WHICH", conflicts_with_all = ["program", "block_mm"])]
    curves: Option<Curves>,
    /// Print CSV; with a program, a row a block
    #[arg(long, conflicts_with = "json")]
    csv: bool,
    /// Draw the curves
    #[arg(long, value_name = "FILE", requires = "curves")]
    svg: Option<PathBuf>,
    /// Let a virtual ring of SERCOS drives execute the program, and hold that against its path
    #[arg(long, requires = "program", conflicts_with_all = ["csv", "nodes"])]
    ring: bool,
    /// A bit that is flipped on the ring, as control@17, sync@3 or drive2@100.45: telegram, cycle and
    /// bit; may be given again
    #[arg(long, value_name = "SPEC", requires = "ring")]
    fault: Vec<Strike>,
    #[command(flatten)]
    motion: MotionArgs,
}

/// An interface, by the name of its protocol or of its method.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ProtocolArg {
    /// A frame every period (method A)
    #[value(alias = "a")]
    Frame,
    /// Constants of difference equations, every block (method B)
    #[value(alias = "b")]
    Coefficients,
    /// Buffers in the nodes, and a sync message every period (method C)
    #[value(alias = "c")]
    Buffered,
    /// A ring of drives
    Sercos,
    /// A system bus with servo boards
    Parallel,
}

impl ProtocolArg {
    fn interface(self) -> Interface {
        match self {
            ProtocolArg::Frame => Interface::Frame,
            ProtocolArg::Coefficients => Interface::Coefficients,
            ProtocolArg::Buffered => Interface::Buffered,
            ProtocolArg::Sercos => Interface::Sercos,
            ProtocolArg::Parallel => Interface::Parallel,
        }
    }
}

pub fn run(args: &Args, global: &Global) -> Outcome {
    if let (Some(file), true) = (&args.program, args.ring) {
        return ring::run(file, args, global);
    }
    if let Some(file) = &args.program {
        return keeps::run(file, args, global);
    }
    MotionArgs::refuse(global, "no program is named")?;
    let machine = input::machine(global)?;
    if let Some(which) = args.curves {
        let curves = curves::draw(which, args, &machine)?;
        if let Some(path) = &args.svg {
            output::whole_file(path, |out| Ok(write!(out, "{}", curves.chart)?))?;
            if !args.csv && !global.json {
                return Ok(Exit::Ok);
            }
        }
        args.put(&curves.table, json!({"curves": curves.name}), global)?;
        return Ok(Exit::Ok);
    }
    let settings = args.settings(&machine)?;
    let refused = refusals(args, &settings, global);
    let mut exit = if refused { Exit::BadInput } else { Exit::Ok };
    let table = match (args.block_mm, &args.block_feed) {
        (Some(block_mm), Some(feeds)) => {
            let (table, all_keep_up) = rows::blocks(&settings, block_mm, &feeds.0);
            if !all_keep_up && !args.protocol.is_empty() {
                exit = Exit::BadInput;
            }
            table
        }
        _ => rows::carried(&settings),
    };
    args.put(&table, json!({"machine": machine.id}), global)?;
    Ok(exit)
}

/// Says why settings cannot work. True where one of them was chosen.
fn refusals(args: &Args, settings: &[Setting], global: &Global) -> bool {
    let is_chosen = !args.protocol.is_empty();
    let mut refused = false;
    for setting in settings {
        let Err(refusal) = setting.check() else { continue };
        let Setting { interface, nodes, baud, .. } = setting;
        if is_chosen || !global.quiet {
            let kind = if is_chosen { "error" } else { "note" };
            say!("{kind}: {interface} cannot work, {nodes} nodes at {baud} baud: {refusal}");
        }
        refused = is_chosen;
    }
    refused
}

impl Args {
    /// The interfaces asked for, or all.
    fn interfaces(&self) -> Vec<Interface> {
        if self.protocol.is_empty() {
            return Interface::ALL.to_vec();
        }
        self.protocol.iter().map(|protocol| protocol.interface()).collect()
    }

    /// Every combination of what is asked for.
    fn settings(&self, machine: &Machine) -> anyhow::Result<Vec<Setting>> {
        let mut settings = Vec::new();
        let wholes = |list: &Option<Wholes>| list.as_ref().map_or(1, |list| list.0.len());
        let decimals = |list: &Option<Decimals>| list.as_ref().map_or(1, |list| list.0.len());
        let rows = self.interfaces().len() as f64
            * wholes(&self.nodes) as f64
            * wholes(&self.baud) as f64
            * decimals(&self.frequency) as f64
            * decimals(&self.block_feed) as f64;
        if rows > ROWS_MOST as f64 {
            return Err(anyhow!("these lists make {rows} rows: at most {ROWS_MOST} are computed"));
        }
        for interface in self.interfaces() {
            let usual = self.usual(interface, machine);
            let nodes = self.nodes.as_ref().map_or(vec![usual.nodes], |list| list.0.clone());
            let bauds = self.baud.as_ref().map_or(vec![usual.baud], |list| list.0.clone());
            let hz = self.frequency.as_ref().map(|list| list.0.clone());
            let periods = hz
                .map_or(vec![usual.period_s], |list| list.into_iter().map(|hz| 1.0 / hz).collect());
            for nodes in nodes {
                for baud in &bauds {
                    let setting = Setting { nodes, baud: *baud, ..usual };
                    settings.extend(
                        periods.iter().map(|period_s| Setting { period_s: *period_s, ..setting }),
                    );
                }
            }
        }
        Ok(settings)
    }

    /// An interface as the profile would have it.
    fn usual(&self, interface: Interface, machine: &Machine) -> Setting {
        let linear = || machine.axes.iter().filter(|profile| Axis::LINEAR.contains(&profile.axis));
        let nodes = match machine.bus.nodes.len() {
            0 => linear().count(),
            nodes => nodes,
        };
        let setting = Setting::of(interface, &machine.bus, nodes.max(1) as u32);
        Setting { word_bits: self.word_bits, ..setting }
    }

    /// Prints a table in the form asked for.
    fn put(&self, table: &Table, head: Value, global: &Global) -> io::Result<()> {
        let mut out = BufWriter::new(io::stdout().lock());
        match (self.csv, global.json) {
            (true, _) => table.csv(&mut out)?,
            (false, true) => {
                let mut document = head;
                document["schema"] = json!(1);
                document["rows"] = table.json();
                writeln!(out, "{document}")?;
            }
            (false, false) => table.print(&mut out)?,
        }
        out.flush()
    }
}

/// Curves, as numbers and as a drawing.
struct Drawn {
    name: &'static str,
    table: Table,
    chart: Chart,
}

/// That an option has no meaning with an interface.
fn meaningless(option: &str, interface: Interface, why: &str) -> anyhow::Error {
    anyhow!("{option} has no meaning with {interface}: {why}")
}
