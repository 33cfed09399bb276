//! Where the marks of an axis stand, and how their numbers read: a range → round values.
//!
//! Marks are 1, 2 or 5 times a power of ten, computed as whole multiples, so that 0.3 is no
//! 0.30000000000000004.

/// The round step of marks that cuts `range` into at most `most` pieces.
fn step_of(range: f64, most: usize) -> (f64, i32) {
    let raw = range / most as f64;
    let exponent = libm::log10(raw).floor() as i32;
    let factors = [1.0, 2.0, 5.0, 10.0];
    let rounded = factors.iter().find(|factor| **factor * power(exponent) >= raw * (1.0 - 1e-9));
    match rounded {
        Some(10.0) | None => (1.0, exponent + 1),
        Some(factor) => (*factor, exponent),
    }
}

/// Ten to a whole power, with one rounding.
fn power(exponent: i32) -> f64 {
    if exponent < 0 { 1.0 / 10_f64.powi(-exponent) } else { 10_f64.powi(exponent) }
}

/// A multiple of a round step, with one rounding.
fn multiple(count: f64, factor: f64, exponent: i32) -> f64 {
    if exponent < 0 {
        count * factor / 10_f64.powi(-exponent)
    } else {
        count * factor * 10_f64.powi(exponent)
    }
}

/// Widens a linear range to whole steps of at most `most` marks, and gives the marks.
pub fn linear([low, high]: [f64; 2], most: usize) -> Vec<f64> {
    let (factor, exponent) = step_of(high - low, most);
    let step = factor * power(exponent);
    let first = (low / step + 1e-9).floor();
    let last = (high / step - 1e-9).ceil();
    let count = (last - first) as usize;
    (0..=count).map(|at| multiple(first + at as f64, factor, exponent)).collect()
}

/// Widens a logarithmic range (above 0) to round values, and gives the marks: 1, 2 and 5 in each
/// decade, or only 1 where that would be more than `most`.
pub fn logarithmic([low, high]: [f64; 2], most: usize) -> Vec<f64> {
    let decades =
        (libm::log10(low) - 1e-9).floor() as i32..=(libm::log10(high) + 1e-9).floor() as i32;
    let all: Vec<f64> = decades
        .clone()
        .flat_map(|exponent| [1.0, 2.0, 5.0].map(|factor| multiple(1.0, factor, exponent)))
        .chain([multiple(1.0, 1.0, decades.end() + 1)])
        .collect();
    let enclosing = |marks: &[f64]| {
        let first = marks.iter().rposition(|mark| *mark <= low * (1.0 + 1e-9)).unwrap_or(0);
        let last = marks.iter().position(|mark| *mark >= high * (1.0 - 1e-9));
        marks[first..=last.unwrap_or(marks.len() - 1)].to_vec()
    };
    let fine = enclosing(&all);
    if fine.len() <= most {
        return fine;
    }
    enclosing(&all.iter().copied().step_by(3).collect::<Vec<_>>())
}

/// How a mark reads: plain from 0.0001 to below 10^8, else as a power of ten.
pub fn label(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        size if !(1e-4..1e8).contains(&size) => format!("{value:e}"),
        _ => format!("{value}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(marks: Vec<f64>, expected: &str) {
        let labels: Vec<String> = marks.into_iter().map(label).collect();
        assert_eq!(labels.join(" "), expected);
    }

    #[test]
    fn marks_are_round_and_enclose_the_range() {
        check(linear([0.0, 10.0], 6), "0 2 4 6 8 10");
        check(linear([0.0, 0.3], 6), "0 0.05 0.1 0.15 0.2 0.25 0.3");
        check(linear([-0.013, 0.021], 6), "-0.02 -0.01 0 0.01 0.02 0.03");
        check(linear([1.0, 15.0], 8), "0 2 4 6 8 10 12 14 16");
        check(linear([99_999.0, 100_001.0], 4), "99999 99999.5 100000 100000.5 100001");
        check(linear([0.0, 3e8], 3), "0 1e8 2e8 3e8");
        check(logarithmic([9600.0, 115_200.0], 8), "5000 10000 20000 50000 100000 200000");
        check(logarithmic([0.001, 0.001], 8), "0.001");
        check(logarithmic([1e-6, 1.0], 8), "1e-6 1e-5 0.0001 0.001 0.01 0.1 1");
    }
}
