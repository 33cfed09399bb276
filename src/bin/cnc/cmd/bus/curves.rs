//! Curves of what an interface carries: those of seed 004, for any interface and any numbers.

use anyhow::anyhow;
use clap::ValueEnum;
use cnc::base::Machine;
use cnc::plot::{Along, Chart, Curve, Limit, Scale, Size};
use cnc::systems::carry::{Interface, Setting};

use super::{Args, Drawn, meaningless};
use crate::table::{Cell, Column, Table};

/// The period that seed 004 asks for: 100 Hz.
const PERIOD_S: f64 = 0.01;
/// Its rates of serial lines.
const BAUDS: [u32; 5] = [9600, 19_200, 38_400, 57_600, 115_200];
/// What EIA-485 adds (its section 3.8).
const FAST_BAUDS: [u32; 4] = [250_000, 500_000, 1_000_000, 10_000_000];
/// Nodes of the curves over baud rates.
const NODES: [u32; 6] = [1, 2, 3, 6, 10, 15];
/// Most nodes by their switches.
const NODES_MOST: u32 = 15;

/// The axis of sampling frequencies.
const FREQUENCY: Column = ("frequency_hz", "frequency Hz");

/// Which curves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Curves {
    /// Time on the line each period over nodes, a curve a baud rate (seed 004, figure 3.13)
    Load,
    /// Time to fill the buffers over baud rate, a curve a number of nodes (figure 3.15)
    Fill,
    /// Delay of the sync message over baud rate (figure 3.16)
    Sync,
    /// Time left for computing over sampling frequency, a curve a baud rate (figure 3.18)
    Computing,
    /// Nodes possible over sampling frequency, a curve a baud rate
    Nodes,
}

/// What a set of curves is drawn over, and what it shows.
struct Sheet {
    name: &'static str,
    interface: Interface,
    title: String,
    x: (Column, Scale),
    y: (Column, Scale),
    /// What tells the curves apart.
    by: Column,
    limits: Vec<Limit>,
    /// What it shows is whole numbers, that hold from one point to the next.
    in_stairs: bool,
    /// There is one curve, and what tells it from others stands in the title.
    is_single: bool,
}

/// Computes them.
pub fn draw(which: Curves, args: &Args, machine: &Machine) -> anyhow::Result<Drawn> {
    let interface = interface(which, args)?;
    let has_one_frequency = args.frequency.as_ref().is_none_or(|list| list.0.len() == 1);
    match which {
        Curves::Computing => computing(interface, args, machine),
        Curves::Nodes => nodes(interface, args, machine),
        _ if !has_one_frequency => Err(anyhow!("these curves have one sampling frequency")),
        Curves::Load => load(interface, args, machine),
        Curves::Fill => fill(interface, args, machine),
        Curves::Sync => sync(interface, args, machine),
    }
}

/// The interface asked for, or the one that the figure is of.
fn interface(which: Curves, args: &Args) -> anyhow::Result<Interface> {
    let own = match which {
        Curves::Load | Curves::Computing | Curves::Nodes => Interface::Frame,
        Curves::Fill | Curves::Sync => Interface::Buffered,
    };
    let interface = match args.protocol.as_slice() {
        [] => own,
        [protocol] => protocol.interface(),
        _ => return Err(anyhow!("curves are of one protocol")),
    };
    match (which, interface) {
        (Curves::Fill, Interface::Buffered) => Ok(interface),
        (Curves::Fill, _) => Err(meaningless("--curves fill", interface, "it has no buffers")),
        (Curves::Nodes, Interface::Coefficients) => Err(meaningless(
            "--curves nodes",
            interface,
            "its nodes are told each block, not each period",
        )),
        (Curves::Sync, Interface::Coefficients | Interface::Parallel) => {
            Err(meaningless("--curves sync", interface, "it has no sync message"))
        }
        _ => Ok(interface),
    }
}

/// Figure 3.13.
fn load(interface: Interface, args: &Args, machine: &Machine) -> anyhow::Result<Drawn> {
    let nodes = args.nodes.as_ref().map_or((1..=NODES_MOST).collect(), |list| list.0.clone());
    let period_s = period_s(args);
    let settings = bauds(interface, args, &BAUDS).into_iter().map(|baud| {
        let usual = Setting { baud, period_s, ..args.usual(interface, machine) };
        let curve = nodes.iter().map(|nodes| Setting { nodes: *nodes, ..usual });
        (baud, curve.collect())
    });
    let sheet = Sheet {
        name: "load",
        interface,
        title: format!("Time on the line each {}, {interface}", each(interface)),
        x: (("nodes", "nodes"), Scale::linear("nodes")),
        y: (("line_ms", "line ms"), Scale::linear("time on the line, ms")),
        by: ("baud", "baud"),
        limits: vec![period_limit(Along::Y, period_s)],
        in_stairs: false,
        is_single: false,
    };
    Ok(sheet.drawn(settings, |setting| [f64::from(setting.nodes), setting.carry().line_s * 1e3]))
}

