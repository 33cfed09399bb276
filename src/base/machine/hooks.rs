//! `[hooks]` of a profile ⇄ commands that do what a program asks for besides motion: spindle,
//! coolant, tools, a user's own M functions.
//!
//! A command is a vector of arguments, handed to a program as they are: no shell reads them.
//! Placeholders (`{s}`, `{t}`, …) stand for what the event says; one that an event has no value for
//! is an error and never an empty argument. Nothing is run here.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::str::FromStr;

use super::keys::Keys;
use crate::base::{Axis, EventKind, Point};

/// How long a command may take unless the profile says otherwise.
pub const HOOK_TIMEOUT_S: f64 = 30.0;
/// Longest time-out: a day.
const TIMEOUT_MOST_S: f64 = 86_400.0;
/// Triggers that are offered where a key is misspelt.
const USUAL: [Trigger; 10] = [
    Trigger::M(3),
    Trigger::M(4),
    Trigger::M(5),
    Trigger::M(6),
    Trigger::M(7),
    Trigger::M(8),
    Trigger::M(9),
    Trigger::S,
    Trigger::T,
    Trigger::SurfaceSpeed,
];
/// Placeholders beside those of axes.
const PLACEHOLDERS: [&str; 10] = ["s", "t", "m", "line", "p", "q", "r", "e", "l", "d"];

/// What a command is there for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Trigger {
    /// An M function.
    M(u16),
    /// A spindle speed given by itself.
    S,
    /// A tool to get ready.
    T,
    /// A surface speed to keep (G96).
    SurfaceSpeed,
}

impl Trigger {
    /// What an event triggers; a dwell is time and nobody's work, and so is a question.
    pub fn of(event: EventKind) -> Option<Trigger> {
        match event {
            EventKind::M { code, .. } | EventKind::Function { code, .. } => Some(Trigger::M(code)),
            EventKind::WaitInput { .. } => Some(Trigger::M(66)),
            EventKind::S(_) => Some(Trigger::S),
            EventKind::T(_) => Some(Trigger::T),
            EventKind::SurfaceSpeed { .. } => Some(Trigger::SurfaceSpeed),
            EventKind::Dwell(_) | EventKind::NextBlock => None,
        }
    }
}

/// As a key of the profile: `M3`, `S`, `T`, `G96`.
impl fmt::Display for Trigger {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Trigger::M(code) => write!(f, "M{code}"),
            Trigger::S => write!(f, "S"),
            Trigger::T => write!(f, "T"),
            Trigger::SurfaceSpeed => write!(f, "G96"),
        }
    }
}

/// A key that triggers nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoTrigger;

impl FromStr for Trigger {
    type Err = NoTrigger;

    fn from_str(text: &str) -> Result<Trigger, NoTrigger> {
        let known = USUAL.into_iter().find(|trigger| trigger.to_string() == text);
        let m = || text.strip_prefix('M')?.parse().ok().filter(|code| *code <= 999).map(Trigger::M);
        // `M03` would be a second name of `M3`.
        known.or_else(m).filter(|trigger| trigger.to_string() == text).ok_or(NoTrigger)
    }
}

/// A command.
#[derive(Clone, Debug, PartialEq)]
pub struct Hook {
    /// The program and its arguments, with placeholders.
    pub command: Vec<String>,
    /// How long it may take.
    pub timeout_s: f64,
}

/// What an event and the job so far say, for placeholders.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Occasion {
    /// The event.
    pub event: EventKind,
    /// Its line of the NC program.
    pub line: u32,
    /// Spindle speed that was given last.
    pub spindle_rpm: Option<f64>,
    /// Tool that was selected last.
    pub tool: Option<u32>,
    /// Where the machine stands, in machine coordinates.
    pub at_mm: Point,
}

/// A placeholder that an event has no value for.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("its hook has {{{placeholder}}}, and the program has given none by then")]
pub struct NoValue {
    /// The placeholder, without its braces.
    pub placeholder: String,
}

