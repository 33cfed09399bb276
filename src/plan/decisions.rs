//! Path → pieces with their speeds: blends, the cutter and the look-ahead behind them, item by item.

use crate::base::Machine;
use crate::path::PathItem;

use super::blend::{Blended, blended};
use super::limits::Limits;
use super::lookahead::LookAhead;
use super::run::{Item, Run};
use super::source::Cutter;
use super::{Feed, Seams};

/// The decisions of the look-ahead over a path, in order; errors of the path pass through.
#[derive(Debug)]
pub struct Decisions<'a, I> {
    path: Blended<I>,
    cutter: Cutter<'a>,
    ahead: LookAhead,
    ended: bool,
}

impl<'a, I> Decisions<'a, I> {
    /// From rest, with stops at the seams; without any while they are to be found.
    pub fn new<E>(
        path: I,
        machine: &'a Machine,
        feed: Feed,
        seams: Option<&'a Seams>,
    ) -> Decisions<'a, I>
    where
        I: Iterator<Item = Result<PathItem, E>>,
    {
        let limits = Limits::new(machine);
        Decisions {
            path: blended(path, &limits, feed),
            ahead: LookAhead::new(&limits, feed),
            cutter: Cutter::new(limits, feed, seams),
            ended: false,
        }
    }
}

impl<E, I: Iterator<Item = Result<PathItem, E>>> Decisions<'_, I> {
    /// Takes a run back that nobody needs any more.
    #[inline]
    pub fn reuse(&mut self, run: Box<Run>) {
        self.ahead.reuse(run);
    }

    /// Lets the look-ahead know more, if there is more to know.
    #[inline]
    fn advance(&mut self) -> Option<Result<(), E>> {
        if self.cutter.cut(&mut self.ahead) {
            return Some(Ok(()));
        }
        if self.ended {
            return None;
        }
        match self.path.next() {
            Some(Ok(PathItem::Segment(segment))) => self.cutter.segment(segment, &mut self.ahead),
            Some(Ok(PathItem::Event(event))) => self.cutter.event(event, &mut self.ahead),
            Some(Err(error)) => return Some(Err(error)),
            None if self.cutter.finish(&mut self.ahead) => {}
            None => {
                self.ended = true;
                self.ahead.finish();
            }
        }
        Some(Ok(()))
    }
}

impl<E, I: Iterator<Item = Result<PathItem, E>>> Iterator for Decisions<'_, I> {
    type Item = Result<Item, E>;

    #[inline]
    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(item) = self.ahead.pop() {
                return Some(Ok(item));
            }
            if let Err(error) = self.advance()? {
                return Some(Err(error));
            }
        }
    }
}
