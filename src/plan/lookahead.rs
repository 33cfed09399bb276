//! The greatest speeds along the path, over as much of it as matters.
//!
//! ```text
//!  u = v²          ____limits____
//!       ┤         /:            :\          backward: from rest at the end of what is known,
//!       ┤  ______/ :            : \         the greatest u at each node from which all that
//!       ┤ /        :            :  \        follows can be kept
//!     0 ┼/─────────┴────────────┴───\── s   forward: from the speed at the start, as fast as
//!        decided ──────────────▶│           acceleration and the backward curve allow
//!                               └ the last node that the end of what is known did not slow
//! ```
//!
//! The forward curve under the backward one is the least time under these limits: the optimum for
//! constant accelerations over the whole program, since a node is given out only when nothing
//! that may follow can change it. That is so from the start up to the last node where the forward
//! curve meets a limit of its own, or cannot reach the backward curve: a machine that must be at
//! rest at the end of what is known is as fast there as one that need not be. Memory is that of
//! the way that braking takes, v²/2a.

use std::f64::consts::PI;
use std::ops::Range;
use std::rc::Rc;

use crate::path::{Curve, Segment};

use super::corner::CORNER_SHARE;
use super::extreme::{greater, lesser};
use super::hop::Hop;
use super::jerk::Smoother;
use super::limits::Limits;
use super::piece::Piece;
use super::run::{Item, Run};
use super::{Bound, Feed, SeamKind};

/// Items that are looked at together at least: so many that the passes' overhead is spread.
const ITEMS_MIN: usize = 128;

/// Share of `path_tolerance_mm` for corners within a tick among lines: but for rounding all of it. Beside curves
/// it is [`CORNER_SHARE`].
const LINES_SHARE: f64 = 0.98;

/// Looks ahead over a stream of pieces.
#[derive(Debug)]
pub struct LookAhead {
    has_ramps: bool,
    tick_s: f64,
    tolerance_mm: f64,
    /// How far a tick may go that turns by half a turn at one place.
    half_turn_mm: f64,
    /// The square of how far one may go that turns by a radian; by other turns it is that over their angle.
    radian_turn_sq: f64,
    queue: Vec<Queued>,
    /// So many items of the queue have been given out.
    given: usize,
    /// The item given out last was a seam where motion would not rest.
    is_at_seam: bool,
    /// So many items of the queue are decided, those given out among them.
    decided: usize,
    /// Items that the queue holds before the passes run again.
    enough: usize,
    /// What comes after, where an axis has a limit on jerk.
    smoother: Option<Smoother>,
    /// Those that have been run, to be used again.
    #[expect(clippy::vec_box, reason = "they come and go in their boxes")]
    spare: Vec<Box<Run>>,
}

#[derive(Debug)]
struct Queued {
    item: Item,
    /// Square of the speed at its start: the backward curve, then what is planned.
    entry_sq: f64,
    /// The speed that is planned.
    entry_mm_s: f64,
}

impl Queued {
    const EMPTY: Queued =
        Queued { item: Item::Seam(SeamKind::Rest), entry_sq: 0.0, entry_mm_s: 0.0 };

    /// Square of the greatest speed at its start.
    fn entry_limit_sq(&self) -> f64 {
        let limit_sq = |piece: &Piece| lesser(piece.junction.speed_sq_max, piece.ends_sq_max[0]);
        self.item.piece().map_or(0.0, limit_sq)
    }
}

impl LookAhead {
    /// From rest.
    pub fn new(limits: &Limits, feed: Feed) -> LookAhead {
        let has_ramps = feed != Feed::Constant;
        LookAhead {
            has_ramps,
            tick_s: limits.tick_s,
            tolerance_mm: limits.path_tolerance_mm,
            half_turn_mm: turning_mm(CORNER_SHARE * limits.path_tolerance_mm, PI),
            radian_turn_sq: turning_mm(CORNER_SHARE * limits.path_tolerance_mm, 1.0).powi(2),
            queue: Vec::new(),
            given: 0,
            is_at_seam: false,
            decided: 0,
            enough: ITEMS_MIN,
            smoother: (has_ramps && limits.has_jerk).then(Smoother::new),
            spare: Vec::new(),
        }
    }

