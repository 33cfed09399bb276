//! What a master talks over, and the pacing of ports by a clock.

use std::io;
use std::time::Duration;

use crate::wire_io::clock::{Clock, Speed};
use crate::wire_io::priority::Priority;

/// Sleeping is this inexact; the rest of a wait is spent awake.
const SPIN: Duration = Duration::from_micros(200);
/// Under [`Speed::Max`], in which other ends need our time to read what was written: shortest wait
/// for an answer.
const LISTEN: Duration = Duration::from_millis(20);
/// Longest sleep, so that an operator's stop is seen.
const SLEEP_MAX: Duration = Duration::from_millis(50);

/// A link that failed.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// The other end is gone.
    #[error("the port is gone: closed by its other end, or pulled out")]
    Closed,
    /// Nothing can be written: the other end does not read, or the adapter hangs.
    #[error("the port takes no more bytes: its other end does not read them")]
    Stalled,
    /// Anything else.
    #[error("the port failed: {0}")]
    Io(#[from] io::Error),
}

/// Bytes both ways, and the time of the bus.
pub trait Link {
    /// What time it is on the bus, in microseconds.
    fn now_us(&mut self) -> u64;

    /// Hands over a few bytes.
    ///
    /// # Errors
    /// When the link fails; some bytes may be out.
    fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError>;

    /// Adds bytes that come, and waits for them until `until_us`; it may return before with
    /// nothing. `answer_from_us` says from when on an answer may come, if one may.
    ///
    /// # Errors
    /// When the link fails.
    fn receive(
        &mut self,
        bytes: &mut Vec<u8>,
        until_us: u64,
        answer_from_us: Option<u64>,
    ) -> Result<(), LinkError>;

    /// Lets our time pass while something else is under way, and adds bytes that come in it. On a
    /// simulated bus no time passes then, so that runs are repeatable, and nothing comes.
    ///
    /// # Errors
    /// When the link fails.
    fn idle(&mut self, _bytes: &mut Vec<u8>, wait: Duration) -> Result<(), LinkError> {
        std::thread::sleep(wait);
        Ok(())
    }

    /// From here on, or no longer, the thread must not be held up by others.
    fn urgent(&mut self, _urgent: bool) {}

    /// Lets bytes that are still on their way arrive.
    fn drain(&mut self) {}
}

/// A byte stream that can be waited on.
pub trait Port {
    /// Writes all bytes.
    ///
    /// # Errors
    /// When the port fails or takes nothing for a second.
    fn write(&mut self, bytes: &[u8]) -> Result<(), LinkError>;

    /// Reads what is there, or waits for it; 0 when nothing came in time or a signal did.
    ///
    /// # Errors
    /// When the port fails or is closed.
    fn read(&mut self, bytes: &mut [u8], wait: Duration) -> Result<usize, LinkError>;

    /// Waits, not for long, until all bytes written are out.
    fn drain(&mut self);
}

/// A port whose bus runs by a clock.
#[derive(Debug)]
pub struct Paced<P> {
    port: P,
    clock: Clock,
    priority: Priority,
}

impl<P: Port> Paced<P> {
    /// Paces a port.
    pub fn new(port: P, speed: Speed) -> Self {
        Paced { port, clock: Clock::new(speed), priority: Priority::default() }
    }

    /// Whether the system lets the thread that paces go before others.
    pub fn priority(&self) -> Priority {
        self.priority
    }

    fn read(&mut self, bytes: &mut Vec<u8>, wait: Duration) -> Result<usize, LinkError> {
        let mut piece = [0; 256];
        let count = self.port.read(&mut piece, wait)?;
        bytes.extend_from_slice(piece.get(..count).unwrap_or_default());
        Ok(count)
    }
}

impl<P: Port> Link for Paced<P> {
    fn now_us(&mut self) -> u64 {
        self.clock.now_us()
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        self.port.write(bytes)
    }

    fn receive(
        &mut self,
        bytes: &mut Vec<u8>,
        until_us: u64,
        answer_from_us: Option<u64>,
    ) -> Result<(), LinkError> {
        if self.clock.speed() == Speed::Max {
            let wait = match answer_from_us {
                Some(from_us) => {
                    self.clock.jump_to(from_us);
                    Duration::from_micros(until_us.saturating_sub(from_us)).max(LISTEN)
                }
                None => Duration::ZERO,
            };
            if self.read(bytes, wait)? == 0 {
                self.clock.jump_to(until_us);
            }
            return Ok(());
        }
        let rest = self.clock.until(until_us);
        if rest > SPIN {
            self.read(bytes, (rest - SPIN).min(SLEEP_MAX))?;
            return Ok(());
        }
        while self.clock.now_us() < until_us {
            std::hint::spin_loop();
        }
        self.read(bytes, Duration::ZERO)?;
        Ok(())
    }

    fn idle(&mut self, bytes: &mut Vec<u8>, wait: Duration) -> Result<(), LinkError> {
        self.read(bytes, wait).map(drop)
    }

    fn urgent(&mut self, urgent: bool) {
        match self.clock.speed() {
            // It never waits, and would let nobody else run.
            Speed::Max => {}
            Speed::Times(_) if urgent => self.priority.raise(),
            Speed::Times(_) => self.priority.lower(),
        }
    }

    fn drain(&mut self) {
        self.port.drain();
    }
}
