//! THE table of G and M codes: what each one is, its modal group, the words it takes, and whether
//! it is supported. The parser's checks, the executor and all explanations read this table.
//!
//! A new code is a row here, an arm in `interp` and a sample.

use super::block::{letter_bit, letter_set};

/// What a supported code does.
#[allow(missing_docs)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Op {
    Inches,
    Millimetres,
    FeedPerMinute,
    ToolChange,
    SpindleClockwise,
    SpindleCounterClockwise,
    SpindleStop,
    SpindleSpeedConstant,
    MistOn,
    FloodOn,
    CoolantOff,
    Dwell,
    MachineCoordinates,
    PlaneXy,
    PlaneZx,
    PlaneYz,
    CompensationOff,
    LengthOffsetOff,
    WorkOffset1,
    ExactPath,
    Absolute,
    Incremental,
    ArcCenterIncremental,
    Rapid,
    Line,
    ArcClockwise,
    ArcCounterClockwise,
    MotionOff,
    Stop,
    OptionalStop,
    PalletStop,
    End,
    EndAndRewind,
    Return,
    Call,
    MacroCall,
}

/// The modal groups, in the order in which the codes of one block are executed: that of
/// RS274/NGC, but units first, so that the feed of the same block is in them.
///
/// Two codes of one group cannot stand in one block, M7 and M8 excepted.
#[allow(missing_docs)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Group {
    Units,
    FeedMode,
    SpindleMode,
    ToolChange,
    Spindle,
    Coolant,
    Override,
    NonModal,
    Plane,
    Compensation,
    LengthOffset,
    CoordinateSystem,
    PathControl,
    Diameter,
    Distance,
    ArcDistance,
    Polar,
    Scaling,
    Rotation,
    ReturnLevel,
    Motion,
    Stop,
}

impl Group {
    /// What the codes of the group decide.
    pub fn name(self) -> &'static str {
        match self {
            Group::Units => "units",
            Group::FeedMode => "feed mode",
            Group::SpindleMode => "spindle speed mode",
            Group::ToolChange => "tool change",
            Group::Spindle => "spindle",
            Group::Coolant => "coolant",
            Group::Override => "override",
            Group::NonModal => "non-modal",
            Group::Plane => "plane",
            Group::Compensation => "cutter compensation",
            Group::LengthOffset => "tool length offset",
            Group::CoordinateSystem => "coordinate system",
            Group::PathControl => "path control",
            Group::Diameter => "diameter mode",
            Group::Distance => "distance mode",
            Group::ArcDistance => "arc distance mode",
            Group::Polar => "polar coordinates",
            Group::Scaling => "scaling",
            Group::Rotation => "rotation",
            Group::ReturnLevel => "return level",
            Group::Motion => "motion",
            Group::Stop => "stop",
        }
    }

    /// Whether a code of this group that is not supported leaves open where later words of the
    /// program lead.
    pub fn moves_coordinates(self) -> bool {
        match self {
            Group::NonModal
            | Group::LengthOffset
            | Group::CoordinateSystem
            | Group::Diameter
            | Group::ArcDistance
            | Group::Polar
            | Group::Scaling
            | Group::Rotation => true,
            Group::Units
            | Group::FeedMode
            | Group::SpindleMode
            | Group::ToolChange
            | Group::Spindle
            | Group::Coolant
            | Group::Override
            | Group::Plane
            | Group::Compensation
            | Group::PathControl
            | Group::Distance
            | Group::ReturnLevel
            | Group::Motion
            | Group::Stop => false,
        }
    }
}

/// A row of the table.
#[derive(Debug, PartialEq, Eq)]
pub struct Code {
    /// `G` or `M`.
    pub letter: u8,
    /// Ten times the code's number: G61.1 is 611.
    pub tenths: u16,
    /// The modal group.
    pub group: Group,
    /// What it does; none: it is known, but not supported.
    pub op: Option<Op>,
    /// Letters that it makes use of, beside the axes of a motion: see `letter_set`.
    pub words: u32,
    /// One sentence on what it means.
    pub meaning: &'static str,
}

