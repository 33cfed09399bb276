//! Interpolation pulses: the paper's formulas, the paper's program, and what must hold of every arc.

use std::f64::consts::{PI, TAU};

use assert_cmd::Command;

use cnc::base::{Axis, Machine, Point, Source};
use cnc::interp::{Corner, Options, motions};
use cnc::path::{Arc, Curve, PathItem, Segment, segments};
use cnc::systems::pulse::{Interpolator, Made, NoPulses, count, octant_pulses};
use proptest::prelude::*;
use serde_json::Value;

fn kimm() -> Machine {
    Machine::load("kimm").unwrap()
}

fn program(text: &[u8], machine: &Machine) -> Vec<Segment> {
    let source = Source::memory("test", text.to_vec());
    let options = Options::default();
    let items = segments(motions(&source, machine, &options), machine);
    let segment = |item| match item {
        PathItem::Segment(segment) => Some(Segment::clone(&segment)),
        PathItem::Event(_) => None,
    };
    items.filter_map(|item| segment(item.unwrap())).collect()
}

fn arc(radius_mm: f64, angle_from_rad: f64, sweep_rad: f64) -> Segment {
    let curve = Arc {
        plane: cnc::base::Plane::Xy,
        center_mm: [4000.0, 4000.0],
        radius_from_mm: radius_mm,
        radius_to_mm: radius_mm,
        angle_from_rad,
        sweep_rad,
    };
    let end = |share: f64| {
        let mut point = Point::ZERO;
        [point[Axis::X], point[Axis::Y]] = curve.point_at(share);
        point
    };
    Segment {
        line: 1,
        feed_mm_s: Some(3.0),
        from_mm: end(0.0),
        to_mm: end(1.0),
        curve: Curve::Arc(curve),
        corner: Corner::Exact,
    }
}

fn run(segment: &Segment, machine: &Machine) -> Made {
    let mut pulses = Interpolator::new(machine, machine.nearest_steps(&segment.from_mm));
    let made = pulses.run(segment, |_| {}).unwrap();
    assert_eq!(pulses.position, machine.nearest_steps(&segment.to_mm));
    made
}

#[test]
fn an_arc_from_an_axis_counts_as_the_paper_has_it() {
    let machine = kimm();
    for degrees in 1..=90 {
        let angle = f64::from(degrees).to_radians();
        let expected = octant_pulses(8000.0, angle);
        for (from, sweep) in [(0.0, angle), (PI, angle), (PI / 2.0, -angle)] {
            let exact = count(&arc(8.0, from, sweep), &machine).unwrap().exact;
            assert!((exact - expected).abs() < 1e-6, "{degrees} {exact} {expected}");
        }
    }
    // All octants: 4 * sqrt(2) * R.
    let whole = count(&arc(8.0, 0.3, -TAU), &machine).unwrap();
    assert_eq!(whole.pulses, 45_255);
    assert_eq!(whole.command(), [b'P', 0xC7, 0xB0, 0, 0]);
    assert_eq!(count(&arc(8.0, 0.0, 2.0 * TAU), &machine).unwrap().pulses, 90_510);
}

#[test]
fn the_angle_follows_from_chord_and_radius() {
    // The paper's formula before its octants, whose squares and roots the print lacks:
    // sin(angle / 2) is half the chord by the radius.
    for segment in program(include_bytes!("../samples/good/kimm-test.nc"), &kimm()) {
        let Curve::Arc(arc) = &segment.curve else { continue };
        let way = [Axis::X, Axis::Y].map(|axis| segment.to_mm[axis] - segment.from_mm[axis]);
        let chord = way[0].hypot(way[1]);
        let angle = 2.0 * (0.5 * chord / arc.radius_from_mm).min(1.0).asin();
        assert!((angle - arc.sweep_rad).abs() < 1e-6, "line {}", segment.line);
    }
}

