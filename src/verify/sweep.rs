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

use super::Others;
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
    /// Corners of rows that were dropped, if they are kept.
    corners: Option<VecDeque<Corner>>,
    /// Ends of the executed chord that was walked last.
    from: Vector,
    at: Vector,
    /// Line of the furthest path edge that the least living distance has reached.
    front_line: u32,
    /// Greatest feed of the edges that the executed chord can be walked beside, and of the other axes.
    feed_mm_s: f64,
    others_feeds: [f64; 2],
    /// No distance below this suffices: how near rows that have been passed, and tick points, came
    /// at best, less their slack.
    low_mm: f64,
    low: Death,
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

/// A corner of the path that was passed, or its end.
#[derive(Clone, Copy, Debug)]
pub struct Corner {
    /// The runs that end and begin there.
    pub runs: [u64; 2],
    /// How near executed chords came to it, and in which tick.
    pub distance_mm: f64,
    pub tick: u64,
}

/// A point of the path that a tick point was matched with.
#[derive(Clone, Copy, Debug)]
pub struct Match {
    /// Length of the path up to there.
    pub along_mm: f64,
    /// Distance between the two points.
    pub distance_mm: f64,
    /// How much further off than elsewhere the path may be passed there.
    pub slack_mm: f64,
    /// A distance with which the executed chord can be walked beside the path from the match
    /// before to this one; infinite where this one lies before it.
    pub walk_mm: f64,
    /// NC line of the path there, and its run.
    pub line: u32,
    pub run: u64,
    /// Greatest feed of whatever part of the path the tick may have run on; infinite on rapids.
    pub feed_mm_s: f64,
}

