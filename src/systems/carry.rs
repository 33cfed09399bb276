//! What an interface between a control and its axes carries: nodes, baud rate, period → times.
//!
//! Five interfaces, each by the equations of the paper that describes it:
//!
//! | interface | on the line | source |
//! |---|---|---|
//! | frame | an info byte and two bytes an axis, for six axes at least, every period | seed 004, 3.6.1, method A |
//! | coefficients | a message a block: info byte, count of periods, two constants an axis | method B |
//! | buffered | 1500 bytes a node in advance, then a sync message of 3 bytes a period | 3.6.2, method C |
//! | sercos | sync telegram, a telegram a drive, telegram of the control | seed 000, 3.3 |
//! | parallel | the same data over a system bus of 20 Kbyte in 2 ms | seed 000, 3.4 |
//!
//! A byte on a serial line is 10 bits (start, eight, stop); a stuffed one of SERCOS 9.6 bits at
//! most. What a host's computer takes beside that is not known here.

pub mod blocks;

use std::fmt;

use crate::base::machine::{Bus, FRAME_PLACES, TICK_MARGIN_US};

/// Bits on the line for a byte: start, eight, stop.
const BITS_A_BYTE: f64 = 10.0;
/// Bytes of the message that keeps buffered nodes in step (seed 004, section 3.6.2).
const SYNC_BYTES: f64 = 3.0;
/// Bytes of a fill beside the buffer's entries: the command, and two answers.
const FILL_EXTRA_BYTES: f64 = 4.0;
/// Info byte of a frame or a message of coefficients.
const INFO_BYTES: f64 = 1.0;
/// An axis in a frame.
const FRAME_AXIS_BYTES: f64 = 2.0;
/// How many periods a block lasts, in a message of coefficients.
const PERIODS_BYTES: f64 = 4.0;
/// Constants of a difference equation for each axis: A and B, C and D, E and F, or G and H.
const CONSTANTS_AN_AXIS: f64 = 2.0;
/// Most nodes on the bus of seed 004, by their switches.
const NODES_BY_SWITCH: u32 = 15;
/// Most drives on a ring: addresses 1 to 254.
const DRIVES_MOST: u32 = 254;
/// What EIA-232 carries (seed 004, section 3.7.1).
const EIA_232_MOST: u32 = 115_200;
/// What EIA-485 carries (section 3.8).
const EIA_485_MOST: u32 = 10_000_000;
/// A flag of a telegram.
pub const FLAG_BITS: f64 = 8.0;
/// A byte between flags: a 0 after every five 1 makes eight bits 9.6 at most.
pub const STUFFED_BITS: f64 = 9.6;
/// Bytes of the sync telegram between its flags: address, data, check.
pub const SYNC_TELEGRAM_BYTES: f64 = 4.0;
/// Bytes of a drive's telegram between its flags: address, 8 of data, check.
pub const DRIVE_TELEGRAM_BYTES: f64 = 11.0;
/// Bytes of the control's telegram between its flags beside its data: address, check.
pub const CONTROL_TELEGRAM_BYTES: f64 = 3.0;
/// Bytes of data for each drive.
pub const DRIVE_DATA_BYTES: f64 = 8.0;

/// A way to tell axes where to go.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Interface {
    /// A frame with the positions of all axes, every period (seed 004, method A).
    Frame,
    /// The constants of a difference equation, every block (method B).
    Coefficients,
    /// Buffers filled in advance, and a sync message every period (method C).
    Buffered,
    /// A ring of drives (seed 000, section 3.3).
    Sercos,
    /// A system bus that the servo boards stand on (seed 000, section 3.2).
    Parallel,
}

impl Interface {
    /// All, in the order of reports.
    pub const ALL: [Interface; 5] = [
        Interface::Frame,
        Interface::Coefficients,
        Interface::Buffered,
        Interface::Sercos,
        Interface::Parallel,
    ];

