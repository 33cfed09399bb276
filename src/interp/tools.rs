//! The tool table: offsets and diameters by number, from CSV or LinuxCNC's format.
//!
//! ```text
//! tool,z,diameter,name          T1 P1 Z12.5 D6 ;end mill
//! 1,12.5,6,end mill
//! ```
//!
//! Lengths are mm in both. Wear and pockets mean nothing to a path and are passed
//! over; a column or word that is unknown is an error.

use std::collections::BTreeMap;

use crate::base::machine::POSITION_MOST;
use crate::base::{Axis, Point};

/// A tool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tool {
    /// What G43 adds to positions: of a mill its length, on Z.
    pub offset_mm: Point,
    /// Diameter, for cutter compensation.
    pub diameter_mm: f64,
    /// Where the tip of a lathe tool points to, 1 to 8 (LinuxCNC); 0 and 9: no lathe tool's.
    pub orientation: u32,
}

impl Tool {
    const NONE: Tool = Tool { offset_mm: Point::ZERO, diameter_mm: 0.0, orientation: 0 };
}

/// A tool table.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tools {
    tools: BTreeMap<u32, Tool>,
    /// What people call them.
    names: BTreeMap<u32, String>,
    /// Wear that a program has set, of length and radius; the tools' offsets have it in them.
    wear_mm: BTreeMap<u32, [f64; 2]>,
}

/// What a control keeps of a tool, beside its wear.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Measure {
    Length,
    Radius,
}

/// Why a text is no tool table.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {reason}")]
pub struct ToolsError {
    /// Line of the table, from 1.
    pub line: u64,
    /// What is wrong, and what is expected.
    pub reason: String,
}

impl Tools {
    /// Reads a table; a first line that begins with `T` and a digit is LinuxCNC's.
    ///
    /// # Errors
    /// Names the first line that cannot be read.
    pub fn parse(text: &str) -> Result<Tools, ToolsError> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let first = text.lines().map(str::trim).find(|line| !line.is_empty() && !is_comment(line));
        let is_linuxcnc = first.is_some_and(|line| {
            let mut bytes = line.bytes();
            bytes.next().is_some_and(|byte| byte.eq_ignore_ascii_case(&b'T'))
                && bytes.next().is_some_and(|byte| byte.is_ascii_digit() || byte == b' ')
        });
        if is_linuxcnc { parse_words(text) } else { parse_csv(text) }
    }

    /// A tool by its number.
    pub fn get(&self, number: u32) -> Option<&Tool> {
        self.tools.get(&number)
    }

    /// What people call a tool, if the table says it.
    pub fn name(&self, number: u32) -> Option<&str> {
        self.names.get(&number).map(String::as_str)
    }

    /// Whether there is no tool.
    pub fn is_empty(&self) -> bool {
        self.tools.is_empty()
    }

    /// The numbers of all tools, in order.
    pub fn numbers(&self) -> impl Iterator<Item = u32> {
        self.tools.keys().copied()
    }

    /// A tool to change; it is made if there is none.
    pub(super) fn entry(&mut self, number: u32) -> &mut Tool {
        self.tools.entry(number).or_insert(Tool::NONE)
    }

    /// The wear of a tool.
    pub(super) fn wear_mm(&self, number: u32, measure: Measure) -> f64 {
        self.wear_mm.get(&number).map_or(0.0, |wear_mm| wear_mm[measure as usize])
    }

    /// A measure of a tool without its wear; of one that is not there 0.
    pub(super) fn measure_mm(&self, number: u32, measure: Measure) -> f64 {
        let whole_mm = self.get(number).map_or(0.0, |tool| match measure {
            Measure::Length => tool.offset_mm[Axis::Z],
            Measure::Radius => tool.diameter_mm / 2.0,
        });
        whole_mm - self.wear_mm(number, measure)
    }

    /// Sets a measure of a tool, or its wear.
    pub(super) fn set_measure(&mut self, number: u32, measure: Measure, is_wear: bool, mm: f64) {
        let other_mm = if is_wear {
            let other_mm = self.measure_mm(number, measure);
            self.wear_mm.entry(number).or_default()[measure as usize] = mm;
            other_mm
        } else {
            self.wear_mm(number, measure)
        };
        let tool = self.entry(number);
        match measure {
            Measure::Length => tool.offset_mm[Axis::Z] = mm + other_mm,
            Measure::Radius => tool.diameter_mm = 2.0 * (mm + other_mm),
        }
    }

    fn add(
        &mut self,
        line: u64,
        number: u32,
        tool: Tool,
        name: Option<&str>,
    ) -> Result<(), ToolsError> {
        let clean =
            |name: &str| name.trim().chars().filter(|c| !c.is_control()).collect::<String>();
        if let Some(name) = name.map(clean).filter(|name| !name.is_empty()) {
            self.names.insert(number, name);
        }
        match self.tools.insert(number, tool) {
            None => Ok(()),
            Some(_) => {
                Err(ToolsError { line, reason: format!("tool {number} stands there twice") })
            }
        }
    }
}

