//! CSV → Command: streams a dump and checks on the way that it is what was sealed.

use std::collections::VecDeque;
use std::ops::Range;
use std::str::FromStr;

use super::header::{axis_values, unhex};
use super::rows::{Lines, split, without_line_end};
use super::{Encoding, Header, MAGIC, Origin, TapeError};
use crate::base::{Axis, AxisMap, Command, Event, EventKind, Machine, Source, Tick};

/// Most lines before the column names: what a header or the comments of another tool come near.
const HEADER_LINES_MAX: usize = 1000;

/// Reads a dump: an iterator over its commands, after whose last item (that is, `None`) the seal
/// has been checked. The first error ends it.
#[derive(Debug)]
pub struct Reader {
    header: Header,
    columns: Columns,
    sealed: bool,
    lines: Lines,
    /// Fields of the row under way, where they have to be looked for.
    fields: Vec<Range<usize>>,
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
        let mut lines = Lines::new(source.reader(0));
        let (head, names) = header_lines(&mut lines)?;
        let header = Header::parse(&head)?;
        let line = lines.count;
        let Some(names) = names else { return Err(TapeError::Truncated { line }) };
        lines.hash_from(&names);
        let found = lines.text(names.clone());
        if without_line_end(found) != header.columns().as_bytes() || found.ends_with(b"\r\n") {
            let reason = if found.ends_with(b"\r\n") {
                "lines end in CR LF: a dump that was converted is not what was sealed".to_owned()
            } else {
                format!("the columns are not '{}'", header.columns())
            };
            return Err(TapeError::Row { line, reason });
        }
        Reader::new(header, lines, Some(names), true)
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
        let mut lines = Lines::new(source.reader(0));
        let (head, names) = header_lines(&mut lines)?;
        let header = match head.first() {
            Some(first) if first.starts_with(MAGIC) => Header::parse(&head)?,
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
        Reader::new(header, lines, names, false)
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
        lines: Lines,
        names: Option<Range<usize>>,
        sealed: bool,
    ) -> Result<Reader, TapeError> {
        let mut fields = Vec::new();
        let names = lines.text(names.unwrap_or(0..0));
        // No row of a sealed dump is quoted.
        let columns = split(names, !sealed, &mut fields)
            .and_then(|()| Columns::find(fields.iter().map(|field| &names[field.clone()]), &header))
            .map_err(|reason| TapeError::Row { line: lines.count.max(1), reason })?;
        Ok(Reader {
            position_steps: header.start_steps,
            header,
            columns,
            sealed,
            lines,
            fields,
            ready: VecDeque::new(),
            held: None,
            ticks: 0,
            rows_read: 0,
            buffer: 0,
            done: false,
        })
    }

    /// Reads a row, or the end. Afterwards something is ready, or held back, or all is done; a
    /// tick that nothing stands before is given at once.
    fn read(&mut self) -> Result<Option<Tick>, TapeError> {
        let Some(line) = self.lines.next()? else { return self.end(None) };
        let text = self.lines.text(line.clone());
        if self.sealed && (text.starts_with(END.as_bytes()) || !text.ends_with(b"\n")) {
            return self.end(Some(line));
        }
        if !self.sealed && (text.starts_with(b"#") || without_line_end(text).is_empty()) {
            return Ok(None);
        }
        if let Some(tick) = self.held.take() {
            let tick = self.taken(tick);
            self.ready.push_back(Command::Tick(tick));
        }
        let events = self.ready.len();
        let tick = match self.sealed.then(|| self.quick_row(line.clone())).flatten() {
            Some(tick) => tick,
            None => self
                .row(line)
                .map_err(|reason| TapeError::Row { line: self.lines.count, reason })?,
        };
        self.rows_read += 1;
        if self.ready.len() > events && tick.counts == AxisMap::default() {
            self.held = Some(tick);
            return Ok(None);
        }
        let tick = self.taken(tick);
        if self.ready.is_empty() {
            return Ok(Some(tick));
        }
        self.ready.push_back(Command::Tick(tick));
        Ok(None)
    }

    /// A row turned out to be a tick.
    fn taken(&mut self, tick: Tick) -> Tick {
        self.ticks += 1;
        for (axis, _) in &self.columns.axes {
            let position = &mut self.position_steps[*axis];
            *position = position.saturating_add(i64::from(tick.counts[*axis]));
        }
        tick
    }

