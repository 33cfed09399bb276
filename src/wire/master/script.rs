//! Small exchanges that the master strings together, and what it does when one goes wrong (H7).

use crate::base::Axis;
use crate::wire::frame;
use crate::wire::job::Buffer;
use crate::wire::report::{During, Fault};

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
}

/// Bytes that a node answers with its ID.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Ask {
    pub axis: Axis,
    pub id: u8,
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
            Action::Run { .. } => &[],
        }
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
            Action::Say(_) | Action::Run { .. } => false,
        }
    }
}

/// Asks a node whether it is there.
pub(super) fn ping((axis, id): (Axis, u8)) -> [Action; 3] {
    let [question, parameters, stop] = frame::ping(id);
    let ask = Ask { axis, id, bytes: question.to_vec(), question: Question::Ping };
    [Action::Ask(ask), Action::Say(parameters.to_vec()), Action::Say(stop.to_vec())]
}

/// All that a buffer takes.
pub(super) fn buffer(buffer: &Buffer, step: usize) -> Vec<Action> {
    let mut actions = Vec::with_capacity(5 * buffer.fills.len() + 2);
    let number = buffer.number;
    for fill in &buffer.fills {
        let (axis, id) = (fill.axis, fill.id);
        actions.extend(ping((axis, id)));
        let command = frame::fill(id, fill.master).to_vec();
        let question = Question::FillCommand { buffer: number, last_try: false };
        actions.push(Action::Ask(Ask { axis, id, bytes: command, question }));
        let question = Question::FillData { buffer: number };
        actions.push(Action::Ask(Ask { axis, id, bytes: fill.bytes.clone(), question }));
    }
    actions.extend([Action::Start, Action::Run { step }]);
    actions
}

impl Master {
    /// A node has answered its ID.
    pub(super) fn answered(&mut self, ask: Ask) {
        self.state = super::State::Next;
        match ask.question {
            Question::Ping | Question::FillCommand { .. } => {}
            Question::FillData { .. } => self.full.insert(ask.axis),
            // It had been out of phase, and takes what follows as its buffer.
            Question::Pad { during } => {
                let Ask { axis, id, .. } = ask;
                let bytes = vec![0; self.entries()];
                let question = Question::Drain { during };
                self.power_cycle = true;
                self.fail(Fault::NoAnswer { axis, id, during });
                self.script.push_back(Action::Ask(Ask { axis, id, bytes, question }));
            }
            Question::Drain { .. } => {}
        }
    }

    /// A node has not answered in time. Every way out sends an even number of bytes.
    pub(super) fn no_answer(&mut self, ask: Ask) {
        self.state = super::State::Next;
        let during = ask.question.during();
        let fault = Fault::NoAnswer { axis: ask.axis, id: ask.id, during };
        let question = Question::Pad { during };
        let pad = Action::Ask(Ask { bytes: vec![frame::SYNC], question, ..ask.clone() });
        match ask.question {
            Question::Ping => {
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
            Question::Pad { .. } => {
                if self.fault.is_some() {
                    self.script.push_front(Action::Say(STOP.to_vec()));
                }
                self.script.push_front(Action::Say(vec![frame::SYNC]));
            }
        }
    }

    /// Another byte than the node's ID has come.
    pub(super) fn wrong_answer(&mut self, ask: Ask, got: u8) {
        let during = ask.question.during();
        self.power_cycle |= during != During::Ping;
        self.fail(Fault::WrongAnswer { axis: ask.axis, id: ask.id, got, during });
        if during == During::Ping {
            // Whoever answered waits for a jog's parameters: a feed of 0, then the end.
            self.script.extend([Action::Say(vec![0, 0]), Action::Say(STOP.to_vec())]);
        }
    }

    /// A byte has come before the question was out.
    pub(super) fn early(&mut self, ask: &Ask, got: u8) {
        self.power_cycle = true;
        self.fail(match ask.question {
            Question::FillData { .. } => Fault::Early { axis: ask.axis, id: ask.id, got },
            _ => Fault::Unexpected { got },
        });
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

/// Ends a jog; to everybody else a pair that means nothing.
const STOP: [u8; 2] = [crate::wire::node::STOP; 2];
