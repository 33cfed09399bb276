//! Subprograms in files of their own: found below the folders given, read whole, hashed; nothing
//! outside of these folders is ever read, whatever names or links say.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use crate::base::Source;
use crate::gcode::Label;

/// Largest file of a subprogram: it is kept in memory.
const FILE_BYTES_MAX: u64 = 16 * 1024 * 1024;

/// A file that a program made the interpreter read.
#[derive(Debug)]
pub(super) struct Input {
    pub source: Source,
    pub sha256: [u8; 32],
    path: PathBuf,
}

/// What there is of a file.
pub(super) enum Opened {
    /// It has been read: its place among the inputs.
    Input(usize),
    /// It lies, or its name leads, outside of the folders.
    Outside(String),
    Nothing,
}

/// The files read so far.
#[derive(Debug)]
pub(super) struct Inputs {
    folders: Vec<PathBuf>,
    pub list: Vec<Input>,
}

impl Inputs {
    pub fn new(folders: &[PathBuf]) -> Inputs {
        Inputs { folders: folders.to_vec(), list: Vec::new() }
    }

    /// What was looked for where, for a subprogram that is not found; none without folders.
    pub fn looked_for(&self, label: &Label) -> Option<String> {
        let name = names(label).into_iter().next()?;
        let folders: Vec<String> =
            self.folders.iter().map(|folder| folder.display().to_string()).collect();
        let is_any = !folders.is_empty();
        is_any.then(|| format!("no file {name} or the like lies in {}", folders.join(", ")))
    }

    /// Opens the file of a subprogram.
    ///
    /// # Errors
    /// When it is there and cannot be read, or is too large.
    pub fn open(&mut self, label: &Label) -> io::Result<Opened> {
        for name in names(label) {
            let leads_out = name.starts_with('/') || name.split('/').any(|part| part == "..");
            if leads_out {
                return Ok(Opened::Outside(name));
            }
            for folder in &self.folders {
                let Ok(folder) = folder.canonicalize() else { continue };
                let Ok(path) = folder.join(&name).canonicalize() else { continue };
                if !path.starts_with(&folder) {
                    return Ok(Opened::Outside(name));
                }
                if !path.is_file() {
                    continue;
                }
                if let Some(at) = self.list.iter().position(|input| input.path == path) {
                    return Ok(Opened::Input(at));
                }
                let bytes = read(&path)
                    .map_err(|error| io::Error::new(error.kind(), format!("{name}: {error}")))?;
                let sha256 = Sha256::digest(&bytes).into();
                self.list.push(Input { source: Source::memory(&name, bytes), sha256, path });
                return Ok(Opened::Input(self.list.len() - 1));
            }
        }
        Ok(Opened::Nothing)
    }
}

fn read(path: &Path) -> io::Result<Vec<u8>> {
    let file = File::open(path)?;
    if fs::metadata(path)?.len() > FILE_BYTES_MAX {
        let message = format!("a subprogram's file has at most {FILE_BYTES_MAX} bytes");
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, message));
    }
    let mut bytes = Vec::new();
    file.take(FILE_BYTES_MAX).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// What the file of a subprogram may be called.
fn names(label: &Label) -> Vec<String> {
    match label {
        Label::Name(name) => [".ngc", ".nc", ""].map(|ending| format!("{name}{ending}")).to_vec(),
        Label::Number(number) => {
            let stems = [
                format!("{number}"),
                format!("o{number}"),
                format!("O{number}"),
                format!("O{number:04}"),
            ];
            stems
                .iter()
                .flat_map(|stem| [".ngc", ".nc"].map(|end| format!("{stem}{end}")))
                .collect()
        }
    }
}
