//! Numbers in columns: as the standard formatter writes them, in a fraction of its time where a
//! number is neither large nor next to the middle between two forms.

use std::io::{self, Write};

/// Numbers of fewer digits are exact enough when scaled: to 1e-7 of the last digit.
const SCALED_MAX: f64 = 1e9;

/// What lies nearer to the middle between two forms is left to the standard formatter.
const MIDDLE_WITHIN: f64 = 1e-6;

/// Bytes of the longest number that is written here: sign, digits, point; and of a column.
const BYTES_MAX: usize = 16;

/// Writes as `{value:>width$.decimals$}`; columns are up to 16 wide.
pub fn decimal(text: &mut Vec<u8>, value: f64, width: usize, decimals: u32) -> io::Result<()> {
    let scaled = value.abs() * f64::from(10_u32.pow(decimals));
    let is_clear = scaled < SCALED_MAX && (scaled.fract() - 0.5).abs() > MIDDLE_WITHIN;
    if !is_clear {
        return write!(text, "{value:>width$.precision$}", precision = decimals as usize);
    }
    let mut column = [b' '; BYTES_MAX];
    let (mut at, mut rest) = (BYTES_MAX, scaled.round() as u32);
    let mut written = 0;
    while written <= decimals || rest > 0 {
        if written == decimals && decimals > 0 {
            at -= 1;
            column[at] = b'.';
        }
        at -= 1;
        column[at] = b'0' + (rest % 10) as u8;
        (rest, written) = (rest / 10, written + 1);
    }
    if value.is_sign_negative() {
        at -= 1;
        column[at] = b'-';
    }
    text.extend_from_slice(&column[at.min(BYTES_MAX - width.min(BYTES_MAX))..]);
    Ok(())
}

/// Writes as `{value:>width$}`.
pub fn whole(text: &mut Vec<u8>, value: u32, width: usize) {
    let mut buffer = itoa::Buffer::new();
    let digits = buffer.format(value).as_bytes();
    text.resize(text.len() + width.saturating_sub(digits.len()), b' ');
    text.extend_from_slice(digits);
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn check(value: f64, width: usize, decimals: u32) {
        let mut text = Vec::new();
        decimal(&mut text, value, width, decimals).unwrap();
        let expected = format!("{value:>width$.precision$}", precision = decimals as usize);
        assert_eq!(String::from_utf8(text).unwrap(), expected, "{value}");
    }

    #[test]
    fn numbers_are_written_as_by_the_standard_formatter() {
        for value in
            [0.0, 0.0005, 0.0015, 0.5, 1.0, 9.9996, 999_999.999_9, 1e6, 1e15, f64::INFINITY]
        {
            for decimals in 0..4 {
                check(value, 10, decimals);
                check(-value, 10, decimals);
            }
        }
        check(f64::NAN, 10, 3);
    }

    proptest! {
        #[test]
        fn so_are_all_others(value in -2e6..2e6_f64, thousandths in -10_000_000..10_000_000_i32) {
            check(value, 10, 3);
            check(value, 8, 1);
            check(f64::from(thousandths) / 1e4, 10, 3);
            check(f64::from(thousandths) / 16.0, 10, 3);
        }

        #[test]
        fn and_whole_numbers(value in 0..u32::MAX, width in 0..12_usize) {
            let mut text = Vec::new();
            whole(&mut text, value, width);
            prop_assert_eq!(String::from_utf8(text).unwrap(), format!("{value:>width$}"));
        }
    }
}
