//! How far the executed polyline is from the path: passes over both, each with a ladder of
//! distances, until the least distance that suffices is known.
//!
//! 1. Up to the bound in equal rungs: this decides the verdict. If the bound itself is too small,
//!    upwards in powers of two as far as time allows.
//! 2. Between the last rung that failed and the first that held.
//! 3. With the distance found: every tick point is matched with a point of the path, which gives
//!    the root mean square, the worst blocks and the speed along the path.
//!
//! The chords that stand for arcs are finer than a thousandth of the bound, which is allowed for.

use super::edges::Edges;
use super::executed::Executed;
use super::feed::{Feed, FeedError, Standing};
use super::report::{BlockError, Place};
use super::sweep::{Death, Match, Sweep};
use super::{Cause, Setup, VerifyError};
use crate::base::Command;
use crate::path::PathItem;

/// Rungs of a ladder: two passes tell the error to a thousandth of the bound.
const RUNGS: usize = 32;
/// Sagitta of chords on arcs, in parts of the distance that is asked for.
const SAGITTA_SHARE: f64 = 1e-3;
/// Work after which distances beyond the bound are no longer looked for: some seconds.
const WORK_MAX: u64 = 1_000_000_000;
/// How many blocks are named.
const WORST_BLOCKS: usize = 10;

/// The contour error.
#[derive(Clone, Debug, PartialEq)]
pub struct Contour {
    /// Whether the bound suffices.
    pub within: bool,
    /// The Fréchet distance, to a thousandth of the bound (beyond it, of itself); around corners
    /// that G64 P lets be cut by more than the path tolerance, less what is more.
    pub max_mm: f64,
    /// Whether `max_mm` is all that could be found out, and the error is greater.
    pub more: bool,
    /// Where a smaller distance fails; none if the least one that was tried suffices.
    pub worst: Option<Place>,
    /// What matching tells; none if no distance suffices that could be tried.
    pub matched: Option<Matched>,
}

/// What matching tick points with the path tells.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Matched {
    /// Root mean square of the tick points' distances.
    pub rms_mm: f64,
    /// The blocks with the greatest distances, greatest first.
    pub worst_blocks: Vec<BlockError>,
    /// Speed along the path against feed.
    pub feed: FeedError,
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

/// Everything a pass reads: streams that begin anew each time.
pub struct Streams<'a, FC, FP> {
    pub setup: &'a Setup<'a>,
    pub commands: FC,
    pub path: FP,
}

