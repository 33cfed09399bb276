//! Homing and raw jogs on virtual nodes, in virtual time, with every fault at every byte: what the
//! host says of a position is right, or it says that it does not know.

use std::collections::BTreeSet;

use cnc::base::machine::Unit;
use cnc::base::{Axis, AxisMap, Event, Machine};
use cnc::wire::{
    Activity, Audit, During, End, Ending, Entry, Fault, FaultKind, FaultSpec, Faults, HOME_STEPS,
    Happening, Job, Master, MasterEvent, Nodes, Position, Timing, Who, homing, lint, raw_jog,
};
use cnc::wire_io::{Link, LinkError, Operator, Sim, drive};

/// A tick at which the built-in machine may home.
const TICK_US: u32 = 40_000;

fn machine() -> Machine {
    let mut machine = Machine::load("starmill").unwrap();
    machine.bus.node_tick_us = TICK_US;
    // Short buffers: a node that is filled by mistake is soon full.
    machine.bus.buffer_ticks = 40;
    machine
}

fn start(machine: &Machine) -> AxisMap<i64> {
    machine.nearest_steps(&machine.work_zero_mm)
}

/// Stops so often when something happens for the first time.
struct Person {
    stops: fn(&MasterEvent) -> usize,
    stopped: usize,
    events: Vec<MasterEvent>,
}

impl Operator for Person {
    fn event(&mut self, event: &MasterEvent) {
        self.stopped = self.stopped.max((self.stops)(event));
        self.events.push(event.clone());
    }
    fn pause(&mut self, _: &Event) -> bool {
        true
    }
    fn progress(&mut self, _: &Master) {}
    fn interrupts(&mut self) -> usize {
        self.stopped
    }
}

/// A simulated bus whose host looks at its operator every so many microseconds.
struct Sliced(Sim, u64);

impl Link for Sliced {
    fn now_us(&mut self) -> u64 {
        self.0.now_us()
    }
    fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        self.0.send(bytes)
    }
    fn receive(
        &mut self,
        bytes: &mut Vec<u8>,
        until_us: u64,
        answer_from_us: Option<u64>,
    ) -> Result<(), LinkError> {
        let look_us = self.0.now_us() + self.1;
        self.0.receive(bytes, until_us.min(look_us), answer_from_us)
    }
    fn drain(&mut self) {
        self.0.drain();
    }
}

struct Ran {
    ending: Ending,
    /// Where each axis stands in truth.
    truth: AxisMap<i64>,
    /// Nodes that wait for data or ticks.
    busy: Vec<Unit>,
    log: Vec<Entry>,
    struck: usize,
    events: Vec<MasterEvent>,
}

fn run(job: &Job, faults: Vec<FaultSpec>, stops: fn(&MasterEvent) -> usize) -> Ran {
    let machine = machine();
    lint(job, &machine).unwrap();
    // Nobody stops a job that has a fault.
    let slice_us = if faults.is_empty() { 20_000 } else { 1 << 40 };
    let faults = Faults::new(faults, machine.bus.buffer_ticks, None);
    let nodes = Nodes::new(&machine, machine.bus.units(), &start(&machine), 250);
    let mut sim = Sliced(Sim::new(nodes.with_faults(faults)), slice_us);
    let mut master = Master::new(job.clone(), &machine, Timing::new(&machine.bus, 1.0));
    let mut person = Person { stops, stopped: 0, events: vec![] };
    let ending = drive(&mut sim, &mut master, &mut person);
    let nodes = sim.0.nodes_mut();
    let struck = std::iter::from_fn(|| nodes.poll_struck()).count();
    let log = std::iter::from_fn(|| nodes.poll_log()).collect();
    let mut truth = AxisMap::default();
    let mut busy = Vec::new();
    for (unit, node) in nodes.iter() {
        unit.axis.into_iter().for_each(|axis| truth[axis] = node.position_steps());
        if matches!(node.activity(), Activity::Filling | Activity::Executing) {
            busy.push(unit);
        }
    }
    Ran { ending, truth, busy, log, struck, events: person.events }
}

fn never(_: &MasterEvent) -> usize {
    0
}

