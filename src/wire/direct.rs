//! What a node does by itself, without a buffer: homing, and the raw jog; as jobs of one axis after
//! another.
//!
//! Rules: no axis homes faster than it may go (H16), none is jogged raw faster than it can start and
//! stop without a ramp (H17), and for each it is known when to give up. A node says nothing of the
//! steps that it makes here: [`HomeRun::audit`] has no more than the time that they took.

use crate::base::machine::{AxisProfile, Protocol, Unit};
use crate::base::{Axis, AxisMap, AxisSet, Machine};
use crate::wire::codec;
use crate::wire::job::{Job, Step};
use crate::wire::node::{self, HOME_STEPS};

/// How late an answer may be read: an adapter keeps it back for up to 16 ms, the system wakes late.
const ANSWER_LATE_US: u64 = 20_000;
/// How far a node's tick may be off what it is said to be, in percent.
const TICK_OFF_PERCENT: u64 = 2;
/// The travel and a tenth may pass before a switch is given up; with a node that is too slow, half as
/// much again.
const WAIT_PERCENT: u64 = 165;
/// Ticks of homing beyond that: to find an axis that stands a little outside of its travel.
const WAIT_TICKS: u64 = 20;

/// A command that one node carries out by itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Direct {
    /// It runs to its limit switch.
    Home(Home),
    /// It repeats a count, tick after tick.
    Jog(RawJog),
}

impl Direct {
    /// The node.
    pub fn unit(&self) -> Unit {
        match self {
            Direct::Home(home) => home.unit,
            Direct::Jog(jog) => jog.unit,
        }
    }
}

/// Homing of one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Home {
    /// The node.
    pub unit: Unit,
    /// Its axis.
    pub axis: Axis,
    /// Where the switch is, in motor steps.
    pub switch_steps: i64,
    /// Where the axis stands as counted so far, if anybody has counted.
    pub counted_steps: Option<i64>,
    /// How long a tick of [`HOME_STEPS`] takes.
    pub tick_us: u64,
    /// How long homing takes at most.
    pub wait_us: u64,
}

/// A raw jog of one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RawJog {
    /// The node.
    pub unit: Unit,
    /// Its axis.
    pub axis: Axis,
    /// Signed steps a tick.
    pub count: i32,
    /// How long a tick takes.
    pub tick_us: u64,
    /// When the way asked for is made: the jog ends then at the latest.
    pub lasts_us: u64,
}

impl RawJog {
    /// The feed byte.
    pub(super) fn byte(&self) -> u8 {
        // The count was held to what a byte carries.
        codec::encode(self.count).unwrap_or(0)
    }
}

/// An axis that has been homed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HomeRun {
    /// The axis.
    pub axis: Axis,
    /// How long it ran.
    pub took_us: u64,
    /// Steps that it has made by that time, at least and at most.
    pub made_steps: [u64; 2],
    /// Steps that it had to make by what was counted, if anybody has counted.
    pub counted_steps: Option<i64>,
}

/// What the time of homing says of a counted position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Audit {
    /// Nobody has counted.
    NotCounted,
    /// It may be right.
    Agrees,
    /// It was off by so many steps at least: steps were lost, or the position was not what it was
    /// taken for.
    OffBy(u64),
}

impl HomeRun {
    /// The switch is looked at between ticks: an axis may stand so many steps beyond it.
    pub const BEYOND_STEPS_MAX: u64 = HOME_STEPS as u64 - 1;

    /// The run of an axis whose node answered after these times, of one command after another.
    pub(super) fn new(home: &Home, took_us: &[u64]) -> HomeRun {
        let ticks = |us: u64, percent: u64| us * 100 / percent / home.tick_us.max(1);
        let least = |us: u64| ticks(us.saturating_sub(ANSWER_LATE_US), 100 + TICK_OFF_PERCENT);
        let greatest = |us: u64| ticks(us, 100 - TICK_OFF_PERCENT);
        let steps = u64::from(HOME_STEPS);
        let made_steps = [
            // The last tick is made whole, however near the switch.
            (took_us.iter().map(|us| least(*us)).sum::<u64>() * steps).saturating_sub(steps),
            took_us.iter().map(|us| greatest(*us)).sum::<u64>() * steps,
        ];
        HomeRun {
            axis: home.axis,
            took_us: took_us.iter().sum(),
            made_steps,
            counted_steps: home.counted_steps.map(|steps| steps - home.switch_steps),
        }
    }

