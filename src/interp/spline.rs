//! G5 and G5.1: Bézier curves in XY. Those of more points are in [`super::nurbs`].
//!
//! ```text
//!   G5     start + I J ·                 · end + P Q        G5.1      · start + I J
//!                     /                   \                          / \
//!              start ·                     · end             start ·     · end
//! ```
//!
//! A G5 without I and J goes on in the direction, and as fast by its parameter, as the G5 before
//! it has ended. A spline stays one whatever scales or turns it, for its points are what is moved.

use std::sync::Arc;

use crate::base::{Axis, Plane, Point, Spline};
use crate::gcode::codes::{AXIS_LETTERS, Op, SplineCode};
use crate::gcode::{Block, Fault, letter_bit, letter_set, rules};

use super::execute::{Asked, Executor, MotionMode, Output};
use super::motion::MoveKind;
use super::nurbs::OpenNurbs;
use super::words::machine_coordinates_alone;

/// Letters of FANUC's high-speed machining.
pub(super) const LOOK_AHEAD_LETTERS: u32 = letter_set("PQR");

/// Whether G5 or G5.1 is no spline, and G8 no end of diameters, but FANUC's high-speed machining, on
/// or off: `G5 P10000`, `G5 P0`, `G5.1 Q1 R5`, `G5.1 Q0`, `G8 P1`, `G8 P0`. It says how a control is to
/// plan, never where the tool goes, and leaves the motion code in force. No spline has these words
/// alone.
pub(super) fn is_look_ahead(op: Op, block: &Block) -> bool {
    let (letter, values) = match op {
        Op::Spline(SplineCode::Cubic) => (b'P', [0.0, 10_000.0]),
        Op::Spline(SplineCode::Quadratic) => (b'Q', [0.0, 1.0]),
        Op::Radius => (b'P', [0.0, 1.0]),
        _ => return false,
    };
    let others = AXIS_LETTERS | SplineCode::Cubic.words() & !letter_bit(letter);
    block.letters() & others == 0
        && block.word(letter).is_some_and(|word| values.contains(&word.value))
}

/// What splines leave behind for the blocks that follow.
#[derive(Debug, Default)]
pub(super) struct SplineState {
    /// The last two points of a G5, in machine coordinates.
    last: Option<[Point; 2]>,
    pub nurbs: Option<Box<OpenNurbs>>,
    /// Whether a fault has ended the NURBS that the next G5.3 would end.
    pub is_given_up: bool,
}

