//! Ticks against the machine: counts, accelerations, rest at seams and events, buffers, travel;
//! and the events and the end of the path, which the executed steps have to meet exactly.

use std::collections::VecDeque;

use super::contour::Streams;
use super::events::{PathEvents, Timetable};
use super::report::{Check, Place, Verdict};
use super::{Cause, Setup, VerifyError};
use crate::base::machine::AxisProfile;
use crate::base::{Axis, AxisMap, Command, Tick};
use crate::path::PathItem;

/// Half widths of the windows in which accelerations are taken, in ticks.
const WINDOWS_TICKS: [usize; 5] = [1, 2, 5, 10, 20];
/// Positions that the widest window spans.
const HISTORY: usize = 2 * WINDOWS_TICKS[4] + 1;

/// What the walk over all ticks found.
#[derive(Debug)]
pub struct Walk {
    pub ticks: u64,
    pub end_steps: AxisMap<i64>,
    /// Where the path ends, to the nearest step.
    pub path_end_steps: AxisMap<i64>,
    pub counts_max: AxisMap<u32>,
    pub checks: Vec<Check>,
}

impl<FC, FP, C, P, CE, PE> Streams<'_, FC, FP>
where
    FC: Fn() -> Result<C, CE>,
    FP: Fn() -> Result<P, PE>,
    C: Iterator<Item = Result<Command, CE>>,
    P: Iterator<Item = Result<PathItem, PE>>,
    CE: Into<Cause>,
    PE: Into<Cause>,
{
    /// Holds every tick and event against the machine.
    pub fn walk(&self) -> Result<Walk, VerifyError> {
        let path = PathEvents::new(self.path()?, self.setup);
        let mut timetable = Timetable::new(path, self.setup.with_events);
        let mut walker = Walker::new(self.setup);
        for command in self.commands()? {
            match command.map_err(|error| VerifyError::Commands(error.into()))? {
                Command::Tick(tick) => walker.tick(&tick),
                Command::Event(event) => {
                    walker.rest();
                    timetable.event(&event, &walker.at_steps, walker.place)?;
                }
            }
        }
        let (path_end_steps, events) = timetable.end()?;
        let mut walk = walker.end(path_end_steps);
        walk.checks.extend(events);
        Ok(walk)
    }
}

/// A value with the greatest share of its limit so far.
#[derive(Clone, Copy, Debug, Default)]
struct Worst {
    value: f64,
    limit: f64,
    at: Option<Place>,
}

impl Worst {
    fn take(&mut self, value: f64, limit: f64, at: Place) {
        if self.limit == 0.0 || value * self.limit > self.value * limit {
            *self = Worst { value, limit, at: Some(at) };
        }
    }

    fn check(&self, what: &'static str, axis: Axis, unit: &'static str) -> Check {
        let check = Check::new(what, Some(axis), self.value, self.limit);
        Check { unit, at: self.at.filter(|_| self.value > 0.0), ..check }
    }
}

/// What is known of one axis.
#[derive(Debug)]
struct AxisState {
    profile: AxisProfile,
    count_max: u32,
    /// Acceleration and the step of speed allowed at a corner, in steps and ticks.
    accel: f64,
    jump: f64,
    counts: Worst,
    ramps: Worst,
    rests: Worst,
    travel: Worst,
    /// The direction in which it moved last, and the ticks since that was another one.
    sign: i32,
    since_reversal: usize,
}

impl AxisState {
    fn new(profile: &AxisProfile, setup: &Setup) -> AxisState {
        let tick_s = setup.tick_s();
        let accel = profile.accel_max_mm_s2 * tick_s * tick_s * profile.steps_per_mm;
        let start = profile.start_speed_mm_s * tick_s * profile.steps_per_mm;
        AxisState {
            profile: *profile,
            count_max: setup.machine.count_max(profile),
            accel,
            jump: accel.max(start),
            counts: Worst::default(),
            ramps: Worst::default(),
            rests: Worst::default(),
            travel: Worst::default(),
            sign: 0,
            since_reversal: HISTORY,
        }
    }

