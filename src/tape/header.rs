//! The header of a dump: what it was made from, and how to read its rows.

use std::fmt;
use std::str::FromStr;

use super::{MAGIC, TapeError, VERSION};
use crate::base::{Axis, AxisMap};

/// Steps from zero that a dump may begin at: beyond, a position is no longer exact to a step.
const STEPS_MAX: u64 = 1 << 53;

/// What a dump says of itself before its rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Header {
    /// The program that wrote the dump, and its version.
    pub tool: String,
    /// The NC program.
    pub program: Origin,
    /// Further files that the NC program made the interpreter read.
    pub inputs: Vec<Origin>,
    /// Every option that changes motion, name and value; neither may hold a blank, nor the name
    /// a `=`.
    pub options: Vec<(String, String)>,
    /// The machine's id and the hash of its profile (`Machine::to_toml`).
    pub machine: Origin,
    /// Time of one tick.
    pub tick_us: u32,
    /// The axes that have a column, in order, and their steps a mm (a degree on rotary axes).
    pub steps_per_mm: Vec<(Axis, f64)>,
    /// Machine position before the first tick, in steps; 0 on axes without a column.
    pub start_steps: AxisMap<i64>,
    /// What stands in the axis columns.
    pub encoding: Encoding,
}

/// A named thing and the hash of what it was when the dump was made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Origin {
    /// File name or id.
    pub name: String,
    /// SHA-256 of the content.
    pub sha256: [u8; 32],
}

/// What stands in the axis columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Signed steps.
    Counts,
    /// The byte that goes on the bus: bit 7 set is negative, bits 0 to 6 are the steps; 128,
    /// which would be -0, does not occur.
    Bytes,
}

impl Encoding {
    /// The name in the header.
    pub fn name(self) -> &'static str {
        match self {
            Encoding::Counts => "counts",
            Encoding::Bytes => "bytes",
        }
    }
}

impl Header {
    /// The line of column names, without its line end.
    pub fn columns(&self) -> String {
        let axes: String = self.steps_per_mm.iter().map(|(axis, _)| format!("{axis},")).collect();
        format!("tick,buffer,line,{axes}event")
    }

    /// Reads the lines before the column names; `lines` hold neither line ends nor those names.
    pub(super) fn parse(lines: &[String]) -> Result<Header, TapeError> {
        let version = lines.first().and_then(|line| line.strip_prefix(MAGIC));
        match version.map(str::trim) {
            Some(VERSION) => {}
            Some(other) => return Err(TapeError::Version(other.to_owned())),
            None => return Err(TapeError::NotADump),
        }
        let mut keys = Keys::split(&lines[1..])?;
        let header = Header {
            tool: keys.take("tool", |text| Some(text.to_owned()))?,
            program: keys.take("program", origin)?,
            inputs: keys.take("inputs", origins)?,
            options: keys.take("options", options)?,
            machine: keys.take("machine", origin)?,
            tick_us: keys.take("tick_us", |text| text.parse().ok().filter(|us| *us > 0))?,
            steps_per_mm: keys.take("steps_per_mm", steps_per_mm)?,
            start_steps: keys.take("start_steps", |text| {
                let mut steps = AxisMap::<i64>::default();
                let values = axis_values(text)?;
                values.iter().for_each(|(axis, value)| steps[*axis] = *value);
                values.iter().all(|(_, value)| value.unsigned_abs() <= STEPS_MAX).then_some(steps)
            })?,
            encoding: keys.take("encoding", |text| {
                [Encoding::Counts, Encoding::Bytes].into_iter().find(|known| known.name() == text)
            })?,
        };
        keys.end()?;
        Ok(header)
    }
}

/// The lines of the header, each with its line end.
impl fmt::Display for Header {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let inputs: Vec<String> = self.inputs.iter().map(Origin::to_string).collect();
        let options: Vec<String> =
            self.options.iter().map(|(name, value)| format!("{name}={value}")).collect();
        let scales = self.steps_per_mm.iter().map(|(axis, scale)| format!("{axis}={scale}"));
        let starts = self.steps_per_mm.iter().map(|(axis, _)| *axis);
        let starts = starts.map(|axis| format!("{axis}={}", self.start_steps[axis]));
        let lines = [
            ("tool", printable(&self.tool)),
            ("program", self.program.to_string()),
            ("inputs", inputs.join(", ")),
            ("options", options.join(" ")),
            ("machine", self.machine.to_string()),
            ("tick_us", self.tick_us.to_string()),
            ("steps_per_mm", scales.collect::<Vec<_>>().join(" ")),
            ("start_steps", starts.collect::<Vec<_>>().join(" ")),
            ("encoding", self.encoding.name().to_owned()),
        ];
        writeln!(f, "{MAGIC} {VERSION}")?;
        lines.iter().try_for_each(|(key, value)| {
            let blank = if value.is_empty() { "" } else { " " };
            writeln!(f, "# {key}:{blank}{value}")
        })
    }
}

