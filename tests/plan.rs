//! What must hold for every plan and its ticks, over random paths.

use std::convert::Infallible;

use cnc::base::{Axis, Command, Machine, Plane, Point, Tick};
use cnc::interp::{Bound, Move, MoveKind};
use cnc::path::{self, PathItem, Segment};
use cnc::plan::{self, Feed, Planned};
use cnc::step;
use proptest::prelude::*;

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
    let mut segments = Vec::new();
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
        let line = i as u32 + 1;
        let corner = Default::default();
        segments.extend(path::segment(&Move {
            line,
            n: None,
            from: at,
            to,
            kind,
            corner,
            bound: Bound::Free,
        }));
        at = to;
    }
    segments.retain(|segment| segment.length_mm() > 0.0);
    segments
}

fn run(segments: &[Segment], machine: &Machine, feed: Feed) -> (Vec<plan::Profile>, Vec<Tick>) {
    let start = machine.work_zero_mm;
    let items = segments.iter().cloned().map(|s| Ok::<_, Infallible>(PathItem::Segment(s)));
    let mut profiles = Vec::new();
    let plan = plan::plan(items, machine, feed, start).inspect(|planned| {
        let Ok(Planned::Profile(profile)) = planned else { unreachable!() };
        profiles.push(profile.as_ref().clone());
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
    for tick in &ticks {
        for axis in &machine.axes {
            prop_assert!(tick.counts[axis.axis].unsigned_abs() <= machine.count_max(axis));
        }
    }
    if let Some(max) = machine.bus.motion_ticks_max() {
        let runs = ticks.chunk_by(|a, b| a.buffer == b.buffer);
        for (i, run) in runs.enumerate() {
            prop_assert_eq!(run[0].buffer as usize, i, "buffers count up");
            prop_assert!(run.len() <= max as usize, "{} ticks in a buffer", run.len());
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn every_axis_is_within_half_a_step(legs in legs(), constant in any::<bool>()) {
        let feed = if constant { Feed::Constant } else { Feed::ExactStop };
        for name in ["starmill", "router", "ideal"] {
            check(&legs, &Machine::load(name).unwrap(), feed)?;
        }
    }

    /// |q(n+1) - 2q(n) + q(n-1)| stays within the axis's acceleration and what rounding makes of
    /// it, seams and ends counted as rest.
    #[test]
    fn accelerations_are_kept(legs in legs()) {
        let machine = Machine::load("starmill").unwrap();
        let (_, ticks) = run(&segments(&legs, &machine), &machine, Feed::ExactStop);
        let tick_s = machine.bus.tick_s();
        for run in ticks.chunk_by(|a, b| a.buffer == b.buffer) {
            for axis in &machine.axes {
                let rest = std::iter::once(0);
                let counts: Vec<i32> = rest.clone()
                    .chain(run.iter().map(|tick| tick.counts[axis.axis])).chain(rest).collect();
                let limit = axis.accel_max_mm_s2 * tick_s * tick_s * axis.steps_per_mm + 2.0;
                for pair in counts.windows(2) {
                    let change = f64::from(pair[1] - pair[0]);
                    prop_assert!(change.abs() <= limit, "{}: {change} > {limit}", axis.axis);
                }
            }
        }
    }
}

#[test]
fn a_move_longer_than_a_buffer_is_ramped_down_and_up() {
    let machine = Machine::load("starmill").unwrap();
    let leg = Leg { by_mm: [50.0, 20.0, 0.0], feed_mm_min: Some(30.0), arc: None };
    let (profiles, ticks) = run(&segments(&[leg], &machine), &machine, Feed::ExactStop);
    // 53.85 mm at 0.5 mm/s are 107.7 s, or 9791 ticks: seven buffers of at most 1496.
    assert_eq!(profiles.len(), 7);
    assert_eq!(ticks.last().map(|tick| tick.buffer), Some(6));
    assert!(profiles.iter().all(|profile| profile.ramp.is_ramped()));
}
