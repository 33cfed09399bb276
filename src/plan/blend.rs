//! Corners under G64 → curves: what the path gives up within its tolerance, so that the machine
//! need not slow down.
//!
//! ```text
//!   before        d        · corner                  d     both ways are cut back by so much
//!  ────────────┬───────────·                         off   d·|t₂ - t₁| / 4 between lines
//!              P0 `- .     | off                     t₁,t₂ directions along both ways
//!                     ` .  |
//!                        ` | d        B(0) = P0, B'(0) = 2d·t₁
//!                         `|          B(1) = P3, B'(1) = 2d·t₂
//!                          ┴ P3
//!                          │ after
//! ```
//!
//! The curve is the cubic with these ends (Hermite's). Between lines it is a parabola, which a
//! machine follows with one constant acceleration on each axis: in the time T = v·|t₂ - t₁| / A that
//! the axes need at least for this change of speed, over d = v·T/2. So v² = 2·d·A/|t₂ - t₁|, by the
//! axis that has least; where jerk is limited, by what turning may take of that, too. No more is cut than the
//! feed needs, never more than half of either way, and nothing where the corner as it is takes no more time.
//!
//! The curve is given in two halves, each with the line and the feed of its block. Only corners between
//! two blocks under G64 are cut; rapids, splines and ways that move other axes than X, Y and Z keep
//! theirs, and so does whatever an event lies between. This pass knows nothing of what follows the next
//! segment, and nothing of seams: where a buffer ends on a curve, it is the same curve.

use std::array;
use std::collections::VecDeque;
use std::iter::Fuse;
use std::rc::Rc;

use crate::base::axis::AXES;
use crate::base::{Axis, AxisMap, Point, Spline};
use crate::path::{Arc, Corner, Curve, MeasuredSpline, PathItem, Rates, Segment};

use super::Feed;
use super::junction::{End, Joint};
use super::limits::Limits;

/// Share of `path_tolerance_mm` that is left for the chords that ticks make of the curve.
const CHORD_SHARE: f64 = 0.5;

/// Beyond what the feed needs, for the losses of a curve that is planned in pieces.
const SPEED_MARGIN: f64 = 1.1;

/// Part of either way that a curve takes at most, unless it is exactly half: what is left is no
/// crumb.
const HALF_NEARLY: f64 = 0.49;

/// Sharper corners stay: 150 degrees. A way back would only be turned round before its end.
const CHANGE_MAX: f64 = 1.931_851_652_578_136_6;

/// Shorter curves are rounding: the directions of what is cut back hang on it.
const REACH_LEAST_MM: f64 = 1e-4;

/// An arc turns by no more within a curve, for the cubic to stay near it.
const ARC_MAX_RAD: f64 = 0.5;

/// What a curve takes longer, planned in pieces, than at the one acceleration that would do.
const PIECES_TAKE: f64 = 1.05;

/// Share of an axis's jerk for turning; the rest is for braking and speeding up in the curve.
const TURN_JERK_SHARE: f64 = 0.5;

/// Places at which a curve is held against the path. It is furthest off where the corner is, which is
/// the middle one; what lies between two of them is less than the share left for chords.
const SAMPLES: usize = 16;

/// Rounds in which a curve beside an arc is made smaller.
const ROUNDS_MAX: usize = 8;

/// A path with its corners rounded where G64 lets them be.
pub fn blended<E, I>(path: I, limits: &Limits, feed: Feed) -> Blended<I>
where
    I: Iterator<Item = Result<PathItem, E>>,
{
    let is_on = feed == Feed::LookAhead;
    let limits = limits.clone();
    Blended { path: path.fuse(), limits, is_on, before: None, ready: VecDeque::new() }
}

/// See [`blended`].
#[derive(Debug)]
pub struct Blended<I> {
    path: Fuse<I>,
    limits: Limits,
    is_on: bool,
    /// A segment whose end may become a curve.
    before: Option<Rest>,
    ready: VecDeque<PathItem>,
}

