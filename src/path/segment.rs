//! One piece of the path.

use crate::base::{Event, Plane, Point};

/// An item of the path: a curve, or an event at which the machine rests.
#[derive(Clone, Debug, PartialEq)]
pub enum PathItem {
    /// A piece of the path.
    Segment(Segment),
    /// Something that happens between two pieces.
    Event(Event),
}

/// A piece of the path: a line, arc or helix from one position to another.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    /// Line of the NC program, from 1.
    pub line: u32,
    /// Speed along the path; none: as fast as the machine can (a rapid).
    pub feed_mm_s: Option<f64>,
    /// Start, in machine coordinates.
    pub from_mm: Point,
    /// End, in machine coordinates.
    pub to_mm: Point,
    /// The way between.
    pub curve: Curve,
}

/// The shape of a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Curve {
    /// Straight in all axes.
    Line,
    /// Circular in a plane, linear in all other axes.
    Arc(Arc),
}

/// The circular part of an arc or helix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arc {
    /// The arc's plane.
    pub plane: Plane,
    /// Centre on the plane's first and second axis.
    pub center_mm: [f64; 2],
    /// Radius at the start.
    pub radius_from_mm: f64,
    /// Radius at the end; between them it changes linearly with the angle.
    pub radius_to_mm: f64,
    /// Direction from the centre to the start, from the plane's first axis to its second.
    pub angle_from_rad: f64,
    /// Angle travelled, all turns included; positive is counter-clockwise.
    pub sweep_rad: f64,
}
