// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tests `batwing bsdf`: selection of rings, printed figures, cache, Ctrl-C.
//!
//! Sources: README.md and `docs/performance.md` for what the command states; the solver's bound of
//! 1e-10 on the energy balance.

use std::path::{Path, PathBuf};

use crate::support::binary::{batwing, json};
use crate::support::runs::{changed, contents, estimate, files, interrupted, partial};
use batwing_tests::bad_input::good;
use bsdf::native;
use serde_json::Value;
use tempfile::{TempDir, tempdir};

/// A folder with a design of 17 bands whose tables are coarse.
fn coarse() -> TempDir {
    let folder = tempdir().expect("a folder");
    let design = good(include_str!("../bad_input/design.toml"));
    std::fs::write(folder.path().join("coarse.toml"), design).expect("written");
    folder
}

fn tables(folder: &Path, arguments: &[&str]) -> Value {
    let output = batwing(folder)
        .args(["bsdf", "coarse.toml", "--json", "--quiet", "--tolerance", "0.05"])
        .args(arguments)
        .output()
        .expect("it runs");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    assert_eq!(stderr, "", "nothing is said beside the result");
    serde_json::from_slice(&output.stdout).expect("one JSON document")
}

fn names(folder: &Path) -> Vec<PathBuf> {
    let mut names: Vec<PathBuf> = contents(folder).into_keys().collect();
    names.sort();
    names
}

#[test]
fn every_ring_has_its_table_and_its_figures() {
    let folder = coarse();
    let at = |name: &str| folder.path().join(name);
    let first = tables(folder.path(), &["--rings", "12,5", "--out", "first"]);
    let rings = first["rings"].as_array().expect("rings");
    let numbers: Vec<u64> = rings.iter().filter_map(|r| r["ring"].as_u64()).collect();
    assert_eq!(numbers, [12, 5], "in the order asked for");
    for ring in rings {
        let number = |key: &str| ring[key].as_f64().unwrap_or_else(|| panic!("{key}: {ring}"));
        assert!(number("energy_residual") < 1e-10, "{ring}");
        assert!(number("estimated_error") <= 0.05, "{ring}");
        assert!(number("seconds") > 0.0 && ring["from_cache"] == false, "{ring}");
        // One slice of one problem takes at least 25/12 of (2N)³ multiply-adds, real ones, of which
        // four count as one.
        let kept = 2.0 * number("orders") + 1.0;
        let problems = number("kx0_points") / 4.0 * number("ky_points");
        for side in ["inner", "outer"] {
            let off = ring["between_nodes"][side].as_f64().expect("a number");
            assert!((1e-6..0.3).contains(&off), "{ring}");
        }
        let least = (2.0 * kept).powi(3) * 25.0 / 12.0 * problems * number("slices");
        assert!(number("operations") > least, "{ring}");
        let path = folder.path().join(ring["file"].as_str().expect("a file"));
        let bytes = std::fs::read(&path).expect("a table");
        assert!((number("bytes") - bytes.len() as f64).abs() < 0.5, "{ring}");
        let table = native::read(bytes.as_slice()).expect("a table");
        let header = table.header();
        assert_eq!(header.ring, ring["ring"].to_string());
        assert_eq!(header.band, ring["band"].to_string());
        assert!((table.grid().period - number("period_um")).abs() < 1e-12);
    }
    assert_eq!(rings[0]["band"], 2, "ring 12 lies in the second band");
    assert_ne!(rings[0]["period_um"], rings[1]["period_um"], "each has its own cell");

    // The second run finds them; a third without the cache computes them anew, bit for bit the
    // same.
    let again = tables(folder.path(), &["--rings", "12,5", "--out", "second"]);
    let cached = again["rings"].as_array().expect("rings");
    assert!(cached.iter().all(|r| r["from_cache"] == true), "{again}");
    let alone = tempdir().expect("a folder");
    std::fs::copy(at("coarse.toml"), alone.path().join("coarse.toml")).expect("copied");
    let anew = tables(alone.path(), &["--rings", "5", "--out", "third", "--no-cache"]);
    assert_eq!(anew["rings"][0]["from_cache"], false);
    assert!(!alone.path().join(".batwing-cache").exists());
    let [a, b] = [contents(&at("first")), contents(&at("second"))];
    assert!(a == b && a.len() == 2);
    let c = contents(&alone.path().join("third"));
    assert_eq!(c.len(), 1);
    assert!(c.iter().all(|(name, bytes)| a[name] == *bytes));
}

