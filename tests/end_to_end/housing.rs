// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[housing]`, from the design file to `results.json`.

use std::path::Path;

use crate::support::binary::{batwing, json};
use crate::support::runs::{estimate, run_text};
use serde_json::Value;
use tempfile::tempdir;

const DESIGN: &str = r#"
name = "boxed"
dome = { sphere_radius_mm = 2.0, height_mm = 1.0, width_mm = 3.4 }
silicone = { index = 1.41 }
mirror = { kind = "specular", reflectance = 1.0, extent = "array" }
led = { size_mm = [1.0, 1.0], height_mm = 0.35, reflectance = 1.0, reflection = "specular" }
array = { columns = 2, rows = 2, pitch_mm = 8.3 }
light = { wavelength_nm = 550.0 }
receiver = { bin_mm = 0.5 }
trace = { paths = 100_000 }
"#;

fn run(folder: &Path, housing: &str) -> Result<Value, String> {
    let results = run_text(folder, "boxed", &format!("{DESIGN}{housing}"), "out", &[])?;
    Ok(results["designs"]["boxed"]["geometric"].clone())
}

fn account(model: &Value, name: &str) -> f64 {
    estimate(&model["power_ledger"][name]).0
}

#[test]
fn walls_are_keys_of_the_design() {
    let folder = tempdir().expect("a folder");
    let walls =
        "housing = { distance_mm = 4.0, height_mm = 6.0, kind = \"specular\", reflectance = 1.0";

    // Nothing absorbs but what lies outside, and nothing comes there.
    let perfect = format!("{walls}, floor = {{ kind = \"lambertian\", reflectance = 1.0 }} }}\n");
    let model = run(folder.path(), &perfect).expect("results");
    assert!((account(&model, "escaped_up") - 1.0).abs() < 1e-9);

    // Without the key of the floor it is black. Farther walls leave more of it.
    let model = run(folder.path(), &format!("{walls} }}\n")).expect("results");
    let near = account(&model, "absorbed_by_housing_floor");
    let far = walls.replace("4.0", "6.0");
    let model = run(folder.path(), &format!("{far} }}\n")).expect("results");
    assert!(near > 0.0 && account(&model, "absorbed_by_housing_floor") > 1.2 * near);

    for (housing, said) in [
        (
            walls.replace("4.0", "0.0"),
            "boxed.toml: housing.distance_mm = 0: expected a length from 1e-6 to 10000 mm",
        ),
        (
            walls.replace("6.0", "-1.0"),
            "boxed.toml: housing.height_mm = -1: expected a number from 0.001 to 10000",
        ),
        (
            walls.replace("1.0", "1.5"),
            "boxed.toml: housing.reflectance = 1.5: expected a number from 0 to 1",
        ),
        (format!("{walls}, roof = 1"), "housing.roof: no such key for \"specular\""),
        (
            format!("{walls}, floor = {{ kind = \"lambertian\", reflectance = 2 }}"),
            "housing.floor.reflectance = 2: expected a number from 0 to 1",
        ),
    ] {
        let error = run(folder.path(), &format!("{housing} }}\n")).expect_err("refused");
        assert!(error.contains(said), "{error}");
    }
}

#[test]
fn mixed_reflectors_lie_between_the_pure_kinds() {
    let folder = tempdir().expect("a folder");
    let kinds = |law: &str| {
        DESIGN
            .replace("reflectance = 1.0", "reflectance = 0.9")
            .replace("kind = \"specular\"", &format!("kind = {law}"))
            .replace("reflection = \"specular\"", &format!("reflection = {law}"))
    };
    let walls = |law: &str| {
        format!(
            "housing = {{ distance_mm = 4.0, height_mm = 6.0, reflectance = 0.8, kind = {law}, floor = {{ reflectance = 0.7, kind = {law} }} }}\n"
        )
    };
    let results = |law: &str, flags: &[&str]| {
        let text = kinds(law) + &walls(law);
        let results = run_text(folder.path(), "boxed", &text, "out", flags).expect("results");
        results["designs"]["boxed"]["geometric"].clone()
    };
    let mixed = |fraction: &str| format!("\"mixed\", specular_fraction = {fraction}");

    // Of one part they are the pure kinds, in every figure.
    for (fraction, pure) in [("1.0", "\"specular\""), ("0.0", "\"lambertian\"")] {
        let (a, b) = (results(&mixed(fraction), &[]), results(pure, &[]));
        assert_eq!(a["power_ledger"], b["power_ledger"], "{pure}");
        assert_eq!(a["uniformity"], b["uniformity"], "{pure}");
    }

    // What the walls absorb of a half of each lies between what they absorb of either.
    let wall = |law: &str| estimate(&results(law, &[])["power_ledger"]["absorbed_by_wall"]);
    let (mirror, half, matt) = (wall("\"specular\""), wall(&mixed("0.5")), wall("\"lambertian\""));
    let between = (half.0 - mirror.0) * (matt.0 - half.0);
    assert!(
        between > 0.0 && (matt.0 - mirror.0).abs() > 10.0 * mirror.1.hypot(matt.1),
        "{mirror:?} {half:?} {matt:?}"
    );

    // One thread or two, and what `check` and `rays` say of it.
    let (one, two) = (["--threads", "1"], ["--threads", "2"]);
    let law = mixed("0.3");
    assert_eq!(results(&law, &one), results(&law, &two));
    let said = batwing(folder.path()).args(["check", "boxed.toml"]).output().expect("runs");
    let said = String::from_utf8(said.stdout).expect("UTF-8");
    assert!(
        said.contains("mirror      reflectance 0.9, of which 30 % specular, the rest Lambertian"),
        "{said}"
    );
    let rays = json(folder.path(), &["rays", "boxed.toml", "--count", "200"]);
    assert!(rays.is_object(), "{rays}");
}