impl Code {
    /// As it is written: `G61.1`.
    pub fn name(&self) -> String {
        let (letter, whole, tenth) = (char::from(self.letter), self.tenths / 10, self.tenths % 10);
        if tenth == 0 { format!("{letter}{whole}") } else { format!("{letter}{whole}.{tenth}") }
    }
}

/// Letters of axes.
pub const AXIS_LETTERS: u32 = letter_set("XYZABCUVW");
/// Letters that give an arc its centre or radius.
pub const ARC_LETTERS: u32 = letter_set("IJKR");
/// Letters that need no code to make use of them.
pub const FREE_LETTERS: u32 = letter_set("FGMNOST");

const fn row(letter: u8, tenths: u16, group: Group, op: Option<Op>, meaning: &'static str) -> Code {
    let words = match op {
        Some(Op::ArcClockwise | Op::ArcCounterClockwise) => ARC_LETTERS | letter_bit(b'P'),
        Some(Op::Dwell | Op::Return) => letter_bit(b'P'),
        Some(Op::Call) => letter_set("PL"),
        _ => 0,
    };
    Code { letter, tenths, group, op, words, meaning }
}

const fn g(tenths: u16, group: Group, op: Op, meaning: &'static str) -> Code {
    row(b'G', tenths, group, Some(op), meaning)
}

const fn m(number: u16, group: Group, op: Op, meaning: &'static str) -> Code {
    row(b'M', number * 10, group, Some(op), meaning)
}

/// A G code that is known and not supported.
const fn no_g(tenths: u16, group: Group, meaning: &'static str) -> Code {
    row(b'G', tenths, group, None, meaning)
}

/// An M code that is known and not supported.
const fn no_m(number: u16, group: Group, meaning: &'static str) -> Code {
    row(b'M', number * 10, group, None, meaning)
}

