//! One block → motion and events, by the modes in force.
//!
//! Order in a block, as RS274/NGC has it: F, S, T, units, then the codes in the order of their
//! groups ([`Group`]), motion, stop. So an F beside G20 or G21 is still in the units before. Whatever is wrong leaves the modes as they would be without the
//! fault, so that one fault does not make others; positions that a fault leaves open are known to
//! be open.

use crate::base::{Axis, AxisSet, Event, EventKind, Machine, Plane, Point};
use crate::gcode::codes::{self, ARC_LETTERS, AXIS_LETTERS, Code, FREE_LETTERS, Group, Op};
use crate::gcode::{Block, Fault, Word, letter_bit, rules};

use super::arc::{ArcTask, center_letter};
use super::flow::Flow;
use super::motion::{Motion, Move, MoveKind};
use super::words::{
    call_flow, conflict, go_together, machine_coordinates_alone, return_flow, subprogram_flow,
    unsupported, whole,
};

/// Millimetres an inch.
pub(super) const MM_PER_INCH: f64 = 25.4;

/// Letters of the axes that turn.
const ROTARY_LETTERS: u32 = letter_bit(b'A') | letter_bit(b'B') | letter_bit(b'C');

/// The motion code in force.
#[derive(Clone, Copy, Debug, PartialEq)]
enum MotionMode {
    None,
    Rapid,
    Line,
    Arc {
        ccw: bool,
    },
    /// A code that is not supported: its axis words are its own.
    Foreign,
}

/// The feed in force. Inches are resolved for lengths; degrees have no other unit.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Feed {
    mm_min: f64,
    deg_min: f64,
}

/// The state of a run: modes and position.
#[derive(Clone, Debug)]
pub(super) struct Executor<'a> {
    pub(super) machine: &'a Machine,
    axes: AxisSet,
    motion: MotionMode,
    plane: Plane,
    pub(super) mm_per_unit: f64,
    pub(super) absolute: bool,
    feed: Option<Feed>,
    feed_missed: bool,
    spindle_rpm: Option<f64>,
    tool: Option<u32>,
    position_mm: Point,
    /// Axes whose position a fault has left open.
    open: AxisSet,
    /// Whether coordinates mean something else since a code that is not supported.
    is_shifted: bool,
    block_delete_said: bool,
    /// Axes that some word has addressed.
    pub axes_used: AxisSet,
    /// Supported codes of the block in order of execution.
    codes: Vec<(&'static Code, Op)>,
}

/// What the codes of a block ask for besides modes.
#[derive(Clone, Copy, Debug, Default)]
struct Asked {
    /// A word of the block is wrong: no motion can be told from it.
    is_faulty: bool,
    /// A code is unknown: the words it needs are so too.
    is_foreign: bool,
    machine_coordinates: bool,
    dwell: bool,
}

/// Where a block stands, and where what it makes goes.
pub(super) struct Output<'o> {
    pub line: u32,
    pub motions: &'o mut Vec<Motion>,
    pub faults: &'o mut Vec<Fault>,
}

impl Output<'_> {
    fn event(&mut self, kind: EventKind) {
        self.motions.push(Motion::Event(Event { line: self.line, kind }));
    }

    fn function(&mut self, code: u16) {
        self.event(EventKind::M { code, spindle_rpm: None, tool: None });
    }
}

