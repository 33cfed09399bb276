//! The corner between two moves in a plane: a fillet or a chamfer takes its place, and both moves
//! become shorter.
//!
//! ```text
//!   first ──────╮ fillet     first ─────╲ chamfer     A chamfer's ends lie as far from the
//!               │ second                 │ second     corner as it says, on arcs straight across.
//! ```
//!
//! A fillet is tangent to both moves, lines or arcs: its centre lies where these, moved aside by its
//! radius to the side of the turn, meet. Of several such circles it is the one nearest to the corner.

use super::arc::{distance, sweep_rad};

/// A place in the plane.
pub(super) type Place = [f64; 2];

/// Ends nearer than this are one point.
const SAME: f64 = 1e-7;

/// The sine of an angle below which two moves go on in one direction.
const STRAIGHT: f64 = 1e-9;

/// A line or an arc of less than a turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Leg {
    pub start: Place,
    pub end: Place,
    /// Of an arc its centre, and whether it goes counter-clockwise.
    pub round: Option<(Place, bool)>,
}

/// What takes the place of a corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Finish {
    /// An arc of this radius.
    Fillet(f64),
    /// A line that begins and ends so far from the corner, in a straight line.
    Chamfer(f64),
}

fn dot(a: Place, b: Place) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn cross(a: Place, b: Place) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

fn left(a: Place) -> Place {
    [-a[1], a[0]]
}

fn minus(a: Place, b: Place) -> Place {
    [a[0] - b[0], a[1] - b[1]]
}

/// From a place along a direction.
fn from(place: Place, direction: Place, by: f64) -> Place {
    [place[0] + direction[0] * by, place[1] + direction[1] * by]
}

fn unit(way: Place) -> Place {
    let length = libm::hypot(way[0], way[1]);
    [way[0] / length, way[1] / length]
}

impl Leg {
    pub fn length(&self) -> f64 {
        match self.round {
            None => distance(self.start, self.end),
            Some((center, ccw)) => {
                sweep_rad(self.start, self.end, center, ccw, 0) * distance(self.start, center)
            }
        }
    }

    /// The direction at a place of it.
    fn direction(&self, at: Place) -> Place {
        match self.round {
            None => unit(minus(self.end, self.start)),
            Some((center, true)) => left(unit(minus(at, center))),
            Some((center, false)) => left(unit(minus(center, at))),
        }
    }

    /// How far from its start a place of its line or circle lies; none if it is not reached.
    fn way_to(&self, place: Place) -> Option<f64> {
        let all = self.length();
        if distance(place, self.start) < SAME {
            return Some(0.0);
        }
        if distance(place, self.end) < SAME {
            return Some(all);
        }
        let way = match self.round {
            None => dot(minus(place, self.start), self.direction(self.start)),
            Some((center, ccw)) => {
                sweep_rad(self.start, place, center, ccw, 0) * distance(self.start, center)
            }
        };
        (0.0..=all).contains(&way).then_some(way)
    }

    /// How long a piece of it is whose ends lie so far apart, in a straight line; none: it bends away
    /// before.
    fn along(&self, apart: f64) -> Option<f64> {
        let Some((center, _)) = self.round else { return Some(apart) };
        let radius = distance(self.start, center);
        let half = apart / (2.0 * radius);
        (half <= 1.0).then(|| 2.0 * radius * libm::asin(half))
    }

    /// The place of it so far from an end, which is its last one or its first.
    fn off(&self, end: Place, apart: f64, is_last: bool) -> Place {
        let sign = if is_last { -1.0 } else { 1.0 };
        let Some((center, ccw)) = self.round else {
            return from(end, self.direction(end), sign * apart);
        };
        let angle = self.along(apart).unwrap_or_default() / distance(self.start, center);
        let (sin, cos) = libm::sincos(if ccw { sign * angle } else { -sign * angle });
        let out = minus(end, center);
        [center[0] + out[0] * cos - out[1] * sin, center[1] + out[0] * sin + out[1] * cos]
    }

    /// The line or circle aside of it: to the left by a distance, or below 0 to the right.
    fn aside(&self, by: f64) -> Aside {
        match self.round {
            None => {
                let direction = self.direction(self.start);
                Aside::Line(from(self.start, left(direction), by), direction)
            }
            Some((center, ccw)) => {
                let radius = distance(self.start, center);
                Aside::Circle(center, if ccw { radius - by } else { radius + by })
            }
        }
    }

