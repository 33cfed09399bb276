//! Files that commands write: each appears whole or not at all.

use std::fs::{File, Permissions};
use std::io::{self, BufWriter, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use anyhow::{Context, ensure};
use tempfile::NamedTempFile;

use crate::exit::Failure;

/// Where a file's content goes while it is made.
pub type Out = BufWriter<File>;

/// Writes a file through a temporary one beside it, which takes its place once all is written.
/// What is there already and is no file (a device, a pipe) is written to as it is.
pub fn whole_file(
    path: &Path,
    write: impl FnOnce(&mut Out) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let context = || format!("{} cannot be written", path.display());
    let named = |failure: Failure| match failure.error.is::<io::Error>() {
        true => Failure { error: failure.error.context(context()), ..failure },
        false => failure,
    };
    if is_no_file(path) {
        let mut out = BufWriter::new(File::create(path).with_context(context)?);
        write(&mut out).map_err(named)?;
        return Ok(out.flush().with_context(context)?);
    }
    let part = part(path).with_context(context)?;
    let (file, place) = part.into_parts();
    let mut out = BufWriter::new(file);
    write(&mut out).map_err(named)?;
    out.flush().with_context(context)?;
    place.persist(path).with_context(context)?;
    Ok(())
}

/// Says at the start of a long command that its file could not be written at the end.
pub fn check(path: &Path) -> anyhow::Result<()> {
    if is_no_file(path) && !path.is_dir() {
        return Ok(());
    }
    let context = || format!("{} cannot be written", path.display());
    ensure!(!path.is_dir(), "{}: it is a folder", context());
    part(path).map(drop).with_context(context)
}

fn is_no_file(path: &Path) -> bool {
    path.exists() && !path.is_file()
}

/// The temporary file beside a path. Its own errors would name it, of which nobody knows.
fn part(path: &Path) -> io::Result<NamedTempFile> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new("."));
    std::fs::metadata(folder)?;
    tempfile::Builder::new()
        .permissions(Permissions::from_mode(0o666))
        .tempfile_in(folder)
        .map_err(|error| error.kind().into())
}
