//! SARIF 2.1.0 (OASIS): one run, with every rule there is, a result a finding, files as artifacts.
//!
//! Results are written as they come; what they refer to (artifacts, what could not be read) follows.
//! Columns are in Unicode code points, the last one exclusive, as SARIF counts them.

use std::collections::HashMap;
use std::io::{self, Write};
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

use cnc::gcode::rules;
use cnc::verify::CHECKS;
use serde_json::{Value, json};

use super::judged::{
    Finding, Judged, Place, WRONG_FILE, WRONG_FILE_MEANING, check_rule, severity_name,
};
use super::sum::Sum;
use super::{Form, Judge, plain};
use crate::cmd::explain;
use crate::report::counts;

const SCHEMA: &str = "https://json.schemastore.org/sarif-2.1.0.json";

/// A log while it is written.
pub struct Log {
    judge: Judge,
    /// Index of each rule in the driver.
    rules: HashMap<String, usize>,
    /// The files so far, and the index of each.
    artifacts: Vec<String>,
    index: HashMap<String, usize>,
    notifications: Vec<Value>,
    has_results: bool,
}

impl Log {
    pub fn new(judge: Judge) -> Log {
        Log {
            judge,
            rules: HashMap::new(),
            artifacts: Vec::new(),
            index: HashMap::new(),
            notifications: Vec::new(),
            has_results: false,
        }
    }

    /// Where a file is, as results refer to it.
    fn artifact(&mut self, path: &Path) -> Value {
        let uri = uri(path);
        let next = self.artifacts.len();
        let index = *self.index.entry(uri.clone()).or_insert(next);
        if index == next {
            self.artifacts.push(uri.clone());
        }
        json!({"uri": uri, "index": index})
    }

    fn location(&mut self, path: &Path, place: Option<Place>) -> Value {
        let mut physical = json!({"artifactLocation": self.artifact(path)});
        if let Some(place) = place {
            physical["region"] = json!({"startLine": place.line});
            if let Some([first, after]) = place.columns {
                physical["region"]["startColumn"] = json!(first);
                physical["region"]["endColumn"] = json!(after);
            }
        }
        json!({"physicalLocation": physical})
    }

    fn result(&mut self, judged: &Judged, finding: &Finding) -> Value {
        let path = |file: Option<&str>| file.map_or(judged.path.clone(), PathBuf::from);
        let text = match finding.help {
            Some(help) => format!("{}; {help}", finding.message),
            None => finding.message.to_string(),
        };
        let mut result = json!({
            "ruleId": finding.rule,
            "level": severity_name(finding.severity),
            "message": {"text": text},
            "locations": [self.location(&path(finding.file), finding.place)],
        });
        if let Some(index) = self.rules.get(&*finding.rule) {
            result["ruleIndex"] = json!(index);
        }
        let mut calls = Vec::new();
        for call in finding.calls {
            let place = Place { line: call.line, columns: None };
            let mut location = self.location(&path(call.file.as_deref()), Some(place));
            location["message"] = json!({"text": "called here"});
            // The list is a set: a subprogram that calls itself does so on the same line.
            if !calls.contains(&location) {
                calls.push(location);
            }
        }
        if !calls.is_empty() {
            result["relatedLocations"] = json!(calls);
        }
        result
    }

    fn notify(&mut self, path: &Path, level: &str, text: &str) {
        let location = self.location(path, None);
        let message = json!({"text": text});
        self.notifications
            .push(json!({"level": level, "message": message, "locations": [location]}));
    }
}

