// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tests `batwing full-wave`: files, the same bits on any number of threads, and its part of the page.

use std::path::Path;

use tempfile::tempdir;

use crate::support::binary::{batwing, json};
use crate::support::runs::contents;

const DESIGN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../data/designs/d1.toml");

fn compared(folder: &Path, out: &str, threads: &str) -> serde_json::Value {
    json_of(folder, DESIGN, out, threads)
}

fn json_of(folder: &Path, design: &str, out: &str, threads: &str) -> serde_json::Value {
    let rings = ["full-wave", design, "--rings", "2", "--ring-width-um", "2"];
    let rest = ["--paths", "2e4", "--sources", "4", "--tolerance", "1e-4", "--threads", threads];
    let arguments: Vec<&str> = rings.into_iter().chain(rest).chain(["--out", out]).collect();
    json(folder, &arguments)
}

#[test]
#[ignore = "slow: 9 s"]
fn three_models_of_one_section_are_written_alike_on_any_number_of_threads() {
    let folder = tempdir().expect("a folder");
    let one = compared(folder.path(), "one", "1");
    let two = compared(folder.path(), "two", "2");
    assert_eq!(one, two);
    assert_eq!(contents(&folder.path().join("one")), contents(&folder.path().join("two")));
    let found = &one["comparison"];
    assert!(found["balance"].as_f64().expect("a number") < 1e-5, "{found}");
    let radius_um = found["radius_um"].as_f64().expect("a number");
    assert!((radius_um - 4.0).abs() < 1e-9, "{radius_um}");
    for far in found["far_fields"].as_array().expect("far fields") {
        let shares = far["bins"].as_array().expect("bins");
        assert_eq!(shares.len(), 360);
        let total: f64 = shares.iter().filter_map(serde_json::Value::as_f64).sum();
        assert!((total - 1.0).abs() < 1e-3, "{}: {total}", far["model"]);
    }
    let csv = std::fs::read_to_string(folder.path().join("one/far_field.csv")).expect("a table");
    assert_eq!(csv.lines().count(), 73);
}

/// Radii of corners are scaled with the rings: 2 µm do not fit rings of 2 µm, but 0.4 and 0.04 µm do, so that
/// the domes are refused for their size alone.
#[test]
fn corners_are_scaled_with_their_rings() {
    let folder = tempdir().expect("a folder");
    let text = std::fs::read_to_string(DESIGN.replace("d1", "d2")).expect("the design");
    let rounded = text.replacen("width_um = 100.0\n", "width_um = 100.0\ntip_radius_um = 2.0\n", 1);
    std::fs::write(folder.path().join("round.toml"), rounded).expect("a design");
    let said = |options: &[&str]| {
        let arguments = [&["full-wave", "round.toml", "--memory-gib", "0.001"], options].concat();
        let refused = batwing(folder.path()).args(arguments).assert().failure();
        String::from_utf8_lossy(&refused.get_output().stderr).into_owned()
    };
    for options in [&["--scale", "0.02"][..], &["--rings", "4", "--ring-width-um", "2"]] {
        let text = said(options);
        assert!(text.contains("memory: expected at most 0.001 GiB"), "{text}");
    }
}

/// A dome without relief is compared by itself, by rings of the same size or in steps of the design's,
/// and is what stands beside a dome with relief.
#[test]
#[ignore = "slow: 5 s"]
fn a_smooth_dome_is_its_own_comparison_and_the_baseline_of_others() {
    let folder = tempdir().expect("a folder");
    let text = std::fs::read_to_string(DESIGN).expect("the design");
    let [begin, end] = ["[elements]", "[silicone]"].map(|key| text.find(key).expect("the table"));
    let smooth = [&text[..begin], &text[end..]].concat();
    let hybrid = smooth.find("[hybrid]").expect("the table");
    let after = hybrid + smooth[hybrid..].find("[trace]").expect("the table");
    let smooth = [&smooth[..hybrid], &smooth[after..]].concat();
    std::fs::write(folder.path().join("smooth.toml"), smooth).expect("a design");
    let steps = compared(folder.path(), "steps", "2");
    let alone = json_of(folder.path(), "smooth.toml", "alone", "2");
    let [own, beside] = [&alone["comparison"], &steps["baseline"]];
    assert_eq!(own["unknowns"], beside["unknowns"]);
    for i in 0..3 {
        let [own, beside] =
            [own, beside].map(|dome| dome["distances"][i]["rms"].as_f64().expect("a distance"));
        assert!((own / beside - 1.0).abs() < 1e-3, "{own} and {beside}");
    }
    assert!(alone["baseline"].is_null());
    let sets = steps["places_um"].as_array().expect("sets");
    assert!(sets.len() == 12 && sets.iter().all(|set| set.as_array().map(Vec::len) == Some(2)));
    let verdict = alone["verdict"].as_str().expect("a verdict");
    assert!(verdict.ends_with("with no relief at all"), "{verdict}");
    let verdict = steps["verdict"].as_str().expect("a verdict");
    assert!(verdict.contains("baseline, the smooth dome of this size by rays"), "{verdict}");
}

/// The part of `page` with the comparison.
fn section(page: &str) -> &str {
    let begin = page.find("<section id=\"full-wave\"").expect("the section");
    &page[begin..begin + page[begin..].find("</section>").expect("its end")]
}

/// The page of the comparison alone and beside a run: verdict, size, table, picture, what is left
/// out; an altered file is refused.
#[test]
#[ignore = "slow: 8 s"]
fn the_page_shows_the_comparison_where_there_is_one() {
    let folder = tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    let said = compared(folder.path(), "one", "2");
    let verdict = said["verdict"].as_str().expect("a verdict");
    let page = |directory: &str| {
        json(folder.path(), &["report", directory]);
        std::fs::read_to_string(at(directory).join("report.html")).expect("a page")
    };
    let alone = page("one");
    assert!(!alone.contains("<script"));
    let run = ["run", DESIGN, "--model", "geometric", "--paths", "2000", "--out", "run"];
    json(folder.path(), &run);
    assert!(!page("run").contains("id=\"full-wave\""));
    assert_eq!(said["comparison"], compared(folder.path(), "run", "2")["comparison"]);
    let both = page("run");
    let outcome = format!("<p class=\"outcome\">{verdict}.</p>");
    for part in [section(&alone), section(&both)] {
        for words in [
            outcome.as_str(),
            "2 rings of 2 µm, radius 4 µm, 550 nm; 24 line sources",
            "losses, films, solids and neighbours",
            "<th scope=\"col\">r.m.s. beyond noise</th>",
            "role=\"img\"",
        ] {
            assert!(part.contains(words), "no {words} in {part}");
        }
        assert_eq!(part.matches("<th scope=\"row\">").count(), 9);
    }
    assert!(both.contains("<a href=\"#full-wave\">"));
    let table = at("one/far_field.csv");
    let text = std::fs::read_to_string(&table).expect("readable");
    std::fs::write(&table, text + "\n").expect("written");
    let output = batwing(folder.path()).args(["report", "one"]).output().expect("it runs");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success());
    assert!(stderr.contains("far_field.csv` was altered after the run"), "{stderr}");
}
