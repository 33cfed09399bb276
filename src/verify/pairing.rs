//! One walk along path and executed polyline, both only forward: how far apart the two are on it, in all and
//! block by block.
//!
//! In each tick the path is walked to the point that costs least: where it meets the tick point, or where the
//! corners passed on the way there meet the executed chord, each at its nearest point but in their order,
//! whichever is further apart. So a machine that turns back is not taken to have turned before it did.
//!
//! ```text
//!                      c         c: corner, met by c'
//!    path  ──────m────╱ ╲m'──    m, m': what the tick points p and p' meet
//!   steps  ───p───────c'──p'─
//! ```
//!
//! Between two meetings both run straight, so that they are furthest apart at one of them. No Fréchet
//! distance is greater than that of a walk, of the whole as of a block: a block's ends, too, are met.

use super::blocks::{Blocks, Meeting};
use super::edges::{Edge, Vector, difference, dot};
use super::sweep::{Chord, Sweep};

/// See the module.
#[derive(Debug)]
pub struct Pairing {
    /// Where the path is: the edge, by its number, and the share of it.
    edge: u64,
    share: f64,
    /// The greatest distance so far, less its slack.
    distance_mm: f64,
}

/// Where the path may be walked to in a tick.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    edge: u64,
    share: f64,
    line: u32,
    slack_mm: f64,
    /// Distance of the tick point, and the greatest of that and of those of corners on the way.
    distance_mm: f64,
    cost_mm: f64,
}

impl Pairing {
    /// Where both begin: the executed point, and the first edge.
    pub fn new(start: Vector, first: &Edge, blocks: &mut Blocks) -> Pairing {
        let mut pairing = Pairing { edge: 0, share: 0.0, distance_mm: 0.0 };
        // The start of the path is no corner: it has no slack.
        let meeting = Meeting { distance_mm: distance(start, first.from), slack_mm: 0.0 };
        pairing.meet(meeting, first.line, 0, blocks);
        pairing
    }

    /// The number of the edge that the path is on: what lies behind is not asked for again.
    pub fn edge(&self) -> u64 {
        self.edge
    }

    /// The next tick's chord.
    pub fn tick(&mut self, sweep: &Sweep<1>, tick: u64, blocks: &mut Blocks) {
        let Some(next) = self.cheapest(sweep) else { return };
        let mut corners = Corners::new(sweep.chord());
        let mut start = None;
        for (edge, _) in sweep.edges(self.edge).take((next.edge - self.edge) as usize) {
            start = Some(self.pass(edge, start, &mut corners, tick, blocks));
        }
        let end = Meeting { distance_mm: next.distance_mm, slack_mm: next.slack_mm };
        let met = start.into_iter().chain([end]);
        met.for_each(|meeting| self.meet(meeting, next.line, tick, blocks));
        blocks.point(next.distance_mm);
        (self.edge, self.share) = (next.edge, next.share);
    }

    /// The rest of the path, beside the last executed point; gives the distance of all of the walk.
    pub fn end(mut self, sweep: &Sweep<1>, tick: u64, blocks: &mut Blocks) -> f64 {
        let [_, last] = sweep.chord();
        let mut corners = Corners::new([last; 2]);
        let mut start = None;
        for (edge, _) in sweep.edges(self.edge) {
            start = Some(self.pass(edge, start, &mut corners, tick, blocks));
        }
        self.distance_mm
    }

    /// Where walking to costs least, nothing being further back than now; among equals the first.
    fn cheapest(&self, sweep: &Sweep<1>) -> Option<Candidate> {
        // What rounding may take off a length of metres.
        const ROUNDING_MM: f64 = 1e-9;
        let [_, to] = sweep.chord();
        let mut corners = Corners::new(sweep.chord());
        let (mut best, mut passed_mm): (Option<Candidate>, _) = (None, f64::NEG_INFINITY);
        for (number, (edge, chord)) in (self.edge..).zip(sweep.edges(self.edge)) {
            let least_share = if number == self.edge { self.share } else { 0.0 };
            let share = chord.near(to).share.clamp(least_share, 1.0);
            let distance_mm = distance(to, chord.at(share));
            let cost_mm = distance_mm.max(passed_mm);
            let is_less = |a: f64, b: f64| a + ROUNDING_MM < b;
            let is_better = best.is_none_or(|best: Candidate| {
                is_less(cost_mm, best.cost_mm)
                    || !is_less(best.cost_mm, cost_mm) && is_less(distance_mm, best.distance_mm)
            });
            if is_better {
                let Edge { line, slack_mm, .. } = *edge;
                let edge = number;
                best = Some(Candidate { edge, share, line, slack_mm, distance_mm, cost_mm });
            }
            passed_mm = passed_mm.max(corners.pass(edge));
            if best.is_some_and(|best| is_less(best.cost_mm, passed_mm)) {
                break;
            }
        }
        best
    }

    /// The path passes the end of an edge, whose start it may have passed in this tick, too.
    fn pass(
        &mut self,
        edge: &Edge,
        start: Option<Meeting>,
        corners: &mut Corners,
        tick: u64,
        blocks: &mut Blocks,
    ) -> Meeting {
        let end = Meeting { distance_mm: corners.pass(edge), slack_mm: edge.end_slack_mm };
        let met = start.into_iter().chain([end]);
        met.for_each(|meeting| self.meet(meeting, edge.line, tick, blocks));
        end
    }

