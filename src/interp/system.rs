//! What a program can ask the control: parameters that no program sets.

use crate::base::Axis;

use super::execute::Executor;

/// Where the machine stands, axis by axis (RS274/NGC).
const POSITION: std::ops::Range<u32> = 5420..5429;

/// Where the last probe ended, and whether it met something (RS274/NGC; FANUC as G31).
pub(super) const PROBED: std::ops::Range<u32> = 5061..5070;
const HAS_MET: u32 = 5070;

/// What M66 has read.
const INPUT: u32 = 5399;

impl Executor<'_> {
    /// A numbered parameter of the control, if it is supported.
    pub fn parameter(&self, number: u32) -> Option<f64> {
        if POSITION.contains(&number) {
            let axis = Axis::ALL.get((number - POSITION.start) as usize)?;
            return Some(self.position_in_program(*axis));
        }
        if PROBED.contains(&number) {
            return self.signals.probed.get((number - PROBED.start) as usize).copied();
        }
        match number {
            HAS_MET => Some(f64::from(u8::from(self.signals.has_met))),
            INPUT => Some(self.signals.input),
            _ => None,
        }
    }

    /// A named parameter of the control, in lower case with its `_`, if it is supported.
    pub fn named(&self, name: &str) -> Option<f64> {
        let truth = |holds: bool| f64::from(u8::from(holds));
        Some(match name {
            "_metric" => truth(self.mm_per_unit == 1.0),
            "_imperial" => truth(self.mm_per_unit != 1.0),
            "_absolute" => truth(self.absolute),
            "_incremental" => truth(!self.absolute),
            _ => {
                let [b'_', letter] = name.as_bytes() else { return None };
                self.position_in_program(Axis::from_letter(letter.to_ascii_uppercase())?)
            }
        })
    }

    /// The position on an axis as the program would give it.
    pub(super) fn position_in_program(&self, axis: Axis) -> f64 {
        let scale = if axis.is_rotary() { 1.0 } else { self.mm_per_unit };
        self.frames.program(&self.position_mm)[axis] / scale
    }
}
