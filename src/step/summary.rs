//! What a job comes to: ticks, seconds, ways, seams, and what limited the speed.

use std::collections::BTreeSet;

use crate::base::machine::Bus;
use crate::base::{AxisMap, Command, EventKind, Machine, Tick};
use crate::plan::limits::Bound;
use crate::plan::{Planned, Profile};

/// Collects the figures of a job while its plan and its commands pass by.
#[derive(Clone, Debug, Default)]
pub struct Summary {
    /// Ticks of motion.
    pub ticks: u64,
    /// Way at a feed.
    pub cut_mm: f64,
    /// Way in rapids.
    pub rapid_mm: f64,
    /// Pauses that the program asks for.
    pub dwell_s: f64,
    /// Events other than pauses, which take a time unknown here.
    pub events: u64,
    /// Everything but the program's own feed that set the speed of some segment.
    pub bounds: BTreeSet<Bound>,
    buffers: Vec<Buffer>,
    last_profile: Option<ProfileEnd>,
}

/// A node buffer: its ticks, who moves in it, how its last motion ends.
#[derive(Clone, Debug)]
struct Buffer {
    ticks: u64,
    /// All counts of each axis, or-ed: 0 where an axis rests throughout.
    moved: AxisMap<i32>,
    line: u32,
    end: SeamKind,
}

#[derive(Clone, Copy, Debug)]
struct ProfileEnd {
    buffer: u32,
    kind: SeamKind,
}

/// The end of one node buffer and the start of the next: the machine stands while the nodes are
/// filled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seam {
    /// First tick after the seam.
    pub tick: u64,
    /// Line of the last motion before it.
    pub line: u32,
    /// What it interrupts.
    pub kind: SeamKind,
    /// Pads of the buffer before and fills of the one after.
    pub lost_s: f64,
}

/// What a seam interrupts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SeamKind {
    /// Nothing: motion rests there anyway.
    Rest,
    /// A rapid.
    Rapid,
    /// A cut: it may leave a mark.
    Cut,
}

impl SeamKind {
    /// `rest`, `rapid` or `cut`.
    pub fn name(self) -> &'static str {
        match self {
            SeamKind::Rest => "rest",
            SeamKind::Rapid => "rapid",
            SeamKind::Cut => "cut",
        }
    }
}

impl Summary {
    /// A piece of the plan passes by.
    pub fn planned(&mut self, planned: &Planned) {
        let Planned::Profile(profile) = planned else { return };
        let way_mm = profile.ramp.length_mm();
        match profile.segment.feed_mm_s {
            Some(_) => self.cut_mm += way_mm,
            None => self.rapid_mm += way_mm,
        }
        if profile.bound != Bound::Feed {
            self.bounds.insert(profile.bound);
        }
        if let Some(last) = self.last_profile.filter(|last| last.buffer != profile.buffer)
            && let Some(buffer) = self.buffers.get_mut(last.buffer as usize)
        {
            buffer.end = last.kind;
        }
        self.last_profile = Some(ProfileEnd { buffer: profile.buffer, kind: end_kind(profile) });
    }

    /// A command passes by.
    pub fn command(&mut self, command: &Command) {
        match command {
            Command::Tick(tick) => self.tick(tick),
            Command::Event(event) => match event.kind {
                EventKind::Dwell(seconds) => self.dwell_s += seconds,
                _ => self.events += 1,
            },
        }
    }

    fn tick(&mut self, tick: &Tick) {
        self.ticks += 1;
        while self.buffers.len() <= tick.buffer as usize {
            let moved = AxisMap::default();
            self.buffers.push(Buffer { ticks: 0, moved, line: 0, end: SeamKind::Rest });
        }
        let Some(buffer) = self.buffers.last_mut() else { return };
        buffer.ticks += 1;
        buffer.line = tick.line;
        for (moved, count) in buffer.moved.0.iter_mut().zip(tick.counts.0) {
            *moved |= count;
        }
    }

    /// How many node buffers hold motion.
    pub fn buffers(&self) -> usize {
        self.buffers.len()
    }

    /// Time of the motion itself.
    pub fn motion_s(&self, machine: &Machine) -> f64 {
        self.ticks as f64 * machine.bus.tick_s()
    }

    /// Time from start to end: motion, pauses, fills and pads. Events take what they take.
    pub fn total_s(&self, machine: &Machine) -> f64 {
        let bus = &machine.bus;
        let buffered = bus.motion_ticks_max().is_some();
        let refills_s: f64 =
            self.buffers.iter().map(|buffer| buffer.fill_s(bus) + buffer.pads_s(bus)).sum();
        self.motion_s(machine) + self.dwell_s + if buffered { refills_s } else { 0.0 }
    }

    /// The seams, in order; none on a machine without node buffers.
    pub fn seams(&self, machine: &Machine) -> Vec<Seam> {
        let mut tick = 0;
        let pairs = self.buffers.iter().zip(self.buffers.iter().skip(1));
        let seam = |(before, after): (&Buffer, &Buffer)| {
            tick += before.ticks;
            let lost_s = before.pads_s(&machine.bus) + after.fill_s(&machine.bus);
            Seam { tick, line: before.line, kind: before.end, lost_s }
        };
        pairs.map(seam).collect()
    }
}

/// How motion ends with a profile: at rest if its block ends there with a ramp.
fn end_kind(profile: &Profile) -> SeamKind {
    if profile.share_to >= 1.0 && profile.ramp.is_ramped() {
        SeamKind::Rest
    } else if profile.segment.feed_mm_s.is_some() {
        SeamKind::Cut
    } else {
        SeamKind::Rapid
    }
}

/// Bytes on the wire for filling a node beside its buffer's entries: command and two answers.
const FILL_EXTRA_BYTES: u32 = 4;
/// Bytes on the wire for a tick: sync byte and answer.
const TICK_BYTES: u32 = 2;
/// How long a node takes over a tick without steps (seed 004, appendix C).
const ZERO_TICK_S: f64 = 26e-6;
/// Bits on the wire for a byte: start, eight, stop.
const BITS_A_BYTE: u32 = 10;

impl Buffer {
    /// Filling the nodes that move, one after the other.
    fn fill_s(&self, bus: &Bus) -> f64 {
        let bytes = bus.buffer_ticks + FILL_EXTRA_BYTES;
        let moving = self.moved.0.iter().filter(|moved| **moved != 0).count();
        moving as f64 * wire_s(bytes, bus)
    }

    /// The zero entries after the last motion, as fast as answers come.
    fn pads_s(&self, bus: &Bus) -> f64 {
        let pads = u64::from(bus.buffer_ticks).saturating_sub(self.ticks);
        pads as f64 * (wire_s(TICK_BYTES, bus) + ZERO_TICK_S)
    }
}

fn wire_s(bytes: u32, bus: &Bus) -> f64 {
    f64::from(bytes * BITS_A_BYTE) / f64::from(bus.baud)
}
