//! What commands are handed: programs, dumps, profiles.

use std::path::Path;

use anyhow::Context;
use cnc::base::{Machine, Source};

use crate::args::Global;

/// Opens a file, or spools standard input for `-`.
pub fn source(file: &Path) -> anyhow::Result<Source> {
    if file == Path::new("-") {
        return Source::spool("<stdin>", std::io::stdin().lock()).context("standard input");
    }
    Source::open(file).with_context(|| file.display().to_string())
}

/// Loads the profile that `--machine` names, and says its warnings.
pub fn machine(global: &Global) -> anyhow::Result<Machine> {
    profile(&global.machine, global)
}

/// Loads a profile by name or from a file, and says its warnings.
pub fn profile(name_or_file: &str, global: &Global) -> anyhow::Result<Machine> {
    let machine = Machine::load(name_or_file)?;
    warn(&machine, global);
    Ok(machine)
}

/// Says what a profile allows but will not work as hoped.
pub fn warn(machine: &Machine, global: &Global) {
    if !global.quiet {
        machine.warnings().iter().for_each(|warning| say!("warning: {}: {warning}", machine.id));
    }
}
