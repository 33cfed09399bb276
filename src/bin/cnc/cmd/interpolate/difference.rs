//! `--method b`: the difference equations of each segment, and how far nodes that run them drift.

use std::cell::OnceCell;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::anyhow;
use clap::ValueEnum;
use cnc::base::rounding::six_digits;
use cnc::base::{Axis, AxisMap};
use cnc::path::PathItem;
use cnc::plot::{Along, Chart, Curve, Limit, Scale, Size};
use cnc::systems::difference::drift::{DRIFT_MAX_STEPS, Drift, Needs, Run, Runs, least_word};
use cnc::systems::difference::node::{Rounding, WORD_BITS_MAX, Word};
use cnc::systems::difference::{Constants, Equations, equations, jump, steps_per_mm};
use serde_json::{Map, Value, json};

use crate::exit::{Exit, Failure, Outcome};
use crate::output;
use crate::program::Program;

/// Bits of a word unless said otherwise.
const WORD_BITS: u32 = 32;

/// Curves have so many points; each is the greatest drift of its stretch.
const POINTS: u64 = 600;

/// Drift below this is not drawn: rounding of the path itself is of its size.
const DRAWN_STEPS: f64 = 1e-5;

/// How nodes calculate.
#[derive(Debug, clap::Args)]
pub struct WordArgs {
    /// Bits of a node's word, the sign included (method b) [default: 32]
    #[arg(long, value_name = "W", value_parser = clap::value_parser!(u32).range(2..=i64::from(WORD_BITS_MAX)))]
    word_bits: Option<u32>,
    /// Bits of them behind the point of a position in steps (method b) [default: all that the
    /// program leaves]
    #[arg(long, value_name = "F", value_parser = clap::value_parser!(u32).range(0..=i64::from(WORD_BITS_MAX)))]
    fraction_bits: Option<u32>,
    /// What becomes of further bits (method b) [default: nearest]
    #[arg(long, value_enum)]
    rounding: Option<RoundingArg>,
    /// How the constants of arcs are made (method b) [default: exact]
    #[arg(long, value_enum)]
    constants: Option<ConstantsArg>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum ConstantsArg {
    /// By sine and cosine of the angle a tick
    Exact,
    /// By the angle itself, and 1, as the seed's first host did
    SmallAngle,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum RoundingArg {
    /// To the nearest, halves up
    Nearest,
    /// Downwards: they are dropped
    Down,
}

impl WordArgs {
    fn constants(&self) -> Constants {
        match self.constants {
            None | Some(ConstantsArg::Exact) => Constants::Exact,
            Some(ConstantsArg::SmallAngle) => Constants::SmallAngle,
        }
    }

    fn rounding(&self) -> Rounding {
        match self.rounding {
            None | Some(RoundingArg::Nearest) => Rounding::Nearest,
            Some(RoundingArg::Down) => Rounding::Down,
        }
    }
}

/// What is written, and how.
pub struct Wanted<'a> {
    pub word: &'a WordArgs,
    /// The drift of every tick instead of a report.
    pub csv: bool,
    pub json: bool,
    pub output: Option<&'a Path>,
    pub svg: Option<&'a PathBuf>,
}

/// Writes the report or the drift of every tick, and the drawing.
pub fn report(program: &Program, wanted: &Wanted<'_>) -> Outcome {
    let study = match Study::new(program, wanted.word)? {
        Ok(study) => study,
        Err(refusal) => {
            say!("error: {refusal}");
            return Ok(Exit::BadInput);
        }
    };
    if let Some(path) = wanted.svg {
        let chart = study.chart()?;
        output::whole_file(path, |out| Ok(write!(out, "{chart}")?))?;
    }
    match (wanted.csv, wanted.output) {
        (true, Some(path)) if path != Path::new("-") => {
            output::whole_file(path, |out| study.ticks(out))?;
            if wanted.json {
                study.document(&mut io::stdout().lock())?;
            }
        }
        (true, _) => study.ticks(&mut BufWriter::new(io::stdout().lock()))?,
        (false, _) => {
            let mut out = BufWriter::new(io::stdout().lock());
            if wanted.json {
                study.document(&mut out)?;
            } else {
                study.table(&mut out)?;
            }
            out.flush()?;
        }
    }
    Ok(Exit::Ok)
}

/// A number that six decimals show as zero, without the sign that it had.
fn unsigned_zero(value: f64) -> f64 {
    if value.abs() < 0.5e-6 { 0.0 } else { value }
}

/// A program whose nodes run equations.
struct Study<'p> {
    program: &'p Program,
    constants: Constants,
    needs: Needs,
    word: Word,
    /// Words to compare, in order of their length; the chosen one is among them or not.
    words: Vec<Word>,
    compared: OnceCell<Vec<Run>>,
}

