//! The language, held against data: good samples against their canonical motion, bad samples
//! against what their first line expects.
//!
//! `UPDATE=1 cargo test --test language` writes the canonical motion anew: read the difference.

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use cnc::base::{Axis, Machine, Source};
use cnc::gcode::{LATHE_B_CODES, LATHE_CODES, codes, foreign, rules, words};
use cnc::interp::{self, Bound, Dialect, Motion, Move, MoveKind, Options};

use support::{check, check_with, ideal, moves};

#[path = "language/support.rs"]
mod support;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn files(folder: &str, ending: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(root().join(folder)).unwrap();
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|found| found == ending));
    files.sort();
    files
}

/// Rules that a program breaks, as `rule line:column`.
fn findings(text: &str) -> Vec<String> {
    let checked = check(text.as_bytes(), &Machine::load("starmill").unwrap());
    let show = |found: &cnc::base::Diagnostic| {
        format!("{} {}:{}", found.rule, found.span.line, found.column())
    };
    checked.diagnostics.iter().map(show).collect()
}

/// What the first three lines of a sample say of it: `(machine: ideal; dialect: fanuc)`.
fn said<'t>(text: &'t str, what: &str) -> Option<&'t str> {
    let what = format!("{what}: ");
    let (_, rest) = text.lines().take(3).find_map(|line| line.split_once(&what))?;
    rest.split([';', ')']).next()
}

#[test]
fn good_samples_mean_what_they_meant() {
    let golden = files("tests/language", "jsonl");
    assert!(!golden.is_empty());
    for expected in golden {
        let name = expected.file_stem().unwrap().to_str().unwrap();
        let folders = ["samples/good", "samples/lathe", "samples/fanuc"];
        let sample = folders
            .map(|folder| root().join(folder).join(name).with_extension("nc"))
            .into_iter()
            .find(|sample| sample.exists())
            .unwrap();
        let mut command = Command::cargo_bin("cnc").unwrap();
        let text = fs::read_to_string(&sample).unwrap();
        let machine = said(&text, "machine").unwrap_or("starmill");
        command.args(["interpret", "--json", "--machine", machine]).arg(&sample);
        if let Some(dialect) = said(&text, "dialect") {
            command.args(["--dialect", dialect]);
        }
        let output = command.assert().success().get_output().stdout.clone();
        let output = String::from_utf8(output).unwrap();
        if std::env::var_os("UPDATE").is_some() {
            fs::write(&expected, &output).unwrap();
        }
        assert_eq!(output, fs::read_to_string(&expected).unwrap(), "{name}");
    }
}

#[test]
fn every_rule_has_a_bad_sample_that_breaks_it_and_nothing_else() {
    let samples = files("samples/bad", "nc");
    let names: Vec<_> =
        samples.iter().map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned()).collect();
    for rule in rules::all() {
        assert!(names.iter().any(|name| name == rule.name), "samples/bad/{}.nc", rule.name);
    }
    for (path, name) in samples.iter().zip(&names) {
        let text = fs::read(path).unwrap();
        let first = String::from_utf8_lossy(text.split(|byte| *byte == b'\n').next().unwrap());
        let expected = first.strip_prefix("(expect: ").and_then(|rest| rest.split(')').next());
        let expected = expected.unwrap_or_else(|| panic!("{name}: no expectation"));
        let lenient = expected.strip_suffix(" leniently");
        let expected = lenient.unwrap_or(expected).split(" on ").next().unwrap();
        let options = Options { lenient: lenient.is_some(), ..options_of(&first) };
        let checked = check_with(&text, &machine_of(&first), &options);
        let found: Vec<_> = checked
            .diagnostics
            .iter()
            .map(|found| format!("{} {}:{}", found.rule, found.span.line, found.column()))
            .collect();
        assert!(expected.starts_with(&format!("{name} ")), "{name}");
        assert_eq!(found, [expected], "{name}");
    }
}

