//! `--ring`: a virtual ring of SERCOS drives executes the program.

use std::cell::RefCell;
use std::io::{self, Write};
use std::path::Path;

use anyhow::{Context, anyhow};
use cnc::base::rounding::six_digits;
use cnc::base::{Axis, Command, Machine};
use cnc::interp::RunError;
use cnc::plan::Feed;
use cnc::step::Summary;
use cnc::systems::carry::{Interface, Setting, settable_s};
use cnc::systems::sercos::{Carried, Fault, Place, Slot, Strike, Traffic, on_ring, slots};
use cnc::verify::{self, Verdict};
use serde_json::{Value, json};

use super::{Args, meaningless};
use crate::args::Global;
use crate::exit::{Exit, ExitWith, Failure, Outcome};
use crate::input;
use crate::plural::count;
use crate::program::Program;

/// The shortest cycle that is a whole number of microseconds, as ticks are.
const CYCLE_LEAST_S: f64 = 125e-6;

/// What has come of the job on the ring.
#[derive(Clone, Debug, Default)]
struct Ran {
    /// Bits that were flipped.
    struck: Vec<Strike>,
    traffic: Traffic,
    fault: Option<Fault>,
    /// Ticks executed as planned, and others.
    ticks: [u64; 2],
    repeated: u64,
    /// Units that a drive was off at most, as the control has heard.
    deviation_max: u32,
}

/// Commands that drives execute; what came of it is left behind when they are over.
struct Executed<'a, I> {
    carried: Carried<I>,
    ran: &'a RefCell<Ran>,
}

impl<E, I: Iterator<Item = Result<Command, E>>> Iterator for Executed<'_, I> {
    type Item = Result<Command, E>;

    fn next(&mut self) -> Option<Self::Item> {
        let next = self.carried.next();
        if next.is_none() {
            let ring = self.carried.ring();
            self.ran.replace(Ran {
                struck: ring.struck().to_vec(),
                traffic: ring.traffic(),
                fault: self.carried.fault(),
                ticks: self.carried.as_planned(),
                repeated: ring.drives().iter().map(|drive| drive.repeated()).sum(),
                deviation_max: self.carried.deviation_max(),
            });
        }
        next
    }
}

/// The ring as it is set up.
struct Setup {
    axes: Vec<Axis>,
    setting: Setting,
    cycle_us: u32,
    slots: Vec<Slot>,
}

pub fn run(file: &Path, args: &Args, global: &Global) -> Outcome {
    let other = args.interfaces().into_iter().find(|other| *other != Interface::Sercos);
    if let Some(other) = other.filter(|_| !args.protocol.is_empty()) {
        return Err(meaningless("--ring", other, "it is no ring").into());
    }
    let machine = input::machine(global)?;
    let setup = Setup::new(args, &machine)?;
    let on_ring = on_ring(&machine, setup.cycle_us);
    let source = input::program(file)?;
    let program = Program::check(file, source, on_ring, &args.motion, global)?;
    check_range(&program, &setup).or_bad_input()?;
    let ran = RefCell::new(Ran::default());
    let report = executed(&program, args, &setup, &ran)?;
    let ran = ran.into_inner();
    if let Some(fault) = &ran.fault {
        say!("error: {fault}");
    } else {
        report.failures.iter().for_each(|failure| say!("error: {failure}"));
    }
    for strike in args.fault.iter().filter(|strike| !ran.struck.contains(strike)) {
        let cycles = count(ran.traffic.cycles, "cycle");
        say!(
            "warning: {strike} has not struck: the job took {cycles}, and telegrams differ in length"
        );
    }
    let mut out = io::stdout().lock();
    if global.json {
        writeln!(out, "{}", as_json(&program, &setup, &ran, &report))?;
    } else {
        print(&mut out, &program, &setup, &ran, &report)?;
    }
    let is_right = ran.fault.is_none() && report.verdict == Verdict::Pass;
    Ok(if is_right { Exit::Ok } else { Exit::Bus })
}

