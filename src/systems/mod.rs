//! The other systems of the papers behind this project, as pure computation: path and figures in,
//! figures out. No input, no output, no clock; what is sent to nodes is `wire`'s.
//!
//! - [`difference`]: nodes that interpolate by difference equations (seed 004, Method B)
//! - [`pulse`]: interpolation pulses, one by one (seed 001)

pub mod difference;
pub mod pulse;