/// A plan of years neither ends nor fits the numbers that count its ticks.
#[test]
fn no_move_may_take_longer_than_ten_days() {
    let tiny = format!("G1 F0.{}1 X1\nM30", "0".repeat(300));
    for (text, expected) in [
        (tiny.as_str(), true),
        ("G1 F0.0001 X1.44\nM30", false),
        ("G1 F0.0001 X1.45\nM30", true),
        ("G1 F0.0001 A1.45\nM30", true),
        ("G20 G1 F0.0001 X1.45\nM30", true),
        ("G1 F0.1 X0\nG2 X0 I200\nM30", false),
        ("G1 F0.1 X0\nG2 X0 I200 P2\nM30", true),
        ("G1 F10 X0\nG2 X1 R100000\nM30", false),
        ("G1 F0.0000002 X0.0001\nM30", false),
        ("G1 F0.00000002 X0.0001\nM30", true),
        ("G1 F0.00000002 X0\nM30", false),
    ] {
        let found = check(text.as_bytes(), &ideal());
        let found = found.diagnostics.iter().any(|found| found.rule == "feed-too-low");
        assert_eq!(found, expected, "{text}");
    }
}

/// Beyond them a position in steps has no exact number: a sum of distances must not lead there.
#[test]
fn positions_are_bounded_on_machines_without_travel() {
    for text in [
        "G0 X1000001\nM30",
        "G0 G91 G20 Y-40000\nM30",
        "GR P1 L1000\nM30\nO1\nG0 G91 Z2000\nM99",
        "G2 I-999999 F1000000\nM30",
    ] {
        let checked = check(text.as_bytes(), &ideal());
        let rules: Vec<_> = checked.diagnostics.iter().map(|found| found.rule).collect();
        assert!(rules.iter().any(|rule| rule.starts_with("limit-")), "{text}: {rules:?}");
    }
    let at_the_bound = check(b"G0 X-1000000\nX1000000\nM30", &ideal());
    assert_eq!(at_the_bound.errors, 0);
}

#[test]
fn a_part_outside_of_the_travel_is_told_how_far_to_shift() {
    for (text, axis, shift) in [
        // The starmill's X goes from 0 to 150; its work zero is X75.
        ("G0 X80\nM30", Axis::X, "X -75.000 to -5.000 mm"),
        ("G0 X80 Y-60\nM30", Axis::Y, "Y +10.000 to +50.000 mm"),
        ("G91 G0 X-76.00025\nX1\nM30", Axis::X, "X +1.001 to +75.000 mm"),
        ("G0 X-100\nX100\nM30", Axis::X, "200.000 mm of X, 50.000 mm more than the travel"),
        ("G0 X1\nG53 G0 X160\nG90 X80\nX1\nM30", Axis::X, "led there by machine coordinates"),
        // What G53 says does not shift with the part; what stands behind it does again.
        ("G0 X1\nG53 G0 X149\nY1\nG90 X80\nX1\nM30", Axis::X, "X -75.000 to -5.000 mm"),
    ] {
        let checked = check(text.as_bytes(), &Machine::load("starmill").unwrap());
        let rule = rules::limits(axis).each_ref().map(|rule| rule.name);
        let found = checked.diagnostics.iter().find(|found| rule.contains(&found.rule)).unwrap();
        let help = found.help.as_deref().unwrap();
        assert!(help.contains(shift), "{text}: {help}");
    }
}

