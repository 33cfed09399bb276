//! `--protocol`: a machine at the end of another line than its profile says.

use anyhow::anyhow;
use clap::ValueEnum;
use cnc::base::Machine;
use cnc::base::machine::Protocol;

use crate::args::Global;
use crate::input;

/// Why frames cannot be sent without waiting for time to pass.
pub const NO_MAX: &str = "--speed max waits for answers only, and frames have none: the host's frame rate is the \
     clock; --speed K runs it K times faster";

/// What is spoken, if not what the profile says.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub struct ProtocolArgs {
    /// What is spoken on the line; what the profile says by default (docs/frame.md)
    #[arg(long, value_enum, value_name = "NAME")]
    protocol: Option<Name>,
}

/// Protocols that nodes are built for.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Name {
    /// Node buffers, a sync byte a tick
    Buffered,
    /// A frame a tick to all nodes, which cannot answer
    Frame,
}

impl ProtocolArgs {
    /// The machine that `--machine` names, on this line.
    pub fn machine(self, global: &Global) -> anyhow::Result<Machine> {
        let machine = input::machine(global)?;
        let protocol = match self.protocol {
            None => return Ok(machine),
            Some(Name::Buffered) => Protocol::Buffered,
            Some(Name::Frame) => Protocol::Frame,
        };
        machine.with_protocol(protocol).map_err(|error| anyhow!(error))
    }
}