impl Occasion {
    /// What a placeholder stands for.
    fn value(&self, placeholder: &str) -> Option<String> {
        let letter = match placeholder.as_bytes() {
            [letter] => letter.to_ascii_uppercase(),
            _ => return (placeholder == "line").then(|| self.line.to_string()),
        };
        if let Some(axis) = Axis::from_letter(letter) {
            return Some(self.at_mm[axis].to_string());
        }
        let own = self.word(letter);
        match letter {
            b'S' => own.or(self.spindle_rpm.map(|rpm| rpm.to_string())),
            b'T' => own.or(self.tool.map(|tool| tool.to_string())),
            _ => own,
        }
    }

    /// What the event itself says with a letter.
    fn word(&self, letter: u8) -> Option<String> {
        let text = self.event.to_string();
        let mut words = text.split_ascii_whitespace();
        let word = words.find(|word| word.as_bytes().first() == Some(&letter))?;
        word.get(1..).map(str::to_owned)
    }
}

impl Hook {
    /// The program and its arguments for an event.
    ///
    /// # Errors
    /// Names a placeholder that the event has no value for.
    pub fn arguments(&self, occasion: &Occasion) -> Result<Vec<String>, NoValue> {
        let fill = |argument: &String| {
            let mut filled = String::new();
            for part in parts(argument) {
                match part {
                    Part::Text(text) => filled.push_str(text),
                    Part::Placeholder(name) => filled.push_str(
                        &occasion
                            .value(name)
                            .ok_or_else(|| NoValue { placeholder: name.to_owned() })?,
                    ),
                }
            }
            Ok(filled)
        };
        self.command.iter().map(fill).collect()
    }
}

/// The commands of a machine.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hooks(BTreeMap<Trigger, Hook>);

impl Hooks {
    /// The command for an event, if there is one.
    pub fn of(&self, event: EventKind) -> Option<&Hook> {
        self.0.get(&Trigger::of(event)?)
    }

    /// Whether there is none at all.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// All commands, and what they are for.
    pub fn iter(&self) -> impl Iterator<Item = (Trigger, &Hook)> {
        self.0.iter().map(|(trigger, hook)| (*trigger, hook))
    }

    /// What is allowed but will not work as hoped.
    pub(super) fn warning(&self) -> Option<String> {
        let turning =
            [Trigger::M(3), Trigger::M(4)].into_iter().find(|t| self.0.contains_key(t))?;
        (!self.0.contains_key(&Trigger::S)).then(|| {
            format!(
                "hooks: {turning} has a command and S has none: a spindle speed that a program \
                 gives by itself is reported and passed"
            )
        })
    }

    /// Reads `[hooks]`.
    pub(super) fn read(keys: &mut Keys<'_>) -> Hooks {
        let mut hooks = BTreeMap::new();
        if !keys.has_table("hooks") {
            return Hooks(hooks);
        }
        let timeout_s = timeout_if(keys, "hooks.timeout_s").unwrap_or(HOOK_TIMEOUT_S);
        let named = keys.names("hooks");
        let named = named.iter().filter_map(|name| name.parse().ok());
        for trigger in USUAL.into_iter().chain(named).collect::<BTreeSet<Trigger>>() {
            if let Some(hook) = hook(keys, &format!("hooks.{trigger}"), timeout_s) {
                hooks.insert(trigger, hook);
            }
        }
        Hooks(hooks)
    }

    /// The table in its canonical form; nothing if there are no commands.
    pub(super) fn text(&self) -> String {
        if self.is_empty() {
            return String::new();
        }
        let line = |(trigger, hook): (Trigger, &Hook)| {
            let command = toml::Value::from(hook.command.clone());
            let timeout_s = toml::Value::Float(hook.timeout_s);
            format!("{trigger} = {{ command = {command}, timeout_s = {timeout_s} }}\n")
        };
        "\n[hooks]\n".to_owned() + &self.iter().map(line).collect::<String>()
    }
}

fn timeout_if(keys: &mut Keys<'_>, path: &str) -> Option<f64> {
    keys.number_if(path, 0.1..=TIMEOUT_MOST_S)
}

