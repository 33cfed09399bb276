//! `cnc interpolate` as a user runs it: what it tells of speeds, seams and times, and the override.

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use serde_json::Value;

const PROGRAM: &str = "G21 G90 G17\nT1 M6\nM3 S1200\nG0 X1 Y1\nG1 Z-1 F120\nG1 X40 F600\n\
    G3 X45 Y6 I0 J5\nM49\nG1 Y20\nM48\nG93\nG1 X1 F20\nG94\nT2 M6\nG1 Y1 F300\nG4 P0.5\n\
    G61.1\nG1 X5\nG1 X9\nG0 Z0\nM30\n";

fn cnc(args: &[&str]) -> (i32, String, String) {
    let output =
        Command::cargo_bin("cnc").unwrap().args(args).env_remove("CNC_MACHINE").output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
}

fn good(args: &[&str]) -> String {
    let (code, out, messages) = cnc(args);
    assert_eq!(code, 0, "{args:?}: {messages}");
    out
}

fn json(args: &[&str]) -> Value {
    serde_json::from_str(&good(&[args, &["--json"]].concat())).unwrap()
}

fn json_lines(args: &[&str]) -> Vec<Value> {
    let lines = good(&[args, &["--json"]].concat());
    lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn program(folder: &tempfile::TempDir) -> String {
    let path = folder.path().join("part.nc");
    fs::write(&path, PROGRAM).unwrap();
    path.to_str().unwrap().to_owned()
}

/// Good samples that the built-in machine can run.
fn samples() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/good");
    let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let own = |path: &PathBuf| {
        let text = String::from_utf8_lossy(&fs::read(path).unwrap()).into_owned();
        path.extension().is_some_and(|end| end == "nc") && !text.contains("machine: ")
    };
    files.filter(own).collect()
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key}: {value}"))
}

#[test]
fn an_override_changes_time_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let part = program(&folder);
    let dump = folder.path().join("part.csv");
    let dump = dump.to_str().unwrap();
    let mut times = Vec::new();
    let mut ends = Vec::new();
    for (percent, noted) in [("25%", "25"), ("50", "50"), ("100%", "100"), ("200%", "200")] {
        let option = ["--override", percent];
        let summary = json(&[&["interpolate", &part], &option[..]].concat());
        times.push(number(&summary, "motion_seconds"));
        ends.push((summary["extents_mm"].clone(), summary["distance_mm"].clone()));
        good(&[&["interpolate", &part, "--csv", "-o", dump], &option[..]].concat());
        let text = fs::read_to_string(dump).unwrap();
        assert!(text.contains(&format!("override={noted}\n")), "{text:.300}");
        let last = text.lines().last().unwrap().rsplit_once(" sha256").unwrap().0.to_owned();
        let position = last.split_once(" X=").unwrap().1.to_owned();
        ends.push((Value::from(position), Value::Null));
        let report = json(&["verify", &part, dump]);
        assert_eq!(report["verdict"], "pass", "{report}");
        let error = number(&report, "max_contour_error_mm");
        assert!(error <= number(&report, "tolerance_mm"));
        assert!(number(&report, "max_feed_error_percent") < 2.0, "{report}");
    }
    assert!(times.windows(2).all(|pair| pair[1] < pair[0]), "{times:?}");
    assert!(ends.iter().step_by(2).all(|end| *end == ends[0]), "{ends:?}");
    assert!(ends.iter().skip(1).step_by(2).all(|end| *end == ends[1]), "{ends:?}");

    // The dump of a faster job, passed off as one at 50 %.
    let text = fs::read_to_string(dump).unwrap().replace("override=200", "override=50");
    fs::write(dump, text).unwrap();
    let (code, out, _) = cnc(&["verify", &part, dump]);
    assert!(code == 1 && out.contains("feed"), "{out}");

    for bad in ["0", "201%", "x", "-5", "nan"] {
        let option = format!("--override={bad}");
        let (code, _, messages) = cnc(&["interpolate", &part, &option]);
        assert!(code == 2 && messages.contains("1% to 200%"), "{bad}: {messages}");
    }
}

