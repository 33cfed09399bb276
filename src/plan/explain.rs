//! Decisions → why each block is as fast as it is: the three candidates for the speed at its end
//! (seed 003), the one chosen, and what bound it.
//!
//! ```text
//!   v ┤      F1 .·'             F1  what acceleration from the block's start reaches at its end
//!     │      .·'  '·. F2        F2  what braking over the next block leaves for its start
//!     │   .·'    ●    '·.       F3  what the junction of both lets pass
//!     │.·' block │ next  '·     ●   the least of them: the speed at the end
//!   0 ┼──────────┴─────────── s
//! ```
//!
//! All three keep the feeds and what the axes allow along both blocks. F2 is known once the next
//! block has ended, or earlier, where the way already known is longer than any braking: memory is
//! that of the look-ahead. Nothing is planned here.

use std::collections::VecDeque;

use crate::base::Machine;
use crate::path::{PathItem, Segment};

use super::decisions::Decisions;
use super::piece::{Piece, SPEEDS_EQUAL};
use super::run::{Item, Run};
use super::{Bound, Feed, SeamKind, Seams};

/// The speeds of a block: of a move, or of what is left of it between seams.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockSpeed {
    /// Line of the NC program, from 1.
    pub line: u32,
    /// Length as feed counts it.
    pub length_mm: f64,
    /// The feed, override included; none of a rapid.
    pub feed_mm_s: Option<f64>,
    /// The greatest speed.
    pub top_mm_s: f64,
    /// What set that.
    pub top_bound: Bound,
    /// F1, F2 and F3 at its end; F3 is infinite where the path goes straight on.
    pub candidates_mm_s: [f64; 3],
    /// The speed at its end, the least of them.
    pub end_mm_s: f64,
    /// What set that.
    pub end_bound: Bound,
}

/// Tells the speeds of a path's blocks, in order; errors of the path pass through.
pub fn explain<'a, E, I>(
    path: I,
    machine: &'a Machine,
    feed: Feed,
    seams: &'a Seams,
) -> Explainer<'a, I>
where
    I: Iterator<Item = Result<PathItem, E>>,
{
    let decisions = Decisions::new(path, machine, feed, Some(seams));
    Explainer { decisions, current: None, waiting: None, ready: VecDeque::new() }
}

/// See [`explain`].
#[derive(Debug)]
pub struct Explainer<'a, I> {
    decisions: Decisions<'a, I>,
    /// The block under way.
    current: Option<Block>,
    /// The block before, until its F2 is known, and what is known of the way behind it.
    waiting: Option<(BlockSpeed, Behind)>,
    ready: VecDeque<BlockSpeed>,
}

/// A block under way.
#[derive(Debug)]
struct Block {
    speed: BlockSpeed,
    /// Square of the speed that acceleration from its start has reached.
    reach_sq: f64,
    /// What bounds the speed at the end of its last piece.
    cap_bound: Bound,
    cap_sq: f64,
    /// Acceleration or jerk: what bounds the ramp of its last piece.
    ramp_bound: Bound,
}

/// The pieces behind a block's end.
#[derive(Debug, Default)]
struct Behind {
    pieces: Vec<Piece>,
    /// So many before it is tried again whether they suffice.
    enough: usize,
}

/// Pieces behind a block before it is tried whether they suffice.
const PIECES_MIN: usize = 64;

impl<E, I: Iterator<Item = Result<PathItem, E>>> Iterator for Explainer<'_, I> {
    type Item = Result<BlockSpeed, E>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(block) = self.ready.pop_front() {
                return Some(Ok(block));
            }
            match self.decisions.next() {
                Some(Ok(decided)) => self.take(decided),
                Some(Err(error)) => return Some(Err(error)),
                None => {
                    self.rest(Bound::Stop);
                    return self.ready.pop_front().map(Ok);
                }
            }
        }
    }
}

