//! Events of the program: the axes rest, and nothing is sent until whoever does them is done.

use crate::base::machine::LISTEN_US;
use crate::base::{Event, EventKind};
use crate::wire::report::{End, Fault};

use super::{Master, MasterEvent, State, dwell_us};

impl Master {
    /// What a [`MasterEvent::Event`] or a [`MasterEvent::Pause`] asks for has been done. If that took time,
    /// what has come from the bus since is heard first.
    pub fn event_done(&mut self, now_us: u64) {
        if !self.waits_for_event() {
            return;
        }
        let took_time = now_us > self.event_us + u64::from(LISTEN_US);
        let from_us = now_us + if took_time { u64::from(LISTEN_US) } else { 0 };
        self.quiet_until_us = self.quiet_until_us.max(from_us);
        match &mut self.state {
            State::Running(run) => run.go_on(from_us),
            state => *state = State::Next,
        }
    }

    /// Whether an event is under way.
    pub fn waits_for_event(&self) -> bool {
        match &self.state {
            State::Paused => true,
            State::Running(run) => run.is_paused(),
            _ => false,
        }
    }

    /// The operator ends the job during an event, where the axes rest. No tick more is sent, though
    /// that leaves nodes that are not filled out of phase after an odd number of them: nodes that are
    /// have to be switched off anyway, and what comes next would be motion.
    pub fn event_stopped(&mut self) {
        self.end(End::Interrupted);
    }

    /// What an event asks for cannot be done: the job ends where the axes rest, as when it is stopped.
    pub fn event_failed(&mut self, event: &Event, reason: String) {
        let (line, kind) = (event.line, event.kind.to_string());
        self.end(End::Failed(Fault::Event { line, event: kind, reason }));
    }

    /// An event between buffers: all nodes are idle.
    pub(super) fn event(&mut self, now_us: u64, event: Event) {
        self.progress.line = event.line;
        if let EventKind::Dwell(seconds) = event.kind {
            self.state = State::Dwelling { until_us: now_us.saturating_add(dwell_us(seconds)) };
            return self.events.push_back(MasterEvent::Dwell(event));
        }
        self.event_us = now_us;
        self.state = State::Paused;
        let waits = event.kind.waits_for_person();
        let tell = if waits { MasterEvent::Pause } else { MasterEvent::Event };
        self.events.push_back(tell(event));
    }

    /// An event within a buffer: the nodes wait for the next sync byte.
    pub(super) fn event_within(&mut self, now_us: u64, event: Event) {
        let State::Running(run) = &mut self.state else { return };
        if let EventKind::Dwell(seconds) = event.kind {
            run.reach_event(now_us, Some(dwell_us(seconds)));
            return self.events.push_back(MasterEvent::Dwell(event));
        }
        run.reach_event(now_us, None);
        self.event_us = now_us;
        self.events.push_back(MasterEvent::Event(event));
    }
}
