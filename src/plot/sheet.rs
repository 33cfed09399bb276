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

use crate::plot::legend::{self, Entry};
use crate::plot::panel::{CELL, Extents, Panel, View};
use crate::plot::strokes::{Mark, Piece, Strokes, speed_of_mm_s};
use crate::plot::style::{self, SPEEDS};
use crate::plot::text::Escaped;

/// Height of the title.
const TITLE: f64 = 44.0;
/// Room at the left of the title, and at the right of all.
const MARGINS: [f64; 2] = [56.0, 14.0];
/// Room above the legend, and below it.
const LEGEND_ROOM: [f64; 2] = [4.0, 6.0];
/// What the title has room for.
const TITLE_LETTERS_MAX: usize = 86;
/// Elements that tell their lines, in each view at most.
const TOLD_MAX: usize = 700;
/// Parts that a longer way is told in.
const PARTS: usize = 90;
/// Letters of a line that are told at most.
const LETTERS_TOLD_MAX: usize = 60;
/// Seams that are marked at most.
const SEAMS_MAX: usize = 300;
/// Half the width of a seam's mark; of the isometric view, where the way is small.
const SEAM: [f64; 2] = [3.5, 2.0];
/// Width of a colour in the legend.
const SWATCH: f64 = 13.0;
/// Bands of speed between the first colour and the last at most: a speed and a 16th of it.
const BANDS_SHOWN: i16 = 12;

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

impl Display for Sheet<'_> {
    fn fmt(&self, out: &mut Formatter<'_>) -> fmt::Result {
        let cells = if self.views.len() == 1 { [1.0, 1.0] } else { [2.0, 2.0] };
        let of_all = [0, 1].map(|i| 2.0 * CELL[i]);
        let cell = [0, 1].map(|i| of_all[i] / cells[i]);
        let places = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
        let at = places.map(|[x, y]| [x * cell[0], TITLE + y * cell[1]]);
        let panels = self.panels(&at, cell);
        let legend = self.legend(&panels);
        let [left, right] = MARGINS;
        let wide = of_all[0] - left - right;
        let [above, below] = LEGEND_ROOM;
        let top = TITLE + of_all[1] + above;
        let size = [of_all[0], top + legend::height(&legend, wide) + below];
        style::open(out, size, &self.title)?;
        style::title(out, &self.title, [left, 28.0], TITLE_LETTERS_MAX)?;
        for panel in panels {
            self.panel(out, &panel)?;
        }
        legend::write(out, &legend, [left, top], wide)?;
        writeln!(out, "</svg>")
    }
}

