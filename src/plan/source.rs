//! The path on its way into the look-ahead: segments cut into pieces, with their junctions and
//! with the seams put in.

use std::collections::VecDeque;
use std::sync::Arc;

use crate::base::Machine;
use crate::path::{PathItem, Segment};

use super::cuts::Cuts;
use super::junction::Junction;
use super::lookahead::Ahead;
use super::{Feed, Seams};

/// Turns items of the path into items of the look-ahead.
#[derive(Debug)]
pub struct Cutter<'a> {
    machine: &'a Machine,
    feed: Feed,
    seams: &'a Seams,
    /// Seams passed.
    next_seam: usize,
    /// Number of the next segment; those without length do not count.
    index: u64,
    before: Option<Arc<Segment>>,
    cutting: Option<Cutting>,
    ready: VecDeque<Ahead>,
}

/// A segment that is being cut.
#[derive(Debug)]
struct Cutting {
    segment: Arc<Segment>,
    /// Its number.
    index: u64,
    cuts: Cuts,
    /// A node buffer ends where the last piece did.
    is_at_seam: bool,
}

impl<'a> Cutter<'a> {
    /// From rest.
    pub fn new(machine: &'a Machine, feed: Feed, seams: &'a Seams) -> Cutter<'a> {
        let ready = VecDeque::new();
        Cutter { machine, feed, seams, next_seam: 0, index: 0, before: None, cutting: None, ready }
    }

    /// Takes an item of the path, once all pieces of the one before have been given.
    pub fn push(&mut self, item: PathItem) {
        match item {
            PathItem::Event(event) => {
                self.before = None;
                self.ready.push_back(Ahead::Event(event));
            }
            PathItem::Segment(segment) => self.segment(segment),
        }
    }

    /// Gives the next item.
    pub fn pop(&mut self) -> Option<Ahead> {
        if let Some(item) = self.ready.pop_front() {
            return Some(item);
        }
        let cutting = self.cutting.as_mut()?;
        let Some(mut piece) = cutting.cuts.next(self.machine) else {
            let done = self.cutting.take()?;
            self.before = (!done.is_at_seam).then_some(done.segment);
            return None;
        };
        if cutting.is_at_seam {
            piece.junction = Junction::REST;
        }
        let seam = self.seams.at(self.next_seam, cutting.index, piece.shares[1]);
        cutting.is_at_seam = seam.is_some();
        if let Some(kind) = seam {
            self.next_seam += 1;
            self.ready.push_back(Ahead::Seam(kind));
        }
        Some(Ahead::Piece(piece))
    }

    fn segment(&mut self, segment: Arc<Segment>) {
        if segment.length_mm() <= 0.0 {
            return;
        }
        let index = self.index;
        self.index += 1;
        let junction = match self.before.take() {
            Some(before) if self.feed == Feed::LookAhead => {
                Junction::between(&before, &segment, self.machine)
            }
            Some(before) => Junction::between(&before, &segment, self.machine).stopped(),
            None => Junction::REST,
        };
        let ramps = self.feed != Feed::Constant;
        let cuts = Cuts::new(&segment, self.machine, ramps, junction);
        self.cutting = Some(Cutting { segment, index, cuts, is_at_seam: false });
    }
}
