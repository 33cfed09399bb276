//! A tool's way seen from above, from the front, from the side and askew → an SVG document.
//!
//! ```text
//!   XY (from above)      isometric, with the whole travel
//!   ZX (from the front)  YZ (from the side)           one scale for XY, ZX and YZ
//! ```
//!
//! Rapids are dashed, cuts have the colour of their speed. A piece tells its NC line when it is pointed
//! at; where there are too many lines for that, it tells a range of them.

use std::collections::BTreeMap;
use std::fmt::{self, Display, Formatter, Write as _};

use crate::plot::strokes::{Mark, Piece, Place, Strokes, speed_of_mm_s};
use crate::plot::style::{self, SPEEDS};
use crate::plot::text::Escaped;
use crate::plot::ticks;

/// Width of the document, and its height with four views.
const SIZE: [f64; 2] = [1000.0, 940.0];
/// Where the title stands, and how far from the left.
const TITLE: [f64; 2] = [56.0, 30.0];
/// Beside it stands what the colours mean.
const TITLE_LETTERS_MAX: usize = 58;
/// Where the panels begin, and where they end, down from the top.
const PANELS_Y: [f64; 2] = [50.0, 880.0];
/// Room for numbers at the left of a panel and below it, and between two.
const ROOM: [f64; 2] = [56.0, 44.0];
/// Empty room within a panel, as a share of what is shown.
const MARGIN: f64 = 0.06;
/// Elements that tell their lines, in each view at most.
const TOLD_MAX: usize = 700;
/// Parts that a longer way is told in.
const PARTS: usize = 90;
/// Letters of a line that are told at most.
const LETTERS_TOLD_MAX: usize = 60;
/// Seams that are marked at most.
const SEAMS_MAX: usize = 300;
/// What is shown is so wide at least.
const SHOWN_MM_MIN: f64 = 1.0;
/// Marks along an axis at most.
const MARKS_MOST: usize = 8;
/// Bands of speed between the first colour and the last at most: a speed and a 16th of it.
const BANDS_SHOWN: i16 = 12;

/// From where the way is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// From above: X to the right, Y up.
    Xy,
    /// From the side: Y to the right, Z up.
    Yz,
    /// From the front: X to the right, Z up.
    Zx,
    /// Askew: X to the upper right, Y to the upper left, Z up, all of one length.
    Isometric,
}

/// A drawing; its [`Display`] is the SVG document.
#[derive(Debug)]
pub struct Sheet<'a> {
    /// What is shown, in a line.
    pub title: String,
    /// The views: one, or all four.
    pub views: &'a [View],
    /// The way.
    pub strokes: &'a Strokes,
    /// Whether it is known what of it are rapids; if not, all has the colour of its speed.
    pub knows_rapids: bool,
    /// Travel of X, Y and Z, in mm, on machines that have limits.
    pub travel_mm: [Option<[f64; 2]>; 3],
    /// Where node buffers end.
    pub seams: &'a [Mark],
    /// What is wrong first, if anything is.
    pub wrong: Option<Mark>,
    /// NC lines, as far as they are known.
    pub texts: &'a BTreeMap<u32, String>,
}

impl View {
    /// All of them.
    pub const ALL: [View; 4] = [View::Xy, View::Isometric, View::Zx, View::Yz];

    /// To the right and up, in mm.
    fn project(self, [x, y, z]: Place) -> [f64; 2] {
        // cos 30°, and sin 30° = 1/2.
        const COS: f64 = 0.866_025_403_784_438_6;
        match self {
            View::Xy => [x, y],
            View::Yz => [y, z],
            View::Zx => [x, z],
            View::Isometric => [(x - y) * COS, (x + y) * 0.5 + z],
        }
    }

    fn name(self) -> &'static str {
        match self {
            View::Xy => "XY, from above",
            View::Yz => "YZ, from the side",
            View::Zx => "ZX, from the front",
            View::Isometric => "isometric",
        }
    }

    /// Names of what runs to the right and up.
    fn axes(self) -> Option<[&'static str; 2]> {
        match self {
            View::Xy => Some(["X, mm", "Y, mm"]),
            View::Yz => Some(["Y, mm", "Z, mm"]),
            View::Zx => Some(["X, mm", "Z, mm"]),
            View::Isometric => None,
        }
    }
}

