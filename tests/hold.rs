//! Holds of a job at every phase, in virtual time: it goes on as if nothing had been, or ends where
//! it says. And the journal of all that: any beginning of it says what was true.

use std::collections::BTreeSet;
use std::path::Path;

use cnc::base::{Axis, AxisMap, Command, Event, Machine, Tick};
use cnc::wire::{
    Activity, End, Ending, ExecutedTick, Job, Master, MasterEvent, Nodes, Position, Random, Timing,
    lint,
};
use cnc::wire_io::journal::{
    History, JobRecord, Journal, Journaled, Named, Place, Record, Resumed, steps_of,
};
use cnc::wire_io::{Link, Operator, Sim, drive};
use proptest::prelude::*;

/// Entries of a node's buffer in these tests.
const ENTRIES: u32 = 60;

fn machine() -> Machine {
    let mut machine = Machine::load("starmill").unwrap();
    machine.bus.buffer_ticks = ENTRIES;
    machine
}

fn start(machine: &Machine) -> AxisMap<i64> {
    machine.nearest_steps(&machine.work_zero_mm)
}

/// Some buffers: fast movements, dwells and functions within and between them.
fn job(random: &mut Random, machine: &Machine) -> Job {
    let mut commands = Vec::new();
    let event = |line, text: &str| Command::Event(Event { line, kind: text.parse().unwrap() });
    for buffer in 0..1 + random.below(3) as u32 {
        let line = 10 * buffer;
        if random.below(2) == 0 {
            commands.push(event(line + 1, "M3 S1000"));
            commands.push(event(line + 2, "G4 P0.1"));
        }
        for part in 0..2 {
            let mut peak = AxisMap::<i32>::default();
            for axis in Axis::LINEAR {
                peak[axis] = random.below(25) as i32 - 12;
            }
            let ticks = 5 + random.below(22) as i32;
            for at in 0..ticks {
                let limit = 1 + at.min(ticks - 1 - at);
                let counts =
                    AxisMap::from_fn(|axis| peak[axis].signum() * peak[axis].abs().min(limit));
                commands.push(Command::Tick(Tick { buffer, line: line + 3 + part, counts }));
            }
            if random.below(3) > 0 {
                commands.push(event(line + 5, "G4 P0.25"));
            }
        }
    }
    let job = Job::new(commands, start(machine), machine).unwrap();
    lint(&job, machine).unwrap();
    job
}

/// Presses Ctrl-C in rounds of the loop, and answers at each hold.
struct Person {
    rounds: u64,
    /// Rounds in which a key is pressed.
    presses: Vec<u64>,
    /// Whether to go on, hold after hold; then no more.
    answers: Vec<bool>,
    holds: Vec<MasterEvent>,
    seen: Vec<MasterEvent>,
}

impl Person {
    fn new(presses: Vec<u64>, answers: Vec<bool>) -> Person {
        Person { rounds: 0, presses, answers, holds: Vec::new(), seen: Vec::new() }
    }
}

impl Operator for Person {
    fn event(&mut self, event: &MasterEvent) {
        if let MasterEvent::Held { .. } = event {
            self.holds.push(event.clone());
        }
        self.seen.push(event.clone());
    }
    fn pause(&mut self, _: &Event) -> bool {
        true
    }
    fn held(&mut self, _: &Master) -> bool {
        self.answers.get(self.holds.len() - 1).copied().unwrap_or(false)
    }
    fn progress(&mut self, _: &Master) {
        self.rounds += 1;
    }
    fn interrupts(&mut self) -> usize {
        self.presses.iter().filter(|round| **round <= self.rounds).count()
    }
}

struct Ran {
    job: Job,
    ending: Ending,
    person: Person,
    executed: Vec<ExecutedTick>,
    sim: Sim,
    hazards: Vec<String>,
}

fn run(machine: &Machine, job: Job, mut person: Person, journal: Option<&mut Journal>) -> Ran {
    let nodes = Nodes::new(machine, machine.bus.units(), &job.start_steps, 250);
    let mut sim = Sim::new(nodes);
    let mut master = Master::new(job.clone(), machine, Timing::new(&machine.bus, 1.0));
    let ending = match journal {
        None => drive(&mut sim, &mut master, &mut person),
        Some(journal) => drive(&mut sim, &mut master, &mut Journaled::new(&mut person, journal)),
    };
    sim.drain();
    let log = std::iter::from_fn(|| sim.nodes_mut().poll_log());
    let hazards = log.filter_map(|entry| Some(format!("{entry:?} {}", entry.hazard?))).collect();
    let executed = sim.nodes().executed();
    Ran { job, ending, person, executed, sim, hazards }
}