#[test]
fn rapids_into_the_work_are_told_where_they_are_meant() {
    const HEAD: &str = "M3 S1000 F100\nG0 X1 Y1 Z5\n";
    for (text, is_told) in [
        ("G0 Z-1\nG1 X5", true),
        ("G91\nG0 Z-6\nG1 X5", true),
        ("G0 Z0\nG1 X5", false),
        ("G1 Z-3\nG0 Z5\nG0 Z-2.8\nG1 Z-4", false),
        ("G1 Z-3\nG0 Z5\nG0 Z-3.2\nG1 Z-4", true),
        ("G1 Z-3\nG0 Z5\nX9\nZ-3\nG1 X4", true),
        ("G1 Z-3\nG0 Z5\nX9\nZ-2.9\nG1 Z-3", false),
        ("G81 X2 Y2 Z-5 R1\nX9", false),
        ("G53 G0 Z40\nG1 X2", false),
        ("M5\nG0 Z-1\nG1 X5", false),
        ("G52 Z-9\nG0 Z-1\nG1 X5", true),
        ("G10 L2 P1 Z20\nG0 Z-1\nZ-5\nG1 X5", true),
    ] {
        let found = findings(&format!("{HEAD}{text}\nM30"));
        let told = found.iter().any(|rule| rule.starts_with("rapid-into-work"));
        assert_eq!(told, is_told, "{text}: {found:?}");
    }
    // A spindle that no program starts; nothing that cuts; a lathe.
    assert_eq!(findings("G0 X1 Y1 Z-5\nG1 X5 F100\nM30"), ["rapid-into-work 1:10"]);
    assert_eq!(findings("G0 X1 Y1 Z-5\nM30"), [""; 0]);
    assert_eq!(findings("M3 S100\nG0 X5 Z-5\nG1 X1 F10\nM30"), [""; 0]);
}

/// Holds a file of docs/ against what the tables make, or writes it anew.
fn is_documented(name: &str, text: &str) {
    let file = root().join("docs").join(name);
    if std::env::var_os("UPDATE").is_some() {
        fs::write(&file, text).unwrap();
    }
    assert!(
        text == fs::read_to_string(&file).unwrap(),
        "{name}: UPDATE=1 cargo test --test language"
    );
}

#[test]
fn the_reference_is_that_of_the_tables() {
    let mut text = String::from(
        "# Codes\n\nMade from the tables in `src/gcode`: \
         `UPDATE=1 cargo test --test language`. `cnc explain G43` tells of one code, with where controls \
         differ.\n\n\
         The codes of one block are executed in the order of their groups as listed \
         in `src/gcode/codes.rs`, units first. Two codes of one group cannot stand in one block, \
         M7 with M8, and G80 with another motion code, excepted.\n\n\
         | code | group | words | supported | meaning |\n|---|---|---|---|---|\n",
    );
    for code in codes::CODES {
        let supported = if code.op.is_some() { "yes" } else { "no" };
        let (name, group, words) = (code.name(), code.group.name(), code.letters().concat());
        text += &format!("| {name} | {group} | {words} | {supported} | {} |\n", code.meaning);
    }
    text += "\n## Words\n\n| word | meaning | example |\n|---|---|---|\n";
    for row in words::WORDS {
        text += &format!("| `{}` | {} | `{}` |\n", row.name, row.meaning, row.example);
    }
    text += "\n## Codes of lathes\n\nIn the dialect `fanuc-lathe` these codes mean something else; all \
             others are those above.\n\n| code | group | supported | meaning |\n|---|---|---|---|\n";
    for code in LATHE_CODES {
        let supported = if code.op.is_some() { "yes" } else { "no" };
        let (name, group) = (code.name(), code.group.name());
        text += &format!("| {name} | {group} | {supported} | {} |\n", code.meaning);
    }
    text += "\nIn the dialect `fanuc-lathe-b` (G code system B) G32, G50, G90 to G94, G98 and G99 mean what they \
             mean on mills, and these are there instead:\n\n| code | group | supported | meaning |\n\
             |---|---|---|---|\n";
    for code in LATHE_B_CODES {
        let (name, group) = (code.name(), code.group.name());
        text += &format!("| {name} | {group} | yes | {} |\n", code.meaning);
    }
    text += "\n## Codes of other controls\n\nThey mean nothing here, and are refused with what is said \
             below; but for M100 to M199, which are the user's functions and pass as events.\n\n| code | control | meaning there | instead |\n|---|---|---|---|\n";
    for row in foreign::FOREIGN {
        let name = row.name();
        text += &format!("| {name} | {} | {} | {} |\n", row.control, row.meaning, row.instead);
    }
    is_documented("gcodes.md", &text);
}

