//! One block, whatever stands on it: expressions get their values, parameters are set, messages are
//! said, and what is left goes to the executor.

use crate::base::{Axis, AxisSet, CallSite, Event, EventKind, Machine};
use crate::gcode::codes::{Stock, Turn, nearest};
use crate::gcode::{Assignment, Block, Fault, Formula, Message, MessageKind, Word, rules, short};

use super::Options;
use super::check::Said;
use super::duration::{is_quick, too_slow};
use super::execute::{Executor, MotionMode, Output, is_error};
use super::feed::Turning;
use super::findings::{Findings, Kept, Place};
use super::flow::Flow;
use super::motion::Motion;
use super::parameters::{
    NoValue, Parameters, Reason, SYSTEM_FIRST, Set, Target, Value, is_empty, is_macro_call, plain,
};
use super::plunge::{Plunges, is_cut};
use super::pulses::{PulseRates, is_in_reach};
use super::system::read_only;
use super::travel::Travel;
use super::turning::Contour;
use super::words::{subprogram_flow, whole};

/// Greatest magnitude of a word, as of a number that is written.
const WORD_MAX: f64 = 1e9;

/// What executes blocks, and what it has found and said so far.
#[derive(Debug)]
pub(super) struct Engine<'a> {
    pub executor: Executor<'a>,
    pub parameters: Parameters,
    pub findings: Findings,
    /// Travel, where the run is a check.
    pub travel: Option<Travel>,
    /// Rapids into the work, where the run is a check.
    pub plunges: Plunges,
    /// Feeds beyond the interpolator's, where the run is a check.
    rates: PulseRates,
    /// What the program says, where the run is a check.
    pub said: Vec<Said>,
    /// The contour that is being read.
    pub contour: Option<Contour>,
    /// The line of a move that waits for the next one.
    corner: Option<Kept>,
    /// Blocks executed.
    pub blocks: u64,
    /// What is wrong with the line at hand.
    pub faults: Vec<Fault>,
    /// The block at hand with the values of its expressions.
    computed: Option<Box<Block>>,
    left_out: Vec<u16>,
    block_delete_said: bool,
    /// Whether #3006 has asked for a stop.
    stops: bool,
}

