//! Segment → interpolation pulses (seed 001, sections 2 to 4): how many a block needs, and what each of
//! them does.
//!
//! ```text
//!       ·  Y leads: every pulse moves Y by one,      The count of pulses FP is the way of the axis that
//!      ·   X moves or not, whichever is nearer       leads. From angle 0 on, at radius R:
//!      ·   to the curve                              up to 45°       FP = R·sin θ
//!       ·                                            45° to 90°      FP = R·(√2 - cos θ)
//!  45°.   X leads above                              and so on, octant by octant: 4·√2·R all round
//! ```
//!
//! On a line the longest axis leads. The board is told FP, rounded to a whole number, as an unsigned
//! integer of four bytes after the letter P. The paper prints neither the order of these bytes (here the
//! lowest first, as its PC keeps them) nor what else stands in the command, nor where a helix or a
//! spline would come from. Here the axis across the plane of a helix follows the angle, a pulse of it a
//! pulse at most; a steeper one is refused, and so is a spline.
//!
//! The pulses themselves are made as by such hardware, one by one from the last position. Whether they
//! are the chip's own to the last one the paper does not let know.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::base::{Axis, AxisMap, Machine, Point};
use crate::path::{Arc, Curve, Segment};

/// Why a segment has no pulses.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoPulses {
    /// The interpolator takes lines and arcs.
    #[error("line {line}: a spline, and the interpolator takes lines and arcs only")]
    Spline {
        /// Line of the program.
        line: u32,
    },
    /// The axis across the plane never leads.
    #[error(
        "line {line}: {axis} would need {steepest:.2} pulses in one of the arc's: the helix is too steep"
    )]
    Steep {
        /// Line of the program.
        line: u32,
        /// The axis.
        axis: Axis,
        /// Most of its pulses to one of the arc.
        steepest: f64,
    },
    /// The count has four bytes.
    #[error("line {line}: {pulses} pulses, and the command has room for {max}", max = u32::MAX)]
    TooMany {
        /// Line of the program.
        line: u32,
        /// How many there would be.
        pulses: u64,
    },
}

/// What the board's command holds of a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Count {
    /// The way of the leading axis, in pulses, not yet rounded.
    pub exact: f64,
    /// The count of interpolation pulses, FP.
    pub pulses: u32,
}

impl Count {
    /// The letter P and the count, the lowest byte first.
    pub fn command(&self) -> [u8; 5] {
        let [a, b, c, d] = self.pulses.to_le_bytes();
        [b'P', a, b, c, d]
    }
}

/// FP by the paper's formula: of an arc of a radius in pulses that begins on an axis and turns by an angle
/// up to 90°.
pub fn octant_pulses(radius_pulses: f64, angle_rad: f64) -> f64 {
    if angle_rad <= PI / 4.0 {
        radius_pulses * libm::sin(angle_rad)
    } else {
        radius_pulses * (2.0_f64.sqrt() - libm::cos(angle_rad))
    }
}

/// The count of interpolation pulses of a segment.
///
/// # Errors
/// When it is a spline, or the count has more than 32 bits.
pub fn count(segment: &Segment, machine: &Machine) -> Result<Count, NoPulses> {
    let line = segment.line;
    let exact = match &segment.curve {
        Curve::Line => longest(segment, machine),
        Curve::Arc(arc) => {
            let scale = plane_scale(arc, machine);
            let steepest = steepest(segment, arc, machine);
            if steepest > 1.0 {
                return Err(NoPulses::Steep { line, axis: arc.plane.normal(), steepest });
            }
            Stretches::new(arc, scale).map(|stretch| stretch.way(arc, scale)).sum()
        }
        Curve::Spline(_) => return Err(NoPulses::Spline { line }),
    };
    let pulses = exact.round() as u64;
    match u32::try_from(pulses) {
        Ok(pulses) => Ok(Count { exact, pulses }),
        Err(_) => Err(NoPulses::TooMany { line, pulses }),
    }
}

/// Whole pulses of every axis between the ends of a segment.
fn ways(segment: &Segment, machine: &Machine) -> AxisMap<i64> {
    let (from, to) =
        (machine.nearest_steps(&segment.from_mm), machine.nearest_steps(&segment.to_mm));
    AxisMap::from_fn(|axis| to[axis] - from[axis])
}

fn longest(segment: &Segment, machine: &Machine) -> f64 {
    ways(segment, machine).0.iter().fold(0, |most, way| way.unsigned_abs().max(most)) as f64
}

