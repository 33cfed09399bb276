//! Decides for a ladder of distances at once whether the executed polyline and the path can be
//! walked together, both only forward, never further apart than that distance: the decision
//! procedure for the Fréchet distance (Alt and Godau, 1995), in a moving window.
//!
//! ```text
//!   path edge  ┌────┬────┐   column i: the executed chord from tick point i to i + 1
//!      j + 1   │    │ ╱▓ │   row j: an edge of the path
//!              ├────┼▓▓──┤   ▓ pairs of points that are near enough; in one cell they are convex,
//!          j   │  ▓▓│▓   │     so what matters are the free intervals of the cell's borders
//!              └────┴────┘   reach: the part of a left border that a forward walk can get to
//!                i   i+1
//! ```
//!
//! A column needs the reach of the borders on its left only, and gives those on its right; rows
//! that can no longer be reached are dropped, rows are read when they can be reached. So memory is
//! that of the path within the greatest distance. A distance is out of the running ("dead") once
//! nothing is reachable with it. What a smaller distance reaches, a greater one does too.
//!
//! An edge, and the corner at its end, may have slack: there each distance is so much greater.

use std::collections::VecDeque;

use super::edges::{Edge, Vector, difference, dot};

/// Rows in the window at most: a path with more edges within a tolerance means nothing.
const ROWS_MAX: usize = 1 << 18;

/// See the module.
#[derive(Debug)]
pub struct Sweep<const N: usize> {
    distances_mm: [f64; N],
    /// Their squares.
    distances_sq: [f64; N],
    /// So many of the least distances are dead.
    dead: usize,
    deaths: [Death; N],
    rows: VecDeque<Row<N>>,
    at: Vector,
    /// Line of the furthest path edge that the least living distance has reached.
    front_line: u32,
    /// Greatest feed of the rows dropped since it was last asked for.
    dropped_feed_mm_s: f64,
    work: u64,
}

/// Where a distance was found too small.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Death {
    /// The tick whose chord cannot be walked.
    pub tick: u64,
    /// NC line of the furthest path edge reached.
    pub line: u32,
}

/// A point of the path that a tick point was matched with.
#[derive(Clone, Copy, Debug)]
pub struct Match {
    /// Length of the path up to there.
    pub along_mm: f64,
    /// Distance between the two points.
    pub distance_mm: f64,
    /// NC line of the path there.
    pub line: u32,
    /// Greatest feed of the path since the match before; infinite on rapids.
    pub feed_mm_s: f64,
    /// How much further off than elsewhere the path may be passed there.
    pub slack_mm: f64,
}

#[derive(Debug)]
struct Row<const N: usize> {
    edge: Edge,
    chord: Chord,
    reach: Reach<N>,
}

/// An interval on a border for each distance; empty ones begin at infinity.
#[derive(Clone, Copy, Debug)]
struct Reach<const N: usize> {
    from: [f64; N],
    to: [f64; N],
}

impl<const N: usize> Reach<N> {
    const EMPTY: Self = Reach { from: [f64::INFINITY; N], to: [f64::NEG_INFINITY; N] };

    /// Whether nothing is reached with the greatest distance, and so with none.
    fn is_empty(&self) -> bool {
        self.from[N - 1] > self.to[N - 1]
    }

    /// The least distance with which something is reached, from `dead` on.
    fn least(&self, dead: usize) -> Option<usize> {
        (dead..N).find(|level| self.from[*level] <= self.to[*level])
    }
}

/// A straight piece, ready to be asked which part of it lies near a point.
#[derive(Clone, Copy, Debug)]
struct Chord {
    from: Vector,
    way: Vector,
    /// Infinite where the piece is a point.
    inverse_length_sq: f64,
}

/// The nearest point of a chord's line to a point.
#[derive(Clone, Copy, Debug)]
struct Near {
    share: f64,
    distance_sq: f64,
    inverse_length_sq: f64,
}

impl Chord {
    fn new(from: Vector, to: Vector) -> Chord {
        let way = difference(to, from);
        Chord { from, way, inverse_length_sq: 1.0 / dot(way, way) }
    }

    fn near(&self, point: Vector) -> Near {
        let offset = difference(point, self.from);
        let inverse_length_sq = self.inverse_length_sq;
        if inverse_length_sq == f64::INFINITY {
            return Near { share: 0.5, distance_sq: dot(offset, offset), inverse_length_sq };
        }
        let share = dot(offset, self.way) * inverse_length_sq;
        let across = std::array::from_fn(|axis| offset[axis] - share * self.way[axis]);
        Near { share, distance_sq: dot(across, across), inverse_length_sq }
    }
}

