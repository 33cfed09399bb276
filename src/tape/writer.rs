//! Command → CSV. The hot end of interpolation: a table gives the text of small counts, and what
//! comes before them is printed only when buffer or line change: else the tick number counts on in its digits.

use std::io::{self, Write};

use sha2::{Digest, Sha256};

use super::header::hex;
use super::{Encoding, Header};
use crate::base::axis::AXES;
use crate::base::{Axis, AxisMap, Command, Tick};

/// Bytes gathered before they are hashed and handed on.
const BUFFER_BYTES: usize = 1 << 17;
/// More than the numbers of the longest row take: three columns of at most 20 digits and nine of
/// at most 11 characters, each with its comma, and the slack of the last cell.
const ROW_BYTES: usize = 192;

/// Writes a dump. Rows are gathered in memory; [`Writer::finish`] writes the last line, and
/// without it the dump reads as truncated.
#[derive(Debug)]
pub struct Writer<W: Write> {
    out: W,
    hash: Sha256,
    buffer: Vec<u8>,
    used: usize,
    header: Header,
    columns: Vec<Axis>,
    /// All ones on axes without a column, so that motion there is found by one `and`.
    absent: [i32; AXES],
    ticks: u64,
    head: Head,
    position_steps: AxisMap<i64>,
    events: String,
    event_line: u32,
}

impl<W: Write> Writer<W> {
    /// Writes the header and the column names.
    ///
    /// # Errors
    /// When the header holds an option that could not be read back, or `out` fails.
    pub fn new(mut out: W, header: &Header) -> io::Result<Self> {
        let bad = |text: &str| text.contains(|c: char| c.is_whitespace() || c.is_control());
        let option =
            |(name, value): &(String, String)| bad(name) || bad(value) || name.contains('=');
        if header.options.iter().any(option) {
            return Err(invalid(format!("options {:?} cannot be written", header.options)));
        }
        let columns: Vec<Axis> = header.steps_per_mm.iter().map(|(axis, _)| *axis).collect();
        let absent = Axis::ALL.map(|axis| if columns.contains(&axis) { 0 } else { -1 });
        let names = header.columns() + "\n";
        out.write_all(header.to_string().as_bytes())?;
        out.write_all(names.as_bytes())?;
        Ok(Writer {
            out,
            hash: Sha256::new_with_prefix(names.as_bytes()),
            buffer: vec![0; BUFFER_BYTES],
            used: 0,
            header: header.clone(),
            columns,
            absent,
            ticks: 0,
            head: Head::new(0, 0, 0),
            position_steps: header.start_steps,
            events: String::new(),
            event_line: 0,
        })
    }

    /// Writes a tick, or keeps an event for the row that follows.
    ///
    /// # Errors
    /// When an axis without a column moves, a count does not fit the encoding, or `out` fails.
    pub fn command(&mut self, command: &Command) -> io::Result<()> {
        match command {
            Command::Tick(tick) => self.tick(tick),
            Command::Event(event) => {
                let joint = if self.events.is_empty() { "" } else { "; " };
                self.events += &format!("{joint}{}", event.kind);
                self.event_line = event.line;
                Ok(())
            }
        }
    }

    /// Writes events that are left and the last line, and flushes.
    ///
    /// # Errors
    /// When `out` fails.
    pub fn finish(mut self) -> io::Result<W> {
        if !self.events.is_empty() {
            let (buffer, line) = (self.head.buffer, self.event_line);
            self.row(&Tick { buffer, line, counts: AxisMap::default() })?;
        }
        self.hand_on()?;
        let mut last = format!("# end: ticks={}", self.ticks);
        for (axis, _) in &self.header.steps_per_mm {
            last += &format!(" {axis}={}", self.position_steps[*axis]);
        }
        let hash = hex(&self.hash.finalize());
        writeln!(self.out, "{last} sha256:{hash}")?;
        self.out.flush()?;
        Ok(self.out)
    }

    fn tick(&mut self, tick: &Tick) -> io::Result<()> {
        let moved = tick.counts.0.iter().zip(self.absent).fold(0, |all, (n, mask)| all | n & mask);
        if moved != 0 {
            let columns = self.header.columns();
            return Err(invalid(format!("an axis without a column moves ({columns})")));
        }
        self.row(tick)?;
        self.ticks += 1;
        self.head.count_on(self.ticks);
        for axis in &self.columns {
            let position = &mut self.position_steps[*axis];
            *position = position.saturating_add(i64::from(tick.counts[*axis]));
        }
        Ok(())
    }

    fn row(&mut self, tick: &Tick) -> io::Result<()> {
        if self.used + ROW_BYTES > self.buffer.len() {
            self.hand_on()?;
        }
        if (self.head.buffer, self.head.line) != (tick.buffer, tick.line) {
            self.head.go_to(tick.buffer, tick.line);
        }
        let bytes;
        let values = match self.header.encoding {
            Encoding::Counts => &tick.counts,
            Encoding::Bytes => {
                bytes = bus_bytes(&tick.counts)?;
                &bytes
            }
        };
        let row = &mut self.buffer[self.used..][..ROW_BYTES];
        let mut at = self.head.write(row);
        for axis in &self.columns {
            at += cell(values[*axis], &mut row[at..]);
        }
        row[at] = b',';
        self.used += at + 1;
        if !self.events.is_empty() {
            self.hand_on()?;
            self.hash.update(self.events.as_bytes());
            self.out.write_all(self.events.as_bytes())?;
            self.events.clear();
        }
        self.buffer[self.used] = b'\n';
        self.used += 1;
        Ok(())
    }

