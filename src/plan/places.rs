//! Where node buffers may end, and what a stop there takes.
//!
//! ```text
//!  v ┤ ______          ________   plan without seams
//!    │       \        /
//!    │        \      /            a stop takes the ramps' time
//!    │         \    /             beyond that of the plan
//!  0 ┼──────────\──/──────────── s
//!                place
//! ```
//!
//! Places are where motion rests anyway, ends of rapids and of blocks, and the inside of rapids
//! and of blocks that take long.

use std::collections::VecDeque;

use crate::base::{Axis, AxisSet, Machine};
use crate::path::{Curve, Segment};

use super::Feed;
use super::limits::Limits;
use super::piece::Piece;
use super::run::{Item, Run};
use super::seams::SeamKind;
use super::stop::{Climber, Way};

/// Places that lie closer behind another that is as good are left out, but for those where motion
/// rests: at 4 ticks a buffer has still 374 to choose from.
const APART_TICKS: f64 = 4.0;

/// Rest, the ends of rapids, the inside of rapids, the ends of cuts, the inside of cuts: an end is not left out
/// for a place inside, since a buffer that begins a few ticks later may do without a stop in a cut.
const RANKS: usize = 5;

/// Blocks that take less than this share of a buffer have no place inside.
const LONG_SHARE: f64 = 0.4;

/// So much more than reckoned the ramps of a stop are taken to last on each side, where motion goes on. In one of
/// 20,000 made-up programs that was too little, which is found in the plan.
pub const UNSURE_TICKS: f64 = 1.0;

/// Ticks that an event in a buffer may add to it: it falls on another share of a tick than planned.
pub const SHIFT_TICKS: f64 = 1.0;

/// A place where a buffer may end.
#[derive(Clone, Debug)]
pub struct Place {
    /// Number of the segment that it lies in or ends with, from 0.
    pub segment: u64,
    /// Where on the segment, as a share of its way.
    pub share: f64,
    /// Line of the NC program that the segment belongs to.
    pub line: u32,
    /// What a stop there interrupts.
    pub kind: SeamKind,
    /// It lies inside a block.
    pub is_inside: bool,
    /// A buffer has to end there.
    pub is_forced: bool,
    /// Ticks from the start of the job to it, without seams.
    pub at_ticks: f64,
    /// Ticks that a stop there adds before it.
    pub before_ticks: f64,
    /// Ticks that a stop there adds after it.
    pub after_ticks: f64,
    /// Ticks by which either may be more.
    pub unsure_ticks: f64,
    /// Axes that move between the place before and it.
    pub moving: AxisSet,
    /// Stretches between events up to it: each begins on a tick's boundary.
    pub stretch: u64,
    /// Stops up to it that may wait for a tick's boundary.
    pub waits: u64,
    /// Speeding up again from a stop there, until what it takes is known.
    pub catching_up: Option<Climber>,
}

impl Place {
    /// The start of the job.
    pub fn start() -> Place {
        Place {
            segment: 0,
            share: 0.0,
            line: 0,
            kind: SeamKind::Rest,
            is_inside: false,
            is_forced: true,
            at_ticks: 0.0,
            before_ticks: 0.0,
            after_ticks: 0.0,
            unsure_ticks: 0.0,
            moving: AxisSet::EMPTY,
            stretch: 0,
            waits: 0,
            catching_up: None,
        }
    }

    /// Ticks of a buffer from here to another place, at most: an event between them falls on
    /// another share of a tick than in the plan without seams.
    pub fn ticks_to(&self, end: &Place) -> f64 {
        let shifted = if end.stretch > self.stretch { SHIFT_TICKS } else { 0.0 };
        let waits = (end.waits - self.waits) as f64;
        let ramps = self.after_ticks + end.before_ticks + self.unsure_ticks + end.unsure_ticks;
        end.at_ticks - self.at_ticks + ramps + shifted + waits
    }
}