    /// Where a circle touches it.
    fn foot(&self, circle: Place) -> Place {
        match self.round {
            None => {
                let direction = self.direction(self.start);
                from(self.start, direction, dot(minus(circle, self.start), direction))
            }
            Some((center, _)) => {
                from(center, unit(minus(circle, center)), distance(self.start, center))
            }
        }
    }
}

/// What lies aside of a leg.
#[derive(Clone, Copy)]
enum Aside {
    /// A point and a direction.
    Line(Place, Place),
    /// A centre and a radius.
    Circle(Place, f64),
}

/// Where two of them meet.
fn meetings(first: Aside, second: Aside) -> Vec<Place> {
    match (first, second) {
        (Aside::Line(a, along), Aside::Line(b, other)) => {
            vec![from(a, along, cross(minus(b, a), other) / cross(along, other))]
        }
        (Aside::Line(at, along), Aside::Circle(center, radius))
        | (Aside::Circle(center, radius), Aside::Line(at, along)) => {
            let foot = from(at, along, dot(minus(center, at), along));
            let off = distance(foot, center);
            let square = (radius - off) * (radius + off);
            if radius <= 0.0 || square < 0.0 {
                return Vec::new();
            }
            [1.0, -1.0].map(|sign| from(foot, along, sign * square.sqrt())).to_vec()
        }
        (Aside::Circle(a, radius_a), Aside::Circle(b, radius_b)) => {
            let apart = distance(a, b);
            if radius_a <= 0.0 || radius_b <= 0.0 || apart < SAME {
                return Vec::new();
            }
            let along = (apart * apart + radius_a * radius_a - radius_b * radius_b) / (2.0 * apart);
            let square = (radius_a - along) * (radius_a + along);
            if square < 0.0 {
                return Vec::new();
            }
            let direction = unit(minus(b, a));
            let foot = from(a, direction, along);
            [1.0, -1.0].map(|sign| from(foot, left(direction), sign * square.sqrt())).to_vec()
        }
    }
}

/// Takes the corner between two legs that follow each other away: shortens both and gives what lies
/// between; none where they go on in one direction. Errors say why there is no place for it.
pub(super) fn finish(
    first: &mut Leg,
    second: &mut Leg,
    finish: Finish,
) -> Result<Option<Leg>, String> {
    if first.length() < SAME || second.length() < SAME {
        return Err("one of the two moves has no length in the plane".to_owned());
    }
    let corner = first.end;
    let (before, behind) = (first.direction(corner), second.direction(corner));
    let turn = cross(before, behind);
    if turn.abs() < STRAIGHT {
        let goes_back = dot(before, behind) < 0.0;
        return if goes_back { Err("the second move goes back".to_owned()) } else { Ok(None) };
    }
    let (start, end, round) = match finish {
        Finish::Chamfer(size) => {
            fits(first, second, size)?;
            (first.off(corner, size, true), second.off(corner, size, false), None)
        }
        Finish::Fillet(radius) => {
            if first.round.is_none() && second.round.is_none() {
                // The tangent of half the angle by which the way turns.
                fits(first, second, radius * turn.abs() / (1.0 + dot(before, behind)))?;
            }
            let by = radius.copysign(turn);
            let touch = |center: Place| {
                let feet = [first.foot(center), second.foot(center)];
                let off = first.length() - first.way_to(feet[0])? + second.way_to(feet[1])?;
                Some((off, feet, center))
            };
            let found = meetings(first.aside(by), second.aside(by)).into_iter().filter_map(touch);
            let nearest = found.min_by(|a, b| a.0.total_cmp(&b.0));
            let Some((_, [start, end], center)) = nearest else {
                return Err("the moves leave no place for an arc of this radius".to_owned());
            };
            (start, end, Some((center, turn > 0.0)))
        }
    };
    (first.end, second.start) = (start, end);
    Ok(Some(Leg { start, end, round }))
}

