//! How the binary behaves to shells, scripts and people: completions, pages, help whose examples
//! work, closed pipes, interrupts, options that would do nothing, names that were meant.

use std::fs;
use std::io::Read;
use std::path::Path;
use std::process::{Command, Output, Stdio};

const CNC: &str = env!("CARGO_BIN_EXE_cnc");

const COMMANDS: [&str; 18] = [
    "interpret",
    "interpolate",
    "verify",
    "cut",
    "diff",
    "plot",
    "report",
    "send",
    "replay",
    "jog",
    "home",
    "node",
    "ports",
    "machine",
    "bus",
    "explain",
    "completions",
    "man",
];

/// The command in a folder of its own, by a shell that has it on its path.
fn shell(folder: &Path, line: &str) -> Output {
    let path = std::env::var("PATH").unwrap_or_default();
    let path = format!("{}:{path}", Path::new(CNC).parent().unwrap().display());
    let mut shell = Command::new("bash");
    shell.args(["-o", "pipefail", "-c", line]).current_dir(folder).env("PATH", path);
    for name in ["CNC_MACHINE", "CNC_DIALECT", "CNC_COLOR", "CNC_MAX_ERRORS", "CNC_NO_INPUT"] {
        shell.env_remove(name);
    }
    shell.env("XDG_STATE_HOME", folder).env("XDG_CONFIG_HOME", folder).env("HOME", folder);
    shell.stdin(Stdio::null()).output().unwrap()
}

/// A folder with a program, dumps, a trace and a profile, by the names that examples use.
fn workshop() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let part = "G21 G90 G94\nT6\nM3 S1500\nG0 X5 Y5\nG1 X12 Y9 F600\nG2 X15 Y12 I0 J3\nM5\nM30\n";
    fs::write(folder.path().join("part.nc"), part).unwrap();
    for line in [
        "cnc interpolate part.nc --csv -o part.csv && cp part.csv old.csv && cp part.csv new.csv",
        "grep -v '^#' part.csv > other.csv",
        "cnc send sim: part.nc --trace job.jsonl -q",
        "mkdir -p .zfunc .local/share/bash-completion/completions .config/fish/completions",
        "cnc machine show router --toml > mill.toml",
    ] {
        let made = shell(folder.path(), line);
        assert!(made.status.success(), "{line}: {}", String::from_utf8_lossy(&made.stderr));
    }
    folder
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn every_shell_has_its_completions() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = text(&shell(folder.path(), &format!("cnc completions {name}")).stdout);
        for command in COMMANDS {
            assert!(script.contains(command), "{name}: {command}");
        }
    }
}

#[test]
fn every_command_has_its_page() {
    let folder = tempfile::tempdir().unwrap();
    assert!(shell(folder.path(), "cnc man -o .").status.success());
    for command in COMMANDS {
        let page = fs::read_to_string(folder.path().join(format!("cnc-{command}.1"))).unwrap();
        assert!(page.contains(".SH SYNOPSIS") && page.contains("Examples:"), "{command}");
    }
    assert!(text(&shell(folder.path(), "cnc man").stdout).contains(".TH cnc 1"));
}

/// The examples of `cnc COMMAND --help`: each begins with two spaces, and what it is for follows
/// behind two more.
fn examples(folder: &Path, command: &str) -> Vec<String> {
    let help = text(&shell(folder, &format!("cnc {command} --help")).stdout);
    let (_, behind) = help.split_once("Examples:\n").unwrap_or_else(|| panic!("{command}: {help}"));
    let (shown, usage) = behind.split_once("\nUsage:").expect("examples stand before the usage");
    assert!(!help.split("Examples:").next().unwrap().contains("Usage:") && usage.len() > 10);
    let lines = shown.lines().filter_map(|line| line.strip_prefix("  cnc "));
    lines.map(|line| format!("cnc {}", line.split("  ").next().unwrap())).collect()
}

#[test]
fn the_examples_of_every_help_work() {
    let folder = workshop();
    let mut tried = 0;
    let actions = ["", "machine list", "machine show", "machine check"];
    for command in COMMANDS.iter().chain(&actions) {
        let examples = examples(folder.path(), command);
        assert!(!examples.is_empty(), "{command}");
        for example in examples {
            // What needs hardware, a second terminal or somebody who reads is not tried.
            let needs_more = ["/dev/", "cnc node", "| man"];
            if needs_more.iter().any(|what| example.contains(what)) {
                continue;
            }
            let ran = shell(folder.path(), &example);
            let code = ran.status.code();
            assert_eq!(code, Some(0), "{example}: {}{}", text(&ran.stderr), text(&ran.stdout));
            tried += 1;
        }
    }
    assert!(tried > 50, "{tried} examples tried");
}

