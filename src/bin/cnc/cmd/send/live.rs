//! What a job's operator sees while it runs, as text.

use std::io::{self, BufRead, BufReader, Read};

use cnc::base::Source;
use cnc::wire::{AxisReading, Reading, SpindleReading};

use crate::progress::Shown;

/// Lines between those whose place is kept.
const APART: usize = 256;
/// Most bytes of a line that are read.
const LINE_BYTES_MAX: u64 = 4096;
/// Most characters of a line that are shown.
const SHOWN_CHARS: usize = 48;

/// The lines of a program.
pub struct Listing {
    source: Source,
    /// Offset of the first line, and of each 256th after it.
    places: Vec<u64>,
}

impl Listing {
    /// Finds the lines of a program.
    pub fn new(source: Source) -> io::Result<Listing> {
        let mut reader = BufReader::with_capacity(1 << 16, source.reader(0));
        let (mut places, mut lines, mut offset) = (vec![0], 0, 0);
        loop {
            let piece = reader.fill_buf()?;
            if piece.is_empty() {
                break;
            }
            for (at, _) in piece.iter().enumerate().filter(|(_, byte)| **byte == b'\n') {
                lines += 1;
                if lines % APART == 0 {
                    places.push(offset + at as u64 + 1);
                }
            }
            let length = piece.len();
            offset += length as u64;
            reader.consume(length);
        }
        Ok(Listing { source, places })
    }

    /// A line, from 1, as far as it is shown; nothing if it cannot be read.
    pub fn line(&self, number: u32) -> String {
        let at = number.saturating_sub(1) as usize;
        let Some(place) = self.places.get(at / APART) else { return String::new() };
        let mut reader = BufReader::new(self.source.reader(*place));
        for _ in 0..at % APART {
            if reader.skip_until(b'\n').is_err() {
                return String::new();
            }
        }
        let mut bytes = Vec::new();
        // What cannot be read is not shown; the job does not hang on it.
        let _ = reader.take(LINE_BYTES_MAX).read_until(b'\n', &mut bytes);
        let text = String::from_utf8_lossy(&bytes);
        let text = text.trim().replace(char::is_control, " ");
        match text.char_indices().nth(SHOWN_CHARS) {
            Some((end, _)) => format!("{}…", &text[..end]),
            None => text,
        }
    }
}

/// What is shown.
pub fn shown(reading: &Reading, listing: Option<&Listing>) -> Shown {
    let Reading { axes, feed_mm_min, spindle, line, buffer, ticks, left_s } = reading;
    let text = listing.filter(|_| *line > 0).map(|listing| listing.line(*line));
    let text = text.map_or(String::new(), |text| format!(": {text}"));
    let place = |of: fn(&AxisReading) -> f64| {
        axes.iter()
            .map(|axis| format!("{} {:.3}", axis.axis, of(axis)))
            .collect::<Vec<_>>()
            .join(" ")
    };
    let is_rotary = !axes.is_empty() && axes.iter().all(|axis| axis.axis.is_rotary());
    let unit = if is_rotary { "°" } else { "mm" };
    let work = place(|axis| axis.work_mm);
    let machine = place(|axis| axis.machine_mm);
    let spindle = told(spindle);
    Shown {
        done: *ticks,
        first: format!(
            "{} left  buffer {buffer}  line {line}{text}",
            super::result::clock(*left_s)
        ),
        second: format!("{work}  {feed_mm_min:.0} {unit}/min  {spindle}  machine {machine}"),
    }
}

fn told(spindle: &SpindleReading) -> String {
    let speed = spindle.rpm.map_or(String::new(), |rpm| format!(" S{rpm}"));
    match spindle.clockwise {
        Some(true) => format!("M3{speed}"),
        Some(false) => format!("M4{speed}"),
        None => "M5".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use cnc::base::Axis;

    use super::*;

    #[test]
    fn any_line_of_a_program_is_found() {
        let text: String = (1..=1000).map(|line| format!("G1 X{line}\r\n")).collect();
        let listing = Listing::new(Source::memory("test", text.into_bytes())).unwrap();
        for line in [1, 2, 255, 256, 257, 512, 513, 1000] {
            assert_eq!(listing.line(line), format!("G1 X{line}"));
        }
        assert_eq!((listing.line(0), listing.line(1001)), ("G1 X1".to_owned(), String::new()));
        let long = "N".repeat(100);
        let listing = Listing::new(Source::memory("test", long.into_bytes())).unwrap();
        assert_eq!(listing.line(1).chars().count(), SHOWN_CHARS + 1);
    }

    #[test]
    fn what_is_shown_is_what_was_measured() {
        let axis = |axis, machine_mm, work_mm| AxisReading { axis, machine_mm, work_mm };
        let reading = Reading {
            axes: vec![axis(Axis::X, 85.0, 10.0), axis(Axis::Y, 50.0, 0.0)],
            feed_mm_min: 299.7,
            spindle: SpindleReading { clockwise: Some(true), rpm: Some(1500.0) },
            line: 2,
            buffer: 3,
            ticks: 17,
            left_s: 61.2,
        };
        let listing = Listing::new(Source::memory("test", b"M3 S1500\nG1 X10 F300".to_vec()));
        let shown = shown(&reading, Some(&listing.unwrap()));
        assert_eq!(shown.first, "0:01:02 h left  buffer 3  line 2: G1 X10 F300");
        let second = "X 10.000 Y 0.000  300 mm/min  M3 S1500  machine X 85.000 Y 50.000";
        assert_eq!((shown.done, shown.second.as_str()), (17, second));
    }
}
