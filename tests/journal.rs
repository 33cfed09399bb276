//! `cnc send` as it is stopped, killed and started again: what it says, and what its journal then
//! lets it do. Signals are real, nodes are virtual and run many times faster.

use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command as Process, Output, Stdio};
use std::time::Duration;

use cnc::wire_io::Pty;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

/// There and back, at rest at each end: one buffer, and another behind a pause.
const PROGRAM: &str = "G21 G90 F900\nM3 S800\nG1 X20\nX0\nY10 X5\nX0 Y0\nG4 P0.3\nX10\nX0\nM30\n";

fn cnc() -> Process {
    let mut process = Process::new(env!("CARGO_BIN_EXE_cnc"));
    process.env_remove("CNC_MACHINE").stdin(Stdio::null());
    process.env("XDG_STATE_HOME", env!("CARGO_TARGET_TMPDIR"));
    process
}

/// A folder with a program and a journal.
struct Bench(tempfile::TempDir);

impl Bench {
    fn new() -> Bench {
        let bench = Bench(tempfile::tempdir().unwrap());
        fs::write(bench.program(), PROGRAM).unwrap();
        bench
    }

    fn program(&self) -> PathBuf {
        self.0.path().join("part.nc")
    }

    fn journal(&self) -> PathBuf {
        self.0.path().join("journal.jsonl")
    }

    fn executed(&self) -> PathBuf {
        self.0.path().join("executed.csv")
    }

    /// A job to nodes, eight times as fast as real ones.
    fn send(&self, port: &Path, args: &[&str]) -> Process {
        let mut process = cnc();
        process.arg("send").arg(port).arg(self.program()).args(["--speed", "8", "--journal"]);
        process.arg(self.journal()).args(args).stdout(Stdio::piped()).stderr(Stdio::piped());
        process
    }

    fn nodes(&self) -> Nodes {
        let mut process = cnc();
        process.args(["node", "--once", "--speed", "8", "--executed"]).arg(self.executed());
        let mut child = process.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut name = String::new();
        BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut name).unwrap();
        Nodes { child, pty: PathBuf::from(name.trim_end()) }
    }

    fn records(&self) -> Vec<Value> {
        let text = fs::read_to_string(self.journal()).unwrap_or_default();
        let whole = text.rsplit_once('\n').map_or("", |(whole, _)| whole);
        whole.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    }

    /// Waits until the journal says something.
    fn await_record(&self, what: impl Fn(&Value) -> bool) {
        for _ in 0..2000 {
            if self.records().iter().any(&what) {
                return;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        panic!("it never happened: {:#?}", self.records());
    }

    /// Waits until so many ticks have been acknowledged.
    fn await_tick(&self, ticks: u64) {
        self.await_record(|record| record["tick"].as_u64() == Some(ticks));
    }

    fn last(&self, kind: &str) -> Value {
        self.records().into_iter().rfind(|record| record["type"] == kind).unwrap()
    }
}

struct Nodes {
    child: Child,
    pty: PathBuf,
}

impl Nodes {
    /// Waits until they have seen that the host has gone.
    fn end(mut self) {
        assert!(self.child.wait().unwrap().success());
    }
}

impl Drop for Nodes {
    fn drop(&mut self) {
        // They may have ended by themselves.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn signal(host: &Child, signal: Signal) {
    kill_process(Pid::from_child(host), signal).unwrap();
}

fn said(output: &Output) -> String {
    let said = String::from_utf8(output.stderr.clone()).unwrap();
    assert!(!said.contains("panicked"), "{said}");
    said
}

fn check(output: &Output, code: i32, expected: &str) {
    let said = said(output);
    assert_eq!(output.status.code(), Some(code), "{said}");
    assert!(said.contains(expected), "expected '{expected}': {said}");
}

/// Steps of X, Y and Z that the nodes made, and how many of their sync bytes there were.
fn sums(executed: &Path) -> ([i64; 3], usize) {
    let text = fs::read_to_string(executed).unwrap();
    let mut sums = [0; 3];
    for row in text.lines().skip(1) {
        let counts = row.split(',').skip(2).map(|count| count.parse::<i64>().unwrap());
        sums.iter_mut().zip(counts).for_each(|(sum, count)| *sum += count);
    }
    (sums, text.lines().count() - 1)
}

/// Runs a job on a terminal, stops it at a tick, and types an answer to the question that comes.
fn stopped_on_a_terminal(bench: &Bench, nodes: &Nodes, signals: &[Signal], answer: &str) -> Output {
    let mut terminal = Pty::open(None).unwrap();
    let stdin = fs::File::options().read(true).write(true).open(terminal.name()).unwrap();
    let mut host = bench.send(&nodes.pty, &["--yes", "--json"]).stdin(stdin).spawn().unwrap();
    bench.await_tick(30);
    signals.iter().for_each(|kind| signal(&host, *kind));
    let mut stderr = BufReader::new(host.stderr.take().unwrap());
    let mut said = String::new();
    while !said.contains("[g: go on") && stderr.read_line(&mut said).unwrap() > 0 {}
    terminal.write(answer.as_bytes()).unwrap();
    stderr.read_to_string(&mut said).unwrap();
    let output = host.wait_with_output().unwrap();
    Output { stderr: said.into_bytes(), ..output }
}

#[test]
fn a_held_job_goes_on_as_if_nothing_had_been() {
    let bench = Bench::new();
    let nodes = bench.nodes();
    let output = stopped_on_a_terminal(&bench, &nodes, &[Signal::INT], "what?\ng\n");
    check(&output, 0, "held after tick");
    nodes.end();
    let (steps, _) = sums(&bench.executed());
    assert_eq!(steps, [0; 3], "it ends where it began");
    let result: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(
        (&result["result"], &result["axes"]["X"]["state"]),
        (&"done".into(), &"known".into())
    );
    let kinds: Vec<_> = bench.records().iter().map(|r| r["type"].clone()).collect();
    for kind in ["job", "filling", "started", "held", "resumed", "event", "seam", "end"] {
        assert!(kinds.contains(&kind.into()), "{kind}");
    }
    let ticks: Vec<_> = bench.records().iter().filter_map(|r| r["tick"].as_u64()).collect();
    let all = result["ticks"].as_u64().unwrap();
    assert_eq!(ticks, (1..=all).collect::<Vec<_>>(), "every tick once");
    assert_eq!(bench.last("end")["result"], "done");
}

#[test]
fn a_job_that_ended_in_execution_locks_its_port() {
    let bench = Bench::new();
    let nodes = bench.nodes();
    let output = stopped_on_a_terminal(&bench, &nodes, &[Signal::INT, Signal::INT], "s\n");
    check(&output, 130, "held after tick");
    check(&output, 130, "switch all nodes off and on");
    nodes.end();
    let end = bench.last("end");
    let (steps, syncs) = sums(&bench.executed());
    let x = end["axes"]["X"]["steps"].as_i64().unwrap();
    assert_eq!((x, syncs % 2), (7500 + steps[0], 0), "{end}");
    assert_eq!(end["axes"]["X"]["state"], "known-until-power-off");
    let result: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&result["result"], &result["power_cycle"]), (&"interrupted".into(), &true.into()));
    assert_eq!(result["axes"], end["axes"]);

    let nodes = bench.nodes();
    let again = |args: &[&str]| bench.send(&nodes.pty, args).output().unwrap();
    check(&again(&[]), 3, "say so with --power-cycled");
    check(&again(&["--at", "75,50,50"]), 3, "say so with --power-cycled");
    check(&again(&["--power-cycled", "--dry-run"]), 0, "");
    check(&again(&[]), 3, "say so with --power-cycled");
    check(&again(&["--power-cycled"]), 3, "nobody knows where axis X stands");
    check(&again(&[]), 3, "nobody knows where axis X stands");
    check(&again(&["--at", "75,50,50"]), 0, "known");
}

