//! Events in time with motion: commands of the machine's profile are run while the axes rest, and a
//! job goes on only when they have ended well.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::PathBuf;
use std::process::{Command as Process, Output, Stdio};
use std::time::Duration;

use cnc::base::{Axis, AxisMap, Command, Event, Machine, Tick};
use cnc::wire::{
    ANSWER_PAUSE_US, End, Ending, Fault, Job, Master, MasterEvent, Nodes, Position, Timing,
};
use cnc::wire_io::{Hands, Link, LinkError, Operator, Sim, drive};

fn event(line: u32, text: &str) -> Command {
    Command::Event(Event { line, kind: text.parse().unwrap() })
}

/// A movement of X from rest to rest, with an event within it after its second tick.
fn movement(buffer: u32, line: u32, within: Option<&str>) -> Vec<Command> {
    let mut commands = Vec::new();
    for at in 0..30_i32 {
        if let Some(text) = within.filter(|_| at == 2) {
            commands.push(event(line, text));
        }
        let mut counts = AxisMap::default();
        counts[Axis::X] = 1 + at.min(29 - at).min(8);
        commands.push(Command::Tick(Tick { buffer, line, counts }));
    }
    commands
}

/// Events before, within and after movements.
fn commands() -> Vec<Command> {
    let mut commands = vec![event(1, "M3 S1200")];
    commands.extend(movement(0, 2, Some("M8")));
    commands.push(event(3, "M6 T2"));
    commands.extend(movement(1, 4, Some("M101 P1")));
    commands.push(event(5, "M5"));
    commands
}

/// A simulated bus that counts bytes.
struct Counted {
    sim: Sim,
    sent: usize,
}

impl Link for Counted {
    fn now_us(&mut self) -> u64 {
        self.sim.now_us()
    }
    fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        self.sent += bytes.len();
        self.sim.send(bytes)
    }
    fn receive(
        &mut self,
        bytes: &mut Vec<u8>,
        until_us: u64,
        answer_from_us: Option<u64>,
    ) -> Result<(), LinkError> {
        self.sim.receive(bytes, until_us, answer_from_us)
    }
    /// Bytes may leave only while nothing is under way.
    fn idle(&mut self, bytes: &mut Vec<u8>, _: Duration) -> Result<(), LinkError> {
        let sent = self.sent;
        self.sim.idle(bytes, Duration::ZERO)?;
        assert_eq!(self.sent, sent);
        Ok(())
    }
}

/// Needs some time for each event; fails, or is interrupted, at one.
#[derive(Default)]
struct Helper {
    done: Vec<(String, i64)>,
    left: usize,
    fails_at: Option<usize>,
    interrupted_at: Option<usize>,
    stops: usize,
    asked: Vec<String>,
}

impl Hands for Helper {
    fn begin(&mut self, event: &Event, at_steps: &AxisMap<i64>) -> Result<(), String> {
        self.done.push((event.kind.to_string(), at_steps[Axis::X]));
        self.left = 3;
        Ok(())
    }
    fn is_done(&mut self) -> Result<bool, String> {
        if self.fails_at == Some(self.done.len()) {
            return Err("the changer is stuck".to_owned());
        }
        self.left = self.left.saturating_sub(1);
        Ok(self.left == 0)
    }
    fn stop(&mut self) {
        self.stops += 1;
    }
}

impl Operator for Helper {
    fn event(&mut self, _: &MasterEvent) {}
    fn hands(&mut self) -> Option<&mut dyn Hands> {
        Some(self)
    }
    fn pause(&mut self, event: &Event) -> bool {
        self.asked.push(event.kind.to_string());
        true
    }
    fn progress(&mut self, _: &Master) {}
    fn interrupts(&mut self) -> usize {
        usize::from(self.interrupted_at.is_some_and(|at| self.done.len() >= at))
    }
}

fn run(mut helper: Helper) -> (Ending, Helper, i64) {
    let machine = Machine::load("starmill").unwrap();
    let start = machine.nearest_steps(&machine.work_zero_mm);
    let job = Job::new(commands(), start, &machine).unwrap();
    let nodes = Nodes::new(&machine, machine.bus.units(), &start, ANSWER_PAUSE_US);
    let mut link = Counted { sim: Sim::new(nodes), sent: 0 };
    let mut master = Master::new(job, &machine, Timing::new(&machine.bus, 1.0));
    let ending = drive(&mut link, &mut master, &mut helper);
    let node = link.sim.nodes().iter().find(|(unit, _)| unit.axis == Some(Axis::X));
    let stands = node.unwrap().1.position_steps();
    (ending, helper, stands)
}

