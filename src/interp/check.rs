//! The first pass: a program is run whole, and all that is wrong with it is found.

use std::io;

use crate::base::{AxisMap, AxisSet, Diagnostic, Machine, Point, Source};
use crate::gcode::{Block, Control, Fault, Label, Lines, MessageKind, rules};

use super::Options;
use super::findings::Place;
use super::hashed::HashedReader;
use super::motion::Motion;
use super::program::{Library, next_block, program_number};
use super::record::{Record, WORDS_MAX};
use super::run::{End, PassedOver, Run};
use super::travel::Travel;

/// What a program amounts to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Summary {
    /// Physical lines of the text that were read.
    pub lines: u64,
    /// Blocks executed, those of subprograms as often as they ran.
    pub blocks: u64,
    /// Moves, those to where the machine stands included.
    pub moves: u64,
    /// Events: M, S and T functions and dwells.
    pub events: u64,
    /// Where the job starts, in machine coordinates.
    pub start_mm: Point,
    /// Where it ends.
    pub end_mm: Point,
    /// Least and greatest position of each of the machine's axes; none where nothing moves.
    pub extents_mm: AxisMap<Option<[f64; 2]>>,
    /// How far the part may be shifted along each axis and still fit: the least and the greatest
    /// shift. Where the least is greater, the part is larger than the travel, by the difference.
    /// None on axes without travel, and where nothing moves.
    pub shifts_mm: AxisMap<Option<[f64; 2]>>,
    /// Axes that some word of the program addresses.
    pub axes_used: AxisSet,
}

/// What a program says to the operator.
#[derive(Clone, Debug, PartialEq)]
pub struct Said {
    /// Physical line of the comment that says it.
    pub line: u32,
    /// The file of a subprogram, where it is not the program's own.
    pub file: Option<String>,
    /// `(MSG, …)`, `(DEBUG, …)` or `(PRINT, …)`.
    pub kind: MessageKind,
    /// What it says; DEBUG and PRINT with the values of parameters.
    pub text: String,
}

/// A checked program.
#[derive(Clone, Debug)]
pub struct Checked {
    /// What is wrong, by line: at most so many errors and so many warnings as asked for.
    pub diagnostics: Vec<Diagnostic>,
    /// All errors there are.
    pub errors: u64,
    /// All warnings there are.
    pub warnings: u64,
    /// Further files that were read for subprograms, and the SHA-256 of each.
    pub inputs: Vec<(String, [u8; 32])>,
    /// What the program says to the operator: at most so much as asked for of diagnostics.
    pub said: Vec<Said>,
    /// How often it says something.
    pub messages: u64,
    /// What the program amounts to.
    pub summary: Summary,
}

/// Runs a program whole, in constant memory, and finds all that is wrong with it.
///
/// # Errors
/// When the text cannot be read. What is wrong with the program is no error here: see
/// [`Checked::diagnostics`].
pub fn check(
    source: &Source,
    machine: &Machine,
    options: &Options,
    max_diagnostics: usize,
) -> io::Result<Checked> {
    let run = judged(source, machine, options, max_diagnostics);
    Ok(run_whole(run, machine, &mut None)?.0)
}

/// The same, with the motions of a program without errors, unless they are too many to be kept: then
/// it has to be run again for them.
///
/// # Errors
/// As for [`check`].
pub fn check_and_record(
    source: &Source,
    machine: &Machine,
    options: &Options,
    max_diagnostics: usize,
) -> io::Result<(Checked, Option<Record>)> {
    let run = judged(source, machine, options, max_diagnostics);
    let mut record = Some(Record::new(WORDS_MAX));
    let (checked, _) = run_whole(run, machine, &mut record)?;
    let record = record.filter(|_| checked.errors == 0);
    Ok((checked, record))
}

/// As [`check`], with the SHA-256 of the very text that was checked.
///
/// # Errors
/// As for [`check`].
pub fn check_and_hash(
    source: &Source,
    machine: &Machine,
    options: &Options,
    max_diagnostics: usize,
) -> io::Result<(Checked, [u8; 32])> {
    let mut run = judged(source, machine, options, max_diagnostics);
    run.lines = Lines::new(HashedReader::new(source), 0, 1);
    let (checked, text) = run_whole(run, machine, &mut None)?;
    Ok((checked, text.sha256()?))
}

/// A run whose moves are held against the machine's travel.
fn judged<'a>(source: &Source, machine: &'a Machine, options: &Options, max: usize) -> Run<'a> {
    let mut run = Run::new(source, machine, options, max);
    run.engine.travel = Some(Travel::new(machine, options.ignore_travel));
    run
}

