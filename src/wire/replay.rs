//! What a host sent and received, with times → what nodes do with it, and the first answer that differs.
//!
//! Virtual nodes hear the host's bytes at their times. What struck on the wire, or nodes that failed, is not in a
//! trace of the host: where the answers are the same the replay shows what the nodes did, as far as
//! answers tell it; behind the first difference what they would have done.

use std::collections::VecDeque;

use crate::base::AxisMap;
use crate::base::machine::{Protocol, Unit};
use crate::wire::firmware::Firmware;
use crate::wire::job::{Buffer, Job};
use crate::wire::node::Activity;
use crate::wire::nodes::{Entry, Nodes};

/// An answer and when it reached the host.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Answer {
    /// When, in microseconds of the bus's time.
    pub at_us: u64,
    /// Bytes that the host had sent by then.
    pub after: u64,
    /// The byte.
    pub byte: u8,
}

/// The first answer that is not the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Number of the answer, from 0.
    pub number: u64,
    /// What the host received; nothing if it received no more.
    pub recorded: Option<Answer>,
    /// What the virtual nodes answered; nothing if they answered no more.
    pub replayed: Option<Answer>,
}

/// A replay under way.
#[derive(Debug)]
pub struct Replay {
    nodes: Nodes,
    recorded: VecDeque<Answer>,
    replayed: VecDeque<Answer>,
    /// Bytes of the host so far.
    sent: u64,
    /// Answers that were the same.
    same: u64,
    difference: Option<Difference>,
    hazards: Vec<Entry>,
    /// The last time that was told.
    now_us: u64,
    /// The host did not wait for time to pass.
    is_unpaced: bool,
}

impl Replay {
    /// A replay to nodes that have just been switched on. For a host that `is_unpaced` (`--speed max`) the
    /// nodes are always done with what came before, as those were that it talked to.
    pub fn new(nodes: Nodes, is_unpaced: bool) -> Self {
        Replay {
            nodes,
            is_unpaced,
            recorded: VecDeque::new(),
            replayed: VecDeque::new(),
            sent: 0,
            same: 0,
            difference: None,
            hazards: Vec::new(),
            now_us: 0,
        }
    }

    /// The host sent bytes. Times must not go back.
    pub fn sent(&mut self, at_us: u64, bytes: &[u8]) {
        self.now_us = at_us;
        self.sent += bytes.len() as u64;
        let at_us = match self.is_unpaced {
            true => self.settle().max(at_us),
            false => at_us,
        };
        self.nodes.handle_bytes(at_us, bytes);
        self.collect(at_us);
    }

    /// Lets all happen that is still to come, and gives the time when the nodes are done.
    fn settle(&mut self) -> u64 {
        while let Some(next_us) = self.nodes.poll_timeout() {
            self.nodes.advance(next_us);
            self.collect(next_us);
        }
        self.nodes.ready_us()
    }

    /// The host received bytes.
    pub fn received(&mut self, at_us: u64, bytes: &[u8]) {
        self.now_us = at_us;
        let after = self.sent;
        self.recorded.extend(bytes.iter().map(|byte| Answer { at_us, after, byte: *byte }));
        self.compare();
    }

    /// All has been told. If that `is_whole`, the host was there until nothing more could come; otherwise
    /// answers behind the last time are none that it has missed.
    pub fn end(&mut self, is_whole: bool) {
        self.settle();
        let last_us = if is_whole { u64::MAX } else { self.now_us };
        let missed = self.replayed.front().copied().filter(|answer| answer.at_us <= last_us);
        let left = (self.recorded.front().copied(), missed);
        if left != (None, None) {
            let (recorded, replayed) = left;
            let difference = Difference { number: self.same, recorded, replayed };
            self.difference.get_or_insert(difference);
        }
    }

    /// The first answer that is not the same.
    pub fn difference(&self) -> Option<Difference> {
        self.difference
    }

    /// How many answers were the same.
    pub fn same(&self) -> u64 {
        self.same
    }

    /// What must not have happened on a node.
    pub fn hazards(&self) -> &[Entry] {
        &self.hazards
    }

    /// The nodes.
    pub fn nodes(&self) -> &Nodes {
        &self.nodes
    }