impl Executor<'_> {
    /// Runs a block where a spline's code is in force.
    pub(super) fn run_spline(
        &mut self,
        code: SplineCode,
        block: &Block,
        asked: Asked,
        out: &mut Output<'_>,
    ) {
        if asked.axes_claimed {
            return;
        }
        let has_words = block.letters() & (AXIS_LETTERS | code.words()) != 0;
        match code {
            SplineCode::Cubic | SplineCode::Quadratic if has_words => {
                self.bezier(code, block, asked, out);
            }
            SplineCode::Nurbs if has_words || asked.is_motion_named => {
                self.nurbs_block(block, asked, out);
            }
            SplineCode::NurbsByKnots if has_words || asked.is_motion_named => {
                self.nurbs_by_knots_block(block, asked, out);
            }
            _ if asked.machine_coordinates && !asked.is_faulty => {
                machine_coordinates_alone(block, out.faults);
            }
            _ => {}
        }
    }

    fn bezier(&mut self, code: SplineCode, block: &Block, asked: Asked, out: &mut Output<'_>) {
        let last = self.spline.last.take();
        let has_room = self.has_room(code, block, asked, out.faults);
        let has_feed = self.has_feed(block, out.faults);
        let faults_before = out.faults.len();
        let to = self.target(block, &asked, out.faults);
        let is_told = !asked.is_faulty && out.faults.len() == faults_before;
        let is_open = [Axis::X, Axis::Y].iter().any(|axis| self.open.contains(*axis));
        let goes_on = asked.motion_before == MotionMode::Spline(SplineCode::Cubic);
        let last = last.filter(|points| goes_on && points[1] == self.position_mm);
        let points = if !(is_told && has_room) || is_open {
            None
        } else if code == SplineCode::Cubic {
            self.cubic_points(block, &to, last, out.faults)
        } else {
            self.quadratic_points(block, &to, out.faults)
        };
        let Some(points) = points.filter(|_| has_feed) else {
            self.position_mm = to;
            return;
        };
        if code == SplineCode::Cubic {
            self.spline.last = Some([points[points.len() - 2], to]);
        }
        if let Ok(curve) = Spline::bezier(points) {
            let kind = MoveKind::Spline { feed_mm_min: 0.0, curve: Arc::new(curve) };
            self.go(block, &to, kind, asked.corner, out);
        }
    }

    /// Whether the modes in force leave room for a spline, and its axis words are its own.
    pub(super) fn has_room(
        &self,
        code: SplineCode,
        block: &Block,
        asked: Asked,
        faults: &mut Vec<Fault>,
    ) -> bool {
        let name = code.name();
        let (rule, message, help) = if self.compensation.is_some() {
            (
                &rules::COMPENSATION_MODE,
                format!("{name} has no place in cutter compensation, nor where it leads out"),
                "end compensation by G40 and a straight move before it",
            )
        } else if self.polar {
            let message = format!("{name} under G16: the points of a spline are not polar");
            (&rules::SPLINE_MODE, message, "end polar coordinates by G15 before it")
        } else if code != SplineCode::NurbsByKnots && self.plane != Plane::Xy {
            let message =
                format!("{name} lies in the XY plane, and {} is in force", self.plane.name());
            (&rules::SPLINE_MODE, message, "write G17 before it")
        } else if asked.machine_coordinates {
            machine_coordinates_alone(block, faults);
            return false;
        } else {
            let Some(word) = block.first_of(AXIS_LETTERS & !code.axes()) else { return true };
            let axes = if code == SplineCode::NurbsByKnots { "X, Y and Z" } else { "X and Y" };
            let message = format!("{word}: {name} moves {axes} only");
            let fault = Fault::word(&rules::SPLINE_AXIS, word, message);
            faults.push(fault.help("leave the word out, or move this axis in a block of its own"));
            return false;
        };
        faults.push(Fault::block(rule, block, message).help(help));
        false
    }

    /// A point beside another by so much of the program's X and Y, in program units.
    fn beside(&self, at: &Point, by: [f64; 2]) -> Point {
        let is_plain = self.frames.is_plain();
        let mut point = if is_plain { *at } else { self.frames.program(at) };
        point[Axis::X] += by[0] * self.mm_per_unit;
        point[Axis::Y] += by[1] * self.mm_per_unit;
        if is_plain { point } else { self.frames.machine(&point) }
    }

    fn cubic_points(
        &self,
        block: &Block,
        to: &Point,
        last: Option<[Point; 2]>,
        faults: &mut Vec<Fault>,
    ) -> Option<Vec<Point>> {
        let value = |letter: u8| block.word(letter).map(|word| word.value);
        let (Some(p), Some(q)) = (value(b'P'), value(b'Q')) else {
            let message = "G5 needs both P and Q, the way from its end to the point before";
            faults.push(Fault::block(&rules::MISSING_WORD, block, message));
            return None;
        };
        let from = self.position_mm;
        let after_start = match (value(b'I'), value(b'J'), last) {
            (Some(i), Some(j), _) => self.beside(&from, [i, j]),
            (None, None, Some([before, end])) => {
                Point::from_fn(|axis| end[axis] + (end[axis] - before[axis]))
            }
            (None, None, None) => {
                let message = "the first G5 of a row has no I and J, its direction at the start";
                let fault = Fault::block(&rules::SPLINE_TANGENT, block, message);
                faults.push(fault.help("write I and J, the way from the start to the point after"));
                return None;
            }
            _ => {
                let message = "G5 has one of I and J: it needs both, or neither to go on smoothly";
                faults.push(Fault::block(&rules::MISSING_WORD, block, message));
                return None;
            }
        };
        Some(vec![from, after_start, self.beside(to, [p, q]), *to])
    }

    fn quadratic_points(
        &self,
        block: &Block,
        to: &Point,
        faults: &mut Vec<Fault>,
    ) -> Option<Vec<Point>> {
        if block.letters() & (letter_bit(b'I') | letter_bit(b'J')) == 0 {
            let message = "G5.1 has no I and J, the way from the start to the point between";
            faults.push(Fault::block(&rules::MISSING_WORD, block, message));
            return None;
        }
        let by = [b'I', b'J'].map(|letter| block.word(letter).map_or(0.0, |word| word.value));
        Some(vec![self.position_mm, self.beside(&self.position_mm, by), *to])
    }
}
