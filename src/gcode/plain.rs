//! The words that most lines consist of, a letter and a short number, in a loop of their own.
//!
//! Whatever else stands in a line, or may be wrong with it, is left to the parser, which would have
//! read these words the same.

use std::num::NonZeroU64;

use super::block::{Block, Word};
use super::number::{POWERS_OF_TEN, is_blank};

/// Powers of ten for as many decimals as a plain word may have.
const WHOLE_POWERS_OF_TEN: [i64; DIGITS_MAX as usize + 1] =
    [1, 10, 100, 1000, 10_000, 100_000, 1_000_000, 10_000_000];

/// Powers of ten without a minus and with one. A minus comes with the divisor: noughts have signs too, and
/// to set one in a quotient would be to wait for it.
const SIGNED_POWERS_OF_TEN: [[f64; 2 * DIGITS_MAX as usize + 1]; 2] = {
    let mut powers = [[1.0; 2 * DIGITS_MAX as usize + 1]; 2];
    let mut digits = 0;
    while digits < powers[0].len() {
        powers[0][digits] = POWERS_OF_TEN[digits];
        powers[1][digits] = -POWERS_OF_TEN[digits];
        digits += 1;
    }
    powers
};

/// Most digits before the point, where a minus counts as one, and behind it. With no more than
/// fourteen the number is below the greatest there is, and its digits as a whole number are exact in
/// f64, as are the powers of ten; so the quotient is correctly rounded.
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

/// How far plain words go.
pub(super) struct Words {
    /// Just behind the last word.
    pub end: usize,
    /// What follows there, behind blanks.
    pub next: usize,
}

/// Reads words from the beginning of a text as long as they are plain. No end of a line is read over.
#[inline(never)]
pub(super) fn plain_words(text: &[u8], block: &mut Block) -> Words {
    let (mut end, mut next) = (0, 0);
    while let Some(rest) = text.get(next..) {
        let padded;
        // All that is looked at of a word: whether it is there is asked once.
        let bytes: &[u8; WORD_BYTES] = match rest.first_chunk() {
            Some(bytes) => bytes,
            None => {
                padded = with_zeros(rest);
                &padded
            }
        };
        let letter = LETTERS[usize::from(bytes[0])];
        if letter == 0 {
            if !is_blank(bytes[0]) {
                break;
            }
            next += 1;
            continue;
        }
        let Some((value, length)) = plain_number(letter, bytes) else { break };
        let word = Word { letter, value, start: next as u32, end: (next + length) as u32 };
        if block.push(word).is_err() {
            break;
        }
        end = next + length;
        next = end;
        // A loop, so that no number waits for what stands before it. Tabs are few.
        while text.get(next) == Some(&b' ') {
            next += 1;
        }
    }
    if matches!(text.get(next), Some(b'0'..=b'9' | b'.')) {
        // The number goes on, maybe behind blanks.
        end = without_last(block);
    }
    Words { end, next }
}

/// Takes back the word read last, and gives the end of the one before.
#[cold]
fn without_last(block: &mut Block) -> usize {
    let last = block.words().len().saturating_sub(1);
    block.leave_out(&[last as u16]);
    block.words().last().map_or(0, |word| word.end as usize)
}

/// A letter, eight bytes, and as many behind a point among them.
const WORD_BYTES: usize = 1 + 8 + 8;

/// The last bytes of a text, with zeros behind them.
#[cold]
fn with_zeros(rest: &[u8]) -> [u8; WORD_BYTES] {
    let mut bytes = [0; WORD_BYTES];
    bytes.iter_mut().zip(rest).for_each(|(to, from)| *to = *from);
    bytes
}

