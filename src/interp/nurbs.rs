//! NURBS over several blocks: G5.2 to G5.3 (LinuxCNC), and G6.2 (FANUC).
//!
//! ```text
//! G5.2 P1 L3          the start weighs 1; the order is 3     G6.2 P4 K0 X0 Y0     the start
//! X0 Y1 P1            a point and its weight                 K0 X0 Y1 R1          a knot, a point
//! X2 Y2 P1                                                   K0 X2 Y2             and its weight
//! X2 Y0 P1                                                   K0 X2 Y0
//! G5.3                knots: 0 0 0 1 2 2 2                   K1, four times       the last knots
//! ```
//!
//! The curve is one move, of the line that closes it. Of a NURBS with a fault nothing is kept.

use std::sync::Arc;

use crate::base::spline::{DEGREE_MAX, POINTS_MAX, SplineError};
use crate::base::{Axis, Point, Spline};
use crate::gcode::codes::{self, AXIS_LETTERS, Op, SplineCode};
use crate::gcode::{Block, Fault, Word, rules};

use super::execute::{Asked, Executor, MotionMode, Output};
use super::motion::MoveKind;
use super::words::whole;

/// Orders below make lines, which are better written as such.
const ORDER_MIN: usize = 3;
/// Greatest order.
const ORDER_MAX: usize = DEGREE_MAX + 1;
/// Order where G5.2 has no L, and where G6.2 has no P.
const ORDER_OF_G5_2: usize = 3;
const ORDER_OF_G6_2: usize = 4;

/// Weights beyond these bounds pull a curve into its points, or leave it no room near them.
const WEIGHTS: std::ops::RangeInclusive<f64> = 1e-4..=1e4;

/// How far the first point of G6.2 may lie from where the machine stands: what rounding to three
/// decimals makes.
const START_WITHIN_MM: f64 = 0.001;

/// A NURBS of which not all blocks have been read.
#[derive(Debug)]
pub(super) struct OpenNurbs {
    code: SplineCode,
    /// Where it was opened.
    line: u32,
    order: usize,
    /// In machine coordinates; the first is where the machine stands.
    points: Vec<Point>,
    weights: Vec<f64>,
    /// Those of G6.2.
    knots: Vec<f64>,
}

impl OpenNurbs {
    /// What has to come before anything else may.
    fn remedy(&self) -> String {
        match self.code {
            SplineCode::NurbsByKnots => format!(
                "end it by blocks of K alone, {} of them; so far it has {} points and {} knots",
                self.order,
                self.points.len(),
                self.knots.len()
            ),
            _ => "end it by G5.3 before".to_owned(),
        }
    }
}

