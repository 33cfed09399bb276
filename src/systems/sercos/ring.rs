//! The cycle of the ring: telegrams in their time slots, bit by bit, faults among them.
//!
//! Slots are laid out for telegrams of 9.6 bits a byte, which none exceeds, so no two ever meet.
//! A fault flips a bit as a telegram is sent; all that hear the telegram hear the flipped bit.

use std::fmt;
use std::str::FromStr;

use super::drive::{CONTROL_NEW, CONTROL_ON, STATUS_FAULT};
use super::{Demand, Drive, Receiver, Telegram, framed};
use crate::systems::carry::{
    CONTROL_TELEGRAM_BYTES, DRIVE_DATA_BYTES, DRIVE_TELEGRAM_BYTES, FLAG_BITS, STUFFED_BITS,
    SYNC_TELEGRAM_BYTES,
};

/// In operation.
const PHASE: u8 = 4;

/// A place in the cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Place {
    /// The sync telegram.
    Sync,
    /// The telegram of the drive with this address.
    Drive(u8),
    /// The control's telegram.
    Control,
}

/// The time of a telegram within the cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slot {
    /// Whose.
    pub place: Place,
    /// Begin and end from the start of the cycle.
    pub from_s: f64,
    /// See `from_s`.
    pub to_s: f64,
}

/// A bit that is flipped on the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Strike {
    /// In which cycle, from 0.
    pub cycle: u64,
    /// In which telegram.
    pub place: Place,
    /// Which bit, from the first of the opening flag; a telegram that ends before it is left alone.
    pub bit: usize,
}

/// Bits on the line so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traffic {
    /// Cycles.
    pub cycles: u64,
    /// Bits of all telegrams.
    pub bits: u64,
    /// Those of them that are stuffed zeros.
    pub stuffed: u64,
    /// Bits of the cycle that had most.
    pub bits_max: u64,
    /// Telegrams that were dropped.
    pub dropped: u64,
}

/// A control and its drives.
#[derive(Clone, Debug)]
pub struct Ring {
    drives: Vec<Drive>,
    traffic: Traffic,
    strikes: Vec<Strike>,
    /// Those that flipped a bit.
    struck: Vec<Strike>,
    /// What the control has heard of each drive in the last cycle: status and position.
    heard: Vec<Option<(u16, i32)>>,
}

impl Ring {
    /// Drives at rest, at addresses from 1 on, at most 254; bits that will be flipped.
    pub fn new(positions: &[i32], strikes: &[Strike]) -> Ring {
        let drives = (1..=254).zip(positions).map(|(address, at)| Drive::new(address, *at));
        let drives: Vec<Drive> = drives.collect();
        let heard = vec![None; drives.len()];
        let (strikes, struck) = (strikes.to_vec(), Vec::new());
        Ring { drives, traffic: Traffic::default(), strikes, struck, heard }
    }

    /// One cycle, in which drives are told where to be at the end of the next one.
    pub fn cycle(&mut self, positions: &[i32]) {
        let before = self.traffic.bits;
        if let Some(sync) = self.pass(Place::Sync, &Telegram::Sync { phase: PHASE }) {
            self.drives.iter_mut().for_each(|drive| drive.hear(&sync));
        }
        self.drives.iter_mut().for_each(Drive::begin_cycle);
        for (at, address) in (1..=254).enumerate().take(self.drives.len()) {
            let telegram = self.drives[at].telegram();
            let heard = self.pass(Place::Drive(address), &telegram);
            self.heard[at] = match heard {
                Some(Telegram::Drive { address: from, status, position }) if from == address => {
                    Some((status, position))
                }
                _ => None,
            };
        }
        let toggle = if self.traffic.cycles.is_multiple_of(2) { CONTROL_NEW } else { 0 };
        let demand = |position: &i32| Demand { control: CONTROL_ON | toggle, position: *position };
        let control = Telegram::Control(positions.iter().map(demand).collect());
        if let Some(control) = self.pass(Place::Control, &control) {
            self.drives.iter_mut().for_each(|drive| drive.hear(&control));
        }
        self.traffic.bits_max = self.traffic.bits_max.max(self.traffic.bits - before);
        self.traffic.cycles += 1;
    }

