//! A port's journal: where it lies, and whether what it says lets a job run.

use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use cnc::base::{Axis, AxisMap, AxisSet, Machine};
use cnc::wire::Job;
use cnc::wire_io::is_pseudo_terminal;
use cnc::wire_io::journal::{self, History, Journal, Place, Record};

use crate::args::Global;
use crate::exit::{ExitWith, Failure};
use crate::input::Start;
use crate::port::Port;

/// Options of all commands that move a machine.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct JournalArgs {
    /// Journal of what was sent and acknowledged [default: the port's own, in the user's state
    /// folder]
    #[arg(long, value_name = "FILE")]
    pub journal: Option<PathBuf>,
    /// The nodes have been switched off and on: they hold no buffer, and no axis is known
    #[arg(long)]
    pub power_cycled: bool,
    /// The machine stands here, whatever the journal says (machine coordinates)
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub at: Option<Start>,
}

/// The journal of a port, its axes, and how strictly it is taken.
pub struct PortJournal {
    pub journal: Journal,
    axes: Vec<Axis>,
    is_pty: bool,
}

impl PortJournal {
    /// Opens the journal of a port and writes down what the operator says about the machine. None
    /// where there is nothing to keep: simulated nodes, or a port that is not there.
    pub fn open(
        port: &Path,
        args: &JournalArgs,
        machine: &Machine,
        global: &Global,
    ) -> Result<Option<PortJournal>, Failure> {
        let path = match &args.journal {
            Some(path) => Some(path.clone()),
            None => default_path(port)?,
        };
        if path.is_none() && is_pseudo_terminal(port) && !global.quiet {
            say!("warning: there is no folder to keep a journal in; --journal FILE names one");
        }
        let Some(path) = path else { return Ok(None) };
        let journal = Journal::open(&path).map_err(|error| {
            let busy = matches!(error, journal::JournalError::Busy(_));
            Failure { code: if busy { 3 } else { 2 }, error: error.into() }
        })?;
        let axes = machine.bus.nodes.keys().copied().collect();
        let mut opened = PortJournal { journal, axes, is_pty: is_pseudo_terminal(port) };
        opened.hear(args, machine)?;
        Ok(Some(opened))
    }

    fn hear(&mut self, args: &JournalArgs, machine: &Machine) -> anyhow::Result<()> {
        if args.power_cycled {
            self.journal.append(Record::PowerCycled { time: journal::now() })?;
        }
        if let Some(start) = &args.at {
            let steps = machine.nearest_steps(&start.position_mm(machine));
            let position = journal::steps_of(self.axes.iter().copied(), &steps);
            let placed = Record::Placed {
                time: journal::now(),
                by: "operator".to_owned(),
                machine: machine.id.clone(),
                position,
            };
            self.journal.append(placed)?;
        }
        Ok(())
    }

    /// Refuses to send anything while nodes may hold a buffer (exit 3).
    pub fn check_unlocked(&self) -> Result<(), Failure> {
        let Some(why) = self.journal.history().locked() else { return Ok(()) };
        Err(anyhow!(
            "{why}. Any byte would be a tick to nodes that were stopped in execution: switch all \
             nodes off and on, say so with --power-cycled, then home the machine (journal {})",
            self.journal.path().display()
        ))
        .or_bus()
    }

    /// Refuses to move a machine of which it is not known where it stands, or that stands elsewhere
    /// (exit 3). Behind a pseudo-terminal, which may have been given other nodes, the last is a
    /// warning.
    pub fn check_position(
        &self,
        job: &Job,
        machine: &Machine,
        global: &Global,
    ) -> Result<(), Failure> {
        self.check_unlocked()?;
        if !is_of(self.journal.history(), machine) {
            return self.check_machine(machine, global);
        }
        let steps = &job.start_steps;
        let mut stands = *steps;
        for axis in self.axes.iter().filter(|axis| job.axes.contains(**axis)) {
            match self.journal.history().place(*axis) {
                Place::Untold => {}
                Place::Known(known) => stands[*axis] = known,
                Place::Unknown(why) => {
                    return Err(anyhow!(
                        "nobody knows where axis {axis} stands ({why}): `cnc home` finds out, or --at \
                         says it"
                    ))
                    .or_bus();
                }
            }
        }
        if stands == *steps {
            return Ok(());
        }
        let (stands, starts) = (self.shown(&stands, machine), self.shown(steps, machine));
        let differs = format!(
            "by the journal the machine stands at {stands}, the job starts at {starts}: plan it from \
             there with --start, or say with --at where the machine stands"
        );
        self.differs(differs, global)
    }

    /// Another machine on this port: nothing is known of where it stands.
    fn check_machine(&self, machine: &Machine, global: &Global) -> Result<(), Failure> {
        let other = self.journal.history().machine().unwrap_or_default();
        let id = &machine.id;
        let differs = format!(
            "the journal of this port tells of the machine {other}, and nothing of where {id} stands: \
             `cnc home` finds out, or --at says it"
        );
        self.differs(differs, global)
    }

    /// Stops a job on a machine; behind a pseudo-terminal it is a warning.
    fn differs(&self, how: String, global: &Global) -> Result<(), Failure> {
        if !self.is_pty {
            return Err(anyhow!(how)).or_bus();
        }
        if !global.quiet {
            say!("warning: {how}");
        }
        Ok(())
    }

