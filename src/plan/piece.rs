//! Segment → Piece: short enough that one acceleration does for it, with what axes, bus and tick
//! make of a speed along it.
//!
//! A line is one piece: its axes feel the same from end to end. A curve is cut where its direction
//! has turned by [`TURN_MAX_RAD`]; between its ends the speed's square u changes linearly with
//! the way s, so the acceleration a = (u₁ - u₀) / 2L is constant. With x' and x'' the derivatives
//! of an axis's position by s, its acceleration is x''·u + x'·a (as in time-optimal path
//! parametrisation; Bobrow, Dubowsky and Gibson, 1985), which has to stay within its limit at both
//! ends: two linear conditions on (u₀, u₁) an axis.

use crate::base::{Axis, Point};
use crate::path::{Curve, Rates, RatesRef, Segment, Span};

use super::extreme::{greater, lesser};
use super::grip::Grip;
use super::jerk::JerkLimit;
use super::junction::{Bend, Joint, Junction};
use super::limits::{AxisLimits, Limits};
use super::{Bound, Ramp, hairpin};

/// How far a curve turns in a piece at most: 1.25 degrees.
pub const TURN_MAX_RAD: f64 = std::f64::consts::TAU / 288.0;

/// Between a piece's ends limits may be tighter than the straight line between those at the ends.
/// The square of the speed that an axis's own allows, V²/cos²θ, bends most: at 45 degrees, where
/// two axes share the limit, a chord over θ lies above it by θ² of it, which is θ²/2 of the speed.
pub(super) const INSIDE: f64 = 1.0 + TURN_MAX_RAD * TURN_MAX_RAD / 2.0;

/// An axis's rates c at the ends of a piece that have at least this ratio are taken to change evenly: the square
/// of its speed's limit, V²/c², lies below the chord by 3/4·(1 - ratio)² of it there at most, which is [`INSIDE`].
const EVEN_SHARE: f64 = 0.975;

/// Share of `path_tolerance_mm` for the chords that ticks make of curves; the rest is for
/// corners within a tick.
const CHORD_SHARE: f64 = 0.5;

/// A bent piece that takes less than this share of the time in which its greatest acceleration grows is
/// run with one: speeding up within it by what the jerk j allows in a time t, and braking again, gains
/// j·t²/32 at the mean. On the STARMILL that is 0.04 mm/s, of 20.
const BRIEF_SHARE: f64 = 0.5;

/// Squares of speeds that differ by less than this share are those of the same speed.
pub const SPEEDS_EQUAL: f64 = 1e-7;

/// Whether a speed is as good as the one of this square.
#[inline]
fn is_reached(speed_mm_s: f64, limit_sq: f64) -> bool {
    speed_mm_s * speed_mm_s >= limit_sq * (1.0 - SPEEDS_EQUAL)
}

/// A piece of a segment, to be run with one change of speed.
#[derive(Clone, Debug)]
pub struct Piece {
    /// Where on the segment the piece starts and ends, as shares of its way.
    pub shares: [f64; 2],
    /// Its length, as feed counts it.
    pub length_mm: f64,
    /// Squares of the greatest speeds at its start and end; between them they change evenly.
    pub ends_sq_max: [f64; 2],
    /// What sets these speeds.
    pub bounds: [Bound; 2],
    /// How much jerk its axes stand.
    pub jerk: JerkLimit,
    /// How it begins where the piece before ends.
    pub junction: Junction,
    grip: Grip,
}

/// The derivatives at the ends of a line with this direction that bends there.
fn chord_ends<'a>(tangent: &'a Point, bends: [Option<&'a Bend>; 2]) -> [RatesRef<'a>; 2] {
    bends.map(|bend| {
        let bend_per_mm = bend.map_or(&Point::ZERO, |bend| &bend.per_mm);
        RatesRef { tangent, bend_per_mm }
    })
}

