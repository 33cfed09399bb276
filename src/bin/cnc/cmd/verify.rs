//! `cnc verify`: holds a command dump against the analytic path of its program.

mod blocks;
mod many;

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail};
use cnc::base::machine::BUILT_IN;
use cnc::base::source::shown;
use cnc::base::{Machine, Source};
use cnc::interp::Dialect;
use cnc::tape::{Header, Origin, Reader, TapeError};
use cnc::verify::{Check, Report, Setup, TellBlock, Verdict, verify_blocks};

use crate::args::Global;
use crate::exit::{Exit, ExitWith, Failure, Outcome, unless_unread};
use crate::input::{self, Start};
use crate::language::{DialectArg, LanguageArgs};
use crate::many::judged::Judged;
use crate::many::{ManyArgs, say_notes};
use crate::meter::Pass;
use crate::plural::count;
use crate::program::{Encoder, FeedMode, MotionArgs, Program};
use crate::refusal::Refusal;
use crate::report;

/// Hold a command dump, or the steps of programs, against the path that is programmed
#[derive(Debug, clap::Args)]
#[command(override_usage = USAGE)]
pub struct Args {
    /// An NC program and its command dump. Or programs, and folders with all programs below them: each is
    /// held against the dump beside it (part.nc, part.csv), if there is one, else against the steps that
    /// are planned for it here. - is standard input
    #[arg(value_name = "FILE|FOLDER", required = true)]
    files: Vec<PathBuf>,
    /// Take two files for two programs, not for a program and its dump
    #[arg(long)]
    programs: bool,
    /// Take a dump without metadata, from another tool: columns X, Y, Z with the steps of each
    /// tick suffice, by the profile given
    #[arg(long)]
    unsealed: bool,
    /// Print how far each block is off, each time that it comes to be executed after another one
    #[arg(long)]
    blocks: bool,
    #[command(flatten)]
    motion: MotionArgs,
    #[command(flatten)]
    many: ManyArgs,
}

/// How its files are given.
const USAGE: &str = "cnc verify [OPTIONS] PROGRAM DUMP
       cnc verify [OPTIONS] FILE|FOLDER...";

pub fn run(args: &Args, global: &Global) -> Outcome {
    let pair = args.pair(global)?;
    let is_alone = args.files.len() == 1 && !args.files[0].is_dir();
    let in_full = args.many.in_full(pair.is_some() || is_alone, global)?;
    let machine = input::machine(global)?;
    if args.blocks && !in_full {
        return Err(anyhow!("--blocks tells of one program, as text or --json").into());
    }
    match in_full {
        true => one(&args.files[0], pair, machine, args, global),
        false => many::run(&args.files, pair, &machine, args, global),
    }
}

impl Args {
    /// The dump, if it is named with its program.
    fn pair(&self, global: &Global) -> anyhow::Result<Option<&Path>> {
        let named = match self.files.as_slice() {
            [program, dump] if !self.programs && !program.is_dir() && !dump.is_dir() => {
                if [program, dump].into_iter().all(|file| file == Path::new("-")) {
                    bail!("standard input cannot be both the program and the dump");
                }
                Some(dump.as_path())
            }
            _ => None,
        };
        if named.is_some() {
            let told = ["feed", "override", "start", "dialect", "block-delete", "lenient"];
            global.refuse(&told, "the dump says how it was made")?;
        }
        if named.is_none() && self.unsealed {
            bail!("--unsealed takes a program and its dump: cnc verify --unsealed PROGRAM DUMP");
        }
        Ok(named)
    }
}

/// Judges one program and prints the table of its checks, or the document.
fn one(
    program: &Path,
    dump: Option<&Path>,
    machine: Machine,
    args: &Args,
    global: &Global,
) -> Outcome {
    if dump.is_none() && many::is_dump(program) {
        return Err(many::lonely(program).into());
    }
    let mut judged = Judged::new(program.to_owned());
    let mut out = BufWriter::new(io::stdout().lock());
    let mut rows = blocks::Rows::new(&mut out, global.json);
    let tell: TellBlock = &mut |block| rows.tell(block);
    let outcome = judge(&mut judged, dump, &machine, args, global, args.blocks.then_some(tell));
    if dump.is_none() && !global.quiet {
        match &judged.dump {
            Some(dump) => say!("note: held against {dump}, which lies beside it"),
            None => say!("note: no dump is named: the steps that are planned here are judged"),
        }
    }
    say_notes(&judged, global);
    if let Some(checked) = &judged.checked {
        report::checked(&judged.name, checked, global);
    }
    outcome?;
    let checked = judged.checked.as_ref().filter(|checked| checked.errors > 0);
    if let Some(checked) = checked {
        return Err(Refusal::of_program(&judged.name, checked)).or_bad_input();
    }
    let report = judged.report.as_ref().context("nothing was judged")?;
    let rows_written = if args.blocks { rows.end() } else { Ok(()) };
    let written = rows_written.and_then(|()| {
        if global.json {
            writeln!(out, "{}", serde_json::to_string(report)?)?;
        } else if !global.quiet {
            if args.blocks {
                writeln!(out)?;
            }
            print(&mut out, report, global)?;
        }
        out.flush()
    });
    unless_unread(written)?;
    if global.json || global.quiet {
        let name = judged.dump.as_ref().unwrap_or(&judged.name);
        report.failures.iter().for_each(|failure| say!("error: {name}: {failure}"));
    }
    Ok(if report.verdict == Verdict::Pass { Exit::Ok } else { Exit::BadInput })
}

