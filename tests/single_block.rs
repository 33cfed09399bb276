//! `send --single-block`: a block is shown, asked for, and run from rest to rest.

mod bench;

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};

use bench::Bench;
use cnc::wire_io::Pty;

const PROGRAM: &str = "G21 G90 F600\nM3 S1000\nG1 X5 Y3\nX9\nX0 Y0\nM30\n";

/// Sends on a terminal, where somebody answers one question after another; gives the blocks that were
/// shown, the exit code and the result.
fn send(bench: &Bench, args: &[&str], answers: &[&str]) -> (Vec<String>, Option<i32>, String) {
    let mut terminal = Pty::open(None).unwrap();
    let far = File::options().read(true).write(true).open(terminal.name()).unwrap();
    let mut process = Command::new(env!("CARGO_BIN_EXE_cnc"));
    process.current_dir(bench.path("")).env("CNC_MACHINE", "starmill").stdin(far);
    process.args(["send", "sim:", "part.nc", "--single-block"]).args(args);
    let mut child = process.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let (mut shown, mut answers) = (Vec::new(), answers.iter());
    for line in BufReader::new(child.stderr.take().unwrap()).lines() {
        let line = line.unwrap();
        if let Some(block) = line.strip_prefix("next      ") {
            shown.push(block.to_owned());
        } else if line.contains("[Enter: ") {
            terminal.write(answers.next().unwrap().as_bytes()).unwrap();
        }
    }
    let code = child.wait().unwrap().code();
    let mut result = String::new();
    child.stdout.unwrap().read_to_string(&mut result).unwrap();
    (shown, code, result)
}

#[test]
fn each_block_is_asked_for() {
    let bench = Bench::new(PROGRAM, "starmill");
    let blocks =
        ["line 2: M3 S1000", "line 3: G1 X5 Y3", "line 4: X9", "line 5: X0 Y0", "line 6: M30"];
    for more in [&[][..], &["--protocol", "frame"]] {
        let all = send(&bench, more, &["\n"; 6]);
        assert_eq!((&all.0[..], all.1), (&blocks.map(str::to_owned)[..], Some(0)), "{}", all.2);
        let stopped = send(&bench, more, &["\n", "\n", "\n", "s\n"]);
        assert_eq!((stopped.0.len(), stopped.1), (3, Some(130)));
        assert!(stopped.2.starts_with("interrupted: 65 ticks"), "{}", stopped.2);
        let run = send(&bench, &[more, &["--trace", "trace", "-q"]].concat(), &["\n", "\n", "a\n"]);
        assert_eq!((run.0.len(), run.1), (2, Some(0)));
        bench.cnc(&[&["replay", "trace", "part.nc", "--single-block"], more].concat(), 0, "same");
    }
}

#[test]
fn nobody_to_ask_is_no_single_block() {
    let bench = Bench::new(PROGRAM, "starmill");
    let nobody = "--single-block asks before each block, and there is nobody to ask";
    bench.cnc(&["send", "sim:", "part.nc", "--single-block"], 1, nobody);
    bench.cnc(&["send", "sim:", "part.nc", "--single-block", "--no-input"], 1, nobody);
    let feed = ["send", "sim:", "part.nc", "--single-block", "--feed", "constant"];
    bench.cnc(&feed, 2, "cannot be used with");
    // A dump has what was planned, and runs through where blocks meet.
    let bench = Bench::new("G21 G90 F600\nG1 X5\nX9\nM30\n", "starmill");
    bench.cnc(&["interpolate", "part.nc", "--csv", "-o", "part.csv"], 0, "");
    let dump = ["send", "sim:", "part.csv", "--single-block", "--dry-run"];
    bench.cnc(&dump, 1, "motion starts or stops here");
    bench.cnc(&["interpolate", "part.nc", "--csv", "-o", "x.csv", "--feed", "exact-stop"], 0, "");
    bench.cnc(&["send", "sim:", "x.csv", "--single-block", "--dry-run"], 0, "safe for the bus");
}
