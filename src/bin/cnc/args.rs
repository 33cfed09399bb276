//! The command line: commands and the options they share. Each command's own options stand in
//! its file under `cmd/`.

use std::collections::BTreeSet;

use anyhow::anyhow;
use clap::parser::ValueSource;
use clap::{ArgMatches, ColorChoice, CommandFactory, FromArgMatches, Parser, Subcommand};
use cnc::base::{Config, config::Setting};

use crate::exit::Failure;
use crate::{cmd, config, environment, examples, refusal};

/// `--help`: what it is, how it is used, and then all of it.
const HELP: &str =
    "{about-with-newline}\n{before-help}{usage-heading} {usage}\n\n{all-args}{after-help}";

/// Turn NC programs into synchronised steps for machine tools with distributed axis controllers,
/// prove them right, and send them over the serial bus
#[derive(Debug, Parser)]
#[command(name = "cnc", version, arg_required_else_help = true, after_help = examples::CODES)]
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
    /// Print errors only: no warnings, no progress
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Say more
    #[arg(short, long, global = true)]
    pub verbose: bool,
    /// When to colour messages; by default on a terminal, unless NO_COLOR is set
    #[arg(long, global = true, value_enum, env = "CNC_COLOR", hide_env = true, default_value_t = ColorChoice::Auto, value_name = "WHEN")]
    pub color: ColorChoice,
    /// Never ask anything
    #[arg(long, global = true, env = "CNC_NO_INPUT", hide_env = true, value_parser = yes_or_no)]
    pub no_input: bool,
    /// Print at most this many errors of a program; all are counted
    #[arg(
        long,
        global = true,
        env = "CNC_MAX_ERRORS",
        hide_env = true,
        default_value_t = 100,
        value_name = "N"
    )]
    pub max_errors: usize,
    /// What `cnc.toml` says.
    #[arg(skip)]
    pub config: Config,
    /// Why the user's own says nothing, though it may be there.
    #[arg(skip)]
    pub config_unread: Option<String>,
    /// Long names of the options that stand on the command line.
    #[arg(skip)]
    pub given: BTreeSet<String>,
    /// Who has chosen the machine.
    #[arg(skip)]
    pub machine_chosen_by: ChosenBy,
}

impl Global {
    /// Refuses options, by their long names, that would have no effect.
    pub fn refuse(&self, options: &[&str], why: &str) -> anyhow::Result<()> {
        match options.iter().find(|option| self.given.contains(**option)) {
            Some(option) => Err(anyhow!("--{option} has no effect: {why}")),
            None => Ok(()),
        }
    }
}

/// Where the value of an option is from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum ChosenBy {
    /// Nobody has said anything.
    #[default]
    Default,
    /// The command line.
    Option,
    /// A variable `CNC_…`.
    Environment,
    /// A `cnc.toml`: its name and the line.
    Config(String, u32),
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

/// A variable or a key that says yes or no.
fn yes_or_no(text: &str) -> Result<bool, String> {
    match text.to_ascii_lowercase().as_str() {
        "1" | "true" | "yes" | "y" | "on" => Ok(true),
        "0" | "false" | "no" | "n" | "off" => Ok(false),
        _ => Err("1, true, yes or on is expected, or 0, false, no or off".to_owned()),
    }
}

/// Reads the command line, what it leaves open from the environment, and the rest from `cnc.toml`.
/// Help and mistakes end the process here.
pub fn parse() -> Result<Args, Failure> {
    let command = environment::without_empty(command());
    let said = read(&command).1;
    let (config, unread) = config::load(&said.global)?;
    if !said.global.quiet {
        environment::warn(&command);
        unread
            .iter()
            .for_each(|reason| say!("warning: the user's own configuration is not read: {reason}"));
    }
    let command = with_defaults(command, &config);
    let (matches, mut args) = read(&command);
    args.global.machine_chosen_by = chosen_by(&matches, "machine", &config);
    args.global.given = given(&command, &matches);
    args.global.config = config;
    args.global.config_unread = unread;
    Ok(args)
}

fn read(command: &clap::Command) -> (ArgMatches, Args) {
    let matches = command.clone().try_get_matches();
    let matches = matches.unwrap_or_else(|error| end(environment::blamed(error, command)));
    let args = Args::from_arg_matches(&matches).unwrap_or_else(|error| end(error));
    (matches, args)
}

/// Prints help, or what is wrong with the command line, and ends the process.
fn end(error: clap::Error) -> ! {
    if error.use_stderr() && wants_json() {
        let said = error.render().to_string();
        let first = said.split("\n\n").next().unwrap_or_default();
        let words: Vec<&str> =
            first.split_whitespace().skip_while(|word| *word == "error:").collect();
        refusal::print(2, &words.join(" "), &[]);
    }
    error.exit()
}

/// Whether results are wanted as JSON: known even where the rest of the command line makes no sense.
pub fn wants_json() -> bool {
    let mut options = std::env::args_os().skip(1).take_while(|argument| argument != "--");
    options.any(|argument| argument == "--json")
}

/// The command line, with examples first in every help, and numbers below zero as values of options.
pub fn command() -> clap::Command {
    with_help(Args::command(), |command, text| {
        command.before_help(format!("Examples:\n{text}")).help_template(HELP)
    })
}

/// The same for manual pages, which have examples at their end.
pub fn command_for_man() -> clap::Command {
    with_help(Args::command(), |command, text| {
        let more = command.get_after_help().map(|text| format!("\n\n{text}")).unwrap_or_default();
        command.after_help(format!("Examples:\n{text}{more}"))
    })
}

fn with_help(
    command: clap::Command,
    give: fn(clap::Command, &'static str) -> clap::Command,
) -> clap::Command {
    let command = match examples::of(command.get_name()) {
        Some(text) => give(command, text),
        None => command,
    };
    let command = command.mut_args(|arg| match arg.get_long() {
        Some(_) if arg.get_action().takes_values() => arg.allow_negative_numbers(true),
        _ => arg,
    });
    command.mut_subcommands(|command| with_help(command, give))
}

/// The command line with what `cnc.toml` says in place of its own defaults.
fn with_defaults(command: clap::Command, config: &Config) -> clap::Command {
    let command = command.mut_args(|arg| match config.settings.get(arg.get_id().as_str()) {
        Some(setting) => arg.default_value(setting.value.clone()),
        None => arg,
    });
    command.mut_subcommands(|command| with_defaults(command, config))
}

/// Long names of the options that stand on the command line, those of the subcommand among them.
fn given(command: &clap::Command, matches: &ArgMatches) -> BTreeSet<String> {
    let is_given = |arg: &&clap::Arg| {
        matches.try_contains_id(arg.get_id().as_str()).is_ok()
            && matches.value_source(arg.get_id().as_str()) == Some(ValueSource::CommandLine)
    };
    let names = command.get_arguments().filter(is_given).filter_map(clap::Arg::get_long);
    let mut names: BTreeSet<String> = names.map(str::to_owned).collect();
    if let Some((name, matches)) = matches.subcommand()
        && let Some(command) = command.find_subcommand(name)
    {
        names.extend(given(command, matches));
    }
    names
}

fn chosen_by(matches: &ArgMatches, option: &str, config: &Config) -> ChosenBy {
    match (matches.value_source(option), config.settings.get(option)) {
        (Some(ValueSource::CommandLine), _) => ChosenBy::Option,
        (Some(ValueSource::EnvVariable), _) => ChosenBy::Environment,
        (_, Some(Setting { file, line, .. })) => ChosenBy::Config(file.clone(), *line),
        _ => ChosenBy::Default,
    }
}
