//! The greatest speeds with constant accelerations, found another way: by integrating u = v² forwards and
//! backwards over thousands of points of the path, with no pieces, no windows and no closed forms.
//! Nothing of the planner is used.

use cnc::base::{Axis, Machine, Point};
use cnc::path::{Curve, Rates, Segment};

/// Points over the whole path.
const POINTS: usize = 60_000;

/// Points of a segment at least.
const POINTS_MIN: usize = 100;

/// Share of an axis's jerk that turning may take.
const TURN_SHARE: f64 = 0.5;

/// The same of turning and of bends under acceleration, 3·x''·v·a, together.
const BEND_SHARE: f64 = 0.75;

/// A point of the path.
pub struct Sample {
    /// The way to the next.
    pub way_mm: f64,
    /// Square of the greatest speed: in the end what is found, from what its own place allows.
    pub limit_sq: f64,
    /// How position changes there.
    pub rates: Rates,
}

/// The rules: an axis's speed, the steps that its node makes in a tick, its acceleration across a
/// curve, and if it has a limit on jerk, what of that κ²·v³ may take; in a corner its step of speed,
/// v²·|Δt|/L against its acceleration, and what is shared with corners so near that verify's widest window
/// holds both.
fn samples(segments: &[Segment], machine: &Machine) -> Vec<Sample> {
    let total_mm: f64 = segments.iter().map(Segment::length_mm).sum();
    let tick_s = f64::from(machine.bus.tick_us) * 1e-6;
    let mut samples: Vec<Sample> = Vec::new();
    let pairs = segments.windows(2);
    let met: Vec<Met> = pairs.map(|pair| Met::of(&pair[0], &pair[1], machine)).collect();
    for (number, segment) in segments.iter().enumerate() {
        let begins = number.checked_sub(1).map(|before| &met[before]);
        let bends = [begins, met.get(number)].map(|met| met.map_or(Point::ZERO, |met| met.bend));
        let is_line = segment.curve == Curve::Line;
        let length_mm = segment.length_mm();
        let count = ((POINTS as f64 * length_mm / total_mm) as usize).max(POINTS_MIN);
        for k in 0..=count {
            let share = k as f64 / count as f64;
            let mut rates = segment.rates_at(share);
            for axis in Axis::LINEAR.into_iter().filter(|_| is_line) {
                rates.bend_per_mm[axis] = bends[0][axis] * (1.0 - share) + bends[1][axis] * share;
            }
            let mut limit_sq = segment.feed_mm_s.unwrap_or(f64::INFINITY).powi(2);
            let bend_sq = bend_sq(&rates);
            for profile in &machine.axes {
                let (rate, bend) = (rates.tangent[profile.axis], rates.bend_per_mm[profile.axis]);
                let count_mm_s =
                    f64::from(machine.count_max(profile)) / tick_s / profile.steps_per_mm;
                let speed_mm_s = profile.speed_max_mm_s.min(count_mm_s);
                limit_sq = limit_sq.min((speed_mm_s / rate).powi(2));
                limit_sq = limit_sq.min(profile.accel_max_mm_s2 / bend.abs());
                if let Some(jerk_mm_s3) = profile.jerk_max_mm_s3 {
                    let turning_mm_s = (TURN_SHARE * jerk_mm_s3 / (bend_sq * rate.abs())).cbrt();
                    limit_sq = limit_sq.min(turning_mm_s.powi(2));
                }
            }
            if let Some(met) = begins.filter(|_| k == 0) {
                limit_sq = limit_sq.min(met.limit_sq);
            }
            let way_mm = if k < count { length_mm / count as f64 } else { 0.0 };
            samples.push(Sample { way_mm, limit_sq, rates });
        }
    }
    samples
}

/// Where two segments meet.
struct Met {
    /// Square of the greatest speed.
    limit_sq: f64,
    /// In a chopped curve, how much it bends.
    bend: Point,
}

impl Met {
    /// Of two segments.
    fn of(before: &Segment, after: &Segment, machine: &Machine) -> Met {
        let [end, start] = [before.rates_at(1.0), after.rates_at(0.0)];
        let tick_s = f64::from(machine.bus.tick_us) * 1e-6;
        let lengths = [before.length_mm(), after.length_mm()];
        let (short_mm, long_mm) = (lengths[0].min(lengths[1]), lengths[0].max(lengths[1]));
        let mean_mm = 0.5 * (short_mm + long_mm);
        let feed = |segment: &Segment| segment.feed_mm_s.unwrap_or(f64::INFINITY);
        let mut top_mm_s = feed(before).min(feed(after));
        let (mut jump_mm_s, mut bend) = (f64::INFINITY, Point::ZERO);
        for profile in &machine.axes {
            let axis = profile.axis;
            let turn = start.tangent[axis] - end.tangent[axis];
            if turn.abs() > 1e-9 {
                let step = profile.start_speed_mm_s.max(profile.accel_max_mm_s2 * tick_s);
                let spread_sq = profile.accel_max_mm_s2 * mean_mm / turn.abs();
                jump_mm_s = jump_mm_s.min(step / turn.abs()).min(spread_sq.sqrt());
                for rates in [&end, &start] {
                    top_mm_s = top_mm_s.min(profile.speed_max_mm_s / rates.tangent[axis].abs());
                }
                bend[axis] = turn / mean_mm;
            }
        }
        let window_mm = 20.0 * tick_s * jump_mm_s.min(top_mm_s);
        let (share, is_curve) = match (short_mm < window_mm, long_mm < window_mm) {
            (false, _) => (1.0, false),
            (true, false) => (0.5, false),
            (true, true) => (mean_mm / long_mm, true),
        };
        let alone_mm_s = jump_mm_s.min(short_mm / (20.0 * tick_s));
        let speed_mm_s = if share < 1.0 { alone_mm_s.max(share * jump_mm_s) } else { jump_mm_s };
        let speed_mm_s = speed_mm_s.min(tick_speed_mm_s(&end, &start, machine));
        Met { limit_sq: speed_mm_s.powi(2), bend: if is_curve { bend } else { Point::ZERO } }
    }
}

