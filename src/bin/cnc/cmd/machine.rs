//! `cnc machine`: lists, shows and checks machine profiles.

mod origins;

use std::io::{self, Write};

use anyhow::Context;
use clap::Subcommand;
use cnc::base::Diagnostic;
use cnc::base::machine::{
    BUILT_IN, Bus, FRAME_BYTES, FRAME_PLACES, Machine, Master, ProfileError, Protocol, Rapid,
};
use serde_json::{Value, json};

use crate::args::Global;
use crate::exit::{Exit, Outcome, unless_unread};
use crate::input;

/// List, show or check machine profiles
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// List the built-in profiles
    List,
    /// Show a profile: what the axes can do, and the bus
    Show {
        /// A built-in name or a TOML file [default: what --machine says]
        name: Option<String>,
        /// Print the profile in its canonical form, to start an own one from; dumps are sealed
        /// with the hash of these bytes
        #[arg(long, conflicts_with = "json")]
        toml: bool,
    },
    /// Check profile files: every key and every value
    Check {
        /// TOML files
        #[arg(required = true, value_name = "FILE")]
        files: Vec<String>,
    },
}

pub fn run(args: &Args, global: &Global) -> Outcome {
    let mut out = io::stdout().lock();
    match &args.action {
        Action::List => {
            global.refuse(&["machine"], "all profiles that are built in are listed")?;
            list(&mut out, global)
        }
        Action::Show { name, toml } => {
            if name.is_some() {
                global.refuse(&["machine"], "the profile to show is named already")?;
            }
            let chosen = name.as_ref().unwrap_or(&global.machine);
            let machine = match name {
                Some(name) => input::profile(name, global),
                None => input::machine(global),
            }?;
            if *toml {
                out.write_all(machine.to_toml().as_bytes())?;
            } else if global.json {
                let mut document = machine_json(&machine)?;
                document["chosen_by"] = json!(origins::chooser(name.is_some(), global));
                document["origins"] = origins::as_json(&origins::of(&machine, chosen)?);
                writeln!(out, "{document}")?;
            } else {
                show(&mut out, &machine)?;
                writeln!(out, "chosen by       {}", origins::chooser(name.is_some(), global))?;
                origins::print(&mut out, &origins::of(&machine, chosen)?)?;
            }
            out.flush()?;
            Ok(Exit::Ok)
        }
        Action::Check { files } => {
            global.refuse(&["machine"], "the profiles to check are named already")?;
            check(&mut out, files, global)
        }
    }
}

fn list(out: &mut impl Write, global: &Global) -> Outcome {
    let machines: Vec<Machine> =
        BUILT_IN.iter().map(|(id, _)| Machine::load(id)).collect::<Result<_, _>>()?;
    if global.json {
        let list: Vec<Value> = machines
            .iter()
            .map(|machine| json!({"id": machine.id, "name": machine.name}))
            .collect();
        writeln!(out, "{}", json!({"schema": 1, "machines": list}))?;
    } else {
        for machine in &machines {
            writeln!(out, "{:<10} {}", machine.id, machine.name)?;
        }
    }
    out.flush()?;
    Ok(Exit::Ok)
}

fn show(out: &mut impl Write, machine: &Machine) -> io::Result<()> {
    writeln!(out, "{machine}")?;
    let zeros = machine
        .axes
        .iter()
        .map(|profile| format!("{}{}", profile.axis, machine.work_zero_mm[profile.axis]));
    writeln!(out, "work zero       {}", zeros.collect::<Vec<_>>().join(" "))?;
    writeln!(out, "path tolerance  {} mm", machine.path_tolerance_mm)?;
    let rapid = match machine.rapid {
        Rapid::Straight => "straight, all axes arrive together",
        Rapid::Independent => "every axis at its own greatest speed",
    };
    writeln!(out, "rapids          {rapid}")?;
    writeln!(out)?;
    writeln!(
        out,
        "axis  steps/unit  travel            speed/s  accel/s²     jerk/s³  start/s  steps/tick"
    )?;
    for profile in &machine.axes {
        let travel = profile.travel_mm.map_or("unlimited".into(), |[a, b]| format!("{a} to {b}"));
        let jerk = profile.jerk_max_mm_s3.map_or("-".into(), |jerk| jerk.to_string());
        writeln!(
            out,
            "{:<4}  {:<10}  {:<16}  {:<7}  {:<11}  {:<7}  {:<7}  {}",
            profile.axis.to_string() + if profile.axis.is_rotary() { " °" } else { "" },
            profile.steps_per_mm,
            travel,
            profile.speed_max_mm_s,
            profile.accel_max_mm_s2,
            jerk,
            profile.start_speed_mm_s,
            machine.count_max(profile),
        )?;
    }
    writeln!(out)?;
    show_bus(out, machine)?;
    if let Some(spindle) = &machine.spindle {
        let encoder = if spindle.encoder { ", motion can follow its turns" } else { "" };
        let at_tool = match spindle.efficiency {
            1.0 => String::new(),
            share => format!(", {} % of it at the tool", 100.0 * share),
        };
        let (rpm, kw) = (spindle.speed_max_rpm, spindle.power_kw);
        writeln!(out, "spindle         {rpm} rpm, {kw} kW{at_tool}{encoder}")?;
    }
    if let Some(interpolator) = &machine.interpolator {
        let (line, arc) = (interpolator.line_max_pulses_min, interpolator.arc_max_pulses_min);
        writeln!(out, "interpolator    {line} pulses/min on lines, {arc} on arcs")?;
    }
    if machine.assumed_inputs {
        writeln!(out, "inputs          assumed: for checking programs, not for cutting")?;
    }
    writeln!(out, "sha256          {}", hex(&machine.sha256()))
}

