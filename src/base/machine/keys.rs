//! TOML text → typed values, each asked for by its path (`axes.X.travel_mm`).
//!
//! The rule: what nobody asked for is an unknown key, so no key can be accepted and ignored.
//! Every fault is collected with its place, and a value at fault reads as a stand-in: the caller
//! looks at the faults before it uses any value. Knows nothing of machines.

use std::collections::BTreeSet;
use std::ops::{Range, RangeInclusive};

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::base::likeness::nearest;
use crate::base::{Diagnostic, Severity, Span};

/// Faults kept: a text with more is no profile at all.
const FAULTS_MAX: usize = 100;
/// Bytes of a line kept on each side of a fault.
const EXCERPT_BYTES: usize = 100;

/// A parsed text, the keys asked of it so far, and what was wrong with them.
pub(in crate::base) struct Keys<'t> {
    text: &'t str,
    root: Spanned<DeTable<'t>>,
    asked: BTreeSet<String>,
    missing: Vec<String>,
    faults: Vec<Diagnostic>,
}

impl<'t> Keys<'t> {
    /// Parses a text; errors of syntax are collected like all others.
    pub fn parse(text: &'t str) -> Self {
        let (root, errors) = DeTable::parse_recoverable(text);
        let mut keys =
            Keys { text, root, asked: BTreeSet::new(), missing: Vec::new(), faults: Vec::new() };
        for error in errors {
            let place = error.span().unwrap_or(0..0);
            keys.fault("profile-syntax", place, error.message().to_owned(), None);
        }
        keys
    }

    /// Whether a table is there, which may be left out.
    pub fn has_table(&mut self, path: &str) -> bool {
        match self.ask(path).map(Spanned::get_ref) {
            Some(DeValue::Table(_)) => true,
            Some(_) => {
                self.wrong(path, "a table is expected here".into(), None);
                false
            }
            None => false,
        }
    }

    /// Whether a table is there; anything else is no fault.
    pub fn is_table(&mut self, path: &str) -> bool {
        matches!(self.ask(path).map(Spanned::get_ref), Some(DeValue::Table(_)))
    }

    /// Notes that a key is missing, unless something is wrong with it.
    pub fn must_have(&mut self, path: &str) {
        if self.ask(path).is_none() {
            self.missing.push(path.to_owned());
        }
    }

    /// Whether a table is there that must be.
    pub fn table(&mut self, path: &str) -> bool {
        if self.ask(path).is_none() {
            self.missing.push(path.to_owned());
            return false;
        }
        self.has_table(path)
    }

    /// The keys of a table whose names are the user's, in their order.
    pub fn names(&mut self, path: &str) -> Vec<String> {
        if !self.has_table(path) {
            return Vec::new();
        }
        let table = self.value(path).and_then(|value| value.get_ref().as_table());
        let names = table.into_iter().flatten().map(|(key, _)| key.get_ref().to_string());
        // A path with a dot would lead elsewhere.
        let (dotted, names): (Vec<_>, Vec<_>) = names.partition(|name| name.contains('.'));
        for name in dotted {
            self.wrong(path, format!("the name '{name}' holds a dot"), None);
        }
        names
    }

    /// A number that may be left out.
    pub fn number_if(&mut self, path: &str, range: RangeInclusive<f64>) -> Option<f64> {
        match self.ask(path).map(|value| as_number(value.get_ref())) {
            None => None,
            Some(Some(number)) if range.contains(&number) => Some(number),
            Some(number) => {
                self.out_of_range(path, number.is_some(), "a number", &range);
                Some(*range.start())
            }
        }
    }

    /// A number that must be there.
    pub fn number(&mut self, path: &str, range: RangeInclusive<f64>) -> f64 {
        let stand_in = *range.start();
        let number = self.number_if(path, range);
        self.required(path, number, stand_in)
    }

    /// Two numbers, the first below the second, that may be left out.
    pub fn interval_if(&mut self, path: &str, range: RangeInclusive<f64>) -> Option<[f64; 2]> {
        let found: Option<Vec<_>> = match self.ask(path)?.get_ref() {
            DeValue::Array(items) => items.iter().map(|item| as_number(item.get_ref())).collect(),
            _ => None,
        };
        match found.as_deref() {
            Some(&[low, high]) if low < high && range.contains(&low) && range.contains(&high) => {
                return Some([low, high]);
            }
            Some([low, high]) if low >= high => {
                let help = format!("write [{high:?}, {low:?}]");
                let help = (low > high).then_some(help);
                self.wrong(path, "the least position must come first".into(), help);
            }
            _ => self.wrong(
                path,
                format!(
                    "two numbers from {} to {} are expected: [least, greatest]",
                    range.start(),
                    range.end()
                ),
                None,
            ),
        }
        None
    }

