//! What a job takes beside its motion: nodes are filled one after the other, then execute, then
//! run through the zeros at the end of their buffer (seed 004, appendices B and C).

use super::{Bus, Master, Protocol};
use crate::base::AxisSet;

/// How long a node pauses after each answer, with its transmitter on.
pub const ANSWER_PAUSE_US: u32 = 250;

/// One SPI exchange between the two controllers of a node, 8 bits at 20 MHz / 4 / 16: what it
/// takes over a tick without steps.
pub const SPI_US: u32 = 26;

/// How long the host listens before the last byte of a node's data: who answers then has counted
/// more bytes than were sent, or is another node (H13). 1 % of a fill.
pub const LISTEN_US: u32 = 4000;

/// Bytes of the host for filling a node beside its buffer's entries: three pings of 8, before the
/// fill, before the start and after the buffer, and the command.
const FILL_EXTRA_BYTES: u32 = 26;
/// Answers of a node that is filled: to the pings, to the command, and when it is full.
const FILL_ANSWERS: f64 = 5.0;
/// Bytes of the start pair.
const START_BYTES: u32 = 2;
/// Bits on the wire for a byte: start, eight, stop.
const BITS_A_BYTE: u32 = 10;

/// What a node buffer takes beside its ticks, in seconds.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct BufferTime {
    /// Filling the nodes, and starting them.
    pub fill_s: f64,
    /// Zero entries after the last tick.
    pub pads_s: f64,
}

impl BufferTime {
    /// Both.
    pub fn total_s(self) -> f64 {
        self.fill_s + self.pads_s
    }
}

impl Bus {
    /// What a buffer takes beside its ticks, in which these axes move: a node each is filled, and
    /// the master's; none where nothing moves. Without node buffers that is nothing.
    ///
    /// A node that has to be filled though it rests, for the sake of its ID, is counted if it is that
    /// of an axis in `moving`.
    pub fn buffer_time(&self, ticks: f64, moving: AxisSet) -> BufferTime {
        if self.protocol != Protocol::Buffered || moving.is_empty() {
            return BufferTime::default();
        }
        let pads = (f64::from(self.buffer_ticks) - ticks).max(0.0);
        BufferTime { fill_s: self.fill_s(moving), pads_s: pads * self.pad_s() }
    }

    /// Filling and starting the nodes of a buffer in which these axes move, some of them at least.
    pub fn fill_s(&self, moving: AxisSet) -> f64 {
        let mut filled = moving;
        if let Master::Axis(axis) = self.master {
            filled.insert(axis);
        }
        let metronomes = usize::from(self.master == Master::Metronome);
        let node_s = self.wire_s(self.buffer_ticks + FILL_EXTRA_BYTES)
            + FILL_ANSWERS * self.answer_s()
            + f64::from(LISTEN_US) * 1e-6;
        (filled.len() + metronomes) as f64 * node_s + self.wire_s(START_BYTES)
    }

    /// A zero entry, as fast as answers come: sync byte, node, answer. A metronome beats here too.
    pub fn pad_s(&self) -> f64 {
        let beat_us = if self.master == Master::Metronome { self.node_tick_us } else { 0 };
        self.wire_s(1) + f64::from(SPI_US + beat_us) * 1e-6 + self.answer_s()
    }

    /// From an answer's start bit until the next byte may be sent.
    fn answer_s(&self) -> f64 {
        self.wire_s(1).max(f64::from(ANSWER_PAUSE_US) * 1e-6)
    }

    /// Time of bytes on the wire.
    pub(super) fn wire_s(&self, bytes: u32) -> f64 {
        f64::from(bytes * BITS_A_BYTE) / f64::from(self.baud)
    }
}
