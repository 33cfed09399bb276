//! Which programs the arguments of a command name: files as they are, folders with all below them.

use std::collections::hash_map::Entry::{Occupied, Vacant};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::fs::{self, DirEntry};
use std::io;
use std::path::{Path, PathBuf};

use anyhow::anyhow;

use crate::exit::Failure;

/// How the names of programs end that are looked for in folders, in any case.
pub const ENDINGS: [&str; 7] = ["nc", "ngc", "gcode", "gc", "cnc", "tap", "eia"];

/// What the arguments name.
#[derive(Debug, Default)]
pub struct Found {
    /// Programs in the order of the arguments, those of a folder in the order of their names; what
    /// cannot be read stands where it would.
    pub programs: Vec<Entry>,
    /// What lies in folders and is no program by its name.
    pub others: Vec<PathBuf>,
    /// Links to folders, which are not followed, and names of programs that are no files.
    pub left_out: Vec<(PathBuf, &'static str)>,
    /// Where each program lies, with its place in the list.
    places: HashMap<PathBuf, usize>,
    /// Folders that were looked through.
    folders: HashSet<PathBuf>,
}

/// One of them.
#[derive(Debug)]
pub struct Entry {
    pub path: PathBuf,
    /// Somebody has named it; it was not found in a folder.
    pub is_named: bool,
    /// Why there is no program.
    pub trouble: Option<io::Error>,
}

impl Entry {
    /// The program to read, or why there is none.
    pub fn readable(&self) -> Result<&Path, Failure> {
        match &self.trouble {
            None => Ok(&self.path),
            Some(reason) => Err(anyhow!("{}: {reason}", self.path.display()).into()),
        }
    }
}

impl Found {
    /// What these name, each once: where it is named first. A file is a program whatever its name; `-` is
    /// standard input.
    ///
    /// # Errors
    /// When standard input is named twice.
    pub fn of(arguments: &[PathBuf]) -> anyhow::Result<Found> {
        let mut found = Found::default();
        if arguments.iter().filter(|argument| *argument == Path::new("-")).count() > 1 {
            return Err(anyhow!("- is named twice, and standard input can be read once only"));
        }
        for argument in arguments {
            if !argument.is_dir() {
                found.add(argument.clone(), true, None);
                continue;
            }
            found.folder(argument);
            let folder = place(&argument.join("-"));
            let within = folder.parent().unwrap_or(argument);
            if !found.places.keys().any(|place| place.starts_with(within)) {
                let reason = format!("holds no NC program ({})", endings());
                found.add(argument.clone(), true, Some(io::Error::other(reason)));
            }
        }
        Ok(found)
    }

    fn add(&mut self, path: PathBuf, is_named: bool, trouble: Option<io::Error>) {
        match self.places.entry(place(&path)) {
            Occupied(first) => self.programs[*first.get()].is_named |= is_named,
            Vacant(place) => {
                place.insert(self.programs.len());
                self.programs.push(Entry { path, is_named, trouble });
            }
        }
    }

    /// All below a folder. Recursion is as deep as folders are, which names limit to some thousands.
    fn folder(&mut self, folder: &Path) {
        if !self.folders.insert(place(folder)) {
            return;
        }
        let entries = fs::read_dir(folder).and_then(Iterator::collect::<io::Result<Vec<_>>>);
        let mut entries = match entries {
            Ok(entries) => entries,
            Err(error) => return self.add(folder.to_owned(), false, Some(error)),
        };
        entries.sort_by_key(DirEntry::file_name);
        for entry in entries {
            if !entry.file_name().as_encoded_bytes().starts_with(b".") {
                self.entry(entry.path());
            }
        }
    }

    fn entry(&mut self, path: PathBuf) {
        let is_program = is_program(&path);
        match fs::metadata(&path) {
            Ok(data) if data.is_dir() && path.is_symlink() => {
                self.left_out.push((path, "a link to a folder"));
            }
            Ok(data) if data.is_dir() => self.folder(&path),
            Ok(data) if data.is_file() && is_program => self.add(path, false, None),
            Ok(_) if is_program => self.left_out.push((path, "no file")),
            Err(error) if is_program => self.add(path, false, Some(error)),
            Ok(_) | Err(_) => self.others.push(path),
        }
    }

