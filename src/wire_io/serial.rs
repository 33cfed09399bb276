//! Serial ports (8N1, opened for one program alone), and why one cannot be opened.

use std::io::{self, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serialport::{ClearBuffer, SerialPort, TTYPort};

use crate::wire_io::link::{LinkError, Port};
use crate::wire_io::ports::{self, Access, Holder, OpenDevices, Remedy};

/// How long a port may take no bytes.
const WRITE_WAIT: Duration = Duration::from_secs(1);
/// What bytes written may take to leave the adapter at the end.
const DRAIN_WAIT: Duration = Duration::from_millis(500);
/// A pseudo-terminal forgets bytes that nobody has read when it is closed.
const SETTLE: Duration = Duration::from_millis(20);

/// A port that cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// There is no such file.
    #[error(
        "there is no port {0}; is the adapter plugged in? `cnc ports` lists what there is, and sim: needs no port"
    )]
    Missing(PathBuf),
    /// The user may not use it.
    #[error("no permission for {port}: {remedy}")]
    Permission {
        /// The port.
        port: PathBuf,
        /// What lets the user use it.
        remedy: Remedy,
    },
    /// Another program has it.
    #[error("{port} is in use by {}", holders(.port, .by))]
    Busy {
        /// The port.
        port: PathBuf,
        /// Who has it, as far as this user may know.
        by: Vec<Holder>,
    },
    /// It is a file, a folder or another device.
    #[error("{0} is no serial port")]
    NotSerial(PathBuf),
    /// The adapter refuses the settings, or anything else.
    #[error("{port} cannot be opened at {baud} baud: {reason}")]
    Other {
        /// The port.
        port: PathBuf,
        /// Bits a second.
        baud: u32,
        /// What the system says.
        reason: String,
    },
}

fn holders(port: &Path, by: &[Holder]) -> String {
    match by {
        [] => format!("another program; `sudo fuser {}` names it", port.display()),
        by => by.iter().take(5).map(Holder::to_string).collect::<Vec<_>>().join(", "),
    }
}

/// An open serial port.
#[derive(Debug)]
pub struct Serial {
    port: TTYPort,
    path: PathBuf,
}

impl Serial {
    /// Opens a port, 8 data bits, no parity, 1 stop bit, and forgets what it has received.
    ///
    /// It is locked (`TIOCEXCL` and `flock`) against others that come later. Those that have it open
    /// already without a lock, or that root would not be kept out by, are looked for before it is
    /// touched.
    ///
    /// # Errors
    /// See [`OpenError`]; each says what to do.
    pub fn open(path: &Path, baud: u32) -> Result<Serial, OpenError> {
        Serial::check_free(path)?;
        let name = path.to_string_lossy();
        let builder = serialport::new(name, baud).timeout(WRITE_WAIT);
        let port = TTYPort::open(&builder).map_err(|error| open_error(path, baud, &error))?;
        let other = |error: serialport::Error| open_error(path, baud, &error);
        port.clear(ClearBuffer::Input).map_err(other)?;
        Ok(Serial { port, path: path.to_owned() })
    }

    /// Looks whether another program has a port open, as far as this user may know. Whatever is
    /// wrong else shows when the port is opened.
    ///
    /// # Errors
    /// [`OpenError::Busy`].
    pub fn check_free(path: &Path) -> Result<(), OpenError> {
        let by = OpenDevices::scan(Path::new("/proc")).holders(path);
        if by.is_empty() || !is_terminal(path) {
            return Ok(());
        }
        Err(OpenError::Busy { port: path.to_owned(), by })
    }

    /// Time that ran out and signals are no failures: whoever calls looks at the clock and the stop.
    /// A port that is gone has no file any more, whatever the error is called.
    fn none_in_time(&self, error: io::Error) -> Result<(), LinkError> {
        match error.kind() {
            ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted => Ok(()),
            ErrorKind::BrokenPipe => Err(LinkError::Closed),
            _ if !self.path.exists() => Err(LinkError::Closed),
            _ => Err(LinkError::Io(error)),
        }
    }
}

fn open_error(path: &Path, baud: u32, error: &serialport::Error) -> OpenError {
    let port = path.to_owned();
    match error.kind() {
        serialport::ErrorKind::Io(ErrorKind::NotFound) => OpenError::Missing(port),
        serialport::ErrorKind::Io(ErrorKind::PermissionDenied) => {
            let remedy = match ports::access(path, Path::new("/etc")) {
                Access::Denied(remedy) => remedy,
                Access::Granted | Access::NoFile => Remedy::Rule,
            };
            OpenError::Permission { port, remedy }
        }
        serialport::ErrorKind::NoDevice => {
            let by = OpenDevices::scan(Path::new("/proc")).holders(path);
            OpenError::Busy { port, by }
        }
        _ if !is_terminal(path) => OpenError::NotSerial(port),
        _ => OpenError::Other { port, baud, reason: error.to_string() },
    }
}

fn is_terminal(path: &Path) -> bool {
    use rustix::fs::{Mode, OFlags};
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
    rustix::fs::open(path, flags, Mode::empty()).is_ok_and(rustix::termios::isatty)
}

/// Whether a port is the far end of a pseudo-terminal: virtual nodes, no machine.
pub fn is_pseudo_terminal(path: &Path) -> bool {
    path.canonicalize().is_ok_and(|path| path.starts_with("/dev/pts"))
}

/// How long a USB adapter keeps received bytes back (16 ms on FTDI chips unless set), if it says.
pub fn latency_timer_ms(path: &Path) -> Option<u32> {
    std::fs::read_to_string(latency_timer(path)?).ok()?.trim().parse().ok()
}

/// Sets that, where the adapter has such a timer and the user may.
///
/// # Errors
/// When the system refuses; as a rule only root may.
pub fn set_latency_timer(path: &Path, ms: u32) -> io::Result<()> {
    let file = latency_timer(path).filter(|file| file.exists());
    file.map_or(Ok(()), |file| std::fs::write(file, ms.to_string()))
}

fn latency_timer(path: &Path) -> Option<PathBuf> {
    let path = path.canonicalize().ok()?;
    Some(Path::new("/sys/bus/usb-serial/devices").join(path.file_name()?).join("latency_timer"))
}

impl Port for Serial {
    fn write(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        let give_up = Instant::now() + WRITE_WAIT;
        let mut rest = bytes;
        self.port.set_timeout(WRITE_WAIT).map_err(io::Error::from)?;
        while !rest.is_empty() {
            match self.port.write(rest) {
                Ok(count) => rest = rest.get(count..).unwrap_or_default(),
                Err(error) => self.none_in_time(error)?,
            }
            if !rest.is_empty() && Instant::now() >= give_up {
                return Err(LinkError::Stalled);
            }
        }
        Ok(())
    }

    fn read(&mut self, bytes: &mut [u8], wait: Duration) -> Result<usize, LinkError> {
        self.port.set_timeout(wait).map_err(io::Error::from)?;
        match self.port.read(bytes) {
            Ok(0) => Err(LinkError::Closed),
            Ok(count) => Ok(count),
            Err(error) => self.none_in_time(error).map(|()| 0),
        }
    }

    fn drain(&mut self) {
        let give_up = Instant::now() + DRAIN_WAIT;
        while self.port.bytes_to_write().is_ok_and(|rest| rest > 0) && Instant::now() < give_up {
            std::thread::sleep(Duration::from_millis(1));
        }
        std::thread::sleep(SETTLE);
    }
}
