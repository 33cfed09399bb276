//! Cutter compensation: from the contour to the path of the tool's centre, move by move.
//!
//! ```text
//!   outside corner: an arc about it     inside corner: where both offsets meet
//!        ___                                  │  ·
//!      ,'   ╲ r                               │  └───────
//!      │  ·──────                             └──────────
//!      │  │                                   (contour; · is the tool's centre)
//! ```
//!
//! A move is held until the next one in the plane tells its end. The first move after G41 or G42
//! leads in, to a place beside its end, across its own direction; an arc becomes a wider or a
//! narrower one that ends there in the same direction. The first after G40 leads out, straight to
//! where it ends, on axes that it does not name too (as RS274/NGC has it). A move that the corners
//! at both its ends swallow would gouge and is refused; so is an inside arc of less than the tool's
//! radius (of just that, the centre stays at one point). Corners of moves that do not follow each other are not looked at.

use crate::base::{Plane, Point};
use crate::gcode::{Block, Fault, rules};

use super::arc::sweep_rad;
use super::motion::{Motion, Move, MoveKind};

/// Ends this near to each other are one point: what rounding leaves of tangents.
const SAME_POINT_MM: f64 = 1e-6;

/// Angles this near to half a turn are a way back.
const WAY_BACK_RAD: f64 = 1e-6;

/// Where an arc leads back it curls over the way there, or away from it, however exactly it sets out:
/// within this angle, as LinuxCNC has it, the curl tells.
const WAY_BACK_CURVED_RAD: f64 = 0.05;

/// Most that is held between two moves in the plane.
const HELD_MAX: usize = 1000;

type Vector = [f64; 2];

/// The stage: takes motion of the contour, gives motion of the tool's centre.
#[derive(Debug)]
pub(super) struct Compensation {
    pub plane: Plane,
    radius_mm: f64,
    /// From the centre of a lathe tool's nose to the point of it that the program leads.
    tip_mm: Vector,
    /// 1: left of the contour, -1: right of it.
    side: f64,
    /// Whether G40 has come: what is left is to lead out.
    leads_out: bool,
    /// Where the tool's centre is, once what has been given is done.
    at: Point,
    /// A move in the plane and what follows it.
    held: Vec<Motion>,
    last: Option<Piece>,
}

/// A move of the contour, moved aside by the radius.
#[derive(Clone, Copy, Debug)]
struct Piece {
    line: u32,
    /// The end of the contour's move.
    corner: Vector,
    start: Vector,
    end: Vector,
    start_tangent: Vector,
    end_tangent: Vector,
    round: Option<Round>,
    /// How the contour curves, to the left: 1/mm.
    curvature: f64,
    is_lead_in: bool,
    /// An inside arc of the tool's radius: the tool's centre stays where the arc's is.
    is_point: bool,
}

#[derive(Clone, Copy, Debug)]
struct Round {
    center: Vector,
    ccw: bool,
    /// Radii at start and end.
    radii: [f64; 2],
    sweep_rad: f64,
}

impl Compensation {
    /// Whether it keeps left of the path.
    pub fn is_left(&self) -> bool {
        self.side > 0.0
    }

    /// Begins at a position of the contour; `is_left` of a negative radius is right.
    pub fn new(
        plane: Plane,
        is_left: bool,
        radius_mm: f64,
        orientation: u32,
        at: Point,
    ) -> Compensation {
        let side = if is_left == (radius_mm >= 0.0) { 1.0 } else { -1.0 };
        let radius_mm = radius_mm.abs();
        let tip_mm = tip(orientation).map(|part| part * radius_mm);
        let (leads_out, held, last) = (false, Vec::new(), None);
        Compensation { plane, radius_mm, tip_mm, side, leads_out, at, held, last }
    }

