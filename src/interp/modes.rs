//! M70 to M73: the modes in force are saved, forgotten and restored, for each call by itself.
//!
//! Saved is what LinuxCNC saves: units, plane, cutter compensation, distance and arc distance,
//! feed mode, work coordinate system (which one, not where it lies), tool length offset, return
//! level, spindle mode, diameters, path control, feed, speed, spindle, coolant and overrides; not
//! the motion code, nor what G92, G51, G51.1, G68 and G16 have set.
//!
//! Two things differ. The tool's offset is restored as it was, whatever has set it, as long as the
//! same tool is in the spindle. And compensation that has been ended since is not begun anew, for
//! its radius and its lead-in would be guessed: that is an error.

use crate::base::{AxisMap, EventKind, Plane, Point};
use crate::gcode::{Block, Fault, codes, rules};

use super::compensation::Compensation;
use super::execute::{Asked, Executor, Output};
use super::feed::{Feed, FeedMode, Turning};
use super::motion::Corner;

/// Where the tool's offset comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum LengthMode {
    /// G49
    #[default]
    Off,
    /// G43, G43.2
    Table,
    /// G44
    Subtracted,
    /// G43.1
    Words,
}

impl LengthMode {
    /// Whether the offset is that of a tool of the table.
    pub fn is_of_table(self) -> bool {
        matches!(self, LengthMode::Table | LengthMode::Subtracted)
    }

    /// A tool's offset as the mode takes it.
    pub fn signed(self, offset_mm: &Point) -> Point {
        let sign = if self == LengthMode::Subtracted { -1.0 } else { 1.0 };
        AxisMap::from_fn(|axis| sign * offset_mm[axis])
    }
}

/// Mist and flood coolant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Coolant {
    pub mist: bool,
    pub flood: bool,
}

/// What M48 to M53 allow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Overrides {
    pub feed: bool,
    pub speed: bool,
    pub adaptive: bool,
    pub hold: bool,
}

impl Default for Overrides {
    fn default() -> Overrides {
        Overrides { feed: true, speed: true, adaptive: false, hold: true }
    }
}

/// Modes as they were.
#[derive(Clone, Debug)]
pub(super) struct Modes {
    mm_per_unit: f64,
    plane: Plane,
    is_compensated: bool,
    absolute: bool,
    centers_absolute: bool,
    feed_mode: FeedMode,
    system: usize,
    length_mode: LengthMode,
    tool_mm: Point,
    loaded: Option<u32>,
    returns_to_r: bool,
    by_surface: bool,
    surface: Option<(f64, Option<f64>)>,
    diameters: bool,
    corner: Corner,
    feed: Option<Feed>,
    spindle_rpm: Option<f64>,
    turning: Turning,
    coolant: Coolant,
    overrides: Overrides,
}

/// What a call has saved.
#[derive(Debug, Default)]
pub(super) struct Saved {
    modes: Option<Box<Modes>>,
    /// M73: restored when the call ends.
    at_end: bool,
}

