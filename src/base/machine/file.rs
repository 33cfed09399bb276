//! The keys of a machine profile → [`Machine`]. What a key may say stands here, once; values
//! that must fit each other are checked when each is right by itself.

use std::collections::BTreeMap;

use super::hooks::Hooks;
use super::keys::Keys;
use super::plc::PlcProfile;
use super::{
    AxisProfile, BUFFER_TICKS, Bus, FRAME_COUNT_MAX, FRAME_PLACES, HOST_ID, Interpolator, Machine,
    Master, POSITION_MOST, ProfileError, Protocol, Rapid, Spindle, canonical,
};
use crate::base::{Axis, AxisSet, Point};

/// Most steps a mm or degree; see [`POSITION_MOST`].
const STEPS_MOST: f64 = 1e6;
/// Most steps a tick without a bus: what keeps sums over windows of ticks within an i32.
const COUNT_MOST: u32 = 1_000_000;

/// Most pulses a minute of an interpolator: 66 million a second.
const PULSES_MOST: u32 = 4_000_000_000;

/// Reads and checks a profile. `file` is the name to show, `id` that of the machine.
pub(super) fn parse(file: &str, id: &str, text: &str) -> Result<Machine, ProfileError> {
    let mut keys = Keys::parse(text);
    let machine = machine(&mut keys, id);
    if keys.check_complete() {
        fit(&mut keys, &machine);
    }
    let faults = keys.into_faults();
    if !faults.is_empty() {
        return Err(ProfileError::Wrong { file: file.to_owned(), faults });
    }
    Ok(Machine { toml: canonical::text(&machine), ..machine })
}

/// The unit in the names of an axis's keys.
pub(super) fn unit(axis: Axis) -> &'static str {
    if axis.is_rotary() { "deg" } else { "mm" }
}

fn machine(keys: &mut Keys<'_>, id: &str) -> Machine {
    let name = keys.string_if("name").unwrap_or_else(|| id.to_owned());
    if name.chars().any(char::is_control) || name.trim().is_empty() {
        keys.wrong("name", "a name of one line is expected".into(), None);
    }
    let work_zero_mm = work_zero(keys);
    let path_tolerance_mm = keys.number("path_tolerance_mm", 1e-6..=10.0);
    let arc_radius_tolerance_mm = keys.number("arc_radius_tolerance_mm", 1e-6..=10.0);
    let rapids = [("straight", Rapid::Straight), ("independent", Rapid::Independent)];
    let rapid = keys.choice("rapid", &rapids, Some(Rapid::Straight));
    let seam_in_cut_penalty_s =
        keys.number_if("seam_in_cut_penalty_s", 0.0..=3600.0).unwrap_or(5.0);
    let home_order = home_order(keys);
    let axes = if keys.table("axes") {
        Axis::ALL.into_iter().filter_map(|axis| axis_profile(keys, axis)).collect()
    } else {
        Vec::new()
    };
    let bus = bus(keys);
    let spindle = keys.has_table("spindle").then(|| Spindle {
        speed_max_rpm: keys.integer("spindle.speed_max_rpm", 1..=1_000_000),
        power_kw: keys.number("spindle.power_kw", 1e-3..=1e3),
        efficiency: keys.number_if("spindle.efficiency", 0.01..=1.0).unwrap_or(1.0),
        encoder: keys.boolean_if("spindle.encoder").unwrap_or(false),
    });
    let interpolator = keys.has_table("interpolator").then(|| Interpolator {
        line_max_pulses_min: keys.integer("interpolator.line_max_pulses_min", 1..=PULSES_MOST),
        arc_max_pulses_min: keys.integer("interpolator.arc_max_pulses_min", 1..=PULSES_MOST),
    });
    let assumed_inputs = keys.boolean_if("assumed_inputs").unwrap_or(false);
    let hooks = Hooks::read(keys);
    let plc = PlcProfile::read(keys);
    Machine {
        id: id.to_owned(),
        name,
        work_zero_mm,
        path_tolerance_mm,
        arc_radius_tolerance_mm,
        rapid,
        seam_in_cut_penalty_s,
        home_order,
        axes,
        bus,
        spindle,
        interpolator,
        assumed_inputs,
        hooks,
        plc,
        toml: String::new(),
    }
}