/// A program in a fence; long ones are cut.
fn fenced(program: &str) -> String {
    let lines: Vec<&str> = program.lines().collect();
    let mut text = String::from("```\n");
    for line in lines.iter().take(16) {
        let visible = |c: char| if c.is_control() { '\u{fffd}' } else { c };
        text.extend(line.chars().take(72).map(visible));
        text += if line.chars().count() > 72 { "…\n" } else { "\n" };
    }
    text + if lines.len() > 16 { "…\n```\n" } else { "```\n" }
}

#[test]
fn the_rules_are_documented_with_their_samples() {
    let mut text = String::from(
        "# Rules\n\nMade from the table in `src/gcode/rules.rs` and the samples: \
         `UPDATE=1 cargo test --test language`. `cnc explain no-feed` tells of one. A program with an \
         error gives no motion; one with a warning runs.\n\n\
         | rule | severity | meaning |\n|---|---|---|\n",
    );
    for rule in rules::all() {
        let severity = format!("{:?}", rule.severity).to_lowercase();
        text += &format!("| [{0}](#{0}) | {severity} | {1} |\n", rule.name, rule.meaning);
    }
    for rule in rules::all() {
        let bad = rule.bad.split_once('\n').unwrap().1;
        text += &format!("\n## {}\n\n{}\n\n{}", rule.name, rule.meaning, fenced(bad));
        text += &format!("\nMended:\n\n{}", fenced(rule.mended));
    }
    is_documented("rules.md", &text);
}

/// The machine that the first line of a bad sample names, or else the starmill.
fn machine_of(bad: &str) -> Machine {
    let expected = bad.lines().next().and_then(|line| line.strip_prefix("(expect: "));
    let expected = expected.and_then(|rest| rest.split(')').next()).unwrap();
    let name = expected.split_once(" on ").map_or("starmill", |(_, name)| name);
    let name = name.split(';').next().unwrap();
    let own = root().join("samples/machines").join(name).with_extension("toml");
    Machine::load(if own.exists() { own.to_str().unwrap() } else { name }).unwrap()
}

/// The dialect that the first line of a bad sample names.
fn options_of(bad: &str) -> Options {
    let expected = bad.lines().next().and_then(|line| line.split(')').next()).unwrap();
    let dialect = expected.split_once(';').map_or("", |(_, rest)| rest);
    let dialect = Dialect::ALL.into_iter().find(|known| dialect.ends_with(known.name()));
    Options { dialect: dialect.unwrap_or_default(), ..Options::default() }
}

#[test]
fn every_mended_sample_has_no_mistake() {
    for rule in rules::all() {
        let mended = rule.mended.as_bytes();
        let checked = check_with(mended, &machine_of(rule.bad), &options_of(rule.bad));
        assert_eq!(checked.diagnostics, [], "samples/mended/{}.nc", rule.name);
    }
    assert_eq!(files("samples/mended", "nc").len(), rules::all().count());
}

