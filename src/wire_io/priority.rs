//! Whether the system lets the thread that paces a job go before other programs (`SCHED_FIFO`).
//!
//! A job does without it: a late host slides. Whoever is asked something, or starts another program,
//! steps back first: programs that are started inherit the priority.

use thread_priority::unix::{
    NormalThreadSchedulePolicy, RealtimeThreadSchedulePolicy, ThreadSchedulePolicy,
    set_thread_priority_and_policy, thread_native_id,
};
use thread_priority::{ThreadPriority, ThreadPriorityValue};

/// Above all that is not real-time, below the kernel's own interrupt threads (50).
const FIFO_PRIORITY: u8 = 10;
/// What the crate makes of this, for threads that are not real-time, is the usual nice value, 0.
const USUAL_PRIORITY: u8 = 48;

const FIFO: ThreadSchedulePolicy =
    ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
const USUAL: ThreadSchedulePolicy = ThreadSchedulePolicy::Normal(NormalThreadSchedulePolicy::Other);

/// What the system gives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Priority {
    /// It has not been asked.
    #[default]
    Unasked,
    /// Real-time priority.
    RealTime,
    /// What any program has.
    Refused,
}

impl Priority {
    /// Asks for it, for the current thread, unless it has been refused before.
    pub fn raise(&mut self) {
        if *self != Priority::Refused {
            let given = set(FIFO_PRIORITY, FIFO);
            *self = if given { Priority::RealTime } else { Priority::Refused };
        }
    }

    /// Steps back, if it was given.
    pub fn lower(self) {
        if self == Priority::RealTime {
            // A nice value above 0 that the user has chosen stays, and says so: no failure.
            set(USUAL_PRIORITY, USUAL);
        }
    }
}

fn set(value: u8, policy: ThreadSchedulePolicy) -> bool {
    let value = ThreadPriorityValue::try_from(value).map(ThreadPriority::Crossplatform);
    let set = |value| set_thread_priority_and_policy(thread_native_id(), value, policy).ok();
    value.ok().and_then(set).is_some()
}