/// What is left of a segment: the way from a share of it on.
#[derive(Debug)]
struct Rest {
    segment: Rc<Segment>,
    from: f64,
}

impl<E, I: Iterator<Item = Result<PathItem, E>>> Iterator for Blended<I> {
    type Item = Result<PathItem, E>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(item) = self.ready.pop_front() {
                return Some(Ok(item));
            }
            match self.path.next() {
                Some(Ok(PathItem::Segment(segment))) => {
                    if self.before.is_none() && !self.may_end_in_curve(&segment) {
                        return Some(Ok(PathItem::Segment(segment)));
                    }
                    self.segment(segment);
                }
                Some(Ok(event)) => {
                    self.give_rest();
                    self.ready.push_back(event);
                }
                Some(Err(error)) => return Some(Err(error)),
                None => {
                    self.give_rest();
                    return self.ready.pop_front().map(Ok);
                }
            }
        }
    }
}

impl<I> Blended<I> {
    fn may_end_in_curve(&self, segment: &Segment) -> bool {
        self.is_on && may_be_cut(segment)
    }

    fn segment(&mut self, segment: Rc<Segment>) {
        let mut from = 0.0;
        let curve = self
            .before
            .as_ref()
            .filter(|_| may_be_cut(&segment))
            .and_then(|before| Turn::new(&before.segment, &segment, &self.limits)?.curve());
        match (curve, self.before.take()) {
            (Some(curve), Some(before)) => {
                from = curve.shares[1];
                self.give(&before, curve.shares[0]);
                self.ready.extend(curve.halves.map(PathItem::from));
            }
            (_, Some(before)) => self.give(&before, 1.0),
            (_, None) => {}
        }
        let rest = Rest { segment, from };
        if self.may_end_in_curve(&rest.segment) {
            self.before = Some(rest);
        } else {
            self.give(&rest, 1.0);
        }
    }

    fn give_rest(&mut self) {
        if let Some(rest) = self.before.take() {
            self.give(&rest, 1.0);
        }
    }

    fn give(&mut self, rest: &Rest, to: f64) {
        if rest.from < to {
            let whole = rest.from == 0.0 && to == 1.0;
            self.ready.push_back(if whole {
                PathItem::Segment(Rc::clone(&rest.segment))
            } else {
                part(&rest.segment, [rest.from, to]).into()
            });
        }
    }
}

/// Whether curves may take parts of a segment, at its start as at its end: under G61, or where motion is
/// bound to the spindle or to a probe, all of the way is kept.
#[inline]
fn may_be_cut(segment: &Segment) -> bool {
    if !matches!(segment.corner, Corner::Blend { .. }) {
        return false;
    }
    let rests = |axis: &Axis| segment.from_mm[*axis] == segment.to_mm[*axis];
    let others = Axis::ALL.iter().filter(|axis| !Axis::LINEAR.contains(axis));
    segment.feed_mm_s.is_some()
        && !matches!(segment.curve, Curve::Spline(_))
        && segment.length_mm() > 0.0
        && others.into_iter().all(rests)
}

/// A part of a line or arc between two shares of its way.
fn part(segment: &Segment, [from, to]: [f64; 2]) -> Segment {
    let curve = match &segment.curve {
        Curve::Arc(arc) => {
            let radius_mm =
                |share| arc.radius_from_mm + (arc.radius_to_mm - arc.radius_from_mm) * share;
            Curve::Arc(Arc {
                radius_from_mm: radius_mm(from),
                radius_to_mm: radius_mm(to),
                angle_from_rad: arc.angle_from_rad + arc.sweep_rad * from,
                sweep_rad: arc.sweep_rad * (to - from),
                ..*arc
            })
        }
        other => other.clone(),
    };
    let [from_mm, to_mm] = [segment.point_at(from), segment.point_at(to)];
    Segment { from_mm, to_mm, curve, ..*segment }
}

