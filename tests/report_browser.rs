//! `cnc report` in headless Chromium: no message on the console, every drawing visible within the page, nothing
//! wider than the window, letters that can be read, apart from each other and within their drawing, from a
//! telephone's width to a desk's; and it prints. Where there is no Chromium
//! the test says so, and fails in CI.

use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use serde_json::{Value, json};

/// What the browser may be called.
const NAMES: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];

/// Letters are so high at least, in dots.
const LETTERS_MIN: f64 = 9.0;

/// Measures the page when it has been laid out, and leaves the figures in the page around it.
const MEASURE: &str = r#"<script>
addEventListener("load", () => {
  const box = element => {
    const { left, right, width, height } = element.getBoundingClientRect();
    return { left, right, width, height };
  };
  const page = document.documentElement;
  // What the font's size comes to on the screen, whichever way the letters run.
  const size = text => {
    const { a, b } = text.getScreenCTM();
    return parseFloat(getComputedStyle(text).fontSize) * Math.hypot(a, b);
  };
  // Letters have some room above and below them that others may reach into.
  const places = drawing => [...drawing.querySelectorAll("text")].map(text => {
    const { left, right, top, bottom } = text.getBoundingClientRect();
    const room = size(text) / 6;
    return { words: text.textContent, left, right, top: top + room, bottom: bottom - room };
  });
  const meet = (a, b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
  const drawings = [...document.querySelectorAll(".drawing > svg, .legend > svg")];
  const pairs = drawings.flatMap(drawing => {
    const texts = places(drawing);
    return texts.flatMap((a, at) => texts.slice(at + 1).filter(b => meet(a, b)).map(b => [a.words, b.words]));
  });
  const cut = drawings.flatMap(drawing => {
    const edge = drawing.getBoundingClientRect();
    const out = text => text.left < edge.left || text.right > edge.right || text.bottom > edge.bottom;
    return places(drawing).filter(out).map(text => text.words);
  });
  const seen = {
    window: innerWidth,
    page: page.scrollWidth,
    drawings: [...document.querySelectorAll(".drawing > svg")].map(box),
    letters: Math.min(...drawings.flatMap(drawing => [...drawing.querySelectorAll("text")].map(size))),
    pairs,
    cut,
    // A drawing without its style sheet would be black.
    papers: [...document.querySelectorAll(".plot .paper")].map(paper => getComputedStyle(paper).fill),
    curves: [...document.querySelectorAll(".plot .curve, .plot .way")].filter(way => {
      const size = way.getBBox();
      return size.width + size.height > 0;
    }).length,
  };
  const figures = document.createElement("pre");
  figures.id = "figures";
  figures.hidden = true;
  figures.textContent = JSON.stringify(seen);
  parent.document.body.append(figures);
});
</script>
</body>"#;

fn chromium() -> Option<&'static str> {
    let runs = |name: &&'static str| {
        let mut process = Command::new(name);
        let status = process.arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
        status.is_ok_and(|status| status.success())
    };
    NAMES.into_iter().find(runs)
}

/// Runs the browser on a page, with a profile of its own.
fn browse(browser: &str, folder: &Path, args: &[&str], page: &Path) -> Output {
    let mut process = Command::new(browser);
    process.args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"]);
    process.arg(format!("--user-data-dir={}", folder.join("profile").display()));
    process.args(["--no-first-run", "--enable-logging=stderr", "--hide-scrollbars"]);
    // A page that asked for anything outside would fail, and say so.
    process.arg("--proxy-server=127.0.0.1:9");
    let output = process.args(args).arg(format!("file://{}", page.display())).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{args:?}: {said}");
    assert!(!said.contains(":CONSOLE"), "{args:?}: {said}");
    output
}

fn report(folder: &Path, program: &str) -> PathBuf {
    let page = folder.join("report.html");
    let mut process = Command::new(env!("CARGO_BIN_EXE_cnc"));
    process.env_remove("CNC_MACHINE").current_dir(env!("CARGO_MANIFEST_DIR"));
    let output = process.args(["report", program, "-q", "-o"]).arg(&page).output().unwrap();
    assert!(page.exists(), "{}", String::from_utf8_lossy(&output.stderr));
    page
}

/// Looks at the page through a window so wide: a frame, for a window of its own cannot be as narrow as a
/// telephone.
fn check_at(browser: &str, folder: &Path, page: &Path, width: u32, drawings: usize) {
    let measured = folder.join("measured.html");
    let text = fs::read_to_string(page).unwrap();
    let text = text.replace("</body>", MEASURE).replace('&', "&amp;").replace('"', "&quot;");
    let frame = format!(
        "<!doctype html><body><iframe width=\"{width}\" height=\"900\" style=\"border: 0\" srcdoc=\"{text}\"></iframe></body>"
    );
    fs::write(&measured, frame).unwrap();
    let output = browse(browser, folder, &["--dump-dom", "--window-size=1280,1000"], &measured);
    let dom = String::from_utf8(output.stdout).unwrap();
    let figures = dom.split("id=\"figures\"").nth(1).and_then(|rest| rest.split_once('>'));
    let figures = figures.and_then(|(_, rest)| rest.split_once('<')).expect("figures").0;
    let seen: Value = serde_json::from_str(figures).unwrap();
    let of = |value: &Value, name: &str| value[name].as_f64().unwrap();
    assert_eq!(of(&seen, "window"), f64::from(width));
    assert!(of(&seen, "page") <= f64::from(width), "wider than {width}: {seen}");
    let boxes = seen["drawings"].as_array().unwrap();
    assert_eq!(boxes.len(), drawings, "{seen}");
    for drawing in boxes {
        assert!(of(drawing, "width") > 200.0 && of(drawing, "height") > 100.0, "{drawing}");
        assert!(of(drawing, "left") >= 0.0, "{drawing}");
        assert!(of(drawing, "right") <= f64::from(width), "{drawing}");
    }
    assert!(of(&seen, "letters") >= LETTERS_MIN, "letters at {width}: {}", seen["letters"]);
    assert_eq!(seen["pairs"], json!([]), "words upon words at {width}");
    assert_eq!(seen["cut"], json!([]), "words beyond the edge at {width}");
    let papers = seen["papers"].as_array().unwrap();
    assert!(papers.iter().all(|paper| paper == "rgb(255, 255, 255)"), "{papers:?}");
    assert!(of(&seen, "curves") >= drawings as f64, "{seen}");
}

#[test]
fn a_report_looks_right_in_a_browser_and_prints() {
    let Some(browser) = chromium() else {
        assert!(std::env::var_os("CI").is_none(), "CI needs one of {NAMES:?}");
        writeln!(io::stderr(), "not looked at: there is none of {NAMES:?}").unwrap();
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let page = report(folder.path(), "samples/good/planes.nc");
    for width in [360, 400, 800, 1400] {
        check_at(browser, folder.path(), &page, width, 8);
    }
    let paper = folder.path().join("report.pdf");
    let print = format!("--print-to-pdf={}", paper.display());
    browse(browser, folder.path(), &[&print], &page);
    let pdf = fs::read(&paper).unwrap();
    assert!(pdf.starts_with(b"%PDF-") && pdf.len() > 20_000, "{} bytes", pdf.len());
    let bad = report(folder.path(), "samples/bad/limit-x-max.nc");
    check_at(browser, folder.path(), &bad, 400, 4);
}
