//! One sync byte a tick: the metronome of a buffer.
//!
//! ```text
//!       t_k           answer_k        t_k+1 = max(t_k + period, answer_k)
//! sync ─┤├──────────────────────────────┤├───────
//! node     ▒▒▒▒ steps ▒▒▒▒├─answer─┤
//! ```
//!
//! A master that rests in a tick answers at once, while others step. Its answer then tells when the
//! sync byte has reached the nodes at the latest, which may be long after it was written: the next one
//! waits for a node's tick from there, or the nodes would drift apart by what the port has kept back.

use crate::base::Axis;
use crate::wire::codec;
use crate::wire::frame;
use crate::wire::job::{Buffer, Step};
use crate::wire::pacing::Pacing;
use crate::wire::report::{Doubt, During, End, Fault};

use super::{Hold, Master, MasterEvent, State};

/// A buffer being executed.
#[derive(Debug)]
pub(super) struct Run {
    /// The buffer's place in the job.
    pub(super) step: usize,
    /// Sync bytes, or frames, sent.
    pub(super) sent: usize,
    /// Events of the buffer that have happened.
    events: usize,
    pub(super) sent_us: u64,
    /// Earliest time of the next sync byte.
    pub(super) due_us: u64,
    /// What the next sync byte's lateness is measured from; none where only answers set the pace.
    pub(super) scheduled_us: Option<u64>,
    /// None but while an answer is waited for, or a frame is being written.
    pub(super) deadline_us: Option<u64>,
    /// When the last answer came; before it, when the nodes were started.
    answered_us: u64,
    /// The next sync byte waits for the end of a dwell.
    dwells: bool,
    /// A hold takes effect then, unless a byte comes that nobody asked for.
    hold_us: Option<u64>,
    /// An event is under way.
    paused: bool,
}

impl Run {
    pub(super) fn is_overdue(&self, now_us: u64) -> bool {
        self.deadline_us.is_some_and(|deadline_us| now_us >= deadline_us)
    }

    pub(super) fn waits(&self) -> bool {
        self.deadline_us.is_some()
    }

    pub(super) fn timeout_us(&self, wire_free_us: u64) -> u64 {
        self.deadline_us.or(self.hold_us).unwrap_or(self.due_us.max(wire_free_us))
    }

    /// Goes on after a hold; a dwell under way has gone on meanwhile.
    pub(super) fn resume(&mut self, from_us: u64) {
        self.due_us = self.due_us.max(from_us);
        self.scheduled_us = None;
        self.hold_us = None;
    }

    /// An event comes before the next sync byte: a dwell, or what is under way until it is done.
    pub(super) fn reach_event(&mut self, now_us: u64, dwell_us: Option<u64>) {
        self.events += 1;
        let Some(dwell_us) = dwell_us else {
            self.paused = true;
            return;
        };
        self.due_us = now_us.saturating_add(dwell_us);
        if dwell_us > 0 {
            self.scheduled_us = None;
            self.dwells = true;
        }
    }

    pub(super) fn is_paused(&self) -> bool {
        self.paused
    }

    /// The event under way is done.
    pub(super) fn go_on(&mut self, from_us: u64) {
        self.paused = false;
        self.resume(from_us);
    }

    /// Goes on after a hold, at once.
    pub(super) fn resume_at_once(&mut self) {
        self.due_us = 0;
        self.scheduled_us = None;
        self.hold_us = None;
    }

    /// How late what has just been sent is.
    pub(super) fn measure(&mut self, pacing: &mut Pacing, tick_us: u64) {
        if let Some(scheduled_us) = self.scheduled_us.take() {
            let before_us = scheduled_us - tick_us;
            pacing.tick(self.sent_us - before_us, self.due_us.saturating_sub(before_us));
        }
    }

    /// Whether the sync bytes so far leave idle nodes with half a pair.
    pub(super) fn is_odd(&self) -> bool {
        !self.sent.is_multiple_of(2)
    }
}