/// What takes the place of a corner.
#[derive(Debug)]
struct Blend {
    /// Where the segment before ends now, and the one after begins.
    shares: [f64; 2],
    /// The curve between, up to its middle and from there on.
    halves: [Segment; 2],
}

/// A corner that may be rounded.
#[derive(Debug)]
struct Turn<'a> {
    before: &'a Segment,
    after: &'a Segment,
    lengths_mm: [f64; 2],
    /// How far the curve may leave the path.
    off_max_mm: f64,
    /// |t₂ - t₁|: 2·sin of half the angle.
    change: f64,
    /// The acceleration for a change of direction: that of the axis that has least.
    change_accel_mm_s2: f64,
    /// The jerk for turning: that of the axis that has least; infinite without a limit.
    turn_jerk_mm_s3: f64,
    /// The greatest reach of the curve on either way, whatever it may cut off.
    reach_max_mm: f64,
    sides: [Side; 2],
    /// Speed in the corner as it is.
    corner_mm_s: f64,
}

/// What a segment allows at the corner.
#[derive(Clone, Copy, Debug)]
struct Side {
    speed_mm_s: f64,
    /// Along the path.
    accel_mm_s2: f64,
    /// The same of jerk; infinite without a limit.
    jerk_mm_s3: f64,
}

impl Side {
    /// What slowing down to a speed, or speeding up from it, takes longer than its way at full speed: half of the
    /// share of speed lost on average, for as long as that takes, Δv/a + a/j or 2·√(Δv/j).
    fn lost_s(&self, low_mm_s: f64) -> f64 {
        let change_mm_s = self.speed_mm_s - low_mm_s;
        let grown_mm_s = self.accel_mm_s2 * self.accel_mm_s2 / self.jerk_mm_s3;
        let time_s = if change_mm_s < grown_mm_s {
            2.0 * (change_mm_s / self.jerk_mm_s3).sqrt()
        } else {
            change_mm_s / self.accel_mm_s2 + self.accel_mm_s2 / self.jerk_mm_s3
        };
        0.5 * time_s * change_mm_s / self.speed_mm_s
    }
}

