//! Where a program goes on: loops, branches, GOTO, calls and returns.
//!
//! Nothing runs for ever: the passes of all loops of a run together are bounded, so are calls and
//! how deep they lie within each other.

use std::io;
use std::rc::Rc;

use crate::base::CallSite;
use crate::gcode::codes::{Stock, Turn};
use crate::gcode::{Block, Control, Fault, Formula, Label, Statement, rules, short};

use super::Options;
use super::body::{Body, Links, unmatched};
use super::execute::Executor;
use super::findings::Place;
use super::program::{BLOCKS_MAX, Found, Reading, next_block, program_number};
use super::run::{End, Frame, FrameKind, PassedOver, Run};
use super::words::WHOLE_WITHIN;

/// Calls within calls, at most: as LinuxCNC.
pub(super) const CALL_DEPTH_MAX: usize = 10;

/// Calls of one run, at most.
const CALLS_MAX: u64 = 1_000_000;

/// Passes of loops after which a run with errors is given up: what the loop waits for may be what
/// the error has kept from happening.
const PASSES_AFTER_ERROR: u64 = 1_000_000;

/// Calls after which a run with errors is given up: a subprogram that calls itself may do so in
/// every one.
const CALLS_AFTER_ERROR: u64 = 10_000;

/// Arguments of a call, and whether it is one by G65.
pub(super) type Arguments<'a> = (&'a [(u32, f64)], bool);

/// Where execution goes after a block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Flow {
    Next,
    /// Run a subprogram so often.
    Call {
        number: u32,
        repeats: u32,
    },
    /// M99, and the N word to go on at, if it says one.
    Return(Option<u32>),
    /// G65: as a call, with the words of the block as arguments.
    MacroCall {
        number: u32,
        repeats: u32,
    },
    /// G66: the same after every move from here on, up to G67.
    ModalMacroBegin {
        number: u32,
        repeats: u32,
    },
    ModalMacroEnd,
    /// A block that has moved where G66 is in force.
    ModalMacro,
    /// M97: as a call, of the blocks from an N word on.
    CallBlocks {
        number: u32,
        repeats: u32,
    },
    /// A lathe cycle along a contour that stands elsewhere.
    Turn(Turn),
    /// One whose contour are the blocks from one N word to another.
    Stock {
        stock: Stock,
        first: u32,
        last: u32,
    },
    /// M2, M30
    End,
    /// The program has raised an alarm.
    Alarm,
    /// The block is a statement, to be done where its program is known.
    Statement,
    /// It is one with faults: where the program goes on cannot be told.
    Unreadable,
}

