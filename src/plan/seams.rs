//! Where node buffers end: the places that cost least, over the whole program.
//!
//! A node holds so many ticks and stops to be filled again; every axis has to be at rest there.
//! Which places these are is decided in a run of its own, before the plan proper. The cost of a
//! buffer from place i to place j is
//!
//! ```text
//! fill of the nodes that move in it + pads after its last tick          (of the pair i, j)
//! + ramps that a stop at j takes + penalty, if j lies in a cut          (of j alone)
//! ```
//!
//! and the least sum over all buffers is found by dynamic programming over the places within one
//! buffer's length: exact, and linear in the program's length, since a buffer has only so many
//! places. Ties go to the later place. Memory is that of the places that are still open; what all
//! of them agree on is decided, at the latest after [`OPEN_BUFFERS_MAX`] buffers.

use std::collections::VecDeque;
use std::ops::Range;

use crate::base::{AxisSet, Machine, Point};
use crate::path::PathItem;

use super::cost::Cost;
use super::decisions::Decisions;
use super::groups::{GROUP, Groups};
use super::places::{Place, Places, UNSURE_TICKS};
use super::{Feed, Planned, plan};

/// Buffers that may stay open before the cheapest way so far is taken.
const OPEN_BUFFERS_MAX: usize = 64;

/// Costs that differ by less are the same, but for rounding.
const TIE_S: f64 = 1e-7;

/// The places where node buffers end, in the order of the path.
#[derive(Clone, Debug, PartialEq)]
pub struct Seams {
    all: Vec<Seam>,
    /// By so much each ramp of a stop was taken to be longer than reckoned.
    unsure_ticks: f64,
}

/// The end of one node buffer and the start of the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seam {
    /// Number of the segment that it lies in or ends with, from 0.
    pub segment: u64,
    /// Where on the segment, as a share of its way.
    pub share: f64,
    /// What it interrupts.
    pub kind: SeamKind,
}

/// What a seam interrupts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SeamKind {
    /// Nothing: motion rests there anyway.
    Rest,
    /// A rapid.
    Rapid,
    /// A cut: it may leave a mark.
    Cut,
}

impl SeamKind {
    /// `rest`, `rapid` or `cut`.
    pub fn name(self) -> &'static str {
        match self {
            SeamKind::Rest => "rest",
            SeamKind::Rapid => "rapid",
            SeamKind::Cut => "cut",
        }
    }
}

impl Seams {
    /// No seam: for machines without node buffers, and jobs that fit into one.
    pub const NONE: &'static Seams = &Seams { all: Vec::new(), unsure_ticks: UNSURE_TICKS };

    /// What the nth seam interrupts, if it lies at this place.
    pub fn at(&self, n: usize, segment: u64, share: f64) -> Option<SeamKind> {
        let seam = self.on(n, segment).filter(|seam| seam.share == share);
        seam.map(|seam| seam.kind)
    }

    /// The nth seam, if it lies on this segment.
    #[inline]
    pub(super) fn on(&self, n: usize, segment: u64) -> Option<&Seam> {
        self.all.get(n).filter(|seam| seam.segment == segment)
    }

    /// All of them.
    pub fn iter(&self) -> impl Iterator<Item = &Seam> {
        self.all.iter()
    }

    /// By so much each ramp of a stop was taken to be longer than reckoned when they were chosen.
    pub(super) fn unsure_ticks(&self) -> f64 {
        self.unsure_ticks
    }
}

impl Default for Seams {
    fn default() -> Seams {
        Seams::NONE.clone()
    }
}

/// Seams in the order of the path, each on a line, at the end of a segment, or of a piece that long arcs and
/// splines are cut into; others are passed over.
impl FromIterator<Seam> for Seams {
    fn from_iter<I: IntoIterator<Item = Seam>>(seams: I) -> Seams {
        Seams { all: seams.into_iter().collect(), ..Seams::default() }
    }
}

/// Finds the seams of a path, which is asked for as often as it takes. On a machine without node buffers there
/// are none.
///
/// The plan is made with those that were chosen. Where a stop takes so much longer in it than was reckoned that a
/// buffer is too long, all are chosen anew with more room left, as long as there is a choice. There is none where
/// the ramps of stops alone fill a buffer, as they are reckoned, each against the plan without it.
///
/// # Errors
/// Those of the path.
pub fn place<E, I>(path: impl Fn() -> I, machine: &Machine, feed: Feed) -> Result<Seams, E>
where
    I: Iterator<Item = Result<PathItem, E>>,
{
    let (mut seams, mut unsure_ticks) = (Seams::default(), UNSURE_TICKS);
    let Some(ticks_max) = machine.bus.motion_ticks_max() else { return Ok(seams) };
    let ticks_max = f64::from(ticks_max);
    loop {
        let choice = choose(path(), machine, feed, ticks_max, unsure_ticks)?;
        let is_possible = choice.is_possible();
        if !is_possible && unsure_ticks > UNSURE_TICKS {
            return Ok(seams);
        }
        seams = Seams { all: choice.finish(), unsure_ticks };
        // Without ramps no stop takes longer than reckoned.
        if !is_possible || feed == Feed::Constant {
            return Ok(seams);
        }
        // Where a job starts is asked for only without ramps.
        let over_ticks = most_ticks(plan(path(), machine, feed, &seams, Point::ZERO))? - ticks_max;
        if over_ticks <= 0.0 || unsure_ticks > ticks_max {
            return Ok(seams);
        }
        unsure_ticks = 2.0 * unsure_ticks + over_ticks;
    }
}

