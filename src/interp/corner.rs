//! Drawing dimensions: `,C` and `,R` take the corner at the end of a move away, `,A` is the angle of a
//! line that leaves one of its coordinates, or both, to be worked out.
//!
//! ```text
//!   G1 X50 ,R5      a fillet between this move and the next
//!   G1 X50 ,A30     Y is what lies at X50 on a line of 30 degrees
//!   G1 ,A30         up to where it meets the line of the next block, as X80 Y60 ,A75
//! ```
//!
//! A move with such a corner is held until the next one is known; nothing but a block without words
//! may stand between. Positions of the program, and what I J K are measured from, stay the corner
//! itself. On lathes R, C and A stand without the comma too (C where the machine has no such axis), and
//! I and K are chamfers whose sign says where the next move goes, on X and Z. A fillet or chamfer is
//! cut at the lower one of the feeds beside it.

use crate::base::{Axis, Point};
use crate::gcode::codes::{ARC_LETTERS, AXIS_LETTERS, CORNER_LETTERS, Group};
use crate::gcode::{Block, COMMA_A, COMMA_C, COMMA_R, Fault, Word, letter_bit, letter_set, rules};

use super::execute::{Asked, Executor, MotionMode, Output, is_error, motion_of};
use super::feed::Feed;
use super::fillet::{Finish, Leg, Place, finish};
use super::frames::sin_cos_deg;
use super::motion::{Bound, Motion, Move, MoveKind};

/// Lines that differ by less than a degree have no corner to be worked out, as on FANUC.
const ANGLE_LEAST_DEG: f64 = 1.0;

/// Letters of chamfers on lathes, beside those with a comma.
const CHAMFER_LETTERS: u32 = letter_set("IK");

/// A move that waits for the next one.
#[derive(Clone, Debug)]
pub(super) struct Pending {
    step: Move,
    /// The feed in force for it.
    feed: Option<Feed>,
    /// Its angle, where its end is not known yet.
    angle_deg: Option<f64>,
    finish: Option<(Finish, Option<Toward>)>,
    /// The move before a line whose end is not known yet, with the corner between them.
    before: Option<Box<Pending>>,
    /// The word that makes it wait.
    word: Word,
}

/// Where the next move has to go: an axis, and whether up.
pub(super) type Toward = (Axis, bool);

/// What a block with an angle, or behind an open line, comes to.
enum Resolved {
    /// Axis words in the place of the angle.
    Words(Box<Block>),
    /// A line whose end the next block tells.
    Open,
    Wrong,
}

