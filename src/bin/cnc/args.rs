//! The command line: commands and the options they share. Each command's own options stand in
//! its file under `cmd/`.

use clap::{ColorChoice, Parser, Subcommand};

use crate::cmd;

/// What `cnc --help` adds at its end.
const EXAMPLES: &str = "\
Examples:
  cnc interpret part.nc                      what a program means, and all that is wrong with it
  cnc interpolate part.nc                    time, ticks, extents, seams
  cnc interpolate part.nc --csv -o part.csv  the steps of every tick
  cnc verify part.nc part.csv                are those steps the programmed path?
  cnc cut part.nc --tool T --material M      does the spindle carry its feeds?
  cnc diff old.csv new.csv                   what a change of program or profile changes
  cnc plot part.nc -o part.svg               what it looks like, and how fast
  cnc report part.nc -o part.html            all about it on one page
  cnc send sim: part.nc                      run it on simulated nodes
  cnc send /dev/ttyUSB0 part.nc              run it on the machine
  cnc replay job.jsonl part.nc               how far each axis got when the link was lost
  cnc jog /dev/ttyUSB0 X --by -5             move one axis by 5 mm
  cnc home /dev/ttyUSB0                      send the axes to their switches
  cnc ports                                  which serial ports there are
  cnc machine show router                    what a machine can do
  cnc bus part.nc                            which interfaces keep up with a program
  cnc explain no-feed                        what a rule or a code means

Exit codes:
  0    done, nothing wrong
  1    the program, dump or job is bad
  2    usage, machine profile or file trouble
  3    the port, the bus or a node failed; the job did not finish
  130  interrupted

FILE may be - (standard input). Results go to standard output, messages to standard error.";

/// Turns NC programs into synchronised steps for machine tools with distributed axis controllers,
/// proves them right, and sends them over the serial bus
#[derive(Debug, Parser)]
#[command(name = "cnc", version, arg_required_else_help = true, after_help = EXAMPLES)]
pub struct Args {
    #[command(flatten)]
    pub global: Global,
    #[command(subcommand)]
    pub command: Command,
}

/// Options that every command takes.
#[derive(Clone, Debug, clap::Args)]
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
    Cut(cmd::cut::Args),
    Diff(cmd::diff::Args),
    Plot(cmd::plot::Args),
    Report(cmd::report::Args),
    Send(Box<cmd::send::Args>),
    Replay(cmd::replay::Args),
    Jog(cmd::jog::Args),
    Home(cmd::home::Args),
    Node(cmd::node::Args),
    Ports(cmd::ports::Args),
    Machine(cmd::machine::Args),
    Bus(Box<cmd::bus::Args>),
    Explain(cmd::explain::Args),
    Completions(cmd::completions::Args),
    Man(cmd::man::Args),
}
