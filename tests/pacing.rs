//! A host that the system holds up anywhere, for any time: sync bytes never come closer than the
//! period, nothing fails, and what was measured is what happened.

use cnc::base::{Axis, AxisMap, Command, Event, Machine, Tick};
use cnc::wire::{Activity, End, Faults, Job, Master, MasterEvent, Nodes, Random, Timing};
use cnc::wire_io::{Link, LinkError, Operator, Sim, drive};
use proptest::prelude::*;

/// A simulated bus whose host is held up.
struct Hostile {
    sim: Sim,
    random: Random,
    /// One look, sleep or write in so many takes longer than asked.
    one_in: u64,
    /// Up to so long.
    held_up_us: u64,
    /// Answers that have come while the host was held up.
    came: Vec<u8>,
    /// When each sync byte left.
    syncs_us: Vec<u64>,
}

impl Hostile {
    /// Time passes, for the host unawares.
    fn hold_up(&mut self) {
        if self.random.below(self.one_in) == 0 {
            // Short hold-ups are as likely as long ones.
            let most = self.random.below(self.held_up_us.ilog2().into()) + 1;
            let until_us = self.sim.now_us() + self.random.below(1 << most);
            while self.sim.now_us() < until_us {
                self.sim.receive(&mut self.came, until_us, None).unwrap();
            }
        }
    }
}

impl Link for Hostile {
    fn now_us(&mut self) -> u64 {
        let now_us = self.sim.now_us();
        self.hold_up();
        now_us
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        self.hold_up();
        let fills = self.sim.nodes().iter().any(|(_, node)| node.activity() == Activity::Filling);
        if bytes == [0] && !fills {
            self.syncs_us.push(self.sim.now_us());
        }
        self.sim.send(bytes)?;
        self.hold_up();
        Ok(())
    }

    fn receive(
        &mut self,
        bytes: &mut Vec<u8>,
        until_us: u64,
        answer_from_us: Option<u64>,
    ) -> Result<(), LinkError> {
        self.hold_up();
        if self.came.is_empty() {
            // Sleeps in pieces, and signals end them: it may come back with nothing.
            let until_us = until_us.min(self.sim.now_us() + 1 + self.random.below(50_000));
            self.sim.receive(&mut self.came, until_us, answer_from_us)?;
        }
        bytes.append(&mut self.came);
        self.hold_up();
        Ok(())
    }
}

struct Nobody;

impl Operator for Nobody {
    fn event(&mut self, _: &MasterEvent) {}
    fn pause(&mut self, _: &Event) -> bool {
        true
    }
    fn progress(&mut self, _: &Master) {}
    fn interrupts(&mut self) -> usize {
        0
    }
}

/// There and back: X ramps, Y creeps below a count a tick; two buffers.
fn job(machine: &Machine) -> Job {
    let commands = (0..2_u32).flat_map(|buffer| {
        (0..300_i32).map(move |at| {
            let mut counts = AxisMap::default();
            let ramp = 1 + at.min(299 - at).min(19);
            counts[Axis::X] = if buffer == 0 { ramp } else { -ramp };
            counts[Axis::Y] = i32::from(at % 7 == 0);
            Command::Tick(Tick { buffer, line: 1 + buffer, counts })
        })
    });
    let start = machine.nearest_steps(&machine.work_zero_mm);
    Job::new(commands.collect::<Vec<_>>(), start, machine).unwrap()
}