impl Executor<'_> {
    /// Words of lathes without a comma as those with one, beside G1.
    pub(super) fn with_commas(&self, block: &Block) -> Option<Block> {
        let is_other = |word: &Word| {
            word.letter == b'G'
                && self.code_of(word).is_some_and(|code| code.group == Group::NonModal)
        };
        let is_line =
            self.mode_of(block) == MotionMode::Line && !block.words().iter().any(is_other);
        if is_line { renamed(block, self.axes.contains(Axis::C)) } else { None }
    }

    /// The motion mode of a block: of its own code, or the one in force.
    fn mode_of(&self, block: &Block) -> MotionMode {
        let codes = block.words().iter().filter(|word| word.letter == b'G');
        let named = codes.filter_map(|word| self.code_of(word)?.op);
        let mut modes = named.filter_map(motion_of);
        modes.next().unwrap_or(self.motion)
    }

    /// Letters that say what becomes of a corner, or at which angle a line goes.
    pub(super) fn corner_letters(&self) -> u32 {
        if self.is_lathe() { CORNER_LETTERS | CHAMFER_LETTERS } else { CORNER_LETTERS }
    }

    /// Whether a block has such letters. I and K of lathes are of other codes too.
    pub(super) fn is_dimensioned(&self, block: &Block, asked: &Asked) -> bool {
        let takes_all = self.motion == MotionMode::Line && !asked.axes_claimed;
        let letters = if takes_all { self.corner_letters() } else { CORNER_LETTERS };
        block.letters() & letters != 0
    }

    /// Reports what stands between a move and the next one, which its corner needs.
    pub(super) fn breaks_corner(&mut self, block: &Block, asked: Asked) -> bool {
        if self.held_move.is_none() {
            return false;
        }
        if asked.is_faulty {
            self.held_move = None;
            return false;
        }
        let is_misplaced =
            |group: Group| !matches!(group, Group::Motion | Group::FeedMode | Group::Distance);
        let code = self.codes.iter().find(|(code, _)| is_misplaced(code.group));
        let name = code.map(|(code, _)| code.name());
        let word = block.first_of(letter_set("ST")).map(Word::to_string);
        let Some(name) = name.or(word) else { return false };
        let line = self.line;
        self.refuse_corner(format!("{name} on line {line} stands before the next move"));
        true
    }

    /// The line of the move that waits.
    pub(super) fn corner_line(&self) -> Option<u32> {
        self.held_move.as_ref().map(|pending| pending.step.line)
    }

    /// Reports a corner that the program ends with.
    pub(super) fn end_corner(&mut self) {
        self.refuse_corner("no straight move and no arc follows".to_owned());
    }

    /// Gives up the move that waits; what is wrong is marked at its word.
    fn refuse_corner(&mut self, message: String) {
        let Some(pending) = self.held_move.take() else { return };
        let message = format!("{}: {message}", pending.word);
        let fault = Fault::word(&rules::CORNER, &pending.word, message);
        let help = if pending.angle_deg.is_some() {
            "write the end of the second line and its angle behind it, as X80 Y60 ,A75"
        } else {
            "it needs G1, G2 or G3 in this block and the next, each longer than what the corner takes"
        };
        self.corner_faults.push(fault.help(help));
    }

    /// Moves by a block that has such words, or that a move waits for.
    pub(super) fn run_dimensioned(&mut self, block: &Block, asked: &Asked, out: &mut Output<'_>) {
        let angle = block.word(COMMA_A);
        let is_open = self.held_move.as_ref().is_some_and(|pending| pending.angle_deg.is_some());
        // A full circle needs no word of an axis.
        let is_arc = matches!(self.motion, MotionMode::Arc { .. });
        let words = if is_arc { AXIS_LETTERS | ARC_LETTERS } else { AXIS_LETTERS };
        let asks = block.letters() & words != 0 || angle.is_some();
        let asks = asks && !asked.axes_claimed;
        let made = out.motions.len();
        if asked.is_faulty || !asks {
            let word = block.first_of(CORNER_LETTERS).filter(|_| !asked.is_faulty);
            out.faults.extend(word.map(lone));
            self.run_axis_words(block, asked, out);
            if out.motions.len() > made {
                self.refuse_corner(format!("line {} makes no straight move and no arc", out.line));
            }
            return;
        }
        let resolved = match angle.copied() {
            Some(angle) => match self.resolve_angle(&angle, block, out) {
                Resolved::Words(resolved) => Some(resolved),
                Resolved::Open => return,
                Resolved::Wrong => {
                    self.held_move = None;
                    return self.forget_position();
                }
            },
            None if is_open => {
                self.refuse_corner("the next line has no angle".to_owned());
                return self.forget_position();
            }
            None => None,
        };
        let block = resolved.as_deref().unwrap_or(block);
        // The move before an open line has been given out.
        let made = out.motions.len();
        self.run_axis_words(block, asked, out);
        if out.faults.iter().any(is_error) {
            self.held_move = None;
            return;
        }
        if self.held_move.is_some() {
            self.join_corner(made, out);
        }
        self.hold_corner(block, made, out);
    }

    /// Makes axis words of an angle.
    fn resolve_angle(&mut self, angle: &Word, block: &Block, out: &mut Output<'_>) -> Resolved {
        let axes = self.plane.axes();
        let mut wrong = |message: &str| {
            let fault = Fault::word(&rules::CORNER, angle, format!("{angle}: {message}"));
            let help = "write one coordinate of the line's end and its angle; or the angle alone, \
                        and in the next block the end of a second line and its angle";
            out.faults.push(fault.help(help));
            Resolved::Wrong
        };
        if self.motion != MotionMode::Line || self.polar {
            return wrong("an angle goes with G1, and not with polar coordinates (G16)");
        }
        let (sin, cos) = sin_cos_deg(angle.value);
        let from = self.frames.program(&self.position_mm);
        let named = axes.map(|axis| self.names_axis(block, axis));
        let is_open = self.held_move.as_ref().is_some_and(|pending| pending.angle_deg.is_some());
        match (is_open, named) {
            (false, [false, false]) => self.open_line(angle, block, out),
            (true, [true, true]) => {
                let of_plane = |word: &&Word| {
                    self.axis_of(word.letter).is_some_and(|axis| axes.contains(&axis))
                };
                let mut words = block.words().iter().filter(of_plane);
                if words.any(|word| !self.is_position(word)) {
                    return wrong("the end of the second line is a position, and no distance");
                }
                let to = self.program_target(block, out.faults);
                if self.meet_line(angle, &to, axes, out) {
                    Resolved::Words(without_angle(block, None))
                } else {
                    Resolved::Wrong
                }
            }
            (false, [true, false] | [false, true]) => {
                let known = usize::from(named[1]);
                let along = [cos, sin];
                let (least, _) = sin_cos_deg(ANGLE_LEAST_DEG);
                if along[known].abs() < least {
                    let (axis, other) = (axes[known], axes[1 - known]);
                    return wrong(&format!(
                        "this line goes along {other}: {axis} does not tell where it ends"
                    ));
                }
                let to = self.program_target(block, out.faults);
                let [a, b] = [axes[known], axes[1 - known]];
                let at_mm = from[b] + (to[a] - from[a]) * along[1 - known] / along[known];
                let by_mm = if self.absolute { at_mm } else { at_mm - from[b] };
                let share = if self.diameters && b == Axis::X { 2.0 } else { 1.0 };
                let value = by_mm / self.mm_per_unit * share;
                let word = Word { letter: b.letter() as u8, value, ..*angle };
                Resolved::Words(without_angle(block, Some(word)))
            }
            (true, _) => wrong("the second line needs both coordinates of its end"),
            (false, [true, true]) => wrong("both coordinates of the line's end are given already"),
        }
    }

    /// Begins a line whose end the next block tells.
    fn open_line(&mut self, angle: &Word, block: &Block, out: &mut Output<'_>) -> Resolved {
        if let Some(word) = block.first_of(AXIS_LETTERS) {
            let message = format!("{word} lies across the plane of the angle {angle}");
            out.faults.push(Fault::word(&rules::CORNER, word, message));
            return Resolved::Wrong;
        }
        if self.held_move.as_ref().is_some_and(|pending| pending.angle_deg.is_some()) {
            self.refuse_corner("the end of the next line is not known either".to_owned());
            return Resolved::Wrong;
        }
        let faults_before = out.faults.len();
        let finish = self.finish_of(block, out.faults).map(|(finish, toward, _)| (finish, toward));
        if !self.has_feed(block, out.faults) || out.faults.len() > faults_before {
            return Resolved::Wrong;
        }
        let to = self.position_mm;
        let step = self.step(block, &to, MoveKind::Line { feed_mm_min: 0.0 }, out.line);
        let (feed, angle_deg, word) = (self.feed, Some(angle.value), *angle);
        let before = self.held_move.take();
        self.held_move = Some(Box::new(Pending { step, feed, angle_deg, finish, before, word }));
        Resolved::Open
    }

    /// Ends the line that waits where it meets the one to a point, in that direction.
    fn meet_line(
        &mut self,
        angle: &Word,
        to: &Point,
        axes: [Axis; 2],
        out: &mut Output<'_>,
    ) -> bool {
        let Some(mut pending) = self.held_move.take() else { return false };
        let (second_sin, second_cos) = sin_cos_deg(angle.value);
        let along = [second_cos, second_sin];
        let (sin, cos) = sin_cos_deg(pending.angle_deg.take().unwrap_or_default());
        let mut corner = self.frames.program(&pending.step.from);
        let across = cos * along[1] - sin * along[0];
        if across.abs() < sin_cos_deg(ANGLE_LEAST_DEG).0 {
            self.held_move = Some(pending);
            self.refuse_corner("the two lines have the same direction".to_owned());
            return false;
        }
        let by = axes.map(|axis| to[axis] - corner[axis]);
        let length = (by[0] * along[1] - by[1] * along[0]) / across;
        corner[axes[0]] += cos * length;
        corner[axes[1]] += sin * length;
        self.position_mm = self.frames.machine(&corner);
        pending.step.to = self.position_mm;
        let feed = std::mem::replace(&mut self.feed, pending.feed);
        self.apply_feed(&mut pending.step, false);
        self.feed = feed;
        let Some(mut before) = pending.before.take() else {
            self.held_move = Some(pending);
            return true;
        };
        let Some((size, toward)) = before.finish else { return false };
        match self.corner_between(&mut before.step, &mut pending.step, size, toward) {
            Ok(corner) => {
                give_out([Some(before.step), corner, None], out);
                self.held_move = Some(pending);
                true
            }
            Err(message) => {
                let message = format!("{} of line {}: {message}", before.word, before.step.line);
                out.faults.push(Fault::word(&rules::CORNER, angle, message));
                false
            }
        }
    }

    /// What becomes of the corner at a block's end.
    fn finish_of(
        &self,
        block: &Block,
        faults: &mut Vec<Fault>,
    ) -> Option<(Finish, Option<Toward>, Word)> {
        let is_arc = matches!(self.motion, MotionMode::Arc { .. });
        let takes_signs = self.is_lathe() && !is_arc;
        let (finish, toward, word) = corner_of(block, takes_signs, faults)?;
        let mm = self.mm_per_unit;
        let finish = match finish {
            Finish::Fillet(radius) => Finish::Fillet(radius * mm),
            Finish::Chamfer(size) => Finish::Chamfer(size * mm),
        };
        Some((finish, toward, word))
    }

    /// Holds the move that the block has made behind so many others, if its corner waits for the next.
    fn hold_corner(&mut self, block: &Block, made: usize, out: &mut Output<'_>) {
        let Some((finish, toward, word)) = self.finish_of(block, out.faults) else { return };
        let is_own = out.motions.len() > made;
        let Some(Motion::Move(step)) = out.motions.pop_if(|motion| is_own && is_rounded(motion))
        else {
            out.faults.push(lone(&word));
            return;
        };
        let is_equal = self.frames.arcs_mirrored(self.plane).is_some();
        if self.frames.scaling().is_some() || !is_equal {
            let message = format!("{word}: a corner under scaling, or a turn out of the plane");
            let fault = Fault::word(&rules::CORNER, &word, message);
            out.faults
                .push(fault.help("end it by G50 or G69 before, or write the corner as moves"));
            return;
        }
        let (feed, finish) = (self.feed, Some((finish, toward)));
        let (angle_deg, before) = (None, None);
        self.held_move = Some(Box::new(Pending { step, feed, angle_deg, finish, before, word }));
    }

    /// Takes the corner between the move that waits and the one that the block has made away.
    fn join_corner(&mut self, made: usize, out: &mut Output<'_>) {
        let is_one = out.motions.len() == made + 1;
        let next = out.motions.pop_if(|motion| is_one && is_rounded(motion));
        let Some(Motion::Move(mut next)) = next else {
            self.refuse_corner(format!("line {} makes no straight move and no arc", out.line));
            return;
        };
        let Some(mut pending) = self.held_move.take() else { return };
        let Some((size, toward)) = pending.finish else {
            out.motions.extend([Motion::Move(pending.step), Motion::Move(next)]);
            return;
        };
        match self.corner_between(&mut pending.step, &mut next, size, toward) {
            Ok(corner) => {
                give_out([Some(pending.step), corner, Some(next)], out);
            }
            Err(message) => {
                self.held_move = Some(pending);
                self.refuse_corner(message);
            }
        }
    }

    fn corner_between(
        &self,
        first: &mut Move,
        next: &mut Move,
        size: Finish,
        toward: Option<Toward>,
    ) -> Result<Option<Move>, String> {
        let axes = self.plane.axes();
        let leaves = |step: &Move| {
            let aside = |axis: &Axis| !axes.contains(axis) && step.from[*axis] != step.to[*axis];
            Axis::ALL.iter().any(aside)
        };
        if leaves(first) || leaves(next) {
            let plane = self.plane.name();
            return Err(format!("both moves lie in the {plane} plane, which is in force"));
        }
        let flat = |point: &Point| axes.map(|axis| point[axis]);
        let leg = |step: &Move| Leg {
            start: flat(&step.from),
            end: flat(&step.to),
            round: match step.kind {
                MoveKind::Arc { center_mm, ccw, .. } => Some((center_mm, ccw)),
                _ => None,
            },
        };
        holds_sign(toward, |axis| next.to[axis] - next.from[axis])?;
        let (mut a, mut b) = (leg(first), leg(next));
        let Some(corner) = finish(&mut a, &mut b, size)? else { return Ok(None) };
        let lift = |place: Place| {
            let mut point = first.to;
            (point[axes[0]], point[axes[1]]) = (place[0], place[1]);
            point
        };
        // What is used up is no move, and no full circle either.
        let from = if a.length() < USED_UP_MM { first.from } else { lift(corner.start) };
        let to = if b.length() < USED_UP_MM { next.to } else { lift(corner.end) };
        let feeds = [&*first, &*next].map(|step| step.kind.feed_mm_min().unwrap_or_default());
        let feed_mm_min = feeds[0].min(feeds[1]);
        let kind = match corner.round {
            None => MoveKind::Line { feed_mm_min },
            Some((center_mm, ccw)) => {
                let (plane, turns) = (self.plane, 0);
                MoveKind::Arc { feed_mm_min, plane, center_mm, ccw, turns }
            }
        };
        let step = Move { from, to, kind, ..first.clone() };
        (first.to, next.from) = (from, to);
        Ok(Some(step))
    }
}