    /// Its name in reports and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Interface::Frame => "frame",
            Interface::Coefficients => "coefficients",
            Interface::Buffered => "buffered",
            Interface::Sercos => "sercos",
            Interface::Parallel => "parallel",
        }
    }

    /// Bits a second where nobody says otherwise, if that is not the profile's: 2 Mbit/s on a ring
    /// (seed 000), 20 Kbyte in 2 ms on a system bus (the lower figure of its section 3.4).
    pub fn own_baud(self) -> Option<u32> {
        match self {
            Interface::Frame | Interface::Coefficients | Interface::Buffered => None,
            Interface::Sercos => Some(2_000_000),
            Interface::Parallel => Some(80_000_000),
        }
    }

    /// Most nodes that can be addressed.
    fn nodes_addressable(self) -> u32 {
        match self {
            Interface::Frame | Interface::Coefficients | Interface::Buffered => NODES_BY_SWITCH,
            Interface::Sercos | Interface::Parallel => DRIVES_MOST,
        }
    }

    /// Most bits a second that the medium carries, where the papers say so.
    pub fn baud_most(self) -> Option<u32> {
        match self {
            Interface::Frame | Interface::Coefficients => Some(EIA_232_MOST),
            Interface::Buffered => Some(EIA_485_MOST),
            Interface::Sercos | Interface::Parallel => None,
        }
    }
}

impl fmt::Display for Interface {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// An interface as it is set up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// Which.
    pub interface: Interface,
    /// Axes on it.
    pub nodes: u32,
    /// Bits a second.
    pub baud: u32,
    /// How often axes are to be told: the inverse of the sampling frequency.
    pub period_s: f64,
    /// How long a buffered node takes over a byte.
    pub node_tick_s: f64,
    /// Entries of a buffered node.
    pub buffer_ticks: u32,
    /// Bits of a constant of method B.
    pub word_bits: u32,
}

/// What an interface carries, so set up. Times in seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Carry {
    /// Bits in each period; with method B in each block. Of telegrams those before stuffing.
    pub bits: f64,
    /// How long these take on the line; telegrams with 9.6 bits a byte.
    pub line_s: f64,
    /// The shortest period that can be set. With method B the shortest block.
    pub least_s: f64,
    /// Filling the buffers of all nodes; none where there are no buffers.
    pub fill_s: Option<f64>,
    /// Motion that the buffers hold.
    pub buffer_s: Option<f64>,
    /// From the first bit of what keeps the axes in step to its last; none where nothing does.
    pub sync_s: Option<f64>,
    /// What is left of the period, for computing; below 0 where the line takes longer.
    pub left_s: f64,
    /// Most nodes with this baud rate and period.
    pub nodes_max: u32,
}

/// Why an interface cannot work as it is set up.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// More nodes than addresses.
    #[error("{nodes} nodes: at most {most} can be addressed")]
    TooManyNodes {
        /// How many there are to be.
        nodes: u32,
        /// How many there can be.
        most: u32,
    },
    /// More than the medium carries.
    #[error("{baud} baud: the line carries at most {most}")]
    TooFast {
        /// Bits a second that are asked for.
        baud: u32,
        /// Bits a second that are possible.
        most: u32,
    },
    /// Axes are told more often than they can be.
    #[error("a period of {:.4} ms: the least is {:.4} ms; {remedy}", period_s * 1e3, least_s * 1e3)]
    TooOften {
        /// The period asked for.
        period_s: f64,
        /// The least possible.
        least_s: f64,
        /// What would help.
        remedy: Remedy,
    },
}

/// What helps against a period that is too short.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Remedy {
    /// A baud rate, or fewer nodes, if any number of them would do.
    Baud {
        /// Bits a second.
        least: u32,
        /// How many nodes would do at the rate that there is.
        nodes_max: u32,
    },
    /// No baud rate that the line carries.
    NoBaud {
        /// Most bits a second.
        most: u32,
        /// How many nodes would do at the rate that there is.
        nodes_max: u32,
    },
    /// None but a longer period: it is the nodes that take so long over a byte.
    Nodes {
        /// How long.
        tick_s: f64,
    },
}

impl fmt::Display for Remedy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let nodes_max = match self {
            Remedy::Baud { least, nodes_max } => {
                write!(f, "{least} baud would do")?;
                *nodes_max
            }
            Remedy::NoBaud { most, nodes_max } => {
                write!(f, "no baud rate up to {most} would do")?;
                *nodes_max
            }
            Remedy::Nodes { tick_s } => {
                write!(f, "a node takes {:.4} ms over a byte", tick_s * 1e3)?;
                0
            }
        };
        if nodes_max > 0 { write!(f, ", or {nodes_max} nodes") } else { Ok(()) }
    }
}