/// The table.
#[rustfmt::skip]
pub static CODES: &[Code] = &[
    g(0, Group::Motion, Op::Rapid, "moves as fast as the machine can"),
    g(10, Group::Motion, Op::Line, "moves in a straight line at the feed"),
    g(20, Group::Motion, Op::ArcClockwise, "moves in an arc or helix, clockwise"),
    g(30, Group::Motion, Op::ArcCounterClockwise, "moves in an arc or helix, counter-clockwise"),
    g(40, Group::NonModal, Op::Dwell, "waits for P seconds"),
    no_g(50, Group::Motion, "cubic spline"),
    no_g(51, Group::Motion, "quadratic spline"),
    no_g(52, Group::Motion, "opens a NURBS block"),
    no_g(53, Group::Motion, "closes a NURBS block"),
    no_g(62, Group::Motion, "NURBS interpolation"),
    no_g(70, Group::Diameter, "diameter mode of a lathe"),
    no_g(80, Group::Diameter, "radius mode of a lathe"),
    no_g(90, Group::NonModal, "exact stop for one block"),
    no_g(100, Group::NonModal, "sets tool or work offsets"),
    no_g(150, Group::Polar, "ends polar coordinates"),
    no_g(160, Group::Polar, "polar coordinates"),
    g(170, Group::Plane, Op::PlaneXy, "arcs lie in the XY plane"),
    g(180, Group::Plane, Op::PlaneZx, "arcs lie in the ZX plane"),
    g(190, Group::Plane, Op::PlaneYz, "arcs lie in the YZ plane"),
    g(200, Group::Units, Op::Inches, "lengths are in inches"),
    g(210, Group::Units, Op::Millimetres, "lengths are in millimetres"),
    no_g(280, Group::NonModal, "goes to the first reference position"),
    no_g(281, Group::NonModal, "stores the first reference position"),
    no_g(300, Group::NonModal, "goes to the second reference position"),
    no_g(301, Group::NonModal, "stores the second reference position"),
    no_g(310, Group::Motion, "moves until a signal comes"),
    no_g(330, Group::Motion, "moves in step with the spindle"),
    no_g(331, Group::Motion, "rigid tapping"),
    no_g(382, Group::Motion, "probes towards the work, with an alarm when nothing is met"),
    no_g(383, Group::Motion, "probes towards the work"),
    no_g(384, Group::Motion, "probes away from the work, with an alarm when contact stays"),
    no_g(385, Group::Motion, "probes away from the work"),
    g(400, Group::Compensation, Op::CompensationOff, "cutter compensation is off"),
    no_g(410, Group::Compensation, "cutter compensation, left of the path"),
    no_g(411, Group::Compensation, "dynamic cutter compensation, left of the path"),
    no_g(420, Group::Compensation, "cutter compensation, right of the path"),
    no_g(421, Group::Compensation, "dynamic cutter compensation, right of the path"),
    no_g(430, Group::LengthOffset, "tool length offset"),
    no_g(431, Group::LengthOffset, "dynamic tool length offset"),
    no_g(432, Group::LengthOffset, "additional tool length offset"),
    g(490, Group::LengthOffset, Op::LengthOffsetOff, "tool length offset is off"),
    no_g(500, Group::Scaling, "scaling is off"),
    no_g(510, Group::Scaling, "scaling"),
    no_g(520, Group::NonModal, "local coordinate system"),
    g(530, Group::NonModal, Op::MachineCoordinates, "this block's axis words are machine coordinates"),
    g(540, Group::CoordinateSystem, Op::WorkOffset1, "work coordinate system 1, at the profile's work zero"),
    no_g(550, Group::CoordinateSystem, "work coordinate system 2"),
    no_g(560, Group::CoordinateSystem, "work coordinate system 3"),
    no_g(570, Group::CoordinateSystem, "work coordinate system 4"),
    no_g(580, Group::CoordinateSystem, "work coordinate system 5"),
    no_g(590, Group::CoordinateSystem, "work coordinate system 6"),
    no_g(591, Group::CoordinateSystem, "work coordinate system 7"),
    no_g(592, Group::CoordinateSystem, "work coordinate system 8"),
    no_g(593, Group::CoordinateSystem, "work coordinate system 9"),
    g(610, Group::PathControl, Op::ExactPath, "keeps to the programmed path exactly"),
    no_g(611, Group::PathControl, "exact stop at the end of every block"),
    no_g(640, Group::PathControl, "blends corners within a tolerance"),
    g(650, Group::NonModal, Op::MacroCall, "calls the subprogram P with arguments"),
    no_g(680, Group::Rotation, "rotates coordinates"),
    no_g(690, Group::Rotation, "ends the rotation of coordinates"),
    no_g(730, Group::Motion, "drilling cycle with chip breaking"),
    no_g(740, Group::Motion, "left-hand tapping cycle"),
    no_g(760, Group::Motion, "threading or fine boring cycle"),
    g(800, Group::Motion, Op::MotionOff, "no motion code and no cycle is in force"),
    no_g(810, Group::Motion, "drilling cycle"),
    no_g(820, Group::Motion, "drilling cycle with a dwell"),
    no_g(830, Group::Motion, "deep hole drilling cycle"),
    no_g(840, Group::Motion, "right-hand tapping cycle"),
    no_g(850, Group::Motion, "boring cycle, feed out"),
    no_g(860, Group::Motion, "boring cycle, spindle stop, rapid out"),
    no_g(870, Group::Motion, "back boring cycle"),
    no_g(880, Group::Motion, "boring cycle, spindle stop, manual out"),
    no_g(890, Group::Motion, "boring cycle with a dwell, feed out"),
    g(900, Group::Distance, Op::Absolute, "axis words are positions"),
    no_g(901, Group::ArcDistance, "I J K are positions"),
    g(910, Group::Distance, Op::Incremental, "axis words are distances"),
    g(911, Group::ArcDistance, Op::ArcCenterIncremental, "I J K are distances from the arc's start"),
    no_g(920, Group::NonModal, "sets the position without moving"),
    no_g(921, Group::NonModal, "resets the G92 offset"),
    no_g(922, Group::NonModal, "suspends the G92 offset"),
    no_g(923, Group::NonModal, "restores the G92 offset"),
    no_g(930, Group::FeedMode, "inverse time feed"),
    g(940, Group::FeedMode, Op::FeedPerMinute, "F is in mm or inches a minute"),
    no_g(950, Group::FeedMode, "F is in mm or inches a turn of the spindle"),
    no_g(960, Group::SpindleMode, "constant surface speed"),
    g(970, Group::SpindleMode, Op::SpindleSpeedConstant, "S is in turns a minute"),
    no_g(980, Group::ReturnLevel, "cycles return to the level they came from"),
    no_g(990, Group::ReturnLevel, "cycles return to the R level"),
    m(0, Group::Stop, Op::Stop, "stops until the operator goes on"),
    m(1, Group::Stop, Op::OptionalStop, "stops if the operator's switch is on"),
    m(2, Group::Stop, Op::End, "ends the program"),
    m(3, Group::Spindle, Op::SpindleClockwise, "starts the spindle clockwise"),
    m(4, Group::Spindle, Op::SpindleCounterClockwise, "starts the spindle counter-clockwise"),
    m(5, Group::Spindle, Op::SpindleStop, "stops the spindle"),
    m(6, Group::ToolChange, Op::ToolChange, "changes to the tool that T selected"),
    m(7, Group::Coolant, Op::MistOn, "mist coolant on"),
    m(8, Group::Coolant, Op::FloodOn, "flood coolant on"),
    m(9, Group::Coolant, Op::CoolantOff, "coolant off"),
    no_m(19, Group::Spindle, "orients the spindle"),
    m(30, Group::Stop, Op::EndAndRewind, "ends the program and goes back to its beginning"),
    no_m(48, Group::Override, "overrides are allowed"),
    no_m(49, Group::Override, "overrides are off"),
    no_m(50, Group::Override, "feed override control"),
    no_m(51, Group::Override, "spindle override control"),
    no_m(52, Group::Override, "adaptive feed control"),
    no_m(53, Group::Override, "feed hold control"),
    m(60, Group::Stop, Op::PalletStop, "stops for a change of pallets"),
    m(98, Group::Stop, Op::Call, "calls the subprogram P, L times"),
    m(99, Group::Stop, Op::Return, "ends a subprogram"),
];

