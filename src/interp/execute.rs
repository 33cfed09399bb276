//! One block → motion and events, by the modes in force.
//!
//! Order in a block, as RS274/NGC has it: feed mode, F, S, T, units, then the codes in the order of their
//! groups ([`Group`]), motion, stop. So an F beside G20 or G21 is still in the units before. Whatever is wrong leaves the modes as they would be without the
//! fault, so that one fault does not make others; positions that a fault leaves open are known to
//! be open.

use std::collections::BTreeSet;

use crate::base::{AxisMap, AxisSet, Event, EventKind, Machine, Plane, Point};
use crate::gcode::codes::{
    AXIS_LETTERS, Code, Cycle, Follow, Group, Op, Single, SplineCode, Stock, Turn,
};
use crate::gcode::{Block, Fault, Word, letter_bit, rules};

use super::compensation::Compensation;
use super::corner::Pending;
use super::cycles::Held;
use super::feed::{Feed, FeedMode, Turning};
use super::flow::Flow;
use super::frames::Frames;
use super::modes::{Coolant, LengthMode, Modes, Overrides, Saved};
use super::motion::{Corner, Motion};
use super::offsets::claims_axes;
use super::polar::{PolarMode, PolarStep};
use super::probe::Signals;
use super::spline::SplineState;
use super::tools::Tools;
use super::turning::Lathe;
use super::words::{call_flow, has_point, leads_to};
use super::{Dialect, Options};

/// The motion code in force.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub(super) enum MotionMode {
    #[default]
    None,
    Rapid,
    Line,
    Arc {
        ccw: bool,
    },
    Cycle(Cycle),
    /// Moves that follow the spindle or an input.
    Follow(Follow),
    /// Cycles along a contour.
    Turn(Turn),
    /// Cycles of lathes that cut once.
    Single(Single),
    Spline(SplineCode),
    /// A code that is not supported: its axis words are its own.
    Foreign,
}

/// The state of a run: modes and position.
#[derive(Debug)]
pub(super) struct Executor<'a> {
    pub(super) machine: &'a Machine,
    pub(super) dialect: Dialect,
    pub(super) axes: AxisSet,
    /// The letters of those that are linear.
    pub(super) linear_letters: u32,
    pub(super) motion: MotionMode,
    pub(super) plane: Plane,
    pub(super) mm_per_unit: f64,
    pub(super) absolute: bool,
    /// G90.1
    pub(super) centers_absolute: bool,
    /// G16
    pub(super) polar: bool,
    pub(super) polar_mode: PolarMode,
    /// G7
    pub(super) diameters: bool,
    pub(super) corner: Corner,
    pub(super) feed_mode: FeedMode,
    pub(super) feed: Option<Feed>,
    /// Whether a lack of feed, or of what it needs, has been reported since the last F.
    pub(super) feed_missed: bool,
    pub(super) spindle_rpm: Option<f64>,
    /// G96
    pub(super) by_surface: bool,
    /// S and D of G96.
    pub(super) surface: Option<(f64, Option<f64>)>,
    pub(super) turning: Turning,
    pub(super) coolant: Coolant,
    pub(super) overrides: Overrides,
    /// What the operator makes of a feed, as its multiple.
    pub(super) feed_override: f64,
    /// The tool that T has named, and the one that M6 has put into the spindle.
    pub(super) tool: Option<u32>,
    pub(super) loaded: Option<u32>,
    pub(super) tools: Tools,
    pub(super) length_mode: LengthMode,
    /// D that stood in a block without G41 and G42, or in the dialects fanuc beside them.
    pub(super) held_d: Option<u32>,
    pub(super) frames: Frames,
    /// Machine positions of G28 and G30, where the program has stored them.
    pub(super) references: [AxisMap<Option<f64>>; 2],
    /// What M70 and M73 have saved, for the main program and each call in it.
    pub(super) saved: Vec<Saved>,
    /// What the end of a call has left to be restored.
    pub(super) to_restore: Option<Box<Modes>>,
    /// The line at hand.
    pub(super) line: u32,
    /// The work coordinate systems whose lack of a place has been said.
    pub(super) systems_missed: BTreeSet<usize>,
    pub(super) cycle: Held,
    pub(super) signals: Signals,
    pub(super) lathe: Lathe,
    pub(super) spline: SplineState,
    pub(super) compensation: Option<Compensation>,
    /// A move that waits for the next one, for the corner between them.
    pub(super) held_move: Option<Box<Pending>>,
    /// What is wrong with such a corner: faults of the line of its first move.
    pub(super) corner_faults: Vec<Fault>,
    /// How much motion there was before the block, or before its G40.
    pub(super) motion_first: usize,
    /// G99
    pub(super) returns_to_r: bool,
    pub(super) position_mm: Point,
    /// Axes whose position a fault has left open.
    pub(super) open: AxisSet,
    /// Whether coordinates mean something else since a code that is not supported.
    pub(super) is_shifted: bool,
    /// Axes that some word has addressed.
    pub axes_used: AxisSet,
    /// Supported codes of the block in order of execution.
    pub(super) codes: Vec<(&'static Code, Op)>,
}

