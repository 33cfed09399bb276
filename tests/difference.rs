//! Method B: equations end where their segments do; what rounding makes of them; the least word; the
//! command.

use assert_cmd::Command;
use cnc::base::{Axis, Machine, Source};
use cnc::interp::{Options, motions};
use cnc::path::{PathItem, segments};
use cnc::systems::difference::drift::{Needs, Run, Runs, least_word};
use cnc::systems::difference::node::{Node, Range, Rounding};
use cnc::systems::difference::{Constants, Equations, equations, steps_per_mm};
use serde_json::Value;

fn starmill() -> Machine {
    Machine::load("starmill").unwrap()
}

fn program(text: &str, machine: &Machine) -> Vec<Equations> {
    let source = Source::memory("test", text.as_bytes().to_vec());
    let options = Options::default();
    segments(motions(&source, machine, &options), machine)
        .filter_map(|item| match item.unwrap() {
            PathItem::Segment(segment) => Some(equations(&segment, machine, Constants::Exact)),
            PathItem::Event(_) => None,
        })
        .flatten()
        .collect()
}

/// All words that are worth comparing, run.
fn run(text: &str) -> (Vec<Run>, Needs) {
    let machine = starmill();
    let scale = steps_per_mm(&machine);
    let pieces = program(text, &machine);
    let mut needs = Needs::default();
    pieces.iter().for_each(|piece| needs.include(piece, &scale));
    let words = needs.words(Rounding::Nearest);
    let mut runs = Runs::new(&machine, &machine.work_zero_mm, &words);
    pieces.iter().for_each(|piece| runs.segment(piece, |_, _| {}));
    (runs.runs().to_vec(), needs)
}

#[test]
fn equations_without_rounding_end_where_the_segment_does() {
    let mut machine = starmill();
    machine.axes[1].steps_per_mm = 250.0;
    let text = "G91 G17 G64\nG1 X10 Y-3 F300\nG2 X20 I10 Z2\nG3 X-5 Y5 R5\nG0 Z-2\n\
                G5 X10 Y10 I3 J0 P0 Q-3\nM30";
    let scale = steps_per_mm(&machine);
    let pieces = program(text, &machine);
    assert!(pieces.len() > 5, "a spline is told as chords");
    for piece in pieces {
        let mut at = piece.at_steps(0, &scale);
        for _ in 0..piece.ticks {
            if let Some(turn) = piece.turn {
                let ([x, y], [a, b, c, d]) = (turn.plane.axes(), turn.constants);
                let [u, v] = [at[x] - turn.center_steps[0], at[y] - turn.center_steps[1]];
                at[x] = turn.center_steps[0] + a * u - b * v;
                at[y] = turn.center_steps[1] + c * u + d * v;
            }
            Axis::ALL.into_iter().for_each(|axis| at[axis] += piece.way_steps[axis]);
        }
        let end = piece.at_steps(piece.ticks, &scale);
        for axis in Axis::LINEAR {
            assert!((at[axis] - end[axis]).abs() < 1e-6, "{axis} {at:?} {end:?}");
        }
        let feed_mm_s = piece.segment.feed_mm_s.unwrap_or(20.0);
        assert!(piece.speed_mm_s(&machine) <= feed_mm_s * (1.0 + 1e-9));
    }
}

#[test]
fn a_line_drifts_by_what_rounding_takes_off_its_way_each_tick() {
    let machine = starmill();
    let scale = steps_per_mm(&machine);
    let piece = &program("G91 G1 X10 Y5 F300\nM30", &machine)[0];
    // 11.18 mm at 5 mm/s are 203.3 ticks of 11 ms, so 204; 1000/204 steps a tick.
    assert_eq!(piece.ticks, 204);
    let mut range = Range::default();
    range.include(piece, &scale);
    for rounding in [Rounding::Nearest, Rounding::Down] {
        let word = range.word(20, rounding).unwrap();
        assert_eq!(word.fraction_bits, 5);
        let mut node = Node::new(word, &piece.at_steps(0, &scale));
        node.take(piece);
        (0..204).for_each(|_| node.tick());
        let drift = node.position_steps()[Axis::X] - 8500.0;
        let told = word.position(1000.0 / 204.0) as f64 / 32.0;
        assert!((drift - 204.0 * (told - 1000.0 / 204.0)).abs() < 1e-9, "{drift}");
    }
}

#[test]
fn longer_words_drift_less_and_the_least_is_found() {
    let text = "G91 G3 I-20 F300\nG1 X-20 Y-20\nX20 Y20\nG2 X-20 Y20 R20\nM30";
    let (runs, needs) = run(text);
    let least = least_word(&runs).unwrap();
    assert!(least.fraction_bits > 2 && least.bits < runs.last().unwrap().word().bits);
    let drifts: Vec<f64> = runs.iter().map(|run| run.greatest.steps).collect();
    assert!(drifts[0] > 10.0, "{drifts:?}");
    assert!(drifts.iter().zip(&drifts[4..]).all(|(short, long)| long < short), "{drifts:?}");
    assert!(needs.ticks > 2000);
}

#[test]
fn whole_steps_a_tick_need_no_bit_behind_the_point() {
    // 10 mm/s for 11 ms are 11 steps.
    let (runs, _) = run("G91 G1 X1.1 F600\nM30");
    assert_eq!(least_word(&runs).unwrap().fraction_bits, 0);
}