    /// Hashes and writes what has been gathered.
    fn hand_on(&mut self) -> io::Result<()> {
        let rows = &self.buffer[..self.used];
        self.hash.update(rows);
        self.out.write_all(rows)?;
        self.used = 0;
        Ok(())
    }
}

fn invalid(reason: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, reason)
}

/// The bytes that go on the bus for counts.
fn bus_bytes(counts: &AxisMap<i32>) -> io::Result<AxisMap<i32>> {
    let mut bytes = AxisMap::default();
    for axis in Axis::ALL {
        bytes[axis] = bus_byte(counts[axis])?;
    }
    Ok(bytes)
}

/// The byte that goes on the bus for a count. Zero is 0, never -0.
fn bus_byte(count: i32) -> io::Result<i32> {
    match count {
        0..=127 => Ok(count),
        -127..=-1 => Ok(128 - count),
        _ => Err(invalid(format!("a count of {count} does not fit a bus byte"))),
    }
}

/// Counts of which [`CELLS`] holds the text: at least `-CELLS_HALF` and less than `CELLS_HALF`.
const CELLS_HALF: i32 = 256;

/// The text of small counts, with the comma before it; the last byte is its length. Eight bytes
/// are copied whatever the length, and the next cell overwrites what was too much.
static CELLS: [[u8; 8]; 2 * CELLS_HALF as usize] = cells();

const fn cells() -> [[u8; 8]; 2 * CELLS_HALF as usize] {
    let mut table = [[0; 8]; 2 * CELLS_HALF as usize];
    let mut index = 0;
    while index < table.len() {
        let value = index as i32 - CELLS_HALF;
        let mut cell = [0; 8];
        cell[0] = b',';
        let mut at = 1;
        if value < 0 {
            cell[at] = b'-';
            at += 1;
        }
        let size = value.unsigned_abs();
        let mut unit = if size >= 100 { 100 } else { 1 };
        if size >= 10 && size < 100 {
            unit = 10;
        }
        while unit > 0 {
            cell[at] = b'0' + (size / unit % 10) as u8;
            at += 1;
            unit /= 10;
        }
        cell[7] = at as u8;
        table[index] = cell;
        index += 1;
    }
    table
}

/// Writes a comma and a number; gives the length.
fn cell(value: i32, out: &mut [u8]) -> usize {
    let known = CELLS.get(value.wrapping_add(CELLS_HALF) as u32 as usize);
    if let Some((cell, out)) = known.zip(out.first_chunk_mut()) {
        *out = *cell;
        return usize::from(cell[7]);
    }
    let mut digits = itoa::Buffer::new();
    let text = digits.format(value).as_bytes();
    out[0] = b',';
    out[1..=text.len()].copy_from_slice(text);
    1 + text.len()
}

/// More than `tick,buffer,line` takes: three numbers of at most 20, 10 and 10 digits.
const HEAD_BYTES: usize = 48;

/// `tick,buffer,line` as text. While buffer and line stay, the tick counts up in its digits.
#[derive(Debug)]
struct Head {
    buffer: u32,
    line: u32,
    text: [u8; HEAD_BYTES],
    tick_digits: usize,
    length: usize,
}

impl Head {
    fn new(tick: u64, buffer: u32, line: u32) -> Head {
        let mut head = Head { buffer, line, text: [0; HEAD_BYTES], tick_digits: 0, length: 0 };
        head.append(itoa::Buffer::new().format(tick));
        head.tick_digits = head.length;
        head.go_to(buffer, line);
        head
    }

    fn go_to(&mut self, buffer: u32, line: u32) {
        (self.buffer, self.line, self.length) = (buffer, line, self.tick_digits);
        for value in [buffer, line] {
            self.append(",");
            self.append(itoa::Buffer::new().format(value));
        }
    }

    fn append(&mut self, text: &str) {
        self.text[self.length..][..text.len()].copy_from_slice(text.as_bytes());
        self.length += text.len();
    }

    /// The next tick; its number is given for the case that it has one digit more.
    fn count_on(&mut self, tick: u64) {
        for digit in self.text[..self.tick_digits].iter_mut().rev() {
            if *digit != b'9' {
                *digit += 1;
                return;
            }
            *digit = b'0';
        }
        *self = Head::new(tick, self.buffer, self.line);
    }

    /// All bytes are copied, which is faster than their exact number.
    fn write(&self, out: &mut [u8]) -> usize {
        out[..HEAD_BYTES].copy_from_slice(&self.text);
        self.length
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_count_is_written_as_the_library_would() {
        for value in (-400..400).chain([i32::MIN, i32::MAX, -100_000, 65_536]) {
            let mut out = [0; 16];
            let length = cell(value, &mut out);
            assert_eq!(std::str::from_utf8(&out[..length]).unwrap(), format!(",{value}"));
        }
    }

    #[test]
    fn ticks_count_on_over_every_carry() {
        let mut head = Head::new(0, 3, 14);
        for tick in 0..12_345 {
            let mut out = [0; HEAD_BYTES];
            let length = head.write(&mut out);
            assert_eq!(std::str::from_utf8(&out[..length]).unwrap(), format!("{tick},3,14"));
            head.count_on(tick + 1);
        }
    }

    #[test]
    fn bus_bytes_have_no_negative_zero() {
        assert_eq!([-127, -1, 0, 1, 127].map(|n| bus_byte(n).unwrap()), [255, 129, 0, 1, 127]);
        assert!(bus_byte(128).is_err() && bus_byte(-128).is_err());
    }
}
