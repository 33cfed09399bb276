//! Tick points against the path, with one distance that may suffice: where on the path each of them
//! belongs, and what follows from that.

use super::edges::Edges;
use super::executed::Executed;
use super::feed::{Feed, FeedError, Standing, steps_mm};
use super::others::{OtherAxes, OthersFeed};
use super::report::{Check, Place, WorstBlock};
use super::sweep::{Death, Match, Sweep};
use super::{Cause, Setup, VerifyError};
use crate::base::{Axis, Tick};
use crate::path::PathItem;

/// How many blocks are named.
const WORST_BLOCKS: usize = 10;

/// What matching tick points with the path tells.
#[derive(Clone, Debug, Default)]
pub struct Matched {
    /// Root mean square of the tick points' distances.
    pub rms_mm: f64,
    /// The blocks with the greatest distances, greatest first.
    pub worst_blocks: Vec<WorstBlock>,
    /// Speed along the path against feed.
    pub feed: FeedError,
    /// Axes other than X, Y and Z against the path.
    pub others: Vec<Check>,
    /// Where G64 P lets corners be cut by more than the path tolerance: the tick point that is
    /// furthest off for what it may be, in blocks with that; none without such blocks.
    pub blended: Option<BlendError>,
}

/// A tick point beside a corner that may be cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlendError {
    /// Its distance from the path.
    pub distance_mm: f64,
    /// What is allowed there beyond the bound of the contour elsewhere.
    pub slack_mm: f64,
    /// Where it is.
    pub at: Place,
}

/// What a distance that suffices leads to.
#[derive(Debug)]
pub struct Matching {
    pub matched: Matched,
    /// No distance below this suffices, by what happens here.
    pub low_mm: f64,
    pub low_at: Death,
    /// This distance suffices; infinite where matching does not tell.
    pub high_mm: f64,
}

/// Takes ticks one by one.
pub struct Matcher {
    executed: Executed,
    sweep: Sweep<1>,
    feed: Feed,
    others: OtherAxes,
    others_feeds: [OthersFeed; 2],
    /// Whether all edges in reach of where X, Y and Z stand have been read.
    is_read: bool,
    blocks: Worst,
    blended: Corners,
    standing: Standing,
    line: u32,
    high_mm: f64,
    last_tick: u64,
    distance_mm: f64,
    has_moved: bool,
}

impl Matcher {
    /// At the start of job and path, whose first edge is given.
    pub fn new(setup: &Setup, distance_mm: f64, first: super::edges::Edge) -> Matcher {
        let executed = Executed::new(setup);
        let start = executed.at();
        let standing =
            Standing { at: start, along_mm: 0.0, feed_mm_s: first.feed_mm_s, may_be_cut: false };
        let sweep = Sweep::new([distance_mm], start, first);
        let others_feeds = OthersFeed::both(setup, &executed.others_steps());
        let mut others = OtherAxes::new(setup.machine);
        others.reach(sweep.others());
        Matcher {
            executed,
            feed: Feed::new(setup, steps_mm(setup.machine, Axis::LINEAR), start),
            others,
            others_feeds,
            is_read: false,
            blocks: Worst::default(),
            blended: Corners::default(),
            standing,
            line: first.line,
            high_mm: sweep.low().0,
            sweep,
            last_tick: 0,
            distance_mm: 0.0,
            has_moved: false,
        }
    }

    /// Whether the distance has been found too small.
    pub fn is_dead(&self) -> bool {
        self.sweep.dead() > 0
    }

    /// How far the last tick point lies from where it is matched.
    pub fn distance_mm(&self) -> f64 {
        self.distance_mm
    }

