//! Cycles of lathes, pecks and probes: which words are refused, and where the others lead.

use cnc::base::{Axis, Machine, Source};
use cnc::interp::{self, Checked, Dialect, Motion, MoveKind, Options};

fn ideal() -> Machine {
    Machine::load("ideal").unwrap()
}

fn check(text: &str, dialect: Dialect) -> Checked {
    let source = Source::memory("test.nc", text.as_bytes());
    interp::check(&source, &ideal(), &Options { dialect, ..Options::default() }, 1000).unwrap()
}

/// A peck that is not above 0 is reported once, and the holes that follow still end.
#[test]
fn holes_end_after_a_peck_that_is_refused() {
    for q in ["0", "-1"] {
        let text = format!("S100 M3\nG83 X1 Z-5 R1 Q{q} F100\nX2\nM30");
        let checked = check(&text, Dialect::Iso);
        let found: Vec<_> = checked.diagnostics.iter().map(|found| found.rule).collect();
        assert!(found.contains(&"bad-value"), "{found:?}");
    }
}

/// FANUC-style lathes: what is wrong, on the ideal machine.
#[test]
fn lathe_programs_are_refused_at_the_right_word() {
    for (text, expected) in [
        ("G0 X5 U2\nM30", &["repeated-word 1:7"][..]),
        ("G91 X5\nM30", &["unsupported-word 1:1"]),
        // The axis words of blocks in the force of a code that is not supported.
        ("G81 X1 Z-3 K1\nX2 Y2 Q1\nX500\nG80\nM30", &["unsupported-word 1:1"]),
        ("S9 M3 F.1\nG75 R1\nG75 X4 Z-3 P100\nM30", &["missing-word 3:1"]),
        ("S9 M3 F.1\nG75 X4 P0\nM30", &["bad-value 2:8"]),
        ("S9 M3 F.1\nG74 R1\nG74 X4 P1000\nM30", &["missing-word 3:1"]),
        ("S9 M3 F.1\nG74 Z-30 Q1\nM30", &["bad-value 2:1"]),
        ("S9 M3 F.1\nG74\nM30", &["missing-word 2:1"]),
        ("S9 M3 F.1\nG83 X4 R-1\nM30", &["missing-word 2:1"]),
        ("S9 M3 F.1\nG83 Z-4 R1\nM30", &["cycle-level 2:1"]),
        ("S9 M3 F.1\nG83 Z-4 R-5\nM30", &["cycle-level 2:1"]),
        ("S9 M3 F.1\nG83 Z-30 Q1\nM30", &["bad-value 2:1"]),
        ("S9 F1\nG98\nF1 G84 Z-4\nM30", &["spindle-stopped 3:1"]),
        ("S9 M3 F.1\nG85 Z-4 Q1\nM30", &["unused-word 2:9"]),
        ("S9 M3 F.1\nG0 X9\nG71 P1 Q2 I1\nN1 X5\nN2 Z-5\nM30", &["unused-word 3:11"]),
        ("G50\nM30", &["missing-word 1:1"]),
        ("G1 X5 F.1\nM30", &["no-spindle-speed 1:1"]),
        ("G96 S100 M3\nG32 Z-5 F1\nM30", &["no-spindle-speed 2:1"]),
        ("S9 M3\nG32 Z-5\nM30", &["missing-word 2:1"]),
        ("S9 M3 F.1\nG90 X5\nM30", &["missing-word 2:1"]),
        ("S9 M3 F.1\nG71 P1 Q2\nN1 G0 X5\nN2 Z-5\nM30", &["missing-word 2:1"]),
        ("S9 M3 F.1\nG0 X9 Z1\nG71 U1\nG71 P1 Q3\nN1 G0 X5\nN2 Z-5\nM30", &["unknown-label 4:1"]),
        (
            "S9 M3 F.1\nG0 X9 Z1\nG71 U1\nG71 P1 Q2\nN1 G0 X5\nG1 Z-5\nX6 Z-3\nN2 X9 Z-9\nM30",
            &["contour 4:1"],
        ),
        ("S9 M3 F.1\nG0 X9 Z1\nG70 P2 Q1\nN1 G0 X5\nN2 Z-5\nM30", &["unknown-label 3:1"]),
        (
            "S9 M3 F.1\nG0 X9 Z1\nG71 U1\nG71 P1 Q2\nN1 G0 X5\nM98 P3\nN2 X9 Z-9\nM30",
            &["contour 6:1"],
        ),
        ("S9 M3\nG0 X9\nG76 P010060\nG76 X7 Z-9 P0 Q100 F1\nM30", &["bad-value 4:12"]),
        // No block before has said how threads are cut.
        ("S9 M3\nG0 X9\nG76 X7 Z-9 P500 Q100 F1\nM30", &["missing-word 3:1"]),
        ("S9 M3\nG0 X9\nG76 X7 Z-9 K1 F1\nM30", &["missing-word 3:1"]),
        ("S9 M3\nG0 X9\nG76 X7 Z-9 K1 D100 P2 F1\nM30", &["unsupported-word 3:20"]),
        ("S9 M3\nG0 X9\nG76 X7 Z-9 P5000 F1\nM30", &["missing-word 3:1"]),
        ("S9 M3\nG0 X9\nG76 P010060\nG76 X7 P500 Q100 F1\nM30", &["missing-word 4:1"]),
        // A finishing cut deeper than the thread, a pull-out longer than it.
        ("S9 M3\nG0 X9\nG76 P010060 R5.\nG76 X7 Z-9 P500 Q100 F1\nM30", &["bad-value 4:12"]),
        ("S9 M3\nG0 X9\nG76 P019960\nG76 X7 Z-9 P500 Q100 F1\nM30", &["bad-value 4:1"]),
        // F is no lead of a turn about Y.
        ("S9 M3\nG32 B60 F1\nM30", &["bad-value 2:1"]),
    ] {
        let checked = check(text, Dialect::FanucLathe);
        let found: Vec<_> = checked
            .diagnostics
            .iter()
            .map(|found| format!("{} {}:{}", found.rule, found.span.line, found.column()))
            .collect();
        assert_eq!(found, *expected, "{text}");
    }
}

