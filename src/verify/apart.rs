//! Two polylines → how far apart they are: their Fréchet distance, told between two bounds, however far
//! they lie apart and in nearly linear time.
//!
//! The window of a [`Sweep`] holds all that lies within the distance asked for. Where that is wide beside
//! the chords, it holds very many, so both polylines are thinned first, to what the question needs: of
//! points within t of the one kept last, none is kept (Driemel, Har-Peled and Wenk, 2012). Each polyline
//! is then off by t at most, and their distance by 2·t, which the bounds allow for. Where nothing was
//! thinned out, they are those of the polylines themselves.
//!
//! 1. Intervals [0, s], [s, 2·s], [2·s, 4·s] … until one holds the distance, s being the tolerance.
//! 2. That one by parts of itself, each time thinned less, to a thousandth.
//!
//! With t a 32nd of the interval, a path has some hundred chords in the window, if it does not fill the
//! room it lies in. Where it does, a pass is left when it has taken [`WORK_A_VERTEX`] for each point and
//! [`WORK_FREE`] besides, and the bounds found by then are told.

use super::Others;
use super::edges::{Edge, Vector, difference, dot};
use super::sweep::{Death, Sweep};

/// Distances that a pass decides at once.
const RUNGS: usize = 8;
/// What is thinned out, in parts of the step from one to the next.
const THINNED_SHARE: f64 = 0.25;
/// To which part of itself, or of the tolerance if that is more, the distance is told.
const RESOLUTION: f64 = 1e-3;
/// Cells times distances that a pass may take, whatever the polylines, and more for each point of the one:
/// what a straight way takes is a tenth of that.
const WORK_FREE: u64 = 1 << 24;
const WORK_A_VERTEX: u64 = 512;

/// A point of a polyline.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    pub at: Vector,
    /// The tick that ends here.
    pub tick: u64,
    /// NC line of the chord that ends here.
    pub line: u32,
}

/// How far apart two polylines are.
#[derive(Clone, Copy, Debug, Default)]
pub struct Apart {
    /// So far at least.
    pub low_mm: f64,
    /// And no further; none if that was not found out.
    pub high_mm: Option<f64>,
    /// Where a smaller distance fails: a tick of the one, an NC line of the other.
    pub at: Option<Death>,
}

/// Measures two polylines, which are opened several times; the scale is a distance that means nothing.
///
/// # Errors
/// Those of the polylines.
pub fn apart<A, B, E>(
    scale_mm: f64,
    one: impl Fn() -> Result<A, E>,
    other: impl Fn() -> Result<B, E>,
) -> Result<Apart, E>
where
    A: Iterator<Item = Result<Vertex, E>>,
    B: Iterator<Item = Result<Vertex, E>>,
{
    let mut found = Apart::default();
    let [mut from_mm, mut to_mm] = [0.0, scale_mm];
    loop {
        let step_mm = (to_mm - from_mm) / RUNGS as f64;
        let rungs_mm = std::array::from_fn(|rung| from_mm + step_mm * (rung + 1) as f64);
        let thin_mm = step_mm * THINNED_SHARE;
        let pass = pass(rungs_mm, Thinned::new(one()?, thin_mm), Thinned::new(other()?, thin_mm))?;
        if pass.low_mm > found.low_mm {
            (found.low_mm, found.at) = (pass.low_mm, pass.at);
        }
        if let Some(high_mm) = pass.high_mm {
            found.high_mm = Some(found.high_mm.map_or(high_mm, |before| before.min(high_mm)));
        }
        if pass.gave_up {
            return Ok(found);
        }
        [from_mm, to_mm] = match found.high_mm {
            None => [to_mm, 2.0 * to_mm],
            Some(high_mm) => [found.low_mm, high_mm],
        };
        if found.high_mm.is_some() && to_mm - from_mm <= RESOLUTION * to_mm.max(scale_mm) {
            return Ok(found);
        }
    }
}

/// What a pass has found.
struct Pass {
    low_mm: f64,
    high_mm: Option<f64>,
    at: Option<Death>,
    gave_up: bool,
}

