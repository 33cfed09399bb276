//! How far a program reaches, and whether the machine does.
//!
//! A program that leaves the travel usually does so in many blocks: each axis and side is reported
//! once, at the block that goes furthest, with the count, and with how far the part may be shifted
//! to fit. What is named in machine coordinates (G53, G28, G30) does not shift with it.

use crate::base::machine::POSITION_MOST;
use crate::base::{Axis, AxisMap, AxisSet, Machine, Point};
use crate::gcode::{Block, Fault, rules};

use super::arc::{bounds_mm, distance};
use super::findings::{Findings, Kept, Place};
use super::motion::{Move, MoveKind};

/// What rounding may add to a position: far below a step, far above the error of a sum.
const ROUNDING_MM: f64 = 1e-6;

/// The extents of all moves so far, and where they leave the travel.
#[derive(Debug)]
pub(super) struct Travel {
    /// The travel; where there is none, the positions that can be told apart in steps.
    limits_mm: AxisMap<[f64; 2]>,
    /// The limits, and by how much rounding may leave them.
    allowed_mm: Bounds,
    /// Reached by what shifts with the part, and by what is named in machine coordinates.
    part_mm: Bounds,
    fixed_mm: Bounds,
    /// What the part has reached of what is allowed: most moves stay within, and add nothing.
    known_mm: Bounds,
    /// Axes that stand where machine coordinates have led them.
    fixed: AxisSet,
    breaches: Vec<Breach>,
    any: bool,
}

/// Least and greatest positions.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    least: Point,
    greatest: Point,
}

impl Bounds {
    /// Of nothing.
    fn nowhere() -> Bounds {
        Bounds::each(|_| [f64::INFINITY, f64::NEG_INFINITY])
    }

    /// Made axis by axis.
    fn each(bounds: impl Fn(Axis) -> [f64; 2]) -> Bounds {
        Bounds {
            least: AxisMap::from_fn(|axis| bounds(axis)[0]),
            greatest: AxisMap::from_fn(|axis| bounds(axis)[1]),
        }
    }

    fn contain(&self, axis: Axis, [least, greatest]: [f64; 2]) -> bool {
        least >= self.least[axis] && greatest <= self.greatest[axis]
    }

    /// Without a branch for each axis.
    #[inline]
    fn contain_point(&self, point: &Point) -> bool {
        let bounds = self.least.0.iter().zip(&self.greatest.0);
        let within =
            bounds.zip(&point.0).map(|((least, greatest), at)| at >= least && at <= greatest);
        within.fold(true, |all, is_within| all & is_within)
    }

    fn extend(&mut self, axis: Axis, [least, greatest]: [f64; 2]) {
        self.least[axis] = self.least[axis].min(least);
        self.greatest[axis] = self.greatest[axis].max(greatest);
    }

    fn of(&self, axis: Axis) -> [f64; 2] {
        [self.least[axis], self.greatest[axis]]
    }
}

/// One axis beyond one end of its travel.
#[derive(Debug)]
struct Breach {
    axis: Axis,
    above: bool,
    reach_mm: f64,
    blocks: u64,
    first_line: u32,
    last_line: u32,
    /// Whether machine coordinates have led to the furthest position.
    is_fixed: bool,
    kept: Kept,
}

impl Travel {
    pub fn new(machine: &Machine, ignore_limits: bool) -> Travel {
        let everywhere = [-POSITION_MOST, POSITION_MOST];
        let limit = |axis| {
            let travel_mm = machine.axis(axis).and_then(|profile| profile.travel_mm);
            travel_mm.filter(|_| !ignore_limits).unwrap_or(everywhere)
        };
        let limits_mm = AxisMap::from_fn(limit);
        Travel {
            limits_mm,
            allowed_mm: Bounds::each(|axis| {
                let [least, greatest] = limits_mm[axis];
                [least - ROUNDING_MM, greatest + ROUNDING_MM]
            }),
            part_mm: Bounds::nowhere(),
            fixed_mm: Bounds::nowhere(),
            known_mm: Bounds::nowhere(),
            fixed: AxisSet::EMPTY,
            breaches: Vec::new(),
            any: false,
        }
    }

    /// Tells what the next move is named in: machine coordinates, or those of the part, in
    /// absolute words or not.
    pub fn named_in(&mut self, step: &Move, is_machine: bool, is_absolute: bool) {
        if !is_machine && self.fixed.is_empty() {
            return;
        }
        let axes = Axis::ALL.into_iter().filter(|axis| step.to[*axis] != step.from[*axis]);
        for axis in axes {
            if is_machine {
                self.fixed.insert(axis);
            } else if is_absolute {
                self.fixed.remove(axis);
            }
        }
    }

