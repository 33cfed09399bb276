//! `cnc send`: a program or a dump is checked, shown, and streamed to the nodes.

mod book;
pub mod direct;
mod live;
mod operator;
mod pacing;
mod plc;
mod result;
pub mod resume;
pub mod sim;
mod tracing;

use std::cell::RefCell;
use std::path::{Path, PathBuf};

use anyhow::anyhow;
use cnc::base::machine::Protocol;
use cnc::base::{AxisMap, Command, Machine, Progress, Source};
use cnc::step::Summary;
use cnc::tape::{self, Encoding, Header};
use cnc::wire::{
    self, ANSWER_PAUSE_US, Direct, End, Ending, FaultSpec, Faults, Job, JobError, Master, Nodes,
    Timing,
};
use cnc::wire_io::journal::{self, JobRecord};
use cnc::wire_io::{self, Link, Paced, Sim, Speed, Traced, drive};

use self::book::Book;
use self::operator::Terminal;
use self::plc::{PlcArgs, SignalFiles};
use self::result::{Report, Simulated};
use self::resume::Resume;
use self::sim::Simulation;
use self::tracing::Tracing;
use crate::args::Global;
use crate::exit::{Exit, ExitWith, Failure, Outcome, told};
use crate::interrupt::Interrupts;
use crate::journal::{JournalArgs, PortJournal, Told};
use crate::meter::Pass;
use crate::port::{Port, PortArgs};
use crate::program::{Encoder, FeedMode, MotionArgs, Program};
use crate::progress::Bar;
use crate::protocol::{NO_MAX, ProtocolArgs};
use crate::refusal::Refusal;
use crate::{input, output};

/// Stream a program or a command dump to the nodes
///
/// All of it is checked before the port is opened. Ctrl-C holds where the axes are slow enough to
/// stop without a ramp, or at the end of the buffer, and asks whether to go on; a second one stops
/// at once.
#[derive(Debug, Default, clap::Args)]
pub struct Args {
    #[command(flatten)]
    pub port: PortArgs,
    /// NC program or command dump; - is standard input
    #[arg(value_name = "FILE", required_unless_present = "execute")]
    file: Option<PathBuf>,
    /// Instead of a file: a block as typed; may be given again, for the blocks after it
    #[arg(short, long, value_name = "BLOCK", conflicts_with = "file")]
    execute: Vec<String>,
    /// Check and show the job, send nothing
    #[arg(long)]
    dry_run: bool,
    /// Do not ask before the job starts
    #[arg(long)]
    yes: bool,
    /// Pace so many times faster, for virtual nodes that run at the same speed
    #[arg(long, value_name = "K|max")]
    speed: Option<Speed>,
    /// Go over M0, M1, M6 and M60 without waiting
    #[arg(long)]
    ignore_stops: bool,
    /// Stop before each block, show it and ask; every block ends at rest
    #[arg(long, conflicts_with = "feed")]
    single_block: bool,
    /// Run the profile's hooks on simulated nodes (sim:) too; on a port they always run
    #[arg(long)]
    hooks: bool,
    /// Write every byte both ways and its time, as JSON Lines (cnc replay reads them)
    #[arg(long, value_name = "FILE")]
    trace: Option<PathBuf>,
    /// Go on with the job that this journal tells of, from its last seam
    #[arg(long, value_name = "JOURNAL", conflicts_with = "execute")]
    resume: Option<PathBuf>,
    #[command(flatten)]
    journal: JournalArgs,
    #[command(flatten)]
    protocol: ProtocolArgs,
    #[command(flatten)]
    plc: PlcArgs,
    #[command(flatten)]
    motion: MotionArgs,
}

