//! How far a program reaches, and whether the machine does.
//!
//! A program that leaves the travel usually does so in many blocks: each axis and side is reported
//! once, at the block that goes furthest, with the count.

use crate::base::machine::POSITION_MOST;
use crate::base::{Axis, AxisMap, AxisSet, Machine, Point};
use crate::gcode::{Block, Fault, rules};

use super::arc::{bounds_mm, distance};
use super::findings::{Findings, Place};
use super::motion::{Move, MoveKind};

/// What rounding may add to a position: far below a step, far above the error of a sum.
const ROUNDING_MM: f64 = 1e-6;

/// The extents of all moves so far, and where they leave the travel.
#[derive(Debug)]
pub(super) struct Travel {
    axes: Vec<Axis>,
    /// The travel; where there is none, the positions that can be told apart in steps.
    limits_mm: AxisMap<[f64; 2]>,
    /// The limits, and by how much rounding may leave them.
    allowed_mm: Bounds,
    reached_mm: Bounds,
    breaches: Vec<Breach>,
    any: bool,
}

/// Least and greatest positions: two points, so that a move is held against them in a few
/// instructions for all axes.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    least: Point,
    greatest: Point,
}

impl Bounds {
    fn contain(&self, axis: Axis, [least, greatest]: [f64; 2]) -> bool {
        least >= self.least[axis] && greatest <= self.greatest[axis]
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
    line: u32,
    text: Vec<u8>,
    calls: Vec<u32>,
    file: Option<String>,
    span: (u32, u32),
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
            axes: machine.axes.iter().map(|profile| profile.axis).collect(),
            limits_mm,
            allowed_mm: Bounds {
                least: AxisMap::from_fn(|axis| limits_mm[axis][0] - ROUNDING_MM),
                greatest: AxisMap::from_fn(|axis| limits_mm[axis][1] + ROUNDING_MM),
            },
            reached_mm: Bounds {
                least: AxisMap::from_fn(|_| f64::INFINITY),
                greatest: AxisMap::from_fn(|_| f64::NEG_INFINITY),
            },
            breaches: Vec::new(),
            any: false,
        }
    }

    /// Takes a move. Axes whose position a fault has left open are not judged.
    pub fn add(&mut self, step: &Move, block: &Block, place: Place<'_>, open: AxisSet) {
        if !self.any {
            self.any = true;
            self.point(&step.from, block, place, open);
        }
        self.point(&step.to, block, place, open);
        if let MoveKind::Arc { plane, center_mm, ccw, turns, .. } = step.kind {
            let axes = plane.axes();
            let ends = [step.from, step.to].map(|point| axes.map(|axis| point[axis]));
            let radius_mm = distance(ends[0], center_mm).max(distance(ends[1], center_mm));
            let adds_nothing = |(axis, center): (Axis, f64)| {
                let circle = [center - radius_mm, center + radius_mm];
                self.reached_mm.contain(axis, circle) && self.allowed_mm.contain(axis, circle)
            };
            if axes.into_iter().zip(center_mm).all(adds_nothing) {
                return;
            }
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

    fn point(&mut self, point: &Point, block: &Block, place: Place<'_>, open: AxisSet) {
        let Bounds { least, greatest } = &mut self.reached_mm;
        let mut is_beyond = false;
        for (i, at) in point.0.into_iter().enumerate() {
            least.0[i] = if at < least.0[i] { at } else { least.0[i] };
            greatest.0[i] = if at > greatest.0[i] { at } else { greatest.0[i] };
            is_beyond |= (at < self.allowed_mm.least.0[i]) | (at > self.allowed_mm.greatest.0[i]);
        }
        if is_beyond {
            for i in 0..self.axes.len() {
                let axis = self.axes[i];
                self.reach(axis, [point[axis]; 2], block, place, open);
            }
        }
    }

    fn reach(&mut self, axis: Axis, at: [f64; 2], block: &Block, place: Place<'_>, open: AxisSet) {
        let Bounds { least, greatest } = &mut self.reached_mm;
        least[axis] = least[axis].min(at[0]);
        greatest[axis] = greatest[axis].max(at[1]);
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
    fn breach(&mut self, axis: Axis, above: bool, reach_mm: f64, block: &Block, place: Place<'_>) {
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
                    line: 0,
                    text: Vec::new(),
                    calls: Vec::new(),
                    file: None,
                    span: (0, 0),
                });
                let Some(breach) = self.breaches.last_mut() else { return };
                breach
            }
        };
        breach.reach_mm = reach_mm;
        breach.line = place.line;
        breach.text.clear();
        breach.text.extend_from_slice(place.text);
        breach.calls.clear();
        breach.calls.extend_from_slice(place.calls);
        breach.file = place.file.map(str::to_owned);
        breach.span = match block.word(axis.letter() as u8) {
            Some(word) => (word.start, word.end),
            None => block.extent(),
        };
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
            let fault = Fault::new(rule, breach.span.0, breach.span.1, message)
                .help("move the job's zero or start, or take a machine with more travel");
            let file = breach.file.as_deref();
            let place = Place { line: breach.line, text: &breach.text, calls: &breach.calls, file };
            findings.add(fault, place);
        }
    }

    /// Least and greatest position of each axis of the machine; none where nothing moved.
    pub fn extents_mm(&self, machine: &Machine) -> AxisMap<Option<[f64; 2]>> {
        AxisMap::from_fn(|axis| {
            let Bounds { least, greatest } = &self.reached_mm;
            (self.any && machine.axis(axis).is_some()).then_some([least[axis], greatest[axis]])
        })
    }
}
