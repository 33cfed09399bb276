//! Rapids of a machine that moves every axis on its own (`rapid = "independent"`): the dogleg that
//! comes of it is the path.
//!
//! ```text
//!  Y ┤          ___.------ to     All axes start at once, each up to its own speed with its own
//!    │       .-'                  acceleration, and down to rest at its own end:
//!    │     ,'   Y is at its end
//!    │   ,'                       x(t) = ½·a·t²,  v·t - …,  d - ½·a·(t₁ - t)²
//!    │ ,'
//!  0 ┼'────────────────── X       Between the moments at which one of them changes its
//!    from                         acceleration each goes by a square of the time: a parabola.
//! ```
//!
//! So the way is a spline of degree 2, exactly. How fast it is run is not said here: along it, the
//! speeds of this model are one of the ways to keep all limits. A rapid that moves other axes than X,
//! Y and Z runs straight.

use crate::base::machine::AxisProfile;
use crate::base::{Axis, Machine, Point, Spline};

/// Moments that lie closer together, as a share of the way's time, are one but for rounding.
const SAME_MOMENT: f64 = 1e-9;

/// The way of a rapid on which X, Y and Z move independently; none where it is straight, because one
/// axis moves alone, or others move too.
pub fn dogleg(from: &Point, to: &Point, machine: &Machine) -> Option<Spline> {
    let moves = |axis: &Axis| from[*axis] != to[*axis];
    if Axis::ALL.iter().filter(|axis| !Axis::LINEAR.contains(axis)).any(moves) {
        return None;
    }
    let moving = machine.axes.iter().filter(|profile| moves(&profile.axis));
    let ways: Vec<Way> = moving.map(|profile| Way::new(profile, from, to, machine)).collect();
    if ways.len() < 2 {
        return None;
    }
    let moments = moments(&ways);
    let place = |time_s: f64| {
        let mut place = *from;
        ways.iter().for_each(|way| place[way.axis] += way.at_mm(time_s));
        place
    };
    let last = moments.len() - 2;
    let mut points = vec![*from];
    for (k, pair) in moments.windows(2).enumerate() {
        let (start, half_s) = (place(pair[0]), 0.5 * (pair[1] - pair[0]));
        let end = if k == last { *to } else { place(pair[1]) };
        let mut between = start;
        for way in &ways {
            // Where all axes begin or end together, at rest, they go straight.
            between[way.axis] = if k == 0 || k == last {
                0.5 * (start[way.axis] + end[way.axis])
            } else {
                start[way.axis] + way.speed_mm_s_at(pair[0]) * half_s
            };
        }
        points.extend([between, end]);
    }
    // Each piece between two moments is one between two knots, which stand twice.
    let count = moments.len() - 1;
    let mut knots: Vec<f64> = (0..=count).flat_map(|k| [k as f64; 2]).collect();
    knots.insert(0, 0.0);
    knots.push(count as f64);
    let weights = vec![1.0; points.len()];
    Spline::new(2, points, weights, knots).ok()
}

/// The moments at which an axis changes its acceleration, and both ends.
fn moments(ways: &[Way]) -> Vec<f64> {
    let changes = |way: &Way| [way.up_s, way.time_s - way.up_s, way.time_s];
    let mut moments: Vec<f64> = ways.iter().flat_map(changes).chain([0.0]).collect();
    moments.sort_by(f64::total_cmp);
    let end_s = moments[moments.len() - 1];
    moments.dedup_by(|later, earlier| *later - *earlier < SAME_MOMENT * end_s);
    moments
}

/// An axis on its way from rest to rest: up, on, down.
#[derive(Clone, Copy, Debug)]
struct Way {
    axis: Axis,
    by_mm: f64,
    accel_mm_s2: f64,
    /// How long it speeds up, and how long it brakes.
    up_s: f64,
    /// How long it takes.
    time_s: f64,
}