/// Figure 3.15.
fn fill(interface: Interface, args: &Args, machine: &Machine) -> anyhow::Result<Drawn> {
    let bauds = bauds(interface, args, &with_fast());
    let period_s = period_s(args);
    let nodes = args.nodes.as_ref().map_or(NODES.to_vec(), |list| list.0.clone());
    let settings = nodes.into_iter().map(|nodes| {
        let usual = Setting { nodes, period_s, ..args.usual(interface, machine) };
        (nodes, bauds.iter().map(|baud| Setting { baud: *baud, ..usual }).collect())
    });
    let buffer_s = args.usual(interface, machine).buffer_ticks as f64 * period_s;
    let sheet = Sheet {
        name: "fill",
        interface,
        title: "Time to fill the buffers".to_owned(),
        x: (("baud", "baud"), Scale::logarithmic("baud rate, bit/s")),
        y: (("fill_ms", "fill ms"), Scale::logarithmic("time to fill, ms")),
        by: ("nodes", "nodes"),
        limits: vec![Limit {
            name: format!("what they hold at 100 Hz: {buffer_s} s"),
            along: Along::Y,
            at: buffer_s * 1e3,
        }],
        in_stairs: false,
        is_single: false,
    };
    Ok(sheet.drawn(settings, |setting| {
        [f64::from(setting.baud), setting.carry().fill_s.unwrap_or(0.0) * 1e3]
    }))
}

/// Figure 3.16.
fn sync(interface: Interface, args: &Args, machine: &Machine) -> anyhow::Result<Drawn> {
    let bauds = bauds(interface, args, &with_fast());
    let period_s = period_s(args);
    let nodes = args.nodes.as_ref().map(|list| list.0.clone());
    let nodes = nodes.unwrap_or_else(|| vec![args.usual(interface, machine).nodes]);
    let is_single = nodes.len() == 1;
    let title = match (nodes.as_slice(), interface) {
        // One byte for all, however many they are.
        ([_], Interface::Buffered) => format!("Delay of the sync message, {interface}"),
        ([nodes], _) => format!("Delay of the sync message, {interface}, {nodes} nodes"),
        _ => format!("Delay of the sync message, {interface}"),
    };
    let settings = nodes.into_iter().map(|nodes| {
        let usual = Setting { nodes, period_s, ..args.usual(interface, machine) };
        (nodes, bauds.iter().map(|baud| Setting { baud: *baud, ..usual }).collect())
    });
    let sheet = Sheet {
        name: "sync",
        interface,
        title,
        x: (("baud", "baud"), Scale::logarithmic("baud rate, bit/s")),
        y: (("sync_ms", "sync ms"), Scale::logarithmic("delay, ms")),
        by: ("nodes", "nodes"),
        limits: vec![period_limit(Along::Y, period_s)],
        in_stairs: false,
        is_single,
    };
    Ok(sheet.drawn(settings, |setting| {
        [f64::from(setting.baud), setting.carry().sync_s.unwrap_or(0.0) * 1e3]
    }))
}

/// Figure 3.18.
fn computing(interface: Interface, args: &Args, machine: &Machine) -> anyhow::Result<Drawn> {
    let usual = args.usual(interface, machine);
    let nodes =
        args.nodes.as_ref().map_or(vec![NODES_MOST.max(usual.nodes)], |list| list.0.clone());
    let [nodes] = nodes.as_slice() else {
        return Err(anyhow!("these curves have one number of nodes"));
    };
    let settings = over_frequency(interface, args, Setting { nodes: *nodes, ..usual });
    let sheet = Sheet {
        name: "computing",
        interface,
        title: format!("Time left for computing, {interface}, {nodes} nodes"),
        x: (FREQUENCY, Scale::logarithmic("sampling frequency, Hz")),
        y: (("left_ms", "left ms"), Scale::logarithmic("time left, ms")),
        by: ("baud", "baud"),
        limits: vec![frequency_limit()],
        in_stairs: false,
        is_single: false,
    };
    Ok(sheet.drawn(settings, |setting| [1.0 / setting.period_s, setting.carry().left_s * 1e3]))
}

