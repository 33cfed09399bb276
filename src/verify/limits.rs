//! Ticks against the machine: counts, travel, ticks of a buffer, and by [`Ramps`] accelerations,
//! jerks, and rest at seams and events.

use super::Setup;
use super::ramps::Ramps;
use super::report::{Check, Place};
use crate::base::machine::AxisProfile;
use crate::base::{Axis, AxisMap, Tick};

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

/// What is known of one axis.
#[derive(Debug)]
struct AxisState {
    profile: AxisProfile,
    count_limit: u32,
    count_max: u32,
    count_at: Place,
    /// The least and the greatest position.
    extremes: [(i64, Place); 2],
}

impl AxisState {
    fn new(profile: &AxisProfile, setup: &Setup) -> AxisState {
        AxisState {
            profile: *profile,
            count_limit: setup.machine.count_max(profile),
            count_max: 0,
            count_at: Place::default(),
            extremes: [(setup.start_steps[profile.axis], Place::default()); 2],
        }
    }

    fn tick(&mut self, count: i32, steps: i64, at: Place) {
        if count.unsigned_abs() > self.count_max {
            (self.count_max, self.count_at) = (count.unsigned_abs(), at);
        }
        let [low, high] = &mut self.extremes;
        if steps < low.0 {
            *low = (steps, at);
        } else if steps > high.0 {
            *high = (steps, at);
        }
    }

    fn speed(&self) -> Check {
        let [value, limit] = [self.count_max, self.count_limit].map(f64::from);
        let check = Check::new("speed", Some(self.profile.axis), value, limit);
        let at = Some(self.count_at).filter(|_| self.count_max > 0);
        Check { unit: "steps/tick", at, ..check }
    }

    /// A position beyond travel by half a step is what rounding makes of one at its limit.
    fn travel(&self) -> Option<Check> {
        let [low_mm, high_mm] = self.profile.travel_mm?;
        let steps_per_mm = self.profile.steps_per_mm;
        let [low, high] = self.extremes.map(|(steps, at)| (steps as f64 / steps_per_mm, at));
        let beyond = [(low_mm - low.0, low.1), (high.0 - high_mm, high.1)];
        let (beyond_mm, at) = if beyond[0].0 > beyond[1].0 { beyond[0] } else { beyond[1] };
        let (axis, limit_mm) = (self.profile.axis, 0.5 / steps_per_mm);
        let check = Check::new("beyond travel", Some(axis), beyond_mm.max(0.0), limit_mm);
        Some(Check { unit: "mm", at: Some(at).filter(|_| beyond_mm > 0.0), ..check })
    }
}

/// Walks over all ticks.
#[derive(Debug)]
pub struct Walker {
    axes: Vec<AxisState>,
    lacking: Vec<Axis>,
    /// Where the machine stands.
    pub at_steps: AxisMap<i64>,
    /// The last tick.
    pub place: Place,
    ticks: u64,
    buffer: u32,
    buffer_ticks: u64,
    buffer_worst: (u64, Place),
    buffer_ticks_max: Option<u32>,
    /// A motion on an axis that the machine lacks.
    lacked: Option<(Axis, Place)>,
    pub ramps: Ramps,
}

impl Walker {
    /// At rest, where the job starts.
    pub fn new(setup: &Setup) -> Walker {
        let has = |axis: &Axis| setup.machine.axis(*axis).is_some();
        Walker {
            axes: setup.machine.axes.iter().map(|axis| AxisState::new(axis, setup)).collect(),
            lacking: Axis::ALL.into_iter().filter(|axis| !has(axis)).collect(),
            at_steps: setup.start_steps,
            place: Place::default(),
            ticks: 0,
            buffer: 0,
            buffer_ticks: 0,
            buffer_worst: (0, Place::default()),
            buffer_ticks_max: setup.machine.bus.motion_ticks_max().filter(|_| setup.with_buffers),
            lacked: None,
            ramps: Ramps::new(setup),
        }
    }

    /// The next tick.
    pub fn tick(&mut self, tick: &Tick) {
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
        for axis in &self.lacking {
            if tick.counts[*axis] != 0 && self.lacked.is_none() {
                self.lacked = Some((*axis, self.place));
            }
        }
        for state in &mut self.axes {
            let (axis, place) = (state.profile.axis, self.place);
            let count = tick.counts[axis];
            self.at_steps[axis] = self.at_steps[axis].saturating_add(i64::from(count));
            state.tick(count, self.at_steps[axis], place);
        }
        self.ramps.tick(&tick.counts, &self.at_steps, self.place);
    }

    /// The machine stands here.
    pub fn rest(&mut self) {
        self.ramps.rest(&self.at_steps, self.place);
    }

    /// The job has ended; the path does here.
    pub fn end(mut self, path_end_steps: AxisMap<i64>) -> Walk {
        self.rest();
        let mut checks = Vec::new();
        let used = |(_, state): &(usize, &AxisState)| {
            let axis = state.profile.axis;
            let is_off = path_end_steps[axis] != self.at_steps[axis];
            Axis::LINEAR.contains(&axis) || state.count_max > 0 || is_off
        };
        for (index, state) in self.axes.iter().enumerate().filter(used) {
            let axis = state.profile.axis;
            let off = path_end_steps[axis].abs_diff(self.at_steps[axis]) as f64;
            checks.push(Check { unit: "steps", ..Check::new("end point", Some(axis), off, 0.0) });
            checks.push(state.speed());
            checks.extend(self.ramps.checks(index));
            checks.extend(state.travel());
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
        let mut counts_max = AxisMap::default();
        self.axes.iter().for_each(|state| counts_max[state.profile.axis] = state.count_max);
        let (ticks, end_steps) = (self.ticks, self.at_steps);
        Walk { ticks, end_steps, path_end_steps, counts_max, checks }
    }
}
