//! Where each value of a machine is from: a line of its profile, or a default.

use std::collections::BTreeMap;
use std::io::{self, Write};

use anyhow::Context;
use cnc::base::Machine;
use cnc::base::machine::{BUILT_IN, written};
use serde_json::{Map, Value, json};

use crate::args::{ChosenBy, Global};

/// A value of a machine.
pub struct Origin {
    path: String,
    value: String,
    /// The line of the profile that says so; none: nothing does.
    line: Option<u32>,
    /// The profile.
    profile: String,
    is_built_in: bool,
}

/// Who has chosen the profile.
pub fn chooser(is_named: bool, global: &Global) -> String {
    match &global.machine_chosen_by {
        _ if is_named => "the command line".to_owned(),
        ChosenBy::Option => "--machine".to_owned(),
        ChosenBy::Environment => "CNC_MACHINE".to_owned(),
        ChosenBy::Config(file, line) => format!("{file}:{line}"),
        ChosenBy::Default => "default".to_owned(),
    }
}

/// Every value of a machine, in the order of its canonical form.
pub fn of(machine: &Machine, name_or_file: &str) -> anyhow::Result<Vec<Origin>> {
    let text = Machine::text(name_or_file).with_context(|| name_or_file.to_owned())?;
    let is_built_in = BUILT_IN.iter().any(|(id, _)| *id == name_or_file);
    let said: BTreeMap<String, u32> =
        written(&text).into_iter().map(|written| (written.path, written.line)).collect();
    let values = written(machine.to_toml()).into_iter().map(|value| {
        // A hook may be written as its command alone.
        let short = value.path.strip_suffix(".command").and_then(|path| said.get(path));
        let line = said.get(&value.path).or(short).copied();
        Origin {
            path: value.path,
            value: value.value,
            line,
            profile: name_or_file.to_owned(),
            is_built_in,
        }
    });
    Ok(values.collect())
}

/// A line a value.
pub fn print(out: &mut impl Write, origins: &[Origin]) -> io::Result<()> {
    let width = |text: fn(&Origin) -> &str| {
        origins.iter().map(|origin| text(origin).chars().count()).max().unwrap_or(0)
    };
    let (key, value) = (width(|origin| &origin.path), width(|origin| &origin.value));
    writeln!(out)?;
    writeln!(out, "{:key$}  {:value$}  from", "key", "value")?;
    for Origin { path, value: is, line, profile, is_built_in } in origins {
        let from = match line {
            Some(line) if *is_built_in => format!("built in, line {line}"),
            Some(line) => format!("{profile}:{line}"),
            None => "default".to_owned(),
        };
        writeln!(out, "{path:key$}  {is:value$}  {from}")?;
    }
    Ok(())
}

/// By their keys: the kind of source, and the line there.
pub fn as_json(origins: &[Origin]) -> Value {
    let origin = |origin: &Origin| match origin.line {
        Some(line) if origin.is_built_in => json!({"source": "built-in", "line": line}),
        Some(line) => json!({"source": "file", "line": line}),
        None => json!({"source": "default"}),
    };
    Value::Object(origins.iter().map(|o| (o.path.clone(), origin(o))).collect::<Map<_, _>>())
}
