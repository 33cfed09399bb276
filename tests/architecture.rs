//! Holds the arrows of ARCHITECTURE.md and the sizes of CONTRIBUTING.md by reading the sources:
//! every path (`crate::base::Axis`, `std::{io, time}`) of every file under src/.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Each folder of the library, and the folders that it may use.
const ARROWS: [(&str, &[&str]); 12] = [
    ("base", &[]),
    ("gcode", &["base"]),
    ("interp", &["base", "gcode"]),
    ("path", &["base", "interp"]),
    ("plan", &["base", "path"]),
    ("step", &["base", "path", "plan"]),
    ("tape", &["base"]),
    ("verify", &["base", "path", "tape"]),
    ("plot", &["base", "path", "tape"]),
    ("systems", &["base", "path"]),
    ("wire", &["base"]),
    ("wire_io", &["base", "systems", "tape", "wire"]),
];

/// What only some files may name: the first part of their paths under src/.
const RESERVED: [(&str, &str); 9] = [
    ("anyhow", "bin/"),
    ("clap", "bin/"),
    ("indicatif", "bin/"),
    ("annotate_snippets", "bin/"),
    ("print!", "bin/"),
    ("println!", "bin/"),
    ("eprintln!", "bin/"),
    ("serialport", "wire_io/serial.rs"),
    ("thread_priority", "wire_io/priority.rs"),
];

/// What a job decides must not hang on a clock, a thread or a device.
const NOT_IN_WIRE: [&str; 6] =
    ["std::io", "std::time", "std::thread", "std::fs", "std::net", "rustix"];

/// Functions of numbers that the standard library takes from the system's C library where it likes to:
/// the last bit, and so a step of a dump, would hang on the computer. The crate `libm` has them, the same
/// everywhere.
const NOT_THE_SYSTEMS: [&str; 16] = [
    "sin", "cos", "sin_cos", "tan", "asin", "acos", "atan", "atan2", "hypot", "cbrt", "exp",
    "exp2", "ln", "log2", "log10", "powf",
];

const FILE_MAX_LINES: usize = 600;
const FUNCTION_MAX_LINES: usize = 70;

/// A source file, cut into words and marks; comments and the insides of literals are gone.
struct File {
    /// Path below src/.
    name: String,
    lines: usize,
    begins_with_header: bool,
    tokens: Vec<Token>,
}

#[derive(Debug)]
struct Token {
    line: usize,
    text: String,
}

impl File {
    fn read(path: &Path, src: &Path) -> File {
        let text = fs::read_to_string(path).unwrap();
        File {
            name: path.strip_prefix(src).unwrap().display().to_string(),
            lines: text.lines().count(),
            begins_with_header: text.starts_with("//!"),
            tokens: tokens(&text),
        }
    }

    fn text(&self, at: usize) -> &str {
        self.tokens.get(at).map_or("", |token| &token.text)
    }

    /// The folder of the library that the file belongs to, as `gcode`.
    fn stage(&self) -> &str {
        self.name.split(['/', '.']).next().unwrap()
    }

    /// How deep the file's module lies: 1 for `gcode/mod.rs`, 2 for `gcode/lexer.rs`.
    fn depth(&self) -> usize {
        let names = self.name.trim_end_matches(".rs").trim_end_matches("/mod");
        names.split('/').count()
    }

    /// Every path in the file, its groups unfolded, with its line.
    fn paths(&self) -> Vec<(usize, Vec<&str>)> {
        let mut paths = Vec::new();
        let mut at = 0;
        while at < self.tokens.len() {
            let line = self.tokens[at].line;
            let mut found = Vec::new();
            let next = if is_word(self.text(at)) {
                self.unfold(at, &mut Vec::new(), &mut found)
            } else {
                at + 1
            };
            paths.extend(found.into_iter().map(|path| (line, path)));
            at = next;
        }
        paths
    }

    /// Reads a path from `at` on, and gives where it ends.
    fn unfold<'f>(
        &'f self,
        mut at: usize,
        prefix: &mut Vec<&'f str>,
        found: &mut Vec<Vec<&'f str>>,
    ) -> usize {
        let outer = prefix.len();
        loop {
            prefix.push(self.text(at));
            at += 1;
            if self.text(at) != "::" {
                break;
            }
            at += 1;
            if self.text(at) == "{" {
                at += 1;
                while !matches!(self.text(at), "}" | "") {
                    at = match self.text(at) {
                        "as" => at + 2,
                        text if is_word(text) => self.unfold(at, prefix, found),
                        _ => at + 1,
                    };
                }
                prefix.truncate(outer);
                return at + 1;
            }
            if !is_word(self.text(at)) {
                break;
            }
        }
        found.push(prefix.clone());
        prefix.truncate(outer);
        at
    }

    /// Name, first line and length of every function.
    fn functions(&self) -> Vec<(&str, usize, usize)> {
        let heads = (0..self.tokens.len())
            .filter(|at| self.text(*at) == "fn" && is_word(self.text(at + 1)));
        heads.filter_map(|at| self.body_end(at).map(|end| self.measure(at, end))).collect()
    }

    fn measure(&self, head: usize, end: usize) -> (&str, usize, usize) {
        let first = self.tokens[head].line;
        (self.text(head + 1), first, self.tokens[end].line - first + 1)
    }

    fn body_end(&self, head: usize) -> Option<usize> {
        let mut depth = 0;
        for at in head..self.tokens.len() {
            match self.text(at) {
                ";" if depth == 0 => return None,
                "{" | "(" | "[" => depth += 1,
                "}" | ")" | "]" => {
                    depth -= 1;
                    if depth == 0 && self.text(at) == "}" {
                        return Some(at);
                    }
                }
                _ => {}
            }
        }
        None
    }
}

