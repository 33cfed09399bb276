//! A value over time → its least and greatest in each of at most so many equal spans, however long the
//! time: no peak is lost.

/// Spans kept at most. Twice as many as a drawing has columns.
const SPANS_MAX: usize = 2048;

/// A value this share of a span before its end belongs to the next: times are whole multiples of a tick,
/// and their quotients may come out a little below a whole number.
const NEARLY: f64 = 1e-6;

/// See the module.
#[derive(Clone, Debug)]
pub struct Envelope {
    /// Seconds of a span.
    span_s: f64,
    spans: Vec<Option<[f64; 2]>>,
}

impl Envelope {
    /// For values so far apart, in seconds.
    pub fn new(step_s: f64) -> Envelope {
        Envelope { span_s: step_s, spans: Vec::new() }
    }

    /// Takes a value at a time that is not before those given so far.
    pub fn add(&mut self, time_s: f64, value: f64) {
        while time_s / self.span_s + NEARLY >= SPANS_MAX as f64 {
            let halves = self.spans.chunks(2);
            self.spans = halves.map(|pair| pair.iter().copied().flatten().reduce(both)).collect();
            self.span_s *= 2.0;
        }
        let span = (time_s / self.span_s + NEARLY) as usize;
        if self.spans.len() <= span {
            self.spans.resize(span + 1, None);
        }
        self.spans[span] = Some(self.spans[span].map_or([value; 2], |at| both(at, [value; 2])));
    }

    /// Points of a curve: in each span its least and its greatest value; and a break where it has none.
    pub fn points(&self) -> Vec<[f64; 2]> {
        let mut points = Vec::new();
        for (at, span) in self.spans.iter().enumerate() {
            let time_s = (at as f64 + 0.5) * self.span_s;
            match span {
                Some([low, high]) if low == high => points.push([time_s, *low]),
                Some([low, high]) => points.extend([[time_s, *low], [time_s, *high]]),
                None => points.push([time_s, f64::NAN]),
            }
        }
        points
    }
}

fn both(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_peak_is_lost_and_memory_is_bounded() {
        let mut envelope = Envelope::new(0.01);
        for k in 0..300_000_u32 {
            envelope.add(f64::from(k) * 0.01, if k == 123_456 { 7.0 } else { 0.0 });
        }
        let points = envelope.points();
        assert!(points.len() <= 2 * SPANS_MAX, "{}", points.len());
        let peak = points.iter().find(|point| point[1] == 7.0).unwrap();
        assert!((peak[0] - 1234.56).abs() < 3.0, "{peak:?}");
        assert!(points.iter().all(|point| point[1].is_finite()));
    }

    #[test]
    fn whole_multiples_of_a_span_fall_into_one_each() {
        let mut envelope = Envelope::new(0.011);
        (0..2000).for_each(|k| envelope.add(f64::from(k) * 0.011, 1.0));
        assert!(envelope.points().iter().all(|point| point[1] == 1.0));
    }

    #[test]
    fn a_pause_is_a_break() {
        let mut envelope = Envelope::new(1.0);
        envelope.add(0.5, 1.0);
        envelope.add(2.5, 3.0);
        let points = envelope.points();
        assert_eq!(points[0], [0.5, 1.0]);
        assert!(points[1][1].is_nan());
        assert_eq!(points[2], [2.5, 3.0]);
    }
}