    /// The tick of a row without events that is written as [`super::Writer`] writes it, and
    /// follows the row before; none where [`Reader::row`] has to see what it is.
    fn quick_row(&self, line: Range<usize>) -> Option<Tick> {
        let mut rest = self.lines.text(line);
        let number = quick_number(&mut rest)?;
        let buffer = quick_number(&mut rest)?;
        if number != self.rows_read || buffer != u64::from(self.buffer) {
            return None;
        }
        let line = u32::try_from(quick_number(&mut rest)?).ok()?;
        let mut counts = AxisMap::default();
        for (axis, _) in &self.columns.axes {
            let is_negative = rest.first() == Some(&b'-');
            if is_negative {
                rest = &rest[1..];
            }
            let size = i32::try_from(quick_number(&mut rest)?).ok()?;
            counts[*axis] = match (self.header.encoding, is_negative) {
                (Encoding::Counts, true) => -size,
                (Encoding::Counts, false) => size,
                (Encoding::Bytes, true) => return None,
                (Encoding::Bytes, false) => bus_count(u8::try_from(size).ok()?).ok()?,
            };
        }
        (rest == b"\n").then_some(Tick { buffer: self.buffer, line, counts })
    }

    /// The tick of a row; its events are made ready.
    fn row(&mut self, line: Range<usize>) -> Result<Tick, String> {
        let line = self.lines.text(line);
        let (fields, columns) = (&mut self.fields, &self.columns);
        split(line, !self.sealed, fields)?;
        if fields.len() != columns.count {
            return Err(format!("{} fields where {} belong", fields.len(), columns.count));
        }
        let field = |at: usize| &line[fields[at].clone()];
        let mut tick = Tick::default();
        if let Some(at) = columns.tick.filter(|_| self.sealed) {
            let number: u64 = number(field(at), "tick")?;
            if number != self.rows_read {
                return Err(format!("tick {number} where {} belongs", self.rows_read));
            }
        }
        if let Some(at) = columns.buffer {
            tick.buffer = number(field(at), "buffer")?;
            // A dump's first row opens buffer 0; then each buffer follows the one before.
            let next = self.buffer.saturating_add(u32::from(self.rows_read > 0));
            if tick.buffer != self.buffer && tick.buffer != next {
                return Err(format!("buffer {} after buffer {}", tick.buffer, self.buffer));
            }
            self.buffer = tick.buffer;
        }
        if let Some(at) = columns.line {
            tick.line = number(field(at), "line")?;
        }
        for (axis, at) in &columns.axes {
            tick.counts[*axis] = count(field(*at), self.header.encoding)?;
        }
        if let Some(at) = columns.event.filter(|at| !field(*at).is_empty()) {
            let text = std::str::from_utf8(field(at)).map_err(|error| error.to_string())?;
            for text in text.split("; ") {
                let kind: EventKind = text.parse().map_err(|error| format!("{error}"))?;
                self.ready.push_back(Command::Event(Event { line: tick.line, kind }));
            }
        }
        Ok(tick)
    }

    /// Checks the last line, if there is one; gives a held tick if it counts as one.
    fn end(&mut self, line: Option<Range<usize>>) -> Result<Option<Tick>, TapeError> {
        self.done = true;
        if !self.sealed {
            return Ok(None);
        }
        let truncated = TapeError::Truncated { line: self.lines.count };
        let Some(line) = line else { return Err(truncated) };
        let text = String::from_utf8_lossy(self.lines.text(line.clone()));
        let Some(end) = End::parse(&text) else { return Err(truncated) };
        let sha256 = self.lines.hash_before(&line);
        if !self.lines.is_over()? {
            return Err(TapeError::Seal("more text follows the last line".to_owned()));
        }
        if end.sha256 != sha256 {
            let reason = "the rows have been changed since it was written (their hash is another)";
            return Err(TapeError::Seal(reason.to_owned()));
        }
        let last = self.held.take().filter(|_| end.ticks == self.ticks + 1);
        let last = last.map(|tick| self.taken(tick));
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
        Ok(last)
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
            match self.read() {
                Ok(Some(tick)) => return Some(Ok(Command::Tick(tick))),
                Ok(None) => {}
                Err(error) => {
                    self.done = true;
                    self.ready.clear();
                    return Some(Err(error));
                }
            }
        }
    }
}

