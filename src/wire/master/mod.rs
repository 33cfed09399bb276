//! A job → bytes for the bus, answers checked, sync bytes paced: the host, without IO or clock.
//!
//! For each buffer: ping and fill every node that takes part, ping all of them, start, one sync byte a
//! tick, ping all of them. Where nodes take frames: one frame a tick, and nothing is asked or answered.
//! Rules: no question without its answer; sync byte k+1 leaves at max(t_k + period, answer_k), so a
//! late host slides the schedule and never catches up; pads run as fast as answers come. What it
//! cannot see: a servant that missed a byte (H14).
//!
//! # Calling order
//! Round and round: [`Master::handle_bytes`] with what has come, [`Master::handle_timeout`] with a
//! time from before that was looked for, then
//! [`Master::poll_transmit`] until it gives nothing (hand all of it to the port, and tell by
//! [`Master::handle_sent`] when that was done), then
//! [`Master::poll_event`] until it gives nothing. Come back when bytes come, or at
//! [`Master::poll_timeout`] at the latest. Times are microseconds from any origin and never go
//! back. After [`MasterEvent::Ended`] there is nothing left to do.

mod direct;
mod event;
mod frames;
mod run;
mod script;
mod stop;
mod timing;

use std::collections::VecDeque;

use crate::base::machine::{LISTEN_US, Protocol, Unit};
use crate::base::{Axis, AxisMap, AxisSet, Event, Machine};
use crate::wire::direct::HomeRun;
use crate::wire::frame;
use crate::wire::job::{Job, Step};
use crate::wire::node::ANSWER_PAUSE_US;
use crate::wire::pacing::Pacing;
use crate::wire::report::{Doubt, End, Ending, Fault};

use self::direct::{HomeTimes, Jogging};
use self::run::Run;
use self::script::{Action, Ask, Question};
pub use self::timing::Timing;

/// What the master tells its caller.
#[derive(Clone, Debug, PartialEq)]
pub enum MasterEvent {
    /// A dwell of the program, which the master keeps.
    Dwell(Event),
    /// An event of the program: something has to be done. All axes rest, and nothing is sent until
    /// [`Master::event_done`], or the job ends with [`Master::event_failed`].
    Event(Event),
    /// The same, for an event that waits for a person: all nodes are idle too.
    Pause(Event),
    /// A node takes its buffer.
    Filling {
        /// The buffer.
        buffer: u32,
        /// The node.
        unit: Unit,
        /// It will answer every tick.
        master: bool,
    },
    /// The nodes have been started.
    Started {
        /// The buffer.
        buffer: u32,
    },
    /// A buffer has been executed to its end, and every node in it has answered since.
    Seam {
        /// The buffer.
        buffer: u32,
        /// Steps of the job that are done with it.
        steps: usize,
        /// Ticks acknowledged so far, pads not counted.
        ticks: u64,
        /// Where the machine stands, in motor steps.
        position: AxisMap<i64>,
    },
    /// A hold took effect: the axes rest. Go on with [`Master::resume`] or end with
    /// [`Master::abandon`].
    Held {
        /// NC line of what comes next.
        line: u32,
        /// Ticks acknowledged so far, pads not counted.
        ticks: u64,
        /// Within a buffer: nodes would take any byte for a tick of it.
        executing: bool,
    },
    /// An axis is sent to its limit switch.
    Homing {
        /// The axis.
        axis: Axis,
    },
    /// An axis stands at its limit switch.
    Homed(HomeRun),
    /// A node jogs by itself, until it is told something else.
    Jogging {
        /// Its axis.
        axis: Axis,
    },
    /// It jogs no more.
    Jogged {
        /// Its axis.
        axis: Axis,
        /// Signed steps that it has made by the clock: no node has told.
        steps: i64,
    },
    /// It is over.
    Ended(Ending),
}

/// How far a job is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Progress {
    /// Ticks acknowledged, pads not counted.
    pub ticks: u64,
    /// Buffer being filled or executed.
    pub buffer: u32,
    /// NC line being executed.
    pub line: u32,
    /// When the last of the ticks was acknowledged.
    pub at_us: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd)]
enum Hold {
    No,
    /// Where all axes are slow enough to stop without a ramp.
    AtRest,
    /// At the next tick that keeps the pairs of idle nodes in phase.
    Now,
    /// There too, and the job ends.
    End,
}