/// What must hold however often somebody stops and goes on.
fn judge(machine: &Machine, ran: &Ran) {
    assert_eq!(ran.hazards, Vec::<String>::new());
    let planned =
        ran.job.buffers().flat_map(|buffer| (0..ENTRIES as usize).map(|t| buffer.counts(t)));
    let planned: Vec<_> = planned.collect();
    let executed: Vec<_> = ran.executed.iter().map(|tick| tick.counts).collect();
    assert!(planned.starts_with(&executed), "the executed path is a beginning of the plan");
    assert_eq!(executed.len() % 2, 0, "an even number of sync bytes");
    for end in &ran.ending.axes {
        let (_, node) =
            ran.sim.nodes().iter().find(|(unit, _)| unit.axis == Some(end.axis)).unwrap();
        assert_eq!(node.position_steps(), end.steps);
        assert_ne!(end.position, Position::Unknown);
        assert!(node.activity() == Activity::Executing || node.is_in_phase());
        assert!(ran.ending.power_cycle || (!node.is_full() && end.position == Position::Known));
    }
    match ran.ending.end {
        End::Done => assert_eq!(executed, planned),
        End::Interrupted => assert!(!ran.person.holds.is_empty()),
        End::Failed(_) => panic!("{:?}", ran.ending),
    }
    let slow = (machine.axes[0].start_speed_mm_s * machine.bus.tick_s() * 100.0) as u32;
    let counts = ran
        .job
        .buffers()
        .flat_map(|buffer| (0..buffer.lines.len()).map(move |tick| buffer.counts(tick)));
    let counts: Vec<_> = counts.collect();
    // One press waits for slow axes on both sides.
    for hold in ran.person.holds.iter().filter(|_| ran.person.presses.len() == 1) {
        let MasterEvent::Held { ticks, executing: true, .. } = hold else { continue };
        let around = [ticks.checked_sub(1), Some(*ticks)];
        for tick in around.into_iter().flatten().filter_map(|tick| counts.get(tick as usize)) {
            let in_dwell = is_dwell(&ran.job, *ticks);
            assert!(
                in_dwell || tick.0.iter().all(|count| count.unsigned_abs() <= slow),
                "{tick:?}"
            );
        }
    }
}

/// Whether the plan rests before a tick of the job.
fn is_dwell(job: &Job, ticks: u64) -> bool {
    let mut before = 0;
    job.buffers().any(|buffer| {
        let at = |(tick, _): &(usize, Event)| before + *tick as u64 == ticks;
        let found = buffer.events.iter().any(at);
        before += buffer.lines.len() as u64;
        found
    })
}

/// What was seen of a run: where holds took effect and what became of them.
fn seen(ran: &Ran) -> BTreeSet<&'static str> {
    let mut seen = BTreeSet::new();
    for hold in &ran.person.holds {
        let MasterEvent::Held { ticks, executing, .. } = hold else { continue };
        let dwells = is_dwell(&ran.job, *ticks);
        seen.insert(match (executing, dwells) {
            (true, true) if ticks % 2 == 1 => "in a dwell, odd",
            (true, true) => "in a dwell",
            (true, false) => "between ticks",
            (false, _) => "between exchanges",
        });
    }
    seen.insert(match (&ran.ending.end, ran.ending.power_cycle) {
        (End::Done, _) if ran.person.holds.is_empty() => "done, too late to hold",
        (End::Done, _) => "done after a hold",
        (_, true) => "ended, nodes hold buffers",
        (_, false) => "ended, all nodes empty",
    });
    seen
}

#[test]
fn a_job_held_anywhere_goes_on_or_ends_where_it_says() {
    let machine = machine();
    let mut all = BTreeSet::new();
    for seed in 0..600 {
        let mut random = Random(seed);
        let job = job(&mut random, &machine);
        let rounds = 40 + 150 * job.buffers().count() as u64;
        let presses = (0..1 + random.below(3)).map(|_| random.below(rounds)).collect();
        let answers = (0..3).map(|_| random.below(3) > 0).collect();
        let ran = run(&machine, job, Person::new(presses, answers), None);
        judge(&machine, &ran);
        all.extend(seen(&ran));
    }
    let expected = [
        "between exchanges",
        "between ticks",
        "done after a hold",
        "done, too late to hold",
        "ended, all nodes empty",
        "ended, nodes hold buffers",
        "in a dwell",
        "in a dwell, odd",
    ];
    assert_eq!(all, BTreeSet::from(expected));
}