#[test]
fn one_fault_makes_no_others() {
    for (text, expected) in [
        // A thread that cannot be cut, once; its ends are where they are.
        ("S1 M3\nG33 X1 K1\nX2 K1\nG80\nM30", &["spindle-sync 2:1"][..]),
        ("S1 M3\nG76 P1 Z-5 I-1 J.1 K1\nG91 G0 X500\nM30", &["spindle-sync 2:1"]),
        ("G31 X1 F9\nG38.3 X2\nX3\nM30", &["no-inputs 1:1"]),
        // Contours: each fault once, at its line, and none of the cycle.
        ("G18 F9\nO1 sub\nG1 X5\nG81 X7\nO1 endsub\nG71 Q1\nG70 Q1\nG0 Y1\nM30", &["contour 4:1"]),
        ("G18 F9\nG71 Q1 X1\nG0 Y1\nM30", &["unknown-subprogram 2:1"]),
        ("G18 F9\nG71 X1\nM30", &["missing-word 2:1"]),
        ("G17 F9\nG71 Q1 X1\nM30", &["cycle-mode 2:1"]),
        ("G18 F9\nG71 Q1 I0\nM30\nO1\nX5 Z-1\nX9 Z-3\nM99", &["bad-value 2:8"]),
        // An unknown position makes no arc wrong.
        ("G0 X[1/0]\nG2 X10 I5 F100\nM30", &["arithmetic 1:4"]),
        // Offsets that are not supported leave open where everything lies.
        ("G10 L5 P1 X0\nG0 X500\nM30", &["unsupported-word 1:5"]),
        ("G42 D08\nG1 X1 F100\nX2\nG40 X5\nM30", &["unknown-tool 1:5"]),
        ("G41.1 D2 F9\nG1 X5\nX9 !\nY1\nX8\nG40 X1\nM30", &["bad-character 3:4"]),
        ("G1 X1\nX2\nG2 X4 I1\nF10 X1 I-1\nM30", &["no-feed 1:1", "arc-radius 4:1"]),
        // A position that is given again is known again.
        ("G0 X1 !\nG91 Y90\nG90 X500\nM30", &["bad-character 1:7", "limit-x-max 3:5"]),
        // A call that leads nowhere leaves open where the machine stands.
        ("G91 GR1\nM30", &["call-alone 1:1"]),
        ("G91\nGR1\nG0 X60\nX60\nM30", &["unknown-subprogram 2:1"]),
        // Faults of a subprogram come once, however often it runs.
        ("GR1 L9\nM30\nO1\nG0 X1 H3\nM99", &["unused-word 4:7"]),
        ("GR1 L9\nM30\nO1\nG0 !\nM99", &["bad-character 4:4"]),
        // Those of one that never runs come too.
        (
            "G0 X1\nM30\nO1\nG5.7\nX!\nM99",
            &["never-called 4:1", "never-called 5:1", "never-called 5:2"],
        ),
        ("G0 X1\nO1\nG5.7\nM99", &["missing-end 1:1", "never-called 3:1"]),
        // What stands behind the closing % is no part of the program.
        ("%\nG0 X1\n%\nwords\u{1}", &["after-end 4:1"]),
        ("G0 X1\n\u{0}\u{1}\u{2}\n\u{3}", &["not-text 2:1"]),
    ] {
        assert_eq!(findings(text), expected, "{text}");
    }
}

#[test]
fn words_that_are_right_are_taken() {
    for text in [
        "M7 M8\nM9\nM30",
        "G17 G21 G40 G49 G54 G61 G80 G90 G91.1 G94 G97\nM2",
        "G4 P0 G1 X1 F10\nM30",
        "O5\nGR6\nM30\nO6\nGR7 L0\nM99\nO7\nM99",
        "%\n:0005 (name)\nG0 X1\n%",
        "G0 X75.0000000001\nM30",
        "G2 I10 F100 P2\nM30",
        "G53 G0 X0 Y0 Z0\nM30",
    ] {
        assert_eq!(findings(text), [""; 0], "{text}");
    }
}

/// On FANUC-style controls cycles are a group of their own.
#[test]
fn the_end_of_a_cycle_ends_no_motion_code_at_fanuc() {
    let text = b"G1 F100 X1\nG81 X2 Z-1 R1\nG83 X3 Z-1 R1 Q1\nG80\nX4\nG0\nG80 X5\nM30";
    for (dialect, expected) in [(Dialect::Fanuc, None), (Dialect::Iso, Some("no-motion-mode"))] {
        let options = Options { dialect, ..Options::default() };
        let found = check_with(text, &ideal(), &options);
        assert_eq!(found.diagnostics.first().map(|found| found.rule), expected);
    }
}