    /// Sends a telegram round, and gives what arrives.
    fn pass(&mut self, place: Place, telegram: &Telegram) -> Option<Telegram> {
        let bytes = telegram.bytes();
        let mut bits = framed(&bytes);
        let plain = 2 * FLAG_BITS as usize + 8 * (bytes.len() + 2);
        self.traffic.bits += bits.len() as u64;
        self.traffic.stuffed += (bits.len() - plain) as u64;
        let cycle = self.traffic.cycles;
        let strikes = self.strikes.iter();
        for strike in strikes.filter(|strike| strike.cycle == cycle && strike.place == place) {
            if let Some(bit) = bits.get_mut(strike.bit) {
                *bit = !*bit;
                self.struck.push(*strike);
            }
        }
        let mut receiver = Receiver::default();
        let arrived = bits.iter().filter_map(|bit| receiver.bit(*bit)).flatten().next();
        let read = arrived.and_then(|bytes| Telegram::read(&bytes).ok());
        self.traffic.dropped += u64::from(read.is_none());
        read
    }

    /// The drives, by their addresses from 1 on.
    pub fn drives(&self) -> &[Drive] {
        &self.drives
    }

    /// What the control has heard of each drive in the last cycle: its actual position; none where
    /// its telegram was dropped.
    pub fn actual(&self) -> impl Iterator<Item = Option<i32>> {
        self.heard.iter().map(|heard| heard.map(|(_, position)| position))
    }

    /// The first drive that has told of a fault, by its address.
    pub fn faulty(&self) -> Option<u8> {
        let faults = self.heard.iter().zip(1..);
        let is_fault = |heard: &Option<(u16, i32)>| {
            heard.is_some_and(|(status, _)| status & STATUS_FAULT != 0)
        };
        faults.filter(|(heard, _)| is_fault(heard)).map(|(_, address)| address).next()
    }

    /// Faults that have struck, in their order.
    pub fn struck(&self) -> &[Strike] {
        &self.struck
    }

    /// What has gone over the line.
    pub fn traffic(&self) -> Traffic {
        self.traffic
    }
}

/// The time slots of a cycle (seed 000, figure 8).
pub fn slots(drives: u32, baud: u32) -> Vec<Slot> {
    let data = DRIVE_DATA_BYTES * f64::from(drives);
    let places = [(Place::Sync, SYNC_TELEGRAM_BYTES)].into_iter();
    let addresses = (1..=254).take(drives as usize);
    let places = places
        .chain(addresses.map(|address| (Place::Drive(address), DRIVE_TELEGRAM_BYTES)))
        .chain([(Place::Control, CONTROL_TELEGRAM_BYTES + data)]);
    let mut at_bits = 0.0;
    let mut slots = Vec::new();
    for (place, bytes) in places {
        let from_s = at_bits / f64::from(baud);
        at_bits += 2.0 * FLAG_BITS + bytes * STUFFED_BITS;
        slots.push(Slot { place, from_s, to_s: at_bits / f64::from(baud) });
    }
    slots
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::Sync => f.pad("sync"),
            Place::Drive(address) => f.pad(&format!("drive{address}")),
            Place::Control => f.pad("control"),
        }
    }
}

/// As it is read.
impl fmt::Display for Strike {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}@{}.{}", self.place, self.cycle, self.bit)
    }
}

/// A text that is no fault on a ring.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{0}' is no fault on a ring; expected one like control@17, sync@3 or drive2@100.45")]
pub struct NotAStrike(String);

/// `control@17`, `sync@3`, `drive2@100.45`: a telegram, its cycle, and its bit.
impl FromStr for Strike {
    type Err = NotAStrike;

    fn from_str(text: &str) -> Result<Strike, NotAStrike> {
        let read = || {
            let (place, when) = text.split_once('@')?;
            let place = match place {
                "sync" => Place::Sync,
                "control" => Place::Control,
                _ => Place::Drive(place.strip_prefix("drive")?.parse().ok().filter(|a| *a > 0)?),
            };
            let (cycle, bit) = when.split_once('.').unwrap_or((when, "20"));
            Some(Strike { cycle: cycle.parse().ok()?, place, bit: bit.parse().ok()? })
        };
        read().ok_or_else(|| NotAStrike(text.to_owned()))
    }
}
