//! G76 of FANUC-style lathes: all passes of a thread, from the words of two blocks or of one.
//!
//! The first of two blocks says how threads are cut, and holds for all that follow; words that it
//! lacks stay what they were. The second cuts one. A block with K and D is both: K is the height of
//! the thread, D the first depth, I the taper, A the angle. Each pass takes the same area. Threads end
//! square unless a pull-out is told.

use crate::base::{Axis, Point};
use crate::gcode::codes::AXIS_LETTERS;
use crate::gcode::{Block, Fault, Word, letter_bit, rules};

use crate::interp::cycles::PASSES_MAX;
use crate::interp::execute::{Executor, Output};
use crate::interp::motion::MoveKind;
use crate::interp::words::{has_point, whole};

/// What first blocks of G76 say.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::interp) struct ThreadWords {
    form: Option<Form>,
    least_mm: f64,
    finish_mm: f64,
}

/// The six digits of P.
#[derive(Clone, Copy, Debug, Default)]
struct Form {
    finish_passes: u32,
    /// In tenths of the lead.
    pull_out: u32,
    angle_deg: f64,
}

/// A thread to be cut.
struct Thread {
    start: Point,
    end: Point,
    height: (Word, f64),
    first: (Word, f64),
    taper_mm: f64,
    form: Form,
    least_mm: f64,
    finish_mm: f64,
    /// How long before its end it leaves the work at 45 degrees.
    out_mm: f64,
}

