//! The master against virtual nodes, in virtual time, without IO: jobs made from seeds, and faults.

use cnc::base::machine::Unit;
use cnc::base::{Axis, AxisMap, Command, Event, EventKind, Machine, Tick};
use cnc::wire::{
    Activity, During, End, Ending, ExecutedTick, Fault, Firmware, Job, Master, MasterEvent, Nodes,
    Position, Step, Timing, lint,
};
use cnc::wire_io::{Link, LinkError, Operator, Sim, drive};
use proptest::prelude::*;

const AXES: [Axis; 3] = [Axis::X, Axis::Y, Axis::Z];

fn starmill() -> Machine {
    Machine::load("starmill").unwrap()
}

/// The built-in profile with one of its lines changed.
fn starmill_with(from: &str, to: &str) -> Machine {
    let text = starmill().to_toml().replace(from, to);
    assert_ne!(text, starmill().to_toml(), "{from}");
    Machine::parse("changed", &text).unwrap()
}

fn start() -> AxisMap<i64> {
    let mut steps = AxisMap::default();
    (steps[Axis::X], steps[Axis::Y], steps[Axis::Z]) = (7500, 5000, 5000);
    steps
}

fn unit(axis: Axis, id: u8) -> Unit {
    Unit { axis: Some(axis), id }
}

fn tick(buffer: u32, line: u32, counts: [i32; 3]) -> Command {
    let mut map = AxisMap::default();
    AXES.iter().zip(counts).for_each(|(axis, count)| map[*axis] = count);
    Command::Tick(Tick { buffer, line, counts: map })
}

fn event(line: u32, text: &str) -> Command {
    Command::Event(Event { line, kind: text.parse().unwrap() })
}

/// Nobody interrupts, every pause is gone over; keeps what it is told.
#[derive(Default)]
struct Quiet {
    events: Vec<MasterEvent>,
    pauses: Vec<Event>,
    /// Interrupts once so many ticks are done.
    stop_at: Option<u64>,
    interrupts: usize,
}

impl Operator for Quiet {
    fn event(&mut self, event: &MasterEvent) {
        self.events.push(event.clone());
    }
    fn pause(&mut self, event: &Event) -> bool {
        self.pauses.push(event.clone());
        true
    }
    fn progress(&mut self, master: &Master) {
        let reached = self.stop_at.is_some_and(|ticks| master.progress().ticks >= ticks);
        self.interrupts = usize::from(reached);
    }
    fn interrupts(&mut self) -> usize {
        self.interrupts
    }
}

/// A simulated bus that notes when sync bytes leave, and can spoil answers.
struct Wire {
    sim: Sim,
    singles_us: Vec<u64>,
    sent: Vec<u8>,
    /// Number of the answer that is spoiled, and how.
    spoil: Option<(usize, Spoil)>,
    answers: usize,
    held: Option<(u64, u8)>,
    /// The host is held up for so long between its look at the clock and every third sync byte.
    stall_us: u64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Spoil {
    Lose,
    Change(u8),
    Delay(u64),
    Double,
    Close,
}

impl Wire {
    fn new(sim: Sim, spoil: Option<(usize, Spoil)>) -> Self {
        let (singles_us, sent) = (vec![], vec![]);
        Wire { sim, singles_us, sent, spoil, answers: 0, held: None, stall_us: 0 }
    }
}

impl Link for Wire {
    fn now_us(&mut self) -> u64 {
        self.sim.now_us()
    }
    fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        let fills = |node: &Firmware| node.activity() == Activity::Filling;
        if bytes == [0] && !self.sim.nodes().iter().any(|(_, node)| fills(node)) {
            if self.singles_us.len() % 3 == 2 {
                let until_us = self.sim.now_us() + self.stall_us;
                self.sim.receive(&mut Vec::new(), until_us, None)?;
            }
            self.singles_us.push(self.sim.now_us());
        }
        self.sent.extend(bytes);
        self.sim.send(bytes)
    }
    fn receive(
        &mut self,
        bytes: &mut Vec<u8>,
        until_us: u64,
        answer_from_us: Option<u64>,
    ) -> Result<(), LinkError> {
        let release_us = self.held.map_or(u64::MAX, |(at_us, _)| at_us);
        let mut came = Vec::new();
        self.sim.receive(&mut came, until_us.min(release_us), answer_from_us)?;
        if let Some((at_us, byte)) = self.held.filter(|(at_us, _)| *at_us <= self.sim.now_us()) {
            assert!(at_us <= self.sim.now_us());
            bytes.push(byte);
            self.held = None;
        }
        for byte in came {
            let spoil =
                self.spoil.filter(|(number, _)| *number == self.answers).map(|(_, how)| how);
            self.answers += 1;
            match spoil {
                None => bytes.push(byte),
                Some(Spoil::Lose) => {}
                Some(Spoil::Change(other)) => bytes.push(other),
                Some(Spoil::Double) => bytes.extend([byte, byte]),
                Some(Spoil::Delay(us)) => self.held = Some((self.sim.now_us() + us, byte)),
                Some(Spoil::Close) => return Err(LinkError::Closed),
            }
        }
        Ok(())
    }
}