/// How a bent piece is cut.
struct Cut<'a> {
    segment: &'a Segment,
    span: &'a Span,
    /// So many parts at least.
    least: f64,
    limits: &'a Limits,
    ramps: bool,
}

impl Piece {
    /// Of no length, straight on as fast as can be: a place for one.
    pub const NONE: Piece = Piece {
        shares: [0.0, 1.0],
        length_mm: 0.0,
        ends_sq_max: [f64::INFINITY; 2],
        bounds: [Bound::Feed; 2],
        jerk: JerkLimit::NONE,
        junction: Junction::STRAIGHT,
        grip: Grip::FREE,
    };

    /// A spline span by span: its corners and cusps lie between them.
    pub(super) fn cut_spline(
        segment: &Segment,
        spans: &[Span],
        limits: &Limits,
        ramps: bool,
        first: Junction,
        mut take: impl FnMut(Piece),
    ) {
        let length_mm = segment.length_mm();
        let mut rates = segment.rates_at(0.0);
        let mut before: Option<Rates> = None;
        let fastest_mm_s = segment.feed_mm_s.unwrap_or(limits.speed_max_mm_s);
        let off_mm = CHORD_SHARE * limits.path_tolerance_mm;
        let limits_sq = hairpin::speeds_sq(spans, off_mm, fastest_mm_s, limits);
        for (number, (span, limit_sq)) in (1..).zip(spans.iter().zip(limits_sq)) {
            let junction = before.map_or(first, |before| {
                rates.follow(span, 0);
                let feed_mm_s = segment.feed_mm_s.unwrap_or(f64::INFINITY);
                let tangents = [&before.tangent, &rates.tangent];
                let mut joint = Joint::REST;
                joint.join_at(tangents, [length_mm; 2], feed_mm_s, limits);
                joint.junction
            });
            let share = |at_mm: f64| at_mm / length_mm;
            let is_last = number == spans.len();
            let end = if is_last { 1.0 } else { share(span.start_mm + span.length_mm) };
            let shares = [share(span.start_mm), end];
            let ends = [0, 1].map(|end| {
                rates.follow(span, end);
                rates
            });
            before = Some(rates);
            let mut piece = Piece::bent(segment, shares, span.length_mm, &ends, limits);
            piece.hold_between(&ends, span, limits);
            if !ramps {
                piece.without_ramps();
            }
            // In two at least where it is the only one.
            let least = if spans.len() == 1 && ramps { 2.0 } else { 1.0 };
            piece.junction = junction;
            let cut = Cut { segment, span, least, limits, ramps };
            piece.split(&cut, ends, &mut |mut piece| {
                piece.bounded_by(limit_sq, Bound::Chord);
                take(piece);
            });
        }
    }

    /// Gives out a bent piece in equal parts.
    fn split(self, cut: &Cut<'_>, ends: [Rates; 2], take: &mut impl FnMut(Piece)) {
        let &Cut { segment, span, least, limits, ramps } = cut;
        let count = self.least_count(limits).max(least).ceil() as u64;
        if count == 1 {
            return take(self);
        }
        let (length_mm, mut junction) = (self.length_mm / count as f64, self.junction);
        let at = |k: u64| k as f64 / count as f64;
        let share = |k: u64| match k {
            k if k == count => self.shares[1],
            k => self.shares[0] + (self.shares[1] - self.shares[0]) * at(k),
        };
        for k in 0..count {
            let part = [k, k + 1].map(|k| ends[0].toward(&ends[1], at(k)));
            let shares = [share(k), share(k + 1)];
            let mut piece = Piece::bent(segment, shares, length_mm, &part, limits);
            piece.hold_between(&part, span, limits);
            if !ramps {
                piece.without_ramps();
            }
            piece.junction = std::mem::replace(&mut junction, Junction::STRAIGHT);
            take(piece);
        }
    }

