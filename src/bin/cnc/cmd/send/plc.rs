//! `--plc`: M, S and T functions by handshake; `--signals`: what was on the wires, and when.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::anyhow;
use cnc::base::Machine;
use cnc::systems::plc::{Plc, Sample, record};
use cnc::wire::Job;
use cnc::wire_io::{PlcRunner, Serial};

use super::super::plot::timing;
use crate::args::Global;
use crate::exit::{ExitWith, Failure};
use crate::output::WholeFile;

/// How long the PLC within this program takes over a function.
const ACTS_US: u64 = 100_000;
/// The port of a PLC within this program.
const SIMULATED: &str = "sim:";

/// The PLC, and what is kept of it.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct PlcArgs {
    /// Give M, S and T functions to the PLC at this port, by handshake (docs/plc.md); sim: is one within
    /// this program
    #[arg(long, value_name = "PORT")]
    plc: Option<PathBuf>,
    /// Write the signals of the handshake with their times, as CSV
    #[arg(long, value_name = "FILE", requires = "plc")]
    pub signals: Option<PathBuf>,
    /// Draw them, function by function, as SVG
    #[arg(long, value_name = "FILE", requires = "plc")]
    pub svg: Option<PathBuf>,
}

impl PlcArgs {
    /// Whether there is to be one.
    pub fn is_given(&self) -> bool {
        self.plc.is_some()
    }

    /// Refuses a job that cannot be told by codes, or that hooks would do too; and a PLC that does nothing for
    /// nodes that cut.
    pub fn check(&self, job: &Job, machine: &Machine, is_real: bool) -> Result<(), Failure> {
        let Some(path) = &self.plc else { return Ok(()) };
        if is_real && path == Path::new(SIMULATED) {
            return Err(anyhow!(
                "--plc sim: does nothing, and says that it is done: it is for virtual nodes"
            )
            .into());
        }
        if !machine.hooks.is_empty() {
            return Err(anyhow!(
                "machine {} has hooks, and --plc gives all functions to the PLC: one of them has to do it",
                machine.id
            )
            .into());
        }
        PlcRunner::check(job).map_err(|reason| anyhow!(reason)).or_bad_input()
    }

    /// Who does M, S and T functions, if it is the PLC.
    pub fn announce(&self, global: &Global) {
        if let Some(path) = self.plc.as_ref().filter(|_| !global.quiet) {
            say!("plc       M, S and T functions go to {}", path.display());
        }
    }

    /// Opens the port and hears the PLC, if there is to be one.
    pub fn open(&self, machine: &Machine) -> Result<Option<PlcRunner>, Failure> {
        let Some(path) = &self.plc else { return Ok(None) };
        let profile = machine.plc.unwrap_or_default();
        if path == Path::new(SIMULATED) {
            return Ok(Some(PlcRunner::simulated(Plc::new(ACTS_US, Vec::new()), &profile)));
        }
        let port = Serial::open(path, profile.baud).or_bus()?;
        let mut plc = PlcRunner::wired(port, &profile);
        plc.connect().map_err(|reason| anyhow!("{}: {reason}", path.display())).or_bus()?;
        Ok(Some(plc))
    }
}

/// Files that what was on the wires is written to when the job is over.
pub struct SignalFiles {
    csv: Option<WholeFile>,
    svg: Option<WholeFile>,
    /// Name of the program.
    job: String,
}

impl SignalFiles {
    /// Makes sure that they can be written.
    pub fn create(args: &PlcArgs, job: &str) -> Result<SignalFiles, Failure> {
        let create = |path: &Option<PathBuf>| path.as_deref().map(WholeFile::create).transpose();
        Ok(SignalFiles {
            csv: create(&args.signals)?,
            svg: create(&args.svg)?,
            job: job.to_owned(),
        })
    }

    /// Writes those that are wanted.
    pub fn write(self, samples: &[Sample]) -> Result<(), Failure> {
        if let Some(file) = self.csv {
            file.write(|out| Ok(write_signals(out, samples)?))?;
        }
        if let Some(file) = self.svg {
            let drawing = timing::drawing(samples, &self.job);
            file.write(|out| Ok(write!(out, "{drawing}")?))?;
        }
        Ok(())
    }
}

/// A row each time that a signal has changed.
fn write_signals(out: &mut impl Write, samples: &[Sample]) -> io::Result<()> {
    writeln!(out, "{}", record::HEADER)?;
    samples.iter().try_for_each(|sample| writeln!(out, "{sample}"))
}
