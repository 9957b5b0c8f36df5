// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tests `batwing run --until-error`: it stops at the stated error, with the same bytes on any
//! number of threads, and refuses unknown figures, errors and receivers.

use std::path::Path;

use crate::support::binary::batwing;
use crate::support::runs::contents;
use serde_json::Value;
use tempfile::tempdir;

fn run(folder: &Path, flags: &[&str]) -> (bool, String) {
    let output = batwing(folder)
        .args(["run", "d1.toml", "--model", "geometric", "--paths", "30000"])
        .args(flags)
        .output()
        .expect("it runs");
    let said = String::from_utf8(output.stderr).expect("UTF-8");
    (output.status.success(), said)
}

#[test]
fn paths_are_added_until_the_figure_is_known() {
    let folder = tempdir().expect("a folder");
    let designs = batwing_tests::workspace().join("data/designs");
    std::fs::copy(designs.join("d1.toml"), folder.path().join("d1.toml")).expect("copied");
    for (out, threads) in [("one", "1"), ("two", "2")] {
        let flags =
            ["--until-error", "extraction_efficiency=0.05%", "--out", out, "--threads", threads];
        let (good, said) = run(folder.path(), &flags);
        assert!(good, "{said}");
    }
    assert_eq!(contents(&folder.path().join("one")), contents(&folder.path().join("two")));
    let text = std::fs::read(folder.path().join("one/results.json")).expect("results.json");
    let results: Value = serde_json::from_slice(&text).expect("JSON");
    let model = &results["designs"]["D1"]["geometric_100um"];
    let error = model["extraction_efficiency"]["standard_error"].as_f64().expect("a number");
    assert!(error <= 5e-4, "{error}");
    let until = &model["until_error"];
    assert_eq!(
        (&until["figure"], &until["reached"]),
        (&"extraction_efficiency".into(), &true.into())
    );
    let batches = until["batches"].as_u64().expect("a number");
    // 64 groups of 469 paths a batch.
    assert!(batches > 1 && model["paths"].as_u64() == Some(batches * 64 * 469), "{model}");

    let (good, said) = run(
        folder.path(),
        &["--until-error", "uniformity=1e-6", "--most-paths", "70000", "--out", "few"],
    );
    assert!(
        good && said.contains("uniformity is known to") && said.contains("--most-paths"),
        "{said}"
    );

    for (flags, word) in [
        (&["--until-error", "brightness=1"][..], "expected FIGURE=ERROR"),
        (&["--until-error", "uniformity=0"], "above 0"),
        (&["--most-paths", "5000"], "--until-error"),
    ] {
        let (good, said) = run(folder.path(), flags);
        assert!(!good && said.contains(word), "{said}");
    }
    assert!(!folder.path().join("results").exists());
}

/// The only model of a run, and what it says of its stopping rule.
fn known(folder: &Path, design: &str, flags: &[&str]) -> (Value, Value) {
    let output = batwing(folder)
        .args(["run", design, "--model", "geometric", "--paths", "20000", "--out", "out"])
        .args(flags)
        .output()
        .expect("it runs");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    of_results(folder, "out")
}

/// The last model of the results in a folder, and what it says of its stopping rule.
fn of_results(folder: &Path, out: &str) -> (Value, Value) {
    let text = std::fs::read(folder.join(out).join("results.json")).expect("results.json");
    let results: Value = serde_json::from_slice(&text).expect("JSON");
    let designs = results["designs"].as_object().expect("designs").values();
    let models = designs.flat_map(|d| d.as_object().expect("models").values().cloned());
    let model = models.last().expect("a model");
    let until = model["until_error"].clone();
    (model, until)
}

