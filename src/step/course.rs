//! The ticks of one profile, one after the other: where the machine is at each boundary, in steps.
//!
//! What is the same in many ticks is found once, in one place for all profiles: of a profile its ends and,
//! on an arc, the direction in which it begins; of a leg of its ramp the boundaries that lie in it.
//!
//! ```text
//!             leg 0        leg 1                 position(k) = from + (to - from) · share
//!          ╭─────────╮╭──────────────╮
//!    ──|────|────|────|────|────|────|──         share(k) = distance of the leg under way / length
//!           k         until
//! ```

use std::rc::Rc;

use crate::base::axis::AXES;
use crate::base::{AxisMap, Machine};
use crate::path::{Arc, Curve, Segment};
use crate::plan::{Leg, Moment, Profile};

/// X, Y, Z and A: as many axes as are computed together where a machine has no others.
pub const FIRST: usize = 4;

/// A piece of an arc that turns by no more than this is followed by the first terms of sine and cosine.
const TURN_MAX_RAD: f64 = 0.03;

/// The profile under way, on a machine.
#[derive(Debug)]
pub struct Course {
    tick_s: f64,
    /// Steps a mm; 0 on axes that the machine lacks.
    steps_per_mm: AxisMap<f64>,
    /// The machine has none but the [`FIRST`] axes. Else all nine are computed in every tick: a number
    /// that is known beforehand takes no branch, and four fill the processor's registers.
    has_first_only: bool,
    /// None before the first, and where the machine rests behind one.
    profile: Option<Rc<Profile>>,
    /// When it starts.
    start: Moment,
    length_mm: f64,
    /// The buffer and the line of its ticks.
    place: (u32, u32),
    /// Where it begins, and its way to where it ends, in steps, on the axes in which it is straight.
    from_steps: AxisMap<f64>,
    way_steps: AxisMap<f64>,
    shape: Shape,
    /// The leg under way.
    leg: Leg,
    /// The boundaries that lie in it go on to this one.
    until: u64,
}

/// How a profile's position goes with the share of its way.
#[derive(Debug)]
enum Shape {
    Line,
    Arc(ShortArc),
    /// The segment is asked, between these shares of its own way.
    Other(Rc<Segment>, [f64; 2]),
}

/// A piece of an arc so short that its turn δ from the start needs no sine:
///
/// ```text
/// sin δ = δ · (1 - δ²/6 · (1 - δ²/20 · (1 - δ²/42)))        the first terms left out are below
/// cos δ = 1 - δ²/2 · (1 - δ²/12 · (1 - δ²/30))              2e-17 for δ = 0.03
/// ```
#[derive(Debug)]
struct ShortArc {
    /// Indices of the plane's axes, and their centre and steps a mm.
    plane: [usize; 2],
    center_mm: [f64; 2],
    steps_per_mm: [f64; 2],
    radius_mm: f64,
    radius_change_mm: f64,
    sweep_rad: f64,
    /// Sine and cosine at the start.
    sin_cos: (f64, f64),
}

impl Course {
    /// Without a profile.
    pub fn new(machine: &Machine) -> Course {
        let steps_per_mm = |axis| machine.axis(axis).map_or(0.0, |axis| axis.steps_per_mm);
        Course {
            tick_s: machine.bus.tick_s(),
            steps_per_mm: AxisMap::from_fn(steps_per_mm),
            has_first_only: machine.axes.iter().all(|profile| (profile.axis as usize) < FIRST),
            profile: None,
            start: Moment::default(),
            length_mm: 0.0,
            place: (0, 0),
            from_steps: AxisMap::default(),
            way_steps: AxisMap::default(),
            shape: Shape::Line,
            leg: Leg::default(),
            until: 0,
        }
    }

    /// Takes the next profile; a leg of it is under way from [`Course::go_on`] on.
    pub fn begin(&mut self, profile: Rc<Profile>) {
        self.shape = match &profile.segment.curve {
            Curve::Line => Shape::Line,
            Curve::Arc(arc) => match ShortArc::new(arc, profile.shares, &self.steps_per_mm) {
                Some(arc) => Shape::Arc(arc),
                None => Shape::Other(Rc::clone(&profile.segment), profile.shares),
            },
            Curve::Spline(_) => Shape::Other(Rc::clone(&profile.segment), profile.shares),
        };
        if self.has_first_only {
            self.lay_line::<FIRST>(&profile);
        } else {
            self.lay_line::<AXES>(&profile);
        }
        (self.start, self.length_mm) = (profile.start, profile.ramp.length_mm());
        self.place = (profile.buffer, profile.segment.line);
        self.until = 0;
        self.profile = Some(profile);
    }

    /// Leaves the profile: the machine rests behind it.
    pub fn leave(&mut self) {
        (self.profile, self.until) = (None, 0);
    }

