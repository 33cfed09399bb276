//! Writing and reading a dump, and verifying it: million rows and ticks a second. The reference of
//! both is the csv crate over the same rows, which hashes nothing and knows no seal; of verifying,
//! reading the dump that is verified.

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

/// Segments, and a job of as many ticks for each.
struct Job<'a> {
    machine: &'a Machine,
    steps: AxisMap<i64>,
    path: Vec<PathItem>,
    ticks: Vec<Command>,
}

impl Job<'_> {
    fn new(machine: &Machine) -> Job<'_> {
        let steps = machine.nearest_steps(&machine.work_zero_mm);
        Job { machine, steps, path: Vec::new(), ticks: Vec::new() }
    }

    fn add(&mut self, curve: Curve, from_mm: Point, to_mm: Point, ticks: u64) {
        let line = self.path.len() as u32 + 1;
        let (feed_mm_s, corner) = (Some(10.0), Default::default());
        let segment = Segment { line, feed_mm_s, from_mm, to_mm, curve, corner };
        for tick in 1..=ticks {
            let next = self.machine.nearest_steps(&segment.point_at(tick as f64 / ticks as f64));
            let counts = AxisMap::from_fn(|axis| (next[axis] - self.steps[axis]) as i32);
            self.ticks.push(Command::Tick(Tick { buffer: 0, line, counts }));
            self.steps = next;
        }
        self.path.push(PathItem::from(segment));
    }
}

/// A helix of R 20 mm about the work zero, ten turns up and down, over and over, in as many
/// ticks as there are rows.
fn helix(machine: &Machine) -> (Vec<PathItem>, Vec<Command>) {
    const TICKS: u64 = 20_000;
    let mut at: Point = machine.work_zero_mm;
    let mut job = Job::new(machine);
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
        job.add(Curve::Arc(arc), at, to, TICKS);
        at = to;
    }
    (job.path, job.ticks)
}

/// Circles of R 20 mm in chords of 0.3 mm, of three ticks each.
fn chopped(machine: &Machine) -> (Vec<PathItem>, Vec<Command>) {
    const TICKS: u64 = 3;
    let zero: Point = machine.work_zero_mm;
    let point = |chord: u64| {
        let (mut at, angle_rad) = (zero, chord as f64 * 0.3 / 20.0);
        at[Axis::X] += 20.0 * (angle_rad.cos() - 1.0);
        at[Axis::Y] += 20.0 * angle_rad.sin();
        at
    };
    let mut job = Job::new(machine);
    for chord in 0..ROWS / TICKS {
        job.add(Curve::Line, point(chord), point(chord + 1), TICKS);
    }
    (job.path, job.ticks)
}

fn write<W: io::Write>(out: W, header: &Header, job: &[Command]) -> W {
    let mut writer = Writer::new(out, header).expect("a header");
    job.iter().for_each(|command| writer.command(command).expect("a row"));
    writer.finish().expect("the end")
}

/// The rows as the csv crate writes them.
fn write_by_csv(job: &[Command]) {
    let mut writer = csv::Writer::from_writer(io::sink());
    for (number, command) in job.iter().enumerate() {
        let Command::Tick(tick) = command else { continue };
        let [x, y, z] = Axis::LINEAR.map(|axis| tick.counts[axis]);
        writer.serialize((number, tick.buffer, tick.line, x, y, z, "")).expect("a row");
    }
    writer.flush().expect("the end");
}

/// The rows as the csv crate reads them, into one record.
fn read_by_csv(dump: &[u8]) -> i64 {
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(dump);
    let (mut record, mut sum) = (csv::ByteRecord::new(), 0);
    while reader.read_byte_record(&mut record).expect("a row") {
        for field in record.iter().take(6) {
            let number = std::str::from_utf8(field).ok().and_then(|text| text.parse::<i64>().ok());
            sum += number.expect("a number");
        }
    }
    sum
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
    group.bench_function("write rows, csv crate", |bench| {
        bench.iter(|| write_by_csv(black_box(&job)));
    });
    let text = write(Vec::new(), &header, &job);
    let dump = Source::memory("dump", text.clone());
    group.bench_function("read rows with their hash", |bench| {
        bench.iter(|| Reader::open(dump.clone()).expect("a dump").map(Result::unwrap).count());
    });
    group.bench_function("read rows, csv crate", |bench| {
        bench.iter(|| read_by_csv(black_box(&text)));
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
        with_buffers: false,
    };
    let open = || Ok::<_, Infallible>(path.iter().cloned().map(Ok));
    group.bench_function("ticks of a helix", |bench| {
        bench.iter(|| verify(&setup, || Reader::open(dump.clone()), open).expect("a report"));
    });
    let (path, job) = chopped(&machine);
    let dump = Source::memory("dump", write(Vec::new(), &header, &job));
    let open = || Ok::<_, Infallible>(path.iter().cloned().map(Ok));
    group.bench_function("ticks of short lines", |bench| {
        bench.iter(|| verify(&setup, || Reader::open(dump.clone()), open).expect("a report"));
    });
    group.bench_function("reading alone", |bench| {
        bench.iter(|| Reader::open(dump.clone()).expect("a dump").map(Result::unwrap).count());
    });
    group.finish();
}

criterion_group!(benches, tape);
criterion_main!(benches);