/// Titles, line numbers and words that say the same twice, as real programs have them.
#[test]
fn real_programs_are_written_so() {
    for (text, expected) in [
        // Above the title of the main program stand subprograms and parameters.
        ("#1=2\nO5 sub\nG0 X9\nO5 endsub\nO1\nO5 call\nM30", None),
        ("#1=9\nO1 (main)\n#2=1\nIF [#1 EQ 9] GOTO 7\nG0 X5\nN7 M30", None),
        ("O<main> (title)\nG0 X1\nM30", None),
        ("G0 X1\nO<sub>\nM30", Some("expression 2:1")),
        ("o1 sub\nO<other>\no1 endsub\no1 call\nM30", Some("expression 2:1")),
        ("N10.5 G0 X1\nM30", None),
        ("N-1 G0 X1\nM30", Some("bad-value 1:1")),
        ("G49 H0\nG40 D0\nM30", None),
        ("G49 H1\nM30", Some("unused-word 1:5")),
        ("G0 X[EXISTS[#5] + EXISTS[#[5000 + 602]]] Y EXISTS[#5603]\nM30", None),
        ("#abs[-3]=5\nG0 X#3\nM30", None),
        // LinuxCNC's tolerances: 0.02 times the root of 2 mm, and a tenth of that in inches.
        ("G2 X20.028 I10 F9\nM30", Some("arc-radius-doubtful 1:1")),
        ("G2 X20.029 I10 F9\nM30", Some("arc-radius 1:1")),
        ("G20\nG2 X1.0028 I0.5 F9\nM30", Some("arc-radius-doubtful 2:1")),
        ("G20\nG2 X1.0029 I0.5 F9\nM30", Some("arc-radius 2:1")),
    ] {
        let found = check(text.as_bytes(), &ideal());
        let show = |found: &cnc::base::Diagnostic| {
            format!("{} {}:{}", found.rule, found.span.line, found.column())
        };
        assert_eq!(found.diagnostics.first().map(show).as_deref(), expected, "{text}");
    }
}

/// After M29 taps start the spindle, follow its turns and leave it standing, until G80.
#[test]
fn rigid_taps_follow_the_spindle() {
    let text = "M29 S500\nG84 X1 Z-5 R2 F400\nG80\nM3\nG84 X2 Z-5 R2\nM30";
    let (source, machine) = (Source::memory("test.nc", text.as_bytes()), ideal());
    let show = |motion| match motion {
        Motion::Move(step) if step.bound == Bound::Spindle => "tap".to_owned(),
        Motion::Move(step) => format!("Z{}", step.to[Axis::Z]),
        Motion::Event(event) => event.kind.to_string(),
    };
    let motions = interp::motions(&source, &machine, &Options::default());
    let shown: Vec<String> = motions.map(|motion| show(motion.unwrap())).collect();
    let expected = "S500, Z2, Z2, M3 S500, tap, M5, M4 S500, tap, M5, M3 S500, Z2, Z-5, M5, \
                    M4 S500, Z2, M5, M3 S500, M30";
    assert_eq!(shown.join(", "), expected);
    for (text, expected) in [
        ("M29\nG84 X1 Z-5 R2 F400\nM30", "no-spindle-speed"),
        ("M29 S5\nG80\nG84 X1 Z-5 R2 F400\nM30", "spindle-stopped"),
    ] {
        let found = check(text.as_bytes(), &machine);
        assert_eq!(found.diagnostics.first().map(|found| found.rule), Some(expected), "{text}");
    }
}

