//! What a program can ask the control, and tell it: parameters that are not the program's own.
//!
//! Offsets, references and tools are in mm and degrees, as at a metric LinuxCNC, whatever G20 says;
//! positions and probe results are in the program's units and coordinates. What a program sets of
//! an offset is stored, as LinuxCNC does it: a work coordinate system is moved once it is chosen
//! anew, the offset of G92 once G92.3 restores it. In the dialect `fanuc` the numbers mean what
//! they mean there: [`super::macro_variables`].

use crate::base::{Axis, Plane};
use crate::gcode::rules;

use super::execute::Executor;
use super::feed::{FeedMode, Turning};
use super::parameters::{NoValue, refuse};

/// Parameters of the axes in a row, from X on, and what they are (RS274/NGC).
#[derive(Clone, Copy, Debug, PartialEq)]
enum Place {
    /// A reference position of G28 or G30, counted from 0.
    Reference(usize, Axis),
    Shift(Axis),
    Origin(usize, Axis),
    Turn(usize),
    Tool(Axis),
    Position(Axis),
    Probed(usize),
    /// What the last M66 has read.
    Input,
    System,
    ShiftIsOn,
    /// Number, diameter, angles and orientation of the tool in the spindle.
    ToolNumber,
    ToolDiameter,
    ToolAngle,
}

/// What a numbered parameter is.
fn place(number: u32) -> Option<Place> {
    let axis = |first: u32| Axis::ALL.get((number - first) as usize).copied();
    Some(match number {
        5061..=5070 => Place::Probed((number - 5061) as usize),
        5161..=5169 => Place::Reference(0, axis(5161)?),
        5181..=5189 => Place::Reference(1, axis(5181)?),
        5210 => Place::ShiftIsOn,
        5211..=5219 => Place::Shift(axis(5211)?),
        5220 => Place::System,
        5221..=5390 => {
            let (index, within) = ((number - 5221) / 20, (number - 5221) % 20);
            match within {
                0..=8 => Place::Origin(index as usize, *Axis::ALL.get(within as usize)?),
                9 => Place::Turn(index as usize),
                _ => return None,
            }
        }
        5399 => Place::Input,
        5400 => Place::ToolNumber,
        5401..=5409 => Place::Tool(axis(5401)?),
        5410 => Place::ToolDiameter,
        5411..=5413 => Place::ToolAngle,
        5420..=5428 => Place::Position(axis(5420)?),
        _ => return None,
    })
}

