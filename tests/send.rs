//! `cnc send` and `cnc node` as a user runs them: over a pseudo-terminal, and on bad ports.

use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Command as Process, Output, Stdio};

use cnc::base::{Axis, AxisMap, Command, Event, Machine, Tick};
use cnc::tape::{Encoding, Header, Origin, Writer};
use cnc::wire_io::Pty;

use pty::Node;

mod pty;

fn cnc() -> Process {
    let mut process = Process::new(env!("CARGO_BIN_EXE_cnc"));
    process.env_remove("CNC_MACHINE").stdin(Stdio::null());
    process.env("XDG_STATE_HOME", env!("CARGO_TARGET_TMPDIR"));
    process
}

fn tick(buffer: u32, line: u32, counts: [i32; 3]) -> Command {
    let mut map = AxisMap::default();
    Axis::LINEAR.iter().zip(counts).for_each(|(axis, count)| map[*axis] = count);
    Command::Tick(Tick { buffer, line, counts: map })
}

fn event(line: u32, text: &str) -> Command {
    Command::Event(Event { line, kind: text.parse().unwrap() })
}

/// A movement from rest to rest.
fn movement(buffer: u32, line: u32, peak: [i32; 3], ticks: usize) -> Vec<Command> {
    let ramp =
        |at: usize, peak: i32| peak.signum() * peak.abs().min(1 + at.min(ticks - 1 - at) as i32);
    (0..ticks).map(|at| tick(buffer, line, peak.map(|peak| ramp(at, peak)))).collect()
}

