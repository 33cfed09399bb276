//! `cnc report --merge`: results of many programs on many machines → one page and a sum.
//!
//! Rule: a result that is broken, is there twice or is missing is told, and makes the exit code 2. The
//! order is that of names, whatever the order of files.

mod page;

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use cnc::base::rounding::six_digits;
use serde_json::{Value, json};

use super::document::{Document, Verdict};
use super::{Args, put};
use crate::args::Global;
use crate::exit::{Exit, Outcome, told, unless_unread};
use crate::input;

/// Endings of the files of a folder that are taken for results.
const ENDINGS: [&str; 2] = ["json", "jsonl"];
/// Most bytes of a file: some hundred thousand documents.
const BYTES_MAX: u64 = 1 << 30;
/// Most characters of what a job said, where it left no result.
const SAID_MAX: usize = 300;

/// Why there is no result, or not a good one.
struct Trouble {
    kind: Kind,
    /// A file of results, or a program.
    name: String,
    what: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// A result is there, and cannot be taken.
    Broken,
    /// There is none of a program.
    Missing,
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Kind::Broken => "broken",
            Kind::Missing => "missing",
        }
    }
}

/// All that was found.
struct Merged {
    /// By name of the program, then of the machine.
    documents: Vec<Document>,
    troubles: Vec<Trouble>,
}

pub fn run(args: &Args, global: &Global) -> Outcome {
    let mut merged = read(&args.merge)?;
    if let Some(list) = &args.expected {
        merged.expect(list)?;
    }
    if merged.documents.is_empty() && merged.troubles.is_empty() {
        return Err(anyhow!("there is no result: no file *.json or *.jsonl").into());
    }
    if args.output.is_some() || !global.json {
        put(&page::of(&merged), args)?;
    }
    if global.json {
        unless_unread(writeln!(io::stdout(), "{}", merged.to_json()))?;
    }
    if !global.quiet {
        say!("{}", merged.sentence());
    }
    let troubles = &merged.troubles;
    troubles.iter().for_each(|trouble| say!("error: {}: {}", trouble.name, trouble.what));
    if !troubles.is_empty() {
        say!("error: not every program has a good result");
        return Ok(Exit::Unusable);
    }
    Ok(if merged.count(Verdict::Pass) == merged.documents.len() {
        Exit::Ok
    } else {
        Exit::BadInput
    })
}

/// Reads every document.
fn read(places: &[PathBuf]) -> anyhow::Result<Merged> {
    let mut files = BTreeSet::new();
    for place in places {
        gather(place, &mut files).with_context(|| place.display().to_string())?;
    }
    let (mut by_name, mut troubles) = (BTreeMap::new(), Vec::new());
    for file in &files {
        let name = file.display().to_string();
        let mut trouble = |what: String| {
            troubles.push(Trouble { kind: Kind::Broken, name: name.clone(), what });
        };
        match documents(file) {
            Err(error) => trouble(error),
            Ok(documents) => {
                for document in documents {
                    let key = (document.file.clone(), document.machine.clone());
                    if let Some((_, before)) = by_name.get(&key) {
                        let (program, machine): &(String, String) = &key;
                        trouble(format!("{program} on {machine} has a result in {before} too"));
                    } else {
                        by_name.insert(key, (document, name.clone()));
                    }
                }
            }
        }
    }
    let documents = by_name.into_values().map(|(document, _)| document).collect();
    Ok(Merged { documents, troubles })
}

/// The files of a folder and of those in it (links to folders are not followed), or the file itself.
fn gather(place: &Path, files: &mut BTreeSet<PathBuf>) -> io::Result<()> {
    if place == Path::new("-") || !place.metadata()?.is_dir() {
        files.insert(place.to_owned());
        return Ok(());
    }
    for entry in std::fs::read_dir(place)? {
        let entry = entry?;
        let path = entry.path();
        let ending = path.extension().and_then(|ending| ending.to_str());
        if entry.file_type()?.is_dir() {
            gather(&path, files)?;
        } else if ending.is_some_and(|ending| ENDINGS.contains(&ending)) {
            if path.metadata().is_ok_and(|data| !data.is_file()) {
                return Err(io::Error::other(format!(
                    "{} is no file: take it out",
                    path.display()
                )));
            }
            files.insert(path);
        }
    }
    Ok(())
}