impl Executor<'_> {
    /// Reports what has no place between the first and the last block of a NURBS.
    pub(super) fn breaks_nurbs(
        &mut self,
        block: &Block,
        asked: Asked,
        faults: &mut Vec<Fault>,
    ) -> bool {
        let Some(nurbs) = &self.spline.nurbs else { return false };
        let has_end = nurbs.code == SplineCode::Nurbs;
        let is_own = |op| op == Op::Spline(nurbs.code) || (op == Op::NurbsEnd && has_end);
        let is_foreign = |word: &&Word| match word.letter {
            b'G' | b'M' => codes::find(word.letter, word.value)
                .and_then(|code| code.op)
                .is_some_and(|op| !is_own(op)),
            letter => matches!(letter, b'S' | b'T'),
        };
        let foreign = block.words().iter().find(is_foreign).filter(|_| !asked.is_faulty);
        if let Some(word) = foreign {
            let (name, line) = (nurbs.code.name(), nurbs.line);
            let message = format!("{word} stands in the NURBS that {name} begins on line {line}");
            faults.push(Fault::word(&rules::NURBS_OPEN, word, message).help(nurbs.remedy()));
        }
        if foreign.is_some() || asked.is_faulty {
            self.give_up_nurbs();
        }
        foreign.is_some()
    }

    /// Reports a NURBS that the program does not close.
    pub(super) fn end_without_nurbs(&mut self, block: &Block, faults: &mut Vec<Fault>) {
        let Some(nurbs) = self.spline.nurbs.take() else { return };
        let (name, line) = (nurbs.code.name(), nurbs.line);
        let message = format!("the NURBS that {name} begins on line {line} has no end");
        faults.push(Fault::block(&rules::NURBS_OPEN, block, message).help(nurbs.remedy()));
    }

    /// Forgets a NURBS with a fault: the words that follow are its own.
    fn give_up_nurbs(&mut self) {
        (self.spline.nurbs, self.spline.is_given_up) = (None, true);
        self.forget_position();
        self.motion = MotionMode::Foreign;
    }

    /// The NURBS under way, begun here if there is none; none where there is no room for one.
    fn opened(
        &mut self,
        code: SplineCode,
        block: &Block,
        asked: Asked,
        out: &mut Output<'_>,
    ) -> Option<Box<OpenNurbs>> {
        let open = self.spline.nurbs.take();
        let has_room = self.has_room(code, block, asked, out.faults);
        let has_feed = open.is_some() || self.has_feed(block, out.faults);
        let is_known = Axis::LINEAR.iter().all(|axis| !self.open.contains(*axis));
        if asked.is_faulty || !has_room || !has_feed || !is_known {
            return None;
        }
        let order = if code == SplineCode::Nurbs { ORDER_OF_G5_2 } else { ORDER_OF_G6_2 };
        Some(open.unwrap_or_else(|| {
            let (points, weights, knots) = (Vec::new(), Vec::new(), Vec::new());
            Box::new(OpenNurbs { code, line: out.line, order, points, weights, knots })
        }))
    }

    /// A block from G5.2 on.
    pub(super) fn nurbs_block(&mut self, block: &Block, asked: Asked, out: &mut Output<'_>) {
        let open = self.opened(SplineCode::Nurbs, block, asked, out);
        self.spline.nurbs = open.and_then(|mut nurbs| {
            self.nurbs_point(&mut nurbs, block, asked, out.faults)?;
            Some(nurbs)
        });
        if self.spline.nurbs.is_none() {
            self.give_up_nurbs();
        }
    }

    /// Under G91 the words of every point are distances from the start of the curve (RS274/NGC).
    fn nurbs_point(
        &mut self,
        nurbs: &mut OpenNurbs,
        block: &Block,
        asked: Asked,
        faults: &mut Vec<Fault>,
    ) -> Option<()> {
        let (is_first, weight) = (nurbs.points.is_empty(), block.word(b'P'));
        if is_first {
            nurbs.points.push(self.position_mm);
            nurbs.weights.push(1.0);
        }
        if let Some(word) = block.word(b'L') {
            nurbs.order = order(word, faults)?;
        }
        let missing = match (block.has(b'X'), block.has(b'Y'), weight) {
            (true, true, Some(word)) => {
                let faults_before = faults.len();
                let to = self.target(block, &asked, faults);
                nurbs.points.push(to);
                nurbs.weights.push(weight_of(word, faults)?);
                has_place(nurbs, block, faults)?;
                return (faults.len() == faults_before).then_some(());
            }
            (false, false, Some(word)) if is_first => {
                nurbs.weights = vec![weight_of(word, faults)?];
                return Some(());
            }
            (false, false, None) => return Some(()),
            (false, false, Some(_)) => "P without X and Y weighs the start, in the first block",
            (true, true, None) => "a point of G5.2 has no P, its weight",
            _ => "a point of G5.2 needs both X and Y",
        };
        faults.push(Fault::block(&rules::MISSING_WORD, block, missing));
        None
    }

    /// G5.3. The knots are evenly spaced whole numbers, those at both ends as often as the order.
    pub(super) fn end_nurbs(&mut self, block: &Block, asked: &mut Asked, out: &mut Output<'_>) {
        asked.is_motion_named = true;
        let is_given_up = std::mem::take(&mut self.spline.is_given_up);
        self.motion = MotionMode::None;
        let Some(nurbs) = self.spline.nurbs.take() else {
            if !is_given_up && !asked.is_faulty {
                let message = "G5.3 ends a NURBS, and none has been begun";
                let fault = Fault::block(&rules::NURBS_UNOPENED, block, message);
                out.faults.push(fault.help("begin it by G5.2"));
            }
            return;
        };
        if !has_points(&nurbs, block, out.faults) {
            self.forget_position();
            return;
        }
        let (order, last) = (nurbs.order, nurbs.points.len() - nurbs.order + 1);
        let inner = (1..last).map(|knot| knot as f64);
        let knots = std::iter::repeat_n(0.0, order).chain(inner);
        let knots = knots.chain(std::iter::repeat_n(last as f64, order)).collect();
        self.draw(OpenNurbs { knots, ..*nurbs }, block, *asked, out);
    }

    /// A block of G6.2.
    pub(super) fn nurbs_by_knots_block(
        &mut self,
        block: &Block,
        asked: Asked,
        out: &mut Output<'_>,
    ) {
        let open = self.opened(SplineCode::NurbsByKnots, block, asked, out);
        let nurbs = open.and_then(|mut nurbs| {
            self.knot_and_point(&mut nurbs, block, asked, out.faults)?;
            Some(nurbs)
        });
        let Some(nurbs) = nurbs else {
            self.give_up_nurbs();
            return;
        };
        if nurbs.knots.len() < nurbs.points.len() + nurbs.order {
            self.spline.nurbs = Some(nurbs);
        } else {
            // The points have led the position on: the curve begins where they have begun.
            self.position_mm = nurbs.points[0];
            self.draw(*nurbs, block, asked, out);
        }
    }

    /// A knot and a point; without axes one of the last knots. A first block without axes is the
    /// point where the machine stands.
    fn knot_and_point(
        &mut self,
        nurbs: &mut OpenNurbs,
        block: &Block,
        asked: Asked,
        faults: &mut Vec<Fault>,
    ) -> Option<()> {
        let (is_first, knot) = (nurbs.points.is_empty(), block.word(b'K'));
        match block.word(b'P') {
            Some(word) if is_first => nurbs.order = order(word, faults)?,
            Some(word) => {
                let message = format!("{word}: the order of a NURBS stands in its first block");
                faults.push(Fault::word(&rules::UNUSED_WORD, word, message));
                return None;
            }
            None => {}
        }
        let before = nurbs.knots.last().copied();
        if let (Some(word), Some(before)) = (knot.filter(|knot| Some(knot.value) < before), before)
        {
            let message = format!("{word} is less than the knot before, {before}");
            faults.push(Fault::word(&rules::NURBS_KNOTS, word, message));
            return None;
        }
        if is_first || block.letters() & AXIS_LETTERS != 0 {
            self.point_by_knot(nurbs, block, asked, faults)?;
        } else if let Some(word) = block.word(b'R') {
            let message = format!("{word} weighs no point: this block has none");
            faults.push(Fault::word(&rules::UNUSED_WORD, word, message));
            return None;
        } else if !has_points(nurbs, block, faults) {
            return None;
        }
        match knot {
            // A first block without K has the knot of the second.
            Some(word) if !is_first && nurbs.knots.is_empty() => nurbs.knots = vec![word.value; 2],
            Some(word) => nurbs.knots.push(word.value),
            None if is_first => {}
            None => {
                let message = "a point of G6.2 has no K, its knot";
                faults.push(Fault::block(&rules::MISSING_WORD, block, message));
                return None;
            }
        }
        Some(())
    }

    /// A point of G6.2. Axes without a word are those of the point before; under G91 words are
    /// distances from there.
    fn point_by_knot(
        &mut self,
        nurbs: &mut OpenNurbs,
        block: &Block,
        asked: Asked,
        faults: &mut Vec<Fault>,
    ) -> Option<()> {
        if nurbs.knots.len() > nurbs.points.len() {
            let message = "a point of G6.2 follows the last knots, which have none";
            let fault = Fault::block(&rules::NURBS_KNOTS, block, message);
            faults.push(fault.help(nurbs.remedy()));
            return None;
        }
        let faults_before = faults.len();
        let start = self.position_mm;
        let to = self.target(block, &asked, faults);
        if faults.len() > faults_before {
            return None;
        }
        self.position_mm = to;
        if nurbs.points.is_empty() {
            let off = Axis::LINEAR.into_iter().find(|axis| {
                let off_mm = (to[*axis] - start[*axis]).abs();
                off_mm > START_WITHIN_MM
            });
            if let Some(axis) = off {
                let message = format!(
                    "the first point of G6.2 is where the curve begins: {axis} is {:.4} mm off",
                    (to[axis] - start[axis]).abs()
                );
                let fault = Fault::block(&rules::NURBS_START, block, message);
                faults.push(fault.help("go there first, by G0 or G1"));
                return None;
            }
            self.position_mm = start;
        }
        nurbs.points.push(self.position_mm);
        nurbs.weights.push(match block.word(b'R') {
            Some(word) => weight_of(word, faults)?,
            None => 1.0,
        });
        has_place(nurbs, block, faults)
    }

    /// Makes the move of a NURBS whose points and knots are all there.
    fn draw(&mut self, nurbs: OpenNurbs, block: &Block, asked: Asked, out: &mut Output<'_>) {
        let OpenNurbs { order, points, weights, knots, .. } = nurbs;
        let ends = [&knots[..order], &knots[knots.len() - order..]].map(|ends| format!("{ends:?}"));
        let to = points.last().copied().unwrap_or(self.position_mm);
        match Spline::new(order - 1, points, weights, knots) {
            Ok(curve) => {
                let kind = MoveKind::Spline { feed_mm_min: 0.0, curve: Arc::new(curve) };
                self.go(block, &to, kind, asked.corner, out);
            }
            Err(error) => {
                let [first, last] = ends;
                let message = if error == SplineError::KnotEnds {
                    format!(
                        "of order {order} the first {order} knots are equal, and so are the last: \
                         these are {first} and {last}"
                    )
                } else {
                    format!("these knots make no curve of order {order}: {error}")
                };
                out.faults.push(Fault::block(&rules::NURBS_KNOTS, block, message));
                self.forget_position();
            }
        }
    }
}

