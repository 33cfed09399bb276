//! What the machine is told, in order: a tick of steps, or an event between two ticks.
//!
//! This is what interpolation makes, a dump holds, verification reads and the bus carries.

use std::fmt;
use std::str::FromStr;

use crate::base::AxisMap;

/// An item of the command stream.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Steps of all axes in one tick.
    Tick(Tick),
    /// Something that has to happen before the next tick, with all axes at rest.
    Event(Event),
}

/// The steps of one tick: one period of the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Tick {
    /// Node buffer that the tick lies in, from 0; always 0 on a machine without node buffers.
    pub buffer: u32,
    /// Line of the NC program that the tick belongs to, from 1.
    pub line: u32,
    /// Signed motor steps of each axis.
    pub counts: AxisMap<i32>,
}

/// An event and the line of the NC program that asks for it.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// Line of the NC program, from 1.
    pub line: u32,
    /// What has to happen.
    pub kind: EventKind,
}

/// What has to happen between two ticks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EventKind {
    /// An M function, with the spindle speed for M3 and M4 and the tool for M6.
    M {
        /// The function's number.
        code: u16,
        /// Spindle speed in rpm that goes with it (M3, M4).
        spindle_rpm: Option<f64>,
        /// Tool that goes with it (M6).
        tool: Option<u32>,
    },
    /// An M function with words of its own (M61 Q3, M64 P3, M68 E0 Q1.5).
    Function {
        /// The function's number.
        code: u16,
        /// Its words.
        words: EventWords,
    },
    /// A spindle speed in rpm, given by itself.
    S(f64),
    /// A surface speed to keep, whatever the diameter (G96).
    SurfaceSpeed {
        /// Metres a minute.
        m_min: f64,
        /// Greatest spindle speed in rpm, if one is given.
        rpm_max: Option<f64>,
    },
    /// A tool to get ready, given by itself.
    T(u32),
    /// A pause in seconds (G4).
    Dwell(f64),
    /// A wait for an input (M66).
    WaitInput {
        /// Which input.
        number: u32,
        /// Whether it is an analog one.
        analog: bool,
        /// 0: it is read at once; 1 a rise, 2 a fall, 3 high, 4 low.
        kind: u32,
        /// How long at most.
        seconds: f64,
    },
    /// The block of this line comes next, if the operator lets it: in no program and no dump.
    NextBlock,
}

/// Words of an event: upper-case letters and their numbers, in the order of the program.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EventWords {
    letters: [u8; EventWords::MAX],
    values: [f64; EventWords::MAX],
    count: u8,
}

impl EventWords {
    /// Most words of an event.
    pub const MAX: usize = 4;

    /// Adds a word; false if its letter stands there already, or there are as many as can be.
    pub fn push(&mut self, letter: u8, value: f64) -> bool {
        let place = usize::from(self.count);
        let has_room = place < EventWords::MAX;
        if !has_room || self.letters[..place].contains(&letter) {
            return false;
        }
        (self.letters[place], self.values[place]) = (letter, value);
        self.count += 1;
        true
    }

    /// The words.
    pub fn iter(&self) -> impl Iterator<Item = (u8, f64)> {
        self.letters.into_iter().zip(self.values).take(usize::from(self.count))
    }
}

impl EventKind {
    /// Whether it lasts until somebody has done something at the machine.
    pub fn waits_for_person(self) -> bool {
        matches!(self, EventKind::M { code: 0 | 1 | 6 | 60, .. } | EventKind::NextBlock)
    }
}

/// As in the dump's event column: `M3 S1200`, `M6 T2`, `M68 E0 Q1.5`, `S800`, `T1`, `G4 P0.5`,
/// `G96 S200 D2500`.
impl fmt::Display for EventKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            EventKind::M { code, spindle_rpm, tool } => {
                write!(f, "M{code}")?;
                spindle_rpm.map_or(Ok(()), |rpm| write!(f, " S{rpm}"))?;
                tool.map_or(Ok(()), |tool| write!(f, " T{tool}"))
            }
            EventKind::Function { code, words } => {
                write!(f, "M{code}")?;
                words
                    .iter()
                    .try_for_each(|(letter, value)| write!(f, " {}{value}", char::from(letter)))
            }
            EventKind::S(rpm) => write!(f, "S{rpm}"),
            EventKind::SurfaceSpeed { m_min, rpm_max } => {
                write!(f, "G96 S{m_min}")?;
                rpm_max.map_or(Ok(()), |rpm| write!(f, " D{rpm}"))
            }
            EventKind::T(tool) => write!(f, "T{tool}"),
            EventKind::NextBlock => write!(f, "the next block"),
            EventKind::Dwell(seconds) => write!(f, "G4 P{seconds}"),
            EventKind::WaitInput { number, analog, kind, seconds } => {
                let letter = if analog { 'E' } else { 'P' };
                write!(f, "M66 {letter}{number} L{kind} Q{seconds}")
            }
        }
    }
}