    /// The profile.
    pub fn profile(&self) -> Option<&Profile> {
        self.profile.as_deref()
    }

    /// The buffer and the line of the profile's ticks.
    #[inline]
    pub fn place(&self) -> (u32, u32) {
        self.place
    }

    /// Whether no axes but the first need be asked for.
    #[inline]
    pub fn has_first_only(&self) -> bool {
        self.has_first_only
    }

    /// Whether a boundary lies in the leg under way.
    #[inline]
    pub fn holds(&self, boundary: u64) -> bool {
        boundary <= self.until
    }

    /// Goes on to the leg that a boundary lies in; not where the profile has ended there.
    pub fn go_on(&mut self, boundary: u64) -> bool {
        let Some(profile) = &self.profile else { return false };
        let Profile { start, end, ramp, .. } = &**profile;
        let is_within = boundary < end.tick || (boundary == end.tick && end.share > 0.0);
        if is_within {
            let time_s = start.ticks_until(boundary) * self.tick_s;
            self.leg = ramp.leg_at(time_s);
            let left = ((self.leg.end_s - time_s) / self.tick_s).max(0.0) as u64;
            let last = if end.share > 0.0 { end.tick } else { end.tick - 1 };
            self.until = last.min(boundary.saturating_add(left));
        }
        is_within
    }

    /// Position at a boundary in the leg under way, in steps.
    #[inline]
    pub fn steps_at<const N: usize>(&self, boundary: u64) -> [f64; N] {
        let time_s = self.start.ticks_until(boundary) * self.tick_s;
        let share = (self.leg.distance_mm(time_s) / self.length_mm).min(1.0);
        let straight = std::array::from_fn(|i| self.from_steps.0[i] + self.way_steps.0[i] * share);
        match &self.shape {
            Shape::Line => straight,
            Shape::Arc(arc) => arc.steps_at(share, straight),
            Shape::Other(segment, [from, to]) => {
                let position_mm = segment.point_at(from + (to - from) * share);
                std::array::from_fn(|i| position_mm.0[i] * self.steps_per_mm.0[i])
            }
        }
    }

    /// Position at the profile's end, in steps.
    pub fn end_steps(&self) -> Option<[f64; AXES]> {
        let end_mm = self.profile.as_ref()?.end_mm();
        Some(std::array::from_fn(|i| end_mm.0[i] * self.steps_per_mm.0[i]))
    }

    /// Finds the straight way of a profile.
    #[inline]
    fn lay_line<const N: usize>(&mut self, profile: &Profile) {
        let Profile { segment, shares: [from, to], .. } = profile;
        for i in 0..N {
            let steps_at = |share| segment.line_at(i, share) * self.steps_per_mm.0[i];
            self.from_steps.0[i] = steps_at(*from);
            self.way_steps.0[i] = steps_at(*to) - self.from_steps.0[i];
        }
    }
}

impl ShortArc {
    fn new(arc: &Arc, [from, to]: [f64; 2], steps_per_mm: &AxisMap<f64>) -> Option<ShortArc> {
        let sweep_rad = arc.sweep_rad * (to - from);
        if sweep_rad.abs() > TURN_MAX_RAD {
            return None;
        }
        let plane = arc.plane.axes();
        let radius_change_mm = arc.radius_to_mm - arc.radius_from_mm;
        Some(ShortArc {
            plane: plane.map(|axis| axis as usize),
            center_mm: arc.center_mm,
            steps_per_mm: plane.map(|axis| steps_per_mm[axis]),
            radius_mm: arc.radius_from_mm + radius_change_mm * from,
            radius_change_mm: radius_change_mm * (to - from),
            sweep_rad,
            sin_cos: libm::sincos(arc.angle_from_rad + arc.sweep_rad * from),
        })
    }

    /// Position in steps, given that on the axes in which it is straight.
    #[inline]
    fn steps_at<const N: usize>(&self, share: f64, mut steps: [f64; N]) -> [f64; N] {
        let turn_rad = self.sweep_rad * share;
        let sq = turn_rad * turn_rad;
        let sin = turn_rad * (1.0 - sq / 6.0 * (1.0 - sq / 20.0 * (1.0 - sq / 42.0)));
        let less = 0.5 * sq * (1.0 - sq / 12.0 * (1.0 - sq / 30.0));
        let (sin_from, cos_from) = self.sin_cos;
        let direction = [
            cos_from - (cos_from * less + sin_from * sin),
            sin_from - (sin_from * less - cos_from * sin),
        ];
        let radius_mm = self.radius_mm + self.radius_change_mm * share;
        for k in 0..2 {
            let at_mm = self.center_mm[k] + radius_mm * direction[k];
            steps[self.plane[k]] = at_mm * self.steps_per_mm[k];
        }
        steps
    }
}
