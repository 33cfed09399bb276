//! Rapids down into the work: G0 that ends below Z0 of the work coordinates, where G1 was meant or a
//! sign is wrong.
//!
//! Told once, at the first such block, with the count. Not told of: a way back to where the tool
//! has cut before it was lifted (pecks that are written out), ways that end above the deepest cut so
//! far (to a level that is cleared), moves of cycles, G28, G30 and G53,
//! rapids while a spindle that the program starts stands still, programs that cut nothing, and
//! programs that never use Y (lathes, where Z runs along the work).

use crate::base::{Axis, AxisSet, Point};
use crate::gcode::{Block, Fault, rules};

use super::findings::{Findings, Kept, Place};
use super::motion::{Move, MoveKind};

/// What rounding may add to a position.
const ROUNDING_MM: f64 = 1e-6;

/// Rapids into the work, so far.
#[derive(Debug, Default)]
pub(super) struct Plunges {
    spindle_turns: bool,
    starts_spindle: bool,
    /// X, Y and Z where the last cut ended, in machine coordinates, and how deep any has gone; none
    /// before the first.
    cut_mm: Option<([f64; 3], f64)>,
    /// Those while the spindle stands still, and those while it turns.
    found: [Found; 2],
}

#[derive(Debug, Default)]
struct Found {
    first: Option<(Kept, f64)>,
    blocks: u64,
}

impl Plunges {
    /// Takes whether the spindle turns.
    pub fn spindle(&mut self, turns: bool) {
        self.spindle_turns = turns;
        self.starts_spindle |= turns;
    }

    /// Takes a cut.
    pub fn cut(&mut self, step: &Move) {
        let deepest_mm = self.cut_mm.map_or(f64::INFINITY, |(_, deepest_mm)| deepest_mm);
        let at_mm = Axis::LINEAR.map(|axis| step.to[axis]);
        self.cut_mm = Some((at_mm, deepest_mm.min(step.to[Axis::Z])));
    }

    /// Takes a rapid of a block with G0 in force; `ends_mm`: its ends in program coordinates.
    #[cold]
    pub fn rapid(&mut self, step: &Move, ends_mm: [Point; 2], block: &Block, place: Place<'_>) {
        let [from_mm, to_mm] = ends_mm.map(|point| point[Axis::Z]);
        if to_mm > -ROUNDING_MM || to_mm > from_mm - ROUNDING_MM || self.is_cut(&step.to) {
            return;
        }
        let found = &mut self.found[usize::from(self.spindle_turns)];
        found.blocks += 1;
        if found.first.is_none() {
            found.first = Some((Kept::at_axis(Axis::Z, block, place), to_mm));
        }
    }

    /// Whether the tool comes back to where it has cut last, or stays above the deepest cut: at the
    /// level of one, elsewhere, G1 is likely to be missing.
    fn is_cut(&self, to: &Point) -> bool {
        self.cut_mm.is_some_and(|(cut, deepest_mm)| {
            let [x_mm, y_mm, z_mm] = cut;
            let near = |axis: Axis, at_mm: f64| (to[axis] - at_mm).abs() < ROUNDING_MM;
            let is_there = near(Axis::X, x_mm) && near(Axis::Y, y_mm);
            to[Axis::Z] > deepest_mm + ROUNDING_MM || (is_there && to[Axis::Z] > z_mm - ROUNDING_MM)
        })
    }

    /// Reports them.
    pub fn report(&self, axes_used: AxisSet, findings: &mut Findings) {
        if self.cut_mm.is_none() || !axes_used.contains(Axis::Y) {
            return;
        }
        let found = &self.found[usize::from(self.starts_spindle)];
        let Some((kept, z_mm)) = &found.first else { return };
        let mut message = format!("this rapid goes down to Z{z_mm:.3} mm, below Z0 of the work");
        match found.blocks - 1 {
            0 => {}
            1 => message += "; and so does another block",
            others => message += &format!("; and so do {others} other blocks"),
        }
        let fault = Fault::new(&rules::RAPID_INTO_WORK, kept.span.0, kept.span.1, message);
        let help = "write G1 and a feed for the way below Z0";
        findings.add(fault.help(help), kept.place());
    }
}

/// Whether a move is a cut, at its feed.
pub(super) fn is_cut(step: &Move) -> bool {
    !matches!(step.kind, MoveKind::Rapid)
}