impl Master {
    pub(super) fn start_run(&mut self, now_us: u64, step: usize) {
        if let Some(Step::Buffer(buffer)) = self.job.steps.get(step) {
            self.progress.buffer = buffer.number;
            let answers = self.frames.is_none();
            let servants = buffer.fills.iter().filter(|fill| answers && !fill.master);
            servants
                .filter_map(|fill| fill.unit.axis)
                .for_each(|axis| self.unconfirmed.insert(axis));
            self.events.push_back(MasterEvent::Started { buffer: buffer.number });
        }
        // The start pair leaves the wire before the first tick is timed.
        let due_us = self.wire_free_us().max(now_us);
        self.state = State::Running(Run {
            step,
            sent: 0,
            events: 0,
            sent_us: due_us,
            due_us,
            scheduled_us: None,
            deadline_us: None,
            answered_us: due_us,
            dwells: false,
            hold_us: None,
            paused: false,
        });
    }

    /// The next sync byte, if it is time for it.
    pub(super) fn sync(&mut self, now_us: u64) -> Option<Vec<u8>> {
        let (State::Running(run), Some(Step::Buffer(buffer))) = self.run_and_buffer() else {
            return None;
        };
        let sent = run.sent;
        if run.waits() || run.is_paused() {
            return None;
        }
        let silent_us = match self.frames {
            Some(_) => run.due_us,
            None => run.answered_us + self.sync_wait_us(),
        };
        match run.hold_us {
            Some(hold_us) if now_us < hold_us => return None,
            Some(_) => {
                let line = buffer.lines.get(sent).copied().unwrap_or(0);
                // Between frames nodes take no byte for a tick.
                self.hold_here(line, self.frames.is_none());
                return None;
            }
            None if self.holds_before(run, buffer) => {
                if self.hold == Hold::End {
                    self.end(End::Interrupted);
                } else if let State::Running(run) = &mut self.state {
                    // A sync byte too many shows in an answer too many.
                    run.hold_us = Some(silent_us);
                    return self.sync(now_us);
                }
                return None;
            }
            None => {}
        }
        if now_us < run.due_us {
            return None;
        }
        if sent == buffer.entries() {
            self.end_stretch();
            return None;
        }
        if let Some((_, event)) = buffer.events.get(run.events).filter(|(tick, _)| *tick <= sent) {
            let event = event.clone();
            self.event_within(now_us, event);
            return self.sync(now_us);
        }
        if now_us < self.wire_free_us() {
            return None;
        }
        match self.frames {
            Some(_) => self.send_frame(now_us),
            None => self.send_sync(now_us),
        }
    }

    fn send_sync(&mut self, now_us: u64) -> Option<Vec<u8>> {
        self.occupy_wire(now_us, 1);
        let deadline_us = self.wire_free_us() + self.sync_wait_us();
        let State::Running(run) = &mut self.state else { return None };
        run.dwells = false;
        run.sent_us = now_us;
        run.deadline_us = Some(deadline_us);
        run.sent += 1;
        Some(vec![frame::SYNC])
    }

    /// The sync byte is out. The clock was read before it was written, and whatever held the host
    /// up in between would bring the next byte too close to this one (H6).
    pub(super) fn sync_sent(&mut self, now_us: u64) {
        if self.frames.is_some() {
            return self.frame_sent(now_us);
        }
        let deadline_us = now_us + self.sync_wait_us();
        let State::Running(run) = &mut self.state else { return };
        if !run.waits() {
            return;
        }
        run.sent_us = run.sent_us.max(now_us);
        run.deadline_us = run.deadline_us.max(Some(deadline_us));
        run.measure(&mut self.pacing, self.timing.tick_us);
    }

    /// From when a sync byte has left the wire until its answer is overdue.
    fn sync_wait_us(&self) -> u64 {
        self.timing.sync_answer_us + self.timing.byte_us() + self.timing.reply_timeout_us
    }

    /// Whether a hold that has been asked for takes effect before the next sync byte. The pairs of
    /// idle nodes stay in phase only after an even number of them; in a dwell a hold costs nothing,
    /// and whoever ends the job there sends one more.
    fn holds_before(&self, run: &Run, buffer: &Buffer) -> bool {
        let slow = |tick: usize| {
            let counts = buffer.counts(tick);
            Axis::ALL.iter().all(|axis| counts[*axis].unsigned_abs() <= self.slow_steps[*axis])
        };
        let slow_here = || run.sent.checked_sub(1).is_none_or(slow) && slow(run.sent);
        let within = self.hold != Hold::No && run.sent < buffer.lines.len();
        let dwells = run.dwells && self.hold != Hold::End;
        let in_phase = self.frames.is_some() || !run.is_odd();
        within && (dwells || (in_phase && (self.hold >= Hold::Now || slow_here())))
    }

