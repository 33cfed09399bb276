//! What a job takes, by block and by tool: cutting, rapids, pauses, and the nodes being filled.
//!
//! Moves take what the plan says, and the wait until a tick's boundary behind them is theirs, so
//! that all phases of all blocks together are the time of the job. Filling the nodes is counted
//! for the first block that moves in a buffer, the zeros at the buffer's end for the last. Events
//! take a time that nobody knows here; they are counted.

use std::collections::{BTreeMap, VecDeque};
use std::ops::AddAssign;

use super::summary::moved;
use crate::base::machine::Bus;
use crate::base::{AxisMap, Event, EventKind, Machine, Tick};
use crate::plan::{Moment, Planned, Profile};

/// What a part of a job takes, by what the machine does meanwhile.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Phases {
    /// Moves at a feed.
    pub cut_s: f64,
    /// Rapids.
    pub rapid_s: f64,
    /// Pauses that the program asks for.
    pub dwell_s: f64,
    /// Filling the nodes, and the zeros at the end of their buffers.
    pub refill_s: f64,
    /// Events other than pauses, which take a time unknown here.
    pub events: u64,
}

/// What a block takes: a line of the program, each time that it comes to be executed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockTime {
    /// Line of the NC program, from 1.
    pub line: u32,
    /// Tool that is in the spindle; none before the first change.
    pub tool: Option<u32>,
    /// What it takes.
    pub phases: Phases,
}

/// Sums up phases while a plan and its ticks pass by.
#[derive(Clone, Debug)]
pub struct Times {
    bus: Bus,
    tools: BTreeMap<Option<u32>, Phases>,
    tool: Option<u32>,
    now: Moment,
    /// The number of the buffer under way, its ticks, and the axes that move in it.
    buffer: u32,
    ticks: u64,
    moved: AxisMap<i32>,
    /// Blocks of the buffer under way.
    open: VecDeque<BlockTime>,
    /// Those of these that move in it.
    movers: Option<Movers>,
    ready: VecDeque<BlockTime>,
}

/// Which blocks move in a buffer.
#[derive(Clone, Copy, Debug)]
struct Movers {
    first: usize,
    last: usize,
    /// The last move is at a feed.
    is_cut: bool,
}

impl Phases {
    /// All that is known.
    pub fn total_s(&self) -> f64 {
        self.cut_s + self.rapid_s + self.dwell_s + self.refill_s
    }
}

impl AddAssign for Phases {
    fn add_assign(&mut self, other: Phases) {
        self.cut_s += other.cut_s;
        self.rapid_s += other.rapid_s;
        self.dwell_s += other.dwell_s;
        self.refill_s += other.refill_s;
        self.events += other.events;
    }
}

impl Times {
    /// Of a job that begins.
    pub fn new(machine: &Machine) -> Times {
        Times {
            bus: machine.bus.clone(),
            tools: BTreeMap::new(),
            tool: None,
            now: Moment::default(),
            buffer: 0,
            ticks: 0,
            moved: AxisMap::default(),
            open: VecDeque::new(),
            movers: None,
            ready: VecDeque::new(),
        }
    }

    /// An item of the plan passes by.
    pub fn planned(&mut self, planned: &Planned) {
        match planned {
            Planned::Profile(profile) => self.profile(profile),
            Planned::Event(event) => self.event(event),
            Planned::Seam(_) => self.wait(Moment::at(self.now.boundary())),
        }
    }

    /// A tick passes by, after the part of the plan that it was made from.
    pub fn tick(&mut self, tick: &Tick) {
        self.ticks += 1;
        for (moved, count) in self.moved.0.iter_mut().zip(tick.counts.0) {
            *moved |= count;
        }
    }

    /// No item follows.
    pub fn finish(&mut self) {
        self.wait(Moment::at(self.now.boundary()));
        self.end_buffer();
        self.give_out(0);
    }

    /// Gives the next block whose times are known.
    pub fn pop(&mut self) -> Option<BlockTime> {
        self.ready.pop_front()
    }

    /// What each tool took of the blocks given out; none: before the first is changed in.
    pub fn tools(&self) -> impl Iterator<Item = (Option<u32>, &Phases)> {
        self.tools.iter().map(|(tool, phases)| (*tool, phases))
    }

    /// What all tools took.
    pub fn total(&self) -> Phases {
        let mut total = Phases::default();
        self.tools.values().for_each(|phases| total += *phases);
        total
    }

    fn profile(&mut self, profile: &Profile) {
        self.wait(profile.start);
        if profile.buffer != self.buffer {
            self.end_buffer();
            self.buffer = profile.buffer;
        }
        let is_cut = profile.segment.feed_mm_s.is_some();
        self.block(profile.segment.line);
        let last = self.open.len() - 1;
        let first = self.movers.map_or(last, |movers| movers.first);
        self.movers = Some(Movers { first, last, is_cut });
        self.wait(profile.end);
        if self.bus.motion_ticks_max().is_none() {
            self.give_out(1);
        }
    }

    fn event(&mut self, event: &Event) {
        self.wait(Moment::at(self.now.boundary()));
        match event.kind {
            EventKind::M { code: 6, tool, .. } => self.tool = tool.or(self.tool),
            EventKind::Function { code: 61, words } => {
                let number = words.iter().find(|(letter, _)| *letter == b'Q');
                self.tool = number.map_or(self.tool, |(_, number)| Some(number as u32));
            }
            _ => {}
        }
        let phases = self.block(event.line);
        match event.kind {
            EventKind::Dwell(seconds) => phases.dwell_s += seconds,
            _ => phases.events += 1,
        }
    }

    /// Time passes for the block that moved last.
    fn wait(&mut self, until: Moment) {
        let time_s = self.now.ticks_to(until) * self.bus.tick_s();
        self.now = until;
        let Some(movers) = &self.movers else { return };
        let phases = &mut self.open[movers.last].phases;
        let phase_s = if movers.is_cut { &mut phases.cut_s } else { &mut phases.rapid_s };
        *phase_s += time_s;
    }

    /// The block under way, which is a new one on another line or with another tool.
    fn block(&mut self, line: u32) -> &mut Phases {
        let tool = self.tool;
        if self.open.back().is_none_or(|block| (block.line, block.tool) != (line, tool)) {
            self.open.push_back(BlockTime { line, tool, phases: Phases::default() });
        }
        let last = self.open.len() - 1;
        &mut self.open[last].phases
    }

    /// All ticks of the buffer under way have passed by; its last block may go on in the next.
    fn end_buffer(&mut self) {
        let time = self.bus.buffer_time(self.ticks as f64, moved(&self.moved));
        if let Some(Movers { first, last, .. }) = self.movers.take() {
            self.open[first].phases.refill_s += time.fill_s;
            self.open[last].phases.refill_s += time.pads_s;
        }
        (self.ticks, self.moved) = (0, AxisMap::default());
        self.give_out(1);
    }

    /// Gives out all blocks but the last so many.
    fn give_out(&mut self, kept: usize) {
        let count = self.open.len().saturating_sub(kept);
        for block in self.open.drain(..count) {
            *self.tools.entry(block.tool).or_default() += block.phases;
            self.ready.push_back(block);
        }
        if let Some(movers) = &mut self.movers {
            movers.first = movers.first.saturating_sub(count);
            movers.last = movers.last.saturating_sub(count);
        }
    }
}
