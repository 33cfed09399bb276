//! Canned cycles: one block becomes the moves of a hole, in any plane, as RS274/NGC expands it.
//!
//! ```text
//!  initial level ──▶──┐          ┌── G98: back to the initial level
//!                     ┆ rapid    ┆
//!  R level ┄┄┄┄┄┄┄┄┄┄┄│┄┄┄┄┄┄┄┄┄┄│── G99: back to R
//!                     │ feed     │
//!  bottom (Z) ────────┴──────────┘
//! ```
//!
//! Levels lie on the axis across the plane. R, bottom, P, Q, I, J, K hold until the cycle changes.
//! Spindle and feed are synchronised by M29 only: other taps need a floating holder. One thing differs: after G88
//! the tool is led out of the hole before anything else moves, for nobody can have jogged it there.

use crate::base::{Axis, EventKind, Point};
use crate::gcode::codes::{AXIS_LETTERS, Cycle, Single};
use crate::gcode::{Block, Fault, letter_bit, rules};

use super::Dialect;
use super::execute::{Asked, Executor, MotionMode, Output};
use super::feed::{FeedMode, Turning};
use super::motion::{Bound, Corner, Motion, MoveKind};
use super::words::whole;

/// How far above the bottom so far a peck comes back: a hundredth of an inch.
pub(super) const BACK_OFF_MM: f64 = 0.254;

/// Most pecks and holes of one block: more are a mistake in Q or L.
pub(super) const PASSES_MAX: f64 = 10_000.0;

/// Letters of the axes that are held in a cycle.
const HELD_LETTERS: u32 = AXIS_LETTERS & !(letter_bit(b'X') | letter_bit(b'Y') | letter_bit(b'Z'));

/// What holds from one block of a cycle to the next.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Held {
    /// Level at which the first block of the series began; none outside of one.
    pub initial_mm: Option<f64>,
    pub r_mm: f64,
    pub depth_mm: f64,
    pub dwell_s: f64,
    pub peck_mm: f64,
    /// I J K of G87, I J of G76.
    shift_mm: [f64; 3],
    /// The unit of the words that are held, and whether R and bottom are positions.
    mm_per_unit: f64,
    absolute: bool,
    /// M29: taps follow the spindle's turns.
    pub is_rigid: bool,
    /// The motion code before the cycle.
    set_aside: Option<MotionMode>,
}

impl Held {
    /// What stays when another cycle begins.
    pub fn anew(&self, mm_per_unit: f64) -> Held {
        let Held { initial_mm, is_rigid, set_aside, absolute, .. } = *self;
        Held { initial_mm, is_rigid, set_aside, absolute, mm_per_unit, ..Held::default() }
    }

    /// Says R and bottom as they are meant under the other one of G90 and G91, as FANUC does: the
    /// levels stay where they are.
    fn restate(&mut self) {
        let initial_mm = self.initial_mm.unwrap_or_default();
        if self.absolute {
            self.depth_mm -= self.r_mm;
            self.r_mm -= initial_mm;
        } else {
            self.r_mm += initial_mm;
            self.depth_mm += self.r_mm;
        }
        self.absolute = !self.absolute;
    }

    /// Takes the motion code that a cycle follows on.
    pub fn set_aside(&mut self, motion: MotionMode) {
        if !is_hole(motion) {
            self.set_aside = Some(motion);
        }
    }

    /// The motion code that holds once cycles have ended.
    pub fn motion_without(&self, motion: MotionMode) -> MotionMode {
        if is_hole(motion) { self.set_aside.unwrap_or(MotionMode::None) } else { motion }
    }
}

fn is_hole(motion: MotionMode) -> bool {
    matches!(motion, MotionMode::Cycle(_) | MotionMode::Single(Single::Hole(_)))
}

/// A hole, in program coordinates.
pub(super) struct Hole {
    pub across: Axis,
    pub r_mm: f64,
    pub clear_mm: f64,
    pub bottom_mm: f64,
    /// Top of a back bore.
    pub top_mm: f64,
    /// The plane's axes, and by how much the tool is moved off the wall.
    pub aside: [(Axis, f64); 2],
}

