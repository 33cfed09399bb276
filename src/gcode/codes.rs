//! THE table of G and M codes: what each one is, its modal group, the words it takes, and whether
//! it is supported. The parser's checks, the executor and all explanations read this table.
//!
//! A new code is a row here, an arm in `interp` and a sample.

use super::block::{COMMA_A, COMMA_C, COMMA_R, letter_bit, letter_name, letter_set};

pub use super::ops::{
    Cycle, Follow, Function, Groove, Hole, HoleKind, LatheCode, Length, Macro, Modes, Op, Pockets,
    Single, SplineCode, Stock, Turn,
};

/// The modal groups, in the order in which the codes of one block are executed: that of
/// RS274/NGC, but units first, since all lengths of the block are in them (its F is not: it is
/// taken before any code).
///
/// Two codes of one group cannot stand in one block, M7 with M8, and G80 with
/// another motion code, excepted.
#[allow(missing_docs)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Group {
    Units,
    FeedMode,
    SpindleMode,
    Output,
    ToolChange,
    Spindle,
    ModalState,
    Coolant,
    Override,
    UserFunction,
    Plane,
    Compensation,
    LengthOffset,
    CoordinateSystem,
    PathControl,
    Diameter,
    Distance,
    ArcDistance,
    Polar,
    Mirror,
    Scaling,
    Rotation,
    ReturnLevel,
    NonModal,
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
            Group::Output => "output",
            Group::ToolChange => "tool change",
            Group::Spindle => "spindle",
            Group::ModalState => "modal state",
            Group::Coolant => "coolant",
            Group::Override => "override",
            Group::UserFunction => "user's function",
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
            Group::Mirror => "mirror images",
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
            | Group::Mirror
            | Group::Scaling
            | Group::Rotation => true,
            Group::Units
            | Group::FeedMode
            | Group::SpindleMode
            | Group::Output
            | Group::ToolChange
            | Group::Spindle
            | Group::ModalState
            | Group::Coolant
            | Group::Override
            | Group::UserFunction
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
    /// The letters that it makes use of, beside the axes of a motion.
    pub fn letters(&self) -> Vec<String> {
        let has = |letter: &u8| self.words & letter_bit(*letter) != 0;
        (b'A'..=b'Z').chain([COMMA_A, COMMA_C, COMMA_R]).filter(has).map(letter_name).collect()
    }

    /// As it is written: `G61.1`.
    pub fn name(&self) -> String {
        let (letter, whole, tenth) = (char::from(self.letter), self.tenths / 10, self.tenths % 10);
        if self.op == Some(Op::Function(Function::User)) {
            return format!("{letter}{whole} to {letter}{}", USER_LAST / 10);
        }
        if tenth == 0 { format!("{letter}{whole}") } else { format!("{letter}{whole}.{tenth}") }
    }
}

/// Letters of axes.
pub const AXIS_LETTERS: u32 = letter_set("XYZABCUVW");
/// Letters that give an arc its centre or radius.
pub const ARC_LETTERS: u32 = letter_set("IJKR");
/// Letters that need no code to make use of them.
pub const FREE_LETTERS: u32 = letter_set("FGMNOST$");
/// Letters of drawing dimensions: the angle of a line, and what becomes of the corner at its end.
pub const CORNER_LETTERS: u32 = letter_bit(COMMA_A) | letter_bit(COMMA_C) | letter_bit(COMMA_R);
/// Letters of LinuxCNC's polar coordinates: the radius and the angle.
pub const POLAR_LETTERS: u32 = letter_set("@^");

/// Ten times the numbers of the first and the last user's function.
const USER_FIRST: u16 = 1000;
const USER_LAST: u16 = 1990;

