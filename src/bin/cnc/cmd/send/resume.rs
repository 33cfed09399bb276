//! A job that was cut short → one that goes on with it from its last seam.
//!
//! Up to the safe height, over, tool, spindle and coolant as they were, down, and the buffers that are
//! left, which are those of the same plan. Nothing of a buffer that was begun is taken for done: its
//! cuts are made once more.

use std::convert::Infallible;
use std::path::Path;

use anyhow::{Context, anyhow};
use cnc::base::{Axis, AxisMap, Event, Machine, Point};
use cnc::path::{Corner, Curve, PathItem, Segment};
use cnc::plan::{self, Feed};
use cnc::step;
use cnc::wire::{InForce, Job, Step};
use cnc::wire_io::journal::{self, JobRecord, Journal, PastJob, Resumed};

use super::gather;
use crate::exit::{ExitWith, Failure};
use crate::input::Start;
use crate::program::Program;

/// The share of Z's greatest speed at which the tool comes back to the work.
const DOWN_SHARE: f64 = 0.25;

/// What the journal of a job lets be gone on with.
pub struct Resume {
    past: PastJob,
}

/// Where the last job of a journal was planned from, if not from the work zero.
pub fn start(journal: &Path) -> Result<Option<Start>, Failure> {
    let history = Journal::read(journal)?;
    let mut options = history.last_sent().into_iter().flat_map(|past| &past.job.options);
    let start = options.find_map(|option| option.strip_prefix("start="));
    let start = start.map(|start| start.parse().map_err(|error: String| anyhow!(error)));
    start.transpose().or_bad_input()
}

/// A job that goes on, and what it does, for a person to read.
pub struct Plan {
    pub job: Job,
    pub resumed: Resumed,
    pub told: Vec<String>,
}

impl Resume {
    /// The last job of a journal, if it is the same as this one and has not been done.
    pub fn of(journal: &Path, job: &JobRecord, machine: &Machine) -> Result<Resume, Failure> {
        let history = Journal::read(journal)?;
        let name = journal.display();
        let past = history.last_sent();
        let past = past.with_context(|| format!("{name} tells of no job")).or_bad_input()?;
        let hashes = |job: &JobRecord| -> Vec<String> {
            job.inputs.iter().map(|input| input.sha256.clone()).collect()
        };
        let was = &past.job;
        let other = [
            ("another program", was.program.sha256 == job.program.sha256),
            ("other files of subprograms or tools", hashes(was) == hashes(job)),
            ("other options", was.options == job.options),
            ("another machine", was.machine.sha256 == job.machine.sha256),
            ("another plan", was.plan_sha256 == job.plan_sha256),
        ];
        if let Some((what, _)) = other.into_iter().find(|(_, same)| !same) {
            return Err(anyhow!("{name} tells of a job with {what}: it cannot be gone on with"))
                .or_bad_input();
        }
        let is_lathe = was.options.iter().any(|option| option.starts_with("dialect=fanuc-lathe"));
        if is_lathe || Axis::LINEAR.iter().any(|axis| machine.axis(*axis).is_none()) {
            return Err(anyhow!("a lathe's way back to the work is not up, over and down"))
                .or_bad_input();
        }
        if past.end.as_ref().is_some_and(|end| end.result == "done") {
            return Err(anyhow!("{name} tells of a job that is done")).or_bad_input();
        }
        Ok(Resume { past: past.clone() })
    }

    /// The job from where the machine stands; refused where the tool cannot be put back, as far as the
    /// program, if it is at hand, tells that.
    pub fn plan(
        &self,
        whole: &Job,
        stands: AxisMap<i64>,
        machine: &Machine,
        program: Option<&Program>,
    ) -> Result<Plan, Failure> {
        let rest = rest(whole, self.past.steps, stands, machine)?;
        let mut told = self.told(whole, &rest, machine);
        match program {
            Some(program) => check_free(&rest, program)?,
            None if rest.done > 0 => told.push(format!(
                "a dump does not tell what line {} does: see to it that the tool is in no thread there",
                rest.line
            )),
            None => {}
        }
        let start_steps = journal::steps_of(whole.axes.iter(), &whole.start_steps);
        let resumed = Resumed { done: rest.done, approach: rest.approach, start_steps };
        Ok(Plan { job: rest.job, resumed, told })
    }

    fn told(&self, whole: &Job, rest: &Rest, machine: &Machine) -> Vec<String> {
        let PastJob { job, ticks, line, end, .. } = &self.past;
        let how = end.as_ref().map_or("cut off", |end| end.result.as_str());
        let [above, over, to] = rest.way;
        let done = whole.ticks - rest.ticks;
        let axes = machine.axes.iter().map(|profile| profile.axis).filter(|axis| *axis != Axis::Z);
        let over: Vec<_> = axes.map(|axis| format!("{axis} to {:.3}", over[axis])).collect();
        let mut told = vec![
            format!(
                "{} of {}, {how} after {ticks} ticks in line {line}",
                job.program.name, job.time
            ),
            format!("goes on from its last seam, behind tick {done} of {}:", whole.ticks),
            format!("Z to {:.3}, the safe height", above[Axis::Z]),
            over.join(", "),
        ];
        told.extend(rest.now.events().map(|event| format!("{} (line {})", event.kind, event.line)));
        told.push(format!("Z down to {:.3}", to[Axis::Z]));
        told.push(match rest.ticks {
            0 => "then there is nothing left".to_owned(),
            ticks => format!("then the {ticks} ticks that are left, from line {}", rest.line),
        });
        for Event { line, kind } in rest.now.others() {
            told.push(format!("NOT restored: {kind} (line {line}); see to it yourself"));
        }
        told
    }
}

