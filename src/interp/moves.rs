//! Movement: where axis words lead, and the arcs between.

use crate::base::{Axis, Point};
use crate::gcode::codes::{ARC_LETTERS, AXIS_LETTERS, POLAR_LETTERS};
use crate::gcode::{Block, Fault, Word, letter_bit, rules};

use super::arc::center_letter;
use super::execute::{Asked, Executor, MotionMode, Output};
use super::motion::{Bound, Corner, Motion, Move, MoveKind};
use super::words::{machine_coordinates_alone, whole};

/// Letters of the axes that turn.
const ROTARY_LETTERS: u32 = letter_bit(b'A') | letter_bit(b'B') | letter_bit(b'C');

/// Where frames turn or scale, a target this near to where the machine stands is that place: what
/// rounding makes of it would be a move of its own.
const SAME_PLACE_MM: f64 = 1e-9;

/// Turns of an arc at most.
const TURNS_MAX: u32 = 1_000_000;

/// Moves of one block at most: cycles of lathes have as many as cuts times pieces of their contour.
pub(super) const BLOCK_MOVES_MAX: usize = 250_000;

/// Reports, once, that a block makes too many moves.
#[cold]
pub(super) fn refuse_more(block: &Block, faults: &mut Vec<Fault>) {
    const MESSAGE: &str = "this block makes too many moves";
    if faults.iter().all(|fault| fault.message != MESSAGE) {
        let help = format!("no more than {BLOCK_MOVES_MAX}: take fewer or deeper cuts");
        faults.push(Fault::block(&rules::BAD_VALUE, block, MESSAGE).help(help));
    }
}

