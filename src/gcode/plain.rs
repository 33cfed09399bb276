//! The words that most lines consist of, a letter and a short number, in a loop of their own.
//!
//! Whatever else stands in a line, or may be wrong with it, is left to the parser, which would have
//! read these words the same.

use super::block::{Block, Word};
use super::number::POWERS_OF_TEN;

/// Powers of ten for as many decimals as a plain word may have.
const WHOLE_POWERS_OF_TEN: [i64; DIGITS_MAX as usize + 1] =
    [1, 10, 100, 1000, 10_000, 100_000, 1_000_000, 10_000_000];

/// Most digits before the point, and behind it. With no more than fourteen the number is below the
/// greatest there is, and its digits as a whole number are exact in f64, as are the powers of ten; so
/// the quotient is correctly rounded.
const DIGITS_MAX: u32 = 7;

/// In each of eight bytes a one.
const ONES: u64 = 0x0101_0101_0101_0101;

/// The letters of plain words, in upper case, by their bytes; 0 for other bytes, and for O, which may
/// begin a statement.
const LETTERS: [u8; 256] = {
    let mut letters = [0; 256];
    let mut letter = b'A';
    while letter <= b'Z' {
        if letter != b'O' {
            letters[letter as usize] = letter;
            letters[letter.to_ascii_lowercase() as usize] = letter;
        }
        letter += 1;
    }
    letters
};

/// Reads words from the beginning of a line as long as they are plain, and gives what follows.
#[inline(never)]
pub(super) fn plain_words<'a>(line: &'a [u8], block: &mut Block) -> &'a [u8] {
    let (mut rest, mut next) = (line, after_blanks(line));
    while let Some((word, behind)) = plain_word(line, next) {
        if block.push(word).is_err() {
            break;
        }
        (rest, next) = (behind, after_blanks(behind));
    }
    match next {
        // The number goes on, maybe behind blanks.
        [b'0'..=b'9' | b'.', ..] => without_last(line, block),
        _ => rest,
    }
}

/// Takes back the word read last, and gives what follows the one before.
#[cold]
fn without_last<'a>(line: &'a [u8], block: &mut Block) -> &'a [u8] {
    let last = block.words().len().saturating_sub(1);
    block.leave_out(&[last as u16]);
    let end = block.words().last().map_or(0, |word| word.end);
    line.get(end as usize..).unwrap_or_default()
}

/// The word with which the rest of a line begins, if it is plain, and what follows it.
#[inline]
fn plain_word<'a>(line: &[u8], rest: &'a [u8]) -> Option<(Word, &'a [u8])> {
    let [first, second, ..] = rest else { return None };
    let letter = LETTERS[usize::from(*first)];
    if letter == 0 {
        return None;
    }
    // Signs change without a rule: an offset costs less than a branch that is taken by chance.
    let is_negative = *second == b'-';
    let number = rest.get(1 + usize::from(is_negative)..)?;
    let Digits { value, decimals, length } = digits(line, number)?;
    // Codes have one decimal at most: others are those nearby.
    if decimals > 1 && matches!(letter, b'G' | b'M') {
        return None;
    }
    let behind = number.get(length as usize..)?;
    let magnitude = value as f64 / POWERS_OF_TEN.get(decimals as usize)?;
    let value = f64::from_bits(magnitude.to_bits() | u64::from(is_negative) << 63);
    let (start, end) = (line.len() - rest.len(), line.len() - behind.len());
    Some((Word { letter, value, start: start as u32, end: end as u32 }, behind))
}

/// Digits with a point among them, or without.
struct Digits {
    /// The whole number that they are without the point.
    value: i64,
    /// How many of them stand behind the point.
    decimals: u32,
    /// How many bytes they are, with the point.
    length: u32,
}