    /// Takes a move. Axes whose position a fault has left open are not judged.
    pub fn add(&mut self, step: &Move, block: &Block, place: &Place<'_>, open: AxisSet) {
        if !self.any {
            self.any = true;
            self.point(&step.from, block, place, open);
        }
        self.point(&step.to, block, place, open);
        if let MoveKind::Arc { plane, center_mm, ccw, turns, .. } = step.kind {
            if self.fixed.is_empty() && self.contains_circle(step) {
                return;
            }
            let axes = plane.axes();
            let ends = [step.from, step.to].map(|point| axes.map(|axis| point[axis]));
            let bounds = bounds_mm(ends[0], ends[1], center_mm, ccw, turns);
            for (axis, reach) in axes.into_iter().zip(bounds) {
                self.reach(axis, reach, block, place, open);
            }
        }
        if let MoveKind::Spline { curve, .. } = &step.kind {
            for (axis, reach) in Axis::LINEAR.into_iter().zip(curve.bounds_mm()) {
                self.reach(axis, reach, block, place, open);
            }
        }
    }

    /// Takes a move of the part along these axes, no spline, if that is all there is to it; false if
    /// it has to be told what the move is named in, and then added.
    #[inline]
    pub fn add_along(
        &mut self,
        along: AxisSet,
        step: &Move,
        block: &Block,
        place: &Place<'_>,
    ) -> bool {
        if !self.any || !self.fixed.is_empty() || !self.contains_circle(step) {
            return false;
        }
        // Most moves stay within what is known: that is asked for all axes together.
        if !self.known_mm.contain_point(&step.to) {
            for axis in along.iter() {
                let at = [step.to[axis]; 2];
                if !self.known_mm.contain(axis, at) {
                    self.reach(axis, at, block, place, AxisSet::EMPTY);
                }
            }
        }
        true
    }

    /// Whether the circle of an arc adds nothing; of other moves there is none.
    #[inline]
    fn contains_circle(&self, step: &Move) -> bool {
        let MoveKind::Arc { plane, center_mm, .. } = step.kind else { return true };
        let axes = plane.axes();
        let radius_mm = |point: &Point| distance(axes.map(|axis| point[axis]), center_mm);
        let radius_mm = radius_mm(&step.from).max(radius_mm(&step.to));
        let is_known = |(axis, center): (Axis, f64)| {
            self.known_mm.contain(axis, [center - radius_mm, center + radius_mm])
        };
        axes.into_iter().zip(center_mm).all(is_known)
    }

    fn point(&mut self, point: &Point, block: &Block, place: &Place<'_>, open: AxisSet) {
        for axis in Axis::ALL {
            let at = [point[axis]; 2];
            if !self.known_mm.contain(axis, at) || self.fixed.contains(axis) {
                self.reach(axis, at, block, place, open);
            }
        }
    }

    fn reach(&mut self, axis: Axis, at: [f64; 2], block: &Block, place: &Place<'_>, open: AxisSet) {
        let is_fixed = self.fixed.contains(axis);
        if is_fixed {
            self.fixed_mm.extend(axis, at);
        } else {
            self.part_mm.extend(axis, at);
            let ([least, greatest], allowed) = (self.part_mm.of(axis), &self.allowed_mm);
            self.known_mm.least[axis] = least.max(allowed.least[axis]);
            self.known_mm.greatest[axis] = greatest.min(allowed.greatest[axis]);
        }
        if open.contains(axis) {
            return;
        }
        if at[0] < self.allowed_mm.least[axis] {
            self.breach(axis, false, at[0], block, place);
        }
        if at[1] > self.allowed_mm.greatest[axis] {
            self.breach(axis, true, at[1], block, place);
        }
    }

