//! What a job comes to: ticks, seconds, ways, seams, and what limited the speed.

use std::collections::{BTreeMap, BTreeSet};

use crate::base::machine::{BufferTime, Bus};
use crate::base::{Axis, AxisMap, AxisSet, Command, EventKind, Machine, Tick};
use crate::plan::{Bound, Planned, Profile, SeamKind};

use super::Times;

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
    /// What blocks and tools take, if that is asked for.
    pub times: Option<Times>,
    buffers: Vec<Buffer>,
    /// Buffer of the motion planned last.
    buffer: u32,
    /// What the end of a buffer interrupts, where it is not a rest that the program asks for.
    ends: BTreeMap<u32, SeamKind>,
}

/// A node buffer: its ticks and who moves in it.
#[derive(Clone, Debug)]
struct Buffer {
    ticks: u64,
    /// All counts of each axis, or-ed: 0 where an axis rests throughout.
    moved: AxisMap<i32>,
    line: u32,
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

impl Summary {
    /// With the times of blocks and tools.
    pub fn with_times(machine: &Machine) -> Summary {
        Summary { times: Some(Times::new(machine)), ..Summary::default() }
    }

    /// An item of the plan passes by.
    pub fn planned(&mut self, planned: &Planned) {
        if let Some(times) = &mut self.times {
            times.planned(planned);
        }
        match planned {
            Planned::Profile(profile) => self.profile(profile),
            Planned::Event(_) => {}
            Planned::Seam(kind) => {
                self.ends.insert(self.buffer, *kind);
            }
        }
    }

    fn profile(&mut self, profile: &Profile) {
        self.buffer = profile.buffer;
        let way_mm = profile.ramp.length_mm();
        match profile.segment.feed_mm_s {
            Some(_) => self.cut_mm += way_mm,
            None => self.rapid_mm += way_mm,
        }
        if profile.bound != Bound::Feed {
            self.bounds.insert(profile.bound);
        }
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
        if let Some(times) = &mut self.times {
            times.tick(tick);
        }
        while self.buffers.len() <= tick.buffer as usize {
            let moved = AxisMap::default();
            self.buffers.push(Buffer { ticks: 0, moved, line: 0 });
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

    /// The first of the longest node buffers: its number, its ticks and the line of its last one.
    pub fn longest_buffer(&self) -> Option<(usize, u64, u32)> {
        let buffers = self.buffers.iter().enumerate();
        let longest = buffers.rev().max_by_key(|(_, buffer)| buffer.ticks);
        longest.map(|(number, buffer)| (number, buffer.ticks, buffer.line))
    }

    /// Time of the motion itself.
    pub fn motion_s(&self, machine: &Machine) -> f64 {
        self.ticks as f64 * machine.bus.tick_s()
    }

    /// Time from start to end: motion, pauses, fills and pads. Events take what they take.
    pub fn total_s(&self, machine: &Machine) -> f64 {
        let refills_s: f64 =
            self.buffers.iter().map(|buffer| buffer.time(&machine.bus).total_s()).sum();
        self.motion_s(machine) + self.dwell_s + refills_s
    }

    /// The seams, in order; none on a machine without node buffers.
    pub fn seams(&self, machine: &Machine) -> Vec<Seam> {
        let mut tick = 0;
        let pairs = self.buffers.iter().zip(self.buffers.iter().skip(1));
        let seam = |(buffer, (before, after)): (u32, (&Buffer, &Buffer))| {
            tick += before.ticks;
            let lost_s = before.time(&machine.bus).pads_s + after.time(&machine.bus).fill_s;
            let kind = self.ends.get(&buffer).copied().unwrap_or(SeamKind::Rest);
            Seam { tick, line: before.line, kind, lost_s }
        };
        (0..).zip(pairs).map(seam).collect()
    }
}

impl Buffer {
    fn time(&self, bus: &Bus) -> BufferTime {
        bus.buffer_time(self.ticks as f64, moved(&self.moved))
    }
}

/// The axes whose counts, or-ed, are not all zero.
pub(super) fn moved(counts: &AxisMap<i32>) -> AxisSet {
    Axis::ALL.into_iter().filter(|axis| counts[*axis] != 0).collect()
}
