//! A job over the ring: commands → what the drives execute, as commands again.
//!
//! The positions of a tick go out in one cycle and are executed in the next. Before an event, and
//! at the end, cycles go on until every drive is where it was told to be. The control ends the job
//! when a drive has stopped, or has not been heard twice in a row.

use std::collections::VecDeque;

use super::{Ring, Strike};
use crate::base::{Axis, AxisMap, Command, Event, Tick};

/// Cycles in a row in which a drive may not be heard.
const UNHEARD_MOST: u32 = 2;

/// How a job over the ring broke off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Fault {
    /// A drive has lost two positions in a row, and stopped.
    #[error(
        "cycle {cycle}, line {line}: drive {axis} has lost two positions in a row and stands still"
    )]
    Stopped {
        /// Whose drive.
        axis: Axis,
        /// The cycle in which it told so.
        cycle: u64,
        /// The line that was under way.
        line: u32,
    },
    /// A drive has not been heard twice in a row.
    #[error("cycle {cycle}, line {line}: drive {axis} has not been heard twice in a row")]
    Unheard {
        /// Whose drive.
        axis: Axis,
        /// The second of these cycles.
        cycle: u64,
        /// The line that was under way.
        line: u32,
    },
    /// Farther than 32 bits go.
    #[error("line {line}: {axis} goes beyond 32 bits of 0.1 µm")]
    Beyond {
        /// Which axis.
        axis: Axis,
        /// The line that asks for it.
        line: u32,
    },
}

/// The commands that drives execute, and the ring behind them.
#[derive(Debug)]
pub struct Carried<I> {
    commands: I,
    axes: Vec<Axis>,
    ring: Ring,
    /// Where the drives have been told to be last.
    demand: Vec<i32>,
    /// What they were told in the last two cycles: where they are now, and where at the end of this
    /// cycle.
    told: [Vec<i32>; 2],
    deviation_max: u32,
    /// The tick that went out in the last cycle.
    pending: Option<Tick>,
    ready: VecDeque<Command>,
    unheard: Vec<u32>,
    line: u32,
    fault: Option<Fault>,
    /// Ticks that were executed as planned, and others.
    as_planned: [u64; 2],
}

impl<I> Carried<I> {
    /// A job's commands, its axes in the order of their addresses, and where they stand at its start.
    /// An axis beyond 32 bits ends the job at once.
    pub fn new(commands: I, axes: &[Axis], start: &AxisMap<i64>, strikes: &[Strike]) -> Carried<I> {
        let beyond = axes.iter().find(|axis| i32::try_from(start[**axis]).is_err());
        let fault = beyond.map(|axis| Fault::Beyond { axis: *axis, line: 1 });
        let demand: Vec<i32> =
            axes.iter().map(|axis| i32::try_from(start[*axis]).unwrap_or(0)).collect();
        Carried {
            commands,
            axes: axes.to_vec(),
            ring: Ring::new(&demand, strikes),
            unheard: vec![0; demand.len()],
            told: [demand.clone(), demand.clone()],
            deviation_max: 0,
            demand,
            pending: None,
            ready: VecDeque::new(),
            line: 1,
            fault,
            as_planned: [0; 2],
        }
    }

    /// The ring.
    pub fn ring(&self) -> &Ring {
        &self.ring
    }

    /// Why the job broke off, if it did.
    pub fn fault(&self) -> Option<Fault> {
        self.fault
    }

    /// How many ticks were executed as planned, and how many were not.
    pub fn as_planned(&self) -> [u64; 2] {
        self.as_planned
    }

    /// How far a drive was at most from where it had been told to be, as the control has heard: in
    /// units of 0.1 µm.
    pub fn deviation_max(&self) -> u32 {
        self.deviation_max
    }

    fn tick(&mut self, tick: &Tick) {
        self.line = tick.line;
        for (demand, axis) in self.demand.iter_mut().zip(&self.axes) {
            match demand.checked_add(tick.counts[*axis]) {
                Some(next) => *demand = next,
                None => self.fault = Some(Fault::Beyond { axis: *axis, line: tick.line }),
            }
        }
        if self.fault.is_none() {
            let before = self.pending.replace(*tick);
            self.cycle(before);
        }
    }

    /// Cycles until the control hears twice in a row from every drive that it is where it was told to
    /// be: once could be on the way, as a drive that has lost a telegram goes on by its last step. They
    /// come to an end: a drive that is told nothing stops, and one that is not heard ends the job.
    fn settle(&mut self) {
        let mut before = self.pending.take();
        let mut arrived = 0;
        while self.fault.is_none() && arrived < 2 {
            self.cycle(before.take());
            let mut actual = self.ring.actual().zip(&self.demand);
            let is_there = actual.all(|(actual, demand)| actual == Some(*demand));
            arrived = if is_there { arrived + 1 } else { 0 };
        }
    }

    /// One cycle. What it executes belongs to the tick that went out in the cycle before.
    fn cycle(&mut self, before: Option<Tick>) {
        let cycle = self.ring.traffic().cycles;
        self.ring.cycle(&self.demand);
        let deviations = self.ring.actual().zip(&self.told[0]);
        let deviations =
            deviations.filter_map(|(actual, told)| actual.map(|actual| actual.abs_diff(*told)));
        self.deviation_max = deviations.fold(self.deviation_max, u32::max);
        self.told.swap(0, 1);
        self.told[1].clone_from(&self.demand);
        let mut counts = AxisMap::default();
        for (axis, drive) in self.axes.iter().zip(self.ring.drives()) {
            counts[*axis] = drive.step();
        }
        let is_rest = counts == AxisMap::default();
        if before.is_some() || !is_rest {
            let planned = before.is_some_and(|tick| tick.counts == counts);
            self.as_planned[usize::from(!planned)] += 1;
            let (buffer, line) = before.map_or((0, self.line), |tick| (tick.buffer, tick.line));
            self.ready.push_back(Command::Tick(Tick { buffer, line, counts }));
        }
        let line = self.line;
        if let Some(address) = self.ring.faulty() {
            let axis = self.axes[usize::from(address) - 1];
            self.fault = Some(Fault::Stopped { axis, cycle, line });
        }
        for ((unheard, actual), axis) in
            self.unheard.iter_mut().zip(self.ring.actual()).zip(&self.axes)
        {
            *unheard = if actual.is_none() { *unheard + 1 } else { 0 };
            if *unheard >= UNHEARD_MOST {
                self.fault.get_or_insert(Fault::Unheard { axis: *axis, cycle, line });
            }
        }
    }

    fn event(&mut self, event: Event) {
        self.settle();
        if self.fault.is_none() {
            self.ready.push_back(Command::Event(event));
        }
    }
}

impl<E, I: Iterator<Item = Result<Command, E>>> Iterator for Carried<I> {
    type Item = Result<Command, E>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(command) = self.ready.pop_front() {
                return Some(Ok(command));
            }
            if self.fault.is_some() {
                return None;
            }
            match self.commands.next() {
                Some(Ok(Command::Tick(tick))) => self.tick(&tick),
                Some(Ok(Command::Event(event))) => self.event(event),
                Some(Err(error)) => return Some(Err(error)),
                None if self.pending.is_some() => self.settle(),
                None => return None,
            }
        }
    }
}
