//! Segment → Edge: the path in X, Y and Z as straight pieces. A line is one; of an arc or helix,
//! chords are taken from the closed form that lie nearer to it than is ever asked for. A spline is
//! halved until its control points lie as near to their chord, and in order along it: then so does
//! the curve, and the chord can be walked beside it. Its length is not asked for. Events are put
//! aside as they are passed.

use std::collections::VecDeque;
use std::rc::Rc;

use super::events::Due;
use super::{Cause, OTHER_AXES, Others, Setup, VerifyError};
use crate::base::spline::Bezier;
use crate::base::{Axis, AxisMap, Machine, Point};
use crate::path::{Corner, Curve, PathItem, Segment};

/// A place or way in X, Y, Z.
pub type Vector = [f64; 3];

pub fn difference(to: Vector, from: Vector) -> Vector {
    std::array::from_fn(|axis| to[axis] - from[axis])
}

pub fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// A straight piece of the path.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    pub from: Vector,
    pub to: Vector,
    /// NC line, and how many times it has been another than before.
    pub line: u32,
    pub run: u64,
    /// Feed of X, Y and Z; infinite on rapids, 0 where other axes lead, so that these rest.
    pub feed_mm_s: f64,
    /// Length of the path up to its start.
    pub start_mm: f64,
    pub length_mm: f64,
    /// Where the other axes are at both ends.
    pub others: [Others; 2],
    /// Feeds of A B C, and of U V W: its own where it is along these; 0 where they rest, and infinite where
    /// others lead them.
    pub others_feeds: [f64; 2],
    /// How much further off than elsewhere it may be passed, and its end: where G64 P lets a corner
    /// be cut by more than the machine's path tolerance.
    pub slack_mm: f64,
    pub end_slack_mm: f64,
}

/// What is left of a segment.
#[derive(Debug)]
struct Cut {
    segment: Rc<Segment>,
    rest: Rest,
}

#[derive(Debug)]
enum Rest {
    /// Into how many chords it is cut, and how many have been given.
    Chords { count: u64, given: u64 },
    /// The pieces of a spline, the next one last.
    Pieces(Vec<Bezier>),
}

/// The edges of a path, read as they are asked for.
pub struct Edges<'a, P: Iterator> {
    path: std::iter::Fuse<P>,
    machine: &'a Machine,
    linear: [Option<Axis>; 3],
    sagitta_mm: f64,
    /// The slack of the corner at the end of the segment before.
    corner_slack_mm: f64,
    /// The segment that is being cut.
    current: Option<Cut>,
    at: Vector,
    others: Others,
    length_mm: f64,
    line: u32,
    run: u64,
    any: bool,
    /// Where the path stands, events included, at the end of what has been read.
    read_mm: Option<Point>,
    start_steps: AxisMap<i64>,
    /// Events that have been passed and not been taken out.
    pub passed: VecDeque<Due>,
    /// Whether a spline has been read that has corners of its own.
    pub has_inner_corners: bool,
}