fn counted(steps: AxisMap<i64>) -> AxisMap<Option<i64>> {
    AxisMap::from_fn(|axis| Some(steps[axis]))
}

fn home_all() -> Job {
    homing(&machine(), &[], counted(start(&machine())), Some(TICK_US)).unwrap()
}

/// An axis that homes stops when a tick is over.
fn is_right(ran: &Ran, axis: Axis, steps: i64) -> bool {
    let was_homed = ran.ending.homed.iter().any(|run| run.axis == axis);
    let beyond = if was_homed { i64::from(HOME_STEPS) } else { 1 };
    (0..beyond).contains(&(steps - ran.truth[axis]))
}

/// What the host claims is true; a job that is done left no node at work.
fn judge(ran: &Ran) -> Result<(), String> {
    for end in &ran.ending.axes {
        let claimed = matches!(end.position, Position::Known | Position::KnownUntilPowerOff);
        if claimed && !is_right(ran, end.axis, end.steps) {
            return Err(format!("stands at {}: {end:?}", ran.truth[end.axis]));
        }
    }
    if ran.ending.end == End::Done && !ran.busy.is_empty() {
        return Err(format!("done, and busy: {:?}", ran.busy));
    }
    Ok(())
}

#[test]
fn axes_run_to_their_switches_one_after_another() {
    let ran = run(&home_all(), vec![], never);
    assert_eq!(ran.ending.end, End::Done);
    judge(&ran).unwrap();
    let order: Vec<Axis> = ran.ending.homed.iter().map(|run| run.axis).collect();
    assert_eq!(order, [Axis::Z, Axis::X, Axis::Y]);
    for end in &ran.ending.axes {
        assert_eq!((end.steps, end.position), (0, Position::Known));
    }
    for run in &ran.ending.homed {
        assert_eq!(run.audit(), Audit::Agrees, "{run:?}");
    }
    assert!(ran.log.iter().all(|entry| entry.hazard.is_none()));
}

#[test]
fn a_position_that_was_wrong_shows() {
    let mut wrong = start(&machine());
    wrong[Axis::X] = 4000;
    let job = homing(&machine(), &[Axis::X], counted(wrong), Some(TICK_US)).unwrap();
    let ran = run(&job, vec![], never);
    let audit = ran.ending.homed[0].audit();
    assert!(matches!(audit, Audit::OffBy(3000..3500)), "{audit:?}");
}

#[test]
fn a_switch_elsewhere_is_where_the_axis_is_said_to_be() {
    let text = Machine::load("starmill").unwrap().to_toml().replacen(
        "start_speed_mm_s = 1.0",
        "start_speed_mm_s = 1.0\nhome_mm = -2.0",
        1,
    );
    let mut machine = Machine::parse("own", &text).unwrap();
    machine.bus.node_tick_us = TICK_US;
    let job = homing(&machine, &[Axis::X], AxisMap::default(), None).unwrap();
    let nodes = Nodes::new(&machine, machine.bus.units(), &start(&machine), 250);
    let mut sim = Sim::new(nodes);
    let mut master = Master::new(job, &machine, Timing::new(&machine.bus, 1.0));
    let mut person = Person { stops: never, stopped: 0, events: vec![] };
    let ending = drive(&mut sim, &mut master, &mut person);
    assert_eq!((ending.axes.len(), ending.axes[0].steps), (1, -200));
    let (_, node) = sim.nodes().iter().next().unwrap();
    assert!((-279..=-200).contains(&node.position_steps()));
}

/// Kinds of faults, and whether the protocol hides from any host what may come of one: a byte that
/// becomes another command, on its way or by one that noise adds.
fn kinds() -> Vec<(FaultKind, bool)> {
    use FaultKind::*;
    let seen = [
        Drop,
        Late(900),
        Late(300_000),
        LoseAnswer,
        ChangeAnswer(0x10),
        ChangeAnswer(0x01),
        DoubleAnswer,
        LateAnswer(20_000),
        LateAnswer(300_000_000),
        Collide,
        Dead,
        Stall(15_000),
        Stall(300_000),
        Reset,
        Overrun,
        Close,
        // h and j differ in one bit.
        Change(0x02),
    ];
    let hidden = [Change(0x55), Change(0x01), Add(0), Add(b'h'), Add(b'j'), Add(122)];
    seen.into_iter().map(|kind| (kind, false)).chain(hidden.map(|kind| (kind, true))).collect()
}