impl Executor<'_> {
    /// A length of P, Q or D of a lathe cycle: one that is written without a point is in thousandths of
    /// a mm (ten-thousandths of an inch), as controls count it.
    pub(super) fn small_length_mm(&self, word: &Word, text: &[u8]) -> f64 {
        let unit =
            match (has_point(word, text) || word.value.fract() != 0.0, self.mm_per_unit == 1.0) {
                (true, _) => 1.0,
                (false, true) => 1e-3,
                (false, false) => 1e-4,
            };
        word.value * unit * self.mm_per_unit
    }

    /// G76
    pub(super) fn thread_lathe(&mut self, block: &Block, out: &mut Output<'_>) {
        let is_one_block = block.has(b'K') || block.has(b'D');
        if block.letters() & AXIS_LETTERS & !letter_bit(b'A') == 0 {
            return self.take_thread_words(block, out);
        }
        let faults_before = out.faults.len();
        let thread = if is_one_block {
            self.thread_of_one_block(block, out)
        } else {
            self.thread_of_two_blocks(block, out)
        };
        let Some(thread) = thread else { return };
        self.check_thread(&thread, block, out.faults);
        let begin = thread.begin();
        let machine = [self.frames.machine(&begin), self.frames.machine(&thread.end)];
        let pitch = self.pitch_by_lead("G76", block, &machine[0], &machine[1], out.faults);
        let rpm = self.sync_rpm("G76", block, out.faults);
        if out.faults.len() > faults_before {
            return;
        }
        let (Some(pitch_mm), Some(rpm)) = (pitch, rpm) else { return };
        let depths = thread.depths();
        if depths.len() as f64 > PASSES_MAX {
            let first = &thread.first.0;
            let letter = char::from(first.letter);
            let message = format!("more than {PASSES_MAX} passes: is {letter} the first depth?");
            out.faults.push(Fault::word(&rules::BAD_VALUE, first, message));
            return;
        }
        for depth_mm in depths {
            self.thread_pass(&thread, depth_mm, pitch_mm * rpm, block, out);
        }
        self.go_lathe(block, &thread.start, MoveKind::Rapid, out);
    }

    /// One pass, so deep, from the start of the cycle on.
    fn thread_pass(
        &mut self,
        thread: &Thread,
        depth_mm: f64,
        feed_mm_min: f64,
        block: &Block,
        out: &mut Output<'_>,
    ) {
        let Thread { start, end, height, out_mm, form, .. } = *thread;
        let inwards = (end[Axis::X] - start[Axis::X]).signum();
        let along = (end[Axis::Z] - start[Axis::Z]).signum();
        let above_mm = inwards * (height.1 - depth_mm);
        let mut at = start;
        at[Axis::Z] += along * depth_mm * libm::tan((form.angle_deg / 2.0).to_radians());
        self.go_lathe(block, &at, MoveKind::Rapid, out);
        at[Axis::X] = thread.begin()[Axis::X] - above_mm;
        self.go_lathe(block, &at, MoveKind::Rapid, out);
        let mut root = end;
        root[Axis::X] -= above_mm;
        // It ends where the cycle has begun at the latest: beyond is the other side of a bore.
        let out_mm = out_mm.min((start[Axis::X] - root[Axis::X]).abs());
        let mut to = root;
        to[Axis::Z] -= along * thread.out_mm;
        let placed = self.place(&to);
        self.go_synced(block, &placed, feed_mm_min, out);
        if out_mm > 0.0 {
            root[Axis::X] -= inwards * out_mm;
            root[Axis::Z] -= along * (thread.out_mm - out_mm);
            let placed = self.place(&root);
            self.go_synced(block, &placed, feed_mm_min * std::f64::consts::SQRT_2, out);
        }
        root[Axis::X] = start[Axis::X];
        self.go_lathe(block, &root, MoveKind::Rapid, out);
    }

    /// The first of two blocks.
    fn take_thread_words(&mut self, block: &Block, out: &mut Output<'_>) {
        if let Some(word) = block.first_of(!(crate::gcode::codes::FREE_LETTERS | PQR)) {
            let message = format!("{word} stands in a G76 without X and Z");
            out.faults.push(Fault::word(&rules::UNUSED_WORD, word, message));
        }
        let form = block.word(b'P').and_then(|word| whole(word, 999_999, out.faults));
        let form = form.map(|digits| Form {
            finish_passes: digits / 10_000,
            pull_out: digits / 100 % 100,
            angle_deg: f64::from(digits % 100),
        });
        let least_mm = block.word(b'Q').map(|word| self.small_length_mm(word, out.text));
        let finish_mm = block.word(b'R').map(|word| self.small_length_mm(word, out.text).abs());
        let words = &mut self.lathe.thread;
        words.form = form.or(words.form);
        words.least_mm = least_mm.unwrap_or(words.least_mm);
        words.finish_mm = finish_mm.unwrap_or(words.finish_mm);
    }

    /// The second of two blocks.
    fn thread_of_two_blocks(&mut self, block: &Block, out: &mut Output<'_>) -> Option<Thread> {
        let [Some(height), Some(first)] = [b'P', b'Q'].map(|letter| block.word(letter)) else {
            let message = "G76 has no P, the thread's height, or no Q, the first depth";
            out.faults.push(Fault::block(&rules::MISSING_WORD, block, message));
            return None;
        };
        let words = self.lathe.thread;
        let Some(form) = words.form else {
            let message = "no G76 before says how threads are cut";
            let fault = Fault::block(&rules::MISSING_WORD, block, message);
            out.faults.push(fault.help(
                "write a block before, as G76 P010060 Q50 R0.05: P is the finishing passes, the \
                 pull-out in tenths of the lead and the angle, of two digits each",
            ));
            return None;
        };
        let [height, first] =
            [height, first].map(|word| (*word, self.small_length_mm(word, out.text)));
        let taper = block.word(b'R').copied();
        self.thread_between(block, [height, first], taper, (form, words), out)
    }

    /// A block with all that it needs.
    fn thread_of_one_block(&mut self, block: &Block, out: &mut Output<'_>) -> Option<Thread> {
        let [Some(height), Some(first)] = [b'K', b'D'].map(|letter| block.word(letter)) else {
            let message = "G76 has no K, the thread's height, or no D, the first depth";
            out.faults.push(Fault::block(&rules::MISSING_WORD, block, message));
            return None;
        };
        if let Some(word) = block.first_of(letter_bit(b'Q') | letter_bit(b'R')) {
            let message = format!("{word} is of the G76 of two blocks, K and D of that of one");
            out.faults.push(Fault::word(&rules::UNUSED_WORD, word, message));
        }
        if let Some(word) = block.word(b'P').filter(|word| word.value != 1.0) {
            let message =
                format!("{word}: the only way of cutting is P1, of equal areas on one side");
            let fault = Fault::word(&rules::UNSUPPORTED_WORD, word, message);
            out.faults.push(fault.help("leave it out, or write P1"));
        }
        let angle_deg = block.word(b'A').map_or(0.0, |word| word.value);
        if let Some(word) = block.word(b'A').filter(|word| !(0.0..=120.0).contains(&word.value)) {
            let message = format!("{word}: the angle of a thread is from 0 to 120 degrees");
            out.faults.push(Fault::word(&rules::BAD_VALUE, word, message));
        }
        let height = (*height, height.value * self.mm_per_unit);
        let first = (*first, self.small_length_mm(first, out.text));
        let form = Form { angle_deg, ..Form::default() };
        let mut words = Block::default();
        words.copy_words(block);
        words.replace(letter_bit(b'A'), []);
        let taper = block.word(b'I').copied();
        self.thread_between(&words, [height, first], taper, (form, ThreadWords::default()), out)
    }

    /// A thread from where the machine stands to where a block leads.
    fn thread_between(
        &mut self,
        block: &Block,
        [height, first]: [(Word, f64); 2],
        taper: Option<Word>,
        (form, words): (Form, ThreadWords),
        out: &mut Output<'_>,
    ) -> Option<Thread> {
        let start = self.frames.program(&self.position_mm);
        let end = self.program_target(block, out.faults);
        if end[Axis::Z] == start[Axis::Z] {
            let message = "this thread has no length along Z";
            let fault = Fault::block(&rules::MISSING_WORD, block, message);
            out.faults.push(fault.help("write Z or W, where it ends"));
            return None;
        }
        let taper_mm = taper.map_or(0.0, |word| word.value * self.mm_per_unit);
        let out_mm = f64::from(form.pull_out) / 10.0 * self.feed.map_or(0.0, |feed| feed.mm);
        let ThreadWords { least_mm, finish_mm, .. } = words;
        Some(Thread { start, end, height, first, taper_mm, form, least_mm, finish_mm, out_mm })
    }

    /// Holds the depths of a thread and its pull-out against its height and its length.
    fn check_thread(&self, thread: &Thread, block: &Block, faults: &mut Vec<Fault>) {
        let Thread { height, first, finish_mm, out_mm, .. } = thread;
        for (word, _) in [height, first].into_iter().filter(|(_, depth_mm)| *depth_mm <= 0.0) {
            let letters = [height.0.letter, first.0.letter].map(char::from);
            let message = format!("{word}: in G76 {} and {} are above 0", letters[0], letters[1]);
            faults.push(Fault::word(&rules::BAD_VALUE, word, message));
        }
        let (word, height_mm) = height;
        if *height_mm > 0.0 && finish_mm >= height_mm {
            let message = format!(
                "the finishing cut, R{finish_mm:.4} mm of the first block, is not less than the \
                 height, {height_mm:.4} mm: the first pass would be as deep as the thread"
            );
            faults.push(Fault::word(&rules::BAD_VALUE, word, message));
        }
        let length_mm = (thread.end[Axis::Z] - thread.start[Axis::Z]).abs();
        if *out_mm >= length_mm {
            let message = format!(
                "the pull-out, {out_mm:.4} mm, is not shorter than the thread, {length_mm:.4} mm",
            );
            let fault = Fault::block(&rules::BAD_VALUE, block, message);
            faults.push(fault.help(
                "it is the middle two digits of P in the first block, in tenths of the lead",
            ));
        }
    }
}

const PQR: u32 = letter_bit(b'P') | letter_bit(b'Q') | letter_bit(b'R');

impl Thread {
    /// At the root of the thread, above where it begins.
    fn begin(&self) -> Point {
        let mut begin = self.start;
        begin[Axis::X] = self.end[Axis::X] + self.taper_mm;
        begin
    }

    /// Depths of the passes: each takes the same area, none less than the least, and what is left
    /// for finishing comes last.
    fn depths(&self) -> Vec<f64> {
        let height_mm = self.height.1;
        let rough_mm = height_mm - self.finish_mm;
        let (mut depths, mut depth_mm) = (Vec::new(), 0.0_f64);
        for pass in 1..=PASSES_MAX as u32 + 1 {
            if depth_mm >= rough_mm {
                break;
            }
            let next_mm = self.first.1 * f64::from(pass).sqrt();
            depth_mm = next_mm.max(depth_mm + self.least_mm).min(rough_mm);
            depths.push(depth_mm);
        }
        let passes = self.form.finish_passes;
        let again = if self.finish_mm > 0.0 { passes.max(1) } else { passes };
        depths.extend((0..again).map(|_| height_mm));
        depths
    }
}