/// The number of a word, and of how many bytes the word is: of one digit at least, and
/// [`DIGITS_MAX`] at most on each side of the point.
///
/// Eight bytes are looked at together, which most often hold all of a number and what ends it. A
/// loop over the digits would take a third of the time of a check, and a call to this a tenth.
#[inline(always)]
fn plain_number(letter: u8, word: &[u8; WORD_BYTES]) -> Option<(f64, usize)> {
    let bytes = eight_bytes(word, 1)?;
    // Signs change without a rule: one that becomes a nought costs less than a branch.
    let signs = u32::from(bytes as u8 == b'-');
    let sign = signs as usize;
    let bytes = bytes ^ u64::from(signs * u32::from(b'-' ^ b'0'));
    let others = NonZeroU64::new(not_digits(bytes))?;
    let whole = others.trailing_zeros() / 8;
    if (bytes >> (8 * whole)) as u8 != b'.' {
        // A sign alone is no number.
        if whole <= signs {
            return None;
        }
        let value = whole_number(bytes, whole) as f64 * SIGNED_POWERS_OF_TEN[sign][0];
        return Some((value, 1 + whole as usize));
    }
    let (value, decimals) = match NonZeroU64::new(others.get() & (others.get() - 1)) {
        Some(behind_point) => {
            let digits = behind_point.trailing_zeros() / 8 - 1;
            if digits <= signs {
                return None;
            }
            let before_point = (1 << (8 * whole)) - 1;
            let bytes = bytes & before_point | bytes >> 8 & !before_point;
            (whole_number(bytes, digits), digits - whole)
        }
        None => {
            let fraction = eight_bytes(word, whole as usize + 2)?;
            let decimals = not_digits(fraction).trailing_zeros() / 8;
            let scale = WHOLE_POWERS_OF_TEN.get(decimals as usize)?;
            if whole == 0 || decimals == 0 {
                return None;
            }
            (whole_number(bytes, whole) * scale + whole_number(fraction, decimals), decimals)
        }
    };
    // Codes have one decimal at most: others are those nearby.
    if decimals > 1 && matches!(letter, b'G' | b'M') {
        return None;
    }
    let value = value as f64 / SIGNED_POWERS_OF_TEN[sign].get(decimals as usize)?;
    Some((value, (whole + decimals) as usize + 2))
}

/// The highest bit of each of eight bytes that is no digit. A carry from a byte that is not ASCII may
/// take the digit behind it for none; nobody looks there.
#[inline]
fn not_digits(bytes: u64) -> u64 {
    // A digit becomes its value, any other byte more than nine.
    let values = bytes ^ (ONES * u64::from(b'0'));
    (values | values.wrapping_add(ONES * (0x7f - 9))) & (ONES * 0x80)
}

/// The number of the first of eight bytes, which are so many digits, one at least. Each joins its
/// neighbour, then twos and fours do.
#[inline]
fn whole_number(bytes: u64, digits: u32) -> i64 {
    // Zeros come before the digits, in the place of what stands behind them.
    let ones = (bytes ^ (ONES * u64::from(b'0'))).wrapping_shl(64 - 8 * digits);
    let twos = (ones * 10 + (ones >> 8)) & 0x00ff_00ff_00ff_00ff;
    let fours = (twos * 100 + (twos >> 16)) & 0x0000_ffff_0000_ffff;
    ((fours * 10_000 + (fours >> 32)) & 0xffff_ffff) as i64
}

/// Eight bytes from a place on, the first in the lowest bits.
#[inline]
fn eight_bytes(word: &[u8; WORD_BYTES], begin: usize) -> Option<u64> {
    word.get(begin..)?.first_chunk().map(|bytes| u64::from_le_bytes(*bytes))
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
            let end = plain_words(line.as_bytes(), &mut block).end;
            let words = block.words();
            prop_assert_eq!(words.last().map_or(0, |word| word.end as usize), end);
            for word in words {
                let (rest, value) = number(&line.as_bytes()[word.start as usize + 1..]).unwrap();
                prop_assert_eq!(word.value.to_bits(), value.to_bits());
                prop_assert_eq!(word.end as usize, line.len() - rest.len());
            }
        }

        #[test]
        fn words_of_up_to_six_digits_before_and_behind_the_point_are_plain(
            line in "(N[0-9]{1,7} ?)?(G1 ?)?(X-?[0-9]{1,5}\\.[0-9]{0,6} ?)?(Y-?\\.[0-9]{1,5})?",
        ) {
            let next = plain_words(line.as_bytes(), &mut Block::default()).next;
            prop_assert_eq!(next, line.len());
        }
    }
}