impl<'a> Engine<'a> {
    pub fn new(machine: &'a Machine, options: &Options, max: usize) -> Engine<'a> {
        Engine {
            executor: Executor::new(machine, options),
            parameters: Parameters::new(options.dialect),
            findings: Findings::new(max),
            travel: None,
            plunges: Plunges::default(),
            rates: PulseRates::default(),
            said: Vec::new(),
            contour: None,
            corner: None,
            blocks: 0,
            faults: Vec::new(),
            computed: None,
            left_out: Vec::new(),
            block_delete_said: false,
            stops: false,
        }
    }

    /// Warns, once, of a line that block delete would leave out.
    #[inline]
    pub fn judge_delete(&mut self, block: &Block) {
        if block.delete {
            self.tell_delete(block);
        }
    }

    #[cold]
    fn tell_delete(&mut self, block: &Block) {
        if !self.block_delete_said && !block.is_empty() {
            self.block_delete_said = true;
            let message = "this line is executed, and so is every other that begins with /";
            let fault = Fault::new(&rules::BLOCK_DELETE, 0, 1, message);
            self.faults.push(fault.help("--block-delete skips these lines"));
        }
    }

    /// Executes a block; what is wrong with it is left in `faults`.
    #[inline]
    pub fn execute(&mut self, block: &Block, place: &Place<'_>, motions: &mut Vec<Motion>) -> Flow {
        self.blocks += 1;
        self.executor.line = place.line;
        if self.contour.is_some() {
            return self.record(block, place);
        }
        if !block.is_plain() || is_macro_call(block) {
            return self.compute(block, place, motions);
        }
        self.run(block, place, motions)
    }

    /// Runs the words of a block.
    #[inline]
    fn run(&mut self, block: &Block, place: &Place<'_>, motions: &mut Vec<Motion>) -> Flow {
        let first = motions.len();
        let mut out = output(place, motions, &mut self.faults);
        if let Some(named) = self.executor.run_plain_move(block, &mut out) {
            self.judge_plain_move(&motions[first..], named, block, place);
            return Flow::Next;
        }
        let flow = self.executor.run(block, &mut out);
        self.judge(&motions[first..], block, place);
        self.keep_corner(place);
        flow
    }

    #[inline(never)]
    fn compute(&mut self, block: &Block, place: &Place<'_>, motions: &mut Vec<Motion>) -> Flow {
        if block.words().is_empty() && block.messages().is_empty() && block.call.is_none() {
            // It sets parameters, and most often that is all.
            let alarm = self.set(block, place);
            self.stop(motions);
            return match self.faults.as_slice() {
                _ if alarm => Flow::Alarm,
                [] => Flow::Next,
                _ => self.run(&Block::default(), place, motions),
            };
        }
        let mut computed = self.computed.take().unwrap_or_default();
        computed.copy_words(block);
        self.give_values(block, &mut computed);
        let alarm = self.set(block, place);
        self.stop(motions);
        for message in block.messages() {
            self.say(*message, place);
        }
        let flow = if alarm {
            Flow::Alarm
        } else if is_macro_call(&computed) {
            macro_call(&computed, &mut self.faults)
        } else if !computed.words().is_empty() || computed.call.is_some() || !self.faults.is_empty()
        {
            self.run(&computed, place, motions)
        } else {
            Flow::Next
        };
        self.computed = Some(computed);
        flow
    }

    /// Keeps the line of a move that waits for the next one, and reports what is wrong with the
    /// corner between them there.
    #[inline]
    fn keep_corner(&mut self, place: &Place<'_>) {
        if self.corner.is_some() || self.executor.held_move.is_some() {
            self.report_corner();
            let is_new = self.executor.corner_line() == Some(place.line);
            if self.executor.held_move.is_none() {
                self.corner = None;
            } else if is_new {
                self.corner = Some(Kept::of(*place));
            }
        }
    }

    fn report_corner(&mut self) {
        if let Some(kept) = &self.corner {
            self.findings.take_once(&mut self.executor.corner_faults, kept.place());
        }
        self.faults.append(&mut self.executor.corner_faults);
    }

    /// Reports a corner that nothing follows.
    pub fn end_corner(&mut self) {
        self.executor.end_corner();
        self.report_corner();
        self.corner = None;
    }

    /// Restores the modes that M73 has saved, where a call has ended; told at the line it ended on,
    /// of a file if not the program's own.
    pub fn restore_after_call(
        &mut self,
        calls: &[CallSite],
        file: Option<&str>,
        motions: &mut Vec<Motion>,
    ) {
        if self.executor.to_restore.is_none() {
            return;
        }
        let (line, first) = (self.executor.line, motions.len());
        let place = &Place { line, text: b"", calls, file };
        let mut out = output(place, motions, &mut self.faults);
        self.executor.restore_after_call(&mut out);
        self.judge(&motions[first..], &Block::default(), place);
        self.report(place, true);
    }

    /// Takes a block for a piece of the contour that is being read.
    fn record(&mut self, block: &Block, place: &Place<'_>) -> Flow {
        let mut words = Block::default();
        words.copy_words(block);
        self.give_values(block, &mut words);
        let alarm = self.set(block, place);
        for message in block.messages() {
            self.say(*message, place);
        }
        if alarm {
            return Flow::Alarm;
        }
        if words.words().iter().any(|word| word.letter == b'M' && word.value == 99.0) {
            return Flow::Return(None);
        }
        if let Some(contour) = &mut self.contour {
            contour.add(&words, &mut self.faults);
            contour.is_faulty |= self.faults.iter().any(is_error);
            self.executor.follow_contour(contour.at());
        }
        Flow::Next
    }

    /// Runs a lathe cycle along a contour.
    pub fn turn(
        &mut self,
        turn: Turn,
        block: &Block,
        contour: &Contour,
        place: &Place<'_>,
        motions: &mut Vec<Motion>,
    ) {
        let first = motions.len();
        self.executor.motion_first = first;
        let mut out = output(place, motions, &mut self.faults);
        self.executor.turn(turn, block, contour, &mut out);
        self.executor.compensate(block, &mut out);
        self.judge(&motions[first..], block, place);
    }

    /// Runs a cycle of a FANUC-style lathe along a contour.
    pub fn cut_stock(
        &mut self,
        stock: Stock,
        block: &Block,
        contour: &Contour,
        place: &Place<'_>,
        motions: &mut Vec<Motion>,
    ) {
        let first = motions.len();
        let mut out = output(place, motions, &mut self.faults);
        self.executor.cut_stock(stock, block, contour, &mut out);
        self.judge(&motions[first..], block, place);
    }

    /// Gives out what the executor holds until it knows what follows.
    pub fn finish(&mut self, place: &Place<'_>, motions: &mut Vec<Motion>) {
        self.end_corner();
        let (block, first) = (Block::default(), motions.len());
        let mut out = output(place, motions, &mut self.faults);
        self.executor.finish(&block, &mut out);
        self.judge(&motions[first..], &block, place);
    }

    /// The words of the block executed last, where it was one with expressions or a macro call.
    pub fn computed(&self) -> Option<&Block> {
        self.computed.as_deref()
    }

    /// Gives words the values of their expressions; those that have none are left out.
    #[inline]
    fn give_values(&mut self, block: &Block, computed: &mut Block) {
        self.left_out.clear();
        for (place, formula) in block.values() {
            let Some(word) = block.words().get(usize::from(*place)) else { continue };
            match self.parameters.value(block.code(*formula), &self.executor) {
                Ok(value) if value.abs() <= WORD_MAX => {
                    let is_code = matches!(word.letter, b'G' | b'M');
                    computed.give_value(*place, if is_code { nearest(value) } else { value });
                }
                Ok(value) if is_empty(value) => self.left_out.push(*place),
                other => self.refuse_value(other, word, *place, computed),
            }
        }
        if !self.left_out.is_empty() {
            computed.leave_out(&self.left_out);
        }
    }

    /// Gives a word a value that is no ordinary number, or leaves it out.
    #[cold]
    fn refuse_value(&mut self, value: Value, word: &Word, place: u16, computed: &mut Block) {
        match value.map(plain) {
            Ok(value) if value.abs() > WORD_MAX => {
                let message = format!("{} is beyond {WORD_MAX}", short(value));
                self.faults.push(Fault::word(&rules::BAD_NUMBER, word, message));
                self.left_out.push(place);
            }
            Ok(value) => computed.give_value(place, value),
            Err(error) => {
                self.faults.push(fault(*error, word.start, word.end));
                self.left_out.push(place);
                // That a feed is missing then need not be said.
                self.executor.feed_missed |= word.letter == b'F';
            }
        }
    }

    /// Sets parameters: all right sides first. Tells whether that raises an alarm.
    #[inline]
    pub fn set(&mut self, block: &Block, place: &Place<'_>) -> bool {
        match block.assignments() {
            [] => false,
            [assignment] => match self.assigned(block, assignment) {
                Some((target, value)) => self.assign(target, value, assignment, place),
                None => false,
            },
            several => self.set_several(several, block, place),
        }
    }

    #[inline(never)]
    fn set_several(&mut self, several: &[Assignment], block: &Block, place: &Place<'_>) -> bool {
        let found = several.iter().map(|assignment| self.assigned(block, assignment));
        let found: Vec<_> = found.collect();
        let mut alarm = false;
        for (found, assignment) in found.iter().zip(several) {
            if let Some((target, value)) = found {
                alarm |= self.assign(*target, *value, assignment, place);
            }
        }
        alarm
    }

    /// What an assignment sets, and to which value.
    #[inline]
    fn assigned<'b>(
        &mut self,
        block: &Block,
        assignment: &'b Assignment,
    ) -> Option<(Target<'b>, f64)> {
        let (start, end) = (assignment.start, assignment.end);
        let number = block.code(assignment.number);
        let target = self.parameters.target(&assignment.target, number, &self.executor);
        let value = self.parameters.value(block.code(assignment.value), &self.executor);
        // What has no value is set all the same: one fault shall not make others.
        let value = value.unwrap_or_else(|error| {
            self.faults.push(fault(*error, start, end));
            0.0
        });
        let tell = |error: NoValue| self.faults.push(fault(*error, start, end));
        Some((target.map_err(tell).ok()?, value))
    }

