//! Runs every example of the manual: in a ```console block of README.md and docs/*.md, each line
//! `$ command` must end with code 0, or with the one that a following `$ echo $?` shows, and
//! print what stands below it. `…` stands for any text within a line, and alone for any lines.

use std::fs;
use std::io::{Write, stderr};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A command, the code it ends with, and what it prints on both streams, if the manual shows it.
struct Example {
    line: usize,
    command: String,
    code: i32,
    output: Vec<String>,
}

fn examples(text: &str) -> Vec<Example> {
    let mut examples: Vec<Example> = Vec::new();
    let mut in_console = false;
    let mut after_echo = false;
    for (at, line) in text.lines().enumerate() {
        if line.starts_with("```") {
            in_console = line == "```console";
        } else if in_console && line == "$ echo $?" {
            after_echo = true;
        } else if in_console && after_echo {
            after_echo = false;
            let last = examples.last_mut().expect("a command before `echo $?`");
            last.code = line.parse().expect("an exit code below `echo $?`");
        } else if let Some(command) = line.strip_prefix("$ ").filter(|_| in_console) {
            let command = command.to_owned();
            examples.push(Example { line: at + 1, command, code: 0, output: Vec::new() });
        } else if in_console {
            let last = examples.last_mut().expect("output stands below a command");
            last.output.push(line.to_owned());
        }
    }
    examples
}

/// Whether the text is as shown.
fn is_like(shown: &[String], text: &[&str]) -> bool {
    match shown.split_first() {
        None => text.is_empty(),
        Some((first, rest)) if first == "…" => {
            (0..=text.len()).any(|skipped| is_like(rest, &text[skipped..]))
        }
        Some((first, rest)) => text
            .split_first()
            .is_some_and(|(line, text)| is_line_like(first, line) && is_like(rest, text)),
    }
}

fn is_line_like(shown: &str, line: &str) -> bool {
    let Some((before, after)) = shown.split_once('…') else { return shown == line };
    let Some(rest) = line.strip_prefix(before) else { return false };
    let ends = rest.char_indices().map(|(at, _)| at).chain([rest.len()]);
    ends.into_iter().any(|at| is_line_like(after, &rest[at..]))
}

/// A folder to run in, with the samples in it and `cnc` on the path.
fn playground() -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    symlink(root.join("samples"), folder.path().join("samples")).unwrap();
    let program = PathBuf::from(env!("CARGO_BIN_EXE_cnc"));
    let path = std::env::var("PATH").unwrap_or_default();
    let path = format!("{}:{path}", program.parent().unwrap().display());
    (folder, path)
}

/// Whether a line tells how far a computation is, which a busy computer does where others have ended.
fn tells_progress(line: &str) -> bool {
    line.ends_with(" so far") || (line.contains(" %, ") && line.ends_with(" left"))
}

fn check(file: &Path) -> usize {
    let text = fs::read_to_string(file).unwrap();
    let (folder, path) = playground();
    let examples = examples(&text);
    for example in &examples {
        let output = Command::new("sh")
            .args(["-c", &format!("exec 2>&1\n{}", example.command)])
            .current_dir(folder.path())
            .env("PATH", &path)
            .env_remove("CNC_MACHINE")
            .env("XDG_STATE_HOME", folder.path())
            .env("XDG_CONFIG_HOME", folder.path())
            .stdin(std::process::Stdio::null())
            .output()
            .unwrap();
        let printed = String::from_utf8(output.stdout).unwrap();
        let place = format!("{}:{}: {}", file.display(), example.line, example.command);
        assert_eq!(output.status.code(), Some(example.code), "{place}\n{printed}");
        let lines = printed.lines().map(str::trim_end).filter(|line| !tells_progress(line));
        let lines: Vec<&str> = lines.collect();
        let shown = &example.output;
        assert!(
            shown.is_empty() || is_like(shown, &lines),
            "{place} printed\n{printed}\nand not\n{}",
            shown.join("\n")
        );
    }
    examples.len()
}

