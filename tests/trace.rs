//! Traces as files, and `cnc replay`. That a replay executes what the nodes did is part of the rule that
//! tests/faults.rs holds seeds to.

use std::fs;
use std::path::PathBuf;
use std::process::{Command as Process, Output, Stdio};

use cnc::wire_io::{TraceHeader, TraceLine, TraceReader};
use proptest::prelude::*;

fn line() -> impl Strategy<Value = TraceLine> {
    let bytes = prop::collection::vec(any::<u8>(), 1..70);
    prop_oneof![
        (any::<u32>(), bytes.clone(), any::<bool>())
            .prop_map(|(t, bytes, failed)| { TraceLine::Sent { t_us: t.into(), bytes, failed } }),
        (any::<u32>(), bytes).prop_map(|(t, bytes)| TraceLine::Received { t_us: t.into(), bytes }),
        (1_u64..1000).prop_map(|lines| TraceLine::Lost { lines }),
    ]
}

const HEADER: &str = r#"{"schema":1,"type":"trace","tool":"cnc 0.1.0","started_unix_us":1,"port":"sim:","speed":"1","machine":"m","machine_sha256":"","program":"p","job_sha256":"","start_steps":{"X":-5}}"#;

proptest! {
    #[test]
    fn lines_read_back_as_they_were_written(lines in prop::collection::vec(line(), 0..20)) {
        let mut lines = lines;
        let time = |line: &TraceLine| match line {
            TraceLine::Sent { t_us, .. } | TraceLine::Received { t_us, .. } => *t_us,
            _ => 0,
        };
        lines.sort_by_key(time);
        let text: String = lines.iter().map(|line| format!("{line}\n")).collect();
        let text = format!("{HEADER}\n{text}");
        let reader = TraceReader::open(text.as_bytes()).unwrap();
        let header: TraceHeader = serde_json::from_str(HEADER).unwrap();
        prop_assert_eq!(reader.header(), &header);
        let read: Vec<_> = reader.map(Result::unwrap).collect();
        prop_assert_eq!(read, lines);
    }

    #[test]
    fn no_text_panics(text in "(\\{\"t_us\":[0-9]{1,3},\"dir\":\"(tx|rx)\",\"hex\":\"[0-9a-g]{0,4}\"\\}?\n?){0,5}") {
        let text = format!("{HEADER}\n{text}");
        TraceReader::open(text.as_bytes()).unwrap().for_each(drop);
    }
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Folder {
        let folder = Folder(tempfile::tempdir().unwrap());
        fs::write(folder.path("part.nc"), "M3 S800\nG1 F600 X9 Y2\nM5\nG1 X0 Z3\nM30\n").unwrap();
        folder
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Runs `cnc` in the folder.
    fn cnc(&self, args: &[&str]) -> Output {
        let mut process = Process::new(env!("CARGO_BIN_EXE_cnc"));
        process.args(args).current_dir(&self.0).env_remove("CNC_MACHINE");
        process.stdin(Stdio::null()).output().unwrap()
    }
}

#[track_caller]
fn check(output: &Output, code: i32, says: &[&str]) {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let said = text(&output.stdout) + &text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{said}");
    for part in says {
        assert!(said.contains(part), "expected '{part}': {said}");
    }
}

#[test]
fn the_command_tells_how_far_each_axis_got() {
    let folder = Folder::new();
    let send = |port: &str| folder.cnc(&["send", port, "part.nc", "--trace", "t.jsonl"]);
    check(&send("sim:"), 0, &[]);
    let whole = fs::read_to_string(folder.path("t.jsonl")).unwrap();
    assert!(whole.lines().last().unwrap().ends_with(r#","end":"done"}"#));
    check(&folder.cnc(&["replay", "t.jsonl", "part.nc"]), 0, &["no answer differs", "same\n"]);
    check(&folder.cnc(&["replay", "t.jsonl", "-q"]), 0, &["the job ended: done"]);
    // The host is killed: all that is there is the same, and there is no end.
    fs::write(folder.path("cut.jsonl"), &whole[..whole.len() - 400]).unwrap();
    let cut = folder.cnc(&["replay", "cut.jsonl", "part.nc"]);
    check(&cut, 0, &["in the middle of a line", "same\n"]);
    check(&send("sim:faults=lose-answer@tick.20"), 3, &[]);
    let output = folder.cnc(&["replay", "t.jsonl", "part.nc", "--json"]);
    check(&output, 1, &[]);
    let result: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&result["verdict"], &result["end"]), (&"different".into(), &"failed".into()));
    assert_eq!(result["difference"]["received"], serde_json::Value::Null);
    let x = &result["nodes"]["X"];
    assert_eq!(
        (&x["tick"], &x["line"], &x["activity"]),
        (&21.into(), &2.into(), &"executing".into())
    );
    assert_eq!(result["in_step"], true);
}

#[test]
fn what_does_not_fit_is_refused() {
    let folder = Folder::new();
    check(&folder.cnc(&["send", "sim:", "part.nc", "--trace", "t.jsonl"]), 0, &[]);
    fs::write(folder.path("other.nc"), "G1 F600 X1\nM30\n").unwrap();
    check(&folder.cnc(&["replay", "t.jsonl", "other.nc"]), 1, &["trace of another job"]);
    let options = folder.cnc(&["replay", "t.jsonl", "part.nc", "--override", "50%"]);
    check(&options, 1, &["trace of another job"]);
    check(&folder.cnc(&["replay", "t.jsonl", "-m", "router"]), 1, &["on machine starmill"]);
    check(&folder.cnc(&["replay", "part.nc"]), 1, &["this is no trace"]);
    check(&folder.cnc(&["replay", "none.jsonl"]), 2, &["none.jsonl"]);
    let trace = fs::read_to_string(folder.path("t.jsonl")).unwrap();
    for (old, new, says) in [
        ("\"dir\":\"rx\"", "\"dir\":\"up\"", "line 3: expected t_us"),
        ("\"t_us\":0,", "\"t_us\":99999,", "line 3: its time is before"),
        ("6a7a", "6a7", "line 2: '6a7' are no bytes"),
        ("\"schema\":1", "\"schema\":2", "schema 2"),
    ] {
        fs::write(folder.path("bad.jsonl"), trace.replacen(old, new, 1)).unwrap();
        check(&folder.cnc(&["replay", "bad.jsonl"]), 1, &[says]);
    }
}

#[test]
fn a_trace_that_cannot_be_written_is_told_and_the_job_goes_on() {
    let folder = Folder::new();
    let send = |trace: &str| folder.cnc(&["send", "sim:", "part.nc", "--trace", trace]);
    check(&send("none/t.jsonl"), 2, &["none/t.jsonl cannot be written: there is no folder none"]);
    check(&send("/dev/full"), 2, &["trace /dev/full", "No space left"]);
    // Files may have two blocks, and to exceed that is an error like a full disk.
    let limited = format!(
        "trap '' XFSZ; ulimit -f 2; exec {} send sim: part.nc --trace t.jsonl",
        env!("CARGO_BIN_EXE_cnc")
    );
    let output = Process::new("sh").args(["-c", &limited]).current_dir(&folder.0).output().unwrap();
    check(&output, 0, &["trace t.jsonl ends here: ", "the job goes on without it", "done: "]);
}

/// `sim:seed=N` draws the same faults at the same places, and the host does the same about them.
#[test]
fn a_seed_repeats_a_run() {
    let folder = Folder::new();
    let mut ends = std::collections::BTreeSet::new();
    for seed in 0..12 {
        let port = format!("sim:seed={seed},faults=2");
        let run = |trace: &str| {
            let output = folder.cnc(&["send", &port, "part.nc", "--json", "--trace", trace]);
            let text = fs::read_to_string(folder.path(trace)).unwrap();
            // The first line has the time of day.
            let lines = text.split_once('\n').unwrap().1.to_owned();
            (output.status.code(), output.stdout, output.stderr, lines)
        };
        let (first, second) = (run("a.jsonl"), run("b.jsonl"));
        assert!(first == second, "seed {seed}");
        ends.insert(first.0);
    }
    assert_eq!(ends, [Some(0), Some(3)].into());
}

/// What `jog` and `home` sent is replayed too.
#[test]
fn jogs_and_homing_are_traced() {
    let folder = Folder::new();
    let jog = ["jog", "sim:", "X", "--by", "2", "--trace", "t.jsonl"];
    check(&folder.cnc(&jog), 0, &["done"]);
    check(&folder.cnc(&["replay", "t.jsonl"]), 0, &["X (122)         77.000", "same\n"]);
    let home = ["home", "sim:", "X", "--measured-tick", "40000", "--start", "20,0,0", "--trace"];
    check(&folder.cnc(&[&home[..], &["t.jsonl"]].concat()), 0, &["which agrees"]);
    check(&folder.cnc(&["replay", "t.jsonl"]), 0, &["X (122)          0.000", "same\n"]);
    check(&folder.cnc(&["replay", "t.jsonl", "part.nc"]), 1, &["trace of another job"]);
}
