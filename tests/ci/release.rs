//! `.github/workflows/release.yml`: what its steps do, without GitHub. What takes minutes, the builds
//! themselves, is run by `cargo test --test ci -- --ignored --nocapture`.

use std::fs;
use std::io::Write;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;

use yaml_rust2::Yaml;

use crate::workflow::{self, Runner, Step};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");
const VERSION: &str = env!("CARGO_PKG_VERSION");

fn steps(release: &Yaml, job: &str) -> Vec<Step> {
    workflow::steps(&release["jobs"][job], &release["defaults"])
}

fn named<'a>(steps: &'a [Step], name: &str) -> &'a Step {
    steps.iter().find(|step| step.name == name).unwrap_or_else(|| panic!("{name}"))
}

/// Puts programs on the path that stand for those which ask a network: each notes its arguments in
/// `calls`, and succeeds.
fn stand_ins(runner: &mut Runner, folder: &Path, names: &[&str]) {
    for name in names {
        let program = folder.join(name);
        let calls = folder.join("calls");
        let script = format!("#!/bin/sh\necho {name} \"$@\" >> {}\n", calls.display());
        fs::write(&program, script).unwrap();
        fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
    }
    runner.path.push(folder.to_owned());
}

#[test]
fn a_tag_of_another_version_ends_the_release() {
    let release = workflow::load(".github/workflows/release.yml");
    let steps = steps(&release, "binaries");
    let step = named(&steps, "The version is that of the tag");
    assert_eq!(step.condition.as_deref(), Some("startsWith(github.ref, 'refs/tags/v')"));
    let mut runner = Runner::new(Path::new(ROOT), true);
    let wild = VERSION.replace('.', "x");
    for (tag, code) in [(VERSION, 0), ("9.9.9", 1), (&wild, 1), ("", 1)] {
        runner.env.insert("GITHUB_REF_NAME".to_owned(), format!("v{tag}"));
        let (found, printed) = runner.run(step);
        assert_eq!(found, Some(code), "{tag}: {printed}");
        assert_eq!(printed.contains("::error file=Cargo.toml::"), code == 1, "{printed}");
    }
}

#[test]
fn a_draft_has_every_file_and_their_checksums() {
    let release = workflow::load(".github/workflows/release.yml");
    let work = tempfile::tempdir().unwrap();
    let tools = tempfile::tempdir().unwrap();
    fs::create_dir(work.path().join("dist")).unwrap();
    for name in ["cnc-a.tar.gz", "cnc-b.tar.gz", "cnc_a.deb"] {
        fs::write(work.path().join("dist").join(name), name).unwrap();
    }
    let mut runner = Runner::new(work.path(), true);
    stand_ins(&mut runner, tools.path(), &["gh"]);
    runner.context.insert("github.token".to_owned(), "secret".to_owned());
    for (name, value) in [("GITHUB_REF_NAME", "v1.2.3"), ("GITHUB_REPOSITORY", "owner/cnc")] {
        runner.env.insert(name.to_owned(), value.to_owned());
    }
    for step in steps(&release, "release") {
        let (code, printed) = runner.run(&step);
        assert_eq!(code, Some(0), "{}: {printed}", step.name);
    }
    let sums = Command::new("sha256sum")
        .args(["--check", "--strict", "SHA256SUMS"])
        .current_dir(work.path().join("dist"))
        .output()
        .unwrap();
    assert!(sums.status.success(), "{sums:?}");
    assert_eq!(String::from_utf8(sums.stdout).unwrap().lines().count(), 3);
    let calls = fs::read_to_string(tools.path().join("calls")).unwrap();
    let words: Vec<&str> = calls.split_whitespace().collect();
    assert_eq!(words[..6], ["gh", "release", "create", "v1.2.3", "--repo", "owner/cnc"]);
    let files: Vec<&str> = words.iter().filter_map(|word| word.strip_prefix("dist/")).collect();
    assert_eq!(files, ["SHA256SUMS", "cnc-a.tar.gz", "cnc-b.tar.gz", "cnc_a.deb"]);
}

/// The whole job in a fresh clone, for each target whose standard library is installed. Of the steps
/// only what installs Rust and qemu does nothing.
#[test]
#[ignore = "builds releases: minutes each"]
fn every_step_of_the_release_runs() {
    let release = workflow::load(".github/workflows/release.yml");
    let job = &release["jobs"]["binaries"];
    for row in job["strategy"]["matrix"]["include"].as_vec().unwrap() {
        let row = workflow::texts(row);
        let target = &row.iter().find(|(name, _)| name == "target").unwrap().1;
        let library = Command::new("rustc")
            .args(["--print", "target-libdir", "--target", target])
            .output()
            .unwrap();
        if !Path::new(String::from_utf8(library.stdout).unwrap().trim()).is_dir() {
            writeln!(std::io::stderr(), "{target}: its standard library is not installed").unwrap();
            continue;
        }
        let work = tempfile::tempdir().unwrap();
        let tools = tempfile::tempdir().unwrap();
        let cloned = Command::new("git")
            .args(["clone", "--quiet", "--depth", "1", &format!("file://{ROOT}"), "."])
            .current_dir(work.path())
            .status()
            .unwrap();
        assert!(cloned.success());
        let mut runner = Runner::new(work.path(), false);
        stand_ins(&mut runner, tools.path(), &["rustup", "sudo"]);
        let named = row.iter().map(|(name, value)| (format!("matrix.{name}"), value.clone()));
        runner.context.extend(named);
        runner.env.insert("GITHUB_REF_NAME".to_owned(), format!("v{VERSION}"));
        for (name, value) in workflow::texts(&job["env"]) {
            let value = runner.fill(&value);
            runner.env.insert(name, value);
        }
        for step in steps(&release, "binaries") {
            let (code, printed) = runner.run(&step);
            writeln!(std::io::stderr(), "{target}: {}\n{printed}", step.name).unwrap();
            assert_eq!(code, Some(0), "{target}: {}", step.name);
        }
        let files = fs::read_dir(work.path().join("dist")).unwrap();
        let files: Vec<_> = files.map(|file| file.unwrap().file_name()).collect();
        assert_eq!(files.len(), 2, "{files:?}");
        let archive = format!("cnc-{VERSION}-{target}.tar.gz");
        assert!(files.iter().any(|file| *file == *archive), "{files:?}");
        assert!(files.iter().any(|file| file.to_str().unwrap().ends_with(".deb")), "{files:?}");
    }
}
