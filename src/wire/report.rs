//! How a job on the bus ended: what was acknowledged, what failed, and what is known of each
//! axis's position.

use crate::base::Axis;
use crate::base::machine::Unit;
use crate::wire::direct::HomeRun;
use crate::wire::pacing::Pacing;

/// What was going on when something failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum During {
    /// A node was asked whether it is there.
    Ping,
    /// A node was told to take a buffer.
    FillCommand {
        /// The buffer.
        buffer: u32,
    },
    /// A node's buffer was sent.
    FillData {
        /// The buffer.
        buffer: u32,
    },
    /// The nodes executed.
    Tick {
        /// The buffer.
        buffer: u32,
        /// Tick in the buffer, from 0.
        tick: usize,
        /// Its line of the NC program; that of the last movement in pads.
        line: u32,
    },
    /// A node was sent to its limit switch.
    Homing,
    /// Nothing was asked.
    Silence,
}

impl std::fmt::Display for During {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            During::Ping => write!(f, "a ping"),
            During::FillCommand { buffer } => write!(f, "the fill command of buffer {buffer}"),
            During::FillData { buffer } => write!(f, "the data of buffer {buffer}"),
            During::Tick { buffer, tick, line } => {
                write!(f, "tick {tick} of buffer {buffer} (line {line})")
            }
            During::Homing => write!(f, "the homing command"),
            During::Silence => write!(f, "nothing"),
        }
    }
}

/// What went wrong on the bus.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Fault {
    /// A node said nothing in time.
    #[error("{unit} did not answer to {during}; {}", remedy(*during))]
    NoAnswer {
        /// The node.
        unit: Unit,
        /// What it should have answered to.
        during: During,
    },
    /// Something else came than the node's ID.
    #[error("{unit} should have answered {} to {during}, {got} came; {}", unit.id, remedy(*during))]
    WrongAnswer {
        /// The node.
        unit: Unit,
        /// The byte that came.
        got: u8,
        /// What it should have answered to.
        during: During,
    },
    /// H13: an answer before all data had been sent.
    #[error(
        "{got} was answered before all data of {unit} had been sent: another node has taken over, or \
         bytes are counted twice; switch all nodes off and on, then home"
    )]
    Early {
        /// The node that was filled.
        unit: Unit,
        /// The byte that came.
        got: u8,
    },
    /// A byte that nobody asked for.
    #[error("{got} came from the bus though nothing was asked; look for a second host or noise")]
    Unexpected {
        /// The byte that came.
        got: u8,
    },
    /// The port failed.
    #[error("{0}")]
    Port(String),
    /// What the program asks for besides motion could not be done.
    #[error("line {line}: {event}: {reason}")]
    Event {
        /// NC line of the event.
        line: u32,
        /// The event, as in a dump.
        event: String,
        /// Who was to do it, and what became of that.
        reason: String,
    },
}

fn remedy(during: During) -> &'static str {
    match during {
        During::Ping => {
            "check that it is switched on, that its DIP switches match the profile, and the baud rate"
        }
        During::FillCommand { .. } => {
            "it holds the buffer of a job that was abandoned, or lost a byte: switch all nodes off \
             and on, then home"
        }
        During::FillData { .. } => "bytes were lost: switch all nodes off and on, then home",
        During::Tick { .. } => {
            "the axes have stopped in the middle of the buffer: switch all nodes off and on, then home"
        }
        During::Homing => {
            "the axis may still be running towards minus, switch or not, and nothing sent can stop it: \
             switch its node off"
        }
        During::Silence => "look for a second host or noise",
    }
}

/// How a job ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum End {
    /// All of it was executed and acknowledged.
    Done,
    /// The operator ended it.
    Interrupted,
    /// It could not go on.
    Failed(Fault),
}

/// What is known of an axis's position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Position {
    /// Every tick was acknowledged by the master node, and the axis's own node has answered since, or
    /// nothing has moved it.
    Known,
    /// Known while its node stays on; the node must be switched off before it can be used again.
    KnownUntilPowerOff,
    /// Every frame was sent, and no node can tell what it has heard: right unless one has missed any.
    KnownAsSent,
    /// Every tick was acknowledged by the master node, but the axis's own node could not be asked
    /// since: if it has missed a byte, nobody has noticed.
    Unconfirmed,
    /// A tick that moves the axis was sent and not acknowledged, another node answered, or its node
    /// has failed to answer a ping.
    Unknown,
}

impl Position {
    /// As in reports: `known`, `known-until-power-off`, `known-as-sent`, `unconfirmed`, `unknown`.
    pub fn name(self) -> &'static str {
        match self {
            Position::Known => "known",
            Position::KnownUntilPowerOff => "known-until-power-off",
            Position::KnownAsSent => "known-as-sent",
            Position::Unconfirmed => "unconfirmed",
            Position::Unknown => "unknown",
        }
    }
}

/// Why it is not known for certain where an axis stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Doubt {
    /// A tick that moves it was sent, and not acknowledged.
    #[error("tick {tick} of buffer {buffer} (line {line}) was sent and not acknowledged")]
    Tick {
        /// The buffer.
        buffer: u32,
        /// Tick in the buffer, from 0.
        tick: usize,
        /// Its line of the NC program.
        line: u32,
    },
    /// Its node did not answer its ID to a ping: it may be off, busy with a tick that others have
    /// done, or on its way to the limit switch.
    #[error("its node did not answer to a ping as it should")]
    Ping,
    /// A byte came while the nodes executed and nothing was asked.
    #[error("{got} came from the bus though nothing was asked: nodes may have made a tick more")]
    Unasked {
        /// The byte.
        got: u8,
    },
    /// It was sent to its switch, and its node has not answered all of that.
    #[error("it was sent to its switch, and is not known to be there")]
    Homing,
    /// Its node has jogged it by itself.
    #[error("its node has jogged it by itself, and has not told how far")]
    RawJog,
    /// Nobody knew at the start, and the job has not moved it.
    #[error("nobody knew at the start")]
    Untold,
    /// Its node cannot be asked.
    #[error("other nodes have acknowledged its ticks, its own could not be asked since")]
    NotAsked,
}

/// Where an axis stands at the end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisEnd {
    /// The axis.
    pub axis: Axis,
    /// Machine position in steps, as far as acknowledged.
    pub steps: i64,
    /// The same in mm; degrees on rotary axes.
    pub position_mm: f64,
    /// Whether these two mean anything: false if nobody knew at the start, nor does now.
    pub counted: bool,
    /// What that is worth.
    pub position: Position,
    /// Why it is unknown or unconfirmed, if so.
    pub why: Option<Doubt>,
}

/// How a job ended, in full.
#[derive(Clone, Debug, PartialEq)]
pub struct Ending {
    /// How.
    pub end: End,
    /// Ticks acknowledged, pads not counted.
    pub ticks: u64,
    /// Buffers executed to their end.
    pub buffers: u64,
    /// NC line of the last tick acknowledged or event reached; 0 before the first.
    pub line: u32,
    /// Position of every axis that has a node.
    pub axes: Vec<AxisEnd>,
    /// Axes that were homed, in order.
    pub homed: Vec<HomeRun>,
    /// Nodes hold a buffer, or wait for data, that only switching them off makes them forget.
    pub power_cycle: bool,
    /// How well the ticks kept their period.
    pub pacing: Pacing,
}