#[test]
fn the_examples_of_the_manual_do_what_it_says() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    assert!(check(&root.join("README.md")) > 0);
    for entry in fs::read_dir(root.join("docs")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|ending| ending == "md") {
            check(&path);
        }
    }
}

/// The first block of a language in a page.
fn block<'a>(text: &'a str, language: &str) -> &'a str {
    let begin = format!("```{language}\n");
    text.split(&begin).nth(1).and_then(|rest| rest.split("```").next()).expect("a block")
}

/// A program that may not be here, with a script that ends well where it is: what it prints.
fn printed_by(program: &str, args: &[&str], folder: &Path) -> Option<String> {
    let output = Command::new(program).args(args).current_dir(folder).output().ok()?;
    output.status.success().then(|| String::from_utf8(output.stdout).unwrap())
}

/// What other programs do with a dump; tried where they are, which is not so in CI.
#[test]
fn dumps_are_read_by_pandas_and_gnuplot_as_shown() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/howto-dump.md");
    let text = fs::read_to_string(&page).unwrap();
    let (folder, _) = playground();
    let folder = folder.path();
    let dump =
        ["interpolate", "samples/good/pyramid-with-pockets.nc", "--csv", "-o", "pyramid.csv"];
    printed_by(env!("CARGO_BIN_EXE_cnc"), &dump, folder).expect("a dump");
    let has_pandas = |python: &&str| printed_by(python, &["-c", "import pandas"], folder).is_some();
    match ["python3", "/usr/bin/python3"].into_iter().find(has_pandas) {
        Some(python) => {
            let printed = printed_by(python, &["-c", block(&text, "python")], folder);
            assert_eq!(printed.expect("what pandas makes of it"), block(&text, "text"));
        }
        None => writeln!(stderr(), "pandas is not here: its lines are not tried").unwrap(),
    }
    match printed_by("gnuplot", &["--version"], folder) {
        Some(_) => {
            printed_by("sh", &["-c", block(&text, "sh")], folder).expect("gnuplot's drawing");
            let drawing = fs::read_to_string(folder.join("above.svg")).unwrap();
            assert!(
                drawing.len() > 10_000 && drawing.contains("</svg>"),
                "{} bytes",
                drawing.len()
            );
        }
        None => writeln!(stderr(), "gnuplot is not here: its line is not tried").unwrap(),
    }
}

#[test]
fn links_of_the_manual_lead_somewhere() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let tops = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md"];
    let pages = fs::read_dir(root.join("docs")).unwrap().map(|entry| entry.unwrap().path());
    let pages = pages.filter(|path| path.extension().is_some_and(|ending| ending == "md"));
    for file in tops.map(|name| root.join(name)).into_iter().chain(pages) {
        let text = fs::read_to_string(&file).unwrap();
        for target in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let local = target.split('#').next().unwrap();
            let leads = target.starts_with("http") || file.parent().unwrap().join(local).exists();
            assert!(leads, "{}: {target}", file.display());
        }
    }
}

#[test]
fn every_page_stands_in_the_table_of_contents() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let contents = fs::read_to_string(docs.join("README.md")).unwrap();
    for entry in fs::read_dir(docs).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let is_page = name.ends_with(".md") && name != "README.md";
        assert!(!is_page || contents.contains(&format!("]({name})")), "{name}");
    }
}

#[test]
fn shown_output_is_compared_with_its_gaps() {
    let shown = |lines: &[&str]| lines.iter().map(|line| (*line).to_owned()).collect::<Vec<_>>();
    assert!(is_like(&shown(&["a … c", "…", "z"]), &["a b c", "x", "y", "z"]));
    assert!(is_like(&shown(&["…"]), &[]));
    assert!(!is_like(&shown(&["a … c"]), &["a b d"]));
    assert!(!is_like(&shown(&["a"]), &["a", "b"]));
    let found = examples("```console\n$ cnc a\nout\n$ echo $?\n1\n$ cnc b\n```\n$ no\n");
    assert_eq!(found.len(), 2);
    assert_eq!((found[0].code, found[0].output.as_slice()), (1, shown(&["out"]).as_slice()));
}
