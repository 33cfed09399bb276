//! Parameters: `#1`, `#<name>`, `#<_global>`, what calls make of them, and what expressions
//! amount to.
//!
//! A parameter that nothing has set has no value. Two marks tell this in a value: [`EMPTY`] is
//! that of `#0`, and in the dialect `fanuc` that of every parameter that is not set; [`UNSET`] is
//! that of such a parameter in all others, where it counts as 0 (RS274/NGC).

use std::rc::Rc;

use crate::gcode::rules::{self, Rule};
use crate::gcode::{Block, Name, Step, short};

use super::Dialect;
use super::execute::Executor;
use super::names::Names;

/// No value at all: a word that has it is left out.
pub(super) const EMPTY: f64 = f64::from_bits(0x7ff8_0000_0000_0001);

/// A parameter that is not set: 0, but where it is compared with no value.
const UNSET: f64 = f64::from_bits(0x7ff8_0000_0000_0002);

/// Parameters of RS274/NGC end here.
const NUMBER_MAX: u32 = 5602;

/// No parameter below is the control's own, in any dialect.
pub(super) const SYSTEM_FIRST: u32 = 1000;

/// Whether DEBUG is shown; 1 unless a program says otherwise (RS274/NGC).
const DEBUG: u32 = 5599;

/// Parameters from 1 that every call by an O word has for itself, and by G65.
const CALL_LOCALS: usize = 30;
const MACRO_LOCALS: usize = 33;

/// Named parameters that are global, or of one call, at most.
const NAMES_MAX: usize = 100_000;

/// The parameter that raises an alarm.
const ALARM: u32 = 3000;

/// The parameter that stops with a message.
const STOP: u32 = 3006;

/// Why an expression has no value. It lies elsewhere, so that a value is handed on in registers.
pub(super) type NoValue = Box<Reason>;

/// See [`NoValue`].
#[derive(Debug)]
pub(super) struct Reason {
    pub rule: &'static Rule,
    pub message: String,
    pub help: Option<&'static str>,
}

/// The value of an expression or of a parameter.
pub(super) type Value = Result<f64, NoValue>;

pub(super) fn refuse<T>(rule: &'static Rule, message: impl Into<String>) -> Result<T, NoValue> {
    Err(Box::new(Reason { rule, message: message.into(), help: None }))
}

/// What is to be set: a parameter, found before anything of its line is set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Target<'b> {
    Number(u32),
    Name(&'b Rc<Name>),
}

/// What setting a parameter has done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Set {
    Done,
    Alarm(f64),
    /// The operator has to go on.
    Stop,
}

/// What a call puts aside.
#[derive(Debug)]
struct Scope {
    numbered: Vec<f64>,
    named: Names,
}

/// All parameters of a run.
#[derive(Debug)]
pub(super) struct Parameters {
    pub(super) dialect: Dialect,
    numbered: Vec<f64>,
    globals: Names,
    named: Names,
    scopes: Vec<Scope>,
    /// Values of an expression that is being evaluated.
    pub(super) stack: Vec<f64>,
}

impl Parameters {
    pub fn new(dialect: Dialect) -> Parameters {
        Parameters {
            dialect,
            numbered: Vec::new(),
            globals: Names::default(),
            named: Names::default(),
            scopes: Vec::new(),
            stack: Vec::new(),
        }
    }

    /// Begins a call: arguments become `#1` and so on, or what the letters of G65 stand for.
    pub fn enter(&mut self, arguments: &[(u32, f64)], is_macro: bool) {
        self.reserve();
        let count = if is_macro { MACRO_LOCALS } else { CALL_LOCALS };
        let locals = &mut self.numbered[1..=count];
        let numbered = locals.to_vec();
        locals.fill(UNSET);
        for (number, value) in arguments {
            if let Some(local) = (*number as usize).checked_sub(1).and_then(|at| locals.get_mut(at))
            {
                *local = *value;
            }
        }
        let named = std::mem::take(&mut self.named);
        self.scopes.push(Scope { numbered, named });
    }

    /// Ends a call.
    pub fn leave(&mut self) {
        if let Some(scope) = self.scopes.pop() {
            self.numbered[1..=scope.numbered.len()].copy_from_slice(&scope.numbered);
            self.named = scope.named;
        }
    }

    /// Sets what a subprogram gives back: `#<_value>`, and whether there is one.
    pub fn give_back(&mut self, value: Option<f64>) {
        self.globals.insert(Rc::new(Name::new("_value")), value.unwrap_or(0.0));
        self.globals
            .insert(Rc::new(Name::new("_value_returned")), f64::from(u8::from(value.is_some())));
    }

