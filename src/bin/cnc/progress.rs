//! Shows how far a job is: two lines on a terminal (indicatif), now and then a line elsewhere.
//!
//! A thread of its own does it: a terminal that takes nothing (Ctrl-S, a slow line) must not hold up
//! whoever paces the ticks.

use std::io::{IsTerminal, stderr};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use cnc::base::Progress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// How often a terminal is drawn: as much as anybody can read.
const DRAWN: Duration = Duration::from_millis(1000 / DRAWN_HZ as u64);
/// The same as a rate.
const DRAWN_HZ: u8 = 10;
/// How often a line is said where there is no terminal.
const SAID: Duration = Duration::from_secs(10);

/// What is shown of a job at one time.
#[derive(Clone, Debug, Default)]
pub struct Shown {
    /// Ticks done.
    pub done: u64,
    /// Beside the bar.
    pub first: String,
    /// Below it.
    pub second: String,
}

/// A progress bar on standard error.
pub struct Bar {
    bar: ProgressBar,
    quiet: bool,
    due: Instant,
    painter: Option<Painter>,
}

/// The thread that shows, and how it is told.
struct Painter {
    told: Arc<Told>,
    thread: JoinHandle<()>,
}

#[derive(Default)]
struct Told {
    newest: Mutex<Option<Box<dyn FnOnce() -> Shown + Send>>>,
    is_over: AtomicBool,
}

impl Bar {
    /// A bar that shows from its beginning on, unless the user wants errors only.
    pub fn new(quiet: bool) -> Self {
        Bar { bar: ProgressBar::hidden(), quiet, due: Instant::now(), painter: None }
    }

    /// Whether it is time to show something new.
    pub fn is_due(&self) -> bool {
        self.painter.is_some() && Instant::now() >= self.due
    }

    /// Shows what this makes, in a while; it is made by the thread that shows it. Never waits.
    pub fn show(&mut self, make: impl FnOnce() -> Shown + Send + 'static) {
        self.due = Instant::now() + DRAWN;
        if let Some(mut newest) =
            self.painter.as_ref().and_then(|painter| painter.told.newest.try_lock().ok())
        {
            *newest = Some(Box::new(make));
        }
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
        if self.quiet || total == 0 {
            return;
        }
        // The template is fixed and known to be right; a bar without it would do as well.
        if let Ok(style) =
            ProgressStyle::with_template("{bar:20} {percent:>3} %  {prefix}\n{wide_msg}")
        {
            self.bar.set_style(style);
        }
        self.bar.set_length(total);
        self.bar.set_draw_target(ProgressDrawTarget::stderr_with_hz(DRAWN_HZ));
        let told = Arc::new(Told::default());
        let (bar, heard) = (self.bar.clone(), Arc::clone(&told));
        let thread = std::thread::spawn(move || paint(&bar, &heard, total));
        self.painter = Some(Painter { told, thread });
    }

    fn end(&mut self) {
        if let Some(Painter { told, thread }) = self.painter.take() {
            told.is_over.store(true, Ordering::Relaxed);
            thread.thread().unpark();
            // A thread that has failed has nothing more to show.
            let _ = thread.join();
        }
        self.bar.finish_and_clear();
    }
}

fn paint(bar: &ProgressBar, told: &Told, total: u64) {
    let is_terminal = stderr().is_terminal();
    let mut said = Instant::now();
    while !told.is_over.load(Ordering::Relaxed) {
        std::thread::park_timeout(DRAWN);
        let is_due = is_terminal || said.elapsed() >= SAID;
        let newest = told.newest.lock().ok().and_then(|mut newest| newest.take());
        let Some(make) = newest.filter(|_| is_due) else { continue };
        let Shown { done, first, second } = make();
        if is_terminal {
            // The first of these draws, unless a line of the job has been said just now.
            bar.set_message(second);
            bar.set_position(done);
            bar.set_prefix(first);
        } else {
            said = Instant::now();
            let percent = (done * 100).checked_div(total).unwrap_or(0);
            say!("{percent} %  {first}  {second}");
        }
    }
}
