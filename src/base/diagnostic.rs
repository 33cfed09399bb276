//! What is wrong with a program, as data: many at once, drawn by `bin`.

/// How bad a diagnostic is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// The program runs; somebody should look.
    Warning,
    /// No motion comes out of a program with an error.
    Error,
}

/// Where in a program: a stretch of one physical line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Span {
    /// Physical line, from 1.
    pub line: u32,
    /// Byte of the line at which the stretch begins, from 0.
    pub start: u32,
    /// Byte of the line just after the stretch.
    pub end: u32,
}

/// Where a subprogram was called.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct CallSite {
    /// Physical line of the call, from 1.
    pub line: u32,
    /// The file, where it is not the one that was handed in.
    pub file: Option<String>,
}

/// One thing that is wrong with a program.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagnostic {
    /// How bad it is.
    pub severity: Severity,
    /// Name of the rule that is broken, as `arc-radius`.
    pub rule: &'static str,
    /// Where.
    pub span: Span,
    /// The line at fault, without its line end; bytes that are no UTF-8 are replaced. Long lines
    /// are cut to the surroundings of the span, see [`Diagnostic::text_offset`].
    pub text: String,
    /// Bytes of the line that were cut off before [`Diagnostic::text`].
    pub text_offset: u32,
    /// What was found.
    pub message: String,
    /// What to write instead, where that can be known.
    pub help: Option<String>,
    /// The calls that led here, outermost first: empty in the main program.
    pub calls: Vec<CallSite>,
    /// The file, where it is not the one that was handed in: that of a subprogram.
    pub file: Option<String>,
}

impl Diagnostic {
    /// Column of the fault in characters, from 1.
    pub fn column(&self) -> u32 {
        self.column_of(self.span.start)
    }

    /// Column just after the fault in characters, from 1: at least that of the fault.
    pub fn end_column(&self) -> u32 {
        self.column_of(self.span.end.max(self.span.start))
    }

    fn column_of(&self, byte: u32) -> u32 {
        let within = byte.saturating_sub(self.text_offset) as usize;
        let chars = self.text.char_indices().take_while(|(at, _)| *at < within).count();
        self.text_offset + chars as u32 + 1
    }
}
