//! Where a text comes from: a file, standard input spooled to one, or memory; readable twice.

use std::fs::File;
use std::io::{self, Read};
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::sync::Arc;

/// A text that can be read from any offset, as often as needed, in constant memory.
#[derive(Clone, Debug)]
pub struct Source {
    name: String,
    bytes: Bytes,
    watch: Option<Arc<dyn Watch>>,
}

/// Looks on while a source is read.
pub trait Watch: std::fmt::Debug + Send + Sync {
    /// A reader has come to this byte.
    ///
    /// # Errors
    /// Break off the reading.
    fn at(&self, offset: u64) -> io::Result<()>;

    /// What has been read keeps its reader busy.
    ///
    /// # Errors
    /// Break that off.
    fn go_on(&self) -> io::Result<()>;
}

/// A file's name as it is shown: what would steer a terminal, or begin a line of its own, is replaced.
pub fn shown(path: &Path) -> String {
    path.display().to_string().chars().map(visible).collect()
}

/// A control character as a sign that does nothing; any other as it is.
pub fn visible(character: char) -> char {
    if character.is_control() { '\u{FFFD}' } else { character }
}

/// Bytes that have to be UTF-8, as text.
///
/// # Errors
/// Names the line and the byte at which they are not.
pub fn as_text(bytes: Vec<u8>) -> io::Result<String> {
    String::from_utf8(bytes).map_err(|error| {
        let (bytes, at) = (error.as_bytes(), error.utf8_error().valid_up_to());
        let line = 1 + bytes[..at].iter().filter(|byte| **byte == b'\n').count();
        let byte = bytes.get(at).copied().unwrap_or_default();
        let reason =
            format!("line {line} holds the byte 0x{byte:02X}, which is no UTF-8: save it as UTF-8");
        io::Error::new(io::ErrorKind::InvalidData, reason)
    })
}

#[derive(Clone, Debug)]
enum Bytes {
    File(Arc<File>),
    Memory(Arc<[u8]>),
}

impl Source {
    /// Opens a file.
    ///
    /// # Errors
    /// When it cannot be opened, or is a folder.
    pub fn open(path: &Path) -> io::Result<Source> {
        let file = File::open(path)?;
        let kind = file.metadata()?;
        if kind.is_dir() {
            return Err(io::Error::new(io::ErrorKind::IsADirectory, "is a folder"));
        }
        let name = shown(path);
        // A pipe or a device is read once only: keep what comes.
        if kind.is_file() {
            Ok(Source { name, bytes: Bytes::File(Arc::new(file)), watch: None })
        } else {
            Source::spool(&name, file)
        }
    }

    /// Keeps all that a stream brings in an unlinked temporary file.
    ///
    /// # Errors
    /// When the stream cannot be read or the temporary file cannot be written.
    pub fn spool(name: &str, mut stream: impl Read) -> io::Result<Source> {
        let mut file = tempfile::tempfile()?;
        io::copy(&mut stream, &mut file)?;
        let bytes = Bytes::File(Arc::new(file));
        Ok(Source { name: name.to_owned(), bytes, watch: None })
    }

    /// A text in memory.
    pub fn memory(name: &str, bytes: impl Into<Arc<[u8]>>) -> Source {
        Source { name: name.to_owned(), bytes: Bytes::Memory(bytes.into()), watch: None }
    }

    /// The name to show: as the user gave it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The name without its folders.
    pub fn file_name(&self) -> &str {
        self.name.rsplit('/').next().unwrap_or(&self.name)
    }

    /// Bytes of the text.
    ///
    /// # Errors
    /// When the file cannot be asked.
    pub fn length(&self) -> io::Result<u64> {
        match &self.bytes {
            Bytes::File(file) => Ok(file.metadata()?.len()),
            Bytes::Memory(bytes) => Ok(bytes.len() as u64),
        }
    }

    /// The same text, with somebody who looks on whenever it is read.
    #[must_use]
    pub fn watched_by(self, watch: Arc<dyn Watch>) -> Source {
        Source { watch: Some(watch), ..self }
    }

    /// Asks whoever looks on whether to go on with what has been read.
    ///
    /// # Errors
    /// It is to be broken off.
    pub fn go_on(&self) -> io::Result<()> {
        self.watch.as_ref().map_or(Ok(()), |watch| watch.go_on())
    }

    /// Reads from an offset on. Readers of one source do not disturb each other.
    pub fn reader(&self, offset: u64) -> SourceReader {
        SourceReader { bytes: self.bytes.clone(), watch: self.watch.clone(), offset }
    }
}

/// See [`Source::reader`].
#[derive(Debug)]
pub struct SourceReader {
    bytes: Bytes,
    watch: Option<Arc<dyn Watch>>,
    offset: u64,
}

impl Read for SourceReader {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let count = match &self.bytes {
            Bytes::File(file) => file.read_at(out, self.offset)?,
            Bytes::Memory(bytes) => {
                let start = usize::try_from(self.offset).unwrap_or(usize::MAX).min(bytes.len());
                (&bytes[start..]).read(out)?
            }
        };
        self.offset += count as u64;
        if let Some(watch) = &self.watch {
            watch.at(self.offset)?;
        }
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_that_are_no_text_are_named() {
        assert_eq!(as_text(b"a\n\xc3\xa4".to_vec()).unwrap(), "a\n\u{e4}");
        let error = as_text(b"a\n\xe4b".to_vec()).unwrap_err().to_string();
        assert!(error.starts_with("line 2 holds the byte 0xE4"), "{error}");
    }
}
