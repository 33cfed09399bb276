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

use crate::base::Event;
use crate::path::{Curve, Segment};

use super::corner::CORNER_SHARE;
use super::extreme::{greater, lesser};
use super::jerk::Smoother;
use super::limits::Limits;
use super::piece::Piece;
use super::{Bound, Feed, Profile, Ramp, SeamKind};

/// An item on its way to the schedule.
#[derive(Clone, Debug)]
pub enum Ahead {
    /// A piece of the path, from rest or from the piece before. It stays where it lies until it is run.
    Piece(Rc<Segment>, Box<Piece>),
    /// Something that happens at rest.
    Event(Box<Event>),
    /// A node buffer ends and the next begins, at rest.
    Seam(SeamKind),
}

/// An item whose speeds are decided.
#[derive(Clone, Debug)]
pub enum Decided {
    /// A piece of the path.
    Piece {
        /// The segment that it is of.
        segment: Rc<Segment>,
        /// The piece.
        piece: Box<Piece>,
        /// Speeds at its start and end.
        ends_mm_s: [f64; 2],
        /// How it is run between them.
        ramp: Ramp,
        /// It begins or ends with a stop that only a seam asks for.
        at_seam: bool,
    },
    /// Something that happens at rest.
    Event(Box<Event>),
    /// A node buffer ends and the next begins, at rest.
    Seam(SeamKind),
}

/// An item whose motion is decided: what the schedule puts on the time axis.
#[derive(Clone, Debug)]
pub enum Timed {
    /// Motion along a piece of a segment, which a profile has become: all but when it is and in which buffer.
    Run {
        /// It ends at rest.
        rests_at_end: bool,
    },
    /// Something that happens at rest.
    Event(Box<Event>),
    /// A node buffer ends and the next begins, at rest.
    Seam(SeamKind),
}

impl Decided {
    /// Its motion alone.
    fn timed(self, profile: &mut Profile) -> Timed {
        match self {
            Decided::Event(event) => Timed::Event(event),
            Decided::Seam(kind) => Timed::Seam(kind),
            Decided::Piece { segment, piece, ends_mm_s, ramp, at_seam } => {
                profile.bound = Bound::of(&piece, ends_mm_s, &ramp, at_seam);
                (profile.segment, profile.shares, profile.ramp) = (segment, piece.shares, ramp);
                Timed::run(ends_mm_s)
            }
        }
    }
}

impl Timed {
    #[inline]
    fn run(ends_mm_s: [f64; 2]) -> Timed {
        Timed::Run { rests_at_end: ends_mm_s[1] == 0.0 }
    }
}

/// Items that are looked at together at least: so many that the passes' overhead is spread.
const ITEMS_MIN: usize = 64;

/// Share of `path_tolerance_mm` for corners within a tick among lines: but for rounding all of it. Beside curves
/// it is [`CORNER_SHARE`].
const LINES_SHARE: f64 = 0.98;

/// Looks ahead over a stream of pieces.
#[derive(Debug)]
pub struct LookAhead {
    has_ramps: bool,
    tick_s: f64,
    tolerance_mm: f64,
    /// How far a tick may go that turns by half a turn at once.
    half_turn_mm: f64,
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
    /// Pieces that have been run, to be used again.
    #[expect(clippy::vec_box, reason = "they come and go in their boxes")]
    spare: Vec<Box<Piece>>,
}

#[derive(Debug)]
struct Queued {
    item: Ahead,
    /// Square of the speed at its start: the backward curve, then what is planned.
    entry_sq: f64,
    /// The speed that is planned.
    entry_mm_s: f64,
}

impl Queued {
    const EMPTY: Queued =
        Queued { item: Ahead::Seam(SeamKind::Rest), entry_sq: 0.0, entry_mm_s: 0.0 };

    /// Square of the greatest speed at its start.
    fn entry_limit_sq(&self) -> f64 {
        match &self.item {
            Ahead::Piece(_, piece) => lesser(piece.junction.speed_sq_max, piece.ends_sq_max[0]),
            Ahead::Event(_) | Ahead::Seam(_) => 0.0,
        }
    }
}

