//! `cnc report --merge`: results of many programs on one page, and `samples/ci/farm.sh`, which makes them
//! on many computers. Nothing is left out, and the order of files does not matter.

use std::fs;
use std::io::{Write, stderr};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use resvg::usvg::roxmltree::Document;
use serde_json::{Value, json};

struct Bench(tempfile::TempDir);

impl Bench {
    /// A folder with programs: two that pass, one that is refused, one whose name has to be quoted.
    fn new() -> Bench {
        let bench = Bench(tempfile::tempdir().unwrap());
        let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples");
        fs::create_dir_all(bench.path("parts/more & more")).unwrap();
        for (from, to) in [
            ("good/inches.nc", "parts/inches.nc"),
            ("good/o001.nc", "parts/o001.nc"),
            ("bad/no-feed.nc", "parts/wrong.nc"),
            ("good/o001.nc", "parts/more & more/it's a <part>.nc"),
        ] {
            fs::copy(samples.join(from), bench.path(to)).unwrap();
        }
        bench
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn run(&self, command: &mut Command) -> Output {
        let command = command.current_dir(&self.0).env_remove("CNC_MACHINE");
        command.stdin(Stdio::null()).output().unwrap()
    }

    fn cnc(&self, args: &[&str]) -> Output {
        self.run(Command::new(env!("CARGO_BIN_EXE_cnc")).args(args))
    }

    /// Writes the result of a program on a machine.
    fn result(&self, program: &str, machine: &str, file: &str) {
        let output = self.cnc(&["report", program, "--json", "-q", "-m", machine]);
        fs::write(self.path(file), output.stdout).unwrap();
    }

    /// Merges `results`, whose exit code is this; the document and the page.
    #[track_caller]
    fn merged(&self, options: &[&str], code: i32) -> (Value, String) {
        let args = ["report", "--merge", "results", "--json", "-o", "farm.html"];
        let output = self.cnc(&[&args, options].concat());
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{said}");
        let page = fs::read_to_string(self.path("farm.html")).unwrap();
        (serde_json::from_slice(&output.stdout).unwrap(), page)
    }
}

/// A page that is well-formed and needs nothing else.
#[track_caller]
fn check_page(page: &str) {
    let closed = page
        .replace("<!doctype html>", "")
        .replace("<meta charset=\"utf-8\">", "")
        .replace("initial-scale=1\">", "initial-scale=1\"/>");
    Document::parse(&closed).unwrap();
    for outside in ["<script", "<link", "src=", "@import", "url(", "http"] {
        assert!(!page.contains(outside), "{outside}");
    }
}

fn troubles(document: &Value) -> Vec<String> {
    let troubles = document["troubles"].as_array().unwrap().iter();
    troubles.map(|trouble| format!("{}: {}", trouble["name"], trouble["trouble"])).collect()
}

#[test]
fn results_come_together_in_the_order_of_their_names() {
    let bench = Bench::new();
    fs::create_dir_all(bench.path("results/of host b")).unwrap();
    bench.result("parts/o001.nc", "starmill", "results/1.json");
    bench.result("parts/inches.nc", "router", "results/2.jsonl");
    bench.result("parts/inches.nc", "starmill", "results/of host b/1.json");
    fs::write(bench.path("results/1.json.err"), "not a result, as its name says").unwrap();
    let (document, page) = bench.merged(&[], 0);
    let results = document["results"].as_array().unwrap();
    let order: Vec<String> =
        results.iter().map(|result| format!("{} {}", result["file"], result["machine"])).collect();
    let expected = [r#"inches.nc" "router""#, r#"inches.nc" "starmill""#, r#"o001.nc" "starmill""#];
    assert_eq!(order, expected.map(|end| format!("\"parts/{end}")));
    assert_eq!((&document["verdict"], &document["passed"]), (&json!("pass"), &json!(3)));
    let sum: f64 = results.iter().map(|result| result["total_seconds"].as_f64().unwrap()).sum();
    assert!((document["total_seconds"].as_f64().unwrap() - sum).abs() < 1e-5);
    assert_eq!(document["machines"].as_array().unwrap().len(), 2);
    check_page(&page);
    assert!(page.contains("All 3 programs pass"));

    // The same lines in one file, and in another order.
    let lines = ["of host b/1.json", "1.json", "2.jsonl"];
    let lines = lines.map(|name| fs::read_to_string(bench.path("results").join(name)).unwrap());
    fs::remove_dir_all(bench.path("results")).unwrap();
    fs::create_dir(bench.path("results")).unwrap();
    fs::write(bench.path("results/all.jsonl"), lines.concat()).unwrap();
    assert_eq!(bench.merged(&[], 0), (document, page));
}

#[test]
fn what_is_wrong_first_is_told_of_each_program() {
    let bench = Bench::new();
    fs::create_dir(bench.path("results")).unwrap();
    bench.result("parts/wrong.nc", "starmill", "results/a.json");
    bench.result("parts/more & more/it's a <part>.nc", "starmill", "results/b.json");
    let (document, page) = bench.merged(&[], 1);
    let wrong = &document["results"][1];
    assert_eq!(wrong["verdict"], "refused");
    assert!(wrong["first_failure"].as_str().unwrap().starts_with("line 2: this movement needs"));
    assert_eq!((&document["passed"], &document["refused"]), (&json!(1), &json!(1)));
    check_page(&page);
    assert!(page.contains("1 of 2 programs pass, 1 is refused"));
    assert!(page.contains("this movement needs a feed above zero"));
    assert!(page.contains("it&#39;s a &#60;part&#62;.nc"), "names are escaped");
}

#[test]
fn broken_and_missing_results_are_told() {
    let bench = Bench::new();
    fs::create_dir(bench.path("results")).unwrap();
    bench.result("parts/inches.nc", "starmill", "results/good.json");
    let good = fs::read_to_string(bench.path("results/good.json")).unwrap();
    for (name, text) in [
        ("a-empty.json", ""),
        ("b-cut.json", &good[..good.len() / 2]),
        ("c-other.json", r#"{"schema":1,"verdict":"pass"}"#),
        ("d-version.json", &good.replace(r#"{"schema":1"#, r#"{"schema":2"#)),
        ("e-verdict.json", &good.replace(r#""verdict":"pass""#, r#""verdict":"fail""#)),
        ("f-key.json", &good.replace(r#"{"schema""#, r#"{"more":1,"schema""#)),
        ("z-twice.json", &good),
    ] {
        fs::write(bench.path("results").join(name), text).unwrap();
    }
    fs::write(bench.path("results/a-empty.json.err"), "\nssh: host b: refused\n").unwrap();
    fs::write(bench.path("expected.txt"), "parts/o001.nc\n\nparts/inches.nc\n").unwrap();
    let (document, page) = bench.merged(&["--expected", "expected.txt"], 2);
    let told = troubles(&document);
    let expected = [
        "it is empty; its job said: ssh: host b: refused",
        "EOF while parsing",
        "missing field",
        "another version",
        "its verdict does not fit",
        "unknown field `more`",
        "has a result in results/good.json too",
        "\"parts/o001.nc\": \"it has no result\"",
    ];
    assert_eq!(told.len(), expected.len(), "{told:#?}");
    for (told, expected) in told.iter().zip(expected) {
        assert!(told.contains(expected), "{told}");
    }
    assert_eq!((&document["verdict"], &document["programs"]), (&json!("fail"), &json!(1)));
    check_page(&page);
    assert!(page.contains("7 results are broken, 1 result is missing"));

    fs::write(bench.path("expected.txt"), "parts/o001.nc").unwrap();
    fs::remove_dir_all(bench.path("results")).unwrap();
    fs::create_dir(bench.path("results")).unwrap();
    fs::write(bench.path("results/good.json"), &good).unwrap();
    let told = troubles(&bench.merged(&["--expected", "expected.txt"], 2).0);
    assert!(told[1].contains("it is not in expected.txt"), "{told:#?}");
}

#[test]
fn figures_that_no_job_has_are_told_with_their_line() {
    let bench = Bench::new();
    fs::create_dir(bench.path("results")).unwrap();
    bench.result("parts/inches.nc", "starmill", "good.json");
    let good: Value = serde_json::from_slice(&fs::read(bench.path("good.json")).unwrap()).unwrap();
    let with = |key: &str, value: Value| {
        let mut document = good.clone();
        let place = if good["job"][key].is_null() { &mut document } else { &mut document["job"] };
        place[key] = value;
        format!("{document}\n")
    };
    let lines = [
        with("total_seconds", json!(-1.0)),
        with("motion_seconds", json!(1e300)),
        with("ticks", json!(u64::MAX)),
        with("warnings", json!(u64::MAX)),
        with("max_contour_error_mm", json!(1.0)),
        format!("{good}\n"),
        with("motion_seconds", json!(1e6)),
        with("cut_mm", json!("far")),
    ];
    fs::write(bench.path("results/all.jsonl"), lines.concat()).unwrap();
    let (document, _) = bench.merged(&[], 2);
    let told = troubles(&document);
    let expected = [
        "line 1: `\\\"total_seconds\\\"` is -1",
        "line 2: `\\\"motion_seconds\\\"` is 1000000",
        "line 3: `\\\"ticks\\\"` is 18446744073709551615",
        "line 4: `\\\"warnings\\\"` is",
        "line 5: it passes, and its error is beyond its tolerance",
        "line 7: its motion takes longer than all of it",
        "at line 8 column",
    ];
    assert_eq!(told.len(), expected.len(), "{told:#?}");
    for (told, expected) in told.iter().zip(expected) {
        assert!(told.contains(expected), "{told}");
    }
    assert_eq!(document["programs"], 1, "the good one among them is taken");
}

#[test]
fn the_first_errors_of_a_program_are_told_and_the_others_counted() {
    let bench = Bench::new();
    fs::create_dir(bench.path("results")).unwrap();
    fs::write(bench.path("parts/wrong.nc"), "G0 X1 X2\n".repeat(150)).unwrap();
    bench.result("parts/wrong.nc", "starmill", "results/a.json");
    bench.result("parts/inches.nc", "starmill", "results/b.json");
    let (document, page) = bench.merged(&[], 1);
    assert_eq!(document["results"][1]["errors"], 150);
    check_page(&page);
    assert_eq!(page.matches("(repeated-word)").count(), 3);
    assert!(page.contains("and 147 more"));
    let [refused, passed] = ["bad\">refused<", "good\">pass<"].map(|cell| page.find(cell).unwrap());
    assert!(refused < passed, "what does not pass stands first");
    assert!(page.contains("without those that pass"));
}

#[test]
fn options_that_mean_nothing_are_refused() {
    let bench = Bench::new();
    fs::create_dir(bench.path("empty")).unwrap();
    for (args, says) in [
        (&["report", "--merge", "no-such"][..], "no-such"),
        (&["report", "--merge", "empty"], "there is no result"),
        (&["report", "parts/o001.nc", "--merge", "empty"], "cannot be used with"),
        (&["report", "--merge", "empty", "--feed", "constant"], "cannot be used with"),
        (&["report", "parts/o001.nc", "--expected", "list"], "cannot be used with"),
        (&["report", "--expected", "list"], "--merge"),
        (&["report", "parts/o001.nc", "--json", "-o", "-"], "name a file"),
        (&["report"], "required"),
    ] {
        let output = bench.cnc(args);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {said}");
        assert!(said.contains(says), "{args:?}: {said}");
    }
}

#[test]
fn a_document_goes_with_a_page_and_without() {
    let bench = Bench::new();
    let alone = bench.cnc(&["report", "parts/inches.nc", "--json"]).stdout;
    let both = bench.cnc(&["report", "parts/inches.nc", "--json", "-o", "page.html"]).stdout;
    assert_eq!(String::from_utf8(alone), String::from_utf8(both));
    assert!(fs::read_to_string(bench.path("page.html")).unwrap().contains("Pass: at most"));
}

/// On this computer alone, twice: two hosts that are both it.
#[test]
fn the_farm_runs_programs_through_gnu_parallel() {
    let version = Command::new("parallel").arg("--version").output();
    let is_gnu = |output: &Output| String::from_utf8_lossy(&output.stdout).contains("GNU parallel");
    if !version.is_ok_and(|output| is_gnu(&output)) {
        let _ = writeln!(stderr(), "GNU parallel is not here: samples/ci/farm.sh is not tested");
        return;
    }
    let bench = Bench::new();
    fs::write(bench.path("hosts"), "# this computer\n:\n").unwrap();
    let farm = |results: &str, options: &[&str]| {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/ci/farm.sh");
        let mut command = Command::new(script);
        command.args(["hosts", "parts/", results]).args(options);
        let output =
            bench.run(command.env("CNC", env!("CARGO_BIN_EXE_cnc")).env("HOME", bench.0.path()));
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code(), said)
    };
    let (code, said) = farm("results", &["--feed", "exact-stop"]);
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("3 of 4 programs pass, 1 is refused"), "{said}");
    let document = fs::read_to_string(bench.path("results/farm.json")).unwrap();
    let document: Value = serde_json::from_str(&document).unwrap();
    assert_eq!(document["results"][1]["file"], "parts/more & more/it's a <part>.nc");
    check_page(&fs::read_to_string(bench.path("results/farm.html")).unwrap());

    let (code, said) = farm("results", &[]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("results of two runs are not mixed"), "{said}");

    let (code, said) = farm("more", &["-m", "no such machine"]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("its job said: error: no machine profile 'no such machine'"), "{said}");
}