/// Most pulses of the axis across an arc's plane to one of the arc: the leading axis makes fewest an angle
/// where both go at the same rate.
fn steepest(segment: &Segment, arc: &Arc, machine: &Machine) -> f64 {
    let [x, y] = plane_scale(arc, machine);
    let radius_mm = arc.radius_from_mm.min(arc.radius_to_mm);
    let least_a_radian = radius_mm * x * y / libm::hypot(x, y);
    let across = ways(segment, machine)[arc.plane.normal()].unsigned_abs() as f64;
    across / arc.sweep_rad.abs() / least_a_radian
}

/// Pulses a mm of the axes of an arc's plane.
fn plane_scale(arc: &Arc, machine: &Machine) -> [f64; 2] {
    arc.plane.axes().map(|axis| machine.axis(axis).map_or(1.0, |profile| profile.steps_per_mm))
}

/// A stretch of an arc on which one axis leads.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    /// The plane's first or second axis.
    leads: usize,
    /// Shares of the sweep at its ends.
    shares: [f64; 2],
}

impl Stretch {
    /// Signed way of the leading axis, in pulses.
    fn signed_way(&self, arc: &Arc, scale: [f64; 2]) -> f64 {
        let [from, to] = self.shares.map(|share| arc.point_at(share)[self.leads]);
        (to - from) * scale[self.leads]
    }

    fn way(&self, arc: &Arc, scale: [f64; 2]) -> f64 {
        self.signed_way(arc, scale).abs()
    }
}

/// The stretches of an arc, in order: another axis leads where both go at the same rate in pulses, at
/// 45° and every quarter turn on where their pulses are equal.
#[derive(Clone, Debug)]
struct Stretches {
    angle_from_rad: f64,
    sweep_rad: f64,
    /// Where the second axis hands over to the first, between 0 and 90°.
    equal_rad: f64,
    share: f64,
}

impl Stretches {
    fn new(arc: &Arc, scale: [f64; 2]) -> Stretches {
        let equal_rad = libm::atan(scale[1] / scale[0]);
        let (angle_from_rad, sweep_rad) = (arc.angle_from_rad, arc.sweep_rad);
        Stretches { angle_from_rad, sweep_rad, equal_rad, share: 0.0 }
    }

    /// The next angle at which another axis leads, in the direction of travel.
    fn next_change(&self, angle_rad: f64) -> f64 {
        let forward = self.sweep_rad > 0.0;
        let half_turn = ((angle_rad + FRAC_PI_2) / PI).floor() * PI;
        let around = [-PI, 0.0, PI].into_iter().flat_map(|turn| {
            [-self.equal_rad, self.equal_rad].map(|equal| half_turn + turn + equal)
        });
        // A change that lies closer is the one just passed.
        const PASSED_RAD: f64 = 1e-9;
        if forward {
            around.filter(|at| *at > angle_rad + PASSED_RAD).fold(f64::INFINITY, f64::min)
        } else {
            around.filter(|at| *at < angle_rad - PASSED_RAD).fold(f64::NEG_INFINITY, f64::max)
        }
    }
}

impl Iterator for Stretches {
    type Item = Stretch;

    fn next(&mut self) -> Option<Stretch> {
        if self.share >= 1.0 {
            return None;
        }
        let from = self.share;
        let change_rad = self.next_change(self.angle_from_rad + self.sweep_rad * from);
        self.share = ((change_rad - self.angle_from_rad) / self.sweep_rad).min(1.0);
        let middle_rad = self.angle_from_rad + self.sweep_rad * 0.5 * (from + self.share);
        // Around 0 and 180° the second axis goes as the sine and leads.
        let from_axis_rad = (middle_rad - (middle_rad / PI).round() * PI).abs();
        let leads = usize::from(from_axis_rad < self.equal_rad);
        Some(Stretch { leads, shares: [from, self.share] })
    }
}

/// What pulses come to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Made {
    /// Interpolation pulses made.
    pub pulses: u64,
    /// Pulses of every axis.
    pub axis_pulses: AxisMap<u64>,
    /// Greatest distance from the curve, in pulses: of an axis from the line beside it, of an arc along
    /// the radius.
    pub error_pulses: f64,
}

/// The pulse-by-pulse interpolator: where it stands, in pulses of every axis.
#[derive(Clone, Debug)]
pub struct Interpolator<'m> {
    machine: &'m Machine,
    /// Where it stands.
    pub position: AxisMap<i64>,
}

