//! Machine profiles: what a machine's axes and bus can do. TOML; the built-in ones are files too.
//!
//! [`Machine::load`] takes a name or a file; [`Machine::parse`] checks every value, so that the
//! stages behind it need not. Unknown keys are errors, and all errors are told at once. A profile
//! is not held against the machine itself: nothing here asks a node.

mod canonical;
mod error;
mod file;
mod hooks;
pub(in crate::base) mod keys;
mod plc;
mod timing;
mod written;

use std::collections::BTreeMap;
use std::fmt;
use std::io;
use std::path::Path;

use sha2::{Digest, Sha256};

pub use self::error::ProfileError;
pub use self::hooks::{HOOK_TIMEOUT_S, Hook, Hooks, NoValue, Occasion, Trigger};
pub use self::plc::PlcProfile;
pub use self::timing::{ANSWER_PAUSE_US, BufferTime, LISTEN_US, SPI_US};
pub use self::written::{Written, written};
use crate::base::source::small_text;
use crate::base::{Axis, AxisMap, Point};

/// The profile used when none is named.
pub const DEFAULT: &str = "starmill";

/// Name and text of the built-in profiles.
pub const BUILT_IN: [(&str, &str); 5] = [
    ("starmill", include_str!("machines/starmill.toml")),
    ("router", include_str!("machines/router.toml")),
    ("ideal", include_str!("machines/ideal.toml")),
    ("kimm", include_str!("machines/kimm.toml")),
    ("kimm-table", include_str!("machines/kimm-table.toml")),
];

/// A machine, checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Machine {
    /// Name of a built-in profile, or the file's name without its ending.
    pub id: String,
    /// What people call the machine.
    pub name: String,
    /// Where the programs' origin (G54) and the start of a job lie, in machine coordinates.
    pub work_zero_mm: Point,
    /// How far the planned path may leave the programmed one (corners, chords).
    pub path_tolerance_mm: f64,
    /// How far the radii of an arc's ends may differ.
    pub arc_radius_tolerance_mm: f64,
    /// How G0 moves.
    pub rapid: Rapid,
    /// What a stop inside a cut is worth when seams are placed.
    pub seam_in_cut_penalty_s: f64,
    /// The order in which axes are homed; empty: all are homed as the operator says.
    pub home_order: Vec<Axis>,
    /// The machine's axes in the order of [`Axis`].
    pub axes: Vec<AxisProfile>,
    /// The bus to its nodes.
    pub bus: Bus,
    /// The spindle, if the profile tells of it.
    pub spindle: Option<Spindle>,
    /// The hardware that makes its pulses, if that bounds them.
    pub interpolator: Option<Interpolator>,
    /// Whether probes are taken to touch at the end of their move, and waits for inputs to end at
    /// once: to check programs, not to cut.
    pub assumed_inputs: bool,
    /// Commands that do what programs ask for besides motion.
    pub hooks: Hooks,
    /// Delays of functions by handshake with a PLC, if the profile tells of it.
    pub plc: Option<PlcProfile>,
    toml: String,
}

/// How G0 moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rapid {
    /// All axes arrive together.
    Straight,
    /// Every axis at its own greatest speed (seed 004, section 6.5.1).
    Independent,
}

/// What one axis can do. On rotary axes read degrees for mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisProfile {
    /// Which axis.
    pub axis: Axis,
    /// Motor steps a mm.
    pub steps_per_mm: f64,
    /// Least and greatest machine position; none: no limit.
    pub travel_mm: Option<[f64; 2]>,
    /// Greatest speed.
    pub speed_max_mm_s: f64,
    /// Greatest acceleration.
    pub accel_max_mm_s2: f64,
    /// Greatest jerk; none: trapezoidal profiles.
    pub jerk_max_mm_s3: Option<f64>,
    /// Speed at which the motor can start and stop without a ramp.
    pub start_speed_mm_s: f64,
    /// Machine position at the home switch.
    pub home_mm: Option<f64>,
}

