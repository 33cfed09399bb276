//! A node that runs difference equations in words of so many bits.
//!
//! ```text
//!  sign  I bits: whole steps . f bits: parts of a step        W = 1 + I + f
//! ```
//!
//! Positions and ways have f bits behind the point. Constants have as many as leave room for the
//! greatest of them (W - 2 where none exceeds 1). A sum of products is formed exactly, as in the long
//! accumulator of a signal processor, and rounded once to f bits; what does not fit a word stays at its
//! end (saturation). E and G are 1, so lines need no product. A node knows nothing of the path but what
//! it was sent, and goes on from where it stands: nothing tells it that it is off.

use super::{Equations, Turn};
use crate::base::{AxisMap, Point};

/// Most bits of a word.
pub const WORD_BITS_MAX: u32 = 62;

/// What becomes of the bits that do not fit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rounding {
    /// To the nearest, halves up.
    #[default]
    Nearest,
    /// Downwards: bits are dropped.
    Down,
}

/// A node's word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Word {
    /// All bits, the sign included.
    pub bits: u32,
    /// Bits behind the point of positions, in steps.
    pub fraction_bits: u32,
    /// Bits behind the point of constants.
    pub constant_bits: u32,
    /// What becomes of further ones.
    pub rounding: Rounding,
}

/// What a program needs of a word before the point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Greatest magnitude of a position, in the machine's coordinates or from an arc's centre, in steps.
    pub steps_max: f64,
    /// Line of the program where that is.
    pub line: u32,
    /// Greatest magnitude of a constant; 1 at least.
    pub constant_max: f64,
}

impl Default for Range {
    fn default() -> Range {
        Range { steps_max: 0.0, line: 1, constant_max: 1.0 }
    }
}

/// Bits that hold whole numbers up to a magnitude.
fn whole_bits(magnitude: f64) -> u32 {
    libm::log2(magnitude.floor() + 1.0).ceil() as u32
}

impl Range {
    /// Takes a position in steps.
    fn reach(&mut self, steps: f64, line: u32) {
        if steps.abs() > self.steps_max {
            (self.steps_max, self.line) = (steps.abs(), line);
        }
    }

    /// Takes a place on a line of the program.
    pub fn include_place(&mut self, place_mm: &Point, scale: &AxisMap<f64>, line: u32) {
        place_mm.0.iter().zip(&scale.0).for_each(|(mm, scale)| self.reach(mm * scale, line));
    }

    /// Takes what a segment needs.
    pub fn include(&mut self, equations: &Equations, scale: &AxisMap<f64>) {
        let segment = &equations.segment;
        self.include_place(&segment.from_mm, scale, segment.line);
        self.include_place(&segment.to_mm, scale, segment.line);
        if let (Some(turn), crate::path::Curve::Arc(arc)) = (&equations.turn, &segment.curve) {
            for (axis, center) in turn.plane.axes().into_iter().zip(turn.center_steps) {
                let radius = arc.radius_max_mm() * scale[axis];
                self.reach(radius, segment.line);
                self.reach(center.abs() + radius, segment.line);
            }
            self.constant_max = self.constant_max.max(turn.constant_max());
        }
    }

    /// Bits before the point of positions: half a step more than the greatest must have room too.
    pub fn position_bits(&self) -> u32 {
        whole_bits(self.steps_max + 0.5)
    }

    /// A word of so many bits whose point stands as far left as the program lets it; none where
    /// there is no room for whole steps.
    pub fn word(&self, bits: u32, rounding: Rounding) -> Option<Word> {
        let fraction_bits = bits.checked_sub(1 + self.position_bits())?;
        self.word_with(bits, fraction_bits, rounding)
    }

    /// A word with its point where it is said; none where a position or a constant has no room.
    pub fn word_with(&self, bits: u32, fraction_bits: u32, rounding: Rounding) -> Option<Word> {
        let is_room = bits <= WORD_BITS_MAX && bits > fraction_bits + self.position_bits();
        let constant_bits = bits.checked_sub(1 + whole_bits(self.constant_max))?;
        is_room.then_some(Word { bits, fraction_bits, constant_bits, rounding })
    }
}

impl Word {
    /// The greatest position that it holds, in steps.
    pub fn steps_max(&self) -> f64 {
        unit(self.bits - 1 - self.fraction_bits)
    }

