//! What must hold for every plan and its ticks, over random paths.

use std::convert::Infallible;

use cnc::base::machine::Rapid;
use cnc::base::{Axis, Command, Machine, Plane, Point, Tick};
use cnc::interp::{Motion, Move, MoveKind};
use cnc::path::{self, PathItem, Segment};
use cnc::plan::{self, Feed, Planned};
use cnc::step;
use cnc::verify::{self, Setup, Verdict};
use proptest::prelude::*;
use proptest::strategy::ValueTree;

/// A random way: where to, at which feed, and for arcs how far the centre is off the chord.
#[derive(Clone, Debug)]
struct Leg {
    by_mm: [f64; 3],
    feed_mm_min: Option<f64>,
    arc: Option<(f64, bool, u32)>,
}

fn legs() -> impl Strategy<Value = Vec<Leg>> {
    let way = prop_oneof![-0.05..0.05, -1.0..1.0, -15.0..15.0, Just(0.0)];
    let leg = (
        [way.clone(), way.clone(), way],
        proptest::option::weighted(0.8, 1.0..3000.0_f64),
        proptest::option::weighted(0.3, (-3.0..3.0_f64, any::<bool>(), 0..3_u32)),
    );
    let leg = leg.prop_map(|(by_mm, feed_mm_min, arc)| Leg { by_mm, feed_mm_min, arc });
    proptest::collection::vec(leg, 1..12)
}

/// The legs as segments from the machine's work zero on.
fn segments(legs: &[Leg], machine: &Machine) -> Vec<Segment> {
    let mut at = machine.work_zero_mm;
    let mut motions = Vec::new();
    for (i, leg) in legs.iter().enumerate() {
        let mut to = at;
        for (axis, by_mm) in Axis::LINEAR.into_iter().zip(leg.by_mm) {
            to[axis] += by_mm;
        }
        let kind = match (leg.feed_mm_min, leg.arc) {
            (None, _) => MoveKind::Rapid,
            (Some(feed_mm_min), None) => MoveKind::Line { feed_mm_min },
            (Some(feed_mm_min), Some((off, ccw, turns))) => {
                let [x, y] = [leg.by_mm[0] / 2.0, leg.by_mm[1] / 2.0];
                let center_mm = [at[Axis::X] + x - y * off, at[Axis::Y] + y + x * off];
                let plane = Plane::Xy;
                MoveKind::Arc { feed_mm_min, plane, center_mm, ccw, turns }
            }
        };
        let (corner, bound) = Default::default();
        let line = i as u32 + 1;
        motions.push(Ok(Motion::Move(Move { line, n: None, from: at, to, kind, corner, bound })));
        at = to;
    }
    let items = path::segments::<Infallible>(motions.into_iter(), machine);
    let segment = |item| match item {
        Ok(PathItem::Segment(segment)) => Segment::clone(&segment),
        other => unreachable!("{other:?}"),
    };
    let mut segments: Vec<Segment> = items.map(segment).collect();
    segments.retain(|segment| segment.length_mm() > 0.0);
    segments
}

fn run(segments: &[Segment], machine: &Machine, feed: Feed) -> (Vec<plan::Profile>, Vec<Tick>) {
    let start = machine.work_zero_mm;
    let items = || segments.iter().cloned().map(|s| Ok::<_, Infallible>(PathItem::from(s)));
    let Ok(seams) = plan::place(items, machine, feed);
    let mut profiles = Vec::new();
    let plan = plan::plan(items(), machine, feed, &seams, start).inspect(|planned| {
        if let Ok(Planned::Profile(profile)) = planned {
            profiles.push(profile.as_ref().clone());
        }
    });
    let ticks = step::interpolate(plan, machine, start)
        .map(|command| match command {
            Ok(Command::Tick(tick)) => tick,
            other => unreachable!("{other:?}"),
        })
        .collect();
    (profiles, ticks)
}

/// Machine position in mm after each tick.
fn positions(ticks: &[Tick], machine: &Machine) -> Vec<Point> {
    let mut steps = machine.nearest_steps(&machine.work_zero_mm);
    let mut position = machine.work_zero_mm;
    let after = |tick: &Tick| {
        for profile in &machine.axes {
            let axis = profile.axis;
            steps[axis] += i64::from(tick.counts[axis]);
            position[axis] = steps[axis] as f64 / profile.steps_per_mm;
        }
        position
    };
    ticks.iter().map(after).collect()
}

