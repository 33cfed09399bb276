//! The lesser and the greater of two numbers, where neither is NaN: an instruction each, of which `f64::min`
//! and `f64::max` take six.

/// The lesser of both.
#[inline]
pub fn lesser(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The greater of both.
#[inline]
pub fn greater(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}