/// Turns a plan without seams into places.
#[derive(Debug)]
pub struct Places {
    has_ramps: bool,
    unsure_ticks: f64,
    tick_s: f64,
    ticks_max: f64,
    corner_mm: f64,
    accel_max_mm_s2: f64,
    /// Pieces that braking for a place may reach back to.
    behind: VecDeque<Box<Run>>,
    /// Places in order, waiting for what speeding up again takes.
    places: VecDeque<Place>,
    at_ticks: f64,
    /// Where the last place of each rank lies, the best rank first.
    last_at_ticks: [f64; RANKS],
    stretch: u64,
    waits: u64,
    moving: AxisSet,
    /// Segments passed, and whether one is under way.
    segment: u64,
    line: u32,
    ended: Option<EndedBlock>,
    finished: bool,
}

/// A segment whose end may be a place, once it is known what follows.
#[derive(Debug)]
struct EndedBlock {
    is_rapid: bool,
    rests: bool,
}

impl Places {
    /// From the start of the job, with so many ticks in which each ramp of a stop may be longer than reckoned.
    pub fn new(machine: &Machine, feed: Feed, unsure_ticks: f64) -> Places {
        Places {
            has_ramps: feed != Feed::Constant,
            unsure_ticks,
            tick_s: machine.bus.tick_s(),
            ticks_max: machine.bus.motion_ticks_max().map_or(f64::INFINITY, f64::from),
            corner_mm: 0.5 * machine.path_tolerance_mm,
            accel_max_mm_s2: Limits::new(machine).accel_max_mm_s2,
            behind: VecDeque::new(),
            places: VecDeque::new(),
            at_ticks: 0.0,
            last_at_ticks: std::array::from_fn(
                |rank| if rank == 0 { 0.0 } else { f64::NEG_INFINITY },
            ),
            stretch: 0,
            waits: 0,
            moving: AxisSet::EMPTY,
            segment: 0,
            line: 0,
            ended: None,
            finished: false,
        }
    }

    /// Takes the next item of the plan.
    pub fn push(&mut self, item: Item) {
        match item {
            Item::Seam(_) => {}
            Item::Event(event) => {
                // Without ramps, too.
                if let Some(ended) = &mut self.ended {
                    ended.rests = true;
                }
                self.end_block(true);
                self.at_ticks = self.at_ticks.ceil();
                self.stretch += 1;
                let is_forced = event.kind.waits_for_person();
                match self.places.back_mut() {
                    Some(place) if self.moving.is_empty() => {
                        place.at_ticks = self.at_ticks;
                        place.stretch = self.stretch;
                        place.is_forced |= is_forced;
                    }
                    _ => {}
                }
            }
            Item::Run(run) => {
                if run.piece.shares[0] == 0.0 {
                    self.end_block(run.segment.feed_mm_s.is_none());
                }
                self.run(run);
            }
        }
    }

    /// No item follows.
    pub fn finish(&mut self) {
        self.end_block(true);
        self.finished = true;
    }

    /// Gives the next place whose cost is known.
    pub fn pop(&mut self) -> Option<Place> {
        match self.places.front() {
            // The last one may turn out to be one where a person waits.
            Some(place)
                if place.catching_up.is_none()
                    && (self.finished || self.places.len() > 1 || !self.moving.is_empty()) =>
            {
                self.places.pop_front()
            }
            _ => None,
        }
    }

    fn run(&mut self, run: Box<Run>) {
        let rests = run.ends_mm_s[1] == 0.0;
        self.catch_up(&run, rests);
        let Run { segment, piece, ramp, .. } = &*run;
        self.line = segment.line;
        self.at_ticks += ramp.duration_s() / self.tick_s;
        self.moving = self.moving.union(moving(segment));
        let (share, is_rapid) = (piece.shares[1], segment.feed_mm_s.is_none());
        let takes_long = self.takes_long(segment, piece);
        self.behind.push_back(run);
        if share == 1.0 {
            self.ended = Some(EndedBlock { is_rapid, rests });
        } else if is_rapid || takes_long {
            let kind = if is_rapid { SeamKind::Rapid } else { SeamKind::Cut };
            self.place(share, kind, true, rests);
        }
    }

    fn takes_long(&self, segment: &Segment, piece: &Piece) -> bool {
        let length_mm = segment.length_mm();
        let ticks = length_mm / piece.speed_sq_max().sqrt() / self.tick_s;
        ticks > LONG_SHARE * self.ticks_max
    }

