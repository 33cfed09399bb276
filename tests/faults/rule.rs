//! Seed → a short job on virtual nodes with one fault, and the rule that it is held to: what was
//! executed is a beginning of the plan with all axes in step and the host says where it ends, or the
//! host says that the position is unknown; and nothing moves that was not planned.
//!
//! [`blind`] lists what the protocol hides from any host; docs/bus.md tells it in words.

use std::collections::BTreeSet;

use cnc::base::machine::{Master as MasterChoice, Unit};
use cnc::base::{Axis, AxisMap, Command, Event, Machine, Tick};
use cnc::wire::{
    Activity, During, End, Ending, Entry, Fault, FaultKind, FaultSpec, Faults, Firmware, Happening,
    Job, Master, MasterEvent, Nodes, Phase, Position, Random, Reached, Replay, Struck, Timing, Who,
    lint, reached,
};
use cnc::wire_io::{Hands, Link, Operator, Sim, TraceLine, Traced, drive};

/// A job that has run.
pub struct Ran {
    pub seed: u64,
    pub job: Job,
    pub faults: Vec<FaultSpec>,
    pub struck: Vec<Struck>,
    pub ending: Ending,
    pub log: Vec<Entry>,
    machine: Machine,
    /// All bytes both ways, as `--trace` writes them.
    trace: Vec<TraceLine>,
    nodes: Vec<(Unit, Firmware)>,
    difference: Option<(u64, u32)>,
}

/// Stops the job at a tick, if at all.
struct Person {
    stop_at: Option<u64>,
    stopped: bool,
    helper: Helper,
}

/// Does events, or fails to do one.
struct Helper {
    /// How many it has begun.
    begun: u64,
    fails_at: Option<u64>,
    /// Whether it is asked twice.
    slow: bool,
    asked: bool,
}

impl Hands for Helper {
    fn begin(&mut self, _: &Event, _: &AxisMap<i64>) -> Result<(), String> {
        self.begun += 1;
        self.asked = false;
        Ok(())
    }
    fn is_done(&mut self) -> Result<bool, String> {
        if self.fails_at == Some(self.begun) {
            return Err("cannot".to_owned());
        }
        Ok(std::mem::replace(&mut self.asked, true) || !self.slow)
    }
    fn stop(&mut self) {}
}

impl Operator for Person {
    fn event(&mut self, _: &MasterEvent) {}
    fn hands(&mut self) -> Option<&mut dyn Hands> {
        Some(&mut self.helper)
    }
    fn pause(&mut self, _: &Event) -> bool {
        true
    }
    fn progress(&mut self, master: &Master) {
        self.stopped |= self.stop_at.is_some_and(|ticks| master.progress().ticks >= ticks);
    }
    fn interrupts(&mut self) -> usize {
        // Twice does not wait for a place to stop without a ramp.
        2 * usize::from(self.stopped)
    }
}

/// A machine with its nodes: three axes, sometimes IDs that occur in data, any kind of master.
fn machine(random: &mut Random, entries: u32) -> Machine {
    let mut machine = Machine::load("starmill").unwrap();
    let bus = &mut machine.bus;
    bus.buffer_ticks = entries;
    let ids = [[122, 123, 124], [129, 123, 131], [121, 135, 130]];
    let ids = ids[random.below(3) as usize];
    bus.nodes = Axis::LINEAR.into_iter().zip(ids).collect();
    bus.master = match random.below(6) {
        0 => MasterChoice::Rotate,
        1 => MasterChoice::Axis(Axis::Y),
        2 => MasterChoice::Metronome,
        _ => MasterChoice::Auto,
    };
    if bus.master == MasterChoice::Metronome {
        bus.metronome_id = Some(126);
    }
    if random.below(4) == 0 {
        bus.spare_ids = vec![133];
    }
    machine
}

/// Movements from rest to rest, one a buffer, with events between and within them.
fn commands(random: &mut Random, entries: u32) -> Vec<Command> {
    let mut commands = Vec::new();
    // Drawn apart, so that the motion of a seed stays what it is.
    let mut events = Random(!random.0);
    let event = |text: &str, line| Command::Event(Event { line, kind: text.parse().unwrap() });
    for buffer in 0..1 + random.below(3) as u32 {
        let mut peak = [0_i32; 3];
        for axis in &mut peak {
            if random.below(2) == 0 {
                *axis = random.below(15) as i32 - 7;
            }
        }
        peak[random.below(3) as usize] = 1 + random.below(9) as i32;
        if events.below(3) == 0 {
            let kind = ["M3 S800", "M6 T2", "M0", "G4 P0.01"][events.below(4) as usize];
            commands.push(event(kind, buffer + 1));
        }
        let within = (events.below(4) == 0).then(|| ["M8", "G4 P0.02"][events.below(2) as usize]);
        let ticks = 6 + random.below(u64::from(entries) - 10) as i32;
        for at in 0..ticks {
            if let Some(kind) = within.filter(|_| at == 2) {
                commands.push(event(kind, buffer + 1));
            }
            let limit = 1 + at.min(ticks - 1 - at);
            let mut counts = AxisMap::default();
            for (axis, peak) in Axis::LINEAR.into_iter().zip(peak) {
                counts[axis] = peak.signum() * peak.abs().min(limit);
            }
            commands.push(Command::Tick(Tick { buffer, line: buffer + 1, counts }));
        }
    }
    commands
}