impl Setting {
    /// As a machine's bus is, with its interface exchanged.
    pub fn of(interface: Interface, bus: &Bus, nodes: u32) -> Setting {
        Setting {
            interface,
            nodes,
            baud: interface.own_baud().unwrap_or(bus.baud),
            period_s: bus.tick_s(),
            node_tick_s: f64::from(bus.node_tick_us) * 1e-6,
            buffer_ticks: bus.buffer_ticks,
            word_bits: 32,
        }
    }

    /// What it carries.
    pub fn carry(&self) -> Carry {
        let buffered = self.interface == Interface::Buffered;
        let nodes_addressable = self.interface.nodes_addressable();
        let fits = |nodes: &u32| self.fits(*nodes);
        // The time on the line grows with the nodes, so the most that fit are found by halves.
        let counts: Vec<u32> = (1..=nodes_addressable).collect();
        let fill_bits = BITS_A_BYTE * (f64::from(self.buffer_ticks) + FILL_EXTRA_BYTES);
        Carry {
            bits: self.bits(self.nodes),
            line_s: self.line_s(self.nodes),
            least_s: self.least_s(self.nodes),
            fill_s: buffered.then(|| f64::from(self.nodes) * self.seconds(fill_bits)),
            buffer_s: buffered.then(|| f64::from(self.buffer_ticks) * self.period_s),
            sync_s: self.sync_s(),
            left_s: self.period_s - self.line_s(self.nodes),
            nodes_max: counts.partition_point(fits) as u32,
        }
    }

    /// Whether it can work.
    ///
    /// # Errors
    /// With the figure that shows why it cannot.
    pub fn check(&self) -> Result<(), Refusal> {
        let most = self.interface.nodes_addressable();
        if self.nodes > most {
            return Err(Refusal::TooManyNodes { nodes: self.nodes, most });
        }
        if let Some(most) = self.interface.baud_most().filter(|most| self.baud > *most) {
            return Err(Refusal::TooFast { baud: self.baud, most });
        }
        if self.fits(self.nodes) {
            return Ok(());
        }
        let carry = self.carry();
        Err(Refusal::TooOften {
            period_s: self.period_s,
            least_s: carry.least_s,
            remedy: self.remedy(carry.nodes_max),
        })
    }

    /// Whether so many nodes can be told each period. Nodes that interpolate by themselves are not
    /// told each period.
    fn fits(&self, nodes: u32) -> bool {
        self.interface == Interface::Coefficients
            || self.least_s(nodes) <= self.period_s * (1.0 + 1e-9)
    }

    /// What would make the period long enough.
    fn remedy(&self, nodes_max: u32) -> Remedy {
        let period_s = match self.interface {
            Interface::Sercos => settable_below_s(self.period_s),
            _ => self.period_s,
        };
        let most = self.interface.baud_most().unwrap_or(u32::MAX);
        let baud = self.line_s(self.nodes) * f64::from(self.baud) / period_s * (1.0 - 1e-9);
        // What is beyond u32 becomes its greatest.
        let least = baud.ceil() as u32;
        if (Setting { baud: least.min(most), ..*self }).fits(self.nodes) {
            return Remedy::Baud { least, nodes_max };
        }
        match self.interface {
            Interface::Buffered => Remedy::Nodes { tick_s: self.node_tick_s },
            _ => Remedy::NoBaud { most, nodes_max },
        }
    }

    /// Bits in each period or block, before stuffing.
    fn bits(&self, nodes: u32) -> f64 {
        let nodes = f64::from(nodes);
        match self.interface {
            Interface::Frame => {
                BITS_A_BYTE * (INFO_BYTES + FRAME_AXIS_BYTES * nodes.max(f64::from(FRAME_PLACES)))
            }
            Interface::Coefficients => {
                let constants = CONSTANTS_AN_AXIS * (f64::from(self.word_bits) / 8.0).ceil();
                BITS_A_BYTE * (INFO_BYTES + PERIODS_BYTES + constants * nodes)
            }
            Interface::Buffered => BITS_A_BYTE * SYNC_BYTES,
            Interface::Sercos | Interface::Parallel => ring_bits(nodes, 8.0),
        }
    }

