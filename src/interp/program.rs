//! The programs of a file, and of the files beside it: where each begins, and the bodies of those
//! that are called.
//!
//! A file is read through for its programs at the first call. A body is parsed once and kept,
//! however often it runs; what is kept is bounded.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::io::{self, Read};
use std::path::PathBuf;
use std::rc::Rc;

use crate::base::Source;
use crate::gcode::codes::{self, Op};
use crate::gcode::{Block, Control, Fault, Label, Line, Lines, Statement, Word, parse_next, rules};

use super::body::{Body, Linker};
use super::execute::is_error;
use super::findings::{Findings, Place};
use super::hashed::HashedReader;
use super::inputs::{Inputs, Opened};
use super::lenient::{foreign_line, leave_out};

/// Most blocks that are kept, of subprograms and of loops, as [`Body::size`] counts them: about 20 MB.
pub(super) const BLOCKS_MAX: usize = 50_000;

/// Subprograms of a file at most.
const PROGRAMS_MAX: usize = 100_000;

/// Where a program begins.
#[derive(Clone, Copy, Debug)]
struct Spot {
    offset: u64,
    line: u32,
    /// Whether it is `O100 sub` up to `O100 endsub`; else it is `O100` up to the next program.
    is_sub: bool,
}

type Spots = HashMap<Label, Spot>;

/// The programs that can be called.
#[derive(Debug)]
pub(super) struct Library {
    source: Source,
    reading: TextOptions,
    pub inputs: Inputs,
    /// Where programs begin, by file: the program's own first, then the inputs; none where that
    /// has not been asked yet.
    spots: Vec<Option<Spots>>,
    /// Bodies by file and label; none for one that cannot be run.
    bodies: HashMap<(usize, Label), Option<Rc<Body>>>,
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

    /// Takes a block that is no `%`, and not empty.
    pub fn begin(&mut self) {
        self.has_begun = true;
    }
}

/// The program number that a block begins with.
pub(super) fn program_number(block: &Block) -> Option<(u32, &Word)> {
    let word = block.word(b'O')?;
    let is_number = word.value.fract() == 0.0 && word.value >= 0.0;
    is_number.then_some((word.value as u32, word))
}

/// The fault of `O<name>` alone where it is no title of the main program: a call is meant, as a rule.
pub(super) fn misplaced_title(block: &Block) -> Option<Fault> {
    let title = block.statement().filter(|statement| statement.control == Control::Title)?;
    let message = format!("{} alone is a title: no program begins here", title.label);
    let fault = Fault::new(&rules::EXPRESSION, title.start, title.end, message);
    Some(fault.help(format!("to call it write {} call", title.label)))
}

/// Whether a block does more than set parameters and lead elsewhere. Before the first that does, a
/// title is that of the main program: subprograms may stand above it.
pub(super) fn acts(block: &Block) -> bool {
    let is_title = |statement: &Statement| statement.control == Control::Title;
    !block.words().is_empty() || block.call.is_some() || block.statement().is_some_and(is_title)
}

/// How text is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct TextOptions {
    /// A line that begins with `/` is blank.
    pub block_delete: bool,
    /// Words of other controls that mean nothing here are left out.
    pub lenient: bool,
}

/// Reads the next line into a block; none at the end of the text.
pub(super) fn next_block<'l>(
    lines: &'l mut Lines<impl Read>,
    block: &mut Block,
    faults: &mut Vec<Fault>,
    options: TextOptions,
) -> io::Result<Option<Line<'l>>> {
    let faults_before = faults.len();
    let Some(line) = parse_next(lines, block, faults)? else { return Ok(None) };
    if options.lenient && !line.too_long {
        if let Some(fault) = foreign_line(line.bytes) {
            block.clear();
            faults.truncate(faults_before);
            faults.push(fault);
        } else {
            leave_out(block, faults);
        }
    }
    if options.block_delete && block.delete {
        block.clear();
        faults.truncate(faults_before);
    }
    Ok(Some(line))
}

impl Library {
    pub fn new(source: &Source, folders: &[PathBuf], text: TextOptions) -> Library {
        Library {
            source: source.clone(),
            reading: text,
            inputs: Inputs::new(folders),
            spots: vec![None],
            bodies: HashMap::new(),
            blocks_kept: 0,
        }
    }

