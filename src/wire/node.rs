//! Bytes in, steps and answers out: one node, behaving byte for byte as the firmware listed in
//! seed 004, appendices B (dsPIC30F4011: pairs, buffer, synchronisation) and C (PIC16F88: pulses).
//!
//! All of the firmware's hazards are here too: data that looks like a command is one, a byte too
//! many makes the receiver deaf for good, a full buffer cannot be given up. Time is an argument,
//! in microseconds; bytes are handed over in the order and at the time of their stop bits.
//! Left out: the limit switch bounces, and motors that lose steps.

use std::collections::VecDeque;

use crate::base::machine::{self, HOST_ID};
use crate::wire::codec::{self, NEGATIVE};

/// First byte of the pair that homes a node.
pub const HOME: u8 = b'h';
/// First byte of the pair that jogs a node.
pub const JOG: u8 = b'j';
/// Both bytes of the pair that ends a jog; any byte would.
pub const STOP: u8 = b's';
/// First byte of the pair that starts execution: the host's ID, fixed in the firmware.
pub const START: u8 = HOST_ID;
/// How long a node pauses after each answer, with its transmitter on.
pub const ANSWER_PAUSE_US: u64 = machine::ANSWER_PAUSE_US as u64;
/// One SPI exchange between the two controllers of a node.
pub const SPI_US: u64 = machine::SPI_US as u64;

/// Bytes that the UART keeps while the firmware is busy.
const RECEIVER_BYTES: usize = 4;
/// Steps of each tick of homing, towards minus. The switch is looked at between ticks.
pub const HOME_STEPS: u8 = 80;
/// Homing's feed.
const HOME_FEED: u8 = HOME_STEPS | NEGATIVE;

/// What a node did that somebody may want to know, and when.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Happening {
    /// It takes the bytes that follow as its buffer.
    FillBegins {
        /// It will answer every tick.
        master: bool,
    },
    /// Its buffer is full.
    Filled,
    /// It executes its buffer, or the frames that follow.
    Starts,
    /// It has executed its buffer, which is empty again.
    Finished,
    /// It runs towards the limit switch.
    Homes {
        /// Ticks of 80 steps until the switch closes.
        ticks: u64,
    },
    /// It jogs, at this byte's count each tick; 0 is a ping.
    Jogs {
        /// The feed byte.
        feed: u8,
    },
    /// It was still busy with the tick before when this tick's byte came.
    SyncWaited {
        /// Entry of the buffer, from 0.
        entry: usize,
        /// How long the byte waited.
        waited_us: u64,
    },
    /// A frame was lost, broken or changed: it stands still until it is switched off.
    FrameMissed {
        /// The tick that it did not make, from the last beginning.
        tick: usize,
    },
    /// The next frame came late, while the axis ran too fast to stop without a ramp.
    RanDry {
        /// Steps of the tick before.
        count: i32,
        /// From that frame to this one.
        gap_us: u64,
    },
    /// More bytes came than its receiver keeps: it hears nothing until it is switched off.
    Overrun,
}

/// What a node is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activity {
    /// Reads pairs.
    Idle,
    /// Takes data into its buffer.
    Filling,
    /// Reads a jog's parameters, or jogs.
    Jogging,
    /// Takes every byte as a sync byte.
    Executing,
}

/// One execution of a buffer, or of the frames from a beginning on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Run {
    /// When it started.
    pub start_us: u64,
    /// The signed steps executed, one a tick.
    pub counts: Vec<i32>,
}

#[derive(Clone, Copy, Debug)]
enum State {
    First,
    Second { first: u8 },
    Fill,
    JogId,
    JogFeed,
    Jog { feed: u8, since_us: u64 },
    Execute { entry: usize },
}

/// A node. See the module's head.
#[derive(Clone, Debug)]
pub struct Node {
    id: u8,
    half_tick_us: u64,
    entries: usize,
    state: State,
    /// When the firmware gets to its next read.
    ready_us: u64,
    receiver: VecDeque<(u64, u8)>,
    deaf: bool,
    buffer: Vec<u8>,
    full: bool,
    master: bool,
    position_steps: i64,
    /// The limit switch is closed from here on towards minus.
    switch_steps: i64,
    answers: VecDeque<(u64, u8)>,
    runs: Vec<Run>,
    happenings: VecDeque<(u64, Happening)>,
}

