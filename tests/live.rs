//! What an operator sees while a job runs on simulated nodes.

use cnc::base::{Axis, AxisMap, Command, Event, Machine, Tick};
use cnc::wire::{Job, Live, Master, MasterEvent, Nodes, Reading, Timing};
use cnc::wire_io::{Operator, Sim, drive};

/// Keeps what could be seen at every tick.
struct Watcher {
    live: Live,
    seen: Vec<Reading>,
}

impl Operator for Watcher {
    fn event(&mut self, event: &MasterEvent) {
        self.live.event(event);
    }
    fn pause(&mut self, _: &Event) -> bool {
        true
    }
    fn progress(&mut self, master: &Master) {
        self.live.update(master);
        let reading = self.live.reading(master);
        if self.seen.last() != Some(&reading) {
            self.seen.push(reading);
        }
    }
    fn interrupts(&mut self) -> usize {
        0
    }
}

fn line(buffer: u32, line: u32, counts: [i32; 2], ticks: usize) -> Vec<Command> {
    let tick = |at: usize| {
        let limit = 1 + at.min(ticks - 1 - at) as i32;
        let mut map = AxisMap::default();
        for (axis, count) in [Axis::X, Axis::Y].into_iter().zip(counts) {
            map[axis] = count.signum() * count.abs().min(limit);
        }
        Command::Tick(Tick { buffer, line, counts: map })
    };
    (0..ticks).map(tick).collect()
}

fn seen(commands: Vec<Command>) -> (Job, Vec<Reading>) {
    let machine = Machine::load("starmill").unwrap();
    let start = machine.nearest_steps(&machine.work_zero_mm);
    let job = Job::new(commands, start, &machine).unwrap();
    let live = Live::new(&job, &machine);
    let mut sim = Sim::new(Nodes::new(&machine, machine.bus.units(), &start, 250));
    let mut master = Master::new(job.clone(), &machine, Timing::new(&machine.bus, 1.0));
    let mut watcher = Watcher { live, seen: vec![] };
    drive(&mut sim, &mut master, &mut watcher);
    (job, watcher.seen)
}

#[test]
fn positions_feed_spindle_and_time_are_shown() {
    let event = |text: &str| Command::Event(Event { line: 1, kind: text.parse().unwrap() });
    let mut commands = vec![event("M3 S1200")];
    commands.extend(line(0, 2, [3, 4], 400));
    commands.extend([event("M5"), event("M6 T2 S900"), event("G4 P2")]);
    commands.extend(line(1, 5, [0, -10], 200));
    let (job, seen) = seen(commands);
    let machine = Machine::load("starmill").unwrap();

    // 3 and 4 steps of 0.01 mm in 11 ms are 0.05 mm: 272.7 mm/min.
    let middle = seen.iter().find(|reading| reading.ticks == 200).unwrap();
    assert!((middle.feed_mm_min - 272.7).abs() < 0.1, "{}", middle.feed_mm_min);
    assert_eq!(
        (middle.line, middle.spindle.clockwise, middle.spindle.rpm),
        (2, Some(true), Some(1200.0))
    );
    let x = middle.axes[0];
    assert_eq!(x.axis, Axis::X);
    assert!((x.machine_mm - x.work_mm - 75.0).abs() < 1e-9 && x.work_mm > 5.9);

    let second = seen.iter().find(|reading| reading.ticks == 500).unwrap();
    assert_eq!((second.spindle.clockwise, second.spindle.rpm), (None, Some(900.0)));
    assert_eq!(second.line, 5);
    assert!((second.feed_mm_min - 545.5).abs() < 0.1, "{}", second.feed_mm_min);

    // At rest nothing is fast.
    let mut resting = seen.iter().rev().filter(|reading| reading.ticks == 400);
    assert!(resting.next().unwrap().feed_mm_min == 0.0);

    let left: Vec<f64> = seen.iter().map(|reading| reading.left_s).collect();
    assert!(left.windows(2).all(|pair| pair[1] <= pair[0]), "{left:?}");
    // All but the first fill, which is under way when the first reading is made.
    let first_fill_s = job.buffers().next().unwrap().time(&machine.bus).fill_s;
    let whole_s = job.duration_s(&machine.bus);
    assert!((left[0] + first_fill_s - whole_s).abs() < 1e-6, "{} {whole_s}", left[0]);
    let last = seen.last().unwrap();
    assert!((last.left_s - job.buffers().last().unwrap().time(&machine.bus).pads_s).abs() < 1e-6);
}
