// SPDX-License-Identifier: MIT OR Apache-2.0
//! Uniformity of maps with few paths, and of points that see one place of the pitch.

use std::path::Path;

use serde_json::Value;
use tempfile::tempdir;

use crate::support::binary::batwing;
use crate::support::runs::{estimate, results};

const FINDINGS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/findings");

/// Results of the only model of `design`, traced with `flags`.
fn traced(design: &str, flags: &[&str]) -> Value {
    traced_file(&Path::new(FINDINGS).join(format!("{design}.toml")), flags)
}

fn traced_file(file: &Path, flags: &[&str]) -> Value {
    let folder = tempdir().expect("a folder");
    let output = batwing(folder.path())
        .arg("run")
        .arg(file)
        .args(["--out", "out", "--quiet"])
        .args(flags)
        .output()
        .expect("it runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let all = results(&folder.path().join("out"));
    let designs = all["designs"].as_object().expect("designs");
    let (_, models) = designs.iter().next().expect("a design");
    models.as_object().and_then(|models| models.values().next()).expect("a model").clone()
}

/// Sums of Lambertian sources: min/mean 0.8008 and valley/peak 0.5995 over the cell of four chips;
/// 0.549 and 0.340 over that of six boxes.
#[test]
fn errors_of_few_paths_cover_the_closed_form() {
    for (design, seed, truths) in [
        ("t01-lambert-array", "1", [("cell_min_to_mean", 0.8008), ("cell_valley_to_peak", 0.5995)]),
        ("sparse-array", "1001", [("cell_min_to_mean", 0.549), ("cell_valley_to_peak", 0.34)]),
    ] {
        let model = traced(design, &["--paths", "20000", "--seed", seed]);
        for (key, truth) in truths {
            let (value, error) = estimate(&model[key]);
            assert!(error > 0.0, "{design} {key}");
            assert!((value - truth).abs() < 3.0 * error, "{design} {key}: {value} ± {error}");
        }
    }
}

#[test]
fn points_that_see_one_place_of_the_pitch_are_read_over_all() {
    let model = traced("array-3030", &["--paths", "50000"]);
    // Four packages along an edge: the points of three pitches lie in the middle of each.
    let [(nine, error), (cell, _)] =
        ["cell_nine_points", "cell_valley_to_peak"].map(|key| estimate(&model[key]));
    assert!((nine - 0.31).abs() < 0.05 + 3.0 * error, "{nine} ± {error}");
    assert!((nine - cell).abs() < 0.05 + 3.0 * error, "{nine} {cell}");
}

#[test]
#[ignore = "slow: 4 s"]
fn uniformity_of_a_stated_area_is_read_by_spots() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    std::fs::copy(Path::new(FINDINGS).join("cup.stl"), at.join("cup.stl")).expect("copied");
    let text = std::fs::read_to_string(Path::new(FINDINGS).join("array-3030.toml")).expect("text");
    let with = |keys: &str| {
        let text = text.replace("[receiver]\n", &format!("[receiver]\n{keys}\n"));
        let file = at.join("area.toml");
        std::fs::write(&file, text).expect("written");
        traced_file(&file, &["--paths", "50000"])
    };
    // The cell, whose points lie between packages alone; then the whole board, whose do not.
    let cell = with("area_mm = [30.0, 30.0]");
    for form in ["nine_points", "valley_to_peak", "min_to_mean", "variation"] {
        assert_eq!(cell[format!("area_{form}")], cell[format!("cell_{form}")], "{form}");
    }
    let output = batwing(at).args(["check", "area.toml"]).output().expect("it runs");
    let told = String::from_utf8_lossy(&output.stdout);
    let words = "the area of 30 x 30 mm, at one place of the pitch, so each is read at 12 places";
    assert!(told.contains(words), "{told}");
    // Spots of half a pitch see less than points do.
    let board = with("area_mm = [36.0, 36.0]\nspot_mm = 5.0");
    let [(points, _), (lowest, error)] =
        ["area_nine_points", "area_valley_to_peak"].map(|key| estimate(&board[key]));
    assert!(points > lowest + 3.0 * error, "{points} {lowest} ± {error}");
    let (of_cell, _) = estimate(&board["cell_nine_points"]);
    assert!(of_cell > estimate(&cell["cell_nine_points"]).0, "{of_cell}");
}
