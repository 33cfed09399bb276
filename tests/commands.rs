//! docs/commands.md: what every command says of itself. `UPDATE=1 cargo test --test commands` writes it anew.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

/// What a command prints with `--help`.
fn help(path: &[&str]) -> String {
    let mut process = Command::new(env!("CARGO_BIN_EXE_cnc"));
    process.env_remove("CNC_MACHINE").env_remove("COLUMNS").env("NO_COLOR", "1");
    let output = process.args(path).arg("--help").output().unwrap();
    assert!(output.status.success(), "{path:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// The commands below one, in the order of its help.
fn commands(help: &str) -> Vec<String> {
    let list = help.split("\nCommands:\n").nth(1).unwrap_or_default();
    let rows = list.lines().take_while(|line| line.starts_with("  "));
    let names =
        rows.filter(|row| !row.starts_with("   ")).filter_map(|row| row.split_whitespace().next());
    names.filter(|name| *name != "help").map(str::to_owned).collect()
}

fn describe(text: &mut String, path: &[&str]) {
    let help = help(path);
    let name = ["cnc"].iter().chain(path).copied().collect::<Vec<_>>().join(" ");
    let trimmed: Vec<&str> = help.lines().map(str::trim_end).collect();
    write!(text, "\n## {name}\n\n```text\n{}\n```\n", trimmed.join("\n").trim_end()).unwrap();
    for command in commands(&help) {
        describe(text, &[path, &[command.as_str()]].concat());
    }
}

#[test]
fn the_manual_has_what_the_commands_say() {
    let mut text = String::from(
        "# Commands\n\nWhat each command says with `--help`, as it is; made by `UPDATE=1 cargo test --test commands`.\n",
    );
    describe(&mut text, &[]);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/commands.md");
    if std::env::var_os("UPDATE").is_some() {
        fs::write(&path, &text).unwrap();
    }
    let is_same = fs::read_to_string(path).is_ok_and(|held| held == text);
    assert!(is_same, "docs/commands.md is of another time: UPDATE=1 cargo test --test commands");
    for command in ["\n## cnc interpret\n", "\n## cnc machine show\n", "\n## cnc send\n"] {
        assert!(text.contains(command), "{command}");
    }
}
