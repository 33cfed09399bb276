//! The seed's own encoder, for comparison (seed 004, appendix D: `prepareData`, `addtoQueue`).
//!
//! Each move's speed is rounded to whole counts in 100 ms, axis by axis; what is left over goes
//! into the first tick; shorter axes are padded with zeros. So short moves vanish, axes come out
//! of step, and the clamp at 127 bends fast moves. Never what a machine should be sent.
//!
//! Where the listing divides by zero (a speed that rounds to no count at all) one count a tick is
//! taken. Arcs, and splines likewise, are run as chords of one tick (eq. 6.1 and 6.2) by the rotation of eq. 6.8.

use crate::base::{Axis, AxisMap, Command, Machine, Tick};
use crate::path::{Curve, PathItem, Segment};

/// The period that the listing computes counts for.
pub const TICK_US: u32 = 100_000;

/// Counts in 100 ms for each mm/s: the listing's 1000/6 for each m/min, at 0.01 mm a step.
fn counts_a_tick(speed_mm_s: f64, steps_per_mm: f64) -> f64 {
    speed_mm_s * steps_per_mm * f64::from(TICK_US) * 1e-6
}

/// The largest magnitude that the listing's bytes hold.
const COUNT_MAX: f64 = 127.0;

/// Encodes a path as the seed's host library would; errors of the source pass through.
pub fn encode<'m, E: 'm>(
    path: impl Iterator<Item = Result<PathItem, E>> + 'm,
    machine: &'m Machine,
) -> impl Iterator<Item = Result<Command, E>> + 'm {
    let mut done = 0_u32;
    path.flat_map(move |item| {
        let commands = match item {
            Err(error) => vec![Err(error)],
            Ok(PathItem::Event(event)) => vec![Ok(Command::Event(event))],
            Ok(PathItem::Segment(segment)) => {
                let counts = segment_counts(&segment, machine);
                let tick = |counts| {
                    let buffer = done / machine.bus.buffer_ticks;
                    done += 1;
                    Ok(Command::Tick(Tick { buffer, line: segment.line, counts }))
                };
                counts.into_iter().map(tick).collect()
            }
        };
        commands.into_iter()
    })
}

/// A segment as the moves that the listing makes of it.
fn segment_counts(segment: &Segment, machine: &Machine) -> Vec<AxisMap<i32>> {
    let mut counts = Vec::new();
    match (segment.feed_mm_s, &segment.curve) {
        (None, _) => {
            // A rapid: each axis at its own greatest speed (section 6.5.1).
            let speeds = AxisMap::from_fn(|axis| {
                machine.axis(axis).map_or(0.0, |profile| profile.speed_max_mm_s)
            });
            add_to_queue(&mut counts, &change(segment, 0.0, 1.0), &speeds, machine);
        }
        (Some(feed_mm_s), Curve::Line) => {
            add_move(&mut counts, &change(segment, 0.0, 1.0), feed_mm_s, machine);
        }
        (Some(feed_mm_s), Curve::Arc(_) | Curve::Spline(_)) => {
            let ticks = segment.length_mm() / feed_mm_s / (f64::from(TICK_US) * 1e-6);
            let chords = ticks.trunc().max(1.0);
            let mut k = 0.0;
            while k < chords {
                let chord = change(segment, k / chords, (k + 1.0) / chords);
                add_move(&mut counts, &chord, feed_mm_s, machine);
                k += 1.0;
            }
        }
    }
    counts
}

fn change(segment: &Segment, share_from: f64, share_to: f64) -> AxisMap<f64> {
    let (from, to) = (segment.point_at(share_from), segment.point_at(share_to));
    AxisMap::from_fn(|axis| to[axis] - from[axis])
}

/// `addtoQueue`: shares the feed among the axes.
fn add_move(
    counts: &mut Vec<AxisMap<i32>>,
    change_mm: &AxisMap<f64>,
    feed_mm_s: f64,
    machine: &Machine,
) {
    let length_mm = change_mm.0.iter().map(|d| d * d).sum::<f64>().sqrt();
    if length_mm > 0.0 {
        let speeds = AxisMap::from_fn(|axis| change_mm[axis] / length_mm * feed_mm_s);
        add_to_queue(counts, change_mm, &speeds, machine);
    }
}

