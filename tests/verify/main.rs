//! Verification: jobs made here by a naive generator pass, and every way to spoil one is found.

use std::convert::Infallible;
use std::f64::consts::{PI, TAU};

use cnc::base::{Axis, AxisMap, Command, Event, Machine, Point, Tick};
use cnc::path::{Curve, PathItem, Segment};
use cnc::verify::{Report, Setup, Verdict, distances, verify};
use proptest::prelude::*;

mod blocks;
mod drawing;
mod feed;

use drawing::{Drawing, drawing, steps, xyz};

fn starmill() -> Machine {
    Machine::load("starmill").expect("built in")
}

/// A whole job of a machine, from its work zero on.
fn setup(machine: &Machine, constant_feed: bool) -> Setup<'_> {
    let start_steps = machine.nearest_steps(&machine.work_zero_mm);
    let tick_us = machine.bus.tick_us;
    let (with_events, with_buffers) = (true, true);
    Setup { machine, tick_us, start_steps, constant_feed, with_events, with_buffers }
}

fn held(machine: &Machine, path: &[PathItem], job: &[Command], constant_feed: bool) -> Report {
    verify(
        &setup(machine, constant_feed),
        || Ok::<_, Infallible>(job.iter().cloned().map(Ok)),
        || Ok::<_, Infallible>(path.iter().cloned().map(Ok)),
    )
    .expect("nothing breaks off")
}

/// The job of the drawing, changed, must fail with a reason that begins so.
fn check_fails(reason: &str, change: impl FnOnce(&mut Vec<Command>)) -> Report {
    let machine = starmill();
    let path = drawing();
    let mut job = steps(&machine, &path);
    change(&mut job);
    let report = held(&machine, &path, &job, false);
    assert_eq!(report.verdict, Verdict::Fail, "{reason}: {report:#?}");
    let found = report.failures.iter().any(|failure| failure.starts_with(reason));
    assert!(found, "{reason}: {:?}", report.failures);
    report
}

fn ticks(job: &mut [Command]) -> Vec<&mut Tick> {
    let mut ticks = Vec::new();
    for command in job {
        if let Command::Tick(tick) = command {
            ticks.push(tick);
        }
    }
    ticks
}

/// Index of the middle tick of an NC line.
fn middle(job: &mut [Command], line: u32) -> usize {
    let ticks = ticks(job);
    let first = ticks.iter().position(|tick| tick.line == line).expect("the line");
    first + ticks.iter().filter(|tick| tick.line == line).count() / 2
}

#[test]
fn a_sound_job_passes() {
    let (machine, path) = (starmill(), drawing());
    let report = held(&machine, &path, &steps(&machine, &path), false);
    assert_eq!(report.failures, [""; 0]);
    assert_eq!(report.verdict, Verdict::Pass);
    assert!((report.tolerance_mm - 0.01366).abs() < 1e-5, "{}", report.tolerance_mm);
    // Rounding alone: half a step on each axis at most, and chords of arcs next to nothing.
    assert!((0.004..0.0088).contains(&report.max_contour_error_mm), "{report:#?}");
    let rms = report.rms_contour_error_mm.expect("matched");
    assert!((0.001..report.max_contour_error_mm).contains(&rms), "{rms}");
    assert!(report.end_error_steps.values().all(|error| *error == 0));
    assert!(report.worst_blocks.len() >= 5);
}

/// What drawings show, tick by tick, is what the report sums up; they end where a job is too far off.
#[test]
fn distances_are_those_of_the_report() {
    let (machine, path) = (starmill(), drawing());
    let mut job = steps(&machine, &path);
    let seen = |job: &[Command], within_mm: f64| {
        let setup = setup(&machine, false);
        let mut seen = Vec::new();
        let commands = || Ok::<_, Infallible>(job.iter().cloned().map(Ok));
        let path = || Ok::<_, Infallible>(path.iter().cloned().map(Ok));
        let take = |tick: u64, mm: f64| seen.push((tick, mm));
        distances(&setup, within_mm, commands, path, take).expect("nothing breaks off");
        seen
    };
    let report = held(&machine, &path, &job, false);
    let all = seen(&job, report.tolerance_mm);
    assert_eq!(all.len() as u64, report.ticks);
    assert!(all.iter().zip(0..).all(|((tick, _), number)| *tick == number));
    let most_mm = all.iter().map(|(_, mm)| *mm).fold(0.0, f64::max);
    assert!(most_mm > 0.5 * report.max_contour_error_mm, "{most_mm}");
    assert!(most_mm <= report.max_contour_error_mm + 2e-5, "{most_mm}");
    // Ten steps more on Y, from a tick in the middle on: beyond the bound there.
    let at = middle(&mut job, 2);
    ticks(&mut job)[at].counts[Axis::Y] += 10;
    assert!((seen(&job, report.tolerance_mm).len() as u64) < report.ticks);
}

