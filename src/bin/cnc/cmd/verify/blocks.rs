//! `--blocks`: how far each block is off.

use std::io::{self, Write};

use cnc::verify::BlockError;
use serde::Serialize;

/// A block as JSON.
#[derive(Serialize)]
struct Line<'a> {
    r#type: &'static str,
    #[serde(flatten)]
    block: &'a BlockError,
}

/// Writes a row or an object a block as it comes.
pub struct Rows<W: Write> {
    out: W,
    as_json: bool,
    has_head: bool,
    written: io::Result<()>,
}

impl<W: Write> Rows<W> {
    pub fn new(out: W, as_json: bool) -> Rows<W> {
        Rows { out, as_json, has_head: false, written: Ok(()) }
    }

    /// The next block. After a row that could not be written, none is.
    pub fn tell(&mut self, block: &BlockError) {
        if self.written.is_ok() {
            self.written = self.row(block);
        }
    }

    fn row(&mut self, block: &BlockError) -> io::Result<()> {
        if self.as_json {
            let object = serde_json::to_string(&Line { r#type: "block", block })?;
            return writeln!(self.out, "{object}");
        }
        self.head()?;
        let BlockError { line, ticks, tick, max_mm, allowed_mm, rms_mm } = *block;
        let rms_mm = rms_mm.map_or("-".to_owned(), |rms_mm| format!("{rms_mm:.6}"));
        write!(self.out, " {line:>9} {ticks:>9} {max_mm:>9.6} {allowed_mm:>9.6}")?;
        writeln!(self.out, " {tick:>9} {rms_mm:>9}")
    }

    /// What stands above the rows, if it does not yet.
    fn head(&mut self) -> io::Result<()> {
        if std::mem::replace(&mut self.has_head, true) {
            return Ok(());
        }
        writeln!(self.out, "distance from the path in mm, by block")?;
        writeln!(self.out)?;
        let columns = ["line", "ticks", "most", "allowed", "at tick", "rms"];
        columns.iter().try_for_each(|name| write!(self.out, " {name:>9}"))?;
        writeln!(self.out)
    }

    /// All blocks were told of.
    ///
    /// # Errors
    /// Why the rows were not all written.
    pub fn end(mut self) -> io::Result<()> {
        self.written?;
        match self.as_json || self.has_head {
            true => Ok(()),
            false => writeln!(
                self.out,
                "no block to tell of: none moves, or the job is further off than is found out"
            ),
        }
    }
}
