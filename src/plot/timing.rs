//! Levels of signals over time → an SVG document, one panel a stretch of time.
//!
//! Every panel is as wide as the others, whatever time it shows; the times of changes stand below it.
//! Where nothing changes for longer than 0.3 s the time between is cut short, with two strokes across
//! the axis.

use std::fmt::{self, Display, Formatter, Write as _};

use crate::plot::style;
use crate::plot::text::Escaped;

/// Width of the drawing.
const WIDTH: f64 = 800.0;
/// Left and right edge of the levels.
const EDGES: [f64; 2] = [96.0, 776.0];
/// What stands above the first panel.
const HEAD: f64 = 44.0;
/// Heights of a panel's title, of a signal with the room above it, and of the times below.
const TITLE: f64 = 26.0;
const TRACK: f64 = 34.0;
const TIMES: f64 = 34.0;
/// Height of a level.
const LEVEL: f64 = 18.0;
/// Longest time without a change that is drawn to scale.
const STILL_MS: f64 = 300.0;
/// Times are told when they are so far apart.
const LABEL: f64 = 36.0;

/// A drawing; its [`Display`] is the SVG document.
#[derive(Clone, Debug, PartialEq)]
pub struct Timing {
    /// What is shown, in a line.
    pub title: String,
    /// One below the other.
    pub panels: Vec<Panel>,
}

/// Signals over one stretch of time.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// What happens in it.
    pub title: String,
    /// First and last time.
    pub range_ms: [f64; 2],
    /// From above to below.
    pub tracks: Vec<Track>,
    /// Times that have a name.
    pub spans: Vec<Span>,
}

/// A signal.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// Its name.
    pub name: String,
    /// From when on it has which level; the first is from the panel's first time on.
    pub levels: Vec<(f64, Level)>,
}

/// What a signal says.
#[derive(Clone, Debug, PartialEq)]
pub enum Level {
    /// Low.
    Off,
    /// High.
    On,
    /// Several wires: a number, or nothing.
    Value(Option<String>),
}

/// A time between two changes.
#[derive(Clone, Debug, PartialEq)]
pub struct Span {
    /// What it is called.
    pub name: String,
    /// Below which signal it stands.
    pub track: usize,
    /// From when to when.
    pub range_ms: [f64; 2],
}

impl Panel {
    fn height(&self) -> f64 {
        TITLE + TRACK * self.tracks.len() as f64 + TIMES
    }

    /// Times of changes, in order, each once.
    fn times(&self) -> Vec<f64> {
        let changes = self.tracks.iter().flat_map(|track| track.levels.iter().map(|(at, _)| *at));
        let [first, last] = self.range_ms;
        let inside = changes.filter(|at| (first..last).contains(at));
        let mut times: Vec<f64> = inside.chain([first, last]).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        times
    }
}

/// Where the times of a panel lie.
struct Laid {
    /// A time, and where it lies.
    places: Vec<(f64, f64)>,
    /// Where time is cut short.
    cuts: Vec<f64>,
}

impl Laid {
    fn of(panel: &Panel) -> Laid {
        let times = panel.times();
        let gaps = times.windows(2).map(|pair| pair[1] - pair[0]);
        let drawn: Vec<f64> = gaps.clone().map(|gap| gap.min(STILL_MS)).collect();
        let scale = (EDGES[1] - EDGES[0]) / drawn.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let mut at = EDGES[0];
        let mut laid = Laid { places: Vec::new(), cuts: Vec::new() };
        laid.places.extend(times.first().map(|time| (*time, at)));
        for ((time, gap), drawn) in times.iter().skip(1).zip(gaps).zip(&drawn) {
            if gap > *drawn {
                laid.cuts.push(at + drawn * scale / 2.0);
            }
            at += drawn * scale;
            laid.places.push((*time, at));
        }
        laid
    }

    /// Where a change lies.
    fn place(&self, time: f64) -> f64 {
        let after = self.places.partition_point(|(of, _)| *of < time);
        self.places.get(after).map_or(EDGES[1], |(_, at)| *at)
    }
}

impl Display for Timing {
    fn fmt(&self, out: &mut Formatter<'_>) -> fmt::Result {
        // Where there is nothing to show, a line says so.
        let all = self.panels.iter().map(Panel::height).sum::<f64>().max(TRACK);
        let height = HEAD + all;
        style::open(out, [WIDTH, height], &self.title)?;
        style::title(out, &self.title, [24.0, 26.0], 80)?;
        if self.panels.is_empty() {
            writeln!(out, "<text x=\"24\" y=\"{}\">nothing was recorded</text>", HEAD + 14.0)?;
        }
        let mut top = HEAD;
        for panel in &self.panels {
            draw(out, panel, top)?;
            top += panel.height();
        }
        writeln!(out, "</svg>")
    }
}

