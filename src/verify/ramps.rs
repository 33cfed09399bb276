//! Accelerations and jerks of each axis, by differences of positions over windows of m ticks.
//!
//! - Acceleration: |q(n+m) - 2q(n) + q(n-m)| / m² may be a + J/m + 2/m² steps/tick², with J the
//!   speed step allowed at a corner and 2/m² what rounding does.
//! - Jerk: (|q(n) - 3q(n-m) + 3q(n-2m) - q(n-3m)| - 4) / m³ is what the third difference has beyond
//!   rounding, which makes up to 4 steps of it: half a step four times, weighed 1, 3, 3, 1. So it
//!   is a jerk that the motion has had for certain. It is reported against the limit and not
//!   judged: a step of speed that a corner may make, a start from rest, and ramps that are planned
//!   without a limit of jerk all have a greater one.

use super::Setup;
use super::report::{Check, Place, Verdict};
use crate::base::machine::AxisProfile;
use crate::base::{Axis, AxisMap};

/// Half widths of the windows in which accelerations are taken, in ticks.
const WINDOWS_TICKS: [usize; 5] = [1, 2, 5, 10, 20];
/// Thirds of the windows in which jerks are taken.
const JERK_TICKS: [usize; 4] = [2, 5, 10, 20];
/// Positions that the widest window spans.
const HISTORY: usize = 3 * JERK_TICKS[3] + 1;
/// Places of the ring that holds them: a power of two.
const RING: usize = 64;
/// Steps of a second and of a third difference that rounding makes.
const ROUNDING_STEPS: [f64; 2] = [2.0, 4.0];

/// Watches the last ticks.
#[derive(Debug)]
pub struct Ramps {
    axes: Vec<AxisRamps>,
    /// Length of a step of each axis.
    steps_mm: Vec<(Axis, f64)>,
    ring: Box<[Past; RING]>,
    /// Positions taken so far.
    taken: usize,
    /// Positions since the last standing one, and since the last other one.
    moving: usize,
    still: usize,
    /// Positions since the last of another block.
    in_block: usize,
    constant_feed: bool,
}

/// A position in the history of a stretch of motion.
#[derive(Clone, Copy, Debug, Default)]
struct Past {
    steps: AxisMap<i64>,
    place: Place,
    standing: bool,
}

/// The greatest share of its limit so far.
#[derive(Clone, Copy, Debug)]
struct Worst {
    share: f64,
    value: f64,
    limit: f64,
    at: Place,
}

#[derive(Debug)]
struct AxisRamps {
    axis: Axis,
    /// Second differences allowed in each window, without and with a step of speed in it.
    allowed_steps: [[f64; 2]; WINDOWS_TICKS.len()],
    ramps: Worst,
    rests: Worst,
    jerk: Option<Jerk>,
    /// The direction in which it moved last, and the ticks since that was another one.
    sign: i32,
    since_reversal: usize,
}

#[derive(Debug)]
struct Jerk {
    limit_mm_s3: f64,
    /// Of a step more in the third difference of each window.
    step_mm_s3: [f64; JERK_TICKS.len()],
    found_mm_s3: f64,
    at: Place,
}

impl Ramps {
    /// At rest.
    pub fn new(setup: &Setup) -> Ramps {
        let axes = &setup.machine.axes;
        let mut ramps = Ramps {
            axes: axes.iter().map(|profile| AxisRamps::new(profile, setup)).collect(),
            steps_mm: axes.iter().map(|axis| (axis.axis, 1.0 / axis.steps_per_mm)).collect(),
            ring: Box::new([Past::default(); RING]),
            taken: 0,
            moving: 0,
            still: 0,
            in_block: 0,
            constant_feed: setup.constant_feed,
        };
        ramps.rest(&setup.start_steps, Place::default());
        ramps
    }

    /// The machine has moved by these counts, to these positions.
    pub fn tick(&mut self, counts: &AxisMap<i32>, steps: &AxisMap<i64>, place: Place) {
        for axis in &mut self.axes {
            let sign = counts[axis.axis].signum();
            axis.since_reversal += 1;
            if sign != 0 {
                if sign == -axis.sign {
                    axis.since_reversal = 0;
                }
                axis.sign = sign;
            }
        }
        self.take(Past { steps: *steps, place, standing: false });
    }

    /// The machine stands here for as long as it likes: at least so long that no window sees
    /// motion on both sides.
    pub fn rest(&mut self, steps: &AxisMap<i64>, place: Place) {
        while self.still < HISTORY - 1 {
            self.take(Past { steps: *steps, place, standing: true });
        }
    }

    fn take(&mut self, past: Past) {
        let line = past.place.line;
        let goes_on = line > 0 && self.taken > 0 && self.past(1).place.line == line;
        self.in_block = if goes_on { self.in_block + 1 } else { 0 };
        (self.moving, self.still) =
            if past.standing { (0, self.still + 1) } else { (self.moving + 1, 0) };
        self.ring[self.taken % RING] = past;
        self.taken += 1;
        self.bends();
        self.jerks();
    }

    /// The position so many places back; 1 is the last one.
    fn past(&self, back: usize) -> &Past {
        &self.ring[(self.taken - back) % RING]
    }