impl Executor<'_> {
    /// Runs the cycle in force at the position of a block.
    pub(super) fn run_cycle(
        &mut self,
        cycle: Cycle,
        block: &Block,
        mut asked: Asked,
        out: &mut Output<'_>,
    ) {
        let faults_before = out.faults.len();
        let goes_on = asked.motion_before == MotionMode::Cycle(cycle);
        let target = self.program_target(block, out.faults);
        self.judge_cycle(cycle, block, asked, out.faults);
        let repeats = self.take_cycle_words(cycle, goes_on, block, out);
        if asked.is_faulty || out.faults.len() > faults_before {
            self.forget_position();
            return;
        }
        let across = self.plane.normal();
        let mut at = self.frames.program(&self.position_mm);
        let initial_mm = *self.cycle.initial_mm.get_or_insert(at[across]);
        let base_mm = if self.absolute { 0.0 } else { initial_mm };
        let r_mm = self.cycle.r_mm + base_mm;
        let bottom_mm = self.cycle.depth_mm + if self.absolute { 0.0 } else { r_mm };
        if r_mm < bottom_mm {
            let message = format!(
                "the R level, {across}{r_mm:.4} mm, lies below the bottom, {across}{bottom_mm:.4} mm"
            );
            let fault = Fault::block(&rules::CYCLE_LEVEL, block, message);
            out.faults.push(fault.help("R is where the feed begins, above the work"));
            self.forget_position();
            return;
        }
        let passes = f64::from(repeats) * self.pecks(cycle, r_mm - bottom_mm);
        if passes > PASSES_MAX {
            let message =
                format!("{passes} pecks or holes in one block are more than {PASSES_MAX}");
            out.faults.push(Fault::block(&rules::BAD_VALUE, block, message));
            self.forget_position();
            return;
        }
        let axes = self.plane.axes();
        let hole = Hole {
            across,
            r_mm,
            clear_mm: if self.returns_to_r { r_mm } else { initial_mm.max(r_mm) },
            bottom_mm,
            top_mm: self.cycle.shift_mm[2] + if self.absolute { 0.0 } else { bottom_mm },
            aside: self.aside(cycle, axes),
        };
        let mut drill = Drilling { executor: self, block, out };
        if at[across] < r_mm {
            at[across] = r_mm;
            drill.rapid(&at);
        }
        let by_mm = axes.map(|axis| target[axis] - at[axis]);
        for pass in 0..repeats {
            for (axis, by_mm) in axes.into_iter().zip(by_mm) {
                // Absolute words name one place, however often.
                match &mut asked.polar_step {
                    _ if pass == 0 => at[axis] = target[axis],
                    Some(step) if axis == axes[0] => step.apply(&mut at),
                    None if !drill.executor.absolute => at[axis] += by_mm,
                    _ => {}
                }
            }
            drill.rapid(&at);
            at[across] = r_mm;
            drill.rapid(&at);
            drill.hole(cycle, &hole, &mut at);
        }
    }

    /// By how much a boring tool is moved off the wall, on the plane's axes. Q of G76 is along the
    /// first.
    fn aside(&self, cycle: Cycle, axes: [Axis; 2]) -> [(Axis, f64); 2] {
        let held = &self.cycle;
        let [i, j] = [held.shift_mm[0], held.shift_mm[1]];
        let by_q = cycle == Cycle::BoreFine && i == 0.0 && j == 0.0;
        [(axes[0], if by_q { held.peck_mm } else { i }), (axes[1], if by_q { 0.0 } else { j })]
    }

    fn pecks(&self, cycle: Cycle, deep_mm: f64) -> f64 {
        match cycle {
            Cycle::DrillDeep | Cycle::DrillChipBreak => {
                (deep_mm / self.cycle.peck_mm).ceil().max(1.0)
            }
            _ => 1.0,
        }
    }

    /// Reports what leaves no room for a cycle.
    fn judge_cycle(&mut self, cycle: Cycle, block: &Block, asked: Asked, faults: &mut Vec<Fault>) {
        let name = cycle as u8;
        let mode = if self.feed_mode == FeedMode::InverseTime {
            Some("inverse time feed (G93) is in force")
        } else if asked.machine_coordinates {
            Some("G53 stands beside it")
        } else {
            None
        };
        if let Some(mode) = mode {
            let message = format!("G{name} cannot run while {mode}");
            faults.push(Fault::block(&rules::CYCLE_MODE, block, message));
            return;
        }
        if let Some(word) = block.first_of(HELD_LETTERS) {
            let message = format!("a canned cycle makes no use of {word}");
            let fault = Fault::word(&rules::UNUSED_WORD, word, message);
            faults.push(fault.help("move this axis in a block before"));
        }
        if asked.is_faulty {
            return;
        }
        self.has_feed(block, faults);
        let is_rigid = self.cycle.is_rigid && matches!(cycle, Cycle::Tap | Cycle::TapLeft);
        if is_rigid && !self.knows_tap_speed(block, faults) {
            return;
        }
        let wrong = match (cycle, self.turning) {
            // A rigid tap starts the spindle.
            (_, Turning::Stopped) if is_rigid => return,
            (Cycle::Tap, Turning::CounterClockwise | Turning::Stopped) => "M3",
            (Cycle::TapLeft, Turning::Clockwise | Turning::Stopped) => "M4",
            (
                Cycle::BoreFine | Cycle::BoreStop | Cycle::BoreBack | Cycle::BoreManual,
                Turning::Stopped,
            ) => "M3 or M4",
            _ => return,
        };
        let message = format!("G{name} needs the spindle turning by {wrong}");
        let fault = Fault::block(&rules::SPINDLE_STOPPED, block, message);
        faults.push(fault.help(format!("write {wrong} and S before it")));
    }

    /// Whether a rigid tap knows the spindle's speed; reports that it does not.
    pub(super) fn knows_tap_speed(&self, block: &Block, faults: &mut Vec<Fault>) -> bool {
        let is_known = self.turns_min().is_some();
        if !is_known {
            let message = "a rigid tap needs the spindle at one speed that is known";
            let fault = Fault::block(&rules::NO_SPINDLE_SPEED, block, message);
            faults.push(fault.help("write S in turns a minute beside M29"));
        }
        is_known
    }

    /// Takes the words of a cycle, those that it lacks from the block before; how often it runs.
    fn take_cycle_words(
        &mut self,
        cycle: Cycle,
        goes_on: bool,
        block: &Block,
        out: &mut Output<'_>,
    ) -> u32 {
        let faults = &mut *out.faults;
        let seconds = block.word(b'P').map(|word| self.seconds(word, out.text));
        let mm = self.mm_per_unit;
        // Controls differ in what becomes of lengths that are held when the unit changes.
        let other_unit = goes_on && self.cycle.mm_per_unit != mm;
        let goes_on = goes_on && !other_unit;
        if !goes_on {
            self.cycle = self.cycle.anew(mm);
        }
        let levels_hold = goes_on && self.levels_hold();
        let across = self.plane.normal();
        let diameter = if self.diameters && across == Axis::X { 0.5 } else { 1.0 };
        let mut missing = String::new();
        let mut take =
            |letter: u8, is_needed: bool, value: &mut f64, scale: f64| match block.word(letter) {
                Some(word) => *value = word.value * scale,
                None if is_needed => missing.push(char::from(letter)),
                None => {}
            };
        let held = &mut self.cycle;
        take(across.letter() as u8, !levels_hold, &mut held.depth_mm, mm * diameter);
        take(b'R', !levels_hold, &mut held.r_mm, mm * diameter);
        let dwells = matches!(cycle, Cycle::DrillDwell | Cycle::BoreDwell);
        take(b'P', dwells && !goes_on, &mut held.dwell_s, 1.0);
        held.dwell_s = seconds.unwrap_or(held.dwell_s);
        let pecks = matches!(cycle, Cycle::DrillDeep | Cycle::DrillChipBreak);
        take(b'Q', pecks && !goes_on, &mut held.peck_mm, mm);
        if matches!(cycle, Cycle::BoreBack | Cycle::BoreFine) {
            let is_back = cycle == Cycle::BoreBack;
            for (letter, value) in [b'I', b'J', b'K'].into_iter().zip(&mut held.shift_mm) {
                take(letter, is_back && !goes_on, value, mm);
            }
        }
        if !missing.is_empty() {
            let name = cycle as u8;
            let list: Vec<String> = missing.chars().map(String::from).collect();
            let mode = if self.absolute { " under G90" } else { " under G91" };
            let new = match (other_unit, goes_on) {
                (true, _) => " in the new unit",
                (_, true) => mode,
                _ => "",
            };
            let message = format!("the first block of G{name}{new} has no {}", list.join(", no "));
            let fault = Fault::block(&rules::MISSING_WORD, block, message);
            faults.push(match goes_on {
                true => fault.help(
                    "controls differ in what becomes of levels between G90 and G91: --dialect \
                     fanuc keeps them where they are, linuxcnc takes the numbers anew",
                ),
                false => fault,
            });
        }
        self.cycle.absolute = self.absolute;
        if let Some(word) = block.word(b'Q').filter(|word| word.value <= 0.0) {
            faults.push(Fault::word(&rules::BAD_VALUE, word, "Q, a peck or a shift, is above 0"));
        }
        if let Some(word) = block.word(b'P').filter(|word| word.value < 0.0) {
            faults.push(Fault::word(&rules::BAD_VALUE, word, "a dwell cannot be negative"));
        }
        let repeats = block.word(b'L').or(block.word(b'K').filter(|_| cycle != Cycle::BoreBack));
        repeats.map_or(Some(1), |word| whole(word, PASSES_MAX as u32, faults)).unwrap_or(0)
    }
}

