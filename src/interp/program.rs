//! The programs of one file: where each begins, and the bodies of those that are called.
//!
//! A file is read through for its O words at the first call. A body is parsed once and kept,
//! however often it runs; what is kept is bounded.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::io;
use std::rc::Rc;

use crate::base::Source;
use crate::gcode::codes::{self, Op};
use crate::gcode::{Block, Fault, LINE_BYTES_MAX, Line, Lines, Word, parse, rules};

use super::findings::{Findings, Place};

/// Most blocks of called subprograms that are kept: about 16 MB.
const BLOCKS_MAX: usize = 50_000;

/// A subprogram, parsed.
#[derive(Debug)]
pub(super) struct Body {
    pub number: u32,
    blocks: Vec<Stored>,
    text: Vec<u8>,
}

#[derive(Debug)]
struct Stored {
    line: u32,
    block: Block,
    text: (usize, usize),
}

impl Body {
    /// A block, its line and that line's text.
    pub fn get(&self, at: usize) -> Option<(&Block, u32, &[u8])> {
        let stored = self.blocks.get(at)?;
        Some((&stored.block, stored.line, &self.text[stored.text.0..stored.text.1]))
    }
}

/// The programs of a file.
#[derive(Debug)]
pub(super) struct Library {
    source: Source,
    /// Where the line with each O word begins, and its number; empty until the first call.
    places: Option<HashMap<u32, (u64, u32)>>,
    /// Bodies by program number; none for one that cannot be run.
    bodies: HashMap<u32, Option<Rc<Body>>>,
    blocks_kept: usize,
}

/// Whether a program's text, at least up to its first `%`, was the beginning or the end.
#[derive(Debug, Default)]
pub(super) struct Tape {
    has_begun: bool,
}

impl Tape {
    /// Takes a block; tells whether it is the `%` that ends the text.
    pub fn ends_at(&mut self, block: &Block) -> bool {
        let ends = block.percent && self.has_begun;
        self.has_begun |= !block.is_empty();
        ends
    }
}

/// The program number that a block begins with.
pub(super) fn program_number(block: &Block) -> Option<(u32, &Word)> {
    let word = block.word(b'O')?;
    let is_number = word.value.fract() == 0.0 && word.value >= 0.0;
    is_number.then_some((word.value as u32, word))
}

/// Parses a line, and reports one that is too long.
pub(super) fn parse_line(line: &Line<'_>, block: &mut Block, faults: &mut Vec<Fault>) {
    if line.too_long {
        block.clear();
        let message = format!("line {} is longer than {LINE_BYTES_MAX} bytes", line.number);
        let fault = Fault::new(&rules::LINE_TOO_LONG, 0, 1, message);
        faults.push(fault.help("NC programs have short lines: is this the right file?"));
    } else {
        parse(line.bytes, block, faults);
    }
}

impl Library {
    pub fn new(source: &Source) -> Library {
        Library { source: source.clone(), places: None, bodies: HashMap::new(), blocks_kept: 0 }
    }

    /// Whether a program's body has been read, and its faults reported.
    pub fn has_read(&self, number: u32) -> bool {
        self.bodies.contains_key(&number)
    }

    /// The body of a program; none if the file holds none, or none that can be run. Reports what
    /// is wrong with it the first time.
    pub fn body(&mut self, number: u32, findings: &mut Findings) -> io::Result<Found> {
        if self.places.is_none() {
            self.places = Some(self.index(findings)?);
        }
        if let Some(body) = self.bodies.get(&number) {
            return Ok(body.clone().map_or(Found::Faulty, Found::Body));
        }
        let Some(place) = self.places.as_ref().and_then(|places| places.get(&number)).copied()
        else {
            return Ok(Found::Nothing);
        };
        let body = self.read(number, place, findings)?.map(Rc::new);
        self.bodies.insert(number, body.clone());
        Ok(body.map_or(Found::Faulty, Found::Body))
    }

