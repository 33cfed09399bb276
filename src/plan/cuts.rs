//! Segment → its pieces, one at a time: a slow one has more than memory should hold.

use std::sync::Arc;
use std::vec;

use crate::path::{Curve, Rates, Segment};

use super::junction::{End, Junction};
use super::limits::Limits;
use super::piece::{Piece, TURN_MAX_RAD};

/// What a segment is cut into.
#[derive(Debug)]
pub enum Cuts {
    /// It is one piece.
    One(Piece),
    /// It is more, or may be.
    Many(Parts),
}

/// The pieces of a segment, in order, each with the junction at its start.
#[derive(Debug)]
pub enum Parts {
    /// A line, from one seam to the next.
    Line(Box<LineParts>),
    /// A line or an arc, in equal parts.
    Equal(Box<EqualParts>),
    /// A spline: no more than its spans by a few.
    Spline(vec::IntoIter<Piece>),
}

/// See [`Parts::Line`].
#[derive(Debug)]
pub struct LineParts {
    whole: Piece,
    /// Where the next one begins, as a share of the line's way.
    share: f64,
    /// The junction of the next one.
    junction: Junction,
}

/// See [`Parts::Equal`].
#[derive(Debug)]
pub struct EqualParts {
    whole: Piece,
    length_mm: f64,
    count: u64,
    /// So many have been given.
    given: u64,
    /// The junction of the next one.
    junction: Junction,
    /// On a curve: the derivatives where the next one begins.
    rates: Option<Rates>,
}

impl Cuts {
    /// Of a line whose seams are known, or of which it is known that there are none: what lies between two is one
    /// piece. Else as [`Cuts::new`].
    pub fn of_line(
        segment: &Arc<Segment>,
        end: &End,
        limits: &Limits,
        ramps: bool,
        first: Junction,
        has_seam: bool,
    ) -> Cuts {
        let mut whole = whole(segment, end, limits, ramps);
        if !has_seam {
            whole.junction = first;
            return Cuts::One(whole);
        }
        Cuts::Many(Parts::Line(Box::new(LineParts { whole, share: 0.0, junction: first })))
    }

    /// Of a segment with this end, and this junction at its start. Without ramps lines and arcs are run at the speed that
    /// the whole of them can be run at, whatever accelerations that takes.
    pub fn new(
        segment: &Arc<Segment>,
        end: &End,
        limits: &Limits,
        ramps: bool,
        first: Junction,
    ) -> Cuts {
        if let Curve::Spline(spline) = &segment.curve {
            let mut pieces = Vec::new();
            let take = |piece| pieces.push(piece);
            Piece::cut_spline(segment, spline.spans(), limits, ramps, first, take);
            return Cuts::Many(Parts::Spline(pieces.into_iter()));
        }
        let mut whole = whole(segment, end, limits, ramps);
        let least = whole.least_count(limits);
        let turn_rad = match &segment.curve {
            Curve::Arc(arc) if ramps => arc.sweep_rad.abs(),
            Curve::Line | Curve::Arc(_) | Curve::Spline(_) => 0.0,
        };
        // A curve in two at least, so that from rest to rest it has somewhere to be fast.
        let count = if turn_rad > 0.0 { (turn_rad / TURN_MAX_RAD).max(2.0) } else { 1.0 };
        let count = count.max(least).ceil() as u64;
        if count == 1 && turn_rad == 0.0 {
            whole.junction = first;
            return Cuts::One(whole);
        }
        Cuts::Many(Parts::Equal(Box::new(EqualParts {
            length_mm: whole.length_mm / count as f64,
            rates: (turn_rad > 0.0).then(|| segment.rates_at(0.0)),
            whole,
            count,
            given: 0,
            junction: first,
        })))
    }
}

impl Parts {
    /// The next piece. That of a line ends at this share of the line's way, where a seam follows in it.
    pub fn next(&mut self, limits: &Limits, seam: Option<f64>) -> Option<Piece> {
        match self {
            Parts::Line(parts) => parts.next(seam),
            Parts::Equal(parts) => parts.next(limits),
            Parts::Spline(pieces) => pieces.next(),
        }
    }
}

impl LineParts {
    fn next(&mut self, seam: Option<f64>) -> Option<Piece> {
        if self.share == 1.0 {
            return None;
        }
        let shares = [self.share, seam.filter(|seam| *seam > self.share).unwrap_or(1.0)];
        self.share = shares[1];
        let junction = std::mem::replace(&mut self.junction, Junction::STRAIGHT);
        let mut piece = self.whole.clone();
        piece.length_mm *= shares[1] - shares[0];
        (piece.shares, piece.junction) = (shares, junction);
        Some(piece)
    }
}

impl EqualParts {
    fn next(&mut self, limits: &Limits) -> Option<Piece> {
        if self.given == self.count {
            return None;
        }
        let place = |k: u64| k as f64 / self.count as f64;
        let shares = [place(self.given), place(self.given + 1)];
        self.given += 1;
        let junction = std::mem::replace(&mut self.junction, Junction::STRAIGHT);
        let (length_mm, segment) = (self.length_mm, &self.whole.segment);
        let mut piece = match &mut self.rates {
            Some(rates) => {
                let to = segment.rates_at(shares[1]);
                let ends = [std::mem::replace(rates, to), to];
                Piece::bent(segment, shares, length_mm, &ends, limits)
            }
            None => self.whole.clone(),
        };
        (piece.shares, piece.length_mm, piece.junction) = (shares, length_mm, junction);
        Some(piece)
    }
}

/// A line or an arc with this end as one piece.
fn whole(segment: &Arc<Segment>, end: &End, limits: &Limits, ramps: bool) -> Piece {
    let mut whole = match &segment.curve {
        Curve::Line => Piece::whole(segment, end.length_mm, &end.tangent, limits),
        _ => Piece::whole(segment, end.length_mm, &segment.axis_speeds(), limits),
    };
    if !ramps {
        whole.without_ramps();
    }
    whole
}
