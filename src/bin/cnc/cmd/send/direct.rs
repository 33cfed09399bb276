//! Jobs that no file is read for, as `jog` and `home` make them: their options, and what is said of
//! what nodes do by themselves.

use std::path::PathBuf;

use anyhow::anyhow;
use cnc::base::rounding::six_digits;
use cnc::base::source::visible;
use cnc::base::{Axis, Machine};
use cnc::wire::{Audit, Direct, HomeRun, Job, Step};
use cnc::wire_io::Speed;
use serde_json::{Value, json};

use super::{Args, sim::Simulation};
use crate::journal::JournalArgs;
use crate::port::PortArgs;

/// Where such a job goes, and how.
#[derive(Clone, Debug, clap::Args)]
pub struct DirectArgs {
    #[command(flatten)]
    pub port: PortArgs,
    /// Check and show what would be done, send nothing
    #[arg(long)]
    pub dry_run: bool,
    /// Do not ask before it starts
    #[arg(long)]
    pub yes: bool,
    /// Pace so many times faster, for virtual nodes that run at the same speed
    #[arg(long, value_name = "K|max")]
    pub speed: Option<Speed>,
    /// Write every byte both ways and its time, as JSON Lines (cnc replay reads them)
    #[arg(long, value_name = "FILE")]
    pub trace: Option<PathBuf>,
    #[command(flatten)]
    pub journal: JournalArgs,
}

impl DirectArgs {
    /// The same, as options of `send`; whether it asks is decided by the caller.
    pub fn to_send(&self, asks: bool) -> Args {
        Args {
            port: self.port.clone(),
            dry_run: self.dry_run,
            yes: self.yes || !asks,
            speed: self.speed,
            trace: self.trace.clone(),
            journal: self.journal.clone(),
            ..Args::default()
        }
    }

    /// Whether the nodes are within this program.
    pub fn is_sim(&self) -> anyhow::Result<bool> {
        Ok(Simulation::of_port(&self.port.port)?.is_some())
    }
}

/// Refuses axes that the machine has not.
pub fn check_axes(axes: &[Axis], machine: &Machine) -> anyhow::Result<()> {
    let Some(axis) = axes.iter().find(|axis| machine.axis(**axis).is_none()) else { return Ok(()) };
    Err(anyhow!("machine {} has no axis {axis}: it has {}", machine.id, machine.axis_names()))
}

/// What a job lets nodes do by themselves.
pub fn of_job(job: &Job) -> impl Iterator<Item = &Direct> {
    job.steps.iter().filter_map(|step| match step {
        Step::Direct(direct) => Some(direct),
        Step::Buffer(_) | Step::Event(_) => None,
    })
}

/// What is about to happen.
pub fn announced(direct: &Direct) -> String {
    match direct {
        Direct::Home(home) => {
            let (axis, id, seconds) = (home.axis, home.unit.id, home.wait_us as f64 * 1e-6);
            format!(
                "home      {axis} (node {id}): towards minus until its switch closes, {seconds:.1} s at most"
            )
        }
        Direct::Jog(jog) => {
            let (axis, id, seconds) = (jog.axis, jog.unit.id, jog.lasts_us as f64 * 1e-6);
            let way = if jog.count < 0 { "minus" } else { "plus" };
            format!(
                "raw jog   {axis} (node {id}): towards {way}, no ramp and no limits, for {seconds:.1} s; Enter, Ctrl-C or the end of input stops it"
            )
        }
    }
}

/// What has become of it.
pub fn told(run: &HomeRun) -> String {
    let (axis, seconds) = (run.axis, run.took_us as f64 * 1e-6);
    let [low, high] = run.made_steps;
    let beyond = HomeRun::BEYOND_STEPS_MAX;
    let told = format!(
        "{axis} is at its switch, {beyond} steps beyond it at most, after {seconds:.2} s: {low} to {high} steps"
    );
    match (run.audit(), run.counted_steps) {
        (Audit::Agrees, Some(counted)) => format!("{told}; {counted} were counted, which agrees"),
        (Audit::OffBy(steps), Some(counted)) => format!(
            "{told}; {counted} were counted: off by {steps} steps at least. Steps were lost, or {axis} did not \
             stand where it was said to"
        ),
        _ => told,
    }
}

/// The same as JSON.
pub fn as_json(run: &HomeRun) -> Value {
    let (audit, off_by) = match run.audit() {
        Audit::NotCounted => ("not-counted", None),
        Audit::Agrees => ("agrees", None),
        Audit::OffBy(steps) => ("off", Some(steps)),
    };
    json!({
        "seconds": six_digits(run.took_us as f64 * 1e-6),
        "beyond_steps_max": HomeRun::BEYOND_STEPS_MAX,
        "made_steps": run.made_steps,
        "counted_steps": run.counted_steps,
        "audit": audit,
        "off_by_steps": off_by,
    })
}

/// Axes as a user lists them: `X Z`, `xz`, `X,Z`.
pub fn axes(text: &str) -> Result<AxisList, String> {
    let letters = text.chars().filter(|letter| *letter != ',');
    let axis = |letter: char| {
        let known = u8::try_from(letter.to_ascii_uppercase()).ok().and_then(Axis::from_letter);
        let letter = visible(letter);
        known.ok_or_else(|| format!("'{letter}' is no axis; expected X, Y, Z, A, B, C, U, V or W"))
    };
    letters.map(axis).collect::<Result<Vec<_>, _>>().map(AxisList)
}

/// See [`axes`].
#[derive(Clone, Debug)]
pub struct AxisList(pub Vec<Axis>);

/// One axis.
pub fn axis(text: &str) -> Result<Axis, String> {
    let is_way = |letter: char| matches!(letter, '+' | '-' | '.') || letter.is_ascii_digit();
    if text.starts_with(|letter: char| letter.is_ascii_alphabetic()) && text[1..].contains(is_way) {
        return Err("an axis is expected, as X; --by says how far, as --by -5".to_owned());
    }
    match axes(text)?.0[..] {
        [axis] => Ok(axis),
        _ => Err("one axis is expected, as X: axes are jogged one after another".to_owned()),
    }
}