impl<'a> Turn<'a> {
    /// None where the corner needs no slowing, or is no corner but a turn back.
    fn new(before: &'a Segment, after: &'a Segment, limits: &Limits) -> Option<Turn<'a>> {
        let Corner::Blend { tolerance_mm, .. } = before.corner else { return None };
        let rates = [before.rates_at(1.0), after.rates_at(0.0)];
        let sides = [side(before, &rates[0], limits), side(after, &rates[1], limits)];
        let [end, last] = [before, after].map(|segment| {
            let end = End::last(segment, segment.length_mm());
            End { feed_mm_s: programmed_mm_s(segment), ..end }
        });
        let is_line = matches!(after.curve, Curve::Line);
        let start = if is_line { &last.tangent } else { &rates[1].tangent };
        let mut joint = Joint::REST;
        joint.join(&end, &last, start, limits);
        let junction = joint.junction;
        let tick_s = limits.tick_s;
        let tick_mm_s = 4.0 * limits.path_tolerance_mm / junction.turn.rad() / tick_s;
        let corner_mm_s = junction.speed_sq_max.sqrt().min(tick_mm_s);
        if corner_mm_s >= sides[0].speed_mm_s.min(sides[1].speed_mm_s) {
            return None;
        }
        let lengths_mm = [before.length_mm(), after.length_mm()];
        // The acceleration hardly grows in a curve on a way that is over sooner than that takes.
        let grown_s = sides.map(|side| side.accel_mm_s2 / side.jerk_mm_s3);
        if (0..2).any(|i| lengths_mm[i] < corner_mm_s * grown_s[i]) {
            return None;
        }
        let own_mm = limits.path_tolerance_mm;
        let off_mm = tolerance_mm.unwrap_or(own_mm);
        let changes = AxisMap::from_fn(|axis| rates[1].tangent[axis] - rates[0].tangent[axis]);
        let change = Axis::LINEAR.map(|axis| changes[axis].powi(2)).iter().sum::<f64>().sqrt();
        if change > CHANGE_MAX {
            return None;
        }
        let chord_mm_s2 = 8.0 * CHORD_SHARE * own_mm / (tick_s * tick_s);
        let accels = limits.axes.iter().map(|axis| axis.accel_max_mm_s2 / changes[axis.axis].abs());
        let turning = limits.axes.iter().filter(|axis| changes[axis.axis] != 0.0);
        let jerks = turning.filter_map(|axis| axis.jerk_max_mm_s3);
        let reaches = [0, 1].map(|i| (0.5 * lengths_mm[i]).min(ARC_MAX_RAD / bend(&rates[i])));
        Some(Turn {
            before,
            after,
            lengths_mm,
            off_max_mm: off_mm.min(off_mm.max(own_mm) - CHORD_SHARE * own_mm),
            change,
            change_accel_mm_s2: accels.fold(chord_mm_s2 / change, f64::min),
            turn_jerk_mm_s3: TURN_JERK_SHARE * jerks.fold(f64::INFINITY, f64::min),
            reach_max_mm: reaches[0].min(reaches[1]),
            sides,
            corner_mm_s,
        })
    }

    /// The curve, if there is one that is worth it.
    fn curve(&self) -> Option<Blend> {
        let feed_mm_s = self.sides[0].speed_mm_s.min(self.sides[1].speed_mm_s);
        let needed_mm = SPEED_MARGIN * self.reach_for_mm(feed_mm_s);
        let mut reach_mm =
            self.reach_max_mm.min(4.0 * self.off_max_mm / self.change).min(needed_mm);
        for _ in 0..ROUNDS_MAX {
            reach_mm = self.without_crumbs(reach_mm);
            if reach_mm < REACH_LEAST_MM || !self.is_worth(reach_mm, self.bend_per_mm(reach_mm)) {
                return None;
            }
            let shares = [1.0 - reach_mm / self.lengths_mm[0], reach_mm / self.lengths_mm[1]];
            let points = self.points(shares, reach_mm);
            let off_mm = self.off_mm(&points, reach_mm);
            if off_mm <= self.off_max_mm * (1.0 + 1e-9) {
                let is_worth = self.is_worth(reach_mm, sharpest_per_mm(&points));
                let halves = if is_worth { self.halves(&points)? } else { return None };
                return Some(Blend { shares, halves });
            }
            reach_mm *= 0.95 * self.off_max_mm / off_mm;
        }
        None
    }

    /// How much a curve with this reach d bends between lines, where it is sharpest:
    /// κ = |t₂ - t₁| / (2·d·cos²) of half the angle.
    fn bend_per_mm(&self, reach_mm: f64) -> f64 {
        self.change / (2.0 * reach_mm * self.cosine_sq())
    }

    /// The speed that a curve with this reach d can be run at, if it bends by so much: v² = 2·d·A/|t₂ - t₁| by
    /// acceleration, less where it is sharper than between lines, and by jerk v³ = J/κ².
    fn speed_mm_s(&self, reach_mm: f64, bend_per_mm: f64) -> f64 {
        let by_jerk_mm_s = libm::cbrt(self.turn_jerk_mm_s3 / (bend_per_mm * bend_per_mm));
        let lines = self.bend_per_mm(reach_mm) / bend_per_mm;
        (2.0 * reach_mm * self.change_accel_mm_s2 * lines).sqrt().min(by_jerk_mm_s)
    }

    /// The reach of the curve that can be run at a speed.
    fn reach_for_mm(&self, speed_mm_s: f64) -> f64 {
        let bend_per_mm = (self.turn_jerk_mm_s3 / speed_mm_s.powi(3)).sqrt();
        let by_jerk_mm = self.change / (2.0 * bend_per_mm * self.cosine_sq());
        (speed_mm_s * speed_mm_s / (2.0 * self.change_accel_mm_s2)).max(by_jerk_mm)
    }

    fn cosine_sq(&self) -> f64 {
        1.0 - 0.25 * self.change * self.change
    }

    /// A reach that takes half of a way or leaves something of it.
    fn without_crumbs(&self, reach_mm: f64) -> f64 {
        let [a, b] = self.lengths_mm;
        [a, b, a, b].into_iter().fold(reach_mm, |reach_mm, length_mm| match reach_mm / length_mm {
            share if share < 0.5 => reach_mm.min(HALF_NEARLY * length_mm),
            _ => reach_mm,
        })
    }

    /// Whether a curve with this reach and bend loses less time than the corner as it is. Against running on
    /// at the speed V, braking to v before it costs [`Side::lost_s`], and a way d at v d·(1/v - 1/V).
    fn is_worth(&self, reach_mm: f64, bend_per_mm: f64) -> bool {
        let least_mm_s = self.sides[0].speed_mm_s.min(self.sides[1].speed_mm_s);
        let curve_mm_s = self.speed_mm_s(reach_mm, bend_per_mm).min(least_mm_s);
        let lost_s = |side: Side, low_mm_s: f64, way_mm: f64| {
            side.lost_s(low_mm_s) + way_mm * (PIECES_TAKE / low_mm_s - 1.0 / side.speed_mm_s)
        };
        let sum_s = |low_mm_s, way_mm| {
            self.sides.iter().map(|side| lost_s(*side, low_mm_s, way_mm)).sum::<f64>()
        };
        // In the corner itself there is no way: 0/0 where it is a stop.
        let corner_mm_s = self.corner_mm_s.max(f64::MIN_POSITIVE);
        sum_s(curve_mm_s, reach_mm) < sum_s(corner_mm_s, 0.0)
    }

    /// The curve's control points: of the cubic whose derivatives at its ends are twice the reach.
    fn points(&self, shares: [f64; 2], reach_mm: f64) -> [Point; 4] {
        let handle_mm = 2.0 / 3.0 * reach_mm;
        let from_mm = self.before.point_at(shares[0]);
        let to_mm = self.after.point_at(shares[1]);
        let t0 = self.before.rates_at(shares[0]).tangent;
        let t1 = self.after.rates_at(shares[1]).tangent;
        [
            from_mm,
            AxisMap::from_fn(|axis| from_mm[axis] + handle_mm * t0[axis]),
            AxisMap::from_fn(|axis| to_mm[axis] - handle_mm * t1[axis]),
            to_mm,
        ]
    }

    /// How far the curve leaves the path: both are walked side by side, at the same share of their
    /// way, which is never nearer than they are.
    fn off_mm(&self, points: &[Point; 4], reach_mm: f64) -> f64 {
        let apart_mm = |k: usize| {
            let u = k as f64 / SAMPLES as f64;
            let way_mm = reach_mm * (2.0 * u - 1.0);
            let on_path = if way_mm < 0.0 {
                self.before.point_at(1.0 + way_mm / self.lengths_mm[0])
            } else {
                self.after.point_at(way_mm / self.lengths_mm[1])
            };
            let on_curve = at(points, u);
            let offset = Axis::LINEAR.map(|axis| (on_curve[axis] - on_path[axis]).powi(2));
            offset.iter().sum::<f64>().sqrt()
        };
        (1..SAMPLES).map(apart_mm).fold(0.0, f64::max)
    }

    /// The curve up to its middle, as a part of the block before, and from there on, as one of the
    /// block after (de Casteljau's construction).
    fn halves(&self, points: &[Point; 4]) -> Option<[Segment; 2]> {
        let [p0, p1, p2, p3] = points;
        let [a, b, c] = [middle(p0, p1), middle(p1, p2), middle(p2, p3)];
        let [ab, bc] = [middle(&a, &b), middle(&b, &c)];
        let half_way = middle(&ab, &bc);
        Some([
            half(self.before, [*p0, a, ab, half_way])?,
            half(self.after, [half_way, bc, c, *p3])?,
        ])
    }
}

