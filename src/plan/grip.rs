//! How the axes hold a piece: which changes of its speed they can follow.
//!
//! With x' and x'' the derivatives of an axis's position by the way, and u₀ and u₁ the squares of the speeds at
//! a bent piece's ends, between which u changes evenly over the length L, the axis's acceleration at an end is
//!
//! ```text
//! x''·u + x'·a = x''·u + x'·(u₁ - u₀) / 2L
//! ```
//!
//! Each has to stay within the axis's limit: two linear conditions on (u₀, u₁) an axis.

use crate::path::RatesRef;

use super::extreme::{greater, lesser};
use super::limits::Limits;
use super::piece::INSIDE;

/// Conditions that are judged together: those of three axes. Most machines have no more.
const TOGETHER: usize = 6;

/// Where one end uses all of a limit, what is left for the other must not hang on rounding.
const PULL_SLACK: f64 = 1e-9;

/// Which changes of speed the axes can follow: those of an acceleration along a line, or those that the
/// conditions of a bent piece leave.
#[derive(Clone, Debug)]
pub struct Grip {
    accel_mm_s2: f64,
    is_bent: bool,
    /// Of a bent piece: it is a line between points of a chopped curve, which bends at its ends.
    is_chord: bool,
    /// Of a bent piece: square of the greatest speed that the conditions let both ends have.
    even_sq: f64,
    /// Of a bent piece: the conditions of the first three axes, which stay where they are, and of the others.
    pulls: Pulls,
    more_pulls: Vec<Pulls>,
}

/// Conditions: each `from · u₀ + to · u₁` has to lie between -1 and 1. Those with zeros always do.
#[derive(Clone, Copy, Debug)]
struct Pulls {
    from: [f64; TOGETHER],
    to: [f64; TOGETHER],
}

impl Grip {
    /// Any change at once.
    pub const FREE: Grip = Grip {
        accel_mm_s2: f64::INFINITY,
        is_bent: false,
        is_chord: false,
        even_sq: f64::INFINITY,
        pulls: Pulls::NONE,
        more_pulls: Vec::new(),
    };

    /// Becomes that of a line with this acceleration.
    #[inline]
    pub fn become_straight(&mut self, accel_mm_s2: f64) {
        (self.accel_mm_s2, self.is_bent) = (accel_mm_s2, false);
    }

    /// Becomes that of a piece with these derivatives at its ends, where these squares of speeds go with the
    /// bends; a chord is a line that bends at its ends only.
    pub fn become_bent(
        &mut self,
        ends: [RatesRef<'_>; 2],
        length_mm: f64,
        fastest_sq: [f64; 2],
        is_chord: bool,
        limits: &Limits,
    ) {
        let (mut even, mut accel_mm_s2) = (0.0, f64::INFINITY);
        let along_per_mm = 0.5 / length_mm;
        self.more_pulls.clear();
        for (number, three) in limits.axes.chunks(TOGETHER / 2).enumerate() {
            let pulls = if number == 0 {
                &mut self.pulls
            } else {
                self.more_pulls.push(Pulls::NONE);
                &mut self.more_pulls[number - 1]
            };
            if three.len() < TOGETHER / 2 {
                *pulls = Pulls::NONE;
            }
            for (i, limit) in three.iter().enumerate() {
                let (axis, per_accel_s2_mm) = (limit.axis, INSIDE * limit.per_accel_s2_mm);
                let [t0, t1] = ends.map(|rates| rates.tangent[axis] * per_accel_s2_mm);
                let [b0, b1] = ends.map(|rates| rates.bend_per_mm[axis] * per_accel_s2_mm);
                let [along0, along1] = [t0 * along_per_mm, t1 * along_per_mm];
                (pulls.from[2 * i], pulls.to[2 * i]) = (b0 - along0, along0);
                (pulls.from[2 * i + 1], pulls.to[2 * i + 1]) = (-along1, b1 + along1);
                even = greater(even, greater(b0.abs(), b1.abs()));
                let across = greater(b0.abs() * fastest_sq[0], b1.abs() * fastest_sq[1]);
                let rate = greater(t0.abs(), t1.abs());
                if rate > 0.0 {
                    accel_mm_s2 = lesser(accel_mm_s2, (1.0 - across) / rate);
                }
            }
        }
        (self.accel_mm_s2, self.is_bent, self.even_sq) = (accel_mm_s2, true, 1.0 / even);
        self.is_chord = is_chord;
    }

    /// The greatest acceleration and the greatest braking along a bent piece of this length, run between these
    /// squares of speeds, and no faster than of another. A point of a chopped curve takes less of them the slower
    /// it is passed.
    pub fn bent_mm_s2(&self, ends_sq: [f64; 2], length_mm: f64, piece_sq: f64) -> [f64; 2] {
        if !self.is_chord {
            return [self.accel_mm_s2; 2];
        }
        let (ends_mm_s, piece_mm_s) = (ends_sq.map(f64::sqrt), piece_sq.sqrt());
        let halves = |pulls: &Pulls| pulls.halves_mm_s2(ends_mm_s, length_mm, piece_mm_s);
        let both = |[a, b]: [f64; 2], [c, d]: [f64; 2]| [lesser(a, c), lesser(b, d)];
        self.more_pulls.iter().map(halves).fold(halves(&self.pulls), both)
    }

    /// Whether it is that of a line, or of any change at once.
    #[inline]
    pub fn is_straight(&self) -> bool {
        !self.is_bent
    }

    /// The greatest acceleration along a line; on a bent piece, the one that the bends leave.
    #[inline]
    pub fn accel_mm_s2(&self) -> f64 {
        self.accel_mm_s2
    }

    /// Whether the axes can follow these squares of the speeds at the ends of a bent piece.
    pub fn allows(&self, [entry_sq, exit_sq]: [f64; 2]) -> bool {
        let most = |pulls: &Pulls| pulls.greatest(entry_sq, exit_sq);
        self.more_pulls.iter().map(most).fold(most(&self.pulls), greater) <= 1.0 + PULL_SLACK
    }

    /// Square of the greatest speed at a bent piece's start from which that at its end can be brought to or below
    /// one whose square is given, where both ends may be as fast as the piece as a whole.
    pub fn entry_sq(&self, exit_sq: f64, piece_sq: f64) -> f64 {
        let even_sq = lesser(piece_sq, self.even_sq);
        let entry_sq = self.entry_to(exit_sq);
        // Above the speed that all of it may have there may be no entry to an exit.
        if exit_sq <= even_sq || entry_sq >= even_sq && self.allows([entry_sq, exit_sq]) {
            entry_sq
        } else {
            self.entry_to(even_sq)
        }
    }

    /// Square of the greatest speed at a bent piece's start to that at its end.
    pub fn entry_to(&self, exit_sq: f64) -> f64 {
        self.least(|pulls| most(&pulls.from, &pulls.to, exit_sq))
    }

    /// Square of the greatest speed at a bent piece's end from that at its start.
    pub fn exit_from(&self, entry_sq: f64) -> f64 {
        self.least(|pulls| most(&pulls.to, &pulls.from, entry_sq))
    }

    #[inline]
    fn least(&self, of: impl Fn(&Pulls) -> f64) -> f64 {
        greater(self.more_pulls.iter().map(&of).fold(of(&self.pulls), lesser), 0.0)
    }
}

impl Pulls {
    const NONE: Pulls = Pulls { from: [0.0; TOGETHER], to: [0.0; TOGETHER] };