/// Y alone, a plunge, a dwell, a feed below one count a tick, all three axes: several buffers.
fn job() -> Vec<Command> {
    let mut commands = vec![event(1, "M3 S1200")];
    commands.extend(movement(0, 2, [0, 20, 0], 150));
    commands.push(event(3, "G4 P0.2"));
    commands.extend(movement(0, 4, [0, 0, -12], 100));
    commands.extend((0..100).map(|at| tick(1, 5, [i32::from(at % 5 == 0), 0, 0])));
    commands.extend(movement(2, 6, [-4, 7, 15], 200));
    commands.push(event(7, "M30"));
    commands
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Folder(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn dump(&self, commands: &[Command]) -> PathBuf {
        let machine = Machine::load("starmill").unwrap();
        let header = Header {
            tool: "cnc 0.1.0".to_owned(),
            program: Origin { name: "job.nc".to_owned(), sha256: [1; 32] },
            inputs: vec![],
            options: vec![],
            machine: Origin { name: machine.id.clone(), sha256: machine.sha256() },
            tick_us: machine.bus.tick_us,
            steps_per_mm: Axis::LINEAR.map(|axis| (axis, 100.0)).into(),
            start_steps: machine.nearest_steps(&machine.work_zero_mm),
            encoding: Encoding::Counts,
        };
        let path = self.path("job.csv");
        let mut writer = Writer::new(File::create(&path).unwrap(), &header).unwrap();
        commands.iter().for_each(|command| writer.command(command).unwrap());
        writer.finish().unwrap();
        path
    }
}

/// Waits for the end of nodes and gives what they said.
fn end(mut node: Node) -> String {
    assert!(node.child.wait().unwrap().success());
    let mut said = String::new();
    node.child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    said
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

fn send(port: &Path, file: &Path, args: &[&str]) -> Output {
    cnc().arg("send").arg(port).arg(file).args(args).output().unwrap()
}

/// The exit code, and a message that says this.
fn check_refused(output: &Output, code: i32, reason: &str) {
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{said}");
    assert!(said.contains(reason), "expected '{reason}': {said}");
    assert!(!said.contains("panicked"), "{said}");
}

fn planned(commands: &[Command]) -> Vec<[i32; 3]> {
    commands
        .iter()
        .filter_map(|command| match command {
            Command::Tick(tick) => Some(Axis::LINEAR.map(|axis| tick.counts[axis])),
            Command::Event(_) => None,
        })
        .collect()
}

fn executed(file: &Path) -> Vec<[i32; 3]> {
    let text = std::fs::read_to_string(file).unwrap();
    let mut rows = text.lines();
    assert_eq!(rows.next(), Some("tick,buffer,X,Y,Z"));
    let count = |row: &str, column| row.split(',').nth(column).unwrap().parse().unwrap();
    rows.map(|row| [2, 3, 4].map(|column| count(row, column))).collect()
}

/// Buffers are padded with zeros.
fn without_zeros(rows: Vec<[i32; 3]>) -> Vec<[i32; 3]> {
    rows.into_iter().filter(|row| *row != [0; 3]).collect()
}

fn check_over_pty(speed: &str) {
    let folder = Folder::new();
    let file = folder.dump(&job());
    let csv = folder.path("executed.csv");
    let link = folder.path("port");
    let (csv_name, link_name) = (csv.to_str().unwrap(), link.to_str().unwrap());
    let node =
        Node::start(&["--once", "--speed", speed, "--executed", csv_name, "--link", link_name]);
    assert_eq!(std::fs::read_link(&link).unwrap(), node.pty);
    let output = send(&link, &file, &["--speed", speed, "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let result: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&result["schema"], &result["result"]), (&1.into(), &"done".into()));
    assert_eq!(result["axes"]["Y"]["state"], "known");
    assert_eq!(result["axes"]["Y"]["steps"].as_i64(), Some(node_y()));
    let said = end(node);
    assert!(said.contains(" 0 hazards"), "{said}");
    assert!(!link.exists(), "the link is gone with the nodes");
    assert_eq!(without_zeros(executed(&csv)), without_zeros(planned(&job())));
}

fn node_y() -> i64 {
    5000 + planned(&job()).iter().map(|row| i64::from(row[1])).sum::<i64>()
}

#[test]
fn a_job_over_a_pty_is_executed_as_planned() {
    check_over_pty("20");
}

#[test]
fn a_job_over_a_pty_runs_as_fast_as_bytes_come() {
    check_over_pty("max");
}

#[test]
fn a_job_runs_on_simulated_nodes() {
    let folder = Folder::new();
    let file = folder.dump(&job());
    let output = send(Path::new("sim:"), &file, &[]);
    assert_eq!(output.status.code(), Some(0));
    let said = text(&output.stderr);
    assert!(said.contains("executed what was planned, tick by tick"), "{said}");
    for part in ["M3 S1200", "M30", "X 75.000", "Y at "] {
        assert!(said.contains(part), "{part}: {said}");
    }
    assert!(text(&output.stdout).starts_with("done: 550 ticks"));
    let output = send(Path::new("sim:"), &file, &["--dry-run"]);
    let proof = text(&output.stdout);
    assert!(
        proof.starts_with("proof     3 buffers, ") && proof.contains(" pairs looked at"),
        "{proof}"
    );
    assert!(proof.ends_with("safe for the bus; nothing was sent\n"), "{proof}");
}

#[test]
fn a_dump_comes_through_standard_input() {
    let file = Folder::new();
    let path = file.dump(&job());
    let output = cnc().args(["send", "sim:", "-"]).stdin(File::open(path).unwrap()).output();
    assert_eq!(output.unwrap().status.code(), Some(0));
}

#[test]
fn bad_input_is_refused_before_the_port_is_opened() {
    let folder = Folder::new();
    let stops = [movement(0, 1, [3, 0, 0], 20), vec![event(2, "M0")]].concat();
    let stops = folder.dump(&stops);
    // No such port: the job is refused first.
    let port = Path::new("/nonexistent/port");
    check_refused(&send(port, &stops, &[]), 1, "M0 waits for a person");
    check_refused(&send(port, &stops, &["--ignore-stops"]), 3, "no port");
    check_refused(&send(port, Path::new("/nonexistent.csv"), &[]), 2, "nonexistent.csv");
    let fast = folder.dump(&[tick(0, 9, [15, 0, 0])]);
    check_refused(&send(port, &fast, &[]), 1, "line 9, tick 0: motion starts or stops");
    check_refused(&send(port, &fast, &["-m", "router"]), 1, "made for machine starmill");
    let good = folder.dump(&job());
    let scaled = folder.path("scaled.csv");
    let text = std::fs::read_to_string(&good).unwrap();
    std::fs::write(&scaled, text.replace("per_mm: X=100", "per_mm: X=200")).unwrap();
    check_refused(&send(port, &scaled, &[]), 1, "X=200 steps per mm");
    let long = folder.path("long.nc");
    std::fs::write(&long, "G1 F0.01 X10\nM30\n").unwrap();
    check_refused(&send(port, &long, &["-m", "ideal"]), 1, "protocol = \"none\"");
    let cut = folder.path("cut.csv");
    let text = std::fs::read_to_string(&good).unwrap();
    std::fs::write(&cut, &text[..text.len() / 2]).unwrap();
    assert_eq!(send(port, &cut, &[]).status.code(), Some(1));
}

#[test]
fn bad_ports_are_named() {
    let folder = Folder::new();
    let file = folder.dump(&job());
    check_refused(&send(Path::new("/dev/ttyNONE7"), &file, &[]), 3, "there is no port");
    check_refused(&send(&file, &file, &[]), 3, "is no serial port");
    check_refused(&send(Path::new("/dev/null"), &file, &[]), 3, "is no serial port");
    check_refused(&send(Path::new("/dev/null"), &file, &["--speed", "2"]), 2, "real device");
    check_refused(&send(Path::new("/dev"), &file, &[]), 3, "/dev is no serial port");
    // Nobody behind it.
    let pty = Pty::open(None).unwrap();
    let output = send(pty.name(), &file, &[]);
    check_refused(&output, 3, "node 122 of axis X did not answer to a ping");
    // Whoever does not answer may be on its way to the limit switch.
    assert!(text(&output.stderr).contains("X at 75.000 mm (step 7500), unknown"));
    assert!(text(&output.stderr).contains("Y at 50.000 mm (step 5000), known"));
}

#[test]
fn a_node_with_another_id_or_none_is_named() {
    let folder = Folder::new();
    let file = folder.dump(&job());
    let node = Node::start(&["--speed", "max", "--units", "X=122,Y=125,Z=124"]);
    let output = send(&node.pty, &file, &["--speed", "max", "--json"]);
    check_refused(&output, 3, "node 123 of axis Y did not answer");
    let result: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(result["result"], "failed");
}

/// A peer that goes away after some answers.
#[test]
fn a_peer_that_closes_ends_the_job() {
    let folder = Folder::new();
    let file = folder.dump(&job());
    let mut node = Node::start(&[]);
    let mut process = cnc();
    process.args(["send"]).arg(&node.pty).arg(&file).stderr(Stdio::piped()).stdout(Stdio::piped());
    let host = process.spawn().unwrap();
    std::thread::sleep(std::time::Duration::from_millis(300));
    node.child.kill().unwrap();
    let output = host.wait_with_output().unwrap();
    check_refused(&output, 3, "the port is gone");
    // The first node was being filled.
    check_refused(&output, 3, "switch all nodes off and on");
}

#[test]
fn an_interrupt_stops_at_rest_and_says_where() {
    let folder = Folder::new();
    let file = folder.dump(&movement(0, 1, [0, 20, 0], 240));
    let node = Node::start(&["--speed", "4"]);
    let mut process = cnc();
    process.args(["send"]).arg(&node.pty).arg(&file).args(["--speed", "4", "--json"]);
    let host = process.stderr(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    std::thread::sleep(std::time::Duration::from_millis(450));
    let pid = rustix::process::Pid::from_child(&host);
    rustix::process::kill_process(pid, rustix::process::Signal::INT).unwrap();
    let output = host.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", text(&output.stderr));
    let result: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(result["result"], "interrupted");
    assert_ne!(result["axes"]["Y"]["state"], "unknown");
}

/// Five minutes' worth of bytes are still on the wire when the host closes.
#[test]
fn nodes_end_at_an_interrupt_though_bytes_are_on_their_way() {
    let mut node = Node::start(&["--once", "--speed", "0.01"]);
    File::options().write(true).open(&node.pty).unwrap().write_all(&[0xff; 12_000]).unwrap();
    std::thread::sleep(std::time::Duration::from_millis(300));
    assert!(node.child.try_wait().unwrap().is_none());
    let pid = rustix::process::Pid::from_child(&node.child);
    rustix::process::kill_process(pid, rustix::process::Signal::INT).unwrap();
    assert!(end(node).contains("0 ticks executed"));
}

#[test]
fn a_second_host_is_kept_out() {
    let folder = Folder::new();
    let file = folder.dump(&job());
    let pty = Pty::open(None).unwrap();
    let _first = cnc::wire_io::Serial::open(pty.name(), 38400).unwrap();
    check_refused(&send(pty.name(), &file, &[]), 3, "in use by another program");
}

#[test]
fn an_old_link_is_replaced_and_a_file_is_not() {
    let folder = Folder::new();
    let link = folder.path("port");
    std::os::unix::fs::symlink("/nonexistent", &link).unwrap();
    drop(Pty::open(Some(&link)).unwrap());
    File::create(&link).unwrap().write_all(b"mine").unwrap();
    let output = cnc().args(["node", "--link"]).arg(&link).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(std::fs::read(&link).unwrap(), b"mine");
}

#[test]
fn files_that_cannot_be_written_are_named_before_the_nodes_run() {
    let folder = Folder::new();
    let missing = folder.path("none/file");
    for (option, reason) in [("--executed", "file cannot be written"), ("--link", "with the link")]
    {
        let output = cnc().args(["node", option]).arg(&missing).output().unwrap();
        let message = text(&output.stderr);
        assert!(output.status.code() == Some(2) && output.stdout.is_empty(), "{output:?}");
        assert!(message.contains(reason) && message.contains("none/file"), "{message}");
        assert!(!message.contains("none/.tmp"), "{message}");
    }
}
