//! What each seam costs, in its parts, and what the job would cost with none at its place.
//!
//! The next best choice is exact: with f the least cost of the way from the start of a section to
//! a place, b that of the way from a place to its end, and w the cost of a buffer,
//!
//! ```text
//! next best without p = min f(i) + w(i, j) + b(j)   over all places i before p and j behind it
//! ```
//!
//! so every other seam may lie elsewhere, too. A section ends where a buffer has to end anyway (a
//! person acts there), since no choice reaches beyond. Memory is that of a section's places, some
//! 10 MB an hour; only this report asks for it.

use crate::base::machine::BufferTime;
use crate::base::{AxisSet, Machine};
use crate::path::PathItem;

use super::cost::{Cost, INSIDE_PENALTY_S};
use super::decisions::Decisions;
use super::places::{Place, Places};
use super::{Feed, SeamKind, Seams};

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
    /// the program was known.
    pub above_least_s: f64,
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
    let mut places = Places::new(machine, feed);
    let mut survey = Survey::new(machine, f64::from(ticks_max), seams);
    for decided in Decisions::new(path, machine, feed, Seams::NONE) {
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
    /// Seams passed.
    next_seam: usize,
    /// Places of the section under way.
    places: Vec<Place>,
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
            found: SeamReport::default(),
        }
    }

    /// Takes the next place.
    pub fn push(&mut self, place: Place) {
        let is_forced = place.is_forced;
        self.places.push(place);
        if is_forced {
            self.section();
        }
    }

    /// No place follows; the end of the job is no seam.
    pub fn finish(mut self) -> SeamReport {
        if self.places.len() > 1 {
            self.section();
        }
        self.found.seams.pop();
        self.found
    }

    /// The places of a section are complete: its last is the first of the next.
    fn section(&mut self) {
        let chosen = self.chosen();
        let pairs = chosen.iter().zip(&chosen[1..]);
        let buffers: Vec<BufferTime> = pairs.map(|(from, to)| self.buffer(*from, *to)).collect();
        if let (Some(before), Some(first)) = (self.found.seams.last_mut(), buffers.first()) {
            before.fill_s = first.fill_s;
        }
        let ends = || chosen.iter().skip(1).copied();
        let total_s = buffers.iter().map(|time| time.total_s()).sum::<f64>()
            + ends().map(|n| self.cost.place_s(&self.places[n])).sum::<f64>();
        let ways = Ways::new(&self.places, &self.cost);
        let last = self.places.len() - 1;
        self.found.above_least_s += total_s - ways.to_s[last];
        for (k, n) in ends().enumerate() {
            let least_s = if n < last { ways.least_s_without(n) } else { f64::INFINITY };
            let place = &self.places[n];
            let is_inside = place.is_inside && place.kind == SeamKind::Cut;
            let inside_s = if is_inside { INSIDE_PENALTY_S } else { 0.0 };
            self.found.seams.push(SeamCost {
                line: place.line,
                kind: place.kind,
                is_inside,
                pads_s: buffers[k].pads_s,
                fill_s: buffers.get(k + 1).map_or(0.0, |time| time.fill_s),
                ramps_s: self.cost.ramps_s(place),
                penalty_s: self.cost.penalty_s(place) - inside_s,
                next_best: NextBest::new(least_s - total_s),
            });
        }
        self.places.drain(..last);
    }

    /// The places of the section at which buffers end, its first and last among them.
    fn chosen(&mut self) -> Vec<usize> {
        let last = self.places.len() - 1;
        let mut chosen = vec![0];
        for (n, place) in self.places.iter().enumerate().take(last).skip(1) {
            if self.seams.at(self.next_seam, place.segment, place.share).is_some() {
                self.next_seam += 1;
                chosen.push(n);
            }
        }
        chosen.push(last);
        chosen
    }

    /// What a buffer between two places takes beside its ticks.
    fn buffer(&self, from: usize, to: usize) -> BufferTime {
        let moving = self.places[from + 1..=to].iter().map(|place| place.moving);
        let moving = moving.fold(AxisSet::EMPTY, AxisSet::union);
        self.cost.buffer(&self.places[from], &self.places[to], moving).unwrap_or_default()
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

/// The least costs to and from all places of a section.
struct Ways<'p> {
    places: &'p [Place],
    cost: &'p Cost,
    to_s: Vec<f64>,
    from_s: Vec<f64>,
}

impl<'p> Ways<'p> {
    fn new(places: &'p [Place], cost: &'p Cost) -> Ways<'p> {
        let infinite = vec![f64::INFINITY; places.len()];
        let mut ways = Ways { places, cost, to_s: infinite.clone(), from_s: infinite };
        let last = places.len() - 1;
        (ways.to_s[0], ways.from_s[last]) = (0.0, 0.0);
        for from in 0..last {
            for (to, buffer_s) in buffers(places, cost, from) {
                ways.to_s[to] = ways.to_s[to].min(ways.to_s[from] + buffer_s);
            }
        }
        for from in (0..last).rev() {
            for (to, buffer_s) in buffers(places, cost, from) {
                ways.from_s[from] = ways.from_s[from].min(buffer_s + ways.from_s[to]);
            }
        }
        ways
    }

    /// The least cost of the section with no seam at a place.
    fn least_s_without(&self, place: usize) -> f64 {
        let reaches =
            |from: &usize| self.cost.reaches(&self.places[*from], &self.places[place + 1]);
        let mut least_s = f64::INFINITY;
        for from in (0..place).rev().take_while(reaches) {
            let over = buffers(self.places, self.cost, from).filter(|(to, _)| *to > place);
            for (to, buffer_s) in over {
                least_s = least_s.min(self.to_s[from] + buffer_s + self.from_s[to]);
            }
        }
        least_s
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
