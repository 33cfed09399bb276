//! Corners under G64: the executed path stays within its tolerance, uses it, and is never slower for
//! it.

use cnc::base::{Axis, Machine, Plane, Point, Tick};
use cnc::interp::{Bound, Corner, Move, MoveKind};
use cnc::path::{self, Segment};
use cnc::verify::Verdict;
use proptest::prelude::*;

use dump::{report, ticks};

#[path = "ways/dump.rs"]
mod dump;

/// A random way: where to, at which feed, for arcs how far the centre is off the chord, and what
/// may become of the corner at its end.
#[derive(Clone, Debug)]
struct Leg {
    by_mm: [f64; 3],
    feed_mm_min: Option<f64>,
    arc: Option<(f64, bool)>,
    corner: Corner,
}

fn corner() -> impl Strategy<Value = Corner> {
    let tolerance = prop_oneof![Just(0.0), 0.001..0.01_f64, 0.01..0.1_f64, 0.1..2.0_f64];
    prop_oneof![
        1 => Just(Corner::Exact),
        1 => Just(Corner::Stop),
        2 => Just(Corner::Blend { tolerance_mm: None, feed_scale: 1.0 }),
        8 => tolerance.prop_map(|mm| Corner::Blend { tolerance_mm: Some(mm), feed_scale: 1.0 }),
    ]
}

fn legs() -> impl Strategy<Value = Vec<Leg>> {
    let way = prop_oneof![-0.05..0.05, -1.0..1.0, -3.0..3.0, Just(0.0)];
    let leg = (
        [way.clone(), way.clone(), way],
        proptest::option::weighted(0.9, 50.0..6000.0_f64),
        proptest::option::weighted(0.4, (-2.0..2.0_f64, any::<bool>())),
        corner(),
    );
    let leg =
        leg.prop_map(|(by_mm, feed_mm_min, arc, corner)| Leg { by_mm, feed_mm_min, arc, corner });
    proptest::collection::vec(leg, 2..10)
}

/// The legs from the machine's work zero on; exact throughout, if so asked.
fn segments(legs: &[Leg], machine: &Machine, exact: bool) -> Vec<Segment> {
    let mut from = machine.work_zero_mm;
    let mut segments = Vec::new();
    for (line, leg) in (1..).zip(legs) {
        let mut to = from;
        for (axis, by_mm) in Axis::LINEAR.into_iter().zip(leg.by_mm) {
            to[axis] += by_mm;
        }
        let kind = match (leg.feed_mm_min, leg.arc) {
            (None, _) => MoveKind::Rapid,
            (Some(feed_mm_min), None) => MoveKind::Line { feed_mm_min },
            (Some(feed_mm_min), Some((off, ccw))) => {
                let [x, y] = [leg.by_mm[0] / 2.0, leg.by_mm[1] / 2.0];
                let center_mm = [from[Axis::X] + x - y * off, from[Axis::Y] + y + x * off];
                MoveKind::Arc { feed_mm_min, plane: Plane::Xy, center_mm, ccw, turns: 0 }
            }
        };
        let corner = match leg.corner {
            Corner::Blend { .. } if exact => Corner::Exact,
            corner => corner,
        };
        let step = Move { line, n: None, from, to, kind, corner, bound: Bound::Free };
        segments.extend(path::segment(&step));
        from = to;
    }
    segments.retain(|segment| segment.length_mm() > 0.0);
    segments
}

/// Travel is the check's business, before any plan.
fn load(name: &str) -> Machine {
    let mut machine = Machine::load(name).unwrap();
    machine.axes.iter_mut().for_each(|axis| axis.travel_mm = None);
    machine
}

/// Ticks with the legs' corners and without blends; the dump is verified.
fn check(legs: &[Leg], machine: &Machine) -> Result<[usize; 2], TestCaseError> {
    let blended = segments(legs, machine, false);
    let ticks_blended = ticks(&blended, machine);
    let report = report(&blended, &ticks_blended, machine);
    prop_assert_eq!(report.verdict, Verdict::Pass, "{}: {:?}", machine.id, report.failures);
    Ok([ticks_blended.len(), ticks(&segments(legs, machine, true), machine).len()])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn blends_keep_every_limit_and_take_no_longer(legs in legs()) {
        for name in ["starmill", "router"] {
            let [blended, exact] = check(&legs, &load(name))?;
            // Each stop may wait for a tick's boundary, and falls on another share of it.
            let rounding = legs.len() + exact / 200;
            prop_assert!(blended <= exact + rounding, "{name}: {blended} ticks, exact {exact}");
        }
    }
}