/// Holds a dump against its program: the one that is named, or that lies beside it; else the steps
/// that are planned here. Says nothing: all that is found stands in `judged` as far as it goes.
fn judge(
    judged: &mut Judged,
    dump: Option<&Path>,
    machine: &Machine,
    args: &Args,
    global: &Global,
    tell: Option<TellBlock>,
) -> Result<(), Failure> {
    let program = input::program(&judged.path)?;
    let dump = match dump {
        Some(dump) => Some(input::source(dump)?),
        None => beside(judged)?,
    };
    match dump {
        Some(dump) => held(judged, program, dump, machine, args, global, tell),
        None => planned(judged, program, machine, args, global, tell),
    }
}

/// The dump beside a program, which has its name and ends in `.csv`.
fn beside(judged: &mut Judged) -> anyhow::Result<Option<Source>> {
    let path = dump_of(&judged.path);
    if path == judged.path || path.symlink_metadata().is_err() {
        return Ok(None);
    }
    if !path.is_file() {
        let name = shown(&path);
        return Err(anyhow!(
            "{name} lies beside it and is no file: take it away, or name the dump"
        ));
    }
    let source = input::source(&path)?;
    if input::is_dump(&source)? {
        return Ok(Some(source));
    }
    let note =
        format!("note: {} is no command dump: {} is planned here", source.name(), judged.name);
    judged.notes.push(note);
    Ok(None)
}

/// Where a program's dump lies that nobody names.
fn dump_of(program: &Path) -> PathBuf {
    let [usual, capital] = ["csv", "CSV"].map(|ending| program.with_extension(ending));
    let is_there = |path: &Path| path.symlink_metadata().is_ok();
    if is_there(&capital) && !is_there(&usual) { capital } else { usual }
}

fn planned(
    judged: &mut Judged,
    program: Source,
    machine: &Machine,
    args: &Args,
    global: &Global,
    tell: Option<TellBlock>,
) -> Result<(), Failure> {
    let program = Program::judge(&judged.path, program, machine.clone(), &args.motion, global)?;
    judged.checked = Some(program.checked.clone());
    if program.checked.errors == 0 {
        judged.report = Some(program.verified(None, tell)?);
    }
    Ok(())
}

fn held(
    judged: &mut Judged,
    program: Source,
    dump: Source,
    machine: &Machine,
    args: &Args,
    global: &Global,
    tell: Option<TellBlock>,
) -> Result<(), Failure> {
    let name = dump.name().to_owned();
    judged.dump = Some(name.clone());
    let reader = open(args, &dump, machine).with_context(|| unread(args, &dump)).or_bad_input()?;
    let unused = reader.unused_columns().join(", ");
    if !unused.is_empty() {
        judged.notes.push(format!("warning: {name}: columns not used: {unused}"));
    }
    let (with_events, with_buffers) = (reader.has_events(), reader.has_buffers());
    let header = reader.header().clone();
    if !args.unsealed {
        check_machine(&header, machine).with_context(|| name.clone()).or_bad_input()?;
    }
    let motion = MotionArgs {
        tools: args.motion.tools.clone(),
        ..motion(&header, machine, args).with_context(|| name.clone()).or_bad_input()?
    };
    let program = Program::judge(&judged.path, program, machine.clone(), &motion, global)?;
    judged.checked = Some(program.checked.clone());
    if program.checked.errors > 0 {
        return Ok(());
    }
    if !args.unsealed {
        check_program(&header, &program).with_context(|| name.clone()).or_bad_input()?;
    }
    let setup = Setup {
        machine: &program.machine,
        tick_us: header.tick_us,
        start_steps: input::start_steps(&header, &program.machine),
        constant_feed: motion.feed == FeedMode::Constant,
        with_events,
        with_buffers,
    };
    let _pass = Pass::of_text("verifying");
    let commands = || open(args, &dump, &program.machine);
    let path = || Ok::<_, cnc::interp::RunError>(program.path());
    let report =
        verify_blocks(&setup, commands, path, tell).with_context(|| name.clone()).or_bad_input()?;
    judged.report = Some(report);
    Ok(())
}

