//! Motion with one jerk.

/// Each step of Newton's method doubles the digits: behind one that changes less than this share, the
/// next would change nothing.
const NEWTON_LAST: f64 = 1e-8;

/// Speeds closer to each other than this share are the same: what rounding makes of equal ones.
pub const SAME: f64 = 1e-9;

/// Where the machine is on its path, and how it moves.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct State {
    /// Way from some start.
    pub at_mm: f64,
    /// Speed along the path.
    pub speed_mm_s: f64,
    /// Acceleration along the path.
    pub accel_mm_s2: f64,
}

/// A time in which the acceleration changes evenly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    /// How it begins.
    pub from: State,
    /// Change of the acceleration.
    pub jerk_mm_s3: f64,
    /// How long it lasts.
    pub duration_s: f64,
}

impl State {
    /// The state after a time with one jerk.
    pub fn after(&self, jerk_mm_s3: f64, time_s: f64) -> State {
        let State { at_mm, speed_mm_s, accel_mm_s2 } = *self;
        State {
            at_mm: at_mm + way_mm(speed_mm_s, accel_mm_s2, jerk_mm_s3, time_s),
            speed_mm_s: speed_mm_s + (accel_mm_s2 + 0.5 * jerk_mm_s3 * time_s) * time_s,
            accel_mm_s2: accel_mm_s2 + jerk_mm_s3 * time_s,
        }
    }

    /// Square of its speed.
    pub fn speed_sq(&self) -> f64 {
        self.speed_mm_s * self.speed_mm_s
    }

    /// By which share of a limit's speed it is faster, less what rounding makes.
    pub fn excess(&self, limit: &State) -> f64 {
        self.speed_mm_s / (limit.speed_mm_s * (1.0 + SAME) + 1e-12) - 1.0
    }

    /// The time a way takes with one jerk, found between 0 and a time in which at least that way is
    /// made, and in which the speed is never below zero.
    pub fn time_over_s(&self, length_mm: f64, jerk_mm_s3: f64, longest_s: f64) -> f64 {
        let State { speed_mm_s, accel_mm_s2, .. } = *self;
        if length_mm <= 0.0 {
            return 0.0;
        }
        let root = (self.speed_sq() + 2.0 * accel_mm_s2 * length_mm).max(0.0).sqrt();
        let steady_s = 2.0 * length_mm / (speed_mm_s + root);
        if jerk_mm_s3 == 0.0 {
            return steady_s.min(longest_s);
        }
        let (mut low_s, mut high_s) = (0.0, longest_s);
        let mut time_s = if steady_s < longest_s { steady_s } else { 0.5 * longest_s };
        // Halving alone is done in 60 rounds.
        for _ in 0..60 {
            let off_mm = way_mm(speed_mm_s, accel_mm_s2, jerk_mm_s3, time_s) - length_mm;
            *if off_mm > 0.0 { &mut high_s } else { &mut low_s } = time_s;
            let slope_mm_s = speed_mm_s + (accel_mm_s2 + 0.5 * jerk_mm_s3 * time_s) * time_s;
            let next_s = time_s - off_mm / slope_mm_s;
            let inside = next_s >= low_s && next_s <= high_s;
            let next_s = if inside { next_s } else { 0.5 * (low_s + high_s) };
            let is_found = (next_s - time_s).abs() <= NEWTON_LAST * time_s;
            time_s = next_s;
            if inside && is_found {
                break;
            }
        }
        time_s
    }

    /// A time in which speeding up with one jerk certainly makes a way. The acceleration is not
    /// negative.
    pub fn rising_s(&self, length_mm: f64, jerk_mm_s3: f64) -> f64 {
        let at_speed_s = length_mm / self.speed_mm_s;
        let at_accel_s = (2.0 * length_mm / self.accel_mm_s2).sqrt();
        let (soonest_s, at_jerk_s3) = (at_speed_s.min(at_accel_s), 6.0 * length_mm / jerk_mm_s3);
        let is_jerk_later = at_jerk_s3 > soonest_s.powi(3);
        let rising_s =
            if is_jerk_later { soonest_s } else { soonest_s.min(libm::cbrt(at_jerk_s3)) };
        rising_s * (1.0 + 1e-9)
    }
}

impl Stretch {
    /// The state after a time since its start.
    pub fn after(&self, time_s: f64) -> State {
        self.from.after(self.jerk_mm_s3, time_s)
    }

    /// The state at its end.
    pub fn end(&self) -> State {
        self.after(self.duration_s)
    }

    /// The way that it makes.
    pub fn length_mm(&self) -> f64 {
        let State { speed_mm_s, accel_mm_s2, .. } = self.from;
        way_mm(speed_mm_s, accel_mm_s2, self.jerk_mm_s3, self.duration_s)
    }

    /// The greatest speed on its way: at an end, or where the acceleration falls through zero.
    pub fn peak_mm_s(&self) -> f64 {
        let ends_mm_s = self.from.speed_mm_s.max(self.end().speed_mm_s);
        let top_s = -self.from.accel_mm_s2 / self.jerk_mm_s3;
        if self.jerk_mm_s3 < 0.0 && top_s > 0.0 && top_s < self.duration_s {
            return self.after(top_s).speed_mm_s.max(ends_mm_s);
        }
        ends_mm_s
    }

    /// The state at a place on its way.
    pub fn at(&self, at_mm: f64) -> State {
        let way_mm = at_mm - self.from.at_mm;
        let time_s = self.from.time_over_s(way_mm, self.jerk_mm_s3, self.duration_s);
        State { at_mm, ..self.after(time_s) }
    }

    /// The part from a place on.
    pub fn since(&self, at_mm: f64) -> Stretch {
        if at_mm <= self.from.at_mm {
            return *self;
        }
        let way_mm = at_mm - self.from.at_mm;
        let time_s = self.from.time_over_s(way_mm, self.jerk_mm_s3, self.duration_s);
        let from = State { at_mm, ..self.after(time_s) };
        Stretch { from, jerk_mm_s3: self.jerk_mm_s3, duration_s: self.duration_s - time_s }
    }

    /// The same backwards in time and along the path: what speeds up here brakes there. Ways are
    /// counted from the same place, and are negative.
    pub fn reversed(&self) -> Stretch {
        let end = self.end();
        let from = State {
            at_mm: -end.at_mm,
            speed_mm_s: end.speed_mm_s.max(0.0),
            accel_mm_s2: -end.accel_mm_s2,
        };
        // The sign of a third derivative changes with time, and again with the way.
        Stretch { from, jerk_mm_s3: self.jerk_mm_s3, duration_s: self.duration_s }
    }
}

fn way_mm(speed_mm_s: f64, accel_mm_s2: f64, jerk_mm_s3: f64, time_s: f64) -> f64 {
    (speed_mm_s + (0.5 * accel_mm_s2 + jerk_mm_s3 / 6.0 * time_s) * time_s) * time_s
}
