//! Ports that two want, that vanish, and programs that are told to end: what `cnc send` says, and the
//! code it ends with.

use std::io::{BufRead, BufReader, Read};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Child, Command as Process, Output, Stdio};
use std::thread::JoinHandle;
use std::time::Duration;

use rustix::process::{Pid, Signal, kill_process};

use pty::Node;

mod pty;

fn cnc() -> Process {
    let mut process = Process::new(env!("CARGO_BIN_EXE_cnc"));
    let variables = ["CNC_MACHINE", "CNC_BAUD", "CNC_REPLY_TIMEOUT", "XDG_CONFIG_HOME", "HOME"];
    for name in variables {
        process.env_remove(name);
    }
    process.stdin(Stdio::null());
    process
}

/// A folder with a program of some two seconds, and what a test adds.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Folder {
        let folder = Folder(tempfile::tempdir().unwrap());
        std::fs::write(folder.path("job.nc"), "G1 Y4 F600\nX2\nY0\nX0\nM30\n").unwrap();
        folder
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// `cnc send` in this folder.
    fn send(&self, port: &Path, args: &[&str]) -> Process {
        let mut process = cnc();
        process.current_dir(self.0.path()).env("XDG_STATE_HOME", self.0.path());
        process.arg("send").arg(port).arg("job.nc").args(args);
        process.stdout(Stdio::piped()).stderr(Stdio::piped());
        process
    }
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

fn check_ends(output: &Output, code: i32, reason: &str) {
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{said}");
    assert!(said.contains(reason), "expected '{reason}': {said}");
    assert!(!said.contains("panicked"), "{said}");
}

/// Starts a job and waits until it has said something; gives what else it says once it has ended.
fn under_way(
    folder: &Folder,
    node: &Node,
    args: &[&str],
    until: &str,
) -> (Child, JoinHandle<String>) {
    let mut host = folder.send(&node.pty, args).arg("-v").spawn().unwrap();
    let mut said = BufReader::new(host.stderr.take().unwrap());
    let mut line = String::new();
    while !line.contains(until) {
        line.clear();
        assert!(said.read_line(&mut line).unwrap() > 0, "it has ended");
    }
    let rest = std::thread::spawn(move || {
        let mut rest = String::new();
        said.read_to_string(&mut rest).unwrap();
        rest
    });
    (host, rest)
}

#[test]
fn two_programs_cannot_use_one_port_by_any_name() {
    let folder = Folder::new();
    let node = Node::start(&[]);
    let (mut first, _) = under_way(&folder, &node, &[], "is filled");
    let link = folder.path("by-id");
    symlink(&node.pty, &link).unwrap();
    let by_first = format!("in use by cnc (pid {})", first.id());
    for name in [&node.pty, &link] {
        let second = folder.send(name, &[]).output().unwrap();
        check_ends(&second, 3, &by_first);
    }
    assert_eq!(first.wait().unwrap().code(), Some(0), "the first goes on undisturbed");
}

#[test]
fn a_port_that_another_program_has_open_without_a_lock_is_left_alone() {
    let folder = Folder::new();
    let node = Node::start(&[]);
    let far_end = std::fs::File::options().read(true).write(true).open(&node.pty).unwrap();
    let mut other = Process::new("sleep").arg("60").stdin(far_end).spawn().unwrap();
    let output = folder.send(&node.pty, &[]).output().unwrap();
    check_ends(&output, 3, &format!("in use by sleep (pid {})", other.id()));
    other.kill().unwrap();
    other.wait().unwrap();
}

#[test]
fn a_port_that_vanishes_is_named() {
    let folder = Folder::new();
    let link = folder.path("by-id");
    symlink("/dev/ttyUSB99", &link).unwrap();
    check_ends(&folder.send(&link, &[]).output().unwrap(), 3, "there is no port");
    let name = Path::new("usb:0403:6999");
    check_ends(&folder.send(name, &[]).output().unwrap(), 3, "no port is usb:0403:6999");
    let name = Path::new("usb:0403");
    check_ends(&folder.send(name, &[]).output().unwrap(), 2, "expected usb:VID:PID");
}