impl<'p> Study<'p> {
    /// Reads the program for what it needs; a word that has no room for it is refused.
    fn new(program: &'p Program, args: &WordArgs) -> Result<Result<Study<'p>, String>, Failure> {
        let scale = steps_per_mm(&program.machine);
        let mut needs = Needs::default();
        needs.range.include_place(&program.start_mm(), &scale, 1);
        each_segment(program, args.constants(), |piece| {
            needs.include(piece, &scale);
            Ok(())
        })?;
        let (bits, rounding) = (args.word_bits.unwrap_or(WORD_BITS), args.rounding());
        let word = match args.fraction_bits {
            Some(fraction_bits) => needs.range.word_with(bits, fraction_bits, rounding),
            None => needs.range.word(bits, rounding),
        };
        let Some(word) = word else {
            let fraction_bits = args.fraction_bits.unwrap_or(0);
            return Ok(Err(refusal(&needs, bits, fraction_bits)));
        };
        let words = needs.words(rounding);
        let constants = args.constants();
        Ok(Ok(Study { program, constants, needs, word, words, compared: OnceCell::new() }))
    }

    fn runs(&self, words: &[Word]) -> Runs {
        Runs::new(&self.program.machine, &self.program.start_mm(), words)
    }

    /// What each word comes to.
    fn compared(&self) -> Result<&[Run], Failure> {
        if let Some(compared) = self.compared.get() {
            return Ok(compared);
        }
        let mut runs = self.runs(&self.words);
        each_segment(self.program, self.constants, |piece| {
            runs.segment(piece, |_, _| {});
            Ok(())
        })?;
        Ok(self.compared.get_or_init(|| runs.runs().to_vec()))
    }

    /// The axes that are told of.
    fn axes(&self) -> Vec<Axis> {
        super::axes(self.program).collect()
    }

    /// The drift of every tick, with its sign.
    fn ticks(&self, out: &mut impl Write) -> Result<(), Failure> {
        let axes = self.axes();
        write!(out, "tick,line")?;
        axes.iter().try_for_each(|axis| write!(out, ",{axis}"))?;
        writeln!(out)?;
        let mut runs = self.runs(&[self.word]);
        each_segment(self.program, self.constants, |piece| {
            let mut written = Ok(());
            runs.segment(piece, |tick, runs| {
                let drift = &runs[0].last_steps;
                let mut row = || -> io::Result<()> {
                    write!(out, "{tick},{}", piece.segment.line)?;
                    axes.iter()
                        .try_for_each(|axis| write!(out, ",{:.6}", unsigned_zero(drift[*axis])))?;
                    writeln!(out)
                };
                if written.is_ok() {
                    written = row();
                }
            });
            Ok(written?)
        })?;
        Ok(out.flush()?)
    }

    fn table(&self, out: &mut impl Write) -> Result<(), Failure> {
        let (program, word) = (self.program, self.word);
        writeln!(out, "program   {}", program.source.name())?;
        writeln!(out, "machine   {}", program.machine)?;
        writeln!(
            out,
            "method    B: each node runs difference equations at constant feed, without ramps"
        )?;
        writeln!(
            out,
            "word      {} bits: {} behind the point of positions in steps, {} of constants; {}",
            word.bits,
            word.fraction_bits,
            word.constant_bits,
            rounding(word.rounding)
        )?;
        if self.constants == Constants::SmallAngle {
            writeln!(out, "arcs      by small angles: A and D are 1, B and C the angle a tick")?;
        }
        writeln!(out)?;
        writeln!(
            out,
            "{:>7} {:>7} {:>9} {:>11} {:>11}  equations, in steps a tick of {} µs",
            "line", "ticks", "mm/min", "drift most", "at its end", program.machine.bus.tick_us
        )?;
        let mut jumps = Jumps::default();
        let mut runs = self.runs(&[word]);
        self.each_row(&mut runs, |piece, most, end| {
            jumps.take(piece, program);
            writeln!(
                out,
                "{:>7} {:>7} {:>9.1} {most:>11.6} {end:>11.6}  {}",
                piece.segment.line,
                piece.ticks,
                60.0 * piece.speed_mm_s(&program.machine),
                told(piece, &self.axes())
            )?;
            Ok(())
        })?;
        writeln!(out)?;
        let Some(run) = runs.runs().first() else { return Ok(()) };
        let Drift { steps, tick, line } = run.greatest;
        match tick {
            0 => writeln!(out, "drift     none")?,
            _ => {
                writeln!(out, "drift     {steps:.6} steps at most, after tick {tick}, line {line}")?
            }
        }
        for axis in self.axes() {
            writeln!(out, "at end    {axis} {:+.6} steps", unsigned_zero(run.last_steps[axis]))?;
        }
        if let Some((axis, jump_mm_s, line)) = jumps.greatest {
            let start_mm_s = program.machine.axis(axis).map_or(0.0, |axis| axis.start_speed_mm_s);
            writeln!(
                out,
                "no ramps  {axis} changes its speed by {jump_mm_s:.2} mm/s at once, line {line}; its motor starts at {start_mm_s}"
            )?;
        }
        writeln!(out)?;
        self.words_table(out)
    }

    fn words_table(&self, out: &mut impl Write) -> Result<(), Failure> {
        writeln!(out, "{:>9} {:>16} {:>14}", "word bits", "behind the point", "drift, steps")?;
        let compared = self.compared()?;
        for run in compared {
            let word = run.word();
            writeln!(
                out,
                "{:>9} {:>16} {:>14.6}{}",
                word.bits,
                word.fraction_bits,
                run.greatest.steps,
                if run.greatest.steps <= DRIFT_MAX_STEPS { "" } else { "  more than half a step" }
            )?;
        }
        match least_word(compared) {
            Some(word) => writeln!(
                out,
                "least     {} bits, {} behind the point, stay within half a step",
                word.bits, word.fraction_bits
            )?,
            None => writeln!(out, "least     no word compared stays within half a step")?,
        }
        Ok(())
    }

    /// Runs the program with one word; each segment's greatest drift and the one at its end.
    fn each_row(
        &self,
        runs: &mut Runs,
        mut row: impl FnMut(&Equations, f64, f64) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        each_segment(self.program, self.constants, |piece| {
            let mut most = 0.0_f64;
            let mut end = 0.0;
            runs.segment(piece, |_, runs| {
                end = magnitude(&runs[0].last_steps);
                most = most.max(end);
            });
            row(piece, most, end)
        })
    }

    fn document(&self, out: &mut impl Write) -> Result<(), Failure> {
        let axes = self.axes();
        let mut segments = Vec::new();
        let mut jumps = Jumps::default();
        let mut runs = self.runs(&[self.word]);
        self.each_row(&mut runs, |piece, most, end| {
            jumps.take(piece, self.program);
            segments.push(json!({
                "line": piece.segment.line,
                "type": if piece.turn.is_some() { "arc" } else { "line" },
                "ticks": piece.ticks,
                "feed_mm_min": six_digits(60.0 * piece.speed_mm_s(&self.program.machine)),
                "constants": constants(piece, &axes),
                "drift_max_steps": six_digits(most),
                "drift_end_steps": six_digits(end),
            }));
            Ok(())
        })?;
        let compared = self.compared()?;
        let by_word: Vec<Value> = compared
            .iter()
            .map(|run| {
                json!({"word_bits": run.word().bits, "fraction_bits": run.word().fraction_bits,
                       "drift_max_steps": six_digits(run.greatest.steps)})
            })
            .collect();
        let (greatest, last) = match runs.runs().first() {
            Some(run) => (run.greatest, run.last_steps),
            None => Default::default(),
        };
        let ends: Map<String, Value> =
            axes.iter().map(|axis| (axis.to_string(), json!(six_digits(last[*axis])))).collect();
        let document = json!({
            "schema": 1,
            "method": "b",
            "tick_us": self.program.machine.bus.tick_us,
            "ticks": self.needs.ticks,
            "word_bits": self.word.bits,
            "fraction_bits": self.word.fraction_bits,
            "constant_bits": self.word.constant_bits,
            "constants": match self.constants { Constants::Exact => "exact", Constants::SmallAngle => "small-angle" },
            "rounding": match self.word.rounding { Rounding::Nearest => "nearest", Rounding::Down => "down" },
            "drift_max_steps": six_digits(greatest.steps),
            "worst": (greatest.tick > 0).then(|| json!({"tick": greatest.tick, "line": greatest.line})),
            "drift_end_steps": ends,
            "speed_jump_max": jumps.greatest.map(|(axis, jump_mm_s, line)| {
                json!({"axis": axis.to_string(), "mm_s": six_digits(jump_mm_s), "line": line})
            }),
            "least_word_bits": least_word(compared).map(|word| word.bits),
            "by_word": by_word,
            "segments": segments,
        });
        Ok(writeln!(out, "{document}")?)
    }

    /// Drift against time, of the least word that stays within half a step and of others.
    fn chart(&self) -> Result<Chart, Failure> {
        let least = least_word(self.compared()?).or(self.words.last().copied());
        let least_bits = least.map_or(self.word.bits, |word| word.bits);
        let shown = [4, 2, 1, 0, -2, -6].map(|less| i64::from(least_bits) - less);
        let words: Vec<Word> = self
            .words
            .iter()
            .copied()
            .filter(|word| shown.contains(&i64::from(word.bits)))
            .collect();
        let stretch = self.needs.ticks.div_ceil(POINTS).max(1);
        let tick_s = self.program.machine.bus.tick_s();
        let mut points: Vec<Vec<[f64; 2]>> = vec![Vec::new(); words.len()];
        let mut most = vec![0.0_f64; words.len()];
        let mut runs = self.runs(&words);
        each_segment(self.program, self.constants, |piece| {
            runs.segment(piece, |tick, runs| {
                for (most, run) in most.iter_mut().zip(runs) {
                    *most = most.max(magnitude(&run.last_steps));
                }
                if tick % stretch == 0 || tick == self.needs.ticks {
                    for (points, most) in points.iter_mut().zip(&mut most) {
                        let shown = Some(std::mem::take(most)).filter(|most| *most >= DRAWN_STEPS);
                        points.push([tick as f64 * tick_s, shown.unwrap_or(f64::NAN)]);
                    }
                }
            });
            Ok(())
        })?;
        let curves = words.iter().zip(points).enumerate().map(|(colour, (word, points))| Curve {
            name: format!("{} bits, {} behind the point", word.bits, word.fraction_bits),
            colour,
            points,
        });
        Ok(Chart {
            title: format!("Method B: drift off the path, {}", self.program.source.file_name()),
            size: Size::default(),
            x: Scale::linear("time, s"),
            y: Scale::logarithmic("greatest drift of an axis, steps"),
            curves: curves.collect(),
            limits: vec![Limit {
                name: "half a step".to_owned(),
                along: Along::Y,
                at: DRIFT_MAX_STEPS,
            }],
        })
    }
}

/// The greatest change of an axis's speed from one tick to the next.
#[derive(Default)]
struct Jumps {
    before: Option<Equations>,
    greatest: Option<(Axis, f64, u32)>,
}

impl Jumps {
    fn take(&mut self, piece: &Equations, program: &Program) {
        let jump_mm_s = jump(self.before.as_ref(), piece, &program.machine);
        for axis in Axis::ALL {
            if jump_mm_s[axis] > self.greatest.map_or(1e-6, |(_, greatest, _)| greatest) {
                self.greatest = Some((axis, jump_mm_s[axis], piece.segment.line));
            }
        }
        self.before = Some(piece.clone());
    }
}

fn each_segment(
    program: &Program,
    constants: Constants,
    mut take: impl FnMut(&Equations) -> Result<(), Failure>,
) -> Result<(), Failure> {
    for item in program.path() {
        let item =
            item.map_err(|error| anyhow!(error).context("the program changed while it was read"))?;
        if let PathItem::Segment(segment) = item {
            equations(&segment, &program.machine, constants).iter().try_for_each(&mut take)?;
        }
    }
    Ok(())
}

fn magnitude(steps: &AxisMap<f64>) -> f64 {
    steps.0.iter().fold(0.0, |most, steps| most.max(steps.abs()))
}

/// Why a word cannot hold a program.
fn refusal(needs: &Needs, bits: u32, fraction_bits: u32) -> String {
    let range = needs.range;
    let need = range.position_bits();
    let has = match bits.checked_sub(1 + fraction_bits) {
        Some(whole) => format!("{whole} for whole steps, up to {}", (1_u64 << whole) - 1),
        None => "none for whole steps".to_owned(),
    };
    format!(
        "line {}: a position of {:.0} steps needs {need} bits before the point, and a word of {bits} \
         bits with {fraction_bits} behind it has {has}; --word-bits {} is the least",
        range.line,
        range.steps_max,
        1 + need + fraction_bits
    )
}

fn rounding(rounding: Rounding) -> &'static str {
    match rounding {
        Rounding::Nearest => "rounded to the nearest",
        Rounding::Down => "further bits are dropped",
    }
}

