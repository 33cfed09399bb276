//! Motion with limited jerk: what must hold, and how near it is to the least time.

use std::convert::Infallible;
use std::f64::consts::TAU;

use cnc::base::{Machine, Point};
use cnc::interp::MoveKind;
use cnc::path::{PathItem, Segment};
use cnc::plan::{self, Feed, Planned, Profile, Seams};
use proptest::prelude::*;

mod least;
#[path = "../optimum/plane.rs"]
mod plane;
#[path = "../programs/mod.rs"]
mod programs;
#[path = "../ways/mod.rs"]
mod ways;
use least::least_s;
use ways::{arc, at, line, moves};

fn planned(segments: &[Segment], machine: &Machine) -> Vec<Profile> {
    let items = segments.iter().cloned().map(|s| Ok::<_, Infallible>(PathItem::from(s)));
    let plan = plan::plan(items, machine, Feed::LookAhead, Seams::NONE, Point::ZERO);
    plan.filter_map(|planned| match planned {
        Ok(Planned::Profile(profile)) => Some(Profile::clone(&profile)),
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

/// Speed, acceleration and jerk along the path stay within the machine's, whatever the axes'
/// directions: each may be greater by what a diagonal in three axes makes of it. Within bent pieces the
/// acceleration is constant, so jerk is taken over times as long as these.
fn check_limits(name: &str, segments: &[Segment], machine: &Machine) {
    let over_s = 4.0 * machine.bus.tick_s();
    let profiles = planned(segments, machine);
    let axis = machine.axes[0];
    let jerk_mm_s3 = axis.jerk_max_mm_s3.unwrap();
    let ways = ways_mm(&profiles, over_s);
    let rates = |v: &[f64]| -> Vec<f64> { v.windows(2).map(|w| (w[1] - w[0]) / over_s).collect() };
    let most = |v: &[f64]| v.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let speeds = rates(&ways);
    let accels = rates(&speeds);
    let jerks = rates(&accels);
    let diagonal = 3.0_f64.sqrt() * 1.001;
    assert!(most(&speeds) <= diagonal * axis.speed_max_mm_s, "{name}: {}", most(&speeds));
    assert!(most(&accels) <= diagonal * axis.accel_max_mm_s2, "{name}: {}", most(&accels));
    let told = format!("{name} on {}: {} mm/s³", machine.id, most(&jerks));
    assert!(most(&jerks) <= diagonal * jerk_mm_s3, "{told}");
    let plain_s = time_s(&planned(segments, &without_jerk(machine)));
    assert!(time_s(&profiles) >= plain_s * (1.0 - 1e-9), "{name}: faster than without jerk");
    for pair in profiles.windows(2) {
        assert_eq!(pair[0].end, pair[1].start, "{name}: the time axis has a gap");
    }
}

fn check(name: &str, way: &[(Point, MoveKind)]) {
    let segments = moves(way);
    for machine in ["starmill", "router"] {
        let machine = Machine::load(machine).unwrap();
        check_limits(name, &segments, &machine);
        let (planned_s, least_s) =
            (time_s(&planned(&segments, &machine)), least_s(&segments, &machine));
        let told = format!("{name} on {}: {planned_s:.4} s, least {least_s:.4} s", machine.id);
        assert!((0.998..1.05).contains(&(planned_s / least_s)), "{told}");
    }
}

/// From rest to rest in closed form: up to seven phases.
fn rest_to_rest_s(length_mm: f64, speed: f64, accel: f64, jerk: f64) -> f64 {
    let ramp_s = |peak: f64| {
        if peak * jerk < accel * accel {
            2.0 * (peak / jerk).sqrt()
        } else {
            peak / accel + accel / jerk
        }
    };
    let (mut low, mut high) = (0.0, speed);
    for _ in 0..200 {
        let peak = 0.5 * (low + high);
        *if peak * ramp_s(peak) > length_mm { &mut high } else { &mut low } = peak;
    }
    2.0 * ramp_s(low) + (length_mm - low * ramp_s(low)) / low
}

#[test]
fn lines_take_the_least_time() {
    for name in ["starmill", "router"] {
        let machine = Machine::load(name).unwrap();
        let axis = machine.axes[0];
        for length_mm in [0.01, 0.1, 1.0, 5.0, 40.0, 140.0] {
            let segments = moves(&[(at(length_mm, 0.0, 0.0), MoveKind::Rapid)]);
            let count_mm_s =
                f64::from(machine.count_max(&axis)) / axis.steps_per_mm / machine.bus.tick_s();
            let speed_mm_s = axis.speed_max_mm_s.min(count_mm_s);
            let jerk_mm_s3 = axis.jerk_max_mm_s3.unwrap();
            let least_s = rest_to_rest_s(length_mm, speed_mm_s, axis.accel_max_mm_s2, jerk_mm_s3);
            let planned_s = time_s(&planned(&segments, &machine));
            assert!(
                (planned_s / least_s - 1.0).abs() < 1e-6,
                "{name} {length_mm}: {planned_s} {least_s}"
            );
        }
    }
}

/// Faster than any limit, so that these set the speed.
const FEED_MM_MIN: f64 = 30_000.0;

#[test]
fn squares_and_zigzags() {
    let corners = [at(40.0, 0.0, 0.0), at(40.0, 40.0, 0.0), at(0.0, 40.0, 0.0), Point::ZERO];
    check("square", &corners.map(|to| (to, line(FEED_MM_MIN))));
    let to = |k: u32| at(f64::from(k.div_ceil(2)), f64::from(k / 2), 0.0);
    check("zigzag", &(1..=100).map(|k| (to(k), line(FEED_MM_MIN))).collect::<Vec<_>>());
}

#[test]
fn rounded_corners() {
    let feed = FEED_MM_MIN;
    let way = [
        (at(10.0, 0.0, 0.0), line(feed)),
        (at(20.0, 10.0, 0.0), arc(feed, [10.0, 10.0], true, 0)),
        (at(20.0, 20.0, 0.0), line(feed)),
    ];
    check("rounded corner", &way);
}

#[test]
fn rounded_squares() {
    let feed = FEED_MM_MIN;
    let way = [
        (at(30.0, 0.0, 0.0), line(feed)),
        (at(35.0, 5.0, 0.0), arc(feed, [30.0, 5.0], true, 0)),
        (at(35.0, 35.0, 0.0), line(feed)),
        (at(30.0, 40.0, 0.0), arc(feed, [30.0, 35.0], true, 0)),
        (at(0.0, 40.0, 0.0), line(feed)),
    ];
    check("rounded square", &way);
}

#[test]
fn circles_native_and_chopped() {
    let feed = FEED_MM_MIN;
    check("circle", &[(Point::ZERO, arc(feed, [20.0, 0.0], false, 0))]);
    let chords = 251;
    let to = |k: u32| {
        let angle = TAU * f64::from(k) / f64::from(chords);
        at(20.0 - 20.0 * angle.cos(), 20.0 * angle.sin(), 0.0)
    };
    let way: Vec<_> = (1..=chords).map(|k| (to(k), line(feed))).collect();
    check("chopped circle", &way);
}

#[test]
fn helices() {
    let feed = FEED_MM_MIN;
    check("helix", &[(at(0.0, 0.0, 4.0), arc(feed, [10.0, 0.0], true, 1))]);
}

/// As CAM bores: a plunge, an arc of a fifth of a millimetre into the hole, half turns down a helix, and out.
#[test]
fn bores() {
    let (feed, lead_mm, radius_mm) = (1000.0, 0.18, 1.1);
    let mut way = Vec::new();
    for hole in 0..3 {
        let center = [f64::from(hole) * 18.0 + 5.0, 5.0];
        let x = |offset_mm: f64| center[0] + offset_mm;
        let inside = radius_mm - lead_mm;
        way.push((at(x(inside - 0.45), 4.82, 0.0), MoveKind::Rapid));
        way.push((at(x(inside - 0.45), 4.82, -8.0), line(feed)));
        way.push((at(x(inside - 0.09), 4.82, -8.0), line(feed)));
        way.push((at(x(inside), 4.82, -8.0), line(feed)));
        way.push((at(x(radius_mm), 5.0, -8.0), arc(feed, [x(inside), 5.0], true, 0)));
        for half in 1..=8 {
            let side = if half % 2 == 0 { radius_mm } else { -radius_mm };
            let z = -8.0 - 0.25 * f64::from(half);
            way.push((at(x(side), 5.0, z), arc(feed, center, true, 0)));
        }
        way.push((at(x(inside), 5.18, -10.0), arc(feed, [x(inside), 5.0], true, 0)));
        way.push((at(x(inside - 0.09), 5.18, -10.0), line(feed)));
        way.push((at(x(inside - 0.09), 5.18, 0.0), line(feed)));
    }
    check("bores", &way);
}

/// As CAM clears a pocket: curves of short chords that open and close, a line, an arc.
#[test]
fn cleared_pockets() {
    let feed = 1000.0;
    let (mut way, mut x, mut y) = (Vec::new(), 0.0, 0.0);
    for pass in 0..8 {
        let mut angle = 0.3 * f64::from(pass);
        for from_end in (0..12).chain((0..12).rev()) {
            let chord_mm = 0.15 * 1.1_f64.powi(from_end);
            angle += 0.1 * 0.9_f64.powi(from_end);
            (x, y) = (x + chord_mm * angle.cos(), y + chord_mm * angle.sin());
            way.push((at(x, y, 0.0), line(feed)));
        }
        (x, y) = (x + 6.0 * angle.cos(), y + 6.0 * angle.sin());
        way.push((at(x, y, 0.0), line(feed)));
        let center = [x - angle.sin(), y + angle.cos()];
        (x, y) = (center[0] + angle.cos(), center[1] + angle.sin());
        way.push((at(x, y, 0.0), arc(feed, center, true, 0)));
    }
    check("cleared pockets", &way);
}

/// A way that turns a little at every of its short moves, as CAM writes it.
fn turning(turns: &[(f64, f64)]) -> Vec<(Point, MoveKind)> {
    let (mut angle, mut x, mut y) = (0.3_f64, 0.0, 0.0);
    let leg = |(way_mm, turn_rad): &(f64, f64)| {
        angle += turn_rad;
        (x, y) = (x + way_mm * angle.cos(), y + way_mm * angle.sin());
        (at(x, y, 0.0), line(FEED_MM_MIN))
    };
    turns.iter().map(leg).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn every_limit_is_kept(
        turns in proptest::collection::vec((0.02..12.0_f64, -0.7..0.7_f64), 2..60),
    ) {
        let segments = moves(&turning(&turns));
        for machine in ["starmill", "router"] {
            check_limits("turning way", &segments, &Machine::load(machine).unwrap());
        }
    }
}

/// The samples, and the programs of the folder that `CNC_PROGRAMS` names: all stretches together.
#[test]
fn programs_take_little_more_than_the_least_time() {
    let mut over = Vec::new();
    for program in programs::programs() {
        for machine in ["starmill", "router"] {
            let machine = Machine::load(machine).unwrap();
            let sum_s = |of: fn(&[Segment], &Machine) -> f64| -> f64 {
                program.stretches.iter().map(|stretch| of(stretch, &machine)).sum()
            };
            let planned_s = sum_s(|stretch, machine| time_s(&planned(stretch, machine)));
            let least_s = sum_s(least_s);
            let ratio = planned_s / least_s;
            let told = format!("{} on {}", program.name, machine.id);
            let told = format!("{told}: {planned_s:.3} s, least {least_s:.3} s: {ratio:.4}");
            programs::tell(&told);
            if !(0.998..1.05).contains(&ratio) {
                over.push(told);
            }
        }
    }
    assert!(over.is_empty(), "{over:#?}");
}
