//! Bends that are over within a tick.
//!
//! ```text
//!        S                W     the way of a tick
//!       ,-.               S     a stretch that turns by Θ
//!  ────'   `────          off   how far the tick's chord is off: Θ·(W/4 - S/8) at most
//!  · · · · · · ·  chord
//! ```
//!
//! A curve's own limit, the sagitta of a tick at its bend, supposes that a tick is as fast as the bend is.
//! Where the bend is sharp and short, and the machine so strong that it is fast again in the same tick, the
//! chord is longer. There all that lies within a tick of it is held to the speed of such a W. Machines that
//! gain little speed in a tick need none of that.

use std::f64::consts::PI;

use crate::base::Axis;
use crate::path::Span;

use super::limits::Limits;

/// A chord may be so much longer than at an even speed: it uses up its share of the path tolerance by as
/// much more, and the rest of that is for corners, of which a bend that no corner is near has none.
const LONGER: f64 = 1.25;

/// Squares of the greatest speeds along the spans of a spline; infinite where its bends ask for none. A
/// chord may be off by so much, and nothing is faster than `fastest_mm_s`.
pub fn speeds_sq(spans: &[Span], off_mm: f64, fastest_mm_s: f64, limits: &Limits) -> Vec<f64> {
    let tick_s = limits.tick_s;
    let gain_mm = 0.25 * limits.accel_max_mm_s2 * tick_s * tick_s;
    let mut limits_sq = vec![f64::INFINITY; spans.len()];
    for first in 0..spans.len() {
        let (mut turn_rad, mut span_mm, mut slowest_mm_s) = (0.0, 0.0, fastest_mm_s);
        for span in &spans[first..] {
            turn_rad += turn(span);
            span_mm += span.length_mm;
            slowest_mm_s = slowest_mm_s.min(own_mm_s(span, off_mm, limits));
            // Of a longer stretch, shorter ones tell.
            if turn_rad * span_mm > 8.0 * off_mm || span_mm > fastest_mm_s * tick_s {
                break;
            }
            let way_mm = 4.0 * off_mm / turn_rad + 0.5 * span_mm;
            let longest_mm = (slowest_mm_s * tick_s + gain_mm).min(fastest_mm_s * tick_s);
            if longest_mm > LONGER * way_mm {
                let speed_mm_s = way_mm / tick_s;
                let from_mm = spans[first].start_mm - way_mm;
                let to_mm = span.start_mm + span.length_mm + way_mm;
                let near = spans.partition_point(|span| span.start_mm + span.length_mm <= from_mm)
                    ..spans.partition_point(|span| span.start_mm < to_mm);
                for limit_sq in &mut limits_sq[near] {
                    *limit_sq = limit_sq.min(speed_mm_s * speed_mm_s);
                }
            }
            if turn_rad >= PI {
                break;
            }
        }
    }
    limits_sq
}

/// How far a span turns; so little that the chord between unit vectors tells.
fn turn(span: &Span) -> f64 {
    let [from, to] = span.tangents;
    (0..3).map(|i| (to[i] - from[i]).powi(2)).sum::<f64>().sqrt()
}

/// The speed that a span's own bend allows, by the sagitta of a tick and by the axes' accelerations.
fn own_mm_s(span: &Span, off_mm: f64, limits: &Limits) -> f64 {
    let tick_s = limits.tick_s;
    let bends = Axis::LINEAR.into_iter().zip(span.bends_per_mm);
    let bend_per_mm = bends.clone().map(|(_, bend)| bend * bend).sum::<f64>().sqrt();
    let own = bends
        .filter_map(|(axis, bend)| limits.axis(axis).map(|own| own.accel_max_mm_s2 / bend.abs()));
    own.fold(8.0 * off_mm / bend_per_mm / (tick_s * tick_s), f64::min).sqrt()
}
