//! `cnc explain`: what a rule or a code means, from the tables that the checks themselves read.

use std::io::{self, BufWriter, Write};

use anyhow::anyhow;
use cnc::base::likeness::nearest;
use cnc::base::source::visible;
use cnc::base::{Machine, Severity, Source};
use cnc::gcode::codes::{self, Code, Group};
use cnc::gcode::foreign::{self, Foreign};
use cnc::gcode::rules::{self, Rule};
use cnc::gcode::words::{self, WordMeaning};
use cnc::gcode::{find_lathe, notes};
use cnc::interp::{self, Dialect, Options};
use cnc::verify::CHECKS;
use serde_json::{Value, json};

use crate::args::Global;
use crate::exit::{Exit, Outcome};
use crate::many::judged::{WRONG_FILE, WRONG_FILE_MEANING, check_rule};

/// Explain a rule (no-feed), a code (G43) or a word (F); without any, list all
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Name of a rule, a G or M code, or the letter of a word
    #[arg(value_name = "RULE|CODE|WORD")]
    name: Option<String>,
}

/// Rules of machine profiles.
const PROFILE_RULES: [(&str, &str); 4] = [
    ("profile-syntax", "The file is no TOML."),
    ("profile-unknown-key", "A key means nothing in a profile: mostly a slip of the pen."),
    ("profile-missing-key", "A key has no default and has to be there."),
    ("profile-value", "A value is of another kind than its key asks for, or not in its range."),
];

/// Lines of an example that are shown; of the few that are longer, the beginning.
const LINES_MAX: usize = 16;
/// Characters of a line that are shown.
const COLUMNS_MAX: usize = 72;
/// Codes of one group that are all named.
const NAMES_MAX: usize = 9;

pub fn run(args: &Args, global: &Global) -> Outcome {
    global.refuse(&["machine"], "rules and codes are those of every machine")?;
    let mut out = BufWriter::new(io::stdout().lock());
    let Some(name) = &args.name else {
        list(&mut out, global)?;
        out.flush()?;
        return Ok(Exit::Ok);
    };
    let wanted = name.trim().to_ascii_lowercase();
    if let Some(rule) = rules::all().find(|rule| rule.name == wanted) {
        explain_rule(&mut out, rule, global)?;
    } else if let Some((letter, number)) = as_code(&wanted) {
        match (codes::find(letter, number), foreign::find(letter, number)) {
            (Some(code), row) => explain_code(&mut out, code, row, global)?,
            (None, Some(row)) => explain_foreign(&mut out, row, on_lathe(letter, number), global)?,
            (None, None) => return Err(unknown(name, &wanted).into()),
        }
    } else if let Some(row) = words::find(&wanted) {
        explain_word(&mut out, row, global)?;
    } else if let Some(rule) = others().find(|rule| rule.name == wanted) {
        explain_other(&mut out, &rule, global)?;
    } else {
        return Err(unknown(name, &wanted).into());
    }
    out.flush()?;
    Ok(Exit::Ok)
}

/// `g43`, `G 43.1`, `m06`.
fn as_code(text: &str) -> Option<(u8, f64)> {
    let (letter, number) = text.split_at_checked(1)?;
    let letter = *letter.as_bytes().first().filter(|letter| b"gm".contains(letter))?;
    let number = number.trim();
    let is_number = number.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
    Some((letter.to_ascii_uppercase(), number.parse().ok().filter(|_| is_number)?))
}

fn unknown(name: &str, wanted: &str) -> anyhow::Error {
    let names = rules::all().map(|rule| rule.name.to_owned());
    let names = names.chain(codes::CODES.iter().map(Code::name));
    let names: Vec<String> = names.chain(others().map(|rule| rule.name)).collect();
    match nearest(wanted, names.iter().map(String::as_str)) {
        Some(near) => anyhow!("no rule and no code is '{name}'; did you mean '{near}'?"),
        None => anyhow!("no rule and no code is '{name}': cnc explain lists them"),
    }
}

/// A rule that is not about what a program says.
struct OtherRule {
    name: String,
    meaning: &'static str,
    /// Where more is said.
    page: &'static str,
}

/// Rules of executed steps, of profiles and of files.
fn others() -> impl Iterator<Item = OtherRule> {
    let checks = CHECKS.iter().map(|(check, meaning)| (check_rule(check), *meaning));
    let files = [(WRONG_FILE.to_owned(), WRONG_FILE_MEANING)];
    let profiles = PROFILE_RULES.iter().map(|(name, meaning)| ((*name).to_owned(), *meaning));
    let of = |page| move |(name, meaning)| OtherRule { name, meaning, page };
    let steps = checks.chain(files).map(of("docs/verify.md"));
    steps.chain(profiles.map(of("docs/machines.md")))
}

