//! Text → lines and fields of a dump: the hot end of reading. Lines are found in one buffer that
//! is filled again and again, hashed by the bufferful and never copied; memory is that buffer.
//!
//! What a field means is the reader's business.

use std::io::{self, Read};
use std::ops::Range;

use memchr::memchr;
use sha2::{Digest, Sha256};

use crate::base::source::SourceReader;

/// Longest line that is read: no row of nine axes and its events comes near.
const LINE_BYTES_MAX: usize = 1 << 16;

/// Bytes that are read and hashed at once; room for the longest line and as much again.
const BUFFER_BYTES: usize = 2 * LINE_BYTES_MAX;

/// The lines of a text, one after the other.
#[derive(Debug)]
pub struct Lines {
    input: SourceReader,
    text: Box<[u8]>,
    /// What has been read of the text and not been given lies in this part of the buffer.
    left: Range<usize>,
    ended: bool,
    /// Lines given so far.
    pub count: u64,
    /// Of all bytes of the lines given since [`Lines::hash_from`].
    hash: Option<Sha256>,
    /// Bytes of the buffer from here on are not hashed yet.
    unhashed: usize,
}

impl Lines {
    /// From where a reader stands.
    pub fn new(input: SourceReader) -> Lines {
        let text = vec![0; BUFFER_BYTES].into();
        Lines { input, text, left: 0..0, ended: false, count: 0, hash: None, unhashed: 0 }
    }

    /// Where in [`Lines::text`] the next line lies, with its line end; none at the end.
    ///
    /// # Errors
    /// When the text cannot be read or the line is too long.
    pub fn next(&mut self) -> io::Result<Option<Range<usize>>> {
        let mut searched = self.left.start;
        loop {
            if let Some(at) = memchr(b'\n', &self.text[searched..self.left.end]) {
                return Ok(Some(self.give(searched + at + 1)));
            }
            if self.ended {
                let is_over = self.left.is_empty();
                return Ok((!is_over).then(|| self.give(self.left.end)));
            }
            if self.left.len() >= LINE_BYTES_MAX {
                let reason = format!("a line is longer than {LINE_BYTES_MAX} bytes");
                return Err(io::Error::new(io::ErrorKind::InvalidData, reason));
            }
            let already = self.left.len();
            self.fill()?;
            searched = self.left.start + already;
        }
    }

    /// A line that was given last.
    pub fn text(&self, line: Range<usize>) -> &[u8] {
        &self.text[line]
    }

    /// Whether nothing follows the line that was given last.
    ///
    /// # Errors
    /// When the text cannot be read.
    pub fn is_over(&mut self) -> io::Result<bool> {
        if self.left.is_empty() && !self.ended {
            self.fill()?;
        }
        Ok(self.left.is_empty())
    }

    /// Hashes from the line that was given last on, itself included.
    pub fn hash_from(&mut self, line: &Range<usize>) {
        self.hash = Some(Sha256::new());
        self.unhashed = line.start;
    }

    /// The hash of the lines before the one that was given last; zeros if none was asked for.
    pub fn hash_before(&mut self, line: &Range<usize>) -> [u8; 32] {
        let Some(mut hash) = self.hash.take() else { return [0; 32] };
        hash.update(&self.text[self.unhashed..line.start]);
        hash.finalize().into()
    }

    fn give(&mut self, end: usize) -> Range<usize> {
        let line = self.left.start..end;
        self.left.start = end;
        self.count += 1;
        line
    }

