//! Every sample goes through every protocol: what virtual nodes execute is what was planned, and that is the
//! program's path.

mod bench;

use std::fs;
use std::path::Path;

use bench::Bench;

/// Runs a command on every good sample.
fn check(command: &dyn Fn(&str) -> Vec<String>) {
    let bench = Bench::new("", "starmill");
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/good");
    let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    for file in files.filter(|file| file.extension().is_some_and(|ending| ending == "nc")) {
        let args = command(file.to_str().unwrap());
        let args: Vec<&str> = args.iter().map(String::as_str).collect();
        let output = bench.cnc(&args, 0, "executed what was planned");
        let said = [&output.stderr[..], &output.stdout].concat();
        assert!(String::from_utf8_lossy(&said).contains("that is the program's path"), "{args:?}");
    }
}

fn words(words: &[&str]) -> Vec<String> {
    words.iter().map(ToString::to_string).collect()
}

#[test]
fn samples_go_through_in_buffers() {
    check(&|file| words(&["send", "sim:", file, "--ignore-stops"]));
}

#[test]
fn samples_go_through_in_frames() {
    check(&|file| words(&["send", "sim:", file, "--ignore-stops", "--protocol", "frame"]));
}

/// In cycles of 10 ms, which are as many as ticks.
#[test]
fn samples_go_round_the_ring() {
    check(&|file| words(&["bus", file, "--ring", "--frequency", "100"]));
}
