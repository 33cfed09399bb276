//! A journal that has grown long → one that begins with what it has said; the long one lies beside it.
//!
//! Rules: under the journal's name there is a whole journal at any time, locked by its writer, and on
//! the disk before it has the name. A journal that cannot begin anew grows on: no job ends for that.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use rustix::fs::FlockOperation;

use super::{Journal, Record};

/// How long a journal may be before it begins anew: an hour and a half of motion.
pub(super) const LENGTH_MAX: u64 = 16 << 20;

impl Journal {
    /// A journal that begins anew once it has so many bytes, and not only when it has grown by some hours.
    pub fn with_length_max(self, length_max: u64) -> Journal {
        Journal { length_max, ..self }
    }

    /// Why a journal that is too long could not begin anew, if so.
    pub fn too_long(&self) -> Option<&str> {
        self.too_long.as_deref()
    }

    /// Begins anew if the journal is long: its file is then the one with `.old` behind its name, in place of
    /// the one before. To be called where no node waits for its next byte.
    pub(super) fn begin_anew(&mut self) {
        if self.whole < self.length_max || self.failed.is_some() {
            return;
        }
        match self.next_file() {
            Ok(Some((file, whole))) => (self.file, self.whole) = (Some(file), whole),
            Ok(None) => {}
            Err(error) => {
                let (path, long) = (self.path.display(), self.whole >> 20);
                let told = format!("the journal {path}, {long} MiB, cannot begin anew: {error}");
                self.too_long.get_or_insert(told);
            }
        }
    }

    /// The file that takes the place of the one so far, and its length. None where that is no file.
    fn next_file(&self) -> io::Result<Option<(File, u64)>> {
        let is_file = |file: &File| file.metadata().is_ok_and(|kind| kind.is_file());
        let Some(long) = self.file.as_ref().filter(|file| is_file(file)) else { return Ok(None) };
        let path = self.path.canonicalize()?;
        let (new, old) = (beside(&path, ".new"), beside(&path, ".old"));
        remove(&new)?;
        let mut line = serde_json::to_vec(&Record::Carried(Box::new(self.history.clone())))?;
        line.push(b'\n');
        let file = OpenOptions::new().read(true).append(true).create_new(true).open(&new)?;
        if let Err(error) = put_in_place(&file, &line, long, [&new, &path, &old]) {
            // What is left of it says nothing.
            return remove(&new).and(Err(error));
        }
        if let Some(folder) = path.parent() {
            File::open(folder)?.sync_all()?;
        }
        Ok(Some((file, line.len() as u64)))
    }
}

/// Gives a new file its first line and the name of the long one, which keeps another.
fn put_in_place(
    mut file: &File,
    line: &[u8],
    long: &File,
    [new, path, old]: [&Path; 3],
) -> io::Result<()> {
    rustix::fs::flock(file, FlockOperation::NonBlockingLockExclusive)?;
    file.set_permissions(long.metadata()?.permissions())?;
    file.write_all(line)?;
    file.sync_data()?;
    remove(old)?;
    fs::hard_link(path, old)?;
    fs::rename(new, path)
}

fn beside(path: &Path, suffix: &str) -> PathBuf {
    let mut name = OsString::from(path);
    name.push(suffix);
    PathBuf::from(name)
}

/// Makes sure that no file has a name.
fn remove(path: &Path) -> io::Result<()> {
    fs::remove_file(path).or_else(|error| match error.kind() {
        io::ErrorKind::NotFound => Ok(()),
        _ => Err(error),
    })
}