/// Takes digits and the comma behind them; none if there is anything else, or too much.
fn quick_number(rest: &mut &[u8]) -> Option<u64> {
    // 18 digits fit whatever they are.
    const DIGITS_MAX: usize = 18;
    let mut value = 0;
    for (at, byte) in rest.iter().enumerate().take(DIGITS_MAX + 1) {
        let digit = byte.wrapping_sub(b'0');
        if digit <= 9 {
            value = 10 * value + u64::from(digit);
        } else if *byte == b',' && at > 0 {
            *rest = &rest[at + 1..];
            return Some(value);
        } else {
            return None;
        }
    }
    None
}

fn number<T: FromStr>(field: &[u8], column: &str) -> Result<T, String> {
    let text = std::str::from_utf8(field).ok().map(str::trim);
    let bad = || format!("'{}' is no value of {column}", String::from_utf8_lossy(field));
    text.and_then(|text| text.parse().ok()).ok_or_else(bad)
}

fn count(field: &[u8], encoding: Encoding) -> Result<i32, String> {
    match encoding {
        Encoding::Counts => number(field, "a count of steps"),
        Encoding::Bytes => bus_count(number(field, "a bus byte")?),
    }
}

/// The count that a bus byte stands for.
fn bus_count(byte: u8) -> Result<i32, String> {
    match byte {
        128 => Err("byte 128 is -0, which no dump holds".to_owned()),
        129.. => Ok(128 - i32::from(byte)),
        _ => Ok(i32::from(byte)),
    }
}

/// The `#` lines before the column names, without line ends, and where the line of those names
/// lies, if there is one.
fn header_lines(lines: &mut Lines) -> Result<(Vec<String>, Option<Range<usize>>), TapeError> {
    let mut head = Vec::new();
    while let Some(line) = lines.next()? {
        let text =
            std::str::from_utf8(lines.text(line.clone())).map_err(|_| TapeError::NotADump)?;
        if !text.starts_with('#') {
            return Ok((head, Some(line)));
        }
        if head.len() == HEADER_LINES_MAX {
            let reason = format!("more than {HEADER_LINES_MAX} lines stand before the columns");
            return Err(TapeError::Header { line: HEADER_LINES_MAX as u64 + 1, reason });
        }
        head.push(text.trim_end_matches(['\r', '\n']).to_owned());
    }
    Ok((head, None))
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
    fn find<'a>(names: impl Iterator<Item = &'a [u8]>, header: &Header) -> Result<Columns, String> {
        let mut columns = Columns::default();
        for (at, name) in names.enumerate() {
            columns.count += 1;
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A reader that stands at the end of its columns, and the line `row` behind these.
    fn before(row: &str, encoding: &str) -> (Reader, Range<usize>) {
        let hash = "0".repeat(64);
        let text = format!(
            "# cnc-dump: 1\n# tool: t\n# program: p sha256:{hash}\n# inputs:\n# options:\n\
             # machine: m sha256:{hash}\n# tick_us: 1\n# steps_per_mm: X=1 Y=1\n\
             # start_steps: X=0 Y=0\n# encoding: {encoding}\ntick,buffer,line,X,Y,event\n{row}\n"
        );
        let mut reader = Reader::open(Source::memory("dump", text.into_bytes())).unwrap();
        let line = reader.lines.next().unwrap().unwrap();
        (reader, line)
    }

    #[test]
    fn rows_as_they_are_written_are_read_quickly() {
        for (row, encoding) in [("0,0,3,-5,119,", "counts"), ("0,0,3,133,119,", "bytes")] {
            let (reader, line) = before(row, encoding);
            let counts = reader.quick_row(line).unwrap().counts;
            assert_eq!((counts[Axis::X], counts[Axis::Y]), (-5, 119));
        }
    }

    proptest! {
        /// What is read quickly is what is read otherwise.
        #[test]
        fn the_quick_way_is_the_other_one(
            row in "0,0,[0-9+ -]{0,12},[0-9-]{0,11},-?[0-9]{1,4},?(M30)?", bytes: bool,
        ) {
            let encoding = if bytes { "bytes" } else { "counts" };
            let (mut reader, line) = before(&row, encoding);
            if let Some(tick) = reader.quick_row(line.clone()) {
                prop_assert_eq!(Ok(tick), reader.row(line));
                prop_assert!(reader.ready.is_empty());
            }
        }
    }
}
