//! FANUC-style lathes (G code system A): U W V H as distances, G50, T with its offset, and the
//! cycles that cut once: G90, G92, G94, and the threading cycle G76 of two blocks.
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
use crate::gcode::codes::{AXIS_LETTERS, Op, Single};
use crate::gcode::{Block, Fault, Word, letter_bit, rules};

use crate::interp::Dialect;
use crate::interp::cycles::PASSES_MAX;
use crate::interp::execute::{Asked, Executor, Output};
use crate::interp::motion::{Corner, MoveKind};

/// What a lathe's program has set.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::interp) struct Lathe {
    /// The greatest speed of G50 S.
    pub rpm_max: Option<f64>,
    /// First blocks of G71, G72 and G73.
    pub cut: Cut,
    /// The first block of G76.
    thread: ThreadWords,
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

/// What the first block of G76 says.
#[derive(Clone, Copy, Debug, Default)]
struct ThreadWords {
    finish_passes: u32,
    /// In tenths of the lead.
    pull_out: u32,
    angle_deg: f64,
    least_mm: f64,
    finish_mm: f64,
}

impl ThreadWords {
    fn pull_out_mm(&self, lead_mm: f64) -> f64 {
        f64::from(self.pull_out) / 10.0 * lead_mm
    }
}

impl Executor<'_> {
    pub(in crate::interp) fn is_lathe(&self) -> bool {
        self.dialect == Dialect::FanucLathe
    }

    /// The axis that a letter moves.
    pub(in crate::interp) fn axis_of(&self, letter: u8) -> Option<Axis> {
        if AXIS_LETTERS & letter_bit(letter) == 0 {
            return None;
        }
        match (letter, self.is_lathe()) {
            (b'U', true) => Some(Axis::X),
            (b'V', true) => Some(Axis::Y),
            (b'W', true) => Some(Axis::Z),
            _ => Axis::from_letter(letter),
        }
    }

    /// Whether an axis word is a position, and not a distance.
    pub(in crate::interp) fn is_position(&self, word: &Word) -> bool {
        self.absolute && !(self.is_lathe() && matches!(word.letter, b'U' | b'V' | b'W'))
    }

    /// Whether a block has a word for an axis.
    pub(in crate::interp) fn names_axis(&self, block: &Block, axis: Axis) -> bool {
        block.words().iter().any(|word| self.axis_of(word.letter) == Some(axis))
    }

    /// Reports an axis that a position and a distance both move.
    pub(in crate::interp) fn names_twice(&self, block: &Block, faults: &mut Vec<Fault>) -> bool {
        let pairs = [(b'X', b'U'), (b'Y', b'V'), (b'Z', b'W')];
        let twice = pairs.into_iter().find(|(to, by)| block.has(*to) && block.has(*by));
        let Some((to, by)) = twice else { return false };
        if let Some(word) = block.word(by) {
            let to = char::from(to);
            let message = format!("{word} and {to} both move the axis {to}");
            let fault = Fault::word(&rules::REPEATED_WORD, word, message);
            faults.push(fault.help(format!("{to} is a position, {} a distance", char::from(by))));
        }
        true
    }

    /// G50 and G76
    pub(in crate::interp) fn run_lathe(
        &mut self,
        op: Op,
        block: &Block,
        asked: &Asked,
        out: &mut Output<'_>,
    ) {
        match op {
            Op::ThreadCycle if asked.is_faulty => self.forget_position(),
            Op::ThreadCycle => self.two_block_thread(block, out),
            _ => self.set_lathe(block, out),
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

    /// G90, G92 and G94: words that a block lacks are those of the block before.
    pub(in crate::interp) fn cut_once(
        &mut self,
        single: Single,
        block: &Block,
        asked: Asked,
        out: &mut Output<'_>,
    ) {
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
        let taper_mm = block.word(b'R').map_or(taper_mm, |word| word.value * self.mm_per_unit);
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
            let name = "G92";
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

    /// A length of P or Q of G76: without a fraction in thousandths of a mm (ten-thousandths of an
    /// inch), as controls count it.
    fn small_length_mm(&self, word: &Word) -> f64 {
        let unit = match (word.value.fract() == 0.0, self.mm_per_unit == 1.0) {
            (false, _) => 1.0,
            (true, true) => 1e-3,
            (true, false) => 1e-4,
        };
        word.value * unit * self.mm_per_unit
    }

    /// G76: the first block says how threads are cut, the second cuts one.
    fn two_block_thread(&mut self, block: &Block, out: &mut Output<'_>) {
        if block.letters() & AXIS_LETTERS == 0 {
            self.take_thread_words(block, out.faults);
            return;
        }
        let faults_before = out.faults.len();
        let start = self.frames.program(&self.position_mm);
        let end = self.program_target(block, out.faults);
        let words = [b'P', b'Q'].map(|letter| block.word(letter));
        let [Some(height), Some(first)] = words else {
            let message = "G76 has no P, the thread's height, or no Q, the first depth";
            out.faults.push(Fault::block(&rules::MISSING_WORD, block, message));
            return;
        };
        let [height_mm, first_mm] = [height, first].map(|word| self.small_length_mm(word));
        let along_mm = end[Axis::Z] - start[Axis::Z];
        if along_mm == 0.0 {
            let message = "this thread has no length along Z";
            let fault = Fault::block(&rules::MISSING_WORD, block, message);
            out.faults.push(fault.help("write Z or W, where it ends"));
            return;
        }
        let depths = [(height, height_mm), (first, first_mm)];
        self.check_thread_words(block, depths, along_mm.abs(), out.faults);
        let taper_mm = block.word(b'R').map_or(0.0, |word| word.value * self.mm_per_unit);
        let mut begin = start;
        begin[Axis::X] = end[Axis::X] + taper_mm;
        let machine = [self.frames.machine(&begin), self.frames.machine(&end)];
        let pitch = self.pitch_by_lead("G76", block, &machine[0], &machine[1], out.faults);
        let rpm = self.sync_rpm("G76", block, out.faults);
        if out.faults.len() > faults_before {
            return;
        }
        let (Some(pitch_mm), Some(rpm)) = (pitch, rpm) else { return };
        let mut depths = self.depths(height_mm, first_mm);
        let feed_mm_min = pitch_mm * rpm;
        if depths.len() as f64 > PASSES_MAX {
            depths.clear();
            let message = format!("more than {PASSES_MAX} passes: is Q the first depth?");
            out.faults.push(Fault::word(&rules::BAD_VALUE, first, message));
        }
        let words = self.lathe.thread;
        let out_mm = words.pull_out_mm(self.feed.map_or(0.0, |feed| feed.mm));
        let inwards = (end[Axis::X] - start[Axis::X]).signum();
        let along = along_mm.signum();
        for depth_mm in depths {
            let above_mm = inwards * (height_mm - depth_mm);
            let shift_mm = along * depth_mm * (words.angle_deg / 2.0).to_radians().tan();
            let mut at = start;
            at[Axis::Z] += shift_mm;
            self.go_lathe(block, &at, MoveKind::Rapid, out);
            at[Axis::X] = begin[Axis::X] - above_mm;
            self.go_lathe(block, &at, MoveKind::Rapid, out);
            let mut root = end;
            root[Axis::X] -= above_mm;
            let mut to = root;
            to[Axis::Z] -= along * out_mm;
            let placed = self.place(&to);
            self.go_synced(block, &placed, feed_mm_min, out);
            if out_mm > 0.0 {
                root[Axis::X] -= inwards * out_mm;
                let placed = self.place(&root);
                self.go_synced(block, &placed, feed_mm_min * std::f64::consts::SQRT_2, out);
            }
            root[Axis::X] = start[Axis::X];
            self.go_lathe(block, &root, MoveKind::Rapid, out);
        }
        self.go_lathe(block, &start, MoveKind::Rapid, out);
    }

    /// Holds the depths of a thread, its height and that of the first pass, and what the first
    /// block has said against its length.
    fn check_thread_words(
        &self,
        block: &Block,
        depths: [(&Word, f64); 2],
        length_mm: f64,
        faults: &mut Vec<Fault>,
    ) {
        for (word, _) in depths.into_iter().filter(|(_, depth_mm)| *depth_mm <= 0.0) {
            let message = format!("{word}: in G76 P and Q are above 0");
            faults.push(Fault::word(&rules::BAD_VALUE, word, message));
        }
        let words = &self.lathe.thread;
        let [(height, height_mm), _] = depths;
        if height_mm > 0.0 && words.finish_mm >= height_mm {
            let message = format!(
                "the finishing cut, R{:.4} mm of the first block, is not less than the height, \
                 {height_mm:.4} mm: the first pass would be as deep as the thread",
                words.finish_mm
            );
            faults.push(Fault::word(&rules::BAD_VALUE, height, message));
        }
        let out_mm = words.pull_out_mm(self.feed.map_or(0.0, |feed| feed.mm));
        if out_mm >= length_mm {
            let message = format!(
                "the pull-out, {out_mm:.4} mm, is not shorter than the thread, {length_mm:.4} mm",
            );
            let fault = Fault::block(&rules::BAD_VALUE, block, message);
            faults.push(fault.help(
                "it is the middle two digits of P in the first block, in tenths of the lead",
            ));
        }
    }

    fn take_thread_words(&mut self, block: &Block, faults: &mut Vec<Fault>) {
        let digits = match block.word(b'P') {
            Some(word) => crate::interp::words::whole(word, 999_999, faults).unwrap_or(0),
            None => 10_000,
        };
        self.lathe.thread = ThreadWords {
            finish_passes: digits / 10_000,
            pull_out: digits / 100 % 100,
            angle_deg: f64::from(digits % 100),
            least_mm: block.word(b'Q').map_or(0.0, |word| self.small_length_mm(word)),
            finish_mm: block.word(b'R').map_or(0.0, |word| word.value.abs() * self.mm_per_unit),
        };
    }

    /// Depths of the passes: each takes the same area, none less than the least, and what is left
    /// for finishing comes last.
    fn depths(&self, height_mm: f64, first_mm: f64) -> Vec<f64> {
        let words = &self.lathe.thread;
        let rough_mm = height_mm - words.finish_mm;
        let (mut depths, mut depth_mm) = (Vec::new(), 0.0_f64);
        for pass in 1..=PASSES_MAX as u32 + 1 {
            if depth_mm >= rough_mm {
                break;
            }
            let next_mm = first_mm * f64::from(pass).sqrt();
            depth_mm = next_mm.max(depth_mm + words.least_mm).min(rough_mm);
            depths.push(depth_mm);
        }
        let again =
            if words.finish_mm > 0.0 { words.finish_passes.max(1) } else { words.finish_passes };
        depths.extend((0..again).map(|_| height_mm));
        depths
    }
}
