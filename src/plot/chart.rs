//! Curves over axes: points → an SVG document.
//!
//! The drawing is of one of two sizes whatever is in it. A curve is interrupted at a point that has no
//! place (not finite, or not above 0 on a logarithmic axis) and clipped at the edge of the axes;
//! of a curve with more points than the drawing has columns, the extremes of each column are kept,
//! so that no peak is lost. Nothing is smoothed.

use std::fmt::{self, Display, Formatter, Write as _};

use crate::plot::legend::{self, Entry};
use crate::plot::style::{self, CURVES};
use crate::plot::text::Escaped;
use crate::plot::ticks;

/// Room at the left of the field of the curves, for numbers and a name, at its right, below it and above.
const ROOM: [f64; 4] = [76.0, 24.0, 60.0, 52.0];
/// A letter of the title is about so wide.
const TITLE_LETTER: f64 = 9.4;
/// Most marks of an axis.
const MARKS_MOST: usize = 12;
/// Marks are so far apart at least, from left to right and from below to above.
const MARKS_APART: [f64; 2] = [58.0, 30.0];
/// Fewer points than this are marked by dots.
const DOTS_BELOW: usize = 40;

/// A drawing of curves over two axes; its [`Display`] is the SVG document.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// What is shown, in a line; of a single curve its name is told here, too.
    pub title: String,
    /// How large the drawing is.
    pub size: Size,
    /// The axis from left to right.
    pub x: Scale,
    /// The axis from below to above.
    pub y: Scale,
    /// What is drawn, in the order of the legend.
    pub curves: Vec<Curve>,
    /// Dashed lines across the field.
    pub limits: Vec<Limit>,
}

/// How large a drawing of curves is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Size {
    /// As wide as a page: 800 by 500.
    #[default]
    Page,
    /// For a column of a page, or a telephone: 450 by 340.
    Column,
}

impl Size {
    fn dots(self) -> [f64; 2] {
        match self {
            Size::Page => [800.0, 500.0],
            Size::Column => [450.0, 340.0],
        }
    }

    /// Left and right edge of the field of the curves.
    fn field_x(self) -> [f64; 2] {
        [ROOM[0], self.dots()[0] - ROOM[1]]
    }

    /// Its lower edge, and its upper one where there is no legend.
    fn field_y(self) -> [f64; 2] {
        [self.dots()[1] - ROOM[2], ROOM[3]]
    }
}

/// An axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Scale {
    /// What it counts, with its unit last: `baud rate, bit/s`.
    pub label: String,
    /// Whether equal factors are equally far apart, not equal differences.
    pub logarithmic: bool,
    /// What it shows, at least; none: all that is drawn.
    pub range: Option<[f64; 2]>,
}

/// Points joined by lines.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// What the legend calls it.
    pub name: String,
    /// Which of the colours of curves it has, counted from 0.
    pub colour: usize,
    /// Its points (x, y), in order.
    pub points: Vec<[f64; 2]>,
}

/// A dashed line at one value of an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Limit {
    /// What stands beside it.
    pub name: String,
    /// Which axis the value belongs to.
    pub along: Along,
    /// Where it lies.
    pub at: f64,
}

/// An axis of the drawing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Along {
    /// From left to right.
    X,
    /// From below to above.
    Y,
}

impl Scale {
    /// An axis of equal differences that shows all that is drawn.
    pub fn linear(label: &str) -> Scale {
        Scale { label: label.to_owned(), logarithmic: false, range: None }
    }

    /// An axis of equal factors that shows all that is drawn above 0.
    pub fn logarithmic(label: &str) -> Scale {
        Scale { label: label.to_owned(), logarithmic: true, range: None }
    }

    /// The same axis, over this range.
    #[must_use]
    pub fn over(self, range: [f64; 2]) -> Scale {
        Scale { range: Some(range), ..self }
    }

    fn has(&self, value: f64) -> bool {
        value.is_finite() && (!self.logarithmic || value > 0.0)
    }

    /// Lays the axis out between two edges of the field. It begins at a mark, and ends at one unless it runs
    /// from left to right by equal differences: then it ends where the values do.
    fn laid(&self, values: impl Iterator<Item = f64>, edges: [f64; 2], along: Along) -> Laid {
        let [low, high] = self.range.unwrap_or_else(|| {
            let all = values.filter(|value| self.has(*value));
            all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
                [low.min(value), high.max(value)]
            })
        });
        let range = match (low < high, low == high) {
            (true, _) => [low, high],
            // A single value, or none: some room around it.
            (_, true) if self.logarithmic => [low / 2.0, high * 2.0],
            (_, true) => [low - low.abs().max(1.0) / 2.0, high + high.abs().max(1.0) / 2.0],
            _ => [if self.logarithmic { 0.1 } else { 0.0 }, 1.0],
        };
        let apart = MARKS_APART[usize::from(along == Along::Y)];
        let most = (((edges[1] - edges[0]).abs() / apart) as usize).min(MARKS_MOST);
        let mut marks = match self.logarithmic {
            true => ticks::logarithmic(range, most),
            false => ticks::linear(range, most),
        };
        let mut ends = [marks[0], marks[marks.len() - 1]];
        if along == Along::X && !self.logarithmic {
            ends[1] = range[1];
            marks.retain(|mark| *mark <= range[1]);
        }
        Laid { logarithmic: self.logarithmic, ends, marks, edges }
    }
}