/// A text that is no event of the dump's event column.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{0}' is no event; expected one like M3 S1200, M6 T2, S800, T1 or G4 P0.5")]
pub struct NotAnEvent(pub String);

impl FromStr for EventKind {
    type Err = NotAnEvent;

    fn from_str(text: &str) -> Result<Self, NotAnEvent> {
        let bad = || NotAnEvent(text.to_owned());
        let mut words = text.split_ascii_whitespace();
        let first = words.next().ok_or_else(bad)?;
        if first == "M66" {
            return wait(words).ok_or_else(bad);
        }
        let mut kind = match first.split_at_checked(1).ok_or_else(bad)? {
            ("M", code) => {
                let code = code.parse().map_err(|_| bad())?;
                if let Some(words) = function_words(words.clone()) {
                    return Ok(EventKind::Function { code, words });
                }
                EventKind::M { code, spindle_rpm: None, tool: None }
            }
            ("S", rpm) => EventKind::S(non_negative(rpm).ok_or_else(bad)?),
            ("T", tool) => EventKind::T(tool.parse().map_err(|_| bad())?),
            ("G", "4") => {
                let seconds = words.next().and_then(|word| word.strip_prefix('P'));
                EventKind::Dwell(seconds.and_then(non_negative).ok_or_else(bad)?)
            }
            ("G", "96") => {
                let speed = words.next().and_then(|word| word.strip_prefix('S'));
                let m_min = speed.and_then(non_negative).ok_or_else(bad)?;
                let rpm_max = words
                    .next()
                    .map(|word| word.strip_prefix('D').and_then(non_negative).ok_or_else(bad));
                EventKind::SurfaceSpeed { m_min, rpm_max: rpm_max.transpose()? }
            }
            _ => return Err(bad()),
        };
        for word in words {
            let EventKind::M { spindle_rpm, tool, .. } = &mut kind else { return Err(bad()) };
            match word.split_at_checked(1).ok_or_else(bad)? {
                ("S", rpm) if spindle_rpm.is_none() => {
                    *spindle_rpm = Some(non_negative(rpm).ok_or_else(bad)?);
                }
                ("T", number) if tool.is_none() => {
                    *tool = Some(number.parse().map_err(|_| bad())?);
                }
                _ => return Err(bad()),
            }
        }
        Ok(kind)
    }
}

/// The words of an M function: none where they are not words, or those of the spindle and of tools
/// only.
fn function_words<'a>(words: impl Iterator<Item = &'a str>) -> Option<EventWords> {
    let mut found = EventWords::default();
    for word in words {
        let (letter, value) = word.split_at_checked(1)?;
        let letter = letter.bytes().next().filter(u8::is_ascii_uppercase)?;
        let value = value.parse().ok().filter(|value: &f64| value.is_finite())?;
        if !found.push(letter, value) {
            return None;
        }
    }
    let is_own = found.iter().any(|(letter, _)| !matches!(letter, b'S' | b'T'));
    is_own.then_some(found)
}

/// The words behind M66.
fn wait<'t>(mut words: impl Iterator<Item = &'t str>) -> Option<EventKind> {
    let input = words.next()?;
    let (analog, number) = match input.strip_prefix('E') {
        Some(number) => (true, number),
        None => (false, input.strip_prefix('P')?),
    };
    let number = number.parse().ok()?;
    let kind = words.next()?.strip_prefix('L')?.parse().ok().filter(|kind| *kind <= 4)?;
    let seconds = words.next()?.strip_prefix('Q').and_then(non_negative)?;
    words.next().is_none().then_some(EventKind::WaitInput { number, analog, kind, seconds })
}

fn non_negative(text: &str) -> Option<f64> {
    text.parse().ok().filter(|value: &f64| value.is_finite() && *value >= 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_event_reads_back_as_it_was_written() {
        for text in [
            "M3 S1200",
            "M6 T2",
            "M0",
            "G4 P0.5",
            "S800",
            "T1",
            "M3 S1.5 T4",
            "G96 S200",
            "G96 S200 D2500",
            "M64 P3",
            "M68 E0 Q-1.5",
            "M101 P1 Q2",
            "M66 P1 L3 Q2.5",
            "M66 E0 L0 Q0",
        ] {
            assert_eq!(text.parse::<EventKind>().unwrap().to_string(), text);
        }
        for text in [
            "",
            "Q1",
            "M",
            "M3 S",
            "G4",
            "G4 P-1",
            "S1 S2",
            "M3 S1 S2",
            "é",
            "G4 Pinf",
            "G96",
            "G96 S1 T1",
            "M64 P",
            "M64 P1 P2",
            "M1 A1 B1 C1 D1 E1",
            "M64 Pinf",
            "S5 P1",
            "M66",
            "M66 P1 L5 Q1",
            "M66 P1 L0 Q1 S1",
        ] {
            assert!(text.parse::<EventKind>().is_err(), "{text}");
        }
    }
}
