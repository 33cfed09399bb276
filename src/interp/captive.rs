//! Where a tool cannot be put back: in a thread, or behind an edge.
//!
//! A job that is gone on with comes back to the work from above. That way is free as a rule, since the
//! tool has cut it; a tap would strip its thread there, a boring bar hit the wall.

use crate::base::{Axis, AxisMap, Machine, Point};

use super::motion::{Bound, Motion, Move};
use super::motions::RunError;

/// One way into the work and out of it that is bound as a whole.
struct Captivity<'m> {
    machine: &'m Machine,
    entry: AxisMap<i64>,
    low: AxisMap<i64>,
    high: AxisMap<i64>,
    exit: AxisMap<i64>,
    /// It has a block of the lines asked for.
    is_near: bool,
}

impl<'m> Captivity<'m> {
    fn new(step: &Move, machine: &'m Machine) -> Self {
        let entry = machine.nearest_steps(&step.from);
        Captivity { machine, entry, low: entry, high: entry, exit: entry, is_near: false }
    }

    fn goes_on(&mut self, step: &Move, lines: &[u32]) {
        self.exit = self.machine.nearest_steps(&step.to);
        for axis in Axis::ALL {
            self.low[axis] = self.low[axis].min(self.exit[axis]);
            self.high[axis] = self.high[axis].max(self.exit[axis]);
        }
        self.is_near |= lines.contains(&step.line);
    }

    /// Within it, and not where it begins, nor where it has come out again.
    fn holds(&self, at: &AxisMap<i64>) -> bool {
        let within = |axis: Axis| (self.low[axis]..=self.high[axis]).contains(&at[axis]);
        let is_out = *at == self.exit && self.exit[Axis::Z] >= self.entry[Axis::Z];
        self.is_near && Axis::ALL.into_iter().all(within) && *at != self.entry && !is_out
    }
}

/// Whether a tool that stands at a place (motor steps), between blocks of these lines or within one, is where
/// it cannot be put back.
///
/// # Errors
/// Those of the motions.
pub fn is_captive(
    motions: impl IntoIterator<Item = Result<Motion, RunError>>,
    machine: &Machine,
    lines: &[u32],
    at: &Point,
) -> Result<bool, RunError> {
    let at = machine.nearest_steps(at);
    let mut now: Option<Captivity<'_>> = None;
    for motion in motions {
        // Events are no end of it: a tap turns the other way at the bottom.
        let Motion::Move(step) = motion? else { continue };
        if matches!(step.bound, Bound::Spindle | Bound::Captive) {
            now.get_or_insert_with(|| Captivity::new(&step, machine)).goes_on(&step, lines);
        } else if now.take().is_some_and(|now| now.holds(&at)) {
            return Ok(true);
        }
    }
    Ok(now.is_some_and(|now| now.holds(&at)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Source;
    use crate::interp::{Options, motions};

    #[test]
    fn taps_and_bars_are_captive_and_drills_are_not() {
        let machine = Machine::load("ideal").unwrap();
        let captive = |cycle: &str, z_mm: f64| {
            let text =
                format!("G21 M3 S500 F500\nG0 Z5\nX10\n{cycle} X10 Y0 Z-8 R2\nG80\nG0 Z5\nM30\n");
            let source = Source::memory("test", text.into_bytes());
            let mut at = Point::ZERO;
            (at[Axis::X], at[Axis::Z]) = (10.0, z_mm);
            let motions = motions(&source, &machine, &Options::default());
            is_captive(motions, &machine, &[4], &at).unwrap()
        };
        assert!(captive("G84", -8.0) && captive("G84", -3.0));
        assert!(!captive("G84", 2.0) && !captive("G84", 5.0));
        assert!(captive("G76 I0.2 J0", -8.0));
        for cycle in ["G81", "G83 Q3", "G86 P0.1", "G85"] {
            assert!(!captive(cycle, -8.0), "{cycle}");
        }
    }
}
