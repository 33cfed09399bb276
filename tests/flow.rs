//! Parameters, loops, branches and calls: what programs with them mean, and that nothing that they
//! say makes a run that does not end.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;

use assert_cmd::Command;
use cnc::base::{Axis, Machine, Source};
use cnc::interp::{self, Checked, Dialect, Motion, Options};
use proptest::prelude::*;

fn options() -> Options {
    Options { max_passes: Some(1000), ..Options::default() }
}

fn check_with(text: &str, options: &Options) -> Checked {
    let source = Source::memory("test.nc", text.as_bytes());
    interp::check(&source, &Machine::load("ideal").unwrap(), options, 100).unwrap()
}

/// Positions in X Y Z, a text each, as `1,2,0`.
fn positions_with(text: &str, options: &Options) -> Vec<String> {
    let source = Source::memory("test.nc", text.as_bytes());
    let machine = Machine::load("ideal").unwrap();
    let motions = interp::motions(&source, &machine, options);
    let moves = motions.filter_map(|motion| match motion.unwrap() {
        Motion::Move(step) => Some(step.to),
        Motion::Event(_) => None,
    });
    // Six decimals: what rounding adds to a sum is far below.
    let number = |value: f64| ((value * 1e6).round() / 1e6 + 0.0).to_string();
    moves.map(|to| Axis::LINEAR.map(|axis| number(to[axis])).join(",")).collect()
}

fn positions(text: &str) -> Vec<String> {
    let checked = check_with(text, &options());
    assert_eq!(checked.errors, 0, "{text}: {:?}", checked.diagnostics);
    positions_with(text, &options())
}

/// Rules that a program breaks, as `rule line:column`.
fn findings(checked: &Checked) -> Vec<String> {
    let show = |found: &cnc::base::Diagnostic| {
        format!("{} {}:{}", found.rule, found.span.line, found.column())
    };
    checked.diagnostics.iter().map(show).collect()
}

#[test]
fn programs_go_where_they_say() {
    for (text, expected) in [
        ("o1 do\no1 break\no1 while [1]\nG0 X1\nM2", &["1,0,0"][..]),
        (
            "o1 repeat [2]\nG91 G0 X1\no1 endrepeat\no2 repeat [0]\nX9\no2 endrepeat\nM2",
            &["1,0,0", "2,0,0"],
        ),
        // Halves are rounded to even counts, as in RS274/NGC.
        ("G91 G0\no1 repeat [2.5]\nX1\no1 endrepeat\nM2", &["1,0,0", "2,0,0"]),
        ("GOTO 10\nG0 X5\nN10 G0 X1\nM30", &["1,0,0"]),
        // A GOTO looks behind itself first, then from the beginning on.
        (
            "N1 G0 X1\nIF [#1 EQ 1] GOTO 9\n#1=1\nGOTO 1\nN1 G0 X2\nM30\nN9 G0 X3\nM30",
            &["1,0,0", "2,0,0"],
        ),
        // Behind an M30 too, and not in other programs.
        ("O1\nGOTO 7\nM30\nN7 G0 X7\nM30\nO2\nN7 G0 X8\nM99", &["7,0,0"]),
        ("WHILE [1] DO1\nIF [#1 GT 3] GOTO 5\n#1=#1+1\nEND1\nN5 G0 X#1\nM30", &["4,0,0"]),
        ("M98 P5\nN7 G0 X3\nM30\nN9 G0 X9\nM30\nO5\nM99 P9", &["9,0,0"]),
        ("o1 call [2]\nM2\no1 sub\nG0 X#1\no1 endsub", &["2,0,0"]),
        // A subprogram of M98 has the parameters of its caller, those of others their own.
        ("#1=1\nM98 P5\nG0 X#1\nM30\nO5\n#1=2\nM99", &["2,0,0"]),
        ("#1=1\nG65 P5 A7\nG0 X#1\nM30\nO5\nG0 Y#1\n#1=2\nM99", &["0,7,0", "1,7,0"]),
        ("G0 X--#1 Y1\nM30".replace("--", "-").as_str(), &["0,1,0"]),
        ("N1 #1=1 G0 X#1\n#1=#1+1 #2=#1\nX#2\nM30", &["0,0,0", "1,0,0"]),
        (
            "o1 sub\no2 if [#1 GT 3]\no1 return [#1]\no2 endif\no1 call [#1+1]\no1 endsub [#<_value>]\no1 call [1]\nG0 X#<_value>\nM2",
            &["4,0,0"],
        ),
        ("G[#1] X[2]\nM[30]", &["2,0,0"]),
    ] {
        assert_eq!(positions(text), expected, "{text}");
    }
}

