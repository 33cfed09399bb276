//! How far the executed polyline is from the path, and what the machine does on the way.
//!
//! One pass over both as a rule: it decides whether the bound suffices, holds ticks and events
//! against the machine, and matches every tick point with a point of the path. Matching gives the
//! speed along the path, the other axes' places, the root mean square, the worst blocks, and two
//! distances between which the error lies: none below the first suffices, the second does
//! (`sweep`). Mostly they are the same. Where they are not, or the bound does not suffice, further
//! passes take a ladder of distances each:
//!
//! 1. beyond the bound upwards in powers of two, as far as time allows;
//! 2. between the last distance that failed and the first that held.
//!
//! The chords that stand for arcs are finer than a thousandth of the bound, which is allowed for.

use std::ops::ControlFlow;

use super::blocks::{Blocks, TellBlock};
use super::edges::Edges;
use super::events::Timetable;
use super::executed::{Executed, TickPoint};
use super::limits::{Walk, Walker};
use super::matching::{Matched, Matcher, Matching};
use super::report::Place;
use super::sweep::{Death, Sweep};
use super::{Cause, Setup, VerifyError, tolerance_mm};
use crate::base::Command;
use crate::path::PathItem;

/// Rungs of a ladder: two passes tell the error to a thousandth of the bound.
const RUNGS: usize = 32;
/// To which part of the bound, or of itself beyond that, the error is told.
const RESOLUTION: f64 = 1.0 / (RUNGS * RUNGS) as f64;
/// Sagitta of chords on arcs, in parts of the distance that is asked for.
const SAGITTA_SHARE: f64 = 1e-3;
/// Work after which distances beyond the bound are no longer looked for: some seconds.
const WORK_MAX: u64 = 1_000_000_000;

