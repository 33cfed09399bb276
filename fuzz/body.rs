//! What must hold for any bytes that are handed in as an NC program. Used by the libFuzzer target, by
//! `examples/fuzz.rs`, which needs no nightly, and by `tests/fuzz.rs`, which replays the corpus.

use std::collections::HashSet;
use std::sync::LazyLock;

use cnc::base::{Axis, Machine, Point, Severity, Source};
use cnc::gcode::{Block, parse, rules};
use cnc::interp::{self, Checked, Dialect, Motion, Move, MoveKind, Options, Record};

/// Loops of a program that is tried run so often at most: it has to be quick.
const PASSES_MAX: u64 = 500;

/// Diagnostics that are kept of each kind.
const DIAGNOSTICS_MAX: usize = 50;

static MACHINES: LazyLock<[Machine; 2]> =
    LazyLock::new(|| ["starmill", "ideal"].map(|name| Machine::load(name).expect("is built in")));

static RULES: LazyLock<HashSet<&str>> =
    LazyLock::new(|| rules::all().map(|rule| rule.name).collect());

/// Checks a program in every dialect and runs it.
///
/// # Panics
/// When something does not hold.
pub fn program(bytes: &[u8]) {
    let mut lines = 0;
    for line in bytes.split(|byte| *byte == b'\n' || *byte == b'\r') {
        prints_as_it_reads(line);
        lines += 1;
    }
    let source = Source::memory("fuzz.nc", bytes);
    for (at, dialect) in Dialect::ALL.into_iter().enumerate() {
        let machine = &MACHINES[usize::from(at > 0)];
        let options = Options {
            dialect,
            max_passes: Some(PASSES_MAX),
            block_delete: at == 1,
            ..Options::default()
        };
        let checked = interp::check_and_record(&source, machine, &options, DIAGNOSTICS_MAX);
        let (checked, record) = checked.expect("memory can be read");
        tells_what_is_wrong(&checked, lines);
        let motions = interp::motions(&source, machine, &options);
        if checked.errors == 0 {
            runs_as_checked(motions, record.as_ref(), &checked);
        } else {
            // It stops at its first error, or at the end: of a limit of travel it knows nothing.
            motions.for_each(drop);
        }
    }
}

/// A line without faults, printed, is the same block.
fn prints_as_it_reads(line: &[u8]) {
    let (mut block, mut again, mut faults) = (Block::default(), Block::default(), Vec::new());
    parse(line, &mut block, &mut faults);
    let length = line.len().max(1) as u32;
    for fault in &faults {
        assert!(fault.start < fault.end.max(1) && fault.start < length, "{fault:?}");
    }
    if !faults.is_empty() {
        return;
    }
    let printed = block.to_string();
    parse(printed.as_bytes(), &mut again, &mut faults);
    assert!(faults.is_empty() && block == again, "{printed}: {faults:?}");
}

fn tells_what_is_wrong(checked: &Checked, lines: usize) {
    let of = |severity| checked.diagnostics.iter().filter(move |d| d.severity == severity).count();
    let kept = |count: u64| (count as usize).min(DIAGNOSTICS_MAX);
    assert_eq!(of(Severity::Error), kept(checked.errors));
    assert_eq!(of(Severity::Warning), kept(checked.warnings));
    for found in &checked.diagnostics {
        let span = found.span;
        assert!(RULES.contains(found.rule), "{found:?}");
        assert!(span.line >= 1 && span.line as usize <= lines, "{found:?}");
        assert!(span.start < span.end && found.column() >= 1, "{found:?}");
        assert!(!found.message.is_empty() && !found.message.contains("NaN"), "{found:?}");
        assert!(!found.text.contains(['\n', '\r']), "{found:?}");
    }
}

/// What a program makes when it is run is what the check has made, and recorded.
fn runs_as_checked(motions: interp::Motions<'_>, record: Option<&Record>, checked: &Checked) {
    let mut at = checked.summary.start_mm;
    let (mut moves, mut events) = (0, 0);
    let mut replay = record.map(Record::replay);
    for motion in motions {
        let motion = motion.expect("a checked program runs");
        if let Some(replay) = &mut replay {
            assert_eq!(replay.read(), Some(&motion));
        }
        match motion {
            Motion::Move(step) => {
                moves += 1;
                assert_eq!(step.from, at, "line {}", step.line);
                at = step.to;
                is_a_move(&step, checked);
            }
            Motion::Event(_) => events += 1,
        }
    }
    assert!(replay.is_none_or(|mut replay| replay.read().is_none()));
    assert_eq!((moves, events), (checked.summary.moves, checked.summary.events));
    assert_eq!(at, checked.summary.end_mm);
}

/// Every number of a move is one that JSON can hold, and lies within what the check has told.
fn is_a_move(step: &Move, checked: &Checked) {
    let is_finite = |point: &Point| Axis::ALL.into_iter().all(|axis| point[axis].is_finite());
    assert!(is_finite(&step.from) && is_finite(&step.to), "{step:?}");
    let feed = match step.kind {
        MoveKind::Rapid => None,
        MoveKind::Spline { feed_mm_min, ref curve } => {
            assert!(curve.points().iter().all(is_finite), "{step:?}");
            Some(feed_mm_min)
        }
        MoveKind::Line { feed_mm_min } => Some(feed_mm_min),
        MoveKind::Arc { feed_mm_min, center_mm, .. } => {
            assert!(center_mm.iter().all(|value| value.is_finite()), "{step:?}");
            Some(feed_mm_min)
        }
    };
    // A move without length has no speed under G93.
    let rests = step.from == step.to;
    assert!(feed.is_none_or(|feed| feed.is_finite() && (feed > 0.0 || rests)), "{step:?}");
    for axis in Axis::ALL {
        if let Some([least, greatest]) = checked.summary.extents_mm[axis] {
            assert!(least <= step.to[axis] && step.to[axis] <= greatest, "{axis} {step:?}");
        }
    }
}
