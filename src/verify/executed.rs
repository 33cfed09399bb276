//! Tick → tick point: what the machine executes, in mm.

use super::edges::{Vector, linear_axes};
use super::{OTHER_AXES, Others, Setup};
use crate::base::{Axis, AxisMap, Tick};

/// Where the axes stand after a tick.
#[derive(Clone, Copy, Debug)]
pub struct TickPoint {
    /// The tick, from 0.
    pub tick: u64,
    pub at: Vector,
    /// Whether X, Y or Z moved in it.
    pub moved: bool,
}

/// Adds up ticks.
#[derive(Clone, Debug)]
pub struct Executed {
    steps: AxisMap<i64>,
    scale: [Option<(Axis, f64)>; 3],
    ticks: u64,
}

impl Executed {
    /// From where the machine stands.
    pub fn new(setup: &Setup) -> Self {
        let scale = linear_axes(setup.machine).map(|axis| {
            let profile = setup.machine.axis(axis?)?;
            Some((profile.axis, profile.steps_per_mm))
        });
        Executed { steps: setup.start_steps, scale, ticks: 0 }
    }

    /// Where the axes stand now.
    pub fn at(&self) -> Vector {
        self.scale.map(|scale| {
            scale.map_or(0.0, |(axis, steps_per_mm)| self.steps[axis] as f64 / steps_per_mm)
        })
    }

    /// Where the other axes stand now, in steps.
    pub fn others_steps(&self) -> Others {
        OTHER_AXES.map(|axis| self.steps[axis] as f64)
    }

    /// Where they stand after the next tick.
    pub fn tick(&mut self, tick: &Tick) -> TickPoint {
        let moved = Axis::LINEAR.into_iter().fold(0, |all, axis| all | tick.counts[axis]) != 0;
        for (steps, count) in self.steps.0.iter_mut().zip(tick.counts.0) {
            *steps = steps.saturating_add(i64::from(count));
        }
        self.ticks += 1;
        TickPoint { tick: self.ticks - 1, at: self.at(), moved }
    }
}