impl Way {
    fn new(profile: &AxisProfile, from: &Point, to: &Point, machine: &Machine) -> Way {
        let (axis, accel_mm_s2) = (profile.axis, profile.accel_max_mm_s2);
        let by_mm = to[axis] - from[axis];
        let count_mm = f64::from(machine.count_max(profile)) / profile.steps_per_mm;
        let speed_max_mm_s = profile.speed_max_mm_s.min(count_mm / machine.bus.tick_s());
        let speed_mm_s = speed_max_mm_s.min((accel_mm_s2 * by_mm.abs()).sqrt());
        let up_s = speed_mm_s / accel_mm_s2;
        Way { axis, by_mm, accel_mm_s2, up_s, time_s: by_mm.abs() / speed_mm_s + up_s }
    }

    /// How far it has come.
    fn at_mm(&self, time_s: f64) -> f64 {
        let left_s = self.time_s - time_s;
        let ramp_mm = |since_s: f64| 0.5 * self.accel_mm_s2 * since_s * since_s;
        let way_mm = if time_s <= self.up_s.min(left_s) {
            ramp_mm(time_s)
        } else if left_s >= self.up_s {
            self.accel_mm_s2 * self.up_s * (time_s - 0.5 * self.up_s)
        } else {
            self.by_mm.abs() - ramp_mm(left_s.max(0.0))
        };
        way_mm.copysign(self.by_mm)
    }

    /// How fast it goes.
    fn speed_mm_s_at(&self, time_s: f64) -> f64 {
        let ramp_s = time_s.min(self.time_s - time_s).min(self.up_s).max(0.0);
        (self.accel_mm_s2 * ramp_s).copysign(self.by_mm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::MeasuredSpline;
    use proptest::prelude::*;

    fn point(x: f64, y: f64, z: f64) -> Point {
        let mut point = Point::ZERO;
        (point[Axis::X], point[Axis::Y], point[Axis::Z]) = (x, y, z);
        point
    }

    #[test]
    fn equal_axes_go_diagonally_until_one_arrives() {
        let machine = Machine::load("router").unwrap();
        // X and Y run at 500 mm/s with 5000 mm/s²: 0.1 s and 25 mm up, and as much down.
        let spline = dogleg(&Point::ZERO, &point(200.0, 100.0, 0.0), &machine).unwrap();
        let curve = MeasuredSpline::new(&spline).unwrap();
        let close = |at: [f64; 3], x: f64, y: f64| (at[0] - x).abs() + (at[1] - y).abs() < 1e-6;
        assert!(close(curve.point_at(75.0 * 2.0_f64.sqrt()), 75.0, 75.0), "{curve:?}");
        // While Y brakes over its last 25 mm, X makes 50 mm.
        assert!(close(curve.point_at(curve.length_mm() - 75.0), 125.0, 100.0), "{curve:?}");
        assert_eq!(dogleg(&Point::ZERO, &point(50.0, 0.0, 0.0), &machine), None);
    }

    proptest! {
        /// At any moment the spline passes where the axes are, and its ends are the move's.
        #[test]
        fn the_way_is_that_of_the_axes(
            to in [-90.0..90.0_f64, -30.0..30.0_f64, -0.5..0.5_f64], share in 0.0..1.0_f64,
        ) {
            let mut machine = Machine::load("router").unwrap();
            (machine.axes[0].speed_max_mm_s, machine.axes[2].accel_max_mm_s2) = (120.0, 700.0);
            let to = point(to[0], to[1], to[2]);
            let spline = dogleg(&Point::ZERO, &to, &machine).unwrap();
            prop_assert_eq!(spline.points().last(), Some(&to));
            let ways: Vec<Way> = machine.axes.iter()
                .map(|profile| Way::new(profile, &Point::ZERO, &to, &machine)).collect();
            let moments = moments(&ways);
            let k = ((moments.len() - 1) as f64 * share) as usize;
            let time_s = moments[k] + 0.37 * (moments[k + 1] - moments[k]);
            let at = [0, 1, 2].map(|i: usize| ways[i].at_mm(time_s));
            // The first and the last piece are lines, run evenly; the others go by the time.
            let piece = spline.pieces()[k];
            let u = match k {
                0 => 0.37 * 0.37,
                k if k + 2 == moments.len() => 1.0 - 0.63 * 0.63,
                _ => 0.37,
            };
            for i in 0..3 {
                prop_assert!((piece.at(u)[i] - at[i]).abs() < 1e-6, "{:?} {at:?}", piece.at(u));
            }
        }
    }
}
