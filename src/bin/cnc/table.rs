//! A table of results: for people, as CSV, or as JSON objects.

use std::io::{self, Write};

use cnc::base::rounding::six_digits;
use serde_json::{Map, Value, json};

/// A column: its key in JSON and CSV, and what people read above it.
pub type Column = (&'static str, &'static str);

/// What stands in a column.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    Text(String),
    Whole(u64),
    /// A number, and how many decimals people see.
    Number(f64, usize),
    Flag(bool),
    /// Means nothing here.
    Empty,
}

/// Rows of cells under columns.
pub struct Table {
    pub columns: Vec<Column>,
    pub rows: Vec<Vec<Cell>>,
}

impl Cell {
    pub fn text(text: impl ToString) -> Cell {
        Cell::Text(text.to_string())
    }

    /// A number, or nothing.
    pub fn some(value: Option<f64>, decimals: usize) -> Cell {
        value.map_or(Cell::Empty, |value| Cell::Number(value, decimals))
    }

    fn shown(&self) -> String {
        match self {
            Cell::Text(text) => text.clone(),
            Cell::Whole(number) => number.to_string(),
            Cell::Number(number, decimals) => format!("{number:.decimals$}"),
            Cell::Flag(flag) => if *flag { "yes" } else { "no" }.to_owned(),
            Cell::Empty => "-".to_owned(),
        }
    }

    fn value(&self) -> Value {
        match self {
            Cell::Text(text) => json!(text),
            Cell::Whole(number) => json!(number),
            Cell::Number(number, _) => json!(six_digits(*number)),
            Cell::Flag(flag) => json!(flag),
            Cell::Empty => Value::Null,
        }
    }
}

impl Table {
    /// Aligned: texts to the left, all else to the right.
    pub fn print(&self, out: &mut impl Write) -> io::Result<()> {
        let widths: Vec<usize> = (0..self.columns.len())
            .map(|at| {
                let cells = self.rows.iter().map(|row| row[at].shown().chars().count());
                cells.chain([self.columns[at].1.chars().count()]).max().unwrap_or(0)
            })
            .collect();
        let is_text = |at: usize| self.rows.iter().any(|row| matches!(row[at], Cell::Text(_)));
        let heads: Vec<String> = self.columns.iter().map(|column| column.1.to_owned()).collect();
        let rows = self.rows.iter().map(|row| row.iter().map(Cell::shown).collect());
        for row in [heads].into_iter().chain(rows) {
            let cells = row.iter().enumerate().map(|(at, cell)| match widths[at] {
                width if is_text(at) => format!("{cell:<width$}"),
                width => format!("{cell:>width$}"),
            });
            writeln!(out, "{}", cells.collect::<Vec<_>>().join("  ").trim_end())?;
        }
        Ok(())
    }

    /// With the keys as head.
    pub fn csv(&self, out: &mut impl Write) -> io::Result<()> {
        let mut writer = csv::Writer::from_writer(out);
        writer.write_record(self.columns.iter().map(|column| column.0)).map_err(of_file)?;
        for row in &self.rows {
            let cells = row.iter().map(|cell| match cell {
                Cell::Number(number, _) => six_digits(*number).to_string(),
                Cell::Flag(flag) => flag.to_string(),
                Cell::Empty => String::new(),
                Cell::Text(_) | Cell::Whole(_) => cell.shown(),
            });
            writer.write_record(cells).map_err(of_file)?;
        }
        writer.flush()
    }

    /// An object a row.
    pub fn json(&self) -> Value {
        let object = |row: &Vec<Cell>| {
            let cells = self.columns.iter().zip(row);
            Value::Object(
                cells
                    .map(|((key, _), cell)| ((*key).to_owned(), cell.value()))
                    .collect::<Map<_, _>>(),
            )
        };
        self.rows.iter().map(object).collect()
    }
}
/// The error of the file below, which says whether its reader has gone.
fn of_file(error: csv::Error) -> io::Error {
    match error.into_kind() {
        csv::ErrorKind::Io(error) => error,
        other => io::Error::other(format!("{other:?}")),
    }
}