fn explain_other(out: &mut impl Write, rule: &OtherRule, global: &Global) -> io::Result<()> {
    let OtherRule { name, meaning, page } = rule;
    if global.json {
        let value = json!({
            "schema": 1, "rule": name, "severity": "error", "meaning": meaning, "page": page,
        });
        return writeln!(out, "{value}");
    }
    writeln!(out, "error[{name}]: {meaning}\nmore in {page}")
}

fn severity(rule: &Rule) -> &'static str {
    match rule.severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
    }
}

fn list(out: &mut impl Write, global: &Global) -> anyhow::Result<()> {
    if global.json {
        let codes: Vec<Value> = codes::CODES.iter().map(code_json).collect();
        let rules: Vec<Value> = rules::all().map(|rule| rule_json(rule, None)).collect();
        let words: Vec<Value> = words::WORDS.iter().map(word_json).collect();
        let all = json!({"schema": 1, "codes": codes, "words": words, "rules": rules});
        writeln!(out, "{all}")?;
        return Ok(());
    }
    for code in codes::CODES {
        let support = if code.op.is_some() { "" } else { " (not supported)" };
        writeln!(out, "{:<6} {}{support}", code.name(), code.meaning)?;
    }
    writeln!(out)?;
    for row in words::WORDS {
        writeln!(out, "{:<6} {}", row.name, row.meaning)?;
    }
    writeln!(out)?;
    for rule in rules::all() {
        writeln!(out, "{:<20} {}", rule.name, rule.meaning)?;
    }
    Ok(())
}

/// What the check of a rule's bad program, without its remark, says.
struct Shown {
    line: u32,
    message: String,
    help: Option<String>,
}

fn shown(rule: &Rule) -> anyhow::Result<Shown> {
    let own = include_str!("../../../../samples/machines/nine-axes.toml");
    let remark = rule.bad.lines().next().unwrap_or_default();
    let machine = if remark.contains(" on nine-axes)") {
        Machine::parse("nine-axes", own)?
    } else {
        Machine::load(cnc::base::machine::DEFAULT)?
    };
    let source = Source::memory("example.nc", without_remark(rule.bad).as_bytes());
    let options = Options { max_passes: Some(1000), ..Options::default() };
    let checked = interp::check(&source, &machine, &options, 1)?;
    let found = checked.diagnostics.into_iter().find(|found| found.rule == rule.name);
    let found = found.ok_or_else(|| anyhow!("the example of {} does not show it", rule.name))?;
    Ok(Shown { line: found.span.line, message: found.message, help: found.help })
}

fn explain_rule(out: &mut impl Write, rule: &Rule, global: &Global) -> anyhow::Result<()> {
    let shown = shown(rule)?;
    if global.json {
        let mut value = rule_json(rule, Some(&shown));
        value["schema"] = json!(1);
        writeln!(out, "{value}")?;
        return Ok(());
    }
    writeln!(out, "{}[{}]: {}", severity(rule), rule.name, rule.meaning)?;
    writeln!(out, "\nThis program has the mistake:\n")?;
    write_program(out, without_remark(rule.bad))?;
    writeln!(out, "\nline {}: {}", shown.line, shown.message)?;
    if let Some(help) = &shown.help {
        writeln!(out, "help: {help}")?;
    }
    writeln!(out, "\nMended:\n")?;
    write_program(out, rule.mended)?;
    Ok(())
}

/// A rule's two programs, with what each is.
pub fn examples(rule: &Rule) -> io::Result<String> {
    let mut text = Vec::new();
    writeln!(text, "This program has the mistake:\n")?;
    write_program(&mut text, without_remark(rule.bad))?;
    writeln!(text, "\nMended:\n")?;
    write_program(&mut text, rule.mended)?;
    Ok(String::from_utf8_lossy(&text).into_owned())
}

fn without_remark(program: &str) -> &str {
    program.split_once('\n').map_or("", |(_, rest)| rest)
}

fn write_program(out: &mut impl Write, program: &str) -> io::Result<()> {
    let lines: Vec<&str> = program.lines().collect();
    for line in lines.iter().take(LINES_MAX) {
        let text: String = line.chars().take(COLUMNS_MAX).map(visible).collect();
        let cut = if line.chars().count() > COLUMNS_MAX { "…" } else { "" };
        writeln!(out, "    {text}{cut}")?;
    }
    if lines.len() > LINES_MAX {
        writeln!(out, "    … and {} lines more", lines.len() - LINES_MAX)?;
    }
    Ok(())
}

fn rule_json(rule: &Rule, shown: Option<&Shown>) -> Value {
    let mut value = json!({
        "rule": rule.name, "severity": severity(rule), "meaning": rule.meaning,
    });
    if let Some(Shown { line, message, help }) = shown {
        value["bad"] = json!(without_remark(rule.bad));
        value["line"] = json!(line);
        value["message"] = json!(message);
        value["help"] = json!(help);
        value["mended"] = json!(rule.mended);
    }
    value
}

