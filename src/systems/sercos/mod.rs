//! A ring of drives as SERCOS has it (seed 000, section 3.3): telegrams as bits, and a virtual ring
//! that carries a job's positions cycle by cycle.
//!
//! ```text
//! control ─▶ drive 1 ─▶ drive 2 ─▶ … ─▶ drive N ─╮     a cycle:
//!    ▲                                           │     | sync | drive 1 | … | drive N | control |
//!    ╰───────────────────────────────────────────╯
//! ```
//!
//! - `bits`: flags, stuffed zeros, the 16-bit check
//! - `telegram`: what stands between the flags
//! - `drive`: what a drive makes of the telegrams
//! - `ring`: the cycle with its time slots, and faults on the line
//! - `carried`: a job's ticks → what the drives execute
//!
//! Of the standard this has what seed 000 describes, in operation (phase 4): no start-up of the ring,
//! no service channel (its words are 0), no delays in drives and fibre.

mod bits;
mod carried;
mod drive;
mod ring;
mod telegram;

pub use self::bits::{Dropped, Receiver, framed};
pub use self::carried::{Carried, Fault};
pub use self::drive::Drive;
pub use self::ring::{NotAStrike, Place, Ring, Slot, Strike, Traffic, slots};
pub use self::telegram::{CONTROL_ADDRESS, Demand, Telegram, Unknown};

use crate::base::Machine;
use crate::base::machine::Protocol;

/// Units of position a mm or degree: 0.1 µm, the scaling that SERCOS prefers for lengths.
pub const UNITS_PER_MM: f64 = 10_000.0;

/// The machine with its axes on a ring: drives move by units of 0.1 µm, once a cycle, and nothing
/// but their speed limits how many. They ramp from rest: what motors without feedback can start at
/// means nothing to them, so they start at no more than they gain in a cycle.
pub fn on_ring(machine: &Machine, cycle_us: u32) -> Machine {
    let mut machine = machine.clone();
    for profile in &mut machine.axes {
        profile.steps_per_mm = UNITS_PER_MM;
        let gain_mm_s = profile.accel_max_mm_s2 * f64::from(cycle_us) * 1e-6;
        profile.start_speed_mm_s = profile.start_speed_mm_s.min(gain_mm_s);
    }
    machine.bus.protocol = Protocol::None;
    (machine.bus.tick_us, machine.bus.node_tick_us) = (cycle_us, cycle_us);
    machine.bus.count_max = i32::MAX as u32;
    machine
}
