//! The choice against every other: all sets of places of small cases, with the cost written down
//! anew from what the machine does.

use std::convert::Infallible;

use proptest::prelude::*;

use super::*;
use crate::base::{Axis, AxisSet};
use crate::path::{Curve, Segment};
use crate::plan::survey::Survey;

/// Entries of a node's buffer in these cases, and how many of them may hold motion.
const ENTRIES: u32 = 60;
const TICKS_MAX: f64 = 56.0;

/// A place as a case has it: ticks since the one before, what a stop adds before and after it, its
/// kind (0 rest, 1 rapid, 2 cut, 3 inside a cut), the axes that move on the way to it.
type Case = (f64, f64, f64, u8, u16, bool);

fn places(cases: &[Case]) -> Vec<Place> {
    let mut at_ticks = 0.0;
    let place = |(n, case): (usize, &Case)| {
        let (ticks, before, after, kind, axes, is_forced) = *case;
        at_ticks += ticks;
        let kinds = [SeamKind::Rest, SeamKind::Rapid, SeamKind::Cut, SeamKind::Cut];
        let rests = kind == 0 || is_forced;
        Place {
            segment: n as u64,
            share: 1.0,
            kind: kinds[usize::from(kind)],
            is_inside: kind == 3,
            is_forced,
            at_ticks,
            before_ticks: if rests { 0.0 } else { before },
            after_ticks: if rests { 0.0 } else { after },
            moving: Axis::LINEAR.into_iter().filter(|a| axes >> *a as u16 & 1 == 1).collect(),
            ..Place::start()
        }
    };
    cases.iter().enumerate().map(place).collect()
}

/// The cost of stops at these places, by what the nodes do: bus.md's bytes, at 10 bits each. None
/// if a buffer is too long, or a place is passed where one has to end.
fn cost_s(places: &[Place], stops: &[usize], machine: &Machine) -> Option<f64> {
    let byte_s = 10.0 / f64::from(machine.bus.baud);
    // Pings: 2 bytes, an answer, 6 bytes, 3 times; fill: 2 bytes, an answer, the entries, an answer;
    // 4 ms of listening.
    let node_s = byte_s * f64::from(3 * 9 + 3 + ENTRIES + 1) + 4e-3;
    let pad_s = 2.0 * byte_s + 26e-6;
    let last = places.len() - 1;
    let (mut from, mut sum_s) = (None, 0.0);
    for to in stops.iter().copied().chain([last]) {
        let first = from.map_or(0, |from: usize| from + 1);
        if places[first..to].iter().any(|place| place.is_forced) {
            return None;
        }
        let start = from.map_or((0.0, 0.0), |n: usize| (places[n].at_ticks, places[n].after_ticks));
        let ticks = places[to].at_ticks + places[to].before_ticks - start.0 + start.1;
        if ticks > TICKS_MAX {
            return None;
        }
        let axes = places[first..=to].iter().fold(AxisSet::EMPTY, |a, p| a.union(p.moving));
        sum_s += node_s * axes.len() as f64 + 2.0 * byte_s;
        sum_s += pad_s * (f64::from(ENTRIES) - ticks);
        let place = &places[to];
        sum_s += (place.before_ticks + place.after_ticks) * f64::from(machine.bus.tick_us) * 1e-6;
        sum_s += match (place.kind, place.is_inside) {
            (SeamKind::Cut, false) => machine.seam_in_cut_penalty_s,
            (SeamKind::Cut, true) => machine.seam_in_cut_penalty_s + 1e6,
            _ => 0.0,
        };
        from = Some(to);
    }
    Some(sum_s)
}

fn check(cases: &[Case]) -> Result<(), TestCaseError> {
    let mut machine = Machine::load("starmill").unwrap();
    machine.bus.buffer_ticks = ENTRIES;
    let places = places(cases);
    let inner = places.len() - 1;
    let least_s = |without: Option<usize>| {
        let all = (0..1_u32 << inner).filter(|set| without.is_none_or(|n| set >> n & 1 == 0));
        let stops = all.map(|set| (0..inner).filter(|n| set >> n & 1 == 1).collect::<Vec<_>>());
        stops.filter_map(|stops| cost_s(&places, &stops, &machine)).reduce(f64::min)
    };
    let mut choice = Choice::new(&machine, TICKS_MAX);
    places.iter().for_each(|place| choice.push(place.clone()));
    let seams: Seams = choice.finish().into_iter().collect();
    let Some(best_s) = least_s(None) else { return Ok(()) };
    let mut stops: Vec<usize> = seams.iter().map(|seam| seam.segment as usize).collect();
    stops.extend((0..inner).filter(|n| places[*n].is_forced));
    stops.sort_unstable();
    let chosen_s = cost_s(&places, &stops, &machine);
    let chosen_s = chosen_s.ok_or_else(|| TestCaseError::fail(format!("too long: {stops:?}")))?;
    prop_assert!((chosen_s - best_s).abs() < 1e-5, "{stops:?}: {chosen_s}, least {best_s}");

    let mut survey = Survey::new(&machine, TICKS_MAX, &seams);
    places.iter().for_each(|place| survey.push(place.clone()));
    let report = survey.finish();
    prop_assert!(report.above_least_s.abs() < 1e-5);
    prop_assert_eq!(report.seams.len(), stops.len());
    for (seam, n) in report.seams.iter().zip(stops) {
        let more_s = seam.next_best.map(|best| best.more_s + 1e6 * best.more_inside as f64);
        let expected_s = least_s(Some(n)).map(|least_s| least_s - best_s);
        match (more_s, expected_s) {
            (Some(more_s), Some(expected_s)) => prop_assert!((more_s - expected_s).abs() < 1e-5),
            (more_s, expected_s) => prop_assert_eq!(more_s, expected_s),
        }
    }
    Ok(())
}

