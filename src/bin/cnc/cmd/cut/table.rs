//! What `cnc cut` prints: a table with what would fit, or one document.

use std::io::{self, Write};

use cnc::base::rounding::six_digits;
use cnc::systems::cutting::Load;
use serde_json::{Value, json};

use super::{Kind, Row, Setup, Side};
use crate::program::Program;

pub fn print(
    out: &mut impl Write,
    program: &Program,
    setup: &Setup,
    rows: &[Row],
) -> io::Result<()> {
    head(out, program, setup)?;
    for row in rows {
        let [first, last] = row.lines;
        let lines = if first == last { first.to_string() } else { format!("{first}-{last}") };
        write!(out, "{lines:>11} {:>7}", row.moves)?;
        match &row.kind {
            Kind::Axial => writeln!(out, "  along the tool's axis: no side is cut")?,
            Kind::Side(side) => {
                load(out, setup, side, &side.load())?;
                writeln!(out, "{}", if row.is_over(&setup.spindle) { "  too much" } else { "" })?;
                if side.reached.is_some() {
                    write!(out, "{:>19}", "as asked")?;
                    load(out, setup, side, &side.asked)?;
                    writeln!(out, "  beyond the axes")?;
                }
            }
        }
    }
    writeln!(out)?;
    if rows.is_empty() {
        return writeln!(out, "there are no feed moves");
    }
    for row in rows.iter().filter(|row| row.is_over(&setup.spindle)) {
        let Some(side) = row.side() else { continue };
        let [first, last] = row.lines;
        let lines =
            if first == last { format!("line {first}") } else { format!("lines {first}-{last}") };
        writeln!(
            out,
            "{lines}: {} kW, and the spindle has {}; F{} would fit",
            column(side.load().power_kw, 3),
            short(setup.spindle.power_kw),
            fits(side)
        )?;
    }
    let sides = rows.iter().filter_map(Row::side);
    let most_kw = sides.map(|side| side.load().power_kw).fold(0.0, f64::max);
    let (kw, share) = (setup.spindle.power_kw, 100.0 * most_kw / setup.spindle.power_kw);
    let (most_kw, kw, share) = (column(most_kw, 3), short(kw), column(share, 0));
    writeln!(out, "most: {most_kw} of {kw} kW, {share} %")
}

/// The feed that fits, rounded down to a tenth.
fn fits(side: &Side) -> String {
    short((side.fits_mm_min * 10.0).floor() / 10.0)
}

/// A number as it is, or by its power of ten where it would take more digits than anyone reads.
fn short(value: f64) -> String {
    if value == 0.0 || (1e-4..1e7).contains(&value.abs()) {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

/// A number with so many decimals, or by its power of ten where these do not show it, or it is too wide.
fn column(value: f64, decimals: usize) -> String {
    let is_shown = value == 0.0 || value.abs() >= 0.5 * 0.1_f64.powi(decimals as i32);
    if is_shown && value.abs() < 1e6 {
        format!("{value:.decimals$}")
    } else {
        format!("{value:.2e}")
    }
}

fn head(out: &mut impl Write, program: &Program, setup: &Setup) -> io::Result<()> {
    let (cut, spindle) = (&setup.cut, &setup.spindle);
    let tool = &cut.tool;
    writeln!(out, "program   {}", program.source.name())?;
    writeln!(out, "machine   {}", program.machine)?;
    writeln!(
        out,
        "tool      {}: {} mm, {} teeth, rake {}°, edge {}°",
        setup.tool_name,
        short(tool.diameter_mm),
        tool.teeth,
        short(tool.rake_deg),
        short(tool.edge_angle_deg)
    )?;
    writeln!(
        out,
        "material  {}: k_c1.1 {} N/mm², m_c {}",
        setup.material_name,
        short(cut.material.kc11_n_mm2),
        short(cut.material.mc)
    )?;
    writeln!(
        out,
        "cut       every feed move {} mm deep and {} mm wide: a tooth is in the work for {:.1}°",
        short(cut.depth_mm),
        short(cut.width_mm),
        cut.engaged_deg()
    )?;
    let share = 100.0 * spindle.efficiency;
    writeln!(out, "spindle   {} kW, {share} % of it at the tool", spindle.power_kw)?;
    writeln!(out)?;
    writeln!(
        out,
        "{:>11} {:>7} {:>8} {:>7} {:>8} {:>8} {:>9} {:>8} {:>8} {:>6}",
        "lines", "moves", "mm/min", "rpm", "f_z mm", "h_m mm", "k_c N/mm²", "tooth N", "kW", "load"
    )
}

fn load(out: &mut impl Write, setup: &Setup, side: &Side, load: &Load) -> io::Result<()> {
    write!(
        out,
        " {:>8} {:>7} {:>8} {:>8} {:>9} {:>8} {:>8} {:>4} %",
        column(load.feed_mm_min, 1),
        column(side.rpm, 0),
        column(load.feed_tooth_mm, 4),
        column(load.chip_mm, 4),
        column(load.force_n_mm2, 1),
        column(load.tooth_n, 1),
        column(load.power_kw, 4),
        column(100.0 * load.power_kw / setup.spindle.power_kw, 0)
    )
}

pub fn document(out: &mut impl Write, setup: &Setup, rows: &[Row]) -> io::Result<()> {
    let (cut, spindle) = (&setup.cut, &setup.spindle);
    let moves: Vec<Value> = rows.iter().map(|row| row_json(setup, row)).collect();
    let sides = rows.iter().filter_map(Row::side);
    let most_kw = sides.map(|side| side.load().power_kw).fold(0.0, f64::max);
    let document = json!({
        "schema": 1,
        "tool": setup.tool_name,
        "material": setup.material_name,
        "depth_mm": cut.depth_mm,
        "width_mm": cut.width_mm,
        "engaged_deg": six_digits(cut.engaged_deg()),
        "spindle": {"power_kw": spindle.power_kw, "efficiency": spindle.efficiency,
                    "speed_max_rpm": spindle.speed_max_rpm},
        "power_max_kw": six_digits(most_kw),
        "fits": most_kw <= spindle.power_kw,
        "moves": moves,
    });
    writeln!(out, "{document}")
}

fn row_json(setup: &Setup, row: &Row) -> Value {
    let mut object = json!({
        "line": row.lines[0],
        "line_last": row.lines[1],
        "moves": row.moves,
        "way_mm": six_digits(row.way_mm),
    });
    match &row.kind {
        Kind::Axial => object["type"] = json!("axial"),
        Kind::Side(side) => {
            object["type"] = json!("side");
            object["rpm"] = json!(side.rpm);
            object["asked"] = load_json(&side.asked);
            object["reached"] = load_json(&side.load());
            object["limited_by_axes"] = json!(side.reached.is_some());
            object["fits"] = json!(!row.is_over(&setup.spindle));
            object["feed_that_fits_mm_min"] = json!(six_digits(side.fits_mm_min));
        }
    }
    object
}

fn load_json(load: &Load) -> Value {
    json!({
        "feed_mm_min": six_digits(load.feed_mm_min),
        "feed_tooth_mm": six_digits(load.feed_tooth_mm),
        "chip_mm": six_digits(load.chip_mm),
        "kc_n_mm2": six_digits(load.force_n_mm2),
        "tooth_n": six_digits(load.tooth_n),
        "power_kw": six_digits(load.power_kw),
    })
}
