//! Segment → the constants of its difference equations, which every node runs by itself
//! (seed 004, section 3.7.2, Method B).
//!
//! ```text
//! arc, from its centre:  x(k) = A·x(k-1) - B·y(k-1)     (3.1)     line:  x(k) = E·x(k-1) + F  (3.3)
//!                        y(k) = C·x(k-1) + D·y(k-1)     (3.2)            y(k) = G·y(k-1) + H  (3.4)
//! ```
//!
//! Positions are in steps. With n ticks for a sweep θ, A and D are ρ·cos(θ/n), B and C ρ·sin(θ/n) (eq. 6.8),
//! where ρ is 1, or the n-th root of the radii's ratio; where the axes have steps of different size, B
//! and C have their ratio too. E and G are 1, F and H the way a tick. All other axes of an arc go as a
//! line does.
//!
//! The seed's own host took sin δ for δ and cos δ for 1 (eq. 6.9 to 6.12): [`Constants::SmallAngle`], whose
//! circles grow by half of δ² at every step.
//!
//! The equations advance by the same share of the segment in every tick, so a segment runs at one feed:
//! the seed has no ramps (the motor drivers made them, note 2 of chapter 7). So it is here. A segment
//! takes whole ticks, rounded up: its feed is what was asked for, or a little less, and its end is met.
//! Feeds beyond what an axis can do are lowered to that. A spline is told as chords that leave it by a
//! quarter of a step at most.
//!
//! How exact a node's own arithmetic is, says [`node`]; what that comes to, [`drift`].

pub mod drift;
pub mod node;

use crate::base::{Axis, AxisMap, Machine, Plane, Point};
use crate::path::{Curve, Segment};

/// A spline's chords leave it by so much of a step at most.
const CHORD_STEPS: f64 = 0.25;

/// A stretch of a spline is halved so often at most.
const HALVED_MAX: u32 = 20;

/// What rounding may add to a whole number of ticks.
const WHOLE: f64 = 1e-9;

/// How the constants of an arc are made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Constants {
    /// By sine and cosine of the angle a tick (eq. 6.8).
    #[default]
    Exact,
    /// By the angle itself, and 1 (eq. 6.11 and 6.12).
    SmallAngle,
}

/// The equations of one segment, as the host sends them.
#[derive(Clone, Debug, PartialEq)]
pub struct Equations {
    /// What they draw: a line or an arc.
    pub segment: Segment,
    /// How many times they are applied.
    pub ticks: u64,
    /// The way a tick of every axis that goes as a line, in steps: F, H and the like.
    pub way_steps: AxisMap<f64>,
    /// The axes that turn, if two do.
    pub turn: Option<Turn>,
}

/// The equations of an arc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    /// The plane whose first axis is x and whose second is y.
    pub plane: Plane,
    /// The centre, in steps.
    pub center_steps: [f64; 2],
    /// A, B, C and D.
    pub constants: [f64; 4],
}

impl Turn {
    /// The greatest of the constants.
    pub fn constant_max(&self) -> f64 {
        self.constants.iter().fold(0.0, |most, constant| most.max(constant.abs()))
    }
}

/// The equations of a segment on a machine; those of a spline chord by chord.
pub fn equations(segment: &Segment, machine: &Machine, constants: Constants) -> Vec<Equations> {
    let pieces = match &segment.curve {
        Curve::Line | Curve::Arc(_) => vec![segment.clone()],
        Curve::Spline(_) => chords(segment, machine),
    };
    pieces.into_iter().map(|piece| equations_of(piece, machine, constants)).collect()
}

