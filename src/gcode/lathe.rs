//! Codes that mean something else on FANUC-style lathes than in the table of all others: what the
//! dialects `fanuc-lathe` (G code system A) and `fanuc-lathe-b` (system B) read first.

use super::block::letter_set;
use super::codes::{Code, Follow, Groove, Group, Hole, HoleKind, LatheCode, Op, Single, Stock};

const fn g(tenths: u16, group: Group, op: Op, words: &str, meaning: &'static str) -> Code {
    let words = letter_set(words);
    Code { letter: b'G', tenths, group, op: Some(op), words, meaning }
}

const fn single(number: u16, cycle: Single, meaning: &'static str) -> Code {
    let (letter, tenths, group, op) = (b'G', number * 10, Group::Motion, Some(Op::Single(cycle)));
    Code { letter, tenths, group, op, words: cycle.words(), meaning }
}

const fn hole(number: u16, hole: Hole, meaning: &'static str) -> Code {
    single(number, Single::Hole(hole), meaning)
}

/// A code that is known and not supported.
const fn no_g(number: u16, meaning: &'static str) -> Code {
    let (letter, tenths, group) = (b'G', number * 10, Group::Motion);
    Code { letter, tenths, group, op: None, words: 0, meaning }
}

/// The systems of G codes of FANUC-style lathes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LatheSystem {
    /// X and Z are positions, U and W distances; G90, G92 and G94 are cycles.
    A,
    /// G90 and G91 as on mills; G77, G78 and G79 are those cycles.
    B,
}

/// Ten times the numbers of the codes of the table that system B does not have: there they mean what
/// they mean on mills.
const OF_A_ALONE: [u16; 9] = [320, 500, 900, 910, 920, 930, 940, 980, 990];

/// Codes of system B that system A does not have.
#[rustfmt::skip]
pub static LATHE_B_CODES: &[Code] = &[
    single(77, Single::Turn, "one cut along Z: in, along, out, back"),
    single(78, Single::Thread, "one pass of a thread: in, along, out, back"),
    single(79, Single::Face, "one cut along X: in, along, out, back"),
    g(920, Group::NonModal, Op::Lathe(LatheCode::Setting), "", "sets the position, or with S the greatest speed of the spindle"),
];

/// The table.
#[rustfmt::skip]
pub static LATHE_CODES: &[Code] = &[
    g(320, Group::Motion, Op::Follow(Follow::Thread), "", "cuts a thread, F along its longer axis a turn"),
    g(500, Group::NonModal, Op::Lathe(LatheCode::Setting), "", "sets the position, or with S the greatest speed of the spindle"),
    g(700, Group::NonModal, Op::Stock(Stock::Finish), "PQ", "runs the blocks N P to N Q as a finishing pass"),
    g(710, Group::NonModal, Op::Stock(Stock::Turn), "DPQR", "roughs out the contour of the blocks N P to N Q in cuts along Z"),
    g(720, Group::NonModal, Op::Stock(Stock::Face), "DPQR", "roughs out the contour of the blocks N P to N Q in cuts along X"),
    g(730, Group::NonModal, Op::Stock(Stock::Repeat), "DIKPQR", "repeats the contour of the blocks N P to N Q, nearer each time"),
    no_g(68, "mirrors opposite turrets"),
    no_g(69, "ends the mirroring of opposite turrets"),
    g(740, Group::NonModal, Op::Lathe(LatheCode::Groove(Groove::Face)), "DIKPQR", "cuts a groove or a hole along Z, by pecks"),
    g(750, Group::NonModal, Op::Lathe(LatheCode::Groove(Groove::Side)), "DIKPQR", "cuts a groove along X, by pecks"),
    g(760, Group::NonModal, Op::Lathe(LatheCode::Thread), "ADIKPQR", "threading cycle of two blocks, or of one with K and D"),
    no_g(81, "on Haas lathes a drilling cycle; FANUC lathes drill by G83 without Q"),
    no_g(82, "on Haas lathes a drilling cycle with a dwell; FANUC lathes drill by G83 with P"),
    hole(83, Hole { side: false, kind: HoleKind::Drill }, "drilling cycle along Z"),
    hole(84, Hole { side: false, kind: HoleKind::Tap }, "tapping cycle along Z"),
    hole(85, Hole { side: false, kind: HoleKind::Bore }, "boring cycle along Z, feed out to R"),
    no_g(86, "on Haas lathes a boring cycle; FANUC lathes bore by G85"),
    hole(87, Hole { side: true, kind: HoleKind::Drill }, "drilling cycle along X"),
    hole(88, Hole { side: true, kind: HoleKind::Tap }, "tapping cycle along X"),
    hole(89, Hole { side: true, kind: HoleKind::Bore }, "boring cycle along X, feed out to R"),
    single(90, Single::Turn, "one cut along Z: in, along, out, back"),
    no_g(91, "distances: on lathes they are written as U and W"),
    single(92, Single::Thread, "one pass of a thread: in, along, out, back"),
    single(94, Single::Face, "one cut along X: in, along, out, back"),
    no_g(93, "inverse time feed"),
    g(980, Group::FeedMode, Op::FeedPerMinute, "", "F is in mm or inches a minute"),
    g(990, Group::FeedMode, Op::FeedPerTurn, "", "F is in mm or inches a turn of the spindle"),
];

/// What a G word means on a lathe where that differs from the table of all others.
pub fn find_lathe(letter: u8, number: f64, system: LatheSystem) -> Option<&'static Code> {
    let is_it = |code: &&Code| {
        letter == code.letter && (number * 10.0 - f64::from(code.tenths)).abs() < 1e-6
    };
    if system == LatheSystem::A {
        return LATHE_CODES.iter().find(is_it);
    }
    let of_both = LATHE_CODES.iter().filter(|code| !OF_A_ALONE.contains(&code.tenths));
    LATHE_B_CODES.iter().chain(of_both).find(is_it)
}
