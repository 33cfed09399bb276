//! Writing and reading a dump, and verifying it: million rows and ticks a second.

use std::convert::Infallible;
use std::hint::black_box;
use std::io;

use cnc::base::{Axis, AxisMap, Command, Machine, Point, Source, Tick};
use cnc::path::{Arc, Curve, PathItem, Segment};
use cnc::tape::{Encoding, Header, Origin, Reader, Writer};
use cnc::verify::{Setup, verify};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

const ROWS: u64 = 200_000;

fn header(machine: &Machine) -> Header {
    Header {
        tool: "bench".to_owned(),
        program: Origin { name: "bench.nc".to_owned(), sha256: [0; 32] },
        inputs: Vec::new(),
        options: Vec::new(),
        machine: Origin { name: machine.id.clone(), sha256: [0; 32] },
        tick_us: machine.bus.tick_us,
        steps_per_mm: machine.axes.iter().map(|axis| (axis.axis, axis.steps_per_mm)).collect(),
        start_steps: machine.nearest_steps(&machine.work_zero_mm),
        encoding: Encoding::Counts,
    }
}

/// A helix of R 20 mm about the work zero, ten turns up and down, over and over, in as many
/// ticks as there are rows.
fn helix(machine: &Machine) -> (Vec<PathItem>, Vec<Command>) {
    const TICKS: u64 = 20_000;
    let mut at: Point = machine.work_zero_mm;
    let mut steps = machine.nearest_steps(&at);
    let (mut path, mut job) = (Vec::new(), Vec::new());
    for round in 0..ROWS / TICKS {
        let up = if round % 2 == 0 { 1.0 } else { -1.0 };
        let mut to = at;
        to[Axis::Z] += 20.0 * up;
        let arc = Arc {
            plane: cnc::base::Plane::Xy,
            center_mm: [at[Axis::X] - 20.0, at[Axis::Y]],
            radius_from_mm: 20.0,
            radius_to_mm: 20.0,
            angle_from_rad: 0.0,
            sweep_rad: 10.0 * std::f64::consts::TAU * up,
        };
        let line = round as u32 + 1;
        let curve = Curve::Arc(arc);
        let (feed_mm_s, corner) = (Some(10.0), Default::default());
        let segment = Segment { line, feed_mm_s, from_mm: at, to_mm: to, curve, corner };
        for tick in 1..=TICKS {
            let next = machine.nearest_steps(&segment.point_at(tick as f64 / TICKS as f64));
            let counts = AxisMap::from_fn(|axis| (next[axis] - steps[axis]) as i32);
            job.push(Command::Tick(Tick { buffer: 0, line, counts }));
            steps = next;
        }
        path.push(PathItem::Segment(segment));
        at = to;
    }
    (path, job)
}

fn write<W: io::Write>(out: W, header: &Header, job: &[Command]) -> W {
    let mut writer = Writer::new(out, header).expect("a header");
    job.iter().for_each(|command| writer.command(command).expect("a row"));
    writer.finish().expect("the end")
}

fn tape(criterion: &mut Criterion) {
    let machine = Machine::load("starmill").expect("built in");
    let (path, job) = helix(&machine);
    let header = header(&machine);
    let mut group = criterion.benchmark_group("tape");
    group.throughput(Throughput::Elements(ROWS)).sample_size(20);
    group.bench_function("write rows with their hash", |bench| {
        bench.iter(|| write(io::sink(), &header, black_box(&job)));
    });
    let dump = Source::memory("dump", write(Vec::new(), &header, &job));
    group.bench_function("read rows with their hash", |bench| {
        bench.iter(|| Reader::open(dump.clone()).expect("a dump").map(Result::unwrap).count());
    });
    group.finish();
    let mut group = criterion.benchmark_group("verify");
    group.throughput(Throughput::Elements(ROWS)).sample_size(10);
    let setup = Setup {
        machine: &machine,
        tick_us: machine.bus.tick_us,
        start_steps: header.start_steps,
        constant_feed: true,
        with_events: true,
        with_buffers: true,
    };
    let open = || Ok::<_, Infallible>(path.iter().cloned().map(Ok));
    group.bench_function("ticks of a helix", |bench| {
        bench.iter(|| {
            let job = || Ok::<_, Infallible>(job.iter().cloned().map(Ok));
            verify(&setup, job, open).expect("a report")
        });
    });
    group.finish();
}

criterion_group!(benches, tape);
criterion_main!(benches);
