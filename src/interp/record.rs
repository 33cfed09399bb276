//! The motions of a program that has been checked, in few bytes, so that it need not be run again
//! for them: a loop of six lines may make 200 thousand moves.
//!
//! A move is kept as what differs from the one before, in whole words of 64 bits: in most moves some
//! axes and the line. What cannot be told so is kept as it is. No more is kept than
//! [`WORDS_MAX`]: whoever wants the motions of a longer program runs it a second time.

use std::slice;

use crate::base::{Plane, Point};

use super::motion::{Bound, Corner, Motion, Move, MoveKind};

/// Most words of a record, 12 MiB: 390 thousand lines in three axes.
pub(super) const WORDS_MAX: usize = 3 << 19;

/// A move in numbers: where it ends, axis by axis, and what the names of its other places say.
type Row = [u64; KIND + 1];

const FEED: usize = 9;
/// The first of two.
const CENTER: usize = 10;
/// The block's N word and one; 0 if it has none.
const N: usize = 12;
/// [`RAPID`] or [`LINE`], or the bits of an arc.
const KIND: usize = 13;

const RAPID: u64 = 0;
const LINE: u64 = 1;
const ARC: u64 = 2;
const CCW: u64 = 4;
/// From this bit on, in two, the place of an arc's plane among [`PLANES`].
const PLANE_SHIFT: u32 = 3;
const PLANES: [Plane; 3] = [Plane::Xy, Plane::Zx, Plane::Yz];

/// The upper half of a word: there the turns of an arc stand, and a move's line.
const UPPER_SHIFT: u32 = 32;

/// In the word that begins a motion: it is kept as it is. Otherwise bits tell which words of the row
/// follow.
const AS_IT_IS: u64 = 1 << 31;

/// What the next move is told from.
#[derive(Clone, Copy, Debug, Default)]
struct Last {
    row: Row,
    corner: Corner,
    bound: Bound,
}

impl Last {
    fn to(&self) -> Point {
        Point::from_fn(|axis| f64::from_bits(self.row[axis as usize]))
    }

    /// The row of a move, if it can be told from the one before.
    fn row_of(&self, step: &Move) -> Option<Row> {
        let starts_there = self.row.iter().zip(&step.from.0).all(|(a, b)| *a == b.to_bits());
        if !starts_there || step.corner != self.corner || step.bound != self.bound {
            return None;
        }
        let mut row = self.row;
        row.iter_mut().zip(&step.to.0).for_each(|(word, at)| *word = at.to_bits());
        row[N] = step.n.map_or(0, |n| u64::from(n) + 1);
        // Words that a move has no use for stay, and take no room.
        if let Some(feed_mm_min) = step.kind.feed_mm_min() {
            row[FEED] = feed_mm_min.to_bits();
        }
        row[KIND] = match step.kind {
            MoveKind::Rapid => RAPID,
            MoveKind::Line { .. } => LINE,
            MoveKind::Arc { plane, center_mm: [first, second], ccw, turns, .. } => {
                (row[CENTER], row[CENTER + 1]) = (first.to_bits(), second.to_bits());
                let plane = PLANES.iter().position(|other| *other == plane)? as u64;
                let ccw = if ccw { CCW } else { 0 };
                ARC | ccw | plane << PLANE_SHIFT | u64::from(turns) << UPPER_SHIFT
            }
            MoveKind::Spline { .. } => return None,
        };
        Some(row)
    }

    /// The move of the row.
    fn step(&self, from: Point, line: u32) -> Move {
        let [feed_mm_min, first, second] =
            [FEED, CENTER, CENTER + 1].map(|place| f64::from_bits(self.row[place]));
        let kind = match self.row[KIND] {
            RAPID => MoveKind::Rapid,
            LINE => MoveKind::Line { feed_mm_min },
            arc => MoveKind::Arc {
                feed_mm_min,
                plane: PLANES[(arc >> PLANE_SHIFT & 3) as usize % PLANES.len()],
                center_mm: [first, second],
                ccw: arc & CCW != 0,
                turns: (arc >> UPPER_SHIFT) as u32,
            },
        };
        let n = self.row[N].checked_sub(1).map(|n| n as u32);
        let Last { corner, bound, .. } = *self;
        Move { line, n, from, to: self.to(), kind, corner, bound }
    }

    /// Takes a motion that is kept as it is.
    fn follow(&mut self, motion: &Motion) {
        let Motion::Move(step) = motion else { return };
        self.row.iter_mut().zip(&step.to.0).for_each(|(word, at)| *word = at.to_bits());
        (self.corner, self.bound) = (step.corner, step.bound);
    }
}

/// Motions in the order in which they were made.
#[derive(Debug)]
pub struct Record {
    words: Vec<u64>,
    as_they_are: Vec<Motion>,
    last: Last,
    words_left: usize,
}

impl Record {
    /// A record of so many words at most.
    pub(super) fn new(words_max: usize) -> Record {
        let (words, as_they_are) = (Vec::new(), Vec::new());
        Record { words, as_they_are, last: Last::default(), words_left: words_max }
    }

    /// Adds a motion; false if there is no room for it. Then the record is of no use any more.
    pub(super) fn add(&mut self, motion: &Motion) -> bool {
        let begin = self.words.len();
        let row = match motion {
            Motion::Move(step) => self.last.row_of(step).map(|row| (step.line, row)),
            Motion::Event(_) => None,
        };
        let mut beside = 0;
        if let Some((line, row)) = row {
            self.words.push(u64::from(line) << UPPER_SHIFT);
            let mut which = 0;
            for (place, (before, word)) in self.last.row.iter_mut().zip(row).enumerate() {
                if *before != word {
                    *before = word;
                    which |= 1 << place;
                    self.words.push(word);
                }
            }
            self.words[begin] |= which;
        } else {
            self.words.push(AS_IT_IS);
            self.as_they_are.push(motion.clone());
            self.last.follow(motion);
            beside = bytes_of(motion) / size_of::<u64>();
        }
        let left = self.words_left.checked_sub(self.words.len() - begin + beside);
        self.words_left = left.unwrap_or(0);
        left.is_some()
    }

