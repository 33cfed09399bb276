//! Machine profiles: what is refused, with which words; what is accepted, and its canonical form.

use std::fs;
use std::process::Stdio;

use assert_cmd::Command;
use cnc::base::machine::{BUILT_IN, Machine, ProfileError};
use proptest::prelude::*;

const BASE: &str = include_str!("machines/base.toml");

/// Faults as the cases write them.
fn faults(text: &str) -> Vec<String> {
    match Machine::parse("case", text) {
        Ok(_) => Vec::new(),
        Err(ProfileError::Wrong { faults, .. }) => faults
            .iter()
            .map(|fault| {
                let help = fault.help.as_ref().map_or(String::new(), |help| format!(" | {help}"));
                format!("{}:{} {}{help}", fault.span.line, fault.column(), fault.message)
            })
            .collect(),
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn every_fault_is_told_at_its_place_with_a_remedy() {
    assert_eq!(faults(BASE), [""; 0]);
    let cases = include_str!("machines/faults.txt").split("\n\n").skip(1);
    for case in cases {
        let mut text = BASE.to_owned();
        let (replacements, expected): (Vec<_>, Vec<_>) =
            case.lines().partition(|line| !line.starts_with('>'));
        for replacement in replacements {
            let (old, new) = replacement.split_once(" =>").expect("a case replaces: old => new");
            let old = format!("{old}\n");
            assert!(text.contains(&old), "base.toml has no line {old}");
            let new = new.trim_start().replace('⏎', "\n");
            let end = if new.is_empty() { "" } else { "\n" };
            text = text.replacen(&old, &format!("{new}{end}"), 1);
        }
        let expected: Vec<_> = expected.iter().map(|line| line.trim_start_matches("> ")).collect();
        assert_eq!(faults(&text), expected, "in\n{text}");
    }
}

#[test]
fn what_is_allowed_but_will_not_work_is_a_warning() {
    let warnings =
        |old: &str, new: &str| Machine::parse("case", &BASE.replace(old, new)).unwrap().warnings();
    assert!(warnings("", "").is_empty());
    assert!(warnings("tick_us = 11000", "tick_us = 10280").is_empty());
    assert!(warnings("tick_us = 11000", "tick_us = 10279")[0].contains("10280"));
    assert!(warnings("count_max = 119", "count_max = 120")[0].contains("119"));
    let frames = "protocol = \"frame\"\nbaud = 9600";
    let framed = BASE.replace("X = 122, Z = 124, A = 125", "X = 1, Z = 2, A = 3");
    let framed = framed.replace("protocol = \"buffered\"", frames);
    assert!(Machine::parse("case", &framed).unwrap().warnings()[0].contains("11819 baud"));
}

#[test]
fn every_profile_at_hand_is_right_and_its_canonical_form_is_stable() {
    let samples = fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/samples/machines")).unwrap();
    let samples = samples.map(|entry| entry.unwrap().path().display().to_string());
    let names: Vec<String> =
        BUILT_IN.iter().map(|(id, _)| (*id).to_owned()).chain(samples).collect();
    assert!(names.len() > BUILT_IN.len());
    for name in names {
        let machine = Machine::load(&name).unwrap();
        assert_eq!(machine.warnings(), [""; 0], "{name}");
        assert_eq!(Machine::parse(&machine.id, machine.to_toml()).unwrap(), machine, "{name}");
    }
}

#[test]
fn order_comments_and_spelling_of_numbers_do_not_change_the_seal() {
    let text = "# a comment\nname='Base'\n".to_owned()
        + &BASE.replace("name = \"Base\"\n", "").replace("100.0", "1e2").replace("0.0,", "0,");
    let (base, other) = (Machine::parse("x", BASE).unwrap(), Machine::parse("x", &text).unwrap());
    assert_eq!(base.sha256(), other.sha256());
    let moved = Machine::parse("x", &BASE.replace("X = 75.0", "X = 75.01")).unwrap();
    assert_ne!(base.sha256(), moved.sha256());
}

#[test]
fn counts_keep_to_the_byte_and_to_the_speed_within_the_nodes_tick() {
    let starmill = Machine::load("starmill").unwrap();
    let router = Machine::load("router").unwrap();
    assert!(starmill.axes.iter().all(|axis| starmill.count_max(axis) == 20));
    assert!(router.axes.iter().all(|axis| router.count_max(axis) == 60));
}

/// Runs `cnc machine …` and gives exit code, standard output and standard error.
fn cnc(args: &[&str]) -> (i32, String, String) {
    let output = Command::cargo_bin("cnc")
        .unwrap()
        .env_remove("CNC_MACHINE")
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .arg("machine")
        .args(args)
        .output()
        .unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

#[test]
fn the_command_lists_shows_and_checks() {
    let (code, out, _) = cnc(&["list", "--json"]);
    let list: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!((code, list["schema"].as_u64()), (0, Some(1)));
    assert_eq!(list["machines"][0]["id"], "starmill");

    let (code, out, err) = cnc(&["show", "router", "--toml"]);
    assert_eq!((code, err.as_str()), (0, ""));
    assert_eq!(out, Machine::load("router").unwrap().to_toml());

    let (_, out, _) = cnc(&["show", "--json", "--machine", "samples/machines/big-router.toml"]);
    let shown: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(shown["id"], "big-router");
    assert_eq!(shown["profile"]["axes"]["X"]["travel_mm"][1], 1300.0);

    let (code, out, err) = cnc(&["check", "samples/machines/big-router.toml", "Cargo.toml"]);
    assert_eq!(code, 2);
    assert!(out.starts_with("samples/machines/big-router.toml: ok"), "{out}");
    assert!(err.contains("error[profile-unknown-key]: unknown key 'package'"), "{err}");

    let (code, out, _) = cnc(&["check", "--json", "Cargo.toml"]);
    let checked: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!((code, &checked["ok"]), (2, &serde_json::Value::Bool(false)));
    assert_eq!(checked["files"][0]["errors"][0]["line"], 1);
}

#[test]
fn of_many_faults_the_first_are_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("wrong.toml").display().to_string();
    let text: String = (0..40).map(|key| format!("key{key} = 1\n")).collect();
    std::fs::write(&file, text).unwrap();
    let (_, out, _) = cnc(&["check", &file, "--json"]);
    let all = serde_json::from_str::<serde_json::Value>(&out).unwrap();
    let all = all["files"][0]["errors"].as_array().unwrap().len();
    for command in ["show", "check"] {
        let (code, out, err) = cnc(&[command, &file]);
        assert_eq!((code, out.as_str()), (2, ""));
        assert_eq!(err.matches("error[").count(), 20, "{err}");
        assert!(err.contains(&format!("and {} more faults\n", all - 20)), "{err}");
    }
}

#[test]
fn what_is_no_profile_is_refused_with_the_reason() {
    for (name, reason) in [
        ("routr", "did you mean 'router'?"),
        ("nosuch.toml", "there is no such file"),
        ("src", "directory"),
        ("/dev/zero", "is larger than 1 MiB"),
        ("/bin/sh", "UTF-8"),
    ] {
        let (code, out, err) = cnc(&["show", name]);
        assert_eq!((code, out.as_str()), (2, ""), "{name}");
        assert!(err.contains(reason) && err.lines().count() == 1, "{name}: {err}");
    }
}

#[test]
fn a_reader_that_went_away_is_no_failure_and_a_full_disk_is_one() {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let (closed, full) = (Stdio::from(writer), fs::File::create("/dev/full").unwrap().into());
    for (stdout, code, said) in [(closed, 0, ""), (full, 2, "No space left")] {
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_cnc"))
            .args(["machine", "show", "--toml"])
            .env_remove("CNC_MACHINE")
            .stdout(stdout)
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
            .wait_with_output()
            .unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(code), "{stderr}");
        assert!(stderr.contains(said) && (code != 0 || stderr.is_empty()), "{stderr}");
    }
}

#[test]
fn a_text_full_of_faults_is_refused_in_bounded_space() {
    let keys: String = (0..20_000).map(|i| format!("key{i} = 1\n")).collect();
    assert_eq!(faults(&keys).len(), 100);
    assert!((1..=100).contains(&faults(&"[".repeat(100_000)).len()));
}

proptest! {
    /// Any text is either a machine that reads back as itself, or refused with a reason.
    #[test]
    fn any_text_is_a_machine_or_a_reason(
        line in 0..BASE.lines().count(),
        with in "[a-zA-Z0-9_.=\\[\\]{}\", #'éß\n-]{0,24}",
    ) {
        let lines = BASE.lines().enumerate();
        let text: String =
            lines.map(|(i, old)| format!("{}\n", if i == line { &with } else { old })).collect();
        match Machine::parse("any", &text) {
            Ok(machine) => {
                prop_assert_eq!(Machine::parse("any", machine.to_toml()).unwrap(), machine)
            }
            Err(error) => prop_assert!(error.to_string().lines().count() > 1),
        }
    }

    /// Numbers survive the canonical form to the last bit.
    #[test]
    fn the_canonical_form_keeps_every_bit(steps in 5.0..1e5f64, zero in 0.0..150.0f64) {
        let text = BASE
            .replacen("steps_per_mm = 100.0", &format!("steps_per_mm = {steps:?}"), 1)
            .replacen("X = 75.0", &format!("X = {zero:?}"), 1);
        let machine = Machine::parse("any", &text).unwrap();
        let again = Machine::parse("any", machine.to_toml()).unwrap();
        prop_assert_eq!(again.axes[0].steps_per_mm, steps);
        prop_assert_eq!(&again, &machine);
    }
}
