//! Bytes of the host in, bytes for the host out: all nodes of a bus, the wire between, and faults.
//!
//! Both directions take 10 bits a byte; what comes in one burst arrives byte after byte. Every
//! node hears every byte. Tells which happenings are hazards: what no correct host brings about.

use std::collections::VecDeque;

use crate::base::machine::Unit;
use crate::base::{Axis, AxisMap, Machine};
use crate::wire::firmware::Firmware;
use crate::wire::inject::{FaultKind, FaultSpec, Faults, Struck};
use crate::wire::node::{Activity, Happening, Run};

/// Runs that start within this time of each other were started by the same pair: a node can be
/// in its pause after an answer.
const SAME_START_US: u64 = 1000;

/// Something that happened on a node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// When, in microseconds of the bus's time.
    pub at_us: u64,
    /// The node.
    pub unit: Unit,
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
    nodes: Vec<(Unit, Firmware)>,
    byte_ns: u64,
    sync_wait_us_max: u64,
    wire_free_ns: u64,
    on_wire: VecDeque<OnWire>,
    /// Bytes of the host that have reached the nodes.
    heard: u64,
    /// What each node did before it heard the last byte.
    before: Vec<Activity>,
    answers: VecDeque<Answer>,
    log: VecDeque<Entry>,
    faults: Faults,
    is_closed: bool,
}

/// A byte of the host on its way.
#[derive(Clone, Debug)]
struct OnWire {
    arrival_us: u64,
    byte: u8,
    faults: Vec<FaultSpec>,
}

/// A byte of a node on its way.
#[derive(Clone, Copy, Debug)]
struct Answer {
    arrival_us: u64,
    byte: u8,
    /// The node, by its place.
    of: usize,
    /// Bytes of the host that had reached the nodes when it began.
    heard: u64,
}

impl Nodes {
    /// Nodes just switched on, their axes at `start_steps`. A sync byte that waits
    /// up to `sync_wait_us_max` for its node is no hazard: 250 µs are the pause after the answer, the
    /// rest is what the clock that makes `now_us` may jump.
    pub fn new(
        machine: &Machine,
        units: impl IntoIterator<Item = Unit>,
        start_steps: &AxisMap<i64>,
        sync_wait_us_max: u64,
    ) -> Self {
        let bus = &machine.bus;
        let node = |unit: Unit| {
            let start_steps = unit.axis.map_or(0, |axis| start_steps[axis]);
            (unit, Firmware::new(unit, machine, start_steps))
        };
        Nodes {
            nodes: units.into_iter().map(node).collect(),
            byte_ns: byte_ns(bus.baud),
            sync_wait_us_max,
            wire_free_ns: 0,
            on_wire: VecDeque::new(),
            heard: 0,
            before: Vec::new(),
            answers: VecDeque::new(),
            log: VecDeque::new(),
            faults: Faults::of_bus(Vec::new(), bus),
            is_closed: false,
        }
    }

    /// The same, with these faults to come.
    pub fn with_faults(self, faults: Faults) -> Self {
        Nodes { faults, ..self }
    }

    /// The next fault that has struck.
    pub fn poll_struck(&mut self) -> Option<Struck> {
        self.faults.poll_struck()
    }

    /// Whether a fault has closed the port.
    pub fn is_closed(&self) -> bool {
        self.is_closed
    }

    /// Takes bytes that the host puts on the wire at `now_us`, or as soon as it is free.
    pub fn handle_bytes(&mut self, now_us: u64, bytes: &[u8]) {
        self.advance(now_us);
        for byte in bytes {
            let arrival_ns = self.wire_free_ns.max(now_us * 1000) + self.byte_ns;
            let faults = self.faults.byte(arrival_ns.div_ceil(1000), *byte);
            self.is_closed |= faults.iter().any(|fault| fault.kind == FaultKind::Close);
            if self.is_closed {
                return;
            }
            let late_us: u64 = faults.iter().map(late_us).sum();
            self.wire_free_ns = arrival_ns + late_us * 1000;
            let arrival_us = self.wire_free_ns.div_ceil(1000);
            self.on_wire.push_back(OnWire { arrival_us, byte: *byte, faults });
        }
    }

