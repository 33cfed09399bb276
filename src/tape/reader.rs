//! CSV → Command: streams a dump and checks on the way that it is what was sealed.

use std::collections::VecDeque;
use std::io::{self, BufRead, BufReader, Read};
use std::str::FromStr;

use csv::ByteRecord;
use sha2::{Digest, Sha256};

use super::header::{axis_values, unhex};
use super::{Encoding, Header, MAGIC, Origin, TapeError};
use crate::base::source::SourceReader;
use crate::base::{Axis, AxisMap, Command, Event, EventKind, Machine, Source, Tick};

/// Longest line that is read: no row of nine axes and its events comes near.
const LINE_BYTES_MAX: u64 = 1 << 16;

/// Most lines before the column names: what a header or the comments of another tool come near.
const HEADER_LINES_MAX: usize = 1000;

/// Reads a dump: an iterator over its commands, after whose last item (that is, `None`) the seal
/// has been checked. The first error ends it.
#[derive(Debug)]
pub struct Reader {
    header: Header,
    columns: Columns,
    sealed: bool,
    rows: csv::Reader<Rows>,
    record: ByteRecord,
    lines_before: u64,
    ready: VecDeque<Command>,
    /// A motionless row with events: the last one of these is no tick.
    held: Option<Tick>,
    ticks: u64,
    rows_read: u64,
    buffer: u32,
    position_steps: AxisMap<i64>,
    done: bool,
}

impl Reader {
    /// Opens a sealed dump and reads its header.
    ///
    /// # Errors
    /// When the source cannot be read, is no dump, or has a header that says too little.
    pub fn open(source: Source) -> Result<Reader, TapeError> {
        let mut input = BufReader::with_capacity(1 << 16, source.reader(0));
        let (lines, names) = header_lines(&mut input)?;
        let header = Header::parse(&lines)?;
        let line = lines.len() as u64;
        if names.is_empty() {
            return Err(TapeError::Truncated { line });
        }
        if names.trim_end_matches('\n') != header.columns() {
            let reason = if names.ends_with("\r\n") {
                "lines end in CR LF: a dump that was converted is not what was sealed".to_owned()
            } else {
                format!("the columns are not '{}'", header.columns())
            };
            return Err(TapeError::Row { line: line + 1, reason });
        }
        Reader::new(header, input, names, line, true)
    }

    /// Opens a dump of which nothing is sealed: columns named by the axis letters suffice, those
    /// named tick, buffer, line and event are used where there are any, others are passed over
    /// (see [`Reader::unused_columns`]). If it has the header of a sealed dump, that is used;
    /// otherwise motion starts at the machine's work zero, and the hashes of the header are zeros.
    ///
    /// # Errors
    /// When the source cannot be read, has a header that is wrong, or no column of the machine's
    /// axes.
    pub fn open_unsealed(source: Source, machine: &Machine) -> Result<Reader, TapeError> {
        let mut input = BufReader::with_capacity(1 << 16, source.reader(0));
        let (lines, names) = header_lines(&mut input)?;
        let header = match lines.first() {
            Some(first) if first.starts_with(MAGIC) => Header::parse(&lines)?,
            _ => Header {
                tool: String::new(),
                program: Origin { name: source.name().to_owned(), sha256: [0; 32] },
                inputs: Vec::new(),
                options: Vec::new(),
                machine: Origin { name: machine.id.clone(), sha256: [0; 32] },
                tick_us: machine.bus.tick_us,
                steps_per_mm: machine.axes.iter().map(|p| (p.axis, p.steps_per_mm)).collect(),
                start_steps: machine.nearest_steps(&machine.work_zero_mm),
                encoding: Encoding::Counts,
            },
        };
        Reader::new(header, input, names, lines.len() as u64, false)
    }

    /// What the dump says of itself.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Names of columns that an unsealed dump has and nobody uses.
    pub fn unused_columns(&self) -> &[String] {
        &self.columns.unused
    }

    /// Whether the rows have a column for events.
    pub fn has_events(&self) -> bool {
        self.columns.event.is_some()
    }