#[test]
fn a_job_without_motion_passes() {
    let machine = starmill();
    let path = Drawing::new().event("M30").path;
    let report = held(&machine, &path, &steps(&machine, &path), false);
    assert_eq!((report.verdict, report.ticks), (Verdict::Pass, 0));
}

/// Paths of less than half a step have no motion, and several pieces.
#[test]
fn a_path_shorter_than_a_step_passes() {
    let machine = starmill();
    let there_and_back = Drawing::new().line([0.001, 0.0, 0.0]).line([-0.001, 0.0, 0.0]);
    for drawing in [there_and_back, Drawing::new().arc(0.001, 0.0, 18.0 * PI, 0.002)] {
        let path = drawing.path;
        let report = held(&machine, &path, &steps(&machine, &path), false);
        assert_eq!(report.failures, [""; 0]);
        assert!(report.max_contour_error_mm < 0.004, "{}", report.max_contour_error_mm);
    }
    let path = Drawing::new().line([0.1, 0.0, 0.0]).line([-0.1, 0.0, 0.0]).path;
    let report = held(&machine, &path, &[], false);
    assert_eq!(report.verdict, Verdict::Fail, "a skipped stretch");
}

#[test]
fn a_removed_row_fails() {
    let report = check_fails("end point", |job| {
        let at = job.iter().position(|command| matches!(command, Command::Tick(t) if t.line == 8));
        job.remove(at.expect("a tick") + 40);
    });
    assert!(report.failures[0].starts_with("contour"), "{:?}", report.failures);
}

#[test]
fn a_swap_that_moves_the_path_fails() {
    // A tick of line 8 in exchange with one of line 9: the first runs off by a count a tick.
    let report = check_fails("contour", |job| {
        let (a, b) = (middle(job, 5), middle(job, 8));
        let mut ticks = ticks(job);
        let (first, second) = (ticks[a].counts, ticks[b].counts);
        (ticks[a].counts, ticks[b].counts) = (second, first);
    });
    let worst = report.worst.expect("a place");
    assert!((5..=8).contains(&worst.line), "{worst:?}");
}

#[test]
fn a_count_moved_across_the_path_fails() {
    let report = check_fails("contour", |job| {
        let at = middle(job, 9);
        let mut ticks = ticks(job);
        ticks[at].counts[Axis::Y] += 3;
        ticks[at + 1].counts[Axis::Y] -= 3;
    });
    assert_eq!(report.worst.map(|worst| worst.line), Some(9));
    assert!((0.028..0.033).contains(&report.max_contour_error_mm), "{report:#?}");
}

#[test]
fn a_count_moved_along_the_path_fails() {
    let report = check_fails("acceleration X", |job| {
        let at = middle(job, 9);
        let mut ticks = ticks(job);
        ticks[at].counts[Axis::X] += 3;
        ticks[at + 1].counts[Axis::X] -= 3;
    });
    assert_eq!(report.failures.len(), 1, "{:?}", report.failures);
}

#[test]
fn a_negated_axis_fails() {
    let report = check_fails("contour", |job| {
        ticks(job).into_iter().for_each(|tick| tick.counts[Axis::X] *= -1);
    });
    assert!(report.max_contour_error_mm > 5.0 && !report.max_contour_error_is_lower_bound);
}

#[test]
fn a_skipped_circle_fails() {
    let report = check_fails("contour", |job| {
        job.retain(|command| !matches!(command, Command::Tick(tick) if tick.line == 6));
    });
    // A point stands for the whole circle at best: its diameter, or what lies near it, is missed.
    assert!((2.9..6.1).contains(&report.max_contour_error_mm), "{report:#?}");
    assert_eq!(report.worst.map(|worst| worst.line), Some(6));
}

#[test]
fn a_way_out_and_back_that_is_left_out_at_the_end_is_missed_whole() {
    let machine = starmill();
    let all = Drawing::new().line([5.0, 0.0, 0.0]).line([1.5, 0.0, 0.0]).line([-1.5, 0.0, 0.0]);
    let job = steps(&machine, &all.path[..1]);
    let report = held(&machine, &all.path, &job, false);
    assert_eq!(contour_of(&report), Verdict::Fail);
    assert!((report.max_contour_error_mm - 1.5).abs() < 0.01, "{report:#?}");
}