/// Runs a job with each fault at each of its first bytes or answers, at all nodes or at X alone.
fn check_faults(job: &Job, bytes: u64) -> BTreeSet<String> {
    let mut seen = BTreeSet::new();
    for (kind, is_hidden) in kinds() {
        let alone = matches!(kind, FaultKind::Drop | FaultKind::Change(_) | FaultKind::Add(_));
        let x = Some(Who::Axis(Axis::X));
        let whos: &[_] = match (kind.needs_node(), alone) {
            (true, _) => &[x],
            (false, true) => &[None, x],
            (false, false) => &[None],
        };
        let count = if kind.is_of_answer() { bytes / 8 } else { bytes };
        let step = match kind {
            FaultKind::Drop | FaultKind::LoseAnswer | FaultKind::Change(0x02) => 1,
            _ => 4,
        };
        let places = || (0..count).step_by(step);
        for (who, number) in whos.iter().flat_map(|who| places().map(move |at| (*who, at))) {
            let fault = FaultSpec { kind, who, phase: None, number };
            let ran = run(job, vec![fault], never);
            let verdict = judge(&ran);
            assert!(is_hidden || verdict.is_ok(), "{fault}: {verdict:?}\n{:#?}", ran.ending);
            seen.insert(match &ran.ending.end {
                End::Done => "done".to_owned(),
                End::Interrupted => "interrupted".to_owned(),
                End::Failed(Fault::NoAnswer { during, .. }) => format!("no answer {during:?}"),
                End::Failed(Fault::WrongAnswer { during, .. }) => format!("wrong {during:?}"),
                End::Failed(Fault::Unexpected { .. }) => "unexpected".to_owned(),
                End::Failed(Fault::Early { .. }) => "early".to_owned(),
                End::Failed(Fault::Port(_)) => "port".to_owned(),
                End::Failed(Fault::Event { .. }) => "event".to_owned(),
            });
            if ran.struck == 0 {
                assert_eq!(ran.ending.end, End::Done, "{fault}");
            }
        }
    }
    seen
}

#[test]
fn homing_with_a_fault_ends_at_the_switch_or_is_told() {
    let seen = check_faults(&home_all(), 140);
    for what in ["done", "no answer Homing", "wrong Homing", "no answer Ping", "unexpected", "port"]
    {
        assert!(seen.contains(what), "{what}: {seen:?}");
    }
}

#[test]
fn homing_with_a_fault_of_a_seed_is_told_of() {
    let (job, machine) = (home_all(), machine());
    let units: Vec<Unit> = machine.bus.units().collect();
    for seed in 0..400 {
        let faults = Faults::draw(seed, 1, &units, machine.bus.buffer_ticks);
        let is_hidden =
            |fault: &FaultSpec| matches!(fault.kind, FaultKind::Change(_) | FaultKind::Add(_));
        let is_hidden = faults.iter().any(is_hidden);
        let ran = run(&job, faults.clone(), never);
        let verdict = judge(&ran);
        assert!(is_hidden || verdict.is_ok(), "seed {seed}, {faults:?}: {verdict:?}");
    }
}

#[test]
fn a_raw_jog_runs_its_way_and_its_position_is_unknown() {
    let machine = machine();
    let job = raw_jog(&machine, Axis::X, -0.5, Some(60.0)).unwrap();
    let ran = run(&job, vec![], never);
    assert_eq!(ran.ending.end, End::Done);
    assert!(ran.log.iter().all(|entry| entry.hazard.is_none()), "{:#?}", ran.log);
    let jogs = |entry: &Entry| matches!(entry.happening, Happening::Jogs { feed: 132 });
    assert_eq!(ran.log.iter().filter(|entry| jogs(entry)).count(), 1);
    let made = ran.truth[Axis::X] - start(&machine)[Axis::X];
    assert!((-56..=-50).contains(&made), "{made}");
    assert_eq!(ran.ending.axes.len(), 1);
    assert_eq!(ran.ending.axes[0].position, Position::Unknown);
    let told = |event: &MasterEvent| matches!(event, MasterEvent::Jogged { steps: -56..=-50, .. });
    assert!(ran.events.iter().any(told), "{:?}", ran.events);
}

