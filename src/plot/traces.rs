//! Ticks → how fast each axis goes, how it speeds up and how often it steps, over the time of motion.
//!
//! Counts are whole steps, so speeds and accelerations are taken over windows of m = [`WINDOW`] ticks, as
//! verification takes them: |q(n+m) - q(n)| / m, and |q(n+m) - 2·q(n) + q(n-m)| / m². Steps are told tick
//! by tick.

use std::collections::VecDeque;

use crate::base::{Axis, AxisMap, Machine, Tick};
use crate::plot::chart::{Along, Chart, Curve, Limit, Scale, Size};
use crate::plot::envelope::Envelope;
use crate::plot::strokes::Stroke;
use crate::plot::style::CURVES;

/// The window of a speed, and half of that of an acceleration, in ticks.
const WINDOW: usize = 10;

/// What is drawn over time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Speed of each axis, and of all along the path.
    Speed,
    /// Acceleration of each axis.
    Acceleration,
    /// Steps a second of each motor.
    StepRate,
}

/// What the axes do, tick by tick.
#[derive(Debug)]
pub struct Traces<'a> {
    machine: &'a Machine,
    tick_s: f64,
    ticks: u64,
    at_steps: AxisMap<i64>,
    /// Positions at the last boundaries.
    window: VecDeque<AxisMap<i64>>,
    path: Envelope,
    axes: Vec<AxisTraces>,
}

#[derive(Debug)]
struct AxisTraces {
    axis: Axis,
    steps_per_mm: f64,
    speed: Envelope,
    acceleration: Envelope,
    steps: Envelope,
    moves: bool,
}

impl<'a> Traces<'a> {
    /// From a place, in motor steps; with ticks of the profile's period unless the steps were made for
    /// another.
    pub fn new(machine: &'a Machine, tick_us: u32, start_steps: AxisMap<i64>) -> Traces<'a> {
        let tick_s = f64::from(tick_us) * 1e-6;
        let envelope = || Envelope::new(tick_s);
        let axis = |profile: &crate::base::machine::AxisProfile| AxisTraces {
            axis: profile.axis,
            steps_per_mm: profile.steps_per_mm,
            speed: envelope(),
            acceleration: envelope(),
            steps: envelope(),
            moves: false,
        };
        Traces {
            machine,
            tick_s,
            ticks: 0,
            at_steps: start_steps,
            window: VecDeque::from([start_steps]),
            path: envelope(),
            axes: machine.axes.iter().map(axis).collect(),
        }
    }

    /// Takes the next tick, and gives the way of it.
    pub fn tick(&mut self, tick: &Tick) -> Stroke {
        let time_s = (self.ticks as f64 + 0.5) * self.tick_s;
        let from_mm = self.at_mm();
        for trace in &mut self.axes {
            let count = tick.counts[trace.axis];
            self.at_steps[trace.axis] += i64::from(count);
            trace.moves |= count != 0;
            trace.steps.add(time_s, f64::from(count).abs() / self.tick_s);
        }
        self.ticks += 1;
        self.window.push_back(self.at_steps);
        if self.window.len() > 2 * WINDOW + 1 {
            self.window.pop_front();
        }
        self.look_back();
        let to_mm = self.at_mm();
        let way_mm: f64 = (0..3).map(|i| (to_mm[i] - from_mm[i]).powi(2)).sum::<f64>().sqrt();
        Stroke { line: tick.line, from_mm, to_mm, speed_mm_s: Some(way_mm / self.tick_s) }
    }

    /// Speeds and accelerations of the windows that end now.
    fn look_back(&mut self) {
        let newest = self.window.len() - 1;
        let window_s = WINDOW as f64 * self.tick_s;
        let Some(before) = newest.checked_sub(WINDOW) else { return };
        let time_s = (self.ticks as f64 - 0.5 * WINDOW as f64) * self.tick_s;
        let mut way_sq = 0.0;
        for trace in &mut self.axes {
            let at_mm = |i: usize| self.window[i][trace.axis] as f64 / trace.steps_per_mm;
            let way_mm = at_mm(newest) - at_mm(before);
            trace.speed.add(time_s, way_mm.abs() / window_s);
            if Axis::LINEAR.contains(&trace.axis) {
                way_sq += way_mm * way_mm;
            }
            if let Some(first) = before.checked_sub(WINDOW) {
                let bend_mm = at_mm(first) - 2.0 * at_mm(before) + at_mm(newest);
                let middle_s = (self.ticks - WINDOW as u64) as f64 * self.tick_s;
                trace.acceleration.add(middle_s, bend_mm.abs() / (window_s * window_s));
            }
        }
        self.path.add(time_s, way_sq.sqrt() / window_s);
    }

    /// Where the machine is, in X, Y and Z.
    fn at_mm(&self) -> [f64; 3] {
        Axis::LINEAR.map(|axis| {
            let profile = self.machine.axis(axis);
            profile.map_or(0.0, |profile| self.at_steps[axis] as f64 / profile.steps_per_mm)
        })
    }

    /// A drawing of one quantity, with the machine's limits. An axis has one colour in all of them; the last
    /// is that of the path.
    pub fn chart(&self, quantity: Quantity) -> Chart {
        let (what, unit) = match quantity {
            Quantity::Speed => ("speed", "mm/s"),
            Quantity::Acceleration => ("acceleration", "mm/s²"),
            Quantity::StepRate => ("steps", "steps/s"),
        };
        let last = CURVES.len() - 1;
        let curve = |name: &str, colour: usize, envelope: &Envelope| Curve {
            name: name.to_owned(),
            colour,
            points: envelope.points(),
        };
        let along =
            (quantity == Quantity::Speed).then(|| curve("along the path", last, &self.path));
        let shown = || self.axes.iter().filter(|trace| trace.moves);
        let of_axis = |trace: &AxisTraces| {
            let envelope = match quantity {
                Quantity::Speed => &trace.speed,
                Quantity::Acceleration => &trace.acceleration,
                Quantity::StepRate => &trace.steps,
            };
            curve(&trace.axis.to_string(), trace.axis as usize % last, envelope)
        };
        let mut limits: Vec<(f64, String)> = Vec::new();
        for trace in shown() {
            let Some(profile) = self.machine.axis(trace.axis) else { continue };
            let limit = match quantity {
                Quantity::Speed => profile.speed_max_mm_s,
                Quantity::Acceleration => profile.accel_max_mm_s2,
                Quantity::StepRate => f64::from(self.machine.count_max(profile)) / self.tick_s,
            };
            match limits.iter_mut().find(|(at, _)| *at == limit) {
                Some((_, name)) => *name += &format!(" {}", trace.axis),
                None => limits.push((limit, format!("limit of {}", trace.axis))),
            }
        }
        let limits = limits.into_iter().map(|(at, name)| Limit { name, along: Along::Y, at });
        Chart {
            title: format!("{what} of the axes"),
            size: Size::default(),
            x: Scale::linear("time of motion, s"),
            y: Scale::linear(&format!("{what}, {unit}")),
            curves: along.into_iter().chain(shown().map(of_axis)).collect(),
            limits: limits.collect(),
        }
    }
}
