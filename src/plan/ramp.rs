//! The speed along one piece of the path.
//!
//! ```text
//! speed_mm_s ┤       ___________
//!            │      /           \       slope: the accelerations of the legs
//!     entry  │_____/             \      area:  length_mm
//!            │                    \___ exit
//!          0 ┼─────┴───────────┴───┴── t
//!             leg 0    leg 1    leg 2
//! ```
//!
//! With limits on jerk the legs are those of [`super::jerk`]: as many as it takes, in each of which
//! the acceleration changes evenly.

use super::extreme::{greater, lesser};
use super::jerk::{State, Stretch};

/// Distance along a piece over time: legs of constant jerk, of which that of a trapezoid is zero.
#[derive(Clone, Debug, PartialEq)]
pub struct Ramp {
    length_mm: f64,
    duration_s: f64,
    peak_mm_s: f64,
    legs: Legs,
}

/// The legs of a ramp, in order.
#[derive(Clone, Debug, PartialEq)]
enum Legs {
    /// Those of the drawing, any of which may take no time.
    Trapezoid {
        entry_mm_s: f64,
        /// Of the first leg, and how much the last one brakes.
        accel_mm_s2: f64,
        braking_mm_s2: f64,
        /// When and where the second leg starts, and the third.
        cruise: (f64, f64),
        down: (f64, f64),
    },
    Many(Box<[Start]>),
}

/// From here on, one jerk.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Start {
    start_s: f64,
    start_mm: f64,
    speed_mm_s: f64,
    accel_mm_s2: f64,
    jerk_mm_s3: f64,
}

/// A part of a ramp with one jerk.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Leg {
    start_s: f64,
    start_mm: f64,
    speed_mm_s: f64,
    half_accel_mm_s2: f64,
    sixth_jerk_mm_s3: f64,
    /// When it ends, counted from the start of the ramp.
    pub end_s: f64,
}

impl Leg {
    /// How far along the ramp at a time after the ramp's start that lies in the leg.
    #[inline]
    pub fn distance_mm(&self, time_s: f64) -> f64 {
        let since_s = (time_s - self.start_s).max(0.0);
        let gain_mm_s = (self.half_accel_mm_s2 + self.sixth_jerk_mm_s3 * since_s) * since_s;
        self.start_mm + (self.speed_mm_s + gain_mm_s) * since_s
    }
}

impl Ramp {
    /// Of no length.
    pub const NONE: Ramp = Ramp {
        length_mm: 0.0,
        duration_s: 0.0,
        peak_mm_s: 0.0,
        legs: Legs::Trapezoid {
            entry_mm_s: 0.0,
            accel_mm_s2: 0.0,
            braking_mm_s2: 0.0,
            cruise: (0.0, 0.0),
            down: (0.0, 0.0),
        },
    };

    /// From one speed to another over a length, as fast as the square of a greatest speed and an acceleration
    /// allow: up, cruise, down. The ends have to be within reach of each other.
    #[inline]
    pub fn between(
        length_mm: f64,
        ends_mm_s: [f64; 2],
        speed_sq_max: f64,
        accel_mm_s2: f64,
    ) -> Ramp {
        let [entry_sq, exit_sq] = ends_mm_s.map(|end_mm_s| end_mm_s * end_mm_s);
        // Up and down take all of the length at this peak: v² - v₀² + v² - v₁² = 2·a·l.
        let peak_sq = 0.5 * (entry_sq + exit_sq) + accel_mm_s2 * length_mm;
        Ramp::peaking(length_mm, ends_mm_s, lesser(peak_sq, speed_sq_max), [accel_mm_s2; 2])
    }

