//! The numbers of NC words: sign, digits, a point; no exponents, for `E` is a letter of its own.

use nom::branch::alt;
use nom::bytes::complete::{tag, take_while};
use nom::combinator::{opt, value};
use nom::error::{ErrorKind, ParseError};
use nom::{IResult, Parser};

/// What a stretch of a line is not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SyntaxError {
    /// No number stands here.
    NoNumber,
    /// The number is beyond [`NUMBER_MAX`].
    TooLarge,
    /// Something else was expected.
    Other,
}

impl<I> ParseError<I> for SyntaxError {
    fn from_error_kind(_: I, _: ErrorKind) -> Self {
        SyntaxError::Other
    }

    fn append(_: I, _: ErrorKind, other: Self) -> Self {
        other
    }
}

/// The result of a parser: what is left of the line, and what was read.
pub type Parsed<'a, T> = IResult<&'a [u8], T, SyntaxError>;

/// Greatest magnitude of a number: far beyond any machine, and small enough that no later
/// product of it leaves the exact range of its type.
pub const NUMBER_MAX: f64 = 1e9;

/// Powers of ten that f64 holds exactly.
pub(super) const POWERS_OF_TEN: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];

/// Mantissas up to here are exact in f64; divided by an exact power of ten, the quotient is
/// correctly rounded.
const MANTISSA_MAX: u64 = 1 << 53;

/// Numbers of up to so many digits fit a mantissa of 64 bits.
const DIGITS_MAX: usize = 19;

/// A number as people read it: all its digits, or a power of ten where it would be mostly noughts.
pub fn short(value: f64) -> String {
    let is_long = value != 0.0 && !(1e-9..1e15).contains(&value.abs());
    if is_long { format!("{value:e}") } else { value.to_string() }
}

/// Blanks, which may stand anywhere, even inside a number (RS274/NGC).
pub fn blanks(input: &[u8]) -> Parsed<'_, &[u8]> {
    take_while(is_blank)(input)
}

/// Whether a byte is a blank or a tab.
pub fn is_blank(byte: u8) -> bool {
    byte == b' ' || byte == b'\t'
}

/// A number, correctly rounded. Takes the blanks before it.
pub fn number(input: &[u8]) -> Parsed<'_, f64> {
    let (rest, negative) = if starts_number(input) { (input, false) } else { sign(input)? };
    let (rest, magnitude) = magnitude(rest)?;
    Ok((rest, if negative { -magnitude } else { magnitude }))
}

fn starts_number(input: &[u8]) -> bool {
    matches!(input.first(), Some(b'0'..=b'9' | b'.'))
}

/// Whether a minus stands before the number; blanks on both sides are taken.
fn sign(input: &[u8]) -> Parsed<'_, bool> {
    let signs = alt((value(true, tag("-")), value(false, tag("+"))));
    (blanks, opt(signs), blanks).map(|(_, negative, _)| negative.unwrap_or(false)).parse(input)
}

fn magnitude(input: &[u8]) -> Parsed<'_, f64> {
    let mut mantissa = 0_u64;
    let (mut digits, mut decimals, mut point) = (0_usize, 0_usize, false);
    let mut at = 0;
    while let Some(&byte) = input.get(at) {
        match byte {
            b'0'..=b'9' => {
                digits += 1;
                decimals += usize::from(point);
                // Wraps only where there are too many digits, and the mantissa is not used.
                mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(byte - b'0'));
            }
            b'.' if !point => point = true,
            _ if is_blank(byte) => {
                let blanks = input[at..].iter().take_while(|byte| is_blank(**byte)).count();
                match input.get(at + blanks) {
                    Some(b'0'..=b'9') => {}
                    Some(b'.') if !point => {}
                    _ => break,
                }
                at += blanks - 1;
            }
            _ => break,
        }
        at += 1;
    }
    if digits == 0 {
        return Err(nom::Err::Error(SyntaxError::NoNumber));
    }
    let (text, rest) = input.split_at(at);
    let magnitude = match POWERS_OF_TEN.get(decimals) {
        Some(power) if digits <= DIGITS_MAX && mantissa <= MANTISSA_MAX => mantissa as f64 / power,
        _ => by_std(text)?,
    };
    if magnitude > NUMBER_MAX {
        return Err(nom::Err::Failure(SyntaxError::TooLarge));
    }
    Ok((rest, magnitude))
}

/// Numbers of too many digits for one exact division.
fn by_std(text: &[u8]) -> Result<f64, nom::Err<SyntaxError>> {
    let text: String =
        text.iter().filter(|byte| !is_blank(**byte)).map(|byte| char::from(*byte)).collect();
    text.parse().map_err(|_| nom::Err::Error(SyntaxError::NoNumber))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn check(text: &str, expected: f64, rest: &str) {
        let (left, found) = number(text.as_bytes()).unwrap();
        assert_eq!((found, left), (expected, rest.as_bytes()), "{text}");
    }

    #[test]
    fn numbers_are_digits_a_point_and_blanks() {
        check("1", 1.0, "");
        check("+0. 12 34Y7", 0.1234, "Y7");
        check("-.5X", -0.5, "X");
        check(" - 3 . 25 G1", -3.25, " G1");
        check("1.2.3", 1.2, ".3");
        check("1E5", 1.0, "E5");
        check("007.50", 7.5, "");
        check("0.1234567890123456789012345", 0.123_456_789_012_345_68, "");
        check("1 .", 1.0, "");
        for text in ["", "-", "X", ".", "- .", "--1", "inf", "nan", "#1", "\u{e9}"] {
            assert!(number(text.as_bytes()).is_err(), "{text}");
        }
        assert_eq!(number(b"1000000001"), Err(nom::Err::Failure(SyntaxError::TooLarge)));
        let long = "9".repeat(400);
        assert_eq!(number(long.as_bytes()), Err(nom::Err::Failure(SyntaxError::TooLarge)));
    }

    proptest! {
        #[test]
        fn numbers_are_correctly_rounded(text in "[0-9]{1,9}(\\.[0-9]{0,25})?") {
            let (rest, found) = number(text.as_bytes()).unwrap();
            prop_assert!(rest.is_empty());
            prop_assert_eq!(found.to_bits(), text.parse::<f64>().unwrap().to_bits());
        }
    }
}
