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

impl Motions<'_> {
    /// The next motion, which stays where it has been made; none at the end.
    ///
    /// # Errors
    /// As the iterator's. Nothing comes after one.
    pub fn read(&mut self) -> Result<Option<&Motion>, RunError> {
        while self.next == self.made.len() {
            if self.is_over {
                return Ok(None);
            }
            self.made.clear();
            self.next = 0;
            if let Err(error) = self.step() {
                self.made.clear();
                self.is_over = true;
                return Err(error);
            }
        }
        self.next += 1;
        Ok(self.made.get(self.next - 1))
    }

    fn step(&mut self) -> Result<(), RunError> {
        self.is_over = !self.run.step(&mut self.made)?;
        if self.run.engine.findings.errors > 0 {
            let mut found = self.run.engine.findings.list.drain(..);
            if let Some(error) = found.find(|found| found.severity == Severity::Error) {
                return Err(RunError::Program(Box::new(error)));
            }
        }
        Ok(())
    }
}

impl Iterator for Motions<'_> {
    type Item = Result<Motion, RunError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.read().map(Option::<&Motion>::cloned).transpose()
    }
}
