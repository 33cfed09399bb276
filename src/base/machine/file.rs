//! The TOML file of a machine profile: its keys, and the checks behind them.

use std::collections::BTreeMap;
use std::io;

use serde::{Deserialize, Serialize};

use super::{AxisProfile, BUILT_IN, Bus, Machine, Protocol, Rapid, Spindle};
use crate::base::{Axis, Point};

/// A profile that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ProfileError {
    /// Neither built in nor a file that can be read.
    #[error("no machine profile '{name}': {reason}; built in are {}", built_in_names())]
    Unreadable {
        /// What was asked for.
        name: String,
        /// Why it cannot be read.
        reason: io::Error,
    },
    /// The text is no TOML, or a key or its type is wrong. The message shows the place.
    #[error("machine profile '{id}': {message}")]
    Syntax {
        /// The profile.
        id: String,
        /// What is wrong, and where.
        message: String,
    },
    /// A value that no machine can have.
    #[error("machine profile '{id}': {key} = {value}: {expected}")]
    Value {
        /// The profile.
        id: String,
        /// The key at fault, with its table.
        key: String,
        /// What it says.
        value: String,
        /// What it may say.
        expected: String,
    },
}

impl ProfileError {
    pub(super) fn unreadable(name: &str, reason: io::Error) -> Self {
        ProfileError::Unreadable { name: name.to_owned(), reason }
    }
}

fn built_in_names() -> String {
    BUILT_IN.map(|(id, _)| id).join(", ")
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    name: String,
    work_zero_mm: BTreeMap<Axis, f64>,
    path_tolerance_mm: f64,
    arc_radius_tolerance_mm: f64,
    #[serde(default = "straight")]
    rapid: Rapid,
    axes: BTreeMap<Axis, AxisFile>,
    bus: Bus,
    #[serde(skip_serializing_if = "Option::is_none")]
    spindle: Option<Spindle>,
}

fn straight() -> Rapid {
    Rapid::Straight
}

/// Each key stands once with mm and once with degrees; an axis has those of its kind.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum AxisFile {
    Linear(LinearFile),
    Rotary(RotaryFile),
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct LinearFile {
    steps_per_mm: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    travel_mm: Option<[f64; 2]>,
    speed_max_mm_s: f64,
    accel_max_mm_s2: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    jerk_max_mm_s3: Option<f64>,
    #[serde(default)]
    start_speed_mm_s: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    home_mm: Option<f64>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RotaryFile {
    steps_per_deg: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    travel_deg: Option<[f64; 2]>,
    speed_max_deg_s: f64,
    accel_max_deg_s2: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    jerk_max_deg_s3: Option<f64>,
    #[serde(default)]
    start_speed_deg_s: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    home_deg: Option<f64>,
}

pub(super) fn parse(id: &str, text: &str) -> Result<Machine, ProfileError> {
    let syntax = |message: String| ProfileError::Syntax { id: id.to_owned(), message };
    let file: File = toml::from_str(text).map_err(|error| syntax(error.to_string()))?;
    let toml = toml::to_string(&file).map_err(|error| syntax(error.to_string()))?;
    let mut work_zero_mm = Point::ZERO;
    for (axis, zero) in &file.work_zero_mm {
        work_zero_mm[*axis] = *zero;
    }
    let machine = Machine {
        id: id.to_owned(),
        name: file.name,
        work_zero_mm,
        path_tolerance_mm: file.path_tolerance_mm,
        arc_radius_tolerance_mm: file.arc_radius_tolerance_mm,
        rapid: file.rapid,
        axes: file.axes.iter().map(|(axis, keys)| profile(*axis, keys)).collect(),
        bus: file.bus,
        spindle: file.spindle,
        toml,
    };
    check(&machine)?;
    Ok(machine)
}

fn profile(axis: Axis, keys: &AxisFile) -> AxisProfile {
    match keys {
        AxisFile::Linear(keys) => AxisProfile {
            axis,
            steps_per_mm: keys.steps_per_mm,
            travel_mm: keys.travel_mm,
            speed_max_mm_s: keys.speed_max_mm_s,
            accel_max_mm_s2: keys.accel_max_mm_s2,
            jerk_max_mm_s3: keys.jerk_max_mm_s3,
            start_speed_mm_s: keys.start_speed_mm_s,
            home_mm: keys.home_mm,
        },
        AxisFile::Rotary(keys) => AxisProfile {
            axis,
            steps_per_mm: keys.steps_per_deg,
            travel_mm: keys.travel_deg,
            speed_max_mm_s: keys.speed_max_deg_s,
            accel_max_mm_s2: keys.accel_max_deg_s2,
            jerk_max_mm_s3: keys.jerk_max_deg_s3,
            start_speed_mm_s: keys.start_speed_deg_s,
            home_mm: keys.home_deg,
        },
    }
}

fn check(machine: &Machine) -> Result<(), ProfileError> {
    let _ = (machine, Protocol::Buffered);
    Ok(())
}
