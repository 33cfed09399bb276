//! Motion: what a program means, once units, offsets and modes have been resolved.

use std::sync::Arc;

use crate::base::{Event, Plane, Point, Spline};

/// One thing that a program makes happen, in program order.
#[derive(Clone, Debug, PartialEq)]
pub enum Motion {
    /// The axes move.
    Move(Move),
    /// Motion rests until something has happened.
    Event(Event),
}

/// A movement from one position to another, in machine coordinates (mm, degrees on rotary axes).
#[derive(Clone, Debug, PartialEq)]
pub struct Move {
    /// Physical line of the program, from 1.
    pub line: u32,
    /// The block's N word.
    pub n: Option<u32>,
    /// Where it starts: the end of the move before.
    pub from: Point,
    /// Where it ends.
    pub to: Point,
    /// The way between.
    pub kind: MoveKind,
    /// What may become of the corner at its end.
    pub corner: Corner,
    /// What else than time decides where the axes are.
    pub bound: Bound,
}

/// What, beside time, a movement is bound to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Bound {
    /// Nothing.
    #[default]
    Free,
    /// The spindle's turns: the feed is what follows from its speed (G33, G33.1, G76).
    Spindle,
    /// Nothing, but the tool gets there and away by this way only: taps in floating holders, boring behind
    /// an edge.
    Captive,
    /// A probe or another input: the movement ends where it comes, at its end at the latest
    /// (G38.2 to G38.5, G31).
    Input,
}

/// What may become of the corner between two movements.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum Corner {
    /// The path is kept exactly; no stop is asked for (G61).
    #[default]
    Exact,
    /// The machine comes to rest (G61.1, G9).
    Stop,
    /// The corner may be cut (G64).
    Blend {
        /// By so much at most; none: by what the machine's tolerance allows.
        tolerance_mm: Option<f64>,
        /// The operator's multiple of the feed, which the move's speed has. The way does not follow it.
        feed_scale: f64,
    },
}

/// The way of a movement.
#[derive(Clone, Debug, PartialEq)]
pub enum MoveKind {
    /// As fast as the machine can (G0).
    Rapid,
    /// A straight line (G1).
    Line {
        /// Speed along the path.
        feed_mm_min: f64,
    },
    /// An arc or helix (G2, G3): circular in its plane, linear in all other axes.
    Arc {
        /// Speed along the path, the axis across the plane included.
        feed_mm_min: f64,
        /// The arc's plane.
        plane: Plane,
        /// Centre on the plane's first and second axis (see [`Plane::axes`]).
        center_mm: [f64; 2],
        /// Counter-clockwise.
        ccw: bool,
        /// Full turns beyond the last partial one: 0 for a plain arc and a single full circle.
        turns: u32,
    },
    /// A spline (G5, G5.1, G5.2, G6.2) in X, Y and Z.
    Spline {
        /// Speed along the path.
        feed_mm_min: f64,
        /// Its points, in machine coordinates; the first and the last are the ends of the move.
        curve: Arc<Spline>,
    },
}

impl MoveKind {
    /// Speed along the path; none of a rapid.
    pub fn feed_mm_min(&self) -> Option<f64> {
        match self {
            MoveKind::Rapid => None,
            MoveKind::Line { feed_mm_min }
            | MoveKind::Arc { feed_mm_min, .. }
            | MoveKind::Spline { feed_mm_min, .. } => Some(*feed_mm_min),
        }
    }
}
