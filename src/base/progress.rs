//! How a long job tells how far it is, without knowing who looks.

/// A listener to the progress of a long job. Every method does nothing unless overridden.
pub trait Progress {
    /// The job begins; it will have done `total` units at its end.
    fn begin(&mut self, _total: u64) {}
    /// So much is done.
    fn set(&mut self, _done: u64, _line: u32) {}
    /// The job has ended, well or not.
    fn end(&mut self) {}
}

/// Nobody looks.
impl Progress for () {}