#[test]
fn dialects_decide_where_meanings_clash() {
    for (text, dialect, expected) in [
        ("G0 X5\nX#1 Y2\nM30", Dialect::Iso, &["5,0,0", "0,2,0"][..]),
        ("G0 X5\nX#1 Y2\nM30", Dialect::Fanuc, &["5,0,0", "5,2,0"]),
        ("G0 X5\nX#0 Y2\nM30", Dialect::Iso, &["5,0,0", "5,2,0"]),
        ("M98 P20002\nM30\nO2\nG91 G0 X1\nM99", Dialect::Fanuc, &["1,0,0", "2,0,0"]),
        ("#3000=1 (X)\nG0 X#3000\nM30", Dialect::LinuxCnc, &["1,0,0"]),
    ] {
        let options = Options { dialect, ..options() };
        assert_eq!(check_with(text, &options).errors, 0, "{text}");
        assert_eq!(positions_with(text, &options), expected, "{text}");
    }
    let options = Options { block_delete: true, ..options() };
    assert_eq!(positions_with("/G0 X1\n/o1 while [1]\nG0 X2\nM30", &options), ["2,0,0"]);
}

#[test]
fn faults_of_control_flow_are_told_once_each() {
    for (text, expected) in [
        ("o1 endsub\nM2", &["unmatched-flow 1:1"][..]),
        ("o1 break\nM2", &["unmatched-flow 1:1"]),
        ("o1 if [1]\nG0 X1\no2 endif\no1 endif\nM2", &["unmatched-flow 3:1"]),
        ("o1 repeat [2]\nG0 X1", &["unmatched-flow 1:1"]),
        ("o1 sub\nG0 X1", &["unmatched-flow 1:1"]),
        ("o1 while [\nG0 X1\no1 endwhile\nM30", &["expression 1:1"]),
        ("o1 if [1]\no2 if [\nG0 X1\no2 endif\no1 endif\nM30", &["expression 2:1"]),
        ("o1 sub\nG0 X[2\no1 endsub\nM2", &["never-called 2:4"]),
        ("N10 G0 X1\nGOTO 10\nM30", &["max-passes 2:1"]),
        ("o1 while [1]\n o1 continue\no1 endwhile\nM2", &["max-passes 3:1"]),
        (
            "o1 while [#1 LT 5]\nG0 X[1/0] Y#<a>\n#1=[#1+1]\no1 endwhile\nM2",
            &["arithmetic 2:4", "unset-parameter 2:11"],
        ),
        ("G90 G65 P1\nM30\nO1\nM99", &["call-alone 1:1"]),
        ("#1=#<a> #<b>=#<a>\nG0 X#<b>\nM30", &["unset-parameter 1:1", "unset-parameter 1:9"]),
    ] {
        assert_eq!(findings(&check_with(text, &options())), expected, "{text}");
    }
}

#[test]
fn what_a_program_says_is_told_with_the_values_it_had() {
    let text = "(PRINT, a#1b #<_y> #<q>)\n(msg, #1) G0 Y1.5\n(DEBUG,#1) #1=5\nM30";
    let said = check_with(text, &options()).said;
    let said: Vec<_> = said.iter().map(|said| (said.line, said.text.as_str())).collect();
    assert_eq!(said, [(1, "a0b 0 #<q>"), (2, "#1"), (3, "5")]);
}

fn write(folder: &Path, name: &str, text: &str) {
    fs::write(folder.join(name), text).unwrap();
}

