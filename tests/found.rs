//! Programs for which steps were planned, once, that broke a limit, or that verification refused for nothing:
//! all of tests/found are planned and verified on every machine, with its limits on jerk and without.

use std::fs;

mod bench;

use bench::Bench;

const FOUND: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/found");

#[track_caller]
fn check(machine: &'static str) {
    let bench = Bench::new("", machine);
    let profile = bench.cnc(&["machine", "show", machine, "--toml"], 0, "jerk_max_mm_s3").stdout;
    let profile = String::from_utf8(profile).unwrap();
    let without = profile.lines().filter(|line| !line.starts_with("jerk_max_mm_s3"));
    fs::write(bench.path("without-jerk.toml"), without.collect::<Vec<_>>().join("\n")).unwrap();
    let all_passed = format!(r#""passed":{},"#, fs::read_dir(FOUND).unwrap().count());
    for machine in [machine, "without-jerk.toml"] {
        bench.cnc(&["verify", FOUND, "--json", "-q", "--machine", machine], 0, &all_passed);
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
