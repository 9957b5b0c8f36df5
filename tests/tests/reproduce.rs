// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing reproduce` and `batwing run` from end to end: what `results.json` holds, the same bytes for the same seed on any number of
//! threads, the cache of tables, and Ctrl-C.
//!
//! Source: issue 2 ("results.json must hold", "Ctrl-C leaves no partial file"), `docs/results-schema.md`; for the ranges of
//! extraction, "Figures it must reach" of the issue.
#![cfg(unix)]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, SystemTime};

use batwing_tests::bad::toml_cases;
use batwing_tests::binary::{batwing, path};
use bsdf::format::native;
use serde_json::Value;
use tempfile::{TempDir, tempdir};

const KEYS: [&str; 4] = [
    "peak_angle_deg",
    "centre_to_peak",
    "uniformity",
    "extraction_efficiency",
];
const MODELS: [&str; 4] = [
    "geometric_100um",
    "geometric_10um",
    "control_10um",
    "hybrid_10um",
];

/// A folder with a design whose two inner elements alone carry relief: tables in a second.
fn small() -> TempDir {
    let folder = tempdir().expect("a folder");
    let (design, _) = toml_cases(include_str!("../bad/design.toml"));
    let every = "shapes = [{ from = 1, to = 17, type = \"OS1\" }]";
    let two =
        "shapes = [{ from = 1, to = 2, type = \"OS1\" }, { from = 3, to = 17, type = \"smooth\" }]";
    assert_eq!(design.matches(every).count(), 1);
    std::fs::write(
        folder.path().join("small.toml"),
        design.replace(every, two).replace("\"bad\"", "\"small\""),
    )
    .expect("written");
    folder
}

fn run_small(folder: &Path, out: &str, flags: &[&str]) -> (String, String) {
    let mut command = batwing(folder);
    command
        .args(["run", "small.toml", "--paths", "30000", "--out", out])
        .args(flags);
    let output = command.output().expect("it runs");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    let (stdout, stderr) = (text(output.stdout), text(output.stderr));
    assert!(output.status.success(), "{stderr}");
    (stdout, stderr)
}

/// All files under `folder` with their contents.
fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    files(folder)
        .into_iter()
        .map(|path| {
            (
                path.strip_prefix(folder).expect("below").to_path_buf(),
                std::fs::read(&path).expect("readable"),
            )
        })
        .collect()
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else {
        return Vec::new();
    };
    let paths = entries.map(|e| e.expect("an entry").path());
    paths
        .flat_map(|path| {
            if path.is_dir() {
                files(&path)
            } else {
                vec![path]
            }
        })
        .collect()
}

fn changed(path: &Path) -> SystemTime {
    std::fs::metadata(path)
        .and_then(|m| m.modified())
        .expect("a time")
}

fn results(out: &Path) -> Value {
    let text = std::fs::read_to_string(out.join("results.json")).expect("results");
    serde_json::from_str(&text).expect("JSON")
}

/// Value and standard error of an estimate, both finite.
fn estimate(of: &Value) -> (f64, f64) {
    let number = |key: &str| {
        of[key]
            .as_f64()
            .filter(|x| x.is_finite())
            .unwrap_or_else(|| panic!("no finite {key}: {of}"))
    };
    let (value, error) = (number("value"), number("standard_error"));
    assert!(error >= 0.0);
    (value, error)
}

