//! What no motion with limited jerk can beat. Nothing of the planner is used.
//!
//! ```text
//!  v ┤     .-"-.    fastest      The speeds of constant accelerations ([`plane`]) are never exceeded. Where
//!    │    / ,-. \     .--.       they have a valley, the acceleration along the path has one value, α: what
//!    │   / /   \ \   / ,. \      is left behind it is no faster than c + α·t + j·t²/2, as long as that is
//!    │  /u/     \w\ / /  \ \     below the greatest acceleration, and the same backwards. Between both climbs
//!    │ / /       \ V /    \ \    u and w no speed is above the arc -j that touches them. Over a hump so
//!  0 ┼─────────────c─────────    much time, at least; over all humps the least sum, over all α.
//! ```
//!
//! Each step makes it less, never more: speeds at valleys are the greatest; limits of a hump are the
//! loosest on it; α is anything in its class, on either side.

use cnc::base::Machine;
use cnc::path::{Rates, Segment};

use crate::plane::{self, Sample};

/// A valley is lower than what is to its sides by this share.
const DEEP: f64 = 1e-3;

/// Classes of accelerations in a valley.
const CLASSES: usize = 24;

/// Places behind a valley up to which climbs are looked at.
const PLACES: usize = 12;

/// Halvings of a range of times.
const HALVINGS: u32 = 20;

/// Arcs between two climbs that are tried.
const ARCS: u32 = 12;

/// A place of the path.
struct Place {
    at_mm: f64,
    /// When it is reached with constant accelerations.
    at_s: f64,
    speed_mm_s: f64,
    limits: Limits,
}

/// The greatest speed, acceleration and jerk along the path.
#[derive(Clone, Copy)]
struct Limits {
    speed_mm_s: f64,
    accel_mm_s2: f64,
    jerk_mm_s3: f64,
}

impl Limits {
    fn loosest(self, other: Limits) -> Limits {
        Limits {
            speed_mm_s: self.speed_mm_s.max(other.speed_mm_s),
            accel_mm_s2: self.accel_mm_s2.max(other.accel_mm_s2),
            jerk_mm_s3: self.jerk_mm_s3.max(other.jerk_mm_s3),
        }
    }
}

fn limits(sample: &Sample, machine: &Machine) -> Limits {
    let Rates { tangent, bend_per_mm } = &sample.rates;
    let (mut accel_mm_s2, mut jerk_mm_s3) = (f64::INFINITY, f64::INFINITY);
    for profile in &machine.axes {
        let rate = tangent[profile.axis].abs();
        if rate > 0.0 {
            // A bend may help one axis: x''·v² against x'·a.
            let across = bend_per_mm[profile.axis].abs() * sample.limit_sq;
            accel_mm_s2 = accel_mm_s2.min((profile.accel_max_mm_s2 + across) / rate);
            jerk_mm_s3 = jerk_mm_s3.min(profile.jerk_max_mm_s3.unwrap() / rate);
        }
    }
    Limits { speed_mm_s: sample.limit_sq.sqrt(), accel_mm_s2, jerk_mm_s3 }
}

fn places(segments: &[Segment], machine: &Machine) -> Vec<Place> {
    let samples = plane::fastest(segments, machine);
    let (mut at_mm, mut at_s) = (0.0, 0.0);
    let mut places = Vec::with_capacity(samples.len());
    for (k, sample) in samples.iter().enumerate() {
        if k > 0 {
            at_mm += samples[k - 1].way_mm;
            at_s += plane::time_s(&samples[k - 1..=k]);
        }
        let limits = limits(sample, machine);
        places.push(Place { at_mm, at_s, speed_mm_s: limits.speed_mm_s, limits });
    }
    places
}