impl<'a, P, E> Edges<'a, P>
where
    P: Iterator<Item = Result<PathItem, E>>,
    E: Into<Cause>,
{
    /// `start` is where the path stands if it has no segment at all.
    pub fn new(path: P, setup: &Setup<'a>, start: Vector, sagitta_mm: f64) -> Self {
        Edges {
            path: path.fuse(),
            machine: setup.machine,
            linear: linear_axes(setup.machine),
            sagitta_mm,
            corner_slack_mm: 0.0,
            current: None,
            at: start,
            others: Others::default(),
            length_mm: 0.0,
            line: 0,
            run: 0,
            any: false,
            read_mm: None,
            start_steps: setup.start_steps,
            passed: VecDeque::new(),
            has_inner_corners: false,
        }
    }

    /// The next edge; a path without segments is one edge without length.
    ///
    /// # Errors
    /// Those of the path.
    pub fn next(&mut self) -> Result<Option<Edge>, VerifyError> {
        while self.current.is_none() {
            let Some(segment) = self.next_segment()? else {
                let is_first = !std::mem::replace(&mut self.any, true);
                let nowhere = (self.at, self.others);
                return Ok(is_first.then(|| self.edge_to(nowhere, 0, f64::INFINITY, [0.0; 2])));
            };
            if !self.any {
                self.at = vector(&segment.from_mm, &self.linear);
                self.others = others(&segment.from_mm);
                self.any = true;
            }
            let rest = match &segment.curve {
                Curve::Spline(spline) => {
                    self.has_inner_corners |= has_corners(spline.pieces());
                    Rest::Pieces(spline.pieces().iter().rev().copied().collect())
                }
                _ => Rest::Chords { count: chords(&segment, self.sagitta_mm), given: 0 },
            };
            self.current = Some(Cut { segment, rest });
        }
        let Some(mut cut) = self.current.take() else { return Ok(None) };
        let (line, feed) = (cut.segment.line, cut.segment.feed_mm_s.unwrap_or(f64::INFINITY));
        let leading = match cut.segment.curve {
            Curve::Line => cut.segment.from_mm.feed_way(&cut.segment.to_mm).1,
            Curve::Arc(_) | Curve::Spline(_) => Axis::LINEAR,
        };
        let (to, is_last) = cut.next(self.sagitta_mm);
        let end_slack_mm = self.slack_mm(&cut.segment);
        let start_slack_mm = match cut.segment.corner {
            Corner::Blend { .. } if feed.is_finite() => self.corner_slack_mm,
            Corner::Blend { .. } | Corner::Exact | Corner::Stop => 0.0,
        };
        let slack_mm = start_slack_mm.max(end_slack_mm);
        let mut slacks_mm = [slack_mm; 2];
        if is_last {
            self.corner_slack_mm = end_slack_mm;
            slacks_mm[1] = end_slack_mm;
        } else {
            self.current = Some(cut);
        }
        let to = (vector(&to, &self.linear), others(&to));
        let feed_mm_s = if leading == Axis::LINEAR { feed } else { 0.0 };
        let mut edge = self.edge_to(to, line, feed_mm_s, slacks_mm);
        edge.others_feeds = others_feeds(edge.others, leading, feed);
        Ok(Some(edge))
    }

    /// By how much more than the path tolerance the corner at the end of a segment may be cut.
    fn slack_mm(&self, segment: &Segment) -> f64 {
        match segment.corner {
            Corner::Blend { tolerance_mm: Some(mm), .. } if segment.feed_mm_s.is_some() => {
                (mm - self.machine.path_tolerance_mm).max(0.0)
            }
            Corner::Blend { .. } | Corner::Exact | Corner::Stop => 0.0,
        }
    }

    /// Passes all up to the next event; false if there is none. What is passed is no edge any more.
    ///
    /// # Errors
    /// Those of the path.
    pub fn pass_to_event(&mut self) -> Result<bool, VerifyError> {
        let before = self.passed.len();
        while self.passed.len() == before {
            let Some(item) = self.path.next() else { return Ok(false) };
            self.take(item)?;
        }
        Ok(true)
    }

    /// Where the path stands at the end of what has been read, to the nearest step.
    pub fn at_steps(&self) -> AxisMap<i64> {
        self.read_mm.as_ref().map_or(self.start_steps, |at| self.machine.nearest_steps(at))
    }

    fn next_segment(&mut self) -> Result<Option<Rc<Segment>>, VerifyError> {
        while let Some(item) = self.path.next() {
            if let Some(segment) = self.take(item)? {
                return Ok(Some(segment));
            }
        }
        Ok(None)
    }

    fn take(&mut self, item: Result<PathItem, E>) -> Result<Option<Rc<Segment>>, VerifyError> {
        match item.map_err(|error| VerifyError::Path(error.into()))? {
            PathItem::Event(event) => {
                self.corner_slack_mm = 0.0;
                let at_steps = self.at_steps();
                self.passed.push_back(Due { event, at_steps });
                Ok(None)
            }
            PathItem::Segment(segment) => {
                self.read_mm = Some(segment.to_mm);
                Ok(Some(segment))
            }
        }
    }

    fn edge_to(
        &mut self,
        (to, others): (Vector, Others),
        line: u32,
        feed_mm_s: f64,
        [slack_mm, end_slack_mm]: [f64; 2],
    ) -> Edge {
        let (from, start_mm) = (self.at, self.length_mm);
        let way = difference(to, from);
        let length_mm = dot(way, way).sqrt();
        self.at = to;
        self.length_mm += length_mm;
        let others = [std::mem::replace(&mut self.others, others), others];
        if std::mem::replace(&mut self.line, line) != line {
            self.run += 1;
        }
        Edge {
            from,
            to,
            line,
            run: self.run,
            feed_mm_s,
            start_mm,
            length_mm,
            others,
            others_feeds: [0.0; 2],
            slack_mm,
            end_slack_mm,
        }
    }
}

