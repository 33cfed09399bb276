//! Events so far → those that say how spindle, coolant and tool are now.

use crate::base::{Event, EventKind};

/// What a program's functions have brought about, up to some place.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InForce {
    tool: Option<Event>,
    spindle: Option<Event>,
    surface_speed: Option<Event>,
    mist: Option<Event>,
    flood: Option<Event>,
    /// Functions of which only the machine's maker knows what they did.
    others: Vec<Event>,
}

impl InForce {
    /// What these events have brought about, one after another.
    pub fn after<'e>(events: impl IntoIterator<Item = &'e Event>) -> InForce {
        let mut now = InForce::default();
        events.into_iter().for_each(|event| now.take(event));
        now
    }

    fn take(&mut self, event: &Event) {
        let here = Some(event.clone());
        match event.kind {
            EventKind::M { code: 3 | 4, .. } => self.spindle = here,
            EventKind::M { code: 5, .. } => self.spindle = None,
            EventKind::M { code: 6, .. } => self.tool = here,
            EventKind::M { code: 7, .. } => self.mist = here,
            EventKind::M { code: 8, .. } => self.flood = here,
            EventKind::M { code: 9, .. } => (self.mist, self.flood) = (None, None),
            EventKind::S(rpm) => {
                self.surface_speed = None;
                let spindle = self.spindle.as_mut().map(|event| &mut event.kind);
                if let Some(EventKind::M { spindle_rpm, .. }) = spindle {
                    *spindle_rpm = Some(rpm);
                }
            }
            EventKind::SurfaceSpeed { .. } => self.surface_speed = here,
            // They wait, end the program, allow something, or get a tool ready that M6 names again.
            EventKind::M { code: 0 | 1 | 2 | 30 | 48 | 49 | 60, .. }
            | EventKind::T(_)
            | EventKind::Dwell(_)
            | EventKind::NextBlock
            | EventKind::WaitInput { .. } => {}
            EventKind::M { .. } | EventKind::Function { .. } => self.others.push(event.clone()),
        }
    }

    /// What brings it about again: the tool first, the coolant last.
    pub fn events(&self) -> impl Iterator<Item = &Event> {
        let Self { tool, surface_speed, spindle, mist, flood, .. } = self;
        [tool, surface_speed, spindle, mist, flood].into_iter().flatten()
    }

    /// What nobody can bring about again without knowing the machine.
    pub fn others(&self) -> &[Event] {
        &self.others
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_on_is_switched_on_again() {
        let check = |program: &str, expected: &str, others: usize| {
            let event = |text: &str| Event { line: 1, kind: text.trim().parse().unwrap() };
            let events: Vec<Event> = program.split(',').map(event).collect();
            let now = InForce::after(&events);
            let again: Vec<_> = now.events().map(|event| event.kind.to_string()).collect();
            assert_eq!((again.join(", ").as_str(), now.others().len()), (expected, others));
        };
        check("M6 T2, M3 S800, M8, G4 P1", "M6 T2, M3 S800, M8", 0);
        check("M8, M3 S800, S900, M7, M6 T2, M6 T3", "M6 T3, M3 S900, M7, M8", 0);
        check("M3 S800, M8, M5, M9, M30", "", 0);
        check("M4 S800, G96 S200 D2500, M64 P1, M10, M0", "G96 S200 D2500, M4 S800", 2);
        check("M4 S800, G96 S200, S300", "M4 S300", 0);
    }
}
