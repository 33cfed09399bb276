//! Who does what a program asks for between two ticks: commands of the machine's profile, or anything
//! else that can spindle, coolant and tools.

use crate::base::{AxisMap, Event};

/// Does events, one at a time, while all axes rest. Nothing is sent until it is done.
pub trait Hands {
    /// Begins an event; the machine stands at `at_steps`.
    ///
    /// # Errors
    /// In words, when it cannot be begun.
    fn begin(&mut self, event: &Event, at_steps: &AxisMap<i64>) -> Result<(), String>;

    /// Whether what has been begun is done.
    ///
    /// # Errors
    /// In words, when it has failed.
    fn is_done(&mut self) -> Result<bool, String>;

    /// Ends what has been begun at once: the operator stops the job, or the bus has failed.
    fn stop(&mut self);
}
