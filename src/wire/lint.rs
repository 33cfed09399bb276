//! Job → proof that every node obeys what is meant for it and nothing else (H1 to H5, H9).
//!
//! Every pair of bytes, in the order of sending, is held against the state of every node that reads
//! pairs then: empty or full, each idle and in phase. Rule: only the node addressed may begin
//! anything. What a node takes for a command is bus knowledge written down here a second time, apart
//! from [`crate::wire::Node`], so that tests can hold one against the other. Bytes that noise changes
//! are not part of it.

use crate::base::Machine;
use crate::base::machine::{HOST_ID, Protocol, Unit};
use crate::wire::direct::Direct;
use crate::wire::error::JobError;
use crate::wire::frame;
use crate::wire::frames;
use crate::wire::job::{Buffer, Fill, Job, Step};

/// What a proof has looked at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Proof {
    /// Buffers sent.
    pub buffers: u64,
    /// Bytes that the host sends if nothing fails.
    pub bytes: u64,
    /// Pairs of bytes, each held against every node that reads pairs when it passes; in frames against
    /// what the node of that place is to make.
    pub pairs: u64,
    /// Pairs of data that begin with the ID of a node, and are harmless since that one is full by
    /// then.
    pub avoided: u64,
    /// Nodes on the bus.
    pub nodes: usize,
}

/// Proves a job.
///
/// # Errors
/// Names the tick and the axis whose data a node would take for a command.
pub fn lint(job: &Job, machine: &Machine) -> Result<Proof, JobError> {
    if machine.bus.protocol == Protocol::Frame {
        return frames::lint(job, machine);
    }
    let listener = |unit| Listener { unit, is_full: false };
    let nodes: Vec<Listener> = machine.bus.units().map(listener).collect();
    let proof = Proof { nodes: nodes.len(), ..Proof::default() };
    let mut bus = Bus { nodes, proof, tick: 0, lines: &[] };
    for step in &job.steps {
        if !matches!(step, Step::Event(_)) && bus.proof.bytes == 0 {
            bus.pings(&job.nodes)?;
        }
        match step {
            Step::Event(_) => {}
            Step::Direct(direct) => bus.direct(direct)?,
            Step::Buffer(buffer) => {
                bus.lines = &buffer.lines;
                bus.buffer(buffer)?;
                bus.proof.buffers += 1;
                bus.tick += buffer.lines.len() as u64;
            }
        }
    }
    Ok(bus.proof)
}

/// A node as the proof sees it: idle, and in phase, since every frame is even.
struct Listener {
    unit: Unit,
    is_full: bool,
}

impl Listener {
    /// Whether an idle node takes a pair for a command.
    fn obeys(&self, [first, second]: [u8; 2]) -> bool {
        let id = self.unit.id;
        let fill = first == id && !self.is_full;
        let start = first == HOST_ID && self.is_full;
        let moves = matches!(first, b'h' | b'j') && second == id;
        fill || start || moves
    }
}

struct Bus<'a> {
    nodes: Vec<Listener>,
    proof: Proof,
    /// First tick of the buffer, and the lines of its ticks.
    tick: u64,
    lines: &'a [u32],
}

impl<'a> Bus<'a> {
    fn buffer(&mut self, buffer: &'a Buffer) -> Result<(), JobError> {
        let number = buffer.number;
        let masters = buffer.fills.iter().filter(|fill| fill.master).count();
        if masters != 1 {
            return Err(JobError::Masters { buffer: number, masters });
        }
        let units: Vec<Unit> = buffer.fills.iter().map(|fill| fill.unit).collect();
        for Fill { unit, master, bytes } in &buffer.fills {
            self.pings(&[*unit])?;
            let Some(at) = self.nodes.iter().position(|node| node.unit == *unit && !node.is_full)
            else {
                return Err(JobError::NotEmpty { buffer: number, unit: *unit });
            };
            self.hear(&frame::fill(unit.id, *master), &[*unit])?;
            self.hear(bytes, &[*unit])?;
            self.nodes[at].is_full = true;
        }
        self.pings(&units)?;
        self.hear(&frame::START, &units)?;
        let entries = buffer.fills.first().map_or(0, |fill| fill.bytes.len());
        self.hear(&vec![frame::SYNC; entries], &units)?;
        self.nodes.iter_mut().for_each(|node| node.is_full = false);
        self.pings(&units)
    }

    fn direct(&mut self, direct: &Direct) -> Result<(), JobError> {
        let unit = direct.unit();
        self.pings(&[unit])?;
        match direct {
            Direct::Home(_) => {
                self.hear(&frame::home(unit.id), &[unit])?;
                self.hear(&frame::home(unit.id), &[unit])?;
            }
            Direct::Jog(jog) => {
                frame::jog(unit.id, jog.byte())
                    .iter()
                    .try_for_each(|pair| self.hear(pair, &[unit]))?;
            }
        }
        self.pings(&[unit])
    }

    fn pings(&mut self, units: &[Unit]) -> Result<(), JobError> {
        let frames = |unit: &Unit| frame::ping(unit.id).map(|pair| (*unit, pair));
        units.iter().flat_map(frames).try_for_each(|(unit, pair)| self.hear(&pair, &[unit]))
    }

    /// Bytes that are meant for some nodes: all others read them as pairs.
    fn hear(&mut self, bytes: &[u8], meant: &[Unit]) -> Result<(), JobError> {
        self.proof.bytes += bytes.len() as u64;
        self.proof.pairs += bytes.len() as u64 / 2;
        // The least first byte of a command is 'h'.
        let commands = bytes.chunks_exact(2).enumerate().filter(|(_, pair)| pair[0] >= b'h');
        for (at, pair) in commands {
            for node in self.nodes.iter().filter(|node| !meant.contains(&node.unit)) {
                if node.obeys([pair[0], pair[1]]) {
                    let line = self.lines.get(2 * at).copied().unwrap_or(0);
                    let (of, to, tick) = (meant[0], node.unit, self.tick + 2 * at as u64);
                    return Err(JobError::Command { of, to, tick, line });
                }
                self.proof.avoided += u64::from(pair[0] == node.unit.id);
            }
        }
        Ok(())
    }
}
