//! What a stop takes beyond the plan without it.
//!
//! ```text
//!  v ┤   plan ___                 From rest at a place the machine speeds up as fast as it may,
//!    │    _-''   ''-M___           until it meets the plan at M; braking is the same backwards.
//!    │           .'  c             What that takes is compared with the plan, piece by piece.
//!    │         .'                  At M the acceleration falls by c: an arc of jerk -J lies
//!  0 ┼───__--'──────────── t       c³/(24·J²) of way below that corner, and 0.485 of that where
//!       place                      speeding up still grows with J.
//! ```
//!
//! Where the plan is steady that is exact. Where it is not, the arc is taken to begin on its
//! steepest braking nearby: mostly more than the stop takes. Speeds are not planned here.

use super::Ramp;
use super::jerk::{Lane, SAME, State};
use super::piece::Piece;
use super::run::Run;

/// How long the plan is looked at behind M for where it is steepest, in times that the greatest acceleration
/// takes to grow: the arc lasts up to twice as long, half of it before M.
const ROUND_RISES: f64 = 1.5;

/// An arc that begins while the acceleration still grows leaves it (1 - 1/√2)·c/J before M. It takes less
/// way than one from a steady acceleration by this share: 24·(1/(12·√2) - τ²/2 + τ³/6), τ = 1 - 1/√2.
const RISING_SHARE: f64 = 0.4853;

/// In which direction pieces are taken: of the path, or backwards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// Speeding up.
    Forwards,
    /// Braking.
    Backwards,
}

/// From rest to the plan.
#[derive(Clone, Copy, Debug)]
pub struct Climber {
    way: Way,
    state: State,
    /// Beyond the plan, so far.
    more_s: f64,
    /// The least jerk met.
    jerk_mm_s3: f64,
    met: Option<Met>,
}

/// Where the plan is met.
#[derive(Clone, Copy, Debug)]
struct Met {
    speed_mm_s: f64,
    /// Of speeding up to it.
    accel_mm_s2: f64,
    /// That still grows.
    is_rising: bool,
    /// The least of the plan from there on.
    least_mm_s2: f64,
    /// So long it is looked for.
    left_s: f64,
}

impl Climber {
    /// At rest.
    pub fn new(way: Way) -> Climber {
        let jerk_mm_s3 = f64::INFINITY;
        Climber { way, state: State::default(), more_s: 0.0, jerk_mm_s3, met: None }
    }

    /// Takes the next piece, as the plan runs it. On a bent piece the look-ahead has no corner at M, but a
    /// ramp from end to end.
    pub fn pass(&mut self, Run { piece, ramp, .. }: &Run) {
        let (speed_mm_s, more_s) = (self.state.speed_mm_s, self.more_s);
        let was_met = self.met.is_some();
        self.pass_lanes(piece, ramp);
        if self.met.is_some() && !was_met && !piece.is_straight() {
            let ends_mm_s = match self.way {
                Way::Forwards => [speed_mm_s, ramp.exit_mm_s()],
                Way::Backwards => [ramp.entry_mm_s(), speed_mm_s],
            };
            let ramp_s = piece.ramp(ends_mm_s).duration_s();
            self.more_s = self.more_s.max(more_s + ramp_s - ramp.duration_s());
        }
    }

    fn pass_lanes(&mut self, piece: &Piece, ramp: &Ramp) {
        let mut lanes = ramp.stretches(0.0).peekable();
        match self.way {
            Way::Forwards => {
                while let Some(stretch) = lanes.next() {
                    let end_mm = lanes.peek().map_or(piece.length_mm, |next| next.from.at_mm);
                    self.pass_lane(piece, &Lane { stretch, end_mm, run: 0 });
                }
            }
            Way::Backwards => {
                let mut end_mm = piece.length_mm;
                for stretch in lanes.rev() {
                    self.pass_lane(piece, &Lane { stretch, end_mm, run: 0 }.reversed());
                    end_mm = stretch.from.at_mm;
                }
            }
        }
    }

    fn pass_lane(&mut self, piece: &Piece, lane: &Lane) {
        match self.met {
            None => self.climb(piece, lane),
            Some(met) if met.left_s > 0.0 => {
                let ends = [lane.stretch.from, lane.stretch.end()];
                self.look(piece, ends.map(|state| state.accel_mm_s2), lane.stretch.duration_s);
            }
            Some(_) => {}
        }
    }

