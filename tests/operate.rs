//! `cnc send -e`, `cnc jog` and `cnc home` as a user runs them: on simulated nodes and over a
//! pseudo-terminal.

use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command as Process, Output, Stdio};

use serde_json::Value;

fn cnc() -> Process {
    let mut process = Process::new(env!("CARGO_BIN_EXE_cnc"));
    process.env_remove("CNC_MACHINE").stdin(Stdio::null());
    process.env("XDG_STATE_HOME", env!("CARGO_TARGET_TMPDIR"));
    process
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

fn run(args: &[&str]) -> Output {
    cnc().args(args).output().unwrap()
}

/// The exit code, and something that is said.
fn check(args: &[&str], code: i32, says: &str) -> Output {
    let output = run(args);
    let said = [text(&output.stderr), text(&output.stdout)].concat();
    assert_eq!(output.status.code(), Some(code), "{args:?}: {said}");
    assert!(said.contains(says), "{args:?}: expected '{says}': {said}");
    assert!(!said.contains("panicked"), "{said}");
    output
}

fn json(args: &[&str]) -> Value {
    let output = check(args, 0, "");
    serde_json::from_slice(&output.stdout).unwrap()
}

/// `cnc node` at full speed, ended when dropped.
struct Node {
    child: Child,
    pty: String,
}

impl Node {
    /// Ends with its first host.
    fn start(args: &[&str]) -> Node {
        Node::spawn(&[&["--once"], args].concat())
    }

    fn spawn(args: &[&str]) -> Node {
        let mut process = cnc();
        process.args(["node", "--json"]).args(args);
        let mut child = process.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut line).unwrap();
        let named: Value = serde_json::from_str(&line).unwrap();
        Node { child, pty: named["pty"].as_str().unwrap().to_owned() }
    }

    /// Waits for its end; its last word.
    fn end(mut self) -> Value {
        let mut said = String::new();
        self.child.stdout.take().unwrap().read_to_string(&mut said).unwrap();
        assert!(self.child.wait().unwrap().success());
        serde_json::from_str(&said).unwrap()
    }
}