    /// Whether the rows have a column for node buffers.
    pub fn has_buffers(&self) -> bool {
        self.columns.buffer.is_some()
    }

    fn new(
        header: Header,
        input: BufReader<SourceReader>,
        names: String,
        lines_before: u64,
        sealed: bool,
    ) -> Result<Reader, TapeError> {
        let rows = Rows::new(input, names.into_bytes(), sealed);
        // No row of a sealed dump is quoted; a quote would swallow the lines after it.
        let mut rows = csv::ReaderBuilder::new()
            .flexible(true)
            .quoting(!sealed)
            .buffer_capacity(1 << 16)
            .from_reader(rows);
        let columns = Columns::find(rows.byte_headers().map_err(unreadable)?, &header)
            .map_err(|reason| TapeError::Row { line: lines_before + 1, reason })?;
        Ok(Reader {
            position_steps: header.start_steps,
            header,
            columns,
            sealed,
            rows,
            record: ByteRecord::new(),
            lines_before,
            ready: VecDeque::new(),
            held: None,
            ticks: 0,
            rows_read: 0,
            buffer: 0,
            done: false,
        })
    }

    /// Reads a row, or the end. Afterwards something is ready, or held back, or all is done.
    fn read(&mut self) -> Result<(), TapeError> {
        if !self.rows.read_byte_record(&mut self.record).map_err(unreadable)? {
            self.done = true;
            return self.end();
        }
        if let Some(tick) = self.held.take() {
            self.give(tick);
        }
        let events = self.ready.len();
        let tick = self.row().map_err(|reason| {
            // Where the record was looked for: before blank lines and comments. Where the next
            // one is: after the record's line end, if it has one.
            let from = self.record.position().map_or(0, csv::Position::line);
            let line = from.max(self.rows.position().line() - 1) + self.lines_before;
            TapeError::Row { line, reason }
        })?;
        self.rows_read += 1;
        if self.ready.len() > events && tick.counts == AxisMap::default() {
            self.held = Some(tick);
        } else {
            self.give(tick);
        }
        Ok(())
    }

    fn give(&mut self, tick: Tick) {
        self.ticks += 1;
        for (position, count) in self.position_steps.0.iter_mut().zip(tick.counts.0) {
            *position = position.saturating_add(i64::from(count));
        }
        self.ready.push_back(Command::Tick(tick));
    }

    /// The tick of the current record; its events are made ready.
    fn row(&mut self) -> Result<Tick, String> {
        let (record, columns) = (&self.record, &self.columns);
        if record.len() != columns.count {
            return Err(format!("{} fields where {} belong", record.len(), columns.count));
        }
        let mut tick = Tick::default();
        if let Some(at) = columns.tick.filter(|_| self.sealed) {
            let number: u64 = number(&record[at], "tick")?;
            if number != self.rows_read {
                return Err(format!("tick {number} where {} belongs", self.rows_read));
            }
        }
        if let Some(at) = columns.buffer {
            tick.buffer = number(&record[at], "buffer")?;
            // A dump's first row opens buffer 0; then each buffer follows the one before.
            let next = self.buffer.saturating_add(u32::from(self.rows_read > 0));
            if tick.buffer != self.buffer && tick.buffer != next {
                return Err(format!("buffer {} after buffer {}", tick.buffer, self.buffer));
            }
            self.buffer = tick.buffer;
        }
        if let Some(at) = columns.line {
            tick.line = number(&record[at], "line")?;
        }
        for (axis, at) in &columns.axes {
            tick.counts[*axis] = count(&record[*at], self.header.encoding)?;
        }
        if let Some(at) = columns.event.filter(|at| !record[*at].is_empty()) {
            let text = std::str::from_utf8(&record[at]).map_err(|error| error.to_string())?;
            for text in text.split("; ") {
                let kind: EventKind = text.parse().map_err(|error| format!("{error}"))?;
                self.ready.push_back(Command::Event(Event { line: tick.line, kind }));
            }
        }
        Ok(tick)
    }