fn work_zero(keys: &mut Keys<'_>) -> Point {
    let mut zero = Point::ZERO;
    for table in ["mm", "deg"] {
        if !keys.has_table(&format!("work_zero_{table}")) {
            continue;
        }
        for axis in Axis::ALL {
            let path = format!("work_zero_{table}.{axis}");
            match keys.number_if(&path, -POSITION_MOST..=POSITION_MOST) {
                Some(value) if unit(axis) == table => zero[axis] = value,
                Some(value) => {
                    let unit = unit(axis);
                    let help = format!("write it as work_zero_{unit} = {{ {axis} = {value:?} }}");
                    keys.wrong(&path, format!("positions of {axis} are in {unit}"), Some(help));
                }
                None => {}
            }
        }
    }
    zero
}

fn home_order(keys: &mut Keys<'_>) -> Vec<Axis> {
    let names = keys.strings_if("home_order").unwrap_or_default();
    let axes: Vec<Axis> = names.iter().filter_map(|name| axis_named(name)).collect();
    let once: AxisSet = axes.iter().copied().collect();
    if axes.len() < names.len() || once.iter().count() < axes.len() {
        let help = Some("as in [\"Z\", \"X\", \"Y\"]".to_owned());
        keys.wrong("home_order", "a list of axes, each once, is expected".into(), help);
    }
    axes
}

fn axis_named(name: &str) -> Option<Axis> {
    match name.as_bytes() {
        [letter] => Axis::from_letter(*letter),
        _ => None,
    }
}

fn axis_profile(keys: &mut Keys<'_>, axis: Axis) -> Option<AxisProfile> {
    let table = format!("axes.{axis}");
    if !keys.has_table(&table) {
        return None;
    }
    let unit = unit(axis);
    let position = -POSITION_MOST..=POSITION_MOST;
    let speed_max = format!("{table}.speed_max_{unit}_s");
    Some(AxisProfile {
        axis,
        steps_per_mm: keys.number(&format!("{table}.steps_per_{unit}"), 1e-3..=STEPS_MOST),
        travel_mm: keys.interval_if(&format!("{table}.travel_{unit}"), position.clone()),
        speed_max_mm_s: keys.number(&speed_max, 1e-3..=1e6),
        accel_max_mm_s2: keys.number(&format!("{table}.accel_max_{unit}_s2"), 1e-3..=1e12),
        jerk_max_mm_s3: keys.number_if(&format!("{table}.jerk_max_{unit}_s3"), 1e-3..=1e15),
        start_speed_mm_s: keys
            .number_if(&format!("{table}.start_speed_{unit}_s"), 0.0..=1e6)
            .unwrap_or(0.0),
        home_mm: keys.number_if(&format!("{table}.home_{unit}"), position),
    })
}

fn bus(keys: &mut Keys<'_>) -> Bus {
    if !keys.table("bus") {
        return Bus::unconnected();
    }
    let protocols =
        [("buffered", Protocol::Buffered), ("frame", Protocol::Frame), ("none", Protocol::None)];
    let protocol = keys.choice("bus.protocol", &protocols, None);
    let count_most = match protocol {
        Protocol::Buffered => 127,
        Protocol::Frame => FRAME_COUNT_MAX,
        Protocol::None => COUNT_MOST,
    };
    Bus {
        protocol,
        baud: keys.integer_if("bus.baud", 300..=10_000_000).unwrap_or(38_400),
        tick_us: keys.integer("bus.tick_us", 10..=10_000_000),
        node_tick_us: keys.integer("bus.node_tick_us", 10..=10_000_000),
        buffer_ticks: keys.integer_if("bus.buffer_ticks", 1..=1_000_000).unwrap_or(BUFFER_TICKS),
        count_max: keys.integer("bus.count_max", 1..=count_most),
        host_id: keys.integer_if("bus.host_id", 0..=255).unwrap_or(HOST_ID.into()) as u8,
        nodes: nodes(keys),
        metronome_id: keys.integer_if("bus.metronome_id", 0..=255).map(|id| id as u8),
        spare_ids: keys
            .integers_if("bus.spare_ids", 0..=255)
            .into_iter()
            .map(|id| id as u8)
            .collect(),
        master: master(keys),
        reply_timeout_ms: keys.integer_if("bus.reply_timeout_ms", 1..=60_000).unwrap_or(200),
    }
}

