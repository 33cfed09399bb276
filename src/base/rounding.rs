//! Numbers as reports print them.

/// To six decimals, below which sums of floats are noise.
pub fn six_digits(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}
