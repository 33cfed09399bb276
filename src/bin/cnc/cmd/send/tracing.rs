//! `--trace`: where the bytes of a job are written down.

use std::fs::File;
use std::path::{Path, PathBuf};

use anyhow::Context;
use cnc::base::Machine;
use cnc::wire::{End, Job};
use cnc::wire_io::journal::Resumed;
use cnc::wire_io::{Speed, Trace, TraceHeader};

use super::Args;
use crate::input;

/// A trace to come.
pub struct Tracing {
    file: File,
    path: PathBuf,
    port: String,
    program: String,
    speed: Speed,
    /// The job waits for the disk.
    waits: bool,
    resumed: Option<Resumed>,
}

impl Tracing {
    /// If a trace is wanted: makes sure that the file can be written.
    pub fn create(
        args: &Args,
        is_simulated: bool,
        resumed: Option<Resumed>,
    ) -> anyhow::Result<Option<Tracing>> {
        let Some(path) = &args.trace else { return Ok(None) };
        input::keep(path).with_context(|| format!("trace {}", path.display()))?;
        let file = File::create(path).with_context(|| format!("trace {}", path.display()))?;
        let name = |path: &Path| path.display().to_string();
        let program = args.file.as_deref().map_or("blocks as typed".to_owned(), name);
        let speed = args.speed.filter(|_| !is_simulated).unwrap_or(Speed::Times(1.0));
        let waits = is_simulated || speed == Speed::Max;
        let (path, port) = (path.to_owned(), name(&args.port.port));
        Ok(Some(Tracing { file, path, port, program, speed, waits, resumed }))
    }

    /// Begins it: the bus's time is 0 now.
    pub fn begin(self, machine: &Machine, job: &Job) -> anyhow::Result<Trace> {
        let header = TraceHeader {
            resumed: self.resumed,
            ..TraceHeader::new(&self.port, self.speed, machine, &self.program, job)
        };
        let path = self.path.display().to_string();
        let name = path.clone();
        let failed = move |error| {
            say!("trace {name} ends here: {error}; the job goes on without it");
        };
        Trace::begin(self.file, &header, self.waits, failed)
            .with_context(|| format!("trace {path}"))
    }
}

/// How a job ended, as in a trace.
pub fn ending(end: &End) -> &'static str {
    match end {
        End::Done => "done",
        End::Interrupted => "interrupted",
        End::Failed(_) => "failed",
    }
}
