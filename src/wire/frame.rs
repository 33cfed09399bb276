//! The few things that a host says.

use crate::wire::node;

/// Starts execution in every node whose buffer is full.
pub const START: [u8; 2] = [node::START, 0];
/// Lets every executing node do its next entry. Any byte would; 0 is no ID (H4).
pub const SYNC: u8 = 0;

/// A ping: a jog that makes no steps. The node answers its ID to the first pair. The zeros before
/// the end are the jog's feed if a byte is lost: 's' would be 115 steps.
pub const fn ping(id: u8) -> [[u8; 2]; 4] {
    jog(id, 0)
}

/// A jog with this feed byte; the third pair ends it.
pub const fn jog(id: u8, feed: u8) -> [[u8; 2]; 4] {
    [[node::JOG, id], [id, feed], [0, 0], END_JOG]
}

/// Sends a node to its limit switch. It answers its ID there.
pub const fn home(id: u8) -> [u8; 2] {
    [node::HOME, id]
}

/// Ends a jog, as any bytes would; to everybody else a pair that means nothing.
pub const END_JOG: [u8; 2] = [node::STOP; 2];

/// Asks a node to take its buffer. It answers its ID, and again after the last byte.
pub const fn fill(id: u8, master: bool) -> [u8; 2] {
    [id, if master { id } else { 0 }]
}