/// What the codes of a block ask for besides modes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Asked {
    /// A word of the block is wrong: no motion can be told from it.
    pub is_faulty: bool,
    /// A code is unknown: the words it needs are so too.
    pub is_foreign: bool,
    pub machine_coordinates: bool,
    pub dwell: bool,
    /// A code other than one of motion makes use of the axis words.
    pub axes_claimed: bool,
    /// A motion code stands in the block.
    pub is_motion_named: bool,
    /// A cycle of a lathe whose contour stands elsewhere in the program.
    pub stock: Option<Stock>,
    /// The motion code in force before the block.
    pub motion_before: MotionMode,
    /// By how much polar coordinates go on from one hole of a cycle to the next.
    pub polar_step: Option<PolarStep>,
    /// Millimetres a unit before the block.
    pub mm_per_unit_before: f64,
    /// What becomes of the corner at this block's end, if not what the mode says.
    pub corner: Option<Corner>,
}

impl Asked {
    /// Takes what is not modal and has to wait for the block's motion.
    fn note(&mut self, op: Op) {
        match op {
            Op::MachineCoordinates => self.machine_coordinates = true,
            Op::Stock(stock) => self.stock = Some(stock),
            _ => self.corner = Some(Corner::Stop),
        }
    }
}

/// Where a block stands, and where what it makes goes.
pub(super) struct Output<'o> {
    pub line: u32,
    pub text: &'o [u8],
    pub motions: &'o mut Vec<Motion>,
    pub faults: &'o mut Vec<Fault>,
}

impl Output<'_> {
    pub fn event(&mut self, kind: EventKind) {
        self.motions.push(Motion::Event(Event { line: self.line, kind }));
    }

    pub fn function(&mut self, code: u16) {
        self.event(EventKind::M { code, spindle_rpm: None, tool: None });
    }
}

