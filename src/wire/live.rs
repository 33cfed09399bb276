//! A job under way → what an operator wants to see: where the machine is and how fast, what the
//! spindle does, which line runs, how long it will take.
//!
//! All of it is what the nodes have acknowledged, not what was planned: a job that is held up shows a
//! smaller feed. The spindle is what the program has asked for; no node tells of it.

use std::collections::VecDeque;

use crate::base::machine::AxisProfile;
use crate::base::{Axis, AxisMap, EventKind, Machine};
use crate::wire::job::{Job, Step, dwell_s};
use crate::wire::master::{Master, MasterEvent};

/// How long ago the feed is measured from.
const WINDOW_US: u64 = 300_000;
/// How far apart the positions are that it is measured at: counts are whole steps, and would make the
/// way between two ticks longer than it is.
const APART_US: u64 = 100_000;

/// What there is to see.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reading {
    /// Every axis that the job knows of, in order.
    pub axes: Vec<AxisReading>,
    /// How fast it moves, measured by the clock over some tenths of a second.
    pub feed_mm_min: f64,
    /// What the spindle was told to do last.
    pub spindle: SpindleReading,
    /// NC line being executed; 0 before the first.
    pub line: u32,
    /// Buffer being filled or executed.
    pub buffer: u32,
    /// Ticks acknowledged, pads not counted.
    pub ticks: u64,
    /// How long the rest takes if nothing holds it up; events take what they take.
    pub left_s: f64,
}

/// One axis. Degrees on rotary axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisReading {
    /// Which.
    pub axis: Axis,
    /// In machine coordinates.
    pub machine_mm: f64,
    /// From the work zero of the machine's profile, whatever offsets the program sets.
    pub work_mm: f64,
}

/// What a spindle was told.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SpindleReading {
    /// M3 clockwise, M4 counter-clockwise; none after M5, or before either.
    pub clockwise: Option<bool>,
    /// The speed that was given last, if any.
    pub rpm: Option<f64>,
}

impl SpindleReading {
    fn event(&mut self, kind: EventKind) {
        match kind {
            EventKind::M { code, spindle_rpm, .. } => {
                self.rpm = spindle_rpm.or(self.rpm);
                match code {
                    3 | 4 => self.clockwise = Some(code == 3),
                    2 | 5 | 30 => self.clockwise = None,
                    _ => {}
                }
            }
            EventKind::S(rpm) => self.rpm = Some(rpm),
            _ => {}
        }
    }
}

/// Watches a job.
#[derive(Debug)]
pub struct Live {
    axes: Vec<LiveAxis>,
    tick_s: f64,
    buffers: Vec<BufferEnd>,
    /// Positions that were acknowledged lately, and when.
    way: VecDeque<(u64, AxisMap<i64>)>,
    ticks: u64,
    spindle: SpindleReading,
}

#[derive(Clone, Copy, Debug)]
struct LiveAxis {
    axis: Axis,
    steps_per_mm: f64,
    work_zero_mm: f64,
}

/// Where a buffer ends in the job.
#[derive(Clone, Copy, Debug)]
struct BufferEnd {
    number: u32,
    ticks: u64,
    /// What comes behind its last tick takes so long.
    left_s: f64,
}

impl Live {
    /// Watches a job on a machine.
    pub fn new(job: &Job, machine: &Machine) -> Live {
        let axis = |profile: &AxisProfile| LiveAxis {
            axis: profile.axis,
            steps_per_mm: profile.steps_per_mm,
            work_zero_mm: machine.work_zero_mm[profile.axis],
        };
        let known = machine.axes.iter().filter(|profile| job.axes.contains(profile.axis));
        let mut buffers = Vec::new();
        let (mut ticks, mut left_s) = (job.ticks, 0.0);
        for step in job.steps.iter().rev() {
            match step {
                Step::Event(event) => left_s += dwell_s(event.kind),
                Step::Direct(_) => {}
                Step::Buffer(buffer) => {
                    let time = buffer.time(&machine.bus);
                    let own = buffer.lines.len() as u64;
                    let dwells_s = buffer.events.iter().map(|(_, event)| dwell_s(event.kind));
                    left_s += time.pads_s;
                    buffers.push(BufferEnd { number: buffer.number, ticks, left_s });
                    let motion_s = own as f64 * machine.bus.tick_s();
                    left_s += time.fill_s + motion_s + dwells_s.sum::<f64>();
                    ticks -= own;
                }
            }
        }
        buffers.reverse();
        Live {
            axes: known.map(axis).collect(),
            tick_s: machine.bus.tick_s(),
            buffers,
            way: VecDeque::new(),
            ticks: 0,
            spindle: SpindleReading::default(),
        }
    }