pub fn run(args: &Args, global: &Global) -> Outcome {
    args.check_outputs()?;
    let source = args.file.as_deref().map(input::source).transpose()?;
    let port = args.port.port(global)?;
    let machine = args.protocol.machine(global)?;
    check_speed(args, &port, &machine)?;
    let program = match (&args.file, source) {
        (Some(_), Some(source)) if input::is_dump(&source)? => {
            MotionArgs::refuse_for_dump(global)?;
            let (job, origin) = dump(&source, &machine, args.single_block)?;
            let work = Work { record: book::record(&origin), program: None };
            return run_job(args, global, &port, &machine, job, work);
        }
        (Some(file), Some(source)) => {
            let motion = motion(args, &port, &machine, global)?;
            Program::check(file, source, machine, &motion, global)?
        }
        _ => {
            let motion = motion(args, &port, &machine, global)?;
            Program::check_typed(&args.execute, machine, &motion, global)?
        }
    };
    let machine = &program.machine;
    let summary = RefCell::new(Summary::default());
    let start_steps = machine.nearest_steps(&program.start_mm());
    let commands = program.commands(&summary)?;
    let job = gather_blocks(commands, start_steps, machine, args.single_block)?.or_bad_input()?;
    let origin = program.header(Encoder::Exact, Encoding::Counts);
    let command = if args.file.is_some() { "send" } else { "typed" };
    let record = JobRecord { command: command.to_owned(), ..book::record(&origin) };
    run_job(args, global, &port, machine, job, Work { record, program: Some(&program) })
}

impl Args {
    /// Makes sure that all can be written that is asked for, before a long program is planned.
    fn check_outputs(&self) -> anyhow::Result<()> {
        let outputs = [&self.trace, &self.journal.journal, &self.plc.signals, &self.plc.svg];
        output::check_writable(&outputs.map(Option::as_deref))
    }

    /// Refuses what a PLC cannot do; two outputs of one name, and traces and signals over a journal.
    fn check(&self, job: &Job, machine: &Machine, port: &Port) -> Result<(), Failure> {
        self.plc.check(job, machine, port.is_real())?;
        for journal in [&self.resume, &self.journal.journal] {
            let outputs = [&self.trace, &self.plc.signals, &self.plc.svg, journal];
            output::check_distinct(&outputs.map(Option::as_deref))?;
        }
        Ok(())
    }
}

/// How the job is planned: from where the user says, or else from where the one began that it goes on with,
/// or else from where axes stand that have been homed.
fn motion(
    args: &Args,
    port: &Port,
    machine: &Machine,
    global: &Global,
) -> Result<MotionArgs, Failure> {
    let mut motion = args.motion.clone();
    if args.single_block {
        motion.feed = FeedMode::ExactStop;
    }
    if motion.start.is_none() {
        motion.start = match &args.resume {
            Some(journal) => resume::start(journal)?,
            None => Told::of(port, &args.journal, machine)?.start(machine),
        };
        if motion.start.is_some() && args.resume.is_none() && !global.quiet {
            say!("the job is planned from where the axes stand");
        }
    }
    Ok(motion)
}

/// What a job was made from.
pub struct Work<'a> {
    /// What the journal says of it.
    pub record: JobRecord,
    /// The program, if it is at hand: virtual nodes' motion is held against it.
    pub program: Option<&'a Program>,
}

/// What is written down while a job runs.
struct Notes<'a> {
    /// Begins with the job.
    tracing: Option<Tracing>,
    book: Option<Book<'a>>,
    signals: Option<SignalFiles>,
    /// Why the record of signals is not there.
    unwritten: Option<Failure>,
}

impl Notes<'_> {
    /// A job whose journal or record of signals is not whole has failed, whatever became of it.
    fn verdict(self, outcome: Outcome) -> Outcome {
        let exit = match self.book {
            Some(book) => book.verdict(outcome),
            None => outcome,
        }?;
        let Some(failure) = self.unwritten else { return Ok(exit) };
        say!("error: {}", told(&failure.error));
        Ok(if exit == Exit::Ok { Exit::Unusable } else { exit })
    }
}

/// A job that `jog` or `home` made.
pub fn by_hand(command: &str, machine: &Machine) -> Work<'static> {
    Work { record: book::by_hand(command, machine), program: None }
}

