//! M, S and T functions by handshake: the signals of seed 001's figures 10 and 12, and what is missing.

mod bench;
mod pty;

use std::fs;

use bench::Bench;
use cnc::systems::plc::{Function, Missing, Nc, Plc, PlcFault, Sample, Times, functions};
use proptest::prelude::*;
use pty::Node;

/// TMF and TFIN of the experiment of fig. 12, in microseconds.
const TIMES: Times = Times { tmf_us: 30_000, tfin_us: 30_000, timeout_us: 1_000_000 };

fn function(text: &str) -> Function {
    text.parse().unwrap()
}

/// A function between a control and a PLC, in steps of a millisecond: each change as `t code strobe den fin`.
/// The block moves until `moves_until_ms`, if it does.
fn changes(
    text: &str,
    acts_us: u64,
    moves_until_ms: Option<u64>,
    fault: Option<PlcFault>,
) -> (Vec<String>, Result<(), Missing>) {
    let (mut nc, mut plc) = (Nc::new(TIMES), Plc::new(acts_us, fault.into_iter().collect()));
    nc.begin(0, function(text), moves_until_ms.is_some());
    let (mut rows, mut last) = (Vec::new(), Sample::default());
    for ms in 0..10_000 {
        let now_us = ms * 1000;
        if moves_until_ms == Some(ms) {
            nc.motion_ends(now_us);
        }
        nc.hear(now_us, plc.fin());
        let advanced = nc.advance(now_us);
        plc.hear(now_us, nc.signals());
        let now = Sample { nc: nc.signals(), fin: nc.fin(), ..last };
        if now != last || ms == 0 {
            let code = now.nc.function.map_or("-".to_owned(), |function| function.to_string());
            let [strobe, den, fin] = [now.nc.strobe, now.nc.den, now.fin].map(u8::from);
            rows.push(format!("{ms} {code} {strobe} {den} {fin}"));
            last = now;
        }
        if advanced.is_err() || nc.is_done() {
            return (rows, advanced);
        }
    }
    panic!("{text} has no end: {rows:?}");
}

#[track_caller]
fn check(text: &str, acts_ms: u64, moves_until_ms: Option<u64>, expected: &[&str]) {
    let (rows, end) = changes(text, acts_ms * 1000, moves_until_ms, None);
    assert_eq!(rows, expected);
    assert_eq!(end, Ok(()));
}

/// Fig. 10 a and fig. 12: code, strobe after TMF, FIN, strobe off after TFIN, FIN off, code off. A
/// millisecond lies between a level and its answer.
#[test]
fn a_function_alone_in_its_block() {
    check(
        "M8",
        40,
        None,
        &["0 M8 0 1 0", "30 M8 1 1 0", "71 M8 1 1 1", "101 M8 0 1 1", "102 - 0 0 0"],
    );
    check(
        "S1200",
        0,
        None,
        &["0 S1200 0 1 0", "30 S1200 1 1 0", "31 S1200 1 1 1", "61 S1200 0 1 1", "62 - 0 0 0"],
    );
}

/// Fig. 10 b: the strobe comes while the block moves, DEN when that is over.
#[test]
fn a_function_with_motion_in_its_block() {
    // M30 waits for DEN.
    check(
        "M30",
        40,
        Some(500),
        &[
            "0 M30 0 0 0",
            "30 M30 1 0 0",
            "500 M30 1 1 0",
            "541 M30 1 1 1",
            "571 M30 0 1 1",
            "572 - 0 0 0",
        ],
    );
    // M8 does not.
    check(
        "M8",
        40,
        Some(500),
        &["0 M8 0 0 0", "30 M8 1 0 0", "71 M8 1 0 1", "101 M8 0 0 1", "102 - 0 0 0"],
    );
}

