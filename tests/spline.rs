//! Splines: what must hold for every one, from the words of a program to steps.

use std::convert::Infallible;
use std::sync::Arc;

use cnc::base::spline::SplineError;
use cnc::base::{Axis, Command, Machine, Point, Source, Spline};
use cnc::interp::{self, Motion, Move, MoveKind, Options};
use cnc::path::{self, MeasuredSpline, PathItem, Segment};
use cnc::plan::{self, Feed};
use cnc::step;
use cnc::verify::{Report, Setup, Verdict, verify};
use proptest::prelude::*;

fn xyz([x, y, z]: [f64; 3]) -> Point {
    let mut point = Point::ZERO;
    [point[Axis::X], point[Axis::Y], point[Axis::Z]] = [x, y, z];
    point
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

fn moves(text: &str) -> Vec<Move> {
    let machine = Machine::load("ideal").unwrap();
    let source = Source::memory("test.nc", text.as_bytes());
    let checked = interp::check(&source, &machine, &Options::default(), 9).unwrap();
    assert_eq!(checked.errors, 0, "{text}: {:?}", checked.diagnostics);
    interp::motions(&source, &machine, &Options::default())
        .filter_map(|motion| match motion.unwrap() {
            Motion::Move(step) => Some(step),
            Motion::Event(_) => None,
        })
        .collect()
}

fn last(text: &str) -> Segment {
    path::segment(moves(text).last().unwrap()).unwrap()
}

fn place(segment: &Segment, share: f64) -> [f64; 3] {
    let point = segment.point_at(share);
    Axis::LINEAR.map(|axis| point[axis])
}

/// What is wrong with a program, as `rule line:column`.
fn findings(text: &str) -> Vec<String> {
    let source = Source::memory("test.nc", text.as_bytes());
    let machine = Machine::load("starmill").unwrap();
    let checked = interp::check(&source, &machine, &Options::default(), 9).unwrap();
    let show = |found: &cnc::base::Diagnostic| {
        format!("{} {}:{}", found.rule, found.span.line, found.column())
    };
    checked.diagnostics.iter().map(show).collect()
}

#[test]
fn what_makes_no_spline_is_refused() {
    let points = |count: usize| vec![Point::ZERO; count];
    let new = |degree, count, weights: &[f64], knots: &[f64]| {
        Spline::new(degree, points(count), weights.to_vec(), knots.to_vec()).err()
    };
    let ones = [1.0; 4];
    assert_eq!(new(2, 3, &ones[..3], &[0.0, 0.0, 0.0, 1.0, 1.0, 1.0]), None);
    for (error, found) in [
        (SplineError::Degree, new(0, 1, &ones[..1], &[0.0, 1.0])),
        (SplineError::Degree, new(10, 11, &[1.0; 11], &[0.0; 22])),
        (SplineError::Points, new(3, 3, &ones[..3], &[0.0; 7])),
        (SplineError::Weights, new(1, 2, &[1.0], &[0.0, 0.0, 1.0, 1.0])),
        (SplineError::Weights, new(1, 2, &[1.0, -1.0], &[0.0, 0.0, 1.0, 1.0])),
        (SplineError::Weights, new(1, 2, &[1.0, f64::NAN], &[0.0, 0.0, 1.0, 1.0])),
        (SplineError::KnotCount, new(1, 2, &ones[..2], &[0.0, 0.0, 1.0])),
        (SplineError::KnotOrder, new(1, 3, &ones[..3], &[0.0, 0.0, 2.0, 1.0, 1.0])),
        (SplineError::KnotOrder, new(1, 2, &ones[..2], &[0.0, 0.0, f64::NAN, 1.0])),
        (SplineError::KnotEnds, new(1, 2, &ones[..2], &[0.0, 0.5, 1.0, 1.0])),
        (SplineError::KnotEnds, new(1, 2, &ones[..2], &[0.0, 0.0, 0.5, 1.0])),
        (SplineError::KnotRepeated, new(1, 4, &ones, &[0.0, 0.0, 0.5, 0.5, 1.0, 1.0])),
        (SplineError::KnotRepeated, new(1, 2, &ones[..2], &[0.0; 4])),
    ] {
        assert_eq!(found, Some(error));
    }
}

#[test]
fn a_spline_is_refused_at_the_right_word() {
    for (text, expected) in [
        ("G5 X9 I1 J1 P1 Q1\nM30", &["no-feed 1:1"][..]),
        ("G5 X9 I1 J1 Q1 F9\nM30", &["missing-word 1:1"]),
        ("G5 X9 I1 P1 Q1 F9\nM30", &["missing-word 1:1"]),
        ("G5.1 X9 F9\nM30", &["missing-word 1:1"]),
        ("G5.1 X9 I1 P1 F9\nM30", &["unused-word 1:12"]),
        ("G16 G5.1 X9 I1 F9\nM30", &["spline-mode 1:1"]),
        ("G53 G5.1 X9 I1 F9\nM30", &["machine-coordinates 1:1"]),
        ("G5 X9 I1 J0 P1 Q1 F9\nG1 X10\nG5 X20 P1 Q1\nM30", &["spline-tangent 3:1"]),
        ("F9\nG41.1 D2 G1 X10\nG5.1 X19 I1\nG40 G1 X0\nM30", &["compensation-mode 3:1"]),
        ("G10 L1 P1 R1\nG41 D1 G1 X10 F9\nX12\nG40 G5.1 X19 I1\nM30", &["compensation-mode 4:1"]),
        // One fault of a NURBS makes no others.
        ("G5.2 P1 F9\nX1\nX2 Y2 P1\nG5.3\nG0 X1\nM30", &["missing-word 2:1"]),
        ("G5.2 P1 F9\nX1 Y1\nX2 Y2 P1\nG5.3\nM30", &["missing-word 2:1"]),
        ("G5.2 P1 F9\nX1 Y1 P1\nM8\nX2 Y2 P1\nG5.3\nM30", &["nurbs-open 3:1"]),
        ("G5.2 P1 F9\nX1 Y1 P1\nT1\nX2 Y2 P1\nG5.3\nM30", &["nurbs-open 3:1"]),
        ("G5.2 P1 F9\nX1 Y1 P1\nX2 Y2 Z3 P1\nG5.3\nM30", &["spline-axis 3:7"]),
        ("G5.2 P1 F9\nX1 Y1 P1 !\nX2 Y2 P1\nG5.3\nM30", &["bad-character 2:10"]),
        ("G5.2 P1 F9\nX1 Y1 P1\nP2\nG5.3\nM30", &["missing-word 3:1"]),
        ("G5.2 P1 L2 F9\nX1 Y1 P1\nG5.3\nM30", &["nurbs-order 1:9"]),
        ("G5.2 P1 F9\nX1 Y1 P1\nX2 Y2 P1\nM30", &["nurbs-open 4:1"]),
        ("G5.2 P1 F9\nX1 Y1 P1\nX2 Y2 P1", &["missing-end 3:1", "nurbs-open 3:1"]),
        ("G5.2 P1 F9\nX1 Y1 P1\nX2 Y2 P1\nG5.3\nX1\nM30", &["no-motion-mode 5:1"]),
        ("G6.2 K0 X0 F9\nK0 X1\nG1 X2\nM30", &["nurbs-open 3:1"]),
        ("G6.2 K0 X0 F9\nX1\nM30", &["missing-word 2:1"]),
        ("G6.2 K0 X0 F9\nK0 X1 P4\nM30", &["unused-word 2:7"]),
        ("G6.2 K0 X0 F9\nK0 X1 R-1\nM30", &["nurbs-weight 2:7"]),
        ("G6.2 K0 X0 F9\nK0 X1\nK1\nM30", &["nurbs-points 3:1"]),
        ("G6.2 P3 K0 X0 F9\nK0 X1\nK0 X2\nK1 R2\nK1\nK1\nM30", &["unused-word 4:4"]),
        ("G6.2 P3 K0 X0 F9\nK0 X1\nK0 X2\nK1\nK1 X3\nK1\nM30", &["nurbs-knots 5:1"]),
        ("G6.2 P3 K0 X0 F9\nK0 X1\nK0 X2\nK1\nK1\nK2\nM30", &["nurbs-knots 6:1"]),
        ("G6.2 P3 K0 X0 A9 F9\nK0 X1\nK0 X2\nK1\nK1\nK2\nM30", &["spline-axis 1:15"]),
        ("G6.2 P11 K0 X0 F9\nM30", &["nurbs-order 1:6"]),
        // High-speed machining of FANUC controls is no spline, and leaves the motion code in force.
        ("G1 X1 F100\nG5 P10000\nG5.1 Q1\nX2\nG5.1 Q0\nG5 P0\nX3\nM30", &[]),
        ("G1 X1 F100\nG5.1 Q3\nM30", &["unused-word 2:6"]),
        ("G1 X1 F100\nG5 P1\nM30", &["missing-word 2:1"]),
        // Only the curve itself is held against the travel, not its points.
        ("G0 X-75\nG5.1 X-74 Y1 I-0.3 J0.5 F100\nM30", &["limit-x-min 2:6"]),
        ("G0 X-74.9\nG5.1 X-74.9 Y2 I-0.15 J1 F100\nM30", &[]),
    ] {
        assert_eq!(findings(text), expected, "{text}");
    }
}

/// A corner between two pieces counts where it is, and no more than it turns.
#[test]
fn corners_are_told_by_their_turn() {
    // Two straight pieces, the second turned by an angle.
    for angle in [0.0, 1e-4, 1e-2, 0.5, 3.1_f64] {
        let (sin, cos) = angle.sin_cos();
        let at = |way: f64| xyz([3.0 + way * cos, way * sin, 0.0]);
        let points = vec![xyz([0.0; 3]), xyz([1.0, 0.0, 0.0]), at(0.0), at(1.0), at(2.0)];
        let knots = vec![0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 2.0];
        let spline = Spline::new(2, points, vec![1.0; 5], knots).unwrap();
        let measured = MeasuredSpline::new(&spline).unwrap();
        let joints =
            measured.spans().windows(2).map(|pair| [pair[0].tangents[1], pair[1].tangents[0]]);
        let sharpest = joints.map(|[a, b]| distance(a, b)).fold(0.0, f64::max);
        let expected = 2.0 * (0.5 * angle).sin();
        assert!((sharpest - expected).abs() < 1e-9, "{sharpest} at {angle}");
    }
}

/// Far from zero and with weights as unlike as may be, a curve is measured all the same.
#[test]
fn extreme_splines_are_measured() {
    for scale in [1e-9, 1e-3, 1.0, 1e6] {
        for weights in [[1e-4, 1e4, 1e-4, 1e4], [1e4, 1e-4, 1e-4, 1e4], [1e4, 1e4, 1e-4, 1e-4]] {
            for off in [0.0, 1e6] {
                let at = |x: f64, y: f64| xyz([x * scale + off, y * scale, 1.0]);
                let points = vec![at(0.0, 0.0), at(1.0, 1.0), at(-1.0, 1.0), at(0.5, 0.0)];
                let knots = [[0.0; 4], [1.0; 4]].concat();
                let spline = Spline::new(3, points, weights.to_vec(), knots).unwrap();
                let Some(measured) = MeasuredSpline::new(&spline) else { continue };
                let (length_mm, end) = (measured.length_mm(), measured.pieces()[0].end());
                let apart = distance(measured.point_at(length_mm), end);
                assert!(length_mm >= 0.4 * scale && apart <= 1e-8, "{length_mm} {apart}");
            }
        }
    }
}

#[test]
fn a_straight_spline_is_a_line() {
    let spline = last("G5 X9 Y6 I3 J2 P-3 Q-2 F100\nM30");
    let line = last("G1 X9 Y6 F100\nM30");
    assert!((spline.length_mm() - line.length_mm()).abs() < 1e-12);
    for k in 0..=100 {
        let share = f64::from(k) / 100.0;
        assert!(distance(place(&spline, share), place(&line, share)) < 1e-9);
    }
}

#[test]
fn a_quadratic_spline_is_the_cubic_of_its_raised_points() {
    let quadratic = last("G5.1 X9 Y6 I3 J6 F100\nM30");
    // Two thirds of the way from either end to the point between: (3, 6).
    let cubic = last("G5 X9 Y6 I2 J4 P-4 Q0 F100\nM30");
    assert!((quadratic.length_mm() - cubic.length_mm()).abs() < 1e-9);
    for k in 0..=100 {
        let share = f64::from(k) / 100.0;
        assert!(distance(place(&quadratic, share), place(&cubic, share)) < 1e-8);
    }
}

#[test]
fn a_circle_of_nurbs_is_that_of_an_arc() {
    let weight = std::f64::consts::FRAC_1_SQRT_2;
    let quarter = format!("G0 X10 F100\nG5.2 X10 Y10 P{weight:.16}\nX0 Y10 P1\nG5.3\nM30");
    let whole = format!(
        "G0 X10 F100\nG6.2 P3 K0\nK0 X10 Y10 R{weight:.16}\nK0 X0 Y10\nK1 X-10 R{weight:.16}\n\
         K1 X-10 Y0\nK2 Y-10 R{weight:.16}\nK2 X0\nK3 X10 R{weight:.16}\nK3 Y0\nK4\nK4\nK4\nM30"
    );
    let steps = format!(
        "G91 G0 X10 F100\nG6.2 P3 K0 X0\nK0 Y10 R{weight:.16}\nK0 X-10\nK1 X-10 R{weight:.16}\n\
         K1 Y-10\nK2 Y-10 R{weight:.16}\nK2 X10\nK3 X10 R{weight:.16}\nK3 Y10\nK4\nK4\nK4\nM30"
    );
    for (nurbs, arc) in [
        (quarter, "G0 X10 F100\nG3 X0 Y10 I-10\nM30"),
        (whole, "G0 X10 F100\nG3 I-10\nM30"),
        (steps, "G0 X10 F100\nG3 I-10\nM30"),
    ] {
        let (nurbs, arc) = (last(&nurbs), last(arc));
        assert!((nurbs.length_mm() - arc.length_mm()).abs() < 1e-9);
        for k in 0..=1000 {
            let share = f64::from(k) / 1000.0;
            assert!(distance(place(&nurbs, share), place(&arc, share)) < 1e-9, "{share}");
        }
    }
}

/// An affine map of the points is one of the curve; I J, P Q are mapped as ways.
#[test]
fn splines_are_scaled_and_turned() {
    let frames = "G52 X3 Y4\nG68 X2 Y1 R30\nG51 X1 Y2 Z0 I2 J0.5 K1";
    let words = "G1 X1 Y1 F100\nG5 X9 Y6 I3 J-2 P-5 Q1\nX12 Y0 P1 Q4\nG5.1 X0 Y0 I-5 J-5\nM30";
    let there = |x: f64, y: f64| {
        let [x, y] = [1.0 + 2.0 * (x - 1.0) - 2.0, 2.0 + 0.5 * (y - 2.0) - 1.0];
        let (sin, cos) = 30.0_f64.to_radians().sin_cos();
        xyz([3.0 + 2.0 + x * cos - y * sin, 4.0 + 1.0 + x * sin + y * cos, 0.0])
    };
    let (plain, framed) = (moves(words), moves(&format!("{frames}\n{words}")));
    for (plain, framed) in plain.iter().zip(&framed).skip(1) {
        let (MoveKind::Spline { curve: plain, .. }, MoveKind::Spline { curve: framed, .. }) =
            (&plain.kind, &framed.kind)
        else {
            panic!("no splines")
        };
        for (point, found) in plain.points().iter().zip(framed.points()) {
            let expected = there(point[Axis::X], point[Axis::Y]);
            for axis in Axis::LINEAR {
                assert!((expected[axis] - found[axis]).abs() < 1e-9, "{expected:?} {found:?}");
            }
        }
    }
}

#[test]
fn feed_modes_know_the_length_of_a_spline() {
    let feed = |text: &str| moves(text).last().unwrap().kind.feed_mm_min().unwrap();
    assert_eq!(feed("G20 F10\nG5.1 X1 Y1 I1 J0\nM30"), 10.0);
    assert_eq!(feed("G20\nF10 G5.1 X1 Y1 I1 J0\nM30"), 254.0);
    assert!((feed("G93 G5 X9 Y0 I3 J0 P-3 Q0 F2\nM30") - 18.0).abs() < 1e-9);
    assert_eq!(feed("G95 S100 F0.1\nG5.1 X1 Y1 I1 J0\nM30"), 10.0);
    let nurbs = "G93 G6.2 P3 K0 F2\nK0 X3\nK0 X9\nK1\nK1\nK1\nM30";
    assert!((feed(nurbs) - 18.0).abs() < 1e-9);
}

/// A spline of any degree, with knots of any multiplicity.
fn splines() -> impl Strategy<Value = Spline> {
    (1..6_usize, 0..5_usize).prop_flat_map(|(degree, more)| {
        let count = degree + 1 + more;
        let at = prop_oneof![4 => -10.0..10.0_f64, 1 => Just(1.0)];
        let points = proptest::collection::vec([at.clone(), at.clone(), at], count);
        let weights = proptest::collection::vec(0.2..5.0_f64, count);
        let inner = proptest::collection::vec(0..6_u32, more);
        (points, weights, inner, any::<bool>()).prop_filter_map("torn", move |parts| {
            let (points, weights, mut inner, is_even) = parts;
            inner.sort_unstable();
            let inner = inner.into_iter().map(|knot| f64::from(knot) + 1.0);
            let ends = |knot| std::iter::repeat_n(knot, degree + 1);
            let knots = ends(0.0).chain(inner).chain(ends(7.0)).collect();
            let weights = if is_even { vec![1.0; count] } else { weights };
            Spline::new(degree, points.into_iter().map(xyz).collect(), weights, knots).ok()
        })
    })
}

/// The curve by its definition: Cox and de Boor's recursion for the basis.
fn by_definition(spline: &Spline, t: f64) -> [f64; 3] {
    fn basis(knots: &[f64], i: usize, degree: usize, t: f64) -> f64 {
        if degree == 0 {
            let is_last = knots[i + 1] == knots[knots.len() - 1] && t == knots[i + 1];
            let is_in = knots[i] <= t && (t < knots[i + 1] || is_last && knots[i] < t);
            return f64::from(u8::from(is_in));
        }
        let part = |width: f64, share: f64, i: usize| {
            if width > 0.0 { share / width * basis(knots, i, degree - 1, t) } else { 0.0 }
        };
        part(knots[i + degree] - knots[i], t - knots[i], i)
            + part(knots[i + degree + 1] - knots[i + 1], knots[i + degree + 1] - t, i + 1)
    }
    let (mut sum, mut weights) = ([0.0; 3], 0.0);
    for (i, point) in spline.points().iter().enumerate() {
        let share = basis(spline.knots(), i, spline.degree(), t) * spline.weights()[i];
        weights += share;
        for (sum, axis) in sum.iter_mut().zip(Axis::LINEAR) {
            *sum += share * point[axis];
        }
    }
    sum.map(|sum| sum / weights)
}

fn spline_segment(spline: &Spline, feed_mm_s: f64) -> Option<Segment> {
    let (from, to) = (spline.points()[0], spline.points()[spline.points().len() - 1]);
    let kind = MoveKind::Spline { feed_mm_min: feed_mm_s * 60.0, curve: Arc::new(spline.clone()) };
    path::segment(&Move {
        line: 1,
        n: None,
        from,
        to,
        kind,
        corner: Default::default(),
        bound: Default::default(),
    })
}

/// The ticks of a job of one segment.
fn run(segment: &Segment, machine: &Machine) -> Vec<Command> {
    let start = segment.from_mm;
    let path = || [Ok::<_, Infallible>(PathItem::from(segment.clone()))].into_iter();
    let Ok(seams) = plan::place(path, machine, Feed::LookAhead);
    let plan = plan::plan(path(), machine, Feed::LookAhead, &seams, start);
    step::interpolate(plan, machine, start).map(|command| command.unwrap()).collect()
}

fn held(segment: &Segment, machine: &Machine, job: &[Command]) -> Report {
    let setup = Setup {
        machine,
        tick_us: machine.bus.tick_us,
        start_steps: machine.nearest_steps(&segment.from_mm),
        constant_feed: false,
        with_events: true,
        with_buffers: true,
    };
    let commands = || Ok::<_, Infallible>(job.iter().cloned().map(Ok::<_, Infallible>));
    let item = || Ok::<_, Infallible>(PathItem::from(segment.clone()));
    verify(&setup, commands, || Ok::<_, Infallible>([item()].into_iter())).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn pieces_are_the_curve(spline in splines()) {
        let mut knots = spline.knots().to_vec();
        knots.dedup();
        let pieces = spline.pieces();
        prop_assert_eq!(pieces.len(), knots.len() - 1);
        for (piece, ends) in pieces.iter().zip(knots.windows(2)) {
            for k in 0..=8 {
                let u = f64::from(k) / 8.0;
                let expected = by_definition(&spline, ends[0] + (ends[1] - ends[0]) * u);
                prop_assert!(distance(piece.at(u), expected) < 1e-9);
                // Derivatives by differences.
                let jet = piece.jet(u);
                let step = 1e-4;
                let [low, high] = [u - step, u + step].map(|u| piece.at(u));
                for i in 0..3 {
                    let first = (high[i] - low[i]) / (2.0 * step);
                    let second = (high[i] - 2.0 * jet.at[i] + low[i]) / (step * step);
                    prop_assert!((jet.first[i] - first).abs() < 1e-3 * (1.0 + first.abs()));
                    prop_assert!((jet.second[i] - second).abs() < 1e-1 * (1.0 + second.abs()));
                }
            }
        }
    }

    #[test]
    fn bounds_are_those_of_the_curve(spline in splines()) {
        let bounds = spline.bounds_mm();
        let mut reached = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
        for piece in spline.pieces() {
            for k in 0..=2000 {
                let at = piece.at(f64::from(k) / 2000.0);
                for i in 0..3 {
                    prop_assert!(bounds[i][0] - 2e-9 <= at[i] && at[i] <= bounds[i][1] + 2e-9);
                    reached[i] = [reached[i][0].min(at[i]), reached[i][1].max(at[i])];
                }
            }
        }
        for (bound, reached) in bounds.iter().zip(reached) {
            prop_assert!((0..2).all(|i| (bound[i] - reached[i]).abs() < 1e-3));
        }
    }

    /// The length is that of fine chords, to what these miss; places are as far along as asked.
    #[test]
    fn places_are_as_far_along_as_asked(spline in splines()) {
        let Some(measured) = MeasuredSpline::new(&spline) else { return Ok(()) };
        let (mut chords_mm, mut marks) = (0.0, Vec::new());
        for piece in measured.pieces() {
            let mut at = piece.start();
            for k in 1..=4_000 {
                let next = piece.at(f64::from(k) / 4_000.0);
                chords_mm += distance(at, next);
                at = next;
                if k % 500 == 0 {
                    marks.push((chords_mm, at));
                }
            }
        }
        let length_mm = measured.length_mm();
        prop_assert!((length_mm - spline.length_mm()).abs() < 1e-6);
        prop_assert!((length_mm - chords_mm).abs() < 1e-5 * (1.0 + length_mm), "{length_mm} {chords_mm}");
        for (along_mm, at) in marks {
            prop_assert!(distance(measured.point_at(along_mm), at) < 1e-4 * (1.0 + length_mm));
        }
        prop_assert!(distance(measured.point_at(length_mm), measured.pieces().last().unwrap().end()) < 1e-9);
    }

    /// Spans follow on one another, turn little, and tell where the direction goes.
    #[test]
    fn spans_tell_the_direction(spline in splines()) {
        let Some(measured) = MeasuredSpline::new(&spline) else { return Ok(()) };
        let mut end_mm = 0.0;
        for span in measured.spans() {
            prop_assert!((span.start_mm - end_mm).abs() < 1e-9);
            end_mm += span.length_mm;
            let turn = distance(span.tangents[0], span.tangents[1]);
            prop_assert!(turn <= 0.04 || span.length_mm < 1e-5, "{turn} in {}", span.length_mm);
            if span.length_mm > 1e-3 {
                let places = [span.start_mm, end_mm].map(|at_mm| measured.point_at(at_mm));
                let chord = std::array::from_fn(|i| (places[1][i] - places[0][i]) / span.length_mm);
                prop_assert!(distance(chord, span.tangents[0]) < 0.05, "{chord:?}");
            }
        }
        prop_assert!((end_mm - measured.length_mm()).abs() < 1e-9);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(6))]

    /// Any spline, with corners and cusps, is run within tolerance and limits; a count moved
    /// across is found.
    #[test]
    fn every_spline_is_driven_and_verified(spline in splines(), feed_mm_s in 1.0..30.0_f64) {
        for name in ["starmill", "router"] {
            let machine = Machine::load(name).unwrap();
            let zero = machine.work_zero_mm;
            let add = |point: &Point| Point::from_fn(|axis| match axis {
                Axis::Z => 0.1 * point[axis] + zero[axis] - 20.0,
                // Small: a cusp is passed at less than 0.4 mm/s.
                _ => 0.1 * point[axis] + zero[axis],
            });
            let points = spline.points().iter().map(add).collect();
            let (weights, knots) = (spline.weights().to_vec(), spline.knots().to_vec());
            let moved = Spline::new(spline.degree(), points, weights, knots).unwrap();
            let Some(segment) = spline_segment(&moved, feed_mm_s) else { continue };
            let mut job = run(&segment, &machine);
            let report = held(&segment, &machine, &job);
            prop_assert_eq!(report.verdict, Verdict::Pass, "{:?}", report.failures);
            let half = job.len() / 2;
            for (at, by) in [(half, 40), (half + 1, -40)] {
                if let Some(Command::Tick(tick)) = job.get_mut(at) {
                    tick.counts[Axis::Z] += by;
                }
            }
            if job.len() > half + 1 {
                prop_assert_eq!(held(&segment, &machine, &job).verdict, Verdict::Fail);
            }
        }
    }
}
