//! `cnc plot`: what a program or a dump looks like, and what the axes do over time, as SVG or PNG.

pub mod curves;
mod png;
pub mod timing;

use std::collections::BTreeMap;
use std::io::{self, BufRead, BufReader, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use clap::ValueEnum;
use cnc::base::{Axis, Command, Machine, Point, Source};
use cnc::plan::Planned;
use cnc::plot::{Mark, Place, Sheet, Stroke, Strokes, Traces, View};
use cnc::tape::Reader;

use crate::args::Global;
use crate::exit::{Exit, ExitWith, Failure, Outcome, unless_unread};
use crate::input;
use crate::meter::Pass;
use crate::output;
use crate::program::{MotionArgs, Program};
use crate::refusal;

/// NC lines that are told word by word at most.
const LINES_TOLD_MAX: usize = 1000;

/// Draw the path of a program or a dump, or what the axes do over time
#[derive(Debug, clap::Args)]
pub struct Args {
    /// NC program or command dump; - is standard input
    file: PathBuf,
    /// Where the drawing goes: SVG, or PNG if the name ends so [default: SVG on standard output]
    #[arg(short, long, value_name = "OUT")]
    output: Option<PathBuf>,
    /// From where the path is seen
    #[arg(long, value_enum, default_value_t, conflicts_with = "curve")]
    view: ViewArg,
    /// Draw a quantity over time instead of the path
    #[arg(long, value_enum, value_name = "QUANTITY")]
    curve: Option<CurveArg>,
    /// Draw the signals that `send --plc --signals` has recorded; FILE is that record
    #[arg(long, conflicts_with_all = ["view", "curve"])]
    timing: bool,
    /// Width of a PNG in dots
    #[arg(long, value_name = "DOTS", default_value_t = 1600, value_parser = clap::value_parser!(u32).range(100..=8000))]
    width: u32,
    #[command(flatten)]
    motion: MotionArgs,
}

#[derive(Clone, Copy, Debug, Default, ValueEnum)]
enum ViewArg {
    /// From above, from the front, from the side, and askew; of a lathe ZX alone, Z to the right
    #[default]
    All,
    /// From above
    Xy,
    /// From the side
    Yz,
    /// From the front
    Zx,
    /// Askew, with the whole travel
    Isometric,
}

/// What is drawn over time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum CurveArg {
    /// How far what is executed lies from the path
    Error,
    /// Speed of the axes and along the path
    Speed,
    /// Acceleration of the axes
    Acceleration,
    /// Steps a second of the motors
    Steps,
    /// How far from the path the seed's own encoder comes, and how far ours (seed 004, figure 6.7)
    Encoders,
}

/// A drawing, and how the command ends behind it.
struct Drawn {
    svg: String,
    exit: Exit,
}

pub fn run(args: &Args, global: &Global) -> Outcome {
    if global.json {
        let reason = "a drawing has no JSON; interpolate --json and verify --json have figures";
        return Err(anyhow!(reason).into());
    }
    output::check_writable(&[args.output.as_deref()])?;
    let source = input::source(&args.file)?;
    let is_png = args.output.as_deref().is_some_and(|file| ending(file).as_deref() == Some("png"));
    if !is_png {
        global.refuse(&["width"], "only a drawing in dots (.png) has one")?;
    }
    if args.timing {
        let why = "a record of signals is drawn as it is";
        global.refuse(&["machine"], why).and_then(|()| MotionArgs::refuse(global, why))?;
        let drawing = timing::of_record(&source).or_bad_input()?;
        write(args, &drawing.to_string())?;
        return Ok(Exit::Ok);
    }
    let drawn = if input::is_dump(&source)? {
        of_dump(args, source, global)?
    } else {
        of_program(args, source, global)?
    };
    write(args, &drawn.svg)?;
    Ok(drawn.exit)
}

fn write(args: &Args, svg: &str) -> Result<(), Failure> {
    let Some(file) = args.output.as_deref().filter(|file| *file != Path::new("-")) else {
        let mut out = io::stdout().lock();
        return Ok(unless_unread(out.write_all(svg.as_bytes()).and_then(|()| out.flush()))?);
    };
    let ending = ending(file);
    if ending.as_deref().is_some_and(|ending| !["svg", "png"].contains(&ending)) {
        let name = file.display();
        return Err(anyhow!("{name}: drawings are written as .svg or .png").into());
    }
    let is_png = ending.as_deref() == Some("png");
    let bytes = if is_png { png::of_svg(svg, args.width)? } else { svg.as_bytes().to_vec() };
    output::whole_file(file, |out| Ok(out.write_all(&bytes)?))
}

/// How a file's name ends, in small letters.
fn ending(file: &Path) -> Option<String> {
    file.extension().map(|ending| ending.to_string_lossy().to_lowercase())
}

/// A program that is wrong by nothing but its travel is drawn all the same.
fn of_program(args: &Args, source: Source, global: &Global) -> Result<Drawn, Failure> {
    let machine = input::machine(global)?;
    let travel_mm = travel_mm(&machine);
    let checked = Program::check(&args.file, source.clone(), machine.clone(), &args.motion, global);
    let (program, exit) = match checked {
        Ok(program) => (program, Exit::Ok),
        Err(failure) if args.curve.is_some() || !refusal::is_told(&failure.error) => {
            return Err(failure);
        }
        Err(refused) => {
            let program =
                Program::judge(&args.file, source, without_travel(machine), &args.motion, global)?;
            if program.checked.errors > 0 {
                return Err(refused);
            }
            (program, Exit::BadInput)
        }
    };
    let svg = match args.curve {
        Some(curve) => curves::of_program(curve, &program)?,
        None => {
            let views = views(args.view, program.is_turning());
            draw(&program, travel_mm, views, |sheet| sheet.to_string())?
        }
    };
    Ok(Drawn { svg, exit })
}

