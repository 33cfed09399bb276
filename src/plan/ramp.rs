//! The speed along one piece of the path.
//!
//! ```text
//! speed_mm_s ┤    ______________
//!            │   /              \         slope: accel_mm_s2
//!            │  /                \        area:  length_mm
//!          0 ┼─┴──┴─────────────┴─┴── t
//!             ramp_s  cruise_s  ramp_s
//! ```

/// A symmetric trapezoid from rest to rest: ramp up, cruise, ramp down. With no ramps it is
/// constant speed. Where the piece is too short to reach its speed, a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ramp {
    length_mm: f64,
    speed_mm_s: f64,
    accel_mm_s2: f64,
    ramp_s: f64,
    cruise_s: f64,
}

impl Ramp {
    /// From rest to rest over a length, as fast as the speed and the acceleration allow.
    pub fn rest_to_rest(length_mm: f64, speed_mm_s: f64, accel_mm_s2: f64) -> Ramp {
        // Both ramps together take v²/a of the length; if there is less, the peak is sqrt(l·a).
        let speed_mm_s = speed_mm_s.min((length_mm * accel_mm_s2).sqrt());
        let ramp_s = speed_mm_s / accel_mm_s2;
        let cruise_s = (length_mm / speed_mm_s - ramp_s).max(0.0);
        Ramp { length_mm, speed_mm_s, accel_mm_s2, ramp_s, cruise_s }
    }

    /// At one speed from start to end, as the seed's own interpolator (seed 004, eq. 6.1).
    pub fn constant(length_mm: f64, speed_mm_s: f64) -> Ramp {
        let cruise_s = length_mm / speed_mm_s;
        Ramp { length_mm, speed_mm_s, accel_mm_s2: 0.0, ramp_s: 0.0, cruise_s }
    }

    /// How long it takes.
    pub fn duration_s(&self) -> f64 {
        2.0 * self.ramp_s + self.cruise_s
    }

    /// The length it covers.
    pub fn length_mm(&self) -> f64 {
        self.length_mm
    }

    /// Whether it starts and ends at rest.
    pub fn is_ramped(&self) -> bool {
        self.ramp_s > 0.0
    }

    /// The greatest speed reached.
    pub fn speed_mm_s(&self) -> f64 {
        self.speed_mm_s
    }

    /// How far along the piece at a time after its start.
    pub fn distance_mm(&self, time_s: f64) -> f64 {
        let left_s = self.duration_s() - time_s;
        if time_s <= 0.0 {
            0.0
        } else if left_s <= 0.0 {
            self.length_mm
        } else if time_s < self.ramp_s {
            0.5 * self.accel_mm_s2 * time_s * time_s
        } else if left_s < self.ramp_s {
            self.length_mm - 0.5 * self.accel_mm_s2 * left_s * left_s
        } else {
            self.speed_mm_s * (time_s - 0.5 * self.ramp_s)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn least_times_of_the_reference_figures() {
        // 40 mm at 20 mm/s and 100 mm/s²: 2.2 s; four of them make the square's 8.800 s.
        assert!((Ramp::rest_to_rest(40.0, 20.0, 100.0).duration_s() - 2.2).abs() < 1e-12);
        // 1 mm never reaches 20 mm/s: a triangle of 2·sqrt(l/a).
        assert!((Ramp::rest_to_rest(1.0, 20.0, 100.0).duration_s() - 0.2).abs() < 1e-12);
    }

    proptest! {
        #[test]
        fn distance_keeps_speed_and_acceleration(
            length_mm in 1e-4..1e3_f64, speed_mm_s in 1e-2..1e3_f64, accel_mm_s2 in 1.0..1e5_f64,
        ) {
            let ramp = Ramp::rest_to_rest(length_mm, speed_mm_s, accel_mm_s2);
            let step_s = ramp.duration_s() / 500.0;
            let at = |k: i32| ramp.distance_mm(f64::from(k) * step_s);
            let slack_mm = length_mm * 1e-9;
            for k in 0..500 {
                let step_mm = at(k + 1) - at(k);
                prop_assert!(step_mm >= -slack_mm && step_mm <= speed_mm_s * step_s + slack_mm);
                let bend_mm = at(k + 1) - 2.0 * at(k) + at(k - 1);
                prop_assert!(bend_mm.abs() <= accel_mm_s2 * step_s * step_s + slack_mm);
            }
            prop_assert_eq!(at(0), 0.0);
            prop_assert!((at(500) - length_mm).abs() <= slack_mm);
        }
    }
}