impl Executor<'_> {
    /// Moves, if the block asks for it.
    pub(super) fn run_motion(&mut self, block: &Block, asked: &mut Asked, out: &mut Output<'_>) {
        if self.held_move.is_some() || self.is_dimensioned(block, asked) {
            self.run_dimensioned(block, asked, out);
        } else if block.letters() & POLAR_LETTERS == 0 {
            if self.polar {
                asked.polar_step = self.polar_mode_step(block);
            }
            self.run_axis_words(block, asked, out);
        } else if let Some(first) = self.polar_without_motion(block, asked) {
            out.faults.push(no_motion_code(first));
            self.forget_position();
        } else if let Some(resolved) = self.resolve_polar(block, asked, out.faults) {
            self.run_axis_words(&resolved, asked, out);
        } else {
            self.forget_position();
        }
    }

    /// The first of `@` and `^`, if there is no motion that could go there.
    fn polar_without_motion<'b>(&self, block: &'b Block, asked: &Asked) -> Option<&'b Word> {
        let is_none = self.motion == MotionMode::None && !asked.axes_claimed;
        block.first_of(POLAR_LETTERS).filter(|_| is_none)
    }

    pub(super) fn run_axis_words(&mut self, block: &Block, asked: &Asked, out: &mut Output<'_>) {
        if let MotionMode::Cycle(cycle) = self.motion {
            let asks = block.letters() & AXIS_LETTERS != 0 || asked.is_motion_named;
            if asks && !asked.axes_claimed && self.is_thread(cycle, block) {
                self.thread_cycle(block, *asked, out);
            } else if asks && !asked.axes_claimed {
                self.run_cycle(cycle, block, *asked, out);
            }
            return;
        }
        if let MotionMode::Spline(code) = self.motion {
            self.run_spline(code, block, *asked, out);
            return;
        }
        let is_arc = matches!(self.motion, MotionMode::Arc { .. });
        let words = if is_arc { AXIS_LETTERS | ARC_LETTERS } else { AXIS_LETTERS };
        let first = block.first_of(block.letters() & words).filter(|_| !asked.axes_claimed);
        if let MotionMode::Single(single) = self.motion {
            if block.letters() & AXIS_LETTERS != 0 && !asked.axes_claimed {
                self.run_single(single, block, *asked, out);
            }
            return;
        }
        if matches!(self.motion, MotionMode::Turn(_)) {
            // It goes along a contour, which is not of this block.
            return;
        }
        let Some(first) = first else {
            if !asked.is_faulty {
                self.names_no_axis(block, asked, out.faults);
            }
            return;
        };
        let faults_before = out.faults.len();
        let to = self.target(block, asked, out.faults);
        let is_whole = !asked.is_faulty && out.faults.len() == faults_before;
        let kind = match self.motion {
            _ if !is_whole => None,
            MotionMode::Foreign | MotionMode::Cycle(_) | MotionMode::Spline(_) => None,
            MotionMode::Turn(_) | MotionMode::Single(_) => None,
            MotionMode::Follow(follow) => {
                self.follow(follow, block, &to, *asked, out);
                return;
            }
            MotionMode::None => {
                out.faults.push(no_motion_code(first));
                None
            }
            MotionMode::Rapid => Some(MoveKind::Rapid),
            MotionMode::Line => {
                self.has_feed(block, out.faults).then_some(MoveKind::Line { feed_mm_min: 0.0 })
            }
            MotionMode::Arc { .. } if asked.machine_coordinates => {
                machine_coordinates_alone(block, out.faults);
                None
            }
            MotionMode::Arc { ccw } => self.arc(block, *asked, ccw, &to, out.faults),
        };
        match kind {
            Some(kind) => self.go(block, &to, kind, asked.corner, out),
            None => self.position_mm = to,
        }
        if self.motion == MotionMode::Foreign {
            self.forget_position();
        }
    }

    /// Reports codes of a block without axis words that cannot do without.
    fn names_no_axis(&self, block: &Block, asked: &Asked, faults: &mut Vec<Fault>) {
        if asked.machine_coordinates {
            machine_coordinates_alone(block, faults);
        }
        let follows = matches!(self.motion, MotionMode::Follow(_)) && asked.is_motion_named;
        if let Some(code) = self.motion.code().filter(|_| follows) {
            let message = format!("{} leads nowhere: it names no axis", code.name());
            faults.push(Fault::block(&rules::MISSING_WORD, block, message));
        }
    }

    /// Makes a move from where the machine stands.
    pub(super) fn go(
        &mut self,
        block: &Block,
        to: &Point,
        kind: MoveKind,
        corner: Option<Corner>,
        out: &mut Output<'_>,
    ) {
        let is_line = matches!(kind, MoveKind::Line { .. });
        let turns_only = is_line && self.turns_only(block, to);
        let corner = corner.unwrap_or_else(|| self.corner_here());
        let (n, from) = (line_number(block), self.position_mm);
        let step = Move { line: out.line, n, from, to: *to, kind, corner, bound: Bound::Free };
        self.position_mm = *to;
        if out.motions.len() >= BLOCK_MOVES_MAX {
            return refuse_more(block, out.faults);
        }
        out.motions.push(Motion::Move(step));
        if let Some(Motion::Move(step)) = out.motions.last_mut() {
            self.apply_feed(step, turns_only);
        }
    }

    /// What may become of the corner at the end of a move here.
    #[inline]
    pub(super) fn corner_here(&self) -> Corner {
        match self.corner {
            Corner::Blend { tolerance_mm, .. } => {
                Corner::Blend { tolerance_mm, feed_scale: self.feed_scale() }
            }
            corner => corner,
        }
    }

    /// A move from where the machine stands, without the feed in force.
    pub(super) fn step(&mut self, block: &Block, to: &Point, kind: MoveKind, line: u32) -> Move {
        let from = std::mem::replace(&mut self.position_mm, *to);
        let (n, corner) = (line_number(block), self.corner_here());
        Move { line, n, from, to: *to, kind, corner, bound: Bound::Free }
    }

    /// Where the axis words lead; the position that a faulty word leads to is open.
    #[inline]
    pub(super) fn target(
        &mut self,
        block: &Block,
        asked: &Asked,
        faults: &mut Vec<Fault>,
    ) -> Point {
        if (self.frames.is_plain() && !self.polar) || asked.machine_coordinates {
            return self.plain_target(block, asked, faults);
        }
        let program = self.program_target(block, faults);
        if asked.is_faulty {
            self.forget_position();
        }
        self.place(&program)
    }

    /// The same where frames only shift.
    #[inline]
    fn plain_target(&mut self, block: &Block, asked: &Asked, faults: &mut Vec<Fault>) -> Point {
        let mut to = self.position_mm;
        for word in block.words() {
            let Some((axis, value)) = self.axis_word(word, faults) else { continue };
            if asked.machine_coordinates {
                to[axis] = value;
            } else if self.is_position(word) {
                to[axis] = self.frames.offset_mm()[axis] + value;
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

    /// Where the axis words lead, in program coordinates.
    pub(super) fn program_target(&mut self, block: &Block, faults: &mut Vec<Fault>) -> Point {
        let from = self.frames.program(&self.position_mm);
        let mut to = from;
        let [first, second] = self.plane.axes();
        for word in block.words() {
            let Some((axis, value)) = self.axis_word(word, faults) else { continue };
            // The angle of polar coordinates has no other unit.
            let value = if self.polar && axis == second { word.value } else { value };
            to[axis] = if self.is_position(word) { value } else { from[axis] + value };
        }
        let words = [first, second].map(|axis| block.word(axis.letter() as u8));
        if self.polar && (words[0].is_some() || words[1].is_some()) {
            let (at, told) = ([from[first], from[second]], [to[first], to[second]]);
            let Some(polar) = self.polar_target(words, at, told, faults) else { return from };
            [to[first], to[second]] = polar;
        }
        to
    }

    /// Machine coordinates of a point of the program, exactly the present ones where it is there.
    pub(super) fn place(&self, program: &Point) -> Point {
        let mut to = self.frames.machine(program);
        for axis in Axis::ALL {
            if (to[axis] - self.position_mm[axis]).abs() < SAME_PLACE_MM {
                to[axis] = self.position_mm[axis];
            }
        }
        to
    }

    /// The axis of a word and its value in mm or degrees; none for other words, and for axes that
    /// the machine does not have.
    #[inline]
    pub(super) fn axis_word(
        &mut self,
        word: &Word,
        faults: &mut Vec<Fault>,
    ) -> Option<(Axis, f64)> {
        let axis = self.axis_of(word.letter)?;
        if !self.axes.contains(axis) {
            self.miss_axis(word, faults);
            return None;
        }
        self.axes_used.insert(axis);
        let scale = if axis.is_rotary() { 1.0 } else { self.mm_per_unit };
        let share = if self.diameters && axis == Axis::X { 0.5 } else { 1.0 };
        Some((axis, word.value * scale * share))
    }

    #[cold]
    fn miss_axis(&self, word: &Word, faults: &mut Vec<Fault>) {
        let (id, axis, has) =
            (&self.machine.id, char::from(word.letter), self.machine.axis_names());
        let message = format!("{word}: the machine {id} has no {axis} axis: it has {has}");
        let fault = Fault::word(&rules::MISSING_AXIS, word, message);
        let is_distance = matches!(word.letter, b'U' | b'W') && self.dialect.lathe().is_none();
        faults.push(fault.help(match is_distance {
            true => {
                "on lathes U and W are X and Z by distances: --dialect fanuc-lathe; else leave the word out, \
                 or take another machine (--machine)"
            }
            false => "leave the word out, or take another machine (--machine)",
        }));
    }

    /// Whether a move turns rotary axes and moves no other: its feed is in degrees a minute.
    fn turns_only(&self, block: &Block, to: &Point) -> bool {
        block.letters() & ROTARY_LETTERS != 0 && self.position_mm.feed_way(to).1.contains(&Axis::A)
    }

    fn arc(
        &mut self,
        block: &Block,
        asked: Asked,
        ccw: bool,
        to: &Point,
        faults: &mut Vec<Fault>,
    ) -> Option<MoveKind> {
        let has_feed = self.has_feed(block, faults);
        let across = center_letter(self.plane.normal());
        // CAM programs write K0 in XY: it says nothing.
        let says_nothing = |word: &Word| word.value == 0.0 && !self.centers_absolute;
        if let Some(word) = block.word(across).filter(|word| !says_nothing(word)) {
            let name = self.plane.name();
            let message = format!("an arc in the {name} plane makes no use of {word}");
            let help = "choose the plane by G17 (XY: I J), G18 (ZX: K I) or G19 (YZ: J K)";
            faults.push(Fault::word(&rules::UNUSED_WORD, word, message).help(help));
            return None;
        }
        let turns = match block.word(b'P').filter(|_| !asked.dwell) {
            Some(word) => turns(word, faults)? - 1,
            None => 0,
        };
        let axes = self.plane.axes();
        if axes.iter().any(|axis| self.open.contains(*axis)) {
            return None;
        }
        let Some(is_mirrored) = self.frames.arcs_mirrored(self.plane) else {
            let message = "this arc would be none after the scaling or rotation in force";
            let help = "scale both axes of its plane alike, and turn within its plane only";
            faults.push(Fault::block(&rules::ARC_DISTORTED, block, message).help(help));
            return None;
        };
        // Where frames only shift, an arc is the same in machine coordinates.
        let is_plain = self.frames.is_plain();
        let named = |point: &Point| if is_plain { *point } else { self.frames.program(point) };
        let (start, end) = (named(&self.position_mm), named(to));
        let ends_mm = [&start, &end].map(|point| axes.map(|axis| point[axis]));
        let zero_mm = if is_plain { self.frames.offset_mm() } else { &Point::ZERO };
        let task = self.arc_task(block, ccw, ends_mm, zero_mm);
        let mut center_mm = task.center_mm(faults)?;
        if !is_plain {
            let mut center = start;
            [center[axes[0]], center[axes[1]]] = center_mm;
            let center = self.frames.machine(&center);
            center_mm = axes.map(|axis| center[axis]);
        }
        let ccw = ccw != is_mirrored;
        let (plane, feed_mm_min) = (self.plane, 0.0);
        has_feed.then_some(MoveKind::Arc { feed_mm_min, plane, center_mm, ccw, turns })
    }
}

fn no_motion_code(word: &Word) -> Fault {
    let message = format!("{word} moves an axis, but no motion code is in force");
    let fault = Fault::word(&rules::NO_MOTION_MODE, word, message);
    fault.help("write G0 or G1 before it: G80 ends what was in force")
}

/// P of an arc: how many turns, the last of them not always a whole one.
fn turns(word: &Word, faults: &mut Vec<Fault>) -> Option<u32> {
    let before = faults.len();
    let turns = whole(word, TURNS_MAX, faults).filter(|turns| *turns >= 1);
    if turns.is_none() {
        faults.truncate(before);
        let message =
            format!("{word}: the turns of an arc are a whole number from 1 to {TURNS_MAX}");
        let fault = Fault::word(&rules::BAD_VALUE, word, message);
        faults.push(fault.help("P1 is the arc itself, P2 that and a full turn more"));
    }
    turns
}

/// The block's N word; one that is no line number has been reported.
pub(super) fn line_number(block: &Block) -> Option<u32> {
    block.word(b'N').map(|word| word.value as u32)
}
