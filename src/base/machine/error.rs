//! Profiles that cannot be used, and why.

use std::fmt;
use std::io;

use super::BUILT_IN;
use crate::base::Diagnostic;
use crate::base::likeness::nearest;

/// A profile that cannot be used.
#[derive(Debug)]
pub enum ProfileError {
    /// Neither built in nor a file.
    NotFound {
        /// What was asked for.
        name: String,
    },
    /// A file that cannot be read.
    Unreadable {
        /// Its name.
        file: String,
        /// Why.
        reason: io::Error,
    },
    /// A text that is no profile.
    Wrong {
        /// Name of the file, or of the built-in profile.
        file: String,
        /// What is wrong with it, in the order of the text: all of it, up to 100 faults.
        faults: Vec<Diagnostic>,
    },
}

impl std::error::Error for ProfileError {}

impl fmt::Display for ProfileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ProfileError::NotFound { name } => {
                let names = BUILT_IN.map(|(id, _)| id);
                write!(f, "no machine profile '{name}': there is no such file")?;
                match nearest(name, names.into_iter()) {
                    Some(near) => write!(f, "; did you mean '{near}'?"),
                    None => write!(f, ", and built in are {}", names.join(", ")),
                }
            }
            ProfileError::Unreadable { file, reason } => {
                write!(f, "cannot read machine profile '{file}': {reason}")
            }
            ProfileError::Wrong { file, faults } => {
                write!(f, "machine profile '{file}' cannot be used")?;
                for fault in faults {
                    let (line, column) = (fault.span.line, fault.column());
                    write!(f, "\n  {file}:{line}:{column}: {}", fault.message)?;
                    if let Some(help) = &fault.help {
                        write!(f, " ({help})")?;
                    }
                }
                Ok(())
            }
        }
    }
}
