//! Variables `CNC_…`: defaults of options that come before those of `cnc.toml`.
//!
//! One that is empty counts as not set. What is wrong with a value is told by the variable's name. One that
//! nothing reads is told where it is most like one that is read: others may be another program's.

use std::env;
use std::ffi::OsStr;

use anyhow::{Context, anyhow};
use clap::builder::Resettable;
use clap::error::{ContextKind, ContextValue};
use clap::{Arg, Command};
use cnc::base::likeness::nearest;

use crate::args::{ChosenBy, Global};

const PREFIX: &str = "CNC_";

/// The command line without variables that are empty.
pub fn without_empty(command: Command) -> Command {
    without(command, &|name| env::var_os(name).is_some_and(|value| value.is_empty()))
}

/// The command line without some variables.
fn without(command: Command, unwanted: &dyn Fn(&OsStr) -> bool) -> Command {
    let command = command.mut_args(|arg| match arg.get_env() {
        Some(name) if unwanted(name) => arg.env(Resettable::Reset),
        _ => arg,
    });
    command.mut_subcommands(|command| without(command, unwanted))
}

/// Names the variable that a wrong value is from, if it is from one.
pub fn blamed(error: clap::Error, command: &Command) -> clap::Error {
    let named = |error: &clap::Error| error.get(ContextKind::InvalidArg).map(ToString::to_string);
    let Some(option) = named(&error) else { return error };
    for name in variables(command) {
        let without = without(command.clone(), &|other| *other == *name);
        let is_from_it = match without.try_get_matches() {
            Ok(_) => true,
            Err(other) => named(&other).as_ref() != Some(&option),
        };
        if is_from_it {
            let mut error = error;
            let told = ContextValue::String(format!("{name} ({option})"));
            error.insert(ContextKind::InvalidArg, told);
            return error;
        }
    }
    error
}

/// The variables that are read, each once.
fn variables(command: &Command) -> Vec<String> {
    let own = command.get_arguments().filter_map(Arg::get_env);
    let own = own.map(|name| name.to_string_lossy().into_owned());
    let mut names: Vec<String> = own.chain(command.get_subcommands().flat_map(variables)).collect();
    names.sort();
    names.dedup();
    names
}

/// Tells of variables that may be meant for an option, and are not.
pub fn warn(command: &Command) {
    let known = variables(command);
    let set = env::vars_os().filter_map(|(name, _)| name.into_string().ok());
    let mut unknown: Vec<String> =
        set.filter(|name| name.starts_with(PREFIX) && !known.contains(name)).collect();
    unknown.sort();
    for name in unknown {
        // What all have in common makes none like another.
        let bare = known.iter().filter_map(|known| known.strip_prefix(PREFIX));
        if let Some(near) = nearest(&name[PREFIX.len()..], bare) {
            say!("warning: nothing reads {name}; did you mean {PREFIX}{near}?");
        }
    }
}

/// Names who has chosen the machine that is no good, where the command line does not show it.
pub fn chosen<T>(loaded: anyhow::Result<T>, global: &Global) -> anyhow::Result<T> {
    match &global.machine_chosen_by {
        ChosenBy::Environment => loaded.context("CNC_MACHINE"),
        ChosenBy::Config(file, line) => loaded.with_context(|| anyhow!("{file}:{line}")),
        ChosenBy::Option | ChosenBy::Default => loaded,
    }
}
