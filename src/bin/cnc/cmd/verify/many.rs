//! Programs and folders of them, each with the dump beside it or without one.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use anyhow::anyhow;
use cnc::base::Machine;

use super::{Args, dump_of, judge};
use crate::args::Global;
use crate::exit::Outcome;
use crate::input;
use crate::many::files::{Entry, Found};
use crate::many::judged::Judged;
use crate::many::{Judge, say_left_out};

/// What is to be judged.
struct Task {
    entry: Entry,
    /// It is a dump, whose program is not among the files.
    is_lonely: bool,
}

/// Judges programs, the only one against a dump that is named with it.
pub fn run(
    files: &[PathBuf],
    pair: Option<&Path>,
    machine: &Machine,
    args: &Args,
    global: &Global,
) -> Outcome {
    let tasks = match pair {
        Some(_) => tasks(Found::of(&files[..1])?),
        None => found(files, global)?,
    };
    let work = |task: &Task| {
        let mut judged = Judged::new(task.entry.path.clone());
        let outcome = task.entry.readable().and_then(|path| match task.is_lonely {
            true => Err(lonely(path).into()),
            false => judge(&mut judged, pair, machine, args, global, None),
        });
        judged.trouble = outcome.err();
        judged
    };
    args.many.run(Judge::Verify, &tasks, |task| &task.entry.path, work, global)
}

/// Why a dump alone is not judged.
pub fn lonely(dump: &Path) -> anyhow::Error {
    let name = dump.display();
    anyhow!(
        "{name} is a command dump, and no program of its name is given: cnc verify PROGRAM {name}"
    )
}

/// What the arguments name, dumps with their programs; says what of it is not judged.
fn found(files: &[PathBuf], global: &Global) -> anyhow::Result<Vec<Task>> {
    let mut found = Found::of(files)?;
    let paths = found.programs.iter().map(|entry| &entry.path);
    let dumps = paths.map(|path| (path, dump_of(path))).filter(|(path, dump)| *path != dump);
    let dumps: HashSet<PathBuf> = dumps.map(|(_, dump)| dump).collect();
    found.others.retain(|path| !dumps.contains(path));
    let is_lonely = |path: &PathBuf| {
        path.extension().is_some_and(|end| end.eq_ignore_ascii_case("csv")) && is_dump(path)
    };
    let lonely = found.others.extract_if(.., |path| is_lonely(path));
    for dump in lonely.filter(|_| !global.quiet) {
        say!("warning: {} is not judged: no program of its name lies beside it", dump.display());
    }
    say_left_out(&found, global);
    let mut tasks = tasks(found);
    for task in &mut tasks {
        task.is_lonely = task.entry.is_named && is_dump(&task.entry.path);
    }
    tasks.retain(|task| !(task.is_lonely && dumps.contains(&task.entry.path)));
    Ok(tasks)
}

fn tasks(found: Found) -> Vec<Task> {
    found.programs.into_iter().map(|entry| Task { entry, is_lonely: false }).collect()
}

/// Whether a file is a dump that can be told to be one; pipes can be read once only.
pub fn is_dump(path: &Path) -> bool {
    let open = || input::is_dump(&input::source(path)?);
    path.is_file() && open().unwrap_or(false)
}
