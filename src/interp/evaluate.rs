//! What the code of an expression amounts to.
//!
//! Every pass of a loop comes through here, so the way of a value is short: the one on top is kept
//! beside the stack, and what has no value is told apart by no finite number, not by a result.

use crate::gcode::{Binary, Function, Step, rules, short};

use super::execute::Executor;
use super::parameters::{Parameters, Value, is_empty, is_numbered, plain, refuse};

/// What differs by no more is equal (EQ, NE).
const EQUAL_WITHIN: f64 = 1e-6;

impl Parameters {
    /// The value of an expression: a number, [`EMPTY`] or [`UNSET`]. The value on top is kept beside
    /// the stack: most steps take it and put another there.
    pub fn value(&mut self, code: &[Step], executor: &Executor<'_>) -> Value {
        let Some((first, rest)) = code.split_first() else { return Ok(0.0) };
        let mut top = self.operand(first, executor)?;
        self.stack.clear();
        for step in rest {
            top = match step {
                Step::WithNumber(operator, value) => self.binary(*operator, top, *value)?,
                Step::WithParameter(operator, number) => {
                    self.binary(*operator, top, self.numbered(*number, executor)?)?
                }
                Step::Binary(operator) => {
                    let first = self.stack.pop().unwrap_or_default();
                    self.binary(*operator, first, top)?
                }
                Step::Function(function) => self.function(*function, plain(top))?,
                Step::Negate => -plain(top),
                Step::Indirect => self.numbered(Self::number_of(top)?, executor)?,
                Step::ExistsNumbered => truth(is_numbered(plain(top))),
                Step::Number(_) | Step::Parameter(_) | Step::Named(_) | Step::Exists(_) => {
                    self.stack.push(top);
                    self.operand(step, executor)?
                }
            };
        }
        Ok(top)
    }

    /// What a step puts on the stack without taking anything from it.
    #[inline]
    fn operand(&self, step: &Step, executor: &Executor<'_>) -> Value {
        match step {
            Step::Number(value) => Ok(*value),
            Step::Parameter(number) => self.numbered(*number, executor),
            Step::Named(name) => self.named(name, executor),
            Step::Exists(name) => Ok(truth(self.find(name, executor).is_some())),
            // The reader of expressions puts no step where its values are missing.
            Step::Indirect
            | Step::ExistsNumbered
            | Step::Negate
            | Step::Function(_)
            | Step::Binary(_)
            | Step::WithNumber(..)
            | Step::WithParameter(..) => Ok(0.0),
        }
    }

    /// The value of an expression, where having none counts as 0.
    pub fn number(&mut self, code: &[Step], executor: &Executor<'_>) -> Value {
        self.value(code, executor).map(plain)
    }

    fn function(&self, function: Function, x: f64) -> Value {
        let is_fanuc = self.dialect.is_fanuc();
        let value = match function {
            Function::Abs => x.abs(),
            Function::Acos if x.abs() <= 1.0 => libm::acos(x).to_degrees(),
            Function::Asin if x.abs() <= 1.0 => libm::asin(x).to_degrees(),
            Function::Cos => libm::cos(x.to_radians()),
            Function::Exp => libm::exp(x),
            Function::Fix if is_fanuc => x.trunc(),
            Function::Fix => x.floor(),
            Function::Fup if is_fanuc => x.abs().ceil().copysign(x),
            Function::Fup => x.ceil(),
            Function::Ln if x > 0.0 => libm::log(x),
            Function::Round => x.round(),
            Function::Sin => libm::sin(x.to_radians()),
            Function::Sqrt if x >= 0.0 => x.sqrt(),
            Function::Tan => libm::tan(x.to_radians()),
            Function::Acos | Function::Asin | Function::Ln | Function::Sqrt => f64::NAN,
        };
        if value.is_finite() {
            return Ok(value);
        }
        refuse(&rules::ARITHMETIC, format!("{}[{}] has no value", function.name(), short(x)))
    }

    #[inline]
    fn binary(&self, operator: Binary, first: f64, second: f64) -> Value {
        let value = self.combined(operator, first, second);
        if value.is_finite() { Ok(value) } else { no_value(operator, plain(first), plain(second)) }
    }

    /// What an operator makes of two values; no finite number where they have no value.
    fn combined(&self, operator: Binary, first: f64, second: f64) -> f64 {
        let (a, b) = (plain(first), plain(second));
        let bits = |combine: fn(i64, i64) -> i64, logic: fn(bool, bool) -> bool| {
            if self.dialect.is_fanuc() {
                combine(a as i64, b as i64) as f64
            } else {
                truth(logic(a != 0.0, b != 0.0))
            }
        };
        match operator {
            Binary::Power if a < 0.0 && b.fract() != 0.0 => f64::NAN,
            Binary::Power => libm::pow(a, b),
            Binary::Times => a * b,
            Binary::Divide => a / b,
            Binary::Modulo => a.rem_euclid(b),
            Binary::Plus => a + b,
            Binary::Minus => a - b,
            Binary::Equal => truth(equal(first, second)),
            Binary::NotEqual => truth(!equal(first, second)),
            Binary::Greater => truth(a > b),
            Binary::GreaterOrEqual => truth(a >= b),
            Binary::Less => truth(a < b),
            Binary::LessOrEqual => truth(a <= b),
            Binary::And => bits(|a, b| a & b, |a, b| a && b),
            Binary::Or => bits(|a, b| a | b, |a, b| a || b),
            Binary::Xor => bits(|a, b| a ^ b, |a, b| a != b),
            Binary::Atan => libm::atan2(a, b).to_degrees(),
        }
    }
}

/// Why an operator makes nothing of two numbers.
#[cold]
fn no_value(operator: Binary, a: f64, b: f64) -> Value {
    let message = match operator {
        Binary::Divide if b == 0.0 => format!("{} is divided by zero", short(a)),
        _ => format!("[{} {} {}] has no value", short(a), operator.name(), short(b)),
    };
    refuse(&rules::ARITHMETIC, message)
}

fn truth(holds: bool) -> f64 {
    f64::from(u8::from(holds))
}

/// No value equals no value only; a parameter that is not set equals both that and 0.
fn equal(a: f64, b: f64) -> bool {
    if is_empty(a) || is_empty(b) {
        return a.is_nan() && b.is_nan();
    }
    (plain(a) - plain(b)).abs() < EQUAL_WITHIN
}
