//! Draws progress on a terminal (indicatif); draws nothing where there is none.

use std::time::Duration;

use cnc::base::Progress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A progress bar on standard error.
pub struct Bar {
    bar: ProgressBar,
    quiet: bool,
    buffer: u32,
    drawn: Option<(u64, u32)>,
}

impl Bar {
    /// A bar that shows from its beginning on, unless the user wants errors only.
    pub fn new(quiet: bool) -> Self {
        Bar { bar: ProgressBar::hidden(), quiet, buffer: 0, drawn: None }
    }

    /// The node buffer that is filled or executed.
    pub fn buffer(&mut self, buffer: u32) {
        self.buffer = buffer;
    }

    /// Prints a line on standard error, above the bar.
    pub fn say(&self, text: &str) {
        self.bar.suspend(|| say!("{text}"));
    }

    /// Takes the bar away while something asks the operator.
    pub fn suspend<T>(&self, ask: impl FnOnce() -> T) -> T {
        self.bar.suspend(ask)
    }
}

impl Progress for Bar {
    fn begin(&mut self, total: u64) {
        // The template is fixed and known to be right; a bar without it would do as well.
        if let Ok(style) = ProgressStyle::with_template(
            "{bar:30} {percent:>3} %  {pos}/{len} ticks  {msg}  {eta} left",
        ) {
            self.bar.set_style(style);
        }
        self.bar.set_length(total);
        if self.quiet {
            return;
        }
        self.bar.set_draw_target(ProgressDrawTarget::stderr());
        self.bar.enable_steady_tick(Duration::from_millis(200));
    }

    fn set(&mut self, done: u64, line: u32) {
        // A hundred updates a second are more than anybody sees; ticks may come by the million.
        let seen = self.drawn.is_some_and(|(at, at_line)| {
            done >= at && done - at < 1024 && (line == at_line || !done.is_multiple_of(16))
        });
        if seen {
            return;
        }
        self.drawn = Some((done, line));
        self.bar.set_position(done);
        self.bar.set_message(format!("buffer {}  line {line}", self.buffer));
    }

    fn end(&mut self) {
        self.bar.finish_and_clear();
    }
}
