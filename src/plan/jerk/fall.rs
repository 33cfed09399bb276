//! Backwards: the greatest speed from which the machine can brake for all that follows, with
//! jerk.
//!
//! ```text
//!  v ┤   ______plan______            The plan of constant accelerations is the ceiling. Backwards
//!    │        `.         \           from each of its valleys, and from rest at the end, braking
//!    │  braking `.        \          begins at nothing and grows with the jerk up to what the
//!    │  with jerk `.__     \         axes stand.
//!    │                `--.__\__ valley
//! ```
//!
//! What is found has no valley but where the acceleration is steady: only its peaks are sharp.

use super::super::piece::Piece;
use super::Run;
use super::lane::Lane;
use super::stretch::{State, Stretch};

/// The ceiling of braking.
#[derive(Debug)]
pub struct Ceiling {
    /// Its lanes, in the order of the path.
    pub lanes: Vec<Lane>,
    /// From here on it hangs on what is not known yet.
    pub open_mm: f64,
}

/// Finds it below a plan, from rest at the end of what is known.
pub fn ceiling(plan: &[Lane], runs: &[Box<Run>]) -> Ceiling {
    let end_mm = plan.last().map_or(0.0, |lane| lane.end_mm);
    let mut lanes: Vec<Lane> = Vec::with_capacity(plan.len() + 16);
    let mut state = State { at_mm: -end_mm, ..State::default() };
    let mut follows = plan.last().is_none_or(|lane| lane.stretch.end().speed_mm_s <= 1e-9);
    let mut open_mm = if follows { Some(end_mm) } else { None };
    for lane in plan.iter().rev().map(Lane::reversed) {
        let piece = &runs[lane.run].piece;
        while state.at_mm < lane.end_mm {
            let rest = lane.stretch.since(state.at_mm);
            let keep = |stretch, end_mm| Lane { stretch, end_mm, run: lane.run };
            if follows && rest.from.accel_mm_s2 <= state.accel_mm_s2 + lane.step_mm_s2(piece) {
                lanes.push(keep(rest, lane.end_mm).reversed());
                let accel_mm_s2 = rest.end().accel_mm_s2.max(0.0);
                state = State { at_mm: lane.end_mm, accel_mm_s2, ..rest.end() };
                continue;
            }
            let accel_max_mm_s2 = runs[lane.run].braking_mm_s2(state.speed_mm_s);
            let climb = lane.climb(state, accel_max_mm_s2, &piece.jerk);
            state = climb.end(&lane);
            follows = climb.meets;
            let middle_mm = climb.stretches[1].from.at_mm;
            for (stretch, end_mm) in climb.stretches.into_iter().zip([middle_mm, state.at_mm]) {
                if stretch.duration_s > 0.0 {
                    put(&mut lanes, keep(stretch, end_mm).reversed(), piece);
                }
            }
            if follows && open_mm.is_none() {
                open_mm = Some(-state.at_mm);
            }
        }
    }
    lanes.reverse();
    Ceiling { lanes, open_mm: open_mm.unwrap_or(f64::NEG_INFINITY) }
}

/// Puts a lane before others. Braking that goes on as before is one lane: each is looked at by every arc. On a
/// bent piece it is not, for there a lane's time says by how much its acceleration may step.
fn put(lanes: &mut Vec<Lane>, lane: Lane, piece: &Piece) {
    let goes_on = |next: &&mut Lane| {
        let is_steady = lane.stretch.jerk_mm_s3 == 0.0 && next.stretch.jerk_mm_s3 == 0.0;
        let [before_mm_s2, after_mm_s2] =
            [lane.stretch, next.stretch].map(|stretch| stretch.from.accel_mm_s2);
        piece.is_straight() && is_steady && lane.run == next.run && before_mm_s2 == after_mm_s2
    };
    match lanes.last_mut().filter(goes_on) {
        Some(next) => {
            let duration_s = lane.stretch.duration_s + next.stretch.duration_s;
            next.stretch = Stretch { duration_s, ..lane.stretch };
        }
        None => lanes.push(lane),
    }
}
