//! Commands against commands: where two jobs differ first, and how far apart what they execute is.
//!
//! What both execute are polylines, tick point by tick point: their greatest distance is the Fréchet
//! distance of these (`apart`).

use std::collections::BTreeMap;

use serde::Serialize;

use super::apart::{Apart, Vertex, apart};
use super::executed::Executed;
use super::{Cause, Place, Setup, VerifyError, tolerance_mm};
use crate::base::rounding::six_digits;
use crate::base::{Axis, AxisMap, Command, Machine};

/// What two jobs have in common, and what not.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Version of the document.
    pub schema: u32,
    /// Both do the same, tick by tick.
    pub same: bool,
    /// Where they part first.
    pub first_difference: Option<FirstDifference>,
    /// The Fréchet distance between what both execute in X, Y and Z: so much at most.
    pub max_distance_mm: f64,
    /// By how much less it may be: a thousandth, or more where both are so far apart that it would take long
    /// to tell.
    pub max_distance_resolution_mm: f64,
    /// Whether the distance is greater than that, by how much is unknown.
    pub max_distance_is_lower_bound: bool,
    /// Where it is greatest: tick of the first job, NC line of the second.
    pub worst: Option<Place>,
    /// End point of the second job less that of the first.
    pub end_difference_steps: BTreeMap<Axis, i64>,
    /// Ticks of both.
    pub ticks: [u64; 2],
    /// Time of those ticks.
    pub seconds: [f64; 2],
    /// Whether both have the same events in the same order.
    pub same_events: bool,
}

/// Where two jobs part.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FirstDifference {
    /// Ticks that both have in common before.
    pub tick: u64,
    /// NC lines of both there; none where one has ended.
    pub lines: [Option<u32>; 2],
    /// What each does there.
    pub what: [String; 2],
}

/// A job as a comparison sees it: counts, events, and what they come to.
struct Side {
    steps: AxisMap<i64>,
    ticks: u64,
    events: Vec<String>,
}

/// Compares two jobs for one machine; each begins where its setup says. Both are opened several times and
/// have to give the same each time.
///
/// # Errors
/// When a stream breaks off.
pub fn compare<A, B, EA, EB>(
    setups: [&Setup; 2],
    first: impl Fn() -> Result<A, EA>,
    second: impl Fn() -> Result<B, EB>,
) -> Result<Comparison, VerifyError>
where
    A: Iterator<Item = Result<Command, EA>>,
    B: Iterator<Item = Result<Command, EB>>,
    EA: Into<Cause>,
    EB: Into<Cause>,
{
    let side = |setup: &Setup| Side { steps: setup.start_steps, ticks: 0, events: Vec::new() };
    let mut sides = setups.map(side);
    let mut a = first().map_err(cause)?;
    let mut b = second().map_err(cause)?;
    let mut parted = None;
    loop {
        let next = [a.next().transpose().map_err(cause)?, b.next().transpose().map_err(cause)?];
        if next.iter().all(Option::is_none) {
            break;
        }
        if parted.is_none() && !do_the_same(&next) {
            parted = Some(FirstDifference {
                tick: sides[0].ticks,
                lines: next.each_ref().map(|command| command.as_ref().map(line)),
                what: next.each_ref().map(|command| shown(command.as_ref(), setups[0].machine)),
            });
        }
        for (side, command) in sides.iter_mut().zip(next) {
            side.take(command);
        }
    }
    let is_elsewhere = setups[0].start_steps != setups[1].start_steps;
    let apart = match parted.is_some() || is_elsewhere {
        true => distance(setups, &first, &second)?,
        false => Apart { high_mm: Some(0.0), ..Apart::default() },
    };
    let max_mm = apart.high_mm.unwrap_or(apart.low_mm);
    let [a, b] = &sides;
    let end = |axis: Axis| (axis, b.steps[axis].saturating_sub(a.steps[axis]));
    let seconds = |i: usize| six_digits(sides[i].ticks as f64 * setups[i].tick_s());
    Ok(Comparison {
        schema: 1,
        same: parted.is_none() && !is_elsewhere && setups[0].tick_us == setups[1].tick_us,
        first_difference: parted,
        max_distance_mm: six_digits(max_mm),
        max_distance_resolution_mm: six_digits(max_mm - apart.low_mm.min(max_mm)),
        max_distance_is_lower_bound: apart.high_mm.is_none(),
        worst: apart.at.map(Place::from),
        end_difference_steps: setups[0].machine.axes.iter().map(|p| end(p.axis)).collect(),
        ticks: [a.ticks, b.ticks],
        seconds: [seconds(0), seconds(1)],
        same_events: a.events == b.events,
    })
}

fn cause<E: Into<Cause>>(error: E) -> VerifyError {
    VerifyError::Commands(error.into())
}

fn do_the_same([a, b]: &[Option<Command>; 2]) -> bool {
    match (a, b) {
        (Some(Command::Tick(a)), Some(Command::Tick(b))) => a.counts == b.counts,
        (Some(Command::Event(a)), Some(Command::Event(b))) => a.kind == b.kind,
        _ => false,
    }
}

fn line(command: &Command) -> u32 {
    match command {
        Command::Tick(tick) => tick.line,
        Command::Event(event) => event.line,
    }
}

fn shown(command: Option<&Command>, machine: &Machine) -> String {
    match command {
        None => "has ended".to_owned(),
        Some(Command::Event(event)) => event.kind.to_string(),
        Some(Command::Tick(tick)) => {
            let count = |axis: Axis| format!("{axis}{:+}", tick.counts[axis]);
            let axes = machine.axes.iter().map(|profile| profile.axis);
            axes.map(count).collect::<Vec<_>>().join(" ")
        }
    }
}

impl Side {
    fn take(&mut self, command: Option<Command>) {
        match command {
            Some(Command::Tick(tick)) => {
                for (steps, count) in self.steps.0.iter_mut().zip(tick.counts.0) {
                    *steps = steps.saturating_add(i64::from(count));
                }
                self.ticks += 1;
            }
            Some(Command::Event(event)) => self.events.push(event.kind.to_string()),
            None => {}
        }
    }
}

fn distance<A, B, EA, EB>(
    [one, other]: [&Setup; 2],
    first: impl Fn() -> Result<A, EA>,
    second: impl Fn() -> Result<B, EB>,
) -> Result<Apart, VerifyError>
where
    A: Iterator<Item = Result<Command, EA>>,
    B: Iterator<Item = Result<Command, EB>>,
    EA: Into<Cause>,
    EB: Into<Cause>,
{
    apart(
        tolerance_mm(one.machine),
        || Ok(vertices(one, first().map_err(cause)?)),
        || Ok(vertices(other, second().map_err(cause)?)),
    )
}

/// Where ticks that move X, Y or Z end, behind where they start.
fn vertices<E: Into<Cause>>(
    setup: &Setup,
    commands: impl Iterator<Item = Result<Command, E>>,
) -> impl Iterator<Item = Result<Vertex, VerifyError>> {
    let mut executed = Executed::new(setup);
    let start = Vertex { at: executed.at(), tick: 0, line: 0 };
    let moves = commands.filter_map(move |command| match command {
        Err(error) => Some(Err(cause(error))),
        Ok(Command::Event(_)) => None,
        Ok(Command::Tick(tick)) => {
            let point = executed.tick(&tick);
            let vertex = Vertex { at: point.at, tick: point.tick, line: tick.line };
            point.moved.then_some(Ok(vertex))
        }
    });
    std::iter::once(Ok(start)).chain(moves)
}
