//! Why a job cannot be sent over a bus.

use crate::base::machine::Unit;
use crate::base::{Axis, Event, Tick};
use crate::wire::order::Clash;

/// What the machine, its bus or its nodes cannot do. Ticks count from 0 over the whole job, lines
/// are those of the NC program.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum JobError {
    /// The profile names no protocol.
    #[error("this machine's profile says bus.protocol = \"none\": nothing can be sent over it")]
    NoProtocol,
    /// H6.
    #[error(
        "bus.tick_us = {tick_us} is too short: a node needs {least_us} µs from one tick to the next, \
         or it loses them"
    )]
    TickTooShort {
        /// The profile's.
        tick_us: u32,
        /// What the nodes need.
        least_us: u32,
    },
    /// A frame is still on the wire when the next one is due.
    #[error(
        "a frame of {bytes} bytes takes {frame_us} µs at {baud} baud, and bus.tick_us = {tick_us}: at least \
         {baud_least} baud are needed"
    )]
    FrameTooLong {
        /// Its bytes.
        bytes: u32,
        /// Bits a second.
        baud: u32,
        /// What it takes.
        frame_us: u64,
        /// The profile's.
        tick_us: u32,
        /// What would do.
        baud_least: u64,
    },
    /// A frame would not say what it is to say: never, unless the codec is wrong.
    #[error("line {line}, tick {tick}: the frame does not say what is planned at place {place}")]
    Frame {
        /// The place in the frame; 0 is the info byte.
        place: u8,
        /// The tick.
        tick: u64,
        /// Its line.
        line: u32,
    },
    /// Each data byte would put the pairs of idle nodes out of phase for good (H7).
    #[error(
        "bus.buffer_ticks = {buffer_ticks} is odd: nodes that are not filled would lose the phase of their pairs"
    )]
    OddBuffer {
        /// The profile's.
        buffer_ticks: u32,
    },
    /// H9: a buffer has one master, whose fill command stands first of its node's bytes.
    #[error("buffer {buffer} has {masters} masters, it must have exactly one")]
    Masters {
        /// The buffer.
        buffer: u32,
        /// How many it has.
        masters: usize,
    },
    /// A node would be filled that is full, or that is not on the bus.
    #[error("buffer {buffer}: {unit} cannot be filled: it is not on this bus, or is full already")]
    NotEmpty {
        /// The buffer.
        buffer: u32,
        /// The node.
        unit: Unit,
    },
    /// An axis moves that the machine has not, or that has no node.
    #[error("line {line}, tick {tick}: axis {axis} moves, and the machine has no node for it")]
    NoNode {
        /// The axis.
        axis: Axis,
        /// The first tick in which it moves.
        tick: u64,
        /// Its line.
        line: u32,
    },
    /// More steps than byte or axis allow.
    #[error(
        "line {line}, tick {tick}: {count} steps of axis {axis} in a tick, at most {count_max} are allowed"
    )]
    Count {
        /// The axis.
        axis: Axis,
        /// Its steps.
        count: i32,
        /// The most allowed.
        count_max: u32,
        /// The tick.
        tick: u64,
        /// Its line.
        line: u32,
    },
    /// H12.
    #[error(
        "line {line}, tick {tick}: axis {axis} would go to {position_mm}, its travel is {low_mm} to {high_mm}"
    )]
    Travel {
        /// The axis.
        axis: Axis,
        /// Where it would go, in machine coordinates.
        position_mm: f64,
        /// Least position.
        low_mm: f64,
        /// Greatest position.
        high_mm: f64,
        /// The tick.
        tick: u64,
        /// Its line.
        line: u32,
    },
    /// Buffers come one after another.
    #[error("tick {tick}: buffer {buffer} comes after a later one")]
    BufferOrder {
        /// The tick.
        tick: u64,
        /// Its buffer.
        buffer: u32,
    },
    /// H11: the last entries stay zero.
    #[error(
        "buffer {buffer} (from line {line}) has {motion_ticks} ticks of motion, a node holds {motion_ticks_max}"
    )]
    BufferLength {
        /// The buffer.
        buffer: u32,
        /// Its ticks.
        motion_ticks: usize,
        /// The most allowed.
        motion_ticks_max: u32,
        /// Its first line.
        line: u32,
    },
    /// H11: motion stops or starts here without a ramp.
    #[error(
        "line {line}, tick {tick}: motion starts or stops here at {count} steps a tick of axis {axis}, at most {steps_max} do without a ramp"
    )]
    NotAtRest {
        /// The axis.
        axis: Axis,
        /// Its steps in that tick.
        count: i32,
        /// What it can start and stop at.
        steps_max: u32,
        /// The tick.
        tick: u64,
        /// Its line.
        line: u32,
    },
    /// Nobody means a pause of years.
    #[error("line {}: {}: with this, the job rests for more than {seconds_max} seconds", event.line, event.kind)]
    Dwell {
        /// The dwell that is too much.
        event: Event,
        /// The most that all together may rest.
        seconds_max: f64,
    },
    /// Hands in the machine need idle nodes.
    #[error("line {}: {} waits for a person and must end buffer {buffer}, but motion follows in it", event.line, event.kind)]
    PauseInside {
        /// The buffer.
        buffer: u32,
        /// The event.
        event: Event,
    },
    /// H1 to H3: a node would take data for a command.
    #[error(
        "line {line}, tick {tick}: the data of {of} holds a command to {to}, and no order of filling \
         avoids it; give {to} an ID from 121 to 127"
    )]
    Command {
        /// Whose data.
        of: Unit,
        /// Who would obey.
        to: Unit,
        /// The tick.
        tick: u64,
        /// Its line; 0 in pads.
        line: u32,
    },
}

impl JobError {
    pub(super) fn clash(clash: Clash, base: u64, ticks: &[Tick]) -> Self {
        JobError::Command {
            of: clash.of,
            to: clash.to,
            tick: base + clash.tick as u64,
            line: ticks.get(clash.tick).map_or(0, |tick| tick.line),
        }
    }
}