/// The feed of a segment before the operator's override, which changes no way: so the curves are those of the
/// program's feeds.
fn programmed_mm_s(segment: &Segment) -> f64 {
    let scale = match segment.corner {
        Corner::Blend { feed_scale, .. } => feed_scale,
        Corner::Exact | Corner::Stop => 1.0,
    };
    segment.feed_mm_s.map_or(f64::INFINITY, |feed_mm_s| feed_mm_s / scale)
}

fn side(segment: &Segment, rates: &Rates, limits: &Limits) -> Side {
    let mut speed_sq = programmed_mm_s(segment).powi(2);
    let (mut accel_mm_s2, mut jerk_mm_s3) = (f64::INFINITY, f64::INFINITY);
    for limit in &limits.axes {
        let (rate, bend) = (rates.tangent[limit.axis], rates.bend_per_mm[limit.axis]);
        speed_sq = speed_sq.min((limit.speed_max_mm_s / rate).powi(2));
        speed_sq = speed_sq.min(limit.accel_max_mm_s2 / bend.abs());
        accel_mm_s2 = accel_mm_s2.min(limit.accel_max_mm_s2 / rate.abs());
        let jerks = limit.jerk_max_mm_s3.filter(|_| rate != 0.0);
        jerk_mm_s3 = jerks.map_or(jerk_mm_s3, |most| jerk_mm_s3.min(most / rate.abs()));
    }
    Side { speed_mm_s: speed_sq.sqrt(), accel_mm_s2, jerk_mm_s3 }
}

