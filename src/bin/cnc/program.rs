//! From a program to commands, as `interpolate`, `verify` and `send` all need it: checked whole
//! first, then planned and interpolated.

use std::cell::{OnceCell, RefCell};
use std::io;
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use cnc::base::{Axis, Command, Machine, Point, Source};
use cnc::interp::{self, Checked, RunError};
use cnc::path::{self, PathItem};
use cnc::plan::{self, BlockSpeed, Feed, Planned, SeamReport, Seams};
use cnc::step::{self, Summary, thesis};
use cnc::tape::{Encoding, Header, Origin};
use cnc::verify::{self, Setup, TellBlock, verify_blocks};

use crate::args::Global;
use crate::exit::{ExitWith, Failure};
use crate::input::{FeedOverride, Start};
use crate::language::LanguageArgs;
use crate::meter::Pass;
use crate::refusal::Refusal;
use crate::{input, report};

/// Options that change the motion of a job.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct MotionArgs {
    /// How speed is planned
    #[arg(long, value_enum, default_value_t, value_name = "MODE")]
    pub feed: FeedMode,
    /// Scale the feeds of cuts, from 1% to 200%, where the program lets the operator (M48, M49)
    #[arg(long = "override", value_name = "PERCENT", allow_hyphen_values = true)]
    pub feed_override: Option<FeedOverride>,
    /// Machine position at which the job starts, in mm [default: the profile's work zero]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub start: Option<Start>,
    #[command(flatten)]
    pub language: LanguageArgs,
    /// Tool table: CSV, or LinuxCNC's format; lengths in mm
    #[arg(long, value_name = "FILE")]
    pub tools: Option<PathBuf>,
}

impl MotionArgs {
    /// What these options are called.
    pub const NAMES: [&str; 9] = [
        "feed",
        "override",
        "start",
        "dialect",
        "block-delete",
        "lenient",
        "include",
        "max-passes",
        "tools",
    ];

    /// Refuses them where there is no program that they could mean.
    pub fn refuse(global: &Global, why: &str) -> anyhow::Result<()> {
        global.refuse(&MotionArgs::NAMES, why)
    }

    /// Refuses them for a dump.
    pub fn refuse_for_dump(global: &Global) -> anyhow::Result<()> {
        MotionArgs::refuse(global, "the steps of a dump are made already")
    }
}

/// How speed is planned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum FeedMode {
    /// As fast as the axes can follow, with look-ahead
    #[default]
    LookAhead,
    /// The same, at rest at the end of every block
    ExactStop,
    /// The feed throughout, without ramps: for comparison, and for drivers that ramp by themselves
    Constant,
}

/// What turns the path into counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Encoder {
    /// Differences of rounded absolute positions
    #[default]
    Exact,
    /// The seed's own, for comparison only: it loses steps, and no node may be sent it
    Thesis,
}

/// A program without errors, on a machine.
pub struct Program {
    pub source: Source,
    pub machine: Machine,
    pub checked: Checked,
    /// SHA-256 of the text that was checked.
    pub sha256: [u8; 32],
    /// Files beside the program that its motion was made from.
    pub inputs: Vec<Origin>,
    options: interp::Options,
    feed: Feed,
    /// Where node buffers end; nobody but a plan asks for it.
    seams: OnceCell<Seams>,
}

impl Program {
    /// Checks a program whole and says what is wrong with it. A program with errors is a failure, of
    /// which all has been said.
    pub fn open(file: &Path, motion: &MotionArgs, global: &Global) -> Result<Program, Failure> {
        let machine = input::machine(global)?;
        let source = input::program(file)?;
        Program::check(file, source, machine, motion, global)
    }

    /// As [`Program::open`], for a program that is open already.
    pub fn check(
        file: &Path,
        source: Source,
        machine: Machine,
        motion: &MotionArgs,
        global: &Global,
    ) -> Result<Program, Failure> {
        let options = motion.language.options(file);
        Program::check_with(options, source, machine, motion, global)
    }

    /// As [`Program::check`], for blocks that the operator has typed: they need no end.
    pub fn check_typed(
        blocks: &[String],
        machine: Machine,
        motion: &MotionArgs,
        global: &Global,
    ) -> Result<Program, Failure> {
        let source = Source::memory("<typed>", blocks.join("\n").into_bytes());
        let options = interp::Options { typed: true, ..motion.language.options(Path::new("-")) };
        Program::check_with(options, source, machine, motion, global)
    }

    fn check_with(
        options: interp::Options,
        source: Source,
        machine: Machine,
        motion: &MotionArgs,
        global: &Global,
    ) -> Result<Program, Failure> {
        let program = Program::judge_with(options, source, machine, motion, global)?;
        report::checked(program.source.name(), &program.checked, global);
        if program.checked.errors == 0 {
            return Ok(program);
        }
        Err(Refusal::of_program(program.source.name(), &program.checked)).or_bad_input()
    }

