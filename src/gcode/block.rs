//! One line of a program as words, and what it does besides.

use std::fmt;

use super::control::{Assignment, Statement};
use super::expr::{Formula, Step, value_written};
use super::number::short;

/// A letter and its number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Word {
    /// Upper-case letter, or `@`, `^`, `$`, or one of [`COMMA_A`], [`COMMA_C`], [`COMMA_R`].
    pub letter: u8,
    /// The number, as written: no unit is known here.
    pub value: f64,
    /// Byte of the line at which the word begins.
    pub start: u32,
    /// Byte of the line just after the word.
    pub end: u32,
}

/// The letter of `,A`: the angle of a line.
pub const COMMA_A: u8 = 27;
/// The letter of `,C`: a chamfer at the end of a line.
pub const COMMA_C: u8 = 28;
/// The letter of `,R`: a fillet at the end of a line or an arc.
pub const COMMA_R: u8 = 29;

/// A word's letter as it is written: `X`, or `,R`.
pub fn letter_name(letter: u8) -> String {
    match letter {
        COMMA_A => ",A".to_owned(),
        COMMA_C => ",C".to_owned(),
        COMMA_R => ",R".to_owned(),
        _ => char::from(letter).to_string(),
    }
}

/// As people read it, for messages.
impl fmt::Display for Word {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", letter_name(self.letter), short(self.value))
    }
}

/// A subroutine call: `GR100`, or `GR` with its number in a P word.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Call {
    /// The number that follows GR, if one does.
    pub number: Option<f64>,
    /// Byte of the line at which `GR` begins.
    pub start: u32,
    /// Byte of the line just after it and its number.
    pub end: u32,
}

/// What a comment says to the operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MessageKind {
    /// `(MSG, …)`
    Message,
    /// `(DEBUG, …)`: parameters in it are shown by their values.
    Debug,
    /// `(PRINT, …)`: as DEBUG.
    Print,
}

/// A comment that says something to the operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Message {
    /// Which of the three it is.
    pub kind: MessageKind,
    /// Byte of the line at which its text begins.
    pub start: u32,
    /// Byte of the line just after its text.
    pub end: u32,
}

/// What a line holds besides words and numbers.
#[derive(Clone, Debug, Default)]
pub(super) struct Extras {
    /// The expressions of the line, one after the other.
    pub code: Vec<Step>,
    /// Words whose value is an expression: their place among the words.
    pub values: Vec<(u16, Formula)>,
    pub assignments: Vec<Assignment>,
    pub statement: Option<Statement>,
    /// Whether a statement stands here that cannot be read.
    pub is_broken: bool,
    pub messages: Vec<Message>,
}

/// The words of one line. Made to be reused: clearing it frees nothing.
#[derive(Clone, Debug)]
pub struct Block {
    /// Whether the line begins with `/` (block delete).
    pub delete: bool,
    /// Whether the line is a `%`: the beginning or end of the program's text.
    pub percent: bool,
    /// The subroutine call, if the line is one.
    pub call: Option<Call>,
    words: Vec<Word>,
    present: u32,
    /// Whether a letter stands more than once.
    repeats: bool,
    /// Where in `words` the first word of each letter stands; valid where `present` says so.
    places: [u16; 32],
    /// Whether `extras` is empty.
    is_plain: bool,
    extras: Extras,
}

impl Default for Block {
    fn default() -> Self {
        Block {
            delete: false,
            percent: false,
            call: None,
            words: Vec::with_capacity(16),
            present: 0,
            repeats: false,
            places: [0; 32],
            is_plain: true,
            extras: Extras::default(),
        }
    }
}

/// Two lines are the same block if they hold the same words in the same order, wherever these
/// stand in the line.
impl PartialEq for Block {
    fn eq(&self, other: &Self) -> bool {
        let values = |block: &Block| -> Vec<(u8, f64)> {
            block.words.iter().map(|word| (word.letter, word.value)).collect()
        };
        let call = |block: &Block| block.call.map(|call| call.number);
        self.delete == other.delete
            && self.percent == other.percent
            && call(self) == call(other)
            && values(self) == values(other)
            && (self.is_plain && other.is_plain || self.to_string() == other.to_string())
    }
}