#[derive(Debug)]
enum State {
    /// Nothing is under way.
    Next,
    Sending {
        action: Action,
        sent: usize,
    },
    Waiting {
        ask: Ask,
        deadline_us: u64,
    },
    Running(Run),
    /// Until somebody says how to go on, which is with that.
    Held(Box<State>),
    Dwelling {
        until_us: u64,
    },
    /// An event between buffers is under way.
    Paused,
    Resting {
        until_us: u64,
    },
    Jogging(Jogging),
    Ended,
}

/// The host's side of the bus. See the module's head.
#[derive(Debug)]
pub struct Master {
    job: Job,
    timing: Timing,
    /// Axes that have a node, and their steps a mm.
    axes: Vec<(Axis, f64)>,
    slow_steps: AxisMap<u32>,
    /// Entries of a node's buffer.
    entries: usize,
    state: State,
    script: VecDeque<Action>,
    /// Step of the job that comes next.
    step: usize,
    /// When the last byte handed out has left the wire.
    wire_free_ns: u64,
    /// The nodes still pause after an answer.
    quiet_until_us: u64,
    hold: Hold,
    /// When the event under way was reached.
    event_us: u64,
    /// What failed, while the script still puts the nodes in order.
    fault: Option<Fault>,
    /// Some nodes hold a buffer that has not been executed to its end.
    any_full: bool,
    power_cycle: bool,
    /// Why an axis's position is unknown.
    doubts: AxisMap<Option<Doubt>>,
    /// Servants that have been started and not been asked since.
    unconfirmed: AxisSet,
    position: AxisMap<i64>,
    progress: Progress,
    home_times: HomeTimes,
    homed: Vec<HomeRun>,
    buffers_done: u64,
    pacing: Pacing,
    events: VecDeque<MasterEvent>,
    /// Where nodes take frames and cannot answer: the axes that have been moved.
    frames: Option<AxisSet>,
}

impl Master {
    /// A master for a job that [`crate::wire::lint()`] has proved.
    pub fn new(job: Job, machine: &Machine, timing: Timing) -> Self {
        let tick_s = machine.bus.tick_s();
        let slow_steps = AxisMap::from_fn(|axis| {
            let profile = machine.axis(axis);
            profile.map_or(0, |p| (p.start_speed_mm_s * tick_s * p.steps_per_mm) as u32)
        });
        let with_node =
            machine.axes.iter().filter(|profile| machine.bus.nodes.contains_key(&profile.axis));
        Master {
            position: job.start_steps,
            timing,
            axes: with_node
                .filter(|p| job.axes.contains(p.axis))
                .map(|profile| (profile.axis, profile.steps_per_mm))
                .collect(),
            slow_steps,
            entries: machine.bus.buffer_ticks as usize,
            state: State::Next,
            script: VecDeque::new(),
            step: 0,
            wire_free_ns: 0,
            quiet_until_us: 0,
            hold: Hold::No,
            event_us: 0,
            fault: None,
            any_full: false,
            power_cycle: false,
            doubts: AxisMap::from_fn(|axis| job.unknown.contains(axis).then_some(Doubt::Untold)),
            unconfirmed: AxisSet::EMPTY,
            progress: Progress::default(),
            home_times: HomeTimes::default(),
            homed: Vec::new(),
            buffers_done: 0,
            pacing: Pacing::new(timing.tick_us),
            events: VecDeque::new(),
            frames: (machine.bus.protocol == Protocol::Frame).then_some(AxisSet::EMPTY),
            job,
        }
    }

    /// Takes what has come from the bus.
    pub fn handle_bytes(&mut self, now_us: u64, bytes: &[u8]) {
        for byte in bytes {
            self.handle_byte(now_us, *byte);
        }
    }

    /// Sees to time-outs and to the ends of dwells.
    pub fn handle_timeout(&mut self, now_us: u64) {
        match &self.state {
            State::Waiting { ask, deadline_us } if now_us >= *deadline_us => {
                let ask = ask.clone();
                self.no_answer(ask);
            }
            State::Running(run) if run.is_overdue(now_us) => self.no_tick_answer(),
            State::Dwelling { until_us } if now_us >= *until_us => self.state = State::Next,
            State::Resting { until_us } if now_us >= *until_us => self.state = State::Next,
            State::Jogging(jogging) if now_us >= jogging.until_us => self.end_jog(now_us),
            _ => {}
        }
        self.settle(now_us);
    }