    fn meet(&mut self, meeting: Meeting, line: u32, tick: u64, blocks: &mut Blocks) {
        self.distance_mm = self.distance_mm.max(meeting.distance_mm - meeting.slack_mm);
        blocks.meet(meeting, line, tick);
    }
}

/// Corners of the path beside an executed chord.
struct Corners {
    executed: Chord,
    /// How far along that the last one was met.
    share: f64,
}

impl Corners {
    fn new([from, to]: [Vector; 2]) -> Corners {
        Corners { executed: Chord::new(from, to), share: 0.0 }
    }

    /// How far off the next one is, the end of an edge.
    fn pass(&mut self, edge: &Edge) -> f64 {
        let share = self.executed.near(edge.to).share.clamp(0.0, 1.0);
        self.share = self.share.max(share);
        distance(self.executed.at(self.share), edge.to)
    }
}

fn distance(a: Vector, b: Vector) -> f64 {
    let off = difference(a, b);
    dot(off, off).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::verify::free_space::{Polyline, suffices, walk};
    use crate::verify::report::BlockError;
    use proptest::prelude::*;

    /// The distance of a walk along two polylines, and the blocks: the lines of edges count up from 1.
    fn walked(executed: &Polyline, path: &Polyline) -> (f64, Vec<BlockError>) {
        let edge = |(number, ends): (u32, &[Vector])| Edge {
            from: ends[0],
            to: ends[1],
            line: number + 1,
            feed_mm_s: f64::INFINITY,
            start_mm: 0.0,
            length_mm: distance(ends[0], ends[1]),
            others: Default::default(),
            others_feeds: [0.0; 2],
            slack_mm: 0.0,
            end_slack_mm: 0.0,
        };
        let mut edges = (0..).zip(path.windows(2)).map(edge);
        let mut more = || Ok::<_, ()>(edges.next());
        let first = more().unwrap().unwrap();
        let mut told = Vec::new();
        let mut tell = |block: &BlockError| told.push(*block);
        let mut blocks = Blocks::new(1e3, Some(&mut tell));
        let mut pairing = Pairing::new(executed[0], &first, &mut blocks);
        // All within reach, so that no edge is out of the window.
        let mut sweep = Sweep::new([1e3], executed[0], first);
        sweep.need_from(0);
        for (tick, at) in (0..).zip(&executed[1..]) {
            sweep.advance(tick, *at, &mut more).unwrap();
            pairing.tick(&sweep, tick, &mut blocks);
            sweep.need_from(pairing.edge());
        }
        let distance_mm = pairing.end(&sweep, executed.len() as u64 - 2, &mut blocks);
        blocks.end();
        (distance_mm, told)
    }

    #[track_caller]
    fn check(executed: &Polyline, path: &Polyline) {
        let (distance_mm, blocks) = walked(executed, path);
        let rounding = 1e-7;
        assert!(suffices(executed, path, distance_mm + rounding), "{distance_mm} is too little");
        assert!(blocks.iter().map(|block| block.line).eq(1..path.len() as u32), "{blocks:?}");
        let most_mm = blocks.iter().map(|block| block.max_mm).fold(0.0, f64::max);
        assert_eq!(most_mm, distance_mm);
        let ticks: u64 = blocks.iter().map(|block| block.ticks).sum();
        assert_eq!(ticks, executed.len() as u64 - 1);
    }

    proptest! {
        #[test]
        fn any_two_polylines_can_be_walked_so(one in walk(14, 3.0), other in walk(14, 3.0)) {
            check(&one, &other);
        }

        #[test]
        fn so_can_those_of_short_steps(one in walk(80, 0.2), other in walk(20, 1.0)) {
            check(&one, &other);
        }
    }

    #[test]
    fn each_block_has_its_own_distance() {
        // Along X, up, and back along X: 0.1 mm beside it on the way up, a corner cut by a chord of 45°.
        let path = vec![[0.0; 3], [4.0, 0.0, 0.0], [4.0, 4.0, 0.0], [0.0, 4.0, 0.0]];
        let executed = vec![
            [0.0; 3],
            [2.0, 0.0, 0.0],
            [3.0, 0.0, 0.0],
            [4.1, 1.1, 0.0],
            [4.1, 3.0, 0.0],
            [4.0, 4.0, 0.0],
            [0.0, 4.0, 0.0],
        ];
        let (_, blocks) = walked(&executed, &path);
        let corner_mm = 0.5_f64.sqrt();
        let most = blocks.iter().map(|block| (block.ticks, block.max_mm));
        let due = [(2, corner_mm), (3, corner_mm), (1, 0.0)];
        for (found, due) in most.zip(due) {
            assert!(found.0 == due.0 && (found.1 - due.1).abs() < 1e-12, "{blocks:?}");
        }
        assert!((blocks[1].rms_mm.unwrap() - (0.02_f64 / 3.0).sqrt()).abs() < 1e-12, "{blocks:?}");
    }

    #[test]
    fn what_turns_back_is_not_taken_to_have_turned_before() {
        // Down and up again along the same line, ticks a hundredth apart.
        let path = vec![[0.0; 3], [0.0, 0.0, -1.0], [0.0; 3]];
        let at = |tick: i32| [0.001, 0.0, f64::from((tick - 100).abs() - 100) * 0.01];
        let (distance_mm, _) = walked(&(0..=200).map(at).collect(), &path);
        assert!((distance_mm - 0.001).abs() < 1e-12, "{distance_mm}");
    }
}
