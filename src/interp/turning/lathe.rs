//! FANUC-style lathes (G code system A; in system B the cycles are G77 to G79): U W V H as distances, G50, T with its offset, and the
//! cycles that cut once: G90, G92, G94.
//!
//! ```text
//!   G90, G92:  3 ◀────────── 2        G94:  1 ────────▶ 2
//!              │ feed        │ rapid        │ feed      │ rapid
//!              ▼             ▲              ▼           ▲        each from and to where the
//!           along Z ◀─────── start         (along X)  start      cycle begins
//! ```
//!
//! Threads end square: the pull-out that a parameter of the control adds to G92 is not made.

use crate::base::{Axis, EventKind, Point};
use crate::gcode::codes::{AXIS_LETTERS, LatheCode, Single};
use crate::gcode::{Block, Fault, Word, letter_bit, rules};

use crate::interp::Dialect;
use crate::interp::execute::{Asked, Executor, Output};
use crate::interp::motion::{Corner, MoveKind};

use super::thread::ThreadWords;

/// What a lathe's program has set.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::interp) struct Lathe {
    /// The greatest speed of G50 S.
    pub rpm_max: Option<f64>,
    /// First blocks of G71, G72 and G73.
    pub cut: Cut,
    /// The first block of G76.
    pub(super) thread: ThreadWords,
    /// How far G74 and G75 come back between pecks.
    pub(super) groove_mm: Option<f64>,
    /// Where single cycles lead, in program coordinates, and their taper.
    target: Option<(Point, f64)>,
    /// Whether a lack of a tool's offset has been said.
    offset_missed: bool,
}

/// What first blocks of G71 to G73 say, in mm.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::interp) struct Cut {
    /// From cut to cut: U of G71, W of G72.
    pub depth_mm: f64,
    /// R of both.
    pub escape_mm: f64,
    /// U and W of G73, on Z and X (a radius).
    pub relief_mm: [f64; 2],
    /// R of G73.
    pub passes: u32,
}

