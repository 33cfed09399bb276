//! Named parameters and their values. Names know their hash: see [`Name`].

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};
use std::rc::Rc;

use crate::gcode::Name;

/// Values by name.
pub(super) type Names = HashMap<Rc<Name>, f64, BuildHasherDefault<Known>>;

/// Takes the hash of a name as it is.
#[derive(Debug, Default)]
pub(super) struct Known(u64);

impl Hasher for Known {
    fn write(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.write_u64(u64::from(*byte));
        }
    }

    fn write_u64(&mut self, hash: u64) {
        self.0 = self.0.rotate_left(8) ^ hash;
    }

    fn finish(&self) -> u64 {
        self.0
    }
}
