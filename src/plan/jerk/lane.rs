//! The way as stretches with a greatest speed, and speeding up below it.

use super::super::piece::Piece;
use super::bracket::Bracket;
use super::limit::JerkLimit;
use super::stretch::{SAME, State, Stretch};

/// On bent pieces the acceleration is constant and steps from one to the next: by what the jerk makes
/// of it in a piece's time, but by no more than this share of the greatest acceleration.
const STEP_SHARE: f64 = 0.05;

/// A stretch of the greatest speed, within one piece.
#[derive(Clone, Copy, Debug)]
pub struct Lane {
    /// The greatest speed along it, as a motion.
    pub stretch: Stretch,
    /// Where it ends.
    pub end_mm: f64,
    /// Number of its piece.
    pub run: usize,
}

/// Speeding up along a lane: with the piece's jerk up to its acceleration, and on with that.
#[derive(Clone, Copy, Debug)]
pub struct Climb {
    /// Its two stretches; the second may take no time.
    pub stretches: [Stretch; 2],
    /// It reaches the lane's speed before the lane ends.
    pub meets: bool,
}

impl Lane {
    /// The step of acceleration that is allowed at its ends.
    pub fn step_mm_s2(&self, piece: &Piece) -> f64 {
        if piece.is_straight() {
            return SAME;
        }
        let State { speed_mm_s, accel_mm_s2, .. } = self.stretch.from;
        let jerk_mm_s3 = piece.jerk.jerk_mm_s3(speed_mm_s, accel_mm_s2);
        let most_mm_s2 = STEP_SHARE * piece.accel_max_mm_s2();
        (jerk_mm_s3 * self.stretch.duration_s).min(most_mm_s2)
    }

    /// The same lane backwards.
    pub fn reversed(&self) -> Lane {
        let mut stretch = self.stretch.reversed();
        let start_mm = self.stretch.from.at_mm;
        stretch.from.at_mm = -self.end_mm;
        Lane { stretch, end_mm: -start_mm, run: self.run }
    }

    /// Speeds up from a state on or below it.
    pub fn climb(&self, from: State, accel_max_mm_s2: f64, jerk: &JerkLimit) -> Climb {
        let accel_mm_s2 = from.accel_mm_s2.min(accel_max_mm_s2).max(0.0);
        let from = State { accel_mm_s2, ..from };
        let length_mm = self.end_mm - from.at_mm;
        let jerk_mm_s3 = jerk.climbing_mm_s3(&from, length_mm, accel_max_mm_s2);
        let rise_s = (accel_max_mm_s2 - accel_mm_s2).max(0.0) / jerk_mm_s3;
        let mut rise = Stretch { from, jerk_mm_s3, duration_s: rise_s };
        let none = |from| Stretch { from, jerk_mm_s3: 0.0, duration_s: 0.0 };
        if rise.length_mm() >= length_mm {
            let longest_s = rise_s.min(from.rising_s(length_mm, jerk_mm_s3));
            rise.duration_s = from.time_over_s(length_mm, jerk_mm_s3, longest_s);
        }
        let risen = rise.end();
        if self.is_over(&risen) {
            rise.duration_s = self.meeting_s(&rise);
            return Climb { stretches: [rise, none(rise.end())], meets: true };
        }
        let left_mm = self.end_mm - risen.at_mm;
        if left_mm <= SAME * length_mm {
            let end = State { at_mm: self.end_mm, ..risen };
            return Climb { stretches: [rise, none(end)], meets: false };
        }
        let duration_s = risen.time_over_s(left_mm, 0.0, f64::INFINITY);
        let mut hold = Stretch { from: risen, jerk_mm_s3: 0.0, duration_s };
        let meets = self.is_over(&State { at_mm: self.end_mm, ..hold.end() });
        if meets {
            hold.duration_s = self.meeting_s(&hold);
        }
        Climb { stretches: [rise, hold], meets }
    }

    /// Whether a state is faster than the lane.
    pub fn is_over(&self, state: &State) -> bool {
        self.excess(state) > 0.0
    }

    /// By which share of the lane's speed a state is faster, less what rounding makes.
    fn excess(&self, state: &State) -> f64 {
        state.excess(&self.at(state.at_mm))
    }

    /// The lane's acceleration at a place.
    pub fn accel_mm_s2(&self, at_mm: f64) -> f64 {
        if self.stretch.jerk_mm_s3 == 0.0 {
            return self.stretch.from.accel_mm_s2;
        }
        self.at(at_mm).accel_mm_s2
    }

    /// The lane's motion at a place.
    pub fn at(&self, at_mm: f64) -> State {
        if at_mm >= self.end_mm {
            return State { at_mm, ..self.stretch.end() };
        }
        self.stretch.at(at_mm)
    }

    /// When a stretch that starts on or below the lane and ends above it crosses it.
    fn meeting_s(&self, stretch: &Stretch) -> f64 {
        let excess = |time_s| self.excess(&stretch.after(time_s));
        let range_s = [0.0, stretch.duration_s];
        Bracket::new(range_s, range_s.map(excess)).solve(1e-12, 1e-12, excess)
    }
}

impl Climb {
    /// The state at its end.
    pub fn end(&self, lane: &Lane) -> State {
        let end = self.stretches[1].end();
        if self.meets { end } else { State { at_mm: lane.end_mm, ..end } }
    }
}
