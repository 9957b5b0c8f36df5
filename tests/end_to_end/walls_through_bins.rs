// SPDX-License-Identifier: MIT OR Apache-2.0
//! Bins that walls cut are read as those that end at the walls: a cell of 6.5 × 7 mm in bins of 0.5 mm
//! and of 0.25 mm.

use serde_json::Value;
use tempfile::tempdir;

use crate::support::binary::batwing;
use crate::support::runs::{estimate, run_text};

/// A chip between mirrors, with a plane that reaches beyond the walls.
fn cell(bin_mm: f64) -> String {
    format!(
        r#"
name = "cell"
mirror = {{ kind = "lambertian", reflectance = 0.95, extent = "array" }}
led = {{ size_mm = [0.5, 0.5], height_mm = 0.15, reflectance = 0.85, reflection = "lambertian", power_w = 1.0 }}
array = {{ columns = 1, rows = 1, pitch_mm = [6.5, 7.0] }}
housing = {{ kind = "specular", reflectance = 1.0, height_mm = 8.0, inner_size_mm = [6.5, 7.0] }}
light = {{ wavelength_nm = 550.0 }}
receiver = {{ plane_height_mm = 3.0, bin_mm = {bin_mm}, smoothing_sigma_mm = 0.0, area_mm = [6.5, 7.0] }}
trace = {{ paths = 1_000_000 }}
"#
    )
}

#[test]
fn walls_within_bins_and_between_them_give_the_same_figures() {
    let folder = tempdir().expect("a folder");
    let run = |bin_mm: f64, out: &str| -> Value {
        let results = run_text(folder.path(), "cell", &cell(bin_mm), out, &[]).expect("it runs");
        results["designs"]["cell"]["geometric"].clone()
    };
    let (cut, whole) = (run(0.5, "cut"), run(0.25, "whole"));
    let alike = |what: &str, a: &Value, b: &Value, rounding: f64| {
        let ((a, of_a), (b, of_b)) = (estimate(a), estimate(b));
        let off = (a - b).abs();
        assert!(off < 4.0 * of_a.hypot(of_b) + rounding * b, "{what}: {a} ± {of_a}, {b} ± {of_b}");
    };
    // Wider bins smooth the map by less than a hundredth of its variation.
    alike("variation", &cut["area_variation"], &whole["area_variation"], 0.02);
    alike("min/mean", &cut["area_min_to_mean"], &whole["area_min_to_mean"], 0.02);
}

/// A film that ends within bins just below the plane: figures leave those bins out, and it is said.
#[test]
fn bins_that_the_edge_of_a_film_cuts_are_left_out_and_said() {
    let folder = tempdir().expect("a folder");
    let film = "\n[[films]]\nname = \"plate\"\nz_mm = 2.0\nthickness_mm = 0.5\nsize_mm = [5.5, 5.5]\n\
                medium = { index = 1.49 }\ntop = { kind = \"lambertian\", transmitted = 0.6, reflected = 0.4 }\n";
    let check = |bin_mm: f64| {
        let text = cell(bin_mm).replace("plane_height_mm = 3.0", "plane_height_mm = 2.6") + film;
        std::fs::write(folder.path().join("cell.toml"), text).expect("written");
        let output = batwing(folder.path()).args(["check", "cell.toml"]).output().expect("it runs");
        assert!(output.status.success());
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let said = check(0.5);
    assert!(said.contains("receiver.bin_mm: the edge of films[1] \"plate\" cuts bins"), "{said}");
    assert!(!check(0.25).contains("cuts bins"));
}