/// Corners that G64 P lets be cut are cut by the same curves, whatever the operator makes of the feed.
#[test]
fn an_override_changes_no_curve() {
    let folder = tempfile::tempdir().unwrap();
    let [part, dump] = ["blends.nc", "blends.csv"].map(|name| folder.path().join(name));
    let [part, dump] = [&part, &dump].map(|path| path.to_str().unwrap());
    fs::write(part, "G21 G90 F600 G64 P1\nG1 X10\nG1 Y10\nM49 G1 X0\nM48 G1 Y0\nM30\n").unwrap();
    let cut_mm = ["10%", "50%", "100%", "200%"].map(|percent| {
        good(&["interpolate", part, "--csv", "-o", dump, "--override", percent]);
        let report = json(&["verify", part, dump]);
        let checks = report["limits"].as_array().unwrap();
        let corners = checks.iter().find(|check| check["check"] == "corners under G64 P").unwrap();
        number(corners, "value")
    });
    // A tick's chord and rounding differ.
    let spread_mm = cut_mm.iter().fold(0.0, |most: f64, mm| most.max((mm - cut_mm[2]).abs()));
    assert!(cut_mm[2] > 0.2 && spread_mm < 0.015, "{cut_mm:?}");
}

#[test]
fn an_override_scales_each_feed_that_the_program_lets_it() {
    let folder = tempfile::tempdir().unwrap();
    let part = program(&folder);
    let feeds = |percent: &str| -> Vec<(u64, f64)> {
        let blocks = json_lines(&["interpolate", &part, "--explain-feed", "--override", percent]);
        let cuts = blocks.iter().filter(|block| !block["feed_mm_min"].is_null());
        cuts.map(|block| (block["line"].as_u64().unwrap(), number(block, "feed_mm_min"))).collect()
    };
    for ((line, full), (other, half)) in feeds("100%").into_iter().zip(feeds("50%")) {
        assert_eq!(line, other);
        let share = if line == 9 { 1.0 } else { 0.5 };
        assert!((half - share * full).abs() < 1e-6, "line {line}: {full}, {half}");
    }
    let tap = folder.path().join("tap.nc");
    fs::write(&tap, "M3 S100\nG84 X1 Y1 Z-2 R1 F100\nG80\nG1 X3\nM30\n").unwrap();
    let args = ["interpolate", tap.to_str().unwrap(), "--explain-feed", "--override", "50%"];
    for block in json_lines(&args) {
        let feed = block["feed_mm_min"].as_f64();
        let expected = if block["line"] == 2 { 100.0 } else { 50.0 };
        assert!(feed.is_none_or(|feed| feed == expected), "{block}");
    }
}

#[test]
fn the_speed_at_a_block_s_end_is_no_more_than_any_of_three() {
    for sample in samples() {
        let name = sample.to_str().unwrap();
        for block in json_lines(&["interpolate", name, "--explain-feed"]) {
            let candidate = |key: &str| block[key].as_f64().unwrap_or(f64::INFINITY);
            let least = ["f1_mm_min", "f2_mm_min", "f3_mm_min"].map(candidate);
            let least = least.into_iter().fold(f64::INFINITY, f64::min);
            let (end, top) = (number(&block, "end_mm_min"), number(&block, "top_mm_min"));
            // A limit on jerk may take more.
            assert!(end <= least + 1e-6 * least.max(1.0), "{name}: {block}");
            assert!(top >= end && number(&block, "length_mm") > 0.0, "{name}: {block}");
            if let Some(feed) = block["feed_mm_min"].as_f64() {
                assert!(top <= feed * (1.0 + 1e-6), "{name}: {block}");
            }
            let rests = ["stop", "seam"].contains(&block["end_bound"].as_str().unwrap());
            assert!(!rests || end == 0.0, "{name}: {block}");
        }
    }
}

#[test]
fn what_bounds_a_speed_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("part.nc");
    let check = |text: &str, end: &[&str], top: &[&str]| {
        fs::write(&path, text).unwrap();
        let blocks =
            json_lines(&["interpolate", path.to_str().unwrap(), "-mrouter", "--explain-feed"]);
        let found = |key: &str| -> Vec<String> {
            blocks.iter().map(|block| block[key].as_str().unwrap().to_owned()).collect()
        };
        assert_eq!(
            (found("end_bound"), found("top_bound")),
            (strings(end), strings(top)),
            "{text}"
        );
    };
    check("G1 X300 F600\nM30\n", &["stop"], &["feed"]);
    check("G0 X300\nG4 P1\nG0 X1\nM30\n", &["stop"; 2], &["steps a tick of X"; 2]);
    // So short that the acceleration is never at its greatest, and long enough: 2·A³/J² is 6.25 mm.
    check("G1 X6 F30000\nM30\n", &["stop"], &["jerk"]);
    check("G1 X7 F30000\nM30\n", &["stop"], &["acceleration"]);
    check("G1 X20 F6000\nY20\nM30\n", &["speed step of X in corners", "stop"], &["feed"; 2]);
    check(
        "G1 X20 F6000\nX0.1\nX0\nM30\n",
        &["speed step of X in corners", "jerk", "stop"],
        &["feed", "feed", "jerk"],
    );
}