/// Lints, shows and runs a job, or what is left of it.
pub fn run_job(
    args: &Args,
    global: &Global,
    port: &Port,
    machine: &Machine,
    job: Job,
    mut work: Work<'_>,
) -> Outcome {
    let machine = &port.machine(machine);
    work.record.plan_sha256 = journal::hex(&job.sha256());
    let (job, work) = match &args.resume {
        Some(journal) => resumed(args, port, machine, journal, job, work)?,
        None => (job, work),
    };
    let proof = wire::lint(&job, machine).or_bad_input()?;
    let simulation = Simulation::of_port(&args.port.port)?;
    let faults = simulation.map(|simulation| simulation.faults_of(machine)).transpose()?;
    let is_direct = direct::of_job(&job).next().is_some();
    let report = Report { machine, global, is_direct };
    args.check(&job, machine, port)?;
    let calls = wire_io::calls(&job, machine).or_bad_input()?;
    let runs_hooks = args.hooks || faults.is_none();
    report.job(&job, &calls, args.dry_run);
    args.plc.announce(global);
    report.hooks(&calls, runs_hooks, args.dry_run)?;
    let mut operator = operator(args, global, machine, runs_hooks)?;
    if args.dry_run {
        report.dry_run(&job, &calls, &proof)?;
        return Ok(Exit::Ok);
    }
    operator.check_stops(&job).or_bad_input()?;
    if faults.is_none() {
        port.check_free()?;
    }
    let mut journal = PortJournal::open(&port.path()?, &args.journal, machine, global)?;
    if let Some(journal) = journal.as_ref().filter(|_| faults.is_none()) {
        // Who homes does not care where the axes stand, nor who jogs raw.
        match is_direct {
            true => journal.check_unlocked(),
            false => journal.check_position(&job, machine, global),
        }?;
    }
    confirm(args, &operator)?;
    if let Some(program) = work.program.filter(|_| !global.quiet || args.single_block) {
        operator.list(program.source.clone())?;
    }
    if direct::of_job(&job).any(|direct| matches!(direct, Direct::Jog(_))) {
        operator.stop_on_input();
    }
    if let Some(plc) = args.plc.open(machine)? {
        operator = operator.with_plc(plc);
    }
    let tracing = Tracing::create(args, faults.is_some(), work.record.resumed.clone())?;
    let journal = journal.as_mut().map(|opened| &mut opened.journal);
    let record = JobRecord { port: args.port.port.display().to_string(), ..work.record };
    let signals = Some(SignalFiles::create(&args.plc, &record.program.name)?);
    let book = journal.map(|journal| Book::new(journal, record));
    let mut notes = Notes { tracing, book, signals, unwritten: None };
    let outcome = match faults {
        Some(faults) => simulate(&report, job, operator, faults, work.program, &mut notes),
        None => send(args, port, &report, job, operator, &mut notes),
    };
    notes.verdict(outcome)
}

/// Goes on only if the operator wants the job that was shown.
fn confirm(args: &Args, operator: &Terminal) -> Result<(), Failure> {
    if args.resume.is_some() && !args.yes && !operator.can_ask() {
        let reason = "--resume starts nothing by itself: say --yes to what is shown";
        return Err(anyhow!(reason).into());
    }
    if args.yes || operator.asks("Start the job?") {
        return Ok(());
    }
    say!("nothing was sent");
    let error = Refusal::told("the start was not confirmed: nothing was sent").into();
    Err(Failure { code: 130, error })
}

/// Refuses what needs answers, where nodes have none.
fn check_answers(args: &Args, machine: &Machine) -> anyhow::Result<()> {
    if machine.bus.protocol != Protocol::Frame {
        return Ok(());
    }
    if args.speed == Some(Speed::Max) {
        return Err(anyhow!(NO_MAX));
    }
    if args.resume.is_some() {
        return Err(anyhow!(
            "--resume goes on from the last place that nodes have acknowledged, and nodes that take frames \
             acknowledge nothing: send what is left as a program of its own"
        ));
    }
    Ok(())
}

/// The person at the terminal, with what helps to do events.
fn operator(
    args: &Args,
    global: &Global,
    machine: &Machine,
    runs_hooks: bool,
) -> anyhow::Result<Terminal> {
    let (tools, _) = input::tools(args.motion.tools.as_deref())?;
    let interrupts = Interrupts::watch()?;
    let operator = Terminal::new(args.ignore_stops, global, interrupts).with_tools(tools);
    let operator = if args.plc.is_given() { operator.leaving_tools_to_plc() } else { operator };
    Ok(if runs_hooks { operator.with_hooks(machine) } else { operator })
}

