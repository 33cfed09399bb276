//! A frame a tick: what is sent, what virtual nodes make of it, and what of a fault the host learns.

mod bench;

use bench::Bench;
use cnc::base::machine::Protocol;
use cnc::base::{Axis, AxisMap, Command, Event, Machine, Tick};
use cnc::wire::frames::{self, Mode};
use cnc::wire::{
    Buffer, End, Ending, Fault, FaultKind, Faults, Job, JobError, Master, MasterEvent, Nodes,
    Position, Timing, lint,
};
use cnc::wire_io::{Operator, Sim, drive};

const PROGRAM: &str =
    "G21 G90 F600\nM3 S1000\nG1 X5 Y3\nG2 X9 Y7 R4\nG4 P0.2\nG1 X0 Y0 Z-1\nM5\nM30\n";

fn machine() -> Machine {
    Machine::load("starmill").unwrap().with_protocol(Protocol::Frame).unwrap()
}

/// Nobody interrupts unless so many ticks are done; then the job is held, and goes on or not.
#[derive(Default)]
struct Quiet {
    stop_at: Option<u64>,
    goes_on: bool,
    interrupts: usize,
    held: usize,
}

impl Operator for Quiet {
    fn event(&mut self, event: &MasterEvent) {
        self.held += usize::from(matches!(event, MasterEvent::Held { .. }));
    }
    fn pause(&mut self, _event: &Event) -> bool {
        true
    }
    fn held(&mut self, _master: &Master) -> bool {
        self.goes_on
    }
    fn progress(&mut self, master: &Master) {
        let reached = self.stop_at.is_some_and(|ticks| master.progress().ticks >= ticks);
        self.interrupts = self.interrupts.max(usize::from(reached));
    }
    fn interrupts(&mut self) -> usize {
        self.interrupts
    }
}

/// A ramp up, a cruise and a ramp down on X and Y, twice, with an event between; Z moves once.
fn commands() -> Vec<Command> {
    let tick = |x: i32, y: i32, z: i32, line: u32| {
        let mut counts = AxisMap::default();
        (counts[Axis::X], counts[Axis::Y], counts[Axis::Z]) = (x, y, z);
        Command::Tick(Tick { buffer: 0, line, counts })
    };
    let ramp = (1..=12).chain(std::iter::repeat_n(12, 30)).chain((1..=12).rev());
    let mut commands: Vec<_> = ramp.clone().map(|step| tick(step, -step / 2, 0, 1)).collect();
    commands.push(Command::Event(Event { line: 2, kind: "M3 S800".parse().unwrap() }));
    commands.extend(ramp.map(|step| tick(-step, 0, step.min(3), 3)));
    commands
}

fn job(machine: &Machine) -> Job {
    let start = machine.nearest_steps(&machine.work_zero_mm);
    let job = Job::new(commands(), start, machine).unwrap();
    lint(&job, machine).unwrap();
    job
}

fn run(machine: &Machine, job: Job, faults: Faults, operator: &mut Quiet) -> (Ending, Nodes) {
    let nodes = Nodes::new(machine, machine.bus.units(), &job.start_steps, 250).with_faults(faults);
    let mut sim = Sim::new(nodes);
    let mut master = Master::new(job, machine, Timing::new(&machine.bus, 1.0));
    let ending = drive(&mut sim, &mut master, operator);
    (ending, sim.nodes().clone())
}

#[test]
fn nodes_execute_what_was_planned() {
    let machine = machine();
    let job = job(&machine);
    let faults = Faults::of_bus(Vec::new(), &machine.bus);
    let (ending, mut nodes) = run(&machine, job.clone(), faults, &mut Quiet::default());
    assert_eq!((ending.end.clone(), ending.ticks, ending.buffers), (End::Done, 108, 2));
    assert_eq!(job.first_difference(&nodes.executed()), None);
    assert!(std::iter::from_fn(|| nodes.poll_log()).all(|entry| entry.hazard.is_none()));
    for end in &ending.axes {
        assert_eq!((end.position, end.steps), (Position::KnownAsSent, job.end_steps[end.axis]));
    }
    let pacing = ending.pacing.figures();
    assert_eq!((pacing.least_us, pacing.greatest_us), (Some(11_000), Some(11_000)));
}