/// The documents of a file, one or more, or what is wrong with it.
fn documents(file: &Path) -> Result<Vec<Document>, String> {
    let mut bytes = Vec::new();
    input::has_read(file);
    let read = match file == Path::new("-") {
        true => io::stdin().lock().take(BYTES_MAX).read_to_end(&mut bytes),
        false => File::open(file).and_then(|file| file.take(BYTES_MAX).read_to_end(&mut bytes)),
    };
    let count = read.map_err(|error| told(&error.into()))?;
    if count as u64 == BYTES_MAX {
        return Err("no results are this large".to_owned());
    }
    let mut documents = Vec::new();
    let wrong = |error| format!("no result of `cnc report --json`: {error}");
    for value in serde_json::Deserializer::from_slice(&bytes).into_iter::<Value>() {
        let value = value.map_err(wrong)?;
        if let ("error", Some(error)) =
            (value["result"].as_str().unwrap_or_default(), value["error"].as_str())
        {
            return Err(format!("it tells why there is none: {error}"));
        }
        let document: Document = serde_json::from_value(value).map_err(wrong)?;
        if let Some(fault) = document.fault() {
            return Err(format!("no result of `cnc report --json`: {fault}"));
        }
        documents.push(document);
    }
    match documents.is_empty() {
        true => Err(format!("it is empty{}", said(file))),
        false => Ok(documents),
    }
}

/// What the job said that left no result: its standard error, where GNU parallel keeps it.
fn said(file: &Path) -> String {
    let mut errors = file.as_os_str().to_owned();
    errors.push(".err");
    let text = std::fs::read(errors).unwrap_or_default();
    let text = String::from_utf8_lossy(&text);
    let line = text.lines().map(str::trim).find(|line| !line.is_empty());
    let shown = |line: &str| -> String {
        line.chars().filter(|letter| !letter.is_control()).take(SAID_MAX).collect()
    };
    line.map_or(String::new(), |line| format!("; its job said: {}", shown(line)))
}

impl Merged {
    /// Tells the programs of a list that have no result, and results of programs that are not in it.
    fn expect(&mut self, list: &Path) -> anyhow::Result<()> {
        let name = || list.display().to_string();
        input::has_read(list);
        let text = std::fs::read_to_string(list).with_context(name)?;
        let expected: BTreeSet<&str> =
            text.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
        let found: BTreeSet<&str> =
            self.documents.iter().map(|document| document.file.as_str()).collect();
        let tell = |kind, name: &str, what: String| Trouble { kind, name: name.to_owned(), what };
        let missing = expected.difference(&found);
        let missing = missing.map(|name| tell(Kind::Missing, name, "it has no result".to_owned()));
        let what = format!("a result of it is there, and it is not in {}", list.display());
        let strange = found.difference(&expected);
        let strange = strange.map(|name| tell(Kind::Broken, name, what.clone()));
        self.troubles.extend(missing.chain(strange).collect::<Vec<_>>());
        Ok(())
    }

    fn count(&self, verdict: Verdict) -> usize {
        self.documents.iter().filter(|document| document.verdict == verdict).count()
    }

    fn troubled(&self, kind: Kind) -> usize {
        self.troubles.iter().filter(|trouble| trouble.kind == kind).count()
    }

    fn is_good(&self) -> bool {
        self.troubles.is_empty() && self.count(Verdict::Pass) == self.documents.len()
    }