/// Runs a program whole; a record, if there is one, is made of its motions, or none if they are too
/// many.
fn run_whole(
    mut run: Run<'_>,
    machine: &Machine,
    record: &mut Option<Record>,
) -> io::Result<(Checked, HashedReader)> {
    let mut summary = Summary { start_mm: run.engine.executor.position_mm(), ..Summary::default() };
    let mut motions = Vec::new();
    while run.step(&mut motions)? {
        for motion in &motions {
            match motion {
                Motion::Move(_) => summary.moves += 1,
                Motion::Event(_) => summary.events += 1,
            }
            if record.as_mut().is_some_and(|record| !record.add(motion)) {
                *record = None;
            }
        }
        motions.clear();
    }
    check_rest(&mut run)?;
    for passed in std::mem::take(&mut run.passed_over) {
        if !run.library.has_read(&passed.label) {
            let PassedOver { line, text, faults, .. } = &passed;
            let place = Place { line: *line, text, calls: &[], file: None };
            run.engine.findings.take(&mut never_called(faults.clone()), place);
        }
    }
    if run.engine.blocks == 0 && run.engine.findings.errors == 0 {
        let place = Place { line: run.lines.number().max(1), text: b"", calls: &[], file: None };
        let fault = Fault::new(&rules::EMPTY_PROGRAM, 0, 1, "there is no block in this file");
        run.engine.findings.add(fault, place);
    }
    if let Some(travel) = run.engine.travel.take() {
        travel.report(&mut run.engine.findings);
        summary.extents_mm = travel.extents_mm(machine);
        summary.shifts_mm = travel.shifts_mm(machine);
    }
    summary.lines = u64::from(run.lines.number());
    summary.blocks = run.engine.blocks;
    summary.end_mm = run.engine.executor.position_mm();
    summary.axes_used = run.engine.executor.axes_used;
    run.engine.plunges.report(summary.axes_used, &mut run.engine.findings);
    let hashes = run.library.inputs.list.iter();
    let inputs = hashes.map(|input| (input.source.name().to_owned(), input.sha256)).collect();
    let mut diagnostics = run.engine.findings.list;
    diagnostics.sort_by(|a, b| {
        let key = |found: &Diagnostic| (found.span.line, found.span.start);
        a.file.cmp(&b.file).then(key(a).cmp(&key(b)))
    });
    let checked = Checked {
        diagnostics,
        errors: run.engine.findings.errors,
        warnings: run.engine.findings.warnings,
        inputs,
        said: run.engine.said,
        messages: run.engine.findings.messages,
        summary,
    };
    Ok((checked, run.lines.into_reader()))
}

/// Checks the words of what follows the main program: subprograms that are never called have
/// faults too, and blocks outside of any are never run.
fn check_rest(run: &mut Run<'_>) -> io::Result<()> {
    let mut in_program = run.rest_in_program || matches!(run.end, End::NextProgram | End::GivenUp);
    // What a run that was given up would have called is not known.
    let ran_whole = run.end != End::GivenUp;
    // Faults of subprograms that were called have been reported when they were read.
    let has_read = |library: &Library, number| library.has_read(&Label::Number(number));
    let mut reported = (run.end == End::NextProgram || run.rest_in_program)
        && program_number(&run.block).is_some_and(|(number, _)| has_read(&run.library, number));
    let mut after_end_said = false;
    let mut block = Block::default();
    let mut faults = Vec::new();
    while run.end != End::NotText {
        let line = next_block(&mut run.lines, &mut block, &mut faults, run.text)?;
        let Some(line) = line else { return Ok(()) };
        let place = Place { line: line.number, text: line.bytes, calls: &[], file: None };
        let is_blank = block.is_empty() && faults.is_empty();
        if run.end == End::Text {
            faults.clear();
        } else if faults.iter().any(|fault| fault.rule == &rules::NOT_TEXT) {
            run.end = End::NotText;
        } else if run.tape.ends_at(&block) {
            run.end = End::Text;
            in_program = false;
        } else if let Some((number, _)) = program_number(&block) {
            in_program = true;
            reported = has_read(&run.library, number);
        } else if let Some(sub) = block.statement().filter(|found| found.control == Control::Sub) {
            in_program = true;
            reported = run.library.has_read(&sub.label);
        }
        if in_program {
            // What an expression makes of a word is not known here.
            if block.is_plain() {
                run.engine.executor.check_codes(&block, &mut faults);
            }
        } else if run.end != End::NotText {
            // Nobody reads it: it may be notes in plain words.
            faults.clear();
            if !is_blank && !block.percent && !after_end_said {
                after_end_said = true;
                let message = "this and what follows stands after the program's end: it is not run";
                let fault = Fault::block(&rules::AFTER_END, &block, message);
                run.engine.findings.add(
                    fault.help("move the program's end (M2, M30 or %) behind it, or take it out"),
                    place,
                );
            }
        }
        if reported {
            faults.clear();
        }
        if ran_whole && in_program && run.end != End::NotText {
            faults = never_called(faults);
        }
        run.engine.findings.take(&mut faults, place);
    }
    Ok(())
}

/// Faults of text that never runs, as warnings: it may be for another control, or unfinished.
fn never_called(faults: Vec<Fault>) -> Vec<Fault> {
    let told = |fault: Fault| {
        let message = format!("{}; this is never called", fault.message);
        Fault { rule: &rules::NEVER_CALLED, message, ..fault }
    };
    faults.into_iter().map(told).collect()
}
