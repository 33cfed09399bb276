//! A node of either protocol, as the bus sees it.

use crate::base::Machine;
use crate::base::machine::{Protocol, Unit};
use crate::wire::frames::{FrameNode, FrameNodeLimits};
use crate::wire::node::{Activity, Happening, Node, Run};

/// A node.
#[derive(Clone, Debug)]
pub enum Firmware {
    /// It has a buffer, and answers.
    Buffered(Node),
    /// It takes a frame a tick.
    Frame(FrameNode),
}

/// Does the same with either.
macro_rules! either {
    ($of:expr, $node:ident => $do:expr) => {
        match $of {
            Firmware::Buffered($node) => $do,
            Firmware::Frame($node) => $do,
        }
    };
}

impl Firmware {
    /// A node of a machine, just switched on, its axis at `position_steps`.
    pub fn new(unit: Unit, machine: &Machine, position_steps: i64) -> Firmware {
        let bus = &machine.bus;
        let profile = unit.axis.and_then(|axis| machine.axis(axis));
        if bus.protocol == Protocol::Frame {
            let slow =
                |speed_mm_s: f64, steps_per_mm: f64| speed_mm_s * bus.tick_s() * steps_per_mm;
            let limits = FrameNodeLimits {
                node_tick_us: bus.node_tick_us,
                tick_us: bus.tick_us,
                count_max: profile.map_or(0, |profile| machine.count_max(profile)),
                slow_steps: profile.map_or(0, |p| slow(p.start_speed_mm_s, p.steps_per_mm) as u32),
            };
            return Firmware::Frame(FrameNode::new(unit.id, limits, position_steps));
        }
        let switch_steps = profile.map_or(0, |profile| profile.switch_steps().unwrap_or(0));
        let node = Node::new(unit.id, bus.buffer_ticks, bus.node_tick_us, position_steps);
        Firmware::Buffered(node.with_switch(switch_steps))
    }

    /// The node's ID, or its place in the frame.
    pub fn id(&self) -> u8 {
        match self {
            Firmware::Buffered(node) => node.id(),
            Firmware::Frame(node) => node.place(),
        }
    }

    /// What the node is doing.
    pub fn activity(&self) -> Activity {
        either!(self, node => node.activity())
    }

    /// Whether the node holds a buffer that has not been executed to its end.
    pub fn is_full(&self) -> bool {
        matches!(self, Firmware::Buffered(node) if node.is_full())
    }

    /// Whether the next byte is the first of a pair; frames find their start by themselves.
    pub fn is_in_phase(&self) -> bool {
        match self {
            Firmware::Buffered(node) => node.is_in_phase(),
            Firmware::Frame(_) => true,
        }
    }

    /// Where the axis stands.
    pub fn position_steps(&self) -> i64 {
        either!(self, node => node.position_steps())
    }

    /// Every execution so far, the present one included.
    pub fn runs(&self) -> &[Run] {
        either!(self, node => node.runs())
    }

    pub(super) fn handle_byte(&mut self, now_us: u64, byte: u8) {
        either!(self, node => node.handle_byte(now_us, byte));
    }

    pub(super) fn advance(&mut self, now_us: u64) {
        either!(self, node => node.advance(now_us));
    }

    pub(super) fn next_us(&self) -> Option<u64> {
        either!(self, node => node.next_us())
    }

    pub(super) fn ready_us(&self) -> u64 {
        either!(self, node => node.ready_us())
    }

    pub(super) fn poll_answer(&mut self) -> Option<(u64, u8)> {
        match self {
            Firmware::Buffered(node) => node.poll_answer(),
            Firmware::Frame(_) => None,
        }
    }

    pub(super) fn poll_happening(&mut self) -> Option<(u64, Happening)> {
        either!(self, node => node.poll_happening())
    }

    pub(super) fn reset(&mut self, now_us: u64) {
        match self {
            Firmware::Buffered(node) => node.reset(now_us),
            Firmware::Frame(node) => node.reset(),
        }
    }

    pub(super) fn stall(&mut self, now_us: u64, stall_us: u64) {
        either!(self, node => node.stall(now_us, stall_us));
    }

    pub(super) fn overrun(&mut self, now_us: u64) {
        either!(self, node => node.overrun(now_us));
    }

    pub(super) fn die(&mut self) {
        either!(self, node => node.die());
    }
}
