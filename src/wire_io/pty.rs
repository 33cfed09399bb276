//! The near end of a pseudo-terminal, whose far end a host opens like a serial port.

use std::io;
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec};
use rustix::io::Errno;
use rustix::pty::OpenptFlags;
use rustix::termios::OptionalActions;

/// A pseudo-terminal in raw mode.
#[derive(Debug)]
pub struct Pty {
    near: OwnedFd,
    name: PathBuf,
    link: Option<PathBuf>,
}

/// What reading gave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Received {
    /// So many bytes.
    Bytes(usize),
    /// Nothing in time.
    Nothing,
    /// The far end was open and is closed.
    Closed,
}

impl Pty {
    /// Makes a pseudo-terminal, and a symbolic link to it if one is wanted. A link of that name
    /// that is there already is replaced; anything else is left alone.
    ///
    /// # Errors
    /// When the system has none left, or the link cannot be made.
    pub fn open(link: Option<&Path>) -> io::Result<Pty> {
        let near =
            rustix::pty::openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
        rustix::pty::grantpt(&near)?;
        rustix::pty::unlockpt(&near)?;
        let name = rustix::pty::ptsname(&near, Vec::new())?;
        let name = PathBuf::from(name.to_string_lossy().into_owned());
        let mut modes = rustix::termios::tcgetattr(&near)?;
        modes.make_raw();
        rustix::termios::tcsetattr(&near, OptionalActions::Now, &modes)?;
        rustix::io::ioctl_fionbio(&near, true)?;
        if let Some(link) = link {
            if link.is_symlink() {
                std::fs::remove_file(link)?;
            }
            if link.symlink_metadata().is_ok() {
                let reason = "something else has that name: take another, or take it away";
                return Err(io::Error::new(io::ErrorKind::AlreadyExists, reason));
            }
            std::os::unix::fs::symlink(&name, link)?;
        }
        Ok(Pty { near, name, link: link.map(Path::to_owned) })
    }

    /// Path of the far end.
    pub fn name(&self) -> &Path {
        &self.name
    }

    /// Reads what is there, or waits for it.
    ///
    /// # Errors
    /// When the pseudo-terminal fails.
    pub fn read(&mut self, bytes: &mut [u8], wait: Duration) -> io::Result<Received> {
        let mut polled = [PollFd::new(&self.near, PollFlags::IN)];
        let wait = Timespec { tv_sec: wait.as_secs() as i64, tv_nsec: wait.subsec_nanos().into() };
        match rustix::event::poll(&mut polled, Some(&wait)) {
            Ok(0) | Err(Errno::INTR) => return Ok(Received::Nothing),
            Ok(_) => {}
            Err(error) => return Err(error.into()),
        }
        match rustix::io::read(&self.near, bytes) {
            Ok(0) | Err(Errno::IO) => Ok(Received::Closed),
            Ok(count) => Ok(Received::Bytes(count)),
            Err(Errno::AGAIN | Errno::INTR) => Ok(Received::Nothing),
            Err(error) => Err(error.into()),
        }
    }

    /// Writes bytes for the far end; those that it has no room for are lost, as on a wire.
    ///
    /// # Errors
    /// When the pseudo-terminal fails.
    pub fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        match rustix::io::write(&self.near, bytes) {
            Ok(_) | Err(Errno::IO | Errno::AGAIN | Errno::INTR) => Ok(()),
            Err(error) => Err(error.into()),
        }
    }
}

impl Drop for Pty {
    fn drop(&mut self) {
        let ours = |link: &PathBuf| std::fs::read_link(link).is_ok_and(|to| to == self.name);
        if let Some(link) = self.link.as_ref().filter(|link| ours(link)) {
            // Nobody is left to tell, and a link to nothing harms nobody.
            let _ = std::fs::remove_file(link);
        }
    }
}