#[test]
fn a_system_that_ends_the_host_is_not_asked() {
    for kind in [Signal::TERM, Signal::HUP] {
        let bench = Bench::new();
        let nodes = bench.nodes();
        let output = stopped_on_a_terminal(&bench, &nodes, &[kind], "g\n");
        check(&output, 130, "held after tick");
        assert_eq!(bench.last("end")["result"], "interrupted");
    }
}

#[test]
fn a_killed_host_leaves_what_was_acknowledged() {
    let bench = Bench::new();
    let nodes = bench.nodes();
    let mut host = bench.send(&nodes.pty, &[]).spawn().unwrap();
    bench.await_tick(50);
    host.kill().unwrap();
    host.wait().unwrap();
    nodes.end();
    let told = bench.records().iter().filter_map(|record| record["tick"].as_u64()).max().unwrap();
    let (_, syncs) = sums(&bench.executed());
    // One may have been on its way.
    assert!((told..=told + 1).contains(&(syncs as u64)), "{told} {syncs}");
    let nodes = bench.nodes();
    let output = bench.send(&nodes.pty, &[]).output().unwrap();
    check(&output, 3, "its host was killed");
    check(&output, 3, "part.nc");
}

#[test]
fn a_second_job_waits_for_the_first() {
    let bench = Bench::new();
    let nodes = bench.nodes();
    let mut host = bench.send(&nodes.pty, &[]).spawn().unwrap();
    bench.await_tick(20);
    check(&bench.send(&nodes.pty, &[]).output().unwrap(), 3, "in use by cnc (pid");
    host.kill().unwrap();
    host.wait().unwrap();
}

