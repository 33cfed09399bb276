//! Events of a job against those of the path: the same ones, in the same order, each exactly
//! where the path has it.

use super::report::{Check, Place};
use super::{Cause, Setup, VerifyError};
use crate::base::{AxisMap, Event, Machine};
use crate::path::PathItem;

/// The events of a path, each with where the path stands, to the nearest step.
pub struct PathEvents<'a, P: Iterator> {
    path: std::iter::Fuse<P>,
    machine: &'a Machine,
    at_steps: AxisMap<i64>,
}

impl<'a, P, E> PathEvents<'a, P>
where
    P: Iterator<Item = Result<PathItem, E>>,
    E: Into<Cause>,
{
    pub fn new(path: P, setup: &Setup<'a>) -> Self {
        PathEvents { path: path.fuse(), machine: setup.machine, at_steps: setup.start_steps }
    }

    /// The next event; after it, `at_steps` is where it happens. At the end of the path, none.
    fn next(&mut self) -> Result<Option<Event>, VerifyError> {
        for item in self.path.by_ref() {
            match item.map_err(|error| VerifyError::Path(error.into()))? {
                PathItem::Event(event) => return Ok(Some(event)),
                PathItem::Segment(segment) => {
                    self.at_steps = self.machine.nearest_steps(&segment.to_mm);
                }
            }
        }
        Ok(None)
    }
}

/// Holds the events of a job against the path's, up to the first that differs.
pub struct Timetable<'a, P: Iterator> {
    path: PathEvents<'a, P>,
    held: bool,
    wrong: Option<(String, Place)>,
    last: Place,
}

impl<'a, P, E> Timetable<'a, P>
where
    P: Iterator<Item = Result<PathItem, E>>,
    E: Into<Cause>,
{
    /// Compares if `held`; otherwise the path's end alone is looked for.
    pub fn new(path: PathEvents<'a, P>, held: bool) -> Self {
        Timetable { path, held, wrong: None, last: Place::default() }
    }

    /// An event of the job, with where it happens.
    pub fn event(
        &mut self,
        event: &Event,
        at_steps: &AxisMap<i64>,
        place: Place,
    ) -> Result<(), VerifyError> {
        self.last = place;
        if !self.held || self.wrong.is_some() {
            return Ok(());
        }
        let reason = match self.path.next()? {
            None => format!("{} happens, which the path does not have", event.kind),
            Some(due) if due.kind != event.kind => {
                format!("{} happens where {} of line {} is due", event.kind, due.kind, due.line)
            }
            Some(due) => match self
                .path
                .machine
                .axes
                .iter()
                .map(|profile| profile.axis)
                .find(|axis| at_steps[*axis] != self.path.at_steps[*axis])
            {
                None => return Ok(()),
                Some(axis) => format!(
                    "{} of line {} happens at step {axis}={} where the path has {axis}={}",
                    due.kind, due.line, at_steps[axis], self.path.at_steps[axis]
                ),
            },
        };
        self.wrong = Some((reason, place));
        Ok(())
    }

    /// The end of the job: where the path ends, and the check on its events.
    pub fn end(mut self) -> Result<(AxisMap<i64>, Option<Check>), VerifyError> {
        while let Some(due) = self.path.next()? {
            if self.held && self.wrong.is_none() {
                let reason = format!("{} of line {} does not happen", due.kind, due.line);
                self.wrong = Some((reason, self.last));
            }
        }
        let wrong = if self.wrong.is_some() { 1.0 } else { 0.0 };
        let mut check = Check { unit: "wrong", ..Check::new("events", None, wrong, 0.0) };
        if let Some((reason, at)) = self.wrong {
            (check.note, check.at) = (Some(reason), Some(at));
        }
        Ok((self.path.at_steps, self.held.then_some(check)))
    }
}