/// What is left of a job, from where the machine stands; says what it will do.
fn resumed<'w>(
    args: &Args,
    port: &Port,
    machine: &Machine,
    journal: &Path,
    job: Job,
    mut work: Work<'w>,
) -> Result<(Job, Work<'w>), Failure> {
    let resume = Resume::of(journal, &work.record, machine)?;
    let (start, told) = (job.start_steps, Told::of(port, &args.journal, machine)?.steps);
    let stands = AxisMap::from_fn(|axis| told[axis].unwrap_or(start[axis]));
    let plan = resume.plan(&job, stands, machine, work.program)?;
    plan.told.iter().for_each(|line| say!("resume    {line}"));
    (work.record.resumed, work.program) = (Some(plan.resumed), None);
    Ok((plan.job, work))
}

/// Makes a job of commands as they come: it takes a tenth of their memory. The first error of the
/// source, or else of the job.
pub fn gather<E>(
    commands: impl Iterator<Item = Result<Command, E>>,
    start_steps: AxisMap<i64>,
    machine: &Machine,
) -> Result<Result<Job, JobError>, E> {
    gather_blocks(commands, start_steps, machine, false)
}

/// The same, with a question before each block if that is wanted.
pub fn gather_blocks<E>(
    commands: impl Iterator<Item = Result<Command, E>>,
    start_steps: AxisMap<i64>,
    machine: &Machine,
    single_block: bool,
) -> Result<Result<Job, JobError>, E> {
    let mut failed = None;
    let good = commands.map_while(|command| command.map_err(|error| failed = Some(error)).ok());
    let job = match single_block {
        true => Job::new(wire::single_blocks(good), start_steps, machine),
        false => Job::new(good, start_steps, machine),
    };
    failed.map_or(Ok(job), Err)
}

/// The job of a dump. Its seal stands at its end, and is checked before anything else is.
pub fn dump(
    source: &Source,
    machine: &Machine,
    single_block: bool,
) -> Result<(Job, Header), Failure> {
    let open = || tape::Reader::open(source.clone()).or_bad_input();
    let mut reader = open()?;
    let header = reader.header().clone();
    let stranger = |what: &str| {
        let name = source.name();
        Err(anyhow!("{name} was made {what}; make it anew with `cnc interpolate --csv`"))
            .or_bad_input()
    };
    if header.machine.sha256 != machine.sha256() {
        let made_for = &header.machine.name;
        if *made_for == machine.id && machine.bus.protocol == Protocol::Frame {
            let name = source.name();
            let reason = anyhow!(
                "{name} was made for machine {made_for} as its profile is; with --protocol frame send the \
                 program, or make the dump with a profile whose bus.protocol is \"frame\""
            );
            return Err(reason).or_bad_input();
        }
        return stranger(&format!(
            "for machine {made_for} or another version of it, not for {}",
            machine.id
        ));
    }
    let scale = |axis| machine.axis(axis).map(|profile| profile.steps_per_mm);
    if let Some((axis, steps)) = header.steps_per_mm.iter().find(|(a, s)| scale(*a) != Some(*s)) {
        return stranger(&format!("with {axis}={steps} steps per mm, which the machine has not"));
    }
    if header.tick_us != machine.bus.tick_us {
        let (made, bus) = (header.tick_us, machine.bus.tick_us);
        return stranger(&format!("with ticks of {made} µs, the bus has {bus} µs"));
    }
    if header.options.iter().any(|(name, value)| name == "encoder" && value == "thesis") {
        return stranger("with --encoder thesis, which is for comparison only");
    }
    let start_steps = input::start_steps(&header, machine);
    let pass = Pass::of_text("checking");
    reader.try_for_each(|command| command.map(drop)).or_bad_input()?;
    drop(pass);
    let _pass = Pass::of_text("reading");
    let job = gather_blocks(open()?, start_steps, machine, single_block);
    let job = job.or_bad_input()?.or_bad_input()?;
    Ok((job, header))
}