    /// Checks the last line; gives a held tick if it counts as one.
    fn end(&mut self) -> Result<(), TapeError> {
        if !self.sealed {
            return Ok(());
        }
        let rows = self.rows.get_ref();
        let last = self.lines_before + rows.lines;
        let text = rows.end.as_deref().ok_or(TapeError::Truncated { line: last })?;
        let end = End::parse(text).ok_or(TapeError::Truncated { line: last })?;
        if rows.more {
            return Err(TapeError::Seal("more text follows the last line".to_owned()));
        }
        if end.sha256 != <[u8; 32]>::from(rows.hash.clone().finalize()) {
            let reason = "the rows have been changed since it was written (their hash is another)";
            return Err(TapeError::Seal(reason.to_owned()));
        }
        if let Some(tick) = self.held.take().filter(|_| end.ticks == self.ticks + 1) {
            self.give(tick);
        }
        if end.ticks != self.ticks {
            let reason = format!("{} ticks where {} were sealed", self.ticks, end.ticks);
            return Err(TapeError::Seal(reason));
        }
        for (axis, _) in &self.header.steps_per_mm {
            let sealed = end.position_steps.iter().find(|(of, _)| of == axis).map(|(_, at)| *at);
            if sealed != Some(self.position_steps[*axis]) {
                let at = self.position_steps[*axis];
                let reason = format!("the rows end at {axis}={at}, which is not what was sealed");
                return Err(TapeError::Seal(reason));
            }
        }
        Ok(())
    }
}

impl Iterator for Reader {
    type Item = Result<Command, TapeError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(command) = self.ready.pop_front() {
                return Some(Ok(command));
            }
            if self.done {
                return None;
            }
            if let Err(error) = self.read() {
                self.done = true;
                self.ready.clear();
                return Some(Err(error));
            }
        }
    }
}

fn unreadable(error: csv::Error) -> TapeError {
    TapeError::Io(error.into())
}

fn number<T: FromStr>(field: &[u8], column: &str) -> Result<T, String> {
    let text = std::str::from_utf8(field).ok().map(str::trim);
    let bad = || format!("'{}' is no value of {column}", String::from_utf8_lossy(field));
    text.and_then(|text| text.parse().ok()).ok_or_else(bad)
}

fn count(field: &[u8], encoding: Encoding) -> Result<i32, String> {
    match encoding {
        Encoding::Counts => number(field, "a count of steps"),
        Encoding::Bytes => match number::<u8>(field, "a bus byte")? {
            128 => Err("byte 128 is -0, which no dump holds".to_owned()),
            byte if byte > 128 => Ok(128 - i32::from(byte)),
            byte => Ok(i32::from(byte)),
        },
    }
}

/// The `#` lines before the column names, without line ends, and the line of those names.
fn header_lines(input: &mut impl BufRead) -> Result<(Vec<String>, String), TapeError> {
    let mut lines = Vec::new();
    loop {
        let mut bytes = Vec::new();
        read_line(input, &mut bytes)?;
        let line = String::from_utf8(bytes).map_err(|_| TapeError::NotADump)?;
        if !line.starts_with('#') {
            return Ok((lines, line));
        }
        if lines.len() == HEADER_LINES_MAX {
            let reason = format!("more than {HEADER_LINES_MAX} lines stand before the columns");
            return Err(TapeError::Header { line: HEADER_LINES_MAX as u64 + 1, reason });
        }
        lines.push(line.trim_end_matches(['\r', '\n']).to_owned());
    }
}

/// Reads a line with its end; nothing at the end of the input.
fn read_line(input: &mut impl BufRead, line: &mut Vec<u8>) -> io::Result<()> {
    line.clear();
    input.take(LINE_BYTES_MAX).read_until(b'\n', line)?;
    if line.len() as u64 == LINE_BYTES_MAX {
        let reason = format!("a line is longer than {LINE_BYTES_MAX} bytes");
        return Err(io::Error::new(io::ErrorKind::InvalidData, reason));
    }
    Ok(())
}

