//! Text in chunks → physical lines, in constant memory.

use std::io::{self, Read};

/// Longest line that is read.
pub const LINE_BYTES_MAX: usize = 64 * 1024;

/// One chunk of reading; memory is constant at this, and it stays in the processor's cache.
const CHUNK_BYTES: usize = 128 * 1024;

const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// What DOS puts behind a text, once or until its last block is full.
const END_OF_FILE: u8 = 0x1a;

/// One physical line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Line<'a> {
    /// Number of the line, from 1.
    pub number: u32,
    /// Offset in the text at which it begins.
    pub offset: u64,
    /// The line without its end. A line that is too long is cut to [`LINE_BYTES_MAX`].
    pub bytes: &'a [u8],
    /// Whether the line is longer than [`LINE_BYTES_MAX`]; the rest of it is passed over.
    pub too_long: bool,
}

/// What of the line before is still unread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Unread {
    Nothing,
    /// The line ended in CR: a LF that follows belongs to it.
    LineFeed,
    /// The line was too long: all up to its end.
    Rest,
}

/// Splits a text into lines at LF, CR LF or CR. A byte order mark at the beginning of the text
/// belongs to no line, nor do bytes 0x1A (Ctrl-Z) at its end.
#[derive(Debug)]
pub struct Lines<R> {
    reader: R,
    buffer: Box<[u8]>,
    start: usize,
    end: usize,
    at_end: bool,
    unread: Unread,
    number: u32,
    offset: u64,
    /// The line read last: where in the text and in the buffer it begins, and its bytes there.
    line_offset: u64,
    line_start: usize,
    line_bytes: usize,
    too_long: bool,
}

impl<R: Read> Lines<R> {
    /// Reads from `reader`, whose first line begins `offset` bytes into the text and has the
    /// given number.
    pub fn new(reader: R, offset: u64, number: u32) -> Self {
        Lines {
            reader,
            buffer: vec![0; CHUNK_BYTES].into_boxed_slice(),
            start: 0,
            end: 0,
            at_end: false,
            unread: Unread::Nothing,
            number: number.saturating_sub(1),
            offset,
            line_offset: offset,
            line_start: 0,
            line_bytes: 0,
            too_long: false,
        }
    }