impl Node {
    /// A node just switched on. `entries` is its buffer's length (1500 in the listed firmware),
    /// `node_tick_us` the time in which it spreads a tick's pulses (10000 in the listed firmware),
    /// `position_steps` where its axis stands; its limit switch is at 0.
    pub fn new(id: u8, entries: u32, node_tick_us: u32, position_steps: i64) -> Self {
        Node {
            id,
            half_tick_us: u64::from(node_tick_us / 2),
            entries: entries as usize,
            state: State::First,
            ready_us: 0,
            receiver: VecDeque::with_capacity(RECEIVER_BYTES),
            deaf: false,
            buffer: Vec::new(),
            full: false,
            master: false,
            position_steps,
            switch_steps: 0,
            answers: VecDeque::new(),
            runs: Vec::new(),
            happenings: VecDeque::new(),
        }
    }

    /// The same, with its limit switch at another position.
    pub fn with_switch(self, switch_steps: i64) -> Self {
        Node { switch_steps, ..self }
    }

    /// The node's ID.
    pub fn id(&self) -> u8 {
        self.id
    }

    /// What the node is doing.
    pub fn activity(&self) -> Activity {
        match self.state {
            State::First | State::Second { .. } => Activity::Idle,
            State::Fill => Activity::Filling,
            State::JogId | State::JogFeed | State::Jog { .. } => Activity::Jogging,
            State::Execute { .. } => Activity::Executing,
        }
    }

    /// Whether the node holds a buffer that has not been executed to its end.
    pub fn is_full(&self) -> bool {
        self.full
    }

    /// Whether the next byte is the first of a pair: nothing of an earlier byte is left over.
    pub fn is_in_phase(&self) -> bool {
        matches!(self.state, State::First)
    }

    /// Where the axis stands.
    pub fn position_steps(&self) -> i64 {
        self.position_steps
    }

    /// Every execution so far, the present one included.
    pub fn runs(&self) -> &[Run] {
        &self.runs
    }

    /// Takes a byte whose stop bit ends at `now_us`. Times must not go back.
    pub fn handle_byte(&mut self, now_us: u64, byte: u8) {
        self.advance(now_us);
        if self.deaf {
            return;
        }
        if self.receiver.len() == RECEIVER_BYTES {
            return self.overrun(now_us);
        }
        self.receiver.push_back((now_us, byte));
        self.advance(now_us);
    }

    /// The node starts anew: idle, its buffer empty, its receiver clear. The axis stays where it is.
    pub fn reset(&mut self, now_us: u64) {
        self.state = State::First;
        self.ready_us = now_us;
        self.receiver.clear();
        self.deaf = false;
        self.buffer.clear();
        self.full = false;
        self.master = false;
    }

    /// The firmware reads nothing for so long; its receiver fills.
    pub fn stall(&mut self, now_us: u64, stall_us: u64) {
        self.ready_us = self.ready_us.max(now_us + stall_us);
    }

    /// The receiver overruns: it keeps what it has and takes nothing more.
    pub fn overrun(&mut self, now_us: u64) {
        self.deaf = true;
        self.happenings.push_back((now_us, Happening::Overrun));
    }

    /// The node is without power.
    pub fn die(&mut self) {
        self.deaf = true;
        self.receiver.clear();
        self.answers.clear();
    }

    /// Lets the firmware read what its receiver keeps, as far as it gets by `now_us`.
    pub fn advance(&mut self, now_us: u64) {
        while let Some(&(arrival_us, byte)) = self.receiver.front() {
            if let State::Jog { feed, since_us } = self.state {
                self.end_jog(feed, since_us, arrival_us);
            }
            let read_us = self.ready_us.max(arrival_us);
            if read_us > now_us {
                return;
            }
            self.receiver.pop_front();
            self.ready_us = read_us;
            self.read(read_us, arrival_us, byte);
        }
    }

    /// When [`Node::advance`] has something to do, if no byte comes.
    pub fn next_us(&self) -> Option<u64> {
        self.receiver.front().map(|(arrival_us, _)| self.ready_us.max(*arrival_us))
    }

    /// When the node is done with all that it has been told so far.
    pub fn ready_us(&self) -> u64 {
        self.ready_us
    }

    /// The next answer, and when its start bit goes out.
    pub fn poll_answer(&mut self) -> Option<(u64, u8)> {
        self.answers.pop_front()
    }

    /// The next thing that happened, and when.
    pub fn poll_happening(&mut self) -> Option<(u64, Happening)> {
        self.happenings.pop_front()
    }