/// Appends every axis's counts; axes that are done earlier wait.
fn add_to_queue(
    counts: &mut Vec<AxisMap<i32>>,
    change_mm: &AxisMap<f64>,
    speeds_mm_s: &AxisMap<f64>,
    machine: &Machine,
) {
    let start = counts.len();
    for profile in &machine.axes {
        let axis: Axis = profile.axis;
        let speed = counts_a_tick(speeds_mm_s[axis].abs(), profile.steps_per_mm);
        let data = prepare_data(change_mm[axis] * profile.steps_per_mm, speed);
        for (at, count) in data.enumerate() {
            if counts.len() <= start + at {
                counts.push(AxisMap::default());
            }
            counts[start + at][axis] = count;
        }
    }
}

/// `prepareData`: one axis's way in steps at a speed in counts a tick. The remainder comes first.
fn prepare_data(way: f64, speed: f64) -> impl Iterator<Item = i32> {
    let count = speed.round_ties_even().clamp(1.0, COUNT_MAX);
    let ticks = (way / count).abs();
    let remainder = (ticks - ticks.trunc()) * count;
    let signed = |count: f64| count.round_ties_even().copysign(way) as i32;
    let whole = if way == 0.0 { 0 } else { ticks.trunc() as usize };
    std::iter::once(signed(remainder)).chain(std::iter::repeat_n(signed(count), whole))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::{Plane, Point};
    use crate::path::Arc;
    use std::convert::Infallible;
    use std::f64::consts::TAU;

    /// Position after each tick of segments run one after the other, in steps.
    fn run(segments: Vec<Segment>) -> Vec<[i32; 2]> {
        let machine = Machine::load("starmill").unwrap();
        let path = segments.into_iter().map(|s| Ok::<_, Infallible>(PathItem::from(s)));
        let mut at = [0, 0];
        let mut positions = Vec::new();
        for command in encode(path, &machine) {
            let Ok(Command::Tick(tick)) = command else { panic!("a tick") };
            at = [at[0] + tick.counts[Axis::X], at[1] + tick.counts[Axis::Y]];
            positions.push(at);
        }
        positions
    }

    fn line(x: f64, y: f64, feed_mm_s: f64) -> Segment {
        let mut to_mm = Point::ZERO;
        (to_mm[Axis::X], to_mm[Axis::Y]) = (x, y);
        let from_mm = Point::ZERO;
        let (curve, corner) = (Curve::Line, Default::default());
        Segment { line: 1, feed_mm_s: Some(feed_mm_s), from_mm, to_mm, curve, corner }
    }

    #[test]
    fn short_moves_lose_what_does_not_fill_a_step() {
        // 1000 moves of 0.014 mm: 4.0 mm short.
        let end = run(vec![line(0.014, 0.0, 5.0); 1000]).pop().unwrap();
        assert_eq!(end, [1000, 0]);
    }

    #[test]
    fn a_fast_move_leaves_its_line() {
        // 70 x 20 mm at 1.2 m/min: the clamp at 127 takes it 6.6 mm off.
        let off_mm = |[x, y]: [i32; 2]| (f64::from(x) * 20.0 - f64::from(y) * 70.0).abs() / 7280.1;
        let positions = run(vec![line(70.0, 20.0, 20.0)]);
        let worst_mm = positions.iter().copied().map(off_mm).fold(0.0, f64::max);
        assert!((worst_mm - 6.6).abs() < 0.1, "{worst_mm}");
        assert_eq!(positions.last(), Some(&[7000, 2000]));
    }

    #[test]
    fn a_circle_does_not_close() {
        let mut circle = line(0.0, 0.0, 5.0);
        circle.curve = Curve::Arc(Arc {
            plane: Plane::Xy,
            center_mm: [-20.0, 0.0],
            radius_from_mm: 20.0,
            radius_to_mm: 20.0,
            angle_from_rad: 0.0,
            sweep_rad: TAU,
        });
        // R 20 mm at 0.3 m/min: 251 chords of one tick each (eq. 6.2).
        assert_eq!(run(vec![circle]).pop(), Some([0, -6]));
    }
}