    /// Holds the counted position against the time that homing took.
    pub fn audit(&self) -> Audit {
        let Some(counted) = self.counted_steps else { return Audit::NotCounted };
        let [low, high] = self.made_steps;
        let counted = counted.max(0).unsigned_abs();
        match counted {
            _ if counted < low => Audit::OffBy(low - counted),
            _ if counted > high => Audit::OffBy(counted - high),
            _ => Audit::Agrees,
        }
    }
}

/// Why a machine cannot be homed, or not jogged raw.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DirectError {
    /// The profile names no protocol.
    #[error("this machine's profile says bus.protocol = \"none\": nothing can be sent over it")]
    NoProtocol,
    /// Frames go one way.
    #[error(
        "nodes that take frames (bus.protocol = \"frame\") cannot be homed or jogged by themselves: they could not \
         tell that they are at a switch, nor be stopped; `cnc jog --by` moves an axis by frames, and --at says \
         where it stands"
    )]
    NoAnswers,
    /// The machine has no such axis, or no node for it.
    #[error("this machine has no axis {0}, or no node for it")]
    NoAxis(Axis),
    /// H16.
    #[error(
        "{axis} would home at {speed_mm_s:.1} {unit}/s ({HOME_STEPS} steps in a tick of {tick_us} µs, \
         whatever the machine), its greatest speed is {speed_max_mm_s}; if a tick of its node really \
         lasts longer, say so: --measured-tick {least_us}, or more"
    )]
    TooFast {
        /// The axis.
        axis: Axis,
        /// mm or °.
        unit: &'static str,
        /// How fast it would go.
        speed_mm_s: f64,
        /// How fast it may go.
        speed_max_mm_s: f64,
        /// The tick of the node.
        tick_us: u32,
        /// The tick at which it would be just right.
        least_us: u32,
    },
    /// Without it nobody knows when to give up, nor where the switch is.
    #[error("axis {0} has no travel in the profile: it cannot be said how long homing may take")]
    NoTravel(Axis),
    /// H17.
    #[error(
        "a raw jog has no ramp: {axis} starts and stops at {start_speed_mm_min} {unit}/min at most, {feed_mm_min} is asked for"
    )]
    RawTooFast {
        /// The axis.
        axis: Axis,
        /// mm or °.
        unit: &'static str,
        /// What it can start and stop at.
        start_speed_mm_min: f64,
        /// What is asked for.
        feed_mm_min: f64,
    },
    /// The slowest raw jog is a step a tick.
    #[error(
        "a raw jog makes a whole number of steps a tick: the slowest one of {axis} is {least_mm_min} {unit}/min, {feed_mm_min} is allowed or asked for"
    )]
    RawTooSlow {
        /// The axis.
        axis: Axis,
        /// mm or °.
        unit: &'static str,
        /// One step a tick.
        least_mm_min: f64,
        /// What is asked for, or what the axis can start and stop at.
        feed_mm_min: f64,
    },
}

/// Homes axes one after another: those that are wanted, or else all that the profile's `home_order`
/// names, or else all. `counted` is where each axis stands as counted so far, if anybody has counted
/// it; `measured_tick_us` what a tick of the nodes really lasts.
///
/// # Errors
/// The first thing that forbids it.
pub fn homing(
    machine: &Machine,
    wanted: &[Axis],
    counted: AxisMap<Option<i64>>,
    measured_tick_us: Option<u32>,
) -> Result<Job, DirectError> {
    if let Some(axis) = wanted.iter().find(|axis| machine.axis(**axis).is_none()) {
        return Err(DirectError::NoAxis(*axis));
    }
    let home = |axis: Axis| home(machine, axis, counted[axis], measured_tick_us).map(Direct::Home);
    let steps = home_order(machine, wanted).into_iter().map(home).collect::<Result<_, _>>()?;
    Ok(job(machine, steps, counted))
}