/// Words of lathes without a comma as those with one: A, R, and C where there is no such axis.
pub(super) fn renamed(block: &Block, has_c: bool) -> Option<Block> {
    let plain = letter_set("AR") | if has_c { 0 } else { letter_bit(b'C') };
    if block.letters() & plain == 0 {
        return None;
    }
    let words = block.words().iter().filter(|word| letter_bit(word.letter) & plain != 0);
    let words = words.map(|word| {
        let letter = match word.letter {
            b'A' => COMMA_A,
            b'C' => COMMA_C,
            _ => COMMA_R,
        };
        Word { letter, ..*word }
    });
    let words: Vec<Word> = words.collect();
    let mut renamed = Block::default();
    renamed.copy_words(block);
    renamed.replace(plain, words);
    Some(renamed)
}

/// What becomes of the corner at a block's end, in the units of its word; `takes_signs`: by I and K
/// too, and by their signs, as lathes have them.
pub(super) fn corner_of(
    block: &Block,
    takes_signs: bool,
    faults: &mut Vec<Fault>,
) -> Option<(Finish, Option<Toward>, Word)> {
    let letters = CORNER_LETTERS & !letter_bit(COMMA_A);
    let letters = if takes_signs { letters | CHAMFER_LETTERS } else { letters };
    let mut words = block.words().iter().filter(|word| letter_bit(word.letter) & letters != 0);
    let word = *words.next()?;
    let mut wrong = |word: &Word, message: &str, help: &str| {
        let message = format!("{word}: {message}");
        faults.push(Fault::word(&rules::CORNER, word, message).help(help));
    };
    if let Some(other) = words.next() {
        wrong(other, "a corner has either a fillet or a chamfer", "leave one of them out");
        return None;
    }
    let along = block.has(b'Z') || block.has(b'W');
    let across = block.has(b'X') || block.has(b'U');
    let toward = match word.letter {
        b'I' if along && !across => Some((Axis::X, word.value > 0.0)),
        b'K' if across && !along => Some((Axis::Z, word.value > 0.0)),
        b'I' | b'K' => {
            let message = "I is a chamfer behind a move along Z, K one behind a move along X";
            wrong(&word, message, "write ,C and the length of the chamfer");
            return None;
        }
        _ if word.value >= 0.0 => None,
        _ if takes_signs && along != across => Some((if along { Axis::X } else { Axis::Z }, false)),
        _ => {
            wrong(&word, "this length is above 0", "write it without the sign");
            return None;
        }
    };
    let size = word.value.abs();
    let is_fillet = word.letter == COMMA_R;
    let finish = if is_fillet { Finish::Fillet(size) } else { Finish::Chamfer(size) };
    (size > 0.0).then_some((finish, toward, word))
}

