//! `cnc interpret`: what a program means, as a table or as JSON Lines.

mod pulses;

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::anyhow;
use cnc::base::{Axis, AxisMap, Diagnostic, Event, EventKind, Machine, Severity, Source, Spline};
use cnc::interp::{self, Bound, Checked, Motion, Move, MoveKind, Options, Tools};

use crate::args::Global;
use crate::exit::{Exit, Outcome, unless_unread};
use crate::language::LanguageArgs;
use crate::many::files::{Entry, Found};
use crate::many::judged::Judged;
use crate::many::{Judge, ManyArgs};
use crate::meter::{self, Pass};
use crate::plural::count;
use crate::{fixed, input, many, refusal, report};

/// Check an NC program and print what it means
#[derive(Debug, clap::Args)]
pub struct Args {
    /// NC programs, and folders with all programs below them; - for standard input
    #[arg(value_name = "FILE|FOLDER", required = true)]
    files: Vec<PathBuf>,
    /// Where the job starts, in machine coordinates [default: the machine's work zero]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    start: Option<input::Start>,
    #[command(flatten)]
    language: LanguageArgs,
    /// Tool table: CSV, or LinuxCNC's format; lengths in mm
    #[arg(long, value_name = "FILE")]
    tools: Option<PathBuf>,
    /// Print the interpolation pulses of each block, with the command of the board that makes them,
    /// instead of the motion
    #[arg(long)]
    fp: bool,
    #[command(flatten)]
    many: ManyArgs,
}

impl Args {
    /// The options of a run of one of the programs.
    fn options(&self, file: &Path, machine: &Machine, tools: &Tools) -> Options {
        let start_mm = self.start.as_ref().map(|start| start.position_mm(machine));
        Options { start_mm, tools: tools.clone(), ..self.language.options(file) }
    }
}

pub fn run(args: &Args, global: &Global) -> Outcome {
    let alone = match args.files.as_slice() {
        [file] if !file.is_dir() => Some(file),
        _ => None,
    };
    let in_full = args.many.in_full(alone.is_some(), global)?;
    let machine = input::machine(global)?;
    let (tools, _) = input::tools(args.tools.as_deref())?;
    match alone.filter(|_| in_full) {
        Some(file) => one(file, &machine, &tools, args, global),
        None if args.fp => {
            Err(anyhow!("--fp lists the pulses of one program, as text or --json").into())
        }
        None => many(&args.files, &machine, &tools, args, global),
    }
}

/// Checks programs, and tells of each in turn.
fn many(
    files: &[PathBuf],
    machine: &Machine,
    tools: &Tools,
    args: &Args,
    global: &Global,
) -> Outcome {
    let found = Found::of(files)?;
    many::say_left_out(&found, global);
    let work = |entry: &Entry| {
        let mut judged = Judged::new(entry.path.clone());
        let checked = entry.readable().and_then(|file| {
            let (source, options) = (input::program(file)?, args.options(file, machine, tools));
            let checked = interp::check(&source, machine, &options, global.max_errors)?;
            input::has_called(&checked);
            Ok(checked)
        });
        match checked {
            Ok(checked) => judged.checked = Some(checked),
            Err(failure) => judged.trouble = Some(failure),
        }
        judged
    };
    args.many.run(Judge::Interpret, &found.programs, |entry| &entry.path, work, global)
}

/// Checks a program and prints what it means.
fn one(file: &Path, machine: &Machine, tools: &Tools, args: &Args, global: &Global) -> Outcome {
    let source = input::program(file)?;
    let options = args.options(file, machine, tools);
    let is_wanted = global.json || !global.quiet;
    let is_listed = is_wanted && !args.fp;
    let pass = Pass::of_text("checking");
    let (checked, record) = if is_listed {
        interp::check_and_record(&source, machine, &options, global.max_errors)?
    } else {
        (interp::check(&source, machine, &options, global.max_errors)?, None)
    };
    drop(pass);
    let mut out = BufWriter::with_capacity(1 << 16, io::stdout().lock());
    let as_json = |found: &&Diagnostic| global.json && found.severity == Severity::Error;
    let mut errors = checked.diagnostics.iter().filter(as_json);
    let written =
        errors.try_for_each(|error| refusal::write_error(&mut out, error, &checked, None));
    unless_unread(written.and_then(|()| out.flush()))?;
    let drawn = checked.diagnostics.iter().filter(|found| !as_json(found));
    report::diagnostics(source.name(), drawn, global);
    report::said(source.name(), &checked, global);
    report::totals(source.name(), &checked, global);
    if checked.errors > 0 {
        return Ok(Exit::BadInput);
    }
    if args.fp {
        drop(out);
        return pulses::report(&source, machine, &options, is_wanted.then_some(global.json));
    }
    if !is_listed {
        return Ok(Exit::Ok);
    }
    let axes = Axis::ALL
        .into_iter()
        .filter(|axis| Axis::LINEAR.contains(axis) || checked.summary.axes_used.contains(*axis))
        .collect();
    meter::leave_terminal_to_results();
    let _pass = Pass::of_text("listing");
    if !global.json {
        write_summary(&mut out, &source, machine, &checked)?;
    }
    let mut listing = Listing::new(out, axes, global.json);
    if !global.json {
        listing.head()?;
    }
    if let Some(record) = record {
        let mut motions = record.replay();
        while let Some(motion) = motions.read() {
            listing.write(motion)?;
        }
    } else {
        let mut motions = interp::motions(&source, machine, &options);
        while let Some(motion) = motions.read()? {
            listing.write(motion)?;
        }
    }
    listing.finish()?;
    Ok(Exit::Ok)
}

