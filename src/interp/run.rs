//! A run of a program: block after block from the main program and the subprograms it calls.

use std::io;
use std::rc::Rc;

use crate::base::source::SourceReader;
use crate::base::{Machine, Source};
use crate::gcode::{Block, Fault, Lines, rules};

use super::Options;
use super::duration::too_slow;
use super::execute::{Executor, Flow, Output};
use super::findings::{Findings, Place};
use super::motion::Motion;
use super::program::{Body, Found, Library, Tape, parse_line, program_number};
use super::travel::Travel;

/// Calls within calls, at most: as LinuxCNC.
const CALL_DEPTH_MAX: usize = 10;

/// Calls of one run, at most.
const CALLS_MAX: u64 = 1_000_000;

/// A subprogram that is being run.
#[derive(Debug)]
struct Frame {
    body: Rc<Body>,
    next: usize,
    repeats_left: u32,
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
    /// It was given up: too many calls.
    GivenUp,
    /// The closing `%`, or the end of the text.
    Text,
    /// Bytes that are no text: nothing after them is worth reading.
    NotText,
}

/// A run of a program.
#[derive(Debug)]
pub(super) struct Run<'a> {
    pub executor: Executor<'a>,
    pub findings: Findings,
    pub lines: Lines<SourceReader>,
    pub library: Library,
    pub tape: Tape,
    pub end: End,
    /// Blocks executed.
    pub blocks: u64,
    /// Travel, where the run is a check.
    pub travel: Option<Travel>,
    /// The block read last from the main program's text.
    pub block: Block,
    main_number: Option<u32>,
    frames: Vec<Frame>,
    /// The line of each frame's call.
    calls: Vec<u32>,
    calls_made: u64,
    faults: Vec<Fault>,
}