    /// The master has told of something.
    pub fn event(&mut self, event: &MasterEvent) {
        // Whatever it is, the axes rest.
        self.way.clear();
        if let MasterEvent::Event(event) | MasterEvent::Pause(event) = event {
            self.spindle.event(event.kind);
        }
    }

    /// To be called at every tick: the master has got on.
    pub fn update(&mut self, master: &Master) {
        let progress = master.progress();
        if progress.ticks == self.ticks {
            return;
        }
        self.ticks = progress.ticks;
        let is_last = self.end(progress.buffer).is_some_and(|end| end.ticks == progress.ticks);
        if is_last {
            // Zeros follow, which take no time that is known.
            return self.way.clear();
        }
        let from_us = progress.at_us.saturating_sub(WINDOW_US);
        while self.way.len() > 1 && self.way.get(1).is_some_and(|(at_us, _)| *at_us <= from_us) {
            self.way.pop_front();
        }
        // The last one is not kept before it is far enough from the one before.
        if self.way.len() > 1 {
            let before_us = self.way[self.way.len() - 2].0;
            if progress.at_us < before_us + APART_US {
                self.way.pop_back();
            }
        }
        self.way.push_back((progress.at_us, *master.position_steps()));
    }

    /// What there is to see now.
    pub fn reading(&self, master: &Master) -> Reading {
        let (progress, position) = (master.progress(), master.position_steps());
        let axis = |axis: &LiveAxis| {
            let machine_mm = position[axis.axis] as f64 / axis.steps_per_mm;
            let work_mm = machine_mm - axis.work_zero_mm;
            AxisReading { axis: axis.axis, machine_mm, work_mm }
        };
        let left_s = self.end(progress.buffer).map_or(0.0, |end| {
            end.left_s + end.ticks.saturating_sub(progress.ticks) as f64 * self.tick_s
        });
        Reading {
            axes: self.axes.iter().map(axis).collect(),
            feed_mm_min: self.feed_mm_min(),
            spindle: self.spindle,
            line: progress.line,
            buffer: progress.buffer,
            ticks: progress.ticks,
            left_s,
        }
    }

    /// The end of a buffer, or of the first one behind it that is sent.
    fn end(&self, number: u32) -> Option<BufferEnd> {
        let at = self.buffers.partition_point(|end| end.number < number);
        self.buffers.get(at).copied()
    }

    /// The way between the positions of the last tenths of a second, by the time it took.
    fn feed_mm_min(&self) -> f64 {
        let (Some((first_us, _)), Some((last_us, _))) = (self.way.front(), self.way.back()) else {
            return 0.0;
        };
        if first_us == last_us {
            return 0.0;
        }
        let way_mm: f64 = self
            .way
            .iter()
            .zip(self.way.iter().skip(1))
            .map(|((_, from), (_, to))| self.distance_mm(from, to))
            .sum();
        way_mm * 60e6 / (last_us - first_us) as f64
    }

    /// Length as a feed counts it: in X Y Z; of other axes alone in U V W, else in A B C.
    fn distance_mm(&self, from: &AxisMap<i64>, to: &AxisMap<i64>) -> f64 {
        let norm = |of: [Axis; 3]| {
            let axes = self.axes.iter().filter(|axis| of.contains(&axis.axis));
            let change =
                |axis: &LiveAxis| (to[axis.axis] - from[axis.axis]) as f64 / axis.steps_per_mm;
            axes.map(change).map(|mm| mm * mm).sum::<f64>().sqrt()
        };
        [Axis::LINEAR, [Axis::U, Axis::V, Axis::W], [Axis::A, Axis::B, Axis::C]]
            .into_iter()
            .map(norm)
            .find(|length_mm| *length_mm > 0.0)
            .unwrap_or(0.0)
    }
}