impl Near {
    /// The part of the chord within a distance of the point, as shares of its length; from
    /// infinity where there is none.
    fn within(&self, distance_sq: f64) -> (f64, f64) {
        let half_sq = (distance_sq - self.distance_sq) * self.inverse_length_sq;
        // Without branches, so that several distances are taken at once.
        let half = half_sq.max(0.0).sqrt();
        let is_near = half_sq >= 0.0;
        let from = if is_near { (self.share - half).max(0.0) } else { f64::INFINITY };
        let to = if is_near { (self.share + half).min(1.0) } else { f64::NEG_INFINITY };
        (from, to)
    }
}

impl<const N: usize> Sweep<N> {
    /// Begins at the start of both: `distances_mm` ascend.
    pub fn new(distances_mm: [f64; N], start: Vector, first: Edge) -> Self {
        let mut sweep = Sweep {
            distances_mm,
            distances_sq: squares(&distances_mm, 0.0),
            dead: 0,
            deaths: [Death::default(); N],
            rows: VecDeque::new(),
            at: start,
            front_line: first.line,
            dropped_feed_mm_s: 0.0,
            work: 0,
        };
        let mut row = Row::new(first);
        let near = row.chord.near(start);
        for level in 0..N {
            // The start of the path is no corner.
            let (from, to) = near.within(sweep.distances_sq[level]);
            if from == 0.0 && from <= to {
                (row.reach.from[level], row.reach.to[level]) = (from, to);
            }
        }
        let least = row.reach.least(0).unwrap_or(N);
        sweep.rows.push_back(row);
        sweep.bury(least, 0);
        sweep
    }

    /// Walks one executed chord on; `more` gives the next edge of the path.
    ///
    /// # Errors
    /// Those of `more`.
    pub fn advance<E>(
        &mut self,
        tick: u64,
        to: Vector,
        mut more: impl FnMut() -> Result<Option<Edge>, E>,
    ) -> Result<(), E> {
        let step = Chord::new(self.at, to);
        let mut below = Reach::EMPTY;
        let (mut least, mut line) = (N, self.front_line);
        let mut index = 0;
        loop {
            if index == self.rows.len() {
                if below.is_empty() {
                    break;
                }
                match more()? {
                    Some(edge) => self.rows.push_back(Row::new(edge)),
                    None => break,
                }
            }
            let row = &mut self.rows[index];
            index += 1;
            if row.reach.is_empty() && below.is_empty() {
                continue;
            }
            self.work += (N - self.dead) as u64;
            let beside = row.chord.near(to);
            let above = step.near(row.edge.to);
            let edge = &row.edge;
            if edge.slack_mm == 0.0 {
                let squares = [&self.distances_sq; 2];
                cross(&mut row.reach, &mut below, [&beside, &above], squares, self.dead);
            } else {
                let slacks_mm = [edge.slack_mm, edge.end_slack_mm];
                let [side, end] = slacks_mm.map(|slack_mm| squares(&self.distances_mm, slack_mm));
                cross(&mut row.reach, &mut below, [&beside, &above], [&side, &end], self.dead);
            }
            if let Some(level) = row.reach.least(self.dead).filter(|level| *level <= least) {
                (least, line) = (level, row.edge.line);
            }
        }
        self.at = to;
        self.bury(least, tick);
        self.front_line = line;
        while self.rows.len() > 1 && self.rows[0].reach.is_empty() {
            let feed = self.rows.pop_front().map_or(0.0, |row| row.edge.feed_mm_s);
            self.dropped_feed_mm_s = self.dropped_feed_mm_s.max(feed);
        }
        Ok(())
    }

    /// Ends the walk: distances that have not reached the path's end die at the last tick.
    ///
    /// # Errors
    /// Those of `more`.
    pub fn finish<E>(
        &mut self,
        tick: u64,
        mut more: impl FnMut() -> Result<Option<Edge>, E>,
    ) -> Result<(), E> {
        let rest = more()?;
        let last = self.rows.back().filter(|_| rest.is_none());
        let arrived = |level: usize| last.is_some_and(|row| row.reach.to[level] >= 1.0);
        let least = (self.dead..N).find(|level| arrived(*level)).unwrap_or(N);
        self.bury(least, tick);
        Ok(())
    }

    /// How many of the least distances are dead.
    pub fn dead(&self) -> usize {
        self.dead
    }