impl Decided {
    /// An item without look-ahead: at its greatest speed from end to end.
    fn at_once(item: Ahead) -> Decided {
        match item {
            Ahead::Event(event) => Decided::Event(event),
            Ahead::Seam(kind) => Decided::Seam(kind),
            Ahead::Piece(segment, piece) => {
                let ends_mm_s = [piece.speed_sq_max().sqrt(); 2];
                let ramp = piece.ramp(ends_mm_s);
                Decided::Piece { segment, piece, ends_mm_s, ramp, at_seam: false }
            }
        }
    }
}

/// Whether it is a seam where motion would not rest.
fn is_own_stop(item: &Ahead) -> bool {
    matches!(item, Ahead::Seam(SeamKind::Rapid | SeamKind::Cut))
}

impl LookAhead {
    /// From rest.
    pub fn new(limits: &Limits, feed: Feed) -> LookAhead {
        let has_ramps = feed != Feed::Constant;
        LookAhead {
            has_ramps,
            tick_s: limits.tick_s,
            tolerance_mm: limits.path_tolerance_mm,
            half_turn_mm: 4.0 * CORNER_SHARE * limits.path_tolerance_mm / PI,
            queue: Vec::new(),
            given: 0,
            is_at_seam: false,
            decided: 0,
            enough: ITEMS_MIN,
            smoother: (has_ramps && limits.has_jerk).then(Smoother::new),
            spare: Vec::new(),
        }
    }

    /// A piece that is a whole segment of this feed and length: no more than the feed holds it so far.
    #[inline]
    pub fn piece(&mut self, feed_mm_s: Option<f64>, length_mm: f64) -> Box<Piece> {
        let Some(mut piece) = self.spare.pop() else {
            return Box::new(Piece::at_feed(feed_mm_s, [0.0, 1.0], length_mm));
        };
        piece.renew(feed_mm_s, length_mm);
        piece
    }

    /// Takes the next piece, of a segment.
    #[inline]
    pub fn push_piece(&mut self, segment: Rc<Segment>, piece: Box<Piece>) {
        let has_corner = !piece.junction.turn.is_none();
        let slot = self.slot();
        slot.item = Ahead::Piece(segment, piece);
        if has_corner && self.has_ramps {
            self.hold_corner();
        }
        self.decide_in_time();
    }

    /// Takes the next item where the machine rests.
    pub fn push_stop(&mut self, item: Ahead) {
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
        self.decided = self.queue.len();
    }

    /// Whether there may be an item whose motion is decided.
    #[inline]
    pub fn may_pop(&self) -> bool {
        self.given < self.decided || self.smoother.is_some()
    }

    /// Gives the next item whose motion is decided, if there is one.
    pub fn pop(&mut self) -> Option<Decided> {
        if self.smoother.is_none() {
            return self.pop_speeds();
        }
        loop {
            if let Some(smooth) = self.smoother.as_mut().and_then(Smoother::pop) {
                return Some(smooth);
            }
            let decided = self.pop_speeds()?;
            self.smoother.as_mut()?.push(decided);
        }
    }

    /// The same with its motion alone, which a profile becomes.
    #[inline]
    pub fn pop_timed(&mut self, profile: &mut Profile) -> Option<Timed> {
        if self.smoother.is_some() || !self.has_ramps {
            return Some(self.pop()?.timed(profile));
        }
        let (ends_mm_s, at_seam) = self.front_speeds()?;
        Some(match self.pop_front()? {
            Ahead::Event(event) => Timed::Event(event),
            Ahead::Seam(kind) => Timed::Seam(kind),
            Ahead::Piece(segment, piece) => {
                profile.ramp = piece.ramp(ends_mm_s);
                let peak_mm_s = profile.ramp.peak_mm_s();
                profile.bound = Bound::without_jerk(&piece, ends_mm_s, peak_mm_s, at_seam);
                (profile.segment, profile.shares) = (segment, piece.shares);
                // Those that arcs were cut into are more than whole segments ask for again.
                if self.spare.len() < self.enough {
                    self.spare.push(piece);
                }
                Timed::run(ends_mm_s)
            }
        })
    }

