//! Faults by list or by seed → what virtual nodes hear and what their host hears of them.
//!
//! Each fault strikes once, at a place counted in bytes of the host or in answers, so that a run can
//! be repeated exactly. What nodes make of it is theirs.

mod draw;
mod phase;
mod spec;

use std::collections::VecDeque;

use crate::base::machine::{Bus, Protocol, Unit};

pub use self::draw::Random;
use self::phase::Listener;
pub use self::spec::{FaultKind, FaultSpec, FaultSpecError, Phase, Who};

/// A fault that has struck.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Struck {
    /// When, in microseconds of the bus's time.
    pub at_us: u64,
    /// The fault.
    pub fault: FaultSpec,
    /// The phase in which it struck.
    pub phase: Phase,
}

/// The faults of a bus. Without any it only counts.
#[derive(Clone, Debug)]
pub struct Faults {
    waiting: Vec<FaultSpec>,
    struck: VecDeque<Struck>,
    listener: Listener,
    bytes: Counts,
    answers: Counts,
}

/// How many have passed, of each phase and in all.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    of_phase: [u64; Phase::ALL.len()],
    all: u64,
}

impl Counts {
    fn is_at(&self, fault: &FaultSpec, phase: Phase) -> bool {
        match fault.phase {
            Some(of) => of == phase && self.of_phase[phase as usize] == fault.number,
            None => self.all == fault.number,
        }
    }

    fn pass(&mut self, phase: Phase) {
        self.of_phase[phase as usize] += 1;
        self.all += 1;
    }
}

impl Faults {
    /// These faults, on a bus whose buffers have so many entries.
    pub fn new(faults: Vec<FaultSpec>, entries: u32, metronome: Option<u8>) -> Self {
        Faults {
            waiting: faults,
            struck: VecDeque::new(),
            listener: Listener::new(entries, metronome),
            bytes: Counts::default(),
            answers: Counts::default(),
        }
    }

    /// These faults, on a bus of this kind.
    pub fn of_bus(faults: Vec<FaultSpec>, bus: &Bus) -> Self {
        let listener = match bus.protocol {
            Protocol::Frame => Listener::of_frames(),
            _ => Listener::new(bus.buffer_ticks, bus.metronome_id),
        };
        Faults { listener, ..Faults::new(faults, bus.buffer_ticks, bus.metronome_id) }
    }

    /// So many faults of a seed, for nodes that take frames.
    pub fn draw_frames(seed: u64, count: usize, units: &[Unit]) -> Vec<FaultSpec> {
        let mut random = Random(seed);
        (0..count).map(|_| draw::fault_of_frames(&mut random, units)).collect()
    }

    /// So many faults of a seed: the same for the same seed and bus.
    pub fn draw(seed: u64, count: usize, units: &[Unit], entries: u32) -> Vec<FaultSpec> {
        let mut random = Random(seed);
        (0..count).map(|_| draw::fault(&mut random, units, entries)).collect()
    }

    /// Faults that have struck, in order, each once.
    pub fn poll_struck(&mut self) -> Option<Struck> {
        self.struck.pop_front()
    }

    /// The host sends a byte, which would arrive at this time: what strikes it.
    pub(super) fn byte(&mut self, arrival_us: u64, byte: u8) -> Vec<FaultSpec> {
        let phase = self.listener.hear(byte);
        let found = self.strike(arrival_us, phase, false);
        self.bytes.pass(phase);
        found
    }

    /// A node answers: what strikes its answer.
    pub(super) fn answer(&mut self, now_us: u64) -> Vec<FaultSpec> {
        let phase = self.listener.phase();
        let found = self.strike(now_us, phase, true);
        self.answers.pass(phase);
        found
    }

    fn strike(&mut self, at_us: u64, phase: Phase, of_answer: bool) -> Vec<FaultSpec> {
        if self.waiting.is_empty() {
            return Vec::new();
        }
        let counts = if of_answer { self.answers } else { self.bytes };
        let strikes = |fault: &FaultSpec| {
            fault.kind.is_of_answer() == of_answer && counts.is_at(fault, phase)
        };
        let found: Vec<_> = self.waiting.iter().copied().filter(strikes).collect();
        self.waiting.retain(|fault| !strikes(fault));
        self.struck.extend(found.iter().map(|fault| Struck { at_us, fault: *fault, phase }));
        found
    }
}
