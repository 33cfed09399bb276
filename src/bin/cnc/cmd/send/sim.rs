//! `sim:`, `sim:seed=7`, `sim:faults=drop@data.3+dead:X@tick.5`: the port that needs none.

use std::path::Path;

use anyhow::{Context, anyhow};
use cnc::base::Machine;
use cnc::base::machine::{Protocol, Unit};
use cnc::wire::{FaultSpec, Faults};

/// Faults of simulated nodes, as the port's name asks for them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Simulation {
    seed: Option<u64>,
    /// How many the seed draws.
    count: Option<usize>,
    list: Vec<FaultSpec>,
}

/// Most faults drawn: a run has an end after one or two.
const COUNT_MAX: usize = 1000;

impl Simulation {
    /// Reads the name of a port; none if it is another kind of port.
    pub fn of_port(port: &Path) -> anyhow::Result<Option<Simulation>> {
        let name = port.to_str().and_then(|name| name.strip_prefix("sim:"));
        let Some(options) = name else { return Ok(None) };
        let mut found = Simulation::default();
        for option in options.split(',').filter(|option| !option.is_empty()) {
            let value = |key: &str| option.strip_prefix(key)?.strip_prefix('=');
            if let Some(seed) = value("seed") {
                found.seed = Some(seed.parse().with_context(|| format!("sim: seed {seed}"))?);
            } else if let Some(faults) = value("faults") {
                found.faults(faults)?;
            } else {
                return Err(anyhow!(
                    "sim: '{option}' is no option of it; known are seed=N, faults=SPEC+SPEC…, and with \
                     a seed faults=COUNT"
                ));
            }
        }
        if found.count.is_some() && found.seed.is_none() {
            return Err(anyhow!("sim: a number of faults needs a seed to draw them from: seed=N"));
        }
        Ok(Some(found))
    }

    fn faults(&mut self, text: &str) -> anyhow::Result<()> {
        if let Ok(count) = text.parse() {
            if count > COUNT_MAX {
                return Err(anyhow!("sim: faults={count}: at most {COUNT_MAX} are drawn"));
            }
            self.count = Some(count);
            return Ok(());
        }
        self.list = text.split('+').map(str::parse).collect::<Result<_, _>>().context("sim")?;
        Ok(())
    }

    /// The faults that strike a machine's nodes.
    pub fn faults_of(&self, machine: &Machine) -> anyhow::Result<Vec<FaultSpec>> {
        let units: Vec<Unit> = machine.bus.units().collect();
        faults(&units, machine, &self.list, self.seed, self.count)
    }
}

/// Faults of a list, whose nodes must be there, and of a seed: one unless a number is given, or a
/// list.
pub fn faults(
    units: &[Unit],
    machine: &Machine,
    list: &[FaultSpec],
    seed: Option<u64>,
    count: Option<usize>,
) -> anyhow::Result<Vec<FaultSpec>> {
    let stranger =
        |fault: &&FaultSpec| fault.who.is_some_and(|who| !units.iter().any(|unit| who.is(*unit)));
    if let Some(fault) = list.iter().find(stranger) {
        return Err(anyhow!("fault {fault}: there is no such node on this bus"));
    }
    let count = count.unwrap_or(usize::from(list.is_empty()));
    let drawn = seed.map(|seed| match machine.bus.protocol {
        Protocol::Frame => Faults::draw_frames(seed, count, units),
        _ => Faults::draw(seed, count, units, machine.bus.buffer_ticks),
    });
    Ok([list.to_vec(), drawn.unwrap_or_default()].concat())
}
