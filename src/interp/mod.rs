//! 2 Block → Motion
mod motion;
pub use motion::{Motion, Move, MoveKind};