fn check(legs: &[Leg], machine: &Machine, feed: Feed) -> Result<(), TestCaseError> {
    let segments = segments(legs, machine);
    let (profiles, ticks) = run(&segments, machine, feed);
    let positions = positions(&ticks, machine);
    let tick_s = machine.bus.tick_s();

    let end_mm = segments.last().map_or(machine.work_zero_mm, |segment| segment.to_mm);
    let end = positions.last().copied().unwrap_or(machine.work_zero_mm);
    prop_assert_eq!(machine.nearest_steps(&end), machine.nearest_steps(&end_mm), "end point");

    for profile in &profiles {
        for boundary in profile.start.boundary().max(1)..=profile.end.tick {
            let exact = profile.position_at(boundary, tick_s);
            for axis in &machine.axes {
                let off = (positions[boundary as usize - 1][axis.axis] - exact[axis.axis]).abs();
                let half_step = 0.5 / axis.steps_per_mm;
                prop_assert!(off <= half_step * (1.0 + 1e-6), "{} off by {off}", axis.axis);
            }
        }
    }
    let setup = Setup {
        machine,
        tick_us: machine.bus.tick_us,
        start_steps: machine.nearest_steps(&machine.work_zero_mm),
        constant_feed: feed == Feed::Constant,
        with_events: true,
        with_buffers: true,
    };
    let commands = || Ok(ticks.iter().map(|tick| Ok::<_, Infallible>(Command::Tick(*tick))));
    let path = || Ok(segments.iter().cloned().map(|s| Ok::<_, Infallible>(PathItem::from(s))));
    let report = verify::verify(&setup, commands, path);
    let report = report.map_err(|error| TestCaseError::fail(error.to_string()))?;
    prop_assert_eq!(report.verdict, Verdict::Pass, "{}: {:?}", machine.id, report.failures);
    for (i, run) in ticks.chunk_by(|a, b| a.buffer == b.buffer).enumerate() {
        prop_assert_eq!(run[0].buffer as usize, i, "buffers count up");
    }
    Ok(())
}

/// Travel is the check's business, before any plan.
fn load(name: &str) -> Machine {
    let mut machine = Machine::load(name).unwrap();
    for axis in &mut machine.axes {
        axis.travel_mm = None;
    }
    machine
}

/// Built-in machines, with their limits on jerk and without any.
fn with_and_without_jerk() -> Vec<Machine> {
    let mut machines: Vec<Machine> = ["starmill", "router", "ideal"].map(load).into();
    for at in 0..machines.len() {
        let mut machine = machines[at].clone();
        machine.axes.iter_mut().for_each(|axis| axis.jerk_max_mm_s3 = None);
        machines.push(machine);
    }
    machines
}

/// Stretches of a curve: its bend at both ends and its rise a mm, and the lengths of its chords.
type Stretch = ([f64; 2], f64, Vec<f64>);

fn chords() -> impl Strategy<Value = Vec<Stretch>> {
    let bend_per_mm = || prop_oneof![Just(0.0), -0.1..0.1_f64, -1.0..1.0_f64, -5.0..5.0_f64];
    let length_mm = prop_oneof![4 => 0.02..0.3_f64, 3 => 0.3..2.0_f64, 1 => 2.0..5.0_f64];
    let lengths_mm = proptest::collection::vec(length_mm, 3..25);
    proptest::collection::vec(([bend_per_mm(), bend_per_mm()], -0.3..0.3_f64, lengths_mm), 1..4)
}

/// Its chords, with ends rounded to a micrometre.
fn chopped(stretches: &[Stretch], feed_mm_min: f64) -> Vec<Leg> {
    let (mut angle_rad, mut at_mm, mut rounded_mm) = (0.2_f64, [0.0; 3], [0.0; 3]);
    let mut legs = Vec::new();
    for (bends_per_mm, rise, lengths_mm) in stretches {
        let all_mm: f64 = lengths_mm.iter().sum();
        let mut done_mm = 0.0;
        for length_mm in lengths_mm {
            let share = (done_mm + 0.5 * length_mm) / all_mm;
            let bend = bends_per_mm[0] + (bends_per_mm[1] - bends_per_mm[0]) * share;
            let turn_rad = (bend * length_mm).clamp(-0.5, 0.5);
            angle_rad += 0.5 * turn_rad;
            let way = [angle_rad.cos(), angle_rad.sin(), *rise].map(|rate| rate * length_mm);
            angle_rad += 0.5 * turn_rad;
            done_mm += length_mm;
            at_mm = [0, 1, 2].map(|i| at_mm[i] + way[i]);
            let to_mm = at_mm.map(|at| (at * 1e3).round() / 1e3);
            let by_mm = [0, 1, 2].map(|i| to_mm[i] - rounded_mm[i]);
            rounded_mm = to_mm;
            legs.push(Leg { by_mm, feed_mm_min: Some(feed_mm_min), arc: None });
        }
    }
    legs
}

