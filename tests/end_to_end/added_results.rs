// SPDX-License-Identifier: MIT OR Apache-2.0
//! Several runs in one directory: results add up.

use std::path::Path;

use serde_json::Value;
use tempfile::tempdir;

use crate::support::binary::batwing;
use crate::support::runs::check_files;

const DESIGN: &str = r#"
name = "first"
dome = { sphere_radius_mm = 2.0, height_mm = 1.0, width_mm = 3.4 }
elements = { count = 2, width_um = 100.0, shapes = [{ from = 1, to = 2, type = "OS1" }] }
silicone = { index = 1.41 }
mirror = { kind = "specular", reflectance = 0.95, extent = "array" }
led = { size_mm = [1.0, 1.0], height_mm = 0.35, reflectance = 0.8, reflection = "specular" }
array = { columns = 1, rows = 1, pitch_mm = 8.3 }
light = { wavelength_nm = 550.0 }
receiver = { bin_mm = 0.5 }
hybrid = { element_width_um = 10.0 }
trace = { paths = 20_000 }
"#;

fn run(at: &Path, file: &str, flags: &[&str]) -> String {
    let arguments = ["run", file, "--out", "out", "--model"];
    let output = batwing(at).args(arguments).args(flags).output().expect("it runs");
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{error}");
    error
}

fn unchecked(at: &Path) -> Value {
    let text = std::fs::read(at.join("out/results.json")).expect("results");
    serde_json::from_slice(&text).expect("JSON")
}

fn results(at: &Path) -> Value {
    let results = unchecked(at);
    check_files(&at.join("out"), &results);
    results
}

fn keys(value: &Value) -> Vec<&str> {
    value.as_object().expect("an object").keys().map(String::as_str).collect()
}

#[test]
fn a_second_run_adds_to_the_results_of_the_first() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    std::fs::write(at.join("first.toml"), DESIGN).expect("written");
    let second = DESIGN.replace("\"first\"", "\"second\"");
    std::fs::write(at.join("second.toml"), second).expect("written");
    run(at, "first.toml", &["geometric", "--seed", "5"]);
    let alone = results(at);
    run(at, "second.toml", &["geometric"]);
    let said = run(at, "first.toml", &["fine"]);
    assert!(said.contains("keeps first/geometric_100um, second/geometric_100um"), "{said}");
    let all = results(at);
    assert_eq!(keys(&all["designs"]), ["first", "second"]);
    assert_eq!(keys(&all["designs"]["first"]), ["geometric_100um", "geometric_10um"]);
    // As it was, with its own seed.
    let kept = &all["designs"]["first"]["geometric_100um"];
    assert_eq!(kept["power_ledger"], alone["designs"]["first"]["geometric_100um"]["power_ledger"]);
    assert_eq!((&kept["seed"], &all["seed"]), (&5.into(), &1.into()));
    assert_eq!(all["inputs"].as_array().map(Vec::len), Some(2));
    let report =
        batwing(at).args(["report", "out", "--out", "page.html"]).output().expect("it runs");
    assert!(report.status.success(), "{}", String::from_utf8_lossy(&report.stderr));
    // The same design and model is replaced.
    run(at, "first.toml", &["geometric", "--paths", "10000"]);
    let again = results(at);
    let model = &again["designs"]["first"]["geometric_100um"];
    assert_eq!((model["paths"].as_u64(), model.get("seed")), (Some(10_048), None));
    assert_eq!(keys(&again["designs"]), ["first", "second"]);
    // Models of another content of the design are no longer beside it, and it is said.
    let other = DESIGN.replace("index = 1.41", "index = 1.45");
    std::fs::write(at.join("first.toml"), other).expect("written");
    let said = run(at, "first.toml", &["geometric"]);
    let left = "no longer lists first/geometric_10um, of another content of the design";
    assert!(said.contains(left), "{said}");
    // Files of the model that is left out stay, unlisted.
    assert!(at.join("out/first/geometric_10um/far_field.csv").is_file());
    let changed = unchecked(at);
    assert_eq!(keys(&changed["designs"]["first"]), ["geometric_100um"]);
    assert_eq!(keys(&changed["designs"]), ["first", "second"]);
    // What was altered is replaced and not added to.
    let path = at.join("out/results.json");
    let text =
        std::fs::read_to_string(&path).expect("results").replace("\"paths\": 20", "\"paths\": 21");
    std::fs::write(&path, text).expect("written");
    let said = run(at, "first.toml", &["geometric"]);
    assert!(said.contains("is replaced, not added to"), "{said}");
    assert_eq!(keys(&unchecked(at)["designs"]), ["first"]);
}
