//! Where the contour of a lathe cycle stands: the subprogram Q, or the blocks N P to N Q.
//!
//! The subprogram is called as any other, with its loops and branches, but its blocks become the
//! contour and no motion. Once it has returned, the cycle runs. Blocks of the same program are read
//! in their order; the program goes on behind them.

use std::io;
use std::ops::RangeInclusive;
use std::rc::Rc;

use crate::base::{CallSite, Point};
use crate::gcode::codes::{Stock, Turn};
use crate::gcode::{Block, Fault, Label, rules};

use super::body::Body;
use super::execute::Output;
use super::findings::Place;
use super::flow::Flow;
use super::motion::{Motion, MoveKind};
use super::moves::{BLOCK_MOVES_MAX, refuse_more};
use super::run::{End, Run};
use super::words::whole;

/// A cycle that waits for its contour.
#[derive(Debug)]
pub(super) struct Awaited {
    turn: Turn,
    block: Block,
    line: u32,
    text: Vec<u8>,
    calls: Vec<CallSite>,
    file: Option<String>,
    /// How many calls and loops there were before that of the contour.
    depth: usize,
    /// Where the machine stands meanwhile.
    position_mm: Point,
}

impl Run<'_> {
    /// Calls the contour of a lathe cycle.
    pub(super) fn turn(&mut self, turn: Turn, block: &Block, place: Place<'_>) -> io::Result<()> {
        let block = match self.engine.computed() {
            Some(computed) if !block.is_plain() => computed.clone(),
            _ => block.clone(),
        };
        let Some(word) = block.word(b'Q') else {
            let message = "this lathe cycle has no Q, the subprogram that holds its contour";
            self.engine.faults.push(Fault::block(&rules::MISSING_WORD, &block, message));
            self.engine.report(&place, true);
            return Ok(());
        };
        let number = whole(word, 999_999_999, &mut self.engine.faults);
        self.engine.report(&place, true);
        let Some(number) = number else { return Ok(()) };
        let depth = self.frames.len();
        let position_mm = self.engine.executor.position_mm;
        let contour = self.engine.executor.begin_contour(&block);
        self.call(&Label::Number(number), 1, Some((&[], false)), &block, place)?;
        if self.frames.len() > depth {
            self.engine.contour = Some(contour);
            self.awaited = Some(Awaited {
                turn,
                block,
                line: place.line,
                text: place.text.to_vec(),
                calls: place.calls.to_vec(),
                file: place.file.map(str::to_owned),
                depth,
                position_mm,
            });
        }
        Ok(())
    }

    /// G70 to G73 of a FANUC-style lathe: the blocks from one N word to another are the contour.
    pub(super) fn stock(
        &mut self,
        (stock, first, last): (Stock, u32, u32),
        block: &Block,
        place: Place<'_>,
        motions: &mut Vec<Motion>,
    ) -> io::Result<()> {
        let block = match self.engine.computed() {
            Some(computed) if !block.is_plain() => computed.clone(),
            _ => block.clone(),
        };
        if self.frames.is_empty() && !self.keep_main(place.line)? {
            self.end = End::GivenUp;
            return Ok(());
        }
        let Some(frame) = self.frames.last() else { return Ok(()) };
        let body = Rc::clone(&frame.body);
        let blocks = match contour_blocks(&body, first, last) {
            Ok(blocks) => blocks,
            Err(message) => {
                self.engine.faults.push(Fault::block(&rules::UNKNOWN_LABEL, &block, message));
                self.engine.executor.forget_position();
                self.engine.report(&place, true);
                return Ok(());
            }
        };
        if stock == Stock::Finish {
            self.run_blocks(&body, blocks, &block, place, motions);
        } else {
            let last = *blocks.end();
            self.cut_blocks((stock, &body, blocks), &block, place, motions);
            // A contour that another cycle has cut before lies behind: it is no loop.
            if self.frames.last().is_some_and(|frame| frame.next <= last) {
                self.go_to(last + 1);
            }
        }
        self.engine.report(&place, true);
        Ok(())
    }

    /// Runs the blocks of a contour as they stand, and goes back to where the machine stood.
    fn run_blocks(
        &mut self,
        body: &Body,
        blocks: RangeInclusive<usize>,
        cycle: &Block,
        place: Place<'_>,
        motions: &mut Vec<Motion>,
    ) {
        let start_mm = self.engine.executor.position_mm;
        for at in blocks {
            let Some((block, line, text)) = body.get(at) else { return };
            let here = Place { line, text, ..place };
            if block.statement().is_some()
                || self.engine.execute(block, &here, motions) != Flow::Next
            {
                self.leads_away(block);
            }
            self.engine.report(&here, true);
            if motions.len() >= BLOCK_MOVES_MAX {
                refuse_more(cycle, &mut self.engine.faults);
                break;
            }
        }
        self.engine.end_corner();
        let executor = &mut self.engine.executor;
        let mut faults = std::mem::take(&mut self.engine.faults);
        let mut out = Output { line: place.line, text: place.text, motions, faults: &mut faults };
        if executor.position_mm != start_mm {
            executor.go(cycle, &start_mm, MoveKind::Rapid, None, &mut out);
        }
        self.engine.faults = faults;
    }

    /// Reads blocks as a contour and cuts it.
    fn cut_blocks(
        &mut self,
        (stock, body, blocks): (Stock, &Body, RangeInclusive<usize>),
        cycle: &Block,
        place: Place<'_>,
        motions: &mut Vec<Motion>,
    ) {
        let position_mm = self.engine.executor.position_mm;
        self.engine.contour = Some(self.engine.executor.begin_contour(&Block::default()));
        for at in blocks {
            let Some((block, line, text)) = body.get(at) else { break };
            let here = Place { line, text, ..place };
            if block.statement().is_some()
                || self.engine.execute(block, &here, motions) != Flow::Next
            {
                self.leads_away(block);
            }
            self.engine.report(&here, true);
        }
        self.engine.executor.position_mm = position_mm;
        if let Some(contour) = &mut self.engine.contour {
            contour.end(cycle, &mut self.engine.faults);
        }
        match self.engine.contour.take().filter(|contour| !contour.is_faulty) {
            Some(contour) => self.engine.cut_stock(stock, cycle, &contour, &place, motions),
            None => self.engine.executor.forget_position(),
        }
    }

    fn leads_away(&mut self, block: &Block) {
        let message = "nothing in the contour of a lathe cycle leads elsewhere";
        self.engine.faults.push(Fault::block(&rules::CONTOUR, block, message));
    }

    /// Runs the cycle that has waited for its contour, once that has been read.
    pub(super) fn end_contour(&mut self, motions: &mut Vec<Motion>) {
        let is_over = |awaited: &mut Awaited| self.frames.len() <= awaited.depth;
        let Some(awaited) = self.awaited.take_if(is_over) else { return };
        let Some(mut contour) = self.engine.contour.take() else { return };
        self.engine.executor.position_mm = awaited.position_mm;
        let Awaited { turn, block, line, text, calls, file, .. } = &awaited;
        let place = Place { line: *line, text, calls, file: file.as_deref() };
        contour.end(block, &mut self.engine.faults);
        if contour.is_faulty {
            self.engine.executor.forget_position();
        } else {
            self.engine.turn(*turn, block, &contour, &place, motions);
        }
        self.engine.report(&place, true);
    }
}

/// The blocks from one N word to another, or why there are none.
fn contour_blocks(body: &Body, first: u32, last: u32) -> Result<RangeInclusive<usize>, String> {
    let Some(from) = body.find(first, 0) else {
        return Err(format!("there is no block N{first} around this cycle"));
    };
    match body.find(last, from).filter(|to| *to >= from) {
        Some(to) => Ok(from..=to),
        None => Err(format!("there is no block N{last} behind N{first}")),
    }
}
