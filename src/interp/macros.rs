//! Calls that need no name of a subprogram in their block: the macro of G66, which runs after every
//! move up to G67, and M97, which runs blocks of the same program (Haas).
//!
//! The macro is called where its G66 stands, and in what calls that; not for moves of its own or of
//! subprograms that are called meanwhile.

use std::io;
use std::rc::Rc;

use crate::base::CallSite;
use crate::gcode::{Block, Fault, Label, rules};

use super::findings::Place;
use super::flow::{CALL_DEPTH_MAX, Flow};
use super::motion::Motion;
use super::run::{End, Frame, FrameKind, Run};

/// The macro of G66.
#[derive(Debug)]
pub(super) struct ModalMacro {
    label: Label,
    repeats: u32,
    arguments: Vec<(u32, f64)>,
    /// Calls that were being run where G66 stood.
    depth: usize,
}

impl ModalMacro {
    /// Where a block leads that has made motions, so many calls deep.
    pub fn flow_after(&mut self, flow: Flow, made: &[Motion], depth: usize) -> Flow {
        let has_moved = made.iter().any(|motion| matches!(motion, Motion::Move(_)));
        let is_here = depth <= self.depth;
        self.depth = self.depth.min(depth);
        if flow == Flow::Next && has_moved && is_here { Flow::ModalMacro } else { flow }
    }
}

impl Run<'_> {
    /// G66: the words of its block are the arguments.
    pub(super) fn begin_modal_macro(&mut self, number: u32, repeats: u32) {
        let arguments =
            self.engine.computed().map(super::parameters::arguments).unwrap_or_default();
        let (label, depth) = (Label::Number(number), self.calls.len());
        self.modal_macro = Some(ModalMacro { label, repeats, arguments, depth });
    }

    /// Calls the macro of G66.
    pub(super) fn call_modal_macro(&mut self, block: &Block, place: Place<'_>) -> io::Result<()> {
        let Some(modal) = self.modal_macro.take() else { return Ok(()) };
        let arguments = Some((modal.arguments.as_slice(), true));
        self.call(&modal.label, modal.repeats, arguments, block, place)?;
        self.modal_macro = Some(modal);
        Ok(())
    }

    /// M97: the blocks from an N word on, up to M99.
    pub(super) fn call_blocks(
        &mut self,
        number: u32,
        repeats: u32,
        block: &Block,
        place: Place<'_>,
    ) -> io::Result<()> {
        if repeats == 0 {
            return Ok(());
        }
        let is_kept = matches!(
            self.frames.last().map(|frame| frame.kind),
            Some(FrameKind::Main | FrameKind::Call { .. })
        );
        if !is_kept && !self.keep_main(place.line)? {
            self.end = End::GivenUp;
            return Ok(());
        }
        let Some(frame) = self.frames.last() else { return Ok(()) };
        let (body, found) = (Rc::clone(&frame.body), frame.body.find(number, frame.next));
        let fault = match found {
            None => {
                let message = format!("no block of this program has N{number}");
                Fault::block(&rules::UNKNOWN_LABEL, block, message)
            }
            Some(_) if self.calls.len() >= CALL_DEPTH_MAX => {
                let message = format!("N{number} is called {CALL_DEPTH_MAX} calls deep already");
                Fault::block(&rules::CALL_DEPTH, block, message)
            }
            Some(start) if self.counts_calls(repeats) => {
                self.engine.executor.enter_call();
                let kind = FrameKind::Call { has_scope: false, repeats_left: repeats - 1, start };
                self.frames.push(Frame { body, next: start, kind, repeats: Vec::new() });
                let file = place.file.map(str::to_owned);
                Rc::make_mut(&mut self.calls).push(CallSite { line: place.line, file });
                return Ok(());
            }
            Some(_) => self.too_many_calls(&format!("N{number}"), block),
        };
        self.engine.findings.take_once(&mut vec![fault], place);
        self.engine.executor.forget_position();
        Ok(())
    }
}
