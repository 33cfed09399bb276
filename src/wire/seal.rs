//! Job → its hash: the same for the same motion, events and order of filling, whatever it was made from.

use sha2::{Digest, Sha256};

use crate::wire::job::{Buffer, Job, Step};

impl Job {
    /// SHA-256 of all that happens in the job.
    pub fn sha256(&self) -> [u8; 32] {
        let mut hash = Sha256::new();
        self.start_steps.0.iter().for_each(|steps| hash.update(steps.to_le_bytes()));
        for step in &self.steps {
            match step {
                Step::Event(event) => {
                    hash.update(b"event");
                    hash.update(event.line.to_le_bytes());
                    hash.update(event.kind.to_string());
                }
                Step::Direct(direct) => hash.update(format!("{direct:?}")),
                Step::Buffer(buffer) => add(&mut hash, buffer),
            }
        }
        hash.finalize().into()
    }
}

fn add(hash: &mut Sha256, buffer: &Buffer) {
    hash.update(b"buffer");
    hash.update(buffer.number.to_le_bytes());
    for fill in &buffer.fills {
        hash.update([b'f', fill.unit.id, u8::from(fill.master)]);
        hash.update(&fill.bytes);
    }
    for line in &buffer.lines {
        hash.update(line.to_le_bytes());
    }
    for (tick, event) in &buffer.events {
        hash.update(b"within");
        hash.update((*tick as u64).to_le_bytes());
        hash.update(event.line.to_le_bytes());
        hash.update(event.kind.to_string());
    }
}
