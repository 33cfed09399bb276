//! Time on the machine's one continuous axis, counted in ticks.

/// A moment: so many whole ticks after the start, and a share of the next. Two numbers, so that
/// the share keeps its precision however long the job.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Default)]
pub struct Moment {
    /// Whole ticks since the job began.
    pub tick: u64,
    /// Share of the tick that has begun, from 0 to below 1.
    pub share: f64,
}

/// A moment so close to a tick's boundary lies on it: what rounding makes of whole ticks.
const SNAP_TICKS: f64 = 1e-9;

impl Moment {
    /// The moment so many ticks later.
    #[inline]
    pub fn after(self, ticks: f64) -> Moment {
        let total = self.share + ticks;
        // What a conversion cuts off: `floor` is a call on processors without SSE 4.1.
        let (whole, nearest) = (total as i64, (total + 0.5) as i64);
        let (whole, share) = if (total - nearest as f64).abs() < SNAP_TICKS {
            (nearest, 0.0)
        } else {
            (whole, total - whole as f64)
        };
        Moment { tick: self.tick + whole as u64, share }
    }

    /// The first boundary of a tick that is not before this moment.
    pub fn boundary(self) -> u64 {
        self.tick + u64::from(self.share > 0.0)
    }

    /// Ticks from this moment to a boundary.
    #[inline]
    pub fn ticks_until(self, boundary: u64) -> f64 {
        boundary.wrapping_sub(self.tick) as i64 as f64 - self.share
    }

    /// Ticks from this moment to a later one.
    pub fn ticks_to(self, later: Moment) -> f64 {
        (later.tick - self.tick) as f64 + (later.share - self.share)
    }

    /// The moment of a boundary.
    pub fn at(boundary: u64) -> Moment {
        Moment { tick: boundary, share: 0.0 }
    }
}
