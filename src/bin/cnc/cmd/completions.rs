//! `cnc completions`: what a shell needs to complete commands and options.

use std::io::{self, Write};

use clap_complete::Shell;

use crate::args::{self, Global};
use crate::exit::{Exit, Outcome, unless_unread};

/// Print completions for a shell
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

pub fn run(args: &Args, global: &Global) -> Outcome {
    global.refuse(&["json", "machine"], "a script for a shell is printed")?;
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut args::command(), "cnc", &mut script);
    unless_unread(io::stdout().lock().write_all(&script))?;
    Ok(Exit::Ok)
}
