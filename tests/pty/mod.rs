//! `cnc node` as the peer of a test.

use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

/// `cnc node`, ended when dropped.
pub struct Node {
    pub child: Child,
    pub pty: PathBuf,
}

impl Node {
    pub fn start(args: &[&str]) -> Node {
        let mut process = Command::new(env!("CARGO_BIN_EXE_cnc"));
        process.env_remove("CNC_MACHINE").stdin(Stdio::null());
        process.arg("node").args(args).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = process.spawn().unwrap();
        let mut name = String::new();
        BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut name).unwrap();
        Node { child, pty: PathBuf::from(name.trim_end()) }
    }
}

impl Drop for Node {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
