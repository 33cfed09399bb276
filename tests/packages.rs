//! What packages are said to hold is there, or is made by the script that is said to make it.

use std::fs;
use std::path::Path;
use std::process::Command;

use toml::Value;

const MADE: &str = "target/package-assets/";

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn manifest() -> Value {
    toml::from_str(&fs::read_to_string(root().join("Cargo.toml")).unwrap()).unwrap()
}

/// Whether some file is meant by a path with at most one `*`, in its last name.
fn is_there(folder: &Path, pattern: &str) -> bool {
    let path = folder.join(pattern);
    let name = path.file_name().unwrap().to_str().unwrap().to_owned();
    let Some((begin, end)) = name.split_once('*') else { return path.is_file() };
    let Ok(entries) = fs::read_dir(path.parent().unwrap()) else { return false };
    entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).any(|name| {
        name.len() >= begin.len() + end.len() && name.starts_with(begin) && name.ends_with(end)
    })
}

#[test]
fn every_asset_of_the_debian_package_is_there_or_made() {
    let made = tempfile::tempdir().unwrap();
    let folder = made.path().join("assets");
    let mut script = Command::new(root().join("packaging/assets.sh"));
    let script = script.arg(env!("CARGO_BIN_EXE_cnc")).arg(&folder).status().unwrap();
    assert!(script.success());
    let manifest = manifest();
    let package = &manifest["package"]["metadata"]["deb"];
    let assets = package["assets"].as_array().unwrap();
    let sources = assets.iter().map(|asset| asset[0].as_str().unwrap());
    let mut counts = [0, 0];
    for source in sources.filter(|source| *source != "target/release/cnc") {
        let is_made = source.strip_prefix(MADE);
        let is_there = match is_made {
            Some(source) => is_there(&folder, source),
            None => is_there(root(), source),
        };
        assert!(is_there, "{source}");
        counts[usize::from(is_made.is_some())] += 1;
    }
    assert!(counts[0] > 5 && counts[1] == 4, "{counts:?}");
    let script = fs::read_to_string(root().join("packaging/deb.sh")).unwrap();
    let changelog = package["changelog"].as_str().unwrap();
    assert!(script.contains(&format!("> {changelog} ")), "{changelog}");
}

#[test]
fn a_package_has_a_page_of_every_command() {
    let manifest = manifest();
    let assets = manifest["package"]["metadata"]["deb"]["assets"].as_array().unwrap();
    let pages = assets.iter().find(|asset| asset[1].as_str() == Some("usr/share/man/man1/"));
    assert_eq!(pages.unwrap()[0].as_str(), Some("target/package-assets/man/*.1.gz"));
}

#[test]
fn scripts_and_files_of_the_release_are_there() {
    let release = fs::read_to_string(root().join(".github/workflows/release.yml")).unwrap();
    let words = release.split(|c: char| c.is_whitespace() || "\"()".contains(c));
    let files: Vec<&str> = words.filter(|word| word.starts_with("packaging/")).collect();
    assert!(files.len() >= 4, "{files:?}");
    for file in files {
        assert!(root().join(file).is_file(), "{file}");
    }
    let binstall = &manifest()["package"]["metadata"]["binstall"];
    for (target, package) in binstall["overrides"].as_table().unwrap() {
        let url = package["pkg-url"].as_str().unwrap();
        let built = url.split("{ version }-").last().unwrap().trim_end_matches(".tar.gz");
        assert!(release.contains(&format!("target: {built}\n")), "{target}: {built}");
    }
}

/// `cargo install` asks for no C compiler and no C library: no crate of the command builds or looks for one.
#[test]
fn no_crate_builds_c() {
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--locked", "--offline", "--edges", "normal,build", "--prefix", "none"])
        .current_dir(root())
        .output()
        .unwrap();
    let tree = String::from_utf8(output.stdout).unwrap();
    let crates: Vec<&str> = tree.lines().filter_map(|line| line.split(' ').next()).collect();
    assert!(output.status.success() && crates.contains(&"clap"), "{tree}");
    for builder in ["cc", "cmake", "pkg-config", "bindgen", "autotools"] {
        assert!(!crates.contains(&builder), "{tree}");
    }
}
