//! How far nodes with words of different length drift off the path: tick by tick, all of them at once,
//! so that a program is read twice whatever is compared.
//!
//! Drift is the distance of a node's own number from where the path is at that tick, axis by axis, in
//! steps, before the node rounds to whole steps: half a step of drift is a step too many or too few.

use super::node::{Node, Range, Rounding, WORD_BITS_MAX, Word};
use super::{Equations, steps_per_mm};
use crate::base::{Axis, AxisMap, Machine, Point};

/// Drift that may put a node a step off.
pub const DRIFT_MAX_STEPS: f64 = 0.5;

/// What there is to know of a program before its nodes run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Needs {
    /// What its positions and constants need.
    pub range: Range,
    /// All of its ticks.
    pub ticks: u64,
}

impl Needs {
    /// Takes what a segment needs.
    pub fn include(&mut self, equations: &Equations, scale: &AxisMap<f64>) {
        self.range.include(equations, scale);
        self.ticks += equations.ticks;
    }

    /// Words to compare: from no bit behind the point to so many that a rounding in every tick, each
    /// of up to four parts, comes to less than half a step; 32 bits are among them.
    pub fn words(&self, rounding: Rounding) -> Vec<Word> {
        let least = 1 + self.range.position_bits();
        let enough = least + (64 - self.ticks.leading_zeros()) + 4;
        let words = least..=enough.clamp(32, WORD_BITS_MAX);
        words.filter_map(|bits| self.range.word(bits, rounding)).collect()
    }
}

/// A drift, and where it is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drift {
    /// Its magnitude, in steps.
    pub steps: f64,
    /// The tick after which it is there, from 1.
    pub tick: u64,
    /// Line of the program.
    pub line: u32,
}

/// Nodes that run a program, one set for each word.
#[derive(Clone, Debug)]
pub struct Runs {
    scale: AxisMap<f64>,
    axes: Vec<Axis>,
    runs: Vec<Run>,
    done: u64,
}

/// What one word comes to.
#[derive(Clone, Debug)]
pub struct Run {
    node: Node,
    /// Greatest drift of any axis so far.
    pub greatest: Drift,
    /// Drift of every axis after the last tick, with its sign.
    pub last_steps: AxisMap<f64>,
}

impl Run {
    /// Its word.
    pub fn word(&self) -> Word {
        self.node.word()
    }
}

impl Runs {
    /// Nodes that stand at the start of a program.
    pub fn new(machine: &Machine, start_mm: &Point, words: &[Word]) -> Runs {
        let scale = steps_per_mm(machine);
        let start_steps = AxisMap::from_fn(|axis| start_mm[axis] * scale[axis]);
        let run = |word: &Word| {
            let node = Node::new(*word, &start_steps);
            Run { node, greatest: Drift::default(), last_steps: AxisMap::default() }
        };
        let axes = machine.axes.iter().map(|profile| profile.axis).collect();
        Runs { scale, axes, runs: words.iter().map(run).collect(), done: 0 }
    }

    /// Runs a segment; `at_tick` is told after every tick how many are done, and what each word has
    /// come to.
    pub fn segment(&mut self, equations: &Equations, mut at_tick: impl FnMut(u64, &[Run])) {
        self.runs.iter_mut().for_each(|run| run.node.take(equations));
        for tick in 1..=equations.ticks {
            let place = equations.at_steps(tick, &self.scale);
            self.done += 1;
            for run in &mut self.runs {
                run.node.tick();
                let at = run.node.position_steps();
                for axis in &self.axes {
                    let drift = at[*axis] - place[*axis];
                    run.last_steps[*axis] = drift;
                    if drift.abs() > run.greatest.steps {
                        let line = equations.segment.line;
                        run.greatest = Drift { steps: drift.abs(), tick: self.done, line };
                    }
                }
            }
            at_tick(self.done, &self.runs);
        }
    }

    /// What each word has come to.
    pub fn runs(&self) -> &[Run] {
        &self.runs
    }
}

/// The shortest word that stays within half a step, as all longer ones do.
pub fn least_word(runs: &[Run]) -> Option<Word> {
    let is_within = |run: &&Run| run.greatest.steps <= DRIFT_MAX_STEPS;
    runs.iter().rev().take_while(is_within).last().map(Run::word)
}
