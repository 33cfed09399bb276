//! Axes, and values that each axis has one of.

use std::fmt;
use std::ops::{Index, IndexMut};

use serde::{Deserialize, Serialize};

/// How many axes a machine can have: the nine letters of RS-274.
pub const AXES: usize = 9;

/// An axis of the machine, in the order in which all output lists them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[allow(missing_docs)]
pub enum Axis {
    X,
    Y,
    Z,
    A,
    B,
    C,
    U,
    V,
    W,
}

impl Axis {
    /// All axes, in order.
    pub const ALL: [Axis; AXES] =
        [Axis::X, Axis::Y, Axis::Z, Axis::A, Axis::B, Axis::C, Axis::U, Axis::V, Axis::W];
    /// The three axes in which contours are measured.
    pub const LINEAR: [Axis; 3] = [Axis::X, Axis::Y, Axis::Z];

    /// The letter of the axis.
    pub fn letter(self) -> char {
        char::from(b"XYZABCUVW"[self as usize])
    }

    /// The axis of an upper-case letter.
    #[inline]
    pub fn from_letter(letter: u8) -> Option<Axis> {
        BY_LETTER[usize::from(letter)]
    }

    /// Whether the axis turns: its unit is then the degree, wherever a name says mm.
    pub fn is_rotary(self) -> bool {
        matches!(self, Axis::A | Axis::B | Axis::C)
    }
}

/// The axes of all bytes: none of most.
const BY_LETTER: [Option<Axis>; 256] = {
    let mut axes = [None; 256];
    let mut i = 0;
    while i < AXES {
        axes[b"XYZABCUVW"[i] as usize] = Some(Axis::ALL[i]);
        i += 1;
    }
    axes
};

impl fmt::Display for Axis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.letter())
    }
}

/// One value an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct AxisMap<T>(pub [T; AXES]);

/// A position: mm in machine coordinates unless said otherwise, degrees on rotary axes.
pub type Point = AxisMap<f64>;

/// A way of so many millimetres or degrees may be what is left of none by rotation, scaling or a
/// calculation in the program: a tenth of a nanometre. A feed along it, while other axes go far, would
/// mean nothing.
const RESIDUE_MM: f64 = 1e-7;

impl Point {
    /// All axes at zero.
    pub const ZERO: Point = AxisMap([0.0; AXES]);

    /// X, Y and Z.
    #[inline]
    pub fn xyz(&self) -> [f64; 3] {
        [self.0[0], self.0[1], self.0[2]]
    }

    /// The straight way to a point that a feed applies to, and its axes: that in X Y Z; of a move in
    /// other axes alone that in U V W, and else the angle in A B C (as RS-274/NGC has it). What is
    /// left of no way by rounding leads no other axis: see [`RESIDUE_MM`].
    #[inline]
    pub fn feed_way(&self, to: &Point) -> (f64, [Axis; 3]) {
        let length_mm = self.way_mm(to, Axis::LINEAR);
        if length_mm > RESIDUE_MM {
            return (length_mm, Axis::LINEAR);
        }
        self.short_feed_way(to)
    }

    /// The same where X, Y and Z move by next to nothing.
    #[inline(never)]
    fn short_feed_way(&self, to: &Point) -> (f64, [Axis; 3]) {
        let groups = [Axis::LINEAR, [Axis::U, Axis::V, Axis::W], [Axis::A, Axis::B, Axis::C]];
        let ways = groups.map(|axes| (self.way_mm(to, axes), axes));
        let longer_than = |least: f64| ways.into_iter().find(|(way_mm, _)| *way_mm > least);
        longer_than(RESIDUE_MM).or_else(|| longer_than(0.0)).unwrap_or(ways[2])
    }

    /// Length of the straight way to a point in three axes.
    #[inline]
    fn way_mm(&self, to: &Point, axes: [Axis; 3]) -> f64 {
        let [a, b, c] = axes.map(|axis| to[axis] - self[axis]);
        (a * a + b * b + c * c).sqrt()
    }
}

impl<T> AxisMap<T> {
    /// A map made axis by axis.
    pub fn from_fn(mut value: impl FnMut(Axis) -> T) -> Self {
        AxisMap(std::array::from_fn(|i| value(Axis::ALL[i])))
    }
}

impl<T> Index<Axis> for AxisMap<T> {
    type Output = T;
    fn index(&self, axis: Axis) -> &T {
        &self.0[axis as usize]
    }
}

impl<T> IndexMut<Axis> for AxisMap<T> {
    fn index_mut(&mut self, axis: Axis) -> &mut T {
        &mut self.0[axis as usize]
    }
}

/// A set of axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct AxisSet(u16);

impl AxisSet {
    /// No axis.
    pub const EMPTY: AxisSet = AxisSet(0);
    /// All that a machine can have.
    pub const ALL: AxisSet = AxisSet((1 << AXES) - 1);

    /// Adds an axis.
    pub fn insert(&mut self, axis: Axis) {
        self.0 |= 1 << axis as u16;
    }

    /// Takes an axis out.
    pub fn remove(&mut self, axis: Axis) {
        self.0 &= !(1 << axis as u16);
    }

    /// Whether the axis is in the set.
    pub fn contains(self, axis: Axis) -> bool {
        self.0 & (1 << axis as u16) != 0
    }

    /// Whether no axis is in the set.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// How many axes are in the set.
    pub fn len(self) -> usize {
        self.0.count_ones() as usize
    }

    /// The axes of both sets.
    pub fn union(self, other: AxisSet) -> AxisSet {
        AxisSet(self.0 | other.0)
    }

    /// The axes of the set, in order.
    pub fn iter(self) -> impl Iterator<Item = Axis> {
        let mut left = self.0;
        std::iter::from_fn(move || {
            let axis = *Axis::ALL.get(left.trailing_zeros() as usize)?;
            left &= left - 1;
            Some(axis)
        })
    }
}

impl FromIterator<Axis> for AxisSet {
    fn from_iter<I: IntoIterator<Item = Axis>>(axes: I) -> Self {
        let mut set = AxisSet::EMPTY;
        axes.into_iter().for_each(|axis| set.insert(axis));
        set
    }
}
