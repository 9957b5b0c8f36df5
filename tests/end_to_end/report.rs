// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tests `batwing report`: the page of a run, its reproducibility, refusals.
//!
//! Source: `docs/reference/report.md`. `tests/report/page.mjs` tests the page in a browser.

use std::path::Path;

use crate::support::binary::batwing;
use crate::support::runs::{contents, run_small, small};
use serde_json::Value;

/// Standard error of a `report` that fails and changes nothing under `folder`.
fn refused(folder: &Path, arguments: &[&str]) -> String {
    let before = contents(folder);
    let mut command = batwing(folder);
    let output = command.arg("report").args(arguments).output().expect("it runs");
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{arguments:?}: {stderr}");
    assert!(output.stdout.is_empty() && !stderr.contains("panicked"), "{stderr}");
    assert_eq!(stderr.lines().count(), 1, "{stderr}");
    assert!(contents(folder) == before, "{arguments:?}: files changed");
    stderr
}

fn report(folder: &Path, arguments: &[&str]) -> (Value, String) {
    let mut command = batwing(folder);
    command.args(["report", "--json"]).args(arguments);
    let output = command.output().expect("it runs");
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{arguments:?}: {stderr}");
    (serde_json::from_slice(&output.stdout).expect("JSON"), stderr)
}

#[test]
fn a_run_becomes_a_page_and_a_folder_that_was_touched_does_not() {
    let folder = small();
    let at = |name: &str| folder.path().join(name);
    run_small(folder.path(), "run/out", &["--cache", "tables"]);
    let (said, warnings) = report(folder.path(), &["run/out", "--tables", "tables"]);
    assert_eq!(warnings, "");
    assert_eq!((&said["tables"], &said["tables_listed"]), (&2.into(), &2.into()));
    let page = std::fs::read_to_string(at("run/out/report.html")).expect("a page");
    assert_eq!(said["bytes"], page.len());
    assert!(page.starts_with("<!doctype html>") && page.ends_with("</html>\n"));
    assert!(
        page.contains("batwing: small")
            && page.contains("full run")
            && !page.contains("Quick run.")
    );
    for model in ["geometric, 100 µm", "geometric, 10 µm", "control, 10 µm", "hybrid, 10 µm"] {
        assert!(page.contains(&format!("<th scope=\"row\">{model}</th>")), "{model}");
    }
    report(folder.path(), &["run/out", "--tables", "tables", "--out", "again.html"]);
    assert!(std::fs::read_to_string(at("again.html")).expect("a page") == page, "the same bytes");
    // Without the tables it says how many are missing.
    let (said, warnings) = report(folder.path(), &["run/out", "--out", "without.html"]);
    assert_eq!(said["tables"], 0);
    assert!(warnings.contains("2 of 2 tables are not in `run/.batwing-cache`"), "{warnings}");

    refuses_what_is_none(folder.path());

    let results = at("run/out/results.json");
    let text = std::fs::read_to_string(&results).expect("readable");
    std::fs::write(&results, text.replacen("\"schema_version\": 4", "\"schema_version\": 1", 1))
        .expect("written");
    let old = refused(folder.path(), &["run/out"]);
    assert!(old.contains("`run/out/results.json`: schema_version: expected 4, got 1"), "{old}");
    std::fs::write(&results, text.replacen("\"uniformity\"", "\"evenness\"", 1)).expect("written");
    let renamed = refused(folder.path(), &["run/out"]);
    assert!(
        renamed.contains("content_sha256: `run/out/results.json` was altered after the run"),
        "{renamed}"
    );
    std::fs::write(&results, &text).expect("written");

    let map = at("run/out/small/control_10um/illuminance.exr");
    let bytes = std::fs::read(&map).expect("readable");
    std::fs::write(&map, &bytes[..bytes.len() - 1]).expect("written");
    let altered = refused(folder.path(), &["run/out"]);
    assert!(
        altered.contains("small/control_10um/illuminance.exr` was altered after the run"),
        "{altered}"
    );
    std::fs::remove_file(&map).expect("removed");
    let missing = refused(folder.path(), &["run/out"]);
    assert!(
        missing.contains("cannot read `run/out/small/control_10um/illuminance.exr`"),
        "{missing}"
    );
}

#[test]
fn a_study_becomes_a_page_with_its_targets() {
    let folder = small();
    let at = |name: &str| folder.path().join(name);
    let study = r#"
name = "planes"
designs = ["small.toml"]
models = ["geometric"]
paths = 10000

[[factors]]
name = "plane"
key = "receiver.plane_height_mm"
values = [3.0, 6.0]

[targets.small.geometric_100um]
extraction_efficiency = { at_least = 0.5 }
"#;
    std::fs::write(at("study.toml"), study).expect("written");
    let mut command = batwing(folder.path());
    let output = command.args(["study", "study.toml", "--out", "study"]).output().expect("it runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    report(folder.path(), &["study"]);
    let page = std::fs::read_to_string(at("study/report.html")).expect("a page");
    for words in [
        "1 of 1 asked is met",
        "<td data-label=\"asked\">at least 50 %</td>",
        "<th scope=\"row\">plane = 6.0</th>",
        "Change for one unit of a factor",
    ] {
        assert!(page.contains(words), "no {words}");
    }
    assert!(!page.contains("<script"));
    // A number that overflows what a picture makes of it, under a hash that is right.
    let sealed = at("study/study.json");
    let text = std::fs::read_to_string(&sealed).expect("readable");
    let mut json: Value = serde_json::from_str(&text).expect("JSON");
    let error = json.pointer_mut("/setups/0/figures/0/standard_error");
    *error.expect("a figure") = 1e308.into();
    let bytes = serde_json::to_string_pretty(&runtime::content_hash::sealed(json).expect("JSON"))
        .expect("JSON");
    std::fs::write(&sealed, bytes + "\n").expect("written");
    let huge = refused(folder.path(), &["study"]);
    assert!(huge.contains("expected a number of at most 1e100, got 1e308"), "{huge}");
    std::fs::write(&sealed, text).expect("written");
    let table = at("study/study.csv");
    let text = std::fs::read_to_string(&table).expect("readable");
    std::fs::write(&table, text + "\n").expect("written");
    let altered = refused(folder.path(), &["study"]);
    assert!(altered.contains("study.csv` was altered after the run"), "{altered}");
}

/// Arguments that name no folder, no tables or no place for a page.
fn refuses_what_is_none(folder: &Path) {
    for (arguments, words) in [
        (&["nowhere"][..], &["`nowhere`: expected a directory of results"][..]),
        (
            &["tables"],
            &[
                "`tables/results.json`",
                "written by `reproduce`, `run`, `optimise`, `study`, `tolerance`, `full-wave`, `zones` or `bsdf --films`",
            ],
        ),
        (&["small.toml"], &["`small.toml`: expected a directory of results, got a file"]),
        (
            &["run/out", "--tables", "run/out"],
            &[
                "results.json`: designs.small.hybrid_10um.tables[1].sha256: expected the table `run/out/",
            ],
        ),
        (
            &["run/out", "--out", "run"],
            &["--out: expected the name of a file, got the directory `run`"],
        ),
        (
            &["run/out", "--out", "run/out/results.json"],
            &["--out: expected a file beside the results, got `run/out/results.json`"],
        ),
        (
            &["run/out", "--out", "small.toml/page.html"],
            &["cannot write into `small.toml`", "expected a directory"],
        ),
    ] {
        let message = refused(folder, arguments);
        for word in words {
            assert!(message.contains(word), "{arguments:?}: no `{word}` in: {message}");
        }
    }
}
