//! How far each block is off: one more pass over path and executed polyline, once it is known how far the two
//! are apart in all.
//!
//! A ladder of distances up to that one is walked with at once (`sweep`). A distance that does not suffice was
//! too small for the block that it was stuck on; it is let go on beyond, from what the next greater one
//! reaches, as soon as the machine is as near to that as it allows.
//!
//! ```text
//!   distances  ──────────────────────────────────  the greatest suffices throughout
//!              ─────────╳  ╭────────────────────   too small for line 7: the block is off by more
//!              ─────────╳      ╭────────────────
//!      blocks  │  6  │  7  │ 8 │       9       │
//! ```
//!
//! Besides, no block is nearer than each of its tick points to the path, and each of its corners to the chords
//! that pass it. As path and chords are straight between them, these tell all, but where one of both turns
//! back: what is lost there is what the ladder is for. The greatest of all is told.

use std::collections::VecDeque;

use super::edges::{Edge, Edges, Vector};
use super::executed::TickPoint;
use super::report::BlockError;
use super::sweep::Sweep;
use super::{Cause, VerifyError};
use crate::path::PathItem;

/// Rungs of the ladder.
const RUNGS: usize = 32;

/// Takes what was found of a block, once it is passed.
pub type TellBlock<'a> = &'a mut dyn FnMut(&BlockError);

/// Takes tick points one by one.
pub struct Blocks<'a> {
    sweep: Sweep<RUNGS>,
    rungs_mm: [f64; RUNGS],
    /// What is allowed where there is no slack.
    bound_mm: f64,
    /// Those that edges in reach belong to, and the number of the first.
    runs: VecDeque<Run>,
    first_run: u64,
    /// The furthest run that each distance has reached.
    fronts: [u64; RUNGS],
    along_mm: f64,
    tell: TellBlock<'a>,
}

/// A block as it is executed once.
#[derive(Clone, Copy, Debug)]
struct Run {
    found: BlockError,
    squares: f64,
    slack_mm: f64,
}

impl Run {
    /// It is at least so far off.
    fn hold(&mut self, distance_mm: f64, tick: u64) {
        if distance_mm > self.found.max_mm {
            (self.found.max_mm, self.found.tick) = (distance_mm, tick);
        }
    }
}

impl<'a> Blocks<'a> {
    /// At the start of both: `max_mm` is how far they are apart in all, `chords_mm` by how much chords may be
    /// off arcs, and `bound_mm` what is allowed where there is no slack.
    pub fn new(
        max_mm: f64,
        chords_mm: f64,
        bound_mm: f64,
        start: Vector,
        first: Edge,
        tell: TellBlock<'a>,
    ) -> Blocks<'a> {
        let rungs_mm = std::array::from_fn(|rung| max_mm * (rung + 1) as f64 / RUNGS as f64);
        let mut sweep = Sweep::new(rungs_mm.map(|rung_mm| rung_mm + chords_mm), start, first);
        sweep.keep_corners();
        let (runs, first_run) = (VecDeque::new(), first.run);
        let fronts = [first_run; RUNGS];
        let mut blocks =
            Blocks { sweep, rungs_mm, bound_mm, runs, first_run, fronts, along_mm: 0.0, tell };
        take_edge(&mut blocks.runs, first_run, &first);
        blocks.stuck(0, 0);
        blocks
    }

    /// Where X, Y and Z stand after the next tick that moves them; or where they stay, if none does.
    pub fn tick<P, E>(
        &mut self,
        TickPoint { tick, at, moved }: TickPoint,
        edges: &mut Edges<'_, P>,
    ) -> Result<(), VerifyError>
    where
        P: Iterator<Item = Result<PathItem, E>>,
        E: Into<Cause>,
    {
        let dead = self.sweep.dead();
        let (runs, first_run) = (&mut self.runs, self.first_run);
        self.sweep.advance(tick, at, || {
            let edge = edges.next()?;
            edge.iter().for_each(|edge| take_edge(runs, first_run, edge));
            Ok::<_, VerifyError>(edge)
        })?;
        self.stuck(dead, tick);
        if let Some(near) = self.sweep.nearest(tick, self.along_mm) {
            self.along_mm = near.along_mm;
            if let Some(run) = self.run(near.run) {
                if run.found.ticks == 0 && run.found.max_mm == 0.0 {
                    run.found.tick = tick;
                }
                run.hold(near.distance_mm, tick);
                run.found.ticks += u64::from(moved);
                run.squares += near.distance_mm * near.distance_mm;
            }
        }
        self.pass(self.sweep.first_run());
        Ok(())
    }

    /// The end of both.
    pub fn end<P, E>(mut self, tick: u64, edges: &mut Edges<'_, P>) -> Result<(), VerifyError>
    where
        P: Iterator<Item = Result<PathItem, E>>,
        E: Into<Cause>,
    {
        let dead = self.sweep.dead();
        self.sweep.finish(tick, || edges.next())?;
        self.stuck(dead, tick);
        self.sweep.drop_all();
        self.pass(u64::MAX);
        Ok(())
    }

    /// Distances from the first that was alive on: those that are dead now were too small where they were.
    fn stuck(&mut self, alive: usize, tick: u64) {
        for rung in alive..self.sweep.dead() {
            let (front, too_small_mm) = (self.fronts[rung], self.rungs_mm[rung]);
            self.run(front).into_iter().for_each(|run| run.hold(too_small_mm, tick));
        }
        self.sweep.revive();
        self.sweep.fronts(&mut self.fronts);
    }

    /// Takes corners that were passed, and tells of the blocks before a run.
    fn pass(&mut self, until: u64) {
        while let Some(corner) = self.sweep.passed_corner() {
            for run in corner.runs {
                self.run(run).into_iter().for_each(|run| run.hold(corner.distance_mm, corner.tick));
            }
        }
        while self.first_run < until
            && let Some(run) = self.runs.pop_front()
        {
            self.first_run += 1;
            self.close(run);
        }
    }

    /// Tells of a block, unless there is none: a path without motion has no line.
    fn close(&mut self, Run { mut found, squares, slack_mm }: Run) {
        let most_mm = self.rungs_mm[RUNGS - 1] + slack_mm;
        found.max_mm = found.max_mm.min(most_mm);
        found.allowed_mm = self.bound_mm + slack_mm;
        let rms_mm = (found.ticks > 0).then(|| (squares / found.ticks as f64).sqrt());
        found.rms_mm = rms_mm.map(|rms_mm| rms_mm.min(found.max_mm));
        if found.line > 0 {
            (self.tell)(&found);
        }
    }

    fn run(&mut self, number: u64) -> Option<&mut Run> {
        self.runs.get_mut(number.checked_sub(self.first_run)? as usize)
    }
}

/// An edge has been read: it belongs to the last run, or begins the next.
fn take_edge(runs: &mut VecDeque<Run>, first_run: u64, edge: &Edge) {
    if edge.run >= first_run + runs.len() as u64 {
        let (line, ticks, tick) = (edge.line, 0, 0);
        let found = BlockError { line, ticks, tick, max_mm: 0.0, allowed_mm: 0.0, rms_mm: None };
        runs.push_back(Run { found, squares: 0.0, slack_mm: 0.0 });
    }
    if let Some(run) = runs.back_mut() {
        run.slack_mm = run.slack_mm.max(edge.slack_mm);
    }
}
