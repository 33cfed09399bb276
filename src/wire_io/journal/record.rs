//! Lines of a journal ⇄ what they say.

use std::collections::BTreeMap;
use std::time::{SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

use crate::base::machine::Unit;
use crate::base::{Axis, AxisMap, Event};
use crate::wire::{Doubt, End, Ending, HomeRun, PacingFigures};

use super::history::History;

/// What each axis has one of, in motor steps.
pub type Steps = BTreeMap<Axis, i64>;

/// One line of a journal. `time` is UTC, as 2026-11-22T10:00:00Z.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "kebab-case")]
pub enum Record {
    /// What a journal that was too long has said.
    Carried(Box<History>),
    /// A job begins. Until its [`Record::End`] nobody knows what the nodes hold.
    Job(Box<JobRecord>),
    /// A node is given its buffer.
    Filling {
        /// The buffer.
        buffer: u32,
        /// The node's ID.
        node: u8,
        /// The axis that it moves.
        axis: Option<Axis>,
        /// It answers every tick.
        master: bool,
    },
    /// The nodes execute a buffer.
    Started {
        /// The buffer.
        buffer: u32,
    },
    /// An event has been reached.
    Event {
        /// Its line of the NC program.
        line: u32,
        /// As in a dump.
        event: String,
    },
    /// A buffer is done, and every node in it has answered since.
    Seam {
        /// The buffer.
        buffer: u32,
        /// Steps of the job (buffers, and events between them) that are done.
        steps: usize,
        /// Ticks acknowledged so far, pads not counted.
        ticks: u64,
        /// Where the machine stands.
        position: Steps,
    },
    /// A hold took effect.
    Held {
        /// Ticks acknowledged so far.
        ticks: u64,
        /// NC line of what comes next.
        line: u32,
        /// Within a buffer.
        executing: bool,
    },
    /// The job went on after a hold.
    Resumed,
    /// A job has ended.
    End(Box<EndRecord>),
    /// The nodes have been switched off and on: no axis is known any more.
    PowerCycled {
        /// When it was said.
        time: String,
    },
    /// Axes stand somewhere by somebody's word.
    Placed {
        /// When.
        time: String,
        /// Whose: `operator`.
        by: String,
        /// Name of the machine.
        machine: String,
        /// Where.
        position: Steps,
    },
}

/// What a job is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JobRecord {
    /// Version of the format: 1.
    pub schema: u32,
    /// `send`, `typed`, `jog` or `home`.
    pub command: String,
    /// When it began.
    pub time: String,
    /// What planned it, and its version.
    pub tool: String,
    /// The port, as it was named.
    pub port: String,
    /// The NC program or dump.
    pub program: Named,
    /// Further files that its motion was made from.
    pub inputs: Vec<Named>,
    /// Options that change motion.
    pub options: Vec<String>,
    /// The machine's profile.
    pub machine: Named,
    /// SHA-256 of what the nodes are to be sent, and when events come; of the whole job in one that
    /// goes on.
    pub plan_sha256: String,
    /// Where the machine stands before the first tick.
    pub start_steps: Steps,
    /// Ticks to come.
    pub ticks: u64,
    /// Buffers to come.
    pub buffers: u64,
    /// The job goes on where another one ended.
    pub resumed: Option<Resumed>,
}

/// How the steps of a resumed job belong to those of the whole one.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Resumed {
    /// Steps of the whole job that were done before.
    pub done: usize,
    /// Steps at the beginning of this one that lead there.
    pub approach: usize,
    /// Where the machine stood before the first tick of the whole one.
    #[serde(default)]
    pub start_steps: Steps,
}

impl Resumed {
    /// Steps of the whole job that are done once so many of this one are.
    pub fn whole(&self, steps: usize) -> usize {
        self.done + steps.saturating_sub(self.approach)
    }
}

/// A name, and the hash of what it stood for.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Named {
    /// File name or id.
    pub name: String,
    /// SHA-256, in hexadecimal digits.
    pub sha256: String,
}

impl Named {
    /// A name and a hash.
    pub fn new(name: &str, sha256: &[u8; 32]) -> Named {
        Named { name: name.to_owned(), sha256: hex(sha256) }
    }
}

/// Bytes in hexadecimal digits.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// How a job ended.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EndRecord {
    /// When.
    pub time: String,
    /// `done`, `interrupted` or `failed`.
    pub result: String,
    /// What failed.
    pub error: Option<String>,
    /// Ticks acknowledged, pads not counted.
    pub ticks: u64,
    /// NC line of the last tick acknowledged or event reached.
    pub line: u32,
    /// Nodes have to be switched off before they can be used again.
    pub power_cycle: bool,
    /// What is known of each axis.
    pub axes: BTreeMap<Axis, AxisRecord>,
    /// How well the ticks kept their period.
    pub pacing: Option<PacingFigures>,
}