fn write_summary(
    out: &mut impl Write,
    source: &Source,
    machine: &Machine,
    checked: &Checked,
) -> io::Result<()> {
    let summary = &checked.summary;
    writeln!(out, "program  {}", source.name())?;
    writeln!(out, "machine  {machine}; positions in mm in machine coordinates")?;
    writeln!(
        out,
        "size     {}, {}, {}, {}",
        count(summary.lines, "line"),
        count(summary.blocks, "block"),
        count(summary.moves, "move"),
        count(summary.events, "event")
    )?;
    writeln!(out)?;
    writeln!(
        out,
        "{:>4} {:>11} {:>11} {:>11} {:>11}  {:>26}",
        "axis", "start", "end", "least", "greatest", "may be shifted by"
    )?;
    for profile in &machine.axes {
        let axis = profile.axis;
        if !Axis::LINEAR.contains(&axis) && !summary.axes_used.contains(axis) {
            continue;
        }
        let (start, end) = (summary.start_mm[axis], summary.end_mm[axis]);
        let [least, greatest] = summary.extents_mm[axis].unwrap_or([start; 2]);
        write!(out, "{axis:>4} {start:>11.3} {end:>11.3} {least:>11.3} {greatest:>11.3}")?;
        match summary.shifts_mm[axis] {
            Some([low, high]) => writeln!(out, "  {low:>+11.3} to {high:>+11.3}")?,
            None => writeln!(out)?,
        }
    }
    writeln!(out)
}

/// Lines are handed on when there are so many bytes of them.
const TEXT_BYTES: usize = 1 << 16;

/// Writes motion, a line each.
struct Listing<W: Write> {
    out: W,
    axes: Vec<Axis>,
    text: Vec<u8>,
    json: bool,
    shown: AxisMap<Shown>,
    shown_feed: Shown,
}

/// A number as it was written last, for most are the same again: a move starts where the one
/// before has ended, and not all axes move.
#[derive(Default)]
struct Shown {
    value: f64,
    text: [u8; NUMBER_BYTES],
    /// Bytes of the text; none where nothing has been written yet.
    length: usize,
}

/// Longest number, as -1.2345678901234567e-300.
const NUMBER_BYTES: usize = 24;

impl Shown {
    fn write(&mut self, text: &mut Vec<u8>, value: f64) {
        let begin = text.len();
        if self.length > 0 && self.value.to_bits() == value.to_bits() {
            // To copy all of it takes a few instructions, to copy a part a call.
            text.extend_from_slice(&self.text);
            text.truncate(begin + self.length);
            return;
        }
        number(text, value);
        let written = &text[begin..];
        if let Some(place) = self.text.get_mut(..written.len()) {
            place.copy_from_slice(written);
            (self.value, self.length) = (value, written.len());
        }
    }
}

impl<W: Write> Listing<W> {
    fn new(out: W, axes: Vec<Axis>, json: bool) -> Listing<W> {
        let (text, shown) = (Vec::with_capacity(2 * TEXT_BYTES), AxisMap::default());
        Listing { out, axes, text, json, shown, shown_feed: Shown::default() }
    }

    fn finish(&mut self) -> io::Result<()> {
        self.out.write_all(&self.text)?;
        self.out.flush()
    }

    fn head(&mut self) -> io::Result<()> {
        write!(self.out, "{:>7} {:>6}  {:<8}", "line", "N", "motion")?;
        for axis in &self.axes {
            write!(self.out, " {:>10}", axis.letter())?;
        }
        writeln!(self.out, " {:>8}  arc", "feed")
    }