    /// Whether the body of a program of the main file has been read, and its faults reported.
    pub fn has_read(&self, label: &Label) -> bool {
        self.bodies.contains_key(&(0, label.clone()))
    }

    /// The body of a program that is called from a file: of that file, of the main file, or of a
    /// file of its own. Reports what is wrong with it the first time.
    pub fn body(
        &mut self,
        label: &Label,
        from: usize,
        findings: &mut Findings,
    ) -> io::Result<Found> {
        for file in [from, 0] {
            if let Some(spot) = self.spots(file, findings)?.get(label).copied() {
                return self.known(label, file, spot, findings);
            }
        }
        let file = match self.inputs.open(label)? {
            Opened::Input(at) => at + 1,
            Opened::Outside(name) => return Ok(Found::Outside(name)),
            Opened::Nothing => return Ok(Found::Nothing),
        };
        if self.spots.len() <= file {
            self.spots.resize(file + 1, None);
        }
        // A file without the label is the subprogram from its beginning on.
        let whole = Spot { offset: 0, line: 1, is_sub: false };
        let spot = self.spots(file, findings)?.get(label).copied().unwrap_or(whole);
        self.known(label, file, spot, findings)
    }

    fn known(
        &mut self,
        label: &Label,
        file: usize,
        spot: Spot,
        findings: &mut Findings,
    ) -> io::Result<Found> {
        let key = (file, label.clone());
        let body = match self.bodies.get(&key) {
            Some(body) => body.clone(),
            None => {
                let body = self.read(label, file, spot, findings)?.map(Rc::new);
                self.bodies.insert(key, body.clone());
                body
            }
        };
        Ok(body.map_or(Found::Faulty, Found::Body))
    }

    /// Numbers and names of the programs of the main file, in order.
    pub fn labels(&self) -> Vec<String> {
        let spots = self.spots.first().and_then(Option::as_ref);
        let mut labels: Vec<&Label> = spots.into_iter().flat_map(HashMap::keys).collect();
        labels.sort_unstable_by_key(|label| match label {
            Label::Number(number) => (*number, ""),
            Label::Name(name) => (u32::MAX, &**name),
        });
        labels.into_iter().map(Label::to_string).collect()
    }

    fn source(&self, file: usize) -> (&Source, Option<Rc<str>>) {
        match file.checked_sub(1).and_then(|at| self.inputs.list.get(at)) {
            Some(input) => (&input.source, Some(Rc::from(input.source.name()))),
            None => (&self.source, None),
        }
    }

    /// Where the programs of a file begin.
    fn spots(&mut self, file: usize, findings: &mut Findings) -> io::Result<&Spots> {
        if self.spots.get(file).is_none_or(Option::is_none) {
            let spots = self.index(file, findings)?;
            if let Some(place) = self.spots.get_mut(file) {
                *place = Some(spots);
            }
        }
        self.spots
            .get(file)
            .and_then(Option::as_ref)
            .ok_or_else(|| io::Error::other("a file that was read is gone"))
    }

    /// Finds all programs up to the end of a text.
    fn index(&self, file: usize, findings: &mut Findings) -> io::Result<Spots> {
        let (source, file_name) = self.source(file);
        let mut lines = Lines::new(source.reader(0), 0, 1);
        let (mut block, mut tape) = (Block::default(), Tape::default());
        let mut spots = Spots::new();
        let mut faults = Vec::new();
        while let Some(line) = next_block(&mut lines, &mut block, &mut faults, self.reading)? {
            // They are reported where the line is run or checked.
            faults.clear();
            if tape.ends_at(&block) {
                break;
            }
            let Some((label, start, end, is_sub)) = beginning(&block) else { continue };
            if spots.len() == PROGRAMS_MAX {
                let message = format!("this file holds more than {PROGRAMS_MAX} subprograms");
                let fault = Fault::new(&rules::SUBPROGRAM_SIZE, start, end, message);
                let file = file_name.as_deref();
                let place = Place { line: line.number, text: line.bytes, calls: &[], file };
                findings.add(fault.help("put them into several files"), place);
                break;
            }
            let spot = Spot { offset: line.offset, line: line.number, is_sub };
            match spots.entry(label) {
                Entry::Vacant(entry) => {
                    entry.insert(spot);
                }
                Entry::Occupied(first) => {
                    let message =
                        format!("{} stands on line {} already", first.key(), first.get().line);
                    let fault = Fault::new(&rules::DUPLICATE_PROGRAM, start, end, message);
                    let place = Place {
                        line: line.number,
                        text: line.bytes,
                        calls: &[],
                        file: file_name.as_deref(),
                    };
                    findings.add(fault.help("give each program a number of its own"), place);
                }
            }
        }
        Ok(spots)
    }