/// What refuses compensation, and what does not.
#[test]
fn compensation_knows_what_fits() {
    for (contour, expected) in [
        ("X10\nY10\nX0", None),
        // The tool reaches into a slot as wide as itself, and into none narrower.
        ("X10\nY-4\nX14\nY0\nX30", None),
        ("X10\nY-4\nX13.9\nY0\nX30", Some("compensation-gouge 7:1")),
        ("X10\nG3 X20 R5\nG1 X30", None),
        ("X10\nG3 X12 R1.5\nG1 X30", Some("compensation-gouge 5:1")),
        // Of the tool's radius; led in by a way of its radius.
        ("X10\nG3 X14 R2\nG1 X30", None),
        ("G40 Y-20\nG41 D1 Y-18\nX30", None),
        ("G40 Y-20\nG41 D1 Y-18.1\nX30", Some("compensation-gouge 5:1")),
        // Straight back along an arc, which lies on the tool's side or on the other.
        ("X10\nG2 X20 R5\nG1 Y10\nX30", None),
        ("X10\nG2 X20 R5\nG1 Y6", Some("compensation-gouge 7:1")),
        ("X10\nX5\nY5", None),
        ("X10\nG3 X10 Y0 I0 J5\nG1 X30", None),
        ("X10\nG18 X20", Some("compensation-mode 5:1")),
        ("X10\nG55 X20", Some("compensation-mode 5:1")),
        ("X10\nG81 X20 Z-1 R1", Some("compensation-mode 5:1")),
        ("X10\nG41 D1\nX20", Some("compensation-mode 5:1")),
        ("X10\nG54 G17 G49 X20", None),
    ] {
        let text = format!(
            "G0 X-10 Y5 F100\nG10 L1 P1 R2\nG41 D1 G1 X0 Y0\n{contour}\nG40 G1 X50 Y20\nM30"
        );
        let found = check(text.as_bytes(), &ideal());
        let show = |found: &cnc::base::Diagnostic| {
            format!("{} {}:{}", found.rule, found.span.line, found.column())
        };
        let first = found.diagnostics.first().map(show);
        assert_eq!(first.as_deref(), expected, "{contour}");
    }
}

#[test]
fn no_motion_comes_out_of_a_program_with_an_error() {
    for text in ["G0 X1\nG5.7\n", "", "\u{0}", "garbage in\n"] {
        let output = Command::cargo_bin("cnc")
            .unwrap()
            .args(["interpret", "--json", "-"])
            .write_stdin(text)
            .assert()
            .code(1)
            .get_output()
            .stdout
            .clone();
        for line in String::from_utf8(output).unwrap().lines() {
            let object: serde_json::Value = serde_json::from_str(line).unwrap();
            assert_eq!(object["type"], "error", "{line}");
        }
    }
}

#[test]
fn degrees_have_no_other_unit() {
    let found = moves("G20\nG1 X1 A90 F10\nA180\nG3 I1 A0\nM30", &ideal());
    let feed = |step: &Move| step.kind.feed_mm_min().unwrap_or(0.0);
    assert_eq!(found.iter().map(|step| step.to[Axis::A]).collect::<Vec<_>>(), [90.0, 180.0, 0.0]);
    assert_eq!(found.iter().map(feed).collect::<Vec<_>>(), [254.0, 10.0, 254.0]);
}

/// 0.1 and 0.2 is not 0.3: what rounding leaves of a way in X makes the turn no way in inches.
#[test]
fn a_residue_of_rounding_has_no_unit() {
    let found = moves("G20\nG1 X[0.1+0.2] F10\nX0.3 A90\nM30", &ideal());
    assert_ne!(found[1].from[Axis::X], found[1].to[Axis::X]);
    let feeds = found.iter().map(|step| step.kind.feed_mm_min().unwrap_or(0.0));
    assert_eq!(feeds.collect::<Vec<_>>(), [254.0, 10.0]);
}

#[test]
fn a_feed_beside_a_change_of_units_is_in_the_units_before() {
    let feed = |text: &str| moves(text, &ideal())[0].kind.feed_mm_min().unwrap();
    assert_eq!(feed("G20 F10\nG1 X1\nM30"), 10.0);
    assert_eq!(feed("G20\nG1 X1 F10\nM30"), 254.0);
    assert_eq!(feed("G20\nG21 F10\nG1 X1\nM30"), 254.0);
}

#[test]
fn a_radius_arc_within_tolerance_of_half_a_circle_is_one() {
    let found = moves("G2 X20.04 R10 F100\nM30", &ideal());
    let MoveKind::Arc { center_mm, .. } = found[0].kind else { panic!("{:?}", found[0]) };
    assert!((center_mm[0] - 10.02).abs() < 1e-12 && center_mm[1].abs() < 1e-12);
}