/// Rows of the table by ten times the code's number, counted from 1; 0 where there is none.
const fn index(letter: u8) -> [u8; 1000] {
    let mut rows = [0; 1000];
    let mut i = 0;
    while i < CODES_COUNT {
        if CODES[i].letter == letter {
            rows[CODES[i].tenths as usize] = i as u8 + 1;
        }
        i += 1;
    }
    rows
}

const CODES_COUNT: usize = CODES.len();
static G_ROWS: [u8; 1000] = index(b'G');
static M_ROWS: [u8; 1000] = index(b'M');

/// The row of a G or M word, if there is one.
pub fn find(letter: u8, number: f64) -> Option<&'static Code> {
    let exact = number * 10.0;
    // Half a tenth rounds to the nearest; a cast cuts off, and takes what is negative to 0.
    let tenths = (exact + 0.5) as usize;
    // 1e-6 forgives what the product's rounding adds to a tenth.
    if (exact - tenths as f64).abs() > 1e-6 {
        return None;
    }
    let rows = if letter == b'G' { &G_ROWS } else { &M_ROWS };
    CODES.get(usize::from(*rows.get(tenths)?).checked_sub(1)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_is_found_by_its_number_and_stands_once() {
        for code in CODES {
            let number = code.name()[1..].parse().unwrap();
            assert!(std::ptr::eq(find(code.letter, number).unwrap(), code), "{}", code.name());
        }
        for (letter, number) in [(b'G', 5.7), (b'G', 1.05), (b'G', -1.0), (b'M', 100.0)] {
            assert!(find(letter, number).is_none(), "{number}");
        }
    }

    #[test]
    fn every_operation_is_that_of_one_code() {
        let ops: Vec<_> = CODES.iter().filter_map(|code| code.op).collect();
        for op in &ops {
            assert_eq!(ops.iter().filter(|other| *other == op).count(), 1, "{op:?}");
        }
    }
}
