//! The forms that other tools read: SARIF, JUnit's XML, annotations of GitHub. Each is held against what
//! its readers ask for, on every program that breaks a rule.

use std::collections::HashSet;
use std::fs;
use std::path::Path;
use std::process::Command;

use resvg::usvg::roxmltree::{Document, Node};
use serde_json::Value;

fn run(line: &str) -> (Option<i32>, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_cnc"))
        .args(line.split(' '))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .env_remove("CNC_MACHINE")
        .output()
        .unwrap();
    (output.status.code(), String::from_utf8(output.stdout).unwrap())
}

/// Errors and warnings of all samples as `--json` and the drawings never lose them: rule, file, line.
fn errors(line: &str) -> Vec<(String, String, u64)> {
    let json = run(&format!("{line} --json")).1;
    let lines = json.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let errors = lines.filter(|value| value["type"] == "error");
    let text = |value: &Value| value.as_str().unwrap().to_owned();
    errors
        .map(|error| (text(&error["rule"]), text(&error["file"]), error["line"].as_u64().unwrap()))
        .collect()
}

/// Programs of all kinds but the one that calls a million subprograms, which takes seconds.
fn every_sample() -> String {
    let folders = ["bad", "fanuc", "good"].map(|folder| format!("samples/{folder}"));
    let files = folders.iter().flat_map(|folder| fs::read_dir(folder).unwrap());
    let names = files.map(|file| file.unwrap().path().display().to_string());
    let mut names: Vec<String> = names.filter(|name| !name.ends_with("/call-count.nc")).collect();
    names.sort();
    format!("interpret {} --max-passes 1000", names.join(" "))
}

fn keys<'a>(value: &'a Value, of: &str) -> HashSet<&'a str> {
    let object = value.as_object().unwrap_or_else(|| panic!("{of} is no object: {value}"));
    object.keys().map(String::as_str).collect()
}

/// Each of these keys is there, and no other.
#[track_caller]
fn check_keys(value: &Value, of: &str, required: &[&str], optional: &[&str]) {
    let found = keys(value, of);
    for key in required {
        assert!(found.contains(key), "{of} has no {key}: {value}");
    }
    let known = |key: &&str| required.contains(key) || optional.contains(key);
    assert!(found.iter().all(known), "{of} has more: {value}");
}

fn check_location(
    location: &Value,
    artifacts: &[Value],
    is_related: bool,
) -> Option<(String, u64)> {
    check_keys(
        location,
        "location",
        &["physicalLocation"],
        if is_related { &["message"] } else { &[] },
    );
    let physical = &location["physicalLocation"];
    check_keys(physical, "physicalLocation", &["artifactLocation"], &["region"]);
    let artifact = &physical["artifactLocation"];
    check_keys(artifact, "artifactLocation", &["uri", "index"], &[]);
    let index = usize::try_from(artifact["index"].as_u64().unwrap()).unwrap();
    assert_eq!(artifacts[index]["location"]["uri"], artifact["uri"]);
    let uri = artifact["uri"].as_str().unwrap();
    assert!(!uri.contains([' ', '\\']) && !uri.starts_with("./"), "{uri}");
    let region = physical.get("region")?;
    check_keys(region, "region", &["startLine"], &["startColumn", "endColumn"]);
    assert!(region["startLine"].as_u64().unwrap() >= 1);
    if let Some(first) = region.get("startColumn") {
        assert!(first.as_u64().unwrap() >= 1 && region["endColumn"].as_u64() >= first.as_u64());
    }
    Some((uri.to_owned(), region["startLine"].as_u64().unwrap()))
}

