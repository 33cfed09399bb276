//! One file a command.

pub mod bus;
pub mod completions;
pub mod cut;
pub mod diff;
pub mod explain;
pub mod home;
pub mod interpolate;
pub mod interpret;
pub mod jog;
pub mod machine;
pub mod man;
pub mod node;
pub mod plot;
pub mod ports;
pub mod replay;
pub mod report;
pub mod send;
pub mod verify;
