//! Path → pieces with their speeds: blends, the cutter and the look-ahead behind them, item by item.

use crate::base::Machine;
use crate::path::PathItem;

use super::blend::{Blended, blended};
use super::lookahead::{Decided, LookAhead};
use super::source::Cutter;
use super::{Feed, Seams};

/// The decisions of the look-ahead over a path, in order; errors of the path pass through.
#[derive(Debug)]
pub struct Decisions<'a, I> {
    path: Blended<'a, I>,
    cutter: Cutter<'a>,
    ahead: LookAhead<'a>,
    ended: bool,
}

impl<'a, I> Decisions<'a, I> {
    /// From rest, with stops at the seams.
    pub fn new<E>(path: I, machine: &'a Machine, feed: Feed, seams: &'a Seams) -> Decisions<'a, I>
    where
        I: Iterator<Item = Result<PathItem, E>>,
    {
        Decisions {
            path: blended(path, machine, feed),
            cutter: Cutter::new(machine, feed, seams),
            ahead: LookAhead::new(machine, feed),
            ended: false,
        }
    }
}

impl<E, I: Iterator<Item = Result<PathItem, E>>> Iterator for Decisions<'_, I> {
    type Item = Result<Decided, E>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(decided) = self.ahead.pop() {
                return Some(Ok(decided));
            }
            if let Some(item) = self.cutter.pop() {
                self.ahead.push(item);
                continue;
            }
            if self.ended {
                return None;
            }
            match self.path.next() {
                Some(Ok(item)) => self.cutter.push(item),
                Some(Err(error)) => return Some(Err(error)),
                None => {
                    self.ended = true;
                    self.ahead.finish();
                }
            }
        }
    }
}
