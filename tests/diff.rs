//! `cnc diff` through its binary: what is the same, what differs, and by how much.

use std::process::{Command, Stdio};

use serde_json::Value;
use tempfile::TempDir;

const PLANES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/good/planes.nc");
const O001: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/good/o001.nc");

struct Bench(TempDir);

impl Bench {
    /// A folder with a few dumps.
    fn new() -> Bench {
        let bench = Bench(tempfile::tempdir().unwrap());
        for (name, args) in [
            ("planes.csv", &[PLANES][..]),
            ("bytes.csv", &[PLANES, "--encoding", "bytes"]),
            ("slow.csv", &[PLANES, "--override", "50%"]),
            ("thesis.csv", &[PLANES, "--encoder", "thesis"]),
            ("shifted.csv", &[PLANES, "--start", "76,50,50"]),
            ("router.csv", &[O001, "-m", "router"]),
        ] {
            bench.cnc(&[&["interpolate", "--csv", "-q", "-o", name], args].concat(), 0, "");
        }
        bench
    }

    #[track_caller]
    fn cnc(&self, args: &[&str], code: i32, says: &str) -> String {
        let mut process = Command::new(env!("CARGO_BIN_EXE_cnc"));
        process.env_remove("CNC_MACHINE").stdin(Stdio::null()).current_dir(&self.0);
        let output = process.args(args).output().unwrap();
        let said = String::from_utf8([&output.stderr[..], &output.stdout].concat()).unwrap();
        assert_eq!(output.status.code(), Some(code), "{args:?}: {said}");
        assert!(said.contains(says), "{args:?}: expected '{says}': {said}");
        said
    }
}

#[test]
fn what_differs_is_told_in_machine_terms() {
    let bench = Bench::new();
    let diff = |args: &[&str], code, says| bench.cnc(&[&["diff"], args].concat(), code, says);
    diff(&["planes.csv", "planes.csv"], 0, "ticks     the same");
    diff(&["planes.csv", "bytes.csv"], 0, "ticks     the same");
    diff(&[PLANES, "planes.csv"], 0, "ticks     the same");
    diff(&["slow.csv", PLANES, "--override", "50%"], 0, "ticks     the same");
    diff(&["planes.csv", "slow.csv"], 1, "first     tick ");
    diff(&["planes.csv", "slow.csv", "--tolerance", "0.02"], 0, "tolerance 0.02 mm");
    diff(&["planes.csv", "slow.csv", "--tolerance", "0.001"], 1, "apart");
    diff(&["planes.csv", "thesis.csv", "--tolerance", "5"], 1, "end       B ends +4 steps of X");
    diff(&["planes.csv", "shifted.csv"], 1, "apart     1.000");
    let [on, off] = ["M3 S100\nG1 X1 F300\nM30\n", "M4 S100\nG1 X1 F300\nM30\n"];
    std::fs::write(bench.0.path().join("on.nc"), on).unwrap();
    std::fs::write(bench.0.path().join("off.nc"), off).unwrap();
    diff(&["on.nc", "off.nc", "--tolerance", "100"], 1, "A M3 S100 (line 1), B M4 S100 (line 1)");
    diff(&["on.nc", "off.nc", "--tolerance", "100"], 1, "events    not the same");
    let json = diff(&["planes.csv", "slow.csv", "--json"], 1, "");
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["schema"], 1);
    assert_eq!(json["same"], false);
    assert_eq!(json["end_difference_steps"]["X"], 0);
    assert!(json["max_distance_mm"].as_f64().unwrap() < 0.02);
    assert!(json["max_distance_resolution_mm"].as_f64().unwrap() < 1e-4);
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let bench = Bench::new();
    let diff = |args: &[&str], code, says| bench.cnc(&[&["diff"], args].concat(), code, says);
    diff(&["planes.csv", "router.csv"], 1, "made for machine 'router', not for 'starmill'");
    diff(&["planes.csv", "nowhere.csv"], 2, "nowhere.csv");
    diff(&["planes.csv", "slow.csv", "--tolerance=-1"], 2, "from 0 to 1000 mm");
    diff(&["-", "-"], 2, "standard input cannot be both");
    let text = std::fs::read_to_string(bench.0.path().join("planes.csv")).unwrap();
    let broken = text.replacen("100,0,", "101,0,", 1);
    std::fs::write(bench.0.path().join("broken.csv"), broken).unwrap();
    diff(&["planes.csv", "broken.csv"], 1, "broken.csv");
}
