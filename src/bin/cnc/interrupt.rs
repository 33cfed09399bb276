//! Counts how often the operator asked to stop (Ctrl-C, or the system's wish to end).
//!
//! A file that grows beyond what the system allows ends no process: whoever writes it is told.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::iterator::Signals;

/// How often the operator asked to stop.
#[derive(Clone, Debug)]
pub struct Interrupts {
    count: Arc<AtomicUsize>,
    /// The system wants the process to end.
    must_end: Arc<AtomicBool>,
}

impl Interrupts {
    /// Takes over the signals that would end the process.
    pub fn watch() -> io::Result<Self> {
        let count = Arc::new(AtomicUsize::new(0));
        let must_end = Arc::new(AtomicBool::new(false));
        let mut signals = Signals::new([SIGINT, SIGTERM, SIGHUP, SIGXFSZ])?;
        let (counted, ends) = (Arc::clone(&count), Arc::clone(&must_end));
        std::thread::spawn(move || {
            for signal in signals.forever().filter(|signal| *signal != SIGXFSZ) {
                ends.fetch_or(signal != SIGINT, Ordering::Relaxed);
                counted.fetch_add(1, Ordering::Relaxed);
            }
        });
        Ok(Interrupts { count, must_end })
    }

    /// Whether one of them was the system's wish (SIGTERM, SIGHUP), which asks nobody.
    pub fn must_end(&self) -> bool {
        self.must_end.load(Ordering::Relaxed)
    }

    /// How often so far.
    pub fn count(&self) -> usize {
        self.count.load(Ordering::Relaxed)
    }
}