/// A part of the document with a scale of its own.
struct Panel {
    view: View,
    /// Left, right.
    x: [f64; 2],
    /// Top, bottom.
    y: [f64; 2],
    /// What lies in its middle, in mm to the right and up.
    middle_mm: [f64; 2],
    dots_a_mm: f64,
}

impl Panel {
    fn place(&self, at: Place) -> [f64; 2] {
        let [right, up] = self.view.project(at);
        [self.right(right), self.up(up)]
    }

    fn right(&self, mm: f64) -> f64 {
        f64::midpoint(self.x[0], self.x[1]) + (mm - self.middle_mm[0]) * self.dots_a_mm
    }

    fn up(&self, mm: f64) -> f64 {
        f64::midpoint(self.y[0], self.y[1]) - (mm - self.middle_mm[1]) * self.dots_a_mm
    }

    /// What is shown between its edges, to the right and up.
    fn shown_mm(&self) -> [[f64; 2]; 2] {
        let half = |edges: [f64; 2]| 0.5 * (edges[1] - edges[0]) / self.dots_a_mm;
        [0, 1].map(|i| {
            let half_mm = half([self.x, self.y][i]);
            [self.middle_mm[i] - half_mm, self.middle_mm[i] + half_mm]
        })
    }
}

/// Corners of a box.
fn corners([x, y, z]: [[f64; 2]; 3]) -> [Place; 8] {
    std::array::from_fn(|i| [x[i & 1], y[i >> 1 & 1], z[i >> 2]])
}

/// Pairs of corners that an edge of a box joins.
const EDGES: [[usize; 2]; 12] = [
    [0, 1],
    [0, 2],
    [0, 4],
    [1, 3],
    [1, 5],
    [2, 3],
    [2, 6],
    [3, 7],
    [4, 5],
    [4, 6],
    [5, 7],
    [6, 7],
];

impl Display for Sheet<'_> {
    fn fmt(&self, out: &mut Formatter<'_>) -> fmt::Result {
        let [width, height] = SIZE;
        style::head(out, SIZE, &self.title, TITLE, TITLE_LETTERS_MAX)?;
        let bands = self.bands();
        for panel in self.panels() {
            self.frame(out, &panel)?;
            let ([left, right], [top, bottom]) = (panel.x, panel.y);
            let (wide, high) = (right - left, bottom - top);
            writeln!(
                out,
                "<svg x=\"{left}\" y=\"{top}\" width=\"{wide}\" height=\"{high}\" viewBox=\"{left} {top} {wide} {high}\">",
            )?;
            self.travel(out, &panel)?;
            self.pieces(out, &panel, bands)?;
            self.marks(out, &panel)?;
            writeln!(out, "</svg>")?;
        }
        self.legend(out, bands, [TITLE[0], height - 24.0], width)?;
        writeln!(out, "</svg>")
    }
}