fn pass<A, B, E>(
    rungs_mm: [f64; RUNGS],
    mut one: Thinned<A>,
    mut other: Thinned<B>,
) -> Result<Pass, E>
where
    A: Iterator<Item = Result<Vertex, E>>,
    B: Iterator<Item = Result<Vertex, E>>,
{
    let nothing = Pass { low_mm: 0.0, high_mm: None, at: None, gave_up: true };
    let (Some(start), Some(foot)) = (one.next()?, other.next()?) else { return Ok(nothing) };
    let mut edges = Edges { vertices: &mut other, from: foot, start_mm: 0.0, any: false };
    let Some(first) = edges.next()? else { return Ok(nothing) };
    let mut sweep = Sweep::new(rungs_mm, start.at, first);
    let mut last = start;
    let mut has_moved = false;
    let mut gave_up = false;
    let mut work_max = WORK_FREE;
    while sweep.dead() < RUNGS && !gave_up {
        let Some(vertex) = one.next()? else { break };
        (last, has_moved) = (vertex, true);
        sweep.advance(vertex.tick, vertex.at, || edges.next())?;
        work_max += WORK_A_VERTEX;
        gave_up = sweep.is_overfull() || sweep.work() > work_max;
    }
    if !has_moved && sweep.dead() < RUNGS {
        sweep.advance(last.tick, last.at, || edges.next())?;
    }
    if sweep.dead() < RUNGS && !gave_up {
        sweep.finish(last.tick, || edges.next())?;
    }
    let off_mm = one.off_mm() + other.off_mm();
    let dead = sweep.dead();
    let greatest_dead = dead.checked_sub(1);
    Ok(Pass {
        low_mm: greatest_dead.map_or(0.0, |rung| rungs_mm[rung] - off_mm),
        high_mm: rungs_mm.get(dead).filter(|_| !gave_up).map(|rung| rung + off_mm),
        at: greatest_dead.and_then(|rung| sweep.death(rung)),
        gave_up,
    })
}

/// The vertices of a polyline that lie further than so much from the one before; and both ends.
struct Thinned<I> {
    vertices: I,
    thin_mm: f64,
    /// The last that was given.
    kept: Option<Vertex>,
    /// Left out since then.
    left_out: Option<Vertex>,
    /// Whether any was left out for good.
    is_thinned: bool,
}

impl<I, E> Thinned<I>
where
    I: Iterator<Item = Result<Vertex, E>>,
{
    fn new(vertices: I, thin_mm: f64) -> Self {
        Thinned { vertices, thin_mm, kept: None, left_out: None, is_thinned: false }
    }

    fn next(&mut self) -> Result<Option<Vertex>, E> {
        while let Some(vertex) = self.vertices.next().transpose()? {
            let is_near = |kept: Vertex| {
                let off = difference(vertex.at, kept.at);
                dot(off, off) <= self.thin_mm * self.thin_mm
            };
            if self.kept.is_some_and(is_near) {
                self.is_thinned |= self.left_out.replace(vertex).is_some();
                continue;
            }
            self.is_thinned |= self.left_out.take().is_some();
            self.kept = Some(vertex);
            return Ok(Some(vertex));
        }
        Ok(self.left_out.take())
    }

    /// How far the thinned polyline is from the whole one at most.
    fn off_mm(&self) -> f64 {
        if self.is_thinned || self.left_out.is_some() { self.thin_mm } else { 0.0 }
    }
}

/// Vertices as edges of a path; a single one is an edge without length.
struct Edges<'a, I> {
    vertices: &'a mut Thinned<I>,
    from: Vertex,
    start_mm: f64,
    any: bool,
}