#[test]
fn a_missing_end_fails() {
    check_fails("end point", |job| job.truncate(job.len() - 10));
    check_fails("events", |job| job.truncate(job.len() - 1));
}

#[test]
fn events_fail_when_they_are_others_or_elsewhere() {
    check_fails("events", |job| job.retain(|c| *c != job_event("G4 P0.5", 7)));
    check_fails("events", |job| job[0] = job_event("M4 S1200", 1));
    let early = |job: &mut Vec<Command>| {
        let at = job.iter().position(|c| *c == job_event("G4 P0.5", 7)).expect("the event");
        let event = job.remove(at);
        let way = job.iter().position(|c| matches!(c, Command::Tick(t) if t.line == 4));
        job.insert(way.expect("a tick") + 50, event);
    };
    let report = check_fails("events", early);
    let reason = report.failures.iter().find(|failure| failure.starts_with("events"));
    assert!(reason.is_some_and(|reason| reason.contains("G4 P0.5 of line 7")), "{reason:?}");
    check_fails("rest", early);
}

fn job_event(text: &str, line: u32) -> Command {
    Command::Event(Event { line, kind: text.parse().expect("an event") })
}

#[test]
fn a_seam_in_motion_fails() {
    check_fails("rest", |job| {
        let at = middle(job, 4);
        ticks(job)[at..].iter_mut().for_each(|tick| tick.buffer += 1);
    });
}

#[test]
fn an_overfull_buffer_fails() {
    check_fails("ticks of a buffer", |job| {
        ticks(job).into_iter().for_each(|tick| tick.buffer = 0);
        let still = Command::Tick(Tick { buffer: 0, line: 1, ..Tick::default() });
        job.splice(1..1, std::iter::repeat_n(still, 1500));
    });
}

#[test]
fn too_fast_fails() {
    // Two ticks' way in one: twice the feed everywhere.
    let report = check_fails("feed", |job| {
        let mut merged = Vec::new();
        for command in job.drain(..) {
            match (merged.last_mut(), command) {
                (Some(Command::Tick(last)), Command::Tick(tick))
                    if last.line == tick.line && last.buffer == 0 =>
                {
                    let sum = AxisMap::from_fn(|axis| last.counts[axis] + tick.counts[axis]);
                    *last = Tick { counts: sum, buffer: 1, ..tick };
                }
                (_, Command::Tick(tick)) => merged.push(Command::Tick(Tick { buffer: 0, ..tick })),
                (_, event) => merged.push(event),
            }
        }
        *job = merged;
        ticks(job).into_iter().for_each(|tick| tick.buffer = 0);
    });
    assert!(report.max_feed_error_percent.is_some_and(|percent| percent > 90.0));
    check_fails("speed X", |job| ticks(job)[30].counts[Axis::X] += 21);
}

#[test]
fn travel_and_lacking_axes_are_found() {
    let machine = starmill();
    let path = Drawing::new().line([0.0, 0.0, 50.5]).path;
    let report = held(&machine, &path, &steps(&machine, &path), false);
    assert_eq!(report.failures.len(), 1, "{:?}", report.failures);
    assert!(report.failures[0].starts_with("beyond travel Z: 0.5 mm"), "{:?}", report.failures);
    check_fails("axis that the machine lacks A", |job| ticks(job)[3].counts[Axis::A] = 1);
}

#[test]
fn constant_feed_reports_accelerations() {
    let machine = starmill();
    let path = Drawing::new().line([8.8, 0.0, 0.0]).path;
    let mut counts = AxisMap::default();
    counts[Axis::X] = 11;
    let job = vec![Command::Tick(Tick { buffer: 0, line: 1, counts }); 80];
    let judged = held(&machine, &path, &job, false);
    assert!(judged.failures.iter().all(|failure| failure.starts_with("rest X")), "{judged:?}");
    assert_eq!(judged.verdict, Verdict::Fail);
    let reported = held(&machine, &path, &job, true);
    assert_eq!(reported.verdict, Verdict::Pass);
    assert!(reported.limits.iter().any(|check| check.verdict == Verdict::Reported));
}

