//! Homing and the raw jog: one node does something by itself, all others are idle.
//!
//! Nothing stops an axis on its way to the switch, so nothing is sent until it answers (H10). A raw
//! jog ends with the next byte (H17): that is sent when its way is made, or the operator stops it,
//! or anything comes that was not asked for.

use crate::base::machine::LISTEN_US;
use crate::wire::direct::{Direct, Home, HomeRun, RawJog};
use crate::wire::frame;
use crate::wire::report::Doubt;

use super::script::{self, Action, Ask, END_PING, Question};
use super::{Hold, Master, MasterEvent, State};

/// Who answers to the end of a ping has taken it for a fill command.
const LISTEN: Action = Action::Rest { us: LISTEN_US as u64 };

/// Times of the homing under way.
#[derive(Debug, Default)]
pub(super) struct HomeTimes {
    /// When the last question had left the wire.
    pub asked_us: u64,
    /// How long each command to home took so far.
    took_us: Vec<u64>,
}

impl HomeTimes {
    /// Whether an axis stands at its switch, and its node has not been asked since.
    pub fn is_open(&self) -> bool {
        !self.took_us.is_empty()
    }
}

/// A raw jog under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Jogging {
    jog: RawJog,
    since_us: u64,
    pub until_us: u64,
}

/// All that it takes. Before and after, the node is asked whether it is in phase. What ends a jog may
/// come as late as an answer may.
pub(super) fn direct(direct: &Direct, late_us: u64) -> Vec<Action> {
    let unit = direct.unit();
    let mut actions = script::ping(unit).to_vec();
    match direct {
        Direct::Home(home) => {
            // A homing command turns into that of a jog by one bit. The zeros would be the feed of
            // that, and the second command homes then; at the switch it makes no step.
            for again in [false, true] {
                let question = Question::Home { again, wait_us: home.wait_us };
                let bytes = frame::home(unit.id).to_vec();
                actions.push(Action::Ask(Ask { unit, bytes, question }));
                actions.push(Action::Say(END_PING.to_vec()));
            }
            actions.extend(script::ping(unit));
            actions.extend([LISTEN, Action::Homed(*home)]);
        }
        Direct::Jog(jog) => {
            let [question, parameters, end, rest] = frame::jog(unit.id, jog.byte());
            // Before it reads on, the node makes the tick under way.
            let us = jog.tick_us + late_us;
            let bytes = question.to_vec();
            actions.push(Action::Ask(Ask { unit, bytes, question: Question::Ping }));
            actions.push(Action::Say(parameters.to_vec()));
            actions.push(Action::Jog(*jog));
            actions.push(Action::Say(end.to_vec()));
            actions.push(Action::Rest { us });
            actions.push(Action::Say(rest.to_vec()));
            actions.extend(script::ping(unit));
            actions.push(LISTEN);
        }
    }
    actions
}

impl Master {
    /// The axis leaves where it stood, if that is what was asked for.
    pub(super) fn begin_homing(&mut self, ask: &Ask) {
        if let (Question::Home { again: false, .. }, Some(axis)) = (ask.question, ask.unit.axis) {
            self.doubts[axis] = Some(Doubt::Homing);
            self.events.push_back(MasterEvent::Homing { axis });
        }
    }

    /// A node has answered that its switch is closed.
    pub(super) fn at_switch(&mut self, now_us: u64) {
        let came_us = now_us.saturating_sub(self.timing.byte_us());
        let took_us = came_us.saturating_sub(self.home_times.asked_us);
        self.home_times.took_us.push(took_us);
    }

    /// The axis stands at its switch, and its node is idle and in phase.
    pub(super) fn homed(&mut self, home: &Home) {
        self.position[home.axis] = home.switch_steps;
        self.doubts[home.axis] = None;
        let run = HomeRun::new(home, &std::mem::take(&mut self.home_times.took_us));
        self.homed.push(run);
        self.events.push_back(MasterEvent::Homed(run));
    }

    /// The node has its feed, as soon as it has left the wire.
    pub(super) fn start_jog(&mut self, jog: RawJog) {
        let since_us = self.wire_free_us();
        let lasts_us = if self.hold == Hold::No { jog.lasts_us } else { 0 };
        self.doubts[jog.axis] = Some(Doubt::RawJog);
        self.events.push_back(MasterEvent::Jogging { axis: jog.axis });
        self.state = State::Jogging(Jogging { jog, since_us, until_us: since_us + lasts_us });
    }

    /// A raw jog ends with the first wish to stop. Who does not want to wait for a switch, as the
    /// second one says, has to switch the node off.
    pub(super) fn hold_direct(&mut self) {
        match &mut self.state {
            State::Jogging(jogging) => jogging.until_us = 0,
            State::Sending { action, sent: 0 } if action.begins_homing() => self.abandon(),
            State::Waiting { ask, .. } if self.hold == Hold::Now && ask.question.lasts_us() > 0 => {
                self.power_cycle = true;
                self.abandon();
            }
            _ => {}
        }
    }

    /// The next byte ends the jog. That was the operator's wish: what is left is in order.
    pub(super) fn end_jog(&mut self, now_us: u64) {
        let State::Jogging(Jogging { jog, since_us, .. }) = &self.state else { return };
        // The tick under way is made whole.
        let ticks = now_us.saturating_sub(*since_us).div_ceil(jog.tick_us.max(1));
        let steps = i64::from(jog.count).saturating_mul(ticks as i64);
        self.position[jog.axis] = self.position[jog.axis].saturating_add(steps);
        self.events.push_back(MasterEvent::Jogged { axis: jog.axis, steps });
        self.hold = Hold::No;
        self.state = State::Next;
    }
}
