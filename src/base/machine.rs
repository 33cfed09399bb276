//! Machine profiles: what a machine's axes and bus can do. TOML; the built-in ones are files too.
//!
//! [`Machine::load`] takes a name or a file; [`Machine::parse`] checks every value, so that the
//! stages behind it need not. Unknown keys are errors.

mod file;

use std::fmt;
use std::path::Path;

use serde::{Deserialize, Serialize};

pub use self::file::ProfileError;
use crate::base::{Axis, AxisMap, Point};

/// The profile used when none is named.
pub const DEFAULT: &str = "starmill";

/// Name and text of the built-in profiles.
pub const BUILT_IN: [(&str, &str); 3] = [
    ("starmill", include_str!("machines/starmill.toml")),
    ("router", include_str!("machines/router.toml")),
    ("ideal", include_str!("machines/ideal.toml")),
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
    /// The machine's axes in the order of [`Axis`].
    pub axes: Vec<AxisProfile>,
    /// The bus to its nodes.
    pub bus: Bus,
    /// The spindle, if the profile tells of it.
    pub spindle: Option<Spindle>,
    toml: String,
}

/// How G0 moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
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

/// The bus and the nodes on it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bus {
    /// What is spoken on it.
    pub protocol: Protocol,
    /// Bits a second.
    #[serde(default = "Bus::default_baud")]
    pub baud: u32,
    /// The host's period: counts are computed for it.
    pub tick_us: u32,
    /// How long a node takes over a byte.
    pub node_tick_us: u32,
    /// Entries of a node's buffer.
    #[serde(default = "Bus::default_buffer_ticks")]
    pub buffer_ticks: u32,
    /// Most steps in a tick.
    pub count_max: u32,
    /// The host's ID.
    #[serde(default = "Bus::default_host_id")]
    pub host_id: u8,
    /// Each axis's node.
    #[serde(default, skip_serializing_if = "std::collections::BTreeMap::is_empty")]
    pub nodes: std::collections::BTreeMap<Axis, u8>,
    /// Which node answers every tick: `auto` or an axis.
    #[serde(default)]
    pub master: Master,
    /// How long to wait for an answer beyond the time of wire and tick.
    #[serde(default = "Bus::default_reply_timeout_ms")]
    pub reply_timeout_ms: u32,
}

/// What is spoken on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Protocol {
    /// Node buffers, a sync byte a tick (seed 004, method C).
    Buffered,
    /// Nothing can be sent; motion has no buffers and no seams.
    None,
}

/// Which node answers every tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Master {
    /// In each buffer the axis that moves in most ticks.
    #[default]
    Auto,
    /// Always this axis.
    Axis(Axis),
}

impl Serialize for Master {
    fn serialize<S: serde::Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        match self {
            Master::Auto => to.serialize_str("auto"),
            Master::Axis(axis) => axis.serialize(to),
        }
    }
}

impl<'de> Deserialize<'de> for Master {
    fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let text = String::deserialize(from)?;
        let axis = || match text.as_bytes() {
            [letter] => Axis::from_letter(*letter),
            _ => None,
        };
        if text == "auto" {
            return Ok(Master::Auto);
        }
        axis().map(Master::Axis).ok_or_else(|| {
            serde::de::Error::custom(format!("'{text}' is neither \"auto\" nor an axis"))
        })
    }
}

/// The spindle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spindle {
    /// Greatest speed.
    pub speed_max_rpm: u32,
    /// Power at the motor.
    pub power_kw: f64,
}

impl Bus {
    fn default_baud() -> u32 {
        38400
    }

    fn default_buffer_ticks() -> u32 {
        1500
    }

    fn default_host_id() -> u8 {
        120
    }

    fn default_reply_timeout_ms() -> u32 {
        200
    }

    /// The host's period in seconds.
    pub fn tick_s(&self) -> f64 {
        f64::from(self.tick_us) * 1e-6
    }

    /// Most ticks of motion in one buffer: at least [`PADS_MIN`] of its entries stay zero. None
    /// where there are no buffers.
    pub fn motion_ticks_max(&self) -> Option<u32> {
        (self.protocol == Protocol::Buffered).then(|| self.buffer_ticks - PADS_MIN)
    }
}

/// Zero entries at the end of every buffer, at least: the bus at rest before a refill (H11).
pub const PADS_MIN: u32 = 4;

impl Machine {
    /// Finds a profile by the name of a built-in one, or else as a file.
    ///
    /// # Errors
    /// When there is no such profile, or it is wrong.
    pub fn load(name_or_file: &str) -> Result<Machine, ProfileError> {
        if let Some((id, text)) = BUILT_IN.iter().find(|(id, _)| *id == name_or_file) {
            return Machine::parse(id, text);
        }
        let path = Path::new(name_or_file);
        let text = match std::fs::read_to_string(path) {
            Ok(text) => text,
            Err(error) => return Err(ProfileError::unreadable(name_or_file, error)),
        };
        let id = path.file_stem().map_or(name_or_file.into(), |stem| stem.to_string_lossy());
        Machine::parse(&id, &text)
    }

    /// Reads a profile from TOML and checks it.
    ///
    /// # Errors
    /// Names the key at fault, and what may stand there.
    pub fn parse(id: &str, text: &str) -> Result<Machine, ProfileError> {
        file::parse(id, text)
    }

    /// The profile in its canonical form: every value, in a fixed order. Its hash is the
    /// machine's seal in a dump.
    pub fn to_toml(&self) -> &str {
        &self.toml
    }

    /// The profile of an axis, if the machine has it.
    pub fn axis(&self, axis: Axis) -> Option<&AxisProfile> {
        self.axes.iter().find(|profile| profile.axis == axis)
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

    /// Most steps an axis makes in one tick: the byte's range, and what the axis's greatest
    /// speed allows within the node's own tick, in which its pulses come.
    pub fn count_max(&self, profile: &AxisProfile) -> u32 {
        let node_tick_s = f64::from(self.bus.node_tick_us) * 1e-6;
        let by_speed = profile.speed_max_mm_s * node_tick_s * profile.steps_per_mm;
        // 1e-9 forgives what the product's rounding takes off a whole number.
        self.bus.count_max.min((by_speed * (1.0 + 1e-9)) as u32)
    }
}

impl fmt::Display for Machine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.id, self.name)
    }
}
