//! `cnc verify` as a user runs it: what it prints, its exit codes, what it refuses and why.

use std::fs;
use std::path::PathBuf;

use assert_cmd::Command;
use cnc::base::{Axis, Machine, Source};
use cnc::plan::{Feed, Seams};
use cnc::tape::{Encoding, Header, Origin, Writer};
use cnc::{interp, path, plan, step};
use serde_json::Value;

const PROGRAM: &str = "%\nO1 (a square with a round corner)\nG21 G90 G17\nG0 X1 Y1\n\
    M3 S1200\nG1 Z-1 F120\nG1 X9 F300\nG3 X10 Y2 I0 J1\nG1 Y10\nG2 X10 Y10 I-2 J0\n\
    G1 X1\nG1 Y1\nG0 Z0\nM30\n%\n";

/// A folder with a program and its dump, made by the library.
struct Bench {
    folder: tempfile::TempDir,
}

impl Bench {
    fn new() -> Bench {
        let bench = Bench { folder: tempfile::tempdir().unwrap() };
        fs::write(bench.file("p.nc"), PROGRAM).unwrap();
        fs::write(bench.file("p.csv"), dump("starmill", Encoding::Counts)).unwrap();
        bench
    }

    fn file(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Changes the dump's text, which has to change.
    fn change(&self, from: &str, to: &str) {
        let text = fs::read_to_string(self.file("p.csv")).unwrap();
        assert!(text.contains(from), "{from}");
        fs::write(self.file("p.csv"), text.replacen(from, to, 1)).unwrap();
    }

    /// Runs `cnc verify p.nc p.csv` with more arguments; gives exit code, output and messages.
    fn run(&self, more: &[&str]) -> (i32, String, String) {
        let mut command = Command::cargo_bin("cnc").unwrap();
        command.args(["verify", "p.nc", "p.csv"]).args(more).env_remove("CNC_MACHINE");
        let output = command.current_dir(self.folder.path()).output().unwrap();
        let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
        (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
    }

    fn check_refused(&self, more: &[&str], code: i32, reason: &str) {
        let (found, out, messages) = self.run(more);
        assert_eq!((found, out.as_str()), (code, ""), "{messages}");
        assert!(messages.contains(reason), "{messages}");
    }
}

#[test]
fn where_nothing_moves_there_is_no_place() {
    let bench = Bench::new();
    fs::write(bench.file("rest.nc"), "M5\nM30\n").unwrap();
    let mut command = Command::cargo_bin("cnc").unwrap();
    command.args(["verify", "rest.nc", "--json", "-q"]).env_remove("CNC_MACHINE");
    let output = command.current_dir(bench.folder.path()).output().unwrap();
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&found["verdict"], &found["worst"]), (&Value::from("pass"), &Value::Null));
    assert!(found["limits"].as_array().unwrap().iter().all(|check| check.get("at").is_none()));
    // A dump of another tool does not say its lines.
    fs::write(bench.file("p.csv"), "X,Y,Z\n1,1,0\n0,0,0\n").unwrap();
    let found: Value = serde_json::from_str(&bench.run(&["--unsealed", "--json"]).1).unwrap();
    let speed = found["limits"].as_array().unwrap().iter().find(|check| check["check"] == "speed");
    assert_eq!(speed.unwrap()["at"]["line"], Value::Null);
}