impl Form for Log {
    fn begin(&mut self, out: &mut dyn Write, _names: &[&str]) -> io::Result<()> {
        let rules = rules()?;
        let ids = rules.iter().filter_map(|rule| rule["id"].as_str().map(str::to_owned));
        self.rules = ids.zip(0..).collect();
        let driver = json!({
            "name": "cnc",
            "version": env!("CARGO_PKG_VERSION"),
            "semanticVersion": env!("CARGO_PKG_VERSION"),
            "shortDescription": {"text": env!("CARGO_PKG_DESCRIPTION")},
            "rules": rules,
        });
        // One more part would let a reader of results take those of the two commands for each other's.
        let id = format!("{}/", self.judge.name().replace(' ', "/"));
        writeln!(out, "{{\"$schema\":\"{SCHEMA}\",\"version\":\"2.1.0\",\"runs\":[{{")?;
        writeln!(out, "\"tool\":{{\"driver\":{driver}}},")?;
        writeln!(out, "\"automationDetails\":{{\"id\":\"{id}\"}},")?;
        writeln!(out, "\"columnKind\":\"unicodeCodePoints\",")?;
        write!(out, "\"results\":[")
    }

    fn program(&mut self, out: &mut dyn Write, judged: &Judged) -> io::Result<()> {
        self.artifact(&judged.path);
        for finding in judged.findings() {
            let result = self.result(judged, &finding);
            let comma = if self.has_results { "," } else { "" };
            self.has_results = true;
            write!(out, "{comma}\n{result}")?;
        }
        if let Some(reason) = judged.unread() {
            self.notify(&judged.path, "error", &reason);
        }
        if let Some(cut) = judged.not_shown() {
            let text = format!("{}, {cut}", counts(judged.errors(), judged.warnings()));
            self.notify(&judged.path, "note", &text);
        }
        Ok(())
    }

    fn end(&mut self, out: &mut dyn Write, sum: &Sum) -> io::Result<()> {
        let artifacts: Vec<Value> =
            self.artifacts.iter().map(|uri| json!({"location": {"uri": uri}})).collect();
        let invocation = json!({
            "executionSuccessful": sum.unread == 0,
            "exitCode": sum.code(),
            "toolExecutionNotifications": self.notifications,
        });
        writeln!(out, "\n],")?;
        writeln!(out, "\"artifacts\":{},", json!(artifacts))?;
        writeln!(out, "\"invocations\":[{invocation}]\n}}]}}")
    }
}

/// Every rule of programs, then every check of `verify`.
fn rules() -> io::Result<Vec<Value>> {
    let mut all = Vec::new();
    for rule in rules::all() {
        let level = severity_name(rule.severity);
        let examples = explain::examples(rule)?;
        let help = format!("{} {examples}", rule.meaning);
        all.push(reporting(rule.name, level, rule.meaning, &help));
    }
    let checks = CHECKS.iter().map(|(check, meaning)| (check_rule(check), *meaning));
    for (id, meaning) in checks.chain([(WRONG_FILE.to_owned(), WRONG_FILE_MEANING)]) {
        all.push(reporting(&id, "error", meaning, meaning));
    }
    Ok(all)
}

/// A rule, as SARIF describes it.
fn reporting(id: &str, level: &str, meaning: &str, help: &str) -> Value {
    json!({
        "id": id,
        "shortDescription": {"text": meaning},
        "help": {"text": help},
        "defaultConfiguration": {"level": level},
    })
}

/// A path as a URI: relative below the working folder, with all that is not plain by its bytes.
fn uri(path: &Path) -> String {
    if path == Path::new("-") {
        return "stdin".to_owned();
    }
    let path = plain(path);
    let mut uri = if path.is_absolute() { "file://".to_owned() } else { String::new() };
    for byte in path.as_os_str().as_bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'/' | b'-' | b'.' | b'_' | b'~' => {
                uri.push(char::from(*byte));
            }
            byte => uri += &format!("%{byte:02X}"),
        }
    }
    uri
}

#[cfg(test)]
mod tests {
    use std::ffi::OsStr;

    use super::*;

    #[test]
    fn a_path_becomes_a_uri() {
        let here = std::env::current_dir().unwrap();
        for (path, expected) in [
            (Path::new("./a b/%c:d.nc"), "a%20b/%25c%3Ad.nc"),
            (Path::new("/x/y.nc"), "file:///x/y.nc"),
            (&here.join("p/q.nc"), "p/q.nc"),
            (Path::new(OsStr::from_bytes(b"\xff\xc3\xa4.nc")), "%FF%C3%A4.nc"),
        ] {
            assert_eq!(uri(path), expected);
        }
    }
}
