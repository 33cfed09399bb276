//! Where a function passes zero, in few evaluations.
//!
//! ```text
//!  value ┤              · high          False position: the next guess is where the chord meets
//!        │        ,-'' /                zero. An end that stays twice counts half the next time,
//!      0 ┼──────/'───┼──── x            so that both ends move (Dowell and Jarratt, 1971: the
//!        │  low·    guess               Illinois method).
//! ```
//!
//! Values may be unknown but for their sign: then the bracket is halved.

/// So many guesses by false position at most; halving follows, which always ends.
const GUESSES_MAX: u32 = 24;

/// A range at whose lower end a function is not above zero, and at whose higher end it is.
#[derive(Clone, Copy, Debug)]
pub struct Bracket {
    /// The last place known to be at or below zero.
    pub low: f64,
    /// The last known to be above.
    high: f64,
    /// Values at both, infinite where only the sign is known.
    values: [f64; 2],
    /// Which end was moved last.
    moved: Option<usize>,
    guesses: u32,
}

impl Bracket {
    /// Of a range with the values at its ends, infinite where only the sign is known.
    pub fn new([low, high]: [f64; 2], values: [f64; 2]) -> Bracket {
        Bracket { low, high, values, moved: None, guesses: 0 }
    }

    /// The next place to look at; none when the range is as narrow as the error.
    pub fn guess(&mut self, error: f64) -> Option<f64> {
        if self.high - self.low <= error {
            return None;
        }
        self.guesses += 1;
        let middle = 0.5 * (self.low + self.high);
        let [below, above] = self.values;
        let is_known = below.is_finite() && above.is_finite() && self.guesses <= GUESSES_MAX;
        let chord = (self.low * above - self.high * below) / (above - below);
        let place = if is_known && chord > self.low && chord < self.high { chord } else { middle };
        (place > self.low && place < self.high).then_some(place)
    }

    /// Takes the value at a place within.
    pub fn take(&mut self, place: f64, value: f64) {
        let end = usize::from(value > 0.0);
        *if end == 1 { &mut self.high } else { &mut self.low } = place;
        self.values[end] = value;
        if self.moved == Some(end) {
            self.values[1 - end] *= 0.5;
        }
        self.moved = Some(end);
    }

    /// Narrows it until the value at its lower end is zero but for an error, or the range is as narrow as
    /// one; gives the lower end.
    pub fn solve(mut self, error: f64, value_error: f64, value: impl Fn(f64) -> f64) -> f64 {
        while let Some(place) = self.guess(error) {
            let found = value(place);
            self.take(place, found);
            if found <= 0.0 && found >= -value_error {
                break;
            }
        }
        self.low
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn zeros_are_found(zero in 0.001..0.999_f64, power in 1..4, known in proptest::bool::ANY) {
            let value = |x: f64| (x - zero) * (1.0 + x).powi(power);
            let ends = if known { [value(0.0), value(1.0)] } else { [f64::NEG_INFINITY, 1.0] };
            let found = Bracket::new([0.0, 1.0], ends).solve(1e-12, 1e-12, value);
            prop_assert!(found <= zero && zero - found <= 1e-11, "{found} {zero}");
        }
    }

    #[test]
    fn a_step_is_found_by_halving() {
        let value = |x: f64| if x > 0.3 { f64::INFINITY } else { f64::NEG_INFINITY };
        let bracket = Bracket::new([0.0, 1.0], [f64::NEG_INFINITY, f64::INFINITY]);
        let found = bracket.solve(1e-12, 0.0, value);
        assert!((found - 0.3).abs() <= 1e-12);
    }
}
