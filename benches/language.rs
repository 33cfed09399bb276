//! How fast programs are read: blocks a second, of the macro moves a second, on one core. `lines` is
//! the reference of every program: its text cut into lines and no more, which no reader can beat.
//! How other interpreters compare is told by `tests/rs274/speed.sh`.

use std::hint::black_box;

use cnc::base::{Machine, Source};
use cnc::gcode::{Block, Lines, parse_next};
use cnc::interp::{self, Options};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

/// A program: its name, how much is counted of it, and what writes it.
type Program = (&'static str, u32, fn(u32) -> String);

const PROGRAMS: [Program; 5] = [
    ("short", 200_000, short),
    ("verbose", 200_000, verbose),
    ("arcs", 100_000, arcs),
    ("mixed", 240_000, mixed),
    ("macro", 100_000, spiral),
];

fn each(count: u32, write: impl Fn(u32) -> String) -> String {
    (0..count).map(write).collect()
}

/// A meander of short moves, as engraving programs have them.
fn short(count: u32) -> String {
    each(count, |k| {
        let (x, y) = (f64::from(k % 2000) * 0.0137, f64::from(k % 1900) * 0.0119);
        format!("G1 X{x:.4} Y{y:.4}\n")
    })
}

/// Moves with all that wordy CAM programs repeat in every block.
fn verbose(count: u32) -> String {
    each(count, |k| {
        let (x, y) = (f64::from(k % 2000) * 0.0137, f64::from(k % 1900) * -0.0119);
        let (z, feed) = (f64::from(k % 700) * 0.00123, 1200 + k % 3);
        format!("N{} G1 X{x:.3} Y{y:.3} Z{z:.3} F{feed}.\n", k + 10)
    })
}

/// Half circles of many radii, to and fro.
fn arcs(count: u32) -> String {
    let half_circle = |k: u32| {
        let radius = 1.0 + f64::from(k / 2 % 97) * 0.05;
        let by = if k.is_multiple_of(2) { radius } else { -radius };
        format!("G3 X{:.2} Y0 I{by:.2} J0\n", 2.0 * by)
    };
    String::from("G91\n") + &each(count, half_circle)
}

/// Pockets and holes: twelve blocks each, with comments, modal words, arcs, cycles and functions.
fn mixed(count: u32) -> String {
    each(count / 12, |k| {
        let [x, y, depth] = [k % 50, k / 50 % 50, k % 9 + 1];
        let [right, above] = [x + 1, y + 1];
        format!(
            "(pocket {k})\nN{k} G0 X{x} Y{y}\nZ1\nG1 Z-0.{depth} F150\nX{x}.5 F600\n\
             G2 X{right} Y{y}.5 I0 J0.5\nG1 Y{above}\nX{x} Y{y}\nG0 Z5\n\
             G81 X{x}.25 Y{y}.25 Z-2 R1 F200\nG80\nM8\n"
        )
    })
}

/// A spiral, from parameters, expressions and a loop.
fn spiral(count: u32) -> String {
    format!(
        "#<radius>=20\n#1=0\no100 while [#1 LT {count}]\n#2=[#1*0.9]\n\
         G1 X[#<radius>*COS[#2]] Y[#<radius>*SIN[#2]] Z[#1/{count}]\n\
         #1=[#1+1]\no100 endwhile\n"
    )
}

fn language(criterion: &mut Criterion) {
    let machine = Machine::load("ideal").expect("it is built in");
    let options = Options::default();
    for (name, count, write) in PROGRAMS {
        let text = format!("G21 G90 G17 F600\nG0 X0 Y0\n{}M30\n", write(count));
        let source = Source::memory("bench.nc", text.into_bytes());
        let checked = interp::check(&source, &machine, &options, 100).expect("it can be read");
        assert_eq!(checked.errors, 0, "{name}: {:?}", checked.diagnostics);
        let mut group = criterion.benchmark_group(name);
        group.throughput(Throughput::Elements(count.into())).sample_size(10);
        group.bench_function("lines", |bencher| {
            bencher.iter(|| {
                let mut lines = Lines::new(source.reader(0), 0, 1);
                while let Some(line) = lines.next_line().expect("memory can be read") {
                    black_box(line);
                }
            });
        });
        group.bench_function("parse", |bencher| {
            let (mut block, mut faults) = (Block::default(), Vec::new());
            bencher.iter(|| {
                let mut lines = Lines::new(source.reader(0), 0, 1);
                let mut next = |block: &mut Block| {
                    parse_next(&mut lines, block, &mut faults)
                        .expect("memory can be read")
                        .is_some()
                };
                while next(&mut block) {
                    black_box(block.words());
                }
            });
        });
        group.bench_function("check", |bencher| {
            bencher.iter(|| interp::check(&source, &machine, &options, 100));
        });
        group.bench_function("record", |bencher| {
            bencher.iter(|| {
                let checked = interp::check_and_record(&source, &machine, &options, 100);
                let (_, record) = checked.expect("memory can be read");
                let record = record.expect("the program is right, and not too long");
                let mut motions = record.replay();
                while let Some(motion) = motions.read() {
                    black_box(motion);
                }
            });
        });
        group.bench_function("interpret", |bencher| {
            bencher.iter(|| {
                let mut motions = interp::motions(&source, &machine, &options);
                while let Some(motion) = motions.read().expect("the program is right") {
                    black_box(motion);
                }
            });
        });
        group.finish();
    }
}

criterion_group!(benches, language);
criterion_main!(benches);
