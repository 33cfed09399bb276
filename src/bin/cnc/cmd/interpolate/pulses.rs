//! `--method pulse`: what a pulse-by-pulse interpolator makes of each block, beside the ticks of this
//! program's own.

use std::cell::RefCell;
use std::io::{self, BufWriter, Write};
use std::path::PathBuf;
use std::rc::Rc;

use anyhow::{Context, anyhow};
use cnc::base::rounding::six_digits;
use cnc::base::{Axis, AxisMap, Command};
use cnc::interp::RunError;
use cnc::path::{PathItem, Segment};
use cnc::plot::{Chart, Curve, Scale, Size};
use cnc::step::Summary;
use cnc::systems::pulse::{Interpolator, Made, count};
use serde_json::{Map, Value, json};

use crate::exit::{Exit, ExitWith, Failure, Outcome};
use crate::output;
use crate::program::Program;

/// The drawing has so many points; each is the greatest error of its stretch.
const POINTS: u64 = 600;

/// What one interpolator comes to over the program.
struct Whole {
    axis_pulses: AxisMap<u64>,
    error_pulses: f64,
}

/// Writes a table or a document, and the drawing.
pub fn report(program: &Program, as_json: bool, svg: Option<&PathBuf>) -> Outcome {
    let mut pulses = 0;
    for segment in segments(program) {
        match count(&*segment?, &program.machine) {
            Ok(count) => pulses += u64::from(count.pulses),
            Err(reason) => {
                return Err(anyhow!("{}: {reason}", program.source.name())).or_bad_input();
            }
        }
    }
    if let Some(path) = svg {
        let chart = chart(program, pulses)?;
        output::whole_file(path, |out| Ok(write!(out, "{chart}")?))?;
    }
    let mut out = BufWriter::new(io::stdout().lock());
    if as_json {
        document(&mut out, program)?;
    } else {
        table(&mut out, program)?;
    }
    out.flush()?;
    Ok(Exit::Ok)
}

fn segments(program: &Program) -> impl Iterator<Item = Result<Rc<Segment>, Failure>> {
    program.path().filter_map(|item| match item {
        Ok(PathItem::Segment(segment)) => Some(Ok(segment)),
        Ok(PathItem::Event(_)) => None,
        Err(error) => Some(Err(changed(error))),
    })
}

fn changed(error: RunError) -> Failure {
    anyhow!(error).context("the program changed while it was read").into()
}

/// Runs the pulses of the program, segment by segment.
fn each_segment(
    program: &Program,
    mut at_pulse: impl FnMut(f64),
    mut take: impl FnMut(&Segment, u32, &Made) -> Result<(), Failure>,
) -> Result<Whole, Failure> {
    let machine = &program.machine;
    let mut pulses = Interpolator::new(machine, machine.nearest_steps(&program.start_mm()));
    let mut whole = Whole { axis_pulses: AxisMap::default(), error_pulses: 0.0 };
    for segment in segments(program) {
        let segment = segment?;
        let counted = count(&segment, machine)?;
        let made = pulses.run(&segment, &mut at_pulse)?;
        for axis in Axis::ALL {
            whole.axis_pulses[axis] += made.axis_pulses[axis];
        }
        whole.error_pulses = whole.error_pulses.max(made.error_pulses);
        take(&segment, counted.pulses, &made)?;
    }
    Ok(whole)
}

/// The same program by ticks: the pulses of its counts, and the contour error of tick points and chords.
fn by_ticks(program: &Program) -> Result<(Whole, u64), Failure> {
    let machine = &program.machine;
    let mut axis_pulses = AxisMap::default();
    let summary = RefCell::new(Summary::default());
    for command in program.commands(&summary).map_err(changed)? {
        if let Command::Tick(tick) = command.map_err(changed)? {
            for (sum, count) in axis_pulses.0.iter_mut().zip(tick.counts.0) {
                *sum += u64::from(count.unsigned_abs());
            }
        }
    }
    let report = program
        .verified(None, None)
        .context("the ticks cannot be held against the path")
        .or_bad_input()?;
    let linear = machine.axes.iter().filter(|profile| Axis::LINEAR.contains(&profile.axis));
    let coarsest = linear.map(|profile| profile.steps_per_mm).fold(f64::INFINITY, f64::min);
    let error_pulses = report.max_contour_error_mm * coarsest;
    Ok((Whole { axis_pulses, error_pulses }, report.ticks))
}