fn check(seed: u64, one_in: u64, held_up_us: u64) {
    let machine = Machine::load("starmill").unwrap();
    let job = job(&machine);
    let nodes = Nodes::new(&machine, machine.bus.units(), &job.start_steps, 250);
    let mut link = Hostile {
        sim: Sim::new(nodes),
        random: Random(seed),
        one_in,
        held_up_us,
        came: Vec::new(),
        syncs_us: Vec::new(),
    };
    let mut master = Master::new(job.clone(), &machine, Timing::new(&machine.bus, 1.0));
    let ending = drive(&mut link, &mut master, &mut Nobody);
    assert_eq!(ending.end, End::Done);
    link.sim.drain();
    assert_eq!(job.first_difference(&link.sim.nodes().executed()), None);
    while let Some(entry) = link.sim.nodes_mut().poll_log() {
        assert_eq!(entry.hazard, None, "{entry:?}");
    }
    let period_us = u64::from(machine.bus.tick_us);
    let mut least_us = u64::MAX;
    for (buffer, syncs_us) in job.buffers().zip(link.syncs_us.chunks(1500)) {
        for (tick, pair) in syncs_us.windows(2).enumerate() {
            // Pads go as answers come; the tick before has moved nothing.
            let is_motion = tick < buffer.lines.len();
            assert!(pair[1] - pair[0] >= if is_motion { period_us } else { 250 }, "tick {tick}");
            least_us = least_us.min(if is_motion { pair[1] - pair[0] } else { u64::MAX });
        }
    }
    let figures = ending.pacing.figures();
    let told_us = figures.least_us.unwrap();
    assert!(figures.intervals == 600 && period_us <= told_us, "{figures:?}");
    let [p999_us, greatest_us] = [figures.p999_us, figures.greatest_us].map(Option::unwrap);
    assert!(told_us <= p999_us && p999_us <= greatest_us && least_us >= period_us);
    let slides = figures.late_histogram.iter().filter(|(late_us, _)| *late_us >= 1024);
    assert!(figures.slides >= slides.map(|(_, count)| count).sum::<u64>());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn a_host_that_is_held_up_slides_and_never_bunches(
        seed in any::<u64>(),
        one_in in 2_u64..2000,
        held_up_us in prop_oneof![Just(2_u64), 2_u64..20_000, 2_u64..2_000_000],
    ) {
        check(seed, one_in, held_up_us);
    }
}

/// A second is more than the time that a node has to answer: the answer is there by then.
#[test]
fn hold_ups_longer_than_the_time_out_do_not_blame_the_nodes() {
    (0..8).for_each(|seed| check(seed, 20, 2_000_000));
}

/// A port that keeps some sync bytes back for milliseconds, as busy systems do: the master rests and
/// answers at once, so only when it does tells the host that the others began late.
#[test]
fn what_the_port_keeps_back_does_not_bring_ticks_closer() {
    let machine = Machine::load("starmill").unwrap();
    let tick = |at: i32, counts: [i32; 2]| {
        let mut map = AxisMap::default();
        (map[Axis::X], map[Axis::Y]) = (counts[0], counts[1]);
        Command::Tick(Tick { buffer: 0, line: 1 + at as u32 / 300, counts: map })
    };
    // X moves in most ticks, and is the master while Y moves too.
    let ramp = |at: i32| (1 + at.min(199 - at)).clamp(0, 20);
    let commands =
        (0..500).map(|at| if at < 300 { tick(at, [1, 0]) } else { tick(at, [0, ramp(at - 300)]) });
    let start = machine.nearest_steps(&machine.work_zero_mm);
    let job = Job::new(commands.collect::<Vec<_>>(), start, &machine).unwrap();
    let late = (300..500).step_by(7).map(|at| format!("late=4000@tick.{at}").parse().unwrap());
    let faults = Faults::new(late.collect(), 1500, None);
    let nodes = Nodes::new(&machine, machine.bus.units(), &job.start_steps, 250);
    let mut sim = Sim::new(nodes.with_faults(faults));
    let mut master = Master::new(job.clone(), &machine, Timing::new(&machine.bus, 1.0));
    let ending = drive(&mut sim, &mut master, &mut Nobody);
    assert_eq!(ending.end, End::Done);
    assert_eq!(job.first_difference(&sim.nodes().executed()), None);
    while let Some(entry) = sim.nodes_mut().poll_log() {
        assert_eq!(entry.hazard, None, "{entry:?}");
    }
    let figures = ending.pacing.figures();
    assert_eq!((figures.slides, figures.slides_by_answer), (29, 29));
}

/// The line is kept busy, and an idle system keeps the period to the microsecond.
#[test]
fn a_host_that_nobody_holds_up_is_never_late() {
    let machine = Machine::load("starmill").unwrap();
    let job = job(&machine);
    let mut sim = Sim::new(Nodes::new(&machine, machine.bus.units(), &job.start_steps, 250));
    let mut master = Master::new(job, &machine, Timing::new(&machine.bus, 1.0));
    let figures = drive(&mut sim, &mut master, &mut Nobody).pacing.figures();
    assert_eq!((figures.least_us, figures.greatest_us), (Some(11_000), Some(11_000)));
    assert_eq!((figures.slides, figures.late_us), (0, 0));
    assert!(figures.fill_busy_percent >= Some(98.0), "{figures:?}");
}
