//! `cnc`: NC programs go in, synchronised steps come out, proved correct on the way.

mod args;
mod cmd;
mod exit;
mod input;
mod progress;
mod report;

use std::process::ExitCode;

use clap::Parser;

use crate::args::{Args, Command};

fn main() -> ExitCode {
    let args = Args::parse();
    let global = &args.global;
    let outcome = match &args.command {
        Command::Interpret(args) => cmd::interpret::run(args, global),
        Command::Interpolate(args) => cmd::interpolate::run(args, global),
        Command::Verify(args) => cmd::verify::run(args, global),
        Command::Send(args) => cmd::send::run(args, global),
        Command::Node(args) => cmd::node::run(args, global),
        Command::Machine(args) => cmd::machine::run(args, global),
    };
    exit::code(outcome)
}