    /// The motions, from the first on.
    pub fn replay(&self) -> Replay<'_> {
        let (words, as_they_are) = (self.words.iter(), self.as_they_are.iter());
        Replay { words, as_they_are, last: Last::default(), motion: None }
    }
}

/// What a motion takes that is kept as it is.
fn bytes_of(motion: &Motion) -> usize {
    let curve = match motion {
        Motion::Move(Move { kind: MoveKind::Spline { curve, .. }, .. }) => {
            size_of_val(curve.points()) + size_of_val(curve.weights()) + size_of_val(curve.knots())
        }
        _ => 0,
    };
    size_of::<Motion>() + curve
}

/// Hands out what has been recorded. Made by [`Record::replay`].
#[derive(Debug)]
pub struct Replay<'a> {
    words: slice::Iter<'a, u64>,
    as_they_are: slice::Iter<'a, Motion>,
    last: Last,
    motion: Option<Motion>,
}

impl Replay<'_> {
    /// The next motion; none at the end.
    pub fn read(&mut self) -> Option<&Motion> {
        let head = *self.words.next()?;
        if head & AS_IT_IS != 0 {
            let motion = self.as_they_are.next()?;
            self.last.follow(motion);
            return Some(motion);
        }
        let from = self.last.to();
        for (place, word) in self.last.row.iter_mut().enumerate() {
            if head >> place & 1 != 0 {
                *word = *self.words.next()?;
            }
        }
        let line = (head >> UPPER_SHIFT) as u32;
        Some(self.motion.insert(Motion::Move(self.last.step(from, line))))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use proptest::prelude::*;

    use super::*;
    use crate::base::{Event, EventKind, Spline};

    fn kinds() -> impl Strategy<Value = MoveKind> {
        let feed = || prop_oneof![Just(600.0), 0.1..1e4];
        let plane = prop::sample::select(PLANES.to_vec());
        let arc = (feed(), plane, [-1e3..1e3, -1e3..1e3], any::<bool>(), 0..3_u32);
        let points = proptest::collection::vec(proptest::array::uniform9(-9.0..9.0), 4);
        prop_oneof![
            4 => Just(MoveKind::Rapid),
            8 => feed().prop_map(|feed_mm_min| MoveKind::Line { feed_mm_min }),
            4 => arc.prop_map(|(feed_mm_min, plane, center_mm, ccw, turns)| {
                MoveKind::Arc { feed_mm_min, plane, center_mm, ccw, turns }
            }),
            1 => (feed(), points).prop_map(|(feed_mm_min, points)| {
                let points = points.into_iter().map(crate::base::AxisMap).collect();
                MoveKind::Spline { feed_mm_min, curve: Arc::new(Spline::bezier(points).unwrap()) }
            }),
        ]
    }

    /// Motions of which many begin where the one before has ended.
    fn motions() -> impl Strategy<Value = Vec<Motion>> {
        let at = || prop_oneof![8 => Just(0.0), 1 => Just(-0.0), 8 => -1e3..1e3];
        let point = || proptest::array::uniform9(at()).prop_map(crate::base::AxisMap);
        let corner = prop_oneof![
            8 => Just(Corner::Exact),
            1 => Just(Corner::Stop),
            1 => Just(Corner::Blend { tolerance_mm: Some(0.01), feed_scale: 1.0 }),
        ];
        let bound = prop_oneof![8 => Just(Bound::Free), 1 => Just(Bound::Spindle)];
        let n = prop_oneof![Just(None), Just(Some(0)), any::<u32>().prop_map(Some)];
        let step = (kinds(), point(), prop::option::weighted(0.1, point()), corner, bound, n);
        let motion = prop_oneof![
            9 => (step, any::<u32>()).prop_map(|((kind, to, from, corner, bound, n), line)| {
                (Motion::Move(Move { line, n, from: to, to, kind, corner, bound }), from)
            }),
            1 => any::<u32>().prop_map(|line| {
                (Motion::Event(Event { line, kind: EventKind::Dwell(1.0) }), None)
            }),
        ];
        proptest::collection::vec(motion, 0..40).prop_map(|motions| {
            let mut at = Point::ZERO;
            let follow = |(mut motion, elsewhere): (Motion, Option<Point>)| {
                if let Motion::Move(step) = &mut motion {
                    step.from = elsewhere.unwrap_or(at);
                    at = step.to;
                }
                motion
            };
            motions.into_iter().map(follow).collect()
        })
    }

    proptest! {
        #[test]
        fn what_was_recorded_comes_again_up_to_a_bound(
            motions in motions(),
            words_max in 0..1500_usize,
        ) {
            let mut record = Record::new(words_max);
            let is_whole = motions.iter().all(|motion| record.add(motion));
            let bytes = size_of_val(record.words.as_slice())
                + record.as_they_are.iter().map(bytes_of).sum::<usize>();
            let words = bytes.div_ceil(size_of::<u64>());
            prop_assert_eq!(is_whole, words <= words_max, "{} words", words);
            if is_whole {
                let mut replay = record.replay();
                for motion in &motions {
                    // Zeros have signs.
                    prop_assert_eq!(format!("{:?}", replay.read()), format!("{:?}", Some(motion)));
                }
                prop_assert!(replay.read().is_none());
            }
        }
    }
}