#[test]
fn the_papers_program_has_these_counts_and_closes_on_itself() {
    let expected = include_str!("papers/kimm-pulses.csv");
    for (column, name) in [(1, "kimm"), (2, "kimm-table")] {
        let machine = Machine::load(name).unwrap();
        let start = machine.nearest_steps(&machine.work_zero_mm);
        let mut pulses = Interpolator::new(&machine, start);
        let program = program(include_bytes!("../samples/good/kimm-test.nc"), &machine);
        let rows = expected.lines().filter(|line| !line.starts_with('#')).skip(1);
        assert_eq!(program.len(), 29);
        for (segment, row) in program.iter().zip(rows) {
            let cells: Vec<u32> = row.split(',').map(|cell| cell.parse().unwrap()).collect();
            assert_eq!(cells[0], segment.line);
            assert_eq!(count(segment, &machine).unwrap().pulses, cells[column], "{row}");
            let made = pulses.run(segment, |_| {}).unwrap();
            assert!(made.pulses.abs_diff(cells[column].into()) <= 1, "{row} {made:?}");
            assert!(made.error_pulses <= 0.75, "{row} {made:?}");
        }
        assert_eq!(pulses.position, start);
    }
}

#[test]
fn what_the_board_cannot_take_is_refused() {
    let machine = kimm();
    let spline = program(b"G91 G5 X10 Y10 I3 J0 P0 Q-3 F100\nM30", &machine);
    assert_eq!(count(&spline[0], &machine), Err(NoPulses::Spline { line: 1 }));
    let steep = program(b"G91 G2 X2 Z-9 I1 F100\nM30", &Machine::load("ideal").unwrap());
    let refused = count(&steep[0], &Machine::load("ideal").unwrap()).unwrap_err();
    assert!(refused.to_string().ends_with("the helix is too steep"), "{refused}");
    let turns = arc(4000.0, 0.0, 200.0 * TAU);
    let refused = count(&turns, &machine).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "line 1: 4525483400 pulses, and the command has room for 4294967295"
    );
}

proptest! {
    /// Every arc is followed within a pulse and met at its end, in about as many pulses as are counted.
    #[test]
    fn no_pulse_leaves_the_curve_by_more_than_one(
        radius_mm in 0.002..1.0_f64, angle in -4.0..4.0_f64, sweep in -9.0..9.0_f64,
    ) {
        prop_assume!(sweep.abs() * radius_mm > 0.003);
        let (machine, segment) = (kimm(), arc(radius_mm, angle, sweep));
        let counted = count(&segment, &machine).unwrap();
        let made = run(&segment, &machine);
        prop_assert!(made.error_pulses <= 1.0, "{made:?}");
        let changes = 2.0 + sweep.abs() / (PI / 4.0);
        prop_assert!((made.pulses as f64 - counted.exact).abs() <= changes, "{made:?} {counted:?}");
    }

    /// Lines and helices too, on axes with pulses of different size.
    #[test]
    fn nor_do_those_of_lines_and_helices(
        x in -9.0..9.0_f64, y in -9.0..9.0_f64, z in -3.0..3.0_f64, radius in 5.0..9.0_f64,
    ) {
        let mut machine = Machine::load("starmill").unwrap();
        machine.axes[1].steps_per_mm = 250.0;
        let text = format!("G91 G1 X{x:.3} Y{y:.3} Z{z:.3} F100\nG2 X{x:.3} Y{y:.3} Z{z:.3} R{radius:.3}\nM30");
        prop_assume!(x.hypot(y) > 0.1 && x.hypot(y) < 1.9 * radius);
        for segment in program(text.as_bytes(), &machine) {
            if matches!(count(&segment, &machine), Err(NoPulses::Steep { .. })) {
                continue;
            }
            let made = run(&segment, &machine);
            prop_assert!(made.error_pulses <= 1.0, "{made:?} {segment:?}");
            for axis in [Axis::X, Axis::Y, Axis::Z] {
                prop_assert!(made.axis_pulses[axis] <= made.pulses);
            }
        }
    }
}

