//! One piece of the path, and its geometry in closed form.
//!
//! ```text
//!            to ___
//!          ,-'     `-.          angle(u) = angle_from + sweep · u
//!        ,'           \         radius(u) = radius_from + (radius_to - radius_from) · u
//!       /  sweep       | from   every other axis: linear in u
//!       |    ( ·center )        u = 0 at the start, 1 at the end
//! ```

use std::rc::Rc;

use super::MeasuredSpline;
use crate::base::{Axis, AxisMap, Event, Plane, Point};
use crate::interp::Corner;

/// An item of the path: a curve, or an event at which the machine rests.
#[derive(Clone, Debug, PartialEq)]
pub enum PathItem {
    /// A piece of the path: shared, since every stage behind looks at it.
    Segment(Rc<Segment>),
    /// Something that happens between two pieces.
    Event(Event),
}

impl From<Segment> for PathItem {
    fn from(segment: Segment) -> PathItem {
        PathItem::Segment(Rc::new(segment))
    }
}

/// A piece of the path: a line, arc, helix or spline from one position to another.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    /// Line of the NC program, from 1.
    pub line: u32,
    /// Speed along the path; none: as fast as the machine can (a rapid).
    pub feed_mm_s: Option<f64>,
    /// Start, in machine coordinates.
    pub from_mm: Point,
    /// End, in machine coordinates.
    pub to_mm: Point,
    /// The way between.
    pub curve: Curve,
    /// What may become of the corner at its end.
    pub corner: Corner,
}

/// The shape of a segment.
#[derive(Clone, Debug, PartialEq)]
pub enum Curve {
    /// Straight in all axes.
    Line,
    /// Circular in a plane, linear in all other axes.
    Arc(Arc),
    /// A spline in X, Y and Z; all other axes rest.
    Spline(Rc<MeasuredSpline>),
}

/// The circular part of an arc or helix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arc {
    /// The arc's plane.
    pub plane: Plane,
    /// Centre on the plane's first and second axis.
    pub center_mm: [f64; 2],
    /// Radius at the start.
    pub radius_from_mm: f64,
    /// Radius at the end; between them it changes linearly with the angle.
    pub radius_to_mm: f64,
    /// Direction from the centre to the start, from the plane's first axis to its second.
    pub angle_from_rad: f64,
    /// Angle travelled, all turns included; positive is counter-clockwise.
    pub sweep_rad: f64,
}

impl Segment {
    /// Length of the path: what feed applies to; of a line [`Point::feed_way`]. Where an arc's radius
    /// changes, the greater radius counts, so that no part of it is run faster than its feed.
    #[inline]
    pub fn length_mm(&self) -> f64 {
        match &self.curve {
            Curve::Line => self.from_mm.feed_way(&self.to_mm).0,
            Curve::Arc(arc) => self.arc_length_mm(arc),
            Curve::Spline(spline) => spline.length_mm(),
        }
    }

    #[inline(never)]
    fn arc_length_mm(&self, arc: &Arc) -> f64 {
        let normal = arc.plane.normal();
        let along_mm = self.to_mm[normal] - self.from_mm[normal];
        let inward_mm = arc.radius_to_mm - arc.radius_from_mm;
        (arc.turn_mm().powi(2) + inward_mm * inward_mm + along_mm * along_mm).sqrt()
    }

    /// Position after a share of the way; 0 is the start and 1 the end, both exactly.
    pub fn point_at(&self, share: f64) -> Point {
        if share <= 0.0 {
            return self.from_mm;
        }
        if share >= 1.0 {
            return self.to_mm;
        }
        let mut point = AxisMap(std::array::from_fn(|i| self.line_at(i, share)));
        if let Curve::Arc(arc) = &self.curve {
            let [first, second] = arc.plane.axes();
            [point[first], point[second]] = arc.point_at(share);
        }
        if let Curve::Spline(spline) = &self.curve {
            let at = spline.point_at(share * spline.length_mm());
            Axis::LINEAR.into_iter().zip(at).for_each(|(axis, at)| point[axis] = at);
        }
        point
    }

    /// X, Y and Z after a share of the way, as [`Segment::point_at`].
    pub fn xyz_at(&self, share: f64) -> [f64; 3] {
        if !matches!(self.curve, Curve::Line) {
            return self.point_at(share).xyz();
        }
        std::array::from_fn(|i| self.line_at(i, share))
    }

    /// Position of an axis, by its number, after a share of the straight way between the ends: of one in
    /// which it is straight.
    #[inline]
    pub fn line_at(&self, axis: usize, share: f64) -> f64 {
        let [from, to] = [self.from_mm.0[axis], self.to_mm.0[axis]];
        if share <= 0.0 {
            from
        } else if share >= 1.0 {
            to
        } else {
            from + (to - from) * share
        }
    }

    /// How fast each axis moves at most while the path advances at one mm/s: max |dx/ds|.
    #[inline(never)]
    pub fn axis_speeds(&self) -> Point {
        let length_mm = self.length_mm();
        if length_mm <= 0.0 {
            return Point::ZERO;
        }
        let mut speeds =
            AxisMap::from_fn(|axis| (self.to_mm[axis] - self.from_mm[axis]).abs() / length_mm);
        match &self.curve {
            Curve::Line => {}
            Curve::Arc(arc) => {
                let inward = (arc.radius_to_mm - arc.radius_from_mm).abs() / length_mm;
                let turn = arc.turn_mm() / length_mm;
                // The first axis goes as the cosine of the angle, so its speed as the sine; the
                // second the other way round.
                let [first, second] = arc.plane.axes();
                let quarter = std::f64::consts::FRAC_PI_2;
                for (axis, shift) in [(first, quarter), (second, 0.0)] {
                    let share = cosine_max(arc.angle_from_rad + shift, arc.sweep_rad);
                    speeds[axis] = turn * share + inward;
                }
            }
            Curve::Spline(spline) => {
                let xyz = Axis::LINEAR.into_iter().zip(spline.axis_speeds());
                xyz.for_each(|(axis, speed)| speeds[axis] = speed);
            }
        }
        speeds
    }
}

