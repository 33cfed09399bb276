//! What codes do: the operations that rows of the table of codes name, and the letters each takes.

use super::block::letter_set;

/// What a supported code does.
#[allow(missing_docs)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Op {
    Inches,
    Millimetres,
    InverseTimeFeed,
    FeedPerMinute,
    FeedPerTurn,
    ToolChange,
    SpindleClockwise,
    SpindleCounterClockwise,
    SpindleStop,
    Function(Function),
    Modes(Modes),
    SurfaceSpeed,
    SpindleSpeedConstant,
    MistOn,
    FloodOn,
    CoolantOff,
    /// M48 to M53.
    Override(u8),
    Dwell,
    SetOffsets,
    /// G28 and G30, counted from 0.
    GoToReference(u8),
    StoreReference(u8),
    LocalOffset,
    SetPosition,
    ResetPosition,
    SuspendPosition,
    RestorePosition,
    MachineCoordinates,
    PlaneXy,
    PlaneZx,
    PlaneYz,
    CompensationOff,
    Compensate {
        left: bool,
        by_diameter: bool,
    },
    LengthOffset(Length),
    /// G54 to G59.3, counted from 0.
    WorkSystem(u8),
    /// G54.1, by its P.
    FurtherSystem,
    ExactStopOnce,
    ExactPath,
    ExactStop,
    Blend,
    Diameter,
    Radius,
    Absolute,
    Incremental,
    ArcCenterAbsolute,
    ArcCenterIncremental,
    PolarOff,
    Polar,
    Mirror {
        on: bool,
    },
    ScalingOff,
    Scaling,
    Rotation,
    RotationOff,
    ReturnToInitial,
    ReturnToR,
    Rapid,
    Line,
    ArcClockwise,
    ArcCounterClockwise,
    Spline(SplineCode),
    NurbsEnd,
    /// How a control is to plan, which changes no path; G5 P10000, G5.1 Q1 and G8 P1 too.
    LookAhead,
    Cycle(Cycle),
    Follow(Follow),
    Turn(Turn),
    WaitInput,
    Stock(Stock),
    Lathe(LatheCode),
    Single(Single),
    MotionOff,
    Stop,
    OptionalStop,
    PalletStop,
    End,
    EndAndRewind,
    Return,
    /// M98, or M97 by a block of the same program.
    Call {
        by_block: bool,
    },
    Macro(Macro),
}

/// Calls of macros with arguments: G65 once, G66 after every move up to G67.
#[allow(missing_docs)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Macro {
    Call,
    Modal,
    ModalOff,
}

/// Where the offset of the tool comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Length {
    /// The tool table (G43)
    Table,
    /// The same, subtracted (G44)
    Subtracted,
    /// The axis words (G43.1)
    Words,
    /// A further tool of the table (G43.2)
    More,
    /// There is none (G49)
    Off,
}

/// M functions that only say something to the machine.
#[allow(missing_docs)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Function {
    /// M61
    SetTool,
    /// M62 to M65.
    DigitalOutput(u8),
    /// M67 and M68.
    AnalogOutput(u8),
    SpindleOrient,
    /// M29
    RigidTap,
    /// M100 to M199.
    User,
}

impl Function {
    /// Letters that the function makes use of.
    pub const fn words(self) -> u32 {
        letter_set(match self {
            Function::SetTool => "Q",
            Function::DigitalOutput(_) => "P",
            Function::AnalogOutput(_) => "EQ",
            Function::SpindleOrient => "PQR",
            Function::RigidTap => "",
            Function::User => "PQ",
        })
    }
}

/// M70 to M73.
#[allow(missing_docs)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Modes {
    Save,
    Forget,
    Restore,
    SaveForCall,
}

/// Moves that follow something else than time alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Follow {
    /// The spindle, along a thread (G33).
    Thread,
    /// The spindle, there and back (G33.1).
    Tap,
    /// A signal (G31).
    Skip,
    /// A probe, by the tenths of its code (G38.2 to G38.5).
    Probe(u8),
}

impl Follow {
    /// Letters that it makes use of, beside axes.
    pub const fn words(self) -> u32 {
        letter_set(match self {
            Follow::Thread => "K",
            Follow::Tap => "IK",
            Follow::Skip | Follow::Probe(_) => "",
        })
    }
}