    /// The same with an acceleration in the first half and another braking in the second, of which the greater is
    /// not asked for in the half of the lesser. None where it would be, or where there is no peak above the ends.
    pub fn of_halves(
        length_mm: f64,
        ends_mm_s: [f64; 2],
        speed_sq_max: f64,
        [up_mm_s2, down_mm_s2]: [f64; 2],
    ) -> Option<Ramp> {
        let [entry_sq, exit_sq] = ends_mm_s.map(|end_mm_s| end_mm_s * end_mm_s);
        if lesser(up_mm_s2, down_mm_s2) <= 0.0 {
            return None;
        }
        // (v² - v₀²) / a + (v² - v₁²) / b = 2·l.
        let gained = 2.0 * up_mm_s2 * down_mm_s2 * length_mm;
        let peak_sq =
            (entry_sq * down_mm_s2 + exit_sq * up_mm_s2 + gained) / (up_mm_s2 + down_mm_s2);
        let is_peak = peak_sq > greater(entry_sq, exit_sq);
        let peak_sq = lesser(peak_sq, speed_sq_max);
        let (end_sq, most_mm_s2) =
            if up_mm_s2 > down_mm_s2 { (entry_sq, up_mm_s2) } else { (exit_sq, down_mm_s2) };
        let is_in_half = peak_sq - end_sq <= most_mm_s2 * length_mm;
        let ramp = || Ramp::peaking(length_mm, ends_mm_s, peak_sq, [up_mm_s2, down_mm_s2]);
        (is_peak && is_in_half).then(ramp)
    }

    /// The same with the square of the speed of the cruise.
    #[inline]
    fn peaking(
        length_mm: f64,
        [entry_mm_s, exit_mm_s]: [f64; 2],
        peak_sq: f64,
        [accel_mm_s2, braking_mm_s2]: [f64; 2],
    ) -> Ramp {
        let peak_mm_s = greater(greater(peak_sq.sqrt(), entry_mm_s), exit_mm_s);
        let up_s = (peak_mm_s - entry_mm_s) * (1.0 / accel_mm_s2);
        let down_s = (peak_mm_s - exit_mm_s) * (1.0 / braking_mm_s2);
        let [up_mm, down_mm] =
            [0.5 * (entry_mm_s + peak_mm_s) * up_s, 0.5 * (peak_mm_s + exit_mm_s) * down_s];
        let cruise_mm = greater(length_mm - up_mm - down_mm, 0.0);
        let down_start_s = up_s + cruise_mm / peak_mm_s;
        Ramp {
            length_mm,
            duration_s: down_start_s + down_s,
            peak_mm_s,
            legs: Legs::Trapezoid {
                entry_mm_s,
                accel_mm_s2,
                braking_mm_s2,
                cruise: (up_s, up_mm),
                down: (down_start_s, up_mm + cruise_mm),
            },
        }
    }

    /// From one speed to another with one acceleration. They are not both zero.
    #[inline]
    pub fn steady(length_mm: f64, [entry_mm_s, exit_mm_s]: [f64; 2]) -> Ramp {
        let duration_s = 2.0 * length_mm / (entry_mm_s + exit_mm_s);
        let accel_mm_s2 = (exit_mm_s - entry_mm_s) / duration_s;
        let end = (duration_s, length_mm);
        Ramp {
            length_mm,
            duration_s,
            peak_mm_s: greater(entry_mm_s, exit_mm_s),
            legs: Legs::Trapezoid {
                entry_mm_s,
                accel_mm_s2,
                braking_mm_s2: 0.0,
                cruise: end,
                down: end,
            },
        }
    }

    /// Along stretches of constant jerk that join and cover a length.
    pub fn along(length_mm: f64, stretches: &[Stretch]) -> Ramp {
        let (mut start_s, mut start_mm) = (0.0, 0.0);
        let mut leg = |stretch: &Stretch| {
            let leg = Start {
                start_s,
                start_mm,
                speed_mm_s: stretch.from.speed_mm_s,
                accel_mm_s2: stretch.from.accel_mm_s2,
                jerk_mm_s3: stretch.jerk_mm_s3,
            };
            start_s += stretch.duration_s;
            start_mm += stretch.length_mm();
            leg
        };
        let legs = Legs::Many(stretches.iter().map(&mut leg).collect());
        let peak_mm_s = stretches.iter().map(Stretch::peak_mm_s).fold(0.0, f64::max);
        Ramp { length_mm, duration_s: start_s, peak_mm_s, legs }
    }

