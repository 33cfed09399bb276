//! Small exchanges that the master strings together, and what it does when one goes wrong (H7).

use crate::base::machine::Unit;
use crate::wire::direct::{Home, RawJog};
use crate::wire::frame;
use crate::wire::job::Buffer;
use crate::wire::report::{Doubt, During, Fault};

use super::{Master, State};

/// One thing to do on the bus.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Action {
    /// Bytes without an answer.
    Say(Vec<u8>),
    /// Bytes that a node answers with its ID.
    Ask(Ask),
    /// The start pair.
    Start,
    /// One sync byte after another, for a buffer of the job.
    Run { step: usize },
    /// An axis has been sent to its switch, and its node has answered all that it was asked.
    Homed(Home),
    /// A node jogs from here on.
    Jog(RawJog),
    /// Silence: a node reads nothing for so long.
    Rest { us: u64 },
    /// Nothing: a buffer and all that belongs to it is over.
    Seam { buffer: u32, steps: usize },
}

/// Bytes that a node answers with its ID.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Ask {
    pub unit: Unit,
    pub bytes: Vec<u8>,
    pub question: Question,
}

/// What the bytes of an [`Ask`] are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Question {
    Ping,
    FillCommand {
        buffer: u32,
        last_try: bool,
    },
    FillData {
        buffer: u32,
    },
    /// The way to the limit switch, which takes as long as this at most.
    Home {
        again: bool,
        wait_us: u64,
    },
    /// One 0 after an unanswered question: does it complete a pair of a node out of phase?
    Pad {
        during: During,
    },
    /// Zeros for a node that was filled by mistake.
    Drain {
        during: During,
    },
}

impl Question {
    fn during(self) -> During {
        match self {
            Question::Ping => During::Ping,
            Question::FillCommand { buffer, .. } => During::FillCommand { buffer },
            Question::FillData { buffer } => During::FillData { buffer },
            Question::Home { .. } => During::Homing,
            Question::Pad { during } | Question::Drain { during } => during,
        }
    }
}

impl Question {
    /// How long what was asked for takes at most, before the node answers.
    pub(super) fn lasts_us(self) -> u64 {
        if let Question::Home { wait_us, .. } = self { wait_us } else { 0 }
    }
}

impl Action {
    pub(super) fn bytes(&self) -> &[u8] {
        match self {
            Action::Say(bytes) => bytes,
            Action::Ask(ask) => &ask.bytes,
            Action::Start => &frame::START,
            Action::Run { .. }
            | Action::Homed(_)
            | Action::Jog(_)
            | Action::Rest { .. }
            | Action::Seam { .. } => &[],
        }
    }

    /// Whether a node takes the bytes as its buffer.
    pub(super) fn is_data(&self) -> bool {
        let Action::Ask(ask) = self else { return false };
        matches!(ask.question, Question::FillData { .. } | Question::Drain { .. })
    }

    /// Whether it tells a node to take a buffer.
    pub(super) fn is_fill_command(&self) -> bool {
        matches!(self, Action::Ask(Ask { question: Question::FillCommand { .. }, .. }))
    }

    /// Whether all but one byte of a node's buffer have been sent.
    pub(super) fn is_last_of_data(&self, sent: usize) -> bool {
        self.is_data() && sent > 0 && sent + 1 == self.bytes().len()
    }

    /// Whether an axis leaves where it stands.
    pub(super) fn begins_homing(&self) -> bool {
        let Action::Ask(ask) = self else { return false };
        matches!(ask.question, Question::Home { again: false, .. })
    }

    /// Whether nothing of an exchange before it is open.
    pub(super) fn begins_exchange(&self) -> bool {
        match self {
            Action::Ask(ask) => {
                matches!(
                    ask.question,
                    Question::Ping
                        | Question::FillCommand { last_try: false, .. }
                        | Question::Home { again: false, .. }
                )
            }
            Action::Start => true,
            Action::Say(_)
            | Action::Run { .. }
            | Action::Homed(_)
            | Action::Jog(_)
            | Action::Rest { .. }
            | Action::Seam { .. } => false,
        }
    }
}

/// Asks a node whether it is there, idle and in phase.
pub(super) fn ping(unit: Unit) -> [Action; 2] {
    let [question, rest @ ..] = frame::ping(unit.id);
    let ask = Ask { unit, bytes: question.to_vec(), question: Question::Ping };
    [Action::Ask(ask), Action::Say(rest.concat())]
}

