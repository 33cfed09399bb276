//! A run of a program: block after block from the main program and the subprograms it calls.
//!
//! The main program is read as it runs and kept nowhere. What may run again is kept: subprograms,
//! the loops and branches of the main program, and the main program itself once a GOTO in it is
//! taken. Where these lead is in [`super::flow`].

use std::io::{self, Read};
use std::rc::Rc;

use crate::base::{CallSite, Machine, Source};
use crate::gcode::{Block, Fault, LINE_BYTES_MAX, Label, Lines, rules};

use super::body::Body;
use super::engine::Engine;
use super::execute::is_error;
use super::findings::Place;
use super::flow::Flow;
use super::hashed::HashedReader;
use super::macros::ModalMacro;
use super::motion::Motion;
use super::program::{
    Library, Tape, TextOptions, acts, misplaced_title, next_block, program_number,
};
use super::turns::Awaited;
use super::{Dialect, MAX_PASSES, Options};

/// What is being run from what is kept.
#[derive(Debug)]
pub(super) struct Frame {
    pub body: Rc<Body>,
    pub next: usize,
    pub kind: FrameKind,
    /// Passes that are left to `repeat`, by the place where it stands.
    pub repeats: Vec<(usize, u64)>,
}

/// Why something is being run from what is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FrameKind {
    /// A loop or a branch of the main program, which is read on behind it.
    Section,
    /// The main program.
    Main,
    /// A subprogram, from a block of it on; `has_scope`: with parameters of its own.
    Call { has_scope: bool, repeats_left: u32, start: usize },
}

/// How the main program has come to its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    /// It has not.
    Running,
    /// M2, M30 or M99: more programs may follow.
    Word,
    /// The O word of the next program.
    NextProgram,
    /// It was given up: what it does next cannot be told, or is too much.
    GivenUp,
    /// The closing `%`, or the end of the text.
    Text,
    /// Bytes that are no text: nothing after them is worth reading.
    NotText,
}

/// Work that what is kept may make in a run, at least: some minutes of a check. A block counts one,
/// and one more for every [`WORK_BYTES`] of its text; a move counts [`WORK_OF_MOVE`].
const WORK_MAX: u64 = 1_000_000_000;
const WORK_BYTES: usize = 64;
const WORK_OF_MOVE: u64 = 10;

/// Work for each pass that loops may make, where that is more.
const WORK_OF_PASS: u64 = 100;

/// Blocks of loops and subprograms between two looks at whether the run is still wanted.
const STEPS_UNWATCHED: u64 = 4096;

/// A run of a program.
#[derive(Debug)]
pub(super) struct Run<'a> {
    pub engine: Engine<'a>,
    pub lines: Lines<HashedReader>,
    pub library: Library,
    source: Source,
    pub tape: Tape,
    pub end: End,
    /// The block read last from the main program's text.
    pub block: Block,
    /// Whether what follows the main program begins inside of another one.
    pub rest_in_program: bool,
    pub text: TextOptions,
    /// Typed blocks need no end.
    typed: bool,
    pub(super) dialect: Dialect,
    pub(super) max_passes: u64,
    pub(super) passes: u64,
    /// Blocks of loops and subprograms, which are not read again.
    steps_in_bodies: u64,
    /// Work that subprograms, loops and branches have made, and may make.
    work: u64,
    work_max: u64,
    pub(super) main_label: Option<Label>,
    /// Whether the next title begins another program.
    has_acted: bool,
    pub(super) frames: Vec<Frame>,
    /// Where each call that is being run was made.
    pub(super) calls: Rc<Vec<CallSite>>,
    pub(super) calls_made: u64,
    /// What is wrong with subprograms that have been passed over, until they are called.
    pub(super) passed_over: Vec<PassedOver>,
    /// The lathe cycle whose contour is being read.
    pub(super) awaited: Option<Awaited>,
    /// The macro that every move calls.
    pub(super) modal_macro: Option<ModalMacro>,
}

