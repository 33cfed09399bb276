//! Jobs → their journal: what was sent, what was acknowledged, how it ended, line by line (JSON
//! Lines), so that it is known after any end, a killed host's too.
//!
//! Rules: a line is written whole or, by a host that dies, cut short at the end of the file; a tick is
//! written before the next one is sent; seams, holds and ends are on the disk before the job goes on.
//! One program at a time writes a journal. When a line cannot be written, the job is held and ends. A
//! journal that has grown long begins anew with what it has said.

mod anew;
mod history;
mod record;

use std::fs::{File, Metadata, OpenOptions};
use std::io::{self, Read, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use rustix::fs::FlockOperation;

use crate::base::{Axis, Event};
use crate::wire::{Ending, Master, MasterEvent};
use crate::wire_io::drive::Operator;
use crate::wire_io::hands::Hands;

use anew::LENGTH_MAX;
pub use history::{History, NoRecord, PastJob, Place};
pub use record::{
    AxisRecord, EndRecord, HomeRecord, JobRecord, Named, Record, Resumed, Steps, hex, now, steps_of,
};

/// A journal that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    /// The file itself.
    #[error("the journal {path} cannot be {what}: {reason}")]
    Io {
        /// The file.
        path: PathBuf,
        /// `read`, `written`, …
        what: &'static str,
        /// What the system says.
        reason: io::Error,
    },
    /// Another program writes it.
    #[error("the journal {0} is in use by another program: a job runs on this port")]
    Busy(PathBuf),
    /// Something else stands in it.
    #[error("{path} cannot be used as a journal: {reason}; move it away, then home the machine")]
    NoJournal {
        /// The file.
        path: PathBuf,
        /// Which line.
        reason: NoRecord,
    },
}

/// A journal, open for writing.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    /// None until the first line is written.
    file: Option<File>,
    /// Bytes of whole lines.
    whole: u64,
    history: History,
    /// From this length on it begins anew.
    length_max: u64,
    /// Why it could not, if so.
    too_long: Option<String>,
    /// Why a line could not be written.
    failed: Option<String>,
}

impl Journal {
    /// Opens a journal and reads what it says; a file that is not there is made with its first line.
    ///
    /// # Errors
    /// When another program has it open, or it cannot be read, or is none.
    pub fn open(path: &Path) -> Result<Journal, JournalError> {
        let mut journal = Journal {
            path: path.to_owned(),
            file: None,
            whole: 0,
            history: History::default(),
            length_max: LENGTH_MAX,
            too_long: None,
            failed: None,
        };
        match OpenOptions::new().read(true).append(true).open(path) {
            Ok(file) => {
                (journal.history, journal.whole) = claim(path, &file)?;
                journal.file = Some(file);
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(reason) => {
                return Err(JournalError::Io { path: path.to_owned(), what: "opened", reason });
            }
        }
        Ok(journal)
    }

    /// Reads what a journal says.
    ///
    /// # Errors
    /// When it cannot be read, or is none.
    pub fn read(path: &Path) -> Result<History, JournalError> {
        let path = path.to_owned();
        let bytes = match std::fs::read(&path) {
            Ok(bytes) => bytes,
            Err(reason) => return Err(JournalError::Io { path, what: "read", reason }),
        };
        let read = History::read(&bytes);
        read.map(|(history, _)| history).map_err(|reason| JournalError::NoJournal { path, reason })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What it says.
    pub fn history(&self) -> &History {
        &self.history
    }

    /// Why a line could not be written, if so: nothing has been since.
    pub fn failed(&self) -> Option<&str> {
        self.failed.as_deref()
    }

    /// Writes a line and waits until it is on the disk.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn append(&mut self, record: Record) -> Result<(), JournalError> {
        self.begin_anew();
        self.line(&record).and_then(|()| self.sync()).map_err(|reason| JournalError::Io {
            path: self.path.clone(),
            what: "written",
            reason,
        })?;
        self.history.record(record);
        Ok(())
    }

    /// Writes how a job ended, even after lines that could not be written. If it cannot be written
    /// either, [`Journal::failed`] says so, and the journal shows a job without an end.
    pub fn end(&mut self, ending: &Ending) {
        self.note(Record::End(Box::new(EndRecord::new(ending))), true);
    }

    /// Writes a line of a job under way, and keeps the reason if it cannot.
    fn note(&mut self, record: Record, on_disk: bool) {
        let written = self.line(&record);
        let written = if on_disk { written.and_then(|()| self.sync()) } else { written };
        self.keep(written);
        self.history.record(record);
    }

    fn note_tick(&mut self, ticks: u64, line: u32) {
        let written = self.write(record::tick_line(ticks, line).as_bytes());
        self.keep(written);
        self.history.tick(ticks, line);
    }

    fn keep(&mut self, written: io::Result<()>) {
        if let Err(error) = written {
            let path = self.path.display();
            let reason = format!("the journal {path} cannot be written: {error}");
            self.failed.get_or_insert(reason);
        }
    }

    fn line(&mut self, record: &Record) -> io::Result<()> {
        let mut bytes = serde_json::to_vec(record)?;
        bytes.push(b'\n');
        self.write(&bytes)
    }

    /// Writes whole lines; what is left of one that was not finished is taken away first.
    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        if self.file.is_none() {
            self.create()?;
        }
        let Some(file) = &mut self.file else { return Ok(()) };
        if self.failed.is_some() {
            file.set_len(self.whole)?;
        }
        file.write_all(bytes)?;
        self.whole += bytes.len() as u64;
        Ok(())
    }