    /// A move of the contour as the nose's centre has to be led for it.
    fn led(&self, mut step: Move) -> Move {
        let axes = self.plane.axes();
        for (axis, by_mm) in axes.into_iter().zip(self.tip_mm) {
            step.from[axis] += by_mm;
            step.to[axis] += by_mm;
        }
        if let MoveKind::Arc { plane, center_mm, .. } = &mut step.kind
            && *plane == self.plane
        {
            *center_mm = [center_mm[0] + self.tip_mm[0], center_mm[1] + self.tip_mm[1]];
        }
        step
    }

    /// Whether G40 has not come yet.
    pub fn is_on(&self) -> bool {
        !self.leads_out
    }

    /// Where the tool's centre is, or will be once what is held is given out.
    pub fn position_mm(&self) -> Point {
        self.at
    }

    /// Takes motion; false once the tool is back on the contour.
    pub fn push(
        &mut self,
        motion: Motion,
        block: &Block,
        out: &mut Vec<Motion>,
        faults: &mut Vec<Fault>,
    ) -> bool {
        let step = match motion {
            Motion::Move(step) => step,
            event => {
                self.hold(event, block, out, faults);
                return true;
            }
        };
        let step = if self.leads_out { step } else { self.led(step) };
        let is_round = matches!(step.kind, MoveKind::Arc { .. });
        if !is_round && !self.leads_out && self.flat(&step.from) == self.flat(&step.to) {
            self.hold(Motion::Move(step), block, out, faults);
            return true;
        }
        let other_plane = matches!(step.kind, MoveKind::Arc { plane, .. } if plane != self.plane);
        if other_plane || (self.leads_out && is_round) {
            let message = if other_plane {
                "this arc does not lie in the plane of compensation"
            } else {
                "the first move after G40 leads out: it cannot be an arc"
            };
            faults.push(Fault::block(&rules::COMPENSATION_MODE, block, message));
            return true;
        }
        if self.leads_out {
            out.push(Motion::Move(Move { from: self.at, ..step }));
            self.at = step.to;
            return false;
        }
        let made = match self.piece(&step) {
            Some(piece) if self.last.is_none() => self.leading_in(piece, step),
            made => made.map(|piece| (piece, step)),
        };
        match made {
            Some((piece, mut step)) if piece.is_point => {
                let feed_mm_min = step.kind.feed_mm_min().unwrap_or_default();
                step.kind = MoveKind::Line { feed_mm_min };
                self.join(piece, step, block, out, faults);
            }
            Some((piece, step)) => self.join(piece, step, block, out, faults),
            None => {
                let message = format!(
                    "the tool's radius of {:.4} mm does not fit into this arc",
                    self.radius_mm
                );
                faults.push(Fault::block(&rules::COMPENSATION_GOUGE, block, message));
            }
        }
        true
    }

    /// G40 or the end of the program: gives out what is held.
    pub fn end(&mut self, block: &Block, out: &mut Vec<Motion>, faults: &mut Vec<Fault>) {
        self.leads_out = true;
        if let Some(last) = self.last.take() {
            if !last.reaches(last.end) {
                faults.push(self.gouge(&last, last.line, block));
            }
            self.release(last.end, out);
        }
    }

    /// Keeps what does not move in the plane behind what does.
    fn hold(
        &mut self,
        motion: Motion,
        block: &Block,
        out: &mut Vec<Motion>,
        faults: &mut Vec<Fault>,
    ) {
        if self.held.len() == HELD_MAX {
            let message = format!(
                "more than {HELD_MAX} moves and functions follow each other without a move in the \
                 plane of compensation"
            );
            faults.push(Fault::block(&rules::COMPENSATION_MODE, block, message));
            return;
        }
        let (is_free, at) = (self.held.is_empty(), self.flat(&self.at));
        self.held.push(motion);
        if is_free {
            self.release(at, out);
        }
    }

    /// Gives out what is held; it ends, in the plane, at a place.
    fn release(&mut self, end: Vector, out: &mut Vec<Motion>) {
        let [first, second] = self.plane.axes();
        for motion in self.held.drain(..) {
            let Motion::Move(mut step) = motion else {
                out.push(motion);
                continue;
            };
            step.from = self.at;
            [step.to[first], step.to[second]] = end;
            if matches!(step.kind, MoveKind::Line { .. }) && is_same(&step.from, &step.to) {
                continue;
            }
            self.at = step.to;
            out.push(Motion::Move(step));
        }
    }

