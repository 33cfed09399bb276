//! What a walk along path and executed polyline comes to, block by block: a run of one NC line. A line that
//! comes again (a loop, a subprogram) is another run.

use super::report::BlockError;

/// How many blocks are named in the report.
const WORST_BLOCKS: usize = 10;

/// Takes what is found of a block, once the walk has left it.
pub type TellBlock<'a> = &'a mut dyn FnMut(&BlockError);

/// A point of the path and one of what is executed.
#[derive(Clone, Copy, Debug)]
pub struct Meeting {
    pub distance_mm: f64,
    /// How much further off than elsewhere they may be there.
    pub slack_mm: f64,
}

/// Takes meetings and tick points in the order of the walk.
pub struct Blocks<'a> {
    /// What is allowed where there is no slack.
    bound_mm: f64,
    tell: Option<TellBlock<'a>>,
    current: Option<BlockError>,
    /// Tick points, and the squares of their distances, of that block and of those before it.
    points: Sum,
    all_points: Sum,
    worst: Vec<BlockError>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Sum {
    count: u64,
    squares: f64,
}

impl Sum {
    fn add(&mut self, Sum { count, squares }: Sum) {
        self.count += count;
        self.squares += squares;
    }

    fn root_mean_square(&self) -> Option<f64> {
        (self.count > 0).then(|| (self.squares / self.count as f64).sqrt())
    }
}

impl<'a> Blocks<'a> {
    /// Before the first block. `bound_mm` is what is allowed where there is no slack.
    pub fn new(bound_mm: f64, tell: Option<TellBlock<'a>>) -> Blocks<'a> {
        let (points, all_points) = (Sum::default(), Sum::default());
        Blocks { bound_mm, tell, current: None, points, all_points, worst: Vec::new() }
    }

    /// In a tick, the walk is here, on a line.
    pub fn meet(&mut self, Meeting { distance_mm, slack_mm }: Meeting, line: u32, tick: u64) {
        if self.current.is_none_or(|block| block.line != line) {
            self.close();
            let (max_mm, allowed_mm) = (0.0, self.bound_mm);
            self.current =
                Some(BlockError { line, ticks: 0, tick, max_mm, allowed_mm, rms_mm: None });
        }
        let Some(block) = &mut self.current else { return };
        block.allowed_mm = block.allowed_mm.max(self.bound_mm + slack_mm);
        if distance_mm > block.max_mm {
            (block.tick, block.max_mm) = (tick, distance_mm);
        }
    }

    /// A tick ends on the line that the walk is on, at a distance from the path.
    pub fn point(&mut self, distance_mm: f64) {
        self.points.add(Sum { count: 1, squares: distance_mm * distance_mm });
    }

    fn close(&mut self) {
        let points = std::mem::take(&mut self.points);
        self.all_points.add(points);
        // Line 0 is no line: the path has no motion.
        let Some(block) = self.current.take().filter(|block| block.line > 0) else { return };
        let (ticks, rms_mm) = (points.count, points.root_mean_square());
        let block = BlockError { ticks, rms_mm, ..block };
        if let Some(tell) = &mut self.tell {
            tell(&block);
        }
        let least_mm = self.worst.last().map_or(0.0, |last| last.max_mm);
        if self.worst.len() < WORST_BLOCKS || block.max_mm > least_mm {
            self.name(block);
        }
    }

    /// Puts a block among the worst; a line that is there stays with its worse run.
    fn name(&mut self, block: BlockError) {
        match self.worst.iter_mut().find(|known| known.line == block.line) {
            Some(known) if known.max_mm < block.max_mm => *known = block,
            Some(_) => {}
            None => self.worst.push(block),
        }
        self.worst.sort_by(|a, b| b.max_mm.total_cmp(&a.max_mm));
        self.worst.truncate(WORST_BLOCKS);
    }

    /// The walk is over: the worst blocks, worst first, and the root mean square of all tick points.
    pub fn end(mut self) -> (Vec<BlockError>, f64) {
        self.close();
        (self.worst, self.all_points.root_mean_square().unwrap_or(0.0))
    }
}