    #[cold]
    fn breach(&mut self, axis: Axis, above: bool, reach_mm: f64, block: &Block, place: &Place<'_>) {
        let known = self.breaches.iter_mut().find(|b| b.axis == axis && b.above == above);
        let breach = match known {
            Some(breach) => {
                breach.blocks += u64::from(breach.last_line != place.line);
                breach.last_line = place.line;
                let further =
                    if above { reach_mm > breach.reach_mm } else { reach_mm < breach.reach_mm };
                if !further {
                    return;
                }
                breach
            }
            None => {
                self.breaches.push(Breach {
                    axis,
                    above,
                    reach_mm,
                    blocks: 1,
                    first_line: place.line,
                    last_line: place.line,
                    is_fixed: false,
                    kept: Kept::default(),
                });
                let Some(breach) = self.breaches.last_mut() else { return };
                breach
            }
        };
        breach.reach_mm = reach_mm;
        breach.is_fixed = self.fixed.contains(axis);
        breach.kept.keep(axis, block, *place);
    }

    /// Reports every breach of the travel.
    pub fn report(&self, findings: &mut Findings) {
        for breach in &self.breaches {
            let [least, greatest] = self.limits_mm[breach.axis];
            let axis = breach.axis;
            let unit = if axis.is_rotary() { "deg" } else { "mm" };
            let (by, [below, above]) = if breach.above {
                (breach.reach_mm - greatest, rules::limits(axis).each_ref())
            } else {
                (least - breach.reach_mm, rules::limits(axis).each_ref())
            };
            let rule = if breach.above { above } else { below };
            let mut message = format!(
                "{axis} reaches {:.3} {unit}, {by:.3} {unit} outside its travel of {least} to \
                 {greatest} {unit} (machine coordinates)",
                breach.reach_mm
            );
            if breach.blocks > 1 {
                message += &format!(
                    "; the furthest of {} blocks, the first on line {}",
                    breach.blocks, breach.first_line
                );
            }
            let (start, end) = breach.kept.span;
            let fault = Fault::new(rule, start, end, message).help(self.remedy(breach, unit));
            findings.add(fault, breach.kept.place());
        }
    }

    /// What to do about an axis that leaves its travel.
    fn remedy(&self, breach: &Breach, unit: &str) -> String {
        let axis = breach.axis;
        let [least, greatest] = self.shift_mm(axis);
        let [low, high] = self.part_mm.of(axis);
        if breach.is_fixed {
            format!(
                "{axis} is led there by machine coordinates (G53, G28, G30): shifting the part does not help"
            )
        } else if least > greatest {
            format!(
                "the part takes {:.3} {unit} of {axis}, {:.3} {unit} more than the travel: it does \
                 not fit on this machine",
                high - low,
                least - greatest
            )
        } else {
            let by = |shift: f64| format!("{shift:+.3}");
            format!(
                "shift the part (its work zero, or the start) by {axis} {} to {} {unit}, and it fits",
                by(rounded_inwards(least, f64::ceil)),
                by(rounded_inwards(greatest, f64::floor))
            )
        }
    }

    /// From where to where the part may be shifted.
    fn shift_mm(&self, axis: Axis) -> [f64; 2] {
        let ([least, greatest], [low, high]) = (self.limits_mm[axis], self.part_mm.of(axis));
        [least - low, greatest - high]
    }

    /// How far the part may be shifted along each axis and still fit: the least and the greatest
    /// shift, in mm or degrees. Where the least is greater, the part is larger than the travel, by the
    /// difference. None where there is no travel, or nothing moves.
    pub fn shifts_mm(&self, machine: &Machine) -> AxisMap<Option<[f64; 2]>> {
        AxisMap::from_fn(|axis| {
            let travel_mm = machine.axis(axis).and_then(|profile| profile.travel_mm);
            let is_judged =
                travel_mm == Some(self.limits_mm[axis]) && self.part_mm.least[axis].is_finite();
            is_judged.then(|| self.shift_mm(axis))
        })
    }

    /// Least and greatest position of each axis of the machine; none where nothing moved.
    pub fn extents_mm(&self, machine: &Machine) -> AxisMap<Option<[f64; 2]>> {
        let all = |axis| {
            let ([a, b], [c, d]) = (self.part_mm.of(axis), self.fixed_mm.of(axis));
            [f64::min(a, c), f64::max(b, d)]
        };
        AxisMap::from_fn(|axis| (self.any && machine.axis(axis).is_some()).then(|| all(axis)))
    }
}

/// A shift in whole thousandths, on the safe side of one that rounding has made too long.
fn rounded_inwards(shift: f64, round: impl Fn(f64) -> f64) -> f64 {
    let thousandths = shift * 1000.0;
    let nearest = thousandths.round();
    // What is a whole number but for rounding stays one.
    let whole = if (thousandths - nearest).abs() < 1e-3 { nearest } else { round(thousandths) };
    whole / 1000.0 + 0.0
}