    /// How long these take.
    fn line_s(&self, nodes: u32) -> f64 {
        self.seconds(match self.interface {
            Interface::Sercos => ring_bits(f64::from(nodes), STUFFED_BITS),
            _ => self.bits(nodes),
        })
    }

    fn least_s(&self, nodes: u32) -> f64 {
        let line_s = self.line_s(nodes);
        match self.interface {
            Interface::Frame | Interface::Coefficients | Interface::Parallel => line_s,
            Interface::Buffered => line_s.max(self.node_tick_s + f64::from(TICK_MARGIN_US) * 1e-6),
            Interface::Sercos => settable_s(line_s),
        }
    }

    /// A frame is its own sync message; nodes that interpolate by themselves have none.
    fn sync_s(&self) -> Option<f64> {
        match self.interface {
            Interface::Frame | Interface::Buffered => Some(self.line_s(self.nodes)),
            Interface::Sercos => {
                Some(self.seconds(2.0 * FLAG_BITS + SYNC_TELEGRAM_BYTES * STUFFED_BITS))
            }
            Interface::Coefficients | Interface::Parallel => None,
        }
    }

    fn seconds(&self, bits: f64) -> f64 {
        bits / f64::from(self.baud)
    }
}

/// Bits of all telegrams of a cycle of seed 000, with so many for each byte between two flags.
fn ring_bits(drives: f64, byte_bits: f64) -> f64 {
    let telegram = |bytes: f64| 2.0 * FLAG_BITS + bytes * byte_bits;
    telegram(SYNC_TELEGRAM_BYTES)
        + telegram(DRIVE_TELEGRAM_BYTES) * drives
        + telegram(CONTROL_TELEGRAM_BYTES + DRIVE_DATA_BYTES * drives)
}

/// The least cycle of SERCOS from a time on: …, 0.125, 0.25, 0.5, 1, 2, 3, … ms. (Seed 000 prints
/// n ms for n from 0 on, and lists them from 1 on: a cycle of 0 ms there is none.)
pub fn settable_s(least_s: f64) -> f64 {
    let ms = least_s * 1e3 * (1.0 - 1e-9);
    if ms > 0.5 { ms.ceil() * 1e-3 } else { libm::exp2(libm::log2(ms).ceil()) * 1e-3 }
}

/// The greatest cycle of SERCOS up to a time.
fn settable_below_s(most_s: f64) -> f64 {
    let ms = most_s * 1e3 * (1.0 + 1e-9);
    if ms >= 1.0 { ms.floor() * 1e-3 } else { libm::exp2(libm::log2(ms).floor()) * 1e-3 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cycles_are_those_that_can_be_set() {
        // Seed 000, section 3.3: …, 0.0625, 0.125, 0.25, 0.5, 1, 2, 3, … ms.
        for (least_ms, expected_ms) in [
            (0.0625, 0.0625),
            (0.07, 0.125),
            (0.1488, 0.25),
            (0.25, 0.25),
            (0.3472, 0.5),
            (0.5001, 1.0),
            (0.8432, 1.0),
            (1.0, 1.0),
            (1.2, 2.0),
            (2.5, 3.0),
            (0.001, 0.000_976_562_5 * 2.0),
        ] {
            let found_ms = settable_s(least_ms * 1e-3) * 1e3;
            assert!((found_ms - expected_ms).abs() < 1e-9, "{least_ms}: {found_ms}");
            let below_ms = settable_below_s(found_ms * 1e-3) * 1e3;
            assert!((below_ms - found_ms).abs() < 1e-9, "{found_ms}: {below_ms}");
        }
    }

    #[test]
    fn the_nodes_that_fit_do_and_one_more_does_not() {
        let machine = crate::base::Machine::load("starmill").unwrap();
        for interface in Interface::ALL {
            for baud in [9600, 38_400, 115_200, 2_000_000] {
                for period_s in [0.5e-3, 2e-3, 11e-3, 0.1] {
                    let bus = Setting::of(interface, &machine.bus, 1);
                    let setting = Setting { baud, period_s, ..bus };
                    let most = setting.carry().nodes_max;
                    assert!(most == 0 || setting.fits(most), "{setting:?}");
                    let is_last = most == interface.nodes_addressable();
                    assert!(is_last || !setting.fits(most + 1), "{setting:?}");
                }
            }
        }
    }
}
