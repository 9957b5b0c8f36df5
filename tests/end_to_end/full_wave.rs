// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tests `batwing full-wave`: files, and the same bits on any number of threads.

use std::path::Path;

use tempfile::tempdir;

use crate::support::binary::json;
use crate::support::runs::contents;

const DESIGN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../data/designs/d1.toml");

fn compared(folder: &Path, out: &str, threads: &str) -> serde_json::Value {
    let rings = ["full-wave", DESIGN, "--rings", "2", "--ring-width-um", "2"];
    let rest = ["--paths", "2e4", "--sources", "4", "--nodes", "6", "--threads", threads];
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
