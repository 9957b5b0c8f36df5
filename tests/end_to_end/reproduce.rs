// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tests `batwing reproduce` and `batwing run`: results, reproducibility, cache, Ctrl-C.
//!
//! The same seed gives the same bytes on any number of threads.
//! Source: `docs/reference/results-schema.md`.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use crate::support::binary::batwing;
use crate::support::runs::{
    MODELS, changed, check_files, check_model, contents, estimate, files, interrupted, partial,
    results, run_small, small,
};
use bsdf::native;
use serde_json::Value;
use tempfile::tempdir;

#[test]
#[ignore = "slow: 5 s"]
fn same_seed_gives_the_same_bytes_on_any_number_of_threads() {
    let folder = small();
    let at = |name: &str| folder.path().join(name);
    let (first, _) =
        run_small(folder.path(), "one/out", &["--threads", "1", "--seed", "5", "--json"]);
    run_small(folder.path(), "two/out", &["--threads", "2", "--seed", "5"]);
    let (one, two) = (contents(&at("one/out")), contents(&at("two/out")));
    assert!(one.keys().eq(two.keys()));
    assert!(
        one.keys().filter(|p| p.extension().is_some_and(|e| e == "exr")).count() >= 8,
        "{:?}",
        one.keys()
    );
    for (path, bytes) in &one {
        assert!(*bytes == two[path], "{} differs", path.display());
    }
    // Tables were solved anew in both, by one thread and by two.
    let caches = [contents(&at("one/.batwing-cache")), contents(&at("two/.batwing-cache"))];
    assert!(!caches[0].is_empty() && caches[0] == caches[1]);
    assert_eq!(
        first,
        String::from_utf8_lossy(&one[Path::new("results.json")]),
        "--json prints results.json"
    );

    let json = results(&at("one/out"));
    check_files(&at("one/out"), &json);
    let models = json["designs"]["small"].as_object().expect("models");
    assert!(MODELS.iter().all(|m| models.contains_key(*m)), "{:?}", models.keys());
    for (name, model) in models {
        check_model(name, model);
    }
    // Models do not depend on one another; the seed is what the numbers depend on.
    for (out, seed) in [("one/same", "5"), ("one/other", "6")] {
        run_small(folder.path(), out, &["--model", "geometric", "--seed", seed]);
        let same =
            results(&at(out))["designs"]["small"]["geometric_100um"] == models["geometric_100um"];
        assert_eq!(same, seed == "5", "seed {seed}");
    }
}

#[test]
fn tables_are_taken_from_the_cache_and_damaged_ones_computed_anew() {
    let folder = small();
    let at = |name: &str| folder.path().join(name);
    let flags = ["--model", "hybrid", "--cache", "tables"];
    run_small(folder.path(), "first", &flags);
    let tables = files(&at("tables"));
    assert_eq!(tables.len(), 2, "{tables:?}");
    let times: Vec<SystemTime> = tables.iter().map(|t| changed(t)).collect();
    run_small(folder.path(), "second", &flags);
    assert!(
        tables.iter().zip(&times).all(|(t, time)| changed(t) == *time),
        "tables were written again"
    );
    assert_eq!(contents(&at("first")), contents(&at("second")));

    let [whole, other] = [0, 1].map(|k| std::fs::read(&tables[k]).expect("readable"));
    let name = tables[0].file_name().expect("a name").to_string_lossy().into_owned();
    for (out, bytes, why) in [
        ("third", &whole[..whole.len() / 2], "truncated"),
        ("fourth", &other[..], "expected the table of this key"),
    ] {
        std::fs::write(&tables[0], bytes).expect("written");
        let (_, warnings) = run_small(folder.path(), out, &flags);
        for word in ["warning", why, &name] {
            assert!(warnings.contains(word), "no `{word}` in: {warnings}");
        }
        assert!(std::fs::read(&tables[0]).expect("readable") == whole, "the table is whole again");
        assert_eq!(contents(&at("first")), contents(&at(out)));
    }
}

#[test]
fn ctrl_c_stops_a_trace_and_leaves_nothing() {
    let folder = small();
    let out = folder.path().join("out");
    let arguments =
        ["run", "small.toml", "--model", "geometric", "--paths", "2000000000", "--out", "out"];
    let (code, stderr) = interrupted(folder.path(), &arguments, || out.exists());
    assert_eq!(code, Some(130), "{stderr}");
    assert_eq!(
        stderr,
        "batwing: interrupted before results.json was written; finished groups of paths stay in `./.batwing-cache`, a new run goes on from there\n"
    );
    assert!(files(&out).is_empty(), "{:?}", files(&out));
    assert!(partial(&folder.path().join(".batwing-cache")).is_empty());
}

#[test]
fn ctrl_c_stops_the_writing_of_files() {
    let folder = small();
    let path = folder.path().join("small.toml");
    let design = std::fs::read_to_string(&path).expect("readable");
    // So many bins that files and pictures take seconds.
    let fine = "\n[far_field]\nbin_deg = 0.5\nazimuth_bin_deg = 1.0\n[receiver]\nbin_mm = 0.025\n";
    std::fs::write(&path, design + fine).expect("written");
    let out = folder.path().join("out");
    let arguments = ["run", "small.toml", "--paths", "1024", "--model", "geometric"];
    let arguments = [&arguments[..], &["--out", "out"]].concat();
    let first = out.join("small/geometric_100um/far_field.exr");
    let (code, stderr) = interrupted(folder.path(), &arguments, || first.exists());
    assert_eq!(code, Some(130), "{stderr}");
    assert_eq!(stderr, "batwing: interrupted before results.json was written\n");
    assert!(!out.join("results.json").exists());
    assert!(partial(&out).is_empty(), "{:?}", partial(&out));
}