    /// The end of a segment becomes a place, now that it is known what follows.
    fn end_block(&mut self, rapid_follows: bool) {
        let Some(ended) = self.ended.take() else { return };
        let kind = match ended {
            EndedBlock { rests: true, .. } => SeamKind::Rest,
            EndedBlock { is_rapid: false, .. } if !rapid_follows => SeamKind::Cut,
            EndedBlock { .. } => SeamKind::Rapid,
        };
        self.place(1.0, kind, false, ended.rests);
        self.segment += 1;
    }

    fn place(&mut self, share: f64, kind: SeamKind, is_inside: bool, rests: bool) {
        let stops = rests || !self.has_ramps;
        if stops && self.may_wait() {
            self.waits += 1;
        }
        let rank = match kind {
            SeamKind::Rest => 0,
            SeamKind::Rapid => 1 + usize::from(is_inside),
            SeamKind::Cut => 3 + usize::from(is_inside),
        };
        let last_at_ticks = self.last_at_ticks[..=rank].iter().fold(0.0, |a: f64, b| a.max(*b));
        if !rests && self.at_ticks < last_at_ticks + APART_TICKS {
            return;
        }
        let before_ticks = if stops { 0.0 } else { self.braking_ticks() };
        if stops {
            self.behind.clear();
        }
        self.last_at_ticks[rank] = self.at_ticks;
        self.places.push_back(Place {
            segment: self.segment,
            share,
            line: self.line,
            kind,
            is_inside,
            is_forced: false,
            at_ticks: self.at_ticks,
            before_ticks,
            after_ticks: 0.0,
            unsure_ticks: if stops { 0.0 } else { self.unsure_ticks },
            moving: std::mem::replace(&mut self.moving, AxisSet::EMPTY),
            stretch: self.stretch,
            waits: self.waits,
            catching_up: (!stops).then_some(Climber::new(Way::Forwards)),
        });
    }

    /// Whether a stop may have to wait for a tick's boundary. With a the acceleration before it and A
    /// the greatest, the tick brakes over a·(s·T)²/2 and speeds up over A·((1 - s)·T)²/2 at most; the
    /// lesser of both is greatest where they are equal, at T²/2 · a·A/(√a + √A)².
    fn may_wait(&self) -> bool {
        if !self.has_ramps {
            return true;
        }
        let before = self.behind.back().map_or(0.0, |run| run.piece.accel_max_mm_s2());
        let roots = before.sqrt() + self.accel_max_mm_s2.sqrt();
        let cut_mm = before * self.accel_max_mm_s2 / (roots * roots) * self.tick_s * self.tick_s;
        0.5 * cut_mm > self.corner_mm
    }

    /// What braking from the plan's speed to rest here takes beyond the plan. What is too far
    /// back for any later place is forgotten.
    fn braking_ticks(&mut self) -> f64 {
        let mut braking = Climber::new(Way::Backwards);
        let mut reached = self.behind.len();
        while reached > 0 && !braking.is_done() {
            reached -= 1;
            braking.pass(&self.behind[reached]);
        }
        self.behind.drain(..reached);
        braking.more_s() / self.tick_s
    }

    /// Places behind this piece speed up from rest along it, as far as they have not caught up
    /// with the plan.
    fn catch_up(&mut self, run: &Run, rests: bool) {
        for place in &mut self.places {
            let Some(up) = &mut place.catching_up else { continue };
            up.pass(run);
            if up.is_done() || rests {
                place.after_ticks += up.more_s() / self.tick_s;
                place.catching_up = None;
            }
        }
    }
}

/// The axes that move along a segment.
fn moving(segment: &Segment) -> AxisSet {
    let ends = segment.from_mm.0.iter().zip(segment.to_mm.0);
    let axes = Axis::ALL.into_iter().zip(ends);
    let straight: AxisSet = axes.filter(|(_, (from, to))| **from != *to).map(|(a, _)| a).collect();
    match &segment.curve {
        Curve::Line => straight,
        Curve::Spline(spline) => {
            let xyz = Axis::LINEAR.into_iter().zip(spline.axis_speeds());
            straight.union(xyz.filter(|(_, speed)| *speed > 0.0).map(|(axis, _)| axis).collect())
        }
        Curve::Arc(arc) => straight.union(arc.plane.axes().into_iter().collect()),
    }
}
