//! Speed along the path against F: jobs made at other feeds than the path has.

use cnc::base::{Axis, Machine};
use cnc::path::{Curve, PathItem, Segment};

use super::drawing::{Drawing, steps};
use super::{held, starmill};

/// Lines by so many millimetres, each at its feed in mm/s; none: a rapid.
type Lines = [([f64; 3], Option<f64>)];

fn path(lines: &Lines) -> Vec<PathItem> {
    let add = |drawing: Drawing, (by_mm, feed_mm_s): &([f64; 3], Option<f64>)| {
        let to = std::array::from_fn(|axis| drawing.at[axis] + by_mm[axis]);
        drawing.add(to, *feed_mm_s, Curve::Line)
    };
    lines.iter().fold(Drawing::new(), add).path
}

/// The job of these lines passes; that of the same ones at more than one feed times so much is too fast.
fn check(lines: &Lines, overspeed: f64) {
    let machine = starmill();
    let slow_path = path(lines);
    let report = held(&machine, &slow_path, &steps(&machine, &slow_path), false);
    assert_eq!(report.failures, [""; 0], "{lines:?}");
    let feeds = lines.iter().filter_map(|(_, feed_mm_s)| *feed_mm_s);
    let least_mm_s = feeds.fold(f64::INFINITY, f64::min);
    let faster = |feed_mm_s: f64| feed_mm_s.max(least_mm_s * overspeed);
    let fast: Vec<_> = lines.iter().map(|(by_mm, feed)| (*by_mm, feed.map(faster))).collect();
    let report = held(&machine, &slow_path, &steps(&machine, &path(&fast)), false);
    let is_found = report.failures.iter().any(|failure| failure.starts_with("feed"));
    assert!(is_found, "{lines:?}: {:?}", report.failures);
}

/// A stretch that is run there and back is matched in its order, however slowly; the feed of the way there is no
/// excuse on the way back, but within the tolerance of the turn.
#[test]
fn a_retraced_stretch_has_its_own_feed() {
    let there_and_back =
        |feeds: [f64; 2]| [([0.5, 0.2, 0.0], Some(feeds[0])), ([-0.5, -0.2, 0.0], Some(feeds[1]))];
    check(&there_and_back([0.5, 0.5]), 2.0);
    check(&there_and_back([2.0, 1.0]), 2.0);
}

/// 20 ticks are 0.22 s here: cuts that are over sooner, with rapids before and behind.
#[test]
fn a_short_cut_between_rapids_is_held_to_its_feed() {
    let up = ([0.0, 0.0, 2.0], None);
    let down = ([0.0, 0.0, -2.0], None);
    check(&[([5.0, 0.0, 0.0], None), ([2.0, 0.0, 0.0], Some(1.0)), ([5.0, 0.0, 0.0], None)], 10.0);
    check(&[down, ([0.0, 0.0, -0.5], Some(0.5)), ([0.0, 0.0, 0.5], None), up], 10.0);
}

#[test]
fn a_short_cut_between_faster_ones_is_held_to_its_feed() {
    let fast = ([10.0, 0.0, 0.0], Some(10.0));
    check(&[fast, ([2.0, 0.0, 0.0], Some(1.0)), fast], 8.0);
}

#[test]
fn a_job_shorter_than_a_window_is_held_to_its_feed() {
    check(&[([0.3, 0.0, 0.0], Some(0.1))], 100.0);
}

/// Lines of one axis each, by so much at a feed, which is in degrees where it turns.
type Legs = [(Axis, f64, f64)];

/// How many checks of feed fail, where these lines are driven at other feeds.
fn feeds_found(machine: &Machine, legs: &Legs, driven: &[f64]) -> usize {
    let path = |feeds: &[f64]| {
        let mut at = machine.work_zero_mm;
        let line = |(line, (leg, feed)): (u32, (&(Axis, f64, f64), &f64))| {
            let (from_mm, (axis, by, _)) = (at, *leg);
            at[axis] += by;
            let (curve, corner, feed_mm_s) = (Curve::Line, Default::default(), Some(*feed));
            PathItem::from(Segment { line, feed_mm_s, from_mm, to_mm: at, curve, corner })
        };
        (1..).zip(legs.iter().zip(feeds)).map(line).collect::<Vec<_>>()
    };
    let programmed: Vec<f64> = legs.iter().map(|(.., feed)| *feed).collect();
    let job = steps(machine, &path(driven));
    let report = held(machine, &path(&programmed), &job, true);
    report.failures.iter().filter(|failure| failure.starts_with("feed")).count()
}

/// A quarter turn there and back: turns have feeds of their own, in degrees.
#[test]
fn turning_alone_is_held_to_its_feed() {
    let machine = Machine::load("ideal").unwrap();
    let turns = |feeds: [f64; 2]| [(Axis::A, 90.0, feeds[0]), (Axis::A, -90.0, feeds[1])];
    assert_eq!(feeds_found(&machine, &turns([20.0, 20.0]), &[20.0, 20.0]), 0);
    assert_eq!(feeds_found(&machine, &turns([20.0, 20.0]), &[20.0, 40.0]), 1);
    // Where X, Y and Z rest, which of two turns it is stays open.
    assert_eq!(feeds_found(&machine, &turns([40.0, 20.0]), &[40.0, 20.0]), 0);
}

/// So have secondary axes, in millimetres.
#[test]
fn secondary_axes_alone_are_held_to_their_feed() {
    let machine =
        Machine::load(concat!(env!("CARGO_MANIFEST_DIR"), "/samples/machines/nine-axes.toml"));
    let machine = machine.unwrap();
    for axis in [Axis::U, Axis::V, Axis::W] {
        let legs = [(axis, 5.0, 2.0), (Axis::X, 5.0, 4.0), (axis, -5.0, 2.0)];
        assert_eq!(feeds_found(&machine, &legs, &[2.0, 4.0, 2.0]), 0, "{axis}");
        assert_eq!(feeds_found(&machine, &legs, &[2.0, 4.0, 3.0]), 1, "{axis}");
    }
}

/// A turn's degrees are no excuse for the millimetres beside it, however few.
#[test]
fn a_turn_excuses_no_line_beside_it() {
    let machine = Machine::load("ideal").unwrap();
    let by_mm = 0.9 * machine.path_tolerance_mm;
    let legs = [(Axis::X, by_mm, 0.001), (Axis::A, 90.0, 50.0)];
    assert_eq!(feeds_found(&machine, &legs, &[0.001, 50.0]), 0);
    assert_eq!(feeds_found(&machine, &legs, &[5.0, 50.0]), 1);
}

/// Half the feed is no fault, and is told.
#[test]
fn slower_is_told() {
    let machine = starmill();
    let line = |feed| path(&[([30.0, 0.0, 0.0], Some(feed))]);
    let report = held(&machine, &line(4.0), &steps(&machine, &line(2.0)), false);
    assert_eq!(report.failures, [""; 0]);
    assert!(report.feed_reached_percent.is_some_and(|reached| (49.0..50.0).contains(&reached)));
}
