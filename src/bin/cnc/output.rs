//! Files that commands write: each appears whole or not at all.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use cnc::base::source::shown;
use tempfile::{NamedTempFile, TempPath};

use crate::exit::Failure;
use crate::input;
use crate::interrupt::Interrupts;

/// Where a file's content goes while it is made.
pub type Out = BufWriter<Part>;

/// Most links that a name is followed through.
const LINKS_MAX: usize = 40;

/// A file that is written through a temporary one beside it, which takes its place once all is
/// written. What is there already and is no file (a device, a pipe) is written to as it is; a
/// symbolic link stays, and what it leads to is written.
pub struct WholeFile {
    part: Part,
    /// The temporary file, and where it belongs.
    place: Option<(TempPath, PathBuf)>,
}

/// What has been written of a file so far. Its errors name the file.
pub struct Part {
    file: File,
    path: PathBuf,
    /// The operator's stops, and how many do not mean this file: the temporary file would be left
    /// behind if they ended the process.
    interrupts: Option<(Interrupts, usize)>,
}

impl WholeFile {
    /// Makes sure that a file can be written.
    pub fn create(path: &Path) -> anyhow::Result<WholeFile> {
        let context = || format!("{} cannot be written", path.display());
        if path == Path::new("-") {
            return Err(anyhow!("- is standard output, which does not take this: name a file"));
        }
        input::keep(path).with_context(context)?;
        if path.exists() && !path.is_file() {
            let file = File::create(path).with_context(context)?;
            let part = Part { file, path: path.to_owned(), interrupts: None };
            return Ok(WholeFile { part, place: None });
        }
        let target = followed(path);
        let folder = folder_of(&target).with_context(context)?;
        let interrupts = Interrupts::watch()?;
        let (file, temporary) = beside(folder).with_context(context)?.into_parts();
        let part = Part { file, path: path.to_owned(), interrupts: Some((interrupts, 0)) };
        Ok(WholeFile { part, place: Some((temporary, target)) })
    }

    /// Writes the file. When the operator stops that, what was there before stays.
    pub fn write(
        mut self,
        write: impl FnOnce(&mut Out) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        if let Some((interrupts, before)) = &mut self.part.interrupts {
            *before = interrupts.count();
        }
        let path = self.part.path.clone();
        let mut out = BufWriter::new(self.part);
        let written = write(&mut out).and_then(|()| Ok(out.flush()?));
        if out.get_ref().is_interrupted() {
            let error = anyhow!("interrupted: {} is not written", path.display());
            return Err(Failure { code: 130, error });
        }
        written?;
        if let Some((temporary, target)) = self.place {
            let context = || format!("{} cannot be written", path.display());
            temporary.persist(target).map_err(|failed| failed.error).with_context(context)?;
        }
        Ok(())
    }
}

impl Part {
    fn is_interrupted(&self) -> bool {
        self.interrupts.as_ref().is_some_and(|(interrupts, before)| interrupts.count() > *before)
    }
}

impl Write for Part {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.is_interrupted() {
            return Err(io::Error::other("interrupted"));
        }
        let named = |error: io::Error| {
            io::Error::new(error.kind(), format!("{}: {error}", self.path.display()))
        };
        self.file.write(bytes).map_err(named)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// A temporary file in a folder. Its name, which nobody has given, is in no error.
fn beside(folder: &Path) -> io::Result<NamedTempFile> {
    let create = |path: &Path| {
        OpenOptions::new().read(true).write(true).create_new(true).mode(0o666).open(path)
    };
    tempfile::Builder::new().make_in(folder, create)
}

/// Makes sure that files can be written before there is work to lose, and changes none. `None` and `-` are
/// no files.
pub fn check_writable(outputs: &[Option<&Path>]) -> anyhow::Result<()> {
    let files = outputs.iter().flatten().filter(|file| **file != Path::new("-"));
    files.into_iter().try_for_each(|file| {
        let writable = match file.metadata() {
            Ok(data) if data.is_dir() => Err(anyhow!("it is a folder")),
            Ok(data) if data.is_file() => {
                Ok(OpenOptions::new().write(true).open(file).map(drop)?)
            }
            Ok(_) => Ok(()),
            Err(_) => folder_of(&followed(file)).and_then(|folder| Ok(beside(folder).map(drop)?)),
        };
        writable.with_context(|| format!("{} cannot be written", shown(file)))
    })
}

/// The folder that a file is to lie in, which has to be there.
pub fn folder_of(file: &Path) -> anyhow::Result<&Path> {
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new("."));
    match folder.is_dir() {
        true => Ok(folder),
        false => Err(anyhow!("there is no folder {}", folder.display())),
    }
}

/// Refuses two outputs of one name before any is made; `None` and `-` are no files.
pub fn check_distinct(outputs: &[Option<&Path>]) -> anyhow::Result<()> {
    let files: Vec<&Path> = outputs.iter().flatten().copied().collect();
    let files: Vec<&Path> = files.into_iter().filter(|file| *file != Path::new("-")).collect();
    let twice = (1..files.len()).find(|at| {
        let is_same = |other: &&Path| input::place(other) == input::place(files[*at]);
        files[..*at].iter().any(is_same)
    });
    match twice {
        Some(at) => {
            let name = files[at].display();
            Err(anyhow!("{name} is named for two outputs: name another file for one of them"))
        }
        None => Ok(()),
    }
}

/// Writes a file whole.
pub fn whole_file(
    path: &Path,
    write: impl FnOnce(&mut Out) -> Result<(), Failure>,
) -> Result<(), Failure> {
    WholeFile::create(path)?.write(write)
}

/// What a symbolic link leads to in the end, whether it is there or not; any other name as it is.
fn followed(path: &Path) -> PathBuf {
    let mut path = path.to_owned();
    for _ in 0..LINKS_MAX {
        let Ok(next) = fs::read_link(&path) else { break };
        path = path.parent().unwrap_or(Path::new("")).join(next);
    }
    path
}