#[test]
fn a_signal_that_is_missing_is_named() {
    let said = |text: &str, moves: Option<u64>, fault: fn(Function) -> PlcFault| {
        let (_, end) = changes(text, 40_000, moves, Some(fault(function(text))));
        end.unwrap_err().to_string()
    };
    let silent = said("M8", None, PlcFault::Silent);
    assert!(
        silent.starts_with("FIN is missing: M8 has stood with MF and DEN for 1.000 s"),
        "{silent}"
    );
    let stuck = said("T2", None, PlcFault::Stuck);
    assert!(stuck.starts_with("FIN does not end: TF of T2 has been off for 1.000 s"), "{stuck}");
    // Nothing is missing while the block still moves, here for two seconds.
    let (rows, end) = changes("M0", 40_000, Some(2000), Some(PlcFault::Silent(function("M0"))));
    assert_eq!(rows, ["0 M0 0 0 0", "30 M0 1 0 0", "2000 M0 1 1 0"]);
    assert!(matches!(end, Err(Missing::Fin { waited_us: 1_000_000, .. })));
    let mut nc = Nc::new(TIMES);
    nc.hear(0, true);
    nc.begin(0, function("M8"), false);
    assert_eq!((nc.advance(30_000), nc.signals().strobe), (Ok(()), false));
    let early = nc.advance(1_030_000).unwrap_err().to_string();
    assert!(early.starts_with("FIN is on before MF of M8"), "{early}");
}

/// What TFIN is for: a FIN that bounces is not taken before it stands.
#[test]
fn a_fin_that_bounces_has_to_stand() {
    let mut nc = Nc::new(TIMES);
    nc.begin(0, function("M8"), false);
    for ms in 0..120 {
        // From 50 ms on it is on for 9 ms in 10, from 71 ms on all the time.
        nc.hear(ms * 1000, ms >= 71 || (ms >= 50 && ms % 10 != 0));
        assert_eq!(nc.advance(ms * 1000), Ok(()));
        assert_eq!(nc.signals().strobe, (30..101).contains(&ms), "{ms}");
    }
}

#[test]
fn an_event_is_given_as_codes() {
    let codes = |event: &str| {
        let list = functions(event.parse().unwrap())?;
        Ok::<_, String>(list.iter().map(ToString::to_string).collect::<Vec<_>>().join(" "))
    };
    for (event, expected) in [
        ("M3 S1200", "S1200 M3"),
        ("M6 T2", "T2 M6"),
        ("M8", "M8"),
        ("S800", "S800"),
        ("T7", "T7"),
        ("G4 P1", ""),
    ] {
        assert_eq!(codes(event).as_deref(), Ok(expected));
    }
    for event in ["M64 P1", "G96 S200", "M66 P1 L3 Q2", "S12.5"] {
        assert!(codes(event).is_err(), "{event}");
    }
}

proptest! {
    /// Whatever the delays, the strobe comes TMF behind the code and goes TFIN behind FIN, nothing is done
    /// before FIN has come and gone, and never while FIN was there before.
    #[test]
    fn no_order_of_signals_is_skipped(
        tmf_ms in 1..1000_u64, tfin_ms in 1..1000_u64, acts_ms in 0..2000_u64, moves_ms in 0..3000_u64,
    ) {
        let times = Times { tmf_us: tmf_ms * 1000, tfin_us: tfin_ms * 1000, timeout_us: 5_000_000 };
        let (mut nc, mut plc) = (Nc::new(times), Plc::new(acts_ms * 1000, Vec::new()));
        nc.begin(0, function("M5"), moves_ms > 0);
        let (mut strobe_ms, mut fin_ms, mut off_ms) = (None, None, None);
        for ms in 0..10_000 {
            if ms == moves_ms {
                nc.motion_ends(ms * 1000);
            }
            nc.hear(ms * 1000, plc.fin());
            prop_assert_eq!(nc.advance(ms * 1000), Ok(()));
            plc.hear(ms * 1000, nc.signals());
            if nc.signals().strobe {
                strobe_ms = strobe_ms.or(Some(ms));
            } else if strobe_ms.is_some() {
                off_ms = off_ms.or(Some(ms));
            }
            if nc.fin() {
                fin_ms = fin_ms.or(Some(ms));
            }
            if nc.is_done() {
                break;
            }
        }
        prop_assert!(nc.is_done() && !nc.fin());
        prop_assert_eq!(strobe_ms, Some(tmf_ms));
        prop_assert_eq!(fin_ms, Some(tmf_ms.max(moves_ms) + acts_ms + 1));
        prop_assert_eq!(off_ms, fin_ms.map(|ms| ms + tfin_ms));
    }
}