fn strings(words: &[&str]) -> Vec<String> {
    words.iter().map(|word| (*word).to_owned()).collect()
}

#[test]
fn times_add_up_to_the_time_of_the_job() {
    let mut found = 0;
    for sample in samples() {
        let name = sample.to_str().unwrap();
        let mut lines = json_lines(&["interpolate", name, "--times"]);
        let summary = lines.pop().unwrap();
        assert_eq!((&summary["schema"], &summary["type"]), (&1.into(), &"summary".into()));
        let (total, times) = (number(&summary, "total_seconds"), &summary["times"]);
        let is_near = |sum: f64| (sum - total).abs() < 1e-5 * (1 + lines.len()) as f64;
        let sum = |rows: &[Value]| rows.iter().map(|row| number(row, "total_seconds")).sum();
        assert!(is_near(number(times, "total_seconds")), "{name}: {summary}");
        assert!(is_near(sum(&lines)), "{name}: {lines:?}");
        assert!(is_near(sum(times["by_tool"].as_array().unwrap())), "{name}: {summary}");
        let plain = json(&["interpolate", name]);
        assert_eq!(plain["total_seconds"], summary["total_seconds"], "{name}");
        assert_eq!(plain["times"], Value::Null);

        // The host's own clock tells the same.
        let (code, out, messages) =
            cnc(&["send", "sim:", name, "--dry-run", "--json", "--ignore-stops"]);
        assert_eq!(code, 0, "{name}: {messages}");
        let job: Value = serde_json::from_str(&out).unwrap();
        let apart = (number(&job, "seconds") - total).abs();
        assert!(apart <= 1e-4 * total, "{name}: {job}, {total} s");
        found += 1;
    }
    assert!(found > 10);
}

#[test]
fn times_are_told_by_tool() {
    let folder = tempfile::tempdir().unwrap();
    let part = program(&folder);
    let lines = json_lines(&["interpolate", &part, "--times"]);
    let (summary, blocks) = lines.split_last().unwrap();
    let tools = summary["times"]["by_tool"].as_array().unwrap();
    let names: Vec<&Value> = tools.iter().map(|tool| &tool["tool"]).collect();
    assert_eq!(names, [&Value::from(1), &2.into()]);
    assert_eq!(tools[1]["dwell_seconds"], 0.5);
    assert!(number(&tools[0], "cut_seconds") > 1.0 && number(&tools[1], "rapid_seconds") > 0.05);
    let dwell = blocks.iter().find(|block| block["line"] == 16).unwrap();
    assert_eq!((&dwell["dwell_seconds"], &dwell["tool"]), (&0.5.into(), &2.into()));
    let change = blocks.iter().find(|block| block["line"] == 14).unwrap();
    assert_eq!((&change["events"], &change["total_seconds"]), (&1.into(), &0.0.into()));
    let table = good(&["interpolate", &part, "--times"]);
    assert!(table.contains("\n       16    T2      0.000      0.000      0.500 "), "{table}");
}

#[test]
fn every_seam_is_told_with_its_parts() {
    for sample in samples() {
        let name = sample.to_str().unwrap();
        let report = json(&["interpolate", name, "--seams", "report"]);
        let summary = json(&["interpolate", name]);
        let (seams, others) =
            (report["seams"].as_array().unwrap(), summary["seams"].as_array().unwrap());
        assert_eq!(seams.len(), others.len(), "{name}");
        // Rounding of sums aside, the choice is the best there is.
        assert_eq!(report["above_least_seconds"], 0.0, "{name}");
        for (seam, other) in seams.iter().zip(others) {
            for key in ["tick", "line", "kind"] {
                assert_eq!(seam[key], other[key], "{name}: {seam} {other}");
            }
            let lost = number(seam, "fill_seconds") + number(seam, "pads_seconds");
            assert!((lost - number(other, "lost_seconds")).abs() < 0.01, "{name}: {seam} {other}");
            let total = lost + number(seam, "ramps_seconds") + number(seam, "penalty_seconds");
            assert!((total - number(seam, "total_seconds")).abs() < 1e-5, "{name}: {seam}");
            if seam["next_best_more_inside"] == 0 {
                assert!(number(seam, "next_best_more_seconds") >= 0.0, "{name}: {seam}");
            }
        }
    }
}