impl<'m> Interpolator<'m> {
    /// An interpolator that stands at a position.
    pub fn new(machine: &'m Machine, position: AxisMap<i64>) -> Interpolator<'m> {
        Interpolator { machine, position }
    }

    /// Makes the pulses of a segment, to its end exactly; `at_pulse` is told the distance from the curve
    /// after each, in pulses.
    ///
    /// # Errors
    /// When it is a spline, or its count has more than 32 bits.
    pub fn run(
        &mut self,
        segment: &Segment,
        mut at_pulse: impl FnMut(f64),
    ) -> Result<Made, NoPulses> {
        count(segment, self.machine)?;
        let mut made = Made::default();
        let mut each = |before: &AxisMap<i64>, after: &AxisMap<i64>, error: f64| {
            made.pulses += 1;
            for (sum, (a, b)) in made.axis_pulses.0.iter_mut().zip(before.0.iter().zip(&after.0)) {
                *sum += a.abs_diff(*b);
            }
            made.error_pulses = made.error_pulses.max(error);
            at_pulse(error);
        };
        match &segment.curve {
            Curve::Line => self.line(segment, &mut each),
            Curve::Arc(arc) => self.arc(segment, arc, &mut each),
            Curve::Spline(_) => {}
        }
        Ok(made)
    }

    /// The longest axis moves at every pulse, each other where the line is half a pulse ahead of it.
    fn line(&mut self, segment: &Segment, each: &mut Each<'_>) {
        let to = self.machine.nearest_steps(&segment.to_mm);
        let line = PulseLine::new(segment, self.machine);
        let way = to[line.lead] - self.position[line.lead];
        for _ in 0..way.abs() {
            let before = self.position;
            self.position[line.lead] += way.signum();
            let exact = line.at(self.position[line.lead]);
            for axis in Axis::ALL.into_iter().filter(|axis| *axis != line.lead) {
                let target = exact[axis].round_ties_even() as i64;
                self.position[axis] += (target - self.position[axis]).signum();
            }
            each(&before, &self.position, line.off_pulses(&self.position));
        }
        self.finish(&to, each, |position| line.off_pulses(position));
    }

    /// Rounding of both ends may leave an axis a pulse away.
    fn finish(
        &mut self,
        to: &AxisMap<i64>,
        each: &mut Each<'_>,
        off_pulses: impl Fn(&AxisMap<i64>) -> f64,
    ) {
        while self.position != *to {
            let before = self.position;
            for (at, to) in self.position.0.iter_mut().zip(&to.0) {
                *at += (*to - *at).signum();
            }
            each(&before, &self.position, off_pulses(&self.position));
        }
    }

    fn arc(&mut self, segment: &Segment, arc: &Arc, each: &mut Each<'_>) {
        let scale = plane_scale(arc, self.machine);
        let curve = PulseArc { segment, arc, scale, machine: self.machine };
        let axes = arc.plane.axes();
        for stretch in Stretches::new(arc, scale) {
            let lead = axes[stretch.leads];
            let end = arc.point_at(stretch.shares[1])[stretch.leads] * scale[stretch.leads];
            let sign = stretch.signed_way(arc, scale).signum() as i64;
            let pulses = sign * (end.round_ties_even() as i64 - self.position[lead]);
            for _ in 0..pulses {
                let before = self.position;
                self.position[lead] += sign;
                self.follow(&curve, axes[1 - stretch.leads], &stretch);
                let across = curve.across(&self.position, &stretch);
                self.step_across(&curve, across);
                each(&before, &self.position, curve.off_pulses(&self.position, &stretch));
            }
        }
        let to = self.machine.nearest_steps(&segment.to_mm);
        let last = Stretch { leads: 0, shares: [1.0, 1.0] };
        self.finish(&to, each, |position| curve.off_pulses(position, &last));
    }

    /// The axis that does not lead moves by a pulse, or not, whichever is nearer to the curve.
    fn follow(&mut self, curve: &PulseArc<'_>, axis: Axis, stretch: &Stretch) {
        let stay = self.position[axis];
        let mut best = (f64::INFINITY, stay);
        for candidate in [stay, stay - 1, stay + 1] {
            self.position[axis] = candidate;
            let off_mm = curve.radial_mm(&self.position, stretch).abs();
            if off_mm < best.0 {
                best = (off_mm, candidate);
            }
        }
        self.position[axis] = best.1;
    }

    fn step_across(&mut self, curve: &PulseArc<'_>, target: i64) {
        let normal = curve.arc.plane.normal();
        self.position[normal] += (target - self.position[normal]).signum();
    }
}

/// What is told of a pulse: the positions before and after it, and the distance from the curve.
type Each<'a> = dyn FnMut(&AxisMap<i64>, &AxisMap<i64>, f64) + 'a;

/// A line, in pulses.
struct PulseLine {
    lead: Axis,
    from: Point,
    way: Point,
}

impl PulseLine {
    fn new(segment: &Segment, machine: &Machine) -> PulseLine {
        let scale = super::difference::steps_per_mm(machine);
        let from = AxisMap::from_fn(|axis| segment.from_mm[axis] * scale[axis]);
        let way = AxisMap::from_fn(|axis| segment.to_mm[axis] * scale[axis] - from[axis]);
        let longer =
            |lead: Axis, axis: Axis| if way[axis].abs() > way[lead].abs() { axis } else { lead };
        PulseLine { lead: Axis::ALL.into_iter().fold(Axis::X, longer), from, way }
    }