impl Sheet<'_> {
    /// The box that holds the way, and something where there is none.
    fn extents_mm(&self) -> [[f64; 2]; 3] {
        let mut extents_mm = self.strokes.extents_mm().unwrap_or([[0.0; 2]; 3]);
        if let Some(wrong) = &self.wrong {
            for (extent, at) in extents_mm.iter_mut().zip(wrong.at_mm) {
                *extent = [extent[0].min(at), extent[1].max(at)];
            }
        }
        extents_mm
    }

    /// The box that a view shows whole: of the isometric one the travel, so that it is seen where in the
    /// machine the part lies.
    fn shown_mm(&self, view: View) -> [[f64; 2]; 3] {
        let mut shown = self.extents_mm();
        if let (View::Isometric, [Some(x), Some(y), Some(z)]) = (view, self.travel_mm) {
            for (extent, travel) in shown.iter_mut().zip([x, y, z]) {
                *extent = [extent[0].min(travel[0]), extent[1].max(travel[1])];
            }
        }
        shown
    }

    fn panels(&self) -> Vec<Panel> {
        let is_single = self.views.len() == 1;
        let [top, bottom] = PANELS_Y;
        let (wide, high) = match is_single {
            true => (SIZE[0] - ROOM[0] - 14.0, bottom - top - ROOM[1]),
            false => (0.5 * SIZE[0] - ROOM[0] - 14.0, 0.5 * (bottom - top) - ROOM[1]),
        };
        let flat = |view: &View| {
            let all = corners(self.shown_mm(*view)).map(|corner| view.project(corner));
            let span = |i: usize| {
                let low = all.iter().map(|at| at[i]).fold(f64::INFINITY, f64::min);
                let high = all.iter().map(|at| at[i]).fold(f64::NEG_INFINITY, f64::max);
                [low, high]
            };
            [span(0), span(1)]
        };
        let fit = |[right, up]: [[f64; 2]; 2]| {
            let of = |[low, high]: [f64; 2], dots: f64| {
                dots / (high - low).max(SHOWN_MM_MIN) / (1.0 + 2.0 * MARGIN)
            };
            of(right, wide).min(of(up, high))
        };
        let is_flat = |view: &&View| **view != View::Isometric;
        let common = self.views.iter().filter(is_flat).map(flat).map(fit).fold(f64::MAX, f64::min);
        let panel = |(at, view): (usize, &View)| {
            let spans = flat(view);
            let left = ROOM[0] + (at % 2) as f64 * 0.5 * SIZE[0];
            let above = top + (at / 2) as f64 * (high + ROOM[1]);
            Panel {
                view: *view,
                x: [left, left + wide],
                y: [above, above + high],
                middle_mm: spans.map(|[low, high]| f64::midpoint(low, high)),
                dots_a_mm: if *view == View::Isometric { fit(spans) } else { common },
            }
        };
        self.views.iter().enumerate().map(panel).collect()
    }

    /// The bands of the cuts that have a colour of their own: those below have that of the least.
    fn bands(&self) -> Option<[i16; 2]> {
        let bands = || self.strokes.pieces().iter().filter_map(|piece| piece.band);
        let high = bands().max()?;
        Some([bands().min()?.max(high - BANDS_SHOWN), high])
    }

    /// A panel's edge, its name, and marks along its axes.
    fn frame(&self, out: &mut Formatter<'_>, panel: &Panel) -> fmt::Result {
        let ([left, right], [top, bottom]) = (panel.x, panel.y);
        let (wide, high) = (right - left, bottom - top);
        if let Some([across, up]) = panel.view.axes() {
            let [shown_right, shown_up] = panel.shown_mm();
            let within = |[low, high]: [f64; 2]| {
                let marks = ticks::linear([low, high], MARKS_MOST).into_iter();
                marks.filter(move |mark| *mark >= low && *mark <= high)
            };
            let mut lines = String::new();
            let mut numbers = String::new();
            for mark in within(shown_right) {
                let (at, label, below) = (panel.right(mark), ticks::label(mark), bottom + 15.0);
                write!(lines, "M{at:.1} {top}V{bottom}")?;
                writeln!(
                    numbers,
                    "<text class=\"middle\" x=\"{at:.1}\" y=\"{below}\">{label}</text>"
                )?;
            }
            for mark in within(shown_up) {
                let (at, label) = (panel.up(mark), ticks::label(mark));
                write!(lines, "M{left} {at:.1}H{right}")?;
                let (before, at) = (left - 6.0, at + 4.0);
                writeln!(
                    numbers,
                    "<text class=\"end\" x=\"{before}\" y=\"{at:.1}\">{label}</text>"
                )?;
            }
            writeln!(out, "<path class=\"grid\" d=\"{lines}\"/>")?;
            write!(out, "{numbers}")?;
            let (middle, below) = (f64::midpoint(left, right), bottom + 30.0);
            writeln!(out, "<text class=\"middle\" x=\"{middle}\" y=\"{below}\">{across}</text>")?;
            let (before, middle) = (left - 44.0, f64::midpoint(top, bottom));
            writeln!(
                out,
                "<text class=\"middle\" transform=\"translate({before} {middle}) rotate(-90)\">{up}</text>",
            )?;
        }
        let (name, [x, y]) = (panel.view.name(), [left + 8.0, top + 17.0]);
        writeln!(
            out,
            "<rect class=\"frame\" x=\"{left}\" y=\"{top}\" width=\"{wide}\" height=\"{high}\"/>\
             <text x=\"{x}\" y=\"{y}\">{name}</text>",
        )
    }

    /// The box of the travel, as far as it lies in the panel.
    fn travel(&self, out: &mut Formatter<'_>, panel: &Panel) -> fmt::Result {
        let [Some(x), Some(y), Some(z)] = self.travel_mm else { return Ok(()) };
        let corners = corners([x, y, z]).map(|corner| panel.place(corner));
        let mut lines = String::new();
        for [from, to] in EDGES {
            let ([x0, y0], [x1, y1]) = (corners[from], corners[to]);
            if (x0 - x1).abs() + (y0 - y1).abs() > 0.05 {
                write!(lines, "M{x0:.1} {y0:.1}L{x1:.1} {y1:.1}")?;
            }
        }
        writeln!(out, "<path class=\"travel\" d=\"{lines}\"><title>travel</title></path>")
    }

    /// The way, in elements of pieces that share lines and colour.
    fn pieces(
        &self,
        out: &mut Formatter<'_>,
        panel: &Panel,
        bands: Option<[i16; 2]>,
    ) -> fmt::Result {
        let pieces = self.strokes.pieces();
        let same = |a: &Piece, b: &Piece| {
            a.lines == b.lines && colour_of(a.band, bands) == colour_of(b.band, bands)
        };
        if pieces.chunk_by(same).nth(TOLD_MAX).is_none() {
            return pieces
                .chunk_by(same)
                .try_for_each(|part| self.element(out, panel, bands, part));
        }
        for part in pieces.chunks(pieces.len().div_ceil(PARTS)) {
            let mut part = part.to_vec();
            part.sort_by_key(|piece| colour_of(piece.band, bands));
            let same = |a: &Piece, b: &Piece| colour_of(a.band, bands) == colour_of(b.band, bands);
            part.chunk_by(same).try_for_each(|part| self.element(out, panel, bands, part))?;
        }
        Ok(())
    }

    fn element(
        &self,
        out: &mut Formatter<'_>,
        panel: &Panel,
        bands: Option<[i16; 2]>,
        pieces: &[Piece],
    ) -> fmt::Result {
        let mut lines = String::new();
        let mut last = None;
        for piece in pieces {
            if last != Some(piece.from_mm) {
                let [x, y] = panel.place(piece.from_mm);
                write!(lines, "M{x:.1} {y:.1}")?;
            }
            let [x, y] = panel.place(piece.to_mm);
            write!(lines, "L{x:.1} {y:.1}")?;
            last = Some(piece.to_mm);
        }
        let first = pieces.iter().map(|piece| piece.lines[0]).min().unwrap_or(0);
        let end = pieces.iter().map(|piece| piece.lines[1]).max().unwrap_or(0);
        let told = match self.texts.get(&first) {
            Some(text) if first == end => {
                let text: String = text.trim().chars().take(LETTERS_TOLD_MAX).collect();
                format!("line {first}: {text}")
            }
            _ if first == end => format!("line {first}"),
            _ => format!("lines {first} to {end}"),
        };
        let told = Escaped(&told);
        match colour_of(pieces[0].band, bands) {
            None => write!(out, "<path class=\"way rapid\"")?,
            Some(colour) => write!(out, "<path class=\"way v{colour}\"")?,
        }
        writeln!(out, " d=\"{lines}\"><title>{told}</title></path>")
    }

    /// Seams, and what is wrong.
    fn marks(&self, out: &mut Formatter<'_>, panel: &Panel) -> fmt::Result {
        for seam in self.seams.iter().take(SEAMS_MAX) {
            let ([x, y], told) = (panel.place(seam.at_mm), Escaped(&seam.text));
            writeln!(
                out,
                "<path class=\"seam\" d=\"M{x:.1} {:.1}l4 4l-4 4l-4 -4z\"><title>{told}</title></path>",
                y - 4.0,
            )?;
        }
        if let Some(wrong) = &self.wrong {
            let ([x, y], told) = (panel.place(wrong.at_mm), Escaped(&wrong.text));
            writeln!(
                out,
                "<circle class=\"wrong\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"9\"><title>{told}</title></circle>",
            )?;
        }
        Ok(())
    }

    /// What lines, colours and marks mean.
    fn legend(
        &self,
        out: &mut Formatter<'_>,
        bands: Option<[i16; 2]>,
        [left, y]: [f64; 2],
        width: f64,
    ) -> fmt::Result {
        let mut x = left;
        let mut entry = |out: &mut Formatter<'_>, mark: &str, text: &str| -> fmt::Result {
            let text_x = x + 28.0;
            writeln!(
                out,
                "<g transform=\"translate({x} {})\">{mark}</g><text x=\"{text_x}\" y=\"{y}\">{}</text>",
                y - 4.0,
                Escaped(text),
            )?;
            x = text_x + 7.0 * text.chars().count() as f64 + 14.0;
            Ok(())
        };
        if self.strokes.pieces().iter().any(|piece| piece.band.is_none()) {
            entry(out, "<path class=\"way rapid\" d=\"M0 0h22\"/>", "rapid")?;
        }
        if self.travel_mm.iter().all(Option::is_some) {
            entry(out, "<path class=\"travel\" d=\"M0 0h22\"/>", "travel")?;
        }
        if !self.seams.is_empty() {
            let text = match self.seams.len() {
                count if count <= SEAMS_MAX => format!("end of a node buffer ({count})"),
                count => format!("end of a node buffer (the first {SEAMS_MAX} of {count})"),
            };
            entry(out, "<path class=\"seam\" d=\"M11 -4l4 4l-4 4l-4 -4z\"/>", &text)?;
        }
        if let Some(wrong) = &self.wrong {
            entry(out, "<circle class=\"wrong\" cx=\"11\" r=\"6\"/>", &wrong.text)?;
        }
        let Some([low, high]) = bands else { return Ok(()) };
        let what = if self.knows_rapids { "cut" } else { "speed" };
        let text = match (speed_text(f64::from(low)), speed_text(f64::from(high))) {
            (low, high) if low == high => format!("{what}: about {high} mm/min"),
            (low, high) => format!("{what}: about {low} to {high} mm/min"),
        };
        let wide = 14.0 * SPEEDS.len() as f64;
        let text_x = width - 20.0;
        let boxes_x = text_x - 7.0 * text.chars().count() as f64 - wide - 10.0;
        for at in 0..SPEEDS.len() {
            let (x, y) = (boxes_x + 14.0 * at as f64, TITLE[1] - 11.0);
            writeln!(
                out,
                "<rect class=\"b{at}\" x=\"{x:.1}\" y=\"{y}\" width=\"14\" height=\"12\"/>"
            )?;
        }
        writeln!(out, "<text class=\"end\" x=\"{text_x}\" y=\"{}\">{text}</text>", TITLE[1])
    }
}

/// The speed of a band with two digits.
fn speed_text(band: f64) -> String {
    let speed_mm_min = 60.0 * speed_of_mm_s(band);
    let digit = libm::pow(10.0, libm::log10(speed_mm_min).floor() - 1.0);
    let rounded = (speed_mm_min / digit).round() * digit;
    if rounded >= 10.0 { format!("{rounded:.0}") } else { format!("{rounded:.1}") }
}

/// The colour of a cut's band among those of all cuts; none: a rapid.
fn colour_of(band: Option<i16>, bands: Option<[i16; 2]>) -> Option<usize> {
    let (band, [low, high]) = (band?, bands?);
    let last = SPEEDS.len() - 1;
    if low == high {
        return Some(last);
    }
    let share = f64::from(band.max(low) - low) / f64::from(high - low);
    Some((share * last as f64).round() as usize)
}
