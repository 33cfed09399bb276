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
    /// The ticks of the positions in the rings of the axes.
    places: [Place; RING],
    /// Where in the rings the last position is.
    now: usize,
    /// Positions since the last standing one, and since the last other one.
    moving: usize,
    still: usize,
    /// Positions since the last of another block.
    in_block: usize,
    /// Whether blocks may have corners inside, as splines may: then a step of speed is allowed anywhere.
    pub corners_in_blocks: bool,
    constant_feed: bool,
}

#[derive(Debug)]
struct AxisRamps {
    axis: Axis,
    step_mm: f64,
    /// The last positions.
    ring: [i64; RING],
    has_moved: bool,
    /// The direction in which it moved last, and the ticks since that was another one.
    sign: i32,
    since_reversal: usize,
    /// Second differences allowed in each window, without and with a step of speed in it.
    allowed_steps: [[f64; 2]; WINDOWS_TICKS.len()],
    /// What was found in motion, and from or to rest.
    ramps: Worst,
    rests: Worst,
    jerk: Option<Jerk>,
}

/// The greatest share of its limit so far.
#[derive(Clone, Copy, Debug)]
struct Worst {
    value: f64,
    limit: f64,
    at: Place,
    /// Second differences up to these are no greater share, whichever their limit.
    known_steps: [i64; WINDOWS_TICKS.len()],
}

#[derive(Debug)]
struct Jerk {
    limit_mm_s3: f64,
    /// Of a step more in the third difference of each window.
    step_mm_s3: [f64; JERK_TICKS.len()],
    found_mm_s3: f64,
    at: Place,
    /// Third differences up to these are no greater jerk.
    known_steps: [i64; JERK_TICKS.len()],
}

impl Ramps {
    /// At rest.
    pub fn new(setup: &Setup) -> Ramps {
        Ramps {
            axes: setup.machine.axes.iter().map(|axis| AxisRamps::new(axis, setup)).collect(),
            places: [Place::default(); RING],
            now: 0,
            moving: 0,
            still: HISTORY,
            in_block: 0,
            corners_in_blocks: false,
            constant_feed: setup.constant_feed,
        }
    }

    /// The machine has moved by these counts, to these positions.
    pub fn tick(&mut self, counts: &AxisMap<i32>, steps: &AxisMap<i64>, place: Place) {
        for axis in &mut self.axes {
            let sign = counts[axis.axis].signum();
            axis.has_moved |= sign != 0;
            axis.since_reversal += 1;
            if sign != 0 {
                if sign == -axis.sign {
                    axis.since_reversal = 0;
                }
                axis.sign = sign;
            }
        }
        self.still = 0;
        self.moving += 1;
        self.take(steps, place);
    }

    /// The machine stands here for as long as it likes: at least so long that no window sees
    /// motion on both sides.
    pub fn rest(&mut self, steps: &AxisMap<i64>, place: Place) {
        while self.still < HISTORY - 1 {
            self.still += 1;
            self.moving = 0;
            self.take(steps, place);
        }
    }

    fn take(&mut self, steps: &AxisMap<i64>, place: Place) {
        let goes_on = place.line > 0 && self.places[self.now].line == place.line;
        self.in_block = if goes_on { self.in_block + 1 } else { 0 };
        self.now = (self.now + 1) % RING;
        self.places[self.now] = place;
        for state in self.axes.iter_mut().filter(|state| state.has_moved) {
            state.ring[self.now] = steps[state.axis];
        }
        for index in 0..self.axes.len() {
            let state = &self.axes[index];
            if !state.has_moved {
                continue;
            }
            for (window, half) in WINDOWS_TICKS.into_iter().enumerate() {
                let worst = if self.moving <= 2 * half { &state.rests } else { &state.ramps };
                if state.bend(self.now, half) > worst.known_steps[window] {
                    self.acceleration(index, window);
                    break;
                }
            }
            let state = &mut self.axes[index];
            let Some(jerk) = &mut state.jerk else { continue };
            for (window, ticks) in JERK_TICKS.into_iter().enumerate() {
                let third = third(&state.ring, self.now, ticks);
                if third > jerk.known_steps[window] {
                    jerk.take(third, window, self.places[before(self.now, ticks)]);
                }
            }
        }
    }