    /// Checks a program whole and says nothing: [`Program::checked`] tells whether it has errors, and then
    /// nothing else is to be asked of it.
    pub fn judge(
        file: &Path,
        source: Source,
        machine: Machine,
        motion: &MotionArgs,
        global: &Global,
    ) -> Result<Program, Failure> {
        Program::judge_with(motion.language.options(file), source, machine, motion, global)
    }

    fn judge_with(
        options: interp::Options,
        source: Source,
        machine: Machine,
        motion: &MotionArgs,
        global: &Global,
    ) -> Result<Program, Failure> {
        let start_mm = motion.start.as_ref().map(|start| start.position_mm(&machine));
        let (tools, tools_origin) = input::tools(motion.tools.as_deref())?;
        let options = interp::Options {
            start_mm,
            tools,
            feed_override_percent: motion.feed_override.map(FeedOverride::percent),
            ..options
        };
        let pass = Pass::of_text("checking");
        let (checked, sha256) =
            interp::check_and_hash(&source, &machine, &options, global.max_errors)?;
        input::has_called(&checked);
        drop(pass);
        let feed = match motion.feed {
            FeedMode::LookAhead => Feed::LookAhead,
            FeedMode::ExactStop => Feed::ExactStop,
            FeedMode::Constant => Feed::Constant,
        };
        let subprograms = checked.inputs.iter().cloned();
        let subprograms = subprograms.map(|(name, sha256)| Origin { name, sha256 });
        let inputs = tools_origin.into_iter().chain(subprograms).collect();
        let seams = OnceCell::new();
        Ok(Program { source, machine, checked, sha256, inputs, options, feed, seams })
    }

    /// Where the job starts, in machine coordinates.
    pub fn start_mm(&self) -> Point {
        self.options.start_mm.unwrap_or(self.machine.work_zero_mm)
    }

    /// How its speed is planned.
    pub fn feed(&self) -> Feed {
        self.feed
    }

    /// The path that the program means.
    pub fn path(&self) -> impl Iterator<Item = Result<PathItem, RunError>> {
        self.path_for("following the path")
    }

    /// The same, for a pass that is shown by a name of its own.
    fn path_for(&self, what: &'static str) -> impl Iterator<Item = Result<PathItem, RunError>> {
        let summary = &self.checked.summary;
        let total = summary.moves + summary.events;
        let motions = interp::motions(&self.source, &self.machine, &self.options);
        path::segments(Watched { inner: motions, what, total, done: 0, pass: None }, &self.machine)
    }

    /// When the machine is where on the path.
    pub fn plan(&self) -> Result<impl Iterator<Item = Result<Planned, RunError>>, RunError> {
        let (start, seams) = (self.start_mm(), self.seams()?);
        Ok(plan::plan(self.path_for("planning"), &self.machine, self.feed, seams, start))
    }