    /// The next line; none at the end of the text.
    ///
    /// # Errors
    /// When the text cannot be read.
    pub fn next_line(&mut self) -> io::Result<Option<Line<'_>>> {
        self.begin_line()?;
        self.next_line_behind(0)
    }

    /// What has been read already of what follows: the next line, unless this ends within it.
    #[inline]
    pub(super) fn ahead(&mut self) -> io::Result<&[u8]> {
        if self.offset == 0 || self.unread != Unread::Nothing {
            self.begin_line()?;
        }
        Ok(&self.buffer[self.start..self.end])
    }

    /// As [`Lines::next_line`], where so many bytes of [`Lines::ahead`] are known to hold no end of
    /// a line.
    #[inline]
    pub(super) fn next_line_behind(&mut self, known: usize) -> io::Result<Option<Line<'_>>> {
        let is_end = self.buffer[self.start..self.end].get(known) == Some(&b'\n');
        if is_end && known <= LINE_BYTES_MAX {
            self.take_line(known);
            self.skip(1);
            return Ok(Some(self.line()));
        }
        Ok(if self.find_line(known)? { Some(self.line()) } else { None })
    }

    /// The line read last.
    #[inline]
    fn line(&self) -> Line<'_> {
        Line {
            number: self.number,
            offset: self.line_offset,
            bytes: &self.buffer[self.line_start..self.line_start + self.line_bytes],
            too_long: self.too_long,
        }
    }

    /// Goes on to the next line; false at the end of the text. By itself, so that what is around it
    /// is small enough to become part of the caller.
    #[inline(never)]
    fn find_line(&mut self, known: usize) -> io::Result<bool> {
        let mut searched = known;
        let length = loop {
            let rest = &self.buffer[self.start..self.end];
            match memchr::memchr2(b'\n', b'\r', &rest[searched..]) {
                Some(at) => break searched + at,
                None if rest.len() > LINE_BYTES_MAX => break rest.len(),
                None if self.at_end => {
                    let last = rest.iter().rposition(|byte| *byte != END_OF_FILE);
                    let Some(last) = last else { return Ok(false) };
                    self.end = self.start + last + 1;
                    break last + 1;
                }
                None => searched = rest.len(),
            }
            self.fill()?;
        };
        self.take_line(length.min(LINE_BYTES_MAX));
        if length > LINE_BYTES_MAX {
            self.too_long = true;
            self.unread = Unread::Rest;
        } else {
            self.end_line();
        }
        Ok(true)
    }

    /// Takes so many bytes for the next line.
    #[inline]
    fn take_line(&mut self, length: usize) {
        (self.line_start, self.line_offset) = (self.start, self.offset);
        (self.line_bytes, self.too_long) = (length, false);
        self.skip(length);
        self.number = self.number.saturating_add(1);
    }

    /// Offset in the text up to which lines have been read.
    pub fn offset(&self) -> u64 {
        self.offset
    }

    /// What the lines are read from, which may be ahead of them.
    pub fn into_reader(self) -> R {
        self.reader
    }

    /// Number of the line read last.
    pub fn number(&self) -> u32 {
        self.number
    }

    fn skip(&mut self, count: usize) {
        self.start += count;
        self.offset += count as u64;
    }

    /// Steps over what is of no line: a byte order mark, the rest of the line before.
    fn begin_line(&mut self) -> io::Result<()> {
        if self.offset == 0 {
            self.skip_byte_order_mark()?;
        }
        match self.unread {
            Unread::Nothing => Ok(()),
            Unread::LineFeed => self.skip_line_feed(),
            Unread::Rest => self.skip_rest(),
        }
    }

    /// Steps over the first byte of a line end, if the buffer begins with one.
    fn end_line(&mut self) {
        self.unread = Unread::Nothing;
        if self.start < self.end {
            if self.buffer[self.start] == b'\r' {
                self.unread = Unread::LineFeed;
            }
            self.skip(1);
        }
    }

    fn skip_line_feed(&mut self) -> io::Result<()> {
        if self.start == self.end && !self.at_end {
            self.fill()?;
        }
        if self.start < self.end && self.buffer[self.start] == b'\n' {
            self.skip(1);
        }
        Ok(())
    }

    fn skip_rest(&mut self) -> io::Result<()> {
        loop {
            let rest = &self.buffer[self.start..self.end];
            if let Some(at) = memchr::memchr2(b'\n', b'\r', rest) {
                self.skip(at);
                self.end_line();
                if self.unread == Unread::LineFeed {
                    self.skip_line_feed()?;
                }
                return Ok(());
            }
            self.skip(rest.len());
            if self.at_end {
                return Ok(());
            }
            self.fill()?;
        }
    }

    fn skip_byte_order_mark(&mut self) -> io::Result<()> {
        while self.end < BYTE_ORDER_MARK.len() && !self.at_end {
            self.fill()?;
        }
        if self.buffer[..self.end].starts_with(BYTE_ORDER_MARK) {
            self.skip(BYTE_ORDER_MARK.len());
        }
        Ok(())
    }

    /// Moves what is unread to the front of the buffer and reads more behind it.
    fn fill(&mut self) -> io::Result<()> {
        self.buffer.copy_within(self.start..self.end, 0);
        self.end -= self.start;
        self.start = 0;
        loop {
            match self.reader.read(&mut self.buffer[self.end..]) {
                Ok(count) => {
                    self.at_end = count == 0;
                    self.end += count;
                    return Ok(());
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hands out a byte at a time, so that every line end meets a chunk's border.
    struct Dribble<'a>(&'a [u8]);

    impl Read for Dribble<'_> {
        fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
            let count = self.0.len().min(1);
            out[..count].copy_from_slice(&self.0[..count]);
            self.0 = &self.0[count..];
            Ok(count)
        }
    }

    fn check(text: &[u8], expected: &[(u64, &[u8])]) {
        let all = |mut lines: Lines<Box<dyn Read + '_>>| {
            let mut found = Vec::new();
            while let Some(line) = lines.next_line().unwrap() {
                assert_eq!(line.number as usize, found.len() + 1);
                found.push((line.offset, line.bytes.to_vec()));
            }
            found
        };
        let expected: Vec<_> = expected.iter().map(|(at, line)| (*at, line.to_vec())).collect();
        assert_eq!(all(Lines::new(Box::new(text), 0, 1)), expected);
        assert_eq!(all(Lines::new(Box::new(Dribble(text)), 0, 1)), expected);
    }

    #[test]
    fn any_line_end_ends_a_line() {
        check(b"", &[]);
        check(b"a\nb\r\nc\rd", &[(0, b"a"), (2, b"b"), (5, b"c"), (7, b"d")]);
        check(b"\r\n\n\r\r\n", &[(0, b""), (2, b""), (3, b""), (4, b"")]);
        check(b"\xef\xbb\xbfa\r\n", &[(3, b"a")]);
        check(b"\xef\xbb\xbf", &[]);
        check(b"a\r\n\x1a", &[(0, b"a")]);
        check(b"a\x1ab\x1a\x1a", &[(0, b"a\x1ab")]);
        check(b"\x1a\n", &[(0, b"\x1a")]);
    }

    #[test]
    fn a_line_too_long_is_cut_and_the_next_one_is_whole() {
        for end in ["\n", "\r\n", "\r"] {
            for length in [LINE_BYTES_MAX, LINE_BYTES_MAX + 1, 3 * CHUNK_BYTES] {
                let text = "x".repeat(length) + end + "b";
                let mut lines = Lines::new(text.as_bytes(), 0, 1);
                let line = lines.next_line().unwrap().unwrap();
                assert_eq!(line.bytes.len(), LINE_BYTES_MAX);
                assert_eq!(line.too_long, length > LINE_BYTES_MAX);
                let line = lines.next_line().unwrap().unwrap();
                assert_eq!((line.number, line.bytes), (2, &b"b"[..]));
                assert!(lines.next_line().unwrap().is_none());
            }
        }
    }
}
