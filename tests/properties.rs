//! Programs that are written in two ways and mean the same: in inches and in millimetres, absolute
//! and incremental, with subprograms and written out. The generator covers lines, arcs and helices in
//! all planes, canned cycles, offsets and cutter compensation.

use cnc::base::{Axis, Machine, Source};
use cnc::interp::{self, Motion, Move, MoveKind, Options};
use proptest::prelude::*;

/// Lengths are whole numbers of this: a thousandth of an inch, which is exact in both units.
const UNIT_MM: f64 = 0.0254;

/// A piece of a program. Distances are in units, from where the piece before has ended.
#[derive(Clone, Debug)]
enum Part {
    Rapid([i32; 3]),
    Line([i32; 3], i32),
    /// Plane, centre, quarters of a turn, along the axis across, counter-clockwise, by R if that
    /// can be.
    Arc(usize, [i32; 2], u8, i32, bool, bool),
    /// G code, to X and Y, R above or below the tool, bottom below R, G99.
    Cycle(u8, [i32; 2], i32, i32, bool),
    /// G52, or else G10 L2 P1: X Y Z.
    Offset(bool, [i32; 3]),
    /// Left, diameter, sides of a staircase.
    Compensated(bool, i32, Vec<(i32, i32)>),
    /// So many times.
    Repeat(u8, Vec<Part>),
}

fn length() -> impl Strategy<Value = i32> {
    -2000..2000_i32
}

fn part() -> impl Strategy<Value = Part> {
    let side = 300..1500_i32;
    let leaf = prop_oneof![
        proptest::array::uniform3(length()).prop_map(Part::Rapid),
        (proptest::array::uniform3(length()), 100..9000_i32).prop_map(|(to, f)| Part::Line(to, f)),
        (0..3_usize, [length(), length()], 1..5_u8, length(), any::<bool>(), any::<bool>())
            .prop_filter("an arc has a radius", |arc| arc.1 != [0, 0])
            .prop_map(|(plane, center, quarters, across, ccw, by_r)| {
                Part::Arc(plane, center, quarters, across, ccw, by_r)
            }),
        // A centre on an axis, so that R is a whole number too.
        (0..3_usize, 1..2000_i32, prop_oneof![Just(1_u8), Just(3)], any::<bool>())
            .prop_map(|(plane, i, quarters, ccw)| Part::Arc(plane, [i, 0], quarters, 0, ccw, true)),
        (
            prop_oneof![Just(73_u8), Just(81), Just(82), Just(83), Just(85), Just(89)],
            [length(), length()],
            -500..500_i32,
            1..2000_i32,
            any::<bool>()
        )
            .prop_map(|(code, to, r, deep, to_r)| Part::Cycle(code, to, r, deep, to_r)),
        (any::<bool>(), proptest::array::uniform3(length()))
            .prop_map(|(local, by)| Part::Offset(local, by)),
        (any::<bool>(), 1..200_i32, proptest::collection::vec((side.clone(), side), 1..4))
            .prop_map(|(left, d, sides)| Part::Compensated(left, d, sides)),
    ];
    leaf.prop_recursive(2, 16, 4, |inner| {
        (1..4_u8, proptest::collection::vec(inner, 1..4))
            .prop_map(|(count, parts)| Part::Repeat(count, parts))
    })
}

fn parts() -> impl Strategy<Value = Vec<Part>> {
    proptest::collection::vec(part(), 1..8)
}

/// How a program is written.
#[derive(Clone, Copy, Debug)]
struct Form {
    inches: bool,
    absolute: bool,
    /// Repetitions are calls of subprograms; needs the incremental form.
    calls: bool,
}

/// Writes a program.
struct Writer {
    form: Form,
    text: String,
    subprograms: String,
    count: u32,
    /// Where the tool is, in machine units; and the offsets in force.
    at: [i32; 3],
    offsets: [[i32; 3]; 2],
}

const LETTERS: [&str; 3] = ["X", "Y", "Z"];
const CENTERS: [&str; 3] = ["I", "J", "K"];
/// Of each plane its G code and its axes; the third is the one across.
const PLANES: [(u8, [usize; 3]); 3] = [(17, [0, 1, 2]), (18, [2, 0, 1]), (19, [1, 2, 0])];

