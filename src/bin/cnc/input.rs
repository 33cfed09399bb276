//! What commands are handed: programs, dumps, profiles.

use std::io::Read;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use anyhow::{Context, anyhow};
use cnc::base::axis::AXES;
use cnc::base::machine::{POSITION_MOST, ProfileError};
use cnc::base::source::{shown, small_text};
use cnc::base::{AxisMap, Machine, Point, Source};
use cnc::interp::{Checked, Tools};
use cnc::tape::{self, Header, Origin};
use sha2::{Digest, Sha256};

use crate::args::{ChosenBy, Global};
use crate::exit::{ExitWith, Failure};
use crate::refusal::Refusal;
use crate::{environment, meter, report};

/// Largest table of tools or of materials.
pub const TABLE_MIB_MAX: u64 = 16;

/// Files that were opened to be read: device and number of each.
static READ: Mutex<Vec<(u64, u64)>> = Mutex::new(Vec::new());

/// Files that this command writes, by their folders and names.
static WRITTEN: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Whether a file may be written: none that this command reads, or writes already, is written over.
pub fn keep(file: &Path) -> anyhow::Result<()> {
    let data = file.metadata().ok();
    if data.as_ref().is_some_and(|data| !data.is_file()) {
        return Ok(());
    }
    let is_file =
        |data: &std::fs::Metadata, read: &[(u64, u64)]| read.contains(&(data.dev(), data.ino()));
    if let (Some(data), Ok(read)) = (&data, READ.lock())
        && is_file(data, &read)
    {
        return Err(anyhow!("this command reads it: name another file for what is written"));
    }
    if let Ok(mut written) = WRITTEN.lock() {
        let place = place(file);
        if written.contains(&place) {
            return Err(anyhow!("this command writes something else to it: name another file"));
        }
        written.push(place);
    }
    Ok(())
}

/// What a file's name comes to, whether it is there or not.
pub fn place(file: &Path) -> PathBuf {
    if let Ok(place) = file.canonicalize() {
        return place;
    }
    let folder = file.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."));
    let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    file.file_name().map_or_else(|| file.to_owned(), |name| folder.join(name))
}

/// Opens a file, or spools standard input for `-`.
pub fn source(file: &Path) -> anyhow::Result<Source> {
    let source = unwatched(file)?;
    let name = source.name().to_owned();
    meter::watched(source).context(name)
}

fn unwatched(file: &Path) -> anyhow::Result<Source> {
    if file == Path::new("-") {
        return Source::spool("<stdin>", std::io::stdin().lock()).context("standard input");
    }
    has_read(file);
    Source::open(file).with_context(|| shown(file))
}

/// A file is read by this command: it is not written over.
pub fn has_read(file: &Path) {
    if let (Ok(data), Ok(mut read)) = (file.metadata(), READ.lock()) {
        read.push((data.dev(), data.ino()));
    }
}

/// So are the files that a program has called.
pub fn has_called(checked: &Checked) {
    checked.inputs.iter().for_each(|(name, _)| has_read(Path::new(name)));
}

/// Opens what has to be a program; a command dump is told from it by its content.
pub fn program(file: &Path) -> Result<Source, Failure> {
    let source = source(file)?;
    if is_dump(&source)? {
        let name = source.name();
        let reason = anyhow!(
            "{name} is a command dump, not an NC program; verify, send, plot and diff take dumps"
        );
        return Err(reason).or_bad_input();
    }
    Ok(source)
}

/// Whether a file is a command dump.
pub fn is_dump(source: &Source) -> anyhow::Result<bool> {
    let mut head = Vec::new();
    let read = source.reader(0).take(16).read_to_end(&mut head);
    read.with_context(|| source.name().to_owned())?;
    Ok(tape::looks_like_dump(&head))
}

/// Reads the tool table that `--tools` names, if it does, and what it was for a dump's header.
pub fn tools(file: Option<&Path>) -> anyhow::Result<(Tools, Option<Origin>)> {
    let Some(file) = file else { return Ok((Tools::default(), None)) };
    has_read(file);
    let name = shown(file);
    let text = small_text(file, TABLE_MIB_MAX).with_context(|| name.clone())?;
    let tools = Tools::parse(&text).with_context(|| format!("tool table {name}"))?;
    Ok((tools, Some(Origin { name, sha256: Sha256::digest(&text).into() })))
}

/// Loads the profile that `--machine` names, and says its warnings.
pub fn machine(global: &Global) -> anyhow::Result<Machine> {
    if let (ChosenBy::Default, Some(reason)) = (&global.machine_chosen_by, &global.config_unread) {
        return Err(anyhow!(
            "the user's own configuration may name another machine than {}, and cannot be read: {reason}; \
             say --machine",
            global.machine
        ));
    }
    environment::chosen(profile(&global.machine, global), global)
}

