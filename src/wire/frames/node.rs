//! Bytes in, steps out: one node that takes frames, and never says anything.
//!
//! Rules: a frame is 13 bytes from an info byte on; a frame that is broken, changed, of an unknown mode
//! or not the next one, or that asks for more steps than the axis can make, stops the node for good:
//! it stands still until it is switched off, for it has missed counts that nobody will repeat; so does
//! one that has not heard the beginning. Without a
//! frame it stands still too, at once and without a ramp. It keeps what comes while it steps, four frames
//! at most. Time is an argument, as for [`crate::wire::Node`].

use std::collections::VecDeque;

use super::{BYTES, Frame, INFO, Mode};
use crate::wire::node::{Activity, Happening, Run, pulses_us};

/// Frames that come while a node still steps and are kept.
const FRAMES_KEPT: usize = 4;

/// What a node knows of its axis and of its host.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameNodeLimits {
    /// In which a tick's pulses are spread.
    pub node_tick_us: u32,
    /// The host's period.
    pub tick_us: u32,
    /// Most steps that the axis makes in a tick.
    pub count_max: u32,
    /// Steps a tick at which the motor can start and stop without a ramp.
    pub slow_steps: u32,
}

/// A node. See the module's head.
#[derive(Clone, Debug)]
pub struct FrameNode {
    place: u8,
    limits: FrameNodeLimits,
    /// The frame being heard.
    heard: Vec<u8>,
    /// Number of the frame that is due; none before the first [`Mode::Begin`].
    due: Option<u64>,
    stopped: bool,
    /// Counts that have come and not begun, and when they came.
    waiting: VecDeque<(u64, i32)>,
    ready_us: u64,
    /// When the last frame came, and its count.
    last: (u64, i32),
    position_steps: i64,
    runs: Vec<Run>,
    happenings: VecDeque<(u64, Happening)>,
}

impl FrameNode {
    /// A node just switched on, at a place of the frame from 1 on.
    pub fn new(place: u8, limits: FrameNodeLimits, position_steps: i64) -> Self {
        FrameNode {
            place,
            limits,
            heard: Vec::with_capacity(BYTES),
            due: None,
            stopped: false,
            waiting: VecDeque::new(),
            ready_us: 0,
            last: (0, 0),
            position_steps,
            runs: Vec::new(),
            happenings: VecDeque::new(),
        }
    }

    /// Its place in the frame.
    pub fn place(&self) -> u8 {
        self.place
    }

    /// Executing while counts wait to be made.
    pub fn activity(&self) -> Activity {
        if self.waiting.is_empty() { Activity::Idle } else { Activity::Executing }
    }

    /// Where the axis stands.
    pub fn position_steps(&self) -> i64 {
        self.position_steps
    }

    /// What it has executed, a run from each [`Mode::Begin`] on.
    pub fn runs(&self) -> &[Run] {
        &self.runs
    }

    /// Takes a byte whose stop bit ends at `now_us`. Times must not go back.
    pub fn handle_byte(&mut self, now_us: u64, byte: u8) {
        self.advance(now_us);
        if self.stopped {
            return;
        }
        let begins = byte & INFO != 0;
        if begins != self.heard.is_empty() {
            // Half a frame, or data without an info byte. Before the first beginning that may be noise of
            // switching on: whether a frame was lost shows in the next one.
            if self.due.is_some() {
                self.miss(now_us);
            }
            self.heard.clear();
        }
        if begins || !self.heard.is_empty() {
            self.heard.push(byte);
        }
        if let Ok(frame) = Frame::try_from(&self.heard[..]) {
            self.heard.clear();
            self.take(now_us, &frame);
            self.advance(now_us);
        }
    }

    /// Makes the counts that have come, as far as it gets by `now_us`.
    pub fn advance(&mut self, now_us: u64) {
        while let Some(&(came_us, count)) = self.waiting.front() {
            let start_us = self.ready_us.max(came_us);
            if start_us > now_us {
                return;
            }
            self.waiting.pop_front();
            self.make(start_us, came_us, count);
        }
    }

    /// When [`FrameNode::advance`] has something to do, if no byte comes.
    pub fn next_us(&self) -> Option<u64> {
        self.waiting.front().map(|(came_us, _)| self.ready_us.max(*came_us))
    }

    /// When the node is done with all that has come so far.
    pub fn ready_us(&self) -> u64 {
        self.ready_us
    }

    /// The next thing that happened, and when.
    pub fn poll_happening(&mut self) -> Option<(u64, Happening)> {
        self.happenings.pop_front()
    }

    /// The node starts anew, and waits for a beginning. The axis stays where it is.
    pub fn reset(&mut self) {
        self.heard.clear();
        self.waiting.clear();
        self.due = None;
        self.stopped = false;
    }

    /// The firmware makes no steps for so long; frames wait.
    pub fn stall(&mut self, now_us: u64, stall_us: u64) {
        self.ready_us = self.ready_us.max(now_us + stall_us);
    }

    /// More frames have come than it keeps.
    pub fn overrun(&mut self, now_us: u64) {
        self.stop();
        self.happenings.push_back((now_us, Happening::Overrun));
    }

    /// The node is without power.
    pub fn die(&mut self) {
        self.stop();
    }

    fn stop(&mut self) {
        self.stopped = true;
        self.waiting.clear();
    }

    /// It has not heard a frame that was sent, or cannot be sure that it has.
    fn miss(&mut self, now_us: u64) {
        self.stop();
        let tick = self.runs.last().map_or(0, |run| run.counts.len());
        self.happenings.push_back((now_us, Happening::FrameMissed { tick }));
    }

    fn take(&mut self, now_us: u64, frame: &Frame) {
        if super::mode(frame, 0) == Some(Mode::Begin) {
            self.due = Some(1);
            self.last = (now_us, 0);
            self.happenings.push_back((now_us, Happening::Starts));
            self.runs.push(Run { start_us: now_us, counts: Vec::new() });
            return;
        }
        let count = super::decode(super::place(frame, self.place));
        let is_right = |number: &u64| {
            super::mode(frame, *number) == Some(Mode::Move)
                && count.unsigned_abs() <= self.limits.count_max
        };
        let Some(number) = self.due.filter(is_right) else { return self.miss(now_us) };
        self.due = Some(number + 1);
        let (last_us, last_count) = self.last;
        let gap_us = now_us - last_us;
        if last_count.unsigned_abs() > self.limits.slow_steps
            && gap_us > u64::from(self.limits.tick_us) * 3 / 2
        {
            self.happenings.push_back((now_us, Happening::RanDry { count: last_count, gap_us }));
        }
        self.last = (now_us, count);
        if self.waiting.len() == FRAMES_KEPT {
            return self.overrun(now_us);
        }
        self.waiting.push_back((now_us, count));
    }

    fn make(&mut self, start_us: u64, came_us: u64, count: i32) {
        let Some(run) = self.runs.last_mut() else { return };
        if start_us > came_us {
            let (entry, waited_us) = (run.counts.len(), start_us - came_us);
            self.happenings.push_back((start_us, Happening::SyncWaited { entry, waited_us }));
        }
        run.counts.push(count);
        self.position_steps = self.position_steps.saturating_add(i64::from(count));
        let half_tick_us = u64::from(self.limits.node_tick_us / 2);
        self.ready_us = start_us + pulses_us(half_tick_us, count.unsigned_abs());
    }
}
