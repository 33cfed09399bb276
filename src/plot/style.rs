//! What all drawings share: how a document begins, and one style sheet, on light and on dark.
//!
//! The sheet is the same in every document, so that a page with several drawings needs it once.

use std::fmt::{self, Formatter};

use crate::plot::text::Escaped;

/// Colours of curves, that people with any vision of colours tell apart (Okabe and Ito), on light and on
/// dark.
pub const CURVES: [[&str; 2]; 8] = [
    ["#0072b2", "#56b4e9"],
    ["#d55e00", "#ff8c42"],
    ["#008060", "#2bc79b"],
    ["#b0468c", "#e08ac4"],
    ["#8a6d00", "#e6c229"],
    ["#3b3f99", "#9aa0ff"],
    ["#7a4b2a", "#c9966b"],
    ["#555555", "#bbbbbb"],
];

/// Colours of speeds from slow to fast, on light and on dark: of even steps in lightness, told apart with
/// any vision of colours.
pub const SPEEDS: [[&str; 2]; 7] = [
    ["#5b2a86", "#7f6fd6"],
    ["#3f4fa8", "#5f93e8"],
    ["#1f77a8", "#35b0d8"],
    ["#0f8f7f", "#2fd0b0"],
    ["#5a9216", "#9edb4a"],
    ["#c77f00", "#ffc247"],
    ["#c23a22", "#ff7f5e"],
];

/// Rules without colours.
const SHAPES: &str = "\
.plot { font: 12px system-ui, \"DejaVu Sans\", sans-serif }
.plot .title { font-size: 15px; font-weight: 600 }
.plot .panel { font-weight: 600 }
.plot .middle { text-anchor: middle } .plot .end { text-anchor: end }
.plot .grid, .plot .frame, .plot .curve, .plot .limit, .plot .travel, .plot .way, .plot .wrong, .plot .level, .plot .span { fill: none }
.plot .curve, .plot .level { stroke-width: 1.5; stroke-linejoin: round }
.plot .limit { stroke-dasharray: 6 4 }
.plot .beside { text-anchor: end; paint-order: stroke; stroke-width: 4 }
.plot .travel { stroke-dasharray: 2 4 }
.plot .way { stroke-width: 1.5; stroke-linejoin: round; stroke-linecap: round }
.plot .rapid { stroke-width: 1; stroke-dasharray: 5 4 }
.plot .wrong { stroke-width: 3 }
";

/// A class, what of it has a colour, and that on light and on dark.
const COLOURS: [(&str, &str, [&str; 2]); 13] = [
    (".paper", "fill", ["#fff", "#14181d"]),
    ("text", "fill", ["#1b1f24", "#e2e7ed"]),
    (".beside", "stroke", ["#fff", "#14181d"]),
    (".grid", "stroke", ["#e5e9ed", "#272e36"]),
    (".frame", "stroke", ["#6b7480", "#98a2ae"]),
    (".limit", "stroke", ["#6b7480", "#98a2ae"]),
    (".travel", "stroke", ["#8a5a00", "#d9a441"]),
    (".rapid", "stroke", ["#8b949e", "#7d8894"]),
    (".seam", "fill", ["#1b1f24", "#e2e7ed"]),
    (".seam", "stroke", ["#fff", "#14181d"]),
    (".wrong", "stroke", ["#d1242f", "#ff6b6b"]),
    (".level", "stroke", ["#0072b2", "#56b4e9"]),
    (".span", "stroke", ["#d55e00", "#ff8c42"]),
];

/// The style sheet of every drawing, as an element.
pub fn element() -> String {
    let [light, dark] = [0, 1].map(colours);
    format!("<style>\n{SHAPES}{light}@media (prefers-color-scheme: dark) {{\n{dark}}}\n</style>\n")
}

/// The rules of colours on light, or on dark.
fn colours(shade: usize) -> String {
    let rule =
        |class: &str, what: &str, colour: &str| format!(".plot {class} {{ {what}: {colour} }}\n");
    let fixed = COLOURS.iter().map(|(class, what, colours)| rule(class, what, colours[shade]));
    let pair = |[line, area]: [char; 2], (at, colours): (usize, &[&str; 2])| {
        let colour = colours[shade];
        rule(&format!(".{line}{at}"), "stroke", colour)
            + &rule(&format!(".{area}{at}"), "fill", colour)
    };
    let curves = CURVES.iter().enumerate().map(|curve| pair(['c', 'd'], curve));
    let speeds = SPEEDS.iter().enumerate().map(|speed| pair(['v', 'b'], speed));
    fixed.chain(curves).chain(speeds).collect()
}

/// The beginning of a document: its size, its style and its paper.
pub fn open(out: &mut Formatter<'_>, [width, height]: [f64; 2], title: &str) -> fmt::Result {
    let (title, style) = (Escaped(title), element());
    write!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"plot\" viewBox=\"0 0 {width} {height}\" role=\"img\">\n\
         <title>{title}</title>\n\
         {style}\
         <rect class=\"paper\" width=\"{width}\" height=\"{height}\"/>\n"
    )
}

/// The title, of which so many letters are shown at most.
pub fn title(
    out: &mut Formatter<'_>,
    title: &str,
    [left, base]: [f64; 2],
    letters_max: usize,
) -> fmt::Result {
    let shown: String = match title.chars().nth(letters_max) {
        Some(_) => title.chars().take(letters_max).chain(['…']).collect(),
        None => title.to_owned(),
    };
    let shown = Escaped(&shown);
    writeln!(out, "<text class=\"title\" x=\"{left}\" y=\"{base}\">{shown}</text>")
}
