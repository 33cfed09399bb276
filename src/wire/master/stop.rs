//! Holds, resumes and ends: where the axes may stop, how the job goes on from there, and what is
//! known of each axis when it does not.

use crate::base::Axis;
use crate::base::machine::LISTEN_US;
use crate::wire::job::Step;
use crate::wire::report::{AxisEnd, Doubt, End, Ending, Fault, Position};

use super::script::Action;
use super::{Hold, Master, MasterEvent, State};

impl Master {
    /// The operator wants motion to stop. The first call holds where all axes are slow enough to
    /// stop without a ramp, or at the end of the buffer; the second as soon as the protocol allows.
    /// [`MasterEvent::Held`] says that it took effect.
    pub fn hold(&mut self) {
        self.hold = match self.hold {
            Hold::No => Hold::AtRest,
            Hold::AtRest | Hold::Now => Hold::Now,
            Hold::End => Hold::End,
        };
        self.hold_direct();
        if let State::Dwelling { .. } = self.state {
            let line = self.progress.line;
            self.hold_here(line, false);
        }
    }

    /// Goes on after a [`MasterEvent::Held`]: within a buffer with the
    /// sync bytes that are left. A dwell under way has gone on meanwhile. What has come from the bus
    /// since is heard first.
    pub fn resume(&mut self, now_us: u64) {
        self.hold = Hold::No;
        let from_us = now_us + u64::from(LISTEN_US);
        self.quiet_until_us = self.quiet_until_us.max(from_us);
        match std::mem::replace(&mut self.state, State::Next) {
            State::Held(then) => self.state = *then,
            other => self.state = other,
        }
        if let State::Running(run) = &mut self.state {
            run.resume(from_us);
        }
    }

    /// Ends the job where it stands. In a dwell within a buffer that may take the tick behind it
    /// first: an odd number of sync bytes would leave idle nodes with half a pair.
    pub fn abandon(&mut self) {
        if let State::Held(then) = std::mem::replace(&mut self.state, State::Next) {
            self.state = *then;
        }
        if let State::Running(run) = &mut self.state
            && self.frames.is_none()
            && run.is_odd()
        {
            self.hold = Hold::End;
            return run.resume_at_once();
        }
        self.doubt_sent_tick();
        self.end(End::Interrupted);
    }

    /// Ends the job: the port is gone. A node that was in the middle of a ping or a fill would take
    /// the next host's first bytes for the rest of it.
    pub fn fail_port(&mut self, why: String) {
        let is_open = |state: &State| {
            matches!(state, State::Sending { .. } | State::Waiting { .. } | State::Jogging(_))
        };
        // A node with half a frame stops when the next one comes.
        let half_frame = self.frames.is_some() && matches!(self.state, State::Running(_));
        self.power_cycle |= half_frame || is_open(&self.state);
        self.doubt_sent_tick();
        self.end(End::Failed(Fault::Port(why)));
    }

    /// What is known of every axis that has a node.
    pub fn axes(&self) -> Vec<AxisEnd> {
        let power_cycle = self.needs_power_cycle();
        let position = |axis| match power_cycle {
            _ if self.doubts[axis].is_some() => (Position::Unknown, self.doubts[axis]),
            _ if self.unconfirmed.contains(axis) => (Position::Unconfirmed, Some(Doubt::NotAsked)),
            true => (Position::KnownUntilPowerOff, None),
            false if self.frames.is_some_and(|moved| moved.contains(axis)) => {
                (Position::KnownAsSent, None)
            }
            false => (Position::Known, None),
        };
        let axis_end = |(axis, steps_per_mm): &(Axis, f64)| {
            let steps = self.position[*axis];
            let position_mm = steps as f64 / steps_per_mm;
            let (position, why) = position(*axis);
            let counted = !(self.job.unknown.contains(*axis) && why.is_some());
            AxisEnd { axis: *axis, steps, position_mm, counted, position, why }
        };
        self.axes.iter().map(axis_end).collect()
    }

    /// Between two exchanges, but never within a ping, nor once a node waits for its data, nor
    /// before all servants have said that they are done, nor when all is done.
    pub(super) fn may_stop(&self) -> bool {
        let front = self.script.front();
        let is_last = front.is_none() && self.step >= self.job.steps.len();
        let between = front.is_none_or(Action::begins_exchange);
        let is_open = !self.unconfirmed.is_empty() || self.home_times.is_open();
        self.fault.is_none() && !is_open && between && !is_last
    }

    /// A hold takes effect between two exchanges.
    pub(super) fn hold_between(&mut self) {
        if self.hold == Hold::End {
            return self.end(End::Interrupted);
        }
        let at = self.step - usize::from(!self.script.is_empty());
        let line = match self.job.steps.get(at) {
            Some(Step::Buffer(buffer)) => buffer.lines.first().copied().unwrap_or(0),
            Some(Step::Event(event)) => event.line,
            Some(Step::Direct(_)) | None => 0,
        };
        self.hold_here(line, false);
    }

    pub(super) fn hold_here(&mut self, line: u32, executing: bool) {
        let then = std::mem::replace(&mut self.state, State::Next);
        self.state = State::Held(Box::new(then));
        let ticks = self.progress.ticks;
        self.events.push_back(MasterEvent::Held { line, ticks, executing });
    }

    pub(super) fn unknown(&mut self, axis: Option<Axis>, doubt: Doubt) {
        if let Some(axis) = axis {
            let first = self.doubts[axis].filter(|known| *known != Doubt::Untold);
            self.doubts[axis] = first.or(Some(doubt));
        }
    }

    /// Stops after a fault, with nothing more sent than the script still holds.
    pub(super) fn fail(&mut self, fault: Fault) {
        self.doubt_sent_tick();
        self.script.clear();
        self.script.extend(self.left_open());
        self.fault.get_or_insert(fault);
        self.state = State::Next;
    }

    pub(super) fn end(&mut self, end: End) {
        if let State::Ended = self.state {
            return;
        }
        let (axes, power_cycle) = (self.axes(), self.needs_power_cycle());
        self.script.clear();
        self.state = State::Ended;
        self.events.push_back(MasterEvent::Ended(Ending {
            end,
            ticks: self.progress.ticks,
            buffers: self.buffers_done,
            line: self.progress.line,
            axes,
            homed: std::mem::take(&mut self.homed),
            power_cycle,
            pacing: self.pacing.clone(),
        }));
    }

    fn needs_power_cycle(&self) -> bool {
        self.power_cycle || self.any_full || !self.unconfirmed.is_empty()
    }
}
