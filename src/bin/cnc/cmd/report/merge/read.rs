//! Files of results → what is kept of each result, in bounded memory: files are read document by document,
//! and of what a document lists the first few are kept.

use std::cell::Cell;
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;
use std::rc::Rc;

use serde_json::Value;

use super::super::document::{Document, Job, Verdict};
use crate::exit::told;
use crate::input;

/// What is said of a program that does not pass: so many sentences at most.
pub const TOLD_MAX: usize = 3;
/// Most characters of a sentence.
const LETTERS_MAX: usize = 300;

/// What is said of a document that is none.
const NO_RESULT: &str = "no result of `cnc report --json`";

/// What is kept of a result.
pub struct Entry {
    pub file: String,
    pub machine: String,
    pub machine_sha256: String,
    pub tool: String,
    pub verdict: Verdict,
    /// What is wrong, the first of it.
    pub wrong: Vec<String>,
    /// All that is wrong, listed or not.
    pub wrong_count: u64,
    pub errors: u64,
    pub warnings: u64,
    pub job: Option<Job>,
}

impl Entry {
    fn of(document: Document) -> Entry {
        let wrong = document.wrong().take(TOLD_MAX).map(|sentence| short(&sentence)).collect();
        Entry {
            wrong,
            wrong_count: document.wrong_count(),
            file: document.file,
            machine: document.machine,
            machine_sha256: document.machine_sha256,
            tool: document.tool,
            verdict: document.verdict,
            errors: document.errors,
            warnings: document.warnings,
            job: document.job,
        }
    }
}

/// A line of text, not too long.
fn short(text: &str) -> String {
    let letters = || text.chars().filter(|letter| !letter.is_control());
    let more = letters().nth(LETTERS_MAX).map(|_| '…');
    letters().take(LETTERS_MAX).chain(more).collect()
}

/// Reads the documents of a file, one or more, and hands each on, or what is wrong with it and in which line.
/// Behind what is no JSON nothing is read.
pub fn documents(file: &Path, mut take: impl FnMut(Result<Entry, String>)) {
    input::has_read(file);
    if file == Path::new("-") {
        return documents_of(io::stdin().lock(), file, take);
    }
    match File::open(file) {
        Ok(reader) => documents_of(BufReader::with_capacity(1 << 16, reader), file, take),
        Err(error) => take(Err(told(&error.into()))),
    }
}

fn documents_of(reader: impl Read, file: &Path, mut take: impl FnMut(Result<Entry, String>)) {
    let lines = Rc::new(Cell::new(1));
    let counted = Counted { reader, lines: Rc::clone(&lines) };
    let mut is_empty = true;
    for value in serde_json::Deserializer::from_reader(counted).into_iter::<Value>() {
        is_empty = false;
        take(match value {
            Ok(value) => entry(value, lines.get()),
            Err(error) => Err(format!(
                "{NO_RESULT}: {} (nothing behind it is read)",
                short(&error.to_string())
            )),
        });
    }
    if is_empty {
        take(Err(format!("it is empty{}", said(file))));
    }
}

/// What is kept of a document that ends in a line, or why it is no result.
fn entry(value: Value, line: u64) -> Result<Entry, String> {
    if let ("error", Some(error)) =
        (value["result"].as_str().unwrap_or_default(), value["error"].as_str())
    {
        return Err(format!("it tells why there is none: {}", short(error)));
    }
    let fault = match serde_json::from_value::<Document>(value) {
        Ok(document) => match document.fault() {
            None => return Ok(Entry::of(document)),
            Some(fault) => fault,
        },
        Err(error) => short(&error.to_string()),
    };
    Err(format!("{NO_RESULT}: line {line}: {fault}"))
}

/// Counts the lines of what is read; serde_json takes one byte at a time.
struct Counted<R> {
    reader: R,
    /// The line that was read last, from 1.
    lines: Rc<Cell<u64>>,
}

impl<R: Read> Read for Counted<R> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let read = self.reader.read(bytes)?;
        let ends = bytes[..read].iter().filter(|byte| **byte == b'\n').count();
        self.lines.set(self.lines.get() + ends as u64);
        Ok(read)
    }
}

/// What the job said that left no result: its standard error, where GNU parallel keeps it.
fn said(file: &Path) -> String {
    let mut errors = file.as_os_str().to_owned();
    errors.push(".err");
    let text = std::fs::read(errors).unwrap_or_default();
    let text = String::from_utf8_lossy(&text);
    let line = text.lines().map(str::trim).find(|line| !line.is_empty());
    line.map_or(String::new(), |line| format!("; its job said: {}", short(line)))
}