/// Runs `cnc`: exit code and both streams.
fn cnc(args: &[&str]) -> (i32, String, String) {
    let output = Command::cargo_bin("cnc")
        .unwrap()
        .env_remove("CNC_MACHINE")
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(args)
        .output()
        .unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

const KIMM_TEST: &str = "samples/good/kimm-test.nc";

#[test]
fn the_command_lists_counts_with_their_commands() {
    let (code, out, _) = cnc(&["interpret", KIMM_TEST, "-m", "kimm", "--fp", "--json"]);
    let lines: Vec<Value> = out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!((code, lines.len()), (0, 29));
    assert_eq!(
        lines[1].to_string(),
        r#"{"command":"50322C0000","fp":11314,"line":6,"n":2,"type":"arc","way_pulses":11313.708499}"#
    );
    let (_, out, _) = cnc(&["interpret", KIMM_TEST, "-m", "kimm", "--fp"]);
    assert!(out.contains("50 32 2C 00 00") && out.ends_with("in 29 blocks\n"), "{out}");
    let (code, out, err) = cnc(&["interpret", "samples/good/nurbs.nc", "--fp"]);
    assert_eq!((code, out.as_str()), (1, ""));
    assert!(err.contains("takes lines and arcs only"), "{err}");
}

#[test]
fn pulses_and_ticks_make_the_same_steps_within_a_pulse() {
    let folder = tempfile::tempdir().unwrap();
    let svg = folder.path().join("error.svg");
    let drawing = ["--svg", svg.to_str().unwrap()];
    let method = ["interpolate", KIMM_TEST, "-m", "kimm", "--method", "pulse", "--json"];
    let (code, out, err) = cnc(&[&method[..], &drawing].concat());
    assert_eq!(code, 0, "{err}");
    let report: Value = serde_json::from_str(&out).unwrap();
    let (pulses, ticks) = (&report["by_pulses"], &report["by_ticks"]);
    assert_eq!(pulses["axis_pulses"], ticks["axis_pulses"]);
    assert!(pulses["error_pulses"].as_f64().unwrap() <= 0.5);
    assert!(ticks["error_pulses"].as_f64().unwrap() <= 1.0);
    assert!(std::fs::read_to_string(&svg).unwrap().contains("distance from the curve, pulses"));
    for option in ["--csv", "--times", "--word-bits=16"] {
        assert_eq!(cnc(&["interpolate", KIMM_TEST, "--method", "pulse", option]).0, 2, "{option}");
    }
    assert_eq!(cnc(&["interpolate", KIMM_TEST, "--svg", "x.svg"]).0, 2);
}

#[test]
fn the_limits_of_the_control_are_diagnostics() {
    // 5.45 m/min on lines, 2.85 on arcs at 1 µm; 2.5 times as much with the table.
    // The faster chip does 27.27 and 14.29 m/min.
    for (machine, line, arc) in [
        ("kimm", 5450.0, 2850.0),
        ("kimm-table", 13_625.0, 7125.0),
        ("samples/machines/kimm-ad.toml", 27_270.0, 14_290.0),
    ] {
        for (motion, most) in
            [("G1 X5", line), ("G3 X5 Y5 J5", arc), ("G5 X9 Y9 I3 Q-3 P0 J0", arc)]
        {
            for (feed, rules) in [(most, &[][..]), (most + 1.0, &["pulse-rate"])] {
                let folder = tempfile::tempdir().unwrap();
                let file = folder.path().join("part.nc");
                std::fs::write(&file, format!("G91 G17\n{motion} F{feed}\n{motion}\nM30\n"))
                    .unwrap();
                let (code, out, _) =
                    cnc(&["interpret", file.to_str().unwrap(), "-m", machine, "--json"]);
                let lines = out.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
                let found: Vec<Value> = lines.filter(|line| line["type"] == "error").collect();
                let found: Vec<&str> =
                    found.iter().filter_map(|line| line["rule"].as_str()).collect();
                assert_eq!(
                    (found.as_slice(), code),
                    (rules, rules.len() as i32),
                    "{motion} F{feed}"
                );
            }
        }
    }
    // 23 bits of pulses: 8.388607 m.
    for (x, code) in [("8388.607", 0), ("8388.608", 1)] {
        let block = format!("G53 G0 X{x}\nM30\n");
        let file = tempfile::NamedTempFile::with_suffix(".nc").unwrap();
        std::fs::write(&file, block).unwrap();
        let (found, _, err) = cnc(&["interpret", file.path().to_str().unwrap(), "-m", "kimm"]);
        assert_eq!(found, code, "{err}");
        assert_eq!(err.contains("limit-x-max"), code == 1, "{err}");
    }
}
