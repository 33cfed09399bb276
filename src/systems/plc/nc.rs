//! The control's side of a function: levels out, FIN in.

use super::{Function, Signals};

/// The delays of a control.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Times {
    /// From a code to its strobe.
    pub tmf_us: u64,
    /// For which FIN has to stand.
    pub tfin_us: u64,
    /// Longest wait for FIN, and for its end; while the block still moves FIN is not missed.
    pub timeout_us: u64,
}

/// A signal that has not come, or gone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Missing {
    /// The PLC has not done the function, or has not said so.
    #[error(
        "FIN is missing: {function} has stood with {} and DEN for {:.3} s, and the PLC has not given it",
        function.kind.strobe(), seconds(*.waited_us)
    )]
    Fin {
        /// The function.
        function: Function,
        /// Since strobe and DEN were both there.
        waited_us: u64,
    },
    /// The PLC has not taken back FIN.
    #[error(
        "FIN does not end: {} of {function} has been off for {:.3} s, and the PLC keeps FIN on",
        function.kind.strobe(), seconds(*.waited_us)
    )]
    FinOff {
        /// The function.
        function: Function,
        /// Since the strobe went off.
        waited_us: u64,
    },
    /// FIN stands before anything was asked.
    #[error(
        "FIN is on before {} of {function}, for {:.3} s: the PLC has not ended what was before",
        function.kind.strobe(), seconds(*.waited_us)
    )]
    FinEarly {
        /// The function.
        function: Function,
        /// Since the strobe could have come.
        waited_us: u64,
    },
}

fn seconds(us: u64) -> f64 {
    us as f64 * 1e-6
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Idle,
    /// The code is out; its strobe comes after TMF.
    Code,
    /// The strobe is on.
    Strobe,
    /// FIN is on, since then.
    Stands {
        fin_us: u64,
    },
    /// The strobe is off again.
    Released,
}

/// The control's side. See the module's head.
#[derive(Clone, Debug)]
pub struct Nc {
    times: Times,
    state: State,
    /// When the state began; a FIN that bounces does not begin the strobe anew.
    since_us: u64,
    den_us: u64,
    signals: Signals,
    fin: bool,
}

impl Nc {
    /// At rest.
    pub fn new(times: Times) -> Nc {
        let signals = Signals::default();
        Nc { times, state: State::Idle, since_us: 0, den_us: 0, signals, fin: false }
    }

    /// Gives the PLC a function: alone, or `with_motion` of its block under way, whose end
    /// [`Nc::motion_ends`] tells. Only while none is under way.
    pub fn begin(&mut self, now_us: u64, function: Function, with_motion: bool) {
        self.signals = Signals { function: Some(function), strobe: false, den: !with_motion };
        self.den_us = now_us;
        self.enter(State::Code, now_us);
    }

    /// The block's motion is over.
    pub fn motion_ends(&mut self, now_us: u64) {
        if self.state != State::Idle && !self.signals.den {
            self.signals.den = true;
            self.den_us = now_us;
        }
    }

    /// The PLC's level.
    pub fn hear(&mut self, now_us: u64, fin: bool) {
        self.fin = fin;
        match (self.state, fin) {
            (State::Strobe, true) => self.state = State::Stands { fin_us: now_us },
            (State::Stands { .. }, false) => self.state = State::Strobe,
            _ => {}
        }
    }

    /// Goes on as far as it may.
    ///
    /// # Errors
    /// When a signal is missing for too long. Nothing changes then; [`Nc::stop`] takes all levels back.
    pub fn advance(&mut self, now_us: u64) -> Result<(), Missing> {
        match self.state {
            State::Code if now_us >= self.since_us + self.times.tmf_us && !self.fin => {
                self.signals.strobe = true;
                self.enter(State::Strobe, now_us);
            }
            State::Stands { fin_us } if now_us >= fin_us + self.times.tfin_us => {
                self.signals.strobe = false;
                self.enter(State::Released, now_us);
            }
            _ => {}
        }
        if self.state == State::Released && !self.fin {
            self.stop();
        }
        match (self.signals.function, self.overdue_us()) {
            (Some(function), Some(due_us)) if now_us >= due_us => {
                Err(self.missing(function, self.times.timeout_us + now_us - due_us))
            }
            _ => Ok(()),
        }
    }

    /// When [`Nc::advance`] has something to do, if FIN does not change.
    pub fn next_us(&self) -> Option<u64> {
        match self.state {
            State::Code if !self.fin => Some(self.since_us + self.times.tmf_us),
            State::Stands { fin_us } => Some(fin_us + self.times.tfin_us),
            _ => self.overdue_us(),
        }
    }

    /// The levels that it puts out.
    pub fn signals(&self) -> Signals {
        self.signals
    }

    /// The PLC's level as it was last heard.
    pub fn fin(&self) -> bool {
        self.fin
    }

    /// Whether no function is under way.
    pub fn is_done(&self) -> bool {
        self.state == State::Idle
    }

    /// Takes all levels back at once.
    pub fn stop(&mut self) {
        self.state = State::Idle;
        self.signals = Signals::default();
    }

    fn enter(&mut self, state: State, now_us: u64) {
        self.state = state;
        self.since_us = now_us;
        // FIN may have been there before.
        self.hear(now_us, self.fin);
    }

    /// From when on a signal is missing. A PLC may wait for the end of the motion.
    fn overdue_us(&self) -> Option<u64> {
        let from_us = match self.state {
            State::Idle | State::Stands { .. } => return None,
            State::Code if !self.fin => return None,
            State::Code => self.since_us + self.times.tmf_us,
            State::Strobe | State::Released => self.since_us,
        };
        self.signals.den.then_some(from_us.max(self.den_us) + self.times.timeout_us)
    }

    fn missing(&self, function: Function, waited_us: u64) -> Missing {
        match self.state {
            State::Released => Missing::FinOff { function, waited_us },
            State::Strobe => Missing::Fin { function, waited_us },
            _ => Missing::FinEarly { function, waited_us },
        }
    }
}
