//! `cnc interpolate`

use crate::args::Global;
use crate::exit::{Exit, Outcome};

#[derive(Debug, clap::Args)]
pub struct Args {}

pub fn run(_args: &Args, _global: &Global) -> Outcome {
    Ok(Exit::Ok)
}