/// Loads a profile by name or from a file, and says its warnings.
pub fn profile(name_or_file: &str, global: &Global) -> anyhow::Result<Machine> {
    has_read(Path::new(name_or_file));
    let machine = Machine::load(name_or_file).map_err(|error| unusable(error, global))?;
    warn(&machine, global);
    Ok(machine)
}

/// Draws what is wrong with a profile, and gives what is left to say.
pub fn unusable(error: ProfileError, global: &Global) -> anyhow::Error {
    match error {
        ProfileError::Wrong { file, faults } => {
            report::faults(&file, &faults, global);
            let message = format!("machine profile '{file}' cannot be used");
            Refusal::of_file(&file, &faults, message).into()
        }
        ProfileError::NotFound { .. } | ProfileError::Unreadable { .. } => error.into(),
    }
}

/// Says what a profile allows but will not work as hoped.
pub fn warn(machine: &Machine, global: &Global) {
    if !global.quiet {
        machine.warnings().iter().for_each(|warning| say!("warning: {}: {warning}", machine.id));
    }
}

/// Where a job starts, as `--start` has it: `X,Y,Z`, then further axes in their order if need be.
#[derive(Clone, Debug, PartialEq)]
pub struct Start(Vec<f64>);

impl Start {
    /// A position on all axes.
    pub fn at(position_mm: &Point) -> Start {
        Start(position_mm.0.to_vec())
    }

    /// The machine position; axes that are not named start at the work zero.
    pub fn position_mm(&self, machine: &Machine) -> Point {
        let mut position_mm = machine.work_zero_mm;
        for (value, named) in position_mm.0.iter_mut().zip(&self.0) {
            *value = *named;
        }
        position_mm
    }
}

impl std::str::FromStr for Start {
    type Err = String;

    fn from_str(text: &str) -> Result<Start, String> {
        let number = |part: &str| {
            let number =
                part.trim().parse().ok().filter(|number: &f64| number.abs() <= POSITION_MOST);
            number.ok_or_else(|| format!("'{part}' is no position"))
        };
        let values = text.split(',').map(number).collect::<Result<Vec<f64>, String>>()?;
        if !(3..=AXES).contains(&values.len()) {
            return Err("three numbers are expected, as in 75,50,50".to_owned());
        }
        Ok(Start(values))
    }
}

/// As it is read; the shortest digits that mean the same number.
impl std::fmt::Display for Start {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let values: Vec<String> = self.0.iter().map(f64::to_string).collect();
        write!(f, "{}", values.join(","))
    }
}

/// Where every axis stands before the first tick of a dump, in steps. Those without a column do not move: they
/// are where its option `start` says, or at the machine's work zero.
pub fn start_steps(header: &Header, machine: &Machine) -> AxisMap<i64> {
    let option = header.options.iter().find(|(name, _)| name == "start");
    let start: Option<Start> = option.and_then(|(_, value)| value.parse().ok());
    let start_mm = start.map_or(machine.work_zero_mm, |start| start.position_mm(machine));
    let mut steps = machine.nearest_steps(&start_mm);
    for (axis, _) in &header.steps_per_mm {
        steps[*axis] = header.start_steps[*axis];
    }
    steps
}

/// What the operator makes of the feeds of cuts, in percent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeedOverride(f64);

impl FeedOverride {
    /// From 1 to 200.
    pub fn percent(self) -> f64 {
        self.0
    }
}

impl std::str::FromStr for FeedOverride {
    type Err = String;

    fn from_str(text: &str) -> Result<FeedOverride, String> {
        let number = text.strip_suffix('%').unwrap_or(text).parse().ok();
        let percent = number.filter(|percent| (1.0..=200.0).contains(percent));
        percent.map(FeedOverride).ok_or_else(|| "from 1% to 200% is expected, as in 50%".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_start_is_read_axis_by_axis() {
        let ideal = Machine::load("ideal").unwrap();
        let start: Start = "75, -50,1.5".parse().unwrap();
        assert_eq!(start.position_mm(&ideal).0[..4], [75.0, -50.0, 1.5, 0.0]);
        assert_eq!(start.to_string().parse(), Ok(start));
        for bad in ["", "1,2", "1,2,x", "1,2,inf", "1,2,1e7", "1,,2", "1,2,3,4,5,6,7,8,9,10"] {
            assert!(bad.parse::<Start>().is_err(), "{bad}");
        }
    }
}
