//! The path on its way into the look-ahead: segments cut into pieces, with their junctions and
//! with the seams put in.

use std::collections::VecDeque;
use std::sync::Arc;

use crate::base::Machine;
use crate::path::{PathItem, Segment};

use super::junction::Junction;
use super::lookahead::Ahead;
use super::piece::Piece;
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
    ready: VecDeque<Ahead>,
}

impl<'a> Cutter<'a> {
    /// From rest.
    pub fn new(machine: &'a Machine, feed: Feed, seams: &'a Seams) -> Cutter<'a> {
        let ready = VecDeque::new();
        Cutter { machine, feed, seams, next_seam: 0, index: 0, before: None, ready }
    }

    /// Takes an item of the path.
    pub fn push(&mut self, item: PathItem) {
        match item {
            PathItem::Event(event) => {
                self.before = None;
                self.ready.push_back(Ahead::Event(event));
            }
            PathItem::Segment(segment) => self.segment(Arc::new(segment)),
        }
    }

    /// Gives the next item.
    pub fn pop(&mut self) -> Option<Ahead> {
        self.ready.pop_front()
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
        let (ready, seams, next_seam) = (&mut self.ready, self.seams, &mut self.next_seam);
        let (machine, mut is_at_seam) = (self.machine, false);
        Piece::cut(&segment, machine, ramps, junction, |piece| {
            let mut piece = Box::new(piece);
            if is_at_seam {
                piece.junction = Junction::REST;
            }
            let seam = seams.at(*next_seam, index, piece.shares[1]);
            ready.push_back(Ahead::Piece(piece));
            is_at_seam = seam.is_some();
            if let Some(kind) = seam {
                *next_seam += 1;
                ready.push_back(Ahead::Seam(kind));
            }
        });
        if !is_at_seam {
            self.before = Some(segment);
        }
    }
}
