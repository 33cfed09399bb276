//! Ways to plan, drawn point by point.

use cnc::base::{Axis, Plane, Point};
use cnc::interp::{Move, MoveKind};
use cnc::path::{self, Segment};

pub fn at(x: f64, y: f64, z: f64) -> Point {
    let mut point = Point::ZERO;
    (point[Axis::X], point[Axis::Y], point[Axis::Z]) = (x, y, z);
    point
}

pub fn moves(way: &[(Point, MoveKind)]) -> Vec<Segment> {
    let mut from = Point::ZERO;
    let mut segments = Vec::new();
    for (line, (to, kind)) in (1..).zip(way) {
        let (corner, bound) = Default::default();
        let step = Move { line, n: None, from, to: *to, kind: kind.clone(), corner, bound };
        segments.extend(path::segment(&step));
        from = *to;
    }
    segments
}

pub fn line(feed_mm_min: f64) -> MoveKind {
    MoveKind::Line { feed_mm_min }
}

pub fn arc(feed_mm_min: f64, center_mm: [f64; 2], ccw: bool, turns: u32) -> MoveKind {
    MoveKind::Arc { feed_mm_min, plane: Plane::Xy, center_mm, ccw, turns }
}
