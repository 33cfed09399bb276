//! What interfaces carry, a row a setting.

use cnc::systems::carry::{Interface, Setting};

use crate::table::{Cell, Column, Table};

const CARRIED: [Column; 13] = [
    ("interface", "interface"),
    ("nodes", "nodes"),
    ("baud", "baud"),
    ("period_ms", "period ms"),
    ("bits", "bits"),
    ("line_ms", "line ms"),
    ("least_ms", "least ms"),
    ("fill_ms", "fill ms"),
    ("buffer_ms", "buffer ms"),
    ("sync_ms", "sync ms"),
    ("left_ms", "left ms"),
    ("nodes_max", "nodes max"),
    ("works", "works"),
];

const BLOCKS: [Column; 7] = [
    ("interface", "interface"),
    ("nodes", "nodes"),
    ("baud", "baud"),
    ("feed_mm_min", "feed mm/min"),
    ("block_ms", "block ms"),
    ("least_ms", "least ms"),
    ("keeps_up", "keeps up"),
];

/// Times and nodes of each setting.
pub fn carried(settings: &[Setting]) -> Table {
    let row = |setting: &Setting| {
        let carry = setting.carry();
        let ms = |seconds: f64| Cell::Number(seconds * 1e3, 4);
        let some_ms =
            |seconds: Option<f64>, decimals| Cell::some(seconds.map(|s| s * 1e3), decimals);
        vec![
            Cell::text(setting.interface),
            Cell::Whole(setting.nodes.into()),
            Cell::Whole(setting.baud.into()),
            ms(setting.period_s),
            Cell::Whole(carry.bits.round() as u64),
            ms(carry.line_s),
            ms(carry.least_s),
            some_ms(carry.fill_s, 1),
            some_ms(carry.buffer_s, 0),
            some_ms(carry.sync_s, 4),
            ms(carry.left_s),
            Cell::Whole(carry.nodes_max.into()),
            Cell::Flag(setting.check().is_ok()),
        ]
    };
    Table { columns: CARRIED.to_vec(), rows: settings.iter().map(row).collect() }
}

/// Whether blocks of a length last long enough at each feed, and whether all do.
pub fn blocks(settings: &[Setting], block_mm: f64, feeds_mm_min: &[f64]) -> (Table, bool) {
    let mut all_keep_up = true;
    let mut rows = Vec::new();
    for setting in settings {
        let carry = setting.carry();
        // What a block must last: what the interface takes, at the least period that it can have.
        let works = matches!(setting.interface, Interface::Coefficients)
            || Setting { period_s: carry.least_s, ..*setting }.check().is_ok();
        for feed_mm_min in feeds_mm_min {
            let block_s = block_mm / feed_mm_min * 60.0;
            let keeps_up = works && block_s >= carry.least_s * (1.0 - 1e-9);
            all_keep_up &= keeps_up;
            rows.push(vec![
                Cell::text(setting.interface),
                Cell::Whole(setting.nodes.into()),
                Cell::Whole(setting.baud.into()),
                Cell::Number(*feed_mm_min, 0),
                Cell::Number(block_s * 1e3, 4),
                Cell::Number(carry.least_s * 1e3, 4),
                Cell::Flag(keeps_up),
            ]);
        }
    }
    (Table { columns: BLOCKS.to_vec(), rows }, all_keep_up)
}