    /// A number of steps as a word.
    pub fn position(&self, steps: f64) -> i64 {
        self.kept(self.rounded(steps * unit(self.fraction_bits)).into())
    }

    /// A constant as a word.
    pub fn constant(&self, constant: f64) -> i64 {
        self.kept(self.rounded(constant * unit(self.constant_bits)).into())
    }

    fn rounded(&self, value: f64) -> i64 {
        match self.rounding {
            Rounding::Nearest => (value + 0.5).floor() as i64,
            Rounding::Down => value.floor() as i64,
        }
    }

    /// A sum of products of constants and positions, as a position.
    fn shifted(&self, sum: i128) -> i64 {
        let half = match self.rounding {
            Rounding::Nearest if self.constant_bits > 0 => 1_i128 << (self.constant_bits - 1),
            Rounding::Nearest | Rounding::Down => 0,
        };
        self.kept((sum + half) >> self.constant_bits)
    }

    fn kept(&self, value: i128) -> i64 {
        let end = 1_i128 << (self.bits - 1);
        value.clamp(-end, end - 1) as i64
    }
}

/// Two to a power.
fn unit(bits: u32) -> f64 {
    (1_u64 << bits) as f64
}

/// All nodes of a machine, each with a word.
#[derive(Clone, Debug)]
pub struct Node {
    word: Word,
    /// Where the axes are.
    position: AxisMap<i64>,
    way: AxisMap<i64>,
    turn: Option<Turning>,
}

/// An arc under way.
#[derive(Clone, Copy, Debug)]
struct Turning {
    turn: Turn,
    center: [i64; 2],
    from_center: [i64; 2],
    constants: [i64; 4],
}

impl Node {
    /// Nodes that stand at a position, in steps.
    pub fn new(word: Word, start_steps: &AxisMap<f64>) -> Node {
        let position = AxisMap::from_fn(|axis| word.position(start_steps[axis]));
        Node { word, position, way: AxisMap::default(), turn: None }
    }

    /// Their word.
    pub fn word(&self) -> Word {
        self.word
    }

    /// Takes the equations of a segment.
    pub fn take(&mut self, equations: &Equations) {
        let word = self.word;
        self.way = AxisMap::from_fn(|axis| word.position(equations.way_steps[axis]));
        self.turn = equations.turn.map(|turn| {
            let center = turn.center_steps.map(|steps| word.position(steps));
            let [x, y] = turn.plane.axes();
            let from_center = [(x, 0), (y, 1)]
                .map(|(axis, i)| word.kept((self.position[axis] - center[i]).into()));
            let constants = turn.constants.map(|constant| word.constant(constant));
            Turning { turn, center, from_center, constants }
        });
    }

    /// Applies the equations once.
    pub fn tick(&mut self) {
        let word = self.word;
        for (position, way) in self.position.0.iter_mut().zip(&self.way.0) {
            *position = word.kept(i128::from(*position) + i128::from(*way));
        }
        if let Some(turning) = &mut self.turn {
            let [a, b, c, d] = turning.constants.map(i128::from);
            let [u, v] = turning.from_center.map(i128::from);
            turning.from_center = [word.shifted(a * u - b * v), word.shifted(c * u + d * v)];
            for (i, axis) in turning.turn.plane.axes().into_iter().enumerate() {
                let place = i128::from(turning.center[i]) + i128::from(turning.from_center[i]);
                self.position[axis] = word.kept(place);
            }
        }
    }

    /// Where the axes are, in steps and parts of a step.
    pub fn position_steps(&self) -> AxisMap<f64> {
        let part = 1.0 / unit(self.word.fraction_bits);
        AxisMap::from_fn(|axis| self.position[axis] as f64 * part)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_has_room_for_what_the_program_reaches() {
        let range = Range { steps_max: 14_500.0, line: 5, constant_max: 1.0 };
        assert_eq!(range.position_bits(), 14);
        assert_eq!(range.word(14, Rounding::Nearest), None);
        let word = range.word(16, Rounding::Nearest).unwrap();
        assert_eq!((word.fraction_bits, word.constant_bits), (1, 14));
        assert_eq!((word.position(-2.26), word.constant(1.0)), (-5, 1 << 14));
        assert_eq!(range.word_with(16, 8, Rounding::Nearest), None);
        // Beyond its end a word stays there.
        assert_eq!(word.position(1e9), (1 << 15) - 1);
    }
}