impl Sheet<'_> {
    /// The same without its title, as documents for a page that has room for one beside the other or below it:
    /// what lines and colours mean, then a view each.
    pub fn parts(&self) -> Vec<String> {
        let panels = self.panels(&[[0.0; 2]; 4], CELL);
        let legend = self.legend(&panels);
        let of_legend = [CELL[0], legend::height(&legend, CELL[0])];
        let legend = Part(of_legend, "what lines and colours mean", |out: &mut Formatter<'_>| {
            legend::write(out, &legend, [0.0; 2], CELL[0])
        });
        let view = |panel: &Panel| {
            let content = |out: &mut Formatter<'_>| self.panel(out, panel);
            Part(CELL, panel.view.name(), content).to_string()
        };
        [legend.to_string()].into_iter().chain(panels.iter().map(view)).collect()
    }

    /// The box that holds the way; where nothing moves, that of the travel.
    fn extents_mm(&self) -> Extents {
        let travel_mm = self.travel_mm.map(Option::unwrap_or_default);
        let mut extents_mm = self.strokes.extents_mm().unwrap_or(travel_mm);
        if let Some(wrong) = &self.wrong {
            for (extent, at) in extents_mm.iter_mut().zip(wrong.at_mm) {
                *extent = [extent[0].min(at), extent[1].max(at)];
            }
        }
        extents_mm
    }

    /// The box that a view shows whole: of the isometric one the travel, so that it is seen where in the
    /// machine the part lies.
    fn shown_mm(&self, view: View) -> Extents {
        let mut shown = self.extents_mm();
        if let (View::Isometric, [Some(x), Some(y), Some(z)]) = (view, self.travel_mm) {
            for (extent, travel) in shown.iter_mut().zip([x, y, z]) {
                *extent = [extent[0].min(travel[0]), extent[1].max(travel[1])];
            }
        }
        shown
    }

    fn panels(&self, corners: &[[f64; 2]], cell: [f64; 2]) -> Vec<Panel> {
        let views = self.views.iter().zip(corners);
        let views: Vec<_> =
            views.map(|(view, corner)| (*view, self.shown_mm(*view), *corner)).collect();
        Panel::laid(&views, cell)
    }

    /// A view: its frame, and in it all that is seen.
    fn panel(&self, out: &mut Formatter<'_>, panel: &Panel) -> fmt::Result {
        panel.frame(out)?;
        let ([left, right], [top, bottom]) = (panel.x, panel.y);
        let (wide, high) = (right - left, bottom - top);
        writeln!(
            out,
            "<svg x=\"{left}\" y=\"{top}\" width=\"{wide}\" height=\"{high}\" viewBox=\"{left} {top} {wide} {high}\">",
        )?;
        self.travel(out, panel)?;
        self.pieces(out, panel, self.bands())?;
        self.marks(out, panel)?;
        if self.strokes.extents_mm().is_none() {
            let middle = [panel.x, panel.y].map(|[low, high]| f64::midpoint(low, high));
            let [x, y] = middle;
            writeln!(out, "<text class=\"middle\" x=\"{x}\" y=\"{y}\">nothing moves</text>")?;
        }
        writeln!(out, "</svg>")
    }

    /// The bands of the cuts that have a colour of their own: those below have that of the least.
    fn bands(&self) -> Option<[i16; 2]> {
        let bands = || self.strokes.pieces().iter().filter_map(|piece| piece.band);
        let high = bands().max()?;
        Some([bands().min()?.max(high - BANDS_SHOWN), high])
    }

    /// The box of the travel, as far as it is seen.
    fn travel(&self, out: &mut Formatter<'_>, panel: &Panel) -> fmt::Result {
        let mut lines = String::new();
        for [[x0, y0], [x1, y1]] in panel.travel(self.travel_mm) {
            write!(lines, "M{x0:.1} {y0:.1}L{x1:.1} {y1:.1}")?;
        }
        if lines.is_empty() {
            return Ok(());
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
        let half = SEAM[usize::from(panel.view == View::Isometric)];
        for seam in self.seams.iter().take(SEAMS_MAX) {
            let ([x, y], told) = (panel.place(seam.at_mm), Escaped(&seam.text));
            let mark = diamond([x, y], half);
            writeln!(out, "<path class=\"seam\" d=\"{mark}\"><title>{told}</title></path>")?;
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
    fn legend(&self, panels: &[Panel]) -> Vec<Entry> {
        let mut entries = Vec::new();
        if self.strokes.pieces().iter().any(|piece| piece.band.is_none()) {
            entries.push(Entry::new("<path class=\"way rapid\" d=\"M0 0h22\"/>", "rapid"));
        }
        entries.extend(self.speeds());
        if panels.iter().any(|panel| !panel.travel(self.travel_mm).is_empty()) {
            entries.push(Entry::new("<path class=\"travel\" d=\"M0 0h22\"/>", "travel"));
        }
        if !self.seams.is_empty() {
            let text = match self.seams.len() {
                count if count <= SEAMS_MAX => format!("end of a node buffer ({count})"),
                count => format!("end of a node buffer (the first {SEAMS_MAX} of {count})"),
            };
            let mark = diamond([SEAM[0], 0.0], SEAM[0]);
            let mark = format!("<path class=\"seam\" d=\"{mark}\"/>");
            entries.push(Entry { mark, wide: 2.0 * SEAM[0], text });
        }
        if let Some(wrong) = &self.wrong {
            let mark = "<circle class=\"wrong\" cx=\"8\" r=\"6\"/>".to_owned();
            entries.push(Entry { mark, wide: 16.0, text: wrong.text.clone() });
        }
        entries
    }

    /// The colours of speeds: one where there is one.
    fn speeds(&self) -> Option<Entry> {
        let what = if self.knows_rapids { "cut" } else { "moved" };
        let [low, high] = self.bands()?;
        let [low_text, high_text] = [low, high].map(|band| speed_text(f64::from(band)));
        let (colours, text) = match low_text == high_text {
            true => (SPEEDS.len() - 1..SPEEDS.len(), format!("{what} at about {high_text} mm/min")),
            false => (0..SPEEDS.len(), format!("{what} at {low_text} to {high_text} mm/min")),
        };
        let wide = SWATCH * colours.len() as f64;
        let swatch = |(at, colour): (usize, usize)| {
            let x = SWATCH * at as f64;
            format!(
                "<rect class=\"b{colour}\" x=\"{x}\" y=\"-6\" width=\"{SWATCH}\" height=\"12\"/>"
            )
        };
        Some(Entry { mark: colours.enumerate().map(swatch).collect(), wide, text })
    }
}

/// A document of its own: its size, its title, and what is in it.
struct Part<F>([f64; 2], &'static str, F);

impl<F: Fn(&mut Formatter<'_>) -> fmt::Result> Display for Part<F> {
    fn fmt(&self, out: &mut Formatter<'_>) -> fmt::Result {
        let Part(size, title, content) = self;
        style::open(out, *size, title)?;
        content(out)?;
        writeln!(out, "</svg>")
    }
}

/// The path of a diamond about a place.
fn diamond([x, y]: [f64; 2], half: f64) -> String {
    format!("M{x:.1} {:.1}l{half} {half}l-{half} {half}l-{half} -{half}z", y - half)
}

/// The speed of a band with two digits.
fn speed_text(band: f64) -> String {
    let speed_mm_min = 60.0 * speed_of_mm_s(band);
    let digit = 10_f64.powf(speed_mm_min.log10().floor() - 1.0);
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