    fn climb(&mut self, piece: &Piece, lane: &Lane) {
        let speed_mm_s = self.state.speed_mm_s;
        let accel_mm_s2 = match self.way {
            Way::Forwards => piece.speeding_up_mm_s2(speed_mm_s * speed_mm_s),
            Way::Backwards => piece.braking_mm_s2(speed_mm_s * speed_mm_s),
        };
        if !piece.jerk.is_limited() {
            return self.climb_steadily(lane, accel_mm_s2);
        }
        let accel_mm_s2 = accel_mm_s2.min(piece.jerk.accel_max_mm_s2(speed_mm_s));
        let jerk_mm_s3 = piece.jerk.jerk_mm_s3(speed_mm_s, accel_mm_s2);
        self.jerk_mm_s3 = self.jerk_mm_s3.min(jerk_mm_s3);
        // Where a piece allows less the acceleration falls as it does at M.
        self.more_s += self.round_s(self.state.accel_mm_s2 - accel_mm_s2, speed_mm_s);
        self.state.at_mm = lane.stretch.from.at_mm;
        let climb = lane.climb(self.state, accel_mm_s2, &piece.jerk);
        self.state = climb.end(lane);
        self.more_s += climb.stretches.iter().map(|stretch| stretch.duration_s).sum::<f64>();
        let whole_s = lane.stretch.duration_s;
        if !climb.meets {
            self.more_s -= whole_s;
            return;
        }
        let way_mm = self.state.at_mm - lane.stretch.from.at_mm;
        let planned_s = lane.stretch.from.time_over_s(way_mm, lane.stretch.jerk_mm_s3, whole_s);
        self.more_s -= planned_s;
        let plan = [lane.stretch.after(planned_s), lane.stretch.end()];
        self.met = Some(Met {
            speed_mm_s: self.state.speed_mm_s,
            accel_mm_s2: self.state.accel_mm_s2,
            is_rising: self.state.accel_mm_s2 < accel_mm_s2,
            least_mm_s2: plan[0].accel_mm_s2,
            left_s: ROUND_RISES * accel_mm_s2 / jerk_mm_s3,
        });
        self.look(piece, plan.map(|state| state.accel_mm_s2), whole_s - planned_s);
    }

    /// Where nothing limits the jerk: at once with all of the acceleration, up to where the squares of both
    /// speeds, which grow evenly with the way, are the same. There the corner is the plan's own.
    fn climb_steadily(&mut self, lane: &Lane, accel_mm_s2: f64) {
        let plan = lane.stretch.from;
        let length_mm = lane.end_mm - plan.at_mm;
        let speed_mm_s = self.state.speed_mm_s;
        let below_sq = plan.speed_sq() - speed_mm_s * speed_mm_s;
        let closer_mm_s2 = accel_mm_s2 - plan.accel_mm_s2;
        let meets_at_mm = if below_sq <= SAME * plan.speed_sq() {
            0.0
        } else if closer_mm_s2 > 0.0 {
            0.5 * below_sq / closer_mm_s2
        } else {
            f64::INFINITY
        };
        let way_mm = meets_at_mm.min(length_mm);
        let state = |speed_mm_s| State { at_mm: plan.at_mm, speed_mm_s, accel_mm_s2 };
        let climb_s = state(speed_mm_s).time_over_s(way_mm, 0.0, f64::INFINITY);
        self.state =
            State { at_mm: plan.at_mm + way_mm, ..state(speed_mm_s + accel_mm_s2 * climb_s) };
        if meets_at_mm > length_mm {
            self.more_s += climb_s - lane.stretch.duration_s;
            return;
        }
        self.more_s += climb_s - plan.time_over_s(way_mm, 0.0, lane.stretch.duration_s);
        self.met = Some(Met {
            speed_mm_s: self.state.speed_mm_s,
            accel_mm_s2,
            is_rising: false,
            least_mm_s2: accel_mm_s2,
            left_s: 0.0,
        });
    }

    /// The plan goes on from M, for so long with an acceleration between these.
    fn look(&mut self, piece: &Piece, ends_mm_s2: [f64; 2], duration_s: f64) {
        let Some(met) = &mut self.met else { return };
        met.left_s -= duration_s;
        met.least_mm_s2 = met.least_mm_s2.min(ends_mm_s2[0]).min(ends_mm_s2[1]);
        let jerk_mm_s3 = piece.jerk.jerk_mm_s3(met.speed_mm_s, met.accel_mm_s2);
        self.jerk_mm_s3 = self.jerk_mm_s3.min(jerk_mm_s3);
    }

    /// Whether nothing that follows counts.
    pub fn is_done(&self) -> bool {
        self.met.is_some_and(|met| met.left_s <= 0.0)
    }

    /// What it takes beyond the plan.
    pub fn more_s(&self) -> f64 {
        let round_s = self.met.map_or(0.0, |met| {
            let share = if met.is_rising { RISING_SHARE } else { 1.0 };
            share * self.round_s(met.accel_mm_s2 - met.least_mm_s2, met.speed_mm_s)
        });
        self.more_s + round_s
    }

    /// What it takes to let an acceleration fall by so much, against at once.
    fn round_s(&self, fall_mm_s2: f64, speed_mm_s: f64) -> f64 {
        if fall_mm_s2 <= 0.0 {
            return 0.0;
        }
        let fall_s = fall_mm_s2 / self.jerk_mm_s3;
        let off_mm = fall_mm_s2 * fall_s * fall_s / 24.0;
        (off_mm / speed_mm_s).min(0.5 * fall_s)
    }
}
