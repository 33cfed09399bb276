//! A virtual PLC on a pseudo-terminal, by the clock.

use std::io;
use std::time::{Duration, Instant};

use crate::systems::plc::message::{self, Ear};
use crate::systems::plc::{Plc, PlcHappening, Signals};
use crate::wire_io::pty::{Pty, Received};

/// How often the PLC's level is sent, whether it has changed or not.
const AGAIN: Duration = Duration::from_millis(50);
/// How often a pseudo-terminal that nobody has opened is looked at.
const NOBODY: Duration = Duration::from_millis(5);

/// Runs a PLC until it is stopped, or the peer has closed and `once` is set. `happened` is told of
/// everything that happens, with its time in microseconds.
///
/// # Errors
/// When the pseudo-terminal fails.
pub fn serve_plc(
    pty: &mut Pty,
    plc: &mut Plc,
    once: bool,
    happened: &mut dyn FnMut(u64, PlcHappening),
    stopped: &dyn Fn() -> bool,
) -> io::Result<()> {
    let start = Instant::now();
    let mut ear = Ear::default();
    let (mut told, mut told_at) = (None, start);
    while !stopped() {
        let now_us = || start.elapsed().as_micros() as u64;
        let until_us = plc.next_us().unwrap_or(u64::MAX).saturating_sub(now_us());
        let wait = Duration::from_micros(until_us).min(AGAIN);
        let mut bytes = [0; 256];
        match pty.read(&mut bytes, wait)? {
            Received::Bytes(count) => {
                for byte in bytes.iter().take(count) {
                    if let Some(signals) = ear.nc(*byte) {
                        plc.hear(now_us(), signals);
                    }
                }
            }
            Received::Nothing => {}
            Received::Closed if once => return Ok(()),
            Received::Closed => {
                // Nobody holds a level up.
                plc.hear(now_us(), Signals::default());
                told = None;
                std::thread::sleep(NOBODY);
                continue;
            }
        }
        plc.advance(now_us());
        while let Some((at_us, happening)) = plc.poll_happening() {
            happened(at_us, happening);
        }
        let fin = plc.fin();
        if told != Some(fin) || told_at.elapsed() >= AGAIN {
            pty.write(&message::of_plc(fin))?;
            (told, told_at) = (Some(fin), Instant::now());
        }
    }
    Ok(())
}