    /// Numbers of the programs that can be called, in ascending order.
    pub fn numbers(&self) -> Vec<u32> {
        let mut numbers: Vec<u32> = self.places.iter().flat_map(HashMap::keys).copied().collect();
        numbers.sort_unstable();
        numbers
    }

    /// Finds all O words up to the end of the text.
    fn index(&self, findings: &mut Findings) -> io::Result<HashMap<u32, (u64, u32)>> {
        let mut lines = Lines::new(self.source.reader(0), 0, 1);
        let (mut block, mut tape) = (Block::default(), Tape::default());
        let mut places: HashMap<u32, (u64, u32)> = HashMap::new();
        let mut faults = Vec::new();
        while let Some(line) = lines.next_line()? {
            // Faults are reported where the line is run or checked.
            parse_line(&line, &mut block, &mut faults);
            faults.clear();
            if tape.ends_at(&block) {
                break;
            }
            let Some((number, word)) = program_number(&block) else { continue };
            match places.entry(number) {
                Entry::Vacant(entry) => {
                    entry.insert((line.offset, line.number));
                }
                Entry::Occupied(first) => {
                    let message = format!("O{number} stands on line {} already", first.get().1);
                    let fault = Fault::word(&rules::DUPLICATE_PROGRAM, word, message);
                    let place = Place { line: line.number, text: line.bytes, calls: &[] };
                    findings.add(fault.help("give each program a number of its own"), place);
                }
            }
        }
        Ok(places)
    }

    /// Reads the program that begins at a line, up to its M99.
    fn read(
        &mut self,
        number: u32,
        (offset, line): (u64, u32),
        findings: &mut Findings,
    ) -> io::Result<Option<Body>> {
        let mut lines = Lines::new(self.source.reader(offset), offset, line);
        let mut body = Body { number, blocks: Vec::new(), text: Vec::new() };
        let (mut block, mut faults) = (Block::default(), Vec::new());
        let mut first = Vec::new();
        let mut is_faulty = false;
        while let Some(line) = lines.next_line()? {
            parse_line(&line, &mut block, &mut faults);
            let place = Place { line: line.number, text: line.bytes, calls: &[] };
            is_faulty |= !faults.is_empty();
            findings.take(&mut faults, place);
            if first.is_empty() {
                first = line.bytes.to_vec();
            } else if block.has(b'O') || block.percent {
                break;
            }
            if block.is_empty() {
                continue;
            }
            self.blocks_kept += 1;
            if self.blocks_kept > BLOCKS_MAX {
                let message =
                    format!("the subprograms that are called hold over {BLOCKS_MAX} blocks");
                let fault = Fault::block(&rules::SUBPROGRAM_SIZE, &block, message);
                findings.add(
                    fault.help("call them from a main program in pieces, or write them out"),
                    place,
                );
                return Ok(None);
            }
            let begin = body.text.len();
            body.text.extend_from_slice(line.bytes);
            let returns = returns(&block);
            body.blocks.push(Stored {
                line: line.number,
                block: block.clone(),
                text: (begin, body.text.len()),
            });
            if returns {
                return Ok((!is_faulty).then_some(body));
            }
        }
        let message = format!("the subprogram O{number} has no M99");
        let fault = Fault::new(&rules::MISSING_RETURN, 0, first.len() as u32, message);
        findings
            .add(fault.help("end it by a block of M99"), Place { line, text: &first, calls: &[] });
        Ok(None)
    }
}

/// Whether a block ends its subprogram, or the whole program.
fn returns(block: &Block) -> bool {
    block.words().iter().filter(|word| word.letter == b'M').any(|word| {
        let op = codes::find(b'M', word.value).and_then(|code| code.op);
        matches!(op, Some(Op::Return | Op::End | Op::EndAndRewind))
    })
}

/// What there is of a subprogram.
pub(super) enum Found {
    /// It can be run.
    Body(Rc<Body>),
    /// It has faults, which have been reported.
    Faulty,
    /// The file does not hold it.
    Nothing,
}
