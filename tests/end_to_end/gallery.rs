// SPDX-License-Identifier: MIT OR Apache-2.0
//! Figures that the gallery states are those that its designs have.

use std::path::Path;

use tempfile::tempdir;

use crate::support::binary::batwing;
use crate::support::runs::{estimate, results};

/// Columns of a page of the gallery: its folder, the column of its table, the design traced, and
/// rows by label with their figures.
type Column = (&'static str, usize, &'static str, &'static [(&'static str, &'static str)]);

const PAPER: [(&str, &str); 4] = [
    ("illuminance valley/peak", "illuminance_valley_to_peak"),
    ("uniformity", "uniformity"),
    ("uniformity, diagonal", "uniformity_diagonal"),
    ("extraction efficiency", "extraction_efficiency"),
];
const DISTANCE: [(&str, &str); 4] = [
    ("illuminance valley/peak", "illuminance_valley_to_peak"),
    ("uniformity", "uniformity"),
    ("min/mean over the cell", "cell_min_to_mean"),
    ("extraction efficiency", "extraction_efficiency"),
];
const CELL: [(&str, &str); 6] = [
    ("min/mean, cell", "cell_min_to_mean"),
    ("valley/peak, cell", "cell_valley_to_peak"),
    ("coefficient of variation, cell", "cell_variation"),
    ("uniformity of the paper, segment", "uniformity"),
    ("uniformity of the paper, diagonal", "uniformity_diagonal"),
    ("extraction efficiency", "extraction_efficiency"),
];
const WIDE: [(&str, &str); 4] = [
    ("min/mean, cell", "cell_min_to_mean"),
    ("uniformity of the paper, cell", "cell_logarithmic"),
    ("coefficient of variation, cell", "cell_variation"),
    ("valley/peak between two LEDs", "illuminance_valley_to_peak"),
];
const WHOLE_ARRAY: [(&str, &str); 4] = [
    ("min/max, from the first to the last LED of the array", "cell_valley_to_peak"),
    ("min/mean, likewise", "cell_min_to_mean"),
    ("coefficient of variation, likewise", "cell_variation"),
    ("extraction efficiency", "extraction_efficiency"),
];
const FAR: [(&str, &str); 3] = [
    ("extraction efficiency", "extraction_efficiency"),
    ("illuminance valley/peak at 3 mm", "illuminance_valley_to_peak"),
    ("uniformity, diagonal", "uniformity_diagonal"),
];
const BEHIND_FILMS: [(&str, &str); 5] = [
    ("coefficient of variation", "area_variation"),
    ("valley/peak", "area_valley_to_peak"),
    ("nine points, min/max", "area_nine_points"),
    ("min/mean", "area_min_to_mean"),
    ("extraction efficiency", "extraction_efficiency"),
];
const COLUMNS: [Column; 12] = [
    ("behind-films", 2, "behind-films/before.toml", &BEHIND_FILMS),
    ("behind-films", 3, "behind-films/design.toml", &BEHIND_FILMS),
    ("d3-by-rays", 1, "../designs/d3.toml", &PAPER),
    ("d3-by-rays", 2, "d3-by-rays/design.toml", &PAPER),
    ("d3-freeform", 2, "d3-freeform/design.toml", &PAPER),
    ("half-distance", 1, "half-distance/start.toml", &DISTANCE),
    ("half-distance", 2, "half-distance/design.toml", &DISTANCE),
    ("d3-whole-cell", 2, "d3-whole-cell/design.toml", &CELL),
    ("fewer-leds", 3, "fewer-leds/design.toml", &WIDE),
    ("pitch-three-heights", 1, "pitch-three-heights/start.toml", &WHOLE_ARRAY),
    ("pitch-three-heights", 2, "pitch-three-heights/design.toml", &WHOLE_ARRAY),
    ("target-far-field", 2, "target-far-field/design.toml", &FAR),
];

/// Value and standard error of a cell of a table: `0.343 ± 0.002`, `80.7 ± 0.1 %`, `95.9 %`, or the
/// ends of a figure that is not resolved, `0.699 to 0.716`.
fn stated(cell: &str) -> (f64, f64) {
    let (text, scale) = cell.trim().strip_suffix('%').map_or((cell, 1.0), |text| (text, 0.01));
    let number = |text: &str| scale * text.trim().parse::<f64>().expect(cell);
    if let Some((low, high)) = text.split_once(" to ") {
        let (low, high) = (number(low), number(high));
        return (0.5 * (low + high), (high - low) / 12f64.sqrt());
    }
    match text.split_once('±') {
        Some((value, error)) => (number(value), number(error)),
        // The last digit is rounded.
        None => (number(text), scale * 0.01),
    }
}

#[test]
#[ignore = "nightly: ten designs by two million paths, two behind films by fewer (100 s)"]
fn nightly_pages_state_what_their_designs_have() {
    let gallery = Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/gallery");
    let folder = tempdir().expect("a folder");
    for (page, column, design, rows) in COLUMNS {
        let text = std::fs::read_to_string(gallery.join(page).join("README.md")).expect("a page");
        let cells = |label: &str| {
            let row = text.lines().find(|line| line.starts_with(&format!("| {label} |")));
            let row = row.unwrap_or_else(|| panic!("{page}: no row '{label}'"));
            row.split('|').nth(column + 1).expect("a column").trim().to_owned()
        };
        // A path meets a hundred surfaces behind films.
        let paths = if page == "behind-films" { "262144" } else { "2097152" };
        let output = batwing(folder.path())
            .arg("run")
            .arg(gallery.join(design))
            .args(["--model", "geometric", "--paths", paths, "--seed", "6"])
            .args(["--out", page, "--quiet"])
            .output()
            .expect("it runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let all = results(&folder.path().join(page));
        let designs = all["designs"].as_object().expect("designs");
        let models = designs.values().next_back().and_then(|models| models.as_object());
        let model = models.and_then(|models| models.values().next()).expect("a model");
        std::fs::remove_dir_all(folder.path().join(page)).expect("removed");
        for (label, figure) in rows {
            let (found, error) = estimate(&model[*figure]);
            let (value, of_page) = stated(&cells(label));
            let bound = 4.0 * error.hypot(of_page);
            assert!(
                (found - value).abs() < bound,
                "{page}, {label}: {value} ± {of_page} on the page, {found} ± {error} found"
            );
        }
    }
}