    /// Where the distance of this index died, if it did.
    pub fn death(&self, level: usize) -> Option<Death> {
        (level < self.dead).then(|| self.deaths[level])
    }

    /// Cells times living distances so far: what the time goes with.
    pub fn work(&self) -> u64 {
        self.work
    }

    /// Whether the window has more rows than can mean anything.
    pub fn is_overfull(&self) -> bool {
        self.rows.len() > ROWS_MAX
    }

    /// The point of the path that is nearest to the executed point among those within reach with
    /// the greatest distance, if possible not before `past_mm` along the path. Among equally near
    /// ones the first, so that a retraced stretch is matched in its order.
    pub fn nearest(&mut self, past_mm: f64) -> Option<Match> {
        // What rounding may take off a length of metres.
        const ROUNDING_MM: f64 = 1e-9;
        let mut best: Option<(bool, f64, f64, &Edge)> = None;
        for row in self.rows.iter().filter(|row| !row.reach.is_empty()) {
            let share = row.chord.near(self.at).share;
            let share = share.clamp(row.reach.from[N - 1], row.reach.to[N - 1]);
            let along = row.edge.start_mm + share * row.edge.length_mm;
            let point: Vector =
                std::array::from_fn(|axis| row.edge.from[axis] + share * row.chord.way[axis]);
            let offset = difference(self.at, point);
            let distance = dot(offset, offset).sqrt();
            let back = along < past_mm - ROUNDING_MM;
            let better = best.is_none_or(|(was_back, was, ..)| {
                (back, distance + if back == was_back { ROUNDING_MM } else { 0.0 })
                    < (was_back, was)
            });
            if better {
                best = Some((back, distance, along, &row.edge));
            }
        }
        let (_, distance_mm, along_mm, edge) = best?;
        let (line, slack_mm) = (edge.line, edge.slack_mm);
        let passed =
            |edge: &Edge| edge.start_mm <= along_mm && edge.start_mm + edge.length_mm >= past_mm;
        let passed = self.rows.iter().map(|row| &row.edge).filter(|edge| passed(edge));
        // Where corners may be cut by more than the ways between them are long, the nearest point need
        // not be the one meant: any within reach may be.
        let is_meant = |row: &&Row<N>| row.edge.slack_mm > 0.0 && !row.reach.is_empty();
        let meant = self.rows.iter().filter(is_meant).map(|row| &row.edge);
        let feeds = passed.chain(meant).map(|edge| edge.feed_mm_s);
        let feed_mm_s = feeds.fold(self.dropped_feed_mm_s, f64::max);
        self.dropped_feed_mm_s = 0.0;
        Some(Match { along_mm, distance_mm, line, feed_mm_s, slack_mm })
    }

    fn bury(&mut self, least: usize, tick: u64) {
        let death = Death { tick, line: self.front_line };
        self.deaths[self.dead.min(least)..least].fill(death);
        self.dead = self.dead.max(least);
    }
}

impl<const N: usize> Row<N> {
    fn new(edge: Edge) -> Self {
        Row { edge, chord: Chord::new(edge.from, edge.to), reach: Reach::EMPTY }
    }
}

/// Squares of distances, each greater by a slack.
fn squares<const N: usize>(distances_mm: &[f64; N], slack_mm: f64) -> [f64; N] {
    distances_mm.map(|distance| (distance + slack_mm) * (distance + slack_mm))
}

/// Through one cell, for each living distance: from what is reached on its left and lower border
/// to what is reached on its right and upper one. From the left, all of the upper border's free
/// part can be got to, and of the right one what is not further back; from below likewise.
fn cross<const N: usize>(
    left: &mut Reach<N>,
    below: &mut Reach<N>,
    [beside, above]: [&Near; 2],
    [side_sq, end_sq]: [&[f64; N]; 2],
    dead: usize,
) {
    for level in dead..N {
        let from_left = left.from[level] <= left.to[level];
        let from_below = below.from[level] <= below.to[level];
        let (right_from, right_to) = beside.within(side_sq[level]);
        let (upper_from, upper_to) = above.within(end_sq[level]);
        let right_from = right_from.max(if from_below { 0.0 } else { left.from[level] });
        let upper_from = upper_from.max(if from_left { 0.0 } else { below.from[level] });
        left.from[level] = if right_from <= right_to { right_from } else { f64::INFINITY };
        left.to[level] = right_to;
        below.from[level] = if upper_from <= upper_to { upper_from } else { f64::INFINITY };
        below.to[level] = upper_to;
    }
}