impl<I, E> Edges<'_, I>
where
    I: Iterator<Item = Result<Vertex, E>>,
{
    fn next(&mut self) -> Result<Option<Edge>, E> {
        let is_first = !std::mem::replace(&mut self.any, true);
        let Some(to) = self.vertices.next()?.or(is_first.then_some(self.from)) else {
            return Ok(None);
        };
        let way = difference(to.at, self.from.at);
        let (start_mm, length_mm) = (self.start_mm, dot(way, way).sqrt());
        let from = std::mem::replace(&mut self.from, to);
        self.start_mm += length_mm;
        Ok(Some(Edge {
            from: from.at,
            to: to.at,
            line: to.line,
            run: 0,
            feed_mm_s: f64::INFINITY,
            start_mm,
            length_mm,
            others: [Others::default(); 2],
            others_feeds: [0.0; 2],
            slack_mm: 0.0,
            end_slack_mm: 0.0,
        }))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    type Polyline = Vec<Vector>;

    fn measured(one: &Polyline, other: &Polyline, scale_mm: f64) -> Apart {
        let vertices = |polyline: &Polyline| {
            let all: Vec<Result<Vertex, ()>> = (0..)
                .zip(polyline.clone())
                .map(|(tick, at)| Ok(Vertex { at, tick, line: 1 }))
                .collect();
            Ok(all.into_iter())
        };
        apart(scale_mm, || vertices(one), || vertices(other)).unwrap()
    }

    /// The part of a chord within a distance of a point.
    fn free(point: Vector, from: Vector, to: Vector, distance: f64) -> Option<[f64; 2]> {
        let (way, off) = (difference(to, from), difference(from, point));
        let [a, b, c] = [dot(way, way), dot(way, off), dot(off, off) - distance * distance];
        if a == 0.0 {
            return (c <= 0.0).then_some([0.0, 1.0]);
        }
        let root = (b * b - a * c).max(-1.0);
        let [low, high] = [-1.0, 1.0].map(|sign| (-b + sign * root.max(0.0).sqrt()) / a);
        let range = [low.max(0.0), high.min(1.0)];
        (root >= 0.0 && range[0] <= range[1]).then_some(range)
    }

    /// The free-space diagram, whole: cell by cell, as Alt and Godau have it.
    fn suffices(p: &Polyline, q: &Polyline, distance: f64) -> bool {
        let near =
            |a: Vector, b: Vector| dot(difference(a, b), difference(a, b)) <= distance * distance;
        if !near(p[0], q[0]) || !near(p[p.len() - 1], q[q.len() - 1]) {
            return false;
        }
        let (n, m) = (p.len() - 1, q.len() - 1);
        // What is reached of the left border of cell (i, j), and of its lower one.
        let mut left = vec![vec![None; m + 1]; n + 1];
        let mut below = vec![vec![None; m + 1]; n + 1];
        for j in 0..m {
            let is_open = j == 0 || left[0][j - 1].is_some_and(|[_, to]: [f64; 2]| to >= 1.0);
            left[0][j] =
                free(p[0], q[j], q[j + 1], distance).filter(|range| is_open && range[0] <= 0.0);
        }
        for i in 0..n {
            let is_open = i == 0 || below[i - 1][0].is_some_and(|[_, to]: [f64; 2]| to >= 1.0);
            below[i][0] =
                free(q[0], p[i], p[i + 1], distance).filter(|range| is_open && range[0] <= 0.0);
        }
        for i in 0..n {
            for j in 0..m {
                let through = |range: Option<[f64; 2]>, along: Option<[f64; 2]>, across: bool| {
                    let [low, high] = range?;
                    let low = if across { low } else { low.max(along?[0]) };
                    (low <= high).then_some([low, high])
                };
                let right = free(p[i + 1], q[j], q[j + 1], distance);
                left[i + 1][j] = through(right, left[i][j], below[i][j].is_some());
                let upper = free(q[j + 1], p[i], p[i + 1], distance);
                below[i][j + 1] = through(upper, below[i][j], left[i][j].is_some());
            }
        }
        left[n][m - 1].is_some_and(|[_, to]| to >= 1.0 - 1e-9)
            || below[n - 1][m].is_some_and(|[_, to]| to >= 1.0 - 1e-9)
    }

    /// A walk of steps up to so long.
    fn walk(points: usize, step: f64) -> impl Strategy<Value = Polyline> {
        let way = prop::array::uniform3(-step..step);
        prop::collection::vec(way, 2..points).prop_map(|ways| {
            let mut at = [0.0; 3];
            let mut place = |way: Vector| {
                at = std::array::from_fn(|i| at[i] + way[i]);
                at
            };
            ways.into_iter().map(&mut place).collect()
        })
    }

    #[track_caller]
    fn check(one: &Polyline, other: &Polyline, scale_mm: f64) {
        let found = measured(one, other, scale_mm);
        let (low, high) = (found.low_mm, found.high_mm.unwrap());
        let rounding = 1e-7;
        assert!(suffices(one, other, high + rounding), "{high} is too little");
        assert!(low <= rounding || !suffices(one, other, low - rounding), "{low} is enough");
        assert!(high - low <= RESOLUTION * high.max(scale_mm) + rounding, "{low} {high}");
    }

    proptest! {
        #[test]
        fn any_two_walks_are_as_far_apart_as_cell_by_cell(
            one in walk(14, 3.0), other in walk(14, 3.0), scale in 0.01..5.0_f64
        ) {
            check(&one, &other, scale);
        }

        /// Chords much shorter than the distance, so that most are thinned out.
        #[test]
        fn so_are_walks_of_short_steps(
            one in walk(80, 0.2), other in walk(80, 0.2), aside in 0.0..20.0_f64
        ) {
            let other: Polyline = other.into_iter().map(|[x, y, z]| [x + aside, y, z]).collect();
            check(&one, &other, 0.01);
        }
    }

    #[test]
    fn long_ways_far_apart_take_little_work() {
        let line = |y: f64| -> Polyline {
            (0..20_000)
                .map(|k| [f64::from(k) * 0.01, y + libm::sin(f64::from(k) * 0.001), 0.0])
                .collect()
        };
        let found = measured(&line(0.0), &line(50.0), 0.01);
        let high = found.high_mm.unwrap();
        assert!(found.low_mm <= 50.0 && high >= 50.0 && high - found.low_mm < 2.0, "{found:?}");
    }

    #[test]
    fn points_are_polylines_too() {
        check(&vec![[0.0; 3], [0.0; 3]], &vec![[0.0; 3], [3.0, 4.0, 0.0]], 0.01);
        let found = measured(&vec![[1.0; 3]], &vec![[1.0; 3]], 0.01);
        assert!(found.low_mm <= 0.0 && found.high_mm.unwrap() <= 1e-5);
    }
}
