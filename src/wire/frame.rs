//! The few things that a host says.

use crate::wire::node;

/// Starts execution in every node whose buffer is full.
pub const START: [u8; 2] = [node::START, 0];
/// Lets every executing node do its next entry. Any byte would; 0 is no ID (H4).
pub const SYNC: u8 = 0;

/// A ping: a jog that makes no steps. The node answers its ID to the first pair.
pub const fn ping(id: u8) -> [[u8; 2]; 3] {
    [[node::JOG, id], [id, 0], [node::STOP, node::STOP]]
}

/// Asks a node to take its buffer. It answers its ID, and again after the last byte.
pub const fn fill(id: u8, master: bool) -> [u8; 2] {
    [id, if master { id } else { 0 }]
}