/// Runs the job of a seed with its fault; every tenth seed has none, every eighth a person who stops.
/// Every sixteenth has buffers so long that they are sent in pieces.
pub fn run(seed: u64, entries: u32) -> Ran {
    let entries = if seed % 16 == 3 { 10 * entries } else { entries };
    let count = usize::from(!seed.is_multiple_of(10));
    let fault = move |units: &[Unit]| Faults::draw(!seed, count, units, entries);
    let stop = seed.is_multiple_of(8);
    run_with(seed, entries, stop, fault)
}

/// Runs the job of a seed with these faults.
pub fn run_with(
    seed: u64,
    entries: u32,
    stop: bool,
    faults: impl FnOnce(&[Unit]) -> Vec<FaultSpec>,
) -> Ran {
    let mut random = Random(seed);
    let (machine, job) = loop {
        let machine = machine(&mut random, entries);
        let start = machine.nearest_steps(&machine.work_zero_mm);
        // Some need an order of filling that there is not.
        if let Ok(job) = Job::new(commands(&mut random, entries), start, &machine) {
            break (machine, job);
        }
    };
    lint(&job, &machine).unwrap();
    let units: Vec<Unit> = machine.bus.units().collect();
    let faults = faults(&units);
    let stop_at = stop.then(|| random.below(2 * u64::from(entries)));
    let injected = Faults::new(faults.clone(), entries, machine.bus.metronome_id);
    let nodes = Nodes::new(&machine, units, &job.start_steps, 250).with_faults(injected);
    let mut sim = Sim::new(nodes);
    let mut master = Master::new(job.clone(), &machine, Timing::new(&machine.bus, 1.0));
    // Where nothing else goes wrong.
    let fails = faults.is_empty() && seed.is_multiple_of(20);
    let fails_at = fails.then_some(1 + seed / 20 % 2);
    let helper = Helper { begun: 0, fails_at, slow: seed.is_multiple_of(16), asked: false };
    let mut link = Traced::new(&mut sim, Some(Vec::new()));
    let ending = drive(&mut link, &mut master, &mut Person { stop_at, stopped: false, helper });
    let trace = link.into_trace().unwrap_or_default();
    sim.drain();
    let nodes = sim.nodes_mut();
    let struck = std::iter::from_fn(|| nodes.poll_struck()).collect();
    let log = std::iter::from_fn(|| nodes.poll_log()).collect();
    let difference = job.first_difference(&nodes.executed());
    let nodes = nodes.iter().map(|(unit, node)| (unit, node.clone())).collect();
    Ran { seed, job, faults, struck, ending, log, machine, trace, nodes, difference }
}

/// Nodes of which no host can know, since of these faults nothing comes back to it (H14):
/// - a byte changed on its way to a node, but for a sync byte, or a start that all hear alike;
/// - a byte added that is a command, or that shifts a ping's parameters;
/// - a servant that starts anew while it holds a buffer.
fn blind(ran: &Ran) -> BTreeSet<Unit> {
    let mut blind = BTreeSet::new();
    for Struck { at_us, fault, phase } in &ran.struck {
        let hidden = match fault.kind {
            FaultKind::Change(_) => match phase {
                Phase::Ping | Phase::Command | Phase::Data => true,
                Phase::Start => fault.who.is_some(),
                Phase::Tick | Phase::Pad => false,
            },
            FaultKind::Add(byte) => match phase {
                Phase::Ping => true,
                Phase::Command | Phase::Data => matches!(byte, b'h' | b'j' | 120),
                Phase::Start | Phase::Tick | Phase::Pad => false,
            },
            FaultKind::Reset => fault.who.is_some_and(|who| holds_buffer(ran, who, *at_us)),
            _ => false,
        };
        let of = |unit: &Unit| fault.who.is_none_or(|who| who.is(*unit));
        blind.extend(ran.nodes.iter().map(|(unit, _)| *unit).filter(|_| hidden).filter(of));
    }
    blind
}