/// An axis with its marks, between two edges of the field.
struct Laid {
    logarithmic: bool,
    /// The values at its edges.
    ends: [f64; 2],
    marks: Vec<f64>,
    edges: [f64; 2],
}

impl Laid {
    /// Where a value lies in the drawing.
    fn place(&self, value: f64) -> f64 {
        let scaled = |value: f64| if self.logarithmic { value.log10() } else { value };
        let [first, last] = self.ends;
        let share = (scaled(value) - scaled(first)) / (scaled(last) - scaled(first));
        self.edges[0] + share * (self.edges[1] - self.edges[0])
    }
}

impl Display for Chart {
    fn fmt(&self, out: &mut Formatter<'_>) -> fmt::Result {
        let ([left, right], [bottom, above]) = (self.size.field_x(), self.size.field_y());
        let (legend, width) = (self.legend(), right - left);
        let top = above + legend::height(&legend, width);
        let limits = |along| {
            self.limits.iter().filter(move |limit| limit.along == along).map(|limit| limit.at)
        };
        let points = || self.curves.iter().flat_map(|curve| &curve.points);
        let x = points().map(|point| point[0]).chain(limits(Along::X));
        let x = self.x.laid(x, [left, right], Along::X);
        let y = points().map(|point| point[1]).chain(limits(Along::Y));
        let y = self.y.laid(y, [bottom, top], Along::Y);
        let title = self.title();
        style::open(out, self.size.dots(), &title)?;
        style::title(out, &title, [left, 26.0], (width / TITLE_LETTER) as usize)?;
        self.grid(out, &x, &y)?;
        legend::write(out, &legend, [left, above - 16.0], width)?;
        // An inner drawing clips at its edge without a name that another drawing could have too.
        let height = bottom - top;
        writeln!(
            out,
            "<svg x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\" viewBox=\"{left} {top} {width} {height}\">",
        )?;
        for curve in &self.curves {
            self.curve(out, curve, (&x, &y))?;
        }
        writeln!(out, "</svg>")?;
        self.dashes(out, (&x, &y))?;
        writeln!(out, "</svg>")
    }
}

impl Chart {
    /// What is shown; of a single curve with its name, for there is no legend.
    fn title(&self) -> String {
        match self.curves.as_slice() {
            [only] if !only.name.is_empty() => format!("{}, {}", self.title, only.name),
            _ => self.title.clone(),
        }
    }

    /// What each curve is, where there are several.
    fn legend(&self) -> Vec<Entry> {
        if self.curves.len() < 2 {
            return Vec::new();
        }
        let mark = |curve: &Curve| {
            format!("<path class=\"curve c{}\" d=\"M0 0h22\"/>", curve.colour % CURVES.len())
        };
        self.curves.iter().map(|curve| Entry::new(mark(curve), curve.name.as_str())).collect()
    }

    /// The field, its marks and the names of the axes.
    fn grid(&self, out: &mut Formatter<'_>, x: &Laid, y: &Laid) -> fmt::Result {
        let ([left, right], [bottom, top]) = (x.edges, y.edges);
        let mut lines = String::new();
        for mark in &x.marks {
            write!(lines, "M{:.1} {top}V{bottom}", x.place(*mark))?;
        }
        for mark in &y.marks {
            write!(lines, "M{left} {:.1}H{right}", y.place(*mark))?;
        }
        writeln!(out, "<path class=\"grid\" d=\"{lines}\"/>")?;
        writeln!(out, "<path class=\"frame\" d=\"M{left} {top}V{bottom}H{right}\"/>")?;
        for mark in &x.marks {
            let label = ticks::label(*mark);
            // Digits are about 7 wide: the last number must not reach beyond the drawing.
            let at = x.place(*mark).min(self.size.dots()[0] - 4.0 - 3.5 * label.len() as f64);
            let below = bottom + 18.0;
            writeln!(out, "<text class=\"middle\" x=\"{at:.1}\" y=\"{below}\">{label}</text>")?;
        }
        for mark in &y.marks {
            let (at, label) = (y.place(*mark) + 4.0, ticks::label(*mark));
            let before = left - 8.0;
            writeln!(out, "<text class=\"end\" x=\"{before}\" y=\"{at:.1}\">{label}</text>")?;
        }
        let (middle, below) = (f64::midpoint(left, right), bottom + 42.0);
        let name = Escaped(&self.x.label);
        writeln!(out, "<text class=\"middle\" x=\"{middle}\" y=\"{below}\">{name}</text>")?;
        let (middle, name) = (f64::midpoint(bottom, top), Escaped(&self.y.label));
        writeln!(
            out,
            "<text class=\"middle\" transform=\"translate(18 {middle}) rotate(-90)\">{name}</text>",
        )
    }