fn is_comment(line: &str) -> bool {
    line.starts_with([';', '#'])
}

/// Words of LinuxCNC's table that say nothing of the path: pocket, lathe angles.
const WORDS_PASSED_OVER: &[u8] = b"PIJ";

fn parse_words(text: &str) -> Result<Tools, ToolsError> {
    let mut tools = Tools::default();
    for (line, row) in (1..).zip(text.lines()) {
        let fault = |reason: String| ToolsError { line, reason };
        let (row, name) = row.split_once(';').map_or((row, None), |(row, name)| (row, Some(name)));
        let row = row.to_ascii_uppercase();
        let (mut number, mut tool) = (None, Tool::NONE);
        // `T 1` and `T1` are the same.
        let mut words = row.split_ascii_whitespace();
        while let Some(word) = words.next() {
            let (letter, value) = word.split_at_checked(1).unwrap_or_default();
            let value = if value.is_empty() { words.next().unwrap_or_default() } else { value };
            let letter = letter.bytes().next().unwrap_or_default();
            match (letter, Axis::from_letter(letter)) {
                (b'T', _) => number = Some(tool_number(value).map_err(fault)?),
                (b'D', _) => tool.diameter_mm = length_mm(value).map_err(fault)?,
                (b'Q', _) => tool.orientation = orientation(value).map_err(fault)?,
                (_, Some(axis)) => tool.offset_mm[axis] = length_mm(value).map_err(fault)?,
                _ if WORDS_PASSED_OVER.contains(&letter) => {}
                _ => return Err(fault(format!("'{word}' is no word of a tool table"))),
            }
        }
        match number {
            Some(number) => tools.add(line, number, tool, name)?,
            None if row.trim().is_empty() => {}
            None => return Err(fault("there is no T word, the tool's number".to_owned())),
        }
    }
    Ok(tools)
}

/// What a column of the CSV form holds.
enum Column {
    Number,
    Offset(Axis),
    Diameter,
    Radius,
    Orientation,
    Name,
    PassedOver,
}

fn column(name: &str) -> Option<Column> {
    Some(match name {
        "tool" | "number" | "t" => Column::Number,
        "length" => Column::Offset(Axis::Z),
        "diameter" | "d" => Column::Diameter,
        "radius" => Column::Radius,
        "orientation" | "q" => Column::Orientation,
        "name" | "comment" | "description" => Column::Name,
        "pocket" => Column::PassedOver,
        _ => match name.as_bytes() {
            [letter] => Column::Offset(Axis::from_letter(letter.to_ascii_uppercase())?),
            _ => return None,
        },
    })
}