const PROGRAM: &str = "G21 G90 F600\nM6 T2\nM3 S1000\nG1 X5 Y3\nM8\nG1 X0 Y0 M0\nM30\n";

#[test]
fn a_program_is_sent_with_a_plc() {
    let bench = Bench::new(PROGRAM, "starmill");
    let sim = ["send", "sim:", "part.nc", "--ignore-stops", "--plc", "sim:"];
    let signals = [&sim[..], &["--signals", "signals.csv", "--svg", "signals.svg"]].concat();
    bench.cnc(&signals, 0, "and that is the program's path");
    let rows = fs::read_to_string(bench.path("signals.csv")).unwrap();
    let drawing = fs::read_to_string(bench.path("signals.svg")).unwrap();
    assert_eq!(drawing.matches(">TMF<").count(), 7);
    assert_eq!(drawing.matches(">TFIN<").count(), 7);
    bench.cnc(&["plot", "--timing", "signals.csv", "-o", "again.svg"], 0, "");
    let again = fs::read_to_string(bench.path("again.svg")).unwrap();
    assert_eq!(again.replace("signals.csv", "part.nc"), drawing);
    bench.cnc(&["plot", "--timing", "part.nc"], 1, "no record of signals");
    let codes: Vec<&str> = rows
        .lines()
        .filter(|row| row.split(',').nth(3) == Some("1"))
        .filter_map(|row| row.split(',').nth(2))
        .collect();
    let mut strobes = codes;
    strobes.dedup();
    assert_eq!(strobes, ["T2", "M6", "S1000", "M3", "M8", "M0", "M30"]);
    // M0 has motion in its block: its strobe is there before DEN is, while the axes move.
    assert!(rows.lines().any(|row| row.ends_with("6,M0,1,0,0,1")), "{rows}");
    assert!(rows.lines().any(|row| row.ends_with("6,M0,1,1,0,0")), "{rows}");
    bench.cnc(&["send", "sim:", "-e", "M64 P1", "--plc", "sim:"], 1, "no further words");
    bench.cnc(&["send", "sim:", "part.nc", "--plc", "nowhere"], 1, "waits for a person");
    let nowhere = ["send", "sim:", "part.nc", "--plc", "nowhere", "--ignore-stops"];
    bench.cnc(&nowhere, 3, "there is no port nowhere");
    let real = ["send", "/dev/null", "part.nc", "--ignore-stops", "--plc", "sim:"];
    bench.cnc(&real, 2, "it is for virtual nodes");
    let hooks = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/machines/hooks.toml");
    bench.cnc(&[&sim[..], &["-m", hooks]].concat(), 2, "one of them has to do it");
}

#[test]
fn a_plc_that_does_not_answer_stops_the_job_at_rest() {
    let profile = cnc::base::Machine::load("starmill").unwrap().to_toml().to_owned();
    let bench = Bench::new(PROGRAM, "machine.toml");
    let plc = "\n[plc]\ntmf_ms = 2\ntfin_ms = 2\ntimeout_s = 0.2\n";
    fs::write(bench.path("machine.toml"), profile + plc).unwrap();
    for (fault, says) in [
        (["--silent", "M8"], "line 5: M8: FIN is missing: M8 has stood with MF and DEN for 0.2"),
        (["--stuck", "M3"], "line 3: M3 S1000: FIN does not end: MF of M3 has been off for 0.2"),
    ] {
        let node = Node::start(&[&["--plc", "--acts", "1"], &fault[..]].concat());
        let send =
            ["send", "sim:", "part.nc", "--ignore-stops", "--plc", node.pty.to_str().unwrap()];
        let output = bench.cnc(&send, 3, says);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(
            said.contains("may still be on: M6 T2 of line 2, which the PLC has done"),
            "{said}"
        );
        assert!(
            said.contains("X at 75.000 mm (step 7500), known")
                || said.contains("step 8000), known"),
            "{said}"
        );
    }
    let node = Node::start(&["--plc", "--acts", "1"]);
    let send = ["send", "sim:", "part.nc", "--ignore-stops", "--plc", node.pty.to_str().unwrap()];
    bench.cnc(&send, 0, "the nodes executed what was planned");
}