const fn row(letter: u8, tenths: u16, group: Group, op: Option<Op>, meaning: &'static str) -> Code {
    let words = match op {
        Some(Op::Line) => CORNER_LETTERS,
        Some(Op::ArcClockwise | Op::ArcCounterClockwise) => {
            ARC_LETTERS | letter_bit(b'P') | letter_bit(COMMA_C) | letter_bit(COMMA_R)
        }
        Some(Op::Spline(code)) => code.words(),
        Some(
            Op::Dwell | Op::Return | Op::Override(_) | Op::FurtherSystem | Op::GoToReference(1),
        ) => letter_bit(b'P'),
        Some(Op::Blend) => letter_set("PQ"),
        Some(Op::SurfaceSpeed | Op::Compensate { by_diameter: false, .. }) => letter_bit(b'D'),
        // L, where a lathe tool's tip points to, changes nothing on its path.
        Some(Op::Compensate { by_diameter: true, .. }) => letter_set("DL"),
        Some(Op::SetOffsets) => letter_set("IJLPQR"),
        Some(Op::LengthOffset(Length::Table | Length::Subtracted | Length::More)) => {
            letter_bit(b'H')
        }
        Some(Op::LookAhead) => letter_set("EPQR"),
        Some(Op::Scaling) => letter_set("IJKP"),
        Some(Op::Rotation) => letter_bit(b'R'),
        Some(Op::Cycle(cycle)) => cycle.words(),
        Some(Op::Follow(follow)) => follow.words(),
        Some(Op::Turn(_)) => letter_set("DEIPQR"),
        Some(Op::WaitInput) => letter_set("ELPQ"),
        Some(Op::Call { .. }) => letter_set("PL"),
        Some(Op::Function(function)) => function.words(),
        Some(_) | None => 0,
    };
    Code { letter, tenths, group, op, words, meaning }
}

const fn g(tenths: u16, group: Group, op: Op, meaning: &'static str) -> Code {
    row(b'G', tenths, group, Some(op), meaning)
}

const fn m(number: u16, group: Group, op: Op, meaning: &'static str) -> Code {
    row(b'M', number * 10, group, Some(op), meaning)
}