    /// Sets what has been found; tells whether that raises an alarm.
    #[inline]
    fn assign(
        &mut self,
        target: Target<'_>,
        value: f64,
        assignment: &Assignment,
        place: &Place<'_>,
    ) -> bool {
        match self.set_one(target, value) {
            Ok(Set::Done) => false,
            other => self.tell_set(other, assignment, place),
        }
    }

    /// Does what setting a parameter asks for beside; tells whether that is an alarm.
    #[cold]
    fn tell_set(
        &mut self,
        result: Result<Set, NoValue>,
        assignment: &Assignment,
        place: &Place<'_>,
    ) -> bool {
        let (start, end) = (assignment.start, assignment.end);
        match result {
            Ok(Set::Done) => {}
            Ok(Set::Stop) => {
                self.stops = true;
                self.tell(MessageKind::Message, comment(place.text), place);
            }
            Ok(Set::Alarm(number)) => {
                let text = comment(place.text);
                let colon = if text.is_empty() { "" } else { ": " };
                let message =
                    format!("the program raises alarm {}{colon}{text}", short(plain(number)));
                self.faults.push(Fault::new(&rules::ALARM, start, end, message));
                return true;
            }
            Err(error) => self.faults.push(fault(*error, start, end)),
        }
        false
    }

    /// Stops until the operator goes on, where #3006 has asked for it.
    pub fn stop(&mut self, motions: &mut Vec<Motion>) {
        if std::mem::take(&mut self.stops) {
            let kind = EventKind::M { code: 0, spindle_rpm: None, tool: None };
            motions.push(Motion::Event(Event { line: self.executor.line, kind }));
        }
    }

