//! Levels ⇄ bytes on the PLC's line.
//!
//! The control's levels are 10 bytes: `1 0 kk 0 0 d s` (kind, DEN, strobe), eight BCD digits as `0 ppp dddd`
//! (place from the lowest, digit), and the sum of all these modulo 128. The PLC's are 2: `1 000000 f`
//! (FIN) and its complement. Only a first byte has bit 7. Levels, not edges, are sent, and again and again, so
//! that one message that is lost or spoilt is made good by the next.

use super::{Function, Kind, Signals};

/// Bytes of the control's levels.
pub const NC_BYTES: usize = 10;
/// Bytes of the PLC's.
pub const PLC_BYTES: usize = 2;
/// BCD digits of a code.
const DIGITS: u32 = 8;
/// Bit 7: a message begins.
const FIRST: u8 = 0x80;

/// The control's levels as bytes.
pub fn of_nc(signals: &Signals) -> [u8; NC_BYTES] {
    let mut bytes = [0; NC_BYTES];
    let kind = signals.function.map_or(0, |function| function.kind as u8);
    bytes[0] = FIRST | kind << 4 | u8::from(signals.den) << 1 | u8::from(signals.strobe);
    let code = signals.function.map_or(0, |function| function.code);
    for place in 0..DIGITS {
        let digit = code / 10_u32.pow(place) % 10;
        bytes[1 + place as usize] = (place << 4 | digit) as u8;
    }
    bytes[NC_BYTES - 1] = sum(&bytes);
    bytes
}

/// The PLC's level as bytes.
pub fn of_plc(fin: bool) -> [u8; PLC_BYTES] {
    [FIRST | u8::from(fin), 0x7f ^ u8::from(fin)]
}

/// Bytes, one after another, → messages of so many bytes.
#[derive(Clone, Debug, Default)]
pub struct Ear<const BYTES: usize> {
    heard: Vec<u8>,
}

impl<const BYTES: usize> Ear<BYTES> {
    fn message(&mut self, byte: u8) -> Option<[u8; BYTES]> {
        if byte & FIRST != 0 {
            self.heard.clear();
        } else if self.heard.is_empty() {
            return None;
        }
        self.heard.push(byte);
        let whole = self.heard[..].try_into().ok()?;
        self.heard.clear();
        Some(whole)
    }
}

impl Ear<NC_BYTES> {
    /// The control's levels, once a message is whole and right.
    pub fn nc(&mut self, byte: u8) -> Option<Signals> {
        let bytes = self.message(byte)?;
        let mut code = 0;
        for place in 0..DIGITS {
            let digit = u32::from(bytes[1 + place as usize]).checked_sub(place << 4)?;
            code += (digit < 10).then_some(digit)? * 10_u32.pow(place);
        }
        let kind = match bytes[0] >> 4 & 7 {
            0 => None,
            1 => Some(Kind::M),
            2 => Some(Kind::S),
            3 => Some(Kind::T),
            _ => return None,
        };
        let signals = Signals {
            function: kind.map(|kind| Function { kind, code }),
            strobe: bytes[0] & 1 != 0,
            den: bytes[0] & 2 != 0,
        };
        (bytes[NC_BYTES - 1] == sum(&bytes)).then_some(signals)
    }
}

impl Ear<PLC_BYTES> {
    /// The PLC's level, once a message is whole and right.
    pub fn plc(&mut self, byte: u8) -> Option<bool> {
        let bytes = self.message(byte)?;
        [false, true].into_iter().find(|fin| bytes == of_plc(*fin))
    }
}

fn sum(bytes: &[u8; NC_BYTES]) -> u8 {
    bytes[..NC_BYTES - 1].iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte)) & 0x7f
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_come_back_and_spoilt_ones_do_not() {
        for (text, strobe, den) in [
            ("M8", true, false),
            ("S12000", false, true),
            ("T99999999", true, true),
            ("M0", false, false),
        ] {
            let signals = Signals { function: Some(text.parse().unwrap()), strobe, den };
            let bytes = of_nc(&signals);
            assert!(bytes[1..].iter().all(|byte| byte & FIRST == 0));
            // Half a message before it is no harm.
            let mut ear = Ear::<NC_BYTES>::default();
            let heard: Vec<_> =
                [&bytes[..4], &bytes].concat().iter().filter_map(|b| ear.nc(*b)).collect();
            assert_eq!(heard, [signals]);
            for bit in 0..8 * bytes.len() {
                let mut spoilt = bytes;
                spoilt[bit / 8] ^= 1 << (bit % 8);
                let mut ear = Ear::<NC_BYTES>::default();
                assert_eq!(spoilt.iter().find_map(|byte| ear.nc(*byte)), None, "{text}, bit {bit}");
            }
        }
        let none = of_nc(&Signals::default());
        assert_eq!(none.iter().find_map(|byte| Ear::default().nc(*byte)), None);
        let mut ear = Ear::<NC_BYTES>::default();
        assert_eq!(none.iter().find_map(|byte| ear.nc(*byte)), Some(Signals::default()));
        for fin in [false, true] {
            let mut ear = Ear::<PLC_BYTES>::default();
            assert_eq!(of_plc(fin).iter().find_map(|byte| ear.plc(*byte)), Some(fin));
        }
    }

    #[test]
    fn the_bytes_are_those_of_the_manual() {
        let signals = Signals { function: Some("M38".parse().unwrap()), strobe: true, den: false };
        let expected = [0x91, 0x08, 0x13, 0x20, 0x30, 0x40, 0x50, 0x60, 0x70, 0x5c];
        assert_eq!(of_nc(&signals), expected);
    }
}