#[test]
fn a_reader_that_has_gone_is_no_failure() {
    let folder = workshop();
    for line in [
        "cnc --help",
        "cnc interpret part.nc",
        "cnc interpret part.nc --json",
        "cnc interpret part.nc --fp -m kimm",
        "cnc interpolate part.nc",
        "cnc interpolate part.nc --json",
        "cnc interpolate part.nc --csv",
        "cnc interpolate part.nc --times",
        "cnc interpolate part.nc --explain-feed",
        "cnc interpolate part.nc --seams report",
        "cnc interpolate part.nc --method b",
        "cnc interpolate part.nc --method b --csv",
        "cnc interpolate part.nc --method pulse",
        "cnc verify part.nc part.csv",
        "cnc verify part.nc part.csv --json",
        "cnc cut part.nc --tool end-mill-6 --material brass-cuzn39pb3",
        "cnc diff old.csv new.csv",
        "cnc plot part.nc",
        "cnc plot part.csv --curve speed",
        "cnc report part.nc",
        "cnc send sim: part.nc",
        "cnc send sim: part.nc --json",
        "cnc send sim: part.nc --dry-run",
        "cnc replay job.jsonl part.nc",
        "cnc replay job.jsonl --json",
        "cnc jog sim: X --by 1 --json",
        "cnc home sim: Z --json --measured-tick 40000",
        "cnc ports --json",
        "cnc machine list",
        "cnc machine show",
        "cnc machine show --toml",
        "cnc machine show --json",
        "cnc machine check mill.toml",
        "cnc bus",
        "cnc bus --csv --nodes 1-200",
        "cnc bus part.nc",
        "cnc bus part.nc --csv",
        "cnc bus part.nc --ring",
        "cnc bus --curves load",
        "cnc explain",
        "cnc explain G2",
        "cnc explain --json",
        "cnc completions zsh",
        "cnc man",
    ] {
        // The reader is gone before the first byte: `true` takes nothing.
        let ran = shell(folder.path(), &format!("{line} 2>errors | true"));
        let said = fs::read_to_string(folder.path().join("errors")).unwrap();
        let said = said.lines().filter(|line| line.contains("pipe") || line.contains("panicked"));
        assert_eq!(said.collect::<Vec<_>>(), Vec::<&str>::new(), "{line}");
        assert_eq!(ran.status.code(), Some(0), "{line}");
    }
}

/// A program of so many moves that no computer is through with them before it is stopped.
fn endless(folder: &Path) {
    let program = "G21 G90 F600\n#1=0\no1 while [#1 lt 9000000]\n#1=[#1+1]\nG1 X[#1 MOD 20]\n\
                   o1 endwhile\nM30\n";
    fs::write(folder.join("endless.nc"), program).unwrap();
}

#[test]
fn an_interrupt_ends_a_command_and_leaves_no_part_of_a_file() {
    let folder = workshop();
    endless(folder.path());
    let before = names(folder.path());
    for arguments in [
        "interpret endless.nc -q",
        "interpolate endless.nc --csv -o out.csv",
        "plot endless.nc -o out.svg",
        "report endless.nc -o out.html",
        "verify endless.nc part.csv",
        "diff endless.nc part.csv",
        "send sim: endless.nc",
        "bus endless.nc",
    ] {
        for signal in ["INT", "TERM"] {
            let mut command = Command::new(CNC);
            command.args(arguments.split(' ')).current_dir(folder.path());
            command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
            let mut child = command.spawn().unwrap();
            // The process takes signals over when its first pass begins: before that one ends it.
            let status = format!("/proc/{}/status", child.id());
            while !catches_interrupts(&status) {
                assert!(child.try_wait().unwrap().is_none(), "{arguments} is over at once");
                std::thread::yield_now();
            }
            let id = child.id().to_string();
            assert!(Command::new("kill").args(["-s", signal, &id]).status().unwrap().success());
            let mut said = String::new();
            child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
            assert_eq!(child.wait().unwrap().code(), Some(130), "{arguments}: {said}");
            assert!(said.contains("interrupted"), "{arguments}: {said}");
            assert_eq!(names(folder.path()), before, "{arguments}");
        }
    }
}

/// Both signals, which are taken over one after the other: a test that looked for the first alone sent the
/// second too early.
fn catches_interrupts(status: &str) -> bool {
    // Bit n - 1 stands for signal n: SIGINT is 2, SIGTERM 15.
    const BOTH: u64 = 1 << 1 | 1 << 14;
    let status = fs::read_to_string(status).unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok())
        .is_some_and(|mask| mask & BOTH == BOTH)
}