#[test]
fn subprograms_in_files_are_read_below_the_folders_given_and_nowhere_else() {
    let root = tempfile::tempdir().unwrap();
    let (own, other) = (root.path().join("own"), root.path().join("other"));
    fs::create_dir_all(own.join("sub")).unwrap();
    fs::create_dir_all(&other).unwrap();
    write(&own, "main.nc", "o<hole> call [3]\no<sub/low> call\nM98 P77\no<deep> call\nM30\n");
    write(
        &own,
        "hole.ngc",
        "o<hole> sub\nG0 X#1\no<own> call\no<hole> endsub\no<own> sub\nY1\no<own> endsub\n",
    );
    write(&own.join("sub"), "low.nc", "o<sub/low> sub\nZ1\no<sub/low> endsub\nM2\n");
    write(&own, "O0077.nc", "%\nO0077\nX4\nM99\n%\n");
    write(&other, "deep.ngc", "o<deep> sub\nX5\no<deep> endsub\n");
    let program = own.join("main.nc");
    let source = Source::open(&program).unwrap();
    let machine = Machine::load("ideal").unwrap();
    let run = |folders: &[&Path]| {
        let folders = folders.iter().map(|folder| folder.to_path_buf()).collect();
        interp::check(&source, &machine, &Options { folders, ..options() }, 100).unwrap()
    };
    assert_eq!(findings(&run(&[&own])), ["unknown-subprogram 4:1"]);
    let checked = run(&[&own, &other]);
    assert_eq!(findings(&checked), [""; 0]);
    let names: Vec<_> = checked.inputs.iter().map(|input| input.0.as_str()).collect();
    assert_eq!(names, ["hole.ngc", "sub/low.nc", "O0077.nc", "deep.ngc"]);
    assert_eq!(checked.summary.moves, 5);
    symlink(other.join("deep.ngc"), own.join("deep.ngc")).unwrap();
    assert_eq!(findings(&run(&[&own])), ["outside-folder 4:1"]);
    fs::remove_file(own.join("deep.ngc")).unwrap();
    write(&other, "deep.ngc", "o<deep> sub\nX[1/0]\no<deep> endsub\n");
    let found = run(&[&own, &other]).diagnostics;
    let calls: Vec<_> =
        found[0].calls.iter().map(|call| (call.file.as_deref(), call.line)).collect();
    assert_eq!((found[0].file.as_deref(), calls), (Some("deep.ngc"), vec![(None, 4)]));

    // Calls in several files.
    write(&other, "deep.ngc", "o<deep> sub\no<high> call\no<deep> endsub\n");
    write(&other, "high.ngc", "o<high> sub\n\nX[1/0]\no<high> endsub\n");
    let found = run(&[&own, &other]).diagnostics;
    let calls: Vec<_> =
        found[0].calls.iter().map(|call| (call.file.as_deref(), call.line)).collect();
    assert_eq!((found[0].file.as_deref(), found[0].span.line), (Some("high.ngc"), 3));
    assert_eq!(calls, [(None, 4), (Some("deep.ngc"), 2)]);

    // A file of that name with another subprogram.
    write(&other, "O99.nc", "(part)\nO98\nX5\nM99\n");
    let text = Source::memory("test.nc", b"M98 P99\nM30".as_slice());
    let options = Options { folders: vec![other.clone()], ..options() };
    let found = interp::check(&text, &Machine::load("ideal").unwrap(), &options, 9).unwrap();
    let found = &found.diagnostics[0];
    assert_eq!((found.rule, found.span.line), ("unknown-subprogram", 2));
    assert_eq!(found.message, "this file holds O98, and no O99");
    write(&other, "deep.ngc", "o<low> sub\nX5\no<low> endsub\n");
    let found = run(&[&own, &other]).diagnostics;
    assert_eq!(found[0].message, "this file holds O<low>, and no O<deep>");

    // A dump names the files; it is refused once one of them has changed.
    write(&other, "deep.ngc", "o<deep> sub\nX5\no<deep> endsub\n");
    let (dump, include) = (own.join("part.csv"), other.to_str().unwrap());
    let cnc = |words: &[&str]| {
        let mut command = Command::cargo_bin("cnc").unwrap();
        command.current_dir(&own).args(words).args(["--include", include]);
        command.assert()
    };
    cnc(&["interpolate", "main.nc", "--csv", "-o", "part.csv"]).success();
    assert!(fs::read_to_string(dump).unwrap().contains("sub/low.nc sha256:"));
    cnc(&["verify", "main.nc", "part.csv"]).success();
    write(&own, "O0077.nc", "%\nO0077\nX6\nM99\n%\n");
    cnc(&["verify", "main.nc", "part.csv"]).code(1);
}

