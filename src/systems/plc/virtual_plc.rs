//! A virtual PLC: strobes in, FIN out.
//!
//! It takes so long over every function. Those that may only come when the tool has stopped cutting wait
//! for DEN: M0, M1, M2, M5, M6, M9, M30 and M60; all others begin with their strobe.

use std::collections::VecDeque;

use super::{Function, Kind, Signals};

/// M functions that wait for the end of the block's motion.
const WAIT_FOR_DEN: [u32; 8] = [0, 1, 2, 5, 6, 9, 30, 60];

/// What a virtual PLC does wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlcFault {
    /// It never gives FIN for this function.
    Silent(Function),
    /// It gives FIN and never takes it back.
    Stuck(Function),
}

/// What a PLC did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlcHappening {
    /// A function has its strobe.
    Strobe(Function),
    /// It is done: FIN.
    Done(Function),
    /// FIN is off again.
    Ready,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Ready,
    /// A strobe is there; the function has not begun.
    Asked(Function),
    Acts {
        function: Function,
        until_us: u64,
    },
    Done(Function),
    Stuck,
}

/// A virtual PLC. See the module's head.
#[derive(Clone, Debug)]
pub struct Plc {
    acts_us: u64,
    faults: Vec<PlcFault>,
    heard: Signals,
    state: State,
    happenings: VecDeque<(u64, PlcHappening)>,
}

impl Plc {
    /// A PLC that takes so long over a function.
    pub fn new(acts_us: u64, faults: Vec<PlcFault>) -> Plc {
        let heard = Signals::default();
        Plc { acts_us, faults, heard, state: State::Ready, happenings: VecDeque::new() }
    }

    /// The control's levels.
    pub fn hear(&mut self, now_us: u64, signals: Signals) {
        self.heard = signals;
        self.advance(now_us);
    }

    /// Goes on as far as it gets.
    pub fn advance(&mut self, now_us: u64) {
        let Signals { function, strobe, den } = self.heard;
        if let (State::Ready, Some(function), true) = (self.state, function, strobe) {
            self.state = State::Asked(function);
            self.happenings.push_back((now_us, PlcHappening::Strobe(function)));
        }
        match self.state {
            State::Asked(_) | State::Acts { .. } if !strobe => self.state = State::Ready,
            State::Asked(function) if den || !waits(function) => {
                let until_us = now_us + self.acts_us;
                let is_silent = self.faults.contains(&PlcFault::Silent(function));
                let until_us = if is_silent { u64::MAX } else { until_us };
                self.state = State::Acts { function, until_us };
            }
            State::Done(function) if !strobe => {
                let is_stuck = self.faults.contains(&PlcFault::Stuck(function));
                self.state = if is_stuck { State::Stuck } else { State::Ready };
                if !is_stuck {
                    self.happenings.push_back((now_us, PlcHappening::Ready));
                }
            }
            _ => {}
        }
        if let State::Acts { function, until_us } = self.state
            && now_us >= until_us
        {
            self.state = State::Done(function);
            self.happenings.push_back((now_us, PlcHappening::Done(function)));
        }
    }

    /// When [`Plc::advance`] has something to do, if the control's levels do not change.
    pub fn next_us(&self) -> Option<u64> {
        match self.state {
            State::Acts { until_us, .. } => Some(until_us).filter(|us| *us < u64::MAX),
            _ => None,
        }
    }

    /// Its level.
    pub fn fin(&self) -> bool {
        matches!(self.state, State::Done(_) | State::Stuck)
    }

    /// The next thing that happened, and when.
    pub fn poll_happening(&mut self) -> Option<(u64, PlcHappening)> {
        self.happenings.pop_front()
    }
}

fn waits(function: Function) -> bool {
    function.kind == Kind::M && WAIT_FOR_DEN.contains(&function.code)
}
