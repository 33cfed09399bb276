//! The lines of a journal → what is known of the machine, and how far the last job came.
//!
//! Rule: any beginning of a journal says something that was true when it was written; a last line that
//! is not whole says nothing. A job without an end locks the port: whoever wrote it was killed.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use crate::base::Axis;

use super::record::{EndRecord, JobRecord, Record, Steps, parse_tick};

/// What a journal tells of an axis.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Place {
    /// Nothing: no job has run yet.
    Untold,
    /// Where it stands, in motor steps.
    Known(i64),
    /// Nobody knows, and why.
    Unknown(String),
}

/// A job of a journal.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PastJob {
    /// What it is.
    pub job: JobRecord,
    /// Ticks acknowledged.
    pub ticks: u64,
    /// NC line of the last one.
    pub line: u32,
    /// Steps of the whole job that were done at the last seam.
    pub steps: usize,
    /// How it ended; none if its host was killed.
    pub end: Option<EndRecord>,
}

/// What a journal says.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct History {
    /// Why nobody may send anything: nodes may hold a buffer, and would take any byte for a tick.
    locked: Option<String>,
    /// Why axes are unknown of which nothing else is told.
    unknown: Option<String>,
    places: BTreeMap<Axis, Place>,
    /// Axes that have been homed or placed; others are counted from where a job was taken to start.
    referenced: BTreeSet<Axis>,
    /// Name of the last job's machine.
    machine: Option<String>,
    /// Axes of the last job.
    axes: Vec<Axis>,
    /// The last job that `send` has sent of a program or a dump.
    last_sent: Option<PastJob>,
    /// Whether the job under way is that one.
    is_sent: bool,
}

/// A line that is none of a journal.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line} is none of a journal: {reason}")]
pub struct NoRecord {
    /// Which, from 1.
    pub line: usize,
    /// What is wrong with it.
    pub reason: String,
}

impl History {
    /// Reads a journal, and tells how many of its bytes are whole lines.
    ///
    /// # Errors
    /// When a whole line is none of a journal, or what comes behind the last is not its beginning.
    pub fn read(bytes: &[u8]) -> Result<(History, usize), NoRecord> {
        let mut history = History::default();
        let mut whole = 0;
        for (at, line) in bytes.split_inclusive(|byte| *byte == b'\n').enumerate() {
            let wrong = |reason: String| NoRecord { line: at + 1, reason };
            match line.strip_suffix(b"\n") {
                Some(line) => {
                    let text = std::str::from_utf8(line).map_err(|e| wrong(e.to_string()))?;
                    history.line(text).map_err(|error| wrong(error.to_string()))?;
                    whole += line.len() + 1;
                }
                None if line.starts_with(b"{") => {}
                None => return Err(wrong("it begins with no '{'".to_owned())),
            }
        }
        Ok((history, whole))
    }

    fn line(&mut self, text: &str) -> Result<(), serde_json::Error> {
        match parse_tick(text) {
            Some((ticks, line)) => self.tick(ticks, line),
            None => self.record(serde_json::from_str(text)?),
        }
        Ok(())
    }

    /// So many ticks have been acknowledged, the last one of this line.
    pub(super) fn tick(&mut self, ticks: u64, line: u32) {
        if let Some(past) = self.sent() {
            (past.ticks, past.line) = (ticks, line);
        }
    }

    /// Takes what comes next.
    pub fn record(&mut self, record: Record) {
        match record {
            Record::Carried(history) => *self = *history,
            Record::Job(job) => {
                self.locked = Some(format!(
                    "the job {} of {} has no end in the journal: its host was killed, or lost power",
                    job.program.name, job.time
                ));
                self.on_machine(&job.machine.name);
                self.is_sent = job.command == "send";
                self.axes = job.start_steps.keys().copied().collect();
                if self.is_sent {
                    let steps = job.resumed.as_ref().map_or(0, |resumed| resumed.done);
                    self.last_sent = Some(PastJob { job: *job, steps, ..PastJob::default() });
                }
            }
            Record::Seam { steps, ticks, .. } => {
                if let Some(past) = self.sent() {
                    let resumed = past.job.resumed.as_ref();
                    past.steps = resumed.map_or(steps, |resumed| resumed.whole(steps));
                    past.ticks = ticks;
                }
            }
            Record::End(end) => self.end(*end),
            Record::PowerCycled { time } => {
                self.locked = None;
                self.places.clear();
                self.referenced.clear();
                self.unknown = Some(format!("the nodes have been switched off ({time})"));
            }
            Record::Placed { machine, position, .. } => {
                self.on_machine(&machine);
                self.put(position);
            }
            Record::Filling { .. }
            | Record::Started { .. }
            | Record::Event { .. }
            | Record::Held { .. }
            | Record::Resumed => {}
        }
    }

    /// Steps of one machine mean nothing on another.
    fn on_machine(&mut self, name: &str) {
        let before = self.machine.replace(name.to_owned());
        if let Some(other) = before.filter(|other| other != name) {
            let why = format!("it was told of the machine {other}");
            self.places.values_mut().for_each(|place| *place = Place::Unknown(why.clone()));
            self.referenced.clear();
        }
    }

    fn end(&mut self, end: EndRecord) {
        let what = match &end.error {
            Some(error) => format!("failed: {error}"),
            None => format!("was {}", end.result),
        };
        self.locked = end.power_cycle.then(|| {
            let (time, line) = (&end.time, end.line);
            format!("the job that ended at {time} in line {line} {what}; nodes still hold a buffer")
        });
        for (axis, axis_end) in &end.axes {
            let known = axis_end.state.starts_with("known");
            let why = || axis_end.why.clone().unwrap_or_else(|| axis_end.state.clone());
            let place = if known { Place::Known(axis_end.steps) } else { Place::Unknown(why()) };
            self.places.insert(*axis, place);
            if !known {
                self.referenced.remove(axis);
            } else if axis_end.homed.is_some() {
                self.referenced.insert(*axis);
            }
        }
        if let Some(past) = self.sent() {
            (past.ticks, past.line) = (end.ticks, end.line);
            past.end = Some(end);
        }
    }

    fn put(&mut self, position: Steps) {
        self.referenced.extend(position.keys());
        self.places.extend(position.into_iter().map(|(axis, steps)| (axis, Place::Known(steps))));
    }

    fn sent(&mut self) -> Option<&mut PastJob> {
        self.last_sent.as_mut().filter(|_| self.is_sent)
    }

    /// Why nothing may be sent until the nodes have been switched off, if so.
    pub fn locked(&self) -> Option<&str> {
        self.locked.as_deref()
    }

    /// Where an axis stands.
    pub fn place(&self, axis: Axis) -> Place {
        let untold = || self.unknown.clone().map_or(Place::Untold, Place::Unknown);
        self.places.get(&axis).cloned().unwrap_or_else(untold)
    }

    /// Whether an axis has been homed, or stands by somebody's word, since it was unknown. If not, it has
    /// been counted from where a job was taken to start.
    pub fn is_referenced(&self, axis: Axis) -> bool {
        self.referenced.contains(&axis)
    }

    /// The machine of the last job, if there was one.
    pub fn machine(&self) -> Option<&str> {
        self.machine.as_deref()
    }

    /// The last job that `send` has sent of a program or a dump.
    pub fn last_sent(&self) -> Option<&PastJob> {
        self.last_sent.as_ref()
    }

    /// The axes of the last job.
    pub fn axes(&self) -> &[Axis] {
        &self.axes
    }
}
