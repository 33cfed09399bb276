//! Programs of all kinds of moves: lines, arcs and helices in all planes, splines, rapids, with exact
//! corners, stops and blends between them. Every dump is within all limits that `verify` knows.

use std::f64::consts::TAU;
use std::sync::Arc;

use cnc::base::{Axis, Machine, Plane, Spline};
use cnc::interp::{Bound, Corner, Move, MoveKind};
use cnc::path::{self, Segment};
use cnc::verify::Verdict;
use proptest::prelude::*;

use dump::{report, ticks};

#[path = "ways/dump.rs"]
mod dump;

/// Where to, at which feed (none: a rapid), on which way, and what may become of the corner at its end.
#[derive(Clone, Debug)]
struct Leg {
    by_mm: [f64; 3],
    feed_mm_min: Option<f64>,
    way: Way,
    corner: Corner,
}

#[derive(Clone, Debug)]
enum Way {
    Line,
    /// How far the centre is off the chord's middle, in its halves.
    Arc {
        off: f64,
        ccw: bool,
        turns: u32,
        plane: Plane,
    },
    /// Its points between the ends, from its start; weights and knots of a NURBS.
    Spline {
        degree: usize,
        between_mm: Vec<[f64; 3]>,
        weights: Vec<f64>,
        knots: Vec<f64>,
    },
}

fn feed() -> impl Strategy<Value = f64> {
    prop_oneof![50.0..3000.0_f64, 1000.0..6000.0_f64, 3000.0..30_000.0_f64]
}

fn corner() -> impl Strategy<Value = Corner> {
    let tolerance = prop_oneof![Just(0.0), 0.001..0.01_f64, 0.01..0.1_f64, 0.1..2.0_f64];
    prop_oneof![
        3 => Just(Corner::Exact),
        1 => Just(Corner::Stop),
        1 => Just(Corner::Blend { tolerance_mm: None, feed_scale: 1.0 }),
        5 => tolerance.prop_map(|mm| Corner::Blend { tolerance_mm: Some(mm), feed_scale: 1.0 }),
    ]
}

fn by_mm() -> impl Strategy<Value = [f64; 3]> {
    let way = || prop_oneof![-0.05..0.05_f64, -1.0..1.0_f64, -5.0..5.0_f64, Just(0.0)];
    [way(), way(), way()]
}

fn straight_or_round() -> impl Strategy<Value = ([f64; 3], Way)> {
    let plane = prop_oneof![Just(Plane::Xy), Just(Plane::Zx), Just(Plane::Yz)];
    let arc = (-3.0..3.0_f64, any::<bool>(), 0..3_u32, plane);
    let arc = arc.prop_map(|(off, ccw, turns, plane)| Way::Arc { off, ccw, turns, plane });
    (by_mm(), prop_oneof![Just(Way::Line), arc])
}

/// Splines of any degree, with knots of any multiplicity, from a hundredth of a millimetre on.
fn spline() -> impl Strategy<Value = ([f64; 3], Way)> {
    let scale_mm = prop_oneof![Just(0.02), Just(0.2), Just(1.0), Just(5.0)];
    (1..6_usize, 0..5_usize, scale_mm, any::<bool>()).prop_flat_map(
        |(degree, more, mm, is_flat)| {
            let count = degree + 1 + more;
            let height_mm = if is_flat { 1e-9 } else { mm };
            let at = [-mm..mm, -mm..mm, -height_mm..height_mm];
            let points = proptest::collection::vec(at, count - 1);
            let weights = prop_oneof![
                Just(vec![1.0; count]),
                proptest::collection::vec(0.2..5.0_f64, count),
            ];
            let inner = proptest::collection::vec(1..7_u32, more);
            (points, weights, inner).prop_map(move |(mut between_mm, weights, mut inner)| {
                inner.sort_unstable();
                let ends = |knot| std::iter::repeat_n(knot, degree + 1);
                let knots =
                    ends(0.0).chain(inner.into_iter().map(f64::from)).chain(ends(7.0)).collect();
                let by_mm = between_mm.pop().unwrap_or_default();
                (by_mm, Way::Spline { degree, between_mm, weights, knots })
            })
        },
    )
}

fn legs(way: impl Strategy<Value = ([f64; 3], Way)>) -> impl Strategy<Value = Vec<Leg>> {
    let feed = proptest::option::weighted(0.9, feed());
    let leg = (way, feed, corner()).prop_map(|((by_mm, way), feed_mm_min, corner)| Leg {
        by_mm,
        feed_mm_min,
        way,
        corner,
    });
    proptest::collection::vec(leg, 1..8)
}

