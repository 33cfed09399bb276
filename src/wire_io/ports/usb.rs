//! USB devices behind ports, and `usb:VID:PID[:SERIAL]` → the one port that is meant.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use super::{SerialPort, attribute};

/// A USB device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Usb {
    /// Who has made it, by number.
    pub vendor_id: u16,
    /// What it is, by number.
    pub product_id: u16,
    /// Its serial number, if it has one.
    pub serial: Option<String>,
    /// Who has made it, as it says.
    pub manufacturer: Option<String>,
    /// What it is, as it says.
    pub product: Option<String>,
    /// Which of its interfaces: adapters with several ports have one each.
    pub interface: Option<u8>,
}

impl Usb {
    /// The USB device that a folder of sysfs belongs to.
    pub(super) fn of_device(device: &Path) -> Option<Usb> {
        let hex = |folder: &Path, name| u16::from_str_radix(&attribute(folder, name)?, 16).ok();
        let interface = device.ancestors().find_map(|folder| hex(folder, "bInterfaceNumber"));
        device.ancestors().find_map(|folder| {
            Some(Usb {
                vendor_id: hex(folder, "idVendor")?,
                product_id: hex(folder, "idProduct")?,
                serial: attribute(folder, "serial"),
                manufacturer: attribute(folder, "manufacturer"),
                product: attribute(folder, "product"),
                interface: interface.and_then(|number| u8::try_from(number).ok()),
            })
        })
    }
}

/// As a port is named by it.
impl fmt::Display for Usb {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "usb:{:04x}:{:04x}", self.vendor_id, self.product_id)?;
        self.serial.as_ref().map_or(Ok(()), |serial| write!(f, ":{serial}"))
    }
}

/// `usb:VID:PID[:SERIAL]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UsbName {
    vendor_id: u16,
    product_id: u16,
    serial: Option<String>,
}

/// A name that leads to no port, or to several.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NameError {
    /// It cannot be read.
    #[error("'{0}' is no USB name; expected usb:VID:PID or usb:VID:PID:SERIAL, as usb:0403:6001")]
    Syntax(String),
    /// No such device is plugged in.
    #[error("no port is {name}; {}", plugged_in(.there))]
    Nowhere {
        /// The name.
        name: String,
        /// USB ports that are there.
        there: Vec<String>,
    },
    /// More than one is.
    #[error("{name} may be any of {}; add the serial number, or give the port by its path", .there.join(", "))]
    Ambiguous {
        /// The name.
        name: String,
        /// Ports that it fits.
        there: Vec<String>,
    },
}

fn plugged_in(there: &[String]) -> String {
    match there {
        [] => "no USB port is plugged in".to_owned(),
        there => format!("plugged in: {}", there.join(", ")),
    }
}

impl FromStr for UsbName {
    type Err = NameError;

    fn from_str(text: &str) -> Result<UsbName, NameError> {
        let wrong = || NameError::Syntax(text.to_owned());
        let id = |part: Option<&str>| {
            let part = part.filter(|part| part.bytes().all(|byte| byte.is_ascii_hexdigit()));
            part.and_then(|part| u16::from_str_radix(part, 16).ok()).ok_or_else(wrong)
        };
        let mut parts = text.strip_prefix("usb:").ok_or_else(wrong)?.splitn(3, ':');
        let (vendor_id, product_id) = (id(parts.next())?, id(parts.next())?);
        let serial = parts.next().map(str::to_owned);
        if serial.as_deref() == Some("") {
            return Err(wrong());
        }
        Ok(UsbName { vendor_id, product_id, serial })
    }
}

impl fmt::Display for UsbName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "usb:{:04x}:{:04x}", self.vendor_id, self.product_id)?;
        self.serial.as_ref().map_or(Ok(()), |serial| write!(f, ":{serial}"))
    }
}

impl UsbName {
    /// The one port of a list that is meant.
    ///
    /// # Errors
    /// When none is, or several are; the error names those that are there.
    pub fn find(&self, ports: &[SerialPort]) -> Result<PathBuf, NameError> {
        let fits = |port: &&SerialPort| port.usb.as_ref().is_some_and(|usb| self.is(usb));
        let found: Vec<&SerialPort> = ports.iter().filter(fits).collect();
        match found.as_slice() {
            [port] => Ok(port.path.clone()),
            [] => Err(NameError::Nowhere { name: self.to_string(), there: told(ports.iter()) }),
            _ => {
                let there = told(found.into_iter());
                Err(NameError::Ambiguous { name: self.to_string(), there })
            }
        }
    }

    fn is(&self, usb: &Usb) -> bool {
        (usb.vendor_id, usb.product_id) == (self.vendor_id, self.product_id)
            && (self.serial.is_none() || self.serial == usb.serial)
    }
}

fn told<'p>(ports: impl Iterator<Item = &'p SerialPort>) -> Vec<String> {
    let told = |port: &SerialPort| {
        let path = port.by_id.first().unwrap_or(&port.path).display();
        Some(format!("{} ({path})", port.usb.as_ref()?))
    };
    ports.filter_map(told).collect()
}
