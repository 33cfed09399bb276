//! Method B: equations end where their segments do; what rounding makes of them; the least word.

use cnc::base::{Axis, Machine, Source};
use cnc::interp::{Options, motions};
use cnc::path::{PathItem, segments};
use cnc::systems::difference::drift::{Needs, Run, Runs, least_word};
use cnc::systems::difference::node::{Node, Range, Rounding};
use cnc::systems::difference::{Equations, equations, steps_per_mm};

fn starmill() -> Machine {
    Machine::load("starmill").unwrap()
}

fn program(text: &str, machine: &Machine) -> Vec<Equations> {
    let source = Source::memory("test", text.as_bytes().to_vec());
    let options = Options::default();
    segments(motions(&source, machine, &options), machine)
        .filter_map(|item| match item.unwrap() {
            PathItem::Segment(segment) => Some(equations(&segment, machine)),
            PathItem::Event(_) => None,
        })
        .flatten()
        .collect()
}

/// All words that are worth comparing, run.
fn run(text: &str) -> (Vec<Run>, Needs) {
    let machine = starmill();
    let scale = steps_per_mm(&machine);
    let pieces = program(text, &machine);
    let mut needs = Needs::default();
    pieces.iter().for_each(|piece| needs.include(piece, &scale));
    let words = needs.words(Rounding::Nearest);
    let mut runs = Runs::new(&machine, &machine.work_zero_mm, &words);
    pieces.iter().for_each(|piece| runs.segment(piece, |_, _| {}));
    (runs.runs().to_vec(), needs)
}

#[test]
fn equations_without_rounding_end_where_the_segment_does() {
    let mut machine = starmill();
    machine.axes[1].steps_per_mm = 250.0;
    let text = "G91 G17 G64\nG1 X10 Y-3 F300\nG2 X20 I10 Z2\nG3 X-5 Y5 R5\nG0 Z-2\n\
                G5 X10 Y10 I3 J0 P0 Q-3\nM30";
    let scale = steps_per_mm(&machine);
    let pieces = program(text, &machine);
    assert!(pieces.len() > 5, "a spline is told as chords");
    for piece in pieces {
        let mut at = piece.at_steps(0, &scale);
        for _ in 0..piece.ticks {
            if let Some(turn) = piece.turn {
                let ([x, y], [a, b, c, d]) = (turn.plane.axes(), turn.constants);
                let [u, v] = [at[x] - turn.center_steps[0], at[y] - turn.center_steps[1]];
                at[x] = turn.center_steps[0] + a * u - b * v;
                at[y] = turn.center_steps[1] + c * u + d * v;
            }
            Axis::ALL.into_iter().for_each(|axis| at[axis] += piece.way_steps[axis]);
        }
        let end = piece.at_steps(piece.ticks, &scale);
        for axis in Axis::LINEAR {
            assert!((at[axis] - end[axis]).abs() < 1e-6, "{axis} {at:?} {end:?}");
        }
        let feed_mm_s = piece.segment.feed_mm_s.unwrap_or(20.0);
        assert!(piece.speed_mm_s(&machine) <= feed_mm_s * (1.0 + 1e-9));
    }
}

#[test]
fn a_line_drifts_by_what_rounding_takes_off_its_way_each_tick() {
    let machine = starmill();
    let scale = steps_per_mm(&machine);
    let piece = &program("G91 G1 X10 Y5 F300\nM30", &machine)[0];
    // 11.18 mm at 5 mm/s are 203.3 ticks of 11 ms, so 204; 1000/204 steps a tick.
    assert_eq!(piece.ticks, 204);
    let mut range = Range::default();
    range.include(piece, &scale);
    for rounding in [Rounding::Nearest, Rounding::Down] {
        let word = range.word(20, rounding).unwrap();
        assert_eq!(word.fraction_bits, 5);
        let mut node = Node::new(word, &piece.at_steps(0, &scale));
        node.take(piece);
        (0..204).for_each(|_| node.tick());
        let drift = node.position_steps()[Axis::X] - 8500.0;
        let told = word.position(1000.0 / 204.0) as f64 / 32.0;
        assert!((drift - 204.0 * (told - 1000.0 / 204.0)).abs() < 1e-9, "{drift}");
    }
}

#[test]
fn longer_words_drift_less_and_the_least_is_found() {
    let text = "G91 G3 I-20 F300\nG1 X-20 Y-20\nX20 Y20\nG2 X-20 Y20 R20\nM30";
    let (runs, needs) = run(text);
    let least = least_word(&runs).unwrap();
    assert!(least.fraction_bits > 2 && least.bits < runs.last().unwrap().word().bits);
    let drifts: Vec<f64> = runs.iter().map(|run| run.greatest.steps).collect();
    assert!(drifts[0] > 10.0, "{drifts:?}");
    assert!(drifts.iter().zip(&drifts[4..]).all(|(short, long)| long < short), "{drifts:?}");
    assert!(needs.ticks > 2000);
}

#[test]
fn whole_steps_a_tick_need_no_bit_behind_the_point() {
    // 10 mm/s for 11 ms are 11 steps.
    let (runs, _) = run("G91 G1 X1.1 F600\nM30");
    assert_eq!(least_word(&runs).unwrap().fraction_bits, 0);
}