/// What the issue and the schema ask of one model of one design.
fn check_model(name: &str, model: &Value) {
    for key in KEYS {
        let (value, error) = estimate(&model[key]);
        assert!(error > 0.0, "{name}: {key} without an error");
        let range = if key == "peak_angle_deg" {
            0.0..90.0
        } else {
            0.0..1.2
        };
        assert!(range.contains(&value), "{name}: {key} = {value}");
    }
    let ledger = model["power_ledger"].as_object().expect("a ledger");
    let value = |key: &str| estimate(&ledger[key]).0;
    let fates = ["escaped", "absorbed", "lost"];
    let spent: f64 = ledger
        .keys()
        .filter(|k| fates.iter().any(|f| k.starts_with(f)))
        .map(|k| value(k))
        .sum();
    assert!((value("emitted") - 1.0).abs() < 1e-12, "{name}");
    assert!(
        (spent - value("emitted")).abs() < 1e-9,
        "{name}: {spent} of the power accounted for"
    );
    let lost: f64 = ledger
        .keys()
        .filter(|k| k.starts_with("lost"))
        .map(|k| value(k))
        .sum();
    assert!(lost < 1e-3, "{name}: {lost} lost");
    let extracted = value("out_of_domes") - value("back_into_domes");
    assert!(
        (extracted - estimate(&model["extraction_efficiency"]).0).abs() < 1e-9,
        "{name}"
    );
    if name.contains("hybrid") {
        for table in model["tables"].as_array().expect("tables") {
            for key in [
                "band",
                "ring",
                "period_um",
                "depth_um",
                "orders",
                "slices",
                "estimated_error",
                "energy_residual",
            ] {
                assert!(table[key].is_number(), "{name}: {key} of {table}");
            }
            assert!(
                table["energy_residual"].as_f64().is_some_and(|r| r < 1e-10),
                "{name}: {table}"
            );
        }
    }
}

#[test]
fn same_seed_gives_the_same_bytes_on_any_number_of_threads() {
    let folder = small();
    let at = |name: &str| folder.path().join(name);
    let (first, _) = run_small(
        folder.path(),
        "one/out",
        &["--threads", "1", "--seed", "5", "--json"],
    );
    run_small(folder.path(), "two/out", &["--threads", "2", "--seed", "5"]);
    let (one, two) = (contents(&at("one/out")), contents(&at("two/out")));
    assert!(one.keys().eq(two.keys()));
    assert!(
        one.keys()
            .filter(|p| p.extension().is_some_and(|e| e == "exr"))
            .count()
            >= 8,
        "{:?}",
        one.keys()
    );
    for (path, bytes) in &one {
        assert!(*bytes == two[path], "{} differs", path.display());
    }
    // Tables were solved anew in both, by one thread and by two.
    let caches = [
        contents(&at("one/.batwing-cache")),
        contents(&at("two/.batwing-cache")),
    ];
    assert!(!caches[0].is_empty() && caches[0] == caches[1]);
    assert_eq!(
        first,
        String::from_utf8_lossy(&one[Path::new("results.json")]),
        "--json prints results.json"
    );

    let json = results(&at("one/out"));
    let models = json["designs"]["small"].as_object().expect("models");
    assert!(
        MODELS.iter().all(|m| models.contains_key(*m)),
        "{:?}",
        models.keys()
    );
    for (name, model) in models {
        check_model(name, model);
    }
    // Models do not depend on one another; the seed is what the numbers depend on.
    for (out, seed) in [("one/same", "5"), ("one/other", "6")] {
        run_small(
            folder.path(),
            out,
            &["--model", "geometric", "--seed", seed],
        );
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
        tables
            .iter()
            .zip(&times)
            .all(|(t, time)| changed(t) == *time),
        "tables were written again"
    );
    assert_eq!(contents(&at("first")), contents(&at("second")));

    let whole = std::fs::read(&tables[0]).expect("readable");
    std::fs::write(&tables[0], &whole[..whole.len() / 2]).expect("written");
    let (_, warnings) = run_small(folder.path(), "third", &flags);
    let name = tables[0]
        .file_name()
        .expect("a name")
        .to_string_lossy()
        .into_owned();
    for word in ["warning", "truncated", &name] {
        assert!(warnings.contains(word), "no `{word}` in: {warnings}");
    }
    assert!(
        std::fs::read(&tables[0]).expect("readable") == whole,
        "the table is whole again"
    );
    assert_eq!(contents(&at("first")), contents(&at("third")));
}