    /// Reads a program: a sub up to its endsub, another one up to the next.
    fn read(
        &mut self,
        label: &Label,
        file: usize,
        spot: Spot,
        findings: &mut Findings,
    ) -> io::Result<Option<Body>> {
        let (source, file_name) = self.source(file);
        let mut lines = Lines::new(source.reader(spot.offset), spot.offset, spot.line);
        let body = Body::new(Some(label.clone()), file, file_name);
        let mut reading = Reading::new(body, self.reading);
        let mut first = Vec::new();
        let mut returns = spot.is_sub;
        while let Some(line) = reading.next(&mut lines, findings, 0)? {
            if reading.body.len() <= 1 && first.is_empty() {
                first = line.text;
                if let Some(fault) = other_program(&reading.block, label) {
                    let file = reading.body.file_name.as_deref();
                    findings
                        .add(fault, Place { line: line.number, text: &first, calls: &[], file });
                    return Ok(None);
                }
            }
            returns |= ends_subprogram(&reading.block);
            if spot.is_sub && reading.linker.is_closed() {
                break;
            }
            if self.blocks_kept + reading.body.size() > BLOCKS_MAX {
                reading.too_large(line.number, findings);
                return Ok(None);
            }
        }
        self.blocks_kept += reading.body.size();
        reading.finish(findings);
        if !returns {
            let message = format!("the subprogram {label} has no M99");
            let fault = Fault::new(&rules::MISSING_RETURN, 0, first.len() as u32, message);
            let file = reading.body.file_name.as_deref();
            let place = Place { line: spot.line, text: &first, calls: &[], file };
            findings.add(fault.help("end it by a block of M99"), place);
            return Ok(None);
        }
        Ok((!reading.is_faulty).then_some(reading.body))
    }

    /// Reads the main program whole, from its first line on, for a GOTO may lead anywhere in it.
    /// Faults of lines up to `said` have been reported. Gives the body, where reading has ended,
    /// and the block that ended it; none if it cannot be run.
    pub fn read_main(&mut self, said: u32, findings: &mut Findings) -> io::Result<MainText> {
        let mut lines = Lines::new(HashedReader::new(&self.source), 0, 1);
        let mut reading = Reading::new(Body::new(None, 0, None), self.reading);
        while let Some(line) = reading.next(&mut lines, findings, said)? {
            if self.blocks_kept + reading.body.size() > BLOCKS_MAX {
                reading.too_large(line.number, findings);
                reading.is_faulty = true;
                break;
            }
        }
        self.blocks_kept += reading.body.size();
        reading.finish(findings);
        let body = (!reading.is_faulty).then(|| Rc::new(reading.body));
        Ok(MainText { body, lines, block: reading.block })
    }
}

/// The main program, read whole.
pub(super) struct MainText {
    pub body: Option<Rc<Body>>,
    /// What follows it.
    pub lines: Lines<HashedReader>,
    /// The block that ended it: of the next program, `%`, or blank at the end of the text.
    pub block: Block,
}

/// A line that was added to a body.
pub(super) struct Added {
    pub number: u32,
    pub text: Vec<u8>,
}

/// A body while it is read.
pub(super) struct Reading {
    pub body: Body,
    pub linker: Linker,
    pub is_faulty: bool,
    /// The block read last.
    pub block: Block,
    /// Whether a statement could not be read: what belongs to it cannot be told.
    is_broken: bool,
    /// Whether the next title begins another program.
    has_acted: bool,
    tape: Tape,
    faults: Vec<Fault>,
    text: TextOptions,
}

impl Reading {
    pub fn new(body: Body, text: TextOptions) -> Reading {
        Reading {
            body,
            linker: Linker::default(),
            is_faulty: false,
            block: Block::default(),
            is_broken: false,
            has_acted: false,
            tape: Tape::default(),
            faults: Vec::new(),
            text,
        }
    }

