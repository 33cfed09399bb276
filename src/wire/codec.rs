//! One axis's steps in one tick ⇄ the command byte: bit 7 is the direction (1 is negative), bits
//! 0 to 6 are the steps. Minus zero (128) is never made.

/// Bit 7 of a command byte: set, the axis moves towards minus.
pub const NEGATIVE: u8 = 0x80;

/// The byte of a count; none when it has more than 127 steps.
pub fn encode(count: i32) -> Option<u8> {
    let steps = u8::try_from(count.unsigned_abs()).ok().filter(|steps| *steps < NEGATIVE)?;
    Some(if count < 0 { steps | NEGATIVE } else { steps })
}

/// The count of a byte, as the node's pulse generator reads it: 128 makes no step.
pub fn decode(byte: u8) -> i32 {
    let steps = i32::from(byte & !NEGATIVE);
    if byte & NEGATIVE == 0 { steps } else { -steps }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_count_that_fits_comes_back() {
        for count in -127..=127 {
            let byte = encode(count).unwrap();
            assert_eq!(decode(byte), count);
            assert_ne!(byte, 128);
        }
        for count in [128, -128, i32::MAX, i32::MIN] {
            assert_eq!(encode(count), None);
        }
        assert_eq!(decode(128), 0);
    }
}