    /// A run along a segment, of a piece that it is still to become.
    #[inline]
    pub fn run(&mut self, segment: Rc<Segment>) -> Box<Run> {
        let Some(mut run) = self.spare.pop() else {
            return Run::boxed(segment);
        };
        run.segment = segment;
        run
    }

    /// Takes a run back that nobody needs any more. Those along parts of arcs are more than whole segments
    /// ask for again.
    #[inline]
    pub fn reuse(&mut self, run: Box<Run>) {
        if self.spare.len() < self.enough {
            self.spare.push(run);
        }
    }

    /// Takes the next piece of the path.
    #[inline]
    pub fn push_run(&mut self, run: Box<Run>) {
        let may_be_cut = self.has_ramps && self.may_cut_corner(&run.piece);
        self.slot().item = Item::Run(run);
        if may_be_cut {
            self.hold_corner();
        }
        self.decide_in_time();
    }

    /// Whether a tick may be so long that its chord cuts the corner at the start of the next piece, or that and
    /// ones before.
    #[inline]
    fn may_cut_corner(&self, next: &Piece) -> bool {
        if next.junction.turn.is_none() {
            return false;
        }
        let before = self.queue.last().and_then(|queued| queued.item.piece());
        let Some(before) = before else { return true };
        let tick_s_sq = self.tick_s * self.tick_s;
        let before_sq = before.speed_sq_max();
        let tick_sq = greater(next.speed_sq_max(), before_sq) * tick_s_sq;
        self.may_be_cut(tick_sq, 0.0, next.junction.turn.tan_sq())
            || before.length_mm * before.length_mm <= before_sq * tick_s_sq
    }

    /// Takes the next item where the machine rests.
    pub fn push_stop(&mut self, item: Item) {
        self.slot().item = item;
        self.decide_in_time();
    }

    /// A place for the next item, which is filled where it lies: made elsewhere and moved here it would be read
    /// back before it is written.
    #[inline]
    fn slot(&mut self) -> &mut Queued {
        let newest = self.queue.len();
        self.queue.push(Queued::EMPTY);
        &mut self.queue[newest]
    }

    #[inline]
    fn decide_in_time(&mut self) {
        if self.queue.len() - self.given >= self.enough {
            self.decide();
        }
    }

    /// No item follows: the path ends at rest.
    pub fn finish(&mut self) {
        self.decide();
        self.settle(self.queue.len());
    }

    /// Gives the next item whose motion is decided, if there is one.
    #[inline]
    pub fn pop(&mut self) -> Option<Item> {
        if self.smoother.is_none() { self.pop_front() } else { self.pop_smooth() }
    }

    #[inline(never)]
    fn pop_smooth(&mut self) -> Option<Item> {
        loop {
            if let Some(smooth) = self.smoother.as_mut().and_then(Smoother::pop) {
                return Some(smooth);
            }
            let item = self.pop_front()?;
            self.smoother.as_mut()?.push(item);
        }
    }

    /// Gives the next item, if its speeds are decided.
    #[inline]
    fn pop_front(&mut self) -> Option<Item> {
        if self.given == self.decided {
            return None;
        }
        let front = &mut self.queue[self.given];
        self.given += 1;
        self.is_at_seam = front.item.is_own_stop();
        Some(std::mem::replace(&mut front.item, Item::Seam(SeamKind::Rest)))
    }

    fn decide(&mut self) {
        let start_sq = self.queue.get(self.given).map_or(0.0, |front| front.entry_sq);
        self.queue.drain(..self.given);
        (self.given, self.decided) = (0, 0);
        let count = if self.has_ramps {
            self.backward();
            self.forward(start_sq)
        } else {
            self.queue.len()
        };
        self.settle(count);
        self.enough = ITEMS_MIN.max(2 * (self.queue.len() - self.decided));
    }

    /// Nothing can change the speeds of so many items of the queue: these are run so.
    fn settle(&mut self, count: usize) {
        let before = self.decided.checked_sub(1).map(|before| &self.queue[before].item);
        let mut starts_at_seam = before.map_or(self.is_at_seam, Item::is_own_stop);
        for i in self.decided..count {
            let next = self.queue.get(i + 1);
            let exit_mm_s = next.map_or(0.0, |next| next.entry_mm_s);
            let ends_at_seam = next.is_some_and(|next| next.item.is_own_stop());
            let Queued { item, entry_mm_s, .. } = &mut self.queue[i];
            let at_seam = starts_at_seam || ends_at_seam;
            starts_at_seam = item.is_own_stop();
            let Item::Run(run) = item else { continue };
            let (entry_mm_s, exit_mm_s) = if self.has_ramps {
                (*entry_mm_s, exit_mm_s)
            } else {
                let speed_mm_s = run.piece.speed_sq_max().sqrt();
                (speed_mm_s, speed_mm_s)
            };
            run.decide(entry_mm_s, exit_mm_s, at_seam && self.has_ramps);
        }
        self.decided = count;
    }

