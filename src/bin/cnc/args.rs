//! The command line: commands and the options they share. Each command's own options stand in
//! its file under `cmd/`.

use clap::{ColorChoice, Parser, Subcommand};

use crate::cmd;

/// Headless toolchain for machine tools with distributed axis controllers on a serial bus.
#[derive(Debug, Parser)]
#[command(name = "cnc", version, arg_required_else_help = true)]
pub struct Args {
    #[command(flatten)]
    pub global: Global,
    #[command(subcommand)]
    pub command: Command,
}

/// Options that every command takes.
#[derive(Debug, clap::Args)]
pub struct Global {
    /// Machine profile: a built-in name or a TOML file
    #[arg(short, long, global = true, env = "CNC_MACHINE", default_value = cnc::base::machine::DEFAULT, value_name = "NAME|FILE")]
    pub machine: String,
    /// Print results as JSON on standard output
    #[arg(long, global = true)]
    pub json: bool,
    /// Print errors only
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Say more
    #[arg(short, long, global = true)]
    pub verbose: bool,
    /// When to colour messages
    #[arg(long, global = true, value_enum, default_value_t = ColorChoice::Auto, value_name = "WHEN")]
    pub color: ColorChoice,
    /// Never ask anything
    #[arg(long, global = true)]
    pub no_input: bool,
    /// Print at most this many errors of a program; all are counted
    #[arg(long, global = true, default_value_t = 100, value_name = "N")]
    pub max_errors: usize,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    Interpret(cmd::interpret::Args),
    Interpolate(cmd::interpolate::Args),
    Verify(cmd::verify::Args),
    Send(cmd::send::Args),
    Node(cmd::node::Args),
    Machine(cmd::machine::Args),
}