    fn create(&mut self) -> io::Result<()> {
        if let Some(folder) = self.path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
            std::fs::create_dir_all(folder)?;
        }
        let file = OpenOptions::new().read(true).append(true).create(true).open(&self.path)?;
        let claimed = claim(&self.path, &file).map_err(|error| io::Error::other(error.to_string()));
        (self.history, self.whole) = claimed?;
        self.file = Some(file);
        Ok(())
    }

    fn sync(&mut self) -> io::Result<()> {
        match &self.file {
            // A pipe or a device keeps nothing.
            Some(file) if file.metadata()?.is_file() => file.sync_data(),
            _ => Ok(()),
        }
    }
}

/// Makes sure that nobody else writes a journal, reads it, and takes away a last line that is not
/// whole.
fn claim(path: &Path, mut file: &File) -> Result<(History, u64), JournalError> {
    let path = path.to_owned();
    if rustix::fs::flock(file, FlockOperation::NonBlockingLockExclusive).is_err() {
        return Err(JournalError::Busy(path));
    }
    // Whoever had it open has begun it anew: the lock is on the old one.
    if !is_named(&path, file) {
        return Err(JournalError::Busy(path));
    }
    let mut bytes = Vec::new();
    let is_file = file.metadata().is_ok_and(|kind| kind.is_file());
    let read = if is_file { file.read_to_end(&mut bytes) } else { Ok(0) };
    if let Err(reason) = read {
        return Err(JournalError::Io { path, what: "read", reason });
    }
    let (history, whole) = match History::read(&bytes) {
        Ok(read) => read,
        Err(reason) => return Err(JournalError::NoJournal { path, reason }),
    };
    if whole < bytes.len()
        && let Err(reason) = file.set_len(whole as u64)
    {
        return Err(JournalError::Io { path, what: "written", reason });
    }
    Ok((history, whole as u64))
}

/// Whether a file has this name.
fn is_named(path: &Path, file: &File) -> bool {
    let id = |metadata: Metadata| (metadata.dev(), metadata.ino());
    let (named, open) = (std::fs::metadata(path).map(id), file.metadata().map(id));
    matches!((named, open), (Ok(named), Ok(open)) if named == open)
}

/// An operator whose job is written down.
pub struct Journaled<'a, O> {
    operator: &'a mut O,
    journal: &'a mut Journal,
    /// Axes that are told of at seams.
    axes: Vec<Axis>,
    ticks: u64,
}

impl<'a, O: Operator> Journaled<'a, O> {
    /// Writes down what an operator is told, in a journal whose job has begun.
    pub fn new(operator: &'a mut O, journal: &'a mut Journal) -> Self {
        let axes = journal.history.axes().to_vec();
        Journaled { operator, journal, axes, ticks: 0 }
    }
}

impl<O: Operator> Operator for Journaled<'_, O> {
    fn event(&mut self, event: &MasterEvent) {
        let record = match event {
            MasterEvent::Event(event) | MasterEvent::Pause(event) | MasterEvent::Dwell(event) => {
                Some(Record::event(event))
            }
            MasterEvent::Filling { buffer, unit, master } => {
                Some(Record::filling(*buffer, *unit, *master))
            }
            MasterEvent::Started { buffer } => Some(Record::Started { buffer: *buffer }),
            MasterEvent::Seam { buffer, steps, ticks, position } => Some(Record::Seam {
                buffer: *buffer,
                steps: *steps,
                ticks: *ticks,
                position: steps_of(self.axes.iter().copied(), position),
            }),
            MasterEvent::Held { line, ticks, executing } => {
                Some(Record::Held { ticks: *ticks, line: *line, executing: *executing })
            }
            MasterEvent::Homing { .. }
            | MasterEvent::Homed(_)
            | MasterEvent::Jogging { .. }
            | MasterEvent::Jogged { .. }
            | MasterEvent::Ended(_) => None,
        };
        if let Some(record) = record {
            let is_seam = matches!(record, Record::Seam { .. });
            let waits = matches!(event, MasterEvent::Held { .. } | MasterEvent::Pause(_));
            self.journal.note(record, is_seam || waits);
            if is_seam {
                self.journal.begin_anew();
            }
        }
        self.operator.event(event);
    }

    fn hands(&mut self) -> Option<&mut dyn Hands> {
        self.operator.hands()
    }

    fn pause(&mut self, event: &Event) -> bool {
        self.operator.pause(event)
    }

    fn held(&mut self, master: &Master) -> bool {
        let goes_on = self.journal.failed().is_none() && self.operator.held(master);
        if goes_on {
            self.journal.note(Record::Resumed, false);
        }
        goes_on
    }

    fn progress(&mut self, master: &Master) {
        let progress = master.progress();
        if progress.ticks != self.ticks {
            self.ticks = progress.ticks;
            self.journal.note_tick(progress.ticks, progress.line);
        }
        self.operator.progress(master);
    }

    /// A journal that cannot be written is a wish to stop.
    fn interrupts(&mut self) -> usize {
        self.operator.interrupts() + usize::from(self.journal.failed().is_some())
    }
}