/// `NAME sha256:HASH`
impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} sha256:{}", printable(&self.name), hex(&self.sha256))
    }
}

/// File names may hold line ends; a header line may not.
fn printable(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect()
}

pub(super) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

pub(super) fn unhex(text: &str) -> Option<[u8; 32]> {
    let mut bytes = [0; 32];
    if text.len() != 64 || !text.bytes().all(|digit| digit.is_ascii_hexdigit()) {
        return None;
    }
    for (at, byte) in bytes.iter_mut().enumerate() {
        *byte = u8::from_str_radix(&text[2 * at..2 * at + 2], 16).ok()?;
    }
    Some(bytes)
}

fn origin(text: &str) -> Option<Origin> {
    let (name, hash) = text.rsplit_once(" sha256:")?;
    Some(Origin { name: name.to_owned(), sha256: unhex(hash)? })
}

/// Origins joined by `, `; names may hold commas, so each ends at its hash.
fn origins(mut text: &str) -> Option<Vec<Origin>> {
    const MARK: &str = " sha256:";
    let mut list = Vec::new();
    while !text.is_empty() {
        let end = text.find(MARK)? + MARK.len() + 64;
        let (first, rest) = text.split_at_checked(end)?;
        list.push(origin(first)?);
        text = if rest.is_empty() { rest } else { rest.strip_prefix(", ")? };
    }
    Some(list)
}

fn steps_per_mm(text: &str) -> Option<Vec<(Axis, f64)>> {
    let values: Vec<(Axis, f64)> = axis_values(text)?;
    let ordered = values.windows(2).all(|pair| pair[0].0 < pair[1].0);
    let sound = values.iter().all(|(_, scale)| scale.is_finite() && *scale > 0.0);
    (ordered && sound && !values.is_empty()).then_some(values)
}

/// `X=1 Y=2`: each word an axis and its value.
pub(super) fn axis_values<T: FromStr>(text: &str) -> Option<Vec<(Axis, T)>> {
    let value = |word: &str| {
        let (letter, value) = word.split_once('=')?;
        let [letter] = letter.as_bytes() else { return None };
        Some((Axis::from_letter(*letter)?, value.parse().ok()?))
    };
    text.split_ascii_whitespace().map(value).collect()
}

/// `name=value name=value`
fn options(text: &str) -> Option<Vec<(String, String)>> {
    let pair = |word: &str| {
        let (name, value) = word.split_once('=')?;
        Some((name.to_owned(), value.to_owned()))
    };
    text.split_ascii_whitespace().map(pair).collect()
}

/// `# key: value` lines that have not been asked for yet.
struct Keys<'a>(Vec<(u64, &'a str, &'a str)>);

impl<'a> Keys<'a> {
    fn split(lines: &'a [String]) -> Result<Keys<'a>, TapeError> {
        let key = |(at, line): (usize, &'a String)| {
            let number = at as u64 + 2;
            let parts = line.strip_prefix("# ").and_then(|rest| rest.split_once(':'));
            parts.map(|(key, value)| (number, key, value.trim())).ok_or_else(|| TapeError::Header {
                line: number,
                reason: format!("'{line}' is no '# key: value'"),
            })
        };
        Ok(Keys(lines.iter().enumerate().map(key).collect::<Result<_, _>>()?))
    }

    fn take<T>(&mut self, key: &str, read: impl FnOnce(&str) -> Option<T>) -> Result<T, TapeError> {
        let at = self.0.iter().position(|(_, name, _)| *name == key).ok_or_else(|| {
            TapeError::Header { line: 1, reason: format!("there is no line '# {key}: …'") }
        })?;
        let (line, _, value) = self.0.remove(at);
        let reason = || format!("'{value}' is no value of '{key}'");
        read(value).ok_or_else(|| TapeError::Header { line, reason: reason() })
    }

    fn end(self) -> Result<(), TapeError> {
        let reason = |key| format!("'{key}' is unknown, or there twice");
        self.0.first().map_or(Ok(()), |(line, key, _)| {
            Err(TapeError::Header { line: *line, reason: reason(key) })
        })
    }
}