/// An arc of a radius of 0.005 to 0.5 mm, or a line.
fn tiny_arc() -> impl Strategy<Value = Leg> {
    let way_mm = || prop_oneof![-0.02..0.02_f64, -0.3..0.3_f64];
    let line_mm = || prop_oneof![-0.1..0.1_f64, -3.0..3.0_f64];
    let rise_mm = || prop_oneof![2 => Just(0.0), 1 => -0.05..0.05_f64, 1 => -1.0..1.0_f64];
    let arc = (-1.5..1.5_f64, any::<bool>(), 0..3_u32);
    let round = (way_mm(), way_mm(), rise_mm(), arc).prop_map(|(x, y, z, arc)| Leg {
        by_mm: [x, y, z],
        feed_mm_min: None,
        arc: Some(arc),
    });
    let line = (line_mm(), line_mm(), rise_mm());
    let line = line.prop_map(|(x, y, z)| Leg { by_mm: [x, y, z], feed_mm_min: None, arc: None });
    prop_oneof![2 => round, 1 => line]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    /// Half a step, the contour, speed, acceleration, rest at seams and ends, the length of
    /// buffers, the end point: all of it, as `verify` sees it.
    #[test]
    fn every_limit_is_kept(legs in legs(), feed in 0..3) {
        let feed = [Feed::LookAhead, Feed::ExactStop, Feed::Constant][feed as usize];
        for name in ["starmill", "router", "ideal"] {
            check(&legs, &load(name), feed)?;
        }
    }

    /// The same where every axis makes its rapids on its own, and no two are alike.
    #[test]
    fn independent_rapids_keep_every_limit(legs in legs()) {
        for name in ["starmill", "router"] {
            let mut machine = load(name);
            machine.rapid = Rapid::Independent;
            machine.axes[1].speed_max_mm_s *= 0.7;
            machine.axes[2].accel_max_mm_s2 *= 0.3;
            let by = |(i, leg): (usize, &Leg)| {
                let feed_mm_min = leg.feed_mm_min.filter(|_| i % 4 == 3);
                Leg { feed_mm_min, arc: None, ..*leg }
            };
            let rapids: Vec<Leg> = legs.iter().enumerate().map(by).collect();
            check(&rapids, &machine, Feed::LookAhead)?;
        }
    }

    /// Chopped lines and arcs as CAM writes them: many corners within a tick.
    #[test]
    fn short_segments_keep_every_limit(
        turns in proptest::collection::vec((0.003..0.6_f64, -0.5..0.5_f64), 5..120),
        feed_mm_min in 100.0..3000.0_f64,
    ) {
        let mut angle: f64 = 0.3;
        let leg = |(way_mm, turn_rad): &(f64, f64)| {
            angle += turn_rad;
            let by_mm = [way_mm * angle.cos(), way_mm * angle.sin(), 0.0];
            Leg { by_mm, feed_mm_min: Some(feed_mm_min), arc: None }
        };
        let legs: Vec<Leg> = turns.iter().map(leg).collect();
        for name in ["starmill", "router", "ideal"] {
            check(&legs, &load(name), Feed::LookAhead)?;
        }
    }
}

/// Ticks that a plan takes, node buffers left out.
fn ticks(segments: &[Segment], machine: &Machine, feed: Feed) -> u64 {
    let items = segments.iter().cloned().map(|s| Ok::<_, Infallible>(PathItem::from(s)));
    let plan = plan::plan(items, machine, feed, plan::Seams::NONE, machine.work_zero_mm);
    let end = |planned| match planned {
        Ok(Planned::Profile(profile)) => profile.end.boundary(),
        other => unreachable!("{other:?}"),
    };
    plan.map(end).max().unwrap_or(0)
}

/// Who need not stop is there no later than who stops in every corner, but for the rounding of a tick a block. Gives
/// both times in ticks.
fn check_going_on(legs: &[Leg], machine: &Machine) -> Result<[u64; 2], TestCaseError> {
    let segments = segments(legs, machine);
    let [going_on, stopping] =
        [Feed::LookAhead, Feed::ExactStop].map(|feed| ticks(&segments, machine, feed));
    let most = stopping + 1 + segments.len() as u64;
    prop_assert!(going_on <= most, "{going_on} {stopping}: {}: {legs:?}", machine.name);
    Ok([going_on, stopping])
}

