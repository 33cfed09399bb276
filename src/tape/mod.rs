//! 6 Tick ⇄ files: the command dump, a CSV with a header that says what it was made from and a
//! last line that seals it.
//!
//! ```text
//! # cnc-dump: 1                       header: program, machine, options, start   [`Header`]
//! …
//! tick,buffer,line,X,Y,Z,event        hashed from here …
//! 0,0,3,5,-3,0,M3 S1200               one row a tick; events happen before it
//! …
//! 1234,2,9,0,0,0,M30                  events after the last motion: a row that is no tick
//! # end: ticks=1234 X=… Y=… Z=… sha256:…          … to here
//! ```
//!
//! Rules it keeps: what [`Writer`] is given comes back from [`Reader`] (an event's own line alone
//! becomes that of its row), in constant memory; nothing that was cut, changed or added passes the
//! reader's last item. The final row of zeros that carries trailing events has the number of the
//! tick that would follow and is not counted in `ticks=`, so a job lasts `ticks` · `tick_us`
//! whatever ends it; a motionless tick at the end of a job is told from it by that count.
//!
//! Whether a dump belongs to a program or machine is for its user to compare; no count is judged
//! here.

mod header;
mod reader;
mod rows;
mod writer;

use std::io;

pub use self::header::{Encoding, Header, Origin};
pub use self::reader::Reader;
pub use self::writer::Writer;

/// The version of the format, as its first line has it.
const VERSION: &str = "1";

/// What the first line of every dump begins with.
const MAGIC: &str = "# cnc-dump:";

/// Whether a file that begins with these bytes is a dump; 11 of them suffice.
pub fn looks_like_dump(first_bytes: &[u8]) -> bool {
    first_bytes.starts_with(MAGIC.as_bytes())
}

/// A dump that cannot be read, or that is not what was sealed.
#[derive(Debug, thiserror::Error)]
pub enum TapeError {
    /// The file itself.
    #[error("the dump cannot be read")]
    Io(#[from] io::Error),
    /// The first line is another.
    #[error("this is no command dump: its first line is not '{MAGIC} {VERSION}'")]
    NotADump,
    /// Made by another release.
    #[error("version {0} of the dump format is unknown; known is {VERSION}")]
    Version(String),
    /// A header line.
    #[error("header of the dump, line {line}: {reason}")]
    Header {
        /// Line of the dump, from 1.
        line: u64,
        /// What is wrong with it.
        reason: String,
    },
    /// A row.
    #[error("line {line} of the dump: {reason}")]
    Row {
        /// Line of the dump, from 1.
        line: u64,
        /// What is wrong with it.
        reason: String,
    },
    /// The last line is missing.
    #[error(
        "the dump is truncated: it ends after line {line} without its last line '# end: …'; copy all of it, or make it anew"
    )]
    Truncated {
        /// Last line that is there, from 1.
        line: u64,
    },
    /// The last line does not agree with the rows.
    #[error("the seal of the dump is broken: {0}")]
    Seal(String),
}