    /// Takes a line, with these derivatives, for a piece of a chopped curve where the junctions at its ends
    /// are points of one. The axes' step of speed is made at the speed of that junction, in the time that
    /// the line takes, faster between its ends: so much acceleration does it take from the line.
    pub fn bend(&mut self, tangent: &Point, bends: [Option<&Bend>; 2], limits: &Limits) {
        let straight_mm_s2 = self.accel_max_mm_s2();
        // Where the way turns back braking goes on as speeding up: that is no jerk but that of the step.
        let curved = bends.map(|bend| bend.filter(|bend| !bend.is_back));
        self.hold_jerk(chord_ends(tangent, curved), limits);
        let ends = chord_ends(tangent, bends);
        let piece_sq = greater(self.ends_sq_max[0], self.ends_sq_max[1]);
        let fastest_sq = bends.map(|bend| {
            let Some(bend) = bend else { return 0.0 };
            let junction_sq = lesser(bend.speed_sq_max, piece_sq);
            let peak_sq = lesser(junction_sq + straight_mm_s2 * self.length_mm, piece_sq);
            (junction_sq * peak_sq).sqrt()
        });
        self.grip.become_bent(ends, self.length_mm, fastest_sq, true, limits);
    }

    /// Lets it change its speed at once.
    pub(super) fn without_ramps(&mut self) {
        self.grip.become_straight(f64::INFINITY);
    }

    /// In how many pieces it has to be cut, so that none takes longer than [`Limits::piece_max_s`].
    pub(super) fn least_count(&self, limits: &Limits) -> f64 {
        self.length_mm / self.speed_sq_max().sqrt() / limits.piece_max_s
    }

    /// Becomes the whole of a segment on which the axes move at most at these rates, whatever it was: held to
    /// the speed that all of it can be run at and, on a line, the acceleration. Field by field, since a piece
    /// is more than what changes.
    #[inline]
    pub(super) fn become_whole(
        &mut self,
        feed_mm_s: f64,
        length_mm: f64,
        rates: &Point,
        junction: &Junction,
        limits: &Limits,
    ) {
        let (mut slow_s_mm, mut slow_bound, mut held_s2_mm) = (0.0, Bound::Feed, 0.0);
        for limit in &limits.axes {
            let rate = rates[limit.axis].abs();
            let axis_s_mm = rate * limit.per_speed_s_mm;
            if axis_s_mm > slow_s_mm {
                (slow_s_mm, slow_bound) = (axis_s_mm, limit.speed_bound);
            }
            held_s2_mm = greater(held_s2_mm, rate * limit.per_accel_s2_mm);
        }
        self.grip.become_straight(1.0 / held_s2_mm);
        let feed_sq = feed_mm_s * feed_mm_s;
        (self.shares, self.length_mm, self.junction) = ([0.0, 1.0], length_mm, *junction);
        (self.ends_sq_max, self.bounds) = ([feed_sq; 2], [Bound::Feed; 2]);
        let slow_sq = slow_s_mm * slow_s_mm;
        if slow_sq * feed_sq > 1.0 {
            self.bounded_by(1.0 / slow_sq, slow_bound);
        }
        if limits.has_jerk {
            self.jerk = JerkLimit::straight(rates, limits);
        }
    }

    pub(super) fn bent(
        segment: &Segment,
        shares: [f64; 2],
        length_mm: f64,
        ends: &[Rates; 2],
        limits: &Limits,
    ) -> Piece {
        let mut piece = Piece::at_feed(segment.feed_mm_s, shares, length_mm);
        let ends = ends.each_ref().map(Rates::by_ref);
        for limit in &limits.axes {
            let axis = limit.axis;
            let rates = ends.map(|rates| rates.tangent[axis].abs() * INSIDE);
            piece.hold_speed(limit, rates);
            let bends = ends.map(|rates| rates.bend_per_mm[axis].abs() * INSIDE);
            let curved_sq = bends.map(|bend| limit.accel_max_mm_s2 / bend);
            piece.hold_ends(curved_sq, Bound::Curvature(axis));
        }
        match &segment.curve {
            Curve::Line | Curve::Arc(_) => piece.hold_chord(segment, limits),
            Curve::Spline(_) => piece.hold_sagitta(ends, limits),
        }
        piece.hold_jerk(ends, limits);
        let fastest_sq = piece.ends_sq_max[0].max(piece.ends_sq_max[1]);
        piece.grip.become_bent(ends, length_mm, [fastest_sq; 2], false, limits);
        piece
    }