/// Whether a node was full, or executed, as a servant.
fn holds_buffer(ran: &Ran, who: Who, at_us: u64) -> bool {
    let (mut servant, mut holds) = (false, false);
    for entry in ran.log.iter().filter(|entry| who.is(entry.unit) && entry.at_us <= at_us) {
        match entry.happening {
            Happening::FillBegins { master } => servant = !master,
            Happening::Filled => holds = true,
            Happening::Finished => holds = false,
            _ => {}
        }
    }
    servant && holds
}

/// Holds a run against the rule.
pub fn judge(ran: &Ran) -> Result<(), String> {
    let blind = blind(ran);
    let is_without =
        matches!(ran.ending.end, End::Done | End::Interrupted | End::Failed(Fault::Event { .. }));
    if ran.struck.is_empty() && !is_without {
        return Err("a job without a fault failed".to_owned());
    }
    for (unit, node) in &ran.nodes {
        if !blind.contains(unit) {
            nothing_unplanned(ran, *unit, node)?;
        }
    }
    replays(ran)?;
    let planned = planned_position(ran);
    for end in &ran.ending.axes {
        if end.steps != planned[end.axis] {
            return Err(format!("{} is said to be off the plan: {end:?}", end.axis));
        }
        let claimed = matches!(end.position, Position::Known | Position::KnownUntilPowerOff);
        let (unit, node) = node_of(ran, end.axis);
        if claimed && node.position_steps() != end.steps && !blind.contains(unit) {
            let at = node.position_steps();
            return Err(format!("{} is said to be known and stands at {at}: {end:?}", end.axis));
        }
        if ran.ending.end == End::Done && end.position != Position::Known {
            return Err(format!("done, and not known: {end:?}"));
        }
    }
    // A servant held up by less than its receiver keeps lags, and catches up.
    let stalled = ran.struck.iter().any(|at| matches!(at.fault.kind, FaultKind::Stall(_)));
    let in_step = blind.is_empty() && !stalled;
    if ran.ending.end == End::Done && in_step && ran.difference.is_some() {
        return Err(format!("done, and executed otherwise: {:?}", ran.difference));
    }
    Ok(())
}

/// Plays the host's bytes to fresh nodes.
fn replay(ran: &Ran) -> Replay {
    let units = ran.nodes.iter().map(|(unit, _)| *unit);
    let mut replay = Replay::new(Nodes::new(&ran.machine, units, &ran.job.start_steps, 250), false);
    for line in &ran.trace {
        match line {
            TraceLine::Sent { t_us, bytes, failed: false } => replay.sent(*t_us, bytes),
            TraceLine::Received { t_us, bytes } => replay.received(*t_us, bytes),
            _ => {}
        }
    }
    replay.end(true);
    replay
}

/// A replay executes what the nodes did, where their host's bytes reached them; and while no answer
/// differs nothing that was not planned.
fn replays(ran: &Ran) -> Result<(), String> {
    let replay = replay(ran);
    let reached_nodes = |kind: FaultKind| kind.is_of_answer() || kind == FaultKind::Close;
    let counts =
        |node: &Firmware| node.runs().iter().map(|run| run.counts.clone()).collect::<Vec<_>>();
    if ran.struck.iter().all(|at| reached_nodes(at.fault.kind)) {
        for ((unit, node), (_, replayed)) in ran.nodes.iter().zip(replay.nodes().iter()) {
            let positions = (node.position_steps(), replayed.position_steps());
            if counts(node) != counts(replayed) || positions.0 != positions.1 {
                return Err(format!("{unit} does otherwise in a replay: {positions:?}"));
            }
        }
    }
    let difference = replay.difference();
    if ran.struck.is_empty() && (difference.is_some() || !replay.hazards().is_empty()) {
        return Err(format!("a replay differs without a fault: {difference:?}"));
    }
    if difference.is_some() {
        return Ok(());
    }
    let astray = |reached: &Reached| reached.planned.as_ref().is_some_and(|at| !at.as_planned);
    match reached(replay.nodes(), Some(&ran.job)).into_iter().find(astray) {
        Some(reached) => Err(format!("a replay executes what was not planned: {reached:?}")),
        None => Ok(()),
    }
}

fn node_of(ran: &Ran, axis: Axis) -> &(Unit, Firmware) {
    ran.nodes.iter().find(|(unit, _)| unit.axis == Some(axis)).unwrap()
}

