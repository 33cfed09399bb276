//! A trace's text → its lines.

use std::io::{BufRead, BufReader, Read};

use serde::Deserialize;

use super::{TraceHeader, TraceLine};

/// A text that is no trace, or a line that is none of one.
#[derive(Debug, thiserror::Error)]
pub enum TraceError {
    /// It cannot be read.
    #[error("line {line}: {reason}")]
    Io {
        /// Its line.
        line: u64,
        /// Why.
        reason: std::io::Error,
    },
    /// The first line is not that of a trace.
    #[error("this is no trace of `cnc send --trace`: {0}")]
    NotATrace(String),
    /// Another version of the format.
    #[error("a trace of schema {0}; this version reads 1")]
    Schema(u32),
    /// A line that says nothing.
    #[error("line {line}: {reason}")]
    Line {
        /// Its number, from 1.
        line: u64,
        /// Why.
        reason: String,
    },
    /// Times never go back.
    #[error("line {line}: its time is before that of the line above")]
    Order {
        /// Its number, from 1.
        line: u64,
    },
}

/// A line of a trace is at most this long: a host hands over 64 bytes at a time.
const LINE_MAX_BYTES: u64 = 1 << 20;

/// Reads a trace line by line.
#[derive(Debug)]
pub struct TraceReader<R> {
    input: BufReader<R>,
    header: TraceHeader,
    line: u64,
    last_us: u64,
    is_over: bool,
    is_cut: bool,
}

impl<R: Read> TraceReader<R> {
    /// Reads the first line.
    ///
    /// # Errors
    /// When it is not that of a trace.
    pub fn open(input: R) -> Result<Self, TraceError> {
        let mut input = BufReader::new(input);
        let text = line(&mut input, 1)?.unwrap_or_default();
        let not = |reason: serde_json::Error| TraceError::NotATrace(reason.to_string());
        let header: TraceHeader = serde_json::from_str(&text).map_err(not)?;
        if header.r#type != "trace" {
            return Err(TraceError::NotATrace(format!("it says type '{}'", header.r#type)));
        }
        if header.schema != 1 {
            return Err(TraceError::Schema(header.schema));
        }
        let (line, last_us) = (1, 0);
        Ok(TraceReader { input, header, line, last_us, is_over: false, is_cut: false })
    }

    /// The first line.
    pub fn header(&self) -> &TraceHeader {
        &self.header
    }

    /// Whether the trace ends in the middle of a line: the host was cut off.
    pub fn is_cut(&self) -> bool {
        self.is_cut
    }

    fn read(&mut self) -> Result<Option<TraceLine>, TraceError> {
        self.line += 1;
        let Some(text) = line(&mut self.input, self.line)? else { return Ok(None) };
        let number = self.line;
        let parsed = serde_json::from_str::<Raw>(&text).map_err(|error| error.to_string());
        let found = match parsed.and_then(Raw::line) {
            Ok(found) => found,
            Err(_) if !text.ends_with('\n') => {
                self.is_cut = true;
                return Ok(None);
            }
            Err(reason) => return Err(TraceError::Line { line: number, reason }),
        };
        let t_us = match &found {
            TraceLine::Sent { t_us, .. }
            | TraceLine::Received { t_us, .. }
            | TraceLine::End { t_us, .. } => *t_us,
            TraceLine::Lost { .. } => self.last_us,
        };
        if t_us < self.last_us {
            return Err(TraceError::Order { line: number });
        }
        self.last_us = t_us;
        Ok(Some(found))
    }
}

impl<R: Read> Iterator for TraceReader<R> {
    type Item = Result<TraceLine, TraceError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.is_over {
            return None;
        }
        let found = self.read();
        self.is_over = !matches!(found, Ok(Some(_)));
        found.transpose()
    }
}

fn line(input: &mut impl BufRead, line: u64) -> Result<Option<String>, TraceError> {
    let mut text = Vec::new();
    let mut input = input.take(LINE_MAX_BYTES);
    let read = input.read_until(b'\n', &mut text);
    match read.map_err(|reason| TraceError::Io { line, reason })? {
        0 => Ok(None),
        _ => Ok(Some(String::from_utf8_lossy(&text).into_owned())),
    }
}

/// A line as it stands there.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Raw {
    t_us: Option<u64>,
    dir: Option<String>,
    hex: Option<String>,
    #[serde(default)]
    failed: bool,
    lost: Option<u64>,
    end: Option<String>,
}

impl Raw {
    fn line(self) -> Result<TraceLine, String> {
        match (self.t_us, self.dir.as_deref(), self.hex, self.lost, self.end) {
            (Some(t_us), Some("tx"), Some(hex), None, None) => {
                Ok(TraceLine::Sent { t_us, bytes: unhex(&hex)?, failed: self.failed })
            }
            (Some(t_us), Some("rx"), Some(hex), None, None) => {
                Ok(TraceLine::Received { t_us, bytes: unhex(&hex)? })
            }
            (None, None, None, Some(lines), None) => Ok(TraceLine::Lost { lines }),
            (Some(t_us), None, None, None, Some(end)) => Ok(TraceLine::End { t_us, end }),
            _ => {
                Err(r#"expected t_us with dir ("tx" or "rx") and hex, or with end, or lost"#.into())
            }
        }
    }
}

fn unhex(text: &str) -> Result<Vec<u8>, String> {
    let digits: Option<Vec<u32>> = text.chars().map(|digit| digit.to_digit(16)).collect();
    let digits = digits.filter(|digits| digits.len().is_multiple_of(2));
    let digits = digits.ok_or_else(|| format!("'{text}' are no bytes in hexadecimal digits"))?;
    Ok(digits.chunks_exact(2).map(|pair| (pair[0] * 16 + pair[1]) as u8).collect())
}
