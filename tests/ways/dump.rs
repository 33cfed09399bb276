//! The ticks of a path, and what `verify` says of them.

use std::convert::Infallible;

use cnc::base::{Command, Machine, Tick};
use cnc::path::{PathItem, Segment};
use cnc::plan::{self, Feed};
use cnc::step;
use cnc::verify::{self, Report, Setup};

fn items(segments: &[Segment]) -> impl Iterator<Item = Result<PathItem, Infallible>> {
    segments.iter().cloned().map(|segment| Ok(PathItem::from(segment)))
}

pub fn ticks(segments: &[Segment], machine: &Machine) -> Vec<Tick> {
    let start = machine.work_zero_mm;
    let Ok(seams) = plan::place(|| items(segments), machine, Feed::LookAhead);
    let plan = plan::plan(items(segments), machine, Feed::LookAhead, &seams, start);
    let tick = |command| match command {
        Ok(Command::Tick(tick)) => tick,
        other => unreachable!("{other:?}"),
    };
    step::interpolate(plan, machine, start).map(tick).collect()
}

pub fn report(segments: &[Segment], ticks: &[Tick], machine: &Machine) -> Report {
    let setup = Setup {
        machine,
        tick_us: machine.bus.tick_us,
        start_steps: machine.nearest_steps(&machine.work_zero_mm),
        constant_feed: false,
        with_events: true,
        with_buffers: true,
    };
    let commands =
        || Ok::<_, Infallible>(ticks.iter().map(|t| Ok::<_, Infallible>(Command::Tick(*t))));
    verify::verify(&setup, commands, || Ok::<_, Infallible>(items(segments))).unwrap()
}