/// Holds the way of the next move along an axis against a sign.
pub(super) fn holds_sign(toward: Option<Toward>, way: impl Fn(Axis) -> f64) -> Result<(), String> {
    let Some((axis, up)) = toward else { return Ok(()) };
    let by = way(axis);
    if by != 0.0 && (by > 0.0) == up {
        return Ok(());
    }
    let to = if up { "greater" } else { "lower" };
    Err(format!("by its sign the next move goes to {to} {axis}"))
}

/// A move of which no more than this is left is used up.
const USED_UP_MM: f64 = 1e-7;

/// Gives out what is left of moves and of the corners between them.
fn give_out(steps: [Option<Move>; 3], out: &mut Output<'_>) {
    let steps = steps.into_iter().flatten().filter(|step| step.from != step.to);
    out.motions.extend(steps.map(Motion::Move));
}

/// Whether a motion may end in such a corner, and begin with one.
fn is_rounded(motion: &Motion) -> bool {
    let Motion::Move(step) = motion else { return false };
    step.bound == Bound::Free
        && matches!(step.kind, MoveKind::Line { .. } | MoveKind::Arc { turns: 0, .. })
}

fn lone(word: &Word) -> Fault {
    let message = format!("{word} stands in a block without a straight move or an arc");
    Fault::word(&rules::CORNER, word, message).help("write it beside G1, G2 or G3 and its end")
}

/// A block without its angle, and with a word more.
fn without_angle(block: &Block, word: Option<Word>) -> Box<Block> {
    let mut resolved = Box::<Block>::default();
    resolved.copy_words(block);
    resolved.replace(letter_bit(COMMA_A), word);
    resolved
}
