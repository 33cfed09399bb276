//! What the machine stands, worked out once: the planner asks for it at every segment.

use crate::base::machine::AxisProfile;
use crate::base::{Axis, Machine, Point};

use super::Bound;
use super::extreme::greater;

/// Pieces of a segment that takes a whole buffer, at least.
const PIECES_A_BUFFER: f64 = 64.0;

/// The widest window in which accelerations are taken, to either side.
const WINDOW_TICKS: f64 = 20.0;

/// Keeps a count below its limit whatever the rounding of positions does, in steps.
const COUNT_MARGIN: f64 = 1e-6;

/// The limits of a machine.
#[derive(Clone, Debug)]
pub struct Limits {
    /// Those of its axes, in the machine's order.
    pub axes: Vec<AxisLimits>,
    /// Period of the bus.
    pub tick_s: f64,
    /// The widest window in which accelerations are taken, to either side.
    pub window_s: f64,
    /// How far the executed path may be off.
    pub path_tolerance_mm: f64,
    /// How long a piece takes at its greatest speed at most: where motion is in node buffers, a share
    /// of one, so that there are places inside long segments where a buffer can end.
    pub piece_max_s: f64,
    /// The greatest speed in any direction: that of all linear axes together.
    pub speed_max_mm_s: f64,
    /// The greatest acceleration in any direction.
    pub accel_max_mm_s2: f64,
    /// Some axis has a limit on jerk.
    pub has_jerk: bool,
}

/// The limits of an axis.
#[derive(Clone, Debug)]
pub struct AxisLimits {
    /// The axis.
    pub axis: Axis,
    /// Its greatest speed: its own, or that of the most steps that its node makes in a tick.
    pub speed_max_mm_s: f64,
    /// The inverse of that: rates of axes are weighed by it without a division.
    pub per_speed_s_mm: f64,
    /// Which of both it is.
    pub speed_bound: Bound,
    /// Its greatest acceleration.
    pub accel_max_mm_s2: f64,
    /// The inverse of that.
    pub per_accel_s2_mm: f64,
    /// The inverse of the step of speed that it may make at once: what ticks can show of its acceleration,
    /// or the motor's start-stop speed, whichever is more.
    pub per_jump_s_mm: f64,
    /// Its greatest jerk.
    pub jerk_max_mm_s3: Option<f64>,
}

impl Limits {
    /// Those of a machine.
    pub fn new(machine: &Machine) -> Limits {
        let tick_s = machine.bus.tick_s();
        let ticks_max = machine.bus.motion_ticks_max();
        let linear = || machine.axes.iter().filter(|profile| !profile.axis.is_rotary());
        let norm =
            |of: fn(&AxisProfile) -> f64| linear().map(|p| of(p).powi(2)).sum::<f64>().sqrt();
        Limits {
            axes: machine.axes.iter().map(|profile| AxisLimits::new(profile, machine)).collect(),
            tick_s,
            window_s: WINDOW_TICKS * tick_s,
            path_tolerance_mm: machine.path_tolerance_mm,
            piece_max_s: ticks_max
                .map_or(f64::INFINITY, |max| f64::from(max) * tick_s / PIECES_A_BUFFER),
            speed_max_mm_s: norm(|profile| profile.speed_max_mm_s),
            accel_max_mm_s2: norm(|profile| profile.accel_max_mm_s2),
            has_jerk: machine.axes.iter().any(|profile| profile.jerk_max_mm_s3.is_some()),
        }
    }

    /// The greatest speed along the path in both of two directions, by the axes' own.
    pub fn fastest_mm_s(&self, a: &Point, b: &Point) -> f64 {
        let slow_s_mm = |limit: &AxisLimits| {
            greater(a[limit.axis].abs(), b[limit.axis].abs()) * limit.per_speed_s_mm
        };
        1.0 / self.axes.iter().map(slow_s_mm).fold(0.0, greater)
    }

    /// Those of an axis, if the machine has it.
    pub fn axis(&self, axis: Axis) -> Option<&AxisLimits> {
        self.axes.iter().find(|limits| limits.axis == axis)
    }
}

impl AxisLimits {
    fn new(profile: &AxisProfile, machine: &Machine) -> AxisLimits {
        let (axis, tick_s) = (profile.axis, machine.bus.tick_s());
        let count_max = f64::from(machine.count_max(profile)) - COUNT_MARGIN;
        let count_mm_s = count_max / (tick_s * profile.steps_per_mm);
        let is_own = profile.speed_max_mm_s <= count_mm_s;
        let speed_max_mm_s = profile.speed_max_mm_s.min(count_mm_s);
        let jump_mm_s = (profile.accel_max_mm_s2 * tick_s).max(profile.start_speed_mm_s);
        AxisLimits {
            axis,
            speed_max_mm_s,
            per_speed_s_mm: 1.0 / speed_max_mm_s,
            speed_bound: if is_own { Bound::AxisSpeed(axis) } else { Bound::Count(axis) },
            accel_max_mm_s2: profile.accel_max_mm_s2,
            per_accel_s2_mm: 1.0 / profile.accel_max_mm_s2,
            per_jump_s_mm: 1.0 / jump_mm_s,
            jerk_max_mm_s3: profile.jerk_max_mm_s3,
        }
    }
}
