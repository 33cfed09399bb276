//! Job → proof that every node obeys what is meant for it and nothing else (H1 to H5, H9).
//!
//! Plays the whole job, byte for byte in the order of sending, to a copy of every node on the bus,
//! each byte so late that timing plays no part. Rule: only the node addressed may begin anything,
//! and every node ends each buffer idle, empty and in phase, having executed its own bytes.

use crate::base::{Axis, Machine};
use crate::wire::error::JobError;
use crate::wire::frame;
use crate::wire::job::{Buffer, Fill, Job};
use crate::wire::node::{Activity, Happening, Node};

/// Longer than anything a node does with a byte of a job.
const APART_US: u64 = 1_000_000;

/// Proves a job.
///
/// # Errors
/// Names the tick and the axis whose data a node would take for a command.
pub fn lint(job: &Job, machine: &Machine) -> Result<(), JobError> {
    let bus = &machine.bus;
    let node = |(axis, id): (&Axis, &u8)| {
        (*axis, Node::new(*id, bus.buffer_ticks, bus.node_tick_us.min(10_000), 0))
    };
    let mut proof =
        Proof { nodes: bus.nodes.iter().map(node).collect(), now_us: 0, tick: 0, homed: None };
    for buffer in job.buffers() {
        proof.buffer(buffer)?;
        proof.tick += buffer.lines.len() as u64;
    }
    Ok(())
}

struct Proof {
    nodes: Vec<(Axis, Node)>,
    now_us: u64,
    tick: u64,
    /// A node that data sent to its limit switch.
    homed: Option<(Axis, u8)>,
}

impl Proof {
    fn buffer(&mut self, buffer: &Buffer) -> Result<(), JobError> {
        let at = |entry| Place { buffer, tick: self.tick + entry as u64, entry };
        let start = at(0);
        for fill in &buffer.fills {
            for byte in frame::ping(fill.id).into_iter().flatten() {
                self.byte(byte);
            }
            self.all_idle(&start, fill)?;
            frame::fill(fill.id, fill.master).into_iter().for_each(|byte| self.byte(byte));
            for (entry, byte) in fill.bytes.iter().enumerate() {
                self.only_filling(fill, &Place { entry, tick: self.tick + entry as u64, buffer })?;
                self.byte(*byte);
            }
            self.all_idle(&start, fill)?;
        }
        frame::START.into_iter().for_each(|byte| self.byte(byte));
        for _ in 0..buffer.fills.first().map_or(0, |fill| fill.bytes.len()) {
            self.byte(frame::SYNC);
        }
        for fill in &buffer.fills {
            let own = self.nodes.iter().find(|(_, node)| node.id() == fill.id);
            let executed = own.and_then(|(_, node)| node.runs().last());
            if executed.is_none_or(|run| run.bytes != fill.bytes) {
                return Err(start.error(fill, fill.axis, fill.id));
            }
        }
        buffer.fills.first().map_or(Ok(()), |fill| self.all_idle(&start, fill))
    }

    fn byte(&mut self, byte: u8) {
        self.now_us += APART_US;
        for (axis, node) in &mut self.nodes {
            node.handle_byte(self.now_us, byte);
            while node.poll_answer().is_some() {}
            while let Some((_, happening)) = node.poll_happening() {
                if let Happening::Homes { .. } = happening {
                    self.homed = Some((*axis, node.id()));
                }
            }
        }
    }

    /// While a node is filled, all others read pairs and drop them.
    fn only_filling(&self, fill: &Fill, place: &Place) -> Result<(), JobError> {
        let expected = |id| if id == fill.id { Activity::Filling } else { Activity::Idle };
        let wrong = self.nodes.iter().find(|(_, node)| node.activity() != expected(node.id()));
        let wrong = wrong.map(|(axis, node)| (*axis, node.id())).or(self.homed);
        wrong.map_or(Ok(()), |(axis, id)| Err(place.back(2).error(fill, axis, id)))
    }

    /// Between frames every node waits for the first byte of a pair.
    fn all_idle(&self, place: &Place, fill: &Fill) -> Result<(), JobError> {
        let wrong = |node: &Node| node.activity() != Activity::Idle || !node.is_in_phase();
        let wrong = self.nodes.iter().find(|(_, node)| wrong(node));
        let wrong = wrong.map(|(axis, node)| (*axis, node.id())).or(self.homed);
        wrong.map_or(Ok(()), |(axis, id)| Err(place.error(fill, axis, id)))
    }
}

struct Place<'a> {
    buffer: &'a Buffer,
    tick: u64,
    entry: usize,
}

impl Place<'_> {
    /// The pair that did it began so many entries ago.
    fn back(&self, entries: usize) -> Self {
        let back = entries.min(self.entry);
        Place { buffer: self.buffer, tick: self.tick - back as u64, entry: self.entry - back }
    }

    fn error(&self, fill: &Fill, other: Axis, id: u8) -> JobError {
        let line = self.buffer.lines.get(self.entry).copied().unwrap_or(0);
        JobError::Command { axis: fill.axis, other, id, tick: self.tick, line }
    }
}
