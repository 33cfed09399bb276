//! A machine's bus → the times that its host keeps.

use crate::base::machine::Bus;
use crate::wire::node::ANSWER_PAUSE_US;
use crate::wire::nodes::byte_ns;

/// Bytes handed out at a time unless said otherwise: a port that keeps them all is then never far
/// behind the wire.
const PIECE_BYTES: usize = 64;

/// The times that a host keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Timing {
    pub(super) byte_ns: u64,
    pub(super) tick_us: u64,
    pub(super) node_tick_us: u64,
    /// From a sync byte's stop bit to the start bit of the answer, at most.
    pub(super) sync_answer_us: u64,
    pub(super) reply_timeout_us: u64,
    pub(super) piece_bytes: usize,
}

impl Timing {
    /// The times of a bus whose clock runs `speed` times as fast as ours. All times that the
    /// master is given and gives are the bus's; the time-out for answers stays ours.
    pub fn new(bus: &Bus, speed: f64) -> Self {
        Timing {
            byte_ns: byte_ns(bus.baud),
            tick_us: u64::from(bus.tick_us),
            node_tick_us: u64::from(bus.node_tick_us),
            sync_answer_us: u64::from(bus.node_tick_us) + ANSWER_PAUSE_US,
            reply_timeout_us: (f64::from(bus.reply_timeout_ms) * 1000.0 * speed) as u64,
            piece_bytes: PIECE_BYTES,
        }
    }

    /// Hands out at most so many bytes at a time, and at least one.
    pub fn with_piece(self, bytes: u32) -> Self {
        Timing { piece_bytes: bytes.max(1) as usize, ..self }
    }

    pub(super) fn byte_us(&self) -> u64 {
        self.byte_ns.div_ceil(1000)
    }
}