impl<'a> Executor<'a> {
    /// At the start: G17 G21 G40 G49 G54 G61 G80 G90 G94 G97, no feed, no speed, no tool.
    pub fn new(machine: &'a Machine, start_mm: Point) -> Executor<'a> {
        Executor {
            machine,
            axes: machine.axes.iter().map(|profile| profile.axis).collect(),
            motion: MotionMode::None,
            plane: Plane::Xy,
            mm_per_unit: 1.0,
            absolute: true,
            feed: None,
            feed_missed: false,
            spindle_rpm: None,
            tool: None,
            position_mm: start_mm,
            open: AxisSet::EMPTY,
            is_shifted: false,
            block_delete_said: false,
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
        if block.delete && !self.block_delete_said {
            self.block_delete_said = true;
            let message = "this line is executed, and so is every other that begins with /";
            let fault = Fault::new(&rules::BLOCK_DELETE, 0, 1, message);
            out.faults.push(fault.help("--block-delete skips these lines"));
        }
        let text_is_faulty = out.faults.iter().any(is_error);
        if text_is_faulty {
            self.forget_position();
        }
        if let Some(call) = &block.call {
            return call_flow(block, call, out.faults);
        }
        let mut asked = self.classify(block, out.faults);
        asked.is_faulty |= text_is_faulty;
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
        self.run_motion(block, asked, out);
        let mut flow = Flow::Next;
        for (_, op) in stops {
            flow = self.execute(*op, block, &mut asked, out);
        }
        self.codes = codes;
        flow
    }

    /// Finds the codes of a block and what is wrong with them by themselves.
    pub fn check_codes(&mut self, block: &Block, faults: &mut Vec<Fault>) {
        self.classify(block, faults);
    }

    fn classify(&mut self, block: &Block, faults: &mut Vec<Fault>) -> Asked {
        self.codes.clear();
        let mut asked = Asked::default();
        let mut groups = 0_u32;
        for word in block.words() {
            if !matches!(word.letter, b'G' | b'M') {
                if word.letter == b'E' {
                    let help = "numbers have no exponents: write all digits";
                    let message = format!("{word} means nothing here");
                    let fault = Fault::word(&rules::UNSUPPORTED_WORD, word, message);
                    faults.push(fault.help(help));
                    asked.is_foreign = true;
                }
                continue;
            }
            let Some(code) = codes::find(word.letter, word.value) else {
                faults.push(Fault::word(
                    &rules::UNKNOWN_WORD,
                    word,
                    format!("there is no {word} in any dialect known here"),
                ));
                asked.is_foreign = true;
                continue;
            };
            let bit = 1 << code.group as u32;
            if groups & bit != 0 {
                let rival = self.codes.iter().find(|(rival, _)| rival.group == code.group);
                if let Some((rival, _)) = rival.filter(|(rival, _)| !go_together(rival, code)) {
                    faults.push(conflict(rival, code, word));
                    asked.is_faulty = true;
                }
            }
            groups |= bit;
            match code.op {
                Some(op) => self.codes.push((code, op)),
                None => {
                    faults.push(unsupported(code, word));
                    asked.is_foreign = true;
                    self.is_shifted |= code.group.moves_coordinates();
                    if code.group == Group::Motion {
                        self.motion = MotionMode::Foreign;
                    }
                }
            }
        }
        asked.is_faulty |= asked.is_foreign;
        if self.codes.len() > 1 {
            self.codes.sort_by_key(|(code, _)| code.group);
        }
        asked
    }

    /// Reports words of the block that nothing makes use of.
    fn has_unused_words(&self, block: &Block, asked: Asked, faults: &mut Vec<Fault>) -> bool {
        let mode = self.codes.iter().rev().find_map(|(_, op)| motion_of(*op));
        let mode = mode.unwrap_or(self.motion);
        if asked.is_foreign || mode == MotionMode::Foreign {
            return false;
        }
        let mut used = FREE_LETTERS | AXIS_LETTERS;
        for (code, _) in &self.codes {
            used |= code.words;
        }
        if let MotionMode::Arc { .. } = mode {
            used |= ARC_LETTERS | letter_bit(b'P');
        }
        if block.letters() & !used == 0 {
            return false;
        }
        for word in block.words().iter().filter(|word| letter_bit(word.letter) & !used != 0) {
            let message = format!("nothing in this block makes use of {word}");
            let fault = Fault::word(&rules::UNUSED_WORD, word, message);
            faults.push(match word.letter {
                b'I' | b'J' | b'K' | b'R' => fault.help("arcs need G2 or G3 in force"),
                b'D' => fault.help("D goes with cutter compensation, which is not supported"),
                b'H' => fault.help("H goes with tool length offsets, which are not supported"),
                _ => fault.help("leave it out, or write the code that it belongs to"),
            });
        }
        true
    }

    /// Takes F, S, T and units.
    fn set_words(&mut self, block: &Block, asked: Asked, out: &mut Output<'_>) {
        self.set_free_words(block, asked, out);
        self.mm_per_unit = self.units_after();
    }

    /// Millimetres a unit once the block's codes are in force.
    fn units_after(&self) -> f64 {
        match self.codes.first() {
            Some((_, Op::Inches)) => MM_PER_INCH,
            Some((_, Op::Millimetres)) => 1.0,
            _ => self.mm_per_unit,
        }
    }

    fn set_free_words(&mut self, block: &Block, asked: Asked, out: &mut Output<'_>) {
        if block.letters() & FREE_LETTERS & !letter_bit(b'G') == 0 {
            return;
        }
        if let Some(word) = block.word(b'F') {
            self.set_feed(word, out.faults);
        }
        if let Some(word) = block.word(b'S') {
            self.set_speed(word, out);
        }
        if let Some(word) = block.word(b'T') {
            self.tool = whole(word, 99_999, out.faults).or(self.tool);
            if let Some(tool) = self.tool.filter(|_| !self.asks(Op::ToolChange)) {
                out.event(EventKind::T(tool));
            }
        }
        for letter in [b'N', b'O'] {
            if let Some(word) = block.word(letter).filter(|_| !asked.is_faulty) {
                whole(word, 999_999_999, out.faults);
            }
        }
    }

    fn asks(&self, op: Op) -> bool {
        self.codes.iter().any(|(_, other)| *other == op)
    }

    fn set_feed(&mut self, word: &Word, faults: &mut Vec<Fault>) {
        self.feed_missed = false;
        let feed = Feed { mm_min: word.value * self.mm_per_unit, deg_min: word.value };
        self.feed = Some(feed).filter(|feed| feed.deg_min > 0.0);
        if word.value < 0.0 {
            self.feed_missed = true;
            faults.push(Fault::word(&rules::BAD_VALUE, word, "a feed cannot be negative"));
        }
        if self.units_after() != self.mm_per_unit {
            let (unit, other) =
                if self.mm_per_unit == 1.0 { ("mm", "inches") } else { ("inches", "mm") };
            let message = format!(
                "{word} is taken in {unit} a minute, the units before this block; other controls \
                 take it in {other}"
            );
            let fault = Fault::word(&rules::FEED_UNITS, word, message);
            faults.push(fault.help("change the units in a block before"));
        }
    }

    fn set_speed(&mut self, word: &Word, out: &mut Output<'_>) {
        if word.value < 0.0 {
            let message = "a spindle speed cannot be negative";
            let fault = Fault::word(&rules::BAD_VALUE, word, message);
            out.faults.push(fault.help("M4 turns the spindle counter-clockwise"));
            return;
        }
        self.spindle_rpm = Some(word.value);
        let greatest = self.machine.spindle.map(|spindle| f64::from(spindle.speed_max_rpm));
        if let Some(greatest) = greatest.filter(|greatest| word.value > *greatest) {
            let message = format!("{word}: the machine's spindle turns at {greatest} rpm at most");
            out.faults.push(Fault::word(&rules::SPINDLE_SPEED, word, message));
        }
        if !self.asks(Op::SpindleClockwise) && !self.asks(Op::SpindleCounterClockwise) {
            out.event(EventKind::S(word.value));
        }
    }

    /// Does what a code says. Motion codes only set the mode.
    fn execute(&mut self, op: Op, block: &Block, asked: &mut Asked, out: &mut Output<'_>) -> Flow {
        let spindle_rpm = self.spindle_rpm;
        match op {
            Op::Inches | Op::Millimetres => {} // done after F
            // What is in force anyway: the other codes of these groups are not supported.
            Op::FeedPerMinute
            | Op::SpindleSpeedConstant
            | Op::CompensationOff
            | Op::LengthOffsetOff
            | Op::WorkOffset1
            | Op::ExactPath
            | Op::ArcCenterIncremental => {}
            Op::ToolChange => {
                out.event(EventKind::M { code: 6, spindle_rpm: None, tool: self.tool });
            }
            Op::SpindleClockwise => out.event(EventKind::M { code: 3, spindle_rpm, tool: None }),
            Op::SpindleCounterClockwise => {
                out.event(EventKind::M { code: 4, spindle_rpm, tool: None });
            }
            Op::SpindleStop => out.function(5),
            Op::MistOn => out.function(7),
            Op::FloodOn => out.function(8),
            Op::CoolantOff => out.function(9),
            Op::Dwell => {
                asked.dwell = true;
                self.dwell(block, asked, out);
            }
            Op::MachineCoordinates => asked.machine_coordinates = true,
            Op::PlaneXy => self.plane = Plane::Xy,
            Op::PlaneZx => self.plane = Plane::Zx,
            Op::PlaneYz => self.plane = Plane::Yz,
            Op::Absolute => self.absolute = true,
            Op::Incremental => self.absolute = false,
            Op::Rapid | Op::Line | Op::ArcClockwise | Op::ArcCounterClockwise | Op::MotionOff => {
                self.motion = motion_of(op).unwrap_or(self.motion);
            }
            Op::Stop => out.function(0),
            Op::OptionalStop => out.function(1),
            Op::PalletStop => out.function(60),
            Op::End => {
                out.function(2);
                return Flow::End;
            }
            Op::EndAndRewind => {
                out.function(30);
                return Flow::End;
            }
            Op::Return => return return_flow(block, out.faults),
            Op::Call => return subprogram_flow(block, out.faults),
            // With a P it is a call, and does not get here.
            Op::MacroCall => return subprogram_flow(block, out.faults),
        }
        Flow::Next
    }

    fn dwell(&self, block: &Block, asked: &Asked, out: &mut Output<'_>) {
        match block.word(b'P') {
            Some(word) if word.value < 0.0 => {
                out.faults.push(Fault::word(&rules::BAD_VALUE, word, "a dwell cannot be negative"));
            }
            Some(word) => out.event(EventKind::Dwell(word.value)),
            None if asked.is_faulty => {}
            None => {
                let message = "G4 has no P, the time to wait";
                let fault = Fault::block(&rules::MISSING_WORD, block, message);
                out.faults.push(fault.help("write the seconds, as G4 P0.5"));
            }
        }
    }

    /// Moves, if the block asks for it.
    fn run_motion(&mut self, block: &Block, asked: Asked, out: &mut Output<'_>) {
        let is_arc = matches!(self.motion, MotionMode::Arc { .. });
        let words = if is_arc { AXIS_LETTERS | ARC_LETTERS } else { AXIS_LETTERS };
        let Some(first) = block.first_of(block.letters() & words) else {
            if asked.machine_coordinates && !asked.is_faulty {
                machine_coordinates_alone(block, out.faults);
            }
            return;
        };
        let faults_before = out.faults.len();
        let to = self.target(block, asked, out.faults);
        let is_whole = !asked.is_faulty && out.faults.len() == faults_before;
        let kind = match self.motion {
            _ if !is_whole => None,
            MotionMode::Foreign => None,
            MotionMode::None => {
                let message = format!("{first} moves an axis, but no motion code is in force");
                let fault = Fault::word(&rules::NO_MOTION_MODE, first, message);
                out.faults.push(fault.help("write G0 or G1 before it"));
                None
            }
            MotionMode::Rapid => Some(MoveKind::Rapid),
            MotionMode::Line => {
                let turns_only = self.turns_only(block, &to);
                self.feed(block, out.faults).map(|feed| MoveKind::Line {
                    feed_mm_min: if turns_only { feed.deg_min } else { feed.mm_min },
                })
            }
            MotionMode::Arc { .. } if asked.machine_coordinates => {
                machine_coordinates_alone(block, out.faults);
                None
            }
            MotionMode::Arc { ccw } => self.arc(block, asked, ccw, &to, out.faults),
        };
        let from = std::mem::replace(&mut self.position_mm, to);
        if let Some(kind) = kind {
            // A word that is no line number has been reported.
            let n = block.word(b'N').map(|word| word.value as u32);
            out.motions.push(Motion::Move(Move { line: out.line, n, from, to, kind }));
        } else if self.motion == MotionMode::Foreign {
            self.forget_position();
        }
    }

    /// Where the axis words lead; the position that a faulty word leads to is open.
    fn target(&mut self, block: &Block, asked: Asked, faults: &mut Vec<Fault>) -> Point {
        let mut to = self.position_mm;
        for word in block.words() {
            if AXIS_LETTERS & letter_bit(word.letter) == 0 {
                continue;
            }
            let Some(axis) = Axis::from_letter(word.letter) else { continue };
            if !self.axes.contains(axis) {
                let message = format!("{word}: the machine {} has no {axis} axis", self.machine.id);
                let fault = Fault::word(&rules::MISSING_AXIS, word, message);
                faults.push(fault.help("leave the word out, or take another machine (--machine)"));
                continue;
            }
            self.axes_used.insert(axis);
            let scale = if axis.is_rotary() { 1.0 } else { self.mm_per_unit };
            let value = word.value * scale;
            if asked.machine_coordinates {
                to[axis] = value;
            } else if self.absolute {
                to[axis] = self.machine.work_zero_mm[axis] + value;
            } else {
                to[axis] += value;
                continue;
            }
            if !self.open.is_empty() {
                self.open = self.open.iter().filter(|other| *other != axis).collect();
            }
        }
        if asked.is_faulty {
            self.forget_position();
        }
        to
    }

    /// The feed in force. The first movement that lacks one is reported, until there is one.
    fn feed(&mut self, block: &Block, faults: &mut Vec<Fault>) -> Option<Feed> {
        if self.feed.is_none() && !self.feed_missed {
            self.feed_missed = true;
            let message = "this movement needs a feed, and none has been given";
            let fault = Fault::block(&rules::NO_FEED, block, message);
            faults.push(fault.help("write F and the feed in mm (G21) or inches (G20) a minute"));
        }
        self.feed
    }

    /// Whether a move turns rotary axes and moves no other: its feed is in degrees a minute.
    fn turns_only(&self, block: &Block, to: &Point) -> bool {
        let stays = |axis: Axis| axis.is_rotary() || to[axis] == self.position_mm[axis];
        block.letters() & ROTARY_LETTERS != 0 && Axis::ALL.into_iter().all(stays)
    }

    fn arc(
        &mut self,
        block: &Block,
        asked: Asked,
        ccw: bool,
        to: &Point,
        faults: &mut Vec<Fault>,
    ) -> Option<MoveKind> {
        let feed = self.feed(block, faults);
        let across = center_letter(self.plane.normal());
        if let Some(word) = block.word(across) {
            let name = self.plane.name();
            let message = format!("an arc in the {name} plane makes no use of {word}");
            let help = "choose the plane by G17 (XY: I J), G18 (ZX: K I) or G19 (YZ: J K)";
            faults.push(Fault::word(&rules::UNUSED_WORD, word, message).help(help));
            return None;
        }
        let turns = match block.word(b'P').filter(|_| !asked.dwell) {
            Some(word) if word.value < 1.0 => {
                faults.push(Fault::word(&rules::BAD_VALUE, word, "an arc has at least one turn"));
                return None;
            }
            Some(word) => whole(word, 1_000_000, faults)? - 1,
            None => 0,
        };
        let axes = self.plane.axes();
        if axes.iter().any(|axis| self.open.contains(*axis)) {
            return None;
        }
        let start_mm = axes.map(|axis| self.position_mm[axis]);
        let zero_mm = axes.map(|axis| self.machine.work_zero_mm[axis]);
        let task = ArcTask {
            block,
            plane: self.plane,
            ccw,
            start_mm,
            end_mm: axes.map(|axis| to[axis]),
            mm_per_unit: self.mm_per_unit,
            end_origin_mm: if self.absolute { zero_mm } else { start_mm },
            tolerance_mm: self.machine.arc_radius_tolerance_mm,
            steps_per_mm: self.machine.axis(axes[0]).map_or(0.0, |profile| profile.steps_per_mm),
        };
        let center_mm = task.center_mm(faults)?;
        let feed_mm_min = feed?.mm_min;
        Some(MoveKind::Arc { feed_mm_min, plane: self.plane, center_mm, ccw, turns })
    }
}

fn is_error(fault: &Fault) -> bool {
    fault.rule.severity == crate::base::Severity::Error
}

/// The motion mode that a code sets.
fn motion_of(op: Op) -> Option<MotionMode> {
    match op {
        Op::Rapid => Some(MotionMode::Rapid),
        Op::Line => Some(MotionMode::Line),
        Op::ArcClockwise => Some(MotionMode::Arc { ccw: false }),
        Op::ArcCounterClockwise => Some(MotionMode::Arc { ccw: true }),
        Op::MotionOff => Some(MotionMode::None),
        _ => None,
    }
}