impl<FC, FP, C, P, CE, PE> Streams<'_, FC, FP>
where
    FC: Fn() -> Result<C, CE>,
    FP: Fn() -> Result<P, PE>,
    C: Iterator<Item = Result<Command, CE>>,
    P: Iterator<Item = Result<PathItem, PE>>,
    CE: Into<Cause>,
    PE: Into<Cause>,
{
    pub fn commands(&self) -> Result<C, VerifyError> {
        (self.commands)().map_err(|error| VerifyError::Commands(error.into()))
    }

    pub fn path(&self) -> Result<P, VerifyError> {
        (self.path)().map_err(|error| VerifyError::Path(error.into()))
    }

    /// Measures the contour error against a bound.
    pub fn contour(&self, bound_mm: f64) -> Result<Contour, VerifyError> {
        let rungs = std::array::from_fn(|rung| bound_mm * (rung + 1) as f64 / RUNGS as f64);
        let mut found = self.ladder(&rungs, bound_mm, u64::MAX)?;
        let within = found.least_mm.is_some();
        // Each ladder upwards spans four octaves: 0.0137 mm grows to 0.22 mm, 3.5 mm, 56 mm, 900 mm.
        // The wider the distance, the more of the path is in the window at once.
        let mut base_mm = bound_mm;
        while found.least_mm.is_none() && !found.gave_up && base_mm < 1000.0 {
            let rungs = std::array::from_fn(|rung| base_mm * ((rung + 1) as f64 / 8.0).exp2());
            found = found.then(self.ladder(&rungs, base_mm, WORK_MAX)?);
            base_mm = rungs[RUNGS - 1];
        }
        let Some(least_mm) = found.least_mm else {
            let worst = found.death.map(Place::from);
            return Ok(Contour { within, max_mm: found.dead_mm, more: true, worst, matched: None });
        };
        let step_mm = (least_mm - found.dead_mm) / RUNGS as f64;
        let low_mm = found.dead_mm;
        let rungs = std::array::from_fn(|rung| low_mm + step_mm * (rung + 1) as f64);
        let scale_mm = low_mm.max(bound_mm);
        let fine = found.then(self.ladder(&rungs, scale_mm, u64::MAX)?);
        // The last rung is `least_mm` but for rounding.
        let max_mm = fine.least_mm.unwrap_or(least_mm).min(least_mm);
        let matched = self.matched(least_mm, scale_mm)?;
        let worst = fine.death.map(Place::from);
        Ok(Contour { within, max_mm, more: false, worst, matched })
    }

    /// One pass: which of the distances suffice. `scale_mm` is what chords on arcs are measured
    /// by: no distance that suffices for the arcs themselves is refused for their chords.
    fn ladder(
        &self,
        rungs_mm: &[f64; RUNGS],
        scale_mm: f64,
        work_max: u64,
    ) -> Result<Found, VerifyError> {
        let (mut last_tick, mut has_moved) = (0, false);
        let mut executed = Executed::new(self.commands()?, self.setup);
        let start = executed.at();
        let sagitta_mm = scale_mm * SAGITTA_SHARE;
        let mut edges = Edges::new(self.path()?, self.setup.machine, start, sagitta_mm);
        let Some(first) = edges.next()? else { return Ok(Found::default()) };
        let mut sweep = Sweep::new(rungs_mm.map(|rung| rung + sagitta_mm), start, first);
        for point in executed.by_ref() {
            let point = point?;
            last_tick = point.tick;
            if !point.moved {
                continue;
            }
            has_moved = true;
            sweep.advance(point.tick, point.at, || edges.next())?;
            if sweep.is_overfull() && work_max == u64::MAX {
                return Err(VerifyError::TooDense { tick: point.tick });
            }
            let gave_up = sweep.is_overfull() || sweep.work() > work_max;
            if gave_up || sweep.dead() == RUNGS {
                return Ok(Found::of(&sweep, rungs_mm, gave_up));
            }
        }
        if !has_moved {
            // All of the path is held against the one point: it may be shorter than a step.
            sweep.advance(last_tick, start, || edges.next())?;
        }
        sweep.finish(last_tick, || edges.next())?;
        Ok(Found::of(&sweep, rungs_mm, false))
    }

    /// The last pass, with a distance that suffices.
    fn matched(&self, distance_mm: f64, scale_mm: f64) -> Result<Option<Matched>, VerifyError> {
        let mut executed = Executed::new(self.commands()?, self.setup);
        let start = executed.at();
        let sagitta_mm = scale_mm * SAGITTA_SHARE;
        let mut edges = Edges::new(self.path()?, self.setup.machine, start, sagitta_mm);
        let Some(first) = edges.next()? else { return Ok(None) };
        let mut standing =
            Standing { at: start, along_mm: 0.0, feed_mm_s: first.feed_mm_s, may_be_cut: false };
        let mut feed = Feed::new(self.setup, standing);
        let (mut blocks, mut blended) = (Blocks::default(), Corners::default());
        // The chords here may be coarser than those of the ladder that the distance comes from.
        let mut sweep = Sweep::new([distance_mm + 3.0 * sagitta_mm], start, first);
        let mut line = first.line;
        for point in executed.by_ref() {
            let point = point?;
            if point.moved {
                sweep.advance(point.tick, point.at, || edges.next())?;
                let Some(near) = sweep.nearest(standing.along_mm) else { return Ok(None) };
                let at = Place { tick: point.tick, line: near.line };
                blocks.add(near.distance_mm, at);
                blended.add(&near, at);
                let (along_mm, feed_mm_s) = (near.along_mm, near.feed_mm_s);
                let may_be_cut = near.slack_mm > 0.0;
                standing = Standing { at: point.at, along_mm, feed_mm_s, may_be_cut };
                line = near.line;
            } else {
                standing.feed_mm_s = 0.0;
            }
            feed.tick(standing, Place { tick: point.tick, line });
        }
        Ok(Some(Matched {
            rms_mm: blocks.rms_mm(),
            worst_blocks: blocks.worst(),
            feed: feed.end(),
            blended: blended.worst,
        }))
    }
}

/// What ladders have found so far.
#[derive(Debug, Default)]
struct Found {
    /// The greatest distance known not to suffice.
    dead_mm: f64,
    /// Where it fails.
    death: Option<Death>,
    /// The least distance known to suffice.
    least_mm: Option<f64>,
    /// Whether the last ladder was left before its end.
    gave_up: bool,
}

impl Found {
    fn of(sweep: &Sweep<RUNGS>, rungs_mm: &[f64; RUNGS], gave_up: bool) -> Found {
        let dead = sweep.dead();
        Found {
            dead_mm: dead.checked_sub(1).map_or(0.0, |level| rungs_mm[level]),
            death: dead.checked_sub(1).and_then(|level| sweep.death(level)),
            least_mm: rungs_mm.get(dead).copied().filter(|_| !gave_up),
            gave_up,
        }
    }

    /// What is known after one more ladder, all of whose rungs lie above `dead_mm`.
    fn then(self, next: Found) -> Found {
        if next.death.is_some() {
            return next;
        }
        Found { dead_mm: self.dead_mm, death: self.death, ..next }
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
struct Blocks {
    points: u64,
    sum_sq: f64,
    current: Option<BlockError>,
    worst: Vec<BlockError>,
}

impl Blocks {
    fn add(&mut self, max_mm: f64, at: Place) {
        self.points += 1;
        self.sum_sq += max_mm * max_mm;
        match &mut self.current {
            Some(block) if block.line == at.line => {
                if max_mm > block.max_mm {
                    *block = BlockError { line: at.line, tick: at.tick, max_mm };
                }
            }
            _ => {
                self.close();
                self.current = Some(BlockError { line: at.line, tick: at.tick, max_mm });
            }
        }
    }

    fn close(&mut self) {
        let Some(block) = self.current.take() else { return };
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

    fn worst(mut self) -> Vec<BlockError> {
        self.close();
        self.worst
    }
}
