//! Every byte both ways, with its time → JSON Lines; and back.
//!
//! A thread of its own writes, behind a channel that has an end: no disk holds up the pacing of a real
//! bus. Lines for which there is no room are left out and counted; a trace that fails is told once, and
//! the job goes on. What has been written is on its way to the disk a fifth of a second later, so that a
//! host that is killed leaves a trace too.
//!
//! ```text
//! {"schema":1,"type":"trace","tool":"cnc 0.1.0","started_unix_us":…,"port":"sim:",…}
//! {"t_us":0,"dir":"tx","hex":"6a7a"}
//! {"t_us":781,"dir":"rx","hex":"7a"}
//! {"t_us":18250114,"end":"done"}
//! ```

mod read;

use std::collections::BTreeMap;
use std::fmt;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

use crate::base::{Axis, AxisMap, Machine};
use crate::wire::Job;
use crate::wire_io::clock::Speed;
use crate::wire_io::journal::Resumed;
use crate::wire_io::link::{Link, LinkError};

pub use self::read::{TraceError, TraceReader};

/// Lines that wait for the disk at most: minutes of a job, a few megabytes.
const WAITING_MAX: usize = 1 << 16;
/// How long lines stay in memory.
const FLUSH: Duration = Duration::from_millis(200);

/// The first line of a trace: what the job was.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TraceHeader {
    /// Version of the format: 1.
    pub schema: u32,
    /// `trace`.
    pub r#type: String,
    /// What sent the job, and its version.
    pub tool: String,
    /// Wall time at `t_us` 0, in microseconds since 1970 (UTC).
    pub started_unix_us: u64,
    /// The port, as it was named.
    pub port: String,
    /// How fast the time `t_us` ran: times real time, or `max`.
    pub speed: String,
    /// The machine's name.
    pub machine: String,
    /// SHA-256 of its profile.
    pub machine_sha256: String,
    /// Name of the program or dump.
    pub program: String,
    /// SHA-256 of the job: its buffers and events.
    pub job_sha256: String,
    /// Machine position before the first tick.
    pub start_steps: BTreeMap<Axis, i64>,
    /// It is what was left of another job, and the way there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resumed: Option<Resumed>,
}

impl TraceHeader {
    /// Of a job that begins now.
    pub fn new(port: &str, speed: Speed, machine: &Machine, program: &str, job: &Job) -> Self {
        let started = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let axes = machine.axes.iter().map(|profile| profile.axis);
        TraceHeader {
            schema: 1,
            r#type: "trace".to_owned(),
            tool: format!("cnc {}", env!("CARGO_PKG_VERSION")),
            started_unix_us: u64::try_from(started.as_micros()).unwrap_or(0),
            port: port.to_owned(),
            speed: match speed {
                Speed::Times(factor) => factor.to_string(),
                Speed::Max => "max".to_owned(),
            },
            machine: machine.id.clone(),
            machine_sha256: hex(&machine.sha256()),
            program: program.to_owned(),
            job_sha256: hex(&job.sha256()),
            start_steps: axes.map(|axis| (axis, job.start_steps[axis])).collect(),
            resumed: None,
        }
    }

    /// Where the machine stood before the first tick.
    pub fn start(&self) -> AxisMap<i64> {
        steps(&self.start_steps)
    }

    /// Where it stood before the first tick of the whole job, if this is the rest of one.
    pub fn whole_start(&self) -> AxisMap<i64> {
        steps(self.resumed.as_ref().map_or(&self.start_steps, |resumed| &resumed.start_steps))
    }
}

fn steps(of_axes: &BTreeMap<Axis, i64>) -> AxisMap<i64> {
    AxisMap::from_fn(|axis| of_axes.get(&axis).copied().unwrap_or(0))
}

/// One line behind the first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TraceLine {
    /// Bytes that the host has handed to the port in one go.
    Sent {
        /// When that was done, in microseconds of the bus's time.
        t_us: u64,
        /// The bytes.
        bytes: Vec<u8>,
        /// The port failed: they may not have got out.
        failed: bool,
    },
    /// Bytes that the host has received.
    Received {
        /// When they were there.
        t_us: u64,
        /// The bytes.
        bytes: Vec<u8>,
    },
    /// The disk was too slow for so many lines, which are not here.
    Lost {
        /// How many.
        lines: u64,
    },
    /// The job's end: `done`, `interrupted`, `failed`.
    End {
        /// When.
        t_us: u64,
        /// How.
        end: String,
    },
}

