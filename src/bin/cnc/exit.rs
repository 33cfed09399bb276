//! How a command ends: exit codes, and errors that know theirs.

use std::io;
use std::process::ExitCode;

use crate::meter::Interrupted;
use crate::refusal;

/// A command that ran to its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// Done, nothing wrong.
    Ok = 0,
    /// The input is bad, and all about it has been said.
    BadInput = 1,
    /// A machine profile is bad or a file cannot be read, and all about it has been said.
    Unusable = 2,
    /// The port, the bus or a node failed, and all about it has been said.
    Bus = 3,
    /// Interrupted by the operator, and all about it has been said.
    Interrupted = 130,
}

/// A command that could not go on: the code to exit with, and why.
#[derive(Debug)]
pub struct Failure {
    /// 1 bad input, 2 usage, profile or file trouble, 3 port, bus or node, 130 interrupted.
    pub code: u8,
    /// Why, with its causes.
    pub error: anyhow::Error,
}

/// What every command returns.
pub type Outcome = Result<Exit, Failure>;

/// Trouble is with usage or files unless said otherwise.
impl<E: Into<anyhow::Error>> From<E> for Failure {
    fn from(error: E) -> Self {
        Failure { code: 2, error: error.into() }
    }
}

/// Gives an error another exit code than 2.
pub trait ExitWith<T> {
    /// 1: the input is bad.
    fn or_bad_input(self) -> Result<T, Failure>;
    /// 3: the port, the bus or a node failed.
    fn or_bus(self) -> Result<T, Failure>;
}

impl<T, E: Into<anyhow::Error>> ExitWith<T> for Result<T, E> {
    fn or_bad_input(self) -> Result<T, Failure> {
        self.map_err(|error| Failure { code: 1, error: error.into() })
    }

    fn or_bus(self) -> Result<T, Failure> {
        self.map_err(|error| Failure { code: 3, error: error.into() })
    }
}

/// Says what stopped a command, as JSON too if that is wanted, and gives the process its exit code. A
/// reader of our standard output that went away (`| head`) is no failure; a peer on the bus that did so
/// is one.
pub fn code(outcome: Outcome, as_json: bool) -> ExitCode {
    let failure = match outcome {
        Ok(exit) => return ExitCode::from(exit as u8),
        Err(failure) => failure,
    };
    if failure.code == 2 && is_broken_pipe(&failure.error) {
        return ExitCode::SUCCESS;
    }
    let (code, message) = match failure.error.chain().any(Interrupted::is_in) {
        true => (Exit::Interrupted as u8, "interrupted".to_owned()),
        false => (failure.code, told(&failure.error)),
    };
    if !refusal::is_told(&failure.error) {
        say!("error: {message}");
    }
    if as_json {
        refusal::print(code, &message, refusal::errors(&failure.error));
    }
    ExitCode::from(code)
}

/// Why, with its causes; without the system's numbers, whose words say the same.
pub fn told(error: &anyhow::Error) -> String {
    let text = format!("{error:#}");
    let mut parts = text.split(" (os error ");
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |told, part| match part.split_once(')') {
        Some((number, rest)) if number.bytes().all(|byte| byte.is_ascii_digit()) => told + rest,
        _ => told + " (os error " + part,
    })
}

/// A result that nobody reads to its end is no failure, and the verdict stands.
pub fn unless_unread(written: io::Result<()>) -> io::Result<()> {
    written.or_else(|error| match error.kind() {
        io::ErrorKind::BrokenPipe => Ok(()),
        _ => Err(error),
    })
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        cause
            .downcast_ref::<io::Error>()
            .is_some_and(|error| error.kind() == io::ErrorKind::BrokenPipe)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_the_system_are_not_told() {
        let number = io::Error::from_raw_os_error(2);
        let error = anyhow::Error::new(number).context("a (os error x).nc");
        assert_eq!(told(&error), "a (os error x).nc: No such file or directory");
    }
}
