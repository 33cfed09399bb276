//! Programs as texts, checked and run.

use cnc::base::{Machine, Source};
use cnc::interp::{self, Checked, Motion, Move, Options};

pub fn check(text: &[u8], machine: &Machine) -> Checked {
    check_with(text, machine, &Options::default())
}

pub fn check_with(text: &[u8], machine: &Machine, options: &Options) -> Checked {
    let source = Source::memory("test.nc", text);
    // Loops that never end are given up soon.
    let options = Options { max_passes: Some(1000), ..options.clone() };
    interp::check(&source, machine, &options, 1000).unwrap()
}

pub fn moves(text: &str, machine: &Machine) -> Vec<Move> {
    let source = Source::memory("test.nc", text.as_bytes());
    interp::motions(&source, machine, &Options::default())
        .filter_map(|motion| match motion.unwrap() {
            Motion::Move(step) => Some(step),
            Motion::Event(_) => None,
        })
        .collect()
}

pub fn ideal() -> Machine {
    Machine::load("ideal").unwrap()
}
