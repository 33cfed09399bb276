//! Machine → TOML: every value, defaults filled in, in a fixed order. The rule: equal machines
//! give equal bytes, and reading the text back gives the same machine.

use std::fmt;

use super::{AxisProfile, Bus, Machine, Master, Protocol, Rapid};
use crate::base::Axis;

/// The text that the machine's seal is the hash of.
pub(super) fn text(machine: &Machine) -> String {
    let mut out = String::new();
    line(&mut out, "name", toml::Value::from(machine.name.as_str()));
    for (unit, rotary) in [("mm", false), ("deg", true)] {
        let zero = |axis: Axis| format!("{axis} = {}", number(machine.work_zero_mm[axis]));
        let axes = machine.axes.iter().map(|profile| profile.axis);
        let zeros: Vec<_> = axes.filter(|axis| axis.is_rotary() == rotary).map(zero).collect();
        if !zeros.is_empty() {
            line(&mut out, &format!("work_zero_{unit}"), format!("{{ {} }}", zeros.join(", ")));
        }
    }
    line(&mut out, "path_tolerance_mm", number(machine.path_tolerance_mm));
    line(&mut out, "arc_radius_tolerance_mm", number(machine.arc_radius_tolerance_mm));
    line(
        &mut out,
        "rapid",
        match machine.rapid {
            Rapid::Straight => "\"straight\"",
            Rapid::Independent => "\"independent\"",
        },
    );
    line(&mut out, "seam_in_cut_penalty_s", number(machine.seam_in_cut_penalty_s));
    if !machine.home_order.is_empty() {
        let quoted: Vec<_> = machine.home_order.iter().map(|axis| format!("\"{axis}\"")).collect();
        line(&mut out, "home_order", format!("[{}]", quoted.join(", ")));
    }
    if machine.assumed_inputs {
        line(&mut out, "assumed_inputs", true);
    }
    for profile in &machine.axes {
        axis(&mut out, profile);
    }
    bus(&mut out, &machine.bus);
    if let Some(spindle) = &machine.spindle {
        out.push_str("\n[spindle]\n");
        line(&mut out, "speed_max_rpm", spindle.speed_max_rpm);
        line(&mut out, "power_kw", number(spindle.power_kw));
        if spindle.efficiency != 1.0 {
            line(&mut out, "efficiency", number(spindle.efficiency));
        }
        if spindle.encoder {
            line(&mut out, "encoder", true);
        }
    }
    if let Some(plc) = &machine.plc {
        out.push_str("\n[plc]\n");
        line(&mut out, "baud", plc.baud);
        line(&mut out, "tmf_ms", plc.tmf_ms);
        line(&mut out, "tfin_ms", plc.tfin_ms);
        line(&mut out, "timeout_s", number(plc.timeout_s));
    }
    if let Some(interpolator) = &machine.interpolator {
        out.push_str("\n[interpolator]\n");
        line(&mut out, "line_max_pulses_min", interpolator.line_max_pulses_min);
        line(&mut out, "arc_max_pulses_min", interpolator.arc_max_pulses_min);
    }
    out + &machine.hooks.text()
}

fn axis(out: &mut String, profile: &AxisProfile) {
    let unit = super::file::unit(profile.axis);
    out.push_str(&format!("\n[axes.{}]\n", profile.axis));
    line(out, &format!("steps_per_{unit}"), number(profile.steps_per_mm));
    if let Some([low, high]) = profile.travel_mm {
        line(out, &format!("travel_{unit}"), format!("[{}, {}]", number(low), number(high)));
    }
    line(out, &format!("speed_max_{unit}_s"), number(profile.speed_max_mm_s));
    line(out, &format!("accel_max_{unit}_s2"), number(profile.accel_max_mm_s2));
    if let Some(jerk) = profile.jerk_max_mm_s3 {
        line(out, &format!("jerk_max_{unit}_s3"), number(jerk));
    }
    line(out, &format!("start_speed_{unit}_s"), number(profile.start_speed_mm_s));
    if let Some(home) = profile.home_mm {
        line(out, &format!("home_{unit}"), number(home));
    }
}

fn bus(out: &mut String, bus: &Bus) {
    out.push_str("\n[bus]\n");
    line(
        out,
        "protocol",
        match bus.protocol {
            Protocol::Buffered => "\"buffered\"",
            Protocol::Frame => "\"frame\"",
            Protocol::None => "\"none\"",
        },
    );
    line(out, "baud", bus.baud);
    line(out, "tick_us", bus.tick_us);
    line(out, "node_tick_us", bus.node_tick_us);
    let is_frame = bus.protocol == Protocol::Frame;
    if !is_frame {
        line(out, "buffer_ticks", bus.buffer_ticks);
    }
    line(out, "count_max", bus.count_max);
    if !is_frame {
        line(out, "host_id", bus.host_id);
    }
    let nodes: Vec<_> = bus.nodes.iter().map(|(axis, id)| format!("{axis} = {id}")).collect();
    if !nodes.is_empty() {
        line(out, "nodes", format!("{{ {} }}", nodes.join(", ")));
    }
    if let Some(id) = bus.metronome_id {
        line(out, "metronome_id", id);
    }
    if !bus.spare_ids.is_empty() {
        let ids: Vec<_> = bus.spare_ids.iter().map(u8::to_string).collect();
        line(out, "spare_ids", format!("[{}]", ids.join(", ")));
    }
    match bus.master {
        // Nobody answers frames.
        _ if is_frame => {}
        Master::Auto => line(out, "master", "\"auto\""),
        Master::Rotate => line(out, "master", "\"rotate\""),
        Master::Metronome => line(out, "master", "\"metronome\""),
        Master::Axis(axis) => line(out, "master", format!("\"{axis}\"")),
    }
    line(out, "reply_timeout_ms", bus.reply_timeout_ms);
}

fn line(out: &mut String, key: &str, value: impl fmt::Display) {
    out.push_str(&format!("{key} = {value}\n"));
}

fn number(value: f64) -> toml::Value {
    toml::Value::Float(value)
}