    /// The first piece, from the contour to beside it. An arc becomes the one that ends there in the
    /// same direction; none where that would have to turn the other way.
    fn leading_in(&self, mut piece: Piece, mut step: Move) -> Option<(Piece, Move)> {
        piece.start = self.flat(&self.at);
        piece.is_lead_in = true;
        let (Some(round), MoveKind::Arc { center_mm, .. }) = (&mut piece.round, &mut step.kind)
        else {
            return Some((piece, step));
        };
        // Its centre lies on the radius of its end, as far from the start as from the end.
        let way = minus(piece.start, piece.end);
        let inward = minus(round.center, piece.end).map(|part| part / round.radii[1]);
        let radius = dot(way, way) / (2.0 * dot(way, inward));
        if !radius.is_finite() || radius <= 0.0 {
            return None;
        }
        round.center = plus(piece.end, inward, radius);
        round.radii = [radius; 2];
        *center_mm = round.center;
        Some((piece, step))
    }

    /// Ends the piece before where a piece begins, and goes round the corner between.
    fn join(
        &mut self,
        mut piece: Piece,
        step: Move,
        block: &Block,
        out: &mut Vec<Motion>,
        faults: &mut Vec<Fault>,
    ) {
        match self.last {
            None => {
                let way = length(minus(piece.corner, piece.start));
                if way < self.radius_mm - SAME_POINT_MM {
                    let message = format!(
                        "the move that leads in is shorter than the tool's radius of {:.4} mm",
                        self.radius_mm
                    );
                    faults.push(Fault::block(&rules::COMPENSATION_GOUGE, block, message));
                }
            }
            Some(last) => {
                let turn_rad = angle(last.end_tangent, piece.start_tangent);
                let is_same = length(minus(last.end, piece.start)) < SAME_POINT_MM;
                let is_inside = is_inside(turn_rad, &last, &piece, self.side) && !is_same;
                let meeting = if is_inside { last.meets(&piece) } else { Some(piece.start) };
                let Some(meeting) = meeting else {
                    faults.push(self.gouge(&last, piece.line, block));
                    return;
                };
                piece.start = meeting;
                let end = if is_inside || is_same { meeting } else { last.end };
                if !last.reaches(end) {
                    faults.push(self.gouge(&last, piece.line, block));
                }
                self.release(end, out);
                if !is_inside && !is_same {
                    self.go_round(&last, &piece, turn_rad, &step, out);
                }
            }
        }
        self.held.push(Motion::Move(step));
        self.last = Some(piece);
    }

    fn gouge(&self, last: &Piece, line: u32, block: &Block) -> Fault {
        let message = format!(
            "the tool's radius of {:.4} mm does not fit: the move of line {} is too short for its \
             corner with line {line}",
            self.radius_mm, last.line
        );
        let fault = Fault::block(&rules::COMPENSATION_GOUGE, block, message);
        fault.help("take a smaller tool, or leave such places out of the contour")
    }

    /// Goes round an outside corner: by an arc at feed; between rapids, which know no arcs, by
    /// lines outside of that arc.
    fn go_round(
        &mut self,
        last: &Piece,
        piece: &Piece,
        turn_rad: f64,
        next: &Move,
        out: &mut Vec<Motion>,
    ) {
        let feed_of = |motion: Option<&Motion>| match motion {
            Some(Motion::Move(step)) => step.kind.feed_mm_min(),
            _ => None,
        };
        let before = out.iter().rev().find(|motion| matches!(motion, Motion::Move(_)));
        let feed_mm_min = next.kind.feed_mm_min().or(feed_of(before));
        let mut ways = Vec::new();
        match feed_mm_min {
            Some(feed_mm_min) => {
                // Round an outside corner on its left the tool turns clockwise.
                let (ccw, center_mm) = (self.side < 0.0, last.corner);
                let (plane, turns) = (self.plane, 0);
                let arc = MoveKind::Arc { feed_mm_min, plane, center_mm, ccw, turns };
                ways.push((piece.start, arc));
            }
            None => {
                let by_mm = self.radius_mm * libm::tan(turn_rad.abs() / 4.0);
                ways.push((plus(last.end, last.end_tangent, by_mm), MoveKind::Rapid));
                ways.push((plus(piece.start, piece.start_tangent, -by_mm), MoveKind::Rapid));
                ways.push((piece.start, MoveKind::Rapid));
            }
        }
        let [first, second] = self.plane.axes();
        for (end, kind) in ways {
            let mut to = self.at;
            [to[first], to[second]] = end;
            out.push(Motion::Move(Move { from: self.at, to, kind, ..next.clone() }));
            self.at = to;
        }
    }

