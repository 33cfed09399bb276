//! The second pass: motion, as the program runs.

use std::io;

use crate::base::{Diagnostic, Machine, Severity, Source};

use super::Options;
use super::motion::Motion;
use super::run::Run;

/// Why a run cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The text cannot be read.
    #[error("the program cannot be read")]
    Io(#[from] io::Error),
    /// The program has an error; since it was checked before, its text has changed.
    #[error("line {}: {} ({})", .0.span.line, .0.message, .0.rule)]
    Program(Box<Diagnostic>),
}

/// What a program makes happen, in order. Made by [`motions`].
#[derive(Debug)]
pub struct Motions<'a> {
    run: Run<'a>,
    /// What the last block has made, and how much of it has been handed out.
    made: Vec<Motion>,
    next: usize,
    is_over: bool,
}

/// Runs a program and hands out its motion as it goes, in constant memory.
///
/// The program is to be checked before (see [`super::check`]), for here it ends at its first
/// error. Travel limits are the check's business.
pub fn motions<'a>(source: &Source, machine: &'a Machine, options: &Options) -> Motions<'a> {
    let run = Run::new(source, machine, options, 1);
    Motions { run, made: Vec::new(), next: 0, is_over: false }
}

impl Iterator for Motions<'_> {
    type Item = Result<Motion, RunError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(motion) = self.made.get(self.next) {
                self.next += 1;
                return Some(Ok(motion.clone()));
            }
            if self.is_over {
                return None;
            }
            self.made.clear();
            self.next = 0;
            match self.run.step(&mut self.made) {
                Ok(goes_on) => self.is_over = !goes_on,
                Err(error) => {
                    self.is_over = true;
                    return Some(Err(RunError::Io(error)));
                }
            }
            if self.run.engine.findings.errors > 0 {
                self.made.clear();
                self.is_over = true;
                let mut found = self.run.engine.findings.list.drain(..);
                let error = found.find(|diagnostic| diagnostic.severity == Severity::Error)?;
                return Some(Err(RunError::Program(Box::new(error))));
            }
        }
    }
}
