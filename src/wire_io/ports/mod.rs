//! sysfs, `/dev` and `/proc` → the serial ports of this computer, those first that a bus most likely
//! hangs on.
//!
//! Opens no port: that alone would reset some boards.

mod access;
mod holders;
mod usb;

use std::fs;
use std::path::{Path, PathBuf};

pub use access::{Access, Remedy, access};
pub use holders::{Holder, OpenDevices};
pub use usb::{NameError, Usb, UsbName};

/// A serial port of this computer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SerialPort {
    /// Its device file.
    pub path: PathBuf,
    /// What it is.
    pub kind: PortKind,
    /// Its names that stay the same wherever it is plugged in.
    pub by_id: Vec<PathBuf>,
    /// The USB device behind it.
    pub usb: Option<Usb>,
    /// The driver in the kernel.
    pub driver: Option<String>,
    /// The kernel writes its messages there.
    pub is_console: bool,
    /// Whether this user may open it.
    pub access: Access,
    /// Other processes that have it open, as far as the user may know.
    pub holders: Vec<Holder>,
    /// How long an adapter keeps received bytes back.
    pub latency_timer_ms: Option<u32>,
}

/// What a port is; the likelier to lead to a bus, the less.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PortKind {
    /// A USB adapter with a chip that RS-485 adapters are made of.
    Adapter,
    /// Another USB adapter.
    UsbSerial,
    /// A USB device that speaks for itself: a board, a modem.
    UsbModem,
    /// On the board or a card.
    OnBoard,
    /// The kernel keeps a name for it, and there is no chip.
    NoHardware,
}

impl PortKind {
    /// As in reports.
    pub fn name(self) -> &'static str {
        match self {
            PortKind::Adapter => "usb-adapter",
            PortKind::UsbSerial => "usb-serial",
            PortKind::UsbModem => "usb-modem",
            PortKind::OnBoard => "on-board",
            PortKind::NoHardware => "no-hardware",
        }
    }
}

/// Makers of the chips in RS-485 adapters: FTDI, WCH (CH340 and its kin, two IDs), Silicon Labs
/// (CP210x), Prolific (PL2303), Moxa (UPort).
const ADAPTER_VENDORS: [u16; 6] = [0x0403, 0x1a86, 0x4348, 0x10c4, 0x067b, 0x110a];

/// All serial ports, the likeliest first. `root` is `/`, or a tree with the same folders.
pub fn list_ports(root: &Path) -> Vec<SerialPort> {
    let open = OpenDevices::scan(&root.join("proc"));
    let by_id = links(&root.join("dev/serial/by-id"));
    let entries = fs::read_dir(root.join("sys/class/tty")).into_iter().flatten().flatten();
    let mut ports: Vec<SerialPort> =
        entries.filter_map(|entry| port(root, &entry.path(), &by_id, &open)).collect();
    ports.sort_by_cached_key(|port| (port.kind, natural(&port.path)));
    ports
}

/// A terminal of sysfs; none if there is no device behind it: consoles and pseudo-terminals.
fn port(
    root: &Path,
    sys: &Path,
    by_id: &[(PathBuf, PathBuf)],
    open: &OpenDevices,
) -> Option<SerialPort> {
    let device = sys.join("device").canonicalize().ok()?;
    let path = root.join("dev").join(sys.file_name()?);
    let usb = Usb::of_device(&device);
    let is_adapter = path.file_name()?.to_str()?.starts_with("ttyUSB");
    let kind = match &usb {
        Some(usb) if ADAPTER_VENDORS.contains(&usb.vendor_id) => PortKind::Adapter,
        Some(_) if is_adapter => PortKind::UsbSerial,
        Some(_) => PortKind::UsbModem,
        // The type of UART that a driver has found; 0 is none.
        None if attribute(sys, "type").is_some_and(|kind| kind == "0") => PortKind::NoHardware,
        None => PortKind::OnBoard,
    };
    let is_this = |(_, to): &&(PathBuf, PathBuf)| *to == path;
    Some(SerialPort {
        kind,
        by_id: by_id.iter().filter(is_this).map(|(link, _)| link.clone()).collect(),
        usb,
        driver: driver(&device),
        is_console: attribute(sys, "console").is_some_and(|answer| answer == "Y"),
        access: access(&path, &root.join("etc")),
        holders: open.holders(&path),
        latency_timer_ms: attribute(&device, "latency_timer").and_then(|text| text.parse().ok()),
        path,
    })
}

/// The name of the driver that has made a device. Newer kernels have drivers of their own between a
/// UART's and its terminal.
fn driver(device: &Path) -> Option<String> {
    device.ancestors().find_map(|folder| {
        let driver = folder.join("driver").canonicalize().ok()?;
        let name = driver.file_name()?.to_str()?;
        (!matches!(name, "port" | "ctrl")).then(|| name.to_owned())
    })
}

/// The symbolic links in a folder, and what they lead to.
fn links(folder: &Path) -> Vec<(PathBuf, PathBuf)> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let leads = |link: PathBuf| Some((link.clone(), link.canonicalize().ok()?));
    let mut links: Vec<_> = entries.filter_map(|entry| leads(entry.path())).collect();
    links.sort();
    links
}

/// A value of sysfs; none where it is missing or empty.
fn attribute(folder: &Path, name: &str) -> Option<String> {
    let text = fs::read_to_string(folder.join(name)).ok()?;
    let text = text.trim();
    (!text.is_empty()).then(|| text.to_owned())
}

/// Sorts ttyUSB10 after ttyUSB9.
fn natural(path: &Path) -> (String, u32) {
    let name = path.to_string_lossy();
    let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
    (stem.to_owned(), name[stem.len()..].parse().unwrap_or(0))
}
