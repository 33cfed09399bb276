//! The least time with limited jerk, found another way: by dynamic programming over places, speeds and
//! accelerations. From rest at both ends, at each of some hundred places, of all motions that come by
//! with about the same speed and acceleration the earliest is kept, exactly; from place to place the
//! jerk is the greatest, the least, or none. Where both halves meet, their times add up. Nothing
//! of the planner is used.

use std::collections::HashMap;

use cnc::base::{Axis, Machine};
use cnc::path::{Rates, Segment};

use crate::plane::Met;

/// Places of the path; of each segment at least, if these are few.
const PLACES: usize = 200;
const PLACES_MIN: usize = 12;
const FEW: usize = 100;
/// Classes of speeds and of accelerations that are told apart.
const SPEEDS: f64 = 100.0;
const ACCELS: f64 = 16.0;

/// A place: where, how position changes before and after it, and the greatest speed there.
struct Place {
    at_mm: f64,
    rates: Rates,
    speed_mm_s: f64,
}

#[derive(Clone, Copy)]
struct Motion {
    time_s: f64,
    speed: f64,
    accel: f64,
}

/// The places lie closer to each other near the ends, where the machine is slow; on a path of few
/// segments near the ends of each, where limits change.
fn places(segments: &[Segment], machine: &Machine) -> Vec<Place> {
    let total_mm: f64 = segments.iter().map(Segment::length_mm).sum();
    let mut joints = vec![];
    let mut end_mm = 0.0;
    for segment in segments {
        end_mm += segment.length_mm();
        joints.push(end_mm);
    }
    let ends = if segments.len() <= FEW { joints.clone() } else { vec![total_mm] };
    let mut marks = vec![0.0];
    let mut start_mm = 0.0;
    let count = (PLACES / ends.len()).max(PLACES_MIN);
    for end_mm in ends {
        for k in 1..count {
            let share = k as f64 / count as f64;
            let near = 2.0 * share.min(1.0 - share).powi(2);
            let share = if share < 0.5 { near } else { 1.0 - near };
            marks.push(start_mm + (end_mm - start_mm) * share);
        }
        start_mm = end_mm;
    }
    marks.retain(|mark| joints.iter().all(|joint| (joint - mark).abs() > 1e-6));
    marks.extend(&joints);
    marks.sort_by(f64::total_cmp);
    marks.dedup();
    marks.iter().map(|mark| place(*mark, segments, &joints, machine)).collect()
}

fn place(at_mm: f64, segments: &[Segment], joints: &[f64], machine: &Machine) -> Place {
    let i = joints.partition_point(|joint| *joint < at_mm - 1e-9).min(segments.len() - 1);
    let segment = &segments[i];
    let share = 1.0 - (joints[i] - at_mm) / segment.length_mm();
    let rates = segment.rates_at(share);
    let mut speed = speed_max(&rates, segment, machine);
    let next = segments.get(i + 1).filter(|_| (joints[i] - at_mm).abs() < 1e-9);
    if let Some(next) = next {
        let after = next.rates_at(0.0);
        let mean_mm = 0.5 * (segment.length_mm() + next.length_mm());
        speed = speed
            .min(speed_max(&after, next, machine))
            .min(corner(&rates, &after, mean_mm, machine))
            .min(Met::of(segment, next, machine).limit_sq.sqrt());
    }
    Place { at_mm, rates, speed_mm_s: speed }
}

fn speed_max(rates: &Rates, segment: &Segment, machine: &Machine) -> f64 {
    let bend_sq: f64 = Axis::LINEAR.iter().map(|axis| rates.bend_per_mm[*axis].powi(2)).sum();
    let mut speed = segment.feed_mm_s.unwrap_or(f64::INFINITY);
    for axis in &machine.axes {
        let (rate, bend) = (rates.tangent[axis.axis].abs(), rates.bend_per_mm[axis.axis].abs());
        let count = f64::from(machine.count_max(axis)) / axis.steps_per_mm / machine.bus.tick_s();
        speed = speed.min(axis.speed_max_mm_s.min(count) / rate);
        speed = speed.min((axis.accel_max_mm_s2 / bend).sqrt());
        // Turning takes no more than half of an axis's jerk.
        speed = speed.min((0.5 * axis.jerk_max_mm_s3.unwrap() / (bend_sq * rate)).cbrt());
    }
    speed
}

/// The rules of corners: steps of speed, bends of chopped curves, chords of ticks.
pub fn corner(a: &Rates, b: &Rates, mean_mm: f64, machine: &Machine) -> f64 {
    let tick_s = machine.bus.tick_s();
    let mut speed = f64::INFINITY;
    let (mut turn_sq, mut accel, mut turns) = (0.0, 0.0_f64, vec![]);
    for axis in &machine.axes {
        let turn = (b.tangent[axis.axis] - a.tangent[axis.axis]).abs();
        turn_sq += turn * turn;
        let step = axis.start_speed_mm_s.max(axis.accel_max_mm_s2 * tick_s);
        speed = speed.min(step / turn).min((axis.accel_max_mm_s2 * mean_mm / turn).sqrt());
        let rate = a.tangent[axis.axis].abs().max(b.tangent[axis.axis].abs());
        turns.push((rate, axis.jerk_max_mm_s3.unwrap()));
        accel = accel.max(axis.accel_max_mm_s2 * rate);
    }
    if turn_sq.sqrt() < 1e-6 {
        return f64::INFINITY;
    }
    if speed * speed >= 0.999 * machine.axes[0].accel_max_mm_s2 * mean_mm / turn_sq.sqrt() {
        for (rate, jerk) in turns {
            speed = speed.min((0.5 * jerk * mean_mm * mean_mm / (turn_sq * rate)).cbrt());
        }
    }
    let gain_mm = 0.25 * accel * tick_s * tick_s;
    speed.min(((4.0 * machine.path_tolerance_mm / turn_sq.sqrt() - gain_mm) / tick_s).max(0.0))
}

