//! Events → the profile's commands: checked before a job, run while the axes rest.
//!
//! A command runs in a process group of its own, without input; what it prints is kept for the case
//! that it fails. It is done when it ends with 0. Processes that it leaves behind are left alone then,
//! and are ended with it when it fails, takes too long or is stopped.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal};

use crate::base::machine::{NoValue, Occasion, Trigger};
use crate::base::{AxisMap, Event, EventKind, Machine};
use crate::wire::Job;
use crate::wire_io::hands::Hands;

/// What a command that is told to end has to put itself in order.
const GRACE: Duration = Duration::from_millis(500);
/// How often a command that is told to end is looked at.
const LOOK: Duration = Duration::from_millis(5);
/// What is told of a failed command's last words.
const LAST_BYTES: u64 = 4096;
const LAST_LINES: usize = 5;

/// What programs have set and events without words of their own go by.
#[derive(Clone, Copy, Debug, Default)]
struct Modal {
    spindle_rpm: Option<f64>,
    tool: Option<u32>,
}

impl Modal {
    /// Takes over what an event says, and gives all that is known then.
    fn occasion(&mut self, event: &Event, at_steps: &AxisMap<i64>, machine: &Machine) -> Occasion {
        match event.kind {
            EventKind::M { spindle_rpm, tool, .. } => {
                self.spindle_rpm = spindle_rpm.or(self.spindle_rpm);
                self.tool = tool.or(self.tool);
            }
            EventKind::S(rpm) => self.spindle_rpm = Some(rpm),
            EventKind::T(tool) => self.tool = Some(tool),
            _ => {}
        }
        let Modal { spindle_rpm, tool } = *self;
        let at_mm = machine.position_mm(at_steps);
        Occasion { event: event.kind, line: event.line, spindle_rpm, tool, at_mm }
    }
}

/// An event of a job, and what will be done about it.
#[derive(Clone, Debug, PartialEq)]
pub struct Call {
    /// The event.
    pub event: Event,
    /// The command with its arguments; none: it is reported and passed.
    pub command: Option<Vec<String>>,
}

/// Why a job's commands cannot be run.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum HookError {
    /// A command asks for what the program has not said.
    #[error("line {}: {}: {reason}", event.line, event.kind)]
    NoValue {
        /// The event.
        event: Event,
        /// What it asks for.
        reason: NoValue,
    },
    /// There is no such program.
    #[error("line {}: {}: there is no program {program} to run; hooks of the machine's profile name it", event.line, event.kind)]
    NoProgram {
        /// The first event that needs it.
        event: Event,
        /// The program.
        program: String,
    },
}

/// What will be done about each event of a job, in order.
///
/// # Errors
/// The first command that asks for what the program has not said.
pub fn calls(job: &Job, machine: &Machine) -> Result<Vec<Call>, HookError> {
    let mut modal = Modal::default();
    let call = |(event, at_steps): (Event, AxisMap<i64>)| {
        let occasion = modal.occasion(&event, &at_steps, machine);
        let command = machine.hooks.of(event.kind).map(|hook| hook.arguments(&occasion));
        match command.transpose() {
            Ok(command) => Ok(Call { event, command }),
            Err(reason) => Err(HookError::NoValue { event, reason }),
        }
    };
    job.event_places().into_iter().map(call).collect()
}

/// Looks for the programs of all commands, as a shell would.
///
/// # Errors
/// The first that is not there, or that the user may not run.
pub fn find_programs(calls: &[Call]) -> Result<(), HookError> {
    for Call { event, command } in calls {
        let Some(program) = command.as_ref().and_then(|command| command.first()) else { continue };
        if !is_there(program) {
            return Err(HookError::NoProgram { event: event.clone(), program: program.clone() });
        }
    }
    Ok(())
}

fn is_there(program: &str) -> bool {
    let runs = |path: &Path| {
        path.is_file() && rustix::fs::access(path, rustix::fs::Access::EXEC_OK).is_ok()
    };
    if program.contains('/') {
        return runs(Path::new(program));
    }
    let folders = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&folders).any(|folder: PathBuf| runs(&folder.join(program)))
}

/// Runs the commands of a machine's profile.
#[derive(Debug)]
pub struct HookRunner {
    machine: Machine,
    modal: Modal,
    running: Option<Running>,
    /// What commands have switched on and not off: the spindle, coolants.
    on: Vec<Event>,
}

/// A command under way.
#[derive(Debug)]
struct Running {
    child: Child,
    event: Event,
    /// The program and its arguments, to be told.
    told: String,
    output: File,
    until: Instant,
    timeout_s: f64,
}

impl HookRunner {
    /// For jobs on this machine.
    pub fn new(machine: &Machine) -> Self {
        let (modal, running, on) = (Modal::default(), None, Vec::new());
        HookRunner { machine: machine.clone(), modal, running, on }
    }

    /// An event's command has ended well.
    fn switch(&mut self, done: &Event) {
        let off: fn(u16) -> bool = match m_code(done) {
            Some(3..=5) => |code| matches!(code, 3 | 4),
            Some(9) => |code| matches!(code, 7 | 8),
            _ => return,
        };
        self.on.retain(|on| on == done || !m_code(on).is_some_and(off));
        self.on.dedup();
    }