    fn reserve(&mut self) {
        if self.numbered.is_empty() {
            self.numbered = vec![UNSET; NUMBER_MAX as usize + 1];
            self.numbered[DEBUG as usize] = 1.0;
        }
    }

    /// Sets a parameter.
    pub fn set(&mut self, target: Target<'_>, value: f64) -> Result<Set, NoValue> {
        let name = match target {
            Target::Number(number) => return self.set_number(number, value),
            Target::Name(name) => name,
        };
        let names = if name.is_global() { &mut self.globals } else { &mut self.named };
        if let Some(place) = names.get_mut(name) {
            *place = value;
        } else if names.len() < NAMES_MAX {
            names.insert(Rc::clone(name), value);
        } else {
            return refuse(&rules::BAD_PARAMETER, format!("more than {NAMES_MAX} names are set"));
        }
        Ok(Set::Done)
    }

    fn set_number(&mut self, number: u32, value: f64) -> Result<Set, NoValue> {
        let raises = self.dialect == Dialect::Iso || self.dialect.is_fanuc();
        if number == ALARM && raises {
            return Ok(Set::Alarm(value));
        }
        if number == STOP && raises {
            return Ok(Set::Stop);
        }
        if number == 0 {
            return refuse(&rules::BAD_PARAMETER, "#0 has no value, and cannot be set");
        }
        range(number)?;
        self.reserve();
        self.numbered[number as usize] = if value.is_nan() { UNSET } else { value };
        Ok(Set::Done)
    }

    /// Whether DEBUG is shown.
    pub fn shows_debug(&self) -> bool {
        self.numbered.get(DEBUG as usize).is_none_or(|value| plain(*value) != 0.0)
    }

    #[inline]
    pub(super) fn numbered(&self, number: u32, executor: &Executor<'_>) -> Value {
        match self.numbered.get(number as usize) {
            Some(value) if number < SYSTEM_FIRST && !value.is_nan() => Ok(*value),
            _ => self.system_or_unset(number, executor),
        }
    }

    /// The value of a parameter that may be the control's, or not set.
    fn system_or_unset(&self, number: u32, executor: &Executor<'_>) -> Value {
        if number == 0 {
            return Ok(EMPTY);
        }
        if number >= SYSTEM_FIRST
            && let Some(value) = executor.parameter(number)
        {
            return value;
        }
        range(number)?;
        let value = self.numbered.get(number as usize).copied().unwrap_or(UNSET);
        Ok(if value.is_nan() && self.dialect.is_fanuc() { EMPTY } else { value })
    }

    /// Whether a named parameter is the control's own.
    pub fn is_own(&self, name: &Name, executor: &Executor<'_>) -> bool {
        name.is_global() && self.own(name.as_str(), executor).is_some()
    }

    fn own(&self, name: &str, executor: &Executor<'_>) -> Option<f64> {
        match name {
            "_call_level" => Some(self.scopes.len() as f64),
            "_value" | "_value_returned" => Some(0.0),
            _ => executor.named(name),
        }
    }

    pub(super) fn find(&self, name: &Rc<Name>, executor: &Executor<'_>) -> Option<f64> {
        if name.is_global() {
            self.globals.get(name).copied().or_else(|| self.own(name.as_str(), executor))
        } else {
            self.named.get(name).copied()
        }
    }

    #[inline(never)]
    pub(super) fn named(&self, name: &Rc<Name>, executor: &Executor<'_>) -> Value {
        self.find(name, executor).ok_or_else(|| {
            let outside = [("_ini[", "the configuration"), ("_hal[", "the signals")];
            let of = outside.iter().find(|(prefix, _)| name.as_str().starts_with(prefix));
            let message = match of {
                Some((_, what)) => format!("#<{name}> is of {what} of a LinuxCNC: there is none"),
                None => format!("#<{name}> is read here, and nothing has set it"),
            };
            let help = match of {
                Some(_) => "write the value, or ask before by EXISTS, which is 0 here",
                None => {
                    "set it before; names that begin with _ are global, all others of their \
                     subprogram"
                }
            };
            Box::new(Reason { rule: &rules::UNSET_PARAMETER, message, help: Some(help) })
        })
    }

    /// The number of a parameter that a value stands for.
    pub(super) fn number_of(value: f64) -> Result<u32, NoValue> {
        // As RS274/NGC: what is nearly whole is.
        let whole = plain(value).round();
        if (plain(value) - whole).abs() > 1e-4 || !(0.0..=f64::from(u32::MAX)).contains(&whole) {
            let message = format!("there is no parameter #{}", short(plain(value)));
            return refuse(&rules::BAD_PARAMETER, message);
        }
        Ok(whole as u32)
    }