    /// How many files in folders are no programs by their names, by what these end in: `2 .csv, 1 .pdf`.
    pub fn others_by_ending(&self) -> Option<String> {
        let mut counts = BTreeMap::<String, usize>::new();
        for path in &self.others {
            let ending = path.extension().map(|ending| format!(".{}", ending.display()));
            *counts.entry(ending.unwrap_or_else(|| "without ending".to_owned())).or_default() += 1;
        }
        let counts: Vec<String> =
            counts.iter().map(|(ending, count)| format!("{count} {ending}")).collect();
        Some(counts.join(", ")).filter(|text| !text.is_empty())
    }
}

/// `.nc .ngc …`
pub fn endings() -> String {
    ENDINGS.map(|ending| format!(".{ending}")).join(" ")
}

/// Where a name leads, however it is spelt; a link is a name of its own.
fn place(path: &Path) -> PathBuf {
    if path == Path::new("-") {
        return path.to_owned();
    }
    let Some(name) = path.file_name() else {
        return path.canonicalize().unwrap_or_else(|_| path.to_owned());
    };
    let folder = path.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."));
    folder.canonicalize().unwrap_or_else(|_| folder.to_owned()).join(name)
}

fn is_program(path: &Path) -> bool {
    let ending = path.extension().map(|ending| ending.to_ascii_lowercase());
    ending.is_some_and(|ending| ENDINGS.iter().any(|known| ending == *known))
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn a_folder_is_looked_through_in_the_order_of_names_and_never_for_ever() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir_all(at("b/c")).unwrap();
        fs::create_dir(at(".git")).unwrap();
        for name in
            ["z.NC", "b/c/2.tap", "b/1.ngc", "a.nc", "b/x.csv", ".git/q.nc", "b/._1.nc", "LIES"]
        {
            fs::write(at(name), "M2\n").unwrap();
        }
        symlink(folder.path(), at("b/loop")).unwrap();
        symlink(at("nowhere"), at("b/gone.nc")).unwrap();
        symlink(at("a.nc"), at("link.nc")).unwrap();
        let found = Found::of(&[folder.path().to_owned(), PathBuf::from("-")]).unwrap();
        let names: Vec<String> = found
            .programs
            .iter()
            .map(|program| {
                let path = &program.path;
                path.strip_prefix(folder.path()).unwrap_or(path).display().to_string()
            })
            .collect();
        assert_eq!(names, ["a.nc", "b/1.ngc", "b/c/2.tap", "b/gone.nc", "link.nc", "z.NC", "-"]);
        let wrong: Vec<usize> = (0..7).filter(|at| found.programs[*at].trouble.is_some()).collect();
        assert_eq!(wrong, [3]);
        assert_eq!(found.left_out, [(at("b/loop"), "a link to a folder")]);
        assert_eq!(found.others_by_ending().unwrap(), "1 .csv, 1 without ending");
    }

    #[test]
    fn a_program_is_there_once() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("b")).unwrap();
        for name in ["a.nc", "b/c.nc", "b/x.csv"] {
            fs::write(at(name), "M2\n").unwrap();
        }
        symlink(at("a.nc"), at("link.nc")).unwrap();
        let named = ["b/../b/c.nc", "", "b", "a.nc", "./b/", "./-", "-"].map(at);
        let named = [&named[..6], &[PathBuf::from("-")]].concat();
        let found = Found::of(&named).unwrap();
        let paths: Vec<&Path> = found.programs.iter().map(|entry| entry.path.as_path()).collect();
        let expected = [at("b/../b/c.nc"), at("a.nc"), at("link.nc"), at("./-"), "-".into()];
        assert_eq!(paths, expected);
        let is_named: Vec<bool> = found.programs.iter().map(|entry| entry.is_named).collect();
        assert_eq!(is_named, [true, true, false, true, true]);
        assert_eq!(found.others.len(), 1);
        assert!(Found::of(&["-".into(), "a.nc".into(), "-".into()]).is_err());
    }

    #[test]
    fn a_folder_without_programs_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let found = Found::of(&[folder.path().to_owned()]).unwrap();
        let reason = found.programs[0].trouble.as_ref().unwrap().to_string();
        assert!(reason.starts_with("holds no NC program (.nc .ngc"), "{reason}");
    }
}
