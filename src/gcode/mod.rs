//! 1 text → Block: lines of an NC program become words.
//!
//! Keeps the place of every word, so that whatever is found wrong later can be marked in the
//! text. Knows which words exist ([`codes`]) and what can be wrong with a program ([`rules`]);
//! what the words do to the machine is not known here.

mod block;
pub mod codes;
mod control;
mod expr;
mod fault;
pub mod foreign;
mod lathe;
mod lines;
mod name;
pub mod notes;
mod number;
mod ops;
mod parser;
mod plain;
pub mod rules;
mod stray;
pub mod words;

pub use block::{
    Block, COMMA_A, COMMA_C, COMMA_R, Call, Message, MessageKind, Word, letter_bit, letter_name,
    letter_set,
};
pub use control::{Assignment, Control, Label, Statement};
pub use expr::{Binary, Formula, Function, Step};
pub use fault::Fault;
pub use lathe::{LATHE_B_CODES, LATHE_CODES, LatheSystem, find_lathe};
pub use lines::{LINE_BYTES_MAX, Line, Lines};
pub use name::Name;
pub use number::short;
pub use parser::{parse, parse_next};
