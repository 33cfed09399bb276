//! Where a text comes from: a file, standard input spooled to one, or memory; readable twice.

use std::fs::File;
use std::io::{self, Read, Write};
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

/// Most that is kept of a stream, as standard input.
pub const SPOOL_BYTES_MAX: usize = 2 << 30;
/// Most that is kept of a line of it: no line of a program, a dump or a trace comes near.
pub const SPOOL_LINE_BYTES_MAX: usize = 1 << 20;
const SPOOL_CHUNK_BYTES: usize = 64 * 1024;

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

/// Reads a text that is small by its nature, as a profile or a table of tools.
///
/// # Errors
/// When it cannot be read, is larger than `mib_max` MiB, or is no UTF-8.
pub fn small_text(path: &Path, mib_max: u64) -> io::Result<String> {
    let bytes_max = mib_max << 20;
    let mut bytes = Vec::new();
    File::open(path)?.take(bytes_max + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > bytes_max {
        return Err(too_large(format!("is larger than {mib_max} MiB, which no such file is")));
    }
    as_text(bytes)
}

/// An unlinked file in the folder for temporary ones.
///
/// # Errors
/// Names that folder.
pub fn temporary_file() -> io::Result<File> {
    tempfile::tempfile().map_err(|error| {
        let folder = std::env::temp_dir();
        let reason = format!("no temporary file in {} (TMPDIR): {error}", shown(&folder));
        io::Error::new(error.kind(), reason)
    })
}

fn too_large(reason: String) -> io::Error {
    io::Error::new(io::ErrorKind::FileTooLarge, reason)
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

    /// Keeps all that a stream brings in an unlinked temporary file. One that has no end is given up.
    ///
    /// # Errors
    /// When the stream cannot be read or the temporary file cannot be written, when so much comes without the
    /// end of a line that it is no text ([`SPOOL_LINE_BYTES_MAX`]), or more than [`SPOOL_BYTES_MAX`].
    pub fn spool(name: &str, mut stream: impl Read) -> io::Result<Source> {
        let mut file = temporary_file()?;
        let mut buffer = vec![0; SPOOL_CHUNK_BYTES];
        let (mut bytes, mut line_bytes) = (0, 0);
        loop {
            let chunk = match stream.read(&mut buffer) {
                Ok(0) => break,
                Ok(count) => &buffer[..count],
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                Err(error) => return Err(error),
            };
            file.write_all(chunk)?;
            bytes += chunk.len();
            line_bytes = match memchr::memrchr2(b'\n', b'\r', chunk) {
                Some(end) => chunk.len() - end,
                None => line_bytes + chunk.len(),
            };
            if line_bytes > SPOOL_LINE_BYTES_MAX {
                let mib = SPOOL_LINE_BYTES_MAX >> 20;
                return Err(too_large(format!(
                    "{mib} MiB without the end of a line: this is no text"
                )));
            }
            if bytes > SPOOL_BYTES_MAX {
                let gib = SPOOL_BYTES_MAX >> 30;
                let reason = format!("more than {gib} GiB come: what is so long has to be a file");
                return Err(too_large(reason));
            }
        }
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
    fn a_stream_that_is_no_text_is_given_up() {
        let error = Source::spool("zeros", io::repeat(0)).unwrap_err();
        assert_eq!(error.to_string(), "1 MiB without the end of a line: this is no text");
        let lines = io::Cursor::new(vec![b'\n'; 3 << 20]);
        assert_eq!(Source::spool("lines", lines).unwrap().length().unwrap(), 3 << 20);
        let error = small_text(Path::new("/dev/zero"), 1).unwrap_err();
        assert_eq!(error.to_string(), "is larger than 1 MiB, which no such file is");
    }

    #[test]
    fn bytes_that_are_no_text_are_named() {
        assert_eq!(as_text(b"a\n\xc3\xa4".to_vec()).unwrap(), "a\n\u{e4}");
        let error = as_text(b"a\n\xe4b".to_vec()).unwrap_err().to_string();
        assert!(error.starts_with("line 2 holds the byte 0xE4"), "{error}");
    }
}