fn nodes(keys: &mut Keys<'_>) -> BTreeMap<Axis, u8> {
    let mut nodes = BTreeMap::new();
    if keys.has_table("bus.nodes") {
        for axis in Axis::ALL {
            if let Some(id) = keys.integer_if(&format!("bus.nodes.{axis}"), 0..=255) {
                nodes.insert(axis, id as u8);
            }
        }
    }
    nodes
}

fn master(keys: &mut Keys<'_>) -> Master {
    let Some(word) = keys.string_if("bus.master") else { return Master::Auto };
    match (word.as_str(), axis_named(&word)) {
        ("auto", _) => Master::Auto,
        ("rotate", _) => Master::Rotate,
        ("metronome", _) => Master::Metronome,
        (_, Some(axis)) => Master::Axis(axis),
        _ => {
            let help = "write \"auto\", \"rotate\", \"metronome\" or an axis as \"X\"".to_owned();
            keys.wrong("bus.master", format!("unknown value \"{word}\""), Some(help));
            Master::Auto
        }
    }
}

/// Checks values against each other.
fn fit(keys: &mut Keys<'_>, machine: &Machine) {
    if machine.axes.is_empty() {
        keys.wrong("axes", "a machine has at least one axis".into(), None);
    }
    for profile in &machine.axes {
        fit_axis(keys, machine, profile);
    }
    for axis in Axis::ALL.into_iter().filter(|axis| machine.axis(*axis).is_none()) {
        let told_of = [
            machine.work_zero_mm[axis] != 0.0,
            machine.home_order.contains(&axis),
            machine.bus.nodes.contains_key(&axis),
            machine.bus.master == Master::Axis(axis),
        ];
        let paths = [
            format!("work_zero_{}", unit(axis)),
            "home_order".into(),
            "bus.nodes".into(),
            "bus.master".into(),
        ];
        for (path, _) in paths.iter().zip(told_of).filter(|(_, told)| *told) {
            keys.wrong(
                path,
                format!("this machine has no axis {axis}: [axes.{axis}] is missing"),
                None,
            );
        }
    }
    match machine.bus.protocol {
        Protocol::Buffered => fit_buffered_bus(keys, machine),
        Protocol::Frame => fit_frames(keys, machine),
        Protocol::None => {}
    }
}

fn fit_axis(keys: &mut Keys<'_>, machine: &Machine, profile: &AxisProfile) {
    let (axis, unit) = (profile.axis, unit(profile.axis));
    if profile.start_speed_mm_s > profile.speed_max_mm_s {
        let message = format!("is above speed_max_{unit}_s = {}", profile.speed_max_mm_s);
        keys.wrong(&format!("axes.{axis}.start_speed_{unit}_s"), message, None);
    }
    let zero = machine.work_zero_mm[axis];
    if let Some([low, high]) = profile.travel_mm
        && !(low..=high).contains(&zero)
    {
        let message = format!("{axis} = {zero} is outside of the axis's travel, {low} to {high}");
        keys.wrong(&format!("work_zero_{unit}"), message, None);
    }
    if machine.count_max(profile) == 0 {
        let message = format!(
            "is less than one step in node_tick_us = {}: the axis could never move",
            machine.bus.node_tick_us
        );
        keys.wrong(&format!("axes.{axis}.speed_max_{unit}_s"), message, None);
    }
}