/// What goes before the reason why a dump cannot be read.
fn unread(args: &Args, dump: &Source) -> String {
    let is_pair = args.files.len() == 2 && !args.unsealed;
    match is_pair && input::is_dump(dump).is_ok_and(|is_dump| !is_dump) {
        true => format!("{}, which is taken for the dump (--programs: for a program)", dump.name()),
        false => dump.name().to_owned(),
    }
}

fn open(args: &Args, dump: &Source, machine: &Machine) -> Result<Reader, TapeError> {
    if args.unsealed {
        Reader::open_unsealed(dump.clone(), machine)
    } else {
        Reader::open(dump.clone())
    }
}

/// A dump for another machine than the one at hand cannot even be read by it. (The header is no
/// part of the hash of the rows: all of it is held against what the program comes to here.)
fn check_machine(header: &Header, machine: &Machine) -> anyhow::Result<()> {
    let of = &header.machine;
    if of.name != machine.id {
        let is_built_in = BUILT_IN.iter().any(|(id, _)| *id == of.name);
        let profile = if is_built_in { &of.name } else { "FILE with its profile" };
        bail!(
            "the dump was made for machine '{}', not for '{}'; use --machine {profile}",
            of.name,
            machine.id
        );
    }
    if of.sha256 != machine.sha256() {
        bail!(
            "the dump was made for another profile of machine '{}' than the present one; \
             interpolate the program again",
            of.name
        );
    }
    Ok(())
}

/// Everything that the header says, but for names of files and of the tool that wrote it.
fn check_program(header: &Header, program: &Program) -> anyhow::Result<()> {
    if header.program.sha256 != program.sha256 {
        bail!(
            "the dump was made from another program than {}: from '{}', or from it before it was \
             changed; interpolate the program again",
            program.source.name(),
            header.program.name
        );
    }
    let missing = |of: &[Origin], other: &[Origin]| {
        of.iter().find(|input| other.iter().all(|o| o.sha256 != input.sha256)).cloned()
    };
    if let Some(input) = missing(&header.inputs, &program.inputs) {
        bail!(
            "the dump was made with the further file '{}' as it was then; a tool table is handed in \
             by --tools, a folder of subprograms by --include",
            input.name
        );
    }
    if let Some(input) = missing(&program.inputs, &header.inputs) {
        bail!("the dump was made without '{}'; leave it out", input.name);
    }
    let is_thesis = header.options.iter().any(|option| is(option, "encoder", "thesis"));
    let encoder = if is_thesis { Encoder::Thesis } else { Encoder::Exact };
    let due = program.header(encoder, header.encoding);
    check_figures(header, &due, &program.machine.id)
}

/// The rest of a header against that of a dump made here.
fn check_figures(header: &Header, due: &Header, machine: &str) -> anyhow::Result<()> {
    let list = |options: &[(String, String)]| {
        options.iter().map(|(name, value)| format!("{name}={value}")).collect::<Vec<_>>().join(" ")
    };
    if header.options != due.options {
        let [found, due] = [&header.options, &due.options].map(|options| list(options));
        bail!("the dump has the options '{found}', which this tool would write as '{due}'");
    }
    for (axis, steps) in &header.steps_per_mm {
        match due.steps_per_mm.iter().find(|(other, _)| other == axis) {
            Some((_, due)) if due == steps => {}
            Some((_, due)) => bail!(
                "the dump has {axis}={steps} steps per mm, machine '{machine}' has {axis}={due}"
            ),
            None => bail!("the dump has a column {axis}, which the program does not move"),
        }
        let [found, due] = [header, due].map(|header| header.start_steps[*axis]);
        if found != due {
            bail!("the dump starts at step {axis}={found}, where the job starts at {axis}={due}");
        }
    }
    let has = |axis| header.steps_per_mm.iter().any(|(other, _)| *other == axis);
    if let Some((axis, _)) = due.steps_per_mm.iter().find(|(axis, _)| !has(*axis)) {
        bail!("the dump has no column {axis}, which the program moves");
    }
    if header.tick_us != due.tick_us {
        let (found, due) = (header.tick_us, due.tick_us);
        bail!(
            "the dump has ticks of {found} us, machine '{machine}' has {due} us; \
             take the machine that it was made for (--machine)"
        );
    }
    Ok(())
}

fn is((name, value): &(String, String), wanted: &str, as_value: &str) -> bool {
    name == wanted && value == as_value
}

