//! Ticks of a stretch of motion → each moving node's bytes, two a tick; and what a line can carry.

use crate::base::Tick;
use crate::base::machine::{Bus, FRAME_BYTES, Machine, TICK_MARGIN_US, Unit};
use crate::wire::error::JobError;
use crate::wire::job::Fill;

use super::encode;

/// Refuses a line on which frames would not be off the wire in time, or nodes not done with one.
pub fn check_bus(bus: &Bus) -> Result<(), JobError> {
    let (baud, tick_us) = (bus.baud, bus.tick_us);
    let baud_least = bus.frame_baud_least();
    if u64::from(baud) < baud_least {
        let frame_us = (bus.frame_s() * 1e6).ceil() as u64;
        return Err(JobError::FrameTooLong {
            bytes: FRAME_BYTES,
            baud,
            frame_us,
            tick_us,
            baud_least,
        });
    }
    let least_us = bus.node_tick_us.saturating_add(TICK_MARGIN_US);
    if tick_us < least_us {
        return Err(JobError::TickTooShort { tick_us, least_us });
    }
    Ok(())
}

/// The nodes that move in a stretch, each with its counts.
pub fn fills(ticks: &[Tick], machine: &Machine, base: u64) -> Result<Vec<Fill>, JobError> {
    let mut fills = Vec::new();
    for profile in &machine.axes {
        let axis = profile.axis;
        let Some(first) = ticks.iter().position(|tick| tick.counts[axis] != 0) else { continue };
        let (tick, line) = (base + first as u64, ticks[first].line);
        let id = machine.bus.nodes.get(&axis).copied();
        let id = id.ok_or(JobError::NoNode { axis, tick, line })?;
        // Counts were held to what a place carries when the tick came.
        let bytes = ticks.iter().flat_map(|tick| encode(tick.counts[axis]).unwrap_or_default());
        let unit = Unit { axis: Some(axis), id };
        fills.push(Fill { unit, master: false, bytes: bytes.collect() });
    }
    Ok(fills)
}
