//! How fast programs are read: blocks a second for a million short G1 blocks, on one core.

use std::fmt::Write;
use std::hint::black_box;

use cnc::base::{Machine, Source};
use cnc::gcode::{Block, Lines, parse};
use cnc::interp::{self, Options};
use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};

const BLOCKS: u64 = 1_000_000;

/// A meander of a million short moves, as engraving programs have them.
fn program() -> Source {
    let mut text = String::from("G21 G90 G17\nG1 F600\n");
    for k in 0..BLOCKS {
        let x = (k % 2000) as f64 * 0.0137;
        let y = (k % 1900) as f64 * 0.0119;
        writeln!(text, "G1 X{x:.4} Y{y:.4}").expect("a string takes all");
    }
    text += "M30\n";
    Source::memory("bench.nc", text.into_bytes())
}

fn language(criterion: &mut Criterion) {
    let machine = Machine::load("ideal").expect("it is built in");
    let options = Options::default();
    let source = program();
    let mut group = criterion.benchmark_group("language");
    group.throughput(Throughput::Elements(BLOCKS)).sample_size(10);
    group.bench_function("parse", |bencher| {
        bencher.iter_batched(
            || (Lines::new(source.reader(0), 0, 1), Block::default(), Vec::new()),
            |(mut lines, mut block, mut faults)| {
                while let Some(line) = lines.next_line().expect("memory can be read") {
                    parse(line.bytes, &mut block, &mut faults);
                    black_box(block.words());
                }
            },
            BatchSize::PerIteration,
        );
    });
    group.bench_function("interpret", |bencher| {
        bencher.iter(|| {
            for motion in interp::motions(&source, &machine, &options) {
                black_box(motion.expect("the program is right"));
            }
        });
    });
    group.bench_function("check", |bencher| {
        bencher.iter(|| interp::check(&source, &machine, &options, 100).expect("it can be read"));
    });
    group.finish();
}

criterion_group!(benches, language);
criterion_main!(benches);
