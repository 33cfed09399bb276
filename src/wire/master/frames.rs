//! One frame a tick, to nodes that cannot answer: the host's frame rate is the clock.
//!
//! ```text
//!          t_k                  t_k+1 = t_k + period, or later
//! frame ───┤▒▒▒ 13 bytes ▒▒▒├───┤▒▒▒
//! nodes                     ┤ steps of k
//! ```
//! A tick counts as done when its frame has been written. Late frames slide the schedule as late sync
//! bytes do; the axes stand still meanwhile.

use crate::base::Axis;
use crate::wire::frames::Mode;
use crate::wire::job::{Buffer, Step};

use super::script::Action;
use super::{Master, State};

/// A stretch of motion: a beginning, from which frames are counted, and a frame a tick.
pub(super) fn stretch(buffer: &Buffer, step: usize) -> [Action; 2] {
    let begin = buffer.frame(Mode::Begin, 0, 0);
    [Action::Say(begin.to_vec()), Action::Run { step }]
}

impl Master {
    pub(super) fn send_frame(&mut self, now_us: u64) -> Option<Vec<u8>> {
        let (State::Running(run), Some(Step::Buffer(buffer))) = self.run_and_buffer() else {
            return None;
        };
        let frame = buffer.frame(Mode::Move, run.sent as u64 + 1, run.sent);
        self.occupy_wire(now_us, frame.len());
        let State::Running(run) = &mut self.state else { return None };
        run.sent_us = now_us;
        run.sent += 1;
        // Until it is written nobody knows how much of it is out.
        run.deadline_us = Some(u64::MAX);
        Some(frame.to_vec())
    }

    /// The frame has been written.
    pub(super) fn frame_sent(&mut self, now_us: u64) {
        let State::Running(run) = &mut self.state else { return };
        if run.deadline_us.take().is_none() {
            return;
        }
        run.sent_us = run.sent_us.max(now_us);
        run.measure(&mut self.pacing, self.timing.tick_us);
        run.due_us = run.sent_us + self.timing.tick_us;
        run.scheduled_us = Some(run.due_us);
        let tick = run.sent - 1;
        let Some(Step::Buffer(buffer)) = self.job.steps.get(run.step) else { return };
        let counts = buffer.counts(tick);
        self.progress.line = buffer.lines.get(tick).copied().unwrap_or(0);
        self.progress.ticks += 1;
        self.progress.at_us = now_us;
        let Some(moved) = &mut self.frames else { return };
        for axis in Axis::ALL.into_iter().filter(|axis| counts[*axis] != 0) {
            self.position[axis] += i64::from(counts[axis]);
            moved.insert(axis);
        }
    }

    /// The last tick of a stretch has had its period.
    pub(super) fn end_stretch(&mut self) {
        self.buffers_done += 1;
        self.state = State::Next;
    }
}
