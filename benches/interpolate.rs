//! Planning and interpolating, with and without writing the dump: million ticks a second; planning
//! alone: segments a second; and all of it from text to dump: blocks a second, on the STARMILL, where
//! seams are placed, and on a fast router, where there are none and a block takes 0.8 ms. The reference of
//! ticks is a plain digital differential analyser at constant speed, of a program its check.

use std::convert::Infallible;
use std::hint::black_box;

use cnc::base::{Axis, AxisMap, Command, Machine, Plane, Point, Source, Tick};
use cnc::interp::{self, Options};
use cnc::path::{self, Arc, Curve, PathItem, Segment};
use cnc::plan::{self, Feed, Seams};
use cnc::step;
use cnc::tape::{Encoding, Header, Origin, Writer};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

/// A program of equal segments there and back.
fn there_and_back(segment: Segment, count: usize) -> Vec<Segment> {
    let back = Segment { from_mm: segment.to_mm, to_mm: segment.from_mm, ..segment.clone() };
    std::iter::repeat_n([segment, back], count / 2).flatten().collect()
}

fn line(by_mm: [f64; 3], machine: &Machine) -> Segment {
    let from_mm = machine.work_zero_mm;
    let mut to_mm = from_mm;
    Axis::LINEAR.into_iter().zip(by_mm).for_each(|(axis, by)| to_mm[axis] += by);
    let (feed_mm_s, curve, corner) = (Some(10.0), Curve::Line, Default::default());
    Segment { line: 1, feed_mm_s, from_mm, to_mm, curve, corner }
}

fn circle(machine: &Machine) -> Segment {
    let at: Point = machine.work_zero_mm;
    let mut circle = line([0.0; 3], machine);
    circle.curve = Curve::Arc(Arc {
        plane: Plane::Xy,
        center_mm: [at[Axis::X] - 20.0, at[Axis::Y]],
        radius_from_mm: 20.0,
        radius_to_mm: 20.0,
        angle_from_rad: 0.0,
        sweep_rad: std::f64::consts::TAU,
    });
    circle
}

fn commands(segments: &[Segment], machine: &Machine) -> impl Iterator<Item = Command> {
    let start = machine.work_zero_mm;
    let path = segments.iter().cloned().map(|s| Ok::<_, Infallible>(PathItem::from(s)));
    let plan = plan::plan(path, machine, Feed::LookAhead, Seams::NONE, start);
    step::interpolate(plan, machine, start).map(|command| match command {
        Ok(command) => command,
        Err(never) => match never {},
    })
}

fn count(segments: &[Segment], machine: &Machine) -> u64 {
    commands(segments, machine)
        .filter(|command| matches!(black_box(command), Command::Tick(_)))
        .count() as u64
}

fn write(segments: &[Segment], machine: &Machine) {
    let mut writer = Writer::new(std::io::sink(), &header(machine)).expect("a sink takes all");
    for command in commands(segments, machine) {
        writer.command(&command).expect("a sink takes all");
    }
    writer.finish().expect("a sink takes all");
}

fn header(machine: &Machine) -> Header {
    let origin = |name: &str| Origin { name: name.to_owned(), sha256: [0; 32] };
    Header {
        tool: "bench".to_owned(),
        program: origin("bench"),
        inputs: Vec::new(),
        options: Vec::new(),
        machine: origin("starmill"),
        tick_us: machine.bus.tick_us,
        steps_per_mm: machine.axes.iter().map(|axis| (axis.axis, axis.steps_per_mm)).collect(),
        start_steps: machine.nearest_steps(&machine.work_zero_mm),
        encoding: Encoding::Counts,
    }
}

/// The reference: each axis adds its way of a tick and rounds, in as many ticks.
fn dda(segments: &[Segment], machine: &Machine, ticks: u64) -> i64 {
    let (mut at, mut steps, mut sum) = (machine.work_zero_mm, AxisMap::<i64>::default(), 0);
    let each = ticks / segments.len() as u64;
    for segment in segments {
        let way = AxisMap::from_fn(|axis| segment.to_mm[axis] - segment.from_mm[axis]);
        let by = AxisMap::from_fn(|axis| way[axis] / each as f64);
        for _ in 0..each {
            let mut tick = Tick { buffer: 0, line: segment.line, ..Tick::default() };
            for profile in &machine.axes {
                let axis = profile.axis;
                at[axis] += by[axis];
                let next = (at[axis] * profile.steps_per_mm).round_ties_even() as i64;
                tick.counts[axis] = (next - steps[axis]) as i32;
                steps[axis] = next;
            }
            sum += i64::from(black_box(tick).counts[Axis::X]);
        }
    }
    sum
}

/// Planning alone: of so many segments that are there already, again and again the same.
fn profiles(items: &[PathItem], count: usize, machine: &Machine) -> usize {
    let path = items.iter().cycle().take(count).cloned().map(Ok::<_, Infallible>);
    let start = machine.work_zero_mm;
    plan::plan(path, machine, Feed::LookAhead, Seams::NONE, start).map(black_box).count()
}