/// The ticks of a plan's longest buffer.
fn most_ticks<E>(plan: impl Iterator<Item = Result<Planned, E>>) -> Result<f64, E> {
    let (mut buffer, mut start_tick, mut most) = (0, 0, 0);
    for planned in plan {
        let Planned::Profile(profile) = planned? else { continue };
        if profile.buffer != buffer {
            (buffer, start_tick) = (profile.buffer, profile.start.tick);
        }
        most = most.max(profile.end.boundary() - start_tick);
    }
    Ok(most as f64)
}

/// Chooses among the places of a path, with so many ticks in which each ramp of a stop may be longer than reckoned.
fn choose<E>(
    path: impl Iterator<Item = Result<PathItem, E>>,
    machine: &Machine,
    feed: Feed,
    ticks_max: f64,
    unsure_ticks: f64,
) -> Result<Choice, E> {
    let mut places = Places::new(machine, feed, unsure_ticks);
    let mut choice = Choice::new(machine, ticks_max);
    for decided in Decisions::new(path, machine, feed, None) {
        places.push(decided?);
        while let Some(place) = places.pop() {
            choice.push(place);
        }
    }
    places.finish();
    while let Some(place) = places.pop() {
        choice.push(place);
    }
    Ok(choice)
}

/// Chooses among places.
#[derive(Debug)]
struct Choice {
    cost: Cost,
    /// Places from the last decided one on.
    open: VecDeque<Open>,
    /// Number of the first open place.
    first: usize,
    /// The last place at which a buffer has to end, by its number.
    forced: usize,
    groups: Groups,
    seams: Vec<Seam>,
    /// Scratch: the groups that a buffer may begin in, each with the least that it may cost and the axes
    /// that move behind it.
    bounds: Vec<(f64, usize, AxisSet)>,
}

/// A place with the cheapest way to it.
#[derive(Debug)]
struct Open {
    place: Place,
    cost_s: f64,
    /// Buffers up to it.
    buffers: usize,
    /// Number of the place where the buffer before it began.
    from: usize,
}

impl Choice {
    fn new(machine: &Machine, ticks_max: f64) -> Choice {
        let start = Open { place: Place::start(), cost_s: 0.0, buffers: 0, from: 0 };
        let cost = Cost::new(machine, ticks_max);
        let mut groups = Groups::default();
        groups.add(0, &start.place, cost.start_s(start.cost_s, &start.place));
        Choice {
            cost,
            groups,
            open: VecDeque::from([start]),
            first: 0,
            forced: 0,
            seams: Vec::new(),
            bounds: Vec::new(),
        }
    }

    /// Takes the next place: the cheapest buffer that ends there.
    fn push(&mut self, place: Place) {
        let number = self.first + self.open.len();
        let place_s = self.cost.place_s(&place);
        let earliest = self.forced.max(self.first);
        // Where a place cannot be reached with one buffer it is no place.
        let best = self.cheapest_start(&place, earliest);
        let (start_s, from) = best.unwrap_or((f64::INFINITY, earliest));
        let buffers = self.open[from - self.first].buffers + 1;
        if place.is_forced {
            self.forced = number;
        }
        let cost_s = start_s + place_s;
        self.groups.add(number, &place, self.cost.start_s(cost_s, &place));
        self.open.push_back(Open { place, cost_s, buffers, from });
        if self.open.len().is_multiple_of(1024) {
            self.decide();
        }
    }

    /// Where the cheapest buffer to a place begins, of those from a number on, with the cost up to the
    /// buffer's end; the latest of equal ones. Groups of places are looked at in the order of the
    /// least that they may cost, until no other can be better.
    fn cheapest_start(&mut self, place: &Place, earliest: usize) -> Option<(f64, usize)> {
        let number = self.first + self.open.len();
        let mut bounds = std::mem::take(&mut self.bounds);
        let (mut moving, mut fill_s) = (place.moving, self.cost.fill_s(place.moving));
        let end_s = self.cost.end_s(place);
        for group in (earliest / GROUP..=(number - 1) / GROUP).rev() {
            let last = ((group + 1) * GROUP).min(number) - 1;
            if !self.cost.reaches(&self.open[last - self.first].place, place) {
                break;
            }
            let first = (group * GROUP).max(earliest);
            let shift_s = self.cost.shift_s(&self.open[first - self.first].place, place);
            let bound_s = self.groups.least_s(group) + end_s + fill_s - shift_s;
            bounds.push((bound_s, group, moving));
            let all = moving.union(self.groups.moving(group));
            if all != moving {
                (moving, fill_s) = (all, self.cost.fill_s(all));
            }
        }
        let mut best: Option<(f64, usize)> = None;
        while let Some(next) = least(&bounds) {
            let (bound_s, group, moving) = bounds.swap_remove(next);
            if best.is_some_and(|(least_s, _)| bound_s > least_s + TIE_S) {
                break;
            }
            let range = (group * GROUP).max(earliest)..((group + 1) * GROUP).min(number);
            best = self.cheaper(best, range, place, moving);
        }
        bounds.clear();
        self.bounds = bounds;
        best
    }