#[test]
fn a_raw_jog_stops_when_it_is_told_to() {
    let job = raw_jog(&machine(), Axis::X, 50.0, Some(60.0)).unwrap();
    let ran = run(&job, vec![], |event| usize::from(matches!(event, MasterEvent::Jogging { .. })));
    assert_eq!(ran.ending.end, End::Done);
    let made = ran.truth[Axis::X] - start(&machine())[Axis::X];
    assert!((0..=8).contains(&made), "{made}");
    assert!(ran.busy.is_empty());
}

#[test]
fn whatever_fails_a_raw_jog_ends() {
    let job = raw_jog(&machine(), Axis::X, 0.5, Some(60.0)).unwrap();
    let seen = check_faults(&job, 34);
    for what in ["done", "no answer Ping", "wrong Ping", "unexpected", "port"] {
        assert!(seen.contains(what), "{what}: {seen:?}");
    }
}

#[test]
fn a_way_to_the_switch_is_not_waited_for_twice() {
    // Once: the axis under way comes to its switch, the others stay where they are known to be.
    let once = run(&home_all(), vec![], |event| {
        usize::from(matches!(event, MasterEvent::Homing { axis: Axis::X }))
    });
    assert_eq!((once.ending.end.clone(), once.ending.homed.len()), (End::Interrupted, 2));
    assert!(once.ending.axes.iter().all(|end| end.position == Position::Known));
    judge(&once).unwrap();
    // Twice: nobody knows where it is, and its node has to be switched off.
    let twice = run(&home_all(), vec![], |event| {
        2 * usize::from(matches!(event, MasterEvent::Homing { axis: Axis::X }))
    });
    assert_eq!((twice.ending.end.clone(), twice.ending.power_cycle), (End::Interrupted, true));
    judge(&twice).unwrap();
    let x = twice.ending.axes.iter().find(|end| end.axis == Axis::X).unwrap();
    assert_eq!(x.position, Position::Unknown);
}

#[test]
fn a_switch_that_never_closes_is_given_up() {
    let job = home_all();
    let ran = run(&job, vec!["late-answer=600000000@4".parse().unwrap()], never);
    let fault = Fault::NoAnswer { unit: job.nodes[0], during: During::Homing };
    assert_eq!(ran.ending.end, End::Failed(fault));
    assert!(ran.ending.power_cycle);
    judge(&ran).unwrap();
}

/// H7: a second `j` would be taken for the feed of the first, 106 steps a tick.
#[test]
fn an_unanswered_jog_is_not_repeated() {
    let job = raw_jog(&machine(), Axis::X, 0.5, Some(60.0)).unwrap();
    let machine = machine();
    let faults = Faults::new(vec!["lose-answer@2".parse().unwrap()], 40, None);
    let nodes = Nodes::new(&machine, machine.bus.units(), &start(&machine), 250);
    let mut link = Heard { sim: Sim::new(nodes.with_faults(faults)), sent: vec![] };
    let mut master = Master::new(job, &machine, Timing::new(&machine.bus, 1.0));
    let mut person = Person { stops: never, stopped: 0, events: vec![] };
    let ending = drive(&mut link, &mut master, &mut person);
    assert!(matches!(ending.end, End::Failed(Fault::NoAnswer { .. })));
    let ping = [b'j', 122, 122, 0, 0, 0, b's', b's'];
    let jog = [b'j', 122];
    // One zero, to which a servant would answer; then what ends a jog that waits for its feed.
    let out = [0, 0, 0, 0, b's', b's'];
    assert_eq!(link.sent, [&ping[..], &ping, &jog, &out].concat());
    let (_, node) = link.sim.nodes().iter().next().unwrap();
    assert_eq!(node.position_steps(), start(&machine)[Axis::X]);
}

/// Keeps what the host sends.
struct Heard {
    sim: Sim,
    sent: Vec<u8>,
}

impl Link for Heard {
    fn now_us(&mut self) -> u64 {
        self.sim.now_us()
    }
    fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        self.sent.extend(bytes);
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
}