    /// Its stretches of constant acceleration or jerk, with places counted from `start_mm`.
    pub fn stretches(&self, start_mm: f64) -> impl DoubleEndedIterator<Item = Stretch> {
        (0..self.count()).filter_map(move |i| {
            let leg = self.start(i);
            let duration_s = self.end_s(i) - leg.start_s;
            let from = State {
                at_mm: start_mm + leg.start_mm,
                speed_mm_s: leg.speed_mm_s,
                accel_mm_s2: leg.accel_mm_s2,
            };
            let stretch = Stretch { from, jerk_mm_s3: leg.jerk_mm_s3, duration_s };
            (duration_s > 0.0).then_some(stretch)
        })
    }

    /// How many legs it has.
    fn count(&self) -> usize {
        match &self.legs {
            Legs::Trapezoid { .. } => 3,
            Legs::Many(legs) => legs.len(),
        }
    }

    /// How one of its legs starts.
    #[inline]
    fn start(&self, leg: usize) -> Start {
        match &self.legs {
            Legs::Trapezoid { entry_mm_s, accel_mm_s2, braking_mm_s2, cruise, down } => {
                let ((start_s, start_mm), speed_mm_s, accel_mm_s2) = match leg {
                    0 => ((0.0, 0.0), *entry_mm_s, *accel_mm_s2),
                    1 => (*cruise, self.peak_mm_s, 0.0),
                    _ => (*down, self.peak_mm_s, -braking_mm_s2),
                };
                Start { start_s, start_mm, speed_mm_s, accel_mm_s2, jerk_mm_s3: 0.0 }
            }
            Legs::Many(legs) => legs[leg],
        }
    }

    /// When one of its legs ends.
    #[inline]
    fn end_s(&self, leg: usize) -> f64 {
        let next_s = match &self.legs {
            Legs::Trapezoid { cruise, down, .. } => [cruise.0, down.0].get(leg).copied(),
            Legs::Many(legs) => legs.get(leg + 1).map(|next| next.start_s),
        };
        next_s.map_or(self.duration_s, |next_s| lesser(next_s, self.duration_s))
    }

    /// How long it takes.
    pub fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// Speed at its start.
    pub fn entry_mm_s(&self) -> f64 {
        self.stretches(0.0).next().map_or(0.0, |stretch| stretch.from.speed_mm_s)
    }

    /// Speed at its end.
    pub fn exit_mm_s(&self) -> f64 {
        self.stretches(0.0).next_back().map_or(0.0, |stretch| stretch.end().speed_mm_s)
    }

    /// The greatest speed on it.
    pub fn peak_mm_s(&self) -> f64 {
        self.peak_mm_s
    }

    /// The length it covers.
    pub fn length_mm(&self) -> f64 {
        self.length_mm
    }

    /// The leg under way at a time after the start.
    pub fn leg_at(&self, time_s: f64) -> Leg {
        let leg = match &self.legs {
            Legs::Trapezoid { cruise, down, .. } => {
                usize::from(cruise.0 <= time_s) + usize::from(down.0 <= time_s)
            }
            // Few enough that the next is found soonest one by one.
            Legs::Many(legs) => {
                let is_later = |leg: &Start| leg.start_s > time_s;
                legs[1..].iter().position(is_later).unwrap_or(legs.len() - 1)
            }
        };
        let (start, end_s) = (self.start(leg), self.end_s(leg));
        Leg {
            start_s: start.start_s,
            start_mm: start.start_mm,
            speed_mm_s: start.speed_mm_s,
            half_accel_mm_s2: 0.5 * start.accel_mm_s2,
            sixth_jerk_mm_s3: start.jerk_mm_s3 / 6.0,
            end_s,
        }
    }