fn program(parts: &[Part], form: Form) -> String {
    let mut writer = Writer {
        form,
        text: String::new(),
        subprograms: String::new(),
        count: 0,
        at: [0; 3],
        offsets: [[0; 3]; 2],
    };
    let (units, distance) =
        (if form.inches { 20 } else { 21 }, if form.absolute { 90 } else { 91 });
    writer.text = format!("G{units} G{distance}\n{}\n", writer.word("F", 4000));
    writer.parts(parts);
    format!("{}M30\n{}", writer.text, writer.subprograms)
}

impl Writer {
    /// A word of a length.
    fn word(&self, letter: &str, value: i32) -> String {
        let (value, decimals) = if self.form.inches {
            (f64::from(value) / 1000.0, 3)
        } else {
            (f64::from(value) * UNIT_MM, 4)
        };
        format!("{letter}{value:.decimals$} ")
    }

    /// The word of an axis that goes by so much.
    fn to(&mut self, axis: usize, by: i32) -> String {
        self.at[axis] += by;
        let shift = self.offsets[0][axis] + self.offsets[1][axis];
        let value = if self.form.absolute { self.at[axis] - shift } else { by };
        self.word(LETTERS[axis], value)
    }

    fn by(&mut self, by: [i32; 3]) -> String {
        (0..3).map(|axis| self.to(axis, by[axis])).collect()
    }

    fn line(&mut self, text: &str) {
        self.text += text;
        self.text.push('\n');
    }

    fn parts(&mut self, parts: &[Part]) {
        for part in parts {
            self.part(part);
        }
    }

    fn part(&mut self, part: &Part) {
        match part {
            Part::Rapid(by) => {
                let words = self.by(*by);
                self.line(&format!("G0 {words}"));
            }
            Part::Line(by, feed) => {
                let words = self.by(*by) + &self.word("F", *feed);
                self.line(&format!("G1 {words}"));
            }
            Part::Arc(plane, center, quarters, across, ccw, by_r) => {
                self.arc(PLANES[*plane], *center, *quarters, *across, (*ccw, *by_r));
            }
            Part::Cycle(code, to, r, deep, to_r) => self.cycle(*code, *to, *r, *deep, *to_r),
            Part::Offset(local, to) => {
                self.offsets[usize::from(*local)] = *to;
                let words: String = (0..3).map(|axis| self.word(LETTERS[axis], to[axis])).collect();
                self.line(&format!("{} {words}", if *local { "G52" } else { "G10 L2 P1" }));
            }
            Part::Compensated(left, diameter, sides) => {
                let words = self.word("D", *diameter) + &self.to(0, 500);
                self.line(&format!("G17 G1 {} {words}", if *left { "G41.1" } else { "G42.1" }));
                for (x, y) in sides {
                    let words = [self.to(1, *y), self.to(0, *x)];
                    words.iter().for_each(|word| self.line(word));
                }
                let words = self.to(0, 700) + &self.to(1, 300);
                self.line(&format!("G40 {words}"));
            }
            Part::Repeat(count, parts) if self.form.calls => {
                self.count += 1;
                let number = self.count;
                let outside = std::mem::take(&mut self.text);
                self.parts(parts);
                let body = std::mem::replace(&mut self.text, outside);
                self.repeat(number, *count, &body);
            }
            Part::Repeat(count, parts) => (0..*count).for_each(|_| self.parts(parts)),
        }
    }

    /// A body that runs so often, in one of the ways to say so.
    fn repeat(&mut self, number: u32, count: u8, body: &str) {
        match number % 5 {
            0 => self.line(&format!("o{number} repeat [{count}]\n{body}o{number} endrepeat")),
            1 => {
                (0..count).for_each(|_| self.line(&format!("o{number} call")));
                self.subprograms += &format!("o{number} sub\n{body}o{number} endsub\n");
                return;
            }
            2 => self.line(&format!("GR P{number} L{count}")),
            3 => self.line(&format!("G65 P{number} L{count}")),
            _ => self.line(&format!("M98 P{number} L{count}")),
        }
        if !number.is_multiple_of(5) {
            self.subprograms += &format!("O{number}\n{body}M99\n");
        }
    }

