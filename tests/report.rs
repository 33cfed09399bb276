//! `cnc report` through its binary: a page that is whole, well-formed, and needs no network.

use std::process::{Command, Stdio};

use resvg::usvg::roxmltree::Document;

/// A page, whose elements are all closed but for those that HTML leaves open.
#[track_caller]
fn check(file: &str, machine: &str, code: i32, parts: &[&str]) -> String {
    let mut process = Command::new(env!("CARGO_BIN_EXE_cnc"));
    process.env_remove("CNC_MACHINE").stdin(Stdio::null());
    process.current_dir(env!("CARGO_MANIFEST_DIR")).args(["report", file, "-m", machine]);
    let output = process.output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{file}: {said}");
    let page = String::from_utf8(output.stdout).unwrap();
    for part in parts {
        assert!(page.contains(part), "{file}: no '{part}'");
    }
    let closed = page
        .replace("<!doctype html>", "")
        .replace("<meta charset=\"utf-8\">", "")
        .replace("initial-scale=1\">", "initial-scale=1\"/>");
    Document::parse(&closed).unwrap_or_else(|error| panic!("{file}: {error}"));
    for outside in ["<script", "<link", "src=", "@import", "url("] {
        assert!(!page.contains(outside), "{file}: {outside}");
    }
    assert!(page.replace("http://www.w3.org/2000/svg", "").find("http").is_none(), "{file}");
    page
}

#[test]
fn a_good_program_has_all_of_it() {
    let page = check(
        "samples/good/planes.nc",
        "starmill",
        0,
        &[
            "<h1>planes.nc</h1>",
            "Pass: at most 0.0",
            "Time by phase and tool",
            "Ends of node buffers",
            "What limits the speed",
            "Verification",
            "pairs of bytes held against every node",
            "sha256:",
            "[axes.X]",
        ],
    );
    assert_eq!(page.matches("<svg xmlns").count(), 9);
}

#[test]
fn a_machine_without_nodes_has_no_bus() {
    let page = check("samples/good/planes.nc", "router", 0, &["Pass: "]);
    assert!(!page.contains("<h2>Bus</h2>"));
}

#[test]
fn what_is_wrong_stands_on_the_page() {
    let parts = ["Refused: there is 1 error", "no-feed", "<pre>"];
    let page = check("samples/bad/no-feed.nc", "starmill", 1, &parts);
    assert!(!page.contains("<svg"), "a program that is refused is not drawn");
    let outside = check("samples/bad/limit-x-max.nc", "starmill", 1, &["leaves the travel"]);
    assert!(outside.contains("<svg"), "one that leaves the travel is");
}
