//! The monotonic clock → the bus's time in microseconds.

use std::str::FromStr;
use std::time::{Duration, Instant};

/// How fast the bus's time runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Speed {
    /// So many times as fast as ours; 1 on real machines.
    Times(f64),
    /// Never waits for time to pass, only for answers.
    Max,
}

impl Speed {
    /// The factor by which times that stay ours grow in the bus's time.
    pub fn factor(self) -> f64 {
        match self {
            Speed::Times(factor) => factor,
            Speed::Max => 1.0,
        }
    }
}

impl FromStr for Speed {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "max" {
            return Ok(Speed::Max);
        }
        match text.parse() {
            Ok(factor) if (0.01..=10_000.0).contains(&factor) => Ok(Speed::Times(factor)),
            _ => Err("expected a number from 0.01 to 10000, or max".to_owned()),
        }
    }
}

/// The bus's time, from 0 on. It never goes back.
#[derive(Clone, Debug)]
pub struct Clock {
    speed: Speed,
    start: Instant,
    /// Under [`Speed::Max`]: what time it is.
    jumped_us: u64,
}

impl Clock {
    /// A clock that starts now.
    pub fn new(speed: Speed) -> Self {
        Clock { speed, start: Instant::now(), jumped_us: 0 }
    }

    /// How fast it runs.
    pub fn speed(&self) -> Speed {
        self.speed
    }

    /// What time it is on the bus.
    pub fn now_us(&self) -> u64 {
        match self.speed {
            Speed::Times(factor) => (self.start.elapsed().as_secs_f64() * 1e6 * factor) as u64,
            Speed::Max => self.jumped_us,
        }
    }

    /// How long it takes, in our time, until it is `bus_us` on the bus.
    pub fn until(&self, bus_us: u64) -> Duration {
        let rest_us = bus_us.saturating_sub(self.now_us());
        match self.speed {
            Speed::Times(factor) => Duration::from_secs_f64(rest_us as f64 * 1e-6 / factor),
            Speed::Max => Duration::ZERO,
        }
    }

    /// Under [`Speed::Max`] lets time pass at once; otherwise time passes by itself.
    pub fn jump_to(&mut self, bus_us: u64) {
        self.jumped_us = self.jumped_us.max(bus_us);
    }
}
