//! `cnc ports`: the serial ports of this computer, the likeliest first.

use std::io::{self, Write};
use std::path::Path;

use cnc::wire_io::ports::{Access, Holder, PortKind, SerialPort, list_ports};
use serde_json::{Value, json};

use crate::args::Global;
use crate::exit::{Exit, Outcome};

/// List serial ports, those first that a bus most likely hangs on
///
/// Tells of each by what names it goes, whether it can be opened and who has it open. Opens none.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Also those that the system keeps a name for without any hardware
    #[arg(long)]
    all: bool,
}

pub fn run(args: &Args, global: &Global) -> Outcome {
    global.refuse(&["machine"], "ports are those of this computer")?;
    let mut ports = list_ports(Path::new("/"));
    let of_all = ports.len();
    ports.retain(|port| args.all || port.kind != PortKind::NoHardware);
    let mut out = io::stdout().lock();
    if global.json {
        let list: Vec<Value> = ports.iter().map(to_json).collect();
        writeln!(out, "{}", json!({"schema": 1, "ports": list}))?;
    } else {
        ports.iter().try_for_each(|port| show(&mut out, port))?;
    }
    out.flush()?;
    if ports.is_empty() && !global.quiet {
        say!(
            "no ports found; is the adapter plugged in? `dmesg | tail` tells what the system made of it"
        );
        say!("a container sees ports only if it is given them: --device /dev/ttyUSB0, and /sys");
        if of_all > 0 {
            say!("{of_all} without hardware are left out: --all shows them");
        }
        say!("to try everything without one: sim: or `cnc node`");
    }
    Ok(Exit::Ok)
}

fn show(out: &mut impl Write, port: &SerialPort) -> io::Result<()> {
    let what = match (&port.usb, port.kind) {
        (Some(usb), _) => {
            let words = [usb.product.as_deref(), usb.manufacturer.as_deref()];
            let words: Vec<&str> = words.into_iter().flatten().collect();
            let unnamed = if words.is_empty() { "USB port".to_owned() } else { words.join(", ") };
            match usb.interface.filter(|interface| *interface > 0) {
                Some(interface) => format!("{unnamed}, interface {interface}"),
                None => unnamed,
            }
        }
        (None, PortKind::NoHardware) => "no hardware".to_owned(),
        (None, _) => "on the board".to_owned(),
    };
    let driver = port.driver.as_ref().map_or(String::new(), |driver| format!(" (driver {driver})"));
    writeln!(out, "{}  {what}{driver}", port.path.display())?;
    if let Some(usb) = &port.usb {
        writeln!(out, "    {usb}")?;
    }
    port.by_id.iter().try_for_each(|link| writeln!(out, "    {}", link.display()))?;
    if port.is_console {
        writeln!(out, "    the system's console")?;
    }
    match &port.access {
        Access::Granted => {}
        Access::Denied(remedy) => writeln!(out, "    no permission: {remedy}")?,
        Access::NoFile => {
            writeln!(out, "    no device file here: was it given to this container?")?
        }
    }
    if !port.holders.is_empty() {
        let holders: Vec<String> = port.holders.iter().map(Holder::to_string).collect();
        writeln!(out, "    in use by {}", holders.join(", "))?;
    }
    if let Some(ms) = port.latency_timer_ms {
        let note = if ms > 1 { "; 1 is better (docs/ports.md)" } else { "" };
        writeln!(out, "    keeps answers back for up to {ms} ms{note}")?;
    }
    Ok(())
}

fn to_json(port: &SerialPort) -> Value {
    let usb = port.usb.as_ref().map(|usb| {
        json!({
            "name": usb.to_string(),
            "vendor_id": format!("{:04x}", usb.vendor_id),
            "product_id": format!("{:04x}", usb.product_id),
            "serial": usb.serial, "manufacturer": usb.manufacturer, "product": usb.product,
            "interface": usb.interface,
        })
    });
    let (access, remedy) = match &port.access {
        Access::Granted => ("granted", None),
        Access::Denied(remedy) => ("denied", Some(remedy.to_string())),
        Access::NoFile => ("no-file", None),
    };
    let holders: Vec<Value> = port
        .holders
        .iter()
        .map(|holder| json!({"pid": holder.pid, "command": holder.command}))
        .collect();
    json!({
        "path": port.path, "kind": port.kind.name(), "by_id": port.by_id, "usb": usb,
        "driver": port.driver, "console": port.is_console, "access": access, "remedy": remedy, "held_by": holders,
        "latency_timer_ms": port.latency_timer_ms,
    })
}
