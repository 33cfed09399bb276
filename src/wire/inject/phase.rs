//! The host's bytes → the phase that each is part of.
//!
//! Follows a host that does everything right; what one sends after a failure may count as a phase
//! that it is not.

use super::spec::Phase;
use crate::wire::frame;
use crate::wire::frames;
use crate::wire::node::{JOG, START};

/// Bytes of a ping behind its question.
const PING_REST: usize = 2 * frame::ping(0).len() - 2;

/// Reads along.
#[derive(Clone, Debug)]
pub(super) struct Listener {
    entries: usize,
    metronome: Option<u8>,
    state: State,
    /// Entries of the present buffers up to the last that moves.
    motion: usize,
    phase: Phase,
}

#[derive(Clone, Copy, Debug)]
enum State {
    First,
    Second(u8),
    PingRest(usize),
    Data {
        at: usize,
        moves: bool,
    },
    Sync(usize),
    /// A frame, whose info byte tells.
    Frame,
}

impl Listener {
    pub fn new(entries: u32, metronome: Option<u8>) -> Self {
        let (state, phase) = (State::First, Phase::Ping);
        Listener { entries: entries as usize, metronome, state, motion: 0, phase }
    }

    /// Reads frames along.
    pub fn of_frames() -> Self {
        Listener { state: State::Frame, ..Listener::new(0, None) }
    }

    /// The phase of the byte heard last.
    pub fn phase(&self) -> Phase {
        self.phase
    }

    pub fn hear(&mut self, byte: u8) -> Phase {
        self.phase = match self.state {
            State::First => {
                self.state = State::Second(byte);
                match byte {
                    START => Phase::Start,
                    121..=135 => Phase::Command,
                    _ => Phase::Ping,
                }
            }
            State::Frame if byte & frames::INFO == 0 => self.phase,
            State::Frame if byte >> 4 & 7 == frames::Mode::Begin as u8 => Phase::Start,
            State::Frame => Phase::Tick,
            State::Second(first) => {
                self.state = match first {
                    JOG => State::PingRest(PING_REST),
                    START => State::Sync(0),
                    121..=135 => State::Data { at: 0, moves: self.metronome != Some(first) },
                    _ => State::First,
                };
                self.phase
            }
            State::PingRest(left) => {
                self.state = if left > 1 { State::PingRest(left - 1) } else { State::First };
                Phase::Ping
            }
            State::Data { at, moves } => {
                if moves && byte != 0 {
                    self.motion = self.motion.max(at + 1);
                }
                let more = at + 1 < self.entries;
                self.state = if more { State::Data { at: at + 1, moves } } else { State::First };
                Phase::Data
            }
            State::Sync(at) => {
                let phase = if at < self.motion { Phase::Tick } else { Phase::Pad };
                self.state = State::Sync(at + 1);
                if at + 1 == self.entries {
                    self.state = State::First;
                    self.motion = 0;
                }
                phase
            }
        };
        self.phase
    }
}