fn table(out: &mut impl Write, program: &Program) -> Result<(), Failure> {
    let axes: Vec<Axis> = super::axes(program).collect();
    writeln!(out, "program   {}", program.source.name())?;
    writeln!(out, "machine   {}", program.machine)?;
    writeln!(out, "method    pulse by pulse: the leading axis moves at each")?;
    writeln!(out)?;
    write!(out, "{:>7} {:>10} {:>10}", "line", "FP", "made")?;
    axes.iter().try_for_each(|axis| write!(out, " {:>10}", axis.letter()))?;
    writeln!(out, "  error, pulses")?;
    let whole = each_segment(
        program,
        |_| {},
        |segment, counted, made| {
            write!(out, "{:>7} {counted:>10} {:>10}", segment.line, made.pulses)?;
            axes.iter().try_for_each(|axis| write!(out, " {:>10}", made.axis_pulses[*axis]))?;
            Ok(writeln!(out, "  {:>13.3}", made.error_pulses)?)
        },
    )?;
    let (ours, ticks) = by_ticks(program)?;
    writeln!(out)?;
    for (name, whole) in [("pulses", &whole), ("ticks", &ours)] {
        write!(out, "{:<28} ", format!("by {name}"))?;
        axes.iter().try_for_each(|axis| write!(out, " {:>10}", whole.axis_pulses[*axis]))?;
        writeln!(out, "  {:>13.3}", whole.error_pulses)?;
    }
    Ok(writeln!(
        out,
        "ticks: {ticks} of {} µs, with ramps; their error is that of the chords between them",
        program.machine.bus.tick_us
    )?)
}

fn document(out: &mut impl Write, program: &Program) -> Result<(), Failure> {
    let axes: Vec<Axis> = super::axes(program).collect();
    let pulses_of = |sums: &AxisMap<u64>| {
        let each = axes.iter().map(|axis| (axis.to_string(), json!(sums[*axis])));
        Value::Object(each.collect::<Map<String, Value>>())
    };
    let mut blocks = Vec::new();
    let whole = each_segment(
        program,
        |_| {},
        |segment, counted, made| {
            blocks.push(json!({
                "line": segment.line,
                "fp": counted,
                "made": made.pulses,
                "axis_pulses": pulses_of(&made.axis_pulses),
                "error_pulses": six_digits(made.error_pulses),
            }));
            Ok(())
        },
    )?;
    let (ours, ticks) = by_ticks(program)?;
    let sum = |whole: &Whole| {
        json!({"axis_pulses": pulses_of(&whole.axis_pulses),
               "error_pulses": six_digits(whole.error_pulses)})
    };
    let mut by_ticks = sum(&ours);
    by_ticks["ticks"] = json!(ticks);
    let document = json!({"schema": 1, "method": "pulse", "blocks": blocks,
                          "by_pulses": sum(&whole), "by_ticks": by_ticks});
    Ok(writeln!(out, "{document}")?)
}

/// The error after each pulse, over the program.
fn chart(program: &Program, pulses: u64) -> Result<Chart, Failure> {
    let stretch = pulses.div_ceil(POINTS).max(1);
    let (mut done, mut most, mut points) = (0_u64, 0.0_f64, Vec::new());
    let at_pulse = |error: f64| {
        done += 1;
        most = most.max(error);
        if done.is_multiple_of(stretch) {
            points.push([done as f64, std::mem::take(&mut most)]);
        }
    };
    each_segment(program, at_pulse, |_, _, _| Ok(()))?;
    Ok(Chart {
        title: format!("Pulse by pulse: distance from the curve, {}", program.source.file_name()),
        size: Size::default(),
        x: Scale::linear("interpolation pulses"),
        y: Scale::linear("distance from the curve, pulses").over([0.0, 1.0]),
        curves: vec![Curve { name: String::new(), colour: 0, points }],
        limits: Vec::new(),
    })
}