/// As in the file, without the line's end.
impl fmt::Display for TraceLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            TraceLine::Sent { t_us, bytes, failed } => {
                let failed = if *failed { r#","failed":true"# } else { "" };
                write!(f, r#"{{"t_us":{t_us},"dir":"tx","hex":"{}"{failed}}}"#, hex(bytes))
            }
            TraceLine::Received { t_us, bytes } => {
                write!(f, r#"{{"t_us":{t_us},"dir":"rx","hex":"{}"}}"#, hex(bytes))
            }
            TraceLine::Lost { lines } => write!(f, r#"{{"lost":{lines}}}"#),
            TraceLine::End { t_us, end } => write!(f, r#"{{"t_us":{t_us},"end":"{end}"}}"#),
        }
    }
}

/// Bytes as hexadecimal digits.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A trace being written.
#[derive(Debug)]
pub struct Trace {
    /// None once the last line has been handed over.
    lines: Option<SyncSender<TraceLine>>,
    thread: Option<JoinHandle<()>>,
    /// A simulated bus has time to wait for the disk.
    waits: bool,
    lost: u64,
}

impl Trace {
    /// Begins a trace. `waits` says whether the job waits for a slow disk, or lines are left out;
    /// `failed` is told, once, from another thread, when it cannot be written any more.
    ///
    /// # Errors
    /// When not even its first line can be written.
    pub fn begin(
        mut file: File,
        header: &TraceHeader,
        waits: bool,
        failed: impl FnOnce(io::Error) + Send + 'static,
    ) -> io::Result<Trace> {
        serde_json::to_writer(&mut file, header)?;
        file.write_all(b"\n")?;
        let (lines, received) = sync_channel(WAITING_MAX);
        let thread = std::thread::Builder::new().name("trace".to_owned()).spawn(move || {
            if let Err(error) = write(BufWriter::new(file), &received) {
                failed(error);
                // The job does not wait for a trace that is over.
                while received.recv().is_ok() {}
            }
        })?;
        Ok(Trace { lines: Some(lines), thread: Some(thread), waits, lost: 0 })
    }

    /// Ends the trace and waits until it is written.
    pub fn end(mut self, t_us: u64, end: &str) {
        self.waits = true;
        self.line(TraceLine::End { t_us, end: end.to_owned() });
    }
}

/// Where the lines of a trace go.
pub trait TraceSink {
    /// Takes a line.
    fn line(&mut self, line: TraceLine);
}

impl TraceSink for Vec<TraceLine> {
    fn line(&mut self, line: TraceLine) {
        self.push(line);
    }
}

impl TraceSink for Trace {
    fn line(&mut self, line: TraceLine) {
        let Some(lines) = &self.lines else { return };
        if self.lost > 0 {
            let lost = TraceLine::Lost { lines: self.lost };
            let told =
                if self.waits { lines.send(lost).is_ok() } else { lines.try_send(lost).is_ok() };
            self.lost = if told { 0 } else { self.lost };
        }
        // A thread that is gone has told why.
        let full = match self.waits {
            true => lines.send(line).is_err(),
            false => matches!(lines.try_send(line), Err(TrySendError::Full(_))),
        };
        self.lost += u64::from(full);
    }
}

/// Also when the job has panicked.
impl Drop for Trace {
    fn drop(&mut self) {
        self.lines = None;
        if let Some(thread) = self.thread.take() {
            // It has told what it had to tell.
            let _ = thread.join();
        }
    }
}

/// Writes lines until there are no more to come.
fn write(mut out: impl Write, lines: &Receiver<TraceLine>) -> io::Result<()> {
    let mut flushed = true;
    loop {
        match lines.recv_timeout(FLUSH) {
            Ok(line) => {
                writeln!(out, "{line}")?;
                flushed = false;
            }
            Err(RecvTimeoutError::Timeout) if flushed => {}
            Err(RecvTimeoutError::Timeout) => {
                out.flush()?;
                flushed = true;
            }
            Err(RecvTimeoutError::Disconnected) => return out.flush(),
        }
    }
}

/// A link that is traced.
#[derive(Debug)]
pub struct Traced<'a, L, S> {
    link: &'a mut L,
    trace: Option<S>,
}

impl<'a, L: Link, S: TraceSink> Traced<'a, L, S> {
    /// Traces a link, or only passes everything on.
    pub fn new(link: &'a mut L, trace: Option<S>) -> Self {
        Traced { link, trace }
    }

    /// Gives the trace back, if there is one.
    pub fn into_trace(self) -> Option<S> {
        self.trace
    }

    fn received(&mut self, bytes: &[u8]) {
        if let Some(trace) = self.trace.as_mut().filter(|_| !bytes.is_empty()) {
            let t_us = self.link.now_us();
            trace.line(TraceLine::Received { t_us, bytes: bytes.to_vec() });
        }
    }
}

impl<L: Link, S: TraceSink> Link for Traced<'_, L, S> {
    fn now_us(&mut self) -> u64 {
        self.link.now_us()
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        let sent = self.link.send(bytes);
        if let Some(trace) = &mut self.trace {
            let t_us = self.link.now_us();
            trace.line(TraceLine::Sent { t_us, bytes: bytes.to_vec(), failed: sent.is_err() });
        }
        sent
    }

    fn receive(
        &mut self,
        bytes: &mut Vec<u8>,
        until_us: u64,
        answer_from_us: Option<u64>,
    ) -> Result<(), LinkError> {
        let before = bytes.len();
        let received = self.link.receive(bytes, until_us, answer_from_us);
        self.received(bytes.get(before..).unwrap_or_default());
        received
    }

    fn idle(&mut self, bytes: &mut Vec<u8>, wait: Duration) -> Result<(), LinkError> {
        let before = bytes.len();
        let idled = self.link.idle(bytes, wait);
        self.received(bytes.get(before..).unwrap_or_default());
        idled
    }

    fn urgent(&mut self, urgent: bool) {
        self.link.urgent(urgent);
    }

    fn drain(&mut self) {
        self.link.drain();
    }
}