    /// Lets all happen that happens up to `now_us`.
    pub fn advance(&mut self, now_us: u64) {
        while self.on_wire.front().is_some_and(|next| next.arrival_us <= now_us) {
            let Some(next) = self.on_wire.pop_front() else { break };
            self.heard += 1;
            self.before.clear();
            self.before.extend(self.nodes.iter().map(|(_, node)| node.activity()));
            for at in 0..self.nodes.len() {
                self.hear(at, &next);
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
        self.poll_heard_answer(now_us).map(|(_, _, byte)| byte)
    }

    /// The same, with when it reached the host, and how many of the host's bytes it came upon.
    pub fn poll_heard_answer(&mut self, now_us: u64) -> Option<(u64, u64, u8)> {
        let answer = *self.answers.front().filter(|answer| answer.arrival_us <= now_us)?;
        self.answers.pop_front();
        Some((answer.arrival_us, answer.heard, answer.byte))
    }

    /// When [`Nodes::advance`] or [`Nodes::poll_answer`] has something to do next.
    pub fn poll_timeout(&self) -> Option<u64> {
        let wire = self.on_wire.front().map(|next| next.arrival_us);
        let answer = self.answers.front().map(|answer| answer.arrival_us);
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

    /// The nodes.
    pub fn iter(&self) -> impl Iterator<Item = (Unit, &Firmware)> {
        self.nodes.iter().map(|(unit, node)| (*unit, node))
    }

    /// What has been executed, tick by tick: all entries of each buffer, pads included.
    pub fn executed(&self) -> Vec<ExecutedTick> {
        let mut runs: Vec<(Axis, &Run)> = Vec::new();
        for (unit, node) in self.iter() {
            runs.extend(
                unit.axis
                    .into_iter()
                    .flat_map(|axis| node.runs().iter().map(move |run| (axis, run))),
            );
        }
        runs.sort_by_key(|(_, run)| run.start_us);
        let mut ticks = Vec::new();
        let groups = runs.chunk_by(|(_, a), (_, b)| Nodes::same_start(a.start_us, b.start_us));
        for (buffer, group) in (0..).zip(groups) {
            let executed = group.iter().map(|(_, run)| run.counts.len()).max().unwrap_or(0);
            for tick in 0..executed {
                let mut counts = AxisMap::default();
                for (axis, run) in group {
                    counts[*axis] = run.counts.get(tick).copied().unwrap_or(0);
                }
                ticks.push(ExecutedTick { buffer, counts });
            }
        }
        ticks
    }

    /// Whether runs that start at these times were started by the same pair.
    pub fn same_start(a_us: u64, b_us: u64) -> bool {
        a_us.abs_diff(b_us) < SAME_START_US
    }

    /// One node hears a byte, or what faults make of it.
    fn hear(&mut self, at: usize, next: &OnWire) {
        let (unit, node) = &mut self.nodes[at];
        let (now_us, mut byte) = (next.arrival_us, Some(next.byte));
        for fault in next.faults.iter().filter(|fault| fault.who.is_none_or(|who| who.is(*unit))) {
            match fault.kind {
                FaultKind::Drop => byte = None,
                FaultKind::Change(mask) => byte = byte.map(|byte| byte ^ mask),
                FaultKind::Add(extra) => node.handle_byte(now_us, extra),
                FaultKind::Dead => node.die(),
                FaultKind::Stall(us) => node.stall(now_us, us),
                FaultKind::Reset => node.reset(now_us),
                FaultKind::Overrun => node.overrun(now_us),
                _ => {}
            }
        }
        if let Some(byte) = byte {
            node.handle_byte(now_us, byte);
        }
    }

    /// Takes over what a node said and did.
    fn collect(&mut self, at: usize) {
        while let Some((start_us, byte)) = self.nodes[at].1.poll_answer() {
            let faults = self.faults.answer(start_us);
            let late_us: u64 = faults.iter().map(late_us).sum();
            let arrival_us = start_us + late_us + self.byte_us();
            let mut answer = Answer { arrival_us, byte, of: at, heard: self.heard };
            let mut copies = 1;
            for fault in faults {
                match fault.kind {
                    FaultKind::LoseAnswer => copies = 0,
                    FaultKind::DoubleAnswer => copies = 2,
                    FaultKind::ChangeAnswer(mask) => answer.byte ^= mask,
                    FaultKind::Collide => {
                        let of = |unit: &Unit| fault.who.is_some_and(|who| who.is(*unit));
                        let other = self.nodes.iter().find(|(unit, _)| of(unit));
                        answer.byte &= other.map_or(0xff, |(unit, _)| unit.id);
                    }
                    _ => {}
                }
            }
            for _ in 0..copies {
                self.say(answer);
                answer.arrival_us += self.byte_us();
            }
        }
        let unit = self.nodes[at].0;
        while let Some((at_us, happening)) = self.nodes[at].1.poll_happening() {
            let hazard = self.hazard(at, happening);
            self.log.push_back(Entry { at_us, unit, happening, hazard });
        }
    }

    /// An answer goes out. Where two nodes speak at once, a bit is 1 if both send 1.
    fn say(&mut self, answer: Answer) {
        let byte_us = self.byte_us();
        let overlaps = |other: &&mut Answer| {
            other.of != answer.of && other.arrival_us.abs_diff(answer.arrival_us) < byte_us
        };
        if let Some(other) = self.answers.iter_mut().find(overlaps) {
            other.byte &= answer.byte;
            return;
        }
        let before = |other: &Answer| other.arrival_us <= answer.arrival_us;
        let place = self.answers.partition_point(before);
        self.answers.insert(place, answer);
    }

    fn byte_us(&self) -> u64 {
        self.byte_ns.div_ceil(1000)
    }

    fn hazard(&self, at: usize, happening: Happening) -> Option<&'static str> {
        // The byte that is the last of one node's data may complete a pair of another.
        let is = |i: usize, what| {
            self.before.get(i) == Some(&what) || self.nodes[i].1.activity() == what
        };
        let other_is = |what| (0..self.nodes.len()).any(|i| i != at && is(i, what));
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
            Happening::FrameMissed { .. } => Some("stands still until it is switched off"),
            Happening::RanDry { .. } => {
                Some("stopped without a ramp: its motor may have lost steps")
            }
            Happening::Overrun => Some("is deaf until it is switched off"),
            _ => None,
        }
    }
}

fn late_us(fault: &FaultSpec) -> u64 {
    match fault.kind {
        FaultKind::Late(us) | FaultKind::LateAnswer(us) => us,
        _ => 0,
    }
}

/// What 10 bits take on the wire.
pub(crate) fn byte_ns(baud: u32) -> u64 {
    10_000_000_000 / u64::from(baud.max(1))
}