/// A row each time that a line with motion comes to be executed; the greatest is that of the job.
#[test]
fn each_block_is_told_of() {
    let bench = Bench::new();
    let (code, lines, messages) = bench.run(&["--blocks", "--json"]);
    assert_eq!((code, messages.as_str()), (0, ""), "{lines}");
    let lines: Vec<Value> = lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let (report, blocks) = lines.split_last().unwrap();
    assert!(blocks.iter().all(|block| block["type"] == "block"));
    let numbers: Vec<u64> = blocks.iter().map(|block| block["line"].as_u64().unwrap()).collect();
    assert_eq!(numbers, [4, 6, 7, 8, 9, 10, 11, 12, 13]);
    let ticks: u64 = blocks.iter().map(|block| block["ticks"].as_u64().unwrap()).sum();
    let text = fs::read_to_string(bench.file("p.csv")).unwrap();
    let moves = |row: &&str| !row.starts_with(['#', 't']) && !row.contains(",0,0,0,");
    assert_eq!(ticks, text.lines().filter(moves).count() as u64);
    let most = blocks.iter().map(|block| block["max_mm"].as_f64().unwrap()).fold(0.0, f64::max);
    assert_eq!(most, report["max_contour_error_mm"]);
    // Lines along an axis are on their path throughout, the arcs are rounded.
    for block in blocks {
        let is_arc = [8, 10].contains(&block["line"].as_u64().unwrap());
        let rms_mm = block["rms_mm"].as_f64().unwrap();
        assert_eq!(is_arc, rms_mm > 0.001, "{block}");
    }
    let (_, table, _) = bench.run(&["--blocks"]);
    let (rows, checks) = table.split_once("\ncheck ").unwrap();
    assert_eq!(rows.lines().count(), 3 + blocks.len(), "{table}");
    assert!(checks.contains("\ncontour") && table.ends_with("\npass\n"), "{table}");
}

/// A step aside shows in the block where it was made.
#[test]
fn the_block_that_is_off_is_told() {
    let bench = Bench::new();
    let text = fs::read_to_string(bench.file("p.csv")).unwrap();
    let rows: Vec<&str> = text.lines().filter(|row| row.split(',').nth(2) == Some("9")).collect();
    let row = rows[rows.len() / 2];
    // Line 9 goes along Y: X is off by 8 steps, 0.08 mm, from one tick to the next.
    let off = |row: &str, steps: &str| {
        let mut cells: Vec<&str> = row.split(',').collect();
        cells[3] = steps;
        cells.join(",")
    };
    let next = rows[rows.len() / 2 + 1];
    bench.change(row, &off(row, "8"));
    bench.change(next, &off(next, "-8"));
    let (code, lines, _) = bench.run(&["--blocks", "--json", "--unsealed"]);
    assert_eq!(code, 1, "{lines}");
    let lines: Vec<Value> = lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    for block in &lines[..lines.len() - 1] {
        let max_mm = block["max_mm"].as_f64().unwrap();
        assert_eq!(block["line"] == 9, max_mm > 0.02, "{block}");
        assert!(block["line"] != 9 || (max_mm - 0.08).abs() < 1e-4, "{block}");
    }
}

#[test]
fn blocks_are_told_of_one_program_only() {
    let bench = Bench::new();
    bench.check_refused(&["--blocks", "--format", "junit"], 2, "--blocks tells of one program");
    bench.check_refused(&["--blocks", "--programs"], 2, "--blocks tells of one program");
}

fn dump(machine: &str, encoding: Encoding) -> Vec<u8> {
    let machine = Machine::load(machine).unwrap();
    let source = Source::memory("p.nc", PROGRAM.as_bytes());
    let options = interp::Options::default();
    let (checked, sha256) = interp::check_and_hash(&source, &machine, &options, 10).unwrap();
    assert_eq!(checked.diagnostics, []);
    let segments = path::segments(interp::motions(&source, &machine, &options), &machine);
    let start_mm = machine.work_zero_mm;
    let plan = plan::plan(segments, &machine, Feed::ExactStop, Seams::NONE, start_mm);
    let header = Header {
        tool: "cnc".to_owned(),
        program: Origin { name: "p.nc".to_owned(), sha256 },
        inputs: Vec::new(),
        options: vec![("dialect".to_owned(), "iso".to_owned())],
        machine: Origin { name: machine.id.clone(), sha256: machine.sha256() },
        tick_us: machine.bus.tick_us,
        steps_per_mm: Axis::LINEAR
            .map(|axis| (axis, machine.axis(axis).unwrap().steps_per_mm))
            .into(),
        start_steps: machine.nearest_steps(&start_mm),
        encoding,
    };
    let mut writer = Writer::new(Vec::new(), &header).unwrap();
    for command in step::interpolate(plan, &machine, start_mm) {
        writer.command(&command.unwrap()).unwrap();
    }
    writer.finish().unwrap()
}