proptest! {
    #[test]
    fn the_choice_is_the_least_of_all(
        cases in proptest::collection::vec(
            (2.0..30.0_f64, 0.0..6.0_f64, 0.0..6.0_f64, 0..4_u8, 1..8_u16,
             proptest::bool::weighted(0.1)),
            1..11,
        ),
    ) {
        check(&cases)?;
    }

    /// Where everything costs the same, the later place.
    #[test]
    fn ties_go_to_the_later_place(ticks in 2..20_u32) {
        let mut machine = Machine::load("starmill").unwrap();
        machine.bus.buffer_ticks = ENTRIES;
        let cases = vec![(f64::from(ticks), 0.0, 0.0, 0, 7, false); (60 / ticks + 1) as usize];
        let mut choice = Choice::new(&machine, TICKS_MAX);
        places(&cases).into_iter().for_each(|place| choice.push(place));
        let seams = choice.finish();
        let latest = (TICKS_MAX / f64::from(ticks)) as u64 - 1;
        prop_assert_eq!(seams.iter().map(|seam| seam.segment).collect::<Vec<_>>(), [latest]);
    }
}

/// A stop inside a block of a cut that another choice does without is told as such, and not as its weight in seconds.
#[test]
fn stops_inside_are_no_seconds() {
    let mut machine = Machine::load("starmill").unwrap();
    machine.bus.buffer_ticks = ENTRIES;
    let case = |kind| (20.0, 0.0, 0.0, kind, 1, false);
    let places = places(&[case(0), case(3), case(0)]);
    for (chosen, inside) in [(0, 0), (1, 1)] {
        let Place { segment, share, kind, .. } = places[chosen];
        let seams: Seams = [Seam { segment, share, kind }].into_iter().collect();
        let mut survey = Survey::new(&machine, TICKS_MAX, &seams);
        places.iter().for_each(|place| survey.push(place.clone()));
        let report = survey.finish();
        assert_eq!(report.above_least_inside, inside);
        let penalty_s = machine.seam_in_cut_penalty_s * inside as f64;
        assert!((report.above_least_s - penalty_s).abs() < 0.1, "{}", report.above_least_s);
    }
}

/// Eight moves on the STARMILL with buffers of 100 ticks: length, turn before it, feed.
const REACHES_TOO_FAR: [(f64, f64, Option<f64>); 8] = [
    (0.9, 0.37, Some(2.3)),
    (1.5, -0.2, None),
    (0.6, 0.0, Some(12.6)),
    (0.4, 0.34, None),
    (1.4, 0.0, Some(19.3)),
    (0.3, -0.1, Some(9.0)),
    (0.05, 0.33, Some(9.1)),
    (1.2, -0.4, None),
];

/// A stop takes so much longer here than reckoned that the first choice has a buffer of 97 ticks, where 96 is
/// the most: the second has none.
#[test]
fn a_buffer_that_is_too_long_in_the_plan_is_chosen_anew() {
    let mut machine = Machine::load("starmill").unwrap();
    machine.bus.buffer_ticks = 100;
    let (mut at_mm, mut angle_rad) = (machine.work_zero_mm, 0.3_f64);
    let items = REACHES_TOO_FAR.map(|(length_mm, turn_rad, feed_mm_s)| {
        angle_rad += turn_rad;
        let from_mm = at_mm;
        at_mm[Axis::X] += length_mm * libm::cos(angle_rad);
        at_mm[Axis::Y] += length_mm * libm::sin(angle_rad);
        let (curve, corner) = (Curve::Line, Default::default());
        Segment { line: 1, feed_mm_s, from_mm, to_mm: at_mm, curve, corner }
    });
    let path = || items.iter().cloned().map(|item| Ok::<_, Infallible>(PathItem::from(item)));
    let most = |seams: &Seams| {
        let Ok(most) = most_ticks(plan(path(), &machine, Feed::LookAhead, seams, Point::ZERO));
        most
    };
    let Ok(choice) = choose(path(), &machine, Feed::LookAhead, 96.0, UNSURE_TICKS);
    assert_eq!(most(&choice.finish().into_iter().collect()), 97.0);
    let Ok(seams) = place(path, &machine, Feed::LookAhead);
    assert_eq!(seams.unsure_ticks(), 2.0 * UNSURE_TICKS + 1.0);
    assert!(most(&seams) <= 96.0, "{seams:?}");
}