    /// The commands of the job; the summary grows as they are taken.
    pub fn commands<'a>(
        &'a self,
        summary: &'a RefCell<Summary>,
    ) -> Result<impl Iterator<Item = Result<Command, RunError>> + 'a, RunError> {
        let plan = self.plan()?.inspect(|planned| {
            if let Ok(planned) = planned {
                summary.borrow_mut().planned(planned);
            }
        });
        let commands = step::interpolate(plan, &self.machine, self.start_mm());
        let (what, total) = ("planning", u64::MAX);
        let commands = Watched { inner: commands, what, total, done: 0, pass: None };
        Ok(commands.inspect(|command| {
            if let Ok(command) = command {
                summary.borrow_mut().command(command);
            }
        }))
    }

    /// The commands that the seed's own encoder makes of the path.
    pub fn thesis_commands<'a>(
        &'a self,
        summary: &'a RefCell<Summary>,
    ) -> impl Iterator<Item = Result<Command, RunError>> + 'a {
        thesis::encode(self.path(), &self.machine).inspect(|command| {
            if let Ok(command) = command {
                summary.borrow_mut().command(command);
            }
        })
    }

    /// The job's commands held against the path, as `verify` would hold its dump: planned anew, unless they
    /// are at hand. Tells of each block, if that is wanted.
    pub fn verified(
        &self,
        commands: Option<&[Command]>,
        tell: Option<TellBlock>,
    ) -> anyhow::Result<verify::Report> {
        let machine = &self.machine;
        let setup = Setup {
            machine,
            tick_us: machine.bus.tick_us,
            start_steps: machine.nearest_steps(&self.start_mm()),
            constant_feed: self.feed == Feed::Constant,
            with_events: true,
            with_buffers: true,
        };
        let summary = RefCell::new(Summary::default());
        let _pass = Pass::begin("verifying");
        let path = || Ok::<_, RunError>(self.path());
        Ok(match commands {
            Some(commands) => {
                verify_blocks(&setup, || Ok::<_, RunError>(given(commands)), path, tell)?
            }
            None => verify_blocks(&setup, || self.commands(&summary), path, tell)?,
        })
    }

    /// Where node buffers end, found when it is first asked for.
    fn seams(&self) -> Result<&Seams, RunError> {
        if let Some(seams) = self.seams.get() {
            return Ok(seams);
        }
        let path = || self.path_for("placing the ends of buffers");
        let placed = plan::place(path, &self.machine, self.feed)?;
        Ok(self.seams.get_or_init(|| placed))
    }

    /// Whether a tool that stands at a place, at blocks of these lines, is where it cannot be put back.
    pub fn is_captive(&self, lines: &[u32], at_mm: &Point) -> Result<bool, RunError> {
        let motions = interp::motions(&self.source, &self.machine, &self.options);
        interp::is_captive(motions, &self.machine, lines, at_mm)
    }

    /// What sets the speed of each block.
    pub fn block_speeds(
        &self,
    ) -> Result<impl Iterator<Item = Result<BlockSpeed, RunError>>, RunError> {
        let seams = self.seams()?;
        Ok(plan::explain(self.path_for("planning"), &self.machine, self.feed, seams))
    }

    /// What each seam costs.
    pub fn seam_costs(&self) -> Result<SeamReport, RunError> {
        let seams = self.seams()?;
        plan::survey(self.path_for("comparing ends of buffers"), &self.machine, self.feed, seams)
    }

    /// Whether it turns: by its dialect, or because its machine has no Y.
    pub fn is_turning(&self) -> bool {
        self.options.dialect.lathe().is_some() || self.machine.axis(Axis::Y).is_none()
    }

    /// The header of the job's dump.
    pub fn header(&self, encoder: Encoder, encoding: Encoding) -> Header {
        let machine = &self.machine;
        let dialect = self.options.dialect.name();
        let mut options = vec![("dialect".to_owned(), dialect.to_owned())];
        if self.options.block_delete {
            options.push(("block-delete".to_owned(), "on".to_owned()));
        }
        if self.options.lenient {
            options.push(("lenient".to_owned(), "on".to_owned()));
        }
        if let Some(percent) = self.options.feed_override_percent {
            options.push(("override".to_owned(), percent.to_string()));
        }
        if self.feed == Feed::Constant {
            options.push(("feed".to_owned(), "constant".to_owned()));
        }
        if encoder == Encoder::Thesis {
            options.push(("encoder".to_owned(), "thesis".to_owned()));
        }
        let used = |axis: &Axis| {
            Axis::LINEAR.contains(axis) || self.checked.summary.axes_used.contains(*axis)
        };
        let columns = machine.axes.iter().filter(|profile| used(&profile.axis));
        if let Some(start_mm) = &self.options.start_mm {
            options.push(("start".to_owned(), Start::at(start_mm).to_string()));
        }
        Header {
            tool: format!("cnc {}", env!("CARGO_PKG_VERSION")),
            program: Origin { name: self.source.file_name().to_owned(), sha256: self.sha256 },
            inputs: self.inputs.clone(),
            options,
            machine: Origin { name: machine.id.clone(), sha256: machine.sha256() },
            tick_us: match encoder {
                Encoder::Exact => machine.bus.tick_us,
                Encoder::Thesis => thesis::TICK_US,
            },
            steps_per_mm: columns.map(|profile| (profile.axis, profile.steps_per_mm)).collect(),
            start_steps: machine.nearest_steps(&self.start_mm()),
            encoding,
        }
    }
}

/// Commands that are at hand, as a stream.
pub fn given(commands: &[Command]) -> impl Iterator<Item = Result<Command, RunError>> {
    commands.iter().cloned().map(Ok)
}

/// Takes what a pass gives, tells how far it is, and ends it when the operator wants that.
struct Watched<I> {
    inner: I,
    what: &'static str,
    /// What the pass will have given at its end, if that is known; else [`u64::MAX`].
    total: u64,
    done: u64,
    /// From the first item to the last.
    pass: Option<Pass>,
}

impl<T, I: Iterator<Item = Result<T, RunError>>> Iterator for Watched<I> {
    type Item = Result<T, RunError>;

    fn next(&mut self) -> Option<Self::Item> {
        let (what, done, total) = (self.what, self.done, self.total);
        let pass = self.pass.get_or_insert_with(|| Pass::begin(what));
        if Pass::is_due(done, total)
            && let Err(stop) = pass.at(done, total)
        {
            return Some(Err(RunError::Io(io::Error::other(stop))));
        }
        self.done += 1;
        let next = self.inner.next();
        if next.is_none() {
            self.pass = None;
        }
        next
    }
}
