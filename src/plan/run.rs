//! A piece of the path on its way through the planner: from the cutter to the schedule it stays in its box.

use std::rc::Rc;

use crate::base::Event;
use crate::path::Segment;

use super::junction::Junction;
use super::piece::Piece;
use super::{Ramp, SeamKind};

/// A piece of a segment, and its motion once that is decided.
#[derive(Debug)]
pub struct Run {
    /// The segment.
    pub segment: Rc<Segment>,
    /// The piece of it, from rest or from the piece before.
    pub piece: Piece,
    /// Speeds at its start and end.
    pub ends_mm_s: [f64; 2],
    /// How it is run between them.
    pub ramp: Ramp,
    /// It begins or ends with a stop that only a seam asks for.
    pub at_seam: bool,
}

/// An item on its way through the planner.
#[derive(Debug)]
pub enum Item {
    /// Motion along a piece of the path.
    Run(Box<Run>),
    /// Something that happens at rest.
    Event(Box<Event>),
    /// A node buffer ends and the next begins, at rest.
    Seam(SeamKind),
}

impl Run {
    /// Along a segment, of no piece so far. Called, since it is rarely asked for: most have been run before.
    #[inline(never)]
    pub fn boxed(segment: Rc<Segment>) -> Box<Run> {
        Box::new(Run::new(segment, Piece::NONE))
    }

    /// Of a piece whose motion is not decided.
    pub fn new(segment: Rc<Segment>, piece: Piece) -> Run {
        Run { segment, piece, ends_mm_s: [0.0; 2], ramp: Ramp::NONE, at_seam: false }
    }

    /// The next of several parts: those behind the first go straight on.
    pub fn next_part(&mut self) -> Box<Run> {
        let part = Run::new(Rc::clone(&self.segment), self.piece.clone());
        self.piece.junction = Junction::STRAIGHT;
        Box::new(part)
    }

    /// Its motion is between these speeds, which are given one by one: an array would go through memory, and be
    /// read back at once.
    #[inline]
    pub fn decide(&mut self, entry_mm_s: f64, exit_mm_s: f64, at_seam: bool) {
        let ends_mm_s = [entry_mm_s, exit_mm_s];
        self.ramp = self.piece.ramp(ends_mm_s);
        (self.ends_mm_s, self.at_seam) = (ends_mm_s, at_seam);
    }
}

impl Item {
    /// The piece of the path that it is, if it is one.
    #[inline]
    pub fn piece(&self) -> Option<&Piece> {
        match self {
            Item::Run(run) => Some(&run.piece),
            Item::Event(_) | Item::Seam(_) => None,
        }
    }

    /// Whether it is a seam where motion would not rest.
    pub fn is_own_stop(&self) -> bool {
        matches!(self, Item::Seam(SeamKind::Rapid | SeamKind::Cut))
    }
}