/// The digits with which the rest of a line begins: one digit at least, and [`DIGITS_MAX`] at most on
/// each side of the point.
///
/// Eight bytes are looked at together, which most often hold all of a number and what ends it. A
/// loop over the digits would take a third of the time of a check.
#[inline]
fn digits(line: &[u8], rest: &[u8]) -> Option<Digits> {
    let bytes = eight_bytes(line, rest);
    let others = not_digits(bytes);
    let whole = others.trailing_zeros() / 8;
    if whole > DIGITS_MAX {
        return None;
    }
    if (bytes >> (8 * whole)) as u8 != b'.' {
        let value = whole_number(bytes, whole);
        return (whole > 0).then_some(Digits { value, decimals: 0, length: whole });
    }
    let behind_point = others & (others - 1);
    if behind_point != 0 {
        let length = behind_point.trailing_zeros() / 8;
        let before_point = (1 << (8 * whole)) - 1;
        let bytes = bytes & before_point | bytes >> 8 & !before_point;
        let (value, decimals) = (whole_number(bytes, length - 1), length - 1 - whole);
        return (length > 1).then_some(Digits { value, decimals, length });
    }
    let fraction = eight_bytes(line, rest.get(whole as usize + 1..)?);
    let decimals = not_digits(fraction).trailing_zeros() / 8;
    let scale = WHOLE_POWERS_OF_TEN.get(decimals as usize)?;
    let value = whole_number(bytes, whole) * scale + whole_number(fraction, decimals);
    Some(Digits { value, decimals, length: whole + 1 + decimals })
}

/// The highest bit of each of eight bytes that is no digit. A carry from a byte that is not ASCII may
/// take the digit behind it for none; nobody looks there.
#[inline]
fn not_digits(bytes: u64) -> u64 {
    // A digit becomes its value, any other byte more than nine.
    let values = bytes ^ (ONES * u64::from(b'0'));
    (values | values.wrapping_add(ONES * (0x7f - 9))) & (ONES * 0x80)
}

/// The number of the first of eight bytes, which are so many digits. Each joins its neighbour, then
/// twos and fours do.
#[inline]
fn whole_number(bytes: u64, digits: u32) -> i64 {
    // Zeros come before the digits, in the place of what stands behind them.
    let ones = (bytes ^ (ONES * u64::from(b'0'))).unbounded_shl(64 - 8 * digits);
    let twos = (ones * 10 + (ones >> 8)) & 0x00ff_00ff_00ff_00ff;
    let fours = (twos * 100 + (twos >> 16)) & 0x0000_ffff_0000_ffff;
    ((fours * 10_000 + (fours >> 32)) & 0xffff_ffff) as i64
}

/// The first eight bytes of the rest of a line, the first in the lowest bits; behind its end zeros.
#[inline]
fn eight_bytes(line: &[u8], rest: &[u8]) -> u64 {
    if let Some(bytes) = rest.first_chunk() {
        return u64::from_le_bytes(*bytes);
    }
    match line.last_chunk() {
        // What stands before the rest falls out.
        Some(bytes) => u64::from_le_bytes(*bytes).unbounded_shr(64 - 8 * rest.len() as u32),
        None => few_bytes(rest),
    }
}

/// The same of a line that has no eight bytes.
#[inline(never)]
fn few_bytes(rest: &[u8]) -> u64 {
    rest.iter().rev().fold(0, |bytes, byte| bytes << 8 | u64::from(*byte))
}

#[inline]
fn after_blanks(mut text: &[u8]) -> &[u8] {
    while let [b' ' | b'\t', rest @ ..] = text {
        text = rest;
    }
    text
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::number::number;
    use super::*;

    proptest! {
        #[test]
        fn a_plain_word_is_what_the_parser_reads(
            before in " {0,9}(N1 ?)?(G0 ?)?",
            text in "[XY]-?[0-9]{0,11}\\.?[0-9]{0,9}",
            behind in "[ .]?[ .0-9X~\u{e9}]{0,9}",
        ) {
            let line = format!("{before}{text}{behind}");
            let mut block = Block::default();
            let left = plain_words(line.as_bytes(), &mut block).len();
            let words = block.words();
            prop_assert_eq!(words.last().map_or(0, |word| word.end as usize), line.len() - left);
            for word in words {
                let (rest, value) = number(&line.as_bytes()[word.start as usize + 1..]).unwrap();
                prop_assert_eq!(word.value.to_bits(), value.to_bits());
                prop_assert_eq!(word.end as usize, line.len() - rest.len());
            }
        }

        #[test]
        fn words_of_up_to_seven_digits_before_and_behind_the_point_are_plain(
            line in "(N[0-9]{1,7} ?)?(G1 ?)?(X-?[0-9]{1,7}\\.[0-9]{0,7} ?)?(Y-?\\.[0-9]{1,7})?",
        ) {
            let left = plain_words(line.as_bytes(), &mut Block::default());
            prop_assert!(left.trim_ascii().is_empty());
        }
    }
}
