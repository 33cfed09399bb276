//! The systems of the papers behind this project, as pure computation: what each interface between
//! a numerical control and its axes carries, and how. No clock and no device.
//!
//! - [`carry`]: what an interface carries against nodes, baud rate and sampling frequency, and
//!   whether it keeps up with a program
//! - [`plc`]: M, S and T functions by handshake with a PLC (seed 001)
//! - [`sercos`]: telegrams and a virtual ring of drives

pub mod carry;
pub mod plc;
pub mod sercos;