/// What came of a job.
struct Outcome {
    ending: Ending,
    /// When it ended.
    ended_us: u64,
    wire: Wire,
    executed: Vec<ExecutedTick>,
    hazards: Vec<String>,
    operator: Quiet,
}

fn run_with(
    machine: &Machine,
    job: Job,
    spoil: Option<(usize, Spoil)>,
    operator: Quiet,
) -> Outcome {
    run_on(machine, machine.bus.units().collect(), job, spoil, operator)
}

fn run_on(
    machine: &Machine,
    units: Vec<Unit>,
    job: Job,
    spoil: Option<(usize, Spoil)>,
    mut operator: Quiet,
) -> Outcome {
    let sim = Sim::new(Nodes::new(machine, units, &start(), 250));
    let mut wire = Wire::new(sim, spoil);
    let mut master = Master::new(job, machine, Timing::new(&machine.bus, 1.0));
    let ending = drive(&mut wire, &mut master, &mut operator);
    let ended_us = wire.now_us();
    wire.sim.drain();
    let mut hazards = Vec::new();
    while let Some(entry) = wire.sim.nodes_mut().poll_log() {
        hazards.extend(entry.hazard.map(|why| format!("{entry:?} {why}")));
    }
    let executed = wire.sim.nodes().executed();
    Outcome { ending, ended_us, wire, executed, hazards, operator }
}

/// Every entry that a job has planned, pads included.
fn planned(job: &Job) -> Vec<AxisMap<i32>> {
    let counts = |buffer: &cnc::wire::Buffer| -> Vec<_> {
        (0..buffer.fills[0].bytes.len()).map(|tick| buffer.counts(tick)).collect()
    };
    job.buffers().flat_map(counts).collect()
}