#[test]
fn an_interrupt_keeps_finished_rings_and_the_next_run_goes_on() {
    let folder = coarse();
    let (out, cache) = (folder.path().join("out"), folder.path().join("kept"));
    let arguments =
        ["bsdf", "coarse.toml", "--tolerance", "0.05", "--out", "out", "--cache", "kept"];
    let one_is_there =
        || files(&out).iter().any(|f| f.extension().is_some_and(|e| e == "bworders"));
    let (code, stderr) = interrupted(folder.path(), &arguments, one_is_there);
    assert_eq!(code, Some(130), "{stderr}");
    assert!(stderr.contains("interrupted"), "{stderr}");
    assert!(partial(folder.path()).is_empty());
    let finished = names(&cache);
    assert!((1..17).contains(&finished.len()), "{finished:?}");
    let first = cache.join(&finished[0]);
    let before = changed(&first);

    let ring = tables(folder.path(), &["--rings", "5", "--out", "out", "--cache", "kept"]);
    assert_eq!(ring["rings"][0]["from_cache"], true, "{ring}");
    assert_eq!(changed(&first), before);
}

#[test]
fn tables_larger_than_the_memory_allowed_are_refused_before_they_are_begun() {
    let folder = tempdir().expect("a folder");
    let design = good(include_str!("../bad_input/design.toml"));
    let mut design: toml::Table = design.parse().expect("TOML");
    let hybrid = design.entry("hybrid").or_insert(toml::Table::new().into());
    hybrid.as_table_mut().expect("a table").insert("memory_gib".to_owned(), 0.002.into());
    std::fs::write(folder.path().join("small.toml"), design.to_string()).expect("written");
    let output = batwing(folder.path())
        .args(["bsdf", "small.toml", "--rings", "5", "--tolerance", "0.05"])
        .args(["--out", "out", "--no-cache"])
        .output()
        .expect("it runs");
    assert!(!output.status.success());
    let message = String::from_utf8_lossy(&output.stderr);
    for words in ["hybrid.memory_gib", "expected at least 0.0", "got 0.002"] {
        assert!(message.contains(words), "{message}");
    }
    assert!(names(folder.path()).iter().all(|n| !n.starts_with("out")));
}

/// The film stack of a design as files of other programs, with what it does to diffuse light.
#[test]
#[ignore = "slow: 4 s"]
fn the_film_stack_becomes_a_file() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let said = json(at, &["new", "own", "--template", "backlight"]);
    let design = said["file"].as_str().unwrap_or("own.toml").to_owned();
    for format in ["klems", "zemax"] {
        let coarse = ["--incidence-step", "30", "--azimuth-step", "90", "--scatter-step", "10"];
        let films = ["bsdf", &design, "--films", "--format", format, "--paths", "64", "--out", "."];
        let said = json(at, &[&films[..], &coarse[..]].concat());
        for from in ["from_below", "from_above"] {
            let shares = said["diffuse_light"][from].as_object().expect("shares").values();
            let sum: f64 = shares.filter_map(|share| share["value"].as_f64()).sum();
            assert!((sum - 1.0).abs() < 1e-9, "{said}");
        }
        let file = said["files"][0]["file"].as_str().expect("a file");
        // Each share has its error, and all add up to the whole.
        let results = at.join("film_stack.json");
        let stack: Value =
            serde_json::from_slice(&std::fs::read(results).expect("results")).expect("JSON");
        for row in stack["over_angle"]["from_below"].as_array().expect("angles") {
            let of = |key: &str| estimate(&row[key]);
            let all = ["transmittance", "reflectance", "absorptance"].map(of);
            let sum: f64 = all.iter().map(|share| share.0).sum();
            assert!((sum - 1.0).abs() < 1e-9 && all.iter().all(|share| share.1 > 0.0), "{row}");
        }
        json(at, &["report", ".", "--out", "page.html"]);
        let page = std::fs::read_to_string(at.join("page.html")).expect("a page");
        for words in [
            "data-curve=\"reflected, from above\"",
            "over the angle of incidence",
            "Intensity of what leaves",
            &format!("at most {:.1e}", stack["largest_standard_error"].as_f64().expect("an error")),
        ] {
            assert!(page.contains(words), "{words}");
        }
        let back = json(at, &["import", file]);
        assert!(back["most_power"].as_f64().is_some_and(|most| most <= 1.0 + 1e-6), "{back}");
    }
    for (arguments, words) in [
        (
            &["--films", "--format", "step"][..],
            "--format: expected zemax, lighttools, speos, klems",
        ),
        (&["--tree-log2", "3"][..], "--tree-log2: expected it beside --films"),
        (&["--films", "--rings", "5"][..], "--rings"),
    ] {
        let output = batwing(at).args([&["bsdf", &design][..], arguments].concat()).output();
        let output = output.expect("runs");
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && text.contains(words), "{text}");
    }
}