    /// The next tick of the job.
    pub fn tick<P, E>(&mut self, tick: &Tick, edges: &mut Edges<'_, P>) -> Result<(), VerifyError>
    where
        P: Iterator<Item = Result<PathItem, E>>,
        E: Into<Cause>,
    {
        let point = self.executed.tick(tick);
        self.last_tick = point.tick;
        if self.is_dead() {
            return Ok(());
        }
        if point.moved {
            self.has_moved = true;
            self.sweep.advance(point.tick, point.at, || edges.next())?;
            if self.sweep.is_overfull() {
                return Err(VerifyError::TooDense { tick: point.tick });
            }
            let Some(near) = self.sweep.nearest(point.tick, self.standing.along_mm) else {
                return Ok(());
            };
            self.high_mm = self.high_mm.max(near.walk_mm);
            let at = Place { tick: point.tick, line: near.line };
            self.distance_mm = near.distance_mm;
            self.blocks.add(near.distance_mm, at);
            self.blended.add(&near, at);
            let (along_mm, feed_mm_s) = (near.along_mm, near.feed_mm_s);
            let may_be_cut = near.slack_mm > 0.0;
            self.standing = Standing { at: point.at, along_mm, feed_mm_s, may_be_cut };
            self.line = near.line;
        } else {
            self.standing.feed_mm_s = 0.0;
        }
        let place = Place { tick: point.tick, line: self.line };
        self.feed.tick(self.standing, place);
        if self.others.any() {
            if point.moved {
                self.others.reach(self.sweep.others());
            }
            let steps = self.executed.others_steps();
            let is_there = self.is_read && self.others.allow(&steps);
            if !point.moved && !is_there {
                // X, Y and Z rest: the path may have run on where it moves other axes alone.
                self.sweep.advance(point.tick, point.at, || edges.next())?;
                self.others.reach(self.sweep.others());
            }
            self.is_read = true;
            self.others.take(&steps, place);
            for (others, feed) in self.others_feeds.iter_mut().zip(self.sweep.others_feeds()) {
                others.tick(&steps, feed, place);
            }
        }
        Ok(())
    }

    /// The end of the job: whether the distance suffices.
    pub fn end<P, E>(
        mut self,
        edges: &mut Edges<'_, P>,
    ) -> Result<Result<Matching, Death>, VerifyError>
    where
        P: Iterator<Item = Result<PathItem, E>>,
        E: Into<Cause>,
    {
        if !self.has_moved {
            // All of the path is held against the one point: it may be shorter than a step.
            self.sweep.advance(self.last_tick, self.standing.at, || edges.next())?;
        }
        if !self.is_dead() {
            self.sweep.finish(self.last_tick, || edges.next())?;
        }
        if let Some(death) = self.sweep.death(0) {
            return Ok(Err(death));
        }
        let rest_mm = self.sweep.rest(self.last_tick, self.standing.along_mm);
        let (low_mm, low_at) = self.sweep.low();
        let matched = Matched {
            rms_mm: self.blocks.rms_mm(),
            worst_blocks: self.blocks.worst(),
            feed: self.feed.end(),
            others: {
                let feeds = self.others_feeds.into_iter().filter_map(OthersFeed::check);
                self.others.checks().into_iter().chain(feeds).collect()
            },
            blended: self.blended.worst,
        };
        Ok(Ok(Matching { matched, low_mm, low_at, high_mm: self.high_mm.max(rest_mm) }))
    }
}

/// Tick points beside corners that may be cut.
#[derive(Debug, Default)]
struct Corners {
    worst: Option<BlendError>,
}

impl Corners {
    fn add(&mut self, near: &Match, at: Place) {
        let Match { distance_mm, slack_mm, .. } = *near;
        let is_worse =
            |worst: BlendError| distance_mm - slack_mm > worst.distance_mm - worst.slack_mm;
        if slack_mm > 0.0 && self.worst.is_none_or(is_worse) {
            self.worst = Some(BlendError { distance_mm, slack_mm, at });
        }
    }
}

/// Distances of tick points, by block. Matching runs forward, so the points of a block come
/// together; a block that comes again (a subroutine) keeps its greatest distance.
#[derive(Debug, Default)]
struct Worst {
    points: u64,
    sum_sq: f64,
    current: Option<WorstBlock>,
    worst: Vec<WorstBlock>,
}

impl Worst {
    fn add(&mut self, max_mm: f64, at: Place) {
        self.points += 1;
        self.sum_sq += max_mm * max_mm;
        match &mut self.current {
            Some(block) if block.line == at.line => {
                if max_mm > block.max_mm {
                    *block = WorstBlock { line: at.line, tick: at.tick, max_mm };
                }
            }
            _ => {
                self.close();
                self.current = Some(WorstBlock { line: at.line, tick: at.tick, max_mm });
            }
        }
    }

    fn close(&mut self) {
        let Some(block) = self.current.take() else { return };
        let least_mm = self.worst.last().map_or(0.0, |last| last.max_mm);
        if self.worst.len() == WORST_BLOCKS && block.max_mm <= least_mm {
            return;
        }
        match self.worst.iter_mut().find(|known| known.line == block.line) {
            Some(known) if known.max_mm < block.max_mm => *known = block,
            Some(_) => {}
            None => self.worst.push(block),
        }
        self.worst.sort_by(|a, b| b.max_mm.total_cmp(&a.max_mm));
        self.worst.truncate(WORST_BLOCKS);
    }

    fn rms_mm(&self) -> f64 {
        if self.points == 0 { 0.0 } else { (self.sum_sq / self.points as f64).sqrt() }
    }

    fn worst(mut self) -> Vec<WorstBlock> {
        self.close();
        self.worst
    }
}
