//! The block that most programs consist of: a straight move or an arc, and nothing else.
//!
//! Such a block is told by its letters, and where nothing is to be asked on its way it is made in one
//! go. What comes out is what [`Executor::run`] would make of it; whatever could be wrong is left to
//! that one, which has the words for it.

use crate::base::{Axis, AxisSet, Point};
use crate::gcode::codes::{ARC_LETTERS, AXIS_LETTERS};
use crate::gcode::{Block, Word, letter_bit};

use super::arc::{ArcTask, center_letter, tolerance_mm};
use super::execute::{Asked, Executor, MotionMode, Output};
use super::feed::{Feed, FeedMode, LABEL_MAX, judge_line_number};
use super::motion::{Bound, Motion, Move, MoveKind};

/// What may stand in such a block, of whatever motion.
const MOVE_LETTERS: u32 = AXIS_LETTERS | letter_bit(b'G') | letter_bit(b'N') | letter_bit(b'F');

impl Executor<'_> {
    /// The motion mode of a block of axis words, N and F, with no code but one of G0 to G3, named or
    /// in force, and I J K R for G2 and G3; none for others. There is nothing to sort in such a
    /// block, and no word without a use.
    #[inline]
    fn lone_mode(&self, block: &Block) -> Option<MotionMode> {
        let letters = block.letters();
        if letters & !(MOVE_LETTERS | ARC_LETTERS) != 0 || block.repeats_letter() {
            return None;
        }
        let mode = match block.word(b'G') {
            Some(word) => motion_code(word.value)?,
            None => self.motion,
        };
        let used = match mode {
            MotionMode::Rapid | MotionMode::Line => MOVE_LETTERS,
            MotionMode::Arc { .. } => MOVE_LETTERS | ARC_LETTERS,
            _ => return None,
        };
        let is_within = self.compensation.is_some()
            || self.spline.nurbs.is_some()
            || self.held_move.is_some()
            || self.is_lathe();
        (letters & !used == 0 && !is_within).then_some(mode)
    }

    /// Executes such a block if nothing is to be asked on its way, and gives the axes that it names:
    /// all of them are there and linear, words are shifted and no more, the feed is one a minute, and
    /// nothing is wrong. Otherwise nothing has been done.
    #[inline]
    pub(super) fn run_plain_move(
        &mut self,
        block: &Block,
        out: &mut Output<'_>,
    ) -> Option<AxisSet> {
        let is_plain = self.frames.is_plain()
            && self.open.is_empty()
            && self.feed_mode == FeedMode::PerMinute
            && !self.polar
            && !self.diameters
            && block.call.is_none()
            && out.faults.is_empty();
        let mode = self.lone_mode(block).filter(|_| is_plain)?;
        let n = match block.word(b'N') {
            Some(word) => Some(line_number(word)?),
            None => None,
        };
        let feed = match block.word(b'F') {
            Some(word) if word.value > 0.0 => {
                Some(Feed { mm: word.value * self.mm_per_unit, deg: word.value })
            }
            Some(_) => return None,
            None => self.feed,
        };
        let kind = self.plain_kind(block, mode, feed)?;
        if feed.is_some() {
            (self.feed, self.feed_missed) = (feed, false);
        }
        if block.has(b'G') {
            (self.motion, self.cycle.initial_mm) = (mode, None);
        }
        self.codes.clear();
        Some(self.go_plainly(block, n, kind, out))
    }

    /// The way of such a move.
    #[inline]
    fn plain_kind(&self, block: &Block, mode: MotionMode, feed: Option<Feed>) -> Option<MoveKind> {
        let moved = block.letters() & AXIS_LETTERS;
        if moved & !self.linear_letters != 0 {
            return None;
        }
        let feed_mm_min = || feed.map(|feed| feed.mm * self.feed_scale());
        match mode {
            MotionMode::Arc { ccw } => self.plain_arc(block, ccw, feed_mm_min()?),
            _ if moved == 0 => None,
            MotionMode::Rapid => Some(MoveKind::Rapid),
            _ => Some(MoveKind::Line { feed_mm_min: feed_mm_min()? }),
        }
    }

    /// An arc by its centre about which there is no doubt.
    #[inline]
    fn plain_arc(&self, block: &Block, ccw: bool, feed_mm_min: f64) -> Option<MoveKind> {
        let plane = self.plane;
        let unused = letter_bit(b'R') | letter_bit(center_letter(plane.normal()));
        let letters = block.letters() & ARC_LETTERS;
        if letters == 0 || letters & unused != 0 {
            return None;
        }
        let axes = plane.axes();
        let start_mm = axes.map(|axis| self.position_mm[axis]);
        let end_mm = axes.map(|axis| match block.word(axis.letter() as u8) {
            Some(word) => self.plain_end_mm(axis, word),
            None => self.position_mm[axis],
        });
        let task = self.arc_task(block, ccw, [start_mm, end_mm], self.frames.offset_mm());
        let center_mm = task.sure_center_mm()?;
        Some(MoveKind::Arc { feed_mm_min, plane, center_mm, ccw, turns: 0 })
    }

    /// What an arc's centre is found from: its ends, and where program zero is, in the coordinates in
    /// which it is an arc.
    #[inline]
    pub(super) fn arc_task<'b>(
        &self,
        block: &'b Block,
        ccw: bool,
        [start_mm, end_mm]: [[f64; 2]; 2],
        zero_mm: &Point,
    ) -> ArcTask<'b> {
        let axes = self.plane.axes();
        let zero_mm = axes.map(|axis| zero_mm[axis]);
        ArcTask {
            block,
            plane: self.plane,
            ccw,
            start_mm,
            end_mm,
            mm_per_unit: self.mm_per_unit,
            end_origin_mm: if self.absolute { zero_mm } else { start_mm },
            center_origin_mm: if self.centers_absolute { zero_mm } else { start_mm },
            centers_absolute: self.centers_absolute,
            tolerance_mm: tolerance_mm(self.machine, self.mm_per_unit),
            steps_per_mm: self.machine.axis(axes[0]).map_or(0.0, |profile| profile.steps_per_mm),
        }
    }

    /// Where an axis word leads.
    #[inline]
    fn plain_end_mm(&self, axis: Axis, word: &Word) -> f64 {
        let zero_mm = if self.absolute { self.frames.offset_mm() } else { &self.position_mm };
        zero_mm[axis] + word.value * self.mm_per_unit
    }

    /// Makes such a move, and gives the axes that it names. It is written where it stays: to copy a
    /// position takes longer than to compute it.
    #[inline]
    fn go_plainly(
        &mut self,
        block: &Block,
        n: Option<u32>,
        kind: MoveKind,
        out: &mut Output<'_>,
    ) -> AxisSet {
        out.motions.push(Motion::Move(Move {
            line: out.line,
            n,
            from: self.position_mm,
            to: self.position_mm,
            kind,
            corner: self.corner_here(),
            bound: Bound::Free,
        }));
        let mut named = AxisSet::EMPTY;
        let Some(Motion::Move(step)) = out.motions.last_mut() else { return named };
        for word in block.words_of(AXIS_LETTERS) {
            let Some(axis) = Axis::from_letter(word.letter) else { continue };
            let at_mm = self.plain_end_mm(axis, word);
            (step.to[axis], self.position_mm[axis]) = (at_mm, at_mm);
            named.insert(axis);
        }
        self.axes_used = self.axes_used.union(named);
        named
    }

    /// Executes a block of such words for which something is to be asked, and tells whether it is
    /// one: only what is left of [`Executor::run`] is done.
    pub(super) fn run_lone_move(&mut self, block: &Block, out: &mut Output<'_>) -> bool {
        let Some(mode) = self.lone_mode(block).filter(|_| out.faults.is_empty()) else {
            return false;
        };
        let mut asked = Asked {
            motion_before: self.motion,
            mm_per_unit_before: self.mm_per_unit,
            is_motion_named: block.has(b'G'),
            ..Asked::default()
        };
        self.codes.clear();
        if let Some(word) = block.word(b'F') {
            self.set_feed(word, out.faults);
        }
        if let Some(word) = block.word(b'N') {
            judge_line_number(word, out.faults);
        }
        if asked.is_motion_named {
            (self.motion, self.cycle.initial_mm) = (mode, None);
        }
        self.run_motion(block, &mut asked, out);
        true
    }
}

/// The number of an N word, if it is one.
#[inline]
fn line_number(word: &Word) -> Option<u32> {
    let number = word.value as u32;
    (f64::from(number) == word.value && number <= LABEL_MAX).then_some(number)
}

/// G0 to G3.
#[inline]
fn motion_code(value: f64) -> Option<MotionMode> {
    const MODES: [MotionMode; 4] = [
        MotionMode::Rapid,
        MotionMode::Line,
        MotionMode::Arc { ccw: false },
        MotionMode::Arc { ccw: true },
    ];
    let number = value as u8;
    MODES.get(usize::from(number)).copied().filter(|_| f64::from(number) == value)
}