/// Cycles of lathes that work along a contour which stands elsewhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// G70
    Finish,
    /// G71 and G72, by the code and what comes of pockets.
    Rough {
        /// G72: cuts go along X.
        faces: bool,
        /// Which of them are cut.
        pockets: Pockets,
    },
}

/// Cycles of FANUC-style lathes along a contour that stands in the same program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stock {
    /// G70
    Finish,
    /// G71
    Turn,
    /// G72
    Face,
    /// G73
    Repeat,
}

/// Cycles of FANUC-style lathes that stay in force: those that cut once, in, along, out, back; and holes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Single {
    /// G83 to G89
    Hole(Hole),
    /// G90
    Turn,
    /// G92
    Thread,
    /// G94
    Face,
}

/// Codes of FANUC-style lathes that hold for their block only.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LatheCode {
    /// G50
    Setting,
    /// G76
    Thread,
    /// G74 and G75
    Groove(Groove),
}

/// Cycles of FANUC-style lathes that cut a groove by pecks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Groove {
    /// G74, along Z
    Face,
    /// G75, along X
    Side,
}

/// Cycles of FANUC-style lathes that make holes (G83 to G89).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Hole {
    /// Along X; else along Z.
    pub side: bool,
    /// What is done to the hole.
    pub kind: HoleKind,
}

/// What is done to a hole.
#[allow(missing_docs)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HoleKind {
    Drill,
    Tap,
    Bore,
}

impl Single {
    /// Letters that the cycle makes use of, beside axes.
    pub const fn words(self) -> u32 {
        letter_set(match self {
            Single::Hole(_) => "KPQR",
            Single::Face => "KR",
            Single::Turn | Single::Thread => "IR",
        })
    }
}

/// What roughing does with pockets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pockets {
    /// All is cut.
    Cut,
    /// They are left (.1).
    Leave,
    /// Only they are cut (.2).
    Only,
}

/// The canned cycles, by their G numbers.
#[allow(missing_docs)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Cycle {
    DrillChipBreak = 73,
    TapLeft = 74,
    BoreFine = 76,
    Drill = 81,
    DrillDwell = 82,
    DrillDeep = 83,
    Tap = 84,
    BoreFeedOut = 85,
    BoreStop = 86,
    BoreBack = 87,
    BoreManual = 88,
    BoreDwell = 89,
}

impl Cycle {
    /// Letters that the cycle makes use of, beside axes.
    pub const fn words(self) -> u32 {
        letter_set(match self {
            Cycle::Drill | Cycle::BoreFeedOut => "KLR",
            Cycle::DrillDwell
            | Cycle::Tap
            | Cycle::TapLeft
            | Cycle::BoreStop
            | Cycle::BoreManual
            | Cycle::BoreDwell => "KLPR",
            Cycle::DrillDeep | Cycle::DrillChipBreak => "KLPQR",
            Cycle::BoreFine => "IJLPQR",
            Cycle::BoreBack => "IJKLR",
        })
    }
}

/// The codes that make splines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SplineCode {
    /// G5
    Cubic,
    /// G5.1
    Quadratic,
    /// G5.2, up to G5.3
    Nurbs,
    /// G6.2
    NurbsByKnots,
}

impl SplineCode {
    /// As it is written.
    pub fn name(self) -> &'static str {
        match self {
            SplineCode::Cubic => "G5",
            SplineCode::Quadratic => "G5.1",
            SplineCode::Nurbs => "G5.2",
            SplineCode::NurbsByKnots => "G6.2",
        }
    }

    /// Letters that it makes use of, beside axes.
    pub const fn words(self) -> u32 {
        letter_set(match self {
            SplineCode::Cubic => "IJPQ",
            SplineCode::Quadratic => "IJ",
            SplineCode::Nurbs => "LP",
            SplineCode::NurbsByKnots => "KPR",
        })
    }

    /// Letters of the axes that it moves.
    pub const fn axes(self) -> u32 {
        letter_set(match self {
            SplineCode::NurbsByKnots => "XYZ",
            SplineCode::Cubic | SplineCode::Quadratic | SplineCode::Nurbs => "XY",
        })
    }
}
