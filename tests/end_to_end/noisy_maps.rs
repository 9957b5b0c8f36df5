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
    let folder = tempdir().expect("a folder");
    let file = Path::new(FINDINGS).join(format!("{design}.toml"));
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