/// The discrete Fréchet distance of two dense samplings, by its definition.
fn discrete_frechet(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let distance = |p: &[f64; 3], q: &[f64; 3]| {
        p.iter().zip(q).map(|(p, q)| (p - q) * (p - q)).sum::<f64>().sqrt()
    };
    let mut column = vec![f64::INFINITY; b.len()];
    for (i, p) in a.iter().enumerate() {
        let mut diagonal = if i == 0 { 0.0 } else { f64::INFINITY };
        let mut below = f64::INFINITY;
        for (j, q) in b.iter().enumerate() {
            let before = if i == 0 && j == 0 { 0.0 } else { column[j].min(below).min(diagonal) };
            diagonal = column[j];
            column[j] = before.max(distance(p, q));
            below = column[j];
        }
    }
    column[b.len() - 1]
}

fn executed(machine: &Machine, job: &[Command], parts: u32) -> Vec<[f64; 3]> {
    let mut at: [f64; 3] = [75.0, 50.0, 50.0];
    let mut points = vec![at];
    for command in job {
        let Command::Tick(tick) = command else { continue };
        let way = Axis::LINEAR.map(|axis| {
            f64::from(tick.counts[axis]) / machine.axis(axis).expect("an axis").steps_per_mm
        });
        for part in 1..=parts {
            let share = f64::from(part) / f64::from(parts);
            points.push(std::array::from_fn(|axis| at[axis] + share * way[axis]));
        }
        at = std::array::from_fn(|axis| at[axis] + way[axis]);
    }
    points
}

fn sampled(path: &[PathItem], parts: u32) -> Vec<[f64; 3]> {
    let mut points = Vec::new();
    for item in path {
        let PathItem::Segment(segment) = item else { continue };
        points.extend((0..=parts).map(|part| {
            let point = segment.point_at(f64::from(part) / f64::from(parts));
            Axis::LINEAR.map(|axis| point[axis])
        }));
    }
    points
}

/// Pieces of a random path: a line, or an arc with its radius, angle, sweep and rise.
#[derive(Clone, Debug)]
enum Piece {
    Line([f64; 3]),
    Arc(f64, f64, f64, f64),
}

fn piece() -> impl Strategy<Value = Piece> {
    let way = || -4.0..4.0f64;
    prop_oneof![
        [way(), way(), way()].prop_map(Piece::Line),
        (0.05..4.0f64, 0.0..TAU, -8.0..8.0f64, -2.0..2.0f64)
            .prop_map(|(radius, angle, sweep, rise)| Piece::Arc(radius, angle, sweep, rise)),
    ]
}

fn draw(pieces: &[Piece]) -> Vec<PathItem> {
    let add = |drawing: Drawing, piece: &Piece| match *piece {
        Piece::Line(way) => drawing.line(way),
        Piece::Arc(radius, angle, sweep, rise) => drawing.arc(radius, angle, sweep, rise),
    };
    pieces.iter().fold(Drawing::new(), add).path
}

