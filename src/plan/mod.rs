//! 4 Segment → Profile: when the machine is where on the path.
//!
//! Every piece of the path gets its speed over time, on one continuous time axis; a tick does not
//! begin anew at each block. The passes, each in its file:
//!
//! 1. [`limits`]: how fast axes, bus and tick let the segment go;
//! 2. [`ramp`]: from rest to rest within them, or at constant feed;
//! 3. buffers, here: where node buffers end. No buffer ends while an axis moves; a segment longer
//!    than a buffer is run in equal parts, each from rest to rest;
//! 4. [`corner`]: a corner that a tick's chord would cut too far is put on a tick boundary.
//!
//! This stage knows no steps: it never rounds a position.

mod clock;
mod corner;
pub mod limits;
pub mod ramp;

pub use clock::Moment;

use corner::CornerGuard;
use limits::{Bound, Limits};
use ramp::Ramp;

use crate::base::{Event, Machine, Point};
use crate::path::{PathItem, Segment};

/// How speed is planned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Feed {
    /// At rest at the end of every block, ramps between.
    #[default]
    ExactStop,
    /// The feed throughout, without ramps (seed 004, section 6.5.2): for comparison, and for
    /// drivers that ramp by themselves.
    Constant,
}

/// An item of the plan.
#[derive(Clone, Debug, PartialEq)]
pub enum Planned {
    /// Motion along a piece of the path.
    Profile(Box<Profile>),
    /// Something that happens at rest, on a tick boundary.
    Event(Event),
}

/// Motion along a piece of a segment.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// The segment.
    pub segment: Segment,
    /// Where on the segment the piece starts, as a share of its way.
    pub share_from: f64,
    /// Where on the segment the piece ends.
    pub share_to: f64,
    /// Distance along the piece over time.
    pub ramp: Ramp,
    /// When the piece starts.
    pub start: Moment,
    /// When the piece ends.
    pub end: Moment,
    /// Node buffer that its ticks lie in.
    pub buffer: u32,
    /// What set the speed.
    pub bound: Bound,
}

impl Profile {
    /// Share of the piece done at a tick boundary between its start and end; 1 exactly at its end.
    pub fn share_at(&self, boundary: u64, tick_s: f64) -> f64 {
        if boundary == self.end.tick && self.end.share == 0.0 {
            return 1.0;
        }
        let time_s = self.start.ticks_until(boundary) * tick_s;
        self.ramp.distance_mm(time_s) / self.ramp.length_mm()
    }

    /// Position at a tick boundary between the piece's start and end.
    pub fn position_at(&self, boundary: u64, tick_s: f64) -> Point {
        let share = self.share_at(boundary, tick_s);
        if share >= 1.0 {
            return self.end_mm();
        }
        self.segment.point_at(self.share_from + (self.share_to - self.share_from) * share)
    }

    /// Position at the piece's start.
    pub fn start_mm(&self) -> Point {
        self.segment.point_at(self.share_from)
    }

    /// Position at the piece's end.
    pub fn end_mm(&self) -> Point {
        self.segment.point_at(self.share_to)
    }
}

/// Plans a path, item by item; errors of the source pass through.
pub fn plan<'m, E, I>(path: I, machine: &'m Machine, feed: Feed, start_mm: Point) -> Planner<'m, I>
where
    I: Iterator<Item = Result<PathItem, E>>,
{
    Planner {
        path,
        machine,
        feed,
        tick_s: machine.bus.tick_s(),
        motion_ticks_max: machine.bus.motion_ticks_max().map(u64::from),
        now: Moment::default(),
        buffer: 0,
        buffer_start: 0,
        guard: CornerGuard::new(machine, start_mm),
        parts: None,
    }
}

/// See [`plan`].
#[derive(Debug)]
pub struct Planner<'m, I> {
    path: I,
    machine: &'m Machine,
    feed: Feed,
    tick_s: f64,
    motion_ticks_max: Option<u64>,
    now: Moment,
    buffer: u32,
    /// Tick at which the buffer's first entry is executed.
    buffer_start: u64,
    guard: CornerGuard,
    parts: Option<Parts>,
}

/// A segment under way, run in equal parts.
#[derive(Debug)]
struct Parts {
    segment: Segment,
    limits: Limits,
    ramp: Ramp,
    count: u64,
    done: u64,
}