#[track_caller]
fn check_sarif(text: &str, code: i32) -> Vec<(String, String, u64)> {
    let log: Value = serde_json::from_str(text).unwrap();
    check_keys(&log, "log", &["$schema", "version", "runs"], &[]);
    assert_eq!(log["version"], "2.1.0");
    let run = &log["runs"][0];
    let parts = ["tool", "automationDetails", "columnKind", "results", "artifacts", "invocations"];
    check_keys(run, "run", &parts, &[]);
    assert_eq!(run["columnKind"], "unicodeCodePoints");
    let driver = &run["tool"]["driver"];
    let parts = ["name", "version", "semanticVersion", "shortDescription", "rules"];
    check_keys(driver, "driver", &parts, &[]);
    let rules = driver["rules"].as_array().unwrap();
    for rule in rules {
        check_keys(rule, "rule", &["id", "shortDescription", "help", "defaultConfiguration"], &[]);
        assert!(!rule["help"]["text"].as_str().unwrap().is_empty());
        assert!(
            ["error", "warning"].contains(&rule["defaultConfiguration"]["level"].as_str().unwrap())
        );
    }
    let ids: HashSet<&str> = rules.iter().map(|rule| rule["id"].as_str().unwrap()).collect();
    assert_eq!(ids.len(), rules.len());
    let artifacts = run["artifacts"].as_array().unwrap();
    let uris: HashSet<String> = artifacts.iter().map(Value::to_string).collect();
    assert_eq!(uris.len(), artifacts.len());
    let invocation = &run["invocations"][0];
    let parts = ["executionSuccessful", "exitCode", "toolExecutionNotifications"];
    check_keys(invocation, "invocation", &parts, &[]);
    assert_eq!(invocation["exitCode"], code);
    assert_eq!(invocation["executionSuccessful"], code < 2);
    let mut errors = Vec::new();
    for result in run["results"].as_array().unwrap() {
        let parts = ["ruleId", "ruleIndex", "level", "message", "locations"];
        check_keys(result, "result", &parts, &["relatedLocations"]);
        let rule = result["ruleId"].as_str().unwrap();
        assert_eq!(rules[result["ruleIndex"].as_u64().unwrap() as usize]["id"], rule);
        assert!(!result["message"]["text"].as_str().unwrap().is_empty());
        let place = check_location(&result["locations"][0], artifacts, false);
        for call in result["relatedLocations"].as_array().into_iter().flatten() {
            check_location(call, artifacts, true);
        }
        if result["level"] == "error" {
            let (file, line) = place.unwrap_or_default();
            errors.push((rule.to_owned(), file, line));
        }
    }
    errors
}

#[test]
fn sarif_has_every_error_at_its_place() {
    let line = every_sample();
    let (code, log) = run(&format!("{line} --format sarif"));
    assert_eq!(check_sarif(&log, code.unwrap()), errors(&line));
}

#[test]
fn sarif_of_verify_has_failed_checks_and_wrong_files() {
    let folder = failing();
    let name = folder.path().to_str().unwrap();
    let (code, log) = run(&format!("verify {name} {name}/gone.nc --format sarif"));
    let found = check_sarif(&log, code.unwrap());
    let rules: Vec<&str> = found.iter().map(|(rule, _, _)| rule.as_str()).collect();
    assert_eq!(rules[..2], ["wrong-file", "verify-contour"]);
    assert!(rules.contains(&"verify-end-point"));
    assert!(found[1].1.starts_with("file:///") && found[1].1.ends_with("/b.nc") && found[1].2 > 1);
    assert!(log.contains("\"toolExecutionNotifications\":[{\"level\":\"error\""));
}

/// A folder with a dump of another program and one that is out of tolerance.
fn failing() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    for (from, to) in [("o001", "a"), ("planes", "b")] {
        let from = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("samples/good/{from}.nc"));
        fs::copy(from, at(&format!("{to}.nc"))).unwrap();
    }
    let dump = format!("interpolate {} --encoder thesis --csv -o {}", at("b.nc"), at("b.csv"));
    assert_eq!(run(&dump).0, Some(0));
    fs::copy(at("b.csv"), at("a.csv")).unwrap();
    folder
}

fn number(node: Node, name: &str) -> usize {
    node.attribute(name).unwrap().parse().unwrap()
}