/// How the path bends, a mm.
fn bend(rates: &Rates) -> f64 {
    rates.bend_per_mm.0.iter().map(|bend| bend * bend).sum::<f64>().sqrt()
}

fn middle(a: &Point, b: &Point) -> Point {
    AxisMap::from_fn(|axis| 0.5 * (a[axis] + b[axis]))
}

/// The place on a cubic, by Bernstein's polynomials.
fn at(points: &[Point; 4], u: f64) -> Point {
    let v = 1.0 - u;
    let weights = [v * v * v, 3.0 * v * v * u, 3.0 * v * u * u, u * u * u];
    let mut place = Point::ZERO;
    for i in 0..AXES {
        place.0[i] = (0..4).map(|k| weights[k] * points[k].0[i]).sum();
    }
    place
}

/// How much a cubic bends where it is sharpest. Beside an arc that is more than between lines.
fn sharpest_per_mm(points: &[Point; 4]) -> f64 {
    let dot = |a: &[f64; 3], b: &[f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let leg = |k: usize| Axis::LINEAR.map(|axis| points[k + 1][axis] - points[k][axis]);
    let [a, b, c] = [leg(0), leg(1), leg(2)];
    let bend_sq = |k: usize| {
        let u = k as f64 / SAMPLES as f64;
        let v = 1.0 - u;
        let first: [f64; 3] =
            array::from_fn(|i| 3.0 * (v * v * a[i] + 2.0 * u * v * b[i] + u * u * c[i]));
        let second: [f64; 3] = array::from_fn(|i| 6.0 * (v * (b[i] - a[i]) + u * (c[i] - b[i])));
        let first_sq = dot(&first, &first);
        let along = dot(&first, &second);
        (dot(&second, &second) - along * along / first_sq).max(0.0) / (first_sq * first_sq)
    };
    (0..=SAMPLES).map(bend_sq).fold(0.0, f64::max).sqrt()
}

/// A cubic as a part of a block.
fn half(block: &Segment, points: [Point; 4]) -> Option<Segment> {
    let [from_mm, .., to_mm] = points;
    let spline = Spline::bezier(points.to_vec()).ok()?;
    Some(Segment {
        line: block.line,
        feed_mm_s: block.feed_mm_s,
        from_mm,
        to_mm,
        curve: Curve::Spline(Rc::new(MeasuredSpline::new(&spline)?)),
        corner: Corner::Exact,
    })
}
