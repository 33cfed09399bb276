//! What the journal says of a job that is sent.

use std::path::Path;

use anyhow::anyhow;
use cnc::tape::{Header, Origin};
use cnc::wire::{Ending, Job};
use cnc::wire_io::journal::{self, JobRecord, Journal, Journaled, Named, Record, Resumed};

use super::operator::Terminal;
use crate::exit::{Failure, Outcome};

/// The journal of a job, and what the job was made from.
pub struct Book<'a> {
    journal: &'a mut Journal,
    job: JobRecord,
}

impl<'a> Book<'a> {
    pub fn new(
        journal: &'a mut Journal,
        port: &Path,
        origin: &Header,
        resumed: Option<Resumed>,
    ) -> Self {
        let port = port.display().to_string();
        Book { journal, job: JobRecord { port, resumed, ..record(origin) } }
    }

    /// Writes that the job begins. It must not if that fails.
    pub fn begin(&mut self, job: &Job) -> anyhow::Result<()> {
        self.job.time = journal::now();
        self.job.ticks = job.ticks;
        self.job.buffers = job.buffers().count() as u64;
        Ok(self.journal.append(Record::Job(Box::new(self.job.clone())))?)
    }

    pub fn journaled<'b>(&'b mut self, operator: &'b mut Terminal) -> Journaled<'b, Terminal> {
        Journaled::new(operator, self.journal)
    }

    pub fn end(&mut self, ending: &Ending) {
        self.journal.end(ending);
    }

    /// A job whose journal is not whole has failed, whatever became of it.
    pub fn verdict(&self, outcome: Outcome) -> Outcome {
        let exit = outcome?;
        match self.journal.failed() {
            None => Ok(exit),
            Some(why) => Err(Failure {
                code: 3,
                error: anyhow!(
                    "{why}; a job without a journal ends where the axes are slow enough"
                ),
            }),
        }
    }
}

/// What a job is by the header of its dump, which a program has too.
pub fn record(origin: &Header) -> JobRecord {
    let named = |origin: &Origin| Named::new(&origin.name, &origin.sha256);
    let option = |(name, value): &(String, String)| format!("{name}={value}");
    let axes = origin.steps_per_mm.iter().map(|(axis, _)| *axis);
    JobRecord {
        schema: 1,
        command: "send".to_owned(),
        tool: origin.tool.clone(),
        program: named(&origin.program),
        inputs: origin.inputs.iter().map(named).collect(),
        options: origin.options.iter().map(option).collect(),
        machine: named(&origin.machine),
        start_steps: journal::steps_of(axes, &origin.start_steps),
        ..JobRecord::default()
    }
}
