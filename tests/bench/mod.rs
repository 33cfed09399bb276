//! A folder with a program, and the command run in it.

use std::fs;
use std::path::PathBuf;
use std::process::{Command as Process, Output, Stdio};

use tempfile::TempDir;

/// The folder, and the machine that commands are run for.
pub struct Bench {
    folder: TempDir,
    machine: &'static str,
}

impl Bench {
    /// With a program, `part.nc`.
    pub fn new(program: &str, machine: &'static str) -> Bench {
        let bench = Bench { folder: TempDir::new().unwrap(), machine };
        fs::write(bench.path("part.nc"), program).unwrap();
        bench
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Runs a command, which has to end with a code and to say something.
    #[track_caller]
    pub fn cnc(&self, args: &[&str], code: i32, says: &str) -> Output {
        let mut process = Process::new(env!("CARGO_BIN_EXE_cnc"));
        process.env("CNC_MACHINE", self.machine).stdin(Stdio::null()).current_dir(&self.folder);
        let output = process.args(args).output().unwrap();
        let said = [&output.stderr[..], &output.stdout].concat();
        let said = String::from_utf8_lossy(&said);
        assert_eq!(output.status.code(), Some(code), "{args:?}: {said}");
        assert!(said.contains(says), "{args:?}: expected '{says}': {said}");
        output
    }
}