    /// Gives the next item whose speeds are decided, if there is one.
    fn pop_speeds(&mut self) -> Option<Decided> {
        if !self.has_ramps {
            return self.pop_front().map(Decided::at_once);
        }
        let (ends_mm_s, at_seam) = self.front_speeds()?;
        Some(match self.pop_front()? {
            Ahead::Event(event) => Decided::Event(event),
            Ahead::Seam(kind) => Decided::Seam(kind),
            Ahead::Piece(segment, piece) => {
                let ramp = piece.ramp(ends_mm_s);
                Decided::Piece { segment, piece, ends_mm_s, ramp, at_seam }
            }
        })
    }

    /// The speeds at both ends of the next item, if they are decided, and whether one of them is a stop that
    /// only a seam asks for.
    #[inline]
    fn front_speeds(&self) -> Option<([f64; 2], bool)> {
        let front = self.queue[..self.decided].get(self.given)?;
        let next = self.queue.get(self.given + 1);
        let ends_mm_s = [front.entry_mm_s, next.map_or(0.0, |next| next.entry_mm_s)];
        let at_seam = self.is_at_seam || next.is_some_and(|next| is_own_stop(&next.item));
        Some((ends_mm_s, at_seam))
    }

    /// Gives the next item, if its speeds are decided.
    #[inline]
    fn pop_front(&mut self) -> Option<Ahead> {
        let front = self.queue[..self.decided].get_mut(self.given)?;
        self.given += 1;
        let item = std::mem::replace(&mut front.item, Ahead::Seam(SeamKind::Rest));
        self.is_at_seam = is_own_stop(&item);
        Some(item)
    }

    fn decide(&mut self) {
        let start_sq = self.queue.get(self.given).map_or(0.0, |front| front.entry_sq);
        self.queue.drain(..self.given);
        (self.given, self.decided) = (0, self.queue.len());
        if self.has_ramps {
            self.backward();
            self.decided = self.forward(start_sq);
        }
        self.enough = ITEMS_MIN.max(2 * (self.queue.len() - self.decided));
    }

    /// The greatest speed at each node from which the machine can keep all limits that follow and
    /// be at rest at the end.
    fn backward(&mut self) {
        let mut exit_sq = 0.0;
        for queued in self.queue.iter_mut().rev() {
            exit_sq = match &queued.item {
                Ahead::Piece(_, piece) => piece.entry_sq_max(exit_sq, piece.junction.speed_sq_max),
                Ahead::Event(_) | Ahead::Seam(_) => 0.0,
            };
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
            entry_sq = match &queued.item {
                Ahead::Piece(_, piece) => piece.exit_sq_max(entry_sq, backward_sq),
                Ahead::Event(_) | Ahead::Seam(_) => 0.0,
            };
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
            let Ahead::Piece(_, piece) = &queued.item else { return i };
            if left_mm * left_mm > piece.speed_sq_max() * self.tick_s * self.tick_s {
                return i;
            }
            left_mm += piece.length_mm;
        }
        0
    }

