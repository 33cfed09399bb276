//! F, S and T: the feed, the spindle and the tool that blocks name, and the speed of a move.
//!
//! A move always carries mm (of rotary axes alone: degrees) a minute. G95 takes the spindle's speed
//! as it was commanded, of G96 that at the greater diameter of the move; G93 divides the length of the move by its time.
//! The operator's override scales it, except under M49 and where the feed follows the spindle
//! (threads, taps).

use crate::base::{Axis, EventKind, Point};
use crate::gcode::codes::{FREE_LETTERS, LatheCode, Op};
use crate::gcode::{Block, Fault, Word, letter_bit, rules};

use super::duration::length;
use super::execute::{Asked, Executor, Output};
use super::motion::{Move, MoveKind};
use super::words::whole;

/// Millimetres an inch.
const MM_PER_INCH: f64 = 25.4;

/// Turns a minute that no spindle exceeds, where nothing else bounds them: at the centre.
const TURNS_MOST: f64 = 1e6;

/// Greatest number of an N or O word.
pub(super) const LABEL_MAX: u32 = 999_999_999;

/// Reports an N word that numbers no line. As RS274/NGC has it, N10.5 is a line 10.
#[inline]
pub(super) fn judge_line_number(word: &Word, faults: &mut Vec<Fault>) {
    whole(&Word { value: word.value.floor(), ..*word }, LABEL_MAX, faults);
}

/// What F means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FeedMode {
    /// G94
    PerMinute,
    /// G95
    PerTurn,
    /// G93: one over the minutes of the move.
    InverseTime,
}

/// The feed in force. Inches are resolved for lengths; degrees have no other unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Feed {
    pub mm: f64,
    pub deg: f64,
}

/// What the spindle has been told to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Turning {
    Stopped,
    Clockwise,
    CounterClockwise,
}

