//! A text that is hashed while it is read, so that it need not be read again for its hash.

use std::io::{self, Read};

use sha2::{Digest, Sha256};

use crate::base::Source;
use crate::base::source::SourceReader;

/// Reads a source from its beginning on.
#[derive(Debug)]
pub(super) struct HashedReader {
    source: Source,
    reader: SourceReader,
    /// Of what has been read.
    hash: Option<Sha256>,
}

impl HashedReader {
    /// Hashes what it reads.
    pub fn new(source: &Source) -> HashedReader {
        HashedReader { hash: Some(Sha256::new()), ..HashedReader::unhashed(source) }
    }

    /// Hashes nothing, unless it is asked for the hash.
    pub fn unhashed(source: &Source) -> HashedReader {
        HashedReader { source: source.clone(), reader: source.reader(0), hash: None }
    }

    /// The SHA-256 of the whole text. What is unread is read now.
    ///
    /// # Errors
    /// When the text cannot be read.
    pub fn sha256(mut self) -> io::Result<[u8; 32]> {
        io::copy(&mut self, &mut io::sink())?;
        match self.hash {
            Some(hash) => Ok(hash.finalize().into()),
            None => HashedReader::new(&self.source).sha256(),
        }
    }
}

impl Read for HashedReader {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let count = self.reader.read(out)?;
        if let Some(hash) = &mut self.hash {
            hash.update(&out[..count]);
        }
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_that_of_the_whole_text_however_much_of_it_was_read() {
        let text = b"G0 X1\nM30\nremarks\n".repeat(10_000);
        let expected: [u8; 32] = Sha256::digest(&text).into();
        let source = Source::memory("text.nc", text.as_slice());
        for bytes in [0, 10, 100_000, 1_000_000] {
            for mut reader in [HashedReader::new(&source), HashedReader::unhashed(&source)] {
                io::copy(&mut reader.by_ref().take(bytes), &mut io::sink()).unwrap();
                assert_eq!(reader.sha256().unwrap(), expected);
            }
        }
    }
}
