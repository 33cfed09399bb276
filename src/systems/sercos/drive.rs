//! What a drive makes of the telegrams: it is at each sync telegram where it was told to be, as far
//! as it was told.
//!
//! The position of a control telegram is taken at the sync telegram that follows it, and reached
//! within that cycle. If either of them was lost, the drive repeats its last step; at the second
//! time in a row it stops and says so from then on.

use super::{Demand, Telegram};

/// Control word: drive on, enabled, not held.
pub const CONTROL_ON: u16 = 0xe000;
/// Bit of the control word that changes with every new position.
pub const CONTROL_NEW: u16 = 0x0400;
/// Status word: in operation.
const STATUS_ON: u16 = 0xc000;
/// Bit of the status word: the drive has stopped by itself.
pub const STATUS_FAULT: u16 = 0x2000;
/// Lost positions in a row that stop a drive.
const LOST_MOST: u32 = 2;

/// A drive that follows its demands exactly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Drive {
    address: u8,
    /// Where it is at the start of the cycle.
    position: i32,
    /// What it moves in the cycle.
    step: i32,
    /// What it has been told since the last sync telegram.
    demand: Option<i32>,
    has_synced: bool,
    lost: u32,
    repeated: u64,
    is_faulty: bool,
}

impl Drive {
    /// At rest at a position, with that as its demand.
    pub fn new(address: u8, position: i32) -> Drive {
        Drive {
            address,
            position,
            step: 0,
            demand: Some(position),
            has_synced: false,
            lost: 0,
            repeated: 0,
            is_faulty: false,
        }
    }

    /// A telegram passes by. The demand of a drive is the one at its address.
    pub fn hear(&mut self, telegram: &Telegram) {
        match telegram {
            Telegram::Sync { .. } => self.has_synced = true,
            Telegram::Control(demands) => {
                let own = demands.get(usize::from(self.address) - 1);
                self.demand = own.map(|Demand { position, .. }| *position);
            }
            Telegram::Drive { .. } => {}
        }
    }

    /// The time of the sync telegram is over: the last cycle's step is done, the next begins.
    pub fn begin_cycle(&mut self) {
        self.position = self.position.wrapping_add(self.step);
        let demand = self.demand.take().filter(|_| std::mem::take(&mut self.has_synced));
        match demand {
            _ if self.is_faulty => self.step = 0,
            Some(demand) => {
                self.step = demand.wrapping_sub(self.position);
                self.lost = 0;
            }
            None => {
                self.lost += 1;
                self.is_faulty = self.lost >= LOST_MOST;
                self.step = if self.is_faulty { 0 } else { self.step };
                self.repeated += u64::from(!self.is_faulty);
            }
        }
        self.has_synced = false;
    }

    /// What it sends in its time slot.
    pub fn telegram(&self) -> Telegram {
        let fault = if self.is_faulty { STATUS_FAULT } else { 0 };
        let (address, position) = (self.address, self.position);
        Telegram::Drive { address, status: STATUS_ON | fault, position }
    }

    /// What it moves in the cycle.
    pub fn step(&self) -> i32 {
        self.step
    }

    /// How often it has repeated its last step.
    pub fn repeated(&self) -> u64 {
        self.repeated
    }

    /// Whether it has stopped by itself.
    pub fn is_faulty(&self) -> bool {
        self.is_faulty
    }
}
