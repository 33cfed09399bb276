//! `cnc home`: axes run to their switches, one after another.

use cnc::base::{Axis, AxisMap};
use cnc::wire;
use cnc::wire_io::Speed;

use super::send::direct::{self, AxisList, DirectArgs};
use super::send::{by_hand, check_speed, run_job};
use crate::args::Global;
use crate::exit::{ExitWith, Outcome};
use crate::input::{self, Start};
use crate::journal::Told;

/// Send axes to their home switches
///
/// One after another, in the profile's home_order, or Z first. The nodes do it by themselves, towards
/// minus, at 80 steps a tick whatever the machine, and nothing stops them but their switches.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    direct: DirectArgs,
    /// Axes, as X Z [default: the profile's home_order, or all]
    #[arg(value_name = "AXES", value_parser = direct::axes)]
    axes: Vec<AxisList>,
    /// What a tick of the nodes really lasts, in µs, as measured on the machine
    #[arg(long, value_name = "US", value_parser = clap::value_parser!(u32).range(100..=10_000_000))]
    measured_tick: Option<u32>,
    /// Machine position at which the axes are believed to stand, in mm: held against the time that
    /// homing takes [default: what the journal has]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    start: Option<Start>,
}

pub fn run(args: &Args, global: &Global) -> Outcome {
    let mut machine = input::machine(global)?;
    let send = args.direct.to_send(true);
    let port = send.port.port(global)?;
    check_speed(&send, &port, &machine)?;
    let axes: Vec<Axis> = args.axes.iter().flat_map(|list| list.0.iter().copied()).collect();
    direct::check_axes(&axes, &machine).or_bad_input()?;
    let counted = match &args.start {
        // Time is all that the audit has, and here is none.
        _ if args.direct.speed == Some(Speed::Max) => AxisMap::default(),
        Some(start) => {
            let steps = machine.nearest_steps(&start.position_mm(&machine));
            AxisMap::from_fn(|axis| Some(steps[axis]))
        }
        None => Told::of(&port, &args.direct.journal, &machine)?.steps,
    };
    let job = wire::homing(&machine, &axes, counted, args.measured_tick).or_bad_input()?;
    // Simulated nodes take over a tick what the machine's were measured to take.
    if let Some(tick_us) = args.measured_tick.filter(|_| args.direct.is_sim().unwrap_or(false)) {
        machine.bus.node_tick_us = tick_us;
    }
    run_job(&send, global, &port, &machine, job, by_hand("home", &machine))
}