/// The contour error.
#[derive(Clone, Debug)]
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
    /// What chords on arcs were measured by.
    scale_mm: f64,
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

    /// Measures the contour error against a bound, and holds the job against the machine.
    pub fn hold(&self, bound_mm: f64) -> Result<(Walk, Contour), VerifyError> {
        let mut walker = Walker::new(self.setup);
        let mut timetable = Timetable::new(self.setup.machine, self.setup.with_events);
        let (found, mut edges) = self.follow(bound_mm, bound_mm, |command, edges, is_dead| {
            walker.ramps.corners_in_blocks = edges.has_inner_corners;
            match command {
                Command::Tick(tick) => walker.tick(tick),
                Command::Event(event) => {
                    walker.rest();
                    timetable.event(event, &walker.at_steps, walker.place);
                }
            }
            timetable.compare(&mut edges.passed);
            while is_dead && timetable.waits() && edges.pass_to_event()? {
                timetable.compare(&mut edges.passed);
            }
            Ok(())
        })?;
        // The last edge may have passed events that the job has had before.
        timetable.compare(&mut edges.passed);
        while edges.pass_to_event()? {
            timetable.compare(&mut edges.passed);
        }
        let path_end_steps = edges.at_steps();
        let mut walk = walker.end(path_end_steps);
        walk.checks.extend(timetable.end(&edges.passed));
        let contour = match found {
            Ok(matching) => self.between(matching, bound_mm)?,
            Err(death) => self.beyond(death, bound_mm)?,
        };
        Ok((walk, contour))
    }

    /// The error, where the bound suffices.
    fn between(&self, matching: Matching, bound_mm: f64) -> Result<Contour, VerifyError> {
        let Matching { matched, low_mm, low_at, high_mm } = matching;
        let high_mm = high_mm.min(bound_mm);
        let mut found =
            Found { dead_mm: low_mm, death: Some(low_at), least_mm: Some(high_mm), gave_up: false };
        while let Some(least_mm) = found.least_mm
            && least_mm - found.dead_mm > RESOLUTION * bound_mm
        {
            found = self.finer(found, least_mm, bound_mm)?;
        }
        let max_mm = found.least_mm.unwrap_or(high_mm);
        let worst = found.death.map(Place::from);
        let (matched, scale_mm) = (Some(matched), bound_mm);
        Ok(Contour { within: true, max_mm, more: false, worst, matched, scale_mm })
    }

    /// The error, where the bound does not suffice.
    fn beyond(&self, death: Death, bound_mm: f64) -> Result<Contour, VerifyError> {
        let death = Some(death);
        let mut found = Found { dead_mm: bound_mm, death, least_mm: None, gave_up: false };
        // Each ladder upwards spans four octaves: 0.0137 mm grows to 0.22 mm, 3.5 mm, 56 mm, 900 mm.
        // The wider the distance, the more of the path is in the window at once.
        let mut base_mm = bound_mm;
        while found.least_mm.is_none() && !found.gave_up && base_mm < 1000.0 {
            let rungs = std::array::from_fn(|rung| base_mm * libm::exp2((rung + 1) as f64 / 8.0));
            found = found.then(self.ladder(&rungs, base_mm, WORK_MAX)?);
            base_mm = rungs[RUNGS - 1];
        }
        let Some(least_mm) = found.least_mm else {
            let (max_mm, worst) = (found.dead_mm, found.death.map(Place::from));
            let (matched, scale_mm) = (None, bound_mm);
            return Ok(Contour { within: false, max_mm, more: true, worst, matched, scale_mm });
        };
        let scale_mm = found.dead_mm.max(bound_mm);
        let fine = self.finer(found, least_mm, scale_mm)?;
        let max_mm = fine.least_mm.unwrap_or(least_mm);
        let worst = fine.death.map(Place::from);
        // The chords here may be coarser than those of the ladder that the distance comes from.
        let distance_mm = least_mm + 2.0 * SAGITTA_SHARE * scale_mm;
        let (found, _) = self.follow(distance_mm, scale_mm, |_, _, _| Ok(()))?;
        let matched = found.ok().map(|matching| matching.matched);
        Ok(Contour { within: false, max_mm, more: false, worst, matched, scale_mm })
    }

    /// Tells of each block, in the order of the path: a pass more. Of nothing, where it is not known how far
    /// the two are apart.
    pub fn tell_blocks(&self, contour: &Contour, tell: TellBlock) -> Result<(), VerifyError> {
        if contour.more {
            return Ok(());
        }
        let sagitta_mm = contour.scale_mm * SAGITTA_SHARE;
        let start = Executed::new(self.setup).at();
        let mut edges = Edges::new(self.path()?, self.setup, start, sagitta_mm);
        let Some(first) = edges.next()? else { return Ok(()) };
        let bound_mm = tolerance_mm(self.setup.machine);
        let mut blocks = Blocks::new(contour.max_mm, sagitta_mm, bound_mm, start, first, tell);
        let last_tick = self.each_move(&mut edges, |point, edges| {
            blocks.tick(point, edges)?;
            Ok(ControlFlow::Continue(()))
        })?;
        last_tick.map_or(Ok(()), |tick| blocks.end(tick, &mut edges))
    }

    /// One pass more between the distance that failed and the one that sufficed.
    fn finer(&self, found: Found, least_mm: f64, scale_mm: f64) -> Result<Found, VerifyError> {
        let low_mm = found.dead_mm;
        let step_mm = (least_mm - low_mm) / RUNGS as f64;
        let rungs = std::array::from_fn(|rung| low_mm + step_mm * (rung + 1) as f64);
        let fine = found.then(self.ladder(&rungs, scale_mm, u64::MAX)?);
        // The last rung is `least_mm` but for rounding.
        Ok(Found { least_mm: Some(fine.least_mm.unwrap_or(least_mm).min(least_mm)), ..fine })
    }

    /// One pass: which of the distances suffice. `scale_mm` is what chords on arcs are measured
    /// by: no distance that suffices for the arcs themselves is refused for their chords.
    fn ladder(
        &self,
        rungs_mm: &[f64; RUNGS],
        scale_mm: f64,
        work_max: u64,
    ) -> Result<Found, VerifyError> {
        let start = Executed::new(self.setup).at();
        let sagitta_mm = scale_mm * SAGITTA_SHARE;
        let mut edges = Edges::new(self.path()?, self.setup, start, sagitta_mm);
        let Some(first) = edges.next()? else { return Ok(Found::default()) };
        let mut sweep = Sweep::new(rungs_mm.map(|rung| rung + sagitta_mm), start, first);
        let mut gave_up = false;
        let last_tick = self.each_move(&mut edges, |point, edges| {
            sweep.advance(point.tick, point.at, || edges.next())?;
            if sweep.is_overfull() && work_max == u64::MAX {
                return Err(VerifyError::TooDense { tick: point.tick });
            }
            gave_up = sweep.is_overfull() || sweep.work() > work_max;
            let is_over = gave_up || sweep.dead() == RUNGS;
            Ok(if is_over { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
        })?;
        if let Some(tick) = last_tick {
            sweep.finish(tick, || edges.next())?;
        }
        Ok(Found::of(&sweep, rungs_mm, gave_up))
    }

    /// Takes every tick point where X, Y or Z have moved, until one breaks it off; where none has, the start, for
    /// all of a path may be shorter than a step. Gives the last tick; none where it was broken off.
    fn each_move(
        &self,
        edges: &mut Edges<'_, P>,
        mut take: impl FnMut(TickPoint, &mut Edges<'_, P>) -> Result<ControlFlow<()>, VerifyError>,
    ) -> Result<Option<u64>, VerifyError> {
        let mut executed = Executed::new(self.setup);
        let mut last = TickPoint { tick: 0, at: executed.at(), moved: false };
        let mut has_moved = false;
        for command in self.commands()? {
            edges.passed.clear();
            let command = command.map_err(|error| VerifyError::Commands(error.into()))?;
            let Command::Tick(tick) = command else { continue };
            last = executed.tick(&tick);
            has_moved |= last.moved;
            if last.moved && take(last, edges)?.is_break() {
                return Ok(None);
            }
        }
        let is_over = !has_moved && take(last, edges)?.is_break();
        Ok((!is_over).then_some(last.tick))
    }

    /// How far each tick point lies from where it is matched on the path, as far as a distance suffices;
    /// and whether it does to the end.
    pub fn distances(
        &self,
        distance_mm: f64,
        mut take: impl FnMut(u64, f64),
    ) -> Result<bool, VerifyError> {
        let sagitta_mm = tolerance_mm(self.setup.machine) * SAGITTA_SHARE;
        let start = Executed::new(self.setup).at();
        let mut edges = Edges::new(self.path()?, self.setup, start, sagitta_mm);
        let Some(first) = edges.next()? else { return Ok(true) };
        let mut matcher = Matcher::new(self.setup, distance_mm, first);
        let mut number = 0;
        for command in self.commands()? {
            let command = command.map_err(|error| VerifyError::Commands(error.into()))?;
            if let Command::Tick(tick) = command {
                matcher.tick(&tick, &mut edges)?;
                if matcher.is_dead() {
                    return Ok(false);
                }
                take(number, matcher.distance_mm());
                number += 1;
            }
        }
        Ok(true)
    }

    /// One pass with one distance, as far as that suffices. `each` sees every command, what of the
    /// path has been passed, and whether the distance has been found too small.
    fn follow(
        &self,
        distance_mm: f64,
        scale_mm: f64,
        mut each: impl FnMut(&Command, &mut Edges<'_, P>, bool) -> Result<(), VerifyError>,
    ) -> Result<(Result<Matching, Death>, Edges<'_, P>), VerifyError> {
        let sagitta_mm = scale_mm * SAGITTA_SHARE;
        let start = Executed::new(self.setup).at();
        let mut edges = Edges::new(self.path()?, self.setup, start, sagitta_mm);
        let Some(first) = edges.next()? else {
            return Ok((Err(Death::default()), edges));
        };
        let mut matcher = Matcher::new(self.setup, distance_mm + sagitta_mm, first);
        for command in self.commands()? {
            match command {
                Err(error) => return Err(VerifyError::Commands(error.into())),
                Ok(ref command) => {
                    each(command, &mut edges, matcher.is_dead())?;
                    if let Command::Tick(tick) = command {
                        matcher.tick(tick, &mut edges)?;
                    }
                }
            }
        }
        let mut found = matcher.end(&mut edges)?;
        if let Ok(Matching { matched: Matched { blended: Some(error), .. }, .. }) = &mut found {
            // From the chords, which are off an arc by as much.
            error.distance_mm = (error.distance_mm - sagitta_mm).max(0.0);
        }
        Ok((found, edges))
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
