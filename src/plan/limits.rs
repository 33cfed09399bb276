//! How fast a segment may be run: what the limits of axes, bus and tick make of a speed along
//! the path.

use std::fmt;

use crate::base::machine::AxisProfile;
use crate::base::{Axis, AxisMap, Machine};
use crate::path::{Arc, AxisRate, Curve, MeasuredSpline, Segment};

/// Speed and acceleration along a segment, and what set the speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Greatest speed along the path.
    pub speed_mm_s: f64,
    /// Greatest acceleration along the path, up to that speed.
    pub accel_mm_s2: f64,
    /// What set the speed.
    pub bound: Bound,
}

/// What sets the speed of a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Bound {
    /// The feed of the program.
    Feed,
    /// The greatest speed of an axis.
    AxisSpeed(Axis),
    /// The most steps that an axis's node makes in a tick.
    Count(Axis),
    /// The acceleration across the path of an arc or spline.
    Curvature(Axis),
    /// The chord that a tick makes of an arc or spline.
    Chord,
}

impl fmt::Display for Bound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Bound::Feed => write!(f, "feed"),
            Bound::AxisSpeed(axis) => write!(f, "speed of {axis}"),
            Bound::Count(axis) => write!(f, "steps a tick of {axis}"),
            Bound::Curvature(axis) => write!(f, "acceleration of {axis} in curves"),
            Bound::Chord => write!(f, "chord of a tick in curves"),
        }
    }
}

/// Share of an axis's acceleration that an arc's curvature may take. The rest, sqrt(1 - 0.8²) =
/// 0.6 of it, is left for the ramps, a quarter turn out of phase.
const BEND_SHARE: f64 = 0.8;

/// The same of a spline, where both are not known to be out of phase: what is left of the sum.
const SPLINE_BEND_SHARE: f64 = 0.7;

/// Share of `path_tolerance_mm` for the chords of arcs and splines; the rest is for corners within a tick.
const CHORD_SHARE: f64 = 0.5;

/// Keeps a count below its limit whatever the rounding of positions does, in steps.
const COUNT_MARGIN: f64 = 1e-6;

/// The limits of a segment on a machine, with ramps or (seed's constant feed) without.
pub fn of(segment: &Segment, machine: &Machine, with_ramps: bool) -> Limits {
    let rates = segment.axis_rates();
    let mut limits = Limits {
        speed_mm_s: segment.feed_mm_s.unwrap_or(f64::INFINITY),
        accel_mm_s2: f64::INFINITY,
        bound: Bound::Feed,
    };
    for profile in &machine.axes {
        let rate = &rates[profile.axis];
        if rate.speed > 0.0 {
            limits.bounded_by(profile.speed_max_mm_s / rate.speed, Bound::AxisSpeed(profile.axis));
            limits
                .bounded_by(count_speed(profile, machine) / rate.speed, Bound::Count(profile.axis));
        }
        if with_ramps && rate.bend_per_mm > 0.0 {
            let speed = (BEND_SHARE * profile.accel_max_mm_s2 / rate.bend_per_mm).sqrt();
            limits.bounded_by(speed, Bound::Curvature(profile.axis));
        }
    }
    match &segment.curve {
        Curve::Line => {}
        Curve::Arc(arc) => limits.bounded_by(chord_speed(segment, arc, machine), Bound::Chord),
        Curve::Spline(spline) => {
            let (speed_mm_s, bound) = spline_speed(spline, machine, &limits, with_ramps);
            limits.bounded_by(speed_mm_s, bound);
        }
    }
    let turning = match &segment.curve {
        Curve::Spline(spline) => Some(Turning::at(limits.speed_mm_s, spline, machine)),
        Curve::Line | Curve::Arc(_) => None,
    };
    for profile in &machine.axes {
        let (rate, accel_max_mm_s2) = (&rates[profile.axis], profile.accel_max_mm_s2);
        if rate.speed_amplitude > 0.0 {
            let accel = match &turning {
                Some(turning) => {
                    (accel_max_mm_s2 - turning.bends_mm_s2[profile.axis]) / rate.speed_amplitude
                }
                None => accel_along(rate, accel_max_mm_s2, limits.speed_mm_s),
            };
            limits.accel_mm_s2 = limits.accel_mm_s2.min(accel);
        }
    }
    limits
}

/// How the turning of a spline is seen by a machine that goes a chord a tick.
struct Turning {
    /// How much it accelerates each axis: v · |change of direction within a tick| / tick. Where the
    /// curve turns evenly that is v² · curvature; it has bounds at a corner or a cusp too.
    bends_mm_s2: AxisMap<f64>,
    /// How far the chord is off. Over a way whose direction changes by d that is a quarter of both
    /// at most: so it is where all of the turn is a corner in the middle.
    off_mm: f64,
}

