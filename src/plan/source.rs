//! The path on its way into the look-ahead: segments cut into pieces, with their junctions and
//! with the seams put in. A segment waits for the one behind it: its last piece has a bend there, too.

use std::rc::Rc;

use crate::base::{Event, Point};
use crate::path::{Curve, Segment};

use super::cuts::{Cuts, Parts};
use super::junction::{Bend, End, Joint, Junction};
use super::limits::Limits;
use super::lookahead::LookAhead;
use super::run::{Item, Run};
use super::{Feed, Seams};

/// Turns items of the path into items of the look-ahead.
#[derive(Debug)]
pub struct Cutter<'a> {
    giver: Giver<'a>,
    /// Number of the next segment; those without length do not count.
    index: u64,
    /// A segment of which it is not known what follows: it goes on into its piece.
    waiting: Option<Rc<Segment>>,
    /// What is known of it, and the one before or the one that comes next: the even one and the odd one, each
    /// in its place.
    known: [Known; 2],
    cutting: Option<Box<Cutting>>,
    /// What follows the segment that is being cut, where that is no other.
    stop: Option<Item>,
}

/// A segment and its start.
#[derive(Debug)]
struct Known {
    /// Its number.
    index: u64,
    /// On a line its start has the same tangent.
    end: End,
    /// At its start.
    joint: Joint,
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

/// What a segment has come to.
enum Begun {
    /// One piece, which has been given.
    Given {
        /// A node buffer ends at its end.
        is_at_seam: bool,
    },
    /// More than one.
    Cutting(Box<Cutting>),
}

/// Gives pieces, with the seams behind them.
#[derive(Debug)]
struct Giver<'a> {
    limits: Limits,
    feed: Feed,
    /// None while they are to be found: lines are cut where one may be.
    seams: Option<&'a Seams>,
    /// Seams passed.
    next_seam: usize,
}

impl Known {
    const NONE: Known = Known { index: 0, end: End::NONE, joint: Joint::REST };

    /// The machine has come to rest at its start.
    fn rest(&mut self) {
        self.joint = Joint::REST;
    }
}