#[test]
fn events_are_done_in_order_each_where_the_program_has_it() {
    let (ending, helper, stands) = run(Helper::default());
    assert_eq!(ending.end, End::Done);
    let all: i64 = (0..30_i64).map(|at| 1 + at.min(29 - at).min(8)).sum();
    let expected = [
        ("M3 S1200", 7500),
        ("M8", 7503),
        ("M6 T2", 7500 + all),
        ("M101 P1", 7503 + all),
        ("M5", 7500 + 2 * all),
    ];
    let found: Vec<_> = helper.done.iter().map(|(text, at)| (text.as_str(), *at)).collect();
    assert_eq!(found, expected);
    assert_eq!((stands, helper.asked.as_slice()), (7500 + 2 * all, &["M6 T2".to_owned()][..]));
}

#[test]
fn an_event_that_fails_ends_the_job_where_the_axes_rest() {
    for at in 1..=5 {
        let (ending, helper, stands) = run(Helper { fails_at: Some(at), ..Helper::default() });
        let End::Failed(Fault::Event { line, event, reason }) = &ending.end else {
            panic!("{ending:?}");
        };
        assert_eq!((*line as usize, event), (at, &helper.done[at - 1].0));
        assert_eq!(reason, "the changer is stuck");
        assert_eq!((helper.done.len(), stands), (at, helper.done[at - 1].1));
        let x = ending.axes[0];
        let within = at % 2 == 0;
        assert_eq!((x.steps, ending.power_cycle), (stands, within));
        let known = if within { Position::KnownUntilPowerOff } else { Position::Known };
        assert_eq!(x.position, known, "event {at}");
    }
}

#[test]
fn an_interrupt_during_an_event_stops_it_and_the_job() {
    for at in 1..=5 {
        let (ending, helper, stands) =
            run(Helper { interrupted_at: Some(at), ..Helper::default() });
        assert_eq!((&ending.end, helper.done.len()), (&End::Interrupted, at));
        assert!(helper.stops > 0);
        assert_eq!(ending.axes[0].steps, stands);
    }
}

/// A folder with a program, a profile whose hooks are these, and scripts.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new(program: &str, hooks: &str) -> Folder {
        let folder = Folder(tempfile::tempdir().unwrap());
        let toml = Machine::load("starmill").unwrap().to_toml().to_owned();
        let hooks = hooks.replace("DIR", folder.0.path().to_str().unwrap());
        fs::write(folder.path("mill.toml"), format!("{toml}\n[hooks]\n{hooks}")).unwrap();
        fs::write(folder.path("part.nc"), program).unwrap();
        folder
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn script(&self, name: &str, text: &str) {
        let path = self.path(name);
        fs::write(&path, format!("#!/bin/sh\ncd \"$(dirname \"$0\")\"\n{text}\n")).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    }

    fn send(&self, port: &str, args: &[&str]) -> Output {
        self.process(port, args).output().unwrap()
    }

    fn process(&self, port: &str, args: &[&str]) -> Process {
        let mut process = Process::new(env!("CARGO_BIN_EXE_cnc"));
        process.arg("send").arg(port).arg(self.path("part.nc")).args(args);
        process.arg("-m").arg(self.path("mill.toml"));
        process.env_remove("CNC_MACHINE").stdin(Stdio::null());
        process.stdout(Stdio::piped()).stderr(Stdio::piped());
        process
    }
}

const PROGRAM: &str = "M3 S1000\nG1 F600 X5\nT2 M6\nG1 X8\nS1500\nG1 X9\nM5\nM30\n";

#[track_caller]
fn check(output: &Output, code: i32, says: &[&str]) {
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{said}");
    for part in says {
        assert!(said.contains(part), "expected '{part}': {said}");
    }
}

#[test]
fn commands_get_their_arguments_and_run_in_the_programs_order() {
    let hooks = "M3 = [\"DIR/do\", \"--rpm\", \"{s}\"]\nM5 = [\"DIR/do\", \"{m}\", \"{s}\"]\n\
                 S = [\"DIR/do\", \"{s} $HOME\"]\nM6 = [\"DIR/do\", \"{t}\", \"{x}/{y}/{z}\"]\n";
    let folder = Folder::new(PROGRAM, hooks);
    folder.script("do", "for a in \"$@\"; do echo \"$CNC_LINE $CNC_EVENT [$a]\" >> log; done");
    check(&folder.send("sim:", &["--ignore-stops"]), 0, &["are not run on simulated nodes"]);
    assert!(!folder.path("log").exists());
    check(&folder.send("sim:", &["--hooks", "--no-input"]), 0, &["M6 T2, by "]);
    let log = fs::read_to_string(folder.path("log")).unwrap();
    let expected = "1 M3 S1000 [--rpm]\n1 M3 S1000 [1000]\n3 M6 T2 [2]\n3 M6 T2 [80/50/50]\n\
                    5 S1500 [1500 $HOME]\n7 M5 [5]\n7 M5 [1500]\n";
    assert_eq!(log, expected);
}

