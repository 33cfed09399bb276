//! What each seam costs, in its parts, and what the job would cost with none at its place.
//!
//! The next best choice is exact: with f the least cost of the way from the start of a section to
//! a place, b that of the way from a place to its end, and w the cost of a buffer,
//!
//! ```text
//! next best without p = min f(i) + w(i, j) + b(j)   over all places i before p and j behind it
//! ```
//!
//! so every other seam may lie elsewhere, too; but for those more than [`AHEAD_BUFFERS`] behind it, which
//! are held where they are: what a seam does to the ways behind it is gone after a few. f is that of
//! all of the program before. A section ends where a buffer has to end anyway (a person acts there),
//! since no choice reaches beyond. Memory is that of the places of twice so many buffers, and of
//! what is told of each seam.

use std::collections::VecDeque;

use crate::base::{AxisSet, Machine};
use crate::path::PathItem;

use super::cost::{Cost, INSIDE_PENALTY_S};
use super::decisions::Decisions;
use super::places::{Place, Places};
use super::{Feed, SeamKind, Seams};

/// Buffers behind a seam that another choice may change.
const AHEAD_BUFFERS: usize = 64;

/// What a seam costs, as it was placed by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeamCost {
    /// Line of the NC program that it lies in or ends, from 1.
    pub line: u32,
    /// What it interrupts.
    pub kind: SeamKind,
    /// It lies inside of a cut's block, for want of another place.
    pub is_inside: bool,
    /// Zero entries of the buffer before.
    pub pads_s: f64,
    /// Filling the nodes that move in the buffer behind it.
    pub fill_s: f64,
    /// Braking to rest, and speeding up again.
    pub ramps_s: f64,
    /// What a stop in a cut is worth to be elsewhere (`seam_in_cut_penalty_s`).
    pub penalty_s: f64,
    /// The best choice without this place; none where a buffer has to end there.
    pub next_best: Option<NextBest>,
}

/// The best choice of seams without one of the places.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NextBest {
    /// What the job costs more, all seams together; less where the choice was made before all of the
    /// program was known.
    pub more_s: f64,
    /// So many more stops inside of blocks of a cut.
    pub more_inside: i64,
}

/// What the seams of a job cost.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct SeamReport {
    /// All of them in order, those where a person acts among them.
    pub seams: Vec<SeamCost>,
    /// What the choice costs more than the best one: nothing, unless it was made before enough of
    /// the program was known. No finite number where there is no choice.
    pub above_least_s: f64,
    /// So many more stops inside of blocks of a cut it has.
    pub above_least_inside: i64,
}

impl SeamCost {
    /// All parts.
    pub fn total_s(&self) -> f64 {
        self.pads_s + self.fill_s + self.ramps_s + self.penalty_s
    }
}

/// What the seams of a path cost.
///
/// # Errors
/// Those of the path.
pub fn survey<E>(
    path: impl Iterator<Item = Result<PathItem, E>>,
    machine: &Machine,
    feed: Feed,
    seams: &Seams,
) -> Result<SeamReport, E> {
    let Some(ticks_max) = machine.bus.motion_ticks_max() else {
        return Ok(SeamReport::default());
    };
    let mut places = Places::new(machine, feed, seams.unsure_ticks());
    let mut survey = Survey::new(machine, f64::from(ticks_max), seams);
    for decided in Decisions::new(path, machine, feed, None) {
        places.push(decided?);
        while let Some(place) = places.pop() {
            survey.push(place);
        }
    }
    places.finish();
    while let Some(place) = places.pop() {
        survey.push(place);
    }
    Ok(survey.finish())
}

/// Takes places and gives out what the seams among them cost.
pub(super) struct Survey<'s> {
    cost: Cost,
    seams: &'s Seams,
    /// Seams passed, but for those where a buffer has to end.
    next_seam: usize,
    /// Places of the section under way that still matter, each with the least cost of the way to it.
    places: Vec<Place>,
    to_s: Vec<f64>,
    /// Where the buffer under way began, and what the choice costs up to there.
    start: usize,
    chosen_s: f64,
    /// Seams whose next best is not known yet: their number, and where they are among the places.
    waiting: VecDeque<(usize, usize)>,
    found: SeamReport,
}

