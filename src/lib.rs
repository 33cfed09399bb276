//! cnc

pub mod base;
pub mod gcode;
pub mod interp;
pub mod path;
pub mod plan;
pub mod step;
pub mod tape;
pub mod verify;
pub mod wire;
pub mod wire_io;