fn parse_csv(text: &str) -> Result<Tools, ToolsError> {
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(text.as_bytes());
    let broken = |error: csv::Error| ToolsError {
        line: error.position().map_or(1, csv::Position::line),
        reason: error.to_string(),
    };
    let mut columns = Vec::new();
    for name in reader.headers().map_err(broken)? {
        let known = column(&name.to_ascii_lowercase());
        columns.push(known.ok_or_else(|| ToolsError {
            line: 1,
            reason: format!(
                "'{name}' is no column of a tool table; expected tool, length, diameter, \
                 orientation, name, or an axis"
            ),
        })?);
    }
    let mut tools = Tools::default();
    for record in reader.records() {
        let record = record.map_err(broken)?;
        let line = record.position().map_or(1, csv::Position::line);
        let fault = |reason: String| ToolsError { line, reason };
        let (mut number, mut tool, mut name) = (None, Tool::NONE, None);
        for (column, value) in columns.iter().zip(&record) {
            match column {
                Column::Number => number = Some(tool_number(value).map_err(fault)?),
                Column::PassedOver => {}
                _ if value.is_empty() => {}
                Column::Name => name = name.or(Some(value)),
                Column::Offset(axis) => tool.offset_mm[*axis] = length_mm(value).map_err(fault)?,
                Column::Diameter => tool.diameter_mm = length_mm(value).map_err(fault)?,
                Column::Radius => tool.diameter_mm = 2.0 * length_mm(value).map_err(fault)?,
                Column::Orientation => tool.orientation = orientation(value).map_err(fault)?,
            }
        }
        let number = number.ok_or_else(|| fault("there is no column 'tool'".to_owned()))?;
        tools.add(line, number, tool, name)?;
    }
    Ok(tools)
}

fn tool_number(text: &str) -> Result<u32, String> {
    let number = text.parse().ok().filter(|number| *number <= 99_999);
    number.ok_or_else(|| format!("'{text}' is no tool number: a whole number from 0 to 99999"))
}

fn orientation(text: &str) -> Result<u32, String> {
    let number = text.parse().ok().filter(|number| *number <= 9);
    number.ok_or_else(|| format!("'{text}' is no orientation of a lathe tool: 0 to 9"))
}

fn length_mm(text: &str) -> Result<f64, String> {
    let value = text.parse().ok().filter(|value: &f64| value.abs() <= POSITION_MOST);
    value.ok_or_else(|| format!("'{text}' is no length in mm"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tool(text: &str, number: u32) -> (f64, f64) {
        let tools = Tools::parse(text).unwrap();
        let tool = tools.get(number).unwrap();
        (tool.offset_mm[Axis::Z], tool.diameter_mm)
    }

    #[test]
    fn both_formats_are_read() {
        assert_eq!(tool("tool,length,diameter,name\n1,12.5,6,end mill\n2,,3,\n", 1), (12.5, 6.0));
        assert_eq!(tool("Tool, Z, Radius\r\n7, -4, 1.5\r\n", 7), (-4.0, 3.0));
        assert_eq!(tool("; table\nT1 P1 Z12.5 D6 ;x\n\nT2 P2 D+3.0 z-1 Q0\n", 2), (-1.0, 3.0));
        assert_eq!(tool("T 1 P 1 Z 12.5 D 6\n", 1), (12.5, 6.0));
        assert!(Tools::parse("tool,z\n").unwrap().is_empty());
        for text in ["tool,comment,z\n3,small drill,1\n", "T3 Z1 ; small drill\n"] {
            assert_eq!(Tools::parse(text).unwrap().name(3), Some("small drill"));
        }
    }

    #[test]
    fn what_is_no_table_is_refused_by_line() {
        for (text, line) in [
            ("tool,z\n1,2\n1,3\n", 3),
            ("tool,z\n1,2,3\n", 2),
            ("tool,z\nx,2\n", 2),
            ("tool,z\n1,1e9\n", 2),
            ("tool,flavour\n1,2\n", 1),
            ("z\n1\n", 2),
            ("T1 Z1\nZ2\n", 2),
            ("T1 Z1\nT2 E5\n", 2),
            ("T1 Znan\n", 1),
            ("T1 Q10\n", 1),
        ] {
            assert_eq!(Tools::parse(text).unwrap_err().line, line, "{text}");
        }
    }
}