    /// Sets a parameter of the control or of the program.
    #[inline]
    fn set_one(&mut self, target: Target<'_>, value: f64) -> Result<Set, NoValue> {
        let own = match target {
            Target::Number(number) if number < SYSTEM_FIRST => None,
            Target::Number(number) => self.executor.set_parameter(number, plain(value)),
            Target::Name(name) => self.parameters.is_own(name, &self.executor).then(|| {
                let message = format!("#<{name}> is the control's own: it can only be read");
                read_only(message, "give yours another name")
            }),
        };
        match own {
            Some(result) => result.map(|()| Set::Done),
            None => self.parameters.set(target, value),
        }
    }

    /// The value of an expression of a statement, or what is wrong with it.
    pub fn number(&mut self, block: &Block, formula: Formula) -> Option<f64> {
        match self.parameters.number(block.code(formula), &self.executor) {
            Ok(value) => Some(value),
            Err(error) => {
                let (start, end) = block.extent();
                self.faults.push(fault(*error, start, end));
                None
            }
        }
    }

    /// The number of a subprogram that a value stands for, or what is wrong with it.
    pub fn label_number(&mut self, value: f64, block: &Block) -> Option<u32> {
        let (start, end) = block.extent();
        whole(&Word { letter: b'O', value, start, end }, 999_999_999, &mut self.faults)
    }

    /// The values of arguments.
    pub fn arguments(&mut self, block: &Block, formulas: &[Formula]) -> Vec<(u32, f64)> {
        let mut arguments = Vec::with_capacity(formulas.len());
        for (number, formula) in (1..).zip(formulas) {
            arguments.push((number, self.number(block, *formula).unwrap_or_default()));
        }
        arguments
    }

    /// Says what a comment says to the operator.
    pub fn say(&mut self, message: Message, place: &Place<'_>) {
        let is_shown = message.kind != MessageKind::Debug || self.parameters.shows_debug();
        if self.travel.is_none() || !is_shown {
            return;
        }
        let bytes = place.text.get(message.start as usize..message.end as usize);
        let text = String::from_utf8_lossy(bytes.unwrap_or_default());
        let text = match message.kind {
            MessageKind::Message => text.trim().to_owned(),
            MessageKind::Debug | MessageKind::Print => {
                self.parameters.filled_in(text.trim(), &self.executor)
            }
        };
        self.tell(message.kind, text, place);
    }

    fn tell(&mut self, kind: MessageKind, text: String, place: &Place<'_>) {
        if self.travel.is_none() {
            return;
        }
        self.findings.messages += 1;
        if self.said.len() < self.findings.max() {
            let file = place.file.map(str::to_owned);
            self.said.push(Said { line: place.line, file, kind, text });
        }
    }