/// Acceleration (sign 1) or braking (sign -1) that the axes allow at a speed.
fn accel_max(place: &Place, speed: f64, sign: f64, machine: &Machine) -> f64 {
    let mut least = f64::INFINITY;
    for axis in &machine.axes {
        let (rate, bend) =
            (sign * place.rates.tangent[axis.axis], place.rates.bend_per_mm[axis.axis]);
        if rate != 0.0 {
            let across = bend * speed * speed * rate.signum();
            least = least.min((axis.accel_max_mm_s2 - across) / rate.abs());
        }
    }
    least.max(0.0)
}

/// How long a way takes with one jerk, by halving.
fn over(from: &Motion, jerk: f64, way_mm: f64) -> Option<Motion> {
    let way = |t: f64| (from.speed + (0.5 * from.accel + jerk / 6.0 * t) * t) * t;
    let speed = |t: f64| from.speed + (from.accel + 0.5 * jerk * t) * t;
    let mut high = way_mm / from.speed.max(1e-3 * way_mm.cbrt());
    let root = from.accel * from.accel - 2.0 * jerk * from.speed;
    if jerk < 0.0 || (from.accel < 0.0 && root > 0.0) {
        // When the speed is zero for the first time.
        let stop =
            if jerk == 0.0 { -from.speed / from.accel } else { (-from.accel - root.sqrt()) / jerk };
        if way(stop) < way_mm || stop <= 0.0 || stop.is_nan() {
            return None;
        }
        high = stop;
    }
    while way(high) < way_mm {
        high *= 2.0;
        if high > 1e3 {
            return None;
        }
    }
    let (mut low, mut t) = (0.0, 0.5 * high);
    for _ in 0..60 {
        let off = way(t) - way_mm;
        if off.abs() < 1e-12 * way_mm {
            break;
        }
        *if off > 0.0 { &mut high } else { &mut low } = t;
        let next = t - off / speed(t);
        t = if next > low && next < high { next } else { 0.5 * (low + high) };
    }
    Some(Motion { time_s: from.time_s + t, speed: speed(t), accel: from.accel + jerk * t })
}

type Kept = HashMap<(i32, i32), Motion>;

fn classes(motion: &Motion, top: f64, accel: f64) -> (i32, i32) {
    ((motion.speed / top * SPEEDS).round() as i32, (motion.accel / accel * ACCELS).round() as i32)
}

/// All that can be from rest at the first of the places to the last, with the path in this direction.
fn reach(places: &[Place], direction: f64, machine: &Machine, top: f64) -> Kept {
    let accel_top = machine.axes[0].accel_max_mm_s2;
    let mut kept: Kept = HashMap::from([((0, 0), Motion { time_s: 0.0, speed: 0.0, accel: 0.0 })]);
    for pair in places.windows(2) {
        let way_mm = (pair[1].at_mm - pair[0].at_mm).abs();
        let rates = &pair[0].rates.tangent;
        let jerks =
            machine.axes.iter().map(|axis| axis.jerk_max_mm_s3.unwrap() / rates[axis.axis].abs());
        let jerk_max = jerks.fold(f64::INFINITY, f64::min);
        let mut next = Kept::new();
        for from in kept.values() {
            for jerk in [jerk_max, 0.0, -jerk_max] {
                if from.speed == 0.0 && jerk <= 0.0 {
                    continue;
                }
                // Up to the greatest acceleration, if that comes first.
                let Some(mut to) = over(from, jerk, way_mm) else { continue };
                let most = accel_max(&pair[1], to.speed, direction, machine);
                let least = -accel_max(&pair[1], to.speed, -direction, machine);
                if to.accel > most && from.accel < most {
                    let jerk = (most - from.accel) / (to.time_s - from.time_s);
                    let Some(held) = over(from, jerk, way_mm) else { continue };
                    to = held;
                } else if to.accel < least && from.accel > least {
                    let jerk = (least - from.accel) / (to.time_s - from.time_s);
                    let Some(held) = over(from, jerk, way_mm) else { continue };
                    to = held;
                }
                let fits = to.accel <= most * 1.001 + 1.0 && to.accel >= least * 1.001 - 1.0;
                if to.speed > pair[1].speed_mm_s || !fits {
                    continue;
                }
                let best = next.entry(classes(&to, top, accel_top)).or_insert(to);
                if to.time_s < best.time_s {
                    *best = to;
                }
            }
        }
        kept = next;
    }
    kept
}

/// The least time found.
pub fn least_s(segments: &[Segment], machine: &Machine) -> f64 {
    let mut places = places(segments, machine);
    let top = places.iter().map(|place| place.speed_mm_s).fold(0.0, f64::max);
    let total_mm = places.last().map_or(0.0, |place| place.at_mm);
    let peak = (total_mm * machine.axes[0].accel_max_mm_s2 * 1.5).sqrt();
    let top = top.min(peak);
    let middle = places.iter().position(|place| place.at_mm >= 0.4 * total_mm).unwrap();
    let there = reach(&places[..=middle], 1.0, machine, top);
    places.drain(..middle);
    places.reverse();
    let back = reach(&places, -1.0, machine, top);
    let mut least = f64::INFINITY;
    for ((speed, accel), motion) in &there {
        if let Some(other) = back.get(&(*speed, -*accel)) {
            least = least.min(motion.time_s + other.time_s);
        }
    }
    least
}
