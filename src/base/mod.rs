//! What all stages share: axes and points, splines, machine profiles, ticks and events, sources of
//! text, diagnostics. Uses nothing else of the crate.

pub mod axis;
pub mod command;
pub mod config;
pub mod diagnostic;
pub mod likeness;
pub mod machine;
pub mod plane;
pub mod progress;
pub mod rounding;
pub mod source;
pub mod spline;

pub use axis::{Axis, AxisMap, AxisSet, Point};
pub use command::{Command, Event, EventKind, EventWords, Tick};
pub use config::{Config, PortConfig};
pub use diagnostic::{CallSite, Diagnostic, Severity, Span};
pub use machine::Machine;
pub use plane::Plane;
pub use progress::Progress;
pub use source::Source;
pub use spline::Spline;
