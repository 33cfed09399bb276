//! Many programs by one command: their order, their sum, exit codes, and what cannot be read.

use std::ffi::OsStr;
use std::fs;
use std::io::Write;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::Value;
use tempfile::TempDir;

const GOOD: &str = "G0 X1\nM30\n";
const BAD: &str = "G1 X1 I5\nM30\n";

/// What a command ended with, and what it printed and said.
struct Ran {
    code: Option<i32>,
    out: String,
    said: String,
}

fn command(folder: &Path, line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cnc"));
    command.args(line.split(' ')).current_dir(folder).env_remove("CNC_MACHINE");
    command.stdin(Stdio::null());
    command
}

fn run(folder: &TempDir, line: &str) -> Ran {
    let output = command(folder.path(), line).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    Ran { code: output.status.code(), out: text(output.stdout), said: text(output.stderr) }
}

/// A folder with these files.
fn folder(files: &[(&str, &str)]) -> TempDir {
    let folder = TempDir::new().unwrap();
    for (name, text) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    folder
}

/// A program without or with errors, the longer the lower its number.
fn long(number: usize) -> String {
    let moves = (60 - number) * 20;
    let word = if number.is_multiple_of(3) { "J1" } else { "" };
    let lines = (0..moves).map(|at| format!("G1 X{} F100 {word}\n", at % 7));
    lines.chain(["M30\n".to_owned()]).collect()
}

#[test]
fn output_is_the_same_on_one_thread_and_on_many() {
    let folder = TempDir::new().unwrap();
    for number in 0..60 {
        fs::write(folder.path().join(format!("{number:02}.nc")), long(number)).unwrap();
    }
    for form in ["--format text", "--json", "--format github", "--format sarif", "--format junit"] {
        let [one, many] =
            [1, 5].map(|jobs| run(&folder, &format!("interpret . {form} --jobs {jobs}")));
        assert_eq!((one.code, one.out, one.said), (many.code, many.out, many.said), "{form}");
    }
    let lines = run(&folder, "interpret .").out;
    let names: Vec<&str> =
        lines.lines().filter_map(|line| line.split_whitespace().nth(1)).take(60).collect();
    assert_eq!(names, (0..60).map(|number| format!("./{number:02}.nc")).collect::<Vec<_>>());
}

#[test]
fn errors_of_a_program_stand_together_and_before_those_of_the_next() {
    let many_errors: String = (0..150).map(|_| "G1 X1 F9 J1\n").chain(["M30\n"]).collect();
    let files: Vec<(String, &str)> =
        (10..30).map(|number| (format!("{number}.nc"), many_errors.as_str())).collect();
    let files: Vec<(&str, &str)> =
        files.iter().map(|(name, text)| (name.as_str(), *text)).collect();
    let folder = folder(&files);
    let ran = run(&folder, "interpret . --jobs 4");
    let places = ran.said.lines().filter_map(|line| line.trim_start().strip_prefix("--> "));
    let places: Vec<(&str, u32)> = places
        .map(|place| place.split_once(':').unwrap())
        .map(|(file, rest)| (file, rest.split(':').next().unwrap().parse().unwrap()))
        .collect();
    assert_eq!(places.len(), 20 * 100);
    assert!(places.is_sorted());
    let detail = "150 errors, 50 of them not shown (--max-errors)";
    assert!(ran.out.starts_with(&format!("FAIL  ./10.nc  {detail}\n")), "{}", ran.out);
    assert!(ran.out.ends_with("\n20 programs: 0 passed, 20 failed; 3000 errors\n"), "{}", ran.out);
    for (form, told) in [("github", 20), ("sarif", 20)] {
        let out = run(&folder, &format!("interpret . --format {form}")).out;
        assert_eq!(out.matches("(--max-errors)").count(), told, "{form}");
    }
    let junit = run(&folder, "interpret . --format junit").out;
    assert_eq!(junit.matches("(and 149 more errors)").count(), 20);
    let junit = run(&folder, "interpret 10.nc --max-errors 0 --format junit").out;
    assert!(
        junit.contains("<failure type=\"errors\" message=\"150 errors\"></failure>"),
        "{junit}"
    );
}