    fn write(&mut self, motion: &Motion) -> io::Result<()> {
        match (motion, self.json) {
            (Motion::Move(step), true) => self.json_move(step),
            (Motion::Event(event), true) => json_event(&mut self.text, event),
            (Motion::Move(step), false) => self.table_move(step)?,
            (Motion::Event(event), false) => {
                writeln!(self.text, "{:>7} {:>6}  {}", event.line, "", event.kind)?;
            }
        }
        if self.text.len() >= TEXT_BYTES {
            self.out.write_all(&self.text)?;
            self.text.clear();
        }
        Ok(())
    }

    fn table_move(&mut self, step: &Move) -> io::Result<()> {
        let text = &mut self.text;
        let name = match step.kind {
            MoveKind::Rapid => "rapid",
            MoveKind::Line { .. } => match step.bound {
                Bound::Free | Bound::Captive => "line",
                Bound::Spindle => "thread",
                Bound::Input => "probe",
            },
            MoveKind::Arc { ccw: true, .. } => "arc ccw",
            MoveKind::Arc { ccw: false, .. } => "arc cw",
            MoveKind::Spline { .. } => "spline",
        };
        fixed::whole(text, step.line, 7);
        text.push(b' ');
        match step.n {
            Some(n) => fixed::whole(text, n, 6),
            None => text.extend_from_slice(b"      "),
        }
        write!(text, "  {name:<8}")?;
        for axis in &self.axes {
            text.push(b' ');
            fixed::decimal(text, step.to[*axis], 10, 3)?;
        }
        if let Some(feed_mm_min) = step.kind.feed_mm_min() {
            text.push(b' ');
            fixed::decimal(text, feed_mm_min, 8, 1)?;
        }
        match &step.kind {
            MoveKind::Rapid | MoveKind::Line { .. } => {}
            MoveKind::Arc { plane, center_mm: [first, second], turns, .. } => {
                let ([a, b], name) = (plane.axes(), plane.name());
                write!(text, "  {name} centre {a}{first:.3} {b}{second:.3}")?;
                if *turns > 0 {
                    write!(text, " and {turns} full turns")?;
                }
            }
            MoveKind::Spline { curve, .. } => {
                write!(text, "  degree {}, {} points", curve.degree(), curve.points().len())?;
            }
        }
        text.push(b'\n');
        Ok(())
    }

    fn json_move(&mut self, step: &Move) {
        let (text, axes, shown) = (&mut self.text, &self.axes, &mut self.shown);
        text.extend_from_slice(match step.kind {
            MoveKind::Rapid => b"{\"type\":\"rapid\",\"line\":".as_slice(),
            MoveKind::Line { .. } => b"{\"type\":\"line\",\"line\":",
            MoveKind::Arc { .. } => b"{\"type\":\"arc\",\"line\":",
            MoveKind::Spline { .. } => b"{\"type\":\"spline\",\"line\":",
        });
        integer(text, step.line);
        if let Some(n) = step.n {
            text.extend_from_slice(b",\"n\":");
            integer(text, n);
        }
        text.extend_from_slice(b",\"from\":");
        json_point(text, axes, |text, axis| shown[axis].write(text, step.from[axis]));
        text.extend_from_slice(b",\"to\":");
        json_point(text, axes, |text, axis| shown[axis].write(text, step.to[axis]));
        if let Some(feed_mm_min) = step.kind.feed_mm_min() {
            text.extend_from_slice(b",\"feed\":");
            self.shown_feed.write(text, feed_mm_min);
        }
        match step.bound {
            Bound::Free | Bound::Captive => {}
            Bound::Spindle => text.extend_from_slice(b",\"sync\":true"),
            Bound::Input => text.extend_from_slice(b",\"probe\":true"),
        }
        if let MoveKind::Spline { curve, .. } = &step.kind {
            json_spline(text, axes, curve);
        }
        if let MoveKind::Arc { plane, center_mm, ccw, turns, .. } = step.kind {
            text.extend_from_slice(b",\"plane\":\"");
            text.extend_from_slice(plane.name().as_bytes());
            text.extend_from_slice(b"\",\"center\":");
            let [first, second] = plane.axes();
            let [at_first, at_second] = center_mm;
            let at = |axis| if axis == first { at_first } else { at_second };
            json_point(text, &[first, second], |text, axis| number(text, at(axis)));
            text.extend_from_slice(if ccw { b",\"ccw\":true" } else { b",\"ccw\":false" });
            text.extend_from_slice(b",\"turns\":");
            integer(text, turns);
        }
        text.extend_from_slice(b"}\n");
    }
}

