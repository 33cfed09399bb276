//! What an interpolator in hardware can make of a feed: pulses a minute, fewer on arcs than on lines.
//!
//! The feed along the path counts for the axis that moves, for a stretch of an arc runs along one axis
//! alone. A feed that has been told of is not told of again until it changes.

use crate::base::machine::Interpolator;
use crate::base::{Axis, Machine};
use crate::gcode::{Block, Fault, rules};

use super::motion::{Move, MoveKind};

/// Feeds of lines and of arcs that have been told to be too high.
#[derive(Debug, Default)]
pub(super) struct PulseRates {
    told_min: [Option<f64>; 2],
}

/// What a move is to the interpolator.
fn kind(step: &Move) -> (usize, &'static str) {
    match step.kind {
        MoveKind::Rapid | MoveKind::Line { .. } => (0, "lines"),
        MoveKind::Arc { .. } => (1, "arcs"),
        MoveKind::Spline { .. } => (1, "splines"),
    }
}

fn most_min(interpolator: Interpolator, step: &Move) -> f64 {
    let both = [interpolator.line_max_pulses_min, interpolator.arc_max_pulses_min];
    f64::from(both[kind(step).0])
}

/// Steps a mm of the finest axis that moves; in an arc both of its plane do.
fn steps_per_mm(step: &Move, machine: &Machine) -> f64 {
    let moves = |axis: Axis| match step.kind {
        MoveKind::Arc { plane, .. } if plane.axes().contains(&axis) => true,
        _ => step.from[axis] != step.to[axis],
    };
    let moving = machine.axes.iter().filter(|profile| moves(profile.axis));
    moving.fold(0.0, |most, profile| profile.steps_per_mm.max(most))
}

/// Whether the machine's interpolator, if it has one, can make the pulses of a move.
#[inline]
pub(super) fn is_in_reach(step: &Move, machine: &Machine) -> bool {
    let Some(interpolator) = machine.interpolator else { return true };
    let Some(feed_min) = step.kind.feed_mm_min() else { return true };
    feed_min * steps_per_mm(step, machine) <= most_min(interpolator, step)
}

impl PulseRates {
    /// What is wrong with a move that asks for more.
    pub fn judge(&mut self, step: &Move, block: &Block, machine: &Machine) -> Option<Fault> {
        let interpolator = machine.interpolator.filter(|_| !is_in_reach(step, machine))?;
        let feed_min = step.kind.feed_mm_min()?;
        let (kind, name) = kind(step);
        if self.told_min[kind].replace(feed_min) == Some(feed_min) {
            return None;
        }
        let (steps, most) = (steps_per_mm(step, machine), most_min(interpolator, step));
        let message = format!(
            "{feed_min} mm/min are {:.0} pulses a minute of {} mm; the interpolator makes {most} on {name}",
            feed_min * steps,
            1.0 / steps
        );
        let fault = match block.word(b'F') {
            Some(word) => Fault::word(&rules::PULSE_RATE, word, message),
            None => Fault::block(&rules::PULSE_RATE, block, message),
        };
        Some(fault.help(format!("F{} is the greatest feed here on {name}", most / steps)))
    }
}