fn show_bus(out: &mut impl Write, machine: &Machine) -> io::Result<()> {
    let bus = &machine.bus;
    writeln!(out, "tick            {} us, in the node {} us", bus.tick_us, bus.node_tick_us)?;
    if bus.protocol == Protocol::None {
        return writeln!(out, "bus             none: programs are planned and verified, not sent");
    }
    if bus.protocol == Protocol::Frame {
        return show_frames(out, bus);
    }
    let nodes: Vec<_> = bus.nodes.iter().map(|(axis, id)| format!("{axis}={id}")).collect();
    let master = match bus.master {
        Master::Auto => "the axis that moves most".to_owned(),
        Master::Rotate => "the axes that move, in turn".to_owned(),
        Master::Axis(axis) => axis.to_string(),
        Master::Metronome => "the metronome".to_owned(),
    };
    writeln!(out, "bus             buffered, {} baud, {} ticks", bus.baud, bus.buffer_ticks)?;
    writeln!(out, "nodes           {} (host {})", nodes.join(" "), bus.host_id)?;
    if let Some(id) = bus.metronome_id {
        writeln!(out, "metronome       {id}")?;
    }
    if !bus.spare_ids.is_empty() {
        let ids: Vec<_> = bus.spare_ids.iter().map(u8::to_string).collect();
        writeln!(out, "spare nodes     {}", ids.join(" "))?;
    }
    writeln!(out, "master          {master}")
}

fn show_frames(out: &mut impl Write, bus: &Bus) -> io::Result<()> {
    let (bytes, frame_ms) = (FRAME_BYTES, bus.frame_s() * 1e3);
    writeln!(
        out,
        "bus             frames of {bytes} bytes, {frame_ms:.3} ms at {} baud",
        bus.baud
    )?;
    let places: Vec<_> = bus.nodes.iter().map(|(axis, place)| format!("{axis}={place}")).collect();
    writeln!(out, "places          {} of {FRAME_PLACES}; no node answers", places.join(" "))
}

fn check(out: &mut impl Write, files: &[String], global: &Global) -> Outcome {
    let results: Vec<_> = files.iter().map(|file| (file, Machine::open(file))).collect();
    let bad = results.iter().filter(|(_, result)| result.is_err()).count();
    if global.json {
        let files: Vec<Value> =
            results.iter().map(|(file, result)| result_json(file, result)).collect();
        unless_unread(writeln!(out, "{}", json!({"schema": 1, "ok": bad == 0, "files": files})))?;
    }
    for (file, result) in results {
        match result {
            Ok(machine) => {
                if !global.json {
                    unless_unread(writeln!(out, "{file}: ok: {}", machine.name))?;
                }
                input::warn(&machine, global);
            }
            Err(error) => say!("error: {}", input::unusable(error, global)),
        }
    }
    unless_unread(out.flush())?;
    Ok(if bad == 0 { Exit::Ok } else { Exit::Unusable })
}

fn result_json(file: &str, result: &Result<Machine, ProfileError>) -> Value {
    match result {
        Ok(machine) => json!({
            "file": file, "ok": true, "id": machine.id, "name": machine.name,
            "sha256": hex(&machine.sha256()), "warnings": machine.warnings(), "errors": [],
        }),
        Err(error) => {
            json!({"file": file, "ok": false, "warnings": [], "errors": errors_json(error)})
        }
    }
}

fn errors_json(error: &ProfileError) -> Vec<Value> {
    let fault = |fault: &Diagnostic| {
        json!({
            "rule": fault.rule, "line": fault.span.line, "column": fault.column(),
            "message": fault.message, "help": fault.help,
        })
    };
    match error {
        ProfileError::Wrong { faults, .. } => faults.iter().map(fault).collect(),
        ProfileError::NotFound { .. } | ProfileError::Unreadable { .. } => {
            vec![json!({"rule": "profile-file", "message": error.to_string()})]
        }
    }
}

fn machine_json(machine: &Machine) -> anyhow::Result<Value> {
    let profile: Value = toml::from_str(machine.to_toml()).context("the canonical profile")?;
    let count_max: serde_json::Map<String, Value> = machine
        .axes
        .iter()
        .map(|profile| (profile.axis.to_string(), machine.count_max(profile).into()))
        .collect();
    Ok(json!({
        "schema": 1, "id": machine.id, "sha256": hex(&machine.sha256()), "profile": profile,
        "count_max": count_max, "warnings": machine.warnings(),
    }))
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
