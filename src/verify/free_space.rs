//! For tests: polylines, and whether two of them can be walked together, by all of the free-space diagram.

use proptest::prelude::*;

use super::edges::{Vector, difference, dot};

pub type Polyline = Vec<Vector>;

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
pub fn suffices(p: &Polyline, q: &Polyline, distance: f64) -> bool {
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
pub fn walk(points: usize, step: f64) -> impl Strategy<Value = Polyline> {
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
