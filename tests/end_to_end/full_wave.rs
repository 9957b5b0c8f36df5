// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tests `batwing full-wave`: files, the same bits on any number of threads, and its part of the page.

use std::path::Path;

use tempfile::tempdir;

use crate::support::binary::{batwing, json};
use crate::support::runs::contents;

const DESIGN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../data/designs/d1.toml");

fn compared(folder: &Path, out: &str, threads: &str) -> serde_json::Value {
    let rings = ["full-wave", DESIGN, "--rings", "2", "--ring-width-um", "2"];
    let rest = ["--paths", "2e4", "--sources", "4", "--tolerance", "1e-4", "--threads", threads];
    let arguments: Vec<&str> = rings.into_iter().chain(rest).chain(["--out", out]).collect();
    json(folder, &arguments)
}

#[test]
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

/// The models as they are stand among the variants with the distances of the comparison; the distance
/// of a reference from itself is 0.
#[test]
fn assumptions_are_separated_from_the_same_full_wave() {
    let folder = tempdir().expect("a folder");
    let rings = ["full-wave", DESIGN, "--rings", "2", "--ring-width-um", "2", "--separate"];
    let rest = ["--paths", "2e4", "--sources", "4", "--tolerance", "1e-4", "--out", "out"];
    let said = json(folder.path(), &[&rings[..], &rest].concat());
    let separated = said["separated"].as_array().expect("variants");
    let number = |variant: &str, key: &str| {
        let found = separated.iter().find(|one| one["variant"] == variant);
        found.expect("the variant")[key].as_f64().expect("a number")
    };
    assert_eq!(separated.len(), 12);
    let distances = said["comparison"]["distances"].as_array().expect("distances");
    for model in ["hybrid", "rays"] {
        let in_bins = |one: &&serde_json::Value| one["model"] == model && one["bin_deg"] == 2.5;
        let distance = distances.iter().find(in_bins).expect("the distance");
        assert_eq!(distance["rms"], number(model, "rms"), "{model}");
    }
    assert!(number("mirror_as_power", "rms_mirror_as_power").abs() < 1e-15);
    for variant in ["mirror_as_power", "rings_as_powers", "chords", "smooth_again"] {
        assert!(number(variant, "rms") > 1e-3, "{variant}");
    }
    let again = number("hybrid", "met_again");
    assert!((0.01..0.9).contains(&again), "{again}");
}

/// The part of `page` with the comparison.
fn section(page: &str) -> &str {
    let begin = page.find("<section id=\"full-wave\"").expect("the section");
    &page[begin..begin + page[begin..].find("</section>").expect("its end")]
}

/// The page of the comparison alone and beside a run: verdict, size, table, picture, what is left
/// out; an altered file is refused.
#[test]
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
            "2 rings of 2 µm, radius 4 µm, 550 nm; 4 line sources",
            "losses, films, solids and neighbours",
            "<th scope=\"col\">r.m.s. beyond noise</th>",
            "role=\"img\"",
        ] {
            assert!(part.contains(words), "no {words} in {part}");
        }
        assert_eq!(part.matches("<th scope=\"row\">").count(), 6);
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