fn begun(job: &Job, resumed: Option<Resumed>) -> Record {
    Record::Job(Box::new(JobRecord {
        schema: 1,
        command: "send".to_owned(),
        program: Named::new("job.nc", &[1; 32]),
        start_steps: steps_of(Axis::LINEAR, &job.start_steps),
        resumed,
        ..JobRecord::default()
    }))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 20, ..ProptestConfig::default() })]

    /// A host that is killed at any time leaves a beginning of its journal.
    #[test]
    fn any_beginning_of_a_journal_is_true(seed: u64, presses in prop::collection::vec(0_u64..400, 0..3)) {
        let machine = machine();
        let job = job(&mut Random(seed), &machine);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("journal");
        let mut journal = Journal::open(&path).unwrap();
        journal.append(begun(&job, None)).unwrap();
        let ran = run(&machine, job, Person::new(presses, vec![true, false]), Some(&mut journal));
        journal.end(&ran.ending);
        prop_assert_eq!(journal.failed(), None);
        drop(journal);
        let bytes = std::fs::read(&path).unwrap();
        let mut last = (0, 0);
        // Cut at the end of each line, and within it.
        let ends = bytes.iter().enumerate().filter(|(_, byte)| **byte == b'\n');
        let cuts = ends.flat_map(|(at, _)| [at - at % 7, at, at + 1]);
        for length in cuts.collect::<BTreeSet<_>>() {
            let (history, whole) = History::read(&bytes[..length]).unwrap();
            prop_assert!(whole <= length && bytes[whole..length].iter().all(|byte| *byte != b'\n'));
            let Some(past) = history.last_sent() else {
                prop_assert_eq!(history.locked(), None);
                continue;
            };
            prop_assert!((past.ticks, past.steps) >= last);
            last = (past.ticks, past.steps);
            let ended = past.end.is_some();
            prop_assert_eq!(ended, length == bytes.len());
            prop_assert_eq!(history.locked().is_some(), !ended || ran.ending.power_cycle);
        }
        prop_assert_eq!(last.0, ran.ending.ticks);
        let history = Journal::read(&path).unwrap();
        for end in &ran.ending.axes {
            let known = matches!(end.position, Position::Known | Position::KnownUntilPowerOff);
            let place = history.place(end.axis);
            prop_assert_eq!(known, place == Place::Known(end.steps));
        }
    }
}

/// What is left of a job after any of its steps is what it would have done then.
#[test]
fn what_is_left_of_a_job_is_the_rest_of_its_plan() {
    let machine = machine();
    for seed in 0..50 {
        let job = job(&mut Random(seed), &machine);
        let counts = |job: &Job| -> Vec<AxisMap<i32>> {
            let ticks = |buffer: &cnc::wire::Buffer| -> Vec<_> {
                (0..buffer.lines.len()).map(|tick| buffer.counts(tick)).collect()
            };
            job.buffers().flat_map(ticks).collect()
        };
        for done in 0..=job.steps.len() {
            let rest = job.after(done, &machine);
            lint(&rest, &machine).unwrap();
            assert_eq!((rest.end_steps, &rest.steps[..]), (job.end_steps, &job.steps[done..]));
            assert!(counts(&job).ends_with(&counts(&rest)));
            assert_eq!(rest.ticks, counts(&rest).len() as u64);
            let ran = run(&machine, rest, Person::new(vec![], vec![]), None);
            judge(&machine, &ran);
            assert_eq!(ran.ending.end, End::Done);
        }
        assert_eq!(job.after(0, &machine), job);
        assert_eq!(
            Job::of_steps(vec![], job.start_steps, &machine).followed_by(job.clone(), &machine),
            job
        );
    }
}

#[test]
fn a_journal_says_whether_its_machine_may_move() {
    let machine = machine();
    let job = job(&mut Random(1), &machine);
    let mut history = History::default();
    let time = String::new;
    assert_eq!((history.locked(), history.place(Axis::X)), (None, Place::Untold));
    history.record(begun(&job, None));
    assert!(history.locked().unwrap().contains("killed"));
    history.record(Record::PowerCycled { time: time() });
    assert_eq!(history.locked(), None);
    assert!(matches!(history.place(Axis::X), Place::Unknown(_)));
    let placed = |axes: &[Axis]| Record::Placed {
        time: time(),
        by: "operator".to_owned(),
        machine: String::new(),
        position: axes.iter().map(|axis| (*axis, 7)).collect(),
    };
    history.record(placed(&[Axis::X]));
    assert_eq!(history.place(Axis::X), Place::Known(7));
    assert!(matches!(history.place(Axis::Y), Place::Unknown(_)));
    assert!(history.is_referenced(Axis::X) && !history.is_referenced(Axis::Y));
    // Its steps say nothing of another machine.
    let Record::Job(other) = begun(&job, None) else { unreachable!() };
    let machine = Named::new("other", &[2; 32]);
    history.record(Record::Job(Box::new(JobRecord { machine, ..*other })));
    assert!(matches!(history.place(Axis::X), Place::Unknown(_)) && !history.is_referenced(Axis::X));
}