/// A line with faults in a subprogram that stood in the way.
#[derive(Debug)]
pub(super) struct PassedOver {
    pub label: Label,
    pub line: u32,
    pub text: Vec<u8>,
    pub faults: Vec<Fault>,
}

impl<'a> Run<'a> {
    pub fn new(source: &Source, machine: &'a Machine, options: &Options, max: usize) -> Run<'a> {
        let text = TextOptions { block_delete: options.block_delete, lenient: options.lenient };
        let max_passes = options.max_passes.unwrap_or(MAX_PASSES);
        Run {
            engine: Engine::new(machine, options, max),
            lines: Lines::new(HashedReader::unhashed(source), 0, 1),
            library: Library::new(source, &options.folders, text),
            tape: Tape::default(),
            end: End::Running,
            block: Block::default(),
            source: source.clone(),
            rest_in_program: false,
            text,
            typed: options.typed,
            dialect: options.dialect,
            max_passes,
            passes: 0,
            steps_in_bodies: 0,
            work: 0,
            work_max: max_passes.saturating_mul(WORK_OF_PASS).max(WORK_MAX),
            main_label: None,
            has_acted: false,
            frames: Vec::new(),
            calls: Rc::default(),
            calls_made: 0,
            passed_over: Vec::new(),
            awaited: None,
            modal_macro: None,
        }
    }

    /// Runs one block and appends what it makes; false once the program is over.
    ///
    /// # Errors
    /// When the text, or the file of a subprogram, cannot be read.
    pub fn step(&mut self, motions: &mut Vec<Motion>) -> io::Result<bool> {
        if self.end != End::Running {
            return Ok(false);
        }
        let file = self.frames.last().and_then(|frame| frame.body.file_name.clone());
        if self.frames.is_empty() {
            self.step_main(motions)?;
        } else {
            self.step_body(motions)?;
            self.end_contour(motions);
            self.steps_in_bodies += 1;
            if self.steps_in_bodies.is_multiple_of(STEPS_UNWATCHED) {
                self.source.go_on()?;
            }
        }
        self.engine.stop(motions);
        self.engine.restore_after_call(&self.calls, file.as_deref(), motions);
        if self.end != End::Running {
            self.finish(motions);
        }
        Ok(true)
    }

    /// Gives out what the executor holds until it knows what follows.
    #[inline(never)]
    fn finish(&mut self, motions: &mut Vec<Motion>) {
        let line = self.lines.number().max(1);
        let place = Place { line, text: b"", calls: &[], file: None };
        self.engine.finish(&place, motions);
        self.engine.report(&place, false);
    }

    fn step_main(&mut self, motions: &mut Vec<Motion>) -> io::Result<()> {
        let engine = &mut self.engine;
        let read = next_block(&mut self.lines, &mut self.block, &mut engine.faults, self.text)?;
        let Some(line) = read else {
            self.end = End::Text;
            return self.missing_end(false);
        };
        engine.judge_delete(&self.block);
        let place = Place { line: line.number, text: line.bytes, calls: &[], file: None };
        let (mut flow, first) = (Flow::Next, motions.len());
        // Most lines: nothing but words, and none that could begin a program.
        if self.block.is_words_only() && !self.block.has(b'O') && engine.faults.is_empty() {
            self.tape.begin();
            self.has_acted = true;
            flow = engine.execute(&self.block, &place, motions);
        } else if engine.faults.iter().any(|fault| fault.rule == &rules::NOT_TEXT) {
            self.end = End::NotText;
        } else if self.tape.ends_at(&self.block) {
            self.end = End::Text;
        } else if !self.block.is_empty() && !self.block.percent {
            if let Some((number, _)) = program_number(&self.block) {
                let label = Label::Number(number);
                if self.has_acted {
                    // What is wrong with a body that was called has been reported with it.
                    if self.library.has_read(&label) {
                        engine.faults.clear();
                    } else {
                        engine.executor.check_codes(&self.block, &mut engine.faults);
                    }
                    engine.report(&place, false);
                    self.end = End::NextProgram;
                    return self.missing_end(true);
                }
                self.main_label = Some(label);
            }
            engine.faults.extend(misplaced_title(&self.block).filter(|_| self.has_acted));
            self.has_acted |= acts(&self.block);
            flow = match self.block.statement() {
                _ if self.block.is_broken_statement() => Flow::Unreadable,
                Some(_) if engine.faults.iter().any(is_error) => Flow::Unreadable,
                Some(_) => Flow::Statement,
                None => engine.execute(&self.block, &place, motions),
            };
        }
        engine.report(&place, false);
        if let Some(modal) = &mut self.modal_macro {
            flow = modal.flow_after(flow, &motions[first..], 0);
        }
        if flow == Flow::Next {
            return Ok(());
        }
        let (number, text) = (place.line, place.text.to_vec());
        let block = self.block.clone();
        let place = Place { line: number, text: &text, calls: &[], file: None };
        match flow {
            Flow::Unreadable => {
                self.end = End::GivenUp;
                Ok(())
            }
            Flow::Statement => self.statement_of_main(&block, place),
            flow => self.follow(flow, &block, place, motions),
        }
    }

    fn step_body(&mut self, motions: &mut Vec<Motion>) -> io::Result<()> {
        let Some(frame) = self.frames.last_mut() else { return Ok(()) };
        let at = frame.next;
        frame.next += 1;
        let Some((block, line, text)) = frame.body.get(at) else {
            return self.end_of_frame();
        };
        let file = frame.body.file_name.as_deref();
        let place = Place { line, text, calls: &self.calls, file };
        self.work += 1 + (text.len() / WORK_BYTES) as u64;
        let mut flow = Flow::Statement;
        if self.work <= self.work_max {
            self.engine.judge_delete(block);
            if block.statement().is_none() {
                self.has_acted = true;
                let first = motions.len();
                flow = self.engine.execute(block, &place, motions);
                self.engine.report(&place, true);
                self.work += (motions.len() - first) as u64 * WORK_OF_MOVE;
                if let Some(modal) = &mut self.modal_macro {
                    flow = modal.flow_after(flow, &motions[first..], self.calls.len());
                }
            }
        }
        if flow == Flow::Next && self.work <= self.work_max {
            return Ok(());
        }
        let (body, calls) = (Rc::clone(&frame.body), Rc::clone(&self.calls));
        self.lead_on(flow, at, &body, &calls, motions)
    }

    /// Goes where a block of something kept leads, unless there has been too much work.
    fn lead_on(
        &mut self,
        flow: Flow,
        at: usize,
        body: &Rc<Body>,
        calls: &[CallSite],
        motions: &mut Vec<Motion>,
    ) -> io::Result<()> {
        let Some((block, line, text)) = body.get(at) else { return Ok(()) };
        let place = Place { line, text, calls, file: body.file_name.as_deref() };
        if self.work > self.work_max {
            self.refuse_work(&place);
            return Ok(());
        }
        if flow != Flow::Statement {
            return self.follow(flow, block, place, motions);
        }
        self.engine.blocks += 1;
        self.engine.executor.line = line;
        let result = self.statement(body, at, block, &place);
        self.engine.report(&place, true);
        result
    }

    /// Reports that what may run again has made too much work.
    #[cold]
    fn refuse_work(&mut self, place: &Place<'_>) {
        let message = format!(
            "subprograms and loops have run over {} blocks up to here, a move counted as \
             {WORK_OF_MOVE}",
            self.work_max
        );
        let fault = Fault::new(&rules::MAX_PASSES, 0, place.text.len() as u32, message);
        let help = "is a count of calls, of repeats or of cuts too great?";
        self.engine.findings.add(fault.help(help), *place);
        self.end = End::GivenUp;
    }

    /// Goes where a block leads.
    #[inline(never)]
    fn follow(
        &mut self,
        flow: Flow,
        block: &Block,
        place: Place<'_>,
        motions: &mut Vec<Motion>,
    ) -> io::Result<()> {
        match flow {
            Flow::Turn(turn) => self.turn(turn, block, place)?,
            Flow::Stock { stock, first, last } => {
                self.stock((stock, first, last), block, place, motions)?;
            }
            Flow::Next | Flow::Statement | Flow::Unreadable => {}
            Flow::End => self.end = End::Word,
            Flow::Alarm => self.end = End::GivenUp,
            Flow::Return(_) if !self.is_in_call() => {
                self.end = End::Word;
                let message = "M99 ends this main program; other controls begin it anew for ever";
                let fault = Fault::block(&rules::MISSING_END, block, message);
                self.engine.findings.add(fault.help("write M2 or M30"), place);
            }
            Flow::Return(target) => self.return_to(target, block, place)?,
            Flow::Call { number, repeats } => {
                // `P51000` without L: the last four digits are the program, the others say how often.
                let is_joined = self.dialect.is_fanuc()
                    && number > 9999
                    && !block.has(b'L')
                    && block.call.is_none();
                let (number, repeats) =
                    if is_joined { (number % 10_000, number / 10_000) } else { (number, repeats) };
                self.call(&Label::Number(number), repeats, None, block, place)?;
            }
            Flow::ModalMacroBegin { number, repeats } => self.begin_modal_macro(number, repeats),
            Flow::ModalMacroEnd => self.modal_macro = None,
            Flow::ModalMacro => self.call_modal_macro(block, place)?,
            Flow::CallBlocks { number, repeats } => {
                self.call_blocks(number, repeats, block, place)?;
            }
            Flow::MacroCall { number, repeats } => {
                let arguments =
                    self.engine.computed().map(super::parameters::arguments).unwrap_or_default();
                self.call(&Label::Number(number), repeats, Some((&arguments, true)), block, place)?;
            }
        }
        Ok(())
    }

    /// Goes on behind what has come to its end.
    fn end_of_frame(&mut self) -> io::Result<()> {
        match self.frames.last().map(|frame| frame.kind) {
            Some(FrameKind::Section) => {
                self.frames.pop();
            }
            Some(FrameKind::Main) => {
                self.end = if self.rest_in_program { End::NextProgram } else { End::Text };
                if !self.block.percent {
                    return self.missing_end(self.rest_in_program);
                }
            }
            Some(FrameKind::Call { .. }) | None => self.leave(),
        }
        Ok(())
    }

    /// Warns of a main program without an end, unless it has no block at all; `is_over`: the line
    /// read last is no part of it any more.
    #[inline(never)]
    fn missing_end(&mut self, is_over: bool) -> io::Result<()> {
        // What is run a second time has been warned of.
        if !self.typed && self.engine.blocks > 0 && self.engine.travel.is_some() {
            let (number, text) = self.last_line(is_over)?;
            let message = "the program ends here, without M2, M30 or a closing %";
            let place = Place { line: number, text: &text, calls: &[], file: None };
            let fault = Fault::new(&rules::MISSING_END, 0, text.len() as u32, message);
            self.engine.findings.add(fault.help("end it by a block of M30"), place);
        }
        Ok(())
    }

    /// The last line up to where the text has been read that is not blank, and its number;
    /// `is_over`: without the line read last.
    fn last_line(&self, is_over: bool) -> io::Result<(u32, Vec<u8>)> {
        let end = self.lines.offset();
        let begin = end.saturating_sub(LINE_BYTES_MAX as u64);
        let mut lines = Lines::new(self.source.reader(begin).take(end - begin), begin, 1);
        let mut found = [(0, Vec::new()), (0, Vec::new())];
        while let Some(line) = lines.next_line()? {
            if !line.bytes.trim_ascii().is_empty() {
                found.swap(0, 1);
                found[1] = (line.number, line.bytes.trim_ascii_end().to_vec());
            }
        }
        let behind = lines.number();
        let [before, last] = found;
        let (number, text) = if is_over { before } else { last };
        Ok((self.lines.number().saturating_sub(behind - number).max(1), text))
    }
}
