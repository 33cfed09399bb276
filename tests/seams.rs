//! Where node buffers end, over whole plans: against every other choice of small programs, and
//! what it comes to over programs of hours.

use std::convert::Infallible;
use std::f64::consts::TAU;
use std::rc::Rc;

use cnc::base::{Axis, AxisSet, Machine, Plane, Point};
use cnc::path::{Arc, Curve, PathItem, Segment};
use cnc::plan::{self, Feed, Planned, Seam, SeamKind, SeamReport, Seams};
use cnc::step::{self, Summary};
use proptest::prelude::*;

fn items(path: &[PathItem]) -> impl Iterator<Item = Result<PathItem, Infallible>> + '_ {
    path.iter().cloned().map(Ok)
}

fn place(path: &[PathItem], machine: &Machine) -> Seams {
    let Ok(seams) = plan::place(|| items(path), machine, Feed::LookAhead);
    seams
}

fn survey(path: &[PathItem], machine: &Machine, seams: &Seams) -> SeamReport {
    let Ok(report) = plan::survey(items(path), machine, Feed::LookAhead, seams);
    report
}

/// Draws a path move by move.
struct Pen {
    at: Point,
    path: Vec<PathItem>,
}

impl Pen {
    fn new(machine: &Machine) -> Pen {
        Pen { at: machine.work_zero_mm, path: Vec::new() }
    }

    fn go(&mut self, by_mm: [f64; 3], feed_mm_s: Option<f64>) {
        let from_mm = self.at;
        Axis::LINEAR.into_iter().zip(by_mm).for_each(|(axis, by_mm)| self.at[axis] += by_mm);
        let line = self.path.len() as u32 + 1;
        let (curve, corner) = (Curve::Line, Default::default());
        let to_mm = self.at;
        let segment = Segment { line, feed_mm_s, from_mm, to_mm, curve, corner };
        self.path.push(PathItem::from(segment));
    }
}

impl Pen {
    /// An arc to the left that begins in a direction.
    fn arc(&mut self, radius_mm: f64, direction_rad: f64, sweep_rad: f64, feed_mm_s: Option<f64>) {
        let angle_from_rad = direction_rad - 0.25 * TAU;
        let [x, y] = [Axis::X, Axis::Y];
        let center_mm = [
            self.at[x] - radius_mm * angle_from_rad.cos(),
            self.at[y] - radius_mm * angle_from_rad.sin(),
        ];
        self.go([0.0; 3], feed_mm_s);
        let Some(PathItem::Segment(segment)) = self.path.last_mut() else { return };
        let segment = Rc::make_mut(segment);
        let end_rad = angle_from_rad + sweep_rad;
        segment.to_mm[x] = center_mm[0] + radius_mm * end_rad.cos();
        segment.to_mm[y] = center_mm[1] + radius_mm * end_rad.sin();
        segment.curve = Curve::Arc(Arc {
            plane: Plane::Xy,
            center_mm,
            radius_from_mm: radius_mm,
            radius_to_mm: radius_mm,
            angle_from_rad,
            sweep_rad,
        });
        self.at = segment.to_mm;
    }
}

/// What a job comes to with these seams: its time, and the penalty of every stop in a cut. None if
/// a buffer holds more ticks than so many.
fn cost_s(path: &[PathItem], machine: &Machine, seams: &Seams, ticks_max: u32) -> Option<f64> {
    let start = machine.work_zero_mm;
    let mut summary = Summary::default();
    let plan = plan::plan(items(path), machine, Feed::LookAhead, seams, start);
    let (mut ticks, mut longest, mut buffer) = (0, 0, 0);
    for command in step::interpolate(plan, machine, start) {
        let Ok(command) = command;
        summary.command(&command);
        if let cnc::base::Command::Tick(tick) = command {
            ticks = if tick.buffer == buffer { ticks + 1 } else { 1 };
            buffer = tick.buffer;
            longest = longest.max(ticks);
        }
    }
    let cuts = seams.iter().filter(|seam| seam.kind == SeamKind::Cut).count() as f64;
    let cost_s = summary.total_s(machine) + cuts * machine.seam_in_cut_penalty_s;
    (longest <= ticks_max).then_some(cost_s)
}

