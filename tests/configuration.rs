//! Options go before `CNC_*`, that before the folder's `cnc.toml`, and that before the user's own.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Output};

/// A folder with a place for the user's own configuration.
struct Place {
    folder: tempfile::TempDir,
}

impl Place {
    fn new() -> Place {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir_all(folder.path().join("config/cnc")).unwrap();
        Place { folder }
    }

    fn path(&self) -> &Path {
        self.folder.path()
    }

    fn write(&self, file: &str, text: &str) {
        fs::write(self.path().join(file), text).unwrap();
    }

    fn run(&self, args: &[&str], environment: &[(&str, &str)]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_cnc"));
        command.args(args).current_dir(self.path()).env_clear();
        command.env("XDG_CONFIG_HOME", self.path().join("config")).env("HOME", self.path());
        command.envs(environment.iter().copied()).output().unwrap()
    }

    /// Which machine is shown, and who has chosen it.
    fn machine(&self, args: &[&str], environment: &[(&str, &str)]) -> [String; 2] {
        let output = self.run(&[&["machine", "show", "--json"], args].concat(), environment);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let shown: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        ["id", "chosen_by"].map(|key| shown[key].as_str().unwrap().to_owned())
    }
}

#[test]
fn the_nearer_word_counts() {
    let place = Place::new();
    assert_eq!(place.machine(&[], &[]), ["starmill", "default"]);
    place.write("config/cnc/cnc.toml", "# mine\nmachine = \"ideal\"\nmax_errors = 7\n");
    let users = place.path().join("config/cnc/cnc.toml").display().to_string();
    assert_eq!(place.machine(&[], &[]), ["ideal".to_owned(), format!("{users}:2")]);
    place.write("cnc.toml", "machine = \"router\"\n");
    assert_eq!(place.machine(&[], &[]), ["router", "cnc.toml:1"]);
    let environment = [("CNC_MACHINE", "kimm")];
    assert_eq!(place.machine(&[], &environment), ["kimm", "CNC_MACHINE"]);
    assert_eq!(place.machine(&["-m", "starmill"], &environment), ["starmill", "--machine"]);
    assert_eq!(place.machine(&["kimm-table"], &environment), ["kimm-table", "the command line"]);
}

#[test]
fn a_variable_that_is_empty_says_nothing() {
    let place = Place::new();
    place.write("cnc.toml", "machine = \"router\"\n");
    for name in ["CNC_MACHINE", "CNC_COLOR", "CNC_MAX_ERRORS", "CNC_NO_INPUT", "CNC_DIALECT"] {
        assert_eq!(place.machine(&[], &[(name, "")]), ["router", "cnc.toml:1"], "{name}");
    }
    for word in ["1", "yes", "ON", "0", "no", "False"] {
        place.machine(&[], &[("CNC_NO_INPUT", word)]);
    }
    // Other programs have variables of their own, and a hook is given these.
    for name in ["CNC_LINE", "CNC_EVENT", "CNC_SPINDLE_HOST"] {
        let said = place.run(&["bus"], &[(name, "7")]).stderr;
        assert!(!String::from_utf8_lossy(&said).contains(name), "{name}");
    }
    let said = place.run(&["bus", "-q"], &[("CNC_MACHNE", "7")]).stderr;
    assert_eq!(String::from_utf8_lossy(&said), "");
    place.write("cnc.toml", "machine = \"ruoter\"\n");
    let said = place.run(&["bus"], &[]).stderr;
    let said = String::from_utf8_lossy(&said);
    assert!(said.starts_with("error: cnc.toml:1: no machine profile 'ruoter'"), "{said}");
}