impl Executor<'_> {
    /// Whether R and bottom of the block before hold, where G90 and G91 may have changed since.
    fn levels_hold(&mut self) -> bool {
        if self.cycle.absolute == self.absolute {
            return true;
        }
        if self.dialect.is_fanuc() {
            self.cycle.restate();
        }
        self.dialect != Dialect::Iso
    }
}

/// Makes the moves of holes.
pub(super) struct Drilling<'d, 'e, 'o> {
    pub executor: &'d mut Executor<'e>,
    pub block: &'d Block,
    pub out: &'d mut Output<'o>,
}

impl Drilling<'_, '_, '_> {
    pub fn rapid(&mut self, to: &Point) {
        self.go(to, MoveKind::Rapid);
    }

    fn feed(&mut self, to: &Point) {
        self.go(to, MoveKind::Line { feed_mm_min: 0.0 });
    }

    fn go(&mut self, to: &Point, kind: MoveKind) {
        let to = self.executor.place(to);
        if to != self.executor.position_mm {
            self.executor.go(self.block, &to, kind, Some(Corner::Exact), self.out);
        }
    }

    fn level(&mut self, at: &mut Point, across: Axis, level_mm: f64, kind: MoveKind) {
        at[across] = level_mm;
        self.go(at, kind);
    }

    fn dwell(&mut self) {
        let seconds = self.executor.cycle.dwell_s;
        if seconds > 0.0 {
            self.out.event(EventKind::Dwell(seconds));
        }
    }

    fn start(&mut self, turning: Turning) {
        let code = if turning == Turning::Clockwise { 3 } else { 4 };
        let spindle_rpm = self.executor.spindle_rpm;
        self.out.event(EventKind::M { code, spindle_rpm, tool: None });
    }

    /// A hole; begins and ends above it, at `at`. A tap goes as the spindle turns, whatever the
    /// operator makes of feeds.
    pub fn hole(&mut self, cycle: Cycle, hole: &Hole, at: &mut Point) {
        let is_tap = matches!(cycle, Cycle::Tap | Cycle::TapLeft);
        let allowed = self.executor.overrides.feed;
        self.executor.overrides.feed &= !is_tap;
        let first = self.out.motions.len();
        self.drill(cycle, hole, at);
        self.executor.overrides.feed = allowed;
        let bound = match cycle {
            _ if is_tap && self.executor.cycle.is_rigid => Bound::Spindle,
            Cycle::Tap | Cycle::TapLeft | Cycle::BoreBack | Cycle::BoreFine => Bound::Captive,
            _ => return,
        };
        for motion in self.out.motions.iter_mut().skip(first) {
            if let Motion::Move(step) = motion {
                step.bound = bound;
            }
        }
    }

    fn drill(&mut self, cycle: Cycle, hole: &Hole, at: &mut Point) {
        const FEED: MoveKind = MoveKind::Line { feed_mm_min: 0.0 };
        let (across, bottom_mm, clear_mm) = (hole.across, hole.bottom_mm, hole.clear_mm);
        let turning = self.executor.turning;
        if cycle == Cycle::BoreBack {
            self.back_bore(hole, at, turning);
            return;
        }
        if let Cycle::Tap | Cycle::TapLeft = cycle {
            self.tap(cycle, hole, at, turning);
            return;
        }
        if let Cycle::DrillDeep | Cycle::DrillChipBreak = cycle {
            self.pecks(cycle, hole, at);
        }
        self.level(at, across, bottom_mm, FEED);
        self.dwell();
        match cycle {
            Cycle::Drill | Cycle::DrillDwell | Cycle::DrillDeep | Cycle::DrillChipBreak => {}
            Cycle::BoreFeedOut => self.level(at, across, hole.r_mm, FEED),
            Cycle::BoreDwell => self.level(at, across, clear_mm, FEED),
            Cycle::BoreStop | Cycle::BoreManual | Cycle::BoreFine => {
                self.out.function(5);
                if cycle == Cycle::BoreManual {
                    self.out.function(0);
                }
                self.lead_out(cycle, hole, at);
                self.start(turning);
            }
            Cycle::BoreBack | Cycle::Tap | Cycle::TapLeft => {}
        }
        self.level(at, across, clear_mm, MoveKind::Rapid);
    }

    /// Down, the spindle round the other way, and up again; rigid, if M29 asks for it.
    fn tap(&mut self, cycle: Cycle, hole: &Hole, at: &mut Point, turning: Turning) {
        let by_cycle = match cycle {
            Cycle::TapLeft => Turning::CounterClockwise,
            _ => Turning::Clockwise,
        };
        let ahead = if turning == Turning::Stopped { by_cycle } else { turning };
        let back = match ahead {
            Turning::Clockwise => Turning::CounterClockwise,
            _ => Turning::Clockwise,
        };
        if turning == Turning::Stopped {
            self.start(ahead);
        }
        self.level(at, hole.across, hole.bottom_mm, MoveKind::Line { feed_mm_min: 0.0 });
        self.out.function(5);
        self.start(back);
        self.dwell();
        self.level(at, hole.across, hole.clear_mm, MoveKind::Line { feed_mm_min: 0.0 });
        self.out.function(5);
        if turning != Turning::Stopped {
            self.start(turning);
        }
    }

    /// Leads a tool that stands still out of the hole; of G76 beside the wall.
    fn lead_out(&mut self, cycle: Cycle, hole: &Hole, at: &mut Point) {
        let center = *at;
        if cycle == Cycle::BoreFine {
            self.out.function(19);
            hole.aside.iter().for_each(|(axis, by_mm)| at[*axis] += by_mm);
            self.rapid(at);
        }
        self.level(at, hole.across, hole.clear_mm, MoveKind::Rapid);
        for axis in [hole.aside[0].0, hole.aside[1].0] {
            at[axis] = center[axis];
        }
        self.rapid(at);
    }

    /// All pecks but the last.
    fn pecks(&mut self, cycle: Cycle, hole: &Hole, at: &mut Point) {
        let peck_mm = self.executor.cycle.peck_mm;
        if peck_mm <= 0.0 {
            // The block that said so has been reported; this one repeats it.
            return;
        }
        for peck in 1.. {
            let depth_mm = hole.r_mm - f64::from(peck) * peck_mm;
            // What rounding leaves of a last peck is none.
            if depth_mm <= hole.bottom_mm + 1e-9 {
                return;
            }
            self.level(at, hole.across, depth_mm, MoveKind::Line { feed_mm_min: 0.0 });
            if cycle == Cycle::DrillDeep {
                self.level(at, hole.across, hole.r_mm, MoveKind::Rapid);
            }
            let back_mm = (depth_mm + BACK_OFF_MM).min(hole.r_mm);
            self.level(at, hole.across, back_mm, MoveKind::Rapid);
        }
    }

    /// G87: down beside the hole with the spindle still, then up from below at feed.
    fn back_bore(&mut self, hole: &Hole, at: &mut Point, turning: Turning) {
        let across = hole.across;
        let center = *at;
        let mut beside = center;
        hole.aside.iter().for_each(|(axis, by_mm)| beside[*axis] += by_mm);
        self.rapid(&beside);
        self.out.function(5);
        self.out.function(19);
        self.level(&mut beside, across, hole.bottom_mm, MoveKind::Rapid);
        self.level(at, across, hole.bottom_mm, MoveKind::Rapid);
        self.start(turning);
        at[across] = hole.top_mm;
        self.feed(at);
        at[across] = hole.bottom_mm;
        self.feed(at);
        self.out.function(5);
        self.out.function(19);
        self.rapid(&beside);
        self.level(&mut beside, across, hole.clear_mm, MoveKind::Rapid);
        self.level(at, across, hole.clear_mm, MoveKind::Rapid);
        self.start(turning);
    }
}