impl<'s> Survey<'s> {
    /// Of a job on a machine whose buffers take so many ticks of motion.
    pub fn new(machine: &Machine, ticks_max: f64, seams: &'s Seams) -> Survey<'s> {
        Survey {
            cost: Cost::new(machine, ticks_max),
            seams,
            next_seam: 0,
            places: vec![Place::start()],
            to_s: vec![0.0],
            start: 0,
            chosen_s: 0.0,
            waiting: VecDeque::new(),
            found: SeamReport::default(),
        }
    }

    /// Takes the next place.
    pub fn push(&mut self, place: Place) {
        let is_forced = place.is_forced;
        let is_seam = self.seams.at(self.next_seam, place.segment, place.share).is_some();
        self.places.push(place);
        self.to_s.push(self.least_s_to_last());
        if is_forced {
            self.section();
        } else if is_seam {
            self.next_seam += 1;
            self.seam();
            if self.waiting.len() > 2 * AHEAD_BUFFERS {
                self.settle(AHEAD_BUFFERS);
            }
        }
    }

    /// No place follows; the end of the job is no seam.
    pub fn finish(mut self) -> SeamReport {
        if self.places.len() > 1 {
            self.section();
        }
        self.found.seams.pop();
        if let Some(above) = NextBest::new(self.found.above_least_s) {
            self.found.above_least_s = above.more_s;
            self.found.above_least_inside = above.more_inside;
        }
        self.found
    }

    /// The least cost of the way to the last place.
    fn least_s_to_last(&self) -> f64 {
        let last = self.places.len() - 1;
        let end = &self.places[last];
        let (mut least_s, mut moving) = (f64::INFINITY, end.moving);
        for (from, start) in self.places[..last].iter().enumerate().rev() {
            if !self.cost.reaches(start, end) {
                break;
            }
            if let Some(time) = self.cost.buffer(start, end, moving) {
                least_s = least_s.min(self.to_s[from] + time.total_s());
            }
            moving = moving.union(start.moving);
        }
        least_s + self.cost.place_s(end)
    }

    /// The places of a section are complete: its last is the first of the next.
    fn section(&mut self) {
        self.seam();
        let last = self.places.len() - 1;
        self.found.above_least_s += self.chosen_s - self.to_s[last];
        // The section has to end where it does.
        self.waiting.pop_back();
        self.settle(self.waiting.len());
        self.places.drain(..last);
        self.to_s = vec![0.0];
        (self.start, self.chosen_s) = (0, 0.0);
    }

    /// A buffer ends at the last place.
    fn seam(&mut self) {
        let at = self.places.len() - 1;
        let moving = self.places[self.start + 1..].iter().map(|place| place.moving);
        let moving = moving.fold(AxisSet::EMPTY, AxisSet::union);
        let (start, place) = (&self.places[self.start], &self.places[at]);
        let time = self.cost.buffer(start, place, moving).unwrap_or_default();
        self.chosen_s += time.total_s() + self.cost.place_s(place);
        if let Some(before) = self.found.seams.last_mut() {
            before.fill_s = time.fill_s;
        }
        let is_inside = place.is_inside && place.kind == SeamKind::Cut;
        let inside_s = if is_inside { INSIDE_PENALTY_S } else { 0.0 };
        self.found.seams.push(SeamCost {
            line: place.line,
            kind: place.kind,
            is_inside,
            pads_s: time.pads_s,
            fill_s: 0.0,
            ramps_s: self.cost.ramps_s(place),
            penalty_s: self.cost.penalty_s(place) - inside_s,
            next_best: None,
        });
        self.start = at;
        self.waiting.push_back((self.found.seams.len() - 1, at));
    }

    /// The next best of the first of the waiting seams, with the buffer that ended last ending there.
    fn settle(&mut self, count: usize) {
        let from_s = self.least_s_from();
        for (number, at) in self.waiting.drain(..count).collect::<Vec<_>>() {
            let more_s = self.least_s_without(at, &from_s) - self.chosen_s;
            self.found.seams[number].next_best = NextBest::new(more_s);
        }
        self.forget();
    }

    /// Drops places from which no buffer passes a waiting seam.
    fn forget(&mut self) {
        let Some((_, at)) = self.waiting.front() else { return };
        let seam = &self.places[*at];
        let useless = self.places.iter().take_while(|place| !self.cost.reaches(place, seam));
        let count = useless.count().min(*at);
        self.places.drain(..count);
        self.to_s.drain(..count);
        self.start -= count;
        self.waiting.iter_mut().for_each(|(_, at)| *at -= count);
    }

    /// The least costs from all places to the last.
    fn least_s_from(&self) -> Vec<f64> {
        let last = self.places.len() - 1;
        let mut from_s = vec![f64::INFINITY; last + 1];
        from_s[last] = 0.0;
        for from in (0..last).rev() {
            let ways = buffers(&self.places, &self.cost, from).map(|(to, s)| s + from_s[to]);
            from_s[from] = ways.fold(f64::INFINITY, f64::min);
        }
        from_s
    }

    /// The least cost up to the last place with no seam at another.
    fn least_s_without(&self, place: usize, from_s: &[f64]) -> f64 {
        let reaches =
            |from: &usize| self.cost.reaches(&self.places[*from], &self.places[place + 1]);
        let mut least_s = f64::INFINITY;
        for from in (0..place).rev().take_while(reaches) {
            let over = buffers(&self.places, &self.cost, from).filter(|(to, _)| *to > place);
            for (to, buffer_s) in over {
                least_s = least_s.min(self.to_s[from] + buffer_s + from_s[to]);
            }
        }
        least_s
    }
}

impl NextBest {
    /// By how much the least cost without a place is above that of the choice.
    fn new(more_s: f64) -> Option<NextBest> {
        let inside = (more_s / INSIDE_PENALTY_S).round();
        more_s.is_finite().then_some(NextBest {
            more_s: more_s - inside * INSIDE_PENALTY_S,
            more_inside: inside as i64,
        })
    }
}

/// Every buffer that begins at a place: the place where it ends, and what it costs with a stop
/// there.
fn buffers<'p>(
    places: &'p [Place],
    cost: &'p Cost,
    from: usize,
) -> impl Iterator<Item = (usize, f64)> + 'p {
    let start = &places[from];
    let mut moving = AxisSet::EMPTY;
    let ends = places.iter().enumerate().skip(from + 1);
    ends.take_while(move |(_, end)| cost.reaches(start, end)).filter_map(move |(to, end)| {
        moving = moving.union(end.moving);
        let time = cost.buffer(start, end, moving)?;
        Some((to, time.total_s() + cost.place_s(end)))
    })
}