/// Just behind the end of a cut, where there is no other place for a seam, a person acts.
#[test]
fn a_buffer_ends_where_a_person_acts_without_ramps_too() {
    let folder = tempfile::tempdir().unwrap();
    let part = folder.path().join("part.nc");
    std::fs::write(&part, "G1 X29.08 Y25.27 F60\nG0 X29.03 Y25.3\nM1\nG1 X28.2 Y25.1\nM30\n")
        .unwrap();
    for feed in ["constant", "look-ahead", "exact-stop"] {
        let run = ["interpolate", part.to_str().unwrap(), "--feed", feed];
        let (report, summary) = (json(&[&run[..], &["--seams", "report"]].concat()), json(&run));
        let seams = [&report, &summary].map(|told| told["seams"].as_array().unwrap().len());
        assert!(seams[0] > 0 && seams[0] == seams[1], "{feed}: {seams:?}");
    }
}

/// The corners of the rapid are as far from each other as this machine speeds up and brakes in a tick: going on
/// in between left next to no speed, 131 years for the rapid, and no place for a seam behind it.
#[test]
fn nobody_creeps_from_corner_to_corner() {
    let folder = tempfile::tempdir().unwrap();
    let part = folder.path().join("part.nc");
    let text = "F60\nG0 Z2.877\nG1 X25.3446 Y6.5967\nG1 X0.3384 Y-0.5767\n\
        G2 X3.8139 Y-3.8216 R4.5402\nG0 X3.8032 Y-3.8337\nG1 X0 Y0 Z0\nM30\n";
    std::fs::write(&part, text).unwrap();
    let router = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/machines/big-router.toml");
    let report = json(&["-m", router, "interpolate", part.to_str().unwrap(), "--seams", "report"]);
    assert_eq!(report["above_least_seconds"], 0.0, "{report}");
    assert!(report["seams"].as_array().unwrap().len() >= 3, "{report}");
}

/// This machine takes longer to speed up and stop than a node holds ticks, but not at a lower feed.
#[test]
fn buffers_that_no_node_holds_are_told_of() {
    let folder = tempfile::tempdir().unwrap();
    let [profile, part] = ["weak.toml", "part.nc"].map(|name| folder.path().join(name));
    let strong = include_str!("../src/base/machines/starmill.toml");
    let weak = strong.replace("accel_max_mm_s2 = 100.0", "accel_max_mm_s2 = 1.0");
    let weak = weak.replace("jerk_max_mm_s3 = 2000.0", "jerk_max_mm_s3 = 0.2");
    std::fs::write(&profile, weak).unwrap();
    for (feed, options, is_told) in [
        (1200, &[][..], true),
        (1200, &["--json"], true),
        (1200, &["--csv"], true),
        (1200, &["--quiet"], false),
        (300, &[], false),
    ] {
        std::fs::write(&part, format!("F{feed}\nG1 X60\nG1 X0\nM30\n")).unwrap();
        let [profile, part] = [&profile, &part].map(|path| path.to_str().unwrap());
        let (code, _, messages) = cnc(&[&["-m", profile, "interpolate", part], options].concat());
        assert_eq!(code, 0, "{messages}");
        let told = "up to line 3) has 3753 ticks of motion, a node holds 1496";
        assert_eq!(messages.contains(told), is_told, "{options:?}: {messages}");
    }
}

#[test]
fn reports_that_cannot_be_made_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let part = program(&folder);
    for (options, reason) in [
        (&["--times", "--csv"][..], "cannot be used with"),
        (&["--times", "--explain-feed"], "cannot be used with"),
        (&["--seams", "all"], "possible values: report"),
        (&["--times", "--encoder", "thesis"], "plans nothing"),
        (&["--explain-feed", "--feed", "constant"], "no accelerations"),
    ] {
        let (code, out, messages) = cnc(&[&["interpolate", &part], options].concat());
        assert_eq!((code, out.as_str()), (2, ""), "{options:?}: {messages}");
        assert!(messages.contains(reason), "{options:?}: {messages}");
    }
}