/// Jogs an axis by a way at most, at a feed or as fast as it can start and stop without a ramp. Where
/// it stands is not known from then on.
///
/// # Errors
/// When the axis cannot be jogged so.
pub fn raw_jog(
    machine: &Machine,
    axis: Axis,
    by_mm: f64,
    feed_mm_min: Option<f64>,
) -> Result<Job, DirectError> {
    let (profile, unit) = axis_and_node(machine, axis)?;
    let start_speed_mm_min = profile.start_speed_mm_s * 60.0;
    let feed_mm_min = feed_mm_min.unwrap_or(start_speed_mm_min);
    if feed_mm_min > start_speed_mm_min {
        let unit = unit_name(axis);
        return Err(DirectError::RawTooFast { axis, unit, start_speed_mm_min, feed_mm_min });
    }
    let node_tick_us = machine.bus.node_tick_us;
    let least_mm_min = 60e6 / (f64::from(node_tick_us) * profile.steps_per_mm);
    // 1e-9 forgives what the quotient's rounding takes off a whole number.
    let count = (feed_mm_min / least_mm_min * (1.0 + 1e-9)) as u32;
    let count = count.min(machine.count_max(profile)) as i32;
    if count == 0 {
        let unit = unit_name(axis);
        return Err(DirectError::RawTooSlow { axis, unit, least_mm_min, feed_mm_min });
    }
    let ticks = ((by_mm * profile.steps_per_mm).abs() / f64::from(count)).round() as u64;
    let mut jog = RawJog {
        unit,
        axis,
        count: if by_mm < 0.0 { -count } else { count },
        tick_us: 0,
        lasts_us: 0,
    };
    jog.tick_us = node::go_us(u64::from(node_tick_us / 2), jog.byte());
    jog.lasts_us = ticks.saturating_mul(jog.tick_us);
    Ok(job(machine, vec![Direct::Jog(jog)], AxisMap::default()))
}

fn home(
    machine: &Machine,
    axis: Axis,
    counted_steps: Option<i64>,
    measured_tick_us: Option<u32>,
) -> Result<Home, DirectError> {
    let (profile, unit) = axis_and_node(machine, axis)?;
    let steps = f64::from(HOME_STEPS);
    let tick_us = measured_tick_us.unwrap_or(machine.bus.node_tick_us);
    let speed_mm_s = steps * 1e6 / (f64::from(tick_us) * profile.steps_per_mm);
    let speed_max_mm_s = profile.speed_max_mm_s;
    // 1e-9 forgives the quotient's rounding.
    if speed_mm_s > speed_max_mm_s * (1.0 + 1e-9) {
        let least_us = (steps * 1e6 / (speed_max_mm_s * profile.steps_per_mm)).ceil() as u32;
        let unit = unit_name(axis);
        return Err(DirectError::TooFast {
            axis,
            unit,
            speed_mm_s,
            speed_max_mm_s,
            tick_us,
            least_us,
        });
    }
    let (Some([low_mm, high_mm]), Some(switch_steps)) = (profile.travel_mm, profile.switch_steps())
    else {
        return Err(DirectError::NoTravel(axis));
    };
    let go_us = node::go_us(u64::from(machine.bus.node_tick_us / 2), HOME_STEPS);
    let tick_us = measured_tick_us.map_or(go_us, u64::from);
    let travel_steps = ((high_mm - low_mm) * profile.steps_per_mm) as u64;
    let ticks = travel_steps / u64::from(HOME_STEPS) + WAIT_TICKS;
    let wait_us = ticks.saturating_mul(tick_us) / 100 * WAIT_PERCENT;
    Ok(Home { unit, axis, switch_steps, counted_steps, tick_us, wait_us })
}

/// The axes that are homed, in order: the profile's first, then Z, out of the way of all others.
fn home_order(machine: &Machine, wanted: &[Axis]) -> Vec<Axis> {
    let all = || machine.axes.iter().map(|profile| profile.axis);
    let mut order = machine.home_order.clone();
    for axis in all().filter(|axis| *axis == Axis::Z).chain(all()) {
        let is_wanted = !wanted.is_empty() || machine.home_order.is_empty();
        if is_wanted && !order.contains(&axis) {
            order.push(axis);
        }
    }
    order.retain(|axis| wanted.is_empty() || wanted.contains(axis));
    order
}

fn axis_and_node(machine: &Machine, axis: Axis) -> Result<(&AxisProfile, Unit), DirectError> {
    match machine.bus.protocol {
        Protocol::None => return Err(DirectError::NoProtocol),
        Protocol::Frame => return Err(DirectError::NoAnswers),
        Protocol::Buffered => {}
    }
    let profile = machine.axis(axis).ok_or(DirectError::NoAxis(axis))?;
    let id = *machine.bus.nodes.get(&axis).ok_or(DirectError::NoAxis(axis))?;
    Ok((profile, Unit { axis: Some(axis), id }))
}

fn unit_name(axis: Axis) -> &'static str {
    if axis.is_rotary() { "°" } else { "mm" }
}