impl Turning {
    fn at(speed_mm_s: f64, spline: &MeasuredSpline, machine: &Machine) -> Turning {
        let tick_s = machine.bus.tick_s();
        let way_mm = speed_mm_s * tick_s;
        let turns = spline.turn_within(way_mm);
        let mut bends_mm_s2 = AxisMap::default();
        for (axis, turn) in Axis::LINEAR.into_iter().zip(turns) {
            bends_mm_s2[axis] = speed_mm_s * turn / tick_s;
        }
        let turn = turns.iter().map(|turn| turn * turn).sum::<f64>().sqrt();
        Turning { bends_mm_s2, off_mm: way_mm * turn / 4.0 }
    }
}

/// Halvings of the range of speeds, as a ratio: of a range of a million the last is below 0.1 %.
const HALVINGS: u32 = 14;

/// The greatest speed, up to that of the limits, at which the turning of a spline leaves every
/// axis within its share of acceleration, and chords within their share of the path tolerance.
/// The slower, the less of both, so halving finds it, from a speed that suffices for any curve: no
/// rate changes by more than 2, from 1 to -1.
fn spline_speed(
    spline: &MeasuredSpline,
    machine: &Machine,
    limits: &Limits,
    with_ramps: bool,
) -> (f64, Bound) {
    let exceeded = |speed_mm_s: f64| {
        let turning = Turning::at(speed_mm_s, spline, machine);
        let share = |axis: Axis| machine.axis(axis).map(|p| SPLINE_BEND_SHARE * p.accel_max_mm_s2);
        let is_beyond = |axis: &Axis| share(*axis).is_some_and(|a| turning.bends_mm_s2[*axis] > a);
        let axis = Axis::LINEAR.into_iter().find(is_beyond).filter(|_| with_ramps);
        let is_off = turning.off_mm > CHORD_SHARE * machine.path_tolerance_mm;
        axis.map(Bound::Curvature).or(is_off.then_some(Bound::Chord))
    };
    let tick_s = machine.bus.tick_s();
    let corner_mm_s = CHORD_SHARE * machine.path_tolerance_mm * 4.0 / 12.0_f64.sqrt() / tick_s;
    let axes = machine.axes.iter();
    let turns_mm_s = axes.map(|p| SPLINE_BEND_SHARE * p.accel_max_mm_s2 / 2.0 * tick_s);
    let (mut high, mut bound) = (limits.speed_mm_s, limits.bound);
    let mut low = turns_mm_s.fold(corner_mm_s.min(high), f64::min);
    match exceeded(high) {
        None => return (high, bound),
        Some(found) => bound = found,
    }
    for _ in 0..HALVINGS {
        let middle = (low * high).sqrt();
        match exceeded(middle) {
            None => low = middle,
            Some(found) => (high, bound) = (middle, found),
        }
    }
    (low, bound)
}

impl Limits {
    fn bounded_by(&mut self, speed_mm_s: f64, bound: Bound) {
        if speed_mm_s < self.speed_mm_s {
            self.speed_mm_s = speed_mm_s;
            self.bound = bound;
        }
    }
}

/// The speed at which an axis makes the most steps that its node can in a tick.
fn count_speed(profile: &AxisProfile, machine: &Machine) -> f64 {
    let count_max = f64::from(machine.count_max(profile)) - COUNT_MARGIN;
    count_max / (machine.bus.tick_s() * profile.steps_per_mm)
}

/// The speed at which a tick turns an arc so far that its chord is off by its share of the path
/// tolerance. The sagitta over an angle θ is at most r·θ²/8; a whole circle is 2r wide.
fn chord_speed(segment: &Segment, arc: &Arc, machine: &Machine) -> f64 {
    let off_mm = CHORD_SHARE * machine.path_tolerance_mm;
    let radius_mm = arc.radius_max_mm();
    if 2.0 * radius_mm <= off_mm {
        return f64::INFINITY;
    }
    let angle_rad = (8.0 * off_mm / radius_mm).sqrt();
    segment.length_mm() * angle_rad / arc.sweep_rad.abs() / machine.bus.tick_s()
}

/// Acceleration along the path that leaves an axis within its own: along and across are a
/// quarter turn out of phase, so (along · speed_amplitude)² + (v² · bend)² ≤ accel_max².
fn accel_along(rate: &AxisRate, accel_max_mm_s2: f64, speed_mm_s: f64) -> f64 {
    let across = (speed_mm_s * speed_mm_s * rate.bend_per_mm).min(accel_max_mm_s2);
    (accel_max_mm_s2 * accel_max_mm_s2 - across * across).sqrt() / rate.speed_amplitude
}