/// One byte lost, one bit changed, a frame late, a node that stalls, starts anew or dies: no node ever
/// makes a step that was not planned for that tick, and the host knows of nothing but a port that is gone.
#[test]
fn a_fault_stops_nodes_and_the_host_does_not_learn_of_it() {
    let machine = machine();
    let job = job(&machine);
    let units: Vec<_> = machine.bus.units().collect();
    let (mut silent, mut seen) = (0, 0);
    for seed in 0..400 {
        let fault = Faults::draw_frames(seed, 1, &units)[0];
        let is_one_bit = |mask: u8| mask.count_ones() == 1;
        match fault.kind {
            FaultKind::Add(_) => continue,
            FaultKind::Change(mask) if !is_one_bit(mask) => continue,
            _ => {}
        }
        let faults = Faults::of_bus(vec![fault], &machine.bus);
        let (ending, mut nodes) = run(&machine, job.clone(), faults, &mut Quiet::default());
        if nodes.poll_struck().is_none() {
            continue;
        }
        let hazards =
            std::iter::from_fn(|| nodes.poll_log()).filter(|entry| entry.hazard.is_some());
        let hazards = hazards.count();
        for (unit, node) in nodes.iter() {
            let axis = unit.axis.unwrap();
            let executed: Vec<i32> =
                node.runs().iter().flat_map(|run| run.counts.clone()).collect();
            let counts = |stretch: &Buffer| -> Vec<i32> {
                (0..stretch.entries()).map(|tick| stretch.counts(tick)[axis]).collect()
            };
            let planned: Vec<i32> = job.buffers().flat_map(counts).collect();
            assert!(planned.starts_with(&executed), "{fault}");
            let missed = executed.len() < planned.len();
            seen += usize::from(missed);
            let is_off = matches!(fault.kind, FaultKind::Dead | FaultKind::Close);
            assert!(!missed || is_off || hazards > 0, "{fault}");
        }
        let closed = fault.kind == FaultKind::Close;
        assert_eq!(ending.end == End::Done, !closed, "{fault}");
        silent += usize::from(ending.end == End::Done);
    }
    assert!(silent > 50 && seen > 50, "{silent} {seen}");
}

#[test]
fn a_hold_is_a_frame_that_does_not_come() {
    let machine = machine();
    let job = job(&machine);
    for (goes_on, end, ticks) in [(true, End::Done, 108), (false, End::Interrupted, 54)] {
        let faults = Faults::of_bus(Vec::new(), &machine.bus);
        let mut operator = Quiet { stop_at: Some(20), goes_on, ..Quiet::default() };
        let (ending, mut nodes) = run(&machine, job.clone(), faults, &mut operator);
        assert_eq!((ending.end, ending.ticks, operator.held), (end, ticks, 1));
        assert!(!ending.power_cycle);
        assert!(std::iter::from_fn(|| nodes.poll_log()).all(|entry| entry.hazard.is_none()));
    }
}