/// Places in the frame, and what nobody asks for where nodes cannot answer.
fn fit_frames(keys: &mut Keys<'_>, machine: &Machine) {
    let bus = &machine.bus;
    let unused = [
        ("bus.metronome_id", bus.metronome_id.is_some()),
        ("bus.spare_ids", !bus.spare_ids.is_empty()),
        ("bus.master", bus.master != Master::Auto),
    ];
    for (path, _) in unused.into_iter().filter(|(_, is_there)| *is_there) {
        let message = "with protocol = \"frame\" no node answers: this means nothing".to_owned();
        keys.wrong(path, message, None);
    }
    let mut owners: BTreeMap<u8, Axis> = BTreeMap::new();
    for (axis, place) in &bus.nodes {
        let path = format!("bus.nodes.{axis}");
        if !(1..=FRAME_PLACES).contains(place) {
            let message = format!("a frame has the places 1 to {FRAME_PLACES}");
            keys.wrong(&path, message, None);
        } else if let Some(other) = owners.insert(*place, *axis) {
            keys.wrong(&path, format!("bus.nodes.{other} has place {place} already"), None);
        }
    }
    for profile in machine.axes.iter().filter(|profile| !bus.nodes.contains_key(&profile.axis)) {
        let message = format!("axis {} has no place in the frame", profile.axis);
        let help = Some("as in nodes = { X = 1, Y = 2, Z = 3 }; a frame has six".to_owned());
        let path = if bus.nodes.is_empty() { "bus" } else { "bus.nodes" };
        keys.wrong(path, message, help);
    }
}

/// What the node firmware holds fixed, and IDs that would be taken for data.
fn fit_buffered_bus(keys: &mut Keys<'_>, machine: &Machine) {
    let bus = &machine.bus;
    if bus.buffer_ticks != BUFFER_TICKS {
        let message = format!("the node firmware's buffer has {BUFFER_TICKS} entries, always");
        keys.wrong("bus.buffer_ticks", message, Some(format!("write {BUFFER_TICKS}")));
    }
    if bus.host_id != HOST_ID {
        let message = format!("the node firmware starts on {HOST_ID} only");
        keys.wrong("bus.host_id", message, Some(format!("write {HOST_ID}")));
    }
    if bus.master == Master::Metronome && bus.metronome_id.is_none() {
        let help = "write metronome_id = 125, the ID of a node without a motor".to_owned();
        keys.wrong("bus.master", "which node that is does not stand here".into(), Some(help));
    }
    let of_axes = bus.nodes.iter().map(|(axis, id)| (format!("bus.nodes.{axis}"), *id));
    let metronome = bus.metronome_id.map(|id| ("bus.metronome_id".to_owned(), id));
    let spare = bus.spare_ids.iter().map(|id| ("bus.spare_ids".to_owned(), *id));
    let mut owners: BTreeMap<u8, String> = BTreeMap::new();
    for (path, id) in of_axes.chain(metronome).chain(spare) {
        match id {
            120 => keys.wrong(
                &path,
                "120 is the host's ID: the start command would fill this node".into(),
                Some("set the node's switch to 1..15, which is ID 121..135".into()),
            ),
            121..=135 => {}
            _ => keys.wrong(
                &path,
                "node IDs are 120 plus the node's switch: 121 to 135".into(),
                None,
            ),
        }
        if let Some(other) = owners.insert(id, path.clone()) {
            keys.wrong(&path, format!("{other} has ID {id} already"), None);
        }
    }
    for profile in &machine.axes {
        if !bus.nodes.contains_key(&profile.axis) {
            let message = format!("axis {} has no node", profile.axis);
            let help = Some("as in nodes = { X = 122, Y = 123, Z = 124 }".to_owned());
            let path = if bus.nodes.is_empty() { "bus" } else { "bus.nodes" };
            keys.wrong(path, message, help);
        }
    }
}
