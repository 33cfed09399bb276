//! Which `cnc.toml` files there are, and what they say together: the folder's before the user's.
//! Options of the command line and `CNC_*` go before both. A file that is named in one is looked for
//! from the folder of that one.
//!
//! The folder's that cannot be read stops every command; the user's own (a home that is somebody else's)
//! only those that would ask it for the machine.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use cnc::base::Config;
use cnc::base::machine::BUILT_IN;
use cnc::base::source::{shown, small_text};
use cnc::interp::Dialect;

use crate::args::Global;
use crate::refusal::Refusal;
use crate::{input, report};

const FILE: &str = "cnc.toml";
/// A larger one is some other file.
const MIB_MAX: u64 = 1;

/// What the files say, and why the user's own says nothing though it may be there.
pub type Loaded = (Config, Option<String>);

/// Reads the files that are there, and draws what is wrong with one.
pub fn load(global: &Global) -> anyhow::Result<Loaded> {
    let nearer = of_file(Path::new(FILE), text(Path::new(FILE))?, global)?;
    let Some(file) = users_own() else { return Ok((nearer, None)) };
    match text(&file) {
        Ok(text) => Ok((nearer.over(of_file(&file, text, global)?), None)),
        Err(reason) => Ok((nearer, Some(format!("{reason:#}")))),
    }
}

/// `$XDG_CONFIG_HOME/cnc/cnc.toml`, or that in `~/.config`.
fn users_own() -> Option<PathBuf> {
    let folder = |name| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let config = folder("XDG_CONFIG_HOME").or_else(|| Some(folder("HOME")?.join(".config")))?;
    Some(config.join("cnc").join(FILE))
}

/// The text of a file, if it is there.
fn text(file: &Path) -> anyhow::Result<Option<String>> {
    let name = shown(file);
    if file.metadata().is_ok_and(|data| !data.is_file()) {
        return Err(anyhow!("{name}: is no file that can be read again and again"));
    }
    input::has_read(file);
    match small_text(file, MIB_MAX) {
        Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
            Ok(None)
        }
        read => Ok(Some(read.context(name)?)),
    }
}

/// What a file says, if it is there.
fn of_file(file: &Path, text: Option<String>, global: &Global) -> anyhow::Result<Config> {
    let Some(text) = text else { return Ok(Config::default()) };
    let name = shown(file);
    let dialects = Dialect::ALL.map(Dialect::name);
    let mut config = Config::parse(&name, &text, &dialects).map_err(|faults| {
        report::faults(&name, &faults, global);
        Refusal::of_file(&name, &faults, format!("configuration '{name}' cannot be used"))
    })?;
    if let (Some(machine), Some(folder)) = (config.settings.get_mut("machine"), file.parent())
        && BUILT_IN.iter().all(|(id, _)| *id != machine.value)
    {
        machine.value = folder.join(&machine.value).display().to_string();
    }
    Ok(config)
}
