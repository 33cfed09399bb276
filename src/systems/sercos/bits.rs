//! Bytes ⇄ bits on the fibre: flag, bytes and check with stuffed zeros, flag.
//!
//! As in HDLC (ISO/IEC 3309): each byte with its lowest bit first; after five 1 a 0 is stuffed, so
//! that six 1 are found in a flag (01111110) only; the check is the CRC of x¹⁶ + x¹² + x⁵ + 1, begun
//! with all 1 and inverted, its lower byte first.

use crc::{CRC_16_IBM_SDLC, Crc};

const CHECK: Crc<u16> = Crc::<u16>::new(&CRC_16_IBM_SDLC);
/// Six 1 between two 0.
const FLAG: [bool; 8] = [false, true, true, true, true, true, true, false];
/// After so many 1 a 0 is stuffed.
const ONES_MOST: u32 = 5;
/// Bits of a flag that have been taken for bytes when it is recognised: all but its last.
const FLAG_TAKEN: usize = 7;
/// Bytes of the check.
const CHECK_BYTES: usize = 2;

/// Why what stood between two flags was dropped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Dropped {
    /// Not a whole number of bytes.
    #[error("{0} bits are no whole bytes")]
    NotBytes(usize),
    /// Fewer bytes than a check.
    #[error("{0} bytes are too few for a telegram")]
    TooShort(usize),
    /// The check does not fit the bytes.
    #[error("check {found:04x} instead of {expected:04x}")]
    Check {
        /// That of the bytes.
        expected: u16,
        /// That on the line.
        found: u16,
    },
    /// Seven 1 in a row, which no sender sends.
    #[error("seven 1 in a row")]
    Aborted,
}

/// Bytes as they go over the fibre, check and flags added.
pub fn framed(bytes: &[u8]) -> Vec<bool> {
    let check = CHECK.checksum(bytes).to_le_bytes();
    let mut bits = FLAG.to_vec();
    let mut ones = 0;
    for byte in bytes.iter().chain(&check) {
        for at in 0..8 {
            let bit = byte >> at & 1 == 1;
            bits.push(bit);
            ones = if bit { ones + 1 } else { 0 };
            if ones == ONES_MOST {
                bits.push(false);
                ones = 0;
            }
        }
    }
    bits.extend(FLAG);
    bits
}

/// Takes bits from the fibre, and finds what stands between flags.
#[derive(Clone, Debug, Default)]
pub struct Receiver {
    /// 1 in a row so far.
    ones: u32,
    /// Bits since a flag; none before the first flag, and after bits that cannot be.
    since_flag: Option<Vec<bool>>,
}

impl Receiver {
    /// Takes a bit. Gives the bytes between two flags, without their check, or why they were dropped.
    pub fn bit(&mut self, bit: bool) -> Option<Result<Vec<u8>, Dropped>> {
        if bit {
            self.ones += 1;
            if self.ones > ONES_MOST + 1 {
                return self.since_flag.take().map(|_| Err(Dropped::Aborted));
            }
        } else {
            let ones = std::mem::take(&mut self.ones);
            if ones == ONES_MOST {
                return None;
            }
            if ones == ONES_MOST + 1 {
                let bits = self.since_flag.replace(Vec::new())?;
                let bits = &bits[..bits.len().saturating_sub(FLAG_TAKEN)];
                return (!bits.is_empty()).then(|| bytes(bits));
            }
        }
        if let Some(bits) = &mut self.since_flag {
            bits.push(bit);
        }
        None
    }
}

