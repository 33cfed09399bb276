//! `cnc send --resume`: whatever a program has in force where it was cut, the rest is the rest of its plan;
//! what cannot be gone on with is refused. On simulated nodes.

mod bench;

use std::fs;
use std::process::Output;

use bench::Bench;
use serde_json::Value;

/// A folder with a program and a tool table.
fn bench(program: &str) -> Bench {
    let bench = Bench::new(program, "starmill");
    fs::write(bench.path("tools.csv"), "tool,Z,diameter\n1,7.5,4\n2,-3,6\n").unwrap();
    bench
}

#[track_caller]
fn send(bench: &Bench, port: &str, file: &str, args: &[&str], code: i32, says: &str) -> Output {
    let send = ["send", port, file, "--ignore-stops", "--json", "--journal", "journal"];
    bench.cnc(&[&send, args].concat(), code, says)
}

fn result(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap()
}

/// What is in force where the job is cut, with what options it is sent.
const IN_FORCE: [(&str, &[&str]); 12] = [
    ("G92 X5 Y5\nG1 X20 Y-3\nX-20\nX0", &[]),
    ("G52 X5 Z1\nG1 X20\nG52 X-5\nX-20\nX0\nG52 X0 Z0", &[]),
    ("G10 L2 P2 X77 Y51 Z50\nG55 G1 X20\nX-20\nG54 X0", &[]),
    ("G68 X0 Y0 R30\nG1 X20\nX-20\nX0\nG69", &[]),
    ("G91 G1 X20\nG20 X-1\nG21 X-10\nG90 X0", &[]),
    ("G93 G1 X20 F7\nX-20 F4\nG94 F150\nX0", &[]),
    ("G18 G2 X20 Z-1 I10 K0\nG3 X0 Z-1 I-10 K0\nG17 G64 P0.1\nG1 X-20 Y5\nX0 Y0", &[]),
    ("G41 D1 G1 X5 Y5\nX20\nY20\nX5\nY5\nG40 X0 Y0", &["--tools", "tools.csv"]),
    ("T1 M6 G43 H1\nG1 X20 Z1\nX-20\nT2 M6 G43 H2\nG1 X0 Z2\nG49", &["--tools", "tools.csv"]),
    ("G98 G81 X10 Y0 Z-5 R2 F60\nX20\nX-20\nX-10 Y10\nG80 F150\nG1 X0 Y0", &[]),
    ("o1 while [#1 LT 3]\n#1=[#1+1]\nG1 X[#1*7] Y#1\nX0\no1 endwhile", &[]),
    ("o2 sub\nG1 X#1\nX#2\no2 endsub\no2 call [20] [-20]\no2 call [9] [0]", &[]),
];

#[test]
fn whatever_is_in_force_the_rest_is_the_rest_of_the_plan() {
    for (part, options) in IN_FORCE {
        // Subprograms come first.
        let (subs, part) = part.split_once("endsub\n").unwrap_or(("", part));
        let end = if subs.is_empty() { "" } else { "endsub" };
        let program = format!(
            "G21 G90 G17 G94 F150\n{subs}{end}\nM3 S900\nG1 Z-1\nX15\nX0\n{part}\nG1 Z3\nX15 Y2\nX0 Y0\nM30\n"
        );
        let bench = bench(&program);
        let whole =
            result(&send(&bench, "sim:", "part.nc", options, 0, "executed what was planned"));
        assert!(whole["buffers"].as_u64().unwrap() > 2, "{part:?}");
        for cut in [2000] {
            fs::remove_file(bench.path("journal")).unwrap();
            let port = format!("sim:faults=dead:X@tick.{cut}");
            send(&bench, &port, "part.nc", options, 3, "did not answer");
            let resume = ["--resume", "journal", "--at", "11,22,33", "--yes", "--trace", "trace"];
            let resume = [&resume[..], options].concat();
            let last = send(&bench, "sim:", "part.nc", &resume, 0, "goes on from its last seam");
            let last = result(&last);
            assert_eq!(last["executed_as_planned"], true);
            for axis in ["X", "Y", "Z"] {
                assert_eq!(last["axes"][axis]["steps"], whole["axes"][axis]["steps"], "{part:?}");
            }
            // The same from the trace and the program alone.
            let replay = [&["replay", "trace", "part.nc"], options].concat();
            bench.cnc(&replay, 0, "same");
        }
    }
}

/// Long enough for several buffers, with a hole of some kind in the middle.
fn with_hole(cycle: &str) -> String {
    format!(
        "G21 G90 F150 M3 S100\nG0 Z5\nG1 X15\nX0\n{cycle} X10 Y0 Z-38 R2 F100\nG80\nG0 Z5\nG1 X15\nX0\nM30\n"
    )
}

#[test]
fn a_tap_is_not_put_back_into_its_thread() {
    for (cycle, cut, is_free) in [("G84", 1500, true), ("G84", 3000, false), ("G81", 3000, true)] {
        let bench = bench(&with_hole(cycle));
        send(
            &bench,
            &format!("sim:faults=close@tick.{cut}"),
            "part.nc",
            &[],
            3,
            "the port is gone",
        );
        let resume = ["send", "sim:", "part.nc", "--resume", "journal", "--dry-run"];
        match is_free {
            true => bench.cnc(&resume, 0, "safe for the bus"),
            false => bench.cnc(&resume, 1, "cannot be put back there from above"),
        };
    }
}

#[test]
fn the_rest_of_a_dump_is_what_the_person_sees_to() {
    let bench = bench(&with_hole("G81"));
    bench.cnc(&["interpolate", "part.nc", "--csv", "-o", "part.csv"], 0, "");
    send(&bench, "sim:faults=dead:X@tick.4000", "part.csv", &[], 3, "did not answer");
    let resume = ["--resume", "journal", "--yes", "--trace", "trace"];
    send(&bench, "sim:", "part.csv", &resume, 0, "a dump does not tell what line");
    bench.cnc(&["replay", "trace", "part.csv"], 0, "same");
}

/// The start of a job that is gone on with is that of the whole one, wherever the axes stand by then.
#[test]
fn the_start_of_the_whole_job_is_in_the_journal() {
    let bench = bench("G21 G90 F150\nG1 X15\nX0\nX15\nX0\nM30\n");
    let port = "sim:faults=dead:X@tick.2100";
    send(&bench, port, "part.nc", &["--start", "70.5,50,50"], 3, "did not answer");
    let resume = ["--resume", "journal", "--at", "1,2,3", "--yes", "--trace", "trace"];
    send(&bench, "sim:", "part.nc", &resume, 0, "goes on from its last seam");
    bench.cnc(&["replay", "trace", "part.nc"], 0, "same");
}
