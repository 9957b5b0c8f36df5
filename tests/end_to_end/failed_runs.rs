// SPDX-License-Identifier: MIT OR Apache-2.0
//! Runs that fail, are stopped, or run out of paths: what remains in the folder of results.
//!
//! Source: `docs/reference/design-file.md`, `docs/reference/results-schema.md`.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use crate::support::binary::{PATH, batwing};
use crate::support::runs::run_text;
use tempfile::tempdir;

const BARE: &str = r#"
name = "lamp"
led = { size_mm = [1.0, 0.6], height_mm = 0.4, reflectance = 0.0, reflection = "absorbing" }
array = { columns = 1, rows = 1, pitch_mm = 8.0 }
receiver = { bin_mm = 0.5 }
mirror = { kind = "absorbing", reflectance = 0.0, extent = "package" }
"#;
const GREEN: &str = "light = { wavelength_nm = 550.0 }\ntrace = { paths = 64_000 }\n";

fn green() -> String {
    format!("{BARE}{GREEN}")
}

fn batwing_says(at: &Path, arguments: &[&str]) -> (bool, String) {
    let output = batwing(at).args(arguments).output().expect("it runs");
    let said = String::from_utf8(output.stderr).expect("UTF-8");
    (output.status.success(), said)
}

#[test]
fn lines_within_a_tenth_of_a_nanometre_have_columns_of_their_own() {
    let folder = tempdir().expect("a folder");
    let plate = r#"
trace = { paths = 3_000 }

[[solids]]
name = "plate"
kind = "box"
size_mm = [4.0, 4.0, 0.5]
position_mm = [0.0, 0.0, 2.0]
medium = { index = 1.5 }
coating = [{ index = 1.3, thickness_nm = 100.0 }]

[light.spectrum]
kind = "lines"
wavelength_nm = [550.00, 550.04, 600.0]
power = [1.0, 1.0, 1.0]
weighting = "radiometric"
"#;
    let text = format!("{BARE}{plate}");
    run_text(folder.path(), "lamp", &text, "r", &[]).expect("it runs to its end");
    let table = folder.path().join("r/lamp/geometric/far_field_by_wavelength.csv");
    let table = fs::read_to_string(table).expect("the table");
    let heading: Vec<&str> = table.lines().next().expect("a heading").split(',').collect();
    for column in ["550_00_nm_", "550_04_nm_", "600_0_nm_", "all_wavelengths_"] {
        let found = heading.iter().filter(|name| name.starts_with(column));
        assert_eq!(found.count(), 2, "{column} of {heading:?}");
    }
}

#[test]
fn a_run_that_fails_leaves_no_results_of_another() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    run_text(at, "lamp", &green(), "r", &[]).expect("it runs");
    let (results, model) = (at.join("r/results.json"), at.join("r/lamp/geometric"));

    // Nothing is written of a run that ends without the figure it is asked for, and what was there
    // stays as it was.
    let down = "[[sources]]\nname = \"s\"\nkind = \"cosine\"\nexponent = 1e6\nposition_mm = [0.0, 3.0, 2.0]\nnormal = [0.0, 0.0, -1.0]\n";
    let dark = format!("{}{down}", green());
    let asked = ["--until-error", "peak_angle_deg=1"];
    let said = run_text(at, "lamp", &dark, "r", &asked).expect_err("a dark far field");
    assert!(said.contains("peak_angle_deg"), "{said}");
    assert!(results.exists());

    // Of another machine, and old.
    for folder in [at.join("r"), model.clone()] {
        let left = folder.join(".far_field.npy.1-4294967295-7.partial");
        let file = fs::File::create(&left).expect("created");
        let long_ago = std::time::SystemTime::now() - Duration::from_secs(200_000);
        file.set_modified(long_ago).expect("set back");
    }
    fs::remove_file(model.join("illuminance.npy")).expect("removed");
    fs::create_dir(model.join("illuminance.npy")).expect("in the way");
    let said = run_text(at, "lamp", &green(), "r", &["--seed", "5"]).expect_err("in the way");
    assert!(said.contains("illuminance.npy"), "{said}");
    assert!(!results.exists());
    for folder in [at.join("r"), model] {
        let names = fs::read_dir(folder).expect("a folder");
        let partial = names.filter(|name| {
            let path = name.as_ref().expect("an entry").path();
            path.extension().is_some_and(|ending| ending == "partial")
        });
        assert_eq!(partial.count(), 0);
    }
}