/// Lathe programs, and where they lead: X (machine coordinates, a radius) and Z, feeds.
const WAYS: &[(&str, &[&str])] = &[
    ("G0 X10 Z5\nU-2 W3\nM30", &["5 5", "4 8"]),
    ("G50 X20 Z4\nG0 X0 Z0\nM30", &["-10 -4"]),
    ("G98 G0 X10\nG1 U2 F60\nX20 W-1\nM30", &["5 0", "6 0 60", "10 -1 60"]),
    // 100 m/min at diameter 20, where the move begins, and at most 500 a minute.
    ("G96 S100 M3 F.1\nG0 X20\nG1 X10\nM30", &["10 0", "5 0 159.155"]),
    ("G50 S500\nG96 S100 M3 F.1\nG1 X2\nM30", &["1 0 50"]),
    // A lead of 2 along Z, cut at 45 degrees.
    ("S100 M3\nG32 X4 Z-2 F2\nM30", &["2 -2 282.843"]),
    (
        "S100 M3 F.1\nG0 X20 Z1\nG90 X16 Z-4\nX12\nM30",
        &["10 1", "8 1", "8 -4 10", "10 -4 10", "10 1", "6 1", "6 -4 10", "10 -4 10", "10 1"],
    ),
    (
        "S100 M3 F.1\nG0 X20 Z1\nG94 X8 Z-2 R-1\nM30",
        &["10 1", "10 -3", "4 -2 10", "4 1 10", "10 1"],
    ),
    // What has a point is no thousandth; the first column has no relief.
    (
        "S100 M3 F.1\nG0 X10 Z0\nG75 R.5\nG75 X6 Z-1 P1.5 Q1000 R.2\nM30",
        &[
            "5 0",
            "3.5 0 10",
            "4 0",
            "3 0 10",
            "5 0",
            "5 -1",
            "3.5 -1 10",
            "4 -1",
            "3 -1 10",
            "3 -0.8",
            "5 -0.8",
            "5 0",
        ],
    ),
    // A cycle ends where it began; a contour that lies behind is no loop.
    (
        "S100 M3 F.1\nG0 X10 Z1\nG71 P1 Q2 D9000\nN1 G0 X4\nN2 G1 Z-3\nG73 P1 Q2 D1\nM30",
        &["5 1", "2 1", "2 -3 10", "5 1", "2 1", "2 -3 10", "5 1"],
    ),
    (
        "S100 M3 F.1\nG0 Z5\nG83 X8 W-3 R-2\nX4 K2\nG80 G0 X0\nM30",
        &[
            "0 5", "4 5", "4 3", "4 0 10", "4 3", "4 5", "2 5", "2 3", "2 0 10", "2 3", "2 5",
            "2 3", "2 0 10", "2 3", "2 5", "0 5",
        ],
    ),
    (
        "S100 M3 F.1\nG0 X10 Z0\nG72 W2 R1\nG72 P1 Q2 U0 W0\nN1 G0 Z-3\nN2 G1 X4 Z0\nM30",
        &["5 0", "5 -2", "4 -2 10", "5 -1 10", "5 -3", "2 0 10", "5 0"],
    ),
    (
        "S100 M3 F.1\nG0 X10 Z1\nG73 U2 W1 R2\nG73 P1 Q2 U1 W0\nN1 G0 X4\nN2 G1 Z-3\nM30",
        &[
            "5 1",
            "7.5 2",
            "4.5 2",
            "4.5 -2 10",
            "7.5 2",
            "5.5 1",
            "2.5 1",
            "2.5 -3 10",
            "5.5 1",
            "5 1",
        ],
    ),
];

#[test]
fn lathe_programs_lead_where_they_say() {
    for (text, expected) in WAYS {
        let source = Source::memory("test.nc", text.as_bytes());
        let options = Options { dialect: Dialect::FanucLathe, ..Options::default() };
        let machine = ideal();
        let mut found = Vec::new();
        for motion in interp::motions(&source, &machine, &options) {
            let Motion::Move(step) = motion.unwrap() else { continue };
            if step.from == step.to {
                continue;
            }
            let round = |value: f64| (value * 1e3).round() / 1e3 + 0.0;
            let feed = match step.kind {
                MoveKind::Line { feed_mm_min } => format!(" {}", round(feed_mm_min)),
                _ => String::new(),
            };
            found.push(format!("{} {}{feed}", round(step.to[Axis::X]), round(step.to[Axis::Z])));
        }
        assert_eq!(found, *expected, "{text}");
    }
}

/// A probe that cannot move is a mistake, unless only the assumption has brought it there.
#[test]
fn probes_have_a_way_to_go() {
    for (text, rules) in [
        ("G38.2 X0 F9\nM30", &["bad-value"][..]),
        ("G38.2 X5 F9\nG38.3 X5\nG0 X[#5061+1]\nG38.2 X6\nM30", &["bad-value"]),
        ("G38.2 X5 F9\nG38.3 X5\nM30", &[]),
    ] {
        let checked = check(text, Dialect::Iso);
        let found: Vec<_> = checked.diagnostics.iter().map(|found| found.rule).collect();
        assert_eq!(found, rules, "{text}");
    }
}