fn names(folder: &Path) -> Vec<String> {
    let names = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name());
    let mut names: Vec<String> = names.map(|name| name.into_string().unwrap()).collect();
    names.sort();
    names
}

/// Runs a line that is refused, with a code and with words on standard error.
fn refused(folder: &Path, line: &str, code: i32, expected: &str) {
    let ran = shell(folder, line);
    let said = text(&ran.stderr);
    assert_eq!(ran.status.code(), Some(code), "{line}: {said}");
    assert!(said.contains(expected), "{line}: {said}");
}

#[test]
fn options_that_would_do_nothing_are_refused() {
    let folder = workshop();
    for (line, expected) in [
        ("cnc plot part.csv --feed constant", "--feed has no effect"),
        ("cnc plot part.csv --lenient", "--lenient has no effect"),
        ("cnc plot part.nc --width 300", "--width has no effect"),
        ("cnc plot --timing part.csv -m nosuch", "--machine has no effect"),
        ("cnc diff old.csv new.csv --start 1,2,3", "--start has no effect"),
        ("cnc send sim: part.csv --override 50%", "--override has no effect"),
        ("cnc replay job.jsonl part.csv --tools t", "--tools has no effect"),
        ("cnc replay job.jsonl --dialect grbl", "--dialect has no effect"),
        ("cnc bus --block-delete", "--block-delete has no effect"),
        ("cnc interpolate part.nc --rounding down", "--rounding has no effect"),
        ("cnc interpolate part.nc --word-bits 20", "--word-bits has no effect"),
        ("cnc interpolate part.nc --svg a.svg", "--svg has no effect"),
        ("cnc interpolate part.nc --method b --times", "--times has no effect"),
        ("cnc interpolate part.nc --method pulse --csv", "--csv has no effect"),
        ("cnc interpolate part.nc --method b --csv --json", "--json has no effect"),
        ("cnc interpolate part.nc --csv --json", "--json has no effect"),
        ("cnc send sim: part.nc --speed 2", "--speed has no effect"),
        ("cnc jog sim: X --by 1 --speed max", "--speed has no effect"),
        ("cnc report --merge . -m router", "--machine has no effect"),
        ("cnc man --json", "--json has no effect"),
        ("cnc man -m router", "--machine has no effect"),
        ("cnc completions bash --json", "--json has no effect"),
        ("cnc explain G1 -m router", "--machine has no effect"),
        ("cnc machine list -m router", "--machine has no effect"),
        ("cnc machine show starmill -m router", "--machine has no effect"),
        ("cnc machine check mill.toml -m router", "--machine has no effect"),
        ("cnc ports -m router", "--machine has no effect"),
        ("cnc node --plc --once -m router", "--machine has no effect"),
        ("cnc interpolate part.nc --method b --csv -o a --svg ./a", "named for two outputs"),
        ("cnc send sim: part.nc --trace a --journal ./a", "named for two outputs"),
        ("cnc send sim: part.nc --plc sim: --signals a --svg a", "named for two outputs"),
    ] {
        refused(folder.path(), line, 2, expected);
    }
    assert!(!folder.path().join("a").exists());
}

/// Before a long program is read to its end; in the words of the user, without numbers of the system and
/// names of temporary files.
#[test]
fn places_that_cannot_be_written_are_told_at_once() {
    let folder = workshop();
    endless(folder.path());
    for (line, expected) in [
        (
            "cnc send sim: endless.nc --trace no/t",
            "no/t cannot be written: there is no folder no\n",
        ),
        ("cnc send sim: endless.nc --journal no/t", "no/t cannot be written: there is no folder"),
        ("cnc send sim: endless.nc --trace .", ". cannot be written: it is a folder\n"),
        ("cnc report endless.nc -o no/t", "no/t cannot be written: there is no folder no\n"),
        ("cnc plot endless.nc -o no/t.svg", "no/t.svg cannot be written: there is no folder no\n"),
        ("cnc interpolate endless.nc --csv -o no/t", "no/t cannot be written: there is no folder"),
        (
            "cnc interpolate endless.nc --csv -o /proc/t",
            "/proc/t cannot be written: No such file or directory\n",
        ),
        ("cnc interpret . --format junit -o no/t", "no/t cannot be written: there is no folder"),
        ("cnc interpret part.nc part.nc -j 0", "a number from 1 on is expected"),
        ("cnc man -o part.nc", "part.nc is no folder: name one for the pages\n"),
        ("cnc node --link part.nc", "the link part.nc: something else has that name"),
        ("cnc interpret - -", "- is named twice"),
        ("cnc interpret /dev/zero", "1 MiB without the end of a line: this is no text\n"),
        ("TMPDIR=/proc cnc interpret -", "no temporary file in /proc (TMPDIR): "),
    ] {
        refused(folder.path(), line, 2, expected);
    }
}

