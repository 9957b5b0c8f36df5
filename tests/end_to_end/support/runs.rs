// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a run of the binary leaves behind: its files, and the claims of
//! `docs/reference/results-schema.md` on `results.json`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, SystemTime};

use serde_json::Value;
use tempfile::{TempDir, tempdir};

use batwing_tests::bad_input::good;
use runtime::content_hash::sha256_hex;

use super::binary::{PATH, batwing};

/// Figures that every model of a design of the paper has.
pub const KEYS: [&str; 4] =
    ["peak_angle_deg", "centre_to_peak", "uniformity", "extraction_efficiency"];
/// Models of a design with relief.
pub const MODELS: [&str; 4] = ["geometric_100um", "geometric_10um", "control_10um", "hybrid_10um"];

/// Runs the design `text` of the given name in `folder`, results in its folder `out`: checked
/// `results.json`, or what the binary said against it.
///
/// # Errors
/// What the binary wrote when it refused.
///
/// # Panics
/// If it cannot be run, or files and `results.json` do not agree.
pub fn run_text(
    folder: &Path,
    name: &str,
    text: &str,
    out: &str,
    flags: &[&str],
) -> Result<Value, String> {
    let file = format!("{name}.toml");
    std::fs::write(folder.join(&file), text).expect("written");
    let output = batwing(folder)
        .args(["run", &file, "--out", out, "--quiet"])
        .args(flags)
        .output()
        .expect("it runs");
    if !output.status.success() {
        return Err(String::from_utf8(output.stderr).expect("UTF-8"));
    }
    let results = results(&folder.join(out));
    check_files(&folder.join(out), &results);
    Ok(results)
}

/// A folder with a design whose two inner elements alone carry relief: tables in a second.
///
/// # Panics
/// If it cannot be written.
pub fn small() -> TempDir {
    let folder = tempdir().expect("a folder");
    let design = good(include_str!("../../bad_input/design.toml"));
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

/// Runs the design of [`small`] with 30 000 paths into `out`; standard output and standard error.
///
/// # Panics
/// If the run fails.
pub fn run_small(folder: &Path, out: &str, flags: &[&str]) -> (String, String) {
    let mut command = batwing(folder);
    command.args(["run", "small.toml", "--paths", "30000", "--out", out]).args(flags);
    let output = command.output().expect("it runs");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    let (stdout, stderr) = (text(output.stdout), text(output.stderr));
    assert!(output.status.success(), "{stderr}");
    (stdout, stderr)
}

/// All files under `folder` with their contents.
///
/// # Panics
/// If one cannot be read.
pub fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
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

/// All files under `folder`; none if it is missing.
///
/// # Panics
/// If it cannot be read.
pub fn files(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else {
        return Vec::new();
    };
    let paths = entries.map(|e| e.expect("an entry").path());
    paths.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect()
}

/// When a file was last written.
///
/// # Panics
/// If it is not there.
pub fn changed(path: &Path) -> SystemTime {
    std::fs::metadata(path).and_then(|m| m.modified()).expect("a time")
}

/// The results in `out`.
///
/// # Panics
/// If there are none.
pub fn results(out: &Path) -> Value {
    let text = std::fs::read_to_string(out.join("results.json")).expect("results");
    serde_json::from_str(&text).expect("JSON")
}

/// Value and standard error of an estimate, both finite.
///
/// # Panics
/// If they are not.
pub fn estimate(of: &Value) -> (f64, f64) {
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

/// What the schema asks of one model of one design.
///
/// # Panics
/// If something is missing or wrong.
pub fn check_model(name: &str, model: &Value) {
    for key in KEYS {
        let (value, error) = estimate(&model[key]);
        // The middle of the largest bin is the same whichever group is left out, unless two bins
        // are nearly as large.
        let may_be_exact = key == "peak_angle_deg";
        assert!(error > 0.0 || may_be_exact, "{name}: {key} without an error");
        let range = if key.ends_with("_deg") { 0.0..90.0 } else { 0.0..1.2 };
        assert!(range.contains(&value), "{name}: {key} = {value}");
    }
    let ledger = model["power_ledger"].as_object().expect("a ledger");
    let value = |key: &str| estimate(&ledger[key]).0;
    let fates = ["escaped", "absorbed", "lost"];
    let spent: f64 =
        ledger.keys().filter(|k| fates.iter().any(|f| k.starts_with(f))).map(|k| value(k)).sum();
    assert!((value("emitted") - 1.0).abs() < 1e-12, "{name}");
    assert!((spent - value("emitted")).abs() < 1e-9, "{name}: {spent} of the power accounted for");
    let lost: f64 = ledger.keys().filter(|k| k.starts_with("lost")).map(|k| value(k)).sum();
    assert!(lost < 1e-3, "{name}: {lost} lost");
    let extracted = value("out_of_domes") - value("back_into_domes");
    assert!((extracted - estimate(&model["extraction_efficiency"]).0).abs() < 1e-9, "{name}");
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

/// `files` of `results.json` lists everything under `out` but itself, with its hash.
///
/// # Panics
/// If it does not.
pub fn check_files(out: &Path, results: &Value) {
    let there: BTreeMap<String, String> = contents(out)
        .into_iter()
        .map(|(path, bytes)| (path.display().to_string(), sha256_hex(&bytes)))
        .filter(|(path, _)| path != "results.json")
        .collect();
    let text = |value: &Value| value.as_str().expect("text").to_owned();
    let listed = results["files"].as_array().expect("files");
    let listed = listed.iter().map(|entry| (text(&entry["file"]), text(&entry["sha256"])));
    assert_eq!(listed.collect::<BTreeMap<_, _>>(), there);
}

/// Starts `batwing`, waits until `ready`, presses Ctrl-C, and returns the exit code and standard
/// error.
///
/// # Panics
/// If it is not ready within five minutes.
pub fn interrupted(
    folder: &Path,
    arguments: &[&str],
    ready: impl Fn() -> bool,
) -> (Option<i32>, String) {
    signalled("-INT", folder, arguments, ready)
}

/// [`interrupted`] by a signal as `kill` calls it.
///
/// # Panics
/// As [`interrupted`].
pub fn signalled(
    signal: &str,
    folder: &Path,
    arguments: &[&str],
    ready: impl Fn() -> bool,
) -> (Option<i32>, String) {
    let mut child = Command::new(PATH)
        .args(arguments)
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it starts");
    let mut waited = false;
    for _ in 0..6000 {
        std::thread::sleep(Duration::from_millis(50));
        waited = ready();
        if waited || child.try_wait().is_ok_and(|ended| ended.is_some()) {
            break;
        }
    }
    let sent =
        Command::new("kill").args([signal, &child.id().to_string()]).status().expect("kill runs");
    let output = child.wait_with_output().expect("it ends");
    assert!(
        waited && sent.success(),
        "{arguments:?} ended before it was ready, or was not in five minutes"
    );
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

/// Names of files that are not whole, or hidden.
pub fn partial(folder: &Path) -> Vec<PathBuf> {
    let odd = |path: &PathBuf| {
        path.file_name().is_some_and(|n| {
            n.to_string_lossy().starts_with('.') || n.to_string_lossy().contains("partial")
        })
    };
    files(folder).into_iter().filter(odd).collect()
}
