//! A contour of a lathe as lines and arcs in a plane, and its offset.
//!
//! Points are complex numbers in effect: the first part lies along the cuts, the second across
//! them. All lengths are in program units, for so are the thresholds of RS274/NGC's cycles, whose
//! paths these reproduce.

/// A point or a way: along, across.
pub(super) type Vector = [f64; 2];

/// Pieces shorter than this vanish.
const SHORT: f64 = 1e-3;

/// Ends nearer than this are one point.
const SAME: f64 = 1e-6;

/// The sine of the angle between lines that are parallel.
const PARALLEL: f64 = 1e-9;

/// A gap along the cuts that is wider than this gets an arc.
const GAP: f64 = 1e-2;

/// A line or an arc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    pub start: Vector,
    pub end: Vector,
    pub round: Option<Round>,
    /// A corner that is still a point.
    pub corner: Option<Finish>,
}

/// What becomes of a corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Finish {
    /// An arc of this radius (A).
    Fillet(f64),
    /// A line between the ends of such an arc (C).
    Chamfer(f64),
}

/// What makes a piece an arc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Round {
    pub center: Vector,
    pub ccw: bool,
}

/// A change of axes: what each new axis is of the old ones, by signs.
pub(super) type Turning = [Vector; 2];

/// Along and across change their places, so that both still follow each other the same way round.
pub(super) const QUARTER: Turning = [[0.0, 1.0], [-1.0, 0.0]];

pub(super) fn plus(a: Vector, b: Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1]]
}

pub(super) fn minus(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1]]
}

fn times(a: Vector, by: f64) -> Vector {
    [a[0] * by, a[1] * by]
}

fn middle(a: Vector, b: Vector) -> Vector {
    times(plus(a, b), 0.5)
}

pub(super) fn length(a: Vector) -> f64 {
    libm::hypot(a[0], a[1])
}

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn cross(a: Vector, b: Vector) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// A quarter turn to the left.
fn left(a: Vector) -> Vector {
    [-a[1], a[0]]
}

/// A point on the new axes.
pub(super) fn turned(turning: &Turning, point: Vector) -> Vector {
    turning.map(|row| dot(row, point))
}

/// Whether a change of axes is a mirror.
pub(super) fn mirrors(turning: &Turning) -> bool {
    cross(turning[0], turning[1]) < 0.0
}

/// The way back: such changes are orthogonal.
pub(super) fn undone(turning: &Turning) -> Turning {
    [[turning[0][0], turning[1][0]], [turning[0][1], turning[1][1]]]
}

/// One change after the other.
pub(super) fn after(second: &Turning, first: &Turning) -> Turning {
    let columns = undone(first);
    second.map(|row| columns.map(|column| dot(row, column)))
}

impl Piece {
    pub fn line(start: Vector, end: Vector) -> Piece {
        Piece { start, end, round: None, corner: None }
    }

    pub fn turn(&mut self, turning: &Turning) {
        self.start = turned(turning, self.start);
        self.end = turned(turning, self.end);
        if let Some(round) = &mut self.round {
            round.center = turned(turning, round.center);
            round.ccw ^= mirrors(turning);
        }
    }

    pub fn shift(&mut self, by: Vector) {
        self.start = plus(self.start, by);
        self.end = plus(self.end, by);
        if let Some(round) = &mut self.round {
            round.center = plus(round.center, by);
        }
    }

    /// A corner at a point.
    pub fn corner(at: Vector, finish: Finish) -> Piece {
        Piece { start: at, end: at, round: None, corner: Some(finish) }
    }

    /// How far the piece can be moved aside before it may vanish, times two.
    fn room(&self) -> f64 {
        let chord = length(minus(self.start, self.end));
        self.round.map_or(chord, |round| chord.min(length(minus(self.start, round.center))))
    }

    /// Whether it never goes back along the cuts, and an arc not through its side of a circle.
    pub fn is_monotonic(&self) -> bool {
        let along = self.end[0] - self.start[0];
        let Some(round) = self.round else { return along <= SHORT };
        let sign = if round.ccw { 1.0 } else { -1.0 };
        let above = |point: Vector| sign * (point[1] - round.center[1]) >= -SHORT;
        above(self.start) && above(self.end) && along <= -SHORT
    }

    /// Moves the piece aside, to the right of its way.
    fn offset(&mut self, by: f64) {
        match self.round {
            None => {
                let way = minus(self.start, self.end);
                let aside = times(left(way), by / length(way));
                self.start = plus(self.start, aside);
                self.end = plus(self.end, aside);
            }
            Some(Round { center, ccw }) => {
                let radius = length(minus(self.start, center));
                let factor = (radius + if ccw { by } else { -by }) / radius;
                for point in [&mut self.start, &mut self.end] {
                    *point = plus(center, times(minus(*point, center), factor));
                }
            }
        }
    }

