//! Curves over the time of motion.

use std::cell::RefCell;

use anyhow::{Context, anyhow};
use cnc::base::Command;
use cnc::interp::RunError;
use cnc::plot::{Along, Chart, Curve, Envelope, Limit, Quantity, Scale, Size, Traces};
use cnc::step::Summary;
use cnc::step::thesis;
use cnc::verify::{Setup, distances, tolerance_mm};

use super::CurveArg;
use crate::exit::{ExitWith, Failure};
use crate::program::{Program, given};

/// How far off the seed's encoder is followed, in mm.
const THESIS_OFF_MAX_MM: f64 = 10.0;

/// Distances below this are drawn as this, so that a logarithmic axis has an end.
const SHOWN_MM_MIN: f64 = 1e-4;

/// By how much more is followed where a distance did not suffice: a window grows with it, and so does time.
const WIDER: f64 = 4.0;

/// Points of a curve: seconds, and mm.
type Points = Vec<[f64; 2]>;

/// Draws a quantity of a program's job.
pub fn of_program(curve: CurveArg, program: &Program) -> Result<String, Failure> {
    let machine = &program.machine;
    let name = program.source.file_name();
    if let Some(quantity) = quantity(curve) {
        let start_steps = machine.nearest_steps(&program.start_mm());
        let mut traces = Traces::new(machine, machine.bus.tick_us, start_steps);
        let summary = RefCell::new(Summary::default());
        for command in program.commands(&summary)? {
            if let Command::Tick(tick) = command? {
                traces.tick(&tick);
            }
        }
        return Ok(named(traces.chart(quantity), name).to_string());
    }
    Ok(named(errors(program, None, curve == CurveArg::Encoders)?, name).to_string())
}

/// A drawing that stands for itself tells what it is of.
fn named(chart: Chart, name: &str) -> Chart {
    Chart { title: format!("{name}: {}", chart.title), ..chart }
}

/// How far the executed path is off; beside the seed's own encoder, if asked. The program is planned anew,
/// unless its commands are at hand.
pub fn errors(
    program: &Program,
    commands: Option<&[Command]>,
    with_encoders: bool,
) -> Result<Chart, Failure> {
    let bound_mm = tolerance_mm(&program.machine);
    let curve = |name: &str, colour, points| Curve { name: name.to_owned(), colour, points };
    let ours = ours(program, commands, bound_mm)?;
    let linear = Scale::linear("distance from the path, mm");
    let (title, y, curves) = match with_encoders {
        true => (
            "command-generation error of two encoders",
            Scale::logarithmic(&linear.label),
            vec![
                curve("encoder of the thesis", 0, theirs(program)?),
                curve("this program", 1, ours),
            ],
        ),
        false => ("how far the executed path is off", linear, vec![curve("", 0, ours)]),
    };
    Ok(Chart {
        title: title.to_owned(),
        size: Size::default(),
        x: Scale::linear("time of motion, s"),
        y,
        curves,
        limits: vec![Limit { name: "bound".to_owned(), along: Along::Y, at: bound_mm }],
    })
}

/// Draws a quantity of a dump.
pub fn of_dump(curve: CurveArg, traces: &Traces, program: &str) -> Result<String, Failure> {
    let quantity = quantity(curve).ok_or_else(|| {
        anyhow!("a dump does not hold the path that it is held against: plot its program")
    })?;
    Ok(named(traces.chart(quantity), program).to_string())
}

fn quantity(curve: CurveArg) -> Option<Quantity> {
    match curve {
        CurveArg::Speed => Some(Quantity::Speed),
        CurveArg::Acceleration => Some(Quantity::Acceleration),
        CurveArg::Steps => Some(Quantity::StepRate),
        CurveArg::Error | CurveArg::Encoders => None,
    }
}

fn ours(program: &Program, commands: Option<&[Command]>, bound_mm: f64) -> Result<Points, Failure> {
    let summary = RefCell::new(Summary::default());
    let tick_us = program.machine.bus.tick_us;
    match commands {
        Some(commands) => error_curve(program, tick_us, bound_mm, || Ok(given(commands))),
        None => error_curve(program, tick_us, bound_mm, || program.commands(&summary)),
    }
}

fn theirs(program: &Program) -> Result<Points, Failure> {
    let summary = RefCell::new(Summary::default());
    error_curve(program, thesis::TICK_US, THESIS_OFF_MAX_MM, || {
        Ok(program.thesis_commands(&summary))
    })
}

fn error_curve<C>(
    program: &Program,
    tick_us: u32,
    within_mm: f64,
    commands: impl Fn() -> Result<C, RunError>,
) -> Result<Points, Failure>
where
    C: Iterator<Item = Result<Command, RunError>>,
{
    let machine = &program.machine;
    let setup = Setup {
        machine,
        tick_us,
        start_steps: machine.nearest_steps(&program.start_mm()),
        constant_feed: false,
        with_events: false,
        with_buffers: false,
    };
    let tick_s = f64::from(tick_us) * 1e-6;
    let path = || Ok::<_, RunError>(program.path());
    let mut follows_mm = tolerance_mm(machine).min(within_mm);
    let envelope = loop {
        let mut envelope = Envelope::new(tick_s);
        let suffices = distances(&setup, follows_mm, &commands, path, |tick, mm| {
            envelope.add((tick + 1) as f64 * tick_s, mm.max(SHOWN_MM_MIN));
        })
        .with_context(|| program.source.name().to_owned())
        .or_bad_input()?;
        if suffices || follows_mm == within_mm {
            break envelope;
        }
        follows_mm = (follows_mm * WIDER).min(within_mm);
    };
    Ok(envelope.points())
}
