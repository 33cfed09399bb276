//! Samples of signals ⇄ rows of text: `t_us,line,code,strobe,den,fin,motion`, levels as 0 and 1.

use std::fmt;
use std::str::FromStr;

use super::{Sample, Signals};

/// The row above the others.
pub const HEADER: &str = "t_us,line,code,strobe,den,fin,motion";

impl fmt::Display for Sample {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Sample { at_us, line, nc, fin, moves } = self;
        write!(f, "{at_us},{line},")?;
        nc.function.map_or(Ok(()), |function| write!(f, "{function}"))?;
        let [strobe, den, fin, moves] = [nc.strobe, nc.den, *fin, *moves].map(u8::from);
        write!(f, ",{strobe},{den},{fin},{moves}")
    }
}

/// A row that says no signals.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a row of {HEADER} is expected")]
pub struct NoSample;

impl FromStr for Sample {
    type Err = NoSample;

    fn from_str(row: &str) -> Result<Self, NoSample> {
        let cells: Vec<&str> = row.trim().split(',').collect();
        let [at_us, line, code, levels @ ..] = &cells[..] else { return Err(NoSample) };
        let level = |level: &&str| match *level {
            "0" => Ok(false),
            "1" => Ok(true),
            _ => Err(NoSample),
        };
        let levels = levels.iter().map(level).collect::<Result<Vec<_>, _>>()?;
        let [strobe, den, fin, moves] = levels[..] else { return Err(NoSample) };
        let function = match *code {
            "" => None,
            code => Some(code.parse().map_err(|_| NoSample)?),
        };
        Ok(Sample {
            at_us: at_us.parse().map_err(|_| NoSample)?,
            line: line.parse().map_err(|_| NoSample)?,
            nc: Signals { function, strobe, den },
            fin,
            moves,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_back() {
        for row in ["0,0,,0,0,0,0", "30000,3,T12,1,1,0,0", "18446744073709551615,9,S1200,0,1,1,1"] {
            assert_eq!(row.parse::<Sample>().unwrap().to_string(), row);
        }
        for row in
            ["", HEADER, "1,2,M8,1,1,0", "1,2,M8,1,1,0,2", "1,2,X8,1,1,0,0", "-1,2,M8,1,1,0,0"]
        {
            assert_eq!(row.parse::<Sample>(), Err(NoSample), "{row}");
        }
    }
}