/// All that a buffer takes. A node that has taken a byte too many or too few shows it in the ping
/// before the start, when nothing has moved yet, or in the one after the buffer.
pub(super) fn buffer(buffer: &Buffer, step: usize) -> Vec<Action> {
    let mut actions = Vec::with_capacity(8 * buffer.fills.len() + 3);
    let number = buffer.number;
    for fill in &buffer.fills {
        let unit = fill.unit;
        actions.extend(ping(unit));
        let bytes = frame::fill(unit.id, fill.master).to_vec();
        let question = Question::FillCommand { buffer: number, last_try: false };
        actions.push(Action::Ask(Ask { unit, bytes, question }));
        let question = Question::FillData { buffer: number };
        actions.push(Action::Ask(Ask { unit, bytes: fill.bytes.clone(), question }));
    }
    let pings = || buffer.fills.iter().flat_map(|fill| ping(fill.unit));
    actions.extend(pings());
    actions.extend([Action::Start, Action::Run { step }]);
    actions.extend(pings());
    actions.push(Action::Seam { buffer: number, steps: step + 1 });
    actions
}

impl Master {
    /// A node has answered its ID.
    pub(super) fn answered(&mut self, now_us: u64, ask: Ask) {
        self.state = State::Next;
        match ask.question {
            Question::Ping => {
                if let Some(axis) = ask.unit.axis {
                    self.unconfirmed.remove(axis);
                }
            }
            Question::FillCommand { .. } => {}
            Question::Home { .. } => self.at_switch(now_us),
            Question::FillData { .. } => self.any_full = true,
            // It had been out of phase, and takes what follows as its buffer.
            Question::Pad { during } => {
                let unit = ask.unit;
                let bytes = vec![0; self.entries];
                let question = Question::Drain { during };
                self.power_cycle = true;
                self.fail(Fault::NoAnswer { unit, during });
                self.script.push_back(Action::Ask(Ask { unit, bytes, question }));
            }
            Question::Drain { .. } => {}
        }
    }

    /// A node has not answered in time. Every way out sends an even number of bytes.
    pub(super) fn no_answer(&mut self, ask: Ask) {
        self.state = State::Next;
        let during = ask.question.during();
        let fault = Fault::NoAnswer { unit: ask.unit, during };
        let question = Question::Pad { during };
        let pad = Action::Ask(Ask { bytes: vec![frame::SYNC], question, ..ask.clone() });
        match ask.question {
            Question::Ping => {
                self.doubt(ask.unit);
                self.fail(fault);
                self.script.push_back(pad);
            }
            Question::FillCommand { buffer, last_try } => {
                if last_try {
                    self.power_cycle = true;
                    self.fail(fault);
                } else {
                    let question = Question::FillCommand { buffer, last_try: true };
                    self.script.push_front(Action::Ask(Ask { question, ..ask }));
                }
                self.script.push_front(pad);
            }
            // Nothing is said to an axis that may still be running (H10).
            Question::FillData { .. } | Question::Drain { .. } | Question::Home { .. } => {
                self.power_cycle = true;
                self.fail(fault);
            }
            // If all that was lost is the answer to a ping, a jog waits for its parameters.
            Question::Pad { .. } => {
                let rest = if self.fault.is_some() { &END_PING[1..] } else { &[frame::SYNC] };
                self.script.push_front(Action::Say(rest.to_vec()));
            }
        }
    }

    /// Another byte than the node's ID has come.
    pub(super) fn wrong_answer(&mut self, ask: Ask, got: u8) {
        let during = ask.question.during();
        self.power_cycle |= during != During::Ping;
        if ask.question == Question::Ping {
            self.doubt(ask.unit);
        }
        if during == During::Homing {
            // Who answers may have been sent to its switch instead.
            let other = self.job.nodes.iter().find(|unit| unit.id == got).copied();
            other.into_iter().for_each(|unit| self.doubt(unit));
        }
        self.fail(Fault::WrongAnswer { unit: ask.unit, got, during });
    }

    /// A byte has come before the question was out.
    pub(super) fn early(&mut self, ask: &Ask, got: u8) {
        self.power_cycle = true;
        self.fail(match ask.question {
            Question::FillData { .. } => Fault::Early { unit: ask.unit, got },
            _ => Fault::Unexpected { got },
        });
    }

    /// What a fault leaves open: whoever has heard a ping waits for a jog's parameters, and would
    /// take the first bytes of the next job for them; a raw jog goes on until a byte comes.
    pub(super) fn left_open(&self) -> Option<Action> {
        let end: &[u8] = match &self.state {
            _ if self.frames.is_some() => return None,
            State::Waiting { ask, .. } if ask.question == Question::Ping => &END_PING,
            State::Sending { action: Action::Say(_), .. } => &END_PING,
            // More than a receiver keeps would come before the node has made its tick.
            State::Jogging(_) => &END_PING[..2],
            _ => return None,
        };
        Some(Action::Say(end.to_vec()))
    }

    /// A node that does not answer a ping may be off, busy with a tick that others have done, or on
    /// its way to the limit switch.
    fn doubt(&mut self, unit: Unit) {
        self.unknown(unit.axis, Doubt::Ping);
    }
}

/// Ends whatever a ping may have begun: a jog's parameters, a feed of 0 even if bytes are lost, and
/// the jog. To everybody else pairs that mean nothing.
pub(super) const END_PING: [u8; 6] = {
    let [first, second] = frame::END_JOG;
    [0, 0, 0, 0, first, second]
};