/// The place of a word's letter among 32: `@` 0, `A` to `Z` 1 to 26, `,A` `,C` `,R` 27 to 29, `^`
/// 30, `$` 31.
const fn letter_place(letter: u8) -> u8 {
    if letter == b'$' { 31 } else { letter & 31 }
}

/// The bit of a word's letter in a set of letters.
pub const fn letter_bit(letter: u8) -> u32 {
    1 << letter_place(letter)
}

/// The set of the letters of a text, which has to be of letters of words.
pub const fn letter_set(letters: &str) -> u32 {
    let letters = letters.as_bytes();
    let mut set = 0;
    let mut i = 0;
    while i < letters.len() {
        set |= letter_bit(letters[i]);
        i += 1;
    }
    set
}

impl Block {
    /// Makes the block empty.
    pub fn clear(&mut self) {
        self.delete = false;
        self.percent = false;
        self.call = None;
        self.words.clear();
        (self.present, self.repeats) = (0, false);
        if !self.is_plain {
            self.is_plain = true;
            self.extras.code.clear();
            self.extras.values.clear();
            self.extras.assignments.clear();
            self.extras.statement = None;
            self.extras.is_broken = false;
            self.extras.messages.clear();
        }
    }

    /// Whether nothing on the line asks for anything: blank, or a comment.
    pub fn is_empty(&self) -> bool {
        self.words.is_empty() && self.call.is_none() && !self.percent && self.is_plain
    }

    /// Whether there is nothing on the line but words with numbers.
    pub fn is_plain(&self) -> bool {
        self.is_plain
    }

    /// Whether there are words with numbers on the line, and nothing else.
    pub fn is_words_only(&self) -> bool {
        self.is_plain && !self.words.is_empty() && self.call.is_none()
    }

    /// Where the program goes on, if the line decides that.
    pub fn statement(&self) -> Option<&Statement> {
        self.extras.statement.as_ref()
    }

    /// Whether the line decides where the program goes on, but cannot be read.
    pub fn is_broken_statement(&self) -> bool {
        self.extras.is_broken
    }

    /// What the line sets.
    pub fn assignments(&self) -> &[Assignment] {
        &self.extras.assignments
    }

    /// What the line says to the operator.
    pub fn messages(&self) -> &[Message] {
        &self.extras.messages
    }

    /// Words whose values are expressions: places among the words, in order. Their numbers mean
    /// nothing until [`Block::give_value`] has given them.
    pub fn values(&self) -> &[(u16, Formula)] {
        &self.extras.values
    }

    /// The code of an expression of this block.
    pub fn code(&self, formula: Formula) -> &[Step] {
        self.extras.code.get(formula.start as usize..formula.end as usize).unwrap_or_default()
    }

    /// Gives the word at a place the value that its expression has.
    pub fn give_value(&mut self, place: u16, value: f64) {
        if let Some(word) = self.words.get_mut(usize::from(place)) {
            word.value = value;
        }
    }

    /// Takes the words of another block, without what else stands there.
    pub fn copy_words(&mut self, other: &Block) {
        self.clear();
        self.delete = other.delete;
        self.call = other.call;
        self.words.extend_from_slice(&other.words);
        (self.present, self.repeats) = (other.present, other.repeats);
        self.places = other.places;
    }

    /// Takes words out: those at the places given, which are in order.
    pub fn leave_out(&mut self, places: &[u16]) {
        let words = std::mem::take(&mut self.words);
        (self.present, self.repeats) = (0, false);
        for (place, word) in words.into_iter().enumerate() {
            if places.binary_search(&(place as u16)).is_err() {
                self.push_again(word);
            }
        }
    }

    /// Puts words in the place of others: those of `letters` go, `words` come to the end.
    pub fn replace(&mut self, letters: u32, words: impl IntoIterator<Item = Word>) {
        let before = std::mem::take(&mut self.words);
        (self.present, self.repeats) = (0, false);
        let stay = before.into_iter().filter(|word| letters & letter_bit(word.letter) == 0);
        for word in stay.chain(words) {
            self.push_again(word);
        }
    }

    /// All words in the order of the line.
    pub fn words(&self) -> &[Word] {
        &self.words
    }

    /// The letters that occur, as a set: see [`letter_bit`].
    pub fn letters(&self) -> u32 {
        self.present
    }

    /// Whether a letter occurs more than once.
    pub fn repeats_letter(&self) -> bool {
        self.repeats
    }

