//! G83 to G89 of FANUC-style lathes: holes on the face (along Z) and on the side (along X).
//!
//! R is the way from the level where the cycle begins to where the feed begins, with its sign; a
//! bottom by Z (X on the side) is a position, one by W (U) a way from there. The tool goes back to the
//! level where it began. Q pecks lead out to R each time; taps follow the spindle after M29 only.

use crate::base::Axis;
use crate::gcode::codes::{Cycle, Hole as Work, HoleKind, Single};
use crate::gcode::{Block, Fault, rules};

use crate::interp::cycles::{Drilling, Hole, PASSES_MAX};
use crate::interp::execute::{Asked, Executor, MotionMode, Output};
use crate::interp::feed::Turning;
use crate::interp::words::whole;

impl Executor<'_> {
    /// Drills a hole, or K of them, at the position of a block.
    pub(super) fn drill_lathe(
        &mut self,
        work: Work,
        block: &Block,
        asked: Asked,
        out: &mut Output<'_>,
    ) {
        let faults_before = out.faults.len();
        let across = if work.side { Axis::X } else { Axis::Z };
        let goes_on = asked.motion_before == MotionMode::Single(Single::Hole(work));
        let target = self.program_target(block, out.faults);
        let mut at = self.frames.program(&self.position_mm);
        let initial_mm = *self.cycle.initial_mm.get_or_insert(at[across]);
        let r_mm = self.take_hole_words((work, across), goes_on, block, out) + initial_mm;
        let bottom = block.words().iter().find(|word| self.axis_of(word.letter) == Some(across));
        match bottom {
            Some(word) if self.is_position(word) => self.cycle.depth_mm = target[across],
            Some(_) => self.cycle.depth_mm = r_mm + target[across] - at[across],
            None if goes_on => {}
            None => {
                let message = format!("the first block of this cycle has no {across}, its bottom");
                out.faults.push(Fault::block(&rules::MISSING_WORD, block, message));
            }
        }
        let repeats =
            block.word(b'K').map_or(Some(1), |word| whole(word, PASSES_MAX as u32, out.faults));
        if !asked.is_faulty && out.faults.len() == faults_before {
            self.has_feed(block, out.faults);
            self.judge_hole((work, across), [initial_mm, r_mm], block, out);
        }
        let Some(repeats) =
            repeats.filter(|_| !asked.is_faulty && out.faults.len() == faults_before)
        else {
            return self.forget_position();
        };
        let bottom_mm = self.cycle.depth_mm;
        let (cycle, peck_mm) = (self.cycle_of(work), self.cycle.peck_mm);
        let pecks = if peck_mm > 0.0 { ((r_mm - bottom_mm) / peck_mm).ceil() } else { 1.0 };
        if pecks * f64::from(repeats) > PASSES_MAX {
            let message = format!("more than {PASSES_MAX} pecks or holes in one block");
            let fault = Fault::block(&rules::BAD_VALUE, block, message);
            out.faults.push(fault.help("Q without a point is in thousandths of a mm"));
            return self.forget_position();
        }
        let aside = [(Axis::X, 0.0), (Axis::Z, 0.0)];
        let hole = Hole { across, r_mm, clear_mm: r_mm, bottom_mm, top_mm: 0.0, aside };
        let from = at;
        let mut drill = Drilling { executor: self, block, out };
        for pass in 0..repeats {
            for word in block.words() {
                let axis = drill.executor.axis_of(word.letter).filter(|axis| *axis != across);
                let Some(axis) = axis else { continue };
                if pass == 0 || !drill.executor.is_position(word) {
                    at[axis] += target[axis] - from[axis];
                }
            }
            drill.rapid(&at);
            at[across] = r_mm;
            drill.rapid(&at);
            drill.hole(cycle, &hole, &mut at);
            // G99 of system B.
            if !drill.executor.returns_to_r {
                at[across] = initial_mm;
                drill.rapid(&at);
            }
        }
    }

    /// The moves of a hole.
    fn cycle_of(&self, work: Work) -> Cycle {
        match work.kind {
            HoleKind::Drill if self.cycle.peck_mm > 0.0 => Cycle::DrillDeep,
            HoleKind::Drill => Cycle::DrillDwell,
            HoleKind::Tap => Cycle::Tap,
            HoleKind::Bore => Cycle::BoreFeedOut,
        }
    }

    /// Takes R, P and Q, those that a block lacks from the block before; gives R.
    fn take_hole_words(
        &mut self,
        (work, across): (Work, Axis),
        goes_on: bool,
        block: &Block,
        out: &mut Output<'_>,
    ) -> f64 {
        if !goes_on {
            self.cycle = self.cycle.anew(self.mm_per_unit);
        }
        if let Some(word) = block.word(b'R') {
            self.cycle.r_mm = word.value * self.mm_per_unit;
        }
        if let Some(word) = block.word(b'P') {
            self.cycle.dwell_s = self.seconds(word, out.text);
        }
        if let Some(word) = block.word(b'Q') {
            self.cycle.peck_mm = self.small_length_mm(word, out.text);
        }
        let negative = [b'P', b'Q'].into_iter().filter_map(|letter| block.word(letter));
        if let Some(word) = negative.into_iter().find(|word| word.value < 0.0) {
            let message = format!("{word}: a dwell or a peck is not below 0");
            out.faults.push(Fault::word(&rules::BAD_VALUE, word, message));
        }
        if let Some(word) = block.word(b'Q').filter(|_| work.kind != HoleKind::Drill) {
            let message = format!("{word}: this cycle goes along {across} without pecks");
            let fault = Fault::word(&rules::UNUSED_WORD, word, message);
            out.faults.push(fault.help("leave it out"));
        }
        self.cycle.r_mm
    }

    /// Reports levels in a wrong order, and a tap whose spindle stands still.
    fn judge_hole(
        &mut self,
        (work, across): (Work, Axis),
        [initial_mm, r_mm]: [f64; 2],
        block: &Block,
        out: &mut Output<'_>,
    ) {
        let bottom_mm = self.cycle.depth_mm;
        if r_mm < bottom_mm || initial_mm < r_mm {
            let message = format!(
                "the cycle begins at {across}{initial_mm:.4} mm, feeds from {across}{r_mm:.4} mm on, \
                 and ends at {across}{bottom_mm:.4} mm: these do not go down"
            );
            let fault = Fault::block(&rules::CYCLE_LEVEL, block, message);
            out.faults.push(fault.help(
                "R is the way from the level where the cycle begins to where the feed begins, below \
                 0 as a rule",
            ));
        }
        let is_rigid = work.kind == HoleKind::Tap && self.cycle.is_rigid;
        if is_rigid && !self.knows_tap_speed(block, out.faults) {
            return;
        }
        if work.kind == HoleKind::Tap && self.turning == Turning::Stopped && !is_rigid {
            let message = "a tapping cycle needs the spindle turning";
            let fault = Fault::block(&rules::SPINDLE_STOPPED, block, message);
            out.faults.push(fault.help("write M3 or M4 and S before it"));
        }
    }
}