/// What ends a code's force.
fn in_force(code: &Code) -> String {
    let is_once = matches!(code.group, Group::NonModal | Group::ToolChange | Group::Stop);
    if is_once {
        return "in its block only".to_owned();
    }
    let is_other = |other: &&Code| other.group == code.group && *other != code;
    let names: Vec<String> = codes::CODES.iter().filter(is_other).map(Code::name).collect();
    if names.len() > NAMES_MAX {
        "until another code of its group".to_owned()
    } else if names.is_empty() {
        "from its block on".to_owned()
    } else {
        format!("until {}", names.join(" "))
    }
}

/// The letters that a code makes use of, with a blank between.
fn letters(code: &Code) -> String {
    code.letters().join(" ")
}

fn explain_code(
    out: &mut impl Write,
    code: &Code,
    elsewhere: Option<&Foreign>,
    global: &Global,
) -> anyhow::Result<()> {
    if global.json {
        let mut value = code_json(code);
        value["elsewhere"] = json!(elsewhere.map(|row| row.meaning));
        value["schema"] = json!(1);
        writeln!(out, "{value}")?;
        return Ok(());
    }
    writeln!(out, "{}: {}", code.name(), code.meaning)?;
    writeln!(out, "group     {}", code.group.name())?;
    if code.op.is_none() {
        writeln!(out, "supported no: a program with it is refused")?;
        return Ok(());
    }
    writeln!(out, "in force  {}", in_force(code))?;
    if code.words != 0 {
        writeln!(out, "words     {}", letters(code))?;
    }
    if let Some(Foreign { control, meaning, .. }) = elsewhere {
        writeln!(out, "elsewhere {control}: {meaning}")?;
    }
    write_lathe(out, of_lathes(code))?;
    if let Some(note) = notes::note(code) {
        writeln!(out, "\n{note}")?;
    }
    Ok(())
}

/// What a code means on FANUC-style lathes, and in which dialect.
type OnLathe = (&'static Code, Dialect);

/// What the code means on FANUC-style lathes, if it is something else there.
fn of_lathes(code: &Code) -> Option<OnLathe> {
    on_lathe(code.letter, f64::from(code.tenths) / 10.0)
}

/// The same of a code that may have no meaning elsewhere.
fn on_lathe(letter: u8, number: f64) -> Option<OnLathe> {
    let dialects = [Dialect::FanucLathe, Dialect::FanucLatheB].into_iter();
    let mut found = dialects
        .filter_map(|dialect| Some((find_lathe(letter, number, dialect.lathe()?)?, dialect)));
    found.find(|(code, _)| code.op.is_some())
}

fn write_lathe(out: &mut impl Write, found: Option<OnLathe>) -> io::Result<()> {
    match found {
        Some((code, dialect)) => {
            writeln!(out, "lathe     {} (--dialect {})", code.meaning, dialect.name())
        }
        None => Ok(()),
    }
}

fn code_json(code: &Code) -> Value {
    json!({
        "lathe": of_lathes(code).map(|(own, _)| own.meaning),
        "code": code.name(), "group": code.group.name(), "supported": code.op.is_some(),
        "meaning": code.meaning, "words": code.letters().concat(), "note": notes::note(code),
    })
}

fn word_json(row: &WordMeaning) -> Value {
    json!({"word": row.name, "meaning": row.meaning, "example": row.example})
}

fn explain_word(out: &mut impl Write, row: &WordMeaning, global: &Global) -> anyhow::Result<()> {
    if global.json {
        let mut value = word_json(row);
        value["schema"] = json!(1);
        writeln!(out, "{value}")?;
        return Ok(());
    }
    writeln!(out, "{}: {}", row.name, row.meaning)?;
    writeln!(out, "example   {}", row.example)?;
    let users = codes::CODES.iter().filter(|code| code.letters().contains(&row.name.to_owned()));
    let names: Vec<String> = users.map(Code::name).collect();
    if !names.is_empty() {
        writeln!(out, "goes with {}", names.join(" "))?;
    }
    Ok(())
}

fn explain_foreign(
    out: &mut impl Write,
    row: &Foreign,
    lathe: Option<OnLathe>,
    global: &Global,
) -> anyhow::Result<()> {
    let Foreign { control, meaning, instead, .. } = row;
    if global.json {
        let value = json!({
            "schema": 1, "code": row.name(), "supported": false, "control": control,
            "meaning": meaning, "instead": instead, "lathe": lathe.map(|(own, _)| own.meaning),
        });
        writeln!(out, "{value}")?;
        return Ok(());
    }
    let where_refused = if lathe.is_some() { "on mills" } else { "here" };
    let name = row.name();
    writeln!(out, "{name}: means nothing {where_refused}, and a program with it is refused")?;
    writeln!(out, "elsewhere {control}: {meaning}")?;
    if lathe.is_none() {
        writeln!(out, "instead   {instead}")?;
    }
    write_lathe(out, lathe)?;
    Ok(())
}
