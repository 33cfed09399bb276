//! How far a long computation is: passes over programs and dumps → a line on standard error with
//! what is done and the time left, and the operator's wish to stop → an error that ends the pass.
//!
//! Passes at the same time are one stage, as far as the one that is furthest. A thread of its own
//! draws, from the second second on: on a terminal a bar, elsewhere a line every ten seconds, with
//! `--quiet` nothing. While results are written to the same terminal nothing is drawn either.

use std::fmt;
use std::io::{self, IsTerminal, stderr, stdout};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use cnc::base::Source;
use cnc::base::source::Watch;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::interrupt;

/// What a whole stage is.
const WHOLE: u64 = 1_000_000;
/// From when on a stage is shown.
const SHOWN_AFTER: Duration = Duration::from_secs(1);
/// How often a terminal is drawn.
const DRAWN: Duration = Duration::from_millis(200);
/// How often a line is said where there is no terminal.
const SAID: Duration = Duration::from_secs(10);
/// Texts below this are read at once: how far a pass over one has read tells nothing.
const TOLD_BYTES: u64 = 1 << 20;
/// Parts of its whole after which a pass looks for the operator and tells how far it is.
const PARTS: u64 = 1 << 8;

/// Passes under way.
static PASSES: AtomicUsize = AtomicUsize::new(0);
/// How far the stage is, of [`WHOLE`]; 0 while nothing is known.
static SHARE: AtomicU64 = AtomicU64::new(0);
/// Whether the stage is as far as its texts have been read.
static BY_BYTES: AtomicBool = AtomicBool::new(false);
/// Whether the stage is many programs: a pass over one of them tells nothing.
static IS_OF_MANY: AtomicBool = AtomicBool::new(false);
/// How often the operator had asked to stop before the stage began.
static STOPS_BEFORE: AtomicUsize = AtomicUsize::new(0);
static SHOWN: Mutex<Shown> =
    Mutex::new(Shown { is_wanted: false, has_painter: false, stage: None, said: None, bar: None });

/// What the thread that draws has to know.
struct Shown {
    is_wanted: bool,
    has_painter: bool,
    /// What is done, and since when.
    stage: Option<(&'static str, Instant)>,
    /// When a line was said last.
    said: Option<Instant>,
    bar: Option<ProgressBar>,
}

/// The operator wants no more of it.
#[derive(Clone, Copy, Debug)]
pub struct Interrupted;

impl std::error::Error for Interrupted {}

impl fmt::Display for Interrupted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("interrupted")
    }
}

impl Interrupted {
    /// Whether an error comes from the operator.
    pub fn is_in(error: &(dyn std::error::Error + 'static)) -> bool {
        let inner = error.downcast_ref::<io::Error>().and_then(io::Error::get_ref);
        error.is::<Interrupted>() || inner.is_some_and(|inner| inner.is::<Interrupted>())
    }
}

/// A pass over a program or a dump, from its making to its end.
#[derive(Debug)]
pub struct Pass;

/// Says whether anything is to be shown at all.
pub fn show(is_wanted: bool) {
    shown().is_wanted = is_wanted;
}

/// Shows nothing from here on if results go to the terminal, line by line.
pub fn leave_terminal_to_results() {
    if stdout().is_terminal() {
        let mut shown = shown();
        shown.is_wanted = false;
        shown.clear();
    }
}

/// Does something with standard error while no bar is drawn there.
pub fn above<T>(say: impl FnOnce() -> T) -> T {
    let bar = shown().bar.clone();
    match bar {
        Some(bar) => bar.suspend(say),
        None => say(),
    }
}

impl Pass {
    /// A pass that tells by [`Pass::at`] how far it is.
    pub fn begin(what: &'static str) -> Pass {
        Pass::new(what, false)
    }

    /// A pass that is as far as the texts that it reads.
    pub fn of_text(what: &'static str) -> Pass {
        Pass::new(what, true)
    }

    /// A pass over many programs, begun before any of them is: as far as [`Pass::many_at`] tells.
    pub fn of_many(what: &'static str) -> Pass {
        let pass = Pass::new(what, false);
        IS_OF_MANY.store(true, Ordering::Relaxed);
        pass
    }

    fn new(what: &'static str, by_bytes: bool) -> Pass {
        let stops = interrupt::look();
        if PASSES.fetch_add(1, Ordering::SeqCst) == 0 {
            STOPS_BEFORE.store(stops, Ordering::Relaxed);
            BY_BYTES.store(by_bytes, Ordering::Relaxed);
            IS_OF_MANY.store(false, Ordering::Relaxed);
            SHARE.store(0, Ordering::Relaxed);
            let mut shown = shown();
            shown.stage = Some((what, Instant::now()));
            if shown.is_wanted && !shown.has_painter {
                shown.has_painter = true;
                std::thread::spawn(paint);
            }
        }
        Pass
    }

