//! `/proc` → which processes have which devices open.
//!
//! Sees what the user may see: the own processes, or all for root. Opens no device, and leaves this
//! process out.

use std::fs::{self, Metadata};
use std::os::unix::fs::{FileTypeExt, MetadataExt};
use std::path::{Path, PathBuf};

/// A process that has a device open.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Holder {
    /// Its ID.
    pub pid: u32,
    /// Its command's name, of which the system keeps 15 bytes.
    pub command: String,
}

impl std::fmt::Display for Holder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} (pid {})", self.command, self.pid)
    }
}

/// The devices that processes have open.
#[derive(Debug, Default)]
pub struct OpenDevices(Vec<OpenDevice>);

#[derive(Debug)]
struct OpenDevice {
    path: PathBuf,
    /// Of a character device that is still there.
    meta: Option<Metadata>,
    /// Of the near end of a pseudo-terminal: the number of its far end.
    near_end_of: Option<String>,
    holder: Holder,
}

impl OpenDevices {
    /// Looks through a `/proc`. Processes that may not be looked at are left out.
    pub fn scan(proc: &Path) -> OpenDevices {
        let mut found = Vec::new();
        for entry in fs::read_dir(proc).into_iter().flatten().flatten() {
            let pid = entry.file_name().to_str().and_then(|name| name.parse().ok());
            let Some(pid) = pid.filter(|pid| *pid != std::process::id()) else { continue };
            let folder = entry.path();
            for fd in fs::read_dir(folder.join("fd")).into_iter().flatten().flatten() {
                let Ok(path) = fs::read_link(fd.path()) else { continue };
                // Pipes and sockets have no path; a file on a dead network drive is not asked.
                if !path.components().any(|part| part.as_os_str() == "dev") {
                    continue;
                }
                let meta = fs::metadata(fd.path()).ok();
                let command = fs::read_to_string(folder.join("comm")).unwrap_or_default();
                found.push(OpenDevice {
                    near_end_of: near_end_of(&path, &folder.join("fdinfo").join(fd.file_name())),
                    path,
                    meta: meta.filter(|meta| meta.file_type().is_char_device()),
                    holder: Holder { pid, command: command.trim().to_owned() },
                });
            }
        }
        OpenDevices(found)
    }

    /// Who has a device open, under whatever name. Whoever has the near end of a pseudo-terminal is
    /// its other end, and not another user of the port.
    pub fn holders(&self, device: &Path) -> Vec<Holder> {
        let device = device.canonicalize().unwrap_or_else(|_| device.to_owned());
        let meta = fs::metadata(&device).ok().filter(|meta| meta.file_type().is_char_device());
        let number = device.strip_prefix("/dev/pts").ok().and_then(Path::to_str);
        let holds = |open: &&OpenDevice| {
            let same = open.meta.as_ref().zip(meta.as_ref()).is_some_and(|(a, b)| same(a, b));
            same || open.path == device
        };
        let is_other_end = |holder: &Holder| {
            let is_near = |open: &&OpenDevice| open.holder == *holder && open.near_end_of.is_some();
            let mut near_ends = self.0.iter().filter(is_near);
            number.is_some() && near_ends.any(|open| open.near_end_of.as_deref() == number)
        };
        let holders = self.0.iter().filter(holds).map(|open| open.holder.clone());
        let mut holders: Vec<Holder> = holders.filter(|holder| !is_other_end(holder)).collect();
        holders.sort();
        holders.dedup();
        holders
    }
}

/// The same device, whatever its file is called. Far ends of pseudo-terminals have a number in each
/// container.
fn same(a: &Metadata, b: &Metadata) -> bool {
    const PTS_MAJORS: std::ops::RangeInclusive<u32> = 136..=143;
    let is_pts = PTS_MAJORS.contains(&rustix::fs::major(a.rdev()));
    a.rdev() == b.rdev() && (!is_pts || a.dev() == b.dev())
}

fn near_end_of(path: &Path, fdinfo: &Path) -> Option<String> {
    if !path.ends_with("ptmx") {
        return None;
    }
    let info = fs::read_to_string(fdinfo).ok()?;
    let number = info.lines().find_map(|line| line.strip_prefix("tty-index:"))?;
    Some(number.trim().to_owned())
}