    /// Second differences of an axis that end with the last position, from a window on.
    fn acceleration(&mut self, index: usize, first: usize) {
        for (window, half) in WINDOWS_TICKS.into_iter().enumerate().skip(first) {
            // The window is at rest on one side if a standing position is in it. Only then may the
            // speed make a step, and at a corner: where blocks meet or the way turns.
            let rests = self.moving <= 2 * half;
            let state = &self.axes[index];
            let may_step = rests
                || self.corners_in_blocks
                || self.in_block < 2 * half
                || state.since_reversal < 2 * half
                || self.turns(half);
            let allowed = state.allowed_steps[window][usize::from(may_step)];
            let bend = state.bend(self.now, half) as f64;
            let at = self.places[before(self.now, half)];
            let state = &mut self.axes[index];
            let worst = if rests { &mut state.rests } else { &mut state.ramps };
            if bend * worst.limit > worst.value * allowed {
                *worst = Worst::new(bend, allowed, at, &state.allowed_steps, half);
            }
        }
    }

    /// Whether the way turns between three positions by more than the rounding of positions to
    /// steps explains: half a step on each axis at either end of both chords.
    fn turns(&self, half: usize) -> bool {
        let (mut before_sq, mut after_sq, mut dot, mut step_sq) = (0.0, 0.0, 0.0, 0.0);
        for AxisRamps { ring, step_mm, .. } in &self.axes {
            let [to, by, from] = [0, half, 2 * half].map(|back| ring[before(self.now, back)]);
            let [before, after] = [by - from, to - by].map(|steps| steps as f64 * step_mm);
            before_sq += before * before;
            after_sq += after * after;
            dot += before * after;
            if before != 0.0 || after != 0.0 {
                step_sq += step_mm * step_mm;
            }
        }
        // A chord of length l turns by at most step/l when its ends move by half a step each; the
        // sine of small angles, so squares are compared: sin² = 1 - dot²/(l₁²·l₂²).
        let shorter_sq = f64::min(before_sq, after_sq);
        let noise_sq = 4.0 * step_sq / shorter_sq;
        let sine_sq = 1.0 - dot * dot / (before_sq * after_sq);
        shorter_sq <= 4.0 * step_sq || dot < 0.0 || sine_sq > noise_sq
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
        let nothing = Worst::new(0.0, allowed_steps[0][1], Place::default(), &allowed_steps, 1);
        let step_mm_s3 = 1.0 / (profile.steps_per_mm * tick_s * tick_s * tick_s);
        AxisRamps {
            axis: profile.axis,
            step_mm: 1.0 / profile.steps_per_mm,
            ring: [setup.start_steps[profile.axis]; RING],
            has_moved: false,
            sign: 0,
            since_reversal: HISTORY,
            allowed_steps,
            ramps: nothing,
            rests: nothing,
            jerk: profile.jerk_max_mm_s3.map(|limit_mm_s3| Jerk {
                limit_mm_s3,
                step_mm_s3: JERK_TICKS.map(|ticks| step_mm_s3 / (ticks * ticks * ticks) as f64),
                found_mm_s3: 0.0,
                at: Place::default(),
                known_steps: [ROUNDING_STEPS[1] as i64; JERK_TICKS.len()],
            }),
        }
    }

    /// The size of the second difference that ends at a place of the ring.
    fn bend(&self, now: usize, half: usize) -> i64 {
        let [to, by, from] = [0, half, 2 * half].map(|back| self.ring[before(now, back)]);
        ((to - by) - (by - from)).abs()
    }
}

impl Worst {
    /// A second difference in windows of a half width, of which so much is allowed.
    fn new(
        bend: f64,
        allowed: f64,
        at: Place,
        allowed_steps: &[[f64; 2]; WINDOWS_TICKS.len()],
        half: usize,
    ) -> Worst {
        let square = (half * half) as f64;
        let known_steps = allowed_steps.map(|[strict, _]| (bend / allowed * strict) as i64);
        Worst { value: bend / square, limit: allowed / square, at, known_steps }
    }
}

impl Jerk {
    /// A third difference that is greater than those before.
    fn take(&mut self, third: i64, window: usize, at: Place) {
        self.found_mm_s3 = (third as f64 - ROUNDING_STEPS[1]) * self.step_mm_s3[window];
        self.at = at;
        let known = |step_mm_s3: f64| (self.found_mm_s3 / step_mm_s3 + ROUNDING_STEPS[1]) as i64;
        self.known_steps = self.step_mm_s3.map(known);
    }
}

/// The size of the third difference that ends at a place of a ring.
fn third(ring: &[i64; RING], now: usize, ticks: usize) -> i64 {
    let [a, b, c, d] = [3, 2, 1, 0].map(|back| ring[before(now, back * ticks)]);
    (d - a + 3 * (b - c)).abs()
}

/// So many places back in a ring.
fn before(now: usize, back: usize) -> usize {
    (now + RING - back) % RING
}