fn draw(out: &mut Formatter<'_>, panel: &Panel, top: f64) -> fmt::Result {
    let laid = Laid::of(panel);
    let below = top + panel.height() - TIMES + 6.0;
    let first = top + TITLE;
    writeln!(
        out,
        "<text class=\"panel\" x=\"24\" y=\"{}\">{}</text>",
        top + 14.0,
        Escaped(&panel.title)
    )?;
    let mut lines = String::new();
    for (_, at) in &laid.places {
        write!(lines, "M{at:.1} {first}V{below}")?;
    }
    writeln!(out, "<path class=\"grid\" d=\"{lines}\"/>")?;
    let foot = |number: usize| first + TRACK * (number + 1) as f64 - 8.0;
    for (number, track) in panel.tracks.iter().enumerate() {
        let low = foot(number);
        let name = Escaped(&track.name);
        writeln!(
            out,
            "<text class=\"end\" x=\"{}\" y=\"{}\">{name}</text>",
            EDGES[0] - 10.0,
            low - 4.0
        )?;
        level(out, &laid, track, low)?;
    }
    for span in &panel.spans {
        let [from, to] = span.range_ms.map(|at| laid.place(at));
        let (low, middle) = (foot(span.track) + 5.0, f64::midpoint(from, to));
        let (name, [start, end]) = (Escaped(&span.name), [low - 3.0, low + 3.0]);
        writeln!(
            out,
            "<path class=\"span\" d=\"M{from:.1} {start}V{end}M{to:.1} {start}V{end}M{from:.1} {low}H{to:.1}\"/>"
        )?;
        let above = low - 9.0;
        writeln!(out, "<text class=\"middle\" x=\"{middle:.1}\" y=\"{above}\">{name}</text>")?;
    }
    times(out, &laid, below)
}

/// One signal.
fn level(out: &mut Formatter<'_>, laid: &Laid, track: &Track, low: f64) -> fmt::Result {
    let (high, middle) = (low - LEVEL, low - LEVEL / 2.0);
    let mut lines = String::new();
    let mut texts = String::new();
    let ends = track.levels.iter().skip(1).map(|(at, _)| laid.place(*at)).chain([EDGES[1]]);
    let mut before = None;
    for ((at, level), to) in track.levels.iter().zip(ends) {
        let from = laid.place(*at);
        let height = match level {
            Level::Off => low,
            Level::On => high,
            Level::Value(None) => middle,
            Level::Value(Some(value)) => {
                // Two lines that part and meet again.
                write!(
                    lines,
                    "M{from:.1} {middle}l3 {}H{:.1}L{to:.1} {middle}M{from:.1} {middle}l3 {}H{:.1}L{to:.1} {middle}",
                    -LEVEL / 2.0,
                    to - 3.0,
                    LEVEL / 2.0,
                    to - 3.0
                )?;
                let (place, base) = (f64::midpoint(from, to), middle + 4.0);
                writeln!(
                    texts,
                    "<text class=\"middle\" x=\"{place:.1}\" y=\"{base}\">{}</text>",
                    Escaped(value)
                )?;
                before = None;
                continue;
            }
        };
        match before.replace(height) {
            Some(_) => write!(lines, "V{height}H{to:.1}")?,
            None => write!(lines, "M{from:.1} {height}H{to:.1}")?,
        }
    }
    write!(out, "<path class=\"level\" d=\"{lines}\"/>\n{texts}")
}

/// The axis of time, and the times of changes where there is room.
fn times(out: &mut Formatter<'_>, laid: &Laid, below: f64) -> fmt::Result {
    let ([left, right], text) = (EDGES, below + 15.0);
    let mut lines = format!("M{left} {below}H{right}");
    for at in &laid.cuts {
        let ([up, down], next) = ([below - 5.0, below + 5.0], at + 5.0);
        write!(
            lines,
            "M{:.1} {down}L{:.1} {up}M{:.1} {down}L{next:.1} {up}",
            at - 3.0,
            at,
            at + 2.0
        )?;
    }
    writeln!(out, "<path class=\"frame\" d=\"{lines}\"/>")?;
    writeln!(out, "<text class=\"end\" x=\"{}\" y=\"{text}\">ms</text>", left - 10.0)?;
    let mut free_from = f64::NEG_INFINITY;
    // The ends are margins.
    let inner = laid.places.len().saturating_sub(2);
    for (time, at) in laid.places.iter().skip(1).take(inner) {
        if *at >= free_from {
            writeln!(out, "<text class=\"middle\" x=\"{at:.1}\" y=\"{text}\">{time:.0}</text>")?;
            free_from = at + LABEL;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel(levels: &[(f64, Level)], range_ms: [f64; 2]) -> Panel {
        let track = Track { name: "MF".to_owned(), levels: levels.to_vec() };
        Panel { title: "M8".to_owned(), range_ms, tracks: vec![track], spans: Vec::new() }
    }

    #[test]
    fn long_stillness_is_cut_short() {
        let levels = [(0.0, Level::Off), (100.0, Level::On), (5100.0, Level::Off)];
        let laid = Laid::of(&panel(&levels, [0.0, 5200.0]));
        // 100, 300 of 5000, and 100 ms over 680 units.
        assert_eq!(
            laid.places.iter().map(|(_, at)| at.round()).collect::<Vec<_>>(),
            [96.0, 232.0, 640.0, 776.0]
        );
        assert_eq!(laid.cuts.len(), 1);
    }

    #[test]
    fn the_same_signals_give_the_same_bytes_and_text_is_text() {
        let levels = [(0.0, Level::Value(None)), (30.0, Level::Value(Some("<8>".to_owned())))];
        let drawing =
            Timing { title: "M & S".to_owned(), panels: vec![panel(&levels, [0.0, 60.0])] };
        let text = drawing.to_string();
        assert_eq!(text, drawing.clone().to_string());
        assert!(
            text.contains("&lt;8&gt;") && text.contains("M &amp; S") && text.ends_with("</svg>\n")
        );
        // Nothing at all is a drawing too.
        let empty = Timing { panels: vec![panel(&[], [0.0, 0.0])], ..drawing.clone() };
        assert!(!empty.to_string().contains("NaN"));
        let blank = Timing { panels: Vec::new(), ..drawing };
        assert!(blank.to_string().contains("nothing was recorded"));
    }
}