/// A program as a tree: moves, loops over it, and calls of it.
#[derive(Clone, Debug)]
enum Part {
    Step(i8, i8),
    Repeat(u8, Vec<Part>),
    While(u8, Vec<Part>),
    Call(u8, Vec<Part>),
}

fn parts() -> impl Strategy<Value = Vec<Part>> {
    let step = (any::<i8>(), any::<i8>()).prop_map(|(x, y)| Part::Step(x, y));
    let part = step.prop_recursive(3, 12, 4, |inner| {
        let inner = proptest::collection::vec(inner, 0..4);
        prop_oneof![
            (0..4_u8, inner.clone()).prop_map(|(count, parts)| Part::Repeat(count, parts)),
            (0..4_u8, inner.clone()).prop_map(|(count, parts)| Part::While(count, parts)),
            (0..4_u8, inner).prop_map(|(count, parts)| Part::Call(count, parts)),
        ]
    });
    proptest::collection::vec(part, 0..6)
}

/// Writes parts as loops and calls; subprograms are put behind the end.
fn rolled(parts: &[Part], labels: &mut u32, text: &mut String, subs: &mut String) {
    for part in parts {
        *labels += 1;
        let label = *labels;
        match part {
            Part::Step(x, y) => *text += &format!("X{x} Y[{y}]\n"),
            Part::Repeat(count, parts) => {
                *text += &format!("o{label} repeat [{count}]\n");
                rolled(parts, labels, text, subs);
                *text += &format!("o{label} endrepeat\n");
            }
            Part::While(count, parts) => {
                *text += &format!("#<n{label}>=0\no{label} while [#<n{label}> LT {count}]\n");
                rolled(parts, labels, text, subs);
                *text += &format!("#<n{label}>=#<n{label}>+1\no{label} endwhile\n");
            }
            Part::Call(count, parts) => {
                *text += &format!("M98 P{label} L{count}\n");
                let mut body = format!("O{label}\n");
                rolled(parts, labels, &mut body, subs);
                *subs += &body;
                *subs += "M99\n";
            }
        }
    }
}

