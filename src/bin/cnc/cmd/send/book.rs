//! What the journal says of a job that is sent.

use cnc::base::{Axis, Machine};
use cnc::tape::{Header, Origin};
use cnc::wire::{Ending, Job};
use cnc::wire_io::journal::{self, JobRecord, Journal, Journaled, Named, Record};

use super::operator::Terminal;
use crate::exit::{Exit, Outcome};

/// The journal of a job, and what the job was made from.
pub struct Book<'a> {
    journal: &'a mut Journal,
    job: JobRecord,
}

impl<'a> Book<'a> {
    pub fn new(journal: &'a mut Journal, job: JobRecord) -> Self {
        Book { journal, job }
    }

    /// Writes that the job begins. It must not if that fails.
    pub fn begin(&mut self, job: &Job, machine: &Machine) -> anyhow::Result<()> {
        let is_known = |axis: &Axis| job.axes.contains(*axis) && !job.unknown.contains(*axis);
        let known = machine.bus.nodes.keys().copied().filter(is_known);
        self.job.start_steps = journal::steps_of(known, &job.start_steps);
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
        if let Some(why) = self.journal.too_long() {
            say!("warning: {why}");
        }
    }

    /// A job whose journal is not whole has failed, whatever became of it.
    pub fn verdict(&self, outcome: Outcome) -> Outcome {
        let exit = outcome?;
        match self.journal.failed() {
            None => Ok(exit),
            Some(why) => {
                say!("error: {why}; a job without a journal ends where the axes are slow enough");
                Ok(Exit::Bus)
            }
        }
    }
}

/// What a job is by the header of its dump, which a program has too.
pub fn record(origin: &Header) -> JobRecord {
    let named = |origin: &Origin| Named::new(&origin.name, &origin.sha256);
    let option = |(name, value): &(String, String)| format!("{name}={value}");
    JobRecord {
        schema: 1,
        command: "send".to_owned(),
        tool: origin.tool.clone(),
        program: named(&origin.program),
        inputs: origin.inputs.iter().map(named).collect(),
        options: origin.options.iter().map(option).collect(),
        machine: named(&origin.machine),
        ..JobRecord::default()
    }
}

/// A job that was made from nothing but the command line.
pub fn by_hand(command: &str, machine: &Machine) -> JobRecord {
    JobRecord {
        schema: 1,
        command: command.to_owned(),
        tool: format!("cnc {}", env!("CARGO_PKG_VERSION")),
        machine: Named::new(&machine.id, &machine.sha256()),
        ..JobRecord::default()
    }
}