    /// Where the line is when its longest axis is at a position.
    fn at(&self, lead: i64) -> Point {
        let share = (lead as f64 - self.from[self.lead]) / self.way[self.lead];
        AxisMap::from_fn(|axis| self.from[axis] + share * self.way[axis])
    }

    /// How far an axis is from there at most.
    fn off_pulses(&self, position: &AxisMap<i64>) -> f64 {
        let exact = self.at(position[self.lead]);
        let offs = position.0.iter().zip(&exact.0).map(|(at, exact)| (*at as f64 - exact).abs());
        offs.fold(0.0, f64::max)
    }
}

/// An arc, seen from positions in pulses.
struct PulseArc<'a> {
    segment: &'a Segment,
    arc: &'a Arc,
    scale: [f64; 2],
    machine: &'a Machine,
}

impl PulseArc<'_> {
    /// A position as seen from the centre, in mm.
    fn center_to_mm(&self, position: &AxisMap<i64>) -> [f64; 2] {
        let axes = self.arc.plane.axes();
        [0, 1].map(|i| position[axes[i]] as f64 / self.scale[i] - self.arc.center_mm[i])
    }

    /// The share of the sweep at a position of a stretch.
    fn share(&self, position: &AxisMap<i64>, stretch: &Stretch) -> f64 {
        let [x, y] = self.center_to_mm(position);
        let middle = 0.5 * (stretch.shares[0] + stretch.shares[1]);
        let turned = libm::atan2(y, x) - (self.arc.angle_from_rad + self.arc.sweep_rad * middle);
        let near = turned - (turned / TAU).round() * TAU;
        (middle + near / self.arc.sweep_rad).clamp(0.0, 1.0)
    }

    /// How far outside of the curve a position lies, in mm.
    fn radial_mm(&self, position: &AxisMap<i64>, stretch: &Stretch) -> f64 {
        let [x, y] = self.center_to_mm(position);
        let (from, to) = (self.arc.radius_from_mm, self.arc.radius_to_mm);
        let share = if from == to { 0.0 } else { self.share(position, stretch) };
        libm::hypot(x, y) - (from + (to - from) * share)
    }

    /// Where the axis across the plane belongs.
    fn across(&self, position: &AxisMap<i64>, stretch: &Stretch) -> i64 {
        let normal = self.arc.plane.normal();
        if self.segment.from_mm[normal] == self.segment.to_mm[normal] {
            return position[normal];
        }
        self.across_exact(position, stretch).round_ties_even() as i64
    }

    fn across_exact(&self, position: &AxisMap<i64>, stretch: &Stretch) -> f64 {
        let normal = self.arc.plane.normal();
        let (from, to) = (self.segment.from_mm[normal], self.segment.to_mm[normal]);
        let scale = self.machine.axis(normal).map_or(0.0, |profile| profile.steps_per_mm);
        (from + (to - from) * self.share(position, stretch)) * scale
    }

    /// Distance from the curve in pulses: in the plane, or across it if that is more.
    fn off_pulses(&self, position: &AxisMap<i64>, stretch: &Stretch) -> f64 {
        let coarsest = self.scale[0].min(self.scale[1]);
        let radial = self.radial_mm(position, stretch) * coarsest;
        let normal = self.arc.plane.normal();
        if self.segment.from_mm[normal] == self.segment.to_mm[normal] {
            return radial.abs();
        }
        let across = position[normal] as f64 - self.across_exact(position, stretch);
        radial.abs().max(across.abs())
    }
}
