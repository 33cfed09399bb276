//! Replays what fuzzing has found, and the programs at hand, through the body of the fuzz target.

use std::fs;
use std::path::Path;

#[path = "../fuzz/body.rs"]
mod body;

#[test]
fn what_must_hold_for_any_bytes_holds_for_the_corpus() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut count = 0;
    for folder in ["fuzz/corpus/program", "samples/good", "samples/bad"] {
        for entry in fs::read_dir(root.join(folder)).unwrap() {
            let text = fs::read(entry.unwrap().path()).unwrap();
            // The largest sample takes long in a debug build, and shows nothing here.
            if text.len() < 1 << 16 {
                body::program(&text);
                count += 1;
            }
        }
    }
    assert!(count > 100);
}