/// The machine, with ways that never end: for programs that leave its travel.
pub fn without_travel(mut machine: Machine) -> Machine {
    machine.axes.iter_mut().for_each(|axis| axis.travel_mm = None);
    machine
}

/// Draws the path of a program as it is planned, on a machine with this travel.
pub fn draw<D>(
    program: &Program,
    travel_mm: [Option<[f64; 2]>; 3],
    views: &[View],
    how: impl Fn(&Sheet<'_>) -> D,
) -> Result<D, Failure> {
    let mut strokes = Strokes::new(travel_mm);
    let (mut seams, mut at) = (Vec::new(), program.start_mm());
    for planned in program.plan()? {
        match planned? {
            Planned::Profile(profile) => {
                let is_cut = profile.segment.feed_mm_s.is_some();
                for (from, to, speed_mm_s) in profile.chords() {
                    let speed_mm_s = is_cut.then_some(speed_mm_s);
                    let line = profile.segment.line;
                    strokes.add(&Stroke { line, from_mm: xyz(&from), to_mm: xyz(&to), speed_mm_s });
                    at = to;
                }
            }
            Planned::Seam(kind) => {
                let text = format!("end of node buffer {}: {}", seams.len(), kind.name());
                seams.push(Mark { at_mm: xyz(&at), text });
            }
            Planned::Event(_) => {}
        }
    }
    let texts = match strokes.lines(LINES_TOLD_MAX) {
        Some(lines) if program.inputs.is_empty() => texts_of(&program.source, &lines)?,
        Some(_) | None => BTreeMap::new(),
    };
    Ok(how(&Sheet {
        title: format!("{} on {}", program.source.file_name(), program.machine.name),
        views,
        strokes: &strokes,
        knows_rapids: true,
        travel_mm,
        seams: &seams,
        wrong: outside(&strokes),
        texts: &texts,
    }))
}

/// Of a dump nobody knows which ticks are rapids: all are drawn by their speed.
fn of_dump(args: &Args, source: Source, global: &Global) -> Result<Drawn, Failure> {
    MotionArgs::refuse_for_dump(global)?;
    let machine = input::machine(global)?;
    let (name, file_name) = (source.name().to_owned(), source.file_name().to_owned());
    let reader = Reader::open(source).with_context(|| name.clone()).or_bad_input()?;
    let header = reader.header().clone();
    if header.machine.name != machine.id {
        let of = &header.machine.name;
        let reason =
            anyhow!("{name}: the dump was made for machine '{of}', not for '{}'", machine.id);
        return Err(reason).or_bad_input();
    }
    let pass = Pass::of_text("reading");
    let mut traces = Traces::new(&machine, header.tick_us, input::start_steps(&header, &machine));
    let mut strokes = Strokes::new(travel_mm(&machine));
    for command in reader {
        if let Command::Tick(tick) = command.with_context(|| name.clone()).or_bad_input()? {
            strokes.add(&traces.tick(&tick));
        }
    }
    drop(pass);
    let svg = match args.curve {
        Some(curve) => curves::of_dump(curve, &traces, &header.program.name)?,
        None => Sheet {
            title: format!("{file_name} (of {}) on {}", header.program.name, machine.name),
            views: views(args.view, machine.axis(Axis::Y).is_none()),
            strokes: &strokes,
            knows_rapids: false,
            travel_mm: travel_mm(&machine),
            seams: &[],
            wrong: outside(&strokes),
            texts: &BTreeMap::new(),
        }
        .to_string(),
    };
    let Some(wrong) = outside(&strokes) else { return Ok(Drawn { svg, exit: Exit::Ok }) };
    say!("error: {file_name}: {}", wrong.text);
    Ok(Drawn { svg, exit: Exit::BadInput })
}

/// The first place outside of the travel.
fn outside(strokes: &Strokes) -> Option<Mark> {
    let text = |line| format!("line {line} leaves the travel");
    strokes.outside().map(|(at_mm, line)| Mark { at_mm, text: text(line) })
}

/// The views asked for; a lathe shows one, as a turned part is drawn.
fn views(view: ViewArg, is_lathe: bool) -> &'static [View] {
    match view {
        ViewArg::All | ViewArg::Zx if is_lathe => &[View::Turning],
        ViewArg::All => &View::MILLING,
        ViewArg::Xy => &[View::Xy],
        ViewArg::Yz => &[View::Yz],
        ViewArg::Zx => &[View::Zx],
        ViewArg::Isometric => &[View::Isometric],
    }
}

/// All views of what a program does.
pub fn all_views(program: &Program) -> &'static [View] {
    views(ViewArg::All, program.is_turning())
}

fn xyz(point: &Point) -> Place {
    Axis::LINEAR.map(|axis| point[axis])
}

/// Travel of X, Y and Z.
pub fn travel_mm(machine: &Machine) -> [Option<[f64; 2]>; 3] {
    Axis::LINEAR.map(|axis| machine.axis(axis).and_then(|profile| profile.travel_mm))
}

/// The text of some lines of a program.
fn texts_of(
    source: &Source,
    lines: &std::collections::BTreeSet<u32>,
) -> io::Result<BTreeMap<u32, String>> {
    let mut texts = BTreeMap::new();
    let last = lines.last().copied().unwrap_or(0);
    let reader = BufReader::new(source.reader(0));
    for (number, text) in (1..=last).zip(reader.split(b'\n')) {
        let text = text?;
        if lines.contains(&number) {
            texts.insert(number, String::from_utf8_lossy(&text).trim_end().to_owned());
        }
    }
    Ok(texts)
}