impl Setup {
    fn new(args: &Args, machine: &Machine) -> Result<Setup, Failure> {
        let axes: Vec<Axis> = machine.axes.iter().map(|profile| profile.axis).collect();
        let usual = args.usual(Interface::Sercos, machine);
        let one = |list: Option<&[u32]>| match list {
            None => Ok(usual.baud),
            Some([baud]) => Ok(*baud),
            Some(_) => Err(anyhow!("a ring has one baud rate")),
        };
        let baud = one(args.baud.as_ref().map(|list| list.0.as_slice()))?;
        let setting = Setting { nodes: axes.len() as u32, baud, ..usual };
        let asked_s = match args.frequency.as_ref().map(|list| list.0.as_slice()) {
            None => setting.carry().least_s.max(CYCLE_LEAST_S),
            Some([hz]) => 1.0 / hz,
            Some(_) => return Err(anyhow!("a ring has one frequency").into()),
        };
        let setting = Setting { period_s: asked_s, ..setting };
        setting.check().context("sercos cannot work").or_bad_input()?;
        let cycle_s = settable_s(asked_s);
        let cycle_us = (cycle_s * 1e6).round();
        if (cycle_s - asked_s).abs() > asked_s * 1e-6 || (cycle_us - cycle_s * 1e6).abs() > 1e-6 {
            return Err(anyhow!(
                "a cycle of {:.4} ms cannot be set; {:.4} ms can (--frequency {})",
                asked_s * 1e3,
                cycle_s.max(CYCLE_LEAST_S) * 1e3,
                1.0 / cycle_s.max(CYCLE_LEAST_S),
            ))
            .or_bad_input();
        }
        let setting = Setting { period_s: cycle_s, ..setting };
        let slots = slots(setting.nodes, baud);
        let is_there = |strike: &&Strike| slots.iter().any(|slot| slot.place == strike.place);
        if let Some(strike) = args.fault.iter().find(|strike| !is_there(strike)) {
            return Err(anyhow!(
                "there is no telegram {} on a ring of {}",
                strike.place,
                setting.nodes
            )
            .into());
        }
        if let Some(strike) =
            args.fault.iter().find(|strike| bits_most(&slots, strike.place, baud) <= strike.bit)
        {
            let bits = bits_most(&slots, strike.place, baud);
            return Err(anyhow!("{strike}: that telegram has at most {bits} bits")).or_bad_input();
        }
        Ok(Setup { axes, setting, cycle_us: cycle_us as u32, slots })
    }

    fn place(&self, place: Place) -> String {
        match place {
            Place::Drive(address) => self.axes[usize::from(address) - 1].to_string(),
            Place::Sync | Place::Control => place.to_string(),
        }
    }
}

/// Most bits of a telegram: those of its slot.
fn bits_most(slots: &[Slot], place: Place, baud: u32) -> usize {
    let slot = slots.iter().find(|slot| slot.place == place);
    slot.map_or(0, |slot| ((slot.to_s - slot.from_s) * f64::from(baud)).round() as usize)
}

/// Refuses what telegrams cannot tell: positions beyond 32 bits of 0.1 µm.
fn check_range(program: &Program, setup: &Setup) -> anyhow::Result<()> {
    let machine = &program.machine;
    for axis in &setup.axes {
        let [low, high] = program.checked.summary.extents_mm[*axis].unwrap_or_default();
        for reached_mm in [low, high, program.start_mm()[*axis]] {
            let mut place = program.start_mm();
            place[*axis] = reached_mm;
            if i32::try_from(machine.nearest_steps(&place)[*axis]).is_err() {
                return Err(anyhow!(
                    "{}: {axis} goes to {reached_mm} mm, beyond 32 bits of 0.1 µm: no telegram can tell that",
                    program.source.name()
                ));
            }
        }
    }
    Ok(())
}

/// Runs the job, and holds what the drives execute against the program's path.
fn executed(
    program: &Program,
    args: &Args,
    setup: &Setup,
    ran: &RefCell<Ran>,
) -> anyhow::Result<verify::Report> {
    let machine = &program.machine;
    let start_steps = machine.nearest_steps(&program.start_mm());
    let verify_setup = verify::Setup {
        machine,
        tick_us: setup.cycle_us,
        start_steps,
        constant_feed: program.feed() == Feed::Constant,
        with_events: true,
        with_buffers: false,
    };
    let summary = RefCell::new(Summary::default());
    let commands = || {
        let commands = program.commands(&summary)?;
        let carried = Carried::new(commands, &setup.axes, &start_steps, &args.fault);
        Ok::<_, RunError>(Executed { carried, ran })
    };
    Ok(verify::verify(&verify_setup, commands, || Ok::<_, RunError>(program.path()))?)
}

