//! A piece of the path with its motion: what the plan gives out.

use std::rc::Rc;

use crate::base::Point;
use crate::path::{Corner, Curve, Segment};

use super::run::Run;
use super::{Bound, Moment, Ramp};

/// How far a curve turns along a chord of a drawing at most: 2 degrees.
const CHORD_TURN_RAD: f64 = std::f64::consts::TAU / 180.0;

/// Chords of a drawing from rest to the greatest speed.
const SPEED_PARTS: f64 = 8.0;

/// Motion along a piece of a segment.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// The segment.
    pub segment: Rc<Segment>,
    /// Where on the segment the piece starts and ends, as shares of its way.
    pub shares: [f64; 2],
    /// Distance along the piece over time.
    pub ramp: Ramp,
    /// When the piece starts.
    pub start: Moment,
    /// When the piece ends.
    pub end: Moment,
    /// Node buffer that its ticks lie in.
    pub buffer: u32,
    /// What set the speed.
    pub bound: Bound,
}

impl Profile {
    /// Of no piece: a place for one.
    #[inline(never)]
    fn none() -> Profile {
        let [from_mm, to_mm] = [Point::ZERO; 2];
        let (curve, corner) = (Curve::Line, Corner::default());
        let segment = Segment { line: 0, feed_mm_s: None, from_mm, to_mm, curve, corner };
        Profile {
            segment: Rc::new(segment),
            shares: [0.0; 2],
            ramp: Ramp::NONE,
            start: Moment::default(),
            end: Moment::default(),
            buffer: 0,
            bound: Bound::Feed,
        }
    }

    /// Becomes the motion of a run: all but when it is and in which buffer. What it was stays behind.
    #[inline]
    pub(super) fn take(&mut self, run: &mut Run) {
        self.shares = run.piece.shares;
        self.bound = Bound::of(run);
        std::mem::swap(&mut self.segment, &mut run.segment);
        std::mem::swap(&mut self.ramp, &mut run.ramp);
    }

    /// Share of the segment's way done at a tick boundary between the piece's start and end; exactly that of
    /// its end there.
    fn segment_share_at(&self, boundary: u64, tick_s: f64) -> f64 {
        let [from, to] = self.shares;
        if boundary == self.end.tick && self.end.share == 0.0 {
            return to;
        }
        let time_s = self.start.ticks_until(boundary) * tick_s;
        let share = self.ramp.distance_mm(time_s) / self.ramp.length_mm();
        if share >= 1.0 { to } else { from + (to - from) * share }
    }

    /// Position at a tick boundary between the piece's start and end.
    pub fn position_at(&self, boundary: u64, tick_s: f64) -> Point {
        self.segment.point_at(self.segment_share_at(boundary, tick_s))
    }

    /// The same in X, Y and Z.
    pub(super) fn xyz_at(&self, boundary: u64, tick_s: f64) -> [f64; 3] {
        self.segment.xyz_at(self.segment_share_at(boundary, tick_s))
    }

    /// The piece as chords, each with its mean speed: where it begins, where it ends, mm/s. So short that
    /// the speed hardly changes along one, and a curve's direction by less than 2 degrees.
    pub fn chords(&self) -> impl Iterator<Item = (Point, Point, f64)> {
        let turn_rad = match &self.segment.curve {
            Curve::Line => 0.0,
            Curve::Arc(arc) => arc.sweep_rad.abs() * (self.shares[1] - self.shares[0]),
            Curve::Spline(_) => CHORD_TURN_RAD,
        };
        let [entry, exit] = [self.ramp.entry_mm_s(), self.ramp.exit_mm_s()];
        let changes = f64::max(self.ramp.peak_mm_s() - entry.min(exit), 0.0);
        let by_speed = (SPEED_PARTS * changes / self.ramp.peak_mm_s()).ceil();
        let count = by_speed.max((turn_rad / CHORD_TURN_RAD).ceil()).max(1.0);
        let (duration_s, length_mm) = (self.ramp.duration_s(), self.ramp.length_mm());
        let place = move |k: f64| {
            let share = self.ramp.distance_mm(duration_s * k / count) / length_mm;
            let [from, to] = self.shares;
            (share, self.segment.point_at(from + (to - from) * share))
        };
        let mut last = place(0.0);
        (1..=count as u64).map(move |k| {
            let next = place(k as f64);
            let (before, at) = std::mem::replace(&mut last, next);
            (at, next.1, (next.0 - before) * length_mm * count / duration_s)
        })
    }

    /// Position at the piece's start.
    pub fn start_mm(&self) -> Point {
        self.segment.point_at(self.shares[0])
    }

    /// Position at the piece's end.
    pub fn end_mm(&self) -> Point {
        self.segment.point_at(self.shares[1])
    }
}

/// Two profiles, given out by turns: who asks for the next one holds the one under way at most, so that the one
/// before is free, and no memory is asked for.
#[derive(Debug)]
pub(super) struct Reused {
    /// The one that is given out next, and the one that was last.
    profiles: [Rc<Profile>; 2],
}

impl Reused {
    pub(super) fn new() -> Reused {
        Reused { profiles: [Profile::none(), Profile::none()].map(Rc::new) }
    }

    /// Gives the next one out, once it has become what it is to be: a new one where somebody holds it still.
    #[inline]
    pub(super) fn give(&mut self, become_it: impl FnOnce(&mut Profile)) -> Rc<Profile> {
        self.profiles.swap(0, 1);
        let next = &mut self.profiles[1];
        if let Some(profile) = Rc::get_mut(next) {
            become_it(profile);
        } else {
            let mut profile = Profile::none();
            become_it(&mut profile);
            *next = Rc::new(profile);
        }
        Rc::clone(next)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    use crate::base::{Axis, Machine};
    use crate::path::PathItem;
    use crate::plan::{self, Feed, Planned, Seams};

    /// A profile is used again only where nobody holds it.
    #[test]
    fn profiles_that_are_held_stay_what_they_are() {
        let machine = Machine::load("router").unwrap();
        let at = |k: i32| {
            let mut at_mm = machine.work_zero_mm;
            at_mm[Axis::X] += f64::from(k * k);
            at_mm
        };
        let line = |k: i32| Segment {
            line: k as u32 + 1,
            feed_mm_s: Some(20.0),
            from_mm: at(k),
            to_mm: at(k + 1),
            curve: Curve::Line,
            corner: Corner::default(),
        };
        let path = || (0..9).map(|k| Ok::<_, Infallible>(PathItem::from(line(k))));
        let start_mm = machine.work_zero_mm;
        let plan = || plan::plan(path(), &machine, Feed::LookAhead, Seams::NONE, start_mm);
        let held: Vec<Planned> = plan().map(Result::unwrap).collect();
        assert!(held.len() >= 9);
        for (one, held) in plan().map(Result::unwrap).zip(&held) {
            assert_eq!(one, *held);
        }
    }
}
