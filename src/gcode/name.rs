//! Names of parameters. A loop looks its names up in every pass, so a name is hashed once, where it
//! is read: by FNV-1a (Fowler, Noll, Vo), which suits short texts.

use std::fmt;
use std::hash::{Hash, Hasher};

/// The name of a parameter, in lower case without blanks.
#[derive(Debug, PartialEq, Eq)]
pub struct Name {
    /// FNV-1a of 64 bits of the text.
    hash: u64,
    text: Box<str>,
}

impl Name {
    /// A name of this text.
    pub fn new(text: &str) -> Name {
        let add =
            |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        Name { hash: text.bytes().fold(0xcbf2_9ce4_8422_2325, add), text: text.into() }
    }

    /// Its text.
    pub fn as_str(&self) -> &str {
        &self.text
    }

    /// Whether the parameter is one of the whole program, and not of a subprogram.
    pub fn is_global(&self) -> bool {
        self.text.starts_with('_')
    }
}

/// Gives the hash that is known as the only number, for a hasher that takes it as it is.
impl Hash for Name {
    fn hash<H: Hasher>(&self, hasher: &mut H) {
        hasher.write_u64(self.hash);
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}