    fn read(&mut self, now_us: u64, arrival_us: u64, byte: u8) {
        match self.state {
            State::First => self.state = State::Second { first: byte },
            State::Second { first } => {
                self.state = State::First;
                self.obey(now_us, first, byte);
            }
            State::Fill => self.take(now_us, byte),
            State::JogId => self.state = State::JogFeed,
            State::JogFeed => {
                self.happenings.push_back((now_us, Happening::Jogs { feed: byte }));
                self.state = State::Jog { feed: byte, since_us: now_us };
            }
            // A jog has ended before its ending byte is read: see `advance`.
            State::Jog { .. } => {}
            State::Execute { entry } => self.execute(now_us, arrival_us, entry),
        }
    }

    /// Tests a pair in the firmware's order.
    fn obey(&mut self, now_us: u64, first: u8, second: u8) {
        if first == self.id && !self.full {
            self.master = second == self.id;
            self.happenings.push_back((now_us, Happening::FillBegins { master: self.master }));
            self.answer(now_us);
            self.buffer.clear();
            self.state = State::Fill;
        } else if first == HOME && second == self.id {
            let way_steps = self.position_steps.saturating_sub(self.switch_steps).max(0);
            let ticks = way_steps.unsigned_abs().div_ceil(u64::from(HOME_STEPS));
            self.happenings.push_back((now_us, Happening::Homes { ticks }));
            self.step(HOME_FEED, ticks);
            self.answer(now_us + ticks * self.go_us(HOME_FEED));
        } else if first == JOG && second == self.id {
            self.answer(now_us);
            self.state = State::JogId;
        } else if first == START && self.full {
            self.happenings.push_back((now_us, Happening::Starts));
            self.runs.push(Run { start_us: now_us, counts: Vec::with_capacity(self.entries) });
            self.state = State::Execute { entry: 0 };
        }
    }

    fn take(&mut self, now_us: u64, byte: u8) {
        self.buffer.push(byte);
        if self.buffer.len() == self.entries {
            self.happenings.push_back((now_us, Happening::Filled));
            self.answer(now_us);
            self.full = true;
            self.state = State::First;
        }
    }

    fn execute(&mut self, now_us: u64, arrival_us: u64, entry: usize) {
        let waited_us = now_us - arrival_us;
        if waited_us > 0 {
            self.happenings.push_back((now_us, Happening::SyncWaited { entry, waited_us }));
        }
        let byte = self.buffer.get(entry).copied().unwrap_or(0);
        self.step(byte, 1);
        if let Some(run) = self.runs.last_mut() {
            run.counts.push(codec::decode(byte));
        }
        let done_us = now_us + self.go_us(byte);
        if self.master {
            self.answer(done_us);
        } else {
            self.ready_us = done_us + ANSWER_PAUSE_US;
        }
        if entry + 1 < self.entries {
            self.state = State::Execute { entry: entry + 1 };
            return;
        }
        self.full = false;
        self.happenings.push_back((done_us, Happening::Finished));
        self.state = State::First;
    }

    /// The loop looks for a byte before each tick, so the tick under way is made whole.
    fn end_jog(&mut self, feed: u8, since_us: u64, arrival_us: u64) {
        let ticks = arrival_us.saturating_sub(since_us).div_ceil(self.go_us(feed));
        self.step(feed, ticks);
        self.ready_us = since_us + ticks * self.go_us(feed);
        self.state = State::First;
    }

    fn answer(&mut self, now_us: u64) {
        self.answers.push_back((now_us, self.id));
        self.ready_us = now_us + ANSWER_PAUSE_US;
    }

    fn step(&mut self, byte: u8, ticks: u64) {
        let steps = i64::from(codec::decode(byte)).saturating_mul(ticks.min(1 << 40) as i64);
        self.position_steps = self.position_steps.saturating_add(steps);
    }

    fn go_us(&self, byte: u8) -> u64 {
        go_us(self.half_tick_us, byte)
    }
}

/// How long a command byte takes.
pub(super) fn go_us(half_tick_us: u64, byte: u8) -> u64 {
    pulses_us(half_tick_us, u32::from(byte & !NEGATIVE))
}

/// How long so many steps take: the SPI exchange, then each pulse high and low for
/// ⌊half a tick / steps⌋.
pub(super) fn pulses_us(half_tick_us: u64, steps: u32) -> u64 {
    let steps = u64::from(steps);
    let half_pulse_us = half_tick_us.checked_div(steps).unwrap_or(0);
    SPI_US + 2 * steps * half_pulse_us
}
