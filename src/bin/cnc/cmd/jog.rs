//! `cnc jog`: one axis by so much, planned like any program; or raw, by the node alone.

use std::convert::Infallible;

use cnc::base::machine::POSITION_MOST;
use cnc::base::{Axis, Machine, Point};
use cnc::path::{self, PathItem, Segment};
use cnc::plan::{self, Feed};
use cnc::step;
use cnc::wire::{self, Job};

use super::send::direct::{self, DirectArgs};
use super::send::{by_hand, check_speed, gather, run_job};
use crate::args::Global;
use crate::exit::{Exit, ExitWith, Failure, Outcome};
use crate::input;
use crate::interrupt::Interrupts;
use crate::journal::Told;

/// Move one axis
///
/// Planned and sent as a program is: with ramps, within the axis's travel, tick by tick.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    direct: DirectArgs,
    /// The axis
    #[arg(value_name = "AXIS", value_parser = direct::axis)]
    axis: Axis,
    /// How far, in mm (degrees on rotary axes); towards minus if negative
    #[arg(long, value_name = "MM", allow_hyphen_values = true, value_parser = position)]
    by: f64,
    /// How fast, in mm/min [default: a quarter of the axis's greatest speed; with --raw what it can
    /// start and stop at]
    #[arg(long, value_name = "F", value_parser = feed)]
    feed: Option<f64>,
    /// Machine position at which the axis stands, in mm [default: where the journal
    /// has it, or else the profile's work zero]
    #[arg(long, value_name = "MM", allow_hyphen_values = true, value_parser = position)]
    from: Option<f64>,
    /// Let the node run by itself, without ramp, limits or a position afterwards; Enter, Ctrl-C or the
    /// end of input stops it, --by at the latest
    #[arg(long, conflicts_with = "from")]
    raw: bool,
}

fn position(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number: &f64| number.abs() <= POSITION_MOST);
    number.ok_or_else(|| "a number of mm is expected".to_owned())
}

fn feed(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|feed: &f64| feed.is_finite() && *feed > 0.0);
    number.ok_or_else(|| "a feed above zero is expected, in mm/min".to_owned())
}

pub fn run(args: &Args, global: &Global) -> Outcome {
    let machine = input::machine(global)?;
    direct::check_axes(&[args.axis], &machine).or_bad_input()?;
    let port = args.direct.port.port(global)?;
    let told = Told::of(&port, &args.direct.journal, &machine)?;
    let from = args.from.or(told.position_mm(args.axis, &machine));
    // Who says where the axis stands knows what is about to happen; so does the journal.
    let send = args.direct.to_send(args.raw || from.is_none());
    check_speed(&send, &port, &machine)?;
    if args.raw {
        let interrupts = Interrupts::watch()?;
        let job = wire::raw_jog(&machine, args.axis, args.by, args.feed).or_bad_input()?;
        let exit = run_job(&send, global, &port, &machine, job, by_hand("jog", &machine))?;
        // Ctrl-C has stopped the axis as it is meant to; a script still has to know.
        let stopped = exit == Exit::Ok && interrupts.count() > 0;
        return Ok(if stopped { Exit::Interrupted } else { exit });
    }
    let mut start_mm = machine.work_zero_mm;
    start_mm[args.axis] = from.unwrap_or(start_mm[args.axis]);
    let way = path::jog(&machine, args.axis, start_mm, args.by, args.feed).or_bad_input()?;
    let job = planned(&machine, way, start_mm)?;
    let job = job.only([args.axis].into_iter().collect());
    run_job(&send, global, &port, &machine, job, by_hand("jog", &machine))
}

/// The job of one way.
fn planned(machine: &Machine, way: Segment, start_mm: Point) -> Result<Job, Failure> {
    let path = || [Ok::<_, Infallible>(PathItem::from(way.clone()))].into_iter();
    let seams = plan::place(path, machine, Feed::LookAhead)?;
    let plan = plan::plan(path(), machine, Feed::LookAhead, &seams, start_mm);
    let commands = step::interpolate(plan, machine, start_mm);
    gather(commands, machine.nearest_steps(&start_mm), machine)?.or_bad_input()
}