#[test]
#[ignore = "slow: 6 s"]
fn the_light_of_a_spectrum_is_traced_until_a_figure_is_known() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let white = batwing_tests::workspace().join("data/designs/d1-white.toml");
    let white = std::fs::read_to_string(white).expect("the design");
    // Random paths, which need more than one batch.
    let white = white.replacen("sampling = \"sobol\"", "sampling = \"random\"", 1);
    // A layer on the dome makes wavelengths differ; three of them.
    let coated = white
        .replacen(
            "width_mm = 3.4",
            "width_mm = 3.4\ncoating = [{ index = 1.2, thickness_nm = 110.0 }]",
            1,
        )
        .replacen("[light.spectrum]", "[light.spectrum]\nsamples = 3", 1);
    let coated: Vec<&str> = coated.lines().filter(|l| !l.starts_with("tolerance")).collect();
    std::fs::write(at.join("white.toml"), white).expect("written");
    std::fs::write(at.join("coated.toml"), coated.join("\n")).expect("written");
    for design in ["white.toml", "coated.toml"] {
        let (model, until) = known(at, design, &["--until-error", "extraction_efficiency=0.08%"]);
        let extraction = &model["extraction_efficiency"];
        let error = extraction["standard_error"].as_f64().expect("a number");
        let batches = until["batches"].as_u64().expect("a number");
        assert!(error > 0.0 && error <= 8e-4 && batches > 1, "{design}: {until} {extraction}");
        // Every wavelength has as many batches.
        let wavelengths = model["spectrum"]["wavelengths"].as_array().expect("a list");
        let paths = wavelengths.iter().map(|w| w["paths"].as_u64().expect("a number"));
        let (total, paths) = (model["paths"].as_u64(), paths.collect::<Vec<_>>());
        assert_eq!(total, Some(paths.iter().sum()), "{design}");
        assert!(paths.iter().all(|p| p % (64 * batches) == 0), "{design}: {paths:?}");
        let emitted = model["power_ledger"]["emitted"]["value"].as_f64().expect("a number");
        assert!((emitted - 1.0).abs() < 1e-12, "{design}: {emitted}");
        // One batch is the run without any of this.
        let (once, _) = known(at, design, &["--until-error", "extraction_efficiency=50%"]);
        let (plain, none) = known(at, design, &[]);
        assert_eq!(once["power_ledger"], plain["power_ledger"], "{design}");
        assert_eq!(none, Value::Null);
        let off =
            |model: &Value| model["extraction_efficiency"]["value"].as_f64().expect("a number");
        assert!((off(&plain) - off(&model)).abs() < 5.0 * 4e-3, "{design}");
    }
}

#[test]
fn the_flux_of_a_receiver_is_a_figure_too() {
    let folder = tempdir().expect("a folder");
    let at = folder.path();
    let design = batwing_tests::workspace().join("data/designs/d1.toml");
    let receivers = "\n[[receivers]]\nname = \"sky\"\nkind = \"far_field\"\ntheta_bin_deg = 45.0\nphi_bin_deg = 90.0\n\n[[receivers]]\nname = \"silver\"\nkind = \"surface\"\nsurface = \"ground mirror\"\n";
    let text = std::fs::read_to_string(design).expect("the design") + receivers;
    std::fs::write(at.join("d1.toml"), text).expect("written");
    let (model, until) = known(at, "d1.toml", &["--until-error", "flux.sky=0.06%"]);
    let flux = &model["receivers"]["sky"]["flux"];
    let error = flux["standard_error"].as_f64().expect("a number");
    assert!(error > 0.0 && error <= 6e-4, "{flux}");
    assert!(
        until["batches"].as_u64() > Some(1) && until["reached"] == Value::Bool(true),
        "{until}"
    );
    // A surface has several fluxes, some of which hold others.
    for name in ["ground", "silver"] {
        let (good, said) = run(at, &["--until-error", &format!("flux.{name}=1%"), "--out", "none"]);
        let known = ["flux", "mean", "min", "max", "min_to_max"].map(|key| format!("{key}.sky"));
        let of_surface = "from_inside.silver, from_inside_absorbed.silver, from_inside_passed.silver, \
                          from_outside.silver, from_outside_absorbed.silver, from_outside_passed.silver";
        let known = known.join(", ");
        let words = format!("expected one of {known}, {of_surface}, got \"flux.{name}\"");
        assert!(!good && said.contains(&words), "{said}");
    }
    assert!(!at.join("none").exists());
}

/// A run of four bare chips above a black board with receivers that little or no light reaches.
fn rare(folder: &Path, flags: &[&str]) -> (bool, String, String) {
    let design = batwing_tests::workspace().join("tests/findings/t09-rare-receiver.toml");
    std::fs::copy(design, folder.join("t09.toml")).expect("copied");
    let output = batwing(folder).args(["run", "t09.toml"]).args(flags).output().expect("it runs");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    (output.status.success(), text(output.stdout), text(output.stderr))
}

#[test]
fn a_rule_on_what_no_light_reaches_ends_at_its_bound_and_says_so() {
    let folder = tempdir().expect("a folder");
    for (figure, batches, is_reached) in [
        // Bounds of 1.5e-4 of the flux (three paths), of 0.015 W/mm², and a third of the former.
        ("flux.dark=0.1%", 1, true),
        ("mean.dark=0.1", 1, true),
        ("flux.dark=0.006%", 3, true),
        // Out of reach, which the first batch shows.
        ("flux.dark=1e-9", 1, false),
        ("absorbed_by_box_side=1e-9", 1, false),
        // A housing has no part in it: it is 0.
        ("escaped_down=1e-9", 1, true),
    ] {
        let flags = ["--paths", "20032", "--until-error", figure, "--out", "out"];
        let (good, _, said) = rare(folder.path(), &flags);
        assert!(good, "{said}");
        let is_dark = !figure.starts_with("escaped_down");
        let words = "none of 20032 paths has arrived, so it lies below";
        assert_eq!(said.matches(words).count(), usize::from(is_dark), "{said}");
        assert_eq!(said.contains("its bound cannot fall so far"), !is_reached, "{said}");
        let (model, until) = of_results(folder.path(), "out");
        assert_eq!((&until["reached"], &until["batches"]), (&is_reached.into(), &batches.into()));
        let flux = &model["receivers"]["dark"]["flux"];
        let bound = flux["upper_bound"].as_f64().expect("a bound");
        // Of 4 W.
        let paths = f64::from(batches) * 20_032.0;
        assert!((bound / (4.0 * 3.0 / paths) - 1.0).abs() < 1e-9, "{until} {flux}");
    }
}

