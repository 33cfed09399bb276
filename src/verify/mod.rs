//! Tick against Segment: whether the steps that a machine will make are the path that its program
//! means. Independent of how the steps were made: nothing here is shared with planning or
//! interpolation, so that a mistake there cannot excuse itself.
//!
//! - *Contour*: the Fréchet distance between the executed polyline (tick points joined by chords)
//!   and the path, in X, Y and Z. Matching runs forward along both, so neither a skipped loop nor
//!   a cut corner nor a retraced stretch hides behind a near point elsewhere (`sweep`); block by block,
//!   if that is asked for (`blocks`). Blocks with
//!   corners under G64 P may be left by P, if that is more than the path tolerance.
//! - *Other axes*, rotary and secondary: held to half a step each, tick by tick (`others`).
//! - *End point* and the place of every event, exact in steps on every axis (`events`).
//! - *Machine*: counts, travel, ticks of a buffer (`limits`), accelerations, jerk, rest at seams,
//!   events and both ends (`ramps`).
//! - *Feed*: mean speed along the path against F (`feed`).
//!
//! Two jobs are compared the same way, as the polylines that both execute (`compare`, `apart`).
//!
//! Commands and path are streams. A sound job is read once as a rule; where its contour error
//! takes more to be told, or a job is out of tolerance, several times. Memory is that of the path
//! within the tolerance. What is not done: jerk is reported and not judged.

mod apart;
mod blocks;
mod checks;
mod compare;
mod contour;
mod edges;
mod events;
mod executed;
mod feed;
mod limits;
mod matching;
mod others;
mod ramps;
mod report;
mod sweep;

use std::collections::BTreeMap;

pub use self::blocks::TellBlock;
pub use self::checks::CHECKS;
pub use self::compare::{Comparison, FirstDifference, compare};
pub use self::report::{BlockError, Check, Place, Report, Verdict, WorstBlock};

use self::contour::{Contour, Streams};
use self::feed::FeedWindow;
use self::limits::Walk;
use self::matching::BlendError;
use crate::base::rounding::six_digits;
use crate::base::{Axis, AxisMap, Command, Machine};
use crate::path::PathItem;

/// Axes that are no part of the contour.
const OTHER_AXES: [Axis; 6] = [Axis::A, Axis::B, Axis::C, Axis::U, Axis::V, Axis::W];

/// A value for each of them.
type Others = [f64; OTHER_AXES.len()];

/// Why a stream of commands or of path broke off.
pub type Cause = Box<dyn std::error::Error + Send + Sync>;

/// What verification has to know besides commands and path.
#[derive(Clone, Copy, Debug)]
pub struct Setup<'a> {
    /// The machine that the commands are for.
    pub machine: &'a Machine,
    /// Time of one tick: the profile's, unless the commands were made for another.
    pub tick_us: u32,
    /// Where the machine stands before the first command.
    pub start_steps: AxisMap<i64>,
    /// The job was made without ramps: accelerations and rests are reported, not judged.
    pub constant_feed: bool,
    /// The commands hold the program's events, so these are compared too.
    pub with_events: bool,
    /// The commands say which node buffer each tick lies in, so the length of these is judged.
    pub with_buffers: bool,
}

impl Setup<'_> {
    fn tick_s(&self) -> f64 {
        f64::from(self.tick_us) * 1e-6
    }
}

/// Commands or path that cannot be verified at all.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    /// The commands broke off; for a dump that is where a broken seal is found.
    #[error(transparent)]
    Commands(Cause),
    /// The path broke off.
    #[error("the path of the program cannot be followed")]
    Path(#[source] Cause),
    /// The program draws hundreds of thousands of pieces within its tolerance.
    #[error("at tick {tick} the path has more pieces within its tolerance than can be matched")]
    TooDense {
        /// The tick, from 0.
        tick: u64,
    },
}

/// Holds commands against a path and a machine. Both are opened several times and have to give
/// the same each time.
///
/// # Errors
/// When a stream breaks off. A job that is out of tolerance is no error but a [`Report`].
pub fn verify<C, P, CE, PE>(
    setup: &Setup,
    commands: impl Fn() -> Result<C, CE>,
    path: impl Fn() -> Result<P, PE>,
) -> Result<Report, VerifyError>
where
    C: Iterator<Item = Result<Command, CE>>,
    P: Iterator<Item = Result<PathItem, PE>>,
    CE: Into<Cause>,
    PE: Into<Cause>,
{
    verify_blocks(setup, commands, path, None)
}

/// As [`verify`], and tells of each block how far it is off, in the order of the path. That is done by one
/// more pass, at the end; of a job that is further off than can be found out nothing is told.
///
/// # Errors
/// Those of [`verify`].
pub fn verify_blocks<C, P, CE, PE>(
    setup: &Setup,
    commands: impl Fn() -> Result<C, CE>,
    path: impl Fn() -> Result<P, PE>,
    tell: Option<TellBlock>,
) -> Result<Report, VerifyError>
where
    C: Iterator<Item = Result<Command, CE>>,
    P: Iterator<Item = Result<PathItem, PE>>,
    CE: Into<Cause>,
    PE: Into<Cause>,
{
    let streams = Streams { setup, commands, path };
    let bound_mm = tolerance_mm(setup.machine);
    let (walk, contour) = streams.hold(bound_mm)?;
    if let Some(tell) = tell {
        streams.tell_blocks(&contour, tell)?;
    }
    Ok(report(setup, bound_mm, walk, contour))
}