/// There and back along about one direction, by about the path tolerance, at feeds of all orders of
/// magnitude: what was executed lies beside ways of several feeds at once.
fn tiny_legs() -> impl Strategy<Value = Vec<Leg>> {
    let feed = prop_oneof![
        3 => (0.5..4.1_f64).prop_map(|digits| Some(libm::exp10(digits))),
        1 => Just(None),
    ];
    let leg = (0.004..0.04_f64, -0.3..0.3_f64, any::<bool>(), feed);
    let legs = proptest::collection::vec(leg, 2..10);
    (0.0..TAU, legs).prop_map(|(course_rad, legs)| {
        let leg = |(length_mm, off_rad, is_back, feed_mm_min): (f64, f64, bool, _)| {
            let (sin, cos) = libm::sincos(course_rad + off_rad);
            let length_mm = if is_back { -length_mm } else { length_mm };
            let by_mm = [length_mm * cos, length_mm * sin, 0.0];
            Leg { by_mm, feed_mm_min, way: Way::Line, corner: Corner::Exact }
        };
        legs.into_iter().map(leg).collect()
    })
}

/// The legs from the machine's work zero on.
fn segments(legs: &[Leg], machine: &Machine) -> Vec<Segment> {
    let mut from = machine.work_zero_mm;
    let mut segments = Vec::new();
    for (line, leg) in (1..).zip(legs) {
        let away = |by_mm: &[f64; 3]| {
            let mut at = from;
            Axis::LINEAR.into_iter().zip(by_mm).for_each(|(axis, by_mm)| at[axis] += by_mm);
            at
        };
        let to = away(&leg.by_mm);
        let kind = match (leg.feed_mm_min, &leg.way) {
            (None, _) => MoveKind::Rapid,
            (Some(feed_mm_min), Way::Line) => MoveKind::Line { feed_mm_min },
            (Some(feed_mm_min), &Way::Arc { off, ccw, turns, plane }) => {
                let [p, q] = plane.axes();
                let [x, y] = [0.5 * (to[p] - from[p]), 0.5 * (to[q] - from[q])];
                let center_mm = [from[p] + x - y * off, from[q] + y + x * off];
                MoveKind::Arc { feed_mm_min, plane, center_mm, ccw, turns }
            }
            (Some(feed_mm_min), Way::Spline { degree, between_mm, weights, knots }) => {
                let points = [vec![from], between_mm.iter().map(away).collect(), vec![to]].concat();
                match Spline::new(*degree, points, weights.clone(), knots.clone()) {
                    Ok(curve) => MoveKind::Spline { feed_mm_min, curve: Arc::new(curve) },
                    Err(_) => MoveKind::Line { feed_mm_min },
                }
            }
        };
        let (corner, bound) = (leg.corner, Bound::Free);
        segments.extend(path::segment(&Move { line, n: None, from, to, kind, corner, bound }));
        from = to;
    }
    segments.retain(|segment| segment.length_mm() > 0.0);
    segments
}

fn check(legs: &[Leg], machine: &Machine) -> Result<(), TestCaseError> {
    let segments = segments(legs, machine);
    let ticks = ticks(&segments, machine);
    let report = report(&segments, &ticks, machine);
    prop_assert_eq!(report.verdict, Verdict::Pass, "{}: {:?}", machine.id, report.failures);
    Ok(())
}

/// Built-in machines without limits of travel, which are the check's business; with their limits on
/// jerk and without any.
fn machines() -> Vec<Machine> {
    let mut machines = Vec::new();
    for name in ["starmill", "router", "ideal"] {
        let mut machine = Machine::load(name).unwrap();
        machine.axes.iter_mut().for_each(|axis| axis.travel_mm = None);
        machines.push(machine.clone());
        let has_jerk = machine.axes.iter().any(|axis| axis.jerk_max_mm_s3.is_some());
        machine.axes.iter_mut().for_each(|axis| axis.jerk_max_mm_s3 = None);
        machines.extend(has_jerk.then_some(machine));
    }
    machines
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2))]

    #[test]
    fn lines_and_arcs_keep_every_limit(legs in legs(straight_or_round())) {
        for machine in machines() {
            check(&legs, &machine)?;
        }
    }

    #[test]
    fn splines_keep_every_limit(legs in legs(spline())) {
        for machine in machines() {
            check(&legs, &machine)?;
        }
    }

    #[test]
    fn all_kinds_of_moves_keep_every_limit(
        legs in legs(prop_oneof![3 => straight_or_round(), 1 => spline()]),
    ) {
        for machine in machines() {
            check(&legs, &machine)?;
        }
    }
}

proptest! {
    // They are short.
    #![proptest_config(ProptestConfig::with_cases(50))]

    #[test]
    fn feeds_of_ways_within_the_tolerance_are_not_taken_for_each_other(legs in tiny_legs()) {
        for machine in machines() {
            check(&legs, &machine)?;
        }
    }
}