fn contour_of(report: &Report) -> Verdict {
    report.limits.iter().find(|check| check.check == "contour").expect("it is there").verdict
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn rounding_any_path_is_within_the_bound(
        pieces in prop::collection::vec(piece(), 1..6),
        at in any::<prop::sample::Index>(),
        axis in 0usize..3,
    ) {
        let (machine, path) = (starmill(), draw(&pieces));
        let mut job = steps(&machine, &path);
        let report = held(&machine, &path, &job, false);
        prop_assert_eq!(contour_of(&report), Verdict::Pass, "{:?}", report);
        prop_assert!(report.end_error_steps.values().all(|error| *error == 0));
        // An axis that jumps 6 steps aside for one tick leaves the path by more than the bound
        // unless it jumps along it.
        let at = at.index(job.len() - 1);
        let axis = Axis::LINEAR[axis];
        for (at, by) in [(at, 6), (at + 1, -6)] {
            if let Command::Tick(tick) = &mut job[at] {
                tick.counts[axis] += by;
            }
        }
        let (points, curve) = (executed(&machine, &job, 1), sampled(&path, 2000));
        let off = |p: &[f64; 3]| {
            let near = |q: &[f64; 3]| (0..3).map(|i| (p[i] - q[i]).powi(2)).sum::<f64>().sqrt();
            curve.iter().map(near).fold(f64::INFINITY, f64::min)
        };
        // Half the gap between samples of the path is up to 0.008 mm.
        if off(&points[at + 1]) > 0.0137 + 0.01 {
            prop_assert_eq!(contour_of(&held(&machine, &path, &job, false)), Verdict::Fail);
        }
    }

    #[test]
    fn the_distance_is_that_of_its_definition(
        pieces in prop::collection::vec(piece(), 1..4),
        changes in prop::collection::vec((any::<prop::sample::Index>(), -40i32..40, 0usize..3), 0..6),
    ) {
        let (machine, path) = (starmill(), draw(&pieces));
        let mut job = steps(&machine, &path);
        // Every eighth tick carries what the seven before it would have made.
        for chunk in job.chunks_mut(8) {
            let mut sum = AxisMap::default();
            for tick in ticks(chunk) {
                sum = AxisMap::from_fn(|axis| sum[axis] + tick.counts[axis]);
                tick.counts = AxisMap::default();
            }
            if let Some(Command::Tick(tick)) = chunk.last_mut() {
                tick.counts = sum;
            }
        }
        job.retain(|c| matches!(c, Command::Tick(tick) if tick.counts != AxisMap::default()));
        prop_assume!(!job.is_empty());
        for (at, by, axis) in changes {
            let at = at.index(job.len());
            ticks(&mut job)[at].counts[Axis::LINEAR[axis]] += by;
        }
        let report = held(&machine, &path, &job, true);
        prop_assert!(!report.max_contour_error_is_lower_bound);
        let (a, b) = (executed(&machine, &job, 6), sampled(&path, 500));
        let want = discrete_frechet(&a, &b);
        // Half of the greatest gap between samples is what sampling can change.
        let gap = |points: &[[f64; 3]]| points.windows(2).map(|pair| {
            (0..3).map(|i| (pair[0][i] - pair[1][i]).powi(2)).sum::<f64>().sqrt()
        }).fold(0.0, f64::max);
        let slack = gap(&a).max(gap(&b)) + 0.02 * want + 1e-4;
        prop_assert!((report.max_contour_error_mm - want).abs() <= slack,
            "{} is not {want} within {slack}", report.max_contour_error_mm);
    }
}

/// A path that turns back: up to the tolerance, tick points are matched before the turn for as
/// long as they may be, then behind it. The speed is still that of the machine.
#[test]
fn a_turn_is_not_too_fast() {
    let machine = Machine::load("ideal").expect("built in");
    let path = Drawing { at: [0.0; 3], ..Drawing::new() }
        .add([-0.0063, -0.0273, 0.0], Some(5.0), Curve::Line)
        .add([0.055, 0.1631, 0.0], Some(5.0), Curve::Line)
        .path;
    let mut job = Vec::new();
    let mut at = machine.nearest_steps(&machine.work_zero_mm);
    let mut way_mm = 0.0;
    for item in &path {
        let PathItem::Segment(segment) = item else { continue };
        while way_mm + 0.005 <= segment.length_mm() {
            way_mm += 0.005;
            let next = machine.nearest_steps(&segment.point_at(way_mm / segment.length_mm()));
            let counts = AxisMap::from_fn(|axis| (next[axis] - at[axis]) as i32);
            job.push(Command::Tick(Tick { buffer: 0, line: segment.line, counts }));
            at = next;
        }
        way_mm -= segment.length_mm();
    }
    let end = machine.nearest_steps(&xyz([0.055, 0.1631, 0.0]));
    let counts = AxisMap::from_fn(|axis| (end[axis] - at[axis]) as i32);
    job.push(Command::Tick(Tick { buffer: 0, line: 2, counts }));
    let report = held(&machine, &path, &job, true);
    assert_eq!(report.verdict, Verdict::Pass, "{:?}", report.failures);
}

/// Lines of X and A together, of A alone there and back, and of X alone.
fn turning() -> Vec<PathItem> {
    let mut path = Vec::new();
    let mut from_mm = Point::ZERO;
    for (line, (x, a)) in (1..).zip([(4.0, 9.0), (4.0, 40.0), (4.0, 20.0), (9.0, 20.0)]) {
        let mut to_mm = from_mm;
        (to_mm[Axis::X], to_mm[Axis::A]) = (x, a);
        let (feed_mm_s, curve, corner) = (Some(10.0), Curve::Line, Default::default());
        path.push(PathItem::from(Segment { line, feed_mm_s, from_mm, to_mm, curve, corner }));
        from_mm = to_mm;
    }
    path
}