/// Real nodes keep their own time, those within this program need none, and those that cannot answer keep
/// nothing back.
pub fn check_speed(args: &Args, port: &Port, machine: &Machine) -> anyhow::Result<()> {
    check_answers(args, machine)?;
    if args.speed.is_some() && Simulation::of_port(&args.port.port)?.is_some() {
        return Err(anyhow!("--speed has no effect: simulated nodes (sim:) take no time anyway"));
    }
    if args.speed.is_some() && port.is_real() {
        let port = args.port.port.display();
        return Err(anyhow!("--speed is for virtual nodes (`cnc node`), {port} is a real device"));
    }
    Ok(())
}

fn simulate(
    report: &Report<'_>,
    job: Job,
    mut operator: Terminal,
    faults: Vec<FaultSpec>,
    program: Option<&Program>,
    notes: &mut Notes<'_>,
) -> Outcome {
    let machine = report.machine;
    let bus = &machine.bus;
    report.faults(&faults);
    let nodes = Nodes::new(machine, bus.units(), &job.start_steps, ANSWER_PAUSE_US);
    let asked = faults.len();
    let faults = Faults::of_bus(faults, bus);
    let mut link = Sim::new(nodes.with_faults(faults));
    let timing = Timing::new(bus, 1.0);
    let (job, ending) = stream(&mut link, machine, job, timing, &mut operator, notes)?;
    let nodes = link.nodes_mut();
    let struck: Vec<_> = std::iter::from_fn(|| nodes.poll_struck()).collect();
    report.struck(&struck, asked);
    let mut hazards = 0;
    while let Some(entry) = nodes.poll_log() {
        if let Some(hazard) = entry.hazard {
            say!("hazard at {}: it {hazard}", entry.unit);
            hazards += 1;
        }
    }
    let difference = job.first_difference(&link.nodes().executed());
    let contour = match program {
        Some(program) if ending.end == End::Done && difference.is_none() => {
            Some(program.verified(None, None)?)
        }
        _ => None,
    };
    let outcome =
        report.simulated(&job, &ending, Simulated { difference, hazards, contour, struck });
    operator.say_left_on(&ending);
    outcome
}

fn send(
    args: &Args,
    port: &Port,
    report: &Report<'_>,
    job: Job,
    mut operator: Terminal,
    notes: &mut Notes<'_>,
) -> Outcome {
    let machine = report.machine;
    let speed = args.speed.unwrap_or(Speed::Times(1.0));
    let timing = port.timing(&machine.bus, speed);
    let port = port.open(&machine.bus, |note| operator.say(note))?;
    let mut link = Paced::new(port, speed);
    let (_, ending) = stream(&mut link, machine, job, timing, &mut operator, notes)?;
    let outcome = report.ending(&ending, link.priority());
    operator.say_left_on(&ending);
    outcome
}

/// Runs a job, and writes it down where there is a journal. The job has not begun when that cannot
/// be written.
fn stream(
    link: &mut impl Link,
    machine: &Machine,
    job: Job,
    timing: Timing,
    operator: &mut Terminal,
    notes: &mut Notes<'_>,
) -> anyhow::Result<(Job, Ending)> {
    operator.watch(&job, machine);
    let total = job.ticks;
    if let Some(book) = &mut notes.book {
        book.begin(&job, machine)?;
    }
    let tracing = notes.tracing.take();
    let trace = tracing.map(|tracing| tracing.begin(machine, &job)).transpose()?;
    let mut master = Master::new(job, machine, timing);
    let mut link = Traced::new(link, trace);
    operator.bar.begin(total);
    let ending = match &mut notes.book {
        Some(book) => drive(&mut link, &mut master, &mut book.journaled(operator)),
        None => drive(&mut link, &mut master, operator),
    };
    operator.bar.end();
    let plc = operator.end_plc();
    if let (Some(plc), Some(files)) = (plc, notes.signals.take()) {
        notes.unwritten = files.write(plc.samples()).err();
    }
    let now_us = link.now_us();
    if let Some(trace) = link.into_trace() {
        trace.end(now_us, tracing::ending(&ending.end));
    }
    if let Some(book) = &mut notes.book {
        book.end(&ending);
    }
    Ok((master.into_job(), ending))
}