#[test]
fn ctrl_c_stops_a_grating_with_one_line() {
    // Stairs of metal, which no affordable number of slices resolves: the search takes half a
    // minute.
    let case = r#"{"wavelength": 0.633, "period": 1.0, "n_top": [1, 0], "n_bottom": [0.22, 6.71], "theta_deg": 20, "phi_deg": 30, "pol": "p", "tolerance": 1e-3,
        "relief": {"depth": 0.5, "background": [1, 0], "polygons": [{"n": [0.22, 6.71], "points": [[0, 0.5], [1, 0.5], [0.7, 0]]}]}}"#;
    let folder = tempdir().expect("a folder");
    std::fs::write(folder.path().join("metal.json"), case).expect("written");
    let begin = Instant::now();
    let started = || begin.elapsed() > Duration::from_secs(2);
    let (code, stderr) = interrupted(folder.path(), &["grating", "metal.json"], started);
    assert_eq!(code, Some(130), "{stderr}");
    // The time that goes on may stand before.
    let said: Vec<&str> = stderr.lines().filter(|line| !line.starts_with("metal.json: ")).collect();
    assert_eq!(said, ["batwing: interrupted"]);
}

#[test]
#[ignore = "nightly: a whole quick reproduction (30 s)"]
fn nightly_reproduce_goes_on_after_ctrl_c_and_writes_what_it_must() {
    let folder = tempdir().expect("a folder");
    let (out, cache) = (folder.path().join("out"), folder.path().join("tables"));
    let arguments = ["reproduce", "--quick", "--out", "out", "--cache", "tables"];
    let whole = |folder: &Path| -> Vec<PathBuf> {
        files(folder)
            .into_iter()
            .filter(|p| p.extension().is_some_and(|e| e == "bworders"))
            .collect()
    };
    let (code, stderr) = interrupted(folder.path(), &arguments, || !whole(&cache).is_empty());
    assert_eq!(code, Some(130), "{stderr}");
    assert!(
        stderr.ends_with("batwing: interrupted before results.json was written; finished tables stay in `tables`, a new run goes on from there\n"),
        "{stderr}"
    );
    assert!(!out.join("results.json").exists());
    assert!(partial(folder.path()).is_empty(), "{:?}", partial(folder.path()));
    let kept: Vec<(PathBuf, SystemTime)> =
        whole(&cache).into_iter().map(|p| (p.clone(), changed(&p))).collect();
    assert!(!kept.is_empty() && kept.len() < 20, "{} tables before the end", kept.len());
    for (table, _) in &kept {
        native::read(std::fs::File::open(table).expect("a file"))
            .unwrap_or_else(|e| panic!("{}: {e}", table.display()));
    }

    let output = batwing(folder.path()).args(arguments).output().expect("it runs");
    let (stdout, stderr) =
        (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{stderr}");
    assert!(kept.iter().all(|(table, time)| changed(table) == *time), "finished tables were used");
    assert!(partial(folder.path()).is_empty(), "{:?}", partial(folder.path()));
    // It says that it was quick, on the terminal and in the file.
    let json = results(&out);
    assert_eq!(json["quick"], Value::Bool(true));
    let note = json["quick_note"].as_str().expect("a note");
    assert!(stdout.contains(note), "{stdout}");
    for words in ["Published", "Computed", "Difference", "±"] {
        assert!(stdout.contains(words), "no {words} in: {stdout}");
    }
    check_reproduction(&out, &json);
}

/// The designs, references and figures of a reproduction, with their files.
fn check_reproduction(out: &Path, json: &Value) {
    check_files(out, json);
    for name in ["D1", "D2", "D3"] {
        let design = &json["designs"][name];
        for model in MODELS {
            let label = format!("{name} {model}");
            check_model(&label, &design[model]);
            // The peak is the middle of a bin; where it lies between bins has an error.
            let (between, error) = estimate(&design[model]["peak_angle_parabola_deg"]);
            assert!(error > 0.0 && (0.0..90.0).contains(&between), "{label}");
            let (extraction, error) = estimate(&design[model]["extraction_efficiency"]);
            let low = if model.starts_with("hybrid") { 0.91 } else { 0.94 };
            assert!(
                extraction > low - 3.0 * error && extraction < 0.97 + 3.0 * error,
                "{label}: extraction {extraction}"
            );
            for file in [
                "far_field.exr",
                "far_field.npy",
                "far_field.csv",
                "far_field.png",
                "far_field_polar.png",
                "illuminance.exr",
                "illuminance.npy",
                "illuminance.png",
                "illuminance_cross_section.csv",
                "illuminance_cross_section.png",
                "package.json",
            ] {
                let path = out.join(name).join(model).join(file);
                assert!(
                    std::fs::metadata(&path).is_ok_and(|m| m.len() > 100),
                    "{}",
                    path.display()
                );
            }
        }
        let published = &design["geometric_100um"]["uniformity"]["published"];
        assert!(published.as_f64().is_some_and(|u| (0.7..0.9).contains(&u)), "{name}: {published}");
    }
    for name in ["bare-dome", "commercial-7p5"] {
        assert!(json["references"][name]["geometric"]["uniformity"]["value"].is_number(), "{name}");
    }
    for figure in ["figure_3", "figure_4", "figure_6"] {
        assert!(json["figures"][figure].is_object(), "{figure}");
        assert!(out.join("figures").join(format!("{figure}.png")).exists(), "{figure}");
    }
}