#[test]
fn what_cannot_be_carried_is_refused_with_its_figure() {
    let check = |baud: u32, tick_us: u32, least: u64| {
        let mut machine = machine();
        (machine.bus.baud, machine.bus.tick_us) = (baud, tick_us);
        machine.bus.node_tick_us = machine.bus.node_tick_us.min(tick_us - 280);
        let start = machine.nearest_steps(&machine.work_zero_mm);
        let slow = commands().into_iter().take(1);
        let job = Job::new(slow, start, &machine).unwrap();
        match lint(&job, &machine) {
            Ok(proof) => assert_eq!((least, proof.bytes), (0, 26)),
            Err(JobError::FrameTooLong { baud_least, .. }) => assert_eq!(baud_least, least),
            Err(error) => panic!("{error}"),
        }
    };
    check(38_400, 11_000, 0);
    check(11_819, 11_000, 0);
    check(11_818, 11_000, 11_819);
    check(9600, 11_000, 11_819);
    check(115_200, 1000, 130_000);
    check(130_000, 1000, 0);
    let mut machine = machine();
    // A node reads on while it steps, but has to be done when the next frame comes.
    machine.bus.node_tick_us = 10_721;
    let start = machine.nearest_steps(&machine.work_zero_mm);
    let job = Job::new(commands(), start, &machine).unwrap();
    assert!(matches!(lint(&job, &machine), Err(JobError::TickTooShort { least_us: 11_001, .. })));
}

/// Nobody on this line speaks: who does is on another one, where a frame may be a command.
#[test]
fn a_byte_that_comes_back_stops_the_job() {
    let machine = machine();
    let mut master = Master::new(job(&machine), &machine, Timing::new(&machine.bus, 1.0));
    assert!(master.poll_transmit(0).is_some());
    master.handle_bytes(1000, &[122]);
    let Some(MasterEvent::Ended(ending)) = std::iter::from_fn(|| master.poll_event()).last() else {
        panic!("the job goes on");
    };
    assert_eq!(ending.end, End::Failed(Fault::Unexpected { got: 122 }));
    assert_eq!(master.poll_transmit(100_000), None);
}

/// Bytes of a tick, as the host writes them: docs/frame.md shows the first one.
#[test]
fn the_bytes_are_those_of_the_manual() {
    let count = |count| frames::encode(count).unwrap();
    let places = [count(5), count(-3), count(0), count(0), count(0), count(0)];
    let first = frames::frame(Mode::Move, 1, &places);
    let hex: Vec<_> = first.iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(hex.join(" "), "a2 00 05 7f 7d 00 00 00 00 00 00 00 00");
}

#[test]
fn a_program_is_sent_in_frames() {
    let bench = Bench::new(PROGRAM, "starmill");
    let send = ["send", "sim:", "part.nc", "--protocol", "frame", "--trace", "trace"];
    bench.cnc(&send, 0, "and that is the program's path");
    let replay = ["replay", "trace", "part.nc", "--protocol", "frame"];
    let told = bench.cnc(&replay, 0, "same");
    assert!(!String::from_utf8_lossy(&told.stdout).contains("not planned"));
    let frame = |port: &str, code: i32, says: &str| {
        bench.cnc(&["send", port, "part.nc", "--protocol", "frame"], code, says);
    };
    frame("sim:faults=drop@tick.900", 3, "the nodes did not execute what was planned");
    frame("sim:faults=change=1:X@tick.902", 3, "stands still until it is switched off");
    frame("sim:faults=close@tick.900", 3, "measure it, and say so with --at");
    let too_slow = ["send", "sim:", "part.nc", "--protocol", "frame", "--baud", "9600"];
    bench.cnc(&too_slow, 1, "takes 13542 µs at 9600 baud, and bus.tick_us = 11000");
    let same_tick = ["send", "sim:", "-e", "G0 X1", "--protocol", "frame", "-m", "kimm"];
    bench.cnc(&same_tick, 1, "a node needs 10280 µs from one tick to the next");
    let max = ["send", "sim:", "part.nc", "--protocol", "frame", "--speed", "max"];
    bench.cnc(&max, 2, "the host's frame rate is the clock");
    let resume = ["send", "sim:", "part.nc", "--protocol", "frame", "--resume", "trace"];
    bench.cnc(&resume, 2, "acknowledge nothing");
}

#[test]
fn six_axes_have_places_and_nine_have_not() {
    let full = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/machines/full-bus.toml");
    let bench = Bench::new("G21\nM30\n", full);
    let send = ["send", "sim:", "part.nc", "--protocol", "frame"];
    bench.cnc(&send, 2, "a frame has places for 6 axes, this machine has 9");
}