    fn shown(&self, steps: &AxisMap<i64>, machine: &Machine) -> String {
        let position_mm = machine.position_mm(steps);
        let axes = self.axes.iter().map(|axis| format!("{axis} {:.3}", position_mm[*axis]));
        axes.collect::<Vec<_>>().join(", ")
    }
}

/// Whether what a journal tells is told of this machine, or of none yet.
fn is_of(history: &History, machine: &Machine) -> bool {
    history.machine().is_none_or(|name| name == machine.id)
}

/// Where the machine stands, as far as anybody has told.
#[derive(Default)]
pub struct Told {
    /// Of each axis, in motor steps.
    pub steps: AxisMap<Option<i64>>,
    /// Axes that have been homed, or stand there by the operator's word; others were counted from where a
    /// job was taken to start.
    referenced: AxisSet,
}

impl Told {
    /// By the operator's word, or else by the journal of the port, if both are there. Reads only.
    pub fn of(port: &Port, args: &JournalArgs, machine: &Machine) -> Result<Told, Failure> {
        let mut told = Told::default();
        let axes = machine.bus.nodes.keys().copied();
        if let Some(at) = &args.at {
            let steps = machine.nearest_steps(&at.position_mm(machine));
            axes.for_each(|axis| told.tell(axis, steps[axis], true));
            return Ok(told);
        }
        let port = port.path().ok().filter(|port| port.exists() && !args.power_cycled);
        let path = match (&args.journal, port) {
            (_, None) => None,
            (Some(path), _) => Some(path.clone()),
            (None, Some(port)) => default_path(&port)?,
        };
        let is_there = |path: &PathBuf| path.is_file();
        if let Some(path) = path.filter(is_there) {
            let history = Journal::read(&path)?;
            let axes = axes.filter(|_| is_of(&history, machine));
            for axis in axes {
                if let Place::Known(steps) = history.place(axis) {
                    told.tell(axis, steps, history.is_referenced(axis));
                }
            }
        }
        Ok(told)
    }

    fn tell(&mut self, axis: Axis, steps: i64, is_referenced: bool) {
        self.steps[axis] = Some(steps);
        if is_referenced {
            self.referenced.insert(axis);
        }
    }

    /// Where axes stand in mm that somebody has told of.
    pub fn position_mm(&self, axis: Axis, machine: &Machine) -> Option<f64> {
        let mut steps = AxisMap::default();
        steps[axis] = self.steps[axis]?;
        Some(machine.position_mm(&steps)[axis])
    }

    /// Where a job starts that says nothing of it: where the axes stand that have been homed; at the work
    /// zero, by the operator's word, are all others. None if that is the work zero.
    pub fn start(&self, machine: &Machine) -> Option<Start> {
        let mut start_mm = machine.work_zero_mm;
        for axis in self.referenced.iter() {
            start_mm[axis] = self.position_mm(axis, machine)?;
        }
        (start_mm != machine.work_zero_mm).then(|| Start::at(&start_mm))
    }
}

/// The journal of a port that is there: by the name of its adapter, if the system gives it one that
/// lasts, else by its own.
fn default_path(port: &Path) -> Result<Option<PathBuf>, Failure> {
    let Ok(device) = port.canonicalize() else { return Ok(None) };
    let folder = state_folder();
    if is_pseudo_terminal(port) {
        let usable = folder.ok().filter(|folder| std::fs::create_dir_all(folder).is_ok());
        return Ok(usable.map(|folder| of_pseudo_terminal(&folder, &device)));
    }
    let name = lasting_name(&device).unwrap_or_else(|| flat(&device));
    Ok(Some(folder?.join(format!("{name}.jsonl"))))
}

/// Pseudo-terminals are made anew under the same names: this one is told from those before by when
/// it was made. Journals of those are taken away; its own may have an older one beside it.
fn of_pseudo_terminal(folder: &Path, device: &Path) -> PathBuf {
    let number = flat(device);
    let made = std::fs::metadata(device).map_or(0, |device| {
        device.ctime().wrapping_mul(1_000_000_000).wrapping_add(device.ctime_nsec())
    });
    let name = format!("{number}-{made}.jsonl");
    let of_others =
        |other: &str| other.starts_with(&format!("{number}-")) && !other.starts_with(&name);
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.file_name().to_str().is_some_and(of_others) {
            // One that stays costs nothing but its place.
            let _ = std::fs::remove_file(entry.path());
        }
    }
    folder.join(name)
}

/// The state folder of this user's `cnc`.
fn state_folder() -> anyhow::Result<PathBuf> {
    let absolute =
        |name| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let state = absolute("XDG_STATE_HOME").or_else(|| Some(absolute("HOME")?.join(".local/state")));
    let folder = state.map(|state| state.join("cnc"));
    folder
        .context("there is no folder to keep a journal in: set HOME, or name a file with --journal")
}

/// The name that the system makes of an adapter's maker, type and serial number.
fn lasting_name(device: &Path) -> Option<String> {
    let links = std::fs::read_dir("/dev/serial/by-id").ok()?.flatten();
    let mut ours = links.filter(|link| link.path().canonicalize().is_ok_and(|path| path == device));
    ours.next()?.file_name().into_string().ok()
}

/// A path as one name.
fn flat(path: &Path) -> String {
    path.display().to_string().trim_start_matches("/dev/").replace('/', "-")
}