impl Executor<'_> {
    /// Takes feed mode, F, S, T and units.
    pub(super) fn set_words(&mut self, block: &Block, asked: Asked, out: &mut Output<'_>) {
        for (_, op) in &self.codes {
            let mode = match op {
                Op::FeedPerMinute => FeedMode::PerMinute,
                Op::FeedPerTurn => FeedMode::PerTurn,
                Op::InverseTimeFeed => FeedMode::InverseTime,
                _ => continue,
            };
            if mode != self.feed_mode {
                // The number that stood for the feed means something else now.
                (self.feed_mode, self.feed, self.feed_missed) = (mode, None, false);
            }
        }
        if block.letters() & FREE_LETTERS & !letter_bit(b'G') != 0 {
            self.set_free_words(block, asked, out);
        }
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
        if let Some(word) = block.word(b'F') {
            self.set_feed(word, out.faults);
        }
        // S beside G50 of a lathe is a bound.
        if let Some(word) = block.word(b'S').filter(|_| !self.asks(Op::Lathe(LatheCode::Setting))) {
            self.set_speed(block, word, out);
        }
        if let Some(word) = block.word(b'T').filter(|_| self.is_lathe()) {
            self.index_turret(word, out);
        } else if let Some(word) = block.word(b'T') {
            self.tool = whole(word, 99_999, out.faults).or(self.tool);
            if let Some(tool) = self.tool.filter(|_| !self.asks(Op::ToolChange)) {
                out.event(EventKind::T(tool));
            }
        }
        if let Some(word) = block.word(b'$').filter(|word| ![0.0, -1.0].contains(&word.value)) {
            let message = format!("{word}: the machine has one spindle, $0");
            out.faults.push(Fault::word(&rules::BAD_VALUE, word, message));
        }
        if let Some(word) = block.word(b'N').filter(|_| !asked.is_faulty) {
            judge_line_number(word, out.faults);
        }
        if let Some(word) = block.word(b'O').filter(|_| !asked.is_faulty) {
            whole(word, LABEL_MAX, out.faults);
        }
    }

    fn asks(&self, op: Op) -> bool {
        self.codes.iter().any(|(_, other)| *other == op)
    }

    #[inline]
    pub(super) fn set_feed(&mut self, word: &Word, faults: &mut Vec<Fault>) {
        self.feed_missed = false;
        let is_length = self.feed_mode != FeedMode::InverseTime;
        let scale = if is_length { self.mm_per_unit } else { 1.0 };
        let feed = Feed { mm: word.value * scale, deg: word.value };
        self.feed = Some(feed).filter(|feed| feed.deg > 0.0);
        if word.value < 0.0 {
            self.feed_missed = true;
            faults.push(Fault::word(&rules::BAD_VALUE, word, "a feed cannot be negative"));
        }
        if is_length && self.units_after() != self.mm_per_unit {
            let (unit, other) =
                if self.mm_per_unit == 1.0 { ("mm", "inches") } else { ("inches", "mm") };
            let per = if self.feed_mode == FeedMode::PerTurn { "turn" } else { "minute" };
            let message = format!(
                "{word} is taken in {unit} a {per}, the units before this block; other controls \
                 take it in {other}"
            );
            let fault = Fault::word(&rules::FEED_UNITS, word, message);
            faults.push(fault.help("change the units in a block before"));
        }
    }

    fn set_speed(&mut self, block: &Block, word: &Word, out: &mut Output<'_>) {
        if word.value < 0.0 {
            let message = "a spindle speed cannot be negative";
            let fault = Fault::word(&rules::BAD_VALUE, word, message);
            out.faults.push(fault.help("M4 turns the spindle counter-clockwise"));
            return;
        }
        let by_surface = self.asks(Op::SurfaceSpeed)
            || (self.by_surface && !self.asks(Op::SpindleSpeedConstant));
        if by_surface {
            self.set_surface_speed(block, word, out);
            return;
        }
        self.spindle_rpm = Some(word.value);
        self.judge_speed(word, out.faults);
        if !self.asks(Op::SpindleClockwise) && !self.asks(Op::SpindleCounterClockwise) {
            out.event(EventKind::S(word.value));
        }
    }

    /// S of G96: metres a minute in G21, feet a minute in G20; D is the greatest speed.
    fn set_surface_speed(&mut self, block: &Block, word: &Word, out: &mut Output<'_>) {
        const METRES_PER_FOOT: f64 = 0.3048;
        let is_metric = self.units_after() == 1.0;
        let rpm_max = block.word(b'D').map(|word| word.value);
        if let Some(word) = block.word(b'D') {
            if word.value <= 0.0 {
                out.faults.push(Fault::word(&rules::BAD_VALUE, word, "D is a speed above 0"));
                return;
            }
            self.judge_speed(word, out.faults);
        }
        self.spindle_rpm = None;
        let rpm_max = rpm_max.or(self.lathe.rpm_max);
        let m_min = if is_metric { word.value } else { word.value * METRES_PER_FOOT };
        self.surface = Some((m_min, rpm_max));
        out.event(EventKind::SurfaceSpeed { m_min, rpm_max });
    }

    fn judge_speed(&self, word: &Word, faults: &mut Vec<Fault>) {
        let greatest = self.machine.spindle.map(|spindle| f64::from(spindle.speed_max_rpm));
        if let Some(greatest) = greatest.filter(|greatest| word.value > *greatest) {
            let message = format!("{word}: the machine's spindle turns at {greatest} rpm at most");
            faults.push(Fault::word(&rules::SPINDLE_SPEED, word, message));
        }
    }

    /// G96 and G97, after S.
    pub(super) fn set_spindle_mode(
        &mut self,
        by_surface: bool,
        block: &Block,
        faults: &mut Vec<Fault>,
    ) {
        let changes = by_surface != self.by_surface;
        self.by_surface = by_surface;
        if (by_surface || changes) && !block.has(b'S') {
            let (name, unit) = if by_surface {
                ("G96", "metres (G21) or feet (G20) a minute")
            } else {
                ("G97 after G96", "turns a minute")
            };
            let message = format!("{name} has no S, the speed in {unit}");
            faults.push(Fault::block(&rules::MISSING_WORD, block, message));
        }
    }

    /// Whether there is a feed. The first movement that lacks one is reported, until there is one.
    pub(super) fn has_feed(&mut self, block: &Block, faults: &mut Vec<Fault>) -> bool {
        let of_block = self.feed_mode != FeedMode::InverseTime || block.has(b'F');
        if self.feed.is_some() && of_block {
            if self.feed_mode == FeedMode::PerTurn && !self.knows_turns() {
                self.miss_speed(block, faults);
                return false;
            }
            return true;
        }
        if !self.feed_missed {
            self.feed_missed = true;
            let fault = if of_block {
                let message = "this movement needs a feed above zero, and none is in force";
                Fault::block(&rules::NO_FEED, block, message)
                    .help("write F and the feed in mm (G21) or inches (G20) a minute")
            } else {
                let message = "under G93 every movement needs an F of its own";
                Fault::block(&rules::NO_FEED, block, message)
                    .help("write F, one over the minutes that it takes; or G94 and a feed a minute")
            };
            faults.push(fault);
        }
        false
    }

    /// Turns of the spindle a minute, where they are known.
    pub(super) fn turns_min(&self) -> Option<f64> {
        self.spindle_rpm.filter(|rpm| *rpm > 0.0 && !self.by_surface)
    }

    /// Whether the spindle's speed is known, or follows from the diameter.
    fn knows_turns(&self) -> bool {
        self.turns_min().is_some() || (self.by_surface && self.surface.is_some())
    }

    /// Turns of the spindle a minute during a move. Under G96 those at the greater of the diameters
    /// at its ends, the slower ones: a feed a turn is then nowhere exceeded.
    fn turns_of(&self, from: &Point, to: &Point) -> f64 {
        let Some((m_min, rpm_max)) = self.surface.filter(|_| self.by_surface) else {
            return self.turns_min().unwrap_or_default();
        };
        let radii = [from, to].map(|point| self.frames.program(point)[Axis::X].abs());
        let around_mm = std::f64::consts::TAU * radii[0].max(radii[1]);
        let greatest = self.machine.spindle.map(|spindle| f64::from(spindle.speed_max_rpm));
        let bounds = [rpm_max, greatest, Some(TURNS_MOST)];
        let most = bounds.into_iter().flatten().fold(f64::INFINITY, f64::min);
        (m_min * 1000.0 / around_mm).min(most)
    }

    fn miss_speed(&mut self, block: &Block, faults: &mut Vec<Fault>) {
        if self.feed_missed {
            return;
        }
        self.feed_missed = true;
        let message = "a feed a turn needs the spindle's speed, and none has been given";
        let fault = Fault::block(&rules::NO_SPINDLE_SPEED, block, message);
        faults.push(fault.help("write G97 and S in turns a minute, or a feed a minute"));
    }

    /// What the operator makes of a feed here, as its multiple.
    pub(super) fn feed_scale(&self) -> f64 {
        if self.overrides.feed { self.feed_override } else { 1.0 }
    }

    /// Gives a move its speed; the feed is known.
    pub(super) fn apply_feed(&self, step: &mut Move, turns_only: bool) {
        let Some(feed) = self.feed else { return };
        // Measured only where it is asked for: this runs for every move.
        let way = if self.feed_mode == FeedMode::InverseTime { length(step) } else { 0.0 };
        if let MoveKind::Line { feed_mm_min }
        | MoveKind::Arc { feed_mm_min, .. }
        | MoveKind::Spline { feed_mm_min, .. } = &mut step.kind
        {
            let value = if turns_only { feed.deg } else { feed.mm };
            let asked_mm_min = match self.feed_mode {
                FeedMode::PerMinute => value,
                FeedMode::PerTurn => value * self.turns_of(&step.from, &step.to),
                FeedMode::InverseTime => value * way,
            };
            *feed_mm_min = asked_mm_min * self.feed_scale();
        }
    }
}