impl<E, I: Iterator<Item = Result<PathItem, E>>> Iterator for Planner<'_, I> {
    type Item = Result<Planned, E>;

    fn next(&mut self) -> Option<Self::Item> {
        if let Some(parts) = self.parts.take() {
            return Some(Ok(self.next_part(parts)));
        }
        Some(self.path.next()?.map(|item| match item {
            PathItem::Event(event) => self.event(event),
            PathItem::Segment(segment) => {
                let parts = self.parts_of(segment);
                self.next_part(parts)
            }
        }))
    }
}

impl<I> Planner<'_, I> {
    /// An event happens on a tick boundary. One that waits for a person ends the buffer, so that
    /// the nodes are idle while hands are in the machine.
    fn event(&mut self, event: Event) -> Planned {
        self.wait_for_boundary();
        if event.kind.waits_for_person() {
            self.start_buffer();
        }
        Planned::Event(event)
    }

    /// The least number of equal parts of a segment that each fit into a buffer: one, unless the
    /// segment takes longer than a whole buffer lasts.
    fn parts_of(&self, segment: Segment) -> Parts {
        let limits = limits::of(&segment, self.machine, self.feed == Feed::ExactStop);
        let length_mm = segment.length_mm();
        let mut count = 1;
        loop {
            let ramp = self.ramp(length_mm / count as f64, &limits);
            let ticks = ramp.duration_s() / self.tick_s;
            match self.motion_ticks_max {
                Some(max) if ticks > max as f64 => {
                    count = (count + 1).max((count as f64 * ticks / max as f64) as u64);
                }
                _ => return Parts { segment, limits, ramp, count, done: 0 },
            }
        }
    }

    fn ramp(&self, length_mm: f64, limits: &Limits) -> Ramp {
        match self.feed {
            Feed::ExactStop => Ramp::rest_to_rest(length_mm, limits.speed_mm_s, limits.accel_mm_s2),
            Feed::Constant => Ramp::constant(length_mm, limits.speed_mm_s),
        }
    }

    fn next_part(&mut self, mut parts: Parts) -> Planned {
        let ticks = parts.ramp.duration_s() / self.tick_s;
        if !self.fits(ticks) {
            self.start_buffer();
        }
        let mut profile = self.profile(&parts, ticks);
        if !self.guard.allows(&self.first_boundary_mm(&profile)) {
            self.wait_for_boundary();
            if !self.fits(ticks) {
                self.start_buffer();
            }
            profile = self.profile(&parts, ticks);
        }
        self.advance(&profile);
        parts.done += 1;
        if parts.done < parts.count {
            self.parts = Some(parts);
        }
        Planned::Profile(Box::new(profile))
    }

    fn profile(&self, parts: &Parts, ticks: f64) -> Profile {
        let share = |done: u64| done as f64 / parts.count as f64;
        Profile {
            segment: parts.segment.clone(),
            share_from: share(parts.done),
            share_to: share(parts.done + 1),
            ramp: parts.ramp,
            start: self.now,
            end: self.now.after(ticks),
            buffer: self.buffer,
            bound: parts.limits.bound,
        }
    }

    fn fits(&self, ticks: f64) -> bool {
        let end = self.now.after(ticks).boundary();
        self.motion_ticks_max.is_none_or(|max| end - self.buffer_start <= max)
    }

    /// Where the chord of the tick under way ends: at the next boundary, or at the profile's end
    /// if that comes first.
    fn first_boundary_mm(&self, profile: &Profile) -> Point {
        let boundary = profile.start.tick + 1;
        if profile.end.tick < boundary {
            return profile.end_mm();
        }
        profile.position_at(boundary, self.tick_s)
    }

    fn advance(&mut self, profile: &Profile) {
        self.now = profile.end;
        if profile.end.tick > profile.start.tick {
            self.guard.at_boundary(profile.position_at(profile.end.tick, self.tick_s));
        }
        if profile.end.share > 0.0 {
            self.guard.pass(profile.end_mm());
        } else {
            self.guard.at_boundary(profile.end_mm());
        }
    }

    /// Lets the machine rest until the tick under way is over.
    fn wait_for_boundary(&mut self) {
        if let Some(corner_mm) = self.guard.last_corner() {
            self.guard.at_boundary(corner_mm);
        }
        self.now = Moment::at(self.now.boundary());
    }

    fn start_buffer(&mut self) {
        self.wait_for_boundary();
        let used = self.now.tick > self.buffer_start;
        if self.motion_ticks_max.is_some() && used {
            self.buffer += 1;
            self.buffer_start = self.now.tick;
        }
    }
}
