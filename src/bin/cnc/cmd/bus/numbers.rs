//! Lists of numbers on the command line: `1,2,4-8`.

use std::str::FromStr;

/// Most numbers of a list.
const MOST: usize = 10_000;

/// Whole numbers from 1 on.
#[derive(Clone, Debug, PartialEq)]
pub struct Wholes(pub Vec<u32>);

/// Numbers above 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Decimals(pub Vec<f64>);

impl FromStr for Wholes {
    type Err = String;

    fn from_str(text: &str) -> Result<Wholes, String> {
        let whole = |text: &str| {
            let number = text.trim().parse().ok().filter(|number| *number > 0);
            number.ok_or_else(|| format!("'{text}' is no whole number above 0"))
        };
        let mut list = Vec::new();
        for part in text.split(',') {
            let (first, last) = part.split_once('-').unwrap_or((part, part));
            let (first, last): (u32, u32) = (whole(first)?, whole(last)?);
            let count = (last as usize).saturating_sub(first as usize) + 1;
            if first > last || list.len() + count > MOST {
                return Err(format!("'{part}': from the less to the greater, {MOST} at most"));
            }
            list.extend(first..=last);
        }
        Ok(Wholes(list))
    }
}

impl FromStr for Decimals {
    type Err = String;

    fn from_str(text: &str) -> Result<Decimals, String> {
        text.split(',').map(positive).collect::<Result<_, _>>().map(Decimals)
    }
}

/// A number above 0, and not so small or great that times could not be told any more.
pub fn positive(text: &str) -> Result<f64, String> {
    let number = text.trim().parse().ok().filter(|number| (1e-6..=1e9).contains(number));
    number.ok_or_else(|| format!("'{text}' is no number above 0"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_have_numbers_and_ranges() {
        assert_eq!("1,2,4-6".parse(), Ok(Wholes(vec![1, 2, 4, 5, 6])));
        assert_eq!("9600".parse(), Ok(Wholes(vec![9600])));
        assert_eq!("0.5, 100".parse(), Ok(Decimals(vec![0.5, 100.0])));
        for bad in ["", "0", "-1", "1,", "3-1", "1-4294967295", "1.5", "x"] {
            assert!(bad.parse::<Wholes>().is_err(), "{bad}");
        }
        for bad in ["", "0", "-1", "inf", "nan", "1e300", "1,x"] {
            assert!(bad.parse::<Decimals>().is_err(), "{bad}");
        }
    }
}