/// Numbers of the places where a valley begins or ends, the ends of the path included.
fn valleys(places: &[Place]) -> Vec<usize> {
    let speed = |k: usize| places[k].speed_mm_s;
    let (mut valleys, mut lowest, mut highest, mut falls) = (vec![0], 0, 0, false);
    for k in 1..places.len() {
        if falls && speed(k) < speed(lowest) {
            lowest = k;
        } else if falls && speed(k) > speed(lowest) * (1.0 + DEEP) {
            let is_valley = |k: &usize| speed(*k) <= speed(lowest) * (1.0 + DEEP);
            let first = (0..=lowest).rev().take_while(is_valley).last().unwrap_or(lowest);
            let last = (lowest..k).take_while(is_valley).last().unwrap_or(lowest);
            valleys.extend([first, last]);
            (falls, highest) = (false, k);
        } else if !falls && speed(k) > speed(highest) {
            highest = k;
        } else if !falls && speed(k) < speed(highest) * (1.0 - DEEP) {
            (falls, lowest) = (true, k);
        }
    }
    valleys.push(places.len() - 1);
    valleys.dedup();
    valleys
}

/// Speeding up from a valley as fast as can be.
#[derive(Clone, Copy)]
struct Climb {
    speed_mm_s: f64,
    accel_mm_s2: f64,
    limits: Limits,
}

impl Climb {
    /// How long the acceleration grows.
    fn grows_s(&self) -> f64 {
        ((self.limits.accel_mm_s2 - self.accel_mm_s2) / self.limits.jerk_mm_s3).max(0.0)
    }

    /// Way and speed after a time.
    fn after(&self, time_s: f64) -> (f64, f64) {
        let grow_s = self.grows_s().min(time_s);
        let (v, a, j) = (self.speed_mm_s, self.accel_mm_s2, self.limits.jerk_mm_s3);
        let way_mm = (v + (0.5 * a + j / 6.0 * grow_s) * grow_s) * grow_s;
        let speed_mm_s = v + (a + 0.5 * j * grow_s) * grow_s;
        let (rest_s, a) = (time_s - grow_s, a + j * grow_s);
        (way_mm + (speed_mm_s + 0.5 * a * rest_s) * rest_s, speed_mm_s + a * rest_s)
    }

    /// When it has a speed.
    fn reaches_s(&self, speed_mm_s: f64) -> f64 {
        first(|time_s| self.after(time_s).1 >= speed_mm_s)
    }

    /// How long a way takes at least, if no speed is above the limit.
    fn over_s(&self, way_mm: f64) -> f64 {
        let top_s = self.reaches_s(self.limits.speed_mm_s);
        let top_mm = self.after(top_s).0;
        if top_mm < way_mm {
            return top_s + (way_mm - top_mm) / self.limits.speed_mm_s;
        }
        first(|time_s| self.after(time_s).0 >= way_mm)
    }
}

/// The first time at which something is so, from when on it stays so.
fn first(is_so: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, 1e-3);
    while !is_so(high) && high < 1e6 {
        (low, high) = (high, 2.0 * high);
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        *if is_so(middle) { &mut high } else { &mut low } = middle;
    }
    low
}

/// No way in a time is longer than this, between two climbs.
fn way_max_mm(time_s: f64, [u, w]: &[Climb; 2]) -> f64 {
    let limits = u.limits;
    // Where the climbs meet.
    let (mut low_s, mut high_s) = (0.0, time_s);
    for _ in 0..HALVINGS {
        let middle_s = 0.5 * (low_s + high_s);
        let below = u.after(middle_s).1 < w.after(time_s - middle_s).1;
        *if below { &mut low_s } else { &mut high_s } = middle_s;
    }
    let (up_s, down_s) = (low_s, time_s - low_s);
    let mut most_mm = u.after(up_s).0 + w.after(down_s).0;
    if u.after(up_s).1 > limits.speed_mm_s {
        let tops_s = [u, w].map(|climb| climb.reaches_s(limits.speed_mm_s));
        let ways_mm = u.after(tops_s[0]).0 + w.after(tops_s[1]).0;
        most_mm = most_mm.min(ways_mm + (time_s - tops_s[0] - tops_s[1]) * limits.speed_mm_s);
    }
    // An arc -j over 2·half lies above its chord by j·(2·half)³/12 in all.
    for k in 1..=ARCS {
        let half_s = up_s.min(down_s) * f64::from(k) / f64::from(ARCS);
        let (up_mm, up_mm_s) = u.after(up_s - half_s);
        let (down_mm, down_mm_s) = w.after(down_s - half_s);
        let arc_mm = limits.jerk_mm_s3 * (2.0 * half_s).powi(3) / 12.0;
        most_mm = most_mm.min(up_mm + down_mm + (up_mm_s + down_mm_s) * half_s + arc_mm);
    }
    most_mm
}

