//! Lists of ports from trees like those of sysfs, `/dev` and `/proc`, and names that lead to one.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

use cnc::wire_io::ports::{Access, NameError, PortKind, SerialPort, UsbName, list_ports};

/// A folder that looks like `/`.
struct Tree {
    _folder: tempfile::TempDir,
    root: PathBuf,
}

impl Tree {
    fn new() -> Tree {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().canonicalize().unwrap();
        Tree { _folder: folder, root }
    }

    fn file(&self, path: &str, text: &str) {
        let path = self.root.join(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }

    /// A link between two places of the tree.
    fn link(&self, path: &str, to: &str) {
        let path = self.root.join(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::create_dir_all(self.root.join(to)).unwrap();
        symlink(self.root.join(to), path).unwrap();
    }

    /// What the kernel shows of a terminal whose device stands at `device`.
    fn terminal(&self, name: &str, device: &str, driver: &str) {
        let tty = format!("{device}/tty/{name}");
        self.link(&format!("{tty}/device"), device);
        self.link(&format!("sys/class/tty/{name}"), &tty);
        self.link(&format!("{device}/driver"), &format!("sys/bus/drivers/{driver}"));
        self.file(&format!("dev/{name}"), "");
    }

    /// A USB serial adapter; `ids` are vendor, product and serial number.
    fn adapter(&self, name: &str, at: &str, driver: &str, ids: [&str; 3], words: [&str; 2]) {
        let usb = format!("sys/devices/usb1/{at}");
        let keys = ["idVendor", "idProduct", "serial", "product", "manufacturer"];
        for (key, value) in keys.iter().zip(ids.iter().chain(&words)) {
            if !value.is_empty() {
                self.file(&format!("{usb}/{key}"), &format!("{value}\n"));
            }
        }
        let interface = format!("{usb}/{at}:1.0");
        self.file(&format!("{interface}/bInterfaceNumber"), "00\n");
        self.terminal(name, &format!("{interface}/{name}"), driver);
    }

    fn process(&self, pid: u32, command: &str, opens: &str) {
        self.file(&format!("proc/{pid}/comm"), &format!("{command}\n"));
        fs::create_dir_all(self.root.join(format!("proc/{pid}/fd"))).unwrap();
        let fd = self.root.join(format!("proc/{pid}/fd/3"));
        symlink(self.root.join(opens), fd).unwrap();
    }

    fn ports(&self) -> Vec<SerialPort> {
        list_ports(&self.root)
    }

    fn find(&self, name: &str) -> Result<PathBuf, NameError> {
        name.parse::<UsbName>()?.find(&self.ports())
    }
}

/// A workshop's computer: two FTDI adapters, an Arduino, a UART, thirty names without hardware.
fn workshop() -> Tree {
    let tree = Tree::new();
    for number in 0..3 {
        let device = format!("sys/devices/platform/serial8250/ttyS{number}");
        tree.terminal(&format!("ttyS{number}"), &device, "serial8250");
        let kind = if number == 1 { "4\n" } else { "0\n" };
        tree.file(&format!("{device}/tty/ttyS{number}/type"), kind);
    }
    // A virtual console has no device.
    fs::create_dir_all(tree.root.join("sys/devices/virtual/tty/tty1")).unwrap();
    tree.link("sys/class/tty/tty1", "sys/devices/virtual/tty/tty1");
    let arduino = ["2341", "0043", "75131"];
    tree.adapter("ttyACM0", "1-3", "cdc_acm", arduino, ["", "Arduino"]);
    let ftdi = |serial| ["0403", "6001", serial];
    let words = ["FT232R USB UART", "FTDI"];
    tree.adapter("ttyUSB10", "1-2", "ftdi_sio", ftdi("A5XK3RJT"), words);
    tree.adapter("ttyUSB9", "1-1", "ftdi_sio", ftdi("B7"), words);
    tree.adapter("ttyUSB0", "1-4", "whiteheat", ["0710", "8001", ""], ["", ""]);
    tree.file("sys/devices/usb1/1-2/1-2:1.0/ttyUSB10/latency_timer", "16\n");
    let by_id = "dev/serial/by-id/usb-FTDI_FT232R_USB_UART_A5XK3RJT-if00-port0";
    fs::create_dir_all(tree.root.join("dev/serial/by-id")).unwrap();
    symlink("../../ttyUSB10", tree.root.join(by_id)).unwrap();
    tree.process(812, "minicom", "dev/ttyUSB10");
    tree.process(813, "bash", "dev/null");
    tree
}

#[test]
fn the_likeliest_port_comes_first() {
    let tree = workshop();
    let ports = tree.ports();
    let names: Vec<_> = ports.iter().map(|port| port.path.file_name().unwrap()).collect();
    let order = ["ttyUSB9", "ttyUSB10", "ttyUSB0", "ttyACM0", "ttyS1", "ttyS0", "ttyS2"];
    assert_eq!(names, order);
    use PortKind::{Adapter, NoHardware, OnBoard, UsbModem, UsbSerial};
    let kinds: Vec<_> = ports.iter().map(|port| port.kind).collect();
    assert_eq!(kinds, [Adapter, Adapter, UsbSerial, UsbModem, OnBoard, NoHardware, NoHardware]);
}

#[test]
fn a_port_is_told_with_all_that_is_known() {
    let tree = workshop();
    let ports = tree.ports();
    let port = &ports[1];
    let usb = port.usb.as_ref().unwrap();
    assert_eq!(usb.to_string(), "usb:0403:6001:A5XK3RJT");
    assert_eq!((usb.product.as_deref(), usb.interface), (Some("FT232R USB UART"), Some(0)));
    assert_eq!((port.driver.as_deref(), port.latency_timer_ms), (Some("ftdi_sio"), Some(16)));
    assert!(
        port.by_id.len() == 1
            && port.by_id[0].ends_with("usb-FTDI_FT232R_USB_UART_A5XK3RJT-if00-port0")
    );
    assert_eq!(port.access, Access::Granted);
    let holders: Vec<_> = port.holders.iter().map(ToString::to_string).collect();
    assert_eq!(holders, ["minicom (pid 812)"]);
    assert!(ports[0].holders.is_empty() && ports[0].by_id.is_empty());
    assert_eq!(ports[3].usb.as_ref().unwrap().product, None);
}

#[test]
fn a_container_may_have_no_ports_or_no_device_files() {
    assert_eq!(Tree::new().ports(), []);
    let tree = workshop();
    fs::remove_file(tree.root.join("dev/ttyUSB9")).unwrap();
    assert_eq!(tree.ports()[0].access, Access::NoFile);
}

#[test]
fn a_usb_name_leads_to_one_port() {
    let tree = workshop();
    let port = |name: &str| Ok(tree.root.join("dev").join(name));
    assert_eq!(tree.find("usb:0403:6001:A5XK3RJT"), port("ttyUSB10"));
    assert_eq!(tree.find("usb:2341:0043"), port("ttyACM0"));
    assert_eq!(tree.find("usb:2341:43"), port("ttyACM0"));
    assert_eq!(tree.find("usb:0710:8001"), port("ttyUSB0"));
}

#[test]
fn a_usb_name_that_leads_nowhere_tells_what_is_there() {
    let tree = workshop();
    let message = |name: &str| tree.find(name).unwrap_err().to_string();
    let ambiguous = message("usb:0403:6001");
    for part in ["usb:0403:6001:A5XK3RJT (", "usb:0403:6001:B7 (", "by-id", "serial number"] {
        assert!(ambiguous.contains(part), "{part}: {ambiguous}");
    }
    assert!(!ambiguous.contains("2341"), "{ambiguous}");
    for name in ["usb:0403:6002", "usb:0403:6001:C1", "usb:0710:8001:1"] {
        let nowhere = message(name);
        assert!(nowhere.contains(name) && nowhere.contains("usb:2341:0043:75131"), "{nowhere}");
    }
    let none = "usb:1a86:7523".parse::<UsbName>().unwrap().find(&Tree::new().ports());
    assert!(none.unwrap_err().to_string().contains("no USB port is plugged in"));
    for bad in
        ["usb:", "usb:0403", "usb:0403:", "usb:04x3:1", "usb:+403:1", "usb:1:2:", "usb:10403:1"]
    {
        assert_eq!(tree.find(bad), Err(NameError::Syntax(bad.to_owned())), "{bad}");
    }
}

/// The list of this computer, whatever it has.
#[test]
fn this_computers_ports_can_be_listed() {
    for port in list_ports(Path::new("/")) {
        assert!(port.path.starts_with("/dev"), "{port:?}");
    }
}
