//! What commands leave behind when files cannot be written, nobody reads, or the operator stops.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Child, Command as Process, Output, Stdio};
use std::time::{Duration, Instant};

use tempfile::TempDir;

fn cnc() -> Process {
    let mut process = Process::new(env!("CARGO_BIN_EXE_cnc"));
    process.env_remove("CNC_MACHINE").current_dir(env!("CARGO_MANIFEST_DIR")).stdin(Stdio::null());
    process
}

const PROGRAM: &str = "samples/good/kimm-test.nc";

fn dump_to(out: &Path) -> Process {
    let mut process = cnc();
    process.args(["interpolate", PROGRAM, "--csv", "-o"]).arg(out);
    process
}

fn check(output: &Output, code: i32, message: &str) {
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{said}");
    assert!(said.contains(message), "'{message}' is not in: {said}");
}

fn names(folder: &TempDir) -> Vec<PathBuf> {
    fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect()
}

/// A program whose dump takes minutes, and is being written.
fn endless(folder: &TempDir, program: &Path) -> Child {
    fs::write(program, "G1 F0.01 X10\nM30\n").unwrap();
    let out = folder.path().join("out.csv");
    let mut process = cnc();
    process.args(["interpolate", "--csv", "-m", "ideal", "-o"]).arg(out).arg(program);
    let child = process.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let give_up = Instant::now() + Duration::from_secs(60);
    while !names(folder).iter().any(|part| fs::metadata(part).is_ok_and(|part| part.len() > 0)) {
        assert!(Instant::now() < give_up, "nothing is written");
        std::thread::sleep(Duration::from_millis(5));
    }
    child
}

#[test]
fn a_stopped_dump_leaves_nothing_behind() {
    for signal in [rustix::process::Signal::INT, rustix::process::Signal::TERM] {
        let (folder, other) = (TempDir::new().unwrap(), TempDir::new().unwrap());
        let child = endless(&folder, &other.path().join("long.nc"));
        let id = rustix::process::Pid::from_child(&child);
        rustix::process::kill_process(id, signal).unwrap();
        let output = child.wait_with_output().unwrap();
        check(&output, 130, "out.csv is not written");
        assert_eq!(names(&folder), Vec::<PathBuf>::new());
    }
}

#[test]
fn a_link_is_written_through() {
    let folder = TempDir::new().unwrap();
    let [link, file] = ["link.csv", "file.csv"].map(|name| folder.path().join(name));
    symlink("file.csv", &link).unwrap();
    for _ in ["when the file is not there", "when it is"] {
        check(&dump_to(&link).output().unwrap(), 0, "");
        assert!(link.is_symlink());
        assert!(fs::read_to_string(&file).unwrap().starts_with("# cnc-dump: 1"));
    }
}

#[test]
fn what_cannot_be_written_is_named() {
    let folder = TempDir::new().unwrap();
    let missing = folder.path().join("missing/out.csv");
    check(&dump_to(&missing).output().unwrap(), 2, "there is no folder");
    check(&dump_to(folder.path()).output().unwrap(), 2, "cannot be written");
    check(&dump_to(Path::new("/dev/full")).output().unwrap(), 2, "/dev/full");
    assert_eq!(names(&folder), Vec::<PathBuf>::new());
}

#[test]
fn nodes_whose_record_cannot_be_written_do_not_start() {
    let output = cnc().args(["node", "--once", "--executed", "/no/such/file.csv"]).output();
    let output = output.unwrap();
    check(&output, 2, "there is no folder /no/such");
    assert!(output.stdout.is_empty());
}

#[test]
fn a_dump_is_no_program() {
    let folder = TempDir::new().unwrap();
    let dump = folder.path().join("dump.csv");
    check(&dump_to(&dump).output().unwrap(), 0, "");
    let dump = dump.to_str().unwrap();
    for args in [vec!["interpret", dump], vec!["interpolate", dump], vec!["verify", dump, dump]] {
        check(&cnc().args(args).output().unwrap(), 1, "is a command dump, not an NC program");
    }
}

/// Standard output whose reader is gone.
fn unread() -> Stdio {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    writer.into()
}

#[test]
fn a_verdict_stands_though_nobody_reads_it() {
    let folder = TempDir::new().unwrap();
    let dump = folder.path().join("dump.csv");
    let mut thesis = dump_to(&dump);
    check(&thesis.args(["--encoder", "thesis"]).output().unwrap(), 0, "");
    let dump = dump.to_str().unwrap();
    let bad = "samples/bad/no-feed.nc";
    for (args, code) in [
        (vec!["verify", PROGRAM, dump], 1),
        (vec!["verify", "--json", PROGRAM, dump], 1),
        (vec!["interpret", "--json", bad], 1),
        (vec!["interpret", "--json", PROGRAM], 0),
        (vec!["machine", "check", bad, "--json"], 2),
        (vec!["send", "sim:", PROGRAM], 0),
    ] {
        let output = cnc().args(&args).stdout(unread()).output().unwrap();
        assert_eq!(output.status.code(), Some(code), "{args:?}");
    }
}