#[test]
fn a_sound_dump_passes() {
    let bench = Bench::new();
    let (code, table, messages) = bench.run(&[]);
    assert_eq!((code, messages.as_str()), (0, ""), "{table}");
    assert!(table.contains("contour") && table.ends_with("\npass\n"), "{table}");
    let (code, json, _) = bench.run(&["--json"]);
    let report: Value = serde_json::from_str(&json).unwrap();
    assert_eq!((code, &report["schema"], &report["verdict"]), (0, &1.into(), &"pass".into()));
    assert_eq!(report["tolerance_mm"], 0.01366);
    assert_eq!(report["end_error_steps"], serde_json::json!({"X": 0, "Y": 0, "Z": 0}));
    assert_eq!(report["failures"], serde_json::json!([]));
    let error = report["max_contour_error_mm"].as_f64().unwrap();
    assert!(report["rms_contour_error_mm"].as_f64().unwrap() < error && error < 0.01366);
    assert!(report["worst"]["tick"].is_u64() && report["worst"]["line"].is_u64());
    assert!(report["max_steps_per_tick"]["X"].is_u64() && report["seconds"].is_f64());
    let (code, out, messages) = bench.run(&["--quiet"]);
    assert_eq!((code, out.as_str(), messages.as_str()), (0, "", ""));
    fs::write(bench.file("p.csv"), dump("starmill", Encoding::Bytes)).unwrap();
    assert_eq!(bench.run(&[]).0, 0);
}

/// A table that stands at 180 degrees and does not move has no column in the dump: it is where it was.
#[test]
fn axes_without_a_column_stand_where_the_job_starts() {
    let bench = Bench::new();
    let profile = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/machines/rotary-table.toml");
    let run = |arguments: &[&str]| {
        let mut command = Command::cargo_bin("cnc").unwrap();
        command.args(["-m", profile]).args(arguments).env_remove("CNC_MACHINE");
        let output = command.current_dir(bench.folder.path()).output().unwrap();
        assert!(output.status.success(), "{arguments:?}: {output:?}");
    };
    for start in [&[][..], &["--start", "70,50,50,90"]] {
        run(&[&["interpolate", "p.nc", "--csv", "-q", "-o", "p.csv"], start].concat());
        let text = fs::read_to_string(bench.file("p.csv")).unwrap();
        assert!(text.contains("\ntick,buffer,line,X,Y,Z,event\n"), "{text}");
        run(&["verify", "p.nc", "p.csv"]);
        run(&["verify", "p.nc", "p.csv", "--unsealed"]);
        run(&[&["diff", "p.nc", "p.csv"], start].concat());
    }
}

/// Each key of the header, and the rows.
#[test]
fn what_was_changed_is_refused_with_its_reason() {
    let input = format!("# inputs: t.csv sha256:{}\n", "0".repeat(64));
    for (from, to, reason) in [
        ("\n10,0,", "\n10,0,1", "changed"),
        ("\n10,0,", "\n11,0,", "tick 11 where 10 belongs"),
        ("# cnc-dump: 1", "# cnc-dump: 9", "version 9"),
        ("# cnc-dump: 1", "G0 X1", "no command dump"),
        ("# tool: cnc\n", "", "no line '# tool"),
        ("# program: p.nc sha256:", "# program: p.nc sha256:00", "'program'"),
        ("# inputs:\n", &input, "further file 't.csv'"),
        ("# options: dialect=iso", "# options: dialect=iso warp=9", "warp=9"),
        ("# options: dialect=iso", "# options: dialect=iso dialect=iso", "would write"),
        ("# options: dialect=iso", "# options:", "would write as 'dialect=iso'"),
        ("# options: dialect=iso", "# options: dialect=iso start=75,50,50", "would write"),
        ("# options: dialect=iso", "# options: dialect=iso encoder=thesis", "100000 us"),
        ("# machine: starmill", "# machine: router", "made for machine 'router'"),
        ("# machine: starmill sha256:", "# machine: starmill sha256:00", "'machine'"),
        ("# tick_us: 11000", "# tick_us: 10000", "10000 us"),
        ("# steps_per_mm: X=100", "# steps_per_mm: X=200", "X=200"),
        ("# start_steps: X=7500", "# start_steps: X=7501", "starts at step X=7501"),
        ("# encoding: counts", "# encoding: bytes", "no value of a bus byte"),
        ("# end: ticks=", "# end: ticks=1", "were sealed"),
        ("# end: ticks=", "# ende: ticks=", "1 fields where 7 belong"),
    ] {
        let bench = Bench::new();
        bench.change(from, to);
        bench.check_refused(&[], 1, reason);
        let (code, out, _) = bench.run(&["--json"]);
        let told: Value = serde_json::from_str(&out).unwrap();
        assert_eq!((code, &told["result"]), (1, &Value::from("error")), "{out}");
        assert!(told["error"].as_str().unwrap().contains(reason), "{out}");
    }
    let bench = Bench::new();
    fs::write(bench.file("p.csv"), dump("starmill", Encoding::Bytes)).unwrap();
    bench.change("# encoding: bytes", "# encoding: counts");
    bench.check_refused(&[], 1, "which is not what was sealed");
}

