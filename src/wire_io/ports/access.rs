//! A device file → whether this user may open it, and if not, what to do about it.

use std::fs;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::Path;

use rustix::fs::Access as Wanted;

/// Read and write for the group.
const GROUP_MODE: u32 = 0o060;

/// Whether this user may open a port.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Access {
    /// To read and write.
    Granted,
    /// No; what to do.
    Denied(Remedy),
    /// The system knows the port, but its file is not here.
    NoFile,
}

/// What lets a user open a port.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Remedy {
    /// Join this group.
    Join(String),
    /// The user is in this group since after this login.
    LogInAgain(String),
    /// No group may: a udev rule, or root.
    Rule,
}

impl std::fmt::Display for Remedy {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Remedy::Join(group) => write!(
                f,
                "add yourself to group {group}: `sudo usermod -aG {group} $USER`, then log in again"
            ),
            Remedy::LogInAgain(group) => {
                write!(f, "you are in group {group} from the next login on: log in again")
            }
            Remedy::Rule => {
                write!(
                    f,
                    "its file lets no group in: that takes a udev rule with GROUP=\"dialout\""
                )
            }
        }
    }
}

/// Asks the system; opens nothing. `etc` holds the lists of users and groups.
pub fn access(device: &Path, etc: &Path) -> Access {
    match rustix::fs::access(device, Wanted::READ_OK | Wanted::WRITE_OK) {
        Ok(()) => Access::Granted,
        Err(_) => match fs::metadata(device) {
            Ok(meta) => Access::Denied(remedy(
                meta.permissions().mode(),
                meta.gid(),
                rustix::process::getuid().as_raw(),
                etc,
            )),
            Err(_) => Access::NoFile,
        },
    }
}

/// What lets the user `uid` open a file of this mode and group.
fn remedy(mode: u32, gid: u32, uid: u32, etc: &Path) -> Remedy {
    let read = |name| fs::read_to_string(etc.join(name)).unwrap_or_default();
    let (groups, users) = (read("group"), read("passwd"));
    let fields = |line: &str| line.split(':').map(str::to_owned).collect::<Vec<_>>();
    let with_id = |text: &str, id: u32| {
        let lines = text.lines().map(fields);
        lines.into_iter().find(|line| line.get(2).is_some_and(|field| *field == id.to_string()))
    };
    // Group 0 is root's: nobody is added to it.
    let group = with_id(&groups, gid).filter(|_| mode & GROUP_MODE == GROUP_MODE && gid != 0);
    let Some([name, _, _, members]) = group.as_ref().and_then(|line| line.get(..4)) else {
        return Remedy::Rule;
    };
    let user = with_id(&users, uid).and_then(|line| line.first().cloned());
    let is_member = user.is_some_and(|user| members.split(',').any(|member| member == user));
    if is_member { Remedy::LogInAgain(name.clone()) } else { Remedy::Join(name.clone()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_remedy_is_the_missing_group() {
        let etc = tempfile::tempdir().unwrap();
        fs::write(etc.path().join("group"), "root:x:0:\ndialout:x:20:eva,ada\n").unwrap();
        fs::write(etc.path().join("passwd"), "ada:x:1000:1000::/:\nbob:x:1001:1001::/:\n").unwrap();
        let remedy = |mode, gid, uid| remedy(mode, gid, uid, etc.path());
        assert_eq!(remedy(0o20660, 20, 1000), Remedy::LogInAgain("dialout".to_owned()));
        assert_eq!(remedy(0o20660, 20, 1001), Remedy::Join("dialout".to_owned()));
        for (mode, gid) in [(0o20600, 20), (0o20660, 0), (0o20660, 99)] {
            assert_eq!(remedy(mode, gid, 1001), Remedy::Rule, "{mode:o} {gid}");
        }
        let message = remedy(0o20660, 20, 1001).to_string();
        assert!(message.contains("usermod -aG dialout"), "{message}");
    }
}
