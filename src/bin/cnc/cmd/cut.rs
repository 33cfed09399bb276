//! `cnc cut`: what each feed of a program asks of the spindle, and the feed that it could give.

mod table;

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use cnc::base::likeness::nearest;
use cnc::base::machine::Spindle;
use cnc::base::source::small_text;
use cnc::base::{Axis, EventKind};
use cnc::path::{PathItem, Segment};
use cnc::systems::axes_speed_mm_s;
use cnc::systems::cutting::table::{Entry, MATERIALS, TOOLS, entry, names};
use cnc::systems::cutting::{Cut, Load, Material, Tool};

use crate::args::Global;
use crate::exit::{Exit, ExitWith, Failure, Outcome, unless_unread};
use crate::input::TABLE_MIB_MAX;
use crate::program::{FeedMode, MotionArgs, Program};

/// Hold the feeds of a program against the power of the spindle
#[derive(Debug, clap::Args)]
pub struct Args {
    /// NC program; - is standard input
    file: PathBuf,
    /// The mill: a built-in name, a TOML file, or FILE:NAME where the file has several
    #[arg(long, value_name = "NAME|FILE")]
    tool: String,
    /// What is cut: a built-in name, a TOML file, or FILE:NAME
    #[arg(long, value_name = "NAME|FILE")]
    material: String,
    /// Depth of cut along the tool's axis, in mm [default: the tool's]
    #[arg(long, value_name = "MM", value_parser = positive)]
    depth: Option<f64>,
    /// Width of cut across the feed, in mm [default: the tool's]
    #[arg(long, value_name = "MM", value_parser = positive)]
    width: Option<f64>,
    /// Turns a minute where the program does not turn the spindle
    #[arg(long, value_name = "N", value_parser = positive)]
    rpm: Option<f64>,
    #[command(flatten)]
    motion: MotionArgs,
}

fn positive(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number: &f64| *number > 0.0 && number.is_finite());
    number.ok_or_else(|| "a number above 0 is expected".to_owned())
}

pub fn run(args: &Args, global: &Global) -> Outcome {
    if args.motion.feed != FeedMode::LookAhead {
        return Err(anyhow!("--feed plans speeds: here the feeds of the program count").into());
    }
    let (tool_name, tool) = named::<Tool>(&args.tool, TOOLS, "tool")?;
    let (material_name, material) = named::<Material>(&args.material, MATERIALS, "material")?;
    let program = Program::open(&args.file, &args.motion, global)?;
    let Some(spindle) = program.machine.spindle else {
        let id = &program.machine.id;
        return Err(anyhow!("the profile {id} has no [spindle]: its power is not known").into());
    };
    let cut = Cut::new(tool, material, args.depth, args.width, spindle.efficiency)?;
    let setup = Setup { tool_name, material_name, cut, spindle, rpm: args.rpm };
    let rows = rows(&program, &setup)?
        .map_err(|reason| anyhow!("{}: {reason}", program.source.name()))
        .or_bad_input()?;
    let mut out = BufWriter::new(io::stdout().lock());
    let written = if global.json {
        table::document(&mut out, &setup, &rows)
    } else {
        table::print(&mut out, &program, &setup, &rows)
    };
    unless_unread(written.and_then(|()| out.flush()))?;
    let is_over = rows.iter().any(|row| row.is_over(&spindle));
    Ok(if is_over { Exit::BadInput } else { Exit::Ok })
}

/// Finds an entry by a built-in name, in a file, or by its name in a file.
fn named<T: Entry>(name: &str, built_in: &str, what: &str) -> Result<(String, T), Failure> {
    let known = names(built_in);
    if known.iter().any(|known| known == name) {
        return Ok(entry(built_in, Some(name))?);
    }
    let (file, section) = match name.rsplit_once(':') {
        Some((file, section)) if !Path::new(name).exists() => (file, Some(section)),
        _ => (name, None),
    };
    if section.is_none() && !Path::new(file).exists() {
        let near = nearest(name, known.iter().map(|known| known.as_ref()));
        let meant = near.map(|near| format!(" (did you mean '{near}'?)")).unwrap_or_default();
        let known = known.join(", ");
        return Err(anyhow!(
            "there is no {what} '{name}'{meant}: built in are {known}, else it is a file"
        )
        .into());
    }
    let text =
        small_text(Path::new(file), TABLE_MIB_MAX).with_context(|| format!("{what} {file}"))?;
    Ok(entry(&text, section).with_context(|| format!("{what} {file}"))?)
}

