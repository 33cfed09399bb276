//! Codes that mean something else on FANUC-style lathes (system A) than in the table of all others:
//! what the dialect `fanuc-lathe` reads first.

use super::block::letter_set;
use super::codes::{Code, Follow, Group, Op, Single, Stock};

const fn g(tenths: u16, group: Group, op: Op, words: &str, meaning: &'static str) -> Code {
    let words = letter_set(words);
    Code { letter: b'G', tenths, group, op: Some(op), words, meaning }
}

/// A code that is known and not supported.
const fn no_g(number: u16, meaning: &'static str) -> Code {
    let (letter, tenths, group) = (b'G', number * 10, Group::Motion);
    Code { letter, tenths, group, op: None, words: 0, meaning }
}

/// The table.
#[rustfmt::skip]
pub static LATHE_CODES: &[Code] = &[
    g(320, Group::Motion, Op::Follow(Follow::Thread), "", "cuts a thread, F along its longer axis a turn"),
    g(500, Group::NonModal, Op::LatheSetting, "", "sets the position, or with S the greatest speed of the spindle"),
    g(700, Group::NonModal, Op::Stock(Stock::Finish), "PQ", "runs the blocks N P to N Q as a finishing pass"),
    g(710, Group::NonModal, Op::Stock(Stock::Turn), "PQR", "roughs out the contour of the blocks N P to N Q in cuts along Z"),
    g(720, Group::NonModal, Op::Stock(Stock::Face), "PQR", "roughs out the contour of the blocks N P to N Q in cuts along X"),
    g(730, Group::NonModal, Op::Stock(Stock::Repeat), "PQR", "repeats the contour of the blocks N P to N Q, nearer each time"),
    no_g(68, "mirrors opposite turrets"),
    no_g(69, "ends the mirroring of opposite turrets"),
    no_g(74, "peck drilling or grooving along Z"),
    no_g(75, "grooving along X"),
    g(760, Group::NonModal, Op::ThreadCycle, "PQR", "threading cycle of two blocks"),
    no_g(81, "not a code of lathes"),
    no_g(82, "not a code of lathes"),
    no_g(83, "drilling cycle of driven tools, on the face"),
    no_g(84, "tapping cycle of driven tools, on the face"),
    no_g(85, "boring cycle of driven tools, on the face"),
    no_g(86, "not a code of lathes"),
    no_g(87, "drilling cycle of driven tools, on the side"),
    no_g(88, "tapping cycle of driven tools, on the side"),
    no_g(89, "boring cycle of driven tools, on the side"),
    g(900, Group::Motion, Op::Single(Single::Turn), "R", "one cut along Z: in, along, out, back"),
    no_g(91, "distances: on lathes they are written as U and W"),
    g(920, Group::Motion, Op::Single(Single::Thread), "R", "one pass of a thread: in, along, out, back"),
    g(940, Group::Motion, Op::Single(Single::Face), "R", "one cut along X: in, along, out, back"),
    no_g(93, "inverse time feed"),
    g(980, Group::FeedMode, Op::FeedPerMinute, "", "F is in mm or inches a minute"),
    g(990, Group::FeedMode, Op::FeedPerTurn, "", "F is in mm or inches a turn of the spindle"),
];

/// What a G word means on a lathe where that differs from the table of all others.
pub fn find_lathe(letter: u8, number: f64) -> Option<&'static Code> {
    LATHE_CODES
        .iter()
        .find(|code| letter == code.letter && (number * 10.0 - f64::from(code.tenths)).abs() < 1e-6)
}
