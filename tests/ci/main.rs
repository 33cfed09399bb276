//! The action, the hooks and the samples of CI: every command in them is run here as it would be there.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use workflow::{Runner, Step};
use yaml_rust2::Yaml;

mod release;
mod workflow;

/// The texts of a key, in every mapping of a list.
fn values(list: &Yaml, key: &str) -> Vec<String> {
    let items = list.as_vec().unwrap().iter();
    items.filter_map(|item| item[key].as_str().map(str::to_owned)).collect()
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

/// Runs a command line as a hook or a person does; gives its code and all that it prints.
fn line(script: &str, folder: &Path) -> (Option<i32>, String) {
    let step = Step::of(script);
    Runner::new(folder, true).run(&step)
}

/// Runs an action in a folder with these inputs, the others as the action has them, until a step fails.
fn act(runner: &mut Runner, inputs: &[(&str, &str)]) -> (Option<i32>, String) {
    let action = workflow::load("action.yml");
    assert_eq!(action["runs"]["using"].as_str(), Some("composite"));
    for (name, input) in action["inputs"].as_hash().unwrap() {
        assert!(!input["description"].as_str().unwrap().is_empty());
        let default = input["default"].as_str().unwrap();
        runner.context.insert(format!("inputs.{}", name.as_str().unwrap()), default.to_owned());
    }
    for (name, value) in inputs {
        let before = runner.context.insert(format!("inputs.{name}"), (*value).to_owned());
        assert!(before.is_some(), "{name} is no input of the action");
    }
    let mut all = String::new();
    for step in workflow::steps(&action["runs"], &Yaml::BadValue) {
        let (code, printed) = runner.run(&step);
        all += &printed;
        if code != Some(0) {
            return (code, all);
        }
    }
    (Some(0), all)
}

/// A runner whose `cnc` is there already, as the action's first step would leave it.
fn runner(folder: &Path) -> Runner {
    let mut runner = Runner::new(folder, true);
    runner.context.insert("github.action_path".to_owned(), "/nowhere".to_owned());
    runner
}

#[test]
fn the_action_checks_what_it_is_given() {
    let folder = repository(&["good/planes.nc", "good/inches.nc", "bad/no-feed.nc"]);
    for (inputs, code, marked) in [
        (&[("files", "parts")][..], 1, 1),
        (&[], 1, 1),
        (&[("files", "parts"), ("command", "interpret"), ("args", "--max-errors 5\n-q\n")], 1, 1),
        (&[("files", "parts/planes.nc\n\nparts/inches.nc\n")], 0, 0),
        (&[("files", "parts/planes.nc"), ("command", "interpret"), ("machine", "nosuch")], 2, 0),
        (&[("files", "-v"), ("command", "interpret")], 2, 1),
        (&[("files", "")], 2, 0),
        (&[("files", "parts/planes.nc"), ("args", "--nosuch")], 2, 0),
        (&[("files", "$(touch injected)\n`touch injected`\n'; touch injected; '")], 2, 3),
        (&[("files", "parts/planes.nc"), ("args", "$(touch injected) ; touch injected")], 2, 5),
    ] {
        let (found, printed) = act(&mut runner(folder.path()), inputs);
        assert_eq!(found, Some(code), "{inputs:?}: {printed}");
        assert_eq!(printed.matches("::error ").count(), marked, "{inputs:?}: {printed}");
        assert!(!folder.path().join("injected").exists(), "{inputs:?}");
    }
}

#[test]
fn every_option_of_the_action_is_taken_from_every_line() {
    let folder = repository(&["bad/no-feed.nc"]);
    let inputs = [("command", "interpret"), ("args", "--max-errors 5\n\n--nosuch")];
    let (code, printed) = act(&mut runner(folder.path()), &inputs);
    assert_eq!(code, Some(2), "{printed}");
    assert!(printed.contains("--nosuch"), "{printed}");
}

#[test]
fn the_action_installs_what_is_not_there() {
    let folder = repository(&["good/planes.nc"]);
    let tools = tempfile::tempdir().unwrap();
    let cargo = tools.path().join("cargo");
    // Stands for cargo: installs the binary under test where cargo would.
    let cnc = env!("CARGO_BIN_EXE_cnc");
    let script = format!(
        "#!/bin/sh\n[ \"$*\" = 'install --locked --path /action' ] || exit 3\n\
         mkdir -p \"$CARGO_HOME/bin\" && ln -s {cnc} \"$CARGO_HOME/bin/cnc\"\n"
    );
    fs::write(&cargo, script).unwrap();
    fs::set_permissions(&cargo, fs::Permissions::from_mode(0o755)).unwrap();
    let mut runner = Runner::new(folder.path(), false);
    let home = tools.path().join("home").to_str().unwrap().to_owned();
    runner.env.insert("CARGO_HOME".to_owned(), home.clone());
    runner.env.insert("PATH".to_owned(), "/usr/bin:/bin".to_owned());
    runner.path.push(tools.path().to_owned());
    runner.context.insert("github.action_path".to_owned(), "/action".to_owned());
    let (code, printed) = act(&mut runner, &[]);
    assert_eq!(code, Some(0), "{printed}");
    assert!(fs::exists(format!("{home}/bin/cnc")).unwrap());
}

#[test]
fn the_sample_workflow_runs() {
    let sample = workflow::load("samples/ci/nc-programs.yml");
    let reports = &sample["jobs"]["reports"];
    let steps = workflow::steps(reports, &sample["defaults"]);
    let commands: Vec<&Step> =
        steps.iter().filter(|step| step.script.starts_with("cnc ")).collect();
    assert_eq!(commands.len(), 2);
    // The second is run when the first has failed, too.
    assert_eq!(commands[1].condition.as_deref(), Some("always()"));
    let used = reports["steps"].as_vec().unwrap().iter();
    let used: Vec<String> =
        used.flat_map(|step| workflow::texts(&step["with"])).map(|(_, value)| value).collect();
    for (bad, code) in [(None, 0), (Some("bad/no-feed.nc"), 1)] {
        let programs: Vec<&str> = ["good/planes.nc"].into_iter().chain(bad).collect();
        let folder = repository(&programs);
        let mut runner = runner(folder.path());
        for command in &commands {
            let (found, printed) = runner.run(command);
            assert_eq!(found, Some(code), "{}: {printed}", command.script);
            let output = command.script.split(" -o ").nth(1).unwrap();
            assert!(used.iter().any(|value| value == output), "{output} is used");
            assert!(fs::metadata(folder.path().join(output)).unwrap().len() > 0);
        }
        let uses = &sample["jobs"]["annotations"]["steps"][1];
        assert_eq!(uses["uses"].as_str(), Some("OWNER/cnc@main"));
        let inputs = workflow::texts(&uses["with"]);
        let inputs: Vec<(&str, &str)> =
            inputs.iter().map(|(name, value)| (name.as_str(), value.as_str())).collect();
        let (found, printed) = act(&mut runner, &inputs);
        assert_eq!(found, Some(code), "{printed}");
    }
}

#[test]
fn the_hooks_pass_and_fail_as_the_programs_do() {
    let hooks = workflow::load(".pre-commit-hooks.yaml");
    let folder =
        repository(&["good/planes.nc", "good/inches.nc", "good/slots.nc", "bad/no-feed.nc"]);
    let config = workflow::load("samples/ci/.pre-commit-config.yaml");
    let [chosen] = &config["repos"][0]["hooks"].as_vec().unwrap()[..] else { panic!("one hook") };
    let mut commands = values(&hooks, "entry");
    assert_eq!(commands.len(), 2);
    let at = values(&hooks, "id").iter().position(|id| Some(&**id) == chosen["id"].as_str());
    let args = chosen["args"].as_vec().unwrap().iter().map(|arg| arg.as_str().unwrap());
    commands.push(args.fold(commands[at.unwrap()].clone(), |line, arg| line + " " + arg));
    for command in commands {
        for (files, code) in [
            ("parts/planes.nc", 0),
            ("parts/planes.nc parts/inches.nc", 0),
            ("parts/planes.nc parts/inches.nc parts/slots.nc", 0),
            ("parts/planes.nc parts/no-feed.nc", 1),
            ("parts/no-feed.nc", 1),
        ] {
            let (found, printed) = line(&format!("{command} {files}"), folder.path());
            assert_eq!(found, Some(code), "{command} {files}: {printed}");
            assert_eq!(printed.contains("error[no-feed]"), code == 1, "{printed}");
        }
    }
}

#[test]
fn the_hooks_are_for_the_files_that_folders_are_searched_for() {
    let folder = tempfile::tempdir().unwrap();
    let (_, printed) = line("cnc interpret .", folder.path());
    let endings = printed.split('(').nth(1).unwrap().split(')').next().unwrap();
    let endings = endings.replace(" .", "|").replace('.', "");
    for files in values(&workflow::load(".pre-commit-hooks.yaml"), "files") {
        assert_eq!(files, format!("(?i)\\.({endings})$"));
    }
}