#[test]
fn a_journal_that_fills_the_disk_ends_the_job() {
    let bench = Bench::new();
    let nodes = bench.nodes();
    // Before anything has moved.
    let args = ["send", "sim:", "--journal", "/dev/full"];
    let full = cnc().args(args).arg(bench.program()).output().unwrap();
    check(&full, 2, "/dev/full cannot be written");
    // In the middle: no file of this process grows beyond 4 KiB.
    let send = format!(
        "ulimit -f 4; exec {} send \"$0\" \"$1\" --speed 8 --journal \"$2\"",
        env!("CARGO_BIN_EXE_cnc")
    );
    let mut shell = Process::new("sh");
    shell.env_remove("CNC_MACHINE").args(["-c", &send]).arg(&nodes.pty).arg(bench.program());
    let output = shell.arg(bench.journal()).stdin(Stdio::null()).output().unwrap();
    check(&output, 3, "cannot be written: File too large");
    check(&output, 3, "the last line reached is");
    let nodes = bench.nodes();
    check(&bench.send(&nodes.pty, &[]).output().unwrap(), 3, "--power-cycled");
}

#[test]
fn a_pseudo_terminal_has_a_journal_of_its_own() {
    let bench = Bench::new();
    let state = bench.0.path().join("state");
    let nodes = bench.nodes();
    let send = |args: &[&str]| {
        let mut process = cnc();
        process.arg("send").arg(&nodes.pty).arg(bench.program()).args(["--speed", "8"]);
        process.args(args).env("XDG_STATE_HOME", &state).output().unwrap()
    };
    check(&send(&["--power-cycled"]), 3, "nobody knows");
    let files: Vec<_> = fs::read_dir(state.join("cnc")).unwrap().flatten().collect();
    assert_eq!(files.len(), 1);
    assert!(files[0].file_name().to_str().unwrap().starts_with("pts-"));
    check(&send(&["--at", "75,50,50"]), 0, "known");
}

/// Some buffers, with everything that has to be restored.
const LONG: &str = "G21 G90 F150\nT2 M6\nM3 S900\nM8\nG0 Z5\nG1 Z-1\nX20 Y10\nX-20\nM64 P1\nG0 Z5\nX0 Y0\nM9\nG1 Z-2\nX-20 Y-10\nX20\nG0 Z5\nM30\n";

#[test]
fn a_job_cut_at_any_tick_goes_on_from_its_last_seam() {
    let bench = Bench::new();
    fs::write(bench.program(), LONG).unwrap();
    let (program, journal) = (bench.program(), bench.journal());
    let send = |port: &str, args: &[&str]| {
        let mut process = cnc();
        process.args(["send", port, "--ignore-stops", "--json", "--journal"]).arg(&journal);
        process.arg(&program).args(args).output().unwrap()
    };
    let done = send("sim:", &[]);
    check(&done, 0, "known");
    let whole: Value = serde_json::from_slice(&done.stdout).unwrap();
    let resume = ["--resume", journal.to_str().unwrap()];
    check(&send("sim:", &resume), 1, "a job that is done");
    for (cut, again) in [(3, 40), (1400, 1600), (2000, 900), (3100, 3000)] {
        fs::remove_file(&journal).unwrap();
        check(&send(&format!("sim:faults=dead:X@tick.{cut}"), &[]), 3, "did not answer");
        let seam = bench.records().into_iter().rfind(|record| record["type"] == "seam");
        check(&send("sim:", &resume), 2, "say --yes");
        let at = ["--at", "11,22,33", "--yes"];
        let shown = send("sim:", &[&resume[..], &at, &["--dry-run"]].concat());
        check(&shown, 0, "Z to 100.000, the safe height");
        check(&shown, 0, if seam.is_some() { "M3 S900 (line 3)" } else { "left, from line" });
        // It is cut once more, and then comes to its end, where the whole job did.
        let port = format!("sim:faults=dead:X@tick.{again}");
        let twice = send(&port, &[&resume[..], &at].concat());
        check(&twice, 3, "did not answer");
        let last = send("sim:", &[&resume[..], &["--at", "99,1,60", "--yes"]].concat());
        check(&last, 0, "executed what was planned");
        let result: Value = serde_json::from_slice(&last.stdout).unwrap();
        for axis in ["X", "Y", "Z"] {
            assert_eq!(
                result["axes"][axis]["steps"], whole["axes"][axis]["steps"],
                "{cut} {again}"
            );
        }
    }
}

#[test]
fn only_the_same_job_is_gone_on_with() {
    let bench = Bench::new();
    let (program, journal) = (bench.program(), bench.journal());
    let send = |port: &str, args: &[&str]| {
        let args = [&["send", port, program.to_str().unwrap(), "--yes"], args].concat();
        cnc().args(args).output().unwrap()
    };
    let journal = journal.to_str().unwrap();
    check(&send("sim:", &["--resume", journal]), 2, "cannot be read");
    check(&send("sim:faults=dead:X@tick.9", &["--journal", journal]), 3, "did not answer");
    check(&send("sim:", &["--resume", journal, "--feed", "exact-stop"]), 1, "another plan");
    check(&send("sim:", &["--resume", journal, "--start", "70,50,50"]), 1, "other options");
    fs::write(&program, "G21 G90\nG1 X2 F100\nM30\n").unwrap();
    check(&send("sim:", &["--resume", journal]), 1, "another program");
}