/// Nodes possible; no figure of a paper.
fn nodes(interface: Interface, args: &Args, machine: &Machine) -> anyhow::Result<Drawn> {
    if args.nodes.is_some() {
        return Err(anyhow!(
            "--curves nodes tells how many nodes there can be: --nodes is not for it"
        ));
    }
    let settings = over_frequency(interface, args, args.usual(interface, machine));
    let sheet = Sheet {
        name: "nodes",
        interface,
        title: format!("Nodes possible, {interface}"),
        x: (FREQUENCY, Scale::logarithmic("sampling frequency, Hz")),
        y: (("nodes_max", "nodes max"), Scale::linear("nodes")),
        by: ("baud", "baud"),
        limits: vec![frequency_limit()],
        in_stairs: true,
        is_single: false,
    };
    Ok(sheet
        .drawn(settings, |setting| [1.0 / setting.period_s, f64::from(setting.carry().nodes_max)]))
}

/// A curve a baud rate, over the sampling frequencies asked for, or from 10 Hz to 1 kHz, fifty to a
/// decade.
fn over_frequency(
    interface: Interface,
    args: &Args,
    usual: Setting,
) -> impl Iterator<Item = (u32, Vec<Setting>)> {
    let usual_hz = || (0..=100).map(|at| 10_f64.powf(1.0 + f64::from(at) / 50.0)).collect();
    let frequencies = args.frequency.as_ref().map_or_else(usual_hz, |list| list.0.clone());
    bauds(interface, args, &BAUDS).into_iter().map(move |baud| {
        let usual = Setting { baud, ..usual };
        (baud, frequencies.iter().map(|hz| Setting { period_s: 1.0 / hz, ..usual }).collect())
    })
}

impl Sheet {
    /// The same points as rows and as curves.
    fn drawn(
        self,
        curves: impl Iterator<Item = (u32, Vec<Setting>)>,
        point: impl Fn(&Setting) -> [f64; 2],
    ) -> Drawn {
        let mut table = Table {
            columns: vec![("interface", "interface"), self.by, self.x.0, self.y.0],
            rows: Vec::new(),
        };
        let mut drawn = Vec::new();
        for (by, settings) in curves {
            let points: Vec<[f64; 2]> = settings.iter().map(&point).collect();
            table.rows.extend(points.iter().map(|[x, y]| {
                let x = match x.fract() == 0.0 {
                    true => Cell::Whole(*x as u64),
                    false => Cell::Number(*x, 3),
                };
                vec![Cell::text(self.interface), Cell::Whole(by.into()), x, Cell::Number(*y, 4)]
            }));
            let what = if by == 1 { self.by.1.trim_end_matches('s') } else { self.by.1 };
            let name = if self.is_single { String::new() } else { format!("{by} {what}") };
            let colour = drawn.len();
            let points = if self.in_stairs { stairs(&points) } else { points };
            drawn.push(Curve { name, colour, points });
        }
        let chart = Chart {
            title: self.title,
            size: Size::default(),
            x: self.x.1,
            y: self.y.1,
            curves: drawn,
            limits: self.limits,
        };
        Drawn { name: self.name, table, chart }
    }
}

/// Values that hold up to the next point, where they change at once.
fn stairs(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut all: Vec<[f64; 2]> = Vec::new();
    for point in points {
        if let Some([_, before]) = all.last().copied().filter(|[_, before]| *before != point[1]) {
            all.push([point[0], before]);
        }
        all.push(*point);
    }
    all
}

fn each(interface: Interface) -> &'static str {
    if interface == Interface::Coefficients { "block" } else { "period" }
}

fn period_s(args: &Args) -> f64 {
    args.frequency.as_ref().map_or(PERIOD_S, |list| 1.0 / list.0[0])
}

fn period_limit(along: Along, period_s: f64) -> Limit {
    let hz = 1.0 / period_s;
    Limit { name: format!("a period at {hz} Hz"), along, at: period_s * 1e3 }
}

fn frequency_limit() -> Limit {
    let hz = 1.0 / PERIOD_S;
    Limit { name: format!("{hz} Hz"), along: Along::X, at: hz }
}

fn with_fast() -> Vec<u32> {
    BAUDS.into_iter().chain(FAST_BAUDS).collect()
}

/// The baud rates asked for, or those usual for the interface.
fn bauds(interface: Interface, args: &Args, usual: &[u32]) -> Vec<u32> {
    let most = interface.baud_most().unwrap_or(u32::MAX);
    let carried = || usual.iter().copied().filter(|baud| *baud <= most).collect();
    let own = || interface.own_baud().map_or_else(carried, |baud| vec![baud, 2 * baud, 8 * baud]);
    args.baud.as_ref().map_or_else(own, |list| list.0.clone())
}
