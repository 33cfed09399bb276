//! Segment → its pieces, one at a time: a slow one has more than memory should hold.

use std::rc::Rc;
use std::vec;

use crate::path::{Curve, Rates, Segment};

use super::junction::Junction;
use super::limits::Limits;
use super::piece::{Piece, TURN_MAX_RAD};
use super::run::Run;

/// What a segment is cut into.
#[derive(Debug)]
pub enum Cuts {
    /// It is one piece.
    One(Box<Run>),
    /// It is more, or may be.
    Many(Parts),
}

/// The pieces of a segment, in order, each with the junction at its start.
#[derive(Debug)]
pub enum Parts {
    /// A line, from one seam to the next.
    Line(LineParts),
    /// A line or an arc, in equal parts.
    Equal(Box<EqualParts>),
    /// A spline: no more than its spans by a few.
    Spline(Rc<Segment>, vec::IntoIter<Piece>),
}

/// See [`Parts::Line`].
#[derive(Debug)]
pub struct LineParts {
    /// With the junction of the next one.
    whole: Box<Run>,
    /// Where the next one begins, as a share of the line's way.
    share: f64,
}

/// See [`Parts::Equal`].
#[derive(Debug)]
pub struct EqualParts {
    /// With the junction of the next one.
    whole: Box<Run>,
    length_mm: f64,
    count: u64,
    /// So many have been given.
    given: u64,
    /// On a curve: the derivatives where the next one begins.
    rates: Option<Rates>,
}

impl Cuts {
    /// Of a whole segment, which is held as such. Of a line what lies between two seams is one piece, where
    /// they are known. Without ramps arcs are run at the speed that the whole of them can be run at, whatever
    /// accelerations that takes.
    #[inline(never)]
    pub fn of(mut whole: Box<Run>, limits: &Limits, ramps: bool, has_seams: bool) -> Cuts {
        let Run { segment, piece, .. } = &mut *whole;
        if has_seams && matches!(segment.curve, Curve::Line) {
            return Cuts::Many(Parts::Line(LineParts { whole, share: 0.0 }));
        }
        if let Curve::Spline(spline) = &segment.curve {
            let mut pieces = Vec::new();
            let take = |piece| pieces.push(piece);
            Piece::cut_spline(segment, spline.spans(), limits, ramps, piece.junction, take);
            return Cuts::Many(Parts::Spline(Rc::clone(segment), pieces.into_iter()));
        }
        let turn_rad = match &segment.curve {
            Curve::Arc(arc) if ramps => arc.sweep_rad.abs(),
            Curve::Line | Curve::Arc(_) | Curve::Spline(_) => 0.0,
        };
        piece.hold_chord(segment, limits);
        // A curve in two at least, so that from rest to rest it has somewhere to be fast.
        if turn_rad > 0.0 {
            let least = (turn_rad / TURN_MAX_RAD).max(2.0);
            let rates = segment.rates_at(0.0);
            return Cuts::Many(EqualParts::parts(whole, least, Some(rates), limits));
        }
        Cuts::even(whole, limits)
    }

    /// Of what its axes feel the same along: as many parts as a buffer can end between.
    fn even(whole: Box<Run>, limits: &Limits) -> Cuts {
        if whole.piece.least_count(limits) <= 1.0 {
            return Cuts::One(whole);
        }
        Cuts::Many(EqualParts::parts(whole, 1.0, None, limits))
    }
}

impl Parts {
    /// The next piece of the segment. That of a line ends at this share of the line's way, where a seam follows
    /// in it.
    pub fn next(&mut self, limits: &Limits, seam: Option<f64>) -> Option<Box<Run>> {
        match self {
            Parts::Line(parts) => parts.next(seam),
            Parts::Equal(parts) => parts.next(limits),
            Parts::Spline(segment, pieces) => {
                let run = |piece| Box::new(Run::new(Rc::clone(segment), piece));
                pieces.next().map(run)
            }
        }
    }
}

impl LineParts {
    fn next(&mut self, seam: Option<f64>) -> Option<Box<Run>> {
        if self.share == 1.0 {
            return None;
        }
        let shares = [self.share, seam.filter(|seam| *seam > self.share).unwrap_or(1.0)];
        self.share = shares[1];
        let mut part = self.whole.next_part();
        part.piece.length_mm *= shares[1] - shares[0];
        part.piece.shares = shares;
        Some(part)
    }
}

impl EqualParts {
    /// At least so many parts of a piece with these derivatives at its start, if it is bent.
    fn parts(whole: Box<Run>, least: f64, rates: Option<Rates>, limits: &Limits) -> Parts {
        let count = whole.piece.least_count(limits).max(least).ceil() as u64;
        let length_mm = whole.piece.length_mm / count as f64;
        Parts::Equal(Box::new(EqualParts { whole, length_mm, count, given: 0, rates }))
    }

    fn next(&mut self, limits: &Limits) -> Option<Box<Run>> {
        if self.given == self.count {
            return None;
        }
        let place = |k: u64| k as f64 / self.count as f64;
        let shares = [place(self.given), place(self.given + 1)];
        self.given += 1;
        let Some(rates) = &mut self.rates else {
            let mut part = self.whole.next_part();
            (part.piece.shares, part.piece.length_mm) = (shares, self.length_mm);
            return Some(part);
        };
        let Run { segment, piece: whole, .. } = &mut *self.whole;
        let to = segment.rates_at(shares[1]);
        let ends = [std::mem::replace(rates, to), to];
        let mut part = Piece::bent(segment, shares, self.length_mm, &ends, limits);
        part.junction = std::mem::replace(&mut whole.junction, Junction::STRAIGHT);
        Some(Box::new(Run::new(Rc::clone(segment), part)))
    }
}
