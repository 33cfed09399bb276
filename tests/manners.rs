//! What a shell and a manual reader get from the binary: completions and pages for every command.

use std::fs;
use std::process::{Command, Stdio};

const COMMANDS: [&str; 6] = ["interpret", "interpolate", "verify", "send", "plot", "report"];

fn cnc(args: &[&str]) -> String {
    let mut process = Command::new(env!("CARGO_BIN_EXE_cnc"));
    let output = process.stdin(Stdio::null()).args(args).output().unwrap();
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn every_shell_has_its_completions() {
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = cnc(&["completions", shell]);
        for command in COMMANDS {
            assert!(script.contains(command), "{shell}: {command}");
        }
    }
}

#[test]
fn every_command_has_its_page() {
    let folder = tempfile::tempdir().unwrap();
    cnc(&["man", "-o", folder.path().to_str().unwrap()]);
    for command in COMMANDS {
        let page = fs::read_to_string(folder.path().join(format!("cnc-{command}.1"))).unwrap();
        assert!(page.contains(".SH SYNOPSIS"), "{command}");
    }
    assert!(cnc(&["man"]).contains(".TH cnc 1"));
}
