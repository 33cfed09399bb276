//! The plan against the least time under the same rules, found another way: by integrating u = v²
//! forwards and backwards over thousands of points of the path, with no pieces, no windows and no
//! closed forms. Nothing of the planner is used for the bound.

use std::convert::Infallible;
use std::f64::consts::TAU;

use cnc::base::{Axis, Machine, Point};
use cnc::interp::MoveKind;
use cnc::path::{self, PathItem, Rates, Segment};
use cnc::plan::{self, Feed, Planned, Seams};

mod ways;
use ways::{arc, at, line, moves};

/// Points of the bound, over the whole path.
const POINTS: usize = 60_000;

/// A point of the path: the way to the next, what holds the speed, how position changes.
struct Sample {
    way_mm: f64,
    limit_sq: f64,
    rates: Rates,
}

/// The rules: an axis's speed, the steps that its node makes in a tick, its acceleration across a
/// curve; in a corner its step of speed, v²·|Δt|/L against its acceleration, and what is shared with
/// corners so near that verify's widest window holds both.
fn samples(segments: &[Segment], machine: &Machine) -> Vec<Sample> {
    let total_mm: f64 = segments.iter().map(Segment::length_mm).sum();
    let tick_s = f64::from(machine.bus.tick_us) * 1e-6;
    let mut samples: Vec<Sample> = Vec::new();
    let pairs = segments.windows(2);
    let met: Vec<Met> = pairs.map(|pair| Met::of(&pair[0], &pair[1], machine)).collect();
    for (number, segment) in segments.iter().enumerate() {
        let begins = number.checked_sub(1).map(|before| &met[before]);
        let bends = [begins, met.get(number)].map(|met| met.map_or(Point::ZERO, |met| met.bend));
        let is_line = segment.curve == path::Curve::Line;
        let length_mm = segment.length_mm();
        let count = ((POINTS as f64 * length_mm / total_mm) as usize).max(200);
        for k in 0..=count {
            let share = k as f64 / count as f64;
            let mut rates = segment.rates_at(share);
            for axis in Axis::LINEAR.into_iter().filter(|_| is_line) {
                rates.bend_per_mm[axis] = bends[0][axis] * (1.0 - share) + bends[1][axis] * share;
            }
            let mut limit_sq = segment.feed_mm_s.unwrap_or(f64::INFINITY).powi(2);
            for profile in &machine.axes {
                let (rate, bend) = (rates.tangent[profile.axis], rates.bend_per_mm[profile.axis]);
                let count_mm_s =
                    f64::from(machine.count_max(profile)) / tick_s / profile.steps_per_mm;
                let speed_mm_s = profile.speed_max_mm_s.min(count_mm_s);
                limit_sq = limit_sq.min((speed_mm_s / rate).powi(2));
                limit_sq = limit_sq.min(profile.accel_max_mm_s2 / bend.abs());
            }
            if let Some(met) = begins.filter(|_| k == 0) {
                limit_sq = limit_sq.min(met.limit_sq);
            }
            let way_mm = if k < count { length_mm / count as f64 } else { 0.0 };
            samples.push(Sample { way_mm, limit_sq, rates });
        }
    }
    samples
}

/// Where two segments meet.
struct Met {
    limit_sq: f64,
    /// In a chopped curve, how much it bends.
    bend: Point,
}