impl<'a> Run<'a> {
    pub fn new(source: &Source, machine: &'a Machine, options: &Options, max: usize) -> Run<'a> {
        Run {
            executor: Executor::new(machine, options),
            findings: Findings::new(max),
            lines: Lines::new(source.reader(0), 0, 1),
            library: Library::new(source),
            tape: Tape::default(),
            end: End::Running,
            blocks: 0,
            travel: None,
            block: Block::default(),
            main_number: None,
            frames: Vec::new(),
            calls: Vec::new(),
            calls_made: 0,
            faults: Vec::new(),
        }
    }

    /// Runs one block and appends what it makes; false once the program is over.
    ///
    /// # Errors
    /// When the text cannot be read.
    pub fn step(&mut self, motions: &mut Vec<Motion>) -> io::Result<bool> {
        if self.end != End::Running {
            return Ok(false);
        }
        if self.frames.is_empty() {
            self.step_main(motions)?
        } else {
            self.step_body(motions)?
        }
        if self.end != End::Running {
            self.finish(motions);
        }
        Ok(true)
    }

    /// Gives out what the executor holds until it knows what follows.
    fn finish(&mut self, motions: &mut Vec<Motion>) {
        let (block, line, first) = (Block::default(), self.lines.number().max(1), motions.len());
        let mut out = Output { line, motions, faults: &mut self.faults };
        self.executor.finish(&block, &mut out);
        let (place, made) = (Place { line, text: b"", calls: &[] }, &motions[first..]);
        judge(&mut self.travel, &self.executor, made, &block, place, &mut self.faults);
        self.findings.take(&mut self.faults, place);
    }

    fn step_main(&mut self, motions: &mut Vec<Motion>) -> io::Result<()> {
        let Some(line) = self.lines.next_line()? else {
            self.end = End::Text;
            self.missing_end();
            return Ok(());
        };
        parse_line(&line, &mut self.block, &mut self.faults);
        let place = Place { line: line.number, text: line.bytes, calls: &[] };
        let mut flow = Flow::Next;
        if self.faults.iter().any(|fault| fault.rule == &rules::NOT_TEXT) {
            self.end = End::NotText;
        } else if self.tape.ends_at(&self.block) {
            self.end = End::Text;
        } else if !self.block.is_empty() && !self.block.percent {
            if let Some((number, _)) = program_number(&self.block) {
                if self.blocks > 0 {
                    // What is wrong with a body that was called has been reported with it.
                    if self.library.has_read(number) {
                        self.faults.clear();
                    } else {
                        self.executor.check_codes(&self.block, &mut self.faults);
                    }
                    self.findings.take(&mut self.faults, place);
                    self.end = End::NextProgram;
                    self.missing_end();
                    return Ok(());
                }
                self.main_number = Some(number);
            }
            self.blocks += 1;
            let mut out = Output { line: line.number, motions, faults: &mut self.faults };
            let first = out.motions.len();
            flow = self.executor.run(&self.block, &mut out);
            let made = &motions[first..];
            let faults = &mut self.faults;
            judge(&mut self.travel, &self.executor, made, &self.block, place, faults);
        }
        if !self.faults.is_empty() {
            self.findings.take(&mut self.faults, place);
        }
        if flow == Flow::Next {
            return Ok(());
        }
        let (number, text) = (place.line, place.text.to_vec());
        let block = std::mem::take(&mut self.block);
        self.follow(flow, &block, Place { line: number, text: &text, calls: &[] })?;
        self.block = block;
        Ok(())
    }

    fn step_body(&mut self, motions: &mut Vec<Motion>) -> io::Result<()> {
        let Some(frame) = self.frames.last_mut() else { return Ok(()) };
        let body = Rc::clone(&frame.body);
        let at = frame.next;
        frame.next += 1;
        let Some((block, line, text)) = body.get(at) else {
            self.leave();
            return Ok(());
        };
        self.blocks += 1;
        let first = motions.len();
        let mut out = Output { line, motions, faults: &mut self.faults };
        let flow = self.executor.run(block, &mut out);
        let calls = std::mem::take(&mut self.calls);
        let place = Place { line, text, calls: &calls };
        let made = &motions[first..];
        judge(&mut self.travel, &self.executor, made, block, place, &mut self.faults);
        if !self.faults.is_empty() {
            self.findings.take(&mut self.faults, place);
        }
        if flow == Flow::Next {
            self.calls = calls;
            return Ok(());
        }
        self.calls.clone_from(&calls);
        self.follow(flow, block, Place { line, text, calls: &calls })
    }

    /// Goes where a block leads.
    fn follow(&mut self, flow: Flow, block: &Block, place: Place<'_>) -> io::Result<()> {
        match flow {
            Flow::Next => {}
            Flow::End => self.end = End::Word,
            Flow::Return if self.frames.is_empty() => {
                self.end = End::Word;
                let message = "M99 ends this main program; other controls begin it anew for ever";
                let fault = Fault::block(&rules::MISSING_END, block, message);
                self.findings.add(fault.help("write M2 or M30"), place);
            }
            Flow::Return => self.leave(),
            Flow::Call { number, repeats } => self.call(number, repeats, block, place)?,
        }
        Ok(())
    }

    /// Ends a pass of the innermost subprogram.
    fn leave(&mut self) {
        let Some(frame) = self.frames.last_mut() else { return };
        if frame.repeats_left > 0 {
            frame.repeats_left -= 1;
            frame.next = 0;
        } else {
            self.frames.pop();
            self.calls.pop();
        }
    }

    fn call(
        &mut self,
        number: u32,
        repeats: u32,
        block: &Block,
        place: Place<'_>,
    ) -> io::Result<()> {
        if repeats == 0 {
            return Ok(());
        }
        let depth = self.frames.len();
        self.enter(number, repeats, block, place)?;
        if self.frames.len() == depth {
            self.executor.forget_position();
        }
        Ok(())
    }

    /// Begins a subprogram, or reports why it cannot be run.
    fn enter(
        &mut self,
        number: u32,
        repeats: u32,
        block: &Block,
        place: Place<'_>,
    ) -> io::Result<()> {
        let chain: Vec<u32> =
            self.main_number.into_iter().chain(self.frames.iter().map(|f| f.body.number)).collect();
        if chain.contains(&number) {
            let names: Vec<String> = chain.iter().map(|n| format!("O{n} calls ")).collect();
            let message = format!("{}O{number}: this never ends", names.concat());
            self.findings.take(&mut vec![Fault::block(&rules::RECURSION, block, message)], place);
            return Ok(());
        }
        if self.frames.len() >= CALL_DEPTH_MAX {
            let message = format!("O{number} is called {CALL_DEPTH_MAX} calls deep already");
            self.findings.take(&mut vec![Fault::block(&rules::CALL_DEPTH, block, message)], place);
            return Ok(());
        }
        self.calls_made += u64::from(repeats);
        if self.calls_made > CALLS_MAX {
            let message = format!("more than {CALLS_MAX} calls: O{number} is not run again");
            self.findings.take(&mut vec![Fault::block(&rules::CALL_COUNT, block, message)], place);
            self.end = End::GivenUp;
            return Ok(());
        }
        match self.library.body(number, &mut self.findings)? {
            Found::Body(body) => {
                self.frames.push(Frame { body, next: 0, repeats_left: repeats - 1 });
                self.calls.push(place.line);
            }
            Found::Faulty => {}
            Found::Nothing => {
                let message = format!("the file holds no subprogram O{number}");
                let fault = Fault::block(&rules::UNKNOWN_SUBPROGRAM, block, message);
                let names: Vec<String> =
                    self.library.numbers().iter().take(10).map(|n| format!("O{n}")).collect();
                let fault = if names.is_empty() {
                    fault.help(format!("write it after M30, as O{number} up to M99"))
                } else {
                    fault.help(format!("it holds {}", names.join(", ")))
                };
                self.findings.take(&mut vec![fault], place);
            }
        }
        Ok(())
    }

    /// Warns of a main program without an end, unless it has no block at all.
    fn missing_end(&mut self) {
        if self.blocks > 0 {
            let message = "the program ends without M2, M30 or a closing %";
            let place = Place { line: self.lines.number(), text: b"", calls: &[] };
            let fault = Fault::new(&rules::MISSING_END, 0, 1, message);
            self.findings.add(fault.help("end it by a block of M30"), place);
        }
    }
}

/// Holds what a block has made against the machine's travel and a day's time, while the program is
/// checked.
fn judge(
    travel: &mut Option<Travel>,
    executor: &Executor<'_>,
    motions: &[Motion],
    block: &Block,
    place: Place<'_>,
    faults: &mut Vec<Fault>,
) {
    let Some(travel) = travel else { return };
    let open = executor.open_axes();
    for motion in motions {
        if let Motion::Move(step) = motion {
            travel.add(step, block, place, open);
            if open.is_empty() {
                faults.extend(too_slow(step, block));
            }
        }
    }
}
