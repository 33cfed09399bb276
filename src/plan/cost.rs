//! What buffers and the stops at their ends cost when seams are placed.

use crate::base::machine::{BufferTime, Bus};
use crate::base::{AxisSet, Machine};

use super::SeamKind;
use super::places::{Place, SHIFT_TICKS};

/// What a place inside a block costs, so that it is taken only if there is nothing else.
pub const INSIDE_PENALTY_S: f64 = 1e6;

/// The cost by which seams are placed.
#[derive(Debug)]
pub struct Cost {
    bus: Bus,
    pad_s: f64,
    entries: f64,
    tick_s: f64,
    cut_penalty_s: f64,
    ticks_max: f64,
}

impl Cost {
    /// On a machine whose buffers take so many ticks of motion.
    pub fn new(machine: &Machine, ticks_max: f64) -> Cost {
        Cost {
            bus: machine.bus.clone(),
            pad_s: machine.bus.pad_s(),
            entries: f64::from(machine.bus.buffer_ticks),
            tick_s: machine.bus.tick_s(),
            cut_penalty_s: machine.seam_in_cut_penalty_s,
            ticks_max,
        }
    }

    /// Whether a buffer from one place can end at another or at any later one. Ramps are long
    /// against nothing but other ramps: without them a way too long for a buffer is so from
    /// everywhere before, too.
    pub fn reaches(&self, start: &Place, end: &Place) -> bool {
        end.at_ticks - start.at_ticks <= self.ticks_max
    }

    /// Filling the nodes of these axes.
    pub fn fill_s(&self, moving: AxisSet) -> f64 {
        self.bus.fill_s(moving)
    }

    /// Pads of a buffer; none if it is too long.
    pub fn pads_s(&self, start: &Place, end: &Place) -> Option<f64> {
        let ticks = start.ticks_to(end);
        (ticks <= self.ticks_max).then_some((self.entries - ticks) * self.pad_s)
    }

    /// The part of a buffer's cost that hangs on where it begins, with what it costs to get there.
    /// Together with [`Cost::end_s`] and the fills, less [`Cost::shift_s`], it is the cost up to the buffer's
    /// end, or less.
    pub fn start_s(&self, cost_s: f64, start: &Place) -> f64 {
        let left_ticks = start.at_ticks - start.after_ticks - start.unsure_ticks;
        cost_s + (left_ticks + start.waits as f64) * self.pad_s
    }

    /// The part of a buffer's pads that hangs on where it ends, if no event is in it.
    pub fn end_s(&self, end: &Place) -> f64 {
        let ticks = end.at_ticks + end.before_ticks + end.unsure_ticks + end.waits as f64;
        (self.entries - ticks) * self.pad_s
    }

    /// By how much the pads may be less where a buffer begins at one place or at a later one.
    pub fn shift_s(&self, start: &Place, end: &Place) -> f64 {
        if end.stretch > start.stretch { SHIFT_TICKS * self.pad_s } else { 0.0 }
    }

    /// Fills and pads of a buffer in which these axes move; none if it is too long.
    pub fn buffer(&self, start: &Place, end: &Place, moving: AxisSet) -> Option<BufferTime> {
        let pads_s = self.pads_s(start, end)?;
        Some(BufferTime { fill_s: self.fill_s(moving), pads_s })
    }

    /// What the ramps of a stop take.
    pub fn ramps_s(&self, place: &Place) -> f64 {
        (place.before_ticks + place.after_ticks) * self.tick_s
    }

    /// What a stop is worth to be elsewhere.
    pub fn penalty_s(&self, place: &Place) -> f64 {
        match (place.kind, place.is_inside) {
            (SeamKind::Cut, true) => self.cut_penalty_s + INSIDE_PENALTY_S,
            (SeamKind::Cut, false) => self.cut_penalty_s,
            (SeamKind::Rest | SeamKind::Rapid, _) => 0.0,
        }
    }

    /// What a stop costs by where it is.
    pub fn place_s(&self, place: &Place) -> f64 {
        self.ramps_s(place) + self.penalty_s(place)
    }
}