    /// A whole number that may be left out.
    pub fn integer_if(&mut self, path: &str, range: RangeInclusive<u32>) -> Option<u32> {
        let found = match self.ask(path)?.get_ref() {
            DeValue::Integer(text) => Some(i64::from_str_radix(text.as_str(), text.radix()).ok()),
            _ => None,
        };
        match found.flatten().and_then(|number| u32::try_from(number).ok()) {
            Some(number) if range.contains(&number) => Some(number),
            _ => {
                self.out_of_range(path, found.is_some(), "a whole number", &range);
                Some(*range.start())
            }
        }
    }

    /// A whole number that must be there.
    pub fn integer(&mut self, path: &str, range: RangeInclusive<u32>) -> u32 {
        let stand_in = *range.start();
        let number = self.integer_if(path, range);
        self.required(path, number, stand_in)
    }

    /// A list of whole numbers that may be left out.
    pub fn integers_if(&mut self, path: &str, range: RangeInclusive<u32>) -> Vec<u32> {
        let Some(value) = self.ask(path) else { return Vec::new() };
        let number = |value: &DeValue<'_>| match value {
            DeValue::Integer(text) => {
                u32::from_str_radix(text.as_str(), text.radix()).ok().filter(|n| range.contains(n))
            }
            _ => None,
        };
        let found: Option<Vec<u32>> = match value.get_ref() {
            DeValue::Array(items) => items.iter().map(|item| number(item.get_ref())).collect(),
            _ => None,
        };
        if found.is_none() {
            let (least, most) = (range.start(), range.end());
            let message = format!("a list of whole numbers from {least} to {most} is expected");
            self.wrong(path, message, None);
        }
        found.unwrap_or_default()
    }

    /// A string that may be left out.
    pub fn string_if(&mut self, path: &str) -> Option<String> {
        match self.ask(path)?.get_ref() {
            DeValue::String(text) => Some(text.to_string()),
            _ => {
                self.wrong(path, "a string in quotes is expected".into(), None);
                None
            }
        }
    }

    /// `true` or `false`, which may be left out.
    pub fn boolean_if(&mut self, path: &str) -> Option<bool> {
        match self.ask(path)?.get_ref() {
            DeValue::Boolean(value) => Some(*value),
            _ => {
                self.wrong(path, "true or false is expected".into(), None);
                None
            }
        }
    }

    /// A list of strings that may be left out.
    pub fn strings_if(&mut self, path: &str) -> Option<Vec<String>> {
        let found: Option<Vec<String>> = match self.ask(path)?.get_ref() {
            DeValue::Array(items) => {
                items.iter().map(|item| item.get_ref().as_str().map(str::to_owned)).collect()
            }
            _ => None,
        };
        if found.is_none() {
            self.wrong(path, "a list of strings in quotes is expected".into(), None);
        }
        found
    }

    /// One of a few words; without a `default` it must be there.
    pub fn choice<T: Copy>(&mut self, path: &str, of: &[(&str, T)], default: Option<T>) -> T {
        let stand_in = default.unwrap_or(of[0].1);
        let absent = self.ask(path).is_none();
        let Some(word) = self.string_if(path) else {
            if absent && default.is_none() {
                self.missing.push(path.to_owned());
            }
            return stand_in;
        };
        match of.iter().find(|(name, _)| *name == word) {
            Some((_, value)) => *value,
            None => {
                let names: Vec<&str> = of.iter().map(|(name, _)| *name).collect();
                let help = match nearest(&word, names.iter().copied()) {
                    Some(name) => format!("did you mean \"{name}\"?"),
                    None => format!("known are {}", names.join(", ")),
                };
                self.wrong(path, format!("unknown value \"{word}\""), Some(help));
                stand_in
            }
        }
    }

    /// The line of a value, if it is there.
    pub fn line(&self, path: &str) -> Option<u32> {
        self.value(path).map(|value| line_of(self.text, value.span().start))
    }

    /// Says what is wrong with the value at a path.
    pub fn wrong(&mut self, path: &str, message: String, help: Option<String>) {
        let place = self.value(path).map_or(0..0, Spanned::span);
        self.fault("profile-value", place, format!("{path}: {message}"), help);
    }

    /// Once all keys have been asked for: notes those that nobody asked for and those that are
    /// missing, and says whether nothing at all was wrong.
    pub fn check_complete(&mut self) -> bool {
        // After an error of syntax what is missing may stand in the part that cannot be read.
        if self.faults.iter().any(|fault| fault.rule == "profile-syntax") {
            self.faults.retain(|fault| fault.rule == "profile-syntax");
            return false;
        }
        let mut unknown = Vec::new();
        self.find_unknown("", self.root.get_ref(), &mut unknown);
        let mut misspelt = BTreeSet::new();
        for (path, place) in unknown.into_iter().take(FAULTS_MAX) {
            let (table, key) = path.rsplit_once('.').unwrap_or(("", &path));
            let prefix = if table.is_empty() { String::new() } else { format!("{table}.") };
            let known = self.asked.iter().filter_map(|path| path.strip_prefix(&prefix));
            let free =
                |key: &&str| !key.contains('.') && self.value(&format!("{prefix}{key}")).is_none();
            let meant = nearest(key, known.filter(free)).map(str::to_owned);
            let message = match table {
                "" => format!("unknown key '{key}'"),
                table => format!("unknown key '{key}' in [{table}]"),
            };
            let help = meant.as_ref().map(|key| format!("did you mean '{key}'?"));
            misspelt.extend(meant.map(|key| format!("{prefix}{key}")));
            self.fault("profile-unknown-key", place, message, help);
        }
        for path in std::mem::take(&mut self.missing) {
            if !misspelt.contains(&path) {
                let table = path.rsplit_once('.').and_then(|(table, _)| self.header(table));
                let place = table.unwrap_or(0..0);
                self.fault("profile-missing-key", place, format!("{path} is missing"), None);
            }
        }
        self.faults.is_empty()
    }

    /// What was wrong, in the order of the text; of very many faults only some.
    pub fn into_faults(mut self) -> Vec<Diagnostic> {
        self.faults.sort_by_key(|fault| (fault.span.line, fault.span.start));
        self.faults
    }

    /// The value at a path, noting that somebody knows this key.
    fn ask(&mut self, path: &str) -> Option<&Spanned<DeValue<'t>>> {
        self.asked.insert(path.to_owned());
        self.value(path)
    }

    fn value(&self, path: &str) -> Option<&Spanned<DeValue<'t>>> {
        let mut names = path.split('.');
        let mut value = self.root.get_ref().get(names.next()?)?;
        for name in names {
            value = value.get_ref().as_table()?.get(name)?;
        }
        Some(value)
    }

    fn header(&self, path: &str) -> Option<Range<usize>> {
        self.value(path).map(Spanned::span)
    }

    fn required<T>(&mut self, path: &str, found: Option<T>, stand_in: T) -> T {
        if found.is_none() {
            self.missing.push(path.to_owned());
        }
        found.unwrap_or(stand_in)
    }

    fn out_of_range<T: std::fmt::Display>(
        &mut self,
        path: &str,
        right_type: bool,
        kind: &str,
        range: &RangeInclusive<T>,
    ) {
        let (least, most) = (range.start(), range.end());
        let is = if right_type { "out of range; " } else { "" };
        self.wrong(path, format!("{is}{kind} from {least} to {most} is expected"), None);
    }

    fn find_unknown(
        &self,
        prefix: &str,
        table: &DeTable<'t>,
        unknown: &mut Vec<(String, Range<usize>)>,
    ) {
        for (key, value) in table {
            let path = format!("{prefix}{}", key.get_ref());
            if !self.asked.contains(&path) {
                unknown.push((path, key.span()));
            } else if let DeValue::Table(inner) = value.get_ref() {
                // A table of which nobody asked a key is at fault by itself.
                let prefix = format!("{path}.");
                if self.asked.range(prefix.clone()..).next().is_some_and(|p| p.starts_with(&prefix))
                {
                    self.find_unknown(&prefix, inner, unknown);
                }
            }
        }
    }

    fn fault(
        &mut self,
        rule: &'static str,
        place: Range<usize>,
        message: String,
        help: Option<String>,
    ) {
        if self.faults.len() == FAULTS_MAX {
            return;
        }
        let bytes = self.text.as_bytes();
        let start = place.start.min(bytes.len());
        let line_start =
            bytes[..start].iter().rposition(|byte| *byte == b'\n').map_or(0, |at| at + 1);
        let line_end = bytes[start..]
            .iter()
            .position(|byte| *byte == b'\n')
            .map_or(bytes.len(), |at| start + at);
        let end = place.end.clamp(start, line_end);
        let line = line_of(self.text, start);
        let cut_start = line_start.max(start.saturating_sub(EXCERPT_BYTES));
        let cut_end = line_end.min(end.saturating_add(EXCERPT_BYTES));
        // From the first whole character on.
        let cut_start =
            (cut_start..=start).find(|at| self.text.is_char_boundary(*at)).unwrap_or(start);
        let text = String::from_utf8_lossy(&bytes[cut_start..cut_end]);
        self.faults.push(Diagnostic {
            severity: Severity::Error,
            rule,
            span: Span { line, start: (start - line_start) as u32, end: (end - line_start) as u32 },
            text: text.trim_end_matches(['\r', char::REPLACEMENT_CHARACTER]).to_owned(),
            text_offset: (cut_start - line_start) as u32,
            message,
            help,
            calls: Vec::new(),
            file: None,
        });
    }
}

/// The line, from 1, of a byte of a text.
pub(super) fn line_of(text: &str, at: usize) -> u32 {
    let before = &text.as_bytes()[..at.min(text.len())];
    before.iter().filter(|byte| **byte == b'\n').count() as u32 + 1
}

fn as_number(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Float(text) => text.as_str().parse().ok(),
        DeValue::Integer(text) => {
            i64::from_str_radix(text.as_str(), text.radix()).ok().map(|number| number as f64)
        }
        _ => None,
    }
}