/// The cases: name, and type of what went wrong.
#[track_caller]
fn check_junit(text: &str) -> Vec<(String, Option<String>)> {
    let document = Document::parse(text).unwrap();
    let root = document.root_element();
    let suite = root.first_element_child().unwrap();
    assert_eq!((root.tag_name().name(), suite.tag_name().name()), ("testsuites", "testsuite"));
    let cases: Vec<Node> = suite.children().filter(Node::is_element).collect();
    let count = |tag: &str| suite.descendants().filter(|node| node.has_tag_name(tag)).count();
    for node in [root, suite] {
        assert_eq!(number(node, "tests"), cases.len());
        assert_eq!(number(node, "failures"), count("failure"));
        assert_eq!(number(node, "errors"), count("error"));
    }
    let case = |case: &Node| {
        assert!(case.has_tag_name("testcase") && case.attribute("classname").is_some());
        let wrong =
            case.children().find(|node| node.has_tag_name("failure") || node.has_tag_name("error"));
        let kind = wrong.map(|wrong| {
            assert!(!wrong.attribute("message").unwrap().is_empty() && wrong.text().is_some());
            wrong.attribute("type").unwrap().to_owned()
        });
        (case.attribute("name").unwrap().to_owned(), kind)
    };
    cases.iter().map(case).collect()
}

#[test]
fn junit_has_a_case_a_program() {
    let line = every_sample();
    let cases = check_junit(&run(&format!("{line} --format junit")).1);
    let failed: HashSet<&String> =
        cases.iter().filter(|(_, kind)| kind.is_some()).map(|(name, _)| name).collect();
    let errors = errors(&line);
    assert_eq!(failed, errors.iter().map(|(_, file, _)| file).collect());
    assert_eq!(cases.len(), line.split(' ').count() - 3);
    let folder = failing();
    let name = folder.path().to_str().unwrap();
    let cases = check_junit(&run(&format!("verify {name} {name}/gone.nc --format junit")).1);
    let kinds: Vec<Option<&str>> = cases.iter().map(|(_, kind)| kind.as_deref()).collect();
    assert_eq!(kinds, [Some("wrong-file"), Some("verify-contour"), Some("unread")]);
}

/// `::error file=…,line=…,title=…::message`, with nothing left that the runner would take for more.
#[track_caller]
fn check_annotation(text: &str) -> (bool, String, u64) {
    let (head, message) = text.strip_prefix("::").unwrap().split_once("::").unwrap();
    let (command, properties) = head.split_once(' ').unwrap();
    assert!(["error", "warning", "notice"].contains(&command), "{text}");
    let properties: Vec<(&str, &str)> =
        properties.split(',').map(|property| property.split_once('=').unwrap()).collect();
    let value = |name: &str| {
        properties.iter().find(|(key, _)| *key == name).map_or("", |(_, value)| *value).to_owned()
    };
    let names = ["file", "line", "col", "endColumn", "title"];
    assert!(properties.iter().all(|(name, _)| names.contains(name)), "{text}");
    assert!(!message.is_empty());
    let [first, last] = ["col", "endColumn"].map(|name| value(name).parse().unwrap_or(1_u32));
    assert!(first >= 1 && last >= first, "{text}");
    (command == "error", value("file"), value("line").parse().unwrap_or(0))
}

#[test]
fn annotations_mark_every_error() {
    let line = every_sample();
    let out = run(&format!("{line} --format github")).1;
    let found: Vec<_> = out.lines().map(check_annotation).collect();
    let found: Vec<(String, u64)> = found
        .into_iter()
        .filter(|(is_error, _, _)| *is_error)
        .map(|(_, file, line)| (file, line))
        .collect();
    let due: Vec<(String, u64)> =
        errors(&line).into_iter().map(|(_, file, line)| (file, line)).collect();
    assert_eq!(found, due);
    let folder = failing();
    let (code, out) = run(&format!("verify {} --format github", folder.path().display()));
    assert_eq!(code, Some(1));
    assert!(out.lines().next().unwrap().contains("title=cnc wrong-file::"), "{out}");
    out.lines().for_each(|line| assert!(check_annotation(line).0));
}
