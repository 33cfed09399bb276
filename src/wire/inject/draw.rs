//! A seed → faults, each kind in each phase about as often as any other.

use super::spec::{FaultKind, FaultSpec, Phase, Who};
use crate::base::machine::{FRAME_BYTES, Unit};

/// Random numbers from a seed: splitmix64 (Steele, Lea, Flood 2014).
#[derive(Clone, Debug)]
pub struct Random(pub u64);

impl Random {
    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number below `end`, which is not 0.
    pub fn below(&mut self, end: u64) -> u64 {
        self.bits() % end
    }
}

/// Longest delay that is drawn: longer than any answer is waited for.
const DELAY_MAX_US: u64 = 400_000;

/// Draws a fault for a bus with these nodes, whose buffers have so many entries.
pub(super) fn fault(random: &mut Random, units: &[Unit], entries: u32) -> FaultSpec {
    let mut phase = Phase::ALL[random.below(Phase::ALL.len() as u64) as usize];
    let kind = kind(random, units);
    if kind.is_of_answer() && phase == Phase::Start {
        // Nothing answers a start.
        phase = Phase::Tick;
    }
    let nodes = units.len().max(1) as u64;
    let unit = units.get(random.below(nodes) as usize);
    let who = unit.map(|unit| unit.axis.map_or(Who::Id(unit.id), Who::Axis));
    let alone = matches!(kind, FaultKind::Drop | FaultKind::Change(_) | FaultKind::Add(_))
        && random.below(2) == 0;
    let who = who.filter(|_| kind.needs_node() || alone);
    let entries = u64::from(entries);
    // How many bytes, or answers, a job of a few buffers has in each phase.
    let (buffers, fills) = (3, 3 * nodes);
    let count = match (phase, kind.is_of_answer()) {
        (Phase::Ping, true) => 3 * fills,
        (Phase::Ping, false) => 8 * 3 * fills,
        (Phase::Command, true) | (Phase::Data, true) => fills,
        (Phase::Command, false) => 2 * fills,
        (Phase::Data, false) => entries * fills,
        (Phase::Start, _) => 2 * buffers,
        (Phase::Tick | Phase::Pad, _) => entries * buffers / 2,
    };
    // Half of them early, where a job of any length gets.
    let count = if random.below(2) == 0 { count.div_ceil(4) } else { count };
    FaultSpec { kind, who, phase: Some(phase), number: random.below(count.max(1)) }
}

/// Draws a fault for nodes that take frames: of what nobody answers, in one of the first frames.
pub(super) fn fault_of_frames(random: &mut Random, units: &[Unit]) -> FaultSpec {
    loop {
        let drawn = fault(random, units, FRAMES_DRAWN * FRAME_BYTES);
        if !drawn.kind.is_of_answer() && matches!(drawn.phase, Some(Phase::Start | Phase::Tick)) {
            return drawn;
        }
    }
}

/// Frames, of a job of any length, that faults are drawn for.
const FRAMES_DRAWN: u32 = 200;

fn kind(random: &mut Random, units: &[Unit]) -> FaultKind {
    let mask = 1 + random.below(255) as u8;
    let mask = if random.below(2) == 0 { 1 << random.below(8) } else { mask };
    let ids: Vec<u8> = units.iter().map(|unit| unit.id).collect();
    let meaningful = [b"hjs\0x".as_slice(), &ids].concat();
    let byte = match random.below(2) {
        0 => meaningful[random.below(meaningful.len() as u64) as usize],
        _ => random.below(256) as u8,
    };
    let shift = random.below(8);
    let us = 1 + random.below(DELAY_MAX_US >> shift);
    match random.below(14) {
        0 => FaultKind::Drop,
        1 => FaultKind::Change(mask),
        2 => FaultKind::Add(byte),
        3 => FaultKind::Late(us),
        4 => FaultKind::LoseAnswer,
        5 => FaultKind::ChangeAnswer(mask),
        6 => FaultKind::DoubleAnswer,
        7 => FaultKind::LateAnswer(us),
        8 => FaultKind::Collide,
        9 => FaultKind::Dead,
        10 => FaultKind::Stall(us),
        11 => FaultKind::Reset,
        12 => FaultKind::Overrun,
        _ => FaultKind::Close,
    }
}