#[test]
fn rotary_axes_are_held_tick_by_tick() {
    let (machine, path) = (Machine::load("ideal").expect("built in"), turning());
    let job = steps(&machine, &path);
    let report = held(&machine, &path, &job, false);
    assert_eq!(report.failures, [""; 0]);
    let off = report.limits.iter().find(|check| check.check == "off the path").expect("A");
    assert!(off.axis == Some(Axis::A) && off.value <= 0.5, "{off:?}");
    // A goes ahead of X by 40 steps for 10 ticks, and back again: X, Y and Z do not show it.
    for (line, by) in [(1, 40), (1, -40)] {
        let mut job = job.clone();
        let at = middle(&mut job, line);
        let mut ticks = ticks(&mut job);
        ticks[at].counts[Axis::A] += by;
        ticks[at + 10].counts[Axis::A] -= by;
        let report = held(&machine, &path, &job, true);
        assert_eq!(report.failures.len(), 1, "{:?}", report.failures);
        assert!(report.failures[0].starts_with("off the path A: "), "{:?}", report.failures);
    }
    // An axis that does not move at all.
    let mut job = job;
    ticks(&mut job).into_iter().for_each(|tick| tick.counts[Axis::A] = 0);
    let report = held(&machine, &path, &job, true);
    let found = |reason| report.failures.iter().any(|failure| failure.starts_with(reason));
    assert!(found("off the path A") && found("end point A"), "{:?}", report.failures);
}

/// From rest to rest with one jerk, up, down, down and up, in steps and ticks.
#[test]
fn jerk_is_reported_and_not_judged() {
    const PHASE_TICKS: f64 = 60.0;
    const JERK: f64 = 0.005;
    let cube = |t: f64| JERK * t.max(0.0).powi(3) / 6.0;
    let at = |tick: u32| {
        let t = f64::from(tick);
        let shifted = |phases: f64| cube(t - phases * PHASE_TICKS);
        (cube(t) - 2.0 * shifted(1.0) + 2.0 * shifted(3.0) - shifted(4.0)).round() as i32
    };
    let ticks = 1..=4 * PHASE_TICKS as u32;
    let tick = |tick: u32| {
        let mut counts = AxisMap::default();
        counts[Axis::X] = at(tick) - at(tick - 1);
        Command::Tick(Tick { buffer: 0, line: 1, counts })
    };
    let job: Vec<Command> = ticks.map(tick).collect();
    let mut machine = starmill();
    let path = Drawing::new().rapid([f64::from(at(240)) / 100.0, 0.0, 0.0]).path;
    let mm_s3 = JERK / 100.0 / machine.bus.tick_s().powi(3);
    for (limit, verdict) in [(1.1 * mm_s3, Verdict::Pass), (0.5 * mm_s3, Verdict::Reported)] {
        machine.axes[0].jerk_max_mm_s3 = Some(limit);
        let report = held(&machine, &path, &job, false);
        assert_eq!(report.failures, [""; 0]);
        let jerk = report.limits.iter().find(|check| check.check == "jerk").expect("X");
        // Rounding takes off up to 8 of 40 steps of the third difference over 3 times 20 ticks.
        assert!((0.8 * mm_s3..=mm_s3).contains(&jerk.value), "{jerk:?} of {mm_s3}");
        assert_eq!(jerk.verdict, verdict);
    }
}

/// In the middle of a straight block no axis may make a step of speed: 1.21 steps/tick² it is, and
/// what rounding does.
#[test]
fn a_ramp_that_is_too_steep_fails_where_nothing_turns() {
    let machine = starmill();
    for (accel, is_sound) in [(1.2, true), (1.4, false)] {
        let speeds = [(60, 0.0), (12, accel), (60, 0.0), (14, -1.0)];
        let (mut speed, mut at, mut steps) = (2.0_f64, 0.0_f64, 0);
        let mut job = Vec::new();
        for accel in speeds.into_iter().flat_map(|(ticks, accel)| std::iter::repeat_n(accel, ticks))
        {
            speed += accel;
            at += speed;
            let count = at.round() as i32 - steps;
            steps += count;
            let mut counts = AxisMap::default();
            counts[Axis::X] = count;
            counts[Axis::Y] = steps / 2 - (steps - count) / 2;
            job.push(Command::Tick(Tick { buffer: 0, line: 1, counts }));
        }
        let way = [f64::from(steps) / 100.0, f64::from(steps / 2) / 100.0, 0.0];
        let report = held(&machine, &Drawing::new().rapid(way).path, &job, false);
        let is_steep = |failure: &String| failure.starts_with("acceleration X");
        assert_eq!(!report.failures.iter().any(is_steep), is_sound, "{:?}", report.failures);
    }
}