#[test]
fn the_exit_code_is_the_worst() {
    let folder = folder(&[("good/a.nc", GOOD), ("good/b.NGC", GOOD), ("bad.nc", BAD)]);
    fs::create_dir(folder.path().join("none")).unwrap();
    for (line, code, sum) in [
        ("interpret good", 0, "2 programs: 2 passed"),
        ("interpret good/a.nc bad.nc", 1, "2 programs: 1 passed, 1 failed; 1 error"),
        (
            "interpret bad.nc good gone.nc",
            2,
            "4 programs: 2 passed, 1 failed, 1 not judged; 1 error",
        ),
        ("interpret none", 2, "1 program: 0 passed, 1 not judged"),
        ("verify good", 0, "2 programs: 2 passed; greatest contour error 0.0000 mm, "),
        ("verify good bad.nc", 1, "3 programs: 2 passed, 1 failed; 1 error; "),
        ("verify good none", 2, "3 programs: 2 passed, 1 not judged; "),
    ] {
        let ran = run(&folder, line);
        let last = ran.out.lines().last().unwrap_or_default();
        assert!(ran.code == Some(code) && last.starts_with(sum), "{line}: {:?} {last}", ran.code);
        let quiet = run(&folder, &format!("{line} -q"));
        assert_eq!((quiet.code, quiet.out.as_str()), (Some(code), ""), "{line}");
        assert_eq!(quiet.said.is_empty(), code == 0, "{line}: {}", quiet.said);
        for form in ["github", "sarif", "junit"] {
            let ran = run(&folder, &format!("{line} --format {form}"));
            assert_eq!(ran.code, Some(code), "{line} {form}");
            assert!(ran.said.lines().last().unwrap().starts_with(sum), "{line}: {}", ran.said);
        }
        let json = run(&folder, &format!("{line} --json")).out;
        let json: Value = serde_json::from_str(json.lines().last().unwrap()).unwrap();
        assert_eq!(json["type"], "sum");
        let programs = sum.split(' ').next().unwrap();
        assert_eq!(json["programs"].to_string(), programs, "{line}");
    }
}

