//! Cutting: the thesis's equations and its table, and what `cnc cut` makes of a program.

use assert_cmd::Command;
use cnc::systems::cutting::table::{MATERIALS, TOOLS, entry};
use cnc::systems::cutting::{Cut, Material, Tool, chip_mm, feed_mm_min, power_kw};
use proptest::prelude::*;
use serde_json::Value;

fn tool() -> Tool {
    entry(TOOLS, Some("end-mill-6")).unwrap().1
}

fn material(name: &str) -> Material {
    entry(MATERIALS, Some(name)).unwrap().1
}

fn cut(depth_mm: Option<f64>, width_mm: Option<f64>) -> Cut {
    Cut::new(tool(), material("aluminium-6061-t6"), depth_mm, width_mm, 1.0).unwrap()
}

#[test]
fn the_equations_of_the_paper_give_these_figures() {
    let cut = cut(None, None);
    let at = |feed_tooth_mm| cut.load(feed_mm_min(2000.0, 2, feed_tooth_mm), 2000.0);
    // A slot of the mill's own width: h_m = 2·f_z/π.
    let at_tenth = at(0.1 * std::f64::consts::PI / 2.0);
    assert!((at_tenth.chip_mm - 0.1).abs() < 1e-12);
    let computed = [
        at_tenth.force_n_mm2,
        chip_mm(&cut.tool, 0.59, 1.0, 180.0),
        at(0.59).chip_mm,
        feed_mm_min(2000.0, 2, 0.59),
        power_kw(6.0, 2360.0, 1796.6, 1.0),
        at(0.59).power_kw,
        power_kw(6.0, 2360.0, at_tenth.force_n_mm2, 1.0),
    ];
    let rows = include_str!("papers/cutting.csv");
    let rows: Vec<&str> = rows.lines().filter(|line| !line.starts_with('#')).skip(1).collect();
    assert_eq!(rows.len(), computed.len());
    for (row, computed) in rows.iter().zip(computed) {
        let expected = row.rsplit(',').next().unwrap();
        let decimals = expected.split_once('.').map_or(0, |(_, decimals)| decimals.len());
        assert_eq!(format!("{computed:.decimals$}"), expected, "{row}");
    }
}

#[test]
fn a_tool_cuts_no_deeper_than_its_teeth_and_no_wider_than_itself() {
    let refused = |depth, width| {
        let aluminium = material("aluminium-6061-t6");
        Cut::new(tool(), aluminium, depth, width, 1.0).unwrap_err().to_string()
    };
    assert_eq!(refused(Some(30.0), None), "30 mm is deeper than the tool cuts, 20 mm");
    assert_eq!(refused(None, Some(6.5)), "6.5 mm is wider than the tool, 6 mm");
}

proptest! {
    /// The feed that is said to fit takes the spindle's power, no more and no less; and the force on all
    /// teeth in the work, times the speed of cutting, is the power at the tool.
    #[test]
    fn the_feed_that_fits_takes_the_power(
        depth in 0.1..20.0_f64, width in 0.1..6.0_f64, rpm in 100.0..20_000.0_f64, kw in 0.01..5.0_f64,
    ) {
        let cut = Cut { efficiency: 0.8, ..cut(Some(depth), Some(width)) };
        let load = cut.load(cut.feed_for_mm_min(kw, rpm), rpm);
        prop_assert!((load.power_kw / kw - 1.0).abs() < 1e-9);
        let teeth = f64::from(cut.tool.teeth) * cut.engaged_deg() / 360.0;
        let speed_m_s = std::f64::consts::PI * cut.tool.diameter_mm * rpm / 6e4;
        let at_tool_kw = load.tooth_n * teeth * speed_m_s / 1e3;
        prop_assert!((at_tool_kw / (0.8 * kw) - 1.0).abs() < 1e-9);
    }
}