/// Files may be renamed, and dumps outlive the release that wrote them.
#[test]
fn names_in_the_header_are_labels() {
    let bench = Bench::new();
    bench.change("# tool: cnc\n", "# tool: cnc 0.0.9\n");
    bench.change("# program: p.nc sha256", "# program: q, r.nc sha256");
    assert_eq!(bench.run(&[]).0, 0);
}

#[test]
fn a_truncated_dump_is_refused() {
    let bench = Bench::new();
    let text = fs::read_to_string(bench.file("p.csv")).unwrap();
    fs::write(bench.file("p.csv"), &text[..text.len() / 2]).unwrap();
    bench.check_refused(&[], 1, "truncated");
}

#[test]
fn another_machine_or_program_is_refused() {
    let bench = Bench::new();
    bench.check_refused(&["--machine", "router"], 1, "use --machine starmill");
    let own = Machine::load("starmill").unwrap().to_toml().replace("= 2000", "= 2001");
    fs::write(bench.file("starmill.toml"), own).unwrap();
    bench.check_refused(&["--machine", "starmill.toml"], 1, "another profile");
    fs::write(bench.file("p.nc"), PROGRAM.replace("X9 ", "X9.0 ")).unwrap();
    bench.check_refused(&[], 1, "another program");
    fs::write(bench.file("p.nc"), "G1 X1\n").unwrap();
    bench.check_refused(&[], 1, "error");
    fs::remove_file(bench.file("p.nc")).unwrap();
    bench.check_refused(&[], 2, "p.nc");
}

#[test]
fn a_dump_out_of_tolerance_fails() {
    let bench = Bench::new();
    let text = fs::read_to_string(bench.file("p.csv")).unwrap();
    let rows: Vec<&str> = text.lines().filter(|line| !line.starts_with('#')).collect();
    // It says nothing of node buffers, and lasts longer than one.
    let mut bare = vec!["X,Y,Z".to_owned()];
    for row in &rows[1..] {
        let fields: Vec<&str> = row.split(',').collect();
        bare.push(fields[3..6].join(","));
    }
    bare.resize(2000, "0,0,0".to_owned());
    fs::write(bench.file("p.csv"), bare.join("\n") + "\n").unwrap();
    bench.check_refused(&[], 1, "no command dump");
    let (code, table, _) = bench.run(&["--unsealed"]);
    assert!(code == 0 && !table.contains("ticks of a buffer"), "{table}");
    assert!(table.contains("contour") && table.contains("end point"), "{table}");
    bare.remove(60);
    fs::write(bench.file("p.csv"), bare.join("\n") + "\n").unwrap();
    let (code, table, _) = bench.run(&["--unsealed"]);
    assert!(code == 1 && table.contains("\nFAIL\n  contour: "), "{table}");
    let (code, json, messages) = bench.run(&["--unsealed", "--json"]);
    let report: Value = serde_json::from_str(&json).unwrap();
    assert_eq!((code, &report["verdict"]), (1, &"fail".into()));
    assert!(messages.contains("error: p.csv: contour: "), "{messages}");
}