#[test]
fn standard_input_is_one_of_many() {
    let folder = folder(&[("a.nc", GOOD)]);
    let mut child = command(folder.path(), "interpret a.nc - --format github")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(BAD.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let out = String::from_utf8(output.stdout).unwrap();
    assert!(out.starts_with("::error line=1,col=7,endColumn=8,title=cnc unused-word::<stdin>:1:7"));
}

#[test]
fn dumps_go_with_the_programs_that_they_are_of() {
    let folder = folder(&[("a.nc", GOOD), ("b.nc", GOOD), ("c.nc", "G0 X2\nM30\n")]);
    assert_eq!(run(&folder, "interpolate a.nc --csv -o a.csv").code, Some(0));
    fs::copy(folder.path().join("a.csv"), folder.path().join("c.csv")).unwrap();
    fs::write(folder.path().join("b.csv"), "T,Z\n").unwrap();
    let ran = run(&folder, "verify .");
    let lines: Vec<&str> = ran.out.lines().collect();
    assert!(lines[0].starts_with("ok    ./a.nc  contour ") && lines[0].ends_with("dump ./a.csv"));
    assert!(lines[1].starts_with("ok    ./b.nc  contour ") && !lines[1].contains("dump"));
    assert_eq!(lines[2], "FAIL  ./c.nc  dump ./c.csv, wrong file");
    assert!(ran.said.contains("note: ./b.csv is no command dump: ./b.nc is planned here"));
    assert!(ran.said.contains("error: ./c.csv: the dump was made from another program"));
    assert_eq!(ran.code, Some(1));
    let json = run(&folder, "verify . --json").out;
    assert!(json.contains("\"rule\":\"wrong-file\""), "{json}");

    fs::rename(folder.path().join("c.csv"), folder.path().join("lonely.csv")).unwrap();
    let ran = run(&folder, "verify .");
    assert_eq!(ran.code, Some(0));
    assert!(ran.said.contains("warning: ./lonely.csv is not judged: no program"), "{}", ran.said);
    let ran = run(&folder, "verify a.csv a.nc lonely.csv b.nc");
    assert_eq!(ran.code, Some(2));
    assert!(ran.said.contains("error: lonely.csv is a command dump"), "{}", ran.said);
    assert!(
        ran.out.ends_with(
            "3 programs: 2 passed, 1 not judged; \
        greatest contour error 0.0000 mm, 0 % of what is allowed: a.nc\n"
        ),
        "{}",
        ran.out
    );
    for (line, code, message) in [
        ("verify a.csv", 2, "cnc verify PROGRAM a.csv"),
        ("verify a.nc", 0, "note: held against a.csv, which lies beside it"),
        ("verify b.nc", 0, "note: no dump is named"),
        ("verify a.nc b.nc", 1, "--programs: for a program"),
        ("verify a.nc b.nc --programs", 0, ""),
        ("verify a.nc a.csv --lenient", 2, "the dump says how it was made"),
        ("verify a.nc --unsealed", 2, "--unsealed takes a program and its dump"),
        ("verify a.nc --json --format sarif", 2, "two forms of one output"),
        ("interpret a.nc -o a.txt", 2, "use > OUT"),
        ("verify a.nc a.csv -o a.txt", 2, "use > OUT"),
        ("interpret . --fp", 2, "--fp lists the pulses of one program"),
    ] {
        let ran = run(&folder, line);
        assert_eq!(ran.code, Some(code), "{line}: {}", ran.said);
        assert!(ran.said.contains(message), "{line}: {}", ran.said);
    }
}

#[test]
fn what_cannot_be_read_is_told_and_holds_nothing_up() {
    let folder =
        folder(&[("a.nc", GOOD), (".git/hidden.nc", BAD), ("notes.pdf", ""), ("b/c.tap", GOOD)]);
    let at = |name: &str| folder.path().join(name);
    symlink("nowhere", at("gone.nc")).unwrap();
    symlink(folder.path(), at("b/loop")).unwrap();
    rustix::fs::mkfifoat(rustix::fs::CWD, at("pipe.nc"), 0o600.into()).unwrap();
    fs::write(folder.path().join(OsStr::from_bytes(b"z\xff\n.nc")), GOOD).unwrap();
    let ran = run(&folder, "interpret .");
    assert_eq!(ran.code, Some(2));
    let rows: Vec<&str> = ran.out.lines().map(str::trim_end).collect();
    assert_eq!(
        rows,
        [
            "ok    ./a.nc     2 lines, 1 move",
            "ok    ./b/c.tap  2 lines, 1 move",
            "FAIL  ./gone.nc  not judged",
            "ok    ./z\u{fffd}\u{fffd}.nc   2 lines, 1 move",
            "4 programs: 3 passed, 1 not judged",
        ]
    );
    for said in [
        "error: ./gone.nc: No such file",
        "note: ./b/loop is not read: a link to a folder",
        "note: ./pipe.nc is not read: no file",
        ": 1 .pdf",
    ] {
        assert!(ran.said.contains(said), "{said}: {}", ran.said);
    }
    let sarif = run(&folder, "interpret . --format sarif").out;
    assert!(sarif.contains("\"uri\":\"z%FF%0A.nc\""), "{sarif}");
}

#[test]
fn a_reader_that_goes_away_changes_no_verdict() {
    let folder = folder(&[("a.nc", GOOD), ("b.nc", BAD), ("c.nc", GOOD)]);
    for (line, code) in [("interpret .", 1), ("interpret a.nc c.nc", 0), ("verify .", 1)] {
        for form in ["", " --json", " --format github", " --format sarif", " --format junit"] {
            let (reader, writer) = std::io::pipe().unwrap();
            drop(reader);
            let mut command = command(folder.path(), &format!("{line}{form}"));
            let output = command.stdout(writer).output().unwrap();
            let said = String::from_utf8(output.stderr).unwrap();
            assert_eq!(output.status.code(), Some(code), "{line}{form}: {said}");
            assert!(!said.to_lowercase().contains("pipe"), "{said}");
        }
    }
}

#[test]
fn output_goes_whole_into_a_file() {
    let folder = folder(&[("a.nc", GOOD), ("b.nc", BAD)]);
    let printed = run(&folder, "interpret . --format sarif").out;
    let ran = run(&folder, "interpret . --format sarif -o out.sarif");
    assert_eq!((ran.code, ran.out.as_str()), (Some(1), ""));
    assert_eq!(fs::read_to_string(folder.path().join("out.sarif")).unwrap(), printed);
    let ran = run(&folder, "interpret . -o nowhere/out.txt");
    assert_eq!((ran.code, ran.out.as_str()), (Some(2), ""));
    assert!(ran.said.contains("there is no folder nowhere"), "{}", ran.said);
    assert_eq!(run(&folder, "interpolate a.nc --csv -o a.csv").code, Some(0));
    for (line, name) in [("interpret a.nc b.nc -o a.nc", "a.nc"), ("verify . -o a.csv", "a.csv")] {
        let read = || fs::read(folder.path().join(name)).unwrap();
        let (before, ran) = (read(), run(&folder, line));
        assert_eq!(ran.code, Some(2), "{line}");
        assert!(ran.said.contains("this command reads it"), "{line}: {}", ran.said);
        assert_eq!(before, read(), "{line}");
    }
}

#[test]
fn nothing_that_is_read_is_written_over() {
    let folder = folder(&[
        ("a.nc", GOOD),
        ("main.nc", "G21 G90 F300\nM98 P1001\nM30\n"),
        ("1001.nc", "O1001\nG1 X10\nM99\n"),
        ("t.tbl", "T1 P1 Z0 D6\n"),
        ("cnc.toml", "dialect = \"fanuc\"\n"),
    ]);
    let profile = run(&folder, "machine show starmill --toml").out;
    fs::write(folder.path().join("m.toml"), profile).unwrap();
    let result = run(&folder, "report a.nc --json").out;
    fs::write(folder.path().join("a.json"), result).unwrap();
    for (line, name) in [
        ("interpolate a.nc --csv -m m.toml -o m.toml", "m.toml"),
        ("report a.nc -m m.toml -o m.toml", "m.toml"),
        ("interpolate a.nc --csv --tools t.tbl -o t.tbl", "t.tbl"),
        ("interpret main.nc --format sarif -o 1001.nc", "1001.nc"),
        ("report main.nc -o 1001.nc", "1001.nc"),
        ("interpret a.nc --format sarif -o cnc.toml", "cnc.toml"),
        ("report --merge a.json -o a.json", "a.json"),
    ] {
        let read = || fs::read(folder.path().join(name)).unwrap();
        let (before, ran) = (read(), run(&folder, line));
        assert_eq!(ran.code, Some(2), "{line}: {}", ran.said);
        assert!(ran.said.contains("this command reads it"), "{line}: {}", ran.said);
        assert_eq!(before, read(), "{line}");
    }
}

#[test]
fn a_dump_that_cannot_be_read_is_not_passed_over() {
    let folder = folder(&[("a.nc", GOOD), ("B.NC", GOOD)]);
    assert_eq!(run(&folder, "interpolate a.nc --csv -o B.CSV").code, Some(0));
    let ran = run(&folder, "verify B.NC --json");
    assert!(!ran.said.contains("planned here"), "{}", ran.said);
    std::os::unix::fs::symlink("nowhere", folder.path().join("a.csv")).unwrap();
    let ran = run(&folder, "verify .");
    assert_eq!(ran.code, Some(2), "{}", ran.said);
    assert!(ran.said.contains("a.csv lies beside it and is no file"), "{}", ran.said);
}
