//! Programs for which steps were planned, once, that broke a limit, or that verification refused for nothing:
//! all of tests/found are planned and verified on every machine, with its limits on jerk and without.

use std::fs;

use assert_cmd::Command;

const FOUND: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/found");

/// What `cnc` prints; it has to succeed.
#[track_caller]
fn cnc(args: &[&str]) -> String {
    let output = Command::cargo_bin("cnc").unwrap().args(args).output().unwrap();
    let [out, said] = [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
    assert!(output.status.success(), "{args:?}: {said}{out}");
    out
}

#[track_caller]
fn check(machine: &str) {
    let profile = cnc(&["machine", "show", machine, "--toml"]);
    let has_jerk = |line: &&str| line.starts_with("jerk_max_mm_s3");
    assert!(profile.lines().any(|line| has_jerk(&line)), "{profile}");
    let without: Vec<&str> = profile.lines().filter(|line| !has_jerk(line)).collect();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join(format!("{machine}-without-jerk.toml"));
    fs::write(&file, without.join("\n")).unwrap();
    let programs = fs::read_dir(FOUND).unwrap().count();
    for machine in [machine, file.to_str().unwrap()] {
        let told = cnc(&["verify", FOUND, "--json", "-q", "--machine", machine]);
        let (_, sum) = told.rsplit_once(r#"{"type":"sum","#).unwrap();
        assert!(sum.contains(&format!(r#""passed":{programs},"#)), "{told}");
    }
}

#[test]
fn programs_that_were_found_pass_on_the_starmill() {
    check("starmill");
}

#[test]
fn programs_that_were_found_pass_on_the_router() {
    check("router");
}
