//! Threads: G33, G33.1 and G76, the moves in step with the spindle's turns.
//!
//! The spindle's speed is taken as it was commanded, so a pitch becomes a feed: mm a turn times
//! turns a minute. On the machine the axes have to follow the turns themselves, by an encoder; a
//! machine without one has these codes refused. Threads have to be cut at one speed of the spindle:
//! nothing here holds it.

use crate::base::{Axis, EventKind, Point};
use crate::gcode::codes::{Cycle, Follow};
use crate::gcode::{Block, Fault, letter_set, rules};

use super::execute::{Asked, Executor, Output};
use super::feed::Turning;
use super::motion::{Bound, Corner, Motion, MoveKind};
use super::words::whole;
use super::{Dialect, cycles::PASSES_MAX};

/// Letters that the threading cycle makes use of, beside axes.
pub(super) const THREAD_LETTERS: u32 = letter_set("EHIJKLPQR");

/// Angles at which passes feed in are below this: the way along Z grows with the tangent.
const ANGLE_MAX_DEG: f64 = 90.0;

/// A threading cycle (G76), in mm and radians.
struct Thread {
    start: Point,
    /// At the end of the last pass, but for X.
    end: Point,
    /// Along the thread, a turn.
    pitch_mm: f64,
    /// From where the cycle starts to the thread's peak, and on to its root.
    peak_mm: f64,
    height_mm: f64,
    /// Depth of the first pass below the peak; later ones lie at this times pass^(1/degression).
    first_mm: f64,
    degression: f64,
    /// Tangent of the angle at which passes feed in, with the sign of the way along Z.
    slope: f64,
    spring_passes: u32,
    /// Length of the tapers at the ends, with the sign of the way along Z; 0: none.
    taper_mm: f64,
    tapers: [bool; 2],
    /// 1 where the tool cuts towards greater X, else -1.
    outwards: f64,
}