/// What cuts what, driven by what.
struct Setup {
    tool_name: String,
    material_name: String,
    cut: Cut,
    spindle: Spindle,
    /// Turns a minute where the program has none.
    rpm: Option<f64>,
}

/// Moves one after the other that ask for the same.
#[derive(Clone, Debug, PartialEq)]
struct Row {
    /// First and last line.
    lines: [u32; 2],
    moves: u64,
    way_mm: f64,
    kind: Kind,
}

/// What moves are to the tool.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    /// They cut with the side of the mill.
    Side(Side),
    /// They go down or up along its axis: the equations are none of drilling.
    Axial,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Side {
    rpm: f64,
    /// At the feed that the program asks for.
    asked: Load,
    /// At the greatest feed that the axes can do, if that is less.
    reached: Option<Load>,
    /// The feed that takes all of the spindle's power.
    fits_mm_min: f64,
}

impl Side {
    /// What the cut really comes to.
    fn load(&self) -> Load {
        self.reached.unwrap_or(self.asked)
    }
}

impl Row {
    fn side(&self) -> Option<&Side> {
        match &self.kind {
            Kind::Side(side) => Some(side),
            Kind::Axial => None,
        }
    }

    fn is_over(&self, spindle: &Spindle) -> bool {
        self.side().is_some_and(|side| side.load().power_kw > spindle.power_kw)
    }
}

/// The spindle, as the program has turned it so far.
#[derive(Default)]
struct Turning {
    is_on: bool,
    rpm: Option<f64>,
}

impl Turning {
    fn event(&mut self, kind: EventKind) {
        match kind {
            EventKind::M { code: 3 | 4, spindle_rpm, .. } => {
                self.is_on = true;
                self.rpm = spindle_rpm.or(self.rpm);
            }
            EventKind::M { code: 2 | 5 | 30, .. } => self.is_on = false,
            EventKind::S(rpm) => self.rpm = Some(rpm),
            EventKind::SurfaceSpeed { .. } => self.rpm = None,
            _ => {}
        }
    }

    /// Turns a minute, no more than the spindle can.
    fn turns(&self, setup: &Setup) -> Option<f64> {
        let rpm = self.rpm.filter(|rpm| self.is_on && *rpm > 0.0).or(setup.rpm)?;
        Some(rpm.min(f64::from(setup.spindle.speed_max_rpm)))
    }
}

/// What the program asks for; the inner error is one of the program.
fn rows(program: &Program, setup: &Setup) -> Result<Result<Vec<Row>, String>, Failure> {
    let mut rows: Vec<Row> = Vec::new();
    let mut turning = Turning::default();
    for item in program.path() {
        let item =
            item.map_err(|error| anyhow!(error).context("the program changed while it was read"))?;
        let segment = match item {
            PathItem::Event(event) => {
                turning.event(event.kind);
                continue;
            }
            PathItem::Segment(segment) => segment,
        };
        let Some(feed_mm_s) = segment.feed_mm_s else { continue };
        let kind = if is_axial(&segment) {
            Kind::Axial
        } else {
            let Some(rpm) = turning.turns(setup) else {
                return Ok(Err(format!(
                    "line {}: a cut with a spindle that does not turn, or at a speed that is not known: write M3 S, or give --rpm",
                    segment.line
                )));
            };
            Kind::Side(side(&segment, feed_mm_s, rpm, program, setup))
        };
        let (line, way_mm) = (segment.line, segment.length_mm());
        match rows.last_mut().filter(|row| row.kind == kind) {
            Some(row) => {
                row.lines = [row.lines[0].min(line), row.lines[1].max(line)];
                row.moves += 1;
                row.way_mm += way_mm;
            }
            None => rows.push(Row { lines: [line, line], moves: 1, way_mm, kind }),
        }
    }
    Ok(Ok(rows))
}

fn is_axial(segment: &Segment) -> bool {
    let across = [Axis::X, Axis::Y];
    segment.axis_speeds()[Axis::Z] > 0.0
        && across.iter().all(|axis| segment.axis_speeds()[*axis] <= 0.0)
}

fn side(segment: &Segment, feed_mm_s: f64, rpm: f64, program: &Program, setup: &Setup) -> Side {
    let axes_mm_s = axes_speed_mm_s(segment, &program.machine);
    let reached = (axes_mm_s < feed_mm_s).then(|| setup.cut.load(60.0 * axes_mm_s, rpm));
    let fits_mm_min = setup.cut.feed_for_mm_min(setup.spindle.power_kw, rpm);
    Side { rpm, asked: setup.cut.load(60.0 * feed_mm_s, rpm), reached, fits_mm_min }
}
