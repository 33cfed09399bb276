//! Drawing dimensions: fillets, chamfers and angles of lines, and where they are refused.

use cnc::base::{Axis, Machine, Source};
use cnc::interp::{self, Dialect, Motion, Move, MoveKind, Options};
use proptest::prelude::*;

fn ideal() -> Machine {
    Machine::load("ideal").unwrap()
}

fn options(dialect: Dialect) -> Options {
    Options { dialect, ..Options::default() }
}

fn findings(text: &str, dialect: Dialect) -> Vec<String> {
    let source = Source::memory("test.nc", text.as_bytes());
    let checked = interp::check(&source, &ideal(), &options(dialect), 1000).unwrap();
    let show = |found: &cnc::base::Diagnostic| {
        format!("{} {}:{}", found.rule, found.span.line, found.column())
    };
    checked.diagnostics.iter().map(show).collect()
}

fn moves(text: &str, dialect: Dialect) -> Vec<Move> {
    let source = Source::memory("test.nc", text.as_bytes());
    let machine = ideal();
    let motions = interp::motions(&source, &machine, &options(dialect));
    let step = |motion| match motion {
        Motion::Move(step) => Some(step),
        Motion::Event(_) => None,
    };
    motions.filter_map(|motion| step(motion.unwrap())).collect()
}

/// Ends of the moves of a program on two axes; `o` behind those of arcs.
fn ends(text: &str, dialect: Dialect, axes: [Axis; 2]) -> Vec<String> {
    let show = |step: &Move| {
        let [a, b] = axes.map(|axis| (step.to[axis] * 1e3).round() / 1e3 + 0.0);
        let round = if matches!(step.kind, MoveKind::Arc { .. }) { " o" } else { "" };
        format!("{a} {b}{round}")
    };
    moves(text, dialect).iter().map(show).collect()
}

#[test]
fn corners_lead_where_they_say() {
    for (text, expected) in [
        ("G1 F9 X10 ,R2\nY10\nM30", &["8 0", "10 2 o", "10 10"][..]),
        ("G1 F9 X10 ,C2\nN5\n\n(remark)\nY10\nM30", &["8 0", "10 2", "10 10"]),
        // The feed may change, and words may be distances: the next ones are from the corner.
        ("G91 G1 F9 X10 ,R2\nF5 Y10\nX5\nM30", &["8 0", "10 2 o", "10 10", "15 10"]),
        ("F9\nG20 G1 X1 ,C.5\nY1\nM30", &["12.7 0", "25.4 12.7", "25.4 25.4"]),
        // A corner may take all that is left of a line.
        ("G1 F9 X10 ,R5\nY10 ,R5\nX0\nM30", &["5 0", "10 5 o", "5 10 o", "0 10"]),
        ("G1 F9 X10 ,R2\nG2 X20 I5\nM30", &["8.292 0", "10.208 1.429 o", "20 0 o"]),
        // It goes on in the same direction: there is no corner.
        ("G1 F9 X10 ,R2\nX20\nM30", &["10 0", "20 0"]),
        ("G1 F9 X10 ,R0\nY20\nM30", &["10 0", "10 20"]),
        ("#1=2\nG1 F9 X10 ,R[#1*2]\n#1=3\nY20\nM30", &["6 0", "10 4 o", "10 20"]),
        ("G1 F9 X10 ,A45\nY0 ,A-30\nM30", &["10 10", "27.321 0"]),
        ("G91 G1 F9 X10 ,A45\nX10 ,A0\nM30", &["10 10", "20 10"]),
        ("G1 F9 ,A45\nX20 Y0 ,A-45\nM30", &["10 10", "20 0"]),
        ("G1 F9 ,A45 ,C1\nX20 Y0 ,A-45\nM30", &["9.293 9.293", "10.707 9.293", "20 0"]),
    ] {
        assert_eq!(findings(text, Dialect::Iso), [""; 0], "{text}");
        assert_eq!(ends(text, Dialect::Iso, [Axis::X, Axis::Y]), expected, "{text}");
    }
}

#[test]
fn corners_of_lathes_need_no_comma() {
    let head = "G98 G1 F100";
    for (text, expected) in [
        ("X20 R2\nZ-10\nM30", &["8 0", "10 -2 o", "10 -10"][..]),
        ("X20 K-2\nZ-10\nM30", &["8 0", "10 -2", "10 -10"]),
        ("Z-10 I1\nX20\nM30", &["0 -9", "1 -10", "10 -10"]),
        ("Z-10 R-1\nX-20\nM30", &["0 -9", "-1 -10 o", "-10 -10"]),
        ("W-10 A135\nM30", &["10 -10"]),
        ("A135 R1\nX20 Z-20 A180\nM30", &["9.707 -9.707", "10 -10.414 o", "10 -20"]),
    ] {
        let text = format!("{head} {text}");
        assert_eq!(findings(&text, Dialect::FanucLathe), [""; 0], "{text}");
        assert_eq!(ends(&text, Dialect::FanucLathe, [Axis::X, Axis::Z]), expected, "{text}");
    }
    for (text, expected) in [
        // The sign says where the next move goes.
        ("Z-10 I-1\nX20\nM30", &["corner 1:18"][..]),
        ("Z-10 R-1\nX20\nM30", &["corner 1:18"]),
        ("X10 I1\nZ-20\nM30", &["corner 1:17"]),
        ("X10 Z-5 K1\nZ-20\nM30", &["corner 1:21"]),
        // Words of cycles are none of corners.
        ("X10 Z-5\nG74 R1\nG74 Z-8 Q1000\nM30", &[]),
        ("X10 Z-5\nG90 X8 Z-9 R1\nM30", &[]),
    ] {
        let text = format!("{head} {text}");
        assert_eq!(findings(&text, Dialect::FanucLathe), expected, "{text}");
    }
}

