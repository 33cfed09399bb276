//! Programs as ways from rest to rest.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use cnc::base::{Machine, Source};
use cnc::interp::{self, Options};
use cnc::path::{self, Corner, PathItem, Segment};

/// Samples that are run anyway.
const SAMPLES: [&str; 2] = ["kimm-test.nc", "pyramid-with-pockets.nc"];

/// A program, whatever machine it is for.
pub struct Program {
    pub name: String,
    /// What is run between stops that it asks for, with corners as they are.
    pub stretches: Vec<Vec<Segment>>,
}

/// The samples, and what is in the folder that `CNC_PROGRAMS` names.
pub fn programs() -> Vec<Program> {
    let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/good");
    let mut paths: Vec<PathBuf> = SAMPLES.iter().map(|name| samples.join(name)).collect();
    if let Some(folder) = std::env::var_os("CNC_PROGRAMS") {
        let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        paths.extend(entries.filter(|path| path.is_file()));
    }
    paths.sort();
    paths.iter().filter_map(|path| program(path)).collect()
}

/// Tells a figure where somebody asks for figures: not among the tests of every day.
pub fn tell(text: &str) {
    if std::env::var_os("CNC_PROGRAMS").is_some() {
        let mut stderr = std::io::stderr().lock();
        writeln!(stderr, "{text}").unwrap();
    }
}

/// None where the program is refused.
fn program(path: &Path) -> Option<Program> {
    let name = path.file_name()?.to_string_lossy().into_owned();
    let mut machine = Machine::load("starmill").unwrap();
    machine.axes.iter_mut().for_each(|axis| axis.travel_mm = Some([-1e4, 1e4]));
    let source = Source::memory(&name, fs::read(path).unwrap());
    let options = Options::default();
    let checked = interp::check(&source, &machine, &options, 10).unwrap();
    if checked.errors > 0 {
        tell(&format!("{name}: refused"));
        return None;
    }
    let mut stretches = vec![Vec::new()];
    for item in path::segments(interp::motions(&source, &machine, &options), &machine) {
        let is_stop = match item.unwrap() {
            PathItem::Event(_) => true,
            PathItem::Segment(segment) => {
                let mut segment = Segment::clone(&segment);
                let is_stop = segment.corner == Corner::Stop;
                segment.corner = Corner::Exact;
                if segment.length_mm() > 0.0 {
                    stretches.last_mut()?.push(segment);
                }
                is_stop
            }
        };
        if is_stop {
            stretches.push(Vec::new());
        }
    }
    stretches.retain(|stretch| !stretch.is_empty());
    Some(Program { name, stretches })
}
