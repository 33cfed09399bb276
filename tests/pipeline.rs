//! The whole way through the binary, for every good sample: text → dump → verdict.

use std::path::{Path, PathBuf};

use assert_cmd::Command;

/// The machine profile a sample needs: the built-in one unless its first lines name another as
/// `(machine: NAME)`.
fn machine(sample: &Path) -> String {
    let text = String::from_utf8_lossy(&std::fs::read(sample).unwrap()).into_owned();
    let named = text.lines().take(3).find_map(|line| line.split_once("machine: "));
    let name = |rest: &str| rest.chars().take_while(|c| c.is_ascii_alphanumeric()).collect();
    named.map_or("starmill".to_owned(), |(_, rest)| name(rest))
}

fn samples() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/good");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut samples: Vec<_> =
        files.filter(|path| path.extension().is_some_and(|end| end == "nc")).collect();
    samples.sort();
    assert!(samples.len() >= 10, "the samples are missing");
    samples
}

fn cnc(args: &[&str], machine: &str) -> Command {
    let mut command = Command::cargo_bin("cnc").unwrap();
    command.args(args).env("CNC_MACHINE", machine);
    command
}

/// Interpolates a sample with some options, verifies the dump, and gives verify's JSON.
fn check(sample: &Path, options: &[&str]) -> serde_json::Value {
    let folder = tempfile::tempdir().unwrap();
    let dump = folder.path().join("dump.csv");
    let (sample_name, dump_name) = (sample.to_str().unwrap(), dump.to_str().unwrap());
    let machine = machine(sample);
    let mut args = vec!["interpolate", sample_name, "--csv", "-o", dump_name, "-q"];
    args.extend(options);
    cnc(&args, &machine).assert().success();
    let output = cnc(&["verify", sample_name, dump_name, "--json", "-q"], &machine).output();
    let output = output.unwrap();
    let report: serde_json::Value = serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|error| panic!("{sample_name}: {error}: {output:?}"));
    let passed = report["verdict"] == "pass";
    assert_eq!(output.status.code(), Some(i32::from(!passed)), "{sample_name}: {report}");
    report
}

#[test]
fn every_sample_verifies() {
    for sample in samples() {
        let report = check(&sample, &[]);
        assert_eq!(report["verdict"], "pass", "{}: {report}", sample.display());
        let error = report["max_contour_error_mm"].as_f64().unwrap();
        assert!(error <= report["tolerance_mm"].as_f64().unwrap());
        for (axis, steps) in report["end_error_steps"].as_object().unwrap() {
            assert_eq!(steps, 0, "{}: {axis}", sample.display());
        }
    }
}

#[test]
fn every_sample_keeps_its_path_at_constant_feed() {
    for sample in samples() {
        let report = check(&sample, &["--feed", "constant"]);
        assert_eq!(report["verdict"], "pass", "{}: {report}", sample.display());
    }
}

#[test]
fn bytes_say_the_same_as_counts() {
    let sample = samples().into_iter().find(|path| path.ends_with("kimm-test.nc")).unwrap();
    let (counts, bytes) = (check(&sample, &[]), check(&sample, &["--encoding", "bytes"]));
    assert_eq!(counts, bytes);
}

#[test]
fn a_start_between_two_steps_is_kept_exactly() {
    let sample = samples().into_iter().find(|path| path.ends_with("kimm-test.nc")).unwrap();
    let report = check(&sample, &["--start", "75.004,60.0049,50"]);
    assert_eq!(report["verdict"], "pass", "{report}");
}

#[test]
fn the_thesis_encoder_is_out_of_tolerance() {
    let sample = samples().into_iter().find(|path| path.ends_with("o001.nc")).unwrap();
    let report = check(&sample, &["--encoder", "thesis"]);
    assert_eq!(report["verdict"], "fail");
    // Rapids at each axis's own speed: Y is done long before X.
    assert!(report["max_contour_error_mm"].as_f64().unwrap() > 1.0, "{report}");
}