#[test]
fn a_command_that_does_not_end_well_stops_the_job() {
    let hooks = "timeout_s = 0.3\nS = [\"DIR/do\"]\nM3 = [\"DIR/do\"]\n";
    let folder = Folder::new(PROGRAM, hooks);
    let args = ["--hooks", "--ignore-stops"];
    folder.script("do", "echo one; echo two >&2; exit 7");
    let failed = folder.send("sim:", &args);
    check(&failed, 3, &["line 1: M3 S1000: ", "do ended with code 7; it said:\n  one\n  two\n"]);
    check(&failed, 3, &["X at 75.000 mm (step 7500), known\n"]);
    folder.script("do", "kill -9 $$");
    check(&folder.send("sim:", &args), 3, &["was ended by signal 9"]);
    folder.script("do", "(sleep 60; echo late > log) & wait");
    check(&folder.send("sim:", &args), 3, &["took longer than 0.3 s"]);
    // Nobody of its group is left.
    assert!(!folder.path("log").exists());
    folder.script("do", "rm \"$0\"");
    let failed = folder.send("sim:", &args);
    check(&failed, 3, &["line 5: S1500: ", "cannot be run: No such file"]);
    check(&failed, 3, &["may still be on: M3 S1000 of line 1"]);
}

#[test]
fn what_cannot_be_run_is_refused_before_the_port_is_opened() {
    let port = "/nonexistent/port";
    let missing = Folder::new(PROGRAM, "M3 = [\"no-such-spindle\"]\n");
    let says = ["line 1: M3 S1000: there is no program no-such-spindle"];
    check(&missing.send(port, &["--ignore-stops"]), 2, &says);
    check(&missing.send(port, &["--dry-run"]), 2, &says);
    check(&missing.send("sim:", &["--dry-run"]), 0, &says);
    let folder = Folder::new(PROGRAM, "M3 = [\"DIR/do\"]\n");
    fs::write(folder.path("do"), "#!/bin/sh\n").unwrap();
    check(&folder.send(port, &[]), 2, &["there is no program"]);
    let valueless =
        Folder::new("M101 P3\nG1 F600 X5\nM30\n", "M101 = [\"true\", \"{p}\", \"{q}\"]");
    check(&valueless.send(port, &[]), 1, &["line 1: M101 P3: its hook has {q}"]);
    // A command in place of a person.
    let changer = Folder::new(PROGRAM, "M6 = [\"true\"]\n");
    check(&changer.send(port, &["--no-input"]), 3, &["there is no port"]);
    let nobody = Folder::new(PROGRAM, "M5 = [\"true\"]\n");
    check(&nobody.send(port, &["--no-input"]), 1, &["line 3: M6 T2 waits for a person"]);
}

#[test]
fn an_interrupt_ends_the_command_and_its_children() {
    let folder = Folder::new(PROGRAM, "M3 = [\"DIR/do\"]\nS = [\"true\"]\n");
    folder.script("do", "(sleep 2; echo late > log) & touch begun; wait");
    let mut process = folder.process("sim:", &["--hooks", "--ignore-stops"]);
    let host = process.spawn().unwrap();
    while !folder.path("begun").exists() {
        std::thread::sleep(Duration::from_millis(5));
    }
    let pid = rustix::process::Pid::from_child(&host);
    rustix::process::kill_process(pid, rustix::process::Signal::INT).unwrap();
    let output = host.wait_with_output().unwrap();
    check(&output, 130, &["X at 75.000 mm (step 7500), known\n"]);
    assert!(!folder.path("log").exists());
}

#[test]
fn a_dry_run_lists_events_with_their_commands() {
    let hooks = "M3 = [\"true\", \"{s}\"]\nS = [\"true\"]\n";
    let output = Folder::new(PROGRAM, hooks).send("sim:", &["--dry-run", "--json"]);
    let result: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let events = result["events"].as_array().unwrap();
    assert_eq!(events.len(), 5);
    assert_eq!(events[0]["hook"], serde_json::json!(["true", "1000"]));
    assert_eq!(
        (&events[1]["event"], &events[1]["hook"]),
        (&"M6 T2".into(), &serde_json::Value::Null)
    );
}