impl Executor<'_> {
    /// A numbered parameter, if it is the control's.
    pub fn parameter(&self, number: u32) -> Option<Result<f64, NoValue>> {
        if self.dialect.is_fanuc() {
            return self.macro_variable(number);
        }
        let tool = || self.loaded.and_then(|number| self.tools.get(number));
        Some(Ok(match place(number)? {
            Place::Reference(index, axis) => {
                self.reference_mm(index as u8, axis).unwrap_or_default()
            }
            Place::Shift(axis) => self.frames.kept_shift_mm()[axis],
            Place::ShiftIsOn => truth(self.frames.is_shifted()),
            Place::System => self.frames.active() as f64 + 1.0,
            Place::Origin(index, axis) => {
                self.frames.system(index).map_or(0.0, |system| system.origin_mm[axis])
            }
            Place::Turn(index) => self.frames.system(index).map_or(0.0, |system| system.turn_deg),
            Place::ToolNumber => self.loaded.unwrap_or(0).into(),
            Place::Tool(axis) => tool().map_or(0.0, |tool| tool.offset_mm[axis]),
            Place::ToolDiameter => tool().map_or(0.0, |tool| tool.diameter_mm),
            Place::ToolAngle => 0.0,
            Place::Position(axis) => self.position_in_program(axis),
            Place::Probed(at) => self.signals.probed.get(at).copied().unwrap_or_default(),
            Place::Input => self.signals.input,
        }))
    }

    /// Sets a numbered parameter, if it is the control's.
    pub fn set_parameter(&mut self, number: u32, value: f64) -> Option<Result<(), NoValue>> {
        if self.dialect.is_fanuc() {
            return self.set_macro_variable(number, value);
        }
        match place(number)? {
            Place::Reference(index, axis) => self.references[index][axis] = Some(value),
            Place::Shift(axis) => self.frames.keep_shift(axis, value),
            Place::Origin(index, axis) => {
                self.frames.store_system(index, |system| system.origin_mm[axis] = value);
            }
            Place::Turn(index) => self.frames.store_system(index, |system| system.turn_deg = value),
            Place::Probed(at) => self.signals.probed[at] = value,
            Place::Input => self.signals.input = value,
            Place::System => {
                let message = "#5220 tells the work coordinate system, and does not choose it";
                return Some(read_only(message, "write G54 to G59.3"));
            }
            Place::ShiftIsOn => {
                let message = "#5210 tells whether G92 is in force, and does not switch it";
                return Some(read_only(message, "write G92.2 or G92.3"));
            }
            Place::ToolNumber | Place::Tool(_) | Place::ToolDiameter | Place::ToolAngle => {
                let message =
                    format!("#{number} is of the tool in the spindle: it can only be read");
                return Some(read_only(
                    message,
                    "G10 L1 sets a tool, M61 says which is in the spindle",
                ));
            }
            Place::Position(_) => {
                let message = format!("#{number} is where the machine stands: it can only be read");
                return Some(read_only(message, "G92 sets what the position is called"));
            }
        }
        Some(Ok(()))
    }

    /// A named parameter of the control, in lower case with its `_`, if there is one.
    pub fn named(&self, name: &str) -> Option<f64> {
        let is_mode = |mode: FeedMode| truth(self.feed_mode == mode);
        Some(match name {
            "_line" => self.line.into(),
            // Not the task of a machine's control: a program may leave out what needs one.
            "_task" | "_remap_level" => 0.0,
            // The version of LinuxCNC whose language this follows.
            "_vmajor" => 2.9,
            "_vminor" => 0.0,
            "_motion_mode" => self.motion_number(),
            "_plane" => match self.plane {
                Plane::Xy => 170.0,
                Plane::Zx => 180.0,
                Plane::Yz => 190.0,
            },
            "_ccomp" => match self.compensated_left() {
                None => 400.0,
                Some(true) => 410.0,
                Some(false) => 420.0,
            },
            "_metric" => truth(self.mm_per_unit == 1.0),
            "_imperial" => truth(self.mm_per_unit != 1.0),
            "_absolute" => truth(self.absolute),
            "_incremental" => truth(!self.absolute),
            "_inverse_time" => is_mode(FeedMode::InverseTime),
            "_units_per_minute" => is_mode(FeedMode::PerMinute),
            "_units_per_rev" => is_mode(FeedMode::PerTurn),
            "_coord_system" => self.system_code(),
            "_tool_offset" => truth(self.frames.tool_mm().0.iter().any(|offset| *offset != 0.0)),
            // Named the wrong way round at LinuxCNC, and so they are in its programs: G99, G98.
            "_retract_r_plane" => truth(self.returns_to_r),
            "_retract_old_z" => truth(!self.returns_to_r),
            "_spindle_rpm_mode" => truth(!self.by_surface),
            "_spindle_css_mode" => truth(self.by_surface),
            "_ijk_absolute_mode" => truth(self.centers_absolute),
            "_lathe_diameter_mode" => truth(self.diameters),
            "_lathe_radius_mode" => truth(!self.diameters),
            "_spindle_on" => truth(self.turning != Turning::Stopped),
            "_spindle_cw" => truth(self.turning == Turning::Clockwise),
            "_mist" => truth(self.coolant.mist),
            "_flood" => truth(self.coolant.flood),
            "_speed_override" => truth(self.overrides.speed),
            "_feed_override" => truth(self.overrides.feed),
            "_adaptive_feed" => truth(self.overrides.adaptive),
            "_feed_hold" => truth(self.overrides.hold),
            "_feed" => self.feed_in_program(),
            "_rpm" => self.spindle_rpm.unwrap_or_default(),
            "_current_tool" | "_current_pocket" => self.loaded.unwrap_or(0).into(),
            "_selected_tool" => self.tool.unwrap_or(0).into(),
            "_selected_pocket" => self.tool.map_or(-1.0, f64::from),
            _ => return self.named_position(name),
        })
    }

    /// `_x` to `_w`, and `_abs_x` to `_abs_w` in machine coordinates.
    fn named_position(&self, name: &str) -> Option<f64> {
        let (letter, is_machine) = match name.strip_prefix("_abs_") {
            Some(letter) => (letter, true),
            None => (name.strip_prefix('_')?, false),
        };
        let [letter] = letter.as_bytes() else { return None };
        let axis = Axis::from_letter(letter.to_ascii_uppercase())?;
        Some(if is_machine {
            self.in_program_units(axis, self.position_mm[axis])
        } else {
            self.position_in_program(axis)
        })
    }

    /// Whether G41 (true) or G42 (false) is in force.
    pub(super) fn compensated_left(&self) -> Option<bool> {
        let stage = self.compensation.as_ref().filter(|stage| stage.is_on());
        stage.map(|stage| stage.is_left())
    }

    /// The motion code in force, ten times its number.
    pub(super) fn motion_number(&self) -> f64 {
        self.motion.code().map_or(800.0, |code| code.tenths.into())
    }

    /// The feed in force as F would give it.
    pub(super) fn feed_in_program(&self) -> f64 {
        let is_length = self.feed_mode != FeedMode::InverseTime;
        let scale = if is_length { self.mm_per_unit } else { 1.0 };
        self.feed.map_or(0.0, |feed| feed.mm / scale)
    }

    /// The position on an axis as the program would give it.
    pub(super) fn position_in_program(&self, axis: Axis) -> f64 {
        self.in_program_units(axis, self.frames.program(&self.position_mm)[axis])
    }

    /// A position as the program would write it.
    pub(super) fn in_program_units(&self, axis: Axis, position_mm: f64) -> f64 {
        if axis.is_rotary() { position_mm } else { position_mm / self.mm_per_unit }
    }
}

pub(super) fn truth(holds: bool) -> f64 {
    f64::from(u8::from(holds))
}

/// Refuses to set what can only be read.
pub(super) fn read_only<T>(message: impl Into<String>, help: &'static str) -> Result<T, NoValue> {
    refuse(&rules::BAD_PARAMETER, message).map_err(|mut error: NoValue| {
        error.help = Some(help);
        error
    })
}