impl Arc {
    /// Position on the plane's first and second axis after a share of the sweep.
    pub fn point_at(&self, share: f64) -> [f64; 2] {
        let radius = self.radius_from_mm + (self.radius_to_mm - self.radius_from_mm) * share;
        let (sin, cos) = libm::sincos(self.angle_from_rad + self.sweep_rad * share);
        [self.center_mm[0] + radius * cos, self.center_mm[1] + radius * sin]
    }

    /// The greater of the radii at both ends.
    pub fn radius_max_mm(&self) -> f64 {
        self.radius_from_mm.max(self.radius_to_mm)
    }

    /// Way round the centre, at the greater radius.
    fn turn_mm(&self) -> f64 {
        self.radius_max_mm() * self.sweep_rad.abs()
    }
}

/// Greatest |cos| between an angle and that angle plus a sweep.
fn cosine_max(from_rad: f64, sweep_rad: f64) -> f64 {
    let pi = std::f64::consts::PI;
    let to_rad = from_rad + sweep_rad;
    let (low, high) = (from_rad.min(to_rad), from_rad.max(to_rad));
    // |cos| is 1 at the multiples of pi.
    if (high / pi).floor() >= (low / pi).ceil() {
        return 1.0;
    }
    libm::cos(low).abs().max(libm::cos(high).abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn xyz(x: f64, y: f64, z: f64) -> Point {
        AxisMap([x, y, z, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    }

    fn helix() -> Segment {
        Segment {
            line: 1,
            feed_mm_s: Some(5.0),
            from_mm: xyz(20.0, 0.0, 0.0),
            to_mm: xyz(20.0, 0.0, 4.0),
            corner: Corner::Exact,
            curve: Curve::Arc(Arc {
                plane: Plane::Xy,
                center_mm: [10.0, 0.0],
                radius_from_mm: 10.0,
                radius_to_mm: 10.0,
                angle_from_rad: 0.0,
                sweep_rad: 4.0 * PI,
            }),
        }
    }

    #[test]
    fn a_residue_of_rounding_leads_no_other_axis() {
        let way = |x: f64, a: f64| {
            let to_mm = AxisMap([5.0 + x, 0.0, 0.0, a, 0.0, 0.0, 0.0, 0.0, 0.0]);
            let (from_mm, curve) = (xyz(5.0, 0.0, 0.0), Curve::Line);
            Segment { from_mm, to_mm, curve, ..helix() }.length_mm()
        };
        assert_eq!(way(1e-15, 90.0), 90.0);
        assert_eq!(way(0.001, 90.0), 5.001 - 5.0);
        // Alone it is a way like any other.
        assert_eq!(way(1e-9, 0.0), 5.000_000_001 - 5.0);
        assert_eq!(way(0.0, 0.0), 0.0);
    }

    #[test]
    fn a_helix_is_as_long_as_its_unrolled_triangle() {
        assert!((helix().length_mm() - libm::hypot(40.0 * PI, 4.0)).abs() < 1e-12);
        let quarter = helix().point_at(0.125);
        assert!((quarter[Axis::X] - 10.0).abs() < 1e-12);
        assert!((quarter[Axis::Y] - 10.0).abs() < 1e-12);
        assert!((quarter[Axis::Z] - 0.5).abs() < 1e-12);
        assert_eq!(helix().point_at(1.0), helix().to_mm);
    }

    #[test]
    fn rates_bound_what_the_axes_do() {
        let mut arc = helix();
        let Curve::Arc(curve) = &mut arc.curve else { unreachable!() };
        curve.angle_from_rad = 0.3;
        curve.sweep_rad = 0.9;
        (arc.from_mm, arc.to_mm) = (Point::ZERO, Point::ZERO);
        for end in [0.0, 1.0] {
            let [x, y] = curve.point_at(end);
            *if end == 0.0 { &mut arc.from_mm } else { &mut arc.to_mm } = xyz(x, y, end);
        }
        let (rates, length, step) = (arc.axis_speeds(), arc.length_mm(), 1e-4);
        for k in 1..9999 {
            let share = f64::from(k) * step;
            let (a, b) = (arc.point_at(share), arc.point_at(share + step));
            for axis in Axis::LINEAR {
                let speed = (b[axis] - a[axis]).abs() / (step * length);
                assert!(speed <= rates[axis] + 1e-9, "{axis} at {share}: {speed}");
            }
        }
        // x goes as the cosine: its speed is greatest at the end, sin(1.2).
        assert!((rates[Axis::X] - libm::sin(1.2) * 9.0 / length).abs() < 1e-12);
    }

    #[test]
    fn a_move_in_rotary_axes_alone_is_measured_in_degrees() {
        let mut turn = helix();
        turn.curve = Curve::Line;
        turn.to_mm = turn.from_mm;
        turn.to_mm[Axis::A] += 90.0;
        assert_eq!(turn.length_mm(), 90.0);
        assert_eq!(turn.point_at(0.5)[Axis::A], 45.0);
    }
}