    /// Reads more, behind what is left, which moves to the front.
    fn fill(&mut self) -> io::Result<()> {
        if let Some(hash) = &mut self.hash {
            hash.update(&self.text[self.unhashed..self.left.start]);
        }
        self.unhashed = 0;
        self.text.copy_within(self.left.clone(), 0);
        self.left = 0..self.left.len();
        loop {
            match self.input.read(&mut self.text[self.left.end..]) {
                Ok(read) => {
                    self.left.end += read;
                    self.ended = read == 0;
                    return Ok(());
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
    }
}

/// Finds the fields of a line: between commas, without the line end, and without the quotes around
/// a field if these mean something. A doubled quote within a field stays as it is.
///
/// # Errors
/// When a quote has no end in the line, or other text follows that.
pub fn split(line: &[u8], quoting: bool, fields: &mut Vec<Range<usize>>) -> Result<(), String> {
    fields.clear();
    let end = without_line_end(line).len();
    let mut start = 0;
    loop {
        let is_quoted = quoting && line[start..end].first() == Some(&b'"');
        let field = if is_quoted {
            let close = closing_quote(&line[..end], start + 1);
            let close = close.ok_or("a quote has no end in its line")?;
            if !matches!(line[..end].get(close + 1), None | Some(b',')) {
                return Err("text follows the end of a quote".to_owned());
            }
            start + 1..close
        } else {
            start..memchr(b',', &line[start..end]).map_or(end, |at| start + at)
        };
        let next = field.end + usize::from(is_quoted);
        fields.push(field);
        if next == end {
            return Ok(());
        }
        start = next + 1;
    }
}

/// A line without LF, CR LF or CR at its end.
pub fn without_line_end(line: &[u8]) -> &[u8] {
    let line = line.strip_suffix(b"\n").unwrap_or(line);
    line.strip_suffix(b"\r").unwrap_or(line)
}

/// The quote that is not one of two.
fn closing_quote(line: &[u8], mut from: usize) -> Option<usize> {
    loop {
        let at = from + memchr(b'"', &line[from..])?;
        if line.get(at + 1) != Some(&b'"') {
            return Some(at);
        }
        from = at + 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Source;
    use proptest::prelude::*;

    fn fields(line: &str, quoting: bool) -> Result<Vec<&str>, String> {
        let mut found = Vec::new();
        split(line.as_bytes(), quoting, &mut found)?;
        Ok(found.into_iter().map(|field| &line[field]).collect())
    }

    #[test]
    fn quotes_end_in_their_line() {
        assert_eq!(fields("\"a,b\",\"\",c\"d\r\n", true), Ok(vec!["a,b", "", "c\"d"]));
        assert_eq!(fields("\"a\"\"b\"\n", true), Ok(vec!["a\"\"b"]));
        assert_eq!(fields("\"a,b\n", false), Ok(vec!["\"a", "b"]));
        assert!(fields("\"a,b\n", true).is_err());
        assert!(fields("\"a\"b\n", true).is_err());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// Wherever a line is understood, its fields are those that the csv crate finds.
        #[test]
        fn fields_are_those_of_the_csv_crate(
            line in "[a-z0-9\",; -]{0,30}", end in "(\n|\r\n)?", quoting: bool,
        ) {
            prop_assume!(!line.is_empty());
            let line = line + &end;
            if let Ok(found) = fields(&line, quoting) {
                let mut reader = csv::ReaderBuilder::new()
                    .has_headers(false)
                    .quoting(quoting)
                    .from_reader(line.as_bytes());
                let record = reader.records().next().expect("a record").expect("a sound one");
                let found: Vec<String> = found.iter().map(|f| f.replace("\"\"", "\"")).collect();
                let want: Vec<String> = record.iter().map(|f| f.replace("\"\"", "\"")).collect();
                prop_assert_eq!(found, want);
            }
        }

        /// Lines and their hash are those of the text, wherever the buffer ends.
        #[test]
        fn lines_are_those_of_the_text(
            lengths in prop::collection::vec(0usize..9000, 0..20), is_cut: bool,
        ) {
            let mut text = String::new();
            for (number, length) in lengths.iter().enumerate() {
                text += &number.to_string().repeat(*length);
                text.push('\n');
            }
            text += if is_cut { "end" } else { "end\n" };
            let mut lines = Lines::new(Source::memory("text", text.as_bytes()).reader(0));
            let (mut given, mut hash) = (Vec::new(), [0; 32]);
            while let Some(line) = lines.next().unwrap() {
                if given.is_empty() {
                    lines.hash_from(&line);
                }
                given.extend_from_slice(lines.text(line.clone()));
                if given.len() == text.len() {
                    hash = lines.hash_before(&line);
                }
            }
            prop_assert!(given == text.as_bytes() && lines.is_over().unwrap());
            prop_assert_eq!(lines.count as usize, lengths.len() + 1);
            let rows = text.trim_end_matches("end\n").trim_end_matches("end");
            prop_assert_eq!(hash, <[u8; 32]>::from(Sha256::digest(rows)));
        }
    }
}