/// A command alone, or `{ command = […], timeout_s = … }`.
fn hook(keys: &mut Keys<'_>, path: &str, timeout_s: f64) -> Option<Hook> {
    if !keys.is_table(path) {
        return Some(Hook { command: command(keys, path)?, timeout_s });
    }
    let timeout_s = timeout_if(keys, &format!("{path}.timeout_s")).unwrap_or(timeout_s);
    let path = format!("{path}.command");
    let command = command(keys, &path);
    if command.is_none() {
        keys.must_have(&path);
    }
    Some(Hook { command: command?, timeout_s })
}

fn command(keys: &mut Keys<'_>, path: &str) -> Option<Vec<String>> {
    let command = keys.strings_if(path)?;
    let example = || Some("as in [\"/usr/local/bin/spindle\", \"--rpm\", \"{s}\"]".to_owned());
    let program = command.first().map_or("", String::as_str);
    if program.is_empty() || program.contains(['{', '}']) {
        keys.wrong(path, "a program and its arguments are expected".into(), example());
    }
    if command.iter().any(|argument| argument.contains('\0')) {
        keys.wrong(path, "an argument cannot hold a NUL".into(), None);
    }
    let names = command.iter().flat_map(|argument| parts(argument)).filter_map(|part| match part {
        Part::Placeholder(name) if !is_placeholder(name) => Some(name.to_owned()),
        _ => None,
    });
    if let Some(name) = names.into_iter().next() {
        let help = format!(
            "known are {{{}}} and the axes; write {{{{ for a brace",
            PLACEHOLDERS.join("}, {")
        );
        keys.wrong(path, format!("unknown placeholder {{{name}}}"), Some(help));
    }
    Some(command)
}

fn is_placeholder(name: &str) -> bool {
    let axis = |letter: u8| letter.is_ascii_lowercase().then(|| letter.to_ascii_uppercase());
    PLACEHOLDERS.contains(&name)
        || matches!(name.as_bytes(), [letter] if axis(*letter).and_then(Axis::from_letter).is_some())
}

/// A piece of an argument.
#[derive(Debug, PartialEq)]
enum Part<'a> {
    Text(&'a str),
    /// What stands between braces.
    Placeholder(&'a str),
}

/// Cuts an argument at its placeholders; `{{` and `}}` are braces, and so is one without its other.
fn parts(argument: &str) -> Vec<Part<'_>> {
    let mut parts = Vec::new();
    let mut rest = argument;
    while let Some(at) = rest.find(['{', '}']) {
        let (text, brace) = rest.split_at(at);
        parts.push(Part::Text(text));
        let doubled = brace.starts_with("{{") || brace.starts_with("}}");
        let name = brace.strip_prefix('{').and_then(|inner| inner.split_once('}'));
        rest = match name {
            Some((name, after)) if !doubled => {
                parts.push(Part::Placeholder(name));
                after
            }
            _ => {
                parts.push(Part::Text(&brace[..1]));
                &brace[if doubled { 2 } else { 1 }..]
            }
        };
    }
    parts.push(Part::Text(rest));
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(command: &[&str], event: &str) -> Result<Vec<String>, NoValue> {
        let command = command.iter().map(|part| (*part).to_owned()).collect();
        let mut at_mm = Point::ZERO;
        at_mm[Axis::Y] = -12.5;
        Hook { command, timeout_s: 1.0 }.arguments(&Occasion {
            event: event.parse().unwrap(),
            line: 7,
            spindle_rpm: Some(800.0),
            tool: None,
            at_mm,
        })
    }

    #[test]
    fn placeholders_stand_for_what_the_event_says() {
        let line = ["a", "--rpm={s}", "{m}@{line}", "x{y}", "{{s}}", "{"];
        assert_eq!(
            filled(&line, "M3 S1200").unwrap(),
            ["a", "--rpm=1200", "3@7", "x-12.5", "{s}", "{"]
        );
        assert_eq!(filled(&["a", "{s}"], "M5").unwrap(), ["a", "800"]);
        assert_eq!(filled(&["a", "{p}/{q}"], "M101 P1 Q2.5").unwrap(), ["a", "1/2.5"]);
        let missing = |command, event| filled(&[command], event).unwrap_err().placeholder;
        assert_eq!(missing("{t}", "M6"), "t");
        assert_eq!(missing("{m}", "S100"), "m");
        assert_eq!(missing("{q}", "M101 P1"), "q");
    }
}