/// Steps of a grid, cut at a feed or as rapids.
fn grid(unit_mm: f64, feed_mm_min: f64, steps: &[(i32, i32, bool)]) -> Vec<Leg> {
    let leg = |(x, y, is_rapid): &(i32, i32, bool)| Leg {
        by_mm: [unit_mm * f64::from(*x), unit_mm * f64::from(*y), 0.0],
        feed_mm_min: (!is_rapid).then_some(feed_mm_min),
        arc: None,
    };
    steps.iter().map(leg).collect()
}

/// Chords of all angles, in 400 programs that are the same in each run. With the acceleration that bends leave at
/// the greatest speed there, and not at the plan's, the ideal machine took 1 % longer than with stops. With that of
/// the greatest speed between two bends, and not with each half's own, the router took 252 ticks for one of 242.
#[test]
fn going_on_takes_less_time_than_stopping() {
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let step = (-4..4_i32, -4..4_i32, any::<bool>());
    let unit_mm = prop_oneof![Just(0.003), Just(0.0121), Just(0.05), Just(0.3)];
    let way = (unit_mm, proptest::collection::vec(step, 2..20));
    let programs: Vec<_> = (0..400).map(|_| way.new_tree(&mut runner).unwrap().current()).collect();
    for machine in with_and_without_jerk() {
        let times = programs.iter().map(|(unit_mm, steps)| {
            check_going_on(&grid(*unit_mm, 60.0, steps), &machine).unwrap()
        });
        let sum = |[a, b]: [u64; 2], [c, d]: [u64; 2]| [a + c, b + d];
        let [going_on, stopping] = times.fold([0; 2], sum);
        assert!(going_on < stopping, "{going_on} {stopping}: {}", machine.name);
    }
}

/// Two corners as far from each other as the greatest acceleration and braking of Y make in a tick: going on in
/// between leaves next to no speed. It took 131 years.
#[test]
fn nobody_creeps_from_corner_to_corner() {
    let mut machine = load("router");
    let way_mm = |machine: &Machine| {
        let profile = machine.axis(Axis::Y).unwrap();
        0.25 * profile.accel_max_mm_s2 * machine.bus.tick_s() * machine.bus.tick_s()
    };
    for _ in 0..4 {
        for share in [0.9, 1.0, 1.0 + 1e-12, 1.0 + 1e-6, 1.001, 1.02, 1.1, 1.5] {
            let up_mm = share * way_mm(&machine);
            let leg = |by_mm| Leg { by_mm, feed_mm_min: Some(60.0), arc: None };
            let rapid = Leg { feed_mm_min: None, ..leg([-0.8 * up_mm, up_mm, 0.0]) };
            let legs = [leg([0.2, 0.1, 0.0]), rapid, leg([-0.3, -0.3, 0.2])];
            check_going_on(&legs, &machine).unwrap();
        }
        machine.axes.iter_mut().for_each(|axis| axis.accel_max_mm_s2 *= 3.0);
    }
}

/// What the property found: 7 ticks on the STARMILL without jerk for 5 with stops.
#[test]
fn two_steps_take_no_longer_than_with_a_stop() {
    let legs = grid(0.0121, 60.0, &[(2, -2, true), (0, 1, false)]);
    for machine in with_and_without_jerk() {
        let [going_on, stopping] = check_going_on(&legs, &machine).unwrap();
        assert!(going_on <= stopping + 1, "{going_on} {stopping}: {}", machine.name);
    }
}

/// A tiny arc between lines, whose corners a tick would cut. Held so slow that none does, it was crept along at
/// 0.001 mm/s, or with a stop in each of its pieces.
#[test]
fn nobody_creeps_along_a_tiny_arc() {
    let line = |by_mm, feed_mm_min| Leg { by_mm, feed_mm_min, arc: None };
    for [x, y, off] in
        [[3e-5, 0.0, 0.1], [2e-4, 3e-4, -1.0], [0.0017, 0.0, 0.6], [0.003, -0.001, 2.0]]
    {
        for ccw in [true, false] {
            for feed_mm_min in [1.0, 60.0, 1500.0] {
                let arc = Some((off, ccw, 1));
                let arc = Leg { by_mm: [x, y, 0.0], feed_mm_min: Some(feed_mm_min), arc };
                let before = line([0.02, -0.03, 0.1], None);
                let after = line([-9.0, 2.0, 14.0], Some(600.0));
                for machine in with_and_without_jerk() {
                    let legs = [before.clone(), arc.clone(), after.clone()];
                    check_going_on(&legs, &machine).unwrap();
                }
            }
        }
    }
}

