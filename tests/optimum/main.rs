//! The plan against the least time under the same rules ([`plane`]).

use std::convert::Infallible;
use std::f64::consts::TAU;

use cnc::base::{Machine, Point};
use cnc::interp::MoveKind;
use cnc::path::{PathItem, Segment};
use cnc::plan::{self, Feed, Planned, Seams};

mod plane;
#[path = "../programs/mod.rs"]
mod programs;
#[path = "../ways/mod.rs"]
mod ways;
use ways::{arc, at, line, moves};

/// The least time from rest to rest.
fn least_s(segments: &[Segment], machine: &Machine) -> f64 {
    plane::fastest(segments, machine).windows(2).map(plane::time_s).sum()
}

fn planned_s(segments: &[Segment], machine: &Machine) -> f64 {
    let items = segments.iter().cloned().map(|s| Ok::<_, Infallible>(PathItem::from(s)));
    let plan = plan::plan(items, machine, Feed::LookAhead, Seams::NONE, Point::ZERO);
    let time = |planned: Result<Planned, Infallible>| match planned {
        Ok(Planned::Profile(profile)) => profile.ramp.duration_s(),
        _ => 0.0,
    };
    plan.map(time).sum()
}

/// A built-in machine whose axes have no limit on jerk.
fn machine(name: &str) -> Machine {
    let mut machine = Machine::load(name).unwrap();
    machine.axes.iter_mut().for_each(|axis| axis.jerk_max_mm_s3 = None);
    machine
}

fn check(name: &str, way: &[(Point, MoveKind)]) {
    let segments = moves(way);
    for machine in ["starmill", "router"].map(machine) {
        let (planned_s, least_s) = (planned_s(&segments, &machine), least_s(&segments, &machine));
        let ratio = planned_s / least_s;
        let told = format!("{name} on {}: {planned_s:.4} s, least {least_s:.4} s", machine.id);
        assert!((0.998..1.01).contains(&ratio), "{told}: {ratio:.4}");
    }
}

const FEEDS_MM_MIN: [f64; 3] = [300.0, 1200.0, 30_000.0];

#[test]
fn squares() {
    for feed in FEEDS_MM_MIN {
        let corners = [at(40.0, 0.0, 0.0), at(40.0, 40.0, 0.0), at(0.0, 40.0, 0.0), Point::ZERO];
        check("square", &corners.map(|to| (to, line(feed))));
    }
}

#[test]
fn rounded_squares() {
    for feed in FEEDS_MM_MIN {
        let way = [
            (at(30.0, 0.0, 0.0), line(feed)),
            (at(35.0, 5.0, 0.0), arc(feed, [30.0, 5.0], true, 0)),
            (at(35.0, 35.0, 0.0), line(feed)),
            (at(30.0, 40.0, 0.0), arc(feed, [30.0, 35.0], true, 0)),
            (at(0.0, 40.0, 0.0), line(feed)),
        ];
        check("rounded square", &way);
    }
}

#[test]
fn zigzags() {
    for feed in FEEDS_MM_MIN {
        let to = |k: u32| at(f64::from(k.div_ceil(2)), f64::from(k / 2), 0.0);
        let way: Vec<_> = (1..=100).map(|k| (to(k), line(feed))).collect();
        check("zigzag", &way);
    }
}

#[test]
fn circles_native_and_chopped() {
    for feed in FEEDS_MM_MIN {
        check("circle", &[(Point::ZERO, arc(feed, [20.0, 0.0], false, 0))]);
        let chords = 251;
        let to = |k: u32| {
            let angle = TAU * f64::from(k) / f64::from(chords);
            at(20.0 - 20.0 * angle.cos(), 20.0 * angle.sin(), 0.0)
        };
        let way: Vec<_> = (1..=chords).map(|k| (to(k), line(feed))).collect();
        check("chopped circle", &way);
    }
}

/// Chords of curves that open, and a line: the end of a chord may be faster than its start can ever be.
/// That is where a plan may lose 0.01 s, and must not stop.
#[test]
fn opening_curves() {
    for start in 0..12 {
        let (mut angle, mut x, mut y) = (0.52 * f64::from(start), 0.0, 0.0);
        let mut way: Vec<_> = (0..40)
            .map(|k| {
                angle += 0.3 * 0.8_f64.powi(k);
                (x, y) = (x + 0.15 * angle.cos(), y + 0.15 * angle.sin());
                (at(x, y, 0.0), line(1000.0))
            })
            .collect();
        way.push((at(x + 15.0 * angle.cos(), y + 15.0 * angle.sin(), 0.0), line(1000.0)));
        check("opening curve", &way);
    }
}

#[test]
fn helices() {
    for feed in FEEDS_MM_MIN {
        check("helix", &[(at(0.0, 0.0, 10.0), arc(feed, [10.0, 0.0], true, 4))]);
    }
}

/// A chopped arc is never run faster than the arc can be.
#[test]
fn chopped_arcs_are_no_faster_than_arcs() {
    for machine in ["starmill", "router"].map(machine) {
        for (radius_mm, chord_mm) in [(2.0, 0.05), (5.0, 0.1), (20.0, 0.5), (50.0, 0.2)] {
            let native = moves(&[(Point::ZERO, arc(60_000.0, [radius_mm, 0.0], false, 0))]);
            let chords = (TAU * radius_mm / chord_mm).ceil();
            let to = |k: u32| {
                let angle = TAU * f64::from(k) / chords;
                at(radius_mm - radius_mm * angle.cos(), radius_mm * angle.sin(), 0.0)
            };
            let way: Vec<_> = (1..=chords as u32).map(|k| (to(k), line(60_000.0))).collect();
            let (chopped_s, native_s) =
                (planned_s(&moves(&way), &machine), least_s(&native, &machine));
            // The chords are shorter than the arc by (c/r)²/24, and end before what they bend into.
            let shorter = 1.0 - (chord_mm / radius_mm).powi(2) / 20.0 - 1e-4;
            let told = format!("{} r {radius_mm} c {chord_mm}: {chopped_s} {native_s}", machine.id);
            assert!(chopped_s >= native_s * shorter, "{told}");
        }
    }
}

/// The programs of the samples, and of the folder that `CNC_PROGRAMS` names, all stretches together.
#[test]
fn programs_take_the_least_time() {
    let mut over = Vec::new();
    for program in programs::programs() {
        for machine in ["starmill", "router"].map(machine) {
            let sum_s = |of: fn(&[Segment], &Machine) -> f64| -> f64 {
                program.stretches.iter().map(|stretch| of(stretch, &machine)).sum()
            };
            let (planned_s, least_s) = (sum_s(planned_s), sum_s(least_s));
            let ratio = planned_s / least_s;
            let told = format!("{} on {}", program.name, machine.id);
            let told = format!("{told}: {planned_s:.3} s, least {least_s:.3} s: {ratio:.4}");
            programs::tell(&told);
            if !(0.998..1.01).contains(&ratio) {
                over.push(told);
            }
        }
    }
    assert!(over.is_empty(), "{over:#?}");
}