    /// Adds the next line that is not blank; none at the end of the program or of the text.
    pub fn next(
        &mut self,
        lines: &mut Lines<impl Read>,
        findings: &mut Findings,
        said: u32,
    ) -> io::Result<Option<Added>> {
        while let Some(line) = next_block(lines, &mut self.block, &mut self.faults, self.text)? {
            let ends_tape = self.tape.ends_at(&self.block);
            let begins_other = self.has_acted && program_number(&self.block).is_some();
            if ends_tape || begins_other {
                self.faults.clear();
                return Ok(None);
            }
            self.is_faulty |= self.faults.iter().any(is_error);
            let is_blank = self.block.is_empty() || self.block.percent;
            if !is_blank {
                self.add(line.number, line.bytes);
            }
            self.report(line.number, line.bytes, findings, said);
            if !is_blank {
                return Ok(Some(Added { number: line.number, text: line.bytes.to_vec() }));
            }
        }
        self.block.clear();
        Ok(None)
    }

    /// Adds a block that has been read already.
    pub fn begin(&mut self, line: u32, text: &[u8], block: &Block, findings: &mut Findings) {
        self.block.clone_from(block);
        self.has_acted = true;
        self.add(line, text);
        self.report(line, text, findings, 0);
    }

    fn add(&mut self, line: u32, text: &[u8]) {
        self.body.push(line, text, &self.block);
        let misplaced = misplaced_title(&self.block);
        if let Some(fault) = misplaced.filter(|_| self.has_acted || self.body.label.is_some()) {
            self.is_faulty = true;
            self.faults.push(fault);
        }
        self.has_acted |= acts(&self.block);
        self.is_broken |= self.block.is_broken_statement();
        let statement = self.block.statement().filter(|_| !self.is_broken);
        let linked = statement.map_or(Ok(()), |found| self.linker.add(&mut self.body, found));
        if let Err(fault) = linked {
            self.is_faulty = true;
            self.faults.push(fault);
        }
    }

    fn report(&mut self, line: u32, text: &[u8], findings: &mut Findings, said: u32) {
        if line <= said {
            self.faults.clear();
        }
        let place = Place { line, text, calls: &[], file: self.body.file_name.as_deref() };
        findings.take_once(&mut self.faults, place);
    }

    /// Reports what has begun and not ended.
    pub fn finish(&mut self, findings: &mut Findings) {
        if let Some((line, fault)) = self.linker.unfinished().filter(|_| !self.is_broken) {
            self.is_faulty = true;
            let text = self.body.get(self.body.place_of(line)).map_or(&b""[..], |found| found.2);
            let place = Place { line, text, calls: &[], file: self.body.file_name.as_deref() };
            findings.take_once(&mut vec![fault], place);
        }
    }

    /// Reports that there is more than can be kept.
    pub fn too_large(&self, line: u32, findings: &mut Findings) {
        let message = format!("what is called or repeated holds over {BLOCKS_MAX} blocks");
        let fault = Fault::block(&rules::SUBPROGRAM_SIZE, &self.block, message);
        let text = self.body.get(self.body.len().saturating_sub(1)).map_or(&b""[..], |last| last.2);
        let place = Place { line, text, calls: &[], file: self.body.file_name.as_deref() };
        findings.add(fault.help("call it in pieces, or write it out"), place);
    }
}

/// The program that a line begins: its label, where that stands, and whether it is a sub.
fn beginning(block: &Block) -> Option<(Label, u32, u32, bool)> {
    if let Some((number, word)) = program_number(block) {
        return Some((Label::Number(number), word.start, word.end, false));
    }
    let statement = block.statement().filter(|statement| statement.control == Control::Sub)?;
    Some((statement.label.clone(), statement.start, statement.end, true))
}

/// A fault of a file that is to be a subprogram, and begins with another one.
fn other_program(block: &Block, label: &Label) -> Option<Fault> {
    let (other, start, end, _) = beginning(block).filter(|(other, ..)| other != label)?;
    let message = format!("this file holds {other}, and no {label}");
    let fault = Fault::new(&rules::UNKNOWN_SUBPROGRAM, start, end, message);
    Some(fault.help(format!("call {other}, from a file of its name, or write {label} here")))
}

/// Whether a block ends its subprogram, or the whole program.
fn ends_subprogram(block: &Block) -> bool {
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
    /// Its file lies outside of the folders.
    Outside(String),
    /// There is none.
    Nothing,
}