/// A job runs as planned: every tick, every position, no hazard, no tick shorter than the period.
fn check(machine: &Machine, commands: Vec<Command>) -> Outcome {
    let job = Job::new(commands, start(), machine).unwrap();
    lint(&job, machine).unwrap();
    let outcome = run_with(machine, job.clone(), None, Quiet::default());
    assert_eq!(outcome.ending.end, End::Done);
    assert_eq!(outcome.hazards, Vec::<String>::new());
    let executed: Vec<_> = outcome.executed.iter().map(|tick| tick.counts).collect();
    assert_eq!(executed, planned(&job));
    assert_eq!(job.first_difference(&outcome.executed), None);
    for (unit, node) in outcome.wire.sim.nodes().iter() {
        let planned = unit.axis.map(|axis| job.end_steps[axis]);
        assert!(planned.is_none_or(|steps| node.position_steps() == steps));
        assert!(!node.is_full());
    }
    for end in &outcome.ending.axes {
        assert_eq!((end.steps, end.position), (job.end_steps[end.axis], Position::Known));
    }
    assert_eq!(outcome.ending.ticks, job.ticks);
    let entries = machine.bus.buffer_ticks as usize;
    let mut syncs = outcome.wire.singles_us.chunks(entries);
    for buffer in job.buffers() {
        let syncs = syncs.next().unwrap();
        assert_eq!(syncs.len(), entries);
        for (tick, pair) in syncs.windows(2).enumerate().take(buffer.lines.len()) {
            assert!(pair[1] - pair[0] >= u64::from(machine.bus.tick_us), "tick {tick}");
        }
    }
    // The simulated clock counts whole microseconds: up to 4 an entry.
    let (took_s, told_s) = (outcome.ended_us as f64 * 1e-6, job.duration_s(&machine.bus));
    let rounding_s = 4e-6 * (entries * (1 + job.buffers().count())) as f64;
    assert!((took_s - told_s).abs() <= rounding_s, "{took_s} s, told were {told_s} s");
    outcome
}

/// One movement: which axes move, how fast at most, for how many ticks; it ends at rest.
fn movement(buffer: u32, line: u32, peak: [i32; 3], ticks: usize) -> Vec<Command> {
    let ramp = |tick: usize, peak: i32| {
        let limit = 1 + tick.min(ticks - 1 - tick) as i32;
        peak.signum() * peak.abs().min(limit)
    };
    (0..ticks).map(|at| tick(buffer, line, peak.map(|peak| ramp(at, peak)))).collect()
}

fn jobs() -> impl Strategy<Value = Vec<Command>> {
    let axis = prop_oneof![3 => Just(0), 3 => -20..=20, 1 => -1..=1];
    let part = (prop::array::uniform3(axis), 1_usize..60, 0..8, any::<bool>());
    prop::collection::vec(part, 1..9).prop_map(|parts| {
        let mut commands = Vec::new();
        let mut buffer = 0;
        for (line, (peak, ticks, extra, new_buffer)) in (1..).zip(parts) {
            // There and back, so that no job leaves the travel.
            commands.extend(movement(buffer, line, peak, ticks));
            match extra {
                0 => commands.push(event(line, "G4 P0.25")),
                1 => commands.push(event(line, "M3 S1200")),
                2 => commands.extend((0..7).map(|_| tick(buffer, line, [0; 3]))),
                _ => {}
            }
            commands.extend(movement(buffer, line, peak.map(|count| -count), ticks));
            // A feed below one count a tick.
            commands.extend((0..12).map(|at| tick(buffer, line, [0, i32::from(at % 4 == 0), 0])));
            buffer += u32::from(new_buffer);
            if new_buffer && extra == 3 {
                commands.push(event(line, "M0"));
            }
        }
        commands
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, ..ProptestConfig::default() })]

    #[test]
    fn nodes_execute_what_was_planned(commands in jobs()) {
        check(&starmill(), commands);
    }

    #[test]
    fn a_hold_at_any_time_says_the_truth(commands in jobs(), stop_at in 0_u64..400) {
        let machine = starmill();
        let job = Job::new(commands, start(), &machine).unwrap();
        let operator = Quiet { stop_at: Some(stop_at), ..Quiet::default() };
        let outcome = run_with(&machine, job, None, operator);
        prop_assert_eq!(outcome.hazards, Vec::<String>::new());
        for end in &outcome.ending.axes {
            let nodes: Vec<_> = outcome.wire.sim.nodes().iter().collect();
            let (_, node) = nodes.iter().find(|(unit, _)| unit.axis == Some(end.axis)).unwrap();
            prop_assert_eq!(node.position_steps(), end.steps);
            let asleep = outcome.ending.power_cycle;
            // Servants of a buffer that is not done cannot be asked.
            let fits = match end.position {
                Position::Known => !asleep,
                Position::KnownUntilPowerOff | Position::Unconfirmed => asleep,
                Position::KnownAsSent => false,
                Position::Unknown => false,
            };
            prop_assert!(fits, "{:?}", outcome.ending);
            prop_assert!(asleep || (!node.is_full() && node.is_in_phase()));
        }
    }

    #[test]
    fn a_spoiled_answer_stops_the_job(
        commands in jobs(),
        number in 0_usize..4000,
        how in prop_oneof![
            Just(Spoil::Lose), Just(Spoil::Change(7)), Just(Spoil::Change(121)), Just(Spoil::Double),
            Just(Spoil::Delay(900_000)), Just(Spoil::Close)
        ],
    ) {
        let machine = starmill();
        let job = Job::new(commands, start(), &machine).unwrap();
        let outcome = run_with(&machine, job, Some((number, how)), Quiet::default());
        let reached = outcome.wire.answers > number;
        // A fill command whose answer was lost may go through at the second try.
        let may_recover = how == Spoil::Lose;
        if !reached {
            prop_assert_eq!(&outcome.ending.end, &End::Done);
        } else if !may_recover {
            prop_assert!(matches!(outcome.ending.end, End::Failed(_)), "{:?}", outcome.ending);
        }
        // What is called known is where the node stands.
        for end in outcome.ending.axes.iter().filter(|end| end.position != Position::Unknown) {
            let nodes: Vec<_> = outcome.wire.sim.nodes().iter().collect();
            let (_, node) = nodes.iter().find(|(unit, _)| unit.axis == Some(end.axis)).unwrap();
            prop_assert_eq!(node.position_steps(), end.steps);
        }
    }
}

