//! Drawings as SVG: numbers → text that a browser shows, light or dark as its reader likes.
//!
//! The same numbers give the same bytes: no dates, no random names, no floating noise. Text stays
//! text. Nothing is computed here that a number in a table would not say as well.

mod chart;
mod ticks;
mod timing;

pub use self::chart::{Along, Chart, Curve, Limit, Scale};
pub use self::timing::{Level, Panel, Span, Timing, Track};
