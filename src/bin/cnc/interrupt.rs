//! Counts how often the operator asked to stop (Ctrl-C), or the system did (`kill`, a terminal that
//! is closed). A file that grows beyond what the system allows ends no process: whoever writes it is
//! told.
//!
//! Once somebody counts, a signal ends the process no more by itself, except where all that goes on
//! is computing: there the first is found by who looks at the count, and the second ends it at once.

use std::io;
use std::sync::atomic::{AtomicBool, AtomicI32, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::iterator::Signals;
use signal_hook::low_level::emulate_default_handler;

/// How often somebody asked to stop.
static COUNT: AtomicUsize = AtomicUsize::new(0);
/// Who did last.
static SIGNAL: AtomicI32 = AtomicI32::new(0);
/// Whether signals are counted.
static IS_COUNTED: Mutex<bool> = Mutex::new(false);
/// Whether somebody knows what to do about any number of them.
static IS_OWNED: AtomicBool = AtomicBool::new(false);
/// Computations that look at the count.
static LOOKING: AtomicUsize = AtomicUsize::new(0);

/// How often somebody has asked to stop since this was made, and who did last.
#[derive(Clone, Debug)]
pub struct Interrupts {
    before: usize,
}

impl Interrupts {
    /// Takes over the signals that would end the process. A hang-up that is ignored already, as under
    /// `nohup`, stays so.
    pub fn watch() -> io::Result<Self> {
        count_signals()?;
        IS_OWNED.store(true, Ordering::SeqCst);
        Ok(Interrupts { before: stops() })
    }

    /// How often so far.
    pub fn count(&self) -> usize {
        stops() - self.before
    }

    /// What has ended the process's time, if it was not the operator: nobody is there to be asked.
    pub fn by_system(&self) -> Option<&'static str> {
        match SIGNAL.load(Ordering::Relaxed) {
            SIGTERM => Some("told to end (SIGTERM)"),
            SIGHUP => Some("the terminal is gone (SIGHUP)"),
            _ => None,
        }
    }
}

/// How often somebody has asked to stop.
pub fn stops() -> usize {
    COUNT.load(Ordering::Relaxed)
}

/// A computation begins that looks at [`stops`]; gives how often it was so far.
pub fn look() -> usize {
    // What comes from here on is for the computation.
    let before = stops();
    LOOKING.fetch_add(1, Ordering::SeqCst);
    // Without a count the first signal ends the process, as it would any other.
    let _ = count_signals();
    before
}

/// It has ended.
pub fn look_away() {
    LOOKING.fetch_sub(1, Ordering::SeqCst);
}

fn count_signals() -> io::Result<()> {
    let mut is_counted = IS_COUNTED.lock().unwrap_or_else(PoisonError::into_inner);
    if *is_counted {
        return Ok(());
    }
    let hang_up = (!is_ignored(SIGHUP)).then_some(SIGHUP);
    let mut signals = Signals::new([SIGINT, SIGTERM, SIGXFSZ].into_iter().chain(hang_up))?;
    *is_counted = true;
    std::thread::spawn(move || {
        for signal in signals.forever().filter(|signal| *signal != SIGXFSZ) {
            SIGNAL.store(signal, Ordering::Relaxed);
            let before = COUNT.fetch_add(1, Ordering::SeqCst);
            let is_heard = LOOKING.load(Ordering::SeqCst) > 0 && before == 0;
            if !IS_OWNED.load(Ordering::SeqCst) && !is_heard {
                // Where the system does not let it, nothing is lost: the next one tries again.
                let _ = emulate_default_handler(signal);
            }
        }
    });
    Ok(())
}

/// Whether whoever started this process has it ignore a signal.
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}