    /// The greatest speed at each node from which the machine can keep all limits that follow and
    /// be at rest at the end.
    fn backward(&mut self) {
        let mut exit_sq = 0.0;
        for queued in self.queue.iter_mut().rev() {
            let entry_sq = |piece: &Piece| piece.entry_sq_max(exit_sq, piece.junction.speed_sq_max);
            exit_sq = queued.item.piece().map_or(0.0, entry_sq);
            queued.entry_sq = exit_sq;
        }
    }

    /// As fast as the backward curve allows, from this square of a speed on. Gives the number of items that nothing after the
    /// queue can change.
    fn forward(&mut self, start_sq: f64) -> usize {
        let (mut decided, mut entry_sq) = (0, start_sq);
        let open_from = self.open_from();
        let mut queue = self.queue.iter_mut().enumerate().peekable();
        while let Some((i, queued)) = queue.next() {
            (queued.entry_sq, queued.entry_mm_s) = (entry_sq, entry_sq.sqrt());
            let Some((_, next)) = queue.peek() else { break };
            let backward_sq = next.entry_sq;
            let exit_sq = |piece: &Piece| piece.exit_sq_max(entry_sq, backward_sq);
            entry_sq = queued.item.piece().map_or(0.0, exit_sq);
            if i < open_from && (entry_sq < backward_sq || entry_sq >= next.entry_limit_sq()) {
                decided = i + 1;
            }
        }
        decided
    }

    /// The first item whose tick a corner after the queue may still lie in.
    fn open_from(&self) -> usize {
        let mut left_mm = 0.0;
        for (i, queued) in self.queue.iter().enumerate().rev() {
            let Some(piece) = queued.item.piece() else { return i };
            if left_mm * left_mm > piece.speed_sq_max() * self.tick_s * self.tick_s {
                return i;
            }
            left_mm += piece.length_mm;
        }
        0
    }

    /// Whether a tick with this square of its way may cut corners within a span, by this square, or more, of the sum
    /// of their tangents. Not where it would not if they were half a turn, since many are passed so slowly; nor
    /// where it would not if they turned by as much as their tangents are, since many turn so little.
    #[inline]
    fn may_be_cut(&self, tick_sq: f64, span_mm: f64, tan_sq: f64) -> bool {
        let half_turn_way_mm = way_mm(self.half_turn_mm, span_mm);
        tick_sq > half_turn_way_mm * half_turn_way_mm && tick_sq * tan_sq > self.radian_turn_sq
    }

    /// Holds the speed around the newest corner so that no chord of a tick cuts it, with the
    /// corners before it, by more than their share of the path tolerance: see [`way_mm`].
    #[inline(never)]
    fn hold_corner(&mut self) {
        let newest = self.queue.len() - 1;
        let tick_s_sq = self.tick_s * self.tick_s;
        let (mut span_mm, mut fastest_sq) = (0.0, self.piece_sq(newest));
        // How far the path turns, from this item on; corners from the first one on, and squares of their tangents.
        let (mut turn_rad, mut turn_from) = (0.0, newest + 1);
        let (mut corners, mut tan_sq) = (0.0, 0.0);
        for first in (0..=newest).rev() {
            let Some(piece) = self.queue[first].item.piece() else { break };
            if first < newest {
                span_mm += piece.length_mm;
                let is_past = span_mm * span_mm > piece.speed_sq_max() * tick_s_sq;
                if is_past || piece.junction.speed_sq_max == 0.0 {
                    break;
                }
            }
            let before_sq = first.checked_sub(1).map_or(0.0, |before| self.piece_sq(before));
            fastest_sq = greater(fastest_sq, before_sq);
            let tick_sq = fastest_sq * tick_s_sq;
            let turn = piece.junction.turn;
            if turn.is_none() {
                continue;
            }
            // The square of a sum is at most the sum of the squares, so many times.
            (corners, tan_sq) = (corners + 1.0, tan_sq + turn.tan_sq());
            if !self.may_be_cut(tick_sq, span_mm, corners * tan_sq) {
                continue;
            }
            turn_rad = lesser(turn_rad + self.turn_rad(first..turn_from), PI);
            turn_from = first;
            let off_mm = self.corner_share(first, newest) * self.tolerance_mm;
            let way_mm = way_mm(turning_mm(off_mm, turn_rad), span_mm);
            if tick_sq > way_mm * way_mm {
                self.hold_window(first, newest, way_mm);
                let around = first.saturating_sub(1)..=newest;
                fastest_sq = around.map(|i| self.piece_sq(i)).fold(0.0, greater);
            }
        }
    }