    /// Whether a letter occurs.
    pub fn has(&self, letter: u8) -> bool {
        self.present & letter_bit(letter) != 0
    }

    /// The first word of an upper-case letter.
    pub fn word(&self, letter: u8) -> Option<&Word> {
        if !self.has(letter) {
            return None;
        }
        self.words.get(usize::from(self.places[usize::from(letter_place(letter))]))
    }

    /// The first word of each letter of a set, in the order of letters.
    #[inline]
    pub fn words_of(&self, letters: u32) -> impl Iterator<Item = &Word> {
        let mut left = self.present & letters;
        std::iter::from_fn(move || {
            let place = self.places.get(left.trailing_zeros() as usize)?;
            left &= left - 1;
            self.words.get(usize::from(*place))
        })
    }

    /// The first word whose letter is in a set.
    pub fn first_of(&self, letters: u32) -> Option<&Word> {
        self.words.iter().find(|word| letters & letter_bit(word.letter) != 0)
    }

    /// Whether G65 or G66 stands there: what goes with it are arguments.
    pub fn is_macro_call(&self) -> bool {
        self.words.iter().any(|word| word.letter == b'G' && matches!(word.value, 65.0 | 66.0))
    }

    /// From the first word to the last, as bytes of the line.
    pub fn extent(&self) -> (u32, u32) {
        let words = (self.words.first().map(|w| w.start), self.words.last().map(|w| w.end));
        let call = (self.call.map(|call| call.start), self.call.map(|call| call.end));
        let statement = self.statement().map(|statement| (statement.start, statement.end));
        let set = self.assignments();
        let sets = (set.first().map(|set| set.start), set.last().map(|set| set.end));
        let start = [words.0, call.0, statement.map(|s| s.0), sets.0].into_iter().flatten().min();
        let end = [words.1, call.1, statement.map(|s| s.1), sets.1].into_iter().flatten().max();
        (start.unwrap_or(0), end.unwrap_or(1))
    }

    /// Adds a word. Gives it back if its letter, other than G and M, stands there already.
    #[inline]
    pub(super) fn push(&mut self, word: Word) -> Result<(), Word> {
        let place = letter_place(word.letter);
        if self.present >> place & 1 == 0 {
            self.present |= 1 << place;
            // A line of 64 KiB holds at most 32 Ki words.
            self.places[usize::from(place)] = self.words.len() as u16;
        } else if word.letter == b'G' || word.letter == b'M' {
            self.repeats = true;
        } else {
            return Err(word);
        }
        self.words.push(word);
        Ok(())
    }

    /// Adds a word whose letter may stand there already.
    pub(super) fn push_again(&mut self, word: Word) {
        if self.push(word).is_err() {
            self.repeats = true;
            self.words.push(word);
        }
    }

    /// What the line holds besides words, to add to it.
    pub(super) fn extras(&mut self) -> &mut Extras {
        self.is_plain = false;
        &mut self.extras
    }

    /// Takes the word read last for one whose value is an expression.
    pub(super) fn last_is(&mut self, formula: Formula) {
        let place = self.words.len().saturating_sub(1) as u16;
        self.extras().values.push((place, formula));
    }
}

/// The canonical form of the line.
impl fmt::Display for Block {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.delete {
            f.write_str("/")?;
        }
        if self.percent {
            return f.write_str("%");
        }
        let mut separator = "";
        if let Some(call) = &self.call {
            f.write_str("GR")?;
            call.number.map_or(Ok(()), |number| write!(f, "{number}"))?;
            separator = " ";
        }
        for (place, word) in self.words.iter().enumerate() {
            match self.values().iter().find(|(of, _)| usize::from(*of) == place) {
                Some((_, formula)) => {
                    let value = value_written(self.code(*formula));
                    write!(f, "{separator}{}{value}", letter_name(word.letter))?;
                }
                None => write!(f, "{separator}{}{}", letter_name(word.letter), word.value)?,
            }
            separator = " ";
        }
        let code = |formula| self.code(formula);
        if let Some(statement) = self.statement() {
            write!(f, "{separator}{}", statement.written(code))?;
            separator = " ";
        }
        for assignment in self.assignments() {
            write!(f, "{separator}{}", assignment.written(code))?;
            separator = " ";
        }
        Ok(())
    }
}