/// As when an adapter is pulled out: while a node is filled, and while axes move.
#[test]
fn a_port_taken_away_says_what_is_known() {
    let folder = Folder::new();
    for (fault, state) in
        [("close@data.700", "known-until-power-off"), ("close@tick.20", "unknown")]
    {
        let node = Node::start(&["--fault", fault, "--speed", "20"]);
        let output = folder.send(&node.pty, &["--speed", "20", "--json"]).output().unwrap();
        check_ends(&output, 3, "the port is gone");
        check_ends(&output, 3, "switch all nodes off and on");
        let result: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(
            (&result["result"], &result["axes"]["Y"]["state"]),
            (&"failed".into(), &state.into())
        );
    }
}

#[test]
fn a_job_that_is_told_to_end_says_where_it_stands() {
    let folder = Folder::new();
    let signals =
        [(Signal::INT, "stopping where"), (Signal::TERM, "SIGTERM"), (Signal::HUP, "SIGHUP")];
    for (signal, reason) in signals {
        let node = Node::start(&["--speed", "2"]);
        let (host, rest) = under_way(&folder, &node, &["--speed", "2", "--json"], "started");
        kill_process(Pid::from_child(&host), signal).unwrap();
        let Output { status, stdout, .. } = host.wait_with_output().unwrap();
        let stderr = rest.join().unwrap().into_bytes();
        check_ends(&Output { status, stdout: vec![], stderr }, 130, reason);
        let result: serde_json::Value = serde_json::from_slice(&stdout).unwrap();
        assert_eq!(result["result"], "interrupted");
        assert_ne!(result["axes"]["Y"]["state"], "unknown");
    }
}

/// As under `nohup`.
#[test]
fn a_hang_up_that_is_ignored_does_not_end_a_job() {
    let folder = Folder::new();
    let node = Node::start(&["--speed", "4"]);
    let script = format!(
        "trap '' HUP; exec {} send {} job.nc --speed 4",
        env!("CARGO_BIN_EXE_cnc"),
        node.pty.display()
    );
    let mut shell = Process::new("sh");
    shell.args(["-c", &script]).current_dir(folder.0.path());
    shell.env("XDG_STATE_HOME", folder.0.path());
    let host = shell.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    std::thread::sleep(Duration::from_millis(400));
    kill_process(Pid::from_child(&host), Signal::HUP).unwrap();
    check_ends(&host.wait_with_output().unwrap(), 0, "");
}

/// The reader of its results goes away, and the terminal: the job goes on to its end.
#[test]
fn nobody_who_reads_is_no_failure() {
    let folder = Folder::new();
    let node = Node::start(&["--speed", "max"]);
    let mut host = folder.send(&node.pty, &["--speed", "max", "-v"]).spawn().unwrap();
    drop((host.stdout.take(), host.stderr.take()));
    assert_eq!(host.wait().unwrap().code(), Some(0));
}

#[test]
fn ports_have_names_in_the_configuration() {
    let folder = Folder::new();
    let node = Node::start(&["--speed", "max"]);
    let mill = format!("[ports.mill]\ndevice = {:?}\nwrite_piece_bytes = 7\n", node.pty);
    std::fs::create_dir_all(folder.path("own/cnc")).unwrap();
    std::fs::write(folder.path("own/cnc/cnc.toml"), mill).unwrap();
    let send = |file: &str, args: &[&str]| {
        std::fs::write(folder.path("cnc.toml"), file).unwrap();
        let mut process = folder.send(Path::new("mill"), args);
        process.env("XDG_CONFIG_HOME", folder.path("own")).output().unwrap()
    };
    check_ends(&send("", &["--speed", "max"]), 0, "");
    // The folder's file goes before the user's, and an option before both.
    let wrong = "[ports.mill]\nbaud = 50000\ndevice = \"/dev/null\"\n";
    check_ends(&send(wrong, &[]), 3, "/dev/null is no serial port");
    check_ends(&send("[ports.mill]\nbuad = 1\n", &[]), 2, "did you mean 'baud'?");
    let seconds = |file: &str, args: &[&str]| {
        let output = send(file, &[args, &["--dry-run", "--json"]].concat());
        serde_json::from_slice::<serde_json::Value>(&output.stdout).unwrap()["seconds"].as_f64()
    };
    let slow = "[ports.mill]\nbaud = 9600\n";
    assert!(seconds(slow, &[]) > seconds("", &[]));
    assert_eq!(seconds(slow, &["--baud", "38400"]), seconds("", &[]));
}