    /// So much of all is done.
    ///
    /// # Errors
    /// The operator wants no more of it.
    pub fn at(&self, done: u64, total: u64) -> Result<(), Interrupted> {
        if !BY_BYTES.load(Ordering::Relaxed) && !IS_OF_MANY.load(Ordering::Relaxed) {
            tell(done, total);
        }
        go_on()
    }

    /// So many programs of all are done.
    ///
    /// # Errors
    /// The operator wants no more of it.
    pub fn many_at(&self, done: u64, total: u64) -> Result<(), Interrupted> {
        tell(done, total);
        go_on()
    }

    /// Whether it is time to call [`Pass::at`].
    pub fn is_due(done: u64, total: u64) -> bool {
        done.is_multiple_of((total / PARTS).clamp(1, PARTS))
    }
}

impl Drop for Pass {
    fn drop(&mut self) {
        interrupt::look_away();
        if PASSES.fetch_sub(1, Ordering::SeqCst) == 1 {
            let mut shown = shown();
            shown.stage = None;
            shown.clear();
        }
    }
}

/// A text whose passes tell how far they have read, and end when the operator wants it.
pub fn watched(source: Source) -> io::Result<Source> {
    let length = source.length()?;
    Ok(source.watched_by(Arc::new(Reading { length })))
}

#[derive(Debug)]
struct Reading {
    length: u64,
}

impl Watch for Reading {
    fn at(&self, offset: u64) -> io::Result<()> {
        if BY_BYTES.load(Ordering::Relaxed) && self.length >= TOLD_BYTES {
            tell(offset, self.length);
        }
        self.go_on()
    }

    fn go_on(&self) -> io::Result<()> {
        match PASSES.load(Ordering::Relaxed) {
            0 => Ok(()),
            _ => go_on().map_err(io::Error::other),
        }
    }
}

fn tell(done: u64, total: u64) {
    if total > 0 {
        let share = u128::from(done.min(total)) * u128::from(WHOLE) / u128::from(total);
        SHARE.fetch_max(share as u64, Ordering::Relaxed);
    }
}

fn go_on() -> Result<(), Interrupted> {
    match interrupt::stops() > STOPS_BEFORE.load(Ordering::Relaxed) {
        true => Err(Interrupted),
        false => Ok(()),
    }
}

fn shown() -> MutexGuard<'static, Shown> {
    SHOWN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Draws for as long as the process lives.
fn paint() {
    let is_terminal = stderr().is_terminal();
    loop {
        std::thread::sleep(DRAWN);
        shown().draw(is_terminal);
    }
}

impl Shown {
    fn draw(&mut self, is_terminal: bool) {
        let Some((what, since)) = self.stage.filter(|_| self.is_wanted) else { return };
        let elapsed = since.elapsed();
        if elapsed < SHOWN_AFTER {
            return;
        }
        let share = SHARE.load(Ordering::Relaxed);
        if is_terminal {
            let bar = self.bar.get_or_insert_with(bar);
            bar.set_position(share);
            bar.set_message(told(what, share, elapsed));
        } else if self.said.unwrap_or(since).elapsed() >= SAID {
            self.said = Some(Instant::now());
            say_below(&told(what, share, elapsed));
        }
    }

    fn clear(&mut self) {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
    }
}

/// A line where there is no bar that it could meet.
fn say_below(line: &str) {
    use std::io::Write;
    // Nothing can be said to a standard error that is gone.
    let _ = writeln!(stderr(), "{line}");
}

fn bar() -> ProgressBar {
    let target = ProgressDrawTarget::stderr_with_hz(10);
    let bar = ProgressBar::with_draw_target(Some(WHOLE), target);
    // The template is fixed and known to be right; a bar without it would do as well.
    match ProgressStyle::with_template("{bar:20} {wide_msg}") {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}

/// `planning: 43 %, 0:12 left`.
fn told(what: &str, share: u64, elapsed: Duration) -> String {
    let whole = |seconds: f64| {
        let seconds = seconds.ceil() as u64;
        format!("{}:{:02}", seconds / 60, seconds % 60)
    };
    if share == 0 {
        return format!("{what}: {} so far", whole(elapsed.as_secs_f64()));
    }
    let left_s = elapsed.as_secs_f64() * (WHOLE - share) as f64 / share as f64;
    format!("{what}: {} %, {} left", share * 100 / WHOLE, whole(left_s))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_is_told_by_what_was_done() {
        let check = |share, seconds, expected: &str| {
            assert_eq!(told("planning", share, Duration::from_secs(seconds)), expected);
        };
        check(0, 3, "planning: 0:03 so far");
        check(WHOLE / 4, 30, "planning: 25 %, 1:30 left");
        check(WHOLE, 30, "planning: 100 %, 0:00 left");
    }

    #[test]
    fn a_stop_is_found_however_deep() {
        let error = anyhow::Error::from(io::Error::other(Interrupted)).context("reading");
        assert!(error.chain().any(Interrupted::is_in));
        let other = anyhow::Error::from(io::Error::other("else"));
        assert!(!other.chain().any(Interrupted::is_in));
    }
}
