//! `cnc`: NC programs go in, synchronised steps come out, proved correct on the way.
//!
//! Results go to standard output, all else to standard error. A command returns how it ended;
//! nothing below `main` ends the process.

#![allow(clippy::print_stdout, clippy::print_stderr)]

/// Says a line on standard error. Unlike `eprintln!` it goes on when nobody can read it any more:
/// a job must not die of a closed terminal.
macro_rules! say {
    ($($line:tt)*) => {{
        use std::io::Write as _;
        let _ = $crate::meter::above(|| writeln!(std::io::stderr(), $($line)*));
    }};
}

mod args;
mod cmd;
mod config;
mod environment;
mod examples;
mod exit;
mod fixed;
mod input;
mod interrupt;
mod journal;
mod language;
mod many;
mod meter;
mod output;
mod plural;
mod port;
mod program;
mod progress;
mod protocol;
mod refusal;
mod report;
mod table;

use std::process::ExitCode;

use crate::args::{Args, Command};

fn main() -> ExitCode {
    exit::code(args::parse().and_then(|args| run(&args)), args::wants_json())
}

fn run(args: &Args) -> exit::Outcome {
    let global = &args.global;
    meter::show(!global.quiet);
    match &args.command {
        Command::Interpret(args) => cmd::interpret::run(args, global),
        Command::Interpolate(args) => cmd::interpolate::run(args, global),
        Command::Verify(args) => cmd::verify::run(args, global),
        Command::Cut(args) => cmd::cut::run(args, global),
        Command::Diff(args) => cmd::diff::run(args, global),
        Command::Plot(args) => cmd::plot::run(args, global),
        Command::Report(args) => cmd::report::run(args, global),
        Command::Send(args) => cmd::send::run(args, global),
        Command::Replay(args) => cmd::replay::run(args, global),
        Command::Jog(args) => cmd::jog::run(args, global),
        Command::Home(args) => cmd::home::run(args, global),
        Command::Node(args) => cmd::node::run(args, global),
        Command::Ports(args) => cmd::ports::run(args, global),
        Command::Machine(args) => cmd::machine::run(args, global),
        Command::Bus(args) => cmd::bus::run(args, global),
        Command::Explain(args) => cmd::explain::run(args, global),
        Command::Completions(args) => cmd::completions::run(args, global),
        Command::Man(args) => cmd::man::run(args, global),
    }
}