impl Executor<'_> {
    /// Whether G76 in a block is the threading cycle, and not fine boring, which has no K.
    pub(super) fn is_thread(&self, cycle: Cycle, block: &Block) -> bool {
        cycle == Cycle::BoreFine && (self.dialect == Dialect::LinuxCnc || block.has(b'K'))
    }

    /// Whether axes can follow the spindle's turns. The first code that needs it is reported.
    pub(super) fn follows_spindle(
        &mut self,
        name: &str,
        block: &Block,
        faults: &mut Vec<Fault>,
    ) -> bool {
        let follows = self.machine.spindle.is_some_and(|spindle| spindle.encoder);
        if !follows && !self.signals.sync_missed {
            self.signals.sync_missed = true;
            let message = format!(
                "{name}: the axes of the machine {} cannot follow the turns of its spindle",
                self.machine.id
            );
            let fault = Fault::block(&rules::SPINDLE_SYNC, block, message);
            faults.push(fault.help(
                "cut the thread by a tool of its own (mill it, or G84 with M3 before and a floating \
                 holder); a machine that can has encoder = true in its profile's [spindle]",
            ));
        }
        follows
    }

    /// Turns of the spindle a minute that moves can follow; reports why there are none.
    pub(super) fn sync_rpm(
        &mut self,
        name: &str,
        block: &Block,
        faults: &mut Vec<Fault>,
    ) -> Option<f64> {
        if !self.follows_spindle(name, block, faults) {
            return None;
        }
        if self.turning == Turning::Stopped {
            let message = format!("{name} needs the spindle turning");
            let fault = Fault::block(&rules::SPINDLE_STOPPED, block, message);
            faults.push(fault.help("write M3 or M4 and S before it"));
            return None;
        }
        let rpm = self.turns_min();
        if rpm.is_none() {
            let message = format!("{name} needs the spindle at one speed that is known");
            let fault = Fault::block(&rules::NO_SPINDLE_SPEED, block, message);
            faults.push(fault.help("write G97 and S in turns a minute before it"));
        }
        rpm
    }

    /// Makes a straight move in step with the spindle, to a place in machine coordinates.
    pub(super) fn go_synced(
        &mut self,
        block: &Block,
        to: &Point,
        feed_mm_min: f64,
        out: &mut Output<'_>,
    ) {
        let mut step = self.step(block, to, MoveKind::Line { feed_mm_min }, out.line);
        (step.corner, step.bound) = (Corner::Exact, Bound::Spindle);
        out.motions.push(Motion::Move(step));
    }

    /// G33 and G33.1, to a place in machine coordinates.
    pub(super) fn thread(
        &mut self,
        follow: Follow,
        block: &Block,
        to: &Point,
        out: &mut Output<'_>,
    ) {
        let name = match follow {
            Follow::Tap => "G33.1",
            _ if self.dialect == Dialect::FanucLathe => "G32",
            _ => "G33",
        };
        let pitch_mm = match block.word(b'K') {
            None if self.dialect.is_fanuc() && follow == Follow::Thread => {
                self.pitch_by_lead(name, block, &self.position_mm, to, out.faults)
            }
            Some(word) if word.value == 0.0 => {
                let message = format!("{name}: a pitch of 0 leads nowhere");
                out.faults.push(Fault::word(&rules::BAD_VALUE, word, message));
                None
            }
            Some(word) => Some(word.value.abs() * self.mm_per_unit),
            None => {
                let message = format!("{name} has no K, the way along the path a turn");
                out.faults.push(Fault::block(&rules::MISSING_WORD, block, message));
                None
            }
        };
        let back = block.word(b'I').map_or(1.0, |word| word.value);
        if let Some(word) = block.word(b'I').filter(|word| word.value <= 0.0) {
            let message = "I, how much faster the tap comes out, is above 0";
            out.faults.push(Fault::word(&rules::BAD_VALUE, word, message));
            return;
        }
        let rpm = self.sync_rpm(name, block, out.faults);
        let (Some(pitch_mm), Some(rpm)) = (pitch_mm, rpm) else {
            self.position_mm = if follow == Follow::Tap { self.position_mm } else { *to };
            return;
        };
        let start = self.position_mm;
        self.go_synced(block, to, pitch_mm * rpm, out);
        if follow == Follow::Tap {
            self.turn_spindle(true, rpm * back, out);
            self.go_synced(block, &start, pitch_mm * rpm * back, out);
            self.turn_spindle(false, rpm, out);
        }
    }

    /// What F, a lead along the longer of Z and X, is along the path.
    pub(super) fn pitch_by_lead(
        &self,
        name: &str,
        block: &Block,
        from: &Point,
        to: &Point,
        faults: &mut Vec<Fault>,
    ) -> Option<f64> {
        let Some(feed) = self.feed else {
            let message = format!("{name} has no F, the lead of the thread a turn");
            faults.push(Fault::block(&rules::MISSING_WORD, block, message));
            return None;
        };
        let ways = Axis::LINEAR.map(|axis| (to[axis] - from[axis]).abs());
        let longest = ways.into_iter().fold(0.0, f64::max);
        if longest == 0.0 {
            let message = format!("{name}: this thread has no length, for F to be its lead along");
            faults.push(Fault::block(&rules::BAD_VALUE, block, message));
            return None;
        }
        let length = ways.iter().map(|way| way * way).sum::<f64>().sqrt();
        Some(feed.mm * length / longest)
    }

    /// Starts the spindle the way it turns, or the other way round.
    fn turn_spindle(&self, reversed: bool, rpm: f64, out: &mut Output<'_>) {
        let code = if (self.turning == Turning::Clockwise) != reversed { 3 } else { 4 };
        out.event(EventKind::M { code, spindle_rpm: Some(rpm), tool: None });
    }

    /// G76 as RS274/NGC has it: all passes of a thread along Z.
    pub(super) fn thread_cycle(&mut self, block: &Block, asked: Asked, out: &mut Output<'_>) {
        let faults_before = out.faults.len();
        let start = self.frames.program(&self.position_mm);
        let end = self.program_target(block, out.faults);
        if asked.machine_coordinates {
            super::words::machine_coordinates_alone(block, out.faults);
        }
        let thread = self.take_thread(block, start, end, out.faults);
        let rpm = if asked.is_faulty { None } else { self.sync_rpm("G76", block, out.faults) };
        let (Some(thread), Some(rpm)) = (thread, rpm) else {
            self.forget_position();
            return;
        };
        if out.faults.len() > faults_before {
            self.forget_position();
            return;
        }
        let passes = libm::pow(thread.height_mm / thread.first_mm, thread.degression);
        if passes > PASSES_MAX {
            let message = format!("{:.0} passes are more than {PASSES_MAX}", passes.ceil());
            out.faults.push(Fault::block(&rules::BAD_VALUE, block, message));
            self.forget_position();
            return;
        }
        let mut cut = Cutting { executor: self, block, out, rpm };
        let mut depth_mm = thread.first_mm;
        for pass in 2.. {
            if depth_mm >= thread.height_mm {
                break;
            }
            cut.pass(&thread, depth_mm);
            depth_mm = thread.first_mm * libm::pow(f64::from(pass), thread.degression.recip());
        }
        for _ in 0..=thread.spring_passes {
            cut.pass(&thread, thread.height_mm);
        }
        cut.rapid(&thread.end);
    }

    /// Reads the words of G76; reports those that are missing or wrong.
    fn take_thread(
        &self,
        block: &Block,
        start: Point,
        end: Point,
        faults: &mut Vec<Fault>,
    ) -> Option<Thread> {
        let missing: Vec<String> = (*b"ZPIJK")
            .into_iter()
            .filter(|letter| !block.has(*letter))
            .map(|letter| char::from(letter).to_string())
            .collect();
        if !missing.is_empty() {
            let message = format!("the threading cycle G76 has no {}", missing.join(", no "));
            let help = "P is the pitch, I from here to the peak, J the first depth, K the height";
            faults.push(Fault::block(&rules::MISSING_WORD, block, message).help(help));
            return None;
        }
        for letter in *b"PJK" {
            let word = block.word(letter)?;
            if word.value <= 0.0 {
                let message = format!("{word}: in G76 {} is above 0", char::from(letter));
                faults.push(Fault::word(&rules::BAD_VALUE, word, message));
                return None;
            }
        }
        let [first, height] = [block.word(b'J')?, block.word(b'K')?];
        if first.value >= height.value {
            let message = format!("the first depth, {first}, is not below the height, {height}");
            faults.push(Fault::word(&rules::BAD_VALUE, first, message));
            return None;
        }
        if let Some(word) = block.word(b'Q').filter(|word| word.value.abs() >= ANGLE_MAX_DEG) {
            let message = format!("{word}: passes feed in at less than {ANGLE_MAX_DEG} degrees");
            faults.push(Fault::word(&rules::BAD_VALUE, word, message));
            return None;
        }
        if end[Axis::Z] == start[Axis::Z] {
            let word = block.word(b'Z')?;
            let message = "the thread would have no length: Z is where it ends";
            faults.push(Fault::word(&rules::BAD_VALUE, word, message));
            return None;
        }
        let value = |letter| block.word(letter).map(|word| word.value);
        // Under G7 what lies along X is given as diameters.
        let across = self.mm_per_unit * if self.diameters { 0.5 } else { 1.0 };
        let count = |letter, greatest, faults: &mut Vec<Fault>| match block.word(letter) {
            Some(word) => whole(word, greatest, faults),
            None => Some(0),
        };
        let spring_passes = count(b'H', 10_000, faults)?;
        let ends = count(b'L', 3, faults)?;
        let along = if end[Axis::Z] > start[Axis::Z] { -1.0 } else { 1.0 };
        let taper_mm = (value(b'E').unwrap_or(0.0) * self.mm_per_unit).max(0.0);
        let has_taper = taper_mm > 0.0;
        Some(Thread {
            start,
            end,
            pitch_mm: value(b'P')? * self.mm_per_unit,
            peak_mm: value(b'I')?.abs() * across,
            height_mm: value(b'K')? * across,
            first_mm: value(b'J')? * across,
            degression: value(b'R').unwrap_or(1.0).max(1.0),
            slope: libm::tan(value(b'Q').unwrap_or(0.0).to_radians()) * along,
            spring_passes,
            taper_mm: taper_mm * along,
            tapers: [has_taper && ends & 1 != 0, has_taper && ends & 2 != 0],
            outwards: if value(b'I')? > 0.0 { 1.0 } else { -1.0 },
        })
    }
}