    fn curve(&self, out: &mut Formatter<'_>, curve: &Curve, (x, y): (&Laid, &Laid)) -> fmt::Result {
        let has_place = |point: &[f64; 2]| self.x.has(point[0]) && self.y.has(point[1]);
        let colour = curve.colour % CURVES.len();
        let [left, right] = self.size.field_x();
        let mut lines = String::new();
        for run in curve.points.split(|point| !has_place(point)) {
            let places: Vec<[f64; 2]> =
                run.iter().map(|point| [x.place(point[0]), y.place(point[1])]).collect();
            for (at, [x, y]) in thinned(&places, right - left).into_iter().enumerate() {
                let joint = if at == 0 { 'M' } else { 'L' };
                write!(lines, "{joint}{x:.1} {y:.1}")?;
            }
        }
        writeln!(out, "<path class=\"curve c{colour}\" d=\"{lines}\"/>")?;
        if curve.points.len() < DOTS_BELOW {
            for point in curve.points.iter().filter(|point| has_place(point)) {
                let (x, y) = (x.place(point[0]), y.place(point[1]));
                writeln!(out, "<circle class=\"d{colour}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\"/>")?;
            }
        }
        Ok(())
    }

    /// How many points of curves lie in a part of the drawing.
    fn points_within(&self, (x, y): (&Laid, &Laid), across: [f64; 2], up: [f64; 2]) -> usize {
        let points = self.curves.iter().flat_map(|curve| &curve.points);
        let lies_there = |point: &&[f64; 2]| {
            let at = [x.place(point[0]), y.place(point[1])];
            (across[0]..=across[1]).contains(&at[0]) && (up[0]..=up[1]).contains(&at[1])
        };
        points.filter(lies_there).count()
    }

    /// The limits that lie within the field, and their names, where fewest points lie under them.
    fn dashes(&self, out: &mut Formatter<'_>, (x, y): (&Laid, &Laid)) -> fmt::Result {
        for limit in &self.limits {
            let (scale, laid) = match limit.along {
                Along::X => (&self.x, x),
                Along::Y => (&self.y, y),
            };
            let [first, last] = laid.ends;
            if !scale.has(limit.at) || !(first..=last).contains(&limit.at) {
                continue;
            }
            let (at, name) = (laid.place(limit.at), Escaped(&limit.name));
            let ([left, right], [bottom, top]) = (x.edges, y.edges);
            let wide = 7.0 * limit.name.chars().count() as f64;
            // Where the name ends: in each case the first place is the usual one.
            let (line, places) = match limit.along {
                Along::X => (
                    format!("M{at:.1} {bottom}V{top}"),
                    [top + 14.0, bottom - 6.0]
                        .map(|y| [[at - 5.0, y], [at + 5.0 + wide, y]])
                        .as_flattened()
                        .to_vec(),
                ),
                Along::Y => (
                    format!("M{left} {at:.1}H{right}"),
                    [at - 5.0, at + 14.0]
                        .map(|y| [[right - 6.0, y], [left + 6.0 + wide, y]])
                        .as_flattened()
                        .to_vec(),
                ),
            };
            let crossed = |[end, base]: &[f64; 2]| {
                let (across, up) = ([end - wide, *end], [base - 12.0, base + 3.0]);
                self.points_within((x, y), across, up)
            };
            let within = |[end, base]: &[f64; 2]| {
                end - wide >= left && *end <= right && *base >= top + 12.0 && *base <= bottom
            };
            let free =
                places.iter().filter(|place| within(place)).min_by_key(|place| crossed(place));
            let beside = *free.unwrap_or(&places[0]);
            writeln!(
                out,
                "<path class=\"limit\" d=\"{line}\"/><text class=\"beside\" x=\"{:.1}\" y=\"{:.1}\">{name}</text>",
                beside[0], beside[1],
            )?;
        }
        Ok(())
    }
}