#[test]
fn every_kind_of_move_runs_as_planned() {
    let machine = starmill();
    let mut commands = vec![event(1, "M3 S1200"), event(2, "G4 P0.5")];
    commands.extend(movement(0, 3, [0, 20, 0], 200));
    commands.push(event(4, "G4 P1"));
    commands.extend(movement(0, 5, [0, 0, -18], 150));
    commands.push(event(6, "M0"));
    commands.extend(movement(1, 7, [2, -3, 1], 1496));
    commands.extend((0..20).map(|_| tick(2, 8, [0; 3])));
    commands.extend(movement(3, 9, [-20, 1, 0], 90));
    commands.push(event(10, "M30"));
    let outcome = check(&machine, commands);
    assert_eq!(outcome.operator.pauses.len(), 1);
    let told = |kind: &str| {
        let kind: EventKind = kind.parse().unwrap();
        outcome
            .operator
            .events
            .iter()
            .any(|event| matches!(event, MasterEvent::Event(event) | MasterEvent::Dwell(event) if event.kind == kind))
    };
    assert!(told("M3 S1200") && told("M30") && told("G4 P1"));
}

#[test]
fn only_nodes_that_move_are_filled() {
    let job = Job::new(movement(0, 1, [0, 9, 0], 50), start(), &starmill()).unwrap();
    let fills: Vec<_> = job.buffers().flat_map(|buffer| &buffer.fills).collect();
    assert_eq!(fills.len(), 1);
    assert!(fills[0].unit.axis == Some(Axis::Y) && fills[0].master && fills[0].bytes.len() == 1500);
    assert_eq!(job.extents_mm[Axis::X], None);
    assert_eq!(job.extents_mm[Axis::Y], Some([50.0, 53.78]));
}

#[test]
fn a_buffer_without_motion_is_not_sent() {
    let mut commands =
        vec![event(1, "T1"), tick(0, 2, [0; 3]), event(3, "M6 T1"), tick(0, 4, [0; 3])];
    commands.push(event(5, "M2"));
    let job = Job::new(commands, start(), &starmill()).unwrap();
    assert_eq!(job.buffers().count(), 0);
    let lines = |step: &Step| matches!(step, Step::Event(event) if event.line % 2 == 1);
    assert!(job.steps.len() == 3 && job.steps.iter().all(lines));
}