#[test]
fn a_journal_is_one_writers_and_nothing_else_is_taken_for_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("new/journal");
    let mut journal = Journal::open(&path).unwrap();
    assert!(!path.exists(), "nothing is made before there is something to say");
    journal.append(Record::PowerCycled { time: "now".to_owned() }).unwrap();
    assert!(Journal::open(&path).unwrap_err().to_string().contains("in use"));
    drop(journal);
    // A line that was cut short is gone once another is written.
    let mut torn = std::fs::read(&path).unwrap();
    torn.extend(b"{\"tick\":12,\"li");
    std::fs::write(&path, torn).unwrap();
    let mut journal = Journal::open(&path).unwrap();
    journal.append(Record::Resumed).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    assert_eq!(text, "{\"type\":\"power-cycled\",\"time\":\"now\"}\n{\"type\":\"resumed\"}\n");
    drop(journal);
    for other in ["G0 X1", "G0 X1\n", "{\"a\":1}\n", "\0\0\0\n"] {
        std::fs::write(&path, other).unwrap();
        assert!(Journal::open(&path).unwrap_err().to_string().contains("line 1"), "{other:?}");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), other);
    }
    assert!(Journal::open(folder.path()).is_err());
}

/// Runs a job with a journal that begins anew at a length; gives what it says in the end.
fn long(path: &Path, seed: u64, length_max: u64) -> (History, Option<String>) {
    let machine = machine();
    let mut journal = Journal::open(path).unwrap().with_length_max(length_max);
    for seed in [seed, seed + 1] {
        let job = job(&mut Random(seed), &machine);
        journal.append(begun(&job, None)).unwrap();
        let presses = vec![40 + seed * 13];
        let ran = run(&machine, job, Person::new(presses, vec![seed % 3 > 0]), Some(&mut journal));
        journal.end(&ran.ending);
    }
    assert_eq!(journal.failed(), None);
    assert!(Journal::open(path).unwrap_err().to_string().contains("in use"));
    (Journal::read(path).unwrap(), journal.too_long().map(str::to_owned))
}

#[test]
fn a_long_journal_begins_anew_with_what_it_has_said() {
    let folder = tempfile::tempdir().unwrap();
    let mut begun_anew = 0;
    for seed in 0..20 {
        let path = |name: &str| folder.path().join(format!("{seed}{name}"));
        let (whole, none) = long(&path("whole"), seed, 1 << 40);
        let (said, too_long) = long(&path("short"), seed, 1500);
        assert_eq!((none, too_long), (None, None));
        assert_eq!(said.locked().is_some(), whole.locked().is_some());
        for axis in Axis::LINEAR {
            assert_eq!(said.place(axis), whole.place(axis));
        }
        let [said, whole] = [&said, &whole].map(|history| history.last_sent().unwrap());
        assert_eq!((&said.job, said.steps), (&whole.job, whole.steps), "{seed}");
        assert_eq!((said.ticks, said.line), (whole.ticks, whole.line));
        let text = std::fs::read_to_string(path("short")).unwrap();
        begun_anew += usize::from(text.starts_with("{\"type\":\"carried\""));
        assert!(!path("short.new").exists() && !path("whole.old").exists());
        assert!(
            !path("short.old").exists()
                || History::read(&std::fs::read(path("short.old")).unwrap()).is_ok()
        );
    }
    assert!(begun_anew > 15, "{begun_anew}");
    // Where it cannot, it grows on, and says so.
    let path = folder.path().join("stuck");
    std::fs::create_dir_all(folder.path().join("stuck.new/in")).unwrap();
    let (said, too_long) = long(&path, 1, 1500);
    assert!(too_long.unwrap().contains("cannot begin anew"));
    assert!(said.last_sent().is_some() && path.metadata().unwrap().len() > 3000);
}

/// A disk that is full from the beginning: the job does not begin; one that fills ends it.
#[test]
fn a_job_ends_when_its_journal_cannot_be_written() {
    let machine = machine();
    let job = job(&mut Random(3), &machine);
    let mut full = Journal::open("/dev/full".as_ref()).unwrap();
    assert!(full.append(begun(&job, None)).is_err());
    let ran = run(&machine, job, Person::new(vec![], vec![true]), Some(&mut full));
    judge(&machine, &ran);
    assert_eq!(ran.ending.end, End::Interrupted);
    assert!(full.failed().unwrap().contains("/dev/full"));
}
