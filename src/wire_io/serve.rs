//! Virtual nodes on a pseudo-terminal, by the clock.

use std::io;
use std::time::Duration;

use crate::wire::{Entry, Nodes, Struck};
use crate::wire_io::clock::{Clock, Speed};
use crate::wire_io::pty::{Pty, Received};

/// Longest sleep, so that an operator's stop is seen.
const SLEEP_MAX: Duration = Duration::from_millis(50);
/// How often a pseudo-terminal that nobody has opened is looked at.
const NOBODY: Duration = Duration::from_millis(5);

/// Who watches virtual nodes, and how they run.
pub struct Serving<'a> {
    /// How fast their time runs.
    pub speed: Speed,
    /// End when the peer has closed.
    pub once: bool,
    /// Told of everything that happens on a node.
    pub entry: &'a mut dyn FnMut(&Entry),
    /// Told of every fault that has struck.
    pub struck: &'a mut dyn FnMut(&Struck),
    /// Whether to end now.
    pub stopped: &'a dyn Fn() -> bool,
}

/// Runs nodes until it is stopped, or the peer has closed and `once` is set, or a fault has closed the
/// port.
///
/// # Errors
/// When the pseudo-terminal fails.
pub fn serve(pty: &mut Pty, nodes: &mut Nodes, mut serving: Serving<'_>) -> io::Result<()> {
    let mut clock = Clock::new(serving.speed);
    let mut bytes = [0; 4096];
    while !(serving.stopped)() {
        let wait = match nodes.poll_timeout() {
            Some(next_us) => {
                // Time that need not pass has passed once something is due.
                clock.jump_to(next_us);
                clock.until(next_us).min(SLEEP_MAX)
            }
            None => SLEEP_MAX,
        };
        match pty.read(&mut bytes, wait)? {
            Received::Bytes(count) => {
                // A host that does not wait for time to pass takes the nodes' tick as passed.
                clock.jump_to(nodes.ready_us());
                nodes.handle_bytes(clock.now_us(), bytes.get(..count).unwrap_or_default());
            }
            Received::Nothing => {}
            Received::Closed => {
                if serving.once {
                    settle(nodes, &mut clock, serving.stopped);
                    report(nodes, &mut serving);
                    return Ok(());
                }
                std::thread::sleep(NOBODY);
            }
        }
        let now_us = clock.now_us();
        nodes.advance(now_us);
        let mut answers = Vec::new();
        while let Some(byte) = nodes.poll_answer(now_us) {
            answers.push(byte);
        }
        if !answers.is_empty() {
            pty.write(&answers)?;
        }
        report(nodes, &mut serving);
        if nodes.is_closed() {
            return Ok(());
        }
    }
    Ok(())
}

/// What is still on the wire reaches the nodes: minutes pass if a host wrote without waiting.
fn settle(nodes: &mut Nodes, clock: &mut Clock, stopped: &dyn Fn() -> bool) {
    while let Some(next_us) = nodes.poll_timeout().filter(|_| !stopped()) {
        let wait = clock.until(next_us);
        std::thread::sleep(wait.min(SLEEP_MAX));
        if wait > SLEEP_MAX {
            continue;
        }
        clock.jump_to(next_us);
        let now_us = clock.now_us().max(next_us);
        nodes.advance(now_us);
        while nodes.poll_answer(now_us).is_some() {}
    }
}

fn report(nodes: &mut Nodes, serving: &mut Serving<'_>) {
    while let Some(struck) = nodes.poll_struck() {
        (serving.struck)(&struck);
    }
    while let Some(happening) = nodes.poll_log() {
        (serving.entry)(&happening);
    }
}