    /// The parameter that a line sets.
    pub fn target<'b>(
        &mut self,
        step: &'b Step,
        code: &[Step],
        executor: &Executor<'_>,
    ) -> Result<Target<'b>, NoValue> {
        match step {
            Step::Parameter(number) => Ok(Target::Number(*number)),
            Step::Named(name) => Ok(Target::Name(name)),
            _ => Ok(Target::Number(Self::number_of(self.value(code, executor)?)?)),
        }
    }

    /// A message with the values of the parameters it names, as DEBUG and PRINT show it.
    pub fn filled_in(&self, text: &str, executor: &Executor<'_>) -> String {
        let mut filled = String::with_capacity(text.len());
        let mut rest = text;
        while let Some(at) = rest.find('#') {
            filled.push_str(&rest[..at]);
            rest = &rest[at..];
            let (value, end) = if let Some(end) = rest.find('>').filter(|_| rest.starts_with("#<"))
            {
                let name = rest[2..end].to_lowercase().replace([' ', '\t'], "");
                (self.find(&Rc::new(Name::new(&name)), executor), end + 1)
            } else {
                let digits = rest[1..].bytes().take_while(u8::is_ascii_digit).count();
                let number = rest[1..=digits].parse().ok();
                (number.and_then(|number| self.numbered(number, executor).ok()), 1 + digits)
            };
            match value {
                Some(value) => filled.push_str(&short(plain(value))),
                None => filled.push_str(&rest[..end]),
            }
            rest = &rest[end..];
        }
        filled.push_str(rest);
        filled
    }
}

/// Whether there is a parameter of a number.
pub(super) fn is_numbered(number: f64) -> bool {
    number.fract() == 0.0 && (1.0..=f64::from(NUMBER_MAX)).contains(&number)
}

fn range(number: u32) -> Result<(), NoValue> {
    if number > NUMBER_MAX {
        let message = format!("there is no parameter #{number}: the last is #{NUMBER_MAX}");
        return refuse(&rules::BAD_PARAMETER, message);
    }
    Ok(())
}

/// A value as a number: having none counts as 0.
pub(super) fn plain(value: f64) -> f64 {
    if value.is_nan() { 0.0 } else { value }
}

/// Whether a word of this value is left out.
pub(super) fn is_empty(value: f64) -> bool {
    value.to_bits() == EMPTY.to_bits()
}

/// The parameters that the words of G65 set: list I of macro B, or list II where I, J or K stands
/// there again.
pub(super) fn arguments(block: &Block) -> Vec<(u32, f64)> {
    // By letter from A: G L N O P are words of the call itself.
    const NUMBERS: [u32; 26] =
        [1, 2, 3, 7, 8, 9, 0, 11, 4, 5, 6, 0, 13, 0, 0, 0, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26];
    let count = |letter: u8| block.words().iter().filter(|word| word.letter == letter).count();
    let is_list_two = [b'I', b'J', b'K'].into_iter().any(|letter| count(letter) > 1);
    // The threes of I J K, from #4 on: what does not come behind the one before begins the next.
    let (mut three, mut last) = (0, 0);
    let mut number = |letter: u8| match letter {
        b'I'..=b'K' if is_list_two => {
            three += u32::from(letter <= last);
            last = letter;
            4 + 3 * three + u32::from(letter - b'I')
        }
        b'A'..=b'Z' => NUMBERS[usize::from(letter - b'A')],
        _ => 0,
    };
    let words = block.words().iter().map(|word| (number(word.letter), word.value));
    words.filter(|(number, _)| *number > 0).collect()
}

