//! `cnc plot` through its binary: every sample gives a drawing that is well-formed, small and always the same.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use resvg::usvg::roxmltree::Document;

/// No drawing is larger, however long the program.
const BYTES_MAX: usize = 1_000_000;

fn cnc(args: &[&str]) -> Output {
    let mut process = Command::new(env!("CARGO_BIN_EXE_cnc"));
    process.env_remove("CNC_MACHINE").stdin(Stdio::null());
    process.current_dir(env!("CARGO_MANIFEST_DIR")).args(args).output().unwrap()
}

/// Draws, and gives the document: well-formed, small, the same twice, without numbers that are none.
#[track_caller]
fn check(args: &[&str], code: i32) -> String {
    let all = [&["plot", "-q"], args].concat();
    let [first, second] = [cnc(&all), cnc(&all)];
    let said = String::from_utf8_lossy(&first.stderr);
    assert_eq!(first.status.code(), Some(code), "{args:?}: {said}");
    assert!(first.stdout == second.stdout, "{args:?}: not the same twice");
    assert!(first.stdout.len() < BYTES_MAX, "{args:?}: {} bytes", first.stdout.len());
    let text = String::from_utf8(first.stdout).unwrap();
    Document::parse(&text).unwrap_or_else(|error| panic!("{args:?}: {error}"));
    assert!(!text.contains("NaN") && !text.contains("inf "), "{args:?}");
    text
}

#[track_caller]
fn refused(args: &[&str], code: i32, says: &str) {
    let output = cnc(&[&["plot"], args].concat());
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{args:?}: {said}");
    assert!(said.contains(says), "{args:?}: {said}");
}

fn samples() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/good");
    let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    files.filter(|path| path.extension().is_some_and(|ending| ending == "nc")).collect()
}

#[test]
fn every_sample_is_drawn() {
    for path in samples() {
        let text = check(&[path.to_str().unwrap(), "-m", "ideal"], 0);
        assert!(text.contains("isometric"));
    }
}

/// `UPDATE=1 cargo test --test plot` draws them anew.
#[test]
fn the_pictures_of_the_manual_are_drawn_so() {
    let folder = tempfile::tempdir().unwrap();
    let dump = folder.path().join("thesis.csv");
    let dump = dump.to_str().unwrap();
    cnc(&["interpolate", "samples/good/planes.nc", "--encoder", "thesis", "--csv", "-o", dump]);
    for (picture, args) in [
        ("pyramid.svg", &["samples/good/pyramid-with-pockets.nc"][..]),
        ("speed.svg", &["samples/good/two-tools.nc", "--curve", "speed"]),
        ("error.svg", &["samples/good/planes.nc", "--curve", "error"]),
        ("fig-5-9.svg", &["samples/good/o001.nc", "--view", "xy"]),
        ("fig-6-7.svg", &["samples/good/planes.nc", "--curve", "encoders"]),
        ("fig-6-8.svg", &[dump, "--view", "xy"]),
    ] {
        let text = check(args, 0);
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs").join(picture);
        if std::env::var_os("UPDATE").is_some() {
            fs::write(&path, &text).unwrap();
        }
        let is_same = fs::read_to_string(path).is_ok_and(|held| held == text);
        assert!(is_same, "docs/{picture} is of another time");
    }
}

#[test]
fn a_view_shows_path_travel_seams_and_lines() {
    let text = check(&["samples/good/pyramid-with-pockets.nc"], 0);
    for part in ["rapid", "travel", "end of a node buffer (23)", ": X15 Y15</title>"] {
        assert!(text.contains(part), "{part}");
    }
    let one = check(&["samples/good/pyramid-with-pockets.nc", "--view", "zx"], 0);
    assert!(one.contains("ZX, from the front") && !one.contains("isometric"));
}

#[test]
fn a_lathe_is_drawn_with_z_to_the_right() {
    let pockets = ["samples/lathe/pockets.nc", "--dialect", "fanuc-lathe", "-m"];
    for machine in ["samples/machines/lathe.toml", "ideal"] {
        let text = check(&[&pockets[..], &[machine]].concat(), 0);
        assert!(text.contains("ZX, X as a radius") && !text.contains("from above"), "{machine}");
    }
}

