//! Whether an interface keeps up with a program: blocks of the path and their times → what is
//! lacking, by line.
//!
//! A block must last at least as long as the interface takes to tell of it (seed 000, section
//! 3.2); an axis must not ask for more steps in a period than its word holds; and a cut must not
//! last longer than the buffers hold, or it is interrupted while they are filled. Blocks run at
//! their feeds here, or as fast as the axes can: ramps make them longer, never shorter. That a
//! ring or a frame lets the last part of a block wait for its next period is no lack.

use std::fmt;

use super::{Carry, Interface, Refusal, Setting};
use crate::base::machine::{FRAME_COUNT_MAX, PADS_MIN};
use crate::base::{Axis, Machine};
use crate::path::{Curve, PathItem, Segment};

/// A piece of the path and its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block {
    /// Line of the NC program, from 1.
    pub line: u32,
    /// Way.
    pub length_mm: f64,
    /// Its feed; none for a rapid.
    pub feed_mm_s: Option<f64>,
    /// How long it takes at that feed, or as fast as the axes can.
    pub time_s: f64,
    /// A spline, of which nodes know nothing.
    pub is_spline: bool,
    /// The axis that makes most steps a second, and how many.
    pub steps_s: Option<(Axis, f64)>,
}

impl Block {
    /// Of a segment on a machine; none where it has no length.
    pub fn of(segment: &Segment, machine: &Machine) -> Option<Block> {
        let length_mm = segment.length_mm();
        let speeds = segment.axis_speeds();
        let profiles = || machine.axes.iter().filter(|profile| speeds[profile.axis] > 0.0);
        let limits = profiles().map(|profile| profile.speed_max_mm_s / speeds[profile.axis]);
        let limit_mm_s = limits.fold(f64::INFINITY, f64::min);
        let speed_mm_s = segment.feed_mm_s.unwrap_or(f64::INFINITY).min(limit_mm_s);
        let steps = profiles().map(|profile| {
            (profile.axis, speeds[profile.axis] * speed_mm_s * profile.steps_per_mm)
        });
        (length_mm > 0.0 && speed_mm_s.is_finite()).then(|| Block {
            line: segment.line,
            length_mm,
            feed_mm_s: segment.feed_mm_s,
            time_s: length_mm / speed_mm_s,
            is_spline: matches!(segment.curve, Curve::Spline(_)),
            steps_s: steps.max_by(|a, b| a.1.total_cmp(&b.1)),
        })
    }
}

/// What an interface lacks for a block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lack {
    /// The block is over before the axes can be told of the next one.
    TooShort {
        /// What it takes.
        time_s: f64,
        /// What it would have to take.
        least_s: f64,
    },
    /// An axis makes more steps in a period than its word holds.
    TooManySteps {
        /// Which.
        axis: Axis,
        /// Steps in a period.
        steps: f64,
        /// How many there can be.
        most: u32,
    },
    /// The cut goes on when the buffers are empty: the axes stand while they are filled.
    Interrupted {
        /// How often within the block.
        times: u64,
        /// Motion that the buffers hold.
        buffer_s: f64,
        /// What filling takes.
        fill_s: f64,
    },
}

impl Lack {
    /// By what factor the block misses.
    fn factor(&self) -> f64 {
        match self {
            Lack::TooShort { time_s, least_s } => least_s / time_s,
            Lack::TooManySteps { steps, most, .. } => steps / f64::from(*most),
            Lack::Interrupted { buffer_s, fill_s, .. } => 1.0 + fill_s / buffer_s,
        }
    }
}

impl fmt::Display for Lack {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Lack::TooShort { time_s, least_s } => {
                write!(
                    f,
                    "{:.3} ms, and telling the axes takes {:.3} ms",
                    time_s * 1e3,
                    least_s * 1e3
                )
            }
            Lack::TooManySteps { axis, steps, most } => {
                write!(f, "{axis} makes {steps:.0} steps a period, of {most} at most")
            }
            Lack::Interrupted { buffer_s, fill_s, .. } => write!(
                f,
                "the buffers hold {buffer_s:.2} s of the cut: it stands still for {fill_s:.2} s"
            ),
        }
    }
}

/// A block that an interface does not keep up with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Which block, from 0.
    pub index: u64,
    /// Its line.
    pub line: u32,
    /// What is lacking.
    pub lack: Lack,
}