impl Drop for Node {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn typed_blocks_are_a_program_without_an_end() {
    let done = check(&["send", "sim:", "-e", "G0 X10", "-e", "G91 Y-2"], 0, "X at 85.000 mm");
    assert!(text(&done.stderr).contains("Y at 48.000 mm (step 4800), known"));
    assert!(!text(&done.stderr).contains("warning"), "{}", text(&done.stderr));
    let from = ["send", "sim:", "-e", "G0 X1", "--start", "10,20,30"];
    check(&from, 0, "X 10.000 to 76.000 mm");
    check(&["send", "sim:", "-e", "G1 X1"], 1, "<typed>:1:1");
    check(&["send", "sim:", "-e", "G0 X100"], 1, "outside its travel");
    check(&["send", "sim:", "-e", "M0", "--no-input"], 1, "waits for a person");
    check(&["send", "sim:", "-e", "G0 X1", "samples/good/o001.nc"], 2, "cannot be used with");
    check(&["send", "sim:"], 2, "required");
}

#[test]
fn a_jog_is_planned_and_held_to_the_travel() {
    let result = json(&["jog", "sim:", "y", "--by", "-10.5", "--feed", "600", "--json"]);
    assert_eq!(result["axes"]["Y"]["steps"], 3950);
    assert_eq!(result["axes"]["Y"]["state"], "known");
    assert_eq!(result["axes"].as_object().unwrap().len(), 1);
    assert_eq!(result["executed_as_planned"], true);
    let far = json(&["jog", "sim:", "X", "--by", "149", "--from", "1", "--json"]);
    assert_eq!(far["axes"]["X"]["steps"], 15_000);
    check(&["jog", "sim:", "X", "--by", "75.01"], 1, "X would go from 75 to 150.01");
    check(&["jog", "sim:", "X", "--by", "1", "--from", "150"], 1, "its travel is 0 to 150");
    check(&["jog", "sim:", "A", "--by", "1"], 1, "no axis A");
    check(&["jog", "sim:", "X", "--by", "0"], 1, "half a step");
    check(&["jog", "sim:", "XY", "--by", "1"], 2, "one axis");
    check(&["jog", "sim:", "X", "--by", "1", "--feed", "0"], 2, "above zero");
    check(&["jog", "sim:", "X"], 2, "--by");
    check(&["-m", "router", "jog", "sim:", "X", "--by", "1"], 1, "protocol = \"none\"");
    check(&["jog", "/dev/ttyNONE7", "X", "--by", "1"], 3, "there is no port");
    check(&["jog", "sim:", "X", "--by", "1", "--dry-run"], 0, "nothing was sent");
}

#[test]
fn a_raw_jog_is_slow_and_ends_with_the_input() {
    let raw = |feed| ["jog", "sim:", "X", "--raw", "--by", "1", "--feed", feed];
    check(&raw("61"), 1, "starts and stops at 60 mm/min at most");
    check(&raw("30"), 1, "whole number of steps");
    // Standard input has ended before the axis moves.
    check(&raw("60"), 130, "X is at no known position");
}

#[test]
fn homing_is_refused_where_it_is_faster_than_the_axis() {
    check(&["home", "sim:"], 1, "--measured-tick 40000, or more");
    check(&["home", "sim:", "--measured-tick", "39999"], 1, "20.0 mm/s");
    check(&["home", "sim:", "q"], 2, "'q' is no axis");
    check(&["home", "sim:", "A", "--measured-tick", "40000"], 1, "no axis A");
    let args = ["home", "sim:", "xz", "--measured-tick", "40000", "--start", "60,50,50", "--json"];
    let result = json(&args);
    assert_eq!(result["axes"].as_object().unwrap().len(), 2);
    for axis in ["X", "Z"] {
        let state = &result["axes"][axis];
        assert_eq!((&state["state"], &state["steps"]), (&"known".into(), &0.into()));
        assert_eq!(state["homed"]["audit"], "agrees");
    }
    let dead = ["home", "sim:faults=lose-answer@4", "--measured-tick", "40000"];
    check(&dead, 3, "may still be running towards minus");
}

#[test]
fn axes_are_jogged_and_homed_over_a_pty() {
    let node = Node::start(&["--speed", "max"]);
    check(&["jog", &node.pty, "Y", "--by", "-3.21", "--speed", "max"], 0, "done");
    let ended = node.end();
    assert_eq!((&ended["hazards"], &ended["axes"]["Y"]["steps"]), (&0.into(), &4679.into()));
    let node = Node::start(&["--speed", "max"]);
    let homed = ["home", &node.pty, "--measured-tick", "40000", "--speed", "max", "--json"];
    assert_eq!(json(&homed)["axes"]["X"]["state"], "known");
    let ended = node.end();
    assert_eq!(ended["hazards"], 0);
    for axis in ["X", "Y", "Z"] {
        let steps = ended["axes"][axis]["steps"].as_i64().unwrap();
        assert!((-79..=0).contains(&steps), "{axis} {steps}");
    }
}

/// A profile whose nodes take 40 ms a tick: they may home as they are.
fn slow_machine(folder: &Path) -> String {
    let toml = text(&run(&["machine", "show", "starmill", "--toml"]).stdout).to_owned();
    let toml = toml.replace("\ntick_us = 11000", "\ntick_us = 41000");
    let toml = toml.replace("node_tick_us = 10000", "node_tick_us = 40000");
    let path = folder.join("slow.toml");
    std::fs::write(&path, toml).unwrap();
    path.to_str().unwrap().to_owned()
}

/// What was counted is held against the time of homing; what homing has found is where all else begins.
#[test]
fn the_journal_knows_where_axes_stand() {
    let folder = tempfile::tempdir().unwrap();
    let (machine, journal) = (slow_machine(folder.path()), folder.path().join("journal"));
    let node = Node::spawn(&["--speed", "40", "-m", &machine]);
    let run = |args: &[&str], code: i32, says: &str| {
        let more =
            [&node.pty, "--speed", "40", "-m", &machine, "--journal", journal.to_str().unwrap()];
        check(&[&args[..1], &more, &args[1..]].concat(), code, says)
    };
    let result = |output: Output| -> Value { serde_json::from_slice(&output.stdout).unwrap() };
    run(&["jog", "X", "--by", "-65"], 0, "X at 10.000 mm (step 1000), known");
    let homed = result(run(&["home", "--json"], 0, "1000 were counted"));
    // Whether that agrees hangs on how busy this computer is; simulated nodes tell it above.
    assert_eq!(homed["axes"]["X"]["homed"]["counted_steps"], 1000);
    assert_eq!(homed["axes"]["Y"]["homed"]["audit"], "not-counted");
    run(&["jog", "X", "--by", "3"], 0, "stand at X 0.000");
    run(
        &["jog", "X", "--by", "1", "--from", "7"],
        0,
        "by the journal the machine stands at X 3.000",
    );
    // From where the axes stand, and not from the work zero.
    let sent =
        run(&["send", "-e", "G91 G0 X1 Y2", "--json"], 0, "planned from where the axes stand");
    assert_eq!(result(sent)["axes"]["Y"]["position_mm"], 2.0);
    run(
        &["send", "-e", "G91 G0 X1 Y2", "--start", "75,50,50"],
        0,
        "by the journal the machine stands at",
    );
    // Nobody knows any more; one word tells it all.
    run(&["send", "-e", "G0 X1", "--power-cycled"], 3, "nobody knows where axis X stands");
    run(&["jog", "Y", "--by", "1"], 3, "nobody knows where axis Y stands");
    run(&["send", "-e", "G91 G0 X1", "--at", "8,9,10"], 0, "X at 9.000 mm");
    let off = result(run(&["home", "X", "--start", "140,0,0", "--json"], 0, "off by"));
    assert_eq!(off["axes"]["X"]["homed"]["audit"], "off");
    let told = std::fs::read_to_string(&journal).unwrap();
    assert!(told.contains(r#""counted_steps":14000"#), "{told}");
}

/// Real time, ten times as fast: the axis runs until the input ends.
#[test]
fn a_raw_jog_over_a_pty_ends_with_the_input() {
    let node = Node::start(&["--speed", "10"]);
    let mut host = cnc();
    host.args(["jog", &node.pty, "X", "--raw", "--by", "-70", "--speed", "10"]);
    let mut host = host.stdin(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut said = BufReader::new(host.stderr.take().unwrap());
    let mut line = String::new();
    while !line.contains("jogs") {
        line.clear();
        assert!(said.read_line(&mut line).unwrap() > 0);
    }
    drop(host.stdin.take());
    assert_eq!(host.wait().unwrap().code(), Some(0));
    let ended = node.end();
    assert_eq!(ended["hazards"], 0);
    let steps = ended["axes"]["X"]["steps"].as_i64().unwrap();
    assert!((7000..7500).contains(&steps), "{steps}");
}

#[test]
fn the_journal_of_another_machine_says_nothing_of_this_one() {
    let folder = tempfile::tempdir().unwrap();
    let (machine, journal) = (slow_machine(folder.path()), folder.path().join("journal"));
    let node = Node::spawn(&["--speed", "max"]);
    let run = |args: &[&str], code: i32, says: &str| {
        let more = [&node.pty, "--speed", "max", "--journal", journal.to_str().unwrap()];
        check(&[&args[..1], &more, &args[1..]].concat(), code, says)
    };
    run(&["send", "-e", "G0 X1", "--at", "5,6,7"], 0, "planned from where the axes stand");
    // It is neither jogged nor begun from where the other one stands.
    let other = ["-m", &machine];
    let jogged = [&["jog", "Y", "--by", "1"], &other[..]].concat();
    run(&jogged, 0, "tells of the machine starmill");
    run(&["send", "-e", "G0 X2"], 0, "tells of the machine slow");
    run(&[&["jog", "Y", "--by", "1", "--at", "1,2,3"], &other[..]].concat(), 0, "Y at 3.000 mm");
}