/// Counting nothing in n paths bounds a flux by 3/n with 95 % confidence, alike in all outputs.
#[test]
fn a_receiver_that_no_path_reached_has_a_bound_everywhere() {
    let folder = tempdir().expect("a folder");
    let (good, shown, said) = rare(folder.path(), &["--paths", "20032", "--out", "out"]);
    assert!(good, "{said}");
    // Four packages of 1 W; no power but what 20 032 paths hold.
    let one_path = 4.0 / 20_032.0;
    let text = std::fs::read(folder.path().join("out/results.json")).expect("results.json");
    let results: Value = serde_json::from_slice(&text).expect("JSON");
    let dark = &results["designs"]["t01"]["geometric"]["receivers"]["dark"];
    let near = |found: &Value, expected: f64| {
        let found = found.as_f64().expect("a number");
        assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
    };
    assert_eq!(dark["flux"]["value"], 0.0);
    near(&dark["flux"]["standard_error"], one_path);
    near(&dark["flux"]["upper_bound"], 3.0 * one_path);
    // A single bin of 0.04 mm².
    near(&dark["mean"]["upper_bound"], 3.0 * one_path / 0.04);
    assert!(dark.get("min_to_max").is_none(), "{dark}");
    assert!(shown.contains("below 6.0e-4 W"), "{shown}");
    let csv = folder.path().join("out/t01/geometric/receivers/dark.csv");
    let csv = std::fs::read_to_string(csv).expect("a table");
    let row: Vec<f64> = csv
        .lines()
        .nth(1)
        .expect("a row")
        .split(',')
        .map(|c| c.parse().expect("a number"))
        .collect();
    let [.., value, error] = row[..] else { panic!("{csv}") };
    assert!(value == 0.0 && (error / (one_path / 0.04) - 1.0).abs() < 1e-9, "{csv}");
    let report = batwing(folder.path()).args(["report", "out"]).output().expect("it runs");
    assert!(report.status.success(), "{report:?}");
    let page = std::fs::read_to_string(folder.path().join("out/report.html")).expect("a page");
    let row = page.lines().find(|line| line.contains("dark, flux")).expect("a row");
    assert!(row.contains("below 6.0e-4 W"), "{row}");
}

#[test]
fn every_figure_of_the_design_may_stop_a_run() {
    let folder = tempdir().expect("a folder");
    let d1 = batwing_tests::workspace().join("data/designs/d1.toml");
    std::fs::copy(d1, folder.path().join("d1.toml")).expect("copied");
    for figure in ["absorbed_by_ground_mirror=10%", "beam_angle_deg=60"] {
        let (good, said) = run(folder.path(), &["--until-error", figure, "--out", "out"]);
        assert!(good && !said.contains("most-paths"), "{figure}: {said}");
    }
    for figure in ["intensity_peak=1", "illuminance_peak=1", "max.ff=1"] {
        let flags = ["--paths", "4096", "--until-error", figure, "--out", "out"];
        let (good, _, said) = rare(folder.path(), &flags);
        assert!(good && !said.contains("most-paths"), "{figure}: {said}");
    }
    // All light goes up: that does not vary, and is said after some batches.
    let (good, _, said) =
        rare(folder.path(), &["--paths", "4096", "--until-error", "flux_up=1e-20", "--out", "out"]);
    assert!(good && said.contains("does not vary") && said.contains("32768 paths"), "{said}");
    for (figure, words) in [
        ("absorbed_by_nothing=1%", "absorbed_by_box_side"),
        ("mean.nothing=1", "mean.dark"),
        ("extraction_efficiency=1%", "there is no dome"),
        ("peak_angle_parabola_deg=1", "far_field.peak is no bin"),
    ] {
        let (good, _, said) = rare(folder.path(), &["--until-error", figure, "--out", "none"]);
        assert!(!good && said.contains(words), "{figure}: {said}");
    }
    assert!(!folder.path().join("none").exists());
}