    /// Second differences that end with the last position.
    fn bends(&mut self) {
        for (window, half) in WINDOWS_TICKS.into_iter().enumerate() {
            if self.taken <= 2 * half {
                return;
            }
            let [a, b, c] = [2 * half, half, 0].map(|back| *self.past(back + 1));
            // The window is at rest on one side if a standing position is in it.
            let rests = self.moving <= 2 * half;
            // Only at a corner, where blocks meet or the way turns, or from and to rest may the
            // speed make a step.
            let mut has_corner = (rests || self.in_block < 2 * half).then_some(true);
            let square = (half * half) as f64;
            for state in &mut self.axes {
                let axis = state.axis;
                let bend = (c.steps[axis] - b.steps[axis]) - (b.steps[axis] - a.steps[axis]);
                let bend = bend.unsigned_abs() as f64;
                let worst = if rests { &mut state.rests } else { &mut state.ramps };
                let [strict, loose] = state.allowed_steps[window];
                if bend <= worst.share * strict {
                    continue;
                }
                let may_step = state.since_reversal < 2 * half
                    || *has_corner.get_or_insert_with(|| turns(&self.steps_mm, [&a, &b, &c]));
                let allowed = if may_step { loose } else { strict };
                if bend > worst.share * allowed {
                    let (value, limit) = (bend / square, allowed / square);
                    *worst = Worst { share: bend / allowed, value, limit, at: b.place };
                }
            }
        }
    }

    /// Third differences that end with the last position.
    fn jerks(&mut self) {
        for (window, ticks) in JERK_TICKS.into_iter().enumerate() {
            if self.taken <= 3 * ticks {
                return;
            }
            let [a, b, c, d] = [3, 2, 1, 0].map(|back| *self.past(back * ticks + 1));
            for state in &mut self.axes {
                let (axis, Some(jerk)) = (state.axis, &mut state.jerk) else { continue };
                let third = d.steps[axis] - a.steps[axis] + 3 * (b.steps[axis] - c.steps[axis]);
                let steps = third.unsigned_abs() as f64 - ROUNDING_STEPS[1];
                let found_mm_s3 = steps * jerk.step_mm_s3[window];
                if found_mm_s3 > jerk.found_mm_s3 {
                    (jerk.found_mm_s3, jerk.at) = (found_mm_s3, c.place);
                }
            }
        }
    }

    /// What was found of an axis, by its index among the machine's.
    pub fn checks(&self, index: usize) -> Vec<Check> {
        let state = &self.axes[index];
        let reported = |mut check: Check| {
            if check.verdict == Verdict::Fail {
                check.verdict = Verdict::Reported;
            }
            check
        };
        let mut checks = Vec::new();
        for (what, worst) in [("acceleration", state.ramps), ("rest", state.rests)] {
            let check = Check::new(what, Some(state.axis), worst.value, worst.limit);
            let at = Some(worst.at).filter(|_| worst.value > 0.0);
            let check = Check { unit: "steps/tick²", at, ..check };
            checks.push(if self.constant_feed { reported(check) } else { check });
        }
        if let Some(jerk) = &state.jerk {
            let (found_mm_s3, limit_mm_s3) = (jerk.found_mm_s3, jerk.limit_mm_s3);
            let check = Check::new("jerk", Some(state.axis), found_mm_s3, limit_mm_s3);
            let at = Some(jerk.at).filter(|_| found_mm_s3 > 0.0);
            checks.push(reported(Check { unit: "mm/s³", at, ..check }));
        }
        checks
    }
}

impl AxisRamps {
    fn new(profile: &AxisProfile, setup: &Setup) -> AxisRamps {
        let tick_s = setup.tick_s();
        let accel = profile.accel_max_mm_s2 * tick_s * tick_s * profile.steps_per_mm;
        let start = profile.start_speed_mm_s * tick_s * profile.steps_per_mm;
        let jump = accel.max(start);
        let allowed_steps = WINDOWS_TICKS.map(|half| {
            let strict = accel * (half * half) as f64 + ROUNDING_STEPS[0];
            [strict, strict + jump * half as f64]
        });
        let step_mm_s3 = 1.0 / (profile.steps_per_mm * tick_s * tick_s * tick_s);
        let jerk = profile.jerk_max_mm_s3.map(|limit_mm_s3| Jerk {
            limit_mm_s3,
            step_mm_s3: JERK_TICKS.map(|ticks| step_mm_s3 / (ticks * ticks * ticks) as f64),
            found_mm_s3: 0.0,
            at: Place::default(),
        });
        let [_, limit] = allowed_steps[0];
        let none = Worst { share: 0.0, value: 0.0, limit, at: Place::default() };
        AxisRamps {
            axis: profile.axis,
            allowed_steps,
            ramps: none,
            rests: none,
            jerk,
            sign: 0,
            since_reversal: HISTORY,
        }
    }
}

/// Whether the way turns between three positions by more than the rounding of positions to steps
/// explains: half a step on each axis at either end of both chords.
fn turns(steps_mm: &[(Axis, f64)], [from, by, to]: [&Past; 3]) -> bool {
    let (mut before_sq, mut after_sq, mut dot, mut step_sq) = (0.0, 0.0, 0.0, 0.0);
    for (axis, step) in steps_mm {
        let [before, after] =
            [by.steps[*axis] - from.steps[*axis], to.steps[*axis] - by.steps[*axis]];
        let [before, after] = [before as f64 * step, after as f64 * step];
        before_sq += before * before;
        after_sq += after * after;
        dot += before * after;
        if before != 0.0 || after != 0.0 {
            step_sq += step * step;
        }
    }
    // A chord of length l turns by at most step/l when its ends move by half a step each; the
    // sine of small angles, so squares are compared: sin² = 1 - dot²/(l₁²·l₂²).
    let shorter_sq = f64::min(before_sq, after_sq);
    let noise_sq = 4.0 * step_sq / shorter_sq;
    let sine_sq = 1.0 - dot * dot / (before_sq * after_sq);
    shorter_sq <= 4.0 * step_sq || dot < 0.0 || sine_sq > noise_sq
}
