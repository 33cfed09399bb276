//! The path on its way into the look-ahead: segments cut into pieces, with their junctions and
//! with the seams put in. A segment waits for the one behind it: its last piece has a bend there, too.
//!
//! What all lines go through is one function, [`Cutter::segment`], with the rest of it inlined; what only some need
//! is called, so that it takes no registers there.

use std::rc::Rc;

use crate::base::{Event, Point};
use crate::path::{Curve, Segment};

use super::cuts::{Cuts, Parts};
use super::junction::{Bend, End, Joint, Junction};
use super::limits::Limits;
use super::lookahead::LookAhead;
use super::piece::Piece;
use super::run::{Item, Run};
use super::{Feed, Seam, Seams};

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
    Given,
    /// The same, and a node buffer ends at its end.
    GivenToSeam,
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

    /// It is cut into more than one piece, and the path bends so behind it.
    #[inline(never)]
    fn cutting(&self, parts: Parts, bend_after: Option<&Bend>) -> Box<Cutting> {
        let &Known { index, end: End { tangent, .. }, joint: Joint { bend, .. } } = self;
        let bends = [bend, bend_after.copied()];
        Box::new(Cutting { index, tangent, bends, parts, is_at_seam: false })
    }

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
        let whole = self.giver.whole(last, known, ahead);
        if let Begun::Cutting(cutting) = self.giver.begin(whole, known, None, ahead) {
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
        if self.stop.is_none() {
            return false;
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
        // The one that waits first: it does not hang on the length, whose root is taken meanwhile.
        let whole = self.waiting.take().map(|waiting| self.giver.whole(waiting, before, ahead));
        known.index = self.index;
        self.index += 1;
        known.end.become_last(&segment, length_mm);
        let curve_start;
        let start = if matches!(segment.curve, Curve::Line) {
            &known.end.tangent
        } else {
            curve_start = segment.rates_at(0.0).tangent;
            &curve_start
        };
        self.waiting = Some(segment);
        let Some(whole) = whole else { return known.rest() };
        let limits = &self.giver.limits;
        known.joint.join(&before.end, &known.end, start, limits);
        if self.giver.feed != Feed::LookAhead {
            known.joint.stop();
        }
        match self.giver.begin(whole, before, known.joint.bend.as_ref(), ahead) {
            Begun::Given => {}
            Begun::GivenToSeam => known.rest(),
            Begun::Cutting(cutting) => self.cutting = Some(cutting),
        }
    }

    /// Where it is known what the segment is that came last.
    fn newest(&self) -> usize {
        usize::from(self.index.is_multiple_of(2))
    }

    #[inline(never)]
    fn next_part(&mut self, ahead: &mut LookAhead) {
        let Some(mut cutting) = self.cutting.take() else { return };
        let Some((mut run, is_last)) = self.giver.next_of(&mut cutting) else { return };
        if cutting.is_at_seam {
            (run.piece.junction, cutting.bends[0]) = (Junction::REST, None);
        }
        let [bend_before, bend_after] = &cutting.bends;
        let bends = [bend_before.as_ref(), bend_after.as_ref().filter(|_| is_last)];
        let seam = self.giver.seam_on(cutting.index);
        cutting.is_at_seam = self.giver.give(run, &cutting.tangent, bends, seam, ahead);
        if cutting.is_at_seam && is_last {
            let newest = self.newest();
            self.known[newest].rest();
        }
        cutting.bends[0] = None;
        self.cutting = Some(cutting);
    }
}

impl<'a> Giver<'a> {
    /// The run along all of a segment.
    #[inline(always)]
    fn whole(&self, segment: Rc<Segment>, known: &Known, ahead: &mut LookAhead) -> Box<Run> {
        let Known { end, joint, .. } = known;
        let mut whole = ahead.run(segment);
        let Run { segment, piece, .. } = &mut *whole;
        let curve_rates;
        let rates = if matches!(segment.curve, Curve::Line) {
            &end.tangent
        } else {
            curve_rates = segment.axis_speeds();
            &curve_rates
        };
        piece.become_whole(end.feed_mm_s, end.length_mm, rates, &joint.junction, &self.limits);
        if self.feed == Feed::Constant {
            piece.without_ramps();
        }
        whole
    }

    /// Cuts a segment behind which the path bends so, and gives it if it is one piece.
    #[inline(always)]
    fn begin(
        &mut self,
        mut whole: Box<Run>,
        known: &Known,
        bend_after: Option<&Bend>,
        ahead: &mut LookAhead,
    ) -> Begun {
        let ramps = self.feed != Feed::Constant;
        let &Known { index, ref end, joint: Joint { ref bend, .. } } = known;
        let is_line = matches!(whole.segment.curve, Curve::Line);
        let seam = self.seam_on(index);
        let bends = [bend.as_ref(), bend_after];
        if !is_line || self.cuts_line(&whole.piece, bends, seam) {
            match Cuts::of(whole, &self.limits, ramps, self.seams.is_some()) {
                Cuts::One(one) => whole = one,
                Cuts::Many(parts) => return Begun::Cutting(known.cutting(parts, bend_after)),
            }
        }
        if self.give(whole, &end.tangent, bends, seam, ahead) {
            return Begun::GivenToSeam;
        }
        Begun::Given
    }

    /// The next seam, if it is known and lies on the segment of this number.
    #[inline]
    fn seam_on(&self, index: u64) -> Option<&'a Seam> {
        self.seams.and_then(|seams| seams.on(self.next_seam, index))
    }

    /// Whether a line with this piece and seam is cut: there, or while they are to be found where one may be. That is
    /// not in a line between points of a chopped curve: it bends along all of its way, which parts of it would
    /// not, and is shorter than what a window sees.
    #[inline]
    fn cuts_line(&self, piece: &Piece, bends: [Option<&Bend>; 2], seam: Option<&Seam>) -> bool {
        if self.seams.is_none() {
            return bends == [None; 2] && piece.least_count(&self.limits) > 1.0;
        }
        seam.is_some_and(|seam| seam.share < 1.0)
    }

    /// The next piece of what is being cut, and whether it is the last.
    fn next_of(&self, cutting: &mut Cutting) -> Option<(Box<Run>, bool)> {
        let seam = self.seam_on(cutting.index).map(|seam| seam.share);
        let run = cutting.parts.next(&self.limits, seam)?;
        let is_last = run.piece.shares[1] == 1.0;
        Some((run, is_last))
    }

    /// Gives a piece of a segment of these derivatives at its end (on a line, everywhere) with the bends at its
    /// ends, and the seam that lies on the segment, if that is where it is. Tells whether it was.
    #[inline(always)]
    fn give(
        &mut self,
        mut run: Box<Run>,
        tangent: &Point,
        [bend_before, bend_after]: [Option<&Bend>; 2],
        seam: Option<&Seam>,
        ahead: &mut LookAhead,
    ) -> bool {
        let Run { segment, piece, .. } = &mut *run;
        let seam = seam.filter(|seam| seam.share == piece.shares[1]);
        if self.feed != Feed::Constant && matches!(segment.curve, Curve::Line) {
            let bends = [bend_before, bend_after.filter(|_| seam.is_none())];
            if bends != [None; 2] {
                piece.bend(tangent, bends, &self.limits);
            }
        }
        ahead.push_run(run);
        let Some(seam) = seam else { return false };
        self.next_seam += 1;
        ahead.push_stop(Item::Seam(seam.kind));
        true
    }
}