fn unrolled(parts: &[Part], text: &mut String) {
    for part in parts {
        match part {
            Part::Step(x, y) => *text += &format!("X{x} Y{y}\n"),
            Part::Repeat(count, parts) | Part::While(count, parts) | Part::Call(count, parts) => {
                (0..*count).for_each(|_| unrolled(parts, text));
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn loops_and_calls_are_what_they_unroll_to(parts in parts()) {
        let (mut text, mut flat, mut subs) = (String::from("G91 G0\n"), String::from("G91 G0\n"), String::new());
        rolled(&parts, &mut 0, &mut text, &mut subs);
        unrolled(&parts, &mut flat);
        prop_assert_eq!(positions(&format!("{text}M30\n{subs}")), positions(&format!("{flat}M30\n")));
    }

    #[test]
    fn no_control_flow_panics_or_runs_for_ever(
        lines in proptest::collection::vec(
            "o[12] (sub|endsub|call|return|if \\[#1\\]|elseif \\[#2\\]|else|endif|while \\[#1 LT 3\\]|endwhile|do|repeat \\[2\\]|endrepeat|break|continue)|#[12]=(#[12]\\+1|[0-3])|GOTO [12]|N[12]|IF\\[#1\\]GOTO[12]|WHILE\\[#2 LT 3\\]DO[12]|DO[12]|END[12]|G0 X#1|M98 P[12]|G65 P[12] A#2|O[12]|M99( P[12])?|M30|GR[12]|%",
            0..25,
        ),
    ) {
        let text = lines.join("\n");
        let checked = check_with(&text, &options());
        if checked.errors == 0 {
            prop_assert_eq!(positions_with(&text, &options()).len() as u64, checked.summary.moves);
        }
    }
}

/// Positions and events of a program in a dialect, a text each.
fn run_in(dialect: Dialect, text: &str) -> Vec<String> {
    let options = Options { dialect, ..options() };
    let checked = check_with(text, &options);
    assert_eq!(checked.errors, 0, "{text}: {:?}", checked.diagnostics);
    let source = Source::memory("test.nc", text.as_bytes());
    let machine = Machine::load("ideal").unwrap();
    let told = |motion: Motion| match motion {
        Motion::Move(step) => Axis::LINEAR.map(|axis| (step.to[axis] + 0.0).to_string()).join(","),
        Motion::Event(event) => event.kind.to_string(),
    };
    interp::motions(&source, &machine, &options).map(|motion| told(motion.unwrap())).collect()
}

#[test]
fn macro_b_reads_and_sets_the_control() {
    for (text, expected) in [
        ("G4 P500\nG4 P500.\nG4 X2\nM30", &["G4 P0.5", "G4 P500", "G4 P2", "M30"][..]),
        (
            "G10 L10 P2 R7\nG10 L12 P2 R3\n#2003=#2002+1\nG43 H3\nG0 Z#2602 X#5083\nM30",
            &["8,0,11", "M30"],
        ),
        ("G91 G20 F3\nG90 G0 X#4003 Y#4006 Z#4109\nM30", &["2311.4,508,3", "M30"]),
        ("#5221=5\nG0 X1\n#5221=6\nX1 Y#5021\nM30", &["6,0,0", "7,6,0", "M30"]),
        ("#3003=1 #3006=1 (TURN IT)\nG0 X1\nM30", &["M0", "1,0,0", "M30"]),
        (
            "G65 P1 A9 I1 J2 K3 I4 K5 I6\nM30\nO1 G0 X#7 Y#9 Z#10\nX#1 Y#4 Z#6\nM99",
            &["4,5,6", "9,1,3", "M30"],
        ),
    ] {
        assert_eq!(run_in(Dialect::Fanuc, text), expected, "{text}");
    }
    for number in ["3001", "3011", "1000", "5101", "4113"] {
        let options = Options { dialect: Dialect::Fanuc, ..options() };
        let checked = check_with(&format!("G0 X#{number}\nM30"), &options);
        assert_eq!(findings(&checked), ["bad-parameter 1:4"], "{number}");
    }
}

#[test]
fn what_is_told_of_odd_lines() {
    for (text, expected) in [
        // Codes are taken as near as RS274/NGC takes them.
        ("G0 X1\nM[30.00009]", &[][..]),
        ("F1 G1.00009 X1\nM30", &[]),
        ("G0 X1\nM[30.00011]\nM30", &["unknown-word 2:1"]),
        ("G65.00001 P1 A2\nM30\nO1\nG0 X#1\nM99", &[]),
        ("GOTO [0.1 * 3 * 10]\nX5\nN3 G0 X1\nM30", &[]),
        // Every line that block delete leaves out is warned of.
        ("/#1=5\nM30", &["block-delete 1:1"]),
        ("/o1 if [1]\n/o1 endif\nG0 X1\nM30", &["block-delete 1:1"]),
        ("/%\nG0 X1\nM30\n%", &["block-delete 1:1"]),
        ("/ (nothing)\nG0 X1\nM30", &[]),
        // Lengths that a cycle holds are of one unit.
        ("G20\nF10\nG81 X.1 Z-.1 R.1\nX.2\nG21 X1\nM30", &["missing-word 5:1"]),
        ("G20\nF10\nG81 X.1 Z-.1 R.1\nG21 X1 Z-1 R1\nX2\nM30", &[]),
        ("F1 G38.2\nM30", &["missing-word 1:1"]),
        ("G90.1 F1 G2 X2 I1\nM30", &["arc-center 1:1"]),
        ("G0\nG80\n@10 ^30\nM30", &["no-motion-mode 3:1"]),
        ("F1 G2 X1 I.5 P1.5\nM30", &["bad-value 1:14"]),
        ("M19 R361\nM30", &["bad-value 1:5"]),
        ("#[-1]=5\nM30", &["expression 1:1"]),
        ("M98 P[10**200]\nM30", &["bad-number 1:5"]),
        (
            "X--1 Y99999999999 Z1.2.3 A-\nM30",
            &["bad-number 1:1", "bad-number 1:6", "bad-number 1:19", "bad-number 1:26"],
        ),
        ("G0 X1\nM30\n\u{1a}\u{1a}", &[]),
    ] {
        assert_eq!(findings(&check_with(text, &options())), expected, "{text}");
    }
    let long = check_with("#1=[10**300]\nG4 P#1\nM30", &options());
    assert_eq!(long.diagnostics[0].message, "1e300 is beyond 1000000000");
    let names: String = (0..=100_000).map(|number| format!("#<a{number}>=1\n")).collect();
    assert_eq!(findings(&check_with(&(names + "M30"), &options())), ["bad-parameter 100001:1"]);
}

#[test]
fn modes_are_those_of_each_call() {
    for (text, expected) in [
        // A caller's are not its subprogram's.
        ("M70\no1 call\nM30\no1 sub\nM72\no1 endsub", &["nothing-saved 5:1"][..]),
        ("o1 sub\nM70\no1 endsub\no1 call\nM72\nM30", &["nothing-saved 5:1"]),
        ("M72\nM30", &["nothing-saved 1:1"]),
        ("M70\nM72 G0 X1\nM30", &["call-alone 2:5"]),
        // Its radius and its way in would be guessed.
        ("F100 G41.1 D2 G1 X9\nM70\nG40 X19\nM72\nX30\nM30", &["compensation-mode 4:1"]),
        ("S100 $1\nM30", &["bad-value 1:6"]),
        ("G0 @5\nM30", &["missing-word 1:4"]),
        ("G0 @5 ^10 X3\nM30", &["axis-words-twice 1:11"]),
        ("G18 G0 @5 ^10\nM30", &["unsupported-word 1:8"]),
        ("G92 @5 ^1\nM30", &["missing-word 1:1", "axis-words-twice 1:5"]),
        ("M64\nM68 E1\nM61\nM30", &["missing-word 1:1", "missing-word 2:1", "missing-word 3:1"]),
        (
            "#5220=2\n#5420=1\n#<_value>=3\nM30",
            &["bad-parameter 1:1", "bad-parameter 2:1", "bad-parameter 3:1"],
        ),
    ] {
        assert_eq!(findings(&check_with(text, &options())), expected, "{text}");
    }
    for (text, expected) in [
        ("G20\nM70 G21\nM72\nG0 X1\nM30", &["25.4,0,0", "M30"][..]),
        // Every pass of a subprogram ends by restoring.
        (
            "GR P1 L2\nG0 X1\nM30\nO1 M73\nG91 G0 X1 M8\nM99",
            &["M8", "1,0,0", "M9", "M8", "2,0,0", "M9", "1,0,0", "M30"],
        ),
        ("o1 sub\nM73\nG91\nM71\no1 endsub\no1 call\nG0 X1\nX1\nM30", &["1,0,0", "2,0,0", "M30"]),
        // Of another tool the length is its own.
        (
            "G10 L1 P1 Z5\nG10 L1 P2 Z7\nM61 Q1\nG43\nM70\nG49\nM61 Q2\nM72\nG0 Z0\nM30",
            &["M61 Q1", "M61 Q2", "0,0,7", "M30"],
        ),
        ("G10 L1 P1 Z5\nG43 H1\nM70\nG43.1 Z9\nM72\nG0 Z0\nM30", &["0,0,5", "M30"]),
    ] {
        assert_eq!(run_in(Dialect::Iso, text), expected, "{text}");
    }
}

#[test]
fn lenient_leaves_out_what_means_nothing_and_nothing_else() {
    let lenient = Options { lenient: true, ..options() };
    let text = "$H\n$32=1\nM117 Layer 1 of (2!\nM104 S200 T0\nM201 X500 Y500\nM220 S100\nG92 E0\nG1 X5 E.3 F600\n\
                G1 E-2 F1800\nM107\nG1 X6 E1\nM73 P5 R3\nM30";
    assert_eq!(check_with(text, &lenient).errors, 0);
    assert_eq!(positions_with(text, &lenient), ["5,0,0", "6,0,0"]);
    assert!(check_with(text, &options()).errors > 0);
    for (text, expected) in [
        ("$J=X5\nM30", "unsupported-word 1:1"),
        ("G0 X5 M82\nM30", "unknown-word 1:7"),
        ("M84 X1\nM30", "unknown-word 1:1"),
        ("M600\nM30", "unknown-word 1:1"),
        ("M220 S50\nM30", "unknown-word 1:1"),
    ] {
        assert_eq!(findings(&check_with(text, &lenient)), [expected], "{text}");
    }
}