    /// The greatest accelerations in both halves of a chord of length l that is run between these speeds, and no
    /// faster than the piece as a whole. An axis of rate x', and of bend x'' at an end that is passed with v, has to
    /// keep its limit with V, the speed that a makes of v in that half, or the piece's, if that is less:
    ///
    /// ```text
    /// x'·a + x''·v·V ≤ 1       V² = v² + a·l       (x', x'': as shares of the limit)
    /// ```
    #[inline]
    fn halves_mm_s2(&self, ends_mm_s: [f64; 2], length_mm: f64, piece_mm_s: f64) -> [f64; 2] {
        let per_length_mm = 1.0 / length_mm;
        let half = |i: usize| {
            // Conditions come in turn for the start and for the end: the other end's factor is x'/2l.
            let rate_a_mm = 2.0 * [self.to[i], self.from[i]][i % 2].abs();
            let end_mm_s = ends_mm_s[i % 2];
            let bend_s_mm = (self.from[i] + self.to[i]).abs() * end_mm_s;
            // With a = (V² - v²)/l: x'/l·V² + x''·v·V = 1 + x'/l·v².
            let whole = 1.0 + rate_a_mm * end_mm_s * end_mm_s;
            let root = (bend_s_mm * bend_s_mm + 4.0 * rate_a_mm * whole).sqrt();
            let middle_mm_s = 2.0 * whole / (bend_s_mm + root);
            let below_piece = (middle_mm_s * middle_mm_s - end_mm_s * end_mm_s) * per_length_mm;
            let at_piece = (1.0 - bend_s_mm * piece_mm_s) / (rate_a_mm * length_mm);
            // Whichever V is the lesser leaves the more. Of an axis that does not move, 0/0 at worst: not taken.
            greater(at_piece, below_piece)
        };
        let [a, b, c, d, e, f]: [f64; TOGETHER] = std::array::from_fn(half);
        [lesser(lesser(a, c), e), lesser(lesser(b, d), f)]
    }

    /// How much of its axis's limit is used, in the condition where that is most.
    #[inline]
    fn greatest(&self, entry_sq: f64, exit_sq: f64) -> f64 {
        let used = |i: usize| (self.from[i] * entry_sq + self.to[i] * exit_sq).abs();
        of_six(std::array::from_fn(used), greater)
    }
}

/// The greatest value whose product with the first factor, added to the given one's with the
/// second, keeps all conditions. The set of pairs that keep them is convex and holds all equal
/// pairs up to the piece's greatest speed, so below that the greatest value grows with the other.
#[inline]
fn most(own: &[f64; TOGETHER], other: &[f64; TOGETHER], given: f64) -> f64 {
    let bound = |i: usize| {
        let taken = 1_f64.copysign(own[i]) * other[i] * given;
        (1.0 + PULL_SLACK - taken) / own[i].abs()
    };
    of_six(std::array::from_fn(bound), lesser)
}

/// The extreme of six numbers, in pairs.
#[inline]
fn of_six([a, b, c, d, e, f]: [f64; TOGETHER], extreme: fn(f64, f64) -> f64) -> f64 {
    extreme(extreme(extreme(a, c), e), extreme(extreme(b, d), f))
}