    fn flat(&self, point: &Point) -> Vector {
        self.plane.axes().map(|axis| point[axis])
    }

    /// A move of the contour beside itself; none where an inside arc leaves no room.
    fn piece(&self, step: &Move) -> Option<Piece> {
        let (from, to) = (self.flat(&step.from), self.flat(&step.to));
        let by_mm = self.radius_mm * self.side;
        let beside = |at: Vector, tangent: Vector| plus(at, [-tangent[1], tangent[0]], by_mm);
        let MoveKind::Arc { center_mm: center, ccw, turns, .. } = step.kind else {
            let way = minus(to, from);
            let tangent = way.map(|part| part / length(way));
            return Some(Piece {
                line: step.line,
                corner: to,
                start: beside(from, tangent),
                end: beside(to, tangent),
                start_tangent: tangent,
                end_tangent: tangent,
                round: None,
                curvature: 0.0,
                is_lead_in: false,
                is_point: false,
            });
        };
        let turning = if ccw { 1.0 } else { -1.0 };
        let tangent = |at: Vector| {
            let out = minus(at, center);
            let radius = length(out);
            [-out[1] / radius * turning, out[0] / radius * turning]
        };
        // Left of an arc that turns left is its centre.
        let radii = [from, to].map(|at| length(minus(at, center)) - by_mm * turning);
        let is_point = radii.iter().all(|radius| radius.abs() < SAME_POINT_MM);
        if !is_point && radii.iter().any(|radius| *radius < SAME_POINT_MM) {
            return None;
        }
        let round = (!is_point).then_some(radii);
        let (start_tangent, end_tangent) = (tangent(from), tangent(to));
        let sweep_rad = sweep_rad(from, to, center, ccw, turns);
        Some(Piece {
            line: step.line,
            corner: to,
            start: beside(from, start_tangent),
            end: beside(to, end_tangent),
            start_tangent,
            end_tangent,
            round: round.map(|radii| Round { center, ccw, radii, sweep_rad }),
            curvature: turning / length(minus(to, center)),
            is_lead_in: false,
            is_point,
        })
    }
}

impl Piece {
    /// Whether the piece, from its start on, still goes forward to an end that a corner has moved.
    fn reaches(&self, end: Vector) -> bool {
        match self.round {
            _ if self.is_lead_in => true,
            None => dot(minus(end, self.start), self.end_tangent) > -SAME_POINT_MM,
            Some(round) => {
                let left = sweep_rad(self.start, end, round.center, round.ccw, 0);
                let whole = round.sweep_rad % std::f64::consts::TAU;
                let is_full = whole == 0.0 || round.sweep_rad > std::f64::consts::TAU;
                is_full || left <= whole + SAME_POINT_MM / round.radii[1]
            }
        }
    }

