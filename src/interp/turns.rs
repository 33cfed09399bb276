//! Where the contour of a lathe cycle stands: the subprogram Q.
//!
//! It is called as any other, with its loops and branches, but its blocks become the contour and
//! no motion. Once it has returned, the cycle runs.

use std::io;

use crate::base::Point;
use crate::gcode::codes::Turn;
use crate::gcode::{Block, Fault, Label, rules};

use super::findings::Place;
use super::motion::Motion;
use super::run::Run;
use super::words::whole;

/// A cycle that waits for its contour.
#[derive(Debug)]
pub(super) struct Awaited {
    turn: Turn,
    block: Block,
    line: u32,
    text: Vec<u8>,
    calls: Vec<u32>,
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
            self.engine.report(place, true);
            return Ok(());
        };
        let number = whole(word, 999_999_999, &mut self.engine.faults);
        self.engine.report(place, true);
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

    /// Runs the cycle that has waited for its contour, once that has been read.
    pub(super) fn end_contour(&mut self, motions: &mut Vec<Motion>) {
        let is_over = |awaited: &mut Awaited| self.frames.len() <= awaited.depth;
        let Some(awaited) = self.awaited.take_if(is_over) else { return };
        let Some(contour) = self.engine.contour.take() else { return };
        self.engine.executor.position_mm = awaited.position_mm;
        if contour.is_faulty {
            self.engine.executor.forget_position();
            return;
        }
        let Awaited { turn, block, line, text, calls, file, .. } = &awaited;
        let place = Place { line: *line, text, calls, file: file.as_deref() };
        self.engine.turn(*turn, block, &contour, place, motions);
        self.engine.report(place, true);
    }
}