/// Whether an interface keeps up with the blocks that have passed by.
#[derive(Clone, Debug)]
pub struct Judge {
    /// As it is set up; its period is the one that blocks are held against.
    pub setting: Setting,
    /// What it carries.
    pub carry: Carry,
    /// Why it cannot work at all.
    pub refusal: Option<Refusal>,
    /// How many blocks are too short, and how many ask for too many steps; how often a cut is
    /// interrupted.
    pub lacking: [u64; 3],
    /// The first block that it does not keep up with.
    pub first: Option<Found>,
    /// The one that it misses by the greatest factor.
    pub worst: Option<Found>,
    /// Most steps in a period.
    count_max: Option<u32>,
    /// Length of the cut since the last rapid or event.
    cut_s: f64,
}

impl Judge {
    /// Of an interface on a machine. Where no period is asked for, it is the least that can be set;
    /// with buffered nodes the machine's tick.
    pub fn new(setting: Setting, machine: &Machine, asks_period: bool) -> Judge {
        let refusal = if asks_period {
            setting.check()
        } else {
            // Only the period gives way.
            let slow = Setting { period_s: f64::MAX, ..setting };
            slow.check()
        };
        let least_s = setting.carry().least_s;
        let has_period = asks_period || setting.interface == Interface::Buffered;
        let period_s = if has_period { setting.period_s.max(least_s) } else { least_s };
        let setting = Setting { period_s, ..setting };
        let count_max = match setting.interface {
            Interface::Frame => Some(FRAME_COUNT_MAX),
            Interface::Buffered => Some(machine.bus.count_max),
            Interface::Coefficients | Interface::Sercos | Interface::Parallel => None,
        };
        Judge {
            setting,
            carry: setting.carry(),
            refusal: refusal.err(),
            lacking: [0; 3],
            first: None,
            worst: None,
            count_max,
            cut_s: 0.0,
        }
    }

    /// Whether nothing has been lacking.
    pub fn keeps_up(&self) -> bool {
        self.refusal.is_none() && self.first.is_none()
    }

    /// An item of the path passes by, and its block if it is one, the `index`th. Gives the first
    /// thing that is lacking for it.
    pub fn item(&mut self, item: &PathItem, block: Option<&Block>, index: u64) -> Option<Lack> {
        match (item, block) {
            (PathItem::Event(_), _) => self.cut_s = 0.0,
            (PathItem::Segment(_), Some(block)) => return self.block(block, index),
            (PathItem::Segment(_), None) => {}
        }
        None
    }

    fn block(&mut self, block: &Block, index: u64) -> Option<Lack> {
        let lacks = [self.too_short(block), self.too_many_steps(block), self.interrupted(block)];
        for (lack, count) in lacks.into_iter().zip(&mut self.lacking) {
            let Some(lack) = lack else { continue };
            *count += match lack {
                Lack::Interrupted { times, .. } => times,
                _ => 1,
            };
            let found = Found { index, line: block.line, lack };
            self.first.get_or_insert(found);
            if self.worst.is_none_or(|worst| worst.lack.factor() < lack.factor()) {
                self.worst = Some(found);
            }
        }
        lacks.into_iter().flatten().next()
    }

    fn too_short(&self, block: &Block) -> Option<Lack> {
        let period_s = self.setting.period_s;
        let least_s = match self.setting.interface {
            // Nodes are told of a block once, and of a spline as of a line each period.
            Interface::Coefficients => self.carry.line_s,
            _ => period_s,
        };
        let time_s = if block.is_spline { block.time_s.min(period_s) } else { block.time_s };
        (time_s < least_s * (1.0 - 1e-9)).then_some(Lack::TooShort { time_s, least_s })
    }

    fn too_many_steps(&self, block: &Block) -> Option<Lack> {
        let (most, (axis, steps_s)) = (self.count_max?, block.steps_s?);
        let steps = steps_s * self.setting.period_s;
        // A rapid goes as fast as it can.
        let is_cut = block.feed_mm_s.is_some();
        (is_cut && steps > f64::from(most)).then_some(Lack::TooManySteps { axis, steps, most })
    }

    fn interrupted(&mut self, block: &Block) -> Option<Lack> {
        let fill_s = self.carry.fill_s?;
        if block.feed_mm_s.is_none() {
            self.cut_s = 0.0;
            return None;
        }
        let ticks = self.setting.buffer_ticks.saturating_sub(PADS_MIN);
        let buffer_s = f64::from(ticks) * self.setting.period_s;
        self.cut_s += block.time_s;
        let times = (self.cut_s / buffer_s) as u64;
        self.cut_s %= buffer_s;
        (times > 0).then_some(Lack::Interrupted { times, buffer_s, fill_s })
    }
}
