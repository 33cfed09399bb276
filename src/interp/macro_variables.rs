//! System variables of FANUC macro B, as far as they follow from the program, the machine's profile
//! and the tool table. Clocks, signals and counters do not: they are refused, for the same program
//! shall give the same motion whenever it is read.
//!
//! Lengths are in the program's units, as there.

use crate::base::{Axis, Plane};
use crate::gcode::rules;

use super::execute::{Executor, MotionMode};
use super::feed::FeedMode;
use super::frames::SYSTEMS;
use super::modes::LengthMode;
use super::parameters::{NoValue, refuse};
use super::system::read_only;
use super::tools::Measure;

type Value = Result<f64, NoValue>;

/// What a system variable is.
enum Variable {
    /// A tool's length, the tool table's Z, or its radius; or the wear of these.
    Tool(u32, Measure),
    Wear(u32, Measure),
    /// The shift of all work coordinate systems.
    External(Axis),
    /// Where a work coordinate system lies, counted from 0: G54 to G59, and those of G54.1.
    Origin(usize, Axis),
    Position(Axis),
    MachinePosition(Axis),
    ToolOffset(Axis),
    Probed(usize),
    /// Modes by their groups.
    Modal(u32),
    /// #3003 and #3004: single blocks, overrides.
    Suppression,
    Clock,
    Unknown,
}

fn variable(number: u32) -> Option<Variable> {
    let axis = |first: u32| Axis::ALL.get((number - first) as usize).copied();
    Some(match number {
        0..=999 => return None,
        2001..=2200 => Variable::Tool(number - 2000, Measure::Length),
        2201..=2400 => Variable::Tool(number - 2200, Measure::Length),
        2401..=2600 => Variable::Wear(number - 2400, Measure::Radius),
        2601..=2800 => Variable::Tool(number - 2600, Measure::Radius),
        10_001..=10_999 => Variable::Wear(number - 10_000, Measure::Length),
        11_001..=11_999 => Variable::Tool(number - 11_000, Measure::Length),
        12_001..=12_999 => Variable::Wear(number - 12_000, Measure::Radius),
        13_001..=13_999 => Variable::Tool(number - 13_000, Measure::Radius),
        // Alarm and stop.
        3000 | 3006 => return None,
        3001 | 3002 | 3011 | 3012 => Variable::Clock,
        3003 | 3004 => Variable::Suppression,
        4001..=4130 => Variable::Modal(number - 4000),
        5001..=5009 => Variable::Position(axis(5001)?),
        5021..=5029 => Variable::MachinePosition(axis(5021)?),
        5041..=5049 => Variable::Position(axis(5041)?),
        5061..=5069 => Variable::Probed((number - 5061) as usize),
        5081..=5089 => Variable::ToolOffset(axis(5081)?),
        5201..=5209 => Variable::External(axis(5201)?),
        5221..=5328 => origin(number - 5221, 0),
        7001..=7960 => origin(number - 7001, SYSTEMS),
        14_001..=20_000 => origin(number - 14_001, SYSTEMS),
        _ => Variable::Unknown,
    })
}

/// Of rows of 20 numbers a system, from that of a first one on: where one lies on an axis.
fn origin(number: u32, first: usize) -> Variable {
    let (index, within) = (number / 20, number % 20);
    match Axis::ALL.get(within as usize) {
        Some(axis) => Variable::Origin(first + index as usize, *axis),
        None => Variable::Unknown,
    }
}

