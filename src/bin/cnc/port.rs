//! PORT on the command line → a port and how to open it.

use std::path::{Path, PathBuf};

use cnc::base::likeness::nearest;
use cnc::base::machine::Bus;
use cnc::base::{Machine, PortConfig};
use cnc::wire::Timing;
use cnc::wire_io::ports::{UsbName, list_ports};
use cnc::wire_io::{self, Serial, Speed};

use crate::args::Global;
use crate::exit::{ExitWith, Failure};

/// The port, and what commands that open one let the user say about it.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct PortArgs {
    /// Serial port by its path, as usb:VID:PID[:SERIAL] or by a name from cnc.toml (docs/ports.md);
    /// pseudo-terminal of `cnc node`; or sim: for nodes within this program, sim:seed=N and
    /// sim:faults=SPEC+… with faults (docs/bus.md)
    #[arg(value_name = "PORT")]
    pub port: PathBuf,
    /// Bits a second; the machine's by default
    #[arg(long, value_name = "N", env = "CNC_BAUD", value_parser = clap::value_parser!(u32).range(300..=10_000_000))]
    baud: Option<u32>,
    /// How long to wait for an answer beyond the time of wire and tick; the machine's by default
    #[arg(long, value_name = "MS", env = "CNC_REPLY_TIMEOUT", value_parser = clap::value_parser!(u32).range(1..=60_000))]
    reply_timeout: Option<u32>,
}

/// A port that has not been opened yet.
#[derive(Debug)]
pub struct Port {
    /// As the user or the configuration has it: a path or a USB name.
    device: PathBuf,
    config: PortConfig,
}

impl PortArgs {
    /// Looks the port up in the configuration. Whether it is there is not asked yet.
    pub fn port(&self, global: &Global) -> anyhow::Result<Port> {
        let known = &global.config.ports;
        let configured = self.port.to_str().and_then(|name| known.get(name).cloned());
        let said = PortConfig {
            baud: self.baud,
            reply_timeout_ms: self.reply_timeout,
            ..PortConfig::default()
        };
        let config = said.over(configured.unwrap_or_default());
        let device = config.device.as_ref().map_or(self.port.clone(), PathBuf::from);
        if let Some(near) = self.meant(&device, global) {
            say!("note: no port is {}; did you mean {near}?", device.display());
        }
        if let Some(name) = usb_name(&device) {
            name.parse::<UsbName>()?;
        }
        Ok(Port { device, config })
    }

    /// The name in the configuration that a port which is not there is most like.
    fn meant<'g>(&self, device: &Path, global: &'g Global) -> Option<&'g str> {
        let is_simulated = self.port.to_string_lossy().starts_with("sim:");
        let is_there = is_simulated || usb_name(device).is_some() || device.exists();
        let known = global.config.ports.keys().map(String::as_str);
        (!is_there).then(|| nearest(&device.to_string_lossy(), known)).flatten()
    }
}

fn usb_name(device: &Path) -> Option<&str> {
    device.to_str().filter(|name| name.starts_with("usb:"))
}

impl Port {
    /// Whether it is a device, as opposed to virtual nodes.
    pub fn is_real(&self) -> bool {
        let is_virtual = wire_io::is_pseudo_terminal(&self.device);
        usb_name(&self.device).is_some() || (self.device.exists() && !is_virtual)
    }

    /// The path of its file, whether it is there or not.
    pub fn path(&self) -> Result<PathBuf, Failure> {
        match usb_name(&self.device).map(str::parse::<UsbName>) {
            None => Ok(self.device.clone()),
            Some(name) => name?.find(&list_ports("/".as_ref())).or_bus(),
        }
    }

    /// Looks whether another program has it open: that is said before its journal is looked at.
    pub fn check_free(&self) -> Result<(), Failure> {
        Serial::check_free(&self.path()?).or_bus()
    }

    /// Opens it. `say` is told what works less well than it could.
    pub fn open(&self, bus: &Bus, say: impl Fn(&str)) -> Result<Serial, Failure> {
        let path = self.path()?;
        let serial = Serial::open(&path, bus.baud).or_bus()?;
        let wanted_ms = self.config.latency_timer_ms;
        if let Some(error) = wanted_ms.and_then(|ms| wire_io::set_latency_timer(&path, ms).err()) {
            say(&format!("the adapter's latency timer cannot be set: {error}"));
        }
        if let Some(ms) = wire_io::latency_timer_ms(&path).filter(|ms| *ms > wanted_ms.unwrap_or(1))
        {
            say(&format!(
                "the adapter keeps answers back for up to {ms} ms; 1 ms is better: echo 1 | sudo tee \
                 /sys/bus/usb-serial/devices/*/latency_timer"
            ));
        }
        Ok(serial)
    }

    /// The times of a job over this port.
    pub fn timing(&self, bus: &Bus, speed: Speed) -> Timing {
        let timing = Timing::new(bus, speed.factor());
        match self.config.write_piece_bytes {
            Some(bytes) => timing.with_piece(bytes),
            None => timing,
        }
    }

    /// A machine whose bus hangs on this port; its seal stays that of its profile.
    pub fn machine(&self, machine: &Machine) -> Machine {
        let mut machine = machine.clone();
        let bus = &mut machine.bus;
        bus.baud = self.config.baud.unwrap_or(bus.baud);
        bus.reply_timeout_ms = self.config.reply_timeout_ms.unwrap_or(bus.reply_timeout_ms);
        machine
    }
}