/// Flat corners of short ways, where jerk lets no curve be fast: they took 15 and 10 % longer with curves.
#[test]
fn corners_of_short_ways_are_no_slower_under_g64() {
    let leg = |[x, y]: [f64; 2], feed, mm| {
        let corner = Corner::Blend { tolerance_mm: Some(mm), feed_scale: 1.0 };
        Leg { by_mm: [x, y, 0.0], feed_mm_min: Some(feed), arc: None, corner }
    };
    let starmill = [[0.491, -0.514], [0.101, 0.095], [-0.132, 0.173], [-0.568, 0.617]]
        .map(|by_mm| leg(by_mm, 1200.0, 0.5));
    let mut router = [[-0.369, -0.195], [-0.0975, -0.0273], [-0.0835, 0.0233], [-0.296, 0.031]]
        .map(|by_mm| leg(by_mm, 12_702.0, 0.1));
    router[1].arc = Some((4.619, false));
    for (name, legs) in [("starmill", starmill), ("router", router)] {
        let [blended, exact] = check(&legs, &load(name)).unwrap();
        assert!(blended <= exact + 1, "{name}: {blended} ticks, exact {exact}");
    }
}

/// A right angle, 20 mm on either side.
fn right_angle(tolerance_mm: Option<f64>, feed_mm_min: f64) -> [Leg; 2] {
    let corner = Corner::Blend { tolerance_mm, feed_scale: 1.0 };
    let feed_mm_min = Some(feed_mm_min);
    [[20.0, 0.0, 0.0], [0.0, 20.0, 0.0]].map(|by_mm| Leg { by_mm, feed_mm_min, arc: None, corner })
}

/// A machine whose accelerations may change at once.
fn without_jerk(name: &str) -> Machine {
    let mut machine = load(name);
    machine.axes.iter_mut().for_each(|axis| axis.jerk_max_mm_s3 = None);
    machine
}

/// Where turning takes jerk, a narrow curve is no gain, and a wide one is.
#[test]
fn limited_jerk_asks_for_wider_curves() {
    let machine = load("router");
    let ticks_at = |mm| check(&right_angle(Some(mm), 3000.0), &machine).unwrap();
    let [narrow, exact] = ticks_at(0.01);
    assert_eq!(narrow, exact);
    let [wide, exact] = ticks_at(1.0);
    assert!(wide < exact, "{wide} ticks, exact {exact}");
}

#[test]
fn a_right_angle_uses_its_tolerance() {
    let machine = without_jerk("router");
    let mut before = usize::MAX;
    for mm in [0.0, 0.01, 0.1, 1.0] {
        let legs = right_angle(Some(mm), 12_000.0);
        let [blended, exact] = check(&legs, &machine).unwrap();
        assert!(blended < before && blended <= exact, "P{mm}: {blended} ticks, exact {exact}");
        before = blended;
        let segments = segments(&legs, &machine, false);
        let ticks = ticks(&segments, &machine);
        let mut steps = machine.nearest_steps(&machine.work_zero_mm);
        let mut corner_mm = machine.work_zero_mm;
        corner_mm[Axis::X] += 20.0;
        let distance = |tick: &Tick| {
            for axis in Axis::LINEAR {
                steps[axis] += i64::from(tick.counts[axis]);
            }
            let at: Point = machine.position_mm(&steps);
            (at[Axis::X] - corner_mm[Axis::X]).hypot(at[Axis::Y] - corner_mm[Axis::Y])
        };
        let nearest_mm = ticks.iter().map(distance).fold(f64::INFINITY, f64::min);
        assert!(nearest_mm <= mm + 0.007, "P{mm}: {nearest_mm} mm off the corner");
        assert!(mm < 0.1 || nearest_mm > 0.9 * (mm - 0.0025), "P{mm}: {nearest_mm} mm off");
    }
}

/// What is cut off under a wide tolerance is no path under a narrow one, nor under G61.
#[test]
fn verify_allows_what_the_program_does() {
    let machine = without_jerk("router");
    let segments = |mm: f64| segments(&right_angle(Some(mm), 6000.0), &machine, false);
    let ticks = ticks(&segments(0.1), &machine);
    for (mm, verdict) in [(0.0, Verdict::Fail), (0.09, Verdict::Fail), (0.1, Verdict::Pass)] {
        let report = report(&segments(mm), &ticks, &machine);
        assert_eq!(report.verdict, verdict, "P{mm}: {:?}", report.failures);
    }
}