/// A tick that holds a corner in its middle goes a chord: off by a quarter of its way times the angle.
/// Half a tick before and after, the machine brakes and speeds up: by a·T²/4 in all, or by no more than j·T³/12 where
/// jerk is limited.
fn tick_speed_mm_s(a: &Rates, b: &Rates, machine: &Machine) -> f64 {
    let cosine: f64 = Axis::LINEAR.iter().map(|axis| a.tangent[*axis] * b.tangent[*axis]).sum();
    let turn_rad = cosine.clamp(-1.0, 1.0).acos();
    let tick_s = f64::from(machine.bus.tick_us) * 1e-6;
    if turn_rad < 1e-6 {
        return f64::INFINITY;
    }
    let accel = |rates: &Rates| accel_mm_s2(rates, 0.0, 1.0, machine);
    let jerk = |rates: &Rates| {
        let jerks = machine.axes.iter().filter_map(|profile| {
            let rate = rates.tangent[profile.axis].abs();
            Some(profile.jerk_max_mm_s3.filter(|_| rate > 0.0)? / rate)
        });
        jerks.fold(f64::INFINITY, f64::min)
    };
    let by_accel_mm = 0.25 * accel(a).max(accel(b)) * tick_s * tick_s;
    let gain_mm = by_accel_mm.min(jerk(a).max(jerk(b)) * tick_s.powi(3) / 12.0);
    ((4.0 * machine.path_tolerance_mm / turn_rad - gain_mm) / tick_s).max(0.0)
}

fn bend_sq(rates: &Rates) -> f64 {
    Axis::LINEAR.iter().map(|axis| rates.bend_per_mm[*axis].powi(2)).sum()
}

/// The greatest acceleration (sign 1) or braking (sign -1) at a speed.
fn accel_mm_s2(rates: &Rates, speed_sq: f64, sign: f64, machine: &Machine) -> f64 {
    let mut least = f64::INFINITY;
    for profile in &machine.axes {
        let (rate, bend) = (sign * rates.tangent[profile.axis], rates.bend_per_mm[profile.axis]);
        if rate != 0.0 {
            let across = bend * speed_sq * rate.signum();
            least = least.min((profile.accel_max_mm_s2 - across) / rate.abs());
        }
        if let Some(jerk_mm_s3) = profile.jerk_max_mm_s3 {
            let speed_mm_s = speed_sq.sqrt();
            let turning_mm_s3 = bend_sq(rates) * rate.abs() * speed_sq * speed_mm_s;
            let left_mm_s3 = BEND_SHARE * jerk_mm_s3 - turning_mm_s3;
            least = least.min(left_mm_s3 / (3.0 * bend.abs() * speed_mm_s));
        }
    }
    least.max(0.0)
}

/// From rest to rest, the greatest speeds that any motion has anywhere.
pub fn fastest(segments: &[Segment], machine: &Machine) -> Vec<Sample> {
    let mut samples = samples(segments, machine);
    let last = samples.len() - 1;
    (samples[0].limit_sq, samples[last].limit_sq) = (0.0, 0.0);
    for k in (0..last).rev() {
        let exit_sq = samples[k + 1].limit_sq;
        let accel = accel_mm_s2(&samples[k].rates, exit_sq, -1.0, machine);
        let entry_sq = exit_sq + 2.0 * accel * samples[k].way_mm;
        samples[k].limit_sq = samples[k].limit_sq.min(entry_sq);
    }
    for k in 0..last {
        let entry_sq = samples[k].limit_sq;
        let accel = accel_mm_s2(&samples[k].rates, entry_sq, 1.0, machine);
        let exit_sq = entry_sq + 2.0 * accel * samples[k].way_mm;
        samples[k + 1].limit_sq = samples[k + 1].limit_sq.min(exit_sq);
    }
    samples
}

/// How long it takes from one sample to the next.
pub fn time_s(pair: &[Sample]) -> f64 {
    let ends_mm_s = pair[0].limit_sq.sqrt() + pair[1].limit_sq.sqrt();
    if pair[0].way_mm > 0.0 { 2.0 * pair[0].way_mm / ends_mm_s } else { 0.0 }
}