    /// The axis has moved in a direction, or not.
    fn direction(&mut self, sign: i32) {
        self.since_reversal += 1;
        if sign != 0 {
            if sign == -self.sign {
                self.since_reversal = 0;
            }
            self.sign = sign;
        }
    }

    /// A position beyond travel by half a step is what rounding makes of one at its limit.
    fn position(&mut self, steps: i64, at: Place) {
        let Some([low_mm, high_mm]) = self.profile.travel_mm else { return };
        let mm = steps as f64 / self.profile.steps_per_mm;
        let beyond_mm = (low_mm - mm).max(mm - high_mm).max(0.0);
        self.travel.take(beyond_mm, 0.5 / self.profile.steps_per_mm, at);
    }
}

/// A position in the history of a stretch of motion.
#[derive(Clone, Copy, Debug)]
struct Past {
    steps: AxisMap<i64>,
    place: Place,
    standing: bool,
}

#[derive(Debug)]
struct Walker {
    axes: Vec<AxisState>,
    lacking: Vec<Axis>,
    at_steps: AxisMap<i64>,
    place: Place,
    ticks: u64,
    buffer: u32,
    buffer_ticks: u64,
    buffer_worst: (u64, Place),
    buffer_ticks_max: Option<u32>,
    constant_feed: bool,
    counts_max: AxisMap<u32>,
    /// A motion on an axis that the machine lacks.
    lacked: Option<(Axis, Place)>,
    history: VecDeque<Past>,
    /// Positions of the history since the last standing one.
    moving: usize,
    /// Positions of the history since the last of another block.
    in_block: usize,
}

impl Walker {
    fn new(setup: &Setup) -> Walker {
        let has = |axis: &Axis| setup.machine.axis(*axis).is_some();
        let mut walker = Walker {
            axes: setup.machine.axes.iter().map(|axis| AxisState::new(axis, setup)).collect(),
            lacking: Axis::ALL.into_iter().filter(|axis| !has(axis)).collect(),
            at_steps: setup.start_steps,
            place: Place::default(),
            ticks: 0,
            buffer: 0,
            buffer_ticks: 0,
            buffer_worst: (0, Place::default()),
            buffer_ticks_max: setup.machine.bus.motion_ticks_max().filter(|_| setup.with_buffers),
            constant_feed: setup.constant_feed,
            counts_max: AxisMap::default(),
            lacked: None,
            history: VecDeque::with_capacity(HISTORY + 1),
            moving: 0,
            in_block: 0,
        };
        walker.rest();
        walker
    }

    fn tick(&mut self, tick: &Tick) {
        if tick.buffer != self.buffer {
            self.rest();
            (self.buffer, self.buffer_ticks) = (tick.buffer, 0);
        }
        self.place = Place { tick: self.ticks, line: tick.line };
        self.ticks += 1;
        self.buffer_ticks += 1;
        if self.buffer_ticks > self.buffer_worst.0 {
            self.buffer_worst = (self.buffer_ticks, self.place);
        }
        let moves = |axis: &&Axis| tick.counts[**axis] != 0;
        if let Some(axis) = self.lacking.iter().find(moves).filter(|_| self.lacked.is_none()) {
            self.lacked = Some((*axis, self.place));
        }
        for state in &mut self.axes {
            let axis = state.profile.axis;
            let count = tick.counts[axis];
            let size = count.unsigned_abs();
            self.counts_max[axis] = self.counts_max[axis].max(size);
            state.counts.take(f64::from(size), f64::from(state.count_max), self.place);
            self.at_steps[axis] = self.at_steps[axis].saturating_add(i64::from(count));
            state.position(self.at_steps[axis], self.place);
            state.direction(count.signum());
        }
        self.remember(false);
    }

    /// The machine stands here for as long as it likes: at least so long that no window sees
    /// motion on both sides.
    fn rest(&mut self) {
        for _ in 1..HISTORY {
            self.remember(true);
        }
    }

