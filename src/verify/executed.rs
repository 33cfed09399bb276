//! Command → tick point: what the machine executes, in mm.

use super::edges::{Vector, linear_axes};
use super::{Cause, Setup, VerifyError};
use crate::base::{Axis, AxisMap, Command};

/// Where the axes stand after a tick.
#[derive(Clone, Copy, Debug)]
pub struct TickPoint {
    /// The tick, from 0.
    pub tick: u64,
    pub at: Vector,
    /// Whether X, Y or Z moved in it.
    pub moved: bool,
}

/// The tick points of a command stream.
pub struct Executed<C> {
    commands: C,
    steps: AxisMap<i64>,
    scale: [Option<(Axis, f64)>; 3],
    ticks: u64,
}

impl<C> Executed<C> {
    pub fn new(commands: C, setup: &Setup) -> Self {
        let scale = linear_axes(setup.machine).map(|axis| {
            let profile = setup.machine.axis(axis?)?;
            Some((profile.axis, profile.steps_per_mm))
        });
        Executed { commands, steps: setup.start_steps, scale, ticks: 0 }
    }

    /// Where the axes stand now.
    pub fn at(&self) -> Vector {
        self.scale.map(|scale| {
            scale.map_or(0.0, |(axis, steps_per_mm)| self.steps[axis] as f64 / steps_per_mm)
        })
    }
}

impl<C, E> Iterator for Executed<C>
where
    C: Iterator<Item = Result<Command, E>>,
    E: Into<Cause>,
{
    type Item = Result<TickPoint, VerifyError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let tick = match self.commands.next()? {
                Err(error) => return Some(Err(VerifyError::Commands(error.into()))),
                Ok(Command::Event(_)) => continue,
                Ok(Command::Tick(tick)) => tick,
            };
            let mut moved = false;
            for (axis, _) in self.scale.into_iter().flatten() {
                let count = i64::from(tick.counts[axis]);
                moved |= count != 0;
                self.steps[axis] = self.steps[axis].saturating_add(count);
            }
            self.ticks += 1;
            return Some(Ok(TickPoint { tick: self.ticks - 1, at: self.at(), moved }));
        }
    }
}