    /// Holds the speed around the newest corner so that no chord of a tick cuts it, with the
    /// corners before it, by more than their share of the path tolerance. Over a way W that turns
    /// by Θ within a part S of it, a chord is off by at most Θ·(W/4 - S/8).
    ///
    /// ```text
    ///            ,--S--.
    ///      _____/       \_____       W: the way of a tick
    ///     '- - - - - - - - - -'      chord
    /// ```
    fn hold_corner(&mut self) {
        let newest = self.queue.len() - 1;
        let tick_s_sq = self.tick_s * self.tick_s;
        let (mut span_mm, mut fastest_sq) = (0.0, self.piece_sq(newest));
        // How far the path turns, from this item on.
        let (mut turn_rad, mut turn_from) = (0.0, newest + 1);
        for first in (0..=newest).rev() {
            let Ahead::Piece(_, piece) = &self.queue[first].item else { break };
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
            let is_cut = |way_mm: f64| tick_sq > way_mm * way_mm;
            // Of half a turn first: most corners are passed so slowly that none matters.
            let half_turn_mm = greater(self.half_turn_mm + 0.5 * span_mm, span_mm);
            if !is_cut(half_turn_mm) || piece.junction.turn.is_none() {
                continue;
            }
            turn_rad = lesser(turn_rad + self.turn_rad(first..turn_from), PI);
            turn_from = first;
            let way_mm = self.way_mm(self.corner_share(first, newest), turn_rad, span_mm);
            if is_cut(way_mm) {
                self.hold_window(first, newest, way_mm);
                let around = first.saturating_sub(1)..=newest;
                fastest_sq = around.map(|i| self.piece_sq(i)).fold(0.0, greater);
            }
        }
    }

    /// How far a tick may go that turns so far within a span, at this share of the tolerance.
    #[inline]
    fn way_mm(&self, share: f64, turn_rad: f64, span_mm: f64) -> f64 {
        let off_mm = share * self.tolerance_mm;
        greater(4.0 * off_mm / turn_rad + 0.5 * span_mm, span_mm)
    }

    /// How far the path turns at the starts of items.
    fn turn_rad(&self, items: Range<usize>) -> f64 {
        let turn_rad = |queued: &Queued| match &queued.item {
            Ahead::Piece(_, piece) if !piece.junction.turn.is_none() => piece.junction.turn.rad(),
            Ahead::Piece(..) | Ahead::Event(_) | Ahead::Seam(_) => 0.0,
        };
        self.queue[items].iter().map(turn_rad).sum()
    }

    /// Square of the speed that all of a piece can be run at; 0 of anything else.
    fn piece_sq(&self, index: usize) -> f64 {
        match &self.queue[index].item {
            Ahead::Piece(_, piece) => piece.speed_sq_max(),
            Ahead::Event(_) | Ahead::Seam(_) => 0.0,
        }
    }

    /// The share of the path tolerance for the corners at the starts of two items.
    fn corner_share(&self, first: usize, last: usize) -> f64 {
        let is_line = |i: usize| match &self.queue[i].item {
            Ahead::Piece(segment, _) => matches!(segment.curve, Curve::Line),
            Ahead::Event(_) | Ahead::Seam(_) => true,
        };
        let has_lines_only = (first.saturating_sub(1)..=last).all(is_line);
        if has_lines_only { LINES_SHARE } else { CORNER_SHARE }
    }

    /// Holds the speed around the corners at the starts of two items, so that a tick goes no further.
    fn hold_window(&mut self, first: usize, last: usize, way_mm: f64) {
        let around = first.saturating_sub(1)..=last;
        let accel = |i: usize| match &self.queue[i].item {
            Ahead::Piece(_, piece) => piece.accel_max_mm_s2(),
            Ahead::Event(_) | Ahead::Seam(_) => 0.0,
        };
        let accel_mm_s2 = around.map(accel).fold(0.0, f64::max);
        // Half a tick of braking before and of speeding up after the window's middle.
        let gain_mm = 0.25 * accel_mm_s2 * self.tick_s * self.tick_s;
        let speed_mm_s = (way_mm - gain_mm).max(0.0) / self.tick_s;
        let speed_sq = speed_mm_s * speed_mm_s;
        for i in first..=last {
            let Ahead::Piece(_, piece) = &mut self.queue[i].item else { continue };
            let junction = &mut piece.junction;
            if speed_sq < junction.speed_sq_max {
                junction.speed_sq_max = speed_sq;
                junction.bound = Bound::Tick;
            }
            if i < last && speed_sq > 0.0 {
                piece.bounded_by(speed_sq, Bound::Tick);
            }
        }
    }
}