    /// How far along the piece at a time after its start.
    pub fn distance_mm(&self, time_s: f64) -> f64 {
        if time_s >= self.duration_s {
            return self.length_mm;
        }
        let distance_mm = self.leg_at(time_s).distance_mm(time_s);
        distance_mm.min(self.length_mm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn least_times_of_the_reference_figures() {
        // 40 mm at 20 mm/s and 100 mm/s²: 2.2 s; four of them make the square's 8.800 s.
        assert!((Ramp::between(40.0, [0.0; 2], 400.0, 100.0).duration_s() - 2.2).abs() < 1e-12);
        // 1 mm never reaches 20 mm/s: a triangle of 2·sqrt(l/a).
        assert!((Ramp::between(1.0, [0.0; 2], 400.0, 100.0).duration_s() - 0.2).abs() < 1e-12);
        // From 10 to 20 mm/s takes 0.1 s and 1.5 mm.
        assert!((Ramp::steady(1.5, [10.0, 20.0]).duration_s() - 0.1).abs() < 1e-12);
    }

    proptest! {
        /// Up with one acceleration and down with another, of which the greater stays in its half.
        #[test]
        fn halves_keep_their_accelerations(
            length_mm in 1e-3..1e2_f64, halves_mm_s2 in [1.0..1e4_f64, 1.0..1e4_f64],
            ends_mm_s in [0.0..50.0_f64, 0.0..50.0_f64], speed_mm_s in 50.0..500.0_f64,
        ) {
            let ramp = Ramp::of_halves(length_mm, ends_mm_s, speed_mm_s.powi(2), halves_mm_s2);
            prop_assume!(ramp.is_some());
            let stretches: Vec<Stretch> = ramp.iter().flat_map(|ramp| ramp.stretches(0.0)).collect();
            let [first, last] = [stretches[0], stretches[stretches.len() - 1]];
            prop_assert_eq!(first.from.accel_mm_s2, halves_mm_s2[0]);
            prop_assert_eq!(last.from.accel_mm_s2, -halves_mm_s2[1]);
            prop_assert!((last.end().at_mm - length_mm).abs() <= 1e-9 * length_mm);
            prop_assert!((last.end().speed_mm_s - ends_mm_s[1]).abs() <= 1e-6);
            let is_up_more = halves_mm_s2[0] > halves_mm_s2[1];
            let way_mm = if is_up_more { first.end().at_mm } else { length_mm - last.from.at_mm };
            prop_assert!(way_mm <= length_mm * (0.5 + 1e-9), "{} of {}", way_mm, length_mm);
        }

        #[test]
        fn distance_keeps_speed_and_acceleration(
            length_mm in 1e-4..1e3_f64, speed_mm_s in 1e-2..1e3_f64, accel_mm_s2 in 1.0..1e5_f64,
            ends in [0.0..1.0_f64, 0.0..1.0_f64],
        ) {
            let reach_mm_s = (2.0 * accel_mm_s2 * length_mm).sqrt();
            let ends_mm_s = ends.map(|share| share * speed_mm_s.min(reach_mm_s));
            let ramp = Ramp::between(length_mm, ends_mm_s, speed_mm_s * speed_mm_s, accel_mm_s2);
            let step_s = ramp.duration_s() / 500.0;
            let at = |k: i32| ramp.distance_mm(f64::from(k) * step_s);
            let slack_mm = length_mm * 1e-9;
            for k in 0..500 {
                let step_mm = at(k + 1) - at(k);
                prop_assert!(step_mm >= -slack_mm && step_mm <= speed_mm_s * step_s + slack_mm);
                if k > 0 {
                    let bend_mm = at(k + 1) - 2.0 * at(k) + at(k - 1);
                    prop_assert!(bend_mm.abs() <= accel_mm_s2 * step_s * step_s + slack_mm);
                }
            }
            prop_assert_eq!(at(0), 0.0);
            prop_assert!((at(500) - length_mm).abs() <= slack_mm);
            prop_assert!((at(1) - ends_mm_s[0] * step_s).abs()
                <= 0.5 * accel_mm_s2 * step_s * step_s + slack_mm);
        }
    }
}
