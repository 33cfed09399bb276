//! The systems of the papers behind this project, as pure computation: path and figures in, figures out.
//! No clock and no device; what is sent to nodes is `wire`'s.
//!
//! - [`carry`]: what an interface carries against nodes, baud rate and sampling frequency, and
//!   whether it keeps up with a program
//! - [`cutting`]: chip, force and power of milling (seed 004)
//! - [`difference`]: nodes that interpolate by difference equations (seed 004, Method B)
//! - [`plc`]: M, S and T functions by handshake with a PLC (seed 001)
//! - [`pulse`]: interpolation pulses, one by one (seed 001)
//! - [`sercos`]: telegrams and a virtual ring of drives (seed 000)

pub mod carry;
pub mod cutting;
pub mod difference;
pub mod plc;
pub mod pulse;
pub mod sercos;

use crate::base::Machine;
use crate::path::Segment;

/// The greatest speed along a segment that its axes can do: steps of a tick, and their own speeds.
pub fn axes_speed_mm_s(segment: &Segment, machine: &Machine) -> f64 {
    let shares = segment.axis_speeds();
    let of_axis = machine.axes.iter().filter_map(|profile| {
        let share = shares[profile.axis];
        let count = f64::from(machine.count_max(profile));
        let greatest_mm_s = count / profile.steps_per_mm / machine.bus.tick_s();
        (share > 0.0).then(|| greatest_mm_s.min(profile.speed_max_mm_s) / share)
    });
    of_axis.fold(f64::INFINITY, f64::min)
}
