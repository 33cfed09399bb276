//! What marks mean: marks and words → lines of a drawing, as many as its width asks for.

use std::fmt::{self, Formatter};

use crate::plot::text::Escaped;

/// Height of a line.
pub const LINE: f64 = 20.0;
/// Between a mark and its words, and between those and the next mark.
const GAPS: [f64; 2] = [7.0, 20.0];
/// A letter is about so wide.
const LETTER: f64 = 7.0;

/// A mark and what it means.
#[derive(Clone, Debug)]
pub struct Entry {
    /// The mark as SVG, from its left end to the right, about its middle.
    pub mark: String,
    /// How wide that is.
    pub wide: f64,
    /// What it means.
    pub text: String,
}

impl Entry {
    /// A mark as wide as a piece of a line.
    pub fn new(mark: impl Into<String>, text: impl Into<String>) -> Entry {
        Entry { mark: mark.into(), wide: 22.0, text: text.into() }
    }

    fn width(&self) -> f64 {
        self.wide + GAPS[0] + LETTER * self.text.chars().count() as f64
    }
}

/// Where each entry stands: how far from the left, and in which line.
fn places(entries: &[Entry], width: f64) -> Vec<[f64; 2]> {
    let (mut left, mut line) = (0.0, 0.0);
    let mut places = Vec::new();
    for entry in entries {
        if left > 0.0 && left + entry.width() > width {
            (left, line) = (0.0, line + 1.0);
        }
        places.push([left, line]);
        left += entry.width() + GAPS[1];
    }
    places
}

/// How high the entries are within a width.
pub fn height(entries: &[Entry], width: f64) -> f64 {
    places(entries, width).last().map_or(0.0, |[_, line]| (line + 1.0) * LINE)
}

/// Writes the entries from a place on, to the right and down, within a width.
pub fn write(
    out: &mut Formatter<'_>,
    entries: &[Entry],
    [left, top]: [f64; 2],
    width: f64,
) -> fmt::Result {
    for (entry, [right, line]) in entries.iter().zip(places(entries, width)) {
        let (x, y) = (left + right, top + (line + 0.5) * LINE);
        let (mark, text) = (&entry.mark, Escaped(&entry.text));
        let [text_x, base] = [x + entry.wide + GAPS[0], y + 4.0];
        writeln!(
            out,
            "<g transform=\"translate({x:.1} {y:.1})\">{mark}</g><text x=\"{text_x:.1}\" y=\"{base:.1}\">{text}</text>",
        )?;
    }
    Ok(())
}
