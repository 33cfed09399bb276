//! The ticks of one profile, one after the other: where the machine is at each boundary, in steps.
//!
//! What is the same in many ticks is found once: of a profile its ends and, on an arc, the direction in
//! which it begins; of a leg of its ramp the boundaries that lie in it.
//!
//! ```text
//!             leg 0        leg 1                 position(k) = from + (to - from) · share
//!          ╭─────────╮╭──────────────╮
//!    ──|────|────|────|────|────|────|──         share(k) = distance of the leg under way / length
//!           k         until
//! ```

use crate::base::axis::AXES;
use crate::base::{AxisMap, Point};
use crate::path::{Arc, Curve};
use crate::plan::{Leg, Moment, Profile};

/// A piece of an arc that turns by no more than this is followed by the first terms of sine and cosine.
const TURN_MAX_RAD: f64 = 0.03;

/// A profile under way.
#[derive(Debug)]
pub struct Course {
    profile: Box<Profile>,
    shape: Shape,
    /// The leg under way.
    leg: Leg,
    /// The boundaries that lie in it go on to this one.
    until: u64,
    /// When the profile starts, its length, and the buffer and line of its ticks: what each tick asks for.
    start: Moment,
    length_mm: f64,
    place: (u32, u32),
}

/// How a profile's position goes with the share of its way.
#[derive(Debug)]
enum Shape {
    Line {
        from_steps: AxisMap<f64>,
        way_steps: AxisMap<f64>,
    },
    Arc(ShortArc),
    /// The segment is asked.
    Other,
}

/// A piece of an arc so short that its turn δ from the start needs no sine:
///
/// ```text
/// sin δ = δ · (1 - δ²/6 · (1 - δ²/20 · (1 - δ²/42)))        the first terms left out are below
/// cos δ = 1 - δ²/2 · (1 - δ²/12 · (1 - δ²/30))              2e-17 for δ = 0.03
/// ```
#[derive(Debug)]
struct ShortArc {
    from_steps: AxisMap<f64>,
    way_steps: AxisMap<f64>,
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
    /// A profile from its first boundary on.
    pub fn new(profile: Box<Profile>, steps_per_mm: &AxisMap<f64>) -> Course {
        let shape = match &profile.segment.curve {
            Curve::Line => {
                let [from_steps, way_steps] = line_in_steps(&profile, steps_per_mm);
                Shape::Line { from_steps, way_steps }
            }
            Curve::Arc(arc) => {
                ShortArc::new(arc, &profile, steps_per_mm).map_or(Shape::Other, Shape::Arc)
            }
            Curve::Spline(_) => Shape::Other,
        };
        let leg = profile.ramp.leg_at(0.0);
        let (start, length_mm) = (profile.start, profile.ramp.length_mm());
        let place = (profile.buffer, profile.segment.line);
        Course { profile, shape, leg, until: 0, start, length_mm, place }
    }

    /// The profile.
    pub fn profile(&self) -> &Profile {
        &self.profile
    }

    /// The buffer and the line of its ticks.
    #[inline]
    pub fn place(&self) -> (u32, u32) {
        self.place
    }

    /// Whether a boundary lies in the leg under way.
    #[inline]
    pub fn holds(&self, boundary: u64) -> bool {
        boundary <= self.until
    }

    /// Goes on to the leg that a boundary lies in; not where the profile has ended there.
    pub fn go_on(&mut self, boundary: u64, tick_s: f64) -> bool {
        let Profile { start, end, ramp, .. } = &*self.profile;
        let is_within = boundary < end.tick || (boundary == end.tick && end.share > 0.0);
        if is_within {
            let time_s = start.ticks_until(boundary) * tick_s;
            self.leg = ramp.leg_at(time_s);
            let left = ((self.leg.end_s - time_s) / tick_s).max(0.0) as u64;
            let last = if end.share > 0.0 { end.tick } else { end.tick - 1 };
            self.until = last.min(boundary.saturating_add(left));
        }
        is_within
    }

    /// Position at a boundary in the leg under way, in steps.
    #[inline]
    pub fn steps_at<const N: usize>(
        &self,
        boundary: u64,
        tick_s: f64,
        steps_per_mm: &AxisMap<f64>,
    ) -> [f64; N] {
        let time_s = self.start.ticks_until(boundary) * tick_s;
        let share = (self.leg.distance_mm(time_s) / self.length_mm).min(1.0);
        match &self.shape {
            Shape::Line { from_steps, way_steps } => {
                std::array::from_fn(|i| from_steps.0[i] + way_steps.0[i] * share)
            }
            Shape::Arc(arc) => arc.steps_at(share),
            Shape::Other => {
                let [from, to] = self.profile.shares;
                let position_mm = self.profile.segment.point_at(from + (to - from) * share);
                std::array::from_fn(|i| position_mm.0[i] * steps_per_mm.0[i])
            }
        }
    }

    /// Position at the profile's end, in steps.
    pub fn end_steps(&self, steps_per_mm: &AxisMap<f64>) -> [f64; AXES] {
        in_steps(&self.profile.end_mm(), steps_per_mm).0
    }
}

impl ShortArc {
    fn new(arc: &Arc, profile: &Profile, steps_per_mm: &AxisMap<f64>) -> Option<ShortArc> {
        let [from, to] = profile.shares;
        let sweep_rad = arc.sweep_rad * (to - from);
        if sweep_rad.abs() > TURN_MAX_RAD {
            return None;
        }
        let plane = arc.plane.axes();
        let radius_change_mm = arc.radius_to_mm - arc.radius_from_mm;
        let [from_steps, way_steps] = line_in_steps(profile, steps_per_mm);
        Some(ShortArc {
            from_steps,
            way_steps,
            plane: plane.map(|axis| axis as usize),
            center_mm: arc.center_mm,
            steps_per_mm: plane.map(|axis| steps_per_mm[axis]),
            radius_mm: arc.radius_from_mm + radius_change_mm * from,
            radius_change_mm: radius_change_mm * (to - from),
            sweep_rad,
            sin_cos: libm::sincos(arc.angle_from_rad + arc.sweep_rad * from),
        })
    }

    #[inline]
    fn steps_at<const N: usize>(&self, share: f64) -> [f64; N] {
        let mut steps = std::array::from_fn(|i| self.from_steps.0[i] + self.way_steps.0[i] * share);
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

/// Where a profile begins, and its way to where it ends, in steps; what is not linear is left to others.
fn line_in_steps(profile: &Profile, steps_per_mm: &AxisMap<f64>) -> [AxisMap<f64>; 2] {
    let segment = &profile.segment;
    let [from, to] = profile.shares.map(|share| segment.line_at(share));
    let from_steps = in_steps(&from, steps_per_mm);
    let to_steps = in_steps(&to, steps_per_mm);
    let mut way_steps = AxisMap::default();
    for i in 0..AXES {
        way_steps.0[i] = to_steps.0[i] - from_steps.0[i];
    }
    [from_steps, way_steps]
}

fn in_steps(position_mm: &Point, steps_per_mm: &AxisMap<f64>) -> AxisMap<f64> {
    let mut steps = AxisMap::default();
    for i in 0..AXES {
        steps.0[i] = position_mm.0[i] * steps_per_mm.0[i];
    }
    steps
}
