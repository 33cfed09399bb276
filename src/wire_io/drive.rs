//! A master and a link → a job done, or the reason why not.

use crate::base::Event;
use crate::wire::{Ending, Master, MasterEvent};
use crate::wire_io::link::{Link, LinkError};

/// Whoever runs the job: is told, is asked, and may interrupt.
pub trait Operator {
    /// Told of every event that asks nothing.
    fn event(&mut self, event: &MasterEvent);
    /// An event waits for a person, all nodes idle: go on?
    fn pause(&mut self, event: &Event) -> bool;
    /// A hold took effect, of which [`Operator::event`] has told: go on? Nobody there: no.
    fn held(&mut self, _master: &Master) -> bool {
        false
    }
    /// Told again and again how far the job is.
    fn progress(&mut self, master: &Master);
    /// How often the operator has asked to stop so far.
    fn interrupts(&mut self) -> usize;
}

/// Runs a job to its end. A stop of the operator holds at the next tick at which all axes are
/// slow enough, where the job goes on or ends as the operator says; a second one does not wait for
/// that.
pub fn drive(link: &mut impl Link, master: &mut Master, operator: &mut impl Operator) -> Ending {
    link.urgent(true);
    let ending = run(link, master, operator);
    link.urgent(false);
    link.drain();
    ending
}

fn run(link: &mut impl Link, master: &mut Master, operator: &mut impl Operator) -> Ending {
    let mut bytes = Vec::new();
    let mut interrupts = 0;
    loop {
        while let Some(event) = master.poll_event() {
            match &event {
                MasterEvent::Ended(ending) => return ending.clone(),
                MasterEvent::Pause(pause) => {
                    link.urgent(false);
                    let go_on = operator.pause(pause);
                    link.urgent(true);
                    if go_on {
                        master.resume(link.now_us());
                    } else {
                        master.abandon();
                    }
                }
                MasterEvent::Held { .. } => {
                    operator.event(&event);
                    link.urgent(false);
                    let go_on = operator.held(master);
                    link.urgent(true);
                    if go_on {
                        master.resume(link.now_us());
                    } else {
                        master.abandon();
                    }
                    // Stops while the question stood were its answer.
                    interrupts = operator.interrupts();
                }
                _ => operator.event(&event),
            }
        }
        operator.progress(master);
        while interrupts < operator.interrupts() {
            interrupts += 1;
            master.hold();
        }
        bytes.clear();
        if let Err(error) = round(link, master, &mut bytes) {
            master.fail_port(error.to_string());
        }
    }
}

/// Sends what is due, and takes what comes. What has not come by a time is late only if the port has
/// been looked at since: a host that was held up must not take an answer that waits there for none.
fn round(link: &mut impl Link, master: &mut Master, bytes: &mut Vec<u8>) -> Result<(), LinkError> {
    let now_us = link.now_us();
    while let Some(bytes) = master.poll_transmit(now_us) {
        link.send(&bytes)?;
        master.handle_sent(link.now_us());
    }
    if let Some(until_us) = master.poll_timeout() {
        let looked_us = link.now_us();
        link.receive(bytes, until_us, master.answer_from_us())?;
        master.handle_bytes(link.now_us(), bytes);
        master.handle_timeout(looked_us);
    }
    Ok(())
}