/// L of G5.2 and P of G6.2.
fn order(word: &Word, faults: &mut Vec<Fault>) -> Option<usize> {
    let order = whole(word, 999_999, faults)? as usize;
    if (ORDER_MIN..=ORDER_MAX).contains(&order) {
        return Some(order);
    }
    let message = format!("{word}: the order of a NURBS is from {ORDER_MIN} to {ORDER_MAX}");
    let fault = Fault::word(&rules::NURBS_ORDER, word, message);
    faults.push(match order {
        0..ORDER_MIN => fault.help("write the points as G1: a curve of this order is straight"),
        _ => fault.help("let the CAM program put out curves of a lower degree"),
    });
    None
}

fn weight_of(word: &Word, faults: &mut Vec<Fault>) -> Option<f64> {
    if WEIGHTS.contains(&word.value) {
        return Some(word.value);
    }
    let message = format!("{word}: a point weighs from {} to {}", WEIGHTS.start(), WEIGHTS.end());
    faults.push(Fault::word(&rules::NURBS_WEIGHT, word, message));
    None
}

/// Whether there are as many points as the order asks for.
fn has_points(nurbs: &OpenNurbs, block: &Block, faults: &mut Vec<Fault>) -> bool {
    let (count, order) = (nurbs.points.len(), nurbs.order);
    if count >= order {
        return true;
    }
    let message = format!("this NURBS of order {order} has {count} points, the start included");
    let fault = Fault::block(&rules::NURBS_POINTS, block, message);
    faults.push(fault.help(format!("it needs {order} points at least, or a lower order")));
    false
}

fn has_place(nurbs: &OpenNurbs, block: &Block, faults: &mut Vec<Fault>) -> Option<()> {
    if nurbs.points.len() <= POINTS_MAX {
        return Some(());
    }
    let message = format!("a NURBS has at most {POINTS_MAX} points");
    let fault = Fault::block(&rules::NURBS_POINTS, block, message);
    faults.push(fault.help("end it before, and begin another one"));
    None
}
