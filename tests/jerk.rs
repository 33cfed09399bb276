//! Motion with limited jerk: what must hold, and how near it is to the least time.

use std::convert::Infallible;
use std::f64::consts::TAU;

use cnc::base::{Axis, Machine, Plane, Point};
use cnc::interp::{Move, MoveKind};
use cnc::path::{self, PathItem, Segment};
use cnc::plan::{self, Feed, Planned, Profile, Seams};

fn at(x: f64, y: f64, z: f64) -> Point {
    let mut point = Point::ZERO;
    (point[Axis::X], point[Axis::Y], point[Axis::Z]) = (x, y, z);
    point
}

fn moves(way: &[(Point, MoveKind)]) -> Vec<Segment> {
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

fn line(feed_mm_min: f64) -> MoveKind {
    MoveKind::Line { feed_mm_min }
}

fn arc(feed_mm_min: f64, center_mm: [f64; 2], ccw: bool, turns: u32) -> MoveKind {
    MoveKind::Arc { feed_mm_min, plane: Plane::Xy, center_mm, ccw, turns }
}

fn planned(segments: &[Segment], machine: &Machine) -> Vec<Profile> {
    let items = segments.iter().cloned().map(|s| Ok::<_, Infallible>(PathItem::Segment(s)));
    let plan = plan::plan(items, machine, Feed::LookAhead, Seams::NONE, Point::ZERO);
    plan.filter_map(|planned| match planned {
        Ok(Planned::Profile(profile)) => Some(*profile),
        _ => None,
    })
    .collect()
}

fn without_jerk(machine: &Machine) -> Machine {
    let mut machine = machine.clone();
    machine.axes.iter_mut().for_each(|axis| axis.jerk_max_mm_s3 = None);
    machine
}

fn time_s(profiles: &[Profile]) -> f64 {
    profiles.iter().map(|profile| profile.ramp.duration_s()).sum()
}

/// The way along the path at equal steps of time.
fn ways_mm(profiles: &[Profile], step_s: f64) -> Vec<f64> {
    let (mut ways, mut start_s, mut start_mm, mut k) = (Vec::new(), 0.0, 0.0, 0);
    for profile in profiles {
        let ramp = &profile.ramp;
        while f64::from(k) * step_s < start_s + ramp.duration_s() {
            ways.push(start_mm + ramp.distance_mm(f64::from(k) * step_s - start_s));
            k += 1;
        }
        start_s += ramp.duration_s();
        start_mm += ramp.length_mm();
    }
    ways
}

fn show(name: &str, way: &[(Point, MoveKind)]) {
    let segments = moves(way);
    for machine in ["starmill", "router"] {
        let machine = Machine::load(machine).unwrap();
        let now = std::time::Instant::now();
        let curved = planned(&segments, &machine);
        let took = now.elapsed();
        let plain = time_s(&planned(&segments, &without_jerk(&machine)));
        let step_s = if machine.id == "router" { 2e-4 } else { 1e-3 };
        let ways = ways_mm(&curved, step_s);
        let diffs =
            |v: &[f64]| -> Vec<f64> { v.windows(2).map(|w| (w[1] - w[0]) / step_s).collect() };
        let (v, a) = (diffs(&ways), diffs(&diffs(&ways)));
        let j = diffs(&a);
        let most = |v: &[f64]| v.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        println!(
            "{name} {}: {:.4} s, plain {:.4} s ({:.3}); v {:.3} a {:.2} j {:.1}; {took:?} {} profiles",
            machine.id,
            time_s(&curved),
            plain,
            time_s(&curved) / plain,
            most(&v),
            most(&a),
            most(&j),
            curved.len()
        );
    }
}

#[test]
fn figures() {
    for feed in [300.0, 1200.0, 30_000.0] {
        println!("F{feed}");
        show("1 mm", &[(at(1.0, 0.0, 0.0), line(feed))]);
        show("40 mm", &[(at(40.0, 0.0, 0.0), line(feed))]);
        let corners = [at(40.0, 0.0, 0.0), at(40.0, 40.0, 0.0), at(0.0, 40.0, 0.0), Point::ZERO];
        show("square", &corners.map(|to| (to, line(feed))));
        let way = [
            (at(30.0, 0.0, 0.0), line(feed)),
            (at(35.0, 5.0, 0.0), arc(feed, [30.0, 5.0], true, 0)),
            (at(35.0, 35.0, 0.0), line(feed)),
            (at(30.0, 40.0, 0.0), arc(feed, [30.0, 35.0], true, 0)),
            (at(0.0, 40.0, 0.0), line(feed)),
        ];
        show("rounded square", &way);
        let to = |k: u32| at(f64::from(k.div_ceil(2)), f64::from(k / 2), 0.0);
        let way: Vec<_> = (1..=100).map(|k| (to(k), line(feed))).collect();
        show("zigzag", &way);
        show("circle", &[(Point::ZERO, arc(feed, [20.0, 0.0], false, 0))]);
        let chords = 251;
        let to = |k: u32| {
            let angle = TAU * f64::from(k) / f64::from(chords);
            at(20.0 - 20.0 * angle.cos(), 20.0 * angle.sin(), 0.0)
        };
        let way: Vec<_> = (1..=chords).map(|k| (to(k), line(feed))).collect();
        show("chopped circle", &way);
        show("helix", &[(at(0.0, 0.0, 10.0), arc(feed, [10.0, 0.0], true, 4))]);
    }
}
