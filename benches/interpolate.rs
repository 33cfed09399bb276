//! Planning and interpolating, with and without writing the dump: million ticks a second.

use std::convert::Infallible;
use std::hint::black_box;

use cnc::base::{Axis, Command, Machine, Plane, Point};
use cnc::path::{Arc, Curve, PathItem, Segment};
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
    let path = segments.iter().cloned().map(|s| Ok::<_, Infallible>(PathItem::Segment(s)));
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
    let origin = |name: &str| Origin { name: name.to_owned(), sha256: [0; 32] };
    let header = Header {
        tool: "bench".to_owned(),
        program: origin("bench"),
        inputs: Vec::new(),
        options: Vec::new(),
        machine: origin("starmill"),
        tick_us: machine.bus.tick_us,
        steps_per_mm: machine.axes.iter().map(|axis| (axis.axis, axis.steps_per_mm)).collect(),
        start_steps: machine.nearest_steps(&machine.work_zero_mm),
        encoding: Encoding::Counts,
    };
    let mut writer = Writer::new(std::io::sink(), &header).expect("a sink takes all");
    for command in commands(segments, machine) {
        writer.command(&command).expect("a sink takes all");
    }
    writer.finish().expect("a sink takes all");
}

fn interpolate(criterion: &mut Criterion) {
    let machine = Machine::load("starmill").expect("a built-in profile");
    let mut group = criterion.benchmark_group("interpolate");
    let cases = [
        ("long lines", there_and_back(line([30.0, 20.0, 10.0], &machine), 200)),
        ("circles", vec![circle(&machine); 100]),
        ("short lines", there_and_back(line([0.05, 0.02, 0.0], &machine), 20_000)),
    ];
    for (name, segments) in cases {
        group.throughput(Throughput::Elements(count(&segments, &machine)));
        group.bench_function(format!("{name}, ticks"), |b| b.iter(|| count(&segments, &machine)));
        group.bench_function(format!("{name}, dump"), |b| b.iter(|| write(&segments, &machine)));
    }
    group.finish();
}

criterion_group!(benches, interpolate);
criterion_main!(benches);