/// What is left of a job, with the way there.
pub struct Rest {
    pub job: Job,
    /// Steps of the whole job that are done.
    done: usize,
    /// Steps that lead to where it goes on.
    approach: usize,
    /// Up, over, and where it goes on.
    way: [Point; 3],
    /// What functions have brought about by then.
    now: InForce,
    /// The last line of what is done, and the first of what is left; 0 if there is none.
    lines: [u32; 2],
    line: u32,
    /// Ticks that are left.
    ticks: u64,
}

/// What is left of a job after so many of its steps, from where the machine stands.
pub fn rest(
    whole: &Job,
    done: usize,
    stands: AxisMap<i64>,
    machine: &Machine,
) -> Result<Rest, Failure> {
    let done = done.min(whole.steps.len());
    let left = whole.after(done, machine);
    let now = InForce::after(whole.steps[..done].iter().flat_map(events));
    let (from, to) = (machine.position_mm(&stands), left.start_mm);
    let line = left.steps.iter().find_map(first_line).unwrap_or(0);
    let last = whole.steps[..done].iter().rev().find_map(last_line).unwrap_or(0);
    let mut above = from;
    above[Axis::Z] = safe_mm(whole, &from, machine);
    let mut over = to;
    over[Axis::Z] = above[Axis::Z];
    let down_mm_s = machine.axis(Axis::Z).map(|z| z.speed_max_mm_s * DOWN_SHARE);
    let lead = Lead { machine, line };
    let up = lead.job(&[(from, above, None), (above, over, None)], stands)?;
    let restored = Job::of_events(now.events().cloned(), up.end_steps, machine);
    let down = lead.job(&[(over, to, down_mm_s)], up.end_steps)?;
    let approach = up.followed_by(restored, machine).followed_by(down, machine);
    Ok(Rest {
        done,
        approach: approach.steps.len(),
        way: [above, over, to],
        now,
        lines: [last, line],
        line,
        ticks: left.ticks,
        job: approach.followed_by(left, machine),
    })
}

/// Refuses to put a tool back into a thread, or behind an edge.
fn check_free(rest: &Rest, program: &Program) -> Result<(), Failure> {
    if rest.done > 0 && program.is_captive(&rest.lines, &rest.way[2])? {
        let line = rest.line;
        return Err(anyhow!(
            "the last seam lies in line {line}, where the tool is in a thread, in a tapped hole or behind an \
             edge: it cannot be put back there from above; send what is left as a program of its own"
        ))
        .or_bad_input();
    }
    Ok(())
}

fn events(step: &Step) -> Vec<&Event> {
    match step {
        Step::Buffer(buffer) => buffer.events.iter().map(|(_, event)| event).collect(),
        Step::Event(event) => vec![event],
        Step::Direct(_) => Vec::new(),
    }
}

fn first_line(step: &Step) -> Option<u32> {
    match step {
        Step::Buffer(buffer) => buffer.lines.first().copied(),
        Step::Event(event) => Some(event.line),
        Step::Direct(_) => None,
    }
}

fn last_line(step: &Step) -> Option<u32> {
    match step {
        Step::Buffer(buffer) => buffer.lines.last().copied(),
        Step::Event(event) => Some(event.line),
        Step::Direct(_) => None,
    }
}

/// The top of Z's travel, or without one the greatest Z of the job and of where the machine stands.
fn safe_mm(whole: &Job, from: &Point, machine: &Machine) -> f64 {
    let travel = machine.axis(Axis::Z).and_then(|z| z.travel_mm);
    let of_job = whole.extents_mm[Axis::Z].map_or(whole.start_mm[Axis::Z], |[_, high]| high);
    travel.map_or(of_job.max(from[Axis::Z]), |[_, high]| high)
}

/// Plans the way to where the job goes on.
struct Lead<'m> {
    machine: &'m Machine,
    line: u32,
}

impl Lead<'_> {
    /// Straight moves, each to rest: from, to, and how fast if not as fast as can be.
    fn job(
        &self,
        moves: &[(Point, Point, Option<f64>)],
        start_steps: AxisMap<i64>,
    ) -> Result<Job, Failure> {
        let segment = |(from_mm, to_mm, feed_mm_s): &(Point, Point, Option<f64>)| Segment {
            line: self.line,
            feed_mm_s: *feed_mm_s,
            from_mm: *from_mm,
            to_mm: *to_mm,
            curve: Curve::Line,
            corner: Corner::Stop,
        };
        let moves = moves.iter().filter(|(from, to, _)| from != to);
        let way: Vec<Segment> = moves.map(segment).collect();
        let Some(start_mm) = way.first().map(|segment| segment.from_mm) else {
            return Ok(Job::of_steps(Vec::new(), start_steps, self.machine));
        };
        let path = || way.iter().cloned().map(|s| Ok::<_, Infallible>(PathItem::from(s)));
        let seams = plan::place(path, self.machine, Feed::LookAhead)?;
        let plan = plan::plan(path(), self.machine, Feed::LookAhead, &seams, start_mm);
        let commands = step::interpolate(plan, self.machine, start_mm);
        gather(commands, start_steps, self.machine)?.or_bad_input()
    }
}