    /// Where a level across meets the piece, in the order of a circle's far and near side.
    pub fn meets_level(&self, across: f64) -> Vec<f64> {
        let (start, end) = (self.start, self.end);
        let Some(Round { center, .. }) = self.round else {
            if start[1].min(end[1]) > across + SAME || start[1].max(end[1]) < across - SAME {
                return Vec::new();
            }
            if (start[1] - end[1]).abs() < SAME {
                return vec![start[0], end[0]];
            }
            let share = (across - start[1]) / (end[1] - start[1]);
            return vec![start[0] + share * (end[0] - start[0])];
        };
        let radius = length(minus(start, center));
        let height = across - center[1];
        let square = (radius - height) * (radius + height);
        if square < -SAME {
            return Vec::new();
        }
        let half = square.max(0.0).sqrt();
        let ends = [center[0] + half, center[0] - half];
        ends.into_iter().filter(|along| self.covers([*along, across])).collect()
    }

    /// Whether an arc's sweep reaches a point of its circle.
    fn covers(&self, point: Vector) -> bool {
        let Some(Round { center, ccw }) = self.round else { return false };
        let sign = if ccw { 1.0 } else { -1.0 };
        let side = |from: Vector| sign * cross(minus(from, center), minus(point, center));
        side(self.start) >= -SAME && side(self.end) <= SAME
    }
}

/// Joins two pieces that follow each other where they meet; none if they never do.
fn join(first: &mut Piece, second: &mut Piece) -> Option<()> {
    let meeting = match (first.round, second.round) {
        (None, None) => {
            let (a, b) = (minus(first.end, first.start), minus(second.end, second.start));
            let across = cross(a, b);
            if across.abs() <= PARALLEL * length(a) * length(b) {
                return is_joined(first, second);
            }
            let share = cross(minus(second.start, first.start), b) / across;
            plus(first.start, times(a, share))
        }
        _ if first.round.is_some() != second.round.is_some() => {
            if length(minus(second.start, first.end)) < SAME {
                return Some(());
            }
            let (line, round, on) = match first.round {
                Some(round) => (&*second, round, first.end),
                None => (&*first, second.round?, second.end),
            };
            let way = minus(line.start, line.end);
            let way = times(way, length(way).recip());
            let foot = plus(line.end, times(way, dot(minus(round.center, line.end), way)));
            let off = length(minus(round.center, foot));
            let radius = length(minus(round.center, on));
            let half = ((radius - off) * (radius + off)).max(0.0).sqrt();
            let ends = [plus(foot, times(way, half)), plus(foot, times(way, -half))];
            let far = |point: Vector| length(minus(second.start, point));
            if far(ends[0]) < far(ends[1]) { ends[0] } else { ends[1] }
        }
        _ => {
            let (a, b) = (first.round?, second.round?);
            let (radius_a, radius_b) =
                (length(minus(first.start, a.center)), length(minus(second.start, b.center)));
            let apart = minus(a.center, b.center);
            let distance = length(apart);
            let cos = (distance * distance + radius_b * radius_b - radius_a * radius_a)
                / (2.0 * distance * radius_b);
            let sin = (1.0 - cos * cos).max(0.0).sqrt();
            let unit = times(apart, radius_b / distance);
            plus(b.center, plus(times(unit, cos), times(left(unit), sin)))
        }
    };
    if !meeting.iter().all(|part| part.is_finite()) {
        return is_joined(first, second);
    }
    (first.end, second.start) = (meeting, meeting);
    Some(())
}

/// Pieces that go on the same way meet where they are, or nowhere.
fn is_joined(first: &Piece, second: &Piece) -> Option<()> {
    (length(minus(second.start, first.end)) < SAME).then_some(())
}

pub(super) const NO_ROOM: &str = "it leaves no room for what is to be left on it";
const TOO_LONG: &str =
    "no end of its cuts is found: is it closed, or are passes or pieces too many?";

/// Pieces that a cycle may look at while it is worked out: a second's work.
const LOOKS_MAX: usize = 10_000_000;

/// How many pieces a cycle may still look at.
#[derive(Debug)]
pub(super) struct Budget(usize);

impl Budget {
    pub fn new() -> Budget {
        Budget(LOOKS_MAX)
    }

    /// Takes note of a look at so many pieces.
    pub fn spend(&mut self, pieces: usize) -> Result<(), &'static str> {
        // What is done for no piece takes its time too.
        self.0 = self.0.checked_sub(pieces + 1).ok_or(TOO_LONG)?;
        Ok(())
    }
}

