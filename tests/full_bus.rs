//! A bus with all the nodes that it can carry: axes beyond X Y Z from the program to the replay.

mod bench;

use bench::Bench;

const PROFILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/machines/full-bus.toml");

/// Every axis, alone and with others; several buffers.
const PROGRAM: &str = "G21 G90 F900\nG1 X5 A20\nB-15 C30 Y4\nX0 A0\nB0 C0 Y0\nG4 P0.2\nU5 V5 W-5\n\
    A-30 F600\nA0\nX20 F200\nX0\nX20\nX0 U0\nA5 B5 V0 W0\nA0 B0\nM30\n";

#[test]
fn fifteen_nodes_are_proved_and_run() {
    let bench = Bench::new(PROGRAM, PROFILE);
    bench.cnc(&["send", "sim:", "part.nc", "--dry-run"], 0, "15 nodes on the bus");
    bench.cnc(&["send", "sim:", "part.nc"], 0, "and that is the program's path");
    let cut = ["send", "sim:faults=close@tick.2500", "part.nc", "--journal", "journal"];
    bench.cnc(&cut, 3, "the port is gone");
    let stands = ["--at", "1,2,3,4,5,6,7,8,9", "--resume", "journal"];
    let on = ["--yes", "--trace", "trace"];
    let resume = [&["send", "sim:", "part.nc"], &stands[..], &on].concat();
    bench.cnc(&resume, 0, "A to 0.000, B to 0.000, C to 0.000, U to 5.000");
    bench.cnc(&["replay", "trace", "part.nc"], 0, "same");
}

#[test]
fn any_axis_is_jogged_and_homed() {
    let bench = Bench::new("", PROFILE);
    bench.cnc(&["jog", "sim:", "C", "--by", "-12.5", "--from", "20"], 0, "C at 7.500 °");
    bench.cnc(
        &["home", "sim:", "A", "--measured-tick", "100000", "--start", "0,0,0,30"],
        0,
        "which agrees",
    );
}

/// X, Y and Z have a limit on jerk here, and the others have none.
#[test]
fn a_program_of_rotary_axes_alone_is_planned_and_verified() {
    for program in
        ["G1 A-30 F600\nM30\n", "G1 A5 F900\nA5.01\nA0\nM5\nM30\n", "G0 B7 C-3\nG1 X3 F300\nM30\n"]
    {
        let bench = Bench::new(program, PROFILE);
        bench.cnc(&["interpolate", "part.nc", "--csv", "-o", "part.csv"], 0, "");
        bench.cnc(&["verify", "part.nc", "part.csv"], 0, "pass");
    }
}
