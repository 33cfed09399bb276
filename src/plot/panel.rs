//! A view of a tool's way and where it lies in a drawing: places in mm → dots.

use std::fmt::{self, Formatter, Write as _};

use crate::plot::strokes::Place;
use crate::plot::ticks;

/// Room of a view, with its name, the numbers along its axes and their names.
pub const CELL: [f64; 2] = [450.0, 400.0];
/// Room around a panel in its cell: left, above, right, below.
const ROOM: [f64; 4] = [56.0, 22.0, 14.0, 40.0];
/// Marks along an axis are so far apart at least.
const MARKS_APART: f64 = 48.0;
/// Empty room within a panel, as a share of what is shown.
const MARGIN: f64 = 0.06;
/// What is shown is so wide at least.
const SHOWN_MM_MIN: f64 = 1.0;
/// Names of X, Y and Z along an edge.
const NAMES: [&str; 3] = ["X, mm", "Y, mm", "Z, mm"];

/// Least and greatest X, Y and Z, in mm.
pub type Extents = [[f64; 2]; 3];

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
    /// As a turned part is drawn: Z to the right, X up, as a radius.
    Turning,
}

impl View {
    /// All that show a milling machine.
    pub const MILLING: [View; 4] = [View::Xy, View::Isometric, View::Zx, View::Yz];

    /// Which of X, Y and Z run to the right and up, where these are two of them.
    fn axes(self) -> Option<[usize; 2]> {
        match self {
            View::Xy => Some([0, 1]),
            View::Yz => Some([1, 2]),
            View::Zx => Some([0, 2]),
            View::Turning => Some([2, 0]),
            View::Isometric => None,
        }
    }

    /// To the right and up, in mm.
    fn project(self, place: Place) -> [f64; 2] {
        // cos 30°, and sin 30° = 1/2.
        const COS: f64 = 0.866_025_403_784_438_6;
        let [x, y, z] = place;
        match self.axes() {
            Some(axes) => axes.map(|axis| place[axis]),
            None => [(x - y) * COS, (x + y) * 0.5 + z],
        }
    }

    /// What it is called.
    pub fn name(self) -> &'static str {
        match self {
            View::Xy => "XY, from above",
            View::Yz => "YZ, from the side",
            View::Zx => "ZX, from the front",
            View::Isometric => "isometric",
            View::Turning => "ZX, X as a radius",
        }
    }

    /// Least and greatest that is seen of a box, to the right and up.
    fn spans(self, extents: Extents) -> [[f64; 2]; 2] {
        let all = corners(extents).map(|corner| self.project(corner));
        [0, 1].map(|i| {
            let low = all.iter().map(|at| at[i]).fold(f64::INFINITY, f64::min);
            let high = all.iter().map(|at| at[i]).fold(f64::NEG_INFINITY, f64::max);
            [low, high]
        })
    }
}

/// A part of the drawing with a scale of its own.
pub struct Panel {
    /// From where.
    pub view: View,
    /// Left, right.
    pub x: [f64; 2],
    /// Top, bottom.
    pub y: [f64; 2],
    /// What lies in its middle, in mm to the right and up.
    middle_mm: [f64; 2],
    dots_a_mm: f64,
}

impl Panel {
    /// Panels that show these boxes, in cells with such corners at the left above and of such a size. All but
    /// the isometric one have one scale.
    pub fn laid(views: &[(View, Extents, [f64; 2])], cell: [f64; 2]) -> Vec<Panel> {
        let [left, above, right, below] = ROOM;
        let (wide, high) = (cell[0] - left - right, cell[1] - above - below);
        let fit = |[right, up]: [[f64; 2]; 2]| {
            let of = |[low, high]: [f64; 2], dots: f64| {
                dots / (high - low).max(SHOWN_MM_MIN) / (1.0 + 2.0 * MARGIN)
            };
            of(right, wide).min(of(up, high))
        };
        let flat = views.iter().filter(|(view, ..)| view.axes().is_some());
        let common =
            flat.map(|(view, extents, _)| fit(view.spans(*extents))).fold(f64::MAX, f64::min);
        let panel = |(view, extents, at): &(View, Extents, [f64; 2])| {
            let spans = view.spans(*extents);
            Panel {
                view: *view,
                x: [at[0] + left, at[0] + left + wide],
                y: [at[1] + above, at[1] + above + high],
                middle_mm: spans.map(|[low, high]| f64::midpoint(low, high)),
                dots_a_mm: if view.axes().is_some() { common } else { fit(spans) },
            }
        };
        views.iter().map(panel).collect()
    }