/// A circle that closes, in chords.
fn chopped_circle(count: u32, feed_mm_s: f64, machine: &Machine) -> Vec<Segment> {
    let at = |k: u32| {
        let angle_rad = f64::from(k % count) / f64::from(count) * std::f64::consts::TAU;
        let mut at_mm = machine.work_zero_mm;
        at_mm[Axis::X] += 30.0 * angle_rad.cos() - 30.0;
        at_mm[Axis::Y] += 30.0 * angle_rad.sin();
        at_mm
    };
    let (feed_mm_s, curve, corner) = (Some(feed_mm_s), Curve::Line, Default::default());
    let chord = |k| {
        let (from_mm, to_mm, curve) = (at(k), at(k + 1), curve.clone());
        Segment { line: 1, feed_mm_s, from_mm, to_mm, curve, corner }
    };
    (0..count).map(chord).collect()
}

/// The same machine without limits on jerk.
fn without_jerk(machine: &Machine) -> Machine {
    let mut machine = machine.clone();
    machine.axes.iter_mut().for_each(|profile| profile.jerk_max_mm_s3 = None);
    machine
}

/// A circle in chords of 0.1 to 0.5 mm.
fn chords(count: u32, feed_mm_min: u32) -> String {
    let (mut text, mut angle_rad) = (format!("G21 G90 F{feed_mm_min}\n"), 0.0_f64);
    for k in 0..count {
        angle_rad += (0.1 + 0.4 * f64::from(k * 7919 % 1000) / 1000.0) / 30.0;
        let [x, y] = [30.0 * angle_rad.cos() - 30.0, 30.0 * angle_rad.sin()];
        text += &format!("G1 X{x:.3} Y{y:.3}\n");
    }
    text + "M30\n"
}

/// From text to dump, in the passes that the command takes: one to check the program, one to place the ends of
/// node buffers and one to count what they hold in the plan, where there are any, one for the dump.
fn text_to_dump(source: &Source, machine: &Machine) {
    let options = Options::default();
    let checked = interp::check(source, machine, &options, 10).expect("it can be read");
    assert_eq!(checked.errors, 0);
    let path = || path::segments(interp::motions(source, machine, &options), machine);
    let seams = plan::place(path, machine, Feed::LookAhead).expect("it was checked");
    let start = machine.work_zero_mm;
    let plan = plan::plan(path(), machine, Feed::LookAhead, &seams, start);
    let mut writer = Writer::new(std::io::sink(), &header(machine)).expect("a sink takes all");
    for command in step::interpolate(plan, machine, start) {
        writer.command(&command.expect("it was checked")).expect("a sink takes all");
    }
    writer.finish().expect("a sink takes all");
}

fn interpolate(criterion: &mut Criterion) {
    let machine = Machine::load("starmill").expect("a built-in profile");
    let mut group = criterion.benchmark_group("interpolate");
    let plain = without_jerk(&machine);
    let long = there_and_back(line([30.0, 20.0, 10.0], &machine), 200);
    let cases = [
        ("long lines", &machine, long.clone()),
        ("long lines without jerk", &plain, long),
        ("circles", &machine, vec![circle(&machine); 100]),
        ("short lines", &machine, there_and_back(line([0.05, 0.02, 0.0], &machine), 20_000)),
    ];
    for (name, machine, segments) in cases {
        let ticks = count(&segments, machine);
        group.throughput(Throughput::Elements(ticks));
        group.bench_function(format!("{name}, ticks"), |b| b.iter(|| count(&segments, machine)));
        group.bench_function(format!("{name}, dump"), |b| b.iter(|| write(&segments, machine)));
        if name == "long lines" {
            group.bench_function("DDA of long lines, ticks", |b| {
                b.iter(|| dda(&segments, machine, ticks));
            });
        }
    }
    group.finish();
    let mut group = criterion.benchmark_group("plan");
    let router = without_jerk(&Machine::load("router").expect("a built-in profile"));
    const SEGMENTS: usize = 200_000;
    group.throughput(Throughput::Elements(SEGMENTS as u64)).sample_size(10);
    let cases = [
        ("segments", there_and_back(line([0.3, 0.2, 0.0], &router), 1000)),
        ("chords of a curve", chopped_circle(1000, 300.0, &router)),
    ];
    for (name, segments) in cases {
        let items: Vec<PathItem> = segments.into_iter().map(PathItem::from).collect();
        group.bench_function(name, |b| b.iter(|| profiles(&items, SEGMENTS, &router)));
    }
    group.finish();
    let mut group = criterion.benchmark_group("text");
    const BLOCKS: u32 = 100_000;
    group.throughput(Throughput::Elements(BLOCKS.into())).sample_size(10);
    let cases = [
        ("mill", &machine, 1200),
        ("mill without jerk", &plain, 1200),
        ("router without jerk", &router, 24_000),
    ];
    for (name, machine, feed_mm_min) in cases {
        let source = Source::memory("bench.nc", chords(BLOCKS, feed_mm_min).into_bytes());
        group.bench_function(format!("{name}: blocks, checked"), |b| {
            b.iter(|| interp::check(&source, machine, &Options::default(), 10));
        });
        let id = format!("{name}: blocks, to dump");
        group.bench_function(id, |b| b.iter(|| text_to_dump(&source, machine)));
    }
    group.finish();
}

criterion_group!(benches, interpolate);
criterion_main!(benches);