    /// A byte has come while the nodes execute.
    pub(super) fn tick_answer(&mut self, now_us: u64, byte: u8) {
        let during = self.tick();
        let (State::Running(run), Some(Step::Buffer(buffer))) = self.run_and_buffer() else {
            return;
        };
        let Some(master) = buffer.master() else { return };
        if !run.waits() {
            // Who has made the master answer again may have made every node step again.
            let axes: Vec<_> = buffer.fills.iter().map(|fill| fill.unit.axis).collect();
            axes.into_iter().for_each(|axis| self.unknown(axis, Doubt::Unasked { got: byte }));
            return self.fail(Fault::Unexpected { got: byte });
        }
        if byte != master.unit.id {
            return self.fail(Fault::WrongAnswer { unit: master.unit, got: byte, during });
        }
        let (tick, ticks, entries) = (run.sent - 1, buffer.lines.len(), master.bytes.len());
        let mut steps_until_us = 0;
        if tick < ticks {
            let counts = buffer.counts(tick);
            let others_step = Axis::ALL.iter().any(|axis| counts[*axis] != 0);
            if codec::decode(master.bytes[tick]) == 0 && others_step {
                steps_until_us = self.steps_until_us(now_us);
            }
            self.progress.line = buffer.lines[tick];
            self.progress.ticks += 1;
            self.progress.at_us = now_us;
            for axis in Axis::ALL {
                self.position[axis] += i64::from(counts[axis]);
            }
        }
        self.quiet(now_us);
        if tick + 1 == entries {
            self.buffers_done += 1;
            self.any_full = false;
            self.state = State::Next;
            return;
        }
        let (quiet_us, period_us) = (self.quiet_until_us, self.timing.tick_us);
        let State::Running(run) = &mut self.state else { return };
        run.deadline_us = None;
        run.answered_us = now_us;
        run.scheduled_us = (tick < ticks).then_some(run.sent_us + period_us);
        run.due_us = run.scheduled_us.unwrap_or(0).max(quiet_us).max(steps_until_us);
    }

    /// Until when nodes step at the latest, if a resting master's answer has come now; but for the
    /// time that the answer has taken on the wire, and that the next sync byte will.
    fn steps_until_us(&self, answered_us: u64) -> u64 {
        let wire_us = 2 * self.timing.byte_us();
        (answered_us + self.timing.node_tick_us).saturating_sub(wire_us)
    }

    pub(super) fn no_tick_answer(&mut self) {
        let during = self.tick();
        let (_, Some(Step::Buffer(buffer))) = self.run_and_buffer() else { return };
        let Some(master) = buffer.master() else { return };
        self.fail(Fault::NoAnswer { unit: master.unit, during });
    }

    /// A tick that has been sent and not acknowledged leaves the axes that it moves in doubt.
    pub(super) fn doubt_sent_tick(&mut self) {
        let (State::Running(run), Some(Step::Buffer(buffer))) = self.run_and_buffer() else {
            return;
        };
        if let Some(tick) = run.sent.checked_sub(1).filter(|_| run.waits()) {
            let (counts, line) = (buffer.counts(tick), buffer.lines.get(tick).copied());
            let doubt = Doubt::Tick { buffer: buffer.number, tick, line: line.unwrap_or(0) };
            let moved = Axis::ALL.into_iter().filter(|axis| counts[*axis] != 0);
            moved.for_each(|axis| self.unknown(Some(axis), doubt));
        }
    }

    /// The tick that was sent last.
    fn tick(&self) -> During {
        let (State::Running(run), Some(Step::Buffer(buffer))) = self.run_and_buffer() else {
            return During::Silence;
        };
        let tick = run.sent.saturating_sub(1);
        let line = buffer.lines.get(tick).or(buffer.lines.last()).copied().unwrap_or(0);
        During::Tick { buffer: buffer.number, tick, line }
    }

    pub(super) fn run_and_buffer(&self) -> (&State, Option<&Step>) {
        let step = match &self.state {
            State::Running(run) => self.job.steps.get(run.step),
            _ => None,
        };
        (&self.state, step)
    }
}