    fn arc(
        &mut self,
        (code, [first, second, normal]): (u8, [usize; 3]),
        [i, j]: [i32; 2],
        quarters: u8,
        across: i32,
        (ccw, by_r): (bool, bool),
    ) {
        // From the centre to the start, turned by quarters.
        let mut to = [-i, -j];
        for _ in 0..quarters {
            to = if ccw { [-to[1], to[0]] } else { [to[1], -to[0]] };
        }
        let mut words = self.to(first, i + to[0]) + &self.to(second, j + to[1]);
        words += &self.to(normal, across);
        if by_r && j == 0 && quarters % 2 == 1 {
            words += &self.word("R", if quarters == 3 { -i.abs() } else { i.abs() });
        } else {
            words += &self.word(CENTERS[first], i);
            words += &self.word(CENTERS[second], j);
        }
        self.line(&format!("G{code} G{} {words}", if ccw { 3 } else { 2 }));
    }

    fn cycle(&mut self, code: u8, to: [i32; 2], r: i32, deep: i32, to_r: bool) {
        let initial = self.at[2];
        let mut words = self.to(0, to[0]) + &self.to(1, to[1]);
        let shift = self.offsets[0][2] + self.offsets[1][2];
        let level = initial + r;
        let (r, bottom) =
            if self.form.absolute { (level - shift, level - deep - shift) } else { (r, -deep) };
        words += &self.word("R", r);
        words += &self.word("Z", bottom);
        words += match code {
            73 | 83 => self.word("Q", 700),
            82 | 89 => "P0.5".to_owned(),
            _ => String::new(),
        }
        .as_str();
        self.at[2] = if to_r { level } else { initial.max(level) };
        self.line(&format!("G17 G{} G{code} {words}", if to_r { 99 } else { 98 }));
        self.line("G80");
    }
}

/// What a program means: its moves, without those that rounding alone has made.
fn moves(text: &str) -> Vec<Move> {
    let machine = Machine::load("ideal").unwrap();
    let source = Source::memory("test.nc", text.as_bytes());
    let checked = interp::check(&source, &machine, &Options::default(), 5).unwrap();
    assert_eq!(checked.errors, 0, "{text}{:?}", checked.diagnostics);
    let motions = interp::motions(&source, &machine, &Options::default());
    let moves = motions.filter_map(|motion| match motion.unwrap() {
        Motion::Move(step) => Some(step),
        Motion::Event(_) => None,
    });
    let rests = |step: &Move| {
        !matches!(step.kind, MoveKind::Arc { .. })
            && Axis::ALL.into_iter().all(|axis| (step.to[axis] - step.from[axis]).abs() < 1e-9)
    };
    moves.filter(|step| !rests(step)).collect()
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-6
}

fn same(a: &Move, b: &Move) -> bool {
    let kinds = match (a.kind.clone(), b.kind.clone()) {
        (MoveKind::Rapid, MoveKind::Rapid) => true,
        (MoveKind::Line { feed_mm_min: a }, MoveKind::Line { feed_mm_min: b }) => close(a, b),
        (
            MoveKind::Arc { feed_mm_min: f, plane: p, center_mm: c, ccw, turns },
            MoveKind::Arc { feed_mm_min, plane, center_mm, ccw: other_ccw, turns: other_turns },
        ) => {
            close(f, feed_mm_min)
                && (p, ccw, turns) == (plane, other_ccw, other_turns)
                && close(c[0], center_mm[0])
                && close(c[1], center_mm[1])
        }
        _ => false,
    };
    kinds && Axis::ALL.into_iter().all(|axis| close(a.to[axis], b.to[axis]))
}

fn check(parts: &[Part], one: Form, other: Form) -> Result<(), TestCaseError> {
    check_programs(&program(parts, one), &program(parts, other))
}

fn check_programs(one: &str, other: &str) -> Result<(), TestCaseError> {
    let (a, b) = (moves(one), moves(other));
    for (at, (a, b)) in a.iter().zip(&b).enumerate() {
        prop_assert!(same(a, b), "move {at}: {a:?}\n{b:?}\n{one}\n{other}");
    }
    prop_assert_eq!(a.len(), b.len(), "{}\n{}", one, other);
    Ok(())
}

