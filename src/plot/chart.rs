//! Curves over axes: points → an SVG document.
//!
//! The drawing is 800 by 500 whatever is in it. A curve is interrupted at a point that has no
//! place (not finite, or not above 0 on a logarithmic axis) and clipped at the edge of the axes;
//! of a curve with more points than the drawing has columns, the extremes of each column are kept,
//! so that no peak is lost. Nothing is smoothed.

use std::fmt::{self, Display, Formatter, Write as _};

use crate::plot::style::{self, CURVES};
use crate::plot::text::Escaped;
use crate::plot::ticks;

/// The whole drawing.
const SIZE: [f64; 2] = [800.0, 500.0];
/// Left and right edge of the field of the curves.
const FIELD_X: [f64; 2] = [76.0, 776.0];
/// Its lower edge, and its upper one where there is no legend.
const FIELD_Y: [f64; 2] = [440.0, 52.0];
/// Letters of the title that have room.
const TITLE_LETTERS_MAX: usize = 74;
/// A line of the legend.
const LEGEND_LINE: f64 = 20.0;
/// Most marks of an axis.
const MARKS_MOST: usize = 12;
/// Fewer points than this are marked by dots.
const DOTS_BELOW: usize = 40;

/// A drawing of curves over two axes; its [`Display`] is the SVG document.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// What is shown, in a line.
    pub title: String,
    /// The axis from left to right.
    pub x: Scale,
    /// The axis from below to above.
    pub y: Scale,
    /// What is drawn, in the order of the legend.
    pub curves: Vec<Curve>,
    /// Dashed lines across the field.
    pub limits: Vec<Limit>,
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

    /// Lays the axis out between two edges of the field.
    fn laid(&self, values: impl Iterator<Item = f64>, edges: [f64; 2]) -> Laid {
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
        let marks = match self.logarithmic {
            true => ticks::logarithmic(range, MARKS_MOST),
            false => ticks::linear(range, MARKS_MOST),
        };
        Laid { logarithmic: self.logarithmic, marks, edges }
    }
}

/// An axis with its marks, between two edges of the field.
struct Laid {
    logarithmic: bool,
    marks: Vec<f64>,
    edges: [f64; 2],
}

impl Laid {
    /// Where a value lies in the drawing.
    fn place(&self, value: f64) -> f64 {
        let scaled = |value: f64| if self.logarithmic { libm::log10(value) } else { value };
        let (first, last) = (self.marks[0], self.marks[self.marks.len() - 1]);
        let share = (scaled(value) - scaled(first)) / (scaled(last) - scaled(first));
        self.edges[0] + share * (self.edges[1] - self.edges[0])
    }
}

impl Display for Chart {
    fn fmt(&self, out: &mut Formatter<'_>) -> fmt::Result {
        let legend = self.legend();
        let lines = legend.last().map_or(0.0, |[_, line]| line + 1.0);
        let limits = |along| {
            self.limits.iter().filter(move |limit| limit.along == along).map(|limit| limit.at)
        };
        let points = || self.curves.iter().flat_map(|curve| &curve.points);
        let top = FIELD_Y[1] + lines * LEGEND_LINE;
        let x = self.x.laid(points().map(|point| point[0]).chain(limits(Along::X)), FIELD_X);
        let y = points().map(|point| point[1]).chain(limits(Along::Y));
        let y = self.y.laid(y, [FIELD_Y[0], top]);
        style::head(out, SIZE, &self.title, [FIELD_X[0], 26.0], TITLE_LETTERS_MAX)?;
        self.grid(out, &x, &y)?;
        for ((at, curve), [left, line]) in self.curves.iter().enumerate().zip(&legend) {
            let (left, middle) = (FIELD_X[0] + left, FIELD_Y[1] - 6.0 + line * LEGEND_LINE);
            let name = Escaped(&curve.name);
            writeln!(
                out,
                "<path class=\"curve c{}\" d=\"M{left:.1} {middle:.1}h22\"/><text x=\"{:.1}\" y=\"{:.1}\">{name}</text>",
                at % CURVES.len(),
                left + 28.0,
                middle + 4.0,
            )?;
        }
        // An inner drawing clips at its edge without a name that another drawing could have too.
        let (width, height) = (FIELD_X[1] - FIELD_X[0], FIELD_Y[0] - top);
        writeln!(
            out,
            "<svg x=\"{0}\" y=\"{top}\" width=\"{width}\" height=\"{height}\" viewBox=\"{0} {top} {width} {height}\">",
            FIELD_X[0],
        )?;
        for (at, curve) in self.curves.iter().enumerate() {
            self.curve(out, at % CURVES.len(), curve, (&x, &y))?;
        }
        writeln!(out, "</svg>")?;
        self.dashes(out, (&x, &y))?;
        writeln!(out, "</svg>")
    }
}

impl Chart {
    /// Where each curve's name stands: from the left, and in which line. Letters are about 7 wide.
    fn legend(&self) -> Vec<[f64; 2]> {
        if self.curves.iter().all(|curve| curve.name.is_empty()) {
            return Vec::new();
        }
        let (mut left, mut line) = (0.0, 0.0);
        let mut places = Vec::new();
        for curve in &self.curves {
            let width = 52.0 + 7.0 * curve.name.chars().count() as f64;
            if left > 0.0 && left + width > FIELD_X[1] - FIELD_X[0] {
                (left, line) = (0.0, line + 1.0);
            }
            places.push([left, line]);
            left += width;
        }
        places
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
            let at = x.place(*mark).min(SIZE[0] - 4.0 - 3.5 * label.len() as f64);
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

    fn curve(
        &self,
        out: &mut Formatter<'_>,
        colour: usize,
        curve: &Curve,
        (x, y): (&Laid, &Laid),
    ) -> fmt::Result {
        let has_place = |point: &[f64; 2]| self.x.has(point[0]) && self.y.has(point[1]);
        let mut lines = String::new();
        for run in curve.points.split(|point| !has_place(point)) {
            let places: Vec<[f64; 2]> =
                run.iter().map(|point| [x.place(point[0]), y.place(point[1])]).collect();
            for (at, [x, y]) in thinned(&places).into_iter().enumerate() {
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
            let (first, last) = (laid.marks[0], laid.marks[laid.marks.len() - 1]);
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
fn thinned(places: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let columns = 2.0 * (FIELD_X[1] - FIELD_X[0]);
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
            x: Scale::logarithmic("baud rate, bit/s"),
            y: Scale::linear("time, s"),
            curves: vec![Curve { name: "1 node".to_owned(), points }],
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
            "<title>Fill &lt; 1 s &amp; \"quick\"</title>",
            ">1 node</text>",
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
        assert_eq!(curve_of(&text), "M76.0 440.0M426.0 366.4L776.0 72.0");
        for empty in [Vec::new(), vec![[5.0, 5.0]], vec![[f64::NAN, 0.0]]] {
            let text = chart(empty).to_string();
            assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
        }
    }

    #[test]
    fn a_long_curve_keeps_its_peaks() {
        let mut points: Vec<[f64; 2]> = (1..=100_000).map(|at| [f64::from(at), 0.0]).collect();
        points[54_321][1] = 1.0;
        let places: Vec<[f64; 2]> =
            points.iter().map(|[x, y]| [76.0 + x * 700.0 / 1e5, 440.0 - 300.0 * y]).collect();
        let kept = thinned(&places);
        assert!(kept.len() < 6000, "{}", kept.len());
        assert_eq!(kept.first(), places.first());
        assert_eq!(kept.last(), places.last());
        assert!(kept.contains(&places[54_321]));
    }
}
