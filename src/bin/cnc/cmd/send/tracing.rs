//! `--trace`: where the bytes of a job are written down.

use std::fs::File;
use std::path::{Path, PathBuf};

use anyhow::Context;
use cnc::base::Machine;
use cnc::wire::{End, Job};
use cnc::wire_io::{Speed, Trace, TraceHeader};

use super::Args;

/// A trace to come.
pub struct Tracing {
    file: File,
    path: PathBuf,
    port: String,
    program: String,
    speed: Speed,
}

impl Tracing {
    /// Makes sure that the file can be written.
    pub fn create(path: &Path, args: &Args, speed: Speed) -> anyhow::Result<Tracing> {
        let file = File::create(path).with_context(|| format!("trace {}", path.display()))?;
        let name = |path: &Path| path.display().to_string();
        let program = args.file.as_deref().map_or("blocks as typed".to_owned(), name);
        Ok(Tracing { file, path: path.to_owned(), port: name(&args.port.port), program, speed })
    }

    /// Begins it: the bus's time is 0 now. Nodes that keep no real time wait for the disk.
    pub fn begin(self, machine: &Machine, job: &Job) -> anyhow::Result<Trace> {
        let header = TraceHeader::new(&self.port, self.speed, machine, &self.program, job);
        let waits = self.speed == Speed::Max || self.port.starts_with("sim:");
        let path = self.path.display().to_string();
        let name = path.clone();
        let failed = move |error| {
            say!("trace {name} ends here: {error}; the job goes on without it");
        };
        Trace::begin(self.file, &header, waits, failed).with_context(|| format!("trace {path}"))
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