/// Where in a record each thing stands.
#[derive(Debug, Default)]
struct Columns {
    count: usize,
    tick: Option<usize>,
    buffer: Option<usize>,
    line: Option<usize>,
    event: Option<usize>,
    axes: Vec<(Axis, usize)>,
    unused: Vec<String>,
}

impl Columns {
    fn find(names: &ByteRecord, header: &Header) -> Result<Columns, String> {
        let mut columns = Columns { count: names.len(), ..Columns::default() };
        for (at, name) in names.iter().enumerate() {
            let name = String::from_utf8_lossy(name).trim().to_owned();
            let place = match name.as_str() {
                "tick" => &mut columns.tick,
                "buffer" => &mut columns.buffer,
                "line" => &mut columns.line,
                "event" => &mut columns.event,
                _ => {
                    match header.steps_per_mm.iter().find(|(axis, _)| name == axis.to_string()) {
                        Some((axis, _)) if columns.axes.iter().all(|(of, _)| of != axis) => {
                            columns.axes.push((*axis, at));
                        }
                        Some(_) => return Err(format!("column '{name}' is there twice")),
                        None => columns.unused.push(name),
                    }
                    continue;
                }
            };
            if place.replace(at).is_some() {
                return Err(format!("column '{name}' is there twice"));
            }
        }
        if columns.axes.is_empty() {
            return Err("there is no column of an axis of the machine".to_owned());
        }
        Ok(columns)
    }
}

/// The last line: `# end: ticks=N X=N … sha256:…`.
struct End {
    ticks: u64,
    position_steps: Vec<(Axis, i64)>,
    sha256: [u8; 32],
}

const END: &str = "# end:";

impl End {
    fn parse(text: &str) -> Option<End> {
        let (rest, hash) = text.trim_end().strip_prefix(END)?.rsplit_once(" sha256:")?;
        let (ticks, steps) = rest.trim_start().strip_prefix("ticks=")?.split_once(' ')?;
        Some(End {
            ticks: ticks.parse().ok()?,
            position_steps: axis_values(steps)?,
            sha256: unhex(hash)?,
        })
    }
}

/// The lines that are rows, as the CSV parser reads them: hashed on the way, up to the last line
/// of a sealed dump. Comments of an unsealed one become empty lines.
#[derive(Debug)]
struct Rows {
    input: BufReader<SourceReader>,
    sealed: bool,
    hash: Sha256,
    line: Vec<u8>,
    given: usize,
    /// Lines read so far, the column names included.
    lines: u64,
    end: Option<String>,
    more: bool,
}

impl Rows {
    fn new(input: BufReader<SourceReader>, names: Vec<u8>, sealed: bool) -> Rows {
        let hash = Sha256::new_with_prefix(&names);
        Rows { input, sealed, hash, line: names, given: 0, lines: 1, end: None, more: false }
    }

    fn next_line(&mut self) -> io::Result<()> {
        read_line(&mut self.input, &mut self.line)?;
        self.given = 0;
        if self.line.is_empty() {
            return Ok(());
        }
        self.lines += 1;
        let cut = !self.line.ends_with(b"\n");
        if self.sealed && self.line.starts_with(END.as_bytes()) {
            self.end = Some(String::from_utf8_lossy(&self.line).into_owned());
            self.more = !self.input.fill_buf()?.is_empty();
            self.line.clear();
        } else if self.sealed && cut {
            self.line.clear();
        } else if self.sealed {
            self.hash.update(&self.line);
        } else if self.line.starts_with(b"#") {
            self.line.clear();
            self.line.push(b'\n');
        }
        Ok(())
    }
}

/// Gives as many lines as there is room for: the parser is called a few times, not once a line.
impl Read for Rows {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let mut filled = 0;
        while filled < out.len() {
            if self.given == self.line.len() {
                if self.end.is_none() {
                    self.next_line()?;
                }
                if self.line.is_empty() {
                    break;
                }
            }
            let count = (&self.line[self.given..]).read(&mut out[filled..])?;
            self.given += count;
            filled += count;
        }
        Ok(filled)
    }
}