/// The bus and the nodes on it. With [`Protocol::None`] only the ticks and `count_max` mean
/// something.
#[derive(Clone, Debug, PartialEq)]
pub struct Bus {
    /// What is spoken on it.
    pub protocol: Protocol,
    /// Bits a second.
    pub baud: u32,
    /// The host's period: counts are computed for it.
    pub tick_us: u32,
    /// How long a node takes over a byte.
    pub node_tick_us: u32,
    /// Entries of a node's buffer.
    pub buffer_ticks: u32,
    /// Most steps in a tick.
    pub count_max: u32,
    /// The host's ID.
    pub host_id: u8,
    /// Each axis's node: its ID, or with [`Protocol::Frame`] its place in the frame, from 1.
    pub nodes: BTreeMap<Axis, u8>,
    /// A node without a motor that can be master as a time base.
    pub metronome_id: Option<u8>,
    /// Further nodes on the bus, which move no axis of this machine.
    pub spare_ids: Vec<u8>,
    /// Which node answers every tick.
    pub master: Master,
    /// How long to wait for an answer beyond the time of wire and tick.
    pub reply_timeout_ms: u32,
}

/// What is spoken on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Protocol {
    /// Node buffers, a sync byte a tick (seed 004, method C).
    Buffered,
    /// A frame of all counts a tick, to nodes that cannot answer (seed 004, method A).
    Frame,
    /// Nothing can be sent; motion has no buffers and no seams.
    None,
}

/// Which node answers every tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Master {
    /// In each buffer the axis that moves in most ticks.
    #[default]
    Auto,
    /// In each buffer the axis that has not been master for longest, of those that move in it.
    Rotate,
    /// Always this axis.
    Axis(Axis),
    /// Always the node of [`Bus::metronome_id`].
    Metronome,
}

/// A node on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Unit {
    /// The axis that it moves, if any.
    pub axis: Option<Axis>,
    /// Its ID.
    pub id: u8,
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.axis {
            Some(axis) => write!(f, "node {} of axis {axis}", self.id),
            None => write!(f, "node {} (without an axis)", self.id),
        }
    }
}

/// The spindle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spindle {
    /// Greatest speed.
    pub speed_max_rpm: u32,
    /// Power at the motor.
    pub power_kw: f64,
    /// The share of its power that reaches the tool.
    pub efficiency: f64,
    /// Whether motion can follow its turns, as threads need it.
    pub encoder: bool,
}

/// An interpolator in hardware, which takes lines and arcs and makes pulses one by one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Interpolator {
    /// Most pulses a minute on a line.
    pub line_max_pulses_min: u32,
    /// Most pulses a minute on an arc, and on all else.
    pub arc_max_pulses_min: u32,
}

/// Entries of a node's buffer: the firmware has these, always.
pub const BUFFER_TICKS: u32 = 1500;
/// Greatest machine position on any axis, mm or degrees: with at most 10^6 steps a mm positions in
/// steps stay below 10^12, where an f64 still tells 10^-4 steps apart.
pub const POSITION_MOST: f64 = 1e6;
/// The host's ID on the bus, which the firmware knows as the start command.
pub const HOST_ID: u8 = 120;
/// Zero entries at the end of every buffer, at least: the bus at rest before a refill (H11).
pub const PADS_MIN: u32 = 4;
/// What the host's period must exceed the node's tick by (H6): a perfect host needs 280 us for
/// the master's answer and the next sync byte.
pub const TICK_MARGIN_US: u32 = 280;
/// Most steps a tick whose byte is never taken for an ID on the bus (H1).
pub const COUNT_MAX_SAFE: u32 = 119;
/// Bytes of a frame: the info byte, and two for each of six axes (seed 004, fig. 3.11).
pub const FRAME_BYTES: u32 = 13;
/// Axes that a frame has room for.
pub const FRAME_PLACES: u8 = 6;
/// Most steps a tick that a frame's two bytes of seven bits carry either way.
pub const FRAME_COUNT_MAX: u32 = 8191;

impl AxisProfile {
    /// Nearest motor step to where the home switch closes: [`AxisProfile::home_mm`], or else the
    /// least position of the travel, for nodes home towards minus.
    pub fn switch_steps(&self) -> Option<i64> {
        let switch_mm = self.home_mm.or(self.travel_mm.map(|[low, _]| low))?;
        Some((switch_mm * self.steps_per_mm).round_ties_even() as i64)
    }
}

impl Bus {
    /// The host's period in seconds.
    pub fn tick_s(&self) -> f64 {
        f64::from(self.tick_us) * 1e-6
    }