fn is_word(text: &str) -> bool {
    text.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// Cuts a text into words, `::` and single marks. Good for this crate's sources, which
/// have no block comments, and raw strings with at most one `#`.
fn tokens(text: &str) -> Vec<Token> {
    let mut tokens = Vec::new();
    let (mut rest, mut line) = (text, 1);
    while let Some(first) = rest.chars().next() {
        let length = token_length(rest);
        let token = &rest[..length];
        let kept = match token {
            "::" => true,
            _ if first.is_whitespace() || token.starts_with("//") => false,
            _ => length == first.len_utf8() || is_word(token),
        };
        if kept && !token.contains('"') {
            tokens.push(Token { line, text: token.to_owned() });
        }
        line += token.matches('\n').count();
        rest = &rest[length..];
    }
    tokens
}

fn token_length(text: &str) -> usize {
    let until = |end: &str, from: usize| text[from..].find(end).map_or(text.len(), |at| from + at);
    let first = text.chars().next().map_or(0, char::len_utf8);
    if text.starts_with("//") {
        return until("\n", 0);
    }
    if text.starts_with("::") {
        return 2;
    }
    for (open, close) in [("r#\"", "\"#"), ("br#\"", "\"#"), ("r\"", "\"")] {
        if text.starts_with(open) {
            return (until(close, open.len()) + close.len()).min(text.len());
        }
    }
    if text.starts_with('"') {
        return quoted_length(text, '"');
    }
    // A quote that a character and a quote follow is a literal, else a lifetime.
    if text.starts_with("'\\")
        || text.chars().nth(2).is_some_and(|c| c == '\'') && text.starts_with('\'')
    {
        return quoted_length(text, '\'');
    }
    if is_word(text) {
        let end = text.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(text.len());
        // The prefix of a byte string or byte literal is no word.
        let word = &text[..end];
        let is_macro = text[end..].starts_with('!') && !text[end..].starts_with("!=");
        return if word == "b" { 1 } else { end + usize::from(is_macro) };
    }
    first
}

fn quoted_length(text: &str, quote: char) -> usize {
    let mut escaped = false;
    for (at, c) in text.char_indices().skip(1) {
        match c {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            c if c == quote => return at + 1,
            _ => {}
        }
    }
    text.len()
}

/// The files below a folder of the project.
fn files_of(folder: &str) -> Vec<File> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let mut files = Vec::new();
    walk(&folder, &mut |path| files.push(File::read(path, &folder)));
    files
}

fn sources() -> Vec<File> {
    let files = files_of("src");
    assert!(files.len() > 20, "no sources found");
    files
}

fn walk(folder: &Path, found: &mut impl FnMut(&Path)) {
    let mut entries: Vec<PathBuf> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            walk(&path, found);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            found(&path);
        }
    }
}

/// Runs a rule over all files, and fails with everything that breaks it.
fn check(rule: impl Fn(&File) -> Vec<String>) {
    let broken: Vec<String> = sources()
        .iter()
        .flat_map(|file| rule(file).into_iter().map(|what| format!("src/{}:{what}", file.name)))
        .collect();
    assert!(broken.is_empty(), "\n{}", broken.join("\n"));
}

/// Which of the library's folders a file uses: (line, folder).
fn uses(file: &File) -> Vec<(usize, String)> {
    let mut uses = Vec::new();
    for (line, path) in file.paths() {
        let supers = path.iter().take_while(|part| **part == "super").count();
        match path[0] {
            "crate" if path.len() > 1 => uses.push((line, path[1].to_owned())),
            // Out of the file's folder; from the tests' module, one deeper, into it at most.
            "super" if supers >= file.depth() && path.len() > supers => {
                uses.push((line, path[supers].to_owned()));
            }
            _ => {}
        }
    }
    uses
}