/// Starts `batwing`, waits until `ready`, presses Ctrl-C, and returns the exit code and standard error.
fn interrupted(
    folder: &Path,
    arguments: &[&str],
    ready: impl Fn() -> bool,
) -> (Option<i32>, String) {
    let child = Command::new(path())
        .args(arguments)
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it starts");
    let waited = (0..1200).any(|_| {
        std::thread::sleep(Duration::from_millis(50));
        ready()
    });
    let sent = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .expect("kill runs");
    let output = child.wait_with_output().expect("it ends");
    assert!(
        waited && sent.success(),
        "{arguments:?} was not ready in a minute"
    );
    (
        output.status.code(),
        String::from_utf8_lossy(&output.stderr).into_owned(),
    )
}

/// Names of files that are not whole, or hidden.
fn partial(folder: &Path) -> Vec<PathBuf> {
    let odd = |path: &PathBuf| {
        path.file_name().is_some_and(|n| {
            n.to_string_lossy().starts_with('.') || n.to_string_lossy().contains("partial")
        })
    };
    files(folder).into_iter().filter(odd).collect()
}

#[test]
fn ctrl_c_stops_a_trace_and_leaves_nothing() {
    let folder = small();
    let out = folder.path().join("out");
    let arguments = [
        "run",
        "small.toml",
        "--model",
        "geometric",
        "--paths",
        "2000000000",
        "--out",
        "out",
    ];
    let (code, stderr) = interrupted(folder.path(), &arguments, || out.exists());
    assert_eq!(code, Some(130), "{stderr}");
    assert!(files(&out).is_empty(), "{:?}", files(&out));
}

#[test]
fn reproduce_goes_on_after_ctrl_c_and_writes_what_it_must() {
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
    assert!(!out.join("results.json").exists());
    assert!(
        partial(folder.path()).is_empty(),
        "{:?}",
        partial(folder.path())
    );
    let kept: Vec<(PathBuf, SystemTime)> = whole(&cache)
        .into_iter()
        .map(|p| (p.clone(), changed(&p)))
        .collect();
    assert!(
        !kept.is_empty() && kept.len() < 20,
        "{} tables before the end",
        kept.len()
    );
    for (table, _) in &kept {
        native::read(std::fs::File::open(table).expect("a file"))
            .unwrap_or_else(|e| panic!("{}: {e}", table.display()));
    }

    let output = batwing(folder.path())
        .args(arguments)
        .output()
        .expect("it runs");
    let (stdout, stderr) = (
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr),
    );
    assert!(output.status.success(), "{stderr}");
    assert!(
        kept.iter().all(|(table, time)| changed(table) == *time),
        "finished tables were used"
    );
    assert!(
        partial(folder.path()).is_empty(),
        "{:?}",
        partial(folder.path())
    );
    // It says that it was quick, on the terminal and in the file.
    let json = results(&out);
    assert_eq!(json["quick"], Value::Bool(true));
    let note = json["quick_note"].as_str().expect("a note");
    assert!(stdout.contains(note), "{stdout}");
    for words in ["Published", "Computed", "Difference", "±"] {
        assert!(stdout.contains(words), "no {words} in: {stdout}");
    }
    for name in ["D1", "D2", "D3"] {
        let design = &json["designs"][name];
        for model in MODELS {
            let label = format!("{name} {model}");
            check_model(&label, &design[model]);
            let (extraction, error) = estimate(&design[model]["extraction_efficiency"]);
            let low = if model.starts_with("hybrid") {
                0.91
            } else {
                0.94
            };
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
        assert!(
            published.as_f64().is_some_and(|u| (0.7..0.9).contains(&u)),
            "{name}: {published}"
        );
    }
    for name in ["bare-dome", "commercial-7p5"] {
        assert!(
            json["references"][name]["geometric"]["uniformity"]["value"].is_number(),
            "{name}"
        );
    }
    for figure in ["figure_3", "figure_4", "figure_6"] {
        assert!(json["figures"][figure].is_object(), "{figure}");
        assert!(
            out.join("figures").join(format!("{figure}.png")).exists(),
            "{figure}"
        );
    }
}
