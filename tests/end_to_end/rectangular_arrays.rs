// SPDX-License-Identifier: MIT OR Apache-2.0
//! Arrays with two pitches, by two numbers and by a file of places: what uniformity reads, what is
//! said, what is drawn, and what is refused because it moves nothing.

use std::path::Path;

use serde_json::Value;
use tempfile::{TempDir, tempdir};

use crate::support::binary::batwing;
use crate::support::runs::{estimate, run_text};

/// Distances of columns and rows, and height of the plane above the tops of the chips, mm.
const PITCH: [f64; 2] = [12.0, 8.0];
const HEIGHT: f64 = 6.0;

/// Small Lambertian chips before a black plane.
const DESIGN: &str = r#"
name = "chips"
light = { wavelength_nm = 555.0 }
mirror = { kind = "absorbing", extent = "package" }
led = { size_mm = [0.2, 0.2], height_mm = 0.1, reflection = "absorbing", power_lm = 10.0 }
array = { ARRAY }
receiver = { plane_height_mm = 6.1, bin_mm = 0.25, smoothing_sigma_mm = 0.25 }
trace = { paths = 1_000_000 }
"#;

const GRID: &str = "columns = 3, rows = 2, pitch_mm = [12.0, 8.0]";
const FILE: &str = "positions_file = \"places.txt\", pitch_mm = 7.0";

/// Places row after row.
fn places() -> Vec<[f64; 2]> {
    let at = |k: usize| [(k % 3) as f64 * PITCH[0] - PITCH[0], (k / 3) as f64 * PITCH[1] - 4.0];
    (0..6).map(at).collect()
}

fn folder() -> TempDir {
    let folder = tempdir().expect("a folder");
    let lines: Vec<String> = places().iter().map(|[x, y]| format!("{x} {y}")).collect();
    std::fs::write(folder.path().join("places.txt"), lines.join("\n")).expect("written");
    folder
}

fn design(array: &str) -> String {
    DESIGN.replace("ARRAY", array)
}

/// Standard output of a command, or what it said where it refused.
fn said(folder: &Path, arguments: &[&str]) -> Result<String, String> {
    let output = batwing(folder).args(arguments).output().expect("it runs");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    if output.status.success() { Ok(text(output.stdout)) } else { Err(text(output.stderr)) }
}

/// Σ h²/r⁴ at a place of the plane, with the distances r from all chips.
fn light(x: f64, y: f64) -> f64 {
    let of = |[a, b]: [f64; 2]| (HEIGHT.powi(2) + (x - a).powi(2) + (y - b).powi(2)).powi(-2);
    places().into_iter().map(of).sum()
}

#[test]
fn uniformity_reads_the_wider_neighbours_of_an_array_too() {
    let folder = folder();
    let at = folder.path();
    let model = |name: &str, array: &str| {
        let results = run_text(at, name, &design(array), name, &[]).expect("runs");
        results["designs"]["chips"]["geometric"].clone()
    };
    let (grid, file) = (model("grid", GRID), model("file", FILE));
    // The darkest place lies between columns, 12 mm apart, and not between rows.
    let steps = || (0..=400).map(|k| f64::from(k) / 400.0);
    let peak = steps().map(|s| light(0.0, s * 8.0 - 4.0)).fold(0.0, f64::max);
    let columns = steps().map(|s| light(s * PITCH[0], 4.0)).fold(peak, f64::min) / peak;
    let rows = steps().map(|s| light(0.0, s * 8.0 - 4.0)).fold(peak, f64::min) / peak;
    assert!(columns < 0.7 * rows, "{columns} {rows}");
    for model in [&grid, &file] {
        let (value, error) = estimate(&model["segment_valley_to_peak"]);
        assert!((value - columns).abs() < 4.0 * error + 0.01, "{value} ± {error}, not {columns}");
        let logarithmic = 1.0 + columns.ln() / 256f64.ln();
        let (value, error) = estimate(&model["uniformity"]);
        assert!((value - logarithmic).abs() < 4.0 * error + 0.01, "{value} {logarithmic}");
        assert!(model["diagonal_valley_to_peak"].is_object(), "{model}");
    }
    // Places are the same, and so are the paths and all that is read.
    for key in ["segment_valley_to_peak", "uniformity", "uniformity_diagonal", "cell_variation"] {
        assert_eq!(grid[key], file[key], "{key}");
    }
    // The section shows the plane y = 0 of a row, with its own pitch.
    for name in ["grid", "file"] {
        let drawn = at.join(name).join("chips/geometric/package.json");
        let drawn = std::fs::read_to_string(drawn).expect("a drawing");
        let drawn: Value = serde_json::from_str(&drawn).expect("JSON");
        assert_eq!(drawn["drawing"]["pitch_mm"], 12.0, "{drawn}");
    }
}