#[test]
fn other_defaults_are_read_too() {
    let place = Place::new();
    let many = "G999\n".repeat(9) + "M30\n";
    place.write("many.nc", &many);
    let errors = |args: &[&str], environment: &[(&str, &str)]| {
        let output = place.run(&[&["interpret", "many.nc"], args].concat(), environment);
        assert_eq!(output.status.code(), Some(1));
        String::from_utf8(output.stderr).unwrap().matches("error[").count()
    };
    let all = errors(&[], &[]);
    assert!(all > 4, "{all}");
    place.write("config/cnc/cnc.toml", "max_errors = 4\ndialect = \"grbl\"\ncolor = \"never\"");
    assert_eq!(errors(&[], &[]), 4);
    assert_eq!(errors(&[], &[("CNC_MAX_ERRORS", "3")]), 3);
    assert_eq!(errors(&["--max-errors", "2"], &[("CNC_MAX_ERRORS", "3")]), 2);
    place.write("good.nc", "G21 G90\nG0 X1\nM30\n");
    let dump = place.run(&["interpolate", "good.nc", "--csv", "-o", "good.csv"], &[]);
    assert!(dump.status.success());
    let header = fs::read_to_string(place.path().join("good.csv")).unwrap();
    assert!(header.contains("# options: dialect=grbl\n"), "{header}");
    // A default is no option that could have no effect, and verify asks the dump.
    assert!(place.run(&["plot", "good.csv", "-o", "good.svg"], &[]).status.success());
    assert!(place.run(&["verify", "good.nc", "good.csv"], &[]).status.success());
}

#[test]
fn files_are_looked_for_from_the_folder_that_names_them() {
    let place = Place::new();
    let profile = place.run(&["machine", "show", "router", "--toml"], &[]).stdout;
    place.write("config/cnc/mine.toml", &String::from_utf8(profile).unwrap());
    place.write("config/cnc/cnc.toml", "machine = \"mine.toml\"\n");
    assert_eq!(place.machine(&[], &[])[0], "mine");
}

/// A pipe is not waited for; the user's own file stops nothing but what would ask it for the machine.
#[test]
fn a_configuration_that_cannot_be_read_is_told() {
    let place = Place::new();
    let users = place.path().join("config/cnc/cnc.toml");
    symlink(&users, &users).unwrap();
    let said = |args: &[&str], code: i32| {
        let output = place.run(args, &[]);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(code), "{args:?}: {said}");
        said
    };
    assert!(
        said(&["explain", "G0"], 0).starts_with("warning: the user's own configuration is not")
    );
    assert!(said(&["bus"], 2).contains("may name another machine than starmill"));
    assert_eq!(said(&["bus", "-q", "-m", "starmill"], 0), "");
    place.write("cnc.toml", "machine = \"router\"\n");
    assert_eq!(said(&["bus", "-q"], 0), "");
    fs::remove_file(&users).unwrap();
    fs::remove_file(place.path().join("cnc.toml")).unwrap();
    for file in ["config/cnc/cnc.toml", "cnc.toml"] {
        let pipe = place.path().join(file);
        assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        assert!(said(&["bus"], 2).contains("is no file that can be read again and again"));
        fs::remove_file(&pipe).unwrap();
    }
}

#[test]
fn mistakes_are_told_with_their_place() {
    let place = Place::new();
    for (text, expected) in [
        ("\nmachne = \"router\"", ["cnc.toml:2:1", "did you mean 'machine'?"]),
        ("dialect = \"fanuk\"", ["cnc.toml:1:11", "did you mean \"fanuc\"?"]),
        ("machine = 7", ["cnc.toml:1:11", "a string in quotes"]),
        ("[port.mill]", ["cnc.toml:1:2", "did you mean 'ports'?"]),
    ] {
        place.write("cnc.toml", text);
        let output = place.run(&["explain", "G0"], &[]);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{text}: {said}");
        assert!(expected.iter().all(|expected| said.contains(expected)), "{text}: {said}");
    }
}

#[test]
fn every_value_of_a_machine_has_an_origin() {
    let place = Place::new();
    let profile = place.run(&["machine", "show", "router", "--toml"], &[]).stdout;
    let profile = String::from_utf8(profile).unwrap();
    let less: Vec<&str> = profile.lines().filter(|line| !line.starts_with("baud")).collect();
    place.write("mine.toml", &less.join("\n"));
    let shown = place.run(&["machine", "show", "mine.toml"], &[]).stdout;
    let shown = String::from_utf8(shown).unwrap();
    let (_, origins) = shown.split_once("from\n").unwrap();
    assert!(origins.lines().count() > 30, "{shown}");
    for line in origins.lines() {
        let from = if line.starts_with("bus.baud") { "default" } else { "mine.toml:" };
        assert!(line.contains(from), "{line}");
    }
}