/// The table.
#[rustfmt::skip]
pub static CODES: &[Code] = &[
    g(0, Group::Motion, Op::Rapid, "moves as fast as the machine can"),
    g(10, Group::Motion, Op::Line, "moves in a straight line at the feed"),
    g(20, Group::Motion, Op::ArcClockwise, "moves in an arc or helix, clockwise"),
    g(30, Group::Motion, Op::ArcCounterClockwise, "moves in an arc or helix, counter-clockwise"),
    g(40, Group::NonModal, Op::Dwell, "waits for P seconds"),
    g(50, Group::Motion, Op::Spline(SplineCode::Cubic), "moves along a cubic Bézier curve"),
    g(51, Group::Motion, Op::Spline(SplineCode::Quadratic), "moves along a quadratic Bézier curve"),
    g(52, Group::Motion, Op::Spline(SplineCode::Nurbs), "begins a NURBS: points and weights follow"),
    g(53, Group::Motion, Op::NurbsEnd, "ends the NURBS of G5.2 and moves along it"),
    g(62, Group::Motion, Op::Spline(SplineCode::NurbsByKnots), "moves along a NURBS of points, weights and knots"),
    g(70, Group::Diameter, Op::Diameter, "X words are diameters"),
    g(80, Group::Diameter, Op::Radius, "X words are radii"),
    g(90, Group::NonModal, Op::ExactStopOnce, "exact stop for one block"),
    g(100, Group::NonModal, Op::SetOffsets, "sets tool or work offsets"),
    g(150, Group::Polar, Op::PolarOff, "ends polar coordinates"),
    g(160, Group::Polar, Op::Polar, "polar coordinates"),
    g(170, Group::Plane, Op::PlaneXy, "arcs lie in the XY plane"),
    g(180, Group::Plane, Op::PlaneZx, "arcs lie in the ZX plane"),
    g(190, Group::Plane, Op::PlaneYz, "arcs lie in the YZ plane"),
    g(200, Group::Units, Op::Inches, "lengths are in inches"),
    g(210, Group::Units, Op::Millimetres, "lengths are in millimetres"),
    g(280, Group::NonModal, Op::GoToReference(0), "goes to the first reference position"),
    g(281, Group::NonModal, Op::StoreReference(0), "stores the first reference position"),
    g(300, Group::NonModal, Op::GoToReference(1), "goes to the second reference position"),
    g(301, Group::NonModal, Op::StoreReference(1), "stores the second reference position"),
    g(310, Group::Motion, Op::Follow(Follow::Skip), "moves until a signal comes"),
    g(330, Group::Motion, Op::Follow(Follow::Thread), "moves in step with the spindle, K along the path a turn"),
    g(331, Group::Motion, Op::Follow(Follow::Tap), "rigid tapping: there and back in step with the spindle"),
    g(382, Group::Motion, Op::Follow(Follow::Probe(2)), "probes towards the work, with an alarm when nothing is met"),
    g(383, Group::Motion, Op::Follow(Follow::Probe(3)), "probes towards the work"),
    g(384, Group::Motion, Op::Follow(Follow::Probe(4)), "probes away from the work, with an alarm when contact stays"),
    g(385, Group::Motion, Op::Follow(Follow::Probe(5)), "probes away from the work"),
    g(400, Group::Compensation, Op::CompensationOff, "cutter compensation is off"),
    g(410, Group::Compensation, Op::Compensate { left: true, by_diameter: false }, "cutter compensation, left of the path"),
    g(411, Group::Compensation, Op::Compensate { left: true, by_diameter: true }, "dynamic cutter compensation, left of the path"),
    g(420, Group::Compensation, Op::Compensate { left: false, by_diameter: false }, "cutter compensation, right of the path"),
    g(421, Group::Compensation, Op::Compensate { left: false, by_diameter: true }, "dynamic cutter compensation, right of the path"),
    g(430, Group::LengthOffset, Op::LengthOffset(Length::Table), "tool length offset"),
    g(431, Group::LengthOffset, Op::LengthOffset(Length::Words), "dynamic tool length offset"),
    g(432, Group::LengthOffset, Op::LengthOffset(Length::More), "additional tool length offset"),
    g(440, Group::LengthOffset, Op::LengthOffset(Length::Subtracted), "tool length offset, subtracted"),
    g(490, Group::LengthOffset, Op::LengthOffset(Length::Off), "tool length offset is off"),
    g(500, Group::Scaling, Op::ScalingOff, "scaling is off"),
    g(501, Group::Mirror, Op::Mirror { on: false }, "ends the mirror image of the axes that are named, or of all"),
    g(510, Group::Scaling, Op::Scaling, "scaling"),
    g(511, Group::Mirror, Op::Mirror { on: true }, "mirror image: each axis word is where that axis is mirrored"),
    g(520, Group::NonModal, Op::LocalOffset, "local coordinate system"),
    g(530, Group::NonModal, Op::MachineCoordinates, "this block's axis words are machine coordinates"),
    g(540, Group::CoordinateSystem, Op::WorkSystem(0), "work coordinate system 1, at the profile's work zero"),
    g(541, Group::CoordinateSystem, Op::FurtherSystem, "further work coordinate system P, 1 to 300 (G54 P is the same)"),
    g(550, Group::CoordinateSystem, Op::WorkSystem(1), "work coordinate system 2"),
    g(560, Group::CoordinateSystem, Op::WorkSystem(2), "work coordinate system 3"),
    g(570, Group::CoordinateSystem, Op::WorkSystem(3), "work coordinate system 4"),
    g(580, Group::CoordinateSystem, Op::WorkSystem(4), "work coordinate system 5"),
    g(590, Group::CoordinateSystem, Op::WorkSystem(5), "work coordinate system 6"),
    g(591, Group::CoordinateSystem, Op::WorkSystem(6), "work coordinate system 7"),
    g(592, Group::CoordinateSystem, Op::WorkSystem(7), "work coordinate system 8"),
    g(593, Group::CoordinateSystem, Op::WorkSystem(8), "work coordinate system 9"),
    g(610, Group::PathControl, Op::ExactPath, "keeps to the programmed path exactly"),
    g(611, Group::PathControl, Op::ExactStop, "exact stop at the end of every block"),
    g(640, Group::PathControl, Op::Blend, "blends corners within a tolerance"),
    g(650, Group::NonModal, Op::Macro(Macro::Call), "calls the subprogram P with arguments"),
    g(660, Group::NonModal, Op::Macro(Macro::Modal), "calls the subprogram P with arguments after every move, up to G67"),
    g(670, Group::Stop, Op::Macro(Macro::ModalOff), "ends the calls of G66"),
    g(680, Group::Rotation, Op::Rotation, "rotates coordinates"),
    g(690, Group::Rotation, Op::RotationOff, "ends the rotation of coordinates"),
    g(700, Group::Motion, Op::Turn(Turn::Finish), "turns along the contour of the subprogram Q"),
    g(710, Group::Motion, Op::Turn(Turn::Rough { faces: false, pockets: Pockets::Cut }), "roughs out the contour of the subprogram Q in cuts along Z"),
    g(711, Group::Motion, Op::Turn(Turn::Rough { faces: false, pockets: Pockets::Leave }), "roughs out the contour of the subprogram Q in cuts along Z, but for pockets"),
    g(712, Group::Motion, Op::Turn(Turn::Rough { faces: false, pockets: Pockets::Only }), "roughs out the contour of the subprogram Q in cuts along Z, pockets only"),
    g(720, Group::Motion, Op::Turn(Turn::Rough { faces: true, pockets: Pockets::Cut }), "roughs out the contour of the subprogram Q in cuts along X"),
    g(721, Group::Motion, Op::Turn(Turn::Rough { faces: true, pockets: Pockets::Leave }), "roughs out the contour of the subprogram Q in cuts along X, but for pockets"),
    g(722, Group::Motion, Op::Turn(Turn::Rough { faces: true, pockets: Pockets::Only }), "roughs out the contour of the subprogram Q in cuts along X, pockets only"),
    g(730, Group::Motion, Op::Cycle(Cycle::DrillChipBreak), "drilling cycle with chip breaking"),
    g(740, Group::Motion, Op::Cycle(Cycle::TapLeft), "left-hand tapping cycle"),
    g(760, Group::Motion, Op::Cycle(Cycle::BoreFine), "threading cycle (K and P stand in the block), or fine boring cycle: spindle oriented, rapid out beside the wall"),
    g(800, Group::Motion, Op::MotionOff, "no motion code and no cycle is in force"),
    g(810, Group::Motion, Op::Cycle(Cycle::Drill), "drilling cycle"),
    g(820, Group::Motion, Op::Cycle(Cycle::DrillDwell), "drilling cycle with a dwell"),
    g(830, Group::Motion, Op::Cycle(Cycle::DrillDeep), "deep hole drilling cycle"),
    g(840, Group::Motion, Op::Cycle(Cycle::Tap), "right-hand tapping cycle"),
    g(850, Group::Motion, Op::Cycle(Cycle::BoreFeedOut), "boring cycle, feed out to R"),
    g(860, Group::Motion, Op::Cycle(Cycle::BoreStop), "boring cycle, spindle stop, rapid out"),
    g(870, Group::Motion, Op::Cycle(Cycle::BoreBack), "back boring cycle"),
    g(880, Group::Motion, Op::Cycle(Cycle::BoreManual), "boring cycle, spindle stop, manual out"),
    g(890, Group::Motion, Op::Cycle(Cycle::BoreDwell), "boring cycle with a dwell, feed out"),
    g(900, Group::Distance, Op::Absolute, "axis words are positions"),
    g(901, Group::ArcDistance, Op::ArcCenterAbsolute, "I J K are positions"),
    g(910, Group::Distance, Op::Incremental, "axis words are distances"),
    g(911, Group::ArcDistance, Op::ArcCenterIncremental, "I J K are distances from the arc's start"),
    g(920, Group::NonModal, Op::SetPosition, "sets the position without moving"),
    g(921, Group::NonModal, Op::ResetPosition, "resets the G92 offset"),
    g(922, Group::NonModal, Op::SuspendPosition, "suspends the G92 offset"),
    g(923, Group::NonModal, Op::RestorePosition, "restores the G92 offset"),
    g(930, Group::FeedMode, Op::InverseTimeFeed, "inverse time feed"),
    g(940, Group::FeedMode, Op::FeedPerMinute, "F is in mm or inches a minute"),
    g(950, Group::FeedMode, Op::FeedPerTurn, "F is in mm or inches a turn of the spindle"),
    g(960, Group::SpindleMode, Op::SurfaceSpeed, "constant surface speed"),
    g(970, Group::SpindleMode, Op::SpindleSpeedConstant, "S is in turns a minute"),
    g(980, Group::ReturnLevel, Op::ReturnToInitial, "cycles return to the level they came from"),
    g(990, Group::ReturnLevel, Op::ReturnToR, "cycles return to the R level"),
    g(1030, Group::NonModal, Op::LookAhead, "limits the look-ahead of a control: changes nothing here"),
    g(1540, Group::CoordinateSystem, Op::FurtherSystem, "as G54.1 (Haas)"),
    g(1870, Group::NonModal, Op::LookAhead, "says how smooth a control is to plan: changes nothing here"),
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
    m(19, Group::Spindle, Op::Function(Function::SpindleOrient), "orients the spindle to R degrees"),
    m(29, Group::Spindle, Op::Function(Function::RigidTap), "the taps that follow, up to G80, are rigid: in step with the spindle, which they start"),
    m(30, Group::Stop, Op::EndAndRewind, "ends the program and goes back to its beginning"),
    m(48, Group::Override, Op::Override(48), "overrides are allowed"),
    m(49, Group::Override, Op::Override(49), "overrides are off"),
    m(50, Group::Override, Op::Override(50), "feed override control"),
    m(51, Group::Override, Op::Override(51), "spindle override control"),
    m(52, Group::Override, Op::Override(52), "adaptive feed control"),
    m(53, Group::Override, Op::Override(53), "feed hold control"),
    m(60, Group::Stop, Op::PalletStop, "stops for a change of pallets"),
    m(61, Group::ToolChange, Op::Function(Function::SetTool), "tool Q is in the spindle, without a change"),
    m(62, Group::Output, Op::Function(Function::DigitalOutput(62)), "output P on, in time with motion"),
    m(63, Group::Output, Op::Function(Function::DigitalOutput(63)), "output P off, in time with motion"),
    m(64, Group::Output, Op::Function(Function::DigitalOutput(64)), "output P on"),
    m(65, Group::Output, Op::Function(Function::DigitalOutput(65)), "output P off"),
    m(66, Group::NonModal, Op::WaitInput, "waits for an input"),
    m(67, Group::Output, Op::Function(Function::AnalogOutput(67)), "analog output E at Q, in time with motion"),
    m(68, Group::Output, Op::Function(Function::AnalogOutput(68)), "analog output E at Q"),
    m(70, Group::ModalState, Op::Modes(Modes::Save), "saves the modes in force"),
    m(71, Group::ModalState, Op::Modes(Modes::Forget), "forgets the modes saved"),
    m(72, Group::ModalState, Op::Modes(Modes::Restore), "restores the modes saved"),
    m(73, Group::ModalState, Op::Modes(Modes::SaveForCall), "saves the modes in force until the subprogram ends"),
    m(97, Group::Stop, Op::Call { by_block: true }, "calls the blocks of this program from N P on, up to M99, L times (Haas)"),
    m(98, Group::Stop, Op::Call { by_block: false }, "calls the subprogram P, L times"),
    m(99, Group::Stop, Op::Return, "ends a subprogram"),
    m(100, Group::UserFunction, Op::Function(Function::User), "user's functions, with P and Q"),
];

