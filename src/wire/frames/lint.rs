//! Job → proof that frames are in time, that every node finds its own counts in every frame, and a frame's start nowhere else.
//!
//! What a frame is to a node is written down here a second time, bit by bit, apart from the codec.

use crate::base::Machine;
use crate::base::machine::{FRAME_BYTES, FRAME_PLACES};
use crate::wire::error::JobError;
use crate::wire::job::{Buffer, Job};
use crate::wire::lint::Proof;

use super::{Mode, check_bus};

/// Proves a job.
pub fn lint(job: &Job, machine: &Machine) -> Result<Proof, JobError> {
    check_bus(&machine.bus)?;
    let mut proof = Proof { nodes: machine.bus.nodes.len(), ..Proof::default() };
    let mut tick = 0;
    for buffer in job.buffers() {
        stretch(buffer, tick, &mut proof)?;
        proof.buffers += 1;
        tick += buffer.lines.len() as u64;
    }
    Ok(proof)
}

fn stretch(buffer: &Buffer, base: u64, proof: &mut Proof) -> Result<(), JobError> {
    let frames = buffer.lines.len() as u64 + 1;
    proof.bytes += frames * u64::from(FRAME_BYTES);
    proof.pairs += frames * u64::from(FRAME_PLACES);
    for (at, line) in buffer.lines.iter().enumerate() {
        let frame = buffer.frame(Mode::Move, at as u64 + 1, at);
        let wrong = |place: u8| JobError::Frame { place, tick: base + at as u64, line: *line };
        let starts = frame.iter().filter(|byte| **byte >= 128).count();
        if starts != 1 || frame[0] < 128 {
            return Err(wrong(0));
        }
        for place in 1..=FRAME_PLACES {
            let of_place = buffer.fills.iter().find(|fill| fill.unit.id == place);
            let planned = of_place.map_or(0, |fill| buffer.count(fill, at));
            let bytes = [frame[2 * usize::from(place) - 1], frame[2 * usize::from(place)]];
            let value = i32::from(bytes[0]) * 128 + i32::from(bytes[1]);
            if value != planned.rem_euclid(128 * 128) {
                return Err(wrong(place));
            }
        }
    }
    Ok(())
}