    /// The next bytes for the port, if it is time for them. Once they have been
    /// written, [`Master::handle_sent`] has to be told.
    pub fn poll_transmit(&mut self, now_us: u64) -> Option<Vec<u8>> {
        self.settle(now_us);
        if let State::Running(_) = self.state {
            return self.sync(now_us);
        }
        if now_us < self.send_from_us() {
            return None;
        }
        let State::Sending { action, sent } = &mut self.state else { return None };
        let rest = action.bytes().get(*sent..).unwrap_or_default();
        let last = usize::from(action.is_data() && rest.len() > 1);
        let piece = rest[..self.timing.piece_bytes.min(rest.len() - last)].to_vec();
        *sent += piece.len();
        let all_sent = *sent == action.bytes().len();
        if action.is_fill_command() {
            self.pacing.fill_begins(now_us);
        }
        self.occupy_wire(now_us, piece.len());
        if all_sent {
            self.sent();
        }
        Some(piece)
    }

    /// The bytes handed out last have been written. A host that was held up before it could write
    /// them is late: the next sync byte and the time-outs count from here.
    pub fn handle_sent(&mut self, now_us: u64) {
        let answer_us = self.timing.byte_us() + self.timing.reply_timeout_us;
        match &mut self.state {
            State::Waiting { ask, deadline_us } => {
                let answer_us = answer_us + ask.question.lasts_us();
                *deadline_us = (*deadline_us).max(now_us + answer_us);
                self.home_times.asked_us = self.home_times.asked_us.max(now_us);
            }
            State::Running(_) => self.sync_sent(now_us),
            _ => {}
        }
    }

    /// When to call again, if no bytes come before; none while an event or a person is waited for.
    pub fn poll_timeout(&self) -> Option<u64> {
        match &self.state {
            State::Next => Some(0),
            State::Sending { .. } => Some(self.send_from_us()),
            State::Waiting { deadline_us, .. } => Some(*deadline_us),
            State::Running(run) if run.is_paused() => None,
            State::Running(run) => Some(run.timeout_us(self.wire_free_us())),
            State::Dwelling { until_us } | State::Resting { until_us } => Some(*until_us),
            State::Jogging(jogging) => Some(jogging.until_us),
            State::Held(_) | State::Paused | State::Ended => None,
        }
    }

    /// From when on an answer may come, if one is waited for, or listened for.
    pub fn answer_from_us(&self) -> Option<u64> {
        let waits = match &self.state {
            State::Waiting { .. } => true,
            State::Sending { action, sent } => action.is_last_of_data(*sent),
            State::Running(run) => run.waits(),
            _ => false,
        };
        waits.then(|| self.wire_free_us())
    }

    /// What there is to tell.
    pub fn poll_event(&mut self) -> Option<MasterEvent> {
        self.events.pop_front()
    }

    /// How far the job is.
    pub fn progress(&self) -> Progress {
        self.progress
    }

    /// Where the machine stands, in motor steps, as far as acknowledged.
    pub fn position_steps(&self) -> &AxisMap<i64> {
        &self.position
    }

    /// The job.
    pub fn job(&self) -> &Job {
        &self.job
    }

    /// Gives the job back.
    pub fn into_job(self) -> Job {
        self.job
    }

    fn handle_byte(&mut self, now_us: u64, byte: u8) {
        match &self.state {
            State::Ended => {}
            _ if self.frames.is_some() => self.fail(Fault::Unexpected { got: byte }),
            State::Waiting { ask, .. } => {
                let ask = ask.clone();
                if self.is_early(now_us) {
                    self.early(&ask, byte);
                } else if byte == ask.unit.id {
                    self.quiet(now_us);
                    self.measure_fill(now_us, &ask);
                    self.answered(now_us, ask);
                } else {
                    self.wrong_answer(ask, byte);
                }
            }
            State::Sending { action: Action::Ask(ask), .. } => {
                let ask = ask.clone();
                self.early(&ask, byte);
            }
            State::Running(_) => self.tick_answer(now_us, byte),
            State::Held(_) => {
                if let State::Held(then) = std::mem::replace(&mut self.state, State::Next) {
                    self.state = *then;
                }
                return self.handle_byte(now_us, byte);
            }
            state => {
                self.power_cycle |= matches!(state, State::Sending { .. } | State::Resting { .. });
                self.fail(Fault::Unexpected { got: byte });
            }
        }
        self.settle(now_us);
    }

