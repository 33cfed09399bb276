//! A path drawn line by line, and the job that a naive generator makes of it.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use cnc::base::{Axis, AxisMap, Command, Event, EventKind, Machine, Plane, Point, Tick};
use cnc::path::{Arc, Curve, PathItem, Segment};

pub fn xyz([x, y, z]: [f64; 3]) -> Point {
    let mut point = Point::ZERO;
    [point[Axis::X], point[Axis::Y], point[Axis::Z]] = [x, y, z];
    point
}

/// Builds a path from the work zero of the machine, line by line.
pub struct Drawing {
    pub path: Vec<PathItem>,
    pub at: [f64; 3],
    pub line: u32,
}

impl Drawing {
    pub fn new() -> Drawing {
        Drawing { path: Vec::new(), at: [75.0, 50.0, 50.0], line: 0 }
    }

    pub fn add(mut self, to: [f64; 3], feed_mm_s: Option<f64>, curve: Curve) -> Self {
        self.line += 1;
        let (from_mm, to_mm) = (xyz(self.at), xyz(to));
        let line = self.line;
        let corner = Default::default();
        let segment = Segment { line, feed_mm_s, from_mm, to_mm, curve, corner };
        self.path.push(PathItem::from(segment));
        self.at = to;
        self
    }

    pub fn line(self, way: [f64; 3]) -> Self {
        let to = std::array::from_fn(|axis| self.at[axis] + way[axis]);
        self.add(to, Some(10.0), Curve::Line)
    }

    pub fn rapid(self, way: [f64; 3]) -> Self {
        let to = std::array::from_fn(|axis| self.at[axis] + way[axis]);
        self.add(to, None, Curve::Line)
    }

    /// An arc in XY that starts in the direction `angle` from its centre, and rises.
    pub fn arc(self, radius: f64, angle: f64, sweep: f64, rise: f64) -> Self {
        let center = [self.at[0] - radius * angle.cos(), self.at[1] - radius * angle.sin()];
        let end = angle + sweep;
        let to =
            [center[0] + radius * end.cos(), center[1] + radius * end.sin(), self.at[2] + rise];
        let arc = Arc {
            plane: Plane::Xy,
            center_mm: center,
            radius_from_mm: radius,
            radius_to_mm: radius,
            angle_from_rad: angle,
            sweep_rad: sweep,
        };
        self.add(to, Some(5.0), Curve::Arc(arc))
    }

    pub fn event(mut self, text: &str) -> Self {
        self.line += 1;
        let kind: EventKind = text.parse().expect("an event");
        self.path.push(PathItem::Event(Event { line: self.line, kind }));
        self
    }
}

/// A path with lines in all directions, a rapid, arcs, a full circle and a helix.
pub fn drawing() -> Vec<PathItem> {
    Drawing::new()
        .event("M3 S1200")
        .rapid([4.0, 3.0, 0.0])
        .line([0.0, 0.0, -5.0])
        .line([10.0, 2.0, 0.0])
        .arc(5.0, -FRAC_PI_2, FRAC_PI_2, 0.0)
        .arc(3.0, 0.3, TAU, 0.0)
        .event("G4 P0.5")
        .line([-7.0, 1.0, 2.0])
        .line([-3.0, 0.0, 0.0])
        .arc(6.0, PI, -2.5 * PI, 3.0)
        .line([0.0, -1.0, 0.0])
        .event("M30")
        .path
}

/// Steps along each segment by a trapezoid of speed that rests at both ends.
pub fn steps(machine: &Machine, path: &[PathItem]) -> Vec<Command> {
    const ACCEL_MM_S2: f64 = 40.0;
    let mut at = machine.nearest_steps(&machine.work_zero_mm);
    let mut job = Vec::new();
    let mut ticks_in_buffer = 0;
    let mut buffer = 0;
    for item in path {
        let segment = match item {
            PathItem::Event(event) => {
                job.push(Command::Event(event.clone()));
                continue;
            }
            PathItem::Segment(segment) => segment,
        };
        let length = segment.length_mm();
        let speed = segment.feed_mm_s.unwrap_or(15.0).min((ACCEL_MM_S2 * length).sqrt());
        let ramp_s = speed / ACCEL_MM_S2;
        let total_s = length / speed + ramp_s;
        let along = |t: f64| {
            let ramp = |t: f64| 0.5 * ACCEL_MM_S2 * t * t;
            if t < ramp_s {
                ramp(t)
            } else if t < total_s - ramp_s {
                speed * (t - 0.5 * ramp_s)
            } else {
                length - ramp((total_s - t).max(0.0))
            }
        };
        let ticks = (total_s / machine.bus.tick_s()).ceil() as u32;
        if ticks_in_buffer + ticks > 1496 {
            (buffer, ticks_in_buffer) = (buffer + 1, 0);
        }
        ticks_in_buffer += ticks;
        for tick in 1..=ticks {
            let share = along(f64::from(tick) * machine.bus.tick_s()) / length;
            let point = segment.point_at(if tick == ticks { 1.0 } else { share });
            let next = machine.nearest_steps(&point);
            let counts = AxisMap::from_fn(|axis| (next[axis] - at[axis]) as i32);
            job.push(Command::Tick(Tick { buffer, line: segment.line, counts }));
            at = next;
        }
    }
    job
}