impl<I> Explainer<'_, I> {
    fn take(&mut self, item: Item) {
        match item {
            Item::Event(_) | Item::Seam(SeamKind::Rest) => self.rest(Bound::Stop),
            Item::Seam(SeamKind::Rapid | SeamKind::Cut) => self.rest(Bound::Seam),
            Item::Run(run) => {
                if run.piece.shares[0] == 0.0 {
                    self.turn(&run.piece, Bound::of_ramp(&run));
                }
                self.begin(&run.segment, run.ends_mm_s[0]);
                self.run(*run);
            }
        }
    }

    /// The block under way ends at rest.
    fn rest(&mut self, bound: Bound) {
        self.settle();
        if let Some(block) = self.current.take() {
            let f1_mm_s = block.reach_sq.sqrt();
            let candidates_mm_s = [f1_mm_s, 0.0, 0.0];
            self.ready.push_back(BlockSpeed { candidates_mm_s, end_bound: bound, ..block.speed });
        }
    }

    /// The block under way ends where the next begins, whose ramp is bound by this.
    fn turn(&mut self, next: &Piece, ramp_bound: Bound) {
        self.settle();
        let Some(block) = self.current.take() else { return };
        let mut speed = block.speed;
        let junction = &next.junction;
        let f3_mm_s = junction.speed_sq_max.sqrt();
        speed.candidates_mm_s = [block.reach_sq.sqrt(), f64::INFINITY, f3_mm_s];
        let end_sq = speed.end_mm_s * speed.end_mm_s;
        let is_at = |limit_sq: f64| end_sq >= limit_sq * (1.0 - SPEEDS_EQUAL);
        speed.end_bound = if is_at(junction.speed_sq_max) {
            junction.bound
        } else if is_at(block.cap_sq) {
            block.cap_bound
        } else if is_at(next.ends_sq_max[0]) {
            next.bounds[0]
        } else {
            // Acceleration, where either ramp reaches its greatest.
            ramp_bound.min(block.ramp_bound)
        };
        self.waiting = Some((speed, Behind { pieces: Vec::new(), enough: PIECES_MIN }));
    }

    /// A block is under way, if none was, from this speed on.
    fn begin(&mut self, segment: &Segment, entry_mm_s: f64) {
        self.current.get_or_insert(Block {
            speed: BlockSpeed {
                line: segment.line,
                length_mm: 0.0,
                feed_mm_s: segment.feed_mm_s,
                top_mm_s: 0.0,
                top_bound: Bound::Stop,
                candidates_mm_s: [0.0; 3],
                end_mm_s: 0.0,
                end_bound: Bound::Stop,
            },
            reach_sq: entry_mm_s * entry_mm_s,
            cap_bound: Bound::Stop,
            cap_sq: 0.0,
            ramp_bound: Bound::Jerk,
        });
    }

    fn run(&mut self, run: Run) {
        let Run { piece, ends_mm_s, .. } = &run;
        let start_limit_sq = piece.junction.speed_sq_max;
        let top_mm_s = run.ramp.peak_mm_s().max(ends_mm_s[0]).max(ends_mm_s[1]);
        let top_bound = Bound::of(&run);
        let Some(block) = &mut self.current else { return };
        block.reach_sq = piece.exit_sq_max(block.reach_sq.min(start_limit_sq), f64::INFINITY);
        (block.cap_sq, block.cap_bound) = (piece.ends_sq_max[1], piece.bounds[1]);
        block.ramp_bound = Bound::of_ramp(&run);
        block.speed.length_mm += piece.length_mm;
        block.speed.end_mm_s = ends_mm_s[1];
        if top_mm_s > block.speed.top_mm_s {
            (block.speed.top_mm_s, block.speed.top_bound) = (top_mm_s, top_bound);
        }
        let Some((_, behind)) = &mut self.waiting else { return };
        let exit_mm_s = ends_mm_s[1];
        behind.pieces.push(run.piece);
        if behind.pieces.len() >= behind.enough {
            behind.enough *= 2;
            self.try_settle(exit_mm_s);
        }
    }

    /// The F2 of the block that waits is known, with all of the block behind it.
    fn settle(&mut self) {
        let exit_mm_s = self.current.as_ref().map_or(0.0, |block| block.speed.end_mm_s);
        let Some((mut speed, behind)) = self.waiting.take() else { return };
        speed.candidates_mm_s[1] = behind.entry_sq(exit_mm_s * exit_mm_s).sqrt();
        self.ready.push_back(speed);
    }

    /// The same, if it does not hang on what else there is of the block behind.
    fn try_settle(&mut self, exit_mm_s: f64) {
        let Some((speed, behind)) = &mut self.waiting else { return };
        let most_sq = behind.entry_sq(f64::INFINITY);
        if behind.entry_sq(exit_mm_s * exit_mm_s) >= most_sq * (1.0 - SPEEDS_EQUAL) {
            speed.candidates_mm_s[1] = most_sq.sqrt();
            self.ready.push_back(*speed);
            self.waiting = None;
        }
    }
}

impl Behind {
    /// Square of the greatest speed at the start from which the speed at the end can be met.
    fn entry_sq(&self, exit_sq: f64) -> f64 {
        let (mut speed_sq, mut limit_sq) = (exit_sq, f64::INFINITY);
        for piece in self.pieces.iter().rev() {
            speed_sq = piece.entry_sq_max(speed_sq.min(limit_sq), f64::INFINITY);
            limit_sq = piece.junction.speed_sq_max;
        }
        speed_sq
    }
}
