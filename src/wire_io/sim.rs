//! Virtual nodes at the end of a virtual wire, in virtual time: the same job always runs the same.

use crate::wire::Nodes;
use crate::wire_io::link::{Link, LinkError};

/// A simulated bus.
#[derive(Debug)]
pub struct Sim {
    nodes: Nodes,
    now_us: u64,
}

impl Sim {
    /// A bus with these nodes, at time 0.
    pub fn new(nodes: Nodes) -> Self {
        Sim { nodes, now_us: 0 }
    }

    /// The nodes.
    pub fn nodes(&self) -> &Nodes {
        &self.nodes
    }

    /// The nodes, to read their log.
    pub fn nodes_mut(&mut self) -> &mut Nodes {
        &mut self.nodes
    }
}

impl Link for Sim {
    fn now_us(&mut self) -> u64 {
        self.now_us
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        self.nodes.handle_bytes(self.now_us, bytes);
        if self.nodes.is_closed() { Err(LinkError::Closed) } else { Ok(()) }
    }

    fn receive(
        &mut self,
        bytes: &mut Vec<u8>,
        until_us: u64,
        _answer_from_us: Option<u64>,
    ) -> Result<(), LinkError> {
        loop {
            let next_us = self.nodes.poll_timeout().unwrap_or(until_us).min(until_us);
            self.now_us = self.now_us.max(next_us);
            self.nodes.advance(self.now_us);
            while let Some(byte) = self.nodes.poll_answer(self.now_us) {
                bytes.push(byte);
            }
            if !bytes.is_empty() || self.now_us >= until_us {
                return Ok(());
            }
        }
    }

    /// Time passes until all bytes have reached the nodes.
    fn drain(&mut self) {
        while let Some(next_us) = self.nodes.poll_timeout() {
            self.now_us = self.now_us.max(next_us);
            self.nodes.advance(self.now_us);
            while self.nodes.poll_answer(self.now_us).is_some() {}
        }
    }
}