    /// Begins what comes next, until something is under way.
    fn settle(&mut self, now_us: u64) {
        while let State::Next = self.state {
            if self.hold != Hold::No && self.may_stop() {
                return self.hold_between();
            }
            match self.script.pop_front() {
                Some(Action::Seam { buffer, steps }) => {
                    let (ticks, position) = (self.progress.ticks, self.position);
                    self.events.push_back(MasterEvent::Seam { buffer, steps, ticks, position });
                }
                Some(Action::Run { step }) => self.start_run(now_us, step),
                Some(Action::Homed(home)) => self.homed(&home),
                Some(Action::Jog(jog)) => self.start_jog(jog),
                Some(Action::Rest { us }) => {
                    let until_us = self.wire_free_us().max(now_us) + us;
                    self.state = State::Resting { until_us };
                }
                Some(action) => {
                    self.announce(&action);
                    self.state = State::Sending { action, sent: 0 };
                }
                None => self.next_step(now_us),
            }
        }
    }

    fn next_step(&mut self, now_us: u64) {
        if let Some(fault) = self.fault.take() {
            return self.end(End::Failed(fault));
        }
        let at = self.step;
        self.step += 1;
        match self.job.steps.get(at) {
            Some(Step::Event(event)) => {
                let event = event.clone();
                self.event(now_us, event);
            }
            Some(Step::Buffer(buffer)) if self.frames.is_some() => {
                self.script.extend(frames::stretch(buffer, at));
            }
            Some(Step::Buffer(buffer)) => {
                if self.buffers_done == 0 {
                    self.script.extend(self.job.nodes.iter().flat_map(|node| script::ping(*node)));
                }
                self.script.extend(script::buffer(buffer, at));
            }
            Some(Step::Direct(direct)) => {
                if at == 0 {
                    self.script.extend(self.job.nodes.iter().flat_map(|node| script::ping(*node)));
                }
                self.script.extend(direct::direct(direct, self.timing.reply_timeout_us));
            }
            None => self.end(End::Done),
        }
    }

    fn announce(&mut self, action: &Action) {
        let Action::Ask(Ask { unit, bytes, question }) = action else { return };
        if let Question::FillCommand { buffer, .. } = *question {
            self.progress.buffer = buffer;
            let master = *bytes == frame::fill(unit.id, true);
            self.events.push_back(MasterEvent::Filling { buffer, unit: *unit, master });
        }
    }

    /// All bytes of an action have been handed out.
    fn sent(&mut self) {
        let State::Sending { action, .. } = std::mem::replace(&mut self.state, State::Next) else {
            return;
        };
        if let Action::Ask(ask) = action {
            self.begin_homing(&ask);
            let wait_us = self.timing.byte_us() + self.timing.reply_timeout_us;
            let wait_us = wait_us + ask.question.lasts_us();
            self.home_times.asked_us = self.wire_free_us();
            self.state = State::Waiting { ask, deadline_us: self.wire_free_us() + wait_us };
        }
    }

    fn occupy_wire(&mut self, now_us: u64, bytes: usize) {
        let wire_ns = self.timing.byte_ns * bytes as u64;
        self.wire_free_ns = self.wire_free_ns.max(now_us * 1000) + wire_ns;
    }

    fn wire_free_us(&self) -> u64 {
        self.wire_free_ns.div_ceil(1000)
    }

    /// A frame waits for the wire: its answer's time counts from then on. Within long ones one
    /// piece may wait while another is on the wire.
    fn send_from_us(&self) -> u64 {
        let piece_us = self.timing.byte_ns * self.timing.piece_bytes as u64 / 1000;
        let from_us = match &self.state {
            State::Sending { action, sent } if action.is_last_of_data(*sent) => {
                self.wire_free_us() + u64::from(LISTEN_US)
            }
            State::Sending { sent: 1.., .. } => self.wire_free_us().saturating_sub(piece_us),
            _ => self.wire_free_us(),
        };
        self.quiet_until_us.max(from_us)
    }

    /// A node pauses from its answer's start bit on; part of that has passed on the wire (H10).
    fn quiet(&mut self, now_us: u64) {
        let rest_us = ANSWER_PAUSE_US.saturating_sub(self.timing.byte_us());
        self.quiet_until_us = now_us + rest_us;
    }

    fn measure_fill(&mut self, now_us: u64, ask: &Ask) {
        if let Question::FillData { .. } = ask.question {
            let bytes = frame::fill(ask.unit.id, true).len() + ask.bytes.len();
            self.pacing.filled(now_us, self.timing.byte_ns * bytes as u64);
        }
    }

    /// Before all bytes can have left the wire. The last two may have come in no time: a
    /// pseudo-terminal has no wire.
    fn is_early(&self, now_us: u64) -> bool {
        now_us + 2 * self.timing.byte_us() < self.wire_free_us()
    }
}

fn dwell_us(seconds: f64) -> u64 {
    (seconds.max(0.0) * 1e6) as u64
}