#[test]
fn where_nothing_moves_the_drawing_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("still.nc");
    fs::write(&file, "G21 G90\nM3 S1000\nG4 P1\nM30\n").unwrap();
    let text = check(&[file.to_str().unwrap()], 0);
    assert_eq!(text.matches(">nothing moves</text>").count(), 4);
    assert!(text.contains(">travel</text>"));
}

#[test]
fn curves_have_their_limits() {
    for (curve, part) in [
        ("error", ">bound<"),
        ("speed", ">limit of X Y Z<"),
        ("acceleration", ">limit of X Y Z<"),
        ("steps", ">limit of X Y Z<"),
        ("encoders", "encoder of the thesis"),
    ] {
        let text = check(&["samples/good/planes.nc", "--curve", curve], 0);
        assert!(text.contains(part), "{curve}: {part}");
    }
}

#[test]
fn what_leaves_the_travel_is_ringed() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("far.nc");
    fs::write(&file, "G21 G90 F300\nG1 X10\nG1 Y80\nM30\n").unwrap();
    let text = check(&[file.to_str().unwrap()], 1);
    assert!(text.contains("line 3 leaves the travel"));
    fs::write(&file, "G21 G90\nG1 X10\nM30\n").unwrap();
    refused(&[file.to_str().unwrap()], 1, "no-feed");
}

#[test]
fn a_long_program_stays_small() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("raster.nc");
    let mut text = String::from("G21 G90 F3000\n");
    for row in 0..20_000 {
        let x = if row % 2 == 0 { 90.0 } else { 0.0 } + f64::from(row % 37) * 0.1;
        text += &format!(
            "G1 X{x:.3} Y{:.4} Z{:.3}\n",
            f64::from(row) * 0.004,
            f64::from(row % 11) * 0.2
        );
    }
    fs::write(&file, text + "M30\n").unwrap();
    let text = check(&[file.to_str().unwrap(), "-m", "router"], 0);
    assert!(text.len() > 100_000, "hardly anything is left: {} bytes", text.len());
}

#[test]
fn dumps_are_drawn_and_what_they_lack_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let dump = folder.path().join("o001.csv");
    let dump = dump.to_str().unwrap();
    cnc(&["interpolate", "samples/good/o001.nc", "--csv", "-o", dump, "-q"]);
    let text = check(&[dump], 0);
    assert!(text.contains("(of o001.nc)"));
    check(&[dump, "--curve", "steps"], 0);
    refused(&[dump, "--curve", "error"], 2, "plot its program");
    refused(&[dump, "-m", "router"], 1, "made for machine 'starmill'");
}

#[test]
fn what_is_read_is_never_written_over() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("part.nc");
    let name = file.to_str().unwrap();
    let text = "G21 G90 F300\nM3 S100\nG1 X10\nM30\n";
    fs::write(&file, text).unwrap();
    let link = folder.path().join("link.svg");
    std::os::unix::fs::symlink(&file, &link).unwrap();
    for args in [
        &["plot", name, "-o", link.to_str().unwrap()][..],
        &["report", name, "-o", name],
        &["interpolate", name, "--csv", "-o", name],
        &["interpolate", name, "--method", "b", "--svg", name],
        &["send", "sim:", name, "--trace", name],
        &["send", "sim:", name, "--plc", "sim:", "--signals", name],
    ] {
        let output = cnc(args);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {said}");
        assert!(said.contains("this command reads it"), "{args:?}: {said}");
        assert_eq!(fs::read_to_string(&file).unwrap(), text, "{args:?}");
    }
    refused(&[name, "-o", "part.jpg"], 2, "written as .svg or .png");
    refused(&[name, "--json"], 2, "a drawing has no JSON");
}

#[test]
fn pictures_in_dots() {
    let folder = tempfile::tempdir().unwrap();
    let picture = folder.path().join("o001.PNG");
    let name = picture.to_str().unwrap();
    let output = cnc(&["plot", "samples/good/o001.nc", "-q", "-o", name, "--width", "400"]);
    let said = String::from_utf8_lossy(&output.stderr);
    if output.status.code() == Some(2) && said.contains("a PNG needs a font") {
        return;
    }
    assert!(output.status.success(), "{said}");
    let bytes = fs::read(&picture).unwrap();
    assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n");
    assert_eq!(bytes[16..20], 400_u32.to_be_bytes());
}