#[derive(Debug)]
struct Row<const N: usize> {
    edge: Edge,
    chord: Chord,
    reach: Reach<N>,
    /// Square of how near executed chords came to its end, and in which tick.
    near_sq: f64,
    near_tick: u64,
    /// Where on its line the last executed point is nearest to it.
    share: f64,
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
    /// Square of the distance from the piece itself, not its line.
    fn distance_sq(&self) -> f64 {
        let beyond = (self.share - self.share.clamp(0.0, 1.0)).powi(2);
        if beyond == 0.0 {
            self.distance_sq
        } else {
            self.distance_sq + beyond / self.inverse_length_sq
        }
    }

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
            corners: None,
            from: start,
            at: start,
            front_line: first.line,
            feed_mm_s: first.feed_mm_s,
            others_feeds: first.others_feeds,
            low_mm: 0.0,
            low: Death::default(),
            work: 0,
        };
        let mut row = Row::new(first);
        let near = row.chord.near(start);
        let apart = difference(start, first.from);
        sweep.hold(dot(apart, apart).sqrt(), Death { tick: 0, line: first.line });
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
        self.prune();
        let step = Chord::new(self.at, to);
        let mut below = Reach::EMPTY;
        let (mut least, mut line) = (N, self.front_line);
        let (mut index, mut feed_mm_s, mut others_feeds) = (0, 0.0_f64, [0.0_f64; 2]);
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
            feed_mm_s = feed_mm_s.max(row.edge.feed_mm_s);
            for (most, feed) in others_feeds.iter_mut().zip(row.edge.others_feeds) {
                *most = most.max(feed);
            }
            let beside = row.chord.near(to);
            row.share = beside.share;
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
            if !below.is_empty() && above.distance_sq() < row.near_sq {
                (row.near_sq, row.near_tick) = (above.distance_sq(), tick);
            }
            if let Some(level) = row.reach.least(self.dead).filter(|level| *level <= least) {
                (least, line) = (level, row.edge.line);
            }
        }
        (self.from, self.at) = (self.at, to);
        (self.feed_mm_s, self.others_feeds) = (feed_mm_s, others_feeds);
        self.bury(least, tick);
        self.front_line = line;
        Ok(())
    }

    /// Drops rows that can no longer be reached.
    fn prune(&mut self) {
        while self.rows.len() > 1 && self.rows[0].reach.is_empty() {
            let Some(row) = self.rows.pop_front() else { return };
            let near_mm = row.near_sq.sqrt() - row.edge.end_slack_mm;
            self.hold(near_mm, Death { tick: row.near_tick, line: row.edge.line });
            self.keep_corner(&row);
        }
    }

    fn keep_corner(&mut self, row: &Row<N>) {
        let Some(corners) = self.corners.as_mut().filter(|_| row.near_sq.is_finite()) else {
            return;
        };
        let next = self.rows.front().map_or(row.edge.run, |next| next.edge.run);
        let (runs, distance_mm) = ([row.edge.run, next], row.near_sq.sqrt());
        corners.push_back(Corner { runs, distance_mm, tick: row.near_tick });
    }

    /// From now on corners are kept until they are asked for.
    pub fn keep_corners(&mut self) {
        self.corners = Some(VecDeque::new());
    }

    /// The next corner that was dropped.
    pub fn passed_corner(&mut self) -> Option<Corner> {
        self.corners.as_mut()?.pop_front()
    }

    /// The walk is over.
    pub fn drop_all(&mut self) {
        while let Some(row) = self.rows.pop_front() {
            self.keep_corner(&row);
        }
    }

    /// The run of the first edge that has not been dropped.
    pub fn first_run(&self) -> u64 {
        self.rows.front().map_or(u64::MAX, |row| row.edge.run)
    }

    /// The furthest run that each living distance has reached.
    pub fn fronts(&self, runs: &mut [u64; N]) {
        for Row { reach, edge, .. } in &self.rows {
            let ends = reach.from.iter().zip(&reach.to).zip(runs.iter_mut());
            for (_, run) in ends.skip(self.dead).filter(|((from, to), _)| from <= to) {
                *run = edge.run;
            }
        }
    }

    /// Lets dead distances go on from what the least living one reaches, as far as the executed point is as
    /// near to that.
    pub fn revive(&mut self) {
        let least = self.dead;
        if least == 0 || least == N {
            return;
        }
        for Row { edge, chord, reach, .. } in &mut self.rows {
            if reach.from[least] > reach.to[least] {
                continue;
            }
            let near = chord.near(self.at);
            for level in 0..least {
                let (from, to) = near.within((self.distances_mm[level] + edge.slack_mm).powi(2));
                let (from, to) = (from.max(reach.from[least]), to.min(reach.to[least]));
                if from <= to {
                    (reach.from[level], reach.to[level]) = (from, to);
                    self.dead = self.dead.min(level);
                }
            }
        }
    }

    /// No distance below this one suffices.
    fn hold(&mut self, distance_mm: f64, at: Death) {
        if distance_mm > self.low_mm {
            (self.low_mm, self.low) = (distance_mm, at);
        }
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
        let arrived = |level: usize| {
            last.is_some_and(|Row { reach, .. }| {
                reach.from[level] <= reach.to[level] && reach.to[level] >= 1.0
            })
        };
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

    /// A distance below which none suffices, as far as is known by now, and where that is so. For
    /// every executed point has a partner within its reach, and so has every end of an edge.
    pub fn low(&self) -> (f64, Death) {
        (self.low_mm, self.low)
    }

    /// The point of the path that is nearest to the executed point among those within reach with
    /// the greatest distance, if possible not before `past_mm` along the path. Among equally near
    /// ones the first, so that a retraced stretch is matched in its order.
    pub fn nearest(&mut self, tick: u64, past_mm: f64) -> Option<Match> {
        // What rounding may take off a length of metres.
        const ROUNDING_MM: f64 = 1e-9;
        let mut best: Option<(bool, f64, f64, &Edge)> = None;
        let mut least_mm = f64::INFINITY;
        for row in self.rows.iter().filter(|row| !row.reach.is_empty()) {
            let share = row.share.clamp(row.reach.from[N - 1], row.reach.to[N - 1]);
            let along = row.edge.start_mm + share * row.edge.length_mm;
            let point: Vector =
                std::array::from_fn(|axis| row.edge.from[axis] + share * row.chord.way[axis]);
            let offset = difference(self.at, point);
            let distance = dot(offset, offset).sqrt();
            least_mm = least_mm.min(distance - row.edge.slack_mm);
            let back = along < past_mm - ROUNDING_MM;
            let better = best.is_none_or(|(was_back, was, ..)| {
                (back, distance + if back == was_back { ROUNDING_MM } else { 0.0 })
                    < (was_back, was)
            });
            if better {
                best = Some((back, distance, along, &row.edge));
            }
        }
        let (is_back, distance_mm, along_mm, edge) = best?;
        let Edge { line, run, slack_mm, .. } = *edge;
        self.hold(least_mm, Death { tick, line });
        let walk_mm = self.passed(past_mm, along_mm).max(distance_mm - slack_mm);
        let walk_mm = if is_back { f64::INFINITY } else { walk_mm };
        let feed_mm_s = self.feed_mm_s;
        Some(Match { along_mm, distance_mm, slack_mm, walk_mm, line, run, feed_mm_s })
    }

    /// Between two places along the path: the greatest distance of its corners from the executed
    /// chord, less their slack, in their order.
    fn passed(&self, past_mm: f64, along_mm: f64) -> f64 {
        let step = Chord::new(self.from, self.at);
        let (mut share, mut walk_mm) = (0.0_f64, 0.0_f64);
        let ends = self.rows.iter().map(|row| &row.edge).filter(|edge| {
            let end_mm = edge.start_mm + edge.length_mm;
            past_mm <= end_mm && end_mm <= along_mm
        });
        for edge in ends {
            share = share.max(step.near(edge.to).share.clamp(0.0, 1.0));
            let off: Vector = std::array::from_fn(|axis| {
                edge.to[axis] - step.from[axis] - share * step.way[axis]
            });
            walk_mm = walk_mm.max(dot(off, off).sqrt() - edge.end_slack_mm);
        }
        walk_mm
    }

    /// The distance of the rest of the path from the last executed point, once that has ended.
    pub fn rest(&mut self, tick: u64, past_mm: f64) -> f64 {
        let (mut rest_mm, mut last) = (0.0_f64, None);
        for Row { edge, .. } in &self.rows {
            let off = difference(self.at, edge.to);
            let off_mm = dot(off, off).sqrt();
            last = Some((off_mm - edge.slack_mm, edge.line));
            if edge.start_mm + edge.length_mm >= past_mm {
                rest_mm = rest_mm.max(off_mm - edge.end_slack_mm);
            }
        }
        if let Some((distance_mm, line)) = last {
            self.hold(distance_mm, Death { tick, line });
        }
        rest_mm
    }

    /// The greatest feeds of A B C and of U V W on the part of the path in reach: see
    /// [`Edge::others_feeds`].
    pub fn others_feeds(&self) -> [f64; 2] {
        self.others_feeds
    }

    /// Between which positions each of the other axes may be, by the part of the path in reach.
    pub fn others(&self) -> [Others; 2] {
        let mut range = [[f64::INFINITY; 6], [f64::NEG_INFINITY; 6]];
        for row in self.rows.iter().filter(|row| !row.reach.is_empty()) {
            let [from, to] = row.edge.others;
            for share in [row.reach.from[N - 1], row.reach.to[N - 1]] {
                for axis in 0..from.len() {
                    let at = from[axis] + share * (to[axis] - from[axis]);
                    range[0][axis] = range[0][axis].min(at);
                    range[1][axis] = range[1][axis].max(at);
                }
            }
        }
        range
    }

    fn bury(&mut self, least: usize, tick: u64) {
        let death = Death { tick, line: self.front_line };
        self.deaths[self.dead.min(least)..least].fill(death);
        self.dead = self.dead.max(least);
    }
}

impl<const N: usize> Row<N> {
    fn new(edge: Edge) -> Self {
        let chord = Chord::new(edge.from, edge.to);
        let (near_sq, near_tick, share) = (f64::INFINITY, 0, 0.5);
        Row { edge, chord, reach: Reach::EMPTY, near_sq, near_tick, share }
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
