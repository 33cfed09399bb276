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

/// Loads the profile that the user named.
pub fn machine(global: &Global) -> anyhow::Result<Machine> {
    Ok(Machine::load(&global.machine)?)
}
