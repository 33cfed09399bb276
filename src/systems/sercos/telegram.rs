//! Bytes between two flags ⇄ what they mean: address, then data (seed 000, figure 7).
//!
//! | telegram | address | data |
//! |---|---|---|
//! | sync | 255 | phase of the ring: 4, in operation |
//! | drive | 1 to 254 | status word, service word, actual position (32 bits) |
//! | control | 255 | for each drive: control word, service word, position (32 bits) |
//!
//! Seed 000 gives the lengths (4, 11 and 3 + 8 bytes a drive with address and check, positions of 32
//! bits); how the other 4 bytes of a drive are divided is as SERCOS has it. Numbers go with their
//! lowest byte first.

/// The address of the control's telegrams, which no drive has.
pub const CONTROL_ADDRESS: u8 = 255;
/// Bytes of data of a drive.
const DRIVE_BYTES: usize = 8;

/// What goes round.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Telegram {
    /// A cycle begins.
    Sync {
        /// Phase of the ring.
        phase: u8,
    },
    /// A drive tells where it is.
    Drive {
        /// Its address, from 1 to 254.
        address: u8,
        /// What it does.
        status: u16,
        /// Actual position.
        position: i32,
    },
    /// The control tells all drives where to go.
    Control(Vec<Demand>),
}

/// What a drive is told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Demand {
    /// What it is to do.
    pub control: u16,
    /// Where to be at the end of the next cycle.
    pub position: i32,
}

/// Bytes that are no telegram of this ring, though their check is right.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{bytes} bytes for address {address} are no telegram")]
pub struct Unknown {
    /// The address that they begin with; 0 where there is none.
    pub address: u8,
    /// How many they are.
    pub bytes: usize,
}

impl Telegram {
    /// The bytes between the flags, without their check.
    pub fn bytes(&self) -> Vec<u8> {
        match self {
            Telegram::Sync { phase } => vec![CONTROL_ADDRESS, *phase],
            Telegram::Drive { address, status, position } => {
                [&[*address][..], &data(*status, *position)].concat()
            }
            Telegram::Control(demands) => {
                let demands = demands.iter().map(|demand| data(demand.control, demand.position));
                [CONTROL_ADDRESS].into_iter().chain(demands.flatten()).collect()
            }
        }
    }

    /// What bytes mean.
    ///
    /// # Errors
    /// When their number is none that a telegram of their address has.
    pub fn read(bytes: &[u8]) -> Result<Telegram, Unknown> {
        let address = bytes.first().copied().unwrap_or(0);
        let unknown = Unknown { address, bytes: bytes.len() };
        let (groups, rest) = bytes.get(1..).ok_or(unknown)?.as_chunks::<DRIVE_BYTES>();
        match (address, groups, rest) {
            (CONTROL_ADDRESS, [], [phase]) => Ok(Telegram::Sync { phase: *phase }),
            (CONTROL_ADDRESS, [_, ..], []) => {
                let demand = |group| {
                    let (control, position) = parts(group);
                    Demand { control, position }
                };
                Ok(Telegram::Control(groups.iter().map(demand).collect()))
            }
            (1..CONTROL_ADDRESS, [group], []) => {
                let (status, position) = parts(group);
                Ok(Telegram::Drive { address, status, position })
            }
            _ => Err(unknown),
        }
    }
}

/// Word, service word, position.
fn data(word: u16, position: i32) -> [u8; DRIVE_BYTES] {
    let ([w0, w1], [p0, p1, p2, p3]) = (word.to_le_bytes(), position.to_le_bytes());
    [w0, w1, 0, 0, p0, p1, p2, p3]
}

fn parts([w0, w1, _, _, p0, p1, p2, p3]: &[u8; DRIVE_BYTES]) -> (u16, i32) {
    (u16::from_le_bytes([*w0, *w1]), i32::from_le_bytes([*p0, *p1, *p2, *p3]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn telegrams_are_as_long_as_seed_000_counts_them() {
        let check = 2;
        let demand = Demand { control: 0xe000, position: -2 };
        for (telegram, bytes) in [
            (Telegram::Sync { phase: 4 }, 4),
            (Telegram::Drive { address: 3, status: 0xc000, position: 1 << 20 }, 11),
            (Telegram::Control(vec![demand]), 3 + 8),
            (Telegram::Control(vec![demand; 8]), 3 + 8 * 8),
        ] {
            assert_eq!(telegram.bytes().len() + check, bytes);
            assert_eq!(Telegram::read(&telegram.bytes()), Ok(telegram));
        }
        let drive = Telegram::Drive { address: 3, status: 0xc001, position: -2 };
        assert_eq!(drive.bytes(), [3, 0x01, 0xc0, 0, 0, 0xfe, 0xff, 0xff, 0xff]);
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..40)) {
            if let Ok(telegram) = Telegram::read(&bytes) {
                let mut plain = bytes.clone();
                // Service words are not looked at, and sent as 0.
                for group in plain[1..].chunks_exact_mut(8) {
                    group[2..4].fill(0);
                }
                prop_assert_eq!(telegram.bytes(), plain);
            }
        }
    }
}