    fn collect(&mut self, now_us: u64) {
        while let Some((at_us, after, byte)) = self.nodes.poll_heard_answer(now_us) {
            self.replayed.push_back(Answer { at_us, after, byte });
        }
        while let Some(entry) = self.nodes.poll_log() {
            self.hazards.extend(entry.hazard.is_some().then_some(entry));
        }
        self.compare();
    }

    /// By what they came upon, and not by their times: those of virtual nodes and of real ones, and what a
    /// system takes to hand bytes over, are never the same.
    fn compare(&mut self) {
        if self.difference.is_some() {
            self.recorded.clear();
            self.replayed.clear();
        }
        while let (Some(recorded), Some(replayed)) = (self.recorded.front(), self.replayed.front())
        {
            let (recorded, replayed) = (*recorded, *replayed);
            if (recorded.after, recorded.byte) != (replayed.after, replayed.byte) {
                let (recorded, replayed) = (Some(recorded), Some(replayed));
                self.difference = Some(Difference { number: self.same, recorded, replayed });
                return self.compare();
            }
            self.same += 1;
            self.recorded.pop_front();
            self.replayed.pop_front();
        }
    }
}

/// How far a node has got.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reached {
    /// The node.
    pub unit: Unit,
    /// Where its axis stands, in motor steps.
    pub steps: i64,
    /// What it is doing.
    pub activity: Activity,
    /// It holds a buffer that has not been executed to its end.
    pub full: bool,
    /// Buffers that it has begun to execute.
    pub buffers: usize,
    /// Entries of the last of them that it has executed, pads counted.
    pub ticks: usize,
    /// What the job says of that.
    pub planned: Option<Planned>,
}

/// A node's last buffer in the job.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Planned {
    /// Number of the buffer.
    pub buffer: u32,
    /// Its ticks of motion.
    pub motion_ticks: usize,
    /// NC line of the last tick executed; of the first before it.
    pub line: u32,
    /// All that the node has executed is a beginning of what it was to execute.
    pub as_planned: bool,
}

/// How far each node has got, in the job if it is known.
pub fn reached(nodes: &Nodes, job: Option<&Job>) -> Vec<Reached> {
    let reached = |(unit, node): (Unit, &Firmware)| Reached {
        unit,
        steps: node.position_steps(),
        activity: node.activity(),
        full: node.is_full(),
        buffers: node.runs().len(),
        ticks: node.runs().last().map_or(0, |run| run.counts.len()),
        planned: job.and_then(|job| planned(unit, node, job)),
    };
    nodes.iter().map(reached).collect()
}

fn planned(unit: Unit, node: &Firmware, job: &Job) -> Option<Planned> {
    // Frames go to all nodes, moving or not.
    let hears = |buffer: &Buffer| {
        buffer.protocol == Protocol::Frame || buffer.fills.iter().any(|fill| fill.unit == unit)
    };
    let mut buffers = job.buffers().filter(|buffer| hears(buffer));
    let mut last = None;
    let mut as_planned = true;
    for run in node.runs() {
        let Some(buffer) = buffers.next() else {
            as_planned = false;
            break;
        };
        let mut executed = (0..).zip(&run.counts);
        as_planned &= run.counts.len() <= buffer.entries()
            && executed.all(|(tick, count)| {
                let fill = buffer.fills.iter().find(|fill| fill.unit == unit);
                fill.map_or(0, |fill| buffer.count(fill, tick)) == *count
            });
        last = Some((buffer, run.counts.len()));
    }
    let (buffer, ticks) = last?;
    let line = buffer.lines.get(ticks.saturating_sub(1)).or(buffer.lines.last());
    Some(Planned {
        buffer: buffer.number,
        motion_ticks: buffer.lines.len(),
        line: line.copied().unwrap_or(0),
        as_planned,
    })
}

/// The axes that took part in the last start have all executed as many entries.
pub fn in_step(nodes: &Nodes) -> bool {
    let mut ticks: AxisMap<Option<usize>> = AxisMap::default();
    let last_us = nodes.iter().filter_map(|(_, node)| Some(node.runs().last()?.start_us)).max();
    for (unit, node) in nodes.iter() {
        let (Some(axis), Some(run), Some(last_us)) = (unit.axis, node.runs().last(), last_us)
        else {
            continue;
        };
        if Nodes::same_start(run.start_us, last_us) {
            ticks[axis] = Some(run.counts.len());
        }
    }
    let mut found = ticks.0.iter().flatten();
    let first = found.next();
    found.all(|ticks| Some(ticks) == first)
}
