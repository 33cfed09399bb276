//! Workflows and composite actions, read as YAML; their steps are run here as GitHub's runner runs
//! them: the shell with its options, expressions of `env:` filled in, and the files by which a step
//! hands something to those after it. Steps that use other actions are left to the tests that load them.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use yaml_rust2::{Yaml, YamlLoader};

/// A file of this repository, as YAML.
pub fn load(name: &str) -> Yaml {
    let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(name)).unwrap();
    let [document] = YamlLoader::load_from_str(&text).unwrap().try_into().expect("one document");
    document
}

/// The texts of a mapping, as `env:` and `with:` have them.
pub fn texts(mapping: &Yaml) -> Vec<(String, String)> {
    let pairs = mapping.as_hash().into_iter().flatten();
    pairs.map(|(key, value)| (text(key), text(value))).collect()
}

fn text(value: &Yaml) -> String {
    match value {
        Yaml::String(text) => text.clone(),
        Yaml::Boolean(value) => value.to_string(),
        Yaml::Integer(value) => value.to_string(),
        other => panic!("no text: {other:?}"),
    }
}

/// A step with a script.
pub struct Step {
    /// Its name, or its script where it has none.
    pub name: String,
    /// What it runs.
    pub script: String,
    /// `if:`, as it is written.
    pub condition: Option<String>,
    has_pipefail: bool,
    env: Vec<(String, String)>,
}

impl Step {
    /// A step that is a script and nothing else.
    pub fn of(script: &str) -> Step {
        let [name, script] = [script, script].map(str::to_owned);
        Step { name, script, condition: None, has_pipefail: true, env: Vec::new() }
    }
}

/// The steps with scripts of a job, or of the `runs` of an action. No script may hold an expression:
/// what stands in it would become a part of the script.
pub fn steps(job: &Yaml, defaults: &Yaml) -> Vec<Step> {
    let steps = job["steps"].as_vec().expect("steps");
    let scripts = steps.iter().filter_map(|step| Some((step, step["run"].as_str()?)));
    scripts
        .map(|(step, script)| {
            assert!(!script.contains("${{"), "an expression in a script: {script}");
            let shell = step["shell"].as_str().or(defaults["run"]["shell"].as_str());
            assert!([None, Some("bash")].contains(&shell), "{shell:?}");
            Step {
                name: step["name"].as_str().unwrap_or(script).to_owned(),
                script: script.to_owned(),
                condition: step["if"].as_str().map(str::to_owned),
                has_pipefail: shell.is_some(),
                env: texts(&step["env"]),
            }
        })
        .collect()
}

/// A runner in the middle of a job.
pub struct Runner {
    /// Where steps run: the root of a repository.
    pub folder: PathBuf,
    /// What expressions stand for, as `inputs.files`.
    pub context: BTreeMap<String, String>,
    /// The environment, as steps have left it.
    pub env: BTreeMap<String, String>,
    /// Folders of programs, as steps have left them; the last is searched first.
    pub path: Vec<PathBuf>,
    files: tempfile::TempDir,
}

impl Runner {
    /// A runner for a folder, whose path begins with that of the `cnc` under test where `has_cnc`.
    pub fn new(folder: &Path, has_cnc: bool) -> Runner {
        let cnc = Path::new(env!("CARGO_BIN_EXE_cnc")).parent().unwrap().to_path_buf();
        let files = tempfile::tempdir().unwrap();
        let mut env = BTreeMap::from([("CI".to_owned(), "true".to_owned())]);
        for name in ["GITHUB_ENV", "GITHUB_PATH", "GITHUB_OUTPUT", "GITHUB_STEP_SUMMARY"] {
            let file = files.path().join(name);
            fs::write(&file, "").unwrap();
            env.insert(name.to_owned(), file.to_str().unwrap().to_owned());
        }
        env.insert("RUNNER_TEMP".to_owned(), files.path().to_str().unwrap().to_owned());
        env.insert("GITHUB_WORKSPACE".to_owned(), folder.to_str().unwrap().to_owned());
        let path = if has_cnc { vec![cnc] } else { Vec::new() };
        Runner { folder: folder.to_owned(), context: BTreeMap::new(), env, path, files }
    }

    /// A text with its expressions filled in; those without a value here are a mistake of the file.
    pub fn fill(&self, text: &str) -> String {
        let mut parts = text.split("${{");
        let mut filled = parts.next().unwrap_or_default().to_owned();
        for part in parts {
            let (name, rest) = part.split_once("}}").expect("an end of the expression");
            let value = self.context.get(name.trim());
            filled += value.unwrap_or_else(|| panic!("{} has no value", name.trim()));
            filled += rest;
        }
        filled
    }

    /// Runs a step and takes what it hands on; gives its code and all that it prints.
    pub fn run(&mut self, step: &Step) -> (Option<i32>, String) {
        let path = self.path.iter().rev().map(|folder| folder.display().to_string());
        let given = self.env.get("PATH").cloned();
        let given = given.unwrap_or_else(|| std::env::var("PATH").unwrap_or_default());
        let path = path.chain([given]);
        let path = path.collect::<Vec<_>>().join(":");
        let script = self.files.path().join("script.sh");
        fs::write(&script, &step.script).unwrap();
        let mut shell = Command::new("bash");
        if step.has_pipefail {
            shell.args(["--noprofile", "--norc", "-eo", "pipefail"]);
        } else {
            shell.arg("-e");
        }
        let output = shell
            .arg(script)
            .current_dir(&self.folder)
            .env_remove("CNC_MACHINE")
            .env_remove("CARGO_TARGET_DIR")
            .envs(&self.env)
            .env("PATH", path)
            .envs(step.env.iter().map(|(name, value)| (name, self.fill(value))))
            .stdin(Stdio::null())
            .output()
            .unwrap();
        self.take();
        let [out, said] =
            [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
        (output.status.code(), out + &said)
    }

    /// What the last step wrote for those after it: `NAME=VALUE` lines, and folders of programs.
    fn take(&mut self) {
        let read = |name| {
            let text = fs::read_to_string(&self.env[name]).unwrap();
            fs::write(&self.env[name], "").unwrap();
            text
        };
        let [set, found] = ["GITHUB_ENV", "GITHUB_PATH"].map(read);
        for line in set.lines() {
            let (name, value) = line.split_once('=').expect("NAME=VALUE");
            self.env.insert(name.to_owned(), value.to_owned());
        }
        self.path.extend(found.lines().map(PathBuf::from));
    }
}