    /// The better of a start and the best of a range, behind which these axes move.
    fn cheaper(
        &self,
        mut best: Option<(f64, usize)>,
        range: Range<usize>,
        place: &Place,
        mut moving: AxisSet,
    ) -> Option<(f64, usize)> {
        let mut fill_s = self.cost.fill_s(moving);
        for from in range.rev() {
            let start = &self.open[from - self.first];
            if let Some(pads_s) = self.cost.pads_s(&start.place, place) {
                let cost_s = start.cost_s + fill_s + pads_s;
                let is_better = best.is_none_or(|(least_s, latest)| {
                    cost_s < least_s - TIE_S || cost_s <= least_s + TIE_S && from > latest
                });
                if is_better {
                    best = Some((cost_s, from));
                }
            }
            let all = moving.union(start.place.moving);
            if all != moving {
                (moving, fill_s) = (all, self.cost.fill_s(all));
            }
        }
        best
    }

    /// Gives out the seams that every cheapest way to the places of the last buffer shares.
    fn decide(&mut self) {
        let last = self.first + self.open.len() - 1;
        let reach = |from: usize| {
            let place = |n: usize| &self.open[n - self.first].place;
            self.cost.reaches(place(from), place(last))
        };
        let mut oldest = last;
        while oldest > self.first && reach(oldest - 1) {
            oldest -= 1;
        }
        let alive = (oldest..=last).filter(|n| self.open[n - self.first].cost_s < f64::INFINITY);
        let buffers = self.open[last - self.first].buffers - self.open[0].buffers;
        let agreed = if buffers > OPEN_BUFFERS_MAX { self.cheapest(oldest, last) } else { None };
        let agreed = agreed.unwrap_or_else(|| self.common(alive.collect()));
        self.give_out(agreed);
    }

    /// The last place that the cheapest ways to all of these places pass.
    fn common(&self, mut places: Vec<usize>) -> usize {
        places.sort_unstable();
        while places.len() > 1 {
            let Some(latest) = places.pop() else { break };
            let from = self.open[latest - self.first].from.max(self.first);
            if let Err(at) = places.binary_search(&from) {
                places.insert(at, from);
            }
        }
        places.first().copied().unwrap_or(self.first)
    }

    /// The place half way back on the cheapest way to any of the last places.
    fn cheapest(&self, oldest: usize, last: usize) -> Option<usize> {
        let cost = |n: &usize| self.open[n - self.first].cost_s;
        let mut at = (oldest..=last).min_by(|a, b| cost(a).total_cmp(&cost(b)))?;
        for _ in 0..OPEN_BUFFERS_MAX / 2 {
            at = self.open[at - self.first].from.max(self.first);
        }
        Some(at)
    }

    /// Decides the way up to a place.
    fn give_out(&mut self, place: usize) {
        let mut way = Vec::new();
        let mut at = place;
        while at > self.first {
            way.push(at);
            at = self.open[at - self.first].from;
        }
        for at in way.into_iter().rev() {
            let place = &self.open[at - self.first].place;
            if !place.is_forced {
                self.seams.push(Seam {
                    segment: place.segment,
                    share: place.share,
                    kind: place.kind,
                });
            }
        }
        self.open.drain(..place - self.first);
        self.first = place;
        self.groups.forget_before(place);
        self.forced = self.forced.max(place);
        // What is not reached by way of the place decided is not reached any more.
        for at in 1..self.open.len() {
            let from = self.open[at].from.checked_sub(self.first);
            if from.is_none_or(|from| self.open[from].cost_s == f64::INFINITY) {
                self.open[at].cost_s = f64::INFINITY;
            }
        }
    }

    /// Whether every place at which a buffer has to end can be reached.
    fn is_possible(&self) -> bool {
        self.open.back().is_some_and(|last| last.cost_s < f64::INFINITY)
    }

    fn finish(mut self) -> Vec<Seam> {
        let last = self.first + self.open.len() - 1;
        self.open[last - self.first].place.is_forced = true;
        self.give_out(last);
        self.seams
    }
}

/// Which of some groups may cost least.
fn least(bounds: &[(f64, usize, AxisSet)]) -> Option<usize> {
    let all = bounds.iter().enumerate();
    all.min_by(|(_, (a_s, ..)), (_, (b_s, ..))| a_s.total_cmp(b_s)).map(|(n, _)| n)
}

#[cfg(test)]
mod tests;
