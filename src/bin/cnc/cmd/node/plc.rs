//! `cnc node --plc`: a virtual PLC on a pseudo-terminal.

use std::io::Write;

use anyhow::Context;
use cnc::systems::plc::{Function, Plc, PlcFault, PlcHappening};
use cnc::wire_io::{Pty, serve_plc};
use serde_json::json;

use super::announce;
use crate::args::Global;
use crate::exit::{Exit, Outcome};
use crate::interrupt::Interrupts;

/// Options of a virtual PLC.
#[derive(Debug, clap::Args)]
pub struct PlcArgs {
    /// Be a PLC that does M, S and T functions by handshake, and no node
    #[arg(long, conflicts_with_all = ["units", "baud", "speed", "executed", "fault", "seed", "protocol"])]
    pub plc: bool,
    /// How long the PLC takes over a function
    #[arg(long, value_name = "MS", default_value = "100", requires = "plc",
        value_parser = clap::value_parser!(u32).range(0..=3_600_000))]
    acts: u32,
    /// A function that the PLC never ends: it gives no FIN; may be given again
    #[arg(long, value_name = "FUNCTION", requires = "plc")]
    silent: Vec<Function>,
    /// A function after which the PLC keeps FIN on; may be given again
    #[arg(long, value_name = "FUNCTION", requires = "plc")]
    stuck: Vec<Function>,
}

/// Runs it.
pub fn run(args: &PlcArgs, pty: &mut Pty, once: bool, global: &Global) -> Outcome {
    let silent = args.silent.iter().copied().map(PlcFault::Silent);
    let stuck = args.stuck.iter().copied().map(PlcFault::Stuck);
    let mut plc = Plc::new(u64::from(args.acts) * 1000, silent.chain(stuck).collect());
    let interrupts = Interrupts::watch()?;
    announce(pty, global)?;
    let mut done = 0_u64;
    let mut happened = |at_us: u64, happening| {
        let at_s = at_us as f64 * 1e-6;
        let what = match happening {
            PlcHappening::Strobe(function) => format!("{} of {function}", function.kind.strobe()),
            PlcHappening::Done(function) => {
                done += 1;
                format!("FIN of {function}")
            }
            PlcHappening::Ready => "ready".to_owned(),
        };
        if global.verbose {
            say!("{at_s:.6} s: {what}");
        }
    };
    let stopped = || interrupts.count() > 0;
    serve_plc(pty, &mut plc, once, &mut happened, &stopped).context("pseudo-terminal")?;
    if global.json {
        writeln!(std::io::stdout(), "{}", json!({ "schema": 1, "functions": done }))?;
    } else if !global.quiet {
        say!("{done} functions done");
    }
    Ok(Exit::Ok)
}