fn equations_of(segment: Segment, machine: &Machine, constants: Constants) -> Equations {
    let length_mm = segment.length_mm();
    let exact_ticks = length_mm / speed_mm_s(&segment, machine) / machine.bus.tick_s();
    let ticks = ((exact_ticks * (1.0 - WHOLE)).ceil() as u64).max(1);
    let scale = steps_per_mm(machine);
    let mut way_steps = AxisMap::from_fn(|axis| {
        (segment.to_mm[axis] - segment.from_mm[axis]) * scale[axis] / ticks as f64
    });
    let turn = match &segment.curve {
        Curve::Arc(arc) => {
            let [x, y] = arc.plane.axes();
            (way_steps[x], way_steps[y]) = (0.0, 0.0);
            let shrink = libm::pow(arc.radius_to_mm / arc.radius_from_mm, 1.0 / ticks as f64);
            let angle_rad = arc.sweep_rad / ticks as f64;
            let (sin, cos) = match constants {
                Constants::Exact => libm::sincos(angle_rad),
                Constants::SmallAngle => (angle_rad, 1.0),
            };
            let ratio = scale[x] / scale[y];
            Some(Turn {
                plane: arc.plane,
                center_steps: [arc.center_mm[0] * scale[x], arc.center_mm[1] * scale[y]],
                constants: [cos, sin * ratio, sin / ratio, cos].map(|constant| shrink * constant),
            })
        }
        Curve::Line | Curve::Spline(_) => None,
    };
    Equations { segment, ticks, way_steps, turn }
}

/// Steps a mm of every axis; 0 on axes that the machine lacks.
pub fn steps_per_mm(machine: &Machine) -> AxisMap<f64> {
    AxisMap::from_fn(|axis| machine.axis(axis).map_or(0.0, |profile| profile.steps_per_mm))
}

/// The feed, or as much as the axes that move can do.
fn speed_mm_s(segment: &Segment, machine: &Machine) -> f64 {
    super::axes_speed_mm_s(segment, machine).min(segment.feed_mm_s.unwrap_or(f64::INFINITY))
}

/// How much the speed of every axis changes at once where a segment begins, in mm/s: at rest before
/// the first.
pub fn jump(before: Option<&Equations>, piece: &Equations, machine: &Machine) -> Point {
    let speeds = |piece: &Equations, share: f64| {
        let tangent = piece.segment.rates_at(share).tangent;
        let speed_mm_s = piece.speed_mm_s(machine);
        AxisMap::from_fn(|axis| tangent[axis] * speed_mm_s)
    };
    let old = before.map_or(Point::ZERO, |before| speeds(before, 1.0));
    let new = speeds(piece, 0.0);
    AxisMap::from_fn(|axis| (new[axis] - old[axis]).abs())
}

/// A spline as lines: halved where it leaves its chord.
fn chords(segment: &Segment, machine: &Machine) -> Vec<Segment> {
    let scale = steps_per_mm(machine);
    let is_near = |from: f64, to: f64| {
        [0.25, 0.5, 0.75].into_iter().all(|part| {
            let place = segment.point_at(from + part * (to - from));
            let [start, end] = [from, to].map(|share| segment.point_at(share));
            let off = |axis: Axis| {
                let chord = start[axis] + part * (end[axis] - start[axis]);
                (place[axis] - chord) * scale[axis]
            };
            Axis::ALL.into_iter().map(|axis| off(axis).powi(2)).sum::<f64>() <= CHORD_STEPS.powi(2)
        })
    };
    let mut shares = vec![0.0];
    // Still to do, the next on top: the end of a stretch, and how often it has been halved.
    let mut ends = vec![(1.0, 0)];
    while let (Some((end, halved)), Some(from)) = (ends.pop(), shares.last().copied()) {
        if halved < HALVED_MAX && !is_near(from, end) {
            ends.extend([(end, halved + 1), (0.5 * (from + end), halved + 1)]);
        } else {
            shares.push(end);
        }
    }
    let chord = |pair: &[f64]| Segment {
        from_mm: segment.point_at(pair[0]),
        to_mm: segment.point_at(pair[1]),
        curve: Curve::Line,
        ..segment.clone()
    };
    let chords = shares.windows(2).map(chord);
    chords.filter(|chord| chord.from_mm != chord.to_mm).collect()
}

impl Equations {
    /// Where the equations would be after so many ticks if numbers had no end, in steps.
    pub fn at_steps(&self, tick: u64, scale: &AxisMap<f64>) -> AxisMap<f64> {
        let place = self.segment.point_at(tick as f64 / self.ticks as f64);
        AxisMap::from_fn(|axis| place[axis] * scale[axis])
    }

    /// The speed along the path that comes of whole ticks.
    pub fn speed_mm_s(&self, machine: &Machine) -> f64 {
        self.segment.length_mm() / (self.ticks as f64 * machine.bus.tick_s())
    }
}