#[test]
fn a_stage_uses_only_what_its_arrows_point_to() {
    check(|file| {
        if file.name == "lib.rs" || file.name.starts_with("bin/") {
            return Vec::new();
        }
        let Some((_, allowed)) = ARROWS.iter().find(|(stage, _)| *stage == file.stage()) else {
            return vec!["1: no arrows are drawn for this folder: add it to ARROWS".to_owned()];
        };
        let known = |name: &str| ARROWS.iter().any(|(stage, _)| *stage == name);
        uses(file)
            .into_iter()
            .filter(|(_, used)| used != file.stage() && !allowed.contains(&used.as_str()))
            .filter(|(_, used)| known(used))
            .map(|(line, used)| format!("{line}: {} must not use {used}", file.stage()))
            .collect()
    });
}

#[test]
fn every_stage_has_its_arrows() {
    let stages: BTreeSet<String> = sources()
        .iter()
        .filter(|file| file.name != "lib.rs" && !file.name.starts_with("bin/"))
        .map(|file| file.stage().to_owned())
        .collect();
    let drawn: BTreeSet<String> = ARROWS.iter().map(|(stage, _)| (*stage).to_owned()).collect();
    assert_eq!(stages, drawn);
}

#[test]
fn only_bin_talks_to_a_person_and_only_serial_to_a_port() {
    check(|file| {
        let mut broken = Vec::new();
        for (line, path) in file.paths() {
            for (word, home) in RESERVED {
                if path[0] == word && !file.name.starts_with(home) {
                    broken.push(format!("{line}: {word} belongs to src/{home}"));
                }
            }
        }
        broken
    });
}

#[test]
fn wire_knows_no_clock_no_thread_and_no_device() {
    check(|file| {
        if file.stage() != "wire" {
            return Vec::new();
        }
        let forbidden = |path: &[&str]| {
            NOT_IN_WIRE.iter().any(|name| {
                name.split("::").eq(path.iter().take(name.split("::").count()).copied())
            })
        };
        file.paths()
            .into_iter()
            .filter(|(_, path)| forbidden(path))
            .map(|(line, path)| format!("{line}: {}", path.join("::")))
            .collect()
    });
}

#[test]
fn numbers_are_the_same_on_every_computer() {
    check(|file| {
        let calls = (1..file.tokens.len()).filter(|at| {
            let is_method = file.text(at - 1) == ".";
            (is_method || (file.text(at - 1) == "::" && file.text(at - 2) == "f64"))
                && NOT_THE_SYSTEMS.contains(&file.text(*at))
                && (!is_method || file.text(at + 1) == "(")
        });
        let broken = calls.map(|at| &file.tokens[at]);
        broken.map(|token| format!("{}: {}: take that of libm", token.line, token.text)).collect()
    });
}

#[test]
fn files_and_functions_keep_their_size_and_say_what_they_are() {
    check(|file| {
        let mut broken = Vec::new();
        if file.lines > FILE_MAX_LINES {
            broken.push(format!("1: {} lines, at most {FILE_MAX_LINES}", file.lines));
        }
        if !file.begins_with_header {
            broken.push("1: the file's header (//!) is missing".to_owned());
        }
        let long = file.functions().into_iter().filter(|(_, _, lines)| *lines > FUNCTION_MAX_LINES);
        broken.extend(long.map(|(name, line, lines)| {
            format!("{line}: fn {name} has {lines} lines, at most {FUNCTION_MAX_LINES}")
        }));
        broken
    });
}

#[test]
fn tests_and_benchmarks_keep_their_size_too() {
    for folder in ["tests", "benches"] {
        let files = files_of(folder);
        let long: Vec<_> = files.iter().filter(|file| file.lines > FILE_MAX_LINES).collect();
        let told = long.iter().map(|file| format!("{folder}/{}: {} lines", file.name, file.lines));
        assert!(!files.is_empty() && long.is_empty(), "{}", told.collect::<Vec<_>>().join("\n"));
    }
}

#[test]
fn the_reader_of_sources_sees_what_it_must() {
    let text = r##"//! Header with crate::plan::Nothing
        use crate::{base::{Axis, machine::Bus as B}, gcode};
        use std::{fs, io::{self, Read as _}};
        fn one<'a>(x: &'a str, y: [u8; 2]) -> char {
            println!("crate::verify {x}"); // crate::wire
            let c = ['\'', '{', '"'];
            super::super::plan::go(b"{", r#"a "crate::step" {"#);
            if c[0] != 'x' { 'a' } else { 'b' }
        }
        trait T { fn none(&self) -> u8; }
    "##;
    let file = File {
        name: "gcode/lexer.rs".into(),
        lines: 0,
        begins_with_header: true,
        tokens: tokens(text),
    };
    let used: Vec<String> = uses(&file).into_iter().map(|(_, used)| used).collect();
    assert_eq!(used, ["base", "base", "gcode", "plan"]);
    let paths: Vec<String> = file.paths().iter().map(|(_, path)| path.join("::")).collect();
    for path in ["std::fs", "std::io::self", "std::io::Read", "println!"] {
        assert!(paths.iter().any(|found| found == path), "{path} in {paths:?}");
    }
    assert_eq!(file.functions(), [("one", 4, 6)]);
}
