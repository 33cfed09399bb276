//! With `--json` a command that ends without a result says so on standard output, as one document more.

mod bench;

use std::fs::{self, File};
use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};

use bench::Bench;
use cnc::wire_io::Pty;
use serde_json::{Value, json};

const PROGRAM: &str = "G21 G90 F600\nG1 X5 Y3\nX9\nM30\n";

fn parse(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

#[test]
fn every_refusal_is_a_document() {
    let bench = Bench::new(PROGRAM, "starmill");
    fs::write(bench.path("bad.nc"), "G21 G90\nG1 X5\nG999\nM30\n").unwrap();
    fs::write(bench.path("far.nc"), "G21 G90 F100\nG1 X900\nM30\n").unwrap();
    fs::write(bench.path("bad.toml"), "name = 5\n").unwrap();
    bench.cnc(&["interpolate", "part.nc", "--csv", "-o", "part.csv", "-q"], 0, "");
    let cut = "cut bad.nc --tool end-mill-6 --material brass-cuzn39pb3";
    for (line, code, errors, says) in [
        ("interpolate bad.nc", 1, 2, "bad.nc: 2 errors"),
        ("interpolate far.nc --method b", 1, 1, "far.nc: 1 error"),
        ("verify bad.nc", 1, 2, "bad.nc: 2 errors"),
        ("verify bad.nc part.csv --max-errors 1", 1, 1, "bad.nc: 2 errors"),
        ("diff part.csv bad.nc", 1, 2, "bad.nc: 2 errors"),
        ("bus bad.nc", 1, 2, "bad.nc: 2 errors"),
        ("bus bad.nc --ring", 1, 2, "bad.nc: 2 errors"),
        (cut, 1, 2, "bad.nc: 2 errors"),
        ("cut part.nc --tool end-mill-6 --material brass-cuzn39pb3", 1, 0, "line 2: a cut with"),
        ("send sim: bad.nc", 1, 2, "bad.nc: 2 errors"),
        ("send sim: part.csv -m router", 1, 0, "not for router"),
        ("send sim: part.nc -m bad.toml", 2, 5, "machine profile 'bad.toml' cannot be used"),
        ("send nowhere part.nc --yes", 3, 0, "there is no port nowhere"),
        ("home nowhere --measured-tick 40000", 3, 0, "there is no port nowhere"),
        ("home sim: A", 1, 0, "no axis A"),
        ("jog sim: X --by 900", 1, 0, "its travel is 0 to 150"),
        ("jog sim: X --by far", 2, 0, "invalid value 'far' for '--by <MM>'"),
        ("replay nowhere", 2, 0, "nowhere"),
        ("report nowhere", 2, 0, "nowhere"),
        ("interpret nowhere", 2, 0, "nowhere"),
        ("explain nowhere", 2, 0, "nowhere"),
        ("machine show bad.toml", 2, 5, "cannot be used"),
        ("plot part.nc", 2, 0, "a drawing has no JSON"),
        ("interpret", 2, 0, "<FILE|FOLDER>"),
    ] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_cnc"));
        command.current_dir(bench.path("")).env_remove("CNC_MACHINE").stdin(Stdio::null());
        let output = command.args(line.split(' ')).args(["--json", "-q"]).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{line}: {said}");
        let document = parse(&String::from_utf8(output.stdout).unwrap());
        assert_eq!(document["result"], "error", "{line}");
        assert_eq!(document["exit_code"], json!(code), "{line}");
        assert_eq!(document["errors"].as_array().unwrap().len(), errors, "{line}: {document}");
        let error = document["error"].as_str().unwrap();
        assert!(error.contains(says) && !said.is_empty(), "{line}: {error}");
    }
}

#[test]
fn a_start_that_is_not_confirmed_is_one() {
    let bench = Bench::new(PROGRAM, "starmill");
    let mut terminal = Pty::open(None).unwrap();
    let far = File::options().read(true).write(true).open(terminal.name()).unwrap();
    let mut process = Command::new(env!("CARGO_BIN_EXE_cnc"));
    process.current_dir(bench.path("")).env("CNC_MACHINE", "starmill").stdin(far);
    process.args(["send", "sim:", "part.nc", "--json"]);
    let mut child = process.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut last = String::new();
    for line in BufReader::new(child.stderr.take().unwrap()).lines() {
        last = line.unwrap();
        if last.contains("Start the job?") {
            terminal.write(b"no\n").unwrap();
        }
    }
    assert_eq!((last.as_str(), child.wait().unwrap().code()), ("nothing was sent", Some(130)));
    let mut result = String::new();
    child.stdout.unwrap().read_to_string(&mut result).unwrap();
    let document = parse(&result);
    let expected = ["error", "the start was not confirmed: nothing was sent"];
    assert_eq!([&document["result"], &document["error"]], expected);
    assert_eq!(document["exit_code"], 130);
}

/// A job that has run has a result, whatever becomes of its records.
#[test]
fn a_job_that_has_run_tells_its_result() {
    let bench = Bench::new("G21 G90 F600\nM8\nG1 X5 Y3\nM30\n", "starmill");
    let mut process = Command::new(env!("CARGO_BIN_EXE_cnc"));
    process.current_dir(bench.path("")).env("CNC_MACHINE", "starmill").stdin(Stdio::null());
    process.args(["send", "sim:", "part.nc", "--plc", "sim:", "--signals", "/dev/full", "--json"]);
    let output = process.output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("error: /dev/full: No space left on device\n"), "{said}");
    let document = parse(&String::from_utf8(output.stdout).unwrap());
    assert_eq!(document["result"], "done");
}
