//! Job → its events, each with where the axes stand then.

use crate::base::{Axis, AxisMap, Event};
use crate::wire::job::{Buffer, Job, Step};

impl Job {
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