/// The options that change motion, as the dump's header has them.
fn motion(header: &Header, machine: &Machine, args: &Args) -> anyhow::Result<MotionArgs> {
    let subprograms = args.motion.language.subprograms.clone();
    let language = LanguageArgs { subprograms, ..Default::default() };
    let start = start(header, machine).filter(|_| args.unsealed);
    let feed = FeedMode::ExactStop;
    let mut motion = MotionArgs { feed, feed_override: None, start, tools: None, language };
    for option in &header.options {
        if is(option, "feed", "constant") {
            motion.feed = FeedMode::Constant;
        } else if option.0 == "start" {
            let start = option.1.parse().map_err(|reason: String| anyhow!(reason));
            motion.start = Some(start.context("option 'start' of the dump's header")?);
        } else if option.0 == "override" {
            let percent = option.1.parse().map_err(|reason: String| anyhow!(reason));
            motion.feed_override = Some(percent.context("option 'override' of the dump's header")?);
        } else if is(option, "block-delete", "on") {
            motion.language.block_delete = true;
        } else if is(option, "lenient", "on") {
            motion.language.lenient = true;
        } else if let Some(dialect) = dialect(option) {
            motion.language.dialect = DialectArg(dialect);
        } else if !is(option, "encoder", "thesis") {
            let (name, value) = option;
            bail!(
                "the dump was made with option {name}={value}, which is not known here; \
                 make it anew with `cnc interpolate --csv`"
            );
        }
    }
    Ok(motion)
}

/// The dialect that an option names.
fn dialect((name, value): &(String, String)) -> Option<Dialect> {
    let is_known = |dialect: &Dialect| name == "dialect" && value == dialect.name();
    Dialect::ALL.into_iter().find(is_known)
}

/// Where a dump starts that says so by its steps alone, unless that is where every job starts.
fn start(header: &Header, machine: &Machine) -> Option<Start> {
    let usual = machine.nearest_steps(&machine.work_zero_mm);
    let start_steps = input::start_steps(header, machine);
    (start_steps != usual).then(|| Start::at(&machine.position_mm(&start_steps)))
}

/// The table for people.
fn print(out: &mut impl Write, report: &Report, global: &Global) -> io::Result<()> {
    let row = ["check", "axis", "value", "limit", "unit", "verdict", "where"].map(str::to_owned);
    let mut rows = vec![row];
    rows.extend(report.limits.iter().map(cells));
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max();
    let widths: [usize; 7] = std::array::from_fn(|column| width(column).unwrap_or(0));
    for [check, axis, value, limit, unit, verdict, place] in &rows {
        let [w0, w1, w2, w3, w4, w5, _] = widths;
        let line = format!(
            "{check:w0$}  {axis:w1$}  {value:>w2$}  {limit:>w3$}  {unit:w4$}  {verdict:w5$}  {place}"
        );
        writeln!(out, "{}", line.trim_end())?;
    }
    writeln!(out)?;
    writeln!(out, "{}, {} s", count(report.ticks, "tick"), number(report.seconds))?;
    if let Some(rms) = report.rms_contour_error_mm {
        writeln!(out, "contour error: root mean square {} mm", number(rms))?;
    }
    if let Some(percent) = report.max_feed_error_percent {
        writeln!(out, "speed above feed, over 20 ticks: at most {} %", number(percent))?;
    }
    if let Some(percent) = report.feed_reached_percent {
        writeln!(out, "cuts reach {} % of their feed on average", number(percent))?;
    }
    if global.verbose {
        for block in &report.worst_blocks {
            let (line, tick, mm) = (block.line, block.tick, number(block.max_mm));
            writeln!(out, "line {line}: up to {mm} mm off, at tick {tick}")?;
        }
    }
    writeln!(out)?;
    match report.verdict {
        Verdict::Fail => {
            writeln!(out, "FAIL")?;
            report.failures.iter().try_for_each(|failure| writeln!(out, "  {failure}"))
        }
        Verdict::Pass | Verdict::Reported => writeln!(out, "pass"),
    }
}

fn cells(check: &Check) -> [String; 7] {
    let verdict = match check.verdict {
        Verdict::Pass => "pass",
        Verdict::Fail => "FAIL",
        Verdict::Reported => "not judged",
    };
    let place = check.at.map(|at| match at.line {
        0 => format!("tick {}", at.tick),
        line => format!("tick {}, line {line}", at.tick),
    });
    [
        check.check.to_owned(),
        check.axis.map(|axis| axis.to_string()).unwrap_or_default(),
        number(check.value),
        number(check.limit),
        check.unit.to_owned(),
        verdict.to_owned(),
        place.unwrap_or_default(),
    ]
}

/// At most four decimals, and no more than it takes.
fn number(value: f64) -> String {
    let text = format!("{value:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}