    /// Holds what a block has made against the machine's travel and a day's time, while the
    /// program is checked.
    fn judge(&mut self, motions: &[Motion], block: &Block, place: &Place<'_>) {
        let Some(travel) = &mut self.travel else { return };
        if motions.is_empty() {
            return;
        }
        let executor = &self.executor;
        let open = executor.open_axes();
        let is_machine = executor.names_machine_positions();
        self.plunges.spindle(executor.turning != Turning::Stopped);
        let judges_rapids = executor.motion == MotionMode::Rapid && !is_machine && open.is_empty();
        for motion in motions {
            if let Motion::Move(step) = motion {
                if is_cut(step) {
                    self.plunges.cut(step);
                } else if judges_rapids && step.to[Axis::Z] != step.from[Axis::Z] {
                    let ends_mm =
                        [&step.from, &step.to].map(|point| executor.frames.program(point));
                    self.plunges.rapid(step, ends_mm, block, *place);
                }
                travel.named_in(step, is_machine, executor.absolute);
                travel.add(step, block, place, open);
                if open.is_empty() {
                    self.faults.extend(too_slow(step, block));
                    self.faults.extend(self.rates.judge(step, block, executor.machine));
                }
            }
        }
    }

    /// The same for a plain move, of which most is known: see [`Executor::run_plain_move`].
    #[inline]
    fn judge_plain_move(
        &mut self,
        motions: &[Motion],
        named: AxisSet,
        block: &Block,
        place: &Place<'_>,
    ) {
        let Some(travel) = &mut self.travel else { return };
        let [Motion::Move(step)] = motions else { return };
        // A block with a fault may have led elsewhere without a move.
        let is_all = self.findings.errors == 0 && is_cut(step) && is_quick(step);
        if is_all
            && is_in_reach(step, self.executor.machine)
            && travel.add_along(named, step, block, place)
        {
            self.plunges.spindle(self.executor.turning != Turning::Stopped);
            self.plunges.cut(step);
        } else {
            self.judge(motions, block, place);
        }
    }

    /// Reports what is wrong with the line at hand; `once`: it may be run again.
    pub fn report(&mut self, place: &Place<'_>, once: bool) {
        if self.faults.is_empty() {
            return;
        }
        if once {
            self.findings.take_once(&mut self.faults, *place);
        } else {
            self.findings.take(&mut self.faults, *place);
        }
    }
}

fn output<'o>(
    place: &Place<'o>,
    motions: &'o mut Vec<Motion>,
    faults: &'o mut Vec<Fault>,
) -> Output<'o> {
    Output { line: place.line, text: place.text, motions, faults }
}

/// What a block with G65 or G66 asks for.
fn macro_call(block: &Block, faults: &mut Vec<Fault>) -> Flow {
    let is_modal = block.words().iter().any(|word| word.letter == b'G' && word.value == 66.0);
    let is_other = |word: &&Word| match word.letter {
        b'G' => word.value != if is_modal { 66.0 } else { 65.0 },
        b'O' => true,
        _ => false,
    };
    if let Some(word) = block.words().iter().find(is_other) {
        let message = format!("{word} stands beside a macro call");
        let fault = Fault::word(&rules::CALL_ALONE, word, message);
        faults.push(fault.help("put it into a block of its own"));
        return Flow::Next;
    }
    match subprogram_flow(block, faults) {
        Flow::Call { number, repeats } if is_modal => Flow::ModalMacroBegin { number, repeats },
        Flow::Call { number, repeats } => Flow::MacroCall { number, repeats },
        flow => flow,
    }
}

fn fault(reason: Reason, start: u32, end: u32) -> Fault {
    let Reason { rule, message, help } = reason;
    let fault = Fault::new(rule, start, end, message);
    match help {
        Some(help) => fault.help(help),
        None => fault,
    }
}

/// The comment on a line.
fn comment(line: &[u8]) -> String {
    let text = String::from_utf8_lossy(line);
    let inside = text.split_once('(').and_then(|(_, rest)| rest.split_once(')'));
    inside.map_or(String::new(), |(comment, _)| comment.trim().to_owned())
}