fn job(machine: &Machine, steps: Vec<Direct>, counted: AxisMap<Option<i64>>) -> Job {
    let taken_for = machine.nearest_steps(&machine.work_zero_mm);
    let start_steps = AxisMap::from_fn(|axis| counted[axis].unwrap_or(taken_for[axis]));
    let nodes: Vec<Unit> = steps.iter().map(Direct::unit).collect();
    let axes: AxisSet = nodes.iter().filter_map(|unit| unit.axis).collect();
    Job {
        steps: steps.into_iter().map(Step::Direct).collect(),
        start_steps,
        start_mm: machine.position_mm(&start_steps),
        end_steps: start_steps,
        extents_mm: AxisMap::default(),
        ticks: 0,
        nodes,
        axes,
        unknown: axes.iter().filter(|axis| counted[*axis].is_none()).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn starmill(more: &str) -> Machine {
        let text = Machine::load("starmill").unwrap().to_toml().replace("[axes.X]", more);
        Machine::parse("test", &text).unwrap()
    }

    fn order(machine: &Machine, wanted: &[Axis]) -> String {
        home_order(machine, wanted).into_iter().map(Axis::letter).collect()
    }

    #[test]
    fn z_homes_first_or_what_the_profile_says() {
        let plain = starmill("[axes.X]");
        assert_eq!(order(&plain, &[]), "ZXY");
        assert_eq!(order(&plain, &[Axis::X, Axis::Z]), "ZX");
        let own = starmill("home_order = [\"Y\", \"Z\"]\n[axes.X]");
        assert_eq!(order(&own, &[]), "YZ");
        assert_eq!(order(&own, &[Axis::X, Axis::Z]), "ZX");
    }

    #[test]
    fn homing_is_refused_where_it_is_too_fast() {
        let machine = starmill("[axes.X]");
        let homing =
            |wanted: &[Axis], tick_us| homing(&machine, wanted, AxisMap::default(), tick_us);
        let refused = homing(&[Axis::X], None).unwrap_err();
        assert!(matches!(refused, DirectError::TooFast { least_us: 40_000, .. }), "{refused}");
        assert!(homing(&[], Some(39_999)).is_err());
        let job = homing(&[], Some(40_000)).unwrap();
        assert_eq!((job.steps.len(), job.axes.len(), job.unknown.len()), (3, 3, 3));
        let gone = homing(&[Axis::A], Some(40_000));
        assert_eq!(gone, Err(DirectError::NoAxis(Axis::A)));
        let router = Machine::load("router").unwrap();
        let none = super::homing(&router, &[], AxisMap::default(), None);
        assert_eq!(none, Err(DirectError::NoProtocol));
    }

    #[test]
    fn a_raw_jog_is_no_faster_than_a_start_without_a_ramp() {
        let machine = starmill("[axes.X]");
        let jog = |by_mm, feed| match &raw_jog(&machine, Axis::X, by_mm, feed)?.steps[..] {
            [Step::Direct(Direct::Jog(jog))] => Ok(*jog),
            other => panic!("{other:?}"),
        };
        let found = jog(-2.0, None).unwrap();
        assert_eq!((found.count, found.byte(), found.tick_us), (-1, 129, 10_026));
        assert_eq!(found.lasts_us, 200 * 10_026);
        assert!(matches!(jog(1.0, Some(61.0)), Err(DirectError::RawTooFast { .. })));
        assert!(matches!(jog(1.0, Some(59.0)), Err(DirectError::RawTooSlow { .. })));
    }

    #[test]
    fn the_time_of_homing_tells_of_lost_steps() {
        let unit = Unit { axis: Some(Axis::X), id: 122 };
        let home = Home {
            unit,
            axis: Axis::X,
            switch_steps: 0,
            counted_steps: Some(7500),
            tick_us: 10_000,
            wait_us: 0,
        };
        let audit = |ticks: u64| HomeRun::new(&home, &[ticks * 10_000 + 300, 300]).audit();
        // 94 ticks of 80 are the way of 7500 steps.
        assert_eq!(audit(94), Audit::Agrees);
        assert_eq!(audit(93), Audit::Agrees);
        assert!(matches!(audit(100), Audit::OffBy(1..500)));
        assert!(matches!(audit(60), Audit::OffBy(2000..3000)));
        let uncounted = Home { counted_steps: None, ..home };
        assert_eq!(HomeRun::new(&uncounted, &[300]).audit(), Audit::NotCounted);
    }
}
