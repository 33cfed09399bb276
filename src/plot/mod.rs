//! Drawings as SVG: numbers → text that a browser shows, light or dark as its reader likes.
//!
//! The same numbers give the same bytes: no dates, no random names, no floating noise. Text stays
//! text. Nothing is computed here that a number in a table would not say as well.

mod chart;
mod envelope;
mod legend;
mod panel;
mod sheet;
mod strokes;
mod style;
mod text;
mod ticks;
mod timing;
mod traces;

pub use self::chart::{Along, Chart, Curve, Limit, Scale, Size};
pub use self::envelope::Envelope;
pub use self::panel::View;
pub use self::sheet::Sheet;
pub use self::strokes::{Mark, Place, Stroke, Strokes};
pub use self::style::element as style_element;
pub use self::timing::{Level, Panel, Span, Timing, Track};
pub use self::traces::{Quantity, Traces};
