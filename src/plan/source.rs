//! The path on its way into the look-ahead: segments cut into pieces, with their junctions and
//! with the seams put in. A segment waits for the one behind it: its last piece has a bend there, too.

use std::sync::Arc;

use crate::base::Point;
use crate::path::{Curve, PathItem, Segment};

use super::cuts::{Cuts, Parts};
use super::junction::{Bend, End, Junction};
use super::limits::Limits;
use super::lookahead::{Ahead, LookAhead};
use super::piece::Piece;
use super::{Feed, Seams};

/// Turns items of the path into items of the look-ahead.
#[derive(Debug)]
pub struct Cutter<'a> {
    limits: Limits,
    feed: Feed,
    /// None while they are to be found: lines are cut where one may be.
    seams: Option<&'a Seams>,
    /// Seams passed.
    next_seam: usize,
    /// Number of the next segment; those without length do not count.
    index: u64,
    waiting: Option<Waiting>,
    cutting: Option<Box<Cutting>>,
    /// What follows the segment that is being cut, where that is no other.
    stop: Option<Ahead>,
}

/// A segment of which it is not known what follows.
#[derive(Debug)]
struct Waiting {
    segment: Arc<Segment>,
    /// Its number.
    index: u64,
    /// On a line its start has the same tangent.
    end: End,
    /// At its start.
    junction: Junction,
    bend: Option<Bend>,
}

/// A segment that is cut into more than one piece.
#[derive(Debug)]
struct Cutting {
    index: u64,
    tangent: Point,
    /// How the path bends where the next piece begins, and where the last one ends.
    bends: [Option<Bend>; 2],
    parts: Parts,
    /// A node buffer ends where the last piece did.
    is_at_seam: bool,
}

impl Waiting {
    /// The machine has come to rest at its start.
    fn rest(&mut self) {
        (self.junction, self.bend) = (Junction::REST, None);
    }
}

impl<'a> Cutter<'a> {
    /// From rest.
    pub fn new(limits: Limits, feed: Feed, seams: Option<&'a Seams>) -> Cutter<'a> {
        let (waiting, cutting, stop) = (None, None, None);
        Cutter { limits, feed, seams, next_seam: 0, index: 0, waiting, cutting, stop }
    }

    /// Takes an item of the path, once all that was cut before has been given.
    pub fn push(&mut self, item: PathItem, ahead: &mut LookAhead) {
        match item {
            PathItem::Event(event) => {
                self.stop = Some(Ahead::Event(event));
                self.finish(ahead);
            }
            PathItem::Segment(segment) => self.segment(segment, ahead),
        }
    }

    /// No segment follows the one that waits. Tells whether there was one.
    pub fn finish(&mut self, ahead: &mut LookAhead) -> bool {
        let Some(last) = self.waiting.take() else { return false };
        self.begin(&last, None, ahead);
        true
    }

    /// Gives the next piece of what is being cut, or what follows it. Tells whether there was any.
    pub fn cut(&mut self, ahead: &mut LookAhead) -> bool {
        if self.cutting.is_some() {
            self.next_part(ahead);
            return true;
        }
        let stop = self.stop.take();
        stop.map(|stop| ahead.push(stop)).is_some()
    }

    fn segment(&mut self, segment: Arc<Segment>, ahead: &mut LookAhead) {
        let length_mm = segment.length_mm();
        if length_mm <= 0.0 {
            return;
        }
        let index = self.index;
        self.index += 1;
        let [start, end] = End::both(&segment, length_mm);
        let Some(before) = self.waiting.take() else {
            let (junction, bend) = (Junction::REST, None);
            self.waiting = Some(Waiting { segment, index, end, junction, bend });
            return;
        };
        let (mut junction, mut bend) = Junction::between(&before.end, &start, &self.limits);
        if self.feed != Feed::LookAhead {
            (junction, bend) = (junction.stopped(), None);
        }
        self.waiting = Some(Waiting { segment, index, end, junction, bend });
        self.begin(&before, bend, ahead);
    }

    /// Cuts a segment behind which the path bends so, and gives it if it is one piece.
    fn begin(&mut self, whole: &Waiting, bend_after: Option<Bend>, ahead: &mut LookAhead) {
        let ramps = self.feed != Feed::Constant;
        let (index, end) = (whole.index, &whole.end);
        let (segment, limits, junction) = (&whole.segment, &self.limits, whole.junction);
        let cuts = match (self.seams, &segment.curve) {
            (Some(seams), Curve::Line) => {
                let has_seam = seams.within(self.next_seam, index).is_some();
                Cuts::of_line(segment, end, limits, ramps, junction, has_seam)
            }
            _ => Cuts::new(segment, end, limits, ramps, junction),
        };
        match cuts {
            Cuts::One(piece) => {
                let bends = [whole.bend.as_ref(), bend_after.as_ref()];
                self.give(piece, index, &end.tangent, bends, ahead);
            }
            Cuts::Many(parts) => {
                let bends = [whole.bend, bend_after];
                let tangent = end.tangent;
                let cutting = Cutting { index, tangent, bends, parts, is_at_seam: false };
                self.cutting = Some(Box::new(cutting));
            }
        }
    }

    fn next_part(&mut self, ahead: &mut LookAhead) {
        let Some(mut cutting) = self.cutting.take() else { return };
        let seam = self.seams.and_then(|seams| seams.within(self.next_seam, cutting.index));
        let Some(mut piece) = cutting.parts.next(&self.limits, seam) else { return };
        if cutting.is_at_seam {
            (piece.junction, cutting.bends[0]) = (Junction::REST, None);
        }
        let is_last = piece.shares[1] == 1.0;
        let [bend_before, bend_after] = &cutting.bends;
        let bends = [bend_before.as_ref(), bend_after.as_ref().filter(|_| is_last)];
        cutting.is_at_seam = self.give(piece, cutting.index, &cutting.tangent, bends, ahead);
        cutting.bends[0] = None;
        self.cutting = Some(cutting);
    }

    /// Gives a piece of the segment of this number with the bends at its ends, and the seam behind it.
    /// Tells whether there is one.
    fn give(
        &mut self,
        mut piece: Piece,
        index: u64,
        tangent: &Point,
        [bend_before, bend_after]: [Option<&Bend>; 2],
        ahead: &mut LookAhead,
    ) -> bool {
        let end = piece.shares[1];
        let seam = self.seams.and_then(|seams| seams.at(self.next_seam, index, end));
        if self.feed != Feed::Constant {
            let bend_after = bend_after.filter(|_| seam.is_none());
            piece.bend(tangent, [bend_before, bend_after], &self.limits);
        }
        ahead.push(Ahead::Piece(piece));
        let Some(kind) = seam else { return false };
        self.next_seam += 1;
        ahead.push(Ahead::Seam(kind));
        if let Some(next) = self.waiting.as_mut().filter(|_| end == 1.0) {
            next.rest();
        }
        true
    }
}