/// Runs `cnc interpolate --method b`: exit code and both streams.
fn interpolate(args: &[&str]) -> (i32, String, String) {
    let output = Command::cargo_bin("cnc")
        .unwrap()
        .env_remove("CNC_MACHINE")
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(["interpolate", "--method", "b"])
        .args(args)
        .output()
        .unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

fn document(args: &[&str]) -> Value {
    let (code, out, err) = interpolate(&[args, &["--json"]].concat());
    assert_eq!(code, 0, "{err}");
    serde_json::from_str(&out).unwrap()
}

#[test]
fn the_samples_drift_as_the_table_says() {
    let table = include_str!("papers/drift.csv");
    let manual = include_str!("../docs/method-b.md");
    let number = |text: &str| text.trim().parse::<f64>().unwrap();
    let shown = |sample: &str| {
        let begin = format!("| {sample}.nc | ");
        manual.lines().find(|line| line.starts_with(&begin)).map(|line| line.to_owned())
    };
    let mut in_manual = 0;
    for row in table.lines().filter(|line| !line.starts_with('#')).skip(1) {
        let cells: Vec<&str> = row.split(',').collect();
        let report = document(&[&format!("samples/good/{}.nc", cells[0])]);
        assert_eq!(report["ticks"].to_string(), cells[1], "{row}");
        for (cell, bits) in cells[2..5].iter().zip([16, 24, 30]) {
            let by_word = report["by_word"].as_array().unwrap();
            let run = by_word.iter().find(|run| run["word_bits"] == bits).unwrap();
            let drift = run["drift_max_steps"].as_f64().unwrap();
            assert_eq!(format!("{drift:.3}"), **cell, "{row}");
        }
        assert_eq!(report["least_word_bits"].to_string(), cells[5], "{row}");
        // The manual shows most of them, to three digits or three places.
        if let Some(line) = shown(cells[0]) {
            let told: Vec<f64> = line.split('|').skip(2).take(5).map(number).collect();
            for (told, cell) in told.iter().zip(&cells[1..6]) {
                assert!((told - number(cell)).abs() <= 0.005 * number(cell), "{row}: {line}");
            }
            in_manual += 1;
        }
    }
    assert!(in_manual >= 7, "the manual shows {in_manual} samples");
}

#[test]
fn circles_of_small_angles_grow() {
    let file = tempfile::NamedTempFile::with_suffix(".nc").unwrap();
    std::fs::write(&file, "G91 G17\nG3 I-20 F300\nM30\n").unwrap();
    let path = file.path().to_str().unwrap();
    let exact = document(&[path]);
    let small = document(&[path, "--constants", "small-angle"]);
    let ticks = exact["ticks"].as_f64().unwrap();
    // Eq. 6.11 and 6.12: the radius grows by a factor of sqrt(1 + angle²) a tick.
    let angle = std::f64::consts::TAU / ticks;
    let grown = 2000.0 * ((1.0 + angle * angle).powf(ticks / 2.0) - 1.0);
    let drift = small["drift_end_steps"]["X"].as_f64().unwrap();
    assert!((drift - grown).abs() < 0.1 && grown > 17.0, "{drift} {grown}");
    assert!(exact["drift_max_steps"].as_f64().unwrap() < 0.01);
    assert_eq!(small["least_word_bits"], Value::Null);
}

#[test]
fn a_word_without_room_is_refused_with_the_figure() {
    let kimm = "samples/good/kimm-test.nc";
    let (code, out, err) = interpolate(&[kimm, "--word-bits", "16", "--fraction-bits", "4"]);
    assert_eq!((code, out.as_str()), (1, ""));
    assert!(
        err.contains("needs 14 bits before the point") && err.contains("--word-bits 19"),
        "{err}"
    );
    let (code, _, err) = interpolate(&[kimm, "--word-bits", "8"]);
    assert_eq!(code, 1);
    assert!(err.contains("--word-bits 15"), "{err}");
    for args in
        [&[kimm, "--word-bits", "63"][..], &[kimm, "--times"], &[kimm, "--encoder", "thesis"]]
    {
        assert_eq!(interpolate(args).0, 2, "{args:?}");
    }
}

#[test]
fn every_tick_and_the_drawing_come_as_files() {
    let folder = tempfile::tempdir().unwrap();
    let svg = folder.path().join("drift.svg");
    let kimm = "samples/good/kimm-test.nc";
    let (code, out, err) = interpolate(&[kimm, "--csv", "--svg", svg.to_str().unwrap()]);
    assert_eq!(code, 0, "{err}");
    let lines: Vec<&str> = out.lines().collect();
    assert_eq!((lines[0], lines.len()), ("tick,line,X,Y,Z", 1 + 3969));
    assert_eq!(lines[3969], "3969,33,0.000214,-0.000061,0.000000");
    let drawn = std::fs::read_to_string(&svg).unwrap();
    assert!(drawn.contains("half a step") && drawn.contains("22 bits, 7 behind the point"));
    interpolate(&[kimm, "--svg", svg.to_str().unwrap()]);
    assert_eq!(std::fs::read_to_string(&svg).unwrap(), drawn);
}
