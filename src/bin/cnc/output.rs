//! Files that commands write: each appears whole or not at all.

use std::fs::{File, Permissions};
use std::io::{BufWriter, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use anyhow::Context;

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
    if path.exists() && !path.is_file() {
        let mut out = BufWriter::new(File::create(path).with_context(context)?);
        write(&mut out)?;
        return Ok(out.flush().with_context(context)?);
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let part = tempfile::Builder::new()
        .permissions(Permissions::from_mode(0o666))
        .tempfile_in(folder.unwrap_or(Path::new(".")))
        .with_context(context)?;
    let (file, place) = part.into_parts();
    let mut out = BufWriter::new(file);
    write(&mut out)?;
    out.flush().with_context(context)?;
    place.persist(path).with_context(context)?;
    Ok(())
}
