//! A fault as users write it ⇄ what it does and when: `drop:Y@data.17`, `reset:X@tick.40`.

use std::fmt;
use std::str::FromStr;

use crate::base::Axis;
use crate::base::machine::Unit;

/// What the host's bytes are part of. Answers belong to the phase of what they answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Phase {
    /// A question whether a node is there, up to the end of its jog; and what follows a failure.
    Ping,
    /// A fill command.
    Command,
    /// The bytes of a buffer.
    Data,
    /// The start pair.
    Start,
    /// A sync byte up to the buffer's last movement.
    Tick,
    /// A sync byte behind that.
    Pad,
}

impl Phase {
    /// All phases, in the order of a buffer.
    pub const ALL: [Phase; 6] =
        [Phase::Ping, Phase::Command, Phase::Data, Phase::Start, Phase::Tick, Phase::Pad];

    /// As in a fault's place.
    pub fn name(self) -> &'static str {
        ["ping", "command", "data", "start", "tick", "pad"][self as usize]
    }
}

/// What goes wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FaultKind {
    /// A byte of the host is lost.
    Drop,
    /// Bits of a byte of the host are inverted.
    Change(u8),
    /// This byte comes before a byte of the host.
    Add(u8),
    /// A byte of the host, and all behind it, come so many microseconds late.
    Late(u64),
    /// An answer is lost.
    LoseAnswer,
    /// Bits of an answer are inverted.
    ChangeAnswer(u8),
    /// An answer comes twice.
    DoubleAnswer,
    /// An answer comes so many microseconds late.
    LateAnswer(u64),
    /// A node speaks at the same time as another: a bit is 1 where both send 1.
    Collide,
    /// A node is without power from here on.
    Dead,
    /// A node reads nothing for so many microseconds.
    Stall(u64),
    /// A node starts anew, its buffer empty.
    Reset,
    /// A node's receiver overruns: it is deaf until it is switched off.
    Overrun,
    /// The port is closed by its other end.
    Close,
}

/// Names of the kinds, one each, and whether a value belongs to them.
const KINDS: [(&str, FaultKind); 14] = [
    ("drop", FaultKind::Drop),
    ("change", FaultKind::Change(0)),
    ("add", FaultKind::Add(0)),
    ("late", FaultKind::Late(0)),
    ("lose-answer", FaultKind::LoseAnswer),
    ("change-answer", FaultKind::ChangeAnswer(0)),
    ("double-answer", FaultKind::DoubleAnswer),
    ("late-answer", FaultKind::LateAnswer(0)),
    ("collide", FaultKind::Collide),
    ("dead", FaultKind::Dead),
    ("stall", FaultKind::Stall(0)),
    ("reset", FaultKind::Reset),
    ("overrun", FaultKind::Overrun),
    ("close", FaultKind::Close),
];

/// Longest delay of a fault: ten minutes.
const DELAY_MAX_US: u64 = 600_000_000;

impl FaultKind {
    /// How it is written, without a value.
    pub fn name(self) -> &'static str {
        let same = |kind: FaultKind| std::mem::discriminant(&kind) == std::mem::discriminant(&self);
        KINDS.into_iter().find(|(_, kind)| same(*kind)).map_or("", |(name, _)| name)
    }

    /// Whether it strikes answers, so that its place counts answers and not bytes of the host.
    pub fn is_of_answer(self) -> bool {
        use FaultKind::{ChangeAnswer, Collide, DoubleAnswer, LateAnswer, LoseAnswer};
        matches!(self, LoseAnswer | ChangeAnswer(_) | DoubleAnswer | LateAnswer(_) | Collide)
    }

    /// Whether it strikes one node, which has to be named.
    pub fn needs_node(self) -> bool {
        use FaultKind::{Collide, Dead, Overrun, Reset, Stall};
        matches!(self, Collide | Dead | Stall(_) | Reset | Overrun)
    }

    /// Whether it may strike one node alone: what that one hears, or all.
    fn may_name_node(self) -> bool {
        use FaultKind::{Add, Change, Drop};
        self.needs_node() || matches!(self, Drop | Change(_) | Add(_))
    }

    fn value(self) -> Option<u64> {
        match self {
            FaultKind::Change(byte) | FaultKind::Add(byte) | FaultKind::ChangeAnswer(byte) => {
                Some(byte.into())
            }
            FaultKind::Late(us) | FaultKind::LateAnswer(us) | FaultKind::Stall(us) => Some(us),
            _ => None,
        }
    }

    fn with_value(self, value: u64) -> Option<FaultKind> {
        let byte = u8::try_from(value).ok();
        let mask = byte.filter(|mask| *mask != 0);
        let us = Some(value).filter(|us| (1..=DELAY_MAX_US).contains(us));
        match self {
            FaultKind::Change(_) => mask.map(FaultKind::Change),
            FaultKind::ChangeAnswer(_) => mask.map(FaultKind::ChangeAnswer),
            FaultKind::Add(_) => byte.map(FaultKind::Add),
            FaultKind::Late(_) => us.map(FaultKind::Late),
            FaultKind::LateAnswer(_) => us.map(FaultKind::LateAnswer),
            FaultKind::Stall(_) => us.map(FaultKind::Stall),
            _ => None,
        }
    }
}

/// Which node a fault strikes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Who {
    /// That of an axis.
    Axis(Axis),
    /// That of an ID.
    Id(u8),
}

impl Who {
    /// Whether it is this node.
    pub fn is(self, unit: Unit) -> bool {
        match self {
            Who::Axis(axis) => unit.axis == Some(axis),
            Who::Id(id) => unit.id == id,
        }
    }
}