    /// Events whose commands have switched on what none has switched off.
    pub fn left_on(&self) -> &[Event] {
        &self.on
    }
}

fn m_code(event: &Event) -> Option<u16> {
    match Trigger::of(event.kind) {
        Some(Trigger::M(code)) => Some(code),
        _ => None,
    }
}

impl Hands for HookRunner {
    fn begin(&mut self, event: &Event, at_steps: &AxisMap<i64>) -> Result<(), String> {
        self.stop();
        let occasion = self.modal.occasion(event, at_steps, &self.machine);
        let Some(hook) = self.machine.hooks.of(event.kind) else { return Ok(()) };
        let command = hook.arguments(&occasion).map_err(|missing| missing.to_string())?;
        self.running = Some(Running::begin(&command, hook.timeout_s, event)?);
        // A command that fails may have switched something on all the same.
        if matches!(m_code(event), Some(3 | 4 | 7 | 8)) {
            self.on.push(event.clone());
        }
        Ok(())
    }

    fn is_done(&mut self) -> Result<bool, String> {
        let Some(running) = &mut self.running else { return Ok(true) };
        let ended = running.child.try_wait().map_err(|error| running.says(&error.to_string()))?;
        let reason = match ended {
            Some(status) if status.success() => {
                let event = running.event.clone();
                self.running = None;
                self.switch(&event);
                return Ok(true);
            }
            Some(status) => running.says(&how(status)),
            None if Instant::now() < running.until => return Ok(false),
            None => running.says(&format!("took longer than {} s", running.timeout_s)),
        };
        self.stop();
        Err(reason)
    }

    fn stop(&mut self) {
        if let Some(mut running) = self.running.take() {
            running.end();
        }
    }
}

/// No command outlives the job that it belongs to.
impl Drop for HookRunner {
    fn drop(&mut self) {
        self.stop();
    }
}

impl Running {
    fn begin(command: &[String], timeout_s: f64, event: &Event) -> Result<Running, String> {
        let told = shown(command);
        let cannot = |error: std::io::Error| format!("{told} cannot be run: {error}");
        let output = tempfile::tempfile().map_err(cannot)?;
        let (out, err) = (output.try_clone().map_err(cannot)?, output.try_clone().map_err(cannot)?);
        let (program, arguments) = command.split_first().ok_or("there is no command")?;
        let child = Command::new(program)
            .args(arguments)
            .env("CNC_EVENT", event.kind.to_string())
            .env("CNC_LINE", event.line.to_string())
            .stdin(Stdio::null())
            .stdout(out)
            .stderr(err)
            .process_group(0)
            .spawn()
            .map_err(cannot)?;
        let until = Instant::now() + Duration::from_secs_f64(timeout_s);
        Ok(Running { child, event: event.clone(), told, output, until, timeout_s })
    }

    /// What has become of it, and its last words.
    fn says(&mut self, what: &str) -> String {
        let told = &self.told;
        match last_lines(&mut self.output) {
            words if words.is_empty() => format!("{told} {what}"),
            words => format!("{told} {what}; it said:\n  {}", words.join("\n  ")),
        }
    }

    /// Tells the whole group to end, and makes it.
    fn end(&mut self) {
        let group = Pid::from_child(&self.child);
        // Whoever is gone already needs no signal.
        let _ = rustix::process::kill_process_group(group, Signal::TERM);
        let until = Instant::now() + GRACE;
        while matches!(self.child.try_wait(), Ok(None)) && Instant::now() < until {
            std::thread::sleep(LOOK);
        }
        let _ = rustix::process::kill_process_group(group, Signal::KILL);
        let _ = self.child.wait();
    }
}

fn how(status: ExitStatus) -> String {
    match (status.code(), status.signal()) {
        (Some(code), _) => format!("ended with code {code}"),
        (None, Some(signal)) => format!("was ended by signal {signal}"),
        (None, None) => "did not end well".to_owned(),
    }
}

/// A command as a shell would take it.
pub fn shown(command: &[String]) -> String {
    let word = |word: &String| {
        let plain = |c: char| c.is_alphanumeric() || "/._-+=:,@%".contains(c);
        match word.chars().all(plain) && !word.is_empty() {
            true => word.clone(),
            false => format!("'{}'", word.replace('\'', r"'\''")),
        }
    };
    command.iter().map(word).collect::<Vec<_>>().join(" ")
}

fn last_lines(output: &mut File) -> Vec<String> {
    let length = output.metadata().map_or(0, |metadata| metadata.len());
    let mut bytes = Vec::new();
    let read = output
        .seek(SeekFrom::Start(length.saturating_sub(LAST_BYTES)))
        .and_then(|_| output.take(LAST_BYTES).read_to_end(&mut bytes));
    if read.is_err() {
        return Vec::new();
    }
    let text = String::from_utf8_lossy(&bytes);
    let lines = text.lines().map(str::trim_end).filter(|line| !line.is_empty());
    let clean = |line: &str| line.chars().filter(|c| !c.is_control()).collect::<String>();
    let lines: Vec<String> = lines.map(clean).collect();
    lines[lines.len().saturating_sub(LAST_LINES)..].to_vec()
}
