//! When sync bytes left → how well the host kept its period, and what it made of the line.
//!
//! Only ticks of motion count, and only those that follow another without a dwell or a hold between.
//! Judges nothing: a slid schedule is slow, and not wrong.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// From this lateness on a tick counts as a slide: a tenth of a tick. A host's sleep ends within some
/// 0.1 ms as a rule.
pub const SLIDE_US: u64 = 1000;
/// Leading bits of a lateness that its bucket keeps: sixteen buckets to a doubling, so figures that
/// are read from buckets are right to 1/16.
const BUCKET_BITS: u32 = 5;

/// What is measured while a job runs. Times are microseconds of the bus.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pacing {
    period_us: u64,
    /// Intervals by how much they exceed the period, in buckets named by their lower end.
    late: BTreeMap<u64, u64>,
    least_us: u64,
    greatest_us: u64,
    late_us: u64,
    slides: u64,
    slides_by_answer: u64,
    fill_from_us: u64,
    fill_us: u64,
    fill_wire_ns: u64,
}

/// The figures of a [`Pacing`], as reports and journals have them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PacingFigures {
    /// The period that every interval keeps at least.
    pub period_us: u64,
    /// Intervals between sync bytes that were measured.
    pub intervals: u64,
    /// The least of them; none where nothing was measured.
    pub least_us: Option<u64>,
    /// 99.9 % of them are no longer than this, exact to 1/16 of what it exceeds the period by.
    pub p999_us: Option<u64>,
    /// The greatest of them.
    pub greatest_us: Option<u64>,
    /// By how much all ticks together came late.
    pub late_us: u64,
    /// By how much the latest tick came late.
    pub late_us_max: u64,
    /// Ticks that came [`SLIDE_US`] or more late; the schedule slid by that.
    pub slides: u64,
    /// Those of them whose tick before was answered as late: nodes or the adapter took that time, and
    /// not this host before it sent.
    pub slides_by_answer: u64,
    /// Of the time from a node's fill command to its last answer, the share in which bytes were on
    /// the line.
    pub fill_busy_percent: Option<f64>,
    /// How many intervals exceed the period by so much: the bucket's lower end in µs, and its count.
    pub late_histogram: Vec<(u64, u64)>,
}

impl Pacing {
    /// Nothing measured yet, for a period of the host.
    pub fn new(period_us: u64) -> Self {
        Pacing {
            period_us,
            late: BTreeMap::new(),
            least_us: u64::MAX,
            greatest_us: 0,
            late_us: 0,
            slides: 0,
            slides_by_answer: 0,
            fill_from_us: 0,
            fill_us: 0,
            fill_wire_ns: 0,
        }
    }

    /// A sync byte has left so long after the one before, whose answer did not let it leave earlier
    /// than so long after.
    pub fn tick(&mut self, interval_us: u64, answer_us: u64) {
        let late_us = interval_us.saturating_sub(self.period_us);
        *self.late.entry(bucket(late_us)).or_default() += 1;
        self.least_us = self.least_us.min(interval_us);
        self.greatest_us = self.greatest_us.max(interval_us);
        self.late_us += late_us;
        self.slides += u64::from(late_us >= SLIDE_US);
        self.slides_by_answer += u64::from(answer_us >= self.period_us + SLIDE_US);
    }

    /// The fill command of a node goes out.
    pub fn fill_begins(&mut self, now_us: u64) {
        self.fill_from_us = now_us;
    }

    /// A node has answered that it is full, after bytes that took so long on the line.
    pub fn filled(&mut self, now_us: u64, wire_ns: u64) {
        self.fill_us += now_us.saturating_sub(self.fill_from_us);
        self.fill_wire_ns += wire_ns;
    }

    /// What has been measured so far.
    pub fn figures(&self) -> PacingFigures {
        let intervals = self.late.values().sum();
        let measured = |us: u64| (intervals > 0).then_some(us);
        let busy = self.fill_wire_ns as f64 * 0.1 / self.fill_us as f64;
        PacingFigures {
            period_us: self.period_us,
            intervals,
            least_us: measured(self.least_us),
            p999_us: measured(self.quantile_us(intervals - intervals / 1000)),
            greatest_us: measured(self.greatest_us),
            late_us: self.late_us,
            late_us_max: self.greatest_us.saturating_sub(self.period_us),
            slides: self.slides,
            slides_by_answer: self.slides_by_answer,
            // A terminal has no wire, and a clock that jumps takes no time: never more than all of it.
            fill_busy_percent: (self.fill_us > 0)
                .then_some((busy * 10.0).round().min(1000.0) / 10.0),
            late_histogram: self.late.iter().map(|(from_us, count)| (*from_us, *count)).collect(),
        }
    }

    /// An interval that so many others do not exceed.
    fn quantile_us(&self, rank: u64) -> u64 {
        let mut seen = 0;
        let last = self.late.iter().find(|(_, count)| {
            seen += **count;
            seen >= rank
        });
        let late_us = last.map_or(0, |(from_us, _)| bucket_end(*from_us));
        (self.period_us + late_us).min(self.greatest_us)
    }
}

/// The lower end of the bucket of a lateness.
fn bucket(late_us: u64) -> u64 {
    late_us >> dropped_bits(late_us) << dropped_bits(late_us)
}

/// The greatest lateness in the bucket that begins here.
fn bucket_end(from_us: u64) -> u64 {
    from_us | ((1 << dropped_bits(from_us)) - 1)
}

fn dropped_bits(late_us: u64) -> u32 {
    (u64::BITS - late_us.leading_zeros()).saturating_sub(BUCKET_BITS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_counted_by_their_lateness() {
        let mut pacing = Pacing::new(11_000);
        assert_eq!(pacing.figures().least_us, None);
        (0..998).for_each(|_| pacing.tick(11_010, 10_300));
        pacing.tick(12_100, 10_300);
        pacing.tick(15_000, 14_900);
        let figures = pacing.figures();
        assert_eq!((figures.intervals, figures.least_us), (1000, Some(11_010)));
        assert_eq!((figures.greatest_us, figures.late_us_max), (Some(15_000), 4000));
        assert_eq!((figures.slides, figures.slides_by_answer), (2, 1));
        assert_eq!(figures.late_us, 998 * 10 + 1100 + 4000);
        // The 999th of 1000, whose bucket ends at 1151 µs.
        assert_eq!(figures.p999_us, Some(12_151));
        assert_eq!(figures.late_histogram, [(10, 998), (1088, 1), (3968, 1)]);
    }

    #[test]
    fn buckets_join() {
        for late_us in 0..10_000_u64 {
            let from_us = bucket(late_us);
            assert!((from_us..=bucket_end(from_us)).contains(&late_us), "{late_us}");
            assert!((bucket_end(from_us) - from_us) * 16 <= late_us, "{late_us}");
            let next_us = bucket_end(from_us) + 1;
            assert_eq!(bucket(next_us), next_us);
        }
        assert_eq!(bucket_end(bucket(u64::MAX)), u64::MAX);
    }

    #[test]
    fn the_line_is_busy_while_bytes_are_on_it() {
        let mut pacing = Pacing::new(11_000);
        assert_eq!(pacing.figures().fill_busy_percent, None);
        pacing.fill_begins(5000);
        pacing.filled(405_000, 391_000_000);
        assert_eq!(pacing.figures().fill_busy_percent, Some(97.8));
    }
}
