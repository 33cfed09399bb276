//! A master and a link → a job done, or the reason why not.

use std::time::Duration;

use crate::base::Event;
use crate::wire::{Ending, Master, MasterEvent};
use crate::wire_io::hands::Hands;
use crate::wire_io::link::{Link, LinkError};

/// How often it is asked whether an event is done.
const LOOK: Duration = Duration::from_millis(2);

/// Whoever runs the job: is told, is asked, and may interrupt.
pub trait Operator {
    /// Told of every event.
    fn event(&mut self, event: &MasterEvent);
    /// Who does what the program asks for besides motion; with nobody there it is passed.
    fn hands(&mut self) -> Option<&mut dyn Hands> {
        None
    }
    /// An event waits for a person, all nodes idle, after what hands could do about it: go on?
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
                MasterEvent::Event(asked) | MasterEvent::Pause(asked) => {
                    operator.event(&event);
                    link.urgent(false);
                    let is_done = perform(link, master, operator, asked, interrupts);
                    let waits = is_done && matches!(event, MasterEvent::Pause(_));
                    if waits && !operator.pause(asked) {
                        master.abandon();
                    }
                    link.urgent(true);
                    master.event_done(link.now_us());
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

/// Has an event done, and says whether it is. The operator's stop ends what is under way, and the job
/// with it; so do bytes that nobody asked for, and the end of the port.
fn perform(
    link: &mut impl Link,
    master: &mut Master,
    operator: &mut impl Operator,
    event: &Event,
    interrupts: usize,
) -> bool {
    let at_steps = *master.position_steps();
    let Some(hands) = operator.hands() else { return true };
    let mut done = hands.begin(event, &at_steps).and_then(|()| hands.is_done());
    let mut bytes = Vec::new();
    while done == Ok(false) {
        let listened = link.idle(&mut bytes, LOOK);
        match listened {
            Ok(()) => master.handle_bytes(link.now_us(), &std::mem::take(&mut bytes)),
            Err(error) => master.fail_port(error.to_string()),
        }
        let stopped = operator.interrupts() > interrupts;
        let Some(hands) = operator.hands() else { return true };
        if stopped || !master.waits_for_event() {
            hands.stop();
            master.event_stopped();
            return false;
        }
        done = hands.is_done();
    }
    done.map_err(|reason| master.event_failed(event, reason)).is_ok()
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
