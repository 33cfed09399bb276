//! Speeds with constant accelerations → motion with limited jerk.
//!
//! The plan of [`super::lookahead`] is the ceiling: with limits on jerk no place can be passed
//! faster. Below it two passes, each in its file, find a motion whose acceleration changes evenly:
//!
//! 1. [`fall`]: backwards, so that braking ends softly;
//! 2. [`round`]: forwards, so that speeding up begins softly, and peaks are round.
//!
//! From rest to rest a stretch of the path is done at once. Of a longer one that part is given out
//! that braking at the end of what is known leaves alone, with as much again for safety: memory is
//! that of twice the way that braking takes.
//!
//! [`limit`] says how much jerk a piece allows, [`stretch`] and [`lane`] are the motion's parts. No
//! tick and no axis is known here.

mod fall;
mod lane;
mod limit;
mod round;
mod stretch;

pub use limit::JerkLimit;
pub use stretch::{State, Stretch};

use std::collections::VecDeque;

use super::Ramp;
use super::junction::Junction;
use super::lookahead::Decided;
use super::piece::Piece;
use lane::Lane;
use round::Rounding;

/// Pieces that are smoothed together at least: so many that the passes' overhead is spread.
const RUNS_MIN: usize = 256;

/// A piece with the speeds that constant accelerations give it.
#[derive(Debug)]
struct Run {
    piece: Piece,
    junction: Junction,
    ends_mm_s: [f64; 2],
    at_seam: bool,
}

impl Run {
    /// The greatest acceleration and braking at a speed.
    fn accels_mm_s2(&self, speed_mm_s: f64) -> [f64; 2] {
        let jerk_leaves_mm_s2 = self.piece.jerk.accel_max_mm_s2(speed_mm_s);
        self.piece.accels_mm_s2(speed_mm_s * speed_mm_s).map(|accel| accel.min(jerk_leaves_mm_s2))
    }
}

/// Gives decided pieces ramps with limited jerk.
#[derive(Debug)]
pub struct Smoother {
    runs: Vec<Run>,
    /// How the first of them begins.
    state: State,
    /// Runs that are collected before the passes run again.
    enough: usize,
    ready: VecDeque<Decided>,
}

impl Smoother {
    /// From rest.
    pub fn new() -> Smoother {
        Smoother {
            runs: Vec::new(),
            state: State::default(),
            enough: RUNS_MIN,
            ready: VecDeque::new(),
        }
    }

    /// Takes the next item. The path ends at rest.
    pub fn push(&mut self, decided: Decided) {
        let Decided::Piece { piece, junction, ends_mm_s, at_seam, .. } = decided else {
            return self.ready.push_back(decided);
        };
        self.runs.push(Run { piece, junction, ends_mm_s, at_seam });
        if ends_mm_s[1] == 0.0 {
            self.smooth(true);
            self.state = State::default();
            self.enough = RUNS_MIN;
        } else if self.runs.len() >= self.enough {
            self.smooth(false);
            self.enough = RUNS_MIN.max(2 * self.runs.len());
        }
    }

    /// Gives the next item, if there is one.
    pub fn pop(&mut self) -> Option<Decided> {
        self.ready.pop_front()
    }

    /// Smooths all that is there, and gives out what is certain of it; at rest at its end, that is all.
    fn smooth(&mut self, rests: bool) {
        let mut plan = Vec::with_capacity(self.runs.len());
        let mut ends_mm = Vec::with_capacity(self.runs.len());
        let mut start_mm = 0.0;
        for (i, run) in self.runs.iter().enumerate() {
            let end_mm = start_mm + run.piece.length_mm;
            let ramp = run.piece.ramp(run.ends_mm_s);
            let mut stretches = ramp.stretches(start_mm).peekable();
            while let Some(stretch) = stretches.next() {
                let end_mm = stretches.peek().map_or(end_mm, |next| next.from.at_mm);
                plan.push(Lane { stretch, end_mm, run: i });
            }
            ends_mm.push(end_mm);
            start_mm = end_mm;
        }
        let ceiling = fall::ceiling(&plan, &self.runs);
        let parts = Rounding::new(&ceiling.lanes, &self.runs, self.state).run();
        let count = match rests {
            true => self.runs.len(),
            false => certain(&parts, &ends_mm, ceiling.open_mm),
        };
        self.give_out(&parts, count, rests);
    }

    /// Gives out so many pieces with their parts of the motion.
    fn give_out(&mut self, parts: &[round::Part], count: usize, rests: bool) {
        let mut parts = parts.iter().peekable();
        let mut entry_mm_s = self.state.speed_mm_s;
        for (i, run) in self.runs.drain(..count).enumerate() {
            let mut stretches = Vec::new();
            while let Some(part) = parts.next_if(|part| part.run == i) {
                stretches.push(part.stretch);
            }
            let end = stretches.last().map_or(self.state, Stretch::end);
            let exit_mm_s = if rests && i + 1 == count { 0.0 } else { end.speed_mm_s };
            self.state = State { at_mm: 0.0, speed_mm_s: exit_mm_s, ..end };
            let ramp = Ramp::along(run.piece.length_mm, &stretches);
            let ends_mm_s = [entry_mm_s, exit_mm_s];
            entry_mm_s = exit_mm_s;
            let Run { piece, junction, at_seam, .. } = run;
            let decided = Decided::Piece { piece, junction, ends_mm_s, ramp, at_seam };
            self.ready.push_back(decided);
        }
    }
}

/// How many pieces nothing that follows can change: those that end as far before what hangs on the
/// end of what is known as that is long, and not within an arc.
fn certain(parts: &[round::Part], ends_mm: &[f64], open_mm: f64) -> usize {
    let end_mm = ends_mm.last().copied().unwrap_or(0.0);
    let limit_mm = open_mm - (end_mm - open_mm);
    let mut count = 0;
    for pair in parts.windows(2) {
        let (part, next) = (&pair[0], &pair[1]);
        if next.run > part.run {
            let piece_end_mm = ends_mm[part.run];
            if piece_end_mm > limit_mm {
                break;
            }
            if part.lands_mm <= piece_end_mm {
                count = part.run + 1;
            }
        }
    }
    count
}
