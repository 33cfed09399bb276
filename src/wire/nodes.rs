//! Bytes of the host in, bytes for the host out: all nodes of a bus, and the wire between.
//!
//! Both directions take 10 bits a byte; what comes in one burst arrives byte after byte. Every
//! node hears every byte. Tells which happenings are hazards: what no correct host brings about.

use std::collections::VecDeque;

use crate::base::{Axis, AxisMap, Machine};
use crate::wire::codec;
use crate::wire::node::{Activity, Happening, Node, Run};

/// Runs that start within this time of each other were started by the same pair: a node can be
/// in its pause after an answer.
const SAME_START_US: u64 = 1000;

/// Something that happened on a node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// When, in microseconds of the bus's time.
    pub at_us: u64,
    /// The node's axis.
    pub axis: Axis,
    /// What.
    pub happening: Happening,
    /// Why it must not have happened, if so.
    pub hazard: Option<&'static str>,
}

/// Counts that the nodes executed in one tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct ExecutedTick {
    /// Start pair that it belongs to, from 0.
    pub buffer: u32,
    /// Signed steps; 0 on axes whose nodes took no part.
    pub counts: AxisMap<i32>,
}

/// The nodes of a bus.
#[derive(Clone, Debug)]
pub struct Nodes {
    nodes: Vec<(Axis, Node)>,
    byte_ns: u64,
    sync_wait_us_max: u64,
    wire_free_ns: u64,
    on_wire: VecDeque<(u64, u8)>,
    answers: VecDeque<(u64, u8)>,
    log: VecDeque<Entry>,
}

impl Nodes {
    /// Nodes by axis and ID, just switched on, their axes at `start_steps`. A sync byte that waits
    /// up to `sync_wait_us_max` for its node is no hazard: 250 µs are the pause after the answer, the
    /// rest is what the clock that makes `now_us` may jump.
    pub fn new(
        machine: &Machine,
        units: impl IntoIterator<Item = (Axis, u8)>,
        start_steps: &AxisMap<i64>,
        sync_wait_us_max: u64,
    ) -> Self {
        let bus = &machine.bus;
        let node = |(axis, id)| {
            (axis, Node::new(id, bus.buffer_ticks, bus.node_tick_us, start_steps[axis]))
        };
        Nodes {
            nodes: units.into_iter().map(node).collect(),
            byte_ns: byte_ns(bus.baud),
            sync_wait_us_max,
            wire_free_ns: 0,
            on_wire: VecDeque::new(),
            answers: VecDeque::new(),
            log: VecDeque::new(),
        }
    }

    /// Takes bytes that the host puts on the wire at `now_us`, or as soon as it is free.
    pub fn handle_bytes(&mut self, now_us: u64, bytes: &[u8]) {
        self.advance(now_us);
        for byte in bytes {
            self.wire_free_ns = self.wire_free_ns.max(now_us * 1000) + self.byte_ns;
            self.on_wire.push_back((self.wire_free_ns.div_ceil(1000), *byte));
        }
    }

    /// Lets all happen that happens up to `now_us`.
    pub fn advance(&mut self, now_us: u64) {
        while let Some(&(arrival_us, byte)) = self.on_wire.front() {
            if arrival_us > now_us {
                break;
            }
            self.on_wire.pop_front();
            for at in 0..self.nodes.len() {
                self.nodes[at].1.handle_byte(arrival_us, byte);
                self.collect(at);
            }
        }
        for at in 0..self.nodes.len() {
            self.nodes[at].1.advance(now_us);
            self.collect(at);
        }
    }

    /// The next byte that has reached the host by `now_us`.
    pub fn poll_answer(&mut self, now_us: u64) -> Option<u8> {
        let (arrival_us, byte) = *self.answers.front()?;
        (arrival_us <= now_us).then(|| {
            self.answers.pop_front();
            byte
        })
    }

