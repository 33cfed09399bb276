//! The words that most lines consist of, a letter and a short number, in a loop of their own.
//!
//! Whatever else stands in a line, or may be wrong with it, is left to the parser, which would have
//! read these words the same.

use super::block::{Block, Word};
use super::number::{POWERS_OF_TEN, is_blank};

/// Digits before the point, and in all: the number is below the greatest there is, and its digits
/// as a whole number are exact in f64, as are the powers of ten; so the quotient is correctly
/// rounded.
const WHOLE_MAX: usize = 9;
const DIGITS_MAX: usize = 15;

/// Reads words from the beginning of a line as long as they are plain, and gives what follows.
pub(super) fn plain_words<'a>(line: &'a [u8], block: &mut Block) -> &'a [u8] {
    let mut end = 0;
    while let Some(word) = plain_word(line, after_blanks(line, end)) {
        if block.push(word).is_err() {
            break;
        }
        end = word.end as usize;
    }
    &line[end..]
}

/// The word at a place, if it is plain.
fn plain_word(line: &[u8], start: usize) -> Option<Word> {
    let letter = line.get(start)?.to_ascii_uppercase();
    // An O may begin a statement.
    if !letter.is_ascii_uppercase() || letter == b'O' {
        return None;
    }
    let negative = line.get(start + 1) == Some(&b'-');
    let (mut end, mut digits) = (start + 1 + usize::from(negative), 0);
    let whole = read_digits(line, &mut end, &mut digits);
    let mut decimals = 0;
    if line.get(end) == Some(&b'.') {
        end += 1;
        decimals = read_digits(line, &mut end, &mut digits);
    }
    // A number may go on behind blanks.
    let goes_on = matches!(line.get(after_blanks(line, end)), Some(b'0'..=b'9' | b'.'));
    let is_short = whole <= WHOLE_MAX && (1..=DIGITS_MAX).contains(&(whole + decimals));
    // Codes have one decimal at most: others are those nearby.
    let is_odd_code = decimals > 1 && matches!(letter, b'G' | b'M');
    if goes_on || !is_short || is_odd_code {
        return None;
    }
    let magnitude = digits as f64 / POWERS_OF_TEN.get(decimals)?;
    let value = if negative { -magnitude } else { magnitude };
    Some(Word { letter, value, start: start as u32, end: end as u32 })
}

/// Takes digits into a number, and counts them. It wraps where there are too many.
#[inline]
fn read_digits(line: &[u8], at: &mut usize, number: &mut i64) -> usize {
    let from = *at;
    while let Some(digit @ 0..=9) = line.get(*at).map(|byte| byte.wrapping_sub(b'0')) {
        *number = number.wrapping_mul(10).wrapping_add(i64::from(digit));
        *at += 1;
    }
    *at - from
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
            text in "[A-Z]-?[0-9]{0,11}\\.?[0-9]{0,9}[ .]?[ .0-9X]{0,2}",
        ) {
            if let Some(word) = plain_word(text.as_bytes(), 0) {
                let (rest, value) = number(&text.as_bytes()[1..]).unwrap();
                prop_assert_eq!(word.value.to_bits(), value.to_bits());
                prop_assert_eq!(word.end as usize, text.len() - rest.len());
            }
        }
    }
}
