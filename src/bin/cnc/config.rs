//! Which `cnc.toml` files there are, and what they say together: the folder's before the user's.
//! Options of the command line and `CNC_*` go before both. A file that is named in one is looked for
//! from the folder of that one.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use cnc::base::Config;
use cnc::base::machine::BUILT_IN;
use cnc::base::source::as_text;
use cnc::interp::Dialect;

use crate::args::Global;
use crate::refusal::Refusal;
use crate::{input, report};

const FILE: &str = "cnc.toml";

/// Reads the files that are there, and draws what is wrong with one.
pub fn load(global: &Global) -> anyhow::Result<Config> {
    let files = [Some(PathBuf::from(FILE)), users_own()];
    files.into_iter().flatten().try_fold(Config::default(), |nearer, file| {
        Ok(match read(&file, global)? {
            Some(config) => nearer.over(config),
            None => nearer,
        })
    })
}

/// `$XDG_CONFIG_HOME/cnc/cnc.toml`, or that in `~/.config`.
fn users_own() -> Option<PathBuf> {
    let folder = |name| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let config = folder("XDG_CONFIG_HOME").or_else(|| Some(folder("HOME")?.join(".config")))?;
    Some(config.join("cnc").join(FILE))
}

fn read(file: &Path, global: &Global) -> anyhow::Result<Option<Config>> {
    let name = file.display().to_string();
    if file.metadata().is_ok_and(|data| !data.is_file()) {
        return Err(anyhow!("{name}: is no file that can be read again and again"));
    }
    input::has_read(file);
    let text = match std::fs::read(file) {
        Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
            return Ok(None);
        }
        read => read.and_then(as_text).with_context(|| name.clone())?,
    };
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
    Ok(Some(config))
}
