//! The words that most lines consist of: a letter and a number, read in a loop of its own.

use super::block::{Block, Word};
use super::number::{is_blank, number};

/// Reads words with plain numbers, of which most lines are, and gives what follows them: whatever
/// else stands in the line, or may be wrong with it, is for the parser, which would have read them the same.
pub(super) fn plain_words<'a>(line: &'a [u8], block: &mut Block) -> &'a [u8] {
    let mut rest = line;
    while let [byte, after @ ..] = rest {
        if is_blank(*byte) {
            rest = after;
            continue;
        }
        let letter = byte.to_ascii_uppercase();
        // An O may begin a statement.
        let is_word = letter.is_ascii_uppercase() && letter != b'O';
        let has_number = matches!(after.first(), Some(b'0'..=b'9' | b'.' | b'-'));
        if !is_word || !has_number {
            break;
        }
        let Ok((behind, value)) = number(after) else { break };
        let place = |rest: &[u8]| (line.len() - rest.len()) as u32;
        let word = Word { letter, value, start: place(rest), end: place(behind) };
        if block.push(word).is_err() {
            break;
        }
        rest = behind;
    }
    rest
}