    /// The sum in a sentence.
    fn sentence(&self) -> String {
        let of_all = self.documents.len();
        let mut text = match (self.count(Verdict::Pass), of_all) {
            (_, 0) => "no program has a result".to_owned(),
            (1, 1) => "the program passes".to_owned(),
            (passed, _) if passed == of_all => format!("all {of_all} programs pass"),
            (passed, _) => format!("{passed} of {of_all} programs pass"),
        };
        for (count, one, more) in [
            (self.count(Verdict::Fail), "fails", "fail"),
            (self.count(Verdict::Refused), "cannot be run", "cannot be run"),
            (self.troubled(Kind::Broken), "result is broken", "results are broken"),
            (self.troubled(Kind::Missing), "result is missing", "results are missing"),
        ] {
            if count > 0 {
                text += &format!(", {count} {}", if count == 1 { one } else { more });
            }
        }
        text
    }

    /// Programs by machine and the hash of its profile.
    fn machines(&self) -> BTreeMap<(&str, &str), usize> {
        let mut machines = BTreeMap::new();
        for document in &self.documents {
            let key = (document.machine.as_str(), document.machine_sha256.as_str());
            *machines.entry(key).or_insert(0) += 1;
        }
        machines
    }

    fn tools(&self) -> BTreeSet<&str> {
        self.documents.iter().map(|document| document.tool.as_str()).collect()
    }

    /// Sum over all jobs.
    fn sum(&self, of: impl Fn(&super::document::Job) -> f64) -> f64 {
        let jobs = self.documents.iter().filter_map(|document| document.job.as_ref());
        jobs.map(of).fold(0.0, |sum, part| sum + part)
    }

    /// Jobs with the share of the tolerance that their contour error takes, the greatest first.
    fn by_error(&self) -> Vec<&Document> {
        self.greatest_first(|job| job.max_contour_error_mm / job.tolerance_mm)
    }

    fn greatest_first(&self, of: impl Fn(&super::document::Job) -> f64) -> Vec<&Document> {
        let mut jobs: Vec<(f64, &Document)> = self
            .documents
            .iter()
            .filter_map(|document| Some((of(document.job.as_ref()?), document)))
            .collect();
        // Equal ones stay in the order of their names.
        jobs.sort_by(|a, b| b.0.total_cmp(&a.0));
        jobs.into_iter().map(|(_, document)| document).collect()
    }

    fn to_json(&self) -> Value {
        let results = self.documents.iter().map(|document| {
            let job = document.job.as_ref();
            json!({
                "file": document.file,
                "machine": document.machine,
                "verdict": document.verdict,
                "first_failure": document.first_failure(),
                "errors": document.errors,
                "warnings": document.warnings,
                "ticks": job.map(|job| job.ticks),
                "total_seconds": job.map(|job| job.total_seconds),
                "max_contour_error_mm": job.map(|job| job.max_contour_error_mm),
                "tolerance_mm": job.map(|job| job.tolerance_mm),
                "line": job.and_then(|job| job.worst).and_then(|worst| worst.line),
            })
        });
        let machines = self.machines().into_iter().map(|((name, sha256), programs)| {
            json!({"machine": name, "sha256": sha256, "programs": programs})
        });
        let troubles = self.troubles.iter();
        let ticks = self.documents.iter().filter_map(|document| document.job.as_ref());
        json!({
            "schema": 1,
            "verdict": if self.is_good() { "pass" } else { "fail" },
            "programs": self.documents.len(),
            "passed": self.count(Verdict::Pass),
            "failed": self.count(Verdict::Fail),
            "refused": self.count(Verdict::Refused),
            "ticks": ticks.map(|job| job.ticks).sum::<u64>(),
            "motion_seconds": six_digits(self.sum(|job| job.motion_seconds)),
            "total_seconds": six_digits(self.sum(|job| job.total_seconds)),
            "cut_mm": six_digits(self.sum(|job| job.cut_mm)),
            "rapid_mm": six_digits(self.sum(|job| job.rapid_mm)),
            "machines": machines.collect::<Vec<_>>(),
            "tools": self.tools(),
            "troubles": troubles.map(|trouble| {
                json!({"kind": trouble.kind.name(), "name": trouble.name, "trouble": trouble.what})
            }).collect::<Vec<_>>(),
            "results": results.collect::<Vec<_>>(),
        })
    }
}