#[test]
fn corners_without_a_place_are_refused_at_their_word() {
    for (text, expected) in [
        ("G1 F9 X10 ,R11\nY20\nM30", &["corner 1:11"][..]),
        ("G1 F9 X10 ,C2\nY1\nM30", &["corner 1:11"]),
        ("G1 F9 X10 ,R1\nX5\nM30", &["corner 1:11"]),
        ("G1 F9 X10 ,R1\nG0 Y5\nM30", &["corner 1:11"]),
        ("G1 F9 X10 ,R1\nZ5\nM30", &["corner 1:11"]),
        ("G1 F9 X10 ,R1\nG4 P1\nY5\nM30", &["corner 1:11"]),
        ("G1 F9 X10 ,R1\nG18 Y5\nM30", &["corner 1:11"]),
        ("G1 F9 X10 ,R1\nM98 P2\nM30\nO2\nG1 Y5\nM99", &["corner 1:11"]),
        ("G1 F9 X10 ,R1\nM30", &["corner 1:11"]),
        ("G1 F9 X10 ,R1\n", &["missing-end 1:1", "corner 1:11"]),
        ("G51 X0 Y0 P2\nG1 F9 X10 ,R1\nY5\nM30", &["corner 2:11"]),
        ("G1 F9 X10 ,R1 ,C1\nY5\nM30", &["corner 1:15"]),
        ("G1 F9 X10 ,R-1\nY5\nM30", &["corner 1:11"]),
        ("G2 F9 X10 I5 ,C1\nG1 X20\nM30", &[]),
        ("G2 F9 X10 I5 ,C11\nG1 X30\nM30", &["corner 1:14"]),
        ("G1 F9 X10 ,R1\n,A90\nX0 Y5 ,A180\nM30", &[]),
        ("G1 F9 X10 ,R11\n,A90\nX0 Y15 ,A180\nM30", &["corner 3:8"]),
        ("G1 F9 X10 ,R1\n,A90\nX5\nM30", &["corner 2:1"]),
        ("G1 F9 ,A30\nX10\nM30", &["corner 1:7"]),
        ("G1 F9 ,A30\nX10 ,A50\nM30", &["corner 2:5"]),
        ("G1 F9 ,A30\nX10 Y10 ,A30\nM30", &["corner 1:7"]),
        ("G1 F9 ,A30\nG91 X10 Y10 ,A60\nM30", &["corner 2:13"]),
        ("G1 F9 X10 ,A90\nM30", &["corner 1:11"]),
        ("G1 F9 X10 Y5 ,A30\nM30", &["corner 1:14"]),
        // Once, however often the block runs.
        ("F9\no1 repeat [3]\nG1 X10 ,R9\nY5\nG0 X0 Y0\no1 endrepeat\nM30", &["corner 3:8"]),
        // A comma that begins no such word.
        ("G1 F9 X10, Y5\nM30", &["bad-character 1:10"]),
        ("G1 F9 X10 ,R\nM30", &["missing-number 1:11"]),
    ] {
        assert_eq!(findings(text, Dialect::Iso), expected, "{text}");
    }
}

/// Compensation follows what is left of the lines, and the corner between.
#[test]
fn a_compensated_contour_has_its_corners() {
    let text = "G41.1 D2 G1 F9 X0 Y-5\nY10 ,R3\nX20\nG40 Y30\nM30";
    let by_hand = "G41.1 D2 G1 F9 X0 Y-5\nY7\nG2 X3 Y10 I3\nG1 X20\nG40 Y30\nM30";
    let axes = [Axis::X, Axis::Y];
    assert_eq!(findings(text, Dialect::Iso), [""; 0]);
    assert_eq!(ends(text, Dialect::Iso, axes), ends(by_hand, Dialect::Iso, axes));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    /// With or without corners a contour ends at one place; each move begins where the one before
    /// has ended, and none is a full circle.
    #[test]
    fn corners_hold_together(
        steps in proptest::collection::vec((-20..20_i32, -20..20_i32, 0..4_u8, 1..5_u8), 2..8),
    ) {
        let (mut text, mut plain) = (String::from("G91 G1 F9\n"), String::from("G91 G1 F9\n"));
        for (x, y, kind, size) in &steps {
            let line = format!("X{x} Y{y}");
            plain += &format!("{line}\n");
            text += &match kind {
                0 => format!("{line}\n"),
                1 => format!("{line} ,C{size}\n"),
                _ => format!("{line} ,R{size}\n"),
            };
        }
        (text, plain) = (text + "X50\nM30", plain + "X50\nM30");
        let found = findings(&text, Dialect::Iso);
        if !found.is_empty() {
            prop_assert!(found.iter().all(|found| found.starts_with("corner ")), "{found:?}");
            return Ok(());
        }
        let (found, expected) = (moves(&text, Dialect::Iso), moves(&plain, Dialect::Iso));
        prop_assert_eq!(found.last().unwrap().to, expected.last().unwrap().to);
        for pair in found.windows(2) {
            prop_assert_eq!(pair[0].to, pair[1].from);
        }
        let arcs = found.iter().filter(|step| matches!(step.kind, MoveKind::Arc { .. }));
        for step in arcs {
            let way = (step.to[Axis::X] - step.from[Axis::X]).hypot(step.to[Axis::Y] - step.from[Axis::Y]);
            prop_assert!(way > 1e-6);
        }
    }
}