/// The equations of a segment in a line. Their x and y are those of the plane, or X and Y.
fn told(piece: &Equations, axes: &[Axis]) -> String {
    let mut text = String::new();
    let mut turned = [None; 2];
    if let Some(turn) = piece.turn {
        let ([x, y], [a, b, c, d]) = (turn.plane.axes(), turn.constants);
        turned = [Some(x), Some(y)];
        text = format!("{x}{y} A={a:.9} B={b:.9} C={c:.9} D={d:.9}");
    }
    for axis in axes.iter().filter(|axis| !turned.contains(&Some(**axis))) {
        let way = piece.way_steps[*axis] + 0.0;
        if way != 0.0 || piece.turn.is_none() {
            let names = match axis {
                Axis::X => "E=1 F",
                Axis::Y => "G=1 H",
                _ => "1",
            };
            let gap = if text.is_empty() { "" } else { "  " };
            text += &match names {
                "1" => format!("{gap}{axis} {way:+.6}"),
                names => format!("{gap}{axis} {names}={way:.6}"),
            };
        }
    }
    text
}

/// The constants by their names in the seed; of further axes the way a tick.
fn constants(piece: &Equations, axes: &[Axis]) -> Value {
    let mut object = Map::new();
    let turned = if let Some(turn) = piece.turn {
        let names = ["A", "B", "C", "D"].into_iter().zip(turn.constants);
        object.extend(names.map(|(name, constant)| (name.to_owned(), json!(constant))));
        let center = turn.plane.axes().into_iter().zip(turn.center_steps);
        let center: Map<String, Value> =
            center.map(|(axis, steps)| (axis.to_string(), json!(six_digits(steps)))).collect();
        object.insert("center_steps".to_owned(), Value::Object(center));
        turn.plane.axes()
    } else {
        object.insert("E".to_owned(), json!(1));
        object.insert("F".to_owned(), json!(piece.way_steps[Axis::X]));
        object.insert("G".to_owned(), json!(1));
        object.insert("H".to_owned(), json!(piece.way_steps[Axis::Y]));
        [Axis::X, Axis::Y]
    };
    let others = axes.iter().filter(|axis| !turned.contains(axis));
    let others: Map<String, Value> =
        others.map(|axis| (axis.to_string(), json!(piece.way_steps[*axis]))).collect();
    object.insert("way_steps".to_owned(), Value::Object(others));
    Value::Object(object)
}
