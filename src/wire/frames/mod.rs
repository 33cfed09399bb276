//! Counts of one tick ⇄ a frame of 13 bytes that every node hears (seed 004, method A, fig. 3.11).
//!
//! ```text
//! byte  0     info: 1 m m m c c c c       mode m, check c
//! byte  1  2  place 1: 0 h h h h h h h  0 l l l l l l l     signed count, two's complement
//!   …
//! byte 11 12  place 6
//! ```
//! The thesis gives the outline (an info byte that says the mode, two bytes an axis, six axes); the bits
//! are ours. Rules: only an info byte has bit 7, so a node finds a frame's start by itself; check =
//! frame number since the last [`Mode::Begin`] + mode + every half byte of data, modulo 16, so a frame
//! that was lost, and any one bit that was changed, shows in this frame or in the next one. No frame is
//! answered: what a node finds out stays with it.

mod job;
mod lint;
mod node;

use crate::base::machine::{FRAME_BYTES, FRAME_COUNT_MAX, FRAME_PLACES};

use self::job::check_bus;
pub(super) use self::job::fills;
pub(super) use self::lint::lint;
pub use self::node::{FrameNode, FrameNodeLimits};

/// Bit 7: a frame begins.
pub const INFO: u8 = 0x80;

/// Places of a frame.
const PLACES: usize = FRAME_PLACES as usize;
/// Bytes of a frame.
const BYTES: usize = FRAME_BYTES as usize;

/// A frame's bytes.
pub type Frame = [u8; BYTES];

/// What a frame is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// The frames that follow are counted from here; nothing moves.
    Begin = 1,
    /// Every node makes its count in a tick.
    Move = 2,
}

/// A count as the two bytes of a place; none when it is beyond [`FRAME_COUNT_MAX`].
pub fn encode(count: i32) -> Option<[u8; 2]> {
    (count.unsigned_abs() <= FRAME_COUNT_MAX)
        .then_some([(count >> 7 & 0x7f) as u8, (count & 0x7f) as u8])
}

/// The count of a place's two bytes.
pub fn decode([high, low]: [u8; 2]) -> i32 {
    let bits = i32::from(high & 0x7f) << 7 | i32::from(low & 0x7f);
    if bits & 0x2000 == 0 { bits } else { bits - 0x4000 }
}

/// A frame of encoded counts. `number` counts frames from [`Mode::Begin`], which is 0.
pub fn frame(mode: Mode, number: u64, places: &[[u8; 2]; PLACES]) -> Frame {
    let mut frame = [0; BYTES];
    for (bytes, place) in frame[1..].chunks_exact_mut(2).zip(places) {
        bytes.copy_from_slice(place);
    }
    frame[0] = INFO | (mode as u8) << 4 | check(mode as u8, number, &frame);
    frame
}

/// The mode of a frame, if it is whole and this one is due.
pub fn mode(frame: &Frame, number: u64) -> Option<Mode> {
    let mode = match frame[0] >> 4 & 7 {
        1 => Mode::Begin,
        2 => Mode::Move,
        _ => return None,
    };
    (frame[0] & 0x0f == check(mode as u8, number, frame)).then_some(mode)
}

/// The two bytes of a place, from 1.
pub fn place(frame: &Frame, place: u8) -> [u8; 2] {
    let at = 2 * usize::from(place);
    [frame[at - 1], frame[at]]
}

fn check(mode: u8, number: u64, frame: &Frame) -> u8 {
    let halves = frame[1..].iter().map(|byte| u64::from(byte >> 4) + u64::from(byte & 0x0f));
    ((number + u64::from(mode) + halves.sum::<u64>()) & 0x0f) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_count_that_fits_comes_back() {
        for count in -8191..=8191 {
            let bytes = encode(count).unwrap();
            assert_eq!(decode(bytes), count);
            assert!(bytes.iter().all(|byte| byte & INFO == 0));
        }
        for count in [8192, -8192, i32::MAX, i32::MIN] {
            assert_eq!(encode(count), None);
        }
    }

    #[test]
    fn the_layout_is_that_of_the_drawing() {
        let places = [5, -3, 0, 300, -8191, 8191].map(|count| encode(count).unwrap());
        let bytes = frame(Mode::Move, 1, &places);
        let expected =
            [0xa0, 0x00, 0x05, 0x7f, 0x7d, 0x00, 0x00, 0x02, 0x2c, 0x40, 0x01, 0x3f, 0x7f];
        assert_eq!(bytes[1..], expected[1..]);
        assert_eq!(bytes[0] & 0xf0, expected[0]);
        for (at, count) in (1..).zip([5, -3, 0, 300, -8191, 8191]) {
            assert_eq!(decode(place(&bytes, at)), count);
        }
    }

    #[test]
    fn a_bit_that_is_changed_or_a_frame_that_is_lost_shows() {
        let places = [5, -3, 0, 20, -20, 119].map(|count| encode(count).unwrap());
        for number in 0..40 {
            let sent = frame(Mode::Move, number, &places);
            assert_eq!(mode(&sent, number), Some(Mode::Move));
            for lost in 1..16 {
                assert_eq!(
                    mode(&sent, number - number.min(lost)),
                    (number == 0).then_some(Mode::Move)
                );
            }
            for bit in 0..8 * sent.len() {
                let mut changed = sent;
                changed[bit / 8] ^= 1 << (bit % 8);
                // Bit 7 shows in the number of bytes.
                let is_start = bit % 8 == 7;
                assert!(is_start || mode(&changed, number).is_none(), "bit {bit}");
            }
        }
    }
}