/// Blocks of moves, and modes between them; some are wrong.
fn blocks() -> impl Strategy<Value = Vec<String>> {
    let modes = [
        "G20",
        "G21",
        "G90",
        "G91",
        "G52 X1 Z2.5",
        "G68 X0 Y0 R30",
        "G69",
        "G51 X0 Y0 Z0 P2",
        "G50",
        "G7",
        "G8",
        "G61.1",
        "G64 P0.1",
        "G80",
        "G55",
        "G41.1 D1",
        "G40",
        "G16",
        "G15",
        "G17",
        "G18",
        "G19",
        "G90.1",
        "G91.1",
        "G53 G0 Z-10",
        "G91 G2 X1 Y1 I1 J0",
        "G91 G3 X2 I1 K0 Z2",
        "G2 I5.5",
        "G3 J-3 Z1",
        "G2 K4 F50",
        "G3 X10 Y3 R20",
        "F0",
    ];
    let number = "-?[0-9]{1,3}\\.[0-9]{0,4}";
    let words = ["(X{} ?)?", "(Y{} ?)?", "(Z{} ?)?", "(A{} ?)?"].concat().replace("{}", number);
    let block = proptest::string::string_regex(&format!("(G[01] ?)?{words}(F[1-9][0-9]{{2}} ?)?"));
    let arc = "(G[23] ?)?(X-?[0-9]\\.[0-9] ?)?(I-?[0-9]\\.[0-9] ?)?(J-?[0-9]\\.[0-9] ?)?(P[12])?";
    let block = prop_oneof![
        8 => block.unwrap(),
        2 => proptest::string::string_regex(arc).unwrap(),
        2 => proptest::sample::select(modes.to_vec()).prop_map(str::to_owned),
    ];
    proptest::collection::vec(block, 1..30)
}

const METRIC: Form = Form { inches: false, absolute: false, calls: false };

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn inches_are_millimetres(parts in parts(), absolute: bool) {
        let metric = Form { absolute, ..METRIC };
        check(&parts, metric, Form { inches: true, ..metric })?;
    }

    #[test]
    fn absolute_words_are_incremental_ones(parts in parts(), inches: bool) {
        let incremental = Form { inches, ..METRIC };
        check(&parts, incremental, Form { absolute: true, ..incremental })?;
    }

    #[test]
    fn subprograms_are_what_they_unroll_to(parts in parts()) {
        check(&parts, METRIC, Form { calls: true, ..METRIC })?;
    }

    /// Offsets are refused where axes are mirrored or scaled.
    #[test]
    fn mirror_images_are_scaled_by_less_than_zero(parts in parts(), axes in 1..8_u8, at in length()) {
        let text = program(&parts, METRIC);
        prop_assume!(!text.contains("G52") && !text.contains("G10"));
        let (mut mirror, mut scaling) = (String::from("G51.1"), String::from("G51"));
        for (bit, (axis, factor)) in [("X", "I"), ("Y", "J"), ("Z", "K")].into_iter().enumerate() {
            let is_mirrored = axes & 1 << bit != 0;
            if is_mirrored {
                mirror += &format!(" {axis}{at}");
            }
            scaling += &format!(" {axis}{at} {factor}{}", if is_mirrored { -1 } else { 1 });
        }
        check_programs(&format!("{mirror}\n{text}"), &format!("{scaling}\n{text}"))?;
    }

    /// A block with a code more is executed in another way: one that asks what stands in it.
    #[test]
    fn plain_moves_are_what_they_are_beside_a_code_that_changes_nothing(
        blocks in blocks(), machine in prop_oneof![Just("ideal"), Just("starmill")],
    ) {
        let machine = Machine::load(machine).unwrap();
        let run = |code: &str| {
            let numbered = blocks.iter().enumerate();
            let text: String = numbered.map(|(n, block)| format!("N{n} {block} {code}\n")).collect();
            let source = Source::memory("test.nc", format!("F500\n{text}M2\n").as_bytes());
            let options = Options::default();
            let checked = interp::check(&source, &machine, &options, 100).unwrap();
            let motions: Vec<_> = interp::motions(&source, &machine, &options)
                .map_while(Result::ok)
                .collect();
            let told = checked.diagnostics.iter().map(|found| (found.span.line, found.rule));
            (told.collect::<Vec<_>>(), checked.summary, motions)
        };
        prop_assert_eq!(run(""), run("G94"));
    }
}
