//! What must hold for every program.

use cnc::base::Axis;
use cnc::interp::Move;
use proptest::prelude::*;

use support::{check, ideal, moves};

#[path = "language/support.rs"]
mod support;

fn steps() -> impl Strategy<Value = Vec<[i32; 3]>> {
    proptest::collection::vec(proptest::array::uniform3(-50_000..50_000_i32), 1..30)
}

fn close(a: &[Move], b: &[Move]) -> bool {
    a.len() == b.len()
        && a.iter().zip(b).all(|(a, b)| {
            Axis::LINEAR.into_iter().all(|axis| (a.to[axis] - b.to[axis]).abs() < 1e-9)
        })
}

/// From a point to a line between two points.
fn distance(point: [f64; 2], from: [f64; 2], to: [f64; 2]) -> f64 {
    let way = [to[0] - from[0], to[1] - from[1]];
    let out = [point[0] - from[0], point[1] - from[1]];
    let square = way[0] * way[0] + way[1] * way[1];
    let share = ((out[0] * way[0] + out[1] * way[1]) / square).clamp(0.0, 1.0);
    (out[0] - way[0] * share).hypot(out[1] - way[1] * share)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn absolute_and_incremental_words_lead_to_the_same_places(steps in steps()) {
        let (mut absolute, mut incremental) = (String::from("G90 G0\n"), String::from("G91 G0\n"));
        let mut at = [0; 3];
        for step in &steps {
            for (i, letter) in ["X", "Y", "Z"].into_iter().enumerate() {
                at[i] += step[i];
                absolute += &format!("{letter}{}", f64::from(at[i]) / 1000.0);
                incremental += &format!("{letter}{}", f64::from(step[i]) / 1000.0);
            }
            absolute.push('\n');
            incremental.push('\n');
        }
        prop_assert!(close(&moves(&absolute, &ideal()), &moves(&incremental, &ideal())));
    }

    #[test]
    fn inches_and_millimetres_lead_to_the_same_places(steps in steps()) {
        // 25.4 mm are 25400 thousandths: 254 of a tenth are exact in both units.
        let program = |unit: &str, scale: f64| {
            let mut text = format!("{unit} G91\nG1 F{}\n", 254.0 / scale);
            for [x, y, z] in &steps {
                let [x, y, z] = [x, y, z].map(|v| f64::from(*v) * 0.0254 / scale);
                text += &format!("X{x:.9} Y{y:.9} Z{z:.9}\n");
            }
            moves(&text, &ideal())
        };
        let (inches, millimetres) = (program("G20", 25.4), program("G21", 1.0));
        prop_assert!(inches.len() == millimetres.len());
        for (a, b) in inches.iter().zip(&millimetres) {
            for axis in Axis::LINEAR {
                prop_assert!((a.to[axis] - b.to[axis]).abs() < 1e-6);
            }
            let [a, b] = [a, b].map(|step| step.kind.feed_mm_min().unwrap());
            prop_assert!((a - b).abs() < 1e-9 * b);
        }
    }

    /// Along a contour of lines the tool's centre is never nearer to any two lines that follow each
    /// other than its radius, and each move begins where the one before ended.
    #[test]
    fn a_compensated_tool_keeps_its_distance(
        turns in proptest::collection::vec((-150..150_i32, 60..200_i32), 2..8),
        left: bool,
    ) {
        let radius = 2.0;
        let side = if left { "G41.1" } else { "G42.1" };
        let mut corners = vec![[0.0_f64, 0.0], [20.0, 0.0]];
        let mut text = format!("G0 X-20 F100\n{side} D4 G1 X0\nX20\n");
        let mut direction = 0.0_f64;
        for (turn, by) in &turns {
            direction += f64::from(*turn).to_radians();
            let [x, y] = corners[corners.len() - 1];
            let by = f64::from(*by) / 5.0;
            let [x, y] = [x + by * direction.cos(), y + by * direction.sin()];
            corners.push([x, y]);
            text += &format!("X{x:.9} Y{y:.9}\n");
        }
        text += "G40\nM30";
        let machine = ideal();
        let checked = check(text.as_bytes(), &machine);
        if checked.errors > 0 {
            prop_assert!(checked.diagnostics.iter().all(|d| d.rule == "compensation-gouge"));
            return Ok(());
        }
        let moves = moves(&text, &machine);
        let mut at = machine.work_zero_mm;
        for step in &moves {
            prop_assert_eq!(step.from, at);
            at = step.to;
        }
        for step in moves.iter().skip(2) {
            // The legs that a move goes along or about: those of its line and the one before.
            let leg = step.line as usize - 3;
            let segment = cnc::path::segment(step);
            for k in 0..=20 {
                let Some(segment) = &segment else { continue };
                let point = segment.point_at(f64::from(k) / 20.0);
                let point = [point[Axis::X], point[Axis::Y]];
                for near in leg.saturating_sub(1)..(leg + 2).min(corners.len() - 1) {
                    let away = distance(point, corners[near], corners[near + 1]);
                    prop_assert!(away > radius - 1e-6, "line {}: {away}\n{text}", step.line);
                }
            }
        }
    }

    #[test]
    fn no_bytes_panic(text in proptest::collection::vec(any::<u8>(), 0..400)) {
        check(&text, &ideal());
    }

    /// A program that is right runs as checked; every move begins where the one before ended,
    /// within the extents that the check has told.
    #[test]
    fn a_checked_program_runs(
        lines in proptest::collection::vec(
            "(N[0-9]{1,3} )?(G(0|1|2|3|5|5.1|5.2|5.3|6.2|17|18|19|20|21|90|91|53|4|10|15|16|28|40|41|41.1|42|43|50|51|52|54|55|64|68|69|73|76|80|81|83|84|87|90.1|92|93|95|98|99) ?)?([XYZIJKRFPSTDHLQ]-?[0-9]{1,2}(\\.[0-9])? ?){0,4}|GR1|M[0-9]|O1|M99|%",
            0..20,
        ),
    ) {
        let text = lines.join("\n");
        let machine = ideal();
        let checked = check(text.as_bytes(), &machine);
        if checked.errors > 0 {
            return Ok(());
        }
        let moves = moves(&text, &machine);
        prop_assert_eq!(moves.len() as u64, checked.summary.moves);
        let mut at = machine.work_zero_mm;
        for step in &moves {
            prop_assert_eq!(step.from, at);
            at = step.to;
            for axis in Axis::LINEAR {
                let [least, greatest] = checked.summary.extents_mm[axis].unwrap();
                prop_assert!(least <= at[axis] && at[axis] <= greatest);
            }
        }
        prop_assert_eq!(at, checked.summary.end_mm);
    }
}