/// How far each tick point lies from where it is matched on the path, tick by tick from 0; up to where the
/// two are further apart than a distance. Gives whether that sufficed to the end. For drawings: it takes the chords between ticks for what they are
/// at their ends, and judges nothing.
///
/// # Errors
/// When a stream breaks off.
pub fn distances<C, P, CE, PE>(
    setup: &Setup,
    within_mm: f64,
    commands: impl Fn() -> Result<C, CE>,
    path: impl Fn() -> Result<P, PE>,
    take: impl FnMut(u64, f64),
) -> Result<bool, VerifyError>
where
    C: Iterator<Item = Result<Command, CE>>,
    P: Iterator<Item = Result<PathItem, PE>>,
    CE: Into<Cause>,
    PE: Into<Cause>,
{
    Streams { setup, commands, path }.distances(within_mm, take)
}

/// The bound of the contour error: the path tolerance and half a step on each of X, Y and Z.
pub fn tolerance_mm(machine: &Machine) -> f64 {
    let axes = Axis::LINEAR.into_iter().filter_map(|axis| machine.axis(axis));
    let half_step_sq = axes.map(|axis| (0.5 / axis.steps_per_mm).powi(2)).sum::<f64>();
    machine.path_tolerance_mm + half_step_sq.sqrt()
}

fn report(setup: &Setup, bound_mm: f64, walk: Walk, contour: Contour) -> Report {
    let mut limits = vec![contour_check(bound_mm, &contour)];
    let feed = contour.matched.as_ref().and_then(|matched| matched.feed.worst);
    let blended = contour.matched.as_ref().and_then(|matched| matched.blended);
    limits.extend(blended.map(|error| blend_check(bound_mm, &error)));
    limits.extend(feed.map(|window| feed_check(&window, "mm/s")));
    limits.extend(contour.matched.iter().flat_map(|matched| matched.others.iter().cloned()));
    limits.extend(walk.checks);
    for check in &mut limits {
        check.at = check.at.filter(|at| !at.is_nowhere(walk.ticks));
    }
    let failed = limits.iter().filter(|check| check.verdict == Verdict::Fail);
    let failures: Vec<String> = failed.map(Check::to_string).collect();
    let shown = |axis: &Axis| {
        Axis::LINEAR.contains(axis)
            || walk.counts_max[*axis] > 0
            || walk.end_steps[*axis] != walk.path_end_steps[*axis]
    };
    let axes = || setup.machine.axes.iter().map(|profile| profile.axis).filter(shown);
    let end_error = |axis: Axis| walk.end_steps[axis].saturating_sub(walk.path_end_steps[axis]);
    let matched = contour.matched.as_ref();
    let worst = contour.worst.or_else(|| {
        let block = matched?.worst_blocks.first()?;
        Some(Place { tick: block.tick, line: block.line })
    });
    Report {
        schema: 1,
        verdict: if failures.is_empty() { Verdict::Pass } else { Verdict::Fail },
        tolerance_mm: six_digits(bound_mm),
        max_contour_error_mm: six_digits(contour.max_mm),
        max_contour_error_is_lower_bound: contour.more,
        rms_contour_error_mm: matched.map(|matched| six_digits(matched.rms_mm)),
        worst: worst.filter(|at| !at.is_nowhere(walk.ticks)),
        worst_blocks: matched.map(|matched| matched.worst_blocks.clone()).unwrap_or_default(),
        end_error_steps: axes().map(|axis| (axis, end_error(axis))).collect(),
        ticks: walk.ticks,
        seconds: six_digits(walk.ticks as f64 * setup.tick_s()),
        max_steps_per_tick: axes()
            .map(|axis| (axis, walk.counts_max[axis]))
            .collect::<BTreeMap<_, _>>(),
        max_feed_error_percent: matched.map(|matched| six_digits(matched.feed.max_percent)),
        feed_reached_percent: matched
            .and_then(|matched| matched.feed.reached_percent)
            .map(six_digits),
        limits,
        failures,
    }
}

fn contour_check(bound_mm: f64, contour: &Contour) -> Check {
    let mut check = Check::new("contour", None, contour.max_mm, bound_mm);
    check.verdict = if contour.within { Verdict::Pass } else { Verdict::Fail };
    (check.unit, check.at) = ("mm", contour.worst);
    check.note = contour.more.then(|| "the error is greater than this".to_owned());
    check
}

/// Tick points alone are judged once more: the contour, with chords and corners, has been.
fn blend_check(bound_mm: f64, error: &BlendError) -> Check {
    let limit_mm = bound_mm + error.slack_mm;
    let check = Check::new("corners under G64 P", None, error.distance_mm, limit_mm);
    Check { unit: "mm", at: Some(error.at), ..check }
}

fn feed_check(window: &FeedWindow, unit: &'static str) -> Check {
    let check = Check::new("feed", None, window.speed_mm_s, window.allowed_mm_s);
    Check { unit, at: Some(window.at), ..check }
}