    /// Every node on the bus: those of the axes in order, the metronome, the spare ones.
    pub fn units(&self) -> impl Iterator<Item = Unit> {
        let of_axis = |(axis, id): (&Axis, &u8)| Unit { axis: Some(*axis), id: *id };
        let others = self.metronome_id.iter().chain(&self.spare_ids);
        self.nodes.iter().map(of_axis).chain(others.map(|id| Unit { axis: None, id: *id }))
    }

    /// Most ticks of motion in one buffer: at least [`PADS_MIN`] of its entries stay zero. None
    /// where there are no buffers.
    pub fn motion_ticks_max(&self) -> Option<u32> {
        (self.protocol == Protocol::Buffered).then(|| self.buffer_ticks.saturating_sub(PADS_MIN))
    }

    /// How long a frame is on the wire.
    pub fn frame_s(&self) -> f64 {
        self.wire_s(FRAME_BYTES)
    }

    /// The least baud rate at which a frame is off the wire within a tick.
    pub fn frame_baud_least(&self) -> u64 {
        (u64::from(FRAME_BYTES) * 10 * 1_000_000).div_ceil(u64::from(self.tick_us.max(1)))
    }

    /// What stands for a bus that the profile does not tell of; such a profile is refused.
    fn unconnected() -> Bus {
        Bus {
            protocol: Protocol::None,
            baud: 38_400,
            tick_us: 10_000,
            node_tick_us: 10_000,
            buffer_ticks: BUFFER_TICKS,
            count_max: 1,
            host_id: HOST_ID,
            nodes: BTreeMap::new(),
            metronome_id: None,
            spare_ids: Vec::new(),
            master: Master::Auto,
            reply_timeout_ms: 200,
        }
    }
}

impl Machine {
    /// Finds a profile by the name of a built-in one, or else as a file.
    ///
    /// # Errors
    /// When there is no such profile, or it is wrong.
    pub fn load(name_or_file: &str) -> Result<Machine, ProfileError> {
        match BUILT_IN.iter().find(|(id, _)| *id == name_or_file) {
            Some((id, text)) => Machine::parse(id, text),
            None => Machine::open(name_or_file),
        }
    }

    /// Reads a profile from a file, whatever its name.
    ///
    /// # Errors
    /// When there is no such file, it cannot be read, or it is wrong.
    pub fn open(file: &str) -> Result<Machine, ProfileError> {
        let path = Path::new(file);
        let text = small_text(path, FILE_MIB_MAX).map_err(|reason| match reason.kind() {
            io::ErrorKind::NotFound => ProfileError::NotFound { name: file.to_owned() },
            _ => ProfileError::Unreadable { file: file.to_owned(), reason },
        })?;
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        file::parse(file, &stem.replace(|c: char| c.is_whitespace() || c.is_control(), "_"), &text)
    }