/// Where a tick goes further than a corner lets it, on a machine that is strong for its jerk: the speed in the corner is
/// not held as if all of the acceleration were there at once.
#[test]
fn a_higher_feed_takes_no_longer() {
    let at = |k: u32, axis: fn(f64) -> f64| 5.3 * axis(f64::from(k) / 36.0 * std::f64::consts::TAU);
    for [accel_mm_s2, jerk_mm_s3] in [[500.0, 2000.0], [1000.0, 5000.0], [2000.0, 2000.0]] {
        let mut machine = load("starmill");
        for axis in &mut machine.axes {
            (axis.accel_max_mm_s2, axis.jerk_max_mm_s3) = (accel_mm_s2, Some(jerk_mm_s3));
        }
        let taken = [500.0, 600.0, 660.0, 720.0, 900.0, 1200.0].map(|feed_mm_min| {
            let chord = |k| {
                let way_mm = |axis| at(k + 1, axis) - at(k, axis);
                let by_mm = [way_mm(libm::cos), way_mm(libm::sin), 0.0];
                Leg { by_mm, feed_mm_min: Some(feed_mm_min), arc: None }
            };
            let legs: Vec<Leg> = (0..72).map(chord).collect();
            check(&legs, &machine, Feed::LookAhead).unwrap();
            ticks(&segments(&legs, &machine), &machine, Feed::LookAhead)
        });
        assert!(taken.is_sorted_by(|slow, fast| *fast <= slow + 1), "{taken:?}");
    }
}

/// Forty lines that turn back, or less, from one to the next, as fast as can be. With jerk that the bend of a curve
/// would take where the way turns back, the STARMILL took 510 ticks for one such program, and 453 with stops.
#[test]
fn zigzags_take_no_longer_than_with_stops() {
    let big_router = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/machines/big-router.toml");
    let machines = with_and_without_jerk().into_iter().chain([load(big_router)]);
    for machine in machines {
        for length_mm in [0.02, 0.14, 0.17, 0.6] {
            for (angle_deg, turn_deg) in [(0, 180), (45, 180), (45, 170), (20, 120), (45, 85)] {
                let leg = |n: i32| {
                    let angle_deg = angle_deg + if n % 2 == 0 { 0 } else { turn_deg };
                    let (sin, cos) = f64::from(angle_deg).to_radians().sin_cos();
                    let by_mm = [length_mm * cos, length_mm * sin, 0.0];
                    Leg { by_mm, feed_mm_min: Some(12_000.0), arc: None }
                };
                let legs: Vec<Leg> = (0..40).map(leg).collect();
                check_going_on(&legs, &machine).unwrap();
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn going_on_takes_no_longer_than_stopping(
        legs in legs(),
        unit_mm in 0.002..0.2_f64,
        feed_mm_min in prop_oneof![Just(60.0), 60.0..12_000.0_f64],
        steps in proptest::collection::vec((-4..4_i32, -4..4_i32, any::<bool>()), 2..20),
    ) {
        for machine in with_and_without_jerk() {
            check_going_on(&legs, &machine)?;
            check_going_on(&grid(unit_mm, feed_mm_min, &steps), &machine)?;
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3))]

    /// Curves in chords of any lengths, as coordinates of three places make them.
    #[test]
    fn chopped_curves_keep_every_limit(
        chords in chords(),
        feed_mm_min in prop_oneof![100.0..3000.0_f64, 3000.0..30_000.0_f64],
    ) {
        let legs = chopped(&chords, feed_mm_min);
        for machine in with_and_without_jerk() {
            check(&legs, &machine, Feed::LookAhead)?;
        }
    }

    /// Tiny arcs and helices among lines.
    #[test]
    fn tiny_arcs_keep_every_limit(
        arcs in proptest::collection::vec(tiny_arc(), 2..25),
        feed_mm_min in prop_oneof![100.0..3000.0_f64, 3000.0..30_000.0_f64],
    ) {
        let legs: Vec<Leg> =
            arcs.iter().map(|leg| Leg { feed_mm_min: Some(feed_mm_min), ..leg.clone() }).collect();
        for machine in with_and_without_jerk() {
            check(&legs, &machine, Feed::LookAhead)?;
        }
    }
}

#[test]
fn a_move_longer_than_a_buffer_is_ramped_down_and_up() {
    let machine = Machine::load("starmill").unwrap();
    let leg = Leg { by_mm: [50.0, 20.0, 0.0], feed_mm_min: Some(30.0), arc: None };
    let (_, ticks) = run(&segments(&[leg], &machine), &machine, Feed::LookAhead);
    // 53.85 mm at 0.5 mm/s are 107.7 s, or 9791 ticks: seven buffers of at most 1496.
    assert_eq!(ticks.last().map(|tick| tick.buffer), Some(6));
}
