//! The action, the hooks and the samples of CI: every command in them is run here as it would be there.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

fn text(name: &str) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(name)).unwrap()
}

/// The scripts of all `run:` keys of a YAML text: what stands behind, or indented below `run: |`.
fn scripts(yaml: &str) -> Vec<String> {
    let indent = |line: &str| line.len() - line.trim_start().len();
    let mut scripts = Vec::new();
    let lines: Vec<&str> = yaml.lines().collect();
    for (at, line) in lines.iter().enumerate() {
        let Some(script) = line.trim_start().trim_start_matches("- ").strip_prefix("run: ") else {
            continue;
        };
        if script != "|" {
            scripts.push(script.to_owned());
            continue;
        }
        let below = lines[at + 1..].iter().take_while(|below| indent(below) > indent(line));
        scripts.push(below.map(|below| format!("{}\n", below.trim_start())).collect());
    }
    scripts
}

/// What stands behind a key, each time.
fn values<'a>(yaml: &'a str, key: &str) -> Vec<&'a str> {
    let lines = yaml.lines().map(|line| line.trim_start().trim_start_matches("- "));
    lines.filter_map(|line| line.strip_prefix(key)?.strip_prefix(": ")).collect()
}

/// A folder with the programs of a repository in `parts`.
fn repository(programs: &[&str]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("parts")).unwrap();
    for program in programs {
        let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples").join(program);
        let name = Path::new(program).file_name().unwrap();
        fs::copy(from, folder.path().join("parts").join(name)).unwrap();
    }
    folder
}

/// Runs a script as a step of a workflow does; gives its code and all that it prints.
fn step(script: &str, folder: &Path, environment: &[(&str, &str)]) -> (Option<i32>, String) {
    let program = PathBuf::from(env!("CARGO_BIN_EXE_cnc"));
    let path = std::env::var("PATH").unwrap_or_default();
    let path = format!("{}:{path}", program.parent().unwrap().display());
    let output = Command::new("bash")
        .args(["--noprofile", "--norc", "-eo", "pipefail", "-c", script])
        .current_dir(folder)
        .env_remove("CNC_MACHINE")
        .env("PATH", path)
        .envs(environment.iter().copied())
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let [out, said] = [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
    (output.status.code(), out + &said)
}

#[test]
fn the_action_checks_what_it_is_given() {
    let action = text("action.yml");
    let [install, check] = scripts(&action).try_into().expect("two steps");
    let folder = repository(&["good/planes.nc", "good/inches.nc", "bad/no-feed.nc"]);
    assert_eq!(step(&install, folder.path(), &[("ACTION_PATH", "none")]).0, Some(0));
    for (files, command, machine, args, code, marked) in [
        ("parts", "verify", "starmill", "", 1, 1),
        ("parts", "interpret", "starmill", "--max-errors 5 -q", 1, 1),
        ("parts/planes.nc\n\nparts/inches.nc\n", "verify", "starmill", "", 0, 0),
        ("parts/planes.nc", "interpret", "nosuch", "", 2, 0),
        ("-v", "interpret", "starmill", "", 2, 1),
    ] {
        let environment =
            [("FILES", files), ("COMMAND", command), ("MACHINE", machine), ("ARGS", args)];
        let (found, printed) = step(&check, folder.path(), &environment);
        assert_eq!(found, Some(code), "{files} {command}: {printed}");
        assert_eq!(printed.matches("::error ").count(), marked, "{printed}");
    }
    // Every input is used, by the environment alone: none is put into a script.
    for input in ["files", "machine", "command", "args"] {
        assert_eq!(action.matches(&format!("${{{{ inputs.{input} }}}}")).count(), 1, "{input}");
    }
    assert!(!check.contains("${{") && !install.contains("${{"));
}

#[test]
fn the_sample_workflow_runs() {
    let workflow = text("samples/ci/nc-programs.yml");
    let commands: Vec<String> =
        scripts(&workflow).into_iter().filter(|script| script.starts_with("cnc ")).collect();
    assert_eq!(commands.len(), 2);
    for (bad, code) in [(None, 0), (Some("bad/no-feed.nc"), 1)] {
        let programs: Vec<&str> = ["good/planes.nc"].into_iter().chain(bad).collect();
        let folder = repository(&programs);
        for command in &commands {
            let (found, printed) = step(command, folder.path(), &[]);
            assert_eq!(found, Some(code), "{command}: {printed}");
            let output = command.split(" -o ").nth(1).unwrap();
            assert!(workflow.contains(&format!(": {output}\n")), "{output} is used");
            assert!(fs::metadata(folder.path().join(output)).unwrap().len() > 0);
        }
    }
    let action = text("action.yml");
    let given = workflow.split("uses: OWNER/cnc@main").nth(1).unwrap();
    let given = given.lines().skip(2).take_while(|line| line.starts_with("          "));
    for input in given.map(|line| line.split(':').next().unwrap().trim()) {
        assert!(action.contains(&format!("\n  {input}:\n")), "{input} is no input of the action");
    }
}

#[test]
fn the_hooks_pass_and_fail_as_the_programs_do() {
    let hooks = text(".pre-commit-hooks.yaml");
    let entries = values(&hooks, "entry");
    assert_eq!(entries.len(), 2);
    let folder =
        repository(&["good/planes.nc", "good/inches.nc", "good/slots.nc", "bad/no-feed.nc"]);
    let config = text("samples/ci/.pre-commit-config.yaml");
    let args = values(&config, "args")[0].trim_matches(['[', ']']).replace(',', "");
    for (entry, args) in entries.into_iter().zip(["", &args]) {
        for (files, code) in [
            ("parts/planes.nc", 0),
            ("parts/planes.nc parts/inches.nc", 0),
            ("parts/planes.nc parts/inches.nc parts/slots.nc", 0),
            ("parts/planes.nc parts/no-feed.nc", 1),
            ("parts/no-feed.nc", 1),
        ] {
            let (found, printed) = step(&format!("{entry} {args} {files}"), folder.path(), &[]);
            assert_eq!(found, Some(code), "{entry} {files}: {printed}");
            assert_eq!(printed.contains("error[no-feed]"), code == 1, "{printed}");
        }
    }
    for id in values(&config, "id") {
        assert!(values(&hooks, "id").contains(&id), "{id}");
    }
}

#[test]
fn the_hooks_are_for_the_files_that_folders_are_searched_for() {
    let folder = tempfile::tempdir().unwrap();
    let (_, printed) = step("cnc interpret .", folder.path(), &[]);
    let endings = printed.split('(').nth(1).unwrap().split(')').next().unwrap();
    let endings = endings.replace(" .", "|").replace('.', "");
    for files in values(&text(".pre-commit-hooks.yaml"), "files") {
        assert_eq!(files, format!("(?i)\\.({endings})$"));
    }
}
