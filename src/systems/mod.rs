//! The systems of the papers behind this project, as pure computation. No clock and no device.
//!
//! - [`plc`]: M, S and T functions by handshake with a PLC (seed 001)

pub mod plc;