    /// How far the path turns at the starts of items.
    fn turn_rad(&self, items: Range<usize>) -> f64 {
        let turns = self.queue[items].iter().filter_map(|queued| queued.item.piece());
        let turns = turns.map(|piece| piece.junction.turn).filter(|turn| !turn.is_none());
        turns.map(|turn| turn.rad()).sum()
    }

    /// Square of the speed that all of a piece can be run at; 0 of anything else.
    fn piece_sq(&self, index: usize) -> f64 {
        self.queue[index].item.piece().map_or(0.0, Piece::speed_sq_max)
    }

    /// The share of the path tolerance for the corners at the starts of two items.
    fn corner_share(&self, first: usize, last: usize) -> f64 {
        let is_line = |i: usize| match &self.queue[i].item {
            Item::Run(run) => matches!(run.segment.curve, Curve::Line),
            Item::Event(_) | Item::Seam(_) => true,
        };
        let has_lines_only = (first.saturating_sub(1)..=last).all(is_line);
        if has_lines_only { LINES_SHARE } else { CORNER_SHARE }
    }

    /// Holds the speed around the corners at the starts of two items, so that a tick goes no further. Where stops in
    /// these corners take less time than going on so slowly the machine stops.
    fn hold_window(&mut self, first: usize, last: usize, way_mm: f64) {
        let around = first.saturating_sub(1)..=last;
        let pieces = around.filter_map(|i| self.queue[i].item.piece());
        let (mut accel_mm_s2, mut jerk_mm_s3) = (0.0, 0.0);
        for piece in pieces {
            accel_mm_s2 = greater(accel_mm_s2, piece.accel_max_mm_s2());
            jerk_mm_s3 = greater(jerk_mm_s3, piece.jerk.along_mm_s3());
        }
        // Half a tick of braking before and of speeding up after the window's middle. What a limit on jerk leaves of
        // that is j·T³/24; twice that, for accelerations that step.
        let mut gain_mm = 0.25 * accel_mm_s2 * self.tick_s * self.tick_s;
        if self.smoother.is_some() {
            gain_mm = lesser(gain_mm, jerk_mm_s3 * self.tick_s.powi(3) / 12.0);
        }
        let slow_mm_s = (way_mm - gain_mm).max(0.0) / self.tick_s;
        let (inside_mm, stops_s) = self.stopping(first..last);
        let speed_mm_s = if slow_mm_s * stops_s < inside_mm { 0.0 } else { slow_mm_s };
        let speed_sq = speed_mm_s * speed_mm_s;
        for i in first..=last {
            let Item::Run(run) = &mut self.queue[i].item else { continue };
            let piece = &mut run.piece;
            let junction = &mut piece.junction;
            // Pieces of a curve go straight on; they are held as a whole, or between stops.
            if speed_sq < junction.speed_sq_max && !junction.turn.is_none() {
                junction.speed_sq_max = speed_sq;
                junction.bound = Bound::Tick;
            }
            if i < last && speed_sq > 0.0 {
                piece.bounded_by(speed_sq, Bound::Tick);
            }
        }
    }

    /// The length of some pieces, and the time they take with a stop in every corner among them, each with a wait
    /// for a tick's boundary.
    fn stopping(&self, items: Range<usize>) -> (f64, f64) {
        let (mut length_mm, mut stops_s, mut hop) = (0.0, 0.0, Hop::NONE);
        for piece in self.queue[items].iter().filter_map(|queued| queued.item.piece()) {
            if length_mm > 0.0 && !piece.junction.turn.is_none() {
                stops_s += std::mem::replace(&mut hop, Hop::NONE).time_s() + self.tick_s;
            }
            length_mm += piece.length_mm;
            hop.add(piece);
        }
        (length_mm, stops_s + hop.time_s() + self.tick_s)
    }
}