/// Rows of the table by ten times the code's number, counted from 1; 0 where there is none.
const fn index(letter: u8) -> [u8; ROWS] {
    let mut rows = [0; ROWS];
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
/// Ten times the greatest number of a code, and 0.
const ROWS: usize = 1871;
static G_ROWS: [u8; ROWS] = index(b'G');
static M_ROWS: [u8; ROWS] = index(b'M');

/// A G or M word's number as it is meant: what lies within 0.0001 of a tenth is that tenth
/// (RS274/NGC), for expressions are rounded.
pub fn nearest(number: f64) -> f64 {
    let tenths = (number * 10.0).round();
    if (number * 10.0 - tenths).abs() <= 1e-3 { tenths / 10.0 } else { number }
}

/// The row of a G or M word, if there is one.
pub fn find(letter: u8, number: f64) -> Option<&'static Code> {
    let exact = number * 10.0;
    // Half a tenth rounds to the nearest; a cast cuts off, and takes what is negative to 0.
    let tenths = (exact + 0.5) as usize;
    // 1e-6 forgives what the product's rounding adds to a tenth.
    if (exact - tenths as f64).abs() > 1e-6 {
        return None;
    }
    let is_user = letter == b'M' && (USER_FIRST as usize..=USER_LAST as usize).contains(&tenths);
    let tenths = if is_user && tenths.is_multiple_of(10) { USER_FIRST as usize } else { tenths };
    let rows = if letter == b'G' { &G_ROWS } else { &M_ROWS };
    CODES.get(usize::from(*rows.get(tenths)?).checked_sub(1)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_is_found_by_its_number_and_stands_once() {
        for code in CODES {
            let number = f64::from(code.tenths) / 10.0;
            assert!(std::ptr::eq(find(code.letter, number).unwrap(), code), "{}", code.name());
        }
        for (letter, number) in
            [(b'G', 5.7), (b'G', 1.05), (b'G', -1.0), (b'G', 100.0), (b'M', 199.5), (b'M', 200.0)]
        {
            assert!(find(letter, number).is_none(), "{number}");
        }
    }

    #[test]
    fn every_motion_is_that_of_one_code() {
        let motions = CODES.iter().filter(|code| code.group == Group::Motion);
        let ops: Vec<_> = motions.filter_map(|code| code.op).collect();
        for op in &ops {
            assert_eq!(ops.iter().filter(|other| *other == op).count(), 1, "{op:?}");
        }
    }
}