#[test]
fn far_fields_are_exported_as_the_run_wrote_them_only() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    run_text(at, "lamp", &green(), "r", &[]).expect("it runs");
    let export = ["export", "r/lamp/geometric", "--format", "ies", "--out", "x.ies"];
    let (good, said) = batwing_says(at, &export);
    assert!(good, "{said}");
    fs::remove_file(at.join("x.ies")).expect("removed");

    let refused = |words: &str| {
        let (good, said) = batwing_says(at, &export);
        assert!(!good && said.contains(words), "{said}");
        assert!(!at.join("x.ies").exists());
    };
    let array = at.join("r/lamp/geometric/far_field.npy");
    let whole = fs::read(&array).expect("the far field");
    let mut bytes = whole.clone();
    bytes[200] ^= 1;
    fs::write(&array, bytes).expect("written");
    refused("far_field.npy` was altered after the run that wrote it");
    fs::write(&array, whole).expect("written");

    let results = at.join("r/results.json");
    let text = fs::read_to_string(&results).expect("results.json");
    fs::write(&results, text.replacen("\"seed\": 1", "\"seed\": 2", 1)).expect("written");
    refused("expected it as the run wrote it");
    fs::remove_file(&results).expect("removed");
    refused("expected `results.json` two directories above");
}

#[test]
fn no_more_paths_are_traced_than_are_allowed() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let of = |most: &str| {
        let until = ["--until-error", "centre_to_peak=1e-9", "--most-paths", most];
        run_text(at, "lamp", &green(), "r", &until)
    };
    for (most, paths, batches) in [("10000", 9984, 1), ("64000", 64_000, 1), ("130000", 128_000, 2)]
    {
        let run = of(most).expect("it runs");
        let model = &run["designs"]["lamp"]["geometric"];
        assert_eq!(model["paths"].as_u64(), Some(paths), "{most}");
        assert_eq!(model["until_error"]["batches"].as_u64(), Some(batches), "{most}");
    }
    let said = of("999").expect_err("too few");
    assert!(said.contains("--most-paths: expected a whole number from 1000"), "{said}");
}

#[test]
fn solids_that_touch_or_hold_each_other_are_taken() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let solid = |name: &str, x: f64, of: &str| {
        format!("[[solids]]\nname = {name:?}\nposition_mm = [{x:?}, 0.0, 5.0]\n{of}\n")
    };
    let (black, glass) = ("surface = { kind = \"absorbing\" }", "medium = { index = 1.5 }");
    let cube = |with: &str| format!("kind = \"box\"\nsize_mm = [2.0, 2.0, 2.0]\n{with}");
    let ball = |radius: f64| format!("kind = \"sphere\"\nradius_mm = {radius:?}\n{glass}");
    for solids in [
        [solid("a", 0.0, &cube(black)), solid("b", 2.0, &cube(black))],
        [solid("a", 0.0, &cube(black)), solid("b", 2.0, &cube(glass))],
        [solid("a", 0.0, &ball(1.0)), solid("b", 2.0, &ball(1.0))],
        [solid("a", 0.0, &ball(1.0)), solid("b", 0.3, &ball(0.5))],
    ] {
        let text = format!("{}{}", green(), solids.join(""))
            .replace("bin_mm = 0.5", "bin_mm = 0.5, plane_height_mm = 8.0");
        fs::write(at.join("two.toml"), &text).expect("written");
        let (good, said) = batwing_says(at, &["check", "two.toml"]);
        assert!(good, "{said} of {text}");
    }
}

#[test]
fn a_run_that_is_terminated_ends_as_one_that_is_interrupted() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let long = green().replace("64_000", "900_000_000_000");
    fs::write(at.join("lamp.toml"), long).expect("written");
    let mut child = Command::new(PATH)
        .args(["run", "lamp.toml", "--out", "r", "--cache", "cache"])
        .current_dir(at)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it starts");
    // Checkpoints are opened after the handler is there.
    for _ in 0..600 {
        std::thread::sleep(Duration::from_millis(50));
        if at.join("r").exists() || child.try_wait().expect("a state").is_some() {
            break;
        }
    }
    let sent = Command::new("kill").args(["-TERM", &child.id().to_string()]).status();
    assert!(sent.expect("kill runs").success());
    let output = child.wait_with_output().expect("it ends");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(143), "{said}");
    assert!(said.contains("batwing: interrupted before results.json was written"), "{said}");
}
