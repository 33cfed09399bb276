//! The words that most lines consist of, a letter and a short number, in a loop of their own.
//!
//! Whatever else stands in a line, or may be wrong with it, is left to the parser, which would have
//! read these words the same.

use super::block::{Block, Word};
use super::number::{POWERS_OF_TEN, is_blank};

/// Powers of ten for as many decimals as a plain word may have.
const WHOLE_POWERS_OF_TEN: [i64; DIGITS_MAX as usize + 1] =
    [1, 10, 100, 1000, 10_000, 100_000, 1_000_000, 10_000_000];

/// Most digits before the point, and behind it. With no more than fourteen the number is below the
/// greatest there is, and its digits as a whole number are exact in f64, as are the powers of ten; so
/// the quotient is correctly rounded.
const DIGITS_MAX: u32 = 7;

/// In each of eight bytes a one.
const ONES: u64 = 0x0101_0101_0101_0101;

/// Reads words from the beginning of a line as long as they are plain, and gives what follows.
pub(super) fn plain_words<'a>(line: &'a [u8], block: &mut Block) -> &'a [u8] {
    let (mut end, mut next) = (0, after_blanks(line, 0));
    while let Some((word, behind)) = plain_word(line, next) {
        if block.push(word).is_err() {
            break;
        }
        (end, next) = (word.end as usize, behind);
    }
    &line[end..]
}

/// The word at a place, if it is plain, and where the next one begins.
#[inline]
fn plain_word(line: &[u8], start: usize) -> Option<(Word, usize)> {
    let letter = line.get(start)?.to_ascii_uppercase();
    // An O may begin a statement.
    if !letter.is_ascii_uppercase() || letter == b'O' {
        return None;
    }
    let negative = line.get(start + 1) == Some(&b'-');
    let begin = start + 1 + usize::from(negative);
    let (whole, mut digits) = leading_digits(line, begin);
    let (mut end, mut decimals) = (begin + whole as usize, 0);
    if line.get(end) == Some(&b'.') {
        let (count, fraction) = leading_digits(line, end + 1);
        digits = digits * *WHOLE_POWERS_OF_TEN.get(count as usize)? + fraction;
        (end, decimals) = (end + 1 + count as usize, count);
    }
    let next = after_blanks(line, end);
    // A number may go on behind blanks.
    let goes_on = matches!(line.get(next), Some(b'0'..=b'9' | b'.'));
    if goes_on || whole > DIGITS_MAX || whole + decimals == 0 {
        return None;
    }
    let magnitude = digits as f64 / POWERS_OF_TEN.get(decimals as usize)?;
    let value = if negative { -magnitude } else { magnitude };
    Some((Word { letter, value, start: start as u32, end: end as u32 }, next))
}

/// How many digits stand at a place, eight at most, and the number that they make.
///
/// All eight bytes are looked at together, and digits joined to their neighbours by twos, fours and
/// eights, for a loop over the digits would take a third of the time of a check.
#[inline]
fn leading_digits(line: &[u8], at: usize) -> (u32, i64) {
    // A digit becomes its value, any other byte more than nine.
    let bytes = eight_bytes(line, at) ^ (ONES * u64::from(b'0'));
    // Its highest bit tells the bytes above nine; a carry disturbs only those behind one of them.
    let above_nine = (bytes | bytes.wrapping_add(ONES * (0x7f - 9))) & (ONES * 0x80);
    let count = above_nine.trailing_zeros() / 8;
    // Zeros come before the digits, in the place of what stands behind them.
    let ones = bytes.unbounded_shl(64 - 8 * count);
    let twos = (ones * 10 + (ones >> 8)) & 0x00ff_00ff_00ff_00ff;
    let fours = (twos * 100 + (twos >> 16)) & 0x0000_ffff_0000_ffff;
    let eights = (fours * 10_000 + (fours >> 32)) & 0xffff_ffff;
    (count, eights as i64)
}

/// Eight bytes of a line, the first in the lowest bits; behind its end zeros.
#[inline]
fn eight_bytes(line: &[u8], at: usize) -> u64 {
    let rest = line.get(at..).unwrap_or_default();
    match (rest.first_chunk(), line.last_chunk()) {
        (Some(bytes), _) => u64::from_le_bytes(*bytes),
        // What stands before the place falls out.
        (None, Some(bytes)) => u64::from_le_bytes(*bytes).unbounded_shr(64 - 8 * rest.len() as u32),
        (None, None) => rest.iter().rev().fold(0, |bytes, byte| bytes << 8 | u64::from(*byte)),
    }
}

#[inline]
fn after_blanks(line: &[u8], mut at: usize) -> usize {
    while line.get(at).is_some_and(|byte| is_blank(*byte)) {
        at += 1;
    }
    at
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::number::number;
    use super::*;

    proptest! {
        #[test]
        fn a_plain_word_is_what_the_parser_reads(
            before in "( |N1 ){0,4}",
            text in "[A-Z]-?[0-9]{0,11}\\.?[0-9]{0,9}",
            behind in "[ .]?[ .0-9X~\u{e9}]{0,9}",
        ) {
            let line = format!("{before}{text}{behind}");
            if let Some((word, next)) = plain_word(line.as_bytes(), before.len()) {
                let (rest, value) = number(&line.as_bytes()[before.len() + 1..]).unwrap();
                prop_assert_eq!(word.value.to_bits(), value.to_bits());
                prop_assert_eq!(word.end as usize, line.len() - rest.len());
                prop_assert_eq!(&line[next..], line[word.end as usize..].trim_start());
            }
        }

        #[test]
        fn words_of_up_to_seven_digits_before_and_behind_the_point_are_plain(
            line in "(N[0-9]{1,7} ?)?(G1 ?)?(X-?[0-9]{1,7}\\.[0-9]{0,7} ?)?(Y-?\\.[0-9]{1,7})?",
        ) {
            prop_assert!(plain_words(line.as_bytes(), &mut Block::default()).is_empty());
        }
    }
}