    /// The text of a profile, found as [`Machine::load`] finds it: a built-in one's, or a file's.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn text(name_or_file: &str) -> io::Result<String> {
        match BUILT_IN.iter().find(|(id, _)| *id == name_or_file) {
            Some((_, text)) => Ok((*text).to_owned()),
            None => small_text(Path::new(name_or_file), FILE_MIB_MAX),
        }
    }

    /// Reads a profile from TOML and checks it.
    ///
    /// # Errors
    /// Names every key at fault, its place, and what may stand there.
    pub fn parse(id: &str, text: &str) -> Result<Machine, ProfileError> {
        file::parse(id, id, text)
    }

    /// The same machine at the end of another line. Frames give its axes, those with nodes if any have,
    /// their places in order.
    ///
    /// # Errors
    /// In words, where the profile does not tell what the protocol has to know.
    pub fn with_protocol(self, protocol: Protocol) -> Result<Machine, String> {
        if self.bus.protocol == protocol {
            return Ok(self);
        }
        if protocol != Protocol::Frame {
            return Err(format!(
                "machine {} has no node IDs for this protocol: name a profile that has (bus.nodes)",
                self.id
            ));
        }
        let axes = self.axes.iter().map(|profile| profile.axis);
        let with_node =
            |axis: &Axis| self.bus.nodes.is_empty() || self.bus.nodes.contains_key(axis);
        let nodes: BTreeMap<Axis, u8> = axes.filter(with_node).zip(1..).collect();
        if nodes.len() > usize::from(FRAME_PLACES) {
            let (axes, places) = (nodes.len(), FRAME_PLACES);
            return Err(format!("a frame has places for {places} axes, this machine has {axes}"));
        }
        let bus = Bus {
            protocol,
            nodes,
            metronome_id: None,
            spare_ids: Vec::new(),
            master: Master::Auto,
            ..self.bus
        };
        let machine = Machine { bus, ..self };
        Ok(Machine { toml: canonical::text(&machine), ..machine })
    }

    /// What is allowed but will not work as hoped.
    pub fn warnings(&self) -> Vec<String> {
        let bus = &self.bus;
        let least_us = bus.node_tick_us.saturating_add(TICK_MARGIN_US);
        let mut warnings = Vec::new();
        if bus.protocol == Protocol::Buffered && bus.tick_us < least_us {
            warnings.push(format!(
                "bus.tick_us = {} is less than node_tick_us + {TICK_MARGIN_US} = {least_us}: nodes \
                 would lose step with each other, and `cnc send` refuses it",
                bus.tick_us
            ));
        }
        if bus.protocol == Protocol::Buffered && bus.count_max > COUNT_MAX_SAFE {
            warnings.push(format!(
                "bus.count_max = {} is more than {COUNT_MAX_SAFE}: bytes from 120 on are IDs on \
                 the bus, and `cnc send` refuses a job that holds one",
                bus.count_max
            ));
        }
        if bus.protocol == Protocol::Frame && u64::from(bus.baud) < bus.frame_baud_least() {
            warnings.push(format!(
                "a frame takes {:.0} µs at {} baud, bus.tick_us = {}: `cnc send` refuses less than {} baud",
                bus.frame_s() * 1e6,
                bus.baud,
                bus.tick_us,
                bus.frame_baud_least()
            ));
        }
        warnings.extend(self.hooks.warning());
        warnings
    }

    /// The profile in its canonical form: every value, in a fixed order. Its hash is the
    /// machine's seal in a dump.
    pub fn to_toml(&self) -> &str {
        &self.toml
    }

    /// SHA-256 of [`Machine::to_toml`].
    pub fn sha256(&self) -> [u8; 32] {
        Sha256::digest(&self.toml).into()
    }

    /// The profile of an axis, if the machine has it.
    pub fn axis(&self, axis: Axis) -> Option<&AxisProfile> {
        self.axes.iter().find(|profile| profile.axis == axis)
    }

    /// The axes that it has, for a message: `X, Y, Z`.
    pub fn axis_names(&self) -> String {
        let names: Vec<String> = self.axes.iter().map(|profile| profile.axis.to_string()).collect();
        names.join(", ")
    }

    /// Nearest motor step to a machine position, on each axis; 0 on axes the machine lacks. A
    /// position half way between two steps goes to the even one.
    pub fn nearest_steps(&self, position_mm: &Point) -> AxisMap<i64> {
        let mut steps = AxisMap::default();
        for profile in &self.axes {
            let exact = position_mm[profile.axis] * profile.steps_per_mm;
            steps[profile.axis] = exact.round_ties_even() as i64;
        }
        steps
    }

    /// Machine position of motor steps, on each axis; 0 on axes the machine lacks.
    pub fn position_mm(&self, steps: &AxisMap<i64>) -> Point {
        let mut position_mm = Point::ZERO;
        for profile in &self.axes {
            position_mm[profile.axis] = steps[profile.axis] as f64 / profile.steps_per_mm;
        }
        position_mm
    }

    /// Most steps an axis makes in one tick: the byte's range, and what the axis's greatest
    /// speed allows within the node's own tick, in which its pulses come.
    pub fn count_max(&self, profile: &AxisProfile) -> u32 {
        let node_tick_s = f64::from(self.bus.node_tick_us) * 1e-6;
        let by_speed = profile.speed_max_mm_s * node_tick_s * profile.steps_per_mm;
        // 1e-9 forgives what the product's rounding takes off a whole number.
        self.bus.count_max.min((by_speed * (1.0 + 1e-9)) as u32)
    }
}

/// A larger profile is some other file.
const FILE_MIB_MAX: u64 = 1;

impl fmt::Display for Machine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.id, self.name)
    }
}