/// A fault to bring about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct FaultSpec {
    /// What goes wrong.
    pub kind: FaultKind,
    /// For which node; none: for all.
    pub who: Option<Who>,
    /// Counts what is of this phase; none: everything.
    pub phase: Option<Phase>,
    /// At which byte of the host, or at which answer, from 0.
    pub number: u64,
}

/// A text that is no fault.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FaultSpecError {
    /// The form is wrong.
    #[error("'{0}' is no fault; expected KIND[=VALUE][:NODE]@[PHASE.]NUMBER, as in drop:Y@data.17")]
    Form(String),
    /// No such kind.
    #[error("'{0}' is no kind of fault; known are {known}", known = names(KINDS.iter().map(|(name, _)| *name)))]
    Kind(String),
    /// No such phase.
    #[error("'{0}' is no phase; known are {known}", known = names(Phase::ALL.iter().map(|phase| phase.name())))]
    Phase(String),
    /// A value that must be there, must not, or is out of range.
    #[error("{0}: {1}")]
    Value(&'static str, &'static str),
    /// A node that must be named, or must not.
    #[error("{0}: {1}")]
    Node(&'static str, &'static str),
}

fn names<'a>(names: impl Iterator<Item = &'a str>) -> String {
    names.collect::<Vec<_>>().join(", ")
}

impl FromStr for FaultSpec {
    type Err = FaultSpecError;

    fn from_str(text: &str) -> Result<Self, FaultSpecError> {
        let form = || FaultSpecError::Form(text.to_owned());
        let (what, place) = text.split_once('@').ok_or_else(form)?;
        let (what, who) = match what.split_once(':') {
            Some((what, who)) => (what, Some(named(who).ok_or_else(form)?)),
            None => (what, None),
        };
        let (name, value) = match what.split_once('=') {
            Some((name, value)) => (name, Some(number(value).ok_or_else(form)?)),
            None => (what, None),
        };
        let known = KINDS.into_iter().find(|(known, _)| *known == name);
        let (name, kind) = known.ok_or_else(|| FaultSpecError::Kind(name.to_owned()))?;
        let kind = match (kind.value(), value) {
            (None, None) => kind,
            (Some(_), Some(value)) => kind.with_value(value).ok_or(FaultSpecError::Value(
                name,
                "its value is a byte, a mask of bits (not 0), or microseconds up to ten minutes",
            ))?,
            (Some(_), None) => Err(FaultSpecError::Value(name, "a value is missing, as in =5"))?,
            (None, Some(_)) => Err(FaultSpecError::Value(name, "it takes no value"))?,
        };
        if kind.needs_node() && who.is_none() {
            return Err(FaultSpecError::Node(name, "a node must be named, as in :X or :122"));
        }
        if who.is_some() && !kind.may_name_node() {
            return Err(FaultSpecError::Node(name, "it strikes no single node"));
        }
        let (phase, at) = match place.split_once('.') {
            Some((phase, at)) => {
                let known = Phase::ALL.into_iter().find(|known| known.name() == phase);
                (Some(known.ok_or_else(|| FaultSpecError::Phase(phase.to_owned()))?), at)
            }
            None => (None, place),
        };
        Ok(FaultSpec { kind, who, phase, number: at.parse().map_err(|_| form())? })
    }
}

fn named(text: &str) -> Option<Who> {
    match text.as_bytes() {
        [letter] if letter.is_ascii_alphabetic() => {
            Axis::from_letter(letter.to_ascii_uppercase()).map(Who::Axis)
        }
        _ => text.parse().ok().map(Who::Id),
    }
}

fn number(text: &str) -> Option<u64> {
    match text.strip_prefix("0x") {
        Some(digits) => u64::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    }
}

impl fmt::Display for FaultSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.kind.name())?;
        self.kind.value().map_or(Ok(()), |value| write!(f, "={value}"))?;
        match self.who {
            Some(Who::Axis(axis)) => write!(f, ":{axis}")?,
            Some(Who::Id(id)) => write!(f, ":{id}")?,
            None => {}
        }
        write!(f, "@")?;
        self.phase.map_or(Ok(()), |phase| write!(f, "{}.", phase.name()))?;
        write!(f, "{}", self.number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_reads_back_as_it_was_written() {
        for text in [
            "drop@0",
            "drop:Y@data.17",
            "change=4@command.1",
            "add=255:122@ping.3",
            "late=500@tick.9",
            "lose-answer@pad.0",
            "change-answer=1@5",
            "double-answer@tick.2",
            "late-answer=90000@data.0",
            "collide:Z@tick.1",
            "dead:X@start.0",
            "stall=60000:X@tick.7",
            "reset:U@data.1",
            "overrun:135@pad.2",
            "close@tick.3",
        ] {
            assert_eq!(text.parse::<FaultSpec>().map(|fault| fault.to_string()), Ok(text.into()));
        }
        assert_eq!("add=0x68:x@1".parse::<FaultSpec>().unwrap().to_string(), "add=104:X@1");
    }

    #[test]
    fn what_is_no_fault_is_told_why() {
        for (text, why) in [
            ("drop", "no fault"),
            ("drop@x", "no fault"),
            ("drop@data.", "no fault"),
            ("drop:QQ@1", "no fault"),
            ("fall@1", "known are drop"),
            ("drop@fill.1", "known are ping"),
            ("drop=1@1", "takes no value"),
            ("change@1", "value is missing"),
            ("change=0@1", "not 0"),
            ("add=256@1", "its value"),
            ("stall=0:X@1", "its value"),
            ("reset@1", "must be named"),
            ("close:X@1", "no single node"),
        ] {
            let error = text.parse::<FaultSpec>().unwrap_err().to_string();
            assert!(error.contains(why), "{text}: {error}");
        }
    }
}