    /// Holds the speed at which the curve's own turn takes its share of the axes' jerk.
    #[inline]
    fn hold_jerk(&mut self, ends: [RatesRef<'_>; 2], limits: &Limits) {
        // Where no axis has a limit on it no piece has another one.
        if !limits.has_jerk {
            return;
        }
        self.jerk = JerkLimit::bent(ends, limits);
        if let Some((speed_sq, axis)) = self.jerk.speed_sq_max() {
            self.bounded_by(speed_sq, Bound::Curvature(axis));
        }
    }

    /// At a feed, or as fast as can be, whatever the axes say.
    fn at_feed(feed_mm_s: Option<f64>, shares: [f64; 2], length_mm: f64) -> Piece {
        let feed_mm_s = feed_mm_s.unwrap_or(f64::INFINITY);
        Piece { shares, length_mm, ends_sq_max: [feed_mm_s * feed_mm_s; 2], ..Piece::NONE }
    }

    /// Holds the axes' speeds between its ends on a spline, which is no circle: its direction may change early or
    /// late. A speed that changes evenly in its square supposes besides that a rate changes little in itself.
    fn hold_between(&mut self, ends: &[Rates; 2], span: &Span, limits: &Limits) {
        for (axis, bulge) in Axis::LINEAR.into_iter().zip(span.bulges) {
            let Some(limit) = limits.axis(axis) else { continue };
            let rates = ends.each_ref().map(|rates| rates.tangent[axis].abs());
            let [least, most] = [rates[0].min(rates[1]), rates[0].max(rates[1])];
            let is_even = least >= EVEN_SHARE * most;
            let held = if is_even { rates } else { [most; 2] };
            self.hold_speed(limit, held.map(|rate| (rate + bulge) * INSIDE));
        }
    }

    /// Holds the speed below the axis's greatest.
    fn hold_speed(&mut self, limit: &AxisLimits, rates: [f64; 2]) {
        let squares = rates.map(|rate| (limit.speed_max_mm_s / rate).powi(2));
        self.hold_ends(squares, limit.speed_bound);
    }

    /// Holds the speed at which a tick turns a curve so far that its chord is off by its share of
    /// the path tolerance. The sagitta over an angle θ is at most r·θ²/8; a circle is 2r wide.
    pub(super) fn hold_chord(&mut self, segment: &Segment, limits: &Limits) {
        let Curve::Arc(arc) = &segment.curve else { return };
        let off_mm = CHORD_SHARE * limits.path_tolerance_mm;
        let radius_mm = arc.radius_max_mm();
        if 2.0 * radius_mm > off_mm {
            let angle_rad = (8.0 * off_mm / radius_mm).sqrt();
            let mm_a_rad = segment.length_mm() / arc.sweep_rad.abs();
            let speed_mm_s = mm_a_rad * angle_rad / limits.tick_s;
            self.bounded_by(speed_mm_s * speed_mm_s, Bound::Chord);
        }
    }

    /// The same for a bend: the sagitta over a way w is w²/8 of it.
    fn hold_sagitta(&mut self, ends: [RatesRef<'_>; 2], limits: &Limits) {
        let tick_s = limits.tick_s;
        let off_mm = CHORD_SHARE * limits.path_tolerance_mm;
        let squares = ends.map(|rates| {
            let bend = Axis::LINEAR.map(|axis| rates.bend_per_mm[axis].powi(2));
            8.0 * off_mm / bend.iter().sum::<f64>().sqrt() / (tick_s * tick_s)
        });
        self.hold_ends(squares, Bound::Chord);
    }

    /// Takes a limit on the square of the speed, where it is a tighter one.
    pub fn bounded_by(&mut self, speed_sq: f64, bound: Bound) {
        self.hold_ends([speed_sq; 2], bound);
    }

    fn hold_ends(&mut self, ends_sq: [f64; 2], bound: Bound) {
        for (end, limit) in ends_sq.into_iter().enumerate() {
            if limit < self.ends_sq_max[end] {
                self.ends_sq_max[end] = limit;
                self.bounds[end] = bound;
            }
        }
    }

    /// Square of the greatest speed that all of it can be run at.
    pub fn speed_sq_max(&self) -> f64 {
        lesser(self.ends_sq_max[0], self.ends_sq_max[1])
    }

    /// Square of the greatest speed at its start, up to one given, from which the speed at its end can be
    /// brought to or below another.
    pub fn entry_sq_max(&self, exit_sq: f64, most_sq: f64) -> f64 {
        let most_sq = lesser(most_sq, self.ends_sq_max[0]);
        let exit_sq = lesser(exit_sq, self.ends_sq_max[1]);
        if self.is_straight() {
            return lesser(exit_sq + self.gain_sq(), most_sq);
        }
        if self.grip.allows([most_sq, exit_sq]) {
            return most_sq;
        }
        lesser(self.grip.entry_sq(exit_sq, self.speed_sq_max()), most_sq)
    }

    /// Square of the greatest speed at its end, up to one given, that can be reached from one at its start.
    pub fn exit_sq_max(&self, entry_sq: f64, most_sq: f64) -> f64 {
        let most_sq = lesser(most_sq, self.ends_sq_max[1]);
        if self.is_straight() {
            return lesser(entry_sq + self.gain_sq(), most_sq);
        }
        if self.grip.allows([entry_sq, most_sq]) {
            return most_sq;
        }
        lesser(self.grip.exit_from(entry_sq), most_sq)
    }

    /// By how much the square of the speed can change along a line: 2·a·l.
    #[inline]
    fn gain_sq(&self) -> f64 {
        2.0 * self.grip.accel_mm_s2() * self.length_mm
    }

    /// The greatest acceleration from a speed at its start, whatever its speed limits say.
    pub fn speeding_up_mm_s2(&self, speed_sq: f64) -> f64 {
        if self.is_straight() {
            return self.grip.accel_mm_s2();
        }
        self.accel_between(speed_sq, self.grip.exit_from(speed_sq))
    }

    /// The greatest braking to a speed at its end, whatever its speed limits say.
    pub fn braking_mm_s2(&self, speed_sq: f64) -> f64 {
        if self.is_straight() {
            return self.grip.accel_mm_s2();
        }
        self.accel_between(speed_sq, self.grip.entry_to(speed_sq))
    }

    /// The acceleration that makes one square of a speed of another along it; 0 if that is less.
    fn accel_between(&self, from_sq: f64, to_sq: f64) -> f64 {
        (0.5 * (to_sq - from_sq) / self.length_mm).max(0.0)
    }

    /// Whether it is a line that no bend holds.
    pub fn is_straight(&self) -> bool {
        self.grip.is_straight()
    }

    /// The greatest acceleration along it.
    pub fn accel_max_mm_s2(&self) -> f64 {
        let accel_mm_s2 = self.grip.accel_mm_s2();
        if self.is_straight() {
            return accel_mm_s2;
        }
        accel_mm_s2.max(self.accel_between(0.0, self.exit_sq_max(0.0, f64::INFINITY)))
    }

    /// What sets its greatest speed where it is run between these speeds with this peak.
    #[inline]
    pub fn bound(&self, ends_mm_s: [f64; 2], peak_mm_s: f64) -> Bound {
        // On most pieces both ends have one limit, which the peak tells of.
        let [limit_sq, end_sq] = self.ends_sq_max;
        if limit_sq == end_sq && !is_reached(peak_mm_s, limit_sq) {
            return Bound::Acceleration;
        }
        if limit_sq == end_sq && self.bounds[0] == self.bounds[1] {
            return self.bounds[0];
        }
        self.bound_of_ends(ends_mm_s, peak_mm_s)
    }

    /// The same where the ends have limits of their own.
    #[inline(never)]
    fn bound_of_ends(&self, ends_mm_s: [f64; 2], peak_mm_s: f64) -> Bound {
        let is_at_limit = |end: &usize| is_reached(ends_mm_s[*end], self.ends_sq_max[*end]);
        let ends = if ends_mm_s[1] > ends_mm_s[0] { [1, 0] } else { [0, 1] };
        if let Some(end) = ends.into_iter().find(is_at_limit) {
            return self.bounds[end];
        }
        let slow = usize::from(self.ends_sq_max[1] < self.ends_sq_max[0]);
        let is_below = |speed_mm_s: f64| speed_mm_s * speed_mm_s <= self.speed_sq_max();
        let cruises =
            ends_mm_s.into_iter().all(is_below) && is_reached(peak_mm_s, self.speed_sq_max());
        if cruises { self.bounds[slow] } else { Bound::Acceleration }
    }

    /// Whether it is over before a limit on jerk lets its acceleration grow by [`BRIEF_SHARE`].
    fn is_brief(&self, ends_mm_s: [f64; 2]) -> bool {
        let duration_s = 2.0 * self.length_mm / (ends_mm_s[0] + ends_mm_s[1]);
        self.jerk.is_limited()
            && self.jerk.along_mm_s3() * duration_s < BRIEF_SHARE * self.accel_max_mm_s2()
    }

    /// How it is run between speeds at its ends that its limits allow. On a bent piece with one
    /// acceleration, unless it takes long, all of it may be as fast as its ends, and leaves room for a
    /// greater one.
    // Inlined, it is written where it stays: given back as a whole it would be read back before it is written.
    #[inline(always)]
    pub fn ramp(&self, ends_mm_s: [f64; 2]) -> Ramp {
        let speed_sq_max = self.speed_sq_max();
        let between =
            |accel_mm_s2: f64| Ramp::between(self.length_mm, ends_mm_s, speed_sq_max, accel_mm_s2);
        let accel_mm_s2 = self.grip.accel_mm_s2();
        if self.is_straight() {
            if accel_mm_s2 < f64::INFINITY {
                return between(accel_mm_s2);
            }
            return Ramp::steady(self.length_mm, ends_mm_s);
        }
        // An estimate asks for bent pieces from rest to rest. None is run so but a chord between stops in corners
        // that a tick would cut, whose ends would leave it more.
        if ends_mm_s == [0.0; 2] {
            return between(self.accel_max_mm_s2());
        }
        let ends_sq @ [entry_sq, exit_sq] = ends_mm_s.map(|speed| speed * speed);
        let is_below = lesser(entry_sq, exit_sq) < speed_sq_max;
        let may_peak = greater(entry_sq, exit_sq) <= speed_sq_max;
        if is_below && may_peak && !self.is_brief(ends_mm_s) {
            let halves_mm_s2 = self.grip.bent_mm_s2(ends_sq, self.length_mm, speed_sq_max);
            if let Some(ramp) =
                Ramp::of_halves(self.length_mm, ends_mm_s, speed_sq_max, halves_mm_s2)
            {
                return ramp;
            }
            let accel_mm_s2 = lesser(halves_mm_s2[0], halves_mm_s2[1]);
            // It leaves room for a greater speed between its ends.
            if 2.0 * accel_mm_s2 * self.length_mm > (exit_sq - entry_sq).abs() {
                return between(accel_mm_s2);
            }
        }
        Ramp::steady(self.length_mm, ends_mm_s)
    }
}
