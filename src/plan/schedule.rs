//! Pieces with speeds → profiles: on the time axis, in node buffers, and with corners at rest on
//! tick boundaries where a tick's chord would cut them too far.

use crate::base::{Event, Machine, Point};
use crate::path::PathItem;

use super::corner::{CORNER_SHARE, CornerGuard, Place};
use super::decisions::Decisions;
use super::extreme::lesser;
use super::limits::Limits;
use super::profile::Reused;
use super::run::{Item, Run};
use super::{Feed, Moment, Planned, Profile, SeamKind, Seams};

/// See [`super::plan`].
#[derive(Debug)]
pub struct Planner<'a, I> {
    decisions: Decisions<'a, I>,
    schedule: Schedule,
    profiles: Reused,
}

impl<'a, I> Planner<'a, I> {
    pub(super) fn new<E>(
        path: I,
        machine: &'a Machine,
        feed: Feed,
        seams: &'a Seams,
        start_mm: Point,
    ) -> Planner<'a, I>
    where
        I: Iterator<Item = Result<PathItem, E>>,
    {
        Planner {
            decisions: Decisions::new(path, machine, feed, Some(seams)),
            schedule: Schedule::new(machine, feed, start_mm),
            profiles: Reused::new(),
        }
    }
}

impl<E, I: Iterator<Item = Result<PathItem, E>>> Iterator for Planner<'_, I> {
    type Item = Result<Planned, E>;

    fn next(&mut self) -> Option<Self::Item> {
        let schedule = &mut self.schedule;
        match self.decisions.next()? {
            Ok(Item::Run(mut run)) => {
                let profile = self.profiles.give(|profile| schedule.run(profile, &mut run));
                self.decisions.reuse(run);
                Some(Ok(Planned::Profile(profile)))
            }
            Ok(Item::Event(event)) => Some(Ok(schedule.event(*event))),
            Ok(Item::Seam(kind)) => Some(Ok(schedule.seam(kind))),
            Err(error) => Some(Err(error)),
        }
    }
}

/// The time axis.
#[derive(Debug)]
struct Schedule {
    has_ramps: bool,
    tick_s: f64,
    ticks_per_s: f64,
    /// Greatest acceleration in any direction.
    accel_max_mm_s2: f64,
    has_buffers: bool,
    now: Moment,
    buffer: u32,
    /// Tick at which the buffer's first entry is executed.
    buffer_start: u64,
    /// Where motion has ramps: whether it has come to rest.
    rests: bool,
    /// There, too: the way since the last boundary. No corner since then is further from a chord than that, or
    /// than the way to the next one.
    way_mm: f64,
    /// The share of the path tolerance for such corners.
    corner_mm: f64,
    /// Where it has none.
    guard: CornerGuard,
}

impl Schedule {
    fn new(machine: &Machine, feed: Feed, start_mm: Point) -> Schedule {
        Schedule {
            has_ramps: feed != Feed::Constant,
            tick_s: machine.bus.tick_s(),
            ticks_per_s: 1.0 / machine.bus.tick_s(),
            accel_max_mm_s2: Limits::new(machine).accel_max_mm_s2,
            has_buffers: machine.bus.motion_ticks_max().is_some(),
            now: Moment::default(),
            buffer: 0,
            buffer_start: 0,
            rests: true,
            way_mm: 0.0,
            corner_mm: CORNER_SHARE * machine.path_tolerance_mm,
            guard: CornerGuard::new(machine, start_mm.xyz()),
        }
    }

    /// An event happens on a tick boundary. One that waits for a person ends the buffer, so that
    /// the nodes are idle while hands are in the machine.
    #[inline(never)]
    fn event(&mut self, event: Event) -> Planned {
        self.wait_for_boundary();
        if event.kind.waits_for_person() {
            self.start_buffer();
        }
        Planned::Event(event)
    }

    fn seam(&mut self, kind: SeamKind) -> Planned {
        self.start_buffer();
        Planned::Seam(kind)
    }

    /// Puts a run on the time axis, as a profile: now, or at the next boundary if it has to wait for that.
    fn run(&mut self, profile: &mut Profile, run: &mut Run) {
        profile.take(run);
        profile.buffer = self.buffer;
        if !self.has_ramps {
            return self.run_evenly(profile);
        }
        if self.rests && self.corner_mm < lesser(self.way_mm, self.way_left_mm()) {
            self.wait_for_boundary();
        }
        self.place(profile);
        self.rests = run.ends_mm_s[1] == 0.0;
        self.count_way(profile);
    }

    /// Puts a profile there, where motion has no ramps.
    #[inline(never)]
    fn run_evenly(&mut self, profile: &mut Profile) {
        let start = self.now;
        self.place(profile);
        if !self.guard.allows(&self.first_boundary_mm(profile)) {
            self.now = start;
            self.wait_for_boundary();
            self.place(profile);
        }
        self.pass(profile);
    }

    /// Lets a profile begin now.
    #[inline]
    fn place(&mut self, profile: &mut Profile) {
        profile.start = self.now;
        self.now = self.now.after(profile.ramp.duration_s() * self.ticks_per_s);
        profile.end = self.now;
    }

    /// The way that can be made from rest in what is left of the tick.
    fn way_left_mm(&self) -> f64 {
        let left_s = (1.0 - self.now.share) * self.tick_s;
        0.5 * self.accel_max_mm_s2 * left_s * left_s
    }

    /// Where the chord of the tick under way ends: at the next boundary, or at the profile's end
    /// if that comes first.
    fn first_boundary_mm(&self, profile: &Profile) -> Place {
        let boundary = profile.start.tick + 1;
        if profile.end.tick < boundary {
            return profile.segment.xyz_at(profile.shares[1]);
        }
        profile.xyz_at(boundary, self.tick_s)
    }

    /// Counts the way since the last boundary; where motion goes on, the most that it may be.
    #[inline]
    fn count_way(&mut self, profile: &Profile) {
        let length_mm = profile.ramp.length_mm();
        if profile.end.tick == profile.start.tick {
            self.way_mm += length_mm;
        } else if self.rests {
            self.way_mm = self.last_way_mm(profile);
        } else {
            self.way_mm = profile.ramp.peak_mm_s() * profile.end.share * self.tick_s;
        }
    }

    /// The way in the last tick of a profile at whose end the machine rests.
    #[inline(never)]
    fn last_way_mm(&self, profile: &Profile) -> f64 {
        let time_s = profile.start.ticks_until(profile.end.tick) * self.tick_s;
        profile.ramp.length_mm() - profile.ramp.distance_mm(time_s)
    }

    /// Tells the guard of corners where the path is.
    fn pass(&mut self, profile: &Profile) {
        let end_mm = profile.segment.xyz_at(profile.shares[1]);
        if profile.end.share == 0.0 {
            return self.guard.at_boundary(end_mm);
        }
        if profile.end.tick > profile.start.tick {
            self.guard.at_boundary(profile.xyz_at(profile.end.tick, self.tick_s));
        }
        self.guard.pass(end_mm);
    }

    /// Lets the machine rest until the tick under way is over.
    fn wait_for_boundary(&mut self) {
        if let Some(corner_mm) = self.guard.last_corner() {
            self.guard.at_boundary(corner_mm);
        }
        self.way_mm = 0.0;
        self.now = Moment::at(self.now.boundary());
    }

    fn start_buffer(&mut self) {
        self.wait_for_boundary();
        if self.has_buffers && self.now.tick > self.buffer_start {
            self.buffer += 1;
            self.buffer_start = self.now.tick;
        }
    }
}