/// Whether a block is a macro call: G65 or G66 with its P.
pub(super) fn is_macro_call(block: &Block) -> bool {
    block.has(b'P') && block.is_macro_call()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Machine;
    use crate::gcode::{Fault, parse};

    fn check(dialect: Dialect, text: &str, expected: Result<f64, &str>) {
        let machine = Machine::load("ideal").unwrap();
        let options = crate::interp::Options { dialect, ..Default::default() };
        let executor = Executor::new(&machine, &options);
        let mut parameters = Parameters::new(dialect);
        parameters.set(Target::Number(1), 7.0).unwrap();
        parameters.set(Target::Number(7), 49.0).unwrap();
        parameters.set(Target::Name(&Rc::new(Name::new("name"))), 3.0).unwrap();
        let (mut block, mut faults) = (Block::default(), Vec::<Fault>::new());
        parse(format!("X[{text}]").as_bytes(), &mut block, &mut faults);
        assert!(faults.is_empty(), "{text}: {faults:?}");
        let code = block.code(block.values()[0].1);
        let found = parameters.number(code, &executor).map_err(|error| error.rule.name);
        match (found, expected) {
            (Ok(found), Ok(expected)) => {
                assert!((found - expected).abs() < 1e-12, "{text}: {found}, not {expected}");
            }
            (found, expected) => assert_eq!(found, expected, "{text}"),
        }
    }

    #[test]
    fn expressions_have_the_values_of_rs274() {
        for (text, expected) in [
            ("-2**2", 4.0),
            ("2**3**2", 64.0),
            ("-7 MOD 3", 2.0),
            ("7 MOD -3", 1.0),
            ("FIX[-1.5]", -2.0),
            ("FUP[-1.5]", -1.0),
            ("ROUND[-2.5]", -3.0),
            ("1 EQ 1.0000009", 1.0),
            ("1 EQ 1.000002", 0.0),
            ("1 NE 1.0000009", 0.0),
            ("ATAN[1]/[-1]", 135.0),
            ("SIN[30]+COS[60]", 1.0),
            ("LN[EXP[2]]", 2.0),
            ("SQRT[16]-ABS[-1]", 3.0),
            ("ASIN[1]+ACOS[0]", 180.0),
            ("##1+#[#1]", 98.0),
            ("#<name>*#500", 0.0),
            ("EXISTS[#<name>]+EXISTS[#<other>]", 1.0),
            ("2 AND 0 OR 5 XOR 0", 1.0),
            ("#2 EQ #0", 1.0),
            ("#2 EQ 0", 1.0),
            ("0 EQ #0", 0.0),
            ("#1 NE #0", 1.0),
            ("#5420 + #<_metric>", 1.0),
            ("#5220 + #5061 + #5400", 1.0),
            ("EXISTS[#<_hal[a.b]>] + EXISTS[#<_feed>]", 1.0),
            ("#<_motion_mode> + #<_plane> + #<_ccomp>", 1370.0),
            ("#<_vmajor> GE 2.5", 1.0),
        ] {
            check(Dialect::Iso, text, Ok(expected));
        }
        for (text, expected) in [
            ("FIX[-1.5]", -1.0),
            ("FUP[-1.5]", -2.0),
            ("6 AND 3", 2.0),
            ("#2 EQ #0", 1.0),
            ("#2 EQ 0", 0.0),
            ("#2 + 1", 1.0),
            ("#4003 + #4014 + #5041", 144.0),
        ] {
            check(Dialect::Fanuc, text, Ok(expected));
        }
    }

    #[test]
    fn what_has_no_value_is_an_error() {
        for (text, rule) in [
            ("1/0", "arithmetic"),
            ("1 MOD 0", "arithmetic"),
            ("SQRT[-1]", "arithmetic"),
            ("LN[0]", "arithmetic"),
            ("ASIN[1.1]", "arithmetic"),
            ("ACOS[-2]", "arithmetic"),
            ("EXP[1000]", "arithmetic"),
            ("[-8]**[1/3]", "arithmetic"),
            ("0**-1", "arithmetic"),
            ("10**300*10**300", "arithmetic"),
            ("#<other>", "unset-parameter"),
            ("#[1/2]", "bad-parameter"),
            ("#[0-1]", "bad-parameter"),
            ("#6000", "bad-parameter"),
        ] {
            check(Dialect::Iso, text, Err(rule));
        }
        check(Dialect::Fanuc, "#3001", Err("bad-parameter"));
        check(Dialect::Fanuc, "#1000", Err("bad-parameter"));
        check(Dialect::Iso, "#<_hal[motion.probe]>", Err("unset-parameter"));
    }

    #[test]
    fn a_message_shows_values() {
        let machine = Machine::load("ideal").unwrap();
        let executor = Executor::new(&machine, &crate::interp::Options::default());
        let mut parameters = Parameters::new(Dialect::Iso);
        parameters.set(Target::Number(12), 1.5).unwrap();
        parameters.set(Target::Name(&Rc::new(Name::new("ab"))), 2.0).unwrap();
        let text = parameters.filled_in("#12 is #<A b>, #<c> # #99999999999 \u{e9}#", &executor);
        assert_eq!(text, "1.5 is 2, #<c> # #99999999999 \u{e9}#");
    }
}
