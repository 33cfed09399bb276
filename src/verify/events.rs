//! Events of a job against those of the path: the same ones, in the same order, each exactly
//! where the path has it. Both come in as they are met; what has come on one side only waits.

use std::collections::VecDeque;

use super::report::{Check, Place};
use crate::base::{Axis, AxisMap, Event, Machine};

/// Events of a job that may wait for the path. One whose place is reached finds it there, so that
/// many are none of the path's.
const WAITING_MAX: usize = 1000;

/// An event of the path.
#[derive(Clone, Debug)]
pub struct Due {
    pub event: Event,
    /// Where the path stands there, to the nearest step.
    pub at_steps: AxisMap<i64>,
}

/// An event of the job.
#[derive(Debug)]
struct Happened {
    event: Event,
    at_steps: AxisMap<i64>,
    place: Place,
}

/// Holds the events of a job against the path's, up to the first that differs.
#[derive(Debug)]
pub struct Timetable<'a> {
    machine: &'a Machine,
    held: bool,
    waiting: VecDeque<Happened>,
    wrong: Option<(String, Place)>,
    last: Place,
}

impl<'a> Timetable<'a> {
    /// Compares if `held`.
    pub fn new(machine: &'a Machine, held: bool) -> Self {
        let (waiting, last) = (VecDeque::new(), Place::default());
        Timetable { machine, held, waiting, wrong: None, last }
    }

    /// An event of the job, with where it happens.
    pub fn event(&mut self, event: &Event, at_steps: &AxisMap<i64>, place: Place) {
        self.last = place;
        if !self.is_open() {
            return;
        }
        self.waiting.push_back(Happened { event: event.clone(), at_steps: *at_steps, place });
        if self.waiting.len() > WAITING_MAX {
            self.first_is_none_of_the_path();
        }
    }

    /// Whether events of the job wait for some of the path.
    pub fn waits(&self) -> bool {
        self.is_open() && !self.waiting.is_empty()
    }

    /// Holds events against those that the path has had up to now.
    pub fn compare(&mut self, due: &mut VecDeque<Due>) {
        if !self.is_open() {
            due.clear();
        }
        while !due.is_empty() && !self.waiting.is_empty() {
            let (Some(due), Some(happened)) = (due.pop_front(), self.waiting.pop_front()) else {
                return;
            };
            if let Some(reason) = self.difference(&due, &happened) {
                self.wrong = Some((reason, happened.place));
                return;
            }
        }
    }

    /// The path has ended, and these events of it are left.
    pub fn end(mut self, due: &VecDeque<Due>) -> Option<Check> {
        if self.waits() {
            self.first_is_none_of_the_path();
        }
        if let Some(Due { event, .. }) = due.front().filter(|_| self.is_open()) {
            let reason = format!("{} of line {} does not happen", event.kind, event.line);
            self.wrong = Some((reason, self.last));
        }
        let wrong = if self.wrong.is_some() { 1.0 } else { 0.0 };
        let mut check = Check { unit: "wrong", ..Check::new("events", None, wrong, 0.0) };
        if let Some((reason, at)) = self.wrong {
            (check.note, check.at) = (Some(reason), Some(at));
        }
        self.held.then_some(check)
    }

    fn is_open(&self) -> bool {
        self.held && self.wrong.is_none()
    }

    fn first_is_none_of_the_path(&mut self) {
        let Some(Happened { event, place, .. }) = self.waiting.pop_front() else { return };
        let reason = format!("{} happens, which the path does not have", event.kind);
        self.wrong = Some((reason, place));
    }

    fn difference(&self, due: &Due, happened: &Happened) -> Option<String> {
        let Due { event: Event { kind, line }, at_steps } = due;
        if *kind != happened.event.kind {
            return Some(format!(
                "{} happens where {kind} of line {line} is due",
                happened.event.kind
            ));
        }
        let mut axes = self.machine.axes.iter().map(|profile| profile.axis);
        let differs = |axis: &Axis| happened.at_steps[*axis] != at_steps[*axis];
        let axis = axes.find(differs)?;
        let (found, wanted) = (happened.at_steps[axis], at_steps[axis]);
        Some(format!(
            "{kind} of line {line} happens at step {axis}={found} where the path has {axis}={wanted}"
        ))
    }
}
