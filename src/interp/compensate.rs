//! G40, G41 and G42: when the compensation stage stands in the way of motion, and what may not.

use crate::base::Plane;
use crate::gcode::codes::{Group, Op};
use crate::gcode::{Block, Fault, rules};

use super::compensation::Compensation;
use super::execute::{Asked, Executor, MotionMode, Output, is_error};
use super::words::whole;

impl Executor<'_> {
    /// G40 to G42.1.
    pub(super) fn set_compensation(&mut self, op: Op, block: &Block, out: &mut Output<'_>) {
        match op {
            Op::Compensate { left, by_diameter } => {
                self.compensation_on((left, by_diameter), block, out);
            }
            _ => self.compensation_off(block, out),
        }
    }

    /// G40. What the block has made before it is of the contour still.
    pub(super) fn compensation_off(&mut self, block: &Block, out: &mut Output<'_>) {
        self.compensate(block, out);
        self.end_compensation(block, out);
    }

    /// G41 to G42.1: left or right, the radius from a tool or from D itself.
    pub(super) fn compensation_on(
        &mut self,
        (is_left, by_diameter): (bool, bool),
        block: &Block,
        out: &mut Output<'_>,
    ) {
        if self.compensation.is_some() {
            let message = "compensation is in force already, or has not been led out yet";
            let fault = Fault::block(&rules::COMPENSATION_MODE, block, message);
            out.faults.push(fault.help("write G40 and a straight move before"));
            return;
        }
        let Some((radius_mm, orientation)) = self.nose(by_diameter, block, out.faults) else {
            return;
        };
        if !matches!(orientation, 0 | 9) && self.plane != Plane::Zx {
            let message = "a lathe tool with an orientation is compensated in the ZX plane";
            let fault = Fault::block(&rules::COMPENSATION_MODE, block, message);
            out.faults.push(fault.help("write G18 before it"));
            return;
        }
        let Some(is_mirrored) = self.frames.arcs_mirrored(self.plane) else {
            let message = "compensation needs equal scaling of its plane, and no turn out of it";
            out.faults.push(Fault::block(&rules::COMPENSATION_MODE, block, message));
            return;
        };
        let is_left = is_left != is_mirrored;
        if radius_mm != 0.0 {
            let at = self.position_mm;
            let stage = Compensation::new(self.plane, is_left, radius_mm, orientation, at);
            self.compensation = Some(stage);
            self.motion_first = out.motions.len();
        }
    }

    /// The radius and, of a lathe tool, its orientation: D is a tool, without it the one in the
    /// spindle; of G41.1 and G42.1 D is a diameter and L the orientation.
    fn nose(
        &self,
        by_diameter: bool,
        block: &Block,
        faults: &mut Vec<Fault>,
    ) -> Option<(f64, u32)> {
        let word = block.word(b'D');
        if by_diameter {
            if word.is_none() {
                let message = "G41.1 and G42.1 need D, the tool's diameter";
                faults.push(Fault::block(&rules::MISSING_WORD, block, message));
            }
            let orientation = match block.word(b'L') {
                Some(word) => whole(word, 9, faults)?,
                None => 0,
            };
            return word.map(|word| (word.value * self.mm_per_unit / 2.0, orientation));
        }
        let number = match word {
            Some(word) => whole(word, 99_999, faults)?,
            None => self.held_d.or(self.loaded).unwrap_or(0),
        };
        match self.tools.get(number) {
            Some(tool) => Some((tool.diameter_mm / 2.0, tool.orientation)),
            None if number == 0 && (word.is_some() || self.held_d.is_some()) => Some((0.0, 0)),
            None => {
                faults.push(self.unknown_tool(number, block));
                None
            }
        }
    }

    /// Sends what the block has made through the stage, which ends at a fault: what it made of the
    /// rest would be guessed.
    pub(super) fn compensate(&mut self, block: &Block, out: &mut Output<'_>) {
        if out.faults.iter().any(is_error) {
            self.compensation = None;
        }
        let Some(mut stage) = self.compensation.take() else { return };
        let first = self.motion_first.min(out.motions.len());
        let mut made = out.motions.split_off(first).into_iter();
        let mut is_led_out = false;
        for motion in made.by_ref() {
            if !stage.push(motion, block, out.motions, out.faults) {
                is_led_out = true;
                break;
            }
        }
        out.motions.extend(made);
        self.motion_first = out.motions.len();
        if !is_led_out {
            self.compensation = Some(stage);
        }
    }

    /// Ends compensation: the next move in the plane leads out.
    pub(super) fn end_compensation(&mut self, block: &Block, out: &mut Output<'_>) {
        let Some(stage) = &mut self.compensation else { return };
        stage.end(block, out.motions, out.faults);
        if stage.position_mm() == self.position_mm {
            self.compensation = None;
        }
        self.motion_first = out.motions.len();
    }

    /// The program is over: the machine stays where compensation has led it.
    pub(super) fn finish(&mut self, block: &Block, out: &mut Output<'_>) {
        self.end_without_nurbs(block, out.faults);
        self.end_compensation(block, out);
        if let Some(stage) = self.compensation.take() {
            self.position_mm = stage.position_mm();
        }
    }

    /// Reports what has no place where compensation is in force.
    pub(super) fn breaks_compensation(
        &mut self,
        block: &Block,
        asked: Asked,
        faults: &mut Vec<Fault>,
    ) -> bool {
        let Some(stage) = self.compensation.as_ref().filter(|stage| stage.is_on()) else {
            return false;
        };
        let is_misplaced = |op: Op, group: Group| match op {
            Op::PlaneXy | Op::PlaneZx | Op::PlaneYz => plane_of(op) != Some(stage.plane),
            Op::Dwell | Op::ExactStopOnce | Op::StoreReference(_) | Op::LookAhead => false,
            Op::Cycle(_) | Op::FurtherSystem => true,
            Op::WorkSystem(index) => usize::from(index) != self.frames.active(),
            Op::ScalingOff => self.frames.scaling().is_some(),
            Op::RotationOff => self.frames.rotation().is_some(),
            Op::Mirror { on: false } => self.frames.is_mirrored(),
            _ => matches!(
                group,
                Group::NonModal | Group::Mirror | Group::Scaling | Group::Rotation | Group::Polar
            ),
        };
        let misplaced = self.codes.iter().find(|(code, op)| is_misplaced(*op, code.group));
        let (Some((code, _)), false) = (misplaced, asked.motion_before == MotionMode::Foreign)
        else {
            return false;
        };
        let message = format!("{} has no place in cutter compensation", code.name());
        let fault = Fault::block(&rules::COMPENSATION_MODE, block, message);
        faults.push(fault.help("end compensation by G40 and a straight move before it"));
        true
    }
}

fn plane_of(op: Op) -> Option<Plane> {
    match op {
        Op::PlaneXy => Some(Plane::Xy),
        Op::PlaneZx => Some(Plane::Zx),
        Op::PlaneYz => Some(Plane::Yz),
        _ => None,
    }
}