#[test]
fn names_that_were_meant_are_told() {
    let folder = workshop();
    let config = "[ports.mill]\nbaud = 9600\n";
    fs::write(folder.path().join("cnc.toml"), config).unwrap();
    for (line, code, expected) in [
        ("cnc interprt part.nc", 2, "'interpret'"),
        ("cnc machine shw", 2, "'show'"),
        ("cnc interpret part.nc --jsn", 2, "'--json'"),
        ("cnc interpolate part.nc --feed exct-stop", 2, "'exact-stop'"),
        ("cnc interpret part.nc --dialect fanuk", 2, "'fanuc'"),
        ("cnc completions fsh", 2, "'fish'"),
        ("cnc interpret part.nc -m ruoter", 2, "did you mean 'router'"),
        ("cnc explain no-fed", 2, "did you mean 'no-feed'"),
        ("cnc jog sim: Q --by 1", 2, "expected X, Y, Z"),
        ("cnc jog sim: X-1 --by 1", 2, "--by says how far"),
        ("cnc jog sim: XY --by 1", 2, "one axis is expected"),
        ("CNC_MACHINE=ruoter cnc bus", 2, "CNC_MACHINE: no machine profile 'ruoter'"),
        ("CNC_MAX_ERRORS=x cnc bus", 2, "'x' for 'CNC_MAX_ERRORS (--max-errors <N>)'"),
        ("CNC_MAX_ERRORS=x cnc bus --max-errors y", 2, "'y' for '--max-errors <N>'"),
        ("CNC_NO_INPUT=banana cnc bus", 2, "CNC_NO_INPUT (--no-input)': 1, true, yes or on is"),
        ("CNC_DIALECT=fanuk cnc interpret part.nc", 2, "'fanuc'"),
        ("CNC_MACHNE=router cnc ports", 0, "nothing reads CNC_MACHNE; did you mean CNC_MACHINE?"),
        ("cnc jog sim: A --by 1", 1, "it has X, Y, Z"),
        ("cnc home sim: ZA", 1, "it has X, Y, Z"),
        ("cnc send mil part.nc --yes", 3, "did you mean mill"),
        ("cnc cut part.nc --tool end-mil-6 --material brass", 2, "did you mean 'end-mill-6'"),
        (
            "cnc cut part.nc --tool end-mill-6 --material brass-cuzn39",
            2,
            "did you mean 'brass-cuzn39pb3'",
        ),
    ] {
        refused(folder.path(), line, code, expected);
    }
}

#[test]
fn numbers_below_zero_are_values_of_options() {
    let folder = workshop();
    assert!(shell(folder.path(), "cnc jog sim: X --by -1 -q").status.success());
    assert!(
        shell(folder.path(), "cnc interpret part.nc --start -1,50,50 -m ideal").status.success()
    );
    refused(folder.path(), "cnc interpolate part.nc --override -1", 2, "from 1% to 200%");
    refused(folder.path(), "cnc diff old.csv new.csv --tolerance -1", 2, "from 0 to 1000");
}

#[test]
fn quiet_and_colours_are_what_was_asked_for() {
    let folder = workshop();
    fs::write(folder.path().join("bad.nc"), "G1 X1\nM30\n").unwrap();
    let said = |line: &str| text(&shell(folder.path(), line).stderr);
    for plain in [
        "cnc interpret bad.nc",
        "NO_COLOR=1 cnc interpret bad.nc",
        "cnc interpret bad.nc --color never",
    ] {
        assert!(!said(plain).contains('\x1b'), "{plain}");
    }
    for coloured in ["cnc interpret bad.nc --color always", "CNC_COLOR=always cnc interpret bad.nc"]
    {
        assert!(said(coloured).contains('\x1b'), "{coloured}");
    }
    for command in
        ["interpret part.nc", "interpolate part.nc --csv -o b.csv", "verify part.nc part.csv"]
    {
        let ran = shell(folder.path(), &format!("cnc {command} -q --no-input"));
        assert_eq!(
            (text(&ran.stdout), text(&ran.stderr)),
            (String::new(), String::new()),
            "{command}"
        );
    }
}