impl<'a> Executor<'a> {
    /// At the start: G17 G21 G40 G49 G54 G61 G80 G90 G94 G97 G98 (in the dialect `linuxcnc` G99),
    /// no feed, no speed, no tool. On a lathe G18 and G99, and X words are diameters.
    pub fn new(machine: &'a Machine, options: &Options) -> Executor<'a> {
        let is_lathe = options.dialect.lathe().is_some();
        Executor {
            machine,
            dialect: options.dialect,
            axes: machine.axes.iter().map(|profile| profile.axis).collect(),
            linear_letters: linear_letters(machine),
            motion: MotionMode::None,
            plane: if is_lathe { Plane::Zx } else { Plane::Xy },
            mm_per_unit: 1.0,
            absolute: true,
            centers_absolute: false,
            polar: false,
            polar_mode: PolarMode::default(),
            diameters: is_lathe,
            corner: Corner::Exact,
            feed_mode: if is_lathe { FeedMode::PerTurn } else { FeedMode::PerMinute },
            feed: None,
            feed_missed: false,
            spindle_rpm: None,
            by_surface: false,
            surface: None,
            turning: Turning::Stopped,
            coolant: Coolant::default(),
            overrides: Overrides::default(),
            feed_override: options.feed_override_percent.unwrap_or(100.0) / 100.0,
            tool: None,
            loaded: None,
            tools: options.tools.clone(),
            length_mode: LengthMode::Off,
            held_d: None,
            frames: Frames::new(machine),
            references: [AxisMap::default(); 2],
            saved: vec![Saved::default()],
            to_restore: None,
            line: 0,
            systems_missed: BTreeSet::new(),
            cycle: Held::default(),
            signals: Signals::default(),
            lathe: Lathe::default(),
            spline: SplineState::default(),
            compensation: None,
            held_move: None,
            corner_faults: Vec::new(),
            motion_first: 0,
            returns_to_r: options.dialect == Dialect::LinuxCnc,
            position_mm: options.start_mm.unwrap_or(machine.work_zero_mm),
            open: AxisSet::EMPTY,
            is_shifted: false,
            axes_used: AxisSet::EMPTY,
            codes: Vec::with_capacity(8),
        }
    }

    /// Where the machine stands.
    pub fn position_mm(&self) -> Point {
        self.position_mm
    }

    /// Axes whose position a fault or an unsupported code has left open.
    pub fn open_axes(&self) -> AxisSet {
        if self.is_shifted { self.axes } else { self.open }
    }

    /// Takes the position for open: what should have moved the machine has a fault.
    pub fn forget_position(&mut self) {
        self.open = self.axes;
    }

    /// Executes a block. Faults that stand in `out` already are those of its text.
    pub fn run(&mut self, block: &Block, out: &mut Output<'_>) -> Flow {
        let text_is_faulty = out.faults.iter().any(is_error);
        if text_is_faulty {
            self.forget_position();
        }
        if let Some(call) = &block.call {
            return call_flow(block, call, out.faults);
        }
        if self.run_lone_move(block, out) {
            return Flow::Next;
        }
        let renamed = if self.is_lathe() { self.with_commas(block) } else { None };
        let block = renamed.as_ref().unwrap_or(block);
        let mut asked = self.classify(block, out.faults);
        asked.is_faulty |= text_is_faulty;
        asked.motion_before = self.motion;
        asked.mm_per_unit_before = self.mm_per_unit;
        asked.is_faulty |= self.breaks_compensation(block, asked, out.faults);
        asked.is_faulty |= self.breaks_nurbs(block, asked, out.faults);
        asked.is_faulty |= self.breaks_corner(block, asked);
        self.motion_first = out.motions.len();
        if !asked.is_faulty {
            asked.is_faulty = self.has_unused_words(block, asked, out.faults);
        }
        self.set_words(block, asked, out);
        let codes = std::mem::take(&mut self.codes);
        let (before, stops) = match codes.last() {
            Some((code, _)) if code.group == Group::Stop => codes.split_at(codes.len() - 1),
            _ => (codes.as_slice(), &[][..]),
        };
        for (_, op) in before {
            self.execute(*op, block, &mut asked, out);
        }
        self.hold_numbers(block, &codes, asked, out.faults);
        self.run_motion(block, &mut asked, out);
        let mut flow = self.turn_flow(block, asked, out);
        for (_, op) in stops {
            let after = self.execute(*op, block, &mut asked, out);
            flow = if flow == Flow::Next { after } else { flow };
        }
        self.codes = codes;
        if self.compensation.is_some() {
            self.compensate(block, out);
            if flow == Flow::End {
                self.finish(block, out);
            }
        }
        flow
    }

    /// Does what a code says. Motion codes only set the mode.
    fn execute(&mut self, op: Op, block: &Block, asked: &mut Asked, out: &mut Output<'_>) -> Flow {
        asked.axes_claimed |= claims_axes(op);
        match op {
            // Done with F; or nothing that this machine could be told.
            Op::Inches | Op::Millimetres | Op::LookAhead => {}
            Op::InverseTimeFeed | Op::FeedPerMinute | Op::FeedPerTurn => {}
            Op::ToolChange
            | Op::SurfaceSpeed
            | Op::SpindleSpeedConstant
            | Op::SpindleClockwise
            | Op::SpindleCounterClockwise
            | Op::SpindleStop
            | Op::MistOn
            | Op::FloodOn
            | Op::CoolantOff
            | Op::Override(_) => self.switch(op, block, out),
            Op::Function(_) | Op::Modes(_) | Op::WaitInput => self.tell(op, block, *asked, out),
            Op::CompensationOff | Op::Compensate { .. } => self.set_compensation(op, block, out),
            Op::Dwell => self.dwell(block, asked, out),
            Op::MachineCoordinates | Op::ExactStopOnce | Op::Stock(_) => asked.note(op),
            Op::PlaneXy
            | Op::PlaneZx
            | Op::PlaneYz
            | Op::Absolute
            | Op::Incremental
            | Op::ArcCenterAbsolute
            | Op::ArcCenterIncremental
            | Op::Diameter
            | Op::Radius
            | Op::Polar
            | Op::PolarOff
            | Op::ReturnToInitial
            | Op::ReturnToR
            | Op::ExactPath
            | Op::ExactStop => self.set_mode(op),
            Op::Blend => self.blend(block, out.faults),
            Op::SetOffsets
            | Op::LocalOffset
            | Op::SetPosition
            | Op::ResetPosition
            | Op::SuspendPosition
            | Op::RestorePosition
            | Op::LengthOffset(_)
            | Op::WorkSystem(_)
            | Op::FurtherSystem
            | Op::Mirror { .. }
            | Op::ScalingOff
            | Op::Scaling
            | Op::Rotation
            | Op::RotationOff => self.set_frames(op, block, out),
            Op::GoToReference(_) | Op::StoreReference(_) => self.reference(op, block, *asked, out),
            Op::Lathe(code) => self.run_lathe(code, block, asked, out),
            Op::Rapid
            | Op::Line
            | Op::ArcClockwise
            | Op::ArcCounterClockwise
            | Op::Spline(_)
            | Op::Cycle(_)
            | Op::Follow(_)
            | Op::Turn(_)
            | Op::Single(_)
            | Op::MotionOff => self.set_motion(op, asked),
            Op::NurbsEnd => self.end_nurbs(block, asked, out),
            Op::Stop | Op::OptionalStop | Op::PalletStop | Op::End | Op::EndAndRewind => {
                return stop(op, out);
            }
            Op::Return | Op::Call { .. } | Op::Macro(_) => return leads_to(op, block, out.faults),
        }
        Flow::Next
    }

    /// Whether the block asks for a lathe cycle, which needs a contour from elsewhere.
    fn turn_flow(&mut self, block: &Block, asked: Asked, out: &mut Output<'_>) -> Flow {
        if let Some(stock) = asked.stock.filter(|_| !asked.is_faulty) {
            return self.stock_flow(stock, block, out.text, out.faults);
        }
        let MotionMode::Turn(turn) = self.motion else { return Flow::Next };
        let asks = asked.is_motion_named || block.letters() & AXIS_LETTERS != 0;
        let asks = asks && !asked.axes_claimed && !asked.is_faulty;
        if asks && self.judge_turn(turn, block, out.faults) { Flow::Turn(turn) } else { Flow::Next }
    }

    pub(super) fn set_motion(&mut self, op: Op, asked: &mut Asked) {
        asked.is_motion_named = true;
        if matches!(op, Op::Cycle(_) | Op::Single(Single::Hole(_))) {
            self.cycle.set_aside(self.motion);
        } else {
            self.cycle.initial_mm = None;
            self.cycle.is_rigid &= op != Op::MotionOff;
        }
        self.motion = match motion_of(op) {
            // Cycles are a group of their own on these controls: G80 ends one, and no motion code.
            _ if op == Op::MotionOff && self.dialect.is_fanuc() => {
                self.cycle.motion_without(self.motion)
            }
            mode => mode.unwrap_or(self.motion),
        };
    }

    /// Modes that are no more than a value.
    fn set_mode(&mut self, op: Op) {
        match op {
            Op::PlaneXy => self.plane = Plane::Xy,
            Op::PlaneZx => self.plane = Plane::Zx,
            Op::PlaneYz => self.plane = Plane::Yz,
            Op::Absolute => self.absolute = true,
            Op::Incremental => self.absolute = false,
            Op::ArcCenterAbsolute => self.centers_absolute = true,
            Op::ArcCenterIncremental => self.centers_absolute = false,
            Op::Diameter => self.diameters = true,
            Op::Radius => self.diameters = false,
            Op::Polar => (self.polar, self.polar_mode) = (true, PolarMode::default()),
            Op::PolarOff => self.polar = false,
            Op::ReturnToInitial => self.returns_to_r = false,
            Op::ReturnToR => self.returns_to_r = true,
            Op::ExactPath => self.corner = Corner::Exact,
            _ => self.corner = Corner::Stop,
        }
    }

    /// Spindle, coolant, tools.
    fn switch(&mut self, op: Op, block: &Block, out: &mut Output<'_>) {
        let spindle_rpm = self.spindle_rpm;
        match op {
            Op::ToolChange => {
                self.loaded = self.tool;
                self.held_d = self.held_d.filter(|_| self.dialect.is_fanuc());
                self.turning = Turning::Stopped;
                out.event(EventKind::M { code: 6, spindle_rpm: None, tool: self.tool });
            }
            Op::SurfaceSpeed => self.set_spindle_mode(true, block, out.faults),
            Op::SpindleSpeedConstant => self.set_spindle_mode(false, block, out.faults),
            Op::SpindleClockwise => {
                self.turning = Turning::Clockwise;
                out.event(EventKind::M { code: 3, spindle_rpm, tool: None });
            }
            Op::SpindleCounterClockwise => {
                self.turning = Turning::CounterClockwise;
                out.event(EventKind::M { code: 4, spindle_rpm, tool: None });
            }
            Op::SpindleStop => {
                self.turning = Turning::Stopped;
                out.function(5);
            }
            Op::MistOn => {
                self.coolant.mist = true;
                out.function(7);
            }
            Op::FloodOn => {
                self.coolant.flood = true;
                out.function(8);
            }
            Op::Override(code) => self.set_override(code, block),
            _ => {
                self.coolant = Coolant::default();
                out.function(9);
            }
        }
    }

    /// The codes that say where coordinates lie.
    fn set_frames(&mut self, op: Op, block: &Block, out: &mut Output<'_>) {
        let faults = &mut *out.faults;
        match op {
            Op::SetOffsets => self.set_offsets(block, faults),
            Op::LocalOffset => self.set_local_offset(block, faults),
            Op::SetPosition => self.set_position(block, faults),
            Op::ResetPosition => self.frames.reset_shift(),
            Op::SuspendPosition => self.frames.suspend_shift(),
            Op::RestorePosition => self.frames.restore_shift(),
            Op::LengthOffset(length) => self.change_length(length, block, faults),
            Op::WorkSystem(index) => self.choose_system(index.into(), block, faults),
            Op::FurtherSystem => self.choose_further(block, faults),
            Op::Mirror { on: true } => self.set_mirror(block, faults),
            Op::Mirror { on: false } => self.end_mirror(block, faults),
            Op::Scaling => self.set_scaling(block, out),
            Op::ScalingOff => self.end_scaling(block, faults),
            Op::Rotation => self.set_rotation(block, faults),
            _ => self.frames.set_rotation(None),
        }
    }

    /// G64: P is how far a corner may be cut. Q, of joining short lines, asks for less than P does.
    fn blend(&mut self, block: &Block, faults: &mut Vec<Fault>) {
        for word in [b'P', b'Q'].into_iter().filter_map(|letter| block.word(letter)) {
            if word.value < 0.0 {
                let message = "a tolerance cannot be negative";
                let fault = Fault::word(&rules::BAD_VALUE, word, message);
                faults.push(fault.help("write how far corners may be cut: 0 keeps them"));
            }
        }
        let tolerance_mm = block.word(b'P').map(|word| word.value * self.mm_per_unit);
        self.corner = Corner::Blend { tolerance_mm, feed_scale: 1.0 };
    }

    /// The time that a word means: FANUC counts milliseconds in P, unless it has a point.
    pub(super) fn seconds(&self, word: &Word, text: &[u8]) -> f64 {
        let is_ms = self.dialect.is_fanuc() && word.letter == b'P' && !has_point(word, text);
        word.value / if is_ms { 1000.0 } else { 1.0 }
    }

    /// G4: P is the time; without it X or U, as some controls write it.
    fn dwell(&self, block: &Block, asked: &mut Asked, out: &mut Output<'_>) {
        asked.dwell = true;
        let moves = self.codes.iter().any(|(_, op)| motion_of(*op).is_some());
        let other = block.word(b'X').or(block.word(b'U'));
        let other = other.filter(|_| !block.has(b'P') && !moves);
        asked.axes_claimed |= other.is_some();
        match block.word(b'P').or(other) {
            Some(word) if word.value < 0.0 => {
                out.faults.push(Fault::word(&rules::BAD_VALUE, word, "a dwell cannot be negative"));
            }
            Some(word) => {
                out.event(EventKind::Dwell(self.seconds(word, out.text)));
            }
            None if asked.is_faulty => {}
            None => {
                let message = "G4 has no P, the time to wait";
                let fault = Fault::block(&rules::MISSING_WORD, block, message);
                out.faults.push(fault.help("write the seconds, as G4 P0.5"));
            }
        }
    }
}

/// The letters of a machine's linear axes.
fn linear_letters(machine: &Machine) -> u32 {
    let axes = machine.axes.iter().map(|profile| profile.axis).filter(|axis| !axis.is_rotary());
    axes.fold(0, |letters, axis| letters | letter_bit(axis.letter() as u8))
}

pub(super) fn is_error(fault: &Fault) -> bool {
    fault.rule.severity == crate::base::Severity::Error
}

/// Stops, the last of them for good.
fn stop(op: Op, out: &mut Output<'_>) -> Flow {
    let (code, flow) = match op {
        Op::Stop => (0, Flow::Next),
        Op::OptionalStop => (1, Flow::Next),
        Op::PalletStop => (60, Flow::Next),
        Op::End => (2, Flow::End),
        _ => (30, Flow::End),
    };
    out.function(code);
    flow
}

/// The motion mode that a code sets.
pub(super) fn motion_of(op: Op) -> Option<MotionMode> {
    match op {
        Op::Rapid => Some(MotionMode::Rapid),
        Op::Line => Some(MotionMode::Line),
        Op::ArcClockwise => Some(MotionMode::Arc { ccw: false }),
        Op::ArcCounterClockwise => Some(MotionMode::Arc { ccw: true }),
        Op::Cycle(cycle) => Some(MotionMode::Cycle(cycle)),
        Op::Follow(follow) => Some(MotionMode::Follow(follow)),
        Op::Turn(turn) => Some(MotionMode::Turn(turn)),
        Op::Single(single) => Some(MotionMode::Single(single)),
        Op::Spline(code) => Some(MotionMode::Spline(code)),
        Op::MotionOff | Op::NurbsEnd => Some(MotionMode::None),
        _ => None,
    }
}