/// Cuts the passes of a thread.
struct Cutting<'c, 'e, 'o> {
    executor: &'c mut Executor<'e>,
    block: &'c Block,
    out: &'c mut Output<'o>,
    rpm: f64,
}

impl Cutting<'_, '_, '_> {
    fn rapid(&mut self, to: &Point) {
        let to = self.executor.place(to);
        self.executor.go(self.block, &to, MoveKind::Rapid, Some(Corner::Exact), self.out);
    }

    fn cut(&mut self, to: &Point, pitch_mm: f64) {
        let to = self.executor.place(to);
        self.executor.go_synced(self.block, &to, pitch_mm * self.rpm, self.out);
    }

    /// One pass, so deep below the thread's peak; each begins and ends away from the work.
    fn pass(&mut self, thread: &Thread, depth_mm: f64) {
        let at = |across_mm: f64, z_mm: f64| {
            let mut point = thread.start;
            point[Axis::X] += thread.outwards * across_mm;
            point[Axis::Z] = z_mm;
            point
        };
        let in_mm = thread.peak_mm + depth_mm;
        // Passes before the last stay so much clear of where the cycle starts.
        let clear_mm = depth_mm - thread.height_mm;
        let back_mm = in_mm - thread.height_mm;
        let shift_mm = depth_mm * thread.slope;
        let begin_mm = thread.start[Axis::Z] - shift_mm;
        let end_mm = thread.end[Axis::Z] + thread.height_mm * thread.slope - shift_mm;
        let taper_pitch_mm = thread.pitch_mm
            * if thread.taper_mm == 0.0 {
                1.0
            } else {
                libm::hypot(thread.taper_mm, thread.height_mm) / thread.taper_mm.abs()
            };
        self.rapid(&at(clear_mm, begin_mm));
        if thread.tapers[0] {
            self.cut(&at(back_mm, begin_mm), taper_pitch_mm);
            self.cut(&at(in_mm, begin_mm - thread.taper_mm), taper_pitch_mm);
        } else {
            self.rapid(&at(in_mm, begin_mm));
        }
        if thread.tapers[1] {
            self.cut(&at(in_mm, end_mm + thread.taper_mm), thread.pitch_mm);
            self.cut(&at(back_mm, end_mm), taper_pitch_mm);
        } else {
            self.cut(&at(in_mm, end_mm), thread.pitch_mm);
        }
        self.rapid(&at(clear_mm, end_mm));
    }
}