impl<'a> Cutter<'a> {
    /// From rest.
    pub fn new(limits: Limits, feed: Feed, seams: Option<&'a Seams>) -> Cutter<'a> {
        let known = [Known::NONE; 2];
        let giver = Giver { limits, feed, seams, next_seam: 0 };
        Cutter { giver, index: 0, waiting: None, known, cutting: None, stop: None }
    }

    /// Takes an event of the path, once all that was cut before has been given.
    pub fn event(&mut self, event: Event, ahead: &mut LookAhead) {
        self.stop = Some(Item::Event(Box::new(event)));
        self.finish(ahead);
    }

    /// No segment follows the one that waits. Tells whether there was one.
    pub fn finish(&mut self, ahead: &mut LookAhead) -> bool {
        let Some(last) = self.waiting.take() else { return false };
        let known = &self.known[self.newest()];
        if let Begun::Cutting(cutting) = self.giver.begin(last, known, None, ahead) {
            self.cutting = Some(cutting);
        }
        true
    }

    /// Gives the next piece of what is being cut, or what follows it. Tells whether there was any.
    #[inline]
    pub fn cut(&mut self, ahead: &mut LookAhead) -> bool {
        if self.cutting.is_some() {
            self.next_part(ahead);
            return true;
        }
        let stop = self.stop.take();
        stop.map(|stop| ahead.push_stop(stop)).is_some()
    }

    /// Takes a segment of the path, once all that was cut before has been given.
    pub fn segment(&mut self, segment: Rc<Segment>, ahead: &mut LookAhead) {
        let length_mm = segment.length_mm();
        if length_mm <= 0.0 {
            return;
        }
        let [even, odd] = &mut self.known;
        let [before, known] = if self.index.is_multiple_of(2) { [odd, even] } else { [even, odd] };
        known.index = self.index;
        self.index += 1;
        known.end.become_last(&segment, length_mm);
        let curved = End::first_of_curve(&segment, &known.end);
        let start = curved.as_ref().unwrap_or(&known.end);
        let Some(waiting) = self.waiting.replace(segment) else { return known.rest() };
        let limits = &self.giver.limits;
        known.joint.join(&before.end, start, limits);
        if self.giver.feed != Feed::LookAhead {
            known.joint.stop();
        }
        match self.giver.begin(waiting, before, known.joint.bend.as_ref(), ahead) {
            Begun::Given { is_at_seam: true } => known.rest(),
            Begun::Given { is_at_seam: false } => {}
            Begun::Cutting(cutting) => self.cutting = Some(cutting),
        }
    }

    /// Where it is known what the segment is that came last.
    fn newest(&self) -> usize {
        usize::from(self.index.is_multiple_of(2))
    }

    fn next_part(&mut self, ahead: &mut LookAhead) {
        let Some(mut cutting) = self.cutting.take() else { return };
        let Some((mut run, is_last)) = self.giver.next_of(&mut cutting) else { return };
        if cutting.is_at_seam {
            (run.piece.junction, cutting.bends[0]) = (Junction::REST, None);
        }
        let [bend_before, bend_after] = &cutting.bends;
        let bends = [bend_before.as_ref(), bend_after.as_ref().filter(|_| is_last)];
        let Cutting { index, tangent, .. } = &*cutting;
        cutting.is_at_seam = self.giver.give(run, *index, tangent, bends, ahead);
        if cutting.is_at_seam && is_last {
            let newest = self.newest();
            self.known[newest].rest();
        }
        cutting.bends[0] = None;
        self.cutting = Some(cutting);
    }
}

impl Giver<'_> {
    /// Cuts a segment behind which the path bends so, and gives it if it is one piece.
    #[inline]
    fn begin(
        &mut self,
        segment: Rc<Segment>,
        known: &Known,
        bend_after: Option<&Bend>,
        ahead: &mut LookAhead,
    ) -> Begun {
        let ramps = self.feed != Feed::Constant;
        let &Known { index, ref end, joint: Joint { junction, ref bend } } = known;
        let mut whole = ahead.whole(segment, end.length_mm);
        let Run { segment, piece, .. } = &mut *whole;
        piece.junction = junction;
        let cuts = if matches!(segment.curve, Curve::Line) {
            piece.hold_whole(&end.tangent, &self.limits);
            if !ramps {
                piece.without_ramps();
            }
            let seam = self.seams.map(|seams| seams.within(self.next_seam, index));
            Cuts::of_line(whole, &self.limits, seam.map(|seam| seam.is_some()))
        } else {
            Cuts::of_curve(whole, &self.limits, ramps)
        };
        match cuts {
            Cuts::One(run) => {
                let bends = [bend.as_ref(), bend_after];
                let is_at_seam = self.give(run, index, &end.tangent, bends, ahead);
                Begun::Given { is_at_seam }
            }
            Cuts::Many(parts) => {
                let (tangent, bends) = (end.tangent, [*bend, bend_after.copied()]);
                let cutting = Cutting { index, tangent, bends, parts, is_at_seam: false };
                Begun::Cutting(Box::new(cutting))
            }
        }
    }

    /// The next piece of what is being cut, and whether it is the last.
    fn next_of(&self, cutting: &mut Cutting) -> Option<(Box<Run>, bool)> {
        let seam = self.seams.and_then(|seams| seams.within(self.next_seam, cutting.index));
        let run = cutting.parts.next(&self.limits, seam)?;
        let is_last = run.piece.shares[1] == 1.0;
        Some((run, is_last))
    }

    /// Gives a piece of the segment of a number, of these derivatives at its end (on a line, everywhere), with
    /// the bends at its ends and the seam behind it. Tells whether there is one.
    #[inline]
    fn give(
        &mut self,
        mut run: Box<Run>,
        index: u64,
        tangent: &Point,
        [bend_before, bend_after]: [Option<&Bend>; 2],
        ahead: &mut LookAhead,
    ) -> bool {
        let Run { segment, piece, .. } = &mut *run;
        let end = piece.shares[1];
        let seam = self.seams.and_then(|seams| seams.at(self.next_seam, index, end));
        if self.feed != Feed::Constant && matches!(segment.curve, Curve::Line) {
            let bend_after = bend_after.filter(|_| seam.is_none());
            piece.bend(tangent, [bend_before, bend_after], &self.limits);
        }
        ahead.push_run(run);
        let Some(kind) = seam else { return false };
        self.next_seam += 1;
        ahead.push_stop(Item::Seam(kind));
        true
    }
}