/// All IDs that a DIP switch can give are carried, if an order of filling exists.
#[test]
fn high_ids_are_filled_first() {
    let machine = starmill_with("Z = 124", "Z = 130");
    // X runs at -2 (130): Z has to be full before, although it rests.
    let outcome = check(&machine, movement(0, 1, [-2, 0, 0], 40));
    let order = outcome.operator.events.iter().filter_map(|event| match event {
        MasterEvent::Filling { unit, .. } => unit.axis,
        _ => None,
    });
    assert_eq!(order.collect::<Vec<_>>(), [Axis::Z, Axis::X]);
}

fn refused(machine: &Machine, commands: Vec<Command>) -> String {
    let job = Job::new(commands, start(), machine);
    job.and_then(|job| lint(&job, machine)).unwrap_err().to_string()
}

#[test]
fn what_the_bus_cannot_carry_is_refused() {
    let machine = starmill();
    let short = || movement(0, 7, [3, 0, 0], 20);
    let mut counts = AxisMap::default();
    counts[Axis::C] = 1;
    let no_axis = Command::Tick(Tick { buffer: 0, line: 7, counts });
    let cases = [
        (Machine::load("router").unwrap(), short(), "protocol"),
        (starmill_with("tick_us = 11000", "tick_us = 10279"), short(), "too short"),
        (machine.clone(), vec![no_axis], "no node"),
        (machine.clone(), vec![event(7, "G4 P1e300")], "rests for more"),
        (machine.clone(), movement(0, 7, [21, 0, 0], 60), "at most 20"),
        (machine.clone(), movement(0, 7, [20, 0, 0], 390), "travel"),
        (machine.clone(), movement(0, 7, [1, 0, 0], 1498), "1496"),
        (machine.clone(), vec![tick(0, 7, [9, 0, 0])], "without a ramp"),
        (machine.clone(), vec![tick(1, 7, [1, 0, 0]), tick(0, 8, [1, 0, 0])], "after a later"),
        (machine.clone(), [short(), vec![event(8, "M0")], short()].concat(), "M0 waits"),
    ];
    for (machine, commands, expected) in cases {
        let commands =
            if expected == "travel" { [commands.clone(), commands].concat() } else { commands };
        let message = refused(&machine, commands);
        assert!(message.contains(expected), "{expected}: {message}");
    }
}

/// Each would take the other's data for its fill command: no order helps.
#[test]
fn a_job_that_no_order_of_filling_carries_is_refused() {
    let text = starmill().to_toml().replace("X = 122", "X = 129").replace("Y = 123", "Y = 130");
    let machine = Machine::parse("high", &text).unwrap();
    let message = refused(&machine, movement(0, 7, [-2, -1, 0], 40));
    assert!(message.contains("tick") && message.contains("axis"), "{message}");
}