/// Gives all corners their arcs and lines; none where there is no room for one.
pub(super) fn finish_corners(pieces: &mut Vec<Piece>) -> Option<()> {
    for at in 1..pieces.len().saturating_sub(1) {
        let (before, rest) = pieces.split_at_mut(at);
        let [corner, behind, ..] = rest else { return None };
        corner.finish(before.last_mut()?, behind)?;
    }
    pieces.retain(|piece| piece.room() >= SHORT);
    Some(())
}

impl Piece {
    /// Takes the place of the corner between two pieces, and shortens them for it.
    fn finish(&mut self, before: &mut Piece, behind: &mut Piece) -> Option<()> {
        let Some(Finish::Fillet(size) | Finish::Chamfer(size)) = self.corner else {
            return Some(());
        };
        for by in [size, -size] {
            let (mut first, mut second) = (*before, *behind);
            first.offset(by);
            second.offset(by);
            if first.end[0] - second.start[0] > GAP {
                continue;
            }
            join(&mut first, &mut second)?;
            let center = middle(first.end, second.start);
            first.offset(-by);
            second.offset(-by);
            (before.end, self.start) = (first.end, first.end);
            (behind.start, self.end) = (second.start, second.start);
            if matches!(self.corner, Some(Finish::Fillet(_))) {
                let ccw = self.start[1] > center[1] || self.end[1] > center[1];
                self.round = Some(Round { center, ccw });
            }
            self.corner = None;
            return Some(());
        }
        None
    }
}

/// Moves a contour aside by a distance, away from the side that its first piece comes from. That
/// first piece leads in: it only gets a new end. Fails where the contour leaves no room.
pub(super) fn offset(
    pieces: &mut Vec<Piece>,
    distance: f64,
    budget: &mut Budget,
) -> Result<(), &'static str> {
    let [lead, .., last] = pieces.as_slice() else { return Err(NO_ROOM) };
    let side = cross(minus(last.start, lead.start), minus(lead.end, lead.start));
    let distance = if side < 0.0 { -distance } else { distance };
    let mut lead = pieces.remove(0);
    let mut moved = 0.0_f64;
    while (distance - moved).abs() > 0.0 {
        budget.spend(pieces.len())?;
        let room = pieces.iter().map(Piece::room).fold(f64::INFINITY, f64::min) / 2.0;
        let by = room.min((distance - moved).abs()).copysign(distance);
        if pieces.is_empty() || moved + by == moved {
            return Err(NO_ROOM);
        }
        for piece in pieces.iter_mut() {
            piece.offset(by);
        }
        pieces.retain(|piece| piece.room() >= SHORT);
        fill_gaps(pieces, by, distance > 0.0);
        join_all(pieces, budget)?;
        moved += by;
    }
    for at in 1..pieces.len() {
        let point = middle(pieces[at - 1].end, pieces[at].start);
        (pieces[at - 1].end, pieces[at].start) = (point, point);
    }
    lead.end = pieces.first().ok_or(NO_ROOM)?.start;
    pieces.insert(0, lead);
    Ok(())
}

/// Goes round outside corners that a step aside has opened.
fn fill_gaps(pieces: &mut Vec<Piece>, by: f64, ccw: bool) {
    let mut at = 1;
    while at < pieces.len() {
        let (mut before, mut behind) = (pieces[at - 1], pieces[at]);
        if before.end[0] - behind.start[0] > GAP {
            let (start, end) = (before.end, behind.start);
            before.offset(-by);
            behind.offset(-by);
            let center = middle(before.end, behind.start);
            pieces.insert(
                at,
                Piece { round: Some(Round { center, ccw }), ..Piece::line(start, end) },
            );
            at += 1;
        }
        at += 1;
    }
}

/// Joins all pieces; those that have shrunk to nothing, or that go back, are left out.
fn join_all(pieces: &mut Vec<Piece>, budget: &mut Budget) -> Result<(), &'static str> {
    let mut at = 0;
    while at + 1 < pieces.len() {
        budget.spend(0)?;
        if !pieces[at].is_monotonic() {
            let before = at.checked_sub(1).ok_or(NO_ROOM)?;
            pieces.remove(if pieces[at].room() < pieces[before].room() { at } else { before });
            at = 0;
        }
        if pieces.len() < 2 {
            return Err(NO_ROOM);
        }
        if pieces[at].room() < SHORT {
            pieces.remove(at);
            at = 0;
        } else {
            let (first, second) = pieces.split_at_mut(at + 1);
            let ends = first.last_mut().zip(second.first_mut());
            ends.and_then(|(first, second)| join(first, second)).ok_or(NO_ROOM)?;
        }
        at += 1;
    }
    Ok(())
}