    /// Where the piece meets the next one, nearest to the corner between them: if need be the one
    /// of two places that lies on both.
    fn meets(&self, next: &Piece) -> Option<Vector> {
        let near = |points: [Vector; 2]| {
            let far = |point: &Vector| {
                let is_off = !(self.reaches(*point) && next.reaches(*point));
                (is_off, length(minus(*point, self.corner)))
            };
            points.into_iter().min_by(|a, b| {
                let (a, b) = (far(a), far(b));
                a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
            })
        };
        match (self.round, next.round) {
            (None, None) => {
                let across = cross(self.end_tangent, next.start_tangent);
                let share = cross(minus(next.start, self.end), next.start_tangent) / across;
                Some(plus(self.end, self.end_tangent, share)).filter(|_| share.is_finite())
            }
            (None, Some(round)) => {
                near(line_circle(self.end, self.end_tangent, round.center, round.radii[0])?)
            }
            (Some(round), None) => {
                near(line_circle(next.start, next.start_tangent, round.center, round.radii[1])?)
            }
            (Some(a), Some(b)) => near(circles(a.center, a.radii[1], b.center, b.radii[0])?),
        }
    }
}

/// Whether the tool is on the inside of a corner. On a way back it is the curves that tell on which
/// side of it the way there lies; straight back goes round.
fn is_inside(turn_rad: f64, last: &Piece, next: &Piece, side: f64) -> bool {
    let bends = last.curvature + next.curvature;
    let is_curved = bends.abs() > SAME_POINT_MM;
    let within_rad = if is_curved { WAY_BACK_CURVED_RAD } else { WAY_BACK_RAD };
    if turn_rad.abs() <= std::f64::consts::PI - within_rad {
        return turn_rad * side > 0.0;
    }
    is_curved && bends * side < 0.0
}

/// Where the tip of a lathe tool lies beside the centre of its nose, in radii along Z and X, by
/// LinuxCNC's numbers of orientation: 1 to 4 between two axes, 5 to 8 on one, 0 and 9 at the centre.
fn tip(orientation: u32) -> Vector {
    match orientation {
        1 => [1.0, -1.0],
        2 => [-1.0, -1.0],
        3 => [-1.0, 1.0],
        4 => [1.0, 1.0],
        5 => [1.0, 0.0],
        6 => [0.0, -1.0],
        7 => [-1.0, 0.0],
        8 => [0.0, 1.0],
        _ => [0.0, 0.0],
    }
}

/// Where a line through a point meets a circle.
fn line_circle(at: Vector, along: Vector, center: Vector, radius: f64) -> Option<[Vector; 2]> {
    let foot = plus(at, along, dot(minus(center, at), along));
    let off = length(minus(foot, center));
    let half = ((radius - off) * (radius + off)).max(-SAME_POINT_MM);
    let half = (half >= -SAME_POINT_MM && off <= radius + SAME_POINT_MM).then(|| half.max(0.0))?;
    Some([plus(foot, along, half.sqrt()), plus(foot, along, -half.sqrt())])
}

/// Where two circles meet.
fn circles(a: Vector, radius_a: f64, b: Vector, radius_b: f64) -> Option<[Vector; 2]> {
    let way = minus(b, a);
    let apart = length(way);
    if apart < SAME_POINT_MM {
        return None;
    }
    let along = way.map(|part| part / apart);
    let share = (apart + (radius_a - radius_b) * (radius_a + radius_b) / apart) / 2.0;
    let square = (radius_a - share) * (radius_a + share);
    if square < -SAME_POINT_MM * radius_a {
        return None;
    }
    let (foot, half) = (plus(a, along, share), square.max(0.0).sqrt());
    let across = [-along[1], along[0]];
    Some([plus(foot, across, half), plus(foot, across, -half)])
}

/// Whether two positions are one, on all axes.
fn is_same(a: &Point, b: &Point) -> bool {
    a.0.iter().zip(&b.0).all(|(a, b)| (a - b).abs() < SAME_POINT_MM)
}

fn plus(at: Vector, along: Vector, by: f64) -> Vector {
    [at[0] + along[0] * by, at[1] + along[1] * by]
}

fn minus(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1]]
}

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn cross(a: Vector, b: Vector) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

fn length(a: Vector) -> f64 {
    libm::hypot(a[0], a[1])
}

/// From one direction to another, counter-clockwise.
fn angle(from: Vector, to: Vector) -> f64 {
    libm::atan2(cross(from, to), dot(from, to))
}
