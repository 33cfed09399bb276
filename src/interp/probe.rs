//! Inputs: probing (G38.2 to G38.5), skipping (G31) and waiting (M66).
//!
//! The nodes of the bus have outputs only, so all of these are refused, but on profiles that say
//! `assumed_inputs`: there a probe touches at the end of its move and a wait ends at once, so that
//! programs can be checked. What a program makes of the results is then that of this assumption.

use crate::base::axis::AXES;
use crate::base::{Axis, EventKind, Point};
use crate::gcode::codes::Follow;
use crate::gcode::{Block, Fault, rules};

use super::execute::{Asked, Executor, Output};
use super::motion::{Bound, Corner, Motion, MoveKind};
use super::words::{machine_coordinates_alone, whole};

/// Inputs of a kind, as RS274/NGC bounds them.
const INPUT_MAX: u32 = 63;

/// What inputs and the spindle's turns have told, and whether a lack of them has been reported.
#[derive(Clone, Debug, Default)]
pub(super) struct Signals {
    /// Whether a lack of inputs has been reported.
    inputs_missed: bool,
    /// Whether a lack of an encoder has been reported.
    pub sync_missed: bool,
    /// Where the last probe ended, as the program calls it, and whether it met something: `#5061`
    /// to `#5070`.
    pub probed: [f64; AXES + 1],
    /// The same in machine coordinates.
    ended_mm: Option<Point>,
    /// What the last M66 has read: `#5399`.
    pub input: f64,
}

impl Executor<'_> {
    /// A move that follows the spindle or an input, to a place in machine coordinates.
    pub(super) fn follow(
        &mut self,
        follow: Follow,
        block: &Block,
        to: &Point,
        asked: Asked,
        out: &mut Output<'_>,
    ) {
        if asked.machine_coordinates {
            machine_coordinates_alone(block, out.faults);
            return;
        }
        if self.compensation.is_some() {
            let message = "moves in step with the spindle, and probing, have no place in cutter \
                           compensation";
            let fault = Fault::block(&rules::COMPENSATION_MODE, block, message);
            out.faults.push(fault.help("end compensation by G40 and a straight move before"));
            return;
        }
        match follow {
            Follow::Thread | Follow::Tap => self.thread(follow, block, to, out),
            Follow::Skip | Follow::Probe(_) => self.probe(follow, block, to, out),
        }
    }

    /// G38.2 to G38.5 and G31.
    fn probe(&mut self, follow: Follow, block: &Block, to: &Point, out: &mut Output<'_>) {
        let name = match follow {
            Follow::Probe(kind) => format!("G38.{kind}"),
            _ => "G31".to_owned(),
        };
        if !self.has_inputs(&name, block, out.faults) || !self.has_feed(block, out.faults) {
            self.position_mm = *to;
            return;
        }
        if *to == self.position_mm && self.signals.ended_mm == Some(*to) {
            // The assumption has led it here: a real probe would have stopped before.
            return;
        }
        if *to == self.position_mm {
            let message = format!("{name}: the probe stands at the end of its move already");
            let fault = Fault::block(&rules::BAD_VALUE, block, message);
            out.faults.push(fault.help("give it a way to go, beyond where it is to touch"));
            return;
        }
        let first = out.motions.len();
        self.go(block, to, MoveKind::Line { feed_mm_min: 0.0 }, Some(Corner::Stop), out);
        if let Some(Motion::Move(step)) = out.motions.get_mut(first) {
            step.bound = Bound::Input;
        }
        for axis in Axis::ALL {
            self.signals.probed[axis as usize] = self.position_in_program(axis);
        }
        self.signals.probed[AXES] = 1.0;
        self.signals.ended_mm = Some(*to);
    }

    /// M66: the value read is 1 where the wait is for a rise or a high level, else 0.
    pub(super) fn wait_for_input(&mut self, block: &Block, out: &mut Output<'_>) {
        let (digital, analog) = (block.word(b'P'), block.word(b'E'));
        let word = match (digital, analog) {
            (Some(word), None) | (None, Some(word)) => word,
            (Some(_), Some(word)) => {
                let message = "M66 waits for one input: P is a digital one, E an analog one";
                out.faults.push(Fault::word(&rules::BAD_VALUE, word, message));
                return;
            }
            (None, None) => {
                let message = "M66 has neither P nor E, the number of the input";
                out.faults.push(Fault::block(&rules::MISSING_WORD, block, message));
                return;
            }
        };
        let number = whole(word, INPUT_MAX, out.faults);
        let kind = match block.word(b'L') {
            Some(word) => whole(word, 4, out.faults),
            None => Some(0),
        };
        let (Some(number), Some(kind)) = (number, kind) else { return };
        if kind > 0 && analog.is_some() {
            let message = "an analog input is read at once: L is 0";
            out.faults.push(Fault::block(&rules::BAD_VALUE, block, message));
            return;
        }
        let seconds = block.word(b'Q').map_or(0.0, |word| word.value);
        if kind > 0 && seconds <= 0.0 {
            let message = "M66 has no Q above 0, the seconds to wait at most";
            out.faults.push(Fault::block(&rules::MISSING_WORD, block, message));
            return;
        }
        if !self.has_inputs("M66", block, out.faults) {
            return;
        }
        self.signals.input = f64::from(u8::from(matches!(kind, 1 | 3)));
        let analog = analog.is_some();
        out.event(EventKind::WaitInput { number, analog, kind, seconds });
    }

    /// Whether inputs are taken for granted. The first code that needs one is reported.
    fn has_inputs(&mut self, name: &str, block: &Block, faults: &mut Vec<Fault>) -> bool {
        if !self.machine.assumed_inputs && !self.signals.inputs_missed {
            self.signals.inputs_missed = true;
            let message = format!(
                "{name} needs an input, and the nodes of the machine {} have none",
                self.machine.id
            );
            let fault = Fault::block(&rules::NO_INPUTS, block, message);
            faults.push(fault.help(
                "measure by hand; to check the program all the same, take a profile with \
                 assumed_inputs = true",
            ));
        }
        self.machine.assumed_inputs
    }
}