    fn remember(&mut self, standing: bool) {
        self.moving = if standing { 0 } else { self.moving + 1 };
        let in_same_block = |last: &Past| last.place.line == self.place.line && last.place.line > 0;
        let goes_on = self.history.back().is_some_and(in_same_block);
        self.in_block = if goes_on { self.in_block + 1 } else { 0 };
        let past = Past { steps: self.at_steps, place: self.place, standing };
        self.history.push_back(past);
        if self.history.len() > HISTORY {
            self.history.pop_front();
        }
        for half in WINDOWS_TICKS {
            let newest = self.history.len() - 1;
            let Some(first) = newest.checked_sub(2 * half) else { continue };
            let (a, b) = (self.history[first], self.history[newest - half]);
            // The window is at rest on one side if a standing position is in it.
            let rests = self.moving <= 2 * half;
            if a.standing && standing && a.steps == self.at_steps && b.steps == self.at_steps {
                continue;
            }
            // Only at a corner, where blocks meet or the way turns, or from and to rest may the speed
            // make a step.
            let has_corner =
                rests || self.in_block < 2 * half || self.turns(&a.steps, &b.steps, &self.at_steps);
            let width = half as f64;
            for state in &mut self.axes {
                let axis = state.profile.axis;
                let bend = (self.at_steps[axis] - b.steps[axis]) - (b.steps[axis] - a.steps[axis]);
                let value = bend.unsigned_abs() as f64 / (width * width);
                let jump = match has_corner || state.since_reversal < 2 * half {
                    true => state.jump,
                    false => 0.0,
                };
                let limit = state.accel + jump / width + 2.0 / (width * width);
                let worst = if rests { &mut state.rests } else { &mut state.ramps };
                worst.take(value, limit, b.place);
            }
        }
    }

    /// Whether the way turns between three positions by more than the rounding of positions to
    /// steps explains: half a step on each axis at either end of both chords.
    fn turns(&self, from: &AxisMap<i64>, by: &AxisMap<i64>, to: &AxisMap<i64>) -> bool {
        let (mut before_sq, mut after_sq, mut dot, mut step_sq) = (0.0, 0.0, 0.0, 0.0);
        for AxisState { profile, .. } in &self.axes {
            let (axis, step) = (profile.axis, 1.0 / profile.steps_per_mm);
            let [before, after] = [by[axis] - from[axis], to[axis] - by[axis]];
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

    fn end(mut self, path_end_steps: AxisMap<i64>) -> Walk {
        self.rest();
        let mut checks = Vec::new();
        let used = |state: &&AxisState| {
            Axis::LINEAR.contains(&state.profile.axis) || self.counts_max[state.profile.axis] > 0
        };
        for state in self.axes.iter().filter(used) {
            let axis = state.profile.axis;
            let off = path_end_steps[axis].abs_diff(self.at_steps[axis]) as f64;
            checks.push(Check { unit: "steps", ..Check::new("end point", Some(axis), off, 0.0) });
            checks.push(state.counts.check("speed", axis, "steps/tick"));
            for (what, worst) in [("acceleration", state.ramps), ("rest", state.rests)] {
                let mut check = worst.check(what, axis, "steps/tick²");
                if self.constant_feed && check.verdict == Verdict::Fail {
                    check.verdict = Verdict::Reported;
                }
                checks.push(check);
            }
            if state.profile.travel_mm.is_some() {
                checks.push(state.travel.check("beyond travel", axis, "mm"));
            }
        }
        if let Some((axis, at)) = self.lacked {
            let check = Check::new("axis that the machine lacks", Some(axis), 1.0, 0.0);
            checks.push(Check { at: Some(at), ..check });
        }
        if let Some(most) = self.buffer_ticks_max {
            let (ticks, at) = self.buffer_worst;
            let check = Check::new("ticks of a buffer", None, ticks as f64, f64::from(most));
            checks.push(Check { unit: "ticks", at: Some(at), ..check });
        }
        Walk {
            ticks: self.ticks,
            end_steps: self.at_steps,
            path_end_steps,
            counts_max: self.counts_max,
            checks,
        }
    }
}
