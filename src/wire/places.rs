//! Job → its events, each with where the axes stand then.

use crate::base::{Axis, AxisMap, Event, EventKind};
use crate::wire::job::{Buffer, Job, Step};

/// An event as its block has it.
#[derive(Clone, Debug, PartialEq)]
pub struct EventBlock {
    /// The event.
    pub event: Event,
    /// Ticks of the job before the motion of its own block, if that comes right before it.
    pub motion_from: Option<u64>,
}

/// Reads a job along, and finds where the motion of each block begins.
#[derive(Default)]
struct Blocks {
    ticks: u64,
    /// The line whose motion is under way, and its first tick.
    run: Option<(u32, u64)>,
    found: Vec<EventBlock>,
}

impl Blocks {
    fn tick(&mut self, line: u32) {
        self.run = self.run.filter(|(of, _)| *of == line).or(Some((line, self.ticks)));
        self.ticks += 1;
    }

    fn event(&mut self, event: &Event) {
        let run = self.run.take().filter(|(line, _)| *line == event.line);
        let motion_from = run.map(|(_, from)| from);
        if !matches!(event.kind, EventKind::Dwell(_)) {
            self.found.push(EventBlock { event: event.clone(), motion_from });
        }
    }
}

impl Job {
    /// All events but dwells, in order, each with the motion of its block.
    pub fn event_blocks(&self) -> Vec<EventBlock> {
        let mut blocks = Blocks::default();
        for step in &self.steps {
            match step {
                Step::Event(event) => blocks.event(event),
                Step::Direct(_) => {}
                Step::Buffer(buffer) => {
                    let mut events = buffer.events.iter().peekable();
                    for (tick, line) in buffer.lines.iter().enumerate() {
                        while let Some((_, event)) = events.next_if(|(at, _)| *at <= tick) {
                            blocks.event(event);
                        }
                        blocks.tick(*line);
                    }
                    events.for_each(|(_, event)| blocks.event(event));
                }
            }
        }
        blocks.found
    }

    /// All events, in order, and the machine position at each, in motor steps.
    pub fn event_places(&self) -> Vec<(Event, AxisMap<i64>)> {
        let mut places = Vec::new();
        let mut at_steps = self.start_steps;
        for step in &self.steps {
            match step {
                Step::Event(event) => places.push((event.clone(), at_steps)),
                // No program asks for these, and no event comes with them.
                Step::Direct(_) => {}
                Step::Buffer(buffer) => buffer_places(buffer, &mut at_steps, &mut places),
            }
        }
        places
    }
}

fn buffer_places(
    buffer: &Buffer,
    at_steps: &mut AxisMap<i64>,
    places: &mut Vec<(Event, AxisMap<i64>)>,
) {
    let mut events = buffer.events.iter().peekable();
    for tick in 0..buffer.lines.len() {
        while let Some((_, event)) = events.next_if(|(at, _)| *at <= tick) {
            places.push((event.clone(), *at_steps));
        }
        let counts = buffer.counts(tick);
        Axis::ALL.iter().for_each(|axis| at_steps[*axis] += i64::from(counts[*axis]));
    }
    places.extend(events.map(|(_, event)| (event.clone(), *at_steps)));
}
