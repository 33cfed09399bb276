//! The codes that place frames: G10, G52, G92, G43, G51, G68; and G28 and G30, which go to where the
//! machine has its references. Work coordinate systems are in [`super::systems`].

use crate::base::{Axis, AxisMap, Point};
use crate::gcode::codes::{AXIS_LETTERS, Code, Length, Op};
use crate::gcode::{Block, Fault, Word, letter_bit, letter_set, rules};

use super::Dialect;
use super::execute::{Asked, Executor, Output};
use super::frames::{Rotation, Scaling};
use super::modes::LengthMode;
use super::motion::MoveKind;
use super::tools::Measure;
use super::words::{has_point, whole};

/// The system of G10 L11, counted from 0: G59.3.
const FIXTURE: usize = 8;

impl Executor<'_> {
    /// The axis words of a block in mm and degrees; reports that there is none.
    fn axis_values(
        &mut self,
        name: &str,
        block: &Block,
        faults: &mut Vec<Fault>,
    ) -> Vec<(Axis, f64)> {
        let values = self.axis_values_of(block, faults);
        if block.letters() & AXIS_LETTERS == 0 {
            let message = format!("{name} names no axis");
            faults.push(Fault::block(&rules::MISSING_WORD, block, message));
        }
        values
    }

    /// Whether offsets mean something by themselves; reports where they do not.
    pub(super) fn is_untransformed(
        &self,
        name: &str,
        block: &Block,
        faults: &mut Vec<Fault>,
    ) -> bool {
        let by = if self.polar {
            "polar coordinates (G16) are"
        } else if self.frames.scaling().is_some() {
            "scaling (G51) is"
        } else if self.frames.rotation().is_some() {
            "a rotation (G68) is"
        } else if self.frames.is_mirrored() {
            "a mirror image (G51.1) is"
        } else {
            return true;
        };
        let message = format!("{name} stands where {by} in force");
        let fault = Fault::block(&rules::TRANSFORMED, block, message);
        faults.push(fault.help("end it before, by G15, G50, G69 or G50.1"));
        false
    }

    /// G92
    pub(super) fn set_position(&mut self, block: &Block, faults: &mut Vec<Fault>) {
        if !self.is_untransformed("G92", block, faults) {
            return;
        }
        let at = self.frames.unshifted(self.frames.active(), &self.position_mm);
        for (axis, value) in self.axis_values("G92", block, faults) {
            self.frames.set_shift(axis, at[axis] - value);
        }
    }

    /// G52, which shares its offset with G92.
    pub(super) fn set_local_offset(&mut self, block: &Block, faults: &mut Vec<Fault>) {
        if !self.is_untransformed("G52", block, faults) {
            return;
        }
        for (axis, value) in self.axis_values("G52", block, faults) {
            self.frames.set_shift(axis, value);
        }
    }

    /// G10
    pub(super) fn set_offsets(&mut self, block: &Block, faults: &mut Vec<Fault>) {
        let kind = block.word(b'L').map(|word| (word, word.value));
        let Some(number) = block.word(b'P') else {
            let message = "G10 has no P, the number of what it sets";
            faults.push(Fault::block(&rules::MISSING_WORD, block, message));
            return;
        };
        if self.dialect == Dialect::Fanuc
            && let Some((word, 10.0 | 11.0 | 12.0 | 13.0)) = kind
        {
            self.set_tool_memory(word, number, block, faults);
            return;
        }
        match kind {
            Some((_, 1.0)) => self.set_tool(number, block, faults),
            Some((word, 10.0 | 11.0))
                if self.dialect == Dialect::Iso && block.letters() & AXIS_LETTERS == 0 =>
            {
                let message = format!("G10 {word} names no axis whose offset it measures");
                let fault = Fault::word(&rules::MISSING_WORD, word, message);
                faults.push(fault.help(
                    "--dialect fanuc takes R for the tool's length; G10 L1 P R sets a radius",
                ));
                self.is_shifted = true;
            }
            Some((_, 10.0)) => self.measure_tool(number, self.frames.active(), block, faults),
            Some((_, 11.0)) => self.measure_tool(number, FIXTURE, block, faults),
            Some((_, 2.0)) => self.place_system(number, block, faults),
            Some((_, 20.0)) if self.dialect.is_fanuc() => {
                self.place_further(number, block, faults);
            }
            Some((_, 20.0)) => self.name_position(number, block, faults),
            Some((word, _)) => {
                let message = format!("G10 {word} is not supported");
                let fault = Fault::word(&rules::UNSUPPORTED_WORD, word, message);
                faults.push(
                    fault.help("L1, L10 and L11 set a tool, L2 and L20 a work coordinate system"),
                );
                self.is_shifted = true;
            }
            None => {
                let message = "G10 has no L, which says what it sets";
                let fault = Fault::block(&rules::MISSING_WORD, block, message);
                faults.push(fault.help("L2 sets a work coordinate system, L1 a tool"));
            }
        }
    }

    /// G10 L1: offsets and radius of a tool.
    fn set_tool(&mut self, number: &Word, block: &Block, faults: &mut Vec<Fault>) {
        let Some(number) = whole(number, 99_999, faults) else { return };
        let values = self.axis_values_of(block, faults);
        let radius_mm = block.word(b'R').map(|word| word.value * self.mm_per_unit);
        let tool = self.tools.entry(number);
        for (axis, value) in values {
            tool.offset_mm[axis] = value;
        }
        if let Some(radius_mm) = radius_mm {
            tool.diameter_mm = 2.0 * radius_mm;
        }
    }

    /// G10 L10 and L11: a tool's offsets become such that with them the machine stands at the axis
    /// words, in the coordinates in force or, without G92, in those of G59.3.
    fn measure_tool(
        &mut self,
        number: &Word,
        system: usize,
        block: &Block,
        faults: &mut Vec<Fault>,
    ) {
        let Some(number) = whole(number, 99_999, faults) else { return };
        if !self.is_untransformed("G10", block, faults) {
            return;
        }
        let is_active = system == self.frames.active();
        let shift_mm = if is_active { self.frames.shift_mm() } else { Point::ZERO };
        let called = self.frames.unshifted(system, &self.position_mm);
        let (mut wanted, mut named) = (called, Vec::new());
        for word in block.words() {
            if let Some((axis, value)) = self.axis_word(word, faults) {
                wanted[axis] = value + shift_mm[axis];
                named.push(axis);
            }
        }
        let moved = self.frames.origin_moved(system, &called, &wanted);
        let stays = self.frames.origin_moved(system, &called, &called);
        let tool_mm = self.frames.tool_mm();
        let radius_mm = block.word(b'R').map(|word| word.value * self.mm_per_unit);
        let tool = self.tools.entry(number);
        for axis in named {
            tool.offset_mm[axis] = tool_mm[axis] + moved[axis] - stays[axis];
        }
        if let Some(radius_mm) = radius_mm {
            tool.diameter_mm = 2.0 * radius_mm;
        }
    }

    /// G10 L10 to L13 of the dialect fanuc: R is the length of tool P, its wear, its radius, or the wear
    /// of that.
    fn set_tool_memory(
        &mut self,
        kind: &Word,
        number: &Word,
        block: &Block,
        faults: &mut Vec<Fault>,
    ) {
        let Some(number) = whole(number, 99_999, faults) else { return };
        let Some(value) = block.word(b'R').copied() else {
            let message = "G10 has no R, the value that it sets";
            faults.push(Fault::block(&rules::MISSING_WORD, block, message));
            return;
        };
        let mm = value.value * self.mm_per_unit;
        let measure = if kind.value < 12.0 { Measure::Length } else { Measure::Radius };
        let is_wear = matches!(kind.value, 11.0 | 13.0);
        let before_mm = match is_wear {
            _ if self.absolute => 0.0,
            true => self.tools.wear_mm(number, measure),
            false => self.tools.measure_mm(number, measure),
        };
        self.tools.set_measure(number, measure, is_wear, before_mm + mm);
    }

    /// G43 to G49
    pub(super) fn change_length(&mut self, length: Length, block: &Block, faults: &mut Vec<Fault>) {
        match length {
            Length::Table => self.set_length(LengthMode::Table, block, faults),
            Length::Subtracted => self.set_length(LengthMode::Subtracted, block, faults),
            Length::Words => self.set_length_by_words(block, faults),
            Length::More => self.add_length(block, faults),
            Length::Off => {
                self.length_mode = LengthMode::Off;
                self.frames.set_tool(Point::ZERO);
            }
        }
    }

    /// G43 and G44: the offset of a tool of the table; without H of the one in the spindle.
    fn set_length(&mut self, mode: LengthMode, block: &Block, faults: &mut Vec<Fault>) {
        let number = match block.word(b'H') {
            Some(word) => whole(word, 99_999, faults),
            None => Some(self.loaded.unwrap_or(0)),
        };
        let Some(offset_mm) = number.and_then(|number| self.length_of(number, block, faults))
        else {
            return;
        };
        self.length_mode = mode;
        self.frames.set_tool(mode.signed(&offset_mm));
    }

    /// G43.2
    fn add_length(&mut self, block: &Block, faults: &mut Vec<Fault>) {
        let Some(word) = block.word(b'H') else {
            let message = "G43.2 has no H, the tool whose offset is added";
            faults.push(Fault::block(&rules::MISSING_WORD, block, message));
            return;
        };
        let number = whole(word, 99_999, faults);
        let Some(offset_mm) = number.and_then(|number| self.length_of(number, block, faults))
        else {
            return;
        };
        self.length_mode = LengthMode::Table;
        let before_mm = self.frames.tool_mm();
        self.frames.set_tool(AxisMap::from_fn(|axis| before_mm[axis] + offset_mm[axis]));
    }

    /// The offsets of a tool of the table; of tool 0 none.
    fn length_of(&mut self, number: u32, block: &Block, faults: &mut Vec<Fault>) -> Option<Point> {
        match self.tools.get(number) {
            Some(tool) => Some(tool.offset_mm),
            None if number == 0 => Some(Point::ZERO),
            None => {
                faults.push(self.unknown_tool(number, block));
                self.is_shifted = true;
                None
            }
        }
    }

    /// Letters of tools that a block may name without the code that makes use of them: D, which the
    /// next G41 or G42 without one takes, and in the dialect fanuc H while G43 or G44 is in force.
    pub(super) fn held_numbers(&self, block: &Block) -> u32 {
        let is_free = |letter: u8| {
            let bit = letter_bit(letter);
            block.has(letter) && self.codes.iter().all(|(code, _)| code.words & bit == 0)
        };
        let takes_d = matches!(self.dialect, Dialect::Iso | Dialect::Fanuc);
        let d = if takes_d && is_free(b'D') { letter_bit(b'D') } else { 0 };
        let takes_h = self.dialect == Dialect::Fanuc && self.length_mode.is_of_table();
        d | if takes_h && is_free(b'H') { letter_bit(b'H') } else { 0 }
    }

    /// Takes such letters; the codes of the block have been executed.
    pub(super) fn hold_numbers(
        &mut self,
        block: &Block,
        codes: &[(&'static Code, Op)],
        asked: Asked,
        faults: &mut Vec<Fault>,
    ) {
        if asked.is_faulty || block.letters() & letter_set("DH") == 0 {
            return;
        }
        let of = |letter: u8| codes.iter().find(|(code, _)| code.words & letter_bit(letter) != 0);
        let is_own = |op: &Op| matches!(op, Op::Compensate { by_diameter: false, .. });
        let keeps = match of(b'D') {
            None => matches!(self.dialect, Dialect::Iso | Dialect::Fanuc),
            Some((_, op)) => self.dialect == Dialect::Fanuc && is_own(op),
        };
        if let Some(word) = block.word(b'D').filter(|_| keeps) {
            self.held_d = whole(word, 99_999, faults);
        }
        let takes_h = self.dialect == Dialect::Fanuc && self.length_mode.is_of_table();
        if takes_h && block.has(b'H') && of(b'H').is_none() {
            self.set_length(self.length_mode, block, faults);
        }
    }

    /// A tool that the table lacks.
    pub(super) fn unknown_tool(&self, number: u32, block: &Block) -> Fault {
        let word = block.word(b'H').or(block.word(b'D'));
        let message = if number == 0 && word.is_none() {
            "no H or D names a tool, and none is in the spindle (T and M6)".to_owned()
        } else {
            format!("tool {number} does not stand in the tool table")
        };
        let fault = match word {
            Some(word) => Fault::word(&rules::UNKNOWN_TOOL, word, message),
            None => Fault::block(&rules::UNKNOWN_TOOL, block, message),
        };
        if self.tools.is_empty() {
            return fault.help("hand in the tools by --tools FILE, or set them by G10 L1");
        }
        let numbers: Vec<String> = self.tools.numbers().take(20).map(|n| n.to_string()).collect();
        fault.help(format!("it holds {}", numbers.join(", ")))
    }

    /// G43.1: the offset is that of the axis words.
    fn set_length_by_words(&mut self, block: &Block, faults: &mut Vec<Fault>) {
        let mut offset_mm = self.frames.tool_mm();
        for (axis, value) in self.axis_values("G43.1", block, faults) {
            offset_mm[axis] = value;
        }
        self.length_mode = LengthMode::Words;
        self.frames.set_tool(offset_mm);
    }

    /// G51: axis words are the centre, P or I J K the factors.
    /// On FANUC factors without a point are thousandths.
    pub(super) fn set_scaling(&mut self, block: &Block, out: &mut Output<'_>) {
        let faults = &mut *out.faults;
        let mut center_mm = self.frames.program(&self.position_mm);
        for word in block.words() {
            if let Some((axis, value)) = self.axis_word(word, faults) {
                center_mm[axis] = value;
            }
        }
        let mut factors = AxisMap([1.0; crate::base::axis::AXES]);
        let letters = [(Axis::X, b'I'), (Axis::Y, b'J'), (Axis::Z, b'K')];
        let mut any = false;
        for (axis, letter) in letters {
            let Some(word) = block.word(letter).or(block.word(b'P')) else { continue };
            any = true;
            if word.value == 0.0 {
                faults.push(Fault::word(&rules::BAD_VALUE, word, "a scale of 0 leaves nothing"));
                return;
            }
            let has_point = has_point(word, out.text) || word.value.fract() != 0.0;
            let is_small = self.dialect == Dialect::Fanuc && !has_point;
            factors[axis] = word.value / if is_small { 1000.0 } else { 1.0 };
        }
        if !any {
            let message = "G51 has neither P nor I J K, the factors";
            faults.push(Fault::block(&rules::MISSING_WORD, block, message));
            return;
        }
        self.frames.set_scaling(Some(Scaling { center_mm, factors }));
    }

    /// G51.1: axis words are where these axes are mirrored.
    pub(super) fn set_mirror(&mut self, block: &Block, faults: &mut Vec<Fault>) {
        let from = self.frames.program(&self.position_mm);
        for (axis, value) in self.axis_values("G51.1", block, faults) {
            let at_mm = if self.absolute { value } else { from[axis] + value };
            self.frames.set_mirror(axis, Some(at_mm));
        }
    }

    /// G50.1: the axes that it names are mirrored no longer; without any all.
    pub(super) fn end_mirror(&mut self, block: &Block, faults: &mut Vec<Fault>) {
        let named: Vec<Axis> =
            self.axis_values_of(block, faults).into_iter().map(|(axis, _)| axis).collect();
        let axes = if named.is_empty() { Axis::ALL.to_vec() } else { named };
        for axis in axes {
            self.frames.set_mirror(axis, None);
        }
    }

    /// G50, which of a lathe means something else.
    pub(super) fn end_scaling(&mut self, block: &Block, faults: &mut Vec<Fault>) {
        if let Some(word) = block.first_of(AXIS_LETTERS).or(block.word(b'S')) {
            let message = format!("{word} beside G50: its meaning on lathes is not supported");
            let fault = Fault::word(&rules::UNSUPPORTED_WORD, word, message);
            faults.push(fault.help(
                "take --dialect fanuc-lathe for a program of a lathe; else G92 sets the position, D \
                 beside G96 the greatest speed",
            ));
            self.is_shifted = true;
            return;
        }
        self.frames.set_scaling(None);
    }

    /// G68: the plane's axis words are the centre, R the angle.
    pub(super) fn set_rotation(&mut self, block: &Block, faults: &mut Vec<Fault>) {
        let Some(angle) = block.word(b'R') else {
            let message = "G68 has no R, the angle in degrees";
            faults.push(Fault::block(&rules::MISSING_WORD, block, message));
            return;
        };
        self.frames.set_rotation(None);
        let mut center = self.frames.program(&self.position_mm);
        let axes = self.plane.axes();
        for word in block.words() {
            match self.axis_word(word, faults) {
                Some((axis, value)) if axes.contains(&axis) => center[axis] = value,
                Some(_) => {
                    let message = format!("{word} lies out of the {} plane", self.plane.name());
                    faults.push(Fault::word(&rules::UNUSED_WORD, word, message));
                }
                None => {}
            }
        }
        let center = self.frames.scaled(&center);
        self.frames.set_rotation(Some(Rotation {
            plane: self.plane,
            center_mm: axes.map(|axis| center[axis]),
            angle_deg: angle.value,
        }));
    }

    /// G28, G30, G28.1 and G30.1
    pub(super) fn reference(&mut self, op: Op, block: &Block, asked: Asked, out: &mut Output<'_>) {
        match op {
            Op::GoToReference(index) => self.go_to_reference(index, block, asked, out),
            Op::StoreReference(index) => self.store_reference(index),
            _ => {}
        }
    }

    /// G28 and G30: by way of the axis words to the reference of their axes; without any, of all.
    fn go_to_reference(&mut self, index: u8, block: &Block, asked: Asked, out: &mut Output<'_>) {
        if let Some(word) = block.word(b'P').filter(|word| index == 1 && word.value != 2.0) {
            let message = format!("{word}: there are no more than two reference positions");
            let fault = Fault::word(&rules::UNSUPPORTED_WORD, word, message);
            out.faults.push(fault.help("G28 goes to the first, G30 (or G30 P2) to the second"));
            self.forget_position();
            return;
        }
        let has_words = block.letters() & AXIS_LETTERS != 0;
        let by_way = self.target(block, &asked, out.faults);
        let mut reference_mm = by_way;
        for axis in self.axes.iter() {
            if has_words && !self.names_axis(block, axis) {
                continue;
            }
            let Some(at_mm) = self.reference_mm(index, axis) else {
                let name = if index == 0 { "G28" } else { "G30" };
                let message = format!("{name}: where {axis} has its reference is not known");
                let fault = Fault::block(&rules::REFERENCE_UNSET, block, message);
                out.faults.push(fault.help(format!(
                    "write home_mm for {axis} into the machine profile, or {name}.1 at that place \
                     before"
                )));
                self.forget_position();
                return;
            };
            reference_mm[axis] = at_mm;
        }
        if asked.is_faulty {
            return;
        }
        if has_words {
            self.go(block, &by_way, MoveKind::Rapid, asked.corner, out);
        }
        self.go(block, &reference_mm, MoveKind::Rapid, asked.corner, out);
    }

    /// What G28.1 or G30.1 have stored, or else the home position; on an axis without travel 0.
    pub(super) fn reference_mm(&self, index: u8, axis: Axis) -> Option<f64> {
        let stored = self.references.get(usize::from(index)).and_then(|stored| stored[axis]);
        if stored.is_some() {
            return stored;
        }
        let profile = self.machine.axis(axis)?;
        profile.home_mm.or_else(|| profile.travel_mm.is_none().then_some(0.0))
    }

    /// G28.1 and G30.1
    fn store_reference(&mut self, index: u8) {
        if let Some(place) = self.references.get_mut(usize::from(index)) {
            *place = AxisMap::from_fn(|axis| Some(self.position_mm[axis]));
        }
    }
}

/// Whether a code takes the axis words of its block for itself.
pub(super) fn claims_axes(op: Op) -> bool {
    matches!(
        op,
        Op::SetOffsets
            | Op::LocalOffset
            | Op::SetPosition
            | Op::GoToReference(_)
            | Op::Lathe(_)
            | Op::Stock(_)
            | Op::LengthOffset(Length::Words)
            | Op::Mirror { .. }
            | Op::Scaling
            | Op::Rotation
    )
}