#[test]
fn faults_are_named_and_nothing_starts() {
    let machine = starmill();
    let job = || Job::new(movement(0, 1, [5, 0, 3], 50), start(), &machine).unwrap();
    let all: Vec<Unit> = machine.bus.units().collect();
    let fault = |units: &[Unit], spoil| {
        let outcome = run_on(&machine, units.to_vec(), job(), spoil, Quiet::default());
        assert_eq!(outcome.executed, []);
        assert_eq!(outcome.hazards, Vec::<String>::new());
        match outcome.ending.end {
            End::Failed(fault) => fault,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(fault(&all[..2], None), Fault::NoAnswer { unit: all[2], during: During::Ping });
    assert_eq!(fault(&[], None), Fault::NoAnswer { unit: all[0], during: During::Ping });
    let wrong = fault(&all, Some((0, Spoil::Change(99))));
    assert!(matches!(wrong, Fault::WrongAnswer { got: 99, during: During::Ping, .. }));
    // Answers: 2 pings, ping, fill command, data.
    let lost = fault(&all, Some((4, Spoil::Lose)));
    assert!(matches!(lost, Fault::NoAnswer { during: During::FillData { buffer: 0 }, .. }));
    let early = fault(&all, Some((3, Spoil::Double)));
    assert!(matches!(early, Fault::Early { .. } | Fault::Unexpected { .. }), "{early:?}");
    let closed = fault(&all, Some((3, Spoil::Close)));
    assert!(matches!(closed, Fault::Port(_)));
}

/// Runs a job on nodes that have heard something before.
fn run_after(said: &[u8]) -> (Ending, Sim) {
    let machine = starmill();
    let mut sim = Sim::new(Nodes::new(&machine, machine.bus.units(), &start(), 250));
    sim.send(said).unwrap();
    sim.drain();
    let job = Job::new(movement(0, 1, [5, 0, 3], 50), start(), &machine).unwrap();
    let mut master = Master::new(job, &machine, Timing::new(&machine.bus, 1.0));
    let ending = drive(&mut sim, &mut master, &mut Quiet::default());
    sim.drain();
    (ending, sim)
}

/// One byte too many: the ping's second byte and the pad are a fill command to the node, which
/// gets its buffer full of zeros. Nothing moves.
#[test]
fn a_node_out_of_phase_is_found_out_and_moves_nothing() {
    let (ending, sim) = run_after(&[0x55]);
    let during = During::Ping;
    let fault = Fault::NoAnswer { unit: unit(Axis::X, 122), during };
    assert_eq!((ending.end, ending.power_cycle), (End::Failed(fault), true));
    assert_eq!(sim.nodes().executed(), []);
    let (_, x) = sim.nodes().iter().next().unwrap();
    assert!(x.is_full() && x.position_steps() == start()[Axis::X]);
}

/// A buffer left over from an abandoned job cannot be replaced (H7): the fill command is not
/// answered, and nothing is started.
#[test]
fn a_buffer_left_over_stops_the_job() {
    let left_over = [vec![124, 0], vec![9; 1500]].concat();
    let (ending, sim) = run_after(&left_over);
    let during = During::FillCommand { buffer: 0 };
    let fault = Fault::NoAnswer { unit: unit(Axis::Z, 124), during };
    assert_eq!((ending.end, ending.power_cycle), (End::Failed(fault), true));
    assert_eq!(sim.nodes().executed(), []);
    assert!(sim.nodes().iter().all(|(_, node)| node.is_in_phase()));
}

/// Data that would send a node to its limit switch, whether it is full or not (H3).
#[test]
fn data_that_is_a_home_command_is_refused() {
    let text = starmill().to_toml().replace("speed_max_mm_s = 20.0", "speed_max_mm_s = 110.0");
    let machine = Machine::parse("fast", &text.replace("Y = 123", "Y = 129")).unwrap();
    let counts = [1, 0, i32::from(b'h'), -1, 1, 0];
    let data = |counts: &[i32]| counts.iter().map(|x| tick(0, 7, [*x, 0, 0])).collect::<Vec<_>>();
    let message = refused(&machine, data(&counts));
    assert!(message.contains("tick 2") && message.contains("node 129 of axis Y"), "{message}");
    let shifted = data(&counts[1..]);
    let job = Job::new(shifted, start(), &machine).unwrap();
    lint(&job, &machine).unwrap();
}

/// A host that does not pace: next sync as soon as the master answers. This is what the firmware
/// does with it (H6), so that the tests above mean something.
#[test]
fn an_unpaced_host_makes_the_nodes_lose_sync() {
    let machine = starmill();
    let units = [unit(Axis::X, 122), unit(Axis::Y, 123)];
    let mut sim = Sim::new(Nodes::new(&machine, units, &start(), 250));
    let tell = |sim: &mut Sim, bytes: &[u8], answers: usize| {
        sim.send(bytes).unwrap();
        let mut came = Vec::new();
        while came.len() < answers {
            let until_us = sim.now_us() + 1_000_000;
            sim.receive(&mut came, until_us, None).unwrap();
        }
    };
    // X is the master and rests, Y moves.
    tell(&mut sim, &[122, 122], 1);
    tell(&mut sim, &[0; 1500], 1);
    tell(&mut sim, &[123, 0], 1);
    tell(&mut sim, &[20; 1500], 1);
    tell(&mut sim, &[120, 0], 0);
    for _ in 0..1500 {
        tell(&mut sim, &[0], 1);
    }
    sim.drain();
    let mut log = Vec::new();
    while let Some(entry) = sim.nodes_mut().poll_log() {
        log.push(entry);
    }
    use cnc::wire::Happening::{Overrun, SyncWaited};
    let waited = |happening| matches!(happening, SyncWaited { waited_us, .. } if waited_us > 9000);
    assert!(log.iter().any(|entry| entry.hazard.is_some() && waited(entry.happening)));
    assert!(log.iter().any(|entry| entry.happening == Overrun));
    let (_, y) = sim.nodes().iter().nth(1).unwrap();
    assert!(y.is_full() && y.position_steps() < start()[Axis::Y] + 20 * 1500);
}

/// A host that the system holds up just before it writes a sync byte: the next one keeps its
/// distance from that write, not from when it was due. X is the master and rests, Y moves.
#[test]
fn a_host_held_up_before_a_write_keeps_the_distance() {
    let machine = starmill();
    let moves = [movement(0, 2, [1, 0, 0], 400), movement(0, 3, [0, 20, 0], 200)].concat();
    let job = Job::new(moves, start(), &machine).unwrap();
    let sim =
        Sim::new(Nodes::new(&machine, [unit(Axis::X, 122), unit(Axis::Y, 123)], &start(), 250));
    let mut wire = Wire { stall_us: 7000, ..Wire::new(sim, None) };
    let mut master = Master::new(job, &machine, Timing::new(&machine.bus, 1.0));
    let ending = drive(&mut wire, &mut master, &mut Quiet::default());
    assert_eq!(ending.end, End::Done);
    let pacing = ending.pacing.figures();
    assert!(pacing.late_us_max >= 7000 && pacing.slides > 100, "{pacing:?}");
    let syncs_us = &wire.singles_us[wire.singles_us.len() - 1500..];
    for (tick, pair) in syncs_us.windows(2).take(600).enumerate() {
        assert!(pair[1] - pair[0] >= 11_000, "tick {tick}: {} µs", pair[1] - pair[0]);
    }
    while let Some(entry) = wire.sim.nodes_mut().poll_log() {
        assert!(entry.hazard.is_none(), "{entry:?}");
    }
}

#[test]
fn a_tick_that_was_not_executed_as_planned_is_found() {
    let machine = starmill();
    let moves = [movement(0, 5, [5, 0, 3], 50), movement(1, 6, [-5, 0, 0], 40)].concat();
    let job = Job::new(moves, start(), &machine).unwrap();
    let executed = run_with(&machine, job.clone(), None, Quiet::default()).executed;
    let check = |change: &dyn Fn(&mut Vec<ExecutedTick>), expected| {
        let mut changed = executed.clone();
        change(&mut changed);
        assert_eq!(job.first_difference(&changed), expected);
    };
    check(&|_| {}, None);
    check(&|ticks| ticks[7].counts[Axis::Y] = 1, Some((7, 5)));
    check(&|ticks| ticks[1503].counts[Axis::X] = 0, Some((53, 6)));
    check(&|ticks| ticks.truncate(1500), Some((50, 6)));
    check(&|ticks| ticks.swap(0, 6), Some((0, 5)));
}
