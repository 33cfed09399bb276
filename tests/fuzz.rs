//! Replays what fuzzing has found, and the programs at hand, through the body of the fuzz target.

use std::fs;
use std::path::Path;

#[path = "../fuzz/body.rs"]
mod body;

#[test]
fn what_must_hold_for_any_bytes_holds_for_the_corpus() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut count = 0;
    for folder in
        ["fuzz/corpus/program", "samples/good", "samples/bad", "samples/lathe", "samples/fanuc"]
    {
        for entry in fs::read_dir(root.join(folder)).unwrap() {
            let path = entry.unwrap().path();
            // These are about size and count: they take long in a debug build, and show nothing here.
            let heavy = ["call-count", "subprogram-size", "line-too-long"];
            if !heavy.iter().any(|name| path.file_stem().is_some_and(|stem| stem == *name)) {
                body::program(&fs::read(path).unwrap());
                count += 1;
            }
        }
    }
    assert!(count > 90);
}
