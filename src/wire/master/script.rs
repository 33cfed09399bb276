//! Small exchanges that the master strings together, and what it does when one goes wrong (H7).

use crate::base::machine::Unit;
use crate::wire::frame;
use crate::wire::job::Buffer;
use crate::wire::report::{Doubt, During, Fault};

use super::Master;

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
            Question::Pad { during } | Question::Drain { during } => during,
        }
    }
}

impl Action {
    pub(super) fn bytes(&self) -> &[u8] {
        match self {
            Action::Say(bytes) => bytes,
            Action::Ask(ask) => &ask.bytes,
            Action::Start => &frame::START,
            Action::Run { .. } | Action::Seam { .. } => &[],
        }
    }

    /// Whether a node takes the bytes as its buffer.
    pub(super) fn is_data(&self) -> bool {
        let Action::Ask(ask) = self else { return false };
        matches!(ask.question, Question::FillData { .. } | Question::Drain { .. })
    }

    /// Whether all but one byte of a node's buffer have been sent.
    pub(super) fn is_last_of_data(&self, sent: usize) -> bool {
        self.is_data() && sent > 0 && sent + 1 == self.bytes().len()
    }

    /// Whether nothing of an exchange before it is open.
    pub(super) fn begins_exchange(&self) -> bool {
        match self {
            Action::Ask(ask) => {
                matches!(
                    ask.question,
                    Question::Ping | Question::FillCommand { last_try: false, .. }
                )
            }
            Action::Start => true,
            Action::Say(_) | Action::Run { .. } | Action::Seam { .. } => false,
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
    pub(super) fn answered(&mut self, ask: Ask) {
        self.state = super::State::Next;
        match ask.question {
            Question::Ping => {
                if let Some(axis) = ask.unit.axis {
                    self.unconfirmed.remove(axis);
                }
            }
            Question::FillCommand { .. } => {}
            Question::FillData { .. } => self.any_full = true,
            // It had been out of phase, and takes what follows as its buffer.
            Question::Pad { during } => {
                let unit = ask.unit;
                let bytes = vec![0; self.entries()];
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
        self.state = super::State::Next;
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
            Question::FillData { .. } | Question::Drain { .. } => {
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
    /// take the first bytes of the next job for them.
    pub(super) fn left_open(&self) -> Option<Action> {
        let open = match &self.state {
            super::State::Waiting { ask, .. } => ask.question == Question::Ping,
            super::State::Sending { action: Action::Say(_), .. } => true,
            _ => false,
        };
        open.then(|| Action::Say(END_PING.to_vec()))
    }

    /// A node that does not answer a ping may be off, busy with a tick that others have done, or on
    /// its way to the limit switch.
    fn doubt(&mut self, unit: Unit) {
        self.unknown(unit.axis, Doubt::Ping);
    }

    fn entries(&self) -> usize {
        self.job
            .buffers()
            .flat_map(|buffer| &buffer.fills)
            .map(|fill| fill.bytes.len())
            .next()
            .unwrap_or(0)
    }
}

/// Ends whatever a ping may have begun: a jog's parameters, a feed of 0 even if bytes are lost, and
/// the jog. To everybody else pairs that mean nothing.
const END_PING: [u8; 6] = {
    let [first, second] = frame::END_JOG;
    [0, 0, 0, 0, first, second]
};