/// A, B, C, U, V and W of a point.
fn others(point: &Point) -> Others {
    OTHER_AXES.map(|axis| point[axis])
}

/// See [`Edge::others_feeds`], of an edge along these axes.
fn others_feeds([from, to]: [Others; 2], leading: [Axis; 3], feed: f64) -> [f64; 2] {
    [0, 3].map(|first| {
        let range = first..first + 3;
        if from[range.clone()] == to[range] {
            0.0
        } else if leading[0] == OTHER_AXES[first] {
            feed
        } else {
            f64::INFINITY
        }
    })
}

impl Cut {
    /// The end of the next edge, and whether it is the last.
    fn next(&mut self, sagitta_mm: f64) -> (Point, bool) {
        match &mut self.rest {
            Rest::Chords { count, given } => {
                *given += 1;
                (self.segment.point_at(*given as f64 / *count as f64), given == count)
            }
            Rest::Pieces(pieces) => {
                let mut to = self.segment.to_mm;
                if let Some(piece) = next_flat(pieces, sagitta_mm).filter(|_| !pieces.is_empty()) {
                    Axis::LINEAR.into_iter().zip(piece.end()).for_each(|(axis, at)| to[axis] = at);
                }
                (to, pieces.is_empty())
            }
        }
    }
}

/// Whether the direction changes between two pieces of a spline, by more than 1e-4 rad: that moves no
/// chord of 20 ticks by a step.
fn has_corners(pieces: &[Bezier]) -> bool {
    pieces.windows(2).any(|pair| {
        let [before, after] = [pair[0].jet(1.0).first, pair[1].jet(0.0).first];
        let lengths = (dot(before, before) * dot(after, after)).sqrt();
        dot(before, after) <= (1.0 - 0.5e-8) * lengths
    })
}

/// Takes the next piece, halved until it is flat.
fn next_flat(pieces: &mut Vec<Bezier>, sagitta_mm: f64) -> Option<Bezier> {
    let mut piece = pieces.pop()?;
    while !is_flat(&piece, sagitta_mm) {
        let [first, second] = piece.halves();
        pieces.push(second);
        piece = first;
    }
    Some(piece)
}

/// Whether the chord of a piece can be walked beside it within a distance: its control points lie
/// as near to the chord, and none of them further back along it than the one before. Then no point
/// of the curve goes back either, for its weights on the points only move on. A piece may also be
/// as small as that distance as a whole.
fn is_flat(piece: &Bezier, sagitta_mm: f64) -> bool {
    let from = piece.start();
    let chord = difference(piece.end(), from);
    let square = dot(chord, chord);
    let limit_sq = sagitta_mm * sagitta_mm;
    let is_small = |point| {
        let off = difference(point, from);
        dot(off, off) <= limit_sq / 4.0
    };
    if piece.hull().all(is_small) {
        return true;
    }
    let mut along = 0.0;
    square > 0.0
        && piece.hull().all(|point| {
            let off = difference(point, from);
            let share = dot(off, chord) / square;
            let across: Vector = std::array::from_fn(|i| off[i] - share * chord[i]);
            let goes_on = share >= along && share <= 1.0;
            along = share;
            goes_on && dot(across, across) <= limit_sq
        })
}

/// X, Y and Z as far as the machine has them.
pub fn linear_axes(machine: &Machine) -> [Option<Axis>; 3] {
    Axis::LINEAR.map(|axis| machine.axis(axis).map(|_| axis))
}

/// X, Y and Z of a point; zero where the machine lacks the axis.
pub fn vector(point: &Point, linear: &[Option<Axis>; 3]) -> Vector {
    linear.map(|axis| axis.map_or(0.0, |axis| point[axis]))
}

/// How many chords keep a segment within a sagitta: a chord over the angle d lies r·d²/8 from its
/// arc at most; where the radius changes with the angle, by r' a radian, |2·r'| adds to r.
fn chords(segment: &Segment, sagitta_mm: f64) -> u64 {
    let Curve::Arc(arc) = &segment.curve else { return 1 };
    let sweep = arc.sweep_rad.abs();
    let inward = (arc.radius_to_mm - arc.radius_from_mm).abs();
    let bend_mm = arc.radius_max_mm() + if sweep > 0.0 { 2.0 * inward / sweep } else { 0.0 };
    // At least 8 a turn, however small the arc.
    let angle_rad = (8.0 * sagitta_mm / bend_mm).sqrt().min(std::f64::consts::FRAC_PI_4);
    ((sweep / angle_rad).ceil() as u64).max(1)
}
