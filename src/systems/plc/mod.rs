//! M, S and T functions ⇄ signals between a numerical control and a PLC (seed 001, section 6).
//!
//! ```text
//! code     ──╥═══════════════════════════╥──
//! strobe   ────┤TMF├▔▔▔▔▔▔▔▔▔▔▔▔▔▁▁▁▁▁▁▁▁▁    MF, SF or TF
//! DEN      ──▁▁▁▁▁▁▁▁▁▁▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▁▁▁    the block's motion is over
//! FIN      ──────────────────├TFIN┤▔▔▔▔▁▁▁    from the PLC
//! ```
//! The control puts a code out, after TMF its strobe; the PLC does what the code means and gives FIN; once
//! that has stood for TFIN the strobe goes away, then FIN, then the code. TMF and TFIN (1 to 999 ms) are
//! there for relays and switches that bounce. A function alone in its block has DEN from the beginning;
//! one with motion gets it when the motion is over. [`Nc`] is the control's side, [`Plc`] a virtual PLC,
//! [`message`] the bytes between them, which are ours. Time is an argument, in microseconds.

pub mod message;
mod nc;
pub mod record;
mod virtual_plc;

use std::fmt;

use crate::base::EventKind;

pub use self::nc::{Missing, Nc, Times};
pub use self::virtual_plc::{Plc, PlcFault, PlcHappening};

/// What a code is a number of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// An auxiliary function.
    M = 1,
    /// A spindle speed in rpm.
    S = 2,
    /// A tool.
    T = 3,
}

impl Kind {
    /// Name of its strobe.
    pub fn strobe(self) -> &'static str {
        match self {
            Kind::M => "MF",
            Kind::S => "SF",
            Kind::T => "TF",
        }
    }
}

/// A code that the control gives the PLC.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Function {
    /// What it is a number of.
    pub kind: Kind,
    /// The number, of eight digits at most.
    pub code: u32,
}

impl fmt::Display for Function {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}{}", self.kind, self.code)
    }
}

impl std::str::FromStr for Function {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || format!("'{text}' is no function; expected one like M8, S1200 or T2");
        let (letter, code) = text.split_at_checked(1).ok_or_else(expected)?;
        let kind = match letter {
            "M" | "m" => Kind::M,
            "S" | "s" => Kind::S,
            "T" | "t" => Kind::T,
            _ => return Err(expected()),
        };
        let code = code.parse().ok().filter(|code| *code <= CODE_MAX);
        Ok(Function { kind, code: code.ok_or_else(expected)? })
    }
}

/// Greatest code: eight BCD digits.
pub const CODE_MAX: u32 = 99_999_999;

/// The levels that the control puts out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Signals {
    /// The code, in BCD.
    pub function: Option<Function>,
    /// Its strobe: the code is to be obeyed.
    pub strobe: bool,
    /// All else of the block is done.
    pub den: bool,
}

/// All signals from a moment on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Sample {
    /// When, in microseconds.
    pub at_us: u64,
    /// NC line of the function; 0 before the first.
    pub line: u32,
    /// The control's.
    pub nc: Signals,
    /// The PLC's.
    pub fin: bool,
    /// The axes move.
    pub moves: bool,
}

/// The functions of an event, in the order in which the PLC is given them: a spindle speed before what
/// switches the spindle on, a tool before what puts it in. None for what takes time only.
///
/// # Errors
/// In words, for what codes cannot say.
pub fn functions(event: EventKind) -> Result<Vec<Function>, String> {
    let whole = |rpm: f64| {
        let code = (rpm.round() == rpm && (0.0..=f64::from(CODE_MAX)).contains(&rpm))
            .then_some(rpm as u32);
        let code =
            code.ok_or(format!("S{rpm}: a PLC is given a whole number of rpm, of eight digits"))?;
        Ok::<_, String>(Function { kind: Kind::S, code })
    };
    let tool = |code: u32| {
        let fits = code <= CODE_MAX;
        fits.then_some(Function { kind: Kind::T, code })
            .ok_or(format!("T{code} has more than eight digits"))
    };
    Ok(match event {
        EventKind::M { code, spindle_rpm, tool: number } => {
            let m = Function { kind: Kind::M, code: code.into() };
            let before = [spindle_rpm.map(whole).transpose()?, number.map(tool).transpose()?];
            before.into_iter().flatten().chain([m]).collect()
        }
        EventKind::S(rpm) => vec![whole(rpm)?],
        EventKind::T(number) => vec![tool(number)?],
        EventKind::Dwell(_) | EventKind::NextBlock => Vec::new(),
        EventKind::Function { .. }
        | EventKind::SurfaceSpeed { .. }
        | EventKind::WaitInput { .. } => {
            return Err(format!(
                "{event}: a PLC is given codes of M, S and T, and no further words"
            ));
        }
    })
}
