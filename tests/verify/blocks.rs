//! How far each block is off: of sound jobs, and of jobs of other paths.

use std::convert::Infallible;

use cnc::base::Command;
use cnc::path::PathItem;
use cnc::verify::{BlockError, Report, Verdict, verify_blocks};

use super::drawing::{Drawing, drawing, steps};
use super::{setup, starmill};

/// How far each block is off, and the job.
fn blocks(path: &[PathItem], job: &[Command]) -> (Vec<BlockError>, Report) {
    let machine = starmill();
    let mut blocks = Vec::new();
    let report = verify_blocks(
        &setup(&machine, true),
        || Ok::<_, Infallible>(job.iter().cloned().map(Ok)),
        || Ok::<_, Infallible>(path.iter().cloned().map(Ok)),
        Some(&mut |block| blocks.push(*block)),
    );
    (blocks, report.expect("nothing breaks off"))
}

/// Half a step on each axis, and what chords stand for arcs.
const ROUNDING_MM: f64 = 0.00867;

#[test]
fn each_block_of_a_sound_job_is_near() {
    let path = drawing();
    let (blocks, report) = blocks(&path, &steps(&starmill(), &path));
    let of_path = |item: &PathItem| match item {
        PathItem::Segment(segment) => Some(segment.line),
        PathItem::Event(_) => None,
    };
    assert!(path.iter().filter_map(of_path).eq(blocks.iter().map(|block| block.line)));
    let most = blocks.iter().map(|block| block.max_mm).fold(0.0, f64::max);
    assert!((most - report.max_contour_error_mm).abs() < 1e-6, "{most} {report:#?}");
    for block in blocks {
        let rms_mm = block.rms_mm.expect("ticks");
        assert!(rms_mm <= block.max_mm && block.max_mm < ROUNDING_MM, "{block:?}");
        assert!((block.allowed_mm - report.tolerance_mm).abs() < 1e-6, "{block:?}");
    }
}

/// Holes in a row, of which the third is half a millimetre too shallow: it is said so of its way down and up,
/// and of no other block, though path and machine turn back at different places.
#[test]
fn of_holes_the_one_that_is_too_shallow_is_told() {
    let holes = |shallow: Option<usize>| {
        let hole = |drawing: Drawing, number: usize| {
            let depth_mm = if shallow == Some(number) { 0.5 } else { 1.0 };
            drawing.rapid([3.0, 1.0, 0.0]).line([0.0, 0.0, -depth_mm]).rapid([0.0, 0.0, depth_mm])
        };
        (1..=6).fold(Drawing::new(), hole).path
    };
    let (blocks, report) = blocks(&holes(None), &steps(&starmill(), &holes(Some(3))));
    assert_eq!(report.verdict, Verdict::Fail);
    assert!(blocks.iter().map(|block| block.line).eq(1..=18), "{blocks:?}");
    for block in &blocks {
        let is_off = [8, 9].contains(&block.line);
        assert!(!is_off || (block.max_mm - 0.5).abs() < 0.001, "{block:?}");
        assert!(is_off || block.max_mm < ROUNDING_MM, "{block:?}");
    }
}

/// A block that is left out half way and taken up again: its tick points lie on the path, and it was passed
/// backwards.
#[test]
fn a_block_that_was_run_back_is_told() {
    let there = Drawing::new().line([5.0, 0.0, 0.0]).line([5.0, 0.0, 0.0]).line([5.0, 0.0, 0.0]);
    let back = Drawing::new().line([7.5, 0.0, 0.0]).line([-1.0, 0.0, 0.0]).line([8.5, 0.0, 0.0]);
    let (blocks, report) = blocks(&there.path, &steps(&starmill(), &back.path));
    assert!((report.max_contour_error_mm - 0.5).abs() < 0.001, "{report:#?}");
    let [before, off, behind] = [blocks[0].max_mm, blocks[1].max_mm, blocks[2].max_mm];
    assert!(before < ROUNDING_MM && behind < ROUNDING_MM, "{blocks:?}");
    assert!((0.48..=0.501).contains(&off), "{blocks:?}");
}