impl Executor<'_> {
    pub(in crate::interp) fn is_lathe(&self) -> bool {
        self.dialect.lathe().is_some()
    }

    /// Whether U and W are distances along X and Z.
    fn has_distances(&self) -> bool {
        self.dialect == Dialect::FanucLathe
    }

    /// The axis that a letter moves.
    pub(in crate::interp) fn axis_of(&self, letter: u8) -> Option<Axis> {
        if AXIS_LETTERS & letter_bit(letter) == 0 {
            return None;
        }
        match (letter, self.has_distances()) {
            (b'U', true) => Some(Axis::X),
            (b'V', true) => Some(Axis::Y),
            (b'W', true) => Some(Axis::Z),
            _ => Axis::from_letter(letter),
        }
    }

    /// Whether an axis word is a position, and not a distance.
    pub(in crate::interp) fn is_position(&self, word: &Word) -> bool {
        self.absolute && !(self.has_distances() && matches!(word.letter, b'U' | b'V' | b'W'))
    }

    /// Whether a block has a word for an axis.
    pub(in crate::interp) fn names_axis(&self, block: &Block, axis: Axis) -> bool {
        block.words().iter().any(|word| self.axis_of(word.letter) == Some(axis))
    }

    /// Reports an axis that a position and a distance both move.
    pub(in crate::interp) fn names_twice(&self, block: &Block, faults: &mut Vec<Fault>) -> bool {
        let pairs = [(b'X', b'U'), (b'Y', b'V'), (b'Z', b'W')];
        let mut pairs = pairs.into_iter().filter(|_| self.has_distances());
        let twice = pairs.find(|(to, by)| block.has(*to) && block.has(*by));
        let Some((to, by)) = twice else { return false };
        if let Some(word) = block.word(by) {
            let to = char::from(to);
            let message = format!("{word} and {to} both move the axis {to}");
            let fault = Fault::word(&rules::REPEATED_WORD, word, message);
            faults.push(fault.help(format!("{to} is a position, {} a distance", char::from(by))));
        }
        true
    }

    /// G50, G74 to G76
    pub(in crate::interp) fn run_lathe(
        &mut self,
        code: LatheCode,
        block: &Block,
        asked: &Asked,
        out: &mut Output<'_>,
    ) {
        match code {
            LatheCode::Setting => self.set_lathe(block, out),
            _ if asked.is_faulty => self.forget_position(),
            LatheCode::Thread => self.thread_lathe(block, out),
            LatheCode::Groove(way) => self.groove(way, block, out),
        }
    }

    /// G83 to G94 that stay in force.
    pub(in crate::interp) fn run_single(
        &mut self,
        single: Single,
        block: &Block,
        asked: Asked,
        out: &mut Output<'_>,
    ) {
        match single {
            Single::Hole(hole) => self.drill_lathe(hole, block, asked, out),
            _ => self.cut_once(single, block, asked, out),
        }
    }

    /// G50: S is the greatest speed; axis words say where the tool stands.
    fn set_lathe(&mut self, block: &Block, out: &mut Output<'_>) {
        if let Some(word) = block.word(b'S') {
            self.lathe.rpm_max = Some(word.value);
            if let Some((m_min, _)) = self.surface {
                self.surface = Some((m_min, self.lathe.rpm_max));
            }
        }
        if block.letters() & AXIS_LETTERS != 0 {
            self.set_position(block, out.faults);
        } else if !block.has(b'S') {
            let message = "G50 has neither S nor an axis word";
            out.faults.push(Fault::block(&rules::MISSING_WORD, block, message));
        }
    }

    /// T0101: the turret turns to tool 1, and offset 1 is in force; offset 0 ends it.
    pub(in crate::interp) fn index_turret(&mut self, word: &Word, out: &mut Output<'_>) {
        let Some(number) = crate::interp::words::whole(word, 9999, out.faults) else { return };
        let (tool, offset) = (number / 100, number % 100);
        if tool > 0 && self.tool != Some(tool) {
            self.tool = Some(tool);
            out.event(EventKind::M { code: 6, spindle_rpm: None, tool: self.tool });
        }
        self.loaded = Some(offset);
        let known = self.tools.get(offset).map(|tool| tool.offset_mm);
        if known.is_none() && offset > 0 && !self.lathe.offset_missed {
            self.lathe.offset_missed = true;
            let message =
                format!("{word}: the tool table has no offset {offset}: it is taken as 0");
            let fault = Fault::word(&rules::OFFSET_UNSET, word, message);
            out.faults.push(fault.help("hand in the tools by --tools FILE"));
        }
        self.frames.set_tool(known.unwrap_or(Point::ZERO));
    }

    /// G90, G92 and G94, in system B G77 to G79: words that a block lacks are those of the block before.
    fn cut_once(&mut self, single: Single, block: &Block, asked: Asked, out: &mut Output<'_>) {
        let faults_before = out.faults.len();
        let start = self.frames.program(&self.position_mm);
        let named = self.program_target(block, out.faults);
        let held = self.lathe.target.filter(|_| !asked.is_motion_named);
        let (mut to, taper_mm) = held.unwrap_or((start, 0.0));
        for axis in [Axis::X, Axis::Z] {
            if self.names_axis(block, axis) {
                to[axis] = named[axis];
            }
        }
        // Older programs write I, and K of G94.
        let letter = if single == Single::Face { b'K' } else { b'I' };
        let taper = block.word(b'R').or(block.word(letter));
        let taper_mm = taper.map_or(taper_mm, |word| word.value * self.mm_per_unit);
        self.lathe.target = Some((to, taper_mm));
        let missing = [Axis::X, Axis::Z].into_iter().find(|axis| to[*axis] == start[*axis]);
        if let Some(axis) = missing.filter(|_| !asked.is_faulty) {
            let message = format!("this cycle would not move {axis}: it ends where it begins");
            out.faults.push(Fault::block(&rules::MISSING_WORD, block, message));
        }
        let has_feed = single == Single::Thread || self.has_feed(block, out.faults);
        if asked.is_faulty || !has_feed || out.faults.len() > faults_before {
            return;
        }
        let across = if single == Single::Face { Axis::Z } else { Axis::X };
        let (mut first, mut third) = (start, to);
        first[across] = to[across] + taper_mm;
        third[across] = start[across];
        self.go_lathe(block, &first, MoveKind::Rapid, out);
        if single == Single::Thread {
            let name = if self.dialect == Dialect::FanucLatheB { "G78" } else { "G92" };
            let ends = [self.frames.machine(&first), self.frames.machine(&to)];
            let pitch = self.pitch_by_lead(name, block, &ends[0], &ends[1], out.faults);
            let rpm = self.sync_rpm(name, block, out.faults);
            let (Some(pitch_mm), Some(rpm)) = (pitch, rpm) else { return };
            let to = self.place(&to);
            self.go_synced(block, &to, pitch_mm * rpm, out);
            self.go_lathe(block, &third, MoveKind::Rapid, out);
        } else {
            self.go_lathe(block, &to, MoveKind::Line { feed_mm_min: 0.0 }, out);
            self.go_lathe(block, &third, MoveKind::Line { feed_mm_min: 0.0 }, out);
        }
        self.go_lathe(block, &start, MoveKind::Rapid, out);
    }

    /// Moves to a place in program coordinates, if the machine does not stand there.
    pub(super) fn go_lathe(
        &mut self,
        block: &Block,
        to: &Point,
        kind: MoveKind,
        out: &mut Output<'_>,
    ) {
        let to = self.place(to);
        if to != self.position_mm {
            self.go(block, &to, kind, Some(Corner::Exact), out);
        }
    }
}