/// Runs `cnc cut`: exit code and both streams.
fn run(args: &[&str]) -> (i32, String, String) {
    let output = Command::cargo_bin("cnc")
        .unwrap()
        .env_remove("CNC_MACHINE")
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .arg("cut")
        .args(args)
        .output()
        .unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

#[test]
fn the_command_says_where_the_spindle_is_too_weak_and_what_would_fit() {
    let program = ["samples/good/slots.nc", "--tool", "end-mill-6"];
    let aluminium = ["--material", "aluminium-6061-t6", "--json"];
    let (code, out, _) = run(&[&program[..], &aluminium].concat());
    let report: Value = serde_json::from_str(&out).unwrap();
    assert_eq!((code, report["fits"].as_bool()), (0, Some(true)));
    let moves = report["moves"].as_array().unwrap();
    assert_eq!(moves.len(), 4);
    assert_eq!(moves[0]["type"], "axial");
    assert_eq!((moves[1]["line"].as_u64(), moves[1]["line_last"].as_u64()), (Some(9), Some(10)));
    assert_eq!(moves[3]["asked"]["feed_tooth_mm"], 0.59);
    assert_eq!(moves[3]["limited_by_axes"], true);

    let (code, out, _) = run(&[&program[..], &aluminium, &["--depth", "2"]].concat());
    let report: Value = serde_json::from_str(&out).unwrap();
    assert_eq!((code, report["fits"].as_bool()), (1, Some(false)));
    let fits = report["moves"][3]["feed_that_fits_mm_min"].as_f64().unwrap();
    assert!((fits - 791.8).abs() < 0.1, "{fits}");
}

#[test]
fn huge_and_tiny_numbers_keep_their_columns() {
    let program =
        ["samples/good/slots.nc", "--tool", "end-mill-6", "--material", "aluminium-6061-t6"];
    for size in ["1e-200", "1e-12", "0.000123"] {
        let (code, out, _) = run(&[&program[..], &["--depth", size, "--width", size]].concat());
        assert_eq!(code, 0, "{size}: {out}");
        assert!(out.lines().all(|line| line.chars().count() <= 120), "{size}: {out}");
    }
}

#[test]
fn what_cannot_be_reckoned_is_refused_with_the_reason() {
    let slots = "samples/good/slots.nc";
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("own.toml");
    std::fs::write(&file, "[a]\nkc11_n_mm2 = 700.0\nmc = 1.2\n").unwrap();
    let own = file.to_str().unwrap();
    for (args, code, reason) in [
        (
            &[slots, "--tool", "end-mill-7", "--material", "steel-c45"][..],
            2,
            "built in are end-mill-10",
        ),
        (&[slots, "--tool", "end-mill-6", "--material", own], 2, "0 to 0.9 is expected"),
        (&[slots, "--tool", "end-mill-6", "--material", "steel-c45", "--depth", "21"], 2, "20 mm"),
        (&[slots, "--tool", "end-mill-6", "--material", "steel-c45", "--depth", "0"], 2, "above 0"),
        (
            &[
                "samples/good/kimm-test.nc",
                "--tool",
                "end-mill-6",
                "--material",
                "steel-c45",
                "-m",
                "kimm",
            ],
            2,
            "no [spindle]",
        ),
        (
            &["samples/good/kimm-test.nc", "--tool", "end-mill-6", "--material", "steel-c45"],
            1,
            "line 6: a cut with a spindle that does not turn",
        ),
    ] {
        let (found, out, err) = run(args);
        assert_eq!((found, out.as_str()), (code, ""), "{args:?} {err}");
        assert!(err.contains(reason), "{args:?} {err}");
    }
}

#[test]
fn own_tables_are_read_by_file_and_name() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("own.toml");
    std::fs::write(
        &file,
        "[a]\nkc11_n_mm2 = 700.0\nmc = 0.25\n[b]\nkc11_n_mm2 = 1400.0\nmc = 0.25\n",
    )
    .unwrap();
    let power = |name: &str| {
        let material = format!("{}{name}", file.display());
        let (_, out, err) = run(&[
            "samples/good/slots.nc",
            "--tool",
            "end-mill-6",
            "--material",
            &material,
            "--json",
        ]);
        let report: Value = serde_json::from_str(&out).unwrap();
        report["power_max_kw"].as_f64().ok_or(err)
    };
    let (a, b) = (power(":a").unwrap(), power(":b").unwrap());
    assert!((b / a - 2.0).abs() < 1e-4, "{a} {b}");
    assert!(power("").unwrap_err().contains("say which, as FILE:a"));
}
