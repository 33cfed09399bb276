//! Samples of a PLC's signals → a drawing of them, a panel a function (seed 001, figs 10 and 12).

use std::io::{BufRead, BufReader};

use anyhow::{Context, anyhow};
use cnc::base::Source;
use cnc::plot::{Level, Panel, Span, Timing, Track};
use cnc::systems::plc::{Function, Sample, record};

/// Functions that are drawn; a job may have thousands.
const PANELS_MAX: usize = 24;
/// What is drawn before and behind a function.
const MARGIN_MS: f64 = 10.0;
/// Levels of one signal.
type Levels = Vec<(f64, Level)>;

/// The drawing of a record.
pub fn of_record(source: &Source) -> anyhow::Result<Timing> {
    let name = source.name();
    let mut lines = BufReader::new(source.reader(0)).lines();
    let head = lines.next().transpose().with_context(|| name.to_owned())?;
    if head.as_deref().map(str::trim_end) != Some(record::HEADER) {
        return Err(anyhow!(
            "{name}: no record of signals; `cnc send --plc PORT --signals FILE` writes one"
        ));
    }
    let mut samples: Vec<Sample> = Vec::new();
    for (number, row) in (2..).zip(lines) {
        let row = row.with_context(|| format!("{name}:{number}"))?;
        let sample: Sample = row.parse().with_context(|| format!("{name}:{number}"))?;
        if samples.last().is_some_and(|last| last.at_us > sample.at_us) {
            return Err(anyhow!("{name}:{number}: its time is before that of the row above"));
        }
        samples.push(sample);
    }
    Ok(drawing(&samples, source.file_name()))
}

/// The drawing of a job's handshakes, the first of them if there are many.
pub fn drawing(samples: &[Sample], job: &str) -> Timing {
    let mut panels = Vec::new();
    let mut rest = samples;
    while let Some(begin) = rest.iter().position(|sample| sample.nc.function.is_some()) {
        let function = rest[begin].nc.function;
        let of = |sample: &Sample| sample.nc.function == function;
        let end =
            rest[begin..].iter().position(|sample| !of(sample)).map_or(rest.len(), |n| begin + n);
        if let Some(function) = function.filter(|_| panels.len() < PANELS_MAX) {
            let before = begin.checked_sub(1).map(|at| rest[at]).unwrap_or_default();
            panels.push(panel(function, before, &rest[begin..end], rest.get(end)));
        }
        rest = &rest[end..];
    }
    Timing { title: format!("M, S and T functions of {job}"), panels }
}

fn ms(sample: &Sample) -> f64 {
    sample.at_us as f64 * 1e-3
}

fn panel(function: Function, before: Sample, during: &[Sample], after: Option<&Sample>) -> Panel {
    let begin = ms(&during[0]);
    let last = after.or(during.last()).map_or(begin, ms);
    let (from, to) = (-MARGIN_MS, last - begin + MARGIN_MS);
    let all: Vec<(f64, &Sample)> =
        during.iter().chain(after).map(|sample| (ms(sample) - begin, sample)).collect();
    let track = |name: &str, of: &dyn Fn(&Sample) -> Level| {
        let mut levels: Levels = vec![(from, of(&before))];
        for (at, sample) in &all {
            let level = of(sample);
            if levels.last().is_none_or(|(_, last)| *last != level) {
                levels.push((*at, level));
            }
        }
        Track { name: name.to_owned(), levels }
    };
    let level = |on: bool| if on { Level::On } else { Level::Off };
    let code = |sample: &Sample| Level::Value(sample.nc.function.map(|code| code.to_string()));
    // What the function before left is not shown.
    let first =
        |of: fn(&Sample) -> bool| all.iter().find(|(_, sample)| of(sample)).map(|(at, _)| *at);
    let strobe = first(|sample| sample.nc.strobe);
    let fin = all.iter().rev().take_while(|(_, sample)| sample.fin || !sample.nc.strobe);
    let fin = fin.filter(|(_, sample)| sample.fin && sample.nc.strobe).last().map(|(at, _)| *at);
    let off = strobe
        .and_then(|on| all.iter().find(|(at, s)| *at > on && !s.nc.strobe))
        .map(|(at, _)| *at);
    let span = |name: &str, track, from: Option<f64>, to: Option<f64>| {
        Some(Span { name: name.to_owned(), track, range_ms: [from?, to?] })
    };
    let spans = [span("TMF", 2, Some(0.0), strobe), span("TFIN", 4, fin, off)];
    Panel {
        title: format!("line {}: {function}", during[0].line),
        range_ms: [from, to],
        tracks: vec![
            track("code", &code),
            track("motion", &|sample| level(sample.moves)),
            track(function.kind.strobe(), &|sample| level(sample.nc.strobe)),
            track("DEN", &|sample| level(sample.nc.den)),
            track("FIN", &|sample| level(sample.fin)),
        ],
        spans: spans.into_iter().flatten().collect(),
    }
}