    /// Where a place lies.
    pub fn place(&self, at: Place) -> [f64; 2] {
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

    /// Its edge, its name, and marks along its axes.
    pub fn frame(&self, out: &mut Formatter<'_>) -> fmt::Result {
        let ([left, right], [top, bottom]) = (self.x, self.y);
        let (wide, high) = (right - left, bottom - top);
        if let Some([across, up]) = self.view.axes() {
            self.marks(out)?;
            let [across, up] = [NAMES[across], NAMES[up]];
            let (middle, below) = (f64::midpoint(left, right), bottom + 30.0);
            writeln!(out, "<text class=\"middle\" x=\"{middle}\" y=\"{below}\">{across}</text>")?;
            let (before, middle) = (left - 44.0, f64::midpoint(top, bottom));
            writeln!(
                out,
                "<text class=\"middle\" transform=\"translate({before} {middle}) rotate(-90)\">{up}</text>",
            )?;
        }
        let (name, above) = (self.view.name(), top - 7.0);
        writeln!(
            out,
            "<rect class=\"frame\" x=\"{left}\" y=\"{top}\" width=\"{wide}\" height=\"{high}\"/>\
             <text class=\"panel\" x=\"{left}\" y=\"{above}\">{name}</text>",
        )
    }

    /// Lines at round values, and their numbers.
    fn marks(&self, out: &mut Formatter<'_>) -> fmt::Result {
        let ([left, right], [top, bottom]) = (self.x, self.y);
        let [shown_right, shown_up] = self.shown_mm();
        // Both axes have one scale, and marks at the same distance: that of the longer.
        let dots = (right - left).max(bottom - top);
        let within = |[low, high]: [f64; 2]| {
            let as_long = [low, low + dots / self.dots_a_mm];
            let marks = ticks::linear(as_long, (dots / MARKS_APART) as usize).into_iter();
            marks.filter(move |mark| *mark >= low && *mark <= high)
        };
        let (mut lines, mut numbers) = (String::new(), String::new());
        for mark in within(shown_right) {
            let (at, label, below) = (self.right(mark), ticks::label(mark), bottom + 15.0);
            write!(lines, "M{at:.1} {top}V{bottom}")?;
            writeln!(numbers, "<text class=\"middle\" x=\"{at:.1}\" y=\"{below}\">{label}</text>")?;
        }
        for mark in within(shown_up) {
            let (at, label) = (self.up(mark), ticks::label(mark));
            write!(lines, "M{left} {at:.1}H{right}")?;
            let (before, at) = (left - 6.0, at + 4.0);
            writeln!(numbers, "<text class=\"end\" x=\"{before}\" y=\"{at:.1}\">{label}</text>")?;
        }
        write!(out, "<path class=\"grid\" d=\"{lines}\"/>\n{numbers}")
    }

    /// The lines of the travel's box that are seen, each between two places in dots; of a flat view those of
    /// the axes that have limits.
    pub fn travel(&self, travel_mm: [Option<[f64; 2]>; 3]) -> Vec<[[f64; 2]; 2]> {
        let Some([across, up]) = self.view.axes() else {
            let [Some(x), Some(y), Some(z)] = travel_mm else { return Vec::new() };
            let corners = corners([x, y, z]).map(|corner| self.place(corner));
            return EDGES.map(|ends| ends.map(|at| corners[at])).to_vec();
        };
        let shown = self.shown_mm();
        let [wide, high] = [(across, 0), (up, 1)].map(|(axis, i)| {
            let [low, high] = travel_mm[axis].unwrap_or(shown[i]);
            [low.max(shown[i][0]), high.min(shown[i][1])]
        });
        let dots = |ends: [[f64; 2]; 2]| ends.map(|[x, y]| [self.right(x), self.up(y)]);
        let within = |at: &f64, [low, high]: [f64; 2]| low <= *at && *at <= high;
        let across = travel_mm[across].into_iter().flatten().filter(|x| within(x, shown[0]));
        let across = across.map(|x| dots(high.map(|y| [x, y])));
        let up = travel_mm[up].into_iter().flatten().filter(|y| within(y, shown[1]));
        across.chain(up.map(|y| dots(wide.map(|x| [x, y])))).collect()
    }
}

/// Corners of a box.
fn corners([x, y, z]: Extents) -> [Place; 8] {
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