#[test]
fn check_says_where_packages_stand_and_what_is_read() {
    let folder = folder();
    let at = folder.path();
    let receivers = "\n[[receivers]]\nname = \"axis\"\nkind = \"luminance\"\nposition_mm = [0.0, 0.0, \
                     6.1]\nsize_mm = [30.0, 20.0]\nbins = [6, 4]\ntheta_max_deg = \
                     10.0\ntheta_bin_deg = 5.0\nphi_bin_deg = 90.0\n";
    for (array, words) in [
        (GRID, "3 x 2 at 12 x 8 mm"),
        (FILE, "6 packages at the positions of places.txt, 24 x 8 mm between outermost axes"),
        (
            &format!("{GRID}, turns_deg = [0, 0, 0, 0, 0, 5]"),
            "at 12 x 8 mm, each with a turn of its own",
        ),
        (
            &format!("{GRID}, turns_deg = [0, 0, 0, 0, 0, 0], scales = [1, 1, 1, 1, 1, 1]"),
            "3 x 2 at 12 x 8 mm\n",
        ),
        (
            &format!("{GRID}, scales = [1, 1, 1, 1, 1, 1.25]"),
            "at 12 x 8 mm, packages of 1 to 1.25 times the stated size\n",
        ),
    ] {
        std::fs::write(at.join("chips.toml"), design(array) + receivers).expect("written");
        let checked = said(at, &["check", "chips.toml"]).expect("valid");
        for words in [
            words,
            "7 pairs, 8 to 12 mm apart",
            "axis: luminance within 10° of the normal, 30 x 20 mm about (0, 0, 6.1) mm, 6 x 4 bins",
        ] {
            assert!(checked.contains(words), "{words}: {checked}");
        }
    }
    for (array, words) in [
        (GRID.replace("[12.0, 8.0]", "[12.0, 8.0, 3.0]"), "a number or [x, y]"),
        (GRID.replace("[12.0, 8.0]", "[12.0, 0.1]"), "width of a package, 0.2 mm"),
        (
            format!("{GRID}, arrangement = \"hexagonal\"").replace("[12.0, 8.0]", "[0.3, 0.1]"),
            "width of a package, 0.2 mm",
        ),
        // Boxes overlap corner by corner, at a distance above their width.
        (
            format!("{GRID}, arrangement = \"hexagonal\"").replace("[12.0, 8.0]", "[0.3, 0.15]"),
            "width of a package, 0.2 mm",
        ),
        // Smaller packages stand nearer, to their own width.
        (
            format!("{GRID}, scales = [0.5, 1, 1, 1, 1, 1]").replace("[12.0, 8.0]", "[12.0, 0.09]"),
            "width of the smallest package, 0.1 mm",
        ),
        (FILE.replace("7.0", "[7.0, 7.0]"), "one number beside positions_file"),
    ] {
        std::fs::write(at.join("chips.toml"), design(&array)).expect("written");
        let refused = said(at, &["check", "chips.toml"]).expect_err(&array);
        assert!(refused.contains("array.pitch_mm") && refused.contains(words), "{refused}");
    }
}

#[test]
fn a_pitch_that_moves_no_package_is_no_variable() {
    let folder = folder();
    let at = folder.path();
    std::fs::write(at.join("chips.toml"), design(FILE)).expect("written");
    let key = "key = \"array.pitch_mm\"\n";
    let problem = format!(
        "name = \"p\"\ndesign = \"chips.toml\"\n[[variables]]\n{key}from = 5.0\nto = 7.0\n[[objective.terms]]\nfigure = \"flux_up\"\n[[stages]]\nmethod = \"random\"\nevaluations = 4\npaths = 4096\n"
    );
    let study = format!(
        "name = \"s\"\ndesigns = [\"chips.toml\"]\nmodels = [\"geometric\"]\npaths = 4096\n[[factors]]\nname = \"pitch\"\n{key}values = [5.0, 6.0]\n"
    );
    // Also where another level states the places.
    let stated = study.replace(
        "[[factors]]",
        "[base.set]\n\"array.positions_file\" = \"places.txt\"\n\n[[factors]]",
    );
    let tolerance = format!(
        "name = \"t\"\ndesign = \"chips.toml\"\nsamples = 8\npaths = 4096\nfigures = [\"flux_up\"]\n[[tolerances]]\n{key}deviation = 0.1\n"
    );
    for (command, text) in
        [("optimise", &problem), ("study", &study), ("study", &stated), ("tolerance", &tolerance)]
    {
        std::fs::write(at.join("varied.toml"), text).expect("written");
        let refused = said(at, &[command, "varied.toml", "--out", "out"]).expect_err(text);
        for words in ["array.pitch_mm", "array.positions_file", "places.txt"] {
            assert!(refused.contains(words), "{command}, {words}: {refused}");
        }
        assert!(!at.join("out").join("results.json").exists());
    }
    // A level that states both places and the least distance between them moves packages.
    let both = study.replace(
        &format!("{key}values = [5.0, 6.0]\n"),
        "[[factors.levels]]\nname = \"near\"\nset = { \"array.positions_file\" = \"places.txt\", \"array.pitch_mm\" = 6.0 }\n",
    );
    std::fs::write(at.join("varied.toml"), both).expect("written");
    said(at, &["check", "varied.toml"]).expect("valid");
}