impl Met {
    fn of(before: &Segment, after: &Segment, machine: &Machine) -> Met {
        let [end, start] = [before.rates_at(1.0), after.rates_at(0.0)];
        let tick_s = f64::from(machine.bus.tick_us) * 1e-6;
        let lengths = [before.length_mm(), after.length_mm()];
        let (short_mm, long_mm) = (lengths[0].min(lengths[1]), lengths[0].max(lengths[1]));
        let mean_mm = 0.5 * (short_mm + long_mm);
        let feed = |segment: &Segment| segment.feed_mm_s.unwrap_or(f64::INFINITY);
        let mut top_mm_s = feed(before).min(feed(after));
        let (mut jump_mm_s, mut bend) = (f64::INFINITY, Point::ZERO);
        for profile in &machine.axes {
            let axis = profile.axis;
            let turn = start.tangent[axis] - end.tangent[axis];
            if turn.abs() > 1e-9 {
                let step = profile.start_speed_mm_s.max(profile.accel_max_mm_s2 * tick_s);
                let spread_sq = profile.accel_max_mm_s2 * mean_mm / turn.abs();
                jump_mm_s = jump_mm_s.min(step / turn.abs()).min(spread_sq.sqrt());
                for rates in [&end, &start] {
                    top_mm_s = top_mm_s.min(profile.speed_max_mm_s / rates.tangent[axis].abs());
                }
                bend[axis] = turn / mean_mm;
            }
        }
        let window_mm = 20.0 * tick_s * jump_mm_s.min(top_mm_s);
        let (share, is_curve) = match (short_mm < window_mm, long_mm < window_mm) {
            (false, _) => (1.0, false),
            (true, false) => (0.5, false),
            (true, true) => (mean_mm / long_mm, true),
        };
        let alone_mm_s = jump_mm_s.min(short_mm / (20.0 * tick_s));
        let speed_mm_s = if share < 1.0 { alone_mm_s.max(share * jump_mm_s) } else { jump_mm_s };
        let speed_mm_s = speed_mm_s.min(tick_speed_mm_s(&end, &start, machine));
        Met { limit_sq: speed_mm_s.powi(2), bend: if is_curve { bend } else { Point::ZERO } }
    }
}

/// A tick that holds a corner in its middle goes a chord: off by a quarter of its way times the angle.
/// Half a tick before and after, the machine brakes and speeds up.
fn tick_speed_mm_s(a: &Rates, b: &Rates, machine: &Machine) -> f64 {
    let cosine: f64 = Axis::LINEAR.iter().map(|axis| a.tangent[*axis] * b.tangent[*axis]).sum();
    let turn_rad = cosine.clamp(-1.0, 1.0).acos();
    let tick_s = f64::from(machine.bus.tick_us) * 1e-6;
    if turn_rad < 1e-6 {
        return f64::INFINITY;
    }
    let accel = |rates: &Rates| accel_mm_s2(rates, 0.0, 1.0, machine);
    let gain_mm = 0.25 * accel(a).max(accel(b)) * tick_s * tick_s;
    ((4.0 * machine.path_tolerance_mm / turn_rad - gain_mm) / tick_s).max(0.0)
}

/// The greatest acceleration (sign 1) or braking (sign -1) at a speed.
fn accel_mm_s2(rates: &Rates, speed_sq: f64, sign: f64, machine: &Machine) -> f64 {
    let mut least = f64::INFINITY;
    for profile in &machine.axes {
        let (rate, bend) = (sign * rates.tangent[profile.axis], rates.bend_per_mm[profile.axis]);
        if rate != 0.0 {
            let across = bend * speed_sq * rate.signum();
            least = least.min((profile.accel_max_mm_s2 - across) / rate.abs());
        }
    }
    least.max(0.0)
}

fn least_s(segments: &[Segment], machine: &Machine) -> f64 {
    let samples = samples(segments, machine);
    let mut speed_sq: Vec<f64> = samples.iter().map(|sample| sample.limit_sq).collect();
    let last = speed_sq.len() - 1;
    (speed_sq[0], speed_sq[last]) = (0.0, 0.0);
    for k in (0..last).rev() {
        let accel = accel_mm_s2(&samples[k].rates, speed_sq[k + 1], -1.0, machine);
        speed_sq[k] = speed_sq[k].min(speed_sq[k + 1] + 2.0 * accel * samples[k].way_mm);
    }
    let mut time_s = 0.0;
    for k in 0..last {
        let accel = accel_mm_s2(&samples[k].rates, speed_sq[k], 1.0, machine);
        speed_sq[k + 1] = speed_sq[k + 1].min(speed_sq[k] + 2.0 * accel * samples[k].way_mm);
        let ends = speed_sq[k].sqrt() + speed_sq[k + 1].sqrt();
        time_s += if samples[k].way_mm > 0.0 { 2.0 * samples[k].way_mm / ends } else { 0.0 };
    }
    time_s
}

fn planned_s(segments: &[Segment], machine: &Machine) -> f64 {
    let items = segments.iter().cloned().map(|s| Ok::<_, Infallible>(PathItem::Segment(s)));
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