/// Whether a corner whose ends lie so far from it leaves something of both moves, or nothing.
fn fits(first: &Leg, second: &Leg, size: f64) -> Result<(), String> {
    for (leg, name) in [(first, "before"), (second, "behind")] {
        let length = leg.length();
        if leg.along(size).is_none_or(|taken| taken > length + SAME) {
            let kind = if leg.round.is_some() { "arc" } else { "line" };
            return Err(format!(
                "it takes {size:.4} of the {kind} {name} it, which is {length:.4} long"
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn line(start: Place, end: Place) -> Leg {
        Leg { start, end, round: None }
    }

    #[test]
    fn lines_get_chamfers_and_fillets() {
        let legs = (line([0.0, 0.0], [10.0, 0.0]), line([10.0, 0.0], [10.0, 5.0]));
        let (mut first, mut second) = legs;
        let corner = finish(&mut first, &mut second, Finish::Chamfer(2.0)).unwrap();
        assert_eq!(corner, Some(line([8.0, 0.0], [10.0, 2.0])));
        let (mut first, mut second) = legs;
        let corner = finish(&mut first, &mut second, Finish::Fillet(3.0)).unwrap().unwrap();
        let center = corner.round.unwrap().0;
        assert!(distance(center, [7.0, 3.0]) < 1e-12 && corner.round.unwrap().1);
        let (mut first, mut second) = legs;
        assert!(finish(&mut first, &mut second, Finish::Fillet(5.1)).is_err());
        assert!(finish(&mut first, &mut second, Finish::Chamfer(5.1)).is_err());
        // A quarter of a circle about [0, 0] that ends where a line begins.
        let mut arc = Leg { start: [0.0, -5.0], end: [5.0, 0.0], round: Some(([0.0; 2], true)) };
        let mut second = line([5.0, 0.0], [15.0, 0.0]);
        let corner = finish(&mut arc, &mut second, Finish::Chamfer(2.0)).unwrap().unwrap();
        assert!((distance(corner.start, [5.0, 0.0]) - 2.0).abs() < 1e-12);
        assert!((distance(corner.start, [0.0; 2]) - 5.0).abs() < 1e-12 && corner.start[1] < 0.0);
        assert_eq!((corner.end, corner.round), ([7.0, 0.0], None));
        assert!(finish(&mut arc, &mut second, Finish::Chamfer(7.2)).is_err());
        let mut on = line([10.0, 0.0], [15.0, 0.0]);
        assert_eq!(finish(&mut first, &mut on, Finish::Fillet(1.0)), Ok(None));
        let mut back = line([10.0, 0.0], [5.0, 0.0]);
        assert!(finish(&mut first, &mut back, Finish::Fillet(1.0)).is_err());
    }

    proptest! {
        /// A fillet touches both moves and lies on its circle; what is left of these is of the
        /// same lines and circles.
        #[test]
        fn fillets_are_tangent(
            bend in -3.0..3.0_f64,
            radii in (5.0..50.0_f64, 5.0..50.0_f64),
            kinds in (0..3_u8, 0..3_u8),
            radius in 0.1..4.0_f64,
        ) {
            let corner = [3.0, 4.0];
            let leg = |angle: f64, kind: u8, curve: f64, is_first: bool| {
                let way = [libm::cos(angle), libm::sin(angle)];
                let other = from(corner, way, if is_first { -20.0 } else { 20.0 });
                let (start, end) = if is_first { (other, corner) } else { (corner, other) };
                if kind == 0 {
                    return line(start, end);
                }
                let ccw = kind == 1;
                let center = from(corner, left(way), if ccw { curve } else { -curve });
                let quarter = from(center, way, if is_first { -curve } else { curve });
                let (start, end) = if is_first { (quarter, corner) } else { (corner, quarter) };
                Leg { start, end, round: Some((center, ccw)) }
            };
            let mut first = leg(0.0, kinds.0, radii.0, true);
            let mut second = leg(bend, kinds.1, radii.1, false);
            let before = [first, second];
            let Ok(Some(found)) = finish(&mut first, &mut second, Finish::Fillet(radius)) else {
                return Ok(());
            };
            let (center, _) = found.round.unwrap();
            prop_assert!((distance(found.start, center) - radius).abs() < 1e-6);
            prop_assert!((distance(found.end, center) - radius).abs() < 1e-6);
            prop_assert!(first.end == found.start && second.start == found.end);
            for (leg, at) in [(before[0], found.start), (before[1], found.end)] {
                prop_assert!(leg.way_to(at).is_some());
                let (a, b) = (leg.direction(at), found.direction(at));
                prop_assert!(cross(a, b).abs() < 1e-6 && dot(a, b) > 0.0);
            }
        }
    }
}
