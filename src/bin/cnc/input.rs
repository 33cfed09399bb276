//! What commands are handed: programs, dumps, profiles.

use std::path::Path;

use anyhow::{Context, anyhow};
use cnc::base::axis::AXES;
use cnc::base::machine::ProfileError;
use cnc::base::{Machine, Point, Source};

use crate::args::Global;
use crate::report;

/// Greatest coordinate that is taken: as far as the numbers of a program reach.
const POSITION_MAX: f64 = 1e9;

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
    let machine = Machine::load(name_or_file).map_err(|error| unusable(error, global))?;
    warn(&machine, global);
    Ok(machine)
}

/// Draws what is wrong with a profile, and gives what is left to say.
pub fn unusable(error: ProfileError, global: &Global) -> anyhow::Error {
    match error {
        ProfileError::Wrong { file, faults } => {
            report::diagnostics(&file, &faults, global);
            anyhow!("machine profile '{file}' cannot be used")
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

/// Reads a position as `--start` takes it: `X,Y,Z`, then further axes in their order if need be.
pub fn point(text: &str) -> Result<Point, String> {
    let parts: Vec<&str> = text.split(',').collect();
    if !(3..=AXES).contains(&parts.len()) {
        return Err("three numbers are expected, as in 75,50,50".to_owned());
    }
    let mut point = Point::ZERO;
    for (value, part) in point.0.iter_mut().zip(parts) {
        let number = part.trim().parse().ok().filter(|number: &f64| number.is_finite());
        *value = number.ok_or_else(|| format!("'{part}' is no number"))?;
        if value.abs() > POSITION_MAX {
            return Err(format!("'{part}' is beyond {POSITION_MAX}"));
        }
    }
    Ok(point)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_position_is_read_axis_by_axis() {
        assert_eq!(point("75, -50,1.5").unwrap().0[..4], [75.0, -50.0, 1.5, 0.0]);
        for bad in ["", "1,2", "1,2,x", "1,2,inf", "1,2,1e10", "1,,2", "1,2,3,4,5,6,7,8,9,10"] {
            assert!(point(bad).is_err(), "{bad}");
        }
    }
}