/// An object with a number for each axis, which `write` writes.
fn json_point(text: &mut Vec<u8>, axes: &[Axis], mut write: impl FnMut(&mut Vec<u8>, Axis)) {
    let mut separator = b'{';
    for axis in axes {
        text.extend_from_slice(&[separator, b'"', axis.letter() as u8, b'"', b':']);
        write(text, *axis);
        separator = b',';
    }
    text.push(b'}');
}

/// Points; of what is no Bézier curve, which these alone would tell, weights and knots too.
fn json_spline(text: &mut Vec<u8>, axes: &[Axis], curve: &Spline) {
    json_list(text, "points", curve.points(), |text, point| {
        json_point(text, axes, |text, axis| number(text, point[axis]));
    });
    if !curve.is_bezier() {
        json_list(text, "weights", curve.weights(), |text, weight| number(text, *weight));
        json_list(text, "knots", curve.knots(), |text, knot| number(text, *knot));
    }
    text.extend_from_slice(b",\"degree\":");
    text.extend_from_slice(itoa::Buffer::new().format(curve.degree()).as_bytes());
}

fn json_list<T>(text: &mut Vec<u8>, name: &str, items: &[T], write: impl Fn(&mut Vec<u8>, &T)) {
    text.extend_from_slice(b",\"");
    text.extend_from_slice(name.as_bytes());
    text.extend_from_slice(b"\":");
    let mut separator = b'[';
    for item in items {
        text.push(separator);
        write(text, item);
        separator = b',';
    }
    text.push(b']');
}

fn json_event(text: &mut Vec<u8>, event: &Event) {
    let is_dwell = matches!(event.kind, EventKind::Dwell(_));
    let head: &[u8] = if is_dwell { b"{\"type\":\"dwell\"" } else { b"{\"type\":\"event\"" };
    text.extend_from_slice(head);
    text.extend_from_slice(b",\"line\":");
    integer(text, event.line);
    match event.kind {
        EventKind::Dwell(seconds) => field(text, "seconds", seconds),
        EventKind::M { code, spindle_rpm, tool } => {
            text.extend_from_slice(b",\"code\":\"M");
            integer(text, code.into());
            text.push(b'"');
            if let Some(rpm) = spindle_rpm {
                field(text, "s", rpm);
            }
            if let Some(tool) = tool {
                field(text, "t", tool.into());
            }
        }
        EventKind::Function { code, words } => {
            text.extend_from_slice(b",\"code\":\"M");
            integer(text, code.into());
            text.push(b'"');
            for (letter, value) in words.iter() {
                let name = char::from(letter).to_ascii_lowercase();
                field(text, name.encode_utf8(&mut [0; 4]), value);
            }
        }
        EventKind::S(rpm) => {
            text.extend_from_slice(b",\"code\":\"S\"");
            field(text, "s", rpm);
        }
        EventKind::SurfaceSpeed { m_min, rpm_max } => {
            text.extend_from_slice(b",\"code\":\"G96\"");
            field(text, "s", m_min);
            if let Some(rpm) = rpm_max {
                field(text, "d", rpm);
            }
        }
        EventKind::WaitInput { number, analog, kind, seconds } => {
            text.extend_from_slice(b",\"code\":\"M66\"");
            field(text, if analog { "e" } else { "p" }, number.into());
            field(text, "l", kind.into());
            field(text, "q", seconds);
        }
        // A question of `send`, which no program asks.
        EventKind::NextBlock => {}
        EventKind::T(tool) => {
            text.extend_from_slice(b",\"code\":\"T\"");
            field(text, "t", tool.into());
        }
    }
    text.extend_from_slice(b"}\n");
}

fn field(text: &mut Vec<u8>, name: &str, value: f64) {
    text.extend_from_slice(b",\"");
    text.extend_from_slice(name.as_bytes());
    text.extend_from_slice(b"\":");
    number(text, value);
}

fn integer(text: &mut Vec<u8>, value: u32) {
    text.extend_from_slice(itoa::Buffer::new().format(value).as_bytes());
}

/// The shortest form that reads back as the same value; whole numbers without a point.
fn number(text: &mut Vec<u8>, value: f64) {
    let whole = value as i64;
    // Whole numbers up to here are exact in both types.
    if whole as f64 == value && value.abs() < 1e15 {
        text.extend_from_slice(itoa::Buffer::new().format(whole).as_bytes());
    } else {
        text.extend_from_slice(zmij::Buffer::new().format_finite(value).as_bytes());
    }
}
