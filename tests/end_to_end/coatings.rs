// SPDX-License-Identifier: MIT OR Apache-2.0
//! Thin films and polarisation, from the design file to `results.json`.

use std::path::Path;

use crate::support::binary::batwing;
use crate::support::runs::{estimate, run_text};
use serde_json::{Value, json};
use tempfile::tempdir;

const DESIGN: &str = r#"
name = "coated"
silicone = { index = 1.41 }
led = { size_mm = [1.0, 1.0], height_mm = 0.35, reflectance = 0.5, reflection = "specular" }
array = { columns = 1, rows = 1, pitch_mm = 8.3 }
receiver = { bin_mm = 0.5 }
trace = { paths = 200_000 }
"#;
const BARE: &str = "dome = { sphere_radius_mm = 2.0, height_mm = 1.0, width_mm = 3.4 }\n";
const SILVER: &str = "mirror = { kind = \"specular\", reflectance = 0.95, extent = \"array\" }\n";
const GREEN: &str = "light = { wavelength_nm = 550.0 }\n";

fn coated(layers: &str) -> String {
    BARE.replace(" }", &format!(", coating = [{layers}] }}"))
}

fn run(folder: &Path, parts: &[&str], flags: &[&str]) -> Result<Value, String> {
    let text = format!("{DESIGN}{}", parts.concat());
    let results = run_text(folder, "coated", &text, "out", flags)?;
    let models = results["designs"]["coated"].as_object().expect("models");
    Ok(models.values().next().expect("a model").clone())
}

fn extraction(model: &Value) -> (f64, f64) {
    estimate(&model["extraction_efficiency"])
}

#[test]
fn layers_are_keys_of_dome_and_mirror() {
    let directory = tempdir().expect("a folder");
    let folder = directory.path();
    let good = |parts: &[&str]| run(folder, parts, &[]).expect("results");
    let bare = extraction(&good(&[BARE, SILVER, GREEN]));

    // A quarter of 550 nm in the root of 1.41 lets more out; half a wave in any index changes
    // little near the axis, and one of the silicone's nothing.
    let quarter = coated("{ index = 1.187434, thickness_nm = 115.796 }");
    let more = extraction(&good(&[&quarter, SILVER, GREEN]));
    assert!(more.0 - bare.0 > 5.0 * more.1.hypot(bare.1), "{more:?} {bare:?}");
    let none = coated("{ index = [1.41, 0.0], thickness_nm = 77.0 }");
    let same = extraction(&good(&[&none, SILVER, GREEN]));
    assert!((same.0 - bare.0).abs() < 5.0 * same.1.hypot(bare.1), "{same:?} {bare:?}");

    // An absorbing layer takes its share, in the dome's account.
    let grey = coated("{ index = [1.41, 0.5], thickness_nm = 20.0 }");
    let absorbed = estimate(&good(&[&grey, SILVER, GREEN])["power_ledger"]["absorbed_by_dome"]).0;
    assert!(absorbed > 0.05, "{absorbed}");

    // Light that metal reflects: at a wavelength where the mirror is bare silver it keeps about 97
    // % of it.
    let metal =
        SILVER.replace("0.95", "1.0").replace(" }", ", substrate = { index = [0.06, 3.6] } }");
    let model = good(&[BARE, &metal, GREEN]);
    let lost = estimate(&model["power_ledger"]["absorbed_by_bottom"]).0;
    let by_number = good(&[BARE, &SILVER.replace("0.95", "0.97"), GREEN]);
    let near = estimate(&by_number["power_ledger"]["absorbed_by_bottom"]).0;
    assert!((lost / near - 1.0).abs() < 0.5, "{lost} {near}");

    // Films change with the wavelength, so that light of a spectrum is traced at several.
    let white = "light = { spectrum = { kind = \"table\", wavelength_nm = [450.0, 650.0], power = [1.0, 1.0], weighting = \"radiometric\", samples = 3 } }\n";
    let model = good(&[&quarter, SILVER, white]);
    assert_eq!(model["spectrum"]["wavelengths"].as_array().map(Vec::len), Some(3));
}

#[test]
fn polarisation_is_carried_where_it_is_asked_for() {
    let directory = tempdir().expect("a folder");
    let folder = directory.path();
    let carried = GREEN.replace(" }", ", polarization = \"carried\" }");
    let plain = run(folder, &[BARE, SILVER, GREEN], &[]).expect("results");
    assert_eq!(plain.get("polarization"), None);
    let model = run(folder, &[BARE, SILVER, &carried], &["--threads", "1"]).expect("results");
    assert_eq!(model["polarization"], json!({"light": "carried", "depolarised_by": []}));
    let again = run(folder, &[BARE, SILVER, &carried], &["--threads", "2"]).expect("results");
    assert_eq!(model, again);
    // A dome sends most light straight out: what polarisation changes is less than a point.
    let (a, b) = (extraction(&plain), extraction(&model));
    assert!((a.0 - b.0).abs() < 0.01, "{a:?} {b:?}");

    let paint = SILVER.replace("specular", "lambertian");
    let model = run(folder, &[BARE, &paint, &carried], &[]).expect("results");
    assert_eq!(model["polarization"]["depolarised_by"], json!(["bottom", "ground mirror"]));
}

#[test]
fn commands_on_rings_refuse_layers_that_they_would_leave_out() {
    let directory = tempdir().expect("a folder");
    let relief = "elements = { count = 17, width_um = 100.0, shapes = [{ from = 1, to = 17, type = \"OS1\" }] }\nhybrid = { element_width_um = 10.0 }\n";
    let layer = coated("{ index = 1.3, thickness_nm = 100.0 }");
    // A coated mirror is no matter of the rings.
    let metal = SILVER.replace(" }", ", substrate = { index = [0.06, 3.6] } }");
    for (name, dome) in [("layer", layer.as_str()), ("none", BARE)] {
        let text = format!("{DESIGN}{dome}{metal}{GREEN}{relief}");
        std::fs::write(directory.path().join(format!("{name}.toml")), text).expect("written");
    }
    let no_layers = "layer.toml: dome.coating = 1 layers: expected none";
    for (command, words) in [
        (&["bsdf", "layer.toml", "--rings", "5"][..], no_layers),
        (&["converge", "layer.toml", "--ring", "5"], no_layers),
        (&["near-field", "layer.toml", "--ring", "5"], no_layers),
        (&["run", "layer.toml", "--model", "hybrid"], "bands take no thin films on the dome"),
    ] {
        let output =
            batwing(directory.path()).args(command).args(["--out", "out"]).output().expect("runs");
        let error = String::from_utf8(output.stderr).expect("UTF-8");
        assert!(!output.status.success() && !directory.path().join("out").exists());
        assert!(
            error.contains(words) && error.matches("batwing:").count() == 1,
            "{command:?}: {error}"
        );
    }
    let field = ["near-field", "none.toml", "--ring", "5", "--orders", "34", "--slices", "6"];
    let output = batwing(directory.path())
        .args(field)
        .args(["--out", "out", "--quiet"])
        .output()
        .expect("runs");
    assert!(output.status.success(), "{output:?}");
}
