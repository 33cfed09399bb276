//! Counts how often the operator asked to stop (Ctrl-C), or the system did (`kill`, a terminal that
//! is closed). A file that grows beyond what the system allows ends no process: whoever writes it is
//! told.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicI32, AtomicUsize, Ordering};

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::iterator::Signals;

/// How often somebody asked to stop, and who did last.
#[derive(Clone, Debug, Default)]
pub struct Interrupts {
    count: Arc<AtomicUsize>,
    signal: Arc<AtomicI32>,
}

impl Interrupts {
    /// Takes over the signals that would end the process. A hang-up that is ignored already, as under
    /// `nohup`, stays so.
    pub fn watch() -> io::Result<Self> {
        let interrupts = Interrupts::default();
        let hang_up = (!is_ignored(SIGHUP)).then_some(SIGHUP);
        let mut signals = Signals::new([SIGINT, SIGTERM, SIGXFSZ].into_iter().chain(hang_up))?;
        let counted = interrupts.clone();
        std::thread::spawn(move || {
            for signal in signals.forever().filter(|signal| *signal != SIGXFSZ) {
                counted.signal.store(signal, Ordering::Relaxed);
                counted.count.fetch_add(1, Ordering::Relaxed);
            }
        });
        Ok(interrupts)
    }

    /// How often so far.
    pub fn count(&self) -> usize {
        self.count.load(Ordering::Relaxed)
    }

    /// What has ended the process's time, if it was not the operator: nobody is there to be asked.
    pub fn by_system(&self) -> Option<&'static str> {
        match self.signal.load(Ordering::Relaxed) {
            SIGTERM => Some("told to end (SIGTERM)"),
            SIGHUP => Some("the terminal is gone (SIGHUP)"),
            _ => None,
        }
    }
}

/// Whether whoever started this process has it ignore a signal.
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}