    /// When [`Nodes::advance`] or [`Nodes::poll_answer`] has something to do next.
    pub fn poll_timeout(&self) -> Option<u64> {
        let wire = self.on_wire.front().map(|(at_us, _)| *at_us);
        let answer = self.answers.front().map(|(at_us, _)| *at_us);
        let nodes = self.nodes.iter().filter_map(|(_, node)| node.next_us());
        nodes.chain(wire).chain(answer).min()
    }

    /// When all nodes are done with what has reached them so far.
    pub fn ready_us(&self) -> u64 {
        self.nodes.iter().map(|(_, node)| node.ready_us()).max().unwrap_or(0)
    }

    /// The next entry of the log.
    pub fn poll_log(&mut self) -> Option<Entry> {
        self.log.pop_front()
    }

    /// The nodes and their axes.
    pub fn iter(&self) -> impl Iterator<Item = (Axis, &Node)> {
        self.nodes.iter().map(|(axis, node)| (*axis, node))
    }

    /// What has been executed, tick by tick: all entries of each buffer, pads included.
    pub fn executed(&self) -> Vec<ExecutedTick> {
        let mut runs: Vec<(Axis, &Run)> = Vec::new();
        for (axis, node) in self.iter() {
            runs.extend(node.runs().iter().map(|run| (axis, run)));
        }
        runs.sort_by_key(|(_, run)| run.start_us);
        let mut ticks = Vec::new();
        let groups = runs.chunk_by(|(_, a), (_, b)| b.start_us - a.start_us < SAME_START_US);
        for (buffer, group) in (0..).zip(groups) {
            let executed = group.iter().map(|(_, run)| run.bytes.len()).max().unwrap_or(0);
            for tick in 0..executed {
                let mut counts = AxisMap::default();
                for (axis, run) in group {
                    counts[*axis] = run.bytes.get(tick).map_or(0, |byte| codec::decode(*byte));
                }
                ticks.push(ExecutedTick { buffer, counts });
            }
        }
        ticks
    }

    /// Takes over what a node said and did.
    fn collect(&mut self, at: usize) {
        let (axis, node) = &mut self.nodes[at];
        let axis = *axis;
        while let Some((start_us, byte)) = node.poll_answer() {
            let arrival_us = start_us + self.byte_ns.div_ceil(1000);
            let place = self.answers.partition_point(|(at_us, _)| *at_us <= arrival_us);
            self.answers.insert(place, (arrival_us, byte));
        }
        while let Some((at_us, happening)) = self.nodes[at].1.poll_happening() {
            let hazard = self.hazard(at, happening);
            self.log.push_back(Entry { at_us, axis, happening, hazard });
        }
    }

    fn hazard(&self, at: usize, happening: Happening) -> Option<&'static str> {
        let others = || self.nodes.iter().enumerate().filter(|(i, _)| *i != at);
        let other_is = |what| others().any(|(_, (_, node))| node.activity() == what);
        match happening {
            Happening::FillBegins { .. } if other_is(Activity::Filling) => {
                Some("took another node's data for a fill command")
            }
            Happening::FillBegins { .. } if other_is(Activity::Executing) => {
                Some("is filled while another node executes")
            }
            Happening::Starts if other_is(Activity::Filling) => {
                Some("took another node's data for a start")
            }
            Happening::Homes { .. } | Happening::Jogs { .. }
                if other_is(Activity::Filling) || other_is(Activity::Executing) =>
            {
                Some("took another node's data for a command to move")
            }
            Happening::SyncWaited { waited_us, .. } if waited_us > self.sync_wait_us_max => {
                Some("was still stepping when the next tick came: the axes drift apart")
            }
            Happening::Overrun => Some("is deaf until it is switched off"),
            _ => None,
        }
    }
}

/// What 10 bits take on the wire.
pub(crate) fn byte_ns(baud: u32) -> u64 {
    10_000_000_000 / u64::from(baud.max(1))
}
