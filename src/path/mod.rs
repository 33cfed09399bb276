//! 3 Motion → Segment: the exact curve that a program means, in closed form.
//!
//! Arcs, helices and splines stay what they are; nothing is chopped into chords. Rapids are straight, or
//! doglegs where the machine moves its axes independently. Moves that go nowhere are left out. This stage knows no speed but the feed asked for, no steps and no ticks.

mod dogleg;
mod jog;
mod rates;
mod segment;
mod spline;

pub use jog::{JogError, jog};
pub use rates::{Rates, RatesRef};
pub use segment::{Arc, Curve, PathItem, Segment};
pub use spline::{MeasuredSpline, Span};

pub use crate::interp::Corner;

use std::rc::Rc;

use crate::base::Machine;
use crate::base::machine::Rapid;
use crate::interp::{FULL_CIRCLE_MM, Motion, Move, MoveKind};

/// Turns motion into the path that it is on a machine, item by item; errors of the source pass through.
pub fn segments<E>(
    motions: impl Iterator<Item = Result<Motion, E>>,
    machine: &Machine,
) -> impl Iterator<Item = Result<PathItem, E>> {
    let is_independent = machine.rapid == Rapid::Independent;
    motions.filter_map(move |motion| match motion {
        Ok(Motion::Event(event)) => Some(Ok(PathItem::Event(event))),
        Ok(Motion::Move(step)) if is_independent && step.kind == MoveKind::Rapid => {
            rapid(&step, machine).map(|segment| Ok(segment.into()))
        }
        Ok(Motion::Move(step)) => segment(&step).map(|segment| Ok(segment.into())),
        Err(error) => Some(Err(error)),
    })
}

/// A rapid with every axis on its own.
fn rapid(step: &Move, machine: &Machine) -> Option<Segment> {
    let dogleg = dogleg::dogleg(&step.from, &step.to, machine);
    let segment = segment(step)?;
    Some(match dogleg.as_ref().and_then(MeasuredSpline::new) {
        Some(spline) => Segment { curve: Curve::Spline(Rc::new(spline)), ..segment },
        None => segment,
    })
}

/// The curve of a move, a rapid's being straight; none for a move that goes nowhere.
pub fn segment(step: &Move) -> Option<Segment> {
    let curve = match &step.kind {
        MoveKind::Rapid | MoveKind::Line { .. } if step.from == step.to => return None,
        MoveKind::Rapid | MoveKind::Line { .. } => Curve::Line,
        MoveKind::Arc { .. } => Curve::Arc(arc(step)?),
        MoveKind::Spline { curve, .. } => Curve::Spline(Rc::new(MeasuredSpline::new(curve)?)),
    };
    Some(Segment {
        line: step.line,
        feed_mm_s: step.kind.feed_mm_min().map(|feed| feed / 60.0),
        from_mm: step.from,
        to_mm: step.to,
        curve,
        corner: step.corner,
    })
}

/// Radii and angles of an arc given by its ends and centre. An arc whose ends coincide in the
/// plane is a full circle.
fn arc(step: &Move) -> Option<Arc> {
    let MoveKind::Arc { plane, center_mm, ccw, turns, .. } = step.kind else { return None };
    let [first, second] = plane.axes();
    let from = [step.from[first] - center_mm[0], step.from[second] - center_mm[1]];
    let to = [step.to[first] - center_mm[0], step.to[second] - center_mm[1]];
    // The angle from start to end by cross and dot product: exact for short arcs too.
    let cross = from[0] * to[1] - from[1] * to[0];
    let dot = from[0] * to[0] + from[1] * to[1];
    let full_turn = std::f64::consts::TAU;
    let apart_mm = libm::hypot(to[0] - from[0], to[1] - from[1]);
    let mut sweep_rad = if apart_mm <= FULL_CIRCLE_MM { 0.0 } else { libm::atan2(cross, dot) };
    if ccw && sweep_rad <= 0.0 {
        sweep_rad += full_turn;
    } else if !ccw && sweep_rad >= 0.0 {
        sweep_rad -= full_turn;
    }
    sweep_rad += full_turn * f64::from(turns) * sweep_rad.signum();
    Some(Arc {
        plane,
        center_mm,
        radius_from_mm: libm::hypot(from[0], from[1]),
        radius_to_mm: libm::hypot(to[0], to[1]),
        angle_from_rad: libm::atan2(from[1], from[0]),
        sweep_rad,
    })
}