fn print(
    out: &mut impl Write,
    program: &Program,
    setup: &Setup,
    ran: &Ran,
    report: &verify::Report,
) -> io::Result<()> {
    let Setting { nodes, baud, .. } = setup.setting;
    let Traffic { cycles, bits, stuffed, bits_max, dropped } = ran.traffic;
    writeln!(out, "machine   {}", program.machine)?;
    let drives = count(nodes.into(), "drive");
    writeln!(out, "ring      {drives}, {baud} bit/s, a cycle of {} µs", setup.cycle_us)?;
    for (at, slot) in setup.slots.iter().enumerate() {
        let (from_us, to_us) = (slot.from_s * 1e6, slot.to_s * 1e6);
        let head = if at == 0 { "slots" } else { "" };
        writeln!(out, "{head:10}{:8}{from_us:6.1} to {to_us:6.1} µs", setup.place(slot.place))?;
    }
    let (mean, share) = mean_bits(setup, &ran.traffic);
    writeln!(out, "cycles    {cycles}, {bits} bits, {stuffed} of them stuffed")?;
    writeln!(
        out,
        "bits      {mean:.1} a cycle, {bits_max} at most; {:.1} with 9.6 bits a byte, {:.0} unstuffed",
        estimate_bits(setup),
        setup.setting.carry().bits,
    )?;
    writeln!(
        out,
        "stuffing  {:.3} % of the unstuffed bits; 9.6 bits a byte are 20 %",
        share * 100.0
    )?;
    if dropped > 0 {
        writeln!(
            out,
            "dropped   telegrams {dropped}, steps that drives repeated {}",
            ran.repeated
        )?;
    }
    if ran.fault.is_some() {
        return Ok(());
    }
    match ran.deviation_max {
        0 => writeln!(out, "heard     every drive where it was told to be, cycle by cycle")?,
        units => writeln!(out, "heard     a drive {:.1} µm off at most", f64::from(units) * 0.1)?,
    }
    match ran.ticks {
        [ticks, 0] => {
            writeln!(out, "the drives executed what was planned, cycle by cycle ({ticks} cycles)")?;
        }
        [_, others] => writeln!(out, "the drives executed {others} cycles otherwise than planned")?,
    }
    if report.verdict == Verdict::Pass {
        let (error, tolerance) = (report.max_contour_error_mm, report.tolerance_mm);
        writeln!(
            out,
            "and that is the program's path: {error:.4} mm off at most, {tolerance:.4} allowed"
        )?;
    }
    Ok(())
}

/// Bits of a cycle on average, and what share of the unstuffed bits is stuffed.
fn mean_bits(setup: &Setup, traffic: &Traffic) -> (f64, f64) {
    let mean = traffic.bits as f64 / traffic.cycles.max(1) as f64;
    (mean, mean / setup.setting.carry().bits - 1.0)
}

/// Bits of a cycle by the estimate of seed 000.
fn estimate_bits(setup: &Setup) -> f64 {
    setup.setting.carry().line_s * f64::from(setup.setting.baud)
}

fn as_json(program: &Program, setup: &Setup, ran: &Ran, report: &verify::Report) -> Value {
    let slots = setup.slots.iter().map(|slot| {
        json!({"telegram": setup.place(slot.place), "from_us": six_digits(slot.from_s * 1e6),
               "to_us": six_digits(slot.to_s * 1e6)})
    });
    let (mean, share) = mean_bits(setup, &ran.traffic);
    let [as_planned, others] = ran.ticks;
    json!({
        "schema": 1,
        "machine": program.machine.id,
        "drives": setup.axes.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "baud": setup.setting.baud,
        "cycle_us": setup.cycle_us,
        "slots": slots.collect::<Vec<_>>(),
        "cycles": ran.traffic.cycles,
        "bits": ran.traffic.bits,
        "bits_a_cycle": {
            "mean": six_digits(mean), "max": ran.traffic.bits_max,
            "unstuffed": setup.setting.carry().bits, "estimate": six_digits(estimate_bits(setup)),
        },
        "stuffed_percent": six_digits(share * 100.0),
        "dropped": ran.traffic.dropped,
        "repeated": ran.repeated,
        "deviation_um": f64::from(ran.deviation_max) / 10.0,
        "executed_as_planned": others == 0 && ran.fault.is_none(),
        "ticks": as_planned + others,
        "fault": ran.fault.map(|fault| fault.to_string()),
        "verify": ran.fault.is_none().then_some(report),
    })
}