/// The bytes of a telegram, if their check says so.
fn bytes(bits: &[bool]) -> Result<Vec<u8>, Dropped> {
    let (octets, rest) = bits.as_chunks::<8>();
    if !rest.is_empty() {
        return Err(Dropped::NotBytes(bits.len()));
    }
    let byte =
        |octet: &[bool; 8]| octet.iter().rev().fold(0, |byte, bit| byte << 1 | u8::from(*bit));
    let mut bytes: Vec<u8> = octets.iter().map(byte).collect();
    let Some(end) = bytes.len().checked_sub(CHECK_BYTES) else {
        return Err(Dropped::TooShort(bytes.len()));
    };
    let check = bytes.split_off(end);
    let (found, expected) = (u16::from_le_bytes([check[0], check[1]]), CHECK.checksum(&bytes));
    if found != expected {
        return Err(Dropped::Check { expected, found });
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn received(bits: &[bool]) -> Vec<Result<Vec<u8>, Dropped>> {
        let mut receiver = Receiver::default();
        bits.iter().filter_map(|bit| receiver.bit(*bit)).collect()
    }

    fn shown(bits: &[bool]) -> String {
        bits.iter().map(|bit| if *bit { '1' } else { '0' }).collect()
    }

    #[test]
    fn five_ones_are_followed_by_a_zero_and_flags_by_none() {
        // 0x1f, lowest bit first, is 11111000; the check of CRC-16/IBM-SDLC over "123456789" is 906e.
        assert_eq!(CHECK.checksum(b"123456789"), 0x906e);
        assert!(shown(&framed(&[0x1f])).starts_with("01111110111110000"));
        assert!(shown(&framed(&[0xff, 0xff])).starts_with("0111111011111011111011111"));
        assert!(shown(&framed(&[0x7e])).ends_with("01111110"));
    }

    #[test]
    fn what_is_no_telegram_is_dropped() {
        let flag = "01111110";
        for (between, expected) in [
            ("0101", Err(Dropped::NotBytes(4))),
            ("00000000", Err(Dropped::TooShort(1))),
            ("1111111", Err(Dropped::Aborted)),
            // No byte at all: the check of nothing is 0.
            ("0000000000000000", Ok(Vec::new())),
            ("1000000000000000", Err(Dropped::Check { expected: 0, found: 1 })),
        ] {
            let text = [flag, between, flag].concat();
            let bits: Vec<bool> = text.chars().map(|bit| bit == '1').collect();
            assert_eq!(received(&bits), [expected], "{between}");
        }
        assert_eq!(received(&[]), []);
    }

    proptest! {
        /// What is sent is received, whatever stands before it, and a byte takes 9.6 bits at most.
        #[test]
        fn bytes_come_back(bytes in prop::collection::vec(any::<u8>(), 1..80), zeros in 0_usize..20) {
            let bits = framed(&bytes);
            let most = 16.0 + 9.6 * (bytes.len() + CHECK_BYTES) as f64;
            prop_assert!(bits.len() as f64 <= most, "{} of {most}", bits.len());
            let line = [vec![false; zeros], bits.clone(), bits].concat();
            let both: Vec<_> = received(&line).into_iter().filter(|found| found.is_ok()).collect();
            prop_assert_eq!(both, vec![Ok(bytes.clone()), Ok(bytes)]);
        }

        /// Any bits are taken, and after them a telegram is found again.
        #[test]
        fn noise_is_survived(
            noise in prop::collection::vec(any::<bool>(), 0..400),
            bytes in prop::collection::vec(any::<u8>(), 2..20),
        ) {
            // A first flag ends whatever the noise has begun.
            let line = [noise, framed(&[1, 2]), framed(&bytes)].concat();
            prop_assert_eq!(received(&line).pop(), Some(Ok(bytes)));
        }

        /// Up to three flipped bits are never taken for the telegram that was sent, nor for another
        /// one of its length.
        #[test]
        fn flipped_bits_are_found(
            bytes in prop::collection::vec(any::<u8>(), 9..10), at in prop::collection::btree_set(0_usize..88, 1..4),
        ) {
            let mut bits = framed(&bytes);
            for (place, bit) in bits.iter_mut().enumerate() {
                *bit ^= at.contains(&place);
            }
            for found in received(&bits).into_iter().flatten() {
                prop_assert_ne!(found.len(), bytes.len());
            }
        }
    }
}