/// What is lost behind a valley against constant accelerations, at least, up to the hump's top.
fn lost_s<'a>(behind: impl Iterator<Item = &'a Place>, accel_mm_s2: f64) -> f64 {
    let mut behind = behind.peekable();
    let Some(valley) = behind.peek().copied() else { return 0.0 };
    let places: Vec<&Place> = behind.collect();
    let (mut limits, mut lost_s) = (valley.limits, 0.0_f64);
    let every = places.len().div_ceil(PLACES);
    for (k, place) in places.iter().enumerate() {
        limits = limits.loosest(place.limits);
        if k > 0 && (k % every == 0 || k + 1 == places.len()) {
            let climb = Climb { speed_mm_s: valley.speed_mm_s, accel_mm_s2, limits };
            let way_mm = (place.at_mm - valley.at_mm).abs();
            lost_s = lost_s.max(climb.over_s(way_mm) - (place.at_s - valley.at_s).abs());
        }
    }
    lost_s
}

/// The greatest and least accelerations of the classes in a valley; at rest there is none.
fn classes(place: &Place) -> Vec<[f64; 2]> {
    if place.speed_mm_s == 0.0 {
        return vec![[0.0; 2]];
    }
    // Narrow about zero, where the least sum mostly is.
    let accel = |k: usize| {
        let share = 2.0 * k as f64 / CLASSES as f64 - 1.0;
        place.limits.accel_mm_s2 * share * share.abs()
    };
    (0..CLASSES).map(|k| [accel(k), accel(k + 1)]).collect()
}

/// The least sums up to the end of a hump, by the class of acceleration there, from those up to its start.
fn over(hump: &[Place], sums_s: &[f64]) -> Vec<f64> {
    let (start, end) = (&hump[0], &hump[hump.len() - 1]);
    let limits = hump.iter().fold(start.limits, |most, place| most.loosest(place.limits));
    let [length_mm, floor_s] = [end.at_mm - start.at_mm, end.at_s - start.at_s];
    let speed = |k: &usize| hump[*k].speed_mm_s;
    let top = (0..hump.len()).max_by(|a, b| speed(a).total_cmp(&speed(b))).unwrap_or(0);
    let climb =
        |place: &Place, accel_mm_s2| Climb { speed_mm_s: place.speed_mm_s, accel_mm_s2, limits };
    let up = |class: &[f64; 2]| (climb(start, class[1]), lost_s(hump[..=top].iter(), class[1]));
    let ups: Vec<_> = classes(start).iter().map(up).collect();
    let least_s = |class: &[f64; 2]| {
        let down = climb(end, -class[0]);
        let down_lost_s = lost_s(hump[top..].iter().rev(), -class[0]);
        let mut best_s = f64::INFINITY;
        for ((up, up_lost_s), sum_s) in ups.iter().zip(sums_s) {
            let change_s = (class[0] - up.accel_mm_s2) / limits.jerk_mm_s3;
            let floor_s = (floor_s + up_lost_s + down_lost_s).max(change_s);
            let is_enough = |time_s| way_max_mm(time_s, &[*up, down]) >= length_mm;
            if sum_s + floor_s >= best_s || best_s < f64::INFINITY && !is_enough(best_s - sum_s) {
                continue;
            }
            let is_floor = is_enough(floor_s);
            let more_s = if is_floor { 0.0 } else { first(|more_s| is_enough(floor_s + more_s)) };
            best_s = best_s.min(sum_s + floor_s + more_s);
        }
        best_s
    };
    classes(end).iter().map(least_s).collect()
}

/// The least sum.
pub fn least_s(segments: &[Segment], machine: &Machine) -> f64 {
    let places = places(segments, machine);
    let humps = valleys(&places);
    let humps = humps.windows(2).map(|pair| &places[pair[0]..=pair[1]]);
    let sums_s = humps.fold(vec![0.0], |sums_s, hump| over(hump, &sums_s));
    sums_s.into_iter().fold(f64::INFINITY, f64::min)
}
