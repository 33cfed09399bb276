//! `cnc report --merge`: results of many programs on many machines → one page and a sum.
//!
//! Rule: a result that is broken, is there twice or is missing is told, and makes the exit code 2. The
//! order is that of names, whatever the order of files.

mod page;
mod read;

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use cnc::base::rounding::six_digits;
use cnc::base::source::{shown, visible};
use serde_json::{Value, json};

use self::read::Entry;
use super::document::{Job, Verdict};
use super::{Args, put};
use crate::args::Global;
use crate::exit::{Exit, Outcome, unless_unread};
use crate::input;

/// Endings of the files of a folder that are taken for results.
const ENDINGS: [&str; 2] = ["json", "jsonl"];

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
    entries: Vec<Entry>,
    troubles: Vec<Trouble>,
}

pub fn run(args: &Args, global: &Global) -> Outcome {
    let mut merged = read(&args.merge)?;
    if let Some(list) = &args.expected {
        merged.expect(list)?;
    }
    if merged.entries.is_empty() && merged.troubles.is_empty() {
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
    for Trouble { name, what, .. } in troubles {
        let told = format!("{name}: {what}").chars().map(visible).collect::<String>();
        say!("error: {told}");
    }
    if !troubles.is_empty() {
        return Err(anyhow!("not every program has a good result").into());
    }
    Ok(if merged.count(Verdict::Pass) == merged.entries.len() { Exit::Ok } else { Exit::BadInput })
}

/// Reads every result.
fn read(places: &[PathBuf]) -> anyhow::Result<Merged> {
    let mut files = BTreeSet::new();
    for place in places {
        gather(place, &mut files).with_context(|| shown(place))?;
    }
    let files: Vec<PathBuf> = files.into_iter().collect();
    let mut by_name: BTreeMap<(String, String), (Entry, usize)> = BTreeMap::new();
    let mut troubles = Vec::new();
    for (at, file) in files.iter().enumerate() {
        let mut trouble = |what: String| {
            troubles.push(Trouble { kind: Kind::Broken, name: shown(file), what });
        };
        read::documents(file, |entry| {
            let entry = match entry {
                Ok(entry) => entry,
                Err(what) => return trouble(what),
            };
            let key = (entry.file.clone(), entry.machine.clone());
            if let Some((_, before)) = by_name.get(&key) {
                let ((program, machine), before) = (key, shown(&files[*before]));
                trouble(format!("{program} on {machine} has a result in {before} too"));
            } else {
                by_name.insert(key, (entry, at));
            }
        });
    }
    let entries = by_name.into_values().map(|(entry, _)| entry).collect();
    Ok(Merged { entries, troubles })
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

impl Merged {
    /// Tells the programs of a list that have no result, and results of programs that are not in it.
    fn expect(&mut self, list: &Path) -> anyhow::Result<()> {
        let name = || list.display().to_string();
        input::has_read(list);
        let text = std::fs::read_to_string(list).with_context(name)?;
        let expected: BTreeSet<&str> =
            text.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
        let found: BTreeSet<&str> = self.entries.iter().map(|entry| entry.file.as_str()).collect();
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
        self.entries.iter().filter(|entry| entry.verdict == verdict).count()
    }

    fn troubled(&self, kind: Kind) -> usize {
        self.troubles.iter().filter(|trouble| trouble.kind == kind).count()
    }

    fn is_good(&self) -> bool {
        self.troubles.is_empty() && self.count(Verdict::Pass) == self.entries.len()
    }

    /// The sum in a sentence.
    fn sentence(&self) -> String {
        let of_all = self.entries.len();
        let mut text = match (self.count(Verdict::Pass), of_all) {
            (_, 0) => "no program has a result".to_owned(),
            (1, 1) => "the program passes".to_owned(),
            (passed, _) if passed == of_all => format!("all {of_all} programs pass"),
            (passed, _) => format!("{passed} of {of_all} programs pass"),
        };
        for (count, one, more) in [
            (self.count(Verdict::Fail), "fails", "fail"),
            (self.count(Verdict::Refused), "is refused", "are refused"),
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
        for entry in &self.entries {
            let key = (entry.machine.as_str(), entry.machine_sha256.as_str());
            *machines.entry(key).or_insert(0) += 1;
        }
        machines
    }

    fn tools(&self) -> BTreeSet<&str> {
        self.entries.iter().map(|entry| entry.tool.as_str()).collect()
    }

    /// Sum over all jobs.
    fn sum(&self, of: impl Fn(&Job) -> f64) -> f64 {
        let jobs = self.entries.iter().filter_map(|entry| entry.job.as_ref());
        jobs.map(of).fold(0.0, |sum, part| sum + part)
    }

    /// Jobs with the share of the tolerance that their contour error takes, the greatest first.
    fn by_error(&self) -> Vec<&Entry> {
        self.greatest_first(|job| job.max_contour_error_mm / job.tolerance_mm)
    }

    fn greatest_first(&self, of: impl Fn(&Job) -> f64) -> Vec<&Entry> {
        let mut jobs: Vec<(f64, &Entry)> = self
            .entries
            .iter()
            .filter_map(|entry| Some((of(entry.job.as_ref()?), entry)))
            .collect();
        // Equal ones stay in the order of their names.
        jobs.sort_by(|a, b| b.0.total_cmp(&a.0));
        jobs.into_iter().map(|(_, entry)| entry).collect()
    }

    fn to_json(&self) -> Value {
        let results = self.entries.iter().map(|entry| {
            let job = entry.job.as_ref();
            json!({
                "file": entry.file,
                "machine": entry.machine,
                "verdict": entry.verdict,
                "first_failure": entry.wrong.first(),
                "errors": entry.errors,
                "warnings": entry.warnings,
                "ticks": job.map(|job| job.ticks),
                "total_seconds": job.map(|job| job.total_seconds),
                "max_contour_error_mm": job.map(|job| job.max_contour_error_mm),
                "tolerance_mm": job.map(|job| job.tolerance_mm),
                "line": job.and_then(|job| job.worst).map(|worst| worst.line),
            })
        });
        let machines = self.machines().into_iter().map(|((name, sha256), programs)| {
            json!({"machine": name, "sha256": sha256, "programs": programs})
        });
        let troubles = self.troubles.iter();
        let ticks = self.entries.iter().filter_map(|entry| entry.job.as_ref());
        json!({
            "schema": 1,
            "verdict": if self.is_good() { "pass" } else { "fail" },
            "programs": self.entries.len(),
            "passed": self.count(Verdict::Pass),
            "failed": self.count(Verdict::Fail),
            "refused": self.count(Verdict::Refused),
            "ticks": ticks.map(|job| job.ticks).fold(0, u64::saturating_add),
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
