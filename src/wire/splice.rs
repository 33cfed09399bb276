//! Jobs → a job: what is left of one after a seam, and one behind another.
//!
//! Only between buffers, where all nodes are empty: a buffer that was stopped is never gone on with.

use crate::base::machine::Unit;
use crate::base::{Axis, AxisMap, AxisSet, Event, Machine};
use crate::wire::job::{Job, Step};

impl Job {
    /// The job of these steps, from a position in motor steps.
    pub fn of_steps(steps: Vec<Step>, start_steps: AxisMap<i64>, machine: &Machine) -> Job {
        let mut position = start_steps;
        let mut extents = AxisMap::from_fn(|axis| [start_steps[axis]; 2]);
        let (mut nodes, mut ticks): (Vec<Unit>, u64) = (Vec::new(), 0);
        for step in &steps {
            match step {
                Step::Event(_) => {}
                Step::Direct(direct) => nodes.push(direct.unit()),
                Step::Buffer(buffer) => {
                    nodes.extend(buffer.fills.iter().map(|fill| fill.unit));
                    ticks += buffer.lines.len() as u64;
                    for tick in 0..buffer.lines.len() {
                        let counts = buffer.counts(tick);
                        for axis in Axis::ALL {
                            position[axis] += i64::from(counts[axis]);
                            let [low, high]: &mut [i64; 2] = &mut extents[axis];
                            *low = position[axis].min(*low);
                            *high = position[axis].max(*high);
                        }
                    }
                }
            }
        }
        nodes.sort_unstable_by_key(|unit| (unit.axis.is_none(), *unit));
        nodes.dedup();
        let low = machine.position_mm(&AxisMap::from_fn(|axis| extents[axis][0]));
        let high = machine.position_mm(&AxisMap::from_fn(|axis| extents[axis][1]));
        Job {
            steps,
            start_steps,
            start_mm: machine.position_mm(&start_steps),
            end_steps: position,
            extents_mm: AxisMap::from_fn(|axis| {
                (extents[axis][0] != extents[axis][1]).then_some([low[axis], high[axis]])
            }),
            ticks,
            nodes,
            axes: machine.axes.iter().map(|profile| profile.axis).collect(),
            unknown: AxisSet::EMPTY,
        }
    }

    /// What is left of the job once so many of its steps are done.
    pub fn after(&self, done: usize, machine: &Machine) -> Job {
        let (before, rest) = self.steps.split_at(done.min(self.steps.len()));
        let at = Job::of_steps(before.to_vec(), self.start_steps, machine).end_steps;
        Job::of_steps(rest.to_vec(), at, machine)
    }

    /// The job, and another one that starts where it ends.
    pub fn followed_by(self, next: Job, machine: &Machine) -> Job {
        let start_steps = self.start_steps;
        let steps = self.steps.into_iter().chain(next.steps).collect();
        Job::of_steps(steps, start_steps, machine)
    }

    /// The job of events alone.
    pub fn of_events(
        events: impl IntoIterator<Item = Event>,
        start_steps: AxisMap<i64>,
        machine: &Machine,
    ) -> Job {
        let steps = events.into_iter().map(Step::Event).collect();
        Job::of_steps(steps, start_steps, machine)
    }
}
