//! A bus with all the nodes that it can carry: axes beyond X Y Z from the program to the replay.

use std::fs;
use std::path::PathBuf;
use std::process::{Command as Process, Output, Stdio};

use tempfile::TempDir;

const PROFILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/machines/full-bus.toml");

/// Every axis, alone and with others; several buffers.
const PROGRAM: &str = "G21 G90 F900\nG1 X5 A20\nB-15 C30 Y4\nX0 A0\nB0 C0 Y0\nG4 P0.2\nU5 V5 W-5\n\
    A-30 F600\nA0\nX20 F200\nX0\nX20\nX0 U0\nA5 B5 V0 W0\nA0 B0\nM30\n";

struct Bench(TempDir);

impl Bench {
    fn new(program: &str) -> Bench {
        let bench = Bench(TempDir::new().unwrap());
        fs::write(bench.path("part.nc"), program).unwrap();
        bench
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    #[track_caller]
    fn cnc(&self, args: &[&str], code: i32, says: &str) -> Output {
        let mut process = Process::new(env!("CARGO_BIN_EXE_cnc"));
        process.args(args).args(["-m", PROFILE]).current_dir(&self.0).stdin(Stdio::null());
        let output = process.output().unwrap();
        let said = [&output.stderr[..], &output.stdout].concat();
        let said = String::from_utf8_lossy(&said);
        assert_eq!(output.status.code(), Some(code), "{args:?}: {said}");
        assert!(said.contains(says), "{args:?}: expected '{says}': {said}");
        output
    }
}

#[test]
fn fifteen_nodes_are_proved_and_run() {
    let bench = Bench::new(PROGRAM);
    bench.cnc(&["send", "sim:", "part.nc", "--dry-run"], 0, "15 nodes on the bus");
    bench.cnc(&["send", "sim:", "part.nc"], 0, "and that is the program's path");
    let cut = ["send", "sim:faults=close@tick.2500", "part.nc", "--journal", "journal"];
    bench.cnc(&cut, 3, "the port is gone");
    let stands = ["--at", "1,2,3,4,5,6,7,8,9", "--resume", "journal"];
    let on = ["--yes", "--trace", "trace"];
    let resume = [&["send", "sim:", "part.nc"], &stands[..], &on].concat();
    bench.cnc(&resume, 0, "A to 0.000, B to 0.000, C to 0.000, U to 5.000");
    bench.cnc(&["replay", "trace", "part.nc"], 0, "same");
}

#[test]
fn any_axis_is_jogged_and_homed() {
    let bench = Bench::new("");
    bench.cnc(&["jog", "sim:", "C", "--by", "-12.5", "--from", "20"], 0, "C at 7.500 °");
    bench.cnc(
        &["home", "sim:", "A", "--measured-tick", "100000", "--start", "0,0,0,30"],
        0,
        "which agrees",
    );
}

/// X, Y and Z have a limit on jerk here, and the others have none.
#[test]
fn a_program_of_rotary_axes_alone_is_planned_and_verified() {
    for program in
        ["G1 A-30 F600\nM30\n", "G1 A5 F900\nA5.01\nA0\nM5\nM30\n", "G0 B7 C-3\nG1 X3 F300\nM30\n"]
    {
        let bench = Bench::new(program);
        bench.cnc(&["interpolate", "part.nc", "--csv", "-o", "part.csv"], 0, "");
        bench.cnc(&["verify", "part.nc", "part.csv"], 0, "pass");
    }
}