/// What is known of an axis.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AxisRecord {
    /// Machine position in steps, as far as acknowledged.
    pub steps: i64,
    /// The same in mm; degrees on rotary axes.
    pub position_mm: f64,
    /// `known`, `known-until-power-off`, `known-as-sent`, `unconfirmed` or `unknown`.
    pub state: String,
    /// Why it is not known.
    pub why: Option<String>,
    /// It was homed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub homed: Option<HomeRecord>,
}

/// What the audit of a homed axis had to go by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct HomeRecord {
    /// Steps that it made by the time it took, at least and at most.
    pub made_steps: [u64; 2],
    /// Steps that it had to make by what was counted, if anybody had counted.
    pub counted_steps: Option<i64>,
}

impl HomeRecord {
    fn new(run: &HomeRun) -> HomeRecord {
        HomeRecord { made_steps: run.made_steps, counted_steps: run.counted_steps }
    }
}

impl EndRecord {
    /// Of an ending, now.
    pub fn new(ending: &Ending) -> EndRecord {
        let (result, error) = match &ending.end {
            End::Done => ("done", None),
            End::Interrupted => ("interrupted", None),
            End::Failed(fault) => ("failed", Some(fault.to_string())),
        };
        let homed = |axis: Axis| ending.homed.iter().find(|run| run.axis == axis);
        // Of what nobody has known nor moved, the journal knows no less than before.
        let told = ending.axes.iter().filter(|end| end.why != Some(Doubt::Untold));
        let axes = told.map(|end| {
            let record = AxisRecord {
                steps: end.steps,
                position_mm: end.position_mm,
                state: end.position.name().to_owned(),
                why: end.why.map(|why| why.to_string()),
                homed: homed(end.axis).map(HomeRecord::new),
            };
            (end.axis, record)
        });
        EndRecord {
            time: now(),
            result: result.to_owned(),
            error,
            ticks: ending.ticks,
            line: ending.line,
            power_cycle: ending.power_cycle,
            axes: axes.collect(),
            pacing: Some(ending.pacing.figures()),
        }
    }
}

impl Record {
    /// An event that has been reached.
    pub fn event(event: &Event) -> Record {
        Record::Event { line: event.line, event: event.kind.to_string() }
    }

    /// A node that is given its buffer.
    pub fn filling(buffer: u32, unit: Unit, master: bool) -> Record {
        Record::Filling { buffer, node: unit.id, axis: unit.axis, master }
    }
}

/// The line of a tick that has been acknowledged: they are most of a journal, so they are short.
pub fn tick_line(ticks: u64, line: u32) -> String {
    format!("{{\"tick\":{ticks},\"line\":{line}}}\n")
}

/// Ticks acknowledged and NC line, of the line of a tick.
pub(super) fn parse_tick(text: &str) -> Option<(u64, u32)> {
    let (ticks, line) = text.strip_prefix("{\"tick\":")?.split_once(",\"line\":")?;
    Some((ticks.parse().ok()?, line.strip_suffix('}')?.parse().ok()?))
}

/// Axes of a machine, of what all axes have one of.
pub fn steps_of(axes: impl IntoIterator<Item = Axis>, steps: &AxisMap<i64>) -> Steps {
    axes.into_iter().map(|axis| (axis, steps[axis])).collect()
}

/// What time it is, as 2026-11-22T10:00:00Z.
pub fn now() -> String {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    stamp(since.map_or(0, |since| since.as_secs()))
}

/// Seconds since 1970 as a date and time. A year is counted from March, so that the leap day is its
/// last; 400 years have 146097 days.
fn stamp(seconds: u64) -> String {
    let (days, second) = (seconds / 86_400 + 719_468, seconds % 86_400);
    let (era, day) = (days / 146_097, days % 146_097);
    let year_of_era = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day = day - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month = (5 * day + 2) / 153;
    let day = day - (153 * month + 2) / 5 + 1;
    let (month, next) = if month < 10 { (month + 3, 0) } else { (month - 9, 1) };
    let year = era * 400 + year_of_era + next;
    let (hour, minute) = (second / 3600, second / 60 % 60);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{:02}Z", second % 60)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_are_dates() {
        for (seconds, text) in [
            (0, "1970-01-01T00:00:00Z"),
            (951_782_399, "2000-02-28T23:59:59Z"),
            (951_868_799, "2000-02-29T23:59:59Z"),
            (951_868_800, "2000-03-01T00:00:00Z"),
            (1_795_341_681, "2026-11-22T10:01:21Z"),
            (4_107_542_400, "2100-03-01T00:00:00Z"),
        ] {
            assert_eq!(stamp(seconds), text);
        }
    }
}