/// How far a tick may go that turns so far within a span S. Over a way W that turns by Θ within a part S of it, a
/// chord is off by at most Θ·(W/4 - S/8).
///
/// ```text
///            ,--S--.
///      _____/       \_____       W: the way of a tick
///     '- - - - - - - - - -'      chord
/// ```
#[inline]
fn way_mm(turning_mm: f64, span_mm: f64) -> f64 {
    greater(turning_mm + 0.5 * span_mm, span_mm)
}

/// The same at one place, where a chord may be so far off.
fn turning_mm(off_mm: f64, turn_rad: f64) -> f64 {
    4.0 * off_mm / turn_rad
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::{Axis, Machine, Point};
    use proptest::prelude::*;

    proptest! {
        /// Corners that are passed over by their tangents are not cut, by their angles, whatever lies between.
        #[test]
        fn what_may_not_be_cut_is_not(
            turns_rad in prop::collection::vec(1e-6..1.5_f64, 1..5),
            scale in 0.1..1.0_f64, way_share in 0.0..3.0_f64, span_share in 0.0..1.5_f64,
        ) {
            let limits = Limits::new(&Machine::load("router").unwrap());
            let ahead = LookAhead::new(&limits, Feed::LookAhead);
            let turns_rad: Vec<f64> = turns_rad.iter().map(|turn| turn * scale.powi(4)).collect();
            let turn_rad: f64 = turns_rad.iter().sum();
            let most_mm = turning_mm(LINES_SHARE * limits.path_tolerance_mm, turn_rad);
            let [tick_mm, span_mm] = [way_share * most_mm, span_share * most_mm];
            let squares: f64 = turns_rad.iter().map(|turn| libm::tan(*turn).powi(2)).sum();
            let tan_sq = turns_rad.len() as f64 * squares;
            prop_assume!(!ahead.may_be_cut(tick_mm * tick_mm, span_mm, tan_sq));
            for share in [CORNER_SHARE, LINES_SHARE] {
                let off_mm = share * limits.path_tolerance_mm;
                let way_mm = way_mm(turning_mm(off_mm, turn_rad.min(PI)), span_mm);
                prop_assert!(tick_mm <= way_mm * (1.0 + 1e-12), "{tick_mm} {way_mm}");
            }
        }
    }
    use crate::plan::junction::Junction;

    /// Seams and runs come two at a time: wherever the passes fall between them, those beside a seam are so.
    #[test]
    fn runs_beside_seams_know_it() {
        const RUNS: u32 = 10_000;
        let limits = Limits::new(&Machine::load("router").unwrap());
        let [from_mm, mut to_mm] = [Point::ZERO; 2];
        to_mm[Axis::X] = 10.0;
        let (curve, corner) = (Curve::Line, Default::default());
        let feed_mm_s = Some(10.0);
        let line = Rc::new(Segment { line: 1, feed_mm_s, from_mm, to_mm, curve, corner });
        // One of two or three, in no order that batches share.
        let ends_at_seam = |k: u32| k.wrapping_mul(2_654_435_761) >> 16 & 0xff < 100;
        let mut ahead = LookAhead::new(&limits, Feed::LookAhead);
        let mut runs = 0..RUNS;
        for k in 0..RUNS {
            let mut run = ahead.run(Rc::clone(&line));
            run.piece.become_whole(10.0, 10.0, &to_mm, &Junction::STRAIGHT, &limits);
            ahead.push_run(run);
            if ends_at_seam(k) {
                ahead.push_stop(Item::Seam(SeamKind::Cut));
            }
            if k + 1 == RUNS {
                ahead.finish();
            }
            while let Some(item) = ahead.pop() {
                let Item::Run(run) = item else { continue };
                let k = runs.next().unwrap();
                let at_seam = ends_at_seam(k) || k > 0 && ends_at_seam(k - 1);
                assert_eq!(run.at_seam, at_seam, "{k}");
            }
        }
        assert!(runs.is_empty());
    }
}
