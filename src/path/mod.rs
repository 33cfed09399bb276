//! 3 Motion → Segment: the exact curve that a program means, in closed form.

mod segment;

pub use segment::{Arc, Curve, PathItem, Segment};