impl Run<'_> {
    /// Whether a subprogram is being run.
    pub(super) fn is_in_call(&self) -> bool {
        self.frames.iter().any(|frame| matches!(frame.kind, FrameKind::Call { .. }))
    }

    /// Does what a statement of the main program's text says.
    #[inline(never)]
    pub(super) fn statement_of_main(&mut self, block: &Block, place: Place<'_>) -> io::Result<()> {
        let Some(statement) = block.statement() else { return Ok(()) };
        self.engine.blocks += 1;
        self.engine.executor.line = place.line;
        let result = match &statement.control {
            Control::Sub => self.skip_sub(statement, place),
            Control::If(_)
            | Control::While(_)
            | Control::Do
            | Control::Repeat(_)
            | Control::WhileDo(_) => self.section(block, place),
            Control::Call(_)
            | Control::CallNumber(..)
            | Control::Goto { .. }
            | Control::Then(_) => self.jump(statement, block, place),
            Control::Title => Ok(()),
            _ => {
                let fault =
                    unmatched(statement, "nothing before this has begun what it belongs to");
                self.engine.faults.push(fault);
                Ok(())
            }
        };
        self.engine.report(&place, true);
        result
    }

    /// Does what a statement of something kept says.
    pub(super) fn statement(
        &mut self,
        body: &Rc<Body>,
        at: usize,
        block: &Block,
        place: &Place<'_>,
    ) -> io::Result<()> {
        let Some(statement) = block.statement() else { return Ok(()) };
        let links = body.links(at);
        match &statement.control {
            Control::If(_) => self.branch(body, at),
            // Whoever comes to another arm has run the one before.
            Control::ElseIf(_) | Control::Else => self.go_to(links.end),
            Control::EndIf | Control::Do | Control::Title => {}
            Control::While(condition) if links.end == at => {
                if self.holds(block, *condition) {
                    self.pass(body, links, place);
                }
            }
            Control::While(condition) | Control::WhileDo(Some(condition)) => {
                if !self.holds(block, *condition) {
                    self.go_to(links.end + 1);
                }
            }
            Control::WhileDo(None) => {}
            Control::EndWhile | Control::EndDo => self.pass(body, links, place),
            Control::Repeat(count) => self.begin_repeat(block, *count, at, links),
            Control::EndRepeat => self.end_repeat(body, links, statement, place),
            Control::Break => {
                self.forget_repeat(links.other);
                self.go_to(links.end + 1);
            }
            Control::Continue => self.go_to(links.end),
            Control::Sub if at > 0 => self.go_to(links.end + 1),
            Control::Sub => {}
            Control::EndSub(value) | Control::Return(value) => {
                let value = value.and_then(|value| self.engine.number(block, value));
                self.give_back(statement, value);
            }
            Control::Call(_)
            | Control::CallNumber(..)
            | Control::Goto { .. }
            | Control::Then(_) => {
                self.jump(statement, block, *place)?;
            }
        }
        Ok(())
    }

    /// Calls, GOTO and THEN, which need no place among others.
    fn jump(&mut self, statement: &Statement, block: &Block, place: Place<'_>) -> io::Result<()> {
        match &statement.control {
            Control::Call(formulas) => {
                let arguments = self.engine.arguments(block, formulas);
                self.engine.report(&place, true);
                self.call(&statement.label, 1, Some((&arguments, false)), block, place)
            }
            Control::CallNumber(number, formulas) => {
                let Some(number) = self.engine.number(block, *number) else { return Ok(()) };
                let arguments = self.engine.arguments(block, formulas);
                let Some(number) = self.engine.label_number(number, block) else { return Ok(()) };
                self.engine.report(&place, true);
                let label = Label::Number(number);
                self.call(&label, 1, Some((&arguments, false)), block, place)
            }
            Control::Goto { condition, target } => {
                if condition.is_some_and(|condition| !self.holds(block, condition)) {
                    return Ok(());
                }
                match self.engine.number(block, *target) {
                    Some(number) => self.go_to_number(number, block, place, place.line),
                    None => Ok(()),
                }
            }
            Control::Then(condition) => {
                if self.holds(block, *condition) && self.engine.set(block, &place) {
                    self.end = End::GivenUp;
                }
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Whether a condition holds; one without a value does not.
    fn holds(&mut self, block: &Block, condition: Formula) -> bool {
        self.engine.number(block, condition).is_some_and(|value| value != 0.0)
    }

    pub(super) fn go_to(&mut self, place: usize) {
        if let Some(frame) = self.frames.last_mut() {
            frame.next = place;
        }
    }

    /// Goes to the first arm of a branch whose condition holds.
    fn branch(&mut self, body: &Body, mut at: usize) {
        let end = body.links(at).end;
        while let Some((block, ..)) = body.get(at) {
            let control = block.statement().map(|statement| &statement.control);
            let holds = match control {
                Some(Control::If(condition) | Control::ElseIf(condition)) => {
                    self.holds(block, *condition)
                }
                _ => true,
            };
            if holds || at >= end {
                break;
            }
            at = body.links(at).other;
        }
        self.go_to(at + 1);
    }

    /// Goes back to the beginning of a loop, unless there have been too many passes.
    fn pass(&mut self, body: &Body, links: Links, place: &Place<'_>) {
        let begin = body.get(links.other);
        let is_do = begin
            .and_then(|(block, ..)| block.statement())
            .is_some_and(|statement| matches!(statement.control, Control::Do | Control::Repeat(_)));
        let name = || {
            let line = begin.map_or(0, |(_, line, _)| line);
            let words = begin.map_or(String::new(), |(block, ..)| block.to_string());
            format!("the loop on line {line} ({words})")
        };
        if self.counts(name, place) {
            // The statement that begins a loop asks its condition anew; others are passed by.
            self.go_to(if is_do { links.other + 1 } else { links.other });
        }
    }

    /// Counts a pass; false, and reported, if it is one too many.
    fn counts(&mut self, name: impl FnOnce() -> String, place: &Place<'_>) -> bool {
        self.passes += 1;
        if self.engine.findings.errors > 0 && self.passes > PASSES_AFTER_ERROR {
            self.end = End::GivenUp;
            return false;
        }
        if self.passes <= self.max_passes {
            return true;
        }
        let message =
            format!("{} makes pass {} of all loops: no more are allowed", name(), self.passes);
        let fault = Fault::new(&rules::MAX_PASSES, 0, place.text.len() as u32, message);
        let help = "does its condition ever change? --max-passes allows more";
        self.engine.findings.add(fault.help(help), *place);
        self.end = End::GivenUp;
        false
    }

    fn begin_repeat(&mut self, block: &Block, count: Formula, at: usize, links: Links) {
        // As RS274/NGC rounds: 2.5 is twice.
        let count = self.engine.number(block, count).unwrap_or_default().round_ties_even();
        self.forget_repeat(at);
        if count < 1.0 {
            self.go_to(links.end + 1);
        } else if let Some(frame) = self.frames.last_mut() {
            frame.repeats.push((at, count as u64 - 1));
        }
    }

    fn end_repeat(&mut self, body: &Body, links: Links, statement: &Statement, place: &Place<'_>) {
        let Some(frame) = self.frames.last_mut() else { return };
        match frame.repeats.iter_mut().find(|(at, _)| *at == links.other) {
            Some((_, 0)) => self.forget_repeat(links.other),
            Some((_, left)) => {
                *left -= 1;
                self.pass(body, links, place);
            }
            None => {
                let fault = unmatched(statement, "a GOTO has led into this repeat");
                self.engine.faults.push(fault);
            }
        }
    }

    fn forget_repeat(&mut self, at: usize) {
        if let Some(frame) = self.frames.last_mut() {
            frame.repeats.retain(|(other, _)| *other != at);
        }
    }

    fn give_back(&mut self, statement: &Statement, value: Option<f64>) {
        if self.is_in_call() {
            self.engine.parameters.give_back(value);
            self.leave();
        } else {
            self.engine.faults.push(unmatched(statement, "no subprogram is being run"));
        }
    }

    /// Keeps a loop or a branch of the main program, up to its end, to run it.
    fn section(&mut self, block: &Block, place: Place<'_>) -> io::Result<()> {
        let findings = &mut self.engine.findings;
        let mut reading = Reading::new(Body::new(None, 0, None), self.text);
        reading.begin(place.line, place.text, block, findings);
        while !reading.linker.is_closed() {
            let Some(line) = reading.next(&mut self.lines, findings, 0)? else {
                reading.finish(findings);
                self.rest_in_program = program_number(&reading.block).is_some();
                self.end = if self.rest_in_program { End::GivenUp } else { End::Text };
                return Ok(());
            };
            if reading.body.size() > BLOCKS_MAX {
                reading.too_large(line.number, findings);
                self.end = End::GivenUp;
                return Ok(());
            }
        }
        if reading.is_faulty {
            self.engine.executor.forget_position();
        } else {
            let (body, kind) = (Rc::new(reading.body), FrameKind::Section);
            self.frames.push(Frame { body, next: 0, kind, repeats: Vec::new() });
        }
        Ok(())
    }

    /// Passes over a subprogram that stands in the way; what is wrong with its words is reported.
    fn skip_sub(&mut self, statement: &Statement, place: Place<'_>) -> io::Result<()> {
        let engine = &mut self.engine;
        // Nothing is executed: the state shall not learn of codes that are checked.
        let mut executor = Executor::new(engine.executor.machine, &Options::default());
        let (lines, block) = (&mut self.lines, &mut self.block);
        while let Some(line) = next_block(lines, block, &mut engine.faults, self.text)? {
            if block.is_plain() {
                executor.check_codes(block, &mut engine.faults);
            }
            if !engine.faults.is_empty() && self.passed_over.len() < engine.findings.max() {
                self.passed_over.push(PassedOver {
                    label: statement.label.clone(),
                    line: line.number,
                    text: line.bytes.to_vec(),
                    faults: std::mem::take(&mut engine.faults),
                });
            }
            engine.faults.clear();
            let ends = block.statement().is_some_and(|end| {
                matches!(end.control, Control::EndSub(_)) && end.label == statement.label
            });
            if ends {
                return Ok(());
            }
            if self.tape.ends_at(block) {
                break;
            }
        }
        let message = format!("{} sub has no endsub", statement.label);
        engine.findings.take_once(&mut vec![unmatched(statement, message)], place);
        self.end = End::Text;
        Ok(())
    }

    /// GOTO: on at the block with an N word, of the subprogram or of the main program. `line` is
    /// where the main program stands.
    fn go_to_number(
        &mut self,
        number: f64,
        block: &Block,
        place: Place<'_>,
        line: u32,
    ) -> io::Result<()> {
        if !matches!(
            self.frames.last().map(|frame| frame.kind),
            Some(FrameKind::Main | FrameKind::Call { .. })
        ) && !self.keep_main(line)?
        {
            self.end = End::GivenUp;
            return Ok(());
        }
        let Some(frame) = self.frames.last() else { return Ok(()) };
        let whole = number.round();
        let is_number =
            (number - whole).abs() <= WHOLE_WITHIN && (0.0..=f64::from(u32::MAX)).contains(&whole);
        let target = frame.body.find(whole as u32, frame.next).filter(|_| is_number);
        let Some(target) = target else {
            let message = format!("no block of this program has N{}", short(number));
            let fault = Fault::block(&rules::UNKNOWN_LABEL, block, message);
            self.engine.findings.take_once(&mut vec![fault], place);
            self.end = End::GivenUp;
            return Ok(());
        };
        if target >= frame.next
            || self.counts(|| format!("GOTO {number} on line {}", place.line), &place)
        {
            self.go_to(target);
        }
        Ok(())
    }

    /// Keeps the main program whole, to go on in it behind a line; false if that cannot be.
    pub(super) fn keep_main(&mut self, line: u32) -> io::Result<bool> {
        let said = self.lines.number();
        let main = self.library.read_main(said, &mut self.engine.findings)?;
        self.rest_in_program = program_number(&main.block).is_some();
        (self.lines, self.block) = (main.lines, main.block);
        let Some(body) = main.body else { return Ok(false) };
        let next = body.place_of(line) + 1;
        self.frames.clear();
        self.frames.push(Frame { body, next, kind: FrameKind::Main, repeats: Vec::new() });
        Ok(true)
    }

    /// Ends a pass of the innermost subprogram.
    pub(super) fn leave(&mut self) {
        let Some(frame) = self.frames.last_mut() else { return };
        match &mut frame.kind {
            FrameKind::Call { repeats_left, start, .. } if *repeats_left > 0 => {
                *repeats_left -= 1;
                frame.next = *start;
                frame.repeats.clear();
                self.engine.executor.leave_call();
                self.engine.executor.enter_call();
            }
            _ => self.leave_wholly(),
        }
    }

    fn leave_wholly(&mut self) {
        let Some(frame) = self.frames.pop() else { return };
        if let FrameKind::Call { has_scope, .. } = frame.kind {
            Rc::make_mut(&mut self.calls).pop();
            self.engine.executor.leave_call();
            if has_scope {
                self.engine.parameters.leave();
            }
        }
    }

    /// M99, with the N word of the caller to go on at, if it says one.
    pub(super) fn return_to(
        &mut self,
        target: Option<u32>,
        block: &Block,
        place: Place<'_>,
    ) -> io::Result<()> {
        let Some(target) = target else {
            self.leave();
            return Ok(());
        };
        let line = self.calls.last().map_or(0, |call| call.line);
        self.leave_wholly();
        self.go_to_number(f64::from(target), block, place, line)
    }

    /// Calls a subprogram; with arguments it gets parameters of its own.
    pub(super) fn call(
        &mut self,
        label: &Label,
        repeats: u32,
        arguments: Option<Arguments<'_>>,
        block: &Block,
        place: Place<'_>,
    ) -> io::Result<()> {
        if repeats == 0 {
            return Ok(());
        }
        if self.engine.findings.errors > 0 && self.calls_made > CALLS_AFTER_ERROR {
            self.end = End::GivenUp;
            return Ok(());
        }
        let depth = self.frames.len();
        if let Some(fault) = self.refused(label, repeats, block) {
            self.engine.findings.take_once(&mut vec![fault], place);
        } else {
            self.enter(label, repeats, arguments, block, place)?;
        }
        if self.frames.len() == depth {
            self.engine.executor.forget_position();
        }
        Ok(())
    }

    /// Why a subprogram is not called, whatever it is.
    fn refused(&mut self, label: &Label, repeats: u32, block: &Block) -> Option<Fault> {
        let called = self.frames.iter().filter_map(|frame| frame.body.label.as_ref());
        let chain: Vec<&Label> = self.main_label.iter().chain(called).collect();
        let depth = self.calls.len();
        if self.main_label.as_ref() == Some(label)
            || (depth >= CALL_DEPTH_MAX && chain.contains(&label))
        {
            let first = chain.iter().position(|other| *other == label).unwrap_or_default();
            let mut names: Vec<String> = Vec::new();
            for name in chain[first..].iter().map(|label| label.to_string()) {
                if !names.contains(&name) {
                    names.push(name);
                }
            }
            let around = format!("{} calls {label}", names.join(" calls "));
            let deep = if depth > 0 { format!(", {depth} calls deep") } else { String::new() };
            let message = format!("{around}{deep}: does this ever end?");
            let fault = Fault::block(&rules::RECURSION, block, message);
            return Some(fault.help("a repetition is written by L, or as a loop: o1 repeat [3]"));
        }
        if depth >= CALL_DEPTH_MAX {
            let message = format!("{label} is called {CALL_DEPTH_MAX} calls deep already");
            return Some(Fault::block(&rules::CALL_DEPTH, block, message));
        }
        let counts = self.counts_calls(repeats);
        (!counts).then(|| self.too_many_calls(&label.to_string(), block))
    }

    /// Counts calls; false if they are too many.
    pub(super) fn counts_calls(&mut self, repeats: u32) -> bool {
        self.calls_made += u64::from(repeats);
        self.calls_made <= CALLS_MAX
    }

    /// Ends a run of too many calls.
    pub(super) fn too_many_calls(&mut self, called: &str, block: &Block) -> Fault {
        self.end = End::GivenUp;
        let message = format!("more than {CALLS_MAX} calls: {called} is not run again");
        Fault::block(&rules::CALL_COUNT, block, message)
    }

    /// Begins a subprogram, or reports why it cannot be run.
    fn enter(
        &mut self,
        label: &Label,
        repeats: u32,
        arguments: Option<Arguments<'_>>,
        block: &Block,
        place: Place<'_>,
    ) -> io::Result<()> {
        let from = self.frames.last().map_or(0, |frame| frame.body.file);
        let fault = match self.library.body(label, from, &mut self.engine.findings)? {
            Found::Body(body) => {
                if let Some((arguments, is_macro)) = arguments {
                    self.engine.parameters.enter(arguments, is_macro);
                }
                self.engine.executor.enter_call();
                let has_scope = arguments.is_some();
                let kind = FrameKind::Call { has_scope, repeats_left: repeats - 1, start: 0 };
                self.frames.push(Frame { body, next: 0, kind, repeats: Vec::new() });
                let file = place.file.map(str::to_owned);
                Rc::make_mut(&mut self.calls).push(CallSite { line: place.line, file });
                return Ok(());
            }
            Found::Faulty => return Ok(()),
            Found::Outside(name) => {
                let message = format!("{name} lies outside of the folders for subprograms");
                let help = "put it below the program's folder, or give its folder by --include";
                Fault::block(&rules::OUTSIDE_FOLDER, block, message).help(help)
            }
            Found::Nothing => self.unknown(label, block),
        };
        self.engine.findings.take_once(&mut vec![fault], place);
        Ok(())
    }

    fn unknown(&self, label: &Label, block: &Block) -> Fault {
        let message = format!("the file holds no subprogram {label}");
        let fault = Fault::block(&rules::UNKNOWN_SUBPROGRAM, block, message);
        let labels = self.library.labels();
        let help = if labels.is_empty() {
            format!("write it after M30, as {label} up to M99")
        } else {
            format!("it holds {}", labels[..labels.len().min(10)].join(", "))
        };
        // P51000: O1000 five times.
        if let Label::Number(number) = label
            && *number > 9999
            && !self.dialect.is_fanuc()
            && labels.contains(&format!("O{}", number % 10_000))
        {
            let (number, repeats) = (number % 10_000, number / 10_000);
            return fault.help(format!(
                "O{number} {repeats} times is P{number} L{repeats}, or --dialect fanuc"
            ));
        }
        match self.library.inputs.looked_for(label) {
            Some(looked_for) => fault.help(format!("{help}; {looked_for}")),
            None => fault.help(help),
        }
    }
}