/// All sets of ends of blocks; a seam next to a rapid is in none of the cuts.
fn all_seams(path: &[PathItem]) -> impl Iterator<Item = Seams> {
    let rapid = |item: &PathItem| matches!(item, PathItem::Segment(s) if s.feed_mm_s.is_none());
    let rapids: Vec<bool> = path.iter().map(rapid).collect();
    let inner = rapids.len() - 1;
    (0..1_u32 << inner).map(move |set| {
        let chosen = (0..inner).filter(|n| set >> n & 1 == 1);
        let seam = |n: usize| {
            let kind = if rapids[n] || rapids[n + 1] { SeamKind::Rapid } else { SeamKind::Cut };
            Seam { segment: n as u64, share: 1.0, kind }
        };
        chosen.map(seam).collect()
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// Among all ends of blocks, by the time that the whole job takes when it is planned and
    /// interpolated, none is better than the choice. What the choice takes for the rounding to
    /// ticks, three a buffer, is left to it.
    #[test]
    fn no_other_choice_is_better(
        moves in proptest::collection::vec((1.0..6.0_f64, -3.0..3.0_f64, 0..3_u8), 2..6),
    ) {
        const ROUNDING_TICKS: u32 = 3;
        let mut machine = Machine::load("starmill").unwrap();
        machine.bus.buffer_ticks = 100;
        // With a limit on jerk the choice goes by a bound of what stops take.
        machine.axes.iter_mut().for_each(|axis| axis.jerk_max_mm_s3 = None);
        let ticks_max = 96;
        let mut pen = Pen::new(&machine);
        for (x, y, kind) in &moves {
            // Ever on in X, so that no corner is a stop.
            let feed_mm_s = (*kind > 0).then_some(10.0);
            let by_mm = if *kind == 1 { [*x, 0.0, 0.0] } else { [*x, *y, 0.0] };
            pen.go(by_mm, feed_mm_s);
        }
        let cost = |seams: &Seams, ticks_max| cost_s(&pen.path, &machine, seams, ticks_max);
        let others = all_seams(&pen.path);
        let least_s =
            others.filter_map(|seams| cost(&seams, ticks_max - ROUNDING_TICKS)).reduce(f64::min);
        let chosen = place(&pen.path, &machine);
        let chosen_s = cost(&chosen, ticks_max);
        prop_assert!(chosen_s.is_some(), "a buffer is too long: {chosen:?}");
        let rounding_s = f64::from(ROUNDING_TICKS) * machine.bus.tick_s() * moves.len() as f64;
        if let (Some(chosen_s), Some(least_s)) = (chosen_s, least_s) {
            prop_assert!(chosen_s <= least_s + rounding_s, "{chosen_s}, {least_s}: {chosen:?}");
        }
    }
}

/// A move of a program at random: length, turn before it or, for an arc, along it, feed.
type Wander = (f64, f64, Option<f64>);

/// Lines, and arcs where a cut turns much, of which some go on as the move before ends.
fn wandering(machine: &Machine, moves: &[Wander]) -> Vec<PathItem> {
    let mut pen = Pen::new(machine);
    let mut angle_rad = 0.3_f64;
    for (length_mm, turn_rad, feed_mm_s) in moves {
        if *turn_rad > 0.3 && feed_mm_s.is_some() {
            pen.arc(2.0 * length_mm, angle_rad, 4.0 * turn_rad, *feed_mm_s);
            angle_rad += 4.0 * turn_rad;
        } else {
            angle_rad += turn_rad;
            let by_mm = [length_mm * angle_rad.cos(), length_mm * angle_rad.sin(), 0.0];
            pen.go(by_mm, *feed_mm_s);
        }
    }
    pen.path
}

/// Ticks up to a seam's place, and from there to the end, waits for ticks' boundaries left out.
fn sides_ticks(path: &[PathItem], machine: &Machine, seams: &Seams, at: &Seam) -> [f64; 2] {
    let mut sides = [0.0; 2];
    for planned in plan::plan(items(path), machine, Feed::LookAhead, seams, machine.work_zero_mm) {
        let Ok(Planned::Profile(profile)) = planned else { continue };
        let segment = u64::from(profile.segment.line) - 1;
        let is_behind = (segment, profile.shares[0]) >= (at.segment, at.share);
        sides[usize::from(is_behind)] += profile.ramp.duration_s() / machine.bus.tick_s();
    }
    sides
}

/// A machine with short buffers, whose axes X and Y stand so many times the jerk: e to this power.
fn stiff(is_big: bool, jerks: Option<[f64; 2]>) -> Machine {
    let name = if is_big { "samples/machines/big-router.toml" } else { "starmill" };
    let mut machine = Machine::load(name).unwrap();
    for (i, axis) in machine.axes.iter_mut().enumerate() {
        let jerk_mm_s3 = axis.jerk_max_mm_s3.zip(jerks);
        axis.jerk_max_mm_s3 = jerk_mm_s3.map(|(jerk, more)| jerk * more[i.min(1)].exp());
    }
    machine.bus.buffer_ticks = 100;
    machine
}

/// What a stop is reckoned with against what it takes, in ticks: the way up to it, with the room that is left
/// there, and all it adds.
#[derive(Debug)]
struct Reckoned {
    before: f64,
    all: f64,
}

/// The stops at ends of blocks that are chosen, one at a time; those inside hang on the length of buffers.
fn stops(path: &[PathItem], machine: &Machine) -> Vec<Reckoned> {
    let mut endless = machine.clone();
    endless.bus.buffer_ticks = 100_000;
    let seams = place(path, machine);
    let stop = |seam: &Seam| {
        let alone: Seams = [*seam].into_iter().collect();
        let cost = survey(path, &endless, &alone).seams.first().copied()?;
        let [stopped, running] =
            [&alone, Seams::NONE].map(|seams| sides_ticks(path, &endless, seams, seam));
        let pads = cost.pads_s / endless.bus.pad_s();
        let before = f64::from(endless.bus.buffer_ticks) - pads - stopped[0];
        let more = stopped.iter().sum::<f64>() - running.iter().sum::<f64>();
        Some(Reckoned { before, all: cost.ramps_s / endless.bus.tick_s() - more })
    };
    seams.iter().filter(|seam| seam.share == 1.0).filter_map(stop).collect()
}

/// No buffer holds more ticks of motion than a node takes.
fn check_lengths(path: &[PathItem], machine: &Machine) -> Result<(), TestCaseError> {
    let seams = place(path, machine);
    // Where a stop takes a whole buffer there is no choice.
    if !survey(path, machine, &seams).above_least_s.is_finite() {
        return Ok(());
    }
    let ticks_max = machine.bus.motion_ticks_max().unwrap_or(0);
    for (ticks, _) in buffers(path, machine, &seams) {
        prop_assert!(ticks <= u64::from(ticks_max), "{ticks} ticks of {ticks_max}: {seams:?}");
    }
    Ok(())
}

/// On a steady line what is reckoned is what a stop takes.
#[test]
fn a_stop_on_a_steady_line_is_reckoned_exactly() {
    let mut machine = Machine::load("starmill").unwrap();
    machine.bus.buffer_ticks = 100_000;
    for feed_mm_s in [1.0, 4.0, 6.0, 15.0] {
        let mut pen = Pen::new(&machine);
        (0..4).for_each(|_| pen.go([10.0, 0.0, 0.0], Some(feed_mm_s)));
        let seam = Seam { segment: 1, share: 1.0, kind: SeamKind::Cut };
        let alone: Seams = [seam].into_iter().collect();
        let ramps_s = survey(&pen.path, &machine, &alone).seams[0].ramps_s;
        let [stopped, running] = [&alone, Seams::NONE]
            .map(|seams| sides_ticks(&pen.path, &machine, seams, &seam).iter().sum::<f64>());
        let over = ramps_s / machine.bus.tick_s() - (stopped - running);
        assert!((-1e-3..0.1).contains(&over), "{feed_mm_s} mm/s: {over} ticks");
    }
}

/// Elsewhere it is mostly a tick more, and some at most; where it may be less a buffer has room for it.
#[test]
fn stops_are_reckoned_within_a_few_ticks() {
    for is_big in [false, true] {
        let machine = stiff(is_big, Some([0.0; 2]));
        let step = |k: u32, of: u32| f64::from(k * 7919 % of) / f64::from(of);
        let wander = |k: u32| {
            (0.3 + step(k, 97), 0.8 * step(k, 61) - 0.4, Some(2.0 + 9.0 * step(k / 5, 13)))
        };
        let path = wandering(&machine, &(0..150).map(wander).collect::<Vec<_>>());
        let stops = stops(&path, &machine);
        assert!(stops.iter().all(|over| over.before > -1e-6 && over.all > -2.0), "{stops:?}");
        let mut over: Vec<f64> = stops.iter().map(|over| over.all).collect();
        over.sort_by(f64::total_cmp);
        assert!(over.len() > 8, "{over:?}");
        assert!(over[over.len() / 2] < 2.0 && over[over.len() - 1] < 12.0, "{over:?}");
    }
}

/// Cases of a slow property: few, or as many as `PROPTEST_CASES` says.
fn cases(few: u32) -> ProptestConfig {
    let asked = std::env::var("PROPTEST_CASES").ok().and_then(|count| count.parse().ok());
    ProptestConfig { max_shrink_iters: 200, ..ProptestConfig::with_cases(asked.unwrap_or(few)) }
}

proptest! {
    #![proptest_config(cases(4))]

    #[test]
    fn buffers_are_never_too_long(
        moves in proptest::collection::vec(
            (0.05..1.5_f64, -0.5..0.5_f64, prop_oneof![Just(None), (1.0..25.0_f64).prop_map(Some)]),
            10..60,
        ),
        chopped in 1.0..12.0_f64,
        is_big in proptest::bool::ANY,
        jerks in proptest::option::weighted(0.8, proptest::array::uniform2(-0.7..2.3_f64)),
    ) {
        let machine = stiff(is_big, jerks);
        check_lengths(&wandering(&machine, &moves), &machine)?;
        let chord = |(way, turn, _): &Wander| (way / chopped, turn / chopped, Some(20.0));
        let chords: Vec<_> = moves.iter().map(chord).collect();
        check_lengths(&wandering(&machine, &chords), &machine)?;
    }
}

/// A finishing program: strokes of less than ten seconds, chopped as CAM does, each with a
/// retract, a rapid back and a plunge.
fn strokes(machine: &Machine, hours: f64) -> Vec<PathItem> {
    const FEED_MM_S: f64 = 8.0;
    let mut pen = Pen::new(machine);
    let count = (hours * 3600.0 / 10.0) as u32;
    for stroke in 0..count {
        let way_mm = 50.0 + f64::from(stroke % 7);
        for k in 0..40 {
            let wave_mm = 0.3 * (f64::from(k) * 0.4).sin();
            pen.go([way_mm / 40.0, 0.0, wave_mm], Some(FEED_MM_S));
        }
        let down_mm = pen.at[Axis::Z] - machine.work_zero_mm[Axis::Z];
        let along_mm = if stroke % 40 < 20 { 0.5 } else { -0.5 };
        pen.go([0.0, 0.0, 5.0], None);
        pen.go([-way_mm, along_mm, 0.0], None);
        pen.go([0.0, 0.0, -5.0 - down_mm], Some(FEED_MM_S));
    }
    pen.path
}

/// Contours in X and Y, one within the other, chopped into chords as CAM does.
fn contours(machine: &Machine, hours: f64) -> Vec<PathItem> {
    const FEED_MM_S: f64 = 5.0;
    const CHORDS: u32 = 60;
    let mut pen = Pen::new(machine);
    let mut way_mm = 0.0;
    while way_mm < hours * 3600.0 * FEED_MM_S {
        for radius_mm in [6.0, 9.0, 13.0, 18.0, 22.0] {
            let chord_mm = TAU * radius_mm / f64::from(CHORDS);
            for k in 0..CHORDS {
                let angle_rad = TAU * f64::from(k) / f64::from(CHORDS);
                let by_mm = [chord_mm * angle_rad.cos(), chord_mm * angle_rad.sin(), 0.0];
                pen.go(by_mm, Some(FEED_MM_S));
            }
            pen.go([0.0, -2.0, 0.0], Some(FEED_MM_S));
            way_mm += TAU * radius_mm + 2.0;
        }
        pen.go([0.0, 10.0, 0.0], Some(FEED_MM_S));
    }
    pen.path
}

/// Ticks of each node buffer and the axes that move in it.
fn buffers(path: &[PathItem], machine: &Machine, seams: &Seams) -> Vec<(u64, AxisSet)> {
    let mut buffers: Vec<(u64, AxisSet)> = Vec::new();
    let mut start = 0;
    for planned in plan::plan(items(path), machine, Feed::LookAhead, seams, machine.work_zero_mm) {
        let Ok(Planned::Profile(profile)) = planned else { continue };
        if buffers.len() <= profile.buffer as usize {
            start = profile.start.tick;
            buffers.push((0, AxisSet::EMPTY));
        }
        let Some((ticks, moving)) = buffers.last_mut() else { continue };
        *ticks = profile.end.boundary() - start;
        let [from, to] = [profile.start_mm(), profile.end_mm()];
        Axis::LINEAR
            .into_iter()
            .filter(|axis| from[*axis] != to[*axis])
            .for_each(|a| moving.insert(a));
    }
    buffers
}

#[test]
fn no_seam_lies_in_a_cut_where_the_tool_is_retracted_every_ten_seconds() {
    let machine = Machine::load("starmill").unwrap();
    let path = strokes(&machine, 3.0);
    let seams = place(&path, &machine);
    let hours = buffers(&path, &machine, &seams).iter().map(|(ticks, _)| *ticks).sum::<u64>()
        as f64
        * machine.bus.tick_s()
        / 3600.0;
    assert!((2.9..3.5).contains(&hours), "{hours} h");
    assert!(seams.iter().count() > 600);
    assert!(seams.iter().all(|seam| seam.kind != SeamKind::Cut));
}

#[test]
fn refills_of_two_axes_cost_a_third_less_than_those_of_all_nodes() {
    let machine = Machine::load("starmill").unwrap();
    let path = contours(&machine, 3.0);
    let buffers = buffers(&path, &machine, &place(&path, &machine));
    let ticks: u64 = buffers.iter().map(|(ticks, _)| *ticks).sum();
    let hours = ticks as f64 * machine.bus.tick_s() / 3600.0;
    assert!((2.9..3.5).contains(&hours), "{hours} h");
    let refill_s = |(ticks, moving): &(u64, AxisSet)| {
        machine.bus.buffer_time(*ticks as f64, *moving).total_s()
    };
    let refills_s: f64 = buffers.iter().map(refill_s).sum();
    let all = Axis::LINEAR.into_iter().collect();
    let all_s: f64 = buffers.iter().map(|(ticks, _)| refill_s(&(*ticks, all))).sum();
    assert!(refills_s <= 0.7 * all_s, "{refills_s} s of {all_s} s");
}

/// A decision is given out after 64 buffers at the latest. Where there are places to rest that loses
/// nothing; where all places are alike, the end of the program may have wanted others.
#[test]
fn what_is_decided_early_is_no_worse() {
    let machine = Machine::load("starmill").unwrap();
    for (path, more_s) in [(strokes(&machine, 0.5), 1e-6), (contours(&machine, 0.5), 0.1)] {
        let report = survey(&path, &machine, &place(&path, &machine));
        assert!(report.seams.len() > 90, "more than are held open");
        assert!((-1e-6..more_s).contains(&report.above_least_s), "{}", report.above_least_s);
    }
}