/// The places of a curve that runs from left to right, at most four for each half column: where it
/// enters, its least, its greatest and where it leaves. Others are kept as they are.
fn thinned(places: &[[f64; 2]], width: f64) -> Vec<[f64; 2]> {
    let columns = 2.0 * width;
    let runs_right = places.windows(2).all(|pair| pair[0][0] <= pair[1][0]);
    if !runs_right || (places.len() as f64) < 4.0 * columns {
        return places.to_vec();
    }
    let mut kept = Vec::new();
    for column in places.chunk_by(|a, b| (2.0 * a[0]).floor() == (2.0 * b[0]).floor()) {
        let height = |at: &usize| column[*at][1];
        let of = |best: Option<usize>| best.unwrap_or(0);
        let low = of((0..column.len()).min_by(|a, b| height(a).total_cmp(&height(b))));
        let high = of((0..column.len()).max_by(|a, b| height(a).total_cmp(&height(b))));
        let mut chosen = [0, low.min(high), low.max(high), column.len() - 1].to_vec();
        chosen.dedup();
        kept.extend(chosen.into_iter().map(|at| column[at]));
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(points: Vec<[f64; 2]>) -> Chart {
        Chart {
            title: "Fill < 1 s & \"quick\"".to_owned(),
            size: Size::Page,
            x: Scale::logarithmic("baud rate, bit/s"),
            y: Scale::linear("time, s"),
            curves: vec![Curve { name: "1 node".to_owned(), colour: 0, points }],
            limits: vec![Limit { name: "tick".to_owned(), along: Along::Y, at: 0.5 }],
        }
    }

    fn curve_of(text: &str) -> &str {
        let inner = text.split("viewBox").nth(2).unwrap();
        inner.split(" d=\"").nth(1).unwrap().split('"').next().unwrap()
    }

    #[test]
    fn a_chart_is_a_document_with_its_text_as_text() {
        let text = chart(vec![[9600.0, 1.5], [19_200.0, 0.75], [38_400.0, 0.375]]).to_string();
        for part in [
            "viewBox=\"0 0 800 500\"",
            "<title>Fill &lt; 1 s &amp; \"quick\", 1 node</title>",
            ">10000</text>",
            ">baud rate, bit/s</text>",
            ">tick</text>",
            "prefers-color-scheme: dark",
        ] {
            assert!(text.contains(part), "{part} in {text}");
        }
        assert_eq!(text.matches("<circle").count(), 3);
        assert_eq!(text.matches("<svg").count(), text.matches("</svg>").count());
        assert!(!text.contains(" id="), "names of two drawings on a page would collide");
        assert_eq!(
            text,
            chart(vec![[9600.0, 1.5], [19_200.0, 0.75], [38_400.0, 0.375]]).to_string()
        );
    }

    #[test]
    fn points_without_a_place_interrupt_the_curve() {
        let text = chart(vec![[1.0, 0.0], [0.0, 1.0], [10.0, f64::NAN], [10.0, 0.2], [100.0, 1.0]]);
        let text = text.to_string();
        assert_eq!(curve_of(&text), "M76.0 440.0M426.0 362.4L776.0 52.0");
        for empty in [Vec::new(), vec![[5.0, 5.0]], vec![[f64::NAN, 0.0]]] {
            let text = chart(empty).to_string();
            assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
        }
    }

    #[test]
    fn several_curves_have_a_legend_and_a_colour_each() {
        let mut chart = chart(vec![[1.0, 1.0], [2.0, 2.0]]);
        chart.curves.push(Curve { name: "2 nodes".to_owned(), colour: 4, points: Vec::new() });
        let text = chart.to_string();
        assert!(text.contains(">1 node</text>") && text.contains(">2 nodes</text>"));
        assert!(text.contains("class=\"curve c4\"") && !text.contains("class=\"curve c1\""));
        chart.size = Size::Column;
        chart.x = Scale::linear("time, s");
        chart.curves[1].points = vec![[0.0, 1.0], [33.0, 2.0]];
        let text = chart.to_string();
        assert!(text.contains("viewBox=\"0 0 450 340\""));
        assert!(text.contains(">30</text>") && !text.contains(">40</text>"), "it ends at 33");
    }

    #[test]
    fn a_long_curve_keeps_its_peaks() {
        let mut points: Vec<[f64; 2]> = (1..=100_000).map(|at| [f64::from(at), 0.0]).collect();
        points[54_321][1] = 1.0;
        let places: Vec<[f64; 2]> =
            points.iter().map(|[x, y]| [76.0 + x * 700.0 / 1e5, 440.0 - 300.0 * y]).collect();
        let kept = thinned(&places, 700.0);
        assert!(kept.len() < 6000, "{}", kept.len());
        assert_eq!(kept.first(), places.first());
        assert_eq!(kept.last(), places.last());
        assert!(kept.contains(&places[54_321]));
    }
}