/// Every execution is a beginning of the buffer that was to be executed, and nothing else moved.
fn nothing_unplanned(ran: &Ran, unit: Unit, node: &Firmware) -> Result<(), String> {
    let fills = ran.job.buffers().flat_map(|buffer| &buffer.fills).filter(|fill| fill.unit == unit);
    let count = |byte: &u8| cnc::wire::codec::decode(*byte);
    let mut fills = fills.map(|fill| fill.bytes.iter().map(count).collect::<Vec<_>>());
    let mut steps = unit.axis.map_or(0, |axis| ran.job.start_steps[axis]);
    for run in node.runs() {
        if fills.next().is_none_or(|counts| !counts.starts_with(&run.counts)) {
            return Err(format!("{unit} executed what was not planned"));
        }
        steps += run.counts.iter().map(|count| i64::from(*count)).sum::<i64>();
    }
    let busy = matches!(node.activity(), Activity::Filling | Activity::Executing);
    if ran.ending.end == End::Done && (fills.next().is_some() || node.is_full() || busy) {
        return Err(format!("done, and {unit} is not"));
    }
    if steps != node.position_steps() {
        let at = node.position_steps();
        return Err(format!("{unit} stands at {at}, its buffers brought it to {steps}"));
    }
    Ok(())
}

/// Where the plan is after the ticks that were acknowledged.
fn planned_position(ran: &Ran) -> AxisMap<i64> {
    let mut position = ran.job.start_steps;
    let ticks = ran
        .job
        .buffers()
        .flat_map(|buffer| (0..buffer.lines.len()).map(move |tick| buffer.counts(tick)));
    for counts in ticks.take(ran.ending.ticks as usize) {
        Axis::ALL.iter().for_each(|axis| position[*axis] += i64::from(counts[*axis]));
    }
    position
}

/// Names of all that happened: faults and where, what the host found, what nodes did.
pub fn seen(ran: &Ran) -> BTreeSet<String> {
    let mut seen = BTreeSet::new();
    for Struck { fault, phase, .. } in &ran.struck {
        seen.insert(format!("{} at {}", fault.kind.name(), phase.name()));
    }
    for entry in &ran.log {
        seen.insert(match entry.happening {
            Happening::FillBegins { master } => format!("node: fill, master {master}"),
            Happening::Jogs { feed } => format!("node: jog, ping {}", feed == 0),
            Happening::Filled => "node: full".to_owned(),
            Happening::Starts => "node: starts".to_owned(),
            Happening::Finished => "node: finished".to_owned(),
            Happening::Homes { .. } => "node: homes".to_owned(),
            Happening::SyncWaited { .. } => "node: sync waited".to_owned(),
            Happening::Overrun => "node: overrun".to_owned(),
            Happening::FrameMissed { .. } | Happening::RanDry { .. } => "node: frames".to_owned(),
        });
        seen.extend(entry.hazard.map(|hazard| format!("hazard: {hazard}")));
    }
    let during = |during: &During| match during {
        During::Ping => "ping",
        During::FillCommand { .. } => "command",
        During::FillData { .. } => "data",
        During::Tick { .. } => "tick",
        During::Homing => "homing",
        During::Silence => "silence",
    };
    seen.insert(match &ran.ending.end {
        End::Done => "host: done".to_owned(),
        End::Interrupted => "host: interrupted".to_owned(),
        End::Failed(Fault::NoAnswer { during: at, .. }) => {
            format!("host: no answer to {}", during(at))
        }
        End::Failed(Fault::WrongAnswer { during: at, .. }) => {
            format!("host: wrong answer to {}", during(at))
        }
        End::Failed(Fault::Early { .. }) => "host: early".to_owned(),
        End::Failed(Fault::Unexpected { .. }) => "host: unexpected".to_owned(),
        End::Failed(Fault::Port(_)) => "host: port".to_owned(),
        End::Failed(Fault::Event { .. }) => match ran.ending.power_cycle {
            true => "host: event within a buffer failed".to_owned(),
            false => "host: event between buffers failed".to_owned(),
        },
    });
    for end in &ran.ending.axes {
        let right = node_of(ran, end.axis).1.position_steps() == end.steps;
        let is = if right { "right" } else { "wrong" };
        seen.insert(format!("position: {}, and {is}", end.position.name()));
    }
    let replayed = replay(ran).difference();
    seen.insert(match replayed.map(|at| (at.recorded.is_some(), at.replayed.is_some())) {
        None => "replay: the same".to_owned(),
        Some((true, true)) => "replay: another answer".to_owned(),
        Some((true, false)) => "replay: an answer too many".to_owned(),
        Some((false, _)) => "replay: an answer is missing".to_owned(),
    });
    seen.insert(format!("power cycle: {}", ran.ending.power_cycle));
    seen
}