impl Executor<'_> {
    /// What a number is; on lathes those of tools are of X, Z and the nose by turns, and not supported.
    fn variable(&self, number: u32) -> Option<Variable> {
        match variable(number)? {
            Variable::Tool(..) | Variable::Wear(..) if self.is_lathe() => Some(Variable::Unknown),
            known => Some(known),
        }
    }

    /// A system variable; none for those of the program itself.
    pub(super) fn macro_variable(&self, number: u32) -> Option<Value> {
        let scaled = |axis: Axis, value: f64| Ok(self.in_program_units(axis, value));
        Some(match self.variable(number)? {
            Variable::Tool(tool, measure) => scaled(Axis::Z, self.tools.measure_mm(tool, measure)),
            Variable::Wear(tool, measure) => scaled(Axis::Z, self.tools.wear_mm(tool, measure)),
            Variable::Origin(index, axis) => {
                scaled(axis, self.frames.system(index).map_or(0.0, |system| system.origin_mm[axis]))
            }
            Variable::External(axis) => scaled(axis, self.frames.external_mm()[axis]),
            Variable::Position(axis) => Ok(self.position_in_program(axis)),
            Variable::MachinePosition(axis) => scaled(axis, self.position_mm[axis]),
            Variable::ToolOffset(axis) => scaled(axis, self.frames.tool_mm()[axis]),
            Variable::Probed(at) => Ok(self.signals.probed.get(at).copied().unwrap_or_default()),
            Variable::Modal(group) => self.modal(group),
            Variable::Suppression => Ok(0.0),
            Variable::Clock => {
                let message = format!("#{number} is a clock, and a run has to be repeatable");
                refuse(&rules::BAD_PARAMETER, message)
            }
            Variable::Unknown => unsupported(number),
        })
    }

    /// Sets a system variable; none for those of the program itself.
    pub(super) fn set_macro_variable(
        &mut self,
        number: u32,
        value: f64,
    ) -> Option<Result<(), NoValue>> {
        let mm = value * self.mm_per_unit;
        match self.variable(number)? {
            Variable::Tool(tool, measure) => self.tools.set_measure(tool, measure, false, mm),
            Variable::Wear(tool, measure) => self.tools.set_measure(tool, measure, true, mm),
            Variable::Origin(index, axis) => {
                if let Some(mut system) = self.frames.system(index).copied() {
                    system.origin_mm[axis] = if axis.is_rotary() { value } else { mm };
                    system.is_set = true;
                    self.frames.set_system(index, system);
                }
            }
            Variable::External(axis) => {
                self.frames.set_external(axis, if axis.is_rotary() { value } else { mm });
            }
            Variable::Suppression => {}
            Variable::Position(_)
            | Variable::MachinePosition(_)
            | Variable::ToolOffset(_)
            | Variable::Probed(_)
            | Variable::Modal(_) => {
                let message =
                    format!("#{number} tells a state of the control: it can only be read");
                return Some(read_only(message, "write the code or the word that sets it"));
            }
            Variable::Clock => {
                let message = format!("#{number} is a clock, and a run has to be repeatable");
                return Some(refuse(&rules::BAD_PARAMETER, message));
            }
            Variable::Unknown => return Some(unsupported(number)),
        }
        Some(Ok(()))
    }

    /// #4001 and on: the code in force of each group, and the words given last.
    fn modal(&self, group: u32) -> Value {
        let of = |holds: bool, yes: f64, no: f64| if holds { yes } else { no };
        Ok(match group {
            1 => match self.motion {
                MotionMode::Cycle(_) | MotionMode::None | MotionMode::Foreign => 0.0,
                _ => self.motion_number() / 10.0,
            },
            2 => match self.plane {
                Plane::Xy => 17.0,
                Plane::Zx => 18.0,
                Plane::Yz => 19.0,
            },
            3 => of(self.absolute, 90.0, 91.0),
            5 => match self.feed_mode {
                FeedMode::InverseTime => 93.0,
                FeedMode::PerMinute => 94.0,
                FeedMode::PerTurn => 95.0,
            },
            6 => of(self.mm_per_unit == 1.0, 21.0, 20.0),
            7 => match self.compensated_left() {
                None => 40.0,
                Some(is_left) => of(is_left, 41.0, 42.0),
            },
            8 => match self.length_mode {
                LengthMode::Off => 49.0,
                LengthMode::Subtracted => 44.0,
                LengthMode::Table | LengthMode::Words => 43.0,
            },
            9 => match self.motion {
                MotionMode::Cycle(cycle) => f64::from(cycle as u8),
                _ => 80.0,
            },
            10 => of(self.returns_to_r, 99.0, 98.0),
            11 => of(self.frames.scaling().is_some(), 51.0, 50.0),
            13 => of(self.by_surface, 96.0, 97.0),
            14 => self.system_code() / 10.0,
            16 => of(self.frames.rotation().is_some(), 68.0, 69.0),
            17 => of(self.polar, 16.0, 15.0),
            22 => of(self.frames.is_mirrored(), 51.1, 50.1),
            109 => self.feed_in_program(),
            119 => self.spindle_rpm.unwrap_or_default(),
            130 => self.further_system(),
            120 => self.tool.unwrap_or(0).into(),
            _ => return unsupported(4000 + group),
        })
    }
}

fn unsupported<T>(number: u32) -> Result<T, NoValue> {
    refuse(&rules::BAD_PARAMETER, format!("the system variable #{number} is not supported"))
}