impl Executor<'_> {
    /// The modes in force; `mm_per_unit`: those of before the block.
    fn modes(&self, mm_per_unit: f64) -> Modes {
        Modes {
            mm_per_unit,
            plane: self.plane,
            is_compensated: self.is_compensated(),
            absolute: self.absolute,
            centers_absolute: self.centers_absolute,
            feed_mode: self.feed_mode,
            system: self.frames.active(),
            length_mode: self.length_mode,
            tool_mm: self.frames.tool_mm(),
            loaded: self.loaded,
            returns_to_r: self.returns_to_r,
            by_surface: self.by_surface,
            surface: self.surface,
            diameters: self.diameters,
            corner: self.corner,
            feed: self.feed,
            spindle_rpm: self.spindle_rpm,
            turning: self.turning,
            coolant: self.coolant,
            overrides: self.overrides,
        }
    }

    /// M48 to M53: without P, or with one that is not 0, on.
    pub(super) fn set_override(&mut self, code: u8, block: &Block) {
        let on = block.word(b'P').is_none_or(|word| word.value != 0.0);
        match code {
            48 | 49 => (self.overrides.feed, self.overrides.speed) = (code == 48, code == 48),
            50 => self.overrides.feed = on,
            51 => self.overrides.speed = on,
            52 => self.overrides.adaptive = on,
            _ => self.overrides.hold = on,
        }
    }

    /// M70 to M73.
    pub(super) fn change_modes(
        &mut self,
        change: codes::Modes,
        block: &Block,
        asked: Asked,
        out: &mut Output<'_>,
    ) {
        match change {
            codes::Modes::Save => self.save_modes(false, asked.mm_per_unit_before),
            codes::Modes::SaveForCall => self.save_modes(true, asked.mm_per_unit_before),
            codes::Modes::Forget => self.forget_modes(),
            codes::Modes::Restore => self.restore_modes(block, out),
        }
    }

    /// M70, and M73 with `at_end`.
    fn save_modes(&mut self, at_end: bool, mm_per_unit: f64) {
        let modes = Some(Box::new(self.modes(mm_per_unit)));
        if let Some(level) = self.saved.last_mut() {
            *level = Saved { modes, at_end };
        }
    }

    /// Whether G41 or G42 is in force.
    fn is_compensated(&self) -> bool {
        self.compensation.as_ref().is_some_and(Compensation::is_on)
    }

    /// M71
    fn forget_modes(&mut self) {
        if let Some(level) = self.saved.last_mut() {
            level.modes = None;
        }
    }

    /// M72
    fn restore_modes(&mut self, block: &Block, out: &mut Output<'_>) {
        if let Some(word) = block
            .words()
            .iter()
            .find(|word| !(word.letter == b'N' || word.letter == b'M' && word.value == 72.0))
        {
            let message = format!("{word} stands beside M72, which sets many modes");
            let fault = Fault::word(&rules::CALL_ALONE, word, message);
            out.faults.push(fault.help("put M72 into a block of its own"));
            return;
        }
        match self.saved.last().and_then(|level| level.modes.clone()) {
            Some(modes) => self.restore(&modes, block, out),
            None => {
                let message = "M72 restores modes, and none have been saved in this program";
                let fault = Fault::block(&rules::NOTHING_SAVED, block, message);
                out.faults.push(
                    fault.help(
                        "write M70 before it; a subprogram and its caller have each their own",
                    ),
                );
            }
        }
    }

    /// Begins a call, which can save modes for itself.
    pub(super) fn enter_call(&mut self) {
        self.saved.push(Saved::default());
    }

    /// Ends a call; what M73 has saved in it is to be restored.
    pub(super) fn leave_call(&mut self) {
        let Some(level) = self.saved.pop() else { return };
        if level.at_end {
            self.to_restore = level.modes;
        }
    }

    /// Restores what the end of a call has left to be restored.
    pub(super) fn restore_after_call(&mut self, out: &mut Output<'_>) {
        let Some(modes) = self.to_restore.take() else { return };
        self.motion_first = out.motions.len();
        let block = Block::default();
        self.restore(&modes, &block, out);
        if self.compensation.is_some() {
            self.compensate(&block, out);
        }
    }

    fn restore(&mut self, modes: &Modes, block: &Block, out: &mut Output<'_>) {
        match (modes.is_compensated, self.is_compensated()) {
            (false, true) => self.compensation_off(block, out),
            (true, false) => {
                let message =
                    "the modes saved have cutter compensation, which has been ended since";
                let fault = Fault::block(&rules::COMPENSATION_MODE, block, message);
                out.faults.push(fault.help("save the modes outside of compensation"));
            }
            _ => {}
        }
        self.restore_length(modes);
        self.mm_per_unit = modes.mm_per_unit;
        self.plane = modes.plane;
        self.absolute = modes.absolute;
        self.centers_absolute = modes.centers_absolute;
        (self.feed_mode, self.feed, self.feed_missed) = (modes.feed_mode, modes.feed, false);
        if self.frames.active() != modes.system {
            self.frames.choose(modes.system);
        }
        self.returns_to_r = modes.returns_to_r;
        self.diameters = modes.diameters;
        self.corner = modes.corner;
        self.overrides = modes.overrides;
        self.restore_spindle(modes, out);
        if self.coolant != modes.coolant {
            self.coolant = modes.coolant;
            if !(modes.coolant.mist && modes.coolant.flood) {
                out.function(9);
            }
            if modes.coolant.mist {
                out.function(7);
            }
            if modes.coolant.flood {
                out.function(8);
            }
        }
    }

    /// Another tool has a length of its own.
    fn restore_length(&mut self, modes: &Modes) {
        let is_same_tool = modes.loaded == self.loaded;
        if is_same_tool || modes.length_mode == LengthMode::Words {
            self.frames.set_tool(modes.tool_mm);
        } else if modes.length_mode == LengthMode::Off {
            self.frames.set_tool(Point::ZERO);
        } else if self.length_mode != modes.length_mode {
            let tool = self.loaded.and_then(|number| self.tools.get(number));
            let offset_mm = tool.map_or(Point::ZERO, |tool| tool.offset_mm);
            self.frames.set_tool(modes.length_mode.signed(&offset_mm));
        }
        self.length_mode = modes.length_mode;
    }

    fn restore_spindle(&mut self, modes: &Modes, out: &mut Output<'_>) {
        let has_speed = (self.by_surface, self.surface, self.spindle_rpm)
            == (modes.by_surface, modes.surface, modes.spindle_rpm);
        (self.by_surface, self.surface) = (modes.by_surface, modes.surface);
        self.spindle_rpm = modes.spindle_rpm;
        let turns = self.turning != modes.turning;
        self.turning = modes.turning;
        match (modes.surface, modes.spindle_rpm) {
            _ if has_speed => {}
            (Some((m_min, rpm_max)), _) if modes.by_surface => {
                out.event(EventKind::SurfaceSpeed { m_min, rpm_max });
            }
            (_, Some(rpm)) if !turns || modes.turning == Turning::Stopped => {
                out.event(EventKind::S(rpm));
            }
            _ => {}
        }
        let spindle_rpm = modes.spindle_rpm;
        match modes.turning {
            _ if !turns => {}
            Turning::Stopped => out.function(5),
            Turning::Clockwise => out.event(EventKind::M { code: 3, spindle_rpm, tool: None }),
            Turning::CounterClockwise => {
                out.event(EventKind::M { code: 4, spindle_rpm, tool: None });
            }
        }
    }
}
