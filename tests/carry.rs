//! `cnc bus`: figures that papers print, settings that cannot work, and programs that interfaces keep
//! up with or not.

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use cnc::base::Machine;
use serde_json::Value;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Runs `cnc bus` and gives its exit code, its standard output and its standard error.
fn bus(args: &[&str]) -> (i32, String, String) {
    let mut command = Command::cargo_bin("cnc").unwrap();
    command.current_dir(root()).env_remove("CNC_MACHINE").arg("bus").args(args);
    let output = command.output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

fn json(args: &[&str]) -> (i32, Value) {
    let (code, out, err) = bus(&[args, &["--json"]].concat());
    (code, serde_json::from_str(&out).unwrap_or_else(|_| panic!("{args:?}: {out}{err}")))
}

/// A program in a file of its own.
fn program(name: &str, text: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::write(&path, text).unwrap();
    path
}

/// A value as it is printed: rounded to as many decimals.
fn as_printed(value: &Value, printed: &str) -> String {
    let decimals = printed.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    value.as_f64().map_or(value.to_string(), |number| format!("{number:.decimals$}"))
}

#[test]
fn figures_are_those_of_the_papers() {
    let file = fs::read_to_string(root().join("tests/carry/printed.txt")).unwrap();
    for line in file.lines().filter(|line| !line.starts_with('#')) {
        let [place, args, pointer, printed] =
            <[&str; 4]>::try_from(line.split('|').map(str::trim).collect::<Vec<_>>()).unwrap();
        let (code, found) = json(&args.split_whitespace().collect::<Vec<_>>());
        assert_eq!(code, 0, "{place}");
        let value = found.pointer(pointer).unwrap_or_else(|| panic!("{place}: {pointer}"));
        assert_eq!(as_printed(value, printed), printed, "{place}");
    }
}

#[test]
fn settings_that_cannot_work_are_refused_with_the_figure() {
    for (args, reason) in [
        (
            "--protocol frame --nodes 15 --baud 9600",
            "a period of 11.0000 ms: the least is 32.2917 ms; 28182 baud would do",
        ),
        (
            "--protocol frame --nodes 15 --frequency 600",
            "a period of 1.6667 ms: the least is 8.0729 ms; no baud rate up to 115200 would do",
        ),
        (
            "--protocol frame --nodes 15 --baud 19200 --frequency 100",
            "the least is 16.1458 ms; 31000 baud would do, or 9 nodes",
        ),
        ("--protocol frame --nodes 16", "16 nodes: at most 15 can be addressed"),
        ("--protocol frame --baud 250000", "250000 baud: the line carries at most 115200"),
        ("--protocol buffered --nodes 16", "16 nodes: at most 15 can be addressed"),
        (
            "--protocol buffered --frequency 1000",
            "a period of 1.0000 ms: the least is 10.2800 ms; a node takes 10.0000 ms over a byte",
        ),
        (
            "--protocol sercos --nodes 8 --frequency 2000",
            "a period of 0.5000 ms: the least is 1.0000 ms; 3372800 baud would do, or 4 nodes",
        ),
        ("--protocol sercos --nodes 255", "255 nodes: at most 254 can be addressed"),
    ] {
        let args: Vec<&str> = args.split_whitespace().collect();
        let (code, _, err) = bus(&args);
        assert_eq!(code, 1, "{args:?}");
        assert!(err.contains(reason), "{args:?}: {err}");
        // Of interfaces that nobody has chosen it is told, and no more.
        let (code, _, err) = bus(&args[2..]);
        assert!(code == 0 && err.contains(reason), "{args:?}: {code} {err}");
    }
}

/// The baud rate and the number of nodes that a refusal names do work.
#[test]
fn what_a_refusal_proposes_works() {
    for args in [
        "--protocol sercos --frequency 2000 --baud 3372800 --nodes 8",
        "--protocol sercos --frequency 2000 --nodes 4",
        "--protocol frame --nodes 15 --baud 28182",
        "--protocol frame --nodes 6 --baud 11819",
    ] {
        assert_eq!(bus(&args.split_whitespace().collect::<Vec<_>>()).0, 0, "{args}");
    }
}

#[test]
fn usage_that_means_nothing_is_refused() {
    for args in [
        "--nodes 0",
        "--nodes 3-1",
        "--baud 0",
        "--frequency 0",
        "--frequency inf",
        "--protocol none",
        "--nodes 1-254 --baud 1-1000",
        "--block-mm 1",
        "--block-feed 100",
        "--curves fill --protocol sercos",
        "--curves sync --protocol coefficients",
        "--curves load --protocol frame,sercos",
        "--curves load --frequency 1,2",
        "--curves computing --nodes 1,2",
        "--curves nodes --nodes 3",
        "--curves nodes --protocol b",
        "--svg x.svg",
        "--ring",
        "samples/good/o001.nc --ring --protocol frame",
        "samples/good/o001.nc --ring --fault drive4@1",
        "samples/good/o001.nc --ring --fault control",
        "samples/good/o001.nc --fault control@1",
    ] {
        assert_eq!(bus(&args.split_whitespace().collect::<Vec<_>>()).0, 2, "{args}");
    }
}

#[test]
fn blocks_that_are_too_short_are_named() {
    // 0.1 mm at 600 mm/min take 10 ms, 0.01 mm take 1 ms; the cut of 500 s is longer than a buffer.
    let text = "G21 G91 G1 F600\nX10\nX0.1\nX0.01\nX0.02\nX1 F0.12\nM30\n";
    let short = program("short.nc", text);
    let short = short.to_str().unwrap();
    let (code, found) = json(&[short, "--protocol", "frame,coefficients,buffered,sercos"]);
    assert_eq!((code, &found["blocks"]), (1, &5.into()));
    assert_eq!(found.pointer("/shortest/line"), Some(&4.into()));
    // Rows: keeps up, too short, interrupted, line of the first, line of the worst.
    for (row, expected) in [
        (0, "false 2 0 4 4"),
        (1, "false 2 0 4 4"),
        (2, "false 3 30 3 4"),
        (3, "true 0 0 null null"),
    ] {
        let row = &found["rows"][row];
        let values = ["/keeps_up", "/short", "/interrupted", "/first/line", "/worst/line"]
            .map(|pointer| row.pointer(pointer).unwrap_or(&Value::Null).to_string());
        assert_eq!(values.join(" "), expected, "{row}");
    }
    let (code, out, _) = bus(&[short, "--protocol", "frame,sercos"]);
    assert_eq!(code, 1);
    let reason = "frame: first at line 4: 1.000 ms, and telling the axes takes 3.385 ms";
    assert!(out.contains(reason), "{out}");
    assert_eq!(bus(&[short]).0, 0, "nothing was chosen");
    assert_eq!(bus(&[short, "--protocol", "sercos"]).0, 0);
    // Told less often than it could be, a ring is too slow for it as well.
    assert_eq!(bus(&[short, "--protocol", "sercos", "--frequency", "500"]).0, 1);
    let (_, out, _) = bus(&[short, "--csv"]);
    let rows: Vec<&str> = out.lines().collect();
    assert_eq!(
        rows[0],
        "block,line,length_mm,feed_mm_min,ms,frame,coefficients,buffered,sercos,parallel"
    );
    assert_eq!(rows[3], "2,4,0.01,600,1,short,short,short,yes,yes");
    assert_eq!(rows[5], "4,6,1,0.12,500000,yes,yes,interrupted,yes,yes");
    assert_eq!(rows.len(), 6);
}

#[test]
fn steps_beyond_the_word_are_named() {
    // 110 mm/s at 100 steps a mm are 121 steps in 11 ms, of 119 at most.
    let fast = program("fast.nc", "G21 G91 G1 F6600\nX50\nX-50\nM30\n");
    let starmill = Machine::load("starmill").unwrap();
    let quick = starmill.to_toml().replace("speed_max_mm_s = 20", "speed_max_mm_s = 200");
    let quick = program("quick.toml", &quick);
    let files = [fast.to_str().unwrap(), "--machine", quick.to_str().unwrap()];
    let (code, found) = json(&[&files[..], &["--protocol", "buffered"]].concat());
    let row = &found["rows"][0];
    assert_eq!(code, 1, "{found}");
    assert_eq!(row.pointer("/first/lack"), Some(&"many-steps".into()), "{found}");
    assert_eq!(row["many_steps"], 2, "{found}");
    assert_eq!(bus(&[&files[..], &["--protocol", "sercos"]].concat()).0, 0);
}

#[test]
fn curves_are_drawn_and_written() {
    for (which, rows, last) in [
        ("load", 75, "frame,115200,15,2.690972"),
        ("fill", 54, "buffered,15,10000000,22.56"),
        ("sync", 9, "buffered,3,10000000,0.003"),
        ("computing", 505, "frame,115200,1000,-1.690972"),
        ("nodes", 505, "frame,115200,1000,0"),
    ] {
        let svg = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{which}.svg"));
        let (code, out, err) = bus(&["--curves", which, "--csv", "--svg", svg.to_str().unwrap()]);
        assert_eq!((code, out.lines().count()), (0, rows + 1), "{which}: {err}");
        assert_eq!(out.lines().last(), Some(last), "{which}");
        let drawing = fs::read_to_string(&svg).unwrap();
        let curves = drawing.matches("class=\"curve").count();
        let names = out.lines().skip(1).map(|row| row.split(',').nth(1).unwrap());
        let names: std::collections::BTreeSet<_> = names.collect();
        // A single curve is what the title says.
        let legend = if names.len() > 1 { names.len() } else { 0 };
        assert_eq!(curves, names.len() + legend, "{which}: a curve and its name in the legend");
        assert!(!drawing.contains("NaN"), "{which}");
    }
}
